!> What a result file says of its run: how it ended and what it cost.
module result_state
  use kinds, only: wp
  use hdf5_library, only: hid_t
  use hdf5_reading, only: open_for_reading, close_reading, read_text_attribute, read_numbers
  implicit none
  private

  public :: result_state_t, read_result_state

  !> A run as its result file tells; texts are empty and numbers zero where it does not.
  type :: result_state_t
    character(:), allocatable :: status      !! running, completed, failed or interrupted
    character(:), allocatable :: identity    !! digest of deck and program
    real(wp) :: wall_seconds = 0.0_wp, n_steps = 0.0_wp
    real(wp) :: energy_error = 0.0_wp        !! in the last row of the history
  end type result_state_t

contains

  !> Read it; a file that cannot be read tells nothing.
  subroutine read_result_state(path, state)
    character(*), intent(in) :: path
    type(result_state_t), intent(out) :: state
    integer(hid_t) :: file
    real(wp), allocatable :: values(:)
    logical :: is_there

    state%status = ""
    state%identity = ""
    inquire (file=path, exist=is_there)
    if (.not. is_there) return
    file = open_for_reading(path)
    if (file < 0) return
    state%status = read_text_attribute(file, "/provenance", "status")
    state%identity = read_text_attribute(file, "/provenance", "identity")
    state%wall_seconds = last_of("/timings/wall_seconds")
    state%n_steps = last_of("/timings/steps")
    state%energy_error = last_of("/history/energy_error")
    call close_reading(file)

  contains

    real(wp) function last_of(name)
      character(*), intent(in) :: name

      call read_numbers(file, name, values)
      last_of = 0.0_wp
      if (allocated(values)) then
        if (size(values) > 0) last_of = values(size(values))
      end if
    end function last_of
  end subroutine read_result_state

end module result_state
