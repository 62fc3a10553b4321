!> The parts of a body among processes: who works which tiles, and the state of all points where
!! somebody must look at it.
module part_shares
  use kinds, only: wp
  use ranks, only: ranks_t
  use state_store, only: state_store_t
  use store_gather, only: join_tables
  use spared_memory, only: sparing_t
  use tile_shares, only: even_shares
  use element, only: part_t
  implicit none
  private

  public :: share_parts, join_points

contains

  !> Each process works its share of the tiles of every part from now on: a contiguous range, even
  !! in the time that tiles took before, or else in elements. So all have work at each part, after
  !! which they wait for each other. Where points are not known everywhere, each goes on with what
  !! it has. A law that must run on one thread stays with the first process. What is known of the
  !! points of others is given up.
  subroutine share_parts(parts, is_serial, ranks, may_move, row_costs)
    type(part_t), intent(inout) :: parts(:)
    logical, intent(in) :: is_serial             !! the law
    class(ranks_t), intent(in) :: ranks
    logical, intent(in) :: may_move              !! all processes know all points
    !> Time that other work took here, that goes with the rows of the first part [clock ticks].
    real(wp), intent(in) :: row_costs(:)
    type(state_store_t) :: store
    real(wp), allocatable :: loads(:), costs(:)
    integer :: last(ranks%n), p

    allocate (sparing_t :: store%visitor)
    do p = 1, size(parts)
      loads = parts(p)%element%tile_loads()
      if (size(loads) == 0) cycle
      if (may_move) then
        costs = parts(p)%element%tile_costs(row_costs(:merge(size(row_costs), 0, p == 1)))
        if (size(costs) == size(loads)) call take_measured(ranks, costs, loads)
        last = even_shares(loads, ranks%n)
        if (is_serial) last = size(loads)
        call parts(p)%element%share_tiles(ranks, last)
      else
        call parts(p)%element%work_own()
      end if
      call parts(p)%element%carry(store)
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

    call join_tables(store, ranks, is_everywhere)
    do p = 1, size(parts)
      if (size(parts(p)%element%tile_loads()) == 0) cycle
      call parts(p)%element%carry(store)
      if (store%is_taking) call parts(p)%element%work_all()
    end do
  end subroutine join_points

end module part_shares
