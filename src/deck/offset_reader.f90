!> *TOOL with TYPE=OFFSET: the surfaces of another tool at a distance.
module offset_reader
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error
  use text, only: string_t, to_text, rounded_text, place_text
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use surface_seams, only: surface_seams_t, find_surface_seams, orient_surfaces
  use surface_offset, only: offset_surface, offset_report_t, samples_along
  use tool, only: tool_t, new_tool
  use tool_search, only: search_all_faces
  use closest_point, only: hit_t
  use scene, only: scene_t, tool_spec_t
  use deck_context, only: deck_names_t, resolve
  use deck_records, only: record_t, parsed_deck_t, option_text, is_option_given, field_real
  implicit none
  private

  public :: read_offset_tool, check_offset_option, measure_offset

  real(wp), parameter :: usual = 1.0e-4_wp       !! tolerance, part of the distance
  real(wp), parameter :: seam_width = 0.01_wp    !! widest seam, part of the distance

contains

  !> Refuse the option of offsets for a tool of another type.
  subroutine check_offset_option(deck, record, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(error_list_t), intent(inout) :: errors

    if (is_option_given(deck, record, "OF")) &
      call add_error(errors, record%origin, "the option OF for a tool of TYPE="// &
                     option_text(deck, record, "TYPE"), "this option with TYPE=OFFSET only")
  end subroutine check_offset_option

  !> Surfaces, side and notes of a tool; all others that are no offsets have been read. Without
  !! surfaces on an error.
  subroutine read_offset_tool(deck, record, names, is_offset, scene, tool, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(deck_names_t), intent(in) :: names
    logical, intent(in) :: is_offset(:)       !! tools of the scene, read or not
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: tool               !! place in the scene
    type(error_list_t), intent(inout) :: errors
    integer :: base, i, c
    real(wp) :: distance, tolerance

    if (is_option_given(deck, record, "SIDE")) &
      call add_error(errors, record%origin, "the option SIDE for a tool of TYPE=OFFSET", &
                     "none: it follows from the tool OF and the sign of the distance")
    if (.not. is_option_given(deck, record, "OF")) then
      call add_error(errors, record%origin, "no option OF", "OF=name of a tool for TYPE=OFFSET")
      return
    end if
    call resolve(names%tools, option_text(deck, record, "OF"), "*TOOL", record%origin, base, errors)
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
    real(wp), parameter :: beside = 1.0e-4_wp   ! part of a span that its ends are avoided by
    type(tool_t) :: tool
    type(hit_t) :: hit
    real(wp), allocatable :: xi(:), eta(:)
    real(wp) :: x(3)
    integer :: s, i, j

    call new_tool(tool, name, given, 1, abs(distance), error)
    if (allocated(error)) return
    do s = 1, size(offsets)
      xi = samples_along(offsets(s), 1, 2, beside)
      eta = samples_along(offsets(s), 2, 2, beside)
      do j = 1, size(eta)
        do i = 1, size(xi)
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

  !> Tell the log what was made.
  subroutine add_note(base, distance, report, tool)
    type(tool_spec_t), intent(in) :: base
    real(wp), intent(in) :: distance
    type(offset_report_t), intent(in) :: report
    type(tool_spec_t), intent(inout) :: tool
    type(string_t) :: note

    note%value = "tool "//base%name//", offset by "//to_text(distance)//": "// &
                 to_text(report%n_faces)//" faces, off by at most "//rounded_text(report%error)// &
                 " at "//to_text(report%n_places)//" places, normals by "// &
                 rounded_text(report%angle)//" degrees"
    tool%notes = [tool%notes, note]
  end subroutine add_note

end module offset_reader
