!> *HISTORY POINT, *OUTPUT and *CHECKPOINT.
module output_keywords
  use input_errors, only: error_list_t, add_error
  use text, only: squeezed, to_text, upper_case
  use scene, only: scene_t, output_spec_t, probe_spec_t
  use keyword_table, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                           add_example, kind_real, kind_integer, kind_name, kind_choice, &
                           kind_flag, in_any_step, names_point
  use deck_records, only: parsed_deck_t, find_records, option_real, option_integer, &
                          is_option_given, field_real, option_text, deck_context_t, first_in_step
  implicit none
  private

  public :: add_output_keywords, read_output

  integer, parameter :: usual_number = 10

contains

  !> Add *HISTORY POINT, *OUTPUT and *CHECKPOINT.
  subroutine add_output_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "HISTORY POINT", "A point of the blank whose motion is written to "// &
                     "the history.", &
                     alias="PROBE", names=names_point, read=read_probes)
    call add_option(table, "NAME", kind_name, "name in the result file")
    call add_option(table, "PATCH", kind_name, "patch of the blank, the first if none is given", &
                    is_required=.false.)
    call add_line(table, "Coordinates in the ranges of the knots, 0 to 1 for a box.")
    call add_field(table, "xi", kind_real, "parametric coordinate")
    call add_field(table, "eta", kind_real, "parametric coordinate")
    call add_field(table, "zeta", kind_real, "parametric coordinate")
    call add_example(table, "*HISTORY POINT, NAME=middle", "0.5, 0.5, 0.5")

    call add_keyword(table, "OUTPUT", "What is written and how often.", is_unique=.true., &
                     place=in_any_step, is_in_digest=.false.)
    call add_option(table, "FRAMES", kind_integer, "frames of the whole model, at equal "// &
                    "intervals after the one at the start", default="20", range=">= 1")
    call add_option(table, "HISTORY", kind_integer, "history samples of energies and forces, "// &
                    "likewise. Of frames and samples, time steps end at the times of those "// &
                    "that are due more often; the others come with the first step at or after "// &
                    "theirs", default="200", range=">= 1")
    call add_option(table, "CELLS", kind_choice, "cells of the pictures: LAGRANGE for all "// &
                    "readers; BEZIER keeps weights, for readers that know them. Those of the "// &
                    "first step apply in all steps", default="LAGRANGE", choices="LAGRANGE|BEZIER")
    call add_option(table, "FIELDS", kind_choice, "more fields: CONTACT: the pressure of the "// &
                    "contact pairs on blank and tools; WEAR: also pressure times slip on the "// &
                    "tools since the start, gathered in every time step. What one *STEP "// &
                    "asks for is written in all, as frames of a file have the same fields", &
                    default="NONE", &
                    choices="NONE|CONTACT|WEAR")
    call add_example(table, "*OUTPUT, FRAMES=20, HISTORY=200")
    call add_run_keywords(table)
  end subroutine add_output_keywords

  !> Add *CHECKPOINT.
  subroutine add_run_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "CHECKPOINT", "Saves the state in regular intervals, and at the "// &
                     "end, to NAME.ckpt.h5 next to the result: `--restart NAME.ckpt.h5` "// &
                     "continues from there with bitwise identical results. Whichever interval "// &
                     "is over first counts; without any, NUMBER is 10. A deck without this "// &
                     "keyword saves every 15 minutes of wall-clock time, and the file is "// &
                     "deleted when the run is complete. Signals, `--wall` and failures save "// &
                     "the state in any case, see docs/running.md.", is_unique=.true., &
                     is_in_digest=.false., read=read_checkpoints)
    call add_option(table, "OFF", kind_flag, "saves in no intervals")
    call add_option(table, "STEPS", kind_integer, "time steps between two checkpoints; below "// &
                    "21 they are 21 apart, for 20 further steps prove each state; 0: none", &
                    default="0", range=">= 0")
    call add_option(table, "MINUTES", kind_real, "minutes of wall-clock time between them; 0: "// &
                    "none", default="0", unit="min", range=">= 0")
    call add_option(table, "NUMBER", kind_integer, "checkpoints over the run; 0: none", &
                    default="0", range=">= 0")
    call add_option(table, "WALL", kind_real, "minutes of wall-clock time after which the "// &
                    "state is saved and the run stops with exit code 3, as with `--wall`; 0: "// &
                    "never", default="0", unit="min", range=">= 0")
    call add_option(table, "RETRY", kind_real, "factor below 1 on the time step for one "// &
                    "more try from the last verified state if the numerics fail; 0: none", &
                    default="0", range=">= 0")
    call add_example(table, "*CHECKPOINT, MINUTES=15, RETRY=0.5")
  end subroutine add_run_keywords

  !> Take *CHECKPOINT.
  subroutine read_checkpoints(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    logical :: is_off

    found = find_records(deck, "CHECKPOINT")
    if (size(found) == 0) return
    if (.not. deck%records(found(1))%is_valid) return
    associate (record => deck%records(found(1)), spec => scene%checkpoints)
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
        probe%xi = [(field_real(record, 1, a), a=1, 3)]
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
    logical :: is_bezier
    integer :: i

    i = first_in_step(deck, "OUTPUT", number)
    if (i == 0) return
    output%origin = deck%records(i)%origin
    output%n_frames = option_integer(deck%records(i), "FRAMES")
    output%n_history = option_integer(deck%records(i), "HISTORY")
    output%has_wear = output%has_wear .or. option_text(deck%records(i), "FIELDS") == "WEAR"
    output%has_pressure = output%has_pressure .or. option_text(deck%records(i), "FIELDS") /= "NONE"
    is_bezier = option_text(deck%records(i), "CELLS") == "BEZIER"
    if (number == 1) output%is_bezier = is_bezier
    if (is_option_given(deck%records(i), "CELLS") .and. (is_bezier .neqv. output%is_bezier)) &
      call add_error(errors, output%origin, "CELLS="//option_text(deck%records(i), "CELLS") &
                     //", which are not those of the first step", "the cells in the first "// &
                     "step alone; they apply in all steps")
  end subroutine read_output

end module output_keywords
