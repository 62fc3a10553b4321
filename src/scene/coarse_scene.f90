!> The same scene with fewer elements in the plane of the sheet, for a quick look.
module coarse_scene
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, span_table, greville, find_span, basis_derivatives
  use nurbs_solid, only: nurbs_solid_t
  use linear_algebra, only: solve
  use scene, only: scene_t
  implicit none
  private

  public :: coarsen_scene

contains

  !> Leave every `factor`-th knot along axes 1 and 2 and at least `least` elements. Shapes keep
  !! their places at the Greville points. Blanks of several patches stay as they are.
  subroutine coarsen_scene(scene, factor, least)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: factor, least
    integer :: axis

    if (size(scene%blank%patches) > 1) return
    do axis = 1, 2
      call coarsen_axis(scene%blank%patches(1)%solid, axis, factor, least)
    end do
  end subroutine coarsen_scene

  subroutine coarsen_axis(solid, axis, factor, least)
    type(nurbs_solid_t), intent(inout) :: solid
    integer, intent(in) :: axis, factor, least
    type(knot_vector_t) :: coarse
    real(wp), allocatable :: points(:, :, :, :), weights(:, :, :)
    integer :: c, n(3)
    logical :: is_fine

    associate (fine => solid%axes(axis))
      coarse = coarser(fine, max(1, min(factor, size(span_table(fine))/least)))
      if (coarse%n_basis == fine%n_basis) return
      n = shape(solid%weights)
      n(axis) = coarse%n_basis
      allocate (points(n(1), n(2), n(3), 3), weights(n(1), n(2), n(3)))
      call carry_over(fine, coarse, axis, solid%weights, weights, is_fine)
      if (.not. is_fine .or. .not. minval(weights) > 0.0_wp) return
      do c = 1, 3
        call carry_over(fine, coarse, axis, solid%weights*solid%points(:, :, :, c), &
                        points(:, :, :, c), is_fine)
        points(:, :, :, c) = points(:, :, :, c)/weights
      end do
    end associate
    solid%axes(axis) = coarse
    call move_alloc(points, solid%points)
    call move_alloc(weights, solid%weights)
  end subroutine coarsen_axis

  !> Knots of every `factor`-th element border, each once.
  pure function coarser(fine, factor) result(coarse)
    type(knot_vector_t), intent(in) :: fine
    integer, intent(in) :: factor
    type(knot_vector_t) :: coarse
    real(wp), allocatable :: inner(:)

    associate (spans => span_table(fine), p => fine%degree)
      inner = fine%knots(spans(1 + factor::factor))
      if (factor == 1) then
        coarse = fine
        return
      end if
      coarse%degree = p
      coarse%n_basis = p + 1 + size(inner)
      coarse%knots = [fine%knots(:p + 1), inner, fine%knots(fine%n_basis + 1:)]
    end associate
  end function coarser

  !> Control values on the coarse knots that agree with the fine ones at the Greville points.
  subroutine carry_over(fine, coarse, axis, old, new, is_solved)
    type(knot_vector_t), intent(in) :: fine, coarse
    integer, intent(in) :: axis
    real(wp), intent(in) :: old(:, :, :)
    real(wp), intent(out) :: new(:, :, :)
    logical, intent(out) :: is_solved
    real(wp) :: at_fine(coarse%n_basis, fine%n_basis), at_coarse(coarse%n_basis, coarse%n_basis)
    real(wp), allocatable :: values(:)
    integer :: a, b

    at_fine = collocation(fine, greville(coarse))
    at_coarse = collocation(coarse, greville(coarse))
    is_solved = .true.
    do b = 1, size(old, 3)
      do a = 1, size(old, merge(2, 1, axis == 1))
        if (axis == 1) then
          values = matmul(at_fine, old(:, a, b))
          call solve(at_coarse, values, is_solved)
          new(:, a, b) = values
        else
          values = matmul(at_fine, old(a, :, b))
          call solve(at_coarse, values, is_solved)
          new(a, :, b) = values
        end if
        if (.not. is_solved) return
      end do
    end do
  end subroutine carry_over

  !> Basis functions (columns) at places (rows).
  pure function collocation(kv, places) result(matrix)
    type(knot_vector_t), intent(in) :: kv
    real(wp), intent(in) :: places(:)
    real(wp) :: matrix(size(places), kv%n_basis), values(kv%degree + 1, 0:0)
    integer :: i, span

    matrix = 0.0_wp
    do i = 1, size(places)
      span = find_span(kv, places(i))
      call basis_derivatives(kv, span, places(i), 0, values)
      matrix(i, span - kv%degree:span) = values(:, 0)
    end do
  end function collocation

end module coarse_scene
