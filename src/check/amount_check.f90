!> Amounts that no forming process has: friction, forces on holders and of draw beads, pressures,
!! added mass; and axes of a sheet that do not lie in it.
module amount_check
  use kinds, only: wp
  use text, only: rounded_text, place_text
  use input_errors, only: error_list_t, origin_t, add_warning
  use scene, only: scene_t, origin_of_part
  use model, only: model_t
  use flow_stress, only: flow_stress_of
  use tensor_rotation, only: axes_from_points
  use failure, only: error_t
  use linear_algebra, only: cross
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
  real(wp), parameter :: formed = 0.1_wp              !! plastic strain of a sheet under load
  real(wp), parameter :: upright = 0.5_wp             !! cosine of axis 3 and the normal, at least
  real(wp), parameter :: most_added = 1.0_wp          !! mass, of that of the blank

contains

  !> Warn of friction, forces and scaled masses of unusual size.
  subroutine check_amounts(scene, model, encounters, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    real(wp), intent(in) :: thickness         !! of the blank [length]
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
    call check_strength(scene, thickness, errors)
    call check_axes(scene, errors)
    call check_added_mass(scene, model%bodies%blank%mass_factor - 1.0_wp, errors)
  end subroutine check_amounts

  !> Warn of much added mass in the first explicit step: static ones know no inertia, and
  !! frequencies are those of the mass itself.
  subroutine check_added_mass(scene, added, errors)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: added             !! of the mass of the blank
    type(error_list_t), intent(inout) :: errors
    type(origin_t) :: origin
    integer :: i

    if (.not. added > most_added .or. scene%step%has_relaxation) return
    i = findloc([scene%step%is_static, scene%later_steps%step%is_static], .false., dim=1)
    if (i == 0) return
    origin = scene%step%origin
    if (i > 1) origin = scene%later_steps(i - 1)%step%origin
    call add_warning(errors, origin, "a mass scaling that adds "//rounded_text(100*added)// &
                     " % of the mass of the blank", "at most about "// &
                     rounded_text(100*most_added)//" %: forces of inertia grow as much")
  end subroutine check_added_mass

  !> Warn of draw beads and pressures that are stronger than the sheet: its flow stress.
  subroutine check_strength(scene, thickness, errors)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    real(wp) :: flow, amount
    integer :: i

    flow = flow_stress_of(scene%materials(scene%blank%material), formed)
    if (.not. flow > 0.0_wp) return
    do i = 1, size(scene%beads)
      associate (bead => scene%beads(i))
        amount = max(abs(bead%restraint), abs(bead%hold_down))*greatest(scene, bead%curve)
        if (amount > flow*thickness) call add_warning(errors, bead%origin, "a force of "// &
          rounded_text(amount)//" per length of a draw bead, where the sheet carries "// &
          rounded_text(flow*thickness)//", its flow stress times its thickness", &
          "less than that; check the unit of the force")
      end associate
    end do
    do i = 1, size(scene%loads)
      associate (load => scene%loads(i))
        if (load%kind /= "PRESSURE") cycle
        amount = abs(load%value(1))*greatest(scene, load%curve)
        if (amount > flow) call add_warning(errors, load%origin, "a pressure of "// &
          rounded_text(amount)//", where the flow stress of the sheet is "//rounded_text(flow), &
          "less than that; check the unit of the pressure")
      end associate
    end do
  end subroutine check_strength

  !> Greatest absolute value of a curve; 1 without one.
  pure real(wp) function greatest(scene, curve)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: curve              !! of the scene; 0: none

    greatest = 1.0_wp
    if (curve > 0) greatest = maxval(abs(scene%curves(curve)%values))
  end function greatest

  !> Warn of axes of an anisotropic sheet of which the third does not run through the thickness.
  subroutine check_axes(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    real(wp) :: axes(3, 3), normal(3), most
    integer :: p

    associate (material => scene%materials(scene%blank%material))
      if (material%plasticity%potential == "" .or. .not. &
          allocated(material%plasticity%orientation)) return
      call axes_from_points(material%plasticity%orientation, axes, error)
      if (allocated(error)) return
      most = 0.0_wp
      do p = 1, size(scene%blank%patches)
        associate (x => scene%blank%patches(p)%solid%points)
          normal = cross(x(size(x, 1), 1, 1, :) - x(1, 1, 1, :), x(1, size(x, 2), 1, :) &
                         - x(1, 1, 1, :))
        end associate
        if (.not. norm2(normal) > 0.0_wp) return   ! a closed patch
        most = max(most, abs(dot_product(axes(:, 3), normal))/norm2(normal))
      end do
      if (most < upright) call add_warning(errors, origin_of_part(material, "*ORIENTATION"), &
        "an axis 3 of the material along "//place_text(axes(:, 3))//", which lies in the sheet", &
        "vectors a and b in the plane of the sheet, a along the rolling direction")
    end associate
  end subroutine check_axes

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
      force = force*greatest(scene, spec%curve)
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
