!> What a result file tells of where it comes from.
module run_provenance
  use build_info, only: version, git_commit, source_digest, build_flags, kernels
  use build_fingerprint, only: fingerprint
  use provenance, only: provenance_t
  use scene, only: scene_t
  implicit none
  private

  public :: provenance_of, build_of_program

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
    source%build = build_of_program()
    call get_command(length=length)
    allocate (character(length) :: source%command_line)
    call get_command(source%command_line)
    source%deck_file = scene%file
    source%deck_text = scene%text
    source%heading = scene%heading
    source%units = scene%units
  end function provenance_of

  !> How this program was built, as `fingerprint` has it.
  function build_of_program() result(build)
    character(:), allocatable :: build

    build = fingerprint(version//" (sources "//source_digest//")", kernels)
  end function build_of_program

end module run_provenance
