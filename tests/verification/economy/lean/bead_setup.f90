!> In the place of the module that adds draw beads: none is compiled in.
module bead_setup
  use faults, only: fault_list_t
  use scene, only: bead_spec_t, blank_spec_t
  use motion_curve, only: curve_t
  use model, only: model_t
  implicit none
  private

  public :: add_bead

contains

  !> A bead ends the program.
  subroutine add_bead(spec, blank_spec, curve, model, faults)
    type(bead_spec_t), intent(in) :: spec
    type(blank_spec_t), intent(in) :: blank_spec
    type(curve_t), intent(in) :: curve
    type(model_t), intent(inout) :: model
    type(fault_list_t), intent(inout) :: faults

    error stop "a bead in a program without beads"
  end subroutine add_bead

end module bead_setup
