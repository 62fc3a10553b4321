!> Adiabatic heating by plastic work, and the softening that it brings.
!!
!! Share of the work that turns into heat: G. I. Taylor and H. Quinney, Proc. R. Soc. A 143 (1934).
!! Softening: G. R. Johnson and W. H. Cook, Proc. 7th Int. Symp. Ballistics (1983),
!! 1 - ((T - T_ref)/(T_melt - T_ref))^m. The temperature in an increment is that at its start.
module heating
  use kinds, only: wp
  use failure, only: error_t, fail
  implicit none
  private

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

contains

  !> Heating from the share of the work, specific heat, temperature at the start, reference and
  !! melting temperature and exponent.
  pure subroutine set_heating(density, constants, heating, error)
    real(wp), intent(in) :: density        !! [mass/length^3]
    real(wp), intent(in) :: constants(:)
    type(heating_t), intent(out) :: heating
    type(error_t), allocatable, intent(out) :: error

    if (size(constants) /= 6) then
      call fail(error, "material: adiabatic heating takes six constants")
    else if (.not. all(abs(constants) <= huge(1.0_wp))) then
      call fail(error, "material: the constants of the heating must be finite numbers")
    else if (constants(1) < 0.0_wp .or. constants(1) > 1.0_wp) then
      call fail(error, "material: the share of plastic work that heats lies between 0 and 1")
    else if (constants(2) <= 0.0_wp) then
      call fail(error, "material: the specific heat must be positive")
    else if (constants(5) <= max(constants(3), constants(4))) then
      call fail(error, "material: the melting temperature must be above the two others")
    else if (constants(6) <= 0.0_wp) then
      call fail(error, "material: the exponent of thermal softening must be positive")
    else
      heating = heating_t(.true., constants(1)/(density*constants(2)), constants(3), &
                          constants(4), constants(5), constants(6))
    end if
  end subroutine set_heating

  !> Factor on the flow stress of a row. A thousandth of the strength is left at melting, so
  !! that the return stays defined.
  pure function thermal_factor(heating, n, n_state, state) result(factor)
    type(heating_t), intent(in) :: heating
    integer, intent(in) :: n, n_state
    real(wp), intent(in) :: state(n, n_state)   !! temperature rise in the last place
    real(wp) :: factor(n)
    real(wp), parameter :: least = 1.0e-3_wp

    factor = 1.0_wp
    if (.not. heating%is_active) return
    factor = (heating%start + state(:, n_state) - heating%reference) &
             /(heating%melting - heating%reference)
    factor = max(1.0_wp - min(max(factor, 0.0_wp), 1.0_wp)**heating%exponent, least)
  end function thermal_factor

  !> Add the heat of the plastic work per volume of one point.
  pure subroutine heat_up(heating, work, rise)
    type(heating_t), intent(in) :: heating
    real(wp), intent(in) :: work       !! [energy/volume]
    real(wp), intent(inout) :: rise    !! temperature since the start

    rise = rise + heating%per_work*work
  end subroutine heat_up

end module heating
