!> igaform_bench-mpi: what an exchange between processes costs. `halo`: each sends so many bytes to
!! both neighbours and receives as many from each; `gather`: all have so many bytes of each.
program mpi_bench
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use text, only: to_text, rounded_text
  use timer, only: clock_ticks, ticks_to_seconds
  use parcel, only: parcel_t, empty_parcel, pass_values
  use bench_record, only: record_t, heading, record_line
  use ranks, only: is_first
  use mpi_ranks, only: mpi_ranks_t, begin_mpi, end_mpi
  implicit none

  integer, parameter :: sizes(6) = [1, 10, 100, 1000, 10000, 100000]   ! numbers of eight bytes
  integer, parameter :: n_rounds = 15
  real(wp), parameter :: round_seconds = 0.02_wp
  type(mpi_ranks_t) :: ranks
  real(wp) :: ns(size(sizes))
  integer :: kind, i

  call begin_mpi(ranks)
  if (is_first(ranks)) print "(a)", heading()
  do kind = 1, 2
    do i = 1, size(sizes)
      call measure(kind, sizes(i), ns(i))
    end do
    if (is_first(ranks)) print "(a)", "  "//trim(merge("halo  ", "gather", kind == 1))// &
      ": latency "//rounded_text(1.0e-3_wp*ns(1))//" us, rate "//rounded_text(8.0_wp*(sizes(6) &
      - sizes(5))/(ns(6) - ns(5)))//" GB/s"
  end do
  call end_mpi()

contains

  !> The least and the median of some rounds, as a record.
  subroutine measure(kind, n, least)
    integer, intent(in) :: kind, n
    real(wp), intent(out) :: least         !! [ns]
    type(record_t) :: record
    real(wp) :: times(n_rounds)
    integer :: round, n_calls

    n_calls = 1
    do
      if (seconds_of(kind, n, n_calls) > round_seconds .or. n_calls > 1000000) exit
      n_calls = 2*n_calls
    end do
    do round = 1, n_rounds
      times(round) = 1.0e9_wp*seconds_of(kind, n, n_calls)/n_calls
    end do
    least = minval(times)
    record%name = "mpi/"//trim(merge("halo  ", "gather", kind == 1))//"/"//to_text(8*n)//"B"
    record%threads = ranks%n
    record%ns = least
    record%median = median_of(times)
    record%spread = record%median/least - 1.0_wp
    record%repetitions = n_rounds
    record%per = "exchange of "//to_text(ranks%n)//" processes"
    if (is_first(ranks)) print "(a)", record_line(record)
  end subroutine measure

  pure real(wp) function median_of(times)
    real(wp), intent(in) :: times(n_rounds)
    integer :: i

    median_of = 0.0_wp
    do i = 1, n_rounds
      if (2*count(times < times(i)) < n_rounds .and. 2*count(times <= times(i)) > n_rounds) &
        median_of = times(i)
    end do
  end function median_of

  !> Time of the slowest process for so many exchanges [s].
  real(wp) function seconds_of(kind, n, n_calls) result(seconds)
    integer, intent(in) :: kind, n, n_calls
    type(parcel_t) :: sent(2), received(2)
    real(wp), allocatable :: own(:), joined(:)
    real(wp) :: each(ranks%n)
    integer, allocatable :: partners(:)
    integer(int64) :: start
    integer :: i

    partners = pack([ranks%number - 1, ranks%number + 1], [ranks%number > 0, &
                                                           ranks%number < ranks%n - 1])
    allocate (own(n), joined(n*ranks%n), source=1.0_wp)
    do i = 1, size(partners)
      call empty_parcel(sent(i), 0)
      call pass_values(sent(i), .true., n, own)
    end do
    call ranks%wait()
    start = clock_ticks()
    do i = 1, n_calls
      if (kind == 1) call ranks%pass(partners, sent, received)
      if (kind == 2) call ranks%gather(spread(n, 1, ranks%n), own, joined, .true.)
    end do
    seconds = ticks_to_seconds(clock_ticks() - start)
    call ranks%gather(spread(1, 1, ranks%n), [seconds], each, .true.)
    seconds = maxval(each)
  end function seconds_of
end program mpi_bench
