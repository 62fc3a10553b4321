!> In the place of the module that adds contact pairs: none is compiled in.
module contact_setup
  use faults, only: fault_list_t, add_fault
  use scene, only: contact_spec_t, blank_spec_t
  use model, only: model_t
  implicit none
  private

  public :: add_contact

contains

  !> A contact pair is a fault.
  subroutine add_contact(spec, blank_spec, model, faults)
    type(contact_spec_t), intent(in) :: spec
    type(blank_spec_t), intent(in) :: blank_spec
    type(model_t), intent(inout) :: model
    type(fault_list_t), intent(inout) :: faults

    call add_fault(faults, spec%origin, "contact in a program without contact", "no pair")
  end subroutine add_contact

end module contact_setup
