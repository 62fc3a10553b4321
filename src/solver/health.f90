!> Checks of a run: in each increment what the force evaluation reports anyway, at each history
!! sample the balances. The location and likely causes of a failure are determined only when there
!! is one.
module health
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: string_t, to_text, rounded_text, place_text, append_text
  use block_law, only: block_law_t
  use blank, only: blank_t
  use effect, only: effect_slot_t, instant_t
  use contact_sharing, only: join_contact
  use contact_effect, only: contact_effect_t, contact_view_t, contact_pairs, join_pairs
  use face_penetration, only: element_sizes, points_of_element
  use tool_bends, only: elements_on_radius
  use tool, only: tool_t
  use model, only: model_t
  use step_control, only: step_control_t
  use energy_balance, only: energy_balance_t
  use failure_location, only: location_t, location_of_failure, location_of_smallest, &
                              location_text, block_text, find_fastest, &
                              find_deepest_point, &
                              contact_point_text, most_sheared, most_damaged
  use failure_causes, only: facts_t, facts_of, find_speeds, causes_of, tool_edge_near, &
                            added_part, inverted, not_finite, increment_collapsed, energy_lost, &
                            too_deep, increment_refused
  use simple_shear, only: shear_limit
  use user_call, only: take_user_failure
  use ranks, only: ranks_t
  implicit none
  private

  public :: check_health, is_failing, find_failure, check_balance, is_lost, check_pairs
  public :: check_hidden_depths
  public :: added_mass_warning, shear_warning, damage_warning

  real(wp), parameter :: collapse = 1.0e-3_wp   ! of the step at the start
  real(wp), parameter :: alternation = 0.01_wp  ! of the largest energy so far

