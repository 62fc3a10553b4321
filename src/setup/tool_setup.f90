!> Tools of a scene where they start: as the deck has them, or placed against the sheet.
module tool_setup
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, add_warning, n_errors
  use text, only: rounded_text
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use scene, only: scene_t, blank_spec_t, tool_spec_t
  use tool, only: tool_t, new_tool
  use tool_placement, only: placing_shift
  implicit none
  private

  public :: start_tools, sheet_thickness

  real(wp), parameter :: search_reach = 3.0_wp       !! search distance over sheet thickness
  real(wp), parameter :: worth_telling = 1.0e-3_wp   !! doubt, part of the search distance
  real(wp), parameter :: far = 100.0_wp              !! of a clearance, of what sheet and tool reach

contains

  !> Tools prepared for contact and put where they start, before any motion. Unusable where an error
  !! was added.
  subroutine start_tools(scene, tools, errors)
    type(scene_t), intent(in) :: scene
    type(tool_t), allocatable, intent(out) :: tools(:)
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    real(wp) :: reach, shifts(3, size(scene%tools))
    integer :: t, before

    before = n_errors(errors)
    reach = search_reach*sheet_thickness(scene%blank)
    shifts = 0.0_wp
    allocate (tools(size(scene%tools)))
    do t = 1, size(scene%tools)
      associate (spec => scene%tools(t))
        call new_tool(tools(t), spec%name, spec%surfaces, spec%side, reach, error)
        if (allocated(error)) then
          call add_error(errors, spec%origin, error%message, "a usable tool surface")
          cycle
        end if
        if (any(abs(spec%placing) > 0.0_wp)) &
          call place_tool(scene, spec, tools(t), shifts(:, t), errors)
      end associate
    end do
    if (n_errors(errors) > before) return
    do t = 1, size(scene%tools)
      associate (spec => scene%tools(t))
        ! An offset goes with the tool that it belongs to.
        if (spec%offset_of == 0 .or. any(abs(spec%placing) > 0.0_wp)) cycle
        if (any(abs(shifts(:, spec%offset_of)) > 0.0_wp)) &
          call shift_tool(shifts(:, spec%offset_of), tools(t))
      end associate
    end do
  end subroutine start_tools

  !> Put a tool against the sheet as the deck wants it.
  subroutine place_tool(scene, spec, tool, shift, errors)
    type(scene_t), intent(in) :: scene
    type(tool_spec_t), intent(in) :: spec
    type(tool_t), intent(inout) :: tool
    real(wp), intent(out) :: shift(3)         !! by which it was moved [length]
    type(error_list_t), intent(inout) :: errors
    type(nurbs_solid_t) :: solids(size(scene%blank%patches))
    type(error_t), allocatable :: error
    real(wp) :: doubt, reach
    integer :: i

    do i = 1, size(solids)
      solids(i) = scene%blank%patches(i)%solid
    end do
    call placing_shift(tool, solids, spec%placing, spec%clearance, shift, doubt, error)
    if (allocated(error)) then
      call add_error(errors, spec%origin, error%message, "a direction that leads to the sheet")
      shift = 0.0_wp
      return
    end if
    reach = tool%scale
    do i = 1, size(solids)
      reach = max(reach, maxval(abs(solids(i)%points)))
    end do
    if (spec%clearance > far*reach) then
      call add_warning(errors, spec%origin, "a clearance of "//rounded_text(spec%clearance)// &
                       ", more than a hundred times as far as sheet and tool reach", &
                       "a clearance in the deck's unit of length")
    else if (doubt > worth_telling*tool%search_distance) then
      call add_warning(errors, spec%origin, "a tool so nearly parallel to the sheet that its "// &
                       "distance may be less than the clearance by "//rounded_text(doubt), &
                       "a larger clearance")
    end if
    call shift_tool(shift, tool)
  end subroutine place_tool

  !> Prepare a tool anew where it is moved to.
  subroutine shift_tool(shift, tool)
    real(wp), intent(in) :: shift(3)
    type(tool_t), intent(inout) :: tool
    type(nurbs_surface_t), allocatable :: surfaces(:)
    type(error_t), allocatable :: error
    character(:), allocatable :: name
    real(wp) :: reach
    integer :: i, c, side

    surfaces = tool%surfaces
    name = tool%name
    side = tool%side
    reach = tool%search_distance
    do i = 1, size(surfaces)
      do c = 1, 3
        surfaces(i)%points(:, :, c) = surfaces(i)%points(:, :, c) + shift(c)
      end do
    end do
    ! Cannot be refused: it was taken where it was.
    call new_tool(tool, name, surfaces, side, reach, error)
  end subroutine shift_tool

  !> Distance of the faces zeta_min and zeta_max in the middle of a patch, the largest of all.
  real(wp) function sheet_thickness(blank) result(thickness)
    type(blank_spec_t), intent(in) :: blank
    real(wp) :: xi(3), bottom(3), top(3)
    integer :: axis, p

    thickness = 0.0_wp
    do p = 1, size(blank%patches)
      associate (solid => blank%patches(p)%solid)
        do axis = 1, 3
          associate (knots => solid%axes(axis)%knots)
            xi(axis) = 0.5_wp*(knots(1) + knots(size(knots)))
          end associate
        end do
        associate (knots => solid%axes(3)%knots)
          call evaluate_solid(solid, [xi(1), xi(2), knots(1)], bottom)
          call evaluate_solid(solid, [xi(1), xi(2), knots(size(knots))], top)
        end associate
      end associate
      thickness = max(thickness, norm2(top - bottom))
    end do
  end function sheet_thickness

end module tool_setup
