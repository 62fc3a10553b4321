!> Names of the files that a run writes beside its result, none of which may be one that it reads.
module output_names
  use text, only: string_t, lower_case
  use failure, only: error_t, fail
  use system_files, only: is_same_file, is_any_of_files
  use command_line, only: command_t
  use scene, only: scene_t
  implicit none
  private

  public :: base_of, result_base, file_name, files_read, result_path, path_beside_result

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

  !> The result file: that of --out, or that beside the checkpoint of --restart, or the name of the
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

  !> The result that a checkpoint lies beside; empty where its name does not say.
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

  !> The result file's name with `ending` instead of its own, or with `ending` behind it as often as
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

  !> What the names of the files beside a result begin with: its path without `.h5`. Other points
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

end module output_names
