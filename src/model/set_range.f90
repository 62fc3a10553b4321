!> What a named set of the blank means: control points, or elements of a face.
module set_range
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, greville
  use nurbs_solid, only: nurbs_solid_t
  use scene, only: set_spec_t
  implicit none
  private

  public :: control_range, control_points, face_of_set

  real(wp), parameter :: tolerance = 1.0e-9_wp   ! of the length of an axis

contains

  !> Lowest and highest control index per axis whose Greville abscissa lies in the set; the range
  !! is empty (lower above upper) where no control point does.
  pure function control_range(solid, set) result(bounds)
    type(nurbs_solid_t), intent(in) :: solid
    type(set_spec_t), intent(in) :: set
    integer :: bounds(3, 2), axis, i
    logical, allocatable :: is_in(:)
    real(wp) :: slack

    do axis = 1, 3
      slack = tolerance*axis_length(solid%axes(axis))
      associate (xi => greville(solid%axes(axis)))
        is_in = xi >= set%lower(axis) - slack .and. xi <= set%upper(axis) + slack
      end associate
      bounds(axis, :) = [1, 0]
      if (any(is_in)) then
        bounds(axis, 1) = minval([(i, i=1, size(is_in))], mask=is_in)
        bounds(axis, 2) = maxval([(i, i=1, size(is_in))], mask=is_in)
      end if
    end do
  end function control_range

  !> All control indices of a range, shape (3, n), axis 1 fastest.
  pure function control_points(bounds) result(points)
    integer, intent(in) :: bounds(3, 2)
    integer, allocatable :: points(:, :)
    integer :: i, j, k, n

    allocate (points(3, product(max(0, bounds(:, 2) - bounds(:, 1) + 1))))
    n = 0
    do k = bounds(3, 1), bounds(3, 2)
      do j = bounds(2, 1), bounds(2, 2)
        do i = bounds(1, 1), bounds(1, 2)
          n = n + 1
          points(:, n) = [i, j, k]
        end do
      end do
    end do
  end function control_points

  !> Face (1 xi_min to 6 zeta_max) that a set without height lies on; 0 where it is none.
  pure integer function face_of_set(solid, set) result(face)
    type(nurbs_solid_t), intent(in) :: solid
    type(set_spec_t), intent(in) :: set
    integer :: axis
    real(wp) :: slack, low, high

    face = 0
    do axis = 1, 3
      associate (kv => solid%axes(axis))
        slack = tolerance*axis_length(kv)
        low = kv%knots(1)
        high = kv%knots(size(kv%knots))
      end associate
      if (set%upper(axis) <= low + slack) face = 2*axis - 1
      if (set%lower(axis) >= high - slack) face = 2*axis
    end do
  end function face_of_set

  pure real(wp) function axis_length(kv)
    type(knot_vector_t), intent(in) :: kv

    axis_length = kv%knots(size(kv%knots)) - kv%knots(1)
  end function axis_length

end module set_range
