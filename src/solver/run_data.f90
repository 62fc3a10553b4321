!> What changes during a run.
module run_data
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use timer, only: clock_ticks, ticks_to_seconds
  use body_parts, only: field_t
  use effect, only: instant_t
  use frames, only: frame_t
  use history, only: history_row_t
  use step_control, only: step_control_t
  use energy_balance, only: energy_balance_t
  implicit none
  private

  public :: wall_seconds

  !> Everything that changes during a run beside the bodies themselves.
  type, public :: run_t
    type(step_control_t) :: control
    type(energy_balance_t) :: balance
    type(instant_t) :: instant
    integer(int64) :: n_steps = 0
    integer(int64) :: started = 0            !! clock at the start, or when it was taken up again
    real(wp) :: seconds_before = 0.0_wp      !! from the start up to what it was taken up from
    logical :: is_resumed = .false.          !! it goes on from a checkpoint
    logical :: is_file_lost = .false.        !! the results could not be written
    logical :: has_frame = .false.           !! `frame` is filled and not written yet
    integer :: n_earlier = 0                 !! frames before that one that are not either
    logical :: has_depths = .false.          !! the last row has measured them
    logical :: has_warned_of_mass = .false.  !! that scaled masses show
    logical :: has_warned_of_shear = .false. !! where a law does not bear it
    real(wp) :: largest_error = 0.0_wp       !! of the energy balance, by the largest energy so far
    real(wp) :: row_error = 0.0_wp           !! largest in the history, by the energies of its time
    real(wp) :: row_error_time = 0.0_wp
    integer(int64) :: row_error_step = 0
    real(wp) :: largest_penetration = 0.0_wp
    real(wp) :: step_factor = 1.0_wp         !! on the time step; below 1 after a second try
    integer :: watch_motion = 0, watch_blank = 0, watch_output = 0, watch_state = 0
    type(field_t), allocatable :: v_before(:)  !! by patch; kept for steps that take a balance
    type(frame_t) :: frame                     !! the last one
    type(frame_t), allocatable :: earlier(:)   !! room for those that wait before it
    type(history_row_t) :: row
  end type run_t

contains

  !> How long the run has taken up to now, in all parts that led here [s].
  real(wp) function wall_seconds(run)
    type(run_t), intent(in) :: run

    wall_seconds = run%seconds_before + ticks_to_seconds(clock_ticks() - run%started)
  end function wall_seconds

end module run_data
