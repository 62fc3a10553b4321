!> How large the forces of inertia are that a moving tool causes, compared with the force that the
!! forming should need; and the speed of the tool at which they are small.
!!
!! A sheet that is set in motion at the speed v carries the stress density*c*v, c = sqrt(E/density):
!! the impact. A tool that accelerates by a needs m*a for the mass m of the blank. The force of
!! forming is that of a wall around the tool that carries the flow stress after 10 % strain.
module effort_check
  use kinds, only: wp
  use failure, only: error_t
  use text, only: string_t, rounded_text, append_text
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t, material_spec_t
  use hardening, only: hardening_t, new_hardening, harden
  use unit_system, only: unit_system_t, new_unit_system, unit_of
  use blank, only: mass_of
  use model, only: model_t
  use sheet_target, only: sheet_target_t
  use sweep, only: frame_t
  use reach_check, only: meeting_t
  implicit none
  private

  public :: effort_t, effort_of, effort_lines, check_effort

  real(wp), parameter :: typical_strain = 0.1_wp
  real(wp), parameter :: small = 0.05_wp      !! part of the forming force that inertia may take

  !> Forces that a tool causes [force], and its speeds [length/time].
  type :: effort_t
    real(wp) :: speed = 0.0_wp                !! greatest
    real(wp) :: touch_speed = 0.0_wp          !! when it first touches the blank
    real(wp) :: acceleration = 0.0_wp         !! greatest after that
    real(wp) :: impact = 0.0_wp, inertia = 0.0_wp, forming = 0.0_wp
    real(wp) :: slow = 0.0_wp                 !! speed at which both are small
  end type effort_t

