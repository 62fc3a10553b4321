!> Von Mises plasticity with any flow curve and with back stresses (combined hardening), a row of
!! points at a time.
!!
!! Without back stresses: radial return (J. C. Simo and T. J. R. Hughes, Computational Inelasticity,
!! Springer 1998, box 3.2). `voce` is the faster law for its one case.
!!
!! Back stresses as in `hardening`: with the direction n = (s - alpha)/|s - alpha|, of unit von
!! Mises norm, each grows by C n dgamma - gamma alpha dgamma. Backward Euler leaves one scalar
!! equation (M. Kobayashi and N. Ohno, IJNME 53 (2002), for rules of this kind).
module mises_plastic
  use kinds, only: wp
  use block_law, only: block_law_t, set_elastic, search_plane
  use flow_curve, only: flow_curve_t, flow_at, flow_after, is_steep, has_rate, lowest_flow, &
                        thermal_factor, heat_up
  use hardening, only: back_stresses_t, back_stress_warning
  use consistency, only: solve_consistency, solve_in_stages, begin_at, advance, max_iterations
  use plane_return, only: find_plane_flow, plane_back_stresses, add_plane_back_stresses
  use plane_stress, only: plane_trial, flow_in_plane, mode_moduli, plane_work, in_space
  use tensor_rotation, only: rotate_by_spin
  use voce, only: elastic_trial
  implicit none
  private

  public :: new_mises_plastic, set_plastic, equivalent_strain

  !> The state is the equivalent plastic strain and then the six components of each back stress,
  !! deviators with tensor shear; with heating, the temperature rise comes last.
  type, extends(block_law_t), public :: mises_plastic_t
    type(flow_curve_t) :: curve
    type(back_stresses_t) :: back
    integer :: n_stages = 0       !! of the multi-stage return, 0: backward Euler
    real(wp) :: lowest = 0.0_wp   !! rows whose stresses stay below it remain elastic [stress]
  contains
    procedure :: update
    procedure :: update_plane
    procedure :: find_plane_strain
    procedure :: flow_plane
    procedure :: shear_warning
  end type mises_plastic_t

