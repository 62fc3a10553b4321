!> A VUMAT of a user as a block law, called for blocks: one integration point of many elements. It
!! works in the co-rotational frame that rotates with R of F = R U (Green and Naghdi); stress in and
!! out of this adapter is in the fixed frame.
!!
!! Its own state variables are followed by its two energies per mass and by the rotation R, as a
!! quaternion less that of no rotation (see `tensor_rotation`).
module vumat_adapter
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t
  use kinds, only: wp
  use point_context, only: point_context_t, new_point_context, number_in_plane, number_through
  use tensor_rotation, only: rotate_axes, rotate_tensors, transposed
  use user_call, only: vumat_procedure, name_length, user_law_t, first_point_t, set_user_law, &
                       slack, most_fields, n_guard, n_room, set_guard, check_guard, &
                       check_spare_states, enter_user_call, leave_user_call, note_failure, &
                       in_vumat, end_user_run, space_words
  use plane_stress, only: in_sheet
  use user_sheet, only: with_zeros, about_normal
  use user_fields, only: define_block_fields, update_output
  use user_kinematics, only: polar_rotations, rotations_of_quaternions, spins_between, &
                             determinants, of_row
  implicit none
  private

  public :: new_vumat_adapter

  integer, parameter :: n_energies = 2
  integer, parameter, public :: n_kept = n_energies + 4   !! values kept after the state variables

  integer, parameter :: least_block = 64   ! elements of a call, where there are as many

  integer, parameter :: n_spare = 8        ! zeros after the state variables of each, see `slack`

  !> Where arguments of a call begin among the columns of one array. Tensors are 11, 22, 33, 12, 23,
  !! 31 with tensor shear, gradients 11, 22, 33, 12, 23, 31, 21, 32, 13.
  integer, parameter :: at_density = 1, at_length = 2, at_place = 3, at_strain = 6, at_spin = 12, &
                        at_stretch_old = 15, at_stretch_new = 21, at_gradient_old = 27, &
                        at_gradient_new = 36, at_stress_old = 45, at_temperature_old = 51, &
                        at_temperature_new = 52, at_fields = 53

  !> A VUMAT with its name and constants; the moduli of the base type are for the stable increment.
  type, extends(user_law_t), public :: vumat_adapter_t
    procedure(vumat_procedure), pointer, nopass :: vumat => null()
  contains
    procedure :: update_in_context
    procedure :: update_in_axes
    procedure :: stiffness_at_start
  end type vumat_adapter_t

  !> The numbers of a call.
  type :: call_t
    integer :: n = 0                           !! elements
    integer :: n_fields = 0                    !! field variables
    integer :: point = 1, layer = 1            !! of the layer, and that
    real(wp) :: step_time = 0.0_wp, total_time = 0.0_wp, dt = 0.0_wp
  end type call_t

