!> The summary of a batch, as a table on the terminal and as CSV. It is read from the result files,
!! so it is the same whoever has carried out the runs.
module batch_table
  use, intrinsic :: iso_fortran_env, only: output_unit
  use kinds, only: wp
  use text, only: string_t, to_text, rounded_text
  use failure, only: error_t, fail
  use result_state, only: result_state_t, read_result_state
  use file_lock, only: is_locked_by_others
  use whole_file, only: why_left_alone, write_lines
  use message_files, only: first_error, is_noted_as_failed
  use exit_codes, only: exit_done, exit_input, exit_numerics, exit_interrupted
  use batch_list, only: batch_run_t
  implicit none
  private

  public :: outcome_t, outcome_of, is_final, print_table, write_table, summary_words, worst_code

  !> How a run stands.
  type :: outcome_t
    character(:), allocatable :: status    !! completed, failed, interrupted, refused, running, due
    character(:), allocatable :: message   !! first error it reported; empty: none
    type(result_state_t) :: state
  end type outcome_t

  character(*), parameter :: header = &
    "line,status,steps,wall_seconds,energy_error,result,message,command"

contains

  !> How a run stands: by its result, if that belongs to this very deck and program.
  function outcome_of(run, identity) result(outcome)
    type(batch_run_t), intent(in) :: run
    character(*), intent(in) :: identity       !! that its result must have
    type(outcome_t) :: outcome

    call read_result_state(run%result_file, outcome%state)
    outcome%status = "due"
    outcome%message = first_error(run%base//".err")
    if (outcome%state%identity == identity) then
      outcome%status = outcome%state%status
      if (outcome%status == "running" .or. outcome%status == "") then
        outcome%state%status = ""
        outcome%status = "interrupted"
        if (is_noted_as_failed(run%base//".err", identity)) outcome%status = "failed"
        if (is_under_way(run)) outcome%status = "running"
      end if
    else
      outcome%state%status = ""
      if (outcome%message /= "") outcome%status = "refused"
      if (is_noted_as_failed(run%base//".err", identity)) outcome%status = "failed"
      if (is_under_way(run)) outcome%status = "running"
    end if
    if (outcome%status == "completed") outcome%message = ""
  end function outcome_of

  !> Is another program at it? A run holds its log first and its result a little later.
  logical function is_under_way(run)
    type(batch_run_t), intent(in) :: run

    is_under_way = is_locked_by_others(run%base//".log")
    if (.not. is_under_way) is_under_way = is_locked_by_others(run%result_file)
  end function is_under_way

  !> Would the run, once more, end the same, or be in the way of one that is under way? What failed
  !! counts as final where its result says so, not where it crashed or could not read its data.
  pure logical function is_final(outcome)
    type(outcome_t), intent(in) :: outcome

    is_final = any(outcome%status == [character(9) :: "completed", "failed", "running"])
    if (outcome%status == "failed") is_final = outcome%state%status == "failed"
  end function is_final

  !> The exit code of a batch: that of what is most in need of attention, a run that is not at its
  !! end before one that failed before one that was refused.
  pure integer function worst_code(outcomes) result(code)
    type(outcome_t), intent(in) :: outcomes(:)
    integer :: i

    code = exit_done
    do i = 1, size(outcomes)
      select case (outcomes(i)%status)
      case ("completed")
      case ("refused")
        code = max(code, exit_input)
      case ("failed")
        code = max(code, exit_numerics)
      case default
        code = max(code, exit_interrupted)
      end select
    end do
  end function worst_code

  !> The table for people.
  subroutine print_table(runs, outcomes)
    type(batch_run_t), intent(in) :: runs(:)
    type(outcome_t), intent(in) :: outcomes(:)
    integer :: i

    write (output_unit, "(a)") "line  status             steps    wall [s]  energy error  run"
    do i = 1, size(runs)
      associate (o => outcomes(i))
        if (is_final(o)) then
          write (output_unit, "(i4, 2x, a11, i13, f12.1, es14.2, 2x, a)") runs(i)%line, &
            o%status//repeat(" ", 11), nint(o%state%n_steps), o%state%wall_seconds, &
            o%state%energy_error, runs(i)%text
        else
          write (output_unit, "(i4, 2x, a11, 41x, a)") runs(i)%line, o%status//repeat(" ", 11), &
            runs(i)%text
        end if
        if (o%message /= "") write (output_unit, "(19x, a)") o%message
      end associate
    end do
    write (output_unit, "(a)") summary_words(outcomes)
  end subroutine print_table

  !> How many runs stand how, in words.
  function summary_words(outcomes) result(words)
    type(outcome_t), intent(in) :: outcomes(:)
    character(:), allocatable :: words
    character(11), parameter :: kinds(6) = [character(11) :: "completed", "failed", "refused", &
                                            "interrupted", "running", "due"]
    integer :: k, i, n

    words = to_text(size(outcomes))//" runs"
    do k = 1, size(kinds)
      n = 0
      do i = 1, size(outcomes)
        if (outcomes(i)%status == trim(kinds(k))) n = n + 1
      end do
      if (n > 0) words = words//merge(": ", ", ", index(words, ":") == 0)//to_text(n)//" "// &
                         trim(kinds(k))
    end do
  end function summary_words

  !> The table as CSV, put in the place of an older one in one go. Refused: a file of this name
  !! that is no such table.
  subroutine write_table(path, runs, outcomes, error)
    character(*), intent(in) :: path
    type(batch_run_t), intent(in) :: runs(:)
    type(outcome_t), intent(in) :: outcomes(:)
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: lines(size(runs) + 1)
    integer :: i
    character(:), allocatable :: why

    why = why_left_alone(path, header, "summary")
    if (why == "") then
      lines(1)%value = header
      do i = 1, size(runs)
        lines(i + 1)%value = csv_line(runs(i), outcomes(i))
      end do
      call write_lines(path, lines, why)
    end if
    if (why /= "") call fail(error, "summary '"//path//"': "//why)
  end subroutine write_table

  function csv_line(run, outcome) result(line)
    type(batch_run_t), intent(in) :: run
    type(outcome_t), intent(in) :: outcome
    character(:), allocatable :: line

    line = to_text(run%line)//","//outcome%status//","//to_text(nint(outcome%state%n_steps))// &
           ","//rounded_text(outcome%state%wall_seconds)//","// &
           rounded_text(outcome%state%energy_error)//","//quoted(run%result_file)//","// &
           quoted(outcome%message)//","//quoted(run%text)
  end function csv_line

  !> A field of CSV.
  pure function quoted(given) result(field)
    character(*), intent(in) :: given
    character(:), allocatable :: field
    integer :: i

    field = '"'
    do i = 1, len(given)
      field = field//given(i:i)
      if (given(i:i) == '"') field = field//'"'
    end do
    field = field//'"'
  end function quoted

end module batch_table
