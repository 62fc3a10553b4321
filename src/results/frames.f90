!> Results of a run in one HDF5 file: frames for VTK and ParaView, and next to them what VTK
!! ignores: history, tools, integration points, exact geometry, provenance, timings.
!!
!! Between frames nothing is written: history rows wait in memory, and a frame is written in one go
!! that ends with a flush. After kill -9 the file therefore opens and contains everything up to the
!! last frame. Only a kill within the writing of a frame can hurt: of 500 writers that did nothing
!! but write frames, killed at random times, all left files that open, one with a dataset that
!! cannot be read. Three choices bring that about. The number of steps is raised in a second flush,
!! when the step itself is in the file. Datasets that grow by less than a chunk are not compressed,
!! for their chunks would move (else 42 of 150 files had a broken dataset). The file keeps the
!! library's oldest format: newer ones mark a file as open, and a killed writer leaves the mark in
!! the file, so that no reader opens it; the single-writer mode needs such a format.
module frames
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use failure, only: error_t
  use text, only: joined, strings, to_text, string_t, counted
  use frame_values, only: display_patch_t, display_tool_t, results_setup_t, frame_t, display_t, &
                          fill_values, blank_points, new_display
  use hdf5_file, only: has_object, check_length, close_file, give_up_file, open_file, create_file, &
                       create_group, h5_uint8, flush_file, hdf5_file_t, h5_int64, &
                       link_object, place_file, h5_double, take_error, &
                       write_reals, write_text_attribute, write_integer_attribute, append_chunk, &
                       append_reals, create_series, write_integers
  use deflated_chunk, only: deflated_chunk_t, new_deflated_chunk
  use unit_system, only: new_unit_system, unit_of, unit_system_t
  use provenance, only: text_or_empty, write_provenance, write_deck
  use run_log, only: timings_t, ns_per_element_step
  use display_grid, only: point_grid
  use display_fields, only: face_field_t, patch_frame_t, tool_frame_t, fields_of, &
                            add_edge_distance, distance_in_whole, edge_distance_name
  use tool_mesh, only: carried
  use vtkhdf, only: append_point_data, append_points, append_step, cells_t, create_grid, &
                    create_point_data, write_part_names, write_rational_weights
  use history, only: history_t, history_sample_t, open_history, write_history
  use ranks, only: ranks_t, is_first, share_error
  use hdf5_library, only: hid_t
  use hdf5_reading, only: open_for_reading, close_reading, names_in, has_name, read_numbers
  use knot_vector, only: knot_vector_t
  use point_geometry, only: point_geometry_t
  use outline, only: region_t
  use trim_curve, only: trim_loop_t
  use timer, only: watch_seconds, n_watches
  implicit none
  private

  public :: results_t, results_setup_t, display_patch_t, display_tool_t, frame_t, patch_frame_t
  public :: face_field_t, tool_frame_t
  public :: open_results, write_frame, close_results, flush_results, unit_in
  public :: layout_problem
  public :: keep_edge_distance
  public :: write_frequencies, write_mode

  !> An open results file. Rows of its history wait in memory until the next frame or flush.
  type :: results_t
    type(hdf5_file_t) :: file
    type(history_t) :: history
    class(ranks_t), allocatable :: ranks       !! the first of them writes; absent: there is but one
    integer :: n_frames = 0                                      !! written so far
    type(unit_system_t), private :: units
    type(display_t), private :: display
    integer, private :: n_state = 0
    character(:), allocatable, private :: state_names            ! set apart by commas, or empty
  end type results_t

  character(*), parameter :: weights_name = "RationalWeights"   ! that Bezier cells have