contains

  !> Law from density, elastic constants, flow curve, back stresses and the stages of its return.
  pure function new_mises_plastic(density, young, poisson, curve, back, n_stages) result(law)
    real(wp), intent(in) :: density, young, poisson
    type(flow_curve_t), intent(in) :: curve
    type(back_stresses_t), intent(in) :: back
    integer, intent(in) :: n_stages   !! 0: backward Euler
    type(mises_plastic_t) :: law

    call set_elastic(law, density, young, poisson)
    call set_plastic(law, curve, back, n_stages, 1)
  end function new_mises_plastic

  !> Set what describes plastic flow, and the number of state variables.
  pure subroutine set_plastic(law, curve, back, n_stages, n_first)
    class(mises_plastic_t), intent(inout) :: law
    type(flow_curve_t), intent(in) :: curve
    type(back_stresses_t), intent(in) :: back
    integer, intent(in) :: n_stages
    integer, intent(in) :: n_first   !! state variables before those of the back stresses

    law%n_state = n_first + 6*back%n
    if (curve%heating%is_active) law%n_state = law%n_state + 1
    law%eqps_state = 1
    law%curve = curve
    law%lowest = lowest_flow(curve)
    law%back = back
    law%n_stages = n_stages
  end subroutine set_plastic

  !> Elastic trial, then the return of the points that yield.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp) :: mises(n), guess(n), worst
    integer :: k

    call elastic_trial(n, self%bulk, self%shear, dstrain, stress, mises, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok .or. .not. (self%back%n > 0 .or. worst > self%lowest .or. self%is_awake)) return
    guess = 0.0_wp
    if (has_rate(self%curve) .or. is_steep(self%curve)) guess = equivalent_strain(n, dstrain)
    if (self%back%n == 0) then
      call return_radially(self, n, dt, mises, guess, stress, state, ok)
      return
    end if
    if (present(spin)) then
      do k = 1, self%back%n
        call rotate_by_spin(n, spin, state(:, 6*k - 4:6*k + 1))
      end do
    end if
    call return_with_back_stresses(self, n, dt, mises, guess, stress, state, ok)
  end subroutine update

  !> Equivalent strain of increments, sqrt(2/3 e:e) of their deviators.
  pure function equivalent_strain(n, dstrain) result(strain)
    integer, intent(in) :: n
    real(wp), intent(in) :: dstrain(n, 6)
    real(wp) :: strain(n)
    integer :: l

    !$omp simd
    do l = 1, n
      strain(l) = sqrt(2.0_wp/9.0_wp*((dstrain(l, 1) - dstrain(l, 2))**2 &
                                      + (dstrain(l, 2) - dstrain(l, 3))**2 &
                                      + (dstrain(l, 3) - dstrain(l, 1))**2) &
                       + (dstrain(l, 4)**2 + dstrain(l, 5)**2 + dstrain(l, 6)**2)/3.0_wp)
    end do
  end function equivalent_strain

  !> Radial return of a row without back stresses.
  subroutine return_radially(self, n, dt, mises, guess, stress, state, ok)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, mises(n)   !! of the trial stress
    real(wp), intent(in) :: guess(n)       !! see `begin_at`
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(inout) :: ok
    real(wp) :: stiffness(n), dgamma(n), factor(n)

    stiffness = 3.0_wp*self%shear
    factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    if (self%n_stages > 0) then
      call solve_in_stages(self%curve, self%n_stages, n, dt, mises, stiffness, state(:, 1), &
                           factor, guess, dgamma)
    else
      call solve_consistency(self%curve, n, dt, mises, stiffness, state(:, 1), factor, guess, &
                             dgamma, ok)
    end if
    call shrink_deviator(n, 1.0_wp - stiffness*dgamma/max(mises, tiny(dt)), stress)
    state(:, 1) = state(:, 1) + dgamma
    if (self%curve%heating%is_active) &
      call heat_up(self%curve%heating, (mises - stiffness*dgamma)*dgamma, &
                   state(:, self%n_state))
  end subroutine return_radially

  !> Multiply the deviator by `scaling` and leave the mean stress.
  pure subroutine shrink_deviator(n, scaling, stress)
    integer, intent(in) :: n
    real(wp), intent(in) :: scaling(n)
    real(wp), intent(inout) :: stress(n, 6)
    real(wp) :: mean
    integer :: l

    !$omp simd private(mean)
    do l = 1, n
      mean = (1.0_wp - scaling(l))*(stress(l, 1) + stress(l, 2) + stress(l, 3))/3.0_wp
      stress(l, 1) = scaling(l)*stress(l, 1) + mean
      stress(l, 2) = scaling(l)*stress(l, 2) + mean
      stress(l, 3) = scaling(l)*stress(l, 3) + mean
      stress(l, 4) = scaling(l)*stress(l, 4)
      stress(l, 5) = scaling(l)*stress(l, 5)
      stress(l, 6) = scaling(l)*stress(l, 6)
    end do
  end subroutine shrink_deviator

  !> Return of a row with back stresses.
  subroutine return_with_back_stresses(self, n, dt, mises, guess, stress, state, ok)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, mises(n)   !! of the trial stress
    real(wp), intent(in) :: guess(n)       !! see `begin_at`
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(inout) :: ok
    real(wp), dimension(n) :: factor, work

    factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    if (self%n_stages > 0) then
      call return_in_stages(self, n, dt, factor, guess, stress, state(:, 1), state(:, 2:), work)
    else
      call return_points(self, n, dt, mises, factor, guess, stress, state(:, 1), state(:, 2:), &
                         work, ok)
    end if
    if (self%curve%heating%is_active) &
      call heat_up(self%curve%heating, work, state(:, self%n_state))
  end subroutine return_with_back_stresses

  !> Backward Euler: |s - sum theta alpha| - (3G + sum theta C) dgamma = flow(dgamma) with theta =
  !! 1/(1 + gamma dgamma), in which deviator and back stresses count by their products alone. The
  !! left side falls by 3G at least where back stresses stay below C/gamma.
  subroutine return_points(self, n, dt, mises, factor, guess, stress, eqps, back, work, ok)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt
    real(wp), intent(in), dimension(n) :: mises, factor, guess
    real(wp), intent(inout) :: stress(n, 6), eqps(n), back(n, 6, self%back%n)
    real(wp), intent(out) :: work(n)          !! of the stress on the plastic strain
    logical, intent(out) :: ok
    real(wp), dimension(n) :: low, high, last, dgamma, norm, fall, curvature, flow, slope, bend, &
                              reach, start, first
    real(wp) :: products(n, 0:self%back%n, 0:self%back%n), relative(n, 6), theta(n, self%back%n)
    integer :: k, iteration

    call find_products(n, self%back%n, mises, stress, back, products)
    dgamma = 0.0_wp
    work = 0.0_wp
    call relative_stress(self, n, products, dgamma, norm, fall, curvature)
    call flow_at(self%curve, n, eqps, factor, start, slope, bend, reach)
    flow = start
    ok = all(norm <= flow)
    if (ok) return
    first = norm
    do k = 1, self%back%n
      first = first + sqrt(products(:, k, k))
    end do
    low = 0.0_wp
    high = 0.0_wp
    last = 0.0_wp
    where (norm > flow) high = (first - flow)/(3.0_wp*self%shear)
    call begin_at(self%curve, n, slope, fall, high, guess, dgamma)
    do iteration = 1, max_iterations
      if (iteration > 1 .or. any(dgamma > 0.0_wp)) then
        call relative_stress(self, n, products, dgamma, norm, fall, curvature)
        call flow_after(self%curve, n, dt, eqps, factor, start, dgamma, flow, slope, bend, reach)
      end if
      norm = norm - flow
      fall = fall + slope
      bend = curvature + bend
      call advance(n, iteration, first, norm, fall, bend, reach, low, high, last, dgamma, ok)
      if (ok) exit
    end do
    call find_relative(self, n, dgamma, stress, back, theta, relative, norm)
    call flow_along(self, n, dgamma, norm, theta, relative, stress, back, work)
    eqps = eqps + dgamma
  end subroutine return_points

  !> Products of the deviator (0) and the back stresses.
  pure subroutine find_products(n, n_back, mises, stress, back, products)
    integer, intent(in) :: n, n_back
    real(wp), intent(in) :: mises(n), stress(n, 6), back(n, 6, n_back)
    real(wp), intent(out) :: products(n, 0:n_back, 0:n_back)
    integer :: i, k

    products(:, 0, 0) = mises**2
    do k = 1, n_back
      call multiply(n, stress, back(:, :, k), products(:, 0, k))
      products(:, k, 0) = products(:, 0, k)
      do i = 1, k
        call multiply(n, back(:, :, i), back(:, :, k), products(:, i, k))
        products(:, k, i) = products(:, i, k)
      end do
    end do
  end subroutine find_products

  !> 3/2 a:b of the deviator of a with the deviator b, the square of the von Mises norm for a
  !! deviator with itself.
  pure subroutine multiply(n, a, b, product)
    integer, intent(in) :: n
    real(wp), intent(in) :: a(n, 6), b(n, 6)
    real(wp), intent(out) :: product(n)
    integer :: l

    !$omp simd
    do l = 1, n
      product(l) = 1.5_wp*((a(l, 1) - a(l, 3))*b(l, 1) + (a(l, 2) - a(l, 3))*b(l, 2)) &
                   + 3.0_wp*(a(l, 4)*b(l, 4) + a(l, 5)*b(l, 5) + a(l, 6)*b(l, 6))
    end do
  end subroutine multiply

  !> The left side of the equation of `return_points`, by how much it falls with `dgamma` and how
  !! this fall fades.
  pure subroutine relative_stress(self, n, products, dgamma, norm, fall, curvature)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: products(n, 0:self%back%n, 0:self%back%n), dgamma(n)
    real(wp), intent(out), dimension(n) :: norm, fall, curvature
    real(wp), dimension(n, self%back%n) :: theta, across, along
    real(wp), dimension(n) :: square, growth, bent
    real(wp) :: length, per_length, own
    integer :: l, k, m

    do k = 1, self%back%n
      theta(:, k) = 1.0_wp/(1.0_wp + self%back%recall(k)*dgamma)
    end do
    ! Products of each back stress with the relative stress and with its derivative.
    do k = 1, self%back%n
      across(:, k) = products(:, 0, k)
      along(:, k) = 0.0_wp
      do m = 1, self%back%n
        !$omp simd
        do l = 1, n
          across(l, k) = across(l, k) - theta(l, m)*products(l, m, k)
          along(l, k) = along(l, k) + self%back%recall(m)*theta(l, m)**2*products(l, m, k)
        end do
      end do
    end do
    square = products(:, 0, 0)
    growth = 0.0_wp
    bent = 0.0_wp
    norm = -3.0_wp*self%shear*dgamma
    fall = 3.0_wp*self%shear
    curvature = 0.0_wp
    do k = 1, self%back%n
      associate (gamma => self%back%recall(k), c => self%back%modulus(k))
        !$omp simd private(own)
        do l = 1, n
          own = gamma*theta(l, k)**2
          square(l) = square(l) - theta(l, k)*(across(l, k) + products(l, 0, k))
          growth(l) = growth(l) + own*across(l, k)
          bent(l) = bent(l) + own*(along(l, k) - 2.0_wp*gamma*theta(l, k)*across(l, k))
          norm(l) = norm(l) - theta(l, k)*c*dgamma(l)
          fall(l) = fall(l) + theta(l, k)**2*c
          curvature(l) = curvature(l) + 2.0_wp*own*theta(l, k)*c
        end do
      end associate
    end do
    !$omp simd private(length, per_length)
    do l = 1, n
      length = sqrt(max(square(l), tiny(length)))
      per_length = 1.0_wp/length
      growth(l) = growth(l)*per_length
      norm(l) = norm(l) + length
      fall(l) = fall(l) - growth(l)
      curvature(l) = curvature(l) + (bent(l) - growth(l)**2)*per_length
    end do
  end subroutine relative_stress

  !> The relative stress after `dgamma`: deviator less the back stresses, which it has faded.
  pure subroutine find_relative(self, n, dgamma, stress, back, theta, relative, norm)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dgamma(n), stress(n, 6), back(n, 6, self%back%n)
    real(wp), intent(out) :: theta(n, self%back%n)   !! what is left of each back stress
    real(wp), intent(out) :: relative(n, 6), norm(n)
    real(wp) :: mean, left
    integer :: k, l

    !$omp simd private(mean)
    do l = 1, n
      mean = (stress(l, 1) + stress(l, 2) + stress(l, 3))*(1.0_wp/3.0_wp)
      relative(l, 1) = stress(l, 1) - mean
      relative(l, 2) = stress(l, 2) - mean
      relative(l, 3) = stress(l, 3) - mean
      relative(l, 4) = stress(l, 4)
      relative(l, 5) = stress(l, 5)
      relative(l, 6) = stress(l, 6)
    end do
    do k = 1, self%back%n
      !$omp simd private(left)
      do l = 1, n
        left = 1.0_wp/(1.0_wp + self%back%recall(k)*dgamma(l))
        theta(l, k) = left
        relative(l, 1) = relative(l, 1) - left*back(l, 1, k)
        relative(l, 2) = relative(l, 2) - left*back(l, 2, k)
        relative(l, 3) = relative(l, 3) - left*back(l, 3, k)
        relative(l, 4) = relative(l, 4) - left*back(l, 4, k)
        relative(l, 5) = relative(l, 5) - left*back(l, 5, k)
        relative(l, 6) = relative(l, 6) - left*back(l, 6, k)
      end do
    end do
    call multiply(n, relative, relative, norm)
    norm = sqrt(max(norm, tiny(norm)))
  end subroutine find_relative

  !> Flow by `dgamma` along the relative stress, of von Mises norm `norm`.
  pure subroutine flow_along(self, n, dgamma, norm, theta, relative, stress, back, work)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dgamma(n), norm(n), theta(n, self%back%n), relative(n, 6)
    real(wp), intent(inout) :: stress(n, 6), back(n, 6, self%back%n)
    real(wp), intent(out) :: work(n)          !! of the stress after it on the plastic strain
    real(wp) :: scaling(n), along, left
    integer :: k, l

    scaling = dgamma/norm
    !$omp simd private(along)
    do l = 1, n
      along = -3.0_wp*self%shear*scaling(l)
      stress(l, 1) = stress(l, 1) + along*relative(l, 1)
      stress(l, 2) = stress(l, 2) + along*relative(l, 2)
      stress(l, 3) = stress(l, 3) + along*relative(l, 3)
      stress(l, 4) = stress(l, 4) + along*relative(l, 4)
      stress(l, 5) = stress(l, 5) + along*relative(l, 5)
      stress(l, 6) = stress(l, 6) + along*relative(l, 6)
    end do
    do k = 1, self%back%n
      !$omp simd private(along, left)
      do l = 1, n
        left = theta(l, k)
        along = left*self%back%modulus(k)*scaling(l)
        back(l, 1, k) = left*back(l, 1, k) + along*relative(l, 1)
        back(l, 2, k) = left*back(l, 2, k) + along*relative(l, 2)
        back(l, 3, k) = left*back(l, 3, k) + along*relative(l, 3)
        back(l, 4, k) = left*back(l, 4, k) + along*relative(l, 4)
        back(l, 5, k) = left*back(l, 5, k) + along*relative(l, 5)
        back(l, 6, k) = left*back(l, 6, k) + along*relative(l, 6)
      end do
    end do
    if (.not. self%curve%heating%is_active) return
    call multiply(n, stress, relative, work)
    work = scaling*work
  end subroutine flow_along

  !> The multi-stage scheme, see `consistency`. The direction of the flow changes with the stages.
  subroutine return_in_stages(self, n, dt, factor, guess, stress, eqps, back, work)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, factor(n), guess(n)
    real(wp), intent(inout) :: stress(n, 6), eqps(n), back(n, 6, self%back%n)
    real(wp), intent(out) :: work(n)          !! of the stress on the plastic strain
    real(wp), dimension(n) :: start, first, flow, slope, bend, reach, norm, level, resistance
    real(wp), dimension(n) :: step, dgamma
    real(wp) :: relative(n, 6), theta(n, self%back%n)
    integer :: k, stage
    logical :: ok

    call flow_at(self%curve, n, eqps, factor, start, slope, bend, reach)
    dgamma = 0.0_wp
    step = 0.0_wp
    first = 0.0_wp
    work = 0.0_wp
    do stage = 1, self%n_stages
      call find_relative(self, n, spread(0.0_wp, 1, n), stress, back, theta, relative, norm)
      resistance = 3.0_wp*self%shear + sum(self%back%modulus)
      do k = 1, self%back%n
        call multiply(n, relative, back(:, :, k), level)
        resistance = resistance - self%back%recall(k)*level/norm
      end do
      call flow_after(self%curve, n, dt, eqps, factor, start, dgamma, flow, slope, bend, reach)
      if (stage == 1) first = max(norm - flow, 0.0_wp)
      if (all(first <= 0.0_wp)) return
      level = norm - first*(real(self%n_stages - stage, wp)/self%n_stages)
      if (stage == 1 .and. is_steep(self%curve)) then
        call solve_consistency(self%curve, n, dt, level, resistance, eqps, factor, guess, step, ok)
      else
        step = (level - flow)/(resistance + slope)
      end if
      where (first <= 0.0_wp) step = 0.0_wp
      dgamma = dgamma + step
      do k = 1, self%back%n
        theta(:, k) = 1.0_wp/(1.0_wp + self%back%recall(k)*step)
      end do
      call flow_along(self, n, step, norm, theta, relative, stress, back, level)
      if (self%curve%heating%is_active) work = work + level
    end do
    eqps = eqps + dgamma
  end subroutine return_in_stages

  !> Elastic trial in plane stress, then the return of the points that yield. The multi-stage scheme
  !! has no return of its own there.
  subroutine update_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    real(wp) :: modes(n, 3), turn(n, 3), worst
    integer :: k

    if (self%n_stages > 0) then
      call search_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
      return
    end if
    call plane_trial(n, self%bulk, self%shear, dstrain, stress, through, modes, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok .or. .not. (self%back%n > 0 .or. worst > self%lowest**2 .or. self%is_awake)) return
    ! Without spin the sums of a rotation may still change the last bit.
    if (.not. sum(abs(spin)) <= 0.0_wp) then
      turn = 0.0_wp
      turn(:, 1) = spin
      do k = 1, self%back%n
        call rotate_by_spin(n, turn, state(:, 6*k - 4:6*k + 1))
      end do
    end if
    call find_plane_strain(self, n, dt, dstrain, mode_moduli(self%bulk, self%shear), modes, &
                           state, ok)
    call flow_plane(self, n, modes, stress, state, through)
  end subroutine update_plane

  !> Plastic strain of a row in plane stress, with the plastic strain and the back stresses of the
  !! state.
  subroutine find_plane_strain(self, n, dt, dstrain, moduli, modes, state, ok)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(in) :: moduli(3)              !! of the modes
    real(wp), intent(inout) :: modes(n, 3)         !! of the trial stress, out of the plastic strain
    real(wp), intent(inout) :: state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp) :: guess(n), factor(n), dgamma(n), back(n, 3, self%back%n)

    guess = 0.0_wp
    if (has_rate(self%curve) .or. is_steep(self%curve)) &
      guess = equivalent_strain(n, in_space(n, dstrain))
    factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    call plane_back_stresses(n, self%back%n, state(:, 2:), back)
    call find_plane_flow(self%curve, self%back, moduli, n, dt, state(:, 1), factor, guess, modes, &
                         back, dgamma, ok)
    state(:, 1) = state(:, 1) + dgamma
    call add_plane_back_stresses(n, self%back%n, back, state(:, 2:))
  end subroutine find_plane_strain

  !> Let a row flow in plane stress by its plastic strain, and heat it.
  subroutine flow_plane(self, n, plastic, stress, state, through)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: plastic(n, 3)          !! see `flow_in_plane`
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)

    call flow_in_plane(n, self%bulk, self%shear, plastic, stress, through)
    if (self%curve%heating%is_active) &
      call heat_up(self%curve%heating, plane_work(n, stress, plastic), state(:, self%n_state))
  end subroutine flow_plane

  !> That of its back stresses.
  pure function shear_warning(self) result(warning)
    class(mises_plastic_t), intent(in) :: self
    character(:), allocatable :: warning

    warning = back_stress_warning(self%back)
  end function shear_warning

end module mises_plastic
