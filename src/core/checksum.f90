!> Checksums of files, to distinguish a whole file from a damaged one.
module checksum
  use, intrinsic :: iso_fortran_env, only: int32, int64
  use system_files, only: is_no_file
  implicit none
  private

  public :: checksum_t, add_words, checksum_text, file_checksum, contents_checksum

  integer, parameter, public :: block_words = 32768   !! most words at a time

  !> Two running sums of 32-bit words, the second of which knows their order: J. G. Fletcher, An
  !! arithmetic checksum for serial transmissions, IEEE Trans. Comm. 30 (1982), with 32 bits and the
  !! largest prime below 2^32 as Adler did with 16.
  type :: checksum_t
    integer(int64) :: sums(2) = [1_int64, 0_int64]
  end type checksum_t

contains

  !> Add up to `block_words` words.
  pure subroutine add_words(checksum, words)
    type(checksum_t), intent(inout) :: checksum
    integer(int32), intent(in) :: words(:)
    integer(int64), parameter :: prime = 4294967291_int64, low = 4294967295_int64
    integer(int64) :: first, second
    integer :: i

    first = checksum%sums(1)
    second = checksum%sums(2)
    do i = 1, size(words)   ! up to 2^15 words: the sums stay below 2^62
      first = first + iand(int(words(i), int64), low)
      second = second + first
    end do
    checksum%sums = modulo([first, second], prime)
  end subroutine add_words

  !> Sixteen hexadecimal digits.
  function checksum_text(checksum) result(text)
    type(checksum_t), intent(in) :: checksum
    character(16) :: text

    write (text, "(2z8.8)") checksum%sums
  end function checksum_text

  !> Checksum of the first bytes of a file, zeros filling the last word; empty if it cannot be read
  !! or is no plain file.
  function file_checksum(path, n_bytes) result(text)
    character(*), intent(in) :: path
    integer(int64), intent(in), optional :: n_bytes   !! absent: all
    character(:), allocatable :: text, block
    type(checksum_t) :: checksum
    integer(int64) :: left
    integer :: unit, status, n

    text = ""
    if (is_no_file(path)) return
    open (newunit=unit, file=path, access="stream", form="unformatted", action="read", &
          status="old", iostat=status)
    if (status /= 0) return
    inquire (unit=unit, size=left)
    if (present(n_bytes)) left = n_bytes
    allocate (character(4*block_words) :: block)
    do while (left > 0 .and. status == 0)
      n = int(min(left, int(len(block), int64)))
      read (unit, iostat=status) block(:n)
      call add_bytes(checksum, block(:n))
      left = left - n
    end do
    close (unit)
    if (status == 0) text = checksum_text(checksum)
  end function file_checksum

  !> What `file_checksum` gives of a file with these contents.
  function contents_checksum(contents) result(text)
    character(*), intent(in) :: contents
    character(:), allocatable :: text
    type(checksum_t) :: checksum
    integer :: first

    do first = 1, len(contents), 4*block_words
      call add_bytes(checksum, contents(first:min(first + 4*block_words - 1, len(contents))))
    end do
    text = checksum_text(checksum)
  end function contents_checksum

  !> Add the bytes of up to `block_words` words, zeros filling the last one.
  pure subroutine add_bytes(checksum, bytes)
    type(checksum_t), intent(inout) :: checksum
    character(*), intent(in) :: bytes
    integer(int32), allocatable :: words(:)   ! not on the stack, which may be small

    words = transfer(bytes//repeat(achar(0), modulo(-len(bytes), 4)), [0_int32])
    call add_words(checksum, words)
  end subroutine add_bytes

end module checksum
