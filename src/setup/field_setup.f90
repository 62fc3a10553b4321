!> Temperature and field variables of the scene, for laws that ask for them: those of the start in
!! the points of the blank, those of the run as effects of the model.
module field_setup
  use kinds, only: wp
  use scene, only: scene_t, field_spec_t
  use nurbs_solid, only: nurbs_solid_t
  use block_law, only: block_law_t
  use user_call, only: user_law_t
  use motion_curve, only: constant_curve
  use set_members, only: members_t, find_members
  use support_setup, only: curve_of
  use blank, only: blank_t
  use effect, only: effect_slot_t
  use field_change, only: field_change_t
  use model, only: model_t
  implicit none
  private

  public :: set_initial_fields, add_field_changes

  !> Number of the entry of the scene that holds each variable of the control points of a patch.
  type :: holder_t
    integer, allocatable :: entry(:, :, :, :)   ! shape (n1, n2, n3, n_fields), 0: none
  end type holder_t

contains

  !> Give all points the fields of the start. Where entries meet, the last one holds.
  subroutine set_initial_fields(scene, blank)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(inout) :: blank
    type(holder_t), allocatable :: holders(:)
    integer :: p, v, i, j, k, n

    n = n_fields_of(scene)
    if (n == 0 .or. .not. blank%law%needs_context) return
    do p = 1, size(blank%parts)
      call blank%parts(p)%element%new_fields(n)
    end do
    call find_holders(scene, blank, 0, holders)
    do p = 1, size(holders)
      associate (element => blank%parts(p)%element, entry => holders(p)%entry)
        do v = 1, n
          do k = 1, size(entry, 3)
            do j = 1, size(entry, 2)
              do i = 1, size(entry, 1)
                if (entry(i, j, k, v) == 0 .and. v == 1) &
                  element%nodal(i, j, k, v) = start_temperature(blank%law)
                if (entry(i, j, k, v) == 0) cycle
                element%nodal(i, j, k, v) = value_at(scene%fields(entry(i, j, k, v)), &
                                                     element%grid, [i, j, k])
              end do
            end do
          end do
        end do
        element%nodal_start = element%nodal
        call element%spread_fields()
        call element%spread_fields()   ! both ends of the first step
      end associate
    end do
  end subroutine set_initial_fields

  !> Temperature of points to which the deck gives none.
  pure real(wp) function start_temperature(law)
    class(block_law_t), intent(in) :: law

    start_temperature = 0.0_wp
    select type (law)
    class is (user_law_t)
      start_temperature = law%start_temperature
    end select
  end function start_temperature

  !> Append the fields that the deck gives during the run to the stage of the supports: one effect
  !! for each entry and each run of steps in which the same entries hold. From the first of them on
  !! there is at least one in each step, so that what ends is seen to end.
  subroutine add_field_changes(scene, model)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    type(field_spec_t), allocatable :: fields(:)
    integer :: first, last, n_steps

    if (.not. allocated(scene%fields)) return
    if (all(scene%fields%first_step == 0)) return
    if (.not. model%bodies%blank%law%needs_context) return
    n_steps = 1 + size(model%later_steps)
    fields = pack(scene%fields, scene%fields%first_step > 0)
    last = minval(fields%first_step) - 1
    do while (last < n_steps)
      first = last + 1
      last = minval([n_steps, pack(fields%first_step - 1, fields%first_step > first), &
                     pack(fields%last_step, fields%last_step >= first)])
      if (first == 1) then
        call add_changes_of(scene, first, last, model%bodies%blank, model%supports)
      else
        call add_changes_of(scene, first, last, model%bodies%blank, model%later_supports)
      end if
    end do
  end subroutine add_field_changes

  !> The effects of all steps from `first` to `last`.
  subroutine add_changes_of(scene, first, last, blank, supports)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: first, last
    type(blank_t), intent(in) :: blank
    type(effect_slot_t), allocatable, intent(inout) :: supports(:)
    type(holder_t), allocatable :: holders(:)
    type(field_change_t), allocatable :: changes(:)
    type(effect_slot_t) :: slot
    integer :: i, n

    call find_holders(scene, blank, first, holders)
    allocate (changes(size(scene%fields) + 1))
    n = 0
    do i = 1, size(scene%fields)
      associate (spec => scene%fields(i))
        if (.not. is_active(spec, first)) cycle
        n = n + 1
        changes(n)%name = field_name(spec)//" "//scene%sets(spec%set)%name
        changes(n)%variable = spec%variable
        changes(n)%curve = curve_of(scene, spec%curve)
        changes(n)%given_step = spec%first_step
        call take_points(spec, i, blank, holders, changes(n))
      end associate
    end do
    if (n == 0) then
      n = 1
      changes(1)%name = "fields of the start"
      changes(1)%curve = constant_curve(0.0_wp)
      allocate (changes(1)%part(0), changes(1)%points(3, 0), changes(1)%values(0))
    end if
    changes(1)%is_first = .true.
    changes(n)%is_last = .true.
    do i = 1, n
      changes(i)%first_step = first
      changes(i)%last_step = last
      allocate (slot%item, source=changes(i))
      supports = [supports, slot]
      deallocate (slot%item)
    end do
  end subroutine add_changes_of

  !> The control points that an entry holds, with their values.
  subroutine take_points(spec, number, blank, holders, change)
    type(field_spec_t), intent(in) :: spec
    integer, intent(in) :: number                !! of the entry
    type(blank_t), intent(in) :: blank
    type(holder_t), intent(in) :: holders(:)
    type(field_change_t), intent(inout) :: change
    integer :: p, i, j, k, n

    n = 0
    do p = 1, size(holders)
      n = n + count(holders(p)%entry(:, :, :, spec%variable) == number)
    end do
    allocate (change%part(n), change%points(3, n), change%values(n))
    n = 0
    do p = 1, size(holders)
      associate (entry => holders(p)%entry)
        do k = 1, size(entry, 3)
          do j = 1, size(entry, 2)
            do i = 1, size(entry, 1)
              if (entry(i, j, k, spec%variable) /= number) cycle
              n = n + 1
              change%part(n) = p
              change%points(:, n) = [i, j, k]
              change%values(n) = value_at(spec, blank%parts(p)%element%grid, [i, j, k])
            end do
          end do
        end do
      end associate
    end do
  end subroutine take_points

  !> Which entry holds each control point in a step, 0 being the start: the last one that has it.
  subroutine find_holders(scene, blank, step, holders)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: step
    type(holder_t), allocatable, intent(out) :: holders(:)
    type(members_t), allocatable :: members(:)
    integer :: p, i

    allocate (holders(size(blank%parts)))
    do p = 1, size(holders)
      allocate (holders(p)%entry, source=nint(0.0_wp*blank%parts(p)%element%nodal))
    end do
    do i = 1, size(scene%fields)
      if (.not. is_active(scene%fields(i), step)) cycle
      call find_members(blank, scene%sets(scene%fields(i)%set), members)
      do p = 1, size(holders)
        where (members(p)%is_in) holders(p)%entry(:, :, :, scene%fields(i)%variable) = i
      end do
    end do
  end subroutine find_holders

  pure logical function is_active(spec, step)
    type(field_spec_t), intent(in) :: spec
    integer, intent(in) :: step             !! 0: the start

    is_active = merge(spec%first_step == 0, spec%first_step > 0 .and. spec%first_step <= step &
                      .and. spec%last_step >= step, step == 0)
  end function is_active

  !> Value of an entry at a control point.
  pure real(wp) function value_at(spec, solid, at) result(value)
    type(field_spec_t), intent(in) :: spec
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: at(3)

    value = spec%value + dot_product(spec%gradient, solid%points(at(1), at(2), at(3), :))
  end function value_at

  !> Temperature and field variables up to the last that the deck names; 0: none.
  pure integer function n_fields_of(scene)
    type(scene_t), intent(in) :: scene

    n_fields_of = 0
    if (.not. allocated(scene%fields)) return
    if (size(scene%fields) > 0) n_fields_of = maxval(scene%fields%variable)
  end function n_fields_of

  pure function field_name(spec) result(name)
    type(field_spec_t), intent(in) :: spec
    character(:), allocatable :: name

    name = "temperature"
    if (spec%variable > 1) name = "field variable"
  end function field_name

end module field_setup
