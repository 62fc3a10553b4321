!> The entries of the keyword table for temperature and field variables.
module field_keywords
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                          add_example, kind_real, kind_integer, kind_name, kind_choice, any_number
  implicit none
  private

  public :: add_field_keywords, add_value_fields

  character(*), parameter, public :: variable_text = "with FIELD: which field variable"

contains

  !> Temperature and field variables during the run.
  pure subroutine add_field_keywords(table, op_text)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: op_text           !! what OP means

    call add_keyword(table, "TEMPERATURE", "Temperature of the control points of a set, for a "// &
                     "user's law (TEMP, DTEMP): value times amplitude. No heat is conducted, "// &
                     "and no strain of expansion arises. Without amplitude it holds from the "// &
                     "start of the step on. Where lines meet, the last one holds; points of "// &
                     "none have what they had at the start of the run.")
    call add_option(table, "AMPLITUDE", kind_name, "amplitude that scales it", is_required=.false.)
    call add_option(table, "OP", kind_choice, op_text, default="MOD", choices="MOD|NEW")
    call add_line(table, "", n_min=0, n_max=any_number)
    call add_value_fields(table)
    call add_example(table, "*TEMPERATURE, AMPLITUDE=cooling")
    call add_example(table, "ALL, 700")

    call add_keyword(table, "FIELD", "Field variable of the control points of a set, for a "// &
                     "user's law (PREDEF, DPRED; fieldOld, fieldNew). As *TEMPERATURE.")
    call add_option(table, "VARIABLE", kind_integer, variable_text, default="1", &
                    range=">= 1 and <= 20")
    call add_option(table, "AMPLITUDE", kind_name, "amplitude that scales it", is_required=.false.)
    call add_option(table, "OP", kind_choice, op_text, default="MOD", choices="MOD|NEW")
    call add_line(table, "", n_min=0, n_max=any_number)
    call add_value_fields(table)
    call add_example(table, "*FIELD, VARIABLE=1")
    call add_example(table, "ALL, 0.5")
  end subroutine add_field_keywords

  !> Set, value and slopes of a data line.
  pure subroutine add_value_fields(table)
    type(keyword_table_t), intent(inout) :: table
    character(*), parameter :: slope = "change by length along this axis, places at the start"

    call add_field(table, "set", kind_name, "name of a set or face, or ALL")
    call add_field(table, "value", kind_real, "at the origin of the coordinates, everywhere if "// &
                   "nothing follows", default="0")
    call add_field(table, "d/dx", kind_real, slope, default="0")
    call add_field(table, "d/dy", kind_real, slope, default="0")
    call add_field(table, "d/dz", kind_real, slope, default="0")
  end subroutine add_value_fields

end module field_keywords
