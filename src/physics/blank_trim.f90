!> Cut the blank along curves that are projected onto it along an axis of space: as its outline at
!! the start, or at the start of a step, as it lies then or as it was before the run.
module blank_trim
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text, rounded_text, place_text
  use input_errors, only: origin_t
  use linear_algebra, only: cross
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use knot_vector, only: breaks
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use surface_grid, only: lines
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use outline, only: polygon_t, region_t, new_region, cut_to_box, covers_box, signed_area, &
                     plane_of, in_space
  use outline_slits, only: slit_t, find_slit
  use element, only: element_t
  use shell_setup, only: mid_surface
  use blank, only: blank_t, mass_of
  use blank_pieces, only: check_pieces
  use body_parts, only: set_inertia, lead_edges
  use effect, only: effect_slot_t
  use contact_effect, only: contact_view_t, contact_pairs, trim_pair
  implicit none
  private

  public :: cut_blank, trim_pairs, slit_words, slit_remedy, is_edge_on, edge_on_words

  !> What a cut has taken away.
  type, public :: loss_t
    real(wp) :: share = 0.0_wp                !! of the mass; 0: nothing but round-off
    real(wp) :: mass = 0.0_wp                 !! [mass]
    real(wp) :: area = 0.0_wp                 !! of the sheet as it lies then [area]
    type(slit_t) :: slit                      !! a gap whose sides move as one
  end type loss_t

  !> What a cut leaves.
  type, public :: trim_t
    character(:), allocatable :: name
    type(origin_t) :: origin                  !! keyword of the deck
    integer :: step = 0                       !! of the deck; 0: before the run
    integer :: axis = 3                       !! of the projection: 1 x, 2 y, 3 z
    logical :: is_outside = .false.           !! what lies outside of the polygons stays
    integer :: n_pieces = 1                   !! of the sheet after the cut
    logical :: is_flat = .false.              !! they lie on the sheet as it was before the run
    type(polygon_t), allocatable :: polygons(:)   !! by the two other axes, in cyclic order [length]
    type(origin_t), allocatable :: origins(:) !! of each of them; absent: not known
    type(loss_t) :: loss                      !! of one that has been cut before the run
  end type trim_t

  integer, parameter :: samples_per_element = 2   !! for first guesses of the projection
  real(wp), parameter :: per_element = 0.2_wp     !! piece of a straight line, of an element
  real(wp), parameter :: flat = 1.0e-3_wp         !! of the area of a place, across the projection

