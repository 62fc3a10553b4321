!> Which edges of surfaces coincide, and surfaces reversed so that their normals agree.
!!
!! Edges go by xi_min, xi_max, eta_min, eta_max, 1 to 4; those of a trimmed surface are the curves
!! of its loops, from 5 on. Two surfaces agree where they run along
!! their common edge in opposite directions, each with itself on the left; that holds for sharp
!! edges as well as for smooth ones.
module surface_seams
  use kinds, only: wp
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use refinement, only: reverse_axis
  use surface_grid, only: lines
  use trim_curve, only: trim_curve_t, evaluate_curve, curve_point
  implicit none
  private

  public :: surface_seams_t, find_surface_seams, orient_surfaces

  !> An edge that lies on another one, as a whole or in part.
  type :: seam_t
    integer :: surface(2) = 0        !! whose edges these are, first one that lies on the other
    integer :: edge(2) = 0
    logical :: is_opposite = .true.  !! the two run in opposite directions, as they should
    logical :: is_whole = .true.     !! each lies on the other
    real(wp) :: gap = 0.0_wp         !! largest distance at the points compared [length]
  end type seam_t

  !> What was found.
  type :: surface_seams_t
    type(seam_t), allocatable :: seams(:)
    integer :: n_free = 0                        !! edges with extent that lie on no other
    integer, allocatable :: group(:)             !! of surfaces that seams lead to, from 1 on
    logical, allocatable :: is_reversed(:)         !! by `orient_surfaces`
    logical :: is_one_sided = .false.            !! no orientation of them makes all agree
  end type surface_seams_t

  integer, parameter :: n_compared = 9         ! points of an edge, ends included
  real(wp), parameter :: shortest = 1.0e-6_wp  ! common part, of an edge
  integer, parameter :: n_steps = 4            ! chords per span of the edge's polygon

  !> An edge, from end to end as its surface keeps it on the left.
  type :: edge_t
    integer :: surface = 0, number = 0
    logical :: is_collapsed = .false., is_closed = .false.
    real(wp) :: low(3) = 0.0_wp, high(3) = 0.0_wp   ! box around it
    real(wp), allocatable :: at(:)                  ! parameter at the corners of its polygon
    real(wp), allocatable :: corners(:, :)          ! shape (3, size(at))
    type(trim_curve_t) :: curve                     ! of a trimmed surface
    real(wp) :: chord = 0.0_wp                      ! longest one of the polygon
  end type edge_t

