!> Exponential, logarithm and power of a row of numbers, and whether they are numbers, in loops that
!! vectorise as no library call would.
module row_functions
  use kinds, only: wp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none
  private

  public :: exp_row, exp_multiple, log_row, log_near, power_row, power_small, power_near, &
            inverse_root, are_numbers

  real(wp), parameter, public :: short_exponent = 2.0e-3_wp   !! largest |x| of a short exp(x)

  real(wp), parameter, public :: small_part = 1.0e-2_wp       !! largest |x| of `power_small`

  real(wp), parameter, public :: near_part = 5.0e-2_wp        !! of `power_near` and `log_near`

  ! ln 2 in two parts: multiples of the first are exact.
  real(wp), parameter :: ln2_high = 6.93147180369123816490e-1_wp
  real(wp), parameter :: ln2_low = 1.90821492927058770002e-10_wp

  ! A number so large that its last bit counts one, and the bits of it and of sqrt(1/2).
  real(wp), parameter :: large = 1.5_wp*2.0_wp**52
  integer(int64), parameter :: bits_of_large = int(z'4338000000000000', int64)
  integer(int64), parameter :: bits_of_root = int(z'3FE6A09E667F3BCD', int64)
  integer(int64), parameter :: bias = 1023_int64, mantissa = int(z'000FFFFFFFFFFFFF', int64)

