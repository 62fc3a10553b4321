!> What the machine can do at most: multiply-adds in registers, and bandwidth of the triad
!! a = b + s c for working sets of several sizes. Both are measured beside the rest.
!!
!! The triad is that of J. D. McCalpin's STREAM; 24 bytes an element are counted, not the read that
!! many processors do before they write.
module machine_bound
  use kinds, only: wp
  use text, only: to_text
  use bench_record, only: record_t, keep_least
  use bench_case, only: seconds_now
  implicit none
  private

  public :: measure_machine

  integer, parameter :: n_sizes = 6
  !> Working sets of the triad [byte].
  real(wp), parameter :: sizes(n_sizes) = [2.0e5_wp, 8.0e5_wp, 3.2e6_wp, 1.28e7_wp, 5.12e7_wp, &
                                           2.048e8_wp]
  integer, parameter :: n_values = 4096     !! numbers worked on in one pass of the multiply-adds
  integer, parameter :: chain = 16          !! multiply-adds on each of them

contains

  !> Measure a number of threads; records `machine/multiply_add` (per operation) and
  !! `machine/triad/<kB>` (per byte) are added. Of several rounds the best counts.
  subroutine measure_machine(threads, repetitions, records)
    integer, intent(in) :: threads, repetitions
    type(record_t), allocatable, intent(inout) :: records(:)
    real(wp) :: seconds(repetitions), work
    integer :: i

    call time_multiply_adds(threads, seconds, work)
    call note("machine/multiply_add", threads, "operation", seconds, work, records)
    do i = 1, n_sizes
      call time_triad(threads, nint(sizes(i)/24.0_wp), seconds, work)
      call note("machine/triad/"//to_text(nint(sizes(i)/1.0e3_wp)), threads, "byte", seconds, &
                work, records)
    end do
  end subroutine measure_machine

  subroutine note(name, threads, per, seconds, work, records)
    character(*), intent(in) :: name, per
    integer, intent(in) :: threads
    real(wp), intent(in) :: seconds(:), work
    type(record_t), allocatable, intent(inout) :: records(:)
    type(record_t) :: record

    record%name = name
    record%per = per
    record%threads = threads
    record%repetitions = size(seconds)
    record%ns = 1.0e9_wp*minval(seconds)/work
    record%median = 1.0e9_wp*sum(seconds)/size(seconds)/work
    record%spread = max(0.0_wp, record%median/record%ns - 1.0_wp)
    call keep_least(records, record)
  end subroutine note

  !> Chains of multiply-adds on numbers in the first cache, each thread on its own.
  subroutine time_multiply_adds(threads, seconds, work)
    integer, intent(in) :: threads
    real(wp), intent(out) :: seconds(:)
    real(wp), intent(out) :: work        !! operations of one repetition
    integer, parameter :: n_passes = 400
    real(wp) :: values(n_values, threads), started
    integer :: i, t, pass

    values = 1.0_wp
    work = 2.0_wp*chain*n_values*real(n_passes, wp)*threads
    ! The first round warms up; the next one writes over its time.
    do i = 0, size(seconds)
      started = seconds_now(threads == 1)
      !$omp parallel do num_threads(threads) schedule(static) private(pass)
      do t = 1, threads
        do pass = 1, n_passes
          call multiply_add(values(:, t))
        end do
      end do
      !$omp end parallel do
      seconds(max(i, 1)) = seconds_now(threads == 1) - started
    end do
    ! A half is the fixed point of the map; a compiler that dropped the work would not get there.
    if (abs(values(1, 1) - 0.5_wp) > 1.0e-9_wp) work = 0.0_wp
  end subroutine time_multiply_adds

  !> `chain` multiply-adds on each value, the values side by side.
  pure subroutine multiply_add(values)
    real(wp), intent(inout) :: values(n_values)
    real(wp) :: x
    integer :: i, k

    !$omp simd private(x, k)
    do i = 1, n_values
      x = values(i)
      do k = 1, chain
        x = 0.5_wp*x + 0.25_wp
      end do
      values(i) = x
    end do
  end subroutine multiply_add

  !> The triad, with passes enough for the clock.
  subroutine time_triad(threads, n, seconds, work)
    integer, intent(in) :: threads, n
    real(wp), intent(out) :: seconds(:)
    real(wp), intent(out) :: work        !! bytes of one repetition
    real(wp), allocatable :: a(:), b(:), c(:)
    real(wp) :: started
    integer :: i, t, pass, n_passes, share

    n_passes = max(1, nint(4.0e6_wp/n))
    share = n/threads
    allocate (a(share*threads), b(share*threads), c(share*threads))
    ! Each thread touches its own share first, and passes over it without waiting for the others.
    !$omp parallel do num_threads(threads) schedule(static)
    do t = 1, threads
      a(1 + share*(t - 1):share*t) = 0.0_wp
      b(1 + share*(t - 1):share*t) = 1.0_wp
      c(1 + share*(t - 1):share*t) = 2.0_wp
    end do
    !$omp end parallel do
    work = 24.0_wp*share*threads*n_passes
    do i = 0, size(seconds)
      started = seconds_now(threads == 1)
      !$omp parallel do num_threads(threads) schedule(static) private(pass)
      do t = 1, threads
        do pass = 1, n_passes
          call triad(share, 1.0_wp/pass, b(1 + share*(t - 1)), c(1 + share*(t - 1)), &
                     a(1 + share*(t - 1)))
        end do
      end do
      !$omp end parallel do
      seconds(max(i, 1)) = seconds_now(threads == 1) - started
    end do
    if (.not. minval(a) > 0.0_wp) work = 0.0_wp
  end subroutine time_triad

  pure subroutine triad(n, factor, b, c, a)
    integer, intent(in) :: n
    real(wp), intent(in) :: factor, b(n), c(n)
    real(wp), intent(out) :: a(n)
    integer :: l

    !$omp simd
    do l = 1, n
      a(l) = b(l) + factor*c(l)
    end do
  end subroutine triad

end module machine_bound
