!> Messages put together and written without the heap and without the run-time library of Fortran:
!! for the end of a program in which a unit may be locked and the heap written over.
module safe_message
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_size_t
  implicit none
  private

  public :: message_t, add_text, add_number, send, open_for_lines

  integer, parameter :: longest = 800

  !> A text of fixed length; what does not fit is cut.
  type :: message_t
    character(longest) :: text = ""
    integer :: length = 0
  end type message_t

  interface
    integer(c_size_t) function c_write(descriptor, text, length) bind(C, name="write")
      import :: c_char, c_int, c_size_t
      integer(c_int), value :: descriptor
      character(kind=c_char), intent(in) :: text(*)
      integer(c_size_t), value :: length
    end function c_write

    integer(c_int) function c_open(path, flags) bind(C, name="open")
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: flags
    end function c_open
  end interface

contains

  !> Add a text behind what is there; blanks at its end count.
  pure subroutine add_text(message, text)
    type(message_t), intent(inout) :: message
    character(*), intent(in) :: text
    integer :: i

    do i = 1, min(len(text), longest - 1 - message%length)   ! one place is left for the line end
      message%length = message%length + 1
      message%text(message%length:message%length) = text(i:i)
    end do
  end subroutine add_text

  !> Add a whole number.
  pure subroutine add_number(message, number)
    type(message_t), intent(inout) :: message
    integer, intent(in) :: number
    character(10) :: digits
    integer :: rest, i

    if (number < 0) call add_text(message, "-")
    rest = number
    i = len(digits) + 1
    do
      i = i - 1
      digits(i:i) = achar(iachar("0") + abs(mod(rest, 10)))
      rest = rest/10
      if (rest == 0) exit
    end do
    call add_text(message, digits(i:))
  end subroutine add_number

  !> Descriptor of a file that is there, to add lines to its end; negative if it cannot be opened.
  integer(c_int) function open_for_lines(path) result(descriptor)
    character(kind=c_char), intent(in) :: path(*)   !! with the zero at its end
    integer(c_int), parameter :: to_append = 525313_c_int   ! of Linux: write, behind what is there;
                                                            ! not in other programs
    descriptor = c_open(path, to_append)
  end function open_for_lines

  !> Write the message as a line to an open file.
  subroutine send(message, descriptor)
    type(message_t), intent(in) :: message
    integer(c_int), intent(in) :: descriptor
    character(kind=c_char) :: line(longest)
    integer(c_size_t) :: ignored
    integer :: i

    do i = 1, message%length
      line(i) = message%text(i:i)
    end do
    line(message%length + 1) = new_line("a")
    ignored = c_write(descriptor, line, int(message%length + 1, c_size_t))
  end subroutine send

end module safe_message
