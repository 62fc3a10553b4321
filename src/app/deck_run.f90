!> One deck from reading to closing the result file.
module deck_run
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_funloc, c_int, c_loc, c_ptr
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds, only: wp
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads, omp_set_dynamic
  use failure, only: error_t
  use input_errors, only: error_list_t, n_errors
  use text, only: string_t, to_text, rounded_text, counted
  use command_line, only: command_t
  use exit_codes, only: exit_done, exit_input, exit_numerics, exit_interrupted, exit_files, &
                        status_of
  use run_identity, only: identity_of
  use output_files, only: files_read, result_path, path_beside_result, check_message_file, &
                          open_message_file, close_message_file
  use scene, only: scene_t
  use deck_reader, only: read_deck
  use error_report, only: report_errors
  use shell_joints, only: joint_words
  use blank, only: n_elements_of, last_element_number, n_controls_of, mass_of
  use model, only: model_t
  use ranks, only: ranks_t, is_first, share_error
  use contact_effect, only: contact_view_t, contact_pairs
  use contact_report, only: log_contact
  use damping, only: relaxation_outcome
  use model_setup, only: build_model
  use setup_check, only: check_setup
  use frames, only: results_t, results_setup_t, close_results, unit_in
  use file_lock, only: lock_t, release_lock
  use system_files, only: kind_of_file, remove_file
  use hdf5_library, only: is_library_ready
  use run_log, only: run_log_t, timings_t, open_log, silence_log, mute_log, is_muted, log_line, &
                     log_timings, close_log, log_lines
  use child_process, only: c_text
  use interrupt, only: watch_signals
  use run_state, only: run_t, wall_seconds
  use run_saver, only: saver_t, save_verified, drop_checkpoint
  use start_frame, only: fill_setup, write_start_frame
  use run_start, only: new_saver, claim_files, start_run, saving_words, &
                       restart_lines, check_restart
  use forming_run, only: run_model, save_failed, first_steps
  use shell_offer, only: could_be_shells, shell_lines
  use check_report, only: print_check, print_forecast, source_lines, saving_lines, check_torsion, &
                          print_modes, print_lines
  use run_forecast, only: outlook_t
  use trial_run, only: print_trial_run
  use user_call, only: watch_user_calls, expect_elements, note_log, log_error, at_stop
  use user_library, only: user_library_t
  use user_setup, only: load_user_files
  use process_report, only: process_line, process_lines
  use provenance, only: provenance_lines
  implicit none
  private

  public :: run_deck

  !> A run under way, for `save_open_run`.
  type :: open_run_t
    type(model_t), pointer :: model => null()
    type(run_t), pointer :: run => null()
    type(results_t), pointer :: results => null()
    type(run_log_t), pointer :: log => null()
    type(saver_t), pointer :: saver => null()
  end type open_run_t

