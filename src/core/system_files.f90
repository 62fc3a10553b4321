!> Services of the operating system for files: true paths, files by pattern, safe replacement;
!! whether two paths lead to one file; which shared libraries the program runs with. Files of the
!! user alone are in a folder that nobody else can write to, reached through an open descriptor, so
!! that nothing can be put in their place between the check and the use.
module system_files
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_funptr, c_int, &
                                         c_int16_t, c_null_char, c_null_funptr, c_null_ptr, &
                                         c_ptr, c_size_t
  use, intrinsic :: iso_fortran_env, only: int64
  use c_library, only: c_dlsym, c_fclose, c_fileno, c_fopen, c_free, c_mkdir, c_rename, c_statx, &
                       c_strlen, c_open
  use text, only: string_t, to_text
  use failure, only: error_t, fail
  use sha256, only: sha256_t, add_to_digest, sha256_text
  implicit none
  private

  public :: true_path, matching_files, is_folder, kind_of_file, is_no_file, bytes_on_disk
  public :: sync_file, replace_file, install_file, remove_file, make_folder, why_protected
  public :: fortran_text
  public :: program_folder, folder_above, folder_of, is_same_file, is_any_of_files, library_of
  public :: load_library, procedure_in
  public :: open_own_folder, open_own_file, open_memory, close_file, path_of, digest_of
  public :: keep_to_owner

  !> What dladdr knows of an address (Dl_info of the C library).
  type, bind(C) :: place_t
    type(c_ptr) :: path = c_null_ptr, base = c_null_ptr, name = c_null_ptr, address = c_null_ptr
  end type place_t

  !> What the program appends to the name of a file that it will put in the place of another. Nobody
  !! else's files have such names.
  character(*), parameter, public :: draft_ending = ".igaform-new"

  !> The result of glob; the tail is room for what the C library keeps there.
  type, bind(C) :: glob_t
    integer(c_size_t) :: n = 0
    type(c_ptr) :: paths = c_null_ptr
    integer(c_size_t) :: rest(14) = 0
  end type glob_t

  integer(c_int), parameter :: to_read = 0, no_wait = 2048, folder_only = 65536, &
                               no_link = 131072   ! of Linux on x86
  integer(c_int), parameter :: owner_alone = 448, owner_reads_and_writes = 384   ! 0700, 0600

  !> What the system knows of a file.
  type :: facts_t
    integer :: kind = 0        ! see `kinds`
    integer :: mode = 0
    integer :: owner = -1
    integer(int64) :: n_bytes = -1
  end type facts_t

  integer, parameter :: plain_file = 8
  character(6), parameter :: kinds(0:15) = [character(6) :: "", "pipe", "device", "", "folder", &
    "", "device", "", "file", "", "", "", "socket", "", "", ""]

  interface
    type(c_ptr) function c_dlopen(path, flags) bind(C, name="dlopen")
      import :: c_char, c_int, c_ptr
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: flags
    end function c_dlopen

    type(c_ptr) function c_dlerror() bind(C, name="dlerror")
      import :: c_ptr
    end function c_dlerror

    integer(c_int) function c_dladdr(address, place) bind(C, name="dladdr")
      import :: c_int, c_ptr, place_t
      type(c_ptr), value :: address
      type(place_t), intent(out) :: place
    end function c_dladdr

    type(c_ptr) function c_realpath(path, resolved) bind(C, name="realpath")
      import :: c_char, c_ptr
      character(kind=c_char), intent(in) :: path(*)
      type(c_ptr), value :: resolved
    end function c_realpath

    integer(c_size_t) function c_readlink(path, buffer, size) bind(C, name="readlink")
      import :: c_char, c_size_t
      character(kind=c_char), intent(in) :: path(*)
      character(kind=c_char), intent(out) :: buffer(*)
      integer(c_size_t), value :: size
    end function c_readlink

    integer(c_int) function c_glob(pattern, flags, on_error, found) bind(C, name="glob")
      import :: c_char, c_int, c_ptr, glob_t
      character(kind=c_char), intent(in) :: pattern(*)
      integer(c_int), value :: flags
      type(c_ptr), value :: on_error
      type(glob_t), intent(inout) :: found
    end function c_glob

    subroutine c_globfree(found) bind(C, name="globfree")
      import :: glob_t
      type(glob_t), intent(inout) :: found
    end subroutine c_globfree

    integer(c_int) function c_fsync(descriptor) bind(C, name="fsync")
      import :: c_int
      integer(c_int), value :: descriptor
    end function c_fsync

    type(c_ptr) function c_errno_place() bind(C, name="__errno_location")
      import :: c_ptr
    end function c_errno_place

    type(c_ptr) function c_strerror(number) bind(C, name="strerror")
      import :: c_int, c_ptr
      integer(c_int), value :: number
    end function c_strerror

    integer(c_int) function c_unlink(path) bind(C, name="unlink")
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
    end function c_unlink

    integer(c_int) function c_memory(name, flags) bind(C, name="memfd_create")
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: name(*)
      integer(c_int), value :: flags
    end function c_memory

    integer(c_int) function c_close(descriptor) bind(C, name="close")
      import :: c_int
      integer(c_int), value :: descriptor
    end function c_close

    integer(c_size_t) function c_pread(descriptor, bytes, length, offset) bind(C, name="pread")
      import :: c_char, c_int, c_size_t
      integer(c_int), value :: descriptor
      character(kind=c_char), intent(out) :: bytes(*)
      integer(c_size_t), value :: length, offset
    end function c_pread

    integer(c_int) function c_chmod(path, mode) bind(C, name="chmod")
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_chmod

    integer(c_int) function c_user() bind(C, name="geteuid")
      import :: c_int
    end function c_user
  end interface

