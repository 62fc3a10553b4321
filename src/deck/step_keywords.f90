!> *STEP, *MODEL CHANGE, and what describes a step: time, damping, mass scaling, limits.
module step_keywords
  use kinds, only: wp
  use input_errors, only: origin_t, error_list_t, add_error
  use text, only: string_t, upper_case, squeezed, to_text
  use name_table, only: name_table_t, insert, place_of
  use lexer, only: line_text
  use scene, only: scene_t, contact_spec_t, bead_spec_t, motion_spec_t, step_spec_t, &
                   output_spec_t, later_step_t
  use deck_records, only: parsed_deck_t, find_records, is_option_given, field_word, line_origin, &
                          line_place, n_fields, option_text, option_real, field_real, &
                          field_integer, record_t, is_filled, resolve, deck_context_t, step_of, &
                          n_deck_steps, first_record
  use output_keywords, only: read_output
  implicit none
  private

  public :: read_changes, read_steps

contains

  !> Cut contact pairs and draw beads where *MODEL CHANGE takes them away, or brings them again.
  subroutine read_changes(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(name_table_t) :: known
    type(string_t), allocatable :: words(:)
    type(origin_t) :: origin
    type(motion_spec_t) :: parked(size(scene%tools))
    integer, allocatable :: found(:)
    integer :: i, line, j, place, n_tools
    logical :: is_added

    known = context%names%tools
    n_tools = known%n_names
    call enter_beads(scene%beads, known)
    found = find_records(deck, "MODEL CHANGE")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. record%is_valid) cycle
        is_added = is_option_given(record, "ADD")
        if (is_added .eqv. is_option_given(record, "REMOVE")) then
          call add_error(errors, record%origin, "not one of ADD and REMOVE", "ADD or REMOVE")
          cycle
        end if
        do line = 1, record%n_lines
          origin = line_origin(deck, record, line)
          words = names_on(deck, record, line, known)
          do j = 1, size(words)
            if (words(j)%value == "") cycle
            call resolve(known, words(j)%value, "*TOOL or *DRAW BEAD", origin, &
                         place, errors)
            if (place > n_tools) then
              call change_bead(known%names(place)%value, step_of(record%step), is_added, origin, &
                               scene%beads, errors)
            else if (place > 0) then
              call change_tool(place, step_of(record%step), is_added, origin, scene, errors)
              call park_tool(place, step_of(record%step), is_added, origin, parked(place), &
                             scene%motions)
            end if
          end do
        end do
      end associate
    end do
  end subroutine read_changes

  !> The names of a line, which commas separate. A line without commas is one name if there is a
  !! thing of that name; else blanks separate.
  function names_on(deck, record, line, known) result(words)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    type(name_table_t), intent(in) :: known
    type(string_t), allocatable :: words(:)
    character(:), allocatable :: given
    integer :: j

    given = line_text(deck%lexed%lines, line_place(record, line))
    if (index(given, ",") == 0 .and. place_of(known, squeezed(upper_case(given))) > 0) then
      allocate (words(1))
      words(1)%value = given
      return
    end if
    allocate (words(n_fields(record, line)))
    do j = 1, size(words)
      words(j)%value = field_word(record, line, j)
    end do
  end function names_on

  !> Names of beads behind those of tools; several beads may share one.
  subroutine enter_beads(beads, known)
    type(bead_spec_t), intent(in) :: beads(:)
    type(name_table_t), intent(inout) :: known
    logical :: is_new
    integer :: i

    do i = 1, size(beads)
      call insert(known, squeezed(upper_case(beads(i)%name)), is_new)
    end do
  end subroutine enter_beads

  !> One tool comes or goes with a step.
  subroutine change_tool(tool, step, is_added, origin, scene, errors)
    integer, intent(in) :: tool, step
    logical, intent(in) :: is_added
    type(origin_t), intent(in) :: origin
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(contact_spec_t), allocatable :: again(:)
    logical :: is_there(size(scene%contacts))
    integer :: last(size(scene%contacts))

    associate (contacts => scene%contacts)
      is_there = contacts%tool == tool .and. contacts%last_step >= step
      if (any(is_there) .eqv. is_added .or. .not. any(contacts%tool == tool)) then
        call add_error(errors, origin, "the tool "//scene%tools(tool)%name//", which is "// &
                       place_now(is_added)//" already or has no *CONTACT PAIR", "another tool")
      else if (is_added) then
        last = contacts%last_step
        again = pack(contacts, contacts%tool == tool .and. &
                     last == maxval(last, mask=contacts%tool == tool))
        again%first_step = step
        again%last_step = huge(1)
      else
        where (is_there) contacts%last_step = step - 1
      end if
    end associate
    if (allocated(again)) scene%contacts = [scene%contacts, again]
  end subroutine change_tool

  !> A tool that a force moves would fly off while it is away: it stands still until it comes again,
  !! or until the deck gives it another motion.
  subroutine park_tool(tool, step, is_added, origin, parked, motions)
    integer, intent(in) :: tool, step
    logical, intent(in) :: is_added
    type(origin_t), intent(in) :: origin
    type(motion_spec_t), intent(inout) :: parked   !! the force that waits; of tool 0: none
    type(motion_spec_t), allocatable, intent(inout) :: motions(:)
    type(motion_spec_t) :: new
    integer :: i, last

    last = 0
    do i = 1, size(motions)
      if (motions(i)%tool /= tool .or. motions(i)%step > step) cycle
      if (last == 0) last = i
      if (motions(i)%step >= motions(last)%step) last = i
    end do
    if (last == 0) return
    if (is_added) then
      if (parked%tool == 0 .or. motions(last)%step == step) return
      new = parked
      new%step = step
      parked%tool = 0
      motions = [motions, new]
    else if (motions(last)%is_force) then
      parked = motions(last)
      new%origin = origin
      new%tool = tool
      new%step = step
      if (motions(last)%step == step) motions(last) = new
      if (motions(last)%is_force) motions = [motions, new]
    end if
  end subroutine park_tool

  !> The beads of a name come or go with a step.
  subroutine change_bead(name, step, is_added, origin, beads, errors)
    character(*), intent(in) :: name       !! in capitals
    integer, intent(in) :: step
    logical, intent(in) :: is_added
    type(origin_t), intent(in) :: origin
    type(bead_spec_t), allocatable, intent(inout) :: beads(:)
    type(error_list_t), intent(inout) :: errors
    type(bead_spec_t) :: again
    logical :: is_meant(size(beads)), is_there(size(beads))
    integer :: i, last

    is_meant = [(squeezed(upper_case(beads(i)%name)) == name, i=1, size(beads))]
    is_there = is_meant .and. beads%last_step >= step
    if (any(is_there) .eqv. is_added) then
      call add_error(errors, origin, "the draw bead "//beads(findloc(is_meant, .true., 1))%name// &
                     ", which is "//place_now(is_added)//" already", "another bead")
    else if (is_added) then
      last = maxval(beads%last_step, mask=is_meant)
      is_meant = is_meant .and. beads%last_step == last
      do i = 1, size(is_meant)
        if (.not. is_meant(i)) cycle
        again = beads(i)
        again%first_step = step   ! its curve goes on from the step that named it first
        again%last_step = huge(1)
        beads = [beads, again]
      end do
    else
      where (is_there) beads%last_step = step - 1
    end if
  end subroutine change_bead

  pure function place_now(is_added) result(words)
    logical, intent(in) :: is_added
    character(:), allocatable :: words

    words = trim(merge("there", "away ", is_added))
  end function place_now

  !> The time period is in the one field or the other.
  subroutine read_duration(record, duration, errors)
    type(record_t), intent(in) :: record
    real(wp), intent(inout) :: duration
    type(error_list_t), intent(inout) :: errors

    if (is_filled(record, 1, 1) .neqv. is_filled(record, 1, 2)) then
      duration = field_real(record, 1, merge(1, 2, is_filled(record, 1, 1)))
    else if (is_filled(record, 1, 1)) then
      call add_error(errors, record%origin, "two times", "the time period alone, for "// &
                     "the stable time increment follows from the blank")
    else
      call add_error(errors, record%origin, "no time period", "a number > 0")
    end if
  end subroutine read_duration

  !> All steps. Each takes from the one before what it does not change.
  subroutine read_steps(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(later_step_t) :: next
    integer :: i

    call read_step(deck, 1, scene%step, scene%output, errors)
    next%step = scene%step
    next%output = scene%output
    allocate (scene%later_steps(0))
    do i = 2, n_deck_steps(deck)
      call read_step(deck, i, next%step, next%output, errors)
      scene%later_steps = [scene%later_steps, next]
    end do
    scene%output%has_pressure = next%output%has_pressure
    scene%output%has_wear = next%output%has_wear
    scene%output%has_stress = next%output%has_stress
    scene%output%has_resultants = next%output%has_resultants
    do i = 1, size(scene%later_steps)
      scene%later_steps(i)%output%has_pressure = next%output%has_pressure
      scene%later_steps(i)%output%has_wear = next%output%has_wear
      scene%later_steps(i)%output%has_stress = next%output%has_stress
      scene%later_steps(i)%output%has_resultants = next%output%has_resultants
    end do
  end subroutine read_steps

  !> Duration, safety factor, damping, mass scaling, viscosity, limits and output of a step.
  subroutine read_step(deck, number, step, output, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: number
    type(step_spec_t), intent(inout) :: step       !! the one before on entry
    type(output_spec_t), intent(inout) :: output
    type(error_list_t), intent(inout) :: errors
    integer :: i

    i = first_record(deck, "STEP", number)
    if (i > 0) step%name = option_text(deck%records(i), "NAME")
    if (i > 0 .and. step%name == "") step%name = "Step-"//to_text(number)
    i = first_record(deck, "DYNAMIC", number)
    if (i > 0) then
      step%origin = deck%records(i)%origin
      call read_duration(deck%records(i), step%duration, errors)
      call read_stable_step(deck%records(i), number, step, errors)
    end if
    call read_static(deck, number, step, errors)
    call read_frequency(deck, number, step)
    call read_damping(deck, number, step)
    call read_mass_scaling(deck, number, step, errors)
    i = first_record(deck, "BULK VISCOSITY", number)
    if (i > 0) then
      step%viscosity_linear = field_real(deck%records(i), 1, 1)
      step%viscosity_quadratic = field_real(deck%records(i), 1, 2)
      step%viscosity_bending = field_real(deck%records(i), 1, 3)
    end if
    i = first_record(deck, "PENETRATION LIMIT", number)
    if (i > 0) then
      step%depth_warning = field_real(deck%records(i), 1, 1)
      step%depth_limit = field_real(deck%records(i), 1, 2)
    end if
    i = first_record(deck, "ENERGY LIMIT", number)
    if (i > 0) step%energy_limit = field_real(deck%records(i), 1, 1)
    call read_output(deck, number, output, errors)
  end subroutine read_step

  !> Period and increments of a static step.
  subroutine read_static(deck, number, step, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: number
    type(step_spec_t), intent(inout) :: step
    type(error_list_t), intent(inout) :: errors
    integer :: i

    i = first_record(deck, "STATIC", number)
    step%is_static = i > 0
    if (i == 0) return
    associate (record => deck%records(i))
      step%origin = record%origin
      step%static_increment = 1.0_wp
      step%duration = 1.0_wp
      if (record%n_lines > 0) then
        step%static_increment = field_real(record, 1, 1)
        step%duration = field_real(record, 1, 2)
      end if
      step%least_increment = 1.0e-5_wp*step%duration
      step%most_increment = step%duration
      if (record%n_lines > 0) then
        if (is_filled(record, 1, 3)) step%least_increment = field_real(record, 1, 3)
        if (is_filled(record, 1, 4)) step%most_increment = field_real(record, 1, 4)
      end if
      if (step%most_increment < step%static_increment) call add_error(errors, record%origin, &
        "a greatest increment below the initial one", "one of the initial increment or more")
      if (step%static_increment > step%duration) call add_error(errors, record%origin, &
        "an initial increment longer than the period", "one of the period or less")
      if (step%least_increment > step%static_increment) call add_error(errors, record%origin, &
        "a least increment above the initial one", "one of the initial increment or less")
    end associate
  end subroutine read_static

  !> A step of frequencies: static, but without any time.
  subroutine read_frequency(deck, number, step)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: number
    type(step_spec_t), intent(inout) :: step
    integer :: i

    i = first_record(deck, "FREQUENCY", number)
    step%n_modes = 0
    if (i == 0) return
    step%origin = deck%records(i)%origin
    step%n_modes = field_integer(deck%records(i), 1, 1)
    step%is_static = .true.
    step%duration = 0.0_wp
    step%static_increment = 1.0_wp
    step%most_increment = 1.0_wp
  end subroutine read_frequency

  !> How the time step follows from the blank: the penalties rest on it, so it is one for all steps.
  subroutine read_stable_step(record, number, step, errors)
    type(record_t), intent(in) :: record           !! of *DYNAMIC
    integer, intent(in) :: number
    type(step_spec_t), intent(inout) :: step
    type(error_list_t), intent(inout) :: errors
    type(step_spec_t) :: default
    real(wp) :: safety
    logical :: is_element

    safety = option_real(record, "SCALE FACTOR")
    is_element = option_text(record, "STABLE STEP") == "ELEMENT"
    if (number == 1) then
      step%safety = safety
      step%is_element_step = is_element
    else if ((abs(safety - step%safety) > 0.0_wp .and. abs(safety - default%safety) > 0.0_wp) &
             .or. (is_element .and. .not. step%is_element_step)) then
      call add_error(errors, record%origin, "another SCALE FACTOR or STABLE STEP than in "// &
                     "the first step", "them in the first step alone; they apply in all steps")
    end if
  end subroutine read_stable_step

  !> Damping in proportion to the mass and dynamic relaxation.
  subroutine read_damping(deck, number, step)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: number
    type(step_spec_t), intent(inout) :: step
    integer :: i

    i = first_record(deck, "DAMPING", number)
    if (i > 0) step%alpha = option_real(deck%records(i), "ALPHA")
    i = first_record(deck, "DYNAMIC RELAXATION", number)
    step%has_relaxation = i > 0
    if (i > 0) then
      step%is_kinetic = option_text(deck%records(i), "METHOD") == "KINETIC"
      step%energy_residual = option_real(deck%records(i), "ENERGY")
      step%force_residual = option_real(deck%records(i), "FORCE")
    end if
  end subroutine read_damping

  !> Both kinds of mass scaling. The bound of element frequencies does not know scaled columns.
  subroutine read_mass_scaling(deck, number, step, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: number
    type(step_spec_t), intent(inout) :: step
    type(error_list_t), intent(inout) :: errors
    integer :: i
    logical :: has_factor

    i = first_record(deck, "MASS SCALING", number)
    if (i == 0) return
    has_factor = is_option_given(deck%records(i), "THICKNESS")
    if (has_factor) step%thickness_factor = option_real(deck%records(i), "THICKNESS")
    step%target_step = option_real(deck%records(i), "DT")
    if (.not. (has_factor .or. is_option_given(deck%records(i), "DT"))) &
      call add_error(errors, deck%records(i)%origin, "no option", "THICKNESS or DT or both")
    if (step%thickness_factor > 1.0_wp .and. step%is_element_step) then
      call add_error(errors, deck%records(i)%origin, "THICKNESS with STABLE STEP=ELEMENT", &
                     "STABLE STEP=ASSEMBLED in *DYNAMIC, which knows the scaled mass")
    end if
  end subroutine read_mass_scaling

end module step_keywords
