!> Results of a run in one HDF5 file: frames for VTK and ParaView, and beside them what VTK ignores:
!! history, tools, integration points, exact geometry, provenance, timings.
!!
!! Between frames nothing is written: history rows wait in memory, and a frame is written in one go
!! that ends with a flush. After kill -9 the file therefore opens and holds everything up to the
!! last frame. Only a kill within the writing of a frame can hurt: of 500 writers that did nothing
!! but write frames, killed at random times, all left files that open, one with a dataset that
!! cannot be read. Three choices bring that about. The number of steps is raised in a second flush,
!! when the step itself is in the file. Datasets that grow by less than a chunk are not compressed,
!! for their chunks would move (else 42 of 150 files had a broken dataset). The file keeps the
!! library's oldest format: newer ones mark a file as open, and a killed writer leaves the mark
!! behind, so that no reader opens the file; the single-writer mode needs such a format.
module frames
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use errors, only: error_t
  use text, only: joined, strings, to_text
  use frame_data, only: display_patch_t, display_tool_t, results_setup_t, frame_t, &
                        mesh_place_t, tool_names, probe_names
  use hdf5_file, only: close_file, give_up_file, open_file, create_file, create_group, &
                       byte_values, flush_file, hdf5_file_t, integer_values, real_values, &
                       take_error, write_reals, write_text_attribute, write_integer_attribute
  use hdf5_series, only: append_integers, append_reals, create_series
  use unit_system, only: new_unit_system, unit_of, unit_system_t
  use provenance, only: text_or_empty
  use provenance_record, only: write_provenance, write_blank_mass, write_width_ratio, &
                               write_timings
  use run_log, only: timings_t
  use display_grid, only: display_thickness, display_vectors, new_display_grid, point_grid
  use display_fields, only: add_face_fields, add_tool_fields, display_field_t, &
                            display_fields_of, face_field_t, patch_frame_t, patch_scalars, &
                            patch_vectors, patch_view_t, tool_frame_t
  use point_geometry, only: new_point_geometry, plane_strains
  use tool_places, only: carried
  use tool_mesh, only: new_surface_mesh, surface_mesh_t
  use vtk_cells, only: hexahedra_on_grid, vtk_bezier_hexahedron, vtk_bezier_quadrilateral, &
                       vtk_lagrange_hexahedron, vtk_lagrange_quadrilateral
  use vtkhdf, only: add_cells, append_point_data, append_points, append_step, cells_t, &
                    create_grid, create_point_data, write_rational_weights
  use nurbs_record, only: update_points, write_solid, write_surface
  use history, only: history_row_t, history_t, open_history, record_row, write_history, &
                     forget_rows, n_waiting_rows
  implicit none
  private

  public :: results_t, results_setup_t, display_patch_t, display_tool_t, frame_t, patch_frame_t
  public :: face_field_t, tool_frame_t
  public :: open_results, write_frame, record_history, close_results
  public :: flush_results, forget_history, n_frames_of, n_rows_of

  !> An open results file.
  type :: results_t
    private
    type(hdf5_file_t) :: file
    type(unit_system_t) :: units
    type(patch_view_t), allocatable :: patches(:)
    type(display_tool_t), allocatable :: tools(:)
    type(history_t) :: history
    real(wp), allocatable :: tool_points(:, :)          ! display points of the tools, (n, 3)
    integer, allocatable :: tool_of_point(:)
    type(mesh_place_t), allocatable :: meshes(:)        ! of the tools' surfaces
    integer :: n_contact_fields = 0
    integer :: n_state = 0
    character(:), allocatable :: state_names            ! set apart by commas, or empty
    integer :: n_points = 0                             ! display points of blank and tools
    integer :: n_frames = 0
    logical :: is_bezier = .false.
  end type results_t

