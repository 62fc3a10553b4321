!> Any B-spline curves over part of their range as curves of open knots: knots of CAD files need
!! not be repeated at their ends, and a curve may begin and end inside of them.
module knot_range
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use failure, only: error_t, fail
  use knot_vector, only: knot_vector_t, new_knot_vector, max_degree
  implicit none
  private

  public :: cut_to_range

  real(wp), parameter :: same_knot = 1.0e-12_wp   ! part of the range below which knots are one

contains

  !> Cut curves side by side down to a range; in it they stay what they are, by knot insertion
  !! (W. Boehm, Computer-Aided Design 12 (1980) 199-201). Open knots over their whole range come
  !! back untouched.
  !!
  !! Refused: degrees outside 1 to 5, knots that decrease or are not finite, counts that do not
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
    real(wp) :: ends(2)
    integer :: first, last, n

    n = size(rows, 1)
    is_same = .false.
    ends = [low, high]
    call check(degree, knots, n, ends, error)
    if (allocated(error)) return
    u = knots
    call join_close_knots(u, ends, same_knot*(knots(n + 1) - knots(degree + 1)))
    if (.not. ends(1) < ends(2)) then
      call fail(error, "knot vector: a range without length")
      return
    end if
    call repeat_knot(degree, ends(1), u, rows)
    call repeat_knot(degree, ends(2), u, rows)
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

  !> Knots that differ by round-off are one, and so are ends of the range and knots.
  pure subroutine join_close_knots(knots, ends, tolerance)
    real(wp), intent(inout) :: knots(:)
    real(wp), intent(inout) :: ends(2)
    real(wp), intent(in) :: tolerance
    integer :: i, nearest

    do i = 2, size(knots)
      if (knots(i) - knots(i - 1) <= tolerance) knots(i) = knots(i - 1)
    end do
    do i = 1, 2
      nearest = minloc(abs(knots - ends(i)), 1)
      if (abs(knots(nearest) - ends(i)) <= tolerance) ends(i) = knots(nearest)
    end do
  end subroutine join_close_knots

  !> Insert a knot until it is there as often as the degree says.
  pure subroutine repeat_knot(degree, knot, knots, rows)
    integer, intent(in) :: degree
    real(wp), intent(in) :: knot
    real(wp), allocatable, intent(inout) :: knots(:), rows(:, :)
    real(wp), allocatable :: more(:, :)
    real(wp) :: share
    integer :: below, multiplicity, i, n

    multiplicity = count(abs(knots - knot) <= 0.0_wp)
    do while (multiplicity < degree)
      n = size(rows, 1)
      below = count(knots <= knot)
      allocate (more(n + 1, size(rows, 2)))
      do i = 1, n + 1
        if (i <= below - degree) then
          more(i, :) = rows(i, :)
        else if (i > below - multiplicity) then
          more(i, :) = rows(i - 1, :)
        else
          share = (knot - knots(i))/(knots(i + degree) - knots(i))
          more(i, :) = share*rows(i, :) + (1.0_wp - share)*rows(i - 1, :)
        end if
      end do
      knots = [knots(:below), knot, knots(below + 1:)]
      call move_alloc(more, rows)
      multiplicity = multiplicity + 1
    end do
  end subroutine repeat_knot

end module knot_range
