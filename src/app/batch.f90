!> Many runs, some of them side by side: what is finished is not repeated.
module batch
  use, intrinsic :: iso_c_binding, only: c_null_funptr
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use text, only: string_t, to_text, rounded_text, counted
  use failure, only: error_t, fail
  use input_errors, only: error_list_t
  use scene, only: scene_t
  use deck_reader, only: read_deck
  use interrupt, only: end_on_signals, watch_signals, watch_saves, hold_saves, is_stop_wanted, &
                       is_end_wanted, is_save_wanted, forget_save
  use child_process, only: start_program, take_ended, send_signal, insist_on_end, stop_signal, &
                           save_signal, pause_briefly
  use provenance, only: host_cores
  use system_files, only: true_path, is_folder, folder_of
  use output_files, only: error_file_problem, begin_error_file, note_failed_run, end_error_file, &
                          base_of, file_name, first_error, is_noted_as_failed
  use command_line, only: command_t
  use run_identity, only: identity_of
  use exit_codes, only: exit_input, exit_numerics, exit_interrupted, exit_done
  use batch_list, only: batch_run_t, read_batch
  use existing_result, only: result_state_t, read_result_state
  use file_lock, only: is_locked_by_others
  use text_file, only: why_left_alone, write_lines
  use result_table, only: quoted
  implicit none
  private

  public :: run_batch
  public :: outcome_t, outcome_of, is_final, print_table, write_table, summary_words, worst_code

  !> A run under way.
  type :: job_t
    integer :: process = 0     !! 0: none
    integer :: run = 0         !! number in the list
    logical :: is_resumed = .false.   !! it continues from a checkpoint
    logical :: is_stopping = .false.  !! it was asked to stop
    integer :: n_asked = 0            !! how often again
  end type job_t

  !> State of a run.
  type :: outcome_t
    character(:), allocatable :: status    !! completed, failed, interrupted, refused, running, due
    character(:), allocatable :: message   !! first error it reported; empty: none
    type(result_state_t) :: state
  end type outcome_t

  character(*), parameter :: header = &
    "line,status,steps,wall_seconds,energy_error,result,message,command"

