!> Keywords that follow *PLASTIC in a material and do not go together, and what does.
module part_conflicts
  use law_spec, only: law_spec_t
  use sheet_functions, only: is_sheet_function, is_for_sheets_alone
  implicit none
  private

  public :: part_conflict_t, find_part_conflicts

  character(*), parameter :: of_solids = "HILL48, YLD91, YLD2000 or YLD2004"
  integer, parameter :: most = 10

  !> A keyword that does not go with another one.
  type :: part_conflict_t
    character(:), allocatable :: keyword     !! such as *POTENTIAL
    character(:), allocatable :: found
    character(:), allocatable :: expected
  end type part_conflict_t

contains

  !> All conflicts of a law; none where it is not PLASTIC.
  pure subroutine find_part_conflicts(spec, conflicts)
    type(law_spec_t), intent(in) :: spec
    type(part_conflict_t), allocatable, intent(out) :: conflicts(:)
    integer :: n

    allocate (conflicts(most))
    n = 0
    if (spec%law == "PLASTIC") then
      if (spec%plasticity%hardening == "YOSHIDA UEMORI") then
        call add_of_yoshida_uemori(spec, conflicts, n)
      else
        if (allocated(spec%plasticity%unloading)) &
          call add(conflicts, n, "*UNLOADING MODULUS", "a modulus that falls, with HARDENING="// &
                   trim(spec%plasticity%hardening), "HARDENING=YOSHIDA UEMORI, which alone "// &
                   "has it, or no *UNLOADING MODULUS")
        if (spec%plasticity%rate /= "" .and. allocated(spec%plasticity%rate_curves)) &
          call add(conflicts, n, "*RATE DEPENDENT", "TYPE="//trim(spec%plasticity%rate)// &
                   " with curves of *PLASTIC, RATE=", "no *RATE DEPENDENT, or one *PLASTIC")
        if (is_sheet_function(spec%plasticity%potential)) &
          call add_of_sheet_function(spec, conflicts, n)
        if (spec%plasticity%potential /= "" .and. .not. allocated(spec%plasticity%orientation)) &
          call add(conflicts, n, "*POTENTIAL", "TYPE="//trim(spec%plasticity%potential)// &
                   " without the axes of the material", "an *ORIENTATION whose first axis is "// &
                   "the rolling direction")
      end if
    end if
    conflicts = conflicts(:n)
  end subroutine find_part_conflicts

  !> The two-surface model is whole in itself: nothing but the modulus can be added to it.
  pure subroutine add_of_yoshida_uemori(spec, conflicts, n)
    type(law_spec_t), intent(in) :: spec
    type(part_conflict_t), intent(inout) :: conflicts(:)
    integer, intent(inout) :: n
    character(*), parameter :: with = " with HARDENING=YOSHIDA UEMORI, which has "
    character(*), parameter :: other = ", or another HARDENING"

    associate (plasticity => spec%plasticity)
      if (plasticity%n_stages > 0) &
        call add(conflicts, n, "*PLASTIC", "STRESS UPDATE=MULTISTAGE"//with//"backward Euler "// &
                 "alone", "no STRESS UPDATE"//other)
      if (plasticity%rate /= "") &
        call add(conflicts, n, "*RATE DEPENDENT", "TYPE="//trim(plasticity%rate)//with// &
                 "no effect of the rate", "no *RATE DEPENDENT"//other)
      if (allocated(plasticity%heating)) &
        call add(conflicts, n, "*ADIABATIC HEATING", "heating"//with//"no effect of the "// &
                 "temperature", "no *ADIABATIC HEATING"//other)
      if (allocated(plasticity%back_stresses)) &
        call add(conflicts, n, "*BACK STRESS", "back stresses"//with//"its own", &
                 "no *BACK STRESS"//other)
      if (plasticity%potential /= "") &
        call add(conflicts, n, "*POTENTIAL", "TYPE="//trim(plasticity%potential)//with// &
                 "von Mises alone, in shells and solids", "no *POTENTIAL, or, for anisotropy "// &
                 "under cyclic loads, another HARDENING and *BACK STRESS")
    end associate
  end subroutine add_of_yoshida_uemori

  !> Functions of plane stress take less than those of solids.
  pure subroutine add_of_sheet_function(spec, conflicts, n)
    type(law_spec_t), intent(in) :: spec
    type(part_conflict_t), intent(inout) :: conflicts(:)
    integer, intent(inout) :: n
    character(:), allocatable :: type

    type = "TYPE="//trim(spec%plasticity%potential)
    if (is_for_sheets_alone(spec%plasticity%potential) .and. .not. spec%is_sheet) &
      call add(conflicts, n, "*POTENTIAL", type//", a yield function of plane stress, for solids", &
               of_solids//", or shells (*BLANK, ELEMENT=SHELL; *MATERIAL TEST, STRESS "// &
               "STATE=PLANE STRESS)")
    if (spec%is_sheet .and. spec%plasticity%n_stages > 0) &
      call add(conflicts, n, "*PLASTIC", "STRESS UPDATE=MULTISTAGE with *POTENTIAL, "//type// &
               ", which has backward Euler alone in plane stress", "no STRESS UPDATE, or "// &
               "HILL48, YLD91 or YLD2004")
  end subroutine add_of_sheet_function

  pure subroutine add(conflicts, n, keyword, found, expected)
    type(part_conflict_t), intent(inout) :: conflicts(:)
    integer, intent(inout) :: n
    character(*), intent(in) :: keyword, found, expected

    n = n + 1
    conflicts(n)%keyword = keyword
    conflicts(n)%found = found
    conflicts(n)%expected = expected
  end subroutine add

end module part_conflicts
