!> Which libraries the program has been given at its start.
module loaded_library
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_null_char, c_null_ptr, c_ptr
  use system_files, only: fortran_text, true_path, bytes_on_disk
  implicit none
  private

  public :: library_of

  !> What dladdr tells of an address (Dl_info of the C library).
  type, bind(C) :: place_t
    type(c_ptr) :: path = c_null_ptr, base = c_null_ptr, name = c_null_ptr, address = c_null_ptr
  end type place_t

  interface
    type(c_ptr) function c_dlsym(library, symbol) bind(C, name="dlsym")
      import :: c_char, c_ptr
      type(c_ptr), value :: library
      character(kind=c_char), intent(in) :: symbol(*)
    end function c_dlsym

    integer(c_int) function c_dladdr(address, place) bind(C, name="dladdr")
      import :: c_int, c_ptr, place_t
      type(c_ptr), value :: address
      type(place_t), intent(out) :: place
    end function c_dladdr
  end interface

contains

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

end module loaded_library