contains

  !> exp(factor x), with a relative error below 5e-16; outside -708 to 709 it is that of the bound.
  !! factor x = k ln 2 + r with |r| <= ln(2)/2 and the Taylor polynomial of degree 12 in r.
  !! k added to a number so large that its last bit counts one stands in the bits of the sum: a
  !! conversion to integers would do, but AVX2 has none.
  pure subroutine exp_row(n, factor, x, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: factor, x(n)
    real(wp), intent(out) :: values(n)
    real(wp), parameter :: per_ln2 = 1.4426950408889634074_wp
    real(wp) :: r, r2, r4, k, bounded, polynomial
    integer :: l

    !$omp simd private(r, r2, r4, k, bounded, polynomial)
    do l = 1, n
      bounded = min(max(factor*x(l), -708.0_wp), 709.0_wp)
      k = (bounded*per_ln2 + large) - large
      r = (bounded - k*ln2_high) - k*ln2_low
      r2 = r*r
      r4 = r2*r2
      polynomial = ((1.0_wp/3628800 + r*(1.0_wp/39916800) + r2*(1.0_wp/479001600))*r2 &
                    + (1.0_wp/40320 + r*(1.0_wp/362880)))*(r4*r4) &
                   + (((1.0_wp/720 + r*(1.0_wp/5040))*r2 + (1.0_wp/24 + r*(1.0_wp/120)))*r4 &
                      + ((0.5_wp + r*(1.0_wp/6))*r2 + (1.0_wp + r)))
      ! Two to the power k, by its bits.
      values(l) = polynomial*transfer(ishft(transfer(k + large, 1_int64) + 1023_int64, 52), 1.0_wp)
    end do
  end subroutine exp_row

  !> exp(factor x) where `largest` bounds all |x|: for |factor x| <= 2e-3 the Taylor polynomial of
  !! degree 5, whose relative error stays below 1e-19.
  pure subroutine exp_multiple(n, factor, largest, x, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: factor, largest, x(n)
    real(wp), intent(out) :: values(n)
    real(wp), parameter :: c3 = 1.0_wp/6, c4 = 1.0_wp/24, c5 = 1.0_wp/120
    real(wp) :: y
    integer :: l

    if (abs(factor)*largest <= short_exponent) then
      !$omp simd private(y)
      do l = 1, n
        y = factor*x(l)
        values(l) = 1.0_wp + y*(1.0_wp + y*(0.5_wp + y*(c3 + y*(c4 + y*c5))))
      end do
    else
      call exp_row(n, factor, x, values)
    end if
  end subroutine exp_multiple

  !> ln(x), for positive normal numbers: x = 2^k (1 + f) with 1 + f between sqrt(1/2) and
  !! sqrt(2), and the series of 2 artanh(f/(2 + f)) up to the power 21. Relative error below 1e-15,
  !! absolute error below 3e-16 next to x = 1.
  !! k stands in the exponent of x; as above it goes through the bits of a large number.
  pure subroutine log_row(n, x, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n)
    real(wp), intent(out) :: values(n)
    integer(int64) :: bits
    real(wp) :: k, f, s, z, series
    integer :: l

    !$omp simd private(bits, k, f, s, z, series)
    do l = 1, n
      ! One for a mantissa below sqrt(1/2)*2 carries over into the exponent.
      bits = transfer(x(l), 1_int64) + (ishft(bias, 52) - bits_of_root)
      k = transfer(bits_of_large + (ishft(bits, -52) - bias), 1.0_wp) - large
      f = transfer(iand(bits, mantissa) + bits_of_root, 1.0_wp) - 1.0_wp
      s = f/(2.0_wp + f)
      z = s*s
      series = z*(1.0_wp/3 + z*(1.0_wp/5 + z*(1.0_wp/7 + z*(1.0_wp/9 + z*(1.0_wp/11 &
               + z*(1.0_wp/13 + z*(1.0_wp/15 + z*(1.0_wp/17 + z*(1.0_wp/19 + z*(1.0_wp/21))))))))))
      values(l) = k*ln2_high + (2.0_wp*s + (2.0_wp*s*series + k*ln2_low))
    end do
  end subroutine log_row

  !> x becomes x to a power, for positive normal numbers. The relative error is that of the two
  !! functions above times the logarithm of the result.
  pure subroutine power_row(n, exponent, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: exponent
    real(wp), intent(inout) :: x(n)
    real(wp) :: logarithms(n)

    call log_row(n, x, logarithms)
    call exp_row(n, exponent, logarithms, x)
  end subroutine power_row

  !> x becomes 1 + x to a power from -1 to 1, for |x| <= small_part: the binomial series up to the
  !! seventh power, whose relative error stays below 1e-16.
  pure subroutine power_small(n, exponent, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: exponent
    real(wp), intent(inout) :: x(n)
    real(wp) :: c(7)
    integer :: l

    c = binomials(7, exponent)
    !$omp simd
    do l = 1, n
      x(l) = 1.0_wp + x(l)*(c(1) + x(l)*(c(2) + x(l)*(c(3) + x(l)*(c(4) + x(l)*(c(5) + x(l)*(c(6) &
                                                                            + x(l)*c(7)))))))
    end do
  end subroutine power_small

  !> Multiples of such powers for |x| <= near_part, by the series up to the twelfth power.
  pure subroutine power_near(n, exponent, factor, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: exponent, factor(n)
    real(wp), intent(inout) :: x(n)
    real(wp) :: c(12)
    integer :: l

    c = binomials(12, exponent)
    !$omp simd
    do l = 1, n
      x(l) = factor(l)*(1.0_wp + x(l)*(c(1) + x(l)*(c(2) + x(l)*(c(3) + x(l)*(c(4) + x(l)*(c(5) &
             + x(l)*(c(6) + x(l)*(c(7) + x(l)*(c(8) + x(l)*(c(9) + x(l)*(c(10) + x(l)*(c(11) &
                                                                         + x(l)*c(12)))))))))))))
    end do
  end subroutine power_near

  !> Coefficients of the first powers in the binomial series.
  pure function binomials(n, exponent) result(c)
    integer, intent(in) :: n
    real(wp), intent(in) :: exponent
    real(wp) :: c(n)
    integer :: k

    c(1) = exponent
    do k = 2, n
      c(k) = c(k - 1)*(exponent - (k - 1))/k
    end do
  end function binomials

  !> x becomes ln(1 + x), for |x| <= near_part: the Taylor polynomial of degree 12, whose error
  !! stays below 2e-17 of x.
  pure subroutine log_near(n, x)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n)
    real(wp), parameter :: c3 = 1.0_wp/3, c5 = 1.0_wp/5, c6 = 1.0_wp/6, c7 = 1.0_wp/7, &
      c9 = 1.0_wp/9, c10 = 1.0_wp/10, c11 = 1.0_wp/11, c12 = 1.0_wp/12
    integer :: l

    !$omp simd
    do l = 1, n
      x(l) = x(l)*(1.0_wp - x(l)*(0.5_wp - x(l)*(c3 - x(l)*(0.25_wp - x(l)*(c5 - x(l)*(c6 &
             - x(l)*(c7 - x(l)*(0.125_wp - x(l)*(c9 - x(l)*(c10 - x(l)*(c11 - x(l)*c12)))))))))))
    end do
  end subroutine log_near

  !> x^(-1/m) for m = 6 and 8 and positive normal numbers. The start from short series of logarithm
  !! and exponential is good to 2e-3, and each of the two steps leaves (m + 1) (2 m + 1)/6 times
  !! the cube of the error.
  pure subroutine inverse_root(n, m, x, root)
    integer, intent(in) :: n, m
    real(wp), intent(in) :: x(n)
    real(wp), intent(out) :: root(n)
    real(wp), parameter :: per_ln2 = 1.4426950408889634074_wp
    real(wp) :: k, f, z, y, y2, y4, h, per_m
    integer(int64) :: bits
    integer :: l, step

    per_m = 1.0_wp/m
    !$omp simd private(bits, k, f, z, y, y2, y4, h, step)
    do l = 1, n
      ! As in `log_row` and `raise_e`.
      bits = transfer(x(l), 1_int64) + (ishft(bias, 52) - bits_of_root)
      k = transfer(bits_of_large + (ishft(bits, -52) - bias), 1.0_wp) - large
      f = transfer(iand(bits, mantissa) + bits_of_root, 1.0_wp) - 1.0_wp
      z = -per_m*(k + per_ln2*f*(1.0_wp - f*(0.5_wp - f*(1.0_wp/3))))
      k = (z + large) - large
      z = z - k
      y = (1.0_wp + z*(0.69315_wp + z*(0.24023_wp + z*0.05550_wp))) &
          *transfer(ishft(transfer(k + large, 1_int64) + 1023_int64, 52), 1.0_wp)
      do step = 1, 2
        y2 = y*y
        y4 = y2*y2
        h = (1.0_wp - x(l)*y4*merge(y4, y2, m == 8))*per_m
        y = y + y*h*(1.0_wp + 0.5_wp*(m + 1)*h)
      end do
      root(l) = y
    end do
  end subroutine inverse_root

  !> Are all values numbers, and is their sum finite? A largest value would pass over a NaN.
  pure logical function are_numbers(n, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n)
    real(wp) :: total
    integer :: l

    total = 0.0_wp
    !$omp simd reduction(+:total)
    do l = 1, n
      total = total + x(l)
    end do
    are_numbers = abs(total) <= huge(total)
  end function are_numbers

end module row_functions
