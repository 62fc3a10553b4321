!> Files of the user alone: in a folder that nobody else can write to, reached through an open
!! descriptor, so that nothing can be put in their place between the check and the use.
module trusted_files
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int16_t, c_null_char, c_size_t
  use c_library, only: c_mkdir, c_open, c_statx
  use failure, only: error_t, fail
  use text, only: to_text
  use sha256, only: sha256_t, add_to_digest, sha256_text
  implicit none
  private

  public :: open_own_folder, open_own_file, open_memory, close_file, path_of, digest_of
  public :: keep_to_owner

  integer(c_int), parameter :: to_read = 0, no_wait = 2048, folder_only = 65536, &
                               no_link = 131072   ! of Linux on x86
  integer(c_int), parameter :: owner_alone = 448, owner_reads_and_writes = 384   ! 0700, 0600

  !> Who may do what with a file.
  type :: access_t
    integer :: kind = 0        ! 4: a folder, 8: a plain file
    integer :: mode = 0
    integer :: owner = -1
  end type access_t

  interface
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

  !> Open a folder that belongs to the user and that nobody else can write to, and create it with
  !! those above it if it is not there. Fails where it belongs to somebody else, where others may
  !! write to it, where it is a link, or where there is none. It stays open until `close_file`.
  subroutine open_own_folder(path, descriptor, error)
    character(*), intent(in) :: path
    integer, intent(out) :: descriptor
    type(error_t), allocatable, intent(out) :: error
    type(access_t) :: access
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
    access = access_of(descriptor)
    if (access%owner /= int(c_user())) then
      call fail(error, "the folder "//path//" belongs to another user (number "// &
                to_text(access%owner)//"), who could put a library there")
    else if (may_others_write(access)) then
      call fail(error, "others may write to the folder "//path//", and could put a library "// &
                "there; remove what is in it and close it by chmod 700")
    end if
    if (allocated(error)) call close_file(descriptor)
  end subroutine open_own_folder

  !> Open a plain file that belongs to the user and that nobody else can write to; below zero where
  !! there is none such. A link is none.
  integer function open_own_file(path) result(descriptor)
    character(*), intent(in) :: path
    type(access_t) :: access
    integer(c_int) :: user

    descriptor = int(c_open(path//c_null_char, ior(ior(to_read, no_wait), no_link)))
    if (descriptor < 0) return
    access = access_of(descriptor)
    user = c_user()
    if (access%kind == 8 .and. access%owner == int(user) .and. &
        .not. may_others_write(access)) return
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
    integer :: i

    allocate (bytes(block))
    allocate (character(block) :: part)
    offset = 0_c_size_t
    text = ""
    do
      n = c_pread(int(descriptor, c_int), bytes, int(block, c_size_t), offset)
      if (n < 0) return
      if (n == 0) exit
      do i = 1, int(n)
        part(i:i) = bytes(i)
      end do
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

  type(access_t) function access_of(descriptor) result(access)
    integer, intent(in) :: descriptor
    integer(c_int), parameter :: what_is_open = 4096, basic_facts = 2047
    integer(c_int16_t) :: facts(128)          ! the 256 bytes of Linux's struct statx
    integer, parameter :: half = 65536

    facts = 0
    if (c_statx(int(descriptor, c_int), c_null_char, what_is_open, basic_facts, facts) /= 0) return
    access%owner = iand(int(facts(11)), half - 1) + half*int(facts(12))   ! at byte 20
    access%mode = ibits(int(facts(15)), 0, 12)                            ! at byte 28
    access%kind = ibits(int(facts(15)), 12, 4)
  end function access_of

  pure logical function may_others_write(access)
    type(access_t), intent(in) :: access
    integer, parameter :: group_writes = 16, all_write = 2   ! 0020, 0002

    may_others_write = iand(access%mode, group_writes + all_write) /= 0
  end function may_others_write

end module trusted_files