contains

  !> Is there something that `check_health` tells of?
  pure logical function is_failing(blank, control)
    type(blank_t), intent(in) :: blank
    type(step_control_t), intent(in) :: control

    is_failing = blank%report%failed_block < huge(1) .or. &
                 blank%report%largest_rate*collapse**2 > control%rate_at_start
  end function is_failing

  !> Inverted elements, laws that failed, NaN or infinite values, a collapsed step.
  subroutine check_health(model, instant, control, error)
    type(model_t), intent(in) :: model
    type(instant_t), intent(in) :: instant
    type(step_control_t), intent(in) :: control
    type(error_t), allocatable, intent(out) :: error

    type(location_t) :: location

    associate (blank => model%bodies%blank)
      if (.not. is_failing(blank, control)) return
      if (blank%report%failed_block < huge(1)) then
        call fail(error, failed_message(model, instant, control))
      else
        location = location_of_smallest(blank)
        call fail(error, "blank '"//blank%name//"': the stable time increment fell below a "// &
                  "thousandth of that at the start, "//when(instant)//", by "// &
                  location_text(blank, location)//causes_of(increment_collapsed, &
                  facts_of(model, instant, control, location%position)))
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
    character(:), allocatable :: what, fastest
    real(wp) :: place(3)

    if (.not. is_lost(model, balance, is_early, control)) return
    if (.not. abs(balance%alarm) <= huge(1.0_wp)) then
      what = "the energies are NaN or infinite "//when(instant)
    else if (abs(balance%alarm) > model%step%energy_limit) then
      what = "energy balance lost "//when(instant)//": error "//to_text(balance%alarm)// &
             ", limit "//to_text(model%step%energy_limit)
    else
      what = "the velocities change sign in each increment "//when(instant)// &
             ": kinetic energy, of velocities half a step before and after, "// &
             rounded_text(balance%kinetic)//", largest energy so far "// &
             rounded_text(balance%reference)
    end if
    if (model%step%is_static) then
      call fail(error, what//"; the increments of the static step are too large for the way of "// &
                "the sheet: smaller initial and greatest increments in *STATIC")
      return
    end if
    call find_fastest(model%bodies%blank, fastest, place)
    call fail(error, what//"; fastest is "//fastest// &
              causes_of(energy_lost, facts_of(model, instant, control, place)))
  end subroutine check_balance

  !> Is there something that `check_balance` reports?
  pure logical function is_lost(model, balance, is_early, control)
    type(model_t), intent(in) :: model
    type(energy_balance_t), intent(in) :: balance
    logical, intent(in) :: is_early       !! all but NaN or infinite values pass
    type(step_control_t), intent(in) :: control

    is_lost = .not. abs(balance%alarm) <= huge(1.0_wp)
    if (is_lost .or. is_early .or. .not. model%step%energy_limit > 0.0_wp) return
    is_lost = abs(balance%alarm) > model%step%energy_limit .or. &
              (control%safety > 1.0_wp .and. balance%kinetic < -alternation*balance%reference)
  end function is_lost

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
  function shear_warning(blank, instant, ranks) result(warning)
    type(blank_t), intent(in) :: blank
    type(instant_t), intent(in) :: instant
    class(ranks_t), intent(in), optional :: ranks     !! processes that hold the points
    character(:), allocatable :: warning
    type(location_t) :: location
    real(wp) :: shear

    warning = ""
    if (blank%law%shear_warning() == "") return
    call most_sheared(blank, location, shear, ranks)
    if (shear > shear_limit) warning = "warning: the blank has sheared by "// &
      rounded_text(shear)//", "//when(instant)//", in "//location_text(blank, location)//": "// &
      blank%law%shear_warning()
  end function shear_warning

  !> Warning where the damage indicator of the law has reached 1; empty otherwise.
  function damage_warning(blank, instant, ranks) result(warning)
    type(blank_t), intent(in) :: blank
    type(instant_t), intent(in) :: instant
    class(ranks_t), intent(in), optional :: ranks     !! as above
    character(:), allocatable :: warning
    type(location_t) :: location
    real(wp) :: damage

    warning = ""
    if (.not. blank%law%has_damage) return
    call most_damaged(blank, location, damage, ranks)
    if (damage >= 1.0_wp) warning = "warning: fracture is expected: the damage indicator is "// &
      rounded_text(damage)//", "//when(instant)//", in "//location_text(blank, location)
  end function damage_warning

  !> Penetrations of all contact pairs against the limits, as fractions of the thickness, and
  !! searches that failed. A pair warns once of each.
  subroutine check_pairs(effects, tools, law, warning_limit, limit, instant, warnings, error)
    type(effect_slot_t), intent(inout), target :: effects(:)
    type(tool_t), intent(in) :: tools(:)
    class(block_law_t), intent(in) :: law                  !! of the blank
    real(wp), intent(in) :: warning_limit, limit           !! 0: none
    type(instant_t), intent(in) :: instant
    type(string_t), allocatable, intent(out) :: warnings(:)
    type(error_t), allocatable, intent(out) :: error
    type(facts_t) :: facts
    type(contact_view_t), allocatable :: pairs(:)
    character(:), allocatable :: deepest
    real(wp) :: place(3)
    integer :: i

    allocate (warnings(0))
    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        if (pair%pair%statistics%first_failed > 0 .and. .not. pair%has_told_failure) then
          pair%has_told_failure = .true.
          call join_contact(pair%pair, is_everywhere=.true., are_places=.false.)
          call append_text(warnings, "warning: "//pair%name// &
                           ": no closest point was found, "//when(instant)//", for "// &
                           contact_point_text(pair%pair, tools(pair%tool), &
                                         pair%pair%statistics%first_failed)//", which has "// &
                           "no contact there; the number of failed searches is at the end")
        end if
        if (limit > 0.0_wp .and. pair%depth > limit*pair%thickness) then
          call join_pairs(effects, is_everywhere=.true., are_places=.false.)
          call find_deepest_point(pair%pair, tools(pair%tool), deepest, place)
          call find_speeds(law, tools, facts)
          facts%edge = tool_edge_near(effects, tools, place)
          call fail(error, depth_message(pair, instant)//", limit "//to_text(limit)//", "// &
                    deepest//causes_of(too_deep, facts))
          return
        else if (warning_limit > 0.0_wp .and. pair%depth > warning_limit*pair%thickness &
                 .and. .not. pair%has_warned) then
          pair%has_warned = .true.
          call join_contact(pair%pair, is_everywhere=.true., are_places=.false.)
          call find_deepest_point(pair%pair, tools(pair%tool), deepest)
          call append_text(warnings, "warning: "//depth_message(pair, instant)//", "//deepest)
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
    character(:), allocatable :: message
    type(location_t) :: location
    type(facts_t) :: facts
    integer :: failure

    call find_failure(model%bodies%blank, instant, message, failure, location, model%ranks)
    if (location%part > 0 .and. .not. location%is_at_start) then
      facts = facts_of(model, instant, control, location%position)
    else
      facts = facts_of(model, instant, control)
    end if
    message = message//causes_of(failure, facts)
  end function failed_message

  !> What of the blank failed in the last evaluation of its forces, where and when. What a user's
  !! subroutine has noted is forgotten; of several processes all say what the first of those says
  !! whose subroutines have noted something.
  subroutine find_failure(blank, instant, message, failure, location, ranks)
    type(blank_t), intent(in) :: blank
    type(instant_t), intent(in) :: instant
    character(:), allocatable, intent(out) :: message
    integer, intent(out) :: failure                     !! see `causes_of`
    type(location_t), intent(out) :: location
    class(ranks_t), intent(in), optional :: ranks
    character(:), allocatable :: user_failure
    logical :: is_refusal
    integer :: from

    call take_user_failure(user_failure, is_refusal)
    if (present(ranks)) then
      from = ranks%n - ranks%largest(merge(ranks%n - ranks%number, 1, user_failure /= ""))
      call ranks%share_text(user_failure, from)
      is_refusal = ranks%largest(merge(1, 0, is_refusal .and. ranks%number == from)) > 0
    end if
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
  end subroutine find_failure

  function when(instant) result(text)
    type(instant_t), intent(in) :: instant
    character(:), allocatable :: text

    text = "at time "//rounded_text(instant%time)
  end function when

end module health
