!> The global section of an IGES file: delimiters, units, scale (IGES 5.3, section 2.2.4.3); units
!! of length by name and by flag (2.2.4.3.14); and the free-form lists of values: delimited numbers
!! and Hollerith texts such as 3HABC (2.2.3).
module iges_global
  use kinds, only: wp
  use text, only: read_integer, read_real, to_text, upper_case
  use iges_directory, only: iges_lines_t, section_global, line_number, reject_line
  implicit none
  private

  public :: unit_in_mm, iges_global_t, read_global, token_list_t, split_tokens, token_text

  !> Names that a deck may give, as messages and the manual list them.
  character(*), parameter, public :: unit_names = "MM, CM, M, KM, UM, IN, FT, MI, MIL or UIN"

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

  !> Read the section; its errors are noted.
  subroutine read_global(file, global)
    type(iges_lines_t), intent(inout) :: file
    type(iges_global_t), intent(out) :: global
    character(:), allocatable :: text, problem, expected
    type(token_list_t) :: tokens
    integer :: i, at

    global%unit = "IN"
    allocate (character(n_columns*file%n(section_global)) :: text)
    do i = 1, file%n(section_global)
      associate (line => file%lines(line_number(file, section_global, i)))
        text(n_columns*(i - 1) + 1:n_columns*i) = line(:n_columns)
      end associate
    end do
    call find_delimiters(text, global%delimiters, problem)
    if (problem /= "") then
      call reject(file, 1, problem, "the delimiters first, such as 1H,,1H;")
      return
    end if
    call split_tokens(text, global%delimiters, tokens, problem, expected, at)
    if (problem /= "") then
      call reject(file, at, problem, expected)
    else
      call take_unit(file, tokens, global)
      call take_positive(file, tokens, 13, "model space scale", global%scale)
      call take_positive(file, tokens, 19, "resolution", global%resolution)
    end if
  end subroutine read_global

  !> The first two values name the delimiters, each as a text of one character or as a default.
  pure subroutine find_delimiters(text, delimiters, problem)
    character(*), intent(in) :: text
    character(2), intent(out) :: delimiters
    character(:), allocatable, intent(out) :: problem
    integer :: at

    delimiters = ",;"
    problem = ""
    at = max(1, verify(text, " "))
    if (index(text(at:), "1H") == 1 .and. len(text) > at + 4) then
      delimiters(1:1) = text(at + 2:at + 2)
      at = at + 3
    end if
    at = at + max(1, verify(text(at:), " ")) - 1
    if (text(at:at) == ";") return   ! everything has its default
    if (text(at:at) /= delimiters(1:1)) problem = "`"//text(at:at)//"` where the "// &
      "delimiter of values is expected to follow"
    at = at + 1
    if (at <= len(text)) at = at + max(1, verify(text(at:), " ")) - 1
    if (index(text(min(at, len(text)):), "1H") == 1 .and. len(text) > at + 1) then
      delimiters(2:2) = text(at + 2:at + 2)
    end if
    if (delimiters(1:1) == delimiters(2:2)) problem = "`"//delimiters(1:1)//"` as both delimiters"
    if (scan(delimiters, "0123456789+-.DEH ") > 0) problem = "the delimiters `"//delimiters// &
      "`, which numbers and texts are made of"
  end subroutine find_delimiters

  subroutine take_unit(file, tokens, global)
    type(iges_lines_t), intent(inout) :: file
    type(token_list_t), intent(in) :: tokens
    type(iges_global_t), intent(inout) :: global
    character(:), allocatable :: given
    integer :: flag
    logical :: is_number

    given = token_text(tokens, 14)
    flag = 1
    is_number = .true.
    if (given /= "") call read_integer(given, flag, is_number)
    if (.not. is_number) flag = 0
    if (flag == flag_by_name) then
      given = token_text(tokens, 15)
      flag = unit_flag(given)
      if (flag == 0) call reject_value(file, tokens, 15, "the name of the unit", &
                                       unit_names)
    else if (flag < 1 .or. flag > size(names)) then
      call reject_value(file, tokens, 14, "the unit flag", "a whole number from 1 to 11")
      flag = 0
    end if
    if (flag > 0) global%unit = trim(names(flag))
  end subroutine take_unit

  subroutine take_positive(file, tokens, number, name, value)
    type(iges_lines_t), intent(inout) :: file
    type(token_list_t), intent(in) :: tokens
    integer, intent(in) :: number      !! of the parameter
    character(*), intent(in) :: name
    real(wp), intent(inout) :: value   !! stays as it is where the file says nothing
    real(wp) :: given
    logical :: is_number

    if (token_text(tokens, number) == "") return
    call read_real(token_text(tokens, number), given, is_number)
    if (is_number .and. given >= 0.0_wp) then
      if (given > 0.0_wp) value = given
    else
      call reject_value(file, tokens, number, "the "//name, "a number above 0")
    end if
  end subroutine take_positive

  subroutine reject_value(file, tokens, number, name, expected)
    type(iges_lines_t), intent(inout) :: file
    type(token_list_t), intent(in) :: tokens
    integer, intent(in) :: number      !! of the parameter
    character(*), intent(in) :: name, expected

    call reject(file, tokens%first(max(1, min(number, tokens%n))), "`"// &
                token_text(tokens, number)//"` as parameter "//to_text(number)//", "//name, &
                expected)
  end subroutine reject_value

  !> Note an error at a position in the text of the section.
  subroutine reject(file, at, found, expected)
    type(iges_lines_t), intent(inout) :: file
    integer, intent(in) :: at
    character(*), intent(in) :: found, expected

    call reject_line(file, section_global, min((max(at, 1) - 1)/n_columns + 1, &
                                               file%n(section_global)), found, expected)
  end subroutine reject

  !> Split a text up to its record delimiter. `problem` is empty, or says what is wrong at `at`.
  pure subroutine split_tokens(text, delimiters, tokens, problem, expected, at)
    character(*), intent(in) :: text
    character(2), intent(in) :: delimiters   !! between values, after the last
    type(token_list_t), intent(out) :: tokens
    character(:), allocatable, intent(out) :: problem, expected
    integer, intent(out) :: at            !! in the text
    integer :: most, i

    most = 1 + count([(text(i:i) == delimiters(1:1), i=1, len(text))])
    tokens%text = text
    allocate (tokens%first(most), tokens%last(most), tokens%is_text(most))
    problem = ""
    expected = ""
    at = 1
    do
      at = next_filled(text, at)
      if (at > len(text)) then
        problem = "the end of the record without its delimiter"
        expected = "`"//delimiters(2:2)//"` after the last value"
        return
      end if
      tokens%n = tokens%n + 1
      call take_value(text, delimiters, at, tokens, problem, expected)
      if (problem /= "") return
      at = at + 1
      if (text(at - 1:at - 1) == delimiters(2:2)) exit
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

  !> Take the value at `at` and go to the delimiter after it.
  pure subroutine take_value(text, delimiters, at, tokens, problem, expected)
    character(*), intent(in) :: text
    character(2), intent(in) :: delimiters
    integer, intent(inout) :: at
    type(token_list_t), intent(inout) :: tokens
    character(:), allocatable, intent(inout) :: problem, expected
    integer :: length, n_digits
    logical :: is_number

    n_digits = verify(text(at:), digits) - 1
    if (n_digits < 0) n_digits = 0
    associate (first => tokens%first(tokens%n), last => tokens%last(tokens%n))
      first = at
      tokens%is_text(tokens%n) = .false.
      if (n_digits > 0 .and. at + n_digits <= len(text)) &
        tokens%is_text(tokens%n) = text(at + n_digits:at + n_digits) == "H"
      if (.not. tokens%is_text(tokens%n)) then
        length = scan(text(at:), delimiters) - 1
        if (length < 0) length = len(text) - at + 1
        last = at + len_trim(text(at:at + length - 1)) - 1
        at = at + length
      else
        call read_integer(text(at:at + n_digits - 1), length, is_number)
        first = at + n_digits + 1
        if (.not. is_number .or. length > len(text) - first + 1) then
          problem = "a text of "//text(at:at + min(n_digits, 12) - 1)//" characters"
          expected = "at most the "//to_text(len(text) - first + 1)//" that the record still has"
          return
        end if
        last = first + length - 1
        at = next_filled(text, last + 1)
      end if
    end associate
    if (at > len(text)) then
      problem = "the end of the record without its delimiter"
      expected = "`"//delimiters(2:2)//"` after the last value"
    else if (scan(text(at:at), delimiters) == 0) then
      problem = "`"//text(at:at)//"` after a text"
      expected = "`"//delimiters(1:1)//"` or `"//delimiters(2:2)//"`"
    end if
  end subroutine take_value

  !> The first position from `at` on that is not blank; beyond the end if there is none.
  pure integer function next_filled(text, at)
    character(*), intent(in) :: text
    integer, intent(in) :: at
    integer :: offset

    next_filled = len(text) + 1
    if (at > len(text)) return
    offset = verify(text(at:), " ")
    if (offset > 0) next_filled = at + offset - 1
  end function next_filled

end module iges_global
