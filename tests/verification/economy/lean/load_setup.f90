!> In the place of the module that adds loads: none is compiled in.
module load_setup
  use faults, only: fault_list_t, add_fault
  use scene, only: scene_t, load_spec_t
  use motion_curve, only: curve_t
  use model, only: model_t
  implicit none
  private

  public :: add_load

contains

  !> A load is a fault.
  subroutine add_load(scene, spec, curve, model, faults)
    type(scene_t), intent(in) :: scene
    type(load_spec_t), intent(in) :: spec
    type(curve_t), intent(in) :: curve
    type(model_t), intent(inout) :: model
    type(fault_list_t), intent(inout) :: faults

    call add_fault(faults, spec%origin, "a load in a program without loads", "no load")
  end subroutine add_load

end module load_setup
