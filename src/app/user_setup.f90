!> From --user and the materials of a deck to the loaded subroutines of the user.
module user_setup
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, add_warning, new_origin, n_errors
  use text, only: string_t, joined, append_text
  use scene, only: is_user_material, scene_t
  use user_library, only: user_library_t, load_user_library, start_user_code
  use user_sources, only: do_define
  use command_line, only: command_t
  use system_files, only: kind_of_file, folder_of
  use output_files, only: base_of, result_base, file_name
  implicit none
  private

  public :: load_user_files

contains

  !> Compile and load the files of --user, if a material of the deck asks for them. The library is
  !! allocated if that was done. A check does not call them unless it needs what only they know, and
  !! says which it is.
  subroutine load_user_files(command, scene, library, errors)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(user_library_t), allocatable, intent(out) :: library
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    character(:), allocatable :: reason

    if (size(command%user_files) == 0) return
    call check_presence(command%user_files, errors)
    if (n_errors(errors) > 0) return
    if (.not. any(is_user_material(scene%materials))) then
      call add_warning(errors, new_origin("--user "//joined(command%user_files, " --user "), 0, &
                                          ""), "no *USER MATERIAL in the deck, so it is not used", &
                       "a material whose law is *USER MATERIAL")
      return
    end if
    allocate (library)
    reason = reason_to_call(command, scene)
    call load_user_library(command%user_files, named_routines(scene, command%user_files), &
                           reason /= "", library, error)
    if (allocated(error)) then
      call add_error(errors, new_origin("--user", 0, ""), error%message, &
                     "sources or a library with a UMAT or VUMAT that can be called")
      return
    end if
    if (library%note /= "") call add_warning(errors, new_origin("--user", 0, ""), library%note, &
      "source that gfortran compiles as its name says")
    if (library%uncalled /= "") call add_warning(errors, new_origin("--user", 0, ""), &
      "SUBROUTINE "//library%uncalled//" in the files, which nothing here calls", &
      "UMAT, VUMAT, SDVINI, UEXTERNALDB, VEXTERNALDB; with *USER DEFINED FIELD in the material "// &
      "USDFLD or VUSDFLD, with *USER OUTPUT VARIABLES UVARM")
    if (command%is_check) then
      if (reason == "" .and. .not. library%is_listed) then
        print "(a)", "user code  loaded, not called by this check: without nm (binutils) the "// &
          "names in a library are seen by loading it"
      else if (reason == "") then
        print "(a)", "user code  compiled, not called by this check"
      else
        print "(a)", "user code  called by this check: "//reason
      end if
    end if
    if (reason /= "") call start_user_code(library, job_name(command), folder_of(command%output))
  end subroutine load_user_files

  !> The subroutines for fields and output that the materials name: USDFLD beside a UMAT, VUSDFLD
  !! beside a VUMAT, which a material without TYPE is only where the files have no UMAT. Both where
  !! no source shows either, for they may be in objects, in C or in included files.
  function named_routines(scene, files) result(names)
    type(scene_t), intent(in) :: scene
    type(string_t), intent(in) :: files(:)
    type(string_t), allocatable :: names(:)
    logical :: are_vumats(size(scene%materials)), has_umat, has_vumat

    allocate (names(0))
    if (any(scene%materials%n_uvarm > 0)) call append_text(names, "UVARM")
    has_umat = do_define(files, "UMAT")
    has_vumat = do_define(files, "VUMAT")
    are_vumats = scene%materials%law == "VUMAT" .or. &
                 (scene%materials%law /= "UMAT" .and. has_vumat .and. .not. has_umat)
    if (any(scene%materials%has_own_fields .and. .not. are_vumats)) &
      call append_text(names, "USDFLD")
    if (.not. (has_umat .or. has_vumat)) are_vumats = scene%materials%law /= "UMAT"
    if (any(scene%materials%has_own_fields .and. are_vumats)) call append_text(names, "VUSDFLD")
  end function named_routines

  !> What the subroutines are called for; empty where they need not be: a check asks them for the
  !! stiffness alone, and only where the deck does not give it.
  function reason_to_call(command, scene) result(reason)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: reason
    integer :: i

    reason = ""
    if (.not. command%is_check) reason = "the run"
    if (command%is_trial_run) reason = "--trial-run runs the deck with fewer elements"
    do i = 1, size(scene%materials)
      associate (material => scene%materials(i))
        if (reason /= "" .or. .not. is_user_material(material)) cycle
        if (.not. material%young > 0.0_wp) reason = "material "//material%name// &
          " has no *ELASTIC, so its first call gives the stiffness"
      end associate
    end do
  end function reason_to_call

  !> Files that are not there, or are none, are errors, even where no material asks for them.
  subroutine check_presence(files, errors)
    type(string_t), intent(in) :: files(:)
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: kind
    integer :: i

    do i = 1, size(files)
      kind = kind_of_file(files(i)%value)
      if (kind == "file") cycle
      if (kind == "") kind = "no file"
      call add_error(errors, new_origin("--user", 0, ""), kind//" '"//files(i)%value//"'", &
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

end module user_setup
