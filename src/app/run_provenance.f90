!> What a result file tells of where it comes from.
module run_provenance
  use build_info, only: version, git_commit, build_flags
  use provenance, only: provenance_t
  use scene, only: scene_t
  implicit none
  private

  public :: provenance_of

contains

  !> This program, the command that it was started with, and the deck.
  function provenance_of(scene) result(source)
    type(scene_t), intent(in) :: scene
    type(provenance_t) :: source
    integer :: length

    ! One by one: gfortran 12 takes wrong lengths from a structure constructor here.
    source%version = version
    source%git_commit = git_commit
    source%build_flags = build_flags
    call get_command(length=length)
    allocate (character(length) :: source%command_line)
    call get_command(source%command_line)
    source%deck_file = scene%file
    source%deck_text = scene%text
    source%heading = scene%heading
    source%units = scene%units
  end function provenance_of

end module run_provenance
