!> Signals that ask a run to save its state or to stop.
!!
!! A handler may do next to nothing: it sets a flag, and the run looks at it between two steps. The
!! same signal a second time ends the program at once, as if nobody watched.
module interrupt
  use, intrinsic :: iso_c_binding, only: c_associated, c_funloc, c_funptr, c_int, c_intptr_t, &
                                         c_null_funptr
  implicit none
  private

  public :: watch_signals, is_stop_wanted, is_save_wanted, forget_save, stop_signal_name

  integer(c_int), parameter :: hang_up = 1, terminal = 2, user_one = 10, terminate = 15, &
                               file_too_large = 25   ! of Linux

  integer(c_int), volatile :: stop_signal = 0_c_int
  integer(c_int), volatile :: save_signal = 0_c_int

  interface
    type(c_funptr) function c_signal(number, handler) bind(C, name="signal")
      import :: c_funptr, c_int
      integer(c_int), value :: number
      type(c_funptr), value :: handler
    end function c_signal
  end interface

contains

  !> Take note of SIGINT, SIGTERM and SIGHUP (stop) and SIGUSR1 (save) from now on. What is ignored,
  !! as behind `nohup`, stays ignored. A limit on the size of files is from now on an error of the
  !! write that meets it, as a full disk is, and not the end of the program.
  subroutine watch_signals()
    type(c_funptr) :: before

    call watch(terminal)
    call watch(terminate)
    call watch(hang_up)
    call watch(user_one)
    before = c_signal(file_too_large, transfer(1_c_intptr_t, c_null_funptr))   ! SIG_IGN
  end subroutine watch_signals

  !> Has a signal asked for the end?
  logical function is_stop_wanted()
    is_stop_wanted = stop_signal /= 0
  end function is_stop_wanted

  !> Has a signal asked to save the state and to go on?
  logical function is_save_wanted()
    is_save_wanted = save_signal /= 0
  end function is_save_wanted

  !> The state is saved.
  subroutine forget_save()
    save_signal = 0_c_int
  end subroutine forget_save

  !> Name of the signal that asks for the end; empty if none does.
  function stop_signal_name() result(name)
    character(:), allocatable :: name

    select case (stop_signal)
    case (0)
      name = ""
    case (terminal)
      name = "SIGINT"
    case (terminate)
      name = "SIGTERM"
    case default
      name = "SIGHUP"
    end select
  end function stop_signal_name

  subroutine watch(number)
    integer(c_int), intent(in) :: number
    type(c_funptr) :: before

    before = c_signal(number, c_funloc(take_note))
    if (is_ignoring(before)) before = c_signal(number, before)
  end subroutine watch

  !> SIG_IGN is the address 1.
  pure logical function is_ignoring(handler)
    type(c_funptr), intent(in) :: handler

    is_ignoring = .false.
    if (c_associated(handler)) is_ignoring = transfer(handler, 0_c_intptr_t) == 1_c_intptr_t
  end function is_ignoring

  !> The handler.
  subroutine take_note(number) bind(C)
    integer(c_int), value :: number
    type(c_funptr) :: ignored

    if (number == user_one) then
      save_signal = number
    else
      stop_signal = number
      ignored = c_signal(number, c_null_funptr)   ! SIG_DFL
    end if
  end subroutine take_note

end module interrupt
