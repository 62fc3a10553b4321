!> Subroutines of users, loaded while the program runs, and their call before the first increment:
!! it gets the name of the job and reads files and fills COMMON blocks.
module user_library
  use, intrinsic :: iso_c_binding, only: c_funptr, c_int, c_funloc, c_null_funptr, c_ptr, &
                                         c_associated, c_double, c_f_procpointer, c_null_ptr
  use, intrinsic :: iso_fortran_env, only: error_unit
  use failure, only: error_t, fail
  use text, only: string_t, joined, upper_case
  use child_process, only: c_text, run_program
  use system_files, only: load_library, procedure_in, open_own_folder, open_memory, close_file, &
                          path_of
  use text_file, only: read_whole_file, take_line
  use user_build, only: build_user_library, setting
  use user_sources, only: ending_of, uncalled_routines
  use abaqus_utilities, only: set_job
  use user_call, only: uexternaldb_procedure, vexternaldb_procedure, enter_user_call, &
                       leave_user_call, watch_user_calls, in_uexternaldb, in_vexternaldb
  implicit none
  private

  public :: load_user_library, start_user_code

  !> What was found in the files. The library stays loaded until the program ends.
  type, public :: user_library_t
    logical :: is_loaded = .false.                  !! else its laws must not be called
    logical :: is_listed = .false.                  !! its names could be read without loading it
    type(string_t), allocatable :: files(:)         !! as the user named them
    character(:), allocatable :: path               !! of the shared library
    character(:), allocatable :: note               !! worth telling, or empty
    character(:), allocatable :: writable           !! names of data that calls may share, or empty
    character(:), allocatable :: uncalled           !! user subroutines without a place here
    type(c_funptr) :: umat = c_null_funptr, vumat = c_null_funptr, sdvini = c_null_funptr
    type(c_funptr) :: usdfld = c_null_funptr, vusdfld = c_null_funptr, uvarm = c_null_funptr
    type(c_funptr) :: uexternaldb = c_null_funptr, vexternaldb = c_null_funptr
  end type user_library_t

  interface
    subroutine c_abort() bind(C, name="abort")
    end subroutine c_abort
  end interface

