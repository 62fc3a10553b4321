!> The list of all families of keywords, and the family of title, units, files, parameters and the
!! reduction of the whole scene.
module all_keywords
  use keyword_table, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                           add_example, kind_real, kind_name, kind_choice, kind_flag, kind_words, &
                           any_number, anywhere
  use material_keywords, only: add_material_keywords
  use test_keywords, only: add_test_keyword
  use blank_keywords, only: add_blank_keywords
  use patch_keywords, only: add_patch_keywords
  use tool_keywords, only: add_tool_keywords
  use motion_keywords, only: add_motion_keywords
  use contact_keywords, only: add_contact_keywords
  use set_keywords, only: add_set_keyword
  use boundary_keywords, only: add_boundary_keywords
  use initial_keywords, only: add_initial_keywords
  use step_keywords, only: add_step_keywords
  use output_keywords, only: add_output_keywords
  use input_errors, only: error_list_t
  use scene, only: scene_t
  use deck_records, only: parsed_deck_t, find_records, option_real, option_text, is_option_given, &
                          field_word, deck_context_t
  implicit none
  private

  public :: list_keywords
  public :: add_general_keywords

contains

  !> All keywords in the order of the manual, in which they are also read: what a reader looks up in
  !! the scene, such as tools, comes before it.
  subroutine list_keywords(table, others)
    type(keyword_table_t), intent(out) :: table
    type(keyword_table_t), intent(in), optional :: others   !! taken instead

    if (present(others)) then
      table = others
      return
    end if
    call add_general_keywords(table)
    call add_material_keywords(table)
    call add_test_keyword(table)
    call add_blank_keywords(table)
    call add_patch_keywords(table)
    call add_tool_keywords(table)
    call add_motion_keywords(table)
    call add_contact_keywords(table)
    call add_set_keyword(table)
    call add_boundary_keywords(table)
    call add_initial_keywords(table)
    call add_step_keywords(table)
    call add_output_keywords(table)
  end subroutine list_keywords

  !> Add *HEADING, *UNITS, *INCLUDE, *END, *PARAMETER and *REDUCE.
  subroutine add_general_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "HEADING", "Title of the run. Of several headings the first "// &
                     "counts, so a deck that includes another can give its own before the "// &
                     "*INCLUDE.", is_in_digest=.false., read=read_labels, read_test=read_labels)
    call add_line(table, "Free text.", n_max=any_number)
    call add_field(table, "title", kind_words, "title, kept with the results")
    call add_example(table, "*HEADING", "Channel forming with coarse tools")

    call add_keyword(table, "UNITS", "Names of the units of the deck, a label for results and "// &
                     "pictures: the program converts nothing, so units must be consistent.", &
                     is_unique=.true.)
    call add_line(table, "Free text.")
    call add_field(table, "units", kind_words, "length, mass, time, force, stress, energy")
    call add_example(table, "*UNITS", "mm, t, s, N, MPa, mJ")

    call add_keyword(table, "INCLUDE", "Reads another file at this point. Data lines at the "// &
                     "start of that file continue the keyword before the *INCLUDE.", &
                     place=anywhere, is_in_digest=.false.)
    call add_option(table, "INPUT", kind_name, "path of the file, relative to the file that "// &
                    "includes it")
    call add_example(table, "*INCLUDE, INPUT=channel/dies.inc")

    call add_keyword(table, "END", "Ends the file that contains it; nothing after it is read.", &
                     place=anywhere, is_in_digest=.false.)
    call add_example(table, "*END")
    call add_parameter_keyword(table)
    call add_reduction_keyword(table)
  end subroutine add_general_keywords

  subroutine add_parameter_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "PARAMETER", "Names for numbers and texts. `<name>` or "// &
                     "`<expression>` anywhere after it is replaced by the value. Expressions "// &
                     "know + - * / ** ( ), sqrt, sin, cos, tan (radians), exp, log, abs, "// &
                     "floor, ceil, round, min, max, pi and earlier parameters. `--set "// &
                     "name=value` on the command line wins over the deck.", place=anywhere, &
                     is_in_digest=.false.)
    call add_option(table, "DEFAULT", kind_flag, "the lines apply only to parameters that have "// &
                    "no value yet, so a deck can set them before it includes this one")
    call add_line(table, "One parameter per line: `name = expression` or `name = ""text""`.", &
                  n_max=any_number)
    call add_field(table, "definition", kind_words, "name, equals sign, value")
    call add_example(table, "*PARAMETER", "speed = 18750", "end_time = 150/(2*speed)", &
                     "rule = ""2,2,2x3""")
  end subroutine add_parameter_keyword

  !> Add *REDUCE.
  subroutine add_reduction_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "REDUCE", "Runs a scene that is the same all along its width "// &
                     "(extruded tools, uniform blank and loads) as a strip one element wide "// &
                     "without motion across it. Forces, energies and masses in deck and "// &
                     "results are those of the full width. `--check` reports which scenes "// &
                     "qualify.", is_unique=.true., read=read_reduction)
    call add_option(table, "TYPE", kind_choice, "kind of the reduction", choices="PLANE STRAIN")
    call add_option(table, "AXIS", kind_choice, "coordinate across the width; without it, that "// &
                    "along which the scene is uniform", choices="X|Y|Z", is_required=.false.)
    call add_option(table, "WIDTH", kind_real, "width of the strip; without it, that of an "// &
                    "element of the blank", is_required=.false., unit="length", range="> 0")
    call add_example(table, "*REDUCE, TYPE=PLANE STRAIN")
  end subroutine add_reduction_keyword

  !> What a deck wants to be reduced.
  subroutine read_reduction(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)

    found = find_records(deck, "REDUCE")
    if (size(found) == 0) return
    associate (record => deck%records(found(1)))
      if (.not. record%is_valid) return
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
    i = first_of(deck, "HEADING")
    if (i > 0) then
      do line = 1, deck%records(i)%n_lines
        if (line > 1) scene%heading = scene%heading//new_line("a")
        scene%heading = scene%heading//trim(adjustl(field_word(deck%records(i), line, 1)))
      end do
    end if
    i = first_of(deck, "UNITS")
    if (i > 0) scene%units = trim(adjustl(field_word(deck%records(i), 1, 1)))
  end subroutine read_labels

  !> The first record of a keyword; 0 if there is none or it has errors.
  pure integer function first_of(deck, keyword)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    integer, allocatable :: found(:)

    found = find_records(deck, keyword)
    first_of = 0
    if (size(found) == 0) return
    if (deck%records(found(1))%is_valid) first_of = found(1)
  end function first_of

end module all_keywords
