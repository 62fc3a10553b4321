!> The steps of a deck: which keyword stands in which, and which may.
module deck_steps
  use input_errors, only: error_list_t, add_error
  use text, only: to_text
  use deck_records, only: parsed_deck_t, find_records
  implicit none
  private

  public :: number_steps, check_steps, may_stand_in_step, n_deck_steps, first_in_step, step_of

  character(*), parameter :: of_step(22) = [character(18) :: "STEP", "END STEP", "DYNAMIC", &
    "TOOL FORCE", "BOUNDARY", "TOOL MOTION", "PRESSURE", "TRACTION", "GRAVITY", "CONTACT PAIR", &
    "MODEL CHANGE", "DAMPING", "DYNAMIC RELAXATION", "OUTPUT", "ENERGY LIMIT", &
    "PENETRATION LIMIT", "PARAMETER", "INCLUDE", "SET", "DRAW BEAD", "TEMPERATURE", "FIELD"]
  !> Of the first step, for all.
  character(*), parameter :: of_first_step(2) = [character(14) :: "MASS SCALING", "BULK VISCOSITY"]

contains

  !> Give every record the number of its step. What stands before the first has 0.
  pure subroutine number_steps(deck)
    type(parsed_deck_t), intent(inout) :: deck
    integer, allocatable :: starts(:)
    integer :: i

    starts = find_records(deck, "STEP")
    do i = 1, size(deck%records)
      deck%records(i)%step = count(starts <= i)
    end do
  end subroutine number_steps

  !> Number of *STEP in the deck; a deck without has one step.
  pure integer function n_deck_steps(deck)
    type(parsed_deck_t), intent(in) :: deck

    n_deck_steps = size(find_records(deck, "STEP"))
  end function n_deck_steps

  !> Step with which begins what a record says.
  elemental integer function step_of(record_step) result(step)
    integer, intent(in) :: record_step   !! of the record, 0: before the first

    step = max(1, record_step)
  end function step_of

  !> The first record of a keyword that begins with a step; 0 if there is none or it has errors.
  pure integer function first_in_step(deck, keyword, step)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    integer, intent(in) :: step
    integer, allocatable :: found(:)

    found = find_records(deck, keyword)
    found = pack(found, step_of(deck%records(found)%step) == step)
    first_in_step = 0
    if (size(found) == 0) return
    if (deck%records(found(1))%is_valid) first_in_step = found(1)
  end function first_in_step

  !> Errors for keywords in the wrong place, and for steps without end or *DYNAMIC.
  subroutine check_steps(deck, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: name
    integer, allocatable :: starts(:)
    logical :: is_open
    integer :: i

    starts = find_records(deck, "STEP")
    is_open = .false.
    do i = 1, size(deck%records)
      associate (record => deck%records(i))
        if (record%spec == 0) cycle
        name = trim(deck%table%items(record%spec)%name)
        if (name == "STEP") then
          if (is_open) call add_error(errors, record%origin, "the step of line "//to_text( &
            deck%records(starts(record%step - 1))%origin%line)//" still open", &
            "an *END STEP before it")
          is_open = .true.
        else if (name == "END STEP") then
          if (.not. is_open) call add_error(errors, record%origin, "no step to end", &
                                            "a *STEP before it")
          is_open = .false.
        else if (size(starts) == 0) then
          if (name == "MODEL CHANGE") call add_error(errors, record%origin, "no step that it "// &
                                                     "begins with", "a place behind a *STEP")
        else
          call check_place(name, i, is_open, deck, errors)
        end if
      end associate
    end do
    if (is_open) call add_error(errors, deck%records(starts(size(starts)))%origin, &
                                "a step that does not end", "an *END STEP at its end")
    do i = 1, size(starts)
      if (any(deck%records(find_records(deck, "DYNAMIC"))%step == i)) cycle
      call add_error(errors, deck%records(starts(i))%origin, "no *DYNAMIC in step "//to_text(i), &
                     "one *DYNAMIC in every step")
    end do
  end subroutine check_steps

  !> Is it a keyword of a step, of the first one at least?
  pure logical function may_stand_in_step(name)
    character(*), intent(in) :: name

    may_stand_in_step = any(of_step == name) .or. any(of_first_step == name)
  end function may_stand_in_step

  !> One keyword of a deck with steps.
  subroutine check_place(name, i, is_open, deck, errors)
    character(*), intent(in) :: name
    integer, intent(in) :: i             !! the record
    logical, intent(in) :: is_open       !! it stands in a step
    type(parsed_deck_t), intent(in) :: deck
    type(error_list_t), intent(inout) :: errors

    associate (record => deck%records(i))
      if (record%step == 0) then
        if (name == "DYNAMIC" .or. name == "MODEL CHANGE") &
          call add_error(errors, record%origin, "a place before the first *STEP", &
                         "a place in a step")
      else if (name == "PARAMETER" .or. name == "INCLUDE" .or. name == "END") then
        return
      else if (.not. is_open) then
        call add_error(errors, record%origin, "a place behind *END STEP", &
          trim(merge("a place in a step, or before the first", &
                     "a place before the first *STEP        ", may_stand_in_step(name))))
      else if (any(of_first_step == name)) then
        if (record%step > 1) call add_error(errors, record%origin, "it in a later step", &
          "it before the first *STEP or in the first step; it holds in all")
      else if (.not. may_stand_in_step(name)) then
        call add_error(errors, record%origin, "it in a step", "a place before the first *STEP")
      end if
    end associate
  end subroutine check_place

end module deck_steps
