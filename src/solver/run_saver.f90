!> When the state of a run is saved, and what becomes of a run that fails.
module run_saver
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use errors, only: error_t
  use text, only: to_text, rounded_text
  use timer, only: clock_ticks, ticks_to_seconds
  use interrupt, only: is_stop_wanted, is_save_wanted, forget_save, stop_signal_name
  use state_store, only: state_store_t, enter_folder, put, take
  use model, only: model_t
  use frames, only: results_t, flush_results, forget_history, leave_results, rejoin_results, &
                    n_frames_of
  use run_log, only: run_log_t, log_line
  use checkpoint, only: checkpoint_header_t, write_checkpoint, read_checkpoint, restore_result
  use run_data, only: run_t
  use run_state, only: pack_run, unpack_run
  implicit none
  private

  public :: saver_t, look_after, save_last_good, try_again, frames_of_state

  !> Where and when the state is saved. Without a path there is nothing to do.
  type :: saver_t
    character(:), allocatable :: path, result_file
    type(checkpoint_header_t) :: header
    integer :: every_steps = 0                !! 0: not by steps
    real(wp) :: every_seconds = 0.0_wp        !! of the clock; 0: not by the clock
    integer :: number = 0                     !! over the run; 0: not by its time
    real(wp) :: wall_seconds = 0.0_wp         !! after which the run stops; 0: never
    real(wp) :: retry = 0.0_wp                !! factor on the step for one more try; 0: none
    logical :: is_retried = .false.
    character(:), allocatable :: stopped_by   !! why the run stopped before its end, if it did
    logical :: is_state_lost = .false.        !! where it stopped, since it could not be written
    integer(int64) :: saved_step = -1         !! of the file; negative: there is none of this run
    real(wp) :: saved_time = 0.0_wp
    integer(int64) :: saved_ticks = 0
    type(state_store_t) :: good               !! state one step after the last frame
    integer(int64) :: good_step = -1
    real(wp) :: good_time = 0.0_wp
    integer :: good_frames = 0                !! frames in the result then
  end type saver_t

