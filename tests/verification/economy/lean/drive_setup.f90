!> In the place of the module that adds tools driven by forces: none is compiled in.
module drive_setup
  use input_errors, only: error_list_t, add_error
  use scene, only: scene_t
  use model, only: model_t
  implicit none
  private

  public :: add_drives

contains

  !> A tool driven by a force is an error.
  subroutine add_drives(scene, model, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(scene%motions)
      if (scene%motions(i)%is_force) call add_error(errors, scene%motions(i)%origin, &
        "a force on a tool in a program without them", "no *TOOL FORCE")
    end do
  end subroutine add_drives

end module drive_setup
