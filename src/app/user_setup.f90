!> From --user and the materials of a deck to the loaded subroutines of the user.
module user_setup
  use errors, only: error_t
  use faults, only: fault_list_t, add_fault, add_warning, new_origin, n_errors
  use text, only: string_t, joined
  use scene, only: scene_t
  use law_setup, only: is_user_material
  use user_library, only: user_library_t, load_user_library
  use user_start, only: start_user_code
  use command_line, only: command_t
  use system_files, only: kind_of_file
  use output_names, only: base_of, result_base, file_name
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
    call check_presence(command%user_files, faults)
    if (n_errors(faults) > 0) return
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
      return
    end if
    if (library%note /= "") call add_warning(faults, new_origin("--user", 0, ""), library%note, &
      "source as its name says, in fixed form up to column 132")
    if (library%uncalled /= "") call add_warning(faults, new_origin("--user", 0, ""), &
      "SUBROUTINE "//library%uncalled//" in the files, which nothing here calls", &
      "UMAT, VUMAT, SDVINI, UEXTERNALDB or VEXTERNALDB")
    call start_user_code(library, job_name(command), folder_name(folder))
  end subroutine load_user_files

  !> Files that are not there, or are none, are faults, even where no material asks for them.
  subroutine check_presence(files, faults)
    type(string_t), intent(in) :: files(:)
    type(fault_list_t), intent(inout) :: faults
    character(:), allocatable :: kind
    integer :: i

    do i = 1, size(files)
      kind = kind_of_file(files(i)%value)
      if (kind == "file") cycle
      if (kind == "") kind = "no file"
      call add_fault(faults, new_origin("--user", 0, ""), kind//" '"//files(i)%value//"'", &
                     "sources or a library of the user")
    end do
  end subroutine check_presence

  !> Name of the result file, or else of the deck, without folder and ending.
  function job_name(command) result(name)
    type(command_t), intent(in) :: command
    character(:), allocatable :: name

    name = result_base(file_name(command%output))
    if (name == "") name = base_of(file_name(command%deck))
  end function job_name

  !> Without the slash at its end.
  function folder_name(path) result(name)
    character(*), intent(in) :: path
    character(:), allocatable :: name

    name = path
    if (name == "") name = "."
    if (len(name) > 1) name = name(:len(name) - 1)
  end function folder_name

end module user_setup
