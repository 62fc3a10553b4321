!> How far a run is, for the log.
module run_progress
  use kinds, only: wp
  use residual_decay, only: decay_t, increments_left
  use damping, only: find_decay
  use model, only: model_t
  use run_log, only: progress_t
  use run_state, only: run_t, wall_seconds
  use run_saver, only: final_time
  implicit none
  private

  public :: progress_of, step_fraction, begin_pace

contains

  !> Time per increment is measured from here on.
  subroutine begin_pace(run)
    type(run_t), intent(inout) :: run

    run%pace_seconds = wall_seconds(run)
    run%pace_steps = run%n_steps
  end subroutine begin_pace

  !> Where the run is. Of a relaxation, and where one follows, whose length nobody knows, fraction
  !! and time left are those of the present step of the deck.
  function progress_of(model, run) result(progress)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(progress_t) :: progress
    type(decay_t), allocatable :: decay
    real(wp) :: seconds, n_left

    progress%n_increments = run%n_steps
    progress%time = run%instant%time
    progress%dt = run%instant%dt
    progress%energy_error = run%balance%error
    progress%step = model%i_step
    progress%n_steps = model%i_step + size(model%later_steps)
    if (allocated(model%step%name)) progress%name = model%step%name
    seconds = wall_seconds(run)
    call find_decay(model%supports, decay)
    progress%is_of_step = allocated(decay) .or. model%step%is_static &
                          .or. any(model%later_steps%step%has_relaxation) &
                          .or. any(model%later_steps%step%is_static)
    if (progress%is_of_step) then
      progress%fraction = step_fraction(model, run)
      n_left = max(0.0_wp, run%control%end_time - run%instant%time) &
               /max(merge(run%static_dt, run%instant%dt, model%step%is_static), tiny(1.0_wp))
      if (allocated(decay)) n_left = min(n_left, increments_left(decay))
      if (progress%fraction > 0.0_wp .and. n_left >= 0.0_wp .and. run%n_steps > run%pace_steps) &
        progress%seconds_left = n_left*(seconds - run%pace_seconds)/(run%n_steps - run%pace_steps)
    else
      progress%fraction = run%instant%time/max(final_time(model, run), tiny(1.0_wp))
      if (progress%fraction > 0.0_wp) &
        progress%seconds_left = seconds*(1.0_wp - progress%fraction)/progress%fraction
    end if
  end function progress_of

  !> Part of the present step of the deck that is done: of a relaxation by the decay of its
  !! residuals, negative before that is measurable; otherwise by its time.
  real(wp) function step_fraction(model, run) result(fraction)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(decay_t), allocatable :: decay

    call find_decay(model%supports, decay)
    if (allocated(decay)) then
      fraction = decay%fraction
    else
      fraction = (run%instant%time - run%control%start_time) &
                 /max(run%control%duration, tiny(1.0_wp))
    end if
  end function step_fraction

end module run_progress
