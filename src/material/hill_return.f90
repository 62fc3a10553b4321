!> Return mapping to Hill's quadratic yield surface, `lanes` points at a time: backward Euler.
!!
!! In the modes of the yield function its equations part (J. C. Simo and R. L. Taylor, IJNME 22
!! (1986), for plane stress): each mode of the trial stress is divided by
!! 1 + 2G weight dgamma/flow, and one scalar equation for dgamma is left.
module hill_return
  use kinds, only: wp
  use deviator_lanes, only: lanes
  use flow_curve, only: flow_curve_t, flow_after, is_rough, is_steep
  use consistency, only: solve_consistency
  use return_problem, only: return_problem_t
  use yield_function, only: quadratic_t
  implicit none
  private

  public :: return_to_hill

contains

  !> Plastic strain of the points that flow: Halley's method on 1/q - 1/flow, which is nearly
  !! straight, from no plastic strain on. It ends with a step whose cube, which bounds what is left,
  !! is small enough. It has no bracket: points that do not get there in a few steps, such as next
  !! to corners of the flow curve, are left to another method.
  pure subroutine return_to_hill(curve, hill, problem, plastic, dgamma, is_done)
    type(flow_curve_t), intent(in) :: curve
    type(quadratic_t), intent(in) :: hill
    type(return_problem_t), intent(in) :: problem  !! without back stresses
    real(wp), intent(out) :: plastic(lanes, 5)     !! strain of the increment
    real(wp), intent(out) :: dgamma(lanes)
    logical, intent(out) :: is_done
    integer, parameter :: max_iterations = 15
    real(wp), dimension(lanes) :: flow, slope, flow_bend, reach, q, fall, bend, x, per_flow
    real(wp) :: mode(lanes, 5)
    integer :: l, iteration

    call into_modes(hill, problem%trial, mode)
    !$omp simd
    do l = 1, lanes
      x(l) = 0.0_wp
      per_flow(l) = 1.0_wp/problem%flow(l)
    end do
    call equivalent_of_trial(hill%weights, problem%shear, mode, q, fall, bend)
    if (is_steep(curve)) then
      call solve_consistency(curve, lanes, problem%dt, q, max(fall/q**2, tiny(fall)), &
                             problem%eqps, problem%factor, problem%guess, dgamma, is_done)
    else
      flow_bend = 0.0_wp
      call halley(q, fall, bend, problem%flow, per_flow, problem%slope, flow_bend, x, dgamma)
      dgamma = max(dgamma, 0.0_wp)
    end if
    do iteration = 1, max_iterations
      call flow_after(curve, lanes, problem%dt, problem%eqps, problem%factor, problem%flow, &
                      dgamma, flow, slope, flow_bend, reach)
      !$omp simd
      do l = 1, lanes
        per_flow(l) = 1.0_wp/flow(l)
        x(l) = dgamma(l)*per_flow(l)
      end do
      call equivalent(hill%weights, problem%shear, mode, x, q, fall, bend)
      call improve(is_rough(curve), problem%shear, q, fall, bend, flow, per_flow, slope, &
                   flow_bend, dgamma, x, is_done)
      if (is_done) exit
    end do
    call flow_of_modes(hill, problem%shear, mode, x, plastic)
  end subroutine return_to_hill

  !> One step from a plastic strain; is it small enough at all points to be the last?
  pure subroutine improve(has_corners, shear, q, fall, bend, flow, per_flow, slope, flow_bend, &
                          dgamma, x, is_done)
    logical, intent(in) :: has_corners          !! of the flow curve, see `is_rough`
    real(wp), intent(in) :: shear
    real(wp), intent(in), dimension(lanes) :: q, fall, bend, flow, per_flow, slope
    real(wp), intent(in) :: flow_bend(lanes)    !! what the slope of the flow stress loses
    real(wp), intent(inout), dimension(lanes) :: dgamma, x
    logical, intent(out) :: is_done
    real(wp), parameter :: any_strain = 1.0e30_wp
    real(wp) :: steps(lanes), step, most, change, is_open, n_open
    integer :: l

    ! Of the squares of the steps as parts of the elastic strain.
    most = merge(1.0e-20_wp, 2.0e-9_wp, has_corners)
    most = (2.0_wp*shear)**2/most
    call halley(q, fall, bend, flow, per_flow, slope, flow_bend, x, steps)
    n_open = 0.0_wp
    !$omp simd private(step, change, is_open) reduction(+:n_open)
    do l = 1, lanes
      ! Points inside the yield surface have dgamma = 0 and stay there.
      step = max(min(steps(l), any_strain*dgamma(l)), -0.5_wp*dgamma(l))
      ! Counted, for a largest value would pass over what is not a number.
      is_open = 1.0_wp
      if (most*(step*per_flow(l))**2 <= 1.0_wp .and. q(l) <= huge(step)) is_open = 0.0_wp
      n_open = n_open + is_open
      dgamma(l) = dgamma(l) + step
      ! Over the new flow stress: the series is enough next to the end.
      change = step*per_flow(l)*(slope(l) - 0.5_wp*flow_bend(l)*step)
      x(l) = dgamma(l)*per_flow(l)*(1.0_wp - change + change**2)
    end do
    is_done = n_open <= 0.0_wp
  end subroutine improve

  !> Steps of Halley's method, never more than twice those of Newton's: of the function and its
  !! derivatives by the plastic strain, times q flow; those times q^2 and q^4.
  pure subroutine halley(q, fall, bend, flow, per_flow, slope, flow_bend, x, step)
    real(wp), intent(in), dimension(lanes) :: q, fall, bend     !! of `equivalent`
    real(wp), intent(in), dimension(lanes) :: flow, per_flow, slope   !! flow stress, 1/flow
    real(wp), intent(in), dimension(lanes) :: flow_bend, x      !! loss of the slope, dgamma/flow
    real(wp), intent(out) :: step(lanes)
    real(wp) :: first, second, u, square, over
    integer :: l

    !$omp simd private(first, second, u, square, over)
    do l = 1, lanes
      over = q(l) - flow(l)
      square = q(l)**2
      u = 1.0_wp - x(l)*slope(l)
      first = fall(l)*u + square*q(l)*slope(l)*per_flow(l)
      second = flow_bend(l) + 2.0_wp*slope(l)**2*per_flow(l)
      second = bend(l)*u**2 - square*(2.0_wp*fall(l)*slope(l)*u + square*q(l)*second)
      second = per_flow(l)*second + fall(l)*square*x(l)*flow_bend(l)
      step(l) = 2.0_wp*over*first*square/max(2.0_wp*first**2 + over*second, first**2, tiny(over))
    end do
  end subroutine halley

  !> What `equivalent` finds for x = 0, without a division.
  pure subroutine equivalent_of_trial(weights, shear, mode, q, fall, bend)
    real(wp), intent(in) :: weights(5), shear, mode(lanes, 5)
    real(wp), intent(out), dimension(lanes) :: q, fall, bend
    real(wp) :: w(5, 3), m1, m2, m3, m4, m5, square
    integer :: l

    w(:, 1) = weights
    w(:, 2) = 2.0_wp*shear*weights*w(:, 1)
    w(:, 3) = 2.0_wp*shear*weights*w(:, 2)
    !$omp simd private(m1, m2, m3, m4, m5, square)
    do l = 1, lanes
      m1 = mode(l, 1)**2; m2 = mode(l, 2)**2; m3 = mode(l, 3)**2; m4 = mode(l, 4)**2
      m5 = mode(l, 5)**2
      square = (w(1, 1)*m1 + w(2, 1)*m2) + (w(3, 1)*m3 + w(4, 1)*m4) + (w(5, 1)*m5 + 1.0e-200_wp)
      q(l) = sqrt(square)
      fall(l) = (w(1, 2)*m1 + w(2, 2)*m2) + (w(3, 2)*m3 + w(4, 2)*m4) + w(5, 2)*m5
      bend(l) = (w(1, 3)*m1 + w(2, 3)*m2) + (w(3, 3)*m3 + w(4, 3)*m4) + w(5, 3)*m5
      bend(l) = 3.0_wp*(fall(l)**2 - square*bend(l))
    end do
  end subroutine equivalent_of_trial

  !> Equivalent stress q of modes over 1 + 2G weight x, by how much half of its square falls with x,
  !! and the second derivative of 1/q by x, times q^5. All divisors by one division.
  pure subroutine equivalent(weights, shear, mode, x, q, fall, bend)
    real(wp), intent(in) :: weights(5), shear, mode(lanes, 5), x(lanes)
    real(wp), intent(out), dimension(lanes) :: q, fall, bend
    real(wp) :: d1, d2, d3, d4, d5, p1, p2, p3, p4, p5, square
    integer :: l

    associate (w => weights, c => 2.0_wp*shear)
      !$omp simd private(d1, d2, d3, d4, d5, p1, p2, p3, p4, p5, square)
      do l = 1, lanes
        call find_shares(w, c*x(l), d1, d2, d3, d4, d5)
        p1 = w(1)*(mode(l, 1)*d1)**2
        p2 = w(2)*(mode(l, 2)*d2)**2
        p3 = w(3)*(mode(l, 3)*d3)**2
        p4 = w(4)*(mode(l, 4)*d4)**2
        p5 = w(5)*(mode(l, 5)*d5)**2
        square = (p1 + p2) + (p3 + p4) + (p5 + 1.0e-200_wp)
        q(l) = sqrt(square)
        d1 = c*w(1)*d1; d2 = c*w(2)*d2; d3 = c*w(3)*d3; d4 = c*w(4)*d4; d5 = c*w(5)*d5
        p1 = p1*d1; p2 = p2*d2; p3 = p3*d3; p4 = p4*d4; p5 = p5*d5
        fall(l) = (p1 + p2) + (p3 + p4) + p5
        bend(l) = 3.0_wp*(fall(l)**2 - square*(p1*d1 + p2*d2 + p3*d3 + p4*d4 + p5*d5))
      end do
    end associate
  end subroutine equivalent

  !> What is left of each mode.
  pure subroutine find_shares(w, y, d1, d2, d3, d4, d5)
    real(wp), intent(in) :: w(5), y
    real(wp), intent(out) :: d1, d2, d3, d4, d5
    real(wp) :: a1, a2, a3, a4, a5, inverse, of_first, of_second

    a1 = 1.0_wp + w(1)*y
    a2 = 1.0_wp + w(2)*y
    a3 = 1.0_wp + w(3)*y
    a4 = 1.0_wp + w(4)*y
    a5 = 1.0_wp + w(5)*y
    inverse = 1.0_wp/((a1*a2)*(a3*a4)*a5)
    of_first = inverse*a5*(a3*a4)
    of_second = inverse*a5*(a1*a2)
    d1 = of_first*a2
    d2 = of_first*a1
    d3 = of_second*a4
    d4 = of_second*a3
    d5 = inverse*(a1*a2)*(a3*a4)
  end subroutine find_shares

  !> Modes of deviators.
  pure subroutine into_modes(hill, s, mode)
    type(quadratic_t), intent(in) :: hill
    real(wp), intent(in) :: s(lanes, 5)
    real(wp), intent(out) :: mode(lanes, 5)
    integer :: l

    mode(:, 3:) = s(:, 3:)
    !$omp simd
    do l = 1, lanes
      mode(l, 1) = hill%modes(1, 1)*s(l, 1) + hill%modes(2, 1)*s(l, 2)
      mode(l, 2) = hill%modes(1, 2)*s(l, 1) + hill%modes(2, 2)*s(l, 2)
    end do
  end subroutine into_modes

  !> Plastic strain, along the normal at what is left.
  pure subroutine flow_of_modes(hill, shear, mode, x, plastic)
    type(quadratic_t), intent(in) :: hill
    real(wp), intent(in) :: shear, mode(lanes, 5), x(lanes)
    real(wp), intent(out) :: plastic(lanes, 5)
    real(wp) :: d1, d2, d3, d4, d5
    integer :: l

    !$omp simd private(d1, d2, d3, d4, d5)
    do l = 1, lanes
      call find_shares(hill%weights, 2.0_wp*shear*x(l), d1, d2, d3, d4, d5)
      d1 = x(l)*hill%weights(1)*mode(l, 1)*d1
      d2 = x(l)*hill%weights(2)*mode(l, 2)*d2
      plastic(l, 1) = hill%modes(1, 1)*d1 + hill%modes(1, 2)*d2
      plastic(l, 2) = hill%modes(2, 1)*d1 + hill%modes(2, 2)*d2
      plastic(l, 3) = x(l)*hill%weights(3)*mode(l, 3)*d3
      plastic(l, 4) = x(l)*hill%weights(4)*mode(l, 4)*d4
      plastic(l, 5) = x(l)*hill%weights(5)*mode(l, 5)*d5
    end do
  end subroutine flow_of_modes

end module hill_return