contains

  !> Go on with a results file, or create one with everything that does not change once the deck is
  !! accepted. Fails if the file cannot be created (see `create_file`) or written. Of several
  !! processes the first one alone has a file; the others count what is in it, and know of failures.
  subroutine open_results(results, setup, error, n_frames, ranks)
    type(results_t), intent(out) :: results
    type(results_setup_t), intent(in) :: setup
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: n_frames   !! in the file; absent: a new file
    class(ranks_t), intent(in), optional :: ranks
    type(history_sample_t) :: nothing

    if (present(ranks)) allocate (results%ranks, source=ranks)
    if (is_first(results%ranks)) then
      call open_own_results(results, setup, error, n_frames)
    else
      if (present(n_frames)) results%n_frames = n_frames
      call open_history(results%history, results%file, results%units, nothing)
    end if
    if (present(ranks)) call share_error(ranks, error)
  end subroutine open_results

  !> The first failure of the file, at all processes.
  subroutine take_failure(results, error)
    type(results_t), intent(inout) :: results
    type(error_t), allocatable, intent(out) :: error

    if (is_first(results%ranks)) call take_error(results%file, error)
    if (allocated(results%ranks)) call share_error(results%ranks, error)
  end subroutine take_failure

  !> The same of the process that writes.
  subroutine open_own_results(results, setup, error, n_frames)
    type(results_t), intent(inout) :: results
    type(results_setup_t), intent(in) :: setup
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: n_frames
    type(cells_t) :: cells
    real(wp), allocatable :: weights(:)
    integer :: i

    results%units = new_unit_system(text_or_empty(setup%provenance%units))
    results%n_state = setup%n_state
    results%state_names = ""
    if (allocated(setup%state_names)) results%state_names = joined(setup%state_names, ", ")
    call new_display(setup, results%display, cells, weights)
    if (present(n_frames)) then
      results%n_frames = n_frames
      call open_file(results%file, setup%path)
      call write_deck(results%file, setup%provenance)
      call fill_edge_distance(results)
    else
      call create_file(results%file, setup%path, is_draft=.true.)
      call write_what_stays(results, setup, cells, weights)
    end if
    call open_history(results%history, results%file, results%units, setup%history)
    ! The number of each tool in the pictures, and the times of what the history contains of it.
    call create_group(results%file, "/tools")
    do i = 1, size(setup%tools)
      associate (folder => "/tools/"//setup%tools(i)%name)
        call link_object(results%file, "/history/time", folder//"/time")
        call write_integer_attribute(results%file, folder, "part", [i])
        call write_integer_attribute(results%file, folder, "side", [setup%tools(i)%side])
      end associate
    end do
    if (allocated(setup%steps)) then
      call write_text_attribute(results%file, "/frames/process_step", "names", &
                                joined(setup%steps, ", "))
      call write_text_attribute(results%file, "/history/process_step", "names", &
                                joined(setup%steps, ", "))
    end if
    call flush_file(results%file)
    if (.not. present(n_frames)) call place_file(results%file)
    call take_error(results%file, error)
    if (.not. allocated(error)) return
    if (present(n_frames)) then
      call close_file(results%file)
    else
      call give_up_file(results%file)
    end if
  end subroutine open_own_results

  !> Everything that does not change, and empty series for what does.
  subroutine write_what_stays(results, setup, cells, weights)
    type(results_t), intent(inout) :: results
    type(results_setup_t), intent(in) :: setup
    type(cells_t), intent(in) :: cells
    real(wp), intent(in) :: weights(:)
    integer :: i, p

    associate (file => results%file)
      call write_provenance(file, setup%provenance)
      call write_reals(file, "/provenance/blank_mass", [setup%blank_mass], [integer ::], &
                       unit_of(results%units, "mass"), &
                       "mass of the blank without what scaling has added")
      if (setup%width_ratio > 1.0_wp) call write_reals(file, "/provenance/width_ratio", &
        [setup%width_ratio], [integer ::], "1", &
        "full width, of which forces, energies and masses are, over that of the blank")
      call create_grid(file, cells, results%display%n_points, unit_of(results%units, "length"), &
                       unit_of(results%units, "time"))
      call write_part_names(file, part_names(setup%tools))
      if (setup%is_bezier) call write_rational_weights(file, weights)
      do i = 1, size(results%display%fields)
        associate (field => results%display%fields(i))
          call create_point_data(file, trim(field%name), field%n_components, &
                                 results%display%n_points, &
                                 unit_of(results%units, trim(field%quantity)), &
                                 trim(field%description))
          if (field%components /= "") call write_text_attribute( &
            file, "/VTKHDF/PointData/"//trim(field%name), "components", trim(field%components))
        end associate
      end do
      call create_series(file, "/frames/is_failed", h5_uint8, [integer ::], 64, .false., "1", &
                         "1 for the state at which a run failed, 0 for all other frames")
      call create_series(file, "/frames/process_step", h5_int64, [integer ::], 64, .false., &
                         "1", "step of the deck, from 1 on")
      do p = 1, size(results%display%patches)
        call create_series(file, patch_folder(results, "/frames", p)//"/eqps", h5_double, &
                           results%display%patches(p)%geometry%n, 1, .true., "1", &
                           "equivalent plastic strain at the integration points, all "// &
                           "frames; NaN in elements of which an outline leaves nothing")
      end do
      call write_geometry(results)
    end associate
  end subroutine write_what_stays

  !> The distance from the edge in frames that were written before the deck had a trim.
  subroutine fill_edge_distance(results)
    type(results_t), intent(inout) :: results
    type(deflated_chunk_t) :: chunk
    real(wp), allocatable :: values(:, :)
    integer :: i, p

    associate (display => results%display)
      if (has_object(results%file, "/VTKHDF/PointData/"//edge_distance_name)) return
      if (.not. any(display%fields%name == edge_distance_name)) return
      associate (field => display%fields(findloc(display%fields%name, edge_distance_name, 1)))
        call create_point_data(results%file, trim(field%name), field%n_components, &
                               display%n_points, unit_of(results%units, trim(field%quantity)), &
                               trim(field%description))
      end associate
      allocate (values(display%n_points, 1))
      do p = size(display%patches), 1, -1
        values(:display%last(p), 1) = distance_in_whole(display%patches(p))
      end do
      values(display%last(size(display%last)) + 1:, 1) = display%tool_points%edge_distance
      chunk = new_deflated_chunk(values)
      do i = 1, results%n_frames
        call append_point_data(results%file, edge_distance_name, 1, chunk, display%n_points)
      end do
    end associate
  end subroutine fill_edge_distance

  !> Names of the parts of the grid: the blank with all its patches, and the tools.
  pure function part_names(tools) result(names)
    type(display_tool_t), intent(in) :: tools(:)
    type(string_t) :: names(0:size(tools))
    integer :: i

    names(0)%value = "blank"
    do i = 1, size(tools)
      names(i)%value = tools(i)%name
    end do
  end function part_names

  !> Write the history so far, or its first rows since the last frame, and hand all to the operating
  !! system: what a checkpoint needs.
  subroutine flush_results(results, error, n_samples)
    type(results_t), intent(inout) :: results
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: n_samples

    if (is_first(results%ranks)) call check_length(results%file)
    call write_history(results%history, results%file, n_samples)
    if (is_first(results%ranks)) call flush_file(results%file)
    call take_failure(results, error)
  end subroutine flush_results

  !> Unit of a quantity, such as `length`, in this file; empty where the deck has no label of it.
  pure function unit_in(results, quantity) result(unit)
    type(results_t), intent(in) :: results
    character(*), intent(in) :: quantity
    character(:), allocatable :: unit

    unit = unit_of(results%units, quantity)
    if (unit == quantity) unit = ""
  end function unit_in

  !> Write a frame and the history up to it, or its first rows, then flush the file.
  subroutine write_frame(results, frame, error, n_samples)
    type(results_t), intent(inout) :: results
    type(frame_t), intent(in) :: frame
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: n_samples   !! absent: all that wait

    if (is_first(results%ranks)) then
      call write_own_frame(results, frame, n_samples)
    else
      call write_history(results%history, results%file, n_samples)
    end if
    results%n_frames = results%n_frames + 1
    call take_failure(results, error)
  end subroutine write_frame

  !> The same of the process that writes.
  subroutine write_own_frame(results, frame, n_samples)
    type(results_t), intent(inout) :: results
    type(frame_t), intent(in) :: frame
    integer, intent(in), optional :: n_samples
    type(deflated_chunk_t), allocatable :: chunks(:)
    real(wp), allocatable :: points(:, :), values(:, :)
    integer :: i, n

    call check_length(results%file)
    allocate (points(results%display%n_points, 3))
    allocate (values(results%display%n_points, sum(results%display%fields%n_components)))
    allocate (chunks(size(results%display%fields) + size(results%display%patches)))
    ! One thread writes what exists already while the others work on the rest.
    !$omp parallel default(shared)
    !$omp master
    call update_geometry(results, frame)
    call write_history(results%history, results%file, n_samples)
    call append_reals(results%file, "/frames/is_failed", [merge(1.0_wp, 0.0_wp, &
                      frame%is_failed)], [integer ::], 1)
    call append_reals(results%file, "/frames/process_step", [real(frame%process_step, wp)], &
                      [integer ::], 1)
    !$omp end master
    call fill_values(results%display, frame, points, values)
    !$omp master
    call append_points(results%file, points)
    call write_points(results, frame)
    !$omp end master
    call pack_values(results%display, values, chunks)
    !$omp end parallel
    n = size(results%display%fields)
    do i = 1, n
      associate (field => results%display%fields(i))
        call append_point_data(results%file, trim(field%name), field%n_components, chunks(i), &
                               results%display%n_points)
      end associate
    end do
    do i = 1, size(results%display%patches)
      call append_chunk(results%file, patch_folder(results, "/frames", i)//"/eqps", &
                        chunks(n + i), results%display%patches(i)%geometry%n, 1)
    end do
    call flush_file(results%file)
    call append_step(results%file, frame%time, results%display%n_points, results%n_frames)
    call flush_file(results%file)
  end subroutine write_own_frame

  ! All fields, and after them the plastic strain at the integration points of each patch. The
  ! threads of a region divide them.
  subroutine pack_values(display, values, chunks)
    type(display_t), intent(in) :: display
    real(wp), intent(in) :: values(:, :)
    type(deflated_chunk_t), intent(inout) :: chunks(:)
    integer :: i, n, last

    n = size(display%fields)
    !$omp do schedule(dynamic)
    do i = 1, size(chunks)
      if (i <= n) then
        last = sum(display%fields(:i)%n_components)
        chunks(i) = new_deflated_chunk(values(:, last - display%fields(i)%n_components + 1:last))
      else
        associate (eqps => display%patches(i - n)%eqps)
          chunks(i) = new_deflated_chunk(reshape(eqps, [size(eqps), 1]))
        end associate
      end if
    end do
    !$omp end do
  end subroutine pack_values

  !> Write the frequencies of a step of the deck.
  subroutine write_frequencies(results, step, frequencies)
    type(results_t), intent(inout) :: results
    integer, intent(in) :: step
    real(wp), intent(in) :: frequencies(:)

    if (.not. is_first(results%ranks)) return
    call check_length(results%file)
    call write_reals(results%file, mode_folder(step)//"/frequency", frequencies, &
                     [size(frequencies)], "1/"//unit_of(results%units, "time"), &
                     "frequencies of the modes in rising order")
    call flush_file(results%file)
  end subroutine write_frequencies

  !> Write the mode of a patch.
  subroutine write_mode(results, step, number, patch, shape_of, error)
    type(results_t), intent(inout) :: results
    integer, intent(in) :: step, number, patch
    real(wp), intent(in) :: shape_of(:, :, :, :)   !! motion of control points, (n1, n2, n3, 3)
    type(error_t), allocatable, intent(out) :: error
    integer :: n(4)

    n = shape(shape_of)
    if (is_first(results%ranks)) then
      call check_length(results%file)
      call write_reals(results%file, patch_folder(results, mode_folder(step), patch)//"/mode_"// &
                       to_text(number), transpose(reshape(shape_of, [product(n(:3)), 3])), &
                       [3, n(:3)], "1", "motion of the control points of /nurbs/blank/points "// &
                       "in the mode, the largest component of all patches 1")
      call flush_file(results%file)
    end if
    call take_failure(results, error)
  end subroutine write_mode

  pure function mode_folder(step) result(folder)
    integer, intent(in) :: step
    character(:), allocatable :: folder

    folder = "/modes/step_"//to_text(step)
  end function mode_folder

  !> Write what is left of the history, how the run ended and what it cost; close the file.
  subroutine close_results(results, status, timings, error, relaxation)
    type(results_t), intent(inout) :: results
    character(*), intent(in) :: status          !! completed, failed or interrupted
    type(timings_t), intent(in) :: timings
    type(error_t), allocatable, intent(out) :: error
    character(*), intent(in), optional :: relaxation   !! how it went; may be empty

    if (is_first(results%ranks)) call close_own_results(results, status, timings, relaxation)
    call take_failure(results, error)
  end subroutine close_results

  !> The same of the process that writes.
  subroutine close_own_results(results, status, timings, relaxation)
    type(results_t), intent(inout) :: results
    character(*), intent(in) :: status
    type(timings_t), intent(in) :: timings
    character(*), intent(in), optional :: relaxation

    call check_length(results%file)
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
  end subroutine close_own_results

  !> Write /timings: one group for each effect, and the cost of the whole run.
  subroutine write_timings(file, timings)
    type(hdf5_file_t), intent(inout) :: file
    type(timings_t), intent(in) :: timings
    character(:), allocatable :: folder
    real(wp) :: cpu_seconds
    integer :: i

    call create_group(file, "/timings/effects")
    do i = 1, n_watches(timings%timer)
      associate (watch => timings%timer%watches(i))
        folder = "/timings/effects/"//watch%name
        call write_reals(file, folder//"/seconds", [watch_seconds(timings%timer, i)], &
                         [integer ::], "s", "wall-clock time of this effect")
        call write_integers(file, folder//"/calls", [watch%n_calls], [integer ::], &
                            "number of calls", h5_int64)
      end associate
    end do
    call write_reals(file, "/timings/wall_seconds", [timings%wall_seconds], [integer ::], "s", &
                     "wall-clock time of all steps")
    call cpu_time(cpu_seconds)
    call write_reals(file, "/timings/cpu_seconds", [cpu_seconds], [integer ::], "s", &
                     "processor time since the start or restart, all threads")
    call write_integers(file, "/timings/steps", [timings%n_steps], [integer ::], &
                        "number of steps", h5_int64)
    call write_integers(file, "/timings/elements", [int(timings%n_elements, int64)], &
                        [integer ::], "number of elements", h5_int64)
    call write_reals(file, "/timings/ns_per_element_step", [ns_per_element_step(timings)], &
                     [integer ::], "ns", "wall-clock time per element and step")
  end subroutine write_timings

  subroutine write_geometry(results)
    type(results_t), intent(inout) :: results
    character(:), allocatable :: unit
    integer :: i, s, p

    unit = unit_of(results%units, "length")
    associate (display => results%display)
      do p = 1, size(display%patches)
        associate (solid => display%patches(p)%solid)
          call write_net(results%file, patch_folder(results, "/nurbs/blank", p), solid%axes, &
                         solid%weights, solid%points, unit)
        end associate
        if (size(display%patches) > 1) &
          call write_integer_attribute(results%file, patch_folder(results, "/nurbs/blank", p), &
                                       "patch", [p])
      end do
      call create_group(results%file, "/nurbs/tools")
      do i = 1, size(display%tools)
        do s = 1, size(display%tools(i)%surfaces)
          associate (surface => display%tools(i)%surfaces(s))
            call write_net(results%file, surface_folder(results, i, s), surface%axes, &
                           surface%weights, surface%points, unit)
            if (allocated(surface%loops)) call write_loops(results%file, &
              surface_folder(results, i, s)//"/loops", surface%loops)
          end associate
        end do
      end do
    end associate
  end subroutine write_geometry

  !> The loops of a trimmed surface: rational Bezier pieces in its parameters.
  subroutine write_loops(file, folder, loops)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: folder
    type(trim_loop_t), intent(in) :: loops(:)
    integer :: l, i
    real(wp), allocatable :: points(:)

    allocate (points(0))
    do l = 1, size(loops)
      do i = 1, size(loops(l)%curves)
        associate (curve => loops(l)%curves(i))
          points = [points, [curve%c(:, :curve%degree)]]
        end associate
      end do
    end do
    call write_integers(file, folder//"/sizes", [(size(loops(l)%curves, kind=int64), &
                        l=1, size(loops))], [size(loops)], "pieces of each loop", h5_int64)
    call write_integers(file, folder//"/degrees", [((int(loops(l)%curves(i)%degree, int64), &
                        i=1, size(loops(l)%curves)), l=1, size(loops))], &
                        [sum([(size(loops(l)%curves), l=1, size(loops))])], &
                        "degrees of the pieces", h5_int64)
    call write_reals(file, folder//"/points", points, [3, size(points)/3], "1", "Bezier points "// &
                     "of the pieces, one after the other: both parameters times weight, weight")
  end subroutine write_loops

  subroutine update_geometry(results, frame)
    type(results_t), intent(inout) :: results
    type(frame_t), intent(in) :: frame
    real(wp), allocatable :: points(:, :)
    character(:), allocatable :: unit
    integer :: i, s, p

    unit = unit_of(results%units, "length")
    do p = 1, size(results%display%patches)
      call update_points(results%file, patch_folder(results, "/nurbs/blank", p), &
                         shape(results%display%patches(p)%solid%weights), &
                         frame%patches(p)%points, unit)
      if (allocated(frame%patches(p)%regions)) call write_outlines(results%file, &
        patch_folder(results, "/nurbs/blank", p)//"/outlines", frame%patches(p)%regions)
    end do
    do i = 1, size(results%display%tools)
      do s = 1, size(results%display%tools(i)%surfaces)
        associate (surface => results%display%tools(i)%surfaces(s))
          points = reshape(surface%points, [size(surface%weights), 3])
          points = points + carried(points, spread(i, 1, size(points, 1)), &
                                    frame%tool_displacement, frame%tool_turn)
          call update_points(results%file, surface_folder(results, i, s), shape(surface%weights), &
                             points, unit)
        end associate
      end do
    end do
  end subroutine update_geometry

  !> The polygons of outlines and trims that are not in the file yet: once there they stay.
  subroutine write_outlines(file, folder, regions)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: folder
    type(region_t), intent(in) :: regions(:)
    character(:), allocatable :: own
    integer, allocatable :: sizes(:)
    real(wp), allocatable :: corners(:, :)
    integer :: r, p, n

    do r = 1, size(regions)
      own = folder//"/region_"//to_text(r)
      if (has_object(file, own)) cycle
      associate (polygons => regions(r)%polygons)
        sizes = [(size(polygons(p)%corners, 2), p=1, size(polygons))]
        allocate (corners(2, sum(sizes)))
        n = 0
        do p = 1, size(polygons)
          corners(:, n + 1:n + sizes(p)) = polygons(p)%corners
          n = n + sizes(p)
        end do
      end associate
      call write_integers(file, own//"/sizes", int(sizes, int64), [size(sizes)], &
                          "corners of each closed polygon", h5_int64)
      call write_reals(file, own//"/corners", corners, [2, n], "1", "corners of the polygons, "// &
                       "one after the other, by the parameters of axes 1 and 2")
      call write_integers(file, own//"/is_outside", &
                          [merge(1_int64, 0_int64, regions(r)%is_outside)], [integer ::], &
                          "1: what lies outside of the polygons is left, 0: what lies within "// &
                          "an odd number of them", h5_int64)
      deallocate (corners)
    end do
  end subroutine write_outlines

  ! State at the integration points, of the last frame alone.
  subroutine write_points(results, frame)
    type(results_t), intent(inout) :: results
    type(frame_t), intent(in) :: frame
    character(*), parameter :: nan = "; NaN in elements of which an outline leaves nothing"
    character(:), allocatable :: folder
    real(wp), allocatable :: state(:)
    integer :: p

    do p = 1, size(results%display%patches)
      folder = patch_folder(results, "/points", p)
      associate (file => results%file, view => results%display%patches(p))
        if (.not. view%has_points) call write_places(file, folder, results%units, view%geometry)
        view%has_points = .true.
        call write_reals(file, folder//"/eqps", view%eqps, view%geometry%n, "1", &
                         "equivalent plastic strain, last frame"//nan)
        call write_reals(file, folder//"/stress", view%stress, [6, view%geometry%n], &
                         unit_of(results%units, "stress"), &
                         "Cauchy stress 11, 22, 33, 12, 13, 23, last frame"//nan)
        if (results%n_state > 0) then
          state = [point_grid(results%n_state, view%rule_size, view%grid%n_elements, &
                              frame%patches(p)%state)]
          call blank_points(view%geometry%n, view%rule_size, frame%patches(p), &
                            results%n_state, state)
          call write_reals(file, folder//"/statev", state, [results%n_state, view%geometry%n], &
                           "1", "state variables of the material, last frame"//nan)
          if (results%state_names /= "") &
            call write_text_attribute(file, folder//"/statev", "names", results%state_names)
        end if
        call write_reals(file, folder//"/principal_strain", view%strains, &
                         [2, view%geometry%n], "1", &
                         "major and minor logarithmic strain in the sheet's plane, last "// &
                         "frame"//nan)
      end associate
    end do
  end subroutine write_points

  ! Where the points of a patch are at the start: those of the last frame.
  subroutine write_places(file, folder, units, geometry)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: folder
    type(unit_system_t), intent(in) :: units
    type(point_geometry_t), intent(in) :: geometry

    call write_reals(file, folder//"/reference_position", geometry%positions, [3, geometry%n], &
                     unit_of(units, "length"), "positions of the integration points at the "// &
                     "start, indices (zeta, eta, xi)")
    call write_reals(file, folder//"/reference_volume", geometry%volumes, geometry%n, &
                     unit_of(units, "volume"), "volume of each integration point at the start")
  end subroutine write_places

  ! Where a patch has its data: the folder itself if it is the only one.
  pure function patch_folder(results, folder, patch) result(path)
    type(results_t), intent(in) :: results
    character(*), intent(in) :: folder
    integer, intent(in) :: patch
    character(:), allocatable :: path

    path = folder
    if (size(results%display%patches) > 1) path = folder//"/"//results%display%patches(patch)%name
  end function patch_folder

  pure function surface_folder(results, i_tool, i_surface) result(folder)
    type(results_t), intent(in) :: results
    integer, intent(in) :: i_tool, i_surface
    character(:), allocatable :: folder

    folder = "/nurbs/tools/"//results%display%tools(i_tool)%name//"/surface_"//to_text(i_surface)
  end function surface_folder

  !> What of *OUTPUT is not what the result was begun with, option by option with both values; empty
  !! if the frames of this set-up fit after those of the file.
  function layout_problem(path, setup) result(reason)
    character(*), intent(in) :: path             !! of a result that is whole
    type(results_setup_t), intent(in) :: setup
    character(:), allocatable :: reason
    type(string_t), allocatable :: names(:)
    real(wp), allocatable :: n_points(:)
    type(display_t) :: display
    type(cells_t) :: cells
    real(wp), allocatable :: weights(:)
    integer(hid_t) :: file
    integer :: i, n

    reason = "it cannot be opened"
    file = open_for_reading(path)
    if (file < 0) return
    names = names_in(file, "/VTKHDF/PointData")
    call read_numbers(file, "/VTKHDF/NumberOfPoints", n_points)
    reason = torque_problem(file, setup)
    call close_reading(file)
    if (reason /= "") return
    call new_display(setup, display, cells, weights)
    call compare("FIELDS", fields_word(names), fields_word(strings(display%fields%name)), reason)
    call compare("CELLS", cells_word(has_name(names, weights_name), has_name(names, "normal")), &
                 cells_word(setup%is_bezier, setup%is_surface), reason)
    if (reason /= "") return
    ! What follows from no option: a result of another version of the program.
    n = merge(1, 0, display%is_bezier)
    do i = 1, size(display%fields)
      if (display%fields(i)%name == edge_distance_name) cycle
      n = n + 1
      if (.not. has_name(names, trim(display%fields(i)%name))) &
        reason = "it has no field "//trim(display%fields(i)%name)
    end do
    if (has_name(names, edge_distance_name)) n = n + 1
    if (size(names) /= n .and. reason == "") &
      reason = "it has "//counted(size(names), "field")//", not those of this program"
    if (reason /= "") return
    n = 0
    if (allocated(n_points)) n = nint(sum(n_points))
    if (n /= display%n_points) reason = "its frames have "//counted(n, "point")// &
                                       ", those of the run now "//to_text(display%n_points)
  end function layout_problem

  !> Which tool has a torque in the history of a result or in that of the deck, and not in both.
  function torque_problem(file, setup) result(reason)
    integer(hid_t), intent(in) :: file
    type(results_setup_t), intent(in) :: setup
    character(:), allocatable :: reason
    logical :: had, has
    integer :: i, c

    reason = ""
    do i = 1, size(setup%tools)
      associate (folder => "/tools/"//setup%tools(i)%name)
        had = has_name(names_in(file, folder), "torque")
        has = .false.
        do c = 1, size(setup%history%columns)
          has = has .or. setup%history%columns(c)%path == folder//"/torque"
        end do
      end associate
      if (had .eqv. has) cycle
      reason = "its history has a torque of tool '"//setup%tools(i)%name//"', which "// &
               "rotates in no step of the deck now"
      if (has) reason = "tool '"//setup%tools(i)%name//"' rotates in a step of the deck now, "// &
                        "and its history has no torque of it"
    end do
  end function torque_problem

  pure subroutine compare(option, was, now, reason)
    character(*), intent(in) :: option, was, now
    character(:), allocatable, intent(inout) :: reason

    if (was == now) return
    if (reason /= "") reason = reason//", and "
    reason = reason//"it was begun with *OUTPUT, "//option//"="//trim(was)// &
             ", and the deck now has "//option//"="//trim(now)
  end subroutine compare

  pure function cells_word(is_bezier, is_surface) result(word)
    logical, intent(in) :: is_bezier, is_surface
    character(:), allocatable :: word

    word = "LAGRANGE"
    if (is_bezier) word = "BEZIER"
    if (is_surface) word = "SURFACE"
  end function cells_word

  !> A result that has the distance from the edge keeps it where the trims of a deck have gone.
  subroutine keep_edge_distance(path, setup)
    character(*), intent(in) :: path             !! of a result that is whole
    type(results_setup_t), intent(inout) :: setup
    integer(hid_t) :: file
    logical :: is_there

    file = open_for_reading(path)
    if (file < 0) return
    is_there = has_name(names_in(file, "/VTKHDF/PointData"), edge_distance_name)
    call close_reading(file)
    associate (fields => fields_of(setup%fields))
      is_there = is_there .and. .not. any(fields%name == edge_distance_name)
    end associate
    if (is_there) call add_edge_distance(setup%fields)
  end subroutine keep_edge_distance

  !> The value of FIELDS that gives these fields.
  pure function fields_word(names) result(word)
    type(string_t), intent(in) :: names(:)
    character(:), allocatable :: word

    word = ""
    if (has_name(names, "wear")) then
      word = ", WEAR"
    else if (has_name(names, "contact_pressure")) then
      word = ", CONTACT"
    end if
    if (has_name(names, "stress") .or. has_name(names, "stress_top")) word = word//", STRESS"
    if (has_name(names, "N11")) word = word//", RESULTANTS"
    if (word == "") word = ", NONE"
    word = word(3:)
    if (index(word, ",") > 0) word = '"'//word//'"'
  end function fields_word

  !> Write a solid or a surface: degrees, knots, weights and control points.
  subroutine write_net(file, folder, axes, weights, points, length_unit)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: folder, length_unit
    type(knot_vector_t), intent(in) :: axes(:)
    real(wp), intent(in) :: weights(product(axes%n_basis)), points(product(axes%n_basis), 3)
    integer :: d

    call write_integers(file, folder//"/degrees", int(axes%degree, int64), [size(axes)], &
                        "polynomial degrees", h5_int64)
    do d = 1, size(axes)
      call write_reals(file, folder//"/knots_"//to_text(d), axes(d)%knots, &
                       [size(axes(d)%knots)], "1", "knot vector of axis "//to_text(d))
    end do
    call write_reals(file, folder//"/weights", weights, axes%n_basis, "1", &
                     "weights of the control points, indices ("// &
                     trim(merge("zeta, eta, xi)", "eta, xi)      ", size(axes) == 3)))
    call update_points(file, folder, axes%n_basis, points, length_unit)
  end subroutine write_net

  !> Write control points, or overwrite them with those of a later time.
  subroutine update_points(file, folder, grid, points, length_unit)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: folder, length_unit
    integer, intent(in) :: grid(:)         !! control points per direction
    real(wp), intent(in) :: points(product(grid), 3)

    call write_reals(file, folder//"/points", transpose(points), [3, grid], length_unit, &
                     "control points of the last frame, not multiplied by their weights, " &
                     //"last axis first, components last")
  end subroutine update_points

end module frames
