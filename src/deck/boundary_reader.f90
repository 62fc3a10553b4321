!> *BOUNDARY and *INITIAL CONDITIONS.
module boundary_reader
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error, add_warning
  use text, only: upper_case, to_text, read_integer, read_real
  use scene, only: scene_t, boundary_spec_t, initial_state_spec_t
  use deck_names, only: deck_names_t
  use deck_steps, only: step_of
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, line_origin, &
                          field_word, field_real, field_integer, is_filled, n_fields
  use blank_reader, only: box_frame_t
  use motion_reader, only: find_amplitude
  use set_reader, only: find_set
  implicit none
  private

  public :: read_boundaries, read_initial_velocities, read_initial_states, read_test_states, &
            n_data_lines, check_lines, end_before

  integer, parameter :: on_a_line = 8   ! entries of *INITIAL CONDITIONS, TYPE=SOLUTION

contains

  !> Number of data lines of all records of a keyword.
  pure integer function n_data_lines(deck, keyword)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword

    n_data_lines = sum(deck%records(find_records(deck, keyword))%n_lines)
  end function n_data_lines

  !> Only OP=NEW may do without data lines.
  subroutine check_lines(deck, record, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(error_list_t), intent(inout) :: errors

    if (record%n_lines > 0 .or. option_text(deck, record, "OP") == "NEW") return
    call add_error(errors, record%origin, "0 data lines", "1 data line or more, or OP=NEW")
  end subroutine check_lines

  !> Last step of what earlier steps gave and this one removes; what the step itself gives stays.
  elemental integer function end_before(step, first_step, last_step) result(last)
    integer, intent(in) :: step, first_step, last_step

    last = last_step
    if (first_step < step) last = min(last, step - 1)
  end function end_before

  !> Fill the list of boundary conditions, one for each data line of *BOUNDARY.
  subroutine read_boundaries(deck, frame, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, line, n, set, curve, step

    allocate (scene%boundaries(n_data_lines(deck, "BOUNDARY")))
    found = find_records(deck, "BOUNDARY")
    n = 0
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        call find_amplitude(deck, record, names, curve, errors)
        if (.not. record%is_valid) cycle
        step = step_of(record%step)
        call check_lines(deck, record, errors)
        associate (before => scene%boundaries(:n))
          if (option_text(deck, record, "OP") == "NEW") &
            before%last_step = end_before(step, before%first_step, before%last_step)
        end associate
        do line = 1, record%n_lines
          n = n + 1
          scene%boundaries(n)%curve = curve
          scene%boundaries(n)%first_step = step
          scene%boundaries(n)%origin = line_origin(deck, record, line)
          call read_components(record, line, scene%boundaries(n), errors)
          call find_set(names, frame, field_word(record, line, 1), &
                        line_origin(deck, record, line), scene, set, errors)
          scene%boundaries(n)%set = set
        end do
      end associate
    end do
  end subroutine read_boundaries

  !> Which components a line prescribes, by number or by one of the names of Abaqus.
  subroutine read_components(record, line, boundary, errors)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    type(boundary_spec_t), intent(inout) :: boundary
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: word
    integer :: first, last
    logical :: is_number

    word = upper_case(field_word(record, line, 2))
    call read_integer(word, first, is_number)
    if (is_number) then
      last = first
      if (is_filled(record, line, 3)) last = field_integer(record, line, 3)
      is_number = first >= 1 .and. last <= 3 .and. first <= last
      if (is_number) boundary%is_prescribed(first:last) = .true.
    else
      select case (word)
      case ("XSYMM"); boundary%is_prescribed(1) = .true.
      case ("YSYMM"); boundary%is_prescribed(2) = .true.
      case ("ZSYMM"); boundary%is_prescribed(3) = .true.
      case ("PINNED", "ENCASTRE"); boundary%is_prescribed = .true.
      end select
      if (is_filled(record, line, 3)) boundary%is_prescribed = .false.
    end if
    boundary%velocity = merge(field_real(record, line, 4), 0.0_wp, boundary%is_prescribed)
    if (.not. any(boundary%is_prescribed)) then
      call add_error(errors, boundary%origin, "`"//word//"` for the components", "1, 2 or 3, "// &
                     "first and last, or one of XSYMM, YSYMM, ZSYMM, PINNED, ENCASTRE alone")
    end if
  end subroutine read_components

  !> Fill the list of initial velocities, one for each data line of *INITIAL CONDITIONS.
  subroutine read_initial_velocities(deck, frame, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, j, line, n, set

    allocate (scene%initial_velocities(n_data_lines(deck, "INITIAL CONDITIONS")))
    found = find_records(deck, "INITIAL CONDITIONS")
    n = 0
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. record%is_valid) cycle
        if (index(option_text(deck, record, "TYPE"), "VELOCITY") == 0) cycle
        do line = 1, record%n_lines
          n = n + 1
          call find_set(names, frame, field_word(record, line, 1), &
                        line_origin(deck, record, line), scene, set, errors)
          associate (start => scene%initial_velocities(n))
            start%origin = line_origin(deck, record, line)
            start%set = set
            if (option_text(deck, record, "TYPE") == "VELOCITY") then
              start%velocity(field_integer(record, line, 2)) = field_real(record, line, 3)
            else
              start%omega = [(field_real(record, line, 1 + j), j=1, 3)]
              start%centre = [(field_real(record, line, 4 + j), j=1, 3)]
            end if
          end associate
        end do
      end associate
    end do
    scene%initial_velocities = scene%initial_velocities(:n)
  end subroutine read_initial_velocities

  !> Fill the list of initial states, one for each set that *INITIAL CONDITIONS, TYPE=SOLUTION
  !! names.
  subroutine read_initial_states(deck, frame, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i

    call list_states(deck, scene%initial_states, errors)
    do i = 1, size(scene%initial_states)
      associate (start => scene%initial_states(i))
        call find_set(names, frame, start%name, start%origin, scene, start%set, errors)
      end associate
    end do
  end subroutine read_initial_states

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
      call add_warning(errors, starts(i)%origin, "the set "//starts(i)%name//", in which the "// &
                       "point of a material test does not lie", "ALL for a start of the tests")
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
        if (option_text(deck, record, "TYPE") /= "SOLUTION") cycle
        n_full = 0
        do line = 1, record%n_lines
          start%name = field_word(record, line, 1)
          start%values = line_values(deck, record, line, errors)
          call read_real(start%name, number, is_number)
          if (is_number .and. line > 1) then
            associate (last => starts(size(starts)))
              if (size(last%values) < n_full) call add_warning(errors, line_origin(deck, record, &
                line - 1), "a line with less than eight entries, which goes on", "eight, the "// &
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
      call add_error(errors, line_origin(deck, record, line), to_text(size(values) + 1)// &
                     " entries on a line", "eight at most: the set and seven state variables, "// &
                     "or eight of these")
    end if
  end function line_values

end module boundary_reader
