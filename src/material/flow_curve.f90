!> The flow stress of a point: hardening times the factor of the plastic strain rate, and adiabatic
!! heating by plastic work with the softening that it brings.
!!
!! Rate factors: G. R. Cowper and P. S. Symonds, Brown University TR 28 (1957),
!! 1 + (rate/D)^(1/p); G. R. Johnson and W. H. Cook, Proc. 7th Int. Symp. Ballistics (1983),
!! 1 + C ln(rate/reference), 1 below the reference rate. Or curves at several rates, `rate_curves`.
!!
!! Fraction of the work that becomes heat: G. I. Taylor and H. Quinney, Proc. R. Soc. A 143 (1934).
!! Softening: G. R. Johnson and W. H. Cook as above, 1 - ((T - T_ref)/(T_melt - T_ref))^m. The
!! temperature in an increment is that at its start.
module flow_curve
  use kinds, only: wp
  use failure, only: error_t, fail
  use constant_check, only: check_finite, check_count, require
  use hardening, only: hardening_t, harden, harden_after, is_steep_at_start
  use law_spec, only: rate_curve_spec_t
  use rate_curves, only: rate_curves_t, new_rate_curves, raise_by_rate
  use row_functions, only: log_row, log_near, power_row, power_near, near_part, power_small, &
                           small_part
  implicit none
  private

  public :: set_rate_factor, set_rate_curves, flow_at, flow_after, is_steep, is_rough, has_rate, &
            has_corners, lowest_flow
  public :: set_heating, thermal_factor, heat_up

  !> Constants of the heating; nothing happens unless it is active.
  type, public :: heating_t
    logical :: is_active = .false.
    real(wp) :: per_work = 0.0_wp    !! temperature rise by plastic work per volume
    real(wp) :: start = 0.0_wp       !! temperature at the start
    real(wp) :: reference = 0.0_wp   !! temperature of the hardening curve
    real(wp) :: melting = 0.0_wp     !! temperature without strength
    real(wp) :: exponent = 1.0_wp    !! m
  end type heating_t

  real(wp), parameter :: least_factor = 1.0e-3_wp   !! of the strength that is left at melting
  real(wp), parameter :: least = 1.0e-100_wp   ! strain and rate, so that all have a logarithm
  integer, parameter :: no_rate = 0, cowper_symonds = 1, johnson_cook = 2, table_of_rates = 3

  !> Hardening, rate factor and heating, which adds a last state variable, the temperature rise.
  type, public :: flow_curve_t
    type(hardening_t) :: hardening
    integer :: rate_kind = no_rate
    real(wp) :: rate_constants(2) = 0.0_wp   !! D [1/time], p, or C, reference rate [1/time]
    type(rate_curves_t) :: rate_curves       !! of a table of rates
    type(heating_t) :: heating
  end type flow_curve_t

