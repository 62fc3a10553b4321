!> What a frame shows: its fields at the display points of blank and tools.
module frame_values
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use display_grid, only: display_directors, display_grid_t, display_thickness, display_vectors, &
                          new_display_grid
  use display_fields, only: derive_part, display_field_t, field_entry_t, fields_of, first_columns, &
                            frame_t, n_derived_parts, output_fields, patch_frame_t, patch_view_t, &
                            tools_view_t
  use point_geometry, only: new_point_geometry, parts_of
  use tool_mesh, only: carried, new_surface_mesh, surface_mesh_t
  use vtkhdf, only: add_cells, cells_t, cells_on_grid, vtk_bezier_hexahedron, &
                    vtk_bezier_quadrilateral, vtk_lagrange_hexahedron, vtk_lagrange_quadrilateral
  use text, only: string_t
  use gauss_rule, only: gauss_rule_t
  use nurbs_solid, only: nurbs_solid_t
  use nurbs_surface, only: nurbs_surface_t
  use history, only: history_sample_t
  use provenance, only: provenance_t
  implicit none
  private

  public :: display_t, new_display, fill_values, blank_points
  public :: display_patch_t, display_tool_t, results_setup_t, frame_t

  !> A patch of the blank to be shown.
  type :: display_patch_t
    character(:), allocatable :: name
    type(nurbs_solid_t) :: solid                        !! at the start
    type(gauss_rule_t) :: rule(3)                       !! integration points of an element
    !> Part of each element along the sheet that its outline leaves at the start; may be missing.
    real(wp), allocatable :: share(:, :)
  end type display_patch_t

  !> A tool to be shown.
  type :: display_tool_t
    character(:), allocatable :: name
    integer :: side = 1                                 !! +1: the sheet lies where xi x eta points
    real(wp) :: cell_length = huge(1.0_wp)              !! of a Lagrange cell at most [length]
    type(nurbs_surface_t), allocatable :: surfaces(:)   !! in their position at the start
  end type display_tool_t

  !> What a results file is made from.
  type :: results_setup_t
    character(:), allocatable :: path
    type(display_patch_t), allocatable :: patches(:)    !! of the blank
    type(display_tool_t), allocatable :: tools(:)
    type(history_sample_t) :: history                      !! a row filled once, for its columns
    type(string_t), allocatable :: steps(:)             !! of the deck, names; may be none
    integer :: n_state = 0                              !! columns of the frames' state
    type(string_t), allocatable :: state_names(:)       !! of these columns; may be none
    logical :: is_bezier = .false.                      !! Bezier cells instead of Lagrange
    logical :: is_surface = .false.                     !! the mid-surface of shells alone
    type(field_entry_t), allocatable :: fields(:)       !! missing: the usual ones
    real(wp) :: blank_mass = 0.0_wp                     !! without what scaling has added
    real(wp) :: width_ratio = 1.0_wp                    !! full width over that of the blank
    type(provenance_t) :: provenance
  end type results_setup_t

  !> All that is shown, and where its display points are: first those of the patches, then those of
  !! the tools.
  type :: display_t
    type(patch_view_t), allocatable :: patches(:)
    type(display_tool_t), allocatable :: tools(:)
    type(tools_view_t) :: tool_points                   !! display points of the tools
    type(field_entry_t), allocatable :: entries(:)      !! output fields
    type(display_field_t), allocatable :: fields(:)     !! all of them
    integer, allocatable :: last(:)                     !! last display point of each patch
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
    integer(int64), allocatable :: nodes(:, :)
    integer :: i, s, job, n_patches, type_of_cell

    display%tools = setup%tools
    display%is_bezier = setup%is_bezier
    if (allocated(setup%fields)) then
      display%entries = setup%fields
    else
      display%entries = output_fields(0, has_stress=.false.)
    end if
    display%fields = fields_of(display%entries)
    n_patches = size(setup%patches)
    allocate (display%patches(n_patches))
    tools = [((i, s=1, size(setup%tools(i)%surfaces)), i=1, size(setup%tools))]
    surfaces = [((s, s=1, size(setup%tools(i)%surfaces)), i=1, size(setup%tools))]
    allocate (meshes(size(tools)))
    !$omp parallel do schedule(dynamic)
    do job = 1, n_patches + size(meshes)
      if (job <= n_patches) then
        associate (patch => setup%patches(job), view => display%patches(job))
          view%name = patch%name
          view%solid = patch%solid
          view%rule_size = patch%rule%n
          view%grid = new_display_grid(patch%solid, patch%rule, setup%is_bezier, setup%is_surface)
          view%geometry = new_point_geometry(patch%solid, patch%rule)
          view%thickness = thickness_of(view%grid, patch%solid)
        end associate
      else
        associate (tool => setup%tools(tools(job - n_patches)))
          meshes(job - n_patches) = new_surface_mesh(tool%surfaces(surfaces(job - n_patches)), &
                                                     setup%is_bezier, tool%cell_length)
        end associate
      end if
    end do
    !$omp end parallel do
    allocate (weights(0), display%last(n_patches))
    do i = 1, n_patches
      associate (grid => display%patches(i)%grid)
        if (grid%is_surface) then
          nodes = cells_on_grid(grid%degree, grid%n_elements(:2), size(weights, kind=int64))
          type_of_cell = vtk_lagrange_quadrilateral
        else
          nodes = cells_on_grid(grid%degree, grid%n_elements, size(weights, kind=int64))
          type_of_cell = merge(vtk_bezier_hexahedron, vtk_lagrange_hexahedron, display%is_bezier)
        end if
        if (allocated(setup%patches(i)%share)) &
          nodes = nodes(:, pack([(s, s=1, size(nodes, 2))], [spread(setup%patches(i)%share &
                        > 0.0_wp, 3, size(nodes, 2)/size(setup%patches(i)%share))]))
        call add_cells(cells, nodes, type_of_cell, 0)
        weights = [weights, grid%weights]
      end associate
      display%last(i) = size(weights)
    end do
    call place_tools(display, meshes, tools, surfaces, cells, weights)
    display%n_points = size(weights)
  end subroutine new_display

  !> Thickness at the display points at the start.
  pure function thickness_of(grid, solid) result(thickness)
    type(display_grid_t), intent(in) :: grid
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), allocatable :: thickness(:)

    if (grid%is_surface) then
      thickness = norm2(display_directors(grid, solid%points), 2)
    else
      thickness = [display_thickness(grid, display_vectors(grid, reshape( &
        solid%points, [size(solid%weights), 3])))]
    end if
  end function thickness_of

  !> Cells and weights of the tools after those of the blank, and their display points.
  subroutine place_tools(display, meshes, tools, surfaces, cells, weights)
    type(display_t), intent(inout) :: display
    type(surface_mesh_t), intent(in) :: meshes(:)
    integer, intent(in) :: tools(size(meshes)), surfaces(size(meshes))
    type(cells_t), intent(inout) :: cells
    real(wp), allocatable, intent(inout) :: weights(:)
    real(wp) :: whole
    integer :: m, j, n_blank

    n_blank = size(weights)
    allocate (display%tool_points%points(0, 3), display%tool_points%tool_of_point(0))
    allocate (display%tool_points%edge_distance(0))
    allocate (display%tool_points%meshes(size(meshes)))
    do m = 1, size(meshes)
      associate (mesh => meshes(m), view => display%tool_points)
        associate (location => view%meshes(m))
          location%tool = tools(m)
          location%surface = surfaces(m)
          location%first = size(weights) - n_blank + 1
          location%xi = mesh%xi
          location%eta = mesh%eta
        end associate
        call add_cells(cells, mesh%connectivity + size(weights), &
                       merge(vtk_bezier_quadrilateral, vtk_lagrange_quadrilateral, &
                             display%is_bezier), tools(m))
        weights = [weights, mesh%weights]
        view%points = transpose(reshape( &
          [transpose(view%points), transpose(mesh%points)], [3, size(weights) - n_blank]))
        view%tool_of_point = [view%tool_of_point, (tools(m), j=1, size(mesh%weights))]
        if (allocated(mesh%edge_distance)) then
          view%edge_distance = [view%edge_distance, mesh%edge_distance]
        else
          whole = norm2(maxval(mesh%points, 1) - minval(mesh%points, 1))
          view%edge_distance = [view%edge_distance, (whole, j=1, size(mesh%weights))]
        end if
      end associate
    end do
  end subroutine place_tools

  !> Positions and fields of a frame. All threads of a region call this and divide the work, of
  !! which the parts are long: they take them one by one.
  subroutine fill_values(display, frame, points, values)
    type(display_t), intent(inout) :: display   !! its views hold what is derived from the frame
    type(frame_t), intent(in) :: frame
    real(wp), intent(inout) :: points(:, :)     !! positions, (n_points, 3)
    real(wp), intent(inout) :: values(:, :)     !! columns of all fields
    integer :: job, p, first, i, n_entries, columns(size(display%entries) + 1)

    n_entries = size(display%entries)
    columns = first_columns(display%entries)
    !$omp do schedule(dynamic)
    do job = 0, n_derived_parts*size(display%patches) - 1
      p = mod(job, size(display%patches)) + 1
      call derive_part(job/size(display%patches) + 1, display%patches(p), frame%patches(p))
    end do
    !$omp end do
    !$omp do schedule(dynamic)
    do job = 0, n_entries*size(display%patches)
      if (job == n_entries*size(display%patches)) then
        call fill_tools(display, frame, columns, points, values)
      else
        p = mod(job, size(display%patches)) + 1
        i = n_entries - job/size(display%patches)
        first = display%last(p) - size(display%patches(p)%grid%weights) + 1
        associate (entry => display%entries(i), last => display%last(p), &
                   from => columns(i), to => columns(i + 1) - 1)
          values(first:last, from:to) = ieee_value(1.0_wp, ieee_quiet_nan)
          if (associated(entry%on_patch)) &
            call entry%on_patch(display%patches(p), frame%patches(p), values(first:last, from:to))
          if (allocated(frame%patches(p)%edge_distance)) &
            call blank_out(frame%patches(p)%edge_distance, values(first:last, from:to))
        end associate
      end if
    end do
    !$omp end do
    !$omp do
    do p = 1, size(display%patches)
      first = display%last(p) - size(display%patches(p)%grid%weights) + 1
      associate (view => display%patches(p), n => display%patches(p)%geometry%n, &
                 rule_size => display%patches(p)%rule_size)
        points(first:display%last(p), :) = view%positions
        ! All fields at display points are there now: what follows is of the integration points.
        if (allocated(frame%patches(p)%share)) &
          view%strains(:, view%geometry%cut%at) = view%cut_strains
        call blank_points(n, rule_size, frame%patches(p), 1, view%eqps)
        call blank_points(n, rule_size, frame%patches(p), size(view%stress, 1), view%stress)
        call blank_points(n, rule_size, frame%patches(p), size(view%strains, 1), view%strains)
      end associate
    end do
    !$omp end do
  end subroutine fill_values

  !> NaN where nothing is left of a sheet.
  pure subroutine blank_out(edge_distance, values)
    real(wp), intent(in) :: edge_distance(:, :)    !! of the points of a layer, NaN there
    real(wp), intent(inout) :: values(:, :)
    integer :: i, n

    n = size(edge_distance, 1)
    do i = 1, size(values, 1)
      associate (at => mod(i - 1, size(edge_distance)))
        if (ieee_is_nan(edge_distance(mod(at, n) + 1, at/n + 1))) &
          values(i, :) = ieee_value(1.0_wp, ieee_quiet_nan)
      end associate
    end do
  end subroutine blank_out

  !> NaN at the integration points of elements of which an outline leaves nothing.
  pure subroutine blank_points(n, rule_size, frame, n_components, values)
    integer, intent(in) :: n(3)                    !! points of the patch along each axis
    integer, intent(in) :: rule_size(3)            !! those of an element
    type(patch_frame_t), intent(in) :: frame
    integer, intent(in) :: n_components
    real(wp), intent(inout) :: values(n_components, product(n))

    if (.not. allocated(frame%share)) return
    where (spread(parts_of(n, rule_size, frame%share) <= 0.0_wp, 1, n_components)) &
      values = ieee_value(1.0_wp, ieee_quiet_nan)
  end subroutine blank_points

  subroutine fill_tools(display, frame, columns, points, values)
    type(display_t), intent(in) :: display
    type(frame_t), intent(in) :: frame
    integer, intent(in) :: columns(:)           !! first one of each entry
    real(wp), intent(inout) :: points(:, :), values(:, :)
    integer :: i, first

    associate (view => display%tool_points)
      first = display%n_points - size(view%tool_of_point) + 1
      points(first:, :) = view%points + carried(view%points, view%tool_of_point, &
                                                frame%tool_displacement, frame%tool_turn)
      do i = 1, size(display%entries)
        associate (entry => display%entries(i), from => columns(i), to => columns(i + 1) - 1)
          values(first:, from:to) = ieee_value(1.0_wp, ieee_quiet_nan)
          if (associated(entry%on_tools)) &
            call entry%on_tools(view, frame, values(first:, from:to))
        end associate
      end do
    end associate
  end subroutine fill_tools

end module frame_values
