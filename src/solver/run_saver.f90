!> When the state of a run is saved, and what becomes of a run that fails.
module run_saver
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use failure, only: error_t
  use text, only: to_text, rounded_text
  use timer, only: clock_ticks, ticks_to_seconds, start_watch, stop_watch, watch_seconds, set_time
  use interrupt, only: is_save_wanted, forget_save, stop_signal_name
  use state_store, only: state_store_t, enter_folder, carry, carry_array
  use model, only: model_t
  use frames, only: results_t, flush_results, forget_history, n_frames_of, n_rows_of, &
                    path_of_results
  use run_log, only: run_log_t, log_line
  use checkpoint, only: checkpoint_header_t, write_checkpoint, read_checkpoint
  use run_state, only: run_t, wall_seconds, pack_run, unpack_run
  use run_frames, only: release_frames
  use system_files, only: remove_file, sync_file
  implicit none
  private

  public :: saver_t, look_after, keep, save_last_good, try_again, pack_for_file, start_from
  public :: is_interval_over, is_clock_due
  public :: drop_checkpoint

  !> Steps before the state is kept anew, which costs about as much as half of one.
  integer, parameter :: steps_between = 200
  !> Steps that go well behind a state before it counts as good: what begins to grow in it would
  !! show by then.
  integer, parameter :: proof = 20
  !> Steps between two states that are saved by intervals, at least: the next one is taken when the
  !! one before has been saved.
  integer, parameter, public :: least_steps = proof + 1

  !> A state of the run in memory, and how far the result belongs to it.
  type :: kept_t
    type(state_store_t) :: store
    integer(int64) :: step = 0
    real(wp) :: time = 0.0_wp
    integer :: deck_step = 0
    integer :: n_frames = 0         !! frames in the result then
    integer :: n_rows = 0           !! rows of the history that waited then
  end type kept_t

  !> Where and when the state is saved. Without a path there is nothing to do.
  !!
  !! Which states are kept follows from the steps, the frames and the deck's intervals alone, never
  !! from the clock or a signal: these only let the last good state be written. So a second try
  !! begins at the same state however often the run was saved, stopped and taken up again.
  type :: saver_t
    character(:), allocatable :: path, result_file
    type(checkpoint_header_t) :: header
    character(:), allocatable :: other_build  !! that the run continues from, how it differs
    integer :: every_steps = 0                !! 0: not by steps
    real(wp) :: every_seconds = 0.0_wp        !! of the clock; 0: not by the clock
    integer :: number = 0                     !! over the run; 0: not by its time
    logical :: is_lasting = .false.           !! the end is saved too, and the file stays
    real(wp) :: wall_seconds = 0.0_wp         !! after which the run stops; 0: never
    real(wp) :: retry = 0.0_wp                !! factor on the step for one more try; 0: none
    integer(int64) :: began_step = 0          !! of the checkpoint that the run continues from
    character(:), allocatable :: stopped_by   !! why the run stopped before its end, if it did
    logical :: is_state_lost = .false.        !! where it stopped, since it could not be written
    integer(int64) :: saved_step = -1         !! of the file; negative: there is none of this run
    real(wp) :: saved_time = 0.0_wp
    integer(int64) :: tried_ticks = 0         !! of the last try to write the file
    type(kept_t), allocatable :: good         !! proved so, kept last
    type(kept_t), allocatable :: next         !! taken later, not proved yet
    type(kept_t), allocatable :: entry        !! with which a later step of the deck began, where
                                              !! it may be tried again
    integer(int64) :: taken_step = 0          !! of the later of both
    real(wp) :: taken_time = 0.0_wp
    logical :: is_waiting = .false.           !! `next`, for `proof_step`
    logical :: is_checking = .false.          !! the balances of this step are needed
    logical :: is_saving = .false.            !! if `next` is good it is written
    integer(int64) :: proof_step = 0          !! in which `next` counts as good
  end type saver_t

