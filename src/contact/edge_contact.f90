!> Points near the edges of trimmed tools: which positions of a surface count, whether a position on
!! an edge is the nearest around it, and gap, normal and overhang there.
!!
!! An edge that lies on another one is a place where the tool goes on, be it smoothly or with a
!! break of the tangent; a free one ends it.
module edge_contact
  use kinds, only: wp
  use linear_algebra, only: cross
  use tool, only: tool_t
  use tool_face, only: safe_normal
  use tool_edges, only: evaluate_edge, place_across
  use surface_trim, only: is_inside, clearance
  implicit none
  private

  public :: is_on_tool, room_on_tool, is_lowest, edge_gap

  real(wp), parameter :: along_normal = 1.0e-6_wp      !! sine of an angle taken for zero
  real(wp), parameter :: step_tolerance = 1.0e-12_wp   !! part of the tool's scale
  real(wp), parameter :: inside = 1.0e-9_wp            !! likewise: not lower ground
  real(wp), parameter :: at_end = 1.0e-9_wp            !! of a piece

  !> One side of an edge at a position.
  type :: side_t
    integer :: edge = 0            !! piece, 0: none
    real(wp) :: along = 0.0_wp
    real(wp) :: r(3)               !! from the position to the point [length]
    real(wp) :: tangent(3)         !! unit, along the edge
    real(wp) :: normal(3)          !! unit, xi x eta
    real(wp) :: outward(3)         !! unit, along the surface away from what counts
  end type side_t

