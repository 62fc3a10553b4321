!> Open knot vector of one parametric direction, and the B-spline basis on it.
!!
!! Algorithms: L. Piegl and W. Tiller, The NURBS Book, 2nd ed., Springer 1997, A2.1 to A2.3.
!! Knots of CAD files need not be repeated at their ends, and a curve may begin and end inside of
!! them: `cut_to_range` makes open ones of these.
module knot_vector
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use failure, only: error_t, fail
  implicit none
  private

  public :: knot_vector_t, new_knot_vector, find_span, basis_derivatives, n_spans, span_table, &
            breaks, &
            greville, cut_to_range, insert_knot, linear_axis, constant_axis

  integer, parameter, public :: max_degree = 5   !! highest polynomial degree the code serves

  !> Open knot vector: the first and the last knot are repeated exactly `degree + 1` times.
  type :: knot_vector_t
    integer :: degree = 0               !! polynomial degree p
    integer :: n_basis = 0              !! number of basis functions n
    real(wp), allocatable :: knots(:)   !! non-decreasing, shape (n + p + 1)
  end type knot_vector_t

  real(wp), parameter :: same_knot = 1.0e-12_wp   ! part of the range below which knots are one

contains

  !> Take over `knots` after checking that they form an open knot vector of this degree.
  !!
  !! Rejected: degree outside 1 to 5, too few knots, decreasing knots, ends that are not repeated
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

  !> One element of degree 1 over [0, 1].
  pure function linear_axis() result(kv)
    type(knot_vector_t) :: kv

    kv = knot_vector_t(1, 2, [0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp])
  end function linear_axis

  !> One element of degree 0 over [0, 1]: the axis across a mid-surface.
  pure function constant_axis() result(kv)
    type(knot_vector_t) :: kv

    kv = knot_vector_t(0, 1, [0.0_wp, 1.0_wp])
  end function constant_axis

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

  !> Knots that differ, rising: the ends of the elements.
  pure function breaks(kv) result(knots)
    type(knot_vector_t), intent(in) :: kv
    real(wp) :: knots(n_spans(kv) + 1)

    knots = [kv%knots(span_table(kv)), kv%knots(size(kv%knots))]
  end function breaks

  !> Spans of positive length in rising order, as `find_span` numbers them.
  pure function span_table(kv) result(spans)
    type(knot_vector_t), intent(in) :: kv
    integer :: spans(n_spans(kv))
    integer :: i

    spans = pack([(i, i=kv%degree + 1, kv%n_basis)], &
                 kv%knots(kv%degree + 2:kv%n_basis + 1) > kv%knots(kv%degree + 1:kv%n_basis))
  end function span_table

  !> Greville abscissae, one for each basis function: the mean of its p interior knots; of degree 0
  !! the middle of its element.
  pure function greville(kv) result(xi)
    type(knot_vector_t), intent(in) :: kv
    real(wp) :: xi(kv%n_basis)
    integer :: i

    do i = 1, kv%n_basis
      if (kv%degree == 0) xi(i) = 0.5_wp*(kv%knots(i) + kv%knots(i + 1))
      if (kv%degree > 0) xi(i) = sum(kv%knots(i + 1:i + kv%degree))/kv%degree
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
    real(wp) :: left(kv%degree), right(kv%degree), from_below, fraction

    p = kv%degree
    table(0, 0) = 1.0_wp
    do j = 1, p
      left(j) = xi - kv%knots(span + 1 - j)
      right(j) = kv%knots(span + j) - xi
      from_below = 0.0_wp
      do i = 0, j - 1
        table(j, i) = right(i + 1) + left(j - i)
        fraction = table(i, j - 1)/table(j, i)
        table(i, j) = from_below + right(i + 1)*fraction
        from_below = left(j - i)*fraction
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

  !> Cut curves side by side down to a range; in it they stay what they are, by knot insertion
  !! (W. Boehm, Computer-Aided Design 12 (1980) 199-201). Open knots over their whole range come
  !! back untouched.
  !!
  !! Rejected: degrees outside 1 to 5, knots that decrease or are not finite, counts that do not
  !! fit, a range without length or outside of the knots, inner knots repeated more than degree
  !! times.
  subroutine cut_to_range(axis, degree, knots, low, high, rows, is_same, error)
    type(knot_vector_t), intent(out) :: axis
    integer, intent(in) :: degree
    real(wp), intent(in) :: knots(:)                      !! shape (n + degree + 1)
    real(wp), intent(in) :: low, high                     !! the range
    real(wp), allocatable, intent(inout) :: rows(:, :)    !! control points, shape (n, components)
    logical, intent(out) :: is_same                       !! the control points are as they were
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: u(:)
    real(wp) :: ends(2), tolerance
    integer :: first, last, nearest, i, n

    n = size(rows, 1)
    is_same = .false.
    ends = [low, high]
    call check(degree, knots, n, ends, error)
    if (allocated(error)) return
    u = knots
    tolerance = same_knot*(knots(n + 1) - knots(degree + 1))
    do i = 2, size(u)      ! knots that differ by round-off are one, and so are ends and knots
      if (u(i) - u(i - 1) <= tolerance) u(i) = u(i - 1)
    end do
    do i = 1, 2
      nearest = minloc(abs(u - ends(i)), 1)
      if (abs(u(nearest) - ends(i)) <= tolerance) ends(i) = u(nearest)
    end do
    if (.not. ends(1) < ends(2)) then
      call fail(error, "knot vector: a range without length")
      return
    end if
    do i = 1, 2
      do while (count(u <= ends(i)) - count(u < ends(i)) < degree)
        call insert_knot(degree, ends(i), u, rows)
      end do
    end do
    first = count(u <= ends(1))       ! the last knot of the beginning
    last = count(u < ends(2)) + 1     ! the first knot of the end
    is_same = size(rows, 1) == n .and. first == degree + 1 .and. last == n + 1
    if (.not. is_same) rows = rows(first - degree:last - 1, :)
    u = [spread(ends(1), 1, degree + 1), u(first + 1:last - 1), spread(ends(2), 1, degree + 1)]
    call new_knot_vector(axis, degree, u, error)
  end subroutine cut_to_range

  pure subroutine check(degree, knots, n, ends, error)
    integer, intent(in) :: degree, n
    real(wp), intent(in) :: knots(:)
    real(wp), intent(inout) :: ends(2)   !! moved onto the ends of the knots if they are beyond them
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: tolerance

    if (degree < 1 .or. degree > max_degree) then
      call fail(error, "knot vector: the degree must be 1 to 5")
    else if (n <= degree .or. size(knots) /= n + degree + 1) then
      call fail(error, "knot vector: needs as many knots as control points and degree + 1 more")
    else if (.not. all(ieee_is_finite(knots)) .or. .not. all(ieee_is_finite(ends))) then
      call fail(error, "knot vector: knots must be finite numbers")
    else if (any(knots(2:) < knots(:n + degree))) then
      call fail(error, "knot vector: knots must not decrease")
    else if (.not. has_range(knots(degree + 1), knots(n + 1))) then
      call fail(error, "knot vector: knots without a range")
    else
      tolerance = 1.0e-6_wp*(knots(n + 1) - knots(degree + 1))
      if (ends(1) < knots(degree + 1) - tolerance .or. ends(2) > knots(n + 1) + tolerance) then
        call fail(error, "knot vector: a range that reaches beyond the knots")
      end if
      ends = [max(ends(1), knots(degree + 1)), min(ends(2), knots(n + 1))]
    end if
  end subroutine check

  !> Is there room between two knots, of a size that can be reckoned with?
  pure logical function has_range(low, high)
    real(wp), intent(in) :: low, high
    real(wp), parameter :: largest = 1.0e30_wp, least = 1.0e-9_wp

    has_range = max(abs(low), abs(high)) < largest .and. high - low > 1.0_wp/largest &
                .and. high - low > least*max(abs(low), abs(high))
  end function has_range

  !> Insert a knot into curves side by side by Boehm's rule (The NURBS Book, eq. 5.11 and 5.15):
  !! only averages, so it is stable.
  pure subroutine insert_knot(degree, knot, knots, rows)
    integer, intent(in) :: degree
    real(wp), intent(in) :: knot                            !! there fewer than `degree` times
    real(wp), allocatable, intent(inout) :: knots(:)        !! shape (n + degree + 1)
    real(wp), allocatable, intent(inout) :: rows(:, :)      !! shape (n, components)
    real(wp), allocatable :: more(:, :)
    real(wp) :: fraction
    integer :: first, last, i

    last = count(knots < knot)
    first = count(knots <= knot) - degree + 1
    allocate (more(size(rows, 1) + 1, size(rows, 2)))
    more(:first - 1, :) = rows(:first - 1, :)
    do i = first, last
      fraction = (knot - knots(i))/(knots(i + degree) - knots(i))
      more(i, :) = rows(i - 1, :) + fraction*(rows(i, :) - rows(i - 1, :))
    end do
    more(last + 1:, :) = rows(last:, :)
    knots = [knots(:last), knot, knots(last + 1:)]
    call move_alloc(more, rows)
  end subroutine insert_knot

end module knot_vector
