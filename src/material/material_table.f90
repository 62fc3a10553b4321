!> The table of constitutive laws: from the name and constants of a deck to a block law.
module material_table
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: string_t, append_text, joined
  use block_law, only: block_law_t, law_entry_t
  use elastic, only: elastic_law
  use neo_hooke, only: neo_hooke_law
  use law_spec, only: law_spec_t
  use constant_check, only: check_count, require
  use hardening, only: new_hardening, voce_kind, back_stresses_t, new_back_stresses
  use flow_curve, only: set_heating, flow_curve_t, set_rate_factor, set_rate_curves
  use voce, only: new_voce
  use mises_plastic, only: new_mises_plastic
  use yield_function, only: yield_function_t, new_yield_function
  use tensor_rotation, only: axes_from_points
  use anisotropic_plastic, only: new_anisotropic_plastic
  use yoshida_uemori, only: new_yoshida_uemori
  use damage_law, only: add_damage
  use plane_yield, only: plane_yield_t
  use sheet_functions, only: is_sheet_function, is_for_sheets_alone, new_sheet_function
  use sheet_plastic, only: new_sheet_plastic
  use part_conflicts, only: part_conflict_t, find_part_conflicts
  implicit none
  private

  public :: new_law, known_laws, check_elastic

contains

  !> All laws of the program: a new one is one line here and a file of its own.
  function known_laws() result(laws)
    type(law_entry_t), allocatable :: laws(:)

    laws = [elastic_law(), &
            neo_hooke_law(), &
            law_entry_t("PLASTIC", build=new_watched_plastic)]
  end function known_laws

  !> The law that a deck asks for, with its constants checked.
  !!
  !! Rejected: unknown names, constants that are not finite, too many or too few of them, density
  !! or stiffness not positive, Poisson's ratio outside (-1, 0.5), hardening constants that give
  !! a yield stress that is not positive or that falls.
  subroutine new_law(spec, law, error, laws)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(law_entry_t), intent(in), optional :: laws(:)   !! to choose from; absent: `known_laws`

    type(law_entry_t), allocatable :: table(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    call check_elastic(spec%density, spec%young, spec%poisson, error)
    if (allocated(error)) return
    if (present(laws)) then
      table = laws
    else
      table = known_laws()
    end if
    allocate (names(0))
    do i = 1, size(table)
      call append_text(names, trim(table(i)%name))
      if (table(i)%name /= spec%law) cycle
      if (table(i)%n_constants >= 0) &
        call check_count("the law "//spec%law, spec%constants, table(i)%n_constants, &
                         trim(table(i)%constants), error)
      if (.not. allocated(error)) call table(i)%build(spec, law, error)
      return
    end do
    call fail(error, "material: unknown law "//trim(spec%law)//"; known laws: "// &
              joined(names, ", "))
  end subroutine new_law

  !> What every law needs for its mass and its stable time increment. Written so that a NaN is
  !! rejected.
  pure subroutine check_elastic(density, young, poisson, error)
    real(wp), intent(in) :: density, young, poisson
    type(error_t), allocatable, intent(out) :: error

    call require(density > 0.0_wp .and. density <= huge(density), &
                 "material: the density must be positive", error)
    call require(young > 0.0_wp .and. young <= huge(young), &
                 "material: Young's modulus must be positive", error)
    call require(poisson > -1.0_wp .and. poisson < 0.5_wp, &
                 "material: Poisson's ratio must lie between -1 and 0.5, both excluded", error)
  end subroutine check_elastic

  !> The law of *PLASTIC, with a damage indicator if the deck names one.
  subroutine new_watched_plastic(spec, law, error)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error

    call new_plastic(spec, law, error)
    if (allocated(error) .or. .not. allocated(spec%plasticity%damage)) return
    call add_damage(spec%plasticity%damage, law, error)
    if (allocated(error)) error%keyword = "*DAMAGE INITIATION"
  end subroutine new_watched_plastic

  !> The law of *PLASTIC and the keywords that say how it flows, with all constants checked.
  subroutine new_plastic(spec, law, error)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(flow_curve_t) :: curve
    type(back_stresses_t) :: back
    type(part_conflict_t), allocatable :: conflicts(:)

    call find_part_conflicts(spec, conflicts)
    if (size(conflicts) > 0) then
      call fail(error, "material: "//conflicts(1)%found//"; expected "//conflicts(1)%expected)
      error%keyword = conflicts(1)%keyword
      return
    end if
    if (spec%plasticity%hardening == "YOSHIDA UEMORI") then
      call new_yoshida_uemori(spec, law, error)
      return
    end if
    call new_hardening(spec%plasticity%hardening, spec%constants, curve%hardening, error)
    if (blames(error, "*PLASTIC")) return
    if (allocated(spec%plasticity%rate_curves)) then
      call set_rate_curves(spec%plasticity%rate_curves, spec%plasticity%is_logarithmic, curve, &
                           error)
      if (blames(error, "*PLASTIC")) return
    else if (spec%plasticity%rate /= "") then
      call set_rate_factor(spec%plasticity%rate, spec%plasticity%rate_constants, curve, error)
      if (blames(error, "*RATE DEPENDENT")) return
    end if
    if (allocated(spec%plasticity%heating)) then
      call set_heating(spec%density, spec%plasticity%heating, curve%heating, error)
      if (blames(error, "*ADIABATIC HEATING")) return
    end if
    if (allocated(spec%plasticity%back_stresses)) then
      call new_back_stresses(spec%plasticity%back_stresses, back, error)
      if (blames(error, "*BACK STRESS")) return
    end if
    if (spec%plasticity%potential /= "") then
      call new_anisotropic(spec, curve, back, law, error)
    else if (curve%hardening%kind == voce_kind .and. spec%plasticity%rate == "" .and. back%n == 0 &
             .and. spec%plasticity%n_stages == 0 .and. .not. curve%heating%is_active) then
      allocate (law, source=new_voce(spec%density, spec%young, spec%poisson, spec%constants(1), &
                                     spec%constants(2), spec%constants(3)))
    else
      allocate (law, source=new_mises_plastic(spec%density, spec%young, spec%poisson, curve, back, &
                                              spec%plasticity%n_stages))
    end if
  end subroutine new_plastic

  !> Is there an error? Then it is one of this keyword.
  logical function blames(error, keyword)
    type(error_t), allocatable, intent(inout) :: error
    character(*), intent(in) :: keyword

    blames = allocated(error)
    if (blames) error%keyword = keyword
  end function blames

  !> An anisotropic yield function.
  subroutine new_anisotropic(spec, curve, back, law, error)
    type(law_spec_t), intent(in) :: spec
    type(flow_curve_t), intent(in) :: curve
    type(back_stresses_t), intent(in) :: back
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(yield_function_t) :: yield
    type(plane_yield_t) :: plane
    real(wp) :: axes(3, 3)
    logical :: is_plane

    is_plane = is_for_sheets_alone(spec%plasticity%potential) .or. &
               (spec%is_sheet .and. is_sheet_function(spec%plasticity%potential))
    if (is_plane) then
      call new_sheet_function(spec%plasticity%potential, spec%plasticity%coefficients, plane, error)
    else
      call new_yield_function(spec%plasticity%potential, spec%plasticity%coefficients, yield, error)
    end if
    if (blames(error, "*POTENTIAL")) return
    call axes_from_points(spec%plasticity%orientation, axes, error)
    if (blames(error, "*ORIENTATION")) return
    if (is_plane) then
      allocate (law, source=new_sheet_plastic(spec%density, spec%young, spec%poisson, curve, &
                                              back, plane, axes))
    else
      allocate (law, source=new_anisotropic_plastic(spec%density, spec%young, spec%poisson, curve, &
                                                    yield, back, axes, spec%plasticity%n_stages))
    end if
  end subroutine new_anisotropic

end module material_table
