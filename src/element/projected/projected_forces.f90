!> Internal forces of a patch whose strains are projected against locking.
module projected_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use point_context, only: point_context_t
  use element, only: force_report_t
  use ig_patch, only: ig_patch_t, tile_t, tile_buffer_t
  use strain_projection, only: projection_t
  use point_fields, only: point_fields_t, new_point_fields
  use projected_block, only: run_projected
  use smooth_fields, only: smooth_fields_t
  use smooth_forces, only: smooth_tile_forces
  use solid_forces, only: add_tiles, finish_evaluation
  use tile_forces, only: gather_motion, add_forces, place_context, new_patch_context, clear_rows, &
                         add_report
  implicit none
  private

  public :: forces_of_projection

contains

  !> Stress update and internal forces; arguments as of `internal_forces`.
  subroutine forces_of_projection(patch, projection, smooth, buffers, law, dt, x, v, force, report)
    type(ig_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    type(smooth_fields_t), allocatable, intent(inout) :: smooth   !! of a smooth projection
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(out) :: report
    type(force_report_t) :: reports(size(buffers))
    integer :: t

    if (allocated(smooth)) call smooth_tile_forces(patch, projection, smooth, buffers, law, dt, &
                                                   x, v, force, reports)
    !$omp parallel default(shared) private(t) if (.not. law%is_serial)
    if (.not. allocated(smooth)) then
      !$omp do schedule(static)
      do t = 1, size(buffers)
        call forces_of_tile(patch, projection, law, patch%tiles(t), dt, x, v, force, &
                            buffers(t)%force, reports(t))
      end do
      !$omp end do
    end if
    call add_tiles(patch, buffers, force)
    !$omp end parallel
    call finish_evaluation(patch, dt, reports, report)
  end subroutine forces_of_projection

  !> The blocks of one tile, each projected on its own.
  subroutine forces_of_tile(patch, projection, law, tile, dt, x, v, force, border, report)
    type(ig_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :), border(:, :, :, :)
    type(force_report_t), intent(out) :: report
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6), f(size(u, 1), 3)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), sums(n_lanes, 4)
    type(point_context_t) :: context
    type(point_fields_t) :: fields
    integer :: e2, e3, b, block
    logical :: ok

    if (allocated(patch%reference)) context = new_patch_context(patch)
    fields = new_point_fields(patch%axes%n_points, 1, projection, allocated(patch%reference))
    call clear_rows(tile, force, border)
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = tile%row_first, tile%row_last
        do b = tile%block_first, tile%block_last
          block = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
          call gather_motion(patch, b, e2, e3, dt, x, v, u, w)
          if (allocated(patch%reference)) call place_context(patch, b, e2, e3, block, context)
          call run_projected(patch, projection, law, b, e2, e3, block, dt, u, context, fields, f, &
                             sums, ok)
          call add_forces(patch, tile, b, e2, e3, w, f, force, border)
          call add_report(report, sums, ok, block)
        end do
      end do
    end do
  end subroutine forces_of_tile

end module projected_forces
