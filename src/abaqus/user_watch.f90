!> Watch over the calls of subroutines of users: how a run ends from inside one, with which message.
!!
!! The calls carry no argument that says where they come from, so this module remembers it: the
!! routine, element and point in hand for each thread, and what is to be saved when the run ends.
!!
!! A run may end inside a statement for input or output, whose unit is then locked for ever, or
!! with a heap that was written over. So no unit that a subroutine may know is touched on the way
!! out, and nothing but `write` and `_exit` is called where a crash is reported.
module user_watch
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_funloc, c_funptr, c_int, &
                                         c_int64_t, c_loc, c_null_funptr, c_null_ptr, c_ptr, &
                                         c_associated, c_f_procpointer
  use c_library, only: c_exit, c_exit_now, c_raise, c_signal
  use crash_handler, only: signal_stack_t, catch_crashes, give_signal_stack, is_out_of_stack, &
                         message_t, add_text, add_number, send, open_for_lines
  implicit none
  private

  public :: enter_user_call, leave_user_call, watch_user_calls, expect_elements, forget_thread
  public :: note_failure, take_failure, note_log, log_error, at_stop
  public :: end_run, end_by_overrun, end_by_problem
  public :: offer_values, values_on_offer

  integer, parameter, public :: exit_by_user = 2   !! exit code of a run that a subroutine ends
  integer, parameter, public :: exit_by_signal = 3 !! of one that a signal ends inside of one
  integer, parameter :: longest = 400
  integer(c_int), parameter :: abort_signal = 6_c_int, bus_error = 7_c_int, &
                               segment_fault = 11_c_int, alarm_signal = 14_c_int
  integer(c_int), parameter :: standard_error = 2_c_int

  !> The routines by the numbers that `enter_user_call` takes.
  character(11), parameter :: routine_names(8) = [character(11) :: "UMAT", "VUMAT", "SDVINI", &
    "UEXTERNALDB", "VEXTERNALDB", "USDFLD", "VUSDFLD", "UVARM"]

  abstract interface
    !> What is to be done before the program ends, such as saving the state. It must not use a unit
    !! that subroutines of users may use, such as 6.
    subroutine farewell_procedure(context, message, length) bind(C)
      import :: c_char, c_int, c_ptr
      type(c_ptr), value :: context   !! as given to `watch_user_calls`
      integer(c_int), value :: length
      character(kind=c_char), intent(in) :: message(length)
    end subroutine farewell_procedure
  end interface

  interface
    integer(c_int) function c_atexit(action) bind(C, name="atexit")
      import :: c_int, c_funptr
      type(c_funptr), value :: action
    end function c_atexit

    integer(c_int) function c_signal_mask(how, signals, before) bind(C, name="pthread_sigmask")
      import :: c_int, c_int64_t, c_ptr
      integer(c_int), value :: how
      integer(c_int64_t), intent(in) :: signals(*)
      type(c_ptr), value :: before
    end function c_signal_mask

    integer(c_int) function c_alarm(seconds) bind(C, name="alarm")
      import :: c_int
      integer(c_int), value :: seconds
    end function c_alarm

    integer(c_int) function c_thread() bind(C, name="gettid")
      import :: c_int
    end function c_thread

    integer(c_int) function c_pause() bind(C, name="pause")
      import :: c_int
    end function c_pause

    subroutine c_backtrace() bind(C, name="_gfortran_backtrace")
    end subroutine c_backtrace
  end interface

  !> A call: routine 0 for none, element -1 for one before the first increment. That of a VUMAT is
  !! for several elements, up to `last`.
  type :: call_t
    integer(c_int) :: routine = 0, element = 0, point = 0, last = 0
  end type call_t

  !> What is known of a thread. It lies neither on the thread's stack nor next to it, where a
  !! subroutine that writes past its arrays would write it over.
  type :: record_t
    integer(c_int) :: thread = 0              ! its number for the system
    type(call_t) :: latest                    ! begun last
    logical :: is_inside = .false.            ! it has not returned
    integer(c_int64_t) :: n_calls = 0         ! begun up to now
    integer(c_int64_t) :: n_calls_at_stop = -1   ! when a signal asked for the end
    logical :: is_leaver = .false.            ! it ends the run
    type(signal_stack_t) :: signal_stack
    type(c_ptr) :: values = c_null_ptr        ! stress and state of the points of the call, or none
    integer(c_int) :: n_points = 0, n_states = 0
    integer(c_int64_t) :: padding(16) = 0     ! records of two threads share no line of the cache
  end type record_t

  integer, parameter :: most_threads = 1024   ! those beyond share the record 0
  type(record_t), target :: records(0:most_threads)
  integer :: n_records = 0
  integer :: slot = -1                        ! of the record of this thread, for a quick start
  !$omp threadprivate(slot)
  type(c_funptr) :: farewell = c_null_funptr
  type(c_ptr) :: farewell_context = c_null_ptr
  integer :: n_leaving = 0                    ! threads that want to end the run
  integer(c_int) :: n_elements = huge(0_c_int)
  integer(c_int) :: failure(3) = 0            ! element, point and reason
  integer(c_int) :: log_descriptor = -1       ! of the log of the run, if there is one

