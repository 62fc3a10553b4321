!> The files that a run writes next to its result: their names, none of which may be one that it
!! reads; and those with messages, NAME.msg of a user's subroutines and NAME.err of a run in a
!! batch. The first line of these names who wrote them; one with nothing after it is removed.
module output_files
  use, intrinsic :: iso_fortran_env, only: error_unit, int64
  use text, only: string_t, lower_case
  use failure, only: error_t, fail
  use system_files, only: is_same_file, is_any_of_files, remove_file, true_path
  use command_line, only: command_t
  use scene, only: scene_t
  use text_file, only: why_left_alone
  implicit none
  private

  public :: base_of, result_base, file_name, files_read, result_path, path_beside_result
  public :: check_message_file, open_message_file, close_message_file
  public :: error_file_problem, begin_error_file, note_failed_run, end_error_file, first_error
  public :: is_noted_as_failed

  integer, parameter :: message_unit = 7   ! where subroutines of users write messages
  character(*), parameter :: message_mark = "igaform: messages of the user's subroutines (unit 7)"
  character(*), parameter :: error_mark = "igaform batch: messages of "
  character(*), parameter :: failure_mark = "igaform batch: failed, run "

contains

  !> All that the run reads: the deck with the files that it includes, and those of --user.
  function files_read(command, scene) result(files)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(string_t), allocatable :: files(:)
    integer :: i, n

    n = size(scene%files)
    allocate (files(n + size(command%user_files)))
    do i = 1, n
      files(i)%value = scene%files(i)%value
    end do
    do i = 1, size(command%user_files)
      files(n + i)%value = command%user_files(i)%value
    end do
  end function files_read

  !> The result file: that of --out, or that next to the checkpoint of --restart, or the name of the
  !! deck with `.h5` in the folder in hand. Fails if it is a file that the run reads.
  subroutine result_path(command, read_files, path, error)
    type(command_t), intent(in) :: command
    type(string_t), intent(in) :: read_files(:)
    character(:), allocatable, intent(out) :: path
    type(error_t), allocatable, intent(out) :: error

    path = command%output
    if (path == "" .and. command%restart /= "") path = result_of_checkpoint(command%restart)
    if (path == "") path = base_of(file_name(command%deck))//".h5"
    if (is_any_of_files(path, read_files)) then
      call fail(error, "result file '"//path//"': the run reads this file, so it is left "// &
                "alone; name another with --out")
    end if
  end subroutine result_path

  !> The result that a checkpoint is next to; empty where its name does not say.
  pure function result_of_checkpoint(checkpoint) result(path)
    character(*), intent(in) :: checkpoint
    character(:), allocatable :: path
    character(*), parameter :: ending = ".ckpt.h5"
    integer :: n

    path = ""
    n = len(checkpoint) - len(ending)
    if (n < 1) return
    if (checkpoint(n + 1:) == ending) path = checkpoint(:n)//".h5"
  end function result_of_checkpoint

  !> The result file's name with `ending` instead of its own, or with `ending` appended as often as
  !! it takes to be neither the result file nor one that the run reads.
  function path_beside_result(result_file, ending, read_files) result(path)
    character(*), intent(in) :: result_file, ending   !! the ending with its point
    type(string_t), intent(in) :: read_files(:)
    character(:), allocatable :: path

    path = result_base(result_file)//ending
    if (is_same_file(path, result_file)) path = result_file//ending
    do while (is_any_of_files(path, read_files))
      path = path//ending
    end do
  end function path_beside_result

  !> What the names of the files next to a result begin with: its path without `.h5`. Other points
  !! belong to the name, as in `mu0.05`.
  pure function result_base(path) result(base)
    character(*), intent(in) :: path
    character(:), allocatable :: base
    character(*), parameter :: ending = ".h5"
    integer :: n

    base = path
    n = len(path) - len(ending)
    if (n <= index(path, "/", back=.true.)) return
    if (path(n + 1:) == ending) base = path(:n)
  end function result_base

  !> The path of a deck or result without its ending: `.h5`, or a point and letters as in
  !! `strip.key`. Other points belong to the name, as in `mu0.05` or `strip.v2`.
  pure function base_of(path) result(base)
    character(*), intent(in) :: path
    character(:), allocatable :: base
    character(*), parameter :: letters = "abcdefghijklmnopqrstuvwxyz"
    integer :: dot

    dot = index(path, ".", back=.true.)
    base = result_base(path)
    if (base /= path .or. dot <= index(path, "/", back=.true.) + 1 .or. dot == len(path)) return
    if (verify(lower_case(path(dot + 1:)), letters) == 0) base = path(:dot - 1)
  end function base_of

  !> The path without its folder.
  pure function file_name(path) result(name)
    character(*), intent(in) :: path
    character(:), allocatable :: name

    name = path(index(path, "/", back=.true.) + 1:)
  end function file_name

  !> Fails if a file is there that is no such file of this program.
  subroutine check_message_file(path, error)
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(inout) :: error
    character(:), allocatable :: why

    why = why_left_alone(path, message_mark, "file with messages")
    if (why /= "") call fail(error, "message file '"//path//"': "//why)
  end subroutine check_message_file

  !> Let what subroutines write to unit 7 go to a file next to the result, after what is there if
  !! the run is resumed. Where that file cannot be written the messages are lost, and a
  !! warning says so. To be called after `check_message_file`.
  subroutine open_message_file(path, is_going_on)
    character(*), intent(in) :: path
    logical, intent(in) :: is_going_on
    character(256) :: message
    integer(int64) :: n_bytes
    integer :: status

    open (unit=message_unit, file=path, action="write", iostat=status, iomsg=message, &
          status=merge("unknown", "replace", is_going_on), &
          position=merge("append", "asis  ", is_going_on))
    if (status == 0) then
      inquire (unit=message_unit, size=n_bytes)
      if (n_bytes == 0) write (message_unit, "(a)") message_mark
      return
    end if
    write (error_unit, "(a)") "igaform: warning: message file '"//path//"': "//trim(message)// &
      "; what is written to unit 7 is lost"
    open (unit=message_unit, status="scratch", iostat=status)
  end subroutine open_message_file

  !> Close that file, and remove it if nothing was written.
  subroutine close_message_file(path)
    character(*), intent(in) :: path     !! that it was opened with; the unit may lead elsewhere now
    logical :: is_open
    integer(int64) :: n_bytes

    inquire (unit=message_unit, opened=is_open)
    if (is_open) close (message_unit)
    if (why_left_alone(path, message_mark, "") /= "") return
    inquire (file=path, size=n_bytes)
    if (n_bytes >= 0 .and. n_bytes <= len(message_mark) + 1) call remove_file(true_path(path))
  end subroutine close_message_file

  !> Why the file for what a run of a batch has to say cannot be written; empty if nothing is known
  !! against it.
  function error_file_problem(path) result(why)
    character(*), intent(in) :: path
    character(:), allocatable :: why

    why = why_left_alone(path, error_mark, "file with messages")
    if (why /= "") why = "'"//path//"' for its messages: "//why
  end function error_file_problem

  !> Begin the file for what a run of a batch has to say; nothing is done where that is not
  !! possible, which shows when the run is started.
  subroutine begin_error_file(path, command)
    character(*), intent(in) :: path
    character(*), intent(in) :: command     !! line of the run
    integer :: unit, status

    open (newunit=unit, file=path, action="write", status="replace", iostat=status)
    if (status /= 0) return
    write (unit, "(a)", iostat=status) error_mark//command
    close (unit, iostat=status)
  end subroutine begin_error_file

  !> Note at the end of that file that the run of this identity has failed, for one whose result
  !! does not say so.
  subroutine note_failed_run(path, command, identity)
    character(*), intent(in) :: path, command
    character(*), intent(in) :: identity    !! that its result has, or would have
    integer :: unit, status
    logical :: is_there

    inquire (file=path, exist=is_there)
    if (.not. is_there) call begin_error_file(path, command)
    open (newunit=unit, file=path, action="write", position="append", status="old", iostat=status)
    if (status /= 0) return
    write (unit, "(a)", iostat=status) failure_mark//identity
    close (unit, iostat=status)
  end subroutine note_failed_run

  !> Was it noted of the run of this identity?
  logical function is_noted_as_failed(path, identity)
    character(*), intent(in) :: path, identity
    character(len(failure_mark) + len(identity) + 1) :: line
    integer :: unit, status

    is_noted_as_failed = .false.
    if (why_left_alone(path, error_mark, "") /= "") return
    open (newunit=unit, file=path, action="read", status="old", iostat=status)
    if (status /= 0) return
    do
      read (unit, "(a)", iostat=status) line
      if (status /= 0) exit
      is_noted_as_failed = line == failure_mark//identity
    end do
    close (unit)
  end function is_noted_as_failed

  !> Remove the file if the run had nothing to say.
  subroutine end_error_file(path, command)
    character(*), intent(in) :: path, command
    integer(int64) :: n_bytes

    inquire (file=path, size=n_bytes)
    if (n_bytes <= len(error_mark//command) + 1) call remove_file(true_path(path))
  end subroutine end_error_file

  !> The first line of such a file that reports an error, without the program's name.
  function first_error(path) result(message)
    character(*), intent(in) :: path
    character(:), allocatable :: message
    character(1024) :: line
    integer :: unit, status, first

    message = ""
    if (why_left_alone(path, error_mark, "") /= "") return
    open (newunit=unit, file=path, action="read", status="old", iostat=status)
    if (status /= 0) return
    do
      read (unit, "(a)", iostat=status) line
      if (status /= 0) exit
      if (index(line, error_mark) == 1 .or. index(line, failure_mark) == 1) cycle
      if (message == "" .and. index(line, "warning:") == 0) message = trim(line)
      first = index(line, "error: ")
      if (first == 0) cycle
      message = trim(line)
      if (index(line, "igaform: error: ") == 1) message = trim(line(first + 7:))
      exit
    end do
    close (unit)
  end function first_error

end module output_files
