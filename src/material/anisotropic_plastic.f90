!> Plasticity with an anisotropic yield function whose axes travel with the material.
module anisotropic_plastic
  use kinds, only: wp
  use block_law, only: set_elastic, search_plane
  use flow_curve, only: flow_curve_t, flow_at, has_rate, is_steep, thermal_factor, heat_up
  use hardening, only: back_stresses_t
  use mises_plastic, only: mises_plastic_t, set_plastic, equivalent_strain
  use deviator_lanes, only: lanes, load_lanes, store_lanes, into_axes, add_from_axes, &
                            deviator_of, add_deviator
  use yield_function, only: yield_function_t, mises_bound, quadratic
  use hill_return, only: return_to_hill
  use hill_plane, only: plane_hill_t, new_plane_hill, into_hill_modes, from_hill_modes
  use plane_stress, only: plane_trial
  use return_problem, only: return_problem_t
  use yield_return, only: return_to_yield, return_in_stages
  use tensor_rotation, only: rotate_axes, axes_rotation, axes_in_sheet, turn_in_plane
  use row_functions, only: are_numbers
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
    logical :: is_turned = .false.    !! those are not the axes of space
    real(wp) :: bound = 0.0_wp        !! equivalent over von Mises stress never exceeds it
    logical :: is_hill = .false.      !! Hill's function without back stresses and stages
    type(plane_hill_t) :: plane       !! then: in plane stress
  contains
    procedure :: update
    procedure :: update_plane
    procedure :: lay_in_sheet
    procedure :: keeps_plane
  end type anisotropic_plastic_t

  real(wp), parameter :: identity(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                                   0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

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
    law%is_turned = any(abs(axes - identity) > 0.0_wp)
    law%bound = mises_bound(yield)
    law%is_hill = yield%kind == quadratic .and. back%n == 0 .and. n_stages == 0
    if (law%is_hill) law%plane = new_plane_hill(yield%hill, law%bulk, law%shear)
  end function new_anisotropic_plastic

  !> It does where an axis of the material lies across the plane.
  pure logical function keeps_plane(self, component)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: component

    keeps_plane = any(abs(self%axes(component, :)) > 1.0_wp - 1.0e-15_wp)
  end function keeps_plane

  !> Elastic trial, then the return of the points that may yield, `lanes` of them at a time.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp), dimension(n) :: mises, flow, slope, bend, reach, factor
    real(wp) :: worst
    logical :: is_good
    integer :: first, last

    call elastic_trial(n, self%bulk, self%shear, dstrain, stress, mises, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok) return
    if (present(spin)) call rotate_axes(n, spin, state(:, 2:5))
    factor = 1.0_wp
    if (self%curve%heating%is_active) &
      factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    call flow_at(self%curve, n, state(:, 1), factor, flow, slope, bend, reach)
    ok = are_numbers(n, flow)
    if (self%back%n > 0) then
      call add_back_norms(self, n, state, mises)
      ok = ok .and. are_numbers(n, mises)
    end if
    if (.not. ok) return
    do first = 1, n, lanes
      last = min(first + lanes - 1, n)
      if (.not. any(self%bound*mises(first:last) > flow(first:last))) cycle
      call return_points(self, n, first, dt, dstrain, flow, slope, factor, stress, state, is_good)
      ok = ok .and. is_good
    end do
  end subroutine update

  !> Plane stress. Hill's function has a return of its own where axis 3 of the material is the
  !! normal of the sheet; all else is searched for.
  subroutine update_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    real(wp), parameter :: most_tilt = 1.0e-9_wp   ! sine of the angle to the normal
    real(wp) :: axis(n, 2), modes(n, 3), left(n), worst, tilt

    if (.not. self%is_hill) then
      call search_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
      return
    end if
    call turn_in_plane(n, self%axes, spin, state(:, 2:5), axis, tilt)
    if (tilt > most_tilt**2) then
      left = 0.0_wp
      call search_plane(self, n, dt, dstrain, stress, state, through, ok, left)
      return
    end if
    call plane_trial(n, self%bulk, self%shear, dstrain, stress, through, modes, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok .or. .not. (self%bound**2*worst > self%lowest**2 .or. self%is_awake)) return
    call into_hill_modes(self%plane, n, axis, modes)
    call self%find_plane_strain(n, dt, dstrain, self%plane%moduli, modes, state, ok)
    call from_hill_modes(self%plane, n, axis, modes)
    call self%flow_plane(n, modes, stress, state, through)
  end subroutine update_plane

  !> The axes of the material in the sheet.
  subroutine lay_in_sheet(self, n, frame, state)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: frame(n, 9)
    real(wp), intent(inout) :: state(n, self%n_state)

    call axes_in_sheet(n, self%axes, frame, state(:, 2:5))
  end subroutine lay_in_sheet

  !> Add the von Mises stress of each back stress.
  pure subroutine add_back_norms(self, n, state, mises)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: state(n, self%n_state)
    real(wp), intent(inout) :: mises(n)
    integer :: k

    do k = 1, self%back%n
      mises = mises + sqrt(1.5_wp*(sum(state(:, 6*k:6*k + 2)**2, 2) &
                                   + 2.0_wp*sum(state(:, 6*k + 3:6*k + 5)**2, 2)))
    end do
  end subroutine add_back_norms

  !> Return of `lanes` points of a row. Those that do not flow keep the bits of their trial stress.
  subroutine return_points(self, n, first, dt, dstrain, flow, slope, factor, stress, state, ok)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n, first
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(in), dimension(n) :: flow, slope, factor   !! before the increment
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    type(return_problem_t) :: problem
    real(wp) :: rotation(lanes, 9), plastic(lanes, 5), dgamma(lanes)
    real(wp) :: back(lanes, 5, self%back%n), strain(lanes, 6)
    logical :: is_hill

    call find_rotation(self, n, first, state, rotation)
    call load_trial(n, first, rotation, stress, problem%trial)
    call load_lanes(n, first, 1, state, problem%eqps)
    if (self%curve%heating%is_active) call load_lanes(n, first, 1, factor, problem%factor)
    call load_lanes(n, first, 1, flow, problem%flow)
    call load_lanes(n, first, 1, slope, problem%slope)
    is_hill = self%is_hill
    problem%guess = 0.0_wp
    if (has_rate(self%curve) .or. is_steep(self%curve)) then
      call load_lanes(n, first, 6, dstrain, strain)
      problem%guess = equivalent_strain(lanes, strain)
    end if
    problem%shear = self%shear
    problem%dt = dt
    if (is_hill) call return_to_hill(self%curve, self%yield%hill, problem, plastic, dgamma, is_hill)
    ok = .true.
    if (.not. is_hill) then
      ! Again where Hill's surface was not reached.
      call load_back_stresses(self, n, first, state, back)
      if (self%n_stages > 0) then
        ok = are_numbers(5*lanes, problem%trial)     ! else the axes are none
        if (.not. ok) return
        call return_in_stages(self%curve, self%yield, self%back, problem, self%n_stages, back, &
                              plastic, dgamma)
      else
        call set_outset(self, n, first, dstrain, rotation, back, problem)
        call return_to_yield(self%curve, self%yield, self%back, problem, back, plastic, dgamma, ok)
      end if
      call move_back_stresses(self, n, first, back, state)
    end if
    call add_plastic(n, first, rotation, -2.0_wp*self%shear, plastic, stress)
    problem%eqps = problem%eqps + dgamma
    call store_lanes(n, first, 1, problem%eqps, state)
    if (self%curve%heating%is_active) &
      call heat_points(self, n, first, problem%trial, plastic, state)
  end subroutine return_points

  !> Rotations from space into the axes of the material at points of a row.
  pure subroutine find_rotation(self, n, first, state, rotation)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n, first
    real(wp), intent(in) :: state(n, self%n_state)
    real(wp), intent(out) :: rotation(lanes, 9)
    real(wp) :: part(lanes, 4)

    if (first + lanes - 1 <= n) then
      call axes_rotation(lanes, n, self%axes, self%is_turned, state(first, 2), rotation)
    else
      call load_lanes(n, first, 4, state(:, 2:5), part)
      call axes_rotation(lanes, lanes, self%axes, self%is_turned, part, rotation)
    end if
  end subroutine find_rotation

  !> The trial stress of points of a row as deviators in the axes of the material.
  pure subroutine load_trial(n, first, rotation, stress, trial)
    integer, intent(in) :: n, first
    real(wp), intent(in) :: rotation(lanes, 9), stress(n, 6)
    real(wp), intent(out) :: trial(lanes, 5)
    real(wp) :: part(lanes, 6)

    if (first + lanes - 1 <= n) then
      call into_axes(n, rotation, stress(first, 1), trial)
    else
      call load_lanes(n, first, 6, stress, part)
      call into_axes(lanes, rotation, part, trial)
    end if
  end subroutine load_trial

  !> Add a multiple of the plastic strain to the stress of points of a row.
  pure subroutine add_plastic(n, first, rotation, scaling, plastic, stress)
    integer, intent(in) :: n, first
    real(wp), intent(in) :: rotation(lanes, 9), scaling, plastic(lanes, 5)
    real(wp), intent(inout) :: stress(n, 6)
    real(wp) :: part(lanes, 6)

    if (first + lanes - 1 <= n) then
      call add_from_axes(n, rotation, scaling, plastic, stress(first, 1))
    else
      call load_lanes(n, first, 6, stress, part)
      call add_from_axes(lanes, rotation, scaling, plastic, part)
      call store_lanes(n, first, 6, part, stress)
    end if
  end subroutine add_plastic

  !> Back stresses as deviators.
  pure subroutine load_back_stresses(self, n, first, state, back)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n, first
    real(wp), intent(in) :: state(n, self%n_state)
    real(wp), intent(out) :: back(lanes, 5, self%back%n)
    real(wp) :: part(lanes, 6)
    integer :: k

    do k = 1, self%back%n
      call load_lanes(n, first, 6, state(:, 6*k:6*k + 5), part)
      call deviator_of(part, back(:, :, k))
    end do
  end subroutine load_back_stresses

  !> Move the back stresses of the state by what has changed, so that the others keep their bits.
  pure subroutine move_back_stresses(self, n, first, back, state)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n, first
    real(wp), intent(in) :: back(lanes, 5, self%back%n)
    real(wp), intent(inout) :: state(n, self%n_state)
    real(wp) :: part(lanes, 6), before(lanes, 5)
    integer :: k

    do k = 1, self%back%n
      call load_lanes(n, first, 6, state(:, 6*k:6*k + 5), part)
      call deviator_of(part, before)
      call add_deviator(back(:, :, k) - before, part)
      call store_lanes(n, first, 6, part, state(:, 6*k:6*k + 5))
    end do
  end subroutine move_back_stresses

  !> The relative stress before the increment, from that of the trial stress.
  pure subroutine set_outset(self, n, first, dstrain, rotation, back, problem)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n, first
    real(wp), intent(in) :: dstrain(n, 6), rotation(lanes, 9)
    real(wp), intent(in) :: back(lanes, 5, self%back%n)
    type(return_problem_t), intent(inout) :: problem    !! the trial stress is there already
    real(wp) :: strain(lanes, 6), elastic(lanes, 5)
    integer :: i, k, l

    call load_lanes(n, first, 6, dstrain, strain)
    strain(:, 4:) = 0.5_wp*strain(:, 4:)
    call into_axes(lanes, rotation, strain, elastic)
    do i = 1, 5
      !$omp simd
      do l = 1, lanes
        problem%outset(l, i) = problem%trial(l, i) - 2.0_wp*self%shear*elastic(l, i)
      end do
      do k = 1, self%back%n
        !$omp simd
        do l = 1, lanes
          problem%outset(l, i) = problem%outset(l, i) - back(l, i, k)
        end do
      end do
    end do
  end subroutine set_outset

  !> Heat by the work of the new stress on the plastic strain.
  pure subroutine heat_points(self, n, first, trial, plastic, state)
    class(anisotropic_plastic_t), intent(in) :: self
    integer, intent(in) :: n, first
    real(wp), intent(in) :: trial(lanes, 5), plastic(lanes, 5)
    real(wp), intent(inout) :: state(n, self%n_state)
    integer :: l

    do l = 1, min(lanes, n - first + 1)
      associate (e => plastic(l, :), s => trial(l, :))
        call heat_up(self%curve%heating, dot_product(s - 2.0_wp*self%shear*e, e), &
                     state(first + l - 1, self%n_state))
      end associate
    end do
  end subroutine heat_points

end module anisotropic_plastic
