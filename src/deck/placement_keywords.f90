!> *TOOL PLACEMENT: its entry in the keyword table and its reader.
module placement_keywords
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                          add_example, kind_name, kind_real
  use deck_names, only: deck_names_t, resolve
  use deck_records, only: parsed_deck_t, find_records, option_text, option_real, field_real, &
                          is_option_given
  use scene, only: scene_t
  implicit none
  private

  public :: add_placement_keyword, read_placements

contains

  !> Add *TOOL PLACEMENT.
  pure subroutine add_placement_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "TOOL PLACEMENT", "Puts a tool against the sheet before the run: "// &
                     "coming from behind along a direction it stops where its smallest "// &
                     "distance to the sheet is the clearance. Where the deck has it along that "// &
                     "direction does not matter.")
    call add_option(table, "TOOL", kind_name, "name of the tool")
    call add_option(table, "CLEARANCE", kind_real, "smallest distance to the sheet", &
                    default="0", unit="length", range=">= 0")
    call add_line(table, "Direction from the tool towards the sheet, of any length.")
    call add_field(table, "x", kind_real, "direction", unit="none")
    call add_field(table, "y", kind_real, "direction", unit="none")
    call add_field(table, "z", kind_real, "direction", unit="none")
    call add_example(table, "*TOOL PLACEMENT, TOOL=punch, CLEARANCE=0.01")
    call add_example(table, "0, 0, -1")
  end subroutine add_placement_keyword

  !> Note direction and clearance of tools that are to be placed.
  subroutine read_placements(deck, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_names_t), intent(in) :: names
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, k, tool
    real(wp) :: direction(3)

    found = find_records(deck, "TOOL PLACEMENT")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. is_option_given(deck, record, "TOOL")) cycle
        call resolve(names%tools, option_text(deck, record, "TOOL"), "*TOOL", record%origin, &
                     tool, errors)
        if (tool == 0 .or. .not. record%is_valid) cycle
        direction = [(field_real(record, 1, k), k=1, 3)]
        if (.not. norm2(direction) > 0.0_wp) then
          call add_error(errors, record%origin, "a direction of no length", &
                         "one that leads from the tool to the sheet")
        else if (any(abs(scene%tools(tool)%placing) > 0.0_wp)) then
          call add_error(errors, record%origin, "a second placement of the tool "// &
                         scene%tools(tool)%name, "one *TOOL PLACEMENT a tool")
        else
          scene%tools(tool)%placing = direction
          scene%tools(tool)%clearance = option_real(deck, record, "CLEARANCE")
        end if
      end associate
    end do
  end subroutine read_placements

end module placement_keywords
