!> Temperature and field variables: *INITIAL CONDITIONS of these types, *TEMPERATURE and *FIELD.
module field_reader
  use input_errors, only: error_list_t, add_error, add_warning
  use kinds, only: wp
  use text, only: upper_case
  use scene, only: is_user_material, scene_t, field_spec_t, material_spec_t
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

  public :: read_fields, read_test_fields

contains

  !> Fill the list of fields, one for each data line, those of the start first.
  subroutine read_fields(deck, frame, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, variable

    allocate (scene%fields(0))
    found = find_records(deck, "INITIAL CONDITIONS")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        variable = start_variable(deck, record)
        if (variable > 0) call read_lines(deck, record, frame, names, &
                                          field_spec_t(variable=variable), scene, errors)
      end associate
    end do
    call read_changes(deck, "TEMPERATURE", frame, names, scene, errors)
    call read_changes(deck, "FIELD", frame, names, scene, errors)
    call check_material(deck, scene, errors)
  end subroutine read_fields

  !> Fields of the start for the tests of users' materials: one value each, for a test has neither
  !! places nor steps of the deck. What a test cannot honour is invalid.
  subroutine read_test_fields(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene        !! with its materials and tests
    type(error_list_t), intent(inout) :: errors
    type(field_spec_t), allocatable :: starts(:)
    logical :: is_user(size(scene%tests))
    integer :: i, k

    if (size(scene%tests) == 0) return    ! which is invalid, or asks for no test
    call list_starts(deck, starts, errors)
    is_user = .false.
    do i = 1, size(scene%tests)
      associate (test => scene%tests(i))
        allocate (test%fields(0))
        if (test%material == 0) cycle
        is_user(i) = is_user_material(scene%materials(test%material))
        if (size(starts) == 0 .or. .not. is_user(i)) cycle
        test%fields = spread(0.0_wp, 1, maxval(starts%variable))
        associate (law => scene%materials(test%material)%plasticity)
          if (allocated(law%heating)) test%fields(1) = law%heating(3)
        end associate
        do k = 1, size(starts)
          test%fields(starts(k)%variable) = starts(k)%value
        end do
      end associate
    end do
    if (any(is_user)) then
      call refuse_changes(deck, "TEMPERATURE", errors)
      call refuse_changes(deck, "FIELD", errors)
    else if (size(starts) > 0 .and. all(scene%tests%material > 0)) then
      call warn_of_none(scene%materials(scene%tests(1)%material), starts(1), errors)
    end if
  end subroutine read_test_fields

  !> Values at the start that hold for ALL.
  subroutine list_starts(deck, starts, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(field_spec_t), allocatable, intent(out) :: starts(:)
    type(error_list_t), intent(inout) :: errors
    type(field_spec_t) :: start
    integer, allocatable :: found(:)
    integer :: i, k, line

    allocate (starts(0))
    found = find_records(deck, "INITIAL CONDITIONS")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        start%variable = start_variable(deck, record)
        if (start%variable == 0) cycle
        do line = 1, record%n_lines
          start%origin = line_origin(deck, record, line)
          start%value = field_real(record, line, 2)
          if (upper_case(field_word(record, line, 1)) /= "ALL") then
            call add_warning(errors, start%origin, "the set "//field_word(record, line, 1)// &
                             ", in which the point of a material test does not lie", &
                             "ALL for a start of the tests")
          else if (any([(abs(field_real(record, line, 2 + k)) > 0.0_wp, k=1, 3)])) then
            call add_error(errors, start%origin, "a change along x, y or z for a material test", &
                           "one value: its point has no place")
          else
            starts = [starts, start]
          end if
        end do
      end associate
    end do
  end subroutine list_starts

  !> Material tests have no fields that change.
  subroutine refuse_changes(deck, keyword, errors)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, keyword)
    do i = 1, size(found)
      call add_error(errors, deck%records(found(i))%origin, &
                     "a field that changes, for a material test", &
                     "a value that stays, by *INITIAL CONDITIONS, TYPE="//keyword)
    end do
  end subroutine refuse_changes

  !> Which field a record of *INITIAL CONDITIONS gives; 0: none.
  integer function start_variable(deck, record) result(variable)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record

    variable = 0
    if (.not. record%is_valid) return
    select case (option_text(deck, record, "TYPE"))
    case ("TEMPERATURE")
      variable = 1
    case ("FIELD")
      variable = 1 + option_integer(deck, record, "VARIABLE")
    end select
  end function start_variable

  !> *TEMPERATURE or *FIELD.
  subroutine read_changes(deck, keyword, frame, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(field_spec_t) :: field
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, keyword)
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        call find_amplitude(deck, record, names, field%curve, errors)
        if (.not. record%is_valid) cycle
        call check_lines(deck, record, errors)
        field%first_step = step_of(record%step)
        if (keyword == "FIELD") field%variable = 1 + option_integer(deck, record, "VARIABLE")
        if (option_text(deck, record, "OP") == "NEW") then
          where (scene%fields%variable == field%variable .and. scene%fields%first_step > 0)
            scene%fields%last_step = end_before(field%first_step, scene%fields%first_step, &
                                                scene%fields%last_step)
          end where
        end if
        call read_lines(deck, record, frame, names, field, scene, errors)
      end associate
    end do
  end subroutine read_changes

  !> Append the data lines of one record.
  subroutine read_lines(deck, record, frame, names, start, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(field_spec_t), intent(in) :: start       !! what all lines have in common
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(field_spec_t) :: field
    integer :: line, i

    field = start
    do line = 1, record%n_lines
      field%origin = line_origin(deck, record, line)
      field%value = field_real(record, line, 2)
      field%gradient = [(field_real(record, line, 2 + i), i=1, 3)]
      call find_set(names, frame, field_word(record, line, 1), field%origin, scene, field%set, &
                    errors)
      scene%fields = [scene%fields, field]
    end do
  end subroutine read_lines

  !> What would be without effect, or half an effect only.
  subroutine check_material(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i

    if (size(scene%fields) == 0 .or. scene%blank%material == 0) return
    associate (material => scene%materials(scene%blank%material), fields => scene%fields)
      if (.not. is_user_material(material)) then
        call warn_of_none(material, fields(1), errors)
      else if (any(fields%variable == 1 .and. fields%first_step > 0)) then
        if (allocated(material%plasticity%heating)) call add_error(errors, material%origin, &
          "*ADIABATIC HEATING with *TEMPERATURE", "one of them: points that heat themselves "// &
          "have no temperature that is given")
        do i = 1, deck%lexed%n_blocks
          if (deck%lexed%blocks(i)%keyword == "EXPANSION") call add_error(errors, &
            deck%records(i)%origin, "*EXPANSION with temperatures that change", "none: strains "// &
            "of expansion are not computed; the user's law may subtract its own, with DTEMP")
        end do
      end if
    end associate
  end subroutine check_material

  !> A built-in law does not depend on fields.
  subroutine warn_of_none(material, field, errors)
    type(material_spec_t), intent(in) :: material
    type(field_spec_t), intent(in) :: field
    type(error_list_t), intent(inout) :: errors

    call add_warning(errors, field%origin, "a temperature or field variable of the "// &
                     "material "//material%name//", which does not depend on it", &
                     "*USER MATERIAL, or none; *ADIABATIC HEATING has a T_start of its own")
  end subroutine warn_of_none

end module field_reader
