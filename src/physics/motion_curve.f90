!> A value against time: linear or smooth between the rows of a table, constant outside; and its
!! integral.
module motion_curve
  use kinds, only: wp
  implicit none
  private

  public :: curve_t, constant_curve, curve_value, curve_integral, start_curve

  !> Table of a curve, times strictly rising. One row is a constant.
  type :: curve_t
    real(wp), allocatable :: times(:), values(:)
    real(wp) :: start = 0.0_wp        !! time of the run at which the clock of the curve is at 0
    logical :: is_total = .false.     !! its clock is that of the run
    logical :: is_smooth = .false.    !! between rows a quintic that is level at both of them
  end type curve_t

contains

  !> The curve that is `value` at all times.
  pure function constant_curve(value) result(curve)
    real(wp), intent(in) :: value
    type(curve_t) :: curve

    allocate (curve%times(1), source=0.0_wp)
    allocate (curve%values(1), source=value)
  end function constant_curve

  !> Set the clock of a curve in step time to 0 at the start of its step.
  elemental subroutine start_curve(curve, time)
    type(curve_t), intent(inout) :: curve
    real(wp), intent(in) :: time          !! of the run

    if (.not. curve%is_total) curve%start = time
  end subroutine start_curve

  !> Value at a time of the run.
  pure real(wp) function curve_value(curve, time) result(value)
    type(curve_t), intent(in) :: curve
    real(wp), intent(in) :: time

    value = value_on_clock(curve, time - curve%start)
  end function curve_value

  pure real(wp) function value_on_clock(curve, time) result(value)
    type(curve_t), intent(in) :: curve
    real(wp), intent(in) :: time
    integer :: row, n
    real(wp) :: share

    n = size(curve%times)
    row = count(curve%times <= time)
    if (row == 0) then
      value = curve%values(1)
    else if (row == n) then
      value = curve%values(n)
    else
      share = (time - curve%times(row))/(curve%times(row + 1) - curve%times(row))
      if (curve%is_smooth) share = share**3*(10.0_wp - share*(15.0_wp - 6.0_wp*share))
      value = (1.0_wp - share)*curve%values(row) + share*curve%values(row + 1)
    end if
  end function value_on_clock

  !> Integral from the start of the curve's clock to `time` of the run, exact.
  pure real(wp) function curve_integral(curve, time) result(total)
    type(curve_t), intent(in) :: curve
    real(wp), intent(in) :: time
    real(wp) :: low, high
    integer :: row, n

    n = size(curve%times)
    total = 0.0_wp
    low = 0.0_wp
    do row = 1, n + 1
      high = time - curve%start
      if (row <= n) high = min(high, curve%times(row))
      if (high <= low) cycle
      if (curve%is_smooth .and. row > 1 .and. row <= n) then
        total = total + smooth_integral(curve, row - 1, high) - smooth_integral(curve, row - 1, low)
      else
        total = total + 0.5_wp*(high - low)*(value_on_clock(curve, low) &
                                             + value_on_clock(curve, high))
      end if
      low = high
    end do
  end function curve_integral

  !> Integral of the quintic behind a row, from that row to a time before the next one.
  pure real(wp) function smooth_integral(curve, row, time) result(total)
    type(curve_t), intent(in) :: curve
    integer, intent(in) :: row
    real(wp), intent(in) :: time
    real(wp) :: share

    associate (t => curve%times(row:row + 1), v => curve%values(row:row + 1))
      share = (time - t(1))/(t(2) - t(1))
      total = (t(2) - t(1))*(v(1)*share + (v(2) - v(1))*share**4 &
                             *(2.5_wp - share*(3.0_wp - share)))
    end associate
  end function smooth_integral

end module motion_curve