contains

  !> Cut the blank, which has one part.
  subroutine cut_blank(trim, blank, error, loss)
    type(trim_t), intent(in) :: trim
    type(blank_t), intent(inout) :: blank
    type(error_t), allocatable, intent(out) :: error
    type(loss_t), intent(out), optional :: loss
    real(wp), parameter :: round_off = 1.0e-9_wp   ! of the mass
    real(wp) :: mass, area
    type(polygon_t) :: polygons(size(trim%polygons))
    type(region_t) :: regions(1)
    type(nurbs_surface_t) :: surface
    integer :: p

    mass = mass_of(blank%parts)
    associate (element => blank%parts(1)%element)
      if (present(loss)) area = area_of(element)
      do p = 1, size(polygons)
        call project(element, trim, trim%polygons(p)%corners, polygons(p)%corners, error)
        if (.not. allocated(error) .and. must_be_within(trim)) &
          call check_reach(element, polygons(p)%corners, error)
        if (.not. allocated(error)) cycle
        if (allocated(trim%origins)) error%message = error%message//" (the curve of "// &
          trim%origins(p)%file//":"//to_text(trim%origins(p)%line)//")"
        return
      end do
      call new_region(regions(1), polygons, trim%is_outside)
      call element%trim(regions, blank%law, error)
      if (allocated(error)) return
      surface = middle_of(element%grid, element%motion%x)
      call check_pieces(element, regions(1), surface, trim%n_pieces, error)
      if (allocated(error)) return
    end associate
    call set_inertia(blank%parts, blank%seams)
    call lead_edges(blank%parts)
    if (.not. present(loss)) return
    if (.not. mass - mass_of(blank%parts) > round_off*mass) return
    loss%mass = mass - mass_of(blank%parts)
    loss%share = loss%mass/mass
    associate (element => blank%parts(1)%element)
      loss%area = area - area_of(element)
      call find_slit(surface, regions(1), element%ties%share, loss%slit)
    end associate
  end subroutine cut_blank

  !> What is wrong with a gap.
  pure function slit_words(slit) result(words)
    type(slit_t), intent(in) :: slit
    character(:), allocatable :: words

    words = "a gap of "//rounded_text(slit%width)//", "//rounded_text(slit%elements)// &
            " elements, at "//place_text(slit%place)//": its sides move as one there"
  end function slit_words

  !> What to do about it.
  pure function slit_remedy(slit) result(words)
    type(slit_t), intent(in) :: slit
    character(:), allocatable :: words

    words = "elements no longer than "//rounded_text(slit%longest)//" across it (*REFINE, also "// &
            "with NEAR), or a wider gap"
  end function slit_remedy

  !> Area of the mid-surface as it lies; of a cut element the share inside of its area.
  real(wp) function area_of(element) result(area)
    class(element_t), intent(in) :: element
    type(nurbs_surface_t) :: surface
    type(gauss_rule_t) :: rule
    real(wp), allocatable :: xi(:), eta(:)
    real(wp) :: x(3), d1(3, 2), middle(2), half(2), part
    integer :: i, j, k, l

    surface = middle_of(element%grid, element%motion%x)
    rule = new_gauss_rule(maxval(surface%axes%degree), 1)
    xi = breaks(surface%axes(1))
    eta = breaks(surface%axes(2))
    area = 0.0_wp
    do j = 1, size(eta) - 1
      do i = 1, size(xi) - 1
        if (element%is_outside([i, j, 1])) cycle
        middle = 0.5_wp*[xi(i) + xi(i + 1), eta(j) + eta(j + 1)]
        half = 0.5_wp*[xi(i + 1) - xi(i), eta(j + 1) - eta(j)]
        part = 0.0_wp
        do l = 1, rule%n
          do k = 1, rule%n
            call evaluate_surface(surface, middle + half*[rule%points(k), rule%points(l)], x, d1)
            part = part + rule%weights(k)*rule%weights(l)*norm2(cross(d1(:, 1), d1(:, 2)))
          end do
        end do
        if (allocated(element%ties%share)) part = element%ties%share(i, j)*part
        area = area + product(half)*part
      end do
    end do
  end function area_of

  !> The mid-surface of a sheet with its control points where they are given.
  pure function middle_of(grid, points) result(surface)
    type(nurbs_solid_t), intent(in) :: grid
    real(wp), intent(in) :: points(:, :, :, :)
    type(nurbs_surface_t) :: surface
    type(nurbs_solid_t) :: sheet

    sheet = grid
    sheet%points = points
    sheet = mid_surface(sheet)
    surface%axes = sheet%axes(:2)
    surface%weights = sheet%weights(:, :, 1)
    surface%points = sheet%points(:, :, 1, :)
  end function middle_of

  !> Contact pairs follow the outline of the blank.
  subroutine trim_pairs(blank, effects, dt, first_step)
    type(blank_t), intent(in) :: blank
    type(effect_slot_t), intent(inout), target :: effects(:)
    real(wp), intent(in), optional :: dt          !! largest step to come, for springs [time]
    integer, intent(in), optional :: first_step   !! only pairs that begin with this step
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      if (present(first_step)) then
        if (pairs(i)%pair%first_step /= first_step) cycle
      end if
      call trim_pair(pairs(i)%pair, blank%parts(pairs(i)%pair%part)%element, dt)
    end do
  end subroutine trim_pairs

  !> An outline within which the blank lies has all of it; other curves may leave the sheet.
  pure logical function must_be_within(trim)
    type(trim_t), intent(in) :: trim

    must_be_within = trim%step == 0 .and. .not. trim%is_outside
  end function must_be_within

  !> Refuse an outline that is wider than the sheet, also where that is narrower than its box.
  subroutine check_reach(element, corners, error)
    class(element_t), intent(in) :: element
    real(wp), intent(in) :: corners(:, :)                !! by parameters
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: beyond = 1.0e-6_wp            ! of the parameters, that is nothing
    real(wp) :: low, high, worst, now, x(3)
    integer :: a, i, at

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
    if (worst <= beyond) return
    call evaluate_solid(element%grid, [corners(:, at), 0.5_wp], x)
    call fail(error, "a curve that leaves the sheet by "//rounded_text(100.0_wp*worst)// &
              " % of its length at "//place_text(x))
  end subroutine check_reach

  !> Parameters of the places on the mid-surface that lie over a polygon, whose edges are taken in
  !! pieces shorter than elements. Beyond the edges of the sheet its surface goes on straight.
  subroutine project(element, trim, corners, places, error)
    class(element_t), intent(in) :: element
    type(trim_t), intent(in) :: trim
    real(wp), intent(in) :: corners(:, :)
    real(wp), allocatable, intent(inout) :: places(:, :)
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_surface_t) :: surface
    real(wp), allocatable :: near(:, :)
    real(wp) :: box(2, 2), extent
    integer :: i, plane(2)

    if (trim%is_flat) surface = middle_of(element%grid, element%grid%points)
    if (.not. trim%is_flat) surface = middle_of(element%grid, filled_points(element))
    if (has_no_front(surface, trim%axis)) then
      call fail(error, edge_on_words(trim%axis))
      return
    end if
    plane = plane_of(trim%axis)
    do i = 1, 2
      box(i, :) = [minval(surface%points(:, :, plane(i))), maxval(surface%points(:, :, plane(i)))]
    end do
    extent = maxval(box(:, 2) - box(:, 1))
    call take_near(corners, box, extent, plane, must_be_within(trim), near, error)
    if (allocated(error)) return
    if (covers_box(corners, box(:, 1), box(:, 2)) .and. .not. must_be_within(trim)) then
      places = around_all(surface, sqrt(abs(signed_area(corners))/product(box(:, 2) - box(:, 1))))
      return
    end if
    near = pieces_of(near, per_element*extent/maxval(element%n_elements))
    call project_pieces(surface, element, plane, extent, near, places, error)
    if (.not. allocated(error)) call check_overlap(surface, plane, near, places, error)
  end subroutine project

  !> Parameters of a curve around all of the sheet, which need not lie over its surface continued:
  !! a rectangle, wider than other curves reach, and the wider the longer the curve.
  pure function around_all(surface, size_over_sheet) result(places)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: size_over_sheet           !! of the curve, >= 1
    real(wp) :: places(2, 4)
    real(wp), parameter :: far = 1.0e3_wp             ! of the parameters
    real(wp) :: low, high, away
    integer :: a

    do a = 1, 2
      associate (knots => surface%axes(a)%knots)
        away = far*size_over_sheet*(knots(size(knots)) - knots(1))
        low = knots(1) - away
        high = knots(size(knots)) + away
      end associate
      places(a, :) = merge([low, high, high, low], [low, low, high, high], a == 1)
    end do
  end function around_all

  !> Does the sheet, as it lies, show nothing but its edge along an axis?
  pure logical function is_edge_on(element, axis)
    class(element_t), intent(in) :: element
    integer, intent(in) :: axis                   !! of space

    is_edge_on = has_no_front(middle_of(element%grid, element%motion%x), axis)
  end function is_edge_on

  !> What is wrong then.
  pure function edge_on_words(axis) result(words)
    integer, intent(in) :: axis                   !! of space
    character(:), allocatable :: words

    words = "DIRECTION="//"XYZ"(axis:axis)//", along which the sheet shows nothing but its edge"
  end function edge_on_words

  !> Is a surface nowhere seen along an axis but as a line?
  pure logical function has_no_front(surface, axis)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: axis
    real(wp), allocatable :: xi(:), eta(:)
    real(wp) :: x(3), d1(3, 2), across(3)
    integer :: i, j

    has_no_front = .false.
    xi = lines(surface%axes(1), samples_per_element)
    eta = lines(surface%axes(2), samples_per_element)
    do j = 1, size(eta)
      do i = 1, size(xi)
        call evaluate_surface(surface, [xi(i), eta(j)], x, d1)
        across = cross(d1(:, 1), d1(:, 2))
        if (abs(across(axis)) > flat*norm2(d1(:, 1))*norm2(d1(:, 2))) return
      end do
    end do
    has_no_front = .true.
  end function has_no_front

  !> Refuse a curve beside the sheet: others of its keyword would cut, and it would do nothing.
  subroutine check_overlap(surface, plane, corners, places, error)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: plane(2)
    real(wp), intent(in) :: corners(:, :)             !! across the projection
    real(wp), intent(in) :: places(:, :)              !! by parameters
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: nothing = 1.0e-9_wp        ! of its area
    real(wp), parameter :: round_off = 1.0e-9_wp      ! of a distance
    real(wp), allocatable :: met(:, :)
    real(wp) :: ends(2, 2), x(3)
    integer :: a, at

    do a = 1, 2
      associate (knots => surface%axes(a)%knots)
        ends(a, :) = [knots(1), knots(size(knots))]
      end associate
    end do
    call cut_to_box(places, ends(:, 1), ends(:, 2), met)
    if (abs(signed_area(met)) > nothing*abs(signed_area(places))) return
    at = minloc(norm2(max(spread(ends(:, 1), 2, size(places, 2)) - places, &
                          places - spread(ends(:, 2), 2, size(places, 2)), 0.0_wp), 1), 1)
    call evaluate_surface(surface, min(max(places(:, at), ends(:, 1)), ends(:, 2)), x)
    associate (off => norm2(corners - spread(x(plane), 2, size(corners, 2)), 1))
      call refuse_far(merge(minval(off), 0.0_wp, minval(off) > round_off*maxval(off)), &
                      corners(:, minloc(off, 1)), plane, error)
    end associate
  end subroutine check_overlap

  subroutine refuse_far(gap, corner, plane, error)
    real(wp), intent(in) :: gap                       !! from the sheet [length]
    real(wp), intent(in) :: corner(2)                 !! of the curve, the nearest
    integer, intent(in) :: plane(2)
    type(error_t), allocatable, intent(out) :: error

    if (gap > 0.0_wp) then
      call fail(error, "a curve that does not meet the sheet: about "//rounded_text(gap)// &
                " off it at "//place_text(in_space(corner, plane)))
    else
      call fail(error, "a curve that touches the sheet only at its edge, at "// &
                place_text(in_space(corner, plane)))
    end if
  end subroutine refuse_far

  !> What of a polygon lies on the box of the sheet and a little beside it: all that counts. Farther
  !! off the sheet continued may have folds. Refused are curves with nothing there, and such that
  !! leave the box and may not.
  subroutine take_near(corners, box, extent, plane, is_within, near, error)
    real(wp), intent(in) :: corners(:, :)
    real(wp), intent(in) :: box(2, 2), extent       !! low, high
    integer, intent(in) :: plane(2)
    logical, intent(in) :: is_within                !! the polygon may not leave the sheet
    real(wp), allocatable, intent(out) :: near(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: round_off = 1.0e-6_wp    ! of the extent
    real(wp), parameter :: around = 0.1_wp          ! of the extent, what counts beside the box
    real(wp) :: beyond(size(corners, 2))
    integer :: i, at

    do i = 1, size(beyond)
      beyond(i) = norm2(max(box(:, 1) - corners(:, i), corners(:, i) - box(:, 2), 0.0_wp))
    end do
    call cut_to_box(corners, box(:, 1) - around*extent, box(:, 2) + around*extent, near)
    at = merge(maxloc(beyond, 1), minloc(beyond, 1), size(near, 2) > 0)
    if (size(near, 2) == 0) then
      call refuse_far(beyond(at), corners(:, at), plane, error)
    else if (is_within .and. beyond(at) > round_off*extent) then
      call fail(error, "a curve that leaves the sheet by "//rounded_text(beyond(at))//" at "// &
                place_text(in_space(corners(:, at), plane)))
    end if
  end subroutine take_near

  !> Control points now. Those outside an outline, or that follow others at its edge, are laid
  !! beside their neighbours inside as they were at the start, so that curves may leave the sheet.
  pure function filled_points(element) result(points)
    class(element_t), intent(in) :: element
    real(wp), allocatable :: points(:, :, :, :)
    integer, parameter :: ways(2, 4) = reshape([-1, 0, 1, 0, 0, -1, 0, 1], [2, 4])
    logical, allocatable :: is_known(:, :), was_known(:, :)
    integer :: i, j, w, at(2)

    points = element%motion%x
    if (.not. allocated(element%ties%is_free)) return
    is_known = element%ties%is_free
    do while (.not. all(is_known))
      was_known = is_known
      do j = 1, size(is_known, 2)
        do i = 1, size(is_known, 1)
          do w = 1, 4
            if (is_known(i, j)) exit
            at = [i, j] + ways(:, w)
            if (any(at < 1 .or. at > shape(is_known))) cycle
            if (.not. was_known(at(1), at(2))) cycle
            points(i, j, :, :) = points(at(1), at(2), :, :) + element%grid%points(i, j, :, :) &
                                 - element%grid%points(at(1), at(2), :, :)
            is_known(i, j) = .true.
          end do
        end do
      end do
    end do
  end function filled_points

  !> A polygon with more corners: none of its edges is longer than `longest`.
  pure function pieces_of(corners, longest) result(all_corners)
    real(wp), intent(in) :: corners(:, :), longest
    real(wp), allocatable :: all_corners(:, :)
    integer :: n(size(corners, 2)), i, k, m

    do i = 1, size(n)
      n(i) = max(1, ceiling(norm2(corners(:, mod(i, size(n)) + 1) - corners(:, i))/longest))
    end do
    allocate (all_corners(2, sum(n)))
    m = 0
    do i = 1, size(n)
      associate (a => corners(:, i), b => corners(:, mod(i, size(n)) + 1))
        do k = 0, n(i) - 1
          m = m + 1
          all_corners(:, m) = a + (b - a)*k/n(i)
        end do
      end associate
    end do
  end function pieces_of

  !> Each corner from the place of the one before it, or from the nearest of some places. Corners
  !! over a wall, which may have no place there or many, are left out where those around them are
  !! less than an element apart.
  subroutine project_pieces(surface, element, plane, extent, corners, places, error)
    type(nurbs_surface_t), intent(in) :: surface
    class(element_t), intent(in) :: element
    integer, intent(in) :: plane(2)
    real(wp), intent(in) :: extent, corners(:, :)
    real(wp), allocatable, intent(inout) :: places(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: at(2), found(2, size(corners, 2)), nearest(2), widest, gap
    logical :: is_found
    integer :: i, last, n

    widest = extent/maxval(element%n_elements)
    n = 0
    last = 0
    is_found = .false.
    do i = 1, size(corners, 2)
      if (is_found) call find_place(surface, plane, corners(:, i), extent, at, is_found)
      if (.not. is_found) then
        call guess_place(surface, element, plane, corners(:, i), nearest, gap)
        at = nearest
        call find_place(surface, plane, corners(:, i), extent, at, is_found)
      end if
      if (is_found) then
        n = n + 1
        found(:, n) = at
        last = i
      else if (last == 0 .or. norm2(corners(:, i) - corners(:, max(last, 1))) > widest) then
        call refuse_place(surface, plane, corners(:, i), nearest, gap, widest, error)
        return
      end if
    end do
    if (allocated(places)) deallocate (places)
    allocate (places, source=found(:, :n))
  end subroutine project_pieces

  !> Say why no place of the sheet lies under a corner: it is off the sheet, or the sheet is steep.
  subroutine refuse_place(surface, plane, corner, nearest, gap, longest, error)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: plane(2)
    real(wp), intent(in) :: corner(2)
    real(wp), intent(in) :: nearest(2), gap        !! see `guess_place`
    real(wp), intent(in) :: longest                !! gap within the sheet [length]
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: x(3)

    if (gap <= longest) then
      call fail(error, "no place of the sheet under a curve at "// &
                place_text(in_space(corner, plane))//": it is too steep there")
    else
      call evaluate_surface(surface, nearest, x)
      call fail(error, "a curve that does not meet the sheet at "// &
                place_text(in_space(corner, plane))//": it is about "//rounded_text(gap)// &
                " off its nearest place, "//place_text(x)//", and the sheet is too steep there "// &
                "to go on straight")
    end if
  end subroutine refuse_place

  !> The nearest of some places, inside the outline that the sheet has.
  subroutine guess_place(surface, element, plane, target, at, gap)
    type(nurbs_surface_t), intent(in) :: surface
    class(element_t), intent(in) :: element
    integer, intent(in) :: plane(2)
    real(wp), intent(in) :: target(2)
    real(wp), intent(out) :: at(2)
    real(wp), intent(out) :: gap                   !! across the projection [length]
    real(wp) :: x(3), best, distance
    integer :: i, j

    best = huge(best)
    at = [surface%axes(1)%knots(1), surface%axes(2)%knots(1)]
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
    gap = sqrt(best)
  end subroutine guess_place

  !> Newton's method from a guess, on the two coordinates across the projection.
  subroutine find_place(surface, plane, target, extent, at, is_found)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: plane(2)
    real(wp), intent(in) :: target(2), extent
    real(wp), intent(inout) :: at(2)
    logical, intent(out) :: is_found
    integer, parameter :: most = 30
    real(wp), parameter :: near = 1.0e-11_wp
    real(wp), parameter :: longest = 0.2_wp         ! step, of the range of the knots
    real(wp) :: x(3), d1(3, 2), inside(2), lack(2), step(2), det, range(2)
    integer :: i, a

    is_found = .false.
    do i = 1, most
      do a = 1, 2
        associate (knots => surface%axes(a)%knots)
          inside(a) = min(max(at(a), knots(1)), knots(size(knots)))
          range(a) = knots(size(knots)) - knots(1)
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
      at = at + step*min(1.0_wp, longest/max(norm2(step/range), tiny(1.0_wp)))
    end do
  end subroutine find_place

end module blank_trim