contains

  !> Compare all edges. Edges shorter than the tolerance have no direction and are left out.
  subroutine find_surface_seams(surfaces, tolerance, found)
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    real(wp), intent(in) :: tolerance        !! [length]
    type(surface_seams_t), intent(out) :: found
    type(edge_t), allocatable :: edges(:)
    logical, allocatable :: is_free(:)
    type(seam_t) :: seam
    integer :: i, j
    logical :: lies(2)

    allocate (found%seams(0))
    call list_edges(surfaces, tolerance, edges)
    is_free = .not. edges%is_collapsed
    do i = 1, size(edges)
      do j = i + 1, size(edges)
        if (edges(i)%is_collapsed .or. edges(j)%is_collapsed) cycle
        if (any(edges(i)%low > edges(j)%high + tolerance) .or. &
            any(edges(j)%low > edges(i)%high + tolerance)) cycle
        call compare(surfaces, edges(i), edges(j), tolerance, seam, lies)
        if (seam%surface(1) == 0) cycle
        if (lies(1)) is_free(i) = .false.
        if (lies(2)) is_free(j) = .false.
        found%seams = [found%seams, seam]
      end do
    end do
    found%n_free = count(is_free)
    allocate (found%is_reversed(size(surfaces)), found%group(size(surfaces)))
    found%is_reversed = .false.
    call find_groups(found)
  end subroutine find_surface_seams

  !> Edges of all surfaces.
  subroutine list_edges(surfaces, tolerance, edges)
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    real(wp), intent(in) :: tolerance
    type(edge_t), allocatable, intent(out) :: edges(:)
    integer :: i, j, k, n, pass, number

    do pass = 1, 2    ! count, then take
      n = 0
      do i = 1, size(surfaces)
        if (.not. allocated(surfaces(i)%loops)) then
          do k = 1, 4
            n = n + 1
            if (pass == 2) edges(n) = new_edge(surfaces(i), i, k, tolerance)
          end do
          cycle
        end if
        number = 4
        do j = 1, size(surfaces(i)%loops)
          do k = 1, size(surfaces(i)%loops(j)%curves)
            n = n + 1
            number = number + 1
            if (pass == 2) edges(n) = new_edge(surfaces(i), i, number, tolerance, &
                                               surfaces(i)%loops(j)%curves(k))
          end do
        end do
      end do
      if (pass == 1) allocate (edges(n))
    end do
  end subroutine list_edges

  !> Reverse the first axis of surfaces whose normals disagree with those of the first surface of
  !! their group.
  subroutine orient_surfaces(found, surfaces)
    type(surface_seams_t), intent(in) :: found
    type(nurbs_surface_t), intent(inout) :: surfaces(:)
    integer :: i

    do i = 1, size(surfaces)
      if (found%is_reversed(i)) call reverse_axis(surfaces(i), 1)
    end do
  end subroutine orient_surfaces

  !> Spread from the first surface of each group along the seams: first of edges that lie on each
  !! other as a whole, then of the others. Small edges and edges beside a corner may lie on more
  !! than their own neighbour in part, so where a seam of two parts disagrees, it does not count.
  pure subroutine find_groups(found)
    type(surface_seams_t), intent(inout) :: found
    integer :: i, k, n_groups
    logical :: goes_on

    found%group = 0
    n_groups = 0
    do i = 1, size(found%group)
      if (found%group(i) > 0) cycle
      n_groups = n_groups + 1
      found%group(i) = n_groups
      goes_on = .true.
      do while (goes_on)
        goes_on = .false.
        do k = 1, size(found%seams)
          if (found%seams(k)%is_whole) call spread_over(found%seams(k), found, goes_on)
        end do
        do k = 1, size(found%seams)
          if (goes_on) exit
          if (.not. found%seams(k)%is_whole) call spread_over(found%seams(k), found, goes_on)
        end do
      end do
    end do
    do k = 1, size(found%seams)
      associate (seam => found%seams(k), turned => found%is_reversed(found%seams(k)%surface))
        if (seam%is_whole .and. (seam%is_opposite .neqv. (turned(1) .eqv. turned(2)))) &
          found%is_one_sided = .true.
      end associate
    end do
  end subroutine find_groups

  pure subroutine spread_over(seam, found, goes_on)
    type(seam_t), intent(in) :: seam
    type(surface_seams_t), intent(inout) :: found
    logical, intent(inout) :: goes_on
    integer :: from, to

    associate (groups => found%group(seam%surface))
      if ((groups(1) > 0) .eqv. (groups(2) > 0)) return
      from = merge(1, 2, groups(1) > 0)
    end associate
    to = seam%surface(3 - from)
    from = seam%surface(from)
    found%group(to) = found%group(from)
    found%is_reversed(to) = found%is_reversed(from) .neqv. .not. seam%is_opposite
    goes_on = .true.
  end subroutine spread_over

  !> Does each of two edges lie on the other, and in which direction?
  subroutine compare(surfaces, a, b, tolerance, seam, lies)
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    type(edge_t), intent(in) :: a, b
    real(wp), intent(in) :: tolerance
    type(seam_t), intent(out) :: seam
    logical, intent(out) :: lies(2)
    real(wp), parameter :: whole(2) = [0.0_wp, 1.0_wp]
    real(wp) :: gaps(2), part(2)
    logical :: runs_along(2), is_on

    call lay_on(surfaces, a, b, whole, tolerance, lies(1), gaps(1), runs_along(1))
    call lay_on(surfaces, b, a, whole, tolerance, lies(2), gaps(2), runs_along(2))
    if (lies(1)) then
      seam = seam_t([a%surface, b%surface], [a%number, b%number], .not. runs_along(1), all(lies), &
                    maxval(gaps, mask=lies))
    else if (lies(2)) then
      seam = seam_t([b%surface, a%surface], [b%number, a%number], .not. runs_along(2), .false., &
                    gaps(2))
    else
      part = common_part(surfaces, a, b, tolerance)
      ! Edges in one line may overlap by the round-off of their ends.
      if (part(2) - part(1) < max(shortest, tolerance/length_of(a))) return
      call lay_on(surfaces, a, b, part, tolerance, is_on, gaps(1), runs_along(1))
      if (is_on) seam = seam_t([a%surface, b%surface], [a%number, b%number], &
                               .not. runs_along(1), .false., gaps(1))
    end if
  end subroutine compare

  pure real(wp) function length_of(edge)
    type(edge_t), intent(in) :: edge

    associate (x => edge%corners)
      length_of = sum(norm2(x(:, 2:) - x(:, :size(x, 2) - 1), 1))
    end associate
  end function length_of

  !> From where to where edge `a` lies on edge `b`, parts of its length: the ends of either on the
  !! other tell.
  function common_part(surfaces, a, b, tolerance) result(part)
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    type(edge_t), intent(in) :: a, b
    real(wp), intent(in) :: tolerance
    real(wp) :: part(2)
    real(wp) :: at, distance
    integer :: i

    part = [1.0_wp, 0.0_wp]
    do i = 0, 1
      call project(surfaces(b%surface), b, a%corners(:, 1 + i*(size(a%at) - 1)), at, distance)
      if (distance <= tolerance) part = [min(part(1), real(i, wp)), max(part(2), real(i, wp))]
      call project(surfaces(a%surface), a, b%corners(:, 1 + i*(size(b%at) - 1)), at, distance)
      if (distance > tolerance) cycle
      at = (at - a%at(1))/(a%at(size(a%at)) - a%at(1))
      part = [min(part(1), at), max(part(2), at)]
    end do
  end function common_part

  !> Project points of a part of edge `a` onto edge `b`.
  subroutine lay_on(surfaces, a, b, part, tolerance, lies, gap, runs_along)
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    type(edge_t), intent(in) :: a, b
    real(wp), intent(in) :: part(2)         !! from 0 to 1
    real(wp), intent(in) :: tolerance
    logical, intent(out) :: lies
    real(wp), intent(out) :: gap
    logical, intent(out) :: runs_along      !! in the same direction
    real(wp) :: fraction, point(3), tangent(3), position(n_compared), distance, step, range
    integer :: i, n_forward

    lies = .false.
    gap = 0.0_wp
    runs_along = .false.
    range = b%at(size(b%at)) - b%at(1)
    do i = 1, n_compared
      fraction = part(1) + (part(2) - part(1))*(i - 1)/(n_compared - 1)
      call evaluate_edge(surfaces(a%surface), a, &
                         (1 - fraction)*a%at(1) + fraction*a%at(size(a%at)), point, tangent)
      call project(surfaces(b%surface), b, point, position(i), distance)
      if (.not. distance <= tolerance) return
      gap = max(gap, distance)
    end do
    n_forward = 0
    do i = 2, n_compared
      step = (position(i) - position(i - 1))/range
      if (b%is_closed) step = step - anint(step)   ! the shorter way
      n_forward = n_forward + nint(sign(1.0_wp, step))
    end do
    runs_along = n_forward > 0
    lies = n_forward /= 0
  end subroutine lay_on

  !> Nearest position on an edge: the nearest corner of its polygon, then Newton between the corners
  !! next to it, safeguarded by halving.
  subroutine project(surface, edge, point, at, distance)
    type(nurbs_surface_t), intent(in) :: surface
    type(edge_t), intent(in) :: edge
    real(wp), intent(in) :: point(3)
    real(wp), intent(out) :: at, distance
    real(wp) :: low, high, here(3), tangent(3), slope, before
    integer :: nearest, i
    integer, parameter :: most = 60

    nearest = minloc(sum((edge%corners - spread(point, 2, size(edge%at)))**2, 1), 1)
    at = edge%at(nearest)
    distance = norm2(edge%corners(:, nearest) - point)
    ! Between its corners the edge is nearer to one of them than a chord.
    if (edge%number > 4 .and. distance > 2*edge%chord) return
    associate (ends => [edge%at(max(1, nearest - 1)), edge%at(min(size(edge%at), nearest + 1))])
      low = minval(ends)
      high = maxval(ends)
    end associate
    do i = 1, most
      call evaluate_edge(surface, edge, at, here, tangent)
      slope = dot_product(here - point, tangent)
      if (slope > 0.0_wp) high = at
      if (slope < 0.0_wp) low = at
      before = at
      if (dot_product(tangent, tangent) > 0.0_wp) at = at - slope/dot_product(tangent, tangent)
      if (.not. (at > low .and. at < high)) at = 0.5_wp*(low + high)
      if (abs(at - before) <= epsilon(at)*max(abs(low), abs(high))) exit
    end do
    call evaluate_edge(surface, edge, at, here, tangent)
    distance = norm2(here - point)
    do i = 1, size(edge%at), size(edge%at) - 1   ! ends count in full
      if (norm2(edge%corners(:, i) - point) >= distance) cycle
      distance = norm2(edge%corners(:, i) - point)
      at = edge%at(i)
    end do
  end subroutine project

  !> An edge with its polygon, box and kind.
  function new_edge(surface, number_of_surface, number, tolerance, curve) result(edge)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: number_of_surface, number
    real(wp), intent(in) :: tolerance
    type(trim_curve_t), intent(in), optional :: curve   !! where the number is above 4
    type(edge_t) :: edge
    real(wp) :: tangent(3)
    integer :: i

    edge%surface = number_of_surface
    edge%number = number
    if (present(curve)) then
      edge%curve = curve
      edge%at = steps_along(surface, curve)
    else
      edge%at = lines(surface%axes(merge(2, 1, number <= 2)), n_steps)
    end if
    ! Kept on the left: xi_min and eta_max run downwards.
    allocate (edge%corners(3, size(edge%at)))
    do i = 1, size(edge%at)
      call evaluate_edge(surface, edge, edge%at(i), edge%corners(:, i), tangent)
    end do
    edge%chord = sqrt(maxval(sum((edge%corners(:, 2:) &
                                  - edge%corners(:, :size(edge%at) - 1))**2, 1)))
    edge%low = minval(edge%corners, 2)
    edge%high = maxval(edge%corners, 2)
    edge%is_collapsed = norm2(edge%high - edge%low) <= tolerance
    edge%is_closed = norm2(edge%corners(:, 1) - edge%corners(:, size(edge%at))) <= tolerance
    if (any(number == [1, 4])) then
      edge%at = edge%at(size(edge%at):1:-1)
      edge%corners = edge%corners(:, size(edge%at):1:-1)
    end if
  end function new_edge

  !> Parameters of the corners of a curve's polygon: as many as the spans that it passes ask for.
  pure function steps_along(surface, curve) result(at)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_curve_t), intent(in) :: curve
    real(wp), allocatable :: at(:)
    real(wp) :: ends(2, 2)
    integer :: d, i, n

    ends(:, 1) = curve_point(curve, 0.0_wp)
    ends(:, 2) = curve_point(curve, 1.0_wp)
    n = curve%degree
    do d = 1, 2
      associate (knots => surface%axes(d)%knots)
        n = n + count(knots > minval(ends(d, :)) .and. knots < maxval(ends(d, :)))
      end associate
    end do
    n = n_steps*n
    at = [(real(i, wp)/n, i=0, n)]
  end function steps_along

  !> Point and tangent of an edge, towards higher parameters.
  pure subroutine evaluate_edge(surface, edge, at, point, tangent)
    type(nurbs_surface_t), intent(in) :: surface
    type(edge_t), intent(in) :: edge
    real(wp), intent(in) :: at
    real(wp), intent(out) :: point(3), tangent(3)
    real(wp) :: d1(3, 2), xi(2), slope(2), bend(2)
    integer :: across

    if (edge%number > 4) then
      call evaluate_curve(edge%curve, at, xi, slope, bend)
      call evaluate_surface(surface, xi, point, d1)
      tangent = matmul(d1, slope)
      return
    end if
    across = merge(1, 2, edge%number <= 2)
    associate (knots => surface%axes(across)%knots)
      xi(across) = merge(knots(1), knots(size(knots)), mod(edge%number, 2) == 1)
    end associate
    xi(3 - across) = at
    call evaluate_surface(surface, xi, point, d1)
    tangent = d1(:, 3 - across)
  end subroutine evaluate_edge

end module surface_seams
