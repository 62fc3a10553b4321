!> From a patch to the instance of the projected kernel that serves it: the numbers are those of
!! `kernel_dispatch`. This file is compiled without a limit of line length.
module projected_dispatch
  use kinds, only: wp
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t
  use point_fields, only: point_fields_t
  use strain_projection, only: project_sheet
  use ig_projected_p222_q222, only: strain_222 => block_strain, nodal_222 => block_nodal
  use ig_projected_p222_q223, only: strain_223 => block_strain, nodal_223 => block_nodal
  use ig_projected_p222_q226, only: strain_226 => block_strain, nodal_226 => block_nodal
  use ig_projected_p222_q333, only: strain_333 => block_strain, nodal_333 => block_nodal
  use ig_projected_p222_q222_rational, only: strain_222_rational => block_strain, &
      nodal_222_rational => block_nodal
  use ig_projected_p222_q223_rational, only: strain_223_rational => block_strain, &
      nodal_223_rational => block_nodal
  use ig_projected_p222_q226_rational, only: strain_226_rational => block_strain, &
      nodal_226_rational => block_nodal
  use ig_projected_p222_q333_rational, only: strain_333_rational => block_strain, &
      nodal_333_rational => block_nodal
  use ig_projected_general, only: strain_general => block_strain, nodal_general => block_nodal
  use ig_projected_general_rational, only: strain_rational => block_strain, &
      nodal_rational => block_nodal
  use ig_projected_general_context, only: strain_context => block_strain
  implicit none
  private

  public :: run_strain, run_nodal

contains

! Arrays go by their first elements, so that no descriptor is looked at twice.
#define AXES patch%lanes%values(1, 1, 1, b), patch%lanes%slopes(1, 1, 1, b), \
  patch%lanes%weights(1, 1, b), \
  patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, \
  patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights
#define BASES patch%lanes%values(1, 1, 1, b), patch%lanes%slopes(1, 1, 1, b), \
  patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), \
  patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3)
#define HEAD dt, has_tangents, u, AXES
#define TAIL fields%dstrain(1, 1, 1, slot), fields%spin(1, 1, 1, slot), fields%volume(1, 1, slot), \
  fields%end_volume(1, 1, slot), fields%inverse(1, 1, 1, slot), \
  fields%tangents(1, 1, 1, tangent_slot), sums
#define FORCES fields%weighted(1, 1, 1, slot), fields%inverse(1, 1, 1, slot), f
#define WEIGHTS patch%rational(1, 1, 1, 1, block)
#define COUNTS p(1), p(2), p(3), q(1), q(2), q(3)

  !> Kinematics of block `b` of the row (e2, e3), number `block` of the patch, into a slot.
  subroutine run_strain(patch, b, e2, e3, block, slot, dt, u, fields, sums)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: b, e2, e3, block, slot
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: u(*)                     !! gathered positions and velocities
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(out) :: sums(n_lanes, 4)        !! see block_strain
    integer :: p(3), q(3), tangent_slot
    logical :: has_tangents

    has_tangents = patch%projection%kind == project_sheet
    tangent_slot = merge(slot, 1, has_tangents)
    p = patch%axes%degree
    q = patch%axes%n_points
    select case (patch%kernel)
    case (1)
      call strain_222(HEAD, TAIL)
    case (2)
      call strain_222_rational(HEAD, WEIGHTS, TAIL)
    case (3)
      call strain_223(HEAD, TAIL)
    case (4)
      call strain_223_rational(HEAD, WEIGHTS, TAIL)
    case (5)
      call strain_226(HEAD, TAIL)
    case (6)
      call strain_226_rational(HEAD, WEIGHTS, TAIL)
    case (7)
      call strain_333(HEAD, TAIL)
    case (8)
      call strain_333_rational(HEAD, WEIGHTS, TAIL)
    case (9)
      call strain_general(COUNTS, HEAD, TAIL)
    case (10)
      call strain_rational(COUNTS, HEAD, WEIGHTS, TAIL)
    case default
      call strain_context(COUNTS, HEAD, WEIGHTS, patch%reference(1, 1, 1, 1, block), &
                          fields%gradients(1, 1, 1, slot), fields%place(1, 1, 1, slot), TAIL)
    end select
  end subroutine run_strain

  !> Control-point forces of the block from what its slot holds.
  subroutine run_nodal(patch, b, e2, e3, block, slot, fields, f)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: b, e2, e3, block, slot
    type(point_fields_t), intent(in) :: fields
    real(wp), intent(inout) :: f(*)
    integer :: p(3), q(3)

    p = patch%axes%degree
    q = patch%axes%n_points
    select case (patch%kernel)
    case (1)
      call nodal_222(BASES, FORCES)
    case (2)
      call nodal_222_rational(BASES, WEIGHTS, FORCES)
    case (3)
      call nodal_223(BASES, FORCES)
    case (4)
      call nodal_223_rational(BASES, WEIGHTS, FORCES)
    case (5)
      call nodal_226(BASES, FORCES)
    case (6)
      call nodal_226_rational(BASES, WEIGHTS, FORCES)
    case (7)
      call nodal_333(BASES, FORCES)
    case (8)
      call nodal_333_rational(BASES, WEIGHTS, FORCES)
    case (9)
      call nodal_general(COUNTS, BASES, FORCES)
    case default
      call nodal_rational(COUNTS, BASES, WEIGHTS, FORCES)
    end select
  end subroutine run_nodal

end module projected_dispatch
