!> A UMAT of a user as a block law, called point by point.
!!
!! What Abaqus keeps for it follows its own state variables: total strain (6) and the
!! energies SSE, SPD, SCD (3).
module umat_adapter
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t
  use kinds, only: wp
  use point_context, only: point_context_t
  use user_call, only: umat_procedure, name_length, user_law_t, first_point_t, set_user_law, &
                       slack, most_fields, n_guard, n_room, set_guard, check_guard, &
                       check_spare_states, enter_user_call, leave_user_call, note_failure, &
                       end_user_run, uneven_stiffness, in_umat
  use user_kinematics, only: rotation_of_spin, rotated_stress, rotated_strain, identity
  implicit none
  private

  public :: new_umat_adapter

  integer, parameter, public :: n_kept = 9   !! values kept after the state variables
  integer, parameter :: most_halvings = 6    ! of an increment that comes back with PNEWDT < 1

  !> A UMAT with its name and constants; the moduli of the base type are for the stable increment.
  type, extends(user_law_t), public :: umat_adapter_t
    procedure(umat_procedure), pointer, nopass :: umat => null()
  contains
    procedure :: update_in_context
    procedure :: stiffness_at_start
  end type umat_adapter_t

  !> One increment of one point.
  type :: increment_t
    integer :: element = 0, point = 0, step = 1, number = 0
    real(wp) :: step_time = 0.0_wp, time = 0.0_wp, dt = 0.0_wp, length = 0.0_wp
    real(wp) :: dstrain(6) = 0.0_wp, place(3) = 0.0_wp
    real(wp), dimension(3, 3) :: rotation = identity, f0 = identity, f1 = identity
    integer :: n_fields = 0
    real(wp), dimension(most_fields + 1) :: fields = 0.0_wp, changes = 0.0_wp   !! TEMP and PREDEF
  end type increment_t

