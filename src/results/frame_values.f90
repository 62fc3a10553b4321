!> What a frame shows: its fields at the display points of blank and tools.
module frame_values
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use frame_data, only: display_patch_t, display_tool_t, results_setup_t, frame_t, mesh_place_t
  use display_grid, only: display_thickness, display_vectors, new_display_grid
  use display_fields, only: add_face_fields, add_tool_fields, fill_share, n_shares, patch_view_t
  use point_geometry, only: new_point_geometry
  use tool_mesh, only: new_surface_mesh, surface_mesh_t
  use tool_places, only: carried
  use vtk_cells, only: hexahedra_on_grid, vtk_bezier_hexahedron, vtk_bezier_quadrilateral, &
                       vtk_lagrange_hexahedron, vtk_lagrange_quadrilateral
  use vtkhdf, only: add_cells, cells_t
  implicit none
  private

  public :: display_t, new_display, fill_values

  !> All that is shown, and where its display points are: first those of the patches, then those of
  !! the tools.
  type :: display_t
    type(patch_view_t), allocatable :: patches(:)
    type(display_tool_t), allocatable :: tools(:)
    integer, allocatable :: last(:)                     !! last display point of each patch
    real(wp), allocatable :: tool_points(:, :)          !! display points of the tools, (n, 3)
    integer, allocatable :: tool_of_point(:)
    type(mesh_place_t), allocatable :: meshes(:)        !! of the tools' surfaces
    integer :: n_contact_fields = 0
    integer :: n_points = 0                             !! display points of blank and tools
    logical :: is_bezier = .false.
  end type display_t

