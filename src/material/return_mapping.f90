!> Return mapping: from a trial stress outside the yield surface back to it.
!!
!! To an anisotropic yield surface, in the axes of the material: of one point, or of a row of points
!! to Hill's quadratic surface.
!! The stress in the yield function is the relative one, stress less back stresses; without those
!! it is the stress itself. All are deviators.
!!
!! Backward Euler by Newton's method for stress and plastic strain together with a line search
!! (W. M. Scherzinger, CMAME 317 (2017)); where that does not converge in one go, by residual
!! levels that fall to zero (J. W. Yoon, D. Y. Yang and K. Chung, CMAME 174 (1999)), each the start
!! of the next. The semi-implicit multi-stage scheme takes the levels without iteration.
!!
!! Hill's surface: in the two modes of the normal stresses and the three shears the backward Euler
!! equations part (J. C. Simo and R. L. Taylor, IJNME 22 (1986), for plane stress): each mode of the
!! trial stress is divided by 1 + mu dgamma/flow, and one scalar equation for dgamma is left.
module return_mapping
  use kinds, only: wp
  use flow_curve, only: flow_curve_t, flow_after, is_steep
  use yield_function, only: yield_function_t, evaluate_yield
  use hardening, only: back_stresses_t
  use consistency, only: solve_consistency
  implicit none
  private

  public :: return_to_yield, return_in_stages, return_to_hill

  !> What stays the same during the return of one point.
  type, public :: return_problem_t
    real(wp) :: bulk = 0.0_wp, shear = 0.0_wp   !! [stress]
    real(wp) :: dt = 0.0_wp                     !! [time]
    real(wp) :: eqps = 0.0_wp                   !! before the increment
    real(wp) :: factor = 1.0_wp                 !! on the flow stress
    real(wp) :: trial(6) = 0.0_wp               !! stress
    type(back_stresses_t) :: kinematic
    real(wp), allocatable :: back(:, :)         !! back stresses, updated by the return, (6, n)
  end type return_problem_t

  !> State of the iteration: relative stress, residuals 2G (strain), shape (6), and of the yield
  !! function above the flow stress [stress].
  type :: iterate_t
    real(wp) :: stress(6), dgamma
    real(wp) :: strain_residual(6), yield_residual, slope, gradient(6), hessian(6, 6), flow
    real(wp) :: stiffness            !! 2G, and what the back stresses add
    real(wp) :: by_dgamma(6)         !! derivative of the strain residual
  end type iterate_t

  !> What the relative stress would be with a plastic strain that has faded the back stresses, the
  !! stiffness against which it flows, and the derivatives of both.
  type :: moving_trial_t
    real(wp) :: stress(6), stiffness, stress_slope(6), stiffness_slope
  end type moving_trial_t

