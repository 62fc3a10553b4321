!> igaform-mpi with messages that come late: IGAFORM_LATENCY in seconds, IGAFORM_RATE in bytes a
!! second.
program delayed_main
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: error_unit
  use c_library, only: c_exit
  use kinds, only: wp
  use delayed_ranks, only: delayed_ranks_t
  use mpi_program, only: run_program
  implicit none

  type(delayed_ranks_t) :: ranks
  logical :: is_good

  call read_variable("IGAFORM_LATENCY", ranks%latency, is_good)
  if (is_good) call read_variable("IGAFORM_RATE", ranks%rate, is_good)
  if (.not. is_good) then
    write (error_unit, "(a)") "IGAFORM_LATENCY, IGAFORM_RATE: expected numbers, not negative"
    call c_exit(1_c_int)
  end if
  call run_program(ranks)

contains

  !> A number of the environment, if it is there.
  subroutine read_variable(name, value, is_good)
    character(*), intent(in) :: name
    real(wp), intent(inout) :: value
    logical, intent(out) :: is_good
    character(40) :: word
    integer :: length, status

    is_good = .true.
    call get_environment_variable(name, word, length)
    if (length == 0) return
    read (word, *, iostat=status) value
    is_good = status == 0 .and. value >= 0.0_wp
  end subroutine read_variable
end program delayed_main
