!> State of a contact for checkpoints: a run taken up again goes on bit by bit the same.
module contact_state
  use kinds, only: wp
  use state_store, only: state_store_t, put, take, put_array, take_array
  use contact, only: contact_t, set_tile_tests
  implicit none
  private

  public :: pack_contact, unpack_contact, wake_contact

contains

  !> Frozen penalty, warm starts, culling state, forces, history of friction and damping, counts.
  pure subroutine pack_contact(contact, store)
    type(contact_t), intent(in) :: contact
    type(state_store_t), intent(inout) :: store

    call put_array(store, "travel", size(contact%tiles), contact%tiles%travel)
    call put_array(store, "tool_displacement", 3, contact%displacement)
    call put(store, "is_started", contact%is_started)
    call put(store, "share", contact%share)
    call put_array(store, "stiffness", size(contact%stiffness), contact%stiffness)
    call put_array(store, "net", size(contact%net), contact%net)
    call put_array(store, "face", size(contact%face), real(contact%face, wp))
    call put_array(store, "at", size(contact%at), contact%at)
    call put_array(store, "test_at", size(contact%test_at), contact%test_at)
    call put_array(store, "search_at", size(contact%search_at), contact%search_at)
    call put_array(store, "start", size(contact%start), contact%start)
    call put_array(store, "force", size(contact%force), contact%force)
    associate (counts => contact%statistics)
      call put_array(store, "counts", 8, [real(counts%n_calls, wp), real(counts%n_points, wp), &
                                          real(counts%n_tested, wp), &
                                          real(counts%n_iterations, wp), &
                                          real(counts%n_fallbacks, wp), &
                                          real(counts%n_searches, wp), &
                                          real(counts%n_failures, wp), &
                                          real(counts%max_iterations, wp)])
    end associate
    if (allocated(contact%friction)) then
      associate (state => contact%friction)
        call put_drag(store, "friction", state%energy, state%is_touching, state%place, &
                      state%stretch)
      end associate
    end if
    if (allocated(contact%damping)) then
      associate (state => contact%damping)
        call put_drag(store, "damping", state%energy, state%is_touching, state%place, state%force)
        call put_array(store, "damping_constant", size(state%constant), state%constant)
      end associate
    end if
  end subroutine pack_contact

  !> Take the state back into a contact that was set up in the same way.
  pure subroutine unpack_contact(contact, store)
    type(contact_t), intent(inout) :: contact
    type(state_store_t), intent(inout) :: store
    real(wp) :: face(size(contact%face)), numbers(8)

    call take_array(store, "travel", size(contact%tiles), contact%tiles%travel)
    call take_array(store, "tool_displacement", 3, contact%displacement)
    call take(store, "is_started", contact%is_started)
    call take(store, "share", contact%share)
    call take_array(store, "stiffness", size(contact%stiffness), contact%stiffness)
    call take_array(store, "net", size(contact%net), contact%net)
    face = real(contact%face, wp)
    call take_array(store, "face", size(face), face)
    contact%face = nint(face)
    call take_array(store, "at", size(contact%at), contact%at)
    call take_array(store, "test_at", size(contact%test_at), contact%test_at)
    call take_array(store, "search_at", size(contact%search_at), contact%search_at)
    call take_array(store, "start", size(contact%start), contact%start)
    call take_array(store, "force", size(contact%force), contact%force)
    numbers = 0.0_wp
    call take_array(store, "counts", 8, numbers)
    associate (counts => contact%statistics)
      counts%n_calls = nint(numbers(1), kind(counts%n_calls))
      counts%n_points = nint(numbers(2), kind(counts%n_calls))
      counts%n_tested = nint(numbers(3), kind(counts%n_calls))
      counts%n_iterations = nint(numbers(4), kind(counts%n_calls))
      counts%n_fallbacks = nint(numbers(5), kind(counts%n_calls))
      counts%n_searches = nint(numbers(6), kind(counts%n_calls))
      counts%n_failures = nint(numbers(7), kind(counts%n_calls))
      counts%max_iterations = nint(numbers(8))
    end associate
    if (allocated(contact%friction)) then
      associate (state => contact%friction)
        call take_drag(store, "friction", state%energy, state%is_touching, state%place, &
                       state%stretch)
      end associate
    end if
    if (allocated(contact%damping)) then
      associate (state => contact%damping)
        call take_drag(store, "damping", state%energy, state%is_touching, state%place, state%force)
        call take_array(store, "damping_constant", size(state%constant), state%constant)
      end associate
    end if
    call set_tile_tests(contact)
  end subroutine unpack_contact

  !> Energy, flags and two vectors of each point.
  pure subroutine put_drag(store, name, energy, is_touching, place, vector)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    logical, intent(in) :: is_touching(:)
    real(wp), intent(in) :: energy, place(size(is_touching), 3), vector(size(is_touching), 3)

    call put(store, name//"_energy", energy)
    call put_array(store, name//"_touching", size(is_touching), merge(1.0_wp, 0.0_wp, is_touching))
    call put_array(store, name//"_place", size(place), place)
    call put_array(store, name//"_vector", size(vector), vector)
  end subroutine put_drag

  pure subroutine take_drag(store, name, energy, is_touching, place, vector)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    logical, intent(inout) :: is_touching(:)
    real(wp), intent(inout) :: energy, place(size(is_touching), 3), vector(size(is_touching), 3)
    real(wp) :: flags(size(is_touching))

    call take(store, name//"_energy", energy)
    flags = 0.0_wp
    call take_array(store, name//"_touching", size(flags), flags)
    is_touching = flags > 0.5_wp
    call take_array(store, name//"_place", size(place), place)
    call take_array(store, name//"_vector", size(vector), vector)
  end subroutine take_drag

  !> Let the next call look into all tiles and test every `stride`-th point that has a face near it,
  !! as it is while a tool forms the sheet: for measuring the cost of that before it happens.
  pure subroutine wake_contact(contact, stride)
    type(contact_t), intent(inout) :: contact
    integer, intent(in), optional :: stride    !! absent: test all points

    contact%tiles%test_at = 0.0_wp
    if (present(stride)) then
      where (contact%face(::stride) > 0) contact%test_at(::stride) = 0.0_wp
    else
      contact%test_at = 0.0_wp
    end if
  end subroutine wake_contact

end module contact_state
