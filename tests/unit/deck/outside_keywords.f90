!> A family of keywords that the program does not have: *STAMP with an option, data lines and a
!! reader. It appends its text to the heading of the scene.
module outside_keywords
  use input_errors, only: error_list_t, add_error
  use text, only: to_text
  use scene, only: scene_t
  use deck_records, only: parsed_deck_t, find_records, option_text, field_real, deck_context_t, &
                          resolve
  use keyword_table, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                           add_example, kind_real, kind_name, kind_choice, in_any_step
  implicit none
  private

  public :: add_outside_keywords

contains

  !> Add *STAMP.
  subroutine add_outside_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "STAMP", "Marks the sheet. For a test.", alias="OLD STAMP", &
                     place=in_any_step, read=read_stamps)
    call add_option(table, "MATERIAL", kind_name, "name of a material", alias="MAT")
    call add_option(table, "COLOUR", kind_choice, "colour of the mark", default="RED", &
                    choices="RED|BLUE")
    call add_line(table, "Size.")
    call add_field(table, "width", kind_real, "width of the mark", unit="length", range="> 0")
    call add_example(table, "*STAMP, MATERIAL=steel", "2.5")
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
