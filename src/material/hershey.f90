!> Hershey's yield function of even exponent by the invariants of the stress, without principal
!! values.
!!
!! The sum of the powers m = 2k of the differences of principal values (A. V. Hershey, J. Appl.
!! Mech. 21 (1954)) is the power sum p_k of their squares x. Those are the roots of
!! x^3 - 6 J2 x^2 + 9 J2^2 x - (4 J2^3 - 27 J3^2), the last coefficient being the discriminant, and
!! from -ln(1 - 6 x + 9 x^2 - 4 u x^3) comes, with u = 1 - 27 J3^2/(4 J2^3) between 0 and 1,
!!
!!   p_k = 2 (3 J2)^k P(u),  P(u) = 1 + sum over j of k/(2j) (4/27)^j binomial(k-j-1, 2j-1) u^j.
!!
!! All terms are positive, and P is smooth where principal values coincide.
module hershey
  use kinds, only: wp
  implicit none
  private

  public :: hershey_series, evaluate_hershey

contains

  !> Coefficients of P from the power 1 on.
  pure function hershey_series(exponent) result(series)
    integer, intent(in) :: exponent              !! m, even
    real(wp) :: series(exponent/6)
    real(wp) :: binomial
    integer :: i, j, k

    k = exponent/2
    do j = 1, size(series)
      binomial = 1.0_wp
      do i = 1, 2*j - 1
        binomial = binomial*(k - 3*j + i)/i
      end do
      series(j) = real(k, wp)/(2*j)*(4.0_wp/27.0_wp)**j*binomial
    end do
  end function hershey_series

  !> Equivalent stress sqrt(3 J2) P^(1/m) of a deviator, and its derivatives, in which a shear
  !! stands for both of its entries.
  pure subroutine evaluate_hershey(exponent, series, s, q, gradient, hessian)
    integer, intent(in) :: exponent
    real(wp), intent(in) :: series(:)            !! of `hershey_series`
    real(wp), intent(in) :: s(6)                 !! 11 22 33 12 13 23
    real(wp), intent(out) :: q                   !! [stress]
    real(wp), intent(out), optional :: gradient(6), hessian(6, 6)   !! second with the first
    real(wp), parameter :: root3 = sqrt(3.0_wp)
    real(wp) :: n(6), t(6), length, w, g(0:2)

    length = sqrt(max(0.5_wp*(s(1)**2 + s(2)**2 + s(3)**2) + s(4)**2 + s(5)**2 + s(6)**2, &
                      tiny(length)))
    n = s/length
    w = n(1)*n(2)*n(3) + 2.0_wp*n(4)*n(5)*n(6) - n(1)*n(6)**2 - n(2)*n(5)**2 - n(3)*n(4)**2
    call shape_factor(exponent, series, w, g)
    q = root3*length*g(0)
    if (.not. present(gradient)) return
    ! n^2 - 2/3 I - 3/2 w n, by which w changes.
    t = [n(1)**2 + n(4)**2 + n(5)**2 - 2.0_wp/3.0_wp, n(4)**2 + n(2)**2 + n(6)**2 - 2.0_wp/3.0_wp, &
         n(5)**2 + n(6)**2 + n(3)**2 - 2.0_wp/3.0_wp, n(1)*n(4) + n(4)*n(2) + n(5)*n(6), &
         n(1)*n(5) + n(4)*n(6) + n(5)*n(3), n(4)*n(5) + n(2)*n(6) + n(6)*n(3)] - 1.5_wp*w*n
    n(4:) = 2.0_wp*n(4:)
    t(4:) = 2.0_wp*t(4:)
    gradient = root3*(0.5_wp*g(0)*n + g(1)*t)
    if (present(hessian)) call second_derivatives(root3/length, w, g, n, t, hessian)
  end subroutine evaluate_hershey

  !> P^(1/m) and its derivatives by w = J3/J2^(3/2).
  pure subroutine shape_factor(exponent, series, w, g)
    integer, intent(in) :: exponent
    real(wp), intent(in) :: series(:), w
    real(wp), intent(out) :: g(0:2)
    real(wp) :: u, p, p1, p2, u1
    integer :: j

    u = 1.0_wp - 6.75_wp*w*w
    u1 = -13.5_wp*w
    p = 0.0_wp
    p1 = 0.0_wp
    p2 = 0.0_wp
    do j = size(series), 1, -1
      p2 = p2*u + 2.0_wp*p1
      p1 = p1*u + p
      p = p*u + series(j)
    end do
    ! One more step for the leading 1.
    p2 = p2*u + 2.0_wp*p1
    p1 = (p1*u + p)
    p = 1.0_wp + p*u
    p1 = p1/(exponent*p)
    p2 = p2/(exponent*p) - exponent*p1*p1
    g(0) = p**(1.0_wp/exponent)
    g(1) = g(0)*p1*u1
    g(2) = g(0)*((p1*u1)**2 + p2*u1*u1 - 13.5_wp*p1)
  end subroutine shape_factor

  !> Derivatives of the gradient by a deviator; what a pressure would add is left out.
  pure subroutine second_derivatives(factor, w, g, n, t, hessian)
    real(wp), intent(in) :: factor         !! sqrt(3/J2) [1/stress]
    real(wp), intent(in) :: w, g(0:2)
    real(wp), intent(in) :: n(6), t(6)     !! shears doubled
    real(wp), intent(out) :: hessian(6, 6)
    integer, parameter :: rows(9) = [1, 2, 1, 3, 2, 3, 4, 4, 5]
    integer, parameter :: columns(9) = [4, 4, 5, 5, 6, 6, 5, 6, 6]
    integer, parameter :: parts(9) = [4, 4, 5, 5, 6, 6, 6, 5, 4]
    real(wp) :: whole, of_n, twice
    integer :: i, j, k

    whole = 0.5_wp*g(0) - 1.5_wp*w*g(1)
    of_n = 0.25_wp*g(0) + 0.75_wp*w*g(1)
    do i = 1, 6
      hessian(:, i) = (g(2)*t(i) - g(1)*n(i))*t - (of_n*n(i) + g(1)*t(i))*n
    end do
    ! The form 2 tr(n X X).
    twice = 2.0_wp*g(1)
    do i = 1, 3
      hessian(i, i) = hessian(i, i) + whole + twice*n(i)
      hessian(i + 3, i + 3) = hessian(i + 3, i + 3) + 2.0_wp*whole
    end do
    hessian(4, 4) = hessian(4, 4) + twice*(n(1) + n(2))
    hessian(5, 5) = hessian(5, 5) + twice*(n(1) + n(3))
    hessian(6, 6) = hessian(6, 6) + twice*(n(2) + n(3))
    do k = 1, size(rows)
      i = rows(k)
      j = columns(k)
      hessian(i, j) = hessian(i, j) + g(1)*n(parts(k))
      hessian(j, i) = hessian(i, j)
    end do
    hessian = factor*hessian
  end subroutine second_derivatives

end module hershey
