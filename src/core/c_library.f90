!> Interfaces of the procedures of the C library that several modules call. One that a single module
!! calls has its interface there.
module c_library
  use, intrinsic :: iso_c_binding, only: c_char, c_funptr, c_int, c_int16_t, c_ptr, c_size_t
  implicit none
  private

  public :: c_exit, c_exit_now, c_signal, c_raise, c_free, c_strlen, c_dlsym
  public :: c_open, c_write, c_fopen, c_fileno, c_fclose, c_statx, c_mkdir, c_rename

  interface
    !> End the program: what was registered for the end is called, and units are closed.
    subroutine c_exit(code) bind(C, name="exit")
      import :: c_int
      integer(c_int), value :: code
    end subroutine c_exit

    !> End the program at once.
    subroutine c_exit_now(code) bind(C, name="_exit")
      import :: c_int
      integer(c_int), value :: code
    end subroutine c_exit_now

    !> Set the handler of a signal; the result is the one before.
    type(c_funptr) function c_signal(number, handler) bind(C, name="signal")
      import :: c_funptr, c_int
      integer(c_int), value :: number
      type(c_funptr), value :: handler
    end function c_signal

    !> Send a signal to this thread.
    integer(c_int) function c_raise(number) bind(C, name="raise")
      import :: c_int
      integer(c_int), value :: number
    end function c_raise

    !> Give memory back that the C library has allocated.
    subroutine c_free(memory) bind(C, name="free")
      import :: c_ptr
      type(c_ptr), value :: memory
    end subroutine c_free

    !> Length of a text up to the zero that ends it.
    integer(c_size_t) function c_strlen(text) bind(C, name="strlen")
      import :: c_ptr, c_size_t
      type(c_ptr), value :: text
    end function c_strlen

    !> Address of a symbol of a loaded library, or (null) of the program; null if there is none.
    type(c_ptr) function c_dlsym(library, symbol) bind(C, name="dlsym")
      import :: c_char, c_ptr
      type(c_ptr), value :: library
      character(kind=c_char), intent(in) :: symbol(*)
    end function c_dlsym

    !> Descriptor of a file that is there; negative if it cannot be opened.
    integer(c_int) function c_open(path, flags) bind(C, name="open")
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: flags
    end function c_open

    !> Write bytes to a descriptor; the result is their number, or negative.
    integer(c_size_t) function c_write(descriptor, text, n) bind(C, name="write")
      import :: c_char, c_int, c_size_t
      integer(c_int), value :: descriptor
      character(kind=c_char), intent(in) :: text(*)
      integer(c_size_t), value :: n
    end function c_write

    !> Stream of a file; null if it cannot be opened.
    type(c_ptr) function c_fopen(path, mode) bind(C, name="fopen")
      import :: c_char, c_ptr
      character(kind=c_char), intent(in) :: path(*), mode(*)
    end function c_fopen

    !> Descriptor of a stream.
    integer(c_int) function c_fileno(stream) bind(C, name="fileno")
      import :: c_int, c_ptr
      type(c_ptr), value :: stream
    end function c_fileno

    !> Close a stream; 0 if that went well.
    integer(c_int) function c_fclose(stream) bind(C, name="fclose")
      import :: c_int, c_ptr
      type(c_ptr), value :: stream
    end function c_fclose

    !> What the system knows of a file: 256 bytes; 0 if that went well.
    integer(c_int) function c_statx(folder, path, flags, mask, facts) bind(C, name="statx")
      import :: c_char, c_int, c_int16_t
      integer(c_int), value :: folder, flags, mask
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int16_t), intent(inout) :: facts(*)
    end function c_statx

    !> Create a folder; 0 if that went well.
    integer(c_int) function c_mkdir(path, mode) bind(C, name="mkdir")
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_mkdir

    !> Give a file another name, in the place of a file that has it; 0 if that went well.
    integer(c_int) function c_rename(old, new) bind(C, name="rename")
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: old(*), new(*)
    end function c_rename
  end interface

end module c_library
