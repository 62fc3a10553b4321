!> What the points of the blank have at the start: state variables that the deck gives to sets of
!! elements, then the user's SDVINI, the moduli that a user's law has with them, and temperature and
!! field variables; those of the run as effects of the model.
module initial_setup
  use kinds, only: wp
  use scene, only: scene_t, field_spec_t, box_spec_t, set_spec_t, boxes_of
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use block_law, only: block_law_t
  use user_call, only: user_law_t
  use motion_curve, only: constant_curve
  use boundary_setup, only: members_t, find_members, last_alike, curve_of, owner_t, new_owners, &
                            list_points
  use blank, only: blank_t
  use prescribed_field, only: field_change_t
  use model, only: model_t, add_support
  use failure, only: error_t
  use element, only: element_t, point_coordinates, next_element, grid_number
  use user_law, only: set_initial_state, lacks_moduli, find_moduli, needs_more, first_point_t
  implicit none
  private

  public :: set_initial_fields, add_field_changes
  public :: set_initial_states, find_initial_moduli, lacks_gradients, n_fields_of

contains

  !> Give all points the fields of the start. Where entries meet, the last one holds.
  subroutine set_initial_fields(scene, blank)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(inout) :: blank
    type(owner_t), allocatable :: owners(:)
    integer :: p, v, i, j, k, n

    n = n_fields_of(scene)
    if (n == 0 .or. .not. blank%law%needs_context) return
    do p = 1, size(blank%parts)
      call blank%parts(p)%element%new_fields(n)
    end do
    call find_owners(scene, blank, 0, owners)
    do p = 1, size(owners)
      associate (element => blank%parts(p)%element, entry => owners(p)%entry)
        element%nodal(:, :, :, 1) = start_temperature(blank%law)
        do v = 1, n
          do k = 1, size(entry, 3)
            do j = 1, size(entry, 2)
              do i = 1, size(entry, 1)
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

    if (all(scene%fields%first_step == 0)) return
    if (.not. model%bodies%blank%law%needs_context) return
    n_steps = 1 + size(model%later_steps)
    fields = pack(scene%fields, scene%fields%first_step > 0)
    last = minval(fields%first_step) - 1
    do while (last < n_steps)
      first = last + 1
      last = last_alike(first, n_steps, fields%first_step, fields%last_step)
      call add_changes_of(scene, first, last, model)
    end do
  end subroutine add_field_changes

  !> The effects of all steps from `first` to `last`.
  subroutine add_changes_of(scene, first, last, model)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: first, last
    type(model_t), intent(inout) :: model
    type(owner_t), allocatable :: owners(:)
    type(field_change_t), allocatable :: changes(:)
    integer :: i, k, n

    call find_owners(scene, model%bodies%blank, first, owners)
    allocate (changes(size(scene%fields) + 1))
    n = 0
    do i = 1, size(scene%fields)
      associate (spec => scene%fields(i))
        if (.not. is_active(spec, first)) cycle
        n = n + 1
        changes(n)%name = trim(merge("temperature   ", "field variable", spec%variable == 1)) &
                          //" "//scene%sets(spec%set)%name
        changes(n)%variable = spec%variable
        changes(n)%curve = curve_of(scene, spec%curve)
        changes(n)%given_step = spec%first_step
        call list_points(owners, spec%variable, i, changes(n)%part, changes(n)%points)
        changes(n)%values = [(value_at(spec, model%bodies%blank%parts(changes(n)%part(k)) &
                                       %element%grid, changes(n)%points(:, k)), &
                              k=1, size(changes(n)%part))]
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
      call add_support(model, changes(i))
    end do
  end subroutine add_changes_of

  !> Which entry holds each control point in a step, 0 being the start: the last one that has it.
  subroutine find_owners(scene, blank, step, owners)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: step
    type(owner_t), allocatable, intent(out) :: owners(:)
    type(members_t), allocatable :: members(:)
    integer :: p, i

    owners = new_owners(blank, n_fields_of(scene))
    do i = 1, size(scene%fields)
      if (.not. is_active(scene%fields(i), step)) cycle
      call find_members(blank, scene%sets(scene%fields(i)%set), members)
      do p = 1, size(owners)
        where (members(p)%is_in) owners(p)%entry(:, :, :, scene%fields(i)%variable) = i
      end do
    end do
  end subroutine find_owners

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

    n_fields_of = max(0, maxval(scene%fields%variable))
  end function n_fields_of

  !> Fill the state of all points of a blank at rest.
  subroutine set_initial_states(scene, blank)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(inout) :: blank
    integer :: p, i, e(3)

    if (blank%law%n_state == 0) return
    if (size(scene%initial_states) == 0 .and. .not. blank%law%needs_context) return
    do p = 1, size(blank%parts)
      e = [0, 1, 1]
      do i = 1, product(blank%parts(p)%element%n_elements)
        call next_element(blank%parts(p)%element%n_elements, e)
        call fill_element(blank%law, blank%parts(p)%element, e, given_state(scene, blank, p, e))
      end do
    end do
  end subroutine set_initial_states

  !> The first state variables of an element, as far as the deck gives them. Entries that come later
  !! replace the first values of earlier ones.
  function given_state(scene, blank, part, e) result(given)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: part, e(3)
    real(wp), allocatable :: given(:)
    real(wp) :: centre(3)
    integer :: i, n, n_output

    allocate (given(0))
    n_output = scene%materials(scene%blank%material)%n_uvarm   ! these start as zero
    centre = point_coordinates(blank%parts(part)%element, e, [0.0_wp, 0.0_wp, 0.0_wp])
    do i = 1, size(scene%initial_states)
      associate (start => scene%initial_states(i))
        if (.not. holds(scene%sets(start%set), part, blank%parts(part)%element%grid, centre)) cycle
        n = min(size(start%values), blank%law%n_state - blank%law%n_hidden - n_output)
        given = [start%values(:n), given(n + 1:)]
      end associate
    end do
  end function given_state

  !> Let a user's law that brings no elastic moduli with it tell them, by one call for the first
  !! point of an element with each state, temperature and set of field variables that elements have
  !! at the start. The largest count. Fails where they are not to be had; a law whose moduli are
  !! known is not called.
  subroutine find_initial_moduli(dt, blank, error)
    real(wp), intent(in) :: dt                !! a short increment
    type(blank_t), intent(inout) :: blank     !! with its states and fields at the start
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: most = 100          ! beyond these each element has its own call
    real(wp), parameter :: alike = 1.0e-6_wp  ! of what differs by rounding
    real(wp), allocatable :: seen(:, :), now(:)
    real(wp) :: moduli(2), largest(2)
    integer :: p, n, i, k, e(3)

    if (.not. lacks_moduli(blank%law)) return
    allocate (seen(blank%law%n_state + blank%parts(1)%element%n_fields, most))
    n = 0
    largest = 0.0_wp
    do p = 1, size(blank%parts)
      e = [0, 1, 1]
      do k = 1, product(blank%parts(p)%element%n_elements)
        call next_element(blank%parts(p)%element%n_elements, e)
        now = start_of(blank%parts(p)%element, blank%law%n_state, e)
        if (any([(all(abs(seen(:, i) - now) <= alike*abs(now)), i=1, n)])) cycle
        if (n < most) then
          n = n + 1
          seen(:, n) = now
        end if
        call ask_element(blank%law, blank%parts(p)%element, e, now, dt, moduli, error)
        if (allocated(error)) return
        largest = max(largest, moduli)
      end do
    end do
    blank%law%bulk = largest(1)
    blank%law%shear = largest(2)
    do p = 1, size(blank%parts)
      call blank%parts(p)%element%take_moduli(blank%law)
    end do
  end subroutine find_initial_moduli

  !> State and fields of an element's first point.
  pure function start_of(element, n_state, e) result(values)
    class(element_t), intent(in) :: element
    integer, intent(in) :: n_state, e(3)
    real(wp) :: values(n_state + element%n_fields)
    real(wp), allocatable :: stress(:, :, :, :), state(:, :, :, :)

    associate (q => element%rule%n)
      allocate (stress(6, q(1), q(2), q(3)), state(n_state, q(1), q(2), q(3)))
    end associate
    call element%read_element(e, stress, state)
    values(:n_state) = state(:, 1, 1, 1)
    if (element%n_fields > 0) values(n_state + 1:) = element%fields_at(e, [1, 1, 1])
  end function start_of

  !> The moduli of an element's first point.
  subroutine ask_element(law, element, e, start, dt, moduli, error)
    class(block_law_t), intent(in) :: law
    class(element_t), intent(in) :: element
    integer, intent(in) :: e(3)
    real(wp), intent(in) :: start(:)           !! from `start_of`
    real(wp), intent(in) :: dt
    real(wp), intent(out) :: moduli(2)
    type(error_t), allocatable, intent(out) :: error
    type(first_point_t) :: point

    moduli = 0.0_wp
    call set_first_point(law, element, e, start, point)
    call find_moduli(law, dt, point, start(:law%n_state), moduli(1), moduli(2), error)
  end subroutine ask_element

  !> Does a user's law without deformation gradients use them? The first point of the blank tells.
  logical function lacks_gradients(dt, blank)
    real(wp), intent(in) :: dt                !! a short increment
    type(blank_t), intent(in) :: blank        !! with its states and fields at the start
    real(wp), allocatable :: start(:)
    type(first_point_t) :: point

    lacks_gradients = .false.
    if (blank%law%needs_gradients) return
    associate (element => blank%parts(1)%element, law => blank%law)
      start = start_of(element, law%n_state, [1, 1, 1])
      call set_first_point(law, element, [1, 1, 1], start, point)
      lacks_gradients = needs_more(law, dt, point, start(:law%n_state))
    end associate
  end function lacks_gradients

  !> The first point of an element, as a user's subroutine is called for it before the run.
  subroutine set_first_point(law, element, e, start, point)
    class(block_law_t), intent(in) :: law
    class(element_t), intent(in) :: element
    integer, intent(in) :: e(3)
    real(wp), intent(in) :: start(:)           !! from `start_of`
    type(first_point_t), intent(out) :: point
    integer :: axis

    point%element = element_number(element, e)
    call evaluate_solid(element%grid, point_coordinates(element, e, &
                        [(element%rule(axis)%points(1), axis=1, 3)]), point%place)
    point%length = element%size_of(e)
    point%n_fields = element%n_fields
    point%fields(:point%n_fields) = start(law%n_state + 1:)
  end subroutine set_first_point

  !> Number of an element of the blank, from 1.
  pure integer function element_number(element, e)
    class(element_t), intent(in) :: element
    integer, intent(in) :: e(3)

    element_number = element%n_before + grid_number(element%n_elements, e)
  end function element_number

  !> The points of one element.
  subroutine fill_element(law, element, e, given)
    class(block_law_t), intent(in) :: law
    class(element_t), intent(inout) :: element
    integer, intent(in) :: e(3)
    real(wp), intent(in) :: given(:)
    real(wp), allocatable :: stress(:, :, :, :), state(:, :, :, :)
    real(wp) :: place(3), jacobian(3, 3)
    integer :: q(3), in_layer(3), number(2), qa, qb, qc

    q = element%rule%n
    allocate (stress(6, q(1), q(2), q(3)), state(law%n_state, q(1), q(2), q(3)))
    call element%read_element(e, stress, state)
    in_layer = q
    if (element%is_surface) in_layer(3) = 1
    do qc = 1, q(3)
      do qb = 1, q(2)
        do qa = 1, q(1)
          state(:size(given), qa, qb, qc) = given
          if (element%is_surface) then
            call element%jacobian(element%grid, e, [qa, qb, qc], jacobian, place)
            number = [grid_number(in_layer, [qa, qb, 1]), qc]
          else
            call evaluate_solid(element%grid, point_coordinates(element, e, &
              [element%rule(1)%points(qa), element%rule(2)%points(qb), &
               element%rule(3)%points(qc)]), place)
            number = [grid_number(q, [qa, qb, qc]), 1]
          end if
          call set_initial_state(law, element_number(element, e), number, place, &
                                 state(:, qa, qb, qc))
          call element%set_state(e, [qa, qb, qc], state(:, qa, qb, qc))
        end do
      end do
    end do
  end subroutine fill_element

  !> Does a set hold this point of a patch?
  pure logical function holds(set, part, solid, xi)
    type(set_spec_t), intent(in) :: set
    integer, intent(in) :: part
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), intent(in) :: xi(3)
    type(box_spec_t), allocatable :: boxes(:)
    real(wp) :: x(3)
    integer :: i

    call evaluate_solid(solid, xi, x)
    boxes = boxes_of(set)
    holds = any([(all(xi >= boxes(i)%lower(:, part) .and. xi <= boxes(i)%upper(:, part) .and. &
                      x >= boxes(i)%from .and. x <= boxes(i)%to), i=1, size(boxes))])
  end function holds

end module initial_setup