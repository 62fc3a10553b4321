!> *TOOL: rigid surfaces listed, extruded, generated, from CAD or offset from others; and
!! *TOOL PLACEMENT.
module tool_keywords
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error
  use text, only: string_t, upper_case, squeezed, to_text, rounded_text, place_text
  use name_table, only: place_of
  use text_file, only: path_beside
  use knot_vector, only: knot_vector_t
  use nurbs_surface, only: nurbs_surface_t, new_nurbs_surface, evaluate_surface
  use primitives, only: plane_surface, cylinder_surface, sphere_surface, extruded_surface
  use iges_selection, only: iges_request_t
  use scene, only: scene_t, tool_spec_t
  use deck_records, only: parsed_deck_t, find_records, option_text, option_real, field_real, &
                          is_option_given, record_t, field_integer, deck_context_t, patch_parts_t, &
                          resolve_option, deck_names_t, resolve, field_vector
  use cad_source, only: add_source, read_cad_file, find_unit, entries_of
  use patch_keywords, only: check_parts, read_axes, read_points, refine
  use surface_seams, only: surface_seams_t, find_surface_seams, orient_surfaces
  use surface_trim, only: trim_t, new_trim, is_inside, place_in_spans
  use surface_offset, only: samples_along, offset_surface, offset_report_t
  use tool, only: tool_t, new_tool
  use tool_search, only: search_all_faces
  use closest_point, only: hit_t
  implicit none
  private

  public :: read_tools, read_placements, measure_offset

  real(wp), parameter :: usual = 1.0e-4_wp       !! tolerance, part of the distance
  real(wp), parameter :: seam_width = 0.01_wp    !! widest seam, part of the distance

