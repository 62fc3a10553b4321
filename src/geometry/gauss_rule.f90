!> Gauss-Legendre quadrature on [-1, 1], also split into equal parts.
module gauss_rule
  use kinds, only: wp
  implicit none
  private

  public :: gauss_rule_t, new_gauss_rule

  !> Points and weights on [-1, 1]; the weights sum to 2.
  type :: gauss_rule_t
    integer :: n = 0                        !! number of points
    real(wp), allocatable :: points(:)      !! in rising order, shape (n)
    real(wp), allocatable :: weights(:)     !! shape (n)
  end type gauss_rule_t

contains

  !> Rule with `n_points` Gauss points in each of `n_parts` equal parts of [-1, 1].
  !!
  !! Exact for polynomials up to degree 2*n_points - 1, in each part on its own. A rule split at
  !! the mid-surface follows a stress that has a kink there.
  pure function new_gauss_rule(n_points, n_parts) result(rule)
    integer, intent(in) :: n_points   !! points per part, at least 1
    integer, intent(in) :: n_parts    !! equal parts, at least 1
    type(gauss_rule_t) :: rule
    real(wp) :: points(n_points), weights(n_points)
    integer :: i, last

    call gauss_legendre(n_points, points, weights)
    rule%n = n_points*n_parts
    allocate (rule%points(rule%n), rule%weights(rule%n))
    do i = 1, n_parts
      last = i*n_points
      rule%points(last - n_points + 1:last) = (points + (2*i - 1 - n_parts))/n_parts
      rule%weights(last - n_points + 1:last) = weights/n_parts
    end do
  end function new_gauss_rule

  !> Zeros of the Legendre polynomial of degree n by Newton from their asymptotic positions, and the
  !! weights 2/((1 - x^2) P'(x)^2) (Abramowitz and Stegun, eq. 25.4.29).
  pure subroutine gauss_legendre(n, points, weights)
    integer, intent(in) :: n
    real(wp), intent(out) :: points(n), weights(n)
    real(wp), parameter :: pi = acos(-1.0_wp)
    integer, parameter :: n_newton = 8   ! quadratic convergence: 4 are enough from this start
    real(wp) :: x, p, slope
    integer :: i, k

    do i = 1, (n + 1)/2
      x = cos(pi*(i - 0.25_wp)/(n + 0.5_wp))
      do k = 1, n_newton
        call legendre(n, x, p, slope)
        x = x - p/slope
      end do
      call legendre(n, x, p, slope)
      points(i) = -x
      points(n + 1 - i) = x
      weights(i) = 2/((1 - x**2)*slope**2)
      weights(n + 1 - i) = weights(i)
    end do
  end subroutine gauss_legendre

  !> Legendre polynomial of degree n and its slope by the three-term recurrence, |x| < 1.
  pure subroutine legendre(n, x, p, slope)
    integer, intent(in) :: n
    real(wp), intent(in) :: x
    real(wp), intent(out) :: p, slope
    real(wp) :: before, next
    integer :: k

    before = 1.0_wp
    p = x
    do k = 2, n
      next = ((2*k - 1)*x*p - (k - 1)*before)/k
      before = p
      p = next
    end do
    slope = n*(before - x*p)/(1 - x**2)
  end subroutine legendre

end module gauss_rule
