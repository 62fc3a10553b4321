!> *HEADING, *UNITS, *DYNAMIC and all that belongs to it, *OUTPUT and *PROBE.
module step_reader
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: to_text, upper_case, squeezed
  use scene, only: scene_t, probe_spec_t, step_spec_t, output_spec_t, later_step_t
  use deck_steps, only: n_deck_steps, first_in_step
  use deck_records, only: parsed_deck_t, find_records, option_text, option_real, &
                          option_integer, is_option_given, field_word, field_real, record_t, &
                          is_filled
  implicit none
  private

  public :: read_labels, read_steps, read_probes

contains

  !> Heading and units; of several headings the first counts.
  subroutine read_labels(deck, scene)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    integer :: i, line

    scene%heading = ""
    scene%units = ""
    i = first_of(deck, "HEADING")
    if (i > 0) then
      do line = 1, deck%records(i)%n_lines
        if (line > 1) scene%heading = scene%heading//new_line("a")
        scene%heading = scene%heading//trim(adjustl(field_word(deck%records(i), line, 1)))
      end do
    end if
    i = first_of(deck, "UNITS")
    if (i > 0) scene%units = trim(adjustl(field_word(deck%records(i), 1, 1)))
  end subroutine read_labels

  !> The first record of a keyword; 0 if there is none or it has errors.
  pure integer function first_of(deck, keyword)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    integer, allocatable :: found(:)

    found = find_records(deck, keyword)
    first_of = 0
    if (size(found) == 0) return
    if (deck%records(found(1))%is_valid) first_of = found(1)
  end function first_of

  !> The end time stands in the one field or the other.
  subroutine read_end_time(record, end_time, errors)
    type(record_t), intent(in) :: record
    real(wp), intent(inout) :: end_time
    type(error_list_t), intent(inout) :: errors

    if (is_filled(record, 1, 1) .neqv. is_filled(record, 1, 2)) then
      end_time = field_real(record, 1, merge(1, 2, is_filled(record, 1, 1)))
    else if (is_filled(record, 1, 1)) then
      call add_error(errors, record%origin, "two times", "the end time alone, for the stable "// &
                     "step follows from the blank")
    else
      call add_error(errors, record%origin, "no end time", "a number > 0")
    end if
  end subroutine read_end_time

  !> All steps. Each takes from the one before what it does not change.
  subroutine read_steps(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
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
    do i = 1, size(scene%later_steps)
      scene%later_steps(i)%output%has_pressure = next%output%has_pressure
      scene%later_steps(i)%output%has_wear = next%output%has_wear
    end do
  end subroutine read_steps

  !> End time, safety factor, damping, mass scaling, viscosity, limits and output of a step.
  subroutine read_step(deck, number, step, output, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: number
    type(step_spec_t), intent(inout) :: step       !! the one before on entry
    type(output_spec_t), intent(inout) :: output
    type(error_list_t), intent(inout) :: errors
    integer :: i

    i = first_in_step(deck, "STEP", number)
    if (i > 0) step%name = option_text(deck, deck%records(i), "NAME")
    if (i > 0 .and. step%name == "") step%name = "Step-"//to_text(number)
    i = first_in_step(deck, "DYNAMIC", number)
    if (i > 0) then
      step%origin = deck%records(i)%origin
      call read_end_time(deck%records(i), step%end_time, errors)
      call read_stable_step(deck, deck%records(i), number, step, errors)
    end if
    call read_damping(deck, number, step)
    call read_mass_scaling(deck, number, step, errors)
    i = first_in_step(deck, "BULK VISCOSITY", number)
    if (i > 0) then
      step%viscosity_linear = field_real(deck%records(i), 1, 1)
      step%viscosity_quadratic = field_real(deck%records(i), 1, 2)
    end if
    i = first_in_step(deck, "PENETRATION LIMIT", number)
    if (i > 0) then
      step%depth_warning = field_real(deck%records(i), 1, 1)
      step%depth_limit = field_real(deck%records(i), 1, 2)
    end if
    i = first_in_step(deck, "ENERGY LIMIT", number)
    if (i > 0) step%energy_limit = field_real(deck%records(i), 1, 1)
    call read_output(deck, number, output, errors)
  end subroutine read_step

  !> How the time step follows from the blank: the penalties rest on it, so it is one for all steps.
  subroutine read_stable_step(deck, record, number, step, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record           !! of *DYNAMIC
    integer, intent(in) :: number
    type(step_spec_t), intent(inout) :: step
    type(error_list_t), intent(inout) :: errors
    type(step_spec_t) :: default
    real(wp) :: safety
    logical :: is_element

    safety = option_real(deck, record, "SAFETY")
    is_element = option_text(deck, record, "STABLE STEP") == "ELEMENT"
    if (number == 1) then
      step%safety = safety
      step%is_element_step = is_element
    else if ((abs(safety - step%safety) > 0.0_wp .and. abs(safety - default%safety) > 0.0_wp) &
             .or. (is_element .and. .not. step%is_element_step)) then
      call add_error(errors, record%origin, "another SAFETY or STABLE STEP than in the first "// &
                     "step", "them in the first step alone; they hold in all")
    end if
  end subroutine read_stable_step

  !> Damping in proportion to the mass and dynamic relaxation.
  subroutine read_damping(deck, number, step)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: number
    type(step_spec_t), intent(inout) :: step
    integer :: i

    i = first_in_step(deck, "DAMPING", number)
    if (i > 0) step%alpha = option_real(deck, deck%records(i), "ALPHA")
    i = first_in_step(deck, "DYNAMIC RELAXATION", number)
    step%has_relaxation = i > 0
    if (i > 0) then
      step%is_kinetic = option_text(deck, deck%records(i), "METHOD") == "KINETIC"
      step%energy_residual = option_real(deck, deck%records(i), "ENERGY")
      step%force_residual = option_real(deck, deck%records(i), "FORCE")
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

    i = first_in_step(deck, "MASS SCALING", number)
    if (i == 0) return
    has_factor = is_option_given(deck, deck%records(i), "THICKNESS")
    if (has_factor) step%thickness_factor = option_real(deck, deck%records(i), "THICKNESS")
    step%target_step = option_real(deck, deck%records(i), "STEP")
    if (.not. (has_factor .or. is_option_given(deck, deck%records(i), "STEP"))) &
      call add_error(errors, deck%records(i)%origin, "no option", "THICKNESS or STEP or both")
    if (step%thickness_factor > 1.0_wp .and. step%is_element_step) then
      call add_error(errors, deck%records(i)%origin, "THICKNESS with STABLE STEP=ELEMENT", &
                     "STABLE STEP=ASSEMBLED in *DYNAMIC, which knows the scaled mass")
    end if
  end subroutine read_mass_scaling

  !> What is written and how often. Cells are those of the first step; fields that any step asks for
  !! are written in all, since the frames of a file have the same fields.
  subroutine read_output(deck, number, output, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: number
    type(output_spec_t), intent(inout) :: output
    type(error_list_t), intent(inout) :: errors
    logical :: is_bezier
    integer :: i

    i = first_in_step(deck, "OUTPUT", number)
    if (i == 0) return
    output%origin = deck%records(i)%origin
    output%n_frames = option_integer(deck, deck%records(i), "FRAMES")
    output%n_history = option_integer(deck, deck%records(i), "HISTORY")
    output%has_wear = output%has_wear .or. &
                      option_text(deck, deck%records(i), "FIELDS") == "WEAR"
    output%has_pressure = output%has_pressure .or. &
                          option_text(deck, deck%records(i), "FIELDS") /= "NONE"
    is_bezier = option_text(deck, deck%records(i), "CELLS") == "BEZIER"
    if (number == 1) output%is_bezier = is_bezier
    if (is_option_given(deck, deck%records(i), "CELLS") .and. &
        (is_bezier .neqv. output%is_bezier)) &
      call add_error(errors, output%origin, "CELLS="//option_text(deck, deck%records(i), "CELLS") &
                     //", which are not those of the first step", "the cells in the first "// &
                     "step alone; they hold in all")
  end subroutine read_output

  !> Fill the list of probes, one for each *PROBE in the order of the deck.
  subroutine read_probes(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, a

    found = find_records(deck, "PROBE")
    allocate (scene%probes(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), probe => scene%probes(i))
        probe%origin = record%origin
        probe%name = option_text(deck, record, "NAME")
        if (is_option_given(deck, record, "PATCH")) then
          call find_patch(scene, option_text(deck, record, "PATCH"), probe, errors)
        end if
        if (.not. record%is_valid) cycle
        probe%xi = [(field_real(record, 1, a), a=1, 3)]
        do a = 1, 3
          associate (axis => scene%blank%patches(probe%patch)%solid%axes(a))
            if (.not. allocated(axis%knots)) exit
            if (probe%xi(a) >= axis%knots(1) .and. &
                probe%xi(a) <= axis%knots(size(axis%knots))) cycle
            call add_error(errors, record%origin, "the coordinate "//to_text(probe%xi(a))// &
                           " of axis "//to_text(a), "a number from "//to_text(axis%knots(1))// &
                           " to "//to_text(axis%knots(size(axis%knots))))
          end associate
        end do
      end associate
    end do
  end subroutine read_probes

  !> The patch that a probe names.
  subroutine find_patch(scene, name, probe, errors)
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: name
    type(probe_spec_t), intent(inout) :: probe
    type(error_list_t), intent(inout) :: errors
    integer :: p

    do p = 1, size(scene%blank%patches)
      if (.not. allocated(scene%blank%patches(p)%name)) return
      if (squeezed(upper_case(scene%blank%patches(p)%name)) /= squeezed(upper_case(name))) cycle
      probe%patch = p
      return
    end do
    call add_error(errors, probe%origin, "PATCH="//name, "a patch of the blank, such as "// &
                   scene%blank%patches(1)%name)
  end subroutine find_patch

end module step_reader
