!> A UMAT of a user as a block law, called point by point.
!!
!! What Abaqus keeps for it follows its own state variables: total strain (6) and the
!! energies SSE, SPD, SCD (3). In the form for shells a call has the components 11, 22 and 12, which
!! are the first of those that the UMAT is given and that are kept.
module umat_adapter
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan, ieee_value, ieee_quiet_nan
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t
  use kinds, only: wp
  use point_context, only: point_context_t, number_in_plane, number_through
  use user_call, only: umat_procedure, name_length, user_law_t, first_point_t, set_user_law, &
                       slack, most_fields, n_guard, n_room, set_guard, check_guard, &
                       mark, check_spare_states, enter_user_call, leave_user_call, &
                       note_failure, end_user_run, uneven_stiffness, in_umat, space_words
  use plane_stress, only: in_sheet
  use user_sheet, only: with_zeros, about_normal
  use user_fields, only: define_fields, update_output
  use tensor_rotation, only: rotate_by_spin
  use user_kinematics, only: rotation_of_spin, rotated_stress, rotated_strain, identity, &
                             rotations_of_spins
  implicit none
  private

  public :: new_umat_adapter

  integer, parameter, public :: n_kept = 9   !! values kept after the state variables
  integer, parameter :: most_halvings = 6    ! of an increment that comes back with PNEWDT < 1
  integer, parameter :: n_spare = 24         ! zeros after the state variables, see `slack`


  !> A UMAT with its name and constants; the moduli of the base type are for the stable increment.
  type, extends(user_law_t), public :: umat_adapter_t
    procedure(umat_procedure), pointer, nopass :: umat => null()
    !> STRESS, DDSDDE and STATEV are in one array, a mark after each, so that a write past the end
    !! of one is found: NTENS, and the places of the last two.
    integer :: n_tens = 6
    integer :: at_tangent = 6 + n_guard, at_states = 42 + 2*n_guard
  contains
    procedure :: update_in_context
    procedure :: update_in_axes
    procedure :: stiffness_at_start
    procedure :: differs_without_gradients
  end type umat_adapter_t

  !> One increment of one point.
  type :: increment_t
    integer(c_int) :: element = 0, point = 0, number = 0, step(4) = [1, 0, 0, 0]
    integer(c_int) :: in_layer = 1, layer = 1                      !! NPT, KSPT
    real(wp) :: times(2) = 0.0_wp, dt = 0.0_wp                     !! times: of the step, in all
    real(wp) :: temperature = 0.0_wp, heating = 0.0_wp             !! TEMP, DTEMP
    real(wp), dimension(most_fields + slack) :: fields = 0.0_wp, changes = 0.0_wp   !! PREDEF, DPRED
  end type increment_t

  !> Other values of that point, one after the other as the UMAT wants them: where they begin. The
  !! last are what is kept after the state variables, the strain already rotated.
  integer, parameter :: at_dstrain = 1, at_rotation = 7, at_place = 16, at_f0 = 19, at_f1 = 28, &
                        at_length = 37, at_kept = 38

