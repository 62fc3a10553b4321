!> How a run ends from inside a subroutine of a user, and what it has to say.
!!
!! Built into a shared library of its own, which the program and the compiled subroutines both
!! link. The routines have the names and arguments that Abaqus gives them.
!!
!! The calls carry no argument that says where they come from, so this module remembers it: the
!! element and point in hand for each thread, and what is to be saved when the run must end.
module aba_utilities
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_funloc, c_funptr, c_int, c_int64_t, &
                                         c_null_funptr, c_null_ptr, c_ptr, c_size_t, &
                                         c_associated, c_f_procpointer
  use, intrinsic :: iso_fortran_env, only: error_unit
  use crash_watch, only: signal_stack_t, catch_crashes, give_signal_stack, is_out_of_stack
  implicit none
  private

  integer, parameter, public :: exit_by_user = 2   !! exit code of a run that a subroutine ends
  integer, parameter :: longest = 400

  abstract interface
    !> What is to be done before the program ends, such as saving the state.
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

    type(c_funptr) function c_signal(number, action) bind(C, name="signal")
      import :: c_int, c_funptr
      integer(c_int), value :: number
      type(c_funptr), value :: action
    end function c_signal

    integer(c_int) function c_signal_mask(how, signals, before) bind(C, name="pthread_sigmask")
      import :: c_int, c_int64_t, c_ptr
      integer(c_int), value :: how
      integer(c_int64_t), intent(in) :: signals(*)
      type(c_ptr), value :: before
    end function c_signal_mask

    subroutine c_exit(code) bind(C, name="exit")
      import :: c_int
      integer(c_int), value :: code
    end subroutine c_exit

    subroutine c_exit_now(code) bind(C, name="_exit")
      import :: c_int
      integer(c_int), value :: code
    end subroutine c_exit_now

    subroutine c_backtrace() bind(C, name="_gfortran_backtrace")
    end subroutine c_backtrace
  end interface

  integer(c_int) :: element = 0, point = 0   ! in hand in this thread; 0: no call is under way
  type(signal_stack_t) :: signal_stack
  !$omp threadprivate(element, point, signal_stack)
  type(c_funptr) :: farewell = c_null_funptr
  type(c_ptr) :: farewell_context = c_null_ptr
  logical :: is_leaving = .false.
  integer(c_int) :: failure(3) = 0           ! element, point and reason

