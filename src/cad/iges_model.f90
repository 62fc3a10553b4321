!> The entities of an IGES file, the values of each, and its transformation: entity 124, which may
!! itself be transformed by another. A value that is not what it should be is an input error with
!! its line, its position in the list and its name.
module iges_model
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use input_errors, only: error_list_t, origin_t, new_origin, add_error, add_warning
  use text, only: read_integer, read_real, to_text
  use iges_directory, only: iges_lines_t, read_iges_lines, line_number, section_parameters, &
                            section_directory, entry_t, read_directory, entry_name
  use iges_global, only: token_list_t, split_tokens, token_text, iges_global_t, read_global
  implicit none
  private

  public :: iges_model_t, values_t, read_iges_model, open_values, get_integer, get_reals, &
            get_entry, entry_origin, reject, get_matrix, moved

  integer, parameter :: n_columns = 64   ! of a line of the parameter section that hold values

  !> A file whose lines, global section and directory are sound.
  type :: iges_model_t
    type(iges_lines_t) :: file
    type(iges_global_t) :: global
    type(entry_t), allocatable :: entries(:)
  end type iges_model_t

  !> The values of an entity, counted after its type.
  type :: values_t
    integer :: entry = 0               !! position in `iges_model_t%entries`
    integer :: n = 0
    type(token_list_t) :: tokens
    logical :: is_valid = .true.       !! nothing wrong so far
  end type values_t

  integer, parameter :: type_matrix = 124
  real(wp), parameter :: loosest = 1.0e-3_wp     ! how far rows may be from unit and upright
  real(wp), parameter :: flattest = 1.0e-6_wp    ! volume of the unit cube afterwards

