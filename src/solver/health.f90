!> Checks of a run: in each increment what the force evaluation reports anyway, at each history
!! sample the balances. The location and likely causes of a failure are determined only when there
!! is one.
module health
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: string_t, to_text, rounded_text, place_text, append_text
  use blank, only: blank_t, mass_of
  use effect, only: effect_slot_t, instant_t
  use contact_effect, only: contact_effect_t, contact_view_t, contact_pairs
  use face_penetration, only: element_sizes, points_of_element
  use tool_bends, only: elements_on_radius
  use tool, only: tool_t
  use model, only: model_t
  use step_control, only: step_control_t
  use energy_balance, only: energy_balance_t
  use failure_location, only: location_t, location_of_failure, location_of_smallest, &
                              location_text, block_text, fastest_point, deepest_point, &
                              contact_point_text, most_sheared
  use simple_shear, only: shear_limit
  use user_call, only: take_user_failure
  implicit none
  private

  public :: check_health, check_balance, check_pairs, check_hidden_depths, added_mass_warning
  public :: shear_warning

  integer, parameter :: inverted = 1, not_finite = 2, increment_collapsed = 3, &
                                energy_lost = 4, too_deep = 5, increment_refused = 6
  character(*), parameter :: larger_than_intended = &
    "loads or prescribed velocities larger than intended: units, signs, amplitudes", &
    outside_of_law = "material constants outside the range of the law"

  !> What distinguishes causes.
  type :: facts_t
    real(wp) :: safety = 0.0_wp         !! scale factor on the stable time increment
    real(wp) :: speed = 0.0_wp          !! of the fastest control point
    real(wp) :: travel = 0.0_wp         !! its travel per increment over the smallest element
    real(wp) :: added_mass = 0.0_wp     !! part of the real one
    logical :: is_user_law = .false.
    logical :: has_contact = .false.
  end type facts_t

  !> Up to three lines.
  type :: list_t
    integer :: n = 0
    character(:), allocatable :: text
  end type list_t

  real(wp), parameter :: collapse = 1.0e-3_wp   ! of the step at the start
  real(wp), parameter :: alternation = 0.01_wp  ! of the largest energy so far

