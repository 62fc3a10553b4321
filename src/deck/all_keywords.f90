!> The readers of all keywords, and those of title and units and of the reduction of the scene.
module all_keywords
  use embedded_page, only: embedded_page_text
  use keyword_spec, only: in_first_step, in_any_step, inside_step, needs_step, bounds_step, &
                          anywhere, names_material, names_curve, names_patch, names_tool, &
                          names_set, names_point
  use keyword_table, only: keyword_table_t, add_keywords, set_keyword
  use material_keywords, only: read_materials
  use test_keywords, only: read_tests
  use blank_keywords, only: read_blank
  use outline_keywords, only: read_outlines
  use tool_keywords, only: read_tools, read_placements
  use near_refinement, only: refine_near_tools
  use motion_keywords, only: read_amplitudes, read_tool_motions
  use contact_keywords, only: read_contacts, read_beads
  use set_keywords, only: read_sets
  use boundary_keywords, only: read_boundaries, read_loads
  use initial_keywords, only: read_initial_conditions, read_field_variables, read_test_starts
  use step_keywords, only: read_changes, read_steps
  use output_keywords, only: read_checkpoints, read_probes
  use input_errors, only: error_list_t
  use scene, only: scene_t
  use deck_records, only: parsed_deck_t, first_record, option_real, option_text, is_option_given, &
                          field_word, deck_context_t
  implicit none
  private

  public :: list_keywords

contains

  !> All keywords in the order of the page, in which they are also read: what a reader looks up in
  !! the scene, such as tools, comes before it.
  subroutine list_keywords(table, others)
    type(keyword_table_t), intent(out) :: table
    type(keyword_table_t), intent(in), optional :: others   !! taken instead

    if (present(others)) then
      table = others
      return
    end if
    call add_keywords(table, embedded_page_text())
    call set_keyword(table, "HEADING", words="title", is_in_digest=.false., read=read_labels, &
                     read_test=read_labels)
    call set_keyword(table, "UNITS", words="units")
    call set_keyword(table, "INCLUDE", anywhere, is_in_digest=.false.)
    call set_keyword(table, "END", anywhere, is_in_digest=.false.)
    call set_keyword(table, "PARAMETER", anywhere, is_in_digest=.false.)
    call set_keyword(table, "REDUCE", read=read_reduction)
    call set_keyword(table, "MATERIAL", names=names_material, read=read_materials, &
                     read_test=read_materials)
    call set_keyword(table, "MATERIAL TEST", read=read_tests, read_test=read_tests)
    call set_keyword(table, "BLANK", names=names_patch, is_required=.true., read=read_blank)
    call set_keyword(table, "PATCH", names=names_patch)
    call set_keyword(table, "BLANK OUTLINE", read=read_outlines)
    call set_keyword(table, "TOOL", names=names_tool, read=read_tools)
    call set_keyword(table, "TOOL PLACEMENT", read=read_placements)
    call set_keyword(table, "REFINE", read=refine_near_tools)
    call set_keyword(table, "AMPLITUDE", names=names_curve, read=read_amplitudes)
    call set_keyword(table, "TOOL MOTION", in_any_step, read=read_tool_motions)
    call set_keyword(table, "TOOL FORCE", in_any_step)
    call set_keyword(table, "CONTACT PAIR", in_any_step, read=read_contacts)
    call set_keyword(table, "DRAW BEAD", in_any_step, n_min=2, read=read_beads)
    call set_keyword(table, "SET", in_any_step, names=names_set, read=read_sets)
    call set_keyword(table, "BOUNDARY", in_any_step, read=read_boundaries)
    call set_keyword(table, "PRESSURE", in_any_step, read=read_loads)
    call set_keyword(table, "TRACTION", in_any_step)
    call set_keyword(table, "GRAVITY", in_any_step)
    call set_keyword(table, "INITIAL CONDITIONS", read=read_initial_conditions, &
                     read_test=read_test_starts)
    call set_keyword(table, "TEMPERATURE", in_any_step)
    call set_keyword(table, "FIELD", in_any_step, read=read_field_variables)
    call set_keyword(table, "STEP", bounds_step)
    call set_keyword(table, "END STEP", bounds_step, is_in_digest=.false.)
    call set_keyword(table, "MODEL CHANGE", needs_step, read=read_changes)
    call set_keyword(table, "TRIM", needs_step)
    call set_keyword(table, "DYNAMIC", inside_step, read=read_steps)
    call set_keyword(table, "STATIC", inside_step)
    call set_keyword(table, "FREQUENCY", inside_step)
    call set_keyword(table, "BULK VISCOSITY", in_first_step)
    call set_keyword(table, "ENERGY LIMIT", in_any_step)
    call set_keyword(table, "PENETRATION LIMIT", in_any_step)
    call set_keyword(table, "DAMPING", in_any_step)
    call set_keyword(table, "DYNAMIC RELAXATION", in_any_step)
    call set_keyword(table, "MASS SCALING", in_first_step)
    call set_keyword(table, "HISTORY POINT", names=names_point, read=read_probes)
    call set_keyword(table, "OUTPUT", in_any_step, is_in_digest=.false.)
    call set_keyword(table, "CHECKPOINT", is_in_digest=.false., read=read_checkpoints)
  end subroutine list_keywords

  !> What a deck wants to be reduced.
  subroutine read_reduction(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i

    i = first_record(deck, "REDUCE")
    if (i == 0) return
    associate (record => deck%records(i))
      scene%reduction%origin = record%origin
      scene%reduction%component = index("XYZ", option_text(record, "AXIS"))
      if (.not. is_option_given(record, "AXIS")) scene%reduction%component = 0
      if (is_option_given(record, "WIDTH")) scene%reduction%width = option_real(record, "WIDTH")
    end associate
  end subroutine read_reduction

  !> Heading and units; of several headings the first counts.
  subroutine read_labels(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i, line

    scene%heading = ""
    scene%units = ""
    i = first_record(deck, "HEADING")
    if (i > 0) then
      do line = 1, deck%records(i)%n_lines
        if (line > 1) scene%heading = scene%heading//new_line("a")
        scene%heading = scene%heading//trim(adjustl(field_word(deck%records(i), line, 1)))
      end do
    end if
    i = first_record(deck, "UNITS")
    if (i > 0) scene%units = trim(adjustl(field_word(deck%records(i), 1, 1)))
  end subroutine read_labels

end module all_keywords
