!> What an outline keeps of a shell: masses, and the state of the points when a sheet is trimmed.
module shell_outline
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use kinds, only: wp
  use outline, only: region_t, inside_distance
  use surface_grid, only: lines
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use basis_tables, only: n_lanes, axis_table_t
  use lumped_mass, only: mass_tables, add_masses
  use solid_patch, only: solid_patch_t, shell_points_t, block_t, block_at, cut_number, &
                         lane_of_element, local_place
  use shell_forces, only: set_metric_of_block
  use through_thickness, only: volumes_of_cut
  implicit none
  private

  public :: mass_inside, carry_over, least_share, distances_inside

contains

  !> Share of an element's area from which on its control points move for themselves: of smaller
  !! ones the stiffness against bending would shorten the time increment. A sliver of the width e
  !! has the largest frequency of a whole element where e is about the thickness.
  pure real(wp) function least_share(thickness, length) result(share)
    real(wp), intent(in) :: thickness, length      !! of the sheet, of its elements
    real(wp), parameter :: per_thickness = 0.9_wp, lowest = 0.05_wp, highest = 0.9_wp

    share = min(highest, max(lowest, per_thickness*thickness/length))
  end function least_share

  !> Distances inside the outline, as `element_t` keeps them.
  pure function distances_inside(sheet, regions, share) result(distance)
    type(nurbs_solid_t), intent(in) :: sheet
    type(region_t), intent(in) :: regions(:)
    real(wp), intent(in) :: share(:, :)            !! of each element that is inside
    real(wp), allocatable :: distance(:, :), xi(:), eta(:)
    real(wp) :: scale(2), whole, x(3, 3)
    integer :: d, i, j, k, l, n(2)

    d = maxval(sheet%axes%degree)
    xi = lines(sheet%axes(1), d)
    eta = lines(sheet%axes(2), d)
    n = shape(share)
    allocate (distance(size(xi), size(eta)), source=ieee_value(1.0_wp, ieee_quiet_nan))
    call evaluate_solid(sheet, [xi(1), eta(1), 0.5_wp], x(:, 1))
    call evaluate_solid(sheet, [xi(size(xi)), eta(1), 0.5_wp], x(:, 2))
    call evaluate_solid(sheet, [xi(1), eta(size(eta)), 0.5_wp], x(:, 3))
    scale = max([norm2(x(:, 2) - x(:, 1)), norm2(x(:, 3) - x(:, 1))], tiny(1.0_wp)) &
            /[xi(size(xi)) - xi(1), eta(size(eta)) - eta(1)]
    whole = maxval(scale*[xi(size(xi)) - xi(1), eta(size(eta)) - eta(1)]/n)
    do j = 1, n(2)
      do i = 1, n(1)
        if (share(i, j) >= 1.0_wp) distance(d*(i - 1) + 1:d*i + 1, d*(j - 1) + 1:d*j + 1) = whole
      end do
    end do
    do j = 1, n(2)
      do i = 1, n(1)
        if (share(i, j) <= 0.0_wp .or. share(i, j) >= 1.0_wp) cycle
        do l = d*(j - 1) + 1, d*j + 1
          do k = d*(i - 1) + 1, d*i + 1
            distance(k, l) = inside_distance(regions, [xi(k), eta(l)], scale)
          end do
        end do
      end do
    end do
  end function distances_inside

  !> Lumped mass of the control points of the mid-surface: of whole elements as that of a sheet
  !! without an outline, of cut ones by their own points.
  function mass_inside(patch, points, sheet, density) result(mass)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(nurbs_solid_t), intent(in) :: sheet
    real(wp), intent(in) :: density
    real(wp) :: mass(patch%n_control(1), patch%n_control(2), 1)
    real(wp), allocatable :: columns(:, :, :)
    type(axis_table_t) :: axes(3)
    integer :: b, l

    allocate (columns, source=0.0_wp*sheet%weights)
    axes = mass_tables(sheet)
    associate (lanes => patch%lanes)
      do b = 1, lanes%n_blocks
        if (lanes%cut_number(b) > 0) cycle
        do l = 1, n_lanes
          if (.not. lanes%is_owner(l, b)) cycle
          call add_masses(sheet, axes, [lanes%element(l, b), lanes%row(b), 1], &
                          [lanes%element(l, b), lanes%row(b), axes(3)%n_elements], density, columns)
        end do
      end do
    end associate
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
    type(block_t) :: block, from
    integer :: b, l, k, row, at(2)

    patch%time = old%time
    patch%increment = old%increment
    patch%step = old%step
    patch%step_start = old%step_start
    patch%before_step = old%before_step
    patch%n_before = old%n_before
    patch%viscosity%is_active = old%viscosity%is_active
    do b = 1, patch%n_blocks
      block = block_at(patch, b)
      if (cut_number(patch, block) > 0) call set_metric_of_block(patch, points, block, x)
      do l = 1, n_lanes
        at = lane_of_element(old, [patch%lanes%element(l, block%b), block%e2, block%e3])
        from = block_at(old, at(1))
        do k = 1, patch%together
          row = nearest_row(old, from, at(2), local_place(patch, block, l, k))
          call carry_point(old, old_points, at(1), at(2), row, b, l, k, patch, points)
          if (cut_number(patch, block) > 0) cycle
          points%metric(l, :, k, b) = old_points%metric(at(2), :, row, at(1))
          points%volume(l, k, b) = old_points%volume(at(2), row, at(1))
        end do
      end do
      points%is_pressed(b) = maxval(abs(points%normal(:, :, :, b))) > 0.0_wp
    end do
  end subroutine carry_over

  !> The point of a lane that is nearest to a place in its element.
  pure integer function nearest_row(patch, block, lane, place) result(row)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: lane
    real(wp), intent(in) :: place(2)
    real(wp) :: distance, best
    integer :: k

    row = 1
    best = huge(best)
    do k = 1, patch%together
      distance = sum((local_place(patch, block, lane, k) - place)**2)
      if (distance >= best) cycle
      best = distance
      row = k
    end do
  end function nearest_row

  !> All that a point carries but its place: of row `k` of lane `l` of block `b`, from the row, lane
  !! and block of the sheet before.
  pure subroutine carry_point(old, old_points, block, lane, row, b, l, k, patch, points)
    type(solid_patch_t), intent(in) :: old
    type(shell_points_t), intent(in) :: old_points
    integer, intent(in) :: block, lane, row, b, l, k
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    integer :: n, i, j

    n = patch%axes(3)%n_points
    i = n*(k - 1)
    j = n*(row - 1)
    patch%stress(l, i + 1:i + n, :, 1, b) = old%stress(lane, j + 1:j + n, :, 1, block)
    patch%state(l, i + 1:i + n, :, 1, b) = old%state(lane, j + 1:j + n, :, 1, block)
    if (size(old%push, 4) == old%n_blocks .and. size(patch%push, 4) == patch%n_blocks) &
      patch%push(l, :, k, b) = old%push(lane, :, row, block)
    points%thickness(l, k, b) = old_points%thickness(lane, row, block)
    points%through(l, :, k, b) = old_points%through(lane, :, row, block)
    points%resultant(l, :, k, b) = old_points%resultant(lane, :, row, block)
    points%normal(l, :, k, b) = old_points%normal(lane, :, row, block)
    if (allocated(points%stretch)) &
      points%stretch(l, :, k, b) = old_points%stretch(lane, :, row, block)
    if (allocated(patch%given)) patch%given(l, :, :, k, b) = old%given(lane, :, :, row, block)
  end subroutine carry_point

end module shell_outline
