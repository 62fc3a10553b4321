!> What an outline keeps of a patch: masses, the state of the points when a sheet is trimmed, and
!! how far inside places are.
module patch_outline
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use kinds, only: wp
  use outline, only: region_t, inside_distance
  use surface_grid, only: lines
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use basis_tables, only: n_lanes, axis_table_t
  use lumped_mass, only: mass_tables, add_masses
  use patch_points, only: new_point_volumes
  use solid_patch, only: solid_patch_t, block_t, block_at, cut_number, lane_of_element, &
                         local_place, basis_at
  implicit none
  private

  public :: add_whole_masses, add_cut_masses, carry_clock, origin_of_point, carry_point_state, &
            carry_points, distances_inside, centre_of

contains

  !> Distances inside the outline, as `element_t` keeps them.
  pure function distances_inside(sheet, regions, share) result(distance)
    type(nurbs_solid_t), intent(in) :: sheet
    type(region_t), intent(in) :: regions(:)
    real(wp), intent(in) :: share(:, :)            !! of each element that is inside
    real(wp), allocatable :: distance(:, :), xi(:), eta(:)
    real(wp), parameter :: little = 1.0e-9_wp        ! of the sheet
    real(wp) :: scale(2), whole, x(3, 3), bounds(2, 2), inner(2, 2), place(2)
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
    bounds = reshape([xi(1), eta(1), xi(size(xi)), eta(size(eta))], [2, 2])
    ! A curve along the edge of the sheet does not say on which side of it that edge lies.
    inner(:, 1) = bounds(:, 1) + little*(bounds(:, 2) - bounds(:, 1))
    inner(:, 2) = bounds(:, 2) - little*(bounds(:, 2) - bounds(:, 1))
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
            place = min(max([xi(k), eta(l)], inner(:, 1)), inner(:, 2))
            distance(k, l) = min(inside_distance(regions, place, scale, bounds), whole)
          end do
        end do
      end do
    end do
  end function distances_inside

  !> Add the masses of the control points of whole elements, as those of a solid without an outline.
  subroutine add_whole_masses(patch, solid, density, mass)
    type(solid_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid         !! of the sheet at the start
    real(wp), intent(in) :: density
    real(wp), intent(inout) :: mass(:, :, :)
    type(axis_table_t) :: axes(3)
    integer :: b, l

    axes = mass_tables(solid)
    associate (lanes => patch%lanes)
      do b = 1, lanes%n_blocks
        if (lanes%cut_number(b) > 0) cycle
        do l = 1, n_lanes
          if (.not. lanes%is_owner(l, b)) cycle
          call add_masses(solid, axes, [lanes%element(l, b), lanes%row(b), 1], &
                          [lanes%element(l, b), lanes%row(b), axes(3)%n_elements], density, mass)
        end do
      end do
    end associate
  end subroutine add_whole_masses

  !> Add those of cut elements of solids, by their own points.
  subroutine add_cut_masses(patch, solid, density, mass)
    type(solid_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid         !! of the patch at the start
    real(wp), intent(in) :: density
    real(wp), intent(inout) :: mass(:, :, :)
    real(wp), allocatable :: volumes(:, :, :, :)
    type(block_t) :: block
    integer :: b, l, row, layer

    volumes = new_point_volumes(patch, solid)        ! zero in lanes that do not count
    do b = 1, patch%n_blocks
      block = block_at(patch, b)
      if (cut_number(patch, block) == 0) cycle
      do row = 1, size(volumes, 3)
        do layer = 1, size(volumes, 2)
          do l = 1, n_lanes
            call add_point_mass(patch, solid, block, l, row, layer, &
                                density*volumes(l, layer, row, b), mass)
          end do
        end do
      end do
    end do
  end subroutine add_cut_masses

  !> Share the mass of a point by the basis functions.
  pure subroutine add_point_mass(patch, solid, block, lane, row, layer, point_mass, mass)
    type(solid_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    type(block_t), intent(in) :: block
    integer, intent(in) :: lane, row, layer
    real(wp), intent(in) :: point_mass
    real(wp), intent(inout) :: mass(:, :, :)
    real(wp) :: one(patch%axes(1)%degree + 1, 0:2), two(patch%axes(2)%degree + 1, 0:2)
    real(wp), dimension(size(one, 1), size(two, 1), patch%axes(3)%degree + 1) :: share
    integer :: low(3), high(3), k

    call basis_at(patch, block, lane, row, one, two)
    low = [patch%lanes%first(lane, block%b), patch%axes(2)%first(block%e2), &
           patch%axes(3)%first(block%e3)]
    high = low + patch%axes%degree
    do k = 1, size(share, 3)
      share(:, :, k) = patch%axes(3)%values(k, layer, block%e3) &
                       *spread(one(:, 0), 2, size(two, 1))*spread(two(:, 0), 1, size(one, 1))
    end do
    share = share*solid%weights(low(1):high(1), low(2):high(2), low(3):high(3))
    associate (part => mass(low(1):high(1), low(2):high(2), low(3):high(3)))
      part = part + point_mass/sum(share)*share
    end associate
  end subroutine add_point_mass

  !> Times, numbers and viscosity of a patch that has been cut anew.
  pure subroutine carry_clock(old, patch)
    type(solid_patch_t), intent(in) :: old
    type(solid_patch_t), intent(inout) :: patch

    patch%time = old%time
    patch%increment = old%increment
    patch%step = old%step
    patch%step_start = old%step_start
    patch%before_step = old%before_step
    patch%n_before = old%n_before
    patch%viscosity%is_active = old%viscosity%is_active
    patch%viscosity%density = old%viscosity%density
    patch%viscosity%wave_speed = old%viscosity%wave_speed
  end subroutine carry_clock

  !> Block, lane and row before of the point of a row: in a whole element the same one, in a cut one
  !! the nearest of the element.
  pure function origin_of_point(old, patch, block, lane, row) result(from)
    type(solid_patch_t), intent(in) :: old, patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: lane, row
    integer :: from(3)

    from(:2) = lane_of_element(old, [patch%lanes%element(lane, block%b), block%e2, block%e3])
    from(3) = nearest_row(old, block_at(old, from(1)), from(2), &
                          local_place(patch, block, lane, row))
  end function origin_of_point

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
    do k = 1, product(patch%axes(:2)%n_points)
      distance = sum((local_place(patch, block, lane, k) - place)**2)
      if (distance >= best) cycle
      best = distance
      row = k
    end do
  end function nearest_row

  !> Stress, state and what else a patch has along axis 3 of a row, from where they were before.
  pure subroutine carry_point_state(old, from, block, lane, row, patch)
    type(solid_patch_t), intent(in) :: old
    integer, intent(in) :: from(3)                   !! see `origin_of_point`
    integer, intent(in) :: block, lane, row
    type(solid_patch_t), intent(inout) :: patch
    integer :: n, i, j, to_group, from_group

    n = patch%axes(3)%n_points
    i = n*mod(row - 1, patch%together)
    j = n*mod(from(3) - 1, old%together)
    to_group = (row - 1)/patch%together + 1
    from_group = (from(3) - 1)/old%together + 1
    patch%stress(lane, i + 1:i + n, :, to_group, block) &
      = old%stress(from(2), j + 1:j + n, :, from_group, from(1))
    patch%state(lane, i + 1:i + n, :, to_group, block) &
      = old%state(from(2), j + 1:j + n, :, from_group, from(1))
    if (size(old%push, 4) == old%n_blocks .and. size(patch%push, 4) == patch%n_blocks) &
      patch%push(lane, :, row, block) = old%push(from(2), :, from(3), from(1))
    if (allocated(patch%given)) &
      patch%given(lane, :, :, row, block) = old%given(from(2), :, :, from(3), from(1))
  end subroutine carry_point_state

  !> Clock and state of all points of a patch that is cut.
  subroutine carry_points(old, n_rows, patch)
    type(solid_patch_t), intent(in) :: old
    integer, intent(in) :: n_rows                  !! of points of an element
    type(solid_patch_t), intent(inout) :: patch    !! that takes its place
    integer :: b, l, row

    call carry_clock(old, patch)
    do b = 1, patch%n_blocks
      do l = 1, n_lanes
        do row = 1, n_rows
          call carry_point_state(old, origin_of_point(old, patch, block_at(patch, b), l, row), b, &
                                 l, row, patch)
        end do
      end do
    end do
  end subroutine carry_points

  !> The mean place of the control points of an element along the sheet, now.
  pure function centre_of(patch, x, e) result(centre)
    type(solid_patch_t), intent(in) :: patch
    real(wp), intent(in) :: x(:, :, :, :)          !! control points [length]
    integer, intent(in) :: e(2)                    !! element along axes 1 and 2
    real(wp) :: centre(3)
    integer :: first(2), last(2), c

    first = [patch%axes(1)%first(e(1)), patch%axes(2)%first(e(2))]
    last = first + patch%axes(:2)%degree
    do c = 1, 3
      associate (points => x(first(1):last(1), first(2):last(2), :, c))
        centre(c) = sum(points)/size(points)
      end associate
    end do
  end function centre_of

end module patch_outline
