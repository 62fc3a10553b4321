!> Return mapping to an anisotropic yield surface in the axes of the material: from trial stresses
!! outside of it back to it, `lanes` points at a time.
!!
!! The stress in the yield function is the relative one, stress less back stresses; without those
!! it is the stress itself. All are deviators in the basis of `deviator_lanes`, in which elasticity
!! is a factor 2G.
!!
!! Backward Euler by Newton's method for stress and plastic strain together with a line search
!! (W. M. Scherzinger, CMAME 317 (2017)); where that does not converge in one go, by residual
!! levels that fall to zero (J. W. Yoon, D. Y. Yang and K. Chung, CMAME 174 (1999)), each the start
!! of the next. The semi-implicit multi-stage scheme takes the levels without iteration.
!!
!! Newton's method starts on the yield surface in the direction of the stress before the increment:
!! where the strain continues as before, the new stress has nearly the same.
module yield_return
  use kinds, only: wp
  use deviator_lanes, only: lanes
  use flow_curve, only: flow_curve_t, flow_after, is_rough, is_steep
  use return_problem, only: return_problem_t
  use consistency, only: solve_consistency
  use plane_steps, only: just_above
  use yield_function, only: yield_function_t, evaluate_yield, find_excess
  use hardening, only: back_stresses_t
  implicit none
  private

  public :: return_to_yield, return_in_stages

  !> What the relative stress would be with a plastic strain that has faded the back stresses, the
  !! stiffness against which it flows, and the derivatives of both.
  type :: moving_trial_t
    real(wp) :: stress(lanes, 5), stiffness(lanes), stress_slope(lanes, 5), stiffness_slope(lanes)
  end type moving_trial_t

  !> State of the iteration: relative stress, plastic strain, and what follows from them.
  type :: iterate_t
    real(wp) :: stress(lanes, 5), dgamma(lanes)
    real(wp) :: q(lanes), gradient(lanes, 5), hessian(lanes, 15), flow(lanes), slope(lanes)
    real(wp) :: size_ratio(lanes)         !! of the stress of the Hessian to that above
    type(moving_trial_t) :: moved
  end type iterate_t

  !> Where each point stands in its line search. What is true or false is 1 or 0: so the loops
  !! vectorise.
  type :: search_t
    real(wp) :: factors(lanes, 15)                     !! of the matrix: see `factorise`
    real(wp) :: new_step(lanes, 6), residual(lanes)    !! step, sum of squared residuals here
    real(wp) :: step(lanes, 6), before(lanes)          !! the last ones that were taken
    real(wp) :: length(lanes), tries(lanes)      !! fraction of the step, how often it was cut
    real(wp) :: limit(lanes)                     !! sum of squared residuals of the last step
    real(wp) :: open(lanes)                      !! 1: not yet converged
  end type search_t

