!> A grid in the parameter space of a surface that carries fields linear in each of its cells.
module surface_grid
  use kinds, only: wp
  use linear_algebra, only: cross
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use knot_vector, only: knot_vector_t, span_table
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use surface_trim, only: trim_t, is_inside, place_in_spans
  implicit none
  private

  public :: surface_grid_t, new_surface_grid, grid_areas, grid_position, grid_values, parts_along, &
            element_size_of, turns_along, no_length, lines

  integer, parameter :: most_parts = 100   !! of a knot span
  integer, parameter :: n_samples = 8      !! chords of a span that its length is measured by
  integer, parameter :: n_inside = 8       !! places along a side of a quarter of a cell

  real(wp), parameter :: round_off = 1.0e-12_wp   !! of coordinates
  real(wp), parameter :: no_length = huge(1.0_wp)   !! which leaves every span whole

  !> Lines of the grid; a field on it has shape (size(xi), size(eta)).
  type :: surface_grid_t
    real(wp), allocatable :: xi(:), eta(:)   !! rising
  end type surface_grid_t

contains

  !> The knot lines of a surface and lines between them, so that no cell is longer than `length`.
  pure function new_surface_grid(surface, length) result(grid)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: length           !! [length]
    type(surface_grid_t) :: grid
    integer :: n(2)

    n = parts_along(surface, length)
    grid%xi = lines(surface%axes(1), n(1))
    grid%eta = lines(surface%axes(2), n(2))
  end function new_surface_grid

  !> Into how many equal parts the knot spans of both directions must be cut.
  pure function parts_along(surface, length) result(n)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: length           !! of a part at most [length]
    integer :: n(2)
    real(wp) :: lengths(2), turns(2)

    call measure_spans(surface, lengths, turns)
    n = min(max(ceiling(lengths/length*(1.0_wp - 1.0e-9_wp)), 1), most_parts)
  end function parts_along

  !> The largest angle by which a line of either direction turns in a knot span [radian].
  pure function turns_along(surface) result(turns)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp) :: turns(2), lengths(2)

    call measure_spans(surface, lengths, turns)
  end function turns_along

  !> Largest length and turn of knot spans along both directions.
  pure subroutine measure_spans(surface, lengths, turns)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(out) :: lengths(2), turns(2)   !! [length], [radian]
    real(wp) :: at(2), points(3, 0:n_samples), arc, angle, nothing
    real(wp), allocatable :: along(:), across(:)
    integer :: d, i, j, k

    lengths = 0.0_wp
    turns = 0.0_wp
    nothing = round_off*maxval(abs(surface%points))
    do d = 1, 2
      along = lines(surface%axes(d), n_samples)
      across = lines(surface%axes(3 - d), 2)
      do j = 1, size(across)
        do i = 1, size(along) - 1, n_samples
          arc = 0.0_wp
          angle = 0.0_wp
          do k = 0, n_samples
            at(d) = along(i + k)
            at(3 - d) = across(j)
            call evaluate_surface(surface, at, points(:, k))
            if (k > 0) arc = arc + norm2(points(:, k) - points(:, k - 1))
            if (k > 1) angle = angle + angle_between(points(:, k - 1) - points(:, k - 2), &
                                                     points(:, k) - points(:, k - 1), nothing)
          end do
          lengths(d) = max(lengths(d), arc)
          ! Half a chord at either end has not been turned through.
          turns(d) = max(turns(d), angle*n_samples/(n_samples - 1))
        end do
      end do
    end do
  end subroutine measure_spans

  !> Angle between two vectors; 0 where one is no longer than nothing.
  pure real(wp) function angle_between(a, b, nothing) result(angle)
    real(wp), intent(in) :: a(3), b(3), nothing

    angle = 0.0_wp
    if (min(norm2(a), norm2(b)) > nothing) angle = atan2(norm2(cross(a, b)), dot_product(a, b))
  end function angle_between

  !> Side of a square as large as the elements of a surface are on average.
  function element_size_of(surface) result(length)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp) :: length
    type(surface_grid_t) :: grid

    grid = new_surface_grid(surface, no_length)
    length = sqrt(sum(grid_areas(surface, grid))/((size(grid%xi) - 1)*(size(grid%eta) - 1)))
  end function element_size_of

  !> Coordinates that cut each knot span into equal parts.
  pure function lines(axis, n_parts) result(xi)
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: n_parts
    real(wp), allocatable :: xi(:)
    integer, allocatable :: spans(:)
    integer :: s, i

    allocate (spans, source=span_table(axis))
    allocate (xi(n_parts*size(spans) + 1))
    do s = 1, size(spans)
      associate (low => axis%knots(spans(s)), high => axis%knots(spans(s) + 1))
        xi((s - 1)*n_parts + 1:s*n_parts) = [(low + (high - low)*i/n_parts, i=0, n_parts - 1)]
      end associate
    end do
    xi(size(xi)) = axis%knots(axis%n_basis + 1)
  end function lines

  !> Area of the surface that each node of the grid represents; their sum is that of the surface, or
  !! of what a trim leaves of it, with an error of about a percent of the cells that it cuts.
  function grid_areas(surface, grid, trim) result(areas)
    type(nurbs_surface_t), intent(in) :: surface
    type(surface_grid_t), intent(in) :: grid
    type(trim_t), intent(in), optional :: trim
    real(wp) :: areas(size(grid%xi), size(grid%eta))
    type(gauss_rule_t) :: rule
    real(wp) :: side(2), at(2), fraction(2), hats(2, 2), part, point(3), d1(3, 2)
    integer :: i, j, g, h

    rule = new_gauss_rule(2, 1)
    areas = 0.0_wp
    do j = 1, size(grid%eta) - 1
      do i = 1, size(grid%xi) - 1
        side = [grid%xi(i + 1) - grid%xi(i), grid%eta(j + 1) - grid%eta(j)]
        do h = 1, rule%n
          do g = 1, rule%n
            fraction = 0.5_wp*(1.0_wp + rule%points([g, h]))
            at = [grid%xi(i), grid%eta(j)]
            hats = hats_at(fraction)
            if (present(trim)) hats = hats_inside(surface, trim, at, side, [g, h], hats)
            if (all(hats <= 0.0_wp)) cycle
            call evaluate_surface(surface, at + side*fraction, point, d1)
            part = 0.25_wp*product(side)*rule%weights(g)*rule%weights(h) &
                   *norm2(cross(d1(:, 1), d1(:, 2)))
            areas(i:i + 1, j:j + 1) = areas(i:i + 1, j:j + 1) + part*hats
          end do
        end do
      end do
    end do
  end function grid_areas

  !> Shares of the corners of a cell at a place in it.
  pure function hats_at(fraction) result(hats)
    real(wp), intent(in) :: fraction(2)    !! of the sides
    real(wp) :: hats(2, 2)

    hats(:, 1) = (1 - fraction(2))*[1 - fraction(1), fraction(1)]
    hats(:, 2) = fraction(2)*[1 - fraction(1), fraction(1)]
  end function hats_at

  !> Mean shares of the corners in a quarter of a cell, counting what lies inside a trim alone; in
  !! spans that this does not cut as they are.
  pure function hats_inside(surface, trim, low, side, quarter, whole) result(hats)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_t), intent(in) :: trim
    real(wp), intent(in) :: low(2), side(2)    !! of the cell, which lies in one span
    integer, intent(in) :: quarter(2)          !! 1 or 2 along both sides
    real(wp), intent(in) :: whole(2, 2)        !! without a trim
    real(wp) :: hats(2, 2)
    real(wp) :: first(2), last(2), fraction(2), local(2)
    integer :: i, j, span

    call place_in_spans(surface%axes, low + 0.25_wp*side, span, first)
    call place_in_spans(surface%axes, low + 0.75_wp*side, span, last)
    hats = 0.0_wp
    if (trim%root(span) == 0) hats = whole
    if (trim%root(span) <= 0) return
    do j = 1, n_inside
      do i = 1, n_inside
        fraction = 0.5_wp*(quarter - 1 + ([i, j] - 0.5_wp)/n_inside)
        local = first + (2*fraction - 0.5_wp)*(last - first)
        if (is_inside(trim, span, local)) hats = hats + hats_at(fraction)/n_inside**2
      end do
    end do
  end function hats_inside

  !> The cell (i, j) that holds a position, and how far along its sides it lies, 0 to 1.
  pure subroutine grid_position(grid, at, cell, fraction)
    type(surface_grid_t), intent(in) :: grid
    real(wp), intent(in) :: at(2)
    integer, intent(out) :: cell(2)
    real(wp), intent(out) :: fraction(2)

    call line_position(grid%xi, at(1), cell(1), fraction(1))
    call line_position(grid%eta, at(2), cell(2), fraction(2))
  end subroutine grid_position

  !> Values of a field at a tensor grid of positions: linear between the lines, constant outside
  !! them.
  pure function grid_values(grid, field, xi, eta) result(values)
    type(surface_grid_t), intent(in) :: grid
    real(wp), intent(in) :: field(size(grid%xi), size(grid%eta))
    real(wp), intent(in) :: xi(:), eta(:)
    real(wp) :: values(size(xi), size(eta))
    integer :: i, j, a(size(xi)), b(size(eta)), c(size(xi)), d(size(eta))
    real(wp) :: s(size(xi)), t(size(eta))

    do i = 1, size(xi)
      call line_position(grid%xi, xi(i), a(i), s(i))
    end do
    do j = 1, size(eta)
      call line_position(grid%eta, eta(j), b(j), t(j))
    end do
    c = min(a + 1, size(field, 1))
    d = min(b + 1, size(field, 2))
    do j = 1, size(eta)
      values(:, j) = (1 - t(j))*((1 - s)*field(a, b(j)) + s*field(c, b(j))) &
                     + t(j)*((1 - s)*field(a, d(j)) + s*field(c, d(j)))
    end do
  end function grid_values

  !> Interval of a rising list that holds x, and the share of it that lies before x.
  pure subroutine line_position(list, x, interval, fraction)
    real(wp), intent(in) :: list(:), x
    integer, intent(out) :: interval
    real(wp), intent(out) :: fraction
    integer :: high, middle

    interval = 1
    fraction = 0.0_wp
    if (size(list) == 1) return
    high = size(list)
    do while (high - interval > 1)
      middle = (interval + high)/2
      if (list(middle) <= x) then
        interval = middle
      else
        high = middle
      end if
    end do
    fraction = min(max((x - list(interval))/(list(interval + 1) - list(interval)), 0.0_wp), 1.0_wp)
  end subroutine line_position

end module surface_grid
