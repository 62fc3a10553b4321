!> The global section of an IGES file: delimiters, units, scale (IGES 5.3, section 2.2.4.3); units
!! of length by name and by flag (2.2.4.3.14); and the free-form lists of values: delimited numbers
!! and Hollerith texts such as 3HABC (2.2.3).
module iges_global
  use kinds, only: wp
  use input_errors, only: error_list_t, origin_t, new_origin, add_error
  use text, only: read_integer, read_real, to_text, upper_case
  use iges_directory, only: iges_lines_t, section_global, line_number
  implicit none
  private

  public :: unit_in_mm, iges_global_t, read_global, token_list_t, split_tokens, token_text

  !> Names that a deck may give, separated by |.
  character(*), parameter, public :: unit_names = "MM|CM|M|KM|UM|IN|FT|MI|MIL|UIN"

  integer, parameter :: flag_by_name = 3   !! the flag that leaves the unit to its name

  character(3), parameter :: names(11) = [character(3) :: "IN", "MM", "", "FT", "MI", "M", "KM", &
                                          "MIL", "UM", "CM", "UIN"]
  real(wp), parameter :: millimetres(11) = [25.4_wp, 1.0_wp, 0.0_wp, 304.8_wp, 1609344.0_wp, &
                                            1.0e3_wp, 1.0e6_wp, 0.0254_wp, 1.0e-3_wp, 10.0_wp, &
                                            2.54e-5_wp]

  !> Values by their position in a text; a value that is left to its default has no characters.
  type :: token_list_t
    character(:), allocatable :: text
    integer :: n = 0
    integer, allocatable :: first(:), last(:)    !! shape (n)
    logical, allocatable :: is_text(:)           !! Hollerith, first and last without its count
  end type token_list_t

  character(*), parameter :: digits = "0123456789"

  integer, parameter :: n_columns = 72   ! that hold values
  integer, parameter :: place_scale = 13, place_flag = 14, place_name = 15, place_resolution = 19

  !> What the reader needs of the section.
  type :: iges_global_t
    character(2) :: delimiters = ",;"     !! between values, after the last
    character(:), allocatable :: unit     !! name of the unit of length
    real(wp) :: scale = 1.0_wp            !! length in the model over length of the real thing
    real(wp) :: resolution = 0.0_wp       !! smallest distance that counts, in the unit; 0: none
  end type iges_global_t