contains

  !> A call of the user's subroutine begins for this element and point.
  subroutine enter_user_call(noel, npt) bind(C, name="igaform_enter_user_call")
    integer(c_int), value :: noel, npt   !! -1: before the run, for no point

    if (.not. signal_stack%is_given) call give_signal_stack(signal_stack)
    element = noel
    point = npt
  end subroutine enter_user_call

  !> The calls of this thread are done.
  subroutine leave_user_call() bind(C, name="igaform_leave_user_call")
    element = 0
    point = 0
  end subroutine leave_user_call

  !> A stress update of the user's subroutine failed; that of the lowest element is kept.
  subroutine note_failure(noel, npt, reason) bind(C, name="igaform_note_user_failure")
    integer(c_int), value :: noel, npt
    integer(c_int), value :: reason   !! 1: not finite, 2: PNEWDT stays below one

    !$omp critical (igaform_failure)
    if (failure(1) == 0 .or. noel < failure(1)) failure = [noel, npt, reason]
    !$omp end critical (igaform_failure)
  end subroutine note_failure

  !> Element, point and reason of the failure that was kept; zeros if there was none.
  subroutine tell_failure(values) bind(C, name="igaform_tell_user_failure")
    integer(c_int), intent(out) :: values(3)

    values = failure
  end subroutine tell_failure

  !> Watch over the calls from now on: an end of the program or a crash inside one is told with
  !! element and point, and `action` (may be null) is carried out before. To be called again with
  !! the action once there is something to save, so that it runs before the libraries close down.
  subroutine watch_user_calls(action, context) bind(C, name="igaform_watch_user_calls")
    type(c_funptr), value :: action
    type(c_ptr), value :: context   !! what the action is to work on
    integer(c_int), parameter :: crashes(5) = [4_c_int, 6_c_int, 7_c_int, 8_c_int, 11_c_int]
    integer(c_int) :: status

    farewell = action
    farewell_context = context
    status = c_atexit(c_funloc(at_exit))
    call catch_crashes(crashes, c_funloc(at_crash))
  end subroutine watch_user_calls

  !> Ends the run: the user's subroutine found no way on.
  subroutine xit() bind(C, name="xit_")
    call end_run("XIT")
  end subroutine xit

  !> The same from an explicit analysis.
  subroutine xplb_exit() bind(C, name="xplb_exit_")
    call end_run("XPLB_EXIT")
  end subroutine xplb_exit

  !> The end of the program, for whatever reason: inside a call it is a STOP of the user.
  subroutine at_exit() bind(C)
    if (element == 0 .or. is_leaving) return
    call end_run("STOP or an error at run time")
  end subroutine at_exit

  !> Tell, save, flush, end. One thread gets through; the others wait here for the end.
  subroutine end_run(how)
    character(*), intent(in) :: how   ! the routine that was called, or what happened
    character(longest) :: message
    character(kind=c_char) :: characters(longest)
    procedure(farewell_procedure), pointer :: action
    integer :: i

    !$omp critical (igaform_leaving)
    is_leaving = .true.
    message = where_and_why("the user's subroutine ended the run ("//how//")")
    write (error_unit, "(a)") "igaform: error: "//trim(message)
    if (c_associated(farewell)) then
      call c_f_procpointer(farewell, action)
      do i = 1, longest
        characters(i) = message(i:i)
      end do
      call action(farewell_context, characters, int(len_trim(message), c_int))
    end if
    call flush_units()
    if (how == "XIT" .or. how == "XPLB_EXIT") call c_exit(int(exit_by_user, c_int))
    ! The program is ending already, and exit must not be entered twice.
    call c_exit_now(int(exit_by_user, c_int))
    !$omp end critical (igaform_leaving)
  end subroutine end_run

  !> A crash. Inside a call of the user's subroutine it is told where; the state is not to be
  !! trusted any more, so nothing is saved. Any other crash takes its usual way.
  subroutine at_crash(number, details) bind(C)
    integer(c_int), value :: number
    type(c_ptr), value :: details   ! a third argument, the registers, is of no use here
    integer(c_int), parameter :: set_mask = 2_c_int, segment_fault = 11_c_int, bus_error = 7_c_int
    integer(c_int64_t), parameter :: no_signals(16) = 0_c_int64_t   ! the size of a sigset_t
    type(c_funptr) :: before
    integer(c_int) :: status
    logical :: is_overflow

    is_overflow = is_out_of_stack(signal_stack, details)
    is_overflow = is_overflow .and. (number == segment_fault .or. number == bus_error)
    if (element == 0) then
      write (error_unit, "(a)") "igaform: error: crashed outside the user's subroutine, which "// &
        "may have written past the end of its arrays (one for plane strain or shells counts on "// &
        "NTENS below 6)"
      flush (error_unit)
      before = c_signal(number, c_null_funptr)
    else if (is_overflow) then
      ! The calls of a recursion without end would fill screens.
      write (error_unit, "(a)") "igaform: error: "// &
        trim(where_and_why("the user's subroutine ran out of stack"))//": it calls itself "// &
        "without end, or its local arrays are too large; `ulimit -s unlimited` and "// &
        "OMP_STACKSIZE=256M before the run give more"
      flush (error_unit)
      call c_exit_now(int(exit_by_user, c_int))
    else
      write (error_unit, "(a)") "igaform: error: "// &
        trim(where_and_why("the user's subroutine crashed"))
      flush (error_unit)
      ! A stack that was written over makes the backtrace crash, too.
      before = c_signal(number, c_funloc(at_second_crash))
      status = c_signal_mask(set_mask, no_signals, c_null_ptr)
      call c_backtrace()
      call c_exit_now(int(exit_by_user, c_int))
    end if
  end subroutine at_crash

  !> The crash was told already.
  subroutine at_second_crash() bind(C)
    call c_exit_now(int(exit_by_user, c_int))
  end subroutine at_second_crash

  function where_and_why(what) result(message)
    character(*), intent(in) :: what
    character(longest) :: message

    if (element < 0) then
      message = what//" before the first increment"
    else
      write (message, "(2a, i0, a, i0)") what, " in element ", element, ", point ", point
    end if
  end function where_and_why

  !> What subroutines have written must not be lost.
  subroutine flush_units()
    integer, parameter :: last = 200
    integer :: unit
    logical :: is_open

    do unit = 0, last
      inquire (unit=unit, opened=is_open)
      if (is_open) flush (unit)
    end do
  end subroutine flush_units

  !> Results of other points and of other parts of a model are not to be had here.
  subroutine getvrm() bind(C, name="getvrm_")
    call refuse("GETVRM")
  end subroutine getvrm

  !> The same from an explicit analysis.
  subroutine vgetvrm() bind(C, name="vgetvrm_")
    call refuse("VGETVRM")
  end subroutine vgetvrm

  subroutine refuse(name)
    character(*), intent(in) :: name

    write (error_unit, "(a)") "igaform: error: "//name//" is called, which is not provided"
    call end_run("XIT")
  end subroutine refuse

  !> A message of the user's subroutine; LOP = -3 ends the run.
  subroutine stdb_abqerr(lop, text, intv, realv, charv, text_length, charv_length) &
      bind(C, name="stdb_abqerr_")
    integer(c_int), intent(in) :: lop, intv(*)
    real(c_double), intent(in) :: realv(*)
    integer(c_size_t), value :: text_length, charv_length
    character(kind=c_char), intent(in) :: text(text_length), charv(charv_length, *)
    character(longest) :: line

    call fill_in(text, intv, realv, charv_length, charv, line)
    write (error_unit, "(a)") "igaform: message of the user's subroutine: "//trim(line)
    if (lop == -3) call xit()
  end subroutine stdb_abqerr

  !> The same from an explicit analysis.
  subroutine xplb_abqerr(lop, text, intv, realv, charv, text_length, charv_length) &
      bind(C, name="xplb_abqerr_")
    integer(c_int), intent(in) :: lop, intv(*)
    real(c_double), intent(in) :: realv(*)
    integer(c_size_t), value :: text_length, charv_length
    character(kind=c_char), intent(in) :: text(text_length), charv(charv_length, *)

    call stdb_abqerr(lop, text, intv, realv, charv, text_length, charv_length)
  end subroutine xplb_abqerr

  !> A text with the next whole number for each %I, real number for %R and word for %S.
  subroutine fill_in(text, intv, realv, charv_length, charv, line)
    integer(c_size_t), intent(in) :: charv_length
    character(kind=c_char), intent(in) :: text(:), charv(charv_length, *)
    integer(c_int), intent(in) :: intv(*)
    real(c_double), intent(in) :: realv(*)
    character(*), intent(out) :: line
    character(24) :: value
    integer :: i, n, used(3)

    line = ""
    used = 0
    n = 0
    i = 1
    do while (i <= size(text))
      value = text(i)
      if (text(i) == "%" .and. i < size(text)) then
        i = i + 1
        select case (text(i))
        case ("I", "i")
          used(1) = used(1) + 1
          write (value, "(i0)") intv(used(1))
        case ("R", "r")
          used(2) = used(2) + 1
          write (value, "(g0.8)") realv(used(2))
        case ("S", "s")
          used(3) = used(3) + 1
          value = word_of(charv(:, used(3)))
        case default
          i = i - 1
        end select
      end if
      line(n + 1:) = value
      n = n + max(1, len_trim(value))
      i = i + 1
    end do
  end subroutine fill_in

  pure function word_of(characters) result(word)
    character(kind=c_char), intent(in) :: characters(:)
    character(24) :: word
    integer :: i

    word = ""
    do i = 1, min(size(characters), len(word))
      word(i:i) = characters(i)
    end do
  end function word_of

end module aba_utilities
