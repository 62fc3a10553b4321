!> Jacobians of a patch at its quadrature points, in the shape of the solid given: the volume that
!! each point stands for, the sizes of the elements, and the inverses.
module point_volumes
  use kinds, only: wp
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t, element_of_lane
  implicit none
  private

  public :: new_point_volumes, new_inverse_jacobians, new_element_sizes, jacobian_at, determinant, &
            inverse_rows

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

  !> Cube roots of the volumes of the elements.
  function new_element_sizes(patch, solid) result(sizes)
    type(ig_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), allocatable :: sizes(:, :)   !! shape (8, n_blocks) [length]
    integer :: q(3), block, lane, qa, qb, qc, e(3)

    q = patch%axes%n_points
    allocate (sizes(n_lanes, patch%n_blocks), source=0.0_wp)
    do block = 1, patch%n_blocks
      do lane = 1, n_lanes
        e = element_of_lane(patch, block, lane)
        do qa = 1, q(1)
          do qb = 1, q(2)
            do qc = 1, q(3)
              sizes(lane, block) = sizes(lane, block) &
                                   + volume_at(patch, solid, e, [qa, qb, qc])
            end do
          end do
        end do
      end do
    end do
    sizes = max(sizes, 0.0_wp)**(1.0_wp/3.0_wp)
  end function new_element_sizes

  !> Inverse jacobians by element-local coordinates in the layout of the point state, row by row.
  function new_inverse_jacobians(patch, solid) result(inverses)
    type(ig_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), allocatable :: inverses(:, :, :, :, :)   !! shape (8, q3, 9, q1*q2, n_blocks)
    real(wp) :: j(3, 3)
    integer :: q(3), block, lane, qa, qb, qc

    q = patch%axes%n_points
    allocate (inverses(n_lanes, q(3), 9, q(1)*q(2), patch%n_blocks))
    do block = 1, patch%n_blocks
      do lane = 1, n_lanes
        do qa = 1, q(1)
          do qb = 1, q(2)
            do qc = 1, q(3)
              call jacobian_at(patch, solid, element_of_lane(patch, block, lane), [qa, qb, qc], j)
              inverses(lane, qc, :, qb + q(2)*(qa - 1), block) = inverse_rows(j)
            end do
          end do
        end do
      end do
    end do
  end function new_inverse_jacobians

  pure real(wp) function volume_at(patch, solid, element, point) result(volume)
    type(ig_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: element(3), point(3)
    real(wp) :: j(3, 3)

    call jacobian_at(patch, solid, element, point, j)
    volume = determinant(j)*patch%axes(1)%weights(point(1))*patch%axes(2)%weights(point(2)) &
             *patch%axes(3)%weights(point(3))
  end function volume_at

  !> Jacobian by element-local coordinates, and place, of a point of the rule in an element.
  pure subroutine jacobian_at(patch, solid, element, point, j, place)
    type(ig_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid               !! in any shape
    integer, intent(in) :: element(3), point(3)
    real(wp), intent(out) :: j(3, 3)                       !! [length]
    real(wp), intent(out), optional :: place(3)            !! [length]
    real(wp) :: xi(3), half(3), x(3)
    integer :: axis, span

    do axis = 1, 3
      span = patch%axes(axis)%first(element(axis)) + patch%axes(axis)%degree
      associate (knots => solid%axes(axis)%knots)
        half(axis) = 0.5_wp*(knots(span + 1) - knots(span))
        xi(axis) = knots(span) &
                   + half(axis)*(1.0_wp + patch%axes(axis)%abscissae(point(axis)))
      end associate
    end do
    call evaluate_solid(solid, xi, x, j)
    do axis = 1, 3
      j(:, axis) = half(axis)*j(:, axis)
    end do
    if (present(place)) place = x
  end subroutine jacobian_at

  !> Determinant of a 3 x 3 matrix.
  pure real(wp) function determinant(j)
    real(wp), intent(in) :: j(3, 3)

    determinant = j(1, 1)*(j(2, 2)*j(3, 3) - j(2, 3)*j(3, 2)) &
                  + j(1, 2)*(j(2, 3)*j(3, 1) - j(2, 1)*j(3, 3)) &
                  + j(1, 3)*(j(2, 1)*j(3, 2) - j(2, 2)*j(3, 1))
  end function determinant

  !> Inverse of a 3 x 3 matrix by its cofactors, listed row by row.
  pure function inverse_rows(j) result(rows)
    real(wp), intent(in) :: j(3, 3)   !! not singular
    real(wp) :: rows(9)

    rows = [j(2, 2)*j(3, 3) - j(2, 3)*j(3, 2), j(1, 3)*j(3, 2) - j(1, 2)*j(3, 3), &
            j(1, 2)*j(2, 3) - j(1, 3)*j(2, 2), j(2, 3)*j(3, 1) - j(2, 1)*j(3, 3), &
            j(1, 1)*j(3, 3) - j(1, 3)*j(3, 1), j(1, 3)*j(2, 1) - j(1, 1)*j(2, 3), &
            j(2, 1)*j(3, 2) - j(2, 2)*j(3, 1), j(1, 2)*j(3, 1) - j(1, 1)*j(3, 2), &
            j(1, 1)*j(2, 2) - j(1, 2)*j(2, 1)]/determinant(j)
  end function inverse_rows

end module point_volumes