contains

  !> To be called at the start of each step: saves the state when that is due or asked for, and
  !! tells whether the run must stop.
  subroutine look_after(saver, model, run, results, log, is_stopping)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    logical, intent(out) :: is_stopping
    real(wp) :: spent
    logical :: is_wanted

    is_stopping = .false.
    if (.not. allocated(saver%path)) return
    if (n_frames_of(results) > saver%good_frames) call keep_good(saver, model, run, results)
    spent = 0.0_wp
    if (saver%wall_seconds > 0.0_wp) spent = ticks_to_seconds(clock_ticks() - run%started)
    if (is_stop_wanted()) then
      saver%stopped_by = stop_signal_name()
    else if (saver%wall_seconds > 0.0_wp .and. spent >= saver%wall_seconds) then
      saver%stopped_by = "the limit of "//rounded_text(saver%wall_seconds/60.0_wp)//" minutes"
    end if
    is_stopping = allocated(saver%stopped_by)
    is_wanted = is_save_wanted()
    if (.not. (is_stopping .or. is_wanted)) is_wanted = is_due(saver, model, run)
    if (is_stopping .or. is_wanted) call save(saver, model, run, results, log)
    if (is_stopping) saver%is_state_lost = saver%saved_step /= run%n_steps
    if (is_stopping) call log_line(log, "stopped by "//saver%stopped_by//" at step "// &
                                   to_text(run%n_steps)//", time "//to_text(run%instant%time))
  end subroutine look_after

  !> Is one of the deck's intervals over, or the run?
  logical function is_due(saver, model, run)
    type(saver_t), intent(in) :: saver
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    integer(int64) :: last_ticks
    real(wp) :: interval, spent

    is_due = .false.
    if (run%n_steps == 0 .or. run%n_steps == saver%saved_step) return
    if (saver%every_steps > 0) is_due = mod(run%n_steps, int(saver%every_steps, int64)) == 0
    if (saver%every_seconds > 0.0_wp) then
      last_ticks = saver%saved_ticks
      if (saver%saved_step < 0) last_ticks = run%started
      spent = ticks_to_seconds(clock_ticks() - last_ticks)
      is_due = is_due .or. spent >= saver%every_seconds
    end if
    if (saver%number > 0) then
      interval = final_time(model, run)/saver%number
      is_due = is_due .or. int(run%instant%time/interval) > int(saver%saved_time/interval)
    end if
    if (max(saver%every_steps, saver%number) > 0 .or. saver%every_seconds > 0.0_wp) &
      is_due = is_due .or. run%instant%time >= final_time(model, run)*(1.0_wp - 1.0e-12_wp)
  end function is_due

  !> The end of the last step of the deck.
  pure real(wp) function final_time(model, run)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run

    final_time = run%control%end_time + sum(model%later_steps%step%end_time)
  end function final_time

  !> Write the checkpoint. If that fails a run goes on: there may be room for the next one.
  subroutine save(saver, model, run, results, log)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    type(state_store_t) :: store
    type(error_t), allocatable :: error

    call forget_save()
    call flush_results(results, error)
    if (.not. allocated(error)) then
      call pack_run(model, run, store)
      call put_frames(store, n_frames_of(results))
      call write_checkpoint(saver%path, saver%header, store, saver%result_file, error)
    end if
    saver%saved_ticks = clock_ticks()
    saver%saved_time = run%instant%time
    if (allocated(error)) then
      if (.not. allocated(saver%stopped_by)) error%message = error%message//"; the run goes on"
      call log_line(log, "warning: "//error%message)
      return
    end if
    saver%saved_step = run%n_steps
    call log_line(log, "checkpoint "//saver%path//" at step "//to_text(run%n_steps)//", time "// &
                  to_text(run%instant%time))
  end subroutine save

  !> Keep the state in memory; the result file is just now as it belongs to it.
  subroutine keep_good(saver, model, run, results)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(results_t), intent(in) :: results

    call pack_run(model, run, saver%good)
    saver%good_frames = n_frames_of(results)
    call put_frames(saver%good, saver%good_frames)
    saver%good_step = run%n_steps
    saver%good_time = run%instant%time
  end subroutine keep_good

  subroutine put_frames(store, n_frames)
    type(state_store_t), intent(inout) :: store
    integer, intent(in) :: n_frames

    call enter_folder(store, "result")
    call put(store, "n_frames", n_frames)
  end subroutine put_frames

  !> Frames in the result that a saved state belongs to.
  integer function frames_of_state(store) result(n_frames)
    type(state_store_t), intent(inout) :: store

    n_frames = 0
    call enter_folder(store, "result")
    call take(store, "n_frames", n_frames)
  end function frames_of_state

  !> The run has failed and nothing was written since the last frame: write the state that was kept
  !! then, unless a later one is in the file. `advice` tells how to go on; empty if there is no way.
  subroutine save_last_good(saver, log, advice)
    type(saver_t), intent(inout) :: saver
    type(run_log_t), intent(inout) :: log
    character(:), allocatable, intent(out) :: advice
    type(error_t), allocatable :: error

    advice = ""
    if (.not. allocated(saver%path)) return
    if (saver%good_step > saver%saved_step) then
      call write_checkpoint(saver%path, saver%header, saver%good, saver%result_file, error)
      if (allocated(error)) then
        if (.not. allocated(saver%stopped_by)) error%message = error%message//"; the run goes on"
      call log_line(log, "warning: "//error%message)
      else
        saver%saved_step = saver%good_step
        saver%saved_time = saver%good_time
      end if
    end if
    if (saver%saved_step >= 0) advice = "the last good state, of step "// &
      to_text(saver%saved_step)//", time "//to_text(saver%saved_time)//", is in '"// &
      saver%path//"': go on from it with --restart "//saver%path
  end subroutine save_last_good

  !> One more try from the last saved state with a smaller step, if the deck allows it and there is
  !! such a state; false if not.
  logical function try_again(saver, model, run, results, log) result(is_trying)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    type(state_store_t) :: store
    type(error_t), allocatable :: error

    is_trying = .false.
    if (.not. allocated(saver%path) .or. .not. saver%retry > 0.0_wp .or. saver%is_retried) return
    if (max(saver%good_step, saver%saved_step) < 0) return
    saver%is_retried = .true.
    if (saver%good_step > saver%saved_step) then
      store = saver%good
      call forget_history(results)
    else
      call leave_results(results)
      call read_checkpoint(saver%path, saver%header, store, error)
      if (.not. allocated(error)) call restore_result(saver%path, saver%result_file, error)
      if (.not. allocated(error)) call rejoin_results(results, frames_of_state(store), error)
      if (allocated(error)) then
        call log_line(log, "no second try: "//error%message)
        return
      end if
      saver%good_frames = n_frames_of(results)
    end if
    call unpack_run(model, run, store)
    if (store%fault /= "") then
      call log_line(log, "no second try: the saved state does not fit, "//store%fault)
      return
    end if
    run%control%largest = saver%retry*run%control%largest
    call log_line(log, "one more try from step "//to_text(run%n_steps)//", time "// &
                  to_text(run%instant%time)//", with "//rounded_text(saver%retry)// &
                  " of the time step")
    is_trying = .true.
  end function try_again

end module run_saver
