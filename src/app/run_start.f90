!> From an accepted model to a run that can begin, or continue from a checkpoint.
module run_start
  use text, only: string_t, to_text, rounded_text, counted, append_text
  use failure, only: error_t, fail
  use timer, only: add_watch
  use build_info, only: version, git_commit
  use scene, only: scene_t
  use model, only: model_t
  use ranks, only: is_first, first_says, share_error
  use state_store, only: state_store_t
  use checkpoint, only: read_checkpoint, draft_t, draw_result, place_result, drop_result, &
                        remove_leftovers, is_replaceable
  use frames, only: layout_problem, keep_edge_distance, results_t, results_setup_t, open_results
  use kinds, only: wp
  use file_lock, only: lock_t, hold_file
  use system_files, only: kind_of_file, is_same_file
  use provenance, only: log_mark
  use text_file, only: why_left_alone
  use output_files, only: check_message_file, path_beside_result, result_path
  use forming_run, only: new_run
  use run_state, only: run_t
  use run_saver, only: saver_t, resume_from, least_steps
  use command_line, only: command_t
  use run_identity, only: build_of_program, key_of_user_files
  implicit none
  private

  public :: new_saver, claim_files, start_run, saving_words, restart_lines, check_restart

contains

  !> When and where the state is saved: as the deck and the command line say, and in any case on
  !! signals and failures.
  subroutine new_saver(command, scene, result_file, read_files, saver)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: result_file
    type(string_t), intent(in) :: read_files(:)     !! that must not be written
    type(saver_t), intent(out) :: saver

    saver%result_file = result_file
    saver%path = path_beside_result(result_file, ".ckpt.h5", read_files)
    saver%header%program = version//" ("//git_commit//")"
    saver%header%build = build_of_program()
    saver%header%is_any_build = command%is_any_build
    saver%header%deck = scene%digest
    saver%header%deck_file = scene%file
    saver%header%user = key_of_user_files(command, scene)
    associate (spec => scene%checkpoints)
      saver%every_steps = spec%n_steps
      saver%every_seconds = 60*spec%minutes
      saver%number = spec%number
      saver%wall_seconds = 60*spec%wall_minutes
      saver%retry = spec%retry
      saver%is_lasting = spec%is_lasting
    end associate
    if (command%wall_minutes > 0) saver%wall_seconds = 60*command%wall_minutes
  end subroutine new_saver

  !> Make sure that log, checkpoint and messages may be written: they are nobody else's, whatever
  !! the result is called. The log stays locked by `lock`; one that did not exist is created. On
  !! failure nothing is left.
  subroutine claim_files(log_file, message_file, saver, lock, error)
    character(*), intent(in) :: log_file
    character(*), intent(in) :: message_file    !! of a user's subroutines; empty: none
    type(saver_t), intent(in) :: saver
    type(lock_t), intent(out) :: lock
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: why

    why = why_left_alone(log_file, log_mark, "log")
    if (.not. is_replaceable(saver%path)) then
      call fail(error, "checkpoint '"//saver%path//"': there is a "//kind_of_file(saver%path)// &
                " of this name that is no checkpoint of igaform; it is left alone")
    else if (why /= "") then
      call fail(error, "log file '"//log_file//"': "//why)
    else if (message_file /= "") then
      call check_message_file(message_file, error)
    end if
    if (allocated(error)) then
      error%message = error%message//"; name another result with --out"
    else if (.not. hold_file(log_file, lock)) then
      call fail(error, "log file '"//log_file//"': another program is using it; choose another "// &
                "name with --out or wait for it")
    end if
  end subroutine claim_files

  !> When the state is saved, for the log.
  function saving_words(saver) result(words)
    type(saver_t), intent(in) :: saver
    character(:), allocatable :: words

    words = ""
    if (saver%every_steps > 0) words = words//", every "// &
      to_text(max(saver%every_steps, least_steps))//" steps"
    if (saver%every_steps > 0 .and. saver%every_steps < least_steps) words = words//" (not "// &
      to_text(saver%every_steps)//": the steps after a state verify it first)"
    if (saver%every_seconds > 0) words = words//", every "// &
      rounded_text(saver%every_seconds/60)//" minutes"
    if (saver%number > 0) words = words//", "//counted(saver%number, "time")
    words = "saves      "//saver%path//": on signals and failures"//words
    if (.not. saver%is_lasting) words = words//"; deleted when the run is complete"
  end function saving_words

  !> Open the results and set the run up. With --restart the state comes from the checkpoint, and
  !! the result file becomes what it was then; nothing is written before all is accepted.
  subroutine start_run(command, setup, saver, model, run, results, error)
    type(command_t), intent(in) :: command
    type(results_setup_t), intent(inout) :: setup    !! of a restart with the fields of its result
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(out) :: run
    type(results_t), intent(out) :: results
    type(error_t), allocatable, intent(out) :: error
    type(draft_t) :: draft
    logical :: is_leading

    call new_run(model, run)
    call add_watch(model%timer, "checkpoint", run%watch_state)
    is_leading = is_first(model%ranks)
    if (command%restart == "") then
      call open_results(results, setup, error, ranks=model%ranks)
      if (.not. allocated(error) .and. is_leading) call remove_leftovers(setup%path, saver%path)
      return
    end if
    call take_up(command, setup, saver, model, run, draft, error)
    if (allocated(error)) return
    if (is_leading) call place_result(draft, error)
    if (allocated(model%ranks)) call share_error(model%ranks, error)
    if (allocated(error)) return
    call open_results(results, setup, error, saver%verified%n_frames, model%ranks)
    run%is_file_lost = allocated(error)   ! what was there before is replaced already
    if (.not. allocated(error) .and. is_leading) call remove_leftovers(setup%path, saver%path)
    if (.not. first_says(model%ranks, is_same_file(command%restart, saver%path))) return
    saver%saved_step = run%n_steps
    saver%saved_deck_step = model%i_step
  end subroutine start_run

  !> Take model and run to the state of the checkpoint of --restart, and its result out of it.
  subroutine take_up(command, setup, saver, model, run, draft, error)
    type(command_t), intent(in) :: command
    type(results_setup_t), intent(inout) :: setup    !! with the fields of that result afterwards
    type(saver_t), intent(inout) :: saver
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(draft_t), intent(out) :: draft              !! none on failure
    type(error_t), allocatable, intent(out) :: error
    type(state_store_t) :: store
    character(:), allocatable :: why
    logical :: is_leading

    is_leading = is_first(model%ranks)
    call read_checkpoint(command%restart, saver%header, store, error, saver%other_build, &
                         saver%changes)
    if (allocated(model%ranks)) call share_error(model%ranks, error)
    if (allocated(error)) return
    why = ""
    if (is_leading) call draw_result(command%restart, setup%path, draft, error)
    if (is_leading .and. .not. allocated(error)) then
      call keep_edge_distance(draft%path, setup)
      why = layout_problem(draft%path, setup)
    end if
    if (allocated(model%ranks)) then
      call share_error(model%ranks, error)
      call model%ranks%share_text(why, 0)
    end if
    if (allocated(error)) return
    if (why /= "") then
      why = "its result cannot be continued: "//why
    else
      call resume_from(saver, model, run, store)
      why = state_problem(store, run)
    end if
    if (why == "") return
    if (is_leading) call drop_result(draft)
    call fail(error, "checkpoint '"//command%restart//"' rejected: "//why)
  end subroutine take_up

  !> Does the checkpoint of --restart fit the deck? For `--check`: its result is drawn as by a run,
  !! and nothing is left of it; the model is of no use afterwards.
  subroutine check_restart(command, scene, read_files, setup, model, lines, error)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(string_t), intent(in) :: read_files(:)            !! that must not be written
    type(results_setup_t), intent(inout) :: setup          !! all but its path
    type(model_t), intent(inout) :: model
    type(string_t), allocatable, intent(out) :: lines(:)   !! what of it is told
    type(error_t), allocatable, intent(out) :: error
    type(saver_t) :: saver
    type(run_t) :: run
    type(draft_t) :: draft

    allocate (lines(0))
    call result_path(command, read_files, setup%path, error)
    if (allocated(error)) return
    call new_saver(command, scene, setup%path, read_files, saver)
    call new_run(model, run)
    call take_up(command, setup, saver, model, run, draft, error)
    if (allocated(error)) return
    call drop_result(draft)
    lines = restart_lines(command, saver, run)
  end subroutine check_restart

  !> What a run that is taken up again continues, and what differs from the run that wrote the
  !! checkpoint.
  function restart_lines(command, saver, run) result(lines)
    type(command_t), intent(in) :: command
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run
    type(string_t), allocatable :: lines(:)
    character(*), parameter :: head = "restart    "
    integer, parameter :: most = 20            ! changes that are named
    integer :: i

    allocate (lines(0))
    call append_text(lines, head//"from "//command%restart//", step "//to_text(run%n_steps)// &
                     ", time "//rounded_text(run%instant%time))
    if (saver%other_build /= "") call append_text(lines, head//"of a run that another build "// &
                                                  "began: "//saver%other_build)
    do i = 1, min(size(saver%changes), most)
      call append_text(lines, head//saver%changes(i)%value)
    end do
    if (size(saver%changes) > most) call append_text(lines, head//"and "// &
      counted(size(saver%changes) - most, "other change")//" of later steps")
  end function restart_lines

  !> Why the state that was taken from a checkpoint cannot be continued; empty if it can.
  function state_problem(store, run) result(why)
    type(state_store_t), intent(in) :: store
    type(run_t), intent(in) :: run
    character(:), allocatable :: why

    why = ""
    if (store%reason /= "") then
      why = "its state does not fit this deck: "//store%reason
    else if (run%instant%time > run%control%end_time*(1 + 1.0e-12_wp)) then
      why = "it is of time "//to_text(run%instant%time)//", which is later than the end time "// &
            to_text(run%control%end_time)
    end if
  end function state_problem

end module run_start
