!> Temperature and field variables: *INITIAL CONDITIONS of these types, *TEMPERATURE and *FIELD.
module field_reader
  use faults, only: fault_list_t, add_fault, add_warning
  use scene, only: scene_t, field_spec_t
  use law_setup, only: is_user_material
  use deck_names, only: deck_names_t
  use deck_steps, only: step_of
  use deck_records, only: record_t, parsed_deck_t, find_records, line_origin, field_word, &
                          field_real, option_text, option_integer
  use blank_reader, only: box_frame_t
  use boundary_reader, only: check_lines, end_before
  use motion_reader, only: find_amplitude
  use set_reader, only: find_set
  implicit none
  private

  public :: read_fields

contains

  !> Fill the list of fields, one for each data line, those of the start first.
  subroutine read_fields(deck, frame, names, scene, faults)
    type(parsed_deck_t), intent(in) :: deck
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(scene_t), intent(inout) :: scene
    type(fault_list_t), intent(inout) :: faults
    integer, allocatable :: found(:)
    integer :: i

    allocate (scene%fields(0))
    found = find_records(deck, "INITIAL CONDITIONS")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. record%is_valid) cycle
        select case (option_text(deck, record, "TYPE"))
        case ("TEMPERATURE")
          call read_lines(deck, record, frame, names, field_spec_t(), scene, faults)
        case ("FIELD")
          call read_lines(deck, record, frame, names, &
                          field_spec_t(variable=1 + option_integer(deck, record, "VARIABLE")), &
                          scene, faults)
        end select
      end associate
    end do
    call read_changes(deck, "TEMPERATURE", frame, names, scene, faults)
    call read_changes(deck, "FIELD", frame, names, scene, faults)
    call check_material(deck, scene, faults)
  end subroutine read_fields

  !> *TEMPERATURE or *FIELD.
  subroutine read_changes(deck, keyword, frame, names, scene, faults)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(scene_t), intent(inout) :: scene
    type(fault_list_t), intent(inout) :: faults
    type(field_spec_t) :: field
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, keyword)
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        call find_amplitude(deck, record, names, field%curve, faults)
        if (.not. record%is_valid) cycle
        call check_lines(deck, record, faults)
        field%first_step = step_of(record%step)
        if (keyword == "FIELD") field%variable = 1 + option_integer(deck, record, "VARIABLE")
        if (option_text(deck, record, "OP") == "NEW") then
          where (scene%fields%variable == field%variable .and. scene%fields%first_step > 0)
            scene%fields%last_step = end_before(field%first_step, scene%fields%first_step, &
                                                scene%fields%last_step)
          end where
        end if
        call read_lines(deck, record, frame, names, field, scene, faults)
      end associate
    end do
  end subroutine read_changes

  !> Append the data lines of one record.
  subroutine read_lines(deck, record, frame, names, start, scene, faults)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(field_spec_t), intent(in) :: start       !! what all lines have in common
    type(scene_t), intent(inout) :: scene
    type(fault_list_t), intent(inout) :: faults
    type(field_spec_t) :: field
    integer :: line, i

    field = start
    do line = 1, record%n_lines
      field%origin = line_origin(deck, record, line)
      field%value = field_real(record, line, 2)
      field%gradient = [(field_real(record, line, 2 + i), i=1, 3)]
      call find_set(names, frame, field_word(record, line, 1), field%origin, scene, field%set, &
                    faults)
      scene%fields = [scene%fields, field]
    end do
  end subroutine read_lines

  !> What would be without effect, or half an effect only.
  subroutine check_material(deck, scene, faults)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(in) :: scene
    type(fault_list_t), intent(inout) :: faults
    integer :: i

    if (size(scene%fields) == 0 .or. scene%blank%material == 0) return
    associate (material => scene%materials(scene%blank%material), fields => scene%fields)
      if (.not. is_user_material(material)) then
        call add_warning(faults, fields(1)%origin, "a temperature or field variable of the "// &
                         "material "//material%name//", which does not depend on it", &
                         "*USER MATERIAL, or none; *ADIABATIC HEATING has a T_start of its own")
      else if (any(fields%variable == 1 .and. fields%first_step > 0)) then
        if (allocated(material%plasticity%heating)) call add_fault(faults, material%origin, &
          "*ADIABATIC HEATING with *TEMPERATURE", "one of them: points that heat themselves "// &
          "have no temperature that is given")
        do i = 1, deck%lexed%n_blocks
          if (deck%lexed%blocks(i)%keyword == "EXPANSION") call add_fault(faults, &
            deck%records(i)%origin, "*EXPANSION with temperatures that change", "none: strains "// &
            "of expansion are not computed; the user's law may subtract its own, with DTEMP")
        end do
      end if
    end associate
  end subroutine check_material

end module field_reader
