!> What lies inside closed polygons on a grid of cells: the part of a sheet that an outline keeps
!! and that trimming leaves.
!!
!! Polygons are cut cell by cell (I. E. Sutherland and G. W. Hodgman, Reentrant polygon clipping,
!! Comm. ACM 17 (1974) 32-42), and the area and its moments follow from the corners by Green's
!! theorem, exact to round-off. What several regions have in common is found in quarters of a cell,
!! and quarters of these, until only one border is left.
module outline
  use kinds, only: wp
  implicit none
  private

  public :: new_region, add_polygon, join_regions, cut_cells, is_inside, inside_distance, &
            signed_area, cut_to_box, covers_box, share_along, plane_of, in_space, cells_at, &
            places_inside

  integer, parameter, public :: n_moments = 6     !! of 1, x, y, x^2, x y, y^2

  !> A closed polygon; the last corner is joined to the first.
  type, public :: polygon_t
    real(wp), allocatable :: corners(:, :)        !! shape (2, n)
  end type polygon_t

  !> What lies within an odd number of polygons, or what does not. Holes run clockwise, all others
  !! the other way round.
  type, public :: region_t
    type(polygon_t), allocatable :: polygons(:)
    logical :: is_outside = .false.
    real(wp), allocatable :: boxes(:, :, :)       !! around the polygons, low and high, (2, 2, n);
                                                  !! where there are none searches take longer
  end type region_t

  integer, parameter :: most_halvings = 10        !! of a cell that two borders cross
  real(wp), parameter :: nothing = 1.0e-10_wp     !! of a cell, an area that round-off leaves

