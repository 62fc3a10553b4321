!> What can be measured, a piece of the solver's work with what it costs by count, and how it is
!! timed: repetitions from the same state, least and median of them.
module bench_case
  use omp_lib, only: omp_set_num_threads
  use kinds, only: wp
  use failure, only: error_t
  use linear_algebra, only: sorted_order
  use timer, only: clock_ticks, ticks_to_seconds
  use bench_record, only: record_t, is_quiet
  implicit none
  private

  public :: sampling_t, measure_until_quiet, seconds_now

  integer, parameter :: most = 400   !! repetitions
  integer, parameter, public :: most_measurements = 5   !! with several threads

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

  !> How long to measure, in each of several rounds.
  type :: sampling_t
    integer :: n_rounds = 1
    real(wp) :: seconds = 1.0_wp     !! of timed work for one case, all rounds
    integer :: least = 7             !! repetitions, even if that takes longer
  end type sampling_t

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

  !> Measure a prepared case; with several threads again while the spread is large, for wall time
  !! counts there, which other programs lengthen. The measurement with the least spread counts.
  subroutine measure_until_quiet(plan, item, threads, record, error)
    type(sampling_t), intent(in) :: plan
    class(bench_case_t), intent(inout) :: item
    integer, intent(in) :: threads
    type(record_t), intent(out) :: record
    type(error_t), allocatable, intent(out) :: error
    type(record_t) :: next
    integer :: i

    do i = 1, most_measurements
      call measure(plan, item, threads, next, error)
      if (allocated(error)) return
      if (i == 1 .or. next%spread < record%spread) record = next
      if (is_quiet(record)) exit
    end do
  end subroutine measure_until_quiet

  !> Measure a prepared case on a number of threads. The first call, which warms the caches, does
  !! not count. Fails where the case's own check fails.
  subroutine measure(plan, item, threads, record, error)
    type(sampling_t), intent(in) :: plan
    class(bench_case_t), intent(inout) :: item
    integer, intent(in) :: threads
    type(record_t), intent(out) :: record
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: times(most), total, started
    logical :: is_processor
    integer :: n, n_most

    n_most = min(most, (item%most_repetitions - 1)/plan%n_rounds + 1)
    is_processor = threads == 1 .and. .not. item%is_by_the_wall
    call omp_set_num_threads(threads)
    call item%restore()
    call item%run()
    total = 0.0_wp
    do n = 1, n_most
      call item%restore()
      started = seconds_now(is_processor)
      call item%run()
      times(n) = seconds_now(is_processor) - started
      total = total + times(n)
      if (n >= plan%least .and. total >= plan%seconds/plan%n_rounds) exit
    end do
    call item%check(error)
    if (allocated(error)) return
    call summarise(times(:min(n, n_most)), item, threads, record)
  end subroutine measure

  !> Nanoseconds a unit from the seconds of all repetitions.
  subroutine summarise(seconds, item, threads, record)
    real(wp), intent(in) :: seconds(:)
    class(bench_case_t), intent(in) :: item
    integer, intent(in) :: threads
    type(record_t), intent(out) :: record

    record%name = item%name
    record%per = item%per
    record%threads = threads
    record%repetitions = size(seconds)
    record%ns = 1.0e9_wp*minval(seconds)/item%n_units
    record%median = 1.0e9_wp*median_of(seconds)/item%n_units
    record%spread = record%median/record%ns - 1.0_wp
    if (item%n_points > 0) record%ns_per_point = record%ns/item%n_points
    if (item%flops > 0.0_wp) record%flops = item%flops
    if (item%bytes > 0.0_wp) record%bytes = item%bytes
    if (item%memory_ratio > 0.0_wp) record%memory_ratio = item%memory_ratio
    if (item%working_set > 0.0_wp) record%working_set = item%working_set
  end subroutine summarise

  pure real(wp) function median_of(values) result(median)
    real(wp), intent(in) :: values(:)
    real(wp) :: sorted(size(values))

    sorted = values(sorted_order(values))
    median = 0.5_wp*(sorted((size(sorted) + 1)/2) + sorted(size(sorted)/2 + 1))
  end function median_of

  !> Seconds since some moment: of the processor for one thread, which other programs on the machine
  !! do not lengthen, else of the wall.
  real(wp) function seconds_now(is_processor)
    logical, intent(in) :: is_processor

    if (is_processor) then
      call cpu_time(seconds_now)
    else
      seconds_now = ticks_to_seconds(clock_ticks())
    end if
  end function seconds_now

end module bench_case