contains

  !> Backward Euler, for a trial stress outside the yield surface. `stress` is the new stress.
  pure subroutine return_to_yield(curve, yield, problem, stress, dgamma, ok)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(return_problem_t), intent(inout) :: problem
    real(wp), intent(out) :: stress(6), dgamma
    logical, intent(out) :: ok
    integer, parameter :: counts(4) = [1, 5, 25, 125]
    type(iterate_t) :: now
    real(wp) :: first, flow
    integer :: attempt, level

    do attempt = 1, size(counts)
      call start(curve, yield, problem, counts(attempt), now, first, flow)
      do level = 1, counts(attempt)
        call iterate(curve, yield, problem, level_at(level, counts(attempt), first, flow), now, ok)
        if (.not. ok) exit
      end do
      if (ok) exit
    end do
    dgamma = now%dgamma
    call move_back_stresses(now%gradient, dgamma, problem)
    stress = now%stress
    if (problem%kinematic%n > 0) stress = stress + sum(problem%back, 2)
  end subroutine return_to_yield

  !> Back stresses after the plastic strain `dgamma` along a gradient of the yield function.
  pure subroutine move_back_stresses(gradient, dgamma, problem)
    real(wp), intent(in) :: gradient(6), dgamma
    type(return_problem_t), intent(inout) :: problem
    real(wp) :: strain(6)
    integer :: k

    strain = dgamma*gradient
    strain(4:) = 0.5_wp*strain(4:)
    do k = 1, problem%kinematic%n
      associate (c => problem%kinematic%modulus(k), gamma => problem%kinematic%recall(k))
        problem%back(:, k) = (problem%back(:, k) + 2.0_wp/3.0_wp*c*strain)/(1.0_wp + gamma*dgamma)
      end associate
    end do
  end subroutine move_back_stresses

  !> See `moving_trial_t`.
  pure function moved_trial(problem, dgamma) result(moved)
    type(return_problem_t), intent(in) :: problem
    real(wp), intent(in) :: dgamma
    type(moving_trial_t) :: moved
    real(wp) :: theta
    integer :: k

    moved = moving_trial_t(problem%trial, 2.0_wp*problem%shear, 0.0_wp, 0.0_wp)
    do k = 1, problem%kinematic%n
      associate (c => 2.0_wp/3.0_wp*problem%kinematic%modulus(k), &
                 gamma => problem%kinematic%recall(k))
        theta = 1.0_wp/(1.0_wp + gamma*dgamma)
        moved%stress = moved%stress - theta*problem%back(:, k)
        moved%stress_slope = moved%stress_slope + gamma*theta**2*problem%back(:, k)
        moved%stiffness = moved%stiffness + theta*c
        moved%stiffness_slope = moved%stiffness_slope - gamma*theta**2*c
      end associate
    end do
  end function moved_trial

  !> Residual level i of n: yield stress plus level falls by equal factors, so that the last step
  !! is no longer than the others however far out the trial stress lies.
  pure real(wp) function level_at(i, n, first, flow)
    integer, intent(in) :: i, n
    real(wp), intent(in) :: first, flow   !! residual of the trial stress, first flow stress
    real(wp), parameter :: least = 1.0e-6_wp
    real(wp) :: lowest

    lowest = max(flow, least*first)
    level_at = lowest*((1.0_wp + first/lowest)**(real(n - i, wp)/n) - 1.0_wp)
  end function level_at

  !> One step along the trial normal towards the first of the levels; where the flow stress rises
  !! too steeply for that, to the very root.
  pure subroutine start(curve, yield, problem, n_levels, now, first, before)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(return_problem_t), intent(in) :: problem
    integer, intent(in) :: n_levels
    type(iterate_t), intent(out) :: now
    real(wp), intent(out) :: first    !! residual of the trial stress [stress]
    real(wp), intent(out) :: before   !! flow stress before the increment
    type(moving_trial_t) :: moved
    real(wp) :: q, gradient(6), normal(6), resistance, step(1), flow(1), slope(1), bend(1), reach(1)
    logical :: ok

    moved = moved_trial(problem, 0.0_wp)
    call evaluate_yield(yield, moved%stress, q, gradient)
    call flow_after(curve, 1, problem%dt, [problem%eqps], [problem%factor], [0.0_wp], &
                    flow, slope, bend, reach)
    before = flow(1)
    first = q - before
    normal = moved%stiffness*gradient
    normal(4:) = 0.5_wp*normal(4:)
    resistance = max(dot_product(normal - moved%stress_slope, gradient), problem%shear)
    q = q - level_at(1, n_levels, first, before)
    if (is_steep(curve)) then
      call solve_consistency(curve, 1, problem%dt, [q], [resistance], [problem%eqps], &
                             [problem%factor], [huge(q)], step, ok)
    else
      step = (q - before)/(resistance + slope)
    end if
    now%dgamma = step(1)
    now%stress = moved%stress - now%dgamma*(normal - moved%stress_slope)
    call evaluate(curve, yield, problem, now)
  end subroutine start

  !> Residuals and derivatives at the stress and plastic strain of `now`.
  pure subroutine evaluate(curve, yield, problem, now)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(return_problem_t), intent(in) :: problem
    type(iterate_t), intent(inout) :: now
    type(moving_trial_t) :: moved
    real(wp) :: q, flow(1), slope(1), bend(1), reach(1), mean

    call evaluate_yield(yield, now%stress, q, now%gradient, now%hessian)
    call flow_after(curve, 1, problem%dt, [problem%eqps], [problem%factor], [now%dgamma], flow, &
                    slope, bend, reach)
    now%flow = flow(1)
    now%slope = slope(1)
    now%yield_residual = q - flow(1)
    moved = moved_trial(problem, now%dgamma)
    now%stiffness = moved%stiffness
    associate (r => now%strain_residual)
      r = now%stress - moved%stress
      mean = sum(r(:3))/3.0_wp
      r(:3) = r(:3) - mean + 2.0_wp*problem%shear/(3.0_wp*problem%bulk)*mean
      r(4:) = 2.0_wp*r(4:)
      r = r + moved%stiffness*now%dgamma*now%gradient
    end associate
    moved%stress_slope(4:) = 2.0_wp*moved%stress_slope(4:)
    now%by_dgamma = (moved%stiffness + now%dgamma*moved%stiffness_slope)*now%gradient &
                    - moved%stress_slope
  end subroutine evaluate

  !> Newton's method with a line search on the sum of the squared residuals, down to `level`.
  pure subroutine iterate(curve, yield, problem, level, now, ok)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(return_problem_t), intent(in) :: problem
    real(wp), intent(in) :: level
    type(iterate_t), intent(inout) :: now
    logical, intent(out) :: ok
    integer, parameter :: max_iterations = 40
    real(wp), parameter :: surface = 1.0e-12_wp, strain = 1.0e-12_wp
    real(wp) :: dstress(6), ddgamma, before, after, length, scale_of, old(6), old_dgamma
    integer :: iteration, shortening

    scale_of = maxval(abs(problem%trial))
    do iteration = 1, max_iterations
      ok = abs(now%yield_residual - level) <= surface*now%flow &
           .and. maxval(abs(now%strain_residual)) <= strain*scale_of
      if (ok) return
      call newton_step(problem, level, now, dstress, ddgamma, ok)
      if (.not. ok) return
      before = sum(now%strain_residual**2) + (now%yield_residual - level)**2
      length = 1.0_wp
      if (now%dgamma + ddgamma < 0.0_wp) length = -0.9_wp*now%dgamma/ddgamma
      old = now%stress
      old_dgamma = now%dgamma
      do shortening = 1, 8
        now%stress = old + length*dstress
        now%dgamma = old_dgamma + length*ddgamma
        call evaluate(curve, yield, problem, now)
        after = sum(now%strain_residual**2) + (now%yield_residual - level)**2
        if (after <= (1.0_wp - 2.0e-4_wp*length)*before) exit
        length = max(0.1_wp*length, min(0.5_wp*length, &
                     before*length**2/max(after - before + 2.0_wp*length*before, tiny(after))))
      end do
    end do
    ok = .false.
  end subroutine iterate

  !> One step: the matrix of the stress is elastic flexibility plus the curvature of the yield
  !! surface, positive definite, and the plastic strain is eliminated.
  pure subroutine newton_step(problem, level, now, dstress, ddgamma, ok)
    type(return_problem_t), intent(in) :: problem
    real(wp), intent(in) :: level
    type(iterate_t), intent(in) :: now
    real(wp), intent(out) :: dstress(6), ddgamma
    logical, intent(out) :: ok
    real(wp) :: matrix(6, 6), columns(6, 2)
    integer :: i

    matrix = now%stiffness*now%dgamma*now%hessian
    matrix(:3, :3) = matrix(:3, :3) - 1.0_wp/3.0_wp &
                     + 2.0_wp*problem%shear/(9.0_wp*problem%bulk)
    do i = 1, 3
      matrix(i, i) = matrix(i, i) + 1.0_wp
      matrix(i + 3, i + 3) = matrix(i + 3, i + 3) + 2.0_wp
    end do
    columns(:, 1) = now%strain_residual
    columns(:, 2) = now%by_dgamma
    call solve_definite(matrix, columns, ok)
    ddgamma = (now%yield_residual - level - dot_product(now%gradient, columns(:, 1))) &
              /(dot_product(now%gradient, columns(:, 2)) + now%slope)
    dstress = -columns(:, 1) - ddgamma*columns(:, 2)
  end subroutine newton_step

  !> Solve with a symmetric positive definite matrix by Cholesky's method; not ok where it is not.
  pure subroutine solve_definite(matrix, columns, ok)
    real(wp), intent(inout) :: matrix(6, 6)    !! its lower part; overwritten
    real(wp), intent(inout) :: columns(6, 2)   !! right sides in, solutions out
    logical, intent(out) :: ok
    integer :: i, j

    do j = 1, 6
      do i = 1, j - 1
        matrix(j:, j) = matrix(j:, j) - matrix(j, i)*matrix(j:, i)
      end do
      ok = matrix(j, j) > 0.0_wp
      if (.not. ok) return
      matrix(j:, j) = matrix(j:, j)/sqrt(matrix(j, j))
    end do
    do i = 1, 6
      columns(i, :) = columns(i, :)/matrix(i, i)
      do j = i + 1, 6
        columns(j, :) = columns(j, :) - matrix(j, i)*columns(i, :)
      end do
    end do
    do i = 6, 1, -1
      columns(i, :) = columns(i, :)/matrix(i, i)
      do j = 1, i - 1
        columns(j, :) = columns(j, :) - matrix(i, j)*columns(i, :)
      end do
    end do
  end subroutine solve_definite

  !> The semi-implicit multi-stage scheme: one step along the normal of the last stage for each of
  !! the residual levels that fall evenly to zero (R. P. R. Cardoso and O. B. Adetoro, box 1
  !! with (39) for the residual, (44) and (45)). The back stresses move with each step and add to
  !! what resists it. Where the flow stress rises too steeply for a first step of that kind, it
  !! goes to the very root of its level.
  pure subroutine return_in_stages(curve, yield, problem, n_stages, stress, dgamma)
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(return_problem_t), intent(inout) :: problem
    integer, intent(in) :: n_stages
    real(wp), intent(out) :: stress(6), dgamma   !! new stress, not the relative one
    type(moving_trial_t) :: moved
    real(wp) :: q, gradient(6), normal(6), flow(1), slope(1), bend(1), reach(1), step(1)
    real(wp) :: first, resistance
    integer :: stage
    logical :: ok

    stress = problem%trial
    dgamma = 0.0_wp
    first = 0.0_wp
    do stage = 1, n_stages
      moved = moved_trial(problem, 0.0_wp)
      call evaluate_yield(yield, stress + (moved%stress - problem%trial), q, gradient)
      call flow_after(curve, 1, problem%dt, [problem%eqps], [problem%factor], [dgamma], &
                      flow, slope, bend, reach)
      if (stage == 1) first = q - flow(1)
      normal = moved%stiffness*gradient
      normal(4:) = 0.5_wp*normal(4:)
      resistance = dot_product(normal - moved%stress_slope, gradient)
      q = q - first*real(n_stages - stage, wp)/n_stages
      if (stage == 1 .and. is_steep(curve)) then
        call solve_consistency(curve, 1, problem%dt, [q], [resistance], [problem%eqps], &
                               [problem%factor], [huge(q)], step, ok)
      else
        step = (q - flow)/(resistance + slope)
      end if
      dgamma = dgamma + step(1)
      stress = stress - 2.0_wp*problem%shear/moved%stiffness*step(1)*normal
      call move_back_stresses(gradient, step(1), problem)
    end do
  end subroutine return_in_stages

  !> New stresses of the points that yield. Points that do not converge in a few steps are left as
  !! they were, for another method.
  pure subroutine return_to_hill(curve, yield, shear, dt, n, eqps, factor, stress, dgamma, is_done)
    type(flow_curve_t), intent(in) :: curve         !! of finite slope
    type(yield_function_t), intent(in) :: yield     !! quadratic
    real(wp), intent(in) :: shear, dt
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n), factor(n)      !! before the increment
    real(wp), intent(inout) :: stress(n, 6)         !! trial in, new out; deviators
    real(wp), intent(out) :: dgamma(n)
    logical, intent(out) :: is_done(n)
    integer, parameter :: max_iterations = 15
    real(wp), parameter :: tolerance = 1.0e-13_wp
    real(wp), dimension(n) :: flow, slope, bend, reach, q, shrink_slope
    real(wp) :: mode(n, 5), stiffness(5), x, step
    integer :: l, iteration

    call split(yield, shear, n, stress, mode, stiffness)
    dgamma = 0.0_wp
    do iteration = 1, max_iterations
      call flow_after(curve, n, dt, eqps, factor, dgamma, flow, slope, bend, reach)
      call equivalent(yield, n, mode, stiffness, dgamma/flow, q, shrink_slope)
      if (iteration == 1) is_done = q <= flow
      is_done = is_done .or. abs(q - flow) <= tolerance*flow
      if (all(is_done)) exit
      do l = 1, n
        if (is_done(l)) cycle
        ! Newton on 1/q - 1/flow, which is nearly straight.
        x = dgamma(l)/flow(l)
        step = (q(l) - flow(l))/(q(l)*flow(l)) &
               /(shrink_slope(l)/q(l)**2*(1.0_wp - x*slope(l))/flow(l) + slope(l)/flow(l)**2)
        dgamma(l) = max(dgamma(l) + step, 0.0_wp)
      end do
    end do
    do l = 1, n
      if (is_done(l) .and. dgamma(l) > 0.0_wp) then
        mode(l, :) = mode(l, :)/(1.0_wp + stiffness*dgamma(l)/flow(l))
        stress(l, :3) = yield%modes(:, 1)*mode(l, 1) + yield%modes(:, 2)*mode(l, 2)
        stress(l, 4:) = mode(l, 3:)
      end if
    end do
  end subroutine return_to_hill

  !> Modes of the stresses, and the stiffness against the flow of each.
  pure subroutine split(yield, shear, n, stress, mode, stiffness)
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: shear
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(n, 6)
    real(wp), intent(out) :: mode(n, 5), stiffness(5)
    integer :: i

    do i = 1, 2
      mode(:, i) = yield%modes(1, i)*stress(:, 1) + yield%modes(2, i)*stress(:, 2) &
                   + yield%modes(3, i)*stress(:, 3)
    end do
    mode(:, 3:) = stress(:, 4:)
    ! A shear strain is an engineering one.
    stiffness(:2) = 2.0_wp*shear*yield%weights(:2)
    stiffness(3:) = shear*yield%weights(3:)
  end subroutine split

  !> Equivalent stress of the modes after their division by 1 + stiffness x, and by how much it
  !! falls with x.
  pure subroutine equivalent(yield, n, mode, stiffness, x, q, fall)
    type(yield_function_t), intent(in) :: yield
    integer, intent(in) :: n
    real(wp), intent(in) :: mode(n, 5), stiffness(5), x(n)
    real(wp), intent(out) :: q(n), fall(n)
    real(wp) :: divisor, part
    integer :: i, l

    q = tiny(q)
    fall = 0.0_wp
    do i = 1, 5
      !$omp simd private(divisor, part)
      do l = 1, n
        divisor = 1.0_wp/(1.0_wp + stiffness(i)*x(l))
        part = yield%weights(i)*(mode(l, i)*divisor)**2
        q(l) = q(l) + part
        fall(l) = fall(l) + part*stiffness(i)*divisor
      end do
    end do
    !$omp simd
    do l = 1, n
      q(l) = sqrt(q(l))
      fall(l) = fall(l)/q(l)
    end do
  end subroutine equivalent

end module return_mapping
