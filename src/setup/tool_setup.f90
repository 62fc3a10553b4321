!> Tools of a scene where they start: as the deck has them, or placed against the sheet.
module tool_setup
  use kinds, only: wp
  use failure, only: error_t, fail
  use input_errors, only: error_list_t, add_error, add_warning, n_errors
  use text, only: rounded_text, to_text
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid, solid_face
  use scene, only: scene_t, blank_spec_t, tool_spec_t
  use tool, only: tool_t, new_tool
  use tool_side, only: face_the_blank
  use tool_clearance_search, only: clearance_search_t, new_clearance_search, find_clearance, &
                            follow_clearance
  implicit none
  private

  public :: start_tools, sheet_thickness
  public :: placing_shift

  real(wp), parameter :: search_reach = 3.0_wp       !! search distance over sheet thickness
  real(wp), parameter :: worth_telling = 1.0e-3_wp   !! doubt, part of the search distance
  real(wp), parameter :: far = 100.0_wp              !! of a clearance, of what sheet and tool reach

  integer, parameter :: max_advances = 1000
  real(wp), parameter :: exact = 1.0e-12_wp       !! what is left, of the size of the scene
  real(wp), parameter :: coarse = 0.1_wp          !! of an advance, known no better while it is long

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
        call new_tool(tools(t), spec%name, spec%surfaces, merge(spec%side, 1, spec%side /= 0), &
                      reach, error)
        if (allocated(error)) then
          call add_error(errors, spec%origin, error%message, "a usable tool surface")
          cycle
        end if
        if (any(abs(spec%placing) > 0.0_wp)) &
          call place_tool(scene, spec, tools(t), shifts(:, t), errors)
        if (spec%side == 0) call turn_tool(scene%blank, tools(t))
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

  !> Make the side that faces the blank the active one.
  subroutine turn_tool(blank, tool)
    type(blank_spec_t), intent(in) :: blank
    type(tool_t), intent(inout) :: tool
    type(nurbs_surface_t), allocatable :: surfaces(:)
    type(error_t), allocatable :: error
    type(tool_t) :: turned
    integer :: side

    surfaces = tool%surfaces
    call face_the_blank(blank, surfaces, tool%search_distance, side)
    ! Cannot be rejected: it was taken the other way round.
    call new_tool(turned, tool%name, surfaces, side, tool%search_distance, error)
    turned%n_reversed = tool%n_reversed
    tool = turned
  end subroutine turn_tool

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
    type(tool_t) :: old
    integer :: i, c

    old = tool
    surfaces = tool%surfaces
    do i = 1, size(surfaces)
      do c = 1, 3
        surfaces(i)%points(:, :, c) = surfaces(i)%points(:, :, c) + shift(c)
      end do
    end do
    ! Cannot be refused: it was taken where it was.
    call new_tool(tool, old%name, surfaces, old%side, old%search_distance, error)
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

  !> Way of a tool along `direction` from where it is to where its smallest distance to the sheet is
  !! `clearance`, coming from behind. Refused: a tool that passes the sheet farther away, and one
  !! that comes to no end.
  subroutine placing_shift(tool, solids, direction, clearance, shift, doubt, error)
    type(tool_t), intent(in) :: tool
    type(nurbs_solid_t), intent(in) :: solids(:)   !! patches of the sheet
    real(wp), intent(in) :: direction(3)           !! towards the sheet; not zero
    real(wp), intent(in) :: clearance              !! not negative [length]
    real(wp), intent(out) :: shift(3)              !! [length]
    real(wp), intent(out) :: doubt                 !! by which the distance may be less [length]
    type(error_t), allocatable, intent(out) :: error
    type(clearance_search_t) :: search
    real(wp) :: unit(3), way, last, nearest, least, left
    logical :: is_close
    integer :: i

    unit = direction/norm2(direction)
    call new_clearance_search(search, faces_of(solids), tool, reach=clearance)
    call find_ends(tool, solids, unit, way, last)
    way = way - clearance
    last = last + clearance
    least = huge(1.0_wp)
    is_close = .false.
    do i = 1, max_advances
      call find_clearance(search, tool, way*unit, clearance, merge(0.0_wp, coarse, is_close), &
                               nearest, doubt)
      least = min(least, nearest)
      left = nearest - clearance
      if ((is_close .and. abs(left) <= exact*search%scale) .or. way > last) exit
      way = way + left
      if (.not. is_close .and. doubt < left) way = way - doubt
      is_close = left <= search%tolerance/coarse
      if (is_close) call settle(search, tool, unit, clearance, way)
    end do
    shift = way*unit
    if (way > last) then
      call fail(error, "tool "//tool%name//" passes the sheet at a distance of "//to_text(least))
    else if (abs(left) > 1000*exact*search%scale) then
      call fail(error, "tool "//tool%name//" does not converge to its clearance from the "// &
                "sheet; the last distance is "//to_text(nearest))
    end if
  end subroutine placing_shift

  !> Advance by what the place known to be nearest leaves, until that is nothing or round-off keeps
  !! it from becoming less.
  subroutine settle(search, tool, unit, clearance, way)
    type(clearance_search_t), intent(inout) :: search
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: unit(3), clearance
    real(wp), intent(inout) :: way
    real(wp) :: nearest, left, before
    integer :: i

    before = huge(1.0_wp)
    do i = 1, max_advances
      call follow_clearance(search, tool, way*unit, nearest)
      left = abs(nearest - clearance)
      if (left <= 0.5_wp*exact*search%scale .or. left >= before) exit
      before = left
      way = way + nearest - clearance
    end do
  end subroutine settle

  !> Ways along a direction where the foremost corner of the box around a tool meets the hindmost
  !! control point of the sheet, and where its hindmost one leaves the foremost one.
  pure subroutine find_ends(tool, solids, unit, first, last)
    type(tool_t), intent(in) :: tool
    type(nurbs_solid_t), intent(in) :: solids(:)
    real(wp), intent(in) :: unit(3)
    real(wp), intent(out) :: first, last           !! [length]
    real(wp) :: front, rear
    integer :: p

    front = dot_product(merge(tool%box(:, 2), tool%box(:, 1), unit > 0.0_wp), unit)
    rear = dot_product(merge(tool%box(:, 1), tool%box(:, 2), unit > 0.0_wp), unit)
    first = huge(1.0_wp)
    last = -huge(1.0_wp)
    do p = 1, size(solids)
      associate (x => solids(p)%points)
        first = min(first, minval(unit(1)*x(:, :, :, 1) + unit(2)*x(:, :, :, 2) &
                                  + unit(3)*x(:, :, :, 3)))
        last = max(last, maxval(unit(1)*x(:, :, :, 1) + unit(2)*x(:, :, :, 2) &
                                + unit(3)*x(:, :, :, 3)))
      end associate
    end do
    first = first - front
    last = last - rear
  end subroutine find_ends

  !> All faces of all patches.
  pure function faces_of(solids) result(faces)
    type(nurbs_solid_t), intent(in) :: solids(:)
    type(nurbs_surface_t) :: faces(6*size(solids))
    integer :: p, f

    do p = 1, size(solids)
      do f = 1, 6
        faces(6*(p - 1) + f) = solid_face(solids(p), f)
      end do
    end do
  end function faces_of

end module tool_setup
