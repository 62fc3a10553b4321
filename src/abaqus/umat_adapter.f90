!> A UMAT of a user as a block law, called point by point.
!!
!! What Abaqus keeps for it follows its own state variables: total strain (6) and the
!! energies SSE, SPD, SCD (3). In the form for shells a call has the components 11, 22 and 12, which
!! are the first of those that the UMAT is given and that are kept.
module umat_adapter
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan, ieee_value, ieee_quiet_nan
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use point_context, only: point_context_t, number_in_plane, number_through
  use user_call, only: umat_procedure, name_length, user_law_t, first_point_t, set_user_law, &
                       slack, most_fields, n_guard, n_room, check_guard, &
                       mark, check_spare_states, enter_user_call, leave_user_call, &
                       note_failure, end_user_run, uneven_stiffness, in_umat, space_words
  use umat_points, only: n_kept, n_spare, n_values, n_together, at_dstrain, at_length, &
                         at_rotation, at_place, at_f0, at_f1, at_kept, at_energies, at_heat, &
                         after_stress, after_tangent, n_column, at_state, set_marks, take_points, &
                         return_points, return_point
  use plane_stress, only: in_sheet
  use user_sheet, only: with_zeros, about_normal
  use user_fields, only: define_fields, update_output
  use user_kinematics, only: rotation_of_spin, rotated_stress, rotated_strain, identity, &
                             turn_strains
  implicit none
  private

  public :: new_umat_adapter, n_kept

  integer, parameter :: most_halvings = 6    ! of an increment that comes back with PNEWDT < 1

  !> A UMAT with its name and constants; the moduli of the base type are for the stable increment.
  type, extends(user_law_t), public :: umat_adapter_t
    procedure(umat_procedure), pointer, nopass :: umat => null()
    integer :: n_tens = 6                                  !! NTENS
  contains
    procedure :: update_in_context
    procedure :: update_in_axes
    procedure :: stiffness_at_start
    procedure :: differs_without_gradients
  end type umat_adapter_t

  !> Columns after the last one that nobody uses, for writes that continue beyond a mark.
  integer, parameter :: room_columns = (n_room - mod(n_room, n_values))/n_values + 1

  !> One increment of one point.
  type :: increment_t
    integer(c_int) :: element = 0, point = 0, number = 0, step(4) = [1, 0, 0, 0]
    integer(c_int) :: in_layer = 1, layer = 1                      !! NPT, KSPT
    integer(c_int) :: n_direct = 3, n_shear = 3, n_tens = 6        !! NDI, NSHR, NTENS
    integer(c_int) :: n_statv = 0, n_props = 0                     !! NSTATV, NPROPS
    real(wp) :: times(2) = 0.0_wp, dt = 0.0_wp                     !! times: of the step, in all
    real(wp) :: temperature = 0.0_wp, heating = 0.0_wp             !! TEMP, DTEMP
    real(wp), dimension(most_fields + slack) :: fields, changes    !! PREDEF, DPRED
  end type increment_t

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
    real(wp) :: values(n_values, n_together + room_columns)
    real(wp) :: statev(n_column(self%n_statv), n_together + n_room/n_column(self%n_statv))
    real(wp) :: strain(context%n, 6), rotation(context%n, 9)
    integer :: first, m, n_called
    logical :: is_plain, is_refused

    call turn_strain(self%is_plane, context%n, spin, state(1, self%n_before + 1), rotation, strain)
    if (self%is_plane) values(:, :n_together) = 0.0_wp
    if (.not. self%needs_gradients) call forget_gradients(n_together, values)
    call set_marks(self%n_statv, n_together, values, statev)
    call start_increment(self, increment)
    increment%times = [context%step_time, context%time]
    increment%step(1) = int(context%step, c_int)
    increment%number = int(context%increment, c_int)
    increment%dt = dt
    is_plain = .not. (self%is_plane .or. associated(self%usdfld) .or. associated(self%uvarm)) &
               .and. all(context%is_owner)
    ok = .true.
    do first = 1, context%n, n_together
      m = min(n_together, context%n - first + 1)
      call take_points(self, context, first, m, dstrain, strain, rotation, stress, state, values, &
                       statev)
      n_called = 0
      is_refused = .false.
      if (is_plain .and. m == n_together) &
        call call_together(self, context, first, increment, values, statev, n_called, is_refused)
      if (n_called == n_together .and. .not. is_refused) then
        call return_points(self, context%n, first, dstrain, strain, values, statev, stress, state, &
                           ok)
        if (ok) cycle
      end if
      call call_in_turn(self, context, first, m, dt, spin, n_called, is_refused, increment, &
                        stress, state, values, statev, ok)
      if (.not. ok) exit
    end do
    call check_guard(self%props, self%n_props, slack, "PROPS (here or in another thread)")
    call leave_user_call()
  end subroutine update_in_context

  !> The calls for eight points of a law of solids, up to one that is refused.
  subroutine call_together(self, context, first, increment, values, statev, n_called, is_refused)
    class(umat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: first
    type(increment_t), intent(inout) :: increment
    real(wp), intent(inout) :: values(n_values, *), statev(n_column(self%n_statv), *)
    integer, intent(out) :: n_called
    logical, intent(out) :: is_refused             ! by the last call
    logical :: has_temperature
    integer :: i, at

    at = at_state(self%n_statv)
    has_temperature = context%n_fields > 0 .or. self%heat_state > 0
    do i = 1, n_together
      call name_point(context, first + i - 1, increment)
      if (has_temperature) &
        call set_temperature(self, context, first + i - 1, values(1, i), increment)
      call enter_user_call(in_umat, increment%element, increment%point, increment%element)
      call call_umat(self, increment, values(1, i), statev(at, i), is_refused)
      if (is_refused) exit
    end do
    n_called = min(i, n_together)
    if (are_whole(self%n_statv, n_together, values, statev)) return
    do i = 1, n_called
      call name_point(context, first + i - 1, increment)
      call enter_user_call(in_umat, increment%element, increment%point, increment%element)
      call find_overrun(self, values(1, i), statev(1, i))
    end do
  end subroutine call_together

  !> The calls for `m` points one after the other, each with all that may follow of it; some have
  !! been called already.
  subroutine call_in_turn(self, context, first, m, dt, spin, n_called, is_last_refused, increment, &
                          stress, state, values, statev, ok)
    class(umat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: first, m, n_called
    real(wp), intent(in) :: dt, spin(context%n, 3)
    logical, intent(in) :: is_last_refused          ! by the last of these calls
    type(increment_t), intent(inout) :: increment   ! as it was for that one
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    real(wp), intent(inout) :: values(n_values, m), statev(n_column(self%n_statv), m)
    logical, intent(out) :: ok
    logical :: is_refused
    integer :: i, l

    ok = .true.
    do i = 1, m
      l = first + i - 1
      if (.not. context%is_owner(l)) cycle
      call name_point(context, l, increment)
      is_refused = is_last_refused .and. i == n_called
      if (i > n_called) then
        call set_temperature(self, context, l, values(1, i), increment)
        if (associated(self%usdfld)) call set_fields_of_user(i, l)
        call enter_user_call(in_umat, increment%element, increment%point, increment%element)
        call call_and_check(self, increment, values(1, i), statev(1, i), is_refused)
      end if
      call add_strain(values(1, i))
      ok = has_result(self, values(1, i), statev(1, i))
      if (is_refused .and. ok) then
        call update_in_parts(self, increment, spin(l, :), stress(l, :), state(l, :), &
                             values(1, i), statev(1, i), ok)
      else if (.not. ok) then
        call note_failure(increment%element, increment%point, 1_c_int)
      end if
      call return_point(self, context%n, l, values(1, i), statev(1, i), stress, state)
      if (.not. ok) exit
      if (associated(self%uvarm)) &
        call update_output(self, context, l, dt, stress(l, :), state(l, :))
    end do

  contains

    !> Field variables by the user's USDFLD, which may change state variables, too.
    subroutine set_fields_of_user(i, l)
      integer, intent(in) :: i, l

      call define_fields(self, context, l, dt, stress(l, :), state(l, :), increment%fields, &
                         increment%changes)
      associate (at => at_state(self%n_statv), n => self%n_statv)
        statev(at:at + n - 1, i) = state(l, :n)
      end associate
    end subroutine set_fields_of_user
  end subroutine call_in_turn

  !> Rotations of an increment, and the strain that is kept after the state variables rotated by
  !! them.
  subroutine turn_strain(is_plane, n, spin, kept, rotation, strain)
    logical, intent(in) :: is_plane
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n, 3), kept(n, 6)
    real(wp), intent(out) :: rotation(n, 9), strain(n, 6)
    real(wp) :: full(n, 6)

    if (is_plane) then
      full = with_zeros(n, kept(:, :3))
      call turn_strains(n, spin, full, rotation, strain)
    else
      call turn_strains(n, spin, kept, rotation, strain)
    end if
  end subroutine turn_strain

  !> What does not depend on the point.
  pure subroutine start_increment(self, increment)
    class(umat_adapter_t), intent(in) :: self
    type(increment_t), intent(inout) :: increment
    integer :: i

    increment%n_direct = int(self%n_direct, c_int)
    increment%n_shear = int(self%n_shear, c_int)
    increment%n_tens = int(self%n_tens, c_int)
    increment%n_statv = int(self%n_statv, c_int)
    increment%n_props = int(self%n_props, c_int)
    increment%temperature = self%start_temperature
    !$omp simd
    do i = 1, size(increment%fields)
      increment%fields(i) = 0.0_wp
      increment%changes(i) = 0.0_wp
    end do
  end subroutine start_increment

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

  !> With KINEMATICS=SMALL deformation gradients are NaN, so that a law that needs them fails at
  !! once instead of working with made-up values.
  pure subroutine forget_gradients(n, values)
    integer, intent(in) :: n                       !! points
    real(wp), intent(inout) :: values(n_values, n)

    values(at_f0:at_f1 + 8, :) = ieee_value(1.0_wp, ieee_quiet_nan)
  end subroutine forget_gradients

  !> Temperature and field variables of a point.
  pure subroutine set_temperature(self, context, l, values, increment)
    class(umat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: l
    real(wp), intent(in) :: values(n_values)
    type(increment_t), intent(inout) :: increment

    increment%temperature = self%start_temperature
    ! What a USDFLD has set at the point before.
    if (associated(self%usdfld)) then
      increment%fields = 0.0_wp
      increment%changes = 0.0_wp
    end if
    associate (n => context%n_fields)
      if (n > 0) call set_fields(context%fields(l, :n), context%fields(l, n + 1:), increment)
    end associate
    if (self%heat_state > 0) increment%temperature = increment%temperature + values(at_heat)
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
  subroutine update_in_parts(self, increment, spin, stress, state, values, statev, ok)
    class(umat_adapter_t), intent(in) :: self
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: spin(3)
    real(wp), intent(in) :: stress(6)                 ! at the start, rotated by the whole spin
    real(wp), intent(in) :: state(self%n_state)       ! at the start
    real(wp), intent(inout) :: values(n_values), statev(n_column(self%n_statv))
    logical, intent(out) :: ok
    real(wp) :: whole(n_values), rotation(3, 3), start(6)
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
      values(at_kept:at_kept + n_kept - 1) = state(self%n_before + 1:self%n_before + n_kept)
      if (self%heat_state > 0) values(at_heat) = state(self%heat_state)
      associate (at => at_state(self%n_statv), n => self%n_statv)
        statev(at:at + n - 1) = state(:n)
      end associate
      part_stress(1, :) = start
      do i = 1, n_parts
        part%times = increment%times + (i - 1)*part%dt
        part%temperature = increment%temperature + (i - 1)*part%heating
        if (self%heat_state > 0) part%temperature = part%temperature + values(at_heat) &
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
        call take(self%is_plane, 1, 1, part_stress, values(after_stress - self%n_tens))
        call call_and_check(self, part, values, statev, is_refused)
        call add_strain(values)
        ok = has_result(self, values, statev)
        call put_back(self%is_plane, 1, 1, values(after_stress - self%n_tens), part_stress)
        if (is_refused .or. .not. ok) exit
      end do
      if (.not. ok) call note_failure(increment%element, increment%point, 1_c_int)
      if (.not. (is_refused .and. ok)) return
    end do
    ok = .false.
    call note_failure(increment%element, increment%point, 2_c_int)
  end subroutine update_in_parts

  !> One call, after which the room around its arguments is looked at.
  subroutine call_and_check(self, increment, values, statev, is_refused)
    class(umat_adapter_t), intent(in) :: self
    type(increment_t), intent(in) :: increment
    real(wp), intent(inout) :: values(n_values), statev(n_column(self%n_statv))
    logical, intent(out) :: is_refused

    call call_umat(self, increment, values, statev(at_state(self%n_statv)), is_refused)
    if (.not. are_whole(self%n_statv, 1, values, statev)) call find_overrun(self, values, statev)
  end subroutine call_and_check

  !> The strain that is kept, after a call.
  pure subroutine add_strain(values)
    real(wp), intent(inout) :: values(n_values)

    values(at_kept:at_kept + 5) = values(at_kept:at_kept + 5) + values(at_dstrain:at_dstrain + 5)
  end subroutine add_strain

  !> The UMAT itself.
  subroutine call_umat(self, increment, values, statev, is_refused)
    class(umat_adapter_t), intent(in) :: self
    type(increment_t), intent(in) :: increment
    real(wp), intent(inout) :: values(n_values), statev(*)   ! STATEV is its beginning
    logical, intent(out) :: is_refused       ! PNEWDT came back below one
    real(wp) :: others(16), pnewdt, work
    integer :: c

    !$omp simd
    do c = after_tangent - 36, after_tangent - 1
      values(c) = 0.0_wp     ! DDSDDE, in the form for shells its end
    end do
    others = 0.0_wp          ! DDSDDT, DRPLDE, RPL, DRPLDT
    work = values(at_energies + 1) + values(at_energies + 2)
    pnewdt = 1.0_wp
    associate (n_tens => self%n_tens)
      call self%umat(values(after_stress - n_tens), statev(1), &
                     values(after_tangent - n_tens**2), &
                     values(at_energies), values(at_energies + 1), values(at_energies + 2), &
                     others(13), others, others(7), others(14), values(at_kept), &
                     values(at_dstrain), increment%times, increment%dt, increment%temperature, &
                     increment%heating, increment%fields, increment%changes, self%name, &
                     increment%n_direct, increment%n_shear, increment%n_tens, &
                     increment%n_statv, self%props, &
                     increment%n_props, values(at_place), values(at_rotation), pnewdt, &
                     values(at_length), values(at_f0), values(at_f1), increment%element, &
                     increment%in_layer, 1_c_int, increment%layer, increment%step, &
                     increment%number, &
                     int(name_length, c_size_t))
    end associate
    if (ieee_is_nan(pnewdt)) call end_user_run("returns a PNEWDT that is NaN")
    is_refused = pnewdt < 1.0_wp
    if (self%has_moduli .and. increment%number == 1 .and. increment%step(1) == 1) &
      call check_components(self, diagonal_of(self, values))
    if (self%heat_state > 0) values(at_heat) = values(at_heat) &
      + self%heat_per_work*(values(at_energies + 1) + values(at_energies + 2) - work)
  end subroutine call_umat

  !> Is all finite that a call returned?
  pure logical function has_result(self, values, statev)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: values(n_values), statev(n_column(self%n_statv))

    associate (at => at_state(self%n_statv))
      has_result = all(ieee_is_finite(values(after_stress - self%n_tens:after_stress - 1))) &
                   .and. all(ieee_is_finite(statev(at:at + self%n_statv - 1)))
    end associate
  end function has_result

  !> Are the marks of `m` points whole, and the zeros after their state variables zero? For every
  !! call: by their bits, quicker than to ask one after the other.
  pure logical function are_whole(n_statv, m, values, statev)
    integer, intent(in) :: n_statv, m
    real(wp), intent(in) :: values(n_values, m), statev(n_column(n_statv), m)
    integer(int64) :: bits(n_guard), whole
    integer :: i, c

    whole = bits_of(mark)
    bits = 0_int64
    associate (last => at_state(n_statv) + n_statv - 1)
      do i = 1, m
        !$omp simd
        do c = 1, n_guard
          bits(c) = ior(bits(c), ior(ieor(bits_of(values(after_stress - 1 + c, i)), whole), &
                                     ieor(bits_of(values(after_tangent - 1 + c, i)), whole)))
          bits(c) = ior(bits(c), ior(ieor(bits_of(statev(last + n_spare + c, i)), whole), &
                                     ior(bits_of(statev(last + c, i)), &
                                         ior(bits_of(statev(last + n_guard + c, i)), &
                                             bits_of(statev(last + 2*n_guard + c, i))))))
        end do
      end do
    end associate
    are_whole = all(bits == 0_int64)

  contains

    elemental integer(int64) function bits_of(value)
      real(wp), intent(in) :: value

      bits_of = transfer(value, 0_int64)
    end function bits_of
  end function are_whole

  !> End the run with the name of the argument past whose end was written.
  subroutine find_overrun(self, values, statev)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: values(n_values), statev(n_column(self%n_statv))
    character(:), allocatable :: hint

    hint = ""
    if (self%is_plane) hint = ", which has NTENS = 3 in plane stress ("//space_words//"),"
    call check_guard(values(after_stress), 0, 0, "STRESS"//hint)
    call check_guard(values(after_tangent), 0, 0, "DDSDDE"//hint)
    associate (at => at_state(self%n_statv), n => self%n_statv)
      call check_guard(statev(at), n, n_spare, "STATEV")
      call check_spare_states(statev(at + n), 1, n_spare, n, "STATEV(")
    end associate
  end subroutine find_overrun

  !> The diagonal of DDSDDE; of the form for shells those of 11, 22 and 12 stand for all.
  pure function diagonal_of(self, values) result(diagonal)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: values(n_values)          ! as `call_umat` returns it
    real(wp) :: diagonal(6)

    associate (n => self%n_tens)
      diagonal(:n) = values(after_tangent - n**2:after_tangent - 1:n + 1)
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
    real(wp) :: values(n_values, 1 + room_columns)
    real(wp) :: statev(n_column(self%n_statv) + n_room)
    type(increment_t) :: increment
    logical :: is_refused, ok

    call set_first(self, dt, point, state, increment, values, statev)
    if (self%is_plane) values(at_dstrain + 2, 1) = little
    call enter_user_call(in_umat, increment%element, increment%point, increment%element)
    call call_and_check(self, increment, values, statev, is_refused)
    ok = has_result(self, values(1, 1), statev)
    associate (direct => values(after_stress - 3:after_stress - 2, 1), &
               shear => values(after_stress - 1, 1))
      if (self%is_plane .and. any(abs(direct) > much*abs(shear))) &
        call end_user_run("returns direct stress for shear alone in plane stress: "//space_words)
    end associate
    call leave_user_call()
    is_finite = ok .and. all(ieee_is_finite( &
      values(after_tangent - self%n_tens**2:after_tangent - 1, 1)))
    stiffness = diagonal_of(self, values)
  end subroutine stiffness_at_start

  !> Three increments of growing strain from the start, with deformation gradients and without.
  logical function differs_without_gradients(self, dt, point, state)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: dt, state(:)
    type(first_point_t), intent(in) :: point
    real(wp), parameter :: sizes(3) = [1.0e-8_wp, 1.0e-4_wp, 1.0e-2_wp], rounding = 1.0e-12_wp
    real(wp), parameter :: way(6) = [1.0_wp, -0.5_wp, -0.4_wp, 0.2_wp, 0.1_wp, 0.3_wp]
    real(wp) :: values(n_values, 1 + room_columns)
    real(wp) :: statev(n_column(self%n_statv) + n_room)
    real(wp) :: results(self%n_tens + self%n_statv, 2)
    type(increment_t) :: increment
    logical :: is_refused, ok
    integer :: k, i

    do k = 1, 2
      call set_first(self, dt, point, state, increment, values, statev)
      do i = 1, size(sizes)
        increment%number = int(i + 1, c_int)   ! DDSDDE is looked at in the first of a run
        values(at_dstrain:at_dstrain + 5, 1) = sizes(i)*way
        if (self%is_plane) values(at_dstrain:at_dstrain + 5, 1) = sizes(i)*[way(in_sheet), &
                                                                           0.0_wp, 0.0_wp, 0.0_wp]
        call stretch(sizes(i)*way, values)
        if (k == 2) call forget_gradients(1, values)
        call enter_user_call(in_umat, increment%element, increment%point, increment%element)
        call call_and_check(self, increment, values, statev, is_refused)
        call add_strain(values)
        ok = has_result(self, values(1, 1), statev)
        if (is_refused .or. .not. ok) exit
      end do
      associate (n => self%n_statv, at => at_state(self%n_statv))
        results(:, k) = [values(after_stress - self%n_tens:after_stress - 1, 1), &
                         statev(at:at + n - 1)]
      end associate
    end do
    call leave_user_call()
    differs_without_gradients = .not. all(abs(results(:, 2) - results(:, 1)) &
                                           <= rounding*abs(results(:, 1)))
  end function differs_without_gradients

  !> The deformation gradients of an increment without rotation that follows.
  pure subroutine stretch(e, values)
    real(wp), intent(in) :: e(6)
    real(wp), intent(inout) :: values(n_values)
    real(wp) :: growth(3, 3)

    associate (f0 => values(at_f0:at_f0 + 8), f1 => values(at_f1:at_f1 + 8))
      growth = identity + reshape([e(1), 0.5_wp*e(4), 0.5_wp*e(5), 0.5_wp*e(4), e(2), &
                                   0.5_wp*e(6), 0.5_wp*e(5), 0.5_wp*e(6), e(3)], [3, 3])
      f0 = f1
      f1 = reshape(matmul(growth, reshape(f0, [3, 3])), [9])
    end associate
  end subroutine stretch

  !> An increment without strain at the start.
  subroutine set_first(self, dt, point, state, increment, values, statev)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: dt, state(:)
    type(first_point_t), intent(in) :: point
    type(increment_t), intent(out) :: increment
    real(wp), intent(out) :: values(n_values)
    real(wp), intent(inout) :: statev(n_column(self%n_statv))

    call start_increment(self, increment)
    increment%element = int(point%element, c_int)
    increment%point = int(point%point, c_int)
    increment%number = 1
    increment%dt = dt
    if (point%n_fields > 0) call set_fields(point%fields(:point%n_fields), &
                                            point%fields(:point%n_fields), increment)
    values = 0.0_wp
    values(at_rotation:at_rotation + 8) = reshape(identity, [9])
    values(at_f0:at_f0 + 8) = reshape(identity, [9])
    values(at_f1:at_f1 + 8) = reshape(identity, [9])
    values(at_place:at_place + 2) = point%place
    values(at_length) = point%length
    call set_marks(self%n_statv, 1, values, statev)
    statev(at_state(self%n_statv):at_state(self%n_statv) + self%n_statv - 1) = state
  end subroutine set_first

end module umat_adapter
