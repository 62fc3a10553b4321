!> Amounts that no forming process has: friction, forces on holders, added mass.
module amount_check
  use kinds, only: wp
  use text, only: rounded_text
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t
  use model, only: model_t
  use flow_stress, only: flow_stress_of
  use reach_check, only: encounter_t
  use effort_check, only: overlap_of
  use travel, only: force_motion
  implicit none
  private

  public :: check_amounts

  ! Dry steel on steel; lubricated sheets have 0.02 to 0.2.
  real(wp), parameter :: most_friction = 0.5_wp
  ! Holders press with a few MPa, 1e-3 to 2e-2 of the yield stress.
  real(wp), parameter :: least_pressure = 1.0e-4_wp   !! of the yield stress
  real(wp), parameter :: most_added = 1.0_wp          !! mass, of that of the blank

contains

  !> Warn of friction, forces and scaled masses of unusual size.
  subroutine check_amounts(scene, model, encounters, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(scene%contacts)
      associate (pair => scene%contacts(i))
        if (pair%friction > most_friction) call add_warning(errors, pair%origin, &
          "a coefficient of friction of "//rounded_text(pair%friction)//" under the tool '"// &
          scene%tools(pair%tool)%name//"'", "at most "//rounded_text(most_friction)// &
          "; lubricated sheets have 0.02 to 0.2")
      end associate
    end do
    do i = 1, size(encounters)
      call check_pressure(scene, model, encounters(i), errors)
    end do
    associate (added => model%bodies%blank%mass_factor - 1.0_wp)
      if (added > most_added .and. .not. scene%step%has_relaxation) call add_warning(errors, &
        scene%step%origin, "a mass scaling that adds "//rounded_text(100*added)// &
        " % of the mass of the blank", "at most about "//rounded_text(100*most_added)// &
        " %: forces of inertia grow as much")
    end associate
  end subroutine check_amounts

  !> Warn of a force whose pressure on the blank under the tool is above its yield stress or, of a
  !! holder, next to nothing.
  subroutine check_pressure(scene, model, encounter, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounter
    type(error_list_t), intent(inout) :: errors
    real(wp) :: yield, force, area, sizes(3)
    character(:), allocatable :: expected
    integer :: k

    k = force_motion(scene, encounter%tool)
    yield = flow_stress_of(scene%materials(scene%blank%material), 0.0_wp)
    if (k == 0 .or. .not. yield > 0.0_wp .or. encounter%is_beside) return
    associate (spec => scene%motions(k))
      force = norm2(spec%vector)
      if (spec%curve > 0) force = force*maxval(abs(scene%curves(spec%curve)%values))
      sizes = overlap_of(scene, model, encounter)
      sizes(maxloc(abs(spec%vector), 1)) = 1.0_wp
      area = product(sizes)
      if (.not. area > 0.0_wp .or. .not. force > 0.0_wp) return
      expected = ""
      if (force > yield*area) expected = "less than that; check the unit of the force"
      ! Of two tools the one that a force moves may only rest on the blank.
      if (force < least_pressure*yield*area .and. size(scene%tools) > 2) expected = &
        "a pressure of more than "//rounded_text(least_pressure)//" of that; check the unit of "// &
        "the force"
      if (expected == "") return
      call add_warning(errors, spec%origin, "a force of "//rounded_text(model%width_ratio*force)// &
        " on the tool '"//scene%tools(encounter%tool)%name//"', a mean pressure of "// &
        rounded_text(force/area)//" on the blank under it, which yields at "// &
        rounded_text(yield), expected)
    end associate
  end subroutine check_pressure

end module amount_check
