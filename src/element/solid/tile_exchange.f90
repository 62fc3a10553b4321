!> What processes that share the tiles of a patch exchange in an evaluation of its forces: reports
!! of their tiles, forces on the rows that tiles own, buffers for the others. Everybody gets the
!! buffers as they are and adds them in the order of the tiles, as one process does.
module tile_exchange
  use kinds, only: wp
  use ranks, only: gather_counted
  use element, only: force_report_t
  use solid_patch, only: solid_patch_t, tile_t, tile_buffer_t, find_blocks_of
  implicit none
  private

  public :: complete_tiles, exchange_tiles, gather_blocks, sum_of_blocks

  integer, parameter :: n_reported = 5   !! numbers of a report, without the part

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

  !> Send the own tiles, and receive those of the others.
  subroutine exchange_tiles(patch, reports, buffers, force, more_buffers, more)
    type(solid_patch_t), intent(inout) :: patch
    type(force_report_t), intent(inout) :: reports(:)               !! of the tiles
    type(tile_buffer_t), intent(inout) :: buffers(:)                !! of the tiles
    !> The rows that tiles own; absent where all is in the buffers.
    real(wp), intent(inout), contiguous, optional :: force(:, :, :, :)
    type(tile_buffer_t), intent(inout), optional :: more_buffers(:) !! of a second field
    real(wp), intent(inout), contiguous, optional :: more(:, :, :, :)
    integer :: counts(patch%shares%ranks%n), t, r, at

    counts = 0
    r = 1
    do t = 1, size(patch%tiles)
      do while (t > patch%shares%last_of(r))
        r = r + 1
      end do
      counts(r) = counts(r) + n_reported + size_of(patch%tiles(t), buffers(t), force)
      if (present(more)) counts(r) = counts(r) &
                                     + size_of(patch%tiles(t), more_buffers(t), more)
    end do
    call make_room(counts(patch%shares%ranks%number + 1), patch%shares%own)
    call make_room(sum(counts), patch%shares%joined)
    associate (shares => patch%shares)
      at = 0
      do t = shares%first, shares%last
        call pack_report(reports(t), shares%own, at)
        call pack_field(patch%tiles(t), buffers(t), shares%own, at, force)
        if (present(more)) call pack_field(patch%tiles(t), more_buffers(t), shares%own, at, more)
      end do
      call gather_counted(shares%ranks, counts, shares%own, shares%joined, shares%traffic)
      at = 0
      do t = 1, size(patch%tiles)
        if (t == shares%first) at = at + counts(shares%ranks%number + 1)
        if (t >= shares%first .and. t <= shares%last) cycle
        call unpack_report(shares%joined, at, reports(t))
        call unpack_field(patch%tiles(t), shares%joined, at, buffers(t), force)
        if (present(more)) call unpack_field(patch%tiles(t), shares%joined, at, more_buffers(t), &
                                             more)
      end do
    end associate
  end subroutine exchange_tiles

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

  !> At least so much room; what was in it is lost if it was less.
  pure subroutine make_room(n, room)
    integer, intent(in) :: n
    real(wp), allocatable, intent(inout) :: room(:)

    if (allocated(room)) then
      if (size(room) >= n) return
      deallocate (room)
    end if
    allocate (room(n))
  end subroutine make_room

  !> Numbers that a tile has of a field.
  pure integer function size_of(tile, buffer, field) result(n)
    type(tile_t), intent(in) :: tile
    type(tile_buffer_t), intent(in) :: buffer
    real(wp), intent(in), contiguous, optional :: field(:, :, :, :)

    n = size(buffer%force)
    if (present(field)) n = n + size(field, 1)*size(field, 3)*size(field, 4) &
                                *max(0, tile%own_last - tile%control_first(2) + 1)
  end function size_of

  !> A block number may be huge, but is a number that a real one holds.
  pure subroutine pack_report(report, room, at)
    type(force_report_t), intent(in) :: report
    real(wp), intent(inout) :: room(:)
    integer, intent(inout) :: at

    room(at + 1:at + n_reported) = [report%internal_work, report%viscous_work, &
                                    report%largest_rate, report%smallest_det, &
                                    real(report%failed_block, wp)]
    at = at + n_reported
  end subroutine pack_report

  pure subroutine unpack_report(room, at, report)
    real(wp), intent(in) :: room(:)
    integer, intent(inout) :: at
    type(force_report_t), intent(inout) :: report

    report%internal_work = room(at + 1)
    report%viscous_work = room(at + 2)
    report%largest_rate = room(at + 3)
    report%smallest_det = room(at + 4)
    report%failed_block = nint(room(at + 5))
    at = at + n_reported
  end subroutine unpack_report

  pure subroutine pack_field(tile, buffer, room, at, field)
    type(tile_t), intent(in) :: tile
    type(tile_buffer_t), intent(in) :: buffer
    real(wp), intent(inout) :: room(:)
    integer, intent(inout) :: at
    real(wp), intent(in), contiguous, optional :: field(:, :, :, :)
    integer :: j, k, c, n

    if (present(field)) then
      n = size(field, 1)
      do c = 1, size(field, 4)
        do k = 1, size(field, 3)
          do j = tile%control_first(2), tile%own_last
            room(at + 1:at + n) = field(:, j, k, c)
            at = at + n
          end do
        end do
      end do
    end if
    n = size(buffer%force, 1)
    do c = lbound(buffer%force, 4), ubound(buffer%force, 4)
      do k = lbound(buffer%force, 3), ubound(buffer%force, 3)
        do j = lbound(buffer%force, 2), ubound(buffer%force, 2)
          room(at + 1:at + n) = buffer%force(:, j, k, c)
          at = at + n
        end do
      end do
    end do
  end subroutine pack_field

  pure subroutine unpack_field(tile, room, at, buffer, field)
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: room(:)
    integer, intent(inout) :: at
    type(tile_buffer_t), intent(inout) :: buffer
    real(wp), intent(inout), contiguous, optional :: field(:, :, :, :)
    integer :: j, k, c, n

    if (present(field)) then
      n = size(field, 1)
      do c = 1, size(field, 4)
        do k = 1, size(field, 3)
          do j = tile%control_first(2), tile%own_last
            field(:, j, k, c) = room(at + 1:at + n)
            at = at + n
          end do
        end do
      end do
    end if
    n = size(buffer%force, 1)
    do c = lbound(buffer%force, 4), ubound(buffer%force, 4)
      do k = lbound(buffer%force, 3), ubound(buffer%force, 3)
        do j = lbound(buffer%force, 2), ubound(buffer%force, 2)
          buffer%force(:, j, k, c) = room(at + 1:at + n)
          at = at + n
        end do
      end do
    end do
  end subroutine unpack_field

end module tile_exchange
