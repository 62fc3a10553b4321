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
    real(wp), dimension(lanes) :: flow, slope, flow_bend, reach, q, fall, x
    real(wp) :: mode(lanes, 5), share(lanes, 5)
    integer :: iteration

    call into_modes(hill, problem%trial, mode)
    call begin(hill%weights, problem, mode, q, fall, dgamma)
    if (is_steep(curve)) &
      call solve_consistency(curve, lanes, problem%dt, q, max(fall/q**2, tiny(fall)), &
                             problem%eqps, problem%factor, problem%guess, dgamma, is_done)
    do iteration = 1, max_iterations
      call flow_after(curve, lanes, problem%dt, problem%eqps, problem%factor, problem%flow, &
                      dgamma, flow, slope, flow_bend, reach)
      call improve(is_rough(curve), hill%weights, problem%shear, mode, flow, slope, flow_bend, &
                   dgamma, x, share, is_done)
      if (is_done) exit
    end do
    call flow_of_modes(hill, mode, share, x, plastic)
  end subroutine return_to_hill

  !> Equivalent stress q of the trial stress, by how much half of its square falls with x =
  !! dgamma/flow, and the plastic strain of one step from there.
  pure subroutine begin(weights, problem, mode, q, fall, dgamma)
    real(wp), intent(in) :: weights(5), mode(lanes, 5)
    type(return_problem_t), intent(in) :: problem
    real(wp), intent(out), dimension(lanes) :: q, fall, dgamma
    real(wp) :: w(5, 3), m1, m2, m3, m4, m5, square, bend, per_flow, over, first, second
    integer :: l

    w(:, 1) = weights
    w(:, 2) = 2.0_wp*problem%shear*weights*w(:, 1)
    w(:, 3) = 2.0_wp*problem%shear*weights*w(:, 2)
    !$omp simd private(m1, m2, m3, m4, m5, square, bend, per_flow, over, first, second)
    do l = 1, lanes
      m1 = mode(l, 1)**2; m2 = mode(l, 2)**2; m3 = mode(l, 3)**2; m4 = mode(l, 4)**2
      m5 = mode(l, 5)**2
      square = (w(1, 1)*m1 + w(2, 1)*m2) + (w(3, 1)*m3 + w(4, 1)*m4) + (w(5, 1)*m5 + 1.0e-200_wp)
      q(l) = sqrt(square)
      fall(l) = (w(1, 2)*m1 + w(2, 2)*m2) + (w(3, 2)*m3 + w(4, 2)*m4) + w(5, 2)*m5
      bend = (w(1, 3)*m1 + w(2, 3)*m2) + (w(3, 3)*m3 + w(4, 3)*m4) + w(5, 3)*m5
      bend = 3.0_wp*(fall(l)**2 - square*bend)
      ! As in `halley`, for x = 0.
      per_flow = 1.0_wp/problem%flow(l)
      over = q(l) - problem%flow(l)
      first = fall(l) + square*q(l)*problem%slope(l)*per_flow
      second = per_flow*(bend - 2.0_wp*square*problem%slope(l)*first)
      dgamma(l) = max(2.0_wp*over*first*square/max(2.0_wp*first**2 + over*second, first**2, &
                                                   tiny(over)), 0.0_wp)
    end do
  end subroutine begin

  !> One step from a plastic strain; is it small enough at all points to be the last? All divisors
  !! of the modes by one division.
  pure subroutine improve(has_corners, weights, shear, mode, flow, slope, flow_bend, dgamma, x, &
                          share, is_done)
    logical, intent(in) :: has_corners             !! of the flow curve, see `is_rough`
    real(wp), intent(in) :: weights(5), shear, mode(lanes, 5)
    real(wp), intent(in), dimension(lanes) :: flow, slope
    real(wp), intent(in) :: flow_bend(lanes)       !! what the slope of the flow stress loses
    real(wp), intent(inout) :: dgamma(lanes)
    real(wp), intent(out) :: x(lanes)              !! dgamma/flow after the step
    real(wp), intent(out) :: share(lanes, 5)       !! what is left of each mode then
    logical, intent(out) :: is_done
    real(wp), parameter :: any_strain = 1.0e30_wp
    real(wp) :: d1, d2, d3, d4, d5, p1, p2, p3, p4, p5, square, q, fall, bend, per_flow, old
    real(wp) :: step, most, change, is_open, n_open
    integer :: l

    ! Of the squares of the steps as parts of the elastic strain.
    most = merge(1.0e-20_wp, 2.0e-9_wp, has_corners)
    most = (2.0_wp*shear)**2/most
    n_open = 0.0_wp
    associate (w => weights, c => 2.0_wp*shear)
      !$omp simd private(d1, d2, d3, d4, d5, p1, p2, p3, p4, p5, square, q, fall, bend, per_flow, &
      !$omp old, step, change, is_open) reduction(+:n_open)
      do l = 1, lanes
        per_flow = 1.0_wp/flow(l)
        old = dgamma(l)*per_flow
        call find_shares(w, c*old, d1, d2, d3, d4, d5)
        p1 = w(1)*(mode(l, 1)*d1)**2
        p2 = w(2)*(mode(l, 2)*d2)**2
        p3 = w(3)*(mode(l, 3)*d3)**2
        p4 = w(4)*(mode(l, 4)*d4)**2
        p5 = w(5)*(mode(l, 5)*d5)**2
        square = (p1 + p2) + (p3 + p4) + (p5 + 1.0e-200_wp)
        q = sqrt(square)
        p1 = c*w(1)*d1*p1; p2 = c*w(2)*d2*p2; p3 = c*w(3)*d3*p3; p4 = c*w(4)*d4*p4
        p5 = c*w(5)*d5*p5
        fall = (p1 + p2) + (p3 + p4) + p5
        bend = c*(w(1)*d1*p1 + w(2)*d2*p2 + w(3)*d3*p3 + w(4)*d4*p4 + w(5)*d5*p5)
        bend = 3.0_wp*(fall**2 - square*bend)
        step = halley(q, square, fall, bend, flow(l), per_flow, slope(l), flow_bend(l), old)
        ! Points inside the yield surface have dgamma = 0 and stay there.
        step = max(min(step, any_strain*dgamma(l)), -0.5_wp*dgamma(l))
        ! Counted, for a largest value would pass over what is not a number.
        is_open = 1.0_wp
        if (most*(step*per_flow)**2 <= 1.0_wp .and. q <= huge(step)) is_open = 0.0_wp
        n_open = n_open + is_open
        dgamma(l) = dgamma(l) + step
        ! Over the new flow stress, and the shares there: series are enough next to the end.
        change = step*per_flow*(slope(l) - 0.5_wp*flow_bend(l)*step)
        x(l) = dgamma(l)*per_flow*(1.0_wp - change + change**2)
        change = c*(x(l) - old)
        share(l, 1) = share_after(d1, w(1)*change)
        share(l, 2) = share_after(d2, w(2)*change)
        share(l, 3) = share_after(d3, w(3)*change)
        share(l, 4) = share_after(d4, w(4)*change)
        share(l, 5) = share_after(d5, w(5)*change)
      end do
    end associate
    is_done = n_open <= 0.0_wp
  end subroutine improve

  !> What is left of a mode where its divisor has grown by a little: d/(1 + d growth).
  pure real(wp) function share_after(d, growth)
    real(wp), intent(in) :: d, growth

    share_after = d*(1.0_wp - d*growth*(1.0_wp - d*growth))
  end function share_after

  !> A step of Halley's method, never more than twice that of Newton's: of the function and its
  !! derivatives by the plastic strain, times q flow; those times q^2 and q^4.
  pure real(wp) function halley(q, square, fall, bend, flow, per_flow, slope, flow_bend, x)
    real(wp), intent(in) :: q, square           !! equivalent stress, its square
    real(wp), intent(in) :: fall                !! by how much half of the square falls with x
    real(wp), intent(in) :: bend                !! second derivative of 1/q by x, times q^5
    real(wp), intent(in) :: flow, per_flow      !! flow stress, 1/flow
    real(wp), intent(in) :: slope, flow_bend    !! of the flow stress, and what that loses
    real(wp), intent(in) :: x                   !! dgamma/flow
    real(wp) :: first, second, u, over

    over = q - flow
    u = 1.0_wp - x*slope
    first = fall*u + square*q*slope*per_flow
    second = flow_bend + 2.0_wp*slope**2*per_flow
    second = bend*u**2 - square*(2.0_wp*fall*slope*u + square*q*second)
    second = per_flow*second + fall*square*x*flow_bend
    halley = 2.0_wp*over*first*square/max(2.0_wp*first**2 + over*second, first**2, tiny(over))
  end function halley

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
  pure subroutine flow_of_modes(hill, mode, share, x, plastic)
    type(quadratic_t), intent(in) :: hill
    real(wp), intent(in) :: mode(lanes, 5), share(lanes, 5), x(lanes)
    real(wp), intent(out) :: plastic(lanes, 5)
    real(wp) :: d1, d2
    integer :: l

    !$omp simd private(d1, d2)
    do l = 1, lanes
      d1 = x(l)*hill%weights(1)*mode(l, 1)*share(l, 1)
      d2 = x(l)*hill%weights(2)*mode(l, 2)*share(l, 2)
      plastic(l, 1) = hill%modes(1, 1)*d1 + hill%modes(1, 2)*d2
      plastic(l, 2) = hill%modes(2, 1)*d1 + hill%modes(2, 2)*d2
      plastic(l, 3) = x(l)*hill%weights(3)*mode(l, 3)*share(l, 3)
      plastic(l, 4) = x(l)*hill%weights(4)*mode(l, 4)*share(l, 4)
      plastic(l, 5) = x(l)*hill%weights(5)*mode(l, 5)*share(l, 5)
    end do
  end subroutine flow_of_modes

end module hill_return
