!> Tool surfaces as curved VTK cells, and where their points are in a frame.
!!
!! One exact cell per element, but Lagrange cells of an eighth of a right angle along directions in
!! which the weights vary: a circle of degree 2 is then met within 1e-4 of its radius, on any number
!! of elements. Trimmed surfaces are shown by small cells, with the distance from their border, by
!! which those that it crosses can be cut.
module tool_mesh
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use knot_vector, only: n_spans
  use nurbs_surface, only: nurbs_surface_t
  use surface_grid, only: parts_along, turns_along
  use refinement, only: insert_knots, dividing_knots
  use surface_trim, only: trim_t, new_trim, is_inside, place_in_spans
  use outline, only: polygon_t, region_t, inside_distance
  use line_chains, only: curve_corners
  use failure, only: error_t
  use line_operator, only: apply_tensor, basis_operator, equal_positions, joined_bezier_operator, &
                           joined_positions, line_operator_t
  use vtkhdf, only: cells_on_grid
  implicit none
  private

  public :: surface_mesh_t, new_surface_mesh, n_mesh_points, carried

  integer, parameter :: n_rational_parts = 8   !! Lagrange cells of a right angle
  real(wp), parameter :: even_weights = 2.1_wp   !! ratio of neighbours: arcs of up to 120 degrees
  integer, parameter :: trimmed_cells = 12     !! least along each direction of a trimmed surface
  integer, parameter :: least_trimmed = 2      !! degree of cells of a trimmed surface
  integer, parameter :: most_cells = 50000     !! of a surface, unless its elements are more

  !> Cells of one surface.
  type :: surface_mesh_t
    real(wp), allocatable :: points(:, :)               !! shape (n, 3)
    real(wp), allocatable :: weights(:)                 !! shape (n), one for Lagrange cells
    real(wp), allocatable :: xi(:), eta(:)              !! parameters of the points, xi fastest
    integer(int64), allocatable :: connectivity(:, :)   !! (nodes of a cell, cells), points from 0
    !> Of a trimmed surface: how far inside the points are, negative outside; exact in cells that
    !! the border crosses, as far as parameters are even [length].
    real(wp), allocatable :: edge_distance(:)
  end type surface_mesh_t

