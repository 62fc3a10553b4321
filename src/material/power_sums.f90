!> Sums over two sets of principal values by their power sums, for `width` points at a time.
!!
!! The sum over i, j of (a_i + t - b_j)^m with principal values a, b without their
!! traces and the third of the difference of those, t, is by the binomial theorem the sum over k of
!! m! p_k(a + t)/k! p_(m-k)(-b)/(m-k)!. Power sums follow from the complete sums
!! h_n = c1 h_(n-1) + c2 h_(n-2) + c3 h_(n-3), h_0 = 1, with the coefficients of the characteristic
!! equation c1 = 3 t, c2 = J2 - 3 t^2, c3 = J3 - t J2 + t^3:
!! p_k = c1 h_(k-1) + 2 c2 h_(k-2) + 3 c3 h_(k-3). Their derivatives are k h_(k-3) by J3,
!! k (h_(k-2) - t h_(k-3)) by J2, k p_(k-1) by t, and those of second order follow likewise from
!! g_n = c1 g_(n-1) + c2 g_(n-2) + c3 g_(n-3) + h_n.
module power_sums
  use kinds, only: wp
  use deviator_lanes, only: lanes, width
  implicit none
  private

  public :: find_series, contract_values, contract_slopes, contract_curvatures

  !> Above it the alternating sums of two transforms lose too many digits.
  integer, parameter, public :: most_of_two = 20

  !> 1/k!.
  real(wp), parameter, public :: inverse_factorials(0:most_of_two) = [ &
    1.0_wp/1.0_wp, 1.0_wp/1.0_wp, 1.0_wp/2.0_wp, 1.0_wp/6.0_wp, 1.0_wp/24.0_wp, 1.0_wp/120.0_wp, &
    1.0_wp/720.0_wp, 1.0_wp/5040.0_wp, 1.0_wp/40320.0_wp, 1.0_wp/362880.0_wp, &
    1.0_wp/3628800.0_wp, 1.0_wp/39916800.0_wp, 1.0_wp/479001600.0_wp, 1.0_wp/6227020800.0_wp, &
    1.0_wp/87178291200.0_wp, 1.0_wp/1307674368000.0_wp, 1.0_wp/20922789888000.0_wp, &
    1.0_wp/355687428096000.0_wp, 1.0_wp/6402373705728000.0_wp, 1.0_wp/121645100408832000.0_wp, &
    1.0_wp/2432902008176640000.0_wp]

  !> Derivatives by J2 and J3 of each transform and by the difference of the means; those of second
  !! order packed, (i, j <= i) at i (i - 1)/2 + j.
  integer, parameter, public :: n_arguments = 5, n_packed = 15

