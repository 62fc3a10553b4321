!> Secondary points of a blank's face: their positions from the control net, and their forces back.
!!
!! Points form a tensor grid, number i + n_along(1)*(j - 1), so positions and forces go direction by
!! direction over one-dimensional tables. Each row of points is one unit of work.
module secondary_surface
  use kinds, only: wp
  use failure, only: error_t, fail
  use linear_algebra, only: cross, solve_band
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use knot_vector, only: knot_vector_t, find_span, basis_derivatives, span_table, n_spans, &
                         greville
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use outline, only: region_t, cells_at, places_inside
  implicit none
  private

  public :: secondary_line_t, area_rule_t, new_secondary_line, new_area_rule, secondary_surface_t, &
            new_secondary_surface, new_sample_surface, secondary_positions, row_positions, &
            point_position, indices_of, scatter_forces, gather_forces, add_gathered, &
            areas_inside

  integer, parameter, public :: points_gauss = 1      !! Gauss points of each element
  integer, parameter, public :: points_knot = 2       !! the distinct knots
  integer, parameter, public :: points_greville = 3   !! Greville abscissae, one a control point
  integer, parameter :: least_count = 2               !! of Gauss points, along an element

  !> One-dimensional basis table: the functions first(i) ... first(i) + p do not vanish at point i.
  type :: secondary_line_t
    integer :: n_points = 0
    integer :: n_net = 0                     !! control points n
    integer :: degree = 0                    !! polynomial degree p
    real(wp), allocatable :: xi(:)           !! parametric coordinates, rising, shape (n_points)
    integer, allocatable :: first(:)         !! shape (n_points)
    real(wp), allocatable :: values(:, :)    !! shape (n_points, p + 1)
  end type secondary_line_t

  !> Quadrature along the direction, and how each quadrature point's area goes to secondary points
  !! first(g), first(g) + 1, ... The shares of a quadrature point sum to one.
  type :: area_rule_t
    integer :: n = 0                         !! number of quadrature points
    real(wp), allocatable :: xi(:)           !! parametric coordinates, shape (n)
    real(wp), allocatable :: weights(:)      !! in parameter space, shape (n)
    integer, allocatable :: first(:)         !! shape (n)
    real(wp), allocatable :: fractions(:, :)    !! shape (n_shares, n)
  end type area_rule_t

  integer, parameter :: parallel_size = 4096   !! fewer points are not worth waking threads for

  !> Secondary points of one face.
  type :: secondary_surface_t
    integer :: n_points = 0
    integer :: n_along(2) = 0                   !! points per direction
    integer :: n_net(2) = 0                     !! control points per direction
    type(secondary_line_t) :: lines(2)              !! basis tables per direction
    logical :: is_rational = .false.            !! weights differ from one
    real(wp), allocatable :: weights(:, :)      !! of the control points, shape (n_net)
    real(wp), allocatable :: inverse_w(:, :)    !! 1/(sum N w) at the points, shape (n_along)
    real(wp), allocatable :: area(:)            !! reference area of a point [area], (n_points)
    real(wp), allocatable :: whole_area(:)      !! without an outline; allocated where there is one
  end type secondary_surface_t