contains

  !> Flag of a unit; 0 for a name that is none. Case does not matter.
  pure integer function unit_flag(name) result(flag)
    character(*), intent(in) :: name

    do flag = size(names), 1, -1
      if (flag /= flag_by_name .and. names(flag) == upper_case(name)) return
    end do
    if (upper_case(name) == "INCH") flag = 1
  end function unit_flag

  !> Millimetres in a unit; 0 for a name that is none.
  pure real(wp) function unit_in_mm(name)
    character(*), intent(in) :: name
    integer :: flag

    unit_in_mm = 0.0_wp
    flag = unit_flag(name)
    if (flag > 0) unit_in_mm = millimetres(flag)
  end function unit_in_mm

  !> Name of a flag; empty for one that names no unit.
  pure function flag_name(flag) result(name)
    integer, intent(in) :: flag
    character(:), allocatable :: name

    name = ""
    if (flag >= 1 .and. flag <= size(names)) name = trim(names(flag))
  end function flag_name

  !> Read the section; its errors are noted.
  subroutine read_global(file, global, errors)
    type(iges_lines_t), intent(in) :: file
    type(iges_global_t), intent(out) :: global
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: text, problem, expected
    type(token_list_t) :: tokens
    integer :: i, place

    global%unit = "IN"
    allocate (character(n_columns*file%n(section_global)) :: text)
    do i = 1, file%n(section_global)
      associate (line => file%lines(line_number(file, section_global, i)))
        text(n_columns*(i - 1) + 1:n_columns*i) = line(:n_columns)
      end associate
    end do
    call find_delimiters(text, global%delimiters, problem)
    if (problem /= "") then
      call add_error(errors, origin_at(file, 1), problem, "the delimiters first, such as 1H,,1H;")
      return
    end if
    call split_tokens(text, global%delimiters, tokens, problem, expected, place)
    if (problem /= "") then
      call add_error(errors, origin_at(file, place), problem, expected)
    else
      call take_unit(file, tokens, global, errors)
      call take_positive(file, tokens, place_scale, "model space scale", global%scale, errors)
      call take_positive(file, tokens, place_resolution, "resolution", global%resolution, errors)
    end if
  end subroutine read_global

  !> The first two values name the delimiters, each as a text of one character or as a default.
  pure subroutine find_delimiters(text, delimiters, problem)
    character(*), intent(in) :: text
    character(2), intent(out) :: delimiters
    character(:), allocatable, intent(out) :: problem
    integer :: place

    delimiters = ",;"
    problem = ""
    place = max(1, verify(text, " "))
    if (index(text(place:), "1H") == 1 .and. len(text) > place + 4) then
      delimiters(1:1) = text(place + 2:place + 2)
      place = place + 3
    end if
    place = place + max(1, verify(text(place:), " ")) - 1
    if (text(place:place) == ";") return   ! everything has its default
    if (text(place:place) /= delimiters(1:1)) problem = "`"//text(place:place)//"` where the "// &
      "delimiter of values is expected to follow"
    place = place + 1
    if (place <= len(text)) place = place + max(1, verify(text(place:), " ")) - 1
    if (index(text(min(place, len(text)):), "1H") == 1 .and. len(text) > place + 1) then
      delimiters(2:2) = text(place + 2:place + 2)
    end if
    if (delimiters(1:1) == delimiters(2:2)) problem = "`"//delimiters(1:1)//"` as both delimiters"
    if (scan(delimiters, "0123456789+-.DEH ") > 0) problem = "the delimiters `"//delimiters// &
      "`, which numbers and texts are made of"
  end subroutine find_delimiters

  subroutine take_unit(file, tokens, global, errors)
    type(iges_lines_t), intent(in) :: file
    type(token_list_t), intent(in) :: tokens
    type(iges_global_t), intent(inout) :: global
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: flag_text
    integer :: flag
    logical :: is_number

    flag_text = token_text(tokens, place_flag)
    flag = 1
    is_number = .true.
    if (flag_text /= "") call read_integer(flag_text, flag, is_number)
    if (.not. is_number) flag = 0
    global%unit = flag_name(flag)
    if (flag == flag_by_name) then
      flag_text = token_text(tokens, place_name)
      global%unit = flag_name(unit_flag(flag_text))
    end if
    if (unit_in_mm(global%unit) > 0.0_wp) return
    if (flag == flag_by_name) then
      call add_error(errors, origin_of(file, tokens, place_name), "`"//flag_text//"` as "// &
                     "parameter 15, the name of the unit", "one of "//unit_names)
    else
      call add_error(errors, origin_of(file, tokens, place_flag), "`"//flag_text//"` as "// &
                     "parameter 14, the unit flag", "a whole number from 1 to 11")
    end if
  end subroutine take_unit

  subroutine take_positive(file, tokens, place, name, value, errors)
    type(iges_lines_t), intent(in) :: file
    type(token_list_t), intent(in) :: tokens
    integer, intent(in) :: place
    character(*), intent(in) :: name
    real(wp), intent(inout) :: value   !! stays as it is where the file says nothing
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: given
    real(wp) :: number
    logical :: is_number

    given = token_text(tokens, place)
    if (given == "") return
    call read_real(given, number, is_number)
    if (is_number .and. number >= 0.0_wp) then
      if (number > 0.0_wp) value = number
    else
      call add_error(errors, origin_of(file, tokens, place), "`"//given//"` as parameter "// &
                     to_text(place)//", the "//name, "a number above 0")
    end if
  end subroutine take_positive

  function origin_of(file, tokens, i) result(origin)
    type(iges_lines_t), intent(in) :: file
    type(token_list_t), intent(in) :: tokens
    integer, intent(in) :: i
    type(origin_t) :: origin

    origin = origin_at(file, tokens%first(max(1, min(i, tokens%n))))
  end function origin_of

  function origin_at(file, place) result(origin)
    type(iges_lines_t), intent(in) :: file
    integer, intent(in) :: place   !! in the values of the section
    type(origin_t) :: origin

    origin = new_origin(file%path, line_number(file, section_global, &
                        min((max(place, 1) - 1)/n_columns + 1, file%n(section_global))), &
                        "IGES section G")
  end function origin_at

  !> Split a text up to its record delimiter. `problem` is empty, or says what is wrong at `place`.
  pure subroutine split_tokens(text, delimiters, tokens, problem, expected, place)
    character(*), intent(in) :: text
    character(2), intent(in) :: delimiters   !! between values, after the last
    type(token_list_t), intent(out) :: tokens
    character(:), allocatable, intent(out) :: problem, expected
    integer, intent(out) :: place            !! in the text
    integer :: most

    most = 1 + count_of(text, delimiters(1:1))
    tokens%text = text
    allocate (tokens%first(most), tokens%last(most), tokens%is_text(most))
    problem = ""
    expected = ""
    place = 1
    do
      place = next_filled(text, place)
      if (place > len(text)) then
        problem = "the end of the record without its delimiter"
        expected = "`"//delimiters(2:2)//"` after the last value"
        return
      end if
      tokens%n = tokens%n + 1
      call take_value(text, delimiters, place, tokens, problem, expected)
      if (problem /= "") return
      place = place + 1
      if (text(place - 1:place - 1) == delimiters(2:2)) exit
    end do
  end subroutine split_tokens

  !> A value as given in the file; empty if it is left to its default.
  pure function token_text(tokens, i) result(value)
    type(token_list_t), intent(in) :: tokens
    integer, intent(in) :: i
    character(:), allocatable :: value

    value = ""
    if (i >= 1 .and. i <= tokens%n) value = tokens%text(tokens%first(i):tokens%last(i))
  end function token_text

  !> Take the value at `place` and go to the delimiter after it.
  pure subroutine take_value(text, delimiters, place, tokens, problem, expected)
    character(*), intent(in) :: text
    character(2), intent(in) :: delimiters
    integer, intent(inout) :: place
    type(token_list_t), intent(inout) :: tokens
    character(:), allocatable, intent(inout) :: problem, expected
    integer :: length, n_digits
    logical :: is_number

    n_digits = verify(text(place:), digits) - 1
    if (n_digits < 0) n_digits = 0
    associate (first => tokens%first(tokens%n), last => tokens%last(tokens%n))
      first = place
      tokens%is_text(tokens%n) = .false.
      if (n_digits > 0) tokens%is_text(tokens%n) = index(text(place + n_digits:), "H") == 1
      if (.not. tokens%is_text(tokens%n)) then
        length = scan(text(place:), delimiters) - 1
        if (length < 0) length = len(text) - place + 1
        last = place + len_trim(text(place:place + length - 1)) - 1
        place = place + length
      else
        call read_integer(text(place:place + n_digits - 1), length, is_number)
        first = place + n_digits + 1
        if (.not. is_number .or. length > len(text) - first + 1) then
          problem = "a text of "//text(place:place + min(n_digits, 12) - 1)//" characters"
          expected = "at most the "//to_text(len(text) - first + 1)//" that the record still has"
          return
        end if
        last = first + length - 1
        place = next_filled(text, last + 1)
      end if
    end associate
    if (place > len(text)) then
      problem = "the end of the record without its delimiter"
      expected = "`"//delimiters(2:2)//"` after the last value"
    else if (scan(text(place:place), delimiters) == 0) then
      problem = "`"//text(place:place)//"` after a text"
      expected = "`"//delimiters(1:1)//"` or `"//delimiters(2:2)//"`"
    end if
  end subroutine take_value

  !> The first position from `place` on that is not blank; beyond the end if there is none.
  pure integer function next_filled(text, place)
    character(*), intent(in) :: text
    integer, intent(in) :: place
    integer :: offset

    next_filled = len(text) + 1
    if (place > len(text)) return
    offset = verify(text(place:), " ")
    if (offset > 0) next_filled = place + offset - 1
  end function next_filled

  pure integer function count_of(text, character)
    character(*), intent(in) :: text
    character(1), intent(in) :: character
    integer :: i

    count_of = 0
    do i = 1, len(text)
      if (text(i:i) == character) count_of = count_of + 1
    end do
  end function count_of

end module iges_global
