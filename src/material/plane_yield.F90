!> Yield functions of even exponent in plane stress, their gradients and second derivatives, `lanes`
!! points at a time.
!!
!! Barlat and Lian (1989), Yld2000-2d and the functions of Banabic et al. (2005) share one form, see
!! `sheet_functions`: the equivalent stress to the power m = 2k is
!!
!!   e(Q1, Q2) + Q3^k  or  e(Q1, Q2) + e(Q4, Q5),
!!
!! where the Q are squares of stresses, (n1 s11 + n2 s22)^2 + t s12^2, and
!!
!!   e(u^2, v^2) = ((u + v)^m + (u - v)^m)/2 = sum over j of binomial(m, 2j) u^2j v^(m - 2j).
!!
!! That is a polynomial of the Q without negative terms. So roots and principal values are not
!! needed, and all is smooth where those coincide. Values and slopes follow from the second
!! derivatives by Euler's theorem.
!!
!! In stresses of its own, in which Q1 = x1^2 and Q2 = x2^2 + x3^2, a function with one pair and the
!! exponent 6 or 8 is evaluated in one loop (`quick_plane_yield.inc`).
module plane_yield
  use kinds, only: wp
  use deviator_lanes, only: lanes
  use row_functions, only: power_row
  implicit none
  private

  public :: new_plane_yield, scaled_plane_yield, mises_bound_in_plane, own_stresses, &
            evaluate_plane_yield, slope_in_plane, excess_in_plane, second_derivatives

  integer, parameter, public :: most_half = 50   !! half of the largest exponent

  !> A yield function; its equivalent stress grows in proportion to the stress.
  type, public :: plane_yield_t
    integer :: half = 0                      !! k, half of the exponent
    logical :: has_second_pair = .false.     !! Q4 and Q5 in place of Q3, which is zero
    real(wp) :: normal(2, 5) = 0.0_wp        !! n1 and n2 of each Q
    real(wp) :: shear(5) = 0.0_wp            !! t
    !> Coefficients of the second derivatives of e by Q1 (mirrored: by Q2) and by both, by rising
    !! powers of Q1.
    real(wp), dimension(most_half) :: pure = 0.0_wp, mixed = 0.0_wp
    !> In stresses of its own: coefficients of the second derivatives by Q1, by Q1 and Q2 and by Q2,
    !! for Q1^2, Q1 Q2, Q2^2, Q1 and Q2, and of that by Q3, for Q3^2 and Q3.
    real(wp) :: quick(5, 3) = 0.0_wp, quick_single(2) = 0.0_wp
    logical :: is_quick = .false.            !! these are used
  end type plane_yield_t

  !> Power m of the equivalent stress and its derivatives, of stresses over a scaling.
  type :: sums_t
    real(wp) :: unit(lanes, 3), value(lanes), slope(lanes, 3), bend(lanes, 6)
  end type sums_t

  real(wp), parameter :: least = 1.0e-200_wp   !! value, so that derivatives without stress are
                                               !! numbers

