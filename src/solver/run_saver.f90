!> When the state of a run is saved, and what becomes of a run that fails.
module run_saver
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use errors, only: error_t
  use text, only: to_text, rounded_text
  use timer, only: clock_ticks, ticks_to_seconds, start_watch, stop_watch
  use interrupt, only: is_stop_wanted, is_save_wanted, forget_save, stop_signal_name
  use state_store, only: state_store_t, enter_folder, put, take
  use model, only: model_t
  use system_files, only: remove_file, sync_file
  use frames, only: results_t, flush_results, forget_history, n_frames_of, n_rows_of
  use run_log, only: run_log_t, log_line
  use checkpoint, only: checkpoint_header_t, write_checkpoint
  use run_data, only: run_t
  use run_state, only: pack_run, unpack_run
  implicit none
  private

  public :: saver_t, look_after, save_last_good, try_again, start_from, drop_checkpoint

  !> Steps before the state is kept anew, which costs about as much as one.
  integer, parameter :: steps_between = 200

  !> Where and when the state is saved. Without a path there is nothing to do.
  type :: saver_t
    character(:), allocatable :: path, result_file
    type(checkpoint_header_t) :: header
    integer :: every_steps = 0                !! 0: not by steps
    real(wp) :: every_seconds = 0.0_wp        !! of the clock; 0: not by the clock
    integer :: number = 0                     !! over the run; 0: not by its time
    logical :: is_lasting = .false.           !! the end is saved too, and the file stays
    real(wp) :: wall_seconds = 0.0_wp         !! after which the run stops; 0: never
    real(wp) :: retry = 0.0_wp                !! factor on the step for one more try; 0: none
    character(:), allocatable :: stopped_by   !! why the run stopped before its end, if it did
    logical :: is_state_lost = .false.        !! where it stopped, since it could not be written
    integer(int64) :: saved_step = -1         !! of the file; negative: there is none of this run
    real(wp) :: saved_time = 0.0_wp
    integer(int64) :: saved_ticks = 0
    type(state_store_t) :: good               !! state kept last, one step after a row or frame
    integer(int64) :: good_step = -1
    real(wp) :: good_time = 0.0_wp
    integer :: good_frames = 0                !! frames in the result then
    integer :: good_rows = 0                  !! rows of the history that waited then
  end type saver_t

contains

  !> To be called at the start of each step: saves the state when that is due or asked for, and
  !! tells whether the run must stop.
  subroutine look_after(saver, model, run, results, log, is_stopping)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model       !! its timer alone
    type(run_t), intent(in) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    logical, intent(out) :: is_stopping
    real(wp) :: spent
    logical :: is_wanted

    is_stopping = .false.
    if (.not. allocated(saver%path)) return
    if (is_good_due(saver, run, results)) call keep_good(saver, model, run, results)
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

  !> Is the state to be kept? After each frame, since the result cannot go back behind it, and after
  !! rows of the history, whose balances were found sound.
  pure logical function is_good_due(saver, run, results)
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run
    type(results_t), intent(in) :: results

    is_good_due = n_frames_of(results) > saver%good_frames .or. &
                  (run%row%step == run%n_steps - 1 .and. &
                   run%n_steps - saver%good_step >= steps_between)
  end function is_good_due

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
    if (saver%is_lasting) &
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
    type(model_t), intent(inout) :: model
    type(run_t), intent(in) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    type(error_t), allocatable :: error

    call forget_save()
    call flush_results(results, error)
    if (.not. allocated(error)) then
      call keep_good(saver, model, run, results)
      call start_watch(model%timer, run%watch_state)
      call write_checkpoint(saver%path, saver%header, saver%good, saver%result_file, error)
      call stop_watch(model%timer, run%watch_state)
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

  !> Keep the state in memory, and how far the result belongs to it.
  subroutine keep_good(saver, model, run, results)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(in) :: run
    type(results_t), intent(in) :: results

    call start_watch(model%timer, run%watch_state)
    call pack_run(model, run, saver%good)
    saver%good_frames = n_frames_of(results)
    saver%good_rows = n_rows_of(results)
    call enter_folder(saver%good, "result")
    call put(saver%good, "n_frames", saver%good_frames)
    saver%good_step = run%n_steps
    saver%good_time = run%instant%time
    call stop_watch(model%timer, run%watch_state)
  end subroutine keep_good

  !> Take the state of a run from a checkpoint, and keep it. What does not fit is told by
  !! `store%fault`, and the state is not to be used then.
  subroutine start_from(saver, model, run, store)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(state_store_t), intent(inout) :: store

    call enter_folder(store, "result")
    call take(store, "n_frames", saver%good_frames)
    call unpack_run(model, run, store)
    saver%good = store
    saver%good_step = run%n_steps
    saver%good_time = run%instant%time
    saver%saved_time = run%instant%time
    saver%saved_ticks = clock_ticks()
  end subroutine start_from

  !> The run has failed, and nothing was written since the state was kept: rows of the history still
  !! wait. Write that state, unless it is in the file. `advice` tells how to go on; empty if there
  !! is no way.
  subroutine save_last_good(saver, results, log, advice)
    type(saver_t), intent(inout) :: saver
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    character(:), allocatable, intent(out) :: advice
    type(error_t), allocatable :: error

    advice = ""
    if (.not. allocated(saver%path)) return
    if (saver%good_step > saver%saved_step) then
      call flush_results(results, error, saver%good_rows)
      if (.not. allocated(error)) call write_checkpoint(saver%path, saver%header, saver%good, &
                                                        saver%result_file, error)
      if (allocated(error)) then
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

  !> One more try from the state kept last with a smaller step, if the deck allows it and there is
  !! such a state; false if not. The smaller step stays, in later steps of the deck too.
  logical function try_again(saver, model, run, results, log) result(is_trying)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log

    is_trying = .false.
    if (.not. saver%retry > 0.0_wp .or. run%step_factor < 1.0_wp .or. saver%good_step < 0) return
    call unpack_run(model, run, saver%good)
    if (saver%good%fault /= "") then
      call log_line(log, "no second try: the state kept last does not fit, "//saver%good%fault)
      saver%good%fault = ""
      return
    end if
    call forget_history(results, saver%good_rows)
    run%has_frame = .false.
    run%step_factor = saver%retry
    run%control%largest = saver%retry*run%control%largest
    call log_line(log, "one more try from step "//to_text(run%n_steps)//", time "// &
                  to_text(run%instant%time)//", with "//rounded_text(saver%retry)// &
                  " of the time step")
    is_trying = .true.
  end function try_again

  !> The run is complete: a checkpoint that was to save it alone goes, once the result is on the
  !! disk.
  subroutine drop_checkpoint(saver, log)
    type(saver_t), intent(inout) :: saver
    type(run_log_t), intent(inout) :: log

    if (saver%is_lasting .or. saver%saved_step < 0) return
    if (.not. sync_file(saver%result_file)) return
    call remove_file(saver%path)
    call log_line(log, "checkpoint "//saver%path//" removed, since the run is complete")
  end subroutine drop_checkpoint

end module run_saver
