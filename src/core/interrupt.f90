!> Signals that ask a run to save its state or to stop.
!!
!! A handler may do next to nothing: it sets a flag, and the run looks at it between two steps. A
!! signal that asks for the end again two seconds later or more ends the program at once, as if
!! nobody watched, unless the program waits for others and ends them itself; within that time it may
!! be the same wish that comes by two ways, to a group of programs and from the one that started
!! them.
module interrupt
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_procpointer, c_funloc, &
                                         c_funptr, c_int, c_int64_t, c_intptr_t, c_long, &
                                         c_null_funptr, c_null_ptr, c_ptr, c_size_t
  use c_library, only: c_exit_now, c_raise, c_signal, c_write
  implicit none
  private

  public :: watch_saves, hold_saves, end_on_signals, watch_signals
  public :: is_stop_wanted, is_end_wanted, is_save_wanted, forget_save, stop_signal_name

  integer(c_int), parameter :: hang_up = 1, terminal = 2, user_one = 10, terminate = 15, &
                               file_too_large = 25   ! of Linux
  integer(c_intptr_t), parameter :: sig_ign = 1_c_intptr_t   ! the handler SIG_IGN
  integer(c_int), parameter :: block = 0, unblock = 1   ! SIG_BLOCK, SIG_UNBLOCK

  integer(c_int), volatile :: stop_signal = 0_c_int
  integer(c_int), volatile :: save_signal = 0_c_int
  integer(c_long), volatile :: stop_time = 0_c_long   ! of the first wish [s]
  logical, volatile :: is_repeated = .false.          ! that wish came again
  logical, volatile :: is_patient = .false.           ! the program does not end at once then
  type(c_funptr), volatile :: at_stop = c_null_funptr
  integer(c_int), volatile :: end_code = 0_c_int      ! of a program that ends at once; 0: else
  character(*, kind=c_char), parameter :: last_words = &
    "igaform: stopped by a signal before anything was begun"//new_line("a")

  abstract interface
    !> What is to be done when a signal asks for the end: with what a handler may do.
    subroutine stop_procedure(is_again) bind(C)
      import :: c_int
      integer(c_int), value :: is_again   !! 0 for the first wish; 1: it came again
    end subroutine stop_procedure
  end interface

  interface
    integer(c_int) function c_empty_set(signals) bind(C, name="sigemptyset")
      import :: c_int, c_int64_t
      integer(c_int64_t), intent(out) :: signals(*)
    end function c_empty_set

    integer(c_int) function c_add_to_set(signals, number) bind(C, name="sigaddset")
      import :: c_int, c_int64_t
      integer(c_int64_t), intent(inout) :: signals(*)
      integer(c_int), value :: number
    end function c_add_to_set

    integer(c_int) function c_mask(action, signals, before) bind(C, name="sigprocmask")
      import :: c_int, c_int64_t, c_ptr
      integer(c_int), value :: action
      integer(c_int64_t), intent(in) :: signals(*)
      type(c_ptr), value :: before
    end function c_mask

    integer(c_long) function c_time(place) bind(C, name="time")
      import :: c_long, c_ptr
      type(c_ptr), value :: place
    end function c_time
  end interface

contains

  !> Take note of SIGUSR1 (save) from now on: for the start of the program, since it would end it
  !! else while the deck is read.
  subroutine watch_saves()
    type(c_funptr) :: before

    before = c_signal(user_one, c_funloc(take_note))
    call mask_saves(unblock)
  end subroutine watch_saves

  !> Let SIGUSR1 wait up to `watch_saves`. In a program started meanwhile it waits too, and so does
  !! not end it before it watches.
  subroutine hold_saves()
    call mask_saves(block)
  end subroutine hold_saves

  subroutine mask_saves(action)
    integer(c_int), intent(in) :: action
    integer(c_int64_t) :: signals(16)      ! 1024 bits, the type that C hides
    integer(c_int) :: failed

    failed = c_empty_set(signals)
    failed = c_add_to_set(signals, user_one)
    failed = c_mask(action, signals, c_null_ptr)
  end subroutine mask_saves

  !> End the program at once, with this exit code and a line that says so, on SIGINT, SIGTERM and
  !! SIGHUP, up to `watch_signals`: for as long as there is nothing to be saved or waited for. A
  !! read that blocks does not look at flags.
  subroutine end_on_signals(code)
    integer, intent(in) :: code          !! not 0

    end_code = int(code, c_int)
    call watch_all()
  end subroutine end_on_signals

  !> Take note of SIGINT, SIGTERM and SIGHUP (stop) from now on. What is ignored, as behind
  !! `nohup`, stays ignored. A limit on the size of files is from now on an error of the
  !! write that meets it, as a full disk is, and not the end of the program.
  subroutine watch_signals(action, waits_for_others)
    type(c_funptr), value :: action           !! a `stop_procedure`, or null
    logical, intent(in) :: waits_for_others   !! a wish that comes again does not end the program,
                                              !! which looks at `is_end_wanted`
    type(c_funptr) :: before

    end_code = 0_c_int
    at_stop = action
    is_patient = waits_for_others
    call watch_all()
    before = c_signal(file_too_large, transfer(sig_ign, c_null_funptr))
  end subroutine watch_signals

  !> Has a signal asked for the end?
  logical function is_stop_wanted()
    is_stop_wanted = stop_signal /= 0
  end function is_stop_wanted

  !> Has one asked for it again, two seconds later or more?
  logical function is_end_wanted()
    is_end_wanted = is_repeated
  end function is_end_wanted

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

  subroutine watch_all()
    integer(c_int), parameter :: numbers(3) = [terminal, terminate, hang_up]
    type(c_funptr) :: before
    integer :: i

    do i = 1, size(numbers)
      before = c_signal(numbers(i), c_funloc(take_note))
      if (transfer(before, 0_c_intptr_t) == sig_ign) before = c_signal(numbers(i), before)
    end do
  end subroutine watch_all

  subroutine take_note(number) bind(C)
    integer(c_int), value :: number
    integer(c_long), parameter :: same_wish = 2_c_long
    type(c_funptr) :: before
    integer(c_int) :: failed
    integer(c_size_t) :: ignored

    if (number == user_one) then
      save_signal = number
    else if (end_code /= 0) then
      ignored = c_write(2_c_int, last_words, len(last_words, c_size_t))
      call c_exit_now(end_code)
    else if (stop_signal == 0) then
      stop_time = c_time(c_null_ptr)
      stop_signal = number
      call act(0_c_int)
    else if (c_time(c_null_ptr) - stop_time >= same_wish) then
      is_repeated = .true.
      call act(1_c_int)
      if (is_patient) return
      before = c_signal(number, c_null_funptr)   ! SIG_DFL
      failed = c_raise(number)
    end if
  end subroutine take_note

  subroutine act(is_again)
    integer(c_int), intent(in) :: is_again
    procedure(stop_procedure), pointer :: action
    type(c_funptr) :: place

    place = at_stop
    if (.not. c_associated(place)) return
    call c_f_procpointer(place, action)
    call action(is_again)
  end subroutine act

end module interrupt
