!> Advisory locks of whole files (flock), as the HDF5 library uses them.
module file_lock
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_null_char, c_null_ptr, c_ptr
  use c_library, only: c_fopen, c_fileno, c_fclose
  use system_files, only: is_no_file, folder_of
  implicit none
  private

  public :: is_locked_by_others, is_lock_shared, lock_t, hold_folder, hold_file, release_lock

  integer(c_int), parameter :: lock_shared = 1, lock_exclusive = 2, lock_no_wait = 4

  !> A lock on a file, or on its folder for as long as it takes to create the file.
  type :: lock_t
    private
    type(c_ptr) :: stream = c_null_ptr
  end type lock_t

  interface
    integer(c_int) function c_flock(descriptor, operation) bind(C, name="flock")
      import :: c_int
      integer(c_int), value :: descriptor, operation
    end function c_flock
  end interface

contains

  !> Whether another program has a shared lock on the file, as a writer of results does.
  !! False where the file cannot be opened and on file systems without locks.
  logical function is_locked_by_others(path) result(is_locked)
    character(*), intent(in) :: path
    type(c_ptr) :: stream
    integer(c_int) :: file, exclusive, shared

    is_locked = .false.
    if (is_no_file(path)) return
    stream = c_fopen(path//c_null_char, "r"//c_null_char)
    if (.not. c_associated(stream)) return
    file = c_fileno(stream)
    exclusive = c_flock(file, ior(lock_exclusive, lock_no_wait))
    shared = c_flock(file, ior(lock_shared, lock_no_wait))
    is_locked = c_fclose(stream) == 0 .and. exclusive /= 0 .and. shared == 0
  end function is_locked_by_others

  !> Wait until nobody else creates a file in the folder of this one: between the check whether it
  !! may be replaced and its lock nobody must do so. Without effect on file systems without locks.
  subroutine hold_folder(path, lock)
    character(*), intent(in) :: path
    type(lock_t), intent(out) :: lock
    integer(c_int) :: ignored

    lock%stream = c_fopen(folder_of(path)//c_null_char, "r"//c_null_char)
    if (c_associated(lock%stream)) ignored = c_flock(c_fileno(lock%stream), lock_exclusive)
  end subroutine hold_folder

  !> Hold a file that is to be written for as long as the lock lives, creating it if need be; false
  !! if another program has locked it. True, without effect, where it cannot be opened and on file
  !! systems without locks.
  logical function hold_file(path, lock) result(is_mine)
    character(*), intent(in) :: path
    type(lock_t), intent(out) :: lock
    type(lock_t) :: folder
    logical :: ignored

    is_mine = .true.
    if (is_no_file(path)) return
    call hold_folder(path, folder)
    is_mine = .not. is_locked_by_others(path)
    if (is_mine) lock%stream = c_fopen(path//c_null_char, "a"//c_null_char)
    if (c_associated(lock%stream)) ignored = is_lock_shared(c_fileno(lock%stream))
    call release_lock(folder)
  end function hold_file

  !> Let others in again.
  subroutine release_lock(lock)
    type(lock_t), intent(inout) :: lock
    integer(c_int) :: ignored

    if (c_associated(lock%stream)) ignored = c_fclose(lock%stream)
    lock%stream = c_null_ptr
  end subroutine release_lock

  !> Turn the lock on an open file into a shared one; false on a file system without locks.
  logical function is_lock_shared(descriptor) result(is_shared)
    integer(c_int), intent(in) :: descriptor   !! of the operating system

    is_shared = c_flock(descriptor, ior(lock_shared, lock_no_wait)) == 0
  end function is_lock_shared

end module file_lock
