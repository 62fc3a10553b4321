!> Static increments: equilibrium by Newton's method, on the elements, contact and loads of the
!! explicit steps (`static_equations`).
!!
!! What does not balance when the step begins is ramped down over it: contact that is gone, inertia,
!! and loads that are new, which so come up by a ramp. Where nothing acts on a part but this,
!! springs hold it, too, which vanish at the end: without them most of its motion would come in the
!! last part of the ramp, and a wrinkled sheet turn over before.
module static_step
  use, intrinsic :: iso_c_binding, only: c_funptr
  use kinds, only: wp
  use text, only: to_text, rounded_text, counted
  use failure, only: error_t, fail
  use body_parts, only: field_t, forces_of_parts
  use boundary, only: any_moving, prescribed_components, take_reactions, way_of_supports
  use effect, only: any_from_outside
  use rigid_motion, only: move_tool, longest_way
  use contact_effect, only: any_load, has_pair
  use vibration, only: fixed_t
  use contact_stiffness, only: shortest_reach
  use ranks, only: is_first, share_error
  use model, only: model_t, apply_forces
  use run_state, only: run_t
  use run_log, only: run_log_t, log_line
  use mumps_library, only: find_mumps
  use driven_tools, only: begin_drives, rest_drives
  use anderson_mixing, only: mixing_t, forget, mix_step
  use static_equations, only: static_equations_t, new_equations, restore_start, try_motion, &
                              renew_factors, start_increment, step_to_balance, is_hovering, &
                              has_met_tools, reaction_of_held, unheld_load, unheld_lack, &
                              worst_place
  use rigid_supports, only: held_words, motions_along
  use failure_location, only: location_t
  use health, only: find_failure
  implicit none
  private

  public :: check_static, begin_static, take_static_increment
  public :: shorten_way

  real(wp), parameter, public :: increment_growth = 1.5_wp   !! after one that was easy

  integer, parameter :: most_iterations = 16, enough_factors = 4, most_cuts = 12
  integer, parameter :: more_with_care = 16        !! iterations, as the steps are shorter
  integer, parameter :: enough_cuts = 3            !! before steps are to lead downhill
  real(wp), parameter :: cut_to = 0.25_wp          !! of an increment that failed
  ! Springs hold a part whose released forces would turn it over; stiffer ones where these hold
  ! accelerations as well, which would bend its flanges, and where the first do not do. The stiffer,
  ! the more yields as they go.
  real(wp), parameter :: much_inertia = 0.01_wp    !! of the forces released
  real(wp), parameter :: stiffer = 10.0_wp, stiffest = 1.0e4_wp
  real(wp), parameter :: crawling = 5.0e-3_wp      !! increment over the step at which springs are
                                                   !! not stiff enough
  integer, parameter :: n_told = 3                 !! of the residuals, in the log
  integer, parameter :: most_free = 500            !! iterations of a part and a tool on their way
                                                   !! to each other
  real(wp), parameter :: tolerance = 1.0e-7_wp     !! of the residual, over the largest force
  real(wp), parameter :: in_contact = 10.0_wp      !! times that, with contact
  real(wp), parameter :: unheld_part = 1.0e-4_wp   !! reaction to a rigid motion that is too large
  real(wp), parameter :: unloaded = 1.0e-6_wp      !! of all loads: a resultant that is none
  real(wp), parameter :: short = 1.0e-6_wp         !! of the increment: no time for laws to relax
  real(wp), parameter :: too_much = 2.0_wp         !! of the residuals before and after the first
                                                   !! iteration: later ones diverge
  real(wp), parameter :: slow = 0.3_wp             !! part of the residual that a good iteration
                                                   !! leaves at most
  integer, parameter :: enough_slow = 3            !! that leave more: their tangent is not right
  real(wp), parameter :: stretching = 3.0_wp       !! growth of the residual in the first iteration
                                                   !! by which a part is stretched that turns
  real(wp), parameter :: too_little = 0.5_wp       !! of such a residual: the second iteration has
                                                   !! to do more
  ! Factors are kept while the residual falls to this part in an iteration and is that near the
  ! limit, and factors that were kept as long as so many iterations more would do.
  real(wp), parameter :: enough = 0.05_wp, near = 1.0e4_wp, few = 3.0_wp

  !> How contact settles in the iterations of an increment.
  type :: settling_t
    integer :: n = 0                               !! iterations in which it does
    integer :: n_idle = 0                          !! since there were fewer or more touching points
    integer :: fewest = huge(1), largest = 0       !! than these
  end type settling_t

