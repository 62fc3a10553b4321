!> Which tiles of a patch a process works: all where it is alone, else a range of them, so that the
!! ranges of all processes make up the patch.
module tile_shares
  use kinds, only: wp
  use, intrinsic :: iso_fortran_env, only: int64
  use ranks, only: ranks_t, traffic_t
  use timer, only: clock_ticks
  implicit none
  private

  public :: share_out, work_all_tiles, work_own_tiles, even_shares, begin_tile, end_tile

  !> The share of this process. Blocks of tiles that others work have no stress and state here.
  type, public :: tile_shares_t
    integer :: first = 1, last = 0              !! tiles that are worked here
    logical :: is_shared = .false.              !! others work the rest of them
    class(ranks_t), allocatable :: ranks        !! the processes; absent: one for all
    integer, allocatable :: last_of(:)          !! last tile of each of them
    type(traffic_t) :: traffic
    !> Work on each of the tiles since they were shared, and the clock when it began [clock ticks].
    integer(int64), allocatable :: ticks(:), started(:)
  end type tile_shares_t

contains

  !> All tiles are worked here, by each process if there are several: the state of all of their
  !! points must be known.
  pure subroutine work_all_tiles(shares, n_tiles)
    type(tile_shares_t), intent(inout) :: shares
    integer, intent(in) :: n_tiles

    shares%first = 1
    shares%last = n_tiles
    shares%is_shared = .false.
  end subroutine work_all_tiles

  !> Share the tiles, given the last one of each process.
  subroutine share_out(shares, ranks, last)
    type(tile_shares_t), intent(inout) :: shares
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: last(:)

    if (.not. allocated(shares%ranks)) allocate (shares%ranks, source=ranks)
    shares%last_of = last
    if (allocated(shares%ticks)) deallocate (shares%ticks, shares%started)
    allocate (shares%ticks(last(size(last))), source=0_int64)
    allocate (shares%started, source=shares%ticks)
    call work_own_tiles(shares)
  end subroutine share_out

  !> The tiles of this process alone.
  pure subroutine work_own_tiles(shares)
    type(tile_shares_t), intent(inout) :: shares   !! with processes and their last tiles

    associate (number => shares%ranks%number)
      shares%first = 1
      if (number > 0) shares%first = shares%last_of(number) + 1
      shares%last = shares%last_of(number + 1)
      shares%is_shared = shares%ranks%n > 1
    end associate
  end subroutine work_own_tiles

  !> The work on a tile begins.
  subroutine begin_tile(shares, tile)
    type(tile_shares_t), intent(inout) :: shares
    integer, intent(in) :: tile

    if (shares%is_shared) shares%started(tile) = clock_ticks()
  end subroutine begin_tile

  !> The work on a tile is done.
  subroutine end_tile(shares, tile)
    type(tile_shares_t), intent(inout) :: shares
    integer, intent(in) :: tile

    if (shares%is_shared) shares%ticks(tile) = shares%ticks(tile) + clock_ticks() &
                                               - shares%started(tile)
  end subroutine end_tile

  !> Last piece of each process, where pieces of given weights stay in their order: each goes to the
  !! process in whose even part of the whole its middle lies. A process may get none.
  pure function even_shares(weights, n) result(last)
    real(wp), intent(in) :: weights(:)     !! of the pieces
    integer, intent(in) :: n               !! processes
    integer :: last(n)
    real(wp) :: middle, whole
    integer :: i, r

    whole = sum(weights)
    middle = 0.0_wp
    last = 0
    do i = 1, size(weights)
      middle = middle + 0.5_wp*weights(i)
      r = max(1, min(n, ceiling(n*middle/whole)))
      last(r:) = i
      middle = middle + 0.5_wp*weights(i)
    end do
  end function even_shares

end module tile_shares
