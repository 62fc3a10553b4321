!> Closest points of a tool: Newton on the tangency conditions.
!!
!! [CA] R. P. R. Cardoso and O. B. Adetoro (2017), eqs. (48)-(55). For one point the search is
!! safeguarded: knot lines where the tangent breaks, edges and corners are normal cases. It stays on
!! a face, crosses to the neighbour where the distance decreases in that direction, and stops on the
!! knot line where it does not.
!!
!! Eight secondary points at a time are followed without safeguards, each from where it was and
!! on that face: lanes that leave their face or do not converge are reported, and the caller
!! searches them one by one. Point and normal after the last Newton step come from the second
!! derivatives at hand instead of one more evaluation: over a step that turns the normal by the
!! angle a the gap is off by about a^2/6 of the step.
module closest_point
  use kinds, only: wp
  use tool, only: tool_t
  use tool_face, only: separation_t, separation, face_position, safe_normal
  use tool_seams, only: move_across
  use tool_cells, only: cell_t
  use edge_contact, only: is_on_tool, room_on_tool, edge_gap
  implicit none
  private

  public :: hit_t, follow, descend, finish, is_beside, lanes_t, follow_lanes

  integer, parameter :: max_iterations = 200   !! Newton steps before a start is given up
  integer, parameter :: max_halvings = 30     !! of one step
  real(wp), parameter :: step_tolerance = 1.0e-12_wp      !! last step, part of the tool's scale
  real(wp), parameter :: stalled_step = 1.0e-5_wp         !! the same where round-off stops it
  real(wp), parameter :: step_out = 1.0e-6_wp             !! of a cell, the same: a minimum inside
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
    real(wp) :: overhang = 0.0_wp        !! how far the point is beyond the tool's edge [length]
    real(wp) :: rival = huge(1.0_wp)     !! distance to the next best point, if searched for
    integer :: edge = 0                  !! piece of a trimmed tool's edge that it lies on, 0: none
    real(wp) :: along = 0.0_wp           !! coordinate on that piece
    integer :: n_iterations = 0          !! evaluations of the face in all starts
    logical :: is_converged = .false.
    logical :: is_leaving = .false.      !! stopped at the edge of its cell: no closest point
  end type hit_t

  integer, parameter, public :: n_lanes = 8        !! points worked on together
  integer, parameter :: max_evaluations = 4        !! of the faces before the rest is given up
  real(wp), parameter :: last_step = 1.0e-4_wp     !! longest last step, of the tool's scale
  real(wp), parameter :: last_turn = 3.0e-4_wp     !! most that the last step turns the normal [rad]
  real(wp), parameter :: edge_tolerance = 1.0e-12_wp   !! local coordinates taken for the edge

  !> Eight points, where they were on the tool and where they are now.
  type :: lanes_t
    integer :: face(n_lanes)                 !! face of each point, all positive
    real(wp) :: x(n_lanes, 3)                !! points in the tool's frame [length]
    real(wp) :: s(n_lanes), t(n_lanes)       !! local coordinates: before, then now
    real(wp) :: room(n_lanes)                !! how far these may change within the trim of the
                                             !! face, at least: likewise; of trimmed tools alone
    real(wp) :: gap(n_lanes)                 !! signed, on the sheet's side positive [length]
    real(wp) :: normal(n_lanes, 3)           !! unit, towards the sheet's side
    logical :: is_good(n_lanes)              !! settled inside the face
    integer :: n_iterations                  !! evaluations of the faces
  end type lanes_t

  !> Homogeneous point and derivatives (w x, w y, w z, w) of eight faces.
  type :: jet_t
    real(wp), dimension(n_lanes, 4) :: h, h_s, h_t, h_ss, h_tt, h_st
  end type jet_t

  !> State of the iteration, one value a lane.
  type :: newton_t
    real(wp), dimension(n_lanes) :: step_s, step_t   !! of the local coordinates
    real(wp), dimension(n_lanes) :: square           !! of the step [length^2]
    real(wp), dimension(n_lanes) :: turn             !! square of the sine of the normal's turn
    real(wp), dimension(n_lanes) :: k_ss, determinant   !! of the Hessian: positive at a minimum
    real(wp), dimension(n_lanes, 3) :: normal        !! S,s x S,t after the step
    real(wp), dimension(n_lanes) :: along            !! r . normal after the step
  end type newton_t