contains

  !> Go on with a results file, or create one with everything that does not change once the deck is
  !! accepted. Fails if the file cannot be created (see `create_file`) or written.
  subroutine open_results(results, setup, error, n_frames)
    type(results_t), intent(out) :: results
    type(results_setup_t), intent(in) :: setup
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: n_frames   !! in the file; absent: a new file
    type(cells_t) :: cells
    real(wp), allocatable :: weights(:)
    integer :: p

    results%units = new_unit_system(text_or_empty(setup%provenance%units))
    results%tools = setup%tools
    results%n_state = setup%n_state
    results%state_names = ""
    if (allocated(setup%state_names)) results%state_names = joined(setup%state_names, ", ")
    results%is_bezier = setup%is_bezier
    results%n_contact_fields = setup%n_contact_fields
    allocate (results%patches(size(setup%patches)))
    do p = 1, size(results%patches)
      associate (view => results%patches(p), patch => setup%patches(p))
        view%name = patch%name
        view%solid = patch%solid
        view%rule_size = patch%rule%n
        view%grid = new_display_grid(patch%solid, patch%rule, setup%is_bezier)
        view%geometry = new_point_geometry(patch%solid, patch%rule)
        view%thickness = [display_thickness(view%grid, display_vectors(view%grid, reshape( &
          patch%solid%points, [size(patch%solid%weights), 3])))]
      end associate
    end do
    call mesh_blank_and_tools(results, cells, weights)

    if (present(n_frames)) then
      results%n_frames = n_frames
      call open_file(results%file, setup%path)
    else
      call create_file(results%file, setup%path)
      call write_what_stays(results, setup, cells, weights)
    end if
    call open_history(results%history, results%file, results%units, tool_names(setup), &
                      setup%tools%is_turning, probe_names(setup))
    if (allocated(setup%steps)) then
      call write_text_attribute(results%file, "/frames/process_step", "names", &
                                joined(setup%steps, ", "))
      call write_text_attribute(results%file, "/history/process_step", "names", &
                                joined(setup%steps, ", "))
    end if
    call flush_file(results%file)
    call take_error(results%file, error)
    if (.not. allocated(error)) return
    if (present(n_frames)) then
      call close_file(results%file)
    else
      call give_up_file(results%file)
    end if
  end subroutine open_results

  !> Everything that does not change, and empty series for what does.
  subroutine write_what_stays(results, setup, cells, weights)
    type(results_t), intent(inout) :: results
    type(results_setup_t), intent(in) :: setup
    type(cells_t), intent(in) :: cells
    real(wp), intent(in) :: weights(:)
    integer :: p

    associate (file => results%file)
      call write_provenance(file, setup%provenance)
      call write_blank_mass(file, setup%blank_mass, unit_of(results%units, "mass"))
      if (setup%width_ratio > 1.0_wp) call write_width_ratio(file, setup%width_ratio)
      call create_grid(file, cells, results%n_points, unit_of(results%units, "length"), &
                       unit_of(results%units, "time"))
      if (setup%is_bezier) call write_rational_weights(file, weights)
      call create_fields(results)
      call create_series(file, "/frames/is_failed", byte_values, [integer ::], 64, .false., "1", &
                         "1 for the state at which a run failed, 0 for all other frames")
      call create_series(file, "/frames/process_step", integer_values, [integer ::], 64, .false., &
                         "1", "step of the deck, from 1 on")
      do p = 1, size(results%patches)
        call create_series(file, patch_folder(results, "/frames", p)//"/eqps", real_values, &
                           results%patches(p)%geometry%n, 1, .true., "1", &
                           "equivalent plastic strain at the integration points, all frames")
        call write_point_geometry(results, p)
      end do
      call write_geometry(results)
    end associate
  end subroutine write_what_stays

  !> Write the history so far, or its first rows since the last frame, and hand all to the operating
  !! system: what a checkpoint needs.
  subroutine flush_results(results, error, n_rows)
    type(results_t), intent(inout) :: results
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: n_rows

    call write_history(results%history, results%file, n_rows)
    call flush_file(results%file)
    call take_error(results%file, error)
  end subroutine flush_results

  !> Let go of the history since the last frame or flush but for its first rows.
  subroutine forget_history(results, n_rows)
    type(results_t), intent(inout) :: results
    integer, intent(in) :: n_rows

    call forget_rows(results%history, n_rows)
  end subroutine forget_history

  !> Rows of the history since the last frame or flush.
  pure integer function n_rows_of(results)
    type(results_t), intent(in) :: results

    n_rows_of = n_waiting_rows(results%history)
  end function n_rows_of

  !> Frames written so far.
  pure integer function n_frames_of(results)
    type(results_t), intent(in) :: results

    n_frames_of = results%n_frames
  end function n_frames_of

  !> Write a frame and the history up to it, or its first rows, then flush the file.
  subroutine write_frame(results, frame, error, n_rows)
    type(results_t), intent(inout) :: results
    type(frame_t), intent(in) :: frame
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: n_rows   !! absent: all that wait
    integer(int64) :: mark(1)
    integer :: p

    mark = merge(1, 0, frame%is_failed)
    do p = 1, size(results%patches)
      associate (view => results%patches(p))
        view%strains = plane_strains(view%geometry, reshape(frame%patches(p)%points, &
                                                            [size(view%solid%weights), 3]))
      end associate
    end do
    call write_display(results, frame)
    do p = 1, size(results%patches)
      call write_points(results, p, frame%patches(p))
    end do
    call update_geometry(results, frame)
    call write_history(results%history, results%file, n_rows)
    call append_integers(results%file, "/frames/is_failed", mark, [integer ::], 1)
    mark = frame%process_step
    call append_integers(results%file, "/frames/process_step", mark, [integer ::], 1)
    call flush_file(results%file)
    call append_step(results%file, frame%time, results%n_points, results%n_frames, &
                     results%is_bezier)
    call flush_file(results%file)
    results%n_frames = results%n_frames + 1
    call take_error(results%file, error)
  end subroutine write_frame

  !> Keep a row of the history in memory until the next frame.
  subroutine record_history(results, row)
    type(results_t), intent(inout) :: results
    type(history_row_t), intent(in) :: row

    call record_row(results%history, row)
  end subroutine record_history

  !> Write what is left of the history, how the run ended and what it cost; close the file.
  subroutine close_results(results, status, timings, error, relaxation)
    type(results_t), intent(inout) :: results
    character(*), intent(in) :: status          !! completed, failed or interrupted
    type(timings_t), intent(in) :: timings
    type(error_t), allocatable, intent(out) :: error
    character(*), intent(in), optional :: relaxation   !! how it went; may be empty

    if (present(relaxation)) then
      if (relaxation /= "") then
        call write_text_attribute(results%file, "/provenance", "relaxation", relaxation)
      end if
    end if
    call write_history(results%history, results%file)
    call write_timings(results%file, timings)
    call write_text_attribute(results%file, "/provenance", "status", status)
    call flush_file(results%file)
    call close_file(results%file)
    call take_error(results%file, error)
  end subroutine close_results

  ! Cells and weights of everything, and the tools' display points.
  subroutine mesh_blank_and_tools(results, cells, weights)
    type(results_t), intent(inout) :: results
    type(cells_t), intent(out) :: cells
    real(wp), allocatable, intent(out) :: weights(:)
    type(surface_mesh_t) :: mesh
    type(mesh_place_t) :: place
    integer :: i, s, j, p, n_blank

    allocate (weights(0))
    do p = 1, size(results%patches)
      associate (grid => results%patches(p)%grid)
        call add_cells(cells, hexahedra_on_grid(grid%degree, grid%n_elements, &
                                                size(weights, kind=int64)), &
                       merge(vtk_bezier_hexahedron, vtk_lagrange_hexahedron, results%is_bezier), 0)
        weights = [weights, grid%weights]
      end associate
    end do
    n_blank = size(weights)
    allocate (results%tool_points(0, 3), results%tool_of_point(0), results%meshes(0))
    do i = 1, size(results%tools)
      do s = 1, size(results%tools(i)%surfaces)
        mesh = new_surface_mesh(results%tools(i)%surfaces(s), results%is_bezier, &
                                results%tools(i)%cell_length)
        place%tool = i
        place%surface = s
        place%first = size(weights) + 1
        place%xi = mesh%xi
        place%eta = mesh%eta
        results%meshes = [results%meshes, place]
        call add_cells(cells, mesh%connectivity + size(weights), &
                       merge(vtk_bezier_quadrilateral, vtk_lagrange_quadrilateral, &
                             results%is_bezier), i)
        weights = [weights, mesh%weights]
        results%tool_points = transpose(reshape( &
          [transpose(results%tool_points), transpose(mesh%points)], [3, size(weights) - n_blank]))
        results%tool_of_point = [results%tool_of_point, (i, j=1, size(mesh%weights))]
      end do
    end do
    results%n_points = size(weights)
  end subroutine mesh_blank_and_tools

  subroutine create_fields(results)
    type(results_t), intent(inout) :: results
    type(display_field_t), allocatable :: fields(:)
    integer :: i

    fields = display_fields_of(results%n_contact_fields)
    do i = 1, size(fields)
      associate (field => fields(i))
        call create_point_data(results%file, trim(field%name), field%n_components, &
                               results%n_points, unit_of(results%units, trim(field%quantity)), &
                               trim(field%description))
      end associate
    end do
  end subroutine create_fields

  subroutine write_geometry(results)
    type(results_t), intent(inout) :: results
    integer :: i, s, p

    do p = 1, size(results%patches)
      call write_solid(results%file, patch_folder(results, "/nurbs/blank", p), &
                       results%patches(p)%solid, unit_of(results%units, "length"))
      if (size(results%patches) > 1) &
        call write_integer_attribute(results%file, patch_folder(results, "/nurbs/blank", p), &
                                     "patch", [p])
    end do
    call create_group(results%file, "/nurbs/tools")
    do i = 1, size(results%tools)
      do s = 1, size(results%tools(i)%surfaces)
        call write_surface(results%file, surface_folder(results, i, s), &
                           results%tools(i)%surfaces(s), unit_of(results%units, "length"))
      end do
    end do
  end subroutine write_geometry

  subroutine update_geometry(results, frame)
    type(results_t), intent(inout) :: results
    type(frame_t), intent(in) :: frame
    real(wp), allocatable :: points(:, :)
    integer :: i, s, p, n(4), m(3)

    do p = 1, size(results%patches)
      n = shape(frame%patches(p)%points)
      call update_points(results%file, patch_folder(results, "/nurbs/blank", p), &
                         reshape(frame%patches(p)%points, [product(n(:3)), 3]), n(:3), &
                         unit_of(results%units, "length"))
    end do
    do i = 1, size(results%tools)
      do s = 1, size(results%tools(i)%surfaces)
        m = shape(results%tools(i)%surfaces(s)%points)
        points = reshape(results%tools(i)%surfaces(s)%points, [m(1)*m(2), 3])
        points = points + carried(points, spread(i, 1, size(points, 1)), frame%tool_displacement, &
                                  frame%tool_turn)
        call update_points(results%file, surface_folder(results, i, s), points, m(:2), &
                           unit_of(results%units, "length"))
      end do
    end do
  end subroutine update_geometry

  ! Points and fields for VTK.
  subroutine write_display(results, frame)
    type(results_t), intent(inout) :: results
    type(frame_t), intent(in) :: frame
    real(wp), allocatable :: points(:, :), values(:, :)
    type(display_field_t), allocatable :: fields(:)
    integer :: p, n, first, last

    fields = display_fields_of(results%n_contact_fields)
    n = sum(fields%n_components)
    allocate (points(results%n_points, 3), values(results%n_points, n))
    associate (displacement => values(:, :3), velocity => values(:, 4:6), &
               scalars => values(:, 7:), contact => values(:, n - results%n_contact_fields + 1:))
      scalars = ieee_value(1.0_wp, ieee_quiet_nan)
      last = 0
      do p = 1, size(results%patches)
        first = last + 1
        last = last + size(results%patches(p)%grid%weights)
        call patch_vectors(results%patches(p), frame%patches(p), points(first:last, :), &
                           displacement(first:last, :), velocity(first:last, :))
        call patch_scalars(results%patches(p), frame%patches(p), points(first:last, :), &
                           scalars(first:last, :))
        if (results%n_contact_fields == 0) cycle
        contact(first:last, 1) = 0.0_wp
        call add_face_fields(results%patches(p), frame%patches(p), contact(first:last, 1))
      end do
      if (results%n_contact_fields > 0) call fill_tool_fields(results, frame, contact)
      displacement(last + 1:, :) = carried(results%tool_points, results%tool_of_point, &
                                           frame%tool_displacement, frame%tool_turn)
      points(last + 1:, :) = results%tool_points + displacement(last + 1:, :)
      velocity(last + 1:, :) = carried(results%tool_points, results%tool_of_point, &
                                       frame%tool_velocity, frame%tool_turn_rate)
    end associate
    call append_points(results%file, points)
    call append_point_data(results%file, strings(fields%name), fields%n_components, values, &
                           results%n_frames)
  end subroutine write_display

  ! Pressure and wear at the display points of the tools.
  pure subroutine fill_tool_fields(results, frame, values)
    type(results_t), intent(in) :: results
    type(frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)
    integer :: f, m, last

    values(results%n_points - size(results%tool_of_point) + 1:, :) = 0.0_wp
    if (.not. allocated(frame%tool_fields)) return
    do f = 1, size(frame%tool_fields)
      do m = 1, size(results%meshes)
        associate (mesh => results%meshes(m), field => frame%tool_fields(f))
          if (mesh%tool /= field%tool .or. mesh%surface /= field%surface) cycle
          last = mesh%first + size(mesh%xi)*size(mesh%eta) - 1
          call add_tool_fields(field, mesh%xi, mesh%eta, values(mesh%first:last, :))
        end associate
      end do
    end do
  end subroutine fill_tool_fields

  subroutine write_point_geometry(results, patch)
    type(results_t), intent(inout) :: results
    integer, intent(in) :: patch
    character(:), allocatable :: folder

    folder = patch_folder(results, "/points", patch)
    associate (geometry => results%patches(patch)%geometry)
      call write_reals(results%file, folder//"/reference_position", geometry%positions, &
                       [3, geometry%n], unit_of(results%units, "length"), &
                       "places of the integration points at the start, indices (zeta, eta, xi)")
      call write_reals(results%file, folder//"/reference_volume", geometry%volumes, geometry%n, &
                       unit_of(results%units, "volume"), &
                       "volume that each integration point stands for at the start")
    end associate
  end subroutine write_point_geometry

  ! State at the integration points; all but the plastic strain of the last frame alone.
  subroutine write_points(results, patch, fields)
    type(results_t), intent(inout) :: results
    integer, intent(in) :: patch
    type(patch_frame_t), intent(in) :: fields
    character(:), allocatable :: folder

    folder = patch_folder(results, "/points", patch)
    associate (file => results%file, geometry => results%patches(patch)%geometry, &
               n => results%patches(patch)%geometry%n, q => results%patches(patch)%rule_size, &
               e => results%patches(patch)%grid%n_elements)
      call append_reals(file, patch_folder(results, "/frames", patch)//"/eqps", &
                        point_grid(1, q, e, fields%eqps), n, 1)
      call write_reals(file, folder//"/eqps", point_grid(1, q, e, fields%eqps), n, "1", &
                       "equivalent plastic strain, last frame")
      call write_reals(file, folder//"/stress", point_grid(6, q, e, fields%stress), [6, n], &
                       unit_of(results%units, "stress"), &
                       "Cauchy stress 11, 22, 33, 12, 13, 23, last frame")
      if (results%n_state > 0) then
        call write_reals(file, folder//"/statev", &
                         point_grid(results%n_state, q, e, fields%state), &
                         [results%n_state, n], "1", "state variables of the material, last frame")
        if (results%state_names /= "") &
          call write_text_attribute(file, folder//"/statev", "names", results%state_names)
      end if
      call write_reals(file, folder//"/principal_strain", results%patches(patch)%strains, &
                       [2, n], "1", &
                       "major and minor logarithmic strain in the sheet's plane, last frame")
    end associate
  end subroutine write_points

  ! Where a patch has its data: the folder itself if it is the only one.
  pure function patch_folder(results, folder, patch) result(path)
    type(results_t), intent(in) :: results
    character(*), intent(in) :: folder
    integer, intent(in) :: patch
    character(:), allocatable :: path

    path = folder
    if (size(results%patches) > 1) path = folder//"/"//results%patches(patch)%name
  end function patch_folder

  pure function surface_folder(results, i_tool, i_surface) result(folder)
    type(results_t), intent(in) :: results
    integer, intent(in) :: i_tool, i_surface
    character(:), allocatable :: folder

    folder = "/nurbs/tools/"//results%tools(i_tool)%name//"/surface_"//to_text(i_surface)
  end function surface_folder

end module frames
