!> The flow stress of a material of the scene, where its law says it.
module flow_stress
  use kinds, only: wp
  use failure, only: error_t
  use scene, only: material_spec_t
  use hardening, only: hardening_t, new_hardening, harden
  implicit none
  private

  public :: flow_stress_of

contains

  !> Flow stress after a plastic strain; 0 for laws that do not say it [stress].
  function flow_stress_of(material, strain) result(flow)
    type(material_spec_t), intent(in) :: material
    real(wp), intent(in) :: strain
    real(wp) :: flow
    type(hardening_t) :: curve
    type(error_t), allocatable :: error
    real(wp), dimension(1) :: stress, slope, bend, reach

    flow = 0.0_wp
    if (material%law /= "PLASTIC") return
    if (material%plasticity%hardening == "YOSHIDA UEMORI") then
      ! That of the bounding surface in tension, its (21).
      associate (c => material%constants)
        if (size(c) == 7) flow = c(2) + (c(7) + c(5))*(1.0_wp - exp(-c(4)*strain))
      end associate
      return
    end if
    call new_hardening(trim(material%plasticity%hardening), material%constants, curve, error)
    if (allocated(error)) return
    call harden(curve, 1, [strain], stress, slope, bend, reach)
    flow = stress(1)
  end function flow_stress_of

end module flow_stress
