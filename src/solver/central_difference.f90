!> Central differences with half-step velocities on a lumped mass.
!!
!! Threads share the rows along axis 2, as they do the tiles of elements: what one has in its cache
!! it needs again. Where nothing needs the velocities in between, both advance in one pass.
module central_difference
  use kinds, only: wp
  use timer, only: start_watch, stop_watch
  use effect, only: apply_effects, any_by_row, sum_effects
  use body_parts, only: has_edges, lead_edges
  use model, only: model_t
  use row_shares, only: row_shares_t
  use rigid_motion, only: move_tool
  use energy_balance, only: add_impulse
  use run_state, only: run_t
  implicit none
  private

  public :: advance, update_velocities, update_positions, moves_through

  integer, parameter :: parallel_size = 1500   !! fewer control points are not worth waking threads

contains

  !> Velocities to the next half step, v + dt_mean (f_ext - f_int)/m, and positions to the end of
  !! the step. Forces from outside, where there are any, are set to zero when the positions have
  !! moved: those of the next step are added to them.
  subroutine advance(n, dt_mean, dt, mass, is_loaded, external_force, internal_force, v, x, rows)
    integer, intent(in) :: n(3)                   !! control points along each axis
    real(wp), intent(in) :: dt_mean               !! mean of the steps before and after; 0: the
                                                  !! velocities stay
    real(wp), intent(in) :: dt                    !! step; 0: the positions stay
    real(wp), intent(in) :: mass(n(1), n(2), n(3))
    logical, intent(in) :: is_loaded              !! are there forces from outside?
    real(wp), intent(inout) :: external_force(n(1), n(2), n(3), 3)
    real(wp), intent(in) :: internal_force(n(1), n(2), n(3), 3)
    real(wp), intent(inout) :: v(n(1), n(2), n(3), 3), x(n(1), n(2), n(3), 3)
    type(row_shares_t), intent(in), optional :: rows   !! that move here; absent: all
    integer :: first, last, j

    first = 1
    last = n(2)
    if (present(rows)) then
      first = max(first, rows%first)
      last = min(last, rows%last)
    end if
    !$omp parallel do schedule(static) if (product(n) > parallel_size)
    do j = first, last
      if (dt_mean > 0.0_wp) call push_row(n, j, dt_mean, mass, external_force, internal_force, v)
      if (.not. dt > 0.0_wp) cycle
      call move_row(n, j, dt, v, x)
      if (is_loaded) external_force(:, j, :, :) = 0.0_wp
    end do
    !$omp end parallel do
  end subroutine advance

  pure subroutine push_row(n, j, dt_mean, mass, external_force, internal_force, v)
    integer, intent(in) :: n(3), j
    real(wp), intent(in) :: dt_mean, mass(n(1), n(2), n(3))
    real(wp), intent(in), dimension(n(1), n(2), n(3), 3) :: external_force, internal_force
    real(wp), intent(inout) :: v(n(1), n(2), n(3), 3)
    real(wp) :: factor
    integer :: i, k

    do k = 1, n(3)
      ! Components written out: a loop over them around this one would keep it from vectorising.
      !$omp simd private(factor)
      do i = 1, n(1)
        factor = dt_mean/mass(i, j, k)
        v(i, j, k, 1) = v(i, j, k, 1) &
                        + factor*(external_force(i, j, k, 1) - internal_force(i, j, k, 1))
        v(i, j, k, 2) = v(i, j, k, 2) &
                        + factor*(external_force(i, j, k, 2) - internal_force(i, j, k, 2))
        v(i, j, k, 3) = v(i, j, k, 3) &
                        + factor*(external_force(i, j, k, 3) - internal_force(i, j, k, 3))
      end do
    end do
  end subroutine push_row

  pure subroutine move_row(n, j, dt, v, x)
    integer, intent(in) :: n(3), j
    real(wp), intent(in) :: dt, v(n(1), n(2), n(3), 3)
    real(wp), intent(inout) :: x(n(1), n(2), n(3), 3)
    integer :: i, k, c

    do c = 1, 3
      do k = 1, n(3)
        !$omp simd
        do i = 1, n(1)
          x(i, j, k, c) = x(i, j, k, c) + dt*v(i, j, k, c)
        end do
      end do
    end do
  end subroutine move_row

  !> May control points move as soon as their velocities are known?
  pure logical function moves_through(model)
    type(model_t), intent(in) :: model

    moves_through = size(model%supports) == 0 .and. .not. has_edges(model%bodies%blank%parts)
  end function moves_through

  !> Half-step velocities, then the components with boundary conditions.
  subroutine update_velocities(model, run, is_balanced, is_through)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    logical, intent(in) :: is_balanced    !! a balance needs the velocities before as well
    logical, intent(in) :: is_through     !! control points move at once: nothing is due between
    integer :: i
    logical :: is_summed

    call start_watch(model%timer, run%watch_motion)
    do i = 1, size(model%bodies%blank%parts)
      associate (body => model%bodies%blank%parts(i)%element, &
                 motion => model%bodies%blank%parts(i)%element%motion)
        if (is_balanced) call copy_rows(shape(motion%v), motion%v, run%v_before(i)%values)
        call advance(shape(body%inertia), run%instant%dt_mean, merge(run%instant%dt, 0.0_wp, &
                     is_through), body%inertia, size(model%forces) > 0, motion%external_force, &
                     motion%internal_force, motion%v, motion%x, motion%rows)
      end associate
    end do
    call add_impulse(run%balance, model%forces, run%instant%dt_mean)
    call stop_watch(model%timer, run%watch_motion)
    call apply_effects(model%supports, model%timer, model%bodies, run%instant)
    associate (rows => model%bodies%blank%parts(1)%element%motion%rows)
      is_summed = rows%is_shared
      if (is_summed) is_summed = any_by_row(model%supports)
      if (is_summed) then
        call start_watch(model%timer, model%watch_exchange)
        call sum_effects(model%supports, rows, run%instant, model%bodies%blank%traffic)
        call stop_watch(model%timer, model%watch_exchange)
      end if
    end associate
    call lead_edges(model%bodies%blank%parts)
    call add_impulse(run%balance, model%supports, run%instant%dt_mean)
  end subroutine update_velocities

  !> A copy by the same threads, in the same rows, as move the points.
  subroutine copy_rows(n, field, copy)
    integer, intent(in) :: n(4)
    real(wp), intent(in) :: field(n(1), n(2), n(3), n(4))
    real(wp), intent(out) :: copy(n(1), n(2), n(3), n(4))
    integer :: j

    !$omp parallel do schedule(static) if (product(n(:3)) > parallel_size)
    do j = 1, n(2)
      copy(:, j, :, :) = field(:, j, :, :)
    end do
    !$omp end parallel do
  end subroutine copy_rows

  !> Control points, if they have not moved already, and tools to the end of the step.
  subroutine update_positions(model, run, is_through)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    logical, intent(in) :: is_through
    integer :: i

    call start_watch(model%timer, run%watch_motion)
    run%instant%time = run%instant%time + run%instant%dt
    run%n_steps = run%n_steps + 1
    if (.not. is_through) then
      do i = 1, size(model%bodies%blank%parts)
        associate (body => model%bodies%blank%parts(i)%element, &
                   motion => model%bodies%blank%parts(i)%element%motion)
          call advance(shape(body%inertia), 0.0_wp, run%instant%dt, body%inertia, &
                       size(model%forces) > 0, motion%external_force, motion%internal_force, &
                       motion%v, motion%x, motion%rows)
        end associate
      end do
    end if
    do i = 1, size(model%motions)
      call move_tool(model%motions(i), run%instant%time, run%instant%dt, model%bodies%tools(i))
    end do
    call stop_watch(model%timer, run%watch_motion)
  end subroutine update_positions

end module central_difference
