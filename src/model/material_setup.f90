!> The law of a material of the scene.
module material_setup
  use errors, only: error_t
  use block_law, only: block_law_t
  use law_spec, only: law_spec_t
  use material_table, only: new_law
  use scene, only: material_spec_t
  implicit none
  private

  public :: new_material_law

contains

  !> Bind the law that the deck asks for; constants that it does not accept are an error.
  subroutine new_material_law(material, law, error)
    type(material_spec_t), intent(in) :: material
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(law_spec_t) :: spec

    spec%law = material%law
    spec%density = material%density
    spec%young = material%young
    spec%poisson = material%poisson
    spec%constants = material%constants
    spec%n_state = material%n_state
    spec%plasticity = material%plasticity
    call new_law(spec, law, error)
  end subroutine new_material_law

end module material_setup
