!> From --user and the materials of a deck to the loaded subroutines of the user.
module user_setup
  use errors, only: error_t
  use faults, only: fault_list_t, add_fault, add_warning, new_origin
  use text, only: joined
  use scene, only: scene_t
  use law_setup, only: is_user_material
  use user_library, only: user_library_t, load_user_library
  use command_line, only: command_t
  implicit none
  private

  public :: load_user_files

contains

  !> Compile and load the files of --user, if a material of the deck asks for them. The library is
  !! allocated if that was done. Compiled files are kept in the folder `igaform_cache` beside the
  !! result.
  subroutine load_user_files(command, scene, library, faults)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(user_library_t), allocatable, intent(out) :: library
    type(fault_list_t), intent(inout) :: faults
    type(error_t), allocatable :: error
    character(:), allocatable :: folder
    logical :: is_needed
    integer :: i

    is_needed = .false.
    do i = 1, size(scene%materials)
      is_needed = is_needed .or. is_user_material(scene%materials(i))
    end do
    if (size(command%user_files) == 0) return
    if (.not. is_needed) then
      call add_warning(faults, new_origin("--user "//joined(command%user_files, " --user "), 0, &
                                          ""), "no *USER MATERIAL in the deck, so it is not used", &
                       "a material whose law is *USER MATERIAL")
      return
    end if
    folder = command%output(:index(command%output, "/", back=.true.))
    allocate (library)
    call load_user_library(command%user_files, folder//"igaform_cache", library, error)
    if (allocated(error)) then
      call add_fault(faults, new_origin("--user", 0, ""), error%message, &
                     "sources or a library with a UMAT or VUMAT that can be called")
    else if (library%note /= "") then
      call add_warning(faults, new_origin("--user", 0, ""), library%note, &
                       "code that ends at column 132")
    end if
  end subroutine load_user_files

end module user_setup
