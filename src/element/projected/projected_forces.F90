!> Internal forces of a patch whose strains are projected against locking on each element, or whose
!! law asks for the context of its points. Group of blocks by group: kinematics, projection of
!! strains, stress, projection of stresses, forces. The numbers of the kernel instances are those of
!! `kernel_dispatch`.
module projected_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use element, only: force_report_t
  use solid_patch, only: solid_patch_t, tile_t, tile_buffer_t, block_t, n_elements_of, next_group, &
                         most_in_group, cut_number
  use tile_exchange, only: complete_tiles
  use tile_shares, only: begin_tile, end_tile
  use strain_projection, only: projection_t, project_nothing, project_sheet, project_along
  use projected_points, only: correct_volume, split_volume, join_volume, &
                              correct_sheet, split_sheet, join_sheet, logarithmic_volumes, &
                              set_volumes
  use point_stress, only: point_fields_t, point_group_t, update_stress
  use solid_forces, only: gather_motion, gather_weights, add_forces, clear_rows, add_report, &
                          add_tiles, finish_evaluation
#include "ig_strain_uses.inc"
#include "ig_context_uses.inc"
#include "ig_nodal_uses.inc"
#include "ig_cutcontext_uses.inc"
#include "ig_cutnodal_uses.inc"
  implicit none
  private

  public :: forces_of_projection, find_strain, find_forces
  public :: set_point_fields, run_strain, run_nodal
  public :: start_strain, finish_strain, start_stress, finish_stress

  logical, parameter :: all_axes(3) = .true.
  logical, parameter :: first_axis(3) = [.true., .false., .false.]
  logical, parameter :: second_axis(3) = [.false., .true., .false.]

