!> The three likeliest causes of a failure, in order, from what is known of the run.
module likely_causes
  use kinds, only: wp
  use text, only: to_text, rounded_text
  implicit none
  private

  public :: facts_t, causes_of

  integer, parameter, public :: turned_over = 1, no_numbers = 2, step_collapsed = 3, &
                                energy_lost = 4, too_deep = 5, increment_refused = 6
  character(*), parameter :: larger_than_meant = &
    "loads or prescribed velocities larger than meant: units, signs, amplitudes", &
    outside_of_law = "constants of the material outside of what its law is made for"

  !> What tells the causes apart.
  type :: facts_t
    real(wp) :: safety = 0.0_wp         !! part of the stable step that is used
    real(wp) :: speed = 0.0_wp          !! of the fastest control point
    real(wp) :: travel = 0.0_wp         !! its way in a step, part of the smallest element
    real(wp) :: added_mass = 0.0_wp     !! part of the real one
    logical :: is_user_law = .false.
    logical :: has_contact = .false.
  end type facts_t

  !> Up to three lines.
  type :: list_t
    integer :: n = 0
    character(:), allocatable :: text
  end type list_t

contains

  !> Lines `  1. cause` under a heading, each with a line feed before it.
  function causes_of(failure, facts) result(text)
    integer, intent(in) :: failure      !! `turned_over` ... `increment_refused`
    type(facts_t), intent(in) :: facts
    character(:), allocatable :: text
    type(list_t) :: list

    list%text = new_line("a")//"likely causes:"
    if (failure /= too_deep) call add_evident(list, facts)
    select case (failure)
    case (turned_over, step_collapsed)
      call add_shape(list, facts)
    case (no_numbers)
      call add_numbers(list, facts)
    case (increment_refused)
      call add(list, .true., "the user's subroutine: an iteration of its own that does not "// &
               "converge, or a PNEWDT that it sets below 1 for increments of any size")
      call add(list, .true., larger_than_meant)
      call add(list, .true., outside_of_law)
    case (energy_lost)
      call add_energy(list, facts)
    case (too_deep)
      call add(list, .true., "tools that leave the sheet less room than its thickness")
      call add(list, .true., "a penalty that is too soft for the force: PENALTY SCALE or "// &
               "STIFFNESS of *CONTACT PAIR")
      call add(list, .true., "too few contact points for an edge or radius of the tool: COUNT "// &
               "of *CONTACT PAIR, or smaller elements")
    end select
    text = list%text
  end function causes_of

  !> What the numbers of the run show.
  subroutine add_evident(list, facts)
    type(list_t), intent(inout) :: list
    type(facts_t), intent(in) :: facts
    real(wp), parameter :: far = 0.1_wp, heavy = 10.0_wp

    call add(list, facts%safety > 1.0_wp, "time increments above the stable one: SCALE FACTOR="// &
             rounded_text(facts%safety)//" of *DYNAMIC, where at most 1 is stable")
    ! Of steps too large a great speed is what follows.
    call add(list, .not. (facts%travel < far .or. facts%safety > 1.0_wp), "a speed of "// &
             rounded_text(facts%speed)//", which carries a point over "// &
             rounded_text(facts%travel)//" of the smallest element in one step: velocities, "// &
             "loads, or units that do not fit together")
    call add(list, facts%added_mass > heavy, "masses scaled up to "// &
             rounded_text(1.0_wp + facts%added_mass)//" times the real ones, too far for the "// &
             "speed of the process")
  end subroutine add_evident

  subroutine add_shape(list, facts)
    type(list_t), intent(inout) :: list
    type(facts_t), intent(in) :: facts

    call add(list, facts%is_user_law, "the user's subroutine: a stress that does not resist "// &
             "what squeezes the element")
    call add(list, facts%has_contact, "tools that squeeze or bend the sheet more than its "// &
             "elements can follow: gap, stroke, radii")
    call add(list, .true., "elements too large or too flat for the strain at this place: "// &
             "refine, or raise the degree")
    call add(list, .true., "a material that hardens too little, so that the strain gathers in "// &
             "one row of elements")
    call add(list, .true., larger_than_meant)
  end subroutine add_shape

  subroutine add_numbers(list, facts)
    type(list_t), intent(inout) :: list
    type(facts_t), intent(in) :: facts

    call add(list, facts%is_user_law, "the user's subroutine: a division by zero, a root or "// &
             "logarithm of what is negative, state variables that start at zero")
    call add(list, .true., "numbers of the deck that do not fit together: density, stiffness, "// &
             "lengths and times in one system of units")
    call add(list, .true., larger_than_meant)
    call add(list, .true., outside_of_law)
  end subroutine add_numbers

  subroutine add_energy(list, facts)
    type(list_t), intent(inout) :: list
    type(facts_t), intent(in) :: facts

    call add(list, facts%is_user_law, "the user's subroutine: a stress that does not follow "// &
             "its strain increments, or a stiffness above the one of the deck")
    call add(list, facts%has_contact, "contact: a penalty near all that the time step bears, "// &
             "or points too far apart for the edges of the tool")
    call add(list, .true., "an impact: tools or loads that begin at full speed, see "// &
             "*AMPLITUDE")
    call add(list, .true., "strain that gathers in few elements, which are about to turn over")
    call add(list, .true., "a time increment close to the stable one: a smaller SCALE "// &
             "FACTOR of *DYNAMIC")
  end subroutine add_energy

  subroutine add(list, is_likely, cause)
    type(list_t), intent(inout) :: list
    logical, intent(in) :: is_likely
    character(*), intent(in) :: cause
    integer, parameter :: most = 3

    if (.not. is_likely .or. list%n == most) return
    list%n = list%n + 1
    list%text = list%text//new_line("a")//"  "//to_text(list%n)//". "//cause
  end subroutine add

end module likely_causes
