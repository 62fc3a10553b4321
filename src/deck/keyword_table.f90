!> The one table of all keywords: the reader checks decks against it, the manual is made from it.
!!
!! A new keyword is one more entry here and one procedure that turns its records into the scene.
module keyword_table
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                          add_example, kind_real, kind_integer, kind_name, kind_choice, &
                          kind_flag, kind_words, any_number
  use blank_keywords, only: add_blank_keywords
  use material_keywords, only: add_material_keywords
  use dynamics_keywords, only: add_dynamics_keywords
  use reduction_keywords, only: add_reduction_keyword
  use step_keywords, only: add_process_keywords
  use placement_keywords, only: add_placement_keyword
  use cad_keywords, only: add_cad_options
  use offset_keywords, only: add_offset_option, add_offset_lines
  use bead_reader, only: add_bead_keywords
  use run_keywords, only: add_run_keywords
  use test_keywords, only: add_test_keyword
  use field_keywords, only: add_field_keywords, add_value_fields, variable_text
  implicit none
  private

  public :: new_keyword_table

  character(*), parameter :: faces = "XI_MIN|XI_MAX|ETA_MIN|ETA_MAX|ZETA_MIN|ZETA_MAX"
  character(*), parameter :: sides = "X_MIN, X_MAX, Y_MIN, Y_MAX, Z_MIN or Z_MAX"
  character(*), parameter :: op_text = &
    "NEW removes all of this keyword that earlier steps gave; it needs no data lines then. MOD "// &
    "adds; a load replaces an earlier one on the same set"

