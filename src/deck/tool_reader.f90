!> *TOOL: rigid surfaces listed, extruded, generated, from CAD or offset from others.
module tool_reader
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error
  use checksum, only: file_checksum
  use knot_vector, only: knot_vector_t
  use nurbs_surface, only: nurbs_surface_t, new_nurbs_surface
  use primitives, only: plane_surface, cylinder_surface, sphere_surface, extruded_surface
  use scene, only: scene_t
  use deck_names, only: deck_names_t, enter_name, resolve
  use name_table, only: name_table_t, place_of
  use text, only: string_t, upper_case, squeezed
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, field_real, &
                          field_integer, is_option_given
  use cad_reader, only: read_cad_tool, check_cad_options
  use offset_reader, only: read_offset_tool, check_offset_option
  use patch_reader, only: patch_parts_t, check_parts, read_axes, read_points, refine
  implicit none
  private

  public :: read_tools, enter_tools

contains

  !> Enter the names of all tools. A *TOOL that is a part of another is none.
  subroutine enter_tools(deck, names, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(name_table_t), intent(inout) :: names
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, "TOOL")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. is_option_given(deck, record, "PART OF")) &
          call enter_name(deck, record, names, errors)
      end associate
    end do
  end subroutine enter_tools

  !> Fill the list of tools, one for each *TOOL that is no part of another in the order of the deck,
  !! then add the parts, then make the offsets. A tool whose surface cannot be made has none.
  subroutine read_tools(deck, names, parts, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_names_t), intent(in) :: names
    type(patch_parts_t), intent(in) :: parts(:)   !! by place in `names%patches`
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(nurbs_surface_t) :: surface
    type(string_t) :: file
    integer, allocatable :: found(:), all_found(:)
    integer :: i, s, patch
    logical :: is_complete

    all_found = find_records(deck, "TOOL")
    found = pack(all_found, [(.not. is_option_given(deck, deck%records(all_found(i)), "PART OF"), &
                              i=1, size(all_found))])
    allocate (scene%tools(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), tool => scene%tools(i))
        tool%origin = record%origin
        tool%name = option_text(deck, record, "NAME")
        tool%side = merge(-1, 1, option_text(deck, record, "SIDE") == "NEGATIVE")
        allocate (tool%surfaces(0), tool%notes(0))
        patch = place_of(names%patches, squeezed(upper_case(tool%name)))
        if (patch == 0) cycle
        if (option_text(deck, record, "TYPE") == "OFFSET") cycle
        call check_offset_option(deck, record, errors)
        if (option_text(deck, record, "TYPE") == "IGES") then
          call read_cad_tool(deck, record, scene%units, tool, file%value, errors)
          if (file%value /= "") call add_source(scene, file)
          call check_parts(deck, parts(patch), 0, "a tool of TYPE=IGES", errors)
          do s = 1, size(tool%surfaces)
            call refine(deck, parts(patch), tool%surfaces(s), errors)
          end do
          cycle
        end if
        call check_cad_options(deck, record, errors)
        call read_surface(deck, record, parts(patch), surface, is_complete, errors)
        if (.not. is_complete) cycle
        call refine(deck, parts(patch), surface, errors)
        tool%surfaces = [surface]
      end associate
    end do
    do i = 1, size(all_found)
      if (all(found /= all_found(i))) &
        call read_part(deck, deck%records(all_found(i)), names, parts, scene, errors)
    end do
    call read_offsets(deck, found, names, parts, scene, errors)
  end subroutine read_tools

  !> Make the tools that are offsets of others.
  subroutine read_offsets(deck, found, names, parts, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: found(:)               !! records of the tools
    type(deck_names_t), intent(in) :: names
    type(patch_parts_t), intent(in) :: parts(:)
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    logical :: is_offset(size(found))
    integer :: i, s, patch

    is_offset = [(option_text(deck, deck%records(found(i)), "TYPE") == "OFFSET", i=1, size(found))]
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. is_offset(i)) cycle
        patch = place_of(names%patches, squeezed(upper_case(scene%tools(i)%name)))
        if (patch == 0) cycle
        call check_cad_options(deck, record, errors)
        call check_parts(deck, parts(patch), 0, "a tool of TYPE=OFFSET", errors)
        call read_offset_tool(deck, record, names, is_offset, scene, i, errors)
        do s = 1, size(scene%tools(i)%surfaces)
          call refine(deck, parts(patch), scene%tools(i)%surfaces(s), errors)
        end do
      end associate
    end do
  end subroutine read_offsets

  !> Add the surface of a *TOOL that is a part of another.
  subroutine read_part(deck, record, names, parts, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(deck_names_t), intent(in) :: names
    type(patch_parts_t), intent(in) :: parts(:)
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(nurbs_surface_t) :: surface
    integer :: tool, patch
    logical :: is_complete

    call resolve(names%tools, option_text(deck, record, "PART OF"), "*TOOL", record%origin, tool, &
                 errors)
    patch = place_of(names%patches, squeezed(upper_case(option_text(deck, record, "NAME"))))
    if (tool == 0 .or. patch == 0) return
    if (any(option_text(deck, record, "TYPE") == [character(6) :: "IGES", "OFFSET"])) then
      call add_error(errors, record%origin, "a part of TYPE="// &
                     option_text(deck, record, "TYPE"), "parts whose surface stands "// &
                     "in the deck, or a *TOOL of its own")
      return
    end if
    call check_cad_options(deck, record, errors)
    call check_offset_option(deck, record, errors)
    call read_surface(deck, record, parts(patch), surface, is_complete, errors)
    if (.not. is_complete) return
    call refine(deck, parts(patch), surface, errors)
    scene%tools(tool)%surfaces = [scene%tools(tool)%surfaces, surface]
  end subroutine read_part

  !> A file that is no text of the deck counts to it all the same: by its checksum.
  subroutine add_source(scene, file)
    type(scene_t), intent(inout) :: scene
    type(string_t), intent(in) :: file

    type(string_t) :: sum

    sum%value = file_checksum(file%value)
    scene%files = [scene%files, file]
    scene%sums = [scene%sums, sum]
    scene%text = scene%text//"** file "//file%value//", checksum "//sum%value//new_line("a")
  end subroutine add_source

  subroutine read_surface(deck, record, parts, surface, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(patch_parts_t), intent(in) :: parts
    type(nurbs_surface_t), intent(out) :: surface
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: type
    type(error_t), allocatable :: error
    integer :: n_axes

    type = option_text(deck, record, "TYPE")
    n_axes = 0
    if (type == "SURFACE") n_axes = 2
    if (type == "EXTRUDED") n_axes = 1
    call check_parts(deck, parts, n_axes, "a tool of TYPE="//type, errors)
    is_complete = record%is_valid
    select case (type)
    case ("SURFACE", "EXTRUDED")
      call read_listed(deck, record, parts, n_axes, surface, is_complete, error, errors)
    case ("PLANE")
      if (is_complete) call plane_surface(surface, vector(record, 1, 1), vector(record, 2, 1), &
                                          vector(record, 3, 1), error)
    case ("CYLINDER")
      if (is_complete) then
        call cylinder_surface(surface, vector(record, 1, 1), vector(record, 1, 4), &
                              field_real(record, 2, 1), norm2(vector(record, 1, 4)), &
                              field_real(record, 2, 2), field_real(record, 2, 3), error)
      end if
    case ("SPHERE")
      if (is_complete) call sphere_surface(surface, vector(record, 1, 1), &
                                           field_real(record, 2, 1), error)
    end select
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
      if (record%n_lines > 1) shift = vector(record, 2, 1)
      points = points + spread(shift, 1, size(points, 1))
      call extruded_surface(surface, axes(1), points, weights, vector(record, 1, 1), &
                            field_integer(record, 1, 4), field_integer(record, 1, 5), error)
    end if
  end subroutine read_listed

  !> Three fields of a line from `field` on.
  pure function vector(record, line, field)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field
    real(wp) :: vector(3)
    integer :: i

    vector = [(field_real(record, line, field + i), i=0, 2)]
  end function vector

end module tool_reader