contains

  !> Power sums over k!, from k = 2 on their derivatives by J2 and J3, and from k = 4 on those of
  !! second order, for both transforms side by side.
  pure subroutine find_series(b, m, order, mean, j2, j3, series)
    integer, intent(in) :: b, m, order    !! first point, exponent, order of the derivatives
    real(wp), intent(in) :: mean(lanes), j2(lanes, 2), j3(lanes, 2)
    real(wp), intent(out) :: series(2*width, 6, 0:most_of_two)
    real(wp), dimension(2*width) :: t, c1, c2, c3, h0, h1, h2, h3
    real(wp) :: of_power
    integer :: k, l

    !$omp simd
    do l = 1, width
      t(l) = mean(b + l - 1)
      t(width + l) = 0.0_wp
      c1(l) = 3.0_wp*t(l)
      c1(width + l) = 0.0_wp
      c2(l) = j2(b + l - 1, 1) - 3.0_wp*t(l)**2
      c2(width + l) = j2(b + l - 1, 2)
      c3(l) = j3(b + l - 1, 1) - t(l)*(j2(b + l - 1, 1) - t(l)**2)
      c3(width + l) = j3(b + l - 1, 2)
    end do
    !$omp simd
    do l = 1, 2*width
      h1(l) = 1.0_wp
      h2(l) = 0.0_wp
      h3(l) = 0.0_wp
      series(l, 1, 0) = 3.0_wp
    end do
    do k = 1, m
      of_power = inverse_factorials(k)
      !$omp simd
      do l = 1, 2*width
        h0(l) = c1(l)*h1(l) + (c2(l)*h2(l) + c3(l)*h3(l))
        series(l, 1, k) = of_power*(h0(l) + (c2(l)*h2(l) + 2.0_wp*c3(l)*h3(l)))
        h3(l) = h2(l)
        h2(l) = h1(l)
        h1(l) = h0(l)
      end do
    end do
    if (order > 0) call slope_series(m, t, c1, c2, c3, series)
    if (order > 1) call bend_series(m, t, c1, c2, c3, series)
  end subroutine find_series

  !> First derivatives. The complete sums are found again: to keep them would take longer.
  pure subroutine slope_series(m, t, c1, c2, c3, series)
    integer, intent(in) :: m
    real(wp), intent(in), dimension(2*width) :: t, c1, c2, c3
    real(wp), intent(inout) :: series(2*width, 6, 0:most_of_two)
    real(wp), dimension(2*width) :: h0, h1, h2, h3
    real(wp) :: of_slope
    integer :: k, l

    !$omp simd
    do l = 1, 2*width
      h1(l) = 1.0_wp
      h2(l) = 0.0_wp
      h3(l) = 0.0_wp
    end do
    do k = 2, m
      of_slope = inverse_factorials(k - 1)
      !$omp simd
      do l = 1, 2*width
        series(l, 2, k) = of_slope*(h1(l) - t(l)*h2(l))
        series(l, 3, k) = of_slope*h2(l)
        h0(l) = c1(l)*h1(l) + (c2(l)*h2(l) + c3(l)*h3(l))
        h3(l) = h2(l)
        h2(l) = h1(l)
        h1(l) = h0(l)
      end do
    end do
  end subroutine slope_series

  !> Second derivatives.
  pure subroutine bend_series(m, t, c1, c2, c3, series)
    integer, intent(in) :: m
    real(wp), intent(in), dimension(2*width) :: t, c1, c2, c3
    real(wp), intent(inout) :: series(2*width, 6, 0:most_of_two)
    real(wp), dimension(2*width) :: h0, h1, h2, h3, g0, g1, g2, g3
    real(wp) :: of_slope
    integer :: k, l

    !$omp simd
    do l = 1, 2*width
      h1(l) = 1.0_wp
      h2(l) = 0.0_wp
      h3(l) = 0.0_wp
      g1(l) = 0.0_wp
      g2(l) = 0.0_wp
      g3(l) = 0.0_wp
    end do
    do k = 4, m
      of_slope = inverse_factorials(k - 1)
      !$omp simd
      do l = 1, 2*width
        g0(l) = c1(l)*g1(l) + (c2(l)*g2(l) + (c3(l)*g3(l) + h1(l)))
        series(l, 4, k) = of_slope*(g0(l) - t(l)*(2.0_wp*g1(l) - t(l)*g2(l)))
        series(l, 5, k) = of_slope*(g1(l) - t(l)*g2(l))
        series(l, 6, k) = of_slope*g2(l)
        g3(l) = g2(l)
        g2(l) = g1(l)
        g1(l) = g0(l)
        h0(l) = c1(l)*h1(l) + (c2(l)*h2(l) + c3(l)*h3(l))
        h3(l) = h2(l)
        h2(l) = h1(l)
        h1(l) = h0(l)
      end do
    end do
  end subroutine bend_series

  !> The sum itself over m!.
  pure subroutine contract_values(b, m, series, total)
    integer, intent(in) :: b, m
    real(wp), intent(in) :: series(0:width - 1, 2, 6, 0:most_of_two)
    real(wp), intent(inout) :: total(lanes)
    real(wp) :: sums(0:width - 1)     ! the compiler keeps it in registers
    integer :: k, l

    !$omp simd
    do l = 0, width - 1
      sums(l) = 0.0_wp
    end do
    do k = 0, m
      !$omp simd
      do l = 0, width - 1
        sums(l) = sums(l) + series(l, 1, 1, k)*series(l, 2, 1, m - k)
      end do
    end do
    !$omp simd
    do l = 0, width - 1
      total(b + l) = sums(l)
    end do
  end subroutine contract_values

  !> Its derivatives by the arguments.
  pure subroutine contract_slopes(b, m, series, slope)
    integer, intent(in) :: b, m
    real(wp), intent(in) :: series(0:width - 1, 2, 6, 0:most_of_two)
    real(wp), intent(inout) :: slope(lanes, n_arguments)
    real(wp) :: sums(0:width - 1, n_arguments)
    integer :: k, l

    do k = 1, n_arguments
      !$omp simd
      do l = 0, width - 1
        sums(l, k) = 0.0_wp
      end do
    end do
    do k = 2, m
      !$omp simd
      do l = 0, width - 1
        sums(l, 1) = sums(l, 1) + series(l, 1, 2, k)*series(l, 2, 1, m - k)
        sums(l, 2) = sums(l, 2) + series(l, 1, 3, k)*series(l, 2, 1, m - k)
        sums(l, 3) = sums(l, 3) + series(l, 2, 2, k)*series(l, 1, 1, m - k)
        sums(l, 4) = sums(l, 4) + series(l, 2, 3, k)*series(l, 1, 1, m - k)
      end do
    end do
    do k = 0, m - 1
      !$omp simd
      do l = 0, width - 1
        sums(l, 5) = sums(l, 5) + series(l, 1, 1, k)*series(l, 2, 1, m - 1 - k)
      end do
    end do
    do k = 1, n_arguments
      !$omp simd
      do l = 0, width - 1
        slope(b + l, k) = sums(l, k)
      end do
    end do
  end subroutine contract_slopes

  !> Its second derivatives by them. Those by the mean of the first transform lower the power.
  pure subroutine contract_curvatures(b, m, series, curvature)
    integer, intent(in) :: b, m
    real(wp), intent(in) :: series(0:width - 1, 2, 6, 0:most_of_two)
    real(wp), intent(inout) :: curvature(lanes, n_packed)
    real(wp) :: sums(0:width - 1, n_packed)
    integer :: k, l

    do k = 1, n_packed
      !$omp simd
      do l = 0, width - 1
        sums(l, k) = 0.0_wp
      end do
    end do
    do k = 4, m
      !$omp simd
      do l = 0, width - 1
        sums(l, 1) = sums(l, 1) + series(l, 1, 4, k)*series(l, 2, 1, m - k)
        sums(l, 2) = sums(l, 2) + series(l, 1, 5, k)*series(l, 2, 1, m - k)
        sums(l, 3) = sums(l, 3) + series(l, 1, 6, k)*series(l, 2, 1, m - k)
        sums(l, 6) = sums(l, 6) + series(l, 2, 4, k)*series(l, 1, 1, m - k)
        sums(l, 9) = sums(l, 9) + series(l, 2, 5, k)*series(l, 1, 1, m - k)
        sums(l, 10) = sums(l, 10) + series(l, 2, 6, k)*series(l, 1, 1, m - k)
      end do
    end do
    do k = 2, m - 2
      !$omp simd
      do l = 0, width - 1
        sums(l, 4) = sums(l, 4) + series(l, 1, 2, k)*series(l, 2, 2, m - k)
        sums(l, 5) = sums(l, 5) + series(l, 1, 3, k)*series(l, 2, 2, m - k)
        sums(l, 7) = sums(l, 7) + series(l, 1, 2, k)*series(l, 2, 3, m - k)
        sums(l, 8) = sums(l, 8) + series(l, 1, 3, k)*series(l, 2, 3, m - k)
      end do
    end do
    do k = 2, m - 1
      !$omp simd
      do l = 0, width - 1
        sums(l, 11) = sums(l, 11) + series(l, 1, 2, k)*series(l, 2, 1, m - 1 - k)
        sums(l, 12) = sums(l, 12) + series(l, 1, 3, k)*series(l, 2, 1, m - 1 - k)
        sums(l, 13) = sums(l, 13) + series(l, 2, 2, k)*series(l, 1, 1, m - 1 - k)
        sums(l, 14) = sums(l, 14) + series(l, 2, 3, k)*series(l, 1, 1, m - 1 - k)
      end do
    end do
    do k = 0, m - 2
      !$omp simd
      do l = 0, width - 1
        sums(l, 15) = sums(l, 15) + series(l, 1, 1, k)*series(l, 2, 1, m - 2 - k)
      end do
    end do
    do k = 1, n_packed
      !$omp simd
      do l = 0, width - 1
        curvature(b + l, k) = sums(l, k)
      end do
    end do
  end subroutine contract_curvatures

end module power_sums