contains

  !> Is there all that the static steps of a run take? Known before the run begins.
  subroutine check_static(model, error)
    type(model_t), intent(in) :: model
    type(error_t), allocatable, intent(out) :: error
    type(c_funptr) :: entry

    if (.not. (model%step%is_static .or. any(model%later_steps%step%is_static))) return
    if (is_first(model%ranks)) call find_mumps(entry, error)
    if (allocated(model%ranks)) call share_error(model%ranks, error)
    if (allocated(error)) error%message = "static steps: "//error%message
  end subroutine check_static

  !> Stop the motion, and note the forces that do not balance.
  subroutine begin_static(model, run)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp) :: dt, inertia
    integer :: p

    run%balance%stopped = run%balance%stopped + run%balance%kinetic
    run%balance%impulse = -run%balance%momentum_at_start
    run%static_dt = min(model%step%static_increment, model%step%most_increment)
    dt = merge(run%instant%dt, short*run%static_dt, run%instant%dt > 0.0_wp)
    run%instant%dt = 0.0_wp
    run%instant%is_static = .true.
    inertia = inertia_of(model, run, dt)
    do p = 1, size(model%bodies%blank%parts)
      associate (motion => model%bodies%blank%parts(p)%element%motion)
        motion%v = 0.0_wp
        motion%external_force = 0.0_wp
        run%v_before(p)%values = 0.0_wp
      end associate
      call model%bodies%blank%parts(p)%element%forget_faces(any_from_outside(model%forces))
    end do
    do p = 1, size(model%bodies%tools)
      call move_tool(model%motions(p), run%instant%time, 0.0_wp, model%bodies%tools(p))
      model%bodies%tools(p)%force = 0.0_wp
      model%bodies%tools(p)%torque = 0.0_wp
    end do
    run%pace = run%v_before
    call keep_positions(model, run%origin)
    call apply_forces(model, run%instant)
    associate (blank => model%bodies%blank)
      call forces_of_parts(blank%parts, blank%seams, blank%law, dt, blank%report, .true., &
                           blank%joints)
    end associate
    call take_reactions(model%supports, model%bodies%blank%parts)
    call begin_drives(model%supports, model%bodies%tools, run%instant%time)
    call note_released(model, run)
    run%spring_scale = 1.0_wp
    if (inertia > much_inertia*released_forces(run)) run%spring_scale = stiffer
    if (.not. is_release(model, run)) run%spring_scale = 0.0_wp
  end subroutine begin_static

  !> Do the forces released, as those of tools that are gone, outweigh the loads? Of loads that
  !! begin with the step they are the opposite. Then springs hold the part on its way.
  logical function is_release(model, run)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    real(wp), parameter :: outweighs = 2.0_wp
    type(fixed_t), allocatable :: fixed(:)
    real(wp) :: released, loads
    integer :: p

    is_release = .not. any_moving(model%supports)
    if (.not. is_release) return
    if (.not. any_load(model%forces)) return
    released = 0.0_wp
    loads = 0.0_wp
    associate (parts => model%bodies%blank%parts)
      fixed = prescribed_components(parts, model%supports, model%i_step)
      do p = 1, size(parts)
        released = released + sum(abs(run%released(p)%values), mask=.not. fixed(p)%is_fixed)
        loads = loads + sum(abs(parts(p)%element%motion%external_force), &
                            mask=.not. fixed(p)%is_fixed)
      end do
    end associate
    is_release = released > outweighs*loads
  end function is_release

  !> Sum of the forces that accelerate the control points, by the last two velocities.
  real(wp) function inertia_of(model, run, dt) result(force)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    real(wp), intent(in) :: dt                     !! last increment [time]
    integer :: p, c

    force = 0.0_wp
    do p = 1, size(model%bodies%blank%parts)
      associate (element => model%bodies%blank%parts(p)%element, before => run%v_before(p)%values)
        do c = 1, 3
          force = force + sum(abs(element%mass*(element%motion%v(:, :, :, c) &
                                                - before(:, :, :, c))))/dt
        end do
      end associate
    end do
  end function inertia_of

  !> Sum of the forces that do not balance.
  pure real(wp) function released_forces(run) result(force)
    type(run_t), intent(in) :: run
    integer :: p

    force = 0.0_wp
    do p = 1, size(run%released)
      force = force + sum(abs(run%released(p)%values))
    end do
  end function released_forces

  !> What the forces lack to balance now.
  subroutine note_released(model, run)
    type(model_t), intent(in) :: model
    type(run_t), intent(inout) :: run
    integer :: p

    if (allocated(run%released)) deallocate (run%released)
    allocate (run%released(size(model%bodies%blank%parts)))
    do p = 1, size(run%released)
      associate (motion => model%bodies%blank%parts(p)%element%motion)
        run%released(p)%values = motion%internal_force - motion%external_force
      end associate
    end do
  end subroutine note_released

  !> The next increment, cut as often as it takes; time and motion are those of its end.
  subroutine take_static_increment(model, run, log, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(run_log_t), intent(inout) :: log
    type(error_t), allocatable, intent(out) :: error
    type(static_equations_t) :: equations
    type(field_t), allocatable :: start(:)
    character(:), allocatable :: words
    real(wp) :: dt, last(n_told)
    integer :: cut, n_iterations, n_factors
    logical :: is_meeting, has_buckled

    call keep_positions(model, start)
    is_meeting = .false.
    has_buckled = .false.
    cut = 0
    do
      dt = next_increment(model, run)
      call new_equations(equations, model, run, dt, cut >= enough_cuts, is_meeting, error)
      if (allocated(error)) return
      if (cut == 0 .and. .not. is_meeting) call tell_equations(equations, run, log)
      call find_equilibrium(equations, model, run, n_iterations, n_factors, last, words, error)
      if (.not. allocated(error) .and. words == "") then
        if (has_met_tools(equations)) then       ! once more, with what holds points at tools
          is_meeting = .true.
          call restore_start(equations, model, run)
          cycle
        end if
        if (cut < enough_cuts) words = buckling_words(equations)
        if (words == "") call check_held(equations, model, run, error)
        if (words == "" .and. .not. allocated(error)) exit
      end if
      has_buckled = has_buckled .or. equations%n_unstable > 0
      call restore_start(equations, model, run)
      if (allocated(error)) return
      if (cut == most_cuts .or. equations%is_hopeless .or. &
          dt <= model%step%least_increment*(1.0_wp + 1.0e-9_wp)) then
        call fail_to_balance(run, dt, has_buckled, words, error)
        return
      end if
      call ease_increment(equations, model, run, log, words, cut)
    end do
    call log_line(log, "static     time "//rounded_text(run%instant%time)//", "// &
                  counted(n_iterations, "iteration")//", "//counted(n_factors, "tangent")// &
                  ", residual "//listed(last(max(1, size(last) - n_iterations):) &
                                        /equations%largest)//" of the largest force")
    call warn_of_buckling(equations, run, log)
    call tell_reactions(equations, log)
    call accept(equations, model, run, start)
    if (n_factors <= enough_factors) &
      run%static_dt = min(increment_growth*dt, model%step%most_increment)
  end subroutine take_static_increment

  !> Make the next trial easier: stiffer springs where they hold the part and shorter increments
  !! have not done, else a shorter increment.
  subroutine ease_increment(equations, model, run, log, words, cut)
    type(static_equations_t), intent(in) :: equations
    type(model_t), intent(in) :: model
    type(run_t), intent(inout) :: run
    type(run_log_t), intent(inout) :: log
    character(*), intent(in) :: words              !! why the last trial failed
    integer, intent(inout) :: cut                  !! how often the increment has been cut
    real(wp) :: dt

    dt = cut_to*equations%dt
    if (equations%spring > 0.0_wp .and. run%spring_scale < stiffest .and. &
        (cut == enough_cuts .or. dt < crawling*run%control%duration)) then
      call stiffen_springs(equations, model, run)
      call log_line(log, "static     springs "//rounded_text(run%spring_scale)//" times as "// &
                    "stiff hold the part: "//words)
      cut = 0
      return
    end if
    run%static_dt = max(dt, model%step%least_increment)
    call log_line(log, "static     increment "//rounded_text(equations%dt)//" cut to "// &
                  rounded_text(run%static_dt)//": "//words)
    cut = cut + 1
  end subroutine ease_increment

  !> Stiffer springs, without force here and now: what the ones before bear is ramped down with the
  !! other forces.
  subroutine stiffen_springs(equations, model, run)
    type(static_equations_t), intent(in) :: equations
    type(model_t), intent(in) :: model             !! at the start of the increment
    type(run_t), intent(inout) :: run
    integer :: p, c

    do p = 1, size(run%released)
      associate (element => model%bodies%blank%parts(p)%element, origin => run%origin(p)%values, &
                 released => run%released(p)%values)
        do c = 1, 3
          released(:, :, :, c) = released(:, :, :, c) - equations%spring_before*element%inertia &
            *(element%motion%x(:, :, :, c) - origin(:, :, :, c))/equations%level_before
        end do
        origin = element%motion%x
      end associate
    end do
    run%spring_scale = stiffer*run%spring_scale
  end subroutine stiffen_springs

  subroutine fail_to_balance(run, dt, has_buckled, words, error)
    type(run_t), intent(in) :: run
    real(wp), intent(in) :: dt                     !! the last increment tried [time]
    logical, intent(in) :: has_buckled
    character(:), allocatable, intent(inout) :: words
    type(error_t), allocatable, intent(out) :: error

    if (has_buckled .and. index(words, "buckles") == 0) words = words//"; the part buckles"
    if (has_buckled) words = words//": expected less load, an imperfection of the sheet "// &
                             "that leads it, or an explicit step"
    call fail(error, "no equilibrium in the static step at time "// &
              rounded_text(run%instant%time)//", increment "//rounded_text(dt)//": "//words)
  end subroutine fail_to_balance

  !> What is left of the step at most, and no more than tools and supports may move.
  real(wp) function next_increment(model, run) result(dt)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    real(wp) :: left

    left = run%control%start_time + run%control%duration - run%instant%time
    dt = min(run%static_dt, left)
    if (left - dt < 1.0e-9_wp*run%control%duration) dt = left
    call shorten_way(model, run%instant%time, dt)
  end function next_increment

  !> An equilibrium that is not stable, where no tool holds the part: with shorter increments it
  !! may find the way to one that is. Empty where there is no such sign.
  function buckling_words(equations) result(words)
    type(static_equations_t), intent(in) :: equations
    character(:), allocatable :: words

    words = ""
    if (equations%has_contact .or. equations%n_unstable == 0) return
    words = "the part buckles ("//counted(equations%n_unstable, "negative pivot")//")"
  end function buckling_words

  !> Once in a run.
  subroutine warn_of_buckling(equations, run, log)
    type(static_equations_t), intent(in) :: equations
    type(run_t), intent(inout) :: run
    type(run_log_t), intent(inout) :: log

    if (run%has_warned_of_buckling .or. buckling_words(equations) == "") return
    run%has_warned_of_buckling = .true.
    call log_line(log, "warning: at time "//rounded_text(run%instant%time)//" "// &
                  buckling_words(equations)//": the equilibrium found is not stable, and the "// &
                  "part may come to another one; expected less load, an imperfection of the "// &
                  "sheet that leads it, or an explicit step")
  end subroutine warn_of_buckling

  !> Shorten an increment in which a tool or a support could pass the other face of the sheet.
  subroutine shorten_way(model, time, dt)
    type(model_t), intent(in) :: model
    real(wp), intent(in) :: time
    real(wp), intent(inout) :: dt
    real(wp), parameter :: safe = 0.9_wp         ! of the depth at which a point counts as behind
    real(wp), parameter :: least_part = 1.0e-3_wp
    real(wp) :: reach, way
    logical :: acts(size(model%motions))
    integer :: i, t

    reach = safe*shortest_reach(model%forces)
    if (.not. reach < huge(reach)*safe**2) return
    acts = [(has_pair(model%forces, t), t=1, size(model%motions))]
    do i = 1, 100
      way = way_of_supports(model%supports, time, time + dt)
      do t = 1, size(model%motions)
        if (.not. acts(t)) cycle
        way = max(way, longest_way(model%motions(t), model%bodies%tools(t), time, time + dt))
      end do
      if (way <= reach .or. dt <= least_part*model%step%least_increment) exit
      dt = dt*max(safe*reach/way, 0.1_wp)
    end do
  end subroutine shorten_way

  subroutine keep_positions(model, start)
    type(model_t), intent(in) :: model
    type(field_t), allocatable, intent(out) :: start(:)
    integer :: p

    allocate (start(size(model%bodies%blank%parts)))
    do p = 1, size(start)
      start(p)%values = model%bodies%blank%parts(p)%element%motion%x
    end do
  end subroutine keep_positions

  !> Log what holds the rigid motions, and where factors go that do not fit in memory, once in a
  !! step.
  subroutine tell_equations(equations, run, log)
    type(static_equations_t), intent(in) :: equations
    type(run_t), intent(in) :: run
    type(run_log_t), intent(inout) :: log
    character(:), allocatable :: words
    integer, parameter :: most_told = 12

    if (run%instant%time > run%control%start_time) return
    if (allocated(equations%factor%folder)) &
      call log_line(log, "static     factors on disk, in "//equations%factor%folder//", and "// &
                    to_text(equations%factor%megabytes)//" MB in memory")
    associate (added => equations%added)
      if (size(added, 2) == 0) return
      words = counted(size(added, 2), "component")//" of control points held against rigid "// &
              "motions that the supports leave"
      if (size(added, 2) <= most_told) words = words//": "//held_words(run%origin, added)
      call log_line(log, "static     "//words)
    end associate
  end subroutine tell_equations

  !> At the end of the step, what the components bear that are held against rigid motions.
  subroutine tell_reactions(equations, log)
    type(static_equations_t), intent(in) :: equations
    type(run_log_t), intent(inout) :: log

    if (equations%level > 0.0_wp .or. size(equations%added) == 0) return
    call log_line(log, "static     they bear at most "// &
                  rounded_text(reaction_of_held(equations)/equations%largest)// &
                  " of the largest force")
  end subroutine tell_reactions

  !> Residuals in the order in which they came, those by factors that were kept in parentheses.
  pure function listed(values) result(words)
    real(wp), intent(in) :: values(:)              !! these negative
    character(:), allocatable :: words, word
    integer :: i

    words = ""
    do i = 1, size(values)
      word = rounded_text(abs(values(i)))
      if (values(i) < 0.0_wp) word = "("//word//")"
      if (i > 1) words = words//", "
      words = words//word
    end do
  end function listed

  !> Newton's method. `words` says why there is no equilibrium, or is empty.
  subroutine find_equilibrium(equations, model, run, n_iterations, n_factors, last, words, error)
    type(static_equations_t), intent(inout) :: equations
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    integer, intent(out) :: n_iterations
    integer, intent(out) :: n_factors              !! sets of them
    real(wp), intent(out) :: last(:)               !! residuals, negative: by factors that were kept
    character(:), allocatable, intent(out) :: words
    type(error_t), allocatable, intent(out) :: error
    type(mixing_t) :: mixing
    real(wp), allocatable :: u(:)
    real(wp) :: before, limit, share
    real(wp) :: early(0:2)                         ! residuals after none, one and two iterations
    type(settling_t) :: settling
    integer :: most, n_before, n_free, n_slow
    logical :: is_stale, is_stretched

    words = ""
    n_iterations = 0
    n_factors = 0
    n_free = 0
    n_slow = 0
    most = most_iterations + merge(more_with_care, 0, equations%is_careful)
    limit = limit_of(equations)
    call start_increment(equations, model, run, u, share)
    last = equations%norm
    early = equations%norm
    is_stale = .true.
    do while (n_iterations == 0 .or. equations%norm > limit*equations%largest)
      is_stretched = n_iterations == 1 .and. early(1) > stretching*early(0) .and. &
                     .not. equations%is_careful
      if (.not. equations%norm < huge(before)) then
        words = failure_words(model, run)
      else if (are_diverging(equations, n_iterations, early)) then
        words = "the iterations diverge, most at "//worst_place(equations, model)
      else if (n_iterations - n_free - settling%n == most .or. n_free == most_free) then
        equations%is_hopeless = n_free == most_free
        words = cause_of(equations, model, n_iterations, n_before)
        if (equations%is_hopeless) words = "nothing holds the blank or a tool, and they have "// &
          "not met after "//to_text(n_free)//" iterations on the way"
      end if
      if (words /= "") return
      if (is_stale) then
        call renew_factors(equations, model, run, u, share, is_stretched, words, error)
        n_factors = n_factors + 1
      end if
      if (words /= "" .or. allocated(error)) return
      share = 1.0_wp
      n_iterations = n_iterations + 1
      before = equations%norm
      n_before = equations%n_touching
      call take_newton_step(equations, model, run, mixing, n_slow >= enough_slow, u, error)
      if (allocated(error)) return
      last = [last(2:), merge(equations%norm, -equations%norm, is_stale)]
      if (n_iterations <= 2) early(n_iterations:) = equations%norm
      is_stale = equations%n_touching /= n_before .or. &
                 .not. still_serve(equations, before, limit*equations%largest, .not. is_stale)
      call watch_slowness(equations, before, n_before, n_slow, mixing, is_stale)
      if (is_hovering(equations)) then
        n_free = n_free + 1
        is_stale = n_free == 1
      else if (equations%is_tool_on_way) then
        n_free = n_free + 1
      else
        call watch_settling(equations%n_touching, settling)
      end if
    end do
    if (buckling_words(equations) /= "") &
      call look_again(equations, model, run, u, words, error)
  end subroutine find_equilibrium

  !> Count an iteration as one in which contact settles if it or one of the few before it had fewer
  !! or more touching points than any before. A sheet that comes to rest on a flat tool leaves it
  !! row by row of elements, and shorter increments take as many iterations.
  pure subroutine watch_settling(n_touching, settling)
    integer, intent(in) :: n_touching
    type(settling_t), intent(inout) :: settling
    integer, parameter :: patience = 4, most = 150

    settling%n_idle = settling%n_idle + 1
    if (n_touching < settling%fewest .or. n_touching > settling%largest) settling%n_idle = 0
    settling%fewest = min(settling%fewest, n_touching)
    settling%largest = max(settling%largest, n_touching)
    if (settling%n_idle < patience .and. settling%n < most) settling%n = settling%n + 1
  end subroutine watch_settling

  !> Of the residual, over the largest force.
  pure real(wp) function limit_of(equations)
    type(static_equations_t), intent(in) :: equations

    limit_of = tolerance*merge(in_contact, 1.0_wp, equations%has_contact)
  end function limit_of

  !> The pivots of the tangent in equilibrium itself: the last one was that of an iteration before.
  subroutine look_again(equations, model, run, u, words, error)
    type(static_equations_t), intent(inout) :: equations
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp), intent(in) :: u(:)                   !! the equilibrium [length]
    character(:), allocatable, intent(inout) :: words
    type(error_t), allocatable, intent(out) :: error

    call renew_factors(equations, model, run, u, 1.0_wp, .false., words, error)
    call try_motion(equations, model, run, u, 1.0_wp)
  end subroutine look_again

  !> What of the blank failed in the last trial.
  function failure_words(model, run) result(words)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    character(:), allocatable :: words
    type(location_t) :: location
    integer :: failure

    words = "forces are no finite numbers"
    if (model%bodies%blank%report%failed_block < huge(1)) &
      call find_failure(model%bodies%blank, run%instant, words, failure, location)
  end function failure_words

  !> Where the tangent in contact is not quite right, as with friction, which makes it
  !! unsymmetrical, iterations bring a constant part each. Then factors stay, and steps are mixed,
  !! as long as the same points touch.
  subroutine watch_slowness(equations, before, n_before, n_slow, mixing, is_stale)
    type(static_equations_t), intent(in) :: equations
    real(wp), intent(in) :: before                 !! residual before the last iteration [force]
    integer, intent(in) :: n_before                !! points that touched then
    integer, intent(inout) :: n_slow               !! slow iterations in a row
    type(mixing_t), intent(inout) :: mixing
    logical, intent(inout) :: is_stale

    if (equations%norm >= slow*before .and. n_slow < enough_slow) n_slow = n_slow + 1
    if (equations%norm < slow*before .and. n_slow < enough_slow) n_slow = 0
    if (.not. equations%has_contact .or. equations%n_touching /= n_before .or. &
        equations%is_shortened .or. equations%norm > too_much*before) n_slow = 0
    if (n_slow >= enough_slow) then
      is_stale = .false.
    else
      call forget(mixing)
    end if
  end subroutine watch_slowness

  !> Do the iterations lead away from equilibrium? Known without contact, which comes and goes, and
  !! before steps are to lead downhill.
  pure logical function are_diverging(equations, n_iterations, early)
    type(static_equations_t), intent(in) :: equations
    integer, intent(in) :: n_iterations
    real(wp), intent(in) :: early(0:2)             !! residuals, see `find_equilibrium` [force]

    are_diverging = .false.
    if (equations%is_careful) return
    are_diverging = equations%norm > too_much*max(early(0), early(1))
    if (n_iterations == 2) are_diverging = are_diverging .or. &
      (early(1) > stretching*early(0) .and. early(2) > too_little*early(1))
  end function are_diverging

  !> Do the factors serve for one more iteration? New ones cost as much as many iterations.
  pure logical function still_serve(equations, before, limit, were_kept)
    type(static_equations_t), intent(in) :: equations
    real(wp), intent(in) :: before                 !! residual before the last iteration [force]
    real(wp), intent(in) :: limit                  !! of residuals in equilibrium [force]
    logical, intent(in) :: were_kept               !! in the last iteration

    associate (norm => equations%norm)
      still_serve = norm <= enough*before .and. norm <= near*limit
      if (were_kept) still_serve = still_serve .or. norm*(norm/before)**few <= limit
    end associate
  end function still_serve

  !> Why the iterations have not come to an end.
  function cause_of(equations, model, n_iterations, n_before) result(words)
    type(static_equations_t), intent(in) :: equations
    type(model_t), intent(in) :: model
    integer, intent(in) :: n_iterations, n_before
    character(:), allocatable :: words
    real(wp), parameter :: one_way = 0.5_wp        ! of all that the forces lack
    real(wp) :: unheld(6), total

    words = "after "//to_text(n_iterations)//" iterations the residual is "// &
            rounded_text(equations%norm/equations%largest)//" of the largest force, limit "// &
            rounded_text(limit_of(equations))//", most at "//worst_place(equations, model)
    call unheld_lack(equations, model, unheld, total)
    if (norm2(unheld) > one_way*total) &
      words = words//"; nothing holds the blank against "//motions_along(unheld)
    if (equations%n_unstable > 0 .and. .not. equations%has_contact) &
      words = words//"; "//counted(equations%n_unstable, "negative pivot")
    if (equations%n_touching /= n_before) words = words//"; points come to tools and leave "// &
      "them ("//to_text(n_before)//" and "//to_text(equations%n_touching)//" touch in the last two)"
  end function cause_of

  !> The whole step, though the residual may grow: a sheet that turns is stretched first. A part of
  !! it where elements turn over, or where points come to a tool on the way.
  subroutine take_newton_step(equations, model, run, mixing, is_mixed, u, error)
    type(static_equations_t), intent(inout) :: equations
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(mixing_t), intent(inout) :: mixing
    logical, intent(in) :: is_mixed                !! with the steps before
    real(wp), intent(inout) :: u(:)                !! displacements of the unknowns [length]
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: most_quarters = 4
    real(wp), allocatable :: step(:), before(:)
    real(wp) :: part, power
    integer :: i

    call step_to_balance(equations, step, error)
    if (allocated(error)) return
    if (is_mixed) call mix_step(mixing, u, step)
    before = u
    power = dot_product(equations%residual, step)
    part = 1.0_wp
    do i = 0, most_quarters
      u = before + part*step
      call try_motion(equations, model, run, u, 1.0_wp)
      if (equations%norm < huge(equations%norm)) exit
      part = 0.25_wp*part
    end do
    if (equations%is_careful .and. equations%norm < huge(equations%norm)) &
      call meet_tools(equations, model, run, before, step, power, part, u)
  end subroutine take_newton_step

  !> Shorten a step on whose way points have come to a tool, so that at its end the forces do no
  !! work along it but for a part of what they did at its start. The root is enclosed (Illinois
  !! method).
  subroutine meet_tools(equations, model, run, before, step, power, part, u)
    type(static_equations_t), intent(inout) :: equations
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp), intent(in) :: before(:), step(:)     !! where it begins, and all of it [length]
    real(wp), intent(in) :: power                  !! of the residual there along the step
    real(wp), intent(in) :: part                   !! of the step that was tried
    real(wp), intent(inout) :: u(:)                !! where the last trial was
    integer, parameter :: most_trials = 30
    real(wp), parameter :: precise = 0.1_wp
    real(wp) :: ends(2), powers(2), at, value
    integer :: i

    ends = [0.0_wp, part]
    value = dot_product(equations%residual, step)
    powers = [power, value]
    do i = 1, most_trials
      if (abs(value) <= precise*abs(power) .or. .not. powers(1)*powers(2) < 0.0_wp) return
      at = (ends(1)*powers(2) - ends(2)*powers(1))/(powers(2) - powers(1))
      u = before + at*step
      call try_motion(equations, model, run, u, 1.0_wp)
      value = dot_product(equations%residual, step)
      if (value*powers(2) < 0.0_wp) then
        ends(1) = ends(2)
        powers(1) = powers(2)
      else
        powers(1) = 0.5_wp*powers(1)
      end if
      ends(2) = at
      powers(2) = value
    end do
  end subroutine meet_tools

  !> Loads on motions that nothing holds are an error: what holds them bears no force otherwise.
  subroutine check_held(equations, model, run, error)
    type(static_equations_t), intent(in) :: equations
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: unheld(6), total, reaction

    if (size(equations%added) == 0) return
    call unheld_load(equations, model, unheld, total)
    reaction = reaction_of_held(equations)
    if (norm2(unheld) > unloaded*total) then
      call fail(error, "the loads of the static step at time "// &
                rounded_text(run%instant%time)//" move the blank as a whole, "// &
                motions_along(unheld)//": their resultant, "//rounded_text(norm2(unheld))// &
                ", is borne by no support and no tool")
    else if (equations%level <= 0.0_wp .and. reaction > unheld_part*equations%largest) then
      call fail(error, "at the end of the static step a component that neither a support nor a "// &
                "tool holds bears "//rounded_text(reaction)//", "// &
                rounded_text(reaction/equations%largest)//" of the largest force")
    end if
  end subroutine check_held

  !> Take the equilibrium as the state, with the work of what is released on the way to it.
  subroutine accept(equations, model, run, start)
    type(static_equations_t), intent(in) :: equations
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(field_t), intent(in) :: start(:)
    integer :: p, c

    do p = 1, size(start)
      associate (element => model%bodies%blank%parts(p)%element, before => start(p)%values, &
                 released => run%released(p)%values, origin => run%origin(p)%values)
        do c = 1, 3
          associate (now => element%motion%x(:, :, :, c))
            run%balance%released = run%balance%released &
              + 0.5_wp*sum((element%mass/element%inertia*released(:, :, :, c) &
                            *(equations%level_before + equations%level) &
                            - element%mass*(equations%spring_before*(before(:, :, :, c) &
                                                                     - origin(:, :, :, c)) &
                                            + equations%spring*(now - origin(:, :, :, c)))) &
                           *(now - before(:, :, :, c)), &
                           mask=.not. equations%fixed(p)%is_fixed(:, :, :, c))
          end associate
        end do
        run%pace(p)%values = element%motion%v
        element%motion%v = 0.0_wp
        run%v_before(p)%values = 0.0_wp
      end associate
    end do
    call take_reactions(model%supports, model%bodies%blank%parts)
    call rest_drives(model%supports, model%bodies%tools, run%instant%time)
    run%instant%dt = 0.0_wp
    run%instant%dt_mean = 0.0_wp
  end subroutine accept

end module static_step
