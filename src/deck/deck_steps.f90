!> The steps of a deck: which keyword stands in which, and which may.
module deck_steps
  use input_errors, only: error_list_t, add_error
  use text, only: to_text
  use keyword_spec, only: keyword_spec_t, in_first_step, in_any_step, inside_step, needs_step, &
                          bounds_step, anywhere
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text
  implicit none
  private

  public :: number_steps, check_steps, may_be_in_step, n_deck_steps, first_in_step, step_of
  public :: check_lines, n_data_lines, end_before

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
        name = deck%keywords(record%spec)%name
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
          if (deck%keywords(record%spec)%place == needs_step) call add_error(errors, &
            record%origin, "no step that it belongs to", "it in a *STEP")
        else
          call check_place(deck%keywords(record%spec), record, is_open, errors)
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

  !> May a keyword appear in a step, in the first one at least?
  pure logical function may_be_in_step(keyword)
    class(keyword_spec_t), intent(in) :: keyword

    may_be_in_step = any(keyword%place == [in_first_step, in_any_step, inside_step, needs_step, &
                                           bounds_step])
  end function may_be_in_step

  !> One keyword of a deck with steps.
  subroutine check_place(keyword, record, is_open, errors)
    type(keyword_spec_t), intent(in) :: keyword
    type(record_t), intent(in) :: record
    logical, intent(in) :: is_open       !! the record is in a step
    type(error_list_t), intent(inout) :: errors

    if (record%step == 0) then
      if (keyword%place == inside_step .or. keyword%place == needs_step) &
        call add_error(errors, record%origin, "it before the first *STEP", "it in a step")
    else if (keyword%place == anywhere) then
      return
    else if (.not. is_open) then
      call add_error(errors, record%origin, "it after *END STEP", &
                     trim(merge("it in a step, or before the first", &
                                "it before the first *STEP        ", may_be_in_step(keyword))))
    else if (keyword%place == in_first_step) then
      if (record%step > 1) call add_error(errors, record%origin, "it in a later step", &
        "it before the first *STEP or in the first step; it applies in all")
    else if (.not. may_be_in_step(keyword)) then
      call add_error(errors, record%origin, "it in a step", "it before the first *STEP")
    end if
  end subroutine check_place

  !> Number of data lines of all records of a keyword.
  pure integer function n_data_lines(deck, keyword)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword

    n_data_lines = sum(deck%records(find_records(deck, keyword))%n_lines)
  end function n_data_lines

  !> Only a record with OP=NEW may have no data lines.
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

end module deck_steps
