!> The flow stress of a point: hardening times the factor of the plastic strain rate.
!!
!! Rate factors: G. R. Cowper and P. S. Symonds, Brown University TR 28 (1957),
!! 1 + (rate/D)^(1/p); G. R. Johnson and W. H. Cook, Proc. 7th Int. Symp. Ballistics (1983),
!! 1 + C ln(rate/reference), 1 below the reference rate.
module flow_curve
  use kinds, only: wp
  use failure, only: error_t, fail
  use hardening, only: hardening_t, harden, is_steep_at_start
  use heating, only: heating_t
  implicit none
  private

  public :: set_rate_factor, flow_after, is_steep

  integer, parameter :: no_rate = 0, cowper_symonds = 1, johnson_cook = 2

  !> Hardening, rate factor and heating, which adds a last state variable, the temperature rise.
  type, public :: flow_curve_t
    type(hardening_t) :: hardening
    integer :: rate_kind = no_rate
    real(wp) :: rate_constants(2) = 0.0_wp   !! D [1/time], p, or C, reference rate [1/time]
    type(heating_t) :: heating
  end type flow_curve_t

contains

  !> Give the curve a rate factor: COWPER SYMONDS (D, p) or JOHNSON COOK (C, reference rate).
  pure subroutine set_rate_factor(name, constants, curve, error)
    character(*), intent(in) :: name
    real(wp), intent(in) :: constants(:)
    type(flow_curve_t), intent(inout) :: curve
    type(error_t), allocatable, intent(out) :: error

    if (size(constants) /= 2) then
      call fail(error, "material: the rate factor "//trim(name)//" takes two constants")
      return
    else if (.not. all(abs(constants) <= huge(1.0_wp))) then
      call fail(error, "material: the constants of the rate factor must be finite numbers")
      return
    end if
    curve%rate_constants = constants
    select case (name)
    case ("COWPER SYMONDS")
      curve%rate_kind = cowper_symonds
      if (constants(1) <= 0.0_wp .or. constants(2) <= 0.0_wp) then
        call fail(error, "material: D and p of Cowper-Symonds must be positive")
      end if
    case ("JOHNSON COOK")
      curve%rate_kind = johnson_cook
      if (constants(1) < 0.0_wp) then
        call fail(error, "material: C of Johnson-Cook must not be negative: faster would be "// &
                  "softer, and the strain would gather in one element")
      else if (constants(2) <= 0.0_wp) then
        call fail(error, "material: the reference rate of Johnson-Cook must be positive")
      end if
    case default
      call fail(error, "material: unknown rate factor "//trim(name)// &
                ", known are COWPER SYMONDS and JOHNSON COOK")
    end select
  end subroutine set_rate_factor

  !> Is the slope infinite where plastic flow begins? A Newton step from there goes nowhere.
  elemental logical function is_steep(curve)
    type(flow_curve_t), intent(in) :: curve

    is_steep = is_steep_at_start(curve%hardening) &
               .or. (curve%rate_kind == cowper_symonds .and. curve%rate_constants(2) > 1.0_wp)
  end function is_steep

  !> Flow stress after the plastic strain `dgamma` of one increment of length `dt`, and its
  !! slope against `dgamma`, for a row of points. It never falls with `dgamma`.
  pure subroutine flow_after(curve, n, dt, eqps, factor, dgamma, flow, slope)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: dt                   !! [time]
    real(wp), intent(in) :: eqps(n)              !! plastic strain before the increment
    real(wp), intent(in) :: factor(n)            !! on the flow stress, 1 at the first temperature
    real(wp), intent(in) :: dgamma(n)            !! >= 0
    real(wp), intent(out) :: flow(n), slope(n)   !! [stress]
    real(wp), parameter :: least = 1.0e-200_wp   ! of a rate, so that its power has a slope
    real(wp) :: rate, by_rate, by_rate_slope
    integer :: l

    call harden(curve%hardening, n, eqps + dgamma, flow, slope)
    do l = 1, n
      by_rate = 1.0_wp
      by_rate_slope = 0.0_wp
      rate = max(dgamma(l)/max(dt, tiny(dt)), least)
      select case (curve%rate_kind)
      case (cowper_symonds)
        associate (d => curve%rate_constants(1), p => curve%rate_constants(2))
          by_rate = 1.0_wp + (rate/d)**(1.0_wp/p)
          by_rate_slope = (by_rate - 1.0_wp)/(p*rate*max(dt, tiny(dt)))
        end associate
      case (johnson_cook)
        associate (c => curve%rate_constants(1), reference => curve%rate_constants(2))
          if (rate > reference) then
            by_rate = 1.0_wp + c*log(rate/reference)
            by_rate_slope = c/dgamma(l)
          end if
        end associate
      end select
      slope(l) = factor(l)*(by_rate*slope(l) + by_rate_slope*flow(l))
      flow(l) = factor(l)*by_rate*flow(l)
    end do
  end subroutine flow_after

end module flow_curve
