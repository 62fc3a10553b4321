!> Equilibrium at the end of a static increment as equations for the displacements of the control
!! points. A trial takes the state of the start, makes the motion of the increment as an explicit
!! one would, with contact and loads, and leaves the state of its end: where the forces balance, the
!! increment is made.
module static_equations
  use kinds, only: wp
  use text, only: to_text, rounded_text, place_text, axis_names
  use failure, only: error_t, fail
  use state_store, only: state_store_t, empty_store
  use body_parts, only: field_t, forces_of_parts, vector_at
  use boundary, only: any_moving, prescribed_components, move_supports
  use effect, only: any_from_outside, instant_t
  use vibration, only: fixed_t, trial_amount
  use model, only: model_t, apply_forces
  use rigid_motion, only: longest_way, move_tool
  use prescribed_field, only: change_fields
  use run_state, only: run_t, carry_run
  use energy_balance, only: add_step
  use unknowns, only: to_components, to_unknowns, unknowns_t
  use sparse_matrix, only: set_zero
  use sparse_factor, only: sparse_factor_t
  use body_stiffness, only: add_stiffness, bending_guess, body_stiffness_t, field_of, &
                            find_unknowns, masses_of, new_body_stiffness
  use bead_stiffness, only: add_bead_stiffness, any_bead
  use contact_effect, only: any_load, has_pair
  use contact_stiffness, only: add_contact_stiffness, n_touching, shortest_reach
  use driven_tools, only: driven_tools_t, new_driven_tools, set_tool_ways, find_tool_residual, &
                          solve_coupled
  use rigid_supports, only: find_unheld, hold_rigid_motions
  implicit none
  private

  public :: static_equations_t, new_equations, restore_start, try_motion, renew_factors
  public :: start_increment, step_to_balance, is_hovering, reaction_of_held, unheld_load
  public :: unheld_lack, worst_place, has_met_tools

  real(wp), parameter :: regular = 0.01_wp     !! of the bending stiffness: see `shift`
  real(wp), parameter :: least = 1.0e-10_wp    !! of the largest stiffness by mass

  !> Power of two by which displacements of differences are smaller than elsewhere: points that have
  !! just begun to yield should go on yielding in both.
  integer, parameter :: finer = -10

  !> The equations of one increment. Not to be copied: the factors cannot be.
  type :: static_equations_t
    type(state_store_t) :: start                   !! the state that each trial begins with
    type(body_stiffness_t) :: stiffness
    type(sparse_factor_t) :: factor
    type(driven_tools_t) :: driven                 !! whose ways are unknowns as well, the last ones
    integer :: n = 0                               !! unknowns
    type(fixed_t), allocatable :: fixed(:)         !! held or tied components, by part
    type(fixed_t), allocatable :: supported(:)     !! the same without what is added
    !> Components held against rigid motions: part, and place in its field as one list, (2, n).
    integer, allocatable :: added(:, :)
    type(unknowns_t) :: without_added              !! the unknowns if they were free
    real(wp) :: dt = 0.0_wp                        !! of the increment [time]
    real(wp) :: level_before = 1.0_wp, level = 0.0_wp   !! of the forces released, at both ends
    !> Of springs that hold a part to where the step began, by its masses, at both ends [1/time^2].
    real(wp) :: spring_before = 0.0_wp, spring = 0.0_wp
    real(wp) :: reach = huge(1.0_wp)               !! largest part of a step of Newton's [length]
    real(wp) :: least_force = 0.0_wp               !! that counts [force]
    logical :: has_tools = .false.                 !! there are contact pairs
    logical :: has_contact = .false.               !! tools or draw beads may hold its points
    logical :: is_careful = .false.                !! steps lead downhill: in contact, or where
                                                   !! longer increments have found no equilibrium
    real(wp), allocatable :: masses(:)             !! of the unknowns
    real(wp) :: shift = 0.0_wp                     !! by how much of these the matrix is stiffer in
                                                   !! contact, which may be still to come [1/time^2]
    ! Of the last trial:
    real(wp), allocatable :: lack(:)               !! what the components lack to balance [force]
    real(wp), allocatable :: residual(:)           !! the same of the unknowns [force]
    real(wp) :: norm = 0.0_wp                      !! the largest; huge where an element fails
    real(wp) :: largest = 0.0_wp                   !! force that acts [force]
    integer :: n_touching = 0                      !! points at tools
    logical :: is_loose = .false.                  !! under loads, and tools alone hold its rigid
                                                   !! motions
    integer :: n_unstable = 0                      !! negative pivots of the last tangent
    logical :: is_shortened = .false.              !! the last step was as long as it may be
    logical :: is_tool_on_way = .false.            !! in the last step one that a force moves went
                                                   !! farther than all points, as far as it may
    logical :: is_hopeless = .false.               !! shorter increments change nothing
  end type static_equations_t

