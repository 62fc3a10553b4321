!> The key of a run: two runs with the same key give the same result. And the key of the user's
!! subroutines alone, for checkpoints. And what a result file states of its origin.
module run_identity
  use user_sources, only: digest_t, add_text, add_contents, digest_text
  use checksum, only: file_checksum
  use command_line, only: command_t
  use scene, only: is_user_material, scene_t
  use build_info, only: version, git_commit, source_digest, build_flags, kernels, lapack_files
  use provenance, only: fingerprint, provenance_t
  implicit none
  private

  public :: identity_of, key_of_user_files, provenance_of, build_of_program

contains

  !> Digest of the program, the deck with all its files, its parameters and the user's sources. The
  !! number of threads does not count: results are bitwise identical with any.
  function identity_of(command, scene) result(identity)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: identity
    type(digest_t) :: digest
    integer :: i

    call add_text(digest, file_checksum("/proc/self/exe"))
    if (allocated(scene%sums)) then
      do i = 1, size(scene%sums)
        call add_text(digest, scene%sums(i)%value)
      end do
    end if
    do i = 1, size(command%overrides)
      call add_text(digest, command%overrides(i)%value//new_line("a"))
    end do
    call add_text(digest, key_of_user_files(command, scene))
    identity = digest_text(digest)
  end function identity_of

  !> Digest of the files of --user with all that they include; empty where no material of the deck
  !! asks for them.
  function key_of_user_files(command, scene) result(key)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: key
    type(digest_t) :: digest
    integer :: i

    key = ""
    if (.not. allocated(scene%materials)) return
    if (.not. any(is_user_material(scene%materials))) return
    do i = 1, size(command%user_files)
      call add_contents(digest, command%user_files(i)%value)
    end do
    key = digest_text(digest)
  end function key_of_user_files

  !> This program, the command that it was started with, and the deck.
  function provenance_of(scene) result(source)
    type(scene_t), intent(in) :: scene
    type(provenance_t) :: source
    integer :: length

    ! One by one: gfortran 12 takes wrong lengths from a structure constructor here.
    source%version = version
    source%git_commit = git_commit
    source%build_flags = build_flags
    source%build = build_of_program()
    call get_command(length=length)
    allocate (character(length) :: source%command_line)
    call get_command(source%command_line)
    source%deck_file = scene%file
    source%deck_text = scene%text
    source%deck_resolved = scene%resolved
    source%heading = scene%heading
    source%units = scene%units
  end function provenance_of

  !> How this program was built, as `fingerprint` has it.
  function build_of_program() result(build)
    character(:), allocatable :: build

    build = fingerprint(version//" (sources "//source_digest//")", kernels, lapack_files)
  end function build_of_program

end module run_identity
