!> *INITIAL CONDITIONS, and *TEMPERATURE and *FIELD during the run.
module initial_keywords
  use kinds, only: wp
  use input_errors, only: origin_t, error_list_t, add_error, add_warning
  use text, only: upper_case, read_real, counted
  use scene, only: scene_t, initial_state_spec_t, is_user_material, material_spec_t, field_spec_t, &
                   initial_velocity_spec_t
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, line_origin, &
                          field_word, field_real, field_integer, is_filled, n_fields, &
                          option_integer, deck_context_t, step_of, check_lines, end_before, &
                          field_vector, n_data_lines
  use motion_keywords, only: find_amplitude
  use set_keywords, only: find_set
  implicit none
  private

  public :: read_initial_conditions, read_field_variables, read_test_starts

  integer, parameter :: on_a_line = 8   ! entries of *INITIAL CONDITIONS, TYPE=SOLUTION

contains

  !> Fill the list of initial velocities, one for each data line of *INITIAL CONDITIONS.
  subroutine read_initial_velocities(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(initial_velocity_spec_t) :: start, none
    integer, allocatable :: found(:)
    integer :: i, line, n

    allocate (scene%initial_velocities(n_data_lines(deck, "INITIAL CONDITIONS")))
    found = find_records(deck, "INITIAL CONDITIONS")
    n = 0
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. record%is_valid) cycle
        if (index(option_text(record, "TYPE"), "VELOCITY") == 0) cycle
        do line = 1, record%n_lines
          start = none
          start%origin = line_origin(deck, record, line)
          call find_set(context, field_word(record, line, 1), start%origin, scene, start%set, &
                        errors)
          if (option_text(record, "TYPE") == "VELOCITY") then
            start%velocity(field_integer(record, line, 2)) = field_real(record, line, 3)
          else
            start%omega = field_vector(record, line, 2)
            start%centre = field_vector(record, line, 5)
          end if
          n = n + 1
          scene%initial_velocities(n) = start
        end do
      end associate
    end do
    scene%initial_velocities = scene%initial_velocities(:n)
  end subroutine read_initial_velocities

  !> Give the tests of a material deck, which has no sets, the states that its lines for ALL give.
  subroutine read_test_states(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene        !! with its materials and tests
    type(error_list_t), intent(inout) :: errors
    type(initial_state_spec_t), allocatable :: starts(:)
    integer :: i, k

    call list_states(deck, starts, errors)
    do i = 1, size(starts)
      if (upper_case(starts(i)%name) == "ALL") cycle
      call warn_of_set(starts(i)%name, starts(i)%origin, errors)
    end do
    do i = 1, size(scene%tests)
      associate (test => scene%tests(i))
        allocate (test%state(0), test%state_names(0))
        do k = 1, size(starts)
          if (upper_case(starts(k)%name) /= "ALL") cycle
          test%state = starts(k)%values
          test%state_origin = starts(k)%origin
        end do
        if (test%material == 0) cycle
        if (allocated(scene%materials(test%material)%state_names)) &
          test%state_names = scene%materials(test%material)%state_names
      end associate
    end do
  end subroutine read_test_states

  !> A material test has no sets.
  subroutine warn_of_set(name, origin, errors)
    character(*), intent(in) :: name
    type(origin_t), intent(in) :: origin
    type(error_list_t), intent(inout) :: errors

    call add_warning(errors, origin, "the set "//name//", in which the point of a material "// &
                     "test does not lie", "ALL for a start of the tests")
  end subroutine warn_of_set

  !> Names of sets with their state variables, as Abaqus places them: eight entries on a line, the
  !! name of the set being the first. A line that begins with a number goes on with the values of
  !! the line before, which counts as filled up with zeros.
  subroutine list_states(deck, starts, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(initial_state_spec_t), allocatable, intent(out) :: starts(:)
    type(error_list_t), intent(inout) :: errors
    type(initial_state_spec_t) :: start
    integer, allocatable :: found(:)
    real(wp) :: number
    logical :: is_number
    integer :: i, line, n_full

    allocate (starts(0))
    found = find_records(deck, "INITIAL CONDITIONS")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. record%is_valid) cycle
        if (option_text(record, "TYPE") /= "SOLUTION") cycle
        n_full = 0
        do line = 1, record%n_lines
          start%name = field_word(record, line, 1)
          start%values = line_values(deck, record, line, errors)
          call read_real(start%name, number, is_number)
          if (is_number .and. line > 1) then
            associate (last => starts(size(starts)))
              if (size(last%values) < n_full) call add_warning(errors, line_origin(deck, record, &
                line - 1), "a line of fewer than eight entries that continues", "eight, the "// &
                "set among them: what is missing counts as state variables that are zero")
              last%values = [last%values, spread(0.0_wp, 1, max(0, n_full - size(last%values))), &
                             number, start%values]
              n_full = n_full + on_a_line
            end associate
            cycle
          end if
          n_full = on_a_line - 1
          start%origin = line_origin(deck, record, line)
          starts = [starts, start]
        end do
      end associate
    end do
  end subroutine list_states

  !> The numbers behind the first entry of a line.
  function line_values(deck, record, line, errors) result(values)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: values(:)
    integer :: j

    values = [(field_real(record, line, j), j=2, n_fields(record, line))]
    if (.not. is_filled(record, line, n_fields(record, line))) values = values(:size(values) - 1)
    if (size(values) >= on_a_line) then
      call add_error(errors, line_origin(deck, record, line), counted(size(values) + 1, &
                     "entry", "entries")//" on a line", "eight at most: the set and seven "// &
                     "state variables, or eight of these")
    end if
  end function line_values

  !> Velocities, state variables and fields at the start.
  subroutine read_initial_conditions(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    type(field_spec_t) :: field
    integer :: i

    call read_initial_velocities(deck, context, scene, errors)
    call list_states(deck, scene%initial_states, errors)
    do i = 1, size(scene%initial_states)
      associate (start => scene%initial_states(i))
        call find_set(context, start%name, start%origin, scene, start%set, errors)
      end associate
    end do
    allocate (scene%fields(0))
    found = find_records(deck, "INITIAL CONDITIONS")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        field%variable = start_variable(record)
        if (field%variable > 0) call read_lines(deck, record, context, field, scene, errors)
      end associate
    end do
  end subroutine read_initial_conditions

  !> Temperatures and field variables that change; all fields are known then.
  subroutine read_field_variables(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors

    call read_changes(deck, "TEMPERATURE", context, scene, errors)
    call read_changes(deck, "FIELD", context, scene, errors)
    call check_material(deck, scene, errors)
  end subroutine read_field_variables

  !> State variables and fields at the start for material tests.
  subroutine read_test_starts(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors

    call read_test_states(deck, scene, errors)
    call read_test_fields(deck, scene, errors)
  end subroutine read_test_starts

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
    integer :: i, line

    allocate (starts(0))
    found = find_records(deck, "INITIAL CONDITIONS")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        start%variable = start_variable(record)
        if (start%variable == 0) cycle
        do line = 1, record%n_lines
          start%origin = line_origin(deck, record, line)
          start%value = field_real(record, line, 2)
          if (upper_case(field_word(record, line, 1)) /= "ALL") then
            call warn_of_set(field_word(record, line, 1), start%origin, errors)
          else if (any(abs(field_vector(record, line, 3)) > 0.0_wp)) then
            call add_error(errors, start%origin, "a change along x, y or z for a material test", &
                           "one value: its point has no position")
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
  integer function start_variable(record) result(variable)
    type(record_t), intent(in) :: record

    variable = 0
    if (.not. record%is_valid) return
    select case (option_text(record, "TYPE"))
    case ("TEMPERATURE")
      variable = 1
    case ("FIELD")
      variable = 1 + option_integer(record, "VARIABLE")
    end select
  end function start_variable

  !> *TEMPERATURE or *FIELD.
  subroutine read_changes(deck, keyword, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(field_spec_t) :: field
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, keyword)
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        call find_amplitude(record, context, field%curve, errors)
        if (.not. record%is_valid) cycle
        call check_lines(record, errors)
        field%first_step = step_of(record%step)
        if (keyword == "FIELD") field%variable = 1 + option_integer(record, "VARIABLE")
        if (option_text(record, "OP") == "NEW") then
          where (scene%fields%variable == field%variable .and. scene%fields%first_step > 0)
            scene%fields%last_step = end_before(field%first_step, scene%fields%first_step, &
                                                scene%fields%last_step)
          end where
        end if
        call read_lines(deck, record, context, field, scene, errors)
      end associate
    end do
  end subroutine read_changes

  !> Append the data lines of one record.
  subroutine read_lines(deck, record, context, start, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(deck_context_t), intent(inout) :: context
    type(field_spec_t), intent(in) :: start       !! what all lines have in common
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(field_spec_t) :: field
    integer :: line

    field = start
    do line = 1, record%n_lines
      field%origin = line_origin(deck, record, line)
      field%value = field_real(record, line, 2)
      field%gradient = field_vector(record, line, 3)
      call find_set(context, field_word(record, line, 1), field%origin, scene, field%set, &
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

end module initial_keywords
