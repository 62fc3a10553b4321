!> Time a case: repetitions from the same state, least and median of them.
module sampling
  use omp_lib, only: omp_set_num_threads
  use kinds, only: wp
  use failure, only: error_t
  use bench_clock, only: seconds_now
  use bench_case, only: bench_case_t
  use bench_record, only: record_t
  implicit none
  private

  public :: sampling_t, measure

  integer, parameter :: most = 400   !! repetitions

  !> How long to measure, in each of several rounds.
  type :: sampling_t
    integer :: n_rounds = 1
    real(wp) :: seconds = 1.0_wp     !! of timed work for one case, all rounds
    integer :: least = 7             !! repetitions, even if that takes longer
  end type sampling_t

contains

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
    real(wp) :: sorted(size(values)), value
    integer :: i, j

    sorted = values
    do i = 2, size(sorted)
      value = sorted(i)
      do j = i - 1, 1, -1
        if (sorted(j) <= value) exit
        sorted(j + 1) = sorted(j)
      end do
      sorted(j + 1) = value
    end do
    median = 0.5_wp*(sorted((size(sorted) + 1)/2) + sorted(size(sorted)/2 + 1))
  end function median_of

end module sampling
