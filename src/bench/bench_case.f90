!> What can be measured: a piece of the solver's work, with what it costs by count.
module bench_case
  use kinds, only: wp
  use failure, only: error_t
  implicit none
  private

  !> One measurement. A case is light until `prepare` has built what it works on.
  type, abstract, public :: bench_case_t
    character(:), allocatable :: name      !! such as force/p2/2x2x3/voce/plain/default
    character(:), allocatable :: per       !! what times are given for, such as element-step
    real(wp) :: n_units = 0.0_wp           !! of these in one call of `run`
    integer :: n_points = 0                !! integration points a unit holds, 0: no such thing
    real(wp) :: flops = 0.0_wp             !! operations a unit by formula, 0: not counted
    real(wp) :: bytes = 0.0_wp             !! moved to and from memory a unit, 0: not counted
    real(wp) :: working_set = 0.0_wp       !! what a call of `run` touches [byte]
    real(wp) :: memory_ratio = 0.0_wp      !! memory held over that of the state, 0: not counted
    integer :: most_repetitions = 400      !! fewer where one takes long
    logical :: is_by_the_wall = .false.    !! timed by the wall clock on one thread too
    logical :: is_serial = .false.         !! one thread is all it can use
    logical :: is_long = .false.           !! left out by --quick
  contains
    procedure(prepare_case), deferred :: prepare
    procedure(run_case), deferred :: run
    procedure :: restore => restore_nothing
    procedure :: check => check_nothing
  end type bench_case_t

  !> A case in a list of mixed kinds.
  type, public :: case_slot_t
    class(bench_case_t), allocatable :: item
  end type case_slot_t

  abstract interface
    !> Build all that `run` needs; an error says why this case cannot be measured here.
    subroutine prepare_case(self, error)
      import :: bench_case_t, error_t
      class(bench_case_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
    end subroutine prepare_case

    !> The work that is timed.
    subroutine run_case(self)
      import :: bench_case_t
      class(bench_case_t), intent(inout) :: self
    end subroutine run_case
  end interface

contains

  !> Go back to the state before `run`, untimed, so that each repetition does the same work.
  subroutine restore_nothing(self)
    class(bench_case_t), intent(inout) :: self

    self%n_units = max(self%n_units, 0.0_wp)
  end subroutine restore_nothing

  !> After the last repetition: was the work that which the name says?
  subroutine check_nothing(self, error)
    class(bench_case_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error

    if (.not. self%n_units > 0.0_wp) then
      allocate (error)
      error%message = self%name//": no work was done"
    end if
  end subroutine check_nothing

end module bench_case
