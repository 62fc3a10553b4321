!> Slave points along one parametric direction: places, basis values, shares of the area.
module slave_line
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, find_span, basis_derivatives, span_table, n_spans, greville
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  implicit none
  private

  public :: slave_line_t, area_rule_t, new_slave_line, new_line_at, new_area_rule, solve_moments

  integer, parameter, public :: points_gauss = 1      !! Gauss points of each element
  integer, parameter, public :: points_knot = 2       !! the distinct knots
  integer, parameter, public :: points_greville = 3   !! Greville abscissae, one a control point

  !> One-dimensional basis table: the functions first(i) ... first(i) + p do not vanish at point i.
  type :: slave_line_t
    integer :: n_points = 0
    integer :: n_net = 0                     !! control points n
    integer :: degree = 0                    !! polynomial degree p
    real(wp), allocatable :: xi(:)           !! parametric coordinates, rising, shape (n_points)
    integer, allocatable :: first(:)         !! shape (n_points)
    real(wp), allocatable :: values(:, :)    !! shape (n_points, p + 1)
    integer, allocatable :: lowest(:)        !! first point in the support of function I, shape (n)
    integer, allocatable :: highest(:)       !! last point in the support of function I, shape (n)
  end type slave_line_t

  !> Quadrature along the direction, and how each quadrature point's area goes to slave points
  !! first(g), first(g) + 1, ... The shares of a quadrature point sum to one.
  type :: area_rule_t
    integer :: n = 0                         !! number of quadrature points
    real(wp), allocatable :: xi(:)           !! parametric coordinates, shape (n)
    real(wp), allocatable :: weights(:)      !! in parameter space, shape (n)
    integer, allocatable :: first(:)         !! shape (n)
    real(wp), allocatable :: shares(:, :)    !! shape (n_shares, n)
  end type area_rule_t

contains

  !> Basis table of the slave points of a direction.
  pure subroutine new_slave_line(line, axis, kind, n_gauss)
    type(slave_line_t), intent(out) :: line
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
  end subroutine new_slave_line

  !> Basis table of any points.
  pure subroutine new_line_at(line, axis, xi)
    type(slave_line_t), intent(out) :: line
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
    call find_supports(line)
  end subroutine new_line_at

  !> Quadrature that shares the area of a face out to its slave points, so that nothing is lost:
  !! Gauss points keep their own, knots take it by hat functions, Greville points by the basis
  !! functions they belong to (row sums, which `solve_moments` turns into weights).
  pure subroutine new_area_rule(rule, axis, kind, n_gauss)
    type(area_rule_t), intent(out) :: rule
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: kind, n_gauss   !! as for `new_slave_line`
    type(gauss_rule_t) :: gauss
    integer, allocatable :: spans(:)
    integer :: element, i, n
    real(wp) :: half, place

    allocate (spans, source=span_table(axis))
    gauss = new_gauss_rule(merge(n_gauss, axis%degree + 1, kind == points_gauss), 1)
    rule%n = gauss%n*size(spans)
    rule%xi = gauss_places(axis, gauss%n)
    n = merge(1, merge(2, axis%degree + 1, kind == points_knot), kind == points_gauss)
    allocate (rule%weights(rule%n), rule%first(rule%n), rule%shares(n, rule%n))
    n = 0
    do element = 1, size(spans)
      half = 0.5_wp*(axis%knots(spans(element) + 1) - axis%knots(spans(element)))
      do i = 1, gauss%n
        n = n + 1
        place = 0.5_wp*(1.0_wp + gauss%points(i))
        rule%weights(n) = half*gauss%weights(i)
        select case (kind)
        case (points_gauss)
          rule%first(n) = n
          rule%shares(:, n) = 1.0_wp
        case (points_knot)
          rule%first(n) = element
          rule%shares(:, n) = [1.0_wp - place, place]
        case default
          rule%first(n) = spans(element) - axis%degree
          call basis_derivatives(axis, spans(element), rule%xi(n), 0, rule%shares(:, n))
        end select
      end do
    end do
  end subroutine new_area_rule

  !> Weights of Greville points from the moments b_I = integral of N_I: sum_p N_I(xi_p) a_p = b_I,
  !! for several columns. The matrix is banded and totally positive, so elimination needs no pivots
  !! (C. de Boor, A Practical Guide to Splines, rev. ed., Springer 2001, ch. XIII).
  pure subroutine solve_moments(line, columns)
    type(slave_line_t), intent(in) :: line         !! of Greville points
    real(wp), intent(inout) :: columns(:, :)       !! moments in, weights out, shape (n_points, m)
    real(wp) :: band(-line%degree:line%degree, line%n_points), factor
    integer :: i, j, p, n, d

    n = line%n_points
    d = line%degree
    band = 0.0_wp
    do p = 1, n
      do i = line%first(p), line%first(p) + d
        if (abs(p - i) <= d) band(p - i, i) = line%values(p, i - line%first(p) + 1)
      end do
    end do
    do j = 1, n
      do i = j + 1, min(j + d, n)
        factor = band(j - i, i)/band(0, j)
        do p = j, min(j + d, n)
          band(p - i, i) = band(p - i, i) - factor*band(p - j, j)
        end do
        columns(i, :) = columns(i, :) - factor*columns(j, :)
      end do
    end do
    do j = n, 1, -1
      do p = j + 1, min(j + d, n)
        columns(j, :) = columns(j, :) - band(p - j, j)*columns(p, :)
      end do
      columns(j, :) = columns(j, :)/band(0, j)
    end do
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

  !> Points in the support of each control point; `lowest > highest` where there are none.
  pure subroutine find_supports(line)
    type(slave_line_t), intent(inout) :: line
    integer :: i, last

    allocate (line%lowest(line%n_net), line%highest(line%n_net))
    line%lowest = line%n_points + 1
    line%highest = 0
    do i = 1, line%n_points
      last = line%first(i) + line%degree
      line%lowest(line%first(i):last) = min(line%lowest(line%first(i):last), i)
      line%highest(line%first(i):last) = max(line%highest(line%first(i):last), i)
    end do
  end subroutine find_supports

end module slave_line
