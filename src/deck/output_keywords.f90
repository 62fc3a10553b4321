!> *HISTORY POINT, *OUTPUT and *CHECKPOINT.
module output_keywords
  use input_errors, only: error_list_t, add_error
  use text, only: squeezed, string_t, to_text, upper_case
  use keyword_spec, only: is_among, list_entries
  use scene, only: scene_t, output_spec_t, probe_spec_t
  use deck_records, only: parsed_deck_t, find_records, option_real, option_integer, &
                          is_option_given, option_text, deck_context_t, first_record, field_vector
  implicit none
  private

  public :: read_checkpoints, read_probes, read_output

  integer, parameter :: usual_number = 10

contains

  !> Take *CHECKPOINT.
  subroutine read_checkpoints(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    logical :: is_off
    integer :: i

    i = first_record(deck, "CHECKPOINT")
    if (i == 0) return
    associate (record => deck%records(i), spec => scene%checkpoints)
      spec%n_steps = option_integer(record, "STEPS")
      spec%minutes = option_real(record, "MINUTES")
      spec%number = option_integer(record, "NUMBER")
      spec%wall_minutes = option_real(record, "WALL")
      spec%retry = option_real(record, "RETRY")
      is_off = is_option_given(record, "OFF")
      spec%is_lasting = spec%n_steps > 0 .or. spec%number > 0 .or. spec%minutes > 0
      if (is_off .and. spec%is_lasting) call add_error(errors, record%origin, &
        "OFF with an interval", "either OFF or STEPS, MINUTES, NUMBER")
      if (.not. (is_off .or. spec%is_lasting)) then
        spec%number = usual_number
        spec%is_lasting = .true.
      end if
      if (spec%retry > 0.99) call add_error(errors, record%origin, "a RETRY that leaves the "// &
        "time step as it was", "a factor below 0.99")
    end associate
  end subroutine read_checkpoints

  !> Fill the list of probes, one for each *HISTORY POINT in the order of the deck.
  subroutine read_probes(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, a

    found = find_records(deck, "HISTORY POINT")
    allocate (scene%probes(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), probe => scene%probes(i))
        probe%origin = record%origin
        probe%name = option_text(record, "NAME")
        if (is_option_given(record, "PATCH")) then
          call find_patch(scene, option_text(record, "PATCH"), probe, errors)
        end if
        if (.not. record%is_valid) cycle
        probe%xi = field_vector(record, 1, 1)
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

  !> What is written and how often. Cells are those of the first step; fields that any step asks for
  !! are written in all, since the frames of a file have the same fields.
  subroutine read_output(deck, number, output, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: number
    type(output_spec_t), intent(inout) :: output
    type(error_list_t), intent(inout) :: errors
    type(string_t), allocatable :: fields(:)
    character(:), allocatable :: cells
    integer :: i

    i = first_record(deck, "OUTPUT", number)
    if (i == 0) return
    associate (record => deck%records(i))
      output%origin = record%origin
      output%n_frames = option_integer(record, "FRAMES")
      output%n_history = option_integer(record, "HISTORY")
      fields = list_entries(option_text(record, "FIELDS"))
      output%has_wear = output%has_wear .or. is_among("WEAR", fields)
      output%has_pressure = output%has_pressure .or. output%has_wear .or. &
                            is_among("CONTACT", fields)
      output%has_stress = output%has_stress .or. is_among("STRESS", fields)
      output%has_resultants = output%has_resultants .or. is_among("RESULTANTS", fields)
      cells = option_text(record, "CELLS")
      if (number == 1) then
        output%is_bezier = cells == "BEZIER"
        output%is_surface = cells == "SURFACE"
      end if
      if (is_option_given(record, "CELLS") .and. ((cells == "BEZIER" .neqv. output%is_bezier) &
          .or. (cells == "SURFACE" .neqv. output%is_surface))) &
        call add_error(errors, output%origin, "CELLS="//cells// &
                       ", which are not those of the first step", "the cells in the first "// &
                       "step alone; they apply in all steps")
    end associate
  end subroutine read_output

end module output_keywords
