!> Projected elements block by block: kinematics, projection of strains, stress, projection of
!! stresses, forces.
module projected_block
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use point_context, only: point_context_t
  use ig_patch, only: ig_patch_t
  use point_fields, only: point_fields_t
  use strain_projection, only: projection_t, project_sheet, project_along
  use projected_points, only: volume_strain, correct_volume, split_volume, join_volume, &
                              correct_sheet, split_sheet, join_sheet
  use projected_stress, only: stress_of_block, logarithmic_volumes, set_volumes, scale_volumes
  use projected_dispatch, only: run_strain, run_nodal
  use kernel_dispatch, only: viscous_factors
  implicit none
  private

  public :: run_projected
  public :: start_strain, finish_strain, update_stress, start_stress, finish_stress

  logical, parameter :: all_axes(3) = .true.
  logical, parameter :: first_axis(3) = [.true., .false., .false.]
  logical, parameter :: second_axis(3) = [.false., .true., .false.]

contains

  !> Stress update and forces of block `b` of the row (e2, e3): number `block` of the patch.
  subroutine run_projected(patch, projection, law, b, e2, e3, block, dt, u, context, fields, f, &
                           sums, ok)
    type(ig_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: b, e2, e3, block
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: u(*)                        !! from gather_motion
    type(point_context_t), intent(inout) :: context
    type(point_fields_t), intent(inout) :: fields       !! with one slot
    real(wp), intent(inout) :: f(*)                     !! internal forces of the block
    real(wp), intent(out) :: sums(n_lanes, 4)           !! see block_forces
    logical, intent(out) :: ok

    call run_strain(patch, projection, b, e2, e3, block, 1, .true., u, fields, sums)
    call start_strain(patch, 1, fields)
    call project_strain(patch, projection, fields)
    call finish_strain(patch, projection, 1, fields)
    call update_stress(patch, law, block, 1, dt, context, fields, sums, ok)
    call start_stress(patch, projection, 1, fields)
    call project_stress(patch, projection, fields)
    call finish_stress(patch, projection, 1, fields)
    call run_nodal(patch, projection, b, e2, e3, block, 1, u, fields, fields%plane, f)
  end subroutine run_projected

  !> Fill what is to be projected of the strains of a slot.
  pure subroutine start_strain(patch, slot, fields)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: slot
    type(point_fields_t), intent(inout) :: fields
    integer :: q3, rows

    q3 = patch%axes(3)%n_points
    rows = size(fields%mean, 2)
    call volume_strain(q3, rows, fields%dstrain(:, :, :, slot), fields%mean(:, :, slot))
    if (allocated(patch%reference)) &
      call logarithmic_volumes([n_lanes*q3, rows], fields%gradients(:, :, :, slot), &
                               fields%growth(:, :, :, slot))
  end subroutine start_strain

  !> Project the strains of the one slot.
  pure subroutine project_strain(patch, projection, fields)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(point_fields_t), intent(inout) :: fields
    integer :: q(3)

    q = patch%axes%n_points
    call project_along(projection, all_axes, .false., q, 1, fields%mean)
    if (projection%kind == project_sheet) then
      fields%along1 = fields%dstrain
      fields%along2 = fields%dstrain
      call project_along(projection, first_axis, .false., q, 6, fields%along1)
      call project_along(projection, second_axis, .false., q, 6, fields%along2)
    end if
    if (allocated(patch%reference)) &
      call project_along(projection, all_axes, .false., q, 2, fields%growth)
  end subroutine project_strain

  !> Put what has been projected into the strains of a slot.
  pure subroutine finish_strain(patch, projection, slot, fields)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    integer, intent(in) :: slot
    type(point_fields_t), intent(inout) :: fields
    integer :: q3, rows

    q3 = patch%axes(3)%n_points
    rows = size(fields%mean, 2)
    if (projection%kind == project_sheet) then
      call correct_sheet(q3, rows, fields%tangents(:, :, :, slot), fields%mean(:, :, slot), &
                         fields%along1(:, :, :, slot), fields%along2(:, :, :, slot), &
                         fields%dstrain(:, :, :, slot))
    else
      call correct_volume(q3, rows, fields%mean(:, :, slot), fields%dstrain(:, :, :, slot))
    end if
    if (allocated(patch%reference)) &
      call set_volumes([n_lanes*q3, rows], fields%growth(:, :, :, slot), &
                       fields%gradients(:, :, :, slot))
  end subroutine finish_strain

  !> Stress and stress times volume of the points of a block.
  subroutine update_stress(patch, law, block, slot, dt, context, fields, sums, ok)
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: block, slot
    real(wp), intent(in) :: dt
    type(point_context_t), intent(inout) :: context
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(inout) :: sums(n_lanes, 4)
    logical, intent(out) :: ok
    integer :: context_slot

    if (law%uses_gradient) call scale_volumes([size(fields%volume, 1), size(fields%volume, 2)], &
                                              fields%growth(:, :, :, slot), &
                                              fields%volume(:, :, slot), &
                                              fields%end_volume(:, :, slot))
    context_slot = min(slot, size(fields%place, 4))
    call stress_of_block(law, patch%axes%n_points, dt, patch%viscosity%is_active, &
                         viscous_factors(patch%viscosity, block, dt), &
                         fields%spin(:, :, :, slot), fields%dstrain(:, :, :, slot), &
                         fields%volume(:, :, slot), fields%end_volume(:, :, slot), context, &
                         fields%gradients(:, :, :, context_slot), &
                         fields%place(:, :, :, context_slot), &
                         patch%stress(:, :, :, :, block), patch%state(:, :, :, :, block), &
                         patch%push(:, :, :, min(block, size(patch%push, 4))), &
                         fields%weighted(:, :, :, slot), sums, ok)
  end subroutine update_stress

  !> Split the stresses of a slot into what is to be projected and the rest.
  pure subroutine start_stress(patch, projection, slot, fields)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    integer, intent(in) :: slot
    type(point_fields_t), intent(inout) :: fields
    integer :: q3, rows

    q3 = patch%axes(3)%n_points
    rows = size(fields%mean, 2)
    if (projection%kind == project_sheet) then
      call split_sheet(q3, rows, fields%tangents(:, :, :, slot), &
                       fields%weighted(:, :, :, slot), fields%mean(:, :, slot), &
                       fields%along1(:, :, :, slot), fields%along2(:, :, :, slot), &
                       fields%plane(:, :, :, slot))
    else
      call split_volume(q3, rows, fields%weighted(:, :, :, slot), fields%mean(:, :, slot))
    end if
  end subroutine start_stress

  !> Project the stresses of the one slot, transposed.
  pure subroutine project_stress(patch, projection, fields)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(point_fields_t), intent(inout) :: fields
    integer :: q(3)

    q = patch%axes%n_points
    call project_along(projection, all_axes, .true., q, 1, fields%mean)
    if (projection%kind == project_sheet) then
      call project_along(projection, first_axis, .true., q, 6, fields%along1)
      call project_along(projection, second_axis, .true., q, 6, fields%along2)
    end if
  end subroutine project_stress

  !> Join the projected stresses of a slot; with the rest, but for that of sheets.
  pure subroutine finish_stress(patch, projection, slot, fields)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    integer, intent(in) :: slot
    type(point_fields_t), intent(inout) :: fields
    integer :: q3, rows

    q3 = patch%axes(3)%n_points
    rows = size(fields%mean, 2)
    if (projection%kind == project_sheet) then
      call join_sheet(q3, rows, fields%mean(:, :, slot), fields%along1(:, :, :, slot), &
                      fields%along2(:, :, :, slot), fields%weighted(:, :, :, slot))
    else
      call join_volume(q3, rows, fields%mean(:, :, slot), fields%weighted(:, :, :, slot))
    end if
  end subroutine finish_stress

end module projected_block
