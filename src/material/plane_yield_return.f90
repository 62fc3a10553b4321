!> Return mapping to a yield surface of `plane_yield` in plane stress with any flow curve, `lanes`
!! points at a time.
!!
!! Stresses are those of the yield function in the axes of the material, and so are their elastic
!! moduli M. With B, a stiffness over M, backward Euler is the projection of the trial stress onto
!! the yield surface in the metric of B: B times the stress is B times the trial stress less the
!! stiffness times dgamma times the gradient.
!!
!! Newton's method for stress and plastic strain together, with a line search (W. M. Scherzinger,
!! CMAME 317 (2017)). It starts on the yield surface in the direction of the stress before the
!! increment, with the plastic strain of the tangent plane there, which is never too much: under
!! continued loading one or two steps are left. Where it does not converge, residual levels that
!! fall to zero lead there (J. W. Yoon, D. Y. Yang and K. Chung, CMAME 174 (1999)).
!!
!! With back stresses the stress in the yield function is the relative one. Its trial stress, its
!! moduli and so its metric change with the plastic strain, which fades the back stresses.
module plane_yield_return
  use kinds, only: wp
  use deviator_lanes, only: lanes
  use flow_curve, only: flow_curve_t, flow_after, is_rough, is_steep
  use hardening, only: back_stresses_t
  use consistency, only: solve_consistency
  use plane_steps, only: just_above
  use plane_yield, only: plane_yield_t, evaluate_plane_yield, slope_in_plane, excess_in_plane
  implicit none
  private

  public :: new_plane_problem, return_in_plane

  !> The points before the return, and what of them moves with it. Without back stresses nothing
  !! but the outset does.
  type, public :: plane_problem_t
    real(wp) :: eqps(lanes), factor(lanes)      !! before the increment; factor on the flow stress
    real(wp) :: flow(lanes), slope(lanes)       !! flow stress and slope there
    real(wp) :: guess(lanes)                    !! of the plastic strain, see `begin_at`
    real(wp) :: whole(lanes, 3)                 !! trial stress; with back stresses only
    real(wp) :: trial(lanes, 3)                 !! the same, less the back stresses that are left
    real(wp) :: outset(lanes, 3)                !! stress whose direction is the start
    real(wp) :: stiffness                       !! [stress]
    real(wp) :: moduli(4)                       !! M of the stress [stress]: 11, 12, 22 and 33
    real(wp) :: modes(4)                        !! the same of a plastic modulus of 1, see `modulus`
    real(wp) :: metric(lanes, 4)                !! B
    real(wp) :: dt                              !! [time]
    real(wp) :: modulus(lanes)                  !! plastic modulus of the back stresses [stress]
    real(wp) :: fading(lanes, 3), fading_modulus(lanes)   !! slopes of `trial` and `modulus`
    real(wp) :: pull(lanes, 3)                  !! slope of the residual of the strain that fading
                                                !! adds [stress]
  end type plane_problem_t

  !> State of the iteration: stress, plastic strain, and what follows from them.
  type :: iterate_t
    real(wp) :: stress(lanes, 3), dgamma(lanes)
    real(wp) :: q(lanes), gradient(lanes, 3), hessian(lanes, 6), flow(lanes), slope(lanes)
    real(wp) :: size_ratio(lanes)         !! of the stress of the Hessian to that above
  end type iterate_t

  !> Newton's step from an iterate.
  type :: step_t
    real(wp) :: inverse(lanes, 6)         !! of the matrix: see `invert`
    real(wp) :: change(lanes, 4)          !! of stress and plastic strain
    real(wp) :: residual(lanes)           !! sum of squared residuals before it [stress^2]
  end type step_t

  !> Where each point stands in its line search. What is true or false is 1 or 0: so the loops
  !! vectorise.
  type :: search_t
    real(wp) :: change(lanes, 4), before(lanes)  !! the last step that was taken, see `step_t`
    real(wp) :: length(lanes), tries(lanes)      !! fraction of the step, how often it was cut
    real(wp) :: open(lanes)                      !! 1: not yet converged
  end type search_t

  real(wp), parameter :: error = 1.0e-12_wp      !! of residuals, over the flow stress

