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
  use block_law, only: block_law_t, set_elastic
  use flow_curve, only: flow_curve_t, flow_after, is_steep, thermal_factor, heat_up
  use hardening, only: back_stresses_t, back_stress_warning
  use return_mapping, only: solve_consistency, solve_in_stages
  use tensor_rotation, only: rotate_by_spin
  use voce, only: elastic_trial
  implicit none
  private

  public :: new_mises_plastic, set_plastic

  !> The state is the equivalent plastic strain and then the six components of each back stress,
  !! deviators with tensor shear; with heating, the temperature rise comes last.
  type, extends(block_law_t), public :: mises_plastic_t
    type(flow_curve_t) :: curve
    type(back_stresses_t) :: back
    integer :: n_stages = 0   !! of the multi-stage return, 0: backward Euler
  contains
    procedure :: update
    procedure :: shear_warning
  end type mises_plastic_t

  !> The points of a row that yield, one after the other.
  type :: yielding_t
    integer :: n = 0
    real(wp), allocatable :: deviator(:, :), back(:, :, :), eqps(:), factor(:), dgamma(:)
    real(wp), allocatable :: direction(:, :)   !! n of the flow, of unit von Mises norm
  end type yielding_t

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
    real(wp) :: mises(n), factor(n), worst
    integer :: k

    call elastic_trial(n, self%bulk, self%shear, dstrain, stress, mises, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok) return
    factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    if (self%back%n == 0) then
      call return_radially(self, n, dt, mises, factor, stress, state, ok)
      return
    end if
    if (present(spin)) then
      do k = 1, self%back%n
        call rotate_by_spin(n, spin, state(:, 6*k - 4:6*k + 1))
      end do
    end if
    call return_with_back_stresses(self, n, dt, factor, stress, state, ok)
  end subroutine update

  !> Radial return of a row without back stresses.
  subroutine return_radially(self, n, dt, mises, factor, stress, state, ok)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, mises(n), factor(n)   !! of the trial stress; on the flow stress
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(inout) :: ok
    real(wp) :: stiffness(n), dgamma(n), flow(n)
    integer :: l

    stiffness = 3.0_wp*self%shear
    if (self%n_stages > 0) then
      call solve_in_stages(self%curve, self%n_stages, n, dt, mises, stiffness, state(:, 1), &
                           factor, dgamma, flow)
    else
      call solve_consistency(self%curve, n, dt, mises, stiffness, state(:, 1), factor, dgamma, &
                             flow, ok)
    end if
    call shrink_deviator(n, 1.0_wp - stiffness*dgamma/max(mises, tiny(dt)), stress)
    state(:, 1) = state(:, 1) + dgamma
    if (.not. self%curve%heating%is_active) return
    do l = 1, n
      call heat_up(self%curve%heating, flow(l)*dgamma(l), state(l, self%n_state))
    end do
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

  !> Return of the points of a row that yield, with back stresses.
  subroutine return_with_back_stresses(self, n, dt, factor, stress, state, ok)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, factor(n)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(inout) :: ok
    type(yielding_t) :: points
    integer, allocatable :: places(:)
    real(wp) :: norm(n), flow(n), slope(n), relative(n, 6)
    integer :: l, k

    relative = stress
    do k = 1, self%back%n
      relative = relative - state(:, 6*k - 4:6*k + 1)
    end do
    norm = mises_norm(n, relative)
    call flow_after(self%curve, n, dt, state(:, 1), factor, spread(0.0_wp, 1, n), flow, slope)
    places = pack([(l, l=1, n)], norm > flow)
    if (size(places) == 0) return
    call gather(self%back%n, stress(places, :), state(places, :), factor(places), points)
    if (self%n_stages > 0) then
      call return_in_stages(self, dt, points)
    else
      call return_points(self, dt, points, ok)
    end if
    stress(places, :) = stress(places, :) - 3.0_wp*self%shear*spread(points%dgamma, 2, 6) &
                        *points%direction
    state(places, 1) = state(places, 1) + points%dgamma
    do k = 1, self%back%n
      state(places, 6*k - 4:6*k + 1) = points%back(:, :, k)
    end do
    if (self%curve%heating%is_active) call heat_points(self, n, places, points, stress, state)
  end subroutine return_with_back_stresses

  !> Heat by the work of the stress on the plastic strain 3/2 n dgamma.
  pure subroutine heat_points(self, n, places, points, stress, state)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n, places(:)
    type(yielding_t), intent(in) :: points
    real(wp), intent(in) :: stress(n, 6)
    real(wp), intent(inout) :: state(n, self%n_state)
    real(wp) :: work
    integer :: l

    do l = 1, size(places)
      associate (s => stress(places(l), :), unit => points%direction(l, :))
        work = 1.5_wp*points%dgamma(l)*(sum(s(:3)*unit(:3)) + 2.0_wp*sum(s(4:)*unit(4:)))
      end associate
      call heat_up(self%curve%heating, work, state(places(l), self%n_state))
    end do
  end subroutine heat_points

  !> Collect what the return of some points needs.
  pure subroutine gather(n_back, stress, state, factor, points)
    integer, intent(in) :: n_back
    real(wp), intent(in) :: stress(:, :), state(:, :), factor(:)
    type(yielding_t), intent(out) :: points
    integer :: k

    points%n = size(stress, 1)
    points%eqps = state(:, 1)
    points%factor = factor
    points%deviator = stress
    points%deviator(:, :3) = stress(:, :3) - spread(sum(stress(:, :3), 2)/3.0_wp, 2, 3)
    allocate (points%back(points%n, 6, n_back))
    do k = 1, n_back
      points%back(:, :, k) = state(:, 6*k - 4:6*k + 1)
    end do
    allocate (points%dgamma(points%n), source=0.0_wp)
    allocate (points%direction(points%n, 6), source=0.0_wp)
  end subroutine gather

  !> Newton in a bracket for |s - sum theta alpha| - (3G + sum theta C) dgamma = flow(dgamma),
  !! theta = 1/(1 + gamma dgamma), which has one root: back stresses stay below C/gamma, so
  !! the left side falls by 3G at least.
  subroutine return_points(self, dt, points, ok)
    class(mises_plastic_t), intent(in) :: self
    real(wp), intent(in) :: dt
    type(yielding_t), intent(inout) :: points
    logical, intent(out) :: ok
    integer, parameter :: max_iterations = 400, most_newton = 30
    real(wp), parameter :: tolerance = 1.0e-13_wp
    real(wp), dimension(points%n) :: low, high, flow, slope, norm, fall, residual, first
    real(wp) :: candidate
    integer :: l, k, iteration

    first = mises_norm(points%n, points%deviator)
    do k = 1, self%back%n
      first = first + mises_norm(points%n, points%back(:, :, k))
    end do
    low = 0.0_wp
    high = first/(3.0_wp*self%shear)
    ok = .false.
    do iteration = 1, max_iterations
      call relative_stress(self, points, norm, fall)
      call flow_after(self%curve, points%n, dt, points%eqps, points%factor, points%dgamma, flow, &
                      slope)
      residual = norm - flow
      ok = all(abs(residual) <= tolerance*first .or. high - low <= 2.0_wp*epsilon(1.0_wp)*high)
      if (ok) exit
      do l = 1, points%n
        if (residual(l) > 0.0_wp) low(l) = points%dgamma(l)
        if (residual(l) < 0.0_wp) high(l) = min(points%dgamma(l), high(l))
        candidate = min(points%dgamma(l) + residual(l)/(fall(l) + slope(l)), high(l))
        if (candidate <= low(l) .or. iteration > most_newton) candidate = 0.5_wp*(low(l) + high(l))
        if (abs(residual(l)) > tolerance*first(l)) points%dgamma(l) = candidate
      end do
    end do
    do k = 1, self%back%n
      points%back(:, :, k) = (points%back(:, :, k) + self%back%modulus(k) &
                              *spread(points%dgamma, 2, 6)*points%direction) &
                             /spread(1.0_wp + self%back%recall(k)*points%dgamma, 2, 6)
    end do
  end subroutine return_points

  !> The multi-stage scheme as in `return_mapping`. The direction returned is the mean of the
  !! stages.
  subroutine return_in_stages(self, dt, points)
    class(mises_plastic_t), intent(in) :: self
    real(wp), intent(in) :: dt
    type(yielding_t), intent(inout) :: points
    real(wp), dimension(points%n) :: first, flow, slope, norm, resistance, step
    real(wp), dimension(points%n, 6) :: flown, unit
    integer :: k, stage
    logical :: ok

    flown = 0.0_wp
    first = 0.0_wp
    do stage = 1, self%n_stages
      unit = points%deviator - 3.0_wp*self%shear*flown - sum(points%back, 3)
      norm = mises_norm(points%n, unit)
      unit = unit/spread(max(norm, tiny(dt)), 2, 6)
      resistance = 3.0_wp*self%shear + sum(self%back%modulus)
      do k = 1, self%back%n
        resistance = resistance - 1.5_wp*self%back%recall(k) &
                     *(sum(unit(:, :3)*points%back(:, :3, k), 2) &
                       + 2.0_wp*sum(unit(:, 4:)*points%back(:, 4:, k), 2))
      end do
      call flow_after(self%curve, points%n, dt, points%eqps, points%factor, points%dgamma, flow, &
                      slope)
      if (stage == 1) first = norm - flow
      norm = norm - first*real(self%n_stages - stage, wp)/self%n_stages
      if (stage == 1 .and. is_steep(self%curve)) then
        call solve_consistency(self%curve, points%n, dt, norm, resistance, points%eqps, &
                               points%factor, step, flow, ok)
      else
        step = (norm - flow)/(resistance + slope)
      end if
      points%dgamma = points%dgamma + step
      unit = spread(step, 2, 6)*unit
      flown = flown + unit
      do k = 1, self%back%n
        points%back(:, :, k) = (points%back(:, :, k) + self%back%modulus(k)*unit) &
                               /spread(1.0_wp + self%back%recall(k)*step, 2, 6)
      end do
    end do
    points%direction = flown/spread(points%dgamma, 2, 6)
  end subroutine return_in_stages

  !> Norm of the stress less the back stresses after `dgamma`, its direction, and by how much
  !! the norm falls with `dgamma`.
  pure subroutine relative_stress(self, points, norm, fall)
    class(mises_plastic_t), intent(in) :: self
    type(yielding_t), intent(inout) :: points
    real(wp), intent(out) :: norm(points%n), fall(points%n)
    real(wp) :: xi(6), change(6), theta, length
    integer :: l, k

    do l = 1, points%n
      xi = points%deviator(l, :)
      change = 0.0_wp
      norm(l) = -3.0_wp*self%shear*points%dgamma(l)
      fall(l) = 3.0_wp*self%shear
      do k = 1, self%back%n
        theta = 1.0_wp/(1.0_wp + self%back%recall(k)*points%dgamma(l))
        xi = xi - theta*points%back(l, :, k)
        change = change + self%back%recall(k)*theta**2*points%back(l, :, k)
        norm(l) = norm(l) - theta*self%back%modulus(k)*points%dgamma(l)
        fall(l) = fall(l) + theta**2*self%back%modulus(k)
      end do
      length = sqrt(1.5_wp*(sum(xi(:3)**2) + 2.0_wp*sum(xi(4:)**2)))
      points%direction(l, :) = xi/max(length, tiny(length))
      norm(l) = norm(l) + length
      associate (unit => points%direction(l, :))
        fall(l) = fall(l) - 1.5_wp*(sum(unit(:3)*change(:3)) + 2.0_wp*sum(unit(4:)*change(4:)))
      end associate
    end do
  end subroutine relative_stress

  !> Von Mises stress of each point.
  pure function mises_norm(n, stress) result(norm)
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(n, 6)
    real(wp) :: norm(n)

    norm = sqrt(0.5_wp*((stress(:, 1) - stress(:, 2))**2 + (stress(:, 2) - stress(:, 3))**2 &
                        + (stress(:, 3) - stress(:, 1))**2) &
                + 3.0_wp*(stress(:, 4)**2 + stress(:, 5)**2 + stress(:, 6)**2))
  end function mises_norm

  !> That of its back stresses.
  pure function shear_warning(self) result(warning)
    class(mises_plastic_t), intent(in) :: self
    character(:), allocatable :: warning

    warning = back_stress_warning(self%back)
  end function shear_warning

end module mises_plastic
