!> The parts of a body among processes: who works which tiles, and the state of all points where
!! somebody must look at it.
module part_shares
  use kinds, only: wp
  use ranks, only: ranks_t
  use state_store, only: state_store_t, enter_folder
  use store_gather, only: gather_tables
  use tile_shares, only: even_shares
  use element, only: part_t
  implicit none
  private

  public :: share_parts, join_points

contains

  !> Each process works its share of the tiles of all parts from now on: contiguous ranges in the
  !! order of the parts. A law that must run on one thread stays with the first process.
  subroutine share_parts(parts, is_serial, ranks)
    type(part_t), intent(inout) :: parts(:)
    logical, intent(in) :: is_serial             !! the law
    class(ranks_t), intent(in) :: ranks
    real(wp), allocatable :: loads(:)
    integer :: last(ranks%n), n_before, p

    allocate (loads(0))
    do p = 1, size(parts)
      loads = [loads, parts(p)%element%tile_loads()]
    end do
    if (size(loads) == 0) return
    last = even_shares(loads, ranks%n)
    if (is_serial) last = size(loads)
    n_before = 0
    do p = 1, size(parts)
      associate (n => size(parts(p)%element%tile_loads()))
        if (n > 0) call parts(p)%element%share_tiles(ranks, max(0, min(n, last - n_before)))
        n_before = n_before + n
      end associate
    end do
  end subroutine share_parts

  !> Stress and state of all points, at the first process alone or at all: who has them works all
  !! tiles until they are shared again.
  subroutine join_points(parts, ranks, is_everywhere)
    type(part_t), intent(inout) :: parts(:)
    class(ranks_t), intent(in) :: ranks
    logical, intent(in) :: is_everywhere
    type(state_store_t) :: store
    integer :: p

    do p = 1, size(parts)
      if (size(parts(p)%element%tile_loads()) == 0) cycle
      store = state_store_t()
      call enter_folder(store, "")
      call parts(p)%element%carry(store)
      call gather_tables(ranks, store, is_everywhere)
      if (ranks%number > 0 .and. .not. is_everywhere) cycle
      call parts(p)%element%work_all()
      store%is_taking = .true.
      call parts(p)%element%carry(store)
    end do
  end subroutine join_points

end module part_shares