contains

  !> Law from a UMAT, its name, its constants and the number of its state variables.
  function new_umat_adapter(umat, name, density, props, n_statv, is_plane) result(law)
    procedure(umat_procedure) :: umat
    character(*), intent(in) :: name                 !! CMNAME
    real(wp), intent(in) :: density, props(:)
    integer, intent(in) :: n_statv                   !! NSTATV
    logical, intent(in), optional :: is_plane        !! in its form for shells
    type(umat_adapter_t) :: law

    call set_user_law(law, name, density, props, n_statv, n_kept)
    law%stiffness_source = "DDSDDE at the start"
    law%umat => umat
    if (present(is_plane)) law%is_plane = is_plane
    if (.not. law%is_plane) return
    law%n_direct = 2
    law%n_shear = 1
    law%n_tens = 3
    law%at_tangent = 3 + n_guard
    law%at_states = 12 + 2*n_guard
  end function new_umat_adapter

  !> The components of point `l` of some tensors, as a call has them.
  pure subroutine take(is_plane, n, l, tensors, values)
    logical, intent(in) :: is_plane
    integer, intent(in) :: n, l
    real(wp), intent(in) :: tensors(n, 6)
    real(wp), intent(inout) :: values(*)

    if (is_plane) then
      values(:3) = tensors(l, in_sheet)
    else
      values(:6) = tensors(l, :)
    end if
  end subroutine take

  !> The reverse.
  pure subroutine put_back(is_plane, n, l, values, tensors)
    logical, intent(in) :: is_plane
    integer, intent(in) :: n, l
    real(wp), intent(in) :: values(*)
    real(wp), intent(inout) :: tensors(n, 6)

    if (is_plane) then
      tensors(l, in_sheet) = values(:3)
    else
      tensors(l, :) = values(:6)
    end if
  end subroutine put_back

  !> The form for shells. The strain 33 is elastic by the moduli of the law, and what is plastic
  !! keeps the volume.
  subroutine update_in_axes(self, context, dt, dstrain, stress, state, through, ok, spin)
    class(umat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 3)
    real(wp), intent(inout) :: stress(context%n, 3), state(context%n, self%n_state)
    real(wp), intent(out) :: through(context%n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n)
    real(wp) :: tensors(context%n, 6)

    tensors = with_zeros(context%n, stress)
    through = stress(:, 1) + stress(:, 2)
    call self%update_in_context(context, dt, with_zeros(context%n, dstrain), tensors, state, ok, &
                                about_normal(context%n, spin))
    stress = tensors(:, in_sheet)
    through = (stress(:, 1) + stress(:, 2) - through)/(3.0_wp*self%bulk) &
              - (dstrain(:, 1) + dstrain(:, 2))
  end subroutine update_in_axes

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
    real(wp) :: room(size_of_room(self)), values(at_kept - 1 + n_carried(self))
    real(wp) :: strain(context%n, 6), rotation(context%n, 9)
    logical :: is_refused
    integer :: l

    associate (n => self%n_statv, m => self%n_before)
      call turn_strain(self%is_plane, context%n, state(:, m + 1:m + 6), spin, strain)
      call rotations_of_spins(context%n, spin, rotation)
      if (self%is_plane) values = 0.0_wp
      if (.not. self%needs_gradients) call forget_gradients(values)
      call set_room(self, room)
      increment%times = [context%step_time, context%time]
      increment%step(1) = int(context%step, c_int)
      increment%number = int(context%increment, c_int)
      increment%dt = dt
      ok = .true.
      do l = 1, context%n
        if (.not. context%is_owner(l)) cycle
        call name_point(context, l, increment)
        call set_values(context%n, l, n_carried(self), rotation, context%place, context%length, &
                        state(:, m + 1:), values)
        call take(self%is_plane, context%n, l, dstrain, values(at_dstrain:))
        call take(self%is_plane, context%n, l, strain, values(at_kept:))
        if (self%needs_gradients) call set_gradients(context%n, l, context%f0, context%f1, values)
        call set_temperature(self, context, l, values, increment)
        if (associated(self%usdfld)) &
          call define_fields(self, context, l, dt, stress(l, :), state(l, :), increment%fields, &
                             increment%changes)
        call take(self%is_plane, context%n, l, stress, room)
        room(self%at_states + 1:self%at_states + n) = state(l, :n)
        call enter_user_call(in_umat, increment%element, increment%point, increment%element)
        call call_umat(self, increment, values, room, is_refused, ok)
        if (is_refused .and. ok) then
          call update_in_parts(self, increment, spin(l, :), stress(l, :), state(l, :), &
                               values, room, ok)
        else if (.not. ok) then
          call note_failure(increment%element, increment%point, 1_c_int)
        end if
        call put_back(self%is_plane, context%n, l, room, stress)
        state(l, :n) = room(self%at_states + 1:self%at_states + n)
        state(l, m + 1:) = values(at_kept:)
        if (.not. ok) exit
        if (associated(self%uvarm)) &
          call update_output(self, context, l, dt, stress(l, :), state(l, :))
      end do
      call check_guard(self%props, self%n_props, slack, "PROPS (here or in another thread)")
    end associate
    call leave_user_call()
  end subroutine update_in_context

  !> The strain that is kept after the state variables, rotated by the spin of an increment.
  subroutine turn_strain(is_plane, n, kept, spin, strain)
    logical, intent(in) :: is_plane
    integer, intent(in) :: n
    real(wp), intent(in) :: kept(n, 6), spin(n, 3)
    real(wp), intent(out) :: strain(n, 6)

    strain(:, :3) = kept(:, :3)
    strain(:, 4:) = 0.5_wp*kept(:, 4:)
    if (is_plane) then
      strain(:, 3) = 0.0_wp
      strain(:, 4) = 0.5_wp*kept(:, 3)
    end if
    call rotate_by_spin(n, spin, strain)
    strain(:, 4:) = 2.0_wp*strain(:, 4:)
  end subroutine turn_strain

  !> Which element and point a call is for.
  pure subroutine name_point(context, l, increment)
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: l
    type(increment_t), intent(inout) :: increment

    increment%element = int(context%element(l), c_int)
    increment%point = int(context%point(l), c_int)
    increment%in_layer = increment%point
    increment%layer = 1
    if (increment%point <= context%in_plane) return
    increment%in_layer = int(number_in_plane(context, l), c_int)
    increment%layer = int(number_through(context, l), c_int)
  end subroutine name_point

  !> The values of a point but for strains and deformation gradients.
  pure subroutine set_values(n, l, n_kept, rotation, place, length, kept, values)
    integer, intent(in) :: n, l, n_kept
    real(wp), intent(in) :: rotation(n, 9), place(n, 3), length(n)
    real(wp), intent(in) :: kept(n, n_kept)
    real(wp), intent(inout) :: values(at_kept - 1 + n_kept)

    values(at_rotation:at_rotation + 8) = rotation(l, :)
    values(at_place:at_place + 2) = place(l, :)
    values(at_length) = length(l)
    values(at_kept + 6:) = kept(l, 7:)
  end subroutine set_values

  !> Deformation gradients of a point, column by column.
  pure subroutine set_gradients(n, l, f0, f1, values)
    integer, intent(in) :: n, l
    real(wp), intent(in) :: f0(n, 9), f1(n, 9)
    real(wp), intent(inout) :: values(*)
    integer :: i, k

    do k = 0, 2
      do i = 0, 2
        values(at_f0 + i + 3*k) = f0(l, 1 + k + 3*i)
        values(at_f1 + i + 3*k) = f1(l, 1 + k + 3*i)
      end do
    end do
  end subroutine set_gradients

  !> With KINEMATICS=SMALL deformation gradients are NaN, so that a law that needs them fails at
  !! once instead of working with made-up values.
  pure subroutine forget_gradients(values)
    real(wp), intent(inout) :: values(:)

    values(at_f0:at_f1 + 8) = ieee_value(1.0_wp, ieee_quiet_nan)
  end subroutine forget_gradients

  !> Temperature and field variables of a point.
  pure subroutine set_temperature(self, context, l, values, increment)
    class(umat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: l
    real(wp), intent(in) :: values(at_kept - 1 + n_carried(self))
    type(increment_t), intent(inout) :: increment

    increment%temperature = self%start_temperature
    associate (n => context%n_fields)
      if (n > 0) call set_fields(context%fields(l, :n), context%fields(l, n + 1:), increment)
    end associate
    if (self%heat_state > 0) increment%temperature = increment%temperature + values(size(values))
  end subroutine set_temperature

  !> Temperature and field variables at the start and at the end of the increment.
  pure subroutine set_fields(start, finish, increment)
    real(wp), intent(in) :: start(:), finish(:)
    type(increment_t), intent(inout) :: increment
    integer :: n

    n = size(start)
    increment%temperature = start(1)
    increment%heating = finish(1) - start(1)
    increment%fields(:n - 1) = start(2:)
    increment%changes(:n - 1) = finish(2:) - start(2:)
  end subroutine set_fields

  !> An increment that came back with PNEWDT < 1, in 2, 4, ... equal parts.
  subroutine update_in_parts(self, increment, spin, stress, state, values, room, ok)
    class(umat_adapter_t), intent(in) :: self
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: spin(3)
    real(wp), intent(in) :: stress(6)                 ! at the start, rotated by the whole spin
    real(wp), intent(in) :: state(self%n_state)       ! at the start
    real(wp), intent(inout) :: values(at_kept - 1 + n_carried(self)), room(size_of_room(self))
    logical, intent(out) :: ok
    real(wp) :: whole(size(values)), rotation(3, 3), start(6)
    real(wp), dimension(1, 6) :: part_stress, strain
    type(increment_t) :: part
    logical :: is_refused
    integer :: halvings, n_parts, i

    start = rotated_stress(transpose(rotation_of_spin(spin)), stress)
    whole = values
    strain = 0.0_wp
    do halvings = 1, most_halvings
      n_parts = 2**halvings
      part = increment
      part%dt = increment%dt/n_parts
      part%heating = increment%heating/n_parts
      part%changes = increment%changes/n_parts
      rotation = rotation_of_spin(spin/n_parts)
      values(at_dstrain:at_dstrain + 5) = whole(at_dstrain:at_dstrain + 5)/n_parts
      values(at_rotation:at_rotation + 8) = reshape(rotation, [9])
      values(at_kept:) = state(self%n_before + 1:)
      room(self%at_states + 1:self%at_states + self%n_statv) = state(:self%n_statv)
      part_stress(1, :) = start
      do i = 1, n_parts
        part%times = increment%times + (i - 1)*part%dt
        part%temperature = increment%temperature + (i - 1)*part%heating
        if (self%heat_state > 0) part%temperature = part%temperature + values(size(values)) &
                                                    - state(self%heat_state)
        part%fields = increment%fields + (i - 1)*part%changes
        associate (f0 => whole(at_f0:at_f0 + 8), f1 => whole(at_f1:at_f1 + 8))
          values(at_f0:at_f0 + 8) = f0 + (f1 - f0)*(i - 1)/n_parts
          values(at_f1:at_f1 + 8) = f0 + (f1 - f0)*i/n_parts
        end associate
        part_stress(1, :) = rotated_stress(rotation, part_stress(1, :))
        call put_back(self%is_plane, 1, 1, values(at_kept:), strain)
        strain(1, :) = rotated_strain(rotation, strain(1, :))
        call take(self%is_plane, 1, 1, strain, values(at_kept:))
        call take(self%is_plane, 1, 1, part_stress, room)
        call call_umat(self, part, values, room, is_refused, ok)
        call put_back(self%is_plane, 1, 1, room, part_stress)
        if (is_refused .or. .not. ok) exit
      end do
      if (.not. ok) call note_failure(increment%element, increment%point, 1_c_int)
      if (.not. (is_refused .and. ok)) return
    end do
    ok = .false.
    call note_failure(increment%element, increment%point, 2_c_int)
  end subroutine update_in_parts

  !> Values that are kept after all that the user's subroutines write.
  pure integer function n_carried(self)
    class(umat_adapter_t), intent(in) :: self

    n_carried = self%n_state - self%n_before
  end function n_carried

  !> Values that `set_room` gives room for.
  pure integer function size_of_room(self)
    class(umat_adapter_t), intent(in) :: self

    size_of_room = self%at_states + self%n_statv + n_spare + n_guard + n_room
  end function size_of_room

  !> The marks of the arguments, and zeros after STATEV. A call leaves them as they are, or it ends
  !! the run.
  pure subroutine set_room(self, room)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(inout) :: room(size_of_room(self))

    call set_guard(room, self%n_tens, 0)
    call set_guard(room(self%at_tangent + 1), self%n_tens**2, 0)
    call set_guard(room(self%at_states + 1), self%n_statv, n_spare)
  end subroutine set_room

  !> The UMAT itself. `room` holds STRESS, DDSDDE and STATEV.
  subroutine call_umat(self, increment, values, room, is_refused, ok)
    class(umat_adapter_t), intent(in) :: self
    type(increment_t), intent(in) :: increment
    real(wp), intent(inout) :: values(at_kept - 1 + n_carried(self)), room(size_of_room(self))
    logical, intent(out) :: is_refused       ! PNEWDT came back below one
    logical, intent(out) :: ok               ! all is finite
    integer, parameter :: at_energies = at_kept + 6    ! SSE, SPD, SCD
    real(wp) :: heat(2), heat_by_strain(6), stress_by_temperature(6), pnewdt, work

    associate (n => self%n_statv, n_tens => self%n_tens, at_tangent => self%at_tangent, &
               at_states => self%at_states)
      if (self%is_plane) then
        room(at_tangent + 1:at_tangent + 9) = 0.0_wp
      else
        room(at_tangent + 1:at_tangent + 36) = 0.0_wp
      end if
      heat = 0.0_wp
      heat_by_strain = 0.0_wp
      stress_by_temperature = 0.0_wp
      work = values(at_energies + 1) + values(at_energies + 2)
      pnewdt = 1.0_wp
      call self%umat(room, room(at_states + 1), room(at_tangent + 1), values(at_energies), &
                     values(at_energies + 1), values(at_energies + 2), heat(1), &
                     stress_by_temperature, heat_by_strain, heat(2), values(at_kept), &
                     values(at_dstrain), increment%times, increment%dt, increment%temperature, &
                     increment%heating, increment%fields, increment%changes, self%name, &
                     int(self%n_direct, c_int), int(self%n_shear, c_int), int(n_tens, c_int), &
                     int(n, c_int), self%props, &
                     int(self%n_props, c_int), values(at_place), values(at_rotation), pnewdt, &
                     values(at_length), values(at_f0), values(at_f1), increment%element, &
                     increment%in_layer, 1_c_int, increment%layer, increment%step, &
                     increment%number, &
                     int(name_length, c_size_t))
      if (.not. are_whole(room(n_tens + 1), room(at_tangent + n_tens**2 + 1), &
                          room(at_states + n + n_spare + 1), room(at_states + n + 1))) &
        call find_overrun(self, room)
      if (ieee_is_nan(pnewdt)) call end_user_run("returns a PNEWDT that is NaN")
      is_refused = pnewdt < 1.0_wp
      if (self%has_moduli .and. increment%number == 1 .and. increment%step(1) == 1) &
        call check_components(self, diagonal_of(self, room))
      values(at_kept:at_kept + 5) = values(at_kept:at_kept + 5) + values(at_dstrain:at_dstrain + 5)
      if (self%heat_state > 0) values(size(values)) = values(size(values)) &
        + self%heat_per_work*(values(at_energies + 1) + values(at_energies + 2) - work)
      associate (stress => room(:6), state => room(at_states + 1:at_states + n))
        ! Of a finite sum all parts are finite; so are the marks after three stresses.
        ok = sum(abs(stress)) + sum(abs(state)) <= huge(1.0_wp)
        if (.not. ok) ok = all(ieee_is_finite(stress)) .and. all(ieee_is_finite(state))
      end associate
    end associate
  end subroutine call_umat

  !> Are three marks whole, and the zeros after the state variables of a point zero? For every call:
  !! quicker than to ask one after the other.
  pure logical function are_whole(mark1, mark2, mark3, spare)
    real(wp), intent(in), dimension(n_guard) :: mark1, mark2, mark3
    real(wp), intent(in) :: spare(n_guard, n_spare/n_guard)
    real(wp) :: eight(n_guard), four(4)

    eight = (abs(mark1 - mark) + abs(mark2 - mark)) &
            + (abs(mark3 - mark) + (abs(spare(:, 1)) + abs(spare(:, 2)) + abs(spare(:, 3))))
    four = eight(:4) + eight(5:)
    are_whole = (four(1) + four(2)) + (four(3) + four(4)) <= 0.0_wp
  end function are_whole

  !> End the run with the name of the argument past whose end was written.
  subroutine find_overrun(self, room)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: room(size_of_room(self))
    character(:), allocatable :: hint

    hint = ""
    if (self%is_plane) hint = ", which has NTENS = 3 in plane stress ("//space_words//"),"
    call check_guard(room, self%n_tens, 0, "STRESS"//hint)
    call check_guard(room(self%at_tangent + 1), self%n_tens**2, 0, "DDSDDE"//hint)
    call check_guard(room(self%at_states + 1), self%n_statv, n_spare, "STATEV")
    call check_spare_states(room(self%at_states + self%n_statv + 1), 1, n_spare, self%n_statv, &
                            "STATEV(")
  end subroutine find_overrun

  !> The diagonal of DDSDDE; of the form for shells those of 11, 22 and 12 stand for all.
  pure function diagonal_of(self, room) result(diagonal)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: room(:)          ! as `call_umat` returns it
    real(wp) :: diagonal(6)

    associate (n => self%n_tens, first => self%at_tangent + 1)
      diagonal(:n) = room(first:first + n*n - 1:n + 1)
    end associate
    if (self%is_plane) diagonal = diagonal([1, 2, 1, 3, 3, 3])
  end function diagonal_of

  !> End the run if DDSDDE leaves some components at zero and not all, or if it is that of solids in
  !! the form for shells. One that is not set at all is right where *ELASTIC gives the moduli.
  subroutine check_components(self, diagonal)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: diagonal(6)
    real(wp), parameter :: alike = 1.0e-6_wp
    character(:), allocatable :: words
    real(wp) :: of_solids

    if (self%is_plane) then
      of_solids = self%bulk + 4.0_wp/3.0_wp*self%shear
      if (abs(diagonal(1) - of_solids) <= alike*of_solids) call end_user_run("returns the "// &
        "DDSDDE of a solid in plane stress: "//space_words)
      return
    end if
    words = uneven_stiffness(.not. abs(diagonal) <= 0.0_wp)
    if (words /= "") call end_user_run("returns a DDSDDE that is "//words)
  end subroutine check_components

  !> Diagonal of DDSDDE from one call without strain, in the form for shells with a little shear, of
  !! which a law for solids makes direct stress there.
  subroutine stiffness_at_start(self, dt, point, state, stiffness, is_finite)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: dt, state(:)
    type(first_point_t), intent(in) :: point
    real(wp), intent(out) :: stiffness(6)
    logical, intent(out) :: is_finite
    real(wp), parameter :: little = 1.0e-8_wp, much = 1.0e-3_wp
    real(wp) :: values(at_kept - 1 + n_carried(self)), room(size_of_room(self))
    type(increment_t) :: increment
    logical :: is_refused, ok

    call set_first(self, dt, point, state, increment, values, room)
    if (self%is_plane) values(at_dstrain + 2) = little
    call enter_user_call(in_umat, increment%element, increment%point, increment%element)
    call call_umat(self, increment, values, room, is_refused, ok)
    if (self%is_plane .and. any(abs(room(:2)) > much*abs(room(3)))) &
      call end_user_run("returns direct stress for shear alone in plane stress: "//space_words)
    call leave_user_call()
    associate (first => self%at_tangent + 1)
      is_finite = ok .and. all(ieee_is_finite(room(first:first + self%n_tens**2 - 1)))
    end associate
    stiffness = diagonal_of(self, room)
  end subroutine stiffness_at_start

  !> Three increments of growing strain from the start, with deformation gradients and without.
  logical function differs_without_gradients(self, dt, point, state)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: dt, state(:)
    type(first_point_t), intent(in) :: point
    real(wp), parameter :: sizes(3) = [1.0e-8_wp, 1.0e-4_wp, 1.0e-2_wp], rounding = 1.0e-12_wp
    real(wp), parameter :: way(6) = [1.0_wp, -0.5_wp, -0.4_wp, 0.2_wp, 0.1_wp, 0.3_wp]
    real(wp) :: values(at_kept - 1 + n_carried(self)), room(size_of_room(self))
    real(wp) :: results(self%n_tens + self%n_statv, 2)
    type(increment_t) :: increment
    logical :: is_refused, ok
    integer :: k, i

    do k = 1, 2
      call set_first(self, dt, point, state, increment, values, room)
      do i = 1, size(sizes)
        increment%number = int(i + 1, c_int)   ! DDSDDE is looked at in the first of a run
        values(at_dstrain:at_dstrain + 5) = sizes(i)*way
        if (self%is_plane) values(at_dstrain:at_dstrain + 5) = sizes(i)*[way(in_sheet), &
                                                                        0.0_wp, 0.0_wp, 0.0_wp]
        call stretch(sizes(i)*way, values)
        if (k == 2) call forget_gradients(values)
        call enter_user_call(in_umat, increment%element, increment%point, increment%element)
        call call_umat(self, increment, values, room, is_refused, ok)
        if (is_refused .or. .not. ok) exit
      end do
      results(:, k) = [room(:self%n_tens), &
                       room(self%at_states + 1:self%at_states + self%n_statv)]
    end do
    call leave_user_call()
    differs_without_gradients = .not. all(abs(results(:, 2) - results(:, 1)) &
                                           <= rounding*abs(results(:, 1)))
  end function differs_without_gradients

  !> The deformation gradients of an increment without rotation that follows.
  pure subroutine stretch(e, values)
    real(wp), intent(in) :: e(6)
    real(wp), intent(inout) :: values(:)
    real(wp) :: growth(3, 3)

    associate (f0 => values(at_f0:at_f0 + 8), f1 => values(at_f1:at_f1 + 8))
      growth = identity + reshape([e(1), 0.5_wp*e(4), 0.5_wp*e(5), 0.5_wp*e(4), e(2), &
                                   0.5_wp*e(6), 0.5_wp*e(5), 0.5_wp*e(6), e(3)], [3, 3])
      f0 = f1
      f1 = reshape(matmul(growth, reshape(f0, [3, 3])), [9])
    end associate
  end subroutine stretch

  !> An increment without strain at the start.
  subroutine set_first(self, dt, point, state, increment, values, room)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: dt, state(:)
    type(first_point_t), intent(in) :: point
    type(increment_t), intent(out) :: increment
    real(wp), intent(out) :: values(at_kept - 1 + n_carried(self))
    real(wp), intent(inout) :: room(size_of_room(self))

    increment%element = int(point%element, c_int)
    increment%point = int(point%point, c_int)
    increment%number = 1
    increment%dt = dt
    increment%temperature = self%start_temperature
    if (point%n_fields > 0) call set_fields(point%fields(:point%n_fields), &
                                            point%fields(:point%n_fields), increment)
    values = 0.0_wp
    values(at_rotation:at_rotation + 8) = reshape(identity, [9])
    values(at_f0:at_f0 + 8) = reshape(identity, [9])
    values(at_f1:at_f1 + 8) = reshape(identity, [9])
    values(at_place:at_place + 2) = point%place
    values(at_length) = point%length
    call set_room(self, room)
    room(:self%n_tens) = 0.0_wp
    room(self%at_states + 1:self%at_states + self%n_statv) = state
  end subroutine set_first

end module umat_adapter
