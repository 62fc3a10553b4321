!> Closest point of a tool, one point at a time: Newton on the tangency conditions, with guards.
!!
!! [CA] R. P. R. Cardoso and O. B. Adetoro (2017), eqs. (48)-(55). Knot lines where the tangent
!! breaks, borders and corners are normal cases here: the search stays on a face, crosses to the
!! neighbour where the distance falls that way, and stops on the knot line where it does not.
module closest_point
  use kinds, only: wp
  use tool, only: tool_t
  use tool_face, only: separation_t, separation, face_position, unit_normal
  use tool_cells, only: cell_t
  use contact_territory, only: is_in_territory, distance_bound, relative_place
  use position_code, only: find_candidates
  implicit none
  private

  public :: hit_t, search_tool, search_all_faces, follow, is_beside

  integer, parameter :: max_iterations = 200   !! Newton steps before a start is given up
  integer, parameter :: max_halvings = 30     !! of one step
  real(wp), parameter :: step_tolerance = 1.0e-12_wp      !! last step, part of the tool's scale
  real(wp), parameter :: stalled_step = 1.0e-5_wp         !! the same where round-off stops it
  real(wp), parameter :: same_place = 1.0e-8_wp           !! part of the tool's scale
  real(wp), parameter :: along_normal = 1.0e-6_wp         !! sine of an angle taken for zero
  real(wp), parameter :: border_slack = 1.0e-9_wp         !! part of the tool's scale
  real(wp), parameter :: round_off = 1.0e-14_wp           !! of a coordinate, part of the scale

  !> Where a point lies against a tool.
  type :: hit_t
    integer :: face = 0                  !! face of the closest point, 0: none was found
    real(wp) :: at(2) = 0.0_wp           !! local coordinates s and t on that face
    real(wp) :: distance = huge(1.0_wp)  !! to the closest point [length]
    real(wp) :: gap = huge(1.0_wp)       !! eq. (54), positive on the sheet's side [length]
    real(wp) :: normal(3) = 0.0_wp       !! unit, towards the sheet's side, eq. (55)
    real(wp) :: overhang = 0.0_wp        !! how far the point is beyond the tool's border [length]
    real(wp) :: rival = huge(1.0_wp)     !! distance to the next best place, if it was looked for
    integer :: n_iterations = 0          !! evaluations of the face in all starts
    logical :: is_converged = .false.
  end type hit_t

