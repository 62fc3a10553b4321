!> igaform-mpi with messages that come late: IGAFORM_LATENCY in seconds, IGAFORM_RATE in bytes a
!! second.
program delayed_main
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds, only: wp
  use delayed_ranks, only: delayed_ranks_t
  use mpi_program, only: run_program
  implicit none

  type(delayed_ranks_t) :: ranks

  call read_variable("IGAFORM_LATENCY", ranks%latency)
  call read_variable("IGAFORM_RATE", ranks%rate)
  call run_program(ranks)

contains

  !> A number of the environment, if it is there.
  subroutine read_variable(name, value)
    character(*), intent(in) :: name
    real(wp), intent(inout) :: value
    character(40) :: word
    integer :: length, status

    call get_environment_variable(name, word, length)
    if (length == 0) return
    read (word, *, iostat=status) value
    if (status /= 0 .or. .not. value >= 0.0_wp) then
      write (error_unit, "(a)") name//": found "//trim(word)//", expected a number, not negative"
      error stop 1
    end if
  end subroutine read_variable
end program delayed_main
