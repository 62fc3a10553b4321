!> Size of the next time increment: stable for the present shape, and an equal fraction of the time
!! between outputs of the kind that is due most often. The number of increments is the nearest one,
!! so that hitting these times costs none on average; what increments may grow by for it is small
!! and leaves a margin to the limit of stability. The other output is made with the first increment
!! at or after its time: to hit both would alternate between long and short increments, which feeds
!! energy to vibrations.
module step_control
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use model, only: model_t, increment_limit
  implicit none
  private

  public :: step_control_t, new_step_control, next_step, is_due
  public :: is_penetration_due, schedule_penetration

  real(wp), parameter :: notch = 0.99_wp    !! see `next_step`

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
    real(wp) :: stretch = 0.0_wp       !! fraction that shortened steps may grow by to hit a time
    real(wp) :: rate_at_start = 0.0_wp !! |J^-1|^2 that belongs to it
    type(schedule_t) :: frames, history
    real(wp) :: penetration_due = 0.0_wp     !! when penetration between contact points is due next
  end type step_control_t

contains

  !> Control of the model's present step of the deck.
  pure function new_step_control(model, start_time) result(control)
    type(model_t), intent(in) :: model
    real(wp), intent(in), optional :: start_time     !! of this step of the deck, if not 0
    type(step_control_t) :: control

    if (present(start_time)) control%start_time = start_time
    control%duration = model%step%duration
    control%end_time = control%start_time + model%step%duration
    control%largest = increment_limit(model)
    control%safety = model%step%safety
    control%stretch = stretch_for(model%step%safety, model%penalty)
    control%rate_at_start = model%rate
    control%frames%n = model%output%n_frames
    control%history%n = model%output%n_history
  end function new_step_control

  !> Fraction that a step may grow by: small, and half of the room that is left. A penalty s m/dt^2
  !! together with the blank's own frequency w is stable for (w dt)^2 + s <= 4, and w dt is twice
  !! the safety factor, times what rounding in `next_step` adds to it.
  pure real(wp) function stretch_for(safety, penalty) result(stretch)
    real(wp), intent(in) :: safety, penalty
    real(wp), parameter :: most = 0.02_wp, part = 0.5_wp
    real(wp) :: room

    room = sqrt(max(0.0_wp, 1.0_wp - 0.25_wp*penalty))/safety - 1.0_wp
    if (is_coarse(safety)) room = notch*(room + 1.0_wp) - 1.0_wp
    stretch = min(most, part*max(0.0_wp, room))
  end function stretch_for

  !> Step from `time`, which may itself be an output time not counted yet. The highest frequency
  !! is taken to grow with the norm of the inverse jacobian; a step above the first one would undo
  !! what the contact stiffness was set for.
  pure real(wp) function next_step(control, time, rate) result(dt)
    type(step_control_t), intent(in) :: control
    real(wp), intent(in) :: time     !! now
    real(wp), intent(in) :: rate     !! largest |J^-1|^2 now
    real(wp), parameter :: countless = 1.0e15_wp   ! so many steps need not be equal
    real(wp), parameter :: whole = 1.0_wp - 1.0e-12_wp   ! round-off asks for no further step
    real(wp) :: left, longest, factor

    ! Rounded up by up to a hundredth in steps of that size: a step that followed each vibration
    ! would take energy from it or feed it.
    factor = min(1.0_wp, sqrt(control%rate_at_start/max(rate, tiny(rate))))
    if (is_coarse(control%safety)) factor = notch**floor(log(factor)/log(notch) + 1.0e-12_wp)
    dt = control%largest*factor
    if (control%history%n >= control%frames%n) then
      left = due_after(control, control%history, time) - time
    else
      left = due_after(control, control%frames, time) - time
    end if
    if (.not. (left > 0.0_wp .and. left < countless*dt)) return
    longest = min((1.0_wp + control%stretch)*dt, control%largest)
    dt = left/max(nint(left/dt*whole, int64), ceiling(left/longest*whole, int64))
  end function next_step

  !> Close to the stable step there is no hundredth to spare, and factors stay as they are.
  pure logical function is_coarse(safety)
    real(wp), intent(in) :: safety

    is_coarse = safety <= 0.95_wp
  end function is_coarse

  !> Is output of this kind due at `time`? Times that are hit are hit but for round-off.
  pure logical function is_due(control, schedule, time)
    type(step_control_t), intent(in) :: control
    type(schedule_t), intent(in) :: schedule
    real(wp), intent(in) :: time

    is_due = time >= due_time(control, schedule) - 1.0e-9_wp*control%duration/max(1, schedule%n)
  end function is_due

  !> Is penetration between contact points measured at this history sample? At the last sample of a
  !! step of the deck always.
  pure logical function is_penetration_due(control, time)
    type(step_control_t), intent(in) :: control
    real(wp), intent(in) :: time
    real(wp), parameter :: round_off = 1.0e-9_wp   ! part of the duration

    is_penetration_due = time >= min(control%penetration_due, control%end_time) &
                         - round_off*control%duration
  end function is_penetration_due

  !> They were measured now. The next time comes after as long as the work asks for, within bounds
  !! that are parts of the step of the deck.
  pure subroutine schedule_penetration(control, time, interval)
    type(step_control_t), intent(inout) :: control
    real(wp), intent(in) :: time
    real(wp), intent(in) :: interval     !! that makes the work a small fraction of the run's [time]
    real(wp), parameter :: shortest = 0.01_wp, longest = 0.05_wp

    control%penetration_due = time + min(max(interval, shortest*control%duration), &
                                   longest*control%duration)
  end subroutine schedule_penetration

  !> The first time after `time` at which output is due.
  pure real(wp) function due_after(control, schedule, time)
    type(step_control_t), intent(in) :: control
    type(schedule_t), intent(in) :: schedule
    real(wp), intent(in) :: time
    type(schedule_t) :: next

    next = schedule
    if (is_due(control, schedule, time)) next%done = next%done + 1
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
