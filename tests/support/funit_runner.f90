!> Runs the tests of one program and reports what failed.
module funit_runner
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
  use funit_failures, only: failures, clear_failures, anyExceptions
  implicit none
  private

  public :: runner_t, new_runner, run_test, skip_test, finish

  !> The tests of a program: which are to run, and what came out so far.
  type :: runner_t
    character(:), allocatable :: filter    !! part of a name that a test must have, empty for all
    logical :: is_verbose = .false.        !! name each test before it runs
    integer :: n_run = 0, n_failed = 0, n_disabled = 0
  end type runner_t

  abstract interface
    subroutine step()
    end subroutine step
  end interface

  interface
    !> Ends the program without the backtrace and the notes of `error stop`, which would hide the
    !! failures.
    subroutine c_exit(status) bind(c, name="exit")
      import :: c_int
      integer(c_int), value :: status
    end subroutine c_exit
  end interface

contains

  !> Options from the command line: -f TEXT runs the tests with TEXT in their name, -v names them.
  subroutine new_runner(runner)
    type(runner_t), intent(out) :: runner
    integer :: i

    runner%filter = ""
    i = 1
    do while (i <= command_argument_count())
      select case (argument(i))
      case ("-f", "--filter")
        i = i + 1
        runner%filter = argument(i)
      case ("-v", "--verbose")
        runner%is_verbose = .true.
      case default
        write (error_unit, "(a)") "usage: [-v] [-f TEXT]"
        call c_exit(2_c_int)
      end select
      i = i + 1
    end do
  end subroutine new_runner

  !> Run one test between what its module does before and after each of them.
  subroutine run_test(runner, suite, name, test, before, after)
    type(runner_t), intent(inout) :: runner
    character(*), intent(in) :: suite, name
    procedure(step) :: test
    procedure(step), optional :: before, after
    integer :: i

    if (index(suite//"."//name, runner%filter) == 0) return
    if (runner%is_verbose) then
      write (output_unit, "(a)") suite//"."//name
      flush (output_unit)
    end if
    call clear_failures()
    if (present(before)) call before()
    if (.not. anyExceptions()) call test()
    if (present(after)) call after()
    runner%n_run = runner%n_run + 1
    if (.not. anyExceptions()) return
    runner%n_failed = runner%n_failed + 1
    do i = 1, size(failures)
      write (output_unit, "(a)") location_text(i)//"failed: "//suite//"."//name//": " &
        //failures(i)%message
    end do
    flush (output_unit)
  end subroutine run_test

  !> Count a test that is switched off.
  subroutine skip_test(runner, suite, name)
    type(runner_t), intent(inout) :: runner
    character(*), intent(in) :: suite, name

    if (index(suite//"."//name, runner%filter) == 0) return
    runner%n_disabled = runner%n_disabled + 1
    write (output_unit, "(a)") "disabled: "//suite//"."//name
  end subroutine skip_test

  !> Say what came out, and end the program with an error if a test failed or none ran.
  subroutine finish(runner)
    type(runner_t), intent(in) :: runner

    write (output_unit, "(4(i0, a))") runner%n_run - runner%n_failed, " passed, ", &
      runner%n_failed, " failed, ", runner%n_disabled, " disabled"
    flush (output_unit)
    if (runner%n_run == 0) then
      write (output_unit, "(a)") "no test ran"
      flush (output_unit)
      call c_exit(1_c_int)
    end if
    if (runner%n_failed > 0) call c_exit(1_c_int)
  end subroutine finish

  function location_text(i) result(text)
    integer, intent(in) :: i
    character(:), allocatable :: text
    character(12) :: line

    text = ""
    if (.not. allocated(failures(i)%location%file_name)) return
    write (line, "(i0)") failures(i)%location%line
    text = failures(i)%location%file_name//":"//trim(line)//": "
  end function location_text

  function argument(i)
    integer, intent(in) :: i
    character(:), allocatable :: argument
    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(length) :: argument)
    call get_command_argument(i, argument)
  end function argument

end module funit_runner
