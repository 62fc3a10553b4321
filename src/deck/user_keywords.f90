!> The entries of the keyword table for laws of users.
module user_keywords
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_alias, add_line, &
                          add_field, add_example, kind_real, kind_integer, kind_name, kind_choice, &
                          kind_flag, any_number
  implicit none
  private

  public :: add_user_keywords

contains

  !> Add *USER MATERIAL and *DEPVAR, as the decks of such subroutines write them.
  pure subroutine add_user_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "USER MATERIAL", "Law of a user's subroutine UMAT or VUMAT, given "// &
                     "by `--user FILE`. Where DDSDDE (or the first stress of a VUMAT) is not "// &
                     "positive at the start, *ELASTIC is needed beside it, for the stable step.", &
                     parent="MATERIAL")
    call add_option(table, "CONSTANTS", kind_integer, "number of constants, NPROPS", range=">= 0")
    call add_alias(table, "CONST")
    call add_option(table, "TYPE", kind_choice, "interface of the subroutine; without it, that "// &
                    "which the file has, a UMAT before a VUMAT. MECHANICAL says nothing more", &
                    choices="UMAT|VUMAT|MECHANICAL", is_required=.false.)
    call add_option(table, "THREADSAFE", kind_choice, "NO: one thread, in the order of the "// &
                    "elements. Without it NO where the compiled files keep data of their own "// &
                    "(COMMON, SAVE, DATA), else YES", choices="YES|NO", is_required=.false.)
    call add_option(table, "UNSYMM", kind_flag, "taken and without effect: no equations are "// &
                    "solved")
    call add_option(table, "HYBRID FORMULATION", kind_name, "taken and without effect, with a "// &
                    "warning: there are no hybrid elements", is_required=.false.)
    call add_line(table, "The constants PROPS, eight on a line. Blank places and the ends of "// &
                  "shorter lines count as zeros, as in Abaqus.", n_min=0, n_max=any_number, &
                  is_repeated=.true.)
    call add_field(table, "constant", kind_real, "one constant", default="0")
    call add_example(table, "*USER MATERIAL, CONSTANTS=5")
    call add_example(table, "210000, 0.3, 250, 250, 6")

    call add_keyword(table, "DEPVAR", "State variables of the user material. One that is named "// &
                     "EQPS or PEEQ is shown as the equivalent plastic strain.", parent="MATERIAL")
    call add_option(table, "DELETE", kind_integer, "taken and without effect: no element is "// &
                    "removed", is_required=.false., range=">= 1")
    call add_line(table, "")
    call add_field(table, "NSTATV", kind_integer, "number of state variables", &
                   range=">= 0 and <= 10000")
    call add_line(table, "Names of state variables, if they shall have any.", n_min=0, &
                  n_max=any_number)
    call add_field(table, "number", kind_integer, "which one", range=">= 1")
    call add_field(table, "name", kind_name, "its name in the result file")
    call add_field(table, "description", kind_name, "any text", is_required=.false.)
    call add_example(table, "*DEPVAR")
    call add_example(table, "1")
    call add_example(table, "1, EQPS, ""equivalent plastic strain""")
  end subroutine add_user_keywords

end module user_keywords
