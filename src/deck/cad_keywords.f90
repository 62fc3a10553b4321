!> The options of *TOOL for surfaces from CAD files.
module cad_keywords
  use keyword_spec, only: keyword_table_t, add_option, kind_name, kind_choice
  use length_units, only: unit_names
  implicit none
  private

  public :: add_cad_options

contains

  !> Add the options to the keyword begun last.
  pure subroutine add_cad_options(table)
    type(keyword_table_t), intent(inout) :: table

    call add_option(table, "INPUT", kind_name, "IGES: the file, relative to the deck", &
                    is_required=.false.)
    call add_option(table, "LENGTH", kind_choice, "IGES: unit of the deck's lengths, into "// &
                    "which those of the file are converted; the one that *UNITS names, else "// &
                    "MM, if not given", choices=unit_names, is_required=.false.)
    call add_option(table, "ENTITY", kind_name, "IGES: directory numbers of the surfaces to "// &
                    "take, such as ""5,9""; all untrimmed ones if neither ENTITY nor LABEL is "// &
                    "given", is_required=.false.)
    call add_option(table, "LABEL", kind_name, "IGES: labels of the surfaces to take, such as "// &
                    """DIE,RADIUS""", is_required=.false.)
  end subroutine add_cad_options

end module cad_keywords
