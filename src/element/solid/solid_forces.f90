!> Internal forces of a patch of plain solids: tiles in parallel, then added up in fixed order.
module solid_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use element, only: force_report_t, merge_reports
  use ig_patch, only: ig_patch_t, tile_buffer_t
  use tile_forces, only: forces_of_tile
  implicit none
  private

  public :: internal_forces, add_tiles, finish_evaluation

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

    !$omp parallel default(shared) private(t) if (.not. law%is_serial)
    !$omp do schedule(static)
    do t = 1, size(buffers)
      call forces_of_tile(patch, law, patch%tiles(t), dt, x, v, force, buffers(t)%force, reports(t))
    end do
    !$omp end do
    call add_tiles(patch, buffers, force)
    !$omp end parallel
    call finish_evaluation(patch, dt, reports, report)
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

  !> The evaluation is one increment more; its report is that of all tiles, in their order.
  pure subroutine finish_evaluation(patch, dt, reports, report)
    type(ig_patch_t), intent(inout) :: patch
    real(wp), intent(in) :: dt
    type(force_report_t), intent(in) :: reports(:)     !! of the tiles
    type(force_report_t), intent(out) :: report
    integer :: t

    patch%time = patch%time + dt
    patch%increment = patch%increment + 1
    do t = 1, size(reports)
      call merge_reports(report, reports(t))
      report%failed_block = min(report%failed_block, reports(t)%failed_block)
    end do
  end subroutine finish_evaluation

end module solid_forces
