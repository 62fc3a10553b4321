!> Tool surfaces as curved VTK cells, and where their points are in a frame.
!!
!! One exact cell per element, but Lagrange cells of an eighth of a right angle along directions in
!! which the weights vary: a circle of degree 2 is then met within 1e-4 of its radius, on any number
!! of elements. Trimmed surfaces are shown by small cells whose middle is within the trim.
module tool_mesh
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use knot_vector, only: n_spans
  use nurbs_surface, only: nurbs_surface_t
  use surface_grid, only: parts_along, turns_along
  use refinement, only: insert_knots, dividing_knots
  use surface_trim, only: trim_t, new_trim, is_inside, place_in_spans
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
  integer, parameter :: most_cells = 50000     !! of a surface, unless its elements are more

  !> Cells of one surface.
  type :: surface_mesh_t
    real(wp), allocatable :: points(:, :)               !! shape (n, 3)
    real(wp), allocatable :: weights(:)                 !! shape (n), one for Lagrange cells
    real(wp), allocatable :: xi(:), eta(:)              !! parameters of the points, xi fastest
    integer(int64), allocatable :: connectivity(:, :)   !! (nodes of a cell, cells), points from 0
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
    degree = maxval(surface%axes%degree)
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
    if (allocated(given%loops)) call drop_cells(given, degree, mesh)
  end function new_surface_mesh

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

  !> Leave the cells out whose middle is beyond the trim.
  pure subroutine drop_cells(surface, degree, mesh)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: degree
    type(surface_mesh_t), intent(inout) :: mesh
    type(trim_t) :: trim
    logical, allocatable :: is_shown(:)
    real(wp) :: at(2)
    integer :: i, j, k, n, span

    call new_trim(trim, surface%axes, surface%loops)
    n = (size(mesh%xi) - 1)/degree
    allocate (is_shown(size(mesh%connectivity, 2)))
    do k = 1, size(is_shown)
      i = mod(k - 1, n)*degree + 1
      j = (k - 1)/n*degree + 1
      call place_in_spans(surface%axes, 0.5_wp*[mesh%xi(i) + mesh%xi(i + degree), &
                                                mesh%eta(j) + mesh%eta(j + degree)], span, at)
      is_shown(k) = is_inside(trim, span, at)
    end do
    mesh%connectivity = mesh%connectivity(:, pack([(k, k=1, size(is_shown))], is_shown))
  end subroutine drop_cells

  !> Points of the mesh that `new_surface_mesh` makes.
  pure integer function n_mesh_points(surface, is_bezier, length) result(n)
    type(nurbs_surface_t), intent(in) :: surface
    logical, intent(in) :: is_bezier
    real(wp), intent(in) :: length        !! of a Lagrange cell at most [length]
    type(nurbs_surface_t) :: fine

    fine = with_small_cells(surface, length)
    n = product(maxval(fine%axes%degree)*parts_of(fine, is_bezier, length) &
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
