!> What processes that share the tiles of a patch exchange in an evaluation of its forces: reports
!! of their tiles, forces on the rows that tiles own, buffers for the others. Everybody gets the
!! buffers as they are and adds them in the order of the tiles, as one process does.
module tile_exchange
  use kinds, only: wp
  use ranks, only: gather_parcels
  use parcel, only: parcel_t, empty_parcel, pass_values
  use element, only: force_report_t
  use solid_patch, only: solid_patch_t, tile_buffer_t, find_blocks_of
  implicit none
  private

  public :: complete_tiles, exchange_tiles, pass_tiles, pass_reports, find_rows, costs_of_tiles
  public :: gather_blocks, sum_of_blocks

  integer, parameter :: n_numbers = 5   !! of a report, without the part

contains

  !> In a parallel region that has worked the own tiles: those of the other processes, if there are
  !! any, before its threads add them up.
  subroutine complete_tiles(patch, reports, buffers, force, more_buffers, more)
    type(solid_patch_t), intent(inout) :: patch
    type(force_report_t), intent(inout) :: reports(:)               !! see `exchange_tiles`
    type(tile_buffer_t), intent(inout) :: buffers(:)
    real(wp), intent(inout), contiguous, optional :: force(:, :, :, :)
    type(tile_buffer_t), intent(inout), optional :: more_buffers(:)
    real(wp), intent(inout), contiguous, optional :: more(:, :, :, :)

    if (.not. patch%shares%is_shared) return
    !$omp master
    call exchange_tiles(patch, reports, buffers, force, more_buffers, more)
    !$omp end master
    !$omp barrier
  end subroutine complete_tiles

  !> What all tiles have found, at all processes.
  subroutine exchange_tiles(patch, reports, buffers, force, more_buffers, more)
    type(solid_patch_t), intent(inout) :: patch
    type(force_report_t), intent(inout) :: reports(:)               !! of the tiles
    type(tile_buffer_t), intent(inout) :: buffers(:)                !! of the tiles
    !> The rows that tiles own; absent where all is in the buffers.
    real(wp), intent(inout), contiguous, optional :: force(:, :, :, :)
    type(tile_buffer_t), intent(inout), optional :: more_buffers(:) !! of a second field
    real(wp), intent(inout), contiguous, optional :: more(:, :, :, :)
    integer, parameter :: all_rows(2) = [1, huge(1)]
    type(parcel_t) :: own, joined
    integer :: r, room

    room = sum([(size(buffers(r)%force), r=patch%shares%first, patch%shares%last)])
    if (present(force)) room = room + size(force)
    call empty_parcel(own, room)
    call pass_found(patch%shares%ranks%number, .true., own)
    call gather_parcels(patch%shares%ranks, own, joined, patch%shares%traffic)
    do r = 0, patch%shares%ranks%n - 1
      call pass_found(r, .false., joined)
    end do

  contains

    !> All that the tiles of a process have found.
    subroutine pass_found(process, is_sent, parcel)
      integer, intent(in) :: process
      logical, intent(in) :: is_sent
      type(parcel_t), intent(inout) :: parcel

      call pass_reports(patch, process, is_sent, reports, parcel)
      call pass_tiles(patch, process, all_rows, is_sent, buffers, parcel, force)
      if (present(more)) call pass_tiles(patch, process, all_rows, is_sent, more_buffers, parcel, &
                                         more)
    end subroutine pass_found
  end subroutine exchange_tiles

  !> Some rows of what the tiles of a process have found, into a parcel or out of it.
  subroutine pass_tiles(patch, process, rows, is_sent, buffers, parcel, field)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: process                     !! its number
    integer, intent(in) :: rows(2)                     !! first and last
    logical, intent(in) :: is_sent                     !! else received
    type(tile_buffer_t), intent(inout) :: buffers(:)   !! of the tiles
    type(parcel_t), intent(inout) :: parcel
    real(wp), intent(inout), contiguous, optional :: field(:, :, :, :)
    integer :: t

    do t = first_of(patch, process), patch%shares%last_of(process + 1)
      associate (tile => patch%tiles(t), border => buffers(t)%force)
        if (present(field)) call pass_rows(is_sent, shape(field), 1, parcel, field, &
                                           max(tile%control_first(2), rows(1)), &
                                           min(tile%own_last, rows(2)))
        call pass_rows(is_sent, shape(border), lbound(border, 2), parcel, border, &
                       max(lbound(border, 2), rows(1)), min(ubound(border, 2), rows(2)))
      end associate
    end do
  end subroutine pass_tiles

  !> Some rows of a field.
  subroutine pass_rows(is_sent, n, low, parcel, field, first, last)
    logical, intent(in) :: is_sent
    integer, intent(in) :: n(4), low                   !! shape, number of its first row
    integer, intent(in) :: first, last                 !! rows that pass
    type(parcel_t), intent(inout) :: parcel
    real(wp), intent(inout) :: field(n(1), low:low + n(2) - 1, n(3)*n(4))
    integer :: j, k

    do k = 1, size(field, 3)
      do j = first, last
        call pass_values(parcel, is_sent, n(1), field(:, j, k))
      end do
    end do
  end subroutine pass_rows

  !> Rows of control points of the processes, along axis 2, where tiles have rows of their own: the
  !! last one that its tiles, or those of processes before, are the first to touch; first and last
  !! row that its tiles touch; and how many numbers they report. Of a process without tiles none.
  pure subroutine find_rows(patch, last_of, moved_by, n_reported)
    type(solid_patch_t), intent(in) :: patch           !! shared
    integer, allocatable, intent(out) :: last_of(:), moved_by(:, :), n_reported(:)
    integer :: r, first, last

    if (any(patch%tiles%own_last < patch%tiles%control_first(2))) return
    associate (n => patch%shares%ranks%n)
      allocate (last_of(n), moved_by(2, n))
      n_reported = [(n_reports_of(patch, r), r=0, n - 1)]
      do r = 1, n
        last = patch%shares%last_of(r)
        first = 1
        if (r > 1) first = last_of(r - 1) + 1
        last_of(r) = patch%n_control(2)
        if (last == 0) last_of(r) = 0
        if (last < size(patch%tiles) .and. last > 0) &
          last_of(r) = patch%tiles(last + 1)%control_first(2) - 1
        moved_by(:, r) = [first, last_of(r)]
        if (last_of(r) >= first) moved_by(2, r) = max(last_of(r), patch%tiles(last)%control_last(2))
      end do
    end associate
  end subroutine find_rows

  !> Time that the tiles have taken here, with that of the rows that each is the first to touch.
  pure function costs_of_tiles(patch, row_costs) result(costs)
    type(solid_patch_t), intent(in) :: patch           !! shared before
    real(wp), intent(in) :: row_costs(:)
    real(wp) :: costs(size(patch%tiles))
    integer :: t, last

    costs = real(patch%shares%ticks, wp)
    last = size(row_costs)
    do t = size(costs), 1, -1
      associate (first => merge(1, patch%tiles(t)%control_first(2), t == 1))
        costs(t) = costs(t) + sum(row_costs(first:last))
        last = min(last, first - 1)
      end associate
    end do
  end function costs_of_tiles

  !> How many numbers `pass_reports` passes of the tiles of a process.
  pure integer function n_reports_of(patch, process) result(n)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: process                     !! its number

    n = n_numbers*(patch%shares%last_of(process + 1) - first_of(patch, process) + 1)
  end function n_reports_of

  !> First tile of a process.
  pure integer function first_of(patch, process) result(first)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: process                     !! its number

    first = 1
    if (process > 0) first = patch%shares%last_of(process) + 1
  end function first_of

  !> The reports of the tiles of a process, into a parcel or out of it. A block number may be huge,
  !! but is a number that a real one holds.
  pure subroutine pass_reports(patch, process, is_sent, reports, parcel)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: process                     !! its number
    logical, intent(in) :: is_sent                     !! else received
    type(force_report_t), intent(inout) :: reports(:)  !! of the tiles
    type(parcel_t), intent(inout) :: parcel
    real(wp) :: values(n_numbers)
    integer :: t

    do t = first_of(patch, process), patch%shares%last_of(process + 1)
      values = [reports(t)%internal_work, reports(t)%viscous_work, reports(t)%largest_rate, &
                reports(t)%smallest_det, real(reports(t)%failed_block, wp)]
      call pass_values(parcel, is_sent, n_numbers, values)
      if (is_sent) cycle
      reports(t)%internal_work = values(1)
      reports(t)%viscous_work = values(2)
      reports(t)%largest_rate = values(3)
      reports(t)%smallest_det = values(4)
      reports(t)%failed_block = nint(values(5))
    end do
  end subroutine pass_reports

  !> Sum over all blocks in their order, of numbers that each process has of its own ones.
  function sum_of_blocks(patch, n, values) result(total)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: n                          !! numbers of a block
    real(wp), intent(inout) :: values(n, patch%n_blocks)   !! those of all afterwards
    real(wp) :: total

    if (patch%shares%is_shared) call gather_blocks(patch, n, values)
    total = sum(values)
  end function sum_of_blocks

  !> Numbers of the blocks that each process has of its own ones, at all processes.
  subroutine gather_blocks(patch, n, values)
    type(solid_patch_t), intent(in) :: patch          !! shared
    integer, intent(in) :: n                          !! numbers of a block
    real(wp), intent(inout) :: values(n, patch%n_blocks)
    real(wp), allocatable :: own(:), joined(:)
    integer, allocatable :: blocks(:)
    integer :: counts(patch%shares%ranks%n), r, i, at, first

    allocate (joined(size(values)))
    first = 1
    do r = 1, size(counts)
      call find_blocks_of(patch, first, patch%shares%last_of(r), blocks)
      first = patch%shares%last_of(r) + 1
      counts(r) = n*size(blocks)
      if (r == patch%shares%ranks%number + 1) own = reshape(values(:, blocks), [counts(r)])
    end do
    call patch%shares%ranks%gather(counts, own, joined, .true.)
    first = 1
    at = 0
    do r = 1, size(counts)
      call find_blocks_of(patch, first, patch%shares%last_of(r), blocks)
      first = patch%shares%last_of(r) + 1
      do i = 1, size(blocks)
        values(:, blocks(i)) = joined(at + 1:at + n)
        at = at + n
      end do
    end do
  end subroutine gather_blocks

end module tile_exchange
