!> *AMPLITUDE, *TOOL MOTION and *TOOL FORCE.
module motion_keywords
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: to_text
  use scene, only: scene_t, curve_spec_t, motion_spec_t
  use keyword_table, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                           add_vector, add_example, kind_real, kind_name, kind_choice, any_number, &
                           in_any_step, names_curve
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_real, &
                          is_option_given, field_real, all_numbers, deck_context_t, &
                          resolve_option, step_of
  implicit none
  private

  public :: add_motion_keywords, add_amplitude_option, find_amplitude

contains

  !> Add the option AMPLITUDE to the last keyword.
  pure subroutine add_amplitude_option(table, scaled)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: scaled     !! what it scales

    call add_option(table, "AMPLITUDE", kind_name, "amplitude that scales "//scaled, &
                    is_required=.false.)
  end subroutine add_amplitude_option

  !> Add *AMPLITUDE, *TOOL MOTION and *TOOL FORCE.
  subroutine add_motion_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "AMPLITUDE", "A factor against time, linear or smooth between the "// &
                     "points and constant outside.", names=names_curve, read=read_amplitudes)
    call add_option(table, "NAME", kind_name, "name, for AMPLITUDE options")
    call add_option(table, "INPUT", kind_name, "file with the data lines", is_required=.false.)
    call add_option(table, "DEFINITION", kind_choice, "SMOOTH STEP: between the points "// &
                    "a quintic that is level at both of them, as in Abaqus", default="TABULAR", &
                    choices="TABULAR|SMOOTH STEP")
    call add_option(table, "TIME", kind_choice, "times since the start of the step that names "// &
                    "the amplitude, or since that of the run", default="STEP TIME", &
                    choices="STEP TIME|TOTAL TIME")
    call add_option(table, "VALUE", kind_choice, "accepted for Abaqus compatibility", &
                    default="RELATIVE", choices="RELATIVE")
    call add_line(table, "Pairs of time and value, any number on a line; times rise.", &
                  n_max=any_number, is_repeated=.true.)
    call add_field(table, "time, value", kind_real, "time, then value", unit="time, none")
    call add_example(table, "*AMPLITUDE, NAME=soft start", "0, 0, 0.001, 1")

    call add_keyword(table, "TOOL MOTION", "How a tool moves from the start of the step on, in "// &
                     "which this appears; in later steps it continues until the tool gets "// &
                     "another motion. Several of one tool in one step add up if they move "// &
                     "different components; one of them may rotate it. A tool without it does "// &
                     "not move.", place=in_any_step, read=read_tool_motions)
    call add_option(table, "TOOL", kind_name, "name of the tool")
    call add_option(table, "TYPE", kind_choice, "what the data lines are; DISPLACEMENT and "// &
                    "ROTATION count from where the tool is at the start of the step, and need "// &
                    "an AMPLITUDE that starts at 0", default="VELOCITY", &
                    choices="VELOCITY|DISPLACEMENT|ROTATION|ANGULAR VELOCITY")
    call add_amplitude_option(table, "the vector")
    call add_line(table, "The vector.", when="VELOCITY|DISPLACEMENT")
    call add_vector(table, "", "component", unit="length/time, length")
    call add_line(table, "A point of the axis at the start of the step, and the direction of "// &
                  "the axis, which moves with the other motions of the tool; the "// &
                  "rotation is right-handed.", when="ROTATION|ANGULAR VELOCITY")
    call add_vector(table, "", "point")
    call add_vector(table, "a", "axis", unit="none")
    call add_line(table, "The angle.", when="ROTATION|ANGULAR VELOCITY")
    call add_field(table, "angle", kind_real, "angle, or angle per time", &
                   unit="degrees, degrees/time")
    call add_example(table, "*TOOL MOTION, TOOL=punch, TYPE=VELOCITY, AMPLITUDE=soft start", &
                     "0, -2000, 0")

    call add_keyword(table, "TOOL FORCE", "A force that moves a tool, such as a blank holder: "// &
                     "the tool is free along the force and constrained across it. It acts "// &
                     "until the tool gets another motion. A weight is a part of the force.", &
                     place=in_any_step)
    call add_option(table, "TOOL", kind_name, "name of the tool")
    call add_amplitude_option(table, "the force")
    call add_option(table, "MASS", kind_real, "mass of the tool; 0: twice what its contact "// &
                    "springs and the time step ask for, named in the log", default="0", &
                    unit="mass", range=">= 0")
    call add_option(table, "DAMPING", kind_real, "damping of the tool motion, as a fraction of "// &
                    "critical damping for the tool mass and its total contact stiffness. It "// &
                    "increases the force on the sheet while the tool is pushed back; DAMPING "// &
                    "of *CONTACT PAIR does not", default="0", range=">= 0")
    call add_line(table, "The force.")
    call add_vector(table, "", "component", unit="force")
    call add_example(table, "*TOOL FORCE, TOOL=blank holder, AMPLITUDE=soft start", "0, -2450, 0")
  end subroutine add_motion_keywords

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
      scene%curves(i)%origin = deck%records(found(i))%origin
      scene%curves(i)%name = option_text(deck%records(found(i)), "NAME")
      scene%curves(i)%is_total = option_text(deck%records(found(i)), "TIME") == "TOTAL TIME"
      scene%curves(i)%is_smooth = option_text(deck%records(found(i)), "DEFINITION") == "SMOOTH STEP"
      call read_curve(deck%records(found(i)), scene%curves(i), errors)
    end do
  end subroutine read_amplitudes

  subroutine read_curve(record, curve, errors)
    type(record_t), intent(in) :: record
    type(curve_spec_t), intent(inout) :: curve
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: numbers(:)
    integer :: i, n

    allocate (curve%times(0), curve%values(0))
    if (.not. record%is_valid) return
    numbers = all_numbers(record)
    if (mod(size(numbers), 2) == 1) then
      call add_error(errors, record%origin, to_text(size(numbers))//" numbers", &
                     "pairs of time and value")
      return
    end if
    curve%times = numbers(1::2)
    curve%values = numbers(2::2)
    n = size(curve%times)
    do i = 2, n
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
    integer :: i

    allocate (scene%motions(0))
    found = [find_records(deck, "TOOL MOTION"), find_records(deck, "TOOL FORCE")]
    do i = 1, size(found)
      call add_motion(deck, found(i), context, i > size(find_records(deck, "TOOL MOTION")), scene, &
                      errors)
    end do
  end subroutine read_tool_motions

  !> Append the motion or force of one record, if it names its tool.
  subroutine add_motion(deck, r, context, is_force, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: r                 !! index of the record
    type(deck_context_t), intent(inout) :: context
    logical, intent(in) :: is_force
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(motion_spec_t) :: motion

    associate (record => deck%records(r))
      call resolve_option(record, "TOOL", context%names%tools, "*TOOL", motion%tool, errors)
      if (motion%tool == 0) return
      motion%origin = record%origin
      motion%step = step_of(record%step)
      motion%is_force = is_force
      if (record%is_valid .and. is_force) then
        call read_force(record, context, motion, errors)
      else if (record%is_valid) then
        call read_motion(record, context, scene%curves, motion, errors)
      end if
      call check_second(scene%tools(motion%tool)%name, scene%motions, motion, errors)
    end associate
    scene%motions = [scene%motions, motion]
  end subroutine add_motion

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
  subroutine read_force(record, context, motion, errors)
    type(record_t), intent(in) :: record
    type(deck_context_t), intent(inout) :: context
    type(motion_spec_t), intent(inout) :: motion
    type(error_list_t), intent(inout) :: errors

    call find_amplitude(record, context, motion%curve, errors)
    motion%vector = [field_real(record, 1, 1), field_real(record, 1, 2), field_real(record, 1, 3)]
    motion%mass = option_real(record, "MASS")
    motion%damping = option_real(record, "DAMPING")
    if (.not. any(abs(motion%vector) > 0.0_wp)) &
      call add_error(errors, record%origin, "a force without direction", "a force that is not 0")
  end subroutine read_force

  subroutine read_motion(record, context, curves, motion, errors)
    type(record_t), intent(in) :: record
    type(deck_context_t), intent(inout) :: context
    type(curve_spec_t), intent(in) :: curves(:)
    type(motion_spec_t), intent(inout) :: motion
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: type

    call find_amplitude(record, context, motion%curve, errors)
    type = option_text(record, "TYPE")
    motion%is_displacement = any(type == [character(12) :: "DISPLACEMENT", "ROTATION"])
    motion%is_rotation = any(type == [character(16) :: "ROTATION", "ANGULAR VELOCITY"])
    motion%vector = [field_real(record, 1, 1), field_real(record, 1, 2), field_real(record, 1, 3)]
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
    integer :: i

    motion%point = motion%vector
    axis = [(field_real(record, 1, 3 + i), i=1, 3)]
    motion%vector = axis*degree*field_real(record, 2, 1)/max(norm2(axis), tiny(1.0_wp))
    if (.not. norm2(axis) > 0.0_wp) call add_error(errors, record%origin, "a turn about an "// &
      "axis without direction", "a direction other than 0, 0, 0")
  end subroutine read_axis

end module motion_keywords
