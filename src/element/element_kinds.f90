!> The kinds of elements: the one place that knows them all.
module element_kinds
  use failure, only: error_t
  use kinds, only: wp
  use nurbs_solid, only: nurbs_solid_t
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use block_law, only: block_law_t
  use element, only: part_t
  use strain_projection, only: projection_spec_t, project_nothing
  use solid_element, only: solid_element_t, new_solid_element
  use projected_element, only: projected_element_t, new_projected_element
  use plane_strain_element, only: plane_strain_element_t, strip_of
  use shell_element, only: shell_element_t, new_shell_element
  implicit none
  private

  public :: new_part, reduce_to_plane

contains

  !> A part at rest and without stress, of the kind that projection and law ask for. Its inertia
  !! follows when all parts are there.
  subroutine new_part(part, name, grid, n_points, n_parts, law, viscosity, error, projection, &
                      is_shell)
    type(part_t), intent(out) :: part
    character(*), intent(in) :: name
    type(nurbs_solid_t), intent(in) :: grid
    integer, intent(in) :: n_points(3), n_parts(3)   !! Gauss points a part, parts an element
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)             !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    type(projection_spec_t), intent(in), optional :: projection   !! absent: none
    logical, intent(in), optional :: is_shell        !! the mid-surface of the solid; absent: not
    type(shell_element_t), allocatable :: shell
    type(solid_element_t), allocatable :: solid
    type(projected_element_t), allocatable :: projected
    type(projection_spec_t) :: spec
    type(gauss_rule_t) :: rule(3)
    integer :: axis

    if (present(is_shell)) then
      if (is_shell) then
        allocate (shell)
        do axis = 1, 3
          rule(axis) = new_gauss_rule(n_points(axis), n_parts(axis))
        end do
        call new_shell_element(shell, name, grid, rule, law, viscosity, error)
        call move_alloc(shell, part%element)
        return
      end if
    end if
    if (present(projection)) spec = projection
    if (spec%kind /= project_nothing .or. law%needs_context) then
      allocate (projected)
      call new_projected_element(projected, name, grid, n_points, n_parts, law, viscosity, &
                                 spec, error)
      call move_alloc(projected, part%element)
    else
      allocate (solid)
      call new_solid_element(solid, name, grid, n_points, n_parts, law, viscosity, error)
      call move_alloc(solid, part%element)
    end if
  end subroutine new_part

  !> Let a part, whose motion along a coordinate is held everywhere and whose sides are loaded
  !! alike, work in plane strain where it can.
  subroutine reduce_to_plane(part, law, component)
    type(part_t), intent(inout) :: part
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: component                 !! that is held: 1 x, 2 y, 3 z
    type(plane_strain_element_t), allocatable :: strip

    select type (element => part%element)
    type is (solid_element_t)
      call strip_of(element, law, component, strip)
    end select
    if (allocated(strip)) call move_alloc(strip, part%element)
  end subroutine reduce_to_plane

end module element_kinds
