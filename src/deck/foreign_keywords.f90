!> Keywords of Abaqus decks. Those that mean nothing here are passed over with a note, so that the
!! material of a subroutine's own deck can be taken as it is; of others the counterpart is named.
module foreign_keywords
  use lexer, only: block_t, option_place
  implicit none
  private

  public :: foreign_note, counterpart, lost_option

  character(*), parameter :: of_mesh(16) = [character(14) :: "NODE", "ELEMENT", "NSET", "ELSET", &
    "NGEN", "NFILL", "NCOPY", "ELGEN", "ELCOPY", "PART", "END PART", "ASSEMBLY", "END ASSEMBLY", &
    "INSTANCE", "END INSTANCE", "SYSTEM"]
  character(*), parameter :: of_section(6) = [character(26) :: "SOLID SECTION", "SHELL SECTION", &
    "SECTION CONTROLS", "HOURGLASS", "HOURGLASS STIFFNESS", "TRANSVERSE SHEAR STIFFNESS"]
  character(*), parameter :: of_step(6) = [character(18) :: "STATIC", "CONTROLS", &
    "SOLUTION TECHNIQUE", "PREPRINT", "RESTART", "MONITOR"]
  character(*), parameter :: of_output(16) = [character(21) :: "USER OUTPUT VARIABLES", &
    "FILE OUTPUT", "FIELD OUTPUT", "HISTORY OUTPUT", "ELEMENT OUTPUT", "NODE OUTPUT", &
    "CONTACT OUTPUT", "ENERGY OUTPUT", "INCREMENTATION OUTPUT", "NODE PRINT", "EL PRINT", &
    "ENERGY PRINT", "NODE FILE", "EL FILE", "ENERGY FILE", "DIAGNOSTICS"]
  character(*), parameter :: of_heat(3) = [character(13) :: "EXPANSION", "CONDUCTIVITY", &
    "SPECIFIC HEAT"]
  character(*), parameter :: of_contact(9) = [character(19) :: "SURFACE INTERACTION", &
    "FRICTION", "SURFACE BEHAVIOR", "CONTACT", "CONTACT INCLUSIONS", "CONTACT CONTROLS", &
    "CONTACT DAMPING", "CONTACT PROPERTY", "SURFACE"]
  character(*), parameter :: of_tools(3) = [character(13) :: "RIGID BODY", "RIGID SURFACE", "MASS"]
  character(*), parameter :: of_loads(4) = [character(8) :: "CLOAD", "DLOAD", "DSLOAD", "VELOCITY"]
  character(*), parameter :: passed_over = ": it and its lines are ignored"

contains

  !> Why the keyword is not needed here; empty if it is no such keyword.
  pure function foreign_note(block) result(note)
    type(block_t), intent(in) :: block
    character(:), allocatable :: note

    note = ""
    if (any(block%keyword == of_mesh)) then
      note = "none, for the mesh is that of *BLANK"//passed_over
    else if (any(block%keyword == of_section)) then
      note = "none, for *BLANK names its material and consists of solid elements"//passed_over
    else if (any(block%keyword == of_step)) then
      note = "none, for all steps are *DYNAMIC, EXPLICIT"//passed_over
    else if (any(block%keyword == of_output) .or. is_other_output(block)) then
      note = "none, for *OUTPUT, FRAMES=n, HISTORY=n says what is written"//passed_over
    else if (block%keyword == "PHYSICAL CONSTANTS") then
      note = "none, for nothing here needs absolute zero, radiation or the gas constant"// &
             passed_over
    else if (any(block%keyword == of_heat)) then
      note = "none, for heat is not conducted and no strain of expansion arises; "// &
             "*ADIABATIC HEATING heats by plastic work"//passed_over
    end if
  end function foreign_note

  !> An option of a keyword that would be passed over, but asks for what the result depends on;
  !! empty if there is none.
  pure function lost_option(block) result(option)
    type(block_t), intent(in) :: block
    character(:), allocatable :: option

    option = ""
    if (.not. any(block%keyword == of_section)) return
    if (option_place(block, "ORIENTATION") > 0) option = "ORIENTATION"
  end function lost_option

  !> What does here what a keyword of Abaqus does there; empty where nothing is known.
  pure function counterpart(keyword) result(hint)
    character(*), intent(in) :: keyword
    character(:), allocatable :: hint

    hint = ""
    if (any(keyword == of_contact)) then
      hint = "*CONTACT PAIR, TOOL=name, with options such as FACE, FRICTION and DAMPING"
    else if (any(keyword == of_tools)) then
      hint = "*TOOL, which is rigid; MASS of *TOOL FORCE where a force moves it"
    else if (any(keyword == of_loads)) then
      hint = "*TOOL MOTION or *TOOL FORCE for tools, *PRESSURE, *TRACTION, *GRAVITY or "// &
             "*BOUNDARY for the blank"
    end if
  end function counterpart

  !> *OUTPUT as Abaqus has it: with FIELD or a lone HISTORY.
  pure logical function is_other_output(block) result(is_other)
    type(block_t), intent(in) :: block
    integer :: place

    is_other = .false.
    if (block%keyword /= "OUTPUT") return
    is_other = option_place(block, "FIELD") > 0 .or. option_place(block, "DIAGNOSTICS") > 0
    place = option_place(block, "HISTORY")
    if (place > 0) is_other = is_other .or. .not. block%options(place)%has_value
  end function is_other_output

end module foreign_keywords
