!> Von Mises plasticity with isotropic hardening and several back stresses.
!!
!! Back stresses: P. J. Armstrong and C. O. Frederick, CEGB report RD/B/N 731 (1966), several of
!! them as J. L. Chaboche, Int. J. Plasticity 2 (1986): each grows by
!! C n dgamma - gamma alpha dgamma, n = (s - alpha)/|s - alpha| with von Mises' norm, so that
!! C and gamma are those of a tension curve. Backward Euler leaves one scalar equation
!! (M. Kobayashi and N. Ohno, IJNME 53 (2002), for rules of this kind).
module combined_hardening
  use kinds, only: wp
  use errors, only: error_t, fail
  use block_law, only: block_law_t
  use flow_curve, only: flow_curve_t, flow_after
  use heating, only: thermal_factor, heat_up
  use tensor_rotation, only: spin_rotation, rotate_tensors
  use voce, only: elastic_trial
  implicit none
  private

  public :: new_combined_hardening, check_back_stresses

  !> The state is the equivalent plastic strain and then the six components of each back stress,
  !! deviators with their shear as it is; with heating, the temperature rise comes last.
  type, extends(block_law_t), public :: combined_hardening_t
    type(flow_curve_t) :: curve
    integer :: n_back = 0
    real(wp), allocatable :: modulus(:)   !! C, slope at the start [stress], shape (n_back)
    real(wp), allocatable :: recall(:)    !! gamma, C/gamma is where it ends, shape (n_back)
  contains
    procedure :: update
  end type combined_hardening_t

  !> The points of a row that yield, one behind the other.
  type :: yielding_t
    integer :: n = 0
    real(wp), allocatable :: deviator(:, :), back(:, :, :), eqps(:), factor(:), dgamma(:)
    real(wp), allocatable :: direction(:, :)   !! n of the flow, of unit von Mises norm
  end type yielding_t

contains

  !> Law from density, elastic constants, flow curve and pairs C, gamma.
  pure function new_combined_hardening(density, young, poisson, curve, pairs) result(law)
    real(wp), intent(in) :: density, young, poisson, pairs(:)
    type(flow_curve_t), intent(in) :: curve
    type(combined_hardening_t) :: law

    law%n_back = size(pairs)/2
    law%n_state = 1 + 6*law%n_back
    if (curve%heating%is_active) law%n_state = law%n_state + 1
    law%eqps_state = 1
    law%density = density
    law%bulk = young/(3.0_wp*(1.0_wp - 2.0_wp*poisson))
    law%shear = young/(2.0_wp*(1.0_wp + poisson))
    law%curve = curve
    law%modulus = pairs(1::2)
    law%recall = pairs(2::2)
  end function new_combined_hardening

  !> Pairs of C > 0 and gamma >= 0.
  pure subroutine check_back_stresses(pairs, error)
    real(wp), intent(in) :: pairs(:)
    type(error_t), allocatable, intent(out) :: error

    if (size(pairs) == 0 .or. mod(size(pairs), 2) /= 0) then
      call fail(error, "material: back stresses take pairs of C and gamma")
    else if (.not. all(abs(pairs) <= huge(1.0_wp))) then
      call fail(error, "material: the constants of back stresses must be finite numbers")
    else if (any(pairs(1::2) <= 0.0_wp)) then
      call fail(error, "material: the modulus C of a back stress must be positive")
    else if (any(pairs(2::2) < 0.0_wp)) then
      call fail(error, "material: the recall gamma of a back stress must not be negative")
    end if
  end subroutine check_back_stresses

  !> Elastic trial, then the return of the points that yield.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(combined_hardening_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    type(yielding_t) :: points
    integer, allocatable :: places(:)
    real(wp) :: norm(n), flow(n), slope(n), relative(n, 6), factor(n), worst
    integer :: l, k

    call elastic_trial(n, self%bulk, self%shear, dstrain, stress, norm, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok) return
    if (present(spin)) then
      call turn_back_stresses(n, self%n_back, spin, state(:, 2:6*self%n_back + 1))
    end if
    relative = stress
    do k = 1, self%n_back
      relative = relative - state(:, 6*k - 4:6*k + 1)
    end do
    norm = mises_norm(n, relative)
    factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    call flow_after(self%curve, n, dt, state(:, 1), factor, spread(0.0_wp, 1, n), flow, slope)
    places = pack([(l, l=1, n)], norm > flow)
    if (size(places) == 0) return
    call gather(self%n_back, stress(places, :), state(places, :), factor(places), points)
    call return_points(self, dt, points, ok)
    stress(places, :) = stress(places, :) - 3.0_wp*self%shear*spread(points%dgamma, 2, 6) &
                        *points%direction
    state(places, 1) = state(places, 1) + points%dgamma
    do k = 1, self%n_back
      state(places, 6*k - 4:6*k + 1) = points%back(:, :, k)
    end do
    if (self%curve%heating%is_active) call heat_points(self, n, places, points, stress, state)
  end subroutine update

  !> Heat by the work of the stress on the plastic strain 3/2 n dgamma.
  pure subroutine heat_points(self, n, places, points, stress, state)
    class(combined_hardening_t), intent(in) :: self
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

  !> Rotate all back stresses as the stress was.
  pure subroutine turn_back_stresses(n, n_back, spin, back)
    integer, intent(in) :: n, n_back
    real(wp), intent(in) :: spin(n, 3)
    real(wp), intent(inout) :: back(n, 6*n_back)
    real(wp) :: rotation(n, 9)
    integer :: k

    call spin_rotation(n, spin, rotation)
    do k = 1, n_back
      call rotate_tensors(n, rotation, back(:, 6*k - 5:6*k))
    end do
  end subroutine turn_back_stresses

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
    class(combined_hardening_t), intent(in) :: self
    real(wp), intent(in) :: dt
    type(yielding_t), intent(inout) :: points
    logical, intent(out) :: ok
    integer, parameter :: max_iterations = 400, most_newton = 30
    real(wp), parameter :: tolerance = 1.0e-13_wp
    real(wp), dimension(points%n) :: low, high, flow, slope, norm, fall, residual, first
    real(wp) :: candidate
    integer :: l, k, iteration

    first = mises_norm(points%n, points%deviator)
    do k = 1, self%n_back
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
    do k = 1, self%n_back
      points%back(:, :, k) = (points%back(:, :, k) + self%modulus(k) &
                              *spread(points%dgamma, 2, 6)*points%direction) &
                             /spread(1.0_wp + self%recall(k)*points%dgamma, 2, 6)
    end do
  end subroutine return_points

  !> Norm of the stress less the back stresses after `dgamma`, its direction, and by how much
  !! the norm falls with `dgamma`.
  pure subroutine relative_stress(self, points, norm, fall)
    class(combined_hardening_t), intent(in) :: self
    type(yielding_t), intent(inout) :: points
    real(wp), intent(out) :: norm(points%n), fall(points%n)
    real(wp) :: xi(6), change(6), theta, length
    integer :: l, k

    do l = 1, points%n
      xi = points%deviator(l, :)
      change = 0.0_wp
      norm(l) = -3.0_wp*self%shear*points%dgamma(l)
      fall(l) = 3.0_wp*self%shear
      do k = 1, self%n_back
        theta = 1.0_wp/(1.0_wp + self%recall(k)*points%dgamma(l))
        xi = xi - theta*points%back(l, :, k)
        change = change + self%recall(k)*theta**2*points%back(l, :, k)
        norm(l) = norm(l) - theta*self%modulus(k)*points%dgamma(l)
        fall(l) = fall(l) + theta**2*self%modulus(k)
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

end module combined_hardening
