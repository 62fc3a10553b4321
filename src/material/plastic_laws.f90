!> Which block law serves what a deck says behind *PLASTIC.
module plastic_laws
  use kinds, only: wp
  use failure, only: error_t, fail
  use block_law, only: block_law_t, law_entry_t
  use law_spec, only: law_spec_t
  use hardening, only: new_hardening, voce_kind, back_stresses_t, new_back_stresses
  use flow_curve, only: set_heating, flow_curve_t, set_rate_factor
  use voce, only: new_voce
  use mises_plastic, only: new_mises_plastic
  use combined_hardening, only: new_combined_hardening
  use yield_function, only: yield_function_t, new_yield_function
  use tensor_rotation, only: axes_from_points
  use anisotropic_plastic, only: new_anisotropic_plastic
  implicit none
  private

  public :: plastic_law

contains

  !> *PLASTIC with what follows it.
  function plastic_law() result(entry)
    type(law_entry_t) :: entry

    entry%name = "PLASTIC"
    entry%build => new_plastic
  end function plastic_law

  !> The law with its constants checked together.
  subroutine new_plastic(spec, law, error)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(flow_curve_t) :: curve
    type(back_stresses_t) :: back

    call new_hardening(spec%plasticity%hardening, spec%constants, curve%hardening, error)
    if (allocated(error)) return
    if (spec%plasticity%rate /= "") then
      call set_rate_factor(spec%plasticity%rate, spec%plasticity%rate_constants, curve, error)
      if (allocated(error)) return
    end if
    if (allocated(spec%plasticity%heating)) then
      call set_heating(spec%density, spec%plasticity%heating, curve%heating, error)
      if (allocated(error)) return
    end if
    if (allocated(spec%plasticity%back_stresses)) then
      call new_back_stresses(spec%plasticity%back_stresses, back, error)
      if (allocated(error)) return
    end if
    if (spec%plasticity%potential /= "") then
      call new_anisotropic(spec, curve, back, law, error)
    else if (back%n > 0) then
      allocate (law, source=new_combined_hardening(spec%density, spec%young, spec%poisson, curve, &
                                                   back, spec%plasticity%n_stages))
    else if (is_plain_voce(spec, curve)) then
      allocate (law, source=new_voce(spec%density, spec%young, spec%poisson, spec%constants(1), &
                                     spec%constants(2), spec%constants(3)))
    else
      allocate (law, source=new_mises_plastic(spec%density, spec%young, spec%poisson, curve, &
                                              spec%plasticity%n_stages))
    end if
  end subroutine new_plastic

  !> An anisotropic yield function; its axes must be given.
  subroutine new_anisotropic(spec, curve, back, law, error)
    type(law_spec_t), intent(in) :: spec
    type(flow_curve_t), intent(in) :: curve
    type(back_stresses_t), intent(in) :: back
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(yield_function_t) :: yield
    real(wp) :: axes(3, 3)

    call new_yield_function(spec%plasticity%potential, spec%plasticity%coefficients, yield, error)
    if (allocated(error)) return
    if (.not. allocated(spec%plasticity%orientation)) then
      call fail(error, "material: the yield function "//trim(spec%plasticity%potential)// &
                " needs an *ORIENTATION that gives the rolling direction")
      return
    end if
    call axes_from_points(spec%plasticity%orientation, axes, error)
    if (allocated(error)) return
    allocate (law, source=new_anisotropic_plastic(spec%density, spec%young, spec%poisson, curve, &
                                                  yield, back, axes, &
                                                  spec%plasticity%n_stages))
  end subroutine new_anisotropic

  !> Does the tuned law for Voce hardening do?
  pure logical function is_plain_voce(spec, curve)
    type(law_spec_t), intent(in) :: spec
    type(flow_curve_t), intent(in) :: curve

    is_plain_voce = curve%hardening%kind == voce_kind .and. spec%plasticity%rate == "" &
                    .and. spec%plasticity%n_stages == 0 .and. .not. curve%heating%is_active
  end function is_plain_voce

end module plastic_laws
