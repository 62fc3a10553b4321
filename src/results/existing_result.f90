!> What is in a result file that exists: whose it is, whether another may replace it, how its run
!! ended.
module existing_result
  use, intrinsic :: iso_fortran_env, only: int64
  use, intrinsic :: iso_c_binding, only: c_null_char
  use kinds, only: wp
  use failure, only: error_t, fail
  use file_lock, only: is_locked_by_others
  use system_files, only: is_no_file, kind_of_file
  use hdf5_library, only: hid_t, h5fis_hdf5, is_library_ready
  use hdf5_reading, only: open_for_reading, close_reading, read_text_attribute, is_of_others, &
                          names_in, has_name, read_numbers
  implicit none
  private

  public :: check_replaceable, is_checkpoint_state
  public :: result_state_t, read_result_state

  character(*), parameter, public :: test_content = "material tests"   !! attribute `content` of
                                                                       !! such a result

  !> A run as its result file describes it; texts are empty and numbers zero where it does not.
  type :: result_state_t
    character(:), allocatable :: status      !! running, completed, failed or interrupted
    character(:), allocatable :: identity    !! digest of deck and program
    real(wp) :: wall_seconds = 0.0_wp, n_steps = 0.0_wp
    real(wp) :: energy_error = 0.0_wp        !! in the last row of the history
  end type result_state_t

contains

  !> Reject what others use or have made, a result of another kind, and a checkpoint, which may be
  !! all that is left of a run. An empty file may be what a killed run has begun.
  subroutine check_replaceable(path, content, error)
    character(*), intent(in) :: path
    character(*), intent(in) :: content     !! of what replaces it: `test_content`, or empty for
                                            !! a forming run
    type(error_t), allocatable, intent(inout) :: error
    integer(int64) :: n_bytes
    logical :: is_result, is_state

    if (kind_of_file(path) == "") return
    if (is_no_file(path)) then
      call fail(error, "result file '"//path//"': there is a "//kind_of_file(path)// &
                " of this name, which is not a result file; it is left alone")
      return
    end if
    inquire (file=path, size=n_bytes)
    is_result = is_library_ready()
    if (is_result) is_result = h5fis_hdf5(path//c_null_char) > 0
    if (is_result) is_result = .not. is_of_others(path)
    is_state = is_checkpoint_state(path)
    if (is_locked_by_others(path)) then
      call fail(error, "result file '"//path//"': another program is using it; choose another "// &
                "name or close it there")
    else if (is_state) then
      call fail(error, "result file '"//path//"': there is a checkpoint of this name; it is "// &
                "left alone; continue from it with --restart, and name another result with --out")
    else if (n_bytes > 0 .and. .not. is_result) then
      call fail(error, "result file '"//path//"': there is a file of this name that is not a "// &
                "result file; it is left alone")
    else if (is_of_other_kind(path, content)) then
      call fail(error, "result file '"//path//"': there is the result of "// &
                trim(merge("a forming run ", "material tests", content == test_content))// &
                " of this name; it is left alone; name another file with --out")
    end if
  end subroutine check_replaceable

  !> Is it the result of a forming run where material tests are to be written, or the reverse? Not
  !! told of one that does not open.
  logical function is_of_other_kind(path, content)
    character(*), intent(in) :: path, content
    integer(hid_t) :: file

    is_of_other_kind = .false.
    file = open_for_reading(path)
    if (file < 0) return
    if (content == test_content) then
      is_of_other_kind = has_name(names_in(file, "/"), "history")
    else
      is_of_other_kind = read_text_attribute(file, "/", "content") == test_content
    end if
    call close_reading(file)
  end function is_of_other_kind

  !> Does the file open as the HDF5 part of a checkpoint? Results do not have its attribute.
  logical function is_checkpoint_state(path)
    character(*), intent(in) :: path
    integer(hid_t) :: file

    is_checkpoint_state = .false.
    file = open_for_reading(path)
    if (file >= 0) is_checkpoint_state = read_text_attribute(file, "/", "deck_file") /= ""
    call close_reading(file)
  end function is_checkpoint_state

  !> Read it; of a file that cannot be read all is empty.
  subroutine read_result_state(path, state)
    character(*), intent(in) :: path
    type(result_state_t), intent(out) :: state
    integer(hid_t) :: file
    real(wp), allocatable :: values(:)

    state%status = ""
    state%identity = ""
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

end module existing_result
