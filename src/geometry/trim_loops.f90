!> Loops of curves in the parameter plane that become the trim of a surface: closed, checked, run so
!! that what counts is on their left, and the surface cut to the rectangle that they need.
!!
!! What counts lies within an odd number of loops, whatever way these run and in whatever order they
!! are given.
module trim_loops
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text, rounded_text, place_text
  use knot_vector, only: cut_to_range
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use trim_curve, only: trim_curve_t, trim_loop_t, straight_curve, curve_point, part_of_curve, &
                        monotone_ends, reversed_curve, reverse_loop
  implicit none
  private

  public :: trim_surface, rectangle_loop

  integer, parameter :: n_chords = 16           !! per curve, of the polygon that tells the area
  integer, parameter :: most_parts = 64         !! monotone parts of a curve
  real(wp), parameter :: no_area = 1.0e-12_wp   !! of the rectangle of the knots
  real(wp), parameter :: on_border = 1.0e-9_wp  !! of the range, a position on it
  real(wp), parameter :: at_once = 1.0e-12_wp   !! of the range, ends that are one

  !> Parts along which u and v do not turn.
  type :: parts_t
    type(trim_curve_t), allocatable :: curves(:)
    integer, allocatable :: loop(:)             !! number of the loop of each
    real(wp), allocatable :: box(:, :, :)       !! shape (2, 2, n)
  end type parts_t

