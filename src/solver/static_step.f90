!> Static increments: equilibrium by Newton's method, on the elements and the state of the explicit
!! steps. The residual is that of their force routine for the motion since the last equilibrium,
!! which alone is committed; the tangent comes from its differences (`body_stiffness`).
!!
!! What held the blank when the step begins, contact that is gone and inertia, is ramped down over
!! the step. Rigid motions that the supports leave are held at the fewest components that do.
module static_step
  use, intrinsic :: iso_c_binding, only: c_funptr
  use kinds, only: wp
  use text, only: to_text, rounded_text, counted
  use failure, only: error_t, fail
  use body_parts, only: field_t, forces_of_parts, end_forces_of_parts
  use boundary, only: prescribed_components
  use vibration, only: fixed_t, trial_amount
  use model, only: model_t
  use rigid_motion, only: move_tool
  use run_state, only: run_t
  use run_log, only: run_log_t, log_line
  use energy_balance, only: add_step
  use unknowns, only: to_components, to_unknowns
  use mumps_library, only: find_mumps
  use sparse_factor, only: sparse_factor_t
  use body_stiffness, only: body_stiffness_t, new_body_stiffness, find_stiffness
  use rigid_supports, only: hold_rigid_motions
  implicit none
  private

  public :: check_static, begin_static, take_static_increment

  integer, parameter :: most_iterations = 16, enough_iterations = 6, most_cuts = 12
  real(wp), parameter :: tolerance = 1.0e-7_wp     !! of the residual, over the forces released
  real(wp), parameter :: short = 1.0e-6_wp         !! of the increment: no time for laws to relax
  real(wp), parameter :: enough = 0.05_wp          !! of the residual left: the factors still serve

