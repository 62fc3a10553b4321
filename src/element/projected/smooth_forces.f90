!> Forces of a patch whose volume strain is projected onto its smooth splines. Three passes over all
!! blocks: strains to loads of the splines; strains of the splines to stresses and on to their
!! loads; stresses of the splines to forces. In between the splines' coefficients are solved for.
!! Tiles and lines are worked in parallel and added up in fixed order.
module smooth_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use point_context, only: point_context_t
  use element, only: force_report_t
  use ig_patch, only: ig_patch_t, tile_t, tile_buffer_t
  use strain_projection, only: projection_t
  use smooth_fields, only: smooth_fields_t
  use smooth_block, only: collect_strain, collect_stress, spread_strain, spread_stress
  use smooth_lines, only: solve_for_splines
  use point_fields, only: point_fields_t, new_point_fields
  use projected_dispatch, only: run_strain, run_nodal
  use projected_block, only: start_strain, finish_strain, update_stress, start_stress, finish_stress
  use tile_forces, only: gather_motion, gather_positions, add_forces, place_context, &
                         new_patch_context, &
                         clear_rows, add_report
  implicit none
  private

  public :: smooth_tile_forces

contains

  !> Forces of all tiles, with a report for each; `add_tiles` must follow.
  subroutine smooth_tile_forces(patch, projection, fields, buffers, law, dt, x, v, force, reports)
    type(ig_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    type(smooth_fields_t), intent(inout) :: fields
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                             !! [time]
    real(wp), intent(in) :: x(:, :, :, :), v(:, :, :, :)   !! end of step, middle of step
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(out) :: reports(size(buffers))
    integer :: t

    !$omp parallel do schedule(static) default(shared) private(t) if (.not. law%is_serial)
    do t = 1, size(buffers)
      call strain_of_tile(patch, projection, patch%tiles(t), dt, x, v, fields)
    end do
    !$omp end parallel do
    call solve_for_splines(patch, projection%smooth, size(fields%all, 4), fields)
    !$omp parallel do schedule(static) default(shared) private(t) if (.not. law%is_serial)
    do t = 1, size(buffers)
      call stress_of_tile(patch, projection, law, patch%tiles(t), dt, x, v, fields, reports(t))
    end do
    !$omp end parallel do
    call solve_for_splines(patch, projection%smooth, 1, fields)
    !$omp parallel do schedule(static) default(shared) private(t) if (.not. law%is_serial)
    do t = 1, size(buffers)
      call nodal_of_tile(patch, projection, patch%tiles(t), x, fields, force, buffers(t)%force)
    end do
    !$omp end parallel do
  end subroutine smooth_tile_forces

  !> Loads of the strains of a tile.
  subroutine strain_of_tile(patch, projection, tile, dt, x, v, fields)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    type(smooth_fields_t), intent(inout) :: fields
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), sums(n_lanes, 4)
    type(point_fields_t) :: slot
    integer :: e2, e3, b, block

    slot = new_slot(patch, projection)
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = tile%row_first, tile%row_last
        do b = tile%block_first, tile%block_last
          block = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
          call gather_motion(patch, b, e2, e3, dt, x, v, u, w)
          call run_strain(patch, projection, b, e2, e3, block, 1, .false., u, slot, sums)
          call start_strain(patch, 1, slot)
          call collect_strain(patch, b, e2, e3, block, slot, fields)
        end do
      end do
    end do
  end subroutine strain_of_tile

  !> Stresses of a tile and their loads. Kinematics are worked out once more instead of being kept.
  subroutine stress_of_tile(patch, projection, law, tile, dt, x, v, fields, report)
    type(ig_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    type(smooth_fields_t), intent(inout) :: fields
    type(force_report_t), intent(out) :: report
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), sums(n_lanes, 4)
    type(point_context_t) :: context
    type(point_fields_t) :: slot
    integer :: e2, e3, b, block
    logical :: ok

    slot = new_slot(patch, projection)
    if (allocated(patch%reference)) context = new_patch_context(patch)
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = tile%row_first, tile%row_last
        do b = tile%block_first, tile%block_last
          block = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
          call gather_motion(patch, b, e2, e3, dt, x, v, u, w)
          call run_strain(patch, projection, b, e2, e3, block, 1, .true., u, slot, sums)
          call spread_strain(patch, b, e2, e3, fields, slot)
          call finish_strain(patch, projection, 1, slot)
          if (allocated(patch%reference)) call place_context(patch, b, e2, e3, block, context)
          call update_stress(patch, law, block, 1, dt, context, slot, sums, ok)
          call start_stress(patch, projection, 1, slot)
          call collect_stress(patch, b, e2, e3, block, slot, fields)
          fields%rest(:, :, :, block) = slot%weighted(:, :, :, 1)
          call add_report(report, sums, ok, block)
        end do
      end do
    end do
  end subroutine stress_of_tile

  !> Forces of the blocks of a tile.
  subroutine nodal_of_tile(patch, projection, tile, x, fields, force, border)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: x(:, :, :, :)
    type(smooth_fields_t), intent(in) :: fields
    real(wp), intent(inout), contiguous :: force(:, :, :, :), border(:, :, :, :)
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 3), f(size(u, 1), 3)
    real(wp) :: w(merge(size(f, 1), 0, patch%is_rational))
    type(point_fields_t) :: slot
    integer :: e2, e3, b, block

    slot = new_slot(patch, projection)
    call clear_rows(tile, force, border)
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = tile%row_first, tile%row_last
        do b = tile%block_first, tile%block_last
          block = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
          slot%weighted(:, :, :, 1) = fields%rest(:, :, :, block)
          call spread_stress(patch, b, e2, e3, fields, slot)
          call finish_stress(patch, projection, 1, slot)
          call gather_positions(patch, b, e2, e3, x, u, w)
          call run_nodal(patch, projection, b, e2, e3, block, 1, u, slot, slot%plane, f)
          call add_forces(patch, tile, b, e2, e3, w, f, force, border)
        end do
      end do
    end do
  end subroutine nodal_of_tile

  !> Fields of the points of one block.
  pure function new_slot(patch, projection) result(slot)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(point_fields_t) :: slot

    slot = new_point_fields(patch%axes%n_points, 1, projection, &
                            allocated(patch%reference))
  end function new_slot

end module smooth_forces