contains

  !> Law from a UMAT, its name, its constants and the number of its state variables.
  function new_umat_adapter(umat, name, density, props, n_statv) result(law)
    procedure(umat_procedure) :: umat
    character(*), intent(in) :: name                 !! CMNAME
    real(wp), intent(in) :: density, props(:)
    integer, intent(in) :: n_statv                   !! NSTATV
    type(umat_adapter_t) :: law

    call set_user_law(law, name, density, props, n_statv, n_kept)
    law%stiffness_source = "DDSDDE at the start"
    law%umat => umat
  end function new_umat_adapter

  !> One call of the UMAT for each point that is not a repetition. Fails where stress or state are
  !! not finite, or PNEWDT stays below one in 64 parts of the increment; points after the one
  !! that failed are left as they were.
  subroutine update_in_context(self, context, dt, dstrain, stress, state, ok, spin)
    class(umat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 6)
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n, 3)
    type(increment_t) :: increment
    real(wp) :: sigma(6), kept(self%n_state)
    integer :: l

    ok = .true.
    increment%time = context%time
    increment%step_time = context%step_time
    increment%step = context%step
    increment%dt = dt
    increment%number = context%increment
    increment%n_fields = context%n_fields
    do l = 1, context%n
      if (.not. context%is_owner(l)) cycle
      increment%element = context%element(l)
      increment%point = context%point(l)
      increment%length = context%length(l)
      increment%dstrain = dstrain(l, :)
      increment%place = context%place(l, :)
      associate (n => context%n_fields)
        if (n > 0) increment%fields(:n) = context%fields(l, :n, context%row)
        if (n > 0) increment%changes(:n) = context%fields(l, n + 1:, context%row) &
                                           - increment%fields(:n)
      end associate
      increment%f0 = transpose(reshape(context%f0(l, :), [3, 3]))
      increment%f1 = transpose(reshape(context%f1(l, :), [3, 3]))
      sigma = stress(l, :)
      kept = state(l, :)
      call enter_user_call(in_umat, int(increment%element, c_int), int(increment%point, c_int), &
                           int(increment%element, c_int))
      call update_point(self, increment, spin(l, :), sigma, kept, ok)
      stress(l, :) = sigma
      state(l, :) = kept
      if (.not. ok) exit
    end do
    call leave_user_call()
  end subroutine update_in_context

  !> The increment of a point in one, then if the UMAT asks for it in 2, 4, ... equal parts.
  subroutine update_point(self, increment, spin, stress, state, ok)
    class(umat_adapter_t), intent(in) :: self
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: spin(3)
    real(wp), intent(inout) :: stress(6)              ! rotated by the whole spin
    real(wp), intent(inout) :: state(self%n_state)
    logical, intent(out) :: ok
    real(wp) :: start(6), state_at_start(self%n_state), tangent(6, 6)
    type(increment_t) :: part
    logical :: is_refused
    integer :: halvings, n_parts, i

    start = stress
    state_at_start = state
    do halvings = 0, most_halvings
      n_parts = 2**halvings
      part = increment
      part%rotation = rotation_of_spin(spin/n_parts)
      part%dt = increment%dt/n_parts
      part%dstrain = increment%dstrain/n_parts
      part%changes = increment%changes/n_parts
      state = state_at_start
      stress = start
      if (n_parts > 1) stress = rotated_stress(transpose(rotation_of_spin(spin)), start)
      do i = 1, n_parts
        if (n_parts > 1) then
          part%time = increment%time + (i - 1)*part%dt
          part%step_time = increment%step_time + (i - 1)*part%dt
          part%fields = increment%fields + (i - 1)*part%changes
          part%f0 = increment%f0 + (increment%f1 - increment%f0)*(i - 1)/n_parts
          part%f1 = increment%f0 + (increment%f1 - increment%f0)*i/n_parts
          stress = rotated_stress(part%rotation, stress)
        end if
        call call_umat(self, part, stress, state, tangent, is_refused, ok)
        if (is_refused .or. .not. ok) exit
      end do
      if (.not. ok) call note_failure(int(increment%element, c_int), &
                                      int(increment%point, c_int), 1_c_int)
      if (.not. (is_refused .and. ok)) return
    end do
    ok = .false.
    call note_failure(int(increment%element, c_int), int(increment%point, c_int), 2_c_int)
  end subroutine update_point

  !> The UMAT itself. `state` holds what is kept after the state variables. STRESS, DDSDDE and
  !! STATEV are in one array, a mark after each, so that a write past the end of one is found.
  subroutine call_umat(self, increment, stress, state, tangent, is_refused, ok)
    class(umat_adapter_t), intent(in) :: self
    type(increment_t), intent(in) :: increment
    real(wp), intent(inout) :: stress(6), state(self%n_state)
    real(wp), intent(out) :: tangent(6, 6)   ! DDSDDE
    logical, intent(out) :: is_refused       ! PNEWDT came back below one
    logical, intent(out) :: ok               ! all is finite
    integer, parameter :: at_tangent = 6 + n_guard, at_states = at_tangent + 36 + n_guard
    real(wp) :: room(at_states + self%n_statv + slack + n_guard + n_room), strain(6), energies(3)
    real(wp) :: heat(2), heat_by_strain(6), stress_by_temperature(6), pnewdt
    real(wp) :: predef(most_fields + slack), dpred(most_fields + slack), temperature, work

    room(:6) = stress
    room(at_tangent + 1:at_tangent + 36) = 0.0_wp
    room(at_states + 1:at_states + self%n_statv) = state(:self%n_statv)
    call set_guard(room, 6, 0)
    call set_guard(room(at_tangent + 1), 36, 0)
    call set_guard(room(at_states + 1), self%n_statv, slack)
    strain = rotated_strain(increment%rotation, state(self%n_statv + 1:self%n_statv + 6))
    energies = state(self%n_statv + 7:self%n_statv + 9)
    heat = 0.0_wp
    heat_by_strain = 0.0_wp
    stress_by_temperature = 0.0_wp
    temperature = increment%fields(1)
    if (increment%n_fields == 0) temperature = self%start_temperature
    if (self%heat_state > 0) temperature = temperature + state(self%heat_state)
    work = energies(2) + energies(3)
    predef = 0.0_wp
    dpred = 0.0_wp
    associate (n => increment%n_fields)
      if (n > 1) predef(:n - 1) = increment%fields(2:n)
      if (n > 1) dpred(:n - 1) = increment%changes(2:n)
    end associate
    pnewdt = 1.0_wp
    call self%umat(room, room(at_states + 1), room(at_tangent + 1), energies(1), energies(2), &
                   energies(3), heat(1), &
                   stress_by_temperature, heat_by_strain, heat(2), strain, increment%dstrain, &
                   [increment%step_time, increment%time], increment%dt, temperature, &
                   increment%changes(1), predef, dpred, self%name, 3_c_int, 3_c_int, &
                   6_c_int, int(self%n_statv, c_int), &
                   self%props, int(self%n_props, c_int), increment%place, increment%rotation, &
                   pnewdt, increment%length, increment%f0, increment%f1, &
                   int(increment%element, c_int), int(increment%point, c_int), 1_c_int, 1_c_int, &
                   int([increment%step, 0, 0, 0], c_int), int(increment%number, c_int), &
                   int(name_length, c_size_t))
    call check_guard(room, 6, 0, "STRESS")
    call check_guard(room(at_tangent + 1), 36, 0, "DDSDDE")
    call check_guard(room(at_states + 1), self%n_statv, slack, "STATEV")
    call check_spare_states(room(at_states + self%n_statv + 1), 1, self%n_statv, "STATEV(")
    call check_guard(self%props, self%n_props, slack, "PROPS (here or in another thread)")
    if (ieee_is_nan(pnewdt)) call end_user_run("returns a PNEWDT that is no number (NaN)")
    is_refused = pnewdt < 1.0_wp
    stress = room(:6)
    tangent = reshape(room(at_tangent + 1:at_tangent + 36), [6, 6])
    if (self%has_moduli .and. increment%number == 1 .and. increment%step == 1) &
      call check_components(tangent)
    state(:self%n_statv) = room(at_states + 1:at_states + self%n_statv)
    state(self%n_statv + 1:self%n_statv + 6) = strain + increment%dstrain
    state(self%n_statv + 7:self%n_statv + 9) = energies
    if (self%heat_state > 0) state(self%heat_state) = state(self%heat_state) &
      + self%heat_per_work*(energies(2) + energies(3) - work)
    ok = all(ieee_is_finite(stress)) .and. all(ieee_is_finite(state(:self%n_statv)))
  end subroutine call_umat

  !> End the run if DDSDDE leaves some components at zero and not all. One that is not set at all
  !! is right where *ELASTIC gives the moduli.
  subroutine check_components(tangent)
    real(wp), intent(in) :: tangent(6, 6)
    character(:), allocatable :: words
    integer :: i

    words = uneven_stiffness([(.not. abs(tangent(i, i)) <= 0.0_wp, i=1, 6)])
    if (words /= "") call end_user_run("returns a DDSDDE that is "//words)
  end subroutine check_components

  !> Diagonal of DDSDDE from one call without strain.
  subroutine stiffness_at_start(self, dt, point, state, stiffness, is_finite)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: dt, state(:)
    type(first_point_t), intent(in) :: point
    real(wp), intent(out) :: stiffness(6)
    logical, intent(out) :: is_finite
    type(increment_t) :: increment
    real(wp) :: stress(6), values(self%n_state), tangent(6, 6)
    logical :: is_refused, ok
    integer :: i

    increment%element = point%element
    increment%point = point%point
    increment%place = point%place
    increment%length = point%length
    increment%number = 1
    increment%dt = dt
    increment%n_fields = point%n_fields
    increment%fields = point%fields
    stress = 0.0_wp
    values = 0.0_wp
    values(:self%n_statv) = state
    call enter_user_call(in_umat, int(point%element, c_int), int(point%point, c_int), &
                         int(point%element, c_int))
    call call_umat(self, increment, stress, values, tangent, is_refused, ok)
    call leave_user_call()
    is_finite = ok .and. all(ieee_is_finite(tangent))
    stiffness = [(tangent(i, i), i=1, 6)]
  end subroutine stiffness_at_start

end module umat_adapter
