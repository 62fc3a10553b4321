!> The list of all families of keywords.
module all_keywords
  use keyword_table, only: keyword_table_t
  use general_keywords, only: add_general_keywords
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
  implicit none
  private

  public :: list_keywords

contains

  !> All keywords in the order of the manual, in which they are also read: what a reader looks up in
  !! the scene, such as tools, comes before it.
  subroutine list_keywords(table)
    type(keyword_table_t), intent(out) :: table

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

end module all_keywords
