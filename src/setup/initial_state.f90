!> State variables at the start: what the deck gives to sets of elements, then the user's SDVINI;
!! and the moduli that a user's law has with them.
module initial_state
  use kinds, only: wp
  use failure, only: error_t
  use scene, only: scene_t, set_spec_t
  use element, only: element_t, point_coordinates, next_element, grid_number
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use block_law, only: block_law_t
  use user_law, only: set_initial_state, lacks_moduli, find_moduli, first_point_t
  use blank, only: blank_t
  implicit none
  private

  public :: set_initial_states, find_initial_moduli

contains

  !> Fill the state of all points of a blank at rest.
  subroutine set_initial_states(scene, blank)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(inout) :: blank
    integer :: p, i, e(3)

    if (blank%law%n_state == 0) return
    if (.not. allocated(scene%initial_states)) return
    if (size(scene%initial_states) == 0 .and. .not. blank%law%needs_context) return
    do p = 1, size(blank%parts)
      e = [0, 1, 1]
      do i = 1, product(blank%parts(p)%element%n_elements)
        call next_element(blank%parts(p)%element%n_elements, e)
        call fill_element(blank%law, blank%parts(p)%element, e, given_state(scene, blank, p, e))
      end do
    end do
  end subroutine set_initial_states

  !> What the deck gives to an element. Entries of the deck that come later replace the first values
  !! of earlier ones.
  function given_state(scene, blank, part, e) result(given)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: part, e(3)
    real(wp) :: given(blank%law%n_state), centre(3)
    integer :: i, n

    given = 0.0_wp
    if (.not. allocated(scene%initial_states)) return
    centre = point_coordinates(blank%parts(part)%element, e, [0.0_wp, 0.0_wp, 0.0_wp])
    do i = 1, size(scene%initial_states)
      associate (start => scene%initial_states(i))
        if (.not. holds(scene%sets(start%set), part, blank%parts(part)%element%grid, centre)) cycle
        n = min(size(start%values), size(given) - blank%law%n_hidden)
        given(:n) = start%values(:n)
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
        call ask_element(blank%law, blank%parts(p)%element, e, dt, moduli, error)
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

    values(:n_state) = first_state(element, n_state, e)
    if (element%n_fields > 0) values(n_state + 1:) = element%fields_at(e, [1, 1, 1])
  end function start_of

  !> State of an element's first point.
  pure function first_state(element, n_state, e) result(values)
    class(element_t), intent(in) :: element
    integer, intent(in) :: n_state, e(3)
    real(wp) :: values(n_state)
    real(wp), allocatable :: stress(:, :, :, :), state(:, :, :, :)

    associate (q => element%rule%n)
      allocate (stress(6, q(1), q(2), q(3)), state(n_state, q(1), q(2), q(3)))
    end associate
    call element%read_element(e, stress, state)
    values = state(:, 1, 1, 1)
  end function first_state

  !> The moduli of an element's first point.
  subroutine ask_element(law, element, e, dt, moduli, error)
    class(block_law_t), intent(in) :: law
    class(element_t), intent(in) :: element
    integer, intent(in) :: e(3)
    real(wp), intent(in) :: dt
    real(wp), intent(out) :: moduli(2)
    type(error_t), allocatable, intent(out) :: error
    type(first_point_t) :: point
    integer :: axis

    moduli = 0.0_wp
    point%element = element_number(element, e)
    call evaluate_solid(element%grid, point_coordinates(element, e, &
                        [(element%rule(axis)%points(1), axis=1, 3)]), point%place)
    point%length = element%size_of(e)
    point%n_fields = element%n_fields
    if (point%n_fields > 0) point%fields(:point%n_fields) = element%fields_at(e, [1, 1, 1])
    call find_moduli(law, dt, point, first_state(element, law%n_state, e), moduli(1), moduli(2), &
                     error)
  end subroutine ask_element

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
    real(wp) :: values(size(given)), place(3)
    integer :: q(3), qa, qb, qc

    q = element%rule%n
    do qc = 1, q(3)
      do qb = 1, q(2)
        do qa = 1, q(1)
          values = given
          call evaluate_solid(element%grid, point_coordinates(element, e, &
            [element%rule(1)%points(qa), element%rule(2)%points(qb), element%rule(3)%points(qc)]), &
            place)
          call set_initial_state(law, element_number(element, e), &
                                 grid_number(q, [qa, qb, qc]), place, values)
          call element%set_state(e, [qa, qb, qc], values)
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
    real(wp) :: x(3)

    call evaluate_solid(solid, xi, x)
    holds = all(xi >= set%lower(:, part) .and. xi <= set%upper(:, part) .and. &
                x >= set%from .and. x <= set%to)
  end function holds

end module initial_state
