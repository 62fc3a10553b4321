!> Tests of the laws of users, carried out by a process of their own: where the user's code ends the
!! program, whatever the way, the rows up to there are kept and the next test is begun.
module isolated_tests
  use, intrinsic :: iso_c_binding, only: c_funloc
  use scene, only: material_test_spec_t
  use block_law, only: block_law_t
  use child_process, only: fork_process, has_ended, ask_to_stop, insist_on_end, pause_briefly, &
                           end_with_parent, end_process
  use interrupt, only: watch_signals, is_stop_wanted, is_end_wanted
  use material_test, only: fill_rows, stop_words
  use message_files, only: open_message_file, close_message_file
  use shared_rows, only: shared_rows_t, begin_rows, end_rows, is_begun, is_ended
  use exit_codes, only: exit_files, exit_interrupted
  use text, only: to_text
  use user_call, only: forget_thread, at_stop
  implicit none
  private

  public :: law_slot_t, perform_tests

  !> The law of a test.
  type :: law_slot_t
    class(block_law_t), allocatable :: law
  end type law_slot_t

contains

  !> Carry out all tests, one after the other, until a signal says stop.
  subroutine perform_tests(tests, slots, rows, messages, is_refused)
    type(material_test_spec_t), intent(in) :: tests(:)
    type(law_slot_t), intent(in) :: slots(:)            !! for each test
    type(shared_rows_t), intent(inout) :: rows(:)       !! for each test, with room for it
    character(*), intent(in) :: messages                !! path of the file for unit 7, or empty
    logical, intent(out) :: is_refused                  !! memory, to one of the processes
    logical :: is_going_on
    integer :: i, process, code

    is_refused = .false.
    is_going_on = .false.
    i = 1
    do while (i <= size(tests) .and. .not. is_stop_wanted())
      process = -1
      call begin_rows(rows(i))
      if (slots(i)%law%needs_context) then
        call flush_units()    ! else both processes would write what waits there
        process = fork_process()
      end if
      if (process < 0) then
        call fill_rows(tests(i), slots(i)%law, rows(i))
      else if (process == 0) then
        call open_message_file(messages, is_going_on)
        call go_on(tests(i:), slots(i:), rows(i:))
      else
        call wait_for_end(process, code)
        ! Looked at from here, for this process knows nothing of what the other one wrote.
        call open_message_file(messages, is_going_on=.true.)
        call close_message_file(messages)
        is_going_on = .true.
        do while (is_ended(rows(i)))
          i = i + 1
          if (i > size(tests)) return
        end do
        if (is_stop_wanted() .and. .not. is_begun(rows(i))) return
        is_refused = is_refused .or. code == exit_files
        call end_rows(rows(i), end_words(code), "")
      end if
      i = i + 1
    end do
  end subroutine perform_tests

  !> Wait for the end of the other process, which is asked to stop where a signal says so.
  subroutine wait_for_end(process, code)
    integer, intent(in) :: process
    integer, intent(out) :: code
    logical :: is_asked
    integer :: n_asked

    is_asked = .false.
    n_asked = 0
    do while (.not. has_ended(process, code))
      if (is_end_wanted()) then
        call insist_on_end(process, n_asked)
      else if (is_stop_wanted() .and. .not. is_asked) then
        is_asked = .true.
        call ask_to_stop(process)
      end if
      call pause_briefly()
    end do
  end subroutine wait_for_end

  !> In the other process: these tests, with what the subroutines keep from one to the next.
  subroutine go_on(tests, slots, rows)
    type(material_test_spec_t), intent(in) :: tests(:)
    type(law_slot_t), intent(in) :: slots(:)
    type(shared_rows_t), intent(inout) :: rows(:)
    integer :: i

    call end_with_parent()
    call forget_thread()
    call watch_signals(c_funloc(at_stop), waits_for_others=.false.)
    do i = 1, size(tests)
      if (is_stop_wanted() .and. i > 1) exit
      call fill_rows(tests(i), slots(i)%law, rows(i))
    end do
    call end_process()
  end subroutine go_on

  !> How a test ended that has not reported its end.
  function end_words(code) result(words)
    integer, intent(in) :: code    !! exit code, or 128 and the number of the signal
    character(:), allocatable :: words

    if (is_stop_wanted() .and. (code >= 128 .or. code == exit_interrupted)) then
      words = stop_words//" inside the user's subroutine"
    else if (code >= 128) then
      words = "the user's subroutine was ended by signal "//to_text(code - 128)
    else if (code == exit_files) then
      words = "the system refused memory (see above)"
    else
      words = "the user's subroutine ended it (reported above)"
    end if
    words = words//"; the rows up to there are kept"
  end function end_words

  !> Write what waits in the units that are open.
  subroutine flush_units()
    integer, parameter :: last = 200   ! those from NEWUNIT have no numbers that can be asked for
    integer :: unit
    logical :: is_open

    do unit = 0, last
      inquire (unit=unit, opened=is_open)
      if (is_open) flush (unit)
    end do
  end subroutine flush_units

end module isolated_tests