contains

  !> From all Q, of which the third or the last two are zero.
  pure function new_plane_yield(half, normal, shear) result(yield)
    integer, intent(in) :: half              !! k, 1 to `most_half`
    real(wp), intent(in) :: normal(2, 5), shear(5)
    type(plane_yield_t) :: yield
    real(wp) :: binomial(0:2*half)
    integer :: i

    yield%half = half
    yield%normal = normal
    yield%shear = shear
    yield%has_second_pair = any(abs(normal(:, 4:)) > 0.0_wp)
    binomial(0) = 1.0_wp
    do i = 1, 2*half
      binomial(i) = binomial(i - 1)*(2*half - i + 1)/i
    end do
    yield%pure(:half - 1) = [((i + 2)*(i + 1)*binomial(2*i + 4), i=0, half - 2)]
    yield%mixed(:half - 1) = [((i + 1)*(half - 1 - i)*binomial(2*i + 2), i=0, half - 2)]
  end function new_plane_yield

  !> The same function of the components x of a stress s: s11 = a(1, 1) x1 + a(1, 2) x2, the same
  !! with s22, and s12 = b x3.
  pure function scaled_plane_yield(yield, a, b) result(new)
    type(plane_yield_t), intent(in) :: yield
    real(wp), intent(in) :: a(2, 2), b
    type(plane_yield_t) :: new

    new = yield
    new%normal = matmul(transpose(a), yield%normal)
    new%shear = b**2*yield%shear
  end function scaled_plane_yield

  !> The same function of stresses of its own, x12 = forms s12 and x3 = shear s3. Where the forms of
  !! the pair do not span the normal stresses they are those of `yield`.
  pure subroutine own_stresses(yield, own, forms, shear)
    type(plane_yield_t), intent(in) :: yield
    type(plane_yield_t), intent(out) :: own
    real(wp), intent(out) :: forms(2, 2), shear
    real(wp), parameter :: little = 1.0e-3_wp
    real(wp) :: inverse(2, 2), determinant

    forms = transpose(yield%normal(:, :2))
    shear = sqrt(yield%shear(2))
    determinant = forms(1, 1)*forms(2, 2) - forms(1, 2)*forms(2, 1)
    inverse = reshape([forms(2, 2), -forms(2, 1), -forms(1, 2), forms(1, 1)], [2, 2])
    if (yield%shear(1) > 0.0_wp .or. .not. (abs(determinant) > little*sum(forms**2) .and. &
                                            yield%shear(2) > little**2*sum(forms**2))) then
      forms = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      shear = 1.0_wp
      own = yield
      return
    end if
    own = scaled_plane_yield(yield, inverse/determinant, 1.0_wp/shear)
    own%is_quick = .not. own%has_second_pair .and. (own%half == 3 .or. own%half == 4)
    if (.not. own%is_quick) return
    associate (u => own%pure, v => own%mixed, c => own%quick)
      if (own%half == 3) then
        c(4:5, :) = reshape([u(2), u(1), v(2), v(1), u(1), u(2)], [2, 3])
        own%quick_single(2) = 6.0_wp
      else
        c(:3, :) = reshape([u(3), u(2), u(1), v(3), v(2), v(1), u(1), u(2), u(3)], [3, 3])
        own%quick_single(1) = 12.0_wp
      end if
    end associate
  end subroutine own_stresses

  !> A number that no equivalent stress over the length of the stress exceeds. A sum u + v, as the
  !! largest of linear functions of the stress, has the length of their largest coefficients.
  pure real(wp) function mises_bound_in_plane(yield)
    type(plane_yield_t), intent(in) :: yield
    real(wp) :: size_of(5), first, second
    integer :: i

    do i = 1, 5
      size_of(i) = max(sum(yield%normal(:, i)**2), yield%shear(i))
    end do
    associate (n => yield%normal)
      first = sum(n(:, 1)**2) + 2.0_wp*abs(dot_product(n(:, 1), n(:, 2))) + size_of(2)
    end associate
    if (yield%shear(1) > 0.0_wp) first = (sqrt(size_of(1)) + sqrt(size_of(2)))**2
    second = max(size_of(3), (sqrt(size_of(4)) + sqrt(size_of(5)))**2)
    mises_bound_in_plane = sqrt(max(first, second)) &
                           *(1.0_wp + (min(first, second)/max(first, second))**yield%half) &
                           **(0.5_wp/yield%half)
  end function mises_bound_in_plane

  !> (q/flow)^m - 1 over m: how far stresses lie outside of the yield surface.
  pure subroutine excess_in_plane(yield, stress, flow, excess)
    type(plane_yield_t), intent(in) :: yield
    real(wp), intent(in) :: stress(lanes, 3), flow(lanes)
    real(wp), intent(out) :: excess(lanes)
    real(wp) :: inverse(lanes)
    type(sums_t) :: sums
    integer :: l

    call find_scaling(stress, flow, inverse)
    if (.not. yield%is_quick) then
      call add_up(yield, inverse, stress, sums)
    else
      call quick_power(yield, inverse, stress, sums%value)
    end if
    !$omp simd
    do l = 1, lanes
      excess(l) = (sums%value(l) - 1.0_wp)/(2*yield%half)
    end do
  end subroutine excess_in_plane

  !> One over a stress of the order of each stress: the flow stress, but where the stress is many
  !! times that, its length. So no power is too large.
  pure subroutine find_scaling(stress, flow, inverse)
    real(wp), intent(in) :: stress(lanes, 3), flow(lanes)
    real(wp), intent(out) :: inverse(lanes)
    real(wp), parameter :: many = 4.0_wp
    real(wp) :: most, square(lanes)
    integer :: l

    most = 0.0_wp
    !$omp simd reduction(max:most)
    do l = 1, lanes
      inverse(l) = 1.0_wp/flow(l)
      square(l) = (stress(l, 1)**2 + stress(l, 2)**2 + stress(l, 3)**2)*inverse(l)**2
      most = max(most, square(l))
    end do
    if (most > many**2) inverse = inverse/sqrt(max(1.0_wp, square/many**2))
  end subroutine find_scaling

  !> Equivalent stress q, its gradient and its second derivatives, packed as 11, 12, 22, 13, 23, 33.
  pure subroutine evaluate_plane_yield(yield, stress, near, q, gradient, hessian, is_rough)
    type(plane_yield_t), intent(in) :: yield
    real(wp), intent(in) :: stress(lanes, 3)               !! 11 22 12
    real(wp), intent(in) :: near(lanes)                    !! about q, or more [stress]
    real(wp), intent(out) :: q(lanes), gradient(lanes, 3)  !! [stress], none
    real(wp), intent(out) :: hessian(lanes, 6)             !! [1/stress]
    logical, intent(in), optional :: is_rough    !! not exact but close to `near`, where q over that
                                                 !! to the power m lies between a half and 3/2
    real(wp), parameter :: exact_part = 1.0e-4_wp, rough_part = 0.5_wp
    real(wp) :: inverse(lanes), most, far_off
    type(sums_t) :: sums

    call find_scaling(stress, near, inverse)
    call evaluate_once(yield, inverse, stress, q, gradient, hessian, sums, most)
    far_off = exact_part
    if (present(is_rough)) far_off = merge(rough_part, exact_part, is_rough)
    if (most <= far_off) return
    ! Once more, next to the very q.
    call power_row(lanes, -0.5_wp/yield%half, sums%value)
    inverse = inverse*sums%value
    call evaluate_once(yield, inverse, stress, q, gradient, hessian, sums, most)
  end subroutine evaluate_plane_yield

  !> The same next to the surface of a stress.
  pure subroutine evaluate_once(yield, inverse, stress, q, gradient, hessian, sums, most)
    type(plane_yield_t), intent(in) :: yield
    real(wp), intent(in) :: inverse(lanes), stress(lanes, 3)    !! one over that stress
    real(wp), intent(out) :: q(lanes), gradient(lanes, 3), hessian(lanes, 6)
    type(sums_t), intent(inout) :: sums        !! power m of the equivalent stress out
    real(wp), intent(out) :: most              !! by which that differs from 1

    if (.not. yield%is_quick) then
      call add_up(yield, inverse, stress, sums)
      call take_root(2*yield%half, inverse, sums, q, gradient, hessian, most)
    else
      call quick_derivatives(yield, inverse, stress, q, gradient, hessian, sums%value, most)
    end if
  end subroutine evaluate_once

  !> The same without second derivatives, next to `near`.
  pure subroutine slope_in_plane(yield, stress, near, q, gradient)
    type(plane_yield_t), intent(in) :: yield
    real(wp), intent(in) :: stress(lanes, 3), near(lanes)
    real(wp), intent(out) :: q(lanes), gradient(lanes, 3)
    real(wp) :: hessian(lanes, 6)

    if (.not. yield%is_quick) then
      call evaluate_plane_yield(yield, stress, near, q, gradient, hessian, is_rough=.true.)
    else
      call quick_slope(yield, stress, near, q, gradient)
    end if
  end subroutine slope_in_plane

