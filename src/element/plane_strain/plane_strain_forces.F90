!> Internal forces of a patch in plane strain: tiles in parallel, each block by its kernel instance,
!! then added up on both sides.
module plane_strain_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use element, only: force_report_t
  use solid_patch, only: solid_patch_t, plane_strain_t, tile_t, block_t, n_blocks_of, next_block
  use bulk_viscosity, only: viscous_factors
  use tile_exchange, only: complete_tiles
  use tile_shares, only: begin_tile, end_tile
  use solid_forces, only: add_report, finish_evaluation
#include "plane_strain_uses.inc"
  implicit none
  private

  public :: forces_in_plane, plane_kernel_of, plane_kernel_name

  !> Degrees and points along axes 1 and 3 of the tuned instances; the general one is behind them.
#include "plane_strain_rules.inc"

contains

  !> Stress update and internal forces; arguments as of `internal_forces`. Tiles are added up in
  !! their order, whatever the number of threads.
  subroutine forces_in_plane(patch, plane, law, dt, x, v, force, report)
    type(solid_patch_t), intent(inout) :: patch
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
    do t = patch%shares%first, patch%shares%last
      call begin_tile(patch%shares, t)
      call work_tile(patch, plane, law, patch%tiles(t), dt, x, v, motion, plane%sides(t)%force, &
                     reports(t))
      call end_tile(patch%shares, t)
    end do
    !$omp end do
    call complete_tiles(patch, reports, plane%sides)
    call add_sides(patch, plane, force)
    !$omp end parallel
    call finish_evaluation(patch, dt, reports, report)
  end subroutine forces_in_plane

  !> The blocks of one tile.
  subroutine work_tile(patch, plane, law, tile, dt, x, v, motion, side, report)
    type(solid_patch_t), intent(inout) :: patch
    type(plane_strain_t), intent(in) :: plane
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(inout) :: motion(n_lanes, patch%axes(3)%n_points, 9)
    real(wp), intent(inout), contiguous :: side(:, :, :, :)
    type(force_report_t), intent(inout) :: report
    real(wp) :: sums(n_lanes, 4)
    type(block_t) :: block
    integer :: i
    logical :: ok

    side = 0.0_wp
    do i = 1, n_blocks_of(patch, tile)
      call next_block(patch, tile, block)
      call run_plane(patch, plane, law, block, dt, x, v, motion, tile%control_first(1), &
                     tile%control_last(1), side, sums, ok)
      call add_report(report, sums, ok, block)
    end do
  end subroutine work_tile

  !> Add up the tiles, a row of control points along axis 1 by one thread. The sides pull at each
  !! other across, and are else alike.
  subroutine add_sides(patch, plane, force)
    type(solid_patch_t), intent(in) :: patch
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

  !> Number of the kernel instance that serves these degrees and points.
  pure integer function plane_kernel_of(degrees, n_points) result(kernel)
    integer, intent(in) :: degrees(3), n_points(3)

    do kernel = 1, size(tuned_rules, 2)
      if (all(tuned_rules(:, kernel) == [degrees([1, 3]), n_points([1, 3])])) exit
    end do
  end function plane_kernel_of

  !> Name of a kernel instance for the log, such as `p212_q214_plane_strain`.
  pure function plane_kernel_name(kernel) result(name)
    integer, intent(in) :: kernel   !! from `plane_kernel_of`
    character(:), allocatable :: name
    character(9) :: code

    name = "general_plane_strain"
    if (kernel > size(tuned_rules, 2)) return
    write (code, "('p', i1, '1', i1, '_q', i1, '1', i1)") tuned_rules(:, kernel)
    name = code//"_plane_strain"
  end function plane_kernel_name

  !> Stress update and forces of a block.
  subroutine run_plane(patch, plane, law, block, dt, x, v, motion, lower, upper, side, sums, ok)
    type(solid_patch_t), intent(inout) :: patch
    type(plane_strain_t), intent(in) :: plane
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: x(*), v(*)                  !! of the patch
    real(wp), intent(inout) :: motion(*)                !! zero at the start, see block_forces
    integer, intent(in) :: lower, upper                 !! control points along axis 1 of `side`
    real(wp), intent(inout) :: side(*)                  !! forces on it
    real(wp), intent(out) :: sums(n_lanes, 4)           !! see block_forces
    logical, intent(out) :: ok
    real(wp) :: viscous(n_lanes, 2)

    viscous = viscous_factors(patch%viscosity, block%number, dt)
    associate (p => patch%axes%degree, q => patch%axes%n_points)
      select case (plane%kernel)
#include "plane_strain_cases.inc"
      end select
    end associate
  end subroutine run_plane

end module plane_strain_forces
