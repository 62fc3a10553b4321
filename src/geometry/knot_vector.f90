!> Open knot vector of one parametric direction, and the B-spline basis that lives on it.
!!
!! Algorithms: L. Piegl and W. Tiller, The NURBS Book, 2nd ed., Springer 1997, A2.1 to A2.3.
module knot_vector
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use failure, only: error_t, fail
  implicit none
  private

  public :: knot_vector_t, new_knot_vector, find_span, basis_derivatives, n_spans, span_table
  public :: greville

  integer, parameter, public :: max_degree = 5   !! highest polynomial degree the code serves

  !> Open knot vector: the first and the last knot are repeated exactly `degree + 1` times.
  type :: knot_vector_t
    integer :: degree = 0               !! polynomial degree p
    integer :: n_basis = 0              !! number of basis functions n
    real(wp), allocatable :: knots(:)   !! non-decreasing, shape (n + p + 1)
  end type knot_vector_t

contains

  !> Take over `knots` after checking that they form an open knot vector of this degree.
  !!
  !! Refused: degree outside 1 to 5, too few knots, decreasing knots, ends that are not repeated
  !! exactly degree + 1 times, interior knots repeated more than degree times, infinities.
  pure subroutine new_knot_vector(kv, degree, knots, error)
    type(knot_vector_t), intent(out) :: kv
    integer, intent(in) :: degree
    real(wp), intent(in) :: knots(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: n, m

    m = size(knots)
    n = m - degree - 1
    if (degree < 1 .or. degree > max_degree) then
      call fail(error, "knot vector: the degree must be 1 to 5")
    else if (.not. all(ieee_is_finite(knots))) then
      call fail(error, "knot vector: knots must be finite numbers")
    else if (n <= degree) then
      call fail(error, "knot vector: needs at least 2*(degree + 1) knots")
    else if (any(knots(2:) < knots(:m - 1))) then
      call fail(error, "knot vector: knots must not decrease")
    else if (knots(1) < knots(degree + 1) .or. knots(n + 1) < knots(m) &
             .or. knots(n) >= knots(n + 1) .or. knots(degree + 1) >= knots(degree + 2)) then
      call fail(error, "knot vector: end knots must be repeated exactly degree + 1 times")
    else if (any(knots(2 + degree:n + degree) <= knots(2:n))) then
      call fail(error, "knot vector: an interior knot may be repeated at most degree times")
    else
      kv = knot_vector_t(degree, n, knots)
    end if
  end subroutine new_knot_vector

  !> Span with knots(span) <= xi < knots(span + 1), by binary search; p + 1 <= span <= n.
  !! The right end belongs to the last span. Outside the range, the nearest span is returned.
  pure integer function find_span(kv, xi) result(span)
    type(knot_vector_t), intent(in) :: kv
    real(wp), intent(in) :: xi   !! parametric coordinate
    integer :: upper, middle

    span = kv%degree + 1
    upper = kv%n_basis + 1
    do while (upper - span > 1)
      middle = (span + upper)/2
      if (xi < kv%knots(middle)) then
        upper = middle
      else
        span = middle
      end if
    end do
  end function find_span

  !> Number of knot spans of positive length: the elements of this direction.
  pure integer function n_spans(kv)
    type(knot_vector_t), intent(in) :: kv

    n_spans = count(kv%knots(kv%degree + 2:kv%n_basis + 1) > kv%knots(kv%degree + 1:kv%n_basis))
  end function n_spans

  !> Spans of positive length in rising order, as `find_span` numbers them.
  pure function span_table(kv) result(spans)
    type(knot_vector_t), intent(in) :: kv
    integer :: spans(n_spans(kv))
    integer :: i

    spans = pack([(i, i=kv%degree + 1, kv%n_basis)], &
                 kv%knots(kv%degree + 2:kv%n_basis + 1) > kv%knots(kv%degree + 1:kv%n_basis))
  end function span_table

  !> Greville abscissae, one for each basis function: the mean of its p interior knots.
  pure function greville(kv) result(xi)
    type(knot_vector_t), intent(in) :: kv
    real(wp) :: xi(kv%n_basis)
    integer :: i

    do i = 1, kv%n_basis
      xi(i) = sum(kv%knots(i + 1:i + kv%degree))/kv%degree
    end do
  end function greville

  !> Values and derivatives of the p + 1 basis functions that do not vanish on `span` (A2.3).
  !! Derivatives above the degree are zero.
  pure subroutine basis_derivatives(kv, span, xi, n_derivatives, values)
    type(knot_vector_t), intent(in) :: kv
    integer, intent(in) :: span            !! from `find_span`
    real(wp), intent(in) :: xi             !! parametric coordinate
    integer, intent(in) :: n_derivatives   !! highest derivative wanted, 0 for values alone
    real(wp), intent(out) :: values(kv%degree + 1, 0:n_derivatives)  !! functions span-p ... span
    real(wp) :: table(0:kv%degree, 0:kv%degree)   ! functions above, knot differences below
    integer :: p, i, j, order
    real(wp) :: left(kv%degree), right(kv%degree), from_below, share

    p = kv%degree
    table(0, 0) = 1.0_wp
    do j = 1, p
      left(j) = xi - kv%knots(span + 1 - j)
      right(j) = kv%knots(span + j) - xi
      from_below = 0.0_wp
      do i = 0, j - 1
        table(j, i) = right(i + 1) + left(j - i)
        share = table(i, j - 1)/table(j, i)
        table(i, j) = from_below + right(i + 1)*share
        from_below = left(j - i)*share
      end do
      table(j, j) = from_below
    end do
    values(:, 0) = table(:, p)
    do order = 1, n_derivatives
      values(:, order) = 0.0_wp
      if (order <= p) call derivative_of_order(p, table, order, values(:, order))
    end do
  end subroutine basis_derivatives

  !> One order of derivatives from the table of A2.3: the functions of degree p - order, raised
  !! degree by degree with N'(i, d) = d*(N(i, d-1)/span(i) - N(i+1, d-1)/span(i+1)), eq. (2.7).
  pure subroutine derivative_of_order(p, table, order, values)
    integer, intent(in) :: p, order
    real(wp), intent(in) :: table(0:p, 0:p)
    real(wp), intent(out) :: values(0:p)
    real(wp) :: quotient(0:p - 1)
    integer :: degree

    values(0:p - order) = table(0:p - order, p - order)
    do degree = p - order + 1, p
      quotient(:degree - 1) = degree*values(:degree - 1)/table(degree, :degree - 1)
      values(0) = -quotient(0)
      values(1:degree - 1) = quotient(:degree - 2) - quotient(1:degree - 1)
      values(degree) = quotient(degree - 1)
    end do
  end subroutine derivative_of_order

end module knot_vector
