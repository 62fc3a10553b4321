!> Internal forces of a patch in plane strain: tiles in parallel, then added up on both sides.
module plane_strain_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use element, only: force_report_t
  use ig_patch, only: ig_patch_t, tile_t
  use plane_strain_data, only: plane_strain_t
  use plane_dispatch, only: run_plane
  use tile_forces, only: add_report
  use solid_forces, only: finish_evaluation
  implicit none
  private

  public :: forces_in_plane

contains

  !> Stress update and internal forces; arguments as of `internal_forces`. Tiles are added up in
  !! their order, whatever the number of threads.
  subroutine forces_in_plane(patch, plane, law, dt, x, v, force, report)
    type(ig_patch_t), intent(inout) :: patch
    type(plane_strain_t), intent(inout) :: plane
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(out) :: report
    type(force_report_t) :: reports(size(patch%tiles))
    real(wp) :: motion(n_lanes, patch%axes(3)%n_points, 9)   ! zero out of the plane, always
    integer :: t

    !$omp parallel default(shared) private(t, motion)
    motion = 0.0_wp
    !$omp do schedule(static)
    do t = 1, size(reports)
      call work_tile(patch, plane, law, patch%tiles(t), dt, x, v, motion, plane%sides(t)%force, &
                     reports(t))
    end do
    !$omp end do
    call add_sides(patch, plane, force)
    !$omp end parallel
    call finish_evaluation(patch, dt, reports, report)
  end subroutine forces_in_plane

  !> The blocks of one tile.
  subroutine work_tile(patch, plane, law, tile, dt, x, v, motion, side, report)
    type(ig_patch_t), intent(inout) :: patch
    type(plane_strain_t), intent(in) :: plane
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(inout) :: motion(n_lanes, patch%axes(3)%n_points, 9)
    real(wp), intent(inout), contiguous :: side(:, :, :, :)
    type(force_report_t), intent(inout) :: report
    real(wp) :: sums(n_lanes, 4)
    integer :: e3, b, block
    logical :: ok

    side = 0.0_wp
    do e3 = 1, patch%axes(3)%n_elements
      do b = tile%block_first, tile%block_last
        block = b + patch%lanes%n_blocks*(e3 - 1)
        call run_plane(patch, plane, law, b, e3, block, dt, x, v, motion, tile%control_first(1), &
                       tile%control_last(1), side, sums, ok)
        call add_report(report, sums, ok, block)
      end do
    end do
  end subroutine work_tile

  !> Add up the tiles, a row of control points along axis 1 by one thread. The sides pull at each
  !! other across, and are else alike.
  subroutine add_sides(patch, plane, force)
    type(ig_patch_t), intent(in) :: patch
    type(plane_strain_t), intent(in) :: plane
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    integer :: t, k, c

    !$omp do schedule(static) collapse(2)
    do c = 1, 3
      do k = 1, patch%n_control(3)
        force(:, 2, k, c) = 0.0_wp
        do t = 1, size(patch%tiles)
          associate (low => patch%tiles(t)%control_first(1), high => patch%tiles(t)%control_last(1))
            force(low:high, 2, k, c) = force(low:high, 2, k, c) + plane%sides(t)%force(:, 1, k, c)
          end associate
        end do
        if (c == plane%places(3)) then
          force(:, 1, k, c) = -force(:, 2, k, c)
        else
          force(:, 1, k, c) = force(:, 2, k, c)
        end if
      end do
    end do
    !$omp end do nowait
  end subroutine add_sides

end module plane_strain_forces