contains

  !> Zero where the tool does not move or touch, or the law has no flow stress that is known.
  function effort_of(scene, model, meeting, thickness) result(effort)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(meeting_t), intent(in) :: meeting
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(effort_t) :: effort
    real(wp) :: flow, section, ratio

    associate (material => scene%materials(scene%blank%material), blank => model%bodies%blank)
      flow = flow_stress_of(material)
      if (.not. flow > 0.0_wp .or. .not. meeting%approach%has_touched) return
      call find_speeds(meeting, effort)
      if (.not. effort%speed > 0.0_wp) return
      section = perimeter_of(model, meeting, scene%reduction%component)*thickness
      effort%forming = flow*section
      effort%impact = sqrt(material%young*material%density)*effort%touch_speed*section
      effort%inertia = model%width_ratio*mass_of(blank%parts)/blank%mass_factor*effort%acceleration
      ! The impact grows with the speed, the inertia of a given stroke with its square.
      ratio = max(effort%impact/(small*effort%forming), &
                  sqrt(effort%inertia/(small*effort%forming)))
      effort%slow = effort%speed/max(ratio, tiny(1.0_wp))
    end associate
  end function effort_of

  !> Lines for each tool that moves, for `--check`.
  function effort_lines(scene, model, meetings, thickness) result(lines)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(meeting_t), intent(in) :: meetings(:)
    real(wp), intent(in) :: thickness
    type(string_t), allocatable :: lines(:)
    type(effort_t) :: effort
    type(unit_system_t) :: units
    character(:), allocatable :: force, speed
    integer :: i

    allocate (lines(0))
    force = ""
    speed = ""
    if (scene%units /= "") then
      units = new_unit_system(scene%units)
      force = " "//unit_of(units, "force")
      speed = " "//unit_of(units, "velocity")
    end if
    do i = 1, size(meetings)
      effort = effort_of(scene, model, meetings(i), thickness)
      if (.not. effort%speed > 0.0_wp) cycle
      call append_text(lines, "speed            tool "//scene%tools(meetings(i)%tool)%name// &
        " at up to "//rounded_text(effort%speed)//speed//", "// &
        rounded_text(effort%touch_speed)//" when it touches: impact "// &
        rounded_text(effort%impact)//force//", inertia "//rounded_text(effort%inertia)//force// &
        ", forming about "//rounded_text(effort%forming)//force)
      if (max(effort%impact, effort%inertia) > small*effort%forming) call append_text(lines, &
        "                 both are below 5 % of the forming force up to "// &
        rounded_text(effort%slow)//speed)
    end do
  end function effort_lines

  !> Warn where inertia exceeds the force of forming.
  subroutine check_effort(scene, model, meetings, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(meeting_t), intent(in) :: meetings(:)
    real(wp), intent(in) :: thickness
    type(error_list_t), intent(inout) :: errors
    type(effort_t) :: effort
    character(:), allocatable :: found
    integer :: i, k

    do i = 1, size(meetings)
      effort = effort_of(scene, model, meetings(i), thickness)
      found = ""
      if (effort%impact > effort%forming) found = "strikes the blank at "// &
        rounded_text(effort%touch_speed)//", an impact force of "//rounded_text(effort%impact)
      if (effort%inertia > effort%forming) found = "accelerates the blank by up to "// &
        rounded_text(effort%acceleration)//", a force of inertia of "//rounded_text(effort%inertia)
      if (found == "") cycle
      k = findloc(scene%motions%tool, meetings(i)%tool, dim=1)
      call add_warning(errors, scene%motions(k)%origin, "the tool '"// &
        scene%tools(meetings(i)%tool)%name//"', which "//found//", where the forming takes "// &
        "about "//rounded_text(effort%forming), "a speed of at most "// &
        rounded_text(effort%slow)//", or an *AMPLITUDE that starts and stops gently")
    end do
  end subroutine check_effort

  !> Flow stress after a typical strain; 0 for laws that do not say it.
  function flow_stress_of(material) result(flow)
    type(material_spec_t), intent(in) :: material
    real(wp) :: flow
    type(hardening_t) :: curve
    type(error_t), allocatable :: error
    real(wp) :: stress(1), slope(1)

    flow = 0.0_wp
    if (material%law /= "PLASTIC") return
    call new_hardening(trim(material%plasticity%hardening), material%constants, curve, error)
    if (allocated(error)) return
    call harden(curve, 1, [typical_strain], stress, slope)
    flow = stress(1)
  end function flow_stress_of

  !> Greatest speed, speed at the first touch, and greatest acceleration after it, from velocities
  !! in the middle between two positions.
  pure subroutine find_speeds(meeting, effort)
    type(meeting_t), intent(in) :: meeting
    type(effort_t), intent(inout) :: effort
    real(wp), parameter :: steady = 1.0e-6_wp   ! change of a speed that is round-off
    real(wp), dimension(3, size(meeting%frames)) :: velocity
    real(wp) :: times(size(meeting%frames)), change
    integer :: k, n

    n = size(meeting%frames) - 1
    do k = 1, n
      associate (a => meeting%frames(k), b => meeting%frames(k + 1))
        velocity(:, k) = (b%displacement - a%displacement)/(b%time - a%time)
        times(k) = 0.5_wp*(a%time + b%time)
        effort%speed = max(effort%speed, norm2(velocity(:, k)))
      end associate
    end do
    do k = 2, n
      change = norm2(velocity(:, k) - velocity(:, k - 1))
      if (times(k) > meeting%approach%first%time .and. change > steady*effort%speed) &
        effort%acceleration = max(effort%acceleration, change/(times(k) - times(k - 1)))
    end do
    if (n == 0) return
    ! Before the first and after the last middle the line through two goes on.
    k = max(1, min(n - 1, count(times(:n) <= meeting%approach%first%time)))
    effort%touch_speed = norm2(velocity(:, k))
    if (n > 1) effort%touch_speed = norm2(velocity(:, k) + (velocity(:, k + 1) - velocity(:, k)) &
                              *(meeting%approach%first%time - times(k))/(times(k + 1) - times(k)))
    effort%touch_speed = min(effort%touch_speed, effort%speed)
    if (effort%touch_speed < steady*effort%speed) effort%touch_speed = 0.0_wp
  end subroutine find_speeds

  !> Perimeter of the box, across the travel of the tool, around what tool and blank have in common;
  !! of the full width of a strip.
  pure real(wp) function perimeter_of(model, meeting, component) result(perimeter)
    type(model_t), intent(in) :: model
    type(meeting_t), intent(in) :: meeting
    integer, intent(in) :: component          !! across the strip, not above 0: no strip
    real(wp) :: low(3), high(3), shift(3), size_along(3)
    integer :: c, p, across

    associate (parts => model%bodies%blank%parts, tool => model%bodies%tools(meeting%tool), &
               last => meeting%frames(size(meeting%frames)))
      low = huge(1.0_wp)
      high = -huge(1.0_wp)
      do p = 1, size(parts)
        do c = 1, 3
          low(c) = min(low(c), minval(parts(p)%element%motion%x(:, :, :, c)))
          high(c) = max(high(c), maxval(parts(p)%element%motion%x(:, :, :, c)))
        end do
      end do
      shift = last%displacement - meeting%frames(1)%displacement
      across = maxloc(abs(shift), 1)
      size_along = max(min(high, tool%box(:, 2) + meeting%frames(1)%displacement) &
                       - max(low, tool%box(:, 1) + meeting%frames(1)%displacement), 0.0_wp)
      size_along(across) = 0.0_wp
      if (component > 0) size_along(component) = model%width_ratio*size_along(component)
      perimeter = 2*sum(size_along)
    end associate
  end function perimeter_of

end module effort_check