contains

  !> Is there all that the static steps of a run take? Known before the run begins.
  subroutine check_static(model, error)
    type(model_t), intent(in) :: model
    type(error_t), allocatable, intent(out) :: error
    type(c_funptr) :: entry

    if (model%step%is_static .or. any(model%later_steps%step%is_static)) &
      call find_mumps(entry, error)
    if (allocated(error)) error%message = "static steps: "//error%message
  end subroutine check_static

  !> Stop the motion, and note the forces that what is gone has left unbalanced.
  subroutine begin_static(model, run)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    integer :: p

    run%balance%stopped = run%balance%stopped + run%balance%kinetic
    run%balance%impulse = -run%balance%momentum_at_start
    if (allocated(run%released)) deallocate (run%released)
    allocate (run%released(size(model%bodies%blank%parts)))
    do p = 1, size(run%released)
      associate (motion => model%bodies%blank%parts(p)%element%motion)
        motion%v = 0.0_wp
        motion%external_force = 0.0_wp
        run%v_before(p)%values = 0.0_wp
        run%released(p)%values = 0.0_wp*motion%x
      end associate
      call model%bodies%blank%parts(p)%element%forget_faces()
    end do
    do p = 1, size(model%bodies%tools)
      model%bodies%tools(p)%force = 0.0_wp
      model%bodies%tools(p)%torque = 0.0_wp
    end do
    run%static_dt = min(model%step%static_increment, model%step%most_increment)
    call unbalanced_forces(model, merge(run%instant%dt, short*run%static_dt, &
                                        run%instant%dt > 0.0_wp), run%released)
  end subroutine begin_static

  !> Forces of the stress as it is. The time is short: laws that know rates relax in it.
  subroutine unbalanced_forces(model, dt, forces)
    type(model_t), intent(inout) :: model
    real(wp), intent(in) :: dt                     !! [time]
    type(field_t), intent(inout) :: forces(:)
    integer :: p

    associate (blank => model%bodies%blank)
      call end_forces_of_parts(blank%parts, blank%law, dt, blank%report, blank%joints)
      do p = 1, size(forces)
        forces(p)%values = blank%parts(p)%element%motion%internal_force
      end do
    end associate
  end subroutine unbalanced_forces

  !> The next increment, cut as often as it takes; time and motion are those of its end.
  subroutine take_static_increment(model, run, log, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(run_log_t), intent(inout) :: log
    type(error_t), allocatable, intent(out) :: error
    type(field_t), allocatable :: start(:)
    character(:), allocatable :: words
    real(wp) :: left, dt
    integer :: cut, n_iterations

    call keep_positions(model, start)
    do cut = 0, most_cuts
      left = run%control%start_time + run%control%duration - run%instant%time
      dt = min(run%static_dt, left)
      if (left - dt < 1.0e-9_wp*run%control%duration) dt = left
      call find_equilibrium(model, run, log, start, dt, n_iterations, words, error)
      if (allocated(error)) return
      if (words == "") exit
      call put_positions(model, start)
      if (cut == most_cuts .or. 0.25_wp*dt < model%step%least_increment) then
        call fail(error, "no equilibrium in the static step at time "// &
                  rounded_text(run%instant%time)//", increment "//rounded_text(dt)//": "//words)
        return
      end if
      call log_line(log, "static     increment "//rounded_text(dt)//" cut to a quarter: "//words)
      run%static_dt = 0.25_wp*dt
    end do
    call commit(model, run, start, dt)
    if (n_iterations <= enough_iterations) &
      run%static_dt = min(1.5_wp*run%static_dt, model%step%most_increment)
  end subroutine take_static_increment

  subroutine keep_positions(model, start)
    type(model_t), intent(in) :: model
    type(field_t), allocatable, intent(out) :: start(:)
    integer :: p

    allocate (start(size(model%bodies%blank%parts)))
    do p = 1, size(start)
      start(p)%values = model%bodies%blank%parts(p)%element%motion%x
    end do
  end subroutine keep_positions

  subroutine put_positions(model, start)
    type(model_t), intent(inout) :: model
    type(field_t), intent(in) :: start(:)
    integer :: p

    do p = 1, size(start)
      associate (motion => model%bodies%blank%parts(p)%element%motion)
        motion%x = start(p)%values
        motion%v = 0.0_wp
      end associate
    end do
  end subroutine put_positions

  !> Newton's method. `words` says why there is no equilibrium, or is empty.
  subroutine find_equilibrium(model, run, log, start, dt, n_iterations, words, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(in) :: run
    type(run_log_t), intent(inout) :: log
    type(field_t), intent(in) :: start(:)
    real(wp), intent(in) :: dt                     !! [time]
    integer, intent(out) :: n_iterations
    character(:), allocatable, intent(out) :: words
    type(error_t), allocatable, intent(out) :: error
    type(body_stiffness_t) :: stiffness
    type(sparse_factor_t) :: factor
    real(wp), allocatable :: residual(:), u(:)
    real(wp) :: level, scaling, norm, before
    logical :: is_stale

    words = ""
    n_iterations = 0
    call find_entries(model, run, log, stiffness, factor, error)
    if (allocated(error)) return
    level = 1.0_wp - (run%instant%time + dt - run%control%start_time)/run%control%duration
    scaling = force_scale(model, run, stiffness)
    allocate (u(stiffness%map%n_free), source=0.0_wp)
    call find_residual(model, run, start, dt, level, stiffness, u, residual, norm)
    is_stale = .true.
    do while (norm > tolerance*scaling)
      if (n_iterations == most_iterations) words = "after "//to_text(n_iterations)// &
        " iterations the residual is "//rounded_text(norm/scaling)//" of the forces released"
      if (.not. norm < huge(norm)) words = "elements turn over or their law fails"
      if (words /= "") return
      n_iterations = n_iterations + 1
      if (is_stale) call renew_factors(model, dt, stiffness, factor, words)
      if (words /= "") return
      before = norm
      call take_newton_step(model, run, start, dt, level, stiffness, factor, u, residual, norm, &
                            error)
      if (allocated(error)) return
      is_stale = norm > enough*before
    end do
    call log_line(log, "static     time "//rounded_text(run%instant%time + dt)//", "// &
                  to_text(n_iterations)//" iterations, residual "//rounded_text(norm/scaling)// &
                  " of the forces released")
  end subroutine find_equilibrium

  !> Unknowns and the entries of the matrix, analysed.
  subroutine find_entries(model, run, log, stiffness, factor, error)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(run_log_t), intent(inout) :: log
    type(body_stiffness_t), intent(out) :: stiffness
    type(sparse_factor_t), intent(inout) :: factor
    type(error_t), allocatable, intent(out) :: error
    type(fixed_t), allocatable :: fixed(:)
    integer :: n_added

    associate (blank => model%bodies%blank)
      fixed = prescribed_components(blank%parts, model%supports, model%i_step)
      call hold_rigid_motions(blank%parts, fixed, n_added)
      if (n_added > 0 .and. run%instant%time <= run%control%start_time) &
        call log_line(log, "static     "//counted(n_added, "component")//" of control points "// &
                      "held against rigid motions that the supports leave")
      call new_body_stiffness(stiffness, blank%parts, blank%seams, fixed, error, blank%joints)
    end associate
    if (.not. allocated(error)) call factor%analyse(stiffness%matrix, .false., error)
  end subroutine find_entries

  !> The largest force released. Where next to nothing is, a force that counts as none anyway.
  real(wp) function force_scale(model, run, stiffness) result(scale)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(body_stiffness_t), intent(in) :: stiffness
    real(wp), parameter :: nothing = 1.0e-6_wp     ! of the bulk modulus, on the area of an element

    scale = maxval(abs(to_unknowns(stiffness%map, listed(stiffness, run%released))))
    scale = max(scale, nothing*model%bodies%blank%law%bulk*shortest_edge(model)**2)
  end function force_scale

  real(wp) function shortest_edge(model) result(edge)
    type(model_t), intent(in) :: model
    integer :: p

    edge = huge(edge)
    do p = 1, size(model%bodies%blank%parts)
      edge = min(edge, model%bodies%blank%parts(p)%element%shortest)
    end do
  end function shortest_edge

  !> The tangent here, factored. `words` says why it cannot be.
  subroutine renew_factors(model, dt, stiffness, factor, words)
    type(model_t), intent(inout) :: model
    real(wp), intent(in) :: dt
    type(body_stiffness_t), intent(inout) :: stiffness
    type(sparse_factor_t), intent(inout) :: factor
    character(:), allocatable, intent(inout) :: words
    type(error_t), allocatable :: error

    associate (blank => model%bodies%blank)
      call find_stiffness(stiffness, blank%parts, blank%law, dt, trial_amount(blank%parts), &
                          blank%joints)
    end associate
    call factor%factorise(stiffness%matrix, error)
    if (allocated(error)) words = error%message
  end subroutine renew_factors

  !> The whole step, though the residual may grow: a sheet that turns is stretched first. A part of
  !! it where elements turn over.
  subroutine take_newton_step(model, run, start, dt, level, stiffness, factor, u, residual, norm, &
                              error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(in) :: run
    type(field_t), intent(in) :: start(:)
    real(wp), intent(in) :: dt, level
    type(body_stiffness_t), intent(in) :: stiffness
    type(sparse_factor_t), intent(inout) :: factor
    real(wp), intent(inout) :: u(:), norm
    real(wp), allocatable, intent(inout) :: residual(:)
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: most_quarters = 4
    real(wp), allocatable :: step(:, :), before(:)
    integer :: i

    step = reshape(residual, [size(residual), 1])
    call factor%solve(step, error)
    if (allocated(error)) return
    before = u
    do i = 0, most_quarters
      u = before + 0.25_wp**i*step(:, 1)
      call find_residual(model, run, start, dt, level, stiffness, u, residual, norm)
      if (norm < huge(norm)) exit
    end do
  end subroutine take_newton_step

  !> What the forces lack to equilibrium after displacements.
  subroutine find_residual(model, run, start, dt, level, stiffness, u, residual, norm)
    type(model_t), intent(inout) :: model
    type(run_t), intent(in) :: run
    type(field_t), intent(in) :: start(:)
    real(wp), intent(in) :: dt, level              !! of the forces released, 1 to 0
    type(body_stiffness_t), intent(in) :: stiffness
    real(wp), intent(in) :: u(:)
    real(wp), allocatable, intent(out) :: residual(:)
    real(wp), intent(out) :: norm                  !! the largest; huge where an element fails
    type(field_t) :: forces(size(start))
    integer :: p

    call move_by(model, start, dt, stiffness, to_components(stiffness%map, u))
    associate (blank => model%bodies%blank)
      call end_forces_of_parts(blank%parts, blank%law, dt, blank%report, blank%joints)
    end associate
    do p = 1, size(forces)
      forces(p)%values = level*run%released(p)%values &
                         - model%bodies%blank%parts(p)%element%motion%internal_force
    end do
    residual = to_unknowns(stiffness%map, listed(stiffness, forces))
    norm = maxval(abs(residual))
    if (model%bodies%blank%report%failed_block < huge(1) .or. .not. sum(abs(residual)) &
        <= huge(norm)) norm = huge(norm)
  end subroutine find_residual

  !> Displacements since the last equilibrium as a motion that trial forces understand.
  subroutine move_by(model, start, dt, stiffness, displacement)
    type(model_t), intent(inout) :: model
    type(field_t), intent(in) :: start(:)
    real(wp), intent(in) :: dt, displacement(:)
    type(body_stiffness_t), intent(in) :: stiffness
    real(wp), allocatable :: u(:, :, :, :)
    integer :: p

    do p = 1, size(start)
      u = field_of(stiffness, p, shape(start(p)%values), displacement)
      model%bodies%blank%parts(p)%element%motion%v = u/dt
    end do
  end subroutine move_by

  !> Components of a patch as a field.
  pure function field_of(stiffness, p, n, components) result(field)
    type(body_stiffness_t), intent(in) :: stiffness
    integer, intent(in) :: p, n(4)
    real(wp), intent(in) :: components(:)
    real(wp) :: field(n(1), n(2), n(3), n(4))
    integer :: c, first

    do c = 1, 3
      first = 3*stiffness%grids(p)%n_before + c
      field(:, :, :, c) = reshape(components(first:first + 3*(product(n(:3)) - 1):3), n(:3))
    end do
  end function field_of

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

  !> Take the equilibrium as the state, with the work of what is released on the way to it.
  subroutine commit(model, run, start, dt)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(field_t), intent(in) :: start(:)
    real(wp), intent(in) :: dt
    real(wp) :: levels
    integer :: p

    levels = 2.0_wp - (2.0_wp*(run%instant%time - run%control%start_time) + dt)/run%control%duration
    associate (blank => model%bodies%blank)
      do p = 1, size(start)
        associate (motion => blank%parts(p)%element%motion)
          motion%x = start(p)%values + dt*motion%v
          run%balance%released = run%balance%released + 0.5_wp*levels &
                                 *sum(run%released(p)%values*(motion%x - start(p)%values))
        end associate
      end do
      call forces_of_parts(blank%parts, blank%seams, blank%law, dt, blank%report, &
                           joints=blank%joints)
      call add_step(run%balance, blank%report)
      do p = 1, size(start)
        blank%parts(p)%element%motion%v = 0.0_wp
        run%v_before(p)%values = 0.0_wp
      end do
    end associate
    run%instant%time = run%instant%time + dt
    do p = 1, size(model%motions)
      call move_tool(model%motions(p), run%instant%time, dt, model%bodies%tools(p))
    end do
    run%instant%dt = 0.0_wp
    run%instant%dt_mean = 0.0_wp
    run%n_steps = run%n_steps + 1
  end subroutine commit

end module static_step
