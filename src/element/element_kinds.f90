!> The kinds of elements: the one place that knows them all.
module element_kinds
  use errors, only: error_t
  use kinds, only: wp
  use nurbs_solid, only: nurbs_solid_t
  use block_law, only: block_law_t
  use element, only: part_t
  use strain_projection, only: projection_spec_t
  use solid_element, only: solid_element_t, new_solid_element
  implicit none
  private

  public :: new_part, reduce_to_plane

contains

  !> A part at rest and without stress, of the kind that the projection asks for.
  subroutine new_part(part, name, grid, n_points, n_parts, law, viscosity, error, projection)
    type(part_t), intent(out) :: part
    character(*), intent(in) :: name
    type(nurbs_solid_t), intent(in) :: grid
    integer, intent(in) :: n_points(3), n_parts(3)   !! Gauss points a part, parts an element
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)             !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    type(projection_spec_t), intent(in), optional :: projection   !! absent: none
    type(solid_element_t), allocatable :: solid

    allocate (solid)
    call new_solid_element(solid, name, grid, n_points, n_parts, law, viscosity, error, projection)
    call move_alloc(solid, part%element)
  end subroutine new_part

  !> Let a part, whose motion along a coordinate is held everywhere and whose sides are loaded
  !! alike, work in plane strain where it can.
  subroutine reduce_to_plane(part, law, component)
    type(part_t), intent(inout) :: part
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: component                 !! that is held: 1 x, 2 y, 3 z

    select type (element => part%element)
    class is (solid_element_t)
      call element%reduce_to_plane(law, component)
    end select
  end subroutine reduce_to_plane

end module element_kinds
