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
  use back_stress_rows, only: multiply, find_products, relative_stress, flow_relative
  use tensor_rotation, only: rotate_all_by_spin
  use voce, only: elastic_trial, flow_radially
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

    call elastic_trial(n, self%bulk, self%shear, dstrain, stress, mises, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok .or. .not. (self%back%n > 0 .or. worst > self%lowest .or. self%is_awake)) return
    if (has_rate(self%curve)) then
      guess = equivalent_strain(n, dstrain)
    else
      guess = 0.0_wp
    end if
    if (self%back%n == 0) then
      call return_radially(self, n, dt, mises, guess, stress, state, ok)
      return
    end if
    if (present(spin)) call rotate_all_by_spin(n, self%back%n, spin, state(:, 2:6*self%back%n + 1))
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
    real(wp), dimension(n) :: stiffness, dgamma, factor

    stiffness = 3.0_wp*self%shear
    factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    if (self%n_stages > 0) then
      call solve_in_stages(self%curve, self%n_stages, n, dt, mises, stiffness, state(:, 1), &
                           factor, guess, dgamma)
    else
      call solve_consistency(self%curve, n, dt, mises, stiffness, state(:, 1), factor, guess, &
                             dgamma, ok)
    end if
    call flow_radially(n, 3.0_wp*self%shear, mises, dgamma, stress, state(:, 1))
    if (self%curve%heating%is_active) &
      call heat_up(self%curve%heating, (mises - stiffness*dgamma)*dgamma, &
                   state(:, self%n_state))
  end subroutine return_radially

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
    real(wp) :: products(n, 0:self%back%n, 0:self%back%n), shear3
    integer :: k, iteration

    shear3 = 3.0_wp*self%shear
    products(:, 0, 0) = mises**2
    call find_products(n, self%back%n, stress, back, products)
    dgamma = 0.0_wp
    work = 0.0_wp
    call relative_stress(n, shear3, self%back, products, dgamma, norm, fall, curvature)
    call flow_at(self%curve, n, eqps, factor, start, slope, bend, reach)
    flow = start
    ok = all(norm <= flow)
    if (ok) return
    ! Back stresses that fade add at most the sum of their norms.
    first = products(:, 1, 1)
    do k = 2, self%back%n
      first = first + products(:, k, k)
    end do
    first = norm + sqrt(self%back%n*first)
    low = 0.0_wp
    last = 0.0_wp
    high = merge((first - flow)/shear3, 0.0_wp, norm > flow)
    call begin_at(self%curve, n, slope, fall, high, guess, dgamma)
    do iteration = 1, max_iterations
      if (iteration > 1 .or. any(dgamma > 0.0_wp)) then
        call relative_stress(n, shear3, self%back, products, dgamma, norm, fall, curvature)
        call flow_after(self%curve, n, dt, eqps, factor, start, dgamma, flow, slope, bend, reach)
      end if
      norm = norm - flow
      fall = fall + slope
      bend = curvature + bend
      call advance(self%curve, n, iteration, first, norm, fall, bend, reach, low, high, last, &
                   dgamma, ok)
      if (ok) exit
    end do
    call flow_relative(n, shear3, self%back, dgamma, stress, back, norm)
    eqps = eqps + dgamma
    if (.not. self%curve%heating%is_active) return
    work = products(:, 0, 0)
    do k = 1, self%back%n
      work = work - products(:, 0, k)/(1.0_wp + self%back%recall(k)*dgamma)
    end do
    work = (work/norm - shear3*dgamma)*dgamma
  end subroutine return_points

  !> The relative stress: deviator less the back stresses, and its von Mises norm.
  pure subroutine find_relative(n, n_back, stress, back, relative, norm)
    integer, intent(in) :: n, n_back
    real(wp), intent(in) :: stress(n, 6), back(n, 6, n_back)
    real(wp), intent(out) :: relative(n, 6), norm(n)
    real(wp) :: mean(n)
    integer :: c

    mean = (stress(:, 1) + stress(:, 2) + stress(:, 3))*(1.0_wp/3.0_wp)
    do c = 1, 6
      relative(:, c) = stress(:, c) - sum(back(:, c, :), 2)
      if (c <= 3) relative(:, c) = relative(:, c) - mean
    end do
    call multiply(n, relative, relative, norm)
    norm = sqrt(max(norm, tiny(norm)))
  end subroutine find_relative

  !> The multi-stage scheme, see `consistency`. The direction of the flow changes with the stages.
  subroutine return_in_stages(self, n, dt, factor, guess, stress, eqps, back, work)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, factor(n), guess(n)
    real(wp), intent(inout) :: stress(n, 6), eqps(n), back(n, 6, self%back%n)
    real(wp), intent(out) :: work(n)          !! of the stress on the plastic strain
    real(wp), dimension(n) :: start, first, flow, slope, bend, reach, norm, level, resistance
    real(wp), dimension(n) :: step, dgamma
    real(wp) :: relative(n, 6)
    integer :: c, k, stage
    logical :: ok

    call flow_at(self%curve, n, eqps, factor, start, slope, bend, reach)
    dgamma = 0.0_wp
    step = 0.0_wp
    first = 0.0_wp
    work = 0.0_wp
    do stage = 1, self%n_stages
      call find_relative(n, self%back%n, stress, back, relative, norm)
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
      step = step/norm
      do c = 1, 6
        stress(:, c) = stress(:, c) - 3.0_wp*self%shear*step*relative(:, c)
        do k = 1, self%back%n
          back(:, c, k) = (back(:, c, k) + self%back%modulus(k)*step*relative(:, c)) &
                          /(1.0_wp + self%back%recall(k)*step*norm)
        end do
      end do
      call multiply(n, stress, relative, level)
      work = work + step*level
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
      call rotate_all_by_spin(n, self%back%n, turn, state(:, 2:6*self%back%n + 1))
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
    if (has_rate(self%curve)) guess = equivalent_strain(n, in_space(n, dstrain))
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
