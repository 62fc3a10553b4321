!> From source files of users to a shared library: gfortran is run as the files require, and its
!! messages are passed on with their cause. The library is kept in the user's cache and used again
!! until a source, a file that one includes, the compiler or its options change.
module user_build
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_ptr
  use failure, only: error_t, fail
  use text, only: string_t, strings, append_text, to_text, joined, lower_case, upper_case
  use checksum, only: file_checksum
  use child_process, only: run_program, program_missing, c_text
  use system_files, only: folder_of, folder_above, program_folder, replace_file, open_own_file, &
                          digest_of, keep_to_owner, close_file, path_of
  use text_file, only: read_whole_file
  use user_sources, only: is_source, is_c_source, is_fixed_form, has_directives, provide_includes, &
                          as_file, ending_of, kinds_of, digest_t, add_text, add_file, &
                          write_text
  use sha256, only: sha256_text
  use source_rewriting, only: rewrite_source
  implicit none
  private

  public :: build_user_library, setting
  public :: find_kept, library_name, fortran_options, cause_of, link_message

  !> -frecursive keeps local arrays on the stack, so that threads do not share them. -w: the
  !! sources are old and not ours. -g: crashes name the line. The sections let the linker leave out
  !! what neither UMAT nor VUMAT needs, and with it what is missing there. The protection lets no
  !! large array reach over the end of a stack into other memory.
  character(*), parameter :: options(19) = [character(28) :: "-fPIC", "-frecursive", "-O2", "-g", &
    "-w", "-std=legacy", "-fallow-argument-mismatch", "-fallow-invalid-boz", "-fno-range-check", &
    "-fcray-pointer", "-fdec-format-defaults", "-fdec-math", "-fd-lines-as-comments", &
    "-fdollar-ok", "-ffree-line-length-none", "-fdiagnostics-color=never", &
    "-ffunction-sections", "-fdata-sections", "-fstack-clash-protection"]

  character(*), parameter :: no_room = "nothing can be written into the folder igaform of "// &
    "XDG_CACHE_HOME or ~/.cache (is the disk full?)"

  !> What is called from outside, with what a deck names; all else may go.
  character(12), parameter :: exported(5) = [character(12) :: "umat_", "vumat_", "sdvini_", &
    "uexternaldb_", "vexternaldb_"]

  integer, parameter :: digest_length = 64   ! of the text

  !> Routines of Abaqus that are provided.
  character(*), parameter :: utilities = "XIT, ROTSIG, SINV, SPRINC, SPRIND, VSPRINC, VSPRIND, "// &
    "STDB_ABQERR, XPLB_ABQERR, XPLB_EXIT, GETOUTDIR, GETJOBNAME, GETRANK, GETNUMCPUS and the "// &
    "same with V before them, GETNUMTHREADS, GET_THREAD_ID, MUTEXINIT, MUTEXLOCK, "// &
    "MUTEXUNLOCK, GETVRM and VGETVRM"

  !> What every call of the compiler needs to know.
  type :: build_t
    type(string_t) :: compiler
    character(:), allocatable :: folder, log, support
    type(string_t), allocatable :: exported(:)   !! names that the linker shows
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
  subroutine build_user_library(files, named, cache, library, note, error)
    type(string_t), intent(in) :: files(:)      !! sources, and libraries (.so, .a, .o) with them
    type(string_t), intent(in) :: named(:)      !! routines that the deck names, such as UVARM
    character(*), intent(in) :: cache           !! folder for the libraries, of the user alone
    integer, intent(out) :: library             !! descriptor of the open library
    character(:), allocatable, intent(out) :: note      !! worth telling the user, or empty
    type(error_t), allocatable, intent(out) :: error
    type(build_t) :: build
    type(string_t), allocatable :: words(:)
    character(:), allocatable :: key
    integer :: i

    note = ""
    library = -1
    build%note = ""
    build%exported = strings(exported)
    do i = 1, size(named)
      call append_text(build%exported, lower_case(named(i)%value)//"_")
    end do
    build%compiler%value = setting("IGAFORM_FC", "gfortran")
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
    ! What stays after all does no harm.
    words = strings([character(3) :: "rm", "-rf"])
    call append_text(words, as_file(build%folder))
    call run_program(words, "/dev/null", i)
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

  !> The library of these sources that an earlier run has kept, open; below zero if there is none.
  !! A record of this user has its digest and the note, which each run prints. What is no
  !! plain file of this user, or has another digest, is no library: it will be made again.
  subroutine find_kept(cache, key, library, note)
    character(*), intent(in) :: cache, key
    integer, intent(out) :: library
    character(:), allocatable, intent(out) :: note
    character(:), allocatable :: content
    integer :: record
    logical :: is_there

    note = ""
    library = -1
    record = open_own_file(cache//"/"//key//".txt")
    if (record < 0) return
    call read_whole_file(path_of(record), content, is_there)
    call close_file(record)
    if (len(content) < digest_length) return
    library = open_own_file(cache//"/"//library_name(content(:digest_length)))
    if (library < 0) return
    note = content(digest_length + 1:)
    if (digest_of(library) == content(:digest_length)) return
    call close_file(library)
    library = -1
    note = ""
  end subroutine find_kept

  !> The name of a library that has this digest.
  pure function library_name(digest) result(name)
    character(*), intent(in) :: digest
    character(:), allocatable :: name

    name = "user_"//lower_case(digest)//".so"
  end function library_name

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

    build%support = folder_above("lib/libigaform_user.so")
    if (build%support == "") &
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
    type(string_t), allocatable :: found(:), words(:)
    character(:), allocatable :: version
    logical :: is_there
    integer :: i, code

    key = ""
    allocate (found(0))
    words = [build%compiler]
    call append_text(words, "--version")
    call run_program(words, build%log, code)
    inquire (file=build%log, exist=is_there)
    if (code == program_missing .and. is_there) then
      call fail(error, "no compiler: '"//build%compiler%value//"' cannot be started, which "// &
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
    call add_text(digest, joined(build%exported, " "))
    ! Another version may rewrite sources in another way.
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
    key = sha256_text(digest%sum)
  end subroutine find_key

  !> Object file of one source; objects and libraries are passed on to the linker.
  subroutine compile(build, path, number, error)
    type(build_t), intent(inout) :: build
    character(*), intent(in) :: path
    integer, intent(in) :: number
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: object

    object = build%folder//"/"//to_text(number)//".o"
    if (is_source(path)) then
      call compile_source(build, path, object, error)
    else if (is_c_source(path)) then
      call compile_c(build, path, object, error)
    else if (any(ending_of(path) == [character(2) :: "o", "a", "so"])) then
      object = as_file(path)
    else
      call fail(error, "'"//path//"' is neither source of Fortran (.f, .for, .f90, .F, .F90), "// &
                "C or C++ (.c, .cpp) nor a library (.so, .so.1, .a, .o)")
    end if
    if (allocated(error)) return
    call append_text(build%objects, object)
  end subroutine compile

  !> Compile as the file's name says; if that fails, with all extensions of old compilers, with what
  !! gfortran does not know rewritten in a copy, with real constants of the kind that the
  !! arguments have, up to column 72 (old files may carry numbers after it), and in the other form
  !! (some files in free form are named .for). The messages are those of the first try.
  subroutine compile_source(build, path, object, error)
    type(build_t), intent(inout) :: build
    character(*), intent(in) :: path, object
    type(error_t), allocatable, intent(out) :: error
    character(18), parameter :: none(0) = [character(18) ::], dec(1) = [character(18) :: "-fdec"], &
      one_kind(2) = [character(18) :: "-fdefault-real-8", "-fdefault-double-8"]
    character(:), allocatable :: messages, source, changes
    logical :: is_there, is_fixed

    is_fixed = is_fixed_form(path)
    source = path
    if (compiles(is_fixed, "132", none)) return
    call read_whole_file(build%log, messages, is_there)
    if (compiles(is_fixed, "132", dec)) return
    call rewrite_source(path, object//".f", is_fixed, changes)
    if (changes /= "") then
      source = object//".f"
      build%note = path//" is compiled from a copy that gfortran accepts: "//changes
      if (compiles(is_fixed, "132", dec)) return
      changes = "; "//changes
    end if
    build%note = path//" mixes real kinds in calls of intrinsic functions; its constants "// &
                 "without D0, and what it declares REAL, count as double precision"//changes
    if (compiles(is_fixed, "132", one_kind)) return
    if (is_fixed) then
      build%note = path//" compiles only when it is read up to column 72, and so it is"//changes
      if (compiles(is_fixed, "72", none)) return
    end if
    build%note = path//" compiles only in "//trim(merge("free ", "fixed", is_fixed))// &
                 " form, and so it is read"//changes
    if (compiles(.not. is_fixed, "132", none)) return
    call fail(error, path//" does not compile:"//new_line("a")//messages//cause_of(messages))

  contains

    logical function compiles(as_fixed, columns, extra)
      logical, intent(in) :: as_fixed
      character(*), intent(in) :: columns, extra(:)
      type(string_t), allocatable :: list(:)
      integer :: code

      list = fortran_options(as_fixed, columns, has_directives(path), extra)
      call append_text(list, "-J"//build%folder)
      call run_compiler(build, list, path, source, object, code)
      compiles = code == 0
    end function compiles

  end subroutine compile_source

  !> C and C++, by the compilers that gfortran starts for them.
  subroutine compile_c(build, path, object, error)
    type(build_t), intent(inout) :: build
    character(*), intent(in) :: path, object
    type(error_t), allocatable, intent(out) :: error
    character(*), parameter :: c_options(6) = [character(19) :: "-fPIC", "-O2", "-g", "-w", &
      "-ffunction-sections", "-fdata-sections"]
    character(:), allocatable :: messages
    logical :: is_there
    integer :: code

    call run_compiler(build, strings(c_options), path, path, object, code)
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

  !> Options of gfortran for one Fortran source.
  pure function fortran_options(is_fixed, columns, is_preprocessed, extra) result(list)
    logical, intent(in) :: is_fixed          !! fixed form, else free form
    character(*), intent(in) :: columns      !! of fixed form
    logical, intent(in) :: is_preprocessed
    character(*), intent(in) :: extra(:)     !! more options
    type(string_t), allocatable :: list(:)

    list = strings([character(28) :: options, "-ffixed-line-length-"//columns, &
                    merge("-ffixed-form", "-ffree-form ", is_fixed), &
                    merge("-cpp  ", "-nocpp", is_preprocessed), extra])
  end function fortran_options

  !> Compile one file.
  subroutine run_compiler(build, options, path, source, object, code)
    type(build_t), intent(in) :: build
    type(string_t), intent(in) :: options(:)
    character(*), intent(in) :: path        !! as the user has it
    character(*), intent(in) :: source      !! the same, or a copy of it
    character(*), intent(in) :: object
    integer, intent(out) :: code
    type(string_t), allocatable :: words(:)

    words = [build%compiler, options]
    call append_text(words, "-I"//folder_of(path))
    call append_text(words, "-I"//build%folder)
    call append_text(words, "-I"//build%support//"/include")
    call append_text(words, "-c")
    call append_text(words, as_file(source))
    call append_text(words, "-o")
    call append_text(words, object)
    call run_program(words, build%log, code)
  end subroutine run_compiler

  !> Link all objects to a library in the folder of this build.
  subroutine link(build, error)
    type(build_t), intent(in) :: build
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: words(:)
    character(:), allocatable :: exports, messages
    logical :: is_there
    integer :: i, code

    ! -Xlinker, not -Wl, which splits a path at its commas
    words = [build%compiler, strings([character(18) :: "-shared", "-Wl,--no-undefined", &
                                       "-Wl,--gc-sections", "-Xlinker"])]
    call append_text(words, "--version-script="//build%folder//"/exports.txt")
    exports = "{ global: "   ! what the linker is to keep and to show
    do i = 1, size(build%exported)
      exports = exports//build%exported(i)%value//"; "
      call append_text(words, "-Wl,-u,"//build%exported(i)%value)   ! else an archive would keep it
    end do
    call write_text(build%folder//"/exports.txt", exports//"local: *; };"//new_line("a"))
    words = [words, build%objects]
    if (build%has_cpp) call append_text(words, "-lstdc++")
    call append_text(words, "-L"//build%support//"/lib")
    words = [words, strings([character(8) :: "-Xlinker", "-rpath", "-Xlinker"])]
    call append_text(words, build%support//"/lib")
    words = [words, strings([character(14) :: "-ligaform_user", "-o"])]
    call append_text(words, fresh_library(build))
    call run_program(words, build%log, code)
    if (code /= 0) then
      call read_whole_file(build%log, messages, is_there)
      call fail(error, link_message(messages))
    end if
  end subroutine link

  !> What the compiler's words mean where the source is written for another compiler; empty where
  !! they say it themselves.
  function cause_of(messages) result(cause)
    character(*), intent(in) :: messages
    character(:), allocatable :: cause

    cause = ""
    if (index(messages, "must be compared with") > 0) then
      cause = "Intel's compiler lets .EQ. and .NE. compare logicals; the standard has .EQV. "// &
              "and .NEQV. for that"
    else if (index(messages, "must be the same type and kind") > 0) then
      cause = "Intel's compiler lets the arguments of an intrinsic function differ in kind; "// &
              "make them one, such as SIGN(1.D0, X)"
    else if (index(messages, "Cannot open module file") > 0) then
      cause = "a module is missing: give its source as a --user before this file; modules that "// &
              "came with another compiler (IFWIN, MKL ...) are not there"
    else if (index(messages, "No such file or directory") > 0) then
      cause = "an included file is missing: it is looked for next to the source"
    end if
    if (cause /= "") cause = "The cause: "//cause
  end function cause_of

  !> The routines that are nowhere, by name and with a hint; else the linker's words.
  function link_message(messages) result(message)
    character(*), intent(in) :: messages
    character(:), allocatable :: message, name, names, rest
    character(*), parameter :: mark = "undefined reference to `"
    integer :: first

    names = ""
    rest = messages
    do
      first = index(rest, mark)
      if (first == 0) exit
      rest = rest(first + len(mark):)
      name = upper_case(rest(:max(scan(rest, "'"//new_line("a")) - 1, 0)))
      if (len(name) > 1 .and. index(name, "_", back=.true.) == len(name)) &
        name = name(:len(name) - 1)
      if (index(", "//names//",", ", "//name//",") == 0) names = names//", "//name
      if (names(1:1) == ",") names = names(3:)
    end do
    if (index(messages, "recompile with -fPIC") > 0) then
      message = "an object or archive of --user cannot be part of a shared library: compile it "// &
                "with -fPIC"
    else if (index(names, "SMALOCAL") > 0 .or. index(names, "SMAINT") > 0 .or. &
             index(names, "SMAREAL") > 0) then
      message = "the user subroutine calls "//names//": the arrays that Abaqus manages "// &
                "(SMAAspUserArrays.hdr) are not provided; keep such data in SAVE arrays or a module"
    else if (names == "") then
      message = "the user subroutine cannot be linked:"//new_line("a")//messages
    else
      message = "the user subroutine calls "//names//", which no file of --user has; add the "// &
        "file with it (--user FILE --user OTHER_FILE; for LAPACK or BLAS the path of that "// &
        "library). Of the utility routines of Abaqus there are "//utilities
    end if
  end function link_message

end module user_build
