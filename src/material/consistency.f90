!> The scalar equation of a return along a known direction: q - k dgamma = flow(dgamma).
module consistency
  use kinds, only: wp
  use flow_curve, only: flow_curve_t, flow_after, is_steep
  implicit none
  private

  public :: solve_consistency, solve_in_stages

contains

  !> Backward Euler: the root by Newton's method, kept in a bracket that bisection shortens where
  !! Newton leaves it. The flow stress never falls, so the root is unique and the bracket
  !! from 0 to (q - flow(0))/k holds it. Points below the flow stress get dgamma = 0.
  pure subroutine solve_consistency(curve, n, dt, q, stiffness, eqps, factor, dgamma, flow, ok)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: dt            !! [time]
    real(wp), intent(in) :: q(n)          !! equivalent trial stress
    real(wp), intent(in) :: stiffness(n)  !! k: what q loses by a unit of dgamma, 3G for von Mises
    real(wp), intent(in) :: eqps(n)       !! plastic strain before the increment
    real(wp), intent(in) :: factor(n)     !! on the flow stress, 1 at the first temperature
    real(wp), intent(out) :: dgamma(n)
    real(wp), intent(out) :: flow(n)      !! flow stress after it
    logical, intent(out) :: ok
    integer, parameter :: max_iterations = 400, most_newton = 30
    real(wp), parameter :: tolerance = 1.0e-13_wp
    real(wp) :: low(n), high(n), slope(n), residual, candidate
    integer :: l, iteration

    dgamma = 0.0_wp
    low = 0.0_wp
    call flow_after(curve, n, dt, eqps, factor, dgamma, flow, slope)
    high = max(q - flow, 0.0_wp)/stiffness
    ok = all(high <= 0.0_wp)
    do iteration = 1, max_iterations
      if (ok) exit
      do l = 1, n
        residual = q(l) - stiffness(l)*dgamma(l) - flow(l)
        if (residual > 0.0_wp) low(l) = dgamma(l)
        if (residual < 0.0_wp) high(l) = min(dgamma(l), high(l))
        candidate = min(dgamma(l) + residual/(stiffness(l) + slope(l)), high(l))
        if (candidate <= low(l) .or. iteration > most_newton) candidate = 0.5_wp*(low(l) + high(l))
        if (abs(residual) > tolerance*q(l)) dgamma(l) = max(candidate, 0.0_wp)
      end do
      call flow_after(curve, n, dt, eqps, factor, dgamma, flow, slope)
      ok = all(abs(q - stiffness*dgamma - flow) <= tolerance*q .or. dgamma <= 0.0_wp &
               .or. high - low <= 2.0_wp*epsilon(1.0_wp)*high)
    end do
  end subroutine solve_consistency

  !> The semi-implicit multi-stage scheme: one Newton step for each of the residual levels that
  !! fall evenly from that of the trial stress to zero (R. P. R. Cardoso and O. B. Adetoro,
  !! box 1 with (39) for the residual and (44) for the step). Where the flow stress rises too
  !! steeply for a first step of that kind, it goes to the very root of its level.
  pure subroutine solve_in_stages(curve, n_stages, n, dt, q, stiffness, eqps, factor, dgamma, flow)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n_stages, n
    real(wp), intent(in) :: dt, q(n), stiffness(n), eqps(n), factor(n)   !! as above
    real(wp), intent(out) :: dgamma(n), flow(n)
    real(wp) :: slope(n), first(n), level(n)
    integer :: l, stage
    logical :: ok

    dgamma = 0.0_wp
    call flow_after(curve, n, dt, eqps, factor, dgamma, flow, slope)
    first = max(q - flow, 0.0_wp)
    do stage = 1, n_stages
      level = first*real(n_stages - stage, wp)/n_stages
      if (stage == 1 .and. is_steep(curve)) then
        call solve_consistency(curve, n, dt, q - level, stiffness, eqps, factor, dgamma, flow, ok)
      else
        do l = 1, n
          if (first(l) > 0.0_wp) then
            dgamma(l) = dgamma(l) + (q(l) - stiffness(l)*dgamma(l) - flow(l) - level(l)) &
                        /(stiffness(l) + slope(l))
          end if
        end do
      end if
      call flow_after(curve, n, dt, eqps, factor, dgamma, flow, slope)
    end do
  end subroutine solve_in_stages

end module consistency
