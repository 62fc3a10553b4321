!> Likely causes of a failure, from what the data of the run show.
module failure_causes
  use kinds, only: wp
  use text, only: to_text, rounded_text
  use blank, only: blank_t, mass_of
  use block_law, only: block_law_t
  use effect, only: effect_slot_t, instant_t
  use contact, only: contact_t
  use contact_effect, only: contact_effect_t, contact_pairs
  use face_penetration, only: points_of_element
  use closest_point, only: hit_t
  use tool_search, only: search_tool
  use tool, only: tool_t, largest_speed
  use model, only: model_t
  use step_control, only: step_control_t
  use failure_location, only: position_now
  implicit none
  private

  public :: facts_t, facts_of, find_speeds, causes_of, tool_edge_near, added_part

  integer, parameter, public :: inverted = 1, not_finite = 2, increment_collapsed = 3, &
                                energy_lost = 4, too_deep = 5, increment_refused = 6
  character(*), parameter :: larger_than_intended = &
    "loads or prescribed velocities larger than intended: units, signs, amplitudes", &
    outside_of_law = "material constants outside the range of the law"

  !> What distinguishes causes.
  type :: facts_t
    real(wp) :: safety = 0.0_wp         !! scale factor on the stable time increment
    real(wp) :: speed = 0.0_wp          !! of the fastest control point
    real(wp) :: travel = 0.0_wp         !! its travel per increment over the smallest element
    real(wp) :: tool_speed = 0.0_wp     !! of the fastest tool
    real(wp) :: wave_speed = 0.0_wp     !! sqrt(E/density) of the blank, masses as given
    real(wp) :: young = 0.0_wp          !! its modulus [stress]
    real(wp) :: added_mass = 0.0_wp     !! part of the real one
    logical :: is_user_law = .false.
    logical :: has_contact = .false.
    character(:), allocatable :: edge   !! tool with an edge inside the sheet next to the failure
  end type facts_t

  !> Up to three lines.
  type :: list_t
    integer :: n = 0
    character(:), allocatable :: text
  end type list_t

