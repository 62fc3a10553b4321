!> The entries of the keyword table for steps.
module step_keywords
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                          add_example, kind_name, kind_real, kind_choice, kind_flag, kind_words
  implicit none
  private

  public :: add_process_keywords

contains

  !> Add *STEP, *END STEP and *MODEL CHANGE.
  pure subroutine add_process_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "TOOL FORCE", "A force that moves a tool, such as a blank holder: "// &
                     "the tool is free along the force and held across it. It acts until the "// &
                     "tool gets another motion. A weight is a part of the force.")
    call add_option(table, "TOOL", kind_name, "name of the tool")
    call add_option(table, "AMPLITUDE", kind_name, "amplitude that scales the force", &
                    is_required=.false.)
    call add_option(table, "MASS", kind_real, "mass of the tool; 0: twice what its contact "// &
                    "springs and the time step ask for, named in the log", default="0", &
                    unit="mass", range=">= 0")
    call add_option(table, "DAMPING", kind_real, "damping of the tool against the ground, part "// &
                    "of the critical of its mass on all of its contact springs: it adds to "// &
                    "the force of a tool that gives way, as DAMPING of *CONTACT PAIR does not", &
                    default="0", range=">= 0")
    call add_line(table, "The force.")
    call add_field(table, "x", kind_real, "component", unit="force")
    call add_field(table, "y", kind_real, "component", unit="force")
    call add_field(table, "z", kind_real, "component", unit="force")
    call add_example(table, "*TOOL FORCE, TOOL=blank holder, AMPLITUDE=soft start")
    call add_example(table, "0, -2450, 0")

    call add_keyword(table, "STEP", "Begins a step: its *DYNAMIC, motions, supports, loads, "// &
                     "limits and output follow, up to *END STEP. A deck without *STEP is one "// &
                     "step. Motions, supports, loads, contact, damping, limits and output "// &
                     "hold in all later steps until they are replaced or removed; dynamic "// &
                     "relaxation is for its step alone. What stands before the first *STEP "// &
                     "holds from it on.")
    call add_option(table, "NAME", kind_name, "name in log and results", is_required=.false.)
    call add_option(table, "NLGEOM", kind_choice, "may be given", default="YES", choices="YES")
    call add_line(table, "Free text, which is passed over.", n_min=0)
    call add_field(table, "title", kind_words, "title", is_required=.false.)
    call add_example(table, "*STEP, NAME=release")
    call add_example(table, "*MODEL CHANGE, REMOVE")
    call add_example(table, "punch, die")
    call add_example(table, "*DYNAMIC, EXPLICIT")
    call add_example(table, "0.01")
    call add_example(table, "*END STEP")

    call add_keyword(table, "END STEP", "Ends a step.")
    call add_example(table, "*END STEP")

    call add_keyword(table, "MODEL CHANGE", "Takes tools and draw beads away from the blank at "// &
                     "the start of a step, or brings them again. A tool that is away has no "// &
                     "contact; it goes on with its *TOOL MOTION, but its *TOOL FORCE waits, "// &
                     "with the tool at rest, and begins anew when it comes. A tool that first "// &
                     "comes later is removed in the first step.")
    call add_option(table, "REMOVE", kind_flag, "they go")
    call add_option(table, "ADD", kind_flag, "they come")
    call add_line(table, "Names of tools and draw beads.", n_max=huge(1), is_repeated=.true.)
    call add_field(table, "name", kind_name, "name of a tool, or that which one or more draw "// &
                   "beads have")
    call add_example(table, "*MODEL CHANGE, REMOVE")
    call add_example(table, "punch, blank holder")
  end subroutine add_process_keywords

end module step_keywords
