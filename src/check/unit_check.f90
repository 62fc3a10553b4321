!> Whether material and sizes of a scene are those of a metal sheet in the deck's units.
!!
!! Where *UNITS names length, mass (or stress) and time, density, modulus and wave speed are judged
!! in SI units. Without a label, the numbers are compared with the systems of units that forming
!! decks use: numbers of a metal that fit none of them, though each alone fits one, are a mixture.
module unit_check
  use kinds, only: wp
  use text, only: string_t, rounded_text
  use input_errors, only: origin_t, error_list_t, add_warning
  use scene, only: scene_t, material_spec_t
  use flow_stress, only: flow_stress_of
  use unit_system, only: unit_system_t, new_unit_system, size_in_si
  implicit none
  private

  public :: check_units

  !> Sizes of the units of mass, length and time in SI units; 0: unknown.
  type :: scales_t
    character(17) :: name = ""
    real(wp) :: length = 0.0_wp, mass = 0.0_wp, time = 0.0_wp
  end type scales_t

  type(scales_t), parameter :: common(5) = [ &
    scales_t("mm, t, s, MPa", 1.0e-3_wp, 1.0e3_wp, 1.0_wp), &
    scales_t("m, kg, s, Pa", 1.0_wp, 1.0_wp, 1.0_wp), &
    scales_t("mm, kg, ms, GPa", 1.0e-3_wp, 1.0_wp, 1.0e-3_wp), &
    scales_t("mm, g, ms, MPa", 1.0e-3_wp, 1.0e-3_wp, 1.0e-3_wp), &
    scales_t("cm, g, us, Mbar", 1.0e-2_wp, 1.0e-3_wp, 1.0e-6_wp)]

  ! Magnesium and lead below, osmium above (CRC Handbook of Chemistry and Physics).
  real(wp), parameter :: densities(2) = [1.7e3_wp, 2.27e4_wp]     !! [kg/m^3]
  real(wp), parameter :: moduli(2) = [1.0e10_wp, 5.7e11_wp]       !! [Pa]
  real(wp), parameter :: speeds(2) = [1.0e3_wp, 1.0e4_wp]         !! of waves in a bar [m/s]
  ! Of the modulus: soft aluminium, copper and lead yield at 3e-4, the strongest steel wire and
  ! metallic glasses at 0.02.
  real(wp), parameter :: lowest_strength = 1.0e-4_wp, highest_strength = 0.05_wp
  real(wp), parameter :: typical_strain = 0.1_wp
  real(wp), parameter :: most_hardening = 10.0_wp   !! annealed copper: sixfold at 10 % strain
  real(wp), parameter :: thicknesses(2) = [1.0e-5_wp, 5.0e-2_wp]  !! of sheets [m]