contains

  !> Whether a point is beyond the tool's edge by more than is allowed, so that it does not touch.
  pure logical function is_beside(tool, hit, allowed)
    type(tool_t), intent(in) :: tool
    type(hit_t), intent(in) :: hit
    real(wp), intent(in) :: allowed   !! [length]

    is_beside = hit%overhang > allowed + border_slack*tool%scale
  end function is_beside

  !> Closest point from a position on a face nearby, across knot lines where need be. For a point
  !! that moved a little since that position was its closest. Beyond the trim of a surface it is not
  !! converged.
  pure subroutine follow(tool, x, face, at, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)    !! point in the tool's frame [length]
    integer, intent(in) :: face     !! where to start
    real(wp), intent(in) :: at(2)   !! local coordinates to start from
    type(hit_t), intent(out) :: hit

    hit%face = face
    hit%at = min(max(at, 0.0_wp), 1.0_wp)
    call descend(tool, x, hit)
    if (tool%is_trimmed) hit%is_converged = hit%is_converged &
                                            .and. is_on_tool(tool, hit%face, hit%at)
    call finish(tool, x, hit)
  end subroutine follow

  !> Newton with the full second derivatives, eq. (52), from a start on a face, always downhill.
  !! Where the Hessian is not positive enough of the metric is added. With a cell the search holds
  !! at the cell's edge.
  pure subroutine descend(tool, x, hit, cell)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t), intent(inout) :: hit
    type(cell_t), intent(in), optional :: cell
    type(separation_t) :: here
    logical :: is_free(2), is_lower
    real(wp) :: step(2), gain

    hit%n_iterations = 1
    hit%is_converged = .false.
    hit%is_leaving = .false.
    here = separation(tool%coefficients, hit%face, hit%at, x)
    do while (hit%n_iterations < max_iterations)
      call cross_edges(tool, x, hit, here, is_free, cell)
      call newton_step(here, hit%at, is_free, step, gain)
      hit%is_converged = gain <= (step_tolerance*tool%scale)**2
      if (hit%is_converged) exit
      call step_down(tool, x, step, hit, here, is_lower)
      ! Nothing lower nearby: the position is as good as round-off lets it be, if the step was
      ! short.
      hit%is_converged = gain <= (stalled_step*tool%scale)**2
      if (.not. is_lower) exit
    end do
    hit%distance = sqrt(here%square)
    if (hit%is_converged) hit%is_converged = is_minimum(here, is_free)
    if (present(cell)) hit%is_leaving = leads_out(tool, x, hit, here, cell)
  end subroutine descend

  !> At an edge that the distance falls across: go to the neighbour, or hold the coordinate fixed
  !! where there is none, where the distance rises again beyond a break of the tangent, or where the
  !! cell ends.
  pure subroutine cross_edges(tool, x, hit, here, is_free, cell)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t), intent(inout) :: hit
    type(separation_t), intent(inout) :: here
    logical, intent(out) :: is_free(2)   !! coordinates left to move
    type(cell_t), intent(in), optional :: cell
    integer, parameter :: most_crossings = 4   ! around a corner
    type(separation_t) :: there
    real(wp) :: at(2)
    integer :: n, d, face, d_there
    logical :: has_crossed

    do n = 1, most_crossings
      is_free = .true.
      has_crossed = .false.
      do d = 1, 2
        if (has_crossed .or. .not. is_blocked(hit%at(d), here%slope(d))) cycle
        is_free(d) = .false.
        call point_across(tool, hit%face, hit%at, d, face, at, d_there)
        if (face == 0) cycle
        if (present(cell)) then
          if (.not. is_in_block(cell, face)) cycle
        end if
        there = separation(tool%coefficients, face, at, x)
        hit%n_iterations = hit%n_iterations + 1
        if (is_blocked(at(d_there), there%slope(d_there))) cycle
        hit%face = face
        hit%at = at
        here = there
        is_free(d) = .true.
        has_crossed = .true.
      end do
      if (.not. has_crossed) return
    end do
    is_free = .true.
  end subroutine cross_edges

  !> Whether the distance falls further beyond the edge of a cell at which the search stopped.
  pure logical function leads_out(tool, x, hit, here, cell)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t), intent(in) :: hit
    type(separation_t), intent(in) :: here
    type(cell_t), intent(in) :: cell
    type(separation_t) :: there
    real(wp) :: at(2)
    integer :: d, face, d_there

    leads_out = .false.
    do d = 1, 2
      if (.not. is_blocked(hit%at(d), here%slope(d))) cycle
      if (here%slope(d)**2 <= here%metric(d)*(step_out*tool%scale)**2) cycle
      call point_across(tool, hit%face, hit%at, d, face, at, d_there)
      if (face == 0) cycle
      if (is_in_block(cell, face)) cycle
      there = separation(tool%coefficients, face, at, x)
      leads_out = leads_out .or. .not. is_blocked(at(d_there), there%slope(d_there))
    end do
  end function leads_out

  !> Whether a face is one of a block.
  pure logical function is_in_block(cell, face)
    type(cell_t), intent(in) :: cell
    integer, intent(in) :: face
    integer :: offset

    is_in_block = face == cell%face
    if (cell%stride == 0) return
    offset = face - cell%face
    is_in_block = offset >= 0 .and. offset/cell%stride < cell%n(2) &
                  .and. modulo(offset, cell%stride) < cell%n(1)
  end function is_in_block

  !> The same position on the face beyond the edge where coordinate `d` has come to its end.
  pure subroutine point_across(tool, face, at, d, other, there, d_there)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face, d
    real(wp), intent(in) :: at(2)
    integer, intent(out) :: other          !! 0: none
    real(wp), intent(out) :: there(2)
    integer, intent(out) :: d_there        !! coordinate that is at its end there

    other = tool%neighbours(2*d - 1 + nint(at(d)), face)
    if (other < 0) then
      call move_across(tool%coefficients, tool%links, -other, at(3 - d), &
                       face_position(tool%coefficients, face, at), other, there, d_there)
      return
    end if
    there = at
    there(d) = 1.0_wp - anint(at(d))
    d_there = d
  end subroutine point_across

  !> Whether a coordinate is at its end and the distance falls beyond.
  pure logical function is_blocked(at, slope)
    real(wp), intent(in) :: at, slope

    is_blocked = (at <= 0.0_wp .and. slope < 0.0_wp) .or. (at >= 1.0_wp .and. slope > 0.0_wp)
  end function is_blocked

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
      there = separation(tool%coefficients, hit%face, at, x)
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

  !> Gap, normal and overhang at the position found.
  !!
  !! Inside a face, and on a smooth knot line, the point lies along the normal. On a break of the
  !! tangent it lies between the normals of the faces that meet: there the gap is the signed
  !! distance and the normal its gradient, the same from whichever face the search came. Beyond the
  !! edge the part that sticks out is kept apart as `overhang`.
  pure subroutine finish(tool, x, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t), intent(inout) :: hit
    type(separation_t) :: here
    real(wp) :: normal(3), mean(3), r(3), outward(3), at(2)
    logical :: has_break
    integer :: d, face, d_there

    here = separation(tool%coefficients, hit%face, hit%at, x)
    hit%distance = sqrt(here%square)
    if (hit%edge > 0) then
      call edge_gap(tool, hit%edge, hit%along, x, hit%gap, hit%normal, hit%overhang)
      return
    end if
    normal = safe_normal(tool%coefficients, hit%face, hit%at)
    mean = normal
    r = here%r
    has_break = .false.
    do d = 1, 2
      if (.not. is_blocked(hit%at(d), here%slope(d))) cycle
      call point_across(tool, hit%face, hit%at, d, face, at, d_there)
      if (face == 0) then
        associate (a => here%d1(:, d), b => here%d1(:, 3 - d))
          outward = a - b*dot_product(a, b)/max(dot_product(b, b), tiny(1.0_wp))
        end associate
        outward = outward/max(norm2(outward), tiny(1.0_wp))*sign(1.0_wp, hit%at(d) - 0.5_wp)
        hit%overhang = hypot(hit%overhang, max(dot_product(r, outward), 0.0_wp))
        r = r - max(dot_product(r, outward), 0.0_wp)*outward
      else
        has_break = has_break .or. abs(here%slope(d)) > sqrt(here%metric(d)) &
          *max(along_normal*hit%distance, step_tolerance*tool%scale)
        mean = mean + safe_normal(tool%coefficients, face, at)
      end if
    end do
    hit%gap = tool%side*dot_product(r, normal)
    hit%normal = tool%side*normal
    if (has_break .and. norm2(r) > 0.0_wp) then
      hit%gap = sign(norm2(r), tool%side*dot_product(r, mean))
      hit%normal = r/hit%gap
    end if
  end subroutine finish

  !> Follow eight points from where they were. `face`, `x`, `s` and `t` in, the rest out.
  pure subroutine follow_lanes(tool, lanes)
    type(tool_t), intent(in) :: tool
    type(lanes_t), intent(inout) :: lanes
    real(wp) :: c(n_lanes, 4, tool%orders(1), tool%orders(2))
    type(jet_t) :: jet
    type(newton_t) :: newton
    integer :: iteration, lane, n1, n2
    real(wp) :: limit, length, before(n_lanes, 2)

    before(:, 1) = lanes%s
    before(:, 2) = lanes%t
    n1 = tool%orders(1)
    n2 = tool%orders(2)
    call gather_faces(n1, n2, tool%n_faces, tool%coefficients, lanes%face, c)
    limit = (last_step*tool%scale)**2
    do iteration = 1, max_evaluations
      if (n1 == 3 .and. n2 == 3) then
        call evaluate_quadratic(c, lanes%s, lanes%t, jet)
      else
        call evaluate_general(n1, n2, c, lanes%s, lanes%t, jet)
      end if
      call newton_steps(jet, lanes%x, newton)
      lanes%s = lanes%s + newton%step_s
      lanes%t = lanes%t + newton%step_t
      lanes%is_good = newton%square <= limit .and. newton%turn <= last_turn**2
      if (all(lanes%is_good)) exit
    end do
    lanes%n_iterations = min(iteration, max_evaluations)
    lanes%is_good = lanes%is_good .and. newton%k_ss > 0.0_wp .and. newton%determinant > 0.0_wp &
      .and. abs(lanes%s - 0.5_wp) <= 0.5_wp + edge_tolerance &
      .and. abs(lanes%t - 0.5_wp) <= 0.5_wp + edge_tolerance
    if (tool%is_trimmed) call leave_trims(tool, before, lanes)
    !$omp simd private(length)
    do lane = 1, n_lanes
      length = tool%side*sqrt(newton%normal(lane, 1)**2 + newton%normal(lane, 2)**2 &
                              + newton%normal(lane, 3)**2)
      lanes%normal(lane, 1) = newton%normal(lane, 1)/length
      lanes%normal(lane, 2) = newton%normal(lane, 2)/length
      lanes%normal(lane, 3) = newton%normal(lane, 3)/length
      lanes%gap(lane) = newton%along(lane)/length
    end do
  end subroutine follow_lanes

  !> Points that have left the trim of their surface are not settled. It is asked again where they
  !! have used up the room that they had.
  pure subroutine leave_trims(tool, before, lanes)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: before(n_lanes, 2)     !! local coordinates
    type(lanes_t), intent(inout) :: lanes
    real(wp) :: at(2)
    integer :: lane

    do lane = 1, n_lanes
      if (.not. lanes%is_good(lane) .or. .not. tool%is_cut(lanes%face(lane))) cycle
      at = [lanes%s(lane), lanes%t(lane)]
      lanes%room(lane) = lanes%room(lane) - maxval(abs(at - before(lane, :)))
      if (lanes%room(lane) > 0.0_wp) cycle
      lanes%is_good(lane) = is_on_tool(tool, lanes%face(lane), at)
      if (lanes%is_good(lane)) lanes%room(lane) = room_on_tool(tool, lanes%face(lane), at)
    end do
  end subroutine leave_trims

  !> Coefficients of the faces, lanes first. Neighbouring points are mostly on one face.
  pure subroutine gather_faces(n1, n2, n_faces, coefficients, faces, c)
    integer, intent(in) :: n1, n2, n_faces
    real(wp), intent(in) :: coefficients(4*n1*n2, n_faces)
    integer, intent(in) :: faces(n_lanes)
    real(wp), intent(out) :: c(n_lanes, 4*n1*n2)
    integer :: i, lane

    if (all(faces == faces(1))) then
      do i = 1, 4*n1*n2
        c(:, i) = coefficients(i, faces(1))
      end do
    else
      do lane = 1, n_lanes
        c(lane, :) = coefficients(:, faces(lane))
      end do
    end if
  end subroutine gather_faces

  !> Faces of degree 2 x 2 in power form, with all derivatives up to the second.
  pure subroutine evaluate_quadratic(c, s, t, jet)
    real(wp), intent(in) :: c(n_lanes, 4, 3, 3)
    real(wp), intent(in) :: s(n_lanes), t(n_lanes)
    type(jet_t), intent(out) :: jet
    real(wp) :: a1, a2, a3, b1, b2, b3
    integer :: i, l

    do i = 1, 4
      !$omp simd private(a1, a2, a3, b1, b2, b3)
      do l = 1, n_lanes
        a1 = c(l, i, 1, 1) + s(l)*(c(l, i, 2, 1) + s(l)*c(l, i, 3, 1))
        a2 = c(l, i, 1, 2) + s(l)*(c(l, i, 2, 2) + s(l)*c(l, i, 3, 2))
        a3 = c(l, i, 1, 3) + s(l)*(c(l, i, 2, 3) + s(l)*c(l, i, 3, 3))
        b1 = c(l, i, 2, 1) + 2*s(l)*c(l, i, 3, 1)
        b2 = c(l, i, 2, 2) + 2*s(l)*c(l, i, 3, 2)
        b3 = c(l, i, 2, 3) + 2*s(l)*c(l, i, 3, 3)
        jet%h(l, i) = a1 + t(l)*(a2 + t(l)*a3)
        jet%h_t(l, i) = a2 + 2*t(l)*a3
        jet%h_tt(l, i) = 2*a3
        jet%h_s(l, i) = b1 + t(l)*(b2 + t(l)*b3)
        jet%h_st(l, i) = b2 + 2*t(l)*b3
        jet%h_ss(l, i) = 2*(c(l, i, 3, 1) + t(l)*(c(l, i, 3, 2) + t(l)*c(l, i, 3, 3)))
      end do
    end do
  end subroutine evaluate_quadratic

  !> Faces of any degree in power form, with all derivatives up to the second.
  pure subroutine evaluate_general(n1, n2, c, s, t, jet)
    integer, intent(in) :: n1, n2
    real(wp), intent(in) :: c(n_lanes, 4, n1, n2)
    real(wp), intent(in) :: s(n_lanes), t(n_lanes)
    type(jet_t), intent(out) :: jet
    real(wp), dimension(n_lanes) :: line, line_s, half_ss, h, h_s, h_t, h_st, half_hss, half_htt
    integer :: i, a, b

    do i = 1, 4
      h = 0.0_wp
      h_s = 0.0_wp
      h_t = 0.0_wp
      h_st = 0.0_wp
      half_hss = 0.0_wp
      half_htt = 0.0_wp
      do b = n2, 1, -1
        line = 0.0_wp
        line_s = 0.0_wp
        half_ss = 0.0_wp
        do a = n1, 1, -1
          half_ss = half_ss*s + line_s
          line_s = line_s*s + line
          line = line*s + c(:, i, a, b)
        end do
        half_htt = half_htt*t + h_t
        h_t = h_t*t + h
        h = h*t + line
        h_st = h_st*t + h_s
        h_s = h_s*t + line_s
        half_hss = half_hss*t + half_ss
      end do
      jet%h(:, i) = h
      jet%h_s(:, i) = h_s
      jet%h_t(:, i) = h_t
      jet%h_ss(:, i) = 2*half_hss
      jet%h_tt(:, i) = 2*half_htt
      jet%h_st(:, i) = h_st
    end do
  end subroutine evaluate_general

  !> Newton step of every lane, and the normal where it leads. Written out by components: only so
  !! does the compiler keep all of it in vector registers.
  pure subroutine newton_steps(jet, x, newton)
    type(jet_t), intent(in) :: jet
    real(wp), intent(in) :: x(n_lanes, 3)   !! points [length]
    type(newton_t), intent(out) :: newton
    real(wp) :: v, x1, x2, x3, s1, s2, s3, t1, t2, t3, r1, r2, r3, f, g, ds, dt
    real(wp) :: ss1, ss2, ss3, tt1, tt2, tt3, st1, st2, st3, p1, p2, p3, q1, q2, q3
    real(wp) :: n1, n2, n3, m1, m2, m3, k_ss, k_tt, k_st, determinant
    integer :: l

    !$omp simd private(v, x1, x2, x3, s1, s2, s3, t1, t2, t3, r1, r2, r3, f, g, ds, dt, ss1, ss2, &
    !$omp& ss3, tt1, tt2, tt3, st1, st2, st3, p1, p2, p3, q1, q2, q3, n1, n2, n3, m1, m2, m3, &
    !$omp& k_ss, k_tt, k_st, determinant)
    do l = 1, n_lanes
      v = 1.0_wp/jet%h(l, 4)
      x1 = jet%h(l, 1)*v
      x2 = jet%h(l, 2)*v
      x3 = jet%h(l, 3)*v
      s1 = (jet%h_s(l, 1) - x1*jet%h_s(l, 4))*v
      s2 = (jet%h_s(l, 2) - x2*jet%h_s(l, 4))*v
      s3 = (jet%h_s(l, 3) - x3*jet%h_s(l, 4))*v
      t1 = (jet%h_t(l, 1) - x1*jet%h_t(l, 4))*v
      t2 = (jet%h_t(l, 2) - x2*jet%h_t(l, 4))*v
      t3 = (jet%h_t(l, 3) - x3*jet%h_t(l, 4))*v
      ss1 = (jet%h_ss(l, 1) - 2*s1*jet%h_s(l, 4) - x1*jet%h_ss(l, 4))*v
      ss2 = (jet%h_ss(l, 2) - 2*s2*jet%h_s(l, 4) - x2*jet%h_ss(l, 4))*v
      ss3 = (jet%h_ss(l, 3) - 2*s3*jet%h_s(l, 4) - x3*jet%h_ss(l, 4))*v
      tt1 = (jet%h_tt(l, 1) - 2*t1*jet%h_t(l, 4) - x1*jet%h_tt(l, 4))*v
      tt2 = (jet%h_tt(l, 2) - 2*t2*jet%h_t(l, 4) - x2*jet%h_tt(l, 4))*v
      tt3 = (jet%h_tt(l, 3) - 2*t3*jet%h_t(l, 4) - x3*jet%h_tt(l, 4))*v
      st1 = (jet%h_st(l, 1) - s1*jet%h_t(l, 4) - t1*jet%h_s(l, 4) - x1*jet%h_st(l, 4))*v
      st2 = (jet%h_st(l, 2) - s2*jet%h_t(l, 4) - t2*jet%h_s(l, 4) - x2*jet%h_st(l, 4))*v
      st3 = (jet%h_st(l, 3) - s3*jet%h_t(l, 4) - t3*jet%h_s(l, 4) - x3*jet%h_st(l, 4))*v
      r1 = x(l, 1) - x1
      r2 = x(l, 2) - x2
      r3 = x(l, 3) - x3
      f = s1*r1 + s2*r2 + s3*r3
      g = t1*r1 + t2*r2 + t3*r3
      k_ss = s1*s1 + s2*s2 + s3*s3 - (r1*ss1 + r2*ss2 + r3*ss3)
      k_tt = t1*t1 + t2*t2 + t3*t3 - (r1*tt1 + r2*tt2 + r3*tt3)
      k_st = s1*t1 + s2*t2 + s3*t3 - (r1*st1 + r2*st2 + r3*st3)
      determinant = k_ss*k_tt - k_st*k_st
      v = 1.0_wp/determinant
      ds = (k_tt*f - k_st*g)*v
      dt = (k_ss*g - k_st*f)*v
      p1 = s1 + ss1*ds + st1*dt
      p2 = s2 + ss2*ds + st2*dt
      p3 = s3 + ss3*ds + st3*dt
      q1 = t1 + st1*ds + tt1*dt
      q2 = t2 + st2*ds + tt2*dt
      q3 = t3 + st3*ds + tt3*dt
      x1 = 0.5_wp*((s1 + p1)*ds + (t1 + q1)*dt)
      x2 = 0.5_wp*((s2 + p2)*ds + (t2 + q2)*dt)
      x3 = 0.5_wp*((s3 + p3)*ds + (t3 + q3)*dt)
      n1 = s2*t3 - s3*t2
      n2 = s3*t1 - s1*t3
      n3 = s1*t2 - s2*t1
      m1 = p2*q3 - p3*q2
      m2 = p3*q1 - p1*q3
      m3 = p1*q2 - p2*q1
      newton%step_s(l) = ds
      newton%step_t(l) = dt
      newton%square(l) = x1*x1 + x2*x2 + x3*x3
      newton%k_ss(l) = k_ss
      newton%determinant(l) = determinant
      newton%normal(l, 1) = m1
      newton%normal(l, 2) = m2
      newton%normal(l, 3) = m3
      newton%along(l) = m1*(r1 - x1) + m2*(r2 - x2) + m3*(r3 - x3)
      newton%turn(l) = ((n2*m3 - n3*m2)**2 + (n3*m1 - n1*m3)**2 + (n1*m2 - n2*m1)**2) &
                       /((n1*n1 + n2*n2 + n3*n3)*(m1*m1 + m2*m2 + m3*m3))
    end do
  end subroutine newton_steps

end module closest_point
