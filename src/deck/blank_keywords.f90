!> The keywords of the blank and of its patches.
module blank_keywords
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                          add_example, kind_real, kind_integer, kind_name, kind_choice
  implicit none
  private

  public :: add_blank_keywords

contains

  !> *BLANK and *PATCH.
  pure subroutine add_blank_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_blank_keyword(table)
    call add_keyword(table, "PATCH", "A patch of a blank of TYPE=PATCHES. Where patches meet, "// &
                     "degrees, knots, weights and control points of both faces must agree; the "// &
                     "control points then move as one.")
    call add_option(table, "NAME", kind_name, "name, for PATCH options")
    call add_option(table, "TYPE", kind_choice, "where the geometry comes from, as for *BLANK", &
                    default="BOX", choices="BOX|NURBS")
    call add_box_lines(table)
    call add_example(table, "*PATCH, NAME=left, TYPE=BOX")
    call add_example(table, "x, 0, 50, 2, 10")
    call add_example(table, "y, 0, 20, 2, 4")
    call add_example(table, "z, 0, 1, 2, 1")
  end subroutine add_blank_keywords

  pure subroutine add_blank_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "BLANK", "The sheet: one solid patch or several. Axis 1 (xi) "// &
                     "should be the longest and axis 3 (zeta) must be the thickness. BOX, "// &
                     "DISK, BAR, RING, TUBE and CUP generate shapes with exact circles; NURBS "// &
                     "takes the knots and points of *KNOTS and *CONTROL POINTS; PATCHES takes "// &
                     "every *PATCH.", &
                     is_unique=.true.)
    call add_option(table, "NAME", kind_name, "name, for PATCH options", default="BLANK")
    call add_option(table, "MATERIAL", kind_name, "name of the material")
    call add_option(table, "TYPE", kind_choice, "where the geometry comes from", default="BOX", &
                    choices="BOX|NURBS|DISK|BAR|RING|TUBE|CUP|PATCHES")
    call add_option(table, "AXIS", kind_choice, "axis of a round shape: thickness of a disk or "// &
                    "ring, length of a bar or tube, from the bottom of a cup to its edge", &
                    default="Z", choices="X|Y|Z")
    call add_option(table, "RULE", kind_name, "integration points of an element: SHEET "// &
                    "(degree along the sheet, degree + 1 in each half of the thickness, which "// &
                    "is axis 3), FULL (degree + 1 per direction), REDUCED (degree per "// &
                    "direction) or three counts in quotes; 2x3 splits the element in 2 equal "// &
                    "parts of 3 points each", default="SHEET")
    call add_option(table, "SPACING", kind_choice, "what lies at equal distances in a box: "// &
                    "knots, or control points, which makes the elements at the ends longer and "// &
                    "the stable step larger where the size along the sheet governs it; the "// &
                    "shape is the same", default="KNOTS", choices="KNOTS|CONTROL POINTS")
    call add_option(table, "PROJECTION", kind_choice, "strains projected against locking: BBAR "// &
                    "the volume strain, ANS also transverse shear, with the thickness strain "// &
                    "following", default="NONE", choices="NONE|BBAR|ANS")
    call add_option(table, "SPACE", kind_choice, "what strains are projected onto: polynomials "// &
                    "of each ELEMENT, or (BBAR only) the SMOOTH splines of one degree less on "// &
                    "the knots of the patch", default="ELEMENT", choices="ELEMENT|SMOOTH")
    call add_option(table, "SAMPLES", kind_name, "terms of the projection in each direction of "// &
                    "an element, three counts in quotes up to the integration points there; "// &
                    "the degrees where none are given", is_required=.false.)
    call add_option(table, "MERGE", kind_choice, "whether control points on the outsides of "// &
                    "patches that lie in one place move as one", default="YES", choices="YES|NO")
    call add_option(table, "TOLERANCE", kind_real, "largest distance of such points; 0: a "// &
                    "millionth of the size of the blank. Neighbours in the grid of a patch "// &
                    "must be farther apart, or one", default="0", unit="length", range=">= 0")
    call add_box_lines(table)
    call add_round_lines(table)
    call add_example(table, "*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, RULE=""2,2,2x3""")
    call add_example(table, "x, -50, 650, 2, 70")
    call add_example(table, "z, 0, 400, 2, 8")
    call add_example(table, "y, 0, 3, 2, 1")
  end subroutine add_blank_keyword

  pure subroutine add_box_lines(table)
    type(keyword_table_t), intent(inout) :: table

    call add_line(table, "One line each for the parametric axes xi, eta and zeta, in this "// &
                  "order. If the three would make a left-handed patch, eta runs from `to` to "// &
                  "`from`.", &
                  when="BOX", n_min=3, n_max=3)
    call add_field(table, "axis", kind_choice, "coordinate along which the axis runs", &
                   choices="X|Y|Z")
    call add_field(table, "from", kind_real, "coordinate at the start", unit="length")
    call add_field(table, "to", kind_real, "coordinate at the end, above `from`", unit="length")
    call add_field(table, "degree", kind_integer, "polynomial degree", range=">= 1 and <= 5")
    call add_field(table, "elements", kind_integer, "number of elements", range=">= 1")
    call add_field(table, "grading", kind_real, "length of the last element over the first, "// &
                   "or of the distances of control points if these are spaced", &
                   default="1", range="> 0")
  end subroutine add_box_lines

  pure subroutine add_round_lines(table)
    type(keyword_table_t), intent(inout) :: table

    call add_line(table, "Where the axis begins, radius, and height along the axis. Axis 1 of "// &
                  "a bar is its length; a disk has its thickness along axis 3.", when="DISK|BAR")
    call add_origin(table)
    call add_field(table, "radius", kind_real, "radius", unit="length", range="> 0")
    call add_field(table, "height", kind_real, "thickness or length", unit="length", range="> 0")
    call add_line(table, "The patch CORE, a square, and RIM1, RIM2 ... around it, with their "// &
                  "axis 1 (of a bar: 2) along the circle and the next one inward. A half or "// &
                  "quarter begins at the axis that follows AXIS.", when="DISK|BAR")
    call add_field(table, "angle", kind_real, "360, 180 or 90", unit="degrees", default="360", &
                   range=">= 90 and <= 360")
    call add_degree(table, "degree", "degree in the round plane", 2)
    call add_count(table, "around", "elements along an eighth of the circle")
    call add_count(table, "across", "elements across the rim")
    call add_degree(table, "degree_h", "degree along the height", 1)
    call add_count(table, "along", "elements along the height")
    call add_core(table)
    call add_line(table, "Where the axis begins, radii, and height along the axis.", &
                  when="RING|TUBE")
    call add_origin(table)
    call add_field(table, "inner", kind_real, "inner radius", unit="length", range="> 0")
    call add_field(table, "outer", kind_real, "outer radius", unit="length", range="> 0")
    call add_field(table, "height", kind_real, "thickness or length", unit="length", range="> 0")
    call add_line(table, "Axis 1 runs with the angle; axis 2 inward and axis 3 along the "// &
                  "height (RING), or axis 2 along the height and axis 3 outward (TUBE).", &
                  when="RING|TUBE")
    call add_field(table, "start", kind_real, "angle where it begins, from the axis that "// &
                   "follows AXIS", unit="degrees", default="0")
    call add_field(table, "angle", kind_real, "angle; 360 closes the ring", unit="degrees", &
                   default="360", range="> 0 and <= 360")
    call add_degree(table, "degree", "degree along axes 1 and 2", 2)
    call add_count(table, "around", "elements in each piece of the circle of at "// &
                   "most a quarter")
    call add_count(table, "across", "elements along axis 2")
    call add_degree(table, "degree_3", "degree along axis 3", 1)
    call add_count(table, "through", "elements along axis 3")
    call add_cup_lines(table)
  end subroutine add_round_lines

  pure subroutine add_cup_lines(table)
    type(keyword_table_t), intent(inout) :: table

    call add_line(table, "Middle of the bottom's outside, and the measures of the cup, its "// &
                  "radius and height those of the outside.", when="CUP")
    call add_origin(table)
    call add_field(table, "radius", kind_real, "radius", unit="length", range="> 0")
    call add_field(table, "height", kind_real, "height along the axis", unit="length", range="> 0")
    call add_field(table, "thickness", kind_real, "thickness of bottom and wall", unit="length", &
                   range="> 0")
    call add_field(table, "corner", kind_real, "radius inside, between bottom and wall", &
                   unit="length", range="> 0")
    call add_line(table, "The patches CORE and RIM1, RIM2 ... of the bottom as of a disk, "// &
                  "CORNER1 ... and WALL1 ... above its rims: axis 1 along the circle, axis 2 "// &
                  "down and to the middle, axis 3 inward. A half or quarter begins at the axis "// &
                  "that follows AXIS.", when="CUP")
    call add_field(table, "angle", kind_real, "360, 180 or 90", unit="degrees", default="360", &
                   range=">= 90 and <= 360")
    call add_degree(table, "degree", "degree along axes 1 and 2", 2)
    call add_count(table, "around", "elements along an eighth of the circle")
    call add_count(table, "across", "elements across the rim of the bottom")
    call add_count(table, "bend", "elements along the corner")
    call add_count(table, "along", "elements along the wall")
    call add_degree(table, "degree_t", "degree through the thickness", 1)
    call add_count(table, "through", "elements through the thickness")
    call add_core(table)
  end subroutine add_cup_lines

  pure subroutine add_core(table)
    type(keyword_table_t), intent(inout) :: table

    call add_field(table, "core", kind_real, "half the diagonal of the core over the radius of "// &
                   "the round section", default="0.5", range="> 0 and < 0.9")
  end subroutine add_core

  pure subroutine add_count(table, name, text)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: name, text

    call add_field(table, name, kind_integer, text, range=">= 1 and <= 1000")
  end subroutine add_count

  pure subroutine add_origin(table)
    type(keyword_table_t), intent(inout) :: table

    call add_field(table, "x", kind_real, "coordinate", unit="length")
    call add_field(table, "y", kind_real, "coordinate", unit="length")
    call add_field(table, "z", kind_real, "coordinate", unit="length")
  end subroutine add_origin

  pure subroutine add_degree(table, name, text, least)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: name, text
    integer, intent(in) :: least

    if (least == 2) then
      call add_field(table, name, kind_integer, text, range=">= 2 and <= 5")
    else
      call add_field(table, name, kind_integer, text, range=">= 1 and <= 5")
    end if
  end subroutine add_degree

end module blank_keywords
