!> Patches that several tests of the element layer share, and short ways to work with them.
module element_cases
  use kinds, only: wp
  use failure, only: error_t
  use knot_vector, only: knot_vector_t, new_knot_vector, greville
  use nurbs_solid, only: nurbs_solid_t, new_nurbs_solid
  use outline, only: polygon_t, region_t, new_region
  use block_law, only: block_law_t
  use elastic, only: elastic_t, new_elastic
  use gauss_rule, only: gauss_rule_t
  use element, only: element_t, part_t, force_report_t
  use solid_patch, only: solid_patch_t, tile_buffer_t
  use strain_projection, only: projection_spec_t
  use patch_setup, only: new_patch, new_tile_buffers
  use solid_element, only: solid_element_t
  use solid_forces, only: internal_forces
  use element_kinds, only: new_part
  use projected_element, only: projected_element_t, new_projected_element
  use spurious_modes, only: dense_stiffness
  implicit none
  private

  public :: axis_with, box, bent, weighted, quarter_ring, patch_of, viscous_patch_of, body_of
  public :: evaluate, element_with, part_with, projected_of, patch_stiffness
  public :: steel, scatter, affine_field, circle

  !> Internal forces of a patch with buffers of its own, or of an element.
  interface evaluate
    procedure :: evaluate_patch, evaluate_element
  end interface evaluate

