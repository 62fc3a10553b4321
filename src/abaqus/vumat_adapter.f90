!> A VUMAT of a user as a block law, called for blocks: one integration point of the elements
!! of a row. It works in the co-rotational frame that rotates with R of F = R U (Green
!! and Naghdi); stress in and out of this adapter is in the fixed frame.
!!
!! Its own state variables are followed by its two energies per mass.
module vumat_adapter
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t
  use kinds, only: wp
  use point_context, only: point_context_t
  use user_call, only: vumat_procedure, name_length, user_law_t, first_point_t, set_user_law, &
                       slack, most_fields, n_guard, n_room, set_guard, check_guard, &
                       check_spare_states, enter_user_call, leave_user_call, note_failure, &
                       in_vumat
  use user_kinematics, only: polar_rotation, full_stress, packed_stress, identity, determinant
  implicit none
  private

  public :: new_vumat_adapter

  integer, parameter, public :: n_kept = 2   !! values kept after the state variables

  !> A VUMAT with its name and constants; the moduli of the base type are for the stable increment.
  type, extends(user_law_t), public :: vumat_adapter_t
    procedure(vumat_procedure), pointer, nopass :: vumat => null()
  contains
    procedure :: update_in_context
    procedure :: stiffness_at_start
  end type vumat_adapter_t

  !> One block as the VUMAT sees it; tensors 11, 22, 33, 12, 23, 31 with tensor shear, gradients
  !! 11, 22, 33, 12, 23, 31, 21, 32, 13. There are zeros after the state variables.
  type :: block_t
    integer :: n = 0
    real(wp) :: step_time = 0.0_wp, total_time = 0.0_wp, dt = 0.0_wp
    integer, allocatable :: jblock(:), jinfo(:)
    integer :: n_fields = 0                    !! of them one is the temperature
    real(wp), allocatable, dimension(:) :: density, length, dt_array, temperature_old, &
                                           temperature_new, field_old, field_new
    real(wp), allocatable, dimension(:, :) :: place, strain, spin, stretch_old, stretch_new, &
                                              gradient_old, gradient_new, stress_old, &
                                              stress_new, state_old, state_new, energy_old, &
                                              energy_new
  end type block_t

