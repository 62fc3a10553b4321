!> Normal stress through a shell, from the forces that press on its faces.
!!
!! Plane stress leaves out what a tool does to a sheet that it bends: stress across the thickness,
!! which lets the sheet yield at less tension. It is linear between the faces, minus the pressure on
!! each. The pressure is that of the mean force over a window of increments, on the control points
!! and from there at the integration points, which reach it in equal parts by the end of the next
!! window: contact forces are too rough to be taken as they come.
module shell_pressure
  use kinds, only: wp
  use solid_patch, only: solid_patch_t, shell_points_t, element_of_lane, point_of_row
  use basis_tables, only: n_lanes
  implicit none
  private

  public :: window, add_push, share_of_window, set_targets, release

  integer, parameter :: window = 16        !! increments

contains

  !> Add what forces on a face press towards the mid-surface, by control point.
  pure subroutine add_push(n, side, director, forces, push)
    integer, intent(in) :: n                                   !! control points
    integer, intent(in) :: side                                !! 5 or 6
    real(wp), intent(in) :: director(n, 3), forces(n, 3)       !! [-], [force]
    real(wp), intent(inout) :: push(n, 5:6)                    !! sums by side [force]

    push(:, side) = push(:, side) + merge(-1.0_wp, 1.0_wp, side == 6) &
      *(forces(:, 1)*director(:, 1) + forces(:, 2)*director(:, 2) + forces(:, 3)*director(:, 3))
  end subroutine add_push

  !> Part of the way to the targets that the next evaluation of the forces goes.
  pure real(wp) function share_of_window(increment) result(share)
    integer, intent(in) :: increment      !! evaluations so far

    share = 1.0_wp/(window - mod(increment, window))
  end function share_of_window

  !> Targets of the normal stress at the integration points from the sums of a window.
  subroutine set_targets(patch, push, area, points)
    type(solid_patch_t), intent(in) :: patch
    real(wp), intent(in) :: push(:, :, 5:)            !! by control point and side [force]
    real(wp), intent(in) :: area(:, :)                !! of the control points [length^2]
    type(shell_points_t), intent(inout) :: points
    real(wp) :: stress(size(push, 1), size(push, 2), 2)
    integer :: block

    stress(:, :, 1) = -0.5_wp*(push(:, :, 6) + push(:, :, 5))/(window*area)
    stress(:, :, 2) = -0.5_wp*(push(:, :, 6) - push(:, :, 5))/(window*area)
    !$omp parallel do schedule(static)
    do block = 1, patch%n_blocks
      call set_block(patch, block, stress, points)
    end do
    !$omp end parallel do
  end subroutine set_targets

  pure subroutine set_block(patch, block, stress, points)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: block
    real(wp), intent(in) :: stress(:, :, :)
    type(shell_points_t), intent(inout) :: points
    integer :: lane, row, e(3), at(3), j, c

    associate (one => patch%axes(1), two => patch%axes(2), &
               targets => points%normal(:, 3:4, :, block))
      targets = 0.0_wp
      do lane = 1, n_lanes
        e = element_of_lane(patch, block, lane)
        associate (near => stress(one%first(e(1)):one%first(e(1)) + one%degree, &
                                  two%first(e(2)):two%first(e(2)) + two%degree, :))
          if (.not. any(abs(near) > 0.0_wp)) cycle
          do row = 1, patch%together
            at = point_of_row(patch%axes%n_points, row, 1)
            do c = 1, 2
              do j = 1, two%degree + 1
                targets(lane, c, row) = targets(lane, c, row) + two%values(j, at(2), e(2)) &
                  *dot_product(one%values(:, at(1), e(1)), near(:, j, c))
              end do
            end do
          end do
        end associate
      end do
    end associate
    points%is_pressed(block) = any(abs(points%normal(:, :, :, block)) > 0.0_wp)
  end subroutine set_block

  !> Nothing presses any more.
  pure subroutine release(points)
    type(shell_points_t), intent(inout) :: points
    integer :: block

    do block = 1, size(points%is_pressed)
      if (.not. points%is_pressed(block)) cycle
      points%normal(:, 3:4, :, block) = 0.0_wp
      points%is_pressed(block) = any(abs(points%normal(:, :2, :, block)) > 0.0_wp)
    end do
  end subroutine release

end module shell_pressure
