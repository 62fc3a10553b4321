!> From source files of users to a shared library: gfortran is run as the files expect it, and what
!! it says is handed on. The library is kept and used again until a source, a file that one
!! includes, the compiler or its options change.
module user_build
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_ptr
  use failure, only: error_t, fail
  use text, only: string_t, strings, to_text
  use checksum, only: file_checksum
  use child_process, only: run_program, program_missing, c_text
  use system_files, only: folder_of, program_folder, replace_file
  use whole_file, only: read_whole_file
  use source_digest, only: digest_t, add_text, add_file, whole_digest_text
  use trusted_files, only: open_own_file, digest_of, keep_to_owner
  use user_sources, only: is_source, is_c_source, is_fixed_form, has_directives, provide_includes, &
                          as_file, ending_of, kinds_of
  use source_rewriting, only: rewrite_source
  use library_store, only: find_kept, library_name
  use build_messages, only: cause_of, link_message
  implicit none
  private

  public :: build_user_library, setting

  !> -frecursive keeps local arrays on the stack, so that threads do not share them. -w: the
  !! sources are old and not ours. -g: crashes name the line. The sections let the linker leave out
  !! what neither UMAT nor VUMAT needs, and with it what is missing there. The protection lets no
  !! large array reach over the end of a stack into what lies behind.
  character(*), parameter :: options(19) = [character(28) :: "-fPIC", "-frecursive", "-O2", "-g", &
    "-w", "-std=legacy", "-fallow-argument-mismatch", "-fallow-invalid-boz", "-fno-range-check", &
    "-fcray-pointer", "-fdec-format-defaults", "-fdec-math", "-fd-lines-as-comments", &
    "-fdollar-ok", "-ffree-line-length-none", "-fdiagnostics-color=never", &
    "-ffunction-sections", "-fdata-sections", "-fstack-clash-protection"]

  character(*), parameter :: no_room = "nothing can be written into the folder igaform of "// &
    "XDG_CACHE_HOME or ~/.cache (is the disk full?)"

  !> What is called from outside; all else may go.
  character(12), parameter :: exported(5) = [character(12) :: "umat_", "vumat_", "sdvini_", &
    "uexternaldb_", "vexternaldb_"]

  !> What every call of the compiler needs to know.
  type :: build_t
    character(:), allocatable :: compiler, folder, log, support
    type(string_t), allocatable :: words(:)      !! of the call in hand
    type(string_t), allocatable :: objects(:)    !! compiled so far
    character(:), allocatable :: note
    logical :: has_cpp = .false.                 !! one of the sources is C++
  end type build_t

  interface
    type(c_ptr) function c_mkdtemp(path) bind(C, name="mkdtemp")
      import :: c_char, c_ptr
      character(kind=c_char), intent(inout) :: path(*)
    end function c_mkdtemp
  end interface

