!> The end of the program where the system refuses memory.
!!
!! Compiled Fortran asks for memory not only in ALLOCATE, which could ask for a status, but also in
!! assignments, temporaries and automatic arrays, which cannot: gfortran then ends the program with
!! words of its runtime and exit code 1, or continues without the memory and crashes, and so does
!! HDF5. The linker leads all calls for memory in objects and archives to this module (`--wrap` of
!! the GNU linker), and where the system refuses, the program ends here, at once: with STAT=, too.
!! Of what shared libraries ask for, such as the runtimes, the exit code says so.
module out_of_memory
  use, intrinsic :: iso_c_binding, only: c_associated, c_funloc, c_funptr, c_int, c_null_ptr, &
                                         c_ptr, c_size_t
  use c_library, only: c_exit, c_exit_now, c_free, c_write
  use exit_codes, only: exit_files
  implicit none
  private

  public :: watch_memory, leave

  integer(c_int), parameter :: standard_error = 2_c_int
  integer(c_size_t), parameter :: reserve_bytes = 1048576_c_size_t   ! for closing what is open
  character(*), parameter :: what_is_left = "; files written before are whole, and where there "// &
    "is a checkpoint --restart continues from it"//new_line("a")

  ! What kernels of degree 5 take of a stack, with a margin; a stack that runs out reports nothing.
  integer(c_size_t), parameter :: least_stack = 1048576_c_size_t

  logical, volatile :: is_leaving = .false.   ! the end that comes is the program's own
  type(c_ptr), volatile :: reserve = c_null_ptr
  logical :: is_ending = .false.              ! this thread ends the program for want of memory
  !$omp threadprivate(is_ending)

  interface
    type(c_ptr) function real_malloc(n_bytes) bind(C, name="__real_malloc")
      import :: c_ptr, c_size_t
      integer(c_size_t), value :: n_bytes
    end function real_malloc

    type(c_ptr) function real_calloc(n, n_bytes) bind(C, name="__real_calloc")
      import :: c_ptr, c_size_t
      integer(c_size_t), value :: n, n_bytes
    end function real_calloc

    type(c_ptr) function real_realloc(old, n_bytes) bind(C, name="__real_realloc")
      import :: c_ptr, c_size_t
      type(c_ptr), value :: old
      integer(c_size_t), value :: n_bytes
    end function real_realloc

    integer(c_int) function c_getrlimit(kind, limits) bind(C, name="getrlimit")
      import :: c_int, c_size_t
      integer(c_int), value :: kind
      integer(c_size_t), intent(out) :: limits(2)
    end function c_getrlimit

    integer(c_int) function c_on_exit(action, argument) bind(C, name="on_exit")
      import :: c_funptr, c_int, c_ptr
      type(c_funptr), value :: action
      type(c_ptr), value :: argument
    end function c_on_exit
  end interface

contains

  !> Look whether the stack is large enough, keep something in reserve, and look at how the program
  !! ends from now on.
  subroutine watch_memory()
    integer(c_int), parameter :: stack_limit = 3_c_int   ! of Linux
    integer(c_size_t) :: limits(2)                       ! -1: none
    integer(c_int) :: status

    if (c_getrlimit(stack_limit, limits) /= 0) limits = -1
    if (limits(1) >= 0 .and. limits(1) < least_stack) then
      call put("igaform: error: the stack is limited to ")
      call put_number(limits(1))
      call put(" bytes, and ")
      call put_number(least_stack)
      call put(" are asked for: see `ulimit -s`"//new_line("a"))
      call c_exit_now(int(exit_files, c_int))
    end if
    reserve = real_malloc(reserve_bytes)
    status = c_on_exit(c_funloc(check_end), c_null_ptr)
  end subroutine watch_memory

  !> End the program. STOP would print its code; the C library's exit does not.
  subroutine leave(code)
    integer, intent(in) :: code

    is_leaving = .true.
    call c_exit(int(code, c_int))
  end subroutine leave

  !> Stands in for `malloc`.
  type(c_ptr) function ask(n_bytes) bind(C, name="__wrap_malloc")
    integer(c_size_t), value :: n_bytes

    ask = real_malloc(n_bytes)
    if (.not. c_associated(ask) .and. n_bytes /= 0) call end_for_memory(n_bytes)
  end function ask

  !> Stands in for `calloc`.
  type(c_ptr) function ask_zeros(n, n_bytes) bind(C, name="__wrap_calloc")
    integer(c_size_t), value :: n, n_bytes

    ask_zeros = real_calloc(n, n_bytes)
    if (.not. c_associated(ask_zeros) .and. n*n_bytes /= 0) call end_for_memory(n*n_bytes)
  end function ask_zeros

  !> Stands in for `realloc`.
  type(c_ptr) function ask_more(old, n_bytes) bind(C, name="__wrap_realloc")
    type(c_ptr), value :: old
    integer(c_size_t), value :: n_bytes

    ask_more = real_realloc(old, n_bytes)
    if (.not. c_associated(ask_more) .and. n_bytes /= 0) call end_for_memory(n_bytes)
  end function ask_more

  !> Tell how much was asked for and end. One thread gets through, and closes the Fortran units;
  !! the others wait here for the end.
  subroutine end_for_memory(n_refused)
    integer(c_size_t), intent(in) :: n_refused   ! bytes
    type(c_ptr) :: held

    if (is_ending) call c_exit_now(int(exit_files, c_int))
    !$omp critical (igaform_memory_end)
    is_ending = .true.
    is_leaving = .true.
    held = reserve
    reserve = c_null_ptr
    call c_free(held)
    call put("igaform: error: out of memory: ")
    call put_number(n_refused)
    call put(" bytes more were asked for"//what_is_left)
    call c_exit(int(exit_files, c_int))
    !$omp end critical (igaform_memory_end)
  end subroutine end_for_memory

  !> An end that is not the program's own: the runtimes of Fortran and of OpenMP give up with code
  !! 1 for want of memory or threads, and have said so. They may have locks of units, so none is
  !! touched.
  subroutine check_end(code, argument) bind(C)
    integer(c_int), value :: code
    type(c_ptr), value :: argument   ! that of on_exit

    if (is_leaving .or. code /= 1_c_int .or. c_associated(argument)) return
    call put("igaform: error: the system refuses memory or threads, see above"//what_is_left)
    call c_exit_now(int(exit_files, c_int))
  end subroutine check_end

  !> Words on standard error, without Fortran's units and without memory for them.
  subroutine put(words)
    character(*), intent(in) :: words
    integer(c_size_t) :: n

    n = c_write(standard_error, words, len(words, c_size_t))
  end subroutine put

  !> A number, not below 0, likewise.
  subroutine put_number(number)
    integer(c_size_t), intent(in) :: number
    character(20) :: text
    integer(c_size_t) :: left
    integer :: i

    left = number
    do i = len(text), 1, -1
      text(i:i) = achar(iachar("0") + int(modulo(left, 10_c_size_t)))
      left = left/10
      if (left == 0) exit
    end do
    call put(text(i:))
  end subroutine put_number

end module out_of_memory