contains

  !> A call of a subroutine of the user begins. A number that no element has shows that memory was
  !! written over; that ends the run.
  subroutine enter_user_call(routine, noel, npt, last) bind(C, name="igaform_enter_user_call")
    integer(c_int), value :: routine     !! its place in `routine_names`
    integer(c_int), value :: noel, npt   !! -1: before the run, for no point
    integer(c_int), value :: last        !! element up to which the call is; of a UMAT `noel`

    if (slot < 0) call open_record()
    if (noel < -1 .or. noel > n_elements) call end_by_number(noel)
    records(slot)%latest = call_t(routine, noel, npt, last)
    records(slot)%is_inside = .true.
    records(slot)%n_calls = records(slot)%n_calls + 1
  end subroutine enter_user_call

  !> A call is to begin for an element that does not exist.
  subroutine end_by_number(noel)
    integer(c_int), intent(in) :: noel
    type(message_t) :: message

    call add_text(message, "memory was written over: there is no element ")
    call add_number(message, int(noel))
    call add_latest(message, records(slot))
    call end_at_once(message, exit_by_user)
  end subroutine end_by_number

  !> The calls of this thread are done.
  subroutine leave_user_call() bind(C, name="igaform_leave_user_call")
    if (slot >= 0) records(slot)%is_inside = .false.
  end subroutine leave_user_call

  !> The call that begins next in this thread may ask for these, for GETVRM and VGETVRM carry no
  !! argument that says for which points: stress (11, 22, 33, 12, 13, 23) and state variables, all
  !! points one after the other for each. No points: it may ask for nothing.
  subroutine offer_values(values, n_points, n_states) bind(C, name="igaform_offer_values")
    real(c_double), intent(in), target :: values(*)
    integer(c_int), value :: n_points, n_states

    if (slot < 0) call open_record()
    records(slot)%values = c_loc(values)
    records(slot)%n_points = n_points
    records(slot)%n_states = n_states
  end subroutine offer_values

  !> What the call in hand may ask for; no points if that is nothing.
  subroutine values_on_offer(values, n_points, n_states)
    type(c_ptr), intent(out) :: values
    integer(c_int), intent(out) :: n_points, n_states

    associate (own => records(max(slot, 0)))
      values = own%values
      ! A thread that the subroutine has started itself has no record.
      n_points = merge(own%n_points, 0_c_int, own%is_inside .and. slot >= 0)
      n_states = own%n_states
    end associate
  end subroutine values_on_offer

  !> A record and a stack for signals for this thread.
  subroutine open_record()
    integer :: place

    !$omp atomic capture
    n_records = n_records + 1
    place = n_records
    !$omp end atomic
    slot = merge(place, 0, place <= most_threads)
    records(slot)%thread = c_thread()
    call give_signal_stack(records(slot)%signal_stack)
  end subroutine open_record

  !> In a copy of the process: its thread has another number for the system, so it takes another
  !! record.
  subroutine forget_thread() bind(C, name="igaform_forget_thread")
    slot = -1
  end subroutine forget_thread

  !> Number in `records` of the calling thread; 0 if it never called a subroutine of the user.
  integer function own_slot()
    integer(c_int) :: thread

    thread = c_thread()
    do own_slot = min(n_records, most_threads), 1, -1
      if (records(own_slot)%thread == thread) return
    end do
  end function own_slot

  !> The log of the run, for the words at a crash, when its unit is not to be touched.
  subroutine note_log(path) bind(C, name="igaform_note_log")
    character(kind=c_char), intent(in) :: path(*)   !! with the zero at its end

    log_descriptor = open_for_lines(path)
  end subroutine note_log

  !> From now on elements have the numbers 1 to n.
  subroutine expect_elements(n) bind(C, name="igaform_expect_elements")
    integer(c_int), value :: n

    n_elements = n
  end subroutine expect_elements

  !> The call in hand wrote past the end of an argument: the run ends, for what was there is lost.
  subroutine end_by_overrun(name, length) bind(C, name="igaform_end_by_overrun")
    integer(c_int), value :: length
    character(kind=c_char), intent(in) :: name(length)   !! of the argument
    type(message_t) :: message

    associate (current => records(own_slot())%latest)
      call add_user(message, current)
      call add_text(message, " wrote past the end of ")
      call add_characters(message, name)
      call add_place(message, current)
    end associate
    call end_at_once(message, exit_by_user)
  end subroutine end_by_overrun

  !> The call in hand did what no result can be had from: report, save, end.
  subroutine end_by_problem(deed, length) bind(C, name="igaform_end_by_fault")
    integer(c_int), value :: length
    character(kind=c_char), intent(in) :: deed(length)   !! such as "returns ..."
    type(message_t) :: message

    call become_leaver()
    associate (current => records(own_slot())%latest)
      call add_user(message, current)
      call add_place(message, current)
    end associate
    call add_text(message, " ")
    call add_characters(message, deed)
    call save_and_exit(message)
  end subroutine end_by_problem

  !> A stress update of the user's subroutine failed; that of the lowest element is kept.
  subroutine note_failure(noel, npt, reason) bind(C, name="igaform_note_user_failure")
    integer(c_int), value :: noel, npt
    integer(c_int), value :: reason   !! 1: not finite, 2: PNEWDT stays below one

    !$omp critical (igaform_failure)
    if (failure(1) == 0 .or. noel < failure(1)) failure = [noel, npt, reason]
    !$omp end critical (igaform_failure)
  end subroutine note_failure

  !> Element, point and reason of the failure that was kept, which is then forgotten, for a run may
  !! try again; zeros if there was none.
  subroutine take_failure(values) bind(C, name="igaform_take_user_failure")
    integer(c_int), intent(out) :: values(3)

    values = failure
    failure = 0
  end subroutine take_failure

  !> Watch over the calls from now on: an end of the program or a crash inside one is reported with
  !! element and point, and `action` (may be null) is carried out before. To be called again with
  !! the action once there is something to save, so that it runs before the libraries close down.
  subroutine watch_user_calls(action, context) bind(C, name="igaform_watch_user_calls")
    type(c_funptr), value :: action
    type(c_ptr), value :: context   !! what the action is to work on
    integer(c_int), parameter :: crashes(5) = [4_c_int, abort_signal, bus_error, 8_c_int, &
                                               segment_fault]
    integer(c_int) :: status

    farewell = action
    farewell_context = context
    status = c_atexit(c_funloc(at_exit))
    call catch_crashes(crashes, c_funloc(at_crash))
  end subroutine watch_user_calls

  !> A signal asks for the end of the run, which waits for the calls in hand. A call that has not
  !! returned a second later is reported, and ends the run where a signal asks again. In a handler.
  subroutine at_stop(is_again) bind(C, name="igaform_at_stop")
    integer(c_int), value :: is_again
    integer(c_int), parameter :: patience = 1_c_int   ! [s]
    type(message_t) :: message
    type(c_funptr) :: before
    integer(c_int) :: ignored
    integer :: i

    if (n_leaving > 0) return
    if (is_again == 0) then
      do i = 0, min(n_records, most_threads)
        records(i)%n_calls_at_stop = records(i)%n_calls
      end do
      before = c_signal(alarm_signal, c_funloc(report_waiting))
      ignored = c_alarm(patience)
      return
    end if
    i = place_of_stuck()
    if (i < 0) return
    call add_text(message, "ended by a second signal while ")
    call add_user(message, records(i)%latest)
    call add_text(message, " had not returned")
    call add_place(message, records(i)%latest)
    call end_at_once(message, exit_by_signal)
  end subroutine at_stop

  !> The run waits for a call that had begun before the signal.
  subroutine report_waiting() bind(C)
    type(message_t) :: message
    integer :: i

    i = place_of_stuck()
    if (i < 0) return
    call add_text(message, "igaform: the run stops when ")
    call add_user(message, records(i)%latest)
    call add_text(message, " returns")
    call add_place(message, records(i)%latest)
    call add_text(message, "; a second signal ends it there at once")
    call send(message, standard_error)
  end subroutine report_waiting

  !> Number in `records` of a thread in the call that it was in when a signal asked for the end;
  !! negative if there is none.
  integer function place_of_stuck() result(place)
    do place = min(n_records, most_threads), 0, -1
      if (records(place)%is_inside .and. &
          records(place)%n_calls == records(place)%n_calls_at_stop) return
    end do
  end function place_of_stuck

  !> The end of the program, for whatever reason: inside a call it is a STOP of the user. One in
  !! another thread waits here, else it would close what this one still writes.
  subroutine at_exit() bind(C)
    integer :: own

    own = own_slot()
    if (records(own)%is_leaver .or. .not. records(own)%is_inside) return
    call end_run("STOP, EXIT or an error at run time")
  end subroutine at_exit

  !> Replaces the C library's `abort`, which CALL ABORT and the run-time libraries call:
  !! gfortran's gives up all handlers of the signal before. Inside a call it is reported as a crash.
  subroutine abort_program() bind(C, name="abort")
    type(c_funptr) :: before
    integer(c_int) :: status

    if (records(own_slot())%is_inside) call end_by_crash(abort_signal)
    before = c_signal(abort_signal, c_null_funptr)
    status = c_raise(abort_signal)
    call c_exit_now(128_c_int + abort_signal)   ! never reached: the signal is not caught any more
  end subroutine abort_program

  !> Report, save, close all files, end. One thread gets through; the others wait here for the end.
  subroutine end_run(how)
    character(*), intent(in) :: how   ! the routine that was called, or what happened
    type(message_t) :: message
    integer :: own

    call become_leaver()
    own = own_slot()
    call add_user(message, records(own)%latest)
    call add_text(message, " ended the run (")
    call add_text(message, how)
    call add_text(message, ")")
    call add_place(message, records(own)%latest)
    call save_and_exit(message)
  end subroutine end_run

  !> The way out of the thread that ends the run: report, save, close all files, end.
  subroutine save_and_exit(message)
    type(message_t), intent(in) :: message
    integer(c_int), parameter :: patience = 60_c_int   ! [s], for what must not take for ever
    character(kind=c_char) :: characters(longest)
    procedure(farewell_procedure), pointer :: action
    type(c_funptr) :: before
    integer(c_int) :: ignored
    integer :: i

    call report(message)
    before = c_signal(alarm_signal, c_funloc(at_alarm))
    ignored = c_alarm(patience)
    if (c_associated(farewell)) then
      call c_f_procpointer(farewell, action)
      do i = 1, min(longest, message%length)
        characters(i) = message%text(i:i)
      end do
      call action(farewell_context, characters, int(min(longest, message%length), c_int))
    end if
    ! In a program that is ending already the C library continues with what is left to be done: the
    ! run-time library of Fortran closes its units, and asks for no locks.
    call c_exit(int(exit_by_user, c_int))
  end subroutine save_and_exit

  !> The message as an error of the program.
  subroutine report(message)
    type(message_t), intent(in) :: message
    type(message_t) :: line

    call add_text(line, "igaform: error: ")
    call add_text(line, message%text(:message%length))
    call send(line, standard_error)
  end subroutine report

  !> The same, and as a line of the log.
  subroutine report_and_log(message)
    type(message_t), intent(in) :: message

    call report(message)
    call log_error(message%text(:message%length))
  end subroutine report_and_log

  !> An error as a line of the log, for an end at which nobody else adds one.
  subroutine log_error(text)
    character(*), intent(in) :: text
    type(message_t) :: line

    if (log_descriptor < 0) return
    call add_text(line, "error: ")
    call add_text(line, text)
    call send(line, log_descriptor)
  end subroutine log_error

  !> Return in the thread that comes first; the others wait for the end of the program.
  subroutine become_leaver()
    integer(c_int) :: ignored
    integer :: place, own

    !$omp atomic capture
    n_leaving = n_leaving + 1
    place = n_leaving
    !$omp end atomic
    do while (place > 1)
      ignored = c_pause()
    end do
    own = own_slot()
    records(own)%is_leaver = .true.
  end subroutine become_leaver

  !> The state could not be saved, or the files could not be closed, in all that time.
  subroutine at_alarm() bind(C)
    type(message_t) :: message

    call add_text(message, "the state reached could not be saved in time: a file is held")
    call report_and_log(message)
    call c_exit_now(int(exit_by_user, c_int))
  end subroutine at_alarm

  !> A crash. The state is not to be trusted any more, so nothing is saved.
  subroutine at_crash(number, details) bind(C)
    integer(c_int), value :: number
    type(c_ptr), value :: details   ! a third argument, the registers, is of no use here
    type(message_t) :: message
    logical :: is_overflow
    integer :: own

    own = own_slot()
    is_overflow = number == segment_fault .or. number == bus_error
    if (is_overflow) is_overflow = is_out_of_stack(records(own)%signal_stack, details)
    if (records(own)%is_leaver .or. .not. records(own)%is_inside .or. .not. is_overflow) &
      call end_by_crash(number)
    call become_leaver()
    ! The calls of a recursion without end would fill screens.
    call add_user(message, records(own)%latest)
    call add_text(message, " ran out of stack")
    call add_place(message, records(own)%latest)
    call add_text(message, ": it calls itself without end, or its local arrays are too large; "// &
                  "`ulimit -s unlimited` and OMP_STACKSIZE=256M before the run give more")
    call report_and_log(message)
    call c_exit_now(int(exit_by_user, c_int))
  end subroutine at_crash

  !> Report a crash and where it was, list the calls that led there, end. A thread that crashes
  !! while another one ends the run waits for that.
  subroutine end_by_crash(number)
    integer(c_int), intent(in) :: number
    integer(c_int), parameter :: set_mask = 2_c_int, patience = 5_c_int
    integer(c_int64_t), parameter :: no_signals(16) = 0_c_int64_t   ! the size of a sigset_t
    type(message_t) :: message
    type(c_funptr) :: before
    integer(c_int) :: ignored
    integer :: own

    own = own_slot()
    if (records(own)%is_leaver) call at_second_crash()
    call become_leaver()
    if (records(own)%is_inside) then
      call add_user(message, records(own)%latest)
      call add_text(message, " crashed (")
      call add_signal(message, number)
      call add_text(message, ")")
      call add_place(message, records(own)%latest)
    else
      call add_text(message, "crashed outside the user's subroutine (")
      call add_signal(message, number)
      call add_text(message, "), which may have written past the end of its arrays before (one "// &
                    "for plane strain or shells counts on NTENS below 6)")
      call add_latest(message, records(own))
    end if
    call report_and_log(message)
    ! What follows is of use, but may crash or wait: the heap or the stack may be written over.
    before = c_signal(number, c_funloc(at_second_crash))
    before = c_signal(segment_fault, c_funloc(at_second_crash))
    before = c_signal(alarm_signal, c_funloc(at_second_crash))
    ignored = c_alarm(patience)
    ignored = c_signal_mask(set_mask, no_signals, c_null_ptr)
    call c_backtrace()
    call c_exit_now(int(exit_by_user, c_int))
  end subroutine end_by_crash

  !> The end was reported already.
  subroutine at_second_crash() bind(C)
    call c_exit_now(int(exit_by_user, c_int))
  end subroutine at_second_crash

  !> Report and end, with nothing saved.
  subroutine end_at_once(message, code)
    type(message_t), intent(in) :: message
    integer, intent(in) :: code

    call become_leaver()
    call report_and_log(message)
    call c_exit_now(int(code, c_int))
  end subroutine end_at_once

  !> Whose code it is, such as "the user's subroutine UMAT".
  subroutine add_user(message, which)
    type(message_t), intent(inout) :: message
    type(call_t), intent(in) :: which

    call add_text(message, "the user's subroutine ")
    ! A thread that the subroutine has started itself is in no call of ours.
    if (which%routine < 1 .or. which%routine > size(routine_names)) return
    call add_text(message, routine_names(which%routine)(:len_trim(routine_names(which%routine))))
  end subroutine add_user

  !> A text as C has it.
  subroutine add_characters(message, characters)
    type(message_t), intent(inout) :: message
    character(kind=c_char), intent(in) :: characters(:)
    integer :: i

    do i = 1, size(characters)
      call add_text(message, characters(i))
    end do
  end subroutine add_characters

  !> Where it is at work, such as " in element 3, point 1" or " in elements 1 to 4, point 1".
  subroutine add_place(message, which)
    type(message_t), intent(inout) :: message
    type(call_t), intent(in) :: which

    if (which%element < 0) then
      call add_text(message, " before the first increment")
      return
    end if
    if (which%last > which%element) then
      call add_text(message, " in elements ")
      call add_number(message, int(which%element))
      call add_text(message, " to ")
      call add_number(message, int(which%last))
    else
      call add_text(message, " in element ")
      call add_number(message, int(which%element))
    end if
    call add_text(message, ", point ")
    call add_number(message, int(which%point))
  end subroutine add_place

  !> The call that a thread began last.
  subroutine add_latest(message, record)
    type(message_t), intent(inout) :: message
    type(record_t), intent(in) :: record

    if (record%latest%routine == 0) return
    call add_text(message, "; the last call was that of ")
    call add_user(message, record%latest)
    call add_place(message, record%latest)
  end subroutine add_latest

  subroutine add_signal(message, number)
    type(message_t), intent(inout) :: message
    integer(c_int), intent(in) :: number

    select case (number)
    case (4)
      call add_text(message, "illegal instruction")
    case (abort_signal)
      call add_text(message, "ABORT, or a heap that was written over")
    case (bus_error)
      call add_text(message, "bus error")
    case (8)
      call add_text(message, "floating-point exception")
    case default
      call add_text(message, "segmentation fault")
    end select
  end subroutine add_signal

end module user_watch
