!> From the loads of the splines of each element to the coefficients of those of the patch: elements
!! that share a spline are added in fixed order, lines of splines solved for.
module smooth_lines
  use kinds, only: wp
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t
  use smooth_fields, only: smooth_fields_t
  use smooth_axis, only: smooth_axis_t, solve_columns, solve_rows
  implicit none
  private

  public :: solve_for_splines

contains

  !> Coefficients of the first `n_means` fields that are projected.
  subroutine solve_for_splines(patch, smooth, n_means, fields)
    type(ig_patch_t), intent(in) :: patch
    type(smooth_axis_t), intent(in) :: smooth(3)
    integer, intent(in) :: n_means
    type(smooth_fields_t), intent(inout) :: fields
    integer :: k

    do k = 1, n_means
      call solve_all(patch, smooth, fields%loads(:, :, :, :, k, :), fields%all(:, :, :, k))
    end do
  end subroutine solve_for_splines

  !> Along all axes.
  pure subroutine solve_all(patch, smooth, loads, coefficients)
    type(ig_patch_t), intent(in) :: patch
    type(smooth_axis_t), intent(in) :: smooth(3)
    real(wp), intent(in) :: loads(:, :, :, :, :)        !! (8, p3, p2, p1, n_blocks)
    real(wp), intent(inout) :: coefficients(:, :, :)
    integer :: b, e2, e3, j, k, a, block

    coefficients = 0.0_wp
    block = 0
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = 1, patch%axes(2)%n_elements
        do b = 1, patch%lanes%n_blocks
          block = block + 1
          do a = 1, size(loads, 4)
            do j = 1, size(loads, 3)
              do k = 1, size(loads, 2)
                call add_lanes(patch, b, a, loads(:, k, j, a, block), &
                               coefficients(:, patch%axes(2)%first(e2) + j - 1, &
                                            patch%axes(3)%first(e3) + k - 1))
              end do
            end do
          end do
        end do
      end do
    end do
    associate (n => shape(coefficients))
      call solve_rows(smooth(1), n(2)*n(3), coefficients)
      do k = 1, n(3)
        call solve_columns(smooth(2), n(1), coefficients(:, :, k))
      end do
      call solve_columns(smooth(3), n(1)*n(2), coefficients)
    end associate
  end subroutine solve_all

  !> Add the loads of spline `a` of each lane.
  pure subroutine add_lanes(patch, b, a, loads, coefficients)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: b, a
    real(wp), intent(in) :: loads(n_lanes)
    real(wp), intent(inout) :: coefficients(*)
    integer :: first(n_lanes), l

    first = patch%lanes%first(:, b) + a - 1
    if (patch%lanes%is_contiguous(b)) then
      associate (line => coefficients(first(1):first(1) + n_lanes - 1))
        line = line + loads
      end associate
    else
      do l = 1, n_lanes
        coefficients(first(l)) = coefficients(first(l)) + loads(l)
      end do
    end if
  end subroutine add_lanes

end module smooth_lines