contains

  !> Compile and link, or find what an earlier run has made of the same sources. Fails with the
  !! compiler's words where a file does not compile, with the names of routines that are nowhere,
  !! and where there is no compiler or no room for the library.
  subroutine build_user_library(files, cache, library, note, error)
    type(string_t), intent(in) :: files(:)      !! sources, and libraries (.so, .a, .o) beside them
    character(*), intent(in) :: cache           !! folder for the libraries, of the user alone
    integer, intent(out) :: library             !! descriptor of the open library
    character(:), allocatable, intent(out) :: note      !! worth telling the user, or empty
    type(error_t), allocatable, intent(out) :: error
    type(build_t) :: build
    character(:), allocatable :: key
    integer :: i

    note = ""
    library = -1
    build%note = ""
    build%compiler = setting("IGAFORM_FC", "gfortran")
    call find_support(build, error)
    if (allocated(error)) return
    call new_folder(cache//"/build_XXXXXX", build%folder, error)
    if (allocated(error)) return
    build%log = build%folder//"/messages.txt"
    call find_key(build, files, key, error)
    if (.not. allocated(error)) call find_kept(cache, key, library, note)
    if (.not. allocated(error) .and. library < 0) then
      allocate (build%objects(0))
      do i = 1, size(files)
        call compile(build, files(i)%value, i, error)
        if (allocated(error)) exit
      end do
      if (.not. allocated(error)) call link(build, error)
      if (.not. allocated(error)) call keep(build, cache, key, library, error)
      note = build%note
    end if
    call remove_folder(build)
  end subroutine build_user_library

  !> Keep the fresh library under its digest, and the record that leads to it. Both appear at once
  !! and whole, for other runs may be at it, too.
  subroutine keep(build, cache, key, library, error)
    type(build_t), intent(in) :: build
    character(*), intent(in) :: cache, key
    integer, intent(out) :: library
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: digest, record
    logical :: is_kept
    integer :: unit, status, closing

    call keep_to_owner(fresh_library(build))
    library = open_own_file(fresh_library(build))
    digest = ""
    if (library >= 0) digest = digest_of(library)
    record = build%folder//"/record.txt"
    open (newunit=unit, file=record, access="stream", form="unformatted", action="write", &
          status="replace", iostat=status)
    if (status == 0) then
      write (unit, iostat=status) digest//build%note
      close (unit, iostat=closing)
      if (status == 0) status = closing
      call keep_to_owner(record)
    end if
    if (digest == "") status = 1
    is_kept = status == 0
    if (is_kept) is_kept = replace_file(fresh_library(build), cache//"/"//library_name(digest))
    if (is_kept) is_kept = replace_file(record, cache//"/"//key//".txt")
    if (.not. is_kept) call fail(error, "cannot write the compiled user subroutine: "//no_room)
  end subroutine keep

  pure function fresh_library(build) result(path)
    type(build_t), intent(in) :: build
    character(:), allocatable :: path

    path = build%folder//"/user.so"
  end function fresh_library

  !> The value of a variable of the environment; the default where it is not there or empty.
  function setting(name, default) result(value)
    character(*), intent(in) :: name, default
    character(:), allocatable :: value
    integer :: length, status

    call get_environment_variable(name, length=length, status=status)
    value = default
    if (status /= 0 .or. length == 0) return
    deallocate (value)
    allocate (character(length) :: value)
    call get_environment_variable(name, value=value)
  end function setting

  !> The folder above those of our utility routines and include files: above that of the program,
  !! or one higher.
  subroutine find_support(build, error)
    type(build_t), intent(inout) :: build
    type(error_t), allocatable, intent(out) :: error
    logical :: is_there
    integer :: i

    build%support = program_folder()
    do i = 1, 2
      build%support = build%support//"/.."
      inquire (file=build%support//"/lib/libigaform_user.so", exist=is_there)
      if (is_there) return
    end do
    call fail(error, "the utility routines for user materials are missing: no "// &
              "lib/libigaform_user.so above the folder of the program, "//program_folder())
  end subroutine find_support

  !> Create a folder that no other run has, on this machine or another that shares the cache.
  subroutine new_folder(pattern, folder, error)
    character(*), intent(in) :: pattern                  !! ends with XXXXXX
    character(:), allocatable, intent(out) :: folder
    type(error_t), allocatable, intent(out) :: error
    character(kind=c_char) :: path(len(pattern) + 1)
    integer :: i

    path = c_text(pattern)
    if (.not. c_associated(c_mkdtemp(path))) call fail(error, &
      "cannot write the compiled user subroutine: "//no_room)
    allocate (character(len(pattern)) :: folder)
    do i = 1, len(pattern)
      folder(i:i) = path(i)
    end do
  end subroutine new_folder

  !> A key of everything the library depends on; asks the compiler for its version on the way.
  subroutine find_key(build, files, key, error)
    type(build_t), intent(inout) :: build
    type(string_t), intent(in) :: files(:)
    character(:), allocatable, intent(out) :: key
    type(error_t), allocatable, intent(out) :: error
    type(digest_t) :: digest
    type(string_t), allocatable :: found(:)
    character(:), allocatable :: version
    logical :: is_there
    integer :: i, code

    key = ""
    allocate (found(0))
    call start_words(build, build%compiler)
    call add_word(build, "--version")
    call run_program(build%words, build%log, code)
    inquire (file=build%log, exist=is_there)
    if (code == program_missing .and. is_there) then
      call fail(error, "no compiler: '"//build%compiler//"' cannot be started, which "// &
                "compiles and links "//kinds_of(files)//"; install gfortran (Debian: apt "// &
                "install gfortran; with C++ source also g++), name another gfortran by the "// &
                "environment variable IGAFORM_FC, or give a library that is compiled already (.so)")
      return
    end if
    call read_whole_file(build%log, version, is_there)
    if (.not. is_there) then
      call fail(error, "the user subroutine cannot be compiled: "//no_room)
      return
    end if
    call add_text(digest, version)
    do i = 1, size(options)
      call add_text(digest, options(i))
    end do
    call add_text(digest, build%support)
    ! Another version may write sources anew in another way.
    call add_text(digest, file_checksum("/proc/self/exe"))
    do i = 1, size(files)
      inquire (file=files(i)%value, exist=is_there)
      if (.not. is_there) then
        call fail(error, "no file '"//files(i)%value//"'")
        return
      end if
      call add_file(digest, files(i)%value)
      if (is_source(files(i)%value)) then
        call provide_includes(files(i)%value, build%folder, build%support//"/include", found)
      end if
    end do
    do i = 1, size(found)
      call add_file(digest, found(i)%value)
    end do
    key = whole_digest_text(digest)
  end subroutine find_key

  subroutine start_words(build, word)
    type(build_t), intent(inout) :: build
    character(*), intent(in) :: word

    build%words = strings([word])
  end subroutine start_words

  subroutine add_word(build, word)
    type(build_t), intent(inout) :: build
    character(*), intent(in) :: word
    type(string_t) :: last

    last%value = word
    build%words = [build%words, last]
  end subroutine add_word

  !> Object file of one source; objects and libraries are passed on to the linker.
  subroutine compile(build, path, number, error)
    type(build_t), intent(inout) :: build
    character(*), intent(in) :: path
    integer, intent(in) :: number
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: object
    type(string_t) :: entry

    object = build%folder//"/"//to_text(number)//".o"
    entry%value = object
    if (is_source(path)) then
      call compile_source(build, path, object, error)
    else if (is_c_source(path)) then
      call compile_c(build, path, object, error)
    else if (any(ending_of(path) == [character(2) :: "o", "a", "so"])) then
      entry%value = as_file(path)
    else
      call fail(error, "'"//path//"' is neither source of Fortran (.f, .for, .f90, .F, .F90), "// &
                "C or C++ (.c, .cpp) nor a library (.so, .so.1, .a, .o)")
    end if
    if (allocated(error)) return
    build%objects = [build%objects, entry]
  end subroutine compile

  !> Compile as the file's name says; if that fails, with all extensions of old compilers, with what
  !! gfortran does not know written anew in a copy, with real constants of the kind that the
  !! arguments have, up to column 72 (old files may carry numbers behind it), and in the other form
  !! (some files in free form are named .for). The messages are those of the first try.
  subroutine compile_source(build, path, object, error)
    type(build_t), intent(inout) :: build
    character(*), intent(in) :: path, object
    type(error_t), allocatable, intent(out) :: error
    character(*), parameter :: one_kind = "-fdefault-real-8 -fdefault-double-8"
    character(:), allocatable :: messages, source, changes
    logical :: is_there, is_fixed
    integer :: code

    is_fixed = is_fixed_form(path)
    source = path
    call compile_with(build, path, source, object, is_fixed, "132", "", code)
    if (code == 0) return
    call read_whole_file(build%log, messages, is_there)
    call compile_with(build, path, source, object, is_fixed, "132", "-fdec", code)
    if (code == 0) return
    call rewrite_source(path, object//".f", is_fixed, changes)
    if (changes /= "") then
      source = object//".f"
      build%note = path//" is compiled from a copy that gfortran accepts: "//changes
      call compile_with(build, path, source, object, is_fixed, "132", "-fdec", code)
      if (code == 0) return
      changes = "; "//changes
    end if
    call compile_with(build, path, source, object, is_fixed, "132", one_kind, code)
    build%note = path//" mixes real kinds in calls of intrinsic functions; its constants "// &
                 "without D0, and what it declares REAL, count as double precision"//changes
    if (code == 0) return
    if (is_fixed) then
      call compile_with(build, path, source, object, is_fixed, "72", "", code)
      build%note = path//" compiles only when it is read up to column 72, and so it is"//changes
      if (code == 0) return
    end if
    call compile_with(build, path, source, object, .not. is_fixed, "132", "", code)
    build%note = path//" compiles only in "//trim(merge("free ", "fixed", is_fixed))// &
                 " form, and so it is read"//changes
    if (code /= 0) call fail(error, path//" does not compile:"//new_line("a")//messages// &
                             cause_of(messages))
  end subroutine compile_source

  !> C and C++, by the compilers that stand behind gfortran's name.
  subroutine compile_c(build, path, object, error)
    type(build_t), intent(inout) :: build
    character(*), intent(in) :: path, object
    type(error_t), allocatable, intent(out) :: error
    character(*), parameter :: c_options(6) = [character(19) :: "-fPIC", "-O2", "-g", "-w", &
      "-ffunction-sections", "-fdata-sections"]
    character(:), allocatable :: messages
    logical :: is_there
    integer :: i, code

    call start_words(build, build%compiler)
    do i = 1, size(c_options)
      call add_word(build, trim(c_options(i)))
    end do
    call add_word(build, "-I"//folder_of(path))
    call add_word(build, "-I"//build%support//"/include")
    call add_word(build, "-c")
    call add_word(build, as_file(path))
    call add_word(build, "-o")
    call add_word(build, object)
    call run_program(build%words, build%log, code)
    if (ending_of(path) /= "c") build%has_cpp = .true.
    if (code == 0) return
    call read_whole_file(build%log, messages, is_there)
    if (index(messages, "cc1") > 0) then
      call fail(error, path//" needs a compiler of C or C++ in addition to gfortran (Debian: "// &
                "apt install g++), or give it compiled with -fPIC (.o)")
    else
      call fail(error, path//" does not compile:"//new_line("a")//messages)
    end if
  end subroutine compile_c

  subroutine compile_with(build, path, source, object, is_fixed, columns, extra, code)
    type(build_t), intent(inout) :: build
    character(*), intent(in) :: path        !! as the user has it
    character(*), intent(in) :: source      !! the same, or a copy of it
    character(*), intent(in) :: object
    logical, intent(in) :: is_fixed         !! fixed form, else free form
    character(*), intent(in) :: columns     !! of fixed form
    character(*), intent(in) :: extra       !! one or two more options, or empty
    integer, intent(out) :: code
    integer :: i, blank

    call start_words(build, build%compiler)
    do i = 1, size(options)
      call add_word(build, trim(options(i)))
    end do
    call add_word(build, "-ffixed-line-length-"//columns)
    call add_word(build, trim(merge("-ffixed-form", "-ffree-form ", is_fixed)))
    call add_word(build, trim(merge("-cpp  ", "-nocpp", has_directives(path))))
    blank = index(extra//" ", " ")
    if (extra /= "") call add_word(build, extra(:blank - 1))
    if (blank < len(extra)) call add_word(build, extra(blank + 1:))
    call add_word(build, "-I"//folder_of(path))
    call add_word(build, "-I"//build%folder)
    call add_word(build, "-I"//build%support//"/include")
    call add_word(build, "-J"//build%folder)
    call add_word(build, "-c")
    call add_word(build, as_file(source))
    call add_word(build, "-o")
    call add_word(build, object)
    call run_program(build%words, build%log, code)
  end subroutine compile_with

  !> Link all objects to a library in the folder of this build.
  subroutine link(build, error)
    type(build_t), intent(inout) :: build
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: messages
    logical :: is_there
    integer :: i, code

    call start_words(build, build%compiler)
    call add_word(build, "-shared")
    call add_word(build, "-Wl,--no-undefined")
    call add_word(build, "-Wl,--gc-sections")
    call write_exports(build%folder//"/exports.txt")
    call add_word(build, "-Xlinker")   ! not -Wl, which splits a path at its commas
    call add_word(build, "--version-script="//build%folder//"/exports.txt")
    do i = 1, size(exported)   ! which an archive would else keep for itself
      call add_word(build, "-Wl,-u,"//trim(exported(i)))
    end do
    do i = 1, size(build%objects)
      call add_word(build, build%objects(i)%value)
    end do
    if (build%has_cpp) call add_word(build, "-lstdc++")
    call add_word(build, "-L"//build%support//"/lib")
    call add_word(build, "-Xlinker")
    call add_word(build, "-rpath")
    call add_word(build, "-Xlinker")
    call add_word(build, build%support//"/lib")
    call add_word(build, "-ligaform_user")
    call add_word(build, "-o")
    call add_word(build, fresh_library(build))
    call run_program(build%words, build%log, code)
    if (code /= 0) then
      call read_whole_file(build%log, messages, is_there)
      call fail(error, link_message(messages))
    end if
  end subroutine link

  !> What the linker is to keep and to show.
  subroutine write_exports(path)
    character(*), intent(in) :: path
    integer :: unit, status, i

    open (newunit=unit, file=path, action="write", status="replace", iostat=status)
    if (status /= 0) return   ! the linker will miss the file
    write (unit, "(*(a))") "{ global: ", (trim(exported(i))//"; ", i=1, size(exported)), &
      "local: *; };"
    close (unit)
  end subroutine write_exports

  !> Remove what compiling has left. What stays after all does no harm.
  subroutine remove_folder(build)
    type(build_t), intent(inout) :: build
    integer :: code

    call start_words(build, "rm")
    call add_word(build, "-rf")
    call add_word(build, as_file(build%folder))
    call run_program(build%words, "/dev/null", code)
  end subroutine remove_folder

end module user_build
