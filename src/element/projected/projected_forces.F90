!> Internal forces of a patch whose strains are projected against locking on each element. Block by
!! block: kinematics, projection of strains, stress, projection of stresses, forces. The numbers of
!! the kernel instances are those of `kernel_dispatch`.
module projected_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use point_context, only: point_context_t
  use element, only: force_report_t
  use solid_patch, only: solid_patch_t, tile_t, tile_buffer_t, block_t, n_blocks_of, next_block
  use bulk_viscosity, only: viscous_factors
  use strain_projection, only: projection_t, project_sheet, project_along
  use projected_points, only: correct_volume, split_volume, join_volume, &
                              correct_sheet, split_sheet, join_sheet, stress_of_block, &
                              logarithmic_volumes, set_volumes
  use solid_forces, only: gather_motion, add_forces, place_context, new_patch_context, &
                          clear_rows, add_report, add_tiles, finish_evaluation
#include "ig_strain_uses.inc"
#include "ig_nodal_uses.inc"
  implicit none
  private

  public :: forces_of_projection
  public :: new_point_fields, run_strain, run_nodal
  public :: start_strain, finish_strain, update_stress, start_stress, finish_stress

  logical, parameter :: all_axes(3) = .true.
  logical, parameter :: first_axis(3) = [.true., .false., .false.]
  logical, parameter :: second_axis(3) = [.false., .true., .false.]

  !> Fields of the points of a block between kinematics and forces. The last dimension counts rows.
  type, public :: point_fields_t
    integer :: n_layers = 0, n_rows = 0           !! q3, q1*q2
    real(wp), allocatable :: dstrain(:, :, :)     !! (8*q3, 6, q1*q2)
    real(wp), allocatable :: spin(:, :, :)        !! (8*q3, 3, q1*q2)
    real(wp), allocatable :: volume(:, :)         !! middle of the step, (8*q3, q1*q2)
    real(wp), allocatable :: end_volume(:, :)     !! end of the step
    real(wp), allocatable :: jacobian(:, :, :)    !! end, (8*q3, 9, q1*q2); not smooth
    real(wp), allocatable :: weighted(:, :, :)    !! stress times volume, (8*q3, 6, q1*q2)
    real(wp), allocatable :: plane(:, :, :)       !! its share within a sheet, see split_sheet
    real(wp), allocatable :: mean(:, :)           !! volume strain or its stress
    real(wp), allocatable :: along1(:, :, :)      !! what axis 1 alone projects; sheet only
    real(wp), allocatable :: along2(:, :, :)      !! what axis 2 alone projects; sheet only
    real(wp), allocatable :: tangents(:, :, :)    !! (8*q3, 12, q1*q2); sheet only
    real(wp), allocatable :: gradients(:, :, :)   !! F at start and end, row by row; context
    real(wp), allocatable :: place(:, :, :)       !! (8*q3, 3, q1*q2); context only
    real(wp), allocatable :: growth(:, :, :)      !! log det F, (8*q3, 2, q1*q2); context
  end type point_fields_t

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
    integer :: t

    !$omp parallel default(shared) private(t) if (.not. law%is_serial)
    !$omp do schedule(static)
    do t = 1, size(buffers)
      call forces_of_tile(patch, projection, law, patch%tiles(t), dt, x, v, force, &
                          buffers(t)%force, reports(t))
    end do
    !$omp end do
    call add_tiles(patch, buffers, force)
    !$omp end parallel
    call finish_evaluation(patch, dt, reports, report)
  end subroutine forces_of_projection

  !> The blocks of one tile, each projected on its own.
  subroutine forces_of_tile(patch, projection, law, tile, dt, x, v, force, border, report)
    type(solid_patch_t), intent(inout) :: patch
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
    type(block_t) :: block
    integer :: i
    logical :: ok

    if (allocated(patch%reference)) context = new_patch_context(patch)
    fields = new_point_fields(patch, projection)
    call clear_rows(tile, force, border)
    do i = 1, n_blocks_of(patch, tile)
      call next_block(patch, tile, block)
      call gather_motion(patch, block, dt, x, v, u, w)
      if (allocated(patch%reference)) call place_context(patch, block, context)
      call run_strain(patch, projection, block, .true., u, fields, sums)
      call start_strain(patch, fields)
      call project_block(patch, projection, .false., fields)
      call finish_strain(patch, projection, fields)
      call update_stress(patch, law, block, dt, context, fields, sums, ok)
      call start_stress(projection, fields)
      call project_block(patch, projection, .true., fields)
      call finish_stress(projection, fields)
      call run_nodal(patch, projection, block, u, fields, f)
      call add_forces(patch, tile, block, w, f, force, border)
      call add_report(report, sums, ok, block)
    end do
  end subroutine forces_of_tile

  !> Room for the points of a block.
  pure function new_point_fields(patch, projection) result(fields)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(point_fields_t) :: fields
    integer :: q(3), points, rows, n_sheet, n_whole, n_context

    q = patch%axes%n_points
    points = n_lanes*q(3)
    rows = q(1)*q(2)
    fields%n_layers = q(3)
    fields%n_rows = rows
    n_sheet = merge(rows, 0, projection%kind == project_sheet)
    n_whole = merge(0, rows, projection%is_smooth)
    n_context = merge(rows, 0, allocated(patch%reference))
    allocate (fields%dstrain(points, 6, rows), fields%spin(points, 3, rows))
    allocate (fields%volume(points, rows), fields%end_volume(points, rows))
    allocate (fields%mean(points, rows), fields%jacobian(points, 9, n_whole))
    allocate (fields%weighted(points, 6, rows), fields%plane(points, 3, n_sheet))
    allocate (fields%along1(points, 6, n_sheet), fields%along2(points, 6, n_sheet))
    allocate (fields%tangents(points, 12, n_sheet), fields%gradients(points, 18, n_context))
    allocate (fields%place(points, 3, n_context), fields%growth(points, 2, n_context))
  end function new_point_fields

  !> Fill what is to be projected of the strains of a block.
  pure subroutine start_strain(patch, fields)
    type(solid_patch_t), intent(in) :: patch
    type(point_fields_t), intent(inout) :: fields

    fields%mean = fields%dstrain(:, 1, :) + fields%dstrain(:, 2, :) + fields%dstrain(:, 3, :)
    if (allocated(patch%reference)) &
      call logarithmic_volumes(shape(fields%mean), fields%gradients, fields%growth)
  end subroutine start_strain

  !> Project the strains of a block, or its stresses by the transposed operators.
  pure subroutine project_block(patch, projection, is_stress, fields)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    logical, intent(in) :: is_stress
    type(point_fields_t), intent(inout) :: fields
    integer :: q(3)

    q = patch%axes%n_points
    call project_along(projection, all_axes, is_stress, q, 1, fields%mean)
    if (projection%kind == project_sheet) then
      if (.not. is_stress) fields%along1 = fields%dstrain
      if (.not. is_stress) fields%along2 = fields%dstrain
      call project_along(projection, first_axis, is_stress, q, 6, fields%along1)
      call project_along(projection, second_axis, is_stress, q, 6, fields%along2)
    end if
    if (allocated(patch%reference) .and. .not. is_stress) &
      call project_along(projection, all_axes, .false., q, 2, fields%growth)
  end subroutine project_block

  !> Put what has been projected into the strains of a block.
  pure subroutine finish_strain(patch, projection, fields)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(point_fields_t), intent(inout) :: fields

    if (projection%kind == project_sheet) then
      call correct_sheet(fields%n_layers, fields%n_rows, fields%tangents, fields%mean, &
                         fields%along1, fields%along2, fields%dstrain)
    else
      call correct_volume(fields%n_layers, fields%n_rows, fields%mean, fields%dstrain)
    end if
    if (allocated(patch%reference)) &
      call set_volumes(shape(fields%mean), fields%growth, fields%gradients)
  end subroutine finish_strain

  !> Stress and stress times volume of the points of a block.
  subroutine update_stress(patch, law, block, dt, context, fields, sums, ok)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    type(point_context_t), intent(inout) :: context
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(inout) :: sums(n_lanes, 4)
    logical, intent(out) :: ok

    if (law%uses_gradient) then
      ! The volumes of the scaled gradients: a law with an energy per volume at the start needs
      ! them, for its forces to be the slopes of that energy.
      fields%volume = fields%volume*exp(0.5_wp*(fields%growth(:, 1, :) + fields%growth(:, 2, :)))
      fields%end_volume = fields%end_volume*exp(fields%growth(:, 2, :))
    end if
    call stress_of_block(law, patch%axes%n_points, dt, patch%viscosity%is_active, &
                         viscous_factors(patch%viscosity, block%number, dt), &
                         fields%spin, fields%dstrain, fields%volume, fields%end_volume, context, &
                         fields%gradients, fields%place, patch%stress(:, :, :, :, block%number), &
                         patch%state(:, :, :, :, block%number), &
                         patch%push(:, :, :, min(block%number, size(patch%push, 4))), &
                         fields%weighted, sums, ok)
  end subroutine update_stress

  !> Split the stresses of a block into what is to be projected and the rest.
  pure subroutine start_stress(projection, fields)
    type(projection_t), intent(in) :: projection
    type(point_fields_t), intent(inout) :: fields

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

    if (projection%kind == project_sheet) then
      call join_sheet(fields%n_layers, fields%n_rows, fields%mean, fields%along1, &
                      fields%along2, fields%weighted)
    else
      call join_volume(fields%n_layers, fields%n_rows, fields%mean, fields%weighted)
    end if
  end subroutine finish_stress

  !> Kinematics of a block; or no more than strains, spins and their volumes, for a start.
  subroutine run_strain(patch, projection, block, has_end, u, fields, sums)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(block_t), intent(in) :: block
    logical, intent(in) :: has_end                   !! of the step, and the tangents of sheets
    real(wp), intent(in) :: u(*)                     !! from gather_motion
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(out) :: sums(n_lanes, 4)        !! see block_strain
    integer :: p(3), q(3)
    logical :: has_jacobian, has_tangents

    has_jacobian = .not. projection%is_smooth
    has_tangents = has_end .and. projection%kind == project_sheet
    p = patch%axes%degree
    q = patch%axes%n_points
    select case (patch%kernel)
#include "ig_strain_cases.inc"
    end select
  end subroutine run_strain

  !> Control-point forces of a block.
  subroutine run_nodal(patch, projection, block, u, fields, f)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: u(*)                     !! positions, for smooth projections
    type(point_fields_t), intent(in) :: fields
    real(wp), intent(inout) :: f(*)
    integer :: p(3), q(3)
    logical :: has_jacobian, has_plane

    has_jacobian = .not. projection%is_smooth
    has_plane = projection%kind == project_sheet
    p = patch%axes%degree
    q = patch%axes%n_points
    select case (patch%kernel)
#include "ig_nodal_cases.inc"
    end select
  end subroutine run_nodal

end module projected_forces