contains

  !> What distinguishes causes. NaN or infinite speeds do not count.
  function facts_of(model, instant, control, place) result(facts)
    type(model_t), intent(in), target :: model
    type(instant_t), intent(in) :: instant
    type(step_control_t), intent(in) :: control
    real(wp), intent(in), optional :: place(3)    !! of the failure [length]
    type(facts_t) :: facts
    integer :: p

    associate (blank => model%bodies%blank)
      do p = 1, size(blank%parts)
        associate (v => blank%parts(p)%element%motion%v)
          facts%speed = max(facts%speed, maxval(abs(v), abs(v) <= huge(1.0_wp)))
        end associate
      end do
      facts%added_mass = added_part(blank)
      facts%is_user_law = blank%law%needs_context
      call find_speeds(blank%law, model%bodies%tools, facts)
    end associate
    facts%safety = control%safety
    ! Jacobians are those of elements from -1 to 1.
    facts%travel = facts%speed*instant%dt*0.5_wp*sqrt(control%rate_at_start)
    facts%has_contact = size(contact_pairs(model%forces)) > 0
    if (present(place)) facts%edge = tool_edge_near(model%forces, model%bodies%tools, place)
  end function facts_of

  !> Speeds of waves and tools.
  pure subroutine find_speeds(law, tools, facts)
    class(block_law_t), intent(in) :: law
    type(tool_t), intent(in) :: tools(:)
    type(facts_t), intent(inout) :: facts
    integer :: t

    facts%young = 9.0_wp*law%bulk*law%shear/max(3.0_wp*law%bulk + law%shear, tiny(1.0_wp))
    facts%wave_speed = sqrt(facts%young/max(law%density, tiny(1.0_wp)))
    do t = 1, size(tools)
      facts%tool_speed = max(facts%tool_speed, largest_speed(tools(t)))
    end do
  end subroutine find_speeds

  !> Added mass by the real one.
  pure real(wp) function added_part(blank)
    type(blank_t), intent(in) :: blank

    added_part = blank%added_mass*blank%mass_factor/max(mass_of(blank%parts), tiny(1.0_wp))
  end function added_part

  !> The tool whose edge lies inside the sheet no farther than an element from a place: contact
  !! points there are beyond it. Empty where there is none.
  function tool_edge_near(effects, tools, place) result(name)
    type(effect_slot_t), intent(in) :: effects(:)
    type(tool_t), intent(in) :: tools(:)
    real(wp), intent(in) :: place(3)              !! [length]
    character(:), allocatable :: name
    integer :: i

    name = ""
    if (.not. all(abs(place) <= huge(1.0_wp))) return
    do i = 1, size(effects)
      select type (pair => effects(i)%item)
      type is (contact_effect_t)
        if (has_edge_near(pair, tools(pair%tool), place)) name = tools(pair%tool)%name
      end select
    end do
  end function tool_edge_near

  !> Is a contact point near a place beyond the edge of the tool, and the edge no farther than an
  !! element? By the positions of the last increment.
  function has_edge_near(pair, tool, place) result(is_near)
    type(contact_effect_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: place(3)              !! [length]
    logical :: is_near
    real(wp), parameter :: round_off = 1.0e-3_wp  ! of an element: edges of sheet and tool that meet
    type(hit_t) :: hit
    real(wp) :: x(3), here(3), element, reach
    integer :: n

    is_near = .false.
    here = place
    if (tool%is_turning) here = matmul(here - tool%displacement, tool%rotation) + tool%displacement
    do n = 1, pair%pair%secondary%n_points
      element = sqrt(pair%pair%secondary%area(n) &
                     *product(points_of_element(pair%samples, pair%pair%secondary)))
      reach = element + pair%thickness
      x = position_now(pair%pair, n)
      if (.not. norm2(x - here) <= reach) cycle
      call search_tool(tool, x - pair%pair%motion%displacement, 0.0_wp, .false., hit)
      is_near = hit%face > 0 .and. abs(hit%gap) <= pair%thickness .and. &
                hit%overhang > max(round_off*element, pair%pair%options%overhang) .and. &
                hit%overhang <= element
      if (is_near) return
    end do
  end function has_edge_near

  !> Lines `  1. cause` under a heading, each with a line feed before it: first what the data of the
  !! run show.
  function causes_of(failure, facts) result(text)
    integer, intent(in) :: failure      !! `inverted` ... `increment_refused`
    type(facts_t), intent(in) :: facts
    character(:), allocatable :: text
    real(wp), parameter :: far = 0.1_wp, heavy = 10.0_wp
    real(wp), parameter :: absurd = 0.1_wp, fast = 0.01_wp   ! tool speed over that of waves
    type(list_t) :: list
    real(wp) :: mach

    mach = 0.0_wp
    if (facts%wave_speed > 0.0_wp) mach = facts%tool_speed/facts%wave_speed
    list%text = new_line("a")//"likely causes:"
    call add(list, facts%safety > 1.0_wp, "time increments above the stable one: SCALE "// &
             "FACTOR="//rounded_text(facts%safety)//" of *DYNAMIC, where at most 1 is stable")
    call add(list, mach > absurd, "units that do not fit together, or a tool far too fast: "// &
             "its speed is "//rounded_text(facts%tool_speed)//", that of waves in the "// &
             "blank, sqrt(E/density), "//rounded_text(facts%wave_speed))
    ! High speeds also follow from increments that are too large.
    call add(list, .not. (facts%travel < far .or. facts%safety > 1.0_wp .or. mach > absurd), &
             "a speed of "//rounded_text(facts%speed)//", which moves a point by "// &
             rounded_text(facts%travel)//" of the smallest element per increment: "// &
             "velocities, loads, or units that are not consistent")
    call add(list, facts%added_mass > heavy, "masses scaled up to "// &
             rounded_text(1.0_wp + facts%added_mass)//" times the real ones, too far for the "// &
             "speed of the process")
    if (allocated(facts%edge)) call add(list, facts%edge /= "", "an edge of tool "// &
      facts%edge//" inside the sheet, which it presses into: a larger tool, a rounded edge, "// &
      "or OVERHANG of *CONTACT PAIR")
    call add(list, mach > fast .and. .not. mach > absurd, "the speed of the tools: at "// &
             rounded_text(facts%tool_speed)//" a sheet that is hit gets stresses of about "// &
             rounded_text(facts%young*mach)//" (E times the speed over that of waves)")
    call add_typical(list, failure, facts)
    text = list%text
  end function causes_of

  !> Usual causes of a failure.
  subroutine add_typical(list, failure, facts)
    type(list_t), intent(inout) :: list
    integer, intent(in) :: failure
    type(facts_t), intent(in) :: facts

    select case (failure)
    case (inverted, increment_collapsed)
      call add(list, facts%is_user_law, "the user's subroutine: a stress that does not resist "// &
               "what squeezes the element")
      call add(list, facts%has_contact, "tools that squeeze or bend the sheet more than its "// &
               "elements can follow: gap, stroke, radii")
      call add(list, .true., "elements too large or too flat for the strain at this location: "// &
               "refine, or raise the degree")
      call add(list, .true., "a material that hardens too little, so that the strain localizes "// &
               "in one row of elements")
      call add(list, .true., larger_than_intended)
    case (not_finite)
      call add(list, facts%is_user_law, "the user's subroutine: a division by zero, a root or "// &
               "logarithm of what is negative, state variables that start at zero")
      call add(list, .true., "inconsistent units in the deck: density, stiffness, lengths and "// &
               "times")
      call add(list, .true., larger_than_intended)
      call add(list, .true., outside_of_law)
    case (increment_refused)
      call add(list, .true., "the user's subroutine: an iteration of its own that does not "// &
               "converge, or a PNEWDT that it sets below 1 for increments of any size")
      call add(list, .true., larger_than_intended)
      call add(list, .true., outside_of_law)
    case (energy_lost)
      call add(list, facts%is_user_law, "the user's subroutine: a stress that does not follow "// &
               "its strain increments, or a stiffness above the one of the deck")
      call add(list, facts%has_contact, "contact: a penalty near the limit of the time "// &
               "increment, or points too far apart for the edges of the tool")
      call add(list, .true., "an impact: tools or loads that begin at full speed, see "// &
               "*AMPLITUDE")
      call add(list, .true., "strain that localizes in few elements, which are about to invert")
      call add(list, .true., "a time increment close to the stable one: a smaller SCALE "// &
               "FACTOR of *DYNAMIC")
    case (too_deep)
      call add(list, .true., "tools that leave the sheet less room than its thickness")
      call add(list, .true., "a penalty that is too soft for the force: PENALTY SCALE or "// &
               "STIFFNESS of *CONTACT PAIR")
      call add(list, .true., "too few contact points for an edge or radius of the tool: COUNT "// &
               "of *CONTACT PAIR, or smaller elements")
    end select
  end subroutine add_typical

  subroutine add(list, is_likely, cause)
    type(list_t), intent(inout) :: list
    logical, intent(in) :: is_likely
    character(*), intent(in) :: cause
    integer, parameter :: most = 3

    if (.not. is_likely .or. list%n == most) return
    list%n = list%n + 1
    list%text = list%text//new_line("a")//"  "//to_text(list%n)//". "//cause
  end subroutine add

end module failure_causes
