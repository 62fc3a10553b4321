!> Hardening by flow curves at several plastic strain rates, interpolated between the two nearest
!! rates: linearly in the rate, or in its logarithm. Below the lowest and above the highest rate the
!! curve of that rate holds.
module rate_curves
  use kinds, only: wp
  use failure, only: error_t
  use law_spec, only: rate_curve_spec_t
  use text, only: rounded_text
  use constant_check, only: check_finite, require
  use hardening, only: hardening_t, new_hardening, harden
  use row_functions, only: log_row
  implicit none
  private

  public :: new_rate_curves, raise_by_rate

  !> The curve at the lowest rate is the `hardening` of the flow curve.
  type, public :: rate_curves_t
    real(wp), allocatable :: rates(:)             !! rising [1/time], shape (n)
    type(hardening_t), allocatable :: faster(:)   !! curves at all rates but the first, (n - 1)
    logical :: is_logarithmic = .false.           !! interpolated in the logarithm of the rate
  end type rate_curves_t

contains

  !> Curves with their rates from those of a deck. Rejected: rates that do not rise or have no
  !! logarithm, tables that are not those of `hardening`, curves below that of the rate before.
  pure subroutine new_rate_curves(specs, is_logarithmic, lowest, curves, error)
    type(rate_curve_spec_t), intent(in) :: specs(:)
    logical, intent(in) :: is_logarithmic
    type(hardening_t), intent(in) :: lowest           !! curve of the first of them
    type(rate_curves_t), intent(out) :: curves
    type(error_t), allocatable, intent(out) :: error  !! its number is that of the curve
    integer :: i

    curves%is_logarithmic = is_logarithmic
    curves%rates = specs%rate
    allocate (curves%faster(size(specs) - 1))
    call check_finite("rates of the flow curves", curves%rates, error)
    call require(curves%rates(1) >= 0.0_wp, "material: the rate of a flow curve must not be "// &
                 "negative", error)
    call require(curves%rates(1) > 0.0_wp .or. .not. is_logarithmic, "material: rates that are "// &
                 "interpolated by their logarithms must be positive", error)
    if (allocated(error)) return
    do i = 2, size(specs)
      call require(curves%rates(i) > curves%rates(i - 1), "material: the rate "// &
                   rounded_text(curves%rates(i))//" after "//rounded_text(curves%rates(i - 1))// &
                   ": the rates of the flow curves must rise", error)
      if (.not. allocated(error)) &
        call new_hardening("TABLE", specs(i)%points, curves%faster(i - 1), error)
      if (.not. allocated(error)) then
        if (i == 2) then
          call check_order(lowest, curves%faster(1), error)
        else
          call check_order(curves%faster(i - 2), curves%faster(i - 1), error)
        end if
      end if
      if (.not. allocated(error)) cycle
      error%number = i
      return
    end do
  end subroutine new_rate_curves

  !> Faster must not be softer anywhere: straight lines differ most at a point of one of the tables.
  pure subroutine check_order(slower, faster, error)
    type(hardening_t), intent(in) :: slower, faster
    type(error_t), allocatable, intent(inout) :: error
    real(wp) :: strains(size(slower%strains) + size(faster%strains))
    real(wp), dimension(size(strains)) :: low, high, slope, bend, reach
    integer :: worst

    strains(:size(slower%strains)) = slower%strains
    strains(size(slower%strains) + 1:) = faster%strains
    call harden(slower, size(strains), strains, low, slope, bend, reach)
    call harden(faster, size(strains), strains, high, slope, bend, reach)
    worst = maxloc(low - high, 1)
    call require(high(worst) >= low(worst), "material: the flow stress "// &
                 rounded_text(high(worst))//" at plastic strain "//rounded_text(strains(worst))// &
                 " is below "//rounded_text(low(worst))//" at the lower rate: faster would be "// &
                 "softer, and the strain would localize in one element", error)
  end subroutine check_order

  !> Raise the flow stress of the lowest rate, its slope and bend to those of the rate of an
  !! increment, and shorten its reach: see `flow_after` of `flow_curve`.
  pure subroutine raise_by_rate(curves, n, dt, eqps, dgamma, flow, slope, bend, reach)
    type(rate_curves_t), intent(in) :: curves
    integer, intent(in) :: n
    real(wp), intent(in) :: dt                     !! [time]
    real(wp), intent(in) :: eqps(n), dgamma(n)     !! before the increment and in it
    real(wp), intent(inout), dimension(n) :: flow, slope, bend, reach
    real(wp), dimension(n) :: strain, place, per_strain, below, below_slope, own, own_slope, &
                              own_bend, own_reach
    real(wp) :: edges(size(curves%rates)), corner, part, turn, rise
    integer :: k, l

    call place_rates(curves, n, dt, dgamma, edges, place, per_strain)
    strain = eqps + dgamma
    below = flow
    below_slope = slope
    do k = 1, size(curves%faster)
      call harden(curves%faster(k), n, strain, own, own_slope, own_bend, own_reach)
      do l = 1, n
        part = (place(l) - edges(k))/(edges(k + 1) - edges(k))
        turn = merge(per_strain(l)/(edges(k + 1) - edges(k)), 0.0_wp, &
                     part >= 0.0_wp .and. part < 1.0_wp)
        part = min(max(part, 0.0_wp), 1.0_wp)
        rise = own(l) - below(l)
        flow(l) = flow(l) + part*rise
        slope(l) = slope(l) + part*(own_slope(l) - below_slope(l)) + turn*rise
        bend(l) = bend(l) + 2.0_wp*turn*(below_slope(l) - own_slope(l))
        if (curves%is_logarithmic) bend(l) = bend(l) + turn*per_strain(l)*rise
        reach(l) = min(reach(l), own_reach(l))
      end do
      below = own
      below_slope = own_slope
    end do
    do k = 1, size(curves%rates)
      corner = curves%rates(k)*dt
      do l = 1, n
        if (dgamma(l) < corner) reach(l) = min(reach(l), corner - dgamma(l))
      end do
    end do
  end subroutine raise_by_rate

  !> Where the rate of each point stands between those of the curves, and how it moves with dgamma.
  pure subroutine place_rates(curves, n, dt, dgamma, edges, place, per_strain)
    type(rate_curves_t), intent(in) :: curves
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dgamma(n)
    real(wp), intent(out) :: edges(:)              !! rates of the curves or their logarithms
    real(wp), intent(out) :: place(n), per_strain(n)
    real(wp), parameter :: least = 1.0e-100_wp     ! strain and rate, so that all have a logarithm
    real(wp) :: per_time

    per_time = 1.0_wp/max(dt, tiny(dt))
    if (curves%is_logarithmic) then
      per_strain = 1.0_wp/max(dgamma, least)
      call log_row(n, max(per_time*dgamma, least), place)
      call log_row(size(edges), curves%rates, edges)
    else
      per_strain = per_time
      place = per_time*dgamma
      edges = curves%rates
    end if
  end subroutine place_rates

end module rate_curves
