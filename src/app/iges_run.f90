!> `igaform iges`: a tool or the blank of a result, or of a deck, as an IGES file.
module iges_run
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds, only: wp
  use errors, only: error_t, fail
  use faults, only: fault_list_t, n_errors
  use text, only: string_t, to_text, upper_case, squeezed, nearest_name
  use file_identity, only: is_same_file
  use build_info, only: version
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: nurbs_solid_t, solid_face, face_side
  use refinement, only: reverse_axis
  use seams, only: seams_t, find_seams
  use patch_joints, only: joints_t, find_joints
  use length_units, only: unit_in_mm
  use iges_writer, only: write_iges
  use scene, only: scene_t
  use tool, only: tool_t
  use tool_setup, only: start_tools
  use deck_reader, only: read_deck
  use fault_report, only: report_faults
  use hdf5_library, only: hid_t
  use hdf5_reading, only: open_for_reading, close_reading
  use nurbs_reading, only: shapes_t, read_shapes
  use unit_system, only: unit_system_t, new_unit_system
  use command_line, only: command_t
  use exit_codes, only: exit_done, exit_input
  use output_names, only: base_of, file_name
  implicit none
  private

  public :: run_iges

  character(8), parameter :: faces(6) = [character(8) :: "XI_MIN", "XI_MAX", "ETA_MIN", "ETA_MAX", &
                                         "ZETA_MIN", "ZETA_MAX"]