contains

  !> Warn of density, modulus, wave speed and thickness that no metal sheet has.
  subroutine check_units(scene, thickness, errors)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: thickness       !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    type(scales_t) :: scales

    associate (material => scene%materials(scene%blank%material))
      scales = declared_scales(scene%units)
      if (.not. material%young > 0.0_wp) return
      call check_strength(material, scales, errors)
      if (scales%length > 0.0_wp) then
        call check_material(material, scales, errors)
      else
        call find_system(material, scales, errors)
      end if
      if (scales%length > 0.0_wp) &
        call check_thickness(thickness, scales, scene%blank%origin, errors)
    end associate
  end subroutine check_units

  !> What *UNITS names; all 0 where one of the three is missing.
  pure function declared_scales(label) result(scales)
    character(*), intent(in) :: label
    type(scales_t) :: scales
    type(unit_system_t) :: units

    units = new_unit_system(label)
    scales%length = size_in_si(units%length)
    scales%time = size_in_si(units%time)
    scales%mass = size_in_si(units%mass)
    if (.not. scales%mass > 0.0_wp) &
      scales%mass = size_in_si(units%stress)*scales%length*scales%time**2
    if (.not. min(scales%length, scales%time, scales%mass) > 0.0_wp) scales = scales_t()
  end function declared_scales

  pure real(wp) function density_in_si(material, scales) result(density)
    type(material_spec_t), intent(in) :: material
    type(scales_t), intent(in) :: scales

    density = material%density*scales%mass/scales%length**3
  end function density_in_si

  pure real(wp) function modulus_in_si(material, scales) result(modulus)
    type(material_spec_t), intent(in) :: material
    type(scales_t), intent(in) :: scales

    modulus = material%young*scales%mass/(scales%length*scales%time**2)
  end function modulus_in_si

  pure logical function is_within(value, limits)
    real(wp), intent(in) :: value, limits(2)

    is_within = value >= limits(1) .and. value <= limits(2)
  end function is_within

  !> Density, modulus and wave speed in the declared units.
  subroutine check_material(material, scales, errors)
    type(material_spec_t), intent(in) :: material
    type(scales_t), intent(in) :: scales
    type(error_list_t), intent(inout) :: errors
    real(wp) :: density, modulus, speed

    density = density_in_si(material, scales)
    modulus = modulus_in_si(material, scales)
    speed = sqrt(modulus/density)
    if (.not. is_within(density, densities)) call add_warning(errors, material%origin, &
      "the density "//rounded_text(material%density)//", which is "//rounded_text(density)// &
      " kg/m3 in the units that *UNITS names", "that of a metal, "//span_of(densities, "kg/m3")// &
      ", such as "//rounded_text(7.85e3_wp*scales%length**3/scales%mass)//" for steel")
    if (.not. is_within(modulus, moduli)) call add_warning(errors, material%origin, &
      "Young's modulus "//rounded_text(material%young)//", which is "// &
      rounded_text(modulus*1.0e-9_wp)//" GPa in the units that *UNITS names", &
      "that of a metal, "//span_of(moduli*1.0e-9_wp, "GPa")//", such as "// &
      rounded_text(2.1e11_wp*scales%length*scales%time**2/scales%mass)//" for steel")
    if (.not. is_within(speed, speeds)) call add_warning(errors, material%origin, &
      "a wave speed sqrt(E/density) of "//rounded_text(speed)//" m/s", "that of a metal, "// &
      span_of(speeds, "m/s")//": check the units of density and modulus")
  end subroutine check_material

  !> The system that numbers without label belong to, length 0 where none is sure. Numbers of a
  !! metal that mix two systems get a warning.
  subroutine find_system(material, scales, errors)
    type(material_spec_t), intent(in) :: material
    type(scales_t), intent(out) :: scales
    type(error_list_t), intent(inout) :: errors
    logical :: fits(2, size(common))
    integer :: i

    do i = 1, size(common)
      fits(1, i) = is_within(density_in_si(material, common(i)), densities)
      fits(2, i) = is_within(modulus_in_si(material, common(i)), moduli)
    end do
    if (count(all(fits, 1)) == 1) scales = common(findloc(all(fits, 1), .true., dim=1))
    if (any(all(fits, 1)) .or. .not. all(any(fits, 2))) return
    call add_warning(errors, material%origin, "the density "//rounded_text(material%density)// &
      " of a metal in "//trim(common(findloc(fits(1, :), .true., dim=1))%name)// &
      " with the modulus "//rounded_text(material%young)//" of one in "// &
      trim(common(findloc(fits(2, :), .true., dim=1))%name), &
      "both in one system of units, and its name in *UNITS")
  end subroutine find_system

  !> Warn of a yield stress in another unit than the modulus, and of hardening that leaves what a
  !! metal can carry.
  subroutine check_strength(material, scales, errors)
    type(material_spec_t), intent(in) :: material
    type(scales_t), intent(in) :: scales      !! length 0: not known
    type(error_list_t), intent(inout) :: errors
    real(wp) :: yield, flow
    character(:), allocatable :: words

    yield = flow_stress_of(material, 0.0_wp)
    flow = flow_stress_of(material, typical_strain)
    if (.not. flow > 0.0_wp) return
    ! A power law without an offset yields at once.
    if (flow <= highest_strength*material%young .and. &
        (yield >= lowest_strength*material%young .or. .not. yield > 0.0_wp) .and. &
        (flow <= most_hardening*yield .or. .not. yield > 0.0_wp)) return
    words = ""
    if (scales%length > 0.0_wp) words = ", which is "//rounded_text(1.0e-6_wp*yield*scales%mass &
                                        /(scales%length*scales%time**2))//" MPa"
    call add_warning(errors, material%origin, "the yield stress "//rounded_text(yield)//words// &
      ", and "//rounded_text(flow)//" after 10 % plastic strain, with the modulus "// &
      rounded_text(material%young), "a yield stress of "//rounded_text(lowest_strength)//" to "// &
      rounded_text(highest_strength)//" times the modulus, in its unit, that 10 % strain "// &
      "raises at most "//rounded_text(most_hardening)//"-fold")
  end subroutine check_strength

  !> A sheet is thinner than a slab and thicker than a foil.
  subroutine check_thickness(thickness, scales, origin, errors)
    real(wp), intent(in) :: thickness
    type(scales_t), intent(in) :: scales
    type(origin_t), intent(in) :: origin
    type(error_list_t), intent(inout) :: errors

    if (is_within(thickness*scales%length, thicknesses)) return
    call add_warning(errors, origin, "a sheet "//rounded_text(thickness)// &
      " thick, which is "//rounded_text(thickness*scales%length*1.0e3_wp)//" mm", &
      span_of(thicknesses*1.0e3_wp, "mm")//": check the unit of the deck's lengths")
  end subroutine check_thickness

  pure function span_of(limits, unit) result(words)
    real(wp), intent(in) :: limits(2)
    character(*), intent(in) :: unit
    character(:), allocatable :: words

    words = rounded_text(limits(1))//" to "//rounded_text(limits(2))//" "//unit
  end function span_of

end module unit_check