contains

  !> Whether a position of a face counts: it is inside the trim, and not on a border of the surface
  !! beyond which there is no face, where the edges decide.
  pure logical function is_on_tool(tool, face, at)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)
    integer :: d

    is_on_tool = .true.
    if (.not. tool%is_trimmed) return
    if (.not. tool%is_cut(face)) return
    do d = 1, 2
      if (at(d) <= 0.0_wp) is_on_tool = is_on_tool .and. tool%neighbours(2*d - 1, face) /= 0
      if (at(d) >= 1.0_wp) is_on_tool = is_on_tool .and. tool%neighbours(2*d, face) /= 0
    end do
    if (.not. is_on_tool) return
    associate (s => tool%surface_of(face))
      is_on_tool = is_inside(tool%trims(s), face - tool%faces_before(s), at)
    end associate
  end function is_on_tool

  !> How far both local coordinates may change, at least, before a position of a cut face that
  !! counts may not count any more.
  pure real(wp) function room_on_tool(tool, face, at) result(room)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)

    room = min(minval(at), minval(1.0_wp - at))
    if (room <= 0.0_wp) return
    associate (s => tool%surface_of(face))
      room = min(room, clearance(tool%trims(s), face - tool%faces_before(s), at))
    end associate
  end function room_on_tool

  !> Directions at a position of a piece.
  pure function side_at(tool, edge, along, x) result(side)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: edge
    real(wp), intent(in) :: along, x(3)
    type(side_t) :: side
    real(wp) :: point(3), second(3), at(2)

    side%edge = edge
    side%along = along
    call evaluate_edge(tool%coefficients, tool%edges(edge), along, point, side%tangent, second, at)
    side%r = x - point
    side%tangent = side%tangent/max(norm2(side%tangent), tiny(1.0_wp))
    side%normal = safe_normal(tool%coefficients, tool%edges(edge)%face, at)
    side%outward = cross(side%tangent, side%normal)
  end function side_at

  !> The side beyond an edge.
  pure function side_across(tool, side, x) result(other)
    type(tool_t), intent(in) :: tool
    type(side_t), intent(in) :: side
    real(wp), intent(in) :: x(3)
    type(side_t) :: other
    integer :: edge
    real(wp) :: along

    call place_across(tool%coefficients, tool%edges, tool%edge_links, side%edge, side%along, edge, &
                      along)
    if (edge > 0) other = side_at(tool, edge, along, x)
  end function side_across

  !> The piece that meets another one at the end where a position is; `other%edge` is 0 inside it.
  pure function side_beyond_end(tool, side, x) result(other)
    type(tool_t), intent(in) :: tool
    type(side_t), intent(in) :: side
    real(wp), intent(in) :: x(3)
    type(side_t) :: other

    if (side%along <= at_end) then
      other = side_at(tool, tool%edges(side%edge)%before, 1.0_wp, x)
    else if (side%along >= 1.0_wp - at_end) then
      other = side_at(tool, tool%edges(side%edge)%next, 0.0_wp, x)
    end if
  end function side_beyond_end

  !> Whether no position around one on an edge is nearer to a point: neither on the surfaces on both
  !! sides of it nor, at a corner, along the edges that meet there.
  pure logical function is_lowest(tool, edge, along, x)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: edge
    real(wp), intent(in) :: along
    real(wp), intent(in) :: x(3)
    type(side_t) :: here, end, across, end_across
    real(wp) :: least
    logical :: is_within

    here = side_at(tool, edge, along, x)
    least = -(along_normal*norm2(here%r) + inside*tool%scale)
    end = side_beyond_end(tool, here, x)
    is_within = dot_product(here%r, here%outward) < least
    if (end%edge > 0) then
      is_within = is_within .and. dot_product(end%r, end%outward) < least
      is_lowest = .not. falls_along(end, least)
      if (.not. is_lowest) return
    end if
    is_lowest = .not. is_within
    if (.not. is_lowest) return
    across = side_across(tool, here, x)
    if (across%edge == 0) return
    least = least - norm2(here%r - across%r)
    end_across = side_beyond_end(tool, across, x)
    is_within = dot_product(across%r, across%outward) < least
    if (end_across%edge > 0) then
      is_within = is_within .and. dot_product(end_across%r, end_across%outward) < least
      is_lowest = .not. falls_along(end_across, least)
    end if
    is_lowest = is_lowest .and. .not. is_within
  end function is_lowest

  !> Whether the distance falls from the end of a piece into it.
  pure logical function falls_along(side, least)
    type(side_t), intent(in) :: side
    real(wp), intent(in) :: least

    falls_along = -dot_product(side%r, side%tangent)*sign(1.0_wp, 0.5_wp - side%along) < least
  end function falls_along

  !> Signed gap, normal and overhang of a point whose nearest position is on an edge. Where the
  !! edge breaks the tangent the gap is the signed distance and the normal its gradient; a distance
  !! along the surface up to the width of the gap between both edges is no break. Beyond a free
  !! edge the part that sticks out is the overhang, at a corner of two all along the surface.
  pure subroutine edge_gap(tool, edge, along, x, gap, normal, overhang)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: edge
    real(wp), intent(in) :: along, x(3)
    real(wp), intent(out) :: gap, normal(3), overhang
    type(side_t) :: sides(2), across(2)
    real(wp) :: r(3), mean(3), beyond, distance
    integer :: k
    logical :: has_break, is_free(2)

    sides(1) = side_at(tool, edge, along, x)
    sides(2) = side_beyond_end(tool, sides(1), x)
    is_free = .false.
    do k = 1, 2
      if (sides(k)%edge == 0) cycle
      across(k) = side_across(tool, sides(k), x)
      is_free(k) = across(k)%edge == 0 .and. .not. tool%edges(sides(k)%edge)%is_short
    end do
    r = sides(1)%r
    distance = norm2(r)
    overhang = 0.0_wp
    if (any(is_free)) then
      associate (side => sides(merge(1, 2, is_free(1))))
        beyond = max(dot_product(r, side%outward), 0.0_wp)
        r = r - beyond*side%outward
        if (all(is_free)) r = dot_product(r, side%normal)*side%normal
      end associate
      overhang = norm2(sides(1)%r - r)
    end if
    mean = sides(1)%normal
    has_break = .false.
    do k = 1, 2
      if (sides(k)%edge == 0 .or. across(k)%edge == 0) cycle
      mean = mean + across(k)%normal
      has_break = has_break .or. abs(dot_product(r, sides(k)%outward)) > &
                  max(along_normal*distance, step_tolerance*tool%scale, &
                      norm2(sides(k)%r - across(k)%r))
    end do
    gap = tool%side*dot_product(r, sides(1)%normal)
    normal = tool%side*sides(1)%normal
    if (has_break .and. norm2(r) > 0.0_wp) then
      gap = sign(norm2(r), tool%side*dot_product(r, mean))
      normal = r/gap
    end if
  end subroutine edge_gap

end module edge_contact
