!> Static increments: equilibrium by Newton's method, on the elements and the state of the explicit
!! steps. The residual is that of their force routine for the motion since the last equilibrium,
!! which alone is committed; the tangent comes from its differences (`body_stiffness`).
!!
!! What held the blank when the step begins, contact that is gone and inertia, is ramped down over
!! the step. Rigid motions that the supports leave are held at the fewest components that do.
module static_step
  use kinds, only: wp
  use text, only: to_text, rounded_text
  use failure, only: error_t, fail
  use element, only: force_report_t, merge_reports
  use shell_joints, only: add_joint_forces
  use body_parts, only: field_t, forces_of_parts
  use boundary, only: prescribed_components
  use vibration, only: fixed_t
  use model, only: model_t
  use run_state, only: run_t
  use run_log, only: run_log_t, log_line
  use energy_balance, only: add_step
  use unknowns, only: to_components, to_unknowns
  use sparse_factor, only: sparse_factor_t
  use body_stiffness, only: body_stiffness_t, new_body_stiffness, find_stiffness
  use rigid_supports, only: hold_rigid_motions
  implicit none
  private

  public :: begin_static, take_static_increment

  integer, parameter :: most_iterations = 16, enough_iterations = 6, most_cuts = 12
  real(wp), parameter :: tolerance = 1.0e-7_wp     !! of the residual, over the forces released
  real(wp), parameter :: moved = 1.0e-6_wp         !! of an edge, for differences