contains

  !> Law from a VUMAT, its name, its constants and the number of its state variables.
  function new_vumat_adapter(vumat, name, density, props, n_statv, is_plane) result(law)
    procedure(vumat_procedure) :: vumat
    character(*), intent(in) :: name                 !! CMNAME
    real(wp), intent(in) :: density, props(:)
    integer, intent(in) :: n_statv                   !! NSTATEV
    logical, intent(in), optional :: is_plane        !! in its form for shells
    type(vumat_adapter_t) :: law

    call set_user_law(law, name, density, props, n_statv, n_kept)
    law%is_rotating = .true.
    law%n_together = least_block
    law%stiffness_source = "the stress of small strains at time 0"
    law%vumat => vumat
    if (present(is_plane)) law%is_plane = is_plane
    if (law%is_plane) law%n_shear = 1
  end function new_vumat_adapter

  !> Stresses of a point in a call.
  pure integer function n_tensor(self)
    class(vumat_adapter_t), intent(in) :: self

    n_tensor = self%n_direct + self%n_shear
  end function n_tensor

  !> One call of the VUMAT for each integration point; lanes that repeat an element are left alone.
  !! Fails where stress or state are not finite.
  subroutine update_in_context(self, context, dt, dstrain, stress, state, ok, spin)
    class(vumat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 6)
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n, 3)
    real(wp) :: unused(context%n)

    call update_all(self, context, dt, dstrain, stress, state, unused, ok, spin)
  end subroutine update_in_context

  !> The form for shells, which returns the strain 33.
  subroutine update_in_axes(self, context, dt, dstrain, stress, state, through, ok, spin)
    class(vumat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 3)
    real(wp), intent(inout) :: stress(context%n, 3), state(context%n, self%n_state)
    real(wp), intent(out) :: through(context%n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n)
    real(wp) :: tensors(context%n, 6)

    tensors = with_zeros(context%n, stress)
    through = 0.0_wp
    call update_all(self, context, dt, with_zeros(context%n, dstrain), tensors, state, through, &
                    ok, about_normal(context%n, spin))
    stress = tensors(:, in_sheet)
  end subroutine update_in_axes

  !> The calls for all integration points. In plane stress they return the strain 33.
  subroutine update_all(self, context, dt, dstrain, stress, state, through, ok, spin)
    class(vumat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 6)
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    real(wp), intent(inout) :: through(context%n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n, 3)
    real(wp) :: old(context%n*(self%n_statv + n_spare)), new(size_of_new(self, context%n))
    integer :: lanes(context%n), first, last, n, n_ready, n_lanes

    ok = .true.
    n_ready = 0
    first = 1
    do while (first <= context%n .and. ok)
      n = 0
      do last = first, context%n
        if (context%point(last) /= context%point(first)) exit
        if (.not. context%is_owner(last)) cycle
        n = n + 1
        lanes(n) = last
      end do
      n_lanes = last - first
      if (n > 0) then
        if (n /= n_ready) call set_room(self, n, old, new)
        n_ready = n
        call update_block(self, context, lanes(:n), dt, dstrain, spin, old, new, stress, state, &
                          through, ok)
      end if
      first = first + n_lanes
    end do
  end subroutine update_all

  !> The lanes, which are one integration point of different elements.
  subroutine update_block(self, context, lanes, dt, dstrain, spin, old, new, stress, state, &
                          through, ok)
    class(vumat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: lanes(:)
    real(wp), intent(in) :: dt, dstrain(context%n, 6), spin(context%n, 3)
    real(wp), intent(inout) :: old(*), new(*)       !! from `set_room`
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    real(wp), intent(inout) :: through(context%n)
    logical, intent(out) :: ok
    type(call_t) :: numbers
    real(wp) :: given(size(lanes), n_columns(context%n_fields)), own(size(lanes), self%n_state)
    real(wp) :: stress_new(size(lanes), 6), work(size(lanes)), r_new(size(lanes), 9)
    integer :: i, n

    n = size(lanes)
    numbers = call_t(n, max(self%n_own_fields, context%n_fields - 1), &
                     number_in_plane(context, lanes(1)), number_through(context, lanes(1)), &
                     context%step_time + dt, context%time + dt, dt)
    call pick(lanes, context%n, self%n_state, state, own)
    call pick(lanes, context%n, 6, stress, given(:, at_stress_old:))
    call pick(lanes, context%n, 6, dstrain, given(:, at_strain:))
    call pick(lanes, context%n, 3, spin, given(:, at_spin:))
    call pick(lanes, context%n, 3, context%place, given(:, at_place:))
    do i = 1, 9
      call pick(lanes, context%n, 1, context%f0(:, i), given(:, at_gradient_old + of_row(i) - 1:))
      call pick(lanes, context%n, 1, context%f1(:, i), given(:, at_gradient_new + of_row(i) - 1:))
    end do
    associate (energies => own(:, self%n_before + 1:self%n_before + n_energies), &
               axes => own(:, self%n_before + n_energies + 1:self%n_before + n_kept))
      call set_given(self, context, lanes, own, given)
      call set_kinematics(self%density, n, axes, given, r_new)
      if (associated(self%vusdfld)) &
        call define_block_fields(self, context, lanes, dt, r_new, given(:, at_stress_old:), own, &
                                 given(:, at_fields:))
      work = energies(:, 2)
      call call_vumat(self, numbers, context%element(lanes), given, old, new, own, stress_new, ok)
      if (self%heat_state > 0) own(:, self%heat_state) = own(:, self%heat_state) &
        + self%heat_per_work*self%density*(energies(:, 2) - work)
    end associate
    if (.not. ok) then
      do i = 1, n
        if (.not. (all(ieee_is_finite(stress_new(i, :))) .and. &
                   all(ieee_is_finite(own(i, :self%n_statv))))) &
          call note_failure(int(context%element(lanes(i)), c_int), &
                            int(context%point(lanes(i)), c_int), 1_c_int)
      end do
    end if
    if (self%is_plane) through(lanes) = given(:, at_strain + 2)
    call rotate_tensors(n, r_new, stress_new)
    call put_back(lanes, context%n, 6, stress_new, stress)
    call put_back(lanes, context%n, self%n_state, own, state)
    if (ok .and. associated(self%uvarm)) then
      do i = 1, n
        call update_output(self, context, lanes(i), dt, stress(lanes(i), :), state(lanes(i), :))
      end do
    end if
  end subroutine update_block

  !> The values of some lanes, which mostly follow each other.
  pure subroutine pick(lanes, n_all, n_values, all_lanes, picked)
    integer, intent(in) :: lanes(:), n_all, n_values
    real(wp), intent(in) :: all_lanes(n_all, n_values)
    real(wp), intent(inout) :: picked(size(lanes), n_values)
    integer :: c, first, last

    first = lanes(1)
    last = lanes(size(lanes))
    do c = 1, n_values
      if (last - first + 1 == size(lanes)) then
        picked(:, c) = all_lanes(first:last, c)
      else
        picked(:, c) = all_lanes(lanes, c)
      end if
    end do
  end subroutine pick

  !> The reverse of `pick`.
  pure subroutine put_back(lanes, n_all, n_values, picked, all_lanes)
    integer, intent(in) :: lanes(:), n_all, n_values
    real(wp), intent(in) :: picked(size(lanes), n_values)
    real(wp), intent(inout) :: all_lanes(n_all, n_values)
    integer :: c, first, last

    first = lanes(1)
    last = lanes(size(lanes))
    do c = 1, n_values
      if (last - first + 1 == size(lanes)) then
        all_lanes(first:last, c) = picked(:, c)
      else
        all_lanes(lanes, c) = picked(:, c)
      end if
    end do
  end subroutine put_back

  !> Columns of the arguments of a call, with one at least for the field variables of each end.
  pure integer function n_columns(n_fields)
    integer, intent(in) :: n_fields                !! with the temperature

    n_columns = at_fields - 1 + 2*max(1, n_fields - 1)
  end function n_columns

  !> Size, temperature and field variables of the elements of a block.
  pure subroutine set_given(self, context, lanes, own, given)
    class(vumat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: lanes(:)
    real(wp), intent(in) :: own(:, :)              !! state
    real(wp), intent(inout) :: given(:, :)

    given(:, at_length) = context%length(lanes)
    given(:, at_temperature_old) = self%start_temperature
    given(:, at_temperature_new) = self%start_temperature
    given(:, at_fields:) = 0.0_wp
    associate (n => context%n_fields)
      if (n > 0) then
        given(:, at_temperature_old) = context%fields(lanes, 1)
        given(:, at_temperature_new) = context%fields(lanes, n + 1)
        given(:, at_fields:at_fields + n - 2) = context%fields(lanes, 2:n)
        given(:, at_fields + n - 1:at_fields + 2*n - 3) = context%fields(lanes, n + 2:)
      end if
    end associate
    if (self%heat_state == 0) return
    given(:, at_temperature_old) = given(:, at_temperature_old) + own(:, self%heat_state)
    given(:, at_temperature_new) = given(:, at_temperature_new) + own(:, self%heat_state)
  end subroutine set_given

  !> Kinematics of a block from its gradients, strain increments (engineering shear) and spins, and
  !! its stress turned into the frame of the start. The strain increment is rotated to the frame
  !! halfway; the relative spin is the axial vector of W - dR/dt R^T, in the same frame.
  pure subroutine set_kinematics(density, n, axes, given, r_new)
    real(wp), intent(in) :: density                !! at the start of all
    integer, intent(in) :: n
    real(wp), intent(inout) :: axes(n, 4)          !! rotation, carried to the end
    real(wp), intent(inout) :: given(n, *)         !! tensors as 11, 22, 33, 12, 13, 23 before
    real(wp), intent(out) :: r_new(n, 9)
    real(wp) :: r(n, 9), middle(n, 4), whole(n, 3), half(n, 3), a1, a2, a3
    integer :: l

    call rotations_of_quaternions(n, axes, r)
    call polar_rotations(n, given(1, at_gradient_new), r_new)
    call spins_between(n, r, r_new, whole, half)
    call set_stretch(n, r, given(1, at_gradient_old), given(1, at_stretch_old))
    call set_stretch(n, r_new, given(1, at_gradient_new), given(1, at_stretch_new))
    call rotate_tensors(n, transposed(n, r), given(1, at_stress_old))
    call swap_shear(n, given(1, at_stress_old))
    middle = axes
    call rotate_axes(n, half, middle)
    call rotate_axes(n, whole, axes)
    call rotations_of_quaternions(n, middle, r)
    given(:, at_strain + 3:at_strain + 5) = 0.5_wp*given(:, at_strain + 3:at_strain + 5)
    call rotate_tensors(n, transposed(n, r), given(1, at_strain))
    call swap_shear(n, given(1, at_strain))
    call determinants(n, given(1, at_gradient_new), given(1, at_density))
    !$omp simd private(a1, a2, a3)
    do l = 1, n
      a1 = whole(l, 3) - given(l, at_spin + 2)
      a2 = given(l, at_spin + 1) - whole(l, 2)
      a3 = whole(l, 1) - given(l, at_spin)
      given(l, at_spin) = r(l, 1)*a1 + r(l, 4)*a2 + r(l, 7)*a3
      given(l, at_spin + 1) = r(l, 2)*a1 + r(l, 5)*a2 + r(l, 8)*a3
      given(l, at_spin + 2) = r(l, 3)*a1 + r(l, 6)*a2 + r(l, 9)*a3
      given(l, at_density) = density/given(l, at_density)
    end do
  end subroutine set_kinematics

  !> From 11, 22, 33, 12, 13, 23 to 11, 22, 33, 12, 23, 31 and back.
  pure subroutine swap_shear(n, tensor)
    integer, intent(in) :: n
    real(wp), intent(inout) :: tensor(n, 6)
    real(wp) :: fifth(n)

    fifth = tensor(:, 5)
    tensor(:, 5) = tensor(:, 6)
    tensor(:, 6) = fifth
  end subroutine swap_shear

  !> U = R^T F, as a call has it.
  pure subroutine set_stretch(n, r, f, stretch)
    integer, intent(in) :: n
    real(wp), intent(in) :: r(n, 9)                !! row by row
    real(wp), intent(in) :: f(n, 9)                !! as a call has it
    real(wp), intent(out) :: stretch(n, 6)
    integer :: l

    !$omp simd
    do l = 1, n
      stretch(l, 1) = r(l, 1)*f(l, 1) + r(l, 4)*f(l, 7) + r(l, 7)*f(l, 6)
      stretch(l, 2) = r(l, 2)*f(l, 4) + r(l, 5)*f(l, 2) + r(l, 8)*f(l, 8)
      stretch(l, 3) = r(l, 3)*f(l, 9) + r(l, 6)*f(l, 5) + r(l, 9)*f(l, 3)
      stretch(l, 4) = r(l, 1)*f(l, 4) + r(l, 4)*f(l, 2) + r(l, 7)*f(l, 8)
      stretch(l, 5) = r(l, 2)*f(l, 9) + r(l, 5)*f(l, 5) + r(l, 8)*f(l, 3)
      stretch(l, 6) = r(l, 3)*f(l, 1) + r(l, 6)*f(l, 7) + r(l, 9)*f(l, 6)
    end do
  end subroutine set_stretch

  !> Values that the subroutine returns: stress and state with marks after each.
  pure integer function size_of_new(self, n)
    class(vumat_adapter_t), intent(in) :: self
    integer, intent(in) :: n                       !! elements

    size_of_new = n*(n_tensor(self) + self%n_statv + n_spare) + 2*n_guard + n_room
  end function size_of_new

  !> Zeros after the state variables, and the marks. Calls leave them as they are or end the run.
  pure subroutine set_room(self, n, old, new)
    class(vumat_adapter_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(inout) :: old(n, self%n_statv + n_spare), new(size_of_new(self, n))

    old(:, self%n_statv + 1:) = 0.0_wp
    call set_guard(new, n_tensor(self)*n, 0)
    call set_guard(new(n_tensor(self)*n + n_guard + 1), self%n_statv*n, n_spare*n)
  end subroutine set_room

  !> The VUMAT itself. State and energies go in and out, the stress comes out.
  subroutine call_vumat(self, numbers, elements, given, old, new, own, stress, ok)
    class(vumat_adapter_t), intent(in) :: self
    type(call_t), intent(in) :: numbers
    integer, intent(in) :: elements(numbers%n)
    real(wp), intent(inout) :: given(numbers%n, n_columns(numbers%n_fields + 1))
    real(wp), intent(inout) :: old(numbers%n, self%n_statv + n_spare)       ! from `set_room`
    real(wp), intent(inout) :: new(size_of_new(self, numbers%n))          ! from `set_room`
    real(wp), intent(inout) :: own(numbers%n, self%n_state)
    real(wp), intent(out) :: stress(numbers%n, 6)                         ! 11, 22, 33, 12, 13, 23
    logical, intent(out) :: ok
    integer(c_int) :: jblock(numbers%n + 4), jinfo(numbers%n + 6)
    real(wp) :: dt_array(2*numbers%n + 1)
    ! Some sources index the energies by a variable that they never set.
    real(wp), dimension(1 - slack:numbers%n + slack, n_energies) :: energy_old, energy_new
    integer :: n_stress, first_state, at_axial, c

    associate (n => numbers%n, m => self%n_statv)
      n_stress = n_tensor(self)*n
      first_state = n_stress + n_guard + 1
      at_axial = at_spin
      if (self%is_plane) call take_plane(n, given, at_axial)
      ! (1) points, (2) integration point, (3) layer, (4) section point, then the elements.
      jblock = [n, numbers%point, 1, numbers%layer, elements]
      ! (1) LANNEAL, (2) integration point, (3) layer, (4) section point, (5) 0, then the elements.
      jinfo = [0, numbers%point, 1, numbers%layer, 0, elements, 0]
      dt_array = numbers%dt
      old(:, :m) = own(:, :m)
      energy_old = 0.0_wp
      energy_old(1:n, :) = own(:, self%n_before + 1:self%n_before + n_energies)
      energy_new = 0.0_wp
      new(:n_stress) = 0.0_wp
      new(first_state:first_state + m*n - 1) = 0.0_wp
      call enter_user_call(in_vumat, int(minval(elements), c_int), jblock(2), &
                           int(maxval(elements), c_int))
      call self%vumat(jblock, int(self%n_direct, c_int), int(self%n_shear, c_int), &
                      int(m, c_int), int(numbers%n_fields, c_int), &
                      int(self%n_props, c_int), jinfo, &
                      numbers%step_time, numbers%total_time, dt_array, self%name, &
                      given(1, at_place), given(1, at_length), self%props, given(1, at_density), &
                      given(1, at_strain), given(1, at_axial), given(1, at_temperature_old), &
                      given(1, at_stretch_old), given(1, at_gradient_old), &
                      given(1, at_fields), given(1, at_stress_old), old, energy_old(1, 1), &
                      energy_old(1, 2), given(1, at_temperature_new), &
                      given(1, at_stretch_new), given(1, at_gradient_new), &
                      given(1, at_fields + max(1, numbers%n_fields)), new, new(first_state), &
                      energy_new(1, 1), energy_new(1, 2), int(name_length, c_size_t))
      call check_stress(self, n, new)
      call check_guard(new(first_state), m*n, n_spare*n, "stateNew")
      call check_spare_states(new(first_state + m*n), n, n_spare, m, "stateNew(:,")
      call check_guard(self%props, self%n_props, slack, "PROPS (here or in another thread)")
      call leave_user_call()   ! memory not available from here on is not the user's error
      stress = reshape(new(:n_stress), [n, 6], pad=[0.0_wp])
      call swap_shear(n, stress)
      do c = 1, m
        own(:, c) = new(first_state + (c - 1)*n:first_state + c*n - 1)
      end do
      own(:, self%n_before + 1:self%n_before + n_energies) = energy_new(1:n, :)
      ! Of a finite sum all parts are finite.
      ok = sum(abs(stress)) + sum(abs(own(:, :m))) <= huge(1.0_wp)
      if (.not. ok) ok = all(ieee_is_finite(stress)) .and. all(ieee_is_finite(own(:, :m)))
    end associate
  end subroutine call_vumat

  !> From the arguments of a solid to those of plane stress: the gradients in the order 11, 22, 33,
  !! 12, 21, and no strain 33; and where the relative spin begins, which has one component.
  pure subroutine take_plane(n, given, at_axial)
    integer, intent(in) :: n
    real(wp), intent(inout) :: given(n, *)
    integer, intent(out) :: at_axial

    at_axial = at_spin + 2
    given(:, at_strain + 2) = 0.0_wp
    given(:, at_gradient_old + 4) = given(:, at_gradient_old + 6)
    given(:, at_gradient_new + 4) = given(:, at_gradient_new + 6)
  end subroutine take_plane

  !> End the run where stresses were written past their end, or where those of plane stress are not:
  !! of a law for solids.
  subroutine check_stress(self, n, new)
    class(vumat_adapter_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: new(n, *)
    real(wp), parameter :: small = 1.0e-6_wp

    if (.not. self%is_plane) then
      call check_guard(new, 6*n, 0, "stressNew")
      return
    end if
    call check_guard(new, 4*n, 0, "stressNew, which has four components in plane stress ("// &
                     space_words//"),")
    if (maxval(abs(new(:, 3))) > small*maxval(abs(new(:, :4)))) &
      call end_user_run("returns a stress 33 in plane stress: "//space_words)
  end subroutine check_stress

  !> The call before the run that Abaqus makes, too: time 0, one small strain for each component; in
  !! plane stress 11, 22 and 12 stand for the others.
  subroutine stiffness_at_start(self, dt, point, state, stiffness, is_finite)
    class(vumat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: dt, state(:)
    type(first_point_t), intent(in) :: point
    real(wp), intent(out) :: stiffness(6)
    logical, intent(out) :: is_finite
    integer, parameter :: n = 6
    real(wp), parameter :: strain = 1.0e-8_wp
    ! Of each component in a gradient.
    integer, parameter :: places(2, n) = reshape([1, 1, 2, 2, 3, 3, 4, 7, 9, 6, 5, 8], [2, n])
    integer :: components(n)
    type(point_context_t) :: context
    real(wp) :: given(n, n_columns(point%n_fields)), own(n, self%n_state), stress(n, 6), r(n, 9)
    real(wp) :: old(n, self%n_statv + n_spare), new(size_of_new(self, n))
    integer :: i

    context = new_point_context(n, point%n_fields)
    context%length = point%length
    own = 0.0_wp
    own(:, :self%n_statv) = spread(state, 1, n)
    given = 0.0_wp
    components = [1, 2, 3, 4, 5, 6]
    if (self%is_plane) components = [1, 2, 1, 4, 4, 4]
    do i = 1, n
      context%fields(i, :) = [point%fields(:point%n_fields), point%fields(:point%n_fields)]
      given(i, at_place:at_place + 2) = point%place
      given(i, at_strain + components(i) - 1) = strain*merge(1.0_wp, 2.0_wp, i <= 3)
      given(i, at_gradient_old:at_gradient_old + 2) = 1.0_wp
      associate (f => given(i, at_gradient_new:at_gradient_new + 8))
        f(:3) = 1.0_wp
        f(places(1, components(i))) = merge(1.0_wp, 0.0_wp, i <= 3) + strain
        f(places(2, components(i))) = f(places(1, components(i)))
      end associate
    end do
    call set_given(self, context, [(i, i=1, n)], own, given)
    call set_kinematics(self%density, n, &
                        own(:, self%n_before + n_energies + 1:self%n_before + n_kept), given, r)
    call set_room(self, n, old, new)
    call call_vumat(self, call_t(n, max(self%n_own_fields, point%n_fields - 1), point%point, &
                                 dt=dt), &
                    spread(point%element, 1, n), given, old, new, own, stress, is_finite)
    stiffness = [(stress(i, components(i))/strain, i=1, n)]
    stiffness(4:) = 0.5_wp*stiffness(4:)   ! to engineering strain
  end subroutine stiffness_at_start
end module vumat_adapter