contains

  !> Inverted elements, laws that failed, NaN or infinite values, a collapsed step.
  subroutine check_health(model, instant, control, error)
    type(model_t), intent(in) :: model
    type(instant_t), intent(in) :: instant
    type(step_control_t), intent(in) :: control
    type(error_t), allocatable, intent(out) :: error

    associate (blank => model%bodies%blank)
      if (blank%report%failed_block < huge(1)) then
        call fail(error, failed_message(model, instant, control))
      else if (blank%report%largest_rate*collapse**2 > control%rate_at_start) then
        call fail(error, "blank '"//blank%name//"': the stable time increment fell below a "// &
                  "thousandth of that at the start, "//when(instant)//", by "// &
                  location_text(blank, location_of_smallest(blank))// &
                  causes_of(increment_collapsed, facts_of(model, instant, control)))
      end if
    end associate
  end subroutine check_health

  !> The balance of energy against the deck's limit; and, where steps are above the stable one, the
  !! sign of the kinetic energy: that is the product of the velocities half a step before and after,
  !! and below zero where most of the velocities change sign in each increment.
  !! Plastic flow feeds on such a motion and keeps the balance all the same.
  subroutine check_balance(model, balance, is_early, instant, control, error)
    type(model_t), intent(in) :: model
    type(energy_balance_t), intent(in) :: balance
    logical, intent(in) :: is_early       !! all but NaN or infinite values pass
    type(instant_t), intent(in) :: instant
    type(step_control_t), intent(in) :: control
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: what

    if (.not. abs(balance%alarm) <= huge(1.0_wp)) then
      what = "the energies are NaN or infinite "//when(instant)
    else if (is_early .or. .not. model%step%energy_limit > 0.0_wp) then
      return
    else if (abs(balance%alarm) > model%step%energy_limit) then
      what = "energy balance lost "//when(instant)//": error "//to_text(balance%alarm)// &
             ", limit "//to_text(model%step%energy_limit)
    else if (control%safety > 1.0_wp .and. balance%kinetic < -alternation*balance%reference) then
      what = "the velocities change sign in each increment "//when(instant)// &
             ": kinetic energy, of velocities half a step before and after, "// &
             rounded_text(balance%kinetic)//", largest energy so far "// &
             rounded_text(balance%reference)
    else
      return
    end if
    call fail(error, what//"; fastest is "//fastest_point(model%bodies%blank)// &
              causes_of(energy_lost, facts_of(model, instant, control)))
  end subroutine check_balance

  !> Warning where masses are scaled and the kinetic energy exceeds a twentieth of the internal
  !! energy, a customary limit for quasi-static forming; empty otherwise.
  function added_mass_warning(blank, balance, instant) result(warning)
    type(blank_t), intent(in) :: blank
    type(energy_balance_t), intent(in) :: balance
    type(instant_t), intent(in) :: instant
    character(:), allocatable :: warning
    real(wp), parameter :: small = 0.05_wp

    warning = ""
    if (.not. blank%added_mass > 0.0_wp) return
    if (balance%kinetic <= small*max(balance%internal, balance%kinetic_at_start)) return
    warning = "warning: with masses scaled to "//rounded_text(1.0_wp + added_part(blank))// &
              " times the real ones the kinetic energy "//rounded_text(balance%kinetic)// &
              " is more than "//rounded_text(100*small)//" % of the internal energy "// &
              rounded_text(balance%internal)//", "//when(instant)// &
              ": less scaling, or a slower process"
  end function added_mass_warning

  !> Warning where the tensors of a law oscillate in large shear, and a point has sheared so much;
  !! empty otherwise.
  function shear_warning(blank, instant) result(warning)
    type(blank_t), intent(in) :: blank
    type(instant_t), intent(in) :: instant
    character(:), allocatable :: warning
    type(location_t) :: location
    real(wp) :: shear

    warning = ""
    if (blank%law%shear_warning() == "") return
    call most_sheared(blank, location, shear)
    if (shear > shear_limit) warning = "warning: the blank has sheared by "// &
      rounded_text(shear)//", "//when(instant)//", in "//location_text(blank, location)//": "// &
      blank%law%shear_warning()
  end function shear_warning

  !> Added mass by the real one.
  pure real(wp) function added_part(blank)
    type(blank_t), intent(in) :: blank

    added_part = blank%added_mass*blank%mass_factor/max(mass_of(blank%parts), tiny(1.0_wp))
  end function added_part

  !> Penetrations of all contact pairs against the limits, as fractions of the thickness, and
  !! searches that failed. A pair warns once of each.
  subroutine check_pairs(effects, tools, warning_limit, limit, instant, warnings, error)
    type(effect_slot_t), intent(inout), target :: effects(:)
    type(tool_t), intent(in) :: tools(:)
    real(wp), intent(in) :: warning_limit, limit           !! 0: none
    type(instant_t), intent(in) :: instant
    type(string_t), allocatable, intent(out) :: warnings(:)
    type(error_t), allocatable, intent(out) :: error
    type(facts_t) :: none
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    allocate (warnings(0))
    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        if (pair%pair%statistics%first_failed > 0 .and. .not. pair%has_told_failure) then
          pair%has_told_failure = .true.
          call append_text(warnings, "warning: "//pair%name// &
                           ": no closest point was found, "//when(instant)//", for "// &
                           contact_point_text(pair%pair, tools(pair%tool), &
                                         pair%pair%statistics%first_failed)//", which has "// &
                           "no contact there; the number of failed searches is at the end")
        end if
        if (limit > 0.0_wp .and. pair%depth > limit*pair%thickness) then
          call fail(error, depth_message(pair, instant)//", limit "//to_text(limit)//", "// &
                    deepest_point(pair%pair, tools(pair%tool))//causes_of(too_deep, none))
          return
        else if (warning_limit > 0.0_wp .and. pair%depth > warning_limit*pair%thickness &
                 .and. .not. pair%has_warned) then
          pair%has_warned = .true.
          call append_text(warnings, "warning: "//depth_message(pair, instant)//", "// &
                           deepest_point(pair%pair, tools(pair%tool)))
        end if
      end associate
    end do
  end subroutine check_pairs

  !> Penetrations between contact points that are far larger than at all of these, by more than a
  !! fraction of the thickness. A pair warns once.
  subroutine check_hidden_depths(effects, instant, warnings)
    type(effect_slot_t), intent(inout), target :: effects(:)   !! whose depths were measured now
    type(instant_t), intent(in) :: instant
    type(string_t), allocatable, intent(out) :: warnings(:)
    real(wp), parameter :: small = 0.02_wp, far = 2.0_wp
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    allocate (warnings(0))
    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair, depth => pairs(i)%pair%deepest%depth)
        if (pair%has_warned_between .or. .not. depth > far*pair%depth) cycle
        if (.not. depth > small*pair%thickness) cycle
        pair%has_warned_between = .true.
        call append_text(warnings, "warning: "//pair%name//": between its contact points the "// &
                         "blank is "//rounded_text(depth)//" deep in the tool ("// &
                         rounded_text(depth/pair%thickness)//" of its thickness), at them "// &
                         rounded_text(pair%depth)//", "//when(instant)//", at "// &
                         place_text(pair%deepest%x)//"; "//cure_of(pair))
      end associate
    end do
  end subroutine check_hidden_depths

  !> What lets the contact points of a pair see its tool: as near to each other as its radius asks,
  !! twice as near as they are at least.
  function cure_of(pair) result(cure)
    type(contact_effect_t), intent(in) :: pair
    character(:), allocatable :: cure
    integer, parameter :: most_points = 10   ! that COUNT takes
    real(wp) :: sizes(2), radius
    integer :: n_now(2), n(2)

    sizes = element_sizes(pair%samples, pair%deepest%at)
    radius = pair%samples%radius
    n_now = points_of_element(pair%samples, pair%pair%secondary)
    n = max(2*n_now, ceiling(sizes*elements_on_radius/max(radius, pair%thickness)))
    cure = "the elements there are "//rounded_text(sizes(1))//" x "//rounded_text(sizes(2))// &
           " with "//to_text(n_now(1))//" x "//to_text(n_now(2))//" contact points"
    if (.not. radius > 0.0_wp) then
      cure = cure//", the tool has a sharp edge"
    else if (radius < elements_on_radius*maxval(sizes)) then
      cure = cure//", the smallest radius of the tool is "//rounded_text(radius)
    end if
    cure = cure//": use elements of "//rounded_text(sizes(1)*n_now(1)/n(1))//" x "// &
           rounded_text(sizes(2)*n_now(2)/n(2))
    if (all(n <= most_points)) cure = cure//", or COUNT="""//to_text(n(1))//","//to_text(n(2))//""""
  end function cure_of

  function depth_message(pair, instant) result(message)
    type(contact_effect_t), intent(in) :: pair
    type(instant_t), intent(in) :: instant
    character(:), allocatable :: message

    message = pair%name//": the blank is "//rounded_text(pair%depth/pair%thickness)// &
              " of its thickness deep in the tool, "//when(instant)
  end function depth_message

  !> What failed, where and when, and why.
  function failed_message(model, instant, control) result(message)
    type(model_t), intent(in) :: model
    type(instant_t), intent(in) :: instant
    type(step_control_t), intent(in) :: control
    character(:), allocatable :: message, user_failure
    type(location_t) :: location
    integer :: failure
    logical :: is_refusal

    call take_user_failure(user_failure, is_refusal)
    associate (blank => model%bodies%blank)
      failure = merge(inverted, not_finite, blank%report%smallest_det <= 0.0_wp)
      message = "blank '"//blank%name//"': "
      if (failure == inverted) then
        message = message//"an inverted element (negative Jacobian)"
      else if (user_failure /= "") then
        message = user_failure//"; "//message//"the stress update failed"
        if (is_refusal) failure = increment_refused
      else
        message = message//"the stress update failed or met NaN or infinite values"
      end if
      location = location_of_failure(blank)
      message = message//", "//when(instant)//", in "
      if (location%part > 0) then
        message = message//location_text(blank, location)
      else
        message = message//block_text(blank)
      end if
      message = message//causes_of(failure, facts_of(model, instant, control))
    end associate
  end function failed_message

  !> What distinguishes causes. NaN or infinite speeds do not count.
  function facts_of(model, instant, control) result(facts)
    type(model_t), intent(in) :: model
    type(instant_t), intent(in) :: instant
    type(step_control_t), intent(in) :: control
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
    end associate
    facts%safety = control%safety
    ! Jacobians are those of elements from -1 to 1.
    facts%travel = facts%speed*instant%dt*0.5_wp*sqrt(control%rate_at_start)
    facts%has_contact = size(contact_pairs(model%forces)) > 0
  end function facts_of

  function when(instant) result(text)
    type(instant_t), intent(in) :: instant
    character(:), allocatable :: text

    text = "at time "//to_text(instant%time)
  end function when

  !> Lines `  1. cause` under a heading, each with a line feed before it: first what the data of the
  !! run show.
  function causes_of(failure, facts) result(text)
    integer, intent(in) :: failure      !! `inverted` ... `increment_refused`
    type(facts_t), intent(in) :: facts
    character(:), allocatable :: text
    real(wp), parameter :: far = 0.1_wp, heavy = 10.0_wp
    type(list_t) :: list

    list%text = new_line("a")//"likely causes:"
    if (failure /= too_deep) then
      call add(list, facts%safety > 1.0_wp, "time increments above the stable one: SCALE "// &
               "FACTOR="//rounded_text(facts%safety)//" of *DYNAMIC, where at most 1 is stable")
      ! High speeds also follow from increments that are too large.
      call add(list, .not. (facts%travel < far .or. facts%safety > 1.0_wp), "a speed of "// &
               rounded_text(facts%speed)//", which moves a point by "// &
               rounded_text(facts%travel)//" of the smallest element per increment: "// &
               "velocities, loads, or units that are not consistent")
      call add(list, facts%added_mass > heavy, "masses scaled up to "// &
               rounded_text(1.0_wp + facts%added_mass)//" times the real ones, too far for the "// &
               "speed of the process")
    end if
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

end module health
