!> Subroutines of users, loaded while the program runs.
module user_library
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_funptr, c_int, c_null_funptr, &
                                         c_ptr, c_associated, c_size_t
  use errors, only: error_t, fail
  use text, only: string_t, joined, upper_case, to_text
  use child_process, only: c_text, run_program
  use source_digest, only: read_whole_file
  use user_build, only: build_user_library, make_folder, remove_file, process_number
  use user_sources, only: ending_of, uncalled_routines
  implicit none
  private

  public :: load_user_library

  !> What was found in the files. The library stays loaded until the program ends.
  type, public :: user_library_t
    logical :: is_loaded = .false.
    type(string_t), allocatable :: files(:)         !! as the user named them
    character(:), allocatable :: path               !! of the shared library
    character(:), allocatable :: note               !! worth telling, or empty
    character(:), allocatable :: writable           !! names of data that calls may share, or empty
    character(:), allocatable :: uncalled           !! user subroutines without a place here
    type(c_funptr) :: umat = c_null_funptr, vumat = c_null_funptr, sdvini = c_null_funptr
    type(c_funptr) :: uexternaldb = c_null_funptr, vexternaldb = c_null_funptr
  end type user_library_t

  interface
    type(c_ptr) function c_dlopen(path, flags) bind(C, name="dlopen")
      import :: c_char, c_int, c_ptr
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: flags
    end function c_dlopen

    type(c_funptr) function c_dlsym(library, name) bind(C, name="dlsym")
      import :: c_char, c_funptr, c_ptr
      type(c_ptr), value :: library
      character(kind=c_char), intent(in) :: name(*)
    end function c_dlsym

    type(c_ptr) function c_dlerror() bind(C, name="dlerror")
      import :: c_ptr
    end function c_dlerror

    integer(c_size_t) function c_strlen(text) bind(C, name="strlen")
      import :: c_ptr, c_size_t
      type(c_ptr), value :: text
    end function c_strlen
  end interface

contains

  !> Load the files: one shared library (.so) as it is, sources after compiling them. Fails with
  !! the compiler's or the loader's words, or where there is neither a UMAT nor a VUMAT.
  subroutine load_user_library(files, cache, library, error)
    type(string_t), intent(in) :: files(:)
    character(*), intent(in) :: cache               !! folder for what is compiled
    type(user_library_t), intent(out) :: library
    type(error_t), allocatable, intent(out) :: error
    integer(c_int), parameter :: all_now = 2_c_int  ! RTLD_NOW, names for this library alone
    type(c_ptr) :: handle
    logical :: is_there

    library%files = files
    library%note = ""
    library%writable = ""
    if (size(files) == 1 .and. ending_of(files(1)%value) == "so") then
      library%path = files(1)%value
      inquire (file=library%path, exist=is_there)
      if (.not. is_there) call fail(error, "no file '"//library%path//"'")
    else
      call build_user_library(files, cache, library%path, library%note, error)
    end if
    if (allocated(error)) return
    ! Without a slash the loader would look in the folders of the system.
    if (index(library%path, "/") == 0) library%path = "./"//library%path
    handle = c_dlopen(c_text(library%path), all_now)
    if (.not. c_associated(handle)) then
      call fail(error, "cannot load "//library%path//": "//loader_message())
      return
    end if
    library%umat = c_dlsym(handle, c_text("umat_"))
    library%vumat = c_dlsym(handle, c_text("vumat_"))
    library%sdvini = c_dlsym(handle, c_text("sdvini_"))
    library%uexternaldb = c_dlsym(handle, c_text("uexternaldb_"))
    library%vexternaldb = c_dlsym(handle, c_text("vexternaldb_"))
    library%uncalled = uncalled_routines(files)
    if (.not. c_associated(library%umat) .and. .not. c_associated(library%vumat)) then
      call fail(error, "no SUBROUTINE UMAT or VUMAT in "//joined(files, ", ")// &
                " (it must stand outside all modules)")
      return
    end if
    call find_writable(library%path, cache, library%writable)
    library%is_loaded = .true.
  end subroutine load_user_library

  function loader_message() result(message)
    character(:), allocatable :: message
    type(c_ptr) :: text
    character(kind=c_char), pointer :: characters(:)
    integer :: i

    message = ""
    text = c_dlerror()
    if (.not. c_associated(text)) return
    call c_f_pointer(text, characters, [c_strlen(text)])
    do i = 1, size(characters)
      message = message//characters(i)
    end do
  end function loader_message

  !> Names of the data that the library can write to and that are not the linker's own: COMMON
  !! blocks, SAVE variables and variables with initial values. What cannot be told counts as one.
  subroutine find_writable(path, cache, names)
    character(*), intent(in) :: path, cache
    character(:), allocatable, intent(out) :: names
    character(*), parameter :: unknown = "what the library keeps cannot be seen"
    character(:), allocatable :: listing, log, line
    type(string_t) :: words(2)
    logical :: is_there
    integer :: code, first, length

    names = ""
    call make_folder(cache)
    log = cache//"/symbols_"//to_text(process_number())//".txt"
    words(1)%value = "nm"
    words(2)%value = path
    call run_program(words, log, code)
    call read_whole_file(log, listing, is_there)
    call remove_file(log)
    call remove_file(cache)   ! stays if it holds anything
    if (code /= 0 .or. index(listing, " T ") == 0) then
      names = unknown
      return
    end if
    first = 1
    do while (first <= len(listing))
      length = index(listing(first:), new_line("a"))
      if (length == 0) length = len(listing) - first + 2
      line = listing(first:first + length - 2)
      first = first + length
      if (is_writable(line)) names = names//", "//plain_name(line(20:))
    end do
    if (names /= "") names = names(3:)
  end subroutine find_writable

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

end module user_library
