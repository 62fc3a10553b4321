!> Flow curves at three plastic strain rates, and their flow stress by a search from the start.
module rate_tables
  use kinds, only: wp
  use law_spec, only: law_spec_t
  implicit none
  private

  public :: give_rate_tables, flow_at_rate

  real(wp), parameter :: rates(3) = [0.5_wp, 10.0_wp, 1000.0_wp]
  ! Stress and plastic strain in turn.
  real(wp), parameter, public :: slow(4) = [300.0_wp, 0.0_wp, 400.0_wp, 0.2_wp]
  real(wp), parameter :: middle(6) = [330.0_wp, 0.0_wp, 390.0_wp, 0.1_wp, 450.0_wp, 0.3_wp]
  real(wp), parameter :: fast(4) = [400.0_wp, 0.0_wp, 500.0_wp, 0.3_wp]

contains

  !> Let a law harden by the curves.
  subroutine give_rate_tables(spec, is_logarithmic)
    type(law_spec_t), intent(inout) :: spec
    logical, intent(in) :: is_logarithmic     !! interpolated in the logarithm of the rate

    spec%constants = slow
    spec%plasticity%hardening = "TABLE"
    spec%plasticity%is_logarithmic = is_logarithmic
    allocate (spec%plasticity%rate_curves(size(rates)))
    spec%plasticity%rate_curves%rate = rates
    spec%plasticity%rate_curves(1)%points = slow
    spec%plasticity%rate_curves(2)%points = middle
    spec%plasticity%rate_curves(3)%points = fast
  end subroutine give_rate_tables

  !> Flow stress at a plastic strain and its rate.
  pure real(wp) function flow_at_rate(is_logarithmic, strain, rate) result(flow)
    logical, intent(in) :: is_logarithmic
    real(wp), intent(in) :: strain, rate
    real(wp) :: levels(3), part
    integer :: k

    levels = [table_value(slow, strain), table_value(middle, strain), table_value(fast, strain)]
    flow = merge(levels(1), levels(3), rate < rates(1))
    do k = 1, 2
      if (rate < rates(k) .or. rate > rates(k + 1)) cycle
      part = (rate - rates(k))/(rates(k + 1) - rates(k))
      if (is_logarithmic) part = log(rate/rates(k))/log(rates(k + 1)/rates(k))
      flow = (1.0_wp - part)*levels(k) + part*levels(k + 1)
    end do
  end function flow_at_rate

  !> The stress of a table.
  pure real(wp) function table_value(points, strain) result(stress)
    real(wp), intent(in) :: points(:), strain
    integer :: i

    stress = points(size(points) - 1)
    do i = 1, size(points) - 3, 2
      if (strain < points(i + 1) .or. strain >= points(i + 3)) cycle
      stress = points(i) + (points(i + 2) - points(i))*(strain - points(i + 1)) &
               /(points(i + 3) - points(i + 1))
    end do
  end function table_value

end module rate_tables
