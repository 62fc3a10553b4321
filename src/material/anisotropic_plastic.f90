!> Plasticity with an anisotropic yield function whose axes travel with the material.
module anisotropic_plastic
  use kinds, only: wp
  use block_law, only: set_elastic
  use flow_curve, only: flow_curve_t, flow_at, is_steep, thermal_factor, heat_up
  use hardening, only: back_stresses_t
  use mises_plastic, only: mises_plastic_t, set_plastic
  use yield_function, only: yield_function_t, evaluate_yield, mises_bound, quadratic
  use return_mapping, only: return_to_hill, return_problem_t, return_to_yield, return_in_stages
  use tensor_rotation, only: rotate_axes, axes_rotation, rotate_tensors, transposed
  use voce, only: elastic_trial
  implicit none
  private

  public :: new_anisotropic_plastic

  !> Flow curve, back stresses and stages are those of the law of von Mises. The state is the
  !! equivalent plastic strain, the rotation of the axes since the start in four numbers (see
  !! `tensor_rotation`), six components of each back stress in the axes of the material, tensor
  !! shear, and with heating the temperature rise. The equivalent plastic strain is that of work:
  !! relative stress times plastic strain over the flow stress.
  type, extends(mises_plastic_t), public :: anisotropic_plastic_t
    type(yield_function_t) :: yield
    real(wp) :: axes(3, 3) = 0.0_wp   !! of the material at the start, as columns
    real(wp) :: bound = 0.0_wp        !! equivalent over von Mises stress never exceeds it
  contains
    procedure :: update
    procedure :: keeps_plane
  end type anisotropic_plastic_t

contains

  !> Law from density, elastic constants, flow curve, yield function, back stresses, axes at the
  !! start and stages.
  pure function new_anisotropic_plastic(density, young, poisson, curve, yield, back, axes, &
                                        n_stages) result(law)
    real(wp), intent(in) :: density, young, poisson
    type(flow_curve_t), intent(in) :: curve
    type(yield_function_t), intent(in) :: yield
    type(back_stresses_t), intent(in) :: back
    real(wp), intent(in) :: axes(3, 3)
    integer, intent(in) :: n_stages   !! 0: backward Euler
    type(anisotropic_plastic_t) :: law

    call set_elastic(law, density, young, poisson)
    call set_plastic(law, curve, back, n_stages, 5)
    law%yield = yield
    law%axes = axes
    law%bound = mises_bound(yield)
  end function new_anisotropic_plastic

  !> It does where an axis of the material lies across the plane.
  pure logical function keeps_plane(self, component)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: component

    keeps_plane = any(abs(self%axes(component, :)) > 1.0_wp - 1.0e-15_wp)
  end function keeps_plane

  !> Elastic trial, then the return of the points that may yield, in the axes of the material.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp) :: mises(n), flow(n), slope(n), bend(n), reach(n), factor(n), worst
    integer, allocatable :: places(:)
    integer :: l, k

    call elastic_trial(n, self%bulk, self%shear, dstrain, stress, mises, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok) return
    if (present(spin)) call rotate_axes(n, spin, state(:, 2:5))
    factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    call flow_at(self%curve, n, state(:, 1), factor, flow, slope, bend, reach)
    do k = 1, self%back%n
      mises = mises + sqrt(1.5_wp*(sum(state(:, 6*k:6*k + 2)**2, 2) &
                                   + 2.0_wp*sum(state(:, 6*k + 3:6*k + 5)**2, 2)))
    end do
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
    real(wp), dimension(size(places), 6) :: trial, local
    real(wp) :: rotation(size(places), 9), mean(size(places)), dgamma(size(places))
    logical :: is_done(size(places))
    integer :: l, k

    ! Deviators only: next to a high pressure their digits would be lost.
    mean = sum(stress(places, :3), 2)/3.0_wp
    trial = stress(places, :)
    do k = 1, 3
      trial(:, k) = trial(:, k) - mean
    end do
    call axes_rotation(size(places), self%axes, state(places, 2:5), rotation)
    call rotate_tensors(size(places), rotation, trial)
    local = trial
    dgamma = 0.0_wp
    ok = .true.
    if (self%yield%kind == quadratic .and. self%back%n == 0 .and. self%n_stages == 0 &
        .and. .not. is_steep(self%curve)) then
      call return_to_hill(self%curve, self%yield, self%shear, dt, size(places), state(places, 1), &
                          factor(places), local, dgamma, is_done)
    else
      is_done = .false.
    end if
    if (.not. all(is_done)) then
      call return_singly(self, dt, pack(places, .not. is_done), &
                         pack([(l, l=1, size(places))], .not. is_done), flow, factor, state, &
                         local, dgamma, ok)
    end if
    state(places, 1) = state(places, 1) + dgamma
    if (self%curve%heating%is_active) then
      trial = (trial - local)/(2.0_wp*self%shear)
      trial(:, 4:) = 2.0_wp*trial(:, 4:)
      do l = 1, size(places)
        call heat_up(self%curve%heating, dot_product(trial(l, :), local(l, :)), &
                     state(places(l), self%n_state))
      end do
    end if
    call rotate_tensors(size(places), transposed(size(places), rotation), local)
    do l = 1, size(places)
      if (.not. dgamma(l) > 0.0_wp) cycle
      stress(places(l), :3) = local(l, :3) + mean(l)
      stress(places(l), 4:) = local(l, 4:)
    end do
  end subroutine return_points

  !> Return of points one by one. Those inside the yield surface are left alone.
  subroutine return_singly(self, dt, places, numbers, flow, factor, state, local, dgamma, ok)
    class(anisotropic_plastic_t), intent(in) :: self
    real(wp), intent(in) :: dt, flow(:), factor(:)
    integer, intent(in) :: places(:), numbers(:)   !! in the row, in `local`
    real(wp), intent(inout) :: state(:, :), local(:, :), dgamma(:)
    logical, intent(inout) :: ok
    type(return_problem_t) :: problem
    real(wp) :: new(6), relative(6), q
    logical :: is_good
    integer :: i

    problem%bulk = self%bulk
    problem%shear = self%shear
    problem%dt = dt
    problem%kinematic = self%back
    do i = 1, size(places)
      associate (p => places(i), l => numbers(i))
        problem%back = reshape(state(p, 6:5 + 6*self%back%n), [6, self%back%n])
        relative = local(l, :) - sum(problem%back, 2)
        call evaluate_yield(self%yield, relative, q)
        if (.not. q > flow(p)) cycle
        problem%eqps = state(p, 1)
        problem%trial = local(l, :)
        problem%factor = factor(p)
        if (self%n_stages > 0) then
          call return_in_stages(self%curve, self%yield, problem, self%n_stages, new, dgamma(l))
        else
          call return_to_yield(self%curve, self%yield, problem, new, dgamma(l), is_good)
          ok = ok .and. is_good
        end if
        local(l, :) = new
        state(p, 6:5 + 6*self%back%n) = reshape(problem%back, [6*self%back%n])
      end associate
    end do
  end subroutine return_singly

end module anisotropic_plastic
