!> When the state of a run is saved, and what happens when a run fails.
!!
!! A state that is kept in memory is verified by the increments that follow: a restart file is
!! written from a verified state alone, and a retry begins with one.
module run_saver
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use failure, only: error_t
  use text, only: string_t, to_text, rounded_text
  use timer, only: clock_ticks, ticks_to_seconds, start_watch, stop_watch, watch_seconds, set_time
  use interrupt, only: is_save_wanted, forget_save, stop_signal_name
  use state_store, only: state_store_t, empty_store, enter_folder, carry, carry_array, has_state
  use model, only: model_t
  use row_sharing, only: join_rows
  use store_gather, only: complete_store
  use frames, only: results_t, flush_results
  use ranks, only: is_first, first_says
  use hdf5_file, only: path_of_open
  use run_log, only: run_log_t, log_line
  use checkpoint, only: checkpoint_header_t, write_checkpoint, read_checkpoint
  use run_state, only: run_t, wall_seconds, carry_run, carry_outlines, unpack_run
  use run_frames, only: release_frames
  use system_files, only: remove_file, sync_file
  implicit none
  private

  public :: saver_t, take_due_state, keep_verified, save_verified, retry_run, pack_for_file
  public :: resume_from, is_interval_over, is_clock_due, final_time, drop_checkpoint

  !> Increments before the state is kept again, which costs about as much as half of one.
  integer, parameter :: steps_between = 200
  !> Increments without failure after a state before it counts as verified: what begins to grow in
  !! it would show by then.
  integer, parameter :: n_verifying = 20
  !> Least number of increments between two states that are saved by intervals: the next one is
  !! taken when the previous one has been saved.
  integer, parameter, public :: least_steps = n_verifying + 1

  !> A state of the run in memory, and how much of the result belongs to it.
  type :: kept_t
    type(state_store_t) :: store
    integer(int64) :: step = 0
    real(wp) :: time = 0.0_wp
    integer :: deck_step = 0
    integer :: n_frames = 0         !! frames in the result then
    integer :: n_samples = 0        !! history samples that waited then
  end type kept_t

  !> Where and when the state is saved. Without a path there is nothing to do.
  !!
  !! Which states are kept follows from the increments, the frames and the deck's intervals alone,
  !! never from the clock or a signal: these only let the last verified state be written. So a retry
  !! begins at the same state however often the run was saved, stopped and resumed.
  type :: saver_t
    character(:), allocatable :: path, result_file
    type(checkpoint_header_t) :: header
    character(:), allocatable :: other_build  !! how that of the checkpoint differs; or empty
    type(string_t), allocatable :: changes(:) !! of the deck since the checkpoint, in words
    integer :: every_steps = 0                !! 0: not by steps
    real(wp) :: every_seconds = 0.0_wp        !! of wall-clock time; 0: not by the clock
    integer :: number = 0                     !! of states over the run; 0: not by its time
    logical :: is_lasting = .false.           !! the end is saved too, and the file stays
    real(wp) :: wall_seconds = 0.0_wp         !! after which the run stops; 0: never
    real(wp) :: retry = 0.0_wp                !! factor on the increment for a retry; 0: none
    integer(int64) :: began_step = 0          !! of the checkpoint that the run continues from
    character(:), allocatable :: stopped_by   !! why the run stopped before its end, if it did
    logical :: is_state_lost = .false.        !! it stopped, and could not write its state
    integer(int64) :: saved_step = -1         !! of the file; negative: this run wrote none
    integer :: saved_deck_step = 0            !! a step of frequencies has no increments of its own
    real(wp) :: saved_time = 0.0_wp
    integer(int64) :: tried_ticks = 0         !! of the last try to write the file
    type(kept_t), allocatable :: verified     !! the last verified state
    type(kept_t), allocatable :: next         !! taken later, not verified yet
    type(kept_t), allocatable :: entry        !! with which a later step of the deck began, where
                                              !! the deck allows a retry
    integer(int64) :: taken_step = 0          !! of the later of both
    real(wp) :: taken_time = 0.0_wp
    logical :: is_waiting = .false.           !! `next` is being verified
    logical :: is_checking = .false.          !! the balances of this step are needed
    logical :: is_saving = .false.            !! `next` is written when it is verified
    integer(int64) :: verification_step = 0   !! in which `next` counts as verified
  end type saver_t

