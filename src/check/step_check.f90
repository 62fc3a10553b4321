!> What the steps of a scene lack: motion, friction under a holder, supports of a released part,
!! forces that reach the sheet.
module step_check
  use kinds, only: wp
  use text, only: rounded_text, to_text
  use input_errors, only: origin_t, error_list_t, add_warning
  use linear_algebra, only: eigenvalues
  use nurbs_solid, only: nurbs_solid_t
  use scene, only: scene_t, boundary_spec_t, is_held
  use travel, only: force_motion
  use reach_check, only: meeting_t
  implicit none
  private

  public :: check_motion, check_friction, check_forces, check_supports

  character(13), parameter :: motions(6) = [character(13) :: "motion in x", "motion in y", &
    "motion in z", "rotation in x", "rotation in y", "rotation in z"]

contains

  !> Warn of a scene in which nothing moves or presses.
  subroutine check_motion(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i

    if (size(scene%tools) == 0 .or. size(scene%loads) + size(scene%initial_velocities) > 0) return
    if (any(scene%beads%restraint + scene%beads%hold_down > 0.0_wp)) return
    do i = 1, size(scene%boundaries)
      if (any(abs(scene%boundaries(i)%velocity) > 0.0_wp)) return
    end do
    do i = 1, size(scene%motions)
      if (any(abs(scene%motions(i)%vector) > 0.0_wp) .and. .not. scene%motions(i)%is_force) return
    end do
    if (size(scene%motions) > 0) then
      ! A force may be all that forms, but not one that only holds the sheet on another tool.
      if (size(scene%tools) == count([(force_motion(scene, i) > 0, i=1, size(scene%tools))])) return
    end if
    call add_warning(errors, scene%tools(1)%origin, "no tool that moves and no load", &
                     "a *TOOL MOTION, such as that of a punch")
  end subroutine check_motion

  !> Warn of a holder without friction: nothing but bending restrains the sheet then.
  subroutine check_friction(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(scene%contacts)
      associate (pair => scene%contacts(i))
        if (force_motion(scene, pair%tool) == 0 .or. pair%friction > 0.0_wp) cycle
        if (size(scene%tools) < 3) cycle          ! not a holder but the tool that forms
        call add_warning(errors, pair%origin, "a pair without friction of the tool '"// &
                         scene%tools(pair%tool)%name//"', which a force presses on the sheet", &
                         "FRICTION of about 0.05 to 0.2, which restrains the sheet")
      end associate
    end do
  end subroutine check_friction

  !> Warn of forces on tools that never arrive at the sheet.
  subroutine check_forces(scene, meetings, errors)
    type(scene_t), intent(in) :: scene
    type(meeting_t), intent(in) :: meetings(:)
    type(error_list_t), intent(inout) :: errors
    real(wp) :: time, duration
    integer :: i, k

    do i = 1, size(meetings)
      k = force_motion(scene, meetings(i)%tool)
      if (k == 0) cycle
      associate (spec => scene%motions(k), tool => scene%tools(meetings(i)%tool), &
                 way => meetings(i)%way)
        if (spec%step > 1) cycle
        if (.not. meetings(i)%approach%has_touched) then
          call add_warning(errors, spec%origin, "a force that does not press the tool '"// &
                           tool%name//"' on the sheet: on its way it passes beside the blank", &
                           "a tool that lies above the blank")
          cycle
        end if
        duration = scene%step%duration
        time = sqrt(2.0_wp*way*spec%mass/norm2(spec%vector))
        if (time > duration) call add_warning(errors, spec%origin, "a force that moves the "// &
          "tool '"//tool%name//"' of mass "//rounded_text(spec%mass)//" by "// &
          rounded_text(way)//" to the sheet in "//rounded_text(time)// &
          ", longer than the step", "a tool that lies on the sheet, or *TOOL PLACEMENT")
      end associate
    end do
  end subroutine check_forces

  !> Warn of steps without contact, after others with it, in which supports leave rigid motion free
  !! or hold more than rigid motion.
  subroutine check_supports(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: step

    if (size(scene%contacts) == 0) return
    do step = 2, 1 + size(scene%later_steps)
      if (any(scene%contacts%first_step <= step .and. scene%contacts%last_step >= step)) cycle
      call check_free_motion(scene, step, scene%later_steps(step - 1)%step%origin, errors)
      call check_clamps(scene, step, errors)
    end do
  end subroutine check_supports

  !> The rank of what supports prescribe of the six rigid motions.
  subroutine check_free_motion(scene, step, origin, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(origin_t), intent(in) :: origin
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: nothing = 1.0e-9_wp
    real(wp) :: matrix(6, 6), values(6), centre(3), size_of
    character(:), allocatable :: names
    integer :: i, n_free

    call find_box(scene, centre, size_of)
    matrix = 0.0_wp
    do i = 1, size(scene%boundaries)
      if (.not. acts(scene%boundaries(i), step)) cycle
      call add_constraints(scene, scene%boundaries(i), centre, size_of, matrix)
    end do
    if (scene%reduction%component > 0) then   ! a strip has no motion across it
      do i = 1, 6
        if (i == scene%reduction%component .or. &
            (i > 3 .and. i - 3 /= scene%reduction%component)) matrix(i, i) = matrix(i, i) + 1.0_wp
      end do
    end if
    values = eigenvalues(matrix)
    n_free = count(values <= nothing*max(maxval(values), tiny(1.0_wp)))
    if (maxval(values) <= 0.0_wp) n_free = 6
    if (n_free == 0) return
    names = ""
    do i = 1, 6
      if (matrix(i, i) > nothing*max(maxval(values), tiny(1.0_wp))) cycle
      if (names /= "") names = names//", "
      names = names//trim(motions(i))
    end do
    if (names == "") names = to_text(n_free)//" combinations of motion and rotation"
    call add_warning(errors, origin, "a step without contact whose supports leave free: "//names, &
                     "supports that hold the rigid motion of the part and no more")
  end subroutine check_free_motion

  pure logical function acts(boundary, step)
    type(boundary_spec_t), intent(in) :: boundary
    integer, intent(in) :: step

    acts = boundary%first_step <= step .and. boundary%last_step >= step
  end function acts

  !> Rows of prescribed components, squared into the matrix of the six rigid motions about the
  !! centre; lengths by the size of the part.
  subroutine add_constraints(scene, boundary, centre, size_of, matrix)
    type(scene_t), intent(in) :: scene
    type(boundary_spec_t), intent(in) :: boundary
    real(wp), intent(in) :: centre(3), size_of
    real(wp), intent(inout) :: matrix(6, 6)
    logical, allocatable :: is_in(:, :, :)
    real(wp) :: row(6), arm(3)
    integer :: p, i, j, k, c, l

    do p = 1, size(scene%blank%patches)
      associate (solid => scene%blank%patches(p)%solid)
        is_in = is_held(solid, scene%sets(boundary%set), p)
        do k = 1, size(is_in, 3)
          do j = 1, size(is_in, 2)
            do i = 1, size(is_in, 1)
              if (.not. is_in(i, j, k)) cycle
              arm = (solid%points(i, j, k, :) - centre)/size_of
              do c = 1, 3
                if (.not. boundary%is_prescribed(c)) cycle
                ! Component c of a + w x arm.
                row = 0.0_wp
                row(c) = 1.0_wp
                l = mod(c, 3) + 1
                row(3 + l) = arm(mod(l, 3) + 1)
                row(3 + mod(l, 3) + 1) = -arm(l)
                do l = 1, 6
                  matrix(:, l) = matrix(:, l) + row(l)*row
                end do
              end do
            end do
          end do
        end do
      end associate
    end do
  end subroutine add_constraints

  !> Middle and diagonal of the box around the blank.
  subroutine find_box(scene, centre, size_of)
    type(scene_t), intent(in) :: scene
    real(wp), intent(out) :: centre(3), size_of
    real(wp) :: low(3), high(3)
    integer :: p, c

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do p = 1, size(scene%blank%patches)
      do c = 1, 3
        low(c) = min(low(c), minval(scene%blank%patches(p)%solid%points(:, :, :, c)))
        high(c) = max(high(c), maxval(scene%blank%patches(p)%solid%points(:, :, :, c)))
      end do
    end do
    centre = 0.5_wp*(low + high)
    size_of = norm2(high - low)
  end subroutine find_box

  !> Supports of a released part that are wide and no plane of symmetry keep it from springing back.
  subroutine check_clamps(scene, step, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(error_list_t), intent(inout) :: errors
    logical :: is_plane(3)
    integer :: i, c

    is_plane = .false.
    do i = 1, size(scene%boundaries)
      if (acts(scene%boundaries(i), step) .and. holds_all(scene, scene%boundaries(i)%set)) &
        is_plane = is_plane .or. scene%boundaries(i)%is_prescribed
    end do
    do i = 1, size(scene%boundaries)
      associate (boundary => scene%boundaries(i))
        if (.not. acts(boundary, step)) cycle
        do c = 1, 3
          if (.not. boundary%is_prescribed(c)) cycle
          if (.not. is_clamp(scene, boundary%set, c, is_plane)) cycle
          call add_warning(errors, boundary%origin, "component "//to_text(c)//" of the set "// &
                           scene%sets(boundary%set)%name//", which is held while the part "// &
                           "is released, so that it cannot spring back there", &
                           "supports that hold rigid motion alone: a plane of symmetry, or "// &
                           "single points")
          exit
        end do
      end associate
    end do
  end subroutine check_clamps

  !> Does a set contain all control points?
  pure logical function holds_all(scene, set)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: set
    integer :: p

    holds_all = all([(all(is_held(scene%blank%patches(p)%solid, scene%sets(set), p)), &
                      p=1, size(scene%blank%patches))])
  end function holds_all

  !> Is the set wider than a few thicknesses, and neither a plane across the component nor all of
  !! the blank? Directions in which nothing moves do not count.
  logical function is_clamp(scene, set, c, is_plane)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: set, c
    logical, intent(in) :: is_plane(3)         !! directions in which no point moves
    real(wp), parameter :: point_like = 3.0_wp, level = 1.0e-6_wp
    logical, allocatable :: is_in(:, :, :)
    real(wp) :: low(3), high(3), thickness, centre(3), size_of
    logical :: has_face
    integer :: p, d

    call find_box(scene, centre, size_of)
    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    has_face = .false.
    thickness = 0.0_wp
    do p = 1, size(scene%blank%patches)
      associate (x => scene%blank%patches(p)%solid%points)
        is_in = is_held(scene%blank%patches(p)%solid, scene%sets(set), p)
        has_face = has_face .or. all(is_in(1, :, :)) .or. all(is_in(size(is_in, 1), :, :)) .or. &
                   all(is_in(:, 1, :)) .or. all(is_in(:, size(is_in, 2), :))
        thickness = max(thickness, norm2(x(1, 1, size(x, 3), :) - x(1, 1, 1, :)))
        do d = 1, 3
          low(d) = min(low(d), minval(x(:, :, :, d), mask=is_in))
          high(d) = max(high(d), maxval(x(:, :, :, d), mask=is_in))
        end do
      end associate
    end do
    is_clamp = maxval(high - low, mask=.not. is_plane) > point_like*thickness .and. &
               .not. holds_all(scene, set) .and. &
               .not. (has_face .and. high(c) - low(c) <= level*size_of)
  end function is_clamp

end module step_check