contains

  !> Load the files: one shared library (.so) as it is, sources after compiling them into the
  !! user's cache. Fails with the compiler's or the loader's words, where the cache is not the
  !! user's alone, or where there is neither a UMAT nor a VUMAT. Without `is_called` nothing of it
  !! is carried out, and it is not loaded: what it has is looked up in its table of names, unless
  !! that cannot be listed.
  subroutine load_user_library(files, named, is_called, library, error)
    type(string_t), intent(in) :: files(:)
    type(string_t), intent(in) :: named(:)   !! routines that the deck names, such as UVARM
    logical, intent(in) :: is_called
    type(user_library_t), intent(out) :: library
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: names
    logical :: is_there

    library%files = files
    library%note = ""
    if (size(files) == 1 .and. ending_of(files(1)%value) == "so") then
      library%path = files(1)%value
      inquire (file=library%path, exist=is_there)
      if (.not. is_there) call fail(error, "no file '"//library%path//"'")
      ! Without a slash the loader would look in the folders of the system.
      if (index(library%path, "/") == 0) library%path = "./"//library%path
    else
      call find_compiled(files, named, library%path, library%note, error)
    end if
    if (allocated(error)) return
    call list_names(library%path, "-D", names)
    library%is_loaded = is_called
    library%is_listed = names /= ""
    if (is_called .or. .not. library%is_listed) then
      call open_library(library, error)
      if (allocated(error)) return
    else
      library%umat = address_if_listed("umat_")
      library%vumat = address_if_listed("vumat_")
      library%usdfld = address_if_listed("usdfld_")
      library%vusdfld = address_if_listed("vusdfld_")
      library%uvarm = address_if_listed("uvarm_")
    end if
    call find_writable(library%path, library%writable)
    library%uncalled = uncalled_routines(files, named)
    if (.not. c_associated(library%umat) .and. .not. c_associated(library%vumat)) &
      call fail(error, "no SUBROUTINE UMAT or VUMAT in "//joined(files, ", ")// &
                " (it must be outside all modules)")

  contains

    !> An address that stands for a routine that is listed but not loaded; null for any other.
    type(c_funptr) function address_if_listed(name)
      character(*), intent(in) :: name

      address_if_listed = c_null_funptr
      if (index(names, " T "//name//new_line("a")) > 0) address_if_listed = c_funloc(refuse_call)
    end function address_if_listed
  end subroutine load_user_library

  !> A library of the sources in the user's cache, compiled now or by an earlier run.
  subroutine find_compiled(files, named, path, note, error)
    type(string_t), intent(in) :: files(:), named(:)
    character(:), allocatable, intent(out) :: path       !! leads to what was checked
    character(:), allocatable, intent(out) :: note       !! worth telling the user, or empty
    type(error_t), allocatable, intent(out) :: error
    integer :: cache, descriptor

    ! As the XDG Base Directory Specification has it, for what a user's programs can make again.
    path = setting("XDG_CACHE_HOME", "")
    if (path == "" .or. index(path, "/") /= 1) path = setting("HOME", "")//"/.cache"
    call open_own_folder(path//"/igaform", cache, error)
    if (allocated(error)) then
      error%message = error%message//"; compiled subroutines are kept there. XDG_CACHE_HOME "// &
                      "names another place for it"
      return
    end if
    ! The descriptor stays open: what was checked is what is loaded, and read by whoever lists
    ! the calls that led to a crash.
    call build_user_library(files, named, path_of(cache), descriptor, note, error)
    path = path_of(descriptor)
    call close_file(cache)
  end subroutine find_compiled

  subroutine open_library(library, error)
    type(user_library_t), intent(inout) :: library
    type(error_t), allocatable, intent(out) :: error
    type(c_ptr) :: handle
    character(:), allocatable :: why

    call load_library(library%path, handle, why)
    if (.not. c_associated(handle)) then
      call fail(error, "cannot load "//joined(library%files, ", ")//": "//why)
      return
    end if
    library%umat = procedure_in(handle, "umat_")
    library%vumat = procedure_in(handle, "vumat_")
    library%sdvini = procedure_in(handle, "sdvini_")
    library%usdfld = procedure_in(handle, "usdfld_")
    library%vusdfld = procedure_in(handle, "vusdfld_")
    library%uvarm = procedure_in(handle, "uvarm_")
    library%uexternaldb = procedure_in(handle, "uexternaldb_")
    library%vexternaldb = procedure_in(handle, "vexternaldb_")
  end subroutine open_library

  !> A subroutine of a library that is not loaded was called, which is an error of this program.
  subroutine refuse_call() bind(C)
    write (error_unit, "(a)") "igaform: error: a user's subroutine was called, which is not loaded"
    call c_abort()
  end subroutine refuse_call

  !> Names of the data that the library can write to and that are not the linker's own: COMMON
  !! blocks, SAVE variables and variables with initial values. What is unknown counts as one.
  subroutine find_writable(path, names)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: names
    character(*), parameter :: unknown = "what the library keeps cannot be seen"
    character(:), allocatable :: listing, line
    integer :: first

    names = ""
    call list_names(path, "--no-demangle", listing)
    if (index(listing, " T ") == 0) then
      names = unknown
      return
    end if
    first = 1
    do while (first <= len(listing))
      call take_line(listing, first, line)
      if (is_writable(line)) names = names//", "//plain_name(line(20:))
    end do
    if (names /= "") names = names(3:)
  end subroutine find_writable

  !> What `nm` reports of a library; empty if that failed.
  subroutine list_names(path, option, listing)
    character(*), intent(in) :: path, option
    character(:), allocatable, intent(out) :: listing
    type(string_t) :: words(3)
    logical :: is_there
    integer :: code, output

    listing = ""
    output = open_memory()
    if (output < 0) return
    words(1)%value = "nm"
    words(2)%value = option
    words(3)%value = path
    call run_program(words, path_of(output), code)
    if (code == 0) call read_whole_file(path_of(output), listing, is_there)
    call close_file(output)
  end subroutine list_names

  !> Is it a line of `nm` (address, kind, name) for writable data of the user's?
  pure logical function is_writable(line)
    character(*), intent(in) :: line
    character(*), parameter :: of_linker(14) = [character(40) :: "_DYNAMIC", &
      "_GLOBAL_OFFSET_TABLE_", "__TMC_END__", "__dso_handle", "__bss_start", "_edata", "_end", &
      "__frame_dummy_init_array_entry", "__do_global_dtors_aux_fini_array_entry", "__data_start", &
      "data_start", "__JCR_END__", "__JCR_LIST__", "_fini"]

    is_writable = .false.
    if (len(line) < 20) return
    if (index("BbDdCGgSs", line(18:18)) == 0) return
    if (any(line(20:) == of_linker) .or. index(line(20:), "completed.") == 1) return
    ! Tables that gfortran makes for types with procedures.
    is_writable = index(line(20:), "__vtab_") == 0 .and. index(line(20:), "__def_init_") == 0
  end function is_writable

  !> The name as the source has it: without the underscore and the number that compilers add.
  pure function plain_name(symbol) result(name)
    character(*), intent(in) :: symbol
    character(:), allocatable :: name
    integer :: dot

    name = upper_case(symbol)
    dot = index(name, ".")
    if (dot > 1) name = name(:dot - 1)
    if (name(len(name):) == "_" .and. len(name) > 1) name = name(:len(name) - 1)
  end function plain_name

  !> Pass on the name of the job and the folder of its results, then call UEXTERNALDB and
  !! VEXTERNALDB where there are such, with LOP = 0.
  subroutine start_user_code(library, job, folder)
    type(user_library_t), intent(in) :: library
    character(*), intent(in) :: job, folder
    procedure(uexternaldb_procedure), pointer :: uexternaldb
    procedure(vexternaldb_procedure), pointer :: vexternaldb
    real(c_double) :: times(10)
    integer(c_int) :: numbers(10)

    call set_job(c_text(job), int(len(job), c_int), c_text(folder), int(len(folder), c_int))
    call watch_user_calls(c_null_funptr, c_null_ptr)
    times = 0.0_c_double
    numbers = 0_c_int
    if (c_associated(library%uexternaldb)) then
      call c_f_procpointer(library%uexternaldb, uexternaldb)
      call enter_user_call(in_uexternaldb, -1_c_int, -1_c_int, -1_c_int)
      call uexternaldb(0_c_int, 0_c_int, times(:2), times(1), 1_c_int, 0_c_int)
    end if
    if (c_associated(library%vexternaldb)) then
      call c_f_procpointer(library%vexternaldb, vexternaldb)
      numbers(3) = 1_c_int   ! the step
      call enter_user_call(in_vexternaldb, -1_c_int, -1_c_int, -1_c_int)
      call vexternaldb(0_c_int, numbers, int(size(numbers), c_int), times, &
                       int(size(times), c_int))
    end if
    call leave_user_call()
  end subroutine start_user_code

end module user_library
