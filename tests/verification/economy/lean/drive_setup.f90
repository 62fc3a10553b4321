!> In the place of the module that adds tools driven by forces: none is compiled in.
module drive_setup
  use faults, only: fault_list_t, add_fault
  use scene, only: scene_t
  use model, only: model_t
  implicit none
  private

  public :: add_drives

contains

  !> A tool driven by a force is a fault.
  subroutine add_drives(scene, model, faults)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    type(fault_list_t), intent(inout) :: faults
    integer :: i

    do i = 1, size(scene%motions)
      if (scene%motions(i)%is_force) call add_fault(faults, scene%motions(i)%origin, &
        "a force on a tool in a program without them", "no *TOOL FORCE")
    end do
  end subroutine add_drives

end module drive_setup
