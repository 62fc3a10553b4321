!> The entities of an IGES file, the values of each, and its transformation: entity 124, which may
!! itself be transformed by another. A value that is not what it should be is an input error with
!! its line, its position in the list and its name.
module iges_model
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use linear_algebra, only: cross
  use input_errors, only: origin_t, new_origin, add_error, add_warning
  use text, only: read_integer, read_real, to_text
  use iges_directory, only: iges_lines_t, read_iges_lines, line_number, section_parameters, &
                            section_directory, entry_t, read_directory, entry_name
  use iges_global, only: token_list_t, split_tokens, token_text, iges_global_t, read_global
  implicit none
  private

  public :: iges_model_t, values_t, read_iges_model, open_values, get_integer, get_reals, &
            get_entry, entry_origin, reject, reject_entity, transform

  integer, parameter :: n_columns = 64   ! of a line of the parameter section that hold values

  !> A file whose lines, global section and directory are sound.
  type :: iges_model_t
    type(iges_lines_t) :: file
    type(iges_global_t) :: global
    type(entry_t), allocatable :: entries(:)
    logical :: is_valid = .true.       !! nothing wrong so far with the surface that is being read
  end type iges_model_t

  !> The values of an entity, counted after its type.
  type :: values_t
    integer :: entry = 0               !! position in `iges_model_t%entries`
    integer :: n = 0
    type(token_list_t) :: tokens
  end type values_t