contains

  !> Knots 0 to 1 with elements of uneven size; interior knots are repeated `multiplicity` times.
  function axis_with(degree, n_elements, multiplicity, unevenness) result(kv)
    integer, intent(in) :: degree, n_elements, multiplicity
    real(wp), intent(in) :: unevenness   !! 0: equal elements, below 0.5
    type(knot_vector_t) :: kv
    type(error_t), allocatable :: error
    real(wp) :: knots(2*(degree + 1) + multiplicity*(n_elements - 1))
    integer :: e, first

    knots(:degree + 1) = 0.0_wp
    knots(size(knots) - degree:) = 1.0_wp
    do e = 1, n_elements - 1
      first = degree + 2 + multiplicity*(e - 1)
      knots(first:first + multiplicity - 1) = (e + unevenness*sin(3.0_wp*e))/n_elements
    end do
    call new_knot_vector(kv, degree, knots, error)
    if (allocated(error)) error stop "the knots of the test are wrong"
  end function axis_with

  !> Straight box, its control points at the Greville abscissae.
  function box(degrees, n_elements, edges, unevenness, multiplicity) result(solid)
    integer, intent(in) :: degrees(3), n_elements(3)
    real(wp), intent(in) :: edges(3)
    real(wp), intent(in), optional :: unevenness       !! of the element sizes, default 0
    integer, intent(in), optional :: multiplicity(3)   !! of interior knots, default 1
    type(nurbs_solid_t) :: solid
    type(knot_vector_t) :: axes(3)
    type(error_t), allocatable :: error
    real(wp), allocatable :: points(:, :, :, :)
    real(wp) :: uneven
    integer :: n(3), axis, repeats(3)

    uneven = 0.0_wp
    if (present(unevenness)) uneven = unevenness
    repeats = 1
    if (present(multiplicity)) repeats = multiplicity
    do axis = 1, 3
      axes(axis) = axis_with(degrees(axis), n_elements(axis), repeats(axis), uneven)
    end do
    n = axes%n_basis
    allocate (points(n(1), n(2), n(3), 3))
    points(:, :, :, 1) = edges(1)*spread(spread(greville(axes(1)), 2, n(2)), 3, n(3))
    points(:, :, :, 2) = edges(2)*spread(spread(greville(axes(2)), 1, n(1)), 3, n(3))
    points(:, :, :, 3) = edges(3)*spread(spread(greville(axes(3)), 1, n(2)), 1, n(1))
    call new_nurbs_solid(solid, axes, points, 0.0_wp*points(:, :, :, 1) + 1.0_wp, error)
    if (allocated(error)) error stop "the box of the test is wrong"
  end function box

  !> The same solid with its control points moved by up to `amplitude`, none like its neighbour.
  function bent(straight, amplitude) result(solid)
    type(nurbs_solid_t), intent(in) :: straight
    real(wp), intent(in) :: amplitude
    type(nurbs_solid_t) :: solid

    solid = straight
    solid%points = solid%points + amplitude*scatter(shape(solid%points), 1)
  end function bent

  !> The same control points with weights of 1 +- amplitude.
  function weighted(plain, amplitude) result(solid)
    type(nurbs_solid_t), intent(in) :: plain
    real(wp), intent(in) :: amplitude
    type(nurbs_solid_t) :: solid
    real(wp) :: change(size(plain%weights, 1), size(plain%weights, 2), size(plain%weights, 3), 1)

    solid = plain
    change = scatter([shape(plain%weights), 1], 2)
    solid%weights = 1.0_wp + amplitude*change(:, :, :, 1)
  end function weighted

  !> Quarter of a ring about z: axis 1 runs along the arc, axis 2 outward to inward, axis 3 along z.
  function quarter_ring(inner, outer, width) result(solid)
    real(wp), intent(in) :: inner, outer, width
    type(nurbs_solid_t) :: solid
    type(error_t), allocatable :: error
    real(wp), parameter :: half_root = 0.5_wp*sqrt(2.0_wp)
    type(knot_vector_t) :: axes(3)
    real(wp) :: points(3, 2, 2, 3), weights(3, 2, 2), radius
    integer :: j, k

    axes(1) = axis_with(2, 1, 1, 0.0_wp)
    axes(2) = axis_with(1, 1, 1, 0.0_wp)
    axes(3) = axes(2)
    do k = 1, 2
      do j = 1, 2
        radius = merge(outer, inner, j == 1)
        points(:, j, k, 1) = [radius, radius, 0.0_wp]
        points(:, j, k, 2) = [0.0_wp, radius, radius]
        points(:, j, k, 3) = (k - 1)*width
        weights(:, j, k) = [1.0_wp, half_root, 1.0_wp]
      end do
    end do
    call new_nurbs_solid(solid, axes, points, weights, error)
    if (allocated(error)) error stop "the ring of the test is wrong"
  end function quarter_ring

  !> Elastic steel in mm, t, s.
  function steel() result(law)
    type(elastic_t) :: law
    law = new_elastic(7.85e-9_wp, 2.1e5_wp, 0.3_wp)
  end function steel

  !> What lies within, or outside of, a circle in the parameters.
  subroutine circle(x, y, radius, is_outside, region)
    real(wp), intent(in) :: x, y, radius
    logical, intent(in) :: is_outside
    type(region_t), intent(out) :: region
    type(polygon_t) :: polygon(1)
    real(wp), parameter :: pi = acos(-1.0_wp)
    integer, parameter :: n = 5000
    integer :: i
    polygon(1)%corners = reshape([(x + radius*cos(2.0_wp*pi*i/n), y + radius*sin(2.0_wp*pi*i/n), &
                                   i=1, n)], [2, n])
    call new_region(region, polygon, is_outside)
  end subroutine circle

  !> Patch of a solid with a whole rule and no viscosity.
  function patch_of(solid, n_points, law) result(patch)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: n_points(3)
    class(block_law_t), intent(in) :: law
    type(solid_patch_t) :: patch
    patch = viscous_patch_of(solid, n_points, law, [0.0_wp, 0.0_wp])
  end function patch_of

  !> Patch of a solid with bulk viscosity.
  function viscous_patch_of(solid, n_points, law, viscosity) result(patch)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: n_points(3)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)
    type(solid_patch_t) :: patch
    type(error_t), allocatable :: error
    call new_patch(patch, solid, n_points, [1, 1, 1], law, viscosity, error)
    if (allocated(error)) error stop "the patch of the test is wrong"
  end function viscous_patch_of

  !> Element of a solid with projected strains and bulk viscosity.
  function projected_of(solid, n_points, law, viscosity, projection) result(element)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: n_points(3)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)
    type(projection_spec_t), intent(in) :: projection
    type(projected_element_t) :: element
    type(error_t), allocatable :: error
    call new_projected_element(element, "", solid, n_points, [1, 1, 1], law, viscosity, &
                               projection, error)
    if (allocated(error)) error stop "the projected element of the test is wrong"
  end function projected_of

  !> A part of the kind that the projection asks for.
  function part_with(solid, n_points, law, viscosity, projection) result(part)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: n_points(3)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)
    type(projection_spec_t), intent(in) :: projection
    type(part_t) :: part
    type(error_t), allocatable :: error
    call new_part(part, "", solid, n_points, [1, 1, 1], law, viscosity, error, projection)
    if (allocated(error)) error stop "the part of the test is wrong"
  end function part_with

  !> The solid element of a patch with this grid.
  function element_with(patch, grid) result(element)
    type(solid_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: grid
    type(solid_element_t) :: element
    integer :: axis
    element%patch = patch
    element%buffers = new_tile_buffers(patch)
    element%grid = grid
    element%n_elements = patch%axes%n_elements
    do axis = 1, 3
      associate (table => patch%axes(axis))
        element%rule(axis) = gauss_rule_t(table%n_points, table%abscissae, table%weights)
      end associate
    end do
    element%shortest = patch%shortest
    element%has_viscosity = patch%viscosity%is_active
    element%motion%x = grid%points
    element%motion%v = 0.0_wp*grid%points
    element%motion%internal_force = element%motion%v
  end function element_with

  !> Stiffness of a patch without stress whose control points are these.
  function patch_stiffness(patch, law, x) result(stiffness)
    type(solid_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: x(:, :, :, :)
    real(wp), allocatable :: stiffness(:, :)
    type(nurbs_solid_t) :: grid
    grid%points = x
    stiffness = dense_stiffness(element_with(patch, grid), law)
  end function patch_stiffness

  !> A body of one patch with these control points and masses.
  function body_of(patch, x, mass, factor) result(bodies)
    type(solid_patch_t), intent(in) :: patch
    real(wp), intent(in) :: x(:, :, :, :), mass(:, :, :)
    real(wp), intent(in), optional :: factor(:, :)   !! of the columns
    type(part_t) :: bodies(1)
    type(solid_element_t), allocatable :: solid
    allocate (solid)
    solid%patch = patch
    solid%buffers = new_tile_buffers(patch)
    solid%shortest = patch%shortest
    solid%has_viscosity = patch%viscosity%is_active
    solid%mass = mass
    solid%inertia = mass
    solid%motion%x = x
    solid%motion%v = 0.0_wp*x
    solid%motion%internal_force = 0.0_wp*x
    if (present(factor)) solid%column_factor = factor
    call move_alloc(solid, bodies(1)%element)
  end function body_of

  subroutine evaluate_patch(patch, law, dt, x, v, force, report)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(out) :: force(:, :, :, :)
    type(force_report_t), intent(out) :: report
    type(tile_buffer_t), allocatable :: buffers(:)
    buffers = new_tile_buffers(patch)
    call internal_forces(patch, buffers, law, dt, x, v, force, report)
  end subroutine evaluate_patch

  subroutine evaluate_element(element, law, dt, x, v, force, report)
    class(element_t), intent(inout) :: element
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(out) :: force(:, :, :, :)
    type(force_report_t), intent(out) :: report
    element%motion%x = x
    element%motion%v = v
    call element%forces(law, dt, report)
    force = element%motion%internal_force
  end subroutine evaluate_element

  !> Numbers in (-1, 1) without a pattern, the same in every run.
  pure function scatter(n, seed) result(numbers)
    integer, intent(in) :: n(4), seed
    real(wp) :: numbers(n(1), n(2), n(3), n(4)), phase
    integer :: i, j, k, c

    do c = 1, n(4)
      do k = 1, n(3)
        do j = 1, n(2)
          do i = 1, n(1)
            phase = 1.0_wp*seed + 4.1_wp*i + 7.3_wp*j + 12.7_wp*k + 2.6_wp*c
            numbers(i, j, k, c) = 2.0_wp*modulo(4375.8545_wp*sin(phase), 1.0_wp) - 1.0_wp
          end do
        end do
      end do
    end do
  end function scatter

  !> The field shift + gradient x at the control points.
  pure function affine_field(x, gradient, shift) result(field)
    real(wp), intent(in) :: x(:, :, :, :), gradient(3, 3), shift(3)
    real(wp) :: field(size(x, 1), size(x, 2), size(x, 3), 3)
    integer :: c

    do c = 1, 3
      field(:, :, :, c) = shift(c) + gradient(c, 1)*x(:, :, :, 1) + gradient(c, 2)*x(:, :, :, 2) &
                          + gradient(c, 3)*x(:, :, :, 3)
    end do
  end function affine_field

end module element_cases
