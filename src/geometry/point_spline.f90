!> Cubic splines through points of a plane, as polygons.
!!
!! The parameter between two points is their distance (chord length). An open spline has no
!! curvature at its ends (natural), a closed one is periodic: C. de Boor, A Practical Guide to
!! Splines, Springer 1978, chapters IV and XII.
module point_spline
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: place_text
  implicit none
  private

  public :: spline_corners

contains

  !> Corners of a polygon along the spline, which holds all points. It lies off the spline by less
  !! than the tolerance. Rejected: points that follow each other in one place, and fewer than two,
  !! of a closed spline three.
  subroutine spline_corners(points, is_closed, tolerance, corners, error)
    real(wp), intent(in) :: points(:, :)      !! shape (2, n), of a closed spline each once
    logical, intent(in) :: is_closed
    real(wp), intent(in) :: tolerance         !! [length], positive
    real(wp), allocatable, intent(out) :: corners(:, :)   !! from the first point; an open one ends
                                                          !! with the last, a closed one before it
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: one = 1.0e-9_wp    ! of the extent, a distance that is none
    real(wp), allocatable :: knots(:, :), lengths(:), bends(:, :)
    integer, allocatable :: n(:)
    integer :: m, i, k, total

    knots = points
    if (is_closed) knots = reshape([points, points(:, 1)], [2, size(points, 2) + 1])
    m = size(knots, 2) - 1
    if (m < merge(3, 1, is_closed)) then
      call fail(error, "a spline through too few points")
      return
    end if
    lengths = norm2(knots(:, 2:) - knots(:, :m), 1)
    i = minloc(lengths, 1)
    if (.not. lengths(i) > one*maxval(maxval(points, 2) - minval(points, 2))) then
      call fail(error, "a spline through "//place_text([knots(:, i), 0.0_wp])//" twice in a row")
      return
    end if
    call find_bends(knots, lengths, is_closed, bends)
    ! The second derivative is linear in between, and a chord is off by h^2/8 of it at most.
    n = [(max(1, ceiling(lengths(i)*sqrt(maxval(norm2(bends(:, i:i + 1), 1))/(8*tolerance)))), &
          i=1, m)]
    allocate (corners(2, sum(n) + merge(0, 1, is_closed)))
    total = 0
    do i = 1, m
      do k = 0, n(i) - 1
        total = total + 1
        corners(:, total) = point_between(knots(:, i:i + 1), lengths(i), bends(:, i:i + 1), &
                                          real(k, wp)/n(i))
      end do
    end do
    if (.not. is_closed) corners(:, total + 1) = knots(:, m + 1)
  end subroutine spline_corners

  !> A point of one span.
  pure function point_between(ends, length, bends, share) result(x)
    real(wp), intent(in) :: ends(2, 2), length, bends(2, 2)
    real(wp), intent(in) :: share             !! of the span, 0 to 1
    real(wp) :: x(2)

    associate (r => 1.0_wp - share, s => share)
      x = r*ends(:, 1) + s*ends(:, 2) &
          + length**2/6.0_wp*((r**3 - r)*bends(:, 1) + (s**3 - s)*bends(:, 2))
    end associate
  end function point_between

  !> Second derivatives by the parameter at the points, so that the first ones are continuous.
  pure subroutine find_bends(knots, lengths, is_closed, bends)
    real(wp), intent(in) :: knots(:, :), lengths(:)
    logical, intent(in) :: is_closed
    real(wp), allocatable, intent(out) :: bends(:, :)    !! shape (2, m + 1)
    real(wp) :: slopes(2, size(lengths))
    integer :: m

    m = size(lengths)
    slopes = (knots(:, 2:) - knots(:, :m))/spread(lengths, 1, 2)
    allocate (bends(2, m + 1), source=0.0_wp)
    if (is_closed) then
      call solve_cyclic(2.0_wp*(cshift(lengths, -1) + lengths), lengths, &
                        6.0_wp*(slopes - cshift(slopes, -1, 2)), bends(:, :m))
      bends(:, m + 1) = bends(:, 1)
    else if (m > 1) then
      bends(:, 2:m) = 6.0_wp*(slopes(:, 2:) - slopes(:, :m - 1))
      call solve_symmetric(2.0_wp*(lengths(:m - 1) + lengths(2:)), lengths(2:m - 1), bends(:, 2:m))
    end if
  end subroutine find_bends

  !> Solve with a symmetric tridiagonal matrix that is dominated by its diagonal.
  pure subroutine solve_symmetric(diagonal, beside, x)
    real(wp), intent(in) :: diagonal(:)       !! shape (n)
    real(wp), intent(in) :: beside(:)         !! shape (n - 1)
    real(wp), intent(inout) :: x(:, :)        !! right sides on entry, shape (any, n)
    real(wp) :: pivots(size(diagonal)), factor
    integer :: i, n

    n = size(diagonal)
    pivots = diagonal
    do i = 2, n
      factor = beside(i - 1)/pivots(i - 1)
      pivots(i) = diagonal(i) - factor*beside(i - 1)
      x(:, i) = x(:, i) - factor*x(:, i - 1)
    end do
    x(:, n) = x(:, n)/pivots(n)
    do i = n - 1, 1, -1
      x(:, i) = (x(:, i) - beside(i)*x(:, i + 1))/pivots(i)
    end do
  end subroutine solve_symmetric

  !> The same where the last row is coupled with the first one, too (by J. Sherman and
  !! W. J. Morrison's formula for a change of rank one).
  pure subroutine solve_cyclic(diagonal, beside, right, x)
    real(wp), intent(in) :: diagonal(:)       !! shape (n), n > 2
    real(wp), intent(in) :: beside(:)         !! of rows i and i + 1, the last one of n and 1
    real(wp), intent(in) :: right(:, :)       !! shape (2, n)
    real(wp), intent(out) :: x(:, :)
    real(wp) :: changed(size(diagonal)), both(3, size(diagonal)), corner, gamma
    integer :: n

    n = size(diagonal)
    corner = beside(n)
    gamma = -diagonal(1)
    changed = diagonal
    changed(1) = diagonal(1) - gamma
    changed(n) = diagonal(n) - corner**2/gamma
    both(:2, :) = right
    both(3, :) = 0.0_wp
    both(3, 1) = gamma
    both(3, n) = corner
    call solve_symmetric(changed, beside(:n - 1), both)
    associate (u => both(3, :), share => (both(:2, 1) + corner/gamma*both(:2, n)) &
               /(1.0_wp + both(3, 1) + corner/gamma*both(3, n)))
      x(1, :) = both(1, :) - share(1)*u
      x(2, :) = both(2, :) - share(2)*u
    end associate
  end subroutine solve_cyclic

end module point_spline