contains

  !> Read a file up to its directory. The model is of use only if no error was added.
  subroutine read_iges_model(path, model)
    character(*), intent(in) :: path
    type(iges_model_t), intent(inout) :: model   !! with the errors before
    integer :: n_before

    n_before = model%file%errors%n_items
    call read_iges_lines(path, model%file)
    if (model%file%errors%n_items > n_before) return
    call read_global(model%file, model%global)
    call read_directory(model%file, model%entries)
  end subroutine read_iges_model

  !> Take the values of an entity apart.
  subroutine open_values(model, entry, values)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry   !! position in the list of entries
    type(values_t), intent(out) :: values
    character(:), allocatable :: text, problem, expected
    integer :: i, at, type, owner
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
                      "the directory number "//to_text(2*entry - 1))
          return
        end associate
      end do
      call split_tokens(text, model%global%delimiters, values%tokens, problem, expected, at)
      if (problem /= "") then
        call reject(model, values, at, problem, expected)
        return
      end if
      values%n = values%tokens%n - 1
      call read_integer(token_text(values%tokens, 1), type, is_number)
      if (is_number .and. type == item%type) return
      call reject(model, values, 1, "`"//token_text(values%tokens, 1)//"` as the first value", &
                  "its type "//to_text(item%type))
    end associate
  end subroutine open_values

  !> A whole number; 0 where it is left to its default. The bounds are those of what makes sense.
  integer function get_integer(model, values, at, name, low, high) result(number)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    integer, intent(in) :: at, low, high
    character(*), intent(in) :: name
    character(:), allocatable :: given, bounds
    logical :: is_number

    number = max(low, 0)
    if (.not. model%is_valid) return
    given = token_text(values%tokens, at + 1)
    is_number = .true.
    number = 0
    if (given /= "") call read_integer(given, number, is_number)
    if (is_number .and. number >= low .and. number <= high) return
    number = max(low, 0)
    bounds = "a whole number from "//to_text(low)
    if (high < huge(high)) bounds = bounds//" to "//to_text(high)
    if (high == huge(high)) bounds = bounds//" on"
    call reject_value(model, values, at, name, bounds)
  end function get_integer

  !> Several numbers from `at` on, each 0 where it is left to its default.
  function get_reals(model, values, at, n, name) result(numbers)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    integer, intent(in) :: at, n   !! the caller has made sure that there are as many
    character(*), intent(in) :: name
    real(wp), allocatable :: numbers(:)
    character(:), allocatable :: given
    integer :: i
    logical :: is_number

    allocate (numbers(n), source=0.0_wp)
    do i = 1, n
      if (.not. model%is_valid) return
      given = token_text(values%tokens, at + i)
      if (given == "") cycle
      call read_real(given, numbers(i), is_number)
      if (.not. is_number) call reject_value(model, values, at + i - 1, name, "a number")
    end do
  end function get_reals

  !> Position in the list of entries of an entity that a value points to; 0 if there is none.
  integer function get_entry(model, values, at, name) result(entry)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    integer, intent(in) :: at
    character(*), intent(in) :: name
    integer :: last

    last = 2*size(model%entries) - 1
    entry = get_integer(model, values, at, name, 1, last)
    if (model%is_valid .and. mod(entry, 2) == 0) then
      call reject_value(model, values, at, name, "an odd directory number from 1 to "// &
                        to_text(last))
    end if
    entry = (entry + 1)/2
    if (.not. model%is_valid) entry = 0
  end function get_entry

  !> Where an entity is in the directory.
  pure function entry_origin(model, entry) result(origin)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    type(origin_t) :: origin

    origin = new_origin(model%file%path, line_number(model%file, section_directory, 2*entry - 1), &
                        "IGES "//entry_name(model%entries, entry))
  end function entry_origin

  subroutine reject_value(model, values, at, name, expected)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    integer, intent(in) :: at
    character(*), intent(in) :: name, expected
    character(:), allocatable :: given

    given = token_text(values%tokens, at + 1)
    if (len(given) > 30) given = given(:30)//"..."
    given = "`"//given//"`"
    if (given == "``") given = "nothing"
    call reject(model, values, values%tokens%first(max(1, min(at + 1, values%tokens%n))), &
                given//" as parameter "//to_text(at)//", "//name, expected)
  end subroutine reject_value

  !> Note an error of the parameters; the entity is of no use any more.
  subroutine reject(model, values, at, found, expected)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    integer, intent(in) :: at      !! in the text of the values
    character(*), intent(in) :: found, expected
    integer :: line

    model%is_valid = .false.
    associate (item => model%entries(values%entry))
      line = item%first + min((max(at, 1) - 1)/n_columns, item%n_lines - 1)
    end associate
    call add_error(model%file%errors, new_origin(model%file%path, &
                                      line_number(model%file, section_parameters, line), &
                                      "IGES "//entry_name(model%entries, values%entry)//", P"// &
                                      to_text(line)), found, expected)
  end subroutine reject

  !> Note an error of an entity; the surface that is being read is of no use any more.
  subroutine reject_entity(model, entry, found, expected)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry   !! position in the list of entries
    character(*), intent(in) :: found, expected

    model%is_valid = .false.
    call add_error(model%file%errors, entry_origin(model, entry), found, expected)
  end subroutine reject_entity

  !> Move points by the whole transformation of an entity, if it has one.
  subroutine transform(model, entry, points)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry             !! position in the list of entries
    real(wp), intent(inout) :: points(:, :)  !! shape (n, 3) [unit of the file]
    real(wp) :: matrix(3, 4), outer(3, 4), old(size(points, 1), 3)
    integer :: at, next, number, c, n_done

    if (model%entries(entry)%matrix == 0) return
    matrix = 0.0_wp
    matrix(1, 1) = 1.0_wp
    matrix(2, 2) = 1.0_wp
    matrix(3, 3) = 1.0_wp
    at = entry
    n_done = 0
    do while (model%entries(at)%matrix /= 0)
      number = model%entries(at)%matrix
      next = (number + 1)/2
      n_done = n_done + 1
      if (.not. (number > 0 .and. mod(number, 2) == 1 .and. next <= size(model%entries))) then
        call reject_entity(model, at, "transformation matrix "//to_text(number), &
                           "an odd directory number from 1 to "// &
                           to_text(2*size(model%entries) - 1)//", or 0 for none")
      else if (model%entries(next)%type /= 124) then
        call reject_entity(model, at, entry_name(model%entries, next)//" as its transformation", &
                           "a transformation matrix, entity 124")
      else if (n_done > size(model%entries)) then
        call reject_entity(model, entry, "a transformation that refers to itself", &
                           "a chain of transformations that ends")
      end if
      if (.not. model%is_valid) return
      at = next
      call read_matrix(model, at, outer)
      if (.not. model%is_valid) return
      matrix(:, 4) = matmul(outer(:, :3), matrix(:, 4)) + outer(:, 4)
      matrix(:, :3) = matmul(outer(:, :3), matrix(:, :3))
    end do
    if (.not. all(ieee_is_finite(matrix))) then
      call reject_entity(model, entry, "a transformation with non-finite values", &
                         "finite coordinates")
      return
    end if
    old = points
    do c = 1, 3
      points(:, c) = old(:, 1)*matrix(c, 1) + old(:, 2)*matrix(c, 2) + old(:, 3)*matrix(c, 3) &
                     + matrix(c, 4)
    end do
  end subroutine transform

  subroutine read_matrix(model, entry, matrix)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry
    real(wp), intent(out) :: matrix(3, 4)
    real(wp), parameter :: loosest = 1.0e-3_wp     ! how far rows may be from unit and upright
    real(wp), parameter :: flattest = 1.0e-6_wp    ! volume of the unit cube afterwards
    type(values_t) :: values
    real(wp) :: components(12)
    integer :: form

    call open_values(model, entry, values)
    components = get_reals(model, values, 1, 12, "a component of the matrix")
    if (.not. model%is_valid) return
    matrix = reshape(components, [3, 4], order=[2, 1])
    form = model%entries(entry)%form
    if (all(form /= [0, 1, 10])) then
      call reject_entity(model, entry, "form "//to_text(form), &
                         "a Cartesian transformation: form 0, 1 or 10")
    else if (.not. abs(dot_product(matrix(:, 1), cross(matrix(:, 2), matrix(:, 3)))) &
             > flattest) then
      call reject_entity(model, entry, "a matrix that flattens what it transforms", "a rotation")
    else if (stretch(matrix(:, :3)) > loosest .and. .not. is_reported(model, entry)) then
      call add_warning(model%file%errors, entry_origin(model, entry), &
                       "a matrix that stretches what it transforms; it is applied as it is", &
                       "a rotation")
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

  !> Has this entity been reported already?
  pure logical function is_reported(model, entry)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    type(origin_t) :: origin
    integer :: i

    origin = entry_origin(model, entry)
    is_reported = .false.
    do i = 1, model%file%errors%n_items
      associate (other => model%file%errors%items(i)%origin)
        is_reported = is_reported .or. (other%line == origin%line .and. other%file == origin%file)
      end associate
    end do
  end function is_reported

end module iges_model
