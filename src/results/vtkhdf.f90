!> The part of a results file that VTK and ParaView read: one unstructured grid whose points move.
!!
!! Layout: VTKHDF 2.6, transient, mesh written once. Every step appends its points and point data;
!! the offsets tell the reader where each step begins. Readers from VTK 9.3 (ParaView 5.12) on show
!! all steps, 9.2 the first one.
!!
!! Cells are curved. Lagrange and Bezier cells of equal degree d in all directions have their
!! (d + 1)^n nodes in the order corners, edges, faces, body (VTK's PointIndexFromIJK).
module vtkhdf
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use deflated_chunk, only: deflated_chunk_t
  use hdf5_file, only: h5_uint8, create_group, hdf5_file_t, h5_int64, link_object, &
                       h5_double, write_integer_attribute, write_integers, write_reals, &
                       write_text_attribute, append_chunk, append_integers, append_reals, &
                       create_series, row_shape
  implicit none
  private

  public :: cells_t, add_cells, create_grid, create_point_data, append_points, append_point_data
  public :: append_step, write_rational_weights
  public :: hexahedron_nodes, quadrilateral_nodes, cells_on_grid

  integer, parameter, public :: vtk_lagrange_quadrilateral = 70, vtk_lagrange_hexahedron = 72
  integer, parameter, public :: vtk_bezier_quadrilateral = 77, vtk_bezier_hexahedron = 79

  character(*), parameter :: root = "/VTKHDF"
  integer, parameter :: n_chunk = 64   ! steps whose offsets are stored together

  !> Cells of all parts.
  type :: cells_t
    integer(int64), allocatable :: connectivity(:)   !! points of all cells, from 0
    integer(int64), allocatable :: offsets(:)        !! where cells begin, (number of cells + 1)
    integer(int64), allocatable :: types(:)          !! VTK's cell types
    integer(int64), allocatable :: parts(:)          !! 0 blank, 1 ... the tools
  end type cells_t

contains

  !> Add cells of one type and part.
  pure subroutine add_cells(cells, connectivity, cell_type, part)
    type(cells_t), intent(inout) :: cells
    integer(int64), intent(in) :: connectivity(:, :)   !! (points of a cell, cells), from 0
    integer, intent(in) :: cell_type, part
    integer(int64) :: i, n_nodes, last

    if (.not. allocated(cells%offsets)) then
      allocate (cells%connectivity(0), cells%types(0), cells%parts(0))
      cells%offsets = [0_int64]
    end if
    n_nodes = size(connectivity, 1)
    last = cells%offsets(size(cells%offsets))
    cells%connectivity = [cells%connectivity, [connectivity]]
    cells%offsets = [cells%offsets, (last + i*n_nodes, i=1, size(connectivity, 2, kind=int64))]
    cells%types = [cells%types, (int(cell_type, int64), i=1, size(connectivity, 2))]
    cells%parts = [cells%parts, (int(part, int64), i=1, size(connectivity, 2))]
  end subroutine add_cells

  !> Create the grid with its cells, without steps.
  subroutine create_grid(file, cells, n_points, length_unit, time_unit)
    type(hdf5_file_t), intent(inout) :: file
    type(cells_t), intent(in) :: cells
    integer, intent(in) :: n_points
    character(*), intent(in) :: length_unit, time_unit
    integer :: n_cells, n_nodes

    n_cells = size(cells%types)
    n_nodes = size(cells%connectivity)
    call create_group(file, root)
    call write_integer_attribute(file, root, "Version", [2, 6])
    call write_text_attribute(file, root, "Type", "UnstructuredGrid")
    call put("NumberOfPoints", [int(n_points, int64)], "points of the grid")
    call put("NumberOfCells", [int(n_cells, int64)], "cells of the grid")
    call put("NumberOfConnectivityIds", [int(n_nodes, int64)], "length of Connectivity")
    call put("Connectivity", cells%connectivity, "points of all cells in VTK's order of nodes")
    call put("Offsets", cells%offsets, "where each cell begins in Connectivity")
    call write_integers(file, root//"/Types", cells%types, [n_cells], "VTK's cell types", &
                        h5_uint8)
    call put("CellData/part", cells%parts, "0 the blank, 1 ... the tools in the deck's order")
    call create_series(file, root//"/Points", h5_double, [3], n_points, .false., &
                       length_unit, "points of the cells, step after step")
    call create_steps(file, time_unit)

  contains

    subroutine put(name, values, description)
      character(*), intent(in) :: name, description
      integer(int64), intent(in) :: values(:)

      call write_integers(file, root//"/"//name, values, shape(values), description, &
                          h5_int64)
    end subroutine put
  end subroutine create_grid

  ! Offsets that are always the same are one dataset with several names: each dataset more takes its
  ! time in every step.
  subroutine create_steps(file, time_unit)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: time_unit
    character(*), parameter :: steps = root//"/Steps"

    call create_group(file, root//"/PointData")
    call create_group(file, steps)
    call create_group(file, steps//"/PointDataOffsets")
    call write_integer_attribute(file, steps, "NSteps", [0])
    call create_series(file, steps//"/Values", h5_double, [integer ::], n_chunk, .false., &
                       time_unit, "time of each step")
    call create_offsets(file, "NumberOfParts", [integer ::], "always 1")
    call create_offsets(file, "PartOffsets", [integer ::], "always 0: the mesh is written once")
    call create_offsets(file, "PointOffsets", [integer ::], &
                        "first row of each step in Points and in the fields on points")
    call create_offsets(file, "CellOffsets", [1], "always 0: the mesh is written once")
    call link_object(file, steps//"/CellOffsets", steps//"/ConnectivityIdOffsets")
    call link_object(file, steps//"/PartOffsets", steps//"/CellDataOffsets/part")
  end subroutine create_steps

  subroutine create_offsets(file, name, row_shape, description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name, description
    integer, intent(in) :: row_shape(:)

    call create_series(file, root//"/Steps/"//name, h5_int64, row_shape, n_chunk, .false., &
                       "1", description)
  end subroutine create_offsets

  !> Create a field on points, a scalar or a vector.
  subroutine create_point_data(file, name, n_components, n_points, unit, description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: n_components   !! 1 or more
    integer, intent(in) :: n_points
    character(*), intent(in) :: unit, description

    call create_series(file, root//"/PointData/"//name, h5_double, row_shape(n_components), &
                       n_points, .true., unit, description)
    call link_object(file, root//"/Steps/PointOffsets", root//"/Steps/PointDataOffsets/"//name)
  end subroutine create_point_data

  !> Weights of Bezier cells, the same in all steps; for readers that know them (VTK 9.7).
  subroutine write_rational_weights(file, weights)
    type(hdf5_file_t), intent(inout) :: file
    real(wp), intent(in) :: weights(:)
    character(*), parameter :: name = root//"/PointData/RationalWeights"

    call write_reals(file, name, weights, shape(weights), "1", "weights of the Bezier points")
    call write_text_attribute(file, name, "Attribute", "RationalWeights")
    call link_object(file, root//"/Steps/PartOffsets", &
                     root//"/Steps/PointDataOffsets/RationalWeights")
  end subroutine write_rational_weights

  !> Append the points of a step.
  subroutine append_points(file, points)
    type(hdf5_file_t), intent(inout) :: file
    real(wp), intent(in) :: points(:, :)   !! shape (n, 3)

    call append_reals(file, root//"/Points", transpose(points), [3], size(points, 1))
  end subroutine append_points

  !> Append a packed field of a step, as `create_point_data` has made it.
  subroutine append_point_data(file, name, n_components, chunk, n_points)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: n_components, n_points
    type(deflated_chunk_t), intent(in) :: chunk

    call append_chunk(file, root//"/PointData/"//name, chunk, row_shape(n_components), n_points)
  end subroutine append_point_data

  !> Complete a step whose points and fields are appended; only now readers see it.
  subroutine append_step(file, time, n_points, i_step)
    type(hdf5_file_t), intent(inout) :: file
    real(wp), intent(in) :: time
    integer, intent(in) :: n_points
    integer, intent(in) :: i_step          !! steps before this one
    character(*), parameter :: steps = root//"/Steps"
    integer(int64), parameter :: zero(1) = 0_int64

    call append_reals(file, steps//"/Values", [time], [integer ::], 1)
    call append_integers(file, steps//"/NumberOfParts", [1_int64], [integer ::], 1)
    call append_integers(file, steps//"/PartOffsets", zero, [integer ::], 1)
    call append_integers(file, steps//"/PointOffsets", [int(i_step, int64)*n_points], &
                         [integer ::], 1)
    call append_integers(file, steps//"/CellOffsets", zero, [1], 1)
    call write_integer_attribute(file, steps, "NSteps", [i_step + 1])
  end subroutine append_step

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
    integer :: i, j

    nodes(:, 1:4) = quadrilateral_corners(degree)
    nodes(:, 5:4*degree) = quadrilateral_edges(degree)
    nodes(:, 4*degree + 1:) = reshape([(([i, j], i=1, degree - 1), j=1, degree - 1)], &
                                      [2, (degree - 1)**2])
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

  !> Connectivity of all cells on a grid of (degree*n + 1) points per direction, axis 1 fastest:
  !! of hexahedra, or of quadrilaterals where the grid has two directions. Points count from
  !! `first_point`; shape (nodes of a cell, number of cells).
  pure function cells_on_grid(degree, n_cells, first_point) result(connectivity)
    integer, intent(in) :: degree, n_cells(:)
    integer(int64), intent(in) :: first_point   !! number of the grid's first point, from 0
    integer(int64), allocatable :: connectivity(:, :)
    integer(int64) :: n_line(2), own((degree + 1)**size(n_cells))
    integer :: nodes(3, size(own)), i, j, k, cell, n(3)

    nodes = 0
    if (size(n_cells) == 3) nodes = hexahedron_nodes(degree)
    if (size(n_cells) == 2) nodes(:2, :) = quadrilateral_nodes(degree)
    n = 1
    n(:size(n_cells)) = n_cells
    n_line = int(degree, int64)*n(:2) + 1
    own = nodes(1, :) + n_line(1)*(nodes(2, :) + n_line(2)*nodes(3, :))
    allocate (connectivity(size(own), product(n_cells)))
    cell = 0
    do k = 0, n(3) - 1
      do j = 0, n(2) - 1
        do i = 0, n(1) - 1
          cell = cell + 1
          connectivity(:, cell) = first_point + degree*(i + n_line(1)*(j + n_line(2)*k)) + own
        end do
      end do
    end do
  end function cells_on_grid

end module vtkhdf
