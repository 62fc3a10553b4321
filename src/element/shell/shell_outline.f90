!> What an outline keeps of a shell: masses, and the state of the points when a sheet is trimmed.
module shell_outline
  use kinds, only: wp
  use nurbs_solid, only: nurbs_solid_t
  use basis_tables, only: n_lanes
  use solid_patch, only: solid_patch_t, shell_points_t, block_t, block_at, cut_number
  use patch_outline, only: add_whole_masses, carry_clock, origin_of_point, carry_point_state
  use shell_forces, only: set_metric_of_block
  use through_thickness, only: volumes_of_cut
  implicit none
  private

  public :: mass_inside, carry_over, share_of_leaders

contains

  !> Share of an element's area from which on its control points move for themselves: of smaller
  !! ones the stiffness against bending would shorten the time increment. A sliver of the width e
  !! has the largest frequency of a whole element where e is about the thickness.
  pure real(wp) function share_of_leaders(thickness, length) result(share)
    real(wp), intent(in) :: thickness, length      !! of the sheet, of its elements
    real(wp), parameter :: per_thickness = 0.9_wp, lowest = 0.05_wp, highest = 0.9_wp

    share = min(highest, max(lowest, per_thickness*thickness/length))
  end function share_of_leaders

  !> Lumped mass of the control points of the mid-surface: of whole elements as that of a sheet
  !! without an outline, of cut ones by their own points.
  function mass_inside(patch, points, sheet, density) result(mass)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(nurbs_solid_t), intent(in) :: sheet
    real(wp), intent(in) :: density
    real(wp) :: mass(patch%n_control(1), patch%n_control(2), 1)
    real(wp), allocatable :: columns(:, :, :)

    allocate (columns, source=0.0_wp*sheet%weights)
    call add_whole_masses(patch, sheet, density, columns)
    mass(:, :, 1) = sum(columns, 3) + density*volumes_of_cut(patch, points)
  end function mass_inside

  !> Stress and state of a trimmed sheet from those before: of whole elements to the last bit, of a
  !! point of a cut one those of the nearest point of the element. The fundamental forms at these
  !! are those of the shape now.
  subroutine carry_over(old, old_points, x, patch, points)
    type(solid_patch_t), intent(in) :: old
    type(shell_points_t), intent(in) :: old_points
    real(wp), intent(in), contiguous :: x(:, :, :, :)    !! control points now [length]
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    type(block_t) :: block
    integer :: b, l, k, from(3)

    call carry_clock(old, patch)
    do b = 1, patch%n_blocks
      block = block_at(patch, b)
      if (cut_number(patch, block) > 0) call set_metric_of_block(patch, points, block, x)
      do l = 1, n_lanes
        do k = 1, patch%together
          from = origin_of_point(old, patch, block, l, k)
          call carry_point_state(old, from, b, l, k, patch)
          call carry_point(old_points, from, b, l, k, points)
          if (cut_number(patch, block) > 0) cycle
          points%metric(l, :, k, b) = old_points%metric(from(2), :, from(3), from(1))
        end do
      end do
      points%is_pressed(b) = maxval(abs(points%normal(:, :, :, b))) > 0.0_wp
    end do
  end subroutine carry_over

  !> What a point of a shell carries besides, but its place: to row `k` of lane `l` of block `b`.
  pure subroutine carry_point(old, from, b, l, k, points)
    type(shell_points_t), intent(in) :: old
    integer, intent(in) :: from(3)                   !! see `origin_of_point`
    integer, intent(in) :: b, l, k
    type(shell_points_t), intent(inout) :: points

    associate (block => from(1), lane => from(2), row => from(3))
      points%thickness(l, k, b) = old%thickness(lane, row, block)
      points%through(l, :, k, b) = old%through(lane, :, row, block)
      points%resultant(l, :, k, b) = old%resultant(lane, :, row, block)
      points%normal(l, :, k, b) = old%normal(lane, :, row, block)
      if (allocated(points%stretch)) &
        points%stretch(l, :, k, b) = old%stretch(lane, :, row, block)
    end associate
  end subroutine carry_point

end module shell_outline
