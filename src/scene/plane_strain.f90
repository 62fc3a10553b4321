!> A uniform scene as a strip of it: one element wide, without motion across the width.
!!
!! The strip is linear across, with one point of integration, contact and pressure there: its two
!! sides then move alike, and nothing that is uniform across is lost. A kernel of its own sees one
!! side (plane_setup): no strain holds both together, so nothing may tell them apart.
module plane_strain
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: to_text
  use scene, only: scene_t, set_spec_t, boundary_spec_t
  use scene_symmetry, only: axis_along, uniformity_problem
  implicit none
  private

  public :: reduce_scene

contains

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
    call share_tool_forces(scene)
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

  !> Forces on tools, and masses that they move: the deck gives those of all the width.
  pure subroutine share_tool_forces(scene)
    type(scene_t), intent(inout) :: scene
    integer :: i

    do i = 1, size(scene%motions)
      if (.not. scene%motions(i)%is_force) cycle
      scene%motions(i)%vector = scene%motions(i)%vector/scene%width_ratio
      scene%motions(i)%mass = scene%motions(i)%mass/scene%width_ratio
    end do
  end subroutine share_tool_forces

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

end module plane_strain
