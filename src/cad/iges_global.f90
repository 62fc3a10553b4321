!> The global section of an IGES file: delimiters, units, scale (IGES 5.3, section 2.2.4.3).
module iges_global
  use kinds, only: wp
  use input_errors, only: error_list_t, origin_t, new_origin, add_error
  use text, only: read_integer, read_real, to_text
  use length_units, only: flag_by_name, flag_name, unit_flag, unit_in_mm, unit_names
  use iges_lines, only: iges_lines_t, section_global, line_number
  use iges_tokens, only: token_list_t, split_tokens, token_text
  implicit none
  private

  public :: iges_global_t, read_global

  integer, parameter :: n_columns = 72   ! that hold values
  integer, parameter :: place_scale = 13, place_flag = 14, place_name = 15, place_resolution = 19

  !> What the reader needs of the section.
  type :: iges_global_t
    character(2) :: delimiters = ",;"     !! between values, behind the last
    character(:), allocatable :: unit     !! name of the unit of length
    real(wp) :: scale = 1.0_wp            !! length in the model over length of the real thing
    real(wp) :: resolution = 0.0_wp       !! smallest distance that counts, in the unit; 0: none
  end type iges_global_t

contains

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

end module iges_global
