!> The model that the solver runs: bodies, motions and the effects that the scene names.
module model
  use kinds, only: wp
  use timer, only: timer_t
  use scene, only: step_spec_t, output_spec_t, later_step_t, probe_spec_t
  use assembly, only: assembly_t
  use rigid_motion, only: rigid_motion_t
  use effect, only: effect_slot_t
  implicit none
  private

  public :: increment_limit

  !> All that a run needs; built by `model_setup`.
  type, public :: model_t
    type(assembly_t) :: bodies
    type(rigid_motion_t), allocatable :: motions(:)     !! one per tool
    type(rigid_motion_t), allocatable :: later_motions(:)   !! that take their place
    type(effect_slot_t), allocatable :: forces(:)       !! act before the accelerations
    type(effect_slot_t), allocatable :: supports(:)     !! act on the velocities
    type(effect_slot_t), allocatable :: later_forces(:), later_supports(:)   !! not begun
    type(effect_slot_t), allocatable :: retired(:)      !! of earlier steps, for the balances
    type(probe_spec_t), allocatable :: probes(:)
    integer :: i_step = 1                               !! step of the deck under way
    real(wp), allocatable :: step_starts(:)             !! times at which steps began, up to it
    type(step_spec_t) :: step                           !! it
    type(output_spec_t) :: output
    type(later_step_t), allocatable :: later_steps(:)   !! that have not begun
    real(wp) :: stable_step = 0.0_wp    !! limit at the start, viscosity included [time]
    real(wp) :: rate = 0.0_wp           !! geometric rate |J^-1|^2 that belongs to it
    real(wp) :: penalty = 0.0_wp        !! greatest sum of s of stiffnesses s m/dt^2 on a face
    real(wp) :: width_ratio = 1.0_wp    !! of what the results tell to what is computed
    type(timer_t) :: timer
  end type model_t

contains

  !> Largest time increment of the run at its start: safety factor times stable increment [time].
  pure real(wp) function increment_limit(model)
    type(model_t), intent(in) :: model

    increment_limit = model%step%safety*model%stable_step
  end function increment_limit

end module model