contains

  !> Cells of a surface.
  pure function new_surface_mesh(given, is_bezier, length) result(mesh)
    type(nurbs_surface_t), intent(in) :: given
    logical, intent(in) :: is_bezier
    real(wp), intent(in) :: length        !! of a Lagrange cell at most [length]
    type(surface_mesh_t) :: mesh
    type(nurbs_surface_t) :: surface
    type(line_operator_t) :: basis(2)
    integer :: degree, n_parts(2), d, i

    surface = with_small_cells(given, length)
    degree = degree_of(surface)
    n_parts = parts_of(surface, is_bezier, length)
    do d = 1, 2
      if (is_bezier) then
        basis(d) = joined_bezier_operator(surface%axes(d), degree)
      else
        basis(d) = basis_operator(surface%axes(d), equal_positions(n_parts(d)*degree), 0, &
                                  is_joined=.true.)
      end if
    end do
    mesh%xi = joined_positions(surface%axes(1), equal_positions(n_parts(1)*degree))
    mesh%eta = joined_positions(surface%axes(2), equal_positions(n_parts(2)*degree))
    mesh%weights = apply_tensor(basis, [surface%weights])
    allocate (mesh%points(size(mesh%weights), 3))
    do i = 1, 3
      mesh%points(:, i) = apply_tensor(basis, [surface%weights*surface%points(:, :, i)]) &
                          /mesh%weights
    end do
    if (.not. is_bezier) mesh%weights = 1.0_wp
    mesh%connectivity = cells_on_grid(degree, n_parts*[n_spans(surface%axes(1)), &
                                                                n_spans(surface%axes(2))], 0_int64)
    if (allocated(given%loops)) call trim_mesh(given, degree, mesh)
  end function new_surface_mesh

  !> Degree of the cells; those of a trimmed surface follow the curvature of its border.
  pure integer function degree_of(surface) result(degree)
    type(nurbs_surface_t), intent(in) :: surface

    degree = maxval(surface%axes%degree)
    if (allocated(surface%loops)) degree = max(degree, least_trimmed)
  end function degree_of

  !> A trimmed surface on more knots, for cells of half the length.
  pure function with_small_cells(surface, length) result(refined)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: length
    type(nurbs_surface_t) :: refined
    type(error_t), allocatable :: error
    integer :: d, n, n_parts(2)

    refined = surface
    if (.not. allocated(surface%loops)) return
    n_parts = parts_along(surface, 0.5_wp*length)
    do d = 1, 2
      n = n_spans(surface%axes(d))
      n_parts(d) = max(n_parts(d), (trimmed_cells + n - 1)/n)
      ! Cannot fail: these knots are new ones within their spans.
      call insert_knots(refined, d, dividing_knots(surface%axes(d), n_parts(d)), error)
    end do
  end function with_small_cells

  !> Leave out the cells beyond the trim, and find the distance from its border in those that this
  !! crosses.
  pure subroutine trim_mesh(surface, degree, mesh)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: degree
    type(surface_mesh_t), intent(inout) :: mesh
    type(trim_t) :: trim
    logical, allocatable :: is_in(:, :), is_crossed(:, :), is_shown(:)
    real(wp) :: scale(2), extent, at(2)
    integer :: i, j, k, n, span

    call new_trim(trim, surface%axes, surface%loops)
    allocate (is_in(size(mesh%xi), size(mesh%eta)), is_shown(size(mesh%connectivity, 2)))
    do j = 1, size(mesh%eta)
      do i = 1, size(mesh%xi)
        call place_in_spans(surface%axes, [mesh%xi(i), mesh%eta(j)], span, at)
        is_in(i, j) = is_inside(trim, span, at)
      end do
    end do
    allocate (is_crossed(size(mesh%xi), size(mesh%eta)), source=.false.)
    n = (size(mesh%xi) - 1)/degree
    do k = 1, size(is_shown)
      i = mod(k - 1, n)*degree + 1
      j = (k - 1)/n*degree + 1
      associate (nodes => is_in(i:i + degree, j:j + degree))
        is_shown(k) = any(nodes)
        if (is_shown(k) .and. .not. all(nodes)) &
          is_crossed(i:i + degree, j:j + degree) = .true.
      end associate
    end do
    mesh%connectivity = mesh%connectivity(:, pack([(k, k=1, size(is_shown))], is_shown))
    extent = norm2(maxval(mesh%points, 1) - minval(mesh%points, 1))
    mesh%edge_distance = pack(merge(extent, -extent, is_in), .true.)
    do k = 1, 2
      associate (knots => surface%axes(k)%knots)
        scale(k) = length_along(surface, k)/(knots(size(knots)) - knots(1))
      end associate
    end do
    call measure_border(surface, scale, is_in, is_crossed, mesh)
  end subroutine trim_mesh

  !> Mean length of the control polygons along an axis.
  pure real(wp) function length_along(surface, axis) result(length)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: axis
    integer :: n(2)

    n = shape(surface%weights)
    associate (x => surface%points)
      if (axis == 1) length = sum(norm2(x(2:, :, :) - x(:n(1) - 1, :, :), 3))/n(2)
      if (axis == 2) length = sum(norm2(x(:, 2:, :) - x(:, :n(2) - 1, :), 3))/n(1)
    end associate
  end function length_along

  !> Distances from the border at points of cells that it crosses.
  pure subroutine measure_border(surface, scale, is_in, is_crossed, mesh)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: scale(2)                   !! lengths over parameters
    logical, intent(in) :: is_in(:, :), is_crossed(:, :)
    type(surface_mesh_t), intent(inout) :: mesh
    real(wp), parameter :: near = 1.0e-4_wp            ! corners of polygons, of the surface
    type(polygon_t) :: polygons(size(surface%loops))
    type(region_t) :: border(1)
    real(wp) :: distance
    integer :: i, j, l

    do l = 1, size(polygons)
      call curve_corners(surface%loops(l)%curves, near*minval([(surface%axes(i)%knots(size( &
                         surface%axes(i)%knots)) - surface%axes(i)%knots(1), i=1, 2)]), &
                         polygons(l)%corners)
    end do
    border(1)%polygons = polygons
    do j = 1, size(is_in, 2)
      do i = 1, size(is_in, 1)
        if (.not. is_crossed(i, j)) cycle
        distance = abs(inside_distance(border, [mesh%xi(i), mesh%eta(j)], scale))
        mesh%edge_distance(i + (j - 1)*size(is_in, 1)) = merge(distance, -distance, is_in(i, j))
      end do
    end do
  end subroutine measure_border

  !> Points of the mesh that `new_surface_mesh` makes.
  pure integer function n_mesh_points(surface, is_bezier, length) result(n)
    type(nurbs_surface_t), intent(in) :: surface
    logical, intent(in) :: is_bezier
    real(wp), intent(in) :: length        !! of a Lagrange cell at most [length]
    type(nurbs_surface_t) :: fine

    fine = with_small_cells(surface, length)
    n = product(degree_of(fine)*parts_of(fine, is_bezier, length) &
                *[n_spans(fine%axes(1)), n_spans(fine%axes(2))] + 1)
  end function n_mesh_points

  !> Cells of an element in each direction.
  pure function parts_of(surface, is_bezier, length) result(n_parts)
    type(nurbs_surface_t), intent(in) :: surface
    logical, intent(in) :: is_bezier
    real(wp), intent(in) :: length
    integer :: n_parts(2)

    n_parts = 1
    if (is_bezier) return
    n_parts = rational_parts(surface)
    associate (n_elements => [n_spans(surface%axes(1)), n_spans(surface%axes(2))])
      do while (product(real(n_parts, wp)*n_elements) > most_cells .and. any(n_parts > 1))
        n_parts = (n_parts + 1)/2
      end do
    end associate
    ! `with_small_cells` has cut trimmed surfaces.
    if (.not. allocated(surface%loops)) n_parts = max(n_parts, parts_along(surface, length))
  end function parts_of

  !> As many as show curves of varying weight well.
  pure function rational_parts(surface) result(n_parts)
    type(nurbs_surface_t), intent(in) :: surface
    integer :: n_parts(2)
    real(wp), parameter :: right_angle = acos(0.0_wp), slack = 0.2_wp   ! of a part
    real(wp) :: ratio(2)

    n_parts = 1
    associate (w => surface%weights, n => shape(surface%weights))
      ratio = [maxval(max(w(2:, :)/w(:n(1) - 1, :), w(:n(1) - 1, :)/w(2:, :))), &
               maxval(max(w(:, 2:)/w(:, :n(2) - 1), w(:, :n(2) - 1)/w(:, 2:)))]
    end associate
    if (.not. any(ratio > 1.0_wp)) return
    where (ratio > 1.0_wp) n_parts = max(1, ceiling(n_rational_parts*turns_along(surface) &
                                                    /right_angle - slack))
    where (ratio > even_weights) n_parts = max(n_parts, n_rational_parts)
  end function rational_parts

  !> A vector for each tool, and a matrix times the position where some rotate, at points of the
  !! tools: with the displacement of its frame and its rotation less one, how far each point has
  !! come.
  pure function carried(points, tool_of_point, vectors, matrices) result(values)
    real(wp), intent(in) :: points(:, :)                  !! at the start, (n, 3) [length]
    integer, intent(in) :: tool_of_point(:)
    real(wp), intent(in) :: vectors(:, :)                 !! (3, tools)
    real(wp), intent(in), optional :: matrices(:, :, :)   !! (3, 3, tools)
    real(wp) :: values(size(points, 1), 3)
    integer :: i

    values = transpose(vectors(:, tool_of_point))
    if (.not. present(matrices)) return
    do i = 1, size(tool_of_point)
      values(i, :) = values(i, :) + matmul(matrices(:, :, tool_of_point(i)), points(i, :))
    end do
  end function carried

end module tool_mesh
