!> Internal forces of a patch: tiles in parallel, then added up in fixed order.
module internal_force
  use kinds, only: wp
  use block_law, only: block_law_t
  use element, only: force_report_t
  use ig_patch, only: ig_patch_t, tile_buffer_t
  use tile_forces, only: forces_of_tile
  use plane_forces, only: forces_in_plane
  use smooth_forces, only: smooth_tile_forces
  implicit none
  private

  public :: internal_forces, add_tiles

contains

  !> Stress update and internal forces. The result does not depend on the number of threads:
  !! every tile has its own rows of control points and a buffer for the others that it touches,
  !! and the buffers are added in the order of the tiles.
  subroutine internal_forces(patch, buffers, law, dt, x, v, force, report)
    type(ig_patch_t), intent(inout) :: patch            !! state is carried forward
    type(tile_buffer_t), intent(inout) :: buffers(:)    !! from `new_tile_buffers`
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                          !! [time]
    real(wp), intent(in), contiguous :: x(:, :, :, :)   !! control points at the end of the step
    real(wp), intent(in), contiguous :: v(:, :, :, :)   !! velocities at its middle
    real(wp), intent(inout), contiguous :: force(:, :, :, :)   !! set to it, (n1, n2, n3, 3)
    type(force_report_t), intent(out) :: report
    type(force_report_t) :: reports(size(buffers))
    integer :: t

    if (patch%plane%kernel > 0) then
      call forces_in_plane(patch, law, dt, x, v, force, reports)
    else
      if (patch%projection%is_smooth) &
        call smooth_tile_forces(patch, buffers, law, dt, x, v, force, reports)
      !$omp parallel default(shared) private(t) if (.not. law%is_serial)
      if (.not. patch%projection%is_smooth) then
        !$omp do schedule(static)
        do t = 1, size(buffers)
          call forces_of_tile(patch, law, patch%tiles(t), dt, x, v, force, buffers(t)%force, &
                              reports(t))
        end do
        !$omp end do
      end if
      call add_tiles(patch, buffers, force)
      !$omp end parallel
    end if
    patch%time = patch%time + dt
    patch%increment = patch%increment + 1
    do t = 1, size(buffers)
      report%internal_work = report%internal_work + reports(t)%internal_work
      report%viscous_work = report%viscous_work + reports(t)%viscous_work
      report%largest_rate = max(report%largest_rate, reports(t)%largest_rate)
      report%smallest_det = min(report%smallest_det, reports(t)%smallest_det)
      report%failed_block = min(report%failed_block, reports(t)%failed_block)
    end do
  end subroutine internal_forces

  !> Add the tile buffers to what the tiles have put on their own rows, in the order of the tiles:
  !! the threads of a region share the rows of control points along axis 2, each near the tiles
  !! that it has worked.
  subroutine add_tiles(patch, buffers, force)
    type(ig_patch_t), intent(in) :: patch
    type(tile_buffer_t), intent(in) :: buffers(:)
    real(wp), intent(inout) :: force(:, :, :, :)
    integer :: t, j, k, c

    !$omp do schedule(static)
    do j = 1, patch%n_control(2)
      if (.not. any(patch%tiles%own_last >= j .and. patch%tiles%control_first(2) <= j)) &
        force(:, j, :, :) = 0.0_wp
      do t = 1, size(buffers)
        associate (low => patch%tiles(t)%control_first, high => patch%tiles(t)%control_last)
          if (j <= patch%tiles(t)%own_last .or. j < low(2) .or. j > high(2)) cycle
          do c = 1, 3
            do k = 1, patch%n_control(3)
              force(low(1):high(1), j, k, c) = force(low(1):high(1), j, k, c) &
                                               + buffers(t)%force(:, j, k, c)
            end do
          end do
        end associate
      end do
    end do
    !$omp end do nowait
  end subroutine add_tiles

end module internal_force
