!> The state of a run between two steps as named numbers, for checkpoints.
module run_state
  use kinds, only: wp
  use text, only: to_text
  use state_store, only: state_store_t, empty_store, enter_folder, put, take, put_array, take_array
  use patch_body, only: patch_body_t
  use effect, only: pack_effects, unpack_effects
  use model, only: model_t
  use step_control, only: step_control_t, schedule_t, new_step_control
  use step_change, only: begin_next_step
  use energy_balance, only: energy_balance_t
  use run_data, only: run_t
  implicit none
  private

  public :: pack_run, unpack_run

contains

  !> All that steers the run: taken at the start of a step, when the forces are those of the present
  !! positions and the velocities lie half a step back.
  subroutine pack_run(model, run, store)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(state_store_t), intent(inout) :: store   !! what it held before is forgotten
    integer :: p, t

    call empty_store(store)
    call enter_folder(store, "run")
    call put_array(store, "instant", 3, [run%instant%time, run%instant%dt, run%instant%dt_mean])
    call put(store, "n_steps", run%n_steps)
    call put(store, "step_factor", run%step_factor)
    call put(store, "deck_step", model%i_step)
    call put_array(store, "deck_step_starts", size(model%step_starts), model%step_starts)
    call put(store, "largest_error", run%largest_error)
    call put(store, "largest_penetration", run%largest_penetration)
    call put(store, "largest_rate", model%bodies%blank%report%largest_rate)
    call put(store, "internal_work", model%bodies%blank%report%internal_work)
    call pack_control(run%control, store)
    call pack_balance(run%balance, store)
    do p = 1, size(model%bodies%blank%parts)
      call enter_folder(store, "blank/"//to_text(p))
      call pack_body(model%bodies%blank%parts(p), store)
    end do
    do t = 1, size(model%bodies%tools)
      call enter_folder(store, "tools/"//to_text(t))
      associate (tool => model%bodies%tools(t))
        call put_array(store, "motion", 12, [tool%displacement, tool%velocity, tool%force, &
                                             tool%torque])
        call put_array(store, "before", 3, model%motions(t)%displacement)
        call put(store, "is_turning", tool%is_turning)
        call put_array(store, "reference", 3, tool%reference)
        call put_array(store, "rotation", 9, tool%rotation)
        call put_array(store, "rotation_rate", 9, tool%rotation_rate)
        call put_array(store, "rotation_before", 9, model%motions(t)%rotation)
      end associate
    end do
    call pack_effects(model%forces, "forces", store)
    call pack_effects(model%supports, "supports", store)
    call pack_effects(model%retired, "retired", store)
  end subroutine pack_run

  !> Take it back into a model that was built from the same deck. What does not fit is told by
  !! `store%fault`; where that is the step of the deck, the model stays as it is.
  subroutine unpack_run(model, run, store)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(state_store_t), intent(inout) :: store
    real(wp) :: times(3), motion(12)
    integer :: p, t

    call enter_folder(store, "run")
    call go_to_deck_step(model, run, store)
    if (store%fault /= "") return
    times = 0.0_wp
    call take_array(store, "instant", 3, times)
    run%instant%time = times(1)
    run%instant%dt = times(2)
    run%instant%dt_mean = times(3)
    call take(store, "n_steps", run%n_steps)
    call take(store, "step_factor", run%step_factor)
    call take(store, "largest_error", run%largest_error)
    call take(store, "largest_penetration", run%largest_penetration)
    call take(store, "largest_rate", model%bodies%blank%report%largest_rate)
    call take(store, "internal_work", model%bodies%blank%report%internal_work)
    call unpack_control(run%control, run%instant%time, store)
    call unpack_balance(run%balance, store)
    do p = 1, size(model%bodies%blank%parts)
      call enter_folder(store, "blank/"//to_text(p))
      call unpack_body(model%bodies%blank%parts(p), store)
    end do
    do t = 1, size(model%bodies%tools)
      call enter_folder(store, "tools/"//to_text(t))
      motion = 0.0_wp
      call take_array(store, "motion", 12, motion)
      associate (tool => model%bodies%tools(t))
        tool%displacement = motion(1:3)
        tool%velocity = motion(4:6)
        tool%force = motion(7:9)
        tool%torque = motion(10:12)
        call take(store, "is_turning", tool%is_turning)
        call take_array(store, "reference", 3, tool%reference)
        call take_array(store, "rotation", 9, tool%rotation)
        call take_array(store, "rotation_rate", 9, tool%rotation_rate)
        call take_array(store, "rotation_before", 9, model%motions(t)%rotation)
      end associate
      call take_array(store, "before", 3, model%motions(t)%displacement)
    end do
    call unpack_effects(model%forces, "forces", store)
    call unpack_effects(model%supports, "supports", store)
    call unpack_effects(model%retired, "retired", store)
    run%is_resumed = .true.
  end subroutine unpack_run

  !> Begin the steps of the deck that had begun; what they find is replaced afterwards.
  subroutine go_to_deck_step(model, run, store)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(state_store_t), intent(inout) :: store
    real(wp), allocatable :: starts(:)
    integer :: i_step

    i_step = 0
    call take(store, "deck_step", i_step)
    if (i_step < model%i_step .or. i_step > model%i_step + size(model%later_steps)) then
      if (store%fault == "") store%fault = "it is of step "//to_text(i_step)//" of the deck"
      return
    end if
    allocate (starts(i_step), source=0.0_wp)
    call take_array(store, "deck_step_starts", i_step, starts)
    do while (model%i_step < i_step)
      call begin_next_step(model, starts(model%i_step + 1), 0.0_wp)
      run%control = new_step_control(model%step, model%output, model%stable_step, model%rate, &
                                     starts(model%i_step))
    end do
  end subroutine go_to_deck_step

  !> Motion, forces and points of a patch.
  subroutine pack_body(body, store)
    type(patch_body_t), intent(in) :: body
    type(state_store_t), intent(inout) :: store

    associate (motion => body%motion, patch => body%patch)
      call put_array(store, "x", size(motion%x), motion%x)
      call put_array(store, "v", size(motion%v), motion%v)
      call put_array(store, "internal_force", size(motion%internal_force), motion%internal_force)
      call put_array(store, "external_force", size(motion%external_force), motion%external_force)
      call put_array(store, "stress", size(patch%stress), patch%stress)
      call put_array(store, "state", size(patch%state), patch%state)
      call put_array(store, "push", size(patch%push), patch%push)
      call put(store, "time", patch%time)
      call put(store, "increment", patch%increment)
    end associate
  end subroutine pack_body

  subroutine unpack_body(body, store)
    type(patch_body_t), intent(inout) :: body
    type(state_store_t), intent(inout) :: store

    associate (motion => body%motion, patch => body%patch)
      call take_array(store, "x", size(motion%x), motion%x)
      call take_array(store, "v", size(motion%v), motion%v)
      call take_array(store, "internal_force", size(motion%internal_force), motion%internal_force)
      call take_array(store, "external_force", size(motion%external_force), motion%external_force)
      call take_array(store, "stress", size(patch%stress), patch%stress)
      call take_array(store, "state", size(patch%state), patch%state)
      call take_array(store, "push", size(patch%push), patch%push)
      call take(store, "time", patch%time)
      call take(store, "increment", patch%increment)
    end associate
  end subroutine unpack_body

  subroutine pack_control(control, store)
    type(step_control_t), intent(in) :: control
    type(state_store_t), intent(inout) :: store

    call put(store, "largest_step", control%largest)
    call put(store, "end_time", control%end_time)
    call put_array(store, "schedules", 4, real([control%frames%n, control%frames%done, &
                                                control%history%n, control%history%done], wp))
  end subroutine pack_control

  !> Where the end time or the number of outputs is another than it was, outputs whose time is past
  !! count as done.
  subroutine unpack_control(control, time, store)
    type(step_control_t), intent(inout) :: control
    real(wp), intent(in) :: time
    type(state_store_t), intent(inout) :: store
    real(wp) :: counts(4), end_time
    logical :: is_same_end

    call take(store, "largest_step", control%largest)
    end_time = control%end_time
    call take(store, "end_time", end_time)
    is_same_end = abs(end_time - control%end_time) <= 0.0_wp
    counts = 0.0_wp
    call take_array(store, "schedules", 4, counts)
    call set_done(control%frames, nint(counts(1:2)))
    call set_done(control%history, nint(counts(3:4)))

  contains

    subroutine set_done(schedule, before)
      type(schedule_t), intent(inout) :: schedule
      integer, intent(in) :: before(2)   ! number and those done

      if (is_same_end .and. schedule%n == before(1)) then
        schedule%done = before(2)
      else
        schedule%done = max(0, ceiling((time - control%start_time)/control%duration*schedule%n &
                                       - 1.0e-9_wp) - 1)
      end if
    end subroutine set_done
  end subroutine unpack_control

  subroutine pack_balance(balance, store)
    type(energy_balance_t), intent(in) :: balance
    type(state_store_t), intent(inout) :: store

    associate (b => balance)
      call put_array(store, "balance", 17, [b%internal, b%viscous, b%impulse, b%kinetic_at_start, &
                                            b%momentum_at_start, b%kinetic, b%momentum, b%error, &
                                            b%alarm, b%reference, b%momentum_reference])
      call put(store, "momentum_error", b%momentum_error)
    end associate
  end subroutine pack_balance

  subroutine unpack_balance(balance, store)
    type(energy_balance_t), intent(inout) :: balance
    type(state_store_t), intent(inout) :: store
    real(wp) :: values(17)

    values = 0.0_wp
    call take_array(store, "balance", 17, values)
    call take(store, "momentum_error", balance%momentum_error)
    associate (b => balance)
      b%internal = values(1)
      b%viscous = values(2)
      b%impulse = values(3:5)
      b%kinetic_at_start = values(6)
      b%momentum_at_start = values(7:9)
      b%kinetic = values(10)
      b%momentum = values(11:13)
      b%error = values(14)
      b%alarm = values(15)
      b%reference = values(16)
      b%momentum_reference = values(17)
    end associate
  end subroutine unpack_balance

end module run_state
