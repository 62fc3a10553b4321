!> From a patch to the instance of the projected kernel that serves it: the numbers are those of
!! `kernel_dispatch`.
module projected_dispatch
  use kinds, only: wp
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t
  use point_fields, only: point_fields_t
  use strain_projection, only: projection_t, project_sheet
#include "ig_strain_uses.inc"
#include "ig_nodal_uses.inc"
  implicit none
  private

  public :: run_strain, run_nodal

contains

  !> Kinematics of block `b` of the row (e2, e3), number `block` of the patch, into a slot; or no
  !! more than strains, spins and their volumes, for a start.
  subroutine run_strain(patch, projection, b, e2, e3, block, slot, has_end, u, fields, sums)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    integer, intent(in) :: b, e2, e3, block, slot
    logical, intent(in) :: has_end                   !! of the step, and the tangents of sheets
    real(wp), intent(in) :: u(*)                     !! from gather_motion
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(out) :: sums(n_lanes, 4)        !! see block_strain
    integer :: p(3), q(3), tangent_slot
    logical :: has_jacobian, has_tangents

    has_jacobian = .not. projection%is_smooth
    has_tangents = has_end .and. projection%kind == project_sheet
    tangent_slot = merge(slot, 1, has_tangents)
    p = patch%axes%degree
    q = patch%axes%n_points
    select case (patch%kernel)
#include "ig_strain_cases.inc"
    end select
  end subroutine run_strain

  !> Control-point forces of the block from what its slot holds.
  subroutine run_nodal(patch, projection, b, e2, e3, block, slot, u, fields, plane, f)
    type(ig_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    integer, intent(in) :: b, e2, e3, block, slot
    real(wp), intent(in) :: u(*)                     !! positions, for smooth projections
    type(point_fields_t), intent(in) :: fields
    real(wp), intent(in) :: plane(*)                 !! of sheets, see block_nodal
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

end module projected_dispatch
