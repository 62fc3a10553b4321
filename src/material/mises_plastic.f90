!> Von Mises plasticity with any isotropic hardening and rate factor, a row of points at a time.
!!
!! Return: J. C. Simo and T. J. R. Hughes, Computational Inelasticity, Springer 1998, box 3.2, by
!! backward Euler, or by the multi-stage scheme. `voce` is the faster law for its one case.
module mises_plastic
  use kinds, only: wp
  use block_law, only: block_law_t, set_elastic
  use flow_curve, only: flow_curve_t, thermal_factor, heat_up
  use consistency, only: solve_consistency, solve_in_stages
  use voce, only: elastic_trial
  implicit none
  private

  public :: new_mises_plastic

  !> The state is the equivalent plastic strain and, with heating, the temperature rise.
  type, extends(block_law_t), public :: mises_plastic_t
    type(flow_curve_t) :: curve
    integer :: n_stages = 0   !! of the multi-stage return, 0: backward Euler
  contains
    procedure :: update
  end type mises_plastic_t

contains

  !> Law from density, elastic constants, flow curve and the stages of its return.
  pure function new_mises_plastic(density, young, poisson, curve, n_stages) result(law)
    real(wp), intent(in) :: density, young, poisson
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n_stages   !! 0: backward Euler
    type(mises_plastic_t) :: law

    law%n_state = 1
    if (curve%heating%is_active) law%n_state = 2
    law%eqps_state = 1
    call set_elastic(law, density, young, poisson)
    law%curve = curve
    law%n_stages = n_stages
  end function new_mises_plastic

  !> Elastic trial and radial return.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(mises_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp) :: mises(n), stiffness(n), factor(n), dgamma(n), flow(n), worst
    integer :: l

    call elastic_trial(n, self%bulk, self%shear, dstrain, stress, mises, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok) return
    stiffness = 3.0_wp*self%shear
    factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    if (self%n_stages > 0) then
      call solve_in_stages(self%curve, self%n_stages, n, dt, mises, stiffness, state(:, 1), &
                           factor, dgamma, flow)
    else
      call solve_consistency(self%curve, n, dt, mises, stiffness, state(:, 1), factor, dgamma, &
                             flow, ok)
    end if
    call shrink_deviator(n, 1.0_wp - stiffness*dgamma/max(mises, tiny(worst)), stress)
    state(:, 1) = state(:, 1) + dgamma
    if (.not. self%curve%heating%is_active) return
    do l = 1, n
      call heat_up(self%curve%heating, flow(l)*dgamma(l), state(l, self%n_state))
    end do
  end subroutine update

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

end module mises_plastic