contains

  !> Carry out the command; returns the exit code. Nothing is written before the deck
  !! and the model are accepted.
  !! Several processes share the run of a deck; what else a command asks for is up to the first one.
  integer function run_deck(command, ranks) result(code)
    type(command_t), intent(in) :: command
    class(ranks_t), intent(in), optional :: ranks      !! absent: one
    type(scene_t) :: scene
    type(model_t) :: model
    type(user_library_t), allocatable :: library
    type(error_list_t) :: errors
    type(outlook_t) :: outlook
    type(results_setup_t) :: setup
    type(string_t), allocatable :: lines(:)
    type(error_t), allocatable :: error
    real(wp) :: seconds
    logical :: is_for_shells

    ! The number of threads must not change under way: OpenMP may otherwise adapt it.
    call omp_set_dynamic(.false.)
    if (command%n_threads > 0) call omp_set_num_threads(command%n_threads)
    call read_deck(command%deck, command%overrides, scene, errors, is_check=command%is_check)
    if (is_sound(errors, ranks)) call load_in_turn(command, scene, library, errors, ranks)
    if (is_sound(errors, ranks)) call build_model(scene, model, errors, library)
    allocate (lines(0))
    if (is_built(model) .and. command%n_modes == 0 .and. is_first(ranks)) &
      call check_setup(scene, model, errors, lines)   ! takes memory
    if (command%is_check .and. n_errors(errors) == 0) &
      call check_torsion(model, scene%blank%origin, errors)
    code = exit_input
    if (is_failed_elsewhere(n_errors(errors) > 0, ranks)) return
    if (n_errors(errors) > 0 .or. is_first(ranks)) call report_errors(errors, error_unit)
    code = exit_done
    if ((command%is_check .or. command%n_modes > 0) .and. .not. is_first(ranks)) return
    if (command%is_start .and. is_built(model)) then
      call write_start_frame(command, scene, model, error)
      if (allocated(error)) then
        write (error_unit, "(a)") "igaform: "//error%message
        code = exit_files
        return
      end if
    end if
    if (command%is_awake .and. n_errors(errors) == 0) call skip_nothing(model)
    if (n_errors(errors) > 0) then
      code = exit_input
    else if (command%is_check) then
      call cpu_time(outlook%set_up)
      call print_check(model)
      call print_lines(lines)
      if (command%is_trial_run) call print_trial_run(scene, model, outlook, library)
      is_for_shells = could_be_shells(scene, model)
      call print_forecast(model, outlook, may_be_called(library), seconds)
      call print_lines(saving_lines(scene))
      if (is_for_shells) call print_lines(shell_lines(scene, outlook%set_up, seconds))
      call print_lines(source_lines(scene, model))
      if (command%restart /= "") then
        call fill_setup(scene, model, setup)
        call check_restart(command, scene, files_read(command, scene), setup, model, lines, error)
        call print_lines(lines)
      end if
      if (allocated(error)) write (error_unit, "(a)") "igaform: "//error%message
      code = merge(exit_input, exit_done, allocated(error))
    else if (command%n_modes > 0) then
      code = report_modes(model, command%n_modes)
    else if (is_for_one_process(model, ranks)) then
      code = exit_input
      if (is_first(ranks)) write (error_unit, "(a)") "igaform: a law that must run on one "// &
        "thread (THREADSAFE=NO) is up to one process, static steps and frequencies are up to "// &
        "all of them: run this deck with igaform instead of igaform-mpi"
    else
      if (present(ranks)) allocate (model%ranks, source=ranks)
      code = run_accepted(command, scene, model)
    end if
  end function run_deck

  !> Is there no error, at no process?
  logical function is_sound(errors, ranks)
    type(error_list_t), intent(in) :: errors
    class(ranks_t), intent(in), optional :: ranks

    is_sound = n_errors(errors) == 0
    if (present(ranks)) is_sound = ranks%largest(n_errors(errors)) == 0
  end function is_sound

  !> Does one process alone call the law, and would all of them in some step of the deck?
  pure logical function is_for_one_process(model, ranks)
    type(model_t), intent(in) :: model
    class(ranks_t), intent(in), optional :: ranks

    is_for_one_process = .false.
    if (.not. present(ranks)) return
    associate (step => model%step, later => model%later_steps%step)
      is_for_one_process = ranks%n > 1 .and. model%bodies%blank%law%is_serial .and. &
                           (step%is_static .or. any(later%is_static) .or. step%n_modes > 0 .or. &
                            any(later%n_modes > 0))
    end associate
  end function is_for_one_process

  !> The first process compiles the subroutines of a user, the others take what it has made.
  subroutine load_in_turn(command, scene, library, errors, ranks)
    type(command_t), intent(in) :: command
    type(scene_t), intent(inout) :: scene
    type(user_library_t), allocatable, intent(out) :: library
    type(error_list_t), intent(inout) :: errors
    class(ranks_t), intent(in), optional :: ranks

    if (present(ranks)) then
      if (.not. is_first(ranks)) call ranks%wait()
    end if
    call load_user_files(command, scene, library, errors)
    if (present(ranks)) then
      if (is_first(ranks)) call ranks%wait()
    end if
  end subroutine load_in_turn

  !> Does another process report why all of them end? Of those that fail the first one does.
  logical function is_failed_elsewhere(is_failed, ranks) result(is_reported)
    logical, intent(in) :: is_failed                   !! here
    class(ranks_t), intent(in), optional :: ranks
    integer :: first

    is_reported = .false.
    if (.not. present(ranks)) return
    first = ranks%n - ranks%largest(merge(ranks%n - ranks%number, 0, is_failed))
    is_reported = first < ranks%n .and. first /= ranks%number
  end function is_failed_elsewhere

  !> Is the model complete but for effects with errors?
  pure logical function is_built(model)
    type(model_t), intent(in) :: model

    is_built = allocated(model%supports) .and. model%stable_step > 0.0_wp
  end function is_built

  !> Unless subroutines of a user are there that a check has not loaded.
  logical function may_be_called(library)
    type(user_library_t), intent(in), optional :: library

    may_be_called = .true.
    if (present(library)) may_be_called = library%is_loaded
  end function may_be_called

  !> Skip no inactive contact point and no elastic integration point.
  subroutine skip_nothing(model)
    type(model_t), intent(inout), target :: model
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    call model%bodies%blank%law%wake()
    pairs = [contact_pairs(model%forces), contact_pairs(model%later_forces)]
    do i = 1, size(pairs)
      pairs(i)%pair%is_awake = .true.
    end do
  end subroutine skip_nothing

  !> Print the lowest frequencies of an accepted model.
  integer function report_modes(model, n_modes) result(code)
    type(model_t), intent(in) :: model
    integer, intent(in) :: n_modes
    type(error_t), allocatable :: error

    call print_modes(model, n_modes, error)
    code = merge(exit_input, exit_done, allocated(error))
    if (allocated(error)) write (error_unit, "(a)") "igaform: "//error%message
  end function report_modes

  !> Run an accepted model.
  integer function run_accepted(command, scene, model) result(code)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout), target :: model
    type(results_setup_t) :: setup
    type(results_t), target :: results
    type(run_log_t), target :: log
    type(run_t), target :: run
    type(saver_t), target :: saver
    type(open_run_t), target :: open_run
    type(string_t), allocatable :: read_files(:)
    type(lock_t) :: lock
    character(:), allocatable :: log_file, message_file
    type(error_t), allocatable :: error

    ! Before the first file: what exists has then an end that says so.
    call watch_signals(c_funloc(at_stop), waits_for_others=.false.)
    read_files = files_read(command, scene)
    call fill_setup(scene, model, setup)
    setup%provenance%identity = identity_of(command, scene)
    if (is_first(model%ranks)) call result_path(command, read_files, setup%path, error)
    if (allocated(model%ranks)) then
      call share_error(model%ranks, error)
      if (.not. allocated(error)) call model%ranks%share_text(setup%path, 0)
    end if
    if (.not. allocated(error)) then
      call new_saver(command, scene, setup%path, read_files, saver)
      log_file = path_beside_result(setup%path, ".log", read_files)
      message_file = ""
      if (model%bodies%blank%law%needs_context) &
        message_file = path_beside_result(setup%path, message_ending(model), read_files)
      call begin(command, setup, log_file, message_file, saver, model, run, results, lock, error)
    end if
    if (allocated(error)) then
      if (is_first(model%ranks)) write (error_unit, "(a)") "igaform: "//error%message
      code = merge(exit_files, exit_input, run%is_file_lost)
      return
    end if
    run%share_every = command%n_to_rebalance
    if (is_first(model%ranks)) then
      call open_log(log, log_file, command%is_quiet, error, is_going_on=run%is_resumed)
    else
      call mute_log(log)
    end if
    if (allocated(error)) then
      write (error_unit, "(a)") "igaform: warning: "//error%message// &
        "; the run continues without it"
    end if
    call log_start(log, command, scene, model, setup, saver, run)
    open_run = open_run_t(model, run, results, log, saver)
    if (message_file /= "") then
      call open_message_file(message_file, run%is_resumed)
      call note_log(c_text(log_file))
      call expect_elements(int(last_element_number(model%bodies%blank%parts), c_int))
      call watch_user_calls(c_funloc(save_open_run), c_loc(open_run))
    end if
    call run_model(model, run, results, log, saver, error)
    code = merge(exit_numerics, exit_done, allocated(error))
    if (allocated(saver%stopped_by)) code = merge(exit_files, exit_interrupted, &
                                                  saver%is_state_lost)
    if (saver%is_state_lost) call report_error(log, "stopped by "//saver%stopped_by// &
                                            ", and the state cannot be written")
    if (saver%is_state_lost) call report_restart(log, saver)
    if (run%is_file_lost) code = exit_files
    if (allocated(error)) then
      call report_error(log, error%message)
      if (code == exit_files) call report_restart(log, saver)
    end if
    call finish(model, run, results, log, code)
    if (code == exit_done .and. is_first(model%ranks)) call drop_checkpoint(saver, run, log)
    if (code == exit_interrupted) call log_line(log, "continue with --restart "//saver%path)
    call close_log(log)
    call release_lock(lock)
    if (message_file /= "") call close_message_file(message_file)
  end function run_accepted

  !> Of the file for messages of a user's subroutines: each process writes its own.
  pure function message_ending(model) result(ending)
    type(model_t), intent(in) :: model
    character(:), allocatable :: ending

    ending = ".msg"
    if (.not. is_first(model%ranks)) ending = "."//to_text(model%ranks%number)//ending
  end function message_ending

  !> Log what is about to run and what a restart continues.
  subroutine log_start(log, command, scene, model, setup, saver, run)
    type(run_log_t), intent(inout) :: log
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(results_setup_t), intent(in) :: setup
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run

    call log_line(log, provenance_lines(setup%provenance))
    if (allocated(model%ranks)) call log_line(log, process_line(model%ranks, omp_get_max_threads()))
    call log_model(log, model)
    call log_lines(log, source_lines(scene, model))
    call log_line(log, saving_words(saver))
    if (run%is_resumed) call log_lines(log, restart_lines(command, saver, run))
  end subroutine log_start

  !> Claim the files that the run writes and start it; if that fails, no new file is left.
  subroutine begin(command, setup, log_file, message_file, saver, model, run, results, lock, error)
    type(command_t), intent(in) :: command
    type(results_setup_t), intent(inout) :: setup
    character(*), intent(in) :: log_file, message_file
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(out) :: run
    type(results_t), intent(out) :: results
    type(lock_t), intent(out) :: lock
    type(error_t), allocatable, intent(out) :: error
    logical :: is_new

    is_new = .false.
    if (is_first(model%ranks)) then
      is_new = kind_of_file(log_file) == ""
      call claim_files(log_file, message_file, saver, lock, error)
    else if (message_file /= "") then
      call check_message_file(message_file, error)
    end if
    if (allocated(model%ranks)) call share_error(model%ranks, error)
    if (allocated(error)) return
    call start_run(command, setup, saver, model, run, results, error)
    if (.not. allocated(error)) return
    if (is_new) call remove_file(log_file)
    call release_lock(lock)
  end subroutine begin

  !> The results could not be written: the run itself is sound.
  subroutine report_restart(log, saver)
    type(run_log_t), intent(inout) :: log
    type(saver_t), intent(in) :: saver

    if (saver%saved_step >= 0) then
      call report_error(log, "the run stops; when the files can be written, continue with "// &
                     "--restart "//saver%path)
    else
      call report_error(log, "the run stops; no checkpoint was written before (see *CHECKPOINT)")
    end if
  end subroutine report_restart

  !> The program ends inside a user's subroutine: write the state reached as a frame marked failed
  !! and close the files.
  subroutine save_open_run(context, message, length) bind(C)
    type(c_ptr), value :: context        !! of an `open_run_t`
    integer(c_int), value :: length
    character(kind=c_char), intent(in) :: message(length)
    type(open_run_t), pointer :: open_run
    character(:), allocatable :: line, advice
    logical :: is_ready
    integer :: code, i

    call c_f_pointer(context, open_run)
    line = ""
    do i = 1, length
      line = line//message(i)
    end do
    if (allocated(open_run%model%ranks)) then
      ! The others wait for this process, so that nothing can be saved; what was saved last stays.
      call log_error(line)
      call open_run%model%ranks%give_up(exit_numerics)
    end if
    call silence_log(open_run%log)      ! a unit that subroutines know may be locked
    is_ready = is_library_ready()   ! silenced for each thread, and this may be any
    call log_line(open_run%log, "error: "//line)
    code = exit_numerics
    call save_verified(open_run%saver, open_run%model, open_run%run, open_run%results, advice)
    if (advice /= "") call log_line(open_run%log, advice)
    call save_failed(open_run%model, open_run%run, open_run%results)
    call finish(open_run%model, open_run%run, open_run%results, open_run%log, code)
    call close_log(open_run%log)
  end subroutine save_open_run

  !> Close the file with its timings and end the log.
  subroutine finish(model, run, results, log, code)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    integer, intent(inout) :: code
    type(timings_t) :: timings
    type(error_t), allocatable :: error

    timings%timer = model%timer
    timings%n_elements = n_elements_of(model%bodies%blank%parts)
    timings%n_threads = omp_get_max_threads()
    timings%n_steps = run%n_steps
    timings%wall_seconds = wall_seconds(run)
    call close_results(results, status_of(code), timings, error, relaxation_outcome(model%supports))
    if (allocated(error) .and. code /= exit_files) then
      call report_error(log, error%message)
      code = exit_files
    end if
    call log_balance(log, run)
    call log_contact(log, model, run, code == exit_done .or. code == exit_numerics, &
                     unit_in(results, "length"), unit_in(results, "energy"))
    if (relaxation_outcome(model%supports) /= "") then
      call log_line(log, "relaxation "//relaxation_outcome(model%supports))
    end if
    if (allocated(model%ranks)) &
      call log_lines(log, process_lines(model, run%shared_at, timings%wall_seconds))
    call log_timings(log, timings)
  end subroutine finish

  !> Bodies.
  subroutine log_model(log, model)
    type(run_log_t), intent(inout) :: log
    type(model_t), intent(in) :: model

    associate (blank => model%bodies%blank)
      call log_line(log, "blank      "//blank%name//", "// &
                    counted(n_elements_of(blank%parts), "element")//", "// &
                    counted(n_controls_of(blank%parts), "control point")//", mass "// &
                    rounded_text(model%width_ratio*mass_of(blank%parts)))
      if (size(blank%parts) > 1 .or. blank%seams%n_groups > 0) &
        call log_line(log, "patches    "//to_text(size(blank%parts))//", joined in "// &
                      counted(blank%seams%n_groups, "control point"))
      if (joint_words(blank%joints) /= "") &
        call log_line(log, "joints     "//joint_words(blank%joints))
      if (model%width_ratio > 1.0_wp) &
        call log_line(log, "reduction  plane strain: a strip of 1/"// &
                      rounded_text(model%width_ratio)//" of the width; forces, energies and "// &
                      "masses are those of all of it")
      call log_line(log, "kernel     "//blank%parts(1)%element%kernel_name())
    end associate
  end subroutine log_model

  !> How well energy, mass and momentum were kept, with a warning where inertia governs.
  subroutine log_balance(log, run)
    type(run_log_t), intent(inout) :: log
    type(run_t), intent(in) :: run
    real(wp), parameter :: small = 0.1_wp
    real(wp), parameter :: round_off = 1.0e-9_wp   ! of the largest energy

    call log_line(log, "energy     largest balance error "// &
                  rounded_text(100*run%largest_lack/max(run%peak_energy, tiny(1.0_wp)))// &
                  " % of the largest energy of the run, step "//to_text(run%lack_step)// &
                  ", time "//rounded_text(run%lack_time))
    call log_line(log, "energy     largest balance error "// &
                  rounded_text(100*run%largest_error)//" % of the largest energy up to its "// &
                  "time, or of the blank's at the speed of a tool; *ENERGY LIMIT takes this "// &
                  "one, after the first "//to_text(first_steps)//" steps")
    call log_line(log, "momentum   balance error "//rounded_text(run%balance%momentum_error)// &
                  " at the end, relative")
    if (run%balance%kinetic > max(small*run%balance%internal, &
                                  round_off*run%balance%reference)) then
      call log_line(log, "warning: the kinetic energy "//rounded_text(run%balance%kinetic)// &
                    " is not small compared with the internal energy "// &
                    rounded_text(run%balance%internal)//": this is an impact; a forming "// &
                    "process should stay below 10 %")
    end if
  end subroutine log_balance

  subroutine report_error(log, message)
    type(run_log_t), intent(inout) :: log
    character(*), intent(in) :: message

    if (.not. is_muted(log)) write (error_unit, "(a)") "igaform: error: "//message
    call log_line(log, "error: "//message)
  end subroutine report_error

end module deck_run