contains

  !> The two coordinates across an axis of space, in cyclic order.
  pure function plane_of(axis) result(plane)
    integer, intent(in) :: axis                   !! 1 x, 2 y, 3 z
    integer :: plane(2)

    plane = [mod(axis, 3) + 1, mod(axis + 1, 3) + 1]
  end function plane_of

  !> A place of a plane of two coordinates, with 0 along the third.
  pure function in_space(place, plane) result(x)
    real(wp), intent(in) :: place(2)
    integer, intent(in) :: plane(2)               !! see `plane_of`
    real(wp) :: x(3)

    x = 0.0_wp
    x(plane) = place
  end function in_space

  !> A region of polygons that may run either way.
  pure subroutine new_region(region, polygons, is_outside)
    type(region_t), intent(out) :: region
    type(polygon_t), intent(in) :: polygons(:)
    logical, intent(in) :: is_outside              !! what lies outside of them counts
    integer :: p

    region%is_outside = is_outside
    region%polygons = polygons
    call set_boxes(region)
    do p = 1, size(polygons)
      associate (corners => polygons(p)%corners)
        if ((mod(n_around(region, p), 2) == 0) .eqv. (signed_area(corners) > 0.0_wp)) cycle
        region%polygons(p)%corners = corners(:, size(corners, 2):1:-1)
      end associate
    end do
  end subroutine new_region

  pure subroutine set_boxes(region)
    type(region_t), intent(inout) :: region
    integer :: p

    allocate (region%boxes(2, 2, size(region%polygons)))
    do p = 1, size(region%polygons)
      region%boxes(:, 1, p) = minval(region%polygons(p)%corners, 2)
      region%boxes(:, 2, p) = maxval(region%polygons(p)%corners, 2)
    end do
  end subroutine set_boxes

  !> Append a polygon to a list.
  pure subroutine add_polygon(polygons, corners)
    type(polygon_t), allocatable, intent(inout) :: polygons(:)
    real(wp), intent(in) :: corners(:, :)
    type(polygon_t), allocatable :: grown(:)
    integer :: p

    allocate (grown(size(polygons) + 1))
    do p = 1, size(polygons)
      call move_alloc(polygons(p)%corners, grown(p)%corners)
    end do
    grown(size(grown))%corners = corners
    call move_alloc(grown, polygons)
  end subroutine add_polygon

  !> One list of regions after the other; the first may not be there.
  pure subroutine join_regions(first, second, both)
    type(region_t), allocatable, intent(in) :: first(:)
    type(region_t), intent(in) :: second(:)
    type(region_t), allocatable, intent(out) :: both(:)
    integer :: n, r

    n = 0
    if (allocated(first)) n = size(first)
    allocate (both(n + size(second)))
    do r = 1, size(both)
      if (r <= n) both(r) = first(r)
      if (r > n) both(r) = second(r - n)
      if (.not. allocated(both(r)%boxes)) call set_boxes(both(r))
    end do
  end subroutine join_regions

  !> Moments of the common part of all regions in each cell of a grid, about the middle of the cell,
  !! which is the square from -1 to 1: area 4 where all of it counts, exactly 0 where none does.
  subroutine cut_cells(regions, lines1, lines2, moments)
    type(region_t), intent(in) :: regions(:)
    real(wp), intent(in) :: lines1(:), lines2(:)                  !! of the grid, rising
    real(wp), intent(out) :: moments(:, :, :)                     !! shape (6, n1, n2)
    type(polygon_t), allocatable :: rows(:, :), columns(:, :)
    integer :: i, j, r, most

    most = 0
    do r = 1, size(regions)
      most = max(most, size(regions(r)%polygons))
    end do
    allocate (rows(most, size(regions)))
    do j = 1, size(lines2) - 1
      do r = 1, size(regions)
        call clip_all(regions(r)%polygons, 2, lines2(j), lines2(j + 1), rows(:, r))
      end do
      do i = 1, size(lines1) - 1
        allocate (columns(most, size(regions)))
        do r = 1, size(regions)
          call clip_all(rows(:size(regions(r)%polygons), r), 1, lines1(i), lines1(i + 1), &
                        columns(:, r))
          call centre_all([lines1(i), lines2(j)], [lines1(i + 1), lines2(j + 1)], columns(:, r))
        end do
        moments(:, i, j) = common_part(regions, columns, [-1.0_wp, -1.0_wp], 2.0_wp, most_halvings)
        if (moments(1, i, j) <= 4.0_wp*nothing) moments(:, i, j) = 0.0_wp
        deallocate (columns)
      end do
    end do
  end subroutine cut_cells

  !> Moments of the common part in a square. Where one border crosses it they are exact.
  recursive function common_part(regions, polygons, low, edge, n_halvings) result(moments)
    type(region_t), intent(in) :: regions(:)
    type(polygon_t), intent(in) :: polygons(:, :)      !! of each region, cut to the square
    real(wp), intent(in) :: low(2), edge               !! its corner and its edge
    integer, intent(in) :: n_halvings                  !! that are left
    real(wp) :: moments(n_moments), each(n_moments, size(regions)), corner(2)
    type(polygon_t) :: halves(size(polygons, 1), size(polygons, 2))
    type(polygon_t) :: quarters(size(polygons, 1), size(polygons, 2))
    integer :: r, a, b, n_cut, only

    n_cut = 0
    only = 1
    do r = 1, size(regions)
      each(:, r) = moments_of_region(regions(r), polygons(:size(regions(r)%polygons), r), low, edge)
      if (each(1, r) <= 0.0_wp) then
        moments = 0.0_wp
        return
      end if
      if (each(1, r) >= edge**2) cycle
      n_cut = n_cut + 1
      if (n_cut == 1 .or. each(1, r) < each(1, only)) only = r
    end do
    moments = each(:, only)
    if (n_cut < 2 .or. n_halvings == 0) return
    moments = 0.0_wp
    do b = 0, 1
      do r = 1, size(regions)
        call clip_all(polygons(:size(regions(r)%polygons), r), 2, low(2) + 0.5_wp*edge*b, &
                      low(2) + 0.5_wp*edge*(b + 1), halves(:, r))
      end do
      do a = 0, 1
        do r = 1, size(regions)
          call clip_all(halves(:size(regions(r)%polygons), r), 1, low(1) + 0.5_wp*edge*a, &
                        low(1) + 0.5_wp*edge*(a + 1), quarters(:, r))
        end do
        corner = low + 0.5_wp*edge*[a, b]
        moments = moments + common_part(regions, quarters, corner, 0.5_wp*edge, n_halvings - 1)
      end do
    end do
  end function common_part

  !> Moments of one region in a square; areas that are none, or all, but for round-off are so.
  pure function moments_of_region(region, polygons, low, edge) result(moments)
    type(region_t), intent(in) :: region
    type(polygon_t), intent(in) :: polygons(:)         !! cut to the square
    real(wp), intent(in) :: low(2), edge
    real(wp) :: moments(n_moments), whole(n_moments), mid(2)
    integer :: p

    mid = low + 0.5_wp*edge
    whole = edge**2*[1.0_wp, mid, mid(1)**2 + edge**2/12.0_wp, product(mid), &
                     mid(2)**2 + edge**2/12.0_wp]
    moments = 0.0_wp
    do p = 1, size(polygons)
      moments = moments + polygon_moments(polygons(p)%corners)
    end do
    if (region%is_outside) moments = whole - moments
    if (moments(1) <= nothing*edge**2) then
      moments = 0.0_wp
    else if (moments(1) >= (1.0_wp - nothing)*edge**2) then
      moments = whole
    end if
  end function moments_of_region

  !> Number of other polygons around one.
  pure integer function n_around(region, p) result(n)
    type(region_t), intent(in) :: region
    integer, intent(in) :: p
    real(wp) :: place(2)
    integer :: q

    n = 0
    if (size(region%polygons) == 1) return
    place = place_within(region, p)
    do q = 1, size(region%polygons)
      if (q == p) cycle
      if (any(place < region%boxes(:, 1, q) .or. place > region%boxes(:, 2, q))) cycle
      if (is_within(region%polygons(q)%corners, place)) n = n + 1
    end do
  end function n_around

  !> A place inside polygon p and inside none that it contains, on a line along the first axis
  !! through the middle of its steepest edge: half-way from its first crossing with the line to the
  !! next one of any polygon. Corners may lie on other polygons.
  pure function place_within(region, p) result(place)
    type(region_t), intent(in) :: region
    integer, intent(in) :: p
    real(wp) :: place(2), first, next
    integer :: k, n, q

    associate (corners => region%polygons(p)%corners)
      n = size(corners, 2)
      k = maxloc(abs(corners(2, :) - cshift(corners(2, :), -1)), 1)
      place(2) = 0.5_wp*(corners(2, k) + corners(2, mod(k - 2 + n, n) + 1))
      first = first_crossing(corners, place(2), -huge(first))
    end associate
    next = huge(next)
    do q = 1, size(region%polygons)
      if (place(2) < region%boxes(2, 1, q) .or. place(2) > region%boxes(2, 2, q)) cycle
      next = min(next, first_crossing(region%polygons(q)%corners, place(2), first))
    end do
    place(1) = 0.5_wp*(first + next)
  end function place_within

  !> Where a line along the first axis crosses a polygon first after a place on it; huge if nowhere.
  pure real(wp) function first_crossing(corners, level, after) result(first)
    real(wp), intent(in) :: corners(:, :), level   !! second coordinate of the line
    real(wp), intent(in) :: after
    real(wp) :: x
    integer :: i, j

    first = huge(first)
    j = size(corners, 2)
    do i = 1, size(corners, 2)
      associate (a => corners(:, i), b => corners(:, j))
        if ((a(2) > level) .neqv. (b(2) > level)) then
          x = a(1) + (level - a(2))/(b(2) - a(2))*(b(1) - a(1))
          if (x > after) first = min(first, x)
        end if
      end associate
      j = i
    end do
  end function first_crossing

  !> Does a place count in all regions?
  pure logical function is_inside(regions, place)
    type(region_t), intent(in) :: regions(:)
    real(wp), intent(in) :: place(2)
    logical :: is_odd
    integer :: r, p

    is_inside = .true.
    do r = 1, size(regions)
      is_odd = .false.
      do p = 1, size(regions(r)%polygons)
        if (allocated(regions(r)%boxes)) then
          if (any(place < regions(r)%boxes(:, 1, p) .or. place > regions(r)%boxes(:, 2, p))) cycle
        end if
        is_odd = is_odd .neqv. is_within(regions(r)%polygons(p)%corners, place)
      end do
      is_inside = is_inside .and. (is_odd .neqv. regions(r)%is_outside)
    end do
  end function is_inside

  !> First and last cell that a coordinate lies in: two at a line between them.
  pure function cells_at(lines, x) result(cells)
    real(wp), intent(in) :: lines(:)               !! of the grid, rising
    real(wp), intent(in) :: x
    integer :: cells(2)
    real(wp), parameter :: round_off = 1.0e-9_wp   ! of the grid
    real(wp) :: little

    little = round_off*(lines(size(lines)) - lines(1))
    cells = [count(lines < x - little), count(lines <= x + little)]
    cells = min(max(cells, 1), size(lines) - 1)
  end function cells_at

  !> Which places of a tensor grid count, tested one by one only at cells that are cut.
  pure function places_inside(regions, lines1, lines2, share, xi, eta, margin) result(is_in)
    type(region_t), intent(in) :: regions(:)
    real(wp), intent(in) :: lines1(:), lines2(:)   !! of the cells, rising
    real(wp), intent(in) :: share(:, :)            !! of each cell that is inside
    real(wp), intent(in) :: xi(:), eta(:)          !! coordinates of the places
    real(wp), intent(in) :: margin                 !! distance outside, over the whole grid, up to
                                                   !! which a place counts; 0: none does
    logical :: is_in(size(xi), size(eta))
    integer :: cells1(2, size(xi)), cells2(2), i, j

    do i = 1, size(xi)
      cells1(:, i) = cells_at(lines1, xi(i))
    end do
    do j = 1, size(eta)
      cells2 = cells_at(lines2, eta(j))
      do i = 1, size(xi)
        associate (around => share(cells1(1, i):cells1(2, i), cells2(1):cells2(2)))
          is_in(i, j) = any(around > 0.0_wp)
          if (.not. is_in(i, j) .or. all(around >= 1.0_wp)) cycle
        end associate
        is_in(i, j) = is_inside(regions, [xi(i), eta(j)])
        if (is_in(i, j) .or. margin <= 0.0_wp) cycle
        is_in(i, j) = inside_distance(regions, [xi(i), eta(j)], &
                                      1.0_wp/[lines1(size(lines1)) - lines1(1), &
                                              lines2(size(lines2)) - lines2(1)]) > -margin
      end do
    end do
  end function places_inside

  !> Distance from the border of what all regions have in common, negative outside. It is exact near
  !! a border; lengths are those along both axes times `scale`. What runs along the bounds of a
  !! sheet is no border: the sheet ends there by itself.
  pure real(wp) function inside_distance(regions, place, scale, bounds) result(distance)
    type(region_t), intent(in) :: regions(:)
    real(wp), intent(in) :: place(2), scale(2)
    real(wp), intent(in), optional :: bounds(2, 2)   !! of the sheet: low, high
    real(wp) :: nearest, own
    integer :: r, p, first

    distance = huge(distance)
    do r = 1, size(regions)
      associate (region => regions(r))
        first = 0
        nearest = huge(nearest)
        if (allocated(region%boxes) .and. size(region%polygons) > 0) then
          first = minloc([(box_gap(region%boxes(:, :, p), place, scale), &
                           p=1, size(region%polygons))], 1)
          nearest = polygon_gap(region%polygons(first)%corners, place, scale, bounds)
        end if
        do p = 1, size(region%polygons)
          if (p == first) cycle
          if (allocated(region%boxes)) then
            if (box_gap(region%boxes(:, :, p), place, scale) > nearest) cycle
          end if
          nearest = min(nearest, polygon_gap(region%polygons(p)%corners, place, scale, bounds))
        end do
      end associate
      own = sqrt(nearest)
      if (.not. is_inside(regions(r:r), place)) own = -own
      distance = min(distance, own)
    end do
  end function inside_distance

  !> Square of the distance of a place from a box, 0 inside, less a round-off.
  pure real(wp) function box_gap(box, place, scale) result(gap)
    real(wp), intent(in) :: box(2, 2), place(2), scale(2)
    real(wp), parameter :: safe = 1.0_wp - 1.0e-12_wp

    gap = safe*sum((max(box(:, 1) - place, place - box(:, 2), 0.0_wp)*scale)**2)
  end function box_gap

  !> Square of the distance of a place from the edges of a polygon, see `inside_distance`.
  pure real(wp) function polygon_gap(corners, place, scale, bounds) result(nearest)
    real(wp), intent(in) :: corners(:, :), place(2), scale(2)
    real(wp), intent(in), optional :: bounds(2, 2)
    real(wp) :: a(2), b(2), t
    integer :: i, j

    nearest = huge(nearest)
    j = size(corners, 2)
    do i = 1, size(corners, 2)
      if (present(bounds)) then
        if (runs_along(bounds, corners(:, j), corners(:, i))) then
          j = i
          cycle
        end if
      end if
      a = (corners(:, j) - place)*scale
      b = (corners(:, i) - corners(:, j))*scale
      t = share_along(-a, b)
      nearest = min(nearest, sum((a + t*b)**2))
      j = i
    end do
  end function polygon_gap

  !> Where a segment is nearest to a place, 0 at its first end and 1 at the other.
  pure real(wp) function share_along(way, segment) result(share)
    real(wp), intent(in) :: way(2)          !! from the first end to the place
    real(wp), intent(in) :: segment(2)      !! from end to end

    share = dot_product(way, segment)/max(dot_product(segment, segment), tiny(share))
    share = min(max(share, 0.0_wp), 1.0_wp)
  end function share_along

  !> Do both ends of a segment lie on or beyond the same bound of a sheet?
  pure logical function runs_along(bounds, first, second)
    real(wp), intent(in) :: bounds(2, 2), first(2), second(2)
    real(wp), parameter :: round_off = 1.0e-9_wp     ! of the sheet
    real(wp) :: little(2)

    little = round_off*(bounds(:, 2) - bounds(:, 1))
    runs_along = any(max(first, second) <= bounds(:, 1) + little) &
                 .or. any(min(first, second) >= bounds(:, 2) - little)
  end function runs_along

  !> Is a place within a polygon? By the crossings of a ray along the first axis.
  pure logical function is_within(corners, place)
    real(wp), intent(in) :: corners(:, :), place(2)
    integer :: i, j

    is_within = .false.
    j = size(corners, 2)
    do i = 1, size(corners, 2)
      associate (a => corners(:, i), b => corners(:, j))
        if ((a(2) > place(2)) .neqv. (b(2) > place(2))) then
          if (place(1) < a(1) + (place(2) - a(2))/(b(2) - a(2))*(b(1) - a(1))) &
            is_within = .not. is_within
        end if
      end associate
      j = i
    end do
  end function is_within

  !> Area of a polygon, positive where it runs counter-clockwise.
  pure real(wp) function signed_area(corners) result(area)
    real(wp), intent(in) :: corners(:, :)          !! shape (2, n)
    integer :: i, j

    area = 0.0_wp
    j = size(corners, 2)
    do i = 1, size(corners, 2)
      associate (a => corners(:, j) - corners(:, 1), b => corners(:, i) - corners(:, 1))
        area = area + 0.5_wp*(a(1)*b(2) - b(1)*a(2))
      end associate
      j = i
    end do
  end function signed_area

  !> Integrals of 1, x, y, x^2, x y, y^2 over a polygon, with the sign of its sense.
  pure function polygon_moments(corners) result(moments)
    real(wp), intent(in) :: corners(:, :)
    real(wp) :: moments(n_moments), c
    integer :: i, j

    moments = 0.0_wp
    j = size(corners, 2)
    do i = 1, size(corners, 2)
      associate (x => corners(1, j), y => corners(2, j), u => corners(1, i), v => corners(2, i))
        c = x*v - u*y
        moments = moments + c*[0.5_wp, (x + u)/6.0_wp, (y + v)/6.0_wp, &
                               (x*x + x*u + u*u)/12.0_wp, &
                               (x*v + 2.0_wp*(x*y + u*v) + u*y)/24.0_wp, &
                               (y*y + y*v + v*v)/12.0_wp]
      end associate
      j = i
    end do
  end function polygon_moments

  !> Cut a polygon to a box; nothing is left of one that lies outside, or of a line.
  pure subroutine cut_to_box(corners, low, high, cut)
    real(wp), intent(in) :: corners(:, :)          !! shape (2, n)
    real(wp), intent(in) :: low(2), high(2)
    real(wp), allocatable, intent(inout) :: cut(:, :)
    real(wp), allocatable :: rest(:, :)
    integer :: a

    cut = corners
    do a = 1, 2
      call clip(cut, a, low(a), 1.0_wp, rest)
      call clip(rest, a, high(a), -1.0_wp, cut)
    end do
    if (size(cut, 2) < 3) cut = cut(:, :0)
  end subroutine cut_to_box

  !> Does all of a box lie in a polygon, but for round-off?
  pure logical function covers_box(corners, low, high)
    real(wp), intent(in) :: corners(:, :)          !! shape (2, n)
    real(wp), intent(in) :: low(2), high(2)
    real(wp), parameter :: all_of_it = 1.0_wp - 1.0e-9_wp
    real(wp), allocatable :: cut(:, :)

    call cut_to_box(corners, low, high, cut)
    covers_box = abs(signed_area(cut)) >= all_of_it*product(high - low)
  end function covers_box

  !> Cut polygons to a strip.
  pure subroutine clip_all(polygons, axis, low, high, cut)
    type(polygon_t), intent(in) :: polygons(:)
    integer, intent(in) :: axis
    real(wp), intent(in) :: low, high              !! of the coordinate along the axis
    type(polygon_t), intent(inout) :: cut(:)       !! at least as many
    real(wp), allocatable :: half(:, :)
    integer :: p

    do p = 1, size(polygons)
      call clip(polygons(p)%corners, axis, low, 1.0_wp, half)
      call clip(half, axis, high, -1.0_wp, cut(p)%corners)
    end do
  end subroutine clip_all

  !> Cut a polygon to one side of a line across an axis. Parts that are left apart stay joined by
  !! pieces of the line, which add nothing to its moments.
  pure subroutine clip(corners, axis, bound, side, cut)
    real(wp), intent(in) :: corners(:, :)
    integer, intent(in) :: axis
    real(wp), intent(in) :: bound, side            !! +1: what lies above stays, -1: below
    real(wp), allocatable, intent(inout) :: cut(:, :)
    real(wp) :: room(2, 2*size(corners, 2)), x(2)
    integer :: i, j, n

    n = 0
    j = size(corners, 2)
    do i = 1, size(corners, 2)
      associate (a => corners(:, j), b => corners(:, i))
        if ((side*(a(axis) - bound) >= 0.0_wp) .neqv. (side*(b(axis) - bound) >= 0.0_wp)) then
          x = a + (bound - a(axis))/(b(axis) - a(axis))*(b - a)
          x(axis) = bound
          n = n + 1
          room(:, n) = x
        end if
        if (side*(b(axis) - bound) >= 0.0_wp) then
          n = n + 1
          room(:, n) = b
        end if
      end associate
      j = i
    end do
    if (allocated(cut)) deallocate (cut)
    allocate (cut, source=room(:, :n))
  end subroutine clip

  !> To coordinates from -1 to 1 in a cell.
  pure subroutine centre_all(low, high, polygons)
    real(wp), intent(in) :: low(2), high(2)
    type(polygon_t), intent(inout) :: polygons(:)
    integer :: p, a

    do p = 1, size(polygons)
      if (.not. allocated(polygons(p)%corners)) cycle
      do a = 1, 2
        polygons(p)%corners(a, :) = ((polygons(p)%corners(a, :) - low(a)) &
                                     - (high(a) - polygons(p)%corners(a, :)))/(high(a) - low(a))
      end do
    end do
  end subroutine centre_all

end module outline
