!> State of a contact as numbers, for checkpoints: a run taken up again goes on bit by bit the same.
module contact_state
  use kinds, only: wp
  use contact, only: contact_t, set_tile_tests
  implicit none
  private

  public :: contact_state_size, pack_contact, unpack_contact, wake_contact

  integer, parameter :: n_single = 5      !! travel, tool displacement, whether it has started
  integer, parameter :: n_per_point = 5   !! face, two local coordinates, next test, next search
  integer, parameter :: n_drag = 7        !! of friction or damping: whether it touches, two vectors

contains

  !> Numbers that `pack_contact` writes.
  pure integer function contact_state_size(contact)
    type(contact_t), intent(in) :: contact

    associate (n => contact%slave%n_points)
      contact_state_size = n_single + size(contact%net) + n_per_point*n
      if (allocated(contact%friction)) contact_state_size = contact_state_size + 1 + n_drag*n
      if (allocated(contact%damping)) contact_state_size = contact_state_size + 1 + n_drag*n
    end associate
  end function contact_state_size

  !> Warm starts, culling state, history of friction and damping. Forces are not among them: the
  !! next call computes them.
  pure subroutine pack_contact(contact, values)
    type(contact_t), intent(in) :: contact
    real(wp), intent(out) :: values(:)   !! shape (contact_state_size)

    integer :: n, at

    n = contact%slave%n_points
    at = n_single + size(contact%net) + n_per_point*n
    values(:at) = [contact%travel, contact%displacement, &
                   merge(1.0_wp, 0.0_wp, contact%is_started), contact%net, &
                   real(contact%face, wp), contact%at, contact%test_at, contact%search_at]
    if (allocated(contact%friction)) then
      associate (state => contact%friction, part => values(at + 1:at + 1 + n_drag*n))
        part = [state%energy, merge(1.0_wp, 0.0_wp, state%is_touching), state%place, state%stretch]
      end associate
      at = at + 1 + n_drag*n
    end if
    if (allocated(contact%damping)) then
      associate (state => contact%damping, part => values(at + 1:at + 1 + n_drag*n))
        part = [state%energy, merge(1.0_wp, 0.0_wp, state%is_touching), state%place, state%force]
      end associate
    end if
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
    at = at + n_per_point*n
    if (allocated(contact%friction)) then
      associate (state => contact%friction)
        call take_drag(n, values(at + 1:), state%energy, state%is_touching, state%place, &
                       state%stretch)
      end associate
      at = at + 1 + n_drag*n
    end if
    if (allocated(contact%damping)) then
      associate (state => contact%damping)
        call take_drag(n, values(at + 1:), state%energy, state%is_touching, state%place, &
                       state%force)
      end associate
    end if
    call set_tile_tests(contact)
  end subroutine unpack_contact

  !> Energy, flags and two vectors of each point.
  pure subroutine take_drag(n, values, energy, is_touching, place, vector)
    integer, intent(in) :: n
    real(wp), intent(in) :: values(1 + n_drag*n)
    real(wp), intent(out) :: energy, place(n, 3), vector(n, 3)
    logical, intent(out) :: is_touching(n)

    energy = values(1)
    is_touching = values(2:n + 1) > 0.5_wp
    place = reshape(values(n + 2:4*n + 1), [n, 3])
    vector = reshape(values(4*n + 2:7*n + 1), [n, 3])
  end subroutine take_drag

  !> Let the next call look into all tiles and test every `stride`-th point that has a face near it,
  !! as it is while a tool forms the sheet: for measuring the cost of that before it happens.
  pure subroutine wake_contact(contact, stride)
    type(contact_t), intent(inout) :: contact
    integer, intent(in) :: stride

    contact%tiles%test_at = 0.0_wp
    where (contact%face(::stride) > 0) contact%test_at(::stride) = 0.0_wp
  end subroutine wake_contact

end module contact_state
