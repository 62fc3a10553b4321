!> Volume that each quadrature point of a patch stands for, in the shape of the solid given.
module point_volumes
  use kinds, only: wp
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t
  use patch_setup, only: element_of_lane
  implicit none
  private

  public :: new_point_volumes

contains

  !> Volumes in the layout of the point state, zero for lanes that repeat an element.
  function new_point_volumes(patch, solid) result(volumes)
    type(ig_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), allocatable :: volumes(:, :, :, :)   !! shape (8, q3, q1*q2, n_blocks)
    integer :: q(3), block, lane, qa, qb, qc, e(3)

    q = patch%axes%n_points
    allocate (volumes(n_lanes, q(3), q(1)*q(2), patch%n_blocks), source=0.0_wp)
    !$omp parallel do schedule(static) private(lane, qa, qb, qc, e)
    do block = 1, patch%n_blocks
      do lane = 1, n_lanes
        if (.not. patch%lanes%is_owner(lane, mod(block - 1, patch%lanes%n_blocks) + 1)) cycle
        e = element_of_lane(patch, block, lane)
        do qa = 1, q(1)
          do qb = 1, q(2)
            do qc = 1, q(3)
              volumes(lane, qc, qb + q(2)*(qa - 1), block) = &
                volume_at(patch, solid, e, [qa, qb, qc])
            end do
          end do
        end do
      end do
    end do
    !$omp end parallel do
  end function new_point_volumes

  pure real(wp) function volume_at(patch, solid, element, point) result(volume)
    type(ig_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: element(3), point(3)
    real(wp) :: xi(3), place(3), j(3, 3), half
    integer :: axis, span

    volume = 1.0_wp
    do axis = 1, 3
      span = patch%axes(axis)%first(element(axis)) + patch%axes(axis)%degree
      associate (knots => solid%axes(axis)%knots)
        half = 0.5_wp*(knots(span + 1) - knots(span))
        xi(axis) = knots(span) + half*(1.0_wp + patch%axes(axis)%abscissae(point(axis)))
      end associate
      volume = volume*half*patch%axes(axis)%weights(point(axis))
    end do
    call evaluate_solid(solid, xi, place, j)
    volume = volume*(j(1, 1)*(j(2, 2)*j(3, 3) - j(2, 3)*j(3, 2)) &
                     + j(1, 2)*(j(2, 3)*j(3, 1) - j(2, 1)*j(3, 3)) &
                     + j(1, 3)*(j(2, 1)*j(3, 2) - j(2, 2)*j(3, 1)))
  end function volume_at

end module point_volumes
