!> Plasticity of a sheet in plane stress, with a yield function that is defined there alone and with
!! back stresses. Its axes travel with the material.
module sheet_plastic
  use kinds, only: wp
  use block_law, only: set_elastic
  use flow_curve, only: flow_curve_t, flow_at, has_rate, is_rough, is_steep, thermal_factor
  use hardening, only: back_stresses_t
  use mises_plastic, only: mises_plastic_t, set_plastic, equivalent_strain
  use deviator_lanes, only: lanes, load_lanes, store_lanes
  use plane_yield, only: plane_yield_t, scaled_plane_yield, mises_bound_in_plane, own_stresses
  use plane_yield_return, only: plane_problem_t, new_plane_problem, return_in_plane
  use pair_return, only: pair_return_t, new_pair_return, return_by_pair
  use plane_return, only: plane_back_stresses, add_plane_back_stresses
  use plane_stress, only: plane_trial, mode_moduli, in_space
  use tensor_rotation, only: axes_in_sheet, turn_in_plane
  use row_functions, only: are_numbers
  implicit none
  private

  public :: new_sheet_plastic

  !> Flow curve, back stresses and heating are those of the law of von Mises. The state is the
  !! equivalent plastic strain, that of work, the rotation of the axes since the start in four
  !! numbers (see `tensor_rotation`), six components of each back stress in the axes of the
  !! material, and with heating the temperature rise.
  type, extends(mises_plastic_t), public :: sheet_plastic_t
    type(plane_yield_t) :: yield      !! in its own stresses, see `own_stresses`
    type(pair_return_t) :: pair       !! faster return for some of them
    type(plane_problem_t) :: elastic  !! with their stiffness and moduli, without points
    real(wp) :: forms(2, 2) = 0.0_wp, form = 1.0_wp     !! those of the modes of `plane_stress`
    real(wp) :: into(2, 2) = 0.0_wp, into_shear = 1.0_wp   !! by which the trial stress falls into
                                                           !! modes of the plastic strain
    real(wp) :: axes(3, 3) = 0.0_wp   !! of the material at the start, as columns
    real(wp) :: bound = 0.0_wp        !! equivalent over von Mises stress never exceeds it
  contains
    procedure :: update
    procedure :: update_plane
    procedure :: lay_in_sheet
    procedure :: keeps_plane
  end type sheet_plastic_t

