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

  !> Each process works its share of the tiles of every part from now on: a contiguous range, even
  !! in the time that tiles took before, or else in elements. So all have work at each part, after
  !! which they wait for each other. Where points are not known everywhere, each goes on with what
  !! it has. A law that must run on one thread stays with the first process.
  subroutine share_parts(parts, is_serial, ranks, may_move, row_costs)
    type(part_t), intent(inout) :: parts(:)
    logical, intent(in) :: is_serial             !! the law
    class(ranks_t), intent(in) :: ranks
    logical, intent(in) :: may_move              !! all processes know all points
    !> Time that other work took here, that goes with the rows of the first part [clock ticks].
    real(wp), intent(in) :: row_costs(:)
    real(wp), allocatable :: loads(:), costs(:)
    integer :: last(ranks%n), p

    do p = 1, size(parts)
      if (.not. may_move) then
        call parts(p)%element%work_own()
        cycle
      end if
      loads = parts(p)%element%tile_loads()
      if (size(loads) == 0) cycle
      costs = parts(p)%element%tile_costs(row_costs(:merge(size(row_costs), 0, p == 1)))
      if (size(costs) == size(loads)) call take_measured(ranks, costs, loads)
      last = even_shares(loads, ranks%n)
      if (is_serial) last = size(loads)
      call parts(p)%element%share_tiles(ranks, last)
    end do
  end subroutine share_parts

  !> What tiles cost, if the processes that worked them have measured anything.
  subroutine take_measured(ranks, costs, loads)
    class(ranks_t), intent(in) :: ranks
    real(wp), intent(in) :: costs(:)             !! 0 of tiles of others
    real(wp), intent(inout) :: loads(:)
    real(wp) :: joined(size(costs)*ranks%n), total(size(costs))

    call ranks%gather(spread(size(costs), 1, ranks%n), costs, joined, .true.)
    total = sum(reshape(joined, [size(costs), ranks%n]), 2)
    if (.not. sum(total) > 0.0_wp) return
    loads = max(total, 0.01_wp*sum(total)/size(total))   ! none is free, even if it was never timed
  end subroutine take_measured

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
