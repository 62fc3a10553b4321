!> The exponential function of a row of numbers.
module fast_exponential
  use kinds, only: wp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none
  private

  public :: exp_nonpositive, exp_small

  real(wp), parameter, public :: small_exponent = 2.0e-3_wp   !! largest |x| of `exp_small`

contains

  !> x becomes exp(x), for x <= 0, in a loop that vectorises as no library call would:
  !! x = k ln 2 + r with |r| <= ln(2)/2 and the Taylor polynomial of degree 12 in r.
  !! Relative error below 5e-16; values below exp(-708) become exp(-708).
  !! k added to a number so large that its last bit counts one stands in the bits of the sum: a
  !! conversion to integers would do, but AVX2 has none.
  pure subroutine exp_nonpositive(n, x)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n)
    real(wp), parameter :: per_ln2 = 1.4426950408889634074_wp
    real(wp), parameter :: ln2_high = 6.93147180369123816490e-1_wp
    real(wp), parameter :: ln2_low = 1.90821492927058770002e-10_wp
    real(wp), parameter :: large = 1.5_wp*2.0_wp**52
    real(wp) :: r, r2, r4, k, bounded, polynomial
    integer :: l

    !$omp simd private(r, r2, r4, k, bounded, polynomial)
    do l = 1, n
      bounded = max(x(l), -708.0_wp)
      k = aint(bounded*per_ln2 - 0.5_wp)
      r = (bounded - k*ln2_high) - k*ln2_low
      r2 = r*r
      r4 = r2*r2
      polynomial = ((1.0_wp/3628800 + r*(1.0_wp/39916800) + r2*(1.0_wp/479001600))*r2 &
                    + (1.0_wp/40320 + r*(1.0_wp/362880)))*(r4*r4) &
                   + (((1.0_wp/720 + r*(1.0_wp/5040))*r2 + (1.0_wp/24 + r*(1.0_wp/120)))*r4 &
                      + ((0.5_wp + r*(1.0_wp/6))*r2 + (1.0_wp + r)))
      ! Two to the power k, by its bits.
      x(l) = polynomial*transfer(ishft(transfer(k + large, 1_int64) + 1023_int64, 52), 1.0_wp)
    end do
  end subroutine exp_nonpositive

  !> x becomes exp(x), for |x| <= small_exponent: the Taylor polynomial of degree 5, whose relative
  !! error stays below 1e-19.
  pure subroutine exp_small(n, x)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n)
    real(wp), parameter :: c3 = 1.0_wp/6, c4 = 1.0_wp/24, c5 = 1.0_wp/120
    integer :: l

    !$omp simd
    do l = 1, n
      x(l) = 1.0_wp + x(l)*(1.0_wp + x(l)*(0.5_wp + x(l)*(c3 + x(l)*(c4 + x(l)*c5))))
    end do
  end subroutine exp_small

end module fast_exponential
