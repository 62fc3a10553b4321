!> What the programs that fuzz.py feeds have in common: paths come in, one a line, and each is
!! answered with a line.
module fuzz_talk
  use, intrinsic :: iso_fortran_env, only: input_unit, iostat_eor, output_unit
  implicit none
  private

  public :: argument, next_path, answer_with

contains

  !> The next path of the standard input; not allocated at its end.
  subroutine next_path(path)
    character(:), allocatable, intent(out) :: path
    character(256) :: part
    integer :: status, n

    read (input_unit, "(a)", advance="no", size=n, iostat=status) part
    if (status /= 0 .and. status /= iostat_eor) return
    path = part(:n)
    do while (status == 0)
      read (input_unit, "(a)", advance="no", size=n, iostat=status) part
      path = path//part(:n)
    end do
  end subroutine next_path

  !> An argument of the command line.
  function argument(number) result(text)
    integer, intent(in) :: number
    character(:), allocatable :: text
    integer :: length

    call get_command_argument(number, length=length)
    allocate (character(length) :: text)
    call get_command_argument(number, text)
  end function argument

  !> Answer the last path, at once.
  subroutine answer_with(text)
    character(*), intent(in) :: text

    write (output_unit, "(a)") text
    flush (output_unit)
  end subroutine answer_with

end module fuzz_talk