contains

  !> Give a surface a trim. Gaps between curves are closed by straight pieces.
  !!
  !! Refused: gaps wider than the tolerance, loops beyond the knots by more than that, loops without
  !! area, loops that cross themselves or each other.
  subroutine trim_surface(surface, loops, has_outer, tolerance, error)
    type(nurbs_surface_t), intent(inout) :: surface
    type(trim_loop_t), intent(in) :: loops(:)
    logical, intent(in) :: has_outer       !! else the border of the surface is one, too
    real(wp), intent(in) :: tolerance      !! [length]
    type(error_t), allocatable, intent(out) :: error
    type(trim_loop_t), allocatable :: closed(:)
    real(wp) :: low(2), high(2)
    integer :: i, n

    n = size(loops)
    allocate (closed(n + merge(0, 1, has_outer)))
    if (.not. has_outer) closed(n + 1) = rectangle_loop(surface)
    do i = 1, n
      call close_loop(surface, loops(i), tolerance, closed(i), error)
      if (.not. allocated(error)) call bring_within(surface, tolerance, closed(i), error)
      if (.not. allocated(error)) call check_area(surface, closed(i), error)
      if (allocated(error)) then
        error%message = "loop "//to_text(i)//" "//error%message
        return
      end if
    end do
    call check_crossings(surface, closed, n, error)
    if (allocated(error)) return
    call orient_loops(closed)
    call find_box(closed, low, high)
    call cut_to_box(surface, low, high, error)
    if (allocated(error)) return
    if (is_rectangle(surface, closed)) return
    call move_alloc(closed, surface%loops)
  end subroutine trim_surface

  !> The border of a surface as a loop.
  pure function rectangle_loop(surface) result(loop)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_loop_t) :: loop
    real(wp) :: corners(2, 5)
    integer :: i

    associate (u => surface%axes(1)%knots, v => surface%axes(2)%knots)
      corners(1, :) = [u(1), u(size(u)), u(size(u)), u(1), u(1)]
      corners(2, :) = [v(1), v(1), v(size(v)), v(size(v)), v(1)]
    end associate
    allocate (loop%curves(4))
    do i = 1, 4
      loop%curves(i) = straight_curve(corners(:, i), corners(:, i + 1))
    end do
  end function rectangle_loop

  !> Ranges of the knots: where they begin and how long they are.
  pure subroutine ranges_of(surface, low, length)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(out) :: low(2), length(2)
    integer :: d

    do d = 1, 2
      associate (knots => surface%axes(d)%knots)
        low(d) = knots(1)
        length(d) = knots(size(knots)) - knots(1)
      end associate
    end do
  end subroutine ranges_of

  !> Position on the surface.
  pure function position(surface, at) result(x)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: at(2)
    real(wp) :: x(3), low(2), length(2)

    call ranges_of(surface, low, length)
    call evaluate_surface(surface, min(max(at, low), low + length), x)
  end function position

  !> Curves in their order, those that run the other way turned round, and gaps closed.
  subroutine close_loop(surface, loop, tolerance, closed, error)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_loop_t), intent(in) :: loop
    real(wp), intent(in) :: tolerance
    type(trim_loop_t), intent(out) :: closed
    type(error_t), allocatable, intent(out) :: error
    type(trim_curve_t), allocatable :: list(:)
    real(wp) :: end(2), gap, low(2), length(2), next(2)
    integer :: i, n, m

    m = size(loop%curves)
    if (m == 0) then
      call fail(error, "has no curve")
      return
    end if
    call ranges_of(surface, low, length)
    allocate (list(2*m + 2))
    n = 0
    do i = 1, m
      if (n > 0) then
        if (norm2((end - curve_point(loop%curves(i), 0.0_wp))/length) &
            > norm2((end - curve_point(loop%curves(i), 1.0_wp))/length)) then
          list(n + 1) = reversed_curve(loop%curves(i))
        else
          list(n + 1) = loop%curves(i)
        end if
      else
        list(1) = loop%curves(1)
        if (m > 1) list(1) = first_of(loop%curves(1), loop%curves(2), length)
      end if
      n = n + 1
      next = curve_point(list(n), 0.0_wp)
      if (i > 1) call bridge(next)
      end = curve_point(list(n), 1.0_wp)
      if (allocated(error)) return
    end do
    n = n + 1
    next = curve_point(list(1), 0.0_wp)
    list(n) = straight_curve(end, next)
    call bridge(next)
    if (allocated(error)) return
    closed%curves = list(:n - 1)

  contains

    !> Put a straight piece before the curve `n` that begins at `to`, if there is a gap.
    subroutine bridge(to)
      real(wp), intent(in) :: to(2)

      gap = norm2(position(surface, to) - position(surface, end))
      if (.not. gap <= tolerance) then
        call fail(error, "is open: a gap of "//rounded_text(gap)//" at "// &
                  place_text(position(surface, end)))
        return
      end if
      if (all(abs(to - end) <= at_once*length)) return
      list(n + 1) = list(n)
      list(n) = straight_curve(end, to)
      n = n + 1
    end subroutine bridge

  end subroutine close_loop

  !> The first curve, run so that it ends where the second has an end.
  pure function first_of(first, second, length) result(curve)
    type(trim_curve_t), intent(in) :: first, second
    real(wp), intent(in) :: length(2)
    type(trim_curve_t) :: curve
    real(wp) :: ends(2, 2), distances(2)
    integer :: k

    ends(:, 1) = curve_point(second, 0.0_wp)
    ends(:, 2) = curve_point(second, 1.0_wp)
    do k = 1, 2
      distances(k) = min(norm2((ends(:, 1) - curve_point(first, real(k - 1, wp)))/length), &
                         norm2((ends(:, 2) - curve_point(first, real(k - 1, wp)))/length))
    end do
    curve = first
    if (distances(1) < distances(2)) curve = reversed_curve(first)
  end function first_of

  !> A loop beyond the range of a surface that is closed on itself is moved by whole turns.
  subroutine bring_within(surface, tolerance, loop, error)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: tolerance
    type(trim_loop_t), intent(inout) :: loop
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: corners(:, :)
    real(wp) :: low(2), length(2), box(2, 2), allowed, beyond, turns
    integer :: d, i

    call ranges_of(surface, low, length)
    call find_box([loop], box(:, 1), box(:, 2))
    do d = 1, 2
      allowed = length(d)*max(on_border, min(0.01_wp, tolerance/extent_of(surface)))
      if (min(box(d, 1) - low(d), low(d) + length(d) - box(d, 2)) < -allowed) then
        turns = anint((0.5_wp*(box(d, 1) + box(d, 2)) - low(d))/length(d) - 0.5_wp)
        if (abs(turns) > 0.0_wp .and. is_round(surface, d, tolerance)) then
          do i = 1, size(loop%curves)
            associate (c => loop%curves(i)%c)
              c(d, :) = c(d, :) - turns*length(d)*c(3, :)
            end associate
          end do
          box(d, :) = box(d, :) - turns*length(d)
        end if
      end if
      beyond = max(low(d) - box(d, 1), box(d, 2) - low(d) - length(d))
      if (beyond <= allowed) cycle
      corners = polygon_of(loop)
      i = maxloc(abs(corners(d, :) - low(d) - 0.5_wp*length(d)), 1) + lbound(corners, 2) - 1
      call fail(error, "leaves the range of the surface's parameter "//to_text(d)//" by "// &
                rounded_text(beyond/length(d))//" of it, near "// &
                place_text(position(surface, corners(:, i))))
      return
    end do
  end subroutine bring_within

  !> Whether the edges at both ends of an axis are one.
  pure logical function is_round(surface, d, tolerance)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: d
    real(wp), intent(in) :: tolerance

    associate (x => surface%points, n => size(surface%points, d))
      if (d == 1) then
        is_round = maxval(abs(x(1, :, :) - x(n, :, :))) <= tolerance
      else
        is_round = maxval(abs(x(:, 1, :) - x(:, n, :))) <= tolerance
      end if
    end associate
  end function is_round

  pure real(wp) function extent_of(surface) result(extent)
    type(nurbs_surface_t), intent(in) :: surface
    integer :: c

    extent = maxval([(maxval(surface%points(:, :, c)) - minval(surface%points(:, :, c)), c=1, 3)])
    extent = max(extent, tiny(extent))
  end function extent_of

  !> Corners of the polygon of a loop, closed.
  pure function polygon_of(loop) result(corners)
    type(trim_loop_t), intent(in) :: loop
    real(wp), allocatable :: corners(:, :)
    integer :: i, k

    allocate (corners(2, 0:n_chords*size(loop%curves)))
    do i = 1, size(loop%curves)
      do k = 0, n_chords - 1
        corners(:, n_chords*(i - 1) + k) = curve_point(loop%curves(i), real(k, wp)/n_chords)
      end do
    end do
    corners(:, ubound(corners, 2)) = corners(:, 0)
  end function polygon_of

  !> Area of a polygon, positive where it runs counter-clockwise.
  pure real(wp) function area_of(corners) result(area)
    real(wp), intent(in) :: corners(:, :)
    integer :: i

    area = 0.0_wp
    do i = 2, size(corners, 2) - 1
      area = area + 0.5_wp*((corners(1, i) - corners(1, 1))*(corners(2, i + 1) - corners(2, 1)) &
                            - (corners(2, i) - corners(2, 1))*(corners(1, i + 1) - corners(1, 1)))
    end do
  end function area_of

  subroutine check_area(surface, loop, error)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_loop_t), intent(in) :: loop
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: low(2), length(2)

    call ranges_of(surface, low, length)
    if (abs(area_of(polygon_of(loop))) > no_area*product(length)) return
    call check_crossings(surface, [loop], 1, error)   ! areas may cancel each other
    if (allocated(error)) then
      error%message = error%message(index(error%message, "crosses"):)
      return
    end if
    call fail(error, "has no area, at "// &
              place_text(position(surface, curve_point(loop%curves(1), 0.0_wp))))
  end subroutine check_area

  !> Let all loops run with what counts on their left: the outer ones counter-clockwise, those
  !! within an odd number of others clockwise.
  pure subroutine orient_loops(loops)
    type(trim_loop_t), intent(inout) :: loops(:)
    real(wp), allocatable :: corners(:, :), other(:, :)
    integer :: i, k, m, n_within, n_around

    do i = 1, size(loops)
      corners = polygon_of(loops(i))
      n_around = 0
      do k = 1, size(loops)
        if (k == i) cycle
        other = polygon_of(loops(k))
        ! Loops may touch each other, so most corners decide.
        n_within = count([(is_within(other, corners(:, m)), m=1, size(corners, 2))])
        if (2*n_within > size(corners, 2)) n_around = n_around + 1
      end do
      if ((area_of(corners) > 0.0_wp) .neqv. mod(n_around, 2) == 0) call reverse_loop(loops(i))
    end do
  end subroutine orient_loops

  !> Whether a position is within a polygon.
  pure logical function is_within(corners, x)
    real(wp), intent(in) :: corners(:, :), x(2)
    integer :: i

    is_within = .false.
    do i = 1, size(corners, 2) - 1
      associate (a => corners(:, i), b => corners(:, i + 1))
        if ((a(2) <= x(2)) .eqv. (b(2) <= x(2))) cycle
        if (a(1) + (x(2) - a(2))/(b(2) - a(2))*(b(1) - a(1)) > x(1)) is_within = .not. is_within
      end associate
    end do
  end function is_within

  !> Box around loops.
  pure subroutine find_box(loops, low, high)
    type(trim_loop_t), intent(in) :: loops(:)
    real(wp), intent(out) :: low(2), high(2)
    type(parts_t) :: parts

    parts = parts_of(loops)
    low = minval(parts%box(:, 1, :), 2)
    high = maxval(parts%box(:, 2, :), 2)
  end subroutine find_box

  !> Parts of loops along which u and v do not turn.
  pure function parts_of(loops) result(parts)
    type(trim_loop_t), intent(in) :: loops(:)
    type(parts_t) :: parts
    type(trim_curve_t), allocatable :: list(:)
    real(wp) :: ends(0:most_parts)
    integer, allocatable :: owner(:)
    integer :: i, j, k, n, n_here

    allocate (list(64), owner(64))
    n = 0
    do i = 1, size(loops)
      do j = 1, size(loops(i)%curves)
        call monotone_ends(loops(i)%curves(j), n_here, ends)
        if (n + n_here > size(list)) then
          list = [list, list]
          owner = [owner, owner]
        end if
        owner(n + 1:n + n_here) = i
        do k = 1, n_here
          list(n + k) = part_of_curve(loops(i)%curves(j), ends(k - 1), ends(k))
        end do
        n = n + n_here
      end do
    end do
    parts%curves = list(:n)
    parts%loop = owner(:n)
    allocate (parts%box(2, 2, n))
    do i = 1, n
      parts%box(:, 1, i) = min(curve_point(list(i), 0.0_wp), curve_point(list(i), 1.0_wp))
      parts%box(:, 2, i) = max(curve_point(list(i), 0.0_wp), curve_point(list(i), 1.0_wp))
    end do
  end function parts_of

  !> No two parts of the loops may cross.
  subroutine check_crossings(surface, loops, n_loops, error)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_loop_t), intent(in) :: loops(:)
    integer, intent(in) :: n_loops            !! the one after these is the border of the surface
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: most_checks = 4000
    type(parts_t) :: parts
    character(:), allocatable :: words
    real(wp) :: low(2), length(2), place(2)
    integer :: i, j, n_left
    logical :: is_crossing

    parts = parts_of(loops)
    call ranges_of(surface, low, length)
    do i = 1, size(parts%curves)
      do j = i + 1, size(parts%curves)
        if (any(parts%box(:, 1, i) > parts%box(:, 2, j) .or. &
                parts%box(:, 1, j) > parts%box(:, 2, i))) cycle
        n_left = most_checks
        call find_crossing(parts%curves(i), parts%curves(j), length, n_left, is_crossing, place)
        if (.not. is_crossing) cycle
        associate (one => parts%loop(i), other => parts%loop(j))
          if (one == other) then
            call fail(error, "loop "//to_text(one)//" crosses itself at "// &
                      place_text(position(surface, place)))
          else
            words = "loops "//to_text(one)//" and "//to_text(other)//" cross"
            if (other > n_loops) words = "loop "//to_text(one)//" crosses the border"
            call fail(error, words//" at "//place_text(position(surface, place)))
          end if
        end associate
        return
      end do
    end do
  end subroutine check_crossings

  !> Whether two parts cross; where they only touch, or run along each other, they do not.
  pure recursive subroutine find_crossing(a, b, length, n_left, is_crossing, place)
    type(trim_curve_t), intent(in) :: a, b
    real(wp), intent(in) :: length(2)
    integer, intent(inout) :: n_left          !! checks that may still be done
    logical, intent(out) :: is_crossing
    real(wp), intent(out) :: place(2)
    real(wp), parameter :: shortest = 1.0e-9_wp, flattest = 1.0e-6_wp, round_off = 1.0e-11_wp
    real(wp), dimension(2) :: a1, a2, b1, b2
    real(wp) :: sides(4), bulge_a, bulge_b, apart

    is_crossing = .false.
    place = curve_point(a, 0.5_wp)
    n_left = n_left - 1
    a1 = curve_point(a, 0.0_wp)
    a2 = curve_point(a, 1.0_wp)
    b1 = curve_point(b, 0.0_wp)
    b2 = curve_point(b, 1.0_wp)
    if (n_left < 0 .or. any(min(a1, a2) > max(b1, b2)) .or. any(min(b1, b2) > max(a1, a2))) return
    bulge_a = bulge(a, a1, a2)
    bulge_b = bulge(b, b1, b2)
    sides = [side(a1, a2, b1), side(a1, a2, b2), side(b1, b2, a1), side(b1, b2, a2)]
    apart = flattest*max(norm2(a2 - a1), norm2(b2 - b1)) + round_off*maxval(length)
    is_crossing = sides(1)*sides(2) < 0.0_wp .and. sides(3)*sides(4) < 0.0_wp &
                  .and. minval(abs(sides(:2))) > bulge_a + apart &
                  .and. minval(abs(sides(3:))) > bulge_b + apart
    if (is_crossing) return
    if (bulge_a <= 0.0_wp .and. bulge_b <= 0.0_wp) return
    if (max(maxval(abs(a2 - a1)/length), maxval(abs(b2 - b1)/length)) <= shortest) return
    if (maxval(abs(a2 - a1)/length) >= maxval(abs(b2 - b1)/length)) then
      call find_crossing(part_of_curve(a, 0.0_wp, 0.5_wp), b, length, n_left, is_crossing, place)
      if (.not. is_crossing) call find_crossing(part_of_curve(a, 0.5_wp, 1.0_wp), b, length, &
                                                n_left, is_crossing, place)
    else
      call find_crossing(a, part_of_curve(b, 0.0_wp, 0.5_wp), length, n_left, is_crossing, place)
      if (.not. is_crossing) call find_crossing(a, part_of_curve(b, 0.5_wp, 1.0_wp), length, &
                                                n_left, is_crossing, place)
    end if
  end subroutine find_crossing

  !> Signed distance of a position from the line through two others.
  pure real(wp) function side(from, to, x)
    real(wp), intent(in) :: from(2), to(2), x(2)

    side = ((to(1) - from(1))*(x(2) - from(2)) - (to(2) - from(2))*(x(1) - from(1))) &
           /max(norm2(to - from), tiny(1.0_wp))
  end function side

  !> How far a curve leaves its chord, at most.
  pure real(wp) function bulge(curve, from, to)
    type(trim_curve_t), intent(in) :: curve
    real(wp), intent(in) :: from(2), to(2)
    integer :: i

    bulge = 0.0_wp
    do i = 1, curve%degree - 1
      bulge = max(bulge, abs(side(from, to, curve%c(:2, i)/curve%c(3, i))))
    end do
  end function bulge

  !> Cut a surface to a box in its parameter plane.
  subroutine cut_to_box(surface, low, high, error)
    type(nurbs_surface_t), intent(inout) :: surface
    real(wp), intent(in) :: low(2), high(2)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: columns(:, :), rows(:, :, :), turned(:, :, :), knots(:)
    real(wp) :: first(2), length(2), ends(2)
    integer :: d, degree, n(2)
    logical :: is_same

    call ranges_of(surface, first, length)
    allocate (rows(size(surface%weights, 1), size(surface%weights, 2), 4))
    rows(:, :, 4) = surface%weights
    rows(:, :, :3) = surface%points*spread(surface%weights, 3, 3)
    do d = 1, 2
      n = [size(rows, 1), size(rows, 2)]
      columns = reshape(rows, [n(1), 4*n(2)])
      knots = surface%axes(d)%knots
      ends = [max(low(d), first(d)), min(high(d), first(d) + length(d))]
      if (ends(1) - first(d) <= on_border*length(d)) ends(1) = first(d)
      if (first(d) + length(d) - ends(2) <= on_border*length(d)) ends(2) = knots(size(knots))
      degree = surface%axes(d)%degree
      call cut_to_range(surface%axes(d), degree, knots, ends(1), ends(2), columns, is_same, error)
      if (allocated(error)) return
      n(1) = size(columns, 1)
      rows = reshape(columns, [n(1), n(2), 4])
      turned = reshape(rows, [n(2), n(1), 4], order=[2, 1, 3])
      call move_alloc(turned, rows)
    end do
    if (size(rows, 1) == size(surface%weights, 1) .and. size(rows, 2) == size(surface%weights, 2) &
        .and. all(low - first <= on_border*length .and. &
                  first + length - high <= on_border*length)) return   ! as it was, bit for bit
    surface%weights = rows(:, :, 4)
    surface%points = rows(:, :, :3)/spread(rows(:, :, 4), 3, 3)
  end subroutine cut_to_box

  !> Whether a single loop runs along the border of the surface.
  pure logical function is_rectangle(surface, loops)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_loop_t), intent(in) :: loops(:)
    real(wp) :: low(2), length(2), ends(2, 2)
    integer :: i, d, k

    is_rectangle = size(loops) == 1
    if (.not. is_rectangle) return
    call ranges_of(surface, low, length)
    do i = 1, size(loops(1)%curves)
      associate (curve => loops(1)%curves(i))
        do k = 1, 2
          ends(:, k) = 0.0_wp
          do d = 1, 2
            associate (c => curve%c(:, :curve%degree))
              ends(d, k) = maxval(abs(c(d, :)/c(3, :) - low(d) - (k - 1)*length(d)))/length(d)
            end associate
          end do
        end do
      end associate
      is_rectangle = is_rectangle .and. any(ends <= on_border)
    end do
  end function is_rectangle

end module trim_loops
