!> *HEADING, *UNITS, *DYNAMIC and all that belongs to it, *OUTPUT and *PROBE.
module step_reader
  use kinds, only: wp
  use faults, only: fault_list_t, add_fault
  use text, only: to_text, upper_case, squeezed
  use scene, only: scene_t, probe_spec_t
  use deck_records, only: parsed_deck_t, find_records, option_text, option_real, &
                          option_integer, is_option_given, field_word, field_real, record_t, &
                          is_filled
  implicit none
  private

  public :: read_labels, read_step, read_output, read_probes

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

  !> The first record of a keyword; 0 if there is none or it has faults.
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
  subroutine read_end_time(record, end_time, faults)
    type(record_t), intent(in) :: record
    real(wp), intent(inout) :: end_time
    type(fault_list_t), intent(inout) :: faults

    if (is_filled(record, 1, 1) .neqv. is_filled(record, 1, 2)) then
      end_time = field_real(record, 1, merge(1, 2, is_filled(record, 1, 1)))
    else if (is_filled(record, 1, 1)) then
      call add_fault(faults, record%origin, "two times", "the end time alone, for the stable "// &
                     "step follows from the blank")
    else
      call add_fault(faults, record%origin, "no end time", "a number > 0")
    end if
  end subroutine read_end_time

  !> End time, safety factor, damping, mass scaling, viscosity and limits.
  subroutine read_step(deck, scene, faults)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    type(fault_list_t), intent(inout) :: faults
    integer :: i

    i = first_of(deck, "DYNAMIC")
    if (i > 0) then
      scene%step%origin = deck%records(i)%origin
      if (deck%records(i)%is_valid) call read_end_time(deck%records(i), scene%step%end_time, faults)
      scene%step%safety = option_real(deck, deck%records(i), "SAFETY")
      scene%step%is_element_step = option_text(deck, deck%records(i), "STABLE STEP") == "ELEMENT"
    end if
    call read_damping(deck, scene)
    call read_mass_scaling(deck, scene, faults)
    i = first_of(deck, "BULK VISCOSITY")
    if (i > 0) then
      scene%step%viscosity_linear = field_real(deck%records(i), 1, 1)
      scene%step%viscosity_quadratic = field_real(deck%records(i), 1, 2)
    end if
    i = first_of(deck, "PENETRATION LIMIT")
    if (i > 0) then
      scene%step%depth_warning = field_real(deck%records(i), 1, 1)
      scene%step%depth_limit = field_real(deck%records(i), 1, 2)
    end if
    i = first_of(deck, "ENERGY LIMIT")
    if (i > 0) scene%step%energy_limit = field_real(deck%records(i), 1, 1)
  end subroutine read_step

  !> Damping in proportion to the mass and dynamic relaxation.
  subroutine read_damping(deck, scene)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    integer :: i

    i = first_of(deck, "DAMPING")
    if (i > 0) scene%step%alpha = option_real(deck, deck%records(i), "ALPHA")
    i = first_of(deck, "DYNAMIC RELAXATION")
    scene%step%has_relaxation = i > 0
    if (i > 0) then
      scene%step%is_kinetic = option_text(deck, deck%records(i), "METHOD") == "KINETIC"
      scene%step%energy_residual = option_real(deck, deck%records(i), "ENERGY")
      scene%step%force_residual = option_real(deck, deck%records(i), "FORCE")
    end if
  end subroutine read_damping

  !> Both kinds of mass scaling. The bound of element frequencies does not know scaled columns.
  subroutine read_mass_scaling(deck, scene, faults)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    type(fault_list_t), intent(inout) :: faults
    integer :: i

    i = first_of(deck, "MASS SCALING")
    if (i == 0) return
    scene%step%thickness_factor = option_real(deck, deck%records(i), "THICKNESS")
    scene%step%target_step = option_real(deck, deck%records(i), "STEP")
    if (scene%step%thickness_factor > 1.0_wp .and. scene%step%is_element_step) then
      call add_fault(faults, deck%records(i)%origin, "THICKNESS with STABLE STEP=ELEMENT", &
                     "STABLE STEP=ASSEMBLED in *DYNAMIC, which knows the scaled mass")
    end if
  end subroutine read_mass_scaling

  !> What is written and how often.
  subroutine read_output(deck, scene)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    integer :: i

    i = first_of(deck, "OUTPUT")
    if (i == 0) return
    scene%output%origin = deck%records(i)%origin
    scene%output%n_frames = option_integer(deck, deck%records(i), "FRAMES")
    scene%output%n_history = option_integer(deck, deck%records(i), "HISTORY")
    scene%output%is_bezier = option_text(deck, deck%records(i), "CELLS") == "BEZIER"
    scene%output%has_wear = option_text(deck, deck%records(i), "FIELDS") == "WEAR"
    scene%output%has_pressure = scene%output%has_wear .or. &
                                option_text(deck, deck%records(i), "FIELDS") == "CONTACT"
  end subroutine read_output

  !> Fill the list of probes, one for each *PROBE in the order of the deck.
  subroutine read_probes(deck, scene, faults)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    type(fault_list_t), intent(inout) :: faults
    integer, allocatable :: found(:)
    integer :: i, a

    found = find_records(deck, "PROBE")
    allocate (scene%probes(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), probe => scene%probes(i))
        probe%origin = record%origin
        probe%name = option_text(deck, record, "NAME")
        if (is_option_given(deck, record, "PATCH")) then
          call find_patch(scene, option_text(deck, record, "PATCH"), probe, faults)
        end if
        if (.not. record%is_valid) cycle
        probe%xi = [(field_real(record, 1, a), a=1, 3)]
        do a = 1, 3
          associate (axis => scene%blank%patches(probe%patch)%solid%axes(a))
            if (.not. allocated(axis%knots)) exit
            if (probe%xi(a) >= axis%knots(1) .and. &
                probe%xi(a) <= axis%knots(size(axis%knots))) cycle
            call add_fault(faults, record%origin, "the coordinate "//to_text(probe%xi(a))// &
                           " of axis "//to_text(a), "a number from "//to_text(axis%knots(1))// &
                           " to "//to_text(axis%knots(size(axis%knots))))
          end associate
        end do
      end associate
    end do
  end subroutine read_probes

  !> The patch that a probe names.
  subroutine find_patch(scene, name, probe, faults)
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: name
    type(probe_spec_t), intent(inout) :: probe
    type(fault_list_t), intent(inout) :: faults
    integer :: p

    do p = 1, size(scene%blank%patches)
      if (.not. allocated(scene%blank%patches(p)%name)) return
      if (squeezed(upper_case(scene%blank%patches(p)%name)) /= squeezed(upper_case(name))) cycle
      probe%patch = p
      return
    end do
    call add_fault(faults, probe%origin, "PATCH="//name, "a patch of the blank, such as "// &
                   scene%blank%patches(1)%name)
  end subroutine find_patch

end module step_reader