contains

  !> Unknowns and the entries of the matrix, analysed; the present state is where trials begin.
  !! Where neither tools touch nor loads act, the rigid motions that supports leave are held.
  subroutine new_equations(self, model, run, dt, is_careful, is_meeting, error)
    type(static_equations_t), intent(inout) :: self
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp), intent(in) :: dt                     !! of the increment [time]
    logical, intent(in) :: is_careful              !! longer ones have failed
    logical, intent(in) :: is_meeting              !! a part that stands free comes to a tool
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: nothing = 1.0e-6_wp     ! of the bulk modulus, on the area of an element
    real(wp) :: edge
    logical :: is_loaded, moves
    integer :: p

    self%dt = dt
    associate (control => run%control)
      self%level_before = 1.0_wp - (run%instant%time - control%start_time)/control%duration
      self%level = self%level_before - dt/control%duration
    end associate
    if (self%level < 1.0e-9_wp) self%level = 0.0_wp
    call empty_store(self%start)
    call carry_run(model, run, self%start)
    self%start%is_taking = .true.
    associate (blank => model%bodies%blank)
      self%fixed = prescribed_components(blank%parts, model%supports, model%i_step)
      self%reach = 0.5_wp*shortest_reach(model%forces)
      self%has_tools = self%reach < 0.25_wp*huge(self%reach)
      is_loaded = any_load(model%forces) .or. any_moving(model%supports)
      call new_driven_tools(self%driven, model%supports)
      self%n_touching = n_touching(model%forces)
      moves = any_tool_moves(model, run%instant%time, run%instant%time + dt)
      self%has_contact = any_bead(model%forces) .or. (self%has_tools .and. (is_loaded .or. moves &
        .or. is_meeting .or. self%n_touching > 0 .or. self%driven%n > 0))
      self%is_careful = self%has_contact .or. is_careful
      self%n_unstable = 0
      self%is_hopeless = .false.
      self%supported = self%fixed
      ! By the shape at the start of the step: the same components in all increments.
      call hold_rigid_motions(blank%parts, blank%seams, run%origin, self%fixed, self%added)
      self%is_loose = self%has_tools .and. self%has_contact .and. is_loaded .and. &
                      size(self%added, 2) > 0
      if (self%has_contact) then
        self%fixed = self%supported
        deallocate (self%added)
        allocate (self%added(2, 0))
      else
        call find_unknowns(blank%parts, blank%seams, self%supported, self%without_added, error)
        if (allocated(error)) return
      end if
      call new_body_stiffness(self%stiffness, blank%parts, blank%seams, self%fixed, error, &
                              blank%joints)
      if (allocated(error)) return
      self%n = self%stiffness%map%n_free + self%driven%n
      edge = huge(edge)
      do p = 1, size(blank%parts)
        edge = min(edge, blank%parts(p)%element%shortest)
      end do
      self%least_force = nothing*blank%law%bulk*edge**2
      self%masses = to_unknowns(self%stiffness%map, masses_of(blank%parts))
      self%shift = regular*bending_guess(blank%parts, blank%law)
      self%spring_before = 0.0_wp
      self%spring = 0.0_wp
      if (.not. self%has_contact) then
        self%spring_before = run%spring_scale*self%shift*spring_factor(self%level_before)
        self%spring = run%spring_scale*self%shift*spring_factor(self%level)
      end if
    end associate
    self%factor%has_buffer = run%has_buffer
    call self%factor%take_ranks(model%ranks)
    if (self%n == 0) then
      call fail(error, "a static step has nothing to find: supports hold all components of all "// &
                "control points")
      return
    end if
    call self%factor%analyse(self%stiffness%matrix, error)
  end subroutine new_equations

  logical function any_tool_moves(model, from, to)
    type(model_t), intent(in) :: model
    real(wp), intent(in) :: from, to               !! [time]
    integer :: t

    any_tool_moves = .false.
    do t = 1, size(model%motions)
      if (.not. has_pair(model%forces, t)) cycle
      any_tool_moves = any_tool_moves .or. &
        longest_way(model%motions(t), model%bodies%tools(t), from, to) > 0.0_wp
    end do
  end function any_tool_moves

  !> Springs that keep a part that is let go from turning over while forces that do not turn with it
  !! are ramped down: at first they hold all of its motion, at the end of the step none; in between
  !! they pass the stiffness of its bending.
  pure real(wp) function spring_factor(level) result(factor)
    real(wp), intent(in) :: level                  !! of the forces released, 1 to 0
    real(wp), parameter :: middle = 1.0e2_wp       ! of the bending stiffness, at half of the step

    factor = 0.0_wp
    if (level < 1.0_wp) factor = middle/regular*(level/(1.0_wp - level))**3
  end function spring_factor

  !> The state at the start of the increment.
  subroutine restore_start(self, model, run)
    type(static_equations_t), intent(inout) :: self
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run

    call carry_run(model, run, self%start)
  end subroutine restore_start

  !> Make the motion `u`, of the control points and last of the tools that forces move, beside that
  !! of supports and other tools, and find the forces. `share` is that of the way of the supports.
  subroutine try_motion(self, model, run, u, share)
    type(static_equations_t), intent(inout) :: self
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp), intent(in) :: u(:), share
    integer :: p

    call restore_start(self, model, run)
    associate (instant => run%instant, blank => model%bodies%blank)
      instant%is_static = .true.
      instant%dt = self%dt
      instant%dt_mean = self%dt
      instant%time = instant%time + self%dt
      call set_velocities(self, model, run, u, share)
      do p = 1, size(blank%parts)
        associate (motion => blank%parts(p)%element%motion)
          motion%x = motion%x + self%dt*motion%v
          motion%external_force = 0.0_wp
        end associate
      end do
      call set_tool_ways(self%driven, u(self%stiffness%map%n_free + 1:), self%dt, &
                         model%bodies%tools)
      do p = 1, size(model%motions)
        call move_tool(model%motions(p), instant%time, self%dt, model%bodies%tools(p))
      end do
      call forces_of_parts(blank%parts, blank%seams, blank%law, self%dt, blank%report, &
                           joints=blank%joints)
      call add_step(run%balance, blank%report)
      call apply_forces(model, instant)
    end associate
    run%n_steps = run%n_steps + 1
    call find_residual(self, model, run)
  end subroutine try_motion

  !> Velocities of the increment, and the fields that change in it.
  subroutine set_velocities(self, model, run, u, share)
    type(static_equations_t), intent(in) :: self
    type(model_t), intent(inout) :: model
    type(run_t), intent(in) :: run
    real(wp), intent(in) :: u(:), share
    real(wp) :: displacement(self%stiffness%map%n_components)
    integer :: p

    call change_fields(model%supports, model%bodies, &
                       instant_t(time=run%instant%time - self%dt, dt=self%dt))
    displacement = to_components(self%stiffness%map, u(:self%stiffness%map%n_free))
    associate (parts => model%bodies%blank%parts)
      do p = 1, size(parts)
        parts(p)%element%motion%v = 0.0_wp
      end do
      call move_supports(model%supports, parts, run%instant%time, self%dt)
      do p = 1, size(parts)
        associate (v => parts(p)%element%motion%v)
          v = share*v + field_of(self%stiffness, p, shape(v), displacement)/self%dt
        end associate
      end do
    end associate
  end subroutine set_velocities

  !> What the forces lack to equilibrium, how much that is, and what it is measured by.
  subroutine find_residual(self, model, run)
    type(static_equations_t), intent(inout) :: self
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(field_t) :: lack(size(run%released))
    integer :: p, c

    self%largest = self%least_force
    do p = 1, size(lack)
      associate (element => model%bodies%blank%parts(p)%element, released => run%released(p)%values)
        associate (motion => element%motion)
          lack(p)%values = self%level*released + motion%external_force - motion%internal_force
          do c = 1, 3
            lack(p)%values(:, :, :, c) = lack(p)%values(:, :, :, c) - self%spring*element%inertia &
              *(motion%x(:, :, :, c) - run%origin(p)%values(:, :, :, c))
          end do
          self%largest = max(self%largest, maxval(abs(released)), &
                             maxval(abs(motion%external_force)), &
                             maxval(abs(motion%internal_force), mask=self%fixed(p)%is_fixed))
        end associate
        ! What meets at a seam has its sum there in all patches: each takes its share.
        do c = 1, 3
          lack(p)%values(:, :, :, c) = lack(p)%values(:, :, :, c)*(element%mass/element%inertia)
        end do
      end associate
    end do
    self%lack = listed(self%stiffness, lack)
    call find_tool_residual(self%driven, model%supports, model%bodies%tools, run%instant%time, &
                            self%level)
    self%largest = max(self%largest, self%driven%largest)
    self%residual = [to_unknowns(self%stiffness%map, self%lack), self%driven%residual]
    self%norm = maxval(abs(self%residual))
    if (model%bodies%blank%report%failed_block < huge(1) .or. &
        .not. sum(abs(self%residual)) <= huge(self%norm)) self%norm = huge(self%norm)
    self%n_touching = n_touching(model%forces)
  end subroutine find_residual

  !> Add to the residual what the way of the supports changes in it, found by a small part of it.
  !! Without such a way nothing happens.
  subroutine add_way_of_supports(self, model, run)
    type(static_equations_t), intent(inout) :: self
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp), allocatable :: at_rest(:), none(:)
    real(wp) :: way, share
    integer :: p

    allocate (none(size(self%residual)), source=0.0_wp)
    call set_velocities(self, model, run, none, 1.0_wp)
    way = 0.0_wp
    associate (parts => model%bodies%blank%parts)
      do p = 1, size(parts)
        way = max(way, self%dt*maxval(abs(parts(p)%element%motion%v)))
      end do
      if (.not. way > 0.0_wp) return
      share = min(1.0_wp, trial_amount(parts)/way)
    end associate
    at_rest = self%residual
    call try_motion(self, model, run, none, share)
    self%residual = at_rest + (self%residual - at_rest)/share
    self%norm = maxval(abs(self%residual))
  end subroutine add_way_of_supports

  !> The first trial. Under loads the motion of the increment before goes on: tools that move on
  !! would meet points at rest with forces beyond measure, and points that yield seem stiffer at
  !! rest. Else points are at rest, and the residual is what the way of the supports adds to that.
  subroutine start_increment(self, model, run, u, share)
    type(static_equations_t), intent(inout) :: self
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp), allocatable, intent(out) :: u(:)     !! the motion that was tried
    real(wp), intent(out) :: share                 !! of the way of the supports in it

    allocate (u(self%n), source=0.0_wp)
    share = 1.0_wp
    if (any_from_outside(model%forces) .or. any_moving(model%supports)) then
      u(:self%stiffness%map%n_free) = self%dt*pace_of_unknowns(self, run)
      if (any(abs(u) > 0.0_wp)) call try_motion(self, model, run, u, share)
      if (any(abs(u) > 0.0_wp) .and. self%norm < huge(self%norm)) return
      u = 0.0_wp
    end if
    share = 0.0_wp
    call try_motion(self, model, run, u, share)
    call add_way_of_supports(self, model, run)
  end subroutine start_increment

  !> Velocities of the unknowns in the last increment.
  pure function pace_of_unknowns(self, run) result(pace)
    type(static_equations_t), intent(in) :: self
    type(run_t), intent(in) :: run
    real(wp) :: pace(self%stiffness%map%n_free)
    real(wp), allocatable :: components(:)
    integer :: c

    components = listed(self%stiffness, run%pace)
    pace = 0.0_wp
    associate (map => self%stiffness%map)
      do c = 1, map%n_components
        if (map%first(c + 1) - map%first(c) == 1) pace(map%unknown(map%first(c))) = components(c)
      end do
    end associate
  end function pace_of_unknowns

  !> The tangent at `u`, factored; the last trial was that of `u`. `words` says why it cannot be.
  !! Fails where memory does not do.
  subroutine renew_factors(self, model, run, u, share, is_stretched, words, error)
    type(static_equations_t), intent(inout) :: self
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp), intent(in) :: u(:), share
    logical, intent(in) :: is_stretched            !! by `u`, far more than in equilibrium
    character(:), allocatable, intent(inout) :: words
    type(error_t), allocatable, intent(out) :: error

    call set_zero(self%stiffness%matrix)
    call add_contact_stiffness(self%stiffness, model%bodies%blank%parts, model%forces, &
                               model%bodies%tools, self%driven)
    call add_bead_stiffness(self%stiffness, model%bodies%blank%parts, model%forces)
    call restore_start(self, model, run)
    run%instant%time = run%instant%time + self%dt
    call set_velocities(self, model, run, u, share)
    if (is_stretched) then
      call go_with_linear_strains(self, model)
      if (model%bodies%blank%report%failed_block < huge(1)) then   ! as if it were not
        call restore_start(self, model, run)
        run%instant%time = run%instant%time + self%dt
        call set_velocities(self, model, run, u, share)
      end if
    end if
    associate (blank => model%bodies%blank, matrix => self%stiffness%matrix)
      call add_stiffness(self%stiffness, blank%parts, blank%law, self%dt, &
                         scale(trial_amount(blank%parts), finer), blank%joints)
      if (.not. sum(abs(matrix%values)) <= huge(1.0_wp)) then
        words = "the tangent is no finite number"
        return
      end if
      associate (diagonal => matrix%first(2:) - 1)
        matrix%values(diagonal) = matrix%values(diagonal) + self%spring*self%masses
      end associate
      if (self%is_careful) then
        call factorise_held(self, error)
      else
        call self%factor%factorise(matrix, error)
        self%n_unstable = self%factor%n_negative
      end if
    end associate
    run%has_buffer = self%factor%has_buffer
    if (.not. allocated(error) .or. self%factor%is_short) return
    words = error%message
    self%is_hopeless = self%factor%null_unknown > 0 .and. all(abs(u) <= 0.0_wp)
    if (self%factor%null_unknown > 0) words = "nothing holds "//axis_names(axis_of(self, &
      self%factor%null_unknown))//" at "//place_of(self, model, self%factor%null_unknown)// &
      ": "//words
    deallocate (error)
  end subroutine renew_factors

  !> Make the motion of the velocities with the stress that its linear strains give, turned with it;
  !! then all is at rest. A part that turns is stretched by the second order of its motion, and the
  !! stress of that would hold it in the tangent, where equilibrium has none of it (after the mixed
  !! integration points of D. Magisano, L. Leonetti and G. Garcea, CMAME 313 (2017), 986). Strains
  !! between two shapes equally far from the start are linear in the motion.
  subroutine go_with_linear_strains(self, model)
    type(static_equations_t), intent(in) :: self
    type(model_t), intent(inout) :: model
    integer :: p

    associate (blank => model%bodies%blank)
      do p = 1, size(blank%parts)
        associate (element => blank%parts(p)%element)
          element%motion%x = element%motion%x - 0.5_wp*self%dt*element%motion%v
          call element%take_shape()
          element%motion%x = element%motion%x + self%dt*element%motion%v
        end associate
      end do
      call forces_of_parts(blank%parts, blank%seams, blank%law, self%dt, blank%report, &
                           joints=blank%joints)
      do p = 1, size(blank%parts)
        associate (element => blank%parts(p)%element)
          element%motion%x = element%motion%x + 0.5_wp*self%dt*element%motion%v
          element%motion%v = 0.0_wp
          call element%take_shape()
        end associate
      end do
    end associate
  end subroutine go_with_linear_strains

  !> Factors of the tangent and a part of the masses. Points that nothing holds yet are so held a
  !! little, and more than round-off; where the part is unstable, as a sheet is that slides from one
  !! contact point to the next, they are held as much as it takes, and the step leads downhill.
  subroutine factorise_held(self, error)
    type(static_equations_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: growth = 30.0_wp
    integer, parameter :: most_trials = 8
    real(wp) :: held, more
    integer :: i

    associate (matrix => self%stiffness%matrix, diagonal => self%stiffness%matrix%first(2:) - 1)
      held = max(self%shift, least*maxval(matrix%values(diagonal)/self%masses))
      if (self%has_contact) matrix%values(diagonal) = matrix%values(diagonal) + held*self%masses
      do i = 1, most_trials
        call self%factor%factorise(matrix, error)
        if (i == 1) self%n_unstable = self%factor%n_negative
        if (allocated(error) .or. self%factor%n_negative == 0) return
        more = (growth - 1.0_wp)*held
        matrix%values(diagonal) = matrix%values(diagonal) + more*self%masses
        held = held + more
      end do
    end associate
  end subroutine factorise_held

  !> Is a part under way to a tool, by loads, with nothing that holds it?
  pure logical function is_hovering(self)
    type(static_equations_t), intent(in) :: self

    is_hovering = self%is_loose .and. self%n_touching == 0 .and. self%norm > 0.0_wp
  end function is_hovering

  !> Has a part come to a tool that was to stand free?
  pure logical function has_met_tools(self)
    type(static_equations_t), intent(in) :: self

    has_met_tools = self%has_tools .and. .not. self%has_contact .and. self%n_touching > 0
  end function has_met_tools

  !> Displacements of all unknowns by which the tangent balances the residual, shorter where a point
  !! could pass a tool; as long as that for a part that is under way to one.
  subroutine step_to_balance(self, step, error)
    type(static_equations_t), intent(inout) :: self
    real(wp), allocatable, intent(out) :: step(:)  !! [length]
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: u(:), ways(:)
    real(wp) :: largest

    call solve_coupled(self%driven, self%factor, self%residual, u, ways, error)
    if (allocated(error)) return
    step = [u, ways]
    largest = max(maxval(abs(step)), tiny(1.0_wp))
    self%is_shortened = largest > self%reach .or. is_hovering(self)
    self%is_tool_on_way = largest > self%reach .and. maxloc(abs(step), 1) > size(u)
    if (self%is_shortened) step = step*(self%reach/largest)
  end subroutine step_to_balance

  !> Largest reaction where rigid motions are held: there should be none.
  pure real(wp) function reaction_of_held(self) result(reaction)
    type(static_equations_t), intent(in) :: self

    reaction = 0.0_wp
    if (size(self%added) > 0) reaction = maxval(abs(to_unknowns(self%without_added, self%lack)))
  end function reaction_of_held

  !> The resultant of the external forces along the rigid motions that supports leave: that of loads
  !! which nothing can bear. And the sum of all these forces.
  subroutine unheld_load(self, model, unheld, total)
    type(static_equations_t), intent(in) :: self
    type(model_t), intent(in) :: model
    real(wp), intent(out) :: unheld(6)             !! see `find_unheld` [force]
    real(wp), intent(out) :: total                 !! [force]
    type(field_t) :: forces(size(model%bodies%blank%parts))
    integer :: p, c

    do p = 1, size(forces)
      associate (element => model%bodies%blank%parts(p)%element)
        forces(p)%values = element%motion%external_force
        do c = 1, 3
          forces(p)%values(:, :, :, c) = forces(p)%values(:, :, :, c)*(element%mass/element%inertia)
        end do
      end associate
    end do
    call find_unheld_part(self, model, forces, unheld, total)
  end subroutine unheld_load

  !> The same of what the forces lack to balance.
  subroutine unheld_lack(self, model, unheld, total)
    type(static_equations_t), intent(in) :: self
    type(model_t), intent(in) :: model
    real(wp), intent(out) :: unheld(6), total      !! [force]
    type(field_t) :: forces(size(model%bodies%blank%parts))
    integer :: p

    do p = 1, size(forces)
      associate (x => model%bodies%blank%parts(p)%element%motion%x)
        forces(p)%values = field_of(self%stiffness, p, shape(x), self%lack)
        where (self%supported(p)%is_fixed) forces(p)%values = 0.0_wp
      end associate
    end do
    call find_unheld_part(self, model, forces, unheld, total)
  end subroutine unheld_lack

  subroutine find_unheld_part(self, model, forces, unheld, total)
    type(static_equations_t), intent(in) :: self
    type(model_t), intent(in) :: model
    type(field_t), intent(in) :: forces(:)
    real(wp), intent(out) :: unheld(6), total
    type(field_t) :: at(size(forces))
    integer :: p

    do p = 1, size(at)
      at(p)%values = model%bodies%blank%parts(p)%element%motion%x
    end do
    associate (blank => model%bodies%blank)
      call find_unheld(blank%parts, blank%seams, at, self%supported, forces, unheld, total)
    end associate
  end subroutine find_unheld_part

  !> Where the forces lack most.
  function worst_place(self, model) result(words)
    type(static_equations_t), intent(in) :: self
    type(model_t), intent(in) :: model
    character(:), allocatable :: words

    words = place_of(self, model, maxloc(abs(self%residual), 1))
  end function worst_place

  !> The component that an unknown moves most: 1 to 3 in a control point, one point after the other.
  pure integer function component_of(self, unknown) result(component)
    type(static_equations_t), intent(in) :: self
    integer, intent(in) :: unknown
    real(wp) :: unit(self%stiffness%map%n_free)

    unit = 0.0_wp
    unit(unknown) = 1.0_wp
    component = maxloc(abs(to_components(self%stiffness%map, unit)), 1)
  end function component_of

  pure integer function axis_of(self, unknown) result(axis)
    type(static_equations_t), intent(in) :: self
    integer, intent(in) :: unknown

    axis = modulo(component_of(self, unknown) - 1, 3) + 1
  end function axis_of

  !> The tool, or position of the control point, that an unknown moves.
  function place_of(self, model, unknown) result(words)
    type(static_equations_t), intent(in) :: self
    type(model_t), intent(in) :: model
    integer, intent(in) :: unknown
    character(:), allocatable :: words
    integer :: p, n, at

    at = unknown - self%stiffness%map%n_free
    if (at > 0) then
      words = "tool "//model%bodies%tools(self%driven%tool(at))%name
      return
    end if
    at = (component_of(self, unknown) + 2)/3
    do p = 1, size(model%bodies%blank%parts)
      associate (x => model%bodies%blank%parts(p)%element%motion%x)
        n = size(x)/3
        if (at > n) then
          at = at - n
          cycle
        end if
        words = place_text(vector_at(x, at))
        if (size(model%bodies%blank%parts) > 1) &
          words = words//" in patch '"//model%bodies%blank%parts(p)%element%name//"'"
        return
      end associate
    end do
  end function place_of

  !> Fields of all patches as components.
  pure function listed(stiffness, fields) result(components)
    type(body_stiffness_t), intent(in) :: stiffness
    type(field_t), intent(in) :: fields(:)
    real(wp) :: components(stiffness%map%n_components)
    integer :: p, c, n, first

    do p = 1, size(fields)
      n = size(fields(p)%values)/3
      do c = 1, 3
        first = 3*stiffness%grids(p)%n_before + c
        components(first:first + 3*(n - 1):3) = reshape(fields(p)%values(:, :, :, c), [n])
      end do
    end do
  end function listed

end module static_equations
