!> What the programs that fuzz.py feeds have in common: paths come in, one a line, and each is
!! answered with a line.
module fuzz_talk
  use, intrinsic :: iso_fortran_env, only: input_unit, output_unit
  implicit none
  private

  public :: next_path, answer_with

contains

  !> The next path of the standard input; not allocated at its end.
  subroutine next_path(path)
    character(:), allocatable, intent(out) :: path
    character(1000) :: line
    integer :: status

    read (input_unit, "(a)", iostat=status) line
    if (status == 0) path = trim(line)
  end subroutine next_path

  !> Answer the last path, at once.
  subroutine answer_with(text)
    character(*), intent(in) :: text

    write (output_unit, "(a)") text
    flush (output_unit)
  end subroutine answer_with

end module fuzz_talk
