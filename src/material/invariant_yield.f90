!> Yield functions of even exponent m by the invariants of transformed stresses, `lanes` points at
!! a time and without principal values. They are smooth where principal values coincide.
!!
!! The transform of a deviator is a block of 2 x 2, a factor on each shear, and a trace; of what is
!! without a trace count J2 and J3.
!!
!! One transform, the function of A. V. Hershey, J. Appl. Mech. 21 (1954): the sum of the powers
!! m = 2k of the differences of principal values is the power sum p_k of their squares x. Those are
!! the roots of x^3 - 6 J2 x^2 + 9 J2^2 x - (4 J2^3 - 27 J3^2), the last coefficient being the
!! discriminant, and from -ln(1 - 6 x + 9 x^2 - 4 u x^3) comes, with
!! u = 1 - 27 J3^2/(4 J2^3) between 0 and 1,
!!
!!   p_k = 2 (3 J2)^k P(u),  P(u) = 1 + sum over j of k/(2j) (4/27)^j binomial(k-j-1, 2j-1) u^j.
!!
!! Two transforms: see `power_sums`.
module invariant_yield
  use kinds, only: wp
  use deviator_lanes, only: lanes, width
  use power_sums, only: n_arguments, n_packed, most_of_two, inverse_factorials, find_series, &
                        contract_values, contract_slopes, contract_curvatures
  use argument_products, only: combine, set_products
  use row_functions, only: power_row, inverse_root
  implicit none
  private

  public :: new_invariant_yield, evaluate_by_invariants, excess_by_invariants

  !> Transform of a deviator: block and factors of what has no trace, a third of the trace.
  type, public :: transform_t
    real(wp) :: block(2, 2) = 0.0_wp, factors(3) = 0.0_wp, mean(2) = 0.0_wp
    !> What J2 and J3 need for their second derivatives, see `set_bends`.
    real(wp) :: of_j2(6) = 0.0_wp, of_j3(3, 2) = 0.0_wp, mixed(2, 3) = 0.0_wp, shears(6) = 0.0_wp
  end type transform_t

  !> A yield function of this kind.
  type, public :: invariant_yield_t
    integer :: exponent = 0                   !! m, even
    integer :: n = 0                          !! transforms
    type(transform_t) :: transforms(2)        !! the second with the other sign
    real(wp) :: mean(2) = 0.0_wp              !! by which both means differ
    real(wp) :: scaling = 1.0_wp              !! of the sums to the power m of the stress
    real(wp), allocatable :: series(:)        !! one transform: coefficients of P
  end type invariant_yield_t

  real(wp), parameter :: root2 = sqrt(2.0_wp), root6 = sqrt(6.0_wp)

