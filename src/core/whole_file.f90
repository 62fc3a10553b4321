!> Text files that exist as a whole or not at all, and the one rule for the texts that a run writes
!! besides its result: an existing file is replaced only if this program has written it. Such files
!! begin with a line that says so.
module whole_file
  use, intrinsic :: iso_fortran_env, only: int64
  use text, only: string_t
  use system_files, only: true_path, remove_file, bytes_on_disk, why_protected, is_no_file, &
                          draft_ending, kind_of_file, install_file
  implicit none
  private

  public :: write_lines, read_whole_file, take_line, is_of_size, why_left_alone

contains

  !> Write lines to a file of their own, bring it to the disk, and put it in the place of an older
  !! one, where the name leads to. On failure that stays.
  subroutine write_lines(path, lines, why)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: lines(:)
    character(:), allocatable, intent(out) :: why   !! what failed; empty if nothing did
    character(:), allocatable :: new
    character(256) :: message
    integer(int64) :: n_bytes
    integer :: unit, status, i

    why = why_protected(path)
    if (why /= "") then
      why = "cannot write it: "//why
      return
    end if
    new = true_path(path)//draft_ending
    call remove_file(new)
    open (newunit=unit, file=new, action="write", status="replace", iostat=status, iomsg=message)
    if (status == 0) then
      n_bytes = 0
      do i = 1, size(lines)
        if (status == 0) write (unit, "(a)", iostat=status, iomsg=message) lines(i)%value
        n_bytes = n_bytes + len(lines(i)%value) + 1
      end do
      if (status == 0) close (unit, iostat=status, iomsg=message)
      if (status /= 0) close (unit, iostat=i)
    end if
    if (status /= 0) then
      why = "cannot write it: "//trim(message)
    else if (.not. is_of_size(new, n_bytes)) then
      why = "cannot write all of it; is the disk full?"
    else
      call install_file(new, true_path(path), why)
    end if
    if (why /= "") call remove_file(new)
  end subroutine write_lines

  !> Has the file all bytes that were written to it? WRITE and CLOSE of gfortran do not report
  !! those that a full disk did not take.
  logical function is_of_size(path, n_bytes)
    character(*), intent(in) :: path
    integer(int64), intent(in) :: n_bytes

    is_of_size = bytes_on_disk(path) == n_bytes
  end function is_of_size

  !> A file as one text; empty if it cannot be read or is no plain file.
  subroutine read_whole_file(path, content, is_there)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: content
    logical, intent(out) :: is_there
    integer :: unit, status, length

    content = ""
    is_there = .false.
    if (is_no_file(path)) return
    open (newunit=unit, file=path, access="stream", form="unformatted", action="read", &
          status="old", iostat=status)
    if (status /= 0) return
    inquire (unit=unit, size=length)
    deallocate (content)
    allocate (character(max(0, length)) :: content)
    read (unit, iostat=status) content
    is_there = status == 0
    if (.not. is_there) content = ""
    close (unit)
  end subroutine read_whole_file

  !> The line of a text from `place` on, without its line feed; `place` moves to the start of the
  !! next, after the last one beyond the end.
  pure subroutine take_line(content, place, line)
    character(*), intent(in) :: content
    integer, intent(inout) :: place
    character(:), allocatable, intent(out) :: line
    integer :: length

    length = index(content(place:), new_line("a")) - 1
    if (length < 0) length = len(content) - place + 1
    line = content(place:place + length - 1)
    place = place + length + 1
  end subroutine take_line

  !> Why a file may not be written under this name; empty if it may. It may where there is none,
  !! an empty one, or one whose first line begins as `mark` does; what stands in brackets, such as
  !! the units of a table, does not count. A link counts as what it leads to. Nothing but a plain
  !! file is opened, for a pipe keeps who opens it waiting.
  function why_left_alone(path, mark, what) result(why)
    character(*), intent(in) :: path
    character(*), intent(in) :: mark     !! how the first line begins
    character(*), intent(in) :: what     !! the kind of file, for the words
    character(:), allocatable :: why
    character(:), allocatable :: start
    logical :: is_read

    why = ""
    if (is_no_file(path)) then
      why = "there is a "//kind_of_file(path)//" of this name; it is left alone"
      return
    else if (kind_of_file(path) == "") then
      return
    end if
    call read_start(path, 4*len(mark) + 100, start, is_read)
    if (.not. is_read) then
      why = "there is a file of this name that cannot be read; it is left alone"
    else if (start /= "" .and. index(without_brackets(start), without_brackets(mark)) /= 1) then
      why = "there is a file of this name that is no "//what//" of igaform; it is left alone"
    end if
  end function why_left_alone

  !> The first line of a file, or its first part.
  subroutine read_start(path, longest, start, is_read)
    character(*), intent(in) :: path
    integer, intent(in) :: longest
    character(:), allocatable, intent(out) :: start
    logical, intent(out) :: is_read
    integer(int64) :: n_bytes
    integer :: unit, status, n

    start = ""
    open (newunit=unit, file=path, access="stream", form="unformatted", action="read", &
          status="old", iostat=status)
    is_read = status == 0
    if (.not. is_read) return
    inquire (unit=unit, size=n_bytes)
    deallocate (start)
    n = int(max(0_int64, min(n_bytes, int(longest, int64))))
    allocate (character(n) :: start)
    if (len(start) > 0) read (unit, iostat=status) start
    close (unit)
    is_read = status == 0
    n = index(start, new_line("a"))
    if (n > 1) start = start(:n - 1)
  end subroutine read_start

  !> The text without what stands in [brackets].
  pure function without_brackets(text) result(rest)
    character(*), intent(in) :: text
    character(:), allocatable :: rest
    logical :: is_inside
    integer :: i

    rest = ""
    is_inside = .false.
    do i = 1, len(text)
      is_inside = is_inside .or. text(i:i) == "["
      if (.not. is_inside) rest = rest//text(i:i)
      is_inside = is_inside .and. text(i:i) /= "]"
    end do
  end function without_brackets

end module whole_file
