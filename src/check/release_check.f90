!> Steps in which a part is released from its tools, and springs back: tools that still hold it, no
!! damping, tools removed from under others that still press; relaxation that a stroke or an
!! amplitude keeps from coming to rest.
module release_check
  use kinds, only: wp
  use text, only: to_text, rounded_text
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t, step_spec_t
  use model, only: model_t
  use model_setup, only: last_change
  use contact_effect, only: contact_view_t, contact_pairs
  use sweep, only: path_t, path_of
  use stroke_check, only: stroke_t, stroke_of
  use travel, only: time_from, force_motion
  implicit none
  private

  public :: check_release

contains

  !> Warn of what keeps a part from springing back to rest.
  subroutine check_release(scene, model, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in), target :: model
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    type(contact_view_t), allocatable :: pairs(:)
    type(path_t) :: paths(size(scene%tools))
    logical, allocatable :: acts(:, :)        !! pairs in steps
    real(wp), allocatable :: travel(:, :, :)  !! of tools, shape (3, n_tools, n_steps) [length]
    integer :: i, step, n

    n = 1 + size(scene%later_steps)
    pairs = [contact_pairs(model%forces), contact_pairs(model%later_forces)]
    if (size(pairs) == 0) return
    allocate (acts(size(pairs), n), travel(3, size(scene%tools), n))
    do i = 1, size(scene%tools)
      paths(i) = path_of(model, i)
    end do
    do step = 1, n
      acts(:, step) = [(pairs(i)%pair%first_step <= step .and. pairs(i)%pair%last_step >= step, &
                        i=1, size(pairs))]
      do i = 1, size(scene%tools)
        travel(:, i, step) = travel_in(paths(i), step)
      end do
    end do
    travel = merge(travel, 0.0_wp, abs(travel) > thickness)
    do step = 1, n
      call check_relaxation(scene, step, pairs, acts, travel, errors)
      if (step == 1) cycle
      call check_held(scene, step, pairs, acts, travel, errors)
      call check_damping(scene, step, acts, errors)
      call check_counterparts(scene, step, pairs, acts, travel, errors)
    end do
  end subroutine check_release

  !> Largest displacement of a tool in a step, along each coordinate.
  pure function travel_in(path, step) result(travel)
    type(path_t), intent(in) :: path
    integer, intent(in) :: step
    real(wp) :: travel(3)
    type(stroke_t) :: stroke
    integer :: c

    do c = 1, 3
      stroke = stroke_of(path, step, c)
      associate (way => stroke%values - stroke%values(1))
        travel(c) = way(maxloc(abs(way), 1))
      end associate
    end do
  end function travel_in

  !> Warn of a step with relaxation that a tool forms the blank in, or whose amplitudes last longer.
  subroutine check_relaxation(scene, step, pairs, acts, travel, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(contact_view_t), intent(in) :: pairs(:)
    logical, intent(in) :: acts(:, :)
    real(wp), intent(in) :: travel(:, :, :)
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: round_off = 1.0e-12_wp
    type(step_spec_t) :: spec
    real(wp) :: way(3), before(3), last
    integer :: i

    spec = scene%step
    if (step > 1) spec = scene%later_steps(step - 1)%step
    if (.not. spec%has_relaxation) return
    last = max(last_change(scene, step, .false.), last_change(scene, step, .true.) &
               - (time_from(scene, 1) - time_from(scene, step)))
    if (last > spec%duration*(1.0_wp + round_off)) call add_warning(errors, spec%origin, &
      "a step with dynamic relaxation that ends at "//rounded_text(spec%duration)//", before "// &
      "the last time of an amplitude that begins in it, "//rounded_text(last)// &
      ": relaxation does not end before that", "a longer step or a shorter amplitude")
    do i = 1, size(pairs)
      if (.not. acts(i, step)) cycle
      ! One that a force brought may leave with a motion.
      if (step > 1 .and. force_motion(scene, pairs(i)%pair%tool) > 0) cycle
      way = travel(:, pairs(i)%pair%tool, step)
      before = sum(travel(:, pairs(i)%pair%tool, :step - 1), dim=2)
      ! A tool that goes back where it came from releases the part.
      if (.not. any(abs(way) > 0.0_wp) .or. dot_product(way, before) < 0.0_wp) cycle
      call add_warning(errors, spec%origin, "a step with dynamic relaxation in which the tool '"// &
                       scene%tools(pairs(i)%pair%tool)%name//"' moves by "// &
                       rounded_text(norm2(way)), "*DYNAMIC RELAXATION in a step of its own, "// &
                       "after the stroke")
      return
    end do
  end subroutine check_relaxation

  !> Warn of a step that relaxes a part under tools that have formed it and that stay to the end, on
  !! both faces or pressed by a force. One that is left on one face may be a support.
  subroutine check_held(scene, step, pairs, acts, travel, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(contact_view_t), intent(in) :: pairs(:)
    logical, intent(in) :: acts(:, :)
    real(wp), intent(in) :: travel(:, :, :)
    type(error_list_t), intent(inout) :: errors
    logical :: is_left(size(pairs))
    integer :: i, k

    if (.not. scene%later_steps(step - 1)%step%has_relaxation .or. is_loaded(scene, step)) return
    is_left = acts(:, step - 1) .and. acts(:, size(acts, 2))
    if (any(acts(:, step - 1) .and. acts(:, step) .and. .not. is_left) .or. &
        .not. any(is_left)) return
    i = findloc(is_left, .true., dim=1)
    if (.not. any([(is_left(k) .and. (pairs(k)%pair%face /= pairs(i)%pair%face &
                    .or. force_motion(scene, pairs(k)%pair%tool) > 0), k=1, size(pairs))])) return
    if (any(abs(travel(:, :, step:)) > 0.0_wp) .or. &
        .not. any(abs(travel(:, :, :step - 1)) > 0.0_wp)) return
    call add_warning(errors, scene%later_steps(step - 1)%step%origin, "a step with dynamic "// &
                     "relaxation in which "//names_of(scene, pairs, is_left)//" still touch "// &
                     "the blank and none moves: the part cannot spring back", &
                     "*MODEL CHANGE, REMOVE of the tools, and supports that hold rigid motion")
  end subroutine check_held

  !> Names of the tools of some pairs.
  function names_of(scene, pairs, is_meant) result(names)
    type(scene_t), intent(in) :: scene
    type(contact_view_t), intent(in) :: pairs(:)
    logical, intent(in) :: is_meant(size(pairs))
    character(:), allocatable :: names
    integer :: i

    names = ""
    do i = 1, size(pairs)
      associate (name => "'"//scene%tools(pairs(i)%pair%tool)%name//"'")
        if (is_meant(i) .and. index(names, name) == 0) names = names//", "//name
      end associate
    end do
    names = names(3:)
  end function names_of

  !> Warn of a part that is released from all tools and never damped.
  subroutine check_damping(scene, step, acts, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    logical, intent(in) :: acts(:, :)
    type(error_list_t), intent(inout) :: errors
    integer :: i

    if (.not. any(acts(:, step - 1)) .or. any(acts(:, step:))) return
    if (any([(is_damped(scene%later_steps(i)%step), i=step - 1, size(scene%later_steps))])) return
    call add_warning(errors, scene%later_steps(step - 1)%step%origin, "a step after contact "// &
                     "without damping: the part that is released vibrates", &
                     "*STATIC in place of its *DYNAMIC, or *DYNAMIC RELAXATION in it")
  end subroutine check_damping

  pure logical function is_damped(step)
    type(step_spec_t), intent(in) :: step

    is_damped = step%is_static .or. step%has_relaxation .or. step%alpha > 0.0_wp
  end function is_damped

  !> Warn of a tool that continues its stroke where the tools of the other face have been removed,
  !! and nothing else holds the blank against it.
  subroutine check_counterparts(scene, step, pairs, acts, travel, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(contact_view_t), intent(in) :: pairs(:)
    logical, intent(in) :: acts(:, :)
    real(wp), intent(in) :: travel(:, :, :)
    type(error_list_t), intent(inout) :: errors
    integer :: i, j, c, tool

    if (is_loaded(scene, step)) return
    do i = 1, size(pairs)
      tool = pairs(i)%pair%tool
      if (.not. (acts(i, step) .and. acts(i, step - 1))) cycle
      c = maxloc(abs(travel(:, tool, step)), 1)
      if (.not. travel(c, tool, step)*travel(c, tool, step - 1) > 0.0_wp) cycle
      if (any([(scene%boundaries(j)%is_prescribed(c) .and. scene%boundaries(j)%first_step <= step &
                .and. scene%boundaries(j)%last_step >= step, j=1, size(scene%boundaries))])) cycle
      if (any([(acts(j, step) .and. pairs(j)%pair%face /= pairs(i)%pair%face, &
                j=1, size(pairs))])) cycle
      j = findloc([(acts(j, step - 1) .and. .not. acts(j, step) .and. &
                    pairs(j)%pair%face /= pairs(i)%pair%face, j=1, size(pairs))], .true., dim=1)
      if (j == 0) cycle
      call add_warning(errors, scene%later_steps(step - 1)%step%origin, "the tool '"// &
        scene%tools(tool)%name//"', which still moves into the blank in step "//to_text(step)// &
        ", though '"//scene%tools(pairs(j)%pair%tool)%name//"' on the other face is removed", &
        "a *TOOL MOTION that ends or withdraws the tool, or its removal too")
      return
    end do
  end subroutine check_counterparts

  !> Do loads act in a step?
  pure logical function is_loaded(scene, step)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step

    is_loaded = any(scene%loads%first_step <= step .and. scene%loads%last_step >= step)
  end function is_loaded

end module release_check
