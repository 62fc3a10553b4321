!> The consistency condition along a known direction of flow, the scalar equation
!! q - k dgamma = flow(dgamma), for a row of points.
module consistency
  use kinds, only: wp
  use flow_curve, only: flow_curve_t, flow_at, flow_after, is_steep, has_rate, has_corners
  implicit none
  private

  public :: solve_consistency, solve_in_stages, begin_at, advance

  integer, parameter, public :: max_iterations = 400   !! of `advance`, which then has long halved
  real(wp), parameter :: tolerance = 1.0e-13_wp   !! of the residual, relative to q

contains

  !> Backward Euler: the root, see `advance`. The flow stress never falls, so the root is unique and
  !! the bracket from 0 to (q - flow(0))/k holds it. Points below the flow stress get dgamma = 0.
  pure subroutine solve_consistency(curve, n, dt, q, stiffness, eqps, factor, guess, dgamma, ok)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: dt            !! [time]
    real(wp), intent(in) :: q(n)          !! equivalent trial stress
    real(wp), intent(in) :: stiffness(n)  !! k: what q loses by a unit of dgamma, 3G for von Mises
    real(wp), intent(in) :: eqps(n)       !! plastic strain before the increment
    real(wp), intent(in) :: factor(n)     !! on the flow stress, 1 at the first temperature
    real(wp), intent(in) :: guess(n)      !! of dgamma, see `begin_at`
    real(wp), intent(out) :: dgamma(n)
    logical, intent(out) :: ok
    real(wp), dimension(n) :: low, high, last, first, flow, slope, bend, reach
    real(wp) :: known(n, 2), total
    integer :: l, iteration

    call flow_at(curve, n, eqps, factor, first, slope, bend, reach)
    total = 0.0_wp
    !$omp simd reduction(+:total)
    do l = 1, n
      high(l) = max(q(l) - first(l), 0.0_wp)/stiffness(l)
      low(l) = 0.0_wp
      last(l) = 0.0_wp
      total = total + first(l)
    end do
    dgamma = 0.0_wp
    ok = abs(total) <= huge(total)     ! a largest value would pass over what is not a number
    if (.not. ok) return
    call begin_at(curve, n, slope, stiffness, high, guess, dgamma)
    known(1, 1) = 0.0_wp
    do iteration = 1, max_iterations
      if (iteration > 1 .or. any(dgamma > 0.0_wp)) then
        call flow_after(curve, n, dt, eqps, factor, first, dgamma, flow, slope, bend, reach, known)
      else
        flow = first
      end if
      !$omp simd
      do l = 1, n
        flow(l) = q(l) - stiffness(l)*dgamma(l) - flow(l)
        slope(l) = stiffness(l) + slope(l)
      end do
      call advance(curve, n, iteration, q, flow, slope, bend, reach, low, high, last, dgamma, ok)
      if (ok) exit
    end do
  end subroutine solve_consistency

  !> Where the solution begins: at zero, or at a guess, such as the increment of the equivalent
  !! strain, where the slope at zero says nothing.
  pure subroutine begin_at(curve, n, slope, stiffness, high, guess, dgamma)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: slope(n), stiffness(n)   !! without rate, at dgamma = 0
    real(wp), intent(in) :: high(n)        !! most that dgamma can be, 0 where nothing flows
    real(wp), intent(in) :: guess(n)
    real(wp), intent(out) :: dgamma(n)
    real(wp), parameter :: too_steep = 10.0_wp       ! slope over stiffness
    real(wp) :: start
    integer :: l

    if (has_rate(curve)) then
      dgamma = min(merge(guess, high, guess > 0.0_wp), high)
      return
    end if
    if (is_steep(curve)) then
      !$omp simd private(start)
      do l = 1, n
        start = merge(guess(l), high(l), guess(l) > 0.0_wp)
        dgamma(l) = merge(min(start, high(l)), 0.0_wp, slope(l) > too_steep*stiffness(l))
      end do
    else
      dgamma = 0.0_wp
    end if
  end subroutine begin_at

  !> One step towards the root of residuals that fall with `dgamma`, for all points of a row: of
  !! Newton's method with the curvature, kept in a bracket that is halved where the step leaves it
  !! or many have been taken.
  !!
  !! A step is the last if its square leaves less than the tolerance. What a step has left shows
  !! in the next residual and falls with its square at least, so that the second step is mostly the
  !! last one. Points with less than the tolerance are left alone.
  pure subroutine advance(curve, n, iteration, q, residual, fall, bend, reach, low, high, last, &
                          dgamma, is_done)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n, iteration           !! of the steps, from 1
    real(wp), intent(in), dimension(n) :: q       !! of which the tolerance is a part [stress]
    real(wp), intent(in), dimension(n) :: residual, fall, bend   !! and its first two derivatives
    real(wp), intent(in), dimension(n) :: reach   !! further dgamma up to which they hold
    real(wp), intent(inout), dimension(n) :: low, high, dgamma   !! bracket, high = 0: inactive
    real(wp), intent(inout), dimension(n) :: last !! square of the last step, 0 at first
    logical, intent(out) :: is_done               !! all points

    if (has_corners(curve)) then
      call advance_over_corners(n, iteration, q, residual, fall, bend, reach, low, high, last, &
                                dgamma, is_done)
    else
      call advance_smoothly(n, iteration, q, residual, fall, bend, low, high, last, dgamma, is_done)
    end if
  end subroutine advance

  pure subroutine advance_over_corners(n, iteration, q, residual, fall, bend, reach, low, high, &
                                       last, dgamma, is_done)
#define WITH_CORNERS
#include "bracketed_step.inc"
#undef WITH_CORNERS
  end subroutine advance_over_corners

  pure subroutine advance_smoothly(n, iteration, q, residual, fall, bend, low, high, last, dgamma, &
                                   is_done)
#include "bracketed_step.inc"
  end subroutine advance_smoothly

  !> The semi-implicit multi-stage scheme: one Newton step for each of the residual levels that
  !! fall evenly from that of the trial stress to zero (R. P. R. Cardoso and O. B. Adetoro,
  !! box 1 with (39) for the residual and (44) for the step). Where the flow stress rises too
  !! steeply for a first step of that kind, it goes to the very root of its level.
  pure subroutine solve_in_stages(curve, n_stages, n, dt, q, stiffness, eqps, factor, guess, dgamma)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n_stages, n
    real(wp), intent(in) :: dt, q(n), stiffness(n), eqps(n), factor(n), guess(n)   !! as above
    real(wp), intent(out) :: dgamma(n)
    real(wp), dimension(n) :: start, flow, slope, bend, reach, first
    real(wp) :: level
    integer :: l, stage
    logical :: ok

    call flow_at(curve, n, eqps, factor, start, slope, bend, reach)
    dgamma = 0.0_wp
    do stage = 1, n_stages
      call flow_after(curve, n, dt, eqps, factor, start, dgamma, flow, slope, bend, reach)
      if (stage == 1) first = max(q - flow, 0.0_wp)
      level = real(n_stages - stage, wp)/n_stages
      if (stage == 1 .and. is_steep(curve)) then
        call solve_consistency(curve, n, dt, q - level*first, stiffness, eqps, factor, guess, &
                               dgamma, ok)
      else
        !$omp simd
        do l = 1, n
          ! A point inside the yield surface stays there.
          if (first(l) > 0.0_wp) dgamma(l) = dgamma(l) &
            + (q(l) - stiffness(l)*dgamma(l) - flow(l) - level*first(l))/(stiffness(l) + slope(l))
        end do
      end if
    end do
  end subroutine solve_in_stages

end module consistency
