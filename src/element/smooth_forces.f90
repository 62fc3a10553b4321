!> Forces of a patch whose strains are projected onto its smooth splines: kinematics of all blocks,
!! projection along all lines of points, stresses, their transposed projection, forces. Tiles and
!! lines are worked in parallel and added up in fixed order.
module smooth_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use point_context, only: point_context_t, new_point_context
  use ig_patch, only: ig_patch_t, tile_t, tile_buffer_t, force_report_t
  use strain_projection, only: project_sheet
  use smooth_lines, only: project_field
  use point_fields, only: point_fields_t
  use projected_dispatch, only: run_strain, run_nodal
  use projected_block, only: start_strain, finish_strain, update_stress, start_stress, finish_stress
  use tile_forces, only: gather_motion, gather_weights, add_forces, place_context, &
                         clear_rows, add_report
  implicit none
  private

  public :: smooth_tile_forces

contains

  !> Forces of all tiles, with a report for each; `add_tiles` must follow.
  subroutine smooth_tile_forces(patch, buffers, law, dt, x, v, force, reports)
    type(ig_patch_t), intent(inout) :: patch
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                             !! [time]
    real(wp), intent(in) :: x(:, :, :, :), v(:, :, :, :)   !! end of step, middle of step
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(out) :: reports(size(buffers))
    type(point_fields_t), allocatable :: fields

    ! Taken out while it works, so that patch and fields are told apart.
    call move_alloc(patch%fields, fields)
    call work_tiles(patch, buffers, law, dt, x, v, fields, force, reports)
    call move_alloc(fields, patch%fields)
  end subroutine smooth_tile_forces

  subroutine work_tiles(patch, buffers, law, dt, x, v, fields, force, reports)
    type(ig_patch_t), intent(inout) :: patch
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(out) :: reports(size(buffers))
    real(wp) :: sums(n_lanes, 4, patch%n_blocks)
    integer :: t

    !$omp parallel do schedule(static) default(shared) private(t) if (.not. law%is_serial)
    do t = 1, size(buffers)
      call strain_of_tile(patch, patch%tiles(t), dt, x, v, fields, sums)
    end do
    !$omp end parallel do
    call project(patch, .false., fields)
    !$omp parallel do schedule(static) default(shared) private(t) if (.not. law%is_serial)
    do t = 1, size(buffers)
      call stress_of_tile(patch, law, patch%tiles(t), dt, fields, sums, reports(t))
    end do
    !$omp end parallel do
    call project(patch, .true., fields)
    !$omp parallel do schedule(static) default(shared) private(t) if (.not. law%is_serial)
    do t = 1, size(buffers)
      call nodal_of_tile(patch, patch%tiles(t), fields, force, buffers(t)%force)
    end do
    !$omp end parallel do
  end subroutine work_tiles

  !> Kinematics of the blocks of a tile.
  subroutine strain_of_tile(patch, tile, dt, x, v, fields, sums)
    type(ig_patch_t), intent(in) :: patch
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(inout) :: sums(:, :, :)
    real(wp), allocatable :: u(:, :), w(:)
    integer :: e2, e3, b, block, n_values

    n_values = n_lanes*product(patch%axes%degree + 1)
    allocate (u(n_values, 6), w(merge(n_values, 0, patch%is_rational)))
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = tile%row_first, tile%row_last
        do b = tile%block_first, tile%block_last
          block = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
          call gather_motion(patch, b, e2, e3, x, v, u, w)
          call run_strain(patch, b, e2, e3, block, block, dt, u, fields, sums(:, :, block))
          call start_strain(patch, block, fields)
        end do
      end do
    end do
  end subroutine strain_of_tile

  !> Stresses of the blocks of a tile.
  subroutine stress_of_tile(patch, law, tile, dt, fields, sums, report)
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(inout) :: sums(:, :, :)
    type(force_report_t), intent(out) :: report
    type(point_context_t) :: context
    integer :: e2, e3, b, block
    logical :: ok

    if (allocated(patch%reference)) context = new_point_context(n_lanes*patch%axes(3)%n_points)
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = tile%row_first, tile%row_last
        do b = tile%block_first, tile%block_last
          block = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
          if (allocated(patch%reference)) call place_context(patch, b, e2, e3, block, context)
          call finish_strain(patch, block, fields)
          call update_stress(patch, law, block, block, dt, context, fields, sums(:, :, block), ok)
          call start_stress(patch, block, fields)
          call add_report(report, sums(:, :, block), ok, block)
        end do
      end do
    end do
  end subroutine stress_of_tile

  !> Forces of the blocks of a tile.
  subroutine nodal_of_tile(patch, tile, fields, force, border)
    type(ig_patch_t), intent(in) :: patch
    type(tile_t), intent(in) :: tile
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(inout), contiguous :: force(:, :, :, :), border(:, :, :, :)
    real(wp), allocatable :: f(:, :), w(:)
    integer :: e2, e3, b, block, n_values

    n_values = n_lanes*product(patch%axes%degree + 1)
    allocate (f(n_values, 3), w(merge(n_values, 0, patch%is_rational)))
    call clear_rows(tile, force, border)
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = tile%row_first, tile%row_last
        do b = tile%block_first, tile%block_last
          block = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
          call finish_stress(patch, block, fields)
          call run_nodal(patch, b, e2, e3, block, block, fields, f)
          if (patch%is_rational) call gather_weights(patch, b, e2, e3, w)
          call add_forces(patch, tile, b, e2, e3, w, f, force, border)
        end do
      end do
    end do
  end subroutine nodal_of_tile

  !> Project what the blocks have got ready, strains or (transposed) stresses.
  subroutine project(patch, is_transposed, fields)
    type(ig_patch_t), intent(in) :: patch
    logical, intent(in) :: is_transposed
    type(point_fields_t), intent(inout) :: fields

    call project_field(patch, [1, 2, 3], is_transposed, 1, fields%mean)
    if (patch%projection%kind == project_sheet) then
      call project_field(patch, [1], is_transposed, 6, fields%along1)
      call project_field(patch, [2], is_transposed, 6, fields%along2)
    end if
    if (allocated(patch%reference) .and. .not. is_transposed) &
      call project_field(patch, [1, 2, 3], .false., 2, fields%growth)
  end subroutine project

end module smooth_forces