contains

  !> Backward Euler for the points that flow. Newton's method in one go, then by more and more
  !! residual levels for those where it does not converge.
  pure subroutine return_to_yield(curve, yield, kinematic, problem, back, plastic, dgamma, ok)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    type(return_problem_t), intent(inout) :: problem
    real(wp), intent(inout) :: back(:, :, :)           !! back stresses, (lanes, 5, n)
    real(wp), intent(out) :: plastic(lanes, 5)         !! strain of the increment
    real(wp), intent(out) :: dgamma(lanes)
    logical, intent(out) :: ok
    integer, parameter :: counts(4) = [1, 5, 25, 125]
    type(iterate_t) :: now
    type(search_t) :: search
    real(wp), dimension(lanes) :: first, level, left, good, reach, resistance
    integer :: attempt, i, l

    !$omp simd
    do l = 1, lanes
      now%dgamma(l) = 0.0_wp
      dgamma(l) = 0.0_wp
    end do
    plastic = 0.0_wp
    call move_trial(kinematic, problem, back, now%dgamma, now%moved)
    call find_flowing(yield, problem, now, left, reach, resistance, ok)
    if (.not. (ok .and. sum(left) > 0.0_wp)) return
    good = left
    do attempt = 1, size(counts)
      do i = 1, counts(attempt)
        if (i == 1) then
          call start(curve, yield, kinematic, problem, back, counts(attempt), left, reach, &
                     resistance, level, first, now)
        else
          level = level_at(i, counts(attempt), first, problem%flow)
          call evaluate(curve, yield, kinematic, problem, back, .true., now)
        end if
        search%open = good
        call iterate(curve, yield, kinematic, problem, back, level, now, search)
        good = good*(1.0_wp - search%open)
      end do
      if (kinematic%n > 0) call move_trial(kinematic, problem, back, now%dgamma, now%moved)
      call keep(good, now, plastic, dgamma)
      left = left*(1.0_wp - good)
      ok = .not. sum(left) > 0.0_wp
      if (ok) exit
      good = left
    end do
    call move_back_stresses(kinematic, plastic, dgamma, back)
  end subroutine return_to_yield

  !> Keep the plastic strain of some points, which is that of a strain without residual.
  pure subroutine keep(good, now, plastic, dgamma)
    real(wp), intent(in) :: good(lanes)
    type(iterate_t), intent(in) :: now
    real(wp), intent(inout) :: plastic(lanes, 5), dgamma(lanes)
    real(wp) :: inverse(lanes)
    integer :: i, l

    !$omp simd
    do l = 1, lanes
      dgamma(l) = merge(now%dgamma(l), dgamma(l), good(l) > 0.5_wp)
      inverse(l) = 1.0_wp/now%moved%stiffness(l)
    end do
    do i = 1, 5
      !$omp simd
      do l = 1, lanes
        plastic(l, i) = merge(inverse(l)*(now%moved%stress(l, i) - now%stress(l, i)), &
                              plastic(l, i), good(l) > 0.5_wp)
      end do
    end do
  end subroutine keep

  !> Back stresses after a plastic strain.
  pure subroutine move_back_stresses(kinematic, plastic, dgamma, back)
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: plastic(lanes, 5), dgamma(lanes)
    real(wp), intent(inout) :: back(:, :, :)
    integer :: i, k

    do k = 1, kinematic%n
      do i = 1, 5
        back(:, i, k) = (back(:, i, k) + 2.0_wp/3.0_wp*kinematic%modulus(k)*plastic(:, i)) &
                        /(1.0_wp + kinematic%recall(k)*dgamma)
      end do
    end do
  end subroutine move_back_stresses

  !> See `moving_trial_t`.
  pure subroutine move_trial(kinematic, problem, back, dgamma, moved)
    type(back_stresses_t), intent(in) :: kinematic
    type(return_problem_t), intent(in) :: problem
    real(wp), intent(in) :: back(:, :, :), dgamma(lanes)
    type(moving_trial_t), intent(out) :: moved
    real(wp) :: theta(lanes), c
    integer :: i, k, l

    !$omp simd
    do l = 1, lanes
      moved%stiffness(l) = 2.0_wp*problem%shear
      moved%stiffness_slope(l) = 0.0_wp
    end do
    do i = 1, 5
      !$omp simd
      do l = 1, lanes
        moved%stress(l, i) = problem%trial(l, i)
        moved%stress_slope(l, i) = 0.0_wp
      end do
    end do
    do k = 1, kinematic%n
      c = 2.0_wp/3.0_wp*kinematic%modulus(k)
      associate (gamma => kinematic%recall(k))
        !$omp simd
        do l = 1, lanes
          theta(l) = 1.0_wp/(1.0_wp + gamma*dgamma(l))
          moved%stiffness(l) = moved%stiffness(l) + theta(l)*c
          moved%stiffness_slope(l) = moved%stiffness_slope(l) - gamma*theta(l)**2*c
        end do
        do i = 1, 5
          !$omp simd
          do l = 1, lanes
            moved%stress(l, i) = moved%stress(l, i) - theta(l)*back(l, i, k)
            moved%stress_slope(l, i) = moved%stress_slope(l, i) + gamma*theta(l)**2*back(l, i, k)
          end do
        end do
      end associate
    end do
  end subroutine move_trial

  !> Residual level i of n: yield stress plus level falls by equal factors, so that the last step
  !! is no longer than the others however far out the trial stress lies.
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

  !> Which points flow, and their step by the tangent plane at the outset; `now` begins without
  !! plastic strain. Round-off above the flow stress is left alone: its plastic strain may have any
  !! sign. The yield function of the trial stress is never below that plane, so that
  !! under continued loading its own value is not asked for.
  pure subroutine find_flowing(yield, problem, now, flows, reach, resistance, ok)
    type(yield_function_t), intent(in) :: yield
    type(return_problem_t), intent(in) :: problem
    type(iterate_t), intent(inout) :: now        !! evaluated at the outset if any point flows
    real(wp), intent(out) :: flows(lanes)        !! 1: outside the yield surface, 0: not
    real(wp), intent(out), dimension(lanes) :: reach, resistance   !! see `look_ahead`
    logical, intent(out) :: ok                   !! the trial stresses are numbers
    real(wp) :: excess(lanes), n_flowing
    logical :: is_loading
    integer :: l

    flows = 0.0_wp
    call compare_lengths(problem%outset, now%moved%stress, is_loading, ok)
    if (.not. ok) return
    if (is_loading) then
      call evaluate_yield(yield, problem%outset, now%q, now%gradient, now%hessian)
      call look_ahead(problem%shear, now%gradient, now%moved, reach, resistance)
      n_flowing = 0.0_wp
      !$omp simd reduction(+:n_flowing)
      do l = 1, lanes
        flows(l) = merge(1.0_wp, 0.0_wp, reach(l) > (1.0_wp + just_above)*problem%flow(l))
        n_flowing = n_flowing + flows(l)
      end do
      if (.not. n_flowing < lanes) return
    end if
    call find_excess(yield, now%moved%stress, problem%flow, excess)
    n_flowing = 0.0_wp
    !$omp simd reduction(+:n_flowing)
    do l = 1, lanes
      flows(l) = merge(1.0_wp, 0.0_wp, excess(l) > just_above)
      n_flowing = n_flowing + flows(l)
    end do
    if (is_loading .or. .not. n_flowing > 0.0_wp) return
    call evaluate_yield(yield, problem%outset, now%q, now%gradient, now%hessian)
    call look_ahead(problem%shear, now%gradient, now%moved, reach, resistance)
  end subroutine find_flowing

  !> Are more than half of these stresses longer than before, and are all of them numbers?
  pure subroutine compare_lengths(before, after, most_grow, are_numbers)
    real(wp), intent(in), dimension(lanes, 5) :: before, after
    logical, intent(out) :: most_grow, are_numbers
    real(wp) :: n_longer, total, square
    integer :: l

    n_longer = 0.0_wp
    total = 0.0_wp
    !$omp simd private(square) reduction(+:n_longer, total)
    do l = 1, lanes
      square = after(l, 1)**2 + after(l, 2)**2 + after(l, 3)**2 + after(l, 4)**2 + after(l, 5)**2
      total = total + square
      n_longer = n_longer + merge(1.0_wp, 0.0_wp, square > before(l, 1)**2 + before(l, 2)**2 &
                                  + before(l, 3)**2 + before(l, 4)**2 + before(l, 5)**2)
    end do
    most_grow = n_longer > 0.5_wp*lanes
    are_numbers = total <= huge(total)
  end subroutine compare_lengths

  !> Start at the yield surface, raised by a level, in the direction of the stress at the outset.
  !! The gradient there tells from a tangent plane how much plastic strain there will be, never too
  !! much. Where it tells little, the start is in the direction of the trial stress.
  pure subroutine start(curve, yield, kinematic, problem, back, n_levels, left, reach, resistance, &
                        level, first, now)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    type(return_problem_t), intent(inout) :: problem
    real(wp), intent(in) :: back(:, :, :), left(lanes)
    integer, intent(in) :: n_levels              !! 1: from the outset, else from the trial stress
    real(wp), intent(inout), dimension(lanes) :: reach, resistance   !! of `look_ahead`
    real(wp), intent(out) :: level(lanes)        !! the first of the levels
    real(wp), intent(out) :: first(lanes)        !! residual of the tangent plane
    type(iterate_t), intent(inout) :: now        !! from `find_flowing` for one level
    real(wp), dimension(lanes) :: poor, bend, far
    real(wp) :: n_poor
    logical :: ok
    integer :: i, l

    if (n_levels == 1) then
      call find_poor(problem, now, reach, left, poor, n_poor)
    else
      !$omp simd
      do l = 1, lanes
        now%dgamma(l) = 0.0_wp
        poor(l) = 1.0_wp
      end do
      n_poor = lanes
      call move_trial(kinematic, problem, back, now%dgamma, now%moved)
    end if
    if (n_poor > 0.0_wp) then
      do i = 1, 5
        !$omp simd
        do l = 1, lanes
          problem%outset(l, i) = merge(now%moved%stress(l, i), problem%outset(l, i), &
                                       poor(l) > 0.5_wp)
        end do
      end do
      call evaluate_yield(yield, problem%outset, now%q, now%gradient, now%hessian)
      call look_ahead(problem%shear, now%gradient, now%moved, reach, resistance)
    end if
    !$omp simd
    do l = 1, lanes
      first(l) = max(reach(l) - problem%flow(l), 0.0_wp)
      level(l) = 0.0_wp
    end do
    if (n_levels > 1) level = level_at(1, n_levels, first, problem%flow)
    !$omp simd
    do l = 1, lanes
      reach(l) = reach(l) - level(l)
      now%dgamma(l) = (first(l) - level(l))/(resistance(l) + problem%slope(l))
    end do
    if (is_steep(curve)) then
      call solve_consistency(curve, lanes, problem%dt, reach, resistance, problem%eqps, &
                             problem%factor, problem%guess, now%dgamma, ok)
    end if
    call flow_after(curve, lanes, problem%dt, problem%eqps, problem%factor, problem%flow, &
                    now%dgamma, now%flow, now%slope, bend, far)
    call move_to_surface(problem%outset, level, now)
    if (kinematic%n > 0) call move_trial(kinematic, problem, back, now%dgamma, now%moved)
  end subroutine start

  !> Where a tangent plane covers less than two thirds of the way to the trial stress t. The rest
  !! is t.H.t/2 over the ratio of both sizes, for the Hessian H has no part along the stress where
  !! it was found.
  pure subroutine find_poor(problem, now, reach, left, poor, n_poor)
    type(return_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    real(wp), intent(in) :: reach(lanes), left(lanes)
    real(wp), intent(out) :: poor(lanes), n_poor
    real(wp) :: rest
    integer :: l

    n_poor = 0.0_wp
    associate (t => now%moved%stress, h => now%hessian)
      !$omp simd private(rest) reduction(+:n_poor)
      do l = 1, lanes
        rest = t(l, 1)*(0.5_wp*h(l, 1)*t(l, 1) + h(l, 2)*t(l, 2) + h(l, 4)*t(l, 3) &
                         + h(l, 7)*t(l, 4) + h(l, 11)*t(l, 5)) &
                + t(l, 2)*(0.5_wp*h(l, 3)*t(l, 2) + h(l, 5)*t(l, 3) + h(l, 8)*t(l, 4) &
                           + h(l, 12)*t(l, 5)) &
                + t(l, 3)*(0.5_wp*h(l, 6)*t(l, 3) + h(l, 9)*t(l, 4) + h(l, 13)*t(l, 5)) &
                + t(l, 4)*(0.5_wp*h(l, 10)*t(l, 4) + h(l, 14)*t(l, 5)) &
                + 0.5_wp*h(l, 15)*t(l, 5)**2
        poor(l) = merge(0.0_wp, left(l), reach(l) > problem%flow(l) .and. &
                        reach(l)*(reach(l) - problem%flow(l)) > 2.0_wp*rest*now%q(l))
        n_poor = n_poor + poor(l)
      end do
    end associate
  end subroutine find_poor

  !> Yield function of the trial stress by the tangent plane of a gradient, and by how much it falls
  !! with plastic strain along that.
  pure subroutine look_ahead(least, g, moved, reach, resistance)
    real(wp), intent(in) :: least, g(lanes, 5)
    type(moving_trial_t), intent(in) :: moved
    real(wp), intent(out) :: reach(lanes), resistance(lanes)
    integer :: l

    associate (t => moved%stress, fade => moved%stress_slope)
      !$omp simd
      do l = 1, lanes
        reach(l) = g(l, 1)*t(l, 1) + g(l, 2)*t(l, 2) + g(l, 3)*t(l, 3) + g(l, 4)*t(l, 4) &
                   + g(l, 5)*t(l, 5)
        resistance(l) = moved%stiffness(l)*(g(l, 1)**2 + g(l, 2)**2 + g(l, 3)**2 + g(l, 4)**2 &
                                            + g(l, 5)**2) &
                        - (g(l, 1)*fade(l, 1) + g(l, 2)*fade(l, 2) + g(l, 3)*fade(l, 3) &
                           + g(l, 4)*fade(l, 4) + g(l, 5)*fade(l, 5))
        resistance(l) = max(resistance(l), least)
      end do
    end associate
  end subroutine look_ahead

  !> Move to the yield surface, raised by a level. The gradient is that of all stresses in one
  !! direction, the Hessian falls with their size.
  pure subroutine move_to_surface(outset, level, now)
    real(wp), intent(in) :: outset(lanes, 5), level(lanes)
    type(iterate_t), intent(inout) :: now
    real(wp) :: scaling(lanes)
    integer :: i, l

    !$omp simd
    do l = 1, lanes
      scaling(l) = (now%flow(l) + level(l))/now%q(l)
      now%size_ratio(l) = now%q(l)/(now%flow(l) + level(l))
      now%q(l) = now%flow(l) + level(l)
    end do
    do i = 1, 5
      !$omp simd
      do l = 1, lanes
        now%stress(l, i) = scaling(l)*outset(l, i)
      end do
    end do
  end subroutine move_to_surface

  !> All at the stress and plastic strain of `now`, with the Hessian or without.
  pure subroutine evaluate(curve, yield, kinematic, problem, back, with_hessian, now)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    type(return_problem_t), intent(in) :: problem
    real(wp), intent(in) :: back(:, :, :)
    logical, intent(in) :: with_hessian
    type(iterate_t), intent(inout) :: now
    real(wp), dimension(lanes) :: bend, far
    integer :: l

    if (with_hessian) then
      call evaluate_yield(yield, now%stress, now%q, now%gradient, now%hessian)
    else
      call evaluate_yield(yield, now%stress, now%q, now%gradient)
    end if
    call flow_after(curve, lanes, problem%dt, problem%eqps, problem%factor, problem%flow, &
                    now%dgamma, now%flow, now%slope, bend, far)
    if (kinematic%n > 0) call move_trial(kinematic, problem, back, now%dgamma, now%moved)
    !$omp simd
    do l = 1, lanes
      now%size_ratio(l) = 1.0_wp
    end do
  end subroutine evaluate

  !> Newton's method with a line search on the sum of the squared residuals, down to `level`. What
  !! is left after a step is of the square of what was there before, so that none is evaluated that
  !! is sure to be small enough. Next to the end the matrix of the last step serves once more.
  pure subroutine iterate(curve, yield, kinematic, problem, back, level, now, search)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    type(return_problem_t), intent(in) :: problem
    real(wp), intent(in) :: back(:, :, :), level(lanes)
    type(iterate_t), intent(inout) :: now
    type(search_t), intent(inout) :: search       !! open: points to solve; not converged
    integer, parameter :: most = 120
    real(wp), parameter :: error = 1.0e-12_wp     ! of residuals, over the flow stress
    real(wp) :: sharpness, n_open, n_far
    logical :: is_new
    integer :: evaluation, l

    ! By its exponent the yield surface bends, and by more the flow curve where it is rough.
    sharpness = yield%values%exponent
    if (is_rough(curve)) sharpness = 1.0e3_wp*sharpness
    !$omp simd
    do l = 1, lanes
      search%before(l) = huge(sharpness)
      search%length(l) = 1.0_wp
      search%tries(l) = 0.0_wp
    end do
    is_new = .true.
    do evaluation = 1, most
      if (is_new) call factorise(now, search%factors)
      call find_step(level, now, search)
      call set_limit(is_new, error, sharpness, now%flow, search)
      call advance(now, search, n_open, n_far)
      if (.not. n_open > 0.0_wp) return
      is_new = n_far > 0.0_wp .or. .not. is_new
      call evaluate(curve, yield, kinematic, problem, back, is_new, now)
    end do
  end subroutine iterate

  !> The square of the residual whose step leaves no more than the error: with a new matrix its
  !! square, with an old one its product with the residual that belongs to that.
  pure subroutine set_limit(is_new, error, sharpness, flow, search)
    logical, intent(in) :: is_new
    real(wp), intent(in) :: error, sharpness, flow(lanes)
    type(search_t), intent(inout) :: search
    integer :: l

    if (is_new) then
      !$omp simd
      do l = 1, lanes
        search%limit(l) = error*flow(l)**2/sharpness**2
      end do
    else
      !$omp simd
      do l = 1, lanes
        search%limit(l) = (error*flow(l)**2/sharpness)**2/(search%before(l) + tiny(error))
      end do
    end if
  end subroutine set_limit

  !> Factors L D L^T of the matrix of the stress, 1 + stiffness dgamma Hessian, which is symmetric
  !! and positive definite: the columns of L below its diagonal, and 1/D.
  pure subroutine factorise(now, factors)
    type(iterate_t), intent(in) :: now
    real(wp), intent(out) :: factors(lanes, 15)
    real(wp) :: c, r1, r2, r3, r4, u21, u31, u41, u51, u32, u42, u52, u43, u53, u54
    real(wp) :: l21, l31, l41, l51, l32, l42, l52, l43, l53, l54
    integer :: l

    associate (h => now%hessian)
      !$omp simd private(c, r1, r2, r3, r4, u21, u31, u41, u51, u32, u42, u52, u43, u53, u54, &
      !$omp l21, l31, l41, l51, l32, l42, l52, l43, l53, l54)
      do l = 1, lanes
        c = now%moved%stiffness(l)*now%dgamma(l)*now%size_ratio(l)
        u21 = c*h(l, 2); u31 = c*h(l, 4); u41 = c*h(l, 7); u51 = c*h(l, 11)
        r1 = 1.0_wp/(1.0_wp + c*h(l, 1))
        l21 = u21*r1; l31 = u31*r1; l41 = u41*r1; l51 = u51*r1
        r2 = 1.0_wp/(1.0_wp + c*h(l, 3) - l21*u21)
        u32 = c*h(l, 5) - l31*u21; u42 = c*h(l, 8) - l41*u21; u52 = c*h(l, 12) - l51*u21
        l32 = u32*r2; l42 = u42*r2; l52 = u52*r2
        r3 = 1.0_wp/(1.0_wp + c*h(l, 6) - l31*u31 - l32*u32)
        u43 = c*h(l, 9) - l41*u31 - l42*u32; u53 = c*h(l, 13) - l51*u31 - l52*u32
        l43 = u43*r3; l53 = u53*r3
        r4 = 1.0_wp/(1.0_wp + c*h(l, 10) - l41*u41 - l42*u42 - l43*u43)
        u54 = c*h(l, 14) - l51*u41 - l52*u42 - l53*u43
        l54 = u54*r4
        factors(l, 1) = l21; factors(l, 2) = l31; factors(l, 3) = l41; factors(l, 4) = l51
        factors(l, 5) = l32; factors(l, 6) = l42; factors(l, 7) = l52
        factors(l, 8) = l43; factors(l, 9) = l53; factors(l, 10) = l54
        factors(l, 11) = r1; factors(l, 12) = r2; factors(l, 13) = r3; factors(l, 14) = r4
        factors(l, 15) = 1.0_wp/(1.0_wp + c*h(l, 15) - l51*u51 - l52*u52 - l53*u53 - l54*u54)
      end do
    end associate
  end subroutine factorise

  !> Residuals of the strain, times its stiffness, and of the yield function above its level, and
  !! the step from there with the factors of the matrix; the plastic strain is eliminated.
  pure subroutine find_step(level, now, search)
    real(wp), intent(in) :: level(lanes)
    type(iterate_t), intent(in) :: now
    type(search_t), intent(inout) :: search
    real(wp) :: k, w, f, x1, x2, x3, x4, x5, y1, y2, y3, y4, y5
    integer :: l

    associate (a => search%factors, g => now%gradient, s => now%stress, t => now%moved%stress, &
               fade => now%moved%stress_slope, step => search%new_step)
      !$omp simd private(k, w, f, x1, x2, x3, x4, x5, y1, y2, y3, y4, y5)
      do l = 1, lanes
        k = now%moved%stiffness(l)*now%dgamma(l)
        x1 = s(l, 1) - t(l, 1) + k*g(l, 1)
        x2 = s(l, 2) - t(l, 2) + k*g(l, 2)
        x3 = s(l, 3) - t(l, 3) + k*g(l, 3)
        x4 = s(l, 4) - t(l, 4) + k*g(l, 4)
        x5 = s(l, 5) - t(l, 5) + k*g(l, 5)
        f = now%q(l) - now%flow(l) - level(l)
        search%residual(l) = f*f + x1*x1 + x2*x2 + x3*x3 + x4*x4 + x5*x5
        w = now%moved%stiffness(l) + now%dgamma(l)*now%moved%stiffness_slope(l)
        y1 = w*g(l, 1) - fade(l, 1)
        y2 = w*g(l, 2) - fade(l, 2) - a(l, 1)*y1
        y3 = w*g(l, 3) - fade(l, 3) - a(l, 2)*y1 - a(l, 5)*y2
        y4 = w*g(l, 4) - fade(l, 4) - a(l, 3)*y1 - a(l, 6)*y2 - a(l, 8)*y3
        y5 = w*g(l, 5) - fade(l, 5) - a(l, 4)*y1 - a(l, 7)*y2 - a(l, 9)*y3 - a(l, 10)*y4
        x2 = x2 - a(l, 1)*x1
        x3 = x3 - a(l, 2)*x1 - a(l, 5)*x2
        x4 = x4 - a(l, 3)*x1 - a(l, 6)*x2 - a(l, 8)*x3
        x5 = x5 - a(l, 4)*x1 - a(l, 7)*x2 - a(l, 9)*x3 - a(l, 10)*x4
        x5 = a(l, 15)*x5; y5 = a(l, 15)*y5
        x4 = a(l, 14)*x4 - a(l, 10)*x5; y4 = a(l, 14)*y4 - a(l, 10)*y5
        x3 = a(l, 13)*x3 - a(l, 8)*x4 - a(l, 9)*x5; y3 = a(l, 13)*y3 - a(l, 8)*y4 - a(l, 9)*y5
        x2 = a(l, 12)*x2 - a(l, 5)*x3 - a(l, 6)*x4 - a(l, 7)*x5
        y2 = a(l, 12)*y2 - a(l, 5)*y3 - a(l, 6)*y4 - a(l, 7)*y5
        x1 = a(l, 11)*x1 - a(l, 1)*x2 - a(l, 2)*x3 - a(l, 3)*x4 - a(l, 4)*x5
        y1 = a(l, 11)*y1 - a(l, 1)*y2 - a(l, 2)*y3 - a(l, 3)*y4 - a(l, 4)*y5
        f = f - (g(l, 1)*x1 + g(l, 2)*x2 + g(l, 3)*x3 + g(l, 4)*x4 + g(l, 5)*x5)
        f = f/(g(l, 1)*y1 + g(l, 2)*y2 + g(l, 3)*y3 + g(l, 4)*y4 + g(l, 5)*y5 + now%slope(l))
        step(l, 1) = -x1 - f*y1; step(l, 2) = -x2 - f*y2; step(l, 3) = -x3 - f*y3
        step(l, 4) = -x4 - f*y4; step(l, 5) = -x5 - f*y5; step(l, 6) = f
      end do
    end associate
  end subroutine find_step

  !> Take the new step where the residuals have become smaller, else go back on the last one.
  pure subroutine advance(now, search, n_open, n_far)
    type(iterate_t), intent(inout) :: now
    type(search_t), intent(inout) :: search
    real(wp), intent(out) :: n_open, n_far        !! points not at the end, not even near to it
    real(wp), parameter :: decrease = 2.0e-4_wp, most_tries = 8.0_wp
    real(wp), parameter :: near = 4.0e-5_wp    ! residual over flow stress
    real(wp) :: way(lanes), taken(lanes), limit, shorter, old, is_last
    integer :: i, l

    n_open = 0.0_wp
    n_far = 0.0_wp
    !$omp simd private(limit, shorter, old, is_last) reduction(+:n_open, n_far)
    do l = 1, lanes
      old = search%length(l)
      taken(l) = merge(1.0_wp, 0.0_wp, search%tries(l) >= most_tries .or. &
                       search%residual(l) <= (1.0_wp - decrease*old)*search%before(l))
      limit = -0.9_wp*now%dgamma(l)/search%new_step(l, 6)
      limit = merge(1.0_wp, limit, now%dgamma(l) + search%new_step(l, 6) >= 0.0_wp)
      shorter = search%before(l)*old**2 &
                /max(search%residual(l) + (2.0_wp*old - 1.0_wp)*search%before(l), tiny(old))
      shorter = max(0.1_wp*old, min(0.5_wp*old, shorter))
      way(l) = search%open(l)*merge(limit, shorter - old, taken(l) > 0.5_wp)
      search%length(l) = merge(limit, shorter, taken(l) > 0.5_wp)
      search%before(l) = merge(search%residual(l), search%before(l), taken(l) > 0.5_wp)
      search%tries(l) = merge(0.0_wp, search%tries(l) + 1.0_wp, taken(l) > 0.5_wp)
      is_last = merge(taken(l), 0.0_wp, search%length(l) >= 1.0_wp .and. &
                      search%before(l) <= search%limit(l))
      search%open(l) = search%open(l)*(1.0_wp - is_last)
      n_open = n_open + search%open(l)
      is_last = merge(0.0_wp, 1.0_wp, search%length(l) >= 1.0_wp .and. &
                      search%before(l) <= (near*now%flow(l))**2)
      n_far = n_far + search%open(l)*is_last
    end do
    do i = 1, 5
      !$omp simd
      do l = 1, lanes
        search%step(l, i) = merge(search%new_step(l, i), search%step(l, i), taken(l) > 0.5_wp)
        now%stress(l, i) = now%stress(l, i) + way(l)*search%step(l, i)
      end do
    end do
    !$omp simd
    do l = 1, lanes
      search%step(l, 6) = merge(search%new_step(l, 6), search%step(l, 6), taken(l) > 0.5_wp)
      now%dgamma(l) = now%dgamma(l) + way(l)*search%step(l, 6)
    end do
  end subroutine advance

  !> The semi-implicit multi-stage scheme: one step along the normal of the last stage for each of
  !! the residual levels that fall evenly to zero (R. P. R. Cardoso and O. B. Adetoro, box 1
  !! with (39) for the residual, (44) and (45)). The back stresses move with each step and add to
  !! what resists it. Where the flow stress rises too steeply for a first step of that kind, it
  !! goes to the very root of its level.
  pure subroutine return_in_stages(curve, yield, kinematic, problem, n_stages, back, plastic, &
                                   dgamma)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: kinematic
    type(return_problem_t), intent(in) :: problem
    integer, intent(in) :: n_stages
    real(wp), intent(inout) :: back(:, :, :)
    real(wp), intent(out) :: plastic(lanes, 5), dgamma(lanes)
    type(moving_trial_t) :: moved
    real(wp) :: gradient(lanes, 5), relative(lanes, 5)
    real(wp), dimension(lanes) :: q, flow, slope, step, first, flows, reach, resistance
    real(wp), dimension(lanes) :: zero, bend, far
    real(wp) :: share
    integer :: i, l, stage
    logical :: ok

    zero = 0.0_wp
    plastic = 0.0_wp
    dgamma = 0.0_wp
    flow = problem%flow
    slope = problem%slope
    do stage = 1, n_stages
      call move_trial(kinematic, problem, back, zero, moved)
      do i = 1, 5
        !$omp simd
        do l = 1, lanes
          relative(l, i) = moved%stress(l, i) - 2.0_wp*problem%shear*plastic(l, i)
        end do
      end do
      call evaluate_yield(yield, relative, q, gradient)
      call look_ahead(-huge(share), gradient, moved, reach, resistance)
      if (stage == 1) then
        first = q - flow
        flows = merge(1.0_wp, 0.0_wp, first > 0.0_wp)
        if (.not. sum(flows) > 0.0_wp) return
      end if
      share = real(n_stages - stage, wp)/n_stages
      !$omp simd
      do l = 1, lanes
        q(l) = q(l) - share*first(l)
        step(l) = (q(l) - flow(l))/(resistance(l) + slope(l))
      end do
      if (stage == 1 .and. is_steep(curve)) then
        call solve_consistency(curve, lanes, problem%dt, q, resistance, problem%eqps, &
                               problem%factor, problem%guess, step, ok)
      end if
      call take_stage(flows, step, gradient, plastic, dgamma)
      call move_back_stresses(kinematic, gradient, step, back)
      if (stage < n_stages) call flow_after(curve, lanes, problem%dt, problem%eqps, &
                                            problem%factor, problem%flow, dgamma, flow, slope, &
                                            bend, far)
    end do
  end subroutine return_in_stages

  !> Add the plastic strain of a stage at the points that flow.
  pure subroutine take_stage(flows, step, gradient, plastic, dgamma)
    real(wp), intent(in) :: flows(lanes)
    real(wp), intent(inout) :: step(lanes)            !! out zero where nothing flows
    real(wp), intent(inout) :: gradient(lanes, 5)     !! out the plastic strain of the stage
    real(wp), intent(inout) :: plastic(lanes, 5), dgamma(lanes)
    integer :: i, l

    !$omp simd
    do l = 1, lanes
      step(l) = merge(step(l), 0.0_wp, flows(l) > 0.5_wp)
      dgamma(l) = dgamma(l) + step(l)
    end do
    do i = 1, 5
      !$omp simd
      do l = 1, lanes
        gradient(l, i) = step(l)*gradient(l, i)
        plastic(l, i) = plastic(l, i) + gradient(l, i)
      end do
    end do
  end subroutine take_stage

end module yield_return
