!> The part of a results file that VTK and ParaView read: one unstructured grid whose points move.
!!
!! Layout: VTKHDF 2.6, transient, mesh written once. Every step appends its points and point data;
!! the offsets tell the reader where each step begins. Readers from VTK 9.3 (ParaView 5.12) on show
!! all steps, 9.2 the first one.
!!
!! All parts are one grid, because VTK 9.3 refuses a file of several grids (Type
!! PartitionedDataSetCollection, from VTK 9.4 on; their names from 9.6.1 on). So a field has a value
!! at each point, NaN where it means nothing.
!!
!! Cells are curved. Lagrange and Bezier cells of equal degree d in all directions have their
!! (d + 1)^n nodes in the order corners, edges, faces, body (VTK's PointIndexFromIJK).
module vtkhdf
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use deflated_chunk, only: deflated_chunk_t
  use hdf5_file, only: h5_uint8, h5_int64, h5_double, hdf5_file_t, create_group, link_object, &
                       write_integer_attribute, write_integers, write_reals, create_series, &
                       write_text_attribute, write_loose_text, append_chunk, append_reals, &
                       row_shape
  use text, only: string_t, to_text
  implicit none
  private

  public :: cells_t, add_cells, create_grid, create_point_data, append_points, append_point_data
  public :: append_step, write_part_names, write_rational_weights
  public :: cell_nodes, cells_on_grid

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
    call create_offsets("NumberOfParts", [integer ::], "always 1")
    call create_offsets("PartOffsets", [integer ::], "always 0: the mesh is written once")
    call create_offsets("PointOffsets", [integer ::], &
                        "first row of each step in Points and in the fields on points")
    call create_offsets("CellOffsets", [1], "always 0: the mesh is written once")
    call link_object(file, steps//"/CellOffsets", steps//"/ConnectivityIdOffsets")
    call link_object(file, steps//"/PartOffsets", steps//"/CellDataOffsets/part")

  contains

    subroutine create_offsets(name, row_shape, description)
      character(*), intent(in) :: name, description
      integer, intent(in) :: row_shape(:)

      call create_series(file, steps//"/"//name, h5_int64, row_shape, n_chunk, .false., "1", &
                         description)
    end subroutine create_offsets
  end subroutine create_steps

  !> Names of the parts, data of the whole grid. Each is an array of its own, for of an array of
  !! texts VTK 9.3 shows the first one only; without the offset 9.4 and later read none.
  subroutine write_part_names(file, names)
    type(hdf5_file_t), intent(inout) :: file
    type(string_t), intent(in) :: names(:)       !! of parts 0, 1, ...
    character(:), allocatable :: name
    integer :: i

    do i = 1, size(names)
      name = "part_"//to_text(i - 1)
      call write_loose_text(file, root//"/FieldData/"//name, names(i)%value, "name of part "// &
                            to_text(i - 1)//" of the cells")
      call link_object(file, root//"/Steps/PartOffsets", root//"/Steps/FieldDataOffsets/"//name)
    end do
  end subroutine write_part_names

  !> Create a field on points, a scalar, a vector or a tensor.
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

    call append_reals(file, steps//"/Values", [time], [integer ::], 1)
    call append_reals(file, steps//"/NumberOfParts", [1.0_wp], [integer ::], 1)
    call append_reals(file, steps//"/PartOffsets", [0.0_wp], [integer ::], 1)
    call append_reals(file, steps//"/PointOffsets", [real(i_step, wp)*n_points], [integer ::], 1)
    call append_reals(file, steps//"/CellOffsets", [0.0_wp], [1], 1)
    call write_integer_attribute(file, steps, "NSteps", [i_step + 1])
  end subroutine append_step

  !> Places of the nodes of a hexahedron or, with two directions, of a quadrilateral: each index
  !! from 0 to the degree.
  pure function cell_nodes(degree, n_directions) result(nodes)
    integer, intent(in) :: degree, n_directions
    integer :: nodes(3, (degree + 1)**n_directions)
    ! Corners, edges, faces and the body: 0 and 1 at the ends of a direction, 2 between them.
    integer, parameter :: parts(3, 27) = reshape([ &
      0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1, &
      2, 0, 0, 1, 2, 0, 2, 1, 0, 0, 2, 0, 2, 0, 1, 1, 2, 1, 2, 1, 1, 0, 2, 1, &
      0, 0, 2, 1, 0, 2, 1, 1, 2, 0, 1, 2, &
      0, 2, 2, 1, 2, 2, 2, 0, 2, 2, 1, 2, 2, 2, 0, 2, 2, 1, 2, 2, 2], [3, 27])
    integer :: low(3), high(3), part, n, i, j, k

    n = 0
    do part = 1, size(parts, 2)
      if (n_directions == 2 .and. parts(3, part) > 0) cycle
      low = merge(1, degree*parts(:, part), parts(:, part) == 2)
      high = merge(degree - 1, degree*parts(:, part), parts(:, part) == 2)
      do k = low(3), high(3)
        do j = low(2), high(2)
          do i = low(1), high(1)
            n = n + 1
            nodes(:, n) = [i, j, k]
          end do
        end do
      end do
    end do
  end function cell_nodes

  !> Connectivity of all cells on a grid of (degree*n + 1) points per direction, axis 1 fastest:
  !! of hexahedra, or of quadrilaterals where the grid has two directions. Points count from
  !! `first_point`; shape (nodes of a cell, number of cells).
  pure function cells_on_grid(degree, n_cells, first_point) result(connectivity)
    integer, intent(in) :: degree, n_cells(:)
    integer(int64), intent(in) :: first_point   !! number of the grid's first point, from 0
    integer(int64), allocatable :: connectivity(:, :)
    integer(int64) :: n_line(2), own((degree + 1)**size(n_cells))
    integer :: nodes(3, size(own)), i, j, k, cell, n(3)

    nodes = cell_nodes(degree, size(n_cells))
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
