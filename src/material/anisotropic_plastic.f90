!> Plasticity with an anisotropic yield function whose axes travel with the material.
module anisotropic_plastic
  use kinds, only: wp
  use block_law, only: block_law_t
  use flow_curve, only: flow_curve_t, flow_after
  use heating, only: thermal_factor, heat_up
  use yield_function, only: yield_function_t, evaluate_yield, mises_bound
  use yield_return, only: return_problem_t, return_to_yield, return_in_stages
  use material_axes, only: turn_axes, axes_rotation
  use tensor_rotation, only: rotate_tensors, transposed
  use voce, only: elastic_trial
  implicit none
  private

  public :: new_anisotropic_plastic

  !> The state is the equivalent plastic strain and the rotation of the axes since the start,
  !! four numbers (see `material_axes`). The equivalent plastic strain is that of plastic work:
  !! stress times plastic strain over the flow stress. With heating, the temperature rise comes
  !! last.
  type, extends(block_law_t), public :: anisotropic_plastic_t
    type(flow_curve_t) :: curve
    type(yield_function_t) :: yield
    real(wp) :: axes(3, 3) = 0.0_wp   !! of the material at the start, as columns
    real(wp) :: bound = 0.0_wp        !! equivalent over von Mises stress never exceeds it
    integer :: n_stages = 0           !! of the multi-stage return, 0: backward Euler
  contains
    procedure :: update
  end type anisotropic_plastic_t

contains

  !> Law from density, elastic constants, flow curve, yield function, axes at the start and stages.
  pure function new_anisotropic_plastic(density, young, poisson, curve, yield, axes, n_stages) &
      result(law)
    real(wp), intent(in) :: density, young, poisson
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: axes(3, 3)
    integer, intent(in) :: n_stages   !! 0: backward Euler
    type(anisotropic_plastic_t) :: law

    law%n_state = 5
    if (curve%heating%is_active) law%n_state = 6
    law%eqps_state = 1
    law%density = density
    law%bulk = young/(3.0_wp*(1.0_wp - 2.0_wp*poisson))
    law%shear = young/(2.0_wp*(1.0_wp + poisson))
    law%curve = curve
    law%yield = yield
    law%axes = axes
    law%bound = mises_bound(yield)
    law%n_stages = n_stages
  end function new_anisotropic_plastic

  !> Elastic trial, then the return of the points that may yield, in the axes of the material.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp) :: mises(n), flow(n), slope(n), factor(n), worst
    integer, allocatable :: places(:)
    integer :: l

    call elastic_trial(n, self%bulk, self%shear, dstrain, stress, mises, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok) return
    if (present(spin)) call turn_axes(n, spin, state(:, 2:5))
    factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    call flow_after(self%curve, n, dt, state(:, 1), factor, spread(0.0_wp, 1, n), flow, slope)
    places = pack([(l, l=1, n)], self%bound*mises > flow)
    if (size(places) > 0) then
      call return_points(self, n, dt, places, flow, factor, stress, state, ok)
    end if
  end subroutine update

  !> Return of the points of a row at `places`.
  subroutine return_points(self, n, dt, places, flow, factor, stress, state, ok)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n, places(:)
    real(wp), intent(in) :: dt, flow(n), factor(n)      !! flow stress before the increment
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp) :: local(size(places), 6), rotation(size(places), 9), mean(size(places))
    real(wp) :: new(6), q, dgamma
    logical :: has_moved(size(places)), is_good
    type(return_problem_t) :: problem
    integer :: l

    ! Deviators only: beside a high pressure their digits would be lost.
    mean = sum(stress(places, :3), 2)/3.0_wp
    local = stress(places, :)
    local(:, :3) = local(:, :3) - spread(mean, 2, 3)
    call axes_rotation(size(places), self%axes, state(places, 2:5), rotation)
    call rotate_tensors(size(places), rotation, local)
    problem = return_problem_t(self%bulk, self%shear, dt)
    ok = .true.
    do l = 1, size(places)
      call evaluate_yield(self%yield, local(l, :), q)
      has_moved(l) = q > flow(places(l))
      if (.not. has_moved(l)) cycle
      problem%eqps = state(places(l), 1)
      problem%trial = local(l, :)
      problem%factor = factor(places(l))
      if (self%n_stages > 0) then
        call return_in_stages(self%curve, self%yield, problem, self%n_stages, new, dgamma)
      else
        call return_to_yield(self%curve, self%yield, problem, new, dgamma, is_good)
        ok = ok .and. is_good
      end if
      local(l, :) = new
      state(places(l), 1) = problem%eqps + dgamma
      if (self%curve%heating%is_active) then
        call evaluate_yield(self%yield, new, q)
        call heat_up(self%curve%heating, q*dgamma, state(places(l), self%n_state))
      end if
    end do
    call rotate_tensors(size(places), transposed(size(places), rotation), local)
    do l = 1, size(places)
      if (.not. has_moved(l)) cycle
      stress(places(l), :3) = local(l, :3) + mean(l)
      stress(places(l), 4:) = local(l, 4:)
    end do
  end subroutine return_points

end module anisotropic_plastic