contains

  !> Read a file up to its directory. The model is of use only if no error was added.
  subroutine read_iges_model(path, model, errors)
    character(*), intent(in) :: path
    type(iges_model_t), intent(out) :: model
    type(error_list_t), intent(inout) :: errors
    integer :: n_before

    n_before = errors%n_items
    call read_iges_lines(path, model%file, errors)
    if (errors%n_items > n_before) return
    call read_global(model%file, model%global, errors)
    call read_directory(model%file, model%entries, errors)
  end subroutine read_iges_model

  !> Take the values of an entity apart.
  subroutine open_values(model, entry, values, errors)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry   !! position in the list of entries
    type(values_t), intent(out) :: values
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: text, problem, expected
    integer :: i, place, type, owner
    logical :: is_number

    values%entry = entry
    associate (item => model%entries(entry), file => model%file)
      allocate (character(n_columns*item%n_lines) :: text)
      do i = 1, item%n_lines
        associate (line => file%lines(line_number(file, section_parameters, item%first + i - 1)))
          text(n_columns*(i - 1) + 1:n_columns*i) = line(:n_columns)
          call read_integer(trim(adjustl(line(n_columns + 1:72))), owner, is_number)
          if (line(n_columns + 1:72) == "" .or. (is_number .and. owner == 2*entry - 1)) cycle
          call reject(model, values, n_columns*(i - 1) + 1, "`"// &
                      trim(adjustl(line(n_columns + 1:72)))//"` in columns 65 to 72", &
                      "the directory number "//to_text(2*entry - 1), errors)
          return
        end associate
      end do
      call split_tokens(text, model%global%delimiters, values%tokens, problem, expected, place)
      if (problem /= "") then
        call reject(model, values, place, problem, expected, errors)
        return
      end if
      values%n = values%tokens%n - 1
      call read_integer(token_text(values%tokens, 1), type, is_number)
      if (is_number .and. type == item%type) return
      call reject(model, values, 1, "`"//token_text(values%tokens, 1)//"` as the first value", &
                  "its type "//to_text(item%type), errors)
    end associate
  end subroutine open_values

  !> A whole number; 0 where it is left to its default. The bounds are those of what makes sense.
  integer function get_integer(model, values, place, name, low, high, errors) result(number)
    type(iges_model_t), intent(in) :: model
    type(values_t), intent(inout) :: values
    integer, intent(in) :: place, low, high
    character(*), intent(in) :: name
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: given, bounds
    logical :: is_number

    number = max(low, 0)
    if (.not. values%is_valid) return
    given = token_text(values%tokens, place + 1)
    is_number = .true.
    number = 0
    if (given /= "") call read_integer(given, number, is_number)
    if (is_number .and. number >= low .and. number <= high) return
    number = max(low, 0)
    bounds = "a whole number from "//to_text(low)
    if (high < huge(high)) bounds = bounds//" to "//to_text(high)
    if (high == huge(high)) bounds = bounds//" on"
    call reject_value(model, values, place, name, bounds, errors)
  end function get_integer

  !> A number; 0 where it is left to its default.
  real(wp) function get_real(model, values, place, name, errors) result(number)
    type(iges_model_t), intent(in) :: model
    type(values_t), intent(inout) :: values
    integer, intent(in) :: place
    character(*), intent(in) :: name
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: given
    logical :: is_number

    number = 0.0_wp
    if (.not. values%is_valid) return
    given = token_text(values%tokens, place + 1)
    if (given == "") return
    call read_real(given, number, is_number)
    if (.not. is_number) call reject_value(model, values, place, name, "a number", errors)
  end function get_real

  !> Several numbers from `place` on.
  function get_reals(model, values, place, n, name, errors) result(numbers)
    type(iges_model_t), intent(in) :: model
    type(values_t), intent(inout) :: values
    integer, intent(in) :: place, n   !! the caller has made sure that there are as many
    character(*), intent(in) :: name
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: numbers(:)
    integer :: i

    allocate (numbers(n), source=0.0_wp)
    do i = 1, n
      numbers(i) = get_real(model, values, place + i - 1, name, errors)
      if (.not. values%is_valid) return
    end do
  end function get_reals

  !> Position in the list of entries of an entity that a value points to; 0 if there is none.
  integer function get_entry(model, values, place, name, errors) result(entry)
    type(iges_model_t), intent(in) :: model
    type(values_t), intent(inout) :: values
    integer, intent(in) :: place
    character(*), intent(in) :: name
    type(error_list_t), intent(inout) :: errors
    integer :: last

    last = 2*size(model%entries) - 1
    entry = get_integer(model, values, place, name, 1, last, errors)
    if (values%is_valid .and. mod(entry, 2) == 0) then
      call reject_value(model, values, place, name, "an odd directory number from 1 to "// &
                        to_text(last), errors)
    end if
    entry = (entry + 1)/2
    if (.not. values%is_valid) entry = 0
  end function get_entry

  !> Where an entity is in the directory.
  function entry_origin(model, entry) result(origin)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    type(origin_t) :: origin

    origin = new_origin(model%file%path, line_number(model%file, section_directory, 2*entry - 1), &
                        "IGES "//entry_name(model%entries, entry))
  end function entry_origin

  subroutine reject_value(model, values, place, name, expected, errors)
    type(iges_model_t), intent(in) :: model
    type(values_t), intent(inout) :: values
    integer, intent(in) :: place
    character(*), intent(in) :: name, expected
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: given

    given = token_text(values%tokens, place + 1)
    if (len(given) > 30) given = given(:30)//"..."
    if (given == "") then
      given = "nothing"
    else
      given = "`"//given//"`"
    end if
    call reject(model, values, &
                values%tokens%first(max(1, min(place + 1, values%tokens%n))), &
                given//" as parameter "//to_text(place)//", "//name, expected, errors)
  end subroutine reject_value

  !> Note an error of the parameters; the entity is of no use any more.
  subroutine reject(model, values, place, found, expected, errors)
    type(iges_model_t), intent(in) :: model
    type(values_t), intent(inout) :: values
    integer, intent(in) :: place      !! in the text of the values
    character(*), intent(in) :: found, expected
    type(error_list_t), intent(inout) :: errors
    integer :: line

    values%is_valid = .false.
    associate (item => model%entries(values%entry))
      line = item%first + min((max(place, 1) - 1)/n_columns, item%n_lines - 1)
    end associate
    call add_error(errors, new_origin(model%file%path, &
                                      line_number(model%file, section_parameters, line), &
                                      "IGES "//entry_name(model%entries, values%entry)//", P"// &
                                      to_text(line)), found, expected)
  end subroutine reject

  !> The whole transformation of an entity, x -> matrix(:, 1:3) x + matrix(:, 4) [unit of the file].
  subroutine get_matrix(model, entry, matrix, is_valid, errors)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry   !! position in the list of entries
    real(wp), intent(out) :: matrix(3, 4)
    logical, intent(out) :: is_valid
    type(error_list_t), intent(inout) :: errors
    real(wp) :: outer(3, 4)
    integer :: at, next, n_done

    matrix = 0.0_wp
    matrix(1, 1) = 1.0_wp
    matrix(2, 2) = 1.0_wp
    matrix(3, 3) = 1.0_wp
    is_valid = .true.
    at = entry
    n_done = 0
    do while (model%entries(at)%matrix /= 0 .and. is_valid)
      next = model%entries(at)%matrix
      call check_pointer(model, at, is_valid, errors)
      if (.not. is_valid) return
      n_done = n_done + 1
      if (n_done > size(model%entries)) then
        call add_error(errors, entry_origin(model, entry), "a transformation that refers to "// &
                       "itself", "a chain of transformations that ends")
        is_valid = .false.
        return
      end if
      at = (next + 1)/2
      call read_matrix(model, at, outer, is_valid, errors)
      if (.not. is_valid) return
      matrix(:, 4) = matmul(outer(:, :3), matrix(:, 4)) + outer(:, 4)
      matrix(:, :3) = matmul(outer(:, :3), matrix(:, :3))
    end do
    if (all(ieee_is_finite(matrix))) return
    call add_error(errors, entry_origin(model, entry), "a transformation with non-finite values", &
                   "finite coordinates")
    is_valid = .false.
  end subroutine get_matrix

  !> Points where a transformation takes them; those of an entity without one stay bit for bit.
  pure function moved(matrix, points) result(there)
    real(wp), intent(in) :: matrix(3, 4)
    real(wp), intent(in) :: points(:, :)   !! shape (n, 3)
    real(wp), allocatable :: there(:, :)   !! shape (n, 3)
    integer :: c

    there = points
    do c = 1, 3
      there(:, c) = points(:, 1)*matrix(c, 1) + points(:, 2)*matrix(c, 2) &
                    + points(:, 3)*matrix(c, 3) + matrix(c, 4)
    end do
  end function moved

  !> The transformation that an entity names must be one.
  subroutine check_pointer(model, entry, is_valid, errors)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    logical, intent(out) :: is_valid
    type(error_list_t), intent(inout) :: errors
    integer :: number

    number = model%entries(entry)%matrix
    is_valid = number > 0 .and. mod(number, 2) == 1 .and. number < 2*size(model%entries)
    if (.not. is_valid) then
      call add_error(errors, entry_origin(model, entry), "transformation matrix "// &
                     to_text(number), "an odd directory number from 1 to "// &
                     to_text(2*size(model%entries) - 1)//", or 0 for none")
    else if (model%entries((number + 1)/2)%type /= type_matrix) then
      call add_error(errors, entry_origin(model, entry), entry_name(model%entries, &
                                                                    (number + 1)/2)// &
                     " as its transformation", "a transformation matrix, entity 124")
      is_valid = .false.
    end if
  end subroutine check_pointer

  subroutine read_matrix(model, entry, matrix, is_valid, errors)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    real(wp), intent(out) :: matrix(3, 4)
    logical, intent(out) :: is_valid
    type(error_list_t), intent(inout) :: errors
    type(values_t) :: values
    integer :: i, j, form
    logical :: is_known

    call open_values(model, entry, values, errors)
    do i = 1, 3
      do j = 1, 4
        matrix(i, j) = get_real(model, values, 4*(i - 1) + j, "a component of the matrix", errors)
      end do
    end do
    form = model%entries(entry)%form
    is_known = is_reported(errors, entry_origin(model, entry))
    is_valid = values%is_valid
    if (.not. is_valid) return
    is_valid = any(form == [0, 1, 10])
    if (.not. is_valid) then
      call add_error(errors, entry_origin(model, entry), "form "//to_text(form), &
                     "a Cartesian transformation: form 0, 1 or 10")
    else if (.not. abs(determinant(matrix(:, :3))) > flattest) then
      call add_error(errors, entry_origin(model, entry), "a matrix that flattens what it "// &
                     "transforms", "a rotation")
      is_valid = .false.
    else if (stretch(matrix(:, :3)) > loosest .and. .not. is_known) then
      call add_warning(errors, entry_origin(model, entry), "a matrix that stretches what it "// &
                       "transforms; it is applied as it is", "a rotation")
    end if
  end subroutine read_matrix

  !> Largest deviation of the columns from unit length and right angles.
  pure real(wp) function stretch(a)
    real(wp), intent(in) :: a(3, 3)
    real(wp) :: product(3, 3)
    integer :: i

    product = matmul(transpose(a), a)
    do i = 1, 3
      product(i, i) = product(i, i) - 1.0_wp
    end do
    stretch = maxval(abs(product))
  end function stretch

  pure real(wp) function determinant(a)
    real(wp), intent(in) :: a(3, 3)

    determinant = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) &
                  - a(1, 2)*(a(2, 1)*a(3, 3) - a(2, 3)*a(3, 1)) &
                  + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
  end function determinant

  !> Has this position been reported already?
  logical function is_reported(errors, origin)
    type(error_list_t), intent(in) :: errors
    type(origin_t), intent(in) :: origin
    integer :: i

    is_reported = .false.
    do i = 1, errors%n_items
      associate (other => errors%items(i)%origin)
        is_reported = is_reported .or. (other%line == origin%line .and. other%file == origin%file)
      end associate
    end do
  end function is_reported

end module iges_model
