!> State of a contact for checkpoints: a run taken up again goes on bit by bit the same.
module contact_state
  use kinds, only: wp
  use state_store, only: state_store_t, carry, carry_array, carry_flags, carry_indices
  use contact, only: contact_t
  use contact_tiles, only: set_tile_tests
  implicit none
  private

  public :: carry_contact, wake_contact

contains

  !> Frozen penalty, warm starts, culling state, forces, history of friction and damping, counts.
  pure subroutine carry_contact(contact, store)
    type(contact_t), intent(inout) :: contact
    type(state_store_t), intent(inout) :: store

    call carry_array(store, "travel", size(contact%tiles), contact%tiles%travel)
    call carry_array(store, "tool_displacement", 3, contact%motion%displacement)
    call carry(store, "is_started", contact%motion%is_started)
    call carry(store, "share", contact%share)
    call carry_array(store, "stiffness", size(contact%stiffness), contact%stiffness)
    call carry_array(store, "net", size(contact%motion%now), contact%motion%now)
    call carry_indices(store, "face", size(contact%face), contact%n_faces, contact%face)
    call carry_array(store, "at", size(contact%at), contact%at)
    call carry_array(store, "test_at", size(contact%test_at), contact%test_at)
    call carry_array(store, "search_at", size(contact%search_at), contact%search_at)
    call carry_array(store, "start", size(contact%start), contact%start)
    call carry_array(store, "force", size(contact%force), contact%force)
    associate (counts => contact%statistics)
      call carry(store, "n_calls", counts%n_calls)
      call carry(store, "n_points", counts%n_points)
      call carry(store, "n_tested", counts%n_tested)
      call carry(store, "n_iterations", counts%n_iterations)
      call carry(store, "n_fallbacks", counts%n_fallbacks)
      call carry(store, "n_searches", counts%n_searches)
      call carry(store, "n_failures", counts%n_failures)
      call carry(store, "max_iterations", counts%max_iterations)
    end associate
    if (allocated(contact%friction)) then
      associate (state => contact%friction)
        call carry_drag(store, "friction", state%energy, state%is_touching, state%place, &
                        state%stretch)
      end associate
    end if
    if (allocated(contact%damping)) then
      associate (state => contact%damping)
        call carry_drag(store, "damping", state%energy, state%is_touching, state%place, state%force)
        call carry_array(store, "damping_constant", size(state%constant), state%constant)
      end associate
    end if
    if (store%is_taking) call set_tile_tests(contact%tiles, contact%slave%n_along, contact%test_at)
  end subroutine carry_contact

  !> Energy, flags and two vectors of each point.
  pure subroutine carry_drag(store, name, energy, is_touching, place, vector)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    logical, intent(inout) :: is_touching(:)
    real(wp), intent(inout) :: energy, place(size(is_touching), 3), vector(size(is_touching), 3)

    call carry(store, name//"_energy", energy)
    call carry_flags(store, name//"_touching", size(is_touching), is_touching)
    call carry_array(store, name//"_place", size(place), place)
    call carry_array(store, name//"_vector", size(vector), vector)
  end subroutine carry_drag

  !> Let the next call test all points, or every `stride`-th one that has a face near it and no
  !! other, as many as while a tool forms the sheet: for measuring that cost before it happens.
  pure subroutine wake_contact(contact, stride)
    type(contact_t), intent(inout) :: contact
    integer, intent(in), optional :: stride    !! absent: test all points

    contact%tiles%test_at = 0.0_wp
    contact%test_at = 0.0_wp
    if (.not. present(stride)) return
    contact%test_at = huge(1.0_wp)
    where (contact%face(::stride) > 0) contact%test_at(::stride) = 0.0_wp
  end subroutine wake_contact

end module contact_state
