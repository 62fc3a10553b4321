!> *AMPLITUDE, *TOOL MOTION and *TOOL FORCE.
module motion_keywords
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: to_text, counted
  use scene, only: scene_t, curve_spec_t, motion_spec_t
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_real, &
                          is_option_given, field_real, all_numbers, deck_context_t, &
                          resolve_option, step_of, field_vector
  implicit none
  private

  public :: read_amplitudes, read_tool_motions, find_amplitude

contains

  !> Fill the list of curves, one for each *AMPLITUDE in the order of the deck.
  subroutine read_amplitudes(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, "AMPLITUDE")
    allocate (scene%curves(size(found)))
    do i = 1, size(found)
      call read_curve(deck%records(found(i)), scene%curves(i), errors)
    end do
  end subroutine read_amplitudes

  subroutine read_curve(record, curve, errors)
    type(record_t), intent(in) :: record
    type(curve_spec_t), intent(inout) :: curve
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: numbers(:)
    integer :: i

    curve%origin = record%origin
    curve%name = option_text(record, "NAME")
    curve%is_total = option_text(record, "TIME") == "TOTAL TIME"
    curve%is_smooth = option_text(record, "DEFINITION") == "SMOOTH STEP"
    allocate (curve%times(0), curve%values(0))
    if (.not. record%is_valid) return
    numbers = all_numbers(record)
    if (mod(size(numbers), 2) == 1) then
      call add_error(errors, record%origin, counted(size(numbers), "number"), &
                     "pairs of time and value, up to the next line with one `*` (a line "// &
                     "that begins with `**` is a comment)")
      return
    end if
    curve%times = numbers(1::2)
    curve%values = numbers(2::2)
    do i = 2, size(curve%times)
      if (curve%times(i) > curve%times(i - 1)) cycle
      call add_error(errors, record%origin, "the time "//to_text(curve%times(i))//" after "// &
                     to_text(curve%times(i - 1)), "times that rise")
      exit
    end do
  end subroutine read_curve

  !> Place of the curve that the AMPLITUDE option names; 0 if there is no such option.
  subroutine find_amplitude(record, context, curve, errors)
    type(record_t), intent(in) :: record
    type(deck_context_t), intent(inout) :: context
    integer, intent(out) :: curve
    type(error_list_t), intent(inout) :: errors

    call resolve_option(record, "AMPLITUDE", context%names%curves, "*AMPLITUDE", curve, errors)
  end subroutine find_amplitude

  !> Fill the list of motions, one for each *TOOL MOTION and *TOOL FORCE.
  subroutine read_tool_motions(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    type(motion_spec_t) :: motion, none
    integer :: i, n_motions

    allocate (scene%motions(0))
    found = find_records(deck, "TOOL MOTION")
    n_motions = size(found)
    found = [found, find_records(deck, "TOOL FORCE")]
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        motion = none
        call resolve_option(record, "TOOL", context%names%tools, "*TOOL", motion%tool, errors)
        if (motion%tool == 0) cycle
        motion%origin = record%origin
        motion%step = step_of(record%step)
        motion%is_force = i > n_motions
        if (record%is_valid) then
          call find_amplitude(record, context, motion%curve, errors)
          motion%vector = field_vector(record, 1, 1)
          if (motion%is_force) call read_force(record, motion, errors)
          if (.not. motion%is_force) call read_motion(record, scene%curves, motion, errors)
        end if
        call check_second(scene%tools(motion%tool)%name, scene%motions, motion, errors)
        scene%motions = [scene%motions, motion]
      end associate
    end do
  end subroutine read_tool_motions

  !> Motions of one tool in one step add up, but not along one component; a force stands alone.
  subroutine check_second(name, motions, motion, errors)
    character(*), intent(in) :: name              !! of the tool
    type(motion_spec_t), intent(in) :: motions(:)
    type(motion_spec_t), intent(in) :: motion
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(motions)
      if (motions(i)%tool /= motion%tool .or. motions(i)%step /= motion%step) cycle
      if (.not. motion%is_force .and. .not. motions(i)%is_force) then
        if (motions(i)%is_rotation .neqv. motion%is_rotation) cycle
        if (.not. motion%is_rotation .and. &
            all(min(abs(motions(i)%vector), abs(motion%vector)) <= 0.0_wp)) cycle
      end if
      call add_error(errors, motion%origin, "a second motion of the tool "//name, &
                     "one *TOOL MOTION a component and one turn, or one *TOOL FORCE, a tool "// &
                     "and step")
      return
    end do
  end subroutine check_second

  !> A force, along which the tool is free.
  subroutine read_force(record, motion, errors)
    type(record_t), intent(in) :: record
    type(motion_spec_t), intent(inout) :: motion
    type(error_list_t), intent(inout) :: errors

    motion%mass = option_real(record, "MASS")
    motion%damping = option_real(record, "DAMPING")
    if (.not. any(abs(motion%vector) > 0.0_wp)) &
      call add_error(errors, record%origin, "a force without direction", "a force that is not 0")
  end subroutine read_force

  subroutine read_motion(record, curves, motion, errors)
    type(record_t), intent(in) :: record
    type(curve_spec_t), intent(in) :: curves(:)
    type(motion_spec_t), intent(inout) :: motion
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: type

    type = option_text(record, "TYPE")
    motion%is_displacement = any(type == [character(12) :: "DISPLACEMENT", "ROTATION"])
    motion%is_rotation = any(type == [character(16) :: "ROTATION", "ANGULAR VELOCITY"])
    if (motion%is_rotation) call read_axis(record, motion, errors)
    if (.not. motion%is_displacement) return
    if (.not. is_option_given(record, "AMPLITUDE")) then
      call add_error(errors, record%origin, "TYPE="//type//" without AMPLITUDE", &
                     "an *AMPLITUDE that starts at 0")
    else if (motion%curve > 0) then
      associate (curve => curves(motion%curve))
        if (size(curve%values) == 0) return
        if (abs(curve%values(1)) > 0.0_wp) then
          call add_error(errors, record%origin, "the amplitude "//curve%name//", which "// &
                         "starts at "//to_text(curve%values(1)), "an *AMPLITUDE that starts at 0")
        end if
      end associate
    end if
  end subroutine read_motion

  !> Axis and angle of a turn.
  subroutine read_axis(record, motion, errors)
    type(record_t), intent(in) :: record
    type(motion_spec_t), intent(inout) :: motion
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: degree = acos(-1.0_wp)/180
    real(wp) :: axis(3)

    motion%point = motion%vector
    axis = field_vector(record, 1, 4)
    motion%vector = axis*degree*field_real(record, 2, 1)/max(norm2(axis), tiny(1.0_wp))
    if (.not. norm2(axis) > 0.0_wp) call add_error(errors, record%origin, "a turn about an "// &
      "axis without direction", "a direction other than 0, 0, 0")
  end subroutine read_axis

end module motion_keywords