contains

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
        run%v_before(p)%values = 0.0_wp
        run%released(p)%values = 0.0_wp*motion%x
      end associate
    end do
    run%static_dt = model%step%static_increment
    call unbalanced_forces(model, run%released)
  end subroutine begin_static

  !> Forces of the stress as it is.
  subroutine unbalanced_forces(model, forces)
    type(model_t), intent(inout) :: model
    type(field_t), intent(inout) :: forces(:)
    integer :: p

    associate (blank => model%bodies%blank)
      call forces_of_trial(model, 1.0_wp)
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

  !> Newton's method with a line search. `words` says why there is no equilibrium, or is empty.
  subroutine find_equilibrium(model, run, log, start, dt, n_iterations, words, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(in) :: run
    type(run_log_t), intent(inout) :: log
    type(field_t), intent(in) :: start(:)
    real(wp), intent(in) :: dt                     !! [time]
    integer, intent(out) :: n_iterations
    character(:), allocatable, intent(out) :: words
    type(error_t), allocatable, intent(out) :: error
    type(body_stiffness_t) :: equations
    type(sparse_factor_t) :: factor
    type(fixed_t), allocatable :: fixed(:)
    real(wp), allocatable :: residual(:), step(:, :), u(:)
    real(wp) :: level, scaling, norm, before, amount
    logical :: is_stale

    words = ""
    n_iterations = 0
    associate (blank => model%bodies%blank)
      fixed = prescribed_components(blank%parts, model%supports, model%i_step)
      call hold_rigid_motions(blank%parts, fixed)
      call new_body_stiffness(equations, blank%parts, blank%seams, fixed, error, blank%joints)
      if (allocated(error)) return
      call factor%analyse(equations%matrix, .false., error)
      if (allocated(error)) return
      level = 1.0_wp - (run%instant%time + dt - run%control%start_time)/run%control%duration
      amount = moved*minval_edge(model)
      scaling = max(maxval(abs(to_unknowns(equations%map, listed(equations, run%released)))), &
                    tiny(scaling))
      allocate (u(equations%map%n_free), source=0.0_wp)
      call find_residual(u, residual, norm)
      is_stale = .true.
      do while (norm > tolerance*scaling)
        if (n_iterations == most_iterations) then
          words = "after "//to_text(n_iterations)//" iterations the residual is "// &
                  rounded_text(norm/scaling)//" of the forces released"
          return
        end if
        n_iterations = n_iterations + 1
        if (is_stale) then
          call find_stiffness(equations, blank%parts, blank%law, dt, amount, blank%joints)
          call factor%factorise(equations%matrix, error)
          if (allocated(error)) then
            words = error%message
            deallocate (error)
            return
          end if
        end if
        step = reshape(residual, [size(residual), 1])
        call factor%solve(step, error)
        if (allocated(error)) return
        before = norm
        call search_line(u, step(:, 1), residual, norm)
        is_stale = norm > 0.05_wp*before
        if (.not. norm < huge(norm)) then
          words = "the elements turn over or their law fails"
          return
        end if
      end do
    end associate
    call log_line(log, "static     time "//rounded_text(run%instant%time + dt)//", "// &
                  to_text(n_iterations)//" iterations, residual "//rounded_text(norm/scaling)// &
                  " of the forces released")

  contains

    !> Residual of the unknowns.
    subroutine find_residual(u, residual, norm)
      real(wp), intent(in) :: u(:)
      real(wp), allocatable, intent(out) :: residual(:)
      real(wp), intent(out) :: norm
      type(field_t), allocatable :: forces(:)
      integer :: p

      call move_by(model, start, dt, equations, to_components(equations%map, u))
      allocate (forces(size(start)))
      associate (blank => model%bodies%blank)
        call forces_of_trial(model, dt)
        do p = 1, size(forces)
          forces(p)%values = level*run%released(p)%values &
                             - blank%parts(p)%element%motion%internal_force
        end do
        residual = to_unknowns(equations%map, listed(equations, forces))
        norm = maxval(abs(residual))
        if (blank%report%failed_block < huge(1) .or. .not. norm <= huge(norm)) norm = huge(norm)
      end associate
    end subroutine find_residual

    !> A part of the step after which the residual has hardly a component along it. Its size says
    !! little: a sheet that turns is stretched first.
    subroutine search_line(u, step, residual, norm)
      real(wp), intent(inout) :: u(:)
      real(wp), intent(in) :: step(:)
      real(wp), allocatable, intent(inout) :: residual(:)
      real(wp), intent(out) :: norm
      real(wp), parameter :: least = 0.1_wp
      real(wp) :: length, before, now
      integer :: i

      before = dot_product(step, residual)
      length = 1.0_wp
      do i = 1, 5
        call find_residual(u + length*step, residual, norm)
        now = dot_product(step, residual)
        if (norm < huge(norm)) exit
        if (norm < huge(norm)) then
          length = length*max(least, min(before/(before - now), 0.7_wp))
        else
          length = 0.25_wp*length
        end if
      end do
      u = u + length*step
    end subroutine search_line
  end subroutine find_equilibrium

  real(wp) function minval_edge(model) result(edge)
    type(model_t), intent(in) :: model
    integer :: p

    edge = huge(edge)
    do p = 1, size(model%bodies%blank%parts)
      edge = min(edge, model%bodies%blank%parts(p)%element%shortest)
    end do
  end function minval_edge

  !> Trial forces, not summed at seams: the unknowns do that.
  subroutine forces_of_trial(model, dt)
    type(model_t), intent(inout) :: model
    real(wp), intent(in) :: dt
    type(force_report_t) :: part
    integer :: p

    associate (blank => model%bodies%blank)
      blank%report = force_report_t()
      do p = 1, size(blank%parts)
        call blank%parts(p)%element%trial_forces(blank%law, dt, part)
        call merge_reports(blank%report, part)
        blank%report%failed_block = min(blank%report%failed_block, part%failed_block)
      end do
      call add_joint_forces(blank%joints, blank%parts, dt, .true., blank%report)
    end associate
  end subroutine forces_of_trial

  !> Displacements since the last equilibrium as a motion that trial forces understand.
  subroutine move_by(model, start, dt, equations, displacement)
    type(model_t), intent(inout) :: model
    type(field_t), intent(in) :: start(:)
    real(wp), intent(in) :: dt, displacement(:)
    type(body_stiffness_t), intent(in) :: equations
    real(wp), allocatable :: u(:, :, :, :)
    integer :: p

    do p = 1, size(start)
      u = field_of(equations, p, shape(start(p)%values), displacement)
      associate (element => model%bodies%blank%parts(p)%element, &
                 motion => model%bodies%blank%parts(p)%element%motion)
        motion%v = u/dt
        motion%x = start(p)%values
        if (.not. element%is_surface) motion%x = motion%x + u
      end associate
    end do
  end subroutine move_by

  !> Components of a patch as a field.
  pure function field_of(equations, p, n, components) result(field)
    type(body_stiffness_t), intent(in) :: equations
    integer, intent(in) :: p, n(4)
    real(wp), intent(in) :: components(:)
    real(wp) :: field(n(1), n(2), n(3), n(4))
    integer :: c, first

    do c = 1, 3
      first = 3*equations%grids(p)%n_before + c
      field(:, :, :, c) = reshape(components(first:first + 3*(product(n(:3)) - 1):3), n(:3))
    end do
  end function field_of

  !> Fields of all patches as components.
  pure function listed(equations, fields) result(components)
    type(body_stiffness_t), intent(in) :: equations
    type(field_t), intent(in) :: fields(:)
    real(wp) :: components(equations%map%n_components)
    integer :: p, c, n, first

    do p = 1, size(fields)
      n = size(fields(p)%values)/3
      do c = 1, 3
        first = 3*equations%grids(p)%n_before + c
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
        associate (element => blank%parts(p)%element, motion => blank%parts(p)%element%motion)
          if (element%is_surface) motion%x = start(p)%values + dt*motion%v
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
    run%instant%dt = 0.0_wp
    run%instant%dt_mean = 0.0_wp
    run%n_steps = run%n_steps + 1
  end subroutine commit

end module static_step
