!> What of a scene repeats itself: across its width, or on the other side of a plane. And the scene
!! reduced to a strip of it: one element wide, without motion across the width.
!!
!! The strip is linear across, with one point of integration, contact and pressure there: its two
!! sides then move alike, and nothing that is uniform across is lost. A kernel of its own sees one
!! side (plane_setup): no strain holds both together, so nothing may distinguish them.
module scene_reduction
  use kinds, only: wp
  use knot_vector, only: knot_vector_t
  use nurbs_surface, only: nurbs_surface_t
  use scene, only: scene_t, tool_spec_t, box_spec_t, set_spec_t, boundary_spec_t, boxes_of
  use input_errors, only: error_list_t, add_error
  use text, only: to_text, axis_names
  implicit none
  private

  public :: axis_along, uniformity_problem, mirror_problem, reduce_scene

  real(wp), parameter :: tolerance = 1.0e-9_wp      !! of the size of the blank

contains

  !> Axis of the first patch along which the blank is uniform and runs straight along a coordinate,
  !! through the thickness aside; 0 where there is none.
  pure integer function axis_along(scene, component) result(axis)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: component            !! 1 x, 2 y, 3 z

    associate (solid => scene%blank%patches(1)%solid)
      do axis = 2, 1, -1
        if (is_extruded(solid%points, solid%weights, axis, component)) return
      end do
    end associate
  end function axis_along

  !> Why the scene is not the same all along a coordinate, as a clause; empty if it is.
  function uniformity_problem(scene, component) result(reason)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: component
    character(:), allocatable :: reason
    real(wp) :: range(2)
    integer :: axis, i

    reason = ""
    if (size(scene%blank%patches) > 1) then
      reason = "the blank has several patches"
      return
    else if (has_outline(scene)) then
      reason = "the blank has an outline"
      return
    end if
    axis = axis_along(scene, component)
    if (axis == 0) then
      reason = "the blank is not uniform along "//axis_names(component)
      return
    end if
    associate (x => scene%blank%patches(1)%solid%points(:, :, :, component))
      range = [minval(x), maxval(x)]
    end associate
    do i = 1, size(scene%tools)
      reason = tool_problem(scene%tools(i), component, range)
      if (moves_along(scene, i, component)) &
        reason = "tool '"//scene%tools(i)%name//"' moves along "//axis_names(component)
      if (reason /= "") return
    end do
    do i = 1, size(scene%contacts)
      if ((scene%contacts(i)%face + 1)/2 == axis) reason = "an edge of the blank is in contact"
    end do
    if (reason == "") reason = condition_problem(scene, component, axis)
  end function uniformity_problem

  !> Is the blank cut along curves, at the start or in a step?
  pure logical function has_outline(scene)
    type(scene_t), intent(in) :: scene

    has_outline = .false.
    if (allocated(scene%outlines)) has_outline = size(scene%outlines) > 0
  end function has_outline

  !> Has a tool a motion in any step with a share along the coordinate, or a turn not about it?
  pure logical function moves_along(scene, tool, component)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: tool, component
    logical :: is_along(3)
    integer :: i

    moves_along = .false.
    do i = 1, size(scene%motions)
      if (scene%motions(i)%tool /= tool) cycle
      is_along = abs(scene%motions(i)%vector) > 0.0_wp
      if (scene%motions(i)%is_rotation) then
        moves_along = moves_along .or. count(is_along) > merge(1, 0, is_along(component))
      else
        moves_along = moves_along .or. is_along(component)
      end if
    end do
  end function moves_along

  !> The same of one tool, which must reach over the whole blank.
  pure function tool_problem(tool, component, range) result(reason)
    type(tool_spec_t), intent(in) :: tool
    integer, intent(in) :: component
    real(wp), intent(in) :: range(2)           !! of the blank along the coordinate
    character(:), allocatable :: reason
    real(wp) :: slack
    integer :: s

    reason = ""
    slack = tolerance*(range(2) - range(1))
    do s = 1, size(tool%surfaces)
      associate (surface => tool%surfaces(s))
        if (allocated(surface%loops)) then
          reason = "tool '"//tool%name//"' is trimmed"
        else if (.not. is_extruded_surface(surface, component)) then
          reason = "tool '"//tool%name//"' is not extruded along "//axis_names(component)
        else if (minval(surface%points(:, :, component)) > range(1) + slack .or. &
                 maxval(surface%points(:, :, component)) < range(2) - slack) then
          reason = "tool '"//tool%name//"' does not reach over the whole blank along "// &
                  axis_names(component)
        end if
      end associate
      if (reason /= "") return
    end do
  end function tool_problem

  !> The same of loads, supports and states at the start.
  pure function condition_problem(scene, component, axis) result(reason)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: component, axis
    character(:), allocatable :: reason
    integer :: i

    reason = ""
    do i = 1, size(scene%boundaries)
      associate (spec => scene%boundaries(i))
        if (abs(spec%velocity(component)) > 0.0_wp) then
          reason = "a boundary condition moves along "//axis_names(component)
        else if (count(spec%is_prescribed) > merge(1, 0, spec%is_prescribed(component)) &
                 .and. .not. reaches_over(scene, spec%set, axis, component)) then
          reason = "a boundary condition acts on a part of the width"
        end if
      end associate
    end do
    do i = 1, size(scene%loads)
      associate (spec => scene%loads(i))
        if (spec%kind /= "PRESSURE" .and. abs(spec%value(component)) > 0.0_wp) then
          reason = "a load acts along "//axis_names(component)
        else if (.not. reaches_over(scene, spec%set, axis, component)) then
          reason = "a load acts on a part of the width"
        end if
      end associate
    end do
    do i = 1, size(scene%initial_velocities)
      associate (spec => scene%initial_velocities(i))
        if (abs(spec%velocity(component)) > 0.0_wp .or. &
            any(abs(spec%omega([mod(component, 3) + 1, mod(component + 1, 3) + 1])) > 0.0_wp) &
            .or. .not. reaches_over(scene, spec%set, axis, component)) &
          reason = "the velocities at the start differ along "//axis_names(component)
      end associate
    end do
    do i = 1, size(scene%initial_states)
      if (.not. reaches_over(scene, scene%initial_states(i)%set, axis, component)) &
        reason = "the states at the start differ along "//axis_names(component)
    end do
    do i = 1, size(scene%fields)
      associate (spec => scene%fields(i))
        if (abs(spec%gradient(component)) > 0.0_wp .or. &
            .not. reaches_over(scene, spec%set, axis, component)) &
          reason = "a temperature or field variable differs along "//axis_names(component)
      end associate
    end do
    if (size(scene%beads) > 0) reason = "a draw bead may differ along "//axis_names(component)
  end function condition_problem

  !> Does a set extend, with each of its boxes, over all of the width? Set 0 is all of the blank.
  pure logical function reaches_over(scene, set, axis, component)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: set, axis, component
    type(box_spec_t), allocatable :: boxes(:)
    integer :: i

    reaches_over = .true.
    if (set == 0) return
    boxes = boxes_of(scene%sets(set))
    associate (solid => scene%blank%patches(1)%solid)
      associate (knots => solid%axes(axis)%knots, x => solid%points(:, :, :, component))
        do i = 1, size(boxes)
          reaches_over = reaches_over .and. boxes(i)%lower(axis, 1) <= knots(1) .and. &
                         boxes(i)%upper(axis, 1) >= knots(size(knots)) .and. &
                         boxes(i)%from(component) <= minval(x) .and. &
                         boxes(i)%to(component) >= maxval(x)
        end do
      end associate
    end associate
  end function reaches_over

  !> Does one coordinate alone change along an axis of a grid, and that everywhere alike?
  pure logical function is_extruded(points, weights, axis, component)
    real(wp), intent(in) :: points(:, :, :, :), weights(:, :, :)
    integer, intent(in) :: axis, component
    real(wp), allocatable :: values(:, :)        ! the places along the axis come second
    real(wp) :: slack
    integer :: c, i

    slack = tolerance*maxval(abs(points))
    values = along(weights, axis)
    is_extruded = size(values, 2) > 1
    do i = 2, size(values, 2)
      is_extruded = is_extruded .and. all(abs(values(:, i) - values(:, 1)) <= tolerance)
    end do
    do c = 1, 3
      values = along(points(:, :, :, c), axis)
      if (c == component) then
        is_extruded = is_extruded .and. maxval(values) - minval(values) > slack &
                      .and. all(maxval(values, 1) - minval(values, 1) <= slack)
      else
        do i = 2, size(values, 2)
          is_extruded = is_extruded .and. all(abs(values(:, i) - values(:, 1)) <= slack)
        end do
      end if
    end do
  end function is_extruded

  !> A grid with one axis put last and the others in one.
  pure function along(grid, axis) result(values)
    real(wp), intent(in) :: grid(:, :, :)
    integer, intent(in) :: axis
    real(wp), allocatable :: values(:, :)
    integer :: i

    allocate (values(size(grid)/size(grid, axis), size(grid, axis)))
    do i = 1, size(values, 2)
      select case (axis)
      case (1)
        values(:, i) = pack(grid(i, :, :), .true.)
      case (2)
        values(:, i) = pack(grid(:, i, :), .true.)
      case default
        values(:, i) = pack(grid(:, :, i), .true.)
      end select
    end do
  end function along

  pure logical function is_extruded_surface(surface, component) result(is_extruded_any)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: component
    integer :: n(3), axis

    n = [shape(surface%weights), 1]
    is_extruded_any = .false.
    do axis = 1, 2
      is_extruded_any = is_extruded_any .or. &
        is_extruded(reshape(surface%points, [n, 3]), reshape(surface%weights, n), axis, component)
    end do
  end function is_extruded_surface

  !> Why a scene is not its own picture in the plane through the middle of its blank, across a
  !! coordinate; empty if it is.
  function mirror_problem(scene, component) result(reason)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: component
    character(:), allocatable :: reason
    real(wp) :: middle
    integer :: axis, i, s

    reason = ""
    if (size(scene%blank%patches) > 1) then
      reason = "the blank has several patches"
      return
    else if (has_outline(scene)) then
      reason = "the blank has an outline"
      return
    end if
    associate (solid => scene%blank%patches(1)%solid)
      middle = 0.5_wp*(minval(solid%points(:, :, :, component)) &
                       + maxval(solid%points(:, :, :, component)))
      axis = 0
      do i = 1, 2
        if (.not. is_even(solid%axes(i))) cycle
        if (is_mirrored(solid%points, solid%weights, solid%points, solid%weights, i, component, &
                        middle)) axis = i
      end do
    end associate
    if (axis == 0) reason = "the blank is not"
    do i = 1, size(scene%tools)
      associate (tool => scene%tools(i))
        if (moves_along(scene, i, component)) reason = "tool '"//tool%name//"' moves across it"
        do s = 1, size(tool%surfaces)
          if (allocated(tool%surfaces(s)%loops)) then
            reason = "tool '"//tool%name//"' is trimmed"
            cycle
          end if
          if (.not. has_picture(tool, tool%surfaces(s), component, middle)) &
            reason = "tool '"//tool%name//"' is not"
        end do
      end associate
    end do
    if (reason == "") reason = mirrored_condition_problem(scene, component, axis, middle)
  end function mirror_problem

  !> Are the knots the same from either end?
  pure logical function is_even(kv)
    type(knot_vector_t), intent(in) :: kv

    associate (knots => kv%knots, n => size(kv%knots))
      is_even = all(abs(knots - knots(1) - (knots(n) - knots(n:1:-1))) &
                    <= tolerance*(knots(n) - knots(1)))
    end associate
  end function is_even

  !> Does the second grid, turned round along an axis, show the first one in the plane?
  pure logical function is_mirrored(points, weights, others, other_weights, axis, component, middle)
    real(wp), intent(in), dimension(:, :, :, :) :: points, others
    real(wp), intent(in), dimension(:, :, :) :: weights, other_weights
    integer, intent(in) :: axis, component
    real(wp), intent(in) :: middle
    real(wp), allocatable :: one(:, :), two(:, :)
    real(wp) :: slack
    integer :: c

    is_mirrored = all(shape(points) == shape(others))
    if (.not. is_mirrored) return
    slack = tolerance*maxval(abs(points))
    one = along(weights, axis)
    two = along(other_weights, axis)
    is_mirrored = all(abs(one - two(:, size(two, 2):1:-1)) <= tolerance)
    do c = 1, 3
      one = along(points(:, :, :, c), axis)
      two = along(others(:, :, :, c), axis)
      two = two(:, size(two, 2):1:-1)
      if (c == component) two = 2.0_wp*middle - two
      is_mirrored = is_mirrored .and. all(abs(one - two) <= slack)
    end do
  end function is_mirrored

  !> Has a tool the picture of one of its surfaces? Turned round along one axis, so that the sheet
  !! stays on its side.
  pure logical function has_picture(tool, surface, component, middle)
    type(tool_spec_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: component
    real(wp), intent(in) :: middle
    integer :: s, axis, n(3), m(3)

    has_picture = .false.
    n = [shape(surface%weights), 1]
    do s = 1, size(tool%surfaces)
      associate (other => tool%surfaces(s))
        m = [shape(other%weights), 1]
        do axis = 1, 2
          if (.not. all(n == m) .or. .not. is_even(surface%axes(axis)) .or. has_picture) cycle
          if (.not. may_mirror(surface, other, component, middle)) cycle
          has_picture = is_mirrored(reshape(surface%points, [n, 3]), reshape(surface%weights, n), &
                        reshape(other%points, [m, 3]), reshape(other%weights, m), axis, &
                        component, middle)
        end do
      end associate
    end do
  end function has_picture

  !> Do the bounds of two surfaces mirror each other?
  pure logical function may_mirror(surface, other, component, middle)
    type(nurbs_surface_t), intent(in) :: surface, other
    integer, intent(in) :: component
    real(wp), intent(in) :: middle
    real(wp) :: slack

    associate (x => surface%points(:, :, component), y => other%points(:, :, component))
      slack = tolerance*max(maxval(abs(surface%points)), maxval(abs(other%points)))
      may_mirror = abs(minval(x) + maxval(y) - 2.0_wp*middle) <= slack .and. &
                   abs(maxval(x) + minval(y) - 2.0_wp*middle) <= slack
    end associate
  end function may_mirror

  !> Loads, supports and velocities at the start against the plane.
  pure function mirrored_condition_problem(scene, component, axis, middle) result(reason)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: component, axis
    real(wp), intent(in) :: middle
    character(:), allocatable :: reason
    integer :: i

    reason = ""
    do i = 1, size(scene%boundaries)
      associate (spec => scene%boundaries(i))
        if (abs(spec%velocity(component)) > 0.0_wp .or. .not. &
            is_even_set(scene, spec%set, axis, component, middle)) reason = "a boundary is not"
      end associate
    end do
    do i = 1, size(scene%loads)
      associate (spec => scene%loads(i))
        if ((spec%kind /= "PRESSURE" .and. abs(spec%value(component)) > 0.0_wp) .or. &
            .not. is_even_set(scene, spec%set, axis, component, middle)) reason = "a load is not"
      end associate
    end do
    do i = 1, size(scene%contacts)
      if ((scene%contacts(i)%face + 1)/2 == axis) reason = "an edge of the blank is in contact"
    end do
    if (size(scene%initial_velocities) + size(scene%initial_states) > 0) &
      reason = "the state at the start may not be"
    if (size(scene%fields) > 0) reason = "a temperature or field variable may not be"
    if (size(scene%beads) > 0) reason = "a draw bead may not be"
  end function mirrored_condition_problem

  !> Does a set lie, with each of its boxes, evenly about the plane?
  pure logical function is_even_set(scene, set, axis, component, middle)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: set, axis, component
    real(wp), intent(in) :: middle
    type(box_spec_t), allocatable :: boxes(:)
    real(wp) :: span
    integer :: i

    is_even_set = .true.
    if (set == 0) return
    boxes = boxes_of(scene%sets(set))
    do i = 1, size(boxes)
      associate (box => boxes(i), knots => scene%blank%patches(1)%solid%axes(axis)%knots)
        span = knots(size(knots)) - knots(1)
        is_even_set = is_even_set .and. abs(box%lower(axis, 1) + box%upper(axis, 1) - knots(1) - &
                                            knots(size(knots))) <= tolerance*span
        if (box%from(component) > -huge(1.0_wp) .or. box%to(component) < huge(1.0_wp)) &
          is_even_set = is_even_set .and. abs(box%from(component) + box%to(component) &
                                              - 2.0_wp*middle) <= tolerance*abs(middle)
      end associate
    end do
  end function is_even_set

  !> Carry out the *REDUCE of a scene, if it has one. A scene that is not uniform is an error.
  subroutine reduce_scene(scene, errors)
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: reason, why
    integer :: component, c, n_found

    if (scene%reduction%component < 0) return
    component = 0
    n_found = 0
    why = ""
    do c = 1, 3
      if (scene%reduction%component > 0 .and. scene%reduction%component /= c) cycle
      reason = uniformity_problem(scene, c)
      if (reason == "") then
        component = c
        n_found = n_found + 1
      else if (why == "" .or. axis_along(scene, c) > 0) then
        why = reason
      end if
    end do
    if (n_found /= 1) then
      if (n_found > 1) why = "it is uniform in several directions"
      call add_error(errors, scene%reduction%origin, "a scene that is no strip repeated: "//why, &
                     "tools, blank and loads that are the same all along one coordinate, AXIS")
      return
    end if
    call cut_strip(scene, component, axis_along(scene, component), errors)
    scene%reduction%component = component
    if (.not. scene%width_ratio > 0.0_wp) return
    call hold_width(scene, component)
    ! Forces on tools, and masses that they move: the deck gives those of all the width.
    do c = 1, size(scene%motions)
      if (.not. scene%motions(c)%is_force) cycle
      scene%motions(c)%vector = scene%motions(c)%vector/scene%width_ratio
      scene%motions(c)%mass = scene%motions(c)%mass/scene%width_ratio
    end do
  end subroutine reduce_scene

  !> Leave one element of the blank; the deck's forces become those of all the width by
  !! `width_ratio`.
  subroutine cut_strip(scene, component, axis, errors)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: component, axis
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: points(:, :, :, :), weights(:, :, :)
    real(wp) :: full, width, low
    integer :: n(3), i, at(3)
    logical :: is_falling

    associate (solid => scene%blank%patches(1)%solid)
      low = minval(solid%points(:, :, :, component))
      full = maxval(solid%points(:, :, :, component)) - low
      at = 1
      at(axis) = 2
      is_falling = solid%points(at(1), at(2), at(3), component) < &
                   solid%points(1, 1, 1, component)
      associate (knots => solid%axes(axis)%knots)
        width = full/count(knots(2:) > knots(:size(knots) - 1))
        if (scene%reduction%width > 0.0_wp) width = scene%reduction%width
        if (width > full) then
          call add_error(errors, scene%reduction%origin, "WIDTH="//to_text(width), &
                         "at most the width of the blank, "//to_text(full))
          scene%width_ratio = 0.0_wp
          return
        end if
        solid%axes(axis)%knots = [spread(knots(1), 1, 2), spread(knots(size(knots)), 1, 2)]
      end associate
      solid%axes(axis)%degree = 1
      solid%axes(axis)%n_basis = 2
      n = shape(solid%weights)
      n(axis) = 2
      points = solid%points(:n(1), :n(2), :n(3), :)
      weights = solid%weights(:n(1), :n(2), :n(3))
      do i = 1, 2
        associate (x => low + width*merge(2 - i, i - 1, is_falling))
          select case (axis)
          case (1)
            points(i, :, :, :) = solid%points(1, :n(2), :n(3), :)
            points(i, :, :, component) = x
          case default
            points(:, i, :, :) = solid%points(:n(1), 1, :n(3), :)
            points(:, i, :, component) = x
          end select
        end associate
      end do
      call move_alloc(points, solid%points)
      call move_alloc(weights, solid%weights)
    end associate
    scene%blank%patches(1)%n_points(axis) = 1
    scene%blank%patches(1)%n_parts(axis) = 1
    scene%blank%n_samples(axis) = min(scene%blank%n_samples(axis), 1)
    scene%reduction%axis = axis
    scene%width_ratio = full/width
  end subroutine cut_strip

  !> No motion across the strip, in no control point. It comes last, so it holds all of them.
  subroutine hold_width(scene, component)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: component
    type(set_spec_t) :: all_points
    type(boundary_spec_t) :: support
    integer :: c

    all_points%name = "PLANE STRAIN"
    all_points%origin = scene%reduction%origin
    allocate (all_points%lower(3, 1), all_points%upper(3, 1))
    do c = 1, 3
      associate (knots => scene%blank%patches(1)%solid%axes(c)%knots)
        all_points%lower(c, 1) = knots(1)
        all_points%upper(c, 1) = knots(size(knots))
      end associate
    end do
    support%origin = scene%reduction%origin
    support%set = size(scene%sets) + 1
    support%is_prescribed(component) = .true.
    scene%sets = [scene%sets, all_points]
    scene%boundaries = [scene%boundaries, support]
  end subroutine hold_width

end module scene_reduction