!> The HDF5 library made ready, and why a call of it failed, in the system's own words.
module hdf5_reason
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_funloc, c_int, c_loc, &
                                         c_null_char, c_null_funptr, c_null_ptr, c_ptr
  use hdf5_library, only: h5_default, h5_walk_upward, h5dont_atexit, h5eset_auto, &
                          h5ewalk, h5open, hid_t
  implicit none
  private

  public :: failure_reason, is_library_ready

  integer, parameter :: max_length = 512

  ! One entry of the library's error stack (H5E_error2_t).
  type, bind(C) :: entry_t
    integer(hid_t) :: class, major, minor
    integer(c_int) :: line
    type(c_ptr) :: procedure_name, file_name, description
  end type entry_t

  type :: reason_t
    character(max_length) :: text = ""
  end type reason_t

contains

  !> The innermost entry of the library's error stack; of system errors the system's message.
  function failure_reason() result(reason)
    character(:), allocatable :: reason
    type(reason_t), target :: found
    character(*), parameter :: mark = "error message = '"
    integer :: first, length

    reason = "unknown reason"
    if (h5ewalk(h5_default, h5_walk_upward, c_funloc(take_description), c_loc(found)) < 0) return
    if (len_trim(found%text) > 0) reason = trim(found%text)
    first = index(reason, mark)
    if (first == 0) return
    reason = reason(first + len(mark):)
    length = index(reason, "'") - 1
    if (length > 0) reason = reason(:length)
  end function failure_reason

  !> Open the library and keep it from printing its error stack; false if it refuses. To be called
  !! before any other call of it: left to itself it closes its files at exit, touches those again
  !! that it could not write, and crashes.
  logical function is_library_ready() result(is_ready)
    if (h5dont_atexit() < 0) continue   ! said from the second call on, and then it is known
    is_ready = h5open() >= 0
    if (is_ready) is_ready = h5eset_auto(h5_default, c_null_funptr, c_null_ptr) >= 0
  end function is_library_ready

  ! Called by the library for each entry, innermost first; ends the walk at the first.
  integer(c_int) function take_description(n, entry, data) bind(C)
    integer(c_int), value :: n
    type(entry_t), intent(in) :: entry
    type(c_ptr), value :: data
    type(reason_t), pointer :: found
    character(kind=c_char), pointer :: letters(:)
    integer :: i

    take_description = 1
    call c_f_pointer(data, found)
    call c_f_pointer(entry%description, letters, [max_length])
    do i = 1, max_length
      if (letters(i) == c_null_char .or. n > 0) exit
      found%text(i:i) = letters(i)
    end do
  end function take_description

end module hdf5_reason
