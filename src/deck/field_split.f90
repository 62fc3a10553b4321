!> A line taken apart into its fields.
module field_split
  implicit none
  private

  public :: split_fields, field_text

contains

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

end module field_split
