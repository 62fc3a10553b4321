!> Processes of their own for what calls a user's subroutine: wherever it ends the program, only
!! the copy ends.
module test_process
  use text, only: to_text
  use material_point, only: stop_words
  use child_process, only: fork_process, has_ended, send_signal, stop_signal, insist_on_end, &
                           pause_briefly, end_with_parent
  use interrupt, only: is_stop_wanted, is_end_wanted
  use user_call, only: forget_thread
  use exit_codes, only: exit_interrupted, exit_files
  implicit none
  private

  public :: begin_copy, wait_for_end, end_words

contains

  !> A copy of this process with nothing left to write: 0 in the copy, its number in this one,
  !! below zero if there is none.
  integer function begin_copy() result(process)
    call flush_units()    ! else both processes would write what waits there
    process = fork_process()
    if (process /= 0) return
    call end_with_parent()
    call forget_thread()
  end function begin_copy

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
        call send_signal(process, stop_signal)
      end if
      call pause_briefly()
    end do
  end subroutine wait_for_end

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
  end function end_words

  !> Write what waits in the units that are open.
  subroutine flush_units()
    integer, parameter :: last = 200   ! NEWUNIT gives negative numbers, which are not searched
    integer :: unit
    logical :: is_open

    do unit = 0, last
      inquire (unit=unit, opened=is_open)
      if (is_open) flush (unit)
    end do
  end subroutine flush_units

end module test_process
