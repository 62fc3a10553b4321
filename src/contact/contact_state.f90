!> What a contact must know to go on, for checkpoints and for other processes.
module contact_state
  use state_store, only: state_store_t, carry, carry_array, carry_columns, carry_indices
  use spared_memory, only: sparing_t
  use tile_results, only: find_points_of, carry_counts
  use contact, only: contact_t
  implicit none
  private

  public :: carry_contact, carry_places, spare_points

contains

  !> Frozen penalty, warm starts, culling state, forces, history of friction and damping, counts.
  !! Where processes share the tiles each has its own points.
  subroutine carry_contact(contact, store)
    type(contact_t), intent(inout) :: contact
    type(state_store_t), intent(inout) :: store

    call carry_places(contact, store)
    call carry_loads(contact, store)
    associate (n => contact%secondary%n_points)
      call carry(store, "is_static", contact%is_static)
      call carry(store, "share", contact%scale)
      call carry(store, "passed", contact%passed)
      call carry_array(store, "stiffness", n, contact%stiffness)
      call carry_counts(contact%statistics, store)
      if (allocated(contact%friction)) then
        call carry(store, "friction_energy", contact%friction%energy)
        ! The stiffness takes it, also before the next increment: that of frequencies.
        if (contact%is_static) call carry_array(store, "held", n, contact%friction%held)
      end if
      if (allocated(contact%damping)) then
        call carry(store, "damping_energy", contact%damping%energy)
        call carry_array(store, "damping_constant", n, contact%damping%constant)
      end if
    end associate
  end subroutine carry_contact

  !> Of the same: where the face is, and where its points are on the tool.
  subroutine carry_places(contact, store)
    type(contact_t), intent(inout) :: contact
    type(state_store_t), intent(inout) :: store

    call carry_motion(contact, store)
    call carry_points_on_tool(contact, store)
  end subroutine carry_places

  !> What is known of the points of other processes is given up. The face stays: its rows are also
  !! those that own tiles touch.
  subroutine spare_points(contact)
    type(contact_t), intent(inout) :: contact
    type(state_store_t) :: store

    allocate (sparing_t :: store%visitor)
    call carry_points_on_tool(contact, store)
    call carry_loads(contact, store)
  end subroutine spare_points

  !> Points of the tiles that are worked here, where processes share them; else not allocated.
  pure subroutine find_points_here(contact, here)
    type(contact_t), intent(in) :: contact
    integer, allocatable, intent(out) :: here(:)

    if (contact%is_shared) call find_points_of(contact%ranks%number, contact%tiles, &
                                               contact%owners, contact%secondary%n_along, here)
  end subroutine find_points_here

  !> The face, and how far its tiles have come.
  subroutine carry_motion(contact, store)
    type(contact_t), intent(inout) :: contact
    type(state_store_t), intent(inout) :: store
    integer, allocatable :: tiles(:), rows(:)
    integer :: i

    associate (n => contact%secondary%n_net, n_tiles => size(contact%tiles))
      if (contact%rows%is_shared) then
        tiles = pack([(i, i=1, n_tiles)], contact%owners == contact%ranks%number)
        rows = [(i, i=contact%rows%own_first, contact%rows%own_last)]
        rows = [rows, n(2) + rows, 2*n(2) + rows]
      end if
      call carry_columns(store, "travel", 1, n_tiles, contact%tiles%travel, tiles)
      call carry_columns(store, "tile_test_at", 1, n_tiles, contact%tiles%test_at, tiles)
      call carry_array(store, "tool_displacement", 3, contact%motion%displacement)
      call carry(store, "is_started", contact%motion%is_started)
      call carry_columns(store, "net", n(1), 3*n(2), contact%motion%now, rows)
    end associate
  end subroutine carry_motion

  !> Where points are on the tool, and when they are looked at again.
  subroutine carry_points_on_tool(contact, store)
    type(contact_t), intent(inout) :: contact
    type(state_store_t), intent(inout) :: store
    integer, allocatable :: here(:)

    call find_points_here(contact, here)
    associate (n => contact%secondary%n_points)
      call carry_indices(store, "face", n, contact%n_faces, contact%face, here)
      call carry_columns(store, "local_coordinates", 2, n, contact%at, here)
      call carry_columns(store, "test_at", 1, n, contact%test_at, here)
    end associate
  end subroutine carry_points_on_tool

  !> What loads the points, and the rest of the search.
  subroutine carry_loads(contact, store)
    type(contact_t), intent(inout) :: contact
    type(state_store_t), intent(inout) :: store
    integer, allocatable :: here(:), places(:)

    call find_points_here(contact, here)
    associate (n => contact%secondary%n_points)
      if (allocated(here)) places = [here, n + here, 2*n + here]
      if (allocated(contact%room)) call carry_columns(store, "room", 1, n, contact%room, here)
      call carry_columns(store, "search_at", 1, n, contact%search_at, here)
      call carry_columns(store, "start", 1, n, contact%start, here)
      call carry_columns(store, "force", 1, 3*n, contact%force, places)
      if (allocated(contact%friction)) &
        call carry_columns(store, "stretch", 3, n, contact%friction%stretch, here)
      if (allocated(contact%damping)) &
        call carry_columns(store, "damping_force", 3, n, contact%damping%force, here)
    end associate
  end subroutine carry_loads

end module contact_state
