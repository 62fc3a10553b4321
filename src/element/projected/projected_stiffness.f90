!> Trials of blocks with a projection, or with a law that asks for the context of its points.
module projected_stiffness
  use kinds, only: wp
  use block_law, only: block_law_t
  use solid_patch, only: solid_patch_t, block_t
  use strain_projection, only: projection_t
  use point_stress, only: point_fields_t, point_group_t, update_stress
  use projected_forces, only: set_point_fields, find_strain, find_forces
  use solid_stiffness, only: block_trial_t
  implicit none
  private

  public :: run_projected

  !> With the room of the points of a block.
  type, extends(block_trial_t), public :: projected_trial_t
    type(point_group_t) :: group
    type(point_fields_t) :: fields(1)
  end type projected_trial_t

contains

  !> Forces of a block with its control points at `u`.
  subroutine run_projected(patch, projection, law, block, dt, u, trial, f)
    type(solid_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt, u(:, :)
    type(projected_trial_t), intent(inout) :: trial
    real(wp), intent(out) :: f(:, :)
    logical :: ok(1)

    if (.not. allocated(trial%fields(1)%dstrain)) &
      call set_point_fields(patch, projection, trial%fields(1))
    call find_strain(patch, projection, block, u, trial%fields(1))
    call update_stress(patch, law, [block], dt, trial%group, trial%fields, ok)
    call find_forces(patch, projection, block, u, trial%fields(1), f)
  end subroutine run_projected

end module projected_stiffness
