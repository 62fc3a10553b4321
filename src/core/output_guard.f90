!> The one rule for the texts that a run writes beside its result: a file that is there already is
!! replaced only if this program has written it. Such files begin with a line that tells so.
module output_guard
  use, intrinsic :: iso_fortran_env, only: int64
  use system_files, only: is_no_file, kind_of_file
  implicit none
  private

  public :: why_left_alone

contains

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

end module output_guard
