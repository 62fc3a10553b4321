!> State of a contact as numbers, for checkpoints: a run taken up again goes on bit by bit the same.
module contact_state
  use kinds, only: wp
  use contact, only: contact_t, set_tile_tests
  implicit none
  private

  public :: contact_state_size, pack_contact, unpack_contact

  integer, parameter :: n_single = 5      !! travel, tool displacement, whether it has started
  integer, parameter :: n_per_point = 5   !! face, two local coordinates, next test, next search

contains

  !> Numbers that `pack_contact` writes.
  pure integer function contact_state_size(contact)
    type(contact_t), intent(in) :: contact

    contact_state_size = n_single + size(contact%net) + n_per_point*contact%slave%n_points
  end function contact_state_size

  !> Warm starts and culling state. Forces are not among them: the next call computes them.
  pure subroutine pack_contact(contact, values)
    type(contact_t), intent(in) :: contact
    real(wp), intent(out) :: values(:)   !! shape (contact_state_size)

    values = [contact%travel, contact%displacement, merge(1.0_wp, 0.0_wp, contact%is_started), &
              contact%net, real(contact%face, wp), contact%at, contact%test_at, contact%search_at]
  end subroutine pack_contact

  !> Take the state back into a contact that was set up in the same way.
  pure subroutine unpack_contact(contact, values)
    type(contact_t), intent(inout) :: contact
    real(wp), intent(in) :: values(:)   !! from `pack_contact`
    integer :: n, at

    n = contact%slave%n_points
    contact%travel = values(1)
    contact%displacement = values(2:4)
    contact%is_started = values(5) > 0.5_wp
    at = n_single
    contact%net = reshape(values(at + 1:at + size(contact%net)), shape(contact%net))
    at = at + size(contact%net)
    contact%face = nint(values(at + 1:at + n))
    contact%at = reshape(values(at + n + 1:at + 3*n), [n, 2])
    contact%test_at = values(at + 3*n + 1:at + 4*n)
    contact%search_at = values(at + 4*n + 1:at + 5*n)
    contact%force = 0.0_wp
    call set_tile_tests(contact)
  end subroutine unpack_contact

end module contact_state