contains

  !> Carry out the command; the exit code is 1 if the input is at fault.
  integer function run_iges(command) result(code)
    type(command_t), intent(in) :: command
    type(shapes_t) :: shapes
    type(nurbs_surface_t), allocatable :: surfaces(:)
    type(string_t), allocatable :: labels(:)
    type(error_t), allocatable :: error
    character(:), allocatable :: path, unit

    code = exit_input
    call load_shapes(command, shapes, error)
    if (.not. allocated(error) .and. .not. allocated(shapes%solids)) return   ! told already
    if (.not. allocated(error)) call pick_part(command, shapes, surfaces, labels, error)
    if (.not. allocated(error)) call choose_unit(command, shapes, unit, error)
    if (.not. allocated(error)) call choose_path(command, path, error)
    if (.not. allocated(error)) call write_iges(path, surfaces, labels, unit, &
                                                "igaform "//version, error)
    if (allocated(error)) then
      write (error_unit, "(a)") "igaform: "//error%message
      return
    end if
    code = exit_done
    if (.not. command%is_quiet) print "(a)", path//": "//to_text(size(surfaces))// &
      " surfaces in "//unit
  end function run_iges

  !> Shapes of a result file, or of a deck as it starts.
  subroutine load_shapes(command, shapes, error)
    type(command_t), intent(in) :: command
    type(shapes_t), intent(out) :: shapes      !! empty if a deck is at fault, which is then told
    type(error_t), allocatable, intent(out) :: error
    type(scene_t) :: scene
    type(fault_list_t) :: faults
    type(unit_system_t) :: units
    type(tool_t), allocatable :: tools(:)
    integer(hid_t) :: file
    integer :: i

    file = open_for_reading(command%deck)
    if (file >= 0) then
      call close_reading(file)
      call read_shapes(command%deck, shapes, error)
      return
    end if
    call read_deck(command%deck, command%overrides, scene, faults)
    if (n_errors(faults) == 0) call start_tools(scene, tools, faults)
    call report_faults(faults, error_unit)
    if (n_errors(faults) > 0) return
    units = new_unit_system(scene%units)
    shapes%unit = units%length
    allocate (shapes%solids(size(scene%blank%patches)), shapes%patches(size(scene%blank%patches)))
    do i = 1, size(shapes%solids)
      shapes%solids(i) = scene%blank%patches(i)%solid
      shapes%patches(i)%value = ""
      if (size(shapes%solids) > 1) shapes%patches(i)%value = scene%blank%patches(i)%name
    end do
    allocate (shapes%tools(size(tools)))
    do i = 1, size(tools)
      shapes%tools(i)%name = tools(i)%name
      shapes%tools(i)%surfaces = tools(i)%surfaces
    end do
  end subroutine load_shapes

  !> The surfaces of the tool of that name, or the outer faces of the blank.
  subroutine pick_part(command, shapes, surfaces, labels, error)
    type(command_t), intent(in) :: command
    type(shapes_t), intent(in) :: shapes
    type(nurbs_surface_t), allocatable, intent(out) :: surfaces(:)
    type(string_t), allocatable, intent(out) :: labels(:)
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: names(size(shapes%tools) + 1)
    character(:), allocatable :: wanted, list
    integer :: i

    wanted = squeezed(upper_case(command%part))
    list = "blank"
    names(1)%value = "blank"
    do i = 1, size(shapes%tools)
      names(i + 1)%value = shapes%tools(i)%name
      list = list//", "//shapes%tools(i)%name
      if (squeezed(upper_case(shapes%tools(i)%name)) /= wanted) cycle
      if (command%face /= "") then
        call fail(error, "option --face goes with the blank, not with a tool")
        return
      end if
      surfaces = shapes%tools(i)%surfaces
      allocate (labels(size(surfaces)))
      labels = spread(names(i + 1), 1, size(surfaces))
      return
    end do
    if (wanted == "" .or. wanted == "BLANK") then
      call outer_faces(shapes, squeezed(upper_case(command%face)), surfaces, labels, error)
    else
      call fail(error, "no part '"//command%part//"'; there are "//list// &
                hint(nearest_name(command%part, names)))
    end if
  end subroutine pick_part

  !> Faces that lie on no other, with their normals outwards.
  subroutine outer_faces(shapes, wanted, surfaces, labels, error)
    type(shapes_t), intent(in) :: shapes
    character(*), intent(in) :: wanted         !! name of a face, empty: all
    type(nurbs_surface_t), allocatable, intent(out) :: surfaces(:)
    type(string_t), allocatable, intent(out) :: labels(:)
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_solid_t), allocatable :: solids(:)
    type(nurbs_surface_t) :: face
    type(string_t) :: label
    type(seams_t) :: seams
    type(joints_t) :: joints
    integer :: p, f

    if (wanted /= "" .and. .not. any(faces == wanted)) then
      call fail(error, "no face '"//wanted//"'; there are XI_MIN, XI_MAX, ETA_MIN, ETA_MAX, "// &
                "ZETA_MIN, ZETA_MAX")
      return
    end if
    solids = shapes%solids
    call find_seams(solids, tolerance_of(solids), seams)
    joints = find_joints(solids, seams)
    allocate (surfaces(0), labels(0))
    do p = 1, size(solids)
      do f = 1, size(faces)
        if (joints%is_joined(f, p) .or. (wanted /= "" .and. faces(f) /= wanted)) cycle
        face = solid_face(shapes%solids(p), f)
        if (face_side(f) < 0) call reverse_axis(face, 1)
        label%value = trim(faces(f))
        if (size(solids) > 1) label%value = shapes%patches(p)%value
        surfaces = [surfaces, face]
        labels = [labels, label]
      end do
    end do
    if (size(surfaces) == 0) call fail(error, "no free face "//wanted)
  end subroutine outer_faces

  !> A millionth of the blank.
  pure real(wp) function tolerance_of(solids) result(tolerance)
    type(nurbs_solid_t), intent(in) :: solids(:)
    integer :: p

    tolerance = 0.0_wp
    do p = 1, size(solids)
      associate (x => solids(p)%points)
        tolerance = max(tolerance, 1.0e-6_wp*(maxval(x) - minval(x)))
      end associate
    end do
  end function tolerance_of

  !> The unit of --length, else the one that the deck names, else millimetres with a warning.
  subroutine choose_unit(command, shapes, unit, error)
    type(command_t), intent(in) :: command
    type(shapes_t), intent(in) :: shapes
    character(:), allocatable, intent(out) :: unit
    type(error_t), allocatable, intent(out) :: error

    unit = upper_case(command%length_unit)
    if (unit /= "") then
      if (.not. unit_in_mm(unit) > 0.0_wp) call fail(error, "option --length needs MM, CM, M, "// &
                                                     "IN, FT or the like, not '"//unit//"'")
      return
    end if
    unit = upper_case(shapes%unit)
    if (unit_in_mm(unit) > 0.0_wp) return
    unit = "MM"
    write (error_unit, "(a)") "igaform: warning: the deck names no unit of length (*UNITS): "// &
      "written as MM; --length UNIT says otherwise"
  end subroutine choose_unit

  !> The file of --out, or the result's name with the part's behind it.
  subroutine choose_path(command, path, error)
    type(command_t), intent(in) :: command
    character(:), allocatable, intent(out) :: path
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    path = command%output
    if (path == "") then
      path = base_of(file_name(command%deck))//"-"//trim(command%part)//".igs"
      if (command%part == "") path = base_of(file_name(command%deck))//"-blank.igs"
      do i = 1, len(path)
        if (path(i:i) == " ") path(i:i) = "_"
      end do
    end if
    if (is_same_file(path, command%deck)) call fail(error, "'"//path//"' is the file to read")
  end subroutine choose_path

  pure function hint(name) result(words)
    character(*), intent(in) :: name
    character(:), allocatable :: words

    words = ""
    if (name /= "") words = "; did you mean "//name//"?"
  end function hint

end module iges_run
