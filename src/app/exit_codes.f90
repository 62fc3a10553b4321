!> Exit codes of the program and the words for them in result files.
module exit_codes
  implicit none
  private

  public :: status_of

  integer, parameter, public :: exit_done = 0
  integer, parameter, public :: exit_input = 1         !! the input is invalid
  integer, parameter, public :: exit_numerics = 2      !! the run failed
  integer, parameter, public :: exit_interrupted = 3
  integer, parameter, public :: exit_files = 4         !! the files could not be written

contains

  !> The word for an exit code in the result file.
  pure function status_of(code) result(status)
    integer, intent(in) :: code
    character(:), allocatable :: status

    select case (code)
    case (exit_done)
      status = "completed"
    case (exit_numerics)
      status = "failed"
    case default
      status = "interrupted"
    end select
  end function status_of

end module exit_codes
