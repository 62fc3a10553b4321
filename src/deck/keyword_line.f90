!> A keyword line: its keyword and its options.
module keyword_line
  use input_errors, only: origin_t, new_origin, error_list_t, add_error
  use text, only: upper_case, squeezed, to_text
  use field_split, only: split_fields, field_text
  use deck_limits, only: most_options, longest_name
  implicit none
  private

  public :: option_t, block_t, read_options, option_place

  !> One `NAME=value` of a keyword line, or a lone `NAME`.
  type :: option_t
    character(:), allocatable :: name    !! upper case, single blanks
    character(:), allocatable :: value   !! as written, without quotes
    logical :: has_value = .false.
  end type option_t

  !> A keyword line and the data lines `first` to `last` that belong to it.
  type :: block_t
    character(:), allocatable :: keyword       !! upper case, single blanks, without the star
    type(option_t), allocatable :: options(:)
    integer :: file = 0, line = 0              !! place of the keyword line
    integer :: first = 1, last = 0
  end type block_t

contains

  !> Keyword and options of a whole keyword line; underscores count as blanks in the keyword.
  subroutine read_options(line, file, block, errors)
    character(*), intent(in) :: line, file       !! and the file that it stands in
    type(block_t), intent(inout) :: block
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: first(:), last(:)
    character(:), allocatable :: closed, option, name
    type(origin_t) :: origin
    logical :: is_open
    integer :: i, equals, n

    is_open = mod(count([(line(i:i) == '"', i=1, len(line))]), 2) == 1
    closed = line(2:)//","
    if (is_open) closed = line(2:)//""","
    call split_fields(closed, first, last)
    block%keyword = closed(first(1):last(1))
    do i = 1, len(block%keyword)
      if (block%keyword(i:i) == "_") block%keyword(i:i) = " "
    end do
    block%keyword = squeezed(upper_case(block%keyword))
    origin = new_origin(file, block%line, "*"//block%keyword)
    n = min(size(first) - 1, most_options)
    if (n < size(first) - 1) call add_error(errors, origin, to_text(size(first) - 1)// &
                                            " options", "at most "//to_text(most_options))
    allocate (block%options(n))
    do i = 1, n
      option = closed(first(i + 1):last(i + 1))
      equals = index(option//"=", "=")
      name = squeezed(upper_case(option(:equals - 1)))
      if (option_place_before(block, name, i) > 0) then
        call add_error(errors, origin, "the option "//name//" twice", "each option once")
      end if
      block%options(i)%name = name
      block%options(i)%has_value = equals <= len(option)
      option = adjustl(option(min(equals, len(option)) + 1:))
      block%options(i)%value = field_text(option, 1, len(option))
      if (name == "NAME" .and. len(block%options(i)%value) > longest_name) &
        call add_error(errors, origin, "a name of "// &
                       to_text(len(block%options(i)%value))//" characters: "// &
                       block%options(i)%value, "at most "//to_text(longest_name))
    end do
    if (is_open) call add_error(errors, origin, "a quote that is not closed", "quotes in pairs")
  end subroutine read_options

  pure integer function option_place_before(block, name, i)
    type(block_t), intent(in) :: block
    character(*), intent(in) :: name
    integer, intent(in) :: i
    integer :: j

    option_place_before = 0
    do j = 1, i - 1
      if (block%options(j)%name == name) option_place_before = j
    end do
  end function option_place_before

  !> Place of the last option of that name, 0 if the keyword line has none.
  pure integer function option_place(block, name)
    type(block_t), intent(in) :: block
    character(*), intent(in) :: name
    integer :: i

    option_place = 0
    do i = 1, size(block%options)
      if (block%options(i)%name == name) option_place = i
    end do
  end function option_place

end module keyword_line
