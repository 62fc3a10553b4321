!> Crashes caught on a stack of their own, so that one by which the stack ran out can be reported.
!! And messages put together and written without the heap and without the run-time library of
!! Fortran: for the end of a program in which a unit may be locked and the heap written over.
module crash_handler
  use, intrinsic :: iso_c_binding, only: c_funptr, c_int, c_int64_t, c_intptr_t, c_loc, &
                                         c_null_funptr, c_null_ptr, c_ptr, c_size_t, c_f_pointer, &
                                         c_char
  use c_library, only: c_open, c_write
  implicit none
  private

  public :: signal_stack_t, catch_crashes, give_signal_stack, is_out_of_stack
  public :: message_t, add_text, add_number, send, open_for_lines

  integer, parameter :: longest = 800

  !> A text of fixed length; what does not fit is cut.
  type :: message_t
    character(longest) :: text = ""
    integer :: length = 0
  end type message_t

  integer, parameter :: stack_bytes = 262144   ! for messages and the list of calls

  !> The stack of one thread and the other that takes its signals.
  type :: signal_stack_t
    logical :: is_given = .false.
    integer(c_intptr_t) :: lowest = 0          !! address at which the stack of the thread ends
    integer(c_int64_t), pointer :: room(:) => null()
  end type signal_stack_t

  !> What `sigaction` takes, on Linux with 64 bits.
  type, bind(C) :: action_t
    type(c_funptr) :: handler = c_null_funptr
    integer(c_int64_t) :: mask(16) = 0_c_int64_t
    integer(c_int) :: flags = 0_c_int
    type(c_funptr) :: restorer = c_null_funptr
  end type action_t

  !> What `sigaltstack` takes.
  type, bind(C) :: stack_t
    type(c_ptr) :: start = c_null_ptr
    integer(c_int) :: flags = 0_c_int
    integer(c_size_t) :: n_bytes = 0_c_size_t
  end type stack_t

  interface
    integer(c_int) function c_sigaction(number, action, before) bind(C, name="sigaction")
      import :: action_t, c_int, c_ptr
      integer(c_int), value :: number
      type(action_t), intent(in) :: action
      type(c_ptr), value :: before
    end function c_sigaction

    integer(c_int) function c_sigaltstack(stack, before) bind(C, name="sigaltstack")
      import :: stack_t, c_int, c_ptr
      type(stack_t), intent(in) :: stack
      type(c_ptr), value :: before
    end function c_sigaltstack

    integer(c_intptr_t) function c_this_thread() bind(C, name="pthread_self")
      import :: c_intptr_t
    end function c_this_thread

    integer(c_int) function c_thread_traits(thread, traits) bind(C, name="pthread_getattr_np")
      import :: c_int, c_int64_t, c_intptr_t
      integer(c_intptr_t), value :: thread
      integer(c_int64_t), intent(inout) :: traits(*)
    end function c_thread_traits

    integer(c_int) function c_stack_of(traits, lowest, n_bytes) &
        bind(C, name="pthread_attr_getstack")
      import :: c_int, c_int64_t, c_intptr_t, c_size_t
      integer(c_int64_t), intent(in) :: traits(*)
      integer(c_intptr_t), intent(out) :: lowest
      integer(c_size_t), intent(out) :: n_bytes
    end function c_stack_of

    integer(c_int) function c_drop_traits(traits) bind(C, name="pthread_attr_destroy")
      import :: c_int, c_int64_t
      integer(c_int64_t), intent(inout) :: traits(*)
    end function c_drop_traits
  end interface

contains

  !> From now on these signals call `handler` with number, what is known of the signal, and the
  !! state of the thread; on the other stack where the thread has one.
  subroutine catch_crashes(signals, handler)
    integer(c_int), intent(in) :: signals(:)
    type(c_funptr), value :: handler   ! by value: gfortran 12 puts the address in read-only memory
    integer(c_int), parameter :: with_details = 4_c_int, on_other_stack = 134217728_c_int
    type(action_t) :: action
    integer(c_int) :: status
    integer :: i

    action%handler = handler
    action%flags = ior(with_details, on_other_stack)
    do i = 1, size(signals)
      status = c_sigaction(signals(i), action, c_null_ptr)
    end do
  end subroutine catch_crashes

  !> Give the calling thread its other stack; it keeps it until the program ends.
  subroutine give_signal_stack(stack)
    type(signal_stack_t), intent(inout) :: stack
    integer(c_int64_t) :: traits(32)     ! room enough for the type that C hides
    integer(c_size_t) :: n_bytes
    type(stack_t) :: other
    integer(c_int) :: status

    stack%is_given = .true.
    allocate (stack%room(stack_bytes/8))
    other%start = c_loc(stack%room)
    other%n_bytes = int(stack_bytes, c_size_t)
    status = c_sigaltstack(other, c_null_ptr)
    traits = 0_c_int64_t
    if (c_thread_traits(c_this_thread(), traits) /= 0) return
    status = c_stack_of(traits, stack%lowest, n_bytes)
    status = c_drop_traits(traits)
  end subroutine give_signal_stack

  !> Did the thread touch what lies just beyond the end of its stack?
  logical function is_out_of_stack(stack, details)
    type(signal_stack_t), intent(in) :: stack
    type(c_ptr), intent(in) :: details            !! the second argument of the handler
    integer(c_int64_t), parameter :: near = 67108864_c_int64_t, page = 65536_c_int64_t
    integer(c_int64_t), pointer :: words(:)
    integer(c_int64_t) :: below

    call c_f_pointer(details, words, [3])
    below = int(stack%lowest, c_int64_t) - words(3)   ! the address is at byte 16
    is_out_of_stack = stack%lowest /= 0 .and. below > -page .and. below < near
  end function is_out_of_stack

  !> Append a text; spaces at its end count.
  pure subroutine add_text(message, text)
    type(message_t), intent(inout) :: message
    character(*), intent(in) :: text
    integer :: i

    do i = 1, min(len(text), longest - 1 - message%length)   ! one place is left for the line end
      message%length = message%length + 1
      message%text(message%length:message%length) = text(i:i)
    end do
  end subroutine add_text

  !> Add a whole number.
  pure subroutine add_number(message, number)
    type(message_t), intent(inout) :: message
    integer, intent(in) :: number
    character(10) :: digits
    integer :: rest, i

    if (number < 0) call add_text(message, "-")
    rest = number
    i = len(digits) + 1
    do
      i = i - 1
      digits(i:i) = achar(iachar("0") + abs(mod(rest, 10)))
      rest = rest/10
      if (rest == 0) exit
    end do
    call add_text(message, digits(i:))
  end subroutine add_number

  !> Descriptor of an existing file, to append lines; negative if it cannot be opened.
  integer(c_int) function open_for_lines(path) result(descriptor)
    character(kind=c_char), intent(in) :: path(*)   !! with the zero at its end
    ! Of Linux: write, append, closed in programs that are started.
    integer(c_int), parameter :: to_append = 525313_c_int

    descriptor = c_open(path, to_append)
  end function open_for_lines

  !> Write the message as a line to an open file.
  subroutine send(message, descriptor)
    type(message_t), intent(in) :: message
    integer(c_int), intent(in) :: descriptor
    character(kind=c_char) :: line(longest)
    integer(c_size_t) :: ignored
    integer :: i

    do i = 1, message%length
      line(i) = message%text(i:i)
    end do
    line(message%length + 1) = new_line("a")
    ignored = c_write(descriptor, line, int(message%length + 1, c_size_t))
  end subroutine send

end module crash_handler