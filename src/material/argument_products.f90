!> Derivatives by the stress from those by arguments that depend on it: sums of their gradients and
!! of the products of those, for `width` points at a time.
module argument_products
  use kinds, only: wp
  use deviator_lanes, only: lanes, width
  use power_sums, only: n_arguments, n_packed
  implicit none
  private

  public :: combine, set_products

contains

  !> Sum of two or five vectors times coefficients.
  pure subroutine combine(b, n, places, c, vectors, total)
    integer, intent(in) :: b, n                        !! first point, vectors
    integer, intent(in) :: places(n_arguments)         !! where the coefficients stand
    real(wp), intent(in) :: c(lanes, *), vectors(lanes, 5, n_arguments)
    real(wp), intent(inout) :: total(lanes, 5)
    integer :: i, l, c1, c2, c3, c4, c5

    c1 = places(1); c2 = places(2); c3 = places(3); c4 = places(4); c5 = places(5)
    if (n == 2) then
      do i = 1, 5
        !$omp simd
        do l = b, b + width - 1
          total(l, i) = c(l, c1)*vectors(l, i, 1) + c(l, c2)*vectors(l, i, 2)
        end do
      end do
    else
      do i = 1, 5
        !$omp simd
        do l = b, b + width - 1
          total(l, i) = c(l, c1)*vectors(l, i, 1) + c(l, c2)*vectors(l, i, 2) &
                        + c(l, c3)*vectors(l, i, 3) + c(l, c4)*vectors(l, i, 4) &
                        + c(l, c5)*vectors(l, i, 5)
        end do
      end do
    end if
  end subroutine combine

  !> Products of gradients of the arguments, times the second derivatives by those.
  pure subroutine set_products(b, n, curvature, by_stress, hessian)
    integer, intent(in) :: b, n              !! first point, arguments (2 or 5)
    real(wp), intent(in) :: curvature(lanes, n_packed), by_stress(lanes, 5, n_arguments)
    real(wp), intent(inout) :: hessian(lanes, 15)   !! of these points alone
    !> Where the entries of each column stand.
    integer, parameter :: packed(n_arguments, n_arguments) = reshape([ &
      1, 2, 4, 7, 11, 2, 3, 5, 8, 12, 4, 5, 6, 9, 13, 7, 8, 9, 10, 14, 11, 12, 13, 14, 15], &
      [n_arguments, n_arguments])
    real(wp) :: w(lanes, 5, n_arguments)
    integer :: i

    do i = 1, n
      call combine(b, n, packed(:, i), curvature, by_stress, w(:, :, i))
    end do
    call set_upper(b, n, by_stress, w, hessian)
  end subroutine set_products

  !> The upper part of the sum of a w^T. The compiler keeps the sums in registers.
  pure subroutine set_upper(b, n, a, w, hessian)
    integer, intent(in) :: b, n
    real(wp), intent(in), dimension(lanes, 5, n_arguments) :: a, w
    real(wp), intent(inout) :: hessian(lanes, 15)
    real(wp) :: h(0:width - 1, 15)
    integer :: i, k, l

    h = 0.0_wp
    do i = 1, n
      !$omp simd
      do l = 0, width - 1
        h(l, 1) = h(l, 1) + a(b + l, 1, i)*w(b + l, 1, i)
        h(l, 2) = h(l, 2) + a(b + l, 1, i)*w(b + l, 2, i)
        h(l, 3) = h(l, 3) + a(b + l, 2, i)*w(b + l, 2, i)
        h(l, 4) = h(l, 4) + a(b + l, 1, i)*w(b + l, 3, i)
        h(l, 5) = h(l, 5) + a(b + l, 2, i)*w(b + l, 3, i)
        h(l, 6) = h(l, 6) + a(b + l, 3, i)*w(b + l, 3, i)
        h(l, 7) = h(l, 7) + a(b + l, 1, i)*w(b + l, 4, i)
        h(l, 8) = h(l, 8) + a(b + l, 2, i)*w(b + l, 4, i)
        h(l, 9) = h(l, 9) + a(b + l, 3, i)*w(b + l, 4, i)
        h(l, 10) = h(l, 10) + a(b + l, 4, i)*w(b + l, 4, i)
        h(l, 11) = h(l, 11) + a(b + l, 1, i)*w(b + l, 5, i)
        h(l, 12) = h(l, 12) + a(b + l, 2, i)*w(b + l, 5, i)
        h(l, 13) = h(l, 13) + a(b + l, 3, i)*w(b + l, 5, i)
        h(l, 14) = h(l, 14) + a(b + l, 4, i)*w(b + l, 5, i)
        h(l, 15) = h(l, 15) + a(b + l, 5, i)*w(b + l, 5, i)
      end do
    end do
    do k = 1, 15
      !$omp simd
      do l = 0, width - 1
        hessian(b + l, k) = h(l, k)
      end do
    end do
  end subroutine set_upper

end module argument_products
