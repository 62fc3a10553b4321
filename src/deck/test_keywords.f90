!> The keyword of tests on one material point, for the table of all keywords.
module test_keywords
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                          add_example, kind_real, kind_integer, kind_name, kind_choice, any_number
  implicit none
  private

  public :: add_test_keyword

  character(*), parameter :: single = "UNIAXIAL|COMPRESSION|SIMPLE SHEAR|PLANE STRAIN|EQUIBIAXIAL"

contains

  !> *MATERIAL TEST.
  pure subroutine add_test_keyword(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "MATERIAL TEST", "A test of one material point, carried out by "// &
                     "`igaform material DECK`; a forming run leaves it out. Axes 1 and 2 lie "// &
                     "in the sheet, 3 is its thickness; axis 1 of the material is its rolling "// &
                     "direction. Strains are logarithmic, shears are engineering ones.")
    call add_options(table)
    call add_line(table, "UNIAXIAL: strain 11, a negative one compresses. COMPRESSION: through "// &
                  "the thickness. SIMPLE SHEAR: gamma. PLANE STRAIN: strain 11, none along 2. "// &
                  "EQUIBIAXIAL: mean of strains 11 and 22 under equal stresses. All stresses "// &
                  "that are not named are zero.", when=single)
    call add_field(table, "strain", kind_real, "strain at the end")
    call add_line(table, "Uniaxial strain from zero up and then back and forth.", when="CYCLIC")
    call add_field(table, "strain", kind_real, "amplitude")
    call add_field(table, "cycles", kind_integer, "cycles behind the first rise", default="1", &
                   range=">= 1 and <= 1000")
    call add_line(table, "Tension at angles from 0 to 90 degrees.", when="R VALUES")
    call add_field(table, "strain", kind_real, "strain at which r is taken", default="0.1", &
                   range="> 0")
    call add_field(table, "angles", kind_integer, "number of angles", default="7", &
                   range=">= 2 and <= 1000")
    call add_line(table, "First yield under stresses 11 and 22 of all ratios.", when="YIELD LOCUS")
    call add_field(table, "directions", kind_integer, "number of directions in the plane", &
                   default="72", range=">= 4 and <= 10000")
    call add_field(table, "eqps", kind_real, "plastic strain that counts as yielding", &
                   default="1e-6", range="> 0")
    call add_line(table, "Corners of a path that starts from zero at time 0 and is straight "// &
                  "between them.", when="PATH", n_max=any_number)
    call add_field(table, "time", kind_real, "time, rising", unit="time", range="> 0")
    call add_components(table)
    call add_example(table, "*MATERIAL TEST, NAME=tension, MATERIAL=steel, TYPE=UNIAXIAL, "// &
                     "INCREMENTS=300")
    call add_example(table, "0.3")
    call add_example(table, "*MATERIAL TEST, NAME=reversal, MATERIAL=steel, TYPE=PATH, "// &
                     'STRESS="22, 33, 13, 23"')
    call add_example(table, "1, 0.02, 0, 0, 0, 0, 0")
    call add_example(table, "2, 0.01, 0, 0, 0.02, 0, 0")
  end subroutine add_test_keyword

  pure subroutine add_options(table)
    type(keyword_table_t), intent(inout) :: table

    call add_option(table, "NAME", kind_name, "name in the results: letters, digits, blanks, "// &
                    "- and _")
    call add_option(table, "MATERIAL", kind_name, "name of the material")
    call add_option(table, "TYPE", kind_choice, "what is done", &
                    choices=single//"|CYCLIC|PATH|R VALUES|YIELD LOCUS")
    call add_option(table, "INCREMENTS", kind_integer, "increments of each straight part", &
                    default="100", range=">= 1 and <= 1000000")
    call add_option(table, "RATE", kind_real, "rate of the strain that is given", default="1", &
                    unit="1/time", range="> 0")
    call add_option(table, "ANGLE", kind_real, "from axis 1 of the material to axis 1 of the "// &
                    "test, about axis 3", default="0", unit="degrees")
    call add_option(table, "STRESS", kind_name, "PATH: components that are stresses, such as "// &
                    """33, 13, 23""; the others are strains", is_required=.false.)
    call add_option(table, "INPUT", kind_name, "file with the data lines, as CSV with or "// &
                    "without a first line of column names", is_required=.false.)
  end subroutine add_options

  pure subroutine add_components(table)
    type(keyword_table_t), intent(inout) :: table
    character(2), parameter :: names(6) = ["11", "22", "33", "12", "13", "23"]
    integer :: i

    do i = 1, size(names)
      call add_field(table, names(i), kind_real, "strain or stress "//names(i), default="0", &
                     unit="none, stress")
    end do
  end subroutine add_components

end module test_keywords