contains

  !> To be called at the start of each step: takes the state where one is to be kept, not before the
  !! one that waits has proved good. Whether it is good shows in the step, when its velocities
  !! are known, and in the steps behind it; then `keep`. What the deck begins with and the end of
  !! the run, with nothing before it or behind it, are looked at once.
  subroutine look_after(saver, model, run, results, is_last)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model       !! its timer alone changes
    type(run_t), intent(inout) :: run           !! nothing changes
    type(results_t), intent(in) :: results
    logical, intent(in) :: is_last              !! the run ends with this step
    logical :: is_due, is_over, is_at_once, is_end

    if (.not. allocated(saver%path) .or. run%n_steps == 0) return
    saver%is_checking = saver%is_waiting .and. run%n_steps == saver%proof_step
    if (is_entry(saver, model, run)) then
      saver%is_checking = .true.
      call take_state(saver%entry, model, run, results)
    end if
    is_end = is_last .and. saver%is_lasting .and. run%n_steps > saver%saved_step
    is_at_once = .not. allocated(saver%good) .or. is_end
    if (run%n_steps <= saver%taken_step + proof .and. .not. is_at_once) return
    is_over = is_interval_over(saver, model, run) .or. is_end
    is_due = is_at_once .or. is_over .or. run%n_waiting > 0 &
             .or. run%n_steps - saver%taken_step >= steps_between
    if (.not. is_due) return
    saver%is_saving = is_over
    saver%is_checking = .true.
    saver%proof_step = run%n_steps + merge(0, proof, is_at_once)
    saver%is_waiting = .true.
    call take_state(saver%next, model, run, results)
    saver%taken_step = run%n_steps
    saver%taken_time = run%instant%time
  end subroutine look_after

  !> Is this the first time step of a later step of the deck, which a second try may begin at until
  !! there is a good state of that step?
  pure logical function is_entry(saver, model, run)
    type(saver_t), intent(in) :: saver
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run

    is_entry = may_try(saver, run) .and. allocated(saver%good)
    if (is_entry) is_entry = saver%good%deck_step /= model%i_step
    if (is_entry .and. allocated(saver%entry)) is_entry = saver%entry%deck_step /= model%i_step
  end function is_entry

  !> Does the deck allow a second try, and was there none?
  pure logical function may_try(saver, run)
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run

    may_try = saver%retry > 0.0_wp .and. .not. run%step_factor < 1.0_wp
  end function may_try

  !> Why the run must stop now; empty if it need not.
  function reason_to_stop(saver, run) result(why)
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run
    character(:), allocatable :: why

    why = stop_signal_name()
    if (why /= "" .or. .not. saver%wall_seconds > 0.0_wp) return
    if (ticks_to_seconds(clock_ticks() - run%started) >= saver%wall_seconds) &
      why = "the limit of "//rounded_text(saver%wall_seconds/60.0_wp)//" minutes"
  end function reason_to_stop

  !> Is one of the deck's intervals over that do not go by the clock?
  pure logical function is_interval_over(saver, model, run) result(is_over)
    type(saver_t), intent(in) :: saver
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    real(wp) :: interval

    is_over = .false.
    if (saver%every_steps > 0) is_over = run%n_steps/saver%every_steps &
                                         > saver%taken_step/saver%every_steps
    if (saver%number > 0) then
      interval = final_time(model, run)/saver%number
      is_over = is_over .or. int(run%instant%time/interval) > int(saver%taken_time/interval)
    end if
  end function is_interval_over

  !> Is the deck's interval of the clock over, and the last good state not in the file?
  logical function is_clock_due(saver, run, now) result(is_due)
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run
    integer(int64), intent(in) :: now        !! by the clock [ticks]
    integer(int64) :: last_ticks

    is_due = saver%every_seconds > 0.0_wp
    if (is_due) is_due = saver%good%step > saver%saved_step
    if (.not. is_due) return
    last_ticks = saver%tried_ticks
    if (last_ticks == 0) last_ticks = run%started
    is_due = ticks_to_seconds(now - last_ticks) >= saver%every_seconds
  end function is_clock_due

  !> The end of the last step of the deck.
  pure real(wp) function final_time(model, run)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run

    final_time = run%control%end_time + sum(model%later_steps%step%duration)
  end function final_time

  !> The state of this step, which may turn out to be bad. Frames that are not written yet belong
  !! to it.
  subroutine take_state(kept, model, run, results)
    type(kept_t), allocatable, intent(inout) :: kept
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(in) :: results

    call start_watch(model%timer, run%watch_state)
    if (.not. allocated(kept)) allocate (kept)
    kept%n_frames = n_frames_of(results) + run%n_waiting
    call pack_for_file(model, run, kept%n_frames, kept%store)
    kept%step = run%n_steps
    kept%time = run%instant%time
    kept%deck_step = model%i_step
    kept%n_rows = n_rows_of(results)
    call stop_watch(model%timer, run%watch_state)
  end subroutine take_state

  !> To be called in each step where nothing is wrong, before its row is recorded: the state that
  !! waits, if it has proved good, is the last good one from now on. That one is saved where the
  !! deck, the clock or a signal asks for it, and the run stopped.
  subroutine keep(saver, model, run, results, log, error)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: why
    logical :: is_due, is_wish

    if (.not. allocated(saver%path)) &
      call release_frames(model, run, results, run%n_waiting, error)
    is_due = saver%is_waiting .and. run%n_steps >= saver%proof_step
    if (is_due) then
      call accept_next(saver, model, run, results, error)
      is_due = saver%is_saving
    end if
    if (allocated(error) .or. .not. allocated(saver%good)) return
    why = reason_to_stop(saver, run)
    is_wish = is_save_wanted()
    if (is_wish) call forget_save()   ! not one that comes from here on
    if (.not. is_due .and. (why /= "" .or. is_wish)) is_due = .not. is_in_file(saver)
    if (.not. is_due) is_due = is_clock_due(saver, run, clock_ticks())
    if (is_due) call save(saver, model, run, results, log, why == "", error)
    if (allocated(error) .or. why == "") return
    saver%stopped_by = why
    saver%is_state_lost = saver%saved_step /= saver%good%step
    call log_line(log, "stopped by "//why//" at step "//to_text(run%n_steps)//", time "// &
                  to_text(run%instant%time)//"; the last good state is that of step "// &
                  to_text(saver%good%step))
    if (saver%good%step == saver%began_step) &
      call log_line(log, "warning: no state since the restart is proved good yet, so that the "// &
                    "next one begins at the same step: let it run for "// &
                    to_text(steps_between + proof)//" steps or longer")
    call release_frames(model, run, results, run%n_waiting, error)
  end subroutine keep

  !> Is the last good state in the file already, and the file there?
  logical function is_in_file(saver)
    type(saver_t), intent(in) :: saver

    inquire (file=saver%path, exist=is_in_file)
    is_in_file = is_in_file .and. saver%saved_step == saver%good%step
  end function is_in_file

  !> The state that waits is good. Both change places, so that they keep their room, and the frames
  !! that belong to it are written.
  subroutine accept_next(saver, model, run, results, error)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(error_t), allocatable, intent(out) :: error
    type(kept_t), allocatable :: before
    integer :: n

    saver%is_waiting = .false.
    call move_alloc(saver%good, before)
    call move_alloc(saver%next, saver%good)
    call move_alloc(before, saver%next)
    n = saver%good%n_frames - n_frames_of(results)
    if (n == 0) return
    call release_frames(model, run, results, n, error, saver%good%n_rows)
    call forget_good_rows(saver)
  end subroutine accept_next

  !> The rows that belong to the last good state are written: those behind them wait.
  subroutine forget_good_rows(saver)
    type(saver_t), intent(inout) :: saver

    if (saver%is_waiting) saver%next%n_rows = saver%next%n_rows - saver%good%n_rows
    if (allocated(saver%entry)) saver%entry%n_rows = saver%entry%n_rows - saver%good%n_rows
    saver%good%n_rows = 0
  end subroutine forget_good_rows

  !> Write the checkpoint. If that fails a run goes on: there may be room for the next one. Not so
  !! if the result itself cannot be written, of which rows are missing then.
  subroutine save(saver, model, run, results, log, is_going_on, error)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    logical, intent(in) :: is_going_on
    type(error_t), allocatable, intent(out) :: error   !! of the result

    call start_watch(model%timer, run%watch_state)
    call write_good(saver, results, error, run%is_file_lost)
    call stop_watch(model%timer, run%watch_state)
    saver%tried_ticks = clock_ticks()
    if (run%is_file_lost) return
    if (allocated(error)) then
      if (is_going_on) error%message = error%message//"; the run continues"
      call log_line(log, "warning: "//error%message)
      deallocate (error)
    else
      call log_line(log, "checkpoint "//saver%path//" at step "//to_text(saver%saved_step)// &
                    ", time "//to_text(saver%saved_time))
    end if
  end subroutine save

  !> The last good state to the disk, with the result as it was then.
  subroutine write_good(saver, results, error, is_result_lost)
    type(saver_t), intent(inout) :: saver
    type(results_t), intent(inout) :: results
    type(error_t), allocatable, intent(out) :: error
    logical, intent(out) :: is_result_lost       !! it is the result that could not be written

    call flush_results(results, error, saver%good%n_rows)
    is_result_lost = allocated(error)
    if (is_result_lost) return
    call forget_good_rows(saver)
    call write_checkpoint(saver%path, saver%header, saver%good%store, path_of_results(results), &
                          error)
    if (allocated(error)) return
    saver%saved_step = saver%good%step
    saver%saved_time = saver%good%time
  end subroutine write_good

  !> Take the state of a run from a checkpoint, and keep it. What does not fit is told by
  !! `store%reason`, and the state is not to be used then.
  subroutine start_from(saver, model, run, store)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(state_store_t), intent(inout) :: store

    if (.not. allocated(saver%good)) allocate (saver%good)
    call unpack_run(model, run, store)
    if (store%reason == "") call carry_rest(model, run, saver%good%n_frames, store)
    saver%good%store = store
    saver%good%step = run%n_steps
    saver%good%time = run%instant%time
    saver%good%deck_step = model%i_step
    saver%began_step = run%n_steps
    saver%saved_time = run%instant%time
    saver%taken_step = run%n_steps
    saver%taken_time = run%instant%time
    saver%tried_ticks = clock_ticks()
  end subroutine start_from

  !> What a checkpoint holds: the state, how far the result belongs to it, and the times so far.
  subroutine pack_for_file(model, run, n_frames, store)
    type(model_t), intent(inout) :: model     !! stays as it is, like the run
    type(run_t), intent(inout) :: run
    integer, intent(inout) :: n_frames
    type(state_store_t), intent(inout) :: store   !! what it held before is forgotten

    call pack_run(model, run, store)
    call carry_rest(model, run, n_frames, store)
  end subroutine pack_for_file

  !> Frames of the result, and times, to which a run that is taken up again adds.
  subroutine carry_rest(model, run, n_frames, store)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    integer, intent(inout) :: n_frames
    type(state_store_t), intent(inout) :: store
    real(wp) :: seconds, times(2)
    integer :: i

    call enter_folder(store, "result")
    call carry(store, "n_frames", n_frames)
    call enter_folder(store, "times")
    seconds = wall_seconds(run)
    call carry(store, "wall_seconds", seconds)
    if (store%is_taking) run%seconds_before = seconds
    call enter_folder(store, "times/effects")
    do i = 1, size(model%timer%watches)
      associate (watch => model%timer%watches(i))
        times = [watch_seconds(model%timer, i), real(watch%n_calls, wp)]
        call carry_array(store, watch%name, 2, times)
        if (store%is_taking) call set_time(watch, times(1), nint(times(2), int64))
      end associate
    end do
  end subroutine carry_rest

  !> The run has failed, and nothing was written since the state was kept: rows of the history still
  !! wait. Write that state, unless it is in the file. `advice` tells how to go on, or why nobody
  !! can; empty if there is no such state.
  subroutine save_last_good(saver, results, advice)
    type(saver_t), intent(inout) :: saver
    type(results_t), intent(inout) :: results
    character(:), allocatable, intent(out) :: advice
    type(error_t), allocatable :: error
    logical :: is_there, ignored

    advice = ""
    if (.not. allocated(saver%good)) return
    inquire (file=saver%path, exist=is_there)
    if (.not. is_there) saver%saved_step = -1
    if (saver%good%step > saver%saved_step) call write_good(saver, results, error, ignored)
    if (allocated(error)) advice = "the last good state, of step "//to_text(saver%good%step)// &
                                   ", cannot be saved: "//error%message//new_line("a")
    if (saver%saved_step < 0) return
    if (allocated(error)) then
      advice = advice//"an earlier good state"
    else
      advice = "the last good state"
    end if
    advice = advice//", of step "//to_text(saver%saved_step)//", time "// &
             to_text(saver%saved_time)//", is in '"//saver%path// &
             "'; --restart "//saver%path//" comes to the same end, and shows more of it where "// &
             "*OUTPUT asks for more frames"
    if (saver%retry <= 0.0_wp) advice = advice//"; with *CHECKPOINT, RETRY=0.5 in the deck it "// &
                                        "tries half the time step"
  end subroutine save_last_good

  !> One more try with a smaller step, if the deck allows it and there is a state to begin from;
  !! false if not. The smaller step stays, in later steps of the deck too. Where the last good state
  !! is of an earlier step of the deck, the one that this step began with must do, if its balances
  !! were sound.
  logical function try_again(saver, model, run, results, log) result(is_trying)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log

    logical :: is_from_entry

    is_trying = .false.
    if (.not. (may_try(saver, run) .and. allocated(saver%good))) return
    is_from_entry = allocated(saver%entry) .and. saver%good%deck_step /= model%i_step
    if (is_from_entry) is_from_entry = saver%entry%deck_step == model%i_step &
                                       .and. saver%entry%step < run%n_steps
    if (is_from_entry) then
      saver%is_waiting = saver%is_waiting .and. saver%next%deck_step /= model%i_step
      call go_back(saver%entry)
    else
      saver%is_waiting = .false.
      call go_back(saver%good)
    end if

  contains

    subroutine go_back(kept)
      type(kept_t), intent(inout) :: kept

      call unpack_run(model, run, kept%store)
      if (kept%store%reason /= "") then
        call log_line(log, "no second try: the state kept last does not fit, "//kept%store%reason)
        kept%store%reason = ""
        return
      end if
      saver%taken_step = kept%step
      saver%taken_time = kept%time
      call forget_history(results, kept%n_rows)
      run%n_waiting = min(run%n_waiting, kept%n_frames - n_frames_of(results))
      run%step_factor = saver%retry
      run%control%largest = saver%retry*run%control%largest
      call log_line(log, "one more try from step "//to_text(run%n_steps)//", time "// &
                    to_text(run%instant%time)//", with "//rounded_text(saver%retry)// &
                    " of the time step")
      is_trying = .true.
    end subroutine go_back
  end function try_again

  !> The run is complete: a checkpoint that was to save it alone goes, once the result is on the
  !! disk, and so does one that an earlier run of this deck has left half way.
  subroutine drop_checkpoint(saver, run, log)
    type(saver_t), intent(inout) :: saver
    type(run_t), intent(in) :: run
    type(run_log_t), intent(inout) :: log
    character(:), allocatable :: reason

    if (saver%is_lasting) return
    if (saver%saved_step < 0) then
      if (.not. is_overtaken(saver, run)) return
    end if
    if (.not. sync_file(saver%result_file, reason)) then
      call log_line(log, "warning: checkpoint "//saver%path//" stays: the result cannot be "// &
                    "brought to the disk: "//reason)
      return
    end if
    call remove_file(saver%path, reason)
    if (reason == "") then
      call log_line(log, "checkpoint "//saver%path//" removed, since the run is complete")
    else
      call log_line(log, "warning: checkpoint "//saver%path//" cannot be removed: "//reason)
    end if
  end subroutine drop_checkpoint

  !> Is there a checkpoint of this deck in which it had come no further?
  logical function is_overtaken(saver, run)
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run
    type(state_store_t) :: store
    type(error_t), allocatable :: error
    real(wp) :: time

    inquire (file=saver%path, exist=is_overtaken)
    if (is_overtaken) call read_checkpoint(saver%path, saver%header, store, error)
    is_overtaken = is_overtaken .and. .not. allocated(error)
    if (.not. is_overtaken) return
    store%is_taking = .true.
    time = huge(1.0_wp)
    call enter_folder(store, "run")
    call carry(store, "time", time)
    is_overtaken = time <= run%instant%time
  end function is_overtaken

end module run_saver
