!> Motion of the blank and its tools in a step.
module motion_update
  use kinds, only: wp
  use timer, only: start_watch, stop_watch
  use effect, only: apply_effects
  use model, only: model_t
  use rigid_motion, only: move_tool
  use energy_balance, only: add_impulse
  use central_difference, only: advance, advance_velocities, advance_positions
  use run_data, only: run_t
  implicit none
  private

  public :: update_velocities, update_positions

  integer, parameter :: parallel_size = 4500   !! fewer numbers are not worth waking threads for

contains

  !> Half-step velocities, then the components that supports own.
  subroutine update_velocities(model, run, is_balanced, is_through)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    logical, intent(in) :: is_balanced    !! a balance needs the velocities before as well
    logical, intent(in) :: is_through     !! control points go on at once: nothing looks between
    integer :: i

    call start_watch(model%timer, run%watch_motion)
    do i = 1, size(model%bodies%blank%parts)
      associate (body => model%bodies%blank%parts(i)%element, &
                 motion => model%bodies%blank%parts(i)%element%motion)
        if (is_balanced) call copy_rows(shape(motion%v), motion%v, run%v_before(i)%values)
        if (is_through) then
          call advance(shape(body%inertia), run%instant%dt_mean, run%instant%dt, body%inertia, &
                       size(model%forces) > 0, motion%external_force, motion%internal_force, &
                       motion%v, motion%x)
        else
          call advance_velocities(shape(body%inertia), run%instant%dt_mean, body%inertia, &
                                  motion%external_force, motion%internal_force, motion%v)
        end if
      end associate
    end do
    call add_impulse(run%balance, model%forces, run%instant%dt_mean)
    call stop_watch(model%timer, run%watch_motion)
    call apply_effects(model%supports, model%timer, model%bodies, run%instant)
    call add_impulse(run%balance, model%supports, run%instant%dt_mean)
  end subroutine update_velocities

  !> A copy by the threads that share the rows along axis 2 where the points move.
  subroutine copy_rows(n, field, copy)
    integer, intent(in) :: n(4)
    real(wp), intent(in) :: field(n(1), n(2), n(3), n(4))
    real(wp), intent(out) :: copy(n(1), n(2), n(3), n(4))
    integer :: j

    !$omp parallel do schedule(static) if (product(n) > parallel_size)
    do j = 1, n(2)
      copy(:, j, :, :) = field(:, j, :, :)
    end do
    !$omp end parallel do
  end subroutine copy_rows

  !> Control points, if they have not gone on already, and tools to the end of the step.
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
          call advance_positions(shape(body%inertia), run%instant%dt, motion%v, &
                                 size(model%forces) > 0, motion%x, motion%external_force)
        end associate
      end do
    end if
    do i = 1, size(model%motions)
      call move_tool(model%motions(i), run%instant%time, run%instant%dt, model%bodies%tools(i))
    end do
    call stop_watch(model%timer, run%watch_motion)
  end subroutine update_positions

end module motion_update
