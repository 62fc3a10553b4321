!> The entry of the keyword table for checkpoints, and its reader.
module run_keywords
  use input_errors, only: error_list_t, add_error
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_example, kind_real, &
                          kind_integer, kind_flag
  use scene, only: scene_t
  use deck_records, only: parsed_deck_t, find_records, option_real, option_integer, is_option_given
  implicit none
  private

  public :: add_run_keywords, read_checkpoints

  integer, parameter :: usual_number = 10

contains

  !> Add *CHECKPOINT.
  pure subroutine add_run_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "CHECKPOINT", "Saves the state in regular intervals, and at the "// &
                     "end, to NAME.ckpt.h5 beside the result: `--restart NAME.ckpt.h5` goes on "// &
                     "from there bit by bit the same. Whichever interval is over first counts; "// &
                     "without any, NUMBER is 10. A deck without this keyword saves every 15 "// &
                     "minutes of the clock, and the file goes when the run is complete. "// &
                     "Signals, `--wall` and failures save the state in any case, see "// &
                     "docs/running.md.", is_unique=.true.)
    call add_option(table, "OFF", kind_flag, "saves in no intervals")
    call add_option(table, "STEPS", kind_integer, "time steps between two checkpoints; below "// &
                    "21 they are 21 apart, for 20 further steps prove each state; 0: none", &
                    default="0", range=">= 0")
    call add_option(table, "MINUTES", kind_real, "minutes of the clock between them; 0: none", &
                    default="0", unit="min", range=">= 0")
    call add_option(table, "NUMBER", kind_integer, "checkpoints over the run; 0: none", &
                    default="0", range=">= 0")
    call add_option(table, "WALL", kind_real, "minutes of the clock after which the state is "// &
                    "saved and the run stops with exit code 3, as with `--wall`; 0: never", &
                    default="0", unit="min", range=">= 0")
    call add_option(table, "RETRY", kind_real, "factor below 1 on the time step for one "// &
                    "more try from the last good state if the numerics fail; 0: none", &
                    default="0", range=">= 0")
    call add_example(table, "*CHECKPOINT, MINUTES=15, RETRY=0.5")
  end subroutine add_run_keywords

  !> Take *CHECKPOINT.
  subroutine read_checkpoints(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    logical :: is_off

    found = find_records(deck, "CHECKPOINT")
    if (size(found) == 0) return
    if (.not. deck%records(found(1))%is_valid) return
    associate (record => deck%records(found(1)), spec => scene%checkpoints)
      spec%n_steps = option_integer(deck, record, "STEPS")
      spec%minutes = option_real(deck, record, "MINUTES")
      spec%number = option_integer(deck, record, "NUMBER")
      spec%wall_minutes = option_real(deck, record, "WALL")
      spec%retry = option_real(deck, record, "RETRY")
      is_off = is_option_given(deck, record, "OFF")
      spec%is_lasting = spec%n_steps > 0 .or. spec%number > 0 .or. spec%minutes > 0
      if (is_off .and. spec%is_lasting) call add_error(errors, record%origin, &
        "OFF beside an interval", "either OFF or STEPS, MINUTES, NUMBER")
      if (.not. (is_off .or. spec%is_lasting)) then
        spec%number = usual_number
        spec%is_lasting = .true.
      end if
      if (spec%retry > 0.99) call add_error(errors, record%origin, "a RETRY that leaves the "// &
        "time step as it was", "a factor below 0.99")
    end associate
  end subroutine read_checkpoints

end module run_keywords
