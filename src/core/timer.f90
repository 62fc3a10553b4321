!> Named stopwatches: wall-clock seconds and calls of each effect of a run.
module timer
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  implicit none
  private

  public :: stopwatch_t, timer_t, add_watch, start_watch, stop_watch, watch_seconds, n_watches
  public :: clock_ticks, ticks_to_seconds, set_time

  !> One stopwatch; it may be started and stopped any number of times.
  type :: stopwatch_t
    character(:), allocatable :: name
    integer(int64) :: ticks = 0      !! sum over all finished calls [clock ticks]
    integer(int64) :: started = 0    !! clock at the last start [clock ticks]
    integer(int64) :: n_calls = 0    !! finished calls
  end type stopwatch_t

  !> The stopwatches of a run, in the order in which they were added.
  type :: timer_t
    type(stopwatch_t), allocatable :: watches(:)
  end type timer_t

contains

  !> Index of the stopwatch of this name; a new name adds one.
  subroutine add_watch(timer, name, watch)
    type(timer_t), intent(inout) :: timer
    character(*), intent(in) :: name
    integer, intent(out) :: watch
    type(stopwatch_t) :: new

    if (.not. allocated(timer%watches)) allocate (timer%watches(0))
    do watch = 1, size(timer%watches)
      if (timer%watches(watch)%name == name) return
    end do
    new%name = name
    timer%watches = [timer%watches, new]
  end subroutine add_watch

  !> Number of stopwatches.
  pure integer function n_watches(timer)
    type(timer_t), intent(in) :: timer

    n_watches = 0
    if (allocated(timer%watches)) n_watches = size(timer%watches)
  end function n_watches

  !> Start a stopwatch (index from `add_watch`).
  subroutine start_watch(timer, watch)
    type(timer_t), intent(inout) :: timer
    integer, intent(in) :: watch

    timer%watches(watch)%started = clock_ticks()
  end subroutine start_watch

  !> Stop a stopwatch and count the call.
  subroutine stop_watch(timer, watch)
    type(timer_t), intent(inout) :: timer
    integer, intent(in) :: watch

    associate (w => timer%watches(watch))
      w%ticks = w%ticks + clock_ticks() - w%started
      w%n_calls = w%n_calls + 1
    end associate
  end subroutine stop_watch

  !> Go on from what was measured before.
  subroutine set_time(watch, seconds, n_calls)
    type(stopwatch_t), intent(inout) :: watch
    real(wp), intent(in) :: seconds
    integer(int64), intent(in) :: n_calls
    integer(int64) :: rate

    call system_clock(count_rate=rate)
    watch%ticks = nint(seconds*real(rate, wp), int64)
    watch%n_calls = n_calls
  end subroutine set_time

  !> Wall-clock time of all finished calls [s].
  real(wp) function watch_seconds(timer, watch)
    type(timer_t), intent(in) :: timer
    integer, intent(in) :: watch

    watch_seconds = ticks_to_seconds(timer%watches(watch)%ticks)
  end function watch_seconds

  !> The wall clock, in ticks that `ticks_to_seconds` understands.
  integer(int64) function clock_ticks()
    call system_clock(count=clock_ticks)
  end function clock_ticks

  !> Length of a number of clock ticks [s].
  real(wp) function ticks_to_seconds(ticks)
    integer(int64), intent(in) :: ticks
    integer(int64) :: rate

    call system_clock(count_rate=rate)
    ticks_to_seconds = real(ticks, wp)/real(rate, wp)
  end function ticks_to_seconds

end module timer
