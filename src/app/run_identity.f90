!> The key of a run: two runs with the same key give the same result.
module run_identity
  use source_digest, only: digest_t, add_text, digest_text, read_whole_file
  use checksum, only: file_checksum
  use command_line, only: command_t
  use scene, only: scene_t
  implicit none
  private

  public :: identity_of

contains

  !> Digest of the program, the deck with all its files, its parameters and the user's sources. The
  !! number of threads does not count: results have the same bits with any.
  function identity_of(command, scene) result(identity)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: identity, content
    type(digest_t) :: digest
    logical :: is_there
    integer :: i

    call add_text(digest, file_checksum("/proc/self/exe"))
    if (allocated(scene%files)) then
      do i = 1, size(scene%files)
        call add_text(digest, file_checksum(scene%files(i)%value))
      end do
    end if
    do i = 1, size(command%overrides)
      call add_text(digest, command%overrides(i)%value//new_line("a"))
    end do
    do i = 1, size(command%user_files)
      call read_whole_file(command%user_files(i)%value, content, is_there)
      call add_text(digest, content//new_line("a"))
    end do
    identity = digest_text(digest)
  end function identity_of

end module run_identity
