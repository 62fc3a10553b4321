!> Size of the next time step: stable for the present shape, and in equal shares between the times
!! of the output that is due most often. The other output is made with the first step at or after
!! its time: to hit both would make steps long and short by turns, which feeds energy to vibrations.
module step_control
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use scene, only: step_spec_t, output_spec_t
  implicit none
  private

  public :: step_control_t, new_step_control, next_step, is_due, count_output

  !> Regular times of one kind of output.
  type, public :: schedule_t
    integer :: n = 0        !! intervals up to the end time
    integer :: done = 0     !! outputs made after the one at time zero
  end type schedule_t

  !> Stable step and what is due next.
  type :: step_control_t
    real(wp) :: start_time = 0.0_wp, end_time = 0.0_wp    !! of the step of the deck
    real(wp) :: duration = 0.0_wp
    real(wp) :: largest = 0.0_wp       !! safe step of the shape at the start; never exceeded
    real(wp) :: safety = 0.0_wp        !! part of the stable step that is used
    real(wp) :: rate_at_start = 0.0_wp !! |J^-1|^2 that belongs to it
    type(schedule_t) :: frames, history
  end type step_control_t

contains

  !> Control from the deck's step and the stable step of the shape at the start.
  pure function new_step_control(step, output, stable_step, rate, start_time) result(control)
    type(step_spec_t), intent(in) :: step
    type(output_spec_t), intent(in) :: output
    real(wp), intent(in) :: stable_step, rate
    real(wp), intent(in), optional :: start_time     !! of this step of the deck, if not 0
    type(step_control_t) :: control

    if (present(start_time)) control%start_time = start_time
    control%duration = step%end_time
    control%end_time = control%start_time + step%end_time
    control%largest = step%safety*stable_step
    control%safety = step%safety
    control%rate_at_start = rate
    control%frames%n = output%n_frames
    control%history%n = output%n_history
  end function new_step_control

  !> Step from `time`, which may itself be an output time not counted yet. The highest frequency
  !! is taken to grow with the norm of the inverse jacobian; a step above the first one would undo
  !! what the contact stiffness was set for.
  pure real(wp) function next_step(control, time, rate) result(dt)
    type(step_control_t), intent(in) :: control
    real(wp), intent(in) :: time     !! now
    real(wp), intent(in) :: rate     !! largest |J^-1|^2 now
    real(wp), parameter :: countless = 1.0e15_wp   ! so many steps need no equal shares
    real(wp) :: left, n_steps

    dt = control%largest*coarse(control, min(1.0_wp, sqrt(control%rate_at_start &
                                                        /max(rate, tiny(rate)))))
    if (control%history%n >= control%frames%n) then
      left = due_after(control, control%history, time) - time
    else
      left = due_after(control, control%frames, time) - time
    end if
    n_steps = left/dt*(1.0_wp - 1.0e-12_wp)
    if (n_steps > 0.0_wp .and. n_steps < countless) dt = left/ceiling(n_steps, int64)
  end function next_step

  !> A factor on the step, rounded up by up to a hundredth in steps of that size: a step that
  !! followed each vibration would take energy from it or feed it. Close to the stable step, where
  !! there is no hundredth to spare, as it is.
  pure real(wp) function coarse(control, factor)
    type(step_control_t), intent(in) :: control
    real(wp), intent(in) :: factor      !! at most 1
    real(wp), parameter :: notch = 0.99_wp

    coarse = factor
    if (control%safety <= 0.95_wp) coarse = notch**floor(log(factor)/log(notch) + 1.0e-12_wp)
  end function coarse

  !> Is output of this kind due at `time`? Times that are hit are hit but for round-off.
  pure logical function is_due(control, schedule, time)
    type(step_control_t), intent(in) :: control
    type(schedule_t), intent(in) :: schedule
    real(wp), intent(in) :: time

    is_due = time >= due_time(control, schedule) - 1.0e-9_wp*control%duration/max(1, schedule%n)
  end function is_due

  !> Note that output of this kind was made.
  pure subroutine count_output(schedule)
    type(schedule_t), intent(inout) :: schedule

    schedule%done = schedule%done + 1
  end subroutine count_output

  !> The first time after `time` at which output is due.
  pure real(wp) function due_after(control, schedule, time)
    type(step_control_t), intent(in) :: control
    type(schedule_t), intent(in) :: schedule
    real(wp), intent(in) :: time
    type(schedule_t) :: next

    next = schedule
    if (is_due(control, schedule, time)) call count_output(next)
    due_after = due_time(control, next)
  end function due_after

  !> The time of the first output not counted yet; the end time if all are.
  pure real(wp) function due_time(control, schedule)
    type(step_control_t), intent(in) :: control
    type(schedule_t), intent(in) :: schedule

    due_time = control%end_time
    if (schedule%done < schedule%n) then
      due_time = control%start_time + control%duration*(schedule%done + 1)/schedule%n
    end if
  end function due_time

end module step_control
