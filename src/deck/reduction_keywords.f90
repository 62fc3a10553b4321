!> *REDUCE: its entry in the keyword table and its reader.
module reduction_keywords
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_example, kind_real, &
                          kind_choice
  use deck_records, only: parsed_deck_t, find_records, option_real, option_text, is_option_given
  use scene, only: scene_t
  implicit none
  private

  public :: add_reduction_keyword, read_reduction

contains

  !> Add *REDUCE.
  pure subroutine add_reduction_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "REDUCE", "Runs a scene that is the same all along its width "// &
                     "(extruded tools, uniform blank and loads) as a strip one element wide "// &
                     "without motion across it. Forces, energies and masses in deck and "// &
                     "results are those of the full width. `--check` tells which scenes qualify.", &
                     is_unique=.true.)
    call add_option(table, "TYPE", kind_choice, "kind of the reduction", choices="PLANE STRAIN")
    call add_option(table, "AXIS", kind_choice, "coordinate across the width; without it, that "// &
                    "along which the scene is uniform", choices="X|Y|Z", is_required=.false.)
    call add_option(table, "WIDTH", kind_real, "width of the strip; without it, that of an "// &
                    "element of the blank", is_required=.false., unit="length", range="> 0")
    call add_example(table, "*REDUCE, TYPE=PLANE STRAIN")
  end subroutine add_reduction_keyword

  !> What a deck wants to be reduced.
  subroutine read_reduction(deck, scene)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    integer, allocatable :: found(:)

    found = find_records(deck, "REDUCE")
    if (size(found) == 0) return
    associate (record => deck%records(found(1)))
      if (.not. record%is_valid) return
      scene%reduction%origin = record%origin
      scene%reduction%component = index("XYZ", option_text(deck, record, "AXIS"))
      if (.not. is_option_given(deck, record, "AXIS")) scene%reduction%component = 0
      if (is_option_given(deck, record, "WIDTH")) &
        scene%reduction%width = option_real(deck, record, "WIDTH")
    end associate
  end subroutine read_reduction

end module reduction_keywords