contains

  !> Basis table of the secondary points of a direction.
  pure subroutine new_secondary_line(line, axis, kind, n_gauss)
    type(secondary_line_t), intent(out) :: line
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: kind      !! points_gauss, points_knot or points_greville
    integer, intent(in) :: n_gauss   !! Gauss points per element, used by points_gauss alone
    integer, allocatable :: spans(:)

    allocate (spans, source=span_table(axis))
    select case (kind)
    case (points_gauss)
      call new_line_at(line, axis, gauss_places(axis, n_gauss))
    case (points_knot)
      call new_line_at(line, axis, [axis%knots(spans), axis%knots(axis%n_basis + 1)])
    case default
      call new_line_at(line, axis, greville(axis))
    end select
  end subroutine new_secondary_line

  !> Basis table of any points.
  pure subroutine new_line_at(line, axis, xi)
    type(secondary_line_t), intent(out) :: line
    type(knot_vector_t), intent(in) :: axis
    real(wp), intent(in) :: xi(:)    !! parametric coordinates, rising
    integer :: i, span

    line%xi = xi
    line%n_points = size(line%xi)
    line%n_net = axis%n_basis
    line%degree = axis%degree
    allocate (line%first(line%n_points), line%values(line%n_points, axis%degree + 1))
    do i = 1, line%n_points
      span = find_span(axis, line%xi(i))
      line%first(i) = span - axis%degree
      call basis_derivatives(axis, span, line%xi(i), 0, line%values(i, :))
    end do
  end subroutine new_line_at

  !> Quadrature that shares the area of a face out to its secondary points, so that nothing is lost:
  !! Gauss points keep their own, knots take it by hat functions, Greville points by the basis
  !! functions they belong to (row sums, which `solve_moments` turns into weights).
  pure subroutine new_area_rule(rule, axis, kind, n_gauss)
    type(area_rule_t), intent(out) :: rule
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: kind, n_gauss   !! as for `new_secondary_line`
    type(gauss_rule_t) :: gauss
    integer, allocatable :: spans(:)
    integer :: element, i, n
    real(wp) :: half, position

    allocate (spans, source=span_table(axis))
    gauss = new_gauss_rule(merge(n_gauss, axis%degree + 1, kind == points_gauss), 1)
    rule%n = gauss%n*size(spans)
    rule%xi = gauss_places(axis, gauss%n)
    n = merge(1, merge(2, axis%degree + 1, kind == points_knot), kind == points_gauss)
    allocate (rule%weights(rule%n), rule%first(rule%n), rule%fractions(n, rule%n))
    n = 0
    do element = 1, size(spans)
      half = 0.5_wp*(axis%knots(spans(element) + 1) - axis%knots(spans(element)))
      do i = 1, gauss%n
        n = n + 1
        position = 0.5_wp*(1.0_wp + gauss%points(i))
        rule%weights(n) = half*gauss%weights(i)
        select case (kind)
        case (points_gauss)
          rule%first(n) = n
          rule%fractions(:, n) = 1.0_wp
        case (points_knot)
          rule%first(n) = element
          rule%fractions(:, n) = [1.0_wp - position, position]
        case default
          rule%first(n) = spans(element) - axis%degree
          call basis_derivatives(axis, spans(element), rule%xi(n), 0, rule%fractions(:, n))
        end select
      end do
    end do
  end subroutine new_area_rule

  !> Weights of Greville points from the moments b_I = integral of N_I: sum_p N_I(xi_p) a_p = b_I,
  !! for several columns.
  subroutine solve_moments(line, columns, is_solved)
    type(secondary_line_t), intent(in) :: line         !! of Greville points
    real(wp), intent(inout) :: columns(:, :)       !! moments in, weights out, shape (n_points, m)
    logical, intent(out) :: is_solved
    real(wp) :: band(2*line%degree + 1, line%n_points)
    integer :: i, p

    band = 0.0_wp
    do p = 1, line%n_points
      do i = line%first(p), line%first(p) + line%degree
        if (abs(p - i) <= line%degree) &
          band(line%degree + 1 + i - p, p) = line%values(p, i - line%first(p) + 1)
      end do
    end do
    call solve_band(band, line%degree, columns, is_solved)
  end subroutine solve_moments

  !> Gauss points of all elements in rising order.
  pure function gauss_places(axis, n_gauss) result(xi)
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: n_gauss
    real(wp) :: xi(n_gauss*n_spans(axis))
    type(gauss_rule_t) :: gauss
    integer, allocatable :: spans(:)
    integer :: element
    real(wp) :: low, high

    allocate (spans, source=span_table(axis))
    gauss = new_gauss_rule(n_gauss, 1)
    do element = 1, size(spans)
      low = axis%knots(spans(element))
      high = axis%knots(spans(element) + 1)
      xi((element - 1)*n_gauss + 1:element*n_gauss) = low + 0.5_wp*(high - low)*(1 + gauss%points)
    end do
  end function gauss_places

  !> Choose the secondary points of a face of the blank in its shape at the start.
  !! Rejected: an unknown kind of points, a negative number of Gauss points.
  subroutine new_secondary_surface(secondary, surface, kind, n_gauss, error)
    type(secondary_surface_t), intent(out) :: secondary
    type(nurbs_surface_t), intent(in) :: surface   !! the face at the start
    integer, intent(in) :: kind          !! points_gauss, points_knot or points_greville
    !> Gauss points per element and direction, whatever the kind; 0: those of the kind, p Gauss
    !! points, but at least 2.
    integer, intent(in) :: n_gauss(2)
    type(error_t), allocatable, intent(out) :: error
    integer :: direction, kinds(2), counts(2)

    if (all(kind /= [points_gauss, points_knot, points_greville])) then
      call fail(error, "contact: slave points must be GAUSS, KNOT or GREVILLE")
      return
    else if (any(n_gauss < 0)) then
      call fail(error, "contact: the number of Gauss points must not be negative")
      return
    end if
    kinds = merge(points_gauss, kind, n_gauss > 0)
    counts = merge(n_gauss, max(surface%axes%degree, least_count), n_gauss > 0)
    do direction = 1, 2
      call new_secondary_line(secondary%lines(direction), surface%axes(direction), &
                              kinds(direction), counts(direction))
    end do
    call set_grid(secondary, surface)
    call set_areas(secondary, surface, kinds, counts)
  end subroutine new_secondary_surface

  !> Points of a face at chosen positions, for evaluation only: they have no area.
  pure subroutine new_sample_surface(secondary, surface, xi, eta)
    type(secondary_surface_t), intent(out) :: secondary
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: xi(:), eta(:)    !! parametric coordinates, rising

    call new_line_at(secondary%lines(1), surface%axes(1), xi)
    call new_line_at(secondary%lines(2), surface%axes(2), eta)
    call set_grid(secondary, surface)
  end subroutine new_sample_surface

  !> Sizes and weights, from the lines.
  pure subroutine set_grid(secondary, surface)
    type(secondary_surface_t), intent(inout) :: secondary
    type(nurbs_surface_t), intent(in) :: surface
    integer :: i, j, n(2), first(2)

    secondary%n_along = secondary%lines%n_points
    secondary%n_net = secondary%lines%n_net
    secondary%n_points = product(secondary%n_along)
    secondary%weights = surface%weights
    secondary%is_rational = any(abs(surface%weights - 1.0_wp) > 0.0_wp)
    allocate (secondary%inverse_w(secondary%n_along(1), secondary%n_along(2)), source=1.0_wp)
    if (.not. secondary%is_rational) return
    n = secondary%lines%degree
    do j = 1, secondary%n_along(2)
      do i = 1, secondary%n_along(1)
        first = [secondary%lines(1)%first(i), secondary%lines(2)%first(j)]
        secondary%inverse_w(i, j) = 1.0_wp/dot_product(secondary%lines(1)%values(i, :), &
          matmul(secondary%weights(first(1):first(1) + n(1), first(2):first(2) + n(2)), &
                 secondary%lines(2)%values(j, :)))
      end do
    end do
  end subroutine set_grid

  !> Positions of all secondary points, the same for any number of threads.
  subroutine secondary_positions(secondary, net, positions)
    type(secondary_surface_t), intent(in) :: secondary
    real(wp), intent(in) :: net(secondary%n_net(1), secondary%n_net(2), 3)   !! [length]
    real(wp), intent(out) :: positions(secondary%n_along(1), secondary%n_along(2), 3)   !! [length]
    integer :: row

    !$omp parallel do schedule(static) if (secondary%n_points > parallel_size)
    do row = 1, secondary%n_along(2)
      call row_positions(secondary, net, row, 1, secondary%n_along(1), positions(:, row, :))
    end do
    !$omp end parallel do
  end subroutine secondary_positions

  !> Positions of the points `first` to `last` of one row.
  pure subroutine row_positions(secondary, net, row, first, last, positions)
    type(secondary_surface_t), intent(in) :: secondary
    real(wp), intent(in) :: net(secondary%n_net(1), secondary%n_net(2), 3)   !! [length]
    integer, intent(in) :: row, first, last
    real(wp), intent(out) :: positions(first:last, 3)                !! [length]
    real(wp) :: column(secondary%n_net(1), 3)
    integer :: low, high, j, i, k, c

    associate (line => secondary%lines(1), across => secondary%lines(2))
      low = line%first(first)
      high = line%first(last) + line%degree
      column(low:high, :) = 0.0_wp
      do c = 1, 3
        do k = 1, across%degree + 1
          j = across%first(row) + k - 1
          if (secondary%is_rational) then
            column(low:high, c) = column(low:high, c) &
              + across%values(row, k)*secondary%weights(low:high, j)*net(low:high, j, c)
          else
            column(low:high, c) = column(low:high, c) + across%values(row, k)*net(low:high, j, c)
          end if
        end do
        positions(:, c) = 0.0_wp
        do k = 1, line%degree + 1
          do i = first, last
            positions(i, c) = positions(i, c) + line%values(i, k)*column(line%first(i) + k - 1, c)
          end do
        end do
        if (secondary%is_rational) then
          positions(:, c) = positions(:, c)*secondary%inverse_w(first:last, row)
        end if
      end do
    end associate
  end subroutine row_positions

  !> Where a point is in the grid.
  pure function indices_of(secondary, point) result(at)
    type(secondary_surface_t), intent(in) :: secondary
    integer, intent(in) :: point
    integer :: at(2)

    at(2) = (point - 1)/secondary%n_along(1) + 1
    at(1) = point - (at(2) - 1)*secondary%n_along(1)
  end function indices_of

  !> Position of the point (i, j) alone.
  pure function point_position(secondary, net, i, j) result(position)
    type(secondary_surface_t), intent(in) :: secondary
    real(wp), intent(in) :: net(secondary%n_net(1), secondary%n_net(2), 3)   !! [length]
    integer, intent(in) :: i, j
    real(wp) :: position(3), v(3), w(3), column
    integer :: c, k, l, at(2)

    associate (line => secondary%lines(1), across => secondary%lines(2))
      at = [line%first(i), across%first(j)]
      if (.not. secondary%is_rational .and. line%degree == 2 .and. across%degree == 2) then
        v = line%values(i, 1:3)
        w = across%values(j, 1:3)
        position = blend_quadratic(v, w, secondary%n_net(1), secondary%n_net(2), at(1), at(2), net)
        return
      end if
      do c = 1, 3
        position(c) = 0.0_wp
        do k = 0, line%degree
          column = 0.0_wp
          do l = 0, across%degree
            column = column + across%values(j, l + 1)*secondary%weights(at(1) + k, at(2) + l) &
                              *net(at(1) + k, at(2) + l, c)
          end do
          position(c) = position(c) + line%values(i, k + 1)*column
        end do
        position(c) = position(c)*secondary%inverse_w(i, j)
      end do
    end associate
  end function point_position

  !> Sum of 3 x 3 control points from (i, j) on with the basis values of two directions.
  pure function blend_quadratic(v, w, n1, n2, i, j, net) result(position)
    integer, intent(in) :: n1, n2, i, j
    real(wp), intent(in) :: v(3), w(3), net(n1, n2, 3)
    real(wp) :: position(3)
    integer :: c

    do c = 1, 3
      position(c) = v(1)*(w(1)*net(i, j, c) + w(2)*net(i, j + 1, c) + w(3)*net(i, j + 2, c)) &
        + v(2)*(w(1)*net(i + 1, j, c) + w(2)*net(i + 1, j + 1, c) + w(3)*net(i + 1, j + 2, c)) &
        + v(3)*(w(1)*net(i + 2, j, c) + w(2)*net(i + 2, j + 1, c) + w(3)*net(i + 2, j + 2, c))
    end do
  end function blend_quadratic

  !> Add the forces of all secondary points to the control points, F_I = sum_p R_I(p) f_p.
  pure subroutine scatter_forces(secondary, forces, net_forces)
    type(secondary_surface_t), intent(in) :: secondary
    real(wp), intent(in) :: forces(secondary%n_along(1), secondary%n_along(2), 3) !! [force]
    real(wp), intent(inout) :: net_forces(secondary%n_net(1), secondary%n_net(2), 3) !! [force]
    real(wp), allocatable :: gathered(:, :, :)

    associate (n => secondary%n_net)
      allocate (gathered(n(1), 3, n(2)))
      call gather_forces(secondary, forces, [1, 1], secondary%n_along, n(1), n(2), gathered)
      call add_gathered(secondary, [1, 1], n, n(1), n(2), gathered, net_forces)
    end associate
  end subroutine scatter_forces

  !> What the forces of a rectangle of points give to the control points that it reaches, for
  !! `add_gathered`.
  pure subroutine gather_forces(secondary, forces, first, last, n1, n2, gathered)
    type(secondary_surface_t), intent(in) :: secondary
    real(wp), intent(in) :: forces(secondary%n_along(1), secondary%n_along(2), 3)   !! [force]
    integer, intent(in) :: first(2), last(2)            !! points of the rectangle
    integer, intent(in) :: n1, n2                       !! room for the control points
    real(wp), intent(out) :: gathered(3*n1, n2)         !! forces without weights, component by
                                                        !! component in each row [force]
    real(wp) :: line(3*n1), force(3)
    integer :: before(2), i, k, at, row
    logical :: is_loaded

    before = [secondary%lines(1)%first(first(1)), secondary%lines(2)%first(first(2))] - 1
    gathered = 0.0_wp
    do row = first(2), last(2)
      is_loaded = .false.
      do i = first(1), last(1)
        force = forces(i, row, :)
        if (all(abs(force) <= 0.0_wp)) cycle   ! not for a NaN
        if (.not. is_loaded) line = 0.0_wp
        is_loaded = .true.
        force = force*secondary%inverse_w(i, row)
        do k = 1, secondary%lines(1)%degree + 1
          at = secondary%lines(1)%first(i) - before(1) + k - 1
          line(at) = line(at) + secondary%lines(1)%values(i, k)*force(1)
          line(at + n1) = line(at + n1) + secondary%lines(1)%values(i, k)*force(2)
          line(at + 2*n1) = line(at + 2*n1) + secondary%lines(1)%values(i, k)*force(3)
        end do
      end do
      if (.not. is_loaded) cycle
      do k = 1, secondary%lines(2)%degree + 1
        at = secondary%lines(2)%first(row) - before(2) + k - 1
        gathered(:, at) = gathered(:, at) + secondary%lines(2)%values(row, k)*line
      end do
    end do
  end subroutine gather_forces

  !> Add what was gathered from a rectangle to the control points `low` to `high`, which may be a
  !! part of the rows that it reaches.
  pure subroutine add_gathered(secondary, low, high, n1, n2, gathered, net_forces)
    type(secondary_surface_t), intent(in) :: secondary
    integer, intent(in) :: low(2), high(2)              !! control points
    integer, intent(in) :: n1, n2                       !! room
    real(wp), intent(in) :: gathered(n1, 3, n2)         !! of row low(2) on [force]
    real(wp), intent(inout) :: net_forces(:, :, :)      !! shape (n_net, 3) [force]
    integer :: i, j, c

    do c = 1, 3
      do j = low(2), high(2)
        do i = low(1), high(1)
          net_forces(i, j, c) = net_forces(i, j, c) + secondary%weights(i, j) &
                                *gathered(i - low(1) + 1, c, j - low(2) + 1)
        end do
      end do
    end do
  end subroutine add_gathered

  !> Share the area of the face out to its points; the sum is the quadrature's area of the face.
  subroutine set_areas(secondary, surface, kinds, n_gauss)
    type(secondary_surface_t), intent(inout) :: secondary
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: kinds(2), n_gauss(2)
    type(area_rule_t) :: rules(2)
    real(wp) :: point(3), d1(3, 2), part
    real(wp), allocatable :: area(:, :)
    integer :: g, h, i, k, l, direction

    allocate (area(secondary%n_along(1), secondary%n_along(2)), source=0.0_wp)
    do direction = 1, 2
      call new_area_rule(rules(direction), surface%axes(direction), kinds(direction), &
                         n_gauss(direction))
    end do
    do h = 1, rules(2)%n
      do g = 1, rules(1)%n
        call evaluate_surface(surface, [rules(1)%xi(g), rules(2)%xi(h)], point, d1)
        part = norm2(cross(d1(:, 1), d1(:, 2)))*rules(1)%weights(g)*rules(2)%weights(h)
        do l = 1, size(rules(2)%fractions, 1)
          k = rules(2)%first(h) + l - 1
          do i = 1, size(rules(1)%fractions, 1)
            associate (a => area(rules(1)%first(g) + i - 1, k))
              a = a + part*rules(1)%fractions(i, g)*rules(2)%fractions(l, h)
            end associate
          end do
        end do
      end do
    end do
    if (any(kinds == points_greville)) call set_exact_areas(secondary, kinds, area)
    secondary%area = reshape(area, [secondary%n_points])
  end subroutine set_areas

  !> Areas of the points of a face with an outline. Each element shares its area inside out to its
  !! points inside, or to all where none is, in proportion to what they have of the whole element.
  !! So points that are mirror images have the same areas: no order of points decides.
  pure function areas_inside(secondary, lines1, lines2, share, regions) result(area)
    type(secondary_surface_t), intent(in) :: secondary
    real(wp), intent(in) :: lines1(:), lines2(:)    !! ends of the elements
    real(wp), intent(in) :: share(:, :)             !! of the elements that is inside
    type(region_t), intent(in) :: regions(:)        !! in the parameters of the face
    real(wp) :: area(secondary%n_along(1), secondary%n_along(2))
    real(wp), parameter :: on_border = 1.0e-7_wp    ! of the sheet; polygons lie off arcs by less
    real(wp) :: whole(size(area, 1), size(area, 2))
    real(wp), dimension(size(share, 1), size(share, 2)) :: total, inside, factor
    logical :: is_in(size(area, 1), size(area, 2))
    integer :: e1(2, size(area, 1)), e2(2, size(area, 2)), i, j

    associate (xi => secondary%lines(1)%xi, eta => secondary%lines(2)%xi)
      is_in = places_inside(regions, lines1, lines2, share, xi, eta, on_border)
      e1 = reshape([(cells_at(lines1, xi(i)), i=1, size(xi))], shape(e1))
      e2 = reshape([(cells_at(lines2, eta(j)), j=1, size(eta))], shape(e2))
    end associate
    whole = reshape(secondary%area, shape(area))
    if (allocated(secondary%whole_area)) whole = reshape(secondary%whole_area, shape(area))
    total = 0.0_wp
    inside = 0.0_wp
    do j = 1, size(area, 2)
      do i = 1, size(area, 1)
        associate (a => e1(:, i), b => e2(:, j))
          associate (own => whole(i, j)*parts_of(lines1(a(1):a(2) + 1), lines2(b(1):b(2) + 1)))
            total(a(1):a(2), b(1):b(2)) = total(a(1):a(2), b(1):b(2)) + own
            if (is_in(i, j)) inside(a(1):a(2), b(1):b(2)) = inside(a(1):a(2), b(1):b(2)) + own
          end associate
        end associate
      end do
    end do
    factor = share
    where (inside > 0.0_wp) factor = share*total/inside
    do j = 1, size(area, 2)
      do i = 1, size(area, 1)
        associate (a => e1(:, i), b => e2(:, j))
          area(i, j) = whole(i, j)*sum( &
            parts_of(lines1(a(1):a(2) + 1), lines2(b(1):b(2) + 1))*factor(a(1):a(2), b(1):b(2)), &
            is_in(i, j) .or. inside(a(1):a(2), b(1):b(2)) <= 0.0_wp)
        end associate
      end do
    end do
  end function areas_inside

  !> Parts of the area of a point that lie in the elements around it, by their lengths.
  pure function parts_of(lines1, lines2) result(parts)
    real(wp), intent(in) :: lines1(:), lines2(:)    !! ends of these elements
    real(wp) :: parts(size(lines1) - 1, size(lines2) - 1)
    integer :: n(2)

    n = shape(parts)
    parts = spread((lines1(2:) - lines1(:n(1)))/(lines1(n(1) + 1) - lines1(1)), 2, n(2)) &
            *spread((lines2(2:) - lines2(:n(2)))/(lines2(n(2) + 1) - lines2(1)), 1, n(1))
  end function parts_of

  !> From the moments of the basis functions to weights of Greville points that integrate all of
  !! them, so that a uniform pressure is one on the control points too. Strong grading may make such
  !! weights negative; then the moments stay, which share the area out but not its moments.
  subroutine set_exact_areas(secondary, kinds, area)
    type(secondary_surface_t), intent(in) :: secondary
    integer, intent(in) :: kinds(2)              !! of the directions
    real(wp), intent(inout) :: area(secondary%n_along(1), secondary%n_along(2))
    real(wp), allocatable :: along(:, :), across(:, :)
    logical :: is_solved(2)

    is_solved = .true.
    along = area
    if (kinds(1) == points_greville) call solve_moments(secondary%lines(1), along, is_solved(1))
    across = transpose(along)
    if (kinds(2) == points_greville) call solve_moments(secondary%lines(2), across, is_solved(2))
    if (all(is_solved) .and. minval(across) > 0.0_wp) area = transpose(across)
  end subroutine set_exact_areas

end module secondary_surface
