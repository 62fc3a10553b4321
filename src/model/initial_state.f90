!> State variables at the start: what the deck gives to sets of elements, then the user's SDVINI.
module initial_state
  use kinds, only: wp
  use scene, only: scene_t, set_spec_t
  use basis_tables, only: n_lanes
  use ig_patch, only: element_of_lane
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use block_law, only: block_law_t
  use user_law, only: set_initial_state
  use blank, only: blank_t, patch_body_t
  implicit none
  private

  public :: set_initial_states

contains

  !> Fill the state of all points of a blank at rest.
  subroutine set_initial_states(scene, blank)
    type(scene_t), intent(in) :: scene
    type(blank_t), intent(inout) :: blank
    real(wp) :: given(blank%law%n_state), centre(3)
    integer :: p, block, lane, e(3), i, n

    if (blank%law%n_state == 0) return
    if (.not. allocated(scene%initial_states)) return
    if (size(scene%initial_states) == 0 .and. .not. blank%law%needs_context) return
    do p = 1, size(blank%parts)
      do block = 1, blank%parts(p)%patch%n_blocks
        do lane = 1, n_lanes
          e = element_of_lane(blank%parts(p)%patch, block, lane)
          given = 0.0_wp
          centre = place_in(blank%parts(p), e, [0.0_wp, 0.0_wp, 0.0_wp])
          do i = 1, size(scene%initial_states)
            associate (start => scene%initial_states(i))
              if (.not. holds(scene%sets(start%set), p, blank%parts(p)%solid, centre)) cycle
              n = min(size(start%values), size(given) - blank%law%n_hidden)
              given(:n) = start%values(:n)
            end associate
          end do
          call fill_element(blank%law, blank%parts(p), block, lane, e, given)
        end do
      end do
    end do
  end subroutine set_initial_states

  !> The points of one element.
  subroutine fill_element(law, body, block, lane, e, given)
    class(block_law_t), intent(in) :: law
    type(patch_body_t), intent(inout) :: body
    integer, intent(in) :: block, lane, e(3)
    real(wp), intent(in) :: given(:)
    real(wp) :: values(size(given)), place(3)
    integer :: q(3), qa, qb, qc, element

    associate (axes => body%patch%axes)
      q = axes%n_points
      element = body%patch%n_before + e(1) + axes(1)%n_elements &
                *((e(2) - 1) + axes(2)%n_elements*(e(3) - 1))
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
