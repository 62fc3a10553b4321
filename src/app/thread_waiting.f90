!> How threads wait for each other. GNU OpenMP lets them spin for about a millisecond, which is
!! longer than a step here takes; where other programs share the cores, each wait then costs a
!! time slice (measured on the channel example with two threads during a build: 59 s instead of
!! 4.3 s). A short spin costs 2 % on an idle machine. The runtime reads its settings only when
!! a program starts, so the program starts itself once more with them.
module thread_waiting
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_ptr, c_loc, c_null_char, c_null_ptr
  implicit none
  private

  public :: shorten_waiting

  character(*), parameter :: spins = "3000"

  interface
    integer(c_int) function c_setenv(name, value, overwrite) bind(C, name="setenv")
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: name(*), value(*)
      integer(c_int), value :: overwrite
    end function c_setenv

    integer(c_int) function c_execv(path, arguments) bind(C, name="execv")
      import :: c_char, c_int, c_ptr
      character(kind=c_char), intent(in) :: path(*)
      type(c_ptr), intent(in) :: arguments(*)
    end function c_execv
  end interface

  !> One argument as C wants it.
  type :: argument_t
    character(kind=c_char), allocatable :: text(:)
  end type argument_t

contains

  !> Start again with short spins, unless the user says how threads shall wait. Returns only if
  !! there is nothing to do, or if starting again fails: then waiting is as the runtime has it.
  subroutine shorten_waiting()
    type(argument_t), allocatable, target :: arguments(:)
    type(c_ptr), allocatable :: pointers(:)
    integer(c_int) :: status
    integer :: i

    if (is_set("OMP_WAIT_POLICY")) return
    if (is_set("GOMP_SPINCOUNT")) return
    ! The runtime has then kept this thread on one core, where all of the new program would run.
    if (has_places()) return
    allocate (arguments(0:command_argument_count()), pointers(0:command_argument_count() + 1))
    do i = 0, command_argument_count()
      call take_argument(i, arguments(i)%text)
      pointers(i) = c_loc(arguments(i)%text)
    end do
    pointers(command_argument_count() + 1) = c_null_ptr
    status = c_setenv("GOMP_SPINCOUNT"//c_null_char, spins//c_null_char, 1_c_int)
    if (status == 0) status = c_execv("/proc/self/exe"//c_null_char, pointers)
  end subroutine shorten_waiting

  !> Does the user say on which cores threads shall run?
  logical function has_places()
    has_places = is_set("OMP_PROC_BIND")
    if (.not. has_places) has_places = is_set("OMP_PLACES")
    if (.not. has_places) has_places = is_set("GOMP_CPU_AFFINITY")
  end function has_places

  logical function is_set(name)
    character(*), intent(in) :: name
    integer :: status

    call get_environment_variable(name, status=status)
    is_set = status == 0
  end function is_set

  subroutine take_argument(number, text)
    integer, intent(in) :: number
    character(kind=c_char), allocatable, intent(out) :: text(:)
    character(:), allocatable :: word
    integer :: length, i

    call get_command_argument(number, length=length)
    allocate (character(length) :: word)
    call get_command_argument(number, value=word)
    allocate (text(length + 1))
    do i = 1, length
      text(i) = word(i:i)
    end do
    text(length + 1) = c_null_char
  end subroutine take_argument

end module thread_waiting