contains

  !> To be called at the start of each increment: takes the state where one is to be kept, not
  !! before the waiting one is verified, which happens in `keep_verified`. The first state and that
  !! at the end of a step of the deck, with nothing before or after, are checked at once: the next
  !! step may fail to begin, and may be another one after a restart.
  subroutine take_due_state(saver, model, run, results, is_step_end)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model       !! its timer alone changes
    type(run_t), intent(inout) :: run           !! nothing changes
    type(results_t), intent(in) :: results
    logical, intent(in) :: is_step_end          !! the step of the deck is over
    logical :: is_due, is_over, is_at_once, is_end

    if (.not. allocated(saver%path) .or. run%n_steps == 0) return
    saver%is_checking = saver%is_waiting .and. run%n_steps == saver%verification_step
    if (is_entry(saver, model, run)) then
      saver%is_checking = .true.
      call take_state(saver%entry, model, run, results, is_whole=.true.)
    end if
    is_end = is_step_end .and. size(model%later_steps) == 0 .and. saver%is_lasting .and. &
             .not. is_saved(saver, run%n_steps, model%i_step)
    ! An equilibrium needs no increments behind it to show that it is sound.
    is_at_once = .not. allocated(saver%verified) .or. is_end .or. model%step%is_static .or. &
                 (is_step_end .and. size(model%later_steps) > 0)
    if (run%n_steps <= saver%taken_step + n_verifying .and. .not. is_at_once) return
    ! A state that is checked at once takes the place of one that was to be saved.
    is_over = is_interval_over(saver, model, run) .or. is_end .or. &
              (saver%is_waiting .and. saver%is_saving)
    is_due = is_at_once .or. is_over .or. run%n_waiting > 0 &
             .or. run%n_steps - saver%taken_step >= steps_between
    if (.not. is_due) return
    saver%is_saving = is_over
    saver%is_checking = .true.
    saver%verification_step = run%n_steps + merge(0, n_verifying, is_at_once)
    saver%is_waiting = .true.
    call take_state(saver%next, model, run, results, is_whole_here(saver, model))
    saver%taken_step = run%n_steps
    saver%taken_time = run%instant%time
  end subroutine take_due_state

  !> Does this process write states, or go back to one? Others need no more of them than what they
  !! add to the file.
  pure logical function is_whole_here(saver, model) result(is_whole)
    type(saver_t), intent(in) :: saver
    type(model_t), intent(in) :: model

    is_whole = is_first(model%ranks) .or. saver%retry > 0.0_wp
  end function is_whole_here

  !> Is this the first increment of a later step of the deck, from which a retry may begin until
  !! there is a verified state of that step?
  pure logical function is_entry(saver, model, run)
    type(saver_t), intent(in) :: saver
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run

    is_entry = may_retry(saver, run) .and. allocated(saver%verified)
    if (is_entry) is_entry = saver%verified%deck_step /= model%i_step
    if (is_entry .and. allocated(saver%entry)) is_entry = saver%entry%deck_step /= model%i_step
  end function is_entry

  !> Does the deck allow a retry, and was there none?
  pure logical function may_retry(saver, run)
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run

    may_retry = saver%retry > 0.0_wp .and. .not. run%step_factor < 1.0_wp
  end function may_retry

  !> Is one of the deck's intervals over, other than that of the clock?
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

  !> Is the deck's interval of wall-clock time over, and the last verified state not in the file?
  logical function is_clock_due(saver, run, now) result(is_due)
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run
    integer(int64), intent(in) :: now        !! by the clock [ticks]
    integer(int64) :: last_ticks

    is_due = saver%every_seconds > 0.0_wp
    if (is_due) is_due = .not. is_saved(saver, saver%verified%step, saver%verified%deck_step)
    if (.not. is_due) return
    last_ticks = saver%tried_ticks
    if (last_ticks == 0) last_ticks = run%started
    is_due = ticks_to_seconds(now - last_ticks) >= saver%every_seconds
  end function is_clock_due

  !> The end of the last step of the deck, without static ones to come: their time is no measure.
  pure real(wp) function final_time(model, run)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run

    final_time = run%control%end_time + sum(model%later_steps%step%duration, &
                                            mask=.not. model%later_steps%step%is_static)
  end function final_time

  !> The state of this increment, not verified yet. Frames that are not written yet belong to it.
  subroutine take_state(kept, model, run, results, is_whole)
    type(kept_t), allocatable, intent(inout) :: kept
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(in) :: results
    logical, intent(in) :: is_whole             !! see `is_whole_here`

    call start_watch(model%timer, run%watch_state)
    if (.not. allocated(kept)) allocate (kept)
    kept%n_frames = results%n_frames + run%n_waiting
    call join_rows(model, run)
    kept%store%has_parts_alone = .not. is_whole
    call pack_for_file(model, run, kept%n_frames, kept%store)
    kept%step = run%n_steps
    kept%time = run%instant%time
    kept%deck_step = model%i_step
    kept%n_samples = results%history%n_samples
    call stop_watch(model%timer, run%watch_state)
  end subroutine take_state

  !> To be called in each increment without failure, before its history sample is recorded: the
  !! waiting state, if its time has come, is the last verified one from now on. That one is saved
  !! where the deck, the clock or a signal asks for it, and the run stopped.
  subroutine keep_verified(saver, model, run, results, log, error)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: why      ! the run must stop now; empty if it need not
    logical :: is_due, is_wish

    if (.not. allocated(saver%path)) &
      call release_frames(model, run, results, run%n_waiting, error)
    is_due = saver%is_waiting .and. run%n_steps >= saver%verification_step
    if (is_due) then
      call accept_next(saver, model, run, results, error)
      is_due = saver%is_saving
    end if
    if (allocated(error) .or. .not. allocated(saver%verified)) return
    call ask_from_outside(saver, model, run, why, is_wish)
    is_due = is_due .or. is_wish
    if (is_due) call save(saver, model, run, results, log, why == "", error)
    if (allocated(error) .or. why == "") return
    saver%stopped_by = why
    saver%is_state_lost = .not. is_saved(saver, saver%verified%step, saver%verified%deck_step)
    call log_line(log, "stopped by "//why//" at step "//to_text(run%n_steps)//", time "// &
                  rounded_text(run%instant%time)//"; the last verified state is that of step "// &
                  to_text(saver%verified%step))
    if (saver%verified%step == saver%began_step) &
      call log_line(log, "warning: no state since the restart is verified yet, so that the "// &
                    "next one begins at the same step: let it run for "// &
                    to_text(steps_between + n_verifying)//" steps or longer")
    call release_frames(model, run, results, run%n_waiting, error)
  end subroutine keep_verified

  !> Do a signal, the clock or the deck's interval of time want the run to stop or its last verified
  !! state to be written now? Of several processes the first one decides for all, every few
  !! increments.
  subroutine ask_from_outside(saver, model, run, why, is_wanted)
    type(saver_t), intent(in) :: saver
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    character(:), allocatable, intent(out) :: why     !! the run must stop; empty if it need not
    logical, intent(out) :: is_wanted                 !! the state
    integer, parameter :: few = 16
    real(wp) :: seconds

    why = ""
    is_wanted = .false.
    if (allocated(model%ranks)) then
      if (mod(run%n_steps, int(few, int64)) /= 0 .and. .not. model%step%is_static) return
    end if
    if (is_first(model%ranks)) then
      why = stop_signal_name()
      seconds = ticks_to_seconds(clock_ticks() - run%started)
      if (why == "" .and. saver%wall_seconds > 0.0_wp .and. seconds >= saver%wall_seconds) &
        why = "the limit of "//rounded_text(saver%wall_seconds/60.0_wp)//" minutes"
      is_wanted = is_save_wanted()
      if (is_wanted) call forget_save()   ! not one that comes from here on
      if (why /= "" .or. is_wanted) is_wanted = .not. is_in_file(saver)
      if (.not. is_wanted) is_wanted = is_clock_due(saver, run, clock_ticks())
    end if
    is_wanted = first_says(model%ranks, is_wanted)
    if (allocated(model%ranks)) call model%ranks%share_text(why, 0)
  end subroutine ask_from_outside

  !> Is the last verified state in the file already, and does the file exist?
  logical function is_in_file(saver)
    type(saver_t), intent(in) :: saver

    inquire (file=saver%path, exist=is_in_file)
    is_in_file = is_in_file .and. is_saved(saver, saver%verified%step, saver%verified%deck_step)
  end function is_in_file

  !> Is the state that this run has written last that of this increment and step of the deck?
  pure logical function is_saved(saver, n_steps, deck_step)
    type(saver_t), intent(in) :: saver
    integer(int64), intent(in) :: n_steps
    integer, intent(in) :: deck_step

    is_saved = saver%saved_step == n_steps .and. saver%saved_deck_step == deck_step
  end function is_saved

  !> The waiting state is verified. Both are exchanged, so that they keep their memory, and the
  !! frames that belong to it are written.
  subroutine accept_next(saver, model, run, results, error)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(error_t), allocatable, intent(out) :: error
    type(kept_t), allocatable :: before
    integer :: n

    saver%is_waiting = .false.
    call move_alloc(saver%verified, before)
    call move_alloc(saver%next, saver%verified)
    call move_alloc(before, saver%next)
    n = saver%verified%n_frames - results%n_frames
    if (n == 0) return
    call release_frames(model, run, results, n, error, saver%verified%n_samples)
    call count_written_samples(saver)
  end subroutine accept_next

  !> The history samples that belong to the last verified state are written: later ones wait.
  subroutine count_written_samples(saver)
    type(saver_t), intent(inout) :: saver

    associate (n => saver%verified%n_samples)
      if (saver%is_waiting) saver%next%n_samples = saver%next%n_samples - n
      if (allocated(saver%entry)) saver%entry%n_samples = saver%entry%n_samples - n
      n = 0
    end associate
  end subroutine count_written_samples

  !> Write the checkpoint. If that fails a run continues: there may be room for the next one. Not so
  !! if the result itself cannot be written, which then lacks history samples.
  subroutine save(saver, model, run, results, log, is_going_on, error)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    logical, intent(in) :: is_going_on
    type(error_t), allocatable, intent(out) :: error   !! of the result

    call start_watch(model%timer, run%watch_state)
    call write_verified(saver, results, error, run%is_file_lost)
    call stop_watch(model%timer, run%watch_state)
    saver%tried_ticks = clock_ticks()
    if (run%is_file_lost) return
    if (allocated(error)) then
      if (is_going_on) error%message = error%message//"; the run continues"
      call log_line(log, "warning: "//error%message)
      deallocate (error)
    else
      call log_line(log, "checkpoint "//saver%path//" at step "//to_text(saver%saved_step)// &
                    ", time "//rounded_text(saver%saved_time))
    end if
  end subroutine save

  subroutine write_verified(saver, results, error, is_result_lost)
    type(saver_t), intent(inout) :: saver
    type(results_t), intent(inout) :: results
    type(error_t), allocatable, intent(out) :: error
    logical, intent(out) :: is_result_lost       !! it is the result that could not be written
    character(:), allocatable :: path

    call flush_results(results, error, saver%verified%n_samples)
    is_result_lost = allocated(error)
    if (is_result_lost) return
    call count_written_samples(saver)
    path = ""
    if (is_first(results%ranks)) path = path_of_open(results%file)
    call write_checkpoint(saver%path, saver%header, saver%verified%store, path, error, &
                          results%ranks)
    if (allocated(error)) return
    saver%saved_step = saver%verified%step
    saver%saved_deck_step = saver%verified%deck_step
    saver%saved_time = saver%verified%time
  end subroutine write_verified

  !> Take the state of a run from a checkpoint, and keep it. `store%reason` states what does not
  !! fit; the state is not to be used then.
  subroutine resume_from(saver, model, run, store)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(state_store_t), intent(inout) :: store

    if (.not. allocated(saver%verified)) allocate (saver%verified)
    call unpack_run(model, run, store)
    if (store%reason == "") call carry_rest(model, run, saver%verified%n_frames, store)
    if (is_whole_here(saver, model)) saver%verified%store = store
    saver%verified%step = run%n_steps
    saver%verified%time = run%instant%time
    saver%verified%deck_step = model%i_step
    saver%began_step = run%n_steps
    saver%saved_time = run%instant%time
    saver%taken_step = run%n_steps
    saver%taken_time = run%instant%time
    saver%tried_ticks = clock_ticks()
  end subroutine resume_from

  !> What a checkpoint contains: all that steers the run, how much of the result belongs to it, the
  !! times so far. Taken at the start of a step, when the forces are those of the present positions
  !! and the velocities lie half a step back.
  subroutine pack_for_file(model, run, n_frames, store)
    type(model_t), intent(inout) :: model     !! stays as it is, like the run
    type(run_t), intent(inout) :: run
    integer, intent(inout) :: n_frames
    type(state_store_t), intent(inout) :: store   !! replaced

    call empty_store(store)
    call enter_folder(store, "run")
    call carry(store, "deck_step", model%i_step)
    call carry_array(store, "deck_step_starts", size(model%step_starts), model%step_starts)
    call carry_outlines(model, store)
    call carry_run(model, run, store)
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
        ! Later steps of the deck may have brought a watch that was not there.
        if (store%is_taking .and. .not. has_state(store, watch%name)) cycle
        call carry_array(store, watch%name, 2, times)
        if (store%is_taking) call set_time(watch, times(1), nint(times(2), int64))
      end associate
    end do
  end subroutine carry_rest

  !> The run has failed, and nothing was written since the state was kept: history samples still
  !! wait. Write that state, unless it is in the file. `advice` states how to continue, or why that
  !! is not possible; empty if there is no such state. A step that could not begin may be another
  !! one when the run is taken up again.
  subroutine save_verified(saver, model, run, results, advice)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(results_t), intent(inout) :: results
    character(:), allocatable, intent(out) :: advice
    type(error_t), allocatable :: error
    logical :: is_there, ignored

    advice = ""
    if (.not. allocated(saver%verified)) return
    inquire (file=saver%path, exist=is_there)
    is_there = first_says(results%ranks, is_there)
    if (.not. is_there) saver%saved_step = -1
    if (.not. is_saved(saver, saver%verified%step, saver%verified%deck_step)) &
      call write_verified(saver, results, error, ignored)
    if (allocated(error)) advice = "the last verified state, of step "// &
      to_text(saver%verified%step)//", cannot be saved: "//error%message//new_line("a")
    if (saver%saved_step < 0) return
    if (allocated(error)) then
      advice = advice//"an earlier verified state"
    else
      advice = "the last verified state"
    end if
    advice = advice//", of step "//to_text(saver%saved_step)//", time "// &
             rounded_text(saver%saved_time)//", is in '"//saver%path//"'"
    if (saver%saved_step == run%n_steps .and. saver%saved_deck_step < model%i_step) then
      advice = advice//", the end of step "//to_text(saver%saved_deck_step)//" of the deck: "// &
               "mend what follows in the deck and continue with igaform "// &
               saver%header%deck_file//" --restart "//saver%path
      return
    end if
    advice = advice//"; --restart "//saver%path//" fails in the same way, and shows more of it "// &
             "where *OUTPUT asks for more frames"
    ! A static step has cut its increments itself, see `retry_run`.
    if (saver%retry <= 0.0_wp .and. .not. model%step%is_static) advice = advice// &
      "; with *CHECKPOINT, RETRY=0.5 in the deck it retries with half the time increment"
  end subroutine save_verified

  !> Retry with a smaller time increment, if the deck allows it and there is a state to begin from;
  !! false if not. The factor remains in effect, in later steps of the deck too. Where the last
  !! verified state is of an earlier step of the deck, the one that this step began with is used, if
  !! its balances were sound.
  logical function retry_run(saver, model, run, results, log) result(is_trying)
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log

    logical :: is_from_entry

    is_trying = .false.
    if (model%step%is_static) return   ! It has cut its increments itself.
    if (.not. (may_retry(saver, run) .and. allocated(saver%verified))) return
    is_from_entry = allocated(saver%entry) .and. saver%verified%deck_step /= model%i_step
    if (is_from_entry) is_from_entry = saver%entry%deck_step == model%i_step &
                                       .and. saver%entry%step < run%n_steps
    if (is_from_entry) then
      saver%is_waiting = saver%is_waiting .and. saver%next%deck_step /= model%i_step
      call go_back(saver%entry)
    else
      saver%is_waiting = .false.
      call go_back(saver%verified)
    end if

  contains

    subroutine go_back(kept)
      type(kept_t), intent(inout) :: kept

      ! Rows and tiles may have changed hands since.
      if (allocated(model%ranks)) call complete_store(model%ranks, kept%store)
      call unpack_run(model, run, kept%store)
      if (kept%store%reason /= "") then
        call log_line(log, "no retry: the state kept last does not fit, "//kept%store%reason)
        kept%store%reason = ""
        return
      end if
      saver%taken_step = kept%step
      saver%taken_time = kept%time
      results%history%n_samples = min(results%history%n_samples, kept%n_samples)
      run%n_waiting = min(run%n_waiting, kept%n_frames - results%n_frames)
      run%step_factor = saver%retry
      run%control%largest = saver%retry*run%control%largest
      call log_line(log, "retry from step "//to_text(run%n_steps)//", time "// &
                    rounded_text(run%instant%time)//", with "//rounded_text(saver%retry)// &
                    " of the time increment")
      is_trying = .true.
    end subroutine go_back
  end function retry_run

  !> The run is complete: unless the deck asks to keep it, its checkpoint is deleted once the result
  !! is on the disk, and so is that of an earlier run of this deck that was not completed.
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
      call log_line(log, "warning: checkpoint "//saver%path//" is kept: the result cannot be "// &
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

  !> Is there a checkpoint of this deck whose time is not later than that of this run?
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
