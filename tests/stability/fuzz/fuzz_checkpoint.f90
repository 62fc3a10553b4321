!> Takes up a run from checkpoints, path by path from the standard input, for fuzz.py.
!!
!!     fuzz_checkpoint DECK           reads
!!     fuzz_checkpoint DECK PATH      writes a sound one of some steps of the deck
program fuzz_checkpoint
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, n_errors
  use text, only: string_t
  use scene, only: scene_t
  use state_store, only: state_store_t
  use deck_reader, only: read_deck
  use model, only: model_t
  use model_setup, only: build_model
  use checkpoint, only: checkpoint_header_t, write_checkpoint, read_checkpoint, &
                        draft_t, draw_result, place_result
  use run_state, only: run_t
  use run_saver, only: saver_t, pack_for_file, resume_from
  use forming_run, only: new_run, take_step
  use fuzz_talk, only: argument, next_path, answer_with
  implicit none

  type(checkpoint_header_t) :: header
  type(model_t) :: model
  type(run_t) :: run
  type(saver_t) :: saver

  header%program = "any"
  header%build = "any"
  header%deck = "0000000000000000 1 any"
  header%deck_file = argument(1)
  header%user = ""
  call set_up()
  if (command_argument_count() > 1) then
    call write_one(argument(2))
  else
    call read_all()
  end if

contains

  subroutine read_all()
    character(:), allocatable :: path

    do
      call next_path(path)
      if (.not. allocated(path)) exit
      call read_one(path)
    end do
  end subroutine read_all

  subroutine set_up()
    type(scene_t) :: scene
    type(error_list_t) :: errors
    type(string_t) :: overrides(0)

    call read_deck(header%deck_file, overrides, scene, errors)
    if (n_errors(errors) == 0) call build_model(scene, model, errors)
    if (n_errors(errors) > 0) error stop "the deck is invalid"
    call new_run(model, run)
  end subroutine set_up

  !> The deck stands for the result file.
  subroutine write_one(path)
    character(*), intent(in) :: path
    type(state_store_t) :: store
    type(error_t), allocatable :: error
    real(wp) :: rate, dt
    integer :: i, n_frames

    rate = model%rate
    dt = 0.0_wp
    do i = 1, 200
      call take_step(model, run, rate, dt, error)
      if (allocated(error)) error stop "the run failed"
    end do
    n_frames = 0
    call pack_for_file(model, run, n_frames, store)
    call write_checkpoint(path, header, store, header%deck_file, error)
    if (allocated(error)) error stop "no checkpoint written"
  end subroutine write_one

  subroutine read_one(path)
    character(*), intent(in) :: path
    type(state_store_t) :: store
    type(draft_t) :: draft
    type(error_t), allocatable :: error
    character(:), allocatable :: answer

    call read_checkpoint(path, header, store, error)
    if (allocated(error)) then
      answer = error%message
    else
      call resume_from(saver, model, run, store)
      answer = "taken up"
      if (store%reason /= "") then
        answer = store%reason
      else
        call go_on()
      end if
      call draw_result(path, path//".result", draft, error)
      if (.not. allocated(error)) call place_result(draft, error)
      if (allocated(error)) answer = error%message
    end if
    call answer_with(answer)
  end subroutine read_one

  !> A step from where the checkpoint has led, wherever that is.
  subroutine go_on()
    type(error_t), allocatable :: error
    real(wp) :: rate, dt

    rate = model%bodies%blank%report%largest_rate
    dt = run%instant%dt
    call take_step(model, run, rate, dt, error)
  end subroutine go_on

end program fuzz_checkpoint