contains

  !> Stress update and internal forces; arguments as of `internal_forces`.
  subroutine forces_of_projection(patch, projection, buffers, law, dt, x, v, force, report)
    type(solid_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(out) :: report
    type(force_report_t) :: reports(size(buffers))

    !$omp parallel default(shared) if (.not. law%is_serial)
    call forces_of_tiles(patch, projection, buffers, law, dt, x, v, force, reports)
    call complete_tiles(patch, reports, buffers, force)
    call add_tiles(patch, buffers, force)
    !$omp end parallel
    call finish_evaluation(patch, dt, reports, report)
  end subroutine forces_of_projection

  !> The tiles, shared by the threads of a region, each of which has room for the points of a group
  !! of blocks.
  subroutine forces_of_tiles(patch, projection, buffers, law, dt, x, v, force, reports)
    type(solid_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(inout) :: reports(:)
    type(point_group_t) :: group
    type(point_fields_t) :: fields(merge(1, most_in_group, law%n_together == 1))
    integer :: t

    !$omp do schedule(static)
    do t = patch%shares%first, patch%shares%last
      call begin_tile(patch%shares, t)
      call forces_of_tile(patch, projection, law, patch%tiles(t), dt, x, v, group, fields, force, &
                          buffers(t)%force, reports(t))
      call end_tile(patch%shares, t)
    end do
    !$omp end do
  end subroutine forces_of_tiles

  !> The blocks of one tile, each projected on its own, in groups for the law.
  subroutine forces_of_tile(patch, projection, law, tile, dt, x, v, group, fields, force, border, &
                            report)
    type(solid_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    type(point_group_t), intent(inout) :: group
    type(point_fields_t), intent(inout) :: fields(:)
    real(wp), intent(inout), contiguous :: force(:, :, :, :), border(:, :, :, :)
    type(force_report_t), intent(out) :: report
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6), f(size(u, 1), 3)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational))
    type(block_t) :: blocks(most_in_group)
    integer :: i, n, n_left
    logical :: ok(most_in_group)

    call clear_rows(tile, force, border)
    n = 0
    n_left = n_elements_of(patch, tile)
    do while (n_left > 0)
      call next_group(patch, tile, law%n_together, n_left, blocks, n)
      do i = 1, n
        if (.not. allocated(fields(i)%dstrain)) call set_point_fields(patch, projection, fields(i))
        call gather_motion(patch, blocks(i), dt, x, v, u, w)
        call find_strain(patch, projection, blocks(i), u, fields(i))
      end do
      call update_stress(patch, law, blocks(:n), dt, group, fields(:n), ok(:n))
      do i = 1, n
        call find_forces(patch, projection, blocks(i), u, fields(i), f)
        if (patch%is_rational) call gather_weights(patch, blocks(i), w)
        call add_forces(patch, tile, blocks(i), w, f, force, border)
        call add_report(report, fields(i)%sums, ok(i), blocks(i))
      end do
    end do
  end subroutine forces_of_tile

  !> Strains of a block, projected.
  subroutine find_strain(patch, projection, block, u, fields)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: u(*)                     !! from gather_motion
    type(point_fields_t), intent(inout) :: fields

    call run_strain(patch, projection, block, .true., u, fields)
    call start_strain(projection, fields)
    call project_block(patch, projection, .false., fields)
    call finish_strain(projection, fields)
  end subroutine find_strain

  !> Control-point forces of a block by its stresses, projected.
  subroutine find_forces(patch, projection, block, u, fields, f)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: u(*)                     !! positions, for smooth projections
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(inout) :: f(*)

    call start_stress(projection, fields)
    call project_block(patch, projection, .true., fields)
    call finish_stress(projection, fields)
    call run_nodal(patch, projection, block, u, fields, f)
  end subroutine find_forces

  !> Room for the points of a block.
  pure subroutine set_point_fields(patch, projection, fields)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(point_fields_t), intent(out) :: fields
    integer :: q(3), points, rows, n_sheet, n_whole, n_gradients, n_growth

    q = patch%axes%n_points
    points = n_lanes*q(3)
    rows = q(1)*q(2)
    fields%n_layers = q(3)
    fields%n_rows = rows
    n_sheet = merge(rows, 0, projection%kind == project_sheet)
    n_whole = merge(0, rows, projection%is_smooth)
    n_gradients = merge(rows, 0, patch%has_gradients)
    n_growth = merge(n_gradients, 0, projection%kind /= project_nothing)
    allocate (fields%dstrain(points, 6, rows), fields%spin(points, 3, rows))
    allocate (fields%volume(points, rows), fields%end_volume(points, rows))
    allocate (fields%mean(points, rows), fields%jacobian(points, 9, n_whole))
    allocate (fields%weighted(points, 6, rows), fields%plane(points, 3, n_sheet))
    allocate (fields%along1(points, 6, n_sheet), fields%along2(points, 6, n_sheet))
    allocate (fields%tangents(points, 12, n_sheet), fields%gradients(points, 18, n_gradients))
    allocate (fields%place(points, 3, merge(rows, 0, patch%has_context)))
    allocate (fields%growth(points, 2, n_growth))
  end subroutine set_point_fields

  !> Fill what is to be projected of the strains of a block.
  pure subroutine start_strain(projection, fields)
    type(projection_t), intent(in) :: projection
    type(point_fields_t), intent(inout) :: fields

    if (projection%kind == project_nothing) return
    fields%mean = fields%dstrain(:, 1, :) + fields%dstrain(:, 2, :) + fields%dstrain(:, 3, :)
    if (size(fields%growth) > 0) &
      call logarithmic_volumes(shape(fields%mean), fields%gradients, fields%growth)
  end subroutine start_strain

  !> Project the strains of a block, or its stresses by the transposed operators.
  pure subroutine project_block(patch, projection, is_stress, fields)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    logical, intent(in) :: is_stress
    type(point_fields_t), intent(inout) :: fields
    integer :: q(3)

    if (projection%kind == project_nothing) return
    q = patch%axes%n_points
    call project_along(projection, all_axes, is_stress, q, 1, fields%mean)
    if (projection%kind == project_sheet) then
      if (.not. is_stress) fields%along1 = fields%dstrain
      if (.not. is_stress) fields%along2 = fields%dstrain
      call project_along(projection, first_axis, is_stress, q, 6, fields%along1)
      call project_along(projection, second_axis, is_stress, q, 6, fields%along2)
    end if
    if (size(fields%growth) > 0 .and. .not. is_stress) &
      call project_along(projection, all_axes, .false., q, 2, fields%growth)
  end subroutine project_block

  !> Put what has been projected into the strains of a block.
  pure subroutine finish_strain(projection, fields)
    type(projection_t), intent(in) :: projection
    type(point_fields_t), intent(inout) :: fields

    if (projection%kind == project_nothing) return
    if (projection%kind == project_sheet) then
      call correct_sheet(fields%n_layers, fields%n_rows, fields%tangents, fields%mean, &
                         fields%along1, fields%along2, fields%dstrain)
    else
      call correct_volume(fields%n_layers, fields%n_rows, fields%mean, fields%dstrain)
    end if
    if (size(fields%growth) > 0) &
      call set_volumes(shape(fields%mean), fields%growth, fields%gradients)
  end subroutine finish_strain

  !> Split the stresses of a block into what is to be projected and the rest.
  pure subroutine start_stress(projection, fields)
    type(projection_t), intent(in) :: projection
    type(point_fields_t), intent(inout) :: fields

    if (projection%kind == project_nothing) return
    if (projection%kind == project_sheet) then
      call split_sheet(fields%n_layers, fields%n_rows, fields%tangents, fields%weighted, &
                       fields%mean, fields%along1, fields%along2, fields%plane)
    else
      call split_volume(fields%n_layers, fields%n_rows, fields%weighted, fields%mean)
    end if
  end subroutine start_stress

  !> Join the projected stresses of a block; with the rest, but for that of sheets.
  pure subroutine finish_stress(projection, fields)
    type(projection_t), intent(in) :: projection
    type(point_fields_t), intent(inout) :: fields

    if (projection%kind == project_nothing) return
    if (projection%kind == project_sheet) then
      call join_sheet(fields%n_layers, fields%n_rows, fields%mean, fields%along1, &
                      fields%along2, fields%weighted)
    else
      call join_volume(fields%n_layers, fields%n_rows, fields%mean, fields%weighted)
    end if
  end subroutine finish_stress

  !> Kinematics of a block; or no more than strains, spins and their volumes, for a start.
  subroutine run_strain(patch, projection, block, has_end, u, fields)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(block_t), intent(in) :: block
    logical, intent(in) :: has_end                   !! of the step, and the tangents of sheets
    real(wp), intent(in) :: u(*)                     !! from gather_motion
    type(point_fields_t), intent(inout) :: fields
    integer :: p(3), q(3), cut
    logical :: has_jacobian, has_tangents

    has_jacobian = .not. projection%is_smooth
    has_tangents = has_end .and. projection%kind == project_sheet
    p = patch%axes%degree
    q = patch%axes%n_points
    cut = cut_number(patch, block)
    if (cut > 0) then
      select case (2 - mod(patch%kernel, 2))     ! without weights, with weights
#include "ig_cutcontext_cases.inc"
      end select
    else if (patch%has_context) then
      select case (patch%kernel)
#include "ig_context_cases.inc"
      end select
    else
      select case (patch%kernel)
#include "ig_strain_cases.inc"
      end select
    end if
  end subroutine run_strain

  !> Control-point forces of a block.
  subroutine run_nodal(patch, projection, block, u, fields, f)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: u(*)                     !! positions, for smooth projections
    type(point_fields_t), intent(in) :: fields
    real(wp), intent(inout) :: f(*)
    integer :: p(3), q(3), cut
    logical :: has_jacobian, has_plane

    has_jacobian = .not. projection%is_smooth
    has_plane = projection%kind == project_sheet
    p = patch%axes%degree
    q = patch%axes%n_points
    cut = cut_number(patch, block)
    if (cut > 0) then
      select case (2 - mod(patch%kernel, 2))     ! without weights, with weights
#include "ig_cutnodal_cases.inc"
      end select
      return
    end if
    select case (patch%kernel)
#include "ig_nodal_cases.inc"
    end select
  end subroutine run_nodal

end module projected_forces
