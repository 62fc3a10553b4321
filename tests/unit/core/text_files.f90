!> Files written by tests.
module text_files
  implicit none
  private

  public :: write_file, write_bytes

contains

  !> Write a text as it is, without anything behind it.
  subroutine write_file(path, contents)
    character(*), intent(in) :: path, contents
    integer :: unit

    open (newunit=unit, file=path, access="stream", form="unformatted", status="replace")
    write (unit) contents
    close (unit)
  end subroutine write_file

  !> Write all byte values, as no text holds them.
  subroutine write_bytes(path)
    character(*), intent(in) :: path
    character(256) :: bytes
    integer :: i

    do i = 1, 256
      bytes(i:i) = achar(i - 1)
    end do
    call write_file(path, bytes)
  end subroutine write_bytes

end module text_files
