!> What the steps of a scene lack: motion, friction under a holder, supports of a released part,
!! forces that reach the sheet.
module step_check
  use kinds, only: wp
  use text, only: rounded_text, to_text
  use input_errors, only: origin_t, error_list_t, add_warning, has_error_at
  use linear_algebra, only: eigenvalues, rigid_row
  use scene, only: scene_t, boundary_spec_t, is_held
  use model, only: model_t
  use tool_drive, only: tool_drive_t
  use support_extent, only: extent_t, extent_of, is_across, round_off, find_box
  use travel, only: force_motion, is_formed_by_strokes
  use reach_check, only: encounter_t
  implicit none
  private

  public :: check_motion, check_friction, check_forces, check_supports

  character(13), parameter :: motions(6) = [character(13) :: "motion in x", "motion in y", &
    "motion in z", "rotation in x", "rotation in y", "rotation in z"]

  real(wp), parameter :: point_like = 3.0_wp  !! width of a support that counts as a point, of the
                                              !! thickness

contains

  !> Warn of a scene in which nothing moves or presses, or the blank cannot move.
  subroutine check_motion(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    logical :: is_fixed(3)
    type(extent_t) :: extent
    integer :: i

    is_fixed = .false.
    do i = 1, size(scene%boundaries)
      associate (boundary => scene%boundaries(i))
        if (boundary%first_step > 1 .or. boundary%last_step <= size(scene%later_steps) .or. &
            any(abs(boundary%velocity) > 0.0_wp)) cycle
        extent = extent_of(scene, boundary%set)
        if (.not. extent%is_all .or. all(is_fixed)) cycle
        is_fixed = is_fixed .or. boundary%is_prescribed
        if (all(is_fixed)) call add_warning(errors, boundary%origin, "all of the blank held in "// &
          "x, y and z, so that nothing can form it", "a set of fewer points or components")
      end associate
    end do
    if (size(scene%tools) == 0 .or. .not. is_formed_by_strokes(scene)) return
    do i = 1, size(scene%motions)
      if (any(abs(scene%motions(i)%vector) > 0.0_wp) .and. .not. scene%motions(i)%is_force) return
    end do
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
  subroutine check_forces(scene, model, encounters, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    real(wp) :: mass, speed
    integer :: i, k

    do i = 1, size(encounters)
      k = force_motion(scene, encounters(i)%tool)
      if (k == 0 .or. has_error_at(errors, encounters(i)%origin)) cycle
      if (has_error_at(errors, scene%tools(encounters(i)%tool)%origin)) cycle
      associate (spec => scene%motions(k), tool => scene%tools(encounters(i)%tool), &
                 way => encounters(i)%way)
        if (spec%step > 1) cycle
        if (encounters(i)%is_beside) then
          call add_warning(errors, spec%origin, "a force that does not press the tool '"// &
                           tool%name//"' on the sheet: on its way it passes beside the blank", &
                           "a tool that lies above the blank")
          cycle
        end if
        mass = mass_on(model, encounters(i)%tool)
        speed = sqrt(2.0_wp*way*norm2(spec%vector)/mass)
        if (way > thickness .and. .not. spec%mass > 0.0_wp) call add_warning(errors, &
          spec%origin, "a force on the tool '"//tool%name//"', which starts "// &
          rounded_text(way)//" away from the sheet and strikes it at "//rounded_text(speed)// &
          ", with the mass that is chosen for it, "//rounded_text(model%width_ratio*mass), &
          "a tool that lies on the sheet, *TOOL PLACEMENT, or MASS")
        if (2.0_wp*way > speed*scene%step%duration) call add_warning(errors, spec%origin, &
          "a force that moves the tool '"//tool%name//"' of mass "// &
          rounded_text(model%width_ratio*mass)//" by "//rounded_text(way)//" to the sheet in "// &
          rounded_text(2.0_wp*way/speed)//", longer than the step", &
          "a tool that lies on the sheet, or *TOOL PLACEMENT")
      end associate
    end do
  end subroutine check_forces

  !> Mass of a tool that a force moves from the start, given or chosen.
  real(wp) function mass_on(model, tool) result(mass)
    type(model_t), intent(in) :: model
    integer, intent(in) :: tool
    integer :: i

    mass = huge(1.0_wp)
    do i = 1, size(model%supports)
      select type (item => model%supports(i)%item)
      type is (tool_drive_t)
        if (item%tool == tool) mass = item%mass
      end select
    end do
  end function mass_on

  !> Warn of steps without contact, after others with it, in which supports leave rigid motion free
  !! or hold more than rigid motion.
  subroutine check_supports(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: step

    if (size(scene%contacts) == 0) return
    do step = 2, 1 + size(scene%later_steps)
      if (any(scene%contacts%first_step <= step .and. scene%contacts%last_step >= step)) cycle
      if (.not. any(scene%contacts%first_step < step)) cycle
      ! What a static step finds free it holds, and no load moves it.
      if (.not. scene%later_steps(step - 1)%step%is_static .or. &
          any(scene%loads%first_step <= step .and. scene%loads%last_step >= step)) &
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
    real(wp), parameter :: nothing = 1.0e-12_wp
    real(wp) :: matrix(6, 6), added(6, 6), values(6), low(3), high(3), centre(3), size_of
    character(:), allocatable :: names
    integer :: i, n_free

    call find_box(scene, low, high)
    centre = 0.5_wp*(low + high)
    size_of = norm2(high - low)
    matrix = 0.0_wp
    do i = 1, size(scene%boundaries)
      if (.not. acts(scene%boundaries(i), step)) cycle
      added = 0.0_wp
      call add_constraints(scene, scene%boundaries(i), centre, size_of, added)
      ! Each counts alike, however many points it holds.
      matrix = matrix + added/max(maxval(abs(added)), tiny(1.0_wp))
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
    if (names == "") names = "a combination of motion and rotation"
    if (names == "a combination of motion and rotation" .and. n_free > 1) &
      names = to_text(n_free)//" combinations of motion and rotation"
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
                row = rigid_row(arm, c)
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

  !> Supports of a released part that keep it from springing back: wide ones that are no plane of
  !! symmetry, a second plane across the same coordinate, and all points in more than one direction
  !! or through the thickness.
  subroutine check_clamps(scene, step, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(error_list_t), intent(inout) :: errors
    logical :: is_plane(3), is_clamp
    real(wp) :: level(3)
    type(extent_t) :: extent
    integer :: i, c

    is_plane = .false.
    level = huge(1.0_wp)
    do i = 1, size(scene%boundaries)
      if (.not. acts(scene%boundaries(i), step)) cycle
      extent = extent_of(scene, scene%boundaries(i)%set)
      if (extent%is_all) is_plane = is_plane .or. scene%boundaries(i)%is_prescribed
    end do
    do i = 1, size(scene%boundaries)
      associate (boundary => scene%boundaries(i))
        if (.not. acts(boundary, step)) cycle
        extent = extent_of(scene, boundary%set)
        do c = 1, 3
          if (.not. boundary%is_prescribed(c)) cycle
          if (extent%is_all) then
            is_clamp = count(is_plane) > 1 .or. c == extent%across
          else if (is_across(extent, c)) then
            is_clamp = level(c) < huge(1.0_wp) .and. abs(extent%low(c) - level(c)) > &
                       round_off*extent%size
            level(c) = extent%low(c)
          else
            is_clamp = maxval(extent%high - extent%low, mask=.not. is_plane) > &
                       point_like*extent%thickness
          end if
          if (.not. is_clamp) cycle
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

end module step_check
