!> Trials of blocks of a shell.
module shell_stiffness
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use solid_patch, only: solid_patch_t, shell_points_t, block_t
  use solid_stiffness, only: block_trial_t, begin_trial, end_trial
  use shell_context, only: placed_law_t, new_placed_law
  use shell_forces, only: run_placed, run_shell
  use through_thickness, only: through_fields_t, normal_at_points
  implicit none
  private

  public :: begin_shell_trial, run_trial, end_shell_trial

  !> With what else an evaluation changes at the points of a block, and the normal stress there.
  type, extends(block_trial_t), public :: shell_trial_t
    real(wp), allocatable, dimension(:, :, :) :: metric, through, resultant, normal, stretch
    real(wp), allocatable :: thickness(:, :)
    logical :: is_pressed = .false.
    real(wp), allocatable :: normal_end(:, :, :)
    type(placed_law_t), allocatable :: placed      !! of laws with context
  end type shell_trial_t

contains

  !> State of a block, and the normal stress at the end of a motion.
  subroutine begin_shell_trial(patch, points, fields, block, dt, x, trial)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(through_fields_t), intent(in) :: fields        !! normal stress of the end
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :)   !! control points at the end
    type(shell_trial_t), intent(inout) :: trial

    call begin_trial(patch, block, dt, x, x, 3, trial)
    associate (k => block%number)
      trial%metric = points%metric(:, :, :, k)
      trial%through = points%through(:, :, :, k)
      trial%resultant = points%resultant(:, :, :, k)
      trial%normal = points%normal(:, :, :, k)
      trial%thickness = points%thickness(:, :, k)
      trial%is_pressed = points%is_pressed(k)
      if (allocated(points%stretch)) trial%stretch = points%stretch(:, :, :, k)
    end associate
    allocate (trial%normal_end(n_lanes, 2, size(points%normal, 3)), source=0.0_wp)
    if (fields%is_pressed) &
      call normal_at_points(patch, points, block, trial%w, fields%normal, trial%normal_end)
  end subroutine begin_shell_trial

  !> Forces of a block with its control points at `u`.
  subroutine run_trial(patch, points, law, block, dt, u, trial, f)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(inout) :: u(:, :)
    type(shell_trial_t), intent(inout) :: trial
    real(wp), intent(out) :: f(:, :)
    real(wp) :: sums(n_lanes, 4)
    logical :: ok

    if (law%needs_context) then
      if (.not. allocated(trial%placed)) then
        allocate (trial%placed)
        call new_placed_law(trial%placed, patch, law)
      end if
      call run_placed(patch, points, trial%placed, block, dt, trial%normal_end, u, f, sums, ok)
    else
      call run_shell(patch, points, law, block, dt, trial%normal_end, u, f, sums, ok)
    end if
  end subroutine run_trial

  !> The state as it was.
  pure subroutine end_shell_trial(trial, patch, points, k)
    type(shell_trial_t), intent(in) :: trial
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    integer, intent(in) :: k                       !! number of the block

    call end_trial(trial, patch, k)
    points%metric(:, :, :, k) = trial%metric
    points%through(:, :, :, k) = trial%through
    points%resultant(:, :, :, k) = trial%resultant
    points%normal(:, :, :, k) = trial%normal
    points%thickness(:, :, k) = trial%thickness
    points%is_pressed(k) = trial%is_pressed
    if (allocated(points%stretch)) points%stretch(:, :, :, k) = trial%stretch
  end subroutine end_shell_trial

end module shell_stiffness
