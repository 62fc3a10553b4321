!> State variables at the start: what the deck gives to sets of elements, then the user's SDVINI;
!! and the moduli that a user's law has with them.
module initial_state
  use kinds, only: wp
  use errors, only: error_t
  use scene, only: scene_t, set_spec_t
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t, element_of_lane
  use patch_setup, only: set_wave_speed
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use block_law, only: block_law_t
  use user_law, only: set_initial_state, lacks_moduli, find_moduli, first_point_t
  use blank, only: blank_t, patch_body_t
  implicit none
  private

  public :: set_initial_states, find_initial_moduli

contains

  !> Fill the state of all points of a blank at rest.
  subroutine set_initial_states(scene, blank)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(inout) :: blank
    integer :: p, block, lane, e(3)

    if (blank%law%n_state == 0) return
    if (.not. allocated(scene%initial_states)) return
    if (size(scene%initial_states) == 0 .and. .not. blank%law%needs_context) return
    do p = 1, size(blank%parts)
      do block = 1, blank%parts(p)%patch%n_blocks
        do lane = 1, n_lanes
          e = element_of_lane(blank%parts(p)%patch, block, lane)
          call fill_element(blank%law, blank%parts(p), block, lane, e, &
                            given_state(scene, blank, p, e))
        end do
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
    centre = place_in(blank%parts(part), e, [0.0_wp, 0.0_wp, 0.0_wp])
    do i = 1, size(scene%initial_states)
      associate (start => scene%initial_states(i))
        if (.not. holds(scene%sets(start%set), part, blank%parts(part)%solid, centre)) cycle
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
    integer :: p, block, lane, n, i

    if (.not. lacks_moduli(blank%law)) return
    allocate (seen(blank%law%n_state + blank%parts(1)%patch%n_fields, most))
    n = 0
    largest = 0.0_wp
    do p = 1, size(blank%parts)
      do block = 1, blank%parts(p)%patch%n_blocks
        do lane = 1, n_lanes
          now = start_of(blank%parts(p)%patch, blank%law%n_state, block, lane)
          if (any([(all(abs(seen(:, i) - now) <= alike*abs(now)), i=1, n)])) cycle
          if (n < most) then
            n = n + 1
            seen(:, n) = now
          end if
          call ask_element(blank, p, block, lane, dt, moduli, error)
          if (allocated(error)) return
          largest = max(largest, moduli)
        end do
      end do
    end do
    blank%law%bulk = largest(1)
    blank%law%shear = largest(2)
    do p = 1, size(blank%parts)
      call set_wave_speed(blank%parts(p)%patch, blank%law)
    end do
  end subroutine find_initial_moduli

  !> State and fields of an element's first point.
  pure function start_of(patch, n_state, block, lane) result(values)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: n_state, block, lane
    real(wp) :: values(n_state + patch%n_fields)

    values(:n_state) = patch%state(lane, 1, :n_state, 1, block)
    if (patch%n_fields > 0) &
      values(n_state + 1:) = patch%given(lane, 1, :patch%n_fields, 1, block)
  end function start_of

  !> The moduli of an element's first point.
  subroutine ask_element(blank, part, block, lane, dt, moduli, error)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: part, block, lane
    real(wp), intent(in) :: dt
    real(wp), intent(out) :: moduli(2)
    type(error_t), allocatable, intent(out) :: error
    type(first_point_t) :: point
    integer :: e(3), axis

    moduli = 0.0_wp
    associate (body => blank%parts(part))
      e = element_of_lane(body%patch, block, lane)
      point%element = element_number(body%patch, e)
      call evaluate_solid(body%solid, place_in(body, e, [(body%patch%axes(axis)%abscissae(1), &
                                                          axis=1, 3)]), point%place)
      point%length = body%patch%element_size(lane, block)
      point%n_fields = body%patch%n_fields
      if (point%n_fields > 0) point%fields(:point%n_fields) = &
        body%patch%given(lane, 1, :point%n_fields, 1, block)
      call find_moduli(blank%law, dt, point, &
                       body%patch%state(lane, 1, :blank%law%n_state, 1, block), &
                       moduli(1), moduli(2), error)
    end associate
  end subroutine ask_element

  !> Number of an element of the blank, from 1.
  pure integer function element_number(patch, e)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: e(3)

    element_number = patch%n_before + e(1) + patch%axes(1)%n_elements &
                     *((e(2) - 1) + patch%axes(2)%n_elements*(e(3) - 1))
  end function element_number

  !> The points of one element.
  subroutine fill_element(law, body, block, lane, e, given)
    class(block_law_t), intent(in) :: law
    type(patch_body_t), intent(inout) :: body
    integer, intent(in) :: block, lane, e(3)
    real(wp), intent(in) :: given(:)
    real(wp) :: values(size(given)), place(3)
    integer :: q(3), qa, qb, qc, element

    element = element_number(body%patch, e)
    associate (axes => body%patch%axes)
      q = axes%n_points
      do qc = 1, q(3)
        do qb = 1, q(2)
          do qa = 1, q(1)
            values = given
            call evaluate_solid(body%solid, place_in(body, e, [axes(1)%abscissae(qa), &
                                axes(2)%abscissae(qb), axes(3)%abscissae(qc)]), place)
            call set_initial_state(law, element, qa + q(1)*((qb - 1) + q(2)*(qc - 1)), &
                                   place, values)
            body%patch%state(lane, qc, :size(values), qb + q(2)*(qa - 1), block) = values
          end do
        end do
      end do
    end associate
  end subroutine fill_element

  !> Parametric coordinates of a point of an element whose own run from -1 to 1.
  pure function place_in(body, e, local) result(xi)
    type(patch_body_t), intent(in) :: body
    integer, intent(in) :: e(3)
    real(wp), intent(in) :: local(3)
    real(wp) :: xi(3)
    integer :: axis, span

    do axis = 1, 3
      associate (table => body%patch%axes(axis), knots => body%solid%axes(axis)%knots)
        span = table%first(e(axis)) + table%degree
        xi(axis) = 0.5_wp*((1.0_wp - local(axis))*knots(span) &
                           + (1.0_wp + local(axis))*knots(span + 1))
      end associate
    end do
  end function place_in

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
