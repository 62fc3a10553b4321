!> Curved cells of VTK: the order of their nodes, and their nodes on a tensor grid.
!!
!! Lagrange and Bezier cells of equal degree d in all directions have their (d + 1)^n nodes in the
!! order corners, edges, faces, body (VTK's PointIndexFromIJK).
module vtk_cells
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none
  private

  public :: hexahedron_nodes, quadrilateral_nodes, hexahedra_on_grid, quadrilaterals_on_grid

  integer, parameter, public :: vtk_lagrange_quadrilateral = 70, vtk_lagrange_hexahedron = 72
  integer, parameter, public :: vtk_bezier_quadrilateral = 77, vtk_bezier_hexahedron = 79

contains

  !> Places of the nodes of a hexahedron, each index from 0 to the degree.
  pure function hexahedron_nodes(degree) result(nodes)
    integer, intent(in) :: degree
    integer :: nodes(3, (degree + 1)**3)
    integer :: ring(2, 4), edges(2, 4*(degree - 1)), inner(degree - 1), ends(2), i, n, level

    ring = quadrilateral_corners(degree)
    edges = quadrilateral_edges(degree)
    inner = [(i, i=1, degree - 1)]
    ends = [0, degree]
    n = 0
    do level = 1, 2
      do i = 1, 4
        call add_box(nodes, n, ring(1:1, i), ring(2:2, i), ends(level:level))
      end do
    end do
    do level = 1, 2
      do i = 1, size(edges, 2)
        call add_box(nodes, n, edges(1:1, i), edges(2:2, i), ends(level:level))
      end do
    end do
    do i = 1, 4
      call add_box(nodes, n, ring(1:1, i), ring(2:2, i), inner)
    end do
    do i = 1, 2
      call add_box(nodes, n, ends(i:i), inner, inner)
    end do
    do i = 1, 2
      call add_box(nodes, n, inner, ends(i:i), inner)
    end do
    do i = 1, 2
      call add_box(nodes, n, inner, inner, ends(i:i))
    end do
    call add_box(nodes, n, inner, inner, inner)
  end function hexahedron_nodes

  ! Append all nodes of a box of indices, the first index fastest.
  pure subroutine add_box(nodes, n, i_range, j_range, k_range)
    integer, intent(inout) :: nodes(:, :), n
    integer, intent(in) :: i_range(:), j_range(:), k_range(:)
    integer :: a, b, c

    do c = 1, size(k_range)
      do b = 1, size(j_range)
        do a = 1, size(i_range)
          n = n + 1
          nodes(:, n) = [i_range(a), j_range(b), k_range(c)]
        end do
      end do
    end do
  end subroutine add_box

  !> Places of the nodes of a quadrilateral, each index from 0 to the degree.
  pure function quadrilateral_nodes(degree) result(nodes)
    integer, intent(in) :: degree
    integer :: nodes(2, (degree + 1)**2)
    integer :: i, j, n

    nodes(:, 1:4) = quadrilateral_corners(degree)
    nodes(:, 5:4*degree) = quadrilateral_edges(degree)
    n = 4*degree
    do j = 1, degree - 1
      do i = 1, degree - 1
        n = n + 1
        nodes(:, n) = [i, j]
      end do
    end do
  end function quadrilateral_nodes

  ! The corners in turn around the cell.
  pure function quadrilateral_corners(degree) result(corners)
    integer, intent(in) :: degree
    integer :: corners(2, 4)

    corners = reshape([0, 0, degree, 0, degree, degree, 0, degree], [2, 4])
  end function quadrilateral_corners

  ! Inner nodes of the edges j = 0, i = d, j = d and i = 0, along the rising index.
  pure function quadrilateral_edges(degree) result(edges)
    integer, intent(in) :: degree
    integer :: edges(2, 4*(degree - 1))
    integer :: i, n

    n = degree - 1
    do i = 1, n
      edges(:, i) = [i, 0]
      edges(:, n + i) = [degree, i]
      edges(:, 2*n + i) = [i, degree]
      edges(:, 3*n + i) = [0, i]
    end do
  end function quadrilateral_edges

  !> Connectivity of all cells on a grid of (degree*n + 1) points per direction, axis 1 fastest.
  !! Points count from `first_point`; shape ((degree + 1)^3, number of cells).
  pure function hexahedra_on_grid(degree, n_cells, first_point) result(connectivity)
    integer, intent(in) :: degree, n_cells(3)
    integer(int64), intent(in) :: first_point   !! number of the grid's first point, from 0
    integer(int64), allocatable :: connectivity(:, :)
    integer(int64) :: n_line(2), place(3)
    integer :: nodes(3, (degree + 1)**3), i, j, k, n, cell

    nodes = hexahedron_nodes(degree)
    n_line = int(degree, int64)*n_cells(1:2) + 1
    allocate (connectivity(size(nodes, 2), product(n_cells)))
    cell = 0
    do k = 0, n_cells(3) - 1
      do j = 0, n_cells(2) - 1
        do i = 0, n_cells(1) - 1
          cell = cell + 1
          do n = 1, size(nodes, 2)
            place = degree*[i, j, k] + nodes(:, n)
            connectivity(n, cell) = first_point + place(1) &
                                    + n_line(1)*(place(2) + n_line(2)*place(3))
          end do
        end do
      end do
    end do
  end function hexahedra_on_grid

  !> As `hexahedra_on_grid`, for quadrilaterals; shape ((degree + 1)^2, number of cells).
  pure function quadrilaterals_on_grid(degree, n_cells, first_point) result(connectivity)
    integer, intent(in) :: degree, n_cells(2)
    integer(int64), intent(in) :: first_point   !! number of the grid's first point, from 0
    integer(int64), allocatable :: connectivity(:, :)
    integer(int64) :: place(2)
    integer :: nodes(2, (degree + 1)**2), i, j, n, cell

    nodes = quadrilateral_nodes(degree)
    allocate (connectivity(size(nodes, 2), product(n_cells)))
    cell = 0
    do j = 0, n_cells(2) - 1
      do i = 0, n_cells(1) - 1
        cell = cell + 1
        do n = 1, size(nodes, 2)
          place = degree*[i, j] + nodes(:, n)
          connectivity(n, cell) = first_point + place(1) &
                                  + (int(degree, int64)*n_cells(1) + 1)*place(2)
        end do
      end do
    end do
  end function quadrilaterals_on_grid

end module vtk_cells