contains

  !> Note direction and clearance of tools that are to be placed.
  subroutine read_placements(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, tool
    real(wp) :: direction(3)

    found = find_records(deck, "TOOL PLACEMENT")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        call resolve_option(record, "TOOL", context%names%tools, "*TOOL", tool, errors)
        if (tool == 0 .or. .not. record%is_valid) cycle
        direction = field_vector(record, 1, 1)
        if (.not. norm2(direction) > 0.0_wp) then
          call add_error(errors, record%origin, "a direction of no length", &
                         "one that leads from the tool to the sheet")
        else if (any(abs(scene%tools(tool)%placing) > 0.0_wp)) then
          call add_error(errors, record%origin, "a second placement of the tool "// &
                         scene%tools(tool)%name, "one *TOOL PLACEMENT a tool")
        else
          scene%tools(tool)%placing = direction
          scene%tools(tool)%clearance = option_real(record, "CLEARANCE")
        end if
      end associate
    end do
  end subroutine read_placements

  !> Fill the list of tools, one for each *TOOL that is no component of another in the order of
  !! the deck, then add the components, then make the offsets. A tool whose surface cannot be made
  !! has none.
  subroutine read_tools(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:), parts(:)
    logical, allocatable :: is_offset(:)
    integer :: i, tool

    found = find_records(deck, "TOOL")
    parts = pack(found, [(is_option_given(deck%records(found(i)), "COMPONENT OF"), &
                          i=1, size(found))])
    found = pack(found, [(all(parts /= found(i)), i=1, size(found))])
    is_offset = [(option_text(deck%records(found(i)), "TYPE") == "OFFSET", i=1, size(found))]
    allocate (scene%tools(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), tool => scene%tools(i))
        tool%origin = record%origin
        tool%name = option_text(record, "NAME")
        if (option_text(record, "SIDE") == "POSITIVE") tool%side = 1
        if (option_text(record, "SIDE") == "NEGATIVE") tool%side = -1
        allocate (tool%surfaces(0), tool%notes(0))
      end associate
      if (.not. is_offset(i)) &
        call read_surfaces(deck, deck%records(found(i)), context, is_offset, i, scene, errors)
    end do
    do i = 1, size(parts)
      associate (record => deck%records(parts(i)))
        call resolve_option(record, "COMPONENT OF", context%names%tools, "*TOOL", tool, errors)
        if (tool == 0) cycle
        if (any(option_text(record, "TYPE") == [character(6) :: "IGES", "OFFSET"])) then
          call add_error(errors, record%origin, "a component of TYPE="// &
                         option_text(record, "TYPE"), "components whose surface is given "// &
                         "in the deck, or a *TOOL of its own")
          cycle
        end if
        call read_surfaces(deck, record, context, is_offset, tool, scene, errors)
      end associate
    end do
    do i = 1, size(found)
      if (is_offset(i)) &
        call read_surfaces(deck, deck%records(found(i)), context, is_offset, i, scene, errors)
    end do
  end subroutine read_tools

  !> Add the surfaces of one record to those of a tool, refined as the deck asks.
  subroutine read_surfaces(deck, record, context, is_offset, tool, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(deck_context_t), intent(inout) :: context
    logical, intent(in) :: is_offset(:)           !! tools of the scene, read or not
    integer, intent(in) :: tool                   !! place in the scene
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(nurbs_surface_t) :: surface
    type(string_t) :: file
    character(:), allocatable :: type
    integer :: patch, s, n_before
    logical :: is_complete

    patch = place_of(context%names%patches, squeezed(upper_case(option_text(record, "NAME"))))
    if (patch == 0) return
    type = option_text(record, "TYPE")
    call check_type_options(record, type, errors)
    n_before = size(scene%tools(tool)%surfaces)
    select case (type)
    case ("IGES")
      call read_cad_tool(record, scene%units, context%is_check, scene%tools(tool), file%value, &
                         errors)
      if (file%value /= "") call add_source(record, scene, file)
      call check_parts(deck, context%parts(patch), 0, "a tool of TYPE=IGES", errors)
    case ("OFFSET")
      call check_parts(deck, context%parts(patch), 0, "a tool of TYPE=OFFSET", errors)
      call read_offset_tool(record, context%names, is_offset, scene, tool, errors)
    case default
      call read_surface(deck, record, context%parts(patch), surface, is_complete, errors)
      if (.not. is_complete) return
      scene%tools(tool)%surfaces = [scene%tools(tool)%surfaces, surface]
    end select
    do s = n_before + 1, size(scene%tools(tool)%surfaces)
      call refine(deck, context%parts(patch), errors, surface=scene%tools(tool)%surfaces(s))
    end do
  end subroutine read_surfaces

  !> Options that one type of tool alone has.
  subroutine check_type_options(record, type, errors)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: type
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: options(7) = [character(14) :: "INPUT", "LENGTH", "ENTITY", &
                                             "LABEL", "EXCLUDE ENTITY", "EXCLUDE LABEL", "OF"]
    character(6) :: owner
    integer :: i

    do i = 1, size(options)
      owner = merge("OFFSET", "IGES  ", options(i) == "OF")
      if (owner == type .or. .not. is_option_given(record, trim(options(i)))) cycle
      call add_error(errors, record%origin, "the option "//trim(options(i))//" for a tool of "// &
                     "TYPE="//type, "this option with TYPE="//trim(owner)//" only")
    end do
  end subroutine check_type_options

  subroutine read_surface(deck, record, parts, surface, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(patch_parts_t), intent(in) :: parts
    type(nurbs_surface_t), intent(out) :: surface
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: type
    type(error_t), allocatable :: error
    real(wp) :: x(3), axis(3)
    integer :: n_axes

    type = option_text(record, "TYPE")
    n_axes = 0
    if (type == "SURFACE") n_axes = 2
    if (type == "EXTRUDED") n_axes = 1
    call check_parts(deck, parts, n_axes, "a tool of TYPE="//type, errors)
    is_complete = record%is_valid
    if (n_axes > 0) then
      call read_listed(deck, record, parts, n_axes, surface, is_complete, error, errors)
    else if (is_complete) then
      x = field_vector(record, 1, 1)
      select case (type)
      case ("PLANE")
        call plane_surface(surface, x, field_vector(record, 2, 1), field_vector(record, 3, 1), &
                           error)
      case ("CYLINDER")
        axis = field_vector(record, 1, 4)
        call cylinder_surface(surface, x, axis, field_real(record, 2, 1), norm2(axis), &
                              field_real(record, 2, 2), field_real(record, 2, 3), error)
      case ("SPHERE")
        call sphere_surface(surface, x, field_real(record, 2, 1), error)
      end select
    end if
    is_complete = is_complete .and. .not. allocated(error)
    if (allocated(error)) then
      call add_error(errors, record%origin, "a surface that cannot be made ("//error%message//")", &
                     "a proper surface")
    end if
  end subroutine read_surface

  !> A surface, or a curve to be extruded, from knots and control points.
  subroutine read_listed(deck, record, parts, n_axes, surface, is_complete, error, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(patch_parts_t), intent(in) :: parts
    integer, intent(in) :: n_axes
    type(nurbs_surface_t), intent(out) :: surface
    logical, intent(inout) :: is_complete
    type(error_t), allocatable, intent(out) :: error
    type(error_list_t), intent(inout) :: errors
    type(knot_vector_t) :: axes(n_axes)
    real(wp), allocatable :: points(:, :), weights(:)
    real(wp) :: shift(3)
    integer :: n(2)
    logical :: has_axes, has_points

    call read_axes(deck, parts, record, axes, has_axes, errors)
    if (has_axes) call read_points(deck, parts, record, axes, points, weights, has_points, errors)
    is_complete = is_complete .and. has_axes
    if (is_complete) is_complete = has_points
    if (.not. is_complete) return
    if (n_axes == 2) then
      n = axes%n_basis
      call new_nurbs_surface(surface, axes(1), axes(2), reshape(points, [n(1), n(2), 3]), &
                             reshape(weights, n), error)
    else
      shift = 0.0_wp
      if (record%n_lines > 1) shift = field_vector(record, 2, 1)
      points = points + spread(shift, 1, size(points, 1))
      call extruded_surface(surface, axes(1), points, weights, field_vector(record, 1, 1), &
                            field_integer(record, 1, 4), field_integer(record, 1, 5), error)
    end if
  end subroutine read_listed

  !> Read the surfaces of a tool and what the log says of them; without surfaces on an error.
  subroutine read_cad_tool(record, units, is_check, tool, path, errors)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: units                     !! what *UNITS says, empty: nothing
    logical, intent(in) :: is_check
    type(tool_spec_t), intent(inout) :: tool
    character(:), allocatable, intent(out) :: path        !! of the file, empty if none is named
    type(error_list_t), intent(inout) :: errors
    type(iges_request_t) :: request

    path = ""
    if (.not. is_option_given(record, "INPUT")) then
      call add_error(errors, record%origin, "no option INPUT", "INPUT=file.igs for TYPE=IGES")
      return
    end if
    if (.not. record%is_valid) return
    request%origin = record%origin
    request%path = path_beside(record%origin%file, option_text(record, "INPUT"))
    call find_unit(record, units, request%unit, errors)
    request%numbers = entries_of(option_text(record, "ENTITY"))
    request%labels = entries_of(option_text(record, "LABEL"))
    request%numbers_left_out = entries_of(option_text(record, "EXCLUDE ENTITY"))
    request%labels_left_out = entries_of(option_text(record, "EXCLUDE LABEL"))
    request%with_extents = is_check
    call read_cad_file(request, tool%surfaces, tool%notes, errors)
    if (size(tool%notes) == 0) return
    path = request%path
  end subroutine read_cad_tool

  !> Surfaces, side and notes of a tool; all others that are no offsets have been read. Without
  !! surfaces on an error.
  subroutine read_offset_tool(record, names, is_offset, scene, tool, errors)
    type(record_t), intent(in) :: record
    type(deck_names_t), intent(inout) :: names
    logical, intent(in) :: is_offset(:)       !! tools of the scene, read or not
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: tool               !! place in the scene
    type(error_list_t), intent(inout) :: errors
    integer :: base, i, c
    real(wp) :: distance, tolerance

    if (is_option_given(record, "SIDE")) &
      call add_error(errors, record%origin, "the option SIDE for a tool of TYPE=OFFSET", &
                     "none: it follows from the tool OF and the sign of the distance")
    if (.not. is_option_given(record, "OF")) then
      call add_error(errors, record%origin, "no option OF", "OF=name of a tool for TYPE=OFFSET")
      return
    end if
    call resolve(names%tools, option_text(record, "OF"), "*TOOL", record%origin, base, errors)
    if (base == 0 .or. .not. record%is_valid) return
    distance = field_real(record, 1, 1)
    if (is_offset(base)) then
      call add_error(errors, record%origin, "the offset of "//scene%tools(base)%name// &
                     ", which is an offset itself", &
                     "a tool that is none, and the distance from it")
    else if (.not. abs(distance) > 0.0_wp) then
      call add_error(errors, record%origin, "an offset of no distance", "another number than 0")
    else if (size(scene%tools(base)%surfaces) > 0) then
      tolerance = field_real(record, 1, 2)
      if (.not. tolerance > 0.0_wp) tolerance = usual*abs(distance)
      ! The offset is made before the blank is known to lie on one side.
      if (scene%tools(base)%side == 0) scene%tools(base)%side = 1
      call make_offset(record, scene%tools(base), distance, tolerance, scene%tools(tool), errors)
      scene%tools(tool)%offset_of = base
      if (record%n_lines < 2) return
      do i = 1, size(scene%tools(tool)%surfaces)
        associate (points => scene%tools(tool)%surfaces(i)%points)
          do c = 1, 3
            points(:, :, c) = points(:, :, c) + field_real(record, 2, c)
          end do
        end associate
      end do
    end if
  end subroutine read_offset_tool

  !> Offset all surfaces of a tool, which are first turned so that their normals agree, and measure
  !! how far the result is from it.
  subroutine make_offset(record, base, distance, tolerance, tool, errors)
    type(record_t), intent(in) :: record
    type(tool_spec_t), intent(in) :: base
    real(wp), intent(in) :: distance, tolerance
    type(tool_spec_t), intent(inout) :: tool
    type(error_list_t), intent(inout) :: errors
    type(nurbs_surface_t), allocatable :: given(:), offsets(:)
    type(surface_seams_t) :: before, after
    type(offset_report_t) :: report, all
    type(error_t), allocatable :: error
    integer :: i

    given = base%surfaces
    allocate (offsets(size(given)))
    call find_surface_seams(given, seam_width*abs(distance), before)
    call orient_surfaces(before, given)
    do i = 1, size(given)
      call offset_surface(given(i), base%side*distance, tolerance, offsets(i), report, error)
      if (allocated(error)) exit
      all%n_faces = all%n_faces + report%n_faces
      all%angle = max(all%angle, report%angle)
    end do
    if (.not. allocated(error)) then
      call find_surface_seams(offsets, seam_width*abs(distance), after)
      if (after%n_free /= before%n_free) then
        allocate (error)
        error%message = "a sharp edge between two of its surfaces"
      end if
    end if
    if (.not. allocated(error)) call measure_offset(base%name, given, offsets, distance, &
                                                    tolerance, all, error)
    if (allocated(error)) then
      call add_error(errors, record%origin, "an offset of "//base%name//" by "// &
                     to_text(distance)//" that cannot be made ("//error%message//")", &
                     "a distance below all concave radii of a tool without edges, or a "// &
                     "larger tolerance")
      return
    end if
    tool%surfaces = offsets
    tool%side = base%side*merge(-1, 1, distance > 0.0_wp)
    call add_note(base, distance, all, tool)
  end subroutine make_offset

  !> Distance of the offset from the tool at places of all faces. Refused: one that is off by more
  !! than two tolerances, and one that another part of the tool is nearer to, as in a groove
  !! narrower than twice the distance.
  subroutine measure_offset(name, given, offsets, distance, tolerance, report, error)
    character(*), intent(in) :: name
    type(nurbs_surface_t), intent(in) :: given(:), offsets(:)
    real(wp), intent(in) :: distance, tolerance          !! [length]
    type(offset_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: end_inset = 1.0e-4_wp   ! fraction of a span left out at its ends
    type(tool_t) :: tool
    type(hit_t) :: hit
    real(wp), allocatable :: xi(:), eta(:)
    type(trim_t) :: trim
    real(wp) :: x(3), at(2)
    integer :: s, i, j, span

    call new_tool(tool, name, given, 1, abs(distance), error)
    if (allocated(error)) return
    do s = 1, size(offsets)
      xi = samples_along(offsets(s), 1, 2, end_inset)
      eta = samples_along(offsets(s), 2, 2, end_inset)
      if (allocated(offsets(s)%loops)) call new_trim(trim, offsets(s)%axes, offsets(s)%loops)
      do j = 1, size(eta)
        do i = 1, size(xi)
          if (allocated(offsets(s)%loops)) then
            call place_in_spans(offsets(s)%axes, [xi(i), eta(j)], span, at)
            if (.not. is_inside(trim, span, at)) cycle
          end if
          call evaluate_surface(offsets(s), [xi(i), eta(j)], x)
          call search_all_faces(tool, x, hit)
          report%error = max(report%error, abs(hit%distance - abs(distance)))
          if (abs(hit%distance - abs(distance)) <= 2*tolerance) cycle
          allocate (error)
          error%message = "at "//place_text(x)//" it comes within "// &
                          rounded_text(hit%distance)//" of another part"
          if (hit%distance > abs(distance)) &
            error%message = "at "//place_text(x)//" it is off by "// &
                            rounded_text(hit%distance - abs(distance))//", which is more than "// &
                            "two tolerances of "//rounded_text(tolerance)
          return
        end do
      end do
      report%n_places = report%n_places + size(xi)*size(eta)
    end do
  end subroutine measure_offset

  !> Report the offset surface in the log.
  subroutine add_note(base, distance, report, tool)
    type(tool_spec_t), intent(in) :: base
    real(wp), intent(in) :: distance
    type(offset_report_t), intent(in) :: report
    type(tool_spec_t), intent(inout) :: tool
    type(string_t) :: note

    note%value = "tool "//base%name//", offset by "//to_text(distance)//": "// &
                 to_text(report%n_faces)//" faces, off by at most "//rounded_text(report%error)// &
                 " at "//to_text(report%n_places)//" positions, normals by "// &
                 rounded_text(report%angle)//" degrees"
    tool%notes = [tool%notes, note]
  end subroutine add_note

end module tool_keywords