contains

  !> Give the curve a rate factor: COWPER SYMONDS (D, p) or JOHNSON COOK (C, reference rate).
  pure subroutine set_rate_factor(name, constants, curve, error)
    character(*), intent(in) :: name
    real(wp), intent(in) :: constants(:)
    type(flow_curve_t), intent(inout) :: curve
    type(error_t), allocatable, intent(out) :: error

    call check_count("the rate factor "//name, constants, 2, "two constants", error)
    call check_finite("constants of the rate factor", constants, error)
    if (allocated(error)) return
    curve%rate_constants = constants
    select case (name)
    case ("COWPER SYMONDS")
      curve%rate_kind = cowper_symonds
      call require(all(constants > 0.0_wp), &
                   "material: D and p of Cowper-Symonds must be positive", error)
    case ("JOHNSON COOK")
      curve%rate_kind = johnson_cook
      call require(constants(1) >= 0.0_wp, &
                   "material: C of Johnson-Cook must not be negative: faster would be "// &
                   "softer, and the strain would localize in one element", error)
      call require(constants(2) > 0.0_wp, &
                   "material: the reference rate of Johnson-Cook must be positive", error)
    case default
      call fail(error, "material: unknown rate factor "//trim(name)// &
                ", known are COWPER SYMONDS and JOHNSON COOK")
    end select
  end subroutine set_rate_factor

  !> Let the flow stress follow curves at several rates, the first of which is its hardening.
  pure subroutine set_rate_curves(specs, is_logarithmic, curve, error)
    type(rate_curve_spec_t), intent(in) :: specs(:)
    logical, intent(in) :: is_logarithmic             !! see `rate_curves_t`
    type(flow_curve_t), intent(inout) :: curve
    type(error_t), allocatable, intent(out) :: error

    curve%rate_kind = table_of_rates
    call new_rate_curves(specs, is_logarithmic, curve%hardening, curve%rate_curves, error)
  end subroutine set_rate_curves

  !> Is the slope infinite where plastic flow begins? A Newton step from there goes nowhere, as it
  !! does where the slope leaps between two rates that are close.
  elemental logical function is_steep(curve)
    type(flow_curve_t), intent(in) :: curve

    is_steep = is_steep_at_start(curve%hardening) .or. curve%rate_kind == table_of_rates &
               .or. (curve%rate_kind == cowper_symonds .and. curve%rate_constants(2) > 1.0_wp)
  end function is_steep

  !> Does the slope of the flow stress jump, or has it no bound? Then no square of a small step
  !! bounds what is left.
  elemental logical function is_rough(curve)
    type(flow_curve_t), intent(in) :: curve

    is_rough = is_steep(curve) .or. has_rate(curve) .or. allocated(curve%hardening%strains)
  end function is_rough

  !> Does the slope of the flow stress jump somewhere: between the points of a table, or at a
  !! reference rate?
  elemental logical function has_corners(curve)
    type(flow_curve_t), intent(in) :: curve

    has_corners = allocated(curve%hardening%strains) .or. curve%rate_kind == johnson_cook
  end function has_corners

  !> Does the flow stress depend on the plastic strain rate?
  elemental logical function has_rate(curve)
    type(flow_curve_t), intent(in) :: curve

    has_rate = curve%rate_kind /= no_rate
  end function has_rate

  !> A stress below which no point flows: with heating the least that is left of the first yield
  !! stress.
  pure real(wp) function lowest_flow(curve)
    type(flow_curve_t), intent(in) :: curve
    real(wp), dimension(1) :: flow, slope, bend, reach

    call harden(curve%hardening, 1, [0.0_wp], flow, slope, bend, reach)
    lowest_flow = flow(1)
    if (curve%heating%is_active) lowest_flow = least_factor*flow(1)
  end function lowest_flow

  !> Flow stress of a row without plastic strain rate, its slope and bend, see `harden`.
  pure subroutine flow_at(curve, n, eqps, factor, flow, slope, bend, reach)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n)
    real(wp), intent(in) :: factor(n)            !! on the flow stress, 1 at the first temperature
    real(wp), intent(out), dimension(n) :: flow, slope, bend, reach

    call harden(curve%hardening, n, eqps, flow, slope, bend, reach)
    if (curve%heating%is_active) call soften(n, factor, flow, slope, bend)
  end subroutine flow_at

  !> Multiply by the factor of the temperature.
  pure subroutine soften(n, factor, flow, slope, bend)
    integer, intent(in) :: n
    real(wp), intent(in) :: factor(n)
    real(wp), intent(inout), dimension(n) :: flow, slope, bend
    integer :: l

    !$omp simd
    do l = 1, n
      flow(l) = factor(l)*flow(l)
      slope(l) = factor(l)*slope(l)
      bend(l) = factor(l)*bend(l)
    end do
  end subroutine soften

  !> Flow stress after the plastic strain `dgamma` of one increment of length `dt`, and its
  !! slope and bend against `dgamma`, for a row of points. It never falls with `dgamma`.
  pure subroutine flow_after(curve, n, dt, eqps, factor, first, dgamma, flow, slope, bend, reach, &
                             known)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: dt                   !! [time]
    real(wp), intent(in) :: eqps(n)              !! plastic strain before the increment
    real(wp), intent(in) :: factor(n)            !! on the flow stress, 1 at the first temperature
    real(wp), intent(in) :: first(n)             !! flow stress of `flow_at` there [stress]
    real(wp), intent(in) :: dgamma(n)            !! >= 0
    real(wp), intent(out) :: flow(n), slope(n)   !! [stress]
    real(wp), intent(out) :: bend(n)             !! bound of what the slope loses with `dgamma`
    real(wp), intent(out) :: reach(n)            !! further `dgamma` up to which all this holds
    !> One over the strain of an earlier evaluation and the function of the rate there; (1, 1) is 0
    !! before the first. Near these the function follows from them by a short series.
    real(wp), intent(inout), optional :: known(n, 2)
    real(wp) :: corner
    integer :: l

    if (curve%heating%is_active) then
      call harden_after(curve%hardening, n, eqps, first/factor, dgamma, flow, slope, bend, reach)
    else
      call harden_after(curve%hardening, n, eqps, first, dgamma, flow, slope, bend, reach)
    end if
    if (curve%rate_kind == table_of_rates) &
      call raise_by_rate(curve%rate_curves, n, dt, eqps, dgamma, flow, slope, bend, reach)
    if (curve%heating%is_active) call soften(n, factor, flow, slope, bend)
    if (curve%rate_kind == no_rate .or. curve%rate_kind == table_of_rates) return
    call quicken(curve, n, dt, dgamma, flow, slope, bend, known)
    if (curve%rate_kind == johnson_cook) then
      ! The factor has a corner at the reference rate.
      corner = curve%rate_constants(2)*dt
      do l = 1, n
        reach(l) = min(reach(l), merge(corner - dgamma(l), 0.5_wp*huge(dt), dgamma(l) < corner))
      end do
    end if
  end subroutine flow_after

  !> Multiply by the factor of the plastic strain rate, whose slope and bend come in. The function
  !! of the rate, its power over D or its logarithm over the reference rate, follows from that of an
  !! evaluation before where all strains are near.
  pure subroutine quicken(curve, n, dt, dgamma, flow, slope, bend, known)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dgamma(n)              !! [time], >= 0
    real(wp), intent(inout), dimension(n) :: flow, slope, bend
    real(wp), intent(inout), optional :: known(n, 2)   !! see `flow_after`
    real(wp) :: per_strain(n), values(n), most

    if (present(known)) then
      if (known(1, 1) > 0.0_wp) then
        call compare_strains(n, dgamma, known(:, 1), per_strain, values, most)
        if (most <= near_part) then
          call function_nearby(curve, n, most, known(:, 2), values)
          call add_rate(curve, n, per_strain, values, flow, slope, bend)
          return
        end if
      end if
      call function_anew(curve, n, dt, dgamma, known(:, 1), known(:, 2))
      call add_rate(curve, n, known(:, 1), known(:, 2), flow, slope, bend)
    else
      call function_anew(curve, n, dt, dgamma, per_strain, values)
      call add_rate(curve, n, per_strain, values, flow, slope, bend)
    end if
  end subroutine quicken

  !> The same by the function of the rate.
  pure subroutine add_rate(curve, n, per_strain, values, flow, slope, bend)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: per_strain(n)              !! 1/dgamma, or of the least there is
    real(wp), intent(in) :: values(n)
    real(wp), intent(inout), dimension(n) :: flow, slope, bend
    real(wp) :: coefficient, falls, is_above, by_rate, rise
    integer :: l

    if (curve%rate_kind == cowper_symonds) then
      coefficient = 1.0_wp/curve%rate_constants(2)
      falls = abs(1.0_wp - coefficient)
      !$omp simd private(by_rate, rise)
      do l = 1, n
        by_rate = 1.0_wp + values(l)
        rise = coefficient*values(l)*per_strain(l)*flow(l)
        bend(l) = by_rate*bend(l) + falls*rise*per_strain(l)
        slope(l) = by_rate*slope(l) + rise
        flow(l) = by_rate*flow(l)
      end do
    else
      coefficient = curve%rate_constants(1)
      !$omp simd private(is_above, by_rate, rise)
      do l = 1, n
        is_above = coefficient*(0.5_wp + sign(0.5_wp, values(l)))
        by_rate = 1.0_wp + is_above*values(l)
        rise = is_above*per_strain(l)*flow(l)
        bend(l) = by_rate*bend(l) + rise*per_strain(l)
        slope(l) = by_rate*slope(l) + rise
        flow(l) = by_rate*flow(l)
      end do
    end if
  end subroutine add_rate

  !> Strains over known ones, less 1, the largest of these, and one over the strains by a series to
  !! the third power: it serves slopes alone, for which that is enough.
  pure subroutine compare_strains(n, dgamma, per_known, per_strain, change, most)
    integer, intent(in) :: n
    real(wp), intent(in) :: dgamma(n), per_known(n)
    real(wp), intent(out) :: per_strain(n), change(n), most
    integer :: l

    most = 0.0_wp
    !$omp simd reduction(max: most)
    do l = 1, n
      change(l) = max(dgamma(l), least)*per_known(l) - 1.0_wp
      per_strain(l) = per_known(l)*(1.0_wp - change(l)*(1.0_wp - change(l)*(1.0_wp - change(l))))
      most = max(most, abs(change(l)))
    end do
  end subroutine compare_strains

  !> The function from a known one, by the relative change of the strains.
  pure subroutine function_nearby(curve, n, most, known, values)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: most                       !! of the changes, without sign
    real(wp), intent(in) :: known(n)
    real(wp), intent(inout) :: values(n)               !! changes, then the function

    if (curve%rate_kind == johnson_cook) then
      call log_near(n, values)
      values = known + values
    else if (most <= small_part) then
      call power_small(n, 1.0_wp/curve%rate_constants(2), values)
      values = known*values
    else
      call power_near(n, 1.0_wp/curve%rate_constants(2), known, values)
    end if
  end subroutine function_nearby

  !> The function itself.
  pure subroutine function_anew(curve, n, dt, dgamma, per_strain, values)
    type(flow_curve_t), intent(in) :: curve
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dgamma(n)
    real(wp), intent(out) :: per_strain(n), values(n)
    real(wp) :: per_unit, rates(n)
    integer :: l

    per_unit = curve%rate_constants(merge(1, 2, curve%rate_kind == cowper_symonds))
    per_unit = 1.0_wp/(per_unit*max(dt, tiny(dt)))
    !$omp simd
    do l = 1, n
      rates(l) = max(dgamma(l), least)
      per_strain(l) = 1.0_wp/rates(l)
      rates(l) = max(per_unit*rates(l), least)
    end do
    if (curve%rate_kind == cowper_symonds) then
      values = rates
      call power_row(n, 1.0_wp/curve%rate_constants(2), values)
    else
      call log_row(n, rates, values)
    end if
  end subroutine function_anew

  !> Heating from the fraction of the work, specific heat, temperature at the start, reference and
  !! melting temperature and exponent.
  pure subroutine set_heating(density, constants, heating, error)
    real(wp), intent(in) :: density        !! [mass/length^3]
    real(wp), intent(in) :: constants(:)
    type(heating_t), intent(out) :: heating
    type(error_t), allocatable, intent(out) :: error

    call check_count("adiabatic heating", constants, 6, "six constants", error)
    call check_finite("constants of the heating", constants, error)
    if (allocated(error)) return
    call require(constants(1) >= 0.0_wp .and. constants(1) <= 1.0_wp, &
                 "material: the fraction of plastic work that heats lies between 0 and 1", error)
    call require(constants(2) > 0.0_wp, "material: the specific heat must be positive", error)
    call require(constants(5) > max(constants(3), constants(4)), &
                 "material: the melting temperature must be above the two others", error)
    call require(constants(6) > 0.0_wp, &
                 "material: the exponent of thermal softening must be positive", error)
    if (allocated(error)) return
    heating = heating_t(.true., constants(1)/(density*constants(2)), constants(3), &
                        constants(4), constants(5), constants(6))
  end subroutine set_heating

  !> Factor on the flow stress of a row. A thousandth of the strength is left at melting, so
  !! that the return stays defined.
  pure function thermal_factor(heating, n, n_state, state) result(factor)
    type(heating_t), intent(in) :: heating
    integer, intent(in) :: n, n_state
    real(wp), intent(in) :: state(n, n_state)   !! temperature rise in the last place
    real(wp) :: factor(n)
    real(wp), parameter :: cold = 1.0e-300_wp

    factor = 1.0_wp
    if (.not. heating%is_active) return
    factor = (heating%start + state(:, n_state) - heating%reference) &
             /(heating%melting - heating%reference)
    factor = min(max(factor, cold), 1.0_wp)
    call power_row(n, heating%exponent, factor)
    where (state(:, n_state) + (heating%start - heating%reference) <= 0.0_wp) factor = 0.0_wp
    factor = max(1.0_wp - factor, least_factor)
  end function thermal_factor

  !> Add the heat of the plastic work per volume.
  elemental subroutine heat_up(heating, work, rise)
    type(heating_t), intent(in) :: heating
    real(wp), intent(in) :: work       !! [energy/volume]
    real(wp), intent(inout) :: rise    !! temperature since the start

    rise = rise + heating%per_work*work
  end subroutine heat_up

end module flow_curve