contains

  !> From one transform or two, with even exponent.
  pure function new_invariant_yield(exponent, transforms) result(yield)
    integer, intent(in) :: exponent
    type(transform_t), intent(in) :: transforms(:)
    type(invariant_yield_t) :: yield

    yield%exponent = exponent
    yield%n = size(transforms)
    yield%transforms(:yield%n) = transforms
    if (yield%n == 1) then
      yield%series = hershey_series(exponent)
    else
      yield%scaling = 0.25_wp/inverse_factorials(exponent)
      yield%mean = transforms(1)%mean - transforms(2)%mean
      yield%transforms(2)%block = -transforms(2)%block
      yield%transforms(2)%factors = -transforms(2)%factors
    end if
    call set_bends(yield%transforms)
  end function new_invariant_yield

  !> Coefficients of the second derivatives: of J2 in the order 11, 12, 22, 33, 44, 55; of J3 those
  !! of 11, 12, 22 by x1 and x2, of 1 and 2 with 3, 4, 5, and of 33, 34, 44, 35, 45, 55.
  elemental subroutine set_bends(a)
    type(transform_t), intent(inout) :: a

    associate (p => a%block(1, :), r => a%block(2, :), f => a%factors)
      a%of_j2 = [p(1)**2 + r(1)**2, p(1)*p(2) + r(1)*r(2), p(2)**2 + r(2)**2, f**2]
      a%of_j3(:, 1) = [2.0_wp*p(1)*r(1), p(1)*r(2) + r(1)*p(2), 2.0_wp*p(2)*r(2)]*2.0_wp/root6
      a%of_j3(:, 2) = [p(1)**2 - r(1)**2, p(1)*p(2) - r(1)*r(2), p(2)**2 - r(2)**2]*2.0_wp/root6
      a%mixed(:, 1) = f(1)*r*2.0_wp/root6
      a%mixed(:, 2) = f(2)*(p/root2 - r/root6)
      a%mixed(:, 3) = -f(3)*(p/root2 + r/root6)
      a%shears = [f(1)*f(1), f(1)*f(2), f(2)*f(2), f(1)*f(3), f(2)*f(3), f(3)*f(3)] &
                 /[root6, root2, 1.0_wp, root2, root2, 1.0_wp]*[2.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, &
                                                               1.0_wp, 1.0_wp]
    end associate
  end subroutine set_bends

  !> Coefficients of P from the power 0 on.
  pure function hershey_series(exponent) result(series)
    integer, intent(in) :: exponent              !! m, even
    real(wp) :: series(exponent/6 + 1)
    real(wp) :: binomial
    integer :: i, j, k

    k = exponent/2
    series(1) = 1.0_wp
    do j = 1, size(series) - 1
      binomial = 1.0_wp
      do i = 1, 2*j - 1
        binomial = binomial*(k - 3*j + i)/i
      end do
      series(j + 1) = real(k, wp)/(2*j)*(4.0_wp/27.0_wp)**j*binomial
    end do
  end function hershey_series

  !> Equivalent stress of deviators, its gradient and its second derivatives, packed.
  pure subroutine evaluate_by_invariants(yield, s, q, gradient, hessian)
    type(invariant_yield_t), intent(in) :: yield
    real(wp), intent(in) :: s(lanes, 5)
    real(wp), intent(out) :: q(lanes), gradient(lanes, 5)
    real(wp), intent(out), optional :: hessian(lanes, 15)
    real(wp) :: length(lanes), inverse(lanes), unit(lanes, 5), power(lanes)
    real(wp) :: x(lanes, 5, 2), t(lanes, 5, 2)
    real(wp) :: slope(lanes, n_arguments), curvature(lanes, n_packed)
    real(wp) :: by_stress(lanes, 5, n_arguments)
    integer :: b, k, l, n, order

    order = 1
    if (present(hessian)) order = 2
    n = merge(2, n_arguments, yield%n == 1)
    call find_length(s, length, inverse)
    call scale_stress(inverse, s, unit)
    call evaluate_power(yield, order, unit, x, t, power, slope, curvature)
    do k = 1, yield%n
      call transform_back(yield%transforms(k), x(:, :, k), by_stress(:, :, 2*k - 1))
      call transform_back(yield%transforms(k), t(:, :, k), by_stress(:, :, 2*k))
    end do
    if (yield%n == 2) call set_mean(yield%mean, by_stress(:, :, 5))
    call take_root(yield, n, order, inverse, power, q, slope, curvature)
    do b = 1, lanes, width
      call combine(b, n, [1, 2, 3, 4, 5], slope, by_stress, gradient)
    end do
    if (present(hessian)) then
      do b = 1, lanes, width
        call set_products(b, n, curvature, by_stress, hessian)
      end do
      do k = 1, yield%n
        call add_bends(yield%transforms(k), inverse, slope(:, 2*k - 1), slope(:, 2*k), &
                       x(:, :, k), hessian)
      end do
    end if
    !$omp simd
    do l = 1, lanes
      q(l) = length(l)*q(l)
    end do
  end subroutine evaluate_by_invariants

  !> (q/flow)^m - 1 over m.
  pure subroutine excess_by_invariants(yield, s, flow, excess)
    type(invariant_yield_t), intent(in) :: yield
    real(wp), intent(in) :: s(lanes, 5), flow(lanes)
    real(wp), intent(out) :: excess(lanes)
    real(wp) :: inverse(lanes), unit(lanes, 5), power(lanes), x(lanes, 5, 2), t(lanes, 5, 2)
    real(wp) :: slope(lanes, n_arguments), curvature(lanes, n_packed)
    real(wp) :: length(lanes)
    real(wp), parameter :: next_to_none = 1.0e-8_wp   ! flow stress over stress: what lies that far
                                                      ! outside has a power that is a number
    integer :: l

    call find_length(s, length, inverse)
    !$omp simd
    do l = 1, lanes
      inverse(l) = 1.0_wp/max(flow(l), next_to_none*length(l))
    end do
    call scale_stress(inverse, s, unit)
    call evaluate_power(yield, 0, unit, x, t, power, slope, curvature)
    !$omp simd
    do l = 1, lanes
      excess(l) = (yield%scaling*power(l) - 1.0_wp)/yield%exponent
    end do
  end subroutine excess_by_invariants

  !> Power m of the equivalent stress, over `scaling`, and its derivatives by the arguments; what it
  !! takes to come from those to derivatives by the stress.
  pure subroutine evaluate_power(yield, order, unit, x, t, power, slope, curvature)
    type(invariant_yield_t), intent(in) :: yield
    integer, intent(in) :: order                !! 0: value, 1: slopes too, 2: all
    real(wp), intent(in) :: unit(lanes, 5)      !! stress so scaled that no power is too large
    real(wp), intent(out) :: x(lanes, 5, 2), t(lanes, 5, 2)   !! gradients of J2 and J3
    real(wp), intent(out) :: power(lanes), slope(lanes, n_arguments), curvature(lanes, n_packed)
    real(wp) :: mean(lanes), j2(lanes, 2), j3(lanes, 2)
    integer :: k, l

    do k = 1, yield%n
      call transform(yield%transforms(k), unit, x(:, :, k))
      call find_invariants(x(:, :, k), j2(:, k), j3(:, k), t(:, :, k))
    end do
    if (yield%n == 1) then
      call hershey(yield, order, j2(:, 1), j3(:, 1), power, slope, curvature)
    else
      !$omp simd
      do l = 1, lanes
        mean(l) = yield%mean(1)*unit(l, 1) + yield%mean(2)*unit(l, 2)
      end do
      call sum_powers(yield%exponent, order, mean, j2, j3, power, slope, curvature)
    end if
  end subroutine evaluate_power

  !> From a power to its root q, and to the derivatives of that, those of second order by a stress
  !! of true length.
  pure subroutine take_root(yield, n, order, inverse, power, q, slope, curvature)
    type(invariant_yield_t), intent(in) :: yield
    integer, intent(in) :: n, order          !! arguments, order of the derivatives
    real(wp), intent(in) :: inverse(lanes), power(lanes)     !! 1/length
    real(wp), intent(out) :: q(lanes)
    real(wp), intent(inout) :: slope(lanes, n_arguments), curvature(lanes, n_packed)
    real(wp), parameter :: least = 1.0e-60_wp   ! of a stress of unit length; the derivatives of
                                                ! what has no stress stay numbers
    real(wp), dimension(lanes) :: root, first, second, square
    integer :: i, j, k, l

    !$omp simd
    do l = 1, lanes
      q(l) = max(yield%scaling*power(l), least)
    end do
    if (yield%exponent == 6 .or. yield%exponent == 8) then
      call inverse_root(lanes, yield%exponent, q, root)
    else
      root = q
      call power_row(lanes, -1.0_wp/yield%exponent, root)
    end if
    !$omp simd
    do l = 1, lanes
      second(l) = 1.0_wp/(root(l)*q(l))
      q(l) = second(l)*q(l)
      first(l) = yield%scaling/yield%exponent*second(l)
      second(l) = first(l)*inverse(l)
      square(l) = (yield%exponent - 1)*inverse(l)*root(l)
    end do
    do i = 1, n
      !$omp simd
      do l = 1, lanes
        slope(l, i) = first(l)*slope(l, i)
      end do
      if (order < 2) cycle
      do j = 1, i
        k = i*(i - 1)/2 + j
        !$omp simd
        do l = 1, lanes
          curvature(l, k) = second(l)*curvature(l, k) - square(l)*slope(l, i)*slope(l, j)
        end do
      end do
    end do
  end subroutine take_root

  !> Gradient of the mean.
  pure subroutine set_mean(mean, by_stress)
    real(wp), intent(in) :: mean(2)
    real(wp), intent(out) :: by_stress(lanes, 5)
    integer :: l

    !$omp simd
    do l = 1, lanes
      by_stress(l, 1) = mean(1)
      by_stress(l, 2) = mean(2)
      by_stress(l, 3) = 0.0_wp
      by_stress(l, 4) = 0.0_wp
      by_stress(l, 5) = 0.0_wp
    end do
  end subroutine set_mean

  pure subroutine find_length(s, length, inverse)
    real(wp), intent(in) :: s(lanes, 5)
    real(wp), intent(out) :: length(lanes), inverse(lanes)
    real(wp), parameter :: least = 1.0e-100_wp
    integer :: l

    !$omp simd
    do l = 1, lanes
      length(l) = max(sqrt(s(l, 1)**2 + s(l, 2)**2 + s(l, 3)**2 + s(l, 4)**2 + s(l, 5)**2), least)
      inverse(l) = 1.0_wp/length(l)
    end do
  end subroutine find_length

  pure subroutine scale_stress(scaling, s, unit)
    real(wp), intent(in) :: scaling(lanes), s(lanes, 5)
    real(wp), intent(out) :: unit(lanes, 5)
    integer :: i, l

    do i = 1, 5
      !$omp simd
      do l = 1, lanes
        unit(l, i) = scaling(l)*s(l, i)
      end do
    end do
  end subroutine scale_stress

  pure subroutine transform(a, s, x)
    type(transform_t), intent(in) :: a
    real(wp), intent(in) :: s(lanes, 5)
    real(wp), intent(out) :: x(lanes, 5)
    integer :: l

    !$omp simd
    do l = 1, lanes
      x(l, 1) = a%block(1, 1)*s(l, 1) + a%block(1, 2)*s(l, 2)
      x(l, 2) = a%block(2, 1)*s(l, 1) + a%block(2, 2)*s(l, 2)
      x(l, 3) = a%factors(1)*s(l, 3)
      x(l, 4) = a%factors(2)*s(l, 4)
      x(l, 5) = a%factors(3)*s(l, 5)
    end do
  end subroutine transform

  !> The same with the transposed block.
  pure subroutine transform_back(a, x, s)
    type(transform_t), intent(in) :: a
    real(wp), intent(in) :: x(lanes, 5)
    real(wp), intent(out) :: s(lanes, 5)
    integer :: l

    !$omp simd
    do l = 1, lanes
      s(l, 1) = a%block(1, 1)*x(l, 1) + a%block(2, 1)*x(l, 2)
      s(l, 2) = a%block(1, 2)*x(l, 1) + a%block(2, 2)*x(l, 2)
      s(l, 3) = a%factors(1)*x(l, 3)
      s(l, 4) = a%factors(2)*x(l, 4)
      s(l, 5) = a%factors(3)*x(l, 5)
    end do
  end subroutine transform_back

  !> J2, whose gradient is x, and J3 with its gradient t.
  pure subroutine find_invariants(x, j2, j3, t)
    real(wp), intent(in) :: x(lanes, 5)
    real(wp), intent(out) :: j2(lanes), j3(lanes), t(lanes, 5)
    real(wp) :: plus, minus
    integer :: l

    !$omp simd private(plus, minus)
    do l = 1, lanes
      j2(l) = 0.5_wp*(x(l, 1)**2 + x(l, 2)**2 + x(l, 3)**2 + x(l, 4)**2 + x(l, 5)**2)
      minus = (x(l, 5)**2 - x(l, 4)**2)*(0.5_wp/root2)
      plus = (x(l, 5)**2 + x(l, 4)**2 - 2.0_wp*x(l, 3)**2)*(0.5_wp/root6)
      t(l, 1) = x(l, 1)*x(l, 2)*(2.0_wp/root6) - minus
      t(l, 2) = (x(l, 1)**2 - x(l, 2)**2)*(1.0_wp/root6) - plus
      t(l, 3) = x(l, 4)*x(l, 5)*(1.0_wp/root2) + x(l, 2)*x(l, 3)*(2.0_wp/root6)
      t(l, 4) = (x(l, 3)*x(l, 5) + x(l, 1)*x(l, 4))*(1.0_wp/root2) - x(l, 2)*x(l, 4)*(1.0_wp/root6)
      t(l, 5) = (x(l, 3)*x(l, 4) - x(l, 1)*x(l, 5))*(1.0_wp/root2) - x(l, 2)*x(l, 5)*(1.0_wp/root6)
      ! It is of third degree.
      j3(l) = (x(l, 1)*t(l, 1) + x(l, 2)*t(l, 2) + x(l, 3)*t(l, 3) + x(l, 4)*t(l, 4) &
               + x(l, 5)*t(l, 5))*(1.0_wp/3.0_wp)
    end do
  end subroutine find_invariants

  !> Hershey's function to the power m, (3 J2)^k P(u) with k = m/2, and its derivatives by J2 and
  !! J3.
  pure subroutine hershey(yield, order, j2, j3, power, slope, curvature)
    type(invariant_yield_t), intent(in) :: yield
    integer, intent(in) :: order
    real(wp), intent(in) :: j2(lanes), j3(lanes)
    real(wp), intent(out) :: power(lanes), slope(lanes, n_arguments), curvature(lanes, n_packed)
    real(wp), parameter :: least = 1.0e-60_wp
    real(wp), dimension(lanes) :: first, w, u, p, p1, p2, root
    real(wp) :: k, g1, g2, u1
    integer :: j, l

    !$omp simd
    do l = 1, lanes
      first(l) = 1.0_wp/max(j2(l), least)
      w(l) = j3(l)*first(l)**2
      u(l) = 1.0_wp - 6.75_wp*w(l)*j3(l)*first(l)
      p(l) = yield%series(size(yield%series))
      p1(l) = 0.0_wp
      p2(l) = 0.0_wp
      root(l) = 1.0_wp
    end do
    do j = size(yield%series) - 1, 1, -1
      !$omp simd
      do l = 1, lanes
        p2(l) = p2(l)*u(l) + 2.0_wp*p1(l)
        p1(l) = p1(l)*u(l) + p(l)
        p(l) = p(l)*u(l) + yield%series(j)
      end do
    end do
    do j = 1, yield%exponent/2
      !$omp simd
      do l = 1, lanes
        root(l) = root(l)*(3.0_wp*j2(l))
      end do
    end do
    !$omp simd
    do l = 1, lanes
      power(l) = root(l)*p(l)
    end do
    if (order == 0) return
    k = 0.5_wp*yield%exponent
    !$omp simd private(g1, g2, u1)
    do l = 1, lanes
      ! u falls with J3 and grows with J2: J2 du/dJ2 = 3 (1 - u).
      u1 = 3.0_wp*(1.0_wp - u(l))
      g1 = u1*p1(l)
      g2 = u1*u1*p2(l)
      slope(l, 1) = root(l)*first(l)*(k*p(l) + g1)
      slope(l, 2) = -13.5_wp*root(l)*first(l)*w(l)*p1(l)
      curvature(l, 1) = root(l)*first(l)**2*(k*(k - 1.0_wp)*p(l) + (2.0_wp*k - 4.0_wp)*g1 + g2)
      curvature(l, 2) = -13.5_wp*root(l)*first(l)**2*w(l)*((k - 3.0_wp)*p1(l) + u1*p2(l))
      curvature(l, 3) = root(l)*first(l)*(182.25_wp*w(l)**2*p2(l)*first(l) &
                                          - 13.5_wp*first(l)**2*p1(l))
    end do
  end subroutine hershey

  !> That of two transforms and its derivatives by the five arguments.
  pure subroutine sum_powers(m, order, mean, j2, j3, power, slope, curvature)
    integer, intent(in) :: m                    !! exponent
    integer, intent(in) :: order
    real(wp), intent(in) :: mean(lanes), j2(lanes, 2), j3(lanes, 2)
    real(wp), intent(out) :: power(lanes), slope(lanes, n_arguments), curvature(lanes, n_packed)
    real(wp) :: series(2*width, 6, 0:most_of_two)
    integer :: b

    ! As many points at a time as leave the sums in registers.
    do b = 1, lanes, width
      call find_series(b, m, order, mean, j2, j3, series)
      call contract_values(b, m, series, power)
      if (order > 0) call contract_slopes(b, m, series, slope)
      if (order > 1) call contract_curvatures(b, m, series, curvature)
    end do
  end subroutine sum_powers

  !> Second derivatives of J2 and J3 of a transform by the stress, times the slopes by those.
  pure subroutine add_bends(a, inverse, by_j2, by_j3, x, hessian)
    type(transform_t), intent(in) :: a
    real(wp), intent(in) :: inverse(lanes), by_j2(lanes), by_j3(lanes), x(lanes, 5)
    real(wp), intent(inout) :: hessian(lanes, 15)
    real(wp) :: d, c, x1, x2, x3, x4, x5
    integer :: l

    !$omp simd private(d, c, x1, x2, x3, x4, x5)
    do l = 1, lanes
      d = inverse(l)*by_j2(l)
      c = inverse(l)*by_j3(l)
      x1 = c*x(l, 1); x2 = c*x(l, 2); x3 = c*x(l, 3); x4 = c*x(l, 4); x5 = c*x(l, 5)
      hessian(l, 1) = hessian(l, 1) + d*a%of_j2(1) + x1*a%of_j3(1, 1) + x2*a%of_j3(1, 2)
      hessian(l, 2) = hessian(l, 2) + d*a%of_j2(2) + x1*a%of_j3(2, 1) + x2*a%of_j3(2, 2)
      hessian(l, 3) = hessian(l, 3) + d*a%of_j2(3) + x1*a%of_j3(3, 1) + x2*a%of_j3(3, 2)
      hessian(l, 4) = hessian(l, 4) + x3*a%mixed(1, 1)
      hessian(l, 5) = hessian(l, 5) + x3*a%mixed(2, 1)
      hessian(l, 6) = hessian(l, 6) + d*a%of_j2(4) + x2*a%shears(1)
      hessian(l, 7) = hessian(l, 7) + x4*a%mixed(1, 2)
      hessian(l, 8) = hessian(l, 8) + x4*a%mixed(2, 2)
      hessian(l, 9) = hessian(l, 9) + x5*a%shears(2)
      hessian(l, 10) = hessian(l, 10) + d*a%of_j2(5) &
                       + (x1*(1.0_wp/root2) - x2*(1.0_wp/root6))*a%shears(3)
      hessian(l, 11) = hessian(l, 11) + x5*a%mixed(1, 3)
      hessian(l, 12) = hessian(l, 12) + x5*a%mixed(2, 3)
      hessian(l, 13) = hessian(l, 13) + x4*a%shears(4)
      hessian(l, 14) = hessian(l, 14) + x3*a%shears(5)
      hessian(l, 15) = hessian(l, 15) + d*a%of_j2(6) &
                       - (x1*(1.0_wp/root2) + x2*(1.0_wp/root6))*a%shears(6)
    end do
  end subroutine add_bends

end module invariant_yield
