!> Cut the blank along curves that are projected onto it along an axis of space: as its outline at
!! the start, or as it lies at the start of a step.
module blank_trim
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: rounded_text, place_text
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use surface_grid, only: lines
  use outline, only: polygon_t, region_t, new_region
  use element, only: element_t
  use blank, only: blank_t, mass_of
  use body_parts, only: set_inertia, lead_edges
  use effect, only: effect_slot_t
  use contact_effect, only: contact_view_t, contact_pairs, trim_pair
  implicit none
  private

  public :: cut_blank, trim_pairs

  !> What a cut leaves.
  type, public :: trim_t
    character(:), allocatable :: name
    integer :: step = 0                       !! of the deck; 0: before the run
    integer :: axis = 3                       !! of the projection: 1 x, 2 y, 3 z
    logical :: is_outside = .false.           !! what lies outside of the polygons stays
    type(polygon_t), allocatable :: polygons(:)   !! by the two other axes, in cyclic order [length]
  end type trim_t

  integer, parameter :: samples_per_element = 2   !! for first guesses of the projection

contains

  !> Cut the blank, which has one part, as it lies now.
  subroutine cut_blank(trim, blank, error)
    type(trim_t), intent(in) :: trim
    type(blank_t), intent(inout) :: blank
    type(error_t), allocatable, intent(out) :: error
    type(polygon_t) :: polygons(size(trim%polygons))
    type(region_t) :: regions(1)
    integer :: p

    associate (element => blank%parts(1)%element)
      do p = 1, size(polygons)
        call project(element, trim%axis, trim%polygons(p)%corners, polygons(p)%corners, error)
        if (.not. allocated(error) .and. trim%step == 0) &
          call check_reach(element, trim, polygons(p)%corners, trim%polygons(p)%corners, error)
        if (allocated(error)) return
      end do
      call new_region(regions(1), polygons, trim%is_outside)
      call element%trim(regions, blank%law, error)
      if (allocated(error)) return
    end associate
    call set_inertia(blank%parts, blank%seams)
    call lead_edges(blank%parts)
  end subroutine cut_blank

  !> Contact pairs follow the outline of the blank.
  subroutine trim_pairs(blank, effects)
    type(blank_t), intent(in) :: blank
    type(effect_slot_t), intent(inout), target :: effects(:)
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      call trim_pair(pairs(i)%pair, blank%parts(pairs(i)%pair%part)%element)
    end do
  end subroutine trim_pairs

  !> Refuse an outline that is wider than the sheet.
  subroutine check_reach(element, trim, corners, places, error)
    class(element_t), intent(in) :: element
    type(trim_t), intent(in) :: trim
    real(wp), intent(in) :: corners(:, :), places(:, :)   !! by parameters, in space
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: beyond = 1.0e-6_wp            ! of the parameters, that is nothing
    real(wp) :: low, high, worst, now
    integer :: a, i, at

    if (trim%is_outside) return
    worst = 0.0_wp
    at = 1
    do a = 1, 2
      associate (knots => element%grid%axes(a)%knots)
        low = knots(1)
        high = knots(size(knots))
      end associate
      do i = 1, size(corners, 2)
        now = max(low - corners(a, i), corners(a, i) - high)/(high - low)
        if (now <= worst) cycle
        worst = now
        at = i
      end do
    end do
    if (worst > beyond) call fail(error, "a curve that leaves the sheet by "// &
      rounded_text(100.0_wp*worst)//" % of its length at "// &
      place_text([places(:, at), 0.0_wp]))
  end subroutine check_reach

  !> Parameters of the places on the mid-surface that lie over the corners of a polygon. Beyond its
  !! edges the surface goes on straight.
  subroutine project(element, axis, corners, places, error)
    class(element_t), intent(in) :: element
    integer, intent(in) :: axis
    real(wp), intent(in) :: corners(:, :)
    real(wp), allocatable, intent(inout) :: places(:, :)
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_surface_t) :: surface
    real(wp) :: at(2), extent
    logical :: is_found
    integer :: i, plane(2)

    surface%axes = element%grid%axes(:2)
    surface%weights = element%grid%weights(:, :, 1)
    surface%points = element%motion%x(:, :, 1, :)
    plane = [mod(axis, 3) + 1, mod(axis + 1, 3) + 1]
    extent = maxval([(maxval(surface%points(:, :, plane(i))) - minval(surface%points(:, :, &
                      plane(i))), i=1, 2)])
    if (allocated(places)) deallocate (places)
    allocate (places(2, size(corners, 2)))
    is_found = .false.
    do i = 1, size(corners, 2)
      if (is_found) call find_place(surface, plane, corners(:, i), extent, at, is_found)
      if (.not. is_found) then
        at = first_guess(surface, element, plane, corners(:, i))
        call find_place(surface, plane, corners(:, i), extent, at, is_found)
      end if
      if (.not. is_found) then
        call fail(error, "no place of the sheet under a curve at "// &
                  place_text([corners(:, i), 0.0_wp])//": it is too steep there")
        return
      end if
      places(:, i) = at
    end do
  end subroutine project

  !> The nearest of some places, inside the outline that the sheet has.
  function first_guess(surface, element, plane, target) result(at)
    type(nurbs_surface_t), intent(in) :: surface
    class(element_t), intent(in) :: element
    integer, intent(in) :: plane(2)
    real(wp), intent(in) :: target(2)
    real(wp) :: at(2), x(3), best, distance
    integer :: i, j

    best = huge(best)
    at = 0.5_wp
    associate (xi => lines(surface%axes(1), samples_per_element), &
               eta => lines(surface%axes(2), samples_per_element))
      do j = 1, size(eta)
        do i = 1, size(xi)
          if (element%is_outside([min((i - 1)/samples_per_element + 1, element%n_elements(1)), &
                                  min((j - 1)/samples_per_element + 1, element%n_elements(2)), &
                                  1])) cycle
          call evaluate_surface(surface, [xi(i), eta(j)], x)
          distance = sum((x(plane) - target)**2)
          if (distance >= best) cycle
          best = distance
          at = [xi(i), eta(j)]
        end do
      end do
    end associate
  end function first_guess

  !> Newton's method from a guess, on the two coordinates across the projection.
  subroutine find_place(surface, plane, target, extent, at, is_found)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: plane(2)
    real(wp), intent(in) :: target(2), extent
    real(wp), intent(inout) :: at(2)
    logical, intent(out) :: is_found
    integer, parameter :: most = 30
    real(wp), parameter :: near = 1.0e-11_wp, flat = 1.0e-3_wp, longest = 0.2_wp
    real(wp) :: x(3), d1(3, 2), inside(2), lack(2), step(2), det
    integer :: i, a

    is_found = .false.
    do i = 1, most
      do a = 1, 2
        associate (knots => surface%axes(a)%knots)
          inside(a) = min(max(at(a), knots(1)), knots(size(knots)))
        end associate
      end do
      call evaluate_surface(surface, inside, x, d1)
      x = x + matmul(d1, at - inside)
      lack = target - x(plane)
      is_found = norm2(lack) <= near*extent
      if (is_found) return
      associate (j => d1(plane, :))
        det = j(1, 1)*j(2, 2) - j(1, 2)*j(2, 1)
        if (abs(det) <= flat*norm2(d1(:, 1))*norm2(d1(:, 2))) return
        step = [j(2, 2)*lack(1) - j(1, 2)*lack(2), j(1, 1)*lack(2) - j(2, 1)*lack(1)]/det
      end associate
      at = at + step*min(1.0_wp, longest/max(norm2(step), tiny(1.0_wp)))
    end do
  end subroutine find_place

end module blank_trim
