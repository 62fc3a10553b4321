!> The data lines of a deck, stored end to end in one text, and the fields of a line.
module data_lines
  implicit none
  private

  public :: line_list_t, append_line, append_text, line_text, split_fields, field_text

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

  !> Bounds of the fields of a line, without the blanks around them.
  !! Commas separate; in a line without commas blanks do. Empty fields count, except one after the
  !! last comma. A comma in quotes separates nothing.
  pure subroutine split_fields(line, first, last)
    character(*), intent(in) :: line
    integer, allocatable, intent(out) :: first(:), last(:)   !! shape (number of fields)
    logical :: is_in_quotes, is_comma_separated
    integer :: i, n, start

    allocate (first(len(line) + 1), last(len(line) + 1))
    is_comma_separated = has_bare_comma(line)
    is_in_quotes = .false.
    n = 0
    start = 1
    do i = 1, len(line) + 1
      if (i <= len(line)) then
        if (line(i:i) == '"') is_in_quotes = .not. is_in_quotes
        if (is_in_quotes) cycle
        if (is_comma_separated .and. line(i:i) /= ",") cycle
        if (.not. is_comma_separated .and. line(i:i) /= " ") cycle
      end if
      if (is_comma_separated .or. start < i) then
        n = n + 1
        call strip(line, start, i - 1, first(n), last(n))
      end if
      start = i + 1
    end do
    if (n > 1) then
      if (last(n) < first(n)) n = n - 1
    end if
    first = first(:n)
    last = last(:n)
  end subroutine split_fields

  !> A field without the quotes around it.
  pure function field_text(line, first, last) result(field)
    character(*), intent(in) :: line
    integer, intent(in) :: first, last   !! from `split_fields`
    character(:), allocatable :: field

    field = line(first:last)
    if (len(field) < 2) return
    if (field(1:1) == '"' .and. field(len(field):) == '"') field = field(2:len(field) - 1)
  end function field_text

  pure logical function has_bare_comma(line)
    character(*), intent(in) :: line
    logical :: is_in_quotes
    integer :: i

    is_in_quotes = .false.
    has_bare_comma = .false.
    do i = 1, len(line)
      if (line(i:i) == '"') is_in_quotes = .not. is_in_quotes
      has_bare_comma = line(i:i) == "," .and. .not. is_in_quotes
      if (has_bare_comma) exit
    end do
  end function has_bare_comma

  pure subroutine strip(line, start, finish, first, last)
    character(*), intent(in) :: line
    integer, intent(in) :: start, finish
    integer, intent(out) :: first, last

    first = start
    last = finish
    do while (first <= last)
      if (line(first:first) /= " ") exit
      first = first + 1
    end do
    do while (last >= first)
      if (line(last:last) /= " ") exit
      last = last - 1
    end do
  end subroutine strip

end module data_lines
