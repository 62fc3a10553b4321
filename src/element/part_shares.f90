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
  !! order of the parts, even in the time that tiles took before, or else in elements. Where points
  !! are not known everywhere, each goes on with what it has. A law that must run on one thread
  !! stays with the first process.
  subroutine share_parts(parts, is_serial, ranks, may_move)
    type(part_t), intent(inout) :: parts(:)
    logical, intent(in) :: is_serial             !! the law
    class(ranks_t), intent(in) :: ranks
    logical, intent(in) :: may_move              !! all processes know all points
    real(wp), allocatable :: loads(:), costs(:)
    integer :: last(ranks%n), n_before, p

    if (.not. may_move) then
      do p = 1, size(parts)
        call parts(p)%element%work_own()
      end do
      return
    end if
    allocate (loads(0), costs(0))
    do p = 1, size(parts)
      loads = [loads, parts(p)%element%tile_loads()]
      costs = [costs, parts(p)%element%tile_costs()]
    end do
    if (size(loads) == 0) return
    if (size(costs) == size(loads)) loads = measured(ranks, costs)
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

  !> What tiles cost, from what the processes that worked them have measured.
  function measured(ranks, costs) result(loads)
    class(ranks_t), intent(in) :: ranks
    real(wp), intent(in) :: costs(:)             !! 0 of tiles of others
    real(wp) :: loads(size(costs)), joined(size(costs)*ranks%n)
    integer :: counts(ranks%n)

    counts = size(costs)
    call ranks%gather(counts, costs, joined, .true.)
    loads = sum(reshape(joined, [size(costs), ranks%n]), 2)
    loads = max(loads, 0.01_wp*sum(loads)/size(loads))   ! none is free, even if it was never timed
  end function measured

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