contains

  !> Law from density, elastic constants, flow curve, back stresses, yield function and axes at the
  !! start.
  pure function new_sheet_plastic(density, young, poisson, curve, back, yield, axes) result(law)
    real(wp), intent(in) :: density, young, poisson
    type(flow_curve_t), intent(in) :: curve
    type(back_stresses_t), intent(in) :: back
    type(plane_yield_t), intent(in) :: yield     !! of the stresses 11, 22 and 12
    real(wp), intent(in) :: axes(3, 3)
    type(sheet_plastic_t) :: law
    real(wp), parameter :: per = 1.0_wp/sqrt(3.0_wp)
    type(plane_yield_t) :: of_modes
    real(wp) :: moduli(3), m(2, 2), n(2, 2), stiffness, determinant

    call set_elastic(law, density, young, poisson)
    call set_plastic(law, curve, back, 0, 5)
    of_modes = scaled_plane_yield(yield, reshape([1.0_wp, 1.0_wp, per, -per], [2, 2]), per)
    law%bound = mises_bound_in_plane(of_modes)
    call own_stresses(of_modes, law%yield, law%forms, law%form)
    moduli = mode_moduli(law%bulk, law%shear)
    if (back%n == 0 .and. .not. is_rough(curve)) &
      law%pair = new_pair_return(law%yield, law%forms, law%form, moduli)
    associate (t => law%forms)
      m = matmul(t*spread(moduli(:2), 1, 2), transpose(t))
      n = matmul(t, transpose(t))
      stiffness = moduli(2)*law%form**2
      law%elastic = new_plane_problem(stiffness, [m(1, 1), m(1, 2), m(2, 2), stiffness], &
                                      [n(1, 1), n(1, 2), n(2, 2), law%form**2])
      determinant = t(1, 1)*t(2, 2) - t(1, 2)*t(2, 1)
      law%into = reshape([t(2, 2), -t(2, 1), -t(1, 2), t(1, 1)], [2, 2])/determinant
      law%into = law%into/spread(moduli(:2), 2, 2)
    end associate
    law%into_shear = 1.0_wp/(law%form*moduli(3))
    law%axes = axes
  end function new_sheet_plastic

  !> It does where an axis of the material lies across the plane.
  pure logical function keeps_plane(self, component)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: component

    keeps_plane = any(abs(self%axes(component, :)) > 1.0_wp - 1.0e-15_wp)
  end function keeps_plane

  !> The axes of the material in the sheet.
  subroutine lay_in_sheet(self, n, frame, state)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: frame(n, 9)
    real(wp), intent(inout) :: state(n, self%n_state)

    call axes_in_sheet(n, self%axes, frame, state(:, 2:5))
  end subroutine lay_in_sheet

  !> Not defined for solids, which `material_table` refuses.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)

    ok = .false.
  end subroutine update

  !> Elastic trial, then the return of the points that may yield. Fails where axis 3 of the material
  !! is not the normal of the sheet.
  subroutine update_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    real(wp), parameter :: most_tilt = 1.0e-9_wp   ! sine of the angle to the normal
    real(wp) :: reach(n), factor(n), now(n, 3), axis(n, 2), modes(n, 3), worst, tilt
    logical :: is_good

    call turn_in_plane(n, self%axes, spin, state(:, 2:5), axis, tilt)
    call plane_trial(n, self%bulk, self%shear, dstrain, stress, through, modes, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp .and. tilt <= most_tilt**2
    if (.not. ok .or. .not. (self%bound**2*worst > self%lowest**2 .or. self%is_awake .or. &
                             self%back%n > 0)) return
    factor = 1.0_wp
    if (self%curve%heating%is_active) &
      factor = thermal_factor(self%curve%heating, n, self%n_state, state)
    call flow_at(self%curve, n, state(:, 1), factor, now(:, 1), now(:, 2), now(:, 3), reach)
    ok = are_numbers(n, now(:, 1))
    if (.not. ok) return
    is_good = .false.
    if (self%pair%half > 0) call return_at_once(self, n, dt, dstrain, axis, now, factor, modes, &
                                                state(:, 1), is_good)
    if (.not. is_good) call return_in_lanes(self, n, dt, dstrain, axis, now, factor, modes, state, &
                                            ok)
    call self%flow_plane(n, modes, stress, state, through)
  end subroutine update_plane

  !> The return of a row by `pair_return`. Without success nothing has changed.
  subroutine return_at_once(self, n, dt, dstrain, axis, now, factor, modes, eqps, ok)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3), axis(n, 2)
    real(wp), intent(in) :: now(n, 3)              !! flow stress, slope and bend
    real(wp), intent(in) :: factor(n)
    real(wp), intent(inout) :: modes(n, 3)         !! of the trial stress, out of the plastic strain
    real(wp), intent(inout) :: eqps(n)
    logical, intent(out) :: ok
    real(wp) :: trial(n, 3), outset(n, 3)

    ok = .not. may_yield(n, self%bound, modes, now)
    if (ok) then
      modes = 0.0_wp
      return
    end if
    call into_axes_in_sheet(self, n, axis, modes, dstrain, trial, outset)
    call return_by_pair(self%pair, self%curve, n, dt, factor, now, trial, outset, modes, eqps, ok)
    if (ok) call from_axes_in_sheet(n, axis, modes)
  end subroutine return_at_once

  !> The return of the points that may yield, `lanes` of them at a time.
  subroutine return_in_lanes(self, n, dt, dstrain, axis, now, factor, modes, state, ok)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3), axis(n, 2)
    real(wp), intent(in) :: now(n, 3)              !! flow stress, slope and bend
    real(wp), intent(in) :: factor(n)
    real(wp), intent(inout) :: modes(n, 3)         !! of the trial stress, out of the plastic strain
    real(wp), intent(inout) :: state(n, self%n_state)
    logical, intent(out) :: ok
    type(plane_problem_t) :: problem
    real(wp) :: guess(n), back(n, 3, self%back%n)
    logical :: is_good
    integer :: first

    guess = 0.0_wp
    if (has_rate(self%curve) .or. is_steep(self%curve)) &
      guess = equivalent_strain(n, in_space(n, dstrain))
    ok = .true.
    problem = self%elastic
    problem%dt = dt
    call plane_back_stresses(n, self%back%n, state(:, 6:), back)
    do first = 1, n, lanes
      call return_points(self, n, first, dstrain, axis, now, factor, guess, problem, modes, &
                         back, state, is_good)
      ok = ok .and. is_good
    end do
    call add_plane_back_stresses(n, self%back%n, back, state(:, 6:))
  end subroutine return_in_lanes

  !> Plastic strain of `lanes` points of a row, zero where none flows.
  subroutine return_points(self, n, first, dstrain, axis, now, factor, guess, problem, modes, &
                           back, state, ok)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: n, first
    real(wp), intent(in) :: dstrain(n, 3), axis(n, 2)
    real(wp), intent(in) :: now(n, 3)              !! flow stress, slope and bend
    real(wp), intent(in), dimension(n) :: factor, guess
    type(plane_problem_t), intent(inout) :: problem
    real(wp), intent(inout) :: modes(n, 3)         !! of the trial stress, out of the plastic strain
    real(wp), intent(inout) :: back(n, 3, self%back%n)   !! modes in the axes, out their change
    real(wp), intent(inout) :: state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp) :: turn(lanes, 2), mode(lanes, 3), strain(lanes, 3), fall(lanes, 3), dgamma(lanes)
    real(wp) :: own(lanes, 3, self%back%n)
    integer :: l

    call load_lanes(n, first, 3, modes, mode)
    call load_lanes(n, first, 1, now, problem%flow)
    dgamma = 0.0_wp
    fall = 0.0_wp
    ok = .true.
    if (self%back%n > 0 .or. may_yield(lanes, self%bound, mode, problem%flow)) then
      call load_lanes(n, first, 2, axis, turn)
      call load_lanes(n, first, 3, dstrain, strain)
      call load_lanes(n, first, 1, state, problem%eqps)
      call load_lanes(n, first, 1, now(:, 2), problem%slope)
      call load_lanes(n, first, 1, factor, problem%factor)
      call load_lanes(n, first, 1, guess, problem%guess)
      call into_axes_in_sheet(self, lanes, turn, mode, strain, problem%trial, problem%outset)
      call load_back_stresses(self, n, first, back, own)
      call return_in_plane(self%curve, self%yield, self%back, own, problem, fall, dgamma, ok)
      call strain_in_axes(self, fall)
      call move_back_stresses(self, n, first, fall, dgamma, back)
      call from_axes_in_sheet(lanes, turn, fall)
      !$omp simd
      do l = 1, lanes
        problem%eqps(l) = problem%eqps(l) + dgamma(l)
      end do
      call store_lanes(n, first, 1, problem%eqps, state)
    end if
    call store_lanes(n, first, 3, fall, modes)
  end subroutine return_points

  !> Does any of these points come near the yield surface?
  pure logical function may_yield(n, bound, mode, flow)
    integer, intent(in) :: n
    real(wp), intent(in) :: bound, mode(n, 3), flow(n)
    real(wp) :: most
    integer :: l

    most = -1.0_wp
    !$omp simd reduction(max:most)
    do l = 1, n
      most = max(most, bound**2*(mode(l, 1)**2 + mode(l, 2)**2 + mode(l, 3)**2) - flow(l)**2)
    end do
    may_yield = most > 0.0_wp
  end function may_yield

  !> Own stresses of the yield function in the axes of the material, of the trial stress and of the
  !! stress before it.
  pure subroutine into_axes_in_sheet(self, n, axis, mode, dstrain, trial, outset)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: axis(n, 2)         !! first one of the material in the frame
    real(wp), intent(in) :: mode(n, 3)         !! of the trial stress in the frame
    real(wp), intent(in) :: dstrain(n, 3)      !! 11 22 12, engineering shear
    real(wp), intent(out) :: trial(n, 3), outset(n, 3)
    real(wp), parameter :: per = 1.0_wp/sqrt(3.0_wp)
    real(wp) :: cosine, sine, s1, s2, s3, e1, e2, e3, moduli(3)
    integer :: l

    moduli = mode_moduli(self%bulk, self%shear)
    moduli(2:) = moduli(2:)*per
    associate (t => self%forms)
      !$omp simd private(cosine, sine, s1, s2, s3, e1, e2, e3)
      do l = 1, n
        cosine = axis(l, 1)**2 - axis(l, 2)**2
        sine = 2.0_wp*axis(l, 1)*axis(l, 2)
        s1 = mode(l, 1)
        s2 = cosine*mode(l, 2) + sine*mode(l, 3)
        s3 = cosine*mode(l, 3) - sine*mode(l, 2)
        trial(l, 1) = t(1, 1)*s1 + t(1, 2)*s2
        trial(l, 2) = t(2, 1)*s1 + t(2, 2)*s2
        trial(l, 3) = self%form*s3
        e2 = moduli(2)*(dstrain(l, 1) - dstrain(l, 2))
        e3 = moduli(3)*dstrain(l, 3)
        e1 = s1 - moduli(1)*(dstrain(l, 1) + dstrain(l, 2))
        s2 = s2 - (cosine*e2 + sine*e3)
        s3 = s3 - (cosine*e3 - sine*e2)
        outset(l, 1) = t(1, 1)*e1 + t(1, 2)*s2
        outset(l, 2) = t(2, 1)*e1 + t(2, 2)*s2
        outset(l, 3) = self%form*s3
      end do
    end associate
  end subroutine into_axes_in_sheet

  !> Own stresses of the yield function from the modes of back stresses.
  pure subroutine load_back_stresses(self, n, first, back, own)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: n, first
    real(wp), intent(in) :: back(n, 3, self%back%n)
    real(wp), intent(out) :: own(lanes, 3, self%back%n)
    real(wp) :: mode(lanes, 3)
    integer :: k

    associate (t => self%forms)
      do k = 1, self%back%n
        call load_lanes(n, first, 3, back(:, :, k), mode)
        own(:, 1, k) = t(1, 1)*mode(:, 1) + t(1, 2)*mode(:, 2)
        own(:, 2, k) = t(2, 1)*mode(:, 1) + t(2, 2)*mode(:, 2)
        own(:, 3, k) = self%form*mode(:, 3)
      end do
    end associate
  end subroutine load_back_stresses

  !> Changes of the back stresses by a plastic strain; zero, to the bit, without one.
  pure subroutine move_back_stresses(self, n, first, strain, dgamma, back)
    class(sheet_plastic_t), intent(in) :: self
    integer, intent(in) :: n, first
    real(wp), intent(in) :: strain(lanes, 3), dgamma(lanes)   !! modes in the axes
    real(wp), intent(inout) :: back(n, 3, self%back%n)        !! out their change
    real(wp) :: mode(lanes, 3)
    integer :: i, k

    do k = 1, self%back%n
      associate (c => self%back%modulus(k), gamma => self%back%recall(k))
        call load_lanes(n, first, 3, back(:, :, k), mode)
        do i = 1, 3
          mode(:, i) = (c*strain(:, i) - gamma*dgamma*mode(:, i))/(1.0_wp + gamma*dgamma)
        end do
        call store_lanes(n, first, 3, mode, back(:, :, k))
      end associate
    end do
  end subroutine move_back_stresses

  !> Plastic strain as modes in the axes of the material, from that by which the own stresses fall.
  pure subroutine strain_in_axes(self, fall)
    class(sheet_plastic_t), intent(in) :: self
    real(wp), intent(inout) :: fall(lanes, 3)
    real(wp) :: first
    integer :: l

    associate (t => self%into)
      !$omp simd private(first)
      do l = 1, lanes
        first = t(1, 1)*fall(l, 1) + t(1, 2)*fall(l, 2)
        fall(l, 2) = t(2, 1)*fall(l, 1) + t(2, 2)*fall(l, 2)
        fall(l, 1) = first
        fall(l, 3) = self%into_shear*fall(l, 3)
      end do
    end associate
  end subroutine strain_in_axes

  !> From there to the frame.
  pure subroutine from_axes_in_sheet(n, axis, strain)
    integer, intent(in) :: n
    real(wp), intent(in) :: axis(n, 2)         !! as above
    real(wp), intent(inout) :: strain(n, 3)
    real(wp) :: cosine, sine, second
    integer :: l

    !$omp simd private(cosine, sine, second)
    do l = 1, n
      cosine = axis(l, 1)**2 - axis(l, 2)**2
      sine = 2.0_wp*axis(l, 1)*axis(l, 2)
      second = cosine*strain(l, 2) - sine*strain(l, 3)
      strain(l, 3) = sine*strain(l, 2) + cosine*strain(l, 3)
      strain(l, 2) = second
    end do
  end subroutine from_axes_in_sheet

end module sheet_plastic