contains

  !> Closest point among the cells that the position code of `x` names and whose territory holds it.
  !! Nothing found means that `x` is farther than the search distance from every face, unless
  !! `is_converged` is false: then every start failed. The rival is exact if nearer than
  !! `distance + margin`.
  pure subroutine search_tool(tool, x, margin, is_corner_start, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)                !! point in the tool's frame [length]
    real(wp), intent(in) :: margin              !! how much farther rivals matter [length]
    logical, intent(in) :: is_corner_start      !! start at each face's first corner, as [CA] does
    type(hit_t), intent(out) :: hit
    integer :: first, last, i, n
    integer, allocatable :: near(:)

    call find_candidates(tool%codes, x, first, last)
    allocate (near(last - first + 1))
    n = 0
    do i = first, last
      associate (cell => tool%codes%faces(i))
        if (.not. is_in_territory(tool%cells(cell)%territory, x, tool%search_distance)) cycle
        if (distance_bound(tool%cells(cell)%territory, x) > tool%search_distance) cycle
        n = n + 1
        near(n) = cell
      end associate
    end do
    call search_cells(tool, x, near(:n), margin, is_corner_start, hit)
    if (n == 0) hit%is_converged = .true.
    if (hit%face == 0 .or. hit%distance <= tool%search_distance) return
    hit = hit_t(n_iterations=hit%n_iterations, is_converged=.true.)
  end subroutine search_tool

  !> Closest point among all faces, however far: for setting up and for checks, not for each step.
  pure subroutine search_all_faces(tool, x, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)   !! point in the tool's frame [length]
    type(hit_t), intent(out) :: hit
    integer :: i

    call search_cells(tool, x, [(i, i=1, size(tool%cells))], 0.0_wp, .false., hit)
  end subroutine search_all_faces

  !> Whether a point is beyond the tool's border by more than is allowed, so that it does not touch.
  pure logical function is_beside(tool, hit, allowed)
    type(tool_t), intent(in) :: tool
    type(hit_t), intent(in) :: hit
    real(wp), intent(in) :: allowed   !! [length]

    is_beside = hit%overhang > allowed + border_slack*tool%scale
  end function is_beside

  !> Closest point from a place on a face nearby, across knot lines where need be. For a point that
  !! moved a little since that place was its closest.
  pure subroutine follow(tool, x, face, at, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)    !! point in the tool's frame [length]
    integer, intent(in) :: face     !! where to start
    real(wp), intent(in) :: at(2)   !! local coordinates to start from
    type(hit_t), intent(out) :: hit

    hit%face = face
    hit%at = min(max(at, 0.0_wp), 1.0_wp)
    call descend(tool, x, hit)
    call finish(tool, x, hit)
  end subroutine follow

  !> Nearest of the local searches from some cells, in rising order of their bounds, until no other
  !! cell can matter.
  pure subroutine search_cells(tool, x, cells, margin, is_corner_start, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: cells(:)
    real(wp), intent(in) :: margin
    logical, intent(in) :: is_corner_start
    type(hit_t), intent(out) :: hit
    type(hit_t) :: trial
    real(wp) :: bounds(size(cells))
    logical :: is_left(size(cells))
    integer :: i, n, n_iterations

    bounds = [(distance_bound(tool%cells(cells(i))%territory, x), i=1, size(cells))]
    n_iterations = 0
    is_left = .true.
    do n = 1, size(cells)
      i = minloc(bounds, 1, is_left)
      if (bounds(i) > hit%distance + margin) exit
      is_left(i) = .false.
      associate (cell => tool%cells(cells(i)))
        trial%face = cell%face
        trial%at = cell%low
        if (.not. is_corner_start) trial%at = start_in(tool, cell, x)
      end associate
      call descend(tool, x, trial)
      n_iterations = n_iterations + trial%n_iterations
      if (trial%is_converged) call take_nearer(tool, trial, hit)
    end do
    if (hit%face /= 0) call finish(tool, x, hit)
    hit%n_iterations = n_iterations
  end subroutine search_cells

  !> Keep the nearer of two, and the farther as its rival unless both are one place.
  pure subroutine take_nearer(tool, trial, hit)
    type(tool_t), intent(in) :: tool
    type(hit_t), intent(in) :: trial
    type(hit_t), intent(inout) :: hit
    real(wp) :: rival, between
    type(hit_t) :: other

    if (hit%face == 0) then
      hit = trial
      return
    end if
    rival = hit%rival
    other = trial
    if (trial%distance < hit%distance) then
      other = hit
      hit = trial
    end if
    between = norm2(place_on(tool, other%face, other%at) - place_on(tool, hit%face, hit%at))
    hit%rival = rival
    if (between > same_place*tool%scale) hit%rival = min(rival, other%distance)
  end subroutine take_nearer

  !> Start near the closest point of a cell: below the point where the face is gently curved, else
  !! on the nearest of some points spread over the cell.
  pure function start_in(tool, cell, x) result(start)
    type(tool_t), intent(in) :: tool
    type(cell_t), intent(in) :: cell
    real(wp), intent(in) :: x(3)
    integer, parameter :: n = 4
    real(wp) :: start(2), square, least, at(2)
    integer :: i, j

    start = min(max(relative_place(cell%territory, x), 0.0_wp), 1.0_wp)
    start = cell%low + start*(cell%high - cell%low)
    if (cell%is_gentle) return
    least = sum((x - place_on(tool, cell%face, start))**2)
    do j = 1, n
      do i = 1, n
        at = cell%low + (real([i, j], wp) - 0.5_wp)/n*(cell%high - cell%low)
        square = sum((x - place_on(tool, cell%face, at))**2)
        if (square >= least) cycle
        least = square
        start = at
      end do
    end do
  end function start_in

  !> Point of a face of a tool.
  pure function place_on(tool, face, at) result(point)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)
    real(wp) :: point(3)

    point = face_position(tool%orders, tool%coefficients(:, :, :, face), at)
  end function place_on

  !> How the point `x` lies to a place on a face of a tool.
  pure function seen_from(tool, face, at, x) result(state)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2), x(3)
    type(separation_t) :: state

    state = separation(tool%orders, tool%coefficients(:, :, :, face), at, x)
  end function seen_from

  !> Newton with the full second derivatives, eq. (52), from a start on a face, always downhill.
  !! Where the Hessian is not positive enough of the metric is added.
  pure subroutine descend(tool, x, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t), intent(inout) :: hit
    type(separation_t) :: here
    logical :: is_free(2), is_lower
    real(wp) :: step(2), gain

    hit%n_iterations = 1
    hit%is_converged = .false.
    here = seen_from(tool, hit%face, hit%at, x)
    do while (hit%n_iterations < max_iterations)
      call cross_edges(tool, x, hit, here, is_free)
      call newton_step(here, hit%at, is_free, step, gain)
      hit%is_converged = gain <= (step_tolerance*tool%scale)**2
      if (hit%is_converged) exit
      call step_down(tool, x, step, hit, here, is_lower)
      ! Nothing lower nearby: the place is as good as round-off lets it be, if the step was short.
      hit%is_converged = gain <= (stalled_step*tool%scale)**2
      if (.not. is_lower) exit
    end do
    hit%distance = sqrt(here%square)
    if (hit%is_converged) hit%is_converged = is_minimum(here, is_free)
  end subroutine descend

  !> At an edge that the distance falls across: go to the neighbour, or hold the coordinate fixed
  !! where there is none or where the distance rises again beyond a break of the tangent.
  pure subroutine cross_edges(tool, x, hit, here, is_free)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t), intent(inout) :: hit
    type(separation_t), intent(inout) :: here
    logical, intent(out) :: is_free(2)   !! coordinates left to move
    type(separation_t) :: there
    real(wp) :: at(2)
    integer :: d, face

    is_free = .true.
    do d = 1, 2
      if (.not. is_blocked(hit%at(d), here%slope(d))) cycle
      is_free(d) = .false.
      face = tool%neighbours(edge_of(d, hit%at(d)), hit%face)
      if (face == 0) cycle
      at = hit%at
      at(d) = 1.0_wp - anint(at(d))
      there = seen_from(tool, face, at, x)
      hit%n_iterations = hit%n_iterations + 1
      if (is_blocked(at(d), there%slope(d))) cycle
      hit%face = face
      hit%at = at
      here = there
      is_free(d) = .true.
    end do
  end subroutine cross_edges

  !> Whether a coordinate is at its end and the distance falls beyond.
  pure logical function is_blocked(at, slope)
    real(wp), intent(in) :: at, slope

    is_blocked = (at <= 0.0_wp .and. slope < 0.0_wp) .or. (at >= 1.0_wp .and. slope > 0.0_wp)
  end function is_blocked

  !> Number of the edge where coordinate `d` has come to its end, as in the neighbour table.
  pure integer function edge_of(d, at)
    integer, intent(in) :: d
    real(wp), intent(in) :: at

    edge_of = 2*d - 1 + nint(at)
  end function edge_of

  !> Newton step in the free coordinates, and its gain: slope times step, about the step's square.
  pure subroutine newton_step(here, at, is_free, step, gain)
    type(separation_t), intent(in) :: here
    real(wp), intent(in) :: at(2)
    logical, intent(in) :: is_free(2)
    real(wp), intent(out) :: step(2), gain
    real(wp), parameter :: safe = 1.0e-10_wp
    real(wp) :: k(3), determinant
    integer :: d

    step = 0.0_wp
    if (all(is_free)) then
      k = positive_hessian(here)
      determinant = k(1)*k(2) - k(3)**2
      step(1) = (k(2)*here%slope(1) - k(3)*here%slope(2))/determinant
      step(2) = (k(1)*here%slope(2) - k(3)*here%slope(1))/determinant
      if (.not. any(is_blocked_both(at, step))) then
        gain = dot_product(step, here%slope)
        return
      end if
    end if
    do d = 1, 2
      step(d) = 0.0_wp
      k(d) = here%hessian(d)
      if (k(d) <= safe*here%metric(d)) k(d) = here%metric(d) + tiny(1.0_wp)
      if (is_free(d)) step(d) = here%slope(d)/k(d)
    end do
    gain = dot_product(step, here%slope)
  end subroutine newton_step

  !> The Hessian, made positive where it is not by enough of the metric to turn the sign of its
  !! lowest eigenvalue; the metric alone (Gauss-Newton) where that is degenerate.
  pure function positive_hessian(here) result(k)
    type(separation_t), intent(in) :: here
    real(wp) :: k(3)
    real(wp), parameter :: safe = 1.0e-10_wp, least = 1.0e-3_wp
    real(wp) :: a, b, lowest

    associate (h => here%hessian, m => here%metric)
      k = h
      if (h(1) > 0.0_wp .and. h(1)*h(2) - h(3)**2 > safe*m(1)*m(2)) return
      a = m(1)*m(2) - m(3)**2
      if (a > safe*m(1)*m(2)) then
        b = 0.5_wp*(h(1)*m(2) + h(2)*m(1)) - h(3)*m(3)
        lowest = (b - sqrt(max(b**2 - a*(h(1)*h(2) - h(3)**2), 0.0_wp)))/a
        k = h + max(-2*lowest, least)*m
        if (k(1) > 0.0_wp .and. k(1)*k(2) - k(3)**2 > safe*m(1)*m(2)) return
      end if
      k = m
      k(:2) = k(:2)*(1.0_wp + safe) + tiny(1.0_wp)
    end associate
  end function positive_hessian

  !> `is_blocked` for each coordinate.
  pure function is_blocked_both(at, direction) result(blocked)
    real(wp), intent(in) :: at(2), direction(2)
    logical :: blocked(2)
    integer :: d

    blocked = [(is_blocked(at(d), direction(d)), d=1, 2)]
  end function is_blocked_both

  !> Take the step, shortened until the distance does not rise.
  pure subroutine step_down(tool, x, step, hit, here, is_lower)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3), step(2)
    type(hit_t), intent(inout) :: hit
    type(separation_t), intent(inout) :: here
    logical, intent(out) :: is_lower
    type(separation_t) :: there
    real(wp) :: at(2), factor, slack
    integer :: i

    slack = round_off*tool%scale*(sqrt(here%square) + round_off*tool%scale)
    factor = 1.0_wp
    do i = 1, max_halvings
      at = min(max(hit%at + factor*step, 0.0_wp), 1.0_wp)
      there = seen_from(tool, hit%face, at, x)
      hit%n_iterations = hit%n_iterations + 1
      is_lower = there%square <= here%square + slack
      if (is_lower) exit
      factor = 0.5_wp*factor
    end do
    if (.not. is_lower) return
    hit%at = at
    here = there
  end subroutine step_down

  !> Whether the free coordinates are at a minimum and not at a saddle or a maximum. Points that see
  !! a whole piece of the face at one distance pass.
  pure logical function is_minimum(here, is_free)
    type(separation_t), intent(in) :: here
    logical, intent(in) :: is_free(2)
    real(wp), parameter :: flat = 1.0e-8_wp
    integer :: d

    is_minimum = all([(here%hessian(d) >= -flat*here%metric(d) .or. .not. is_free(d), d=1, 2)])
    if (all(is_free)) is_minimum = is_minimum .and. here%hessian(1)*here%hessian(2) &
      - here%hessian(3)**2 >= -flat*here%metric(1)*here%metric(2)
  end function is_minimum

  !> Gap, normal and overhang at the place found.
  !!
  !! Inside a face, and on a smooth knot line, the point lies along the normal. On a break of the
  !! tangent it lies between the normals of the faces that meet: there the gap is the signed
  !! distance and the normal its gradient, the same from whichever face the search came. Beyond the
  !! border the part that sticks out is kept apart as `overhang`.
  pure subroutine finish(tool, x, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t), intent(inout) :: hit
    type(separation_t) :: here
    real(wp) :: normal(3), mean(3), r(3), outward(3)
    logical :: has_break
    integer :: d

    here = seen_from(tool, hit%face, hit%at, x)
    hit%distance = sqrt(here%square)
    normal = safe_normal(tool, hit%face, hit%at)
    mean = normal
    r = here%r
    has_break = .false.
    do d = 1, 2
      if (.not. is_blocked(hit%at(d), here%slope(d))) cycle
      if (tool%neighbours(edge_of(d, hit%at(d)), hit%face) == 0) then
        outward = in_plane(here%d1(:, d), here%d1(:, 3 - d))*sign(1.0_wp, hit%at(d) - 0.5_wp)
        hit%overhang = hypot(hit%overhang, max(dot_product(r, outward), 0.0_wp))
        r = r - max(dot_product(r, outward), 0.0_wp)*outward
      else
        has_break = has_break .or. abs(here%slope(d)) > sqrt(here%metric(d)) &
          *max(along_normal*hit%distance, step_tolerance*tool%scale)
        mean = mean + normal_across(tool, hit, d)
      end if
    end do
    hit%gap = tool%side*dot_product(r, normal)
    hit%normal = tool%side*normal
    if (has_break .and. norm2(r) > 0.0_wp) then
      hit%gap = sign(norm2(r), tool%side*dot_product(r, mean))
      hit%normal = r/hit%gap
    end if
  end subroutine finish

  !> Unit vector along `a` without its part along `b`.
  pure function in_plane(a, b) result(unit)
    real(wp), intent(in) :: a(3), b(3)
    real(wp) :: unit(3), length

    unit = a - b*dot_product(a, b)/max(dot_product(b, b), tiny(1.0_wp))
    length = norm2(unit)
    unit = unit/max(length, tiny(1.0_wp))
  end function in_plane

  !> Normal of the face beyond the edge where coordinate `d` has come to its end.
  pure function normal_across(tool, hit, d) result(normal)
    type(tool_t), intent(in) :: tool
    type(hit_t), intent(in) :: hit
    integer, intent(in) :: d
    real(wp) :: normal(3), at(2)

    at = hit%at
    at(d) = 1.0_wp - anint(at(d))
    normal = safe_normal(tool, tool%neighbours(edge_of(d, hit%at(d)), hit%face), at)
  end function normal_across

  !> Unit normal, taken a little inside the face where an edge has shrunk to a point.
  pure function safe_normal(tool, face, at) result(normal)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)
    real(wp), parameter :: inside = 1.0e-5_wp, origin(3) = 0.0_wp
    real(wp) :: normal(3)
    type(separation_t) :: here

    here = seen_from(tool, face, at, origin)
    normal = unit_normal(here%d1)
    if (norm2(normal) > 0.5_wp) return
    here = seen_from(tool, face, at + inside*(0.5_wp - at), origin)
    normal = unit_normal(here%d1)
  end function safe_normal

end module closest_point
