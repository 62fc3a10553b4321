!> Which files a result may take the place of: its own and those of killed runs, not other people's.
module result_guard
  use, intrinsic :: iso_fortran_env, only: int64
  use, intrinsic :: iso_c_binding, only: c_null_char
  use failure, only: error_t, fail
  use file_lock, only: is_locked_by_others
  use system_files, only: is_no_file, kind_of_file
  use hdf5_library, only: hid_t, h5fis_hdf5
  use hdf5_reason, only: is_library_ready
  use hdf5_reading, only: open_for_reading, close_reading, read_text_attribute, is_of_others, &
                          names_in
  use text, only: string_t
  implicit none
  private

  public :: check_replaceable, is_checkpoint_state

  character(*), parameter, public :: test_content = "material tests"   !! attribute `content` of
                                                                       !! such a result

contains

  !> Refuse what others use or have made, a result of another kind, and a checkpoint, which may be
  !! all that is left of a run. An empty file may be what a killed run has begun.
  subroutine check_replaceable(path, content, error)
    character(*), intent(in) :: path
    character(*), intent(in) :: content     !! of what takes its place: `test_content`, or empty for
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
    type(string_t), allocatable :: names(:)
    integer(hid_t) :: file
    integer :: i

    is_of_other_kind = .false.
    file = open_for_reading(path)
    if (file < 0) return
    if (content == test_content) then
      names = names_in(file, "/")
      do i = 1, size(names)
        is_of_other_kind = is_of_other_kind .or. names(i)%value == "history"
      end do
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

end module result_guard
