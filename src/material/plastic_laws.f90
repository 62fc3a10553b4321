!> Which block law serves what a deck says behind *PLASTIC.
module plastic_laws
  use kinds, only: wp
  use errors, only: error_t, fail
  use block_law, only: block_law_t
  use law_spec, only: law_spec_t
  use hardening, only: new_hardening, voce_kind
  use flow_curve, only: flow_curve_t, set_rate_factor, is_steep
  use voce, only: new_voce
  use mises_plastic, only: new_mises_plastic
  use combined_hardening, only: new_combined_hardening, check_back_stresses
  implicit none
  private

  public :: new_plastic

contains

  !> The law with its constants checked together. Elastic constants are taken as checked.
  subroutine new_plastic(spec, law, error)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(flow_curve_t) :: curve

    call new_hardening(spec%plasticity%hardening, spec%constants, curve%hardening, error)
    if (allocated(error)) return
    if (spec%plasticity%rate /= "") then
      call set_rate_factor(spec%plasticity%rate, spec%plasticity%rate_constants, curve, error)
      if (allocated(error)) return
    end if
    if (spec%plasticity%n_stages > 0 .and. is_steep(curve)) then
      call fail(error, "material: the multi-stage return needs a slope of the flow stress "// &
                "that is finite where plastic flow begins; with eps_0 = 0 or Cowper-Symonds "// &
                "take the backward Euler return")
      return
    end if
    if (allocated(spec%plasticity%back_stresses)) then
      call new_combined(spec, curve, law, error)
    else if (is_plain_voce(spec, curve)) then
      allocate (law, source=new_voce(spec%density, spec%young, spec%poisson, spec%constants(1), &
                                     spec%constants(2), spec%constants(3)))
    else
      allocate (law, source=new_mises_plastic(spec%density, spec%young, spec%poisson, curve, &
                                              spec%plasticity%n_stages))
    end if
  end subroutine new_plastic

  !> Von Mises with back stresses.
  subroutine new_combined(spec, curve, law, error)
    type(law_spec_t), intent(in) :: spec
    type(flow_curve_t), intent(in) :: curve
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error

    call check_back_stresses(spec%plasticity%back_stresses, error)
    if (allocated(error)) return
    if (spec%plasticity%n_stages > 0) then
      call fail(error, "material: the multi-stage return knows no back stresses; take the "// &
                "backward Euler return")
      return
    end if
    allocate (law, source=new_combined_hardening(spec%density, spec%young, spec%poisson, curve, &
                                                 spec%plasticity%back_stresses))
  end subroutine new_combined

  !> Does the tuned law for Voce hardening do?
  pure logical function is_plain_voce(spec, curve)
    type(law_spec_t), intent(in) :: spec
    type(flow_curve_t), intent(in) :: curve

    is_plain_voce = curve%hardening%kind == voce_kind .and. spec%plasticity%rate == "" &
                    .and. spec%plasticity%n_stages == 0
  end function is_plain_voce

end module plastic_laws