contains

  !> The path without links, dots and double strokes. Of a file that is not there yet the folder is
  !! resolved; a path into no folder comes back as it is.
  function true_path(path) result(resolved)
    character(*), intent(in) :: path
    character(:), allocatable :: resolved
    integer :: stroke

    resolved = resolve(path)
    if (resolved /= "") return
    stroke = index(path, "/", back=.true.)
    resolved = resolve(folder_of(path))
    if (resolved == "") then
      resolved = path
    else if (resolved == "/") then
      resolved = "/"//path(stroke + 1:)
    else
      resolved = resolved//"/"//path(stroke + 1:)
    end if
  end function true_path

  !> The folder of a file, without a slash at its end unless it is the root.
  pure function folder_of(path) result(folder)
    character(*), intent(in) :: path
    character(:), allocatable :: folder
    integer :: last

    last = index(path, "/", back=.true.)
    folder = path(:max(last - 1, min(last, 1)))
    if (last == 0) folder = "."
  end function folder_of

  !> The folder of the running program, also where its file is gone or another one has its place: a
  !! run may last longer than that.
  function program_folder() result(folder)
    character(:), allocatable :: folder
    character(4096) :: path
    integer(c_size_t) :: n

    n = c_readlink("/proc/self/exe"//c_null_char, path, len(path, c_size_t))
    folder = folder_of(path(:max(n, 0_c_size_t)))
  end function program_folder

  !> The folder above that of the program, or one higher, that a file lies below; empty if neither.
  function folder_above(file) result(folder)
    character(*), intent(in) :: file                !! such as lib/libigaform_user.so
    character(:), allocatable :: folder
    logical :: is_there
    integer :: i

    folder = program_folder()
    do i = 1, 2
      folder = folder//"/.."
      inquire (file=folder//"/"//file, exist=is_there)
      if (is_there) return
    end do
    folder = ""
  end function folder_above

  !> Load a shared library, whose names serve itself alone. One that is apart, with those that it
  !! loads, takes its own procedures before those of the program that have the same names.
  subroutine load_library(path, handle, why, is_apart)
    character(*), intent(in) :: path
    type(c_ptr), intent(out) :: handle                  !! null if that failed
    character(:), allocatable, intent(out) :: why       !! in the words of the loader
    logical, intent(in), optional :: is_apart
    integer(c_int), parameter :: all_now = 2_c_int      ! RTLD_NOW
    integer(c_int), parameter :: deep = 8_c_int         ! RTLD_DEEPBIND
    integer(c_int) :: flags
    type(c_ptr) :: words

    why = ""
    flags = all_now
    if (present(is_apart)) flags = merge(all_now + deep, all_now, is_apart)
    handle = c_dlopen(path//c_null_char, flags)
    if (c_associated(handle)) return
    words = c_dlerror()
    if (c_associated(words)) why = fortran_text(words)
  end subroutine load_library

  !> A procedure of a loaded library, or with a null pointer of the program itself; null if there is
  !! none of this name.
  function procedure_in(library, name) result(address)
    type(c_ptr), intent(in) :: library
    character(*), intent(in) :: name
    type(c_funptr) :: address

    address = transfer(c_dlsym(library, name//c_null_char), c_null_funptr)
  end function procedure_in

  function resolve(path) result(resolved)
    character(*), intent(in) :: path
    character(:), allocatable :: resolved
    type(c_ptr) :: found

    resolved = ""
    found = c_realpath(path//c_null_char, c_null_ptr)
    if (.not. c_associated(found)) return
    resolved = fortran_text(found)
    call c_free(found)
  end function resolve

  !> A text of the C library.
  function fortran_text(address) result(text)
    type(c_ptr), intent(in) :: address
    character(:), allocatable :: text
    character(kind=c_char), pointer :: letters(:)

    call c_f_pointer(address, letters, [c_strlen(address)])
    allocate (character(size(letters)) :: text)
    text = transfer(letters, text)
  end function fortran_text

  !> Files of a folder whose names have the ending, in order of their names.
  subroutine matching_files(folder, ending, files)
    character(*), intent(in) :: folder, ending
    type(string_t), allocatable, intent(out) :: files(:)
    character(:), allocatable :: pattern
    type(c_ptr), pointer :: paths(:)
    type(glob_t) :: found
    character(*), parameter :: escape = achar(92)   ! a backslash: flang's preprocessor doubles it
    integer :: i

    pattern = ""
    do i = 1, len(folder)
      if (scan(folder(i:i), "*?[]"//escape) > 0) pattern = pattern//escape
      pattern = pattern//folder(i:i)
    end do
    if (c_glob(pattern//"/*"//ending//c_null_char, 0_c_int, c_null_ptr, found) /= 0) then
      allocate (files(0))
      return
    end if
    call c_f_pointer(found%paths, paths, [found%n])
    allocate (files(found%n))
    do i = 1, size(files)
      files(i)%value = fortran_text(paths(i))
    end do
    call c_globfree(found)
  end subroutine matching_files

  !> Is there a folder of this name?
  logical function is_folder(path)
    character(*), intent(in) :: path

    inquire (file=path//"/.", exist=is_folder)
  end function is_folder

  !> What a path leads to: "file", "folder", "pipe", "device" or "socket"; empty if to nothing, or
  !! if that is unknown. Nothing is opened, for a pipe may keep who opens it waiting for ever.
  function kind_of_file(path) result(kind)
    character(*), intent(in) :: path
    character(:), allocatable :: kind
    type(facts_t) :: facts

    facts = facts_of(path)
    kind = trim(kinds(facts%kind))
  end function kind_of_file

  !> Why a plain file may not be written; empty where it may or where there is none. In a folder
  !! that may be written it could be replaced all the same.
  function why_protected(path) result(why)
    character(*), intent(in) :: path
    character(:), allocatable :: why
    character(256) :: message
    integer :: unit, status

    why = ""
    if (kind_of_file(path) /= "file") return
    open (newunit=unit, file=path, action="write", access="stream", status="old", iostat=status, &
          iomsg=message)
    if (status == 0) close (unit, iostat=status, iomsg=message)
    if (status /= 0) why = trim(message)
  end function why_protected

  !> Bytes of a plain file as the system knows it, -1 if there is none. INQUIRE counts for an open
  !! file what was written to it, whether or not the disk took it.
  integer(int64) function bytes_on_disk(path) result(n_bytes)
    character(*), intent(in) :: path
    type(facts_t) :: facts

    facts = facts_of(path)
    n_bytes = -1
    if (facts%kind == plain_file) n_bytes = facts%n_bytes
  end function bytes_on_disk

  !> Is there something of this name that is no plain file?
  logical function is_no_file(path)
    character(*), intent(in) :: path
    type(facts_t) :: facts

    facts = facts_of(path)
    is_no_file = facts%kind /= plain_file .and. kinds(facts%kind) /= ""
  end function is_no_file

  !> Wait until a file, or the names in a folder, are on the disk; false if that failed.
  logical function sync_file(path, reason) result(is_synced)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out), optional :: reason   !! of the failure, else empty
    type(c_ptr) :: stream
    character(:), allocatable :: why

    why = ""
    stream = c_fopen(path//c_null_char, "r"//c_null_char)
    is_synced = c_associated(stream)
    if (is_synced) is_synced = c_fsync(c_fileno(stream)) == 0
    if (.not. is_synced) why = system_reason()
    if (c_associated(stream)) is_synced = c_fclose(stream) == 0 .and. is_synced
    if (.not. is_synced .and. why == "") why = system_reason()
    if (present(reason)) reason = why
  end function sync_file

  !> Put a finished file in the place of an older one, in one go: whoever looks, even after a crash,
  !! finds the one or the other. False if that failed; then the older one is still there.
  logical function replace_file(new, path, reason) result(is_replaced)
    character(*), intent(in) :: new, path
    character(:), allocatable, intent(out), optional :: reason   !! of the failure, else empty
    logical :: ignored

    is_replaced = c_rename(new//c_null_char, path//c_null_char) == 0
    if (present(reason)) then
      reason = ""
      if (.not. is_replaced) reason = system_reason()
    end if
    ! Some file systems know no sync of a folder; the file itself is safe.
    if (is_replaced) ignored = sync_file(folder_of(path))
  end function replace_file

  !> Bring a finished file to the disk, then put it in the place of an older one, which stays if
  !! that fails.
  subroutine install_file(new, path, why)
    character(*), intent(in) :: new, path
    character(:), allocatable, intent(out) :: why    !! what failed; empty if nothing did
    character(:), allocatable :: reason

    why = ""
    if (.not. sync_file(new, reason)) then
      why = "cannot bring it to the disk: "//reason
    else if (.not. replace_file(new, path, reason)) then
      why = "cannot put it in its place: "//reason
    end if
  end subroutine install_file

  !> Delete a file, if it is there.
  subroutine remove_file(path, reason)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out), optional :: reason   !! why it stays; else empty
    integer(c_int) :: status

    status = c_unlink(path//c_null_char)
    if (.not. present(reason)) return
    reason = ""
    if (status /= 0) reason = system_reason()
    if (kind_of_file(path) == "") reason = ""
  end subroutine remove_file

  !> Create a folder if it is not there. If that fails, so does what wants to write there.
  subroutine make_folder(path)
    character(*), intent(in) :: path
    integer(c_int), parameter :: mode = 493_c_int   ! 0755
    integer(c_int) :: ignored

    ignored = c_mkdir(path//c_null_char, mode)
  end subroutine make_folder

  !> Why the last call of the system failed, in its words.
  function system_reason() result(reason)
    character(:), allocatable :: reason
    integer(c_int), pointer :: number

    call c_f_pointer(c_errno_place(), number)
    reason = fortran_text(c_strerror(number))
  end function system_reason

  !> Do both paths lead to the same file that is there? Links count as the file that they lead to;
  !! a file that is not there yet is the same as none.
  logical function is_same_file(one, other) result(is_same)
    character(*), intent(in) :: one, other
    character(:), allocatable :: kind
    integer :: unit, status, found

    is_same = one == other
    if (is_same) return
    kind = kind_of_file(one)
    if (kind == "") return
    is_same = true_path(one) == true_path(other)
    if (is_same .or. kind /= "file") return
    ! That leaves hard links. The library of gfortran knows an open file by device and inode, under
    ! whatever name it is asked for; one that goes by the name finds no unit.
    open (newunit=unit, file=one, status="old", action="read", iostat=status)
    if (status /= 0) return
    inquire (file=other, number=found)
    is_same = found == unit
    close (unit)
  end function is_same_file

  !> Does the path lead to one of these files?
  logical function is_any_of_files(path, files) result(is_any)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: files(:)
    integer :: i

    is_any = any([(is_same_file(path, files(i)%value), i=1, size(files))])
  end function is_any_of_files

  !> File name, with its version and its length, of the shared library that a symbol comes from,
  !! links resolved, without its folder; "static" where it comes from none. Libraries of one name
  !! that were built otherwise hardly ever have the same length.
  function library_of(symbol) result(name)
    character(*), intent(in) :: symbol
    character(:), allocatable :: name
    type(place_t) :: place
    type(c_ptr) :: address
    character(40) :: length

    name = "static"
    address = c_dlsym(c_null_ptr, symbol//c_null_char)
    if (.not. c_associated(address)) return
    if (c_dladdr(address, place) == 0 .or. .not. c_associated(place%path)) return
    name = true_path(fortran_text(place%path))
    write (length, "(a,i0,a)") " (", bytes_on_disk(name), " bytes)"
    name = name(index(name, "/", back=.true.) + 1:)//trim(length)
  end function library_of

  !> Open a folder that belongs to the user and that nobody else can write to, and create it with
  !! those above it if it is not there. Fails where it belongs to somebody else, where others may
  !! write to it, where it is a link, or where there is none. It stays open until `close_file`.
  subroutine open_own_folder(path, descriptor, error)
    character(*), intent(in) :: path
    integer, intent(out) :: descriptor
    type(error_t), allocatable, intent(out) :: error
    type(facts_t) :: facts
    integer(c_int) :: ignored
    integer :: i

    do i = 2, len(path)
      if (path(i:i) == "/") ignored = c_mkdir(path(:i - 1)//c_null_char, owner_alone)
    end do
    ignored = c_mkdir(path//c_null_char, owner_alone)
    descriptor = int(c_open(path//c_null_char, ior(ior(to_read, folder_only), no_link)))
    if (descriptor < 0) then
      call fail(error, "the folder "//path//" cannot be opened: it cannot be created, may "// &
                "not be read, or is a link or a file")
      return
    end if
    facts = facts_of("", descriptor)
    if (facts%owner /= int(c_user())) then
      call fail(error, "the folder "//path//" belongs to another user (number "// &
                to_text(facts%owner)//"), who could put a library there")
    else if (may_others_write(facts)) then
      call fail(error, "others may write to the folder "//path//", and could put a library "// &
                "there; remove what is in it and close it by chmod 700")
    end if
    if (allocated(error)) call close_file(descriptor)
  end subroutine open_own_folder

  !> Open a plain file that belongs to the user and that nobody else can write to; below zero where
  !! there is none such. A link is none.
  integer function open_own_file(path) result(descriptor)
    character(*), intent(in) :: path
    type(facts_t) :: facts
    integer(c_int) :: user

    descriptor = int(c_open(path//c_null_char, ior(ior(to_read, no_wait), no_link)))
    if (descriptor < 0) return
    facts = facts_of("", descriptor)
    user = c_user()
    if (facts%kind == plain_file .and. facts%owner == int(user) .and. &
        .not. may_others_write(facts)) return
    call close_file(descriptor)
    descriptor = -1
  end function open_own_file

  !> A file without a name that is kept in memory until it is closed; below zero where there is no
  !! memory for it.
  integer function open_memory() result(descriptor)
    descriptor = int(c_memory("igaform"//c_null_char, 0_c_int))
  end function open_memory

  subroutine close_file(descriptor)
    integer, intent(in) :: descriptor
    integer(c_int) :: ignored

    ignored = c_close(int(descriptor, c_int))
  end subroutine close_file

  !> A path to what is open, for this process and those that it starts. Whatever is put under its
  !! name meanwhile, this leads to what was opened.
  function path_of(descriptor) result(path)
    integer, intent(in) :: descriptor
    character(:), allocatable :: path

    path = "/proc/self/fd/"//to_text(descriptor)
  end function path_of

  !> SHA-256 of an open file, read through its descriptor; empty if it cannot be read.
  function digest_of(descriptor) result(text)
    integer, intent(in) :: descriptor
    character(:), allocatable :: text
    integer, parameter :: block = 65536
    character(kind=c_char), allocatable :: bytes(:)
    character(:), allocatable :: part
    type(sha256_t) :: digest
    integer(c_size_t) :: offset, n

    allocate (bytes(block))
    allocate (character(block) :: part)
    offset = 0_c_size_t
    text = ""
    do
      n = c_pread(int(descriptor, c_int), bytes, int(block, c_size_t), offset)
      if (n < 0) return
      if (n == 0) exit
      part = transfer(bytes, part)
      call add_to_digest(digest, part(:n))
      offset = offset + n
    end do
    text = sha256_text(digest)
  end function digest_of

  !> Let nobody but the owner read and write a file.
  subroutine keep_to_owner(path)
    character(*), intent(in) :: path
    integer(c_int) :: ignored

    ignored = c_chmod(path//c_null_char, owner_reads_and_writes)
  end subroutine keep_to_owner

  type(facts_t) function facts_of(path, descriptor) result(facts)
    character(*), intent(in) :: path
    integer, intent(in), optional :: descriptor   !! with an empty path
    integer(c_int), parameter :: folder_in_hand = -100, what_is_open = 4096, basic_facts = 2047
    integer(c_int16_t) :: halves(128)             ! the 256 bytes of Linux's struct statx
    integer, parameter :: half = 65536
    integer(c_int) :: folder, flags

    folder = folder_in_hand
    flags = 0
    if (present(descriptor)) then
      folder = int(descriptor, c_int)
      flags = what_is_open
    end if
    halves = 0
    if (c_statx(folder, path//c_null_char, flags, basic_facts, halves) /= 0) return
    facts%owner = iand(int(halves(11)), half - 1) + half*int(halves(12))   ! at byte 20
    facts%mode = ibits(int(halves(15)), 0, 12)                             ! at byte 28
    facts%kind = ibits(int(halves(15)), 12, 4)
    facts%n_bytes = transfer(halves(21:24), facts%n_bytes)                 ! at byte 40
  end function facts_of

  pure logical function may_others_write(facts)
    type(facts_t), intent(in) :: facts
    integer, parameter :: group_writes = 16, all_write = 2   ! 0020, 0002

    may_others_write = iand(facts%mode, group_writes + all_write) /= 0
  end function may_others_write

end module system_files