#define ORDER 2
  !> All in one loop.
  pure subroutine quick_derivatives(yield, inverse, stress, q, gradient, hessian, power, most)
#include "quick_plane_yield.inc"
  end subroutine quick_derivatives

#undef ORDER
#define ORDER 1
  pure subroutine quick_slope(yield, stress, near, q, gradient)
#include "quick_plane_yield.inc"
  end subroutine quick_slope

#undef ORDER
#define ORDER 0
  pure subroutine quick_power(yield, inverse, stress, power)
#include "quick_plane_yield.inc"
  end subroutine quick_power
#undef ORDER

  !> Root of the power m and its derivatives. For 1 + x the root is that of Halley,
  !! (2 + (1 + 1/m) x)/(2 + (1 - 1/m) x), exact to 1e-14 where x is below 1e-4, as at the end of a
  !! return.
  pure subroutine take_root(m, inverse, sums, q, gradient, hessian, most)
    integer, intent(in) :: m
    real(wp), intent(in) :: inverse(lanes)
    type(sums_t), intent(in) :: sums
    real(wp), intent(out) :: q(lanes), gradient(lanes, 3), hessian(lanes, 6)
    real(wp), intent(out) :: most              !! largest x
    real(wp) :: per_m, x, low, per, first, square, g1, g2, g3
    integer :: l

    per_m = 1.0_wp/m
    most = 0.0_wp
    !$omp simd private(x, low, per, first, square, g1, g2, g3) reduction(max:most)
    do l = 1, lanes
      x = sums%value(l) - 1.0_wp
      most = max(most, abs(x))
      low = 2.0_wp + (1.0_wp - per_m)*x
      x = 2.0_wp + (1.0_wp + per_m)*x
      ! The root, and the root over the power.
      per = 1.0_wp/(low*x*sums%value(l)*inverse(l))
      q(l) = per*x*x*sums%value(l)
      first = per_m*per*x*x*inverse(l)
      square = (m - 1)*per*low*low*sums%value(l)*inverse(l)**2
      g1 = first*sums%slope(l, 1)
      g2 = first*sums%slope(l, 2)
      g3 = first*sums%slope(l, 3)
      gradient(l, 1) = g1
      gradient(l, 2) = g2
      gradient(l, 3) = g3
      first = inverse(l)*first
      hessian(l, 1) = first*sums%bend(l, 1) - square*g1*g1
      hessian(l, 2) = first*sums%bend(l, 2) - square*g1*g2
      hessian(l, 3) = first*sums%bend(l, 3) - square*g2*g2
      hessian(l, 4) = first*sums%bend(l, 4) - square*g1*g3
      hessian(l, 5) = first*sums%bend(l, 5) - square*g2*g3
      hessian(l, 6) = first*sums%bend(l, 6) - square*g3*g3
    end do
  end subroutine take_root

  !> The sums of all terms.
  pure subroutine add_up(yield, inverse, stress, sums)
    type(plane_yield_t), intent(in) :: yield
    real(wp), intent(in) :: inverse(lanes), stress(lanes, 3)
    type(sums_t), intent(out) :: sums
    integer :: i, l

    do i = 1, 3
      !$omp simd
      do l = 1, lanes
        sums%unit(l, i) = inverse(l)*stress(l, i)
      end do
    end do
    call set_single(yield, sums)
    call add_pair(yield, yield%normal(:, :2), yield%shear(:2), sums)
    if (yield%has_second_pair) call add_pair(yield, yield%normal(:, 4:), yield%shear(4:), sums)
  end subroutine add_up

  !> Begin the sums with Q3^k.
  pure subroutine set_single(yield, sums)
    type(plane_yield_t), intent(in) :: yield
    type(sums_t), intent(inout) :: sums
    real(wp), dimension(lanes) :: u, uu
    real(wp) :: x, u1, u2, u3, fu, k, per, flat
    integer :: j, l

    k = yield%half
    per = 1.0_wp/max(yield%half - 1, 1)
    flat = merge(1.0_wp, 0.0_wp, yield%half == 1)
    associate (n1 => yield%normal(1, 3), n2 => yield%normal(2, 3), t => yield%shear(3), &
               s => sums%unit)
      !$omp simd
      do l = 1, lanes
        u(l) = (n1*s(l, 1) + n2*s(l, 2))**2 + t*s(l, 3)**2
        uu(l) = k*(k - 1.0_wp)
      end do
      do j = 1, yield%half - 2
        !$omp simd
        do l = 1, lanes
          uu(l) = uu(l)*u(l)
        end do
      end do
      !$omp simd private(x, u1, u2, u3, fu)
      do l = 1, lanes
        x = 2.0_wp*(n1*s(l, 1) + n2*s(l, 2))
        u1 = n1*x
        u2 = n2*x
        u3 = 2.0_wp*t*s(l, 3)
        fu = flat + per*u(l)*uu(l)
        sums%value(l) = u(l)*fu/k + least
        sums%slope(l, 1) = fu*u1
        sums%slope(l, 2) = fu*u2
        sums%slope(l, 3) = fu*u3
        sums%bend(l, 1) = uu(l)*u1*u1 + 2.0_wp*n1*n1*fu
        sums%bend(l, 2) = uu(l)*u1*u2 + 2.0_wp*n1*n2*fu
        sums%bend(l, 3) = uu(l)*u2*u2 + 2.0_wp*n2*n2*fu
        sums%bend(l, 4) = uu(l)*u1*u3
        sums%bend(l, 5) = uu(l)*u2*u3
        sums%bend(l, 6) = uu(l)*u3*u3 + 2.0_wp*t*fu
      end do
    end associate
  end subroutine set_single

  !> Add e of two Q.
  pure subroutine add_pair(yield, n, t, sums)
    type(plane_yield_t), intent(in) :: yield
    real(wp), intent(in) :: n(2, 2), t(2)
    type(sums_t), intent(inout) :: sums
    real(wp), dimension(lanes) :: u, v, uu, uv, vv
    real(wp) :: per, flat, per_k, x, y, fu, fv, u1, u2, u3, v1, v2, v3, a1, a2, a3, b1, b2, b3
    integer :: l

    per = 1.0_wp/max(yield%half - 1, 1)
    flat = merge(1.0_wp, 0.0_wp, yield%half == 1)
    per_k = 1.0_wp/yield%half
    associate (s => sums%unit)
      !$omp simd
      do l = 1, lanes
        u(l) = (n(1, 1)*s(l, 1) + n(2, 1)*s(l, 2))**2 + t(1)*s(l, 3)**2
        v(l) = (n(1, 2)*s(l, 1) + n(2, 2)*s(l, 2))**2 + t(2)*s(l, 3)**2
      end do
      call second_derivatives(yield, u, v, uu, uv, vv)
      !$omp simd private(x, y, fu, fv, u1, u2, u3, v1, v2, v3, a1, a2, a3, b1, b2, b3)
      do l = 1, lanes
        fu = flat + per*(u(l)*uu(l) + v(l)*uv(l))
        fv = flat + per*(u(l)*uv(l) + v(l)*vv(l))
        sums%value(l) = sums%value(l) + per_k*(u(l)*fu + v(l)*fv)
        ! Gradients of both Q, and of the slopes by them.
        x = 2.0_wp*(n(1, 1)*s(l, 1) + n(2, 1)*s(l, 2))
        y = 2.0_wp*(n(1, 2)*s(l, 1) + n(2, 2)*s(l, 2))
        u1 = n(1, 1)*x; v1 = n(1, 2)*y
        u2 = n(2, 1)*x; v2 = n(2, 2)*y
        u3 = 2.0_wp*t(1)*s(l, 3); v3 = 2.0_wp*t(2)*s(l, 3)
        sums%slope(l, 1) = sums%slope(l, 1) + (fu*u1 + fv*v1)
        sums%slope(l, 2) = sums%slope(l, 2) + (fu*u2 + fv*v2)
        sums%slope(l, 3) = sums%slope(l, 3) + (fu*u3 + fv*v3)
        a1 = uu(l)*u1 + uv(l)*v1; b1 = uv(l)*u1 + vv(l)*v1
        a2 = uu(l)*u2 + uv(l)*v2; b2 = uv(l)*u2 + vv(l)*v2
        a3 = uu(l)*u3 + uv(l)*v3; b3 = uv(l)*u3 + vv(l)*v3
        fu = 2.0_wp*fu
        fv = 2.0_wp*fv
        sums%bend(l, 1) = sums%bend(l, 1) + (u1*a1 + v1*b1 + fu*n(1, 1)**2 + fv*n(1, 2)**2)
        sums%bend(l, 2) = sums%bend(l, 2) + (u1*a2 + v1*b2 + fu*n(1, 1)*n(2, 1) &
                                             + fv*n(1, 2)*n(2, 2))
        sums%bend(l, 3) = sums%bend(l, 3) + (u2*a2 + v2*b2 + fu*n(2, 1)**2 + fv*n(2, 2)**2)
        sums%bend(l, 4) = sums%bend(l, 4) + (u1*a3 + v1*b3)
        sums%bend(l, 5) = sums%bend(l, 5) + (u2*a3 + v2*b3)
        sums%bend(l, 6) = sums%bend(l, 6) + (u3*a3 + v3*b3 + fu*t(1) + fv*t(2))
      end do
    end associate
  end subroutine add_pair

  !> Second derivatives of e by two Q, u and v.
  pure subroutine second_derivatives(yield, u, v, uu, uv, vv)
    type(plane_yield_t), intent(in) :: yield
    real(wp), intent(in) :: u(lanes), v(lanes)
    real(wp), intent(out), dimension(lanes) :: uu, uv, vv
    real(wp), dimension(lanes) :: power
    integer :: i, l, n

    uu = 0.0_wp
    uv = 0.0_wp
    vv = 0.0_wp
    power = 1.0_wp
    n = yield%half - 2
    do i = n, 0, -1
      !$omp simd
      do l = 1, lanes
        uu(l) = uu(l)*u(l) + yield%pure(i + 1)*power(l)
        uv(l) = uv(l)*u(l) + yield%mixed(i + 1)*power(l)
        vv(l) = vv(l)*u(l) + yield%pure(n - i + 1)*power(l)
        power(l) = power(l)*v(l)
      end do
    end do
  end subroutine second_derivatives

end module plane_yield
