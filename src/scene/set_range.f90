!> What a named set of the blank means on one patch: control points, or a face.
module set_range
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, greville
  use nurbs_solid, only: nurbs_solid_t
  use scene, only: set_spec_t
  implicit none
  private

  public :: is_held, face_of_set

  real(wp), parameter :: tolerance = 1.0e-9_wp   ! of the length of an axis, of the size of a blank

contains

  !> Control points whose Greville abscissae and, where the set is bounded in space, whose places
  !! at the start lie in the set.
  pure function is_held(solid, set, part) result(is_in)
    type(nurbs_solid_t), intent(in) :: solid
    type(set_spec_t), intent(in) :: set
    integer, intent(in) :: part              !! number of the patch
    logical, allocatable :: is_in(:, :, :)   !! shape (n1, n2, n3)
    logical, allocatable :: along(:)
    real(wp) :: slack
    integer :: axis, i

    associate (n => solid%axes%n_basis)
      allocate (is_in(n(1), n(2), n(3)), source=.true.)
    end associate
    do axis = 1, 3
      slack = tolerance*axis_length(solid%axes(axis))
      associate (xi => greville(solid%axes(axis)))
        along = xi >= set%lower(axis, part) - slack .and. xi <= set%upper(axis, part) + slack
      end associate
      do i = 1, size(along)
        if (along(i)) cycle
        if (axis == 1) is_in(i, :, :) = .false.
        if (axis == 2) is_in(:, i, :) = .false.
        if (axis == 3) is_in(:, :, i) = .false.
      end do
    end do
    slack = tolerance*maxval(abs(solid%points))
    do axis = 1, 3
      is_in = is_in .and. solid%points(:, :, :, axis) >= set%from(axis) - slack &
              .and. solid%points(:, :, :, axis) <= set%to(axis) + slack
    end do
  end function is_held

  !> Face (1 xi_min to 6 zeta_max) of a patch that a set without height lies on; 0 where it is
  !! none or the patch has no part in the set.
  pure integer function face_of_set(solid, set, part) result(face)
    type(nurbs_solid_t), intent(in) :: solid
    type(set_spec_t), intent(in) :: set
    integer, intent(in) :: part   !! number of the patch
    integer :: axis
    real(wp) :: slack, low, high

    face = 0
    do axis = 1, 3
      associate (kv => solid%axes(axis))
        slack = tolerance*axis_length(kv)
        low = kv%knots(1)
        high = kv%knots(size(kv%knots))
      end associate
      if (set%upper(axis, part) <= low + slack) face = 2*axis - 1
      if (set%lower(axis, part) >= high - slack) face = 2*axis
    end do
    if (any(set%lower(:, part) > set%upper(:, part))) face = 0
  end function face_of_set

  pure real(wp) function axis_length(kv)
    type(knot_vector_t), intent(in) :: kv

    axis_length = kv%knots(size(kv%knots)) - kv%knots(1)
  end function axis_length

end module set_range