contains

  !> Display points, cells and weights of blank and tools.
  subroutine new_display(setup, display, cells, weights)
    type(results_setup_t), intent(in) :: setup
    type(display_t), intent(out) :: display
    type(cells_t), intent(out) :: cells
    real(wp), allocatable, intent(out) :: weights(:)   !! of the display points
    type(surface_mesh_t), allocatable :: meshes(:)
    integer, allocatable :: tools(:), surfaces(:)      ! of each mesh
    integer :: i, s, job, n_patches

    display%tools = setup%tools
    display%is_bezier = setup%is_bezier
    display%n_contact_fields = setup%n_contact_fields
    n_patches = size(setup%patches)
    allocate (display%patches(n_patches))
    tools = [((i, s=1, size(setup%tools(i)%surfaces)), i=1, size(setup%tools))]
    surfaces = [((s, s=1, size(setup%tools(i)%surfaces)), i=1, size(setup%tools))]
    allocate (meshes(size(tools)))
    !$omp parallel do schedule(dynamic)
    do job = 1, n_patches + size(meshes)
      if (job <= n_patches) then
        call start_view(setup%patches(job), setup%is_bezier, display%patches(job))
      else
        associate (tool => setup%tools(tools(job - n_patches)))
          meshes(job - n_patches) = new_surface_mesh(tool%surfaces(surfaces(job - n_patches)), &
                                                     setup%is_bezier, tool%cell_length)
        end associate
      end if
    end do
    !$omp end parallel do
    call place_patches(display, cells, weights)
    call place_tools(display, meshes, tools, surfaces, cells, weights)
    display%n_points = size(weights)
  end subroutine new_display

  subroutine start_view(patch, is_bezier, view)
    type(display_patch_t), intent(in) :: patch
    logical, intent(in) :: is_bezier
    type(patch_view_t), intent(inout) :: view

    view%name = patch%name
    view%solid = patch%solid
    view%rule_size = patch%rule%n
    view%grid = new_display_grid(patch%solid, patch%rule, is_bezier)
    view%geometry = new_point_geometry(patch%solid, patch%rule)
    view%thickness = [display_thickness(view%grid, display_vectors(view%grid, reshape( &
      patch%solid%points, [size(patch%solid%weights), 3])))]
  end subroutine start_view

  !> Cells and weights of the blank.
  subroutine place_patches(display, cells, weights)
    type(display_t), intent(inout) :: display
    type(cells_t), intent(out) :: cells
    real(wp), allocatable, intent(out) :: weights(:)
    integer :: p

    allocate (weights(0), display%last(size(display%patches)))
    do p = 1, size(display%patches)
      associate (grid => display%patches(p)%grid)
        call add_cells(cells, hexahedra_on_grid(grid%degree, grid%n_elements, &
                                                size(weights, kind=int64)), &
                       merge(vtk_bezier_hexahedron, vtk_lagrange_hexahedron, display%is_bezier), 0)
        weights = [weights, grid%weights]
      end associate
      display%last(p) = size(weights)
    end do
  end subroutine place_patches

  !> Cells and weights of the tools behind those of the blank, and their display points.
  subroutine place_tools(display, meshes, tools, surfaces, cells, weights)
    type(display_t), intent(inout) :: display
    type(surface_mesh_t), intent(in) :: meshes(:)
    integer, intent(in) :: tools(size(meshes)), surfaces(size(meshes))
    type(cells_t), intent(inout) :: cells
    real(wp), allocatable, intent(inout) :: weights(:)
    integer :: m, j, n_blank

    n_blank = size(weights)
    allocate (display%tool_points(0, 3), display%tool_of_point(0), display%meshes(size(meshes)))
    do m = 1, size(meshes)
      associate (mesh => meshes(m), place => display%meshes(m))
        place%tool = tools(m)
        place%surface = surfaces(m)
        place%first = size(weights) + 1
        place%xi = mesh%xi
        place%eta = mesh%eta
        call add_cells(cells, mesh%connectivity + size(weights), &
                       merge(vtk_bezier_quadrilateral, vtk_lagrange_quadrilateral, &
                             display%is_bezier), tools(m))
        weights = [weights, mesh%weights]
        display%tool_points = transpose(reshape( &
          [transpose(display%tool_points), transpose(mesh%points)], [3, size(weights) - n_blank]))
        display%tool_of_point = [display%tool_of_point, (tools(m), j=1, size(mesh%weights))]
      end associate
    end do
  end subroutine place_tools

  !> Places and fields of a frame. All threads of a region call this and share the work, of which
  !! the parts are long: they take them one by one.
  subroutine fill_values(display, frame, points, values)
    type(display_t), intent(inout) :: display   !! the views hold fields at integration points
    type(frame_t), intent(in) :: frame
    real(wp), intent(inout) :: points(:, :)     !! places, (n_points, 3)
    real(wp), intent(inout) :: values(:, :)     !! fields in the order of `display_fields_of`
    integer :: job, p, first

    !$omp do schedule(dynamic)
    do job = 0, n_shares*size(display%patches)
      if (job == n_shares*size(display%patches)) then
        call fill_tools(display, frame, points, values)
      else
        p = mod(job, size(display%patches)) + 1
        first = display%last(p) - size(display%patches(p)%grid%weights) + 1
        call fill_share(job/size(display%patches) + 1, display%patches(p), frame%patches(p), &
                        points(first:display%last(p), :), values(first:display%last(p), :))
      end if
    end do
    !$omp end do
  end subroutine fill_values

  !> Places and fields at the display points of the tools, and those of contact at all.
  subroutine fill_tools(display, frame, points, values)
    type(display_t), intent(in) :: display
    type(frame_t), intent(in) :: frame
    real(wp), intent(inout) :: points(:, :), values(:, :)
    integer :: p, first, last, n

    n = size(values, 2)
    last = display%n_points - size(display%tool_of_point)
    associate (displacement => values(last + 1:, :3), velocity => values(last + 1:, 4:6), &
               contact => values(:, n - display%n_contact_fields + 1:))
      values(last + 1:, 7:) = ieee_value(1.0_wp, ieee_quiet_nan)
      displacement = carried(display%tool_points, display%tool_of_point, &
                             frame%tool_displacement, frame%tool_turn)
      points(last + 1:, :) = display%tool_points + displacement
      velocity = carried(display%tool_points, display%tool_of_point, frame%tool_velocity, &
                         frame%tool_turn_rate)
      if (display%n_contact_fields == 0) return
      contact(:last, :) = ieee_value(1.0_wp, ieee_quiet_nan)
      do p = 1, size(display%patches)
        first = display%last(p) - size(display%patches(p)%grid%weights) + 1
        contact(first:display%last(p), 1) = 0.0_wp
        call add_face_fields(display%patches(p), frame%patches(p), &
                             contact(first:display%last(p), 1))
      end do
      call fill_tool_fields(display, frame, contact)
    end associate
  end subroutine fill_tools

  !> Pressure and wear at the display points of the tools.
  pure subroutine fill_tool_fields(display, frame, values)
    type(display_t), intent(in) :: display
    type(frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)
    integer :: f, m, last

    values(display%n_points - size(display%tool_of_point) + 1:, :) = 0.0_wp
    if (.not. allocated(frame%tool_fields)) return
    do f = 1, size(frame%tool_fields)
      do m = 1, size(display%meshes)
        associate (mesh => display%meshes(m), field => frame%tool_fields(f))
          if (mesh%tool /= field%tool .or. mesh%surface /= field%surface) cycle
          last = mesh%first + size(mesh%xi)*size(mesh%eta) - 1
          call add_tool_fields(field, mesh%xi, mesh%eta, values(mesh%first:last, :))
        end associate
      end do
    end do
  end subroutine fill_tool_fields

end module frame_values
