!> Transformations of IGES entities: entity 124, which may itself be transformed by another.
module iges_matrix
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use input_errors, only: error_list_t, origin_t, add_error, add_warning
  use text, only: to_text
  use iges_directory, only: entry_name
  use iges_model, only: iges_model_t, values_t, open_values, get_real, entry_origin
  implicit none
  private

  public :: get_matrix, moved

  integer, parameter :: type_matrix = 124
  real(wp), parameter :: loosest = 1.0e-3_wp     ! how far rows may be from unit and upright
  real(wp), parameter :: flattest = 1.0e-6_wp    ! volume of the unit cube afterwards

contains

  !> The whole transformation of an entity, x -> matrix(:, 1:3) x + matrix(:, 4) [unit of the file].
  subroutine get_matrix(model, entry, matrix, is_valid, errors)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry   !! place in the list of entries
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
    call add_error(errors, entry_origin(model, entry), "a transformation beyond all numbers", &
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

  !> Has something been said of this place already?
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

end module iges_matrix