contains

  !> A problem without points, from the elastic moduli.
  pure function new_plane_problem(stiffness, moduli, modes) result(problem)
    real(wp), intent(in) :: stiffness, moduli(4), modes(4)   !! see `plane_problem_t`
    type(plane_problem_t) :: problem

    problem%stiffness = stiffness
    problem%moduli = moduli
    problem%modes = modes
    problem%modulus = 0.0_wp
    problem%fading = 0.0_wp
    problem%fading_modulus = 0.0_wp
    problem%pull = 0.0_wp
    call set_metric(problem)
  end function new_plane_problem

  !> The metric of the moduli with those of back stresses.
  pure subroutine set_metric(problem)
    type(plane_problem_t), intent(inout) :: problem
    real(wp) :: m1, m2, m3, per
    integer :: l

    associate (m => problem%moduli, n => problem%modes, h => problem%modulus)
      !$omp simd private(m1, m2, m3, per)
      do l = 1, lanes
        m1 = m(1) + h(l)*n(1)
        m2 = m(2) + h(l)*n(2)
        m3 = m(3) + h(l)*n(3)
        per = problem%stiffness/(m1*m3 - m2*m2)
        problem%metric(l, 1) = per*m3
        problem%metric(l, 2) = -per*m2
        problem%metric(l, 3) = per*m1
        problem%metric(l, 4) = problem%stiffness/(m(4) + h(l)*n(4))
      end do
    end associate
  end subroutine set_metric

  !> The trial stress less the back stresses, their plastic modulus, and the slopes of both, with a
  !! plastic strain that has faded the back stresses.
  pure subroutine move_trial(kinematic, back, dgamma, problem)
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: back(lanes, 3, kinematic%n), dgamma(lanes)
    type(plane_problem_t), intent(inout) :: problem
    real(wp) :: left(lanes)
    integer :: i, k

    problem%trial = problem%whole
    problem%modulus = 0.0_wp
    problem%fading = 0.0_wp
    problem%fading_modulus = 0.0_wp
    do k = 1, kinematic%n
      associate (c => kinematic%modulus(k), gamma => kinematic%recall(k))
        left = 1.0_wp/(1.0_wp + gamma*dgamma)
        problem%modulus = problem%modulus + c*left
        problem%fading_modulus = problem%fading_modulus - gamma*c*left**2
        do i = 1, 3
          problem%trial(:, i) = problem%trial(:, i) - left*back(:, i, k)
          problem%fading(:, i) = problem%fading(:, i) + gamma*left**2*back(:, i, k)
        end do
      end associate
    end do
    call set_metric(problem)
  end subroutine move_trial

  !> How the residual of the strain changes as the back stresses fade, see `find_step`.
  pure subroutine find_pull(now, problem)
    type(iterate_t), intent(in) :: now
    type(plane_problem_t), intent(inout) :: problem
    real(wp) :: y1, y2, y3, z1, z2, z3, per
    integer :: l

    associate (b => problem%metric, n => problem%modes, s => now%stress, t => problem%trial)
      !$omp simd private(y1, y2, y3, z1, z2, z3, per)
      do l = 1, lanes
        z1 = s(l, 1) - t(l, 1)
        z2 = s(l, 2) - t(l, 2)
        y1 = b(l, 1)*z1 + b(l, 2)*z2
        y2 = b(l, 2)*z1 + b(l, 3)*z2
        y3 = b(l, 4)*(s(l, 3) - t(l, 3))
        per = problem%fading_modulus(l)/problem%stiffness
        z1 = problem%fading(l, 1) + per*(n(1)*y1 + n(2)*y2)
        z2 = problem%fading(l, 2) + per*(n(2)*y1 + n(3)*y2)
        z3 = problem%fading(l, 3) + per*n(4)*y3
        problem%pull(l, 1) = -(b(l, 1)*z1 + b(l, 2)*z2)
        problem%pull(l, 2) = -(b(l, 2)*z1 + b(l, 3)*z2)
        problem%pull(l, 3) = -b(l, 4)*z3
      end do
    end associate
  end subroutine find_pull

  !> Plastic flow of the points that do; the others keep zeros.
  pure subroutine return_in_plane(curve, yield, kinematic, back, problem, overstress, dgamma, ok)
    type(flow_curve_t), intent(in) :: curve
    type(plane_yield_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: back(lanes, 3, kinematic%n)
    type(plane_problem_t), intent(inout) :: problem
    real(wp), intent(out) :: overstress(lanes, 3)      !! by which the trial stress falls
    real(wp), intent(out) :: dgamma(lanes)
    logical, intent(out) :: ok
    integer, parameter :: counts(4) = [1, 5, 25, 125]
    type(iterate_t) :: now
    real(wp), dimension(lanes) :: first, level, left, good, reach, resistance
    integer :: attempt, i

    overstress = 0.0_wp
    dgamma = 0.0_wp
    if (kinematic%n > 0) then
      problem%whole = problem%trial
      call move_trial(kinematic, back, dgamma, problem)
      problem%outset = problem%outset - sum(back, 3)
    end if
    call find_flowing(yield, problem, now, left, reach, resistance, ok)
    if (.not. (ok .and. sum(left) > 0.0_wp)) return
    call find_poor(problem, now, reach, left, good)
    call start(curve, yield, kinematic, back, problem, 1, good, reach, resistance, level, first, &
               now)
    call climb(curve, yield, kinematic, back, problem, left, now, ok)
    if (ok) call keep(kinematic, back, left, problem, now, overstress, dgamma)
    do attempt = 1, size(counts)
      if (ok) exit
      good = left
      do i = 1, counts(attempt)
        if (i == 1) then
          call start(curve, yield, kinematic, back, problem, counts(attempt), left, reach, &
                     resistance, level, first, now)
        else
          level = level_at(i, counts(attempt), first, problem%flow)
          call evaluate(curve, yield, kinematic, back, problem, level, .true., now)
        end if
        call iterate(curve, yield, kinematic, back, problem, level, good, now)
      end do
      call keep(kinematic, back, good, problem, now, overstress, dgamma)
      left = left*(1.0_wp - good)
      ok = .not. sum(left) > 0.0_wp
    end do
  end subroutine return_in_plane

  !> Keep what some points have come to: the plastic strain, and by how much it lets the stress
  !! fall, M/k times what it does in the metric.
  pure subroutine keep(kinematic, back, good, problem, now, overstress, dgamma)
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: back(lanes, 3, kinematic%n), good(lanes)
    type(plane_problem_t), intent(inout) :: problem
    type(iterate_t), intent(in) :: now
    real(wp), intent(inout) :: overstress(lanes, 3), dgamma(lanes)
    real(wp) :: fall(lanes, 3), z1, z2, y1, y2, per
    integer :: i, l

    if (kinematic%n > 0) call move_trial(kinematic, back, now%dgamma, problem)
    fall = problem%trial - now%stress
    if (kinematic%n > 0) then
      per = 1.0_wp/problem%stiffness
      associate (m => problem%moduli, b => problem%metric)
        !$omp simd private(z1, z2, y1, y2)
        do l = 1, lanes
          z1 = per*fall(l, 1)
          z2 = per*fall(l, 2)
          y1 = b(l, 1)*z1 + b(l, 2)*z2
          y2 = b(l, 2)*z1 + b(l, 3)*z2
          fall(l, 1) = m(1)*y1 + m(2)*y2
          fall(l, 2) = m(2)*y1 + m(3)*y2
          fall(l, 3) = m(4)*b(l, 4)*(per*fall(l, 3))
        end do
      end associate
    end if
    !$omp simd
    do l = 1, lanes
      dgamma(l) = merge(now%dgamma(l), dgamma(l), good(l) > 0.5_wp)
    end do
    do i = 1, 3
      !$omp simd
      do l = 1, lanes
        overstress(l, i) = merge(fall(l, i), overstress(l, i), good(l) > 0.5_wp)
      end do
    end do
  end subroutine keep

  !> Residual level i of n, as in `yield_return`: yield stress plus level falls by equal factors.
  elemental real(wp) function level_at(i, n, first, flow)
    integer, intent(in) :: i, n
    real(wp), intent(in) :: first, flow   !! residual of the trial stress, first flow stress
    real(wp), parameter :: least = 1.0e-6_wp
    real(wp) :: lowest

    level_at = 0.0_wp
    if (i == n .or. .not. first > 0.0_wp) return
    lowest = max(flow, least*first)
    level_at = lowest*((1.0_wp + first/lowest)**(real(n - i, wp)/n) - 1.0_wp)
  end function level_at

  !> Which points flow. The yield function of the trial stress is never below the tangent plane at
  !! the outset, so that under continued loading its own value is not asked for.
  pure subroutine find_flowing(yield, problem, now, flows, reach, resistance, ok)
    type(plane_yield_t), intent(in) :: yield
    type(plane_problem_t), intent(in) :: problem
    type(iterate_t), intent(inout) :: now        !! evaluated at the outset if any point flows
    real(wp), intent(out) :: flows(lanes)        !! 1: outside the yield surface, 0: not
    real(wp), intent(out), dimension(lanes) :: reach, resistance   !! see `look_ahead`
    logical, intent(out) :: ok                   !! the trial stresses are numbers
    real(wp) :: excess(lanes), n_flowing
    logical :: is_loading
    integer :: l

    flows = 0.0_wp
    call compare_lengths(problem%outset, problem%trial, is_loading, ok)
    if (.not. ok) return
    if (is_loading) then
      call evaluate_plane_yield(yield, problem%outset, problem%flow, now%q, now%gradient, &
                                now%hessian)
      call look_ahead(problem, now%gradient, reach, resistance)
      n_flowing = 0.0_wp
      !$omp simd reduction(+:n_flowing)
      do l = 1, lanes
        flows(l) = merge(1.0_wp, 0.0_wp, reach(l) > (1.0_wp + just_above)*problem%flow(l))
        n_flowing = n_flowing + flows(l)
      end do
      if (.not. n_flowing < lanes) return
    end if
    call excess_in_plane(yield, problem%trial, problem%flow, excess)
    n_flowing = 0.0_wp
    !$omp simd reduction(+:n_flowing)
    do l = 1, lanes
      flows(l) = merge(1.0_wp, 0.0_wp, excess(l) > just_above)
      n_flowing = n_flowing + flows(l)
    end do
    if (is_loading .or. .not. n_flowing > 0.0_wp) return
    call evaluate_plane_yield(yield, problem%outset, problem%flow, now%q, now%gradient, now%hessian)
    call look_ahead(problem, now%gradient, reach, resistance)
  end subroutine find_flowing

  !> Are more than half of these stresses longer than before, and are all of them numbers?
  pure subroutine compare_lengths(before, after, most_grow, are_numbers)
    real(wp), intent(in), dimension(lanes, 3) :: before, after
    logical, intent(out) :: most_grow, are_numbers
    real(wp) :: n_longer, total, square
    integer :: l

    n_longer = 0.0_wp
    total = 0.0_wp
    !$omp simd private(square) reduction(+:n_longer, total)
    do l = 1, lanes
      square = after(l, 1)**2 + after(l, 2)**2 + after(l, 3)**2
      total = total + square
      n_longer = n_longer + merge(1.0_wp, 0.0_wp, &
                                  square > before(l, 1)**2 + before(l, 2)**2 + before(l, 3)**2)
    end do
    most_grow = n_longer > 0.5_wp*lanes
    are_numbers = total <= huge(total)
  end subroutine compare_lengths

  !> Yield function of the trial stress by the tangent plane of a gradient, and by how much it falls
  !! with plastic strain along that.
  pure subroutine look_ahead(problem, g, reach, resistance)
    type(plane_problem_t), intent(in) :: problem
    real(wp), intent(in) :: g(lanes, 3)
    real(wp), intent(out) :: reach(lanes), resistance(lanes)
    real(wp), parameter :: least = 1.0e-3_wp     ! of the stiffness, where there is no gradient
    integer :: l

    associate (t => problem%trial, m => problem%moduli, n => problem%modes, &
               h => problem%modulus, fade => problem%fading)
      !$omp simd
      do l = 1, lanes
        reach(l) = g(l, 1)*t(l, 1) + g(l, 2)*t(l, 2) + g(l, 3)*t(l, 3)
        resistance(l) = (m(1) + h(l)*n(1))*g(l, 1)**2 &
                        + 2.0_wp*(m(2) + h(l)*n(2))*g(l, 1)*g(l, 2) &
                        + (m(3) + h(l)*n(3))*g(l, 2)**2 + (m(4) + h(l)*n(4))*g(l, 3)**2 &
                        - (g(l, 1)*fade(l, 1) + g(l, 2)*fade(l, 2) + g(l, 3)*fade(l, 3))
        resistance(l) = max(resistance(l), least*problem%stiffness)
      end do
    end associate
  end subroutine look_ahead

  !> Start at the yield surface, raised by a level, in the direction of the stress at the outset; in
  !! that of the trial stress where the tangent plane at the outset says little.
  pure subroutine start(curve, yield, kinematic, back, problem, n_levels, poor, reach, resistance, &
                        level, first, now)
    type(flow_curve_t), intent(in) :: curve
    type(plane_yield_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: back(lanes, 3, kinematic%n)
    type(plane_problem_t), intent(inout) :: problem
    integer, intent(in) :: n_levels
    real(wp), intent(in) :: poor(lanes)          !! 1: from the trial stress
    real(wp), intent(inout), dimension(lanes) :: reach, resistance   !! of `look_ahead`
    real(wp), intent(out) :: level(lanes)        !! the first of the levels
    real(wp), intent(out) :: first(lanes)        !! residual of the tangent plane
    type(iterate_t), intent(inout) :: now        !! evaluated at the outset
    real(wp), dimension(lanes) :: bend, far
    logical :: ok
    integer :: i, l

    if (n_levels > 1 .and. kinematic%n > 0) &
      call move_trial(kinematic, back, 0.0_wp*now%dgamma, problem)
    if (sum(poor) > 0.0_wp) then
      do i = 1, 3
        !$omp simd
        do l = 1, lanes
          problem%outset(l, i) = merge(problem%trial(l, i), problem%outset(l, i), poor(l) > 0.5_wp)
        end do
      end do
      call evaluate_plane_yield(yield, problem%outset, problem%flow, now%q, now%gradient, &
                                now%hessian)
      call look_ahead(problem, now%gradient, reach, resistance)
    end if
    !$omp simd
    do l = 1, lanes
      first(l) = max(reach(l) - problem%flow(l), 0.0_wp)
      now%dgamma(l) = first(l)/(resistance(l) + problem%slope(l))
      level(l) = 0.0_wp
    end do
    if (n_levels > 1) then
      level = level_at(1, n_levels, first, problem%flow)
      reach = reach - level
      now%dgamma = (first - level)/(resistance + problem%slope)
    end if
    if (is_steep(curve)) then
      call solve_consistency(curve, lanes, problem%dt, reach, resistance, problem%eqps, &
                             problem%factor, problem%guess, now%dgamma, ok)
    end if
    call flow_after(curve, lanes, problem%dt, problem%eqps, problem%factor, problem%flow, &
                    now%dgamma, now%flow, now%slope, bend, far)
    call move_to_surface(problem%outset, level, now)
    if (kinematic%n > 0) call move_trial(kinematic, back, now%dgamma, problem)
  end subroutine start

  !> Where a tangent plane covers less than two thirds of the way to the trial stress t. The rest is
  !! t.H.t/2 over the ratio of both sizes, for the Hessian H has no part along the stress where it
  !! was found.
  pure subroutine find_poor(problem, now, reach, left, poor)
    type(plane_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    real(wp), intent(in) :: reach(lanes), left(lanes)
    real(wp), intent(out) :: poor(lanes)
    real(wp) :: rest, over
    integer :: l

    associate (t => problem%trial, h => now%hessian)
      !$omp simd private(rest, over)
      do l = 1, lanes
        rest = t(l, 1)*(0.5_wp*h(l, 1)*t(l, 1) + h(l, 2)*t(l, 2) + h(l, 4)*t(l, 3)) &
               + t(l, 2)*(0.5_wp*h(l, 3)*t(l, 2) + h(l, 5)*t(l, 3)) + 0.5_wp*h(l, 6)*t(l, 3)**2
        over = reach(l) - problem%flow(l)
        poor(l) = merge(0.0_wp, left(l), over > 0.0_wp .and. reach(l)*over > 2.0_wp*rest*now%q(l))
      end do
    end associate
  end subroutine find_poor

  !> Move to the yield surface, raised by a level. The gradient is that of all stresses in one
  !! direction, the Hessian falls with their size.
  pure subroutine move_to_surface(outset, level, now)
    real(wp), intent(in) :: outset(lanes, 3), level(lanes)
    type(iterate_t), intent(inout) :: now
    real(wp) :: scaling(lanes)
    integer :: i, l

    !$omp simd
    do l = 1, lanes
      now%size_ratio(l) = now%q(l)/(now%flow(l) + level(l))
      now%q(l) = now%flow(l) + level(l)
      scaling(l) = 1.0_wp/now%size_ratio(l)
    end do
    do i = 1, 3
      !$omp simd
      do l = 1, lanes
        now%stress(l, i) = scaling(l)*outset(l, i)
      end do
    end do
  end subroutine move_to_surface

  !> All at the stress and plastic strain of `now`, with second derivatives or without.
  pure subroutine evaluate(curve, yield, kinematic, back, problem, level, with_hessian, now)
    type(flow_curve_t), intent(in) :: curve
    type(plane_yield_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: back(lanes, 3, kinematic%n)
    type(plane_problem_t), intent(inout) :: problem
    real(wp), intent(in) :: level(lanes)
    logical, intent(in) :: with_hessian
    type(iterate_t), intent(inout) :: now
    real(wp), dimension(lanes) :: near, bend, far
    integer :: l

    call flow_after(curve, lanes, problem%dt, problem%eqps, problem%factor, problem%flow, &
                    now%dgamma, now%flow, now%slope, bend, far)
    if (kinematic%n > 0) call move_trial(kinematic, back, now%dgamma, problem)
    !$omp simd
    do l = 1, lanes
      near(l) = now%flow(l) + level(l)
      if (with_hessian) now%size_ratio(l) = 1.0_wp
    end do
    if (with_hessian) then
      call evaluate_plane_yield(yield, now%stress, near, now%q, now%gradient, now%hessian, &
                                is_rough=.true.)
    else
      call slope_in_plane(yield, now%stress, near, now%q, now%gradient)
    end if
  end subroutine evaluate

  !> The square of a residual, times this and over the flow stress, bounds what a step leaves, ten
  !! times in tests: the yield surface bends by its exponent, and more the flow curve where it is
  !! rough.
  pure real(wp) function sharpness_of(curve, yield)
    type(flow_curve_t), intent(in) :: curve
    type(plane_yield_t), intent(in) :: yield

    sharpness_of = 1.0_wp + 0.5_wp*yield%half
    if (is_rough(curve)) sharpness_of = 1.0e8_wp*sharpness_of
  end function sharpness_of

  !> Plain steps of Newton's method, without evaluation after the last one: what it leaves follows
  !! from the residual before it. Where two steps with one matrix are sure to be enough, the second
  !! takes it over. Gives up where the residuals do not fall fast.
  pure subroutine climb(curve, yield, kinematic, back, problem, flows, now, is_done)
    type(flow_curve_t), intent(in) :: curve
    type(plane_yield_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: back(lanes, 3, kinematic%n)
    type(plane_problem_t), intent(inout) :: problem
    real(wp), intent(in) :: flows(lanes)           !! 1: points to solve
    type(iterate_t), intent(inout) :: now
    logical, intent(out) :: is_done
    integer, parameter :: most_steps = 8
    real(wp), parameter :: least_fall = 0.1_wp     ! of the square of the residual
    type(step_t) :: step
    real(wp) :: level(lanes), limit, before, square, least_strain
    logical :: is_new
    integer :: i, l

    !$omp simd
    do l = 1, lanes
      level(l) = 0.0_wp
    end do
    limit = error/sharpness_of(curve, yield)
    before = huge(before)
    is_new = .true.
    is_done = .false.
    do i = 1, most_steps
      if (is_new) call invert(problem, now, step%inverse)
      if (kinematic%n > 0) call find_pull(now, problem)
      call find_step(problem, level, now, step)
      call take_step(flows, step, now, square, least_strain)
      if (.not. (square <= least_fall*before .and. least_strain >= 0.0_wp)) return
      is_done = square*merge(square, before, is_new) <= limit**2
      if (is_done) return
      ! The next residual is mostly less than a third of the square of this one.
      is_new = .not. is_new .or. square**3 > (3.0_wp*limit)**2
      before = square
      call evaluate(curve, yield, kinematic, back, problem, level, is_new, now)
    end do
  end subroutine climb

  !> Take a step at the points that flow.
  pure subroutine take_step(flows, step, now, square, least_strain)
    real(wp), intent(in) :: flows(lanes)
    type(step_t), intent(in) :: step
    type(iterate_t), intent(inout) :: now
    real(wp), intent(out) :: square            !! largest of the residuals over the flow stress
    real(wp), intent(out) :: least_strain      !! of the plastic strains
    integer :: l

    square = 0.0_wp
    least_strain = 0.0_wp
    !$omp simd reduction(max:square) reduction(min:least_strain)
    do l = 1, lanes
      now%stress(l, 1) = now%stress(l, 1) + step%change(l, 1)
      now%stress(l, 2) = now%stress(l, 2) + step%change(l, 2)
      now%stress(l, 3) = now%stress(l, 3) + step%change(l, 3)
      now%dgamma(l) = flows(l)*(now%dgamma(l) + step%change(l, 4))
      square = max(square, flows(l)*step%residual(l)/now%flow(l)**2)
      least_strain = min(least_strain, now%dgamma(l))
    end do
  end subroutine take_step

  !> Newton's method with a line search on the sum of the squared residuals, down to `level`.
  pure subroutine iterate(curve, yield, kinematic, back, problem, level, good, now)
    type(flow_curve_t), intent(in) :: curve
    type(plane_yield_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: back(lanes, 3, kinematic%n)
    type(plane_problem_t), intent(inout) :: problem
    real(wp), intent(in) :: level(lanes)
    real(wp), intent(inout) :: good(lanes)        !! 1: points to solve, out those that converged
    type(iterate_t), intent(inout) :: now
    integer, parameter :: most = 120
    type(search_t) :: search
    type(step_t) :: step
    real(wp) :: limit
    integer :: evaluation

    limit = error/sharpness_of(curve, yield)
    search%before = huge(limit)
    search%length = 1.0_wp
    search%tries = 0.0_wp
    search%change = 0.0_wp
    search%open = good
    do evaluation = 1, most
      call invert(problem, now, step%inverse)
      if (kinematic%n > 0) call find_pull(now, problem)
      call find_step(problem, level, now, step)
      call advance(limit, step, now, search)
      if (.not. sum(search%open) > 0.0_wp) exit
      call evaluate(curve, yield, kinematic, back, problem, level, .true., now)
    end do
    good = good*(1.0_wp - search%open)
  end subroutine iterate

  !> Inverse of the matrix of the stress, B + stiffness dgamma Hessian, which is symmetric and
  !! positive definite, packed as the Hessian.
  pure subroutine invert(problem, now, inverse)
    type(plane_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    real(wp), intent(out) :: inverse(lanes, 6)
    real(wp) :: c, a11, a12, a22, a13, a23, a33, b11, b12, b13, per
    integer :: l

    associate (h => now%hessian, b => problem%metric)
      !$omp simd private(c, a11, a12, a22, a13, a23, a33, b11, b12, b13, per)
      do l = 1, lanes
        c = problem%stiffness*now%dgamma(l)*now%size_ratio(l)
        a11 = b(l, 1) + c*h(l, 1)
        a12 = b(l, 2) + c*h(l, 2)
        a22 = b(l, 3) + c*h(l, 3)
        a13 = c*h(l, 4)
        a23 = c*h(l, 5)
        a33 = b(l, 4) + c*h(l, 6)
        b11 = a22*a33 - a23*a23
        b12 = a13*a23 - a12*a33
        b13 = a12*a23 - a13*a22
        per = 1.0_wp/(a11*b11 + a12*b12 + a13*b13)
        inverse(l, 1) = per*b11
        inverse(l, 2) = per*b12
        inverse(l, 3) = per*(a11*a33 - a13*a13)
        inverse(l, 4) = per*b13
        inverse(l, 5) = per*(a12*a13 - a11*a23)
        inverse(l, 6) = per*(a11*a22 - a12*a12)
      end do
    end associate
  end subroutine invert

  !> Residuals of the strain, times the stiffness, and of the yield function above its level, and
  !! the step from there with the inverse matrix; the plastic strain is eliminated.
  pure subroutine find_step(problem, level, now, step)
    type(plane_problem_t), intent(in) :: problem
    real(wp), intent(in) :: level(lanes)
    type(iterate_t), intent(in) :: now
    type(step_t), intent(inout) :: step
    real(wp) :: k, f, x1, x2, x3, y1, y2, y3, z1, z2, z3, g1, g2, g3
    integer :: l

    associate (a => step%inverse, s => now%stress, t => problem%trial, b => problem%metric, &
               pull => problem%pull)
      !$omp simd private(k, f, x1, x2, x3, y1, y2, y3, z1, z2, z3, g1, g2, g3)
      do l = 1, lanes
        g1 = now%gradient(l, 1); g2 = now%gradient(l, 2); g3 = now%gradient(l, 3)
        k = problem%stiffness*now%dgamma(l)
        y1 = s(l, 1) - t(l, 1)
        y2 = s(l, 2) - t(l, 2)
        x1 = b(l, 1)*y1 + b(l, 2)*y2 + k*g1
        x2 = b(l, 2)*y1 + b(l, 3)*y2 + k*g2
        x3 = b(l, 4)*(s(l, 3) - t(l, 3)) + k*g3
        f = now%q(l) - now%flow(l) - level(l)
        step%residual(l) = f*f + x1*x1 + x2*x2 + x3*x3
        y1 = a(l, 1)*x1 + a(l, 2)*x2 + a(l, 4)*x3
        y2 = a(l, 2)*x1 + a(l, 3)*x2 + a(l, 5)*x3
        y3 = a(l, 4)*x1 + a(l, 5)*x2 + a(l, 6)*x3
        x1 = problem%stiffness*g1 + pull(l, 1)
        x2 = problem%stiffness*g2 + pull(l, 2)
        x3 = problem%stiffness*g3 + pull(l, 3)
        z1 = a(l, 1)*x1 + a(l, 2)*x2 + a(l, 4)*x3
        z2 = a(l, 2)*x1 + a(l, 3)*x2 + a(l, 5)*x3
        z3 = a(l, 4)*x1 + a(l, 5)*x2 + a(l, 6)*x3
        f = f - (g1*y1 + g2*y2 + g3*y3)
        f = f/((g1*z1 + g2*z2 + g3*z3) + now%slope(l))
        step%change(l, 1) = -(y1 + f*z1)
        step%change(l, 2) = -(y2 + f*z2)
        step%change(l, 3) = -(y3 + f*z3)
        step%change(l, 4) = f
      end do
    end associate
  end subroutine find_step

  !> Take the new step where the residuals have become smaller, else go back on the last one.
  pure subroutine advance(limit, step, now, search)
    real(wp), intent(in) :: limit              !! of the squares of last residuals, over flow^2
    type(step_t), intent(in) :: step
    type(iterate_t), intent(inout) :: now
    type(search_t), intent(inout) :: search
    real(wp), parameter :: decrease = 2.0e-4_wp, most_tries = 8.0_wp
    real(wp) :: way(lanes), longest, shorter, old
    logical :: is_taken
    integer :: i, l

    do l = 1, lanes
      old = search%length(l)
      is_taken = search%tries(l) >= most_tries .or. &
                 step%residual(l) <= (1.0_wp - decrease*old)*search%before(l)
      if (is_taken) then
        ! Plastic strains stay positive.
        longest = 1.0_wp
        if (now%dgamma(l) + step%change(l, 4) < 0.0_wp) &
          longest = -0.9_wp*now%dgamma(l)/step%change(l, 4)
        way(l) = longest
        search%length(l) = longest
        search%before(l) = step%residual(l)
        search%tries(l) = 0.0_wp
        search%change(l, :) = step%change(l, :)
      else
        shorter = search%before(l)*old**2 &
                  /max(step%residual(l) + (2.0_wp*old - 1.0_wp)*search%before(l), tiny(old))
        shorter = max(0.1_wp*old, min(0.5_wp*old, shorter))
        way(l) = shorter - old
        search%length(l) = shorter
        search%tries(l) = search%tries(l) + 1.0_wp
      end if
      way(l) = search%open(l)*way(l)
      if (is_taken .and. search%length(l) >= 1.0_wp .and. &
          search%before(l) <= limit*now%flow(l)**2) search%open(l) = 0.0_wp
    end do
    do i = 1, 3
      now%stress(:, i) = now%stress(:, i) + way*search%change(:, i)
    end do
    now%dgamma = now%dgamma + way*search%change(:, 4)
  end subroutine advance

end module plane_yield_return
