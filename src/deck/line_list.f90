!> The data lines of a deck with their places, stored end to end in one text.
module line_list
  implicit none
  private

  public :: line_list_t, append_line, append_text, line_text

  !> Lines 1 to `n_lines`; all arrays are grown by doubling, so longer than what they hold.
  type :: line_list_t
    integer :: n_lines = 0
    integer, allocatable :: last(:)          !! place in `characters` where line i ends, from 0 on
    integer, allocatable :: file(:)          !! number of the file that the line stands in
    integer, allocatable :: number(:)        !! line number in that file
    character(:), allocatable :: characters
  end type line_list_t

contains

  !> Add a line to the end of the list.
  pure subroutine append_line(list, line, file, number)
    type(line_list_t), intent(inout) :: list
    character(*), intent(in) :: line
    integer, intent(in) :: file, number
    integer :: n_characters, n

    if (.not. allocated(list%last)) then
      allocate (list%last(0:64), list%file(64), list%number(64))
      list%last(0) = 0
    end if
    n = list%n_lines
    if (n == size(list%file)) then
      call lengthen(list%last, 0)
      call lengthen(list%file, 1)
      call lengthen(list%number, 1)
    end if
    n_characters = list%last(n)
    call append_text(list%characters, n_characters, line)
    list%n_lines = n + 1
    list%last(n + 1) = n_characters
    list%file(n + 1) = file
    list%number(n + 1) = number
  end subroutine append_line

  !> Line `i` of the list.
  pure function line_text(list, i) result(line)
    type(line_list_t), intent(in) :: list
    integer, intent(in) :: i
    character(:), allocatable :: line

    line = list%characters(list%last(i - 1) + 1:list%last(i))
  end function line_text

  !> Add to a text of which the first `n_used` characters are in use, in time linear in all.
  pure subroutine append_text(characters, n_used, addition)
    character(:), allocatable, intent(inout) :: characters
    integer, intent(inout) :: n_used
    character(*), intent(in) :: addition
    character(:), allocatable :: longer

    if (.not. allocated(characters)) allocate (character(256) :: characters)
    if (n_used + len(addition) > len(characters)) then
      allocate (character(2*(n_used + len(addition))) :: longer)
      longer(:n_used) = characters(:n_used)
      call move_alloc(longer, characters)
    end if
    characters(n_used + 1:n_used + len(addition)) = addition
    n_used = n_used + len(addition)
  end subroutine append_text

  pure subroutine lengthen(list, first)
    integer, allocatable, intent(inout) :: list(:)
    integer, intent(in) :: first   !! lower bound of the list
    integer, allocatable :: longer(:)

    allocate (longer(first:2*ubound(list, 1)))
    longer(first:ubound(list, 1)) = list
    call move_alloc(longer, list)
  end subroutine lengthen

end module line_list