contains

  !> All keywords in the order in which the manual shows them.
  pure subroutine new_keyword_table(table)
    type(keyword_table_t), intent(out) :: table

    call add_general_keywords(table)
    call add_parameter_keyword(table)
    call add_material_keywords(table)
    call add_blank_keywords(table)
    call add_patch_keywords(table)
    call add_tool_keyword(table)
    call add_placement_keyword(table)
    call add_motion_keywords(table)
    call add_contact_keyword(table)
    call add_set_keyword(table)
    call add_boundary_keywords(table)
    call add_field_keywords(table, op_text)
    call add_load_keywords(table)
    call add_process_keywords(table)
    call add_step_keywords(table)
    call add_dynamics_keywords(table)
    call add_reduction_keyword(table)
    call add_bead_keywords(table)
    call add_output_keywords(table)
    call add_run_keywords(table)
    call add_test_keyword(table)
  end subroutine new_keyword_table

  pure subroutine add_general_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "HEADING", "Title of the run. Of several headings the first "// &
                     "counts, so a deck that includes another can give its own before the "// &
                     "*INCLUDE.")
    call add_line(table, "Free text.", n_max=any_number)
    call add_field(table, "title", kind_words, "title, kept with the results")
    call add_example(table, "*HEADING")
    call add_example(table, "Channel forming with coarse tools")

    call add_keyword(table, "UNITS", "Names of the units of the deck, a label for results and "// &
                     "pictures: the program converts nothing, so units must be consistent.", &
                     is_unique=.true.)
    call add_line(table, "Free text.")
    call add_field(table, "units", kind_words, "length, mass, time, force, stress, energy")
    call add_example(table, "*UNITS")
    call add_example(table, "mm, t, s, N, MPa, mJ")

    call add_keyword(table, "INCLUDE", "Reads another file at this place. Data lines at the "// &
                     "start of that file go on with the keyword before the *INCLUDE.")
    call add_option(table, "INPUT", kind_name, "path of the file, relative to the file that "// &
                    "includes it")
    call add_example(table, "*INCLUDE, INPUT=channel/dies.inc")

    call add_keyword(table, "END", "Ends the file it stands in; nothing behind it is read.")
    call add_example(table, "*END")
  end subroutine add_general_keywords

  pure subroutine add_parameter_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "PARAMETER", "Names for numbers and texts. `<name>` or "// &
                     "`<expression>` anywhere behind stands for the value. Expressions know "// &
                     "+ - * / ** ( ), sqrt, sin, cos, tan (radians), exp, log, abs, floor, "// &
                     "ceil, round, min, max, pi and earlier parameters. `--set name=value` on "// &
                     "the command line wins over the deck.")
    call add_option(table, "DEFAULT", kind_flag, "the lines hold only for parameters that have "// &
                    "no value yet, so a deck can set them before it includes this one")
    call add_line(table, "One parameter a line: `name = expression` or `name = ""text""`.", &
                  n_max=any_number)
    call add_field(table, "definition", kind_words, "name, equals sign, value")
    call add_example(table, "*PARAMETER")
    call add_example(table, "speed = 18750")
    call add_example(table, "end_time = 150/(2*speed)")
    call add_example(table, "rule = ""2,2,2x3""")
  end subroutine add_parameter_keyword

  pure subroutine add_patch_keywords(table)
    type(keyword_table_t), intent(inout) :: table
    character(*), parameter :: owner = "name of the blank, of a *PATCH or of the tool"

    call add_keyword(table, "KNOTS", "Open knot vector of one axis of a patch: the first and "// &
                     "the last knot stand degree + 1 times, an inner one at most degree times.")
    call add_option(table, "PATCH", kind_name, owner)
    call add_option(table, "AXIS", kind_integer, "1 for xi, 2 for eta, 3 for zeta", &
                    range=">= 1 and <= 3")
    call add_option(table, "DEGREE", kind_integer, "polynomial degree", range=">= 1 and <= 5")
    call add_option(table, "INPUT", kind_name, "file with the data lines", is_required=.false.)
    call add_line(table, "Knots, any number on a line.", n_max=any_number, is_repeated=.true.)
    call add_field(table, "knot", kind_real, "never below the one before")
    call add_example(table, "*KNOTS, PATCH=punch, AXIS=1, DEGREE=2")
    call add_example(table, "0, 0, 0, 0.5, 1, 1, 1")

    call add_keyword(table, "CONTROL POINTS", "Control points of a patch, or of the curve of "// &
                     "an extruded tool; axis 1 runs fastest. Points are not multiplied by weights.")
    call add_option(table, "PATCH", kind_name, owner)
    call add_option(table, "INPUT", kind_name, "CSV file with the data lines; a first line of "// &
                    "column names is left out", is_required=.false.)
    call add_line(table, "One point a line.", n_max=any_number)
    call add_field(table, "x", kind_real, "coordinate", unit="length")
    call add_field(table, "y", kind_real, "coordinate", unit="length")
    call add_field(table, "z", kind_real, "coordinate", unit="length")
    call add_field(table, "w", kind_real, "weight", default="1", range=">= 1e-30 and <= 1e30")
    call add_example(table, "*CONTROL POINTS, PATCH=punch, INPUT=punch.csv")

    call add_keyword(table, "REFINE", "Refines one axis of the blank or of a tool; the shape "// &
                     "stays the same. Several *REFINE work in the order of the deck; within "// &
                     "one, first the degree is raised, then spans are divided, then knots "// &
                     "inserted.")
    call add_option(table, "PATCH", kind_name, owner)
    call add_option(table, "AXIS", kind_integer, "1 for xi, 2 for eta, 3 for zeta", &
                    range=">= 1 and <= 3")
    call add_option(table, "ELEVATE", kind_integer, "by how much the degree rises", default="0", &
                    range=">= 0 and <= 4")
    call add_option(table, "SUBDIVIDE", kind_integer, "parts that each span is divided into", &
                    default="1", range=">= 1 and <= 1000")
    call add_line(table, "Knots to insert, any number on a line.", n_min=0, n_max=any_number, &
                  is_repeated=.true.)
    call add_field(table, "knot", kind_real, "inside the knot vector")
    call add_example(table, "*REFINE, PATCH=lower die, AXIS=1, SUBDIVIDE=4")
  end subroutine add_patch_keywords

  pure subroutine add_tool_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "TOOL", "A rigid tool: one surface in its place at the start, or "// &
                     "several of a CAD file, turned so that they agree at common edges. Its "// &
                     "normal is the direction of xi crossed with that of eta.")
    call add_option(table, "NAME", kind_name, "name")
    call add_option(table, "TYPE", kind_choice, "SURFACE: knots and points listed; EXTRUDED: a "// &
                    "curve listed, drawn along a vector; PLANE; CYLINDER; SPHERE; IGES: "// &
                    "surfaces of a CAD file; OFFSET: those of another tool at a distance", &
                    choices="SURFACE|EXTRUDED|PLANE|CYLINDER|SPHERE|IGES|OFFSET")
    call add_option(table, "SIDE", kind_choice, "side of the surface on which the sheet lies: "// &
                    "where the normal points (POSITIVE, if not given) or the other; "// &
                    "not for OFFSET", &
                    choices="POSITIVE|NEGATIVE", is_required=.false.)
    call add_option(table, "PART OF", kind_name, "name of another *TOOL: this surface is then "// &
                    "one of that tool, and has no side, motion or contact of its own", &
                    is_required=.false.)
    call add_cad_options(table)
    call add_offset_option(table)
    call add_line(table, "Extrusion of the curve; it is eta of the surface.", when="EXTRUDED")
    call add_vector(table, "d", "extrusion")
    call add_field(table, "rows", kind_integer, "rows of control points", default="2", &
                   range=">= 2")
    call add_field(table, "degree", kind_integer, "degree along it, below the number of rows", &
                   default="1", range=">= 1 and <= 5")
    call add_line(table, "Shift of the curve before it is extruded.", when="EXTRUDED", n_min=0)
    call add_vector(table, "s", "shift")
    call add_line(table, "A corner.", when="PLANE")
    call add_vector(table, "", "corner")
    call add_line(table, "Edge from the corner along xi.", when="PLANE")
    call add_vector(table, "a", "edge")
    call add_line(table, "Edge from the corner along eta.", when="PLANE")
    call add_vector(table, "b", "edge")
    call add_line(table, "A point of the axis where the cylinder begins, and the axis in its "// &
                  "full length, along eta; the normal points outwards.", when="CYLINDER")
    call add_vector(table, "", "point")
    call add_vector(table, "a", "axis")
    call add_line(table, "Radius and arc. Angle 0 is the x direction (y if the axis is along "// &
                  "x), angles turn right-handed about the axis, along xi.", when="CYLINDER", &
                  is_joinable=.true.)
    call add_field(table, "radius", kind_real, "radius", unit="length", range="> 0")
    call add_field(table, "start", kind_real, "angle where the arc starts", unit="degrees", &
                   default="0")
    call add_field(table, "angle", kind_real, "angle of the arc", unit="degrees", default="360", &
                   range="> 0 and <= 360")
    call add_line(table, "The centre; the normal points outwards.", when="SPHERE")
    call add_vector(table, "", "centre")
    call add_line(table, "The radius.", when="SPHERE", is_joinable=.true.)
    call add_field(table, "radius", kind_real, "radius", unit="length", range="> 0")
    call add_offset_lines(table)
    call add_example(table, "*TOOL, NAME=punch, TYPE=CYLINDER, SIDE=POSITIVE")
    call add_example(table, "0, 60, 0, 0, 0, 100")
    call add_example(table, "50")
    call add_example(table, "*TOOL, NAME=die, TYPE=IGES, INPUT=die.igs, SIDE=NEGATIVE")
    call add_example(table, "*TOOL, NAME=lid, TYPE=OFFSET, OF=die")
    call add_example(table, "1.05")
  end subroutine add_tool_keyword

  !> Three fields for a vector, named x, y, z behind `prefix`.
  pure subroutine add_vector(table, prefix, text, unit)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: prefix, text
    character(*), intent(in), optional :: unit
    character(*), parameter :: axes = "xyz"
    integer :: i

    do i = 1, 3
      if (present(unit)) then
        call add_field(table, prefix//axes(i:i), kind_real, text, unit=unit)
      else
        call add_field(table, prefix//axes(i:i), kind_real, text, unit="length")
      end if
    end do
  end subroutine add_vector

  pure subroutine add_motion_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "AMPLITUDE", "A factor against time, linear or smooth between the "// &
                     "points and constant outside.")
    call add_option(table, "NAME", kind_name, "name, for AMPLITUDE options")
    call add_option(table, "INPUT", kind_name, "file with the data lines", is_required=.false.)
    call add_option(table, "DEFINITION", kind_choice, "SMOOTH STEP: between the points "// &
                    "a quintic that is level at both of them, as in Abaqus", default="TABULAR", &
                    choices="TABULAR|SMOOTH STEP")
    call add_option(table, "TIME", kind_choice, "times since the start of the step that names "// &
                    "the amplitude, or since that of the run", default="STEP TIME", &
                    choices="STEP TIME|TOTAL TIME")
    call add_option(table, "VALUE", kind_choice, "may be given", default="RELATIVE", &
                    choices="RELATIVE")
    call add_line(table, "Pairs of time and value, any number on a line; times rise.", &
                  n_max=any_number, is_repeated=.true.)
    call add_field(table, "time, value", kind_real, "time, then value", unit="time, none")
    call add_example(table, "*AMPLITUDE, NAME=soft start")
    call add_example(table, "0, 0, 0.001, 1")

    call add_keyword(table, "TOOL MOTION", "How a tool moves from the start of the step on, "// &
                     "in which this stands; in later steps it goes on until the tool gets "// &
                     "another motion. Several of one tool in one step add up if they move "// &
                     "different components; one of them may turn it. A tool without it "// &
                     "stands still.")
    call add_option(table, "TOOL", kind_name, "name of the tool")
    call add_option(table, "TYPE", kind_choice, "what the data lines are; DISPLACEMENT and "// &
                    "ROTATION count from where the tool is at the start of the step, and need "// &
                    "an AMPLITUDE that starts at 0", default="VELOCITY", &
                    choices="VELOCITY|DISPLACEMENT|ROTATION|ANGULAR VELOCITY")
    call add_option(table, "AMPLITUDE", kind_name, "amplitude that scales the vector", &
                    is_required=.false.)
    call add_line(table, "The vector.", when="VELOCITY|DISPLACEMENT")
    call add_vector(table, "", "component", unit="length/time, length")
    call add_line(table, "A point of the axis at the start of the step, and the direction of "// &
                  "the axis, which goes with the other motions of the tool; it turns "// &
                  "right-handed.", when="ROTATION|ANGULAR VELOCITY")
    call add_vector(table, "", "point")
    call add_vector(table, "a", "axis", unit="none")
    call add_line(table, "The angle.", when="ROTATION|ANGULAR VELOCITY")
    call add_field(table, "angle", kind_real, "angle, or angle a time", &
                   unit="degrees, degrees/time")
    call add_example(table, "*TOOL MOTION, TOOL=punch, TYPE=VELOCITY, AMPLITUDE=soft start")
    call add_example(table, "0, -2000, 0")
  end subroutine add_motion_keywords

  pure subroutine add_contact_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "CONTACT PAIR", "Contact between a tool and a face of the "// &
                     "blank, by a penalty on points of the face. Without friction and damping "// &
                     "unless named.")
    call add_option(table, "TOOL", kind_name, "name of the tool")
    call add_option(table, "FACE", kind_name, "face of the blank: "//faces//"; for a box also "// &
                    sides//"; AUTO: the large face that looks at the tool", default="AUTO")
    call add_option(table, "POINTS", kind_choice, "points of the face that may touch: Gauss "// &
                    "points, crossings of knot lines, or Greville points", default="GAUSS", &
                    choices="GAUSS|KNOT|GREVILLE")
    call add_option(table, "COUNT", kind_name, "Gauss points per element in the two directions "// &
                    "of the face, such as ""3,3""; degree + 1 if not given", is_required=.false.)
    call add_option(table, "PENALTY", kind_real, "factor s of the penalty s m/dt^2, m being "// &
                    "the mass that the point sees", default="0.5", range="> 0")
    call add_option(table, "STIFFNESS", kind_real, "penalty per area instead of the one from "// &
                    "mass and step; 0: none given", default="0", unit="stress/length", &
                    range=">= 0")
    call add_option(table, "FRICTION", kind_real, "coefficient of Coulomb friction", &
                    default="0", range=">= 0")
    call add_option(table, "DAMPING", kind_real, "damping of the motion along the normal, as "// &
                    "part of the critical damping of penalty and mass", default="0", &
                    range=">= 0 and <= 0.5")
    call add_option(table, "OVERHANG", kind_real, "how far beyond the border of the tool a "// &
                    "point still touches", default="0", unit="length", range=">= 0")
    call add_option(table, "START", kind_choice, "start of the closest-point search: the last "// &
                    "answer, or the corner of the tool's face", default="WARM", &
                    choices="WARM|CORNER")
    call add_example(table, "*CONTACT PAIR, TOOL=punch, FACE=ZETA_MAX, POINTS=GAUSS, COUNT=""3,3""")
  end subroutine add_contact_keyword

  pure subroutine add_set_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "SET", "Names a part of the blank: what all its lines have in "// &
                     "common. A control point belongs to it when its Greville abscissae do. "// &
                     "Faces and ALL need no set: their names serve wherever a set is asked for.")
    call add_option(table, "NAME", kind_name, "name")
    call add_option(table, "PATCH", kind_name, "patch of the blank, all if none is given; a "// &
                    "name without its number stands for all that differ in it alone", &
                    is_required=.false.)
    call add_line(table, "One or more face names ("//faces//"; for a box also "//sides//"; two "// &
                  "make an edge), or an axis (xi, eta, zeta; for a box also x, y, z) with the "// &
                  "lower and the upper bound.", n_max=any_number, is_repeated=.true.)
    call add_field(table, "face or axis", kind_name, "name of a face, or axis and bounds")
    call add_example(table, "*SET, NAME=gauge")
    call add_example(table, "ZETA_MAX")
    call add_example(table, "x, 20, 40")
  end subroutine add_set_keyword

  pure subroutine add_boundary_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "BOUNDARY", "Prescribed velocity of the control points of a set, "// &
                     "zero if none is given. Where lines meet, the last one holds.")
    call add_option(table, "TYPE", kind_choice, "what the value is", default="VELOCITY", &
                    choices="VELOCITY")
    call add_option(table, "AMPLITUDE", kind_name, "amplitude that scales the value", &
                    is_required=.false.)
    call add_option(table, "OP", kind_choice, op_text, default="MOD", choices="MOD|NEW")
    call add_line(table, "A set and its components.", n_min=0, n_max=any_number)
    call add_field(table, "set", kind_name, "name of a set or face, or ALL")
    call add_field(table, "first", kind_name, "first component, 1 to 3, or XSYMM, YSYMM, ZSYMM "// &
                   "(component 1, 2, 3), PINNED or ENCASTRE (all)")
    call add_field(table, "last", kind_integer, "last component, the first one if not given", &
                   is_required=.false., range=">= 1 and <= 3")
    call add_field(table, "velocity", kind_real, "velocity of these components", default="0", &
                   unit="length/time")
    call add_example(table, "*BOUNDARY, AMPLITUDE=soft start")
    call add_example(table, "X_MIN, XSYMM")
    call add_example(table, "X_MAX, 1, 1, 2000")

    call add_keyword(table, "INITIAL CONDITIONS", "Velocities at the start, which add up over "// &
                     "all lines, or state variables, temperatures and field variables at the "// &
                     "start.")
    call add_option(table, "TYPE", kind_choice, "a uniform velocity, that of a rotation, state "// &
                    "variables (SOLUTION), a temperature or a field variable", &
                    choices="VELOCITY|ROTATING VELOCITY|SOLUTION|TEMPERATURE|FIELD")
    call add_option(table, "VARIABLE", kind_integer, variable_text, default="1", &
                    range=">= 1 and <= 20")
    call add_option(table, "USER", kind_flag, "with SOLUTION: the user's subroutine SDVINI, "// &
                    "which is called anyhow if there is one")
    call add_line(table, "", when="VELOCITY", n_max=any_number)
    call add_field(table, "set", kind_name, "name of a set or face, or ALL")
    call add_field(table, "component", kind_integer, "component", range=">= 1 and <= 3")
    call add_field(table, "velocity", kind_real, "velocity", unit="length/time")
    call add_line(table, "", when="ROTATING VELOCITY", n_max=any_number)
    call add_field(table, "set", kind_name, "name of a set or face, or ALL")
    call add_vector(table, "omega_", "angular velocity", unit="1/time")
    call add_vector(table, "", "a point of the axis of rotation")
    call add_line(table, "The state variables of the elements whose middle lies in a set, as "// &
                  "Abaqus places them: eight entries on a line, the set among them. Lines that "// &
                  "begin with a number go on with the values; what a shorter line before them "// &
                  "lacks counts as zeros.", &
                  when="SOLUTION", n_min=0, n_max=any_number, is_repeated=.true.)
    call add_field(table, "set", kind_name, "name of a set or face, or ALL; or a value")
    call add_field(table, "value", kind_real, "a state variable", is_required=.false.)
    call add_line(table, "The control points of a set; where lines meet, the last one holds.", &
                  when="TEMPERATURE|FIELD", n_max=any_number)
    call add_value_fields(table)
    call add_example(table, "*INITIAL CONDITIONS, TYPE=VELOCITY")
    call add_example(table, "ALL, 2, -1500")
  end subroutine add_boundary_keywords

  pure subroutine add_load_keywords(table)
    type(keyword_table_t), intent(inout) :: table
    character(*), parameter :: scaling = "amplitude that scales the load"

    call add_keyword(table, "PRESSURE", "Pressure against the current outer normal of a face.")
    call add_option(table, "AMPLITUDE", kind_name, scaling, is_required=.false.)
    call add_option(table, "OP", kind_choice, op_text, default="MOD", choices="MOD|NEW")
    call add_line(table, "", n_min=0, n_max=any_number)
    call add_field(table, "set", kind_name, "name of a face, or of a set that is a part of one")
    call add_field(table, "pressure", kind_real, "pressure, positive when it pushes", &
                   unit="stress")
    call add_example(table, "*PRESSURE, AMPLITUDE=soft start")
    call add_example(table, "ZETA_MAX, 0.5")

    call add_keyword(table, "TRACTION", "Load of fixed direction, per area that a face "// &
                     "has at the start.")
    call add_option(table, "AMPLITUDE", kind_name, scaling, is_required=.false.)
    call add_option(table, "OP", kind_choice, op_text, default="MOD", choices="MOD|NEW")
    call add_line(table, "", n_min=0, n_max=any_number)
    call add_field(table, "set", kind_name, "name of a face, or of a set that is a part of one")
    call add_vector(table, "t", "traction", unit="stress")
    call add_example(table, "*TRACTION")
    call add_example(table, "X_MAX, 10, 0, 0")

    call add_keyword(table, "GRAVITY", "Acceleration that acts on all of the blank.")
    call add_option(table, "AMPLITUDE", kind_name, scaling, is_required=.false.)
    call add_option(table, "OP", kind_choice, op_text, default="MOD", choices="MOD|NEW")
    call add_line(table, "", n_min=0)
    call add_vector(table, "g", "acceleration", unit="length/time^2")
    call add_example(table, "*GRAVITY")
    call add_example(table, "0, -9810, 0")
  end subroutine add_load_keywords

  pure subroutine add_step_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "DYNAMIC", "The explicit step.", is_unique=.true.)
    call add_option(table, "EXPLICIT", kind_flag, "may be given; no other procedure is there")
    call add_option(table, "SAFETY", kind_real, "fraction of the stable step; above 1, for "// &
                    "trials, runs are unstable but where that step is too cautious; steps "// &
                    "that deformation has made shorter may be up to 3 % longer again, to hit "// &
                    "output times in whole steps", &
                    default="0.8", range="> 0 and <= 2")
    call add_option(table, "STABLE STEP", kind_choice, "from the largest frequency of the "// &
                    "whole blank, or from that of its elements, which lies above it", &
                    default="ASSEMBLED", choices="ASSEMBLED|ELEMENT")
    call add_line(table, "The end time, alone or as the second field, where Abaqus has it.")
    call add_field(table, "end time", kind_real, "end of the run", unit="time", range="> 0", &
                   is_required=.false.)
    call add_field(table, "end time", kind_real, "the same, if the first field is empty", &
                   unit="time", range="> 0", is_required=.false.)
    call add_example(table, "*DYNAMIC, EXPLICIT, SAFETY=0.8")
    call add_example(table, "4.0e-3")

    call add_keyword(table, "BULK VISCOSITY", "Damping of the volume change; 0, 0 leaves it out.", &
                     is_unique=.true.)
    call add_line(table, "")
    call add_field(table, "b1", kind_real, "linear part", default="0.06", range=">= 0")
    call add_field(table, "b2", kind_real, "quadratic part", default="1.2", range=">= 0")
    call add_example(table, "*BULK VISCOSITY")
    call add_example(table, "0.06, 1.2")

    call add_keyword(table, "ENERGY LIMIT", "Error of the energy balance that ends the run.", &
                     is_unique=.true.)
    call add_line(table, "")
    call add_field(table, "limit", kind_real, "fraction of the largest energy; 0: never", &
                   range=">= 0")
    call add_example(table, "*ENERGY LIMIT")
    call add_example(table, "0.2")

    call add_keyword(table, "PENETRATION LIMIT", "Depths of the blank in a tool, as fractions "// &
                     "of its thickness, at which a pair warns and at which the run ends.", &
                     is_unique=.true.)
    call add_line(table, "")
    call add_field(table, "warning", kind_real, "a warning in the log, once a pair; 0: never", &
                   default="0.1", range=">= 0")
    call add_field(table, "limit", kind_real, "end of the run with an error; 0: never", &
                   default="0.5", range=">= 0")
    call add_example(table, "*PENETRATION LIMIT")
    call add_example(table, "0.05, 0.2")
  end subroutine add_step_keywords

  pure subroutine add_output_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "PROBE", "A point of the blank whose motion goes into the history.")
    call add_option(table, "NAME", kind_name, "name in the result file")
    call add_option(table, "PATCH", kind_name, "patch of the blank, the first if none is given", &
                    is_required=.false.)
    call add_line(table, "Coordinates in the ranges of the knots, 0 to 1 for a box.")
    call add_field(table, "xi", kind_real, "parametric coordinate")
    call add_field(table, "eta", kind_real, "parametric coordinate")
    call add_field(table, "zeta", kind_real, "parametric coordinate")
    call add_example(table, "*PROBE, NAME=middle")
    call add_example(table, "0.5, 0.5, 0.5")

    call add_keyword(table, "OUTPUT", "What is written and how often.", is_unique=.true.)
    call add_option(table, "FRAMES", kind_integer, "frames of the whole model, at equal "// &
                    "intervals after the one at the start", default="20", range=">= 1")
    call add_option(table, "HISTORY", kind_integer, "rows of energies and forces, likewise. Of "// &
                    "frames and rows, time steps end at the times of those that are due more "// &
                    "often; the others come with the first step at or after theirs", &
                    default="200", range=">= 1")
    call add_option(table, "CELLS", kind_choice, "cells of the pictures: LAGRANGE for all "// &
                    "readers; BEZIER keeps weights, for readers that know them. Those of "// &
                    "the first step hold in all", &
                    default="LAGRANGE", choices="LAGRANGE|BEZIER")
    call add_option(table, "FIELDS", kind_choice, "more fields: CONTACT: the pressure of the "// &
                    "contact pairs on blank and tools; WEAR: also pressure times slip on the "// &
                    "tools since the start, gathered in every time step. What one *STEP "// &
                    "asks for is written in all, as frames of a file have the same fields", &
                    default="NONE", &
                    choices="NONE|CONTACT|WEAR")
    call add_example(table, "*OUTPUT, FRAMES=20, HISTORY=200")
  end subroutine add_output_keywords

end module keyword_table
