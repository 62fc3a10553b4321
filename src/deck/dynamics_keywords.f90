!> The entries of the keyword table for damping, relaxation and mass scaling.
module dynamics_keywords
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_example, kind_real, &
                          kind_choice
  implicit none
  private

  public :: add_dynamics_keywords

contains

  !> Add *DAMPING, *DYNAMIC RELAXATION and *MASS SCALING.
  pure subroutine add_dynamics_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "DAMPING", "Damping in proportion to the mass: a force -ALPHA m v "// &
                     "on all of the blank. A mode of angular frequency w gets the damping "// &
                     "ratio ALPHA/(2 w). The stable step stays.", is_unique=.true.)
    call add_option(table, "ALPHA", kind_real, "factor", unit="1/time", range="> 0")
    call add_example(table, "*DAMPING, ALPHA=500")

    call add_keyword(table, "DYNAMIC RELAXATION", "Leads the blank to rest and ends the run "// &
                     "there: when both residuals are small, and not before the last time in "// &
                     "any *AMPLITUDE. The end time of *DYNAMIC is the limit; a run that "// &
                     "reaches it first ends with an error. Apply loads with an *AMPLITUDE.", &
                     is_unique=.true.)
    call add_option(table, "METHOD", kind_choice, "RAYLEIGH: critical damping of the frequency "// &
                    "that the motion has in each step; KINETIC: no damping, but all motion "// &
                    "stops when the kinetic energy has passed a maximum; between stops the "// &
                    "blank swings freely and may yield more", default="RAYLEIGH", &
                    choices="RAYLEIGH|KINETIC")
    call add_option(table, "ENERGY", kind_real, "kinetic energy that counts as rest, over the "// &
                    "largest change of the internal energy since the step began; with "// &
                    "KINETIC the largest of the latest maxima, three at least, over half "// &
                    "of the time since the step began at least", &
                    default="1e-8", range="> 0")
    call add_option(table, "FORCE", kind_real, "norm of the unbalanced force that counts as "// &
                    "rest, over the largest norm of the internal or external forces in the step", &
                    default="1e-3", range="> 0")
    call add_example(table, "*DYNAMIC RELAXATION, METHOD=RAYLEIGH, ENERGY=1e-8, FORCE=1e-3")

    call add_keyword(table, "MASS SCALING", "Mass that is added for a larger stable step. "// &
                     "Weight under *GRAVITY stays that of the real mass.", is_unique=.true.)
    call add_option(table, "THICKNESS", kind_real, "factor on the mass of motion through the "// &
                    "thickness, which has next to no energy in a sheet: of a column of control "// &
                    "points, the differences to their mean along the column; 1: none. "// &
                    "Supports leave the stable step as it is", range=">= 1", &
                    is_required=.false.)
    call add_option(table, "STEP", kind_real, "time step that all masses are raised for, by "// &
                    "one factor and after the other scaling; 0: none", unit="time", range=">= 0", &
                    is_required=.false.)
    call add_example(table, "*MASS SCALING, THICKNESS=4")
  end subroutine add_dynamics_keywords

end module dynamics_keywords
