!> How large the forces of inertia are that a moving tool causes, compared with the force that the
!! forming should need; and the speed of the tool at which they are small.
!!
!! A sheet that is set in motion at the speed v carries the stress density*c*v, c = sqrt(E/density):
!! the impact. A tool that accelerates by a needs m*a for the mass m of the blank. The force of
!! forming is that of a wall around the tool that carries the flow stress after 10 % strain.
module effort_check
  use kinds, only: wp
  use text, only: string_t, rounded_text, append_text
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t
  use support_extent, only: extent_t, extent_of, find_box, held_ends
  use flow_stress, only: flow_stress_of
  use unit_system, only: unit_system_t, new_unit_system, unit_of
  use blank, only: mass_of
  use model, only: model_t
  use tool, only: tool_t
  use closest_point, only: hit_t
  use tool_search, only: search_all_faces
  use sweep, only: position_at, break_times, in_space, in_tool
  use reach_check, only: encounter_t
  implicit none
  private

  public :: effort_t, effort_of, add_effort_lines, check_effort, overlap_of

  real(wp), parameter :: typical_strain = 0.1_wp
  real(wp), parameter :: small = 0.05_wp      !! part of the forming force that inertia may take
  real(wp), parameter :: steady = 1.0e-6_wp   !! relative, what counts as round-off
  real(wp), parameter :: edge = 1.0e-3_wp     !! part of an interval, from its ends
  integer, parameter :: n_parts = 8           !! of the time between two jumps

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
  function effort_of(scene, model, encounter, thickness) result(effort)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounter
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(effort_t) :: effort
    real(wp) :: flow, section, ratio, low(3), high(3)

    associate (material => scene%materials(scene%blank%material), blank => model%bodies%blank)
      flow = flow_stress_of(material, typical_strain)
      if (.not. flow > 0.0_wp .or. .not. encounter%approach%has_touched) return
      call find_box(scene, low, high)
      call find_speeds(model%bodies%tools(encounter%tool), encounter, norm2(high - low) &
                       *sqrt(material%density/material%young), effort)
      if (.not. effort%speed > 0.0_wp) return
      section = perimeter_of(scene, model, encounter)*thickness
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
  subroutine add_effort_lines(scene, model, encounters, thickness, lines)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    real(wp), intent(in) :: thickness
    type(string_t), allocatable, intent(inout) :: lines(:)
    type(effort_t) :: effort
    type(unit_system_t) :: units
    character(:), allocatable :: force, speed
    integer :: i

    force = ""
    speed = ""
    if (scene%units /= "") then
      units = new_unit_system(scene%units)
      force = " "//unit_of(units, "force")
      speed = " "//unit_of(units, "velocity")
    end if
    do i = 1, size(encounters)
      effort = effort_of(scene, model, encounters(i), thickness)
      if (.not. (effort%speed > 0.0_wp .and. effort%forming > 0.0_wp)) cycle
      call append_text(lines, "speed            tool "//scene%tools(encounters(i)%tool)%name// &
        " at up to "//rounded_text(effort%speed)//speed//", "// &
        rounded_text(effort%touch_speed)//" when it touches: impact "// &
        rounded_text(effort%impact)//force//", inertia "//rounded_text(effort%inertia)//force// &
        ", forming about "//rounded_text(effort%forming)//force)
      if (max(effort%impact, effort%inertia) > small*effort%forming) call append_text(lines, &
        "                 both are below 5 % of the forming force up to "// &
        rounded_text(effort%slow)//speed)
    end do
  end subroutine add_effort_lines

  !> Warn where inertia exceeds the force of forming.
  subroutine check_effort(scene, model, encounters, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    real(wp), intent(in) :: thickness
    type(error_list_t), intent(inout) :: errors
    type(effort_t) :: effort
    character(:), allocatable :: found
    integer :: i, k

    do i = 1, size(encounters)
      effort = effort_of(scene, model, encounters(i), thickness)
      found = ""
      if (effort%impact > effort%forming) found = "strikes the blank at "// &
        rounded_text(effort%touch_speed)//", an impact force of "//rounded_text(effort%impact)
      if (effort%inertia > effort%forming) found = "accelerates the blank by up to "// &
        rounded_text(effort%acceleration)//", a force of inertia of "//rounded_text(effort%inertia)
      if (found == "" .or. .not. effort%forming > 0.0_wp) cycle
      k = findloc(scene%motions%tool, encounters(i)%tool, dim=1)
      call add_warning(errors, scene%motions(k)%origin, "the tool '"// &
        scene%tools(encounters(i)%tool)%name//"', which "//found//", where the forming takes "// &
        "about "//rounded_text(effort%forming), "a speed of at most "// &
        rounded_text(effort%slow)//", or an *AMPLITUDE that starts and stops gently")
    end do
  end subroutine check_effort

  !> Speed and acceleration of the point of the tool that touches first, across the tool: the
  !! greatest speed, the greatest jump of it at the touch or later, and the greatest acceleration
  !! after the touch. A change faster than a wave crosses the blank is a jump.
  subroutine find_speeds(tool, encounter, transit, effort)
    type(tool_t), intent(in) :: tool
    type(encounter_t), intent(in) :: encounter
    real(wp), intent(in) :: transit           !! time of a wave through the blank
    type(effort_t), intent(inout) :: effort
    real(wp), allocatable :: breaks(:)
    real(wp) :: x(3), normal(3), last, next, length
    type(hit_t) :: hit
    integer :: i, k

    associate (path => encounter%path, touch => encounter%approach%first)
      x = in_tool(touch, encounter%approach%contact)
      call search_all_faces(tool, x, hit)
      normal = matmul(touch%rotation, hit%normal)
      breaks = break_times(path)
      do i = 1, size(breaks) - 1
        length = (breaks(i + 1) - breaks(i))/n_parts
        do k = 0, n_parts - 1
          next = speed_at(breaks(i) + (k + edge)*length, edge*length)
          effort%speed = max(effort%speed, abs(next), &
                             abs(speed_at(breaks(i) + (k + 1 - edge)*length, edge*length)))
          if (breaks(i) + k*length < touch%time - edge*length) cycle
          if (k == 0) effort%touch_speed = max(effort%touch_speed, abs(next - jump_from(i)))
          last = speed_at(breaks(i) + (k + 1 - edge)*length, edge*length)
          if (n_parts*length > transit) effort%acceleration = &
            max(effort%acceleration, abs(last - next)/((1 - 2*edge)*length))
        end do
        if (breaks(i) >= touch%time .and. breaks(i + 1) - breaks(i) <= transit) &
          effort%touch_speed = max(effort%touch_speed, abs(last &
                                   - speed_at(breaks(i) + edge*length, edge*length)))
        if (touch%time > breaks(i) .and. touch%time < breaks(i + 1)) effort%touch_speed = &
          max(effort%touch_speed, abs(speed_at(touch%time, edge*length)))
      end do
    end associate
    if (effort%touch_speed < steady*effort%speed) effort%touch_speed = 0.0_wp
    if (effort%acceleration*encounter%path%end_time < steady*effort%speed) &
      effort%acceleration = 0.0_wp
  contains

    !> Component along the tool's normal of the velocity at a time, from positions h before and
    !! after.
    real(wp) function speed_at(time, h) result(speed)
      real(wp), intent(in) :: time, h

      speed = dot_product(in_space(position_at(encounter%path, time + h), x) &
                          - in_space(position_at(encounter%path, time - h), x), normal)/(2*h)
    end function speed_at

    !> Speed just before a break at which the tool already touches; 0 where it only begins to.
    real(wp) function jump_from(i) result(speed)
      integer, intent(in) :: i

      speed = 0.0_wp
      if (i == 1) return
      if (encounter%approach%first%time > breaks(i) - edge*(breaks(i) - breaks(i - 1))) return
      speed = speed_at(breaks(i) - 2*edge*(breaks(i) - breaks(i - 1))/n_parts, &
                       edge*(breaks(i) - breaks(i - 1))/n_parts)
    end function jump_from

  end subroutine find_speeds

  !> Length of the walls that the tool pulls down: the sides of the box, across its travel, around
  !! what tool and blank have in common, but for planes of symmetry; of the full width of a strip.
  real(wp) function perimeter_of(scene, model, encounter) result(perimeter)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounter
    real(wp) :: low(3), high(3), size_along(3)
    integer :: c, across, n_sides(3)

    call find_box(scene, low, high)
    n_sides = [(2 - n_symmetric(scene, c), c=1, 3)]
    size_along = overlap_of(scene, model, encounter)
    c = scene%reduction%component
    if (c > 0) then
      size_along(c) = model%width_ratio*size_along(c)
      n_sides(c) = 0
    end if
    across = maxloc(abs(direction_of(encounter)), 1)
    perimeter = 0.0_wp
    do c = 1, 3
      if (c /= across) perimeter = perimeter + n_sides(c)*size_along(6 - c - across)
    end do
  end function perimeter_of

  !> Sizes of the box that tool and blank have in common, whatever their heights [length].
  function overlap_of(scene, model, encounter) result(sizes)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounter
    real(wp) :: sizes(3), low(3), high(3), start(3)

    call find_box(scene, low, high)
    associate (tool => model%bodies%tools(encounter%tool))
      start = encounter%path%starts(1)%displacement + encounter%path%shift
      sizes = max(min(high, tool%box(:, 2) + start) - max(low, tool%box(:, 1) + start), 0.0_wp)
    end associate
  end function overlap_of

  !> Largest displacement of the tool from its start [length].
  pure function direction_of(encounter) result(direction)
    type(encounter_t), intent(in) :: encounter
    real(wp) :: direction(3), shift(3)
    integer, parameter :: n_samples = 64
    integer :: k

    direction = 0.0_wp
    do k = 1, n_samples
      associate (frame => position_at(encounter%path, k*encounter%path%end_time/n_samples))
        shift = frame%displacement - encounter%path%starts(1)%displacement - encounter%path%shift
      end associate
      if (norm2(shift) > norm2(direction)) direction = shift
    end do
  end function direction_of

  !> How many of the two ends of the blank along a coordinate are planes of symmetry: both where
  !! nothing moves along it.
  pure integer function n_symmetric(scene, c) result(n)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: c
    type(extent_t) :: extent
    integer :: i

    n = count(held_ends(scene, c, c))
    do i = 1, size(scene%boundaries)
      if (.not. scene%boundaries(i)%is_prescribed(c)) cycle
      extent = extent_of(scene, scene%boundaries(i)%set)
      if (extent%is_all) n = 2
    end do
  end function n_symmetric

end module effort_check
