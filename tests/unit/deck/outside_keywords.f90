!> A family of keywords that the program does not have: *STAMP with an option, data lines and a
!! reader. It appends its text to the heading of the scene.
module outside_keywords
  use input_errors, only: error_list_t, add_error
  use text, only: to_text
  use scene, only: scene_t
  use deck_records, only: parsed_deck_t, find_records, option_text, field_real, deck_context_t, &
                          resolve
  use keyword_spec, only: in_any_step
  use keyword_table, only: keyword_table_t, add_keywords, set_keyword
  implicit none
  private

  public :: add_outside_keywords

  character(*), parameter :: feed = new_line("a")
  character(*), parameter, public :: stamp_page = feed// &
    "## *STAMP"//feed//feed// &
    "Marks the sheet. For a test."//feed// &
    "Also: *OLD STAMP."//feed//feed// &
    "| Option | Value | Default | Unit | Meaning |"//feed//"|---|---|---|---|---|"//feed// &
    "| MATERIAL (also: MAT) | text | required |  | name of a material |"//feed// &
    "| COLOUR | RED or BLUE | RED |  | colour of the mark |"//feed//feed// &
    "One data line. Size."//feed//feed// &
    "| Field | Value | Default | Unit | Meaning |"//feed//"|---|---|---|---|---|"//feed// &
    "| width | a number > 0 | required | length | width of the mark |"//feed//feed// &
    "```"//feed//"*STAMP, MATERIAL=steel"//feed//"2.5"//feed//"```"//feed

contains

  !> Add *STAMP.
  subroutine add_outside_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keywords(table, stamp_page)
    call set_keyword(table, "STAMP", in_any_step, read=read_stamps)
  end subroutine add_outside_keywords

  !> Append what each *STAMP says to the heading.
  subroutine read_stamps(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, material

    found = find_records(deck, "STAMP")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. record%is_valid) cycle
        call resolve(context%names%materials, option_text(record, "MATERIAL"), "*MATERIAL", &
                     record%origin, material, errors)
        if (material == 0) cycle
        scene%heading = scene%heading//option_text(record, "COLOUR")//" "// &
                        scene%materials(material)%name//" "//to_text(field_real(record, 1, 1))//";"
      end associate
    end do
  end subroutine read_stamps

end module outside_keywords