contains

  !> Carry out the batch; the exit code is 0 if all runs are completed, 3 if the batch was
  !! interrupted, else 2 if a run failed and 1 if a deck was refused.
  integer function run_batch(command) result(code)
    type(command_t), intent(in) :: command
    type(batch_run_t), allocatable :: runs(:)
    type(string_t), allocatable :: identities(:)
    type(outcome_t), allocatable :: outcomes(:)
    type(error_t), allocatable :: error
    logical, allocatable :: is_due(:)
    integer :: i

    code = exit_input
    call end_on_signals(exit_interrupted)
    call read_batch(command%deck, runs, error)
    if (.not. allocated(error)) then
      if (command%only > size(runs)) call fail(error, "--only "//to_text(command%only)// &
                                               ": the batch has "//counted(size(runs), "run"))
    end if
    if (allocated(error)) then
      write (error_unit, "(a)") "igaform: "//error%message
      return
    end if
    allocate (identities(size(runs)), outcomes(size(runs)), is_due(size(runs)))
    do i = 1, size(runs)
      identities(i)%value = identity_of_run(runs(i))
      outcomes(i) = outcome_of(runs(i), identities(i)%value)
      is_due(i) = .not. (is_final(outcomes(i)) .or. command%is_summary) &
                  .and. (command%only == 0 .or. command%only == i)
    end do
    call watch_signals(c_null_funptr, waits_for_others=.true.)
    if (any(is_due)) call carry_out(command, runs, identities, is_due, outcomes)
    if (command%only == 0) then
      if (.not. command%is_quiet) call print_table(runs, outcomes)
      call write_table(base_of(file_name(true_path(command%deck)))//"_summary.csv", runs, &
                       outcomes, error)
      if (allocated(error)) write (error_unit, "(a)") "igaform: "//error%message
    else if (.not. command%is_quiet) then
      call print_table(runs(command%only:command%only), outcomes(command%only:command%only))
    end if
    code = worst_code(outcomes)
    if (command%only > 0) code = worst_code(outcomes(command%only:command%only))
    if (allocated(error)) code = exit_input
  end function run_batch

  !> The key that the result of a run must carry. What is wrong with a deck the run itself reports.
  function identity_of_run(run) result(identity)
    type(batch_run_t), intent(in) :: run
    character(:), allocatable :: identity
    type(scene_t) :: scene
    type(error_list_t) :: errors

    call read_deck(run%command%deck, run%command%overrides, scene, errors)
    identity = identity_of(run%command, scene)
  end function identity_of_run

  !> Start what is due as processes end, until all is done or a signal says stop: then all that
  !! is under way is asked to stop and waited for.
  subroutine carry_out(command, runs, identities, is_due, outcomes)
    type(command_t), intent(in) :: command
    type(batch_run_t), intent(in) :: runs(:)
    type(string_t), intent(in) :: identities(:)
    logical, intent(in) :: is_due(:)
    type(outcome_t), intent(inout) :: outcomes(:)
    type(job_t) :: jobs(max(1, command%n_jobs))
    integer :: next, process, code, j, n_done

    next = 1
    n_done = 0
    do
      do j = 1, size(jobs)
        if (jobs(j)%process /= 0 .or. is_stop_wanted()) cycle
        call start_next(command, runs, is_due, next, n_done, jobs(j), outcomes)
      end do
      if (all(jobs%process == 0)) exit
      call take_ended(process, code)
      if (process == 0) then
        call pass_on_signals(jobs)
        call pause_briefly()
        cycle
      end if
      do j = 1, size(jobs)
        if (jobs(j)%process /= process) cycle
        jobs(j)%process = 0
        if (jobs(j)%is_resumed .and. code == exit_input) then   ! a checkpoint of something else
          if (.not. is_stop_wanted()) then
            jobs(j)%is_resumed = .false.
            call start(command, runs(jobs(j)%run), jobs(j))
            if (jobs(j)%process /= 0) cycle
          end if
          code = exit_interrupted
        end if
        n_done = n_done + 1
        associate (r => jobs(j)%run)
          call record_end(runs(r), identities(r)%value, code, outcomes(r))
          call report_end(command, n_done, count(is_due), runs(r), outcomes(r))
        end associate
      end do
    end do
  end subroutine carry_out

  !> What signals ask for goes to all that is under way: to save, to stop, or to end at once.
  subroutine pass_on_signals(jobs)
    type(job_t), intent(inout) :: jobs(:)
    logical :: is_saving
    integer :: j

    is_saving = is_save_wanted() .and. .not. is_stop_wanted()
    if (is_saving) call forget_save()
    do j = 1, size(jobs)
      if (jobs(j)%process == 0) cycle
      if (is_saving) then
        call send_signal(jobs(j)%process, save_signal)
      else if (is_end_wanted()) then
        call insist_on_end(jobs(j)%process, jobs(j)%n_asked)
      else if (is_stop_wanted() .and. .not. jobs(j)%is_stopping) then
        jobs(j)%is_stopping = .true.
        call send_signal(jobs(j)%process, stop_signal)
      end if
    end do
  end subroutine pass_on_signals

  !> Start the next run that is due. One that cannot be started is reported and skipped.
  subroutine start_next(command, runs, is_due, next, n_done, job, outcomes)
    type(command_t), intent(in) :: command
    type(batch_run_t), intent(in) :: runs(:)
    logical, intent(in) :: is_due(:)
    integer, intent(inout) :: next, n_done   !! number in the list, runs that ended
    type(job_t), intent(inout) :: job        !! free; without a process after the end of the list
    type(outcome_t), intent(inout) :: outcomes(:)

    do while (next <= size(runs) .and. job%process == 0)
      if (is_due(next)) then
        job%run = next
        inquire (file=runs(next)%base//".ckpt.h5", exist=job%is_resumed)
        job%is_resumed = job%is_resumed .and. (outcomes(next)%status == "interrupted" &
                                               .or. outcomes(next)%status == "failed")
        call start(command, runs(next), job)
        if (job%process == 0) then
          if (.not. is_folder(folder_of(runs(next)%base))) outcomes(next)%status = "refused"
          if (error_file_problem(runs(next)%base//".err") /= "") outcomes(next)%status = "refused"
          outcomes(next)%message = why_unstarted(runs(next))
          n_done = n_done + 1
          call report_end(command, n_done, count(is_due), runs(next), outcomes(next))
        end if
      end if
      next = next + 1
    end do
  end subroutine start_next

  !> A line of progress.
  subroutine report_end(command, n_done, n_due, run, outcome)
    type(command_t), intent(in) :: command
    integer, intent(in) :: n_done, n_due
    type(batch_run_t), intent(in) :: run
    type(outcome_t), intent(in) :: outcome

    if (command%is_quiet) return
    write (output_unit, "(a)") "["//to_text(n_done)//"/"//to_text(n_due)//"] "//run%text//": "// &
      outcome%status
    flush (output_unit)
  end subroutine report_end

  !> Start one run. The cores are shared out evenly unless the user says how many threads.
  !! What the line of a run says goes before what is said of the batch.
  subroutine start(command, run, job)
    type(command_t), intent(in) :: command
    type(batch_run_t), intent(in) :: run
    type(job_t), intent(inout) :: job
    type(string_t), allocatable :: words(:)
    integer :: n_threads

    n_threads = command%n_threads
    if (n_threads == 0) n_threads = max(1, host_cores()/max(1, command%n_jobs))
    words = [words_of("igaform"), run%words, words_of("--quiet")]
    if (run%command%n_threads == 0) then
      words = [words, words_of("--threads"), words_of(to_text(n_threads))]
    end if
    if (command%wall_minutes > 0 .and. run%command%wall_minutes <= 0) then
      words = [words, words_of("--wall"), words_of(to_text(command%wall_minutes))]
    end if
    if (job%is_resumed) then
      words = [words, words_of("--restart"), words_of(run%base//".ckpt.h5")]
    end if
    job%process = 0
    if (error_file_problem(run%base//".err") == "") then
      call begin_error_file(run%base//".err", run%text)
      call hold_saves()
      call start_program("/proc/self/exe", words, run%base//".err", job%process)
      call watch_saves()
    end if
    if (job%process == 0) write (error_unit, "(a)") "igaform: "//run%text//": "//why_unstarted(run)
  end subroutine start

  function why_unstarted(run) result(words)
    type(batch_run_t), intent(in) :: run
    character(:), allocatable :: words

    if (is_folder(folder_of(run%base))) then
      words = error_file_problem(run%base//".err")
      if (words == "") words = "'"//run%base//".err' for its messages"
      words = "cannot be started with "//words
    else
      words = "found no folder '"//folder_of(run%base)//"' for its result; make it first"
    end if
  end function why_unstarted

  function words_of(word) result(list)
    character(*), intent(in) :: word
    type(string_t) :: list(1)

    list(1)%value = word
  end function words_of

  !> State of a run that has ended; a file of messages without any is removed.
  subroutine record_end(run, identity, code, outcome)
    type(batch_run_t), intent(in) :: run
    character(*), intent(in) :: identity
    integer, intent(in) :: code
    type(outcome_t), intent(out) :: outcome

    outcome = outcome_of(run, identity)
    if (has_failed(code) .and. outcome%state%status /= "failed") &
      call note_failed_run(run%base//".err", run%text, identity)
    call end_error_file(run%base//".err", run%text)
    outcome = outcome_of(run, identity)
    if (code == exit_input) outcome%status = "refused"
    if (code > 128 .and. outcome%message == "") outcome%message = "ended by signal "// &
                                                                  to_text(code - 128)
  end subroutine record_end

  !> Does the exit code of a run mean a failure, or 128 and a signal of a crash?
  pure logical function has_failed(code)
    integer, intent(in) :: code
    integer, parameter :: crashes(5) = [4, 6, 7, 8, 11]   ! SIGILL, ABRT, BUS, FPE, SEGV

    has_failed = code == exit_numerics .or. any(code == 128 + crashes)
  end function has_failed

  !> State of a run: by its result, if that belongs to this very deck and program.
  function outcome_of(run, identity) result(outcome)
    type(batch_run_t), intent(in) :: run
    character(*), intent(in) :: identity       !! that its result must have
    type(outcome_t) :: outcome

    call read_result_state(run%result_file, outcome%state)
    outcome%status = "due"
    outcome%message = first_error(run%base//".err")
    if (outcome%state%identity == identity) then
      outcome%status = outcome%state%status
      if (outcome%status == "running" .or. outcome%status == "") then
        outcome%state%status = ""
        outcome%status = "interrupted"
        if (is_noted_as_failed(run%base//".err", identity)) outcome%status = "failed"
        if (is_under_way(run)) outcome%status = "running"
      end if
    else
      outcome%state%status = ""
      if (outcome%message /= "") outcome%status = "refused"
      if (is_noted_as_failed(run%base//".err", identity)) outcome%status = "failed"
      if (is_under_way(run)) outcome%status = "running"
    end if
    if (outcome%status == "completed") outcome%message = ""
  end function outcome_of

  !> Is another program running it? A run locks its log first and its result a little later.
  logical function is_under_way(run)
    type(batch_run_t), intent(in) :: run

    is_under_way = is_locked_by_others(run%base//".log")
    if (.not. is_under_way) is_under_way = is_locked_by_others(run%result_file)
  end function is_under_way

  !> Would the run, once more, end the same, or be in the way of one that is under way? What failed
  !! counts as final where its result says so, not where it crashed or could not read its data.
  pure logical function is_final(outcome)
    type(outcome_t), intent(in) :: outcome

    is_final = any(outcome%status == [character(9) :: "completed", "failed", "running"])
    if (outcome%status == "failed") is_final = outcome%state%status == "failed"
  end function is_final

  !> The exit code of a batch: that of what is most in need of attention, a run that is not at its
  !! end before one that failed before one that was refused.
  pure integer function worst_code(outcomes) result(code)
    type(outcome_t), intent(in) :: outcomes(:)
    integer :: i

    code = exit_done
    do i = 1, size(outcomes)
      select case (outcomes(i)%status)
      case ("completed")
      case ("refused")
        code = max(code, exit_input)
      case ("failed")
        code = max(code, exit_numerics)
      case default
        code = max(code, exit_interrupted)
      end select
    end do
  end function worst_code

  !> The table for people.
  subroutine print_table(runs, outcomes)
    type(batch_run_t), intent(in) :: runs(:)
    type(outcome_t), intent(in) :: outcomes(:)
    integer :: i

    write (output_unit, "(a)") "line  status             steps    wall [s]  energy error  run"
    do i = 1, size(runs)
      associate (o => outcomes(i))
        if (is_final(o)) then
          write (output_unit, "(i4, 2x, a11, i13, f12.1, es14.2, 2x, a)") runs(i)%line, &
            o%status//repeat(" ", 11), nint(o%state%n_steps), o%state%wall_seconds, &
            o%state%energy_error, runs(i)%text
        else
          write (output_unit, "(i4, 2x, a11, 41x, a)") runs(i)%line, o%status//repeat(" ", 11), &
            runs(i)%text
        end if
        if (o%message /= "") write (output_unit, "(19x, a)") o%message
      end associate
    end do
    write (output_unit, "(a)") summary_words(outcomes)
  end subroutine print_table

  !> How many runs are in which state, in words.
  function summary_words(outcomes) result(words)
    type(outcome_t), intent(in) :: outcomes(:)
    character(:), allocatable :: words
    character(11), parameter :: kinds(6) = [character(11) :: "completed", "failed", "refused", &
                                            "interrupted", "running", "due"]
    integer :: k, i, n

    words = counted(size(outcomes), "run")
    do k = 1, size(kinds)
      n = 0
      do i = 1, size(outcomes)
        if (outcomes(i)%status == trim(kinds(k))) n = n + 1
      end do
      if (n > 0) words = words//merge(": ", ", ", index(words, ":") == 0)//to_text(n)//" "// &
                         trim(kinds(k))
    end do
  end function summary_words

  !> The table as CSV, which replaces an older one as a whole. Rejected: a file of this name
  !! that is no such table.
  subroutine write_table(path, runs, outcomes, error)
    character(*), intent(in) :: path
    type(batch_run_t), intent(in) :: runs(:)
    type(outcome_t), intent(in) :: outcomes(:)
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: lines(size(runs) + 1)
    integer :: i
    character(:), allocatable :: why

    why = why_left_alone(path, header, "summary")
    if (why == "") then
      lines(1)%value = header
      do i = 1, size(runs)
        lines(i + 1)%value = csv_line(runs(i), outcomes(i))
      end do
      call write_lines(path, lines, why)
    end if
    if (why /= "") call fail(error, "summary '"//path//"': "//why)
  end subroutine write_table

  function csv_line(run, outcome) result(line)
    type(batch_run_t), intent(in) :: run
    type(outcome_t), intent(in) :: outcome
    character(:), allocatable :: line

    line = to_text(run%line)//","//outcome%status//","//to_text(nint(outcome%state%n_steps))// &
           ","//rounded_text(outcome%state%wall_seconds)//","// &
           rounded_text(outcome%state%energy_error)//","//quoted(run%result_file)//","// &
           quoted(outcome%message)//","//quoted(run%text)
  end function csv_line

end module batch
