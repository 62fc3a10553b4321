!> The clock of the benchmark.
module bench_clock
  use kinds, only: wp
  use timer, only: clock_ticks, ticks_to_seconds
  implicit none
  private

  public :: seconds_now

contains

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

end module bench_clock