contains

  !> Law from a VUMAT, its name, its constants and the number of its state variables.
  function new_vumat_adapter(vumat, name, density, props, n_statv) result(law)
    procedure(vumat_procedure) :: vumat
    character(*), intent(in) :: name                 !! CMNAME
    real(wp), intent(in) :: density, props(:)
    integer, intent(in) :: n_statv                   !! NSTATEV
    type(vumat_adapter_t) :: law

    call set_user_law(law, name, density, props, n_statv, n_kept)
    law%is_rotating = .true.
    law%stiffness_source = "the stress of small strains at time 0"
    law%vumat => vumat
  end function new_vumat_adapter

  !> One call of the VUMAT for each integration point of the row; lanes that repeat an element are
  !! left alone. Fails where stress or state are not finite.
  subroutine update_in_context(self, context, dt, dstrain, stress, state, ok, spin)
    class(vumat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 6)
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n, 3)
    integer :: first, last

    ok = .true.
    first = 1
    do while (first <= context%n .and. ok)
      last = first
      do while (last < context%n)
        if (context%point(last + 1) /= context%point(first)) exit
        last = last + 1
      end do
      call update_block(self, context, first, last, dt, dstrain, spin, stress, state, ok)
      first = last + 1
    end do
  end subroutine update_in_context

  !> The lanes `first` to `last`, which are one integration point of different elements.
  subroutine update_block(self, context, first, last, dt, dstrain, spin, stress, state, ok)
    class(vumat_adapter_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: first, last
    real(wp), intent(in) :: dt, dstrain(context%n, 6), spin(context%n, 3)
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    logical, intent(out) :: ok
    type(block_t) :: block
    integer, allocatable :: lanes(:)
    real(wp) :: f0(3, 3), f1(3, 3), r_old(3, 3), r_new(3, 3, last - first + 1)
    integer :: i, l

    ok = .true.
    lanes = pack([(l, l=first, last)], context%is_owner(first:last))
    if (size(lanes) == 0) return
    block = new_block(self, size(lanes), context%element(lanes), context%point(first), &
                      context%n_fields)
    block%step_time = context%step_time + dt
    block%total_time = context%time + dt
    block%dt = dt
    block%dt_array = dt
    do i = 1, size(lanes)
      l = lanes(i)
      f0 = transpose(reshape(context%f0(l, :), [3, 3]))
      f1 = transpose(reshape(context%f1(l, :), [3, 3]))
      r_old = polar_rotation(f0)
      r_new(:, :, i) = polar_rotation(f1)
      call set_kinematics(block, i, f0, f1, r_old, r_new(:, :, i), dstrain(l, :), spin(l, :))
      block%density(i) = self%density/determinant(f1)
      block%length(i) = context%length(l)
      block%place(i, :) = context%place(l, :)
      associate (n => context%n_fields)
        if (n > 0) call set_fields(block, i, context%fields(l, :n, context%row), &
                                   context%fields(l, n + 1:, context%row))
      end associate
      block%stress_old(i, :) = in_frame(r_old, stress(l, :))
      block%state_old(i, :self%n_statv) = state(l, :self%n_statv)
      block%energy_old(i, :) = state(l, self%n_statv + 1:self%n_statv + n_kept)
      if (self%heat_state > 0) then
        block%temperature_old(i) = block%temperature_old(i) + state(l, self%heat_state)
        block%temperature_new(i) = block%temperature_new(i) + state(l, self%heat_state)
      end if
    end do
    call call_vumat(self, block, ok)
    do i = 1, size(lanes)
      l = lanes(i)
      if (.not. (all(ieee_is_finite(block%stress_new(i, :6))) .and. &
                 all(ieee_is_finite(block%state_new(i, :self%n_statv))))) then
        call note_failure(int(context%element(l), c_int), int(context%point(l), c_int), 1_c_int)
      end if
      stress(l, :) = out_of_frame(r_new(:, :, i), block%stress_new(i, :6))
      state(l, :self%n_statv) = block%state_new(i, :self%n_statv)
      state(l, self%n_statv + 1:self%n_statv + n_kept) = block%energy_new(i, :)
      if (self%heat_state > 0) state(l, self%heat_state) = state(l, self%heat_state) &
        + self%heat_per_work*self%density*(block%energy_new(i, 2) - block%energy_old(i, 2))
    end do
  end subroutine update_block

  !> A block of n elements with all its values zero.
  function new_block(self, n, elements, point, n_fields) result(block)
    class(vumat_adapter_t), intent(in) :: self
    integer, intent(in) :: n, elements(n), point, n_fields
    type(block_t) :: block

    block%n = n
    block%n_fields = n_fields
    ! (1) points, (2) integration point, (3) layer, (4) section point, then the elements.
    block%jblock = [n, point, 1, 1, elements]
    ! (1) LANNEAL, (2) integration point, (3) layer, (4) section point, (5) 0, then the elements.
    block%jinfo = [0, point, 1, 1, 0, elements, 0]
    allocate (block%density(n), block%length(n), block%dt_array(2*n + 1), source=0.0_wp)
    allocate (block%place(n, 3), block%spin(n, 3), block%strain(n, 6), block%stretch_old(n, 6), &
              block%stretch_new(n, 6), block%stress_old(n, 6), &
              block%gradient_old(n, 9), block%gradient_new(n, 9), source=0.0_wp)
    allocate (block%temperature_old(n), block%temperature_new(n), &
              block%field_old(n*most_fields + slack), block%field_new(n*most_fields + slack), &
              source=0.0_wp)
    if (n_fields == 0) then
      block%temperature_old = self%start_temperature
      block%temperature_new = self%start_temperature
    end if
    ! Some sources index the energies by a variable that they never set.
    allocate (block%energy_old(1 - slack:n + slack, 2), &
              block%energy_new(1 - slack:n + slack, 2), source=0.0_wp)
    allocate (block%state_old(n, self%n_statv + slack), source=0.0_wp)
    associate (n_behind => n_guard + n_room/n)   ! columns with room for the mark and after it
      allocate (block%stress_new(n, 6 + n_behind), &
                block%state_new(n, self%n_statv + slack + n_behind))
    end associate
    block%stress_new(:, :6) = 0.0_wp
    block%state_new(:, :self%n_statv) = 0.0_wp
    call set_guard(block%stress_new, 6*n, 0)
    call set_guard(block%state_new, self%n_statv*n, slack*n)
  end function new_block

  !> Temperature and field variables of one element at both ends of the increment.
  pure subroutine set_fields(block, i, old, new)
    type(block_t), intent(inout) :: block
    integer, intent(in) :: i
    real(wp), intent(in) :: old(:), new(:)
    integer :: k

    block%temperature_old(i) = old(1)
    block%temperature_new(i) = new(1)
    do k = 2, size(old)
      block%field_old(i + block%n*(k - 2)) = old(k)
      block%field_new(i + block%n*(k - 2)) = new(k)
    end do
  end subroutine set_fields

  !> Kinematics of one element of a block. The strain increment is rotated to the frame halfway;
  !! the relative spin is the axial vector of W - dR/dt R^T, in the same frame.
  subroutine set_kinematics(block, i, f0, f1, r_old, r_new, dstrain, spin)
    type(block_t), intent(inout) :: block
    integer, intent(in) :: i
    real(wp), intent(in), dimension(3, 3) :: f0, f1, r_old, r_new
    real(wp), intent(in) :: dstrain(6), spin(3)
    real(wp) :: r_middle(3, 3), dr(3, 3), w(3, 3), rate(3)

    r_middle = polar_rotation(0.5_wp*(r_old + r_new))
    block%strain(i, :) = in_frame(r_middle, [dstrain(:3), 0.5_wp*dstrain(4:)])
    ! The spin increment of a rotation by the angle a is 2 tan(a/2), see `rotation_of_spin`; the
    ! antisymmetric part of the rotation is sin(a), and 1 + its trace is 4 cos(a/2)^2.
    dr = matmul(r_new, transpose(r_old))
    dr = 2.0_wp*(dr - transpose(dr))/(1.0_wp + dr(1, 1) + dr(2, 2) + dr(3, 3))
    w = 0.0_wp
    w(1, 2) = spin(1)
    w(1, 3) = spin(2)
    w(2, 3) = spin(3)
    w = w - transpose(w) - dr
    rate = [w(3, 2), w(1, 3), w(2, 1)]
    block%spin(i, :) = matmul(transpose(r_middle), rate)
    block%stretch_old(i, :) = explicit_order(matmul(transpose(r_old), f0))
    block%stretch_new(i, :) = explicit_order(matmul(transpose(r_new), f1))
    block%gradient_old(i, :) = [explicit_order(f0), f0(2, 1), f0(3, 2), f0(1, 3)]
    block%gradient_new(i, :) = [explicit_order(f1), f1(2, 1), f1(3, 2), f1(1, 3)]
  end subroutine set_kinematics

  !> The VUMAT itself.
  subroutine call_vumat(self, block, ok)
    class(vumat_adapter_t), intent(in) :: self
    type(block_t), intent(inout) :: block
    logical, intent(out) :: ok

    call enter_user_call(in_vumat, int(block%jblock(5), c_int), int(block%jblock(2), c_int), &
                         int(block%jblock(4 + block%n), c_int))
    call self%vumat(int(block%jblock, c_int), 3_c_int, 3_c_int, int(self%n_statv, c_int), &
                    int(max(0, block%n_fields - 1), c_int), &
                    int(self%n_props, c_int), int(block%jinfo, c_int), block%step_time, &
                    block%total_time, block%dt_array, self%name, block%place, block%length, &
                    self%props, block%density, block%strain, block%spin, block%temperature_old, &
                    block%stretch_old, block%gradient_old, block%field_old, block%stress_old, &
                    block%state_old, block%energy_old(1, 1), block%energy_old(1, 2), &
                    block%temperature_new, block%stretch_new, block%gradient_new, &
                    block%field_new, &
                    block%stress_new, block%state_new, block%energy_new(1, 1), &
                    block%energy_new(1, 2), int(name_length, c_size_t))
    call check_guard(block%stress_new, 6*block%n, 0, "stressNew")
    call check_guard(block%state_new, self%n_statv*block%n, slack*block%n, "stateNew")
    call check_spare_states(block%state_new(1, self%n_statv + 1), block%n, self%n_statv, &
                            "stateNew(:,")
    call check_guard(self%props, self%n_props, slack, "PROPS (here or in another thread)")
    call leave_user_call()   ! memory not available from here on is not the user's error
    ok = all(ieee_is_finite(block%stress_new(:, :6))) .and. &
         all(ieee_is_finite(block%state_new(:, :self%n_statv)))
  end subroutine call_vumat

  !> The call before the run that Abaqus makes, too: time 0, one small strain for each component.
  subroutine stiffness_at_start(self, dt, point, state, stiffness, is_finite)
    class(vumat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: dt, state(:)
    type(first_point_t), intent(in) :: point
    real(wp), intent(out) :: stiffness(6)
    logical, intent(out) :: is_finite
    real(wp), parameter :: strain = 1.0e-8_wp
    type(block_t) :: block
    real(wp) :: f(3, 3)
    integer :: i

    block = new_block(self, 6, spread(point%element, 1, 6), point%point, point%n_fields)
    block%dt = dt
    block%dt_array = dt
    block%density = self%density
    block%length = point%length
    do i = 1, 6
      block%place(i, :) = point%place
      if (point%n_fields > 0) call set_fields(block, i, point%fields(:point%n_fields), &
                                              point%fields(:point%n_fields))
      block%strain(i, i) = strain
      f = identity + full_stress([block%strain(i, :4), block%strain(i, 6), block%strain(i, 5)])
      block%stretch_old(i, :) = explicit_order(identity)
      block%stretch_new(i, :) = explicit_order(f)
      block%gradient_old(i, :) = [explicit_order(identity), 0.0_wp, 0.0_wp, 0.0_wp]
      block%gradient_new(i, :) = [explicit_order(f), f(2, 1), f(3, 2), f(1, 3)]
      block%state_old(i, :self%n_statv) = state
    end do
    call call_vumat(self, block, is_finite)
    stiffness = [(block%stress_new(i, i)/strain, i=1, 6)]
    stiffness(4:) = 0.5_wp*stiffness([4, 6, 5])   ! to engineering strain and 12, 13, 23
  end subroutine stiffness_at_start

  !> A tensor (11, 22, 33, 12, 13, 23) in the frame of R, in the order of the VUMAT.
  pure function in_frame(r, s) result(rotated)
    real(wp), intent(in) :: r(3, 3), s(6)
    real(wp) :: rotated(6)

    rotated = explicit_order(matmul(transpose(r), matmul(full_stress(s), r)))
  end function in_frame

  !> The reverse of `in_frame`.
  pure function out_of_frame(r, s) result(rotated)
    real(wp), intent(in) :: r(3, 3), s(6)
    real(wp) :: rotated(6)

    rotated = packed_stress(matmul(r, matmul(full_stress([s(:4), s(6), s(5)]), transpose(r))))
  end function out_of_frame

  !> The values 11, 22, 33, 12, 23, 31 of a matrix.
  pure function explicit_order(a) result(s)
    real(wp), intent(in) :: a(3, 3)
    real(wp) :: s(6)

    s = [a(1, 1), a(2, 2), a(3, 3), a(1, 2), a(2, 3), a(3, 1)]
  end function explicit_order

end module vumat_adapter
