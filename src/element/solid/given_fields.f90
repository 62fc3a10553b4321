!> Temperature and field variables that the deck gives: from control points to integration points.
module given_fields
  use kinds, only: wp
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t, element_of_lane
  implicit none
  private

  public :: new_given_fields, spread_to_points

contains

  !> Room for fields that are zero everywhere.
  subroutine new_given_fields(patch, n_fields)
    type(ig_patch_t), intent(inout) :: patch
    integer, intent(in) :: n_fields

    patch%n_fields = n_fields
    associate (n => patch%n_control, q => patch%axes%n_points)
      allocate (patch%spread_values(n(1), n(2), n(3), n_fields), source=0.0_wp)
      allocate (patch%given(n_lanes, q(3), 2*n_fields, q(1)*q(2), patch%n_blocks), source=0.0_wp)
    end associate
  end subroutine new_given_fields

  !> A step begins: what the points had at the end of the last one they have at its start; at its
  !! end they have what the control points have now, by the basis of the patch. Where neither
  !! changes there is nothing to do.
  subroutine spread_to_points(patch, nodal)
    type(ig_patch_t), intent(inout) :: patch
    real(wp), intent(in) :: nodal(:, :, :, :)     !! at the control points, (n1, n2, n3, n_fields)
    logical :: is_same
    integer :: block, k

    is_same = patch%is_spread
    if (is_same) is_same = all(.not. abs(nodal - patch%spread_values) > 0.0_wp)
    if (is_same .and. patch%is_settled) return
    patch%is_settled = is_same
    patch%is_spread = .true.
    patch%spread_values = nodal
    !$omp parallel do schedule(static) private(k)
    do block = 1, patch%n_blocks
      do k = 1, patch%n_fields
        patch%given(:, :, k, :, block) = patch%given(:, :, patch%n_fields + k, :, block)
      end do
      if (.not. is_same) call spread_in_block(patch, block)
    end do
    !$omp end parallel do
  end subroutine spread_to_points

  !> The points of one block.
  pure subroutine spread_in_block(patch, block)
    type(ig_patch_t), intent(inout) :: patch
    integer, intent(in) :: block
    real(wp) :: values(patch%n_fields)
    integer :: lane, e(3), q(3), qa, qb, qc

    q = patch%axes%n_points
    do lane = 1, n_lanes
      e = element_of_lane(patch, block, lane)
      do qa = 1, q(1)
        do qb = 1, q(2)
          do qc = 1, q(3)
            call interpolate(patch, e, [qa, qb, qc], values)
            patch%given(lane, qc, patch%n_fields + 1:, qb + q(2)*(qa - 1), block) = values
          end do
        end do
      end do
    end do
  end subroutine spread_in_block

  !> The fields at one point of an element.
  pure subroutine interpolate(patch, e, q, values)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: e(3), q(3)
    real(wp), intent(out) :: values(patch%n_fields)
    real(wp) :: share, total
    integer :: low(3), i, j, k

    low = [patch%axes(1)%first(e(1)), patch%axes(2)%first(e(2)), patch%axes(3)%first(e(3))] - 1
    values = 0.0_wp
    total = 0.0_wp
    do k = 1, patch%axes(3)%degree + 1
      do j = 1, patch%axes(2)%degree + 1
        do i = 1, patch%axes(1)%degree + 1
          share = patch%axes(1)%values(i, q(1), e(1))*patch%axes(2)%values(j, q(2), e(2)) &
                  *patch%axes(3)%values(k, q(3), e(3))
          if (patch%is_rational) share = share*patch%weights(low(1) + i, low(2) + j, low(3) + k)
          total = total + share
          values = values + share*patch%spread_values(low(1) + i, low(2) + j, low(3) + k, :)
        end do
      end do
    end do
    values = values/total
  end subroutine interpolate

end module given_fields
