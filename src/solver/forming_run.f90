!> The run: one increment after the other, explicit or static, with what is due in between.
module forming_run
  use kinds, only: wp
  use text, only: string_t, to_text, rounded_text, append_text
  use failure, only: error_t, fail
  use timer, only: add_watch, start_watch, stop_watch, clock_ticks
  use stable_step, only: largest_frequency, viscous_step
  use blank_trim, only: trim_t, loss_t, cut_blank, trim_pairs, slit_words, slit_remedy
  use outline_watch, only: is_gone
  use loads, only: trim_loads
  use boundary, only: leave_cut_points
  use body_parts, only: field_t, forces_of_parts
  use damping, only: relaxation_outcome
  use contact_effect, only: forget_depths, measure_depths, share_pairs, join_pairs
  use row_sharing, only: share_own_rows, join_rows, know_rows, costs_of_rows, look_at_shares
  use effect, only: is_from_outside
  use prescribed_field, only: settle_fields
  use model, only: model_t, begin_next_step, apply_forces, increment_limit
  use frames, only: results_t, write_frame
  use history, only: record_sample
  use run_log, only: run_log_t, log_line, log_progress, log_lines
  use step_control, only: new_step_control, next_step, is_due, is_penetration_due, &
                          schedule_penetration
  use central_difference, only: update_velocities, update_positions, moves_through
  use static_step, only: begin_static, take_static_increment, check_static
  use frequency_step, only: find_modes
  use energy_balance, only: energy_balance_t, start_balance, add_step, take_balance
  use run_frames, only: new_frame, fill_frame, add_frame, release_frames
  use history_columns, only: fill_history_sample
  use run_state, only: run_t
  use run_saver, only: saver_t, take_due_state, keep_verified, save_verified, retry_run
  use run_progress, only: progress_of, begin_pace
  use part_shares, only: share_parts, join_points
  use health, only: check_health, is_failing, check_balance, is_lost, check_pairs, &
                    check_hidden_depths, &
                    added_mass_warning, shear_warning, damage_warning
  implicit none
  private

  public :: run_t, new_run, run_model, take_step, has_ended, enter_next_step, save_failed
  public :: take_balances, add_sample
  public :: effect_lines

  !> Increments before the energy balance may end a run: of a motion that starts from zero velocity
  !! the n-th increment misses the fraction 1/(4 n^2).
  integer, parameter, public :: first_steps = 20

contains

  !> Prepare a run of the model.
  subroutine new_run(model, run)
    type(model_t), intent(inout) :: model
    type(run_t), intent(out) :: run
    integer :: i

    run%control = new_step_control(model)
    call add_watch(model%timer, "blank", run%watch_blank)
    do i = 1, size(model%forces)
      call add_watch(model%timer, model%forces(i)%item%name, model%forces(i)%item%watch)
    end do
    do i = 1, size(model%supports)
      call add_watch(model%timer, model%supports(i)%item%name, model%supports(i)%item%watch)
    end do
    if (allocated(model%ranks)) call add_watch(model%timer, "exchange", model%watch_exchange)
    call add_watch(model%timer, "motion", run%watch_motion)
    if (model%step%is_static .or. any(model%later_steps%step%is_static)) &
      call add_watch(model%timer, "static", run%watch_static)
    call add_watch(model%timer, "output", run%watch_output)
    call start_balance(run%balance, model%bodies%blank)
    associate (parts => model%bodies%blank%parts)
      allocate (run%v_before(size(parts)))
      do i = 1, size(parts)
        run%v_before(i)%values = parts(i)%element%motion%v
        if (model%step%is_static) call parts(i)%element%allow_viscosity(.false.)
      end do
    end associate
    allocate (run%frames(1))
    call new_frame(model, run%frames(1))
  end subroutine new_run

  !> Run through all steps of the deck, or until a signal or the clock says stop. On failure `error`
  !! states what happened, where and when, the last verified state is saved, and the state reached
  !! is written as a frame marked failed.
  subroutine run_model(model, run, results, log, saver, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    type(saver_t), intent(inout) :: saver
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: advice
    logical :: is_end

    run%started = clock_ticks()
    call check_static(model, error)
    if (allocated(error)) return
    call begin_pace(run)
    call log_step(log, model, run%control%start_time)
    if (.not. run%is_resumed) call log_first_trims(log, model)
    if (.not. model%step%is_static) call share_points(model, run, may_move=.true.)
    if (.not. run%is_resumed) call apply_forces(model, run%instant)
    if (model%step%is_static .and. .not. run%is_resumed) call begin_static(model, run)
    do
      call run_increment(model, run, results, log, saver, is_end, error)
      if (.not. allocated(error)) then
        if (is_end .or. allocated(saver%stopped_by)) exit
      else if (run%is_file_lost) then
        return
      else
        if (.not. model%step%is_static) call share_points(model, run, may_move=.false.)
        if (.not. retry_run(saver, model, run, results, log)) exit
      end if
    end do
    if (allocated(error)) then
      call save_verified(saver, model, run, results, advice)
      if (advice /= "") error%message = error%message//new_line("a")//advice
      call look_at_points(model, run, is_everywhere=.false.)
      call save_failed(model, run, results)
    else if (.not. allocated(saver%stopped_by)) then
      call check_relaxation(model, error)
    end if
  end subroutine run_model

  !> Is the step of the deck over?
  pure logical function has_ended(model, run)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run

    has_ended = run%instant%time - run%control%start_time &
                >= run%control%duration*(1.0_wp - 1.0e-12_wp) .or. any_done(model)
  end function has_ended

  !> Start the next step of the deck at the present time, with what it cuts from the blank.
  subroutine enter_next_step(model, run, notes, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(string_t), allocatable, intent(out) :: notes(:)     !! for the log
    type(error_t), allocatable, intent(out) :: error

    if (model%later_steps(1)%step%is_static) &
      call settle_fields(model%supports, model%bodies, run%instant%time)
    ! A static step begins at rest: no way is left for the forces of what ends.
    call begin_next_step(model, run%instant%time, merge(0.0_wp, run%instant%dt, &
                         model%later_steps(1)%step%is_static))
    run%control = new_step_control(model, run%instant%time)
    run%control%largest = run%step_factor*run%control%largest
    run%instant%is_static = model%step%is_static
    call make_cuts(model, run, notes, error)
    if (allocated(error)) return
    if (model%step%is_static) call begin_static(model, run)
  end subroutine enter_next_step

  !> Cut from the blank what the step that begins trims. The energy that its motion had leaves the
  !! balances with it.
  subroutine make_cuts(model, run, notes, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(string_t), allocatable, intent(out) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(energy_balance_t) :: before, after
    type(loss_t) :: loss
    integer :: i

    allocate (notes(0))
    if (.not. any(model%trims%step == model%i_step)) then
      ! Pairs that begin have not followed the trims of earlier steps.
      if (any(model%trims%step > 1 .and. model%trims%step < model%i_step)) call trim_pairs( &
        model%bodies%blank, model%forces, increment_limit(model), first_step=model%i_step)
      return
    end if
    call take_balances(model, run, before)
    do i = 1, size(model%trims)
      if (model%trims(i)%step /= model%i_step) cycle
      call cut_blank(model%trims(i), model%bodies%blank, error, loss)
      if (allocated(error)) then
        error%message = "step "//to_text(model%i_step)//" cannot begin: "// &
                        title_of(model%trims(i))//": "//error%message
        return
      end if
      model%bodies%blank%added_mass = (1.0_wp - loss%share)*model%bodies%blank%added_mass
      loss%mass = loss%mass/model%bodies%blank%mass_factor
      call append_text(notes, trim_line(model%trims(i)%name, loss))
      if (.not. loss%share > 0.0_wp) call append_text(notes, "warning: "// &
        title_of(model%trims(i))//" cuts nothing away: check its curves, KEEP and DIRECTION")
      if (loss%slit%is_there) call append_text(notes, "warning: "//title_of(model%trims(i))// &
        ": "//slit_words(loss%slit)//"; expected "//slit_remedy(loss%slit))
    end do
    call tell_gone(model, notes)
    call limit_increment(model)
    call trim_pairs(model%bodies%blank, model%forces, increment_limit(model))
    call trim_loads(model%bodies%blank, model%forces)
    call trim_loads(model%bodies%blank, model%later_forces)
    call leave_cut_points(model%supports, model%bodies%blank%parts)
    call leave_cut_points(model%later_supports, model%bodies%blank%parts)
    call take_balances(model, run, after)
    run%balance%stopped = run%balance%stopped + before%kinetic - after%kinetic
    run%balance%momentum_at_start = run%balance%momentum_at_start + after%momentum - before%momentum
    run%balance%kinetic = after%kinetic
    run%balance%momentum = after%momentum
    run%control = new_step_control(model, run%instant%time)
    run%control%largest = run%step_factor*run%control%largest
  end subroutine make_cuts

  !> A trim with its place in the deck.
  function title_of(trim) result(title)
    type(trim_t), intent(in) :: trim
    character(:), allocatable :: title

    title = "*TRIM, NAME="//trim%name
    if (allocated(trim%origin%file)) &
      title = trim%origin%file//":"//to_text(trim%origin%line)//": "//title
  end function title_of

  !> What a trim has cut away, for the log.
  function trim_line(name, loss) result(line)
    character(*), intent(in) :: name
    type(loss_t), intent(in) :: loss               !! its mass without what scaling has added
    character(:), allocatable :: line

    line = "trim       "//name//", mass cut away "//rounded_text(loss%mass)//", area "// &
           rounded_text(loss%area)
  end function trim_line

  !> What still acts in a step, and is cut away by its trims.
  subroutine tell_gone(model, notes)
    type(model_t), intent(inout) :: model
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer :: i

    do i = 1, size(model%watched)
      associate (watched => model%watched(i))
        if (watched%is_reported .or. watched%last_step < model%i_step) cycle
        if (.not. is_gone(watched, model%bodies%blank%parts(1)%element)) cycle
        watched%is_reported = .true.
        call append_text(notes, "warning: "//watched%origin%file//":"// &
                         to_text(watched%origin%line)//": "//watched%origin%keyword//": "// &
                         watched%what//", which lies in what *TRIM cuts away")
      end associate
    end do
  end subroutine tell_gone

  !> The stable increment of a sheet that was trimmed, where it is less than before: a longer one
  !! would make contact springs softer.
  subroutine limit_increment(model)
    type(model_t), intent(inout) :: model
    real(wp) :: omega, rate, stable

    associate (blank => model%bodies%blank)
      call largest_frequency(blank%parts, blank%seams, blank%law, omega, rate, blank%joints)
      stable = viscous_step(blank%parts, blank%seams, blank%law, omega)
    end associate
    ! Of the shape at the start, as the other one.
    if (.not. stable*sqrt(rate) < model%stable_step*sqrt(model%rate)) return
    model%stable_step = stable*sqrt(rate/model%rate)
  end subroutine limit_increment

  !> The first half step of an explicit step from rest: an increment without one before it.
  subroutine begin_motion(model, run, rate)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp), intent(in) :: rate         !! as in `take_step`
    real(wp) :: dt
    integer :: p

    dt = 0.0_wp
    do p = 1, size(model%bodies%blank%parts)
      model%bodies%blank%parts(p)%element%motion%external_force = 0.0_wp
    end do
    call apply_forces(model, run%instant)
    call advance_step_size(run, rate, .false., dt)
    call update_velocities(model, run, .false., .false.)
  end subroutine begin_motion

  !> What is due now, then the step; at the end of the last step of the deck no more, nor where the
  !! run stops. A frame is filled at its time and written when the state after it is verified: if it
  !! is not, the result ends with the last verified state.
  subroutine run_increment(model, run, results, log, saver, is_end, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    type(saver_t), intent(inout) :: saver
    logical, intent(out) :: is_end
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: warnings(:)
    real(wp) :: dt, rate
    logical :: is_sample, is_frame, is_balanced, is_looking, is_moving, is_through

    dt = run%instant%dt
    rate = model%rate
    if (run%n_steps > 0) rate = model%bodies%blank%report%largest_rate
    is_end = has_ended(model, run)
    ! A step of frequencies ends at the time and with the state of the one before.
    is_sample = (is_end .or. run%n_steps == 0) .and. &
                (model%step%n_modes == 0 .or. model%i_step == 1)
    is_frame = is_sample
    if (.not. is_end) then
      is_sample = is_sample .or. is_due(run%control, run%control%history, run%instant%time)
      is_frame = is_frame .or. is_due(run%control, run%control%frames, run%instant%time)
    end if
    call take_due_state(saver, model, run, results, is_end)
    call look_at_shares(model, run, is_end, is_moving)
    is_looking = is_frame .or. is_moving
    is_balanced = is_sample .or. saver%is_checking
    is_through = .false.
    if (.not. model%step%is_static) then
      call advance_step_size(run, rate, is_end, dt)
      is_through = moves_through(model) .and. .not. (is_balanced .or. is_looking)
      call update_velocities(model, run, is_balanced, is_through)
    end if
    if (is_balanced) call check_state(model, run, is_sample, error)
    if (.not. allocated(error)) call keep_verified(saver, model, run, results, log, error)
    if (run%is_file_lost .or. allocated(saver%stopped_by)) return
    if (is_sample) call take_sample(model, run, results, log)
    if (allocated(error)) return
    ! Modes, trims and static steps to come look at all points in each process.
    if (is_looking) call look_at_points(model, run, is_moving .and. .not. (is_end .and. &
                                        model%step%n_modes == 0 .and. size(model%later_steps) == 0))
    if (is_frame) then
      call start_watch(model%timer, run%watch_output)
      if (run%n_steps > 0) run%control%frames%done = run%control%frames%done + 1
      call add_frame(model, run)
      call stop_watch(model%timer, run%watch_output)
    end if
    if (is_end) call find_due_modes(model, run, results, log, error)
    if (allocated(error)) return
    if (is_end) then
      if (size(model%later_steps) == 0) then
        call release_frames(model, run, results, run%n_waiting, error)
        return
      end if
      is_end = .false.
      call change_step(model, run, log, rate, error)
      if (allocated(error)) return
    end if
    if (model%step%n_modes > 0) return
    if (is_looking .and. .not. model%step%is_static) call share_points(model, run, is_moving)
    if (model%step%is_static) then
      call start_watch(model%timer, run%watch_static)
      call take_static_increment(model, run, log, error)
      call stop_watch(model%timer, run%watch_static)
      if (.not. allocated(error)) call check_health(model, run%instant, run%control, error)
    else
      call finish_step(model, run, is_through, rate, error)
    end if
    if (allocated(error)) return
    call check_pairs(model%forces, model%bodies%tools, model%bodies%blank%law, &
                     model%step%depth_warning, model%step%depth_limit, run%instant, warnings, error)
    call log_lines(log, warnings)
  end subroutine run_increment

  !> Several processes work their own points from here on.
  subroutine share_points(model, run, may_move)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    logical, intent(in) :: may_move        !! from one to another: all processes know all points

    if (.not. allocated(model%ranks)) return
    associate (blank => model%bodies%blank)
      call share_parts(blank%parts, blank%law%is_serial, model%ranks, may_move, &
                       costs_of_rows(model))
      call share_own_rows(model, run, may_move)
      call share_pairs(model%forces, model%ranks, blank%parts(1)%element%motion%rows, may_move)
    end associate
  end subroutine share_points

  !> The first one of several processes, or each, has all points until they are shared again: to
  !! write results, to cut the sheet, for static increments, to say what failed.
  subroutine look_at_points(model, run, is_everywhere)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    logical, intent(in) :: is_everywhere

    if (.not. allocated(model%ranks)) return
    call know_rows(model, run)
    call join_points(model%bodies%blank%parts, model%ranks, is_everywhere)
    ! Of contact points a frame without their pressure shows nothing.
    call join_pairs(model%forces, is_everywhere, &
                    are_places=.not. (is_everywhere .or. model%output%has_pressure))
    call share_pairs(model%forces)
  end subroutine look_at_points

  !> From one step of the deck to the next.
  subroutine change_step(model, run, log, rate, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(run_log_t), intent(inout) :: log
    real(wp), intent(in) :: rate           !! as in `take_step`
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: notes(:)
    logical :: was_static

    call check_relaxation(model, error)
    if (allocated(error)) return
    was_static = model%step%is_static
    call enter_next_step(model, run, notes, error)
    call log_lines(log, notes)
    if (allocated(error)) return
    if (was_static .and. .not. model%step%is_static) call begin_motion(model, run, rate)
    call begin_pace(run)
    call log_step(log, model, run%instant%time)
  end subroutine change_step

  !> Modes at the end of a step of frequencies.
  subroutine find_due_modes(model, run, results, log, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    type(error_t), allocatable, intent(out) :: error

    if (model%step%n_modes == 0) return
    call start_watch(model%timer, run%watch_static)
    call find_modes(model, run%has_buffer, results, log, run%is_file_lost, error)
    call stop_watch(model%timer, run%watch_static)
  end subroutine find_due_modes

  !> Has an effect reached what the run was for?
  pure logical function any_done(model)
    type(model_t), intent(in) :: model
    integer :: i

    any_done = any([(model%supports(i)%item%is_done, i=1, size(model%supports))])
  end function any_done

  !> A relaxation that did not converge is an error, though its results are valid.
  subroutine check_relaxation(model, error)
    type(model_t), intent(in) :: model
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: words

    words = relaxation_outcome(model%supports)
    if (words /= "" .and. .not. any_done(model)) call fail(error, "dynamic relaxation: "//words)
  end subroutine check_relaxation

  !> One step without any output: what `run_model` repeats, for measuring its cost.
  subroutine take_step(model, run, rate, dt, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    real(wp), intent(inout) :: rate   !! largest |J^-1|^2, the model's at first
    real(wp), intent(inout) :: dt     !! step, 0 at first [time]
    type(error_t), allocatable, intent(out) :: error

    call advance_step_size(run, rate, .false., dt)
    call update_velocities(model, run, .false., moves_through(model))
    call finish_step(model, run, moves_through(model), rate, error)
  end subroutine take_step

  !> From the velocities to the forces at the end of the step.
  subroutine finish_step(model, run, is_through, rate, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    logical, intent(in) :: is_through    !! the control points have moved already
    real(wp), intent(out) :: rate
    type(error_t), allocatable, intent(out) :: error

    call update_positions(model, run, is_through)
    call start_watch(model%timer, run%watch_blank)
    associate (blank => model%bodies%blank)
      call forces_of_parts(blank%parts, blank%seams, blank%law, run%instant%dt, blank%report, &
                           joints=blank%joints)
      call stop_watch(model%timer, run%watch_blank)
      call apply_forces(model, run%instant)
      rate = blank%report%largest_rate
      call add_step(run%balance, blank%report)
      if (is_failing(blank, run%control)) call look_at_points(model, run, is_everywhere=.true.)
      call check_health(model, run%instant, run%control, error)
    end associate
  end subroutine finish_step

  !> Size of the coming step and the mean that its velocities span; the last one repeats.
  subroutine advance_step_size(run, rate, is_end, dt)
    type(run_t), intent(inout) :: run
    real(wp), intent(in) :: rate
    logical, intent(in) :: is_end
    real(wp), intent(inout) :: dt
    real(wp) :: before

    before = dt
    if (.not. is_end) dt = next_step(run%control, run%instant%time, rate)
    run%instant%dt = dt
    run%instant%dt_mean = 0.5_wp*(before + dt)
  end subroutine advance_step_size

  !> Take the balances of this instant and check them: those of the history sample, if one is due,
  !! else they are discarded.
  subroutine check_state(model, run, is_sample, error)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    logical, intent(in) :: is_sample
    type(error_t), allocatable, intent(out) :: error
    type(energy_balance_t) :: balance
    logical :: is_first
    integer :: watch

    watch = merge(run%watch_output, run%watch_state, is_sample)
    call start_watch(model%timer, watch)
    if (is_sample .and. size(model%probes) > 0) call join_rows(model, run)
    call take_balances(model, run, balance)
    is_first = run%n_steps == 0 .or. (run%n_steps <= first_steps .and. .not. model%step%is_static)
    if (allocated(model%ranks) .and. is_lost(model, balance, is_first, run%control)) then
      call join_rows(model, run)
      call join_pairs(model%forces, is_everywhere=.true., are_places=.false.)
    end if
    call check_balance(model, balance, is_first, run%instant, run%control, error)
    if (is_sample) run%balance = balance
    call stop_watch(model%timer, watch)
  end subroutine check_state

  !> Balances of this instant; those of the run stay as they are.
  subroutine take_balances(model, run, balance)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(energy_balance_t), intent(out) :: balance

    balance = run%balance
    call take_balance(balance, model%bodies, run%v_before, model%forces, model%supports, &
                      model%retired)
    ! At the start a touch by round-off has nothing to be measured against.
    if (run%n_steps == 0) balance%error = 0.0_wp
  end subroutine take_balances

  !> Warn once of penetration that no contact point sees, of scaled masses that show, of a point
  !! that has sheared more than the law allows for, and of expected fracture.
  subroutine warn(model, run, log)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(run_log_t), intent(inout) :: log
    type(string_t), allocatable :: warnings(:)

    if (run%has_penetration) then
      call check_hidden_depths(model%forces, run%instant, warnings)
      call log_lines(log, warnings)
    end if
    ! A sheet that is hardly deformed yet has next to no internal energy.
    if (.not. run%has_warned_of_mass .and. run%n_steps > first_steps .and. run%instant%time &
        >= 0.5_wp*(run%control%start_time + run%control%end_time)) &
      call warn_once(added_mass_warning(model%bodies%blank, run%balance, run%instant), &
                     run%has_warned_of_mass)
    if (.not. run%has_warned_of_shear) &
      call warn_once(shear_warning(model%bodies%blank, run%instant, model%ranks), &
                     run%has_warned_of_shear)
    if (.not. run%has_warned_of_damage) &
      call warn_once(damage_warning(model%bodies%blank, run%instant, model%ranks), &
                     run%has_warned_of_damage)

  contains

    subroutine warn_once(warning, has_warned)
      character(*), intent(in) :: warning    ! or empty
      logical, intent(out) :: has_warned

      has_warned = warning /= ""
      if (has_warned) call log_line(log, warning)
    end subroutine warn_once
  end subroutine warn

  !> History sample of this instant, from its balances, and a line in the log.
  subroutine take_sample(model, run, results, log)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log

    call start_watch(model%timer, run%watch_output)
    if (run%n_steps > 0) run%control%history%done = run%control%history%done + 1
    call add_sample(model, run, results)
    call log_progress(log, progress_of(model, run))
    call warn(model, run, log)
    call stop_watch(model%timer, run%watch_output)
  end subroutine take_sample

  !> The sample, and the largest values up to now.
  subroutine add_sample(model, run, results)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    real(wp), parameter :: fraction = 0.01_wp  ! of the time of the run that measuring may take
    real(wp), parameter :: cost = 20.0_wp      ! of a sample, in points of integration and steps
    real(wp) :: elastic, part, lack
    integer :: p, n_points, n_samples

    elastic = model%bodies%blank%joints%energy
    n_points = 0
    do p = 1, size(model%bodies%blank%parts)
      associate (element => model%bodies%blank%parts(p)%element)
        n_points = n_points + element%n_evaluated
        call element%elastic_energy(model%bodies%blank%law, part)
        elastic = elastic + part
      end associate
    end do
    run%has_penetration = is_penetration_due(run%control, run%instant%time)
    if (run%has_penetration) then
      if (allocated(model%ranks)) &
        call join_pairs(model%forces, is_everywhere=.true., are_places=.true.)
      call measure_depths(model%forces, model%bodies%tools, run%instant%time, n_samples)
      call schedule_penetration(run%control, run%instant%time, &
                                run%instant%dt*cost*n_samples/(fraction*n_points))
    end if
    call fill_history_sample(model, run%balance, run%instant, run%n_steps, &
                          velocity_now(model, run), elastic, run%sample)
    call record_sample(results%history, run%sample)
    if (run%n_steps > 0) then   ! a NaN counts as largest
      if (.not. abs(run%balance%alarm) <= run%largest_error) &
        run%largest_error = abs(run%balance%alarm)
      lack = run%balance%error*run%balance%scale
      if (.not. abs(lack) <= abs(run%largest_lack)) then
        run%largest_lack = lack
        run%lack_time = run%instant%time
        run%lack_step = run%n_steps
      end if
      run%peak_energy = max(run%peak_energy, run%balance%scale)
    end if
    run%largest_penetration = max(run%largest_penetration, run%balance%tally%max_penetration)
    call forget_depths(model%forces)
    call forget_depths(model%retired)
  end subroutine add_sample

  !> Velocities at the time of the positions: the mean of both half steps, or those of the start.
  !! Of no patch where there are no history points.
  function velocity_now(model, run) result(v)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    type(field_t), allocatable :: v(:)   !! by patch
    integer :: p

    if (size(model%probes) == 0) then
      allocate (v(0))
      return
    end if
    allocate (v, source=run%v_before)
    if (run%n_steps == 0) return
    do p = 1, size(v)
      v(p)%values = 0.5_wp*(v(p)%values + model%bodies%blank%parts(p)%element%motion%v)
    end do
  end function velocity_now

  !> What was due before, then the state reached, as a frame that says so. A second failure must
  !! not hide the first.
  subroutine save_failed(model, run, results)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    type(error_t), allocatable :: ignored

    ! The end of a step of the deck that failed has a frame already.
    if (run%n_waiting > 0) then
      if (run%frames(run%n_waiting)%time >= run%instant%time) run%n_waiting = run%n_waiting - 1
    end if
    call release_frames(model, run, results, run%n_waiting, ignored)
    call fill_frame(model, run%instant%time, run%frames(1))
    run%frames(1)%is_failed = .true.
    call write_frame(results, run%frames(1), ignored)
  end subroutine save_failed

  !> Name and time of the step that begins, and what acts in it. Of a deck without *STEP the effects
  !! alone.
  subroutine log_step(log, model, time)
    type(run_log_t), intent(inout) :: log
    type(model_t), intent(in) :: model
    real(wp), intent(in) :: time
    integer :: i, k

    if (allocated(model%step%name)) &
      call log_line(log, "step       "//to_text(model%i_step)//" "//model%step%name// &
                    ", from time "//rounded_text(time)//" for "//rounded_text(model%step%duration))
    call log_lines(log, effect_lines(model, "effect     "))
    do i = 1, size(model%motions)
      associate (terms => model%motions(i)%terms)
        if (any([(abs(terms(k)%vector) > 0.0_wp, k=1, size(terms))])) &
          call log_line(log, "motion     "//model%bodies%tools(i)%name)
      end associate
    end do
  end subroutine log_step

  !> What the trims of the first step have cut away: that was done before the run.
  subroutine log_first_trims(log, model)
    type(run_log_t), intent(inout) :: log
    type(model_t), intent(in) :: model
    integer :: i

    do i = 1, size(model%trims)
      if (model%trims(i)%step /= 1) cycle
      call log_line(log, trim_line(model%trims(i)%name, model%trims(i)%loss))
    end do
  end subroutine log_first_trims

  !> What acts in the present step of the deck, a line for each name of an effect: supports have one
  !! effect for each component.
  function effect_lines(model, head) result(lines)
    type(model_t), intent(in) :: model
    character(*), intent(in) :: head               !! what lines begin with
    type(string_t), allocatable :: lines(:)
    character(:), allocatable :: line
    integer :: i, k

    allocate (lines(0))
    if (model%bodies%blank%parts(1)%element%has_viscosity .and. .not. model%step%is_static) &
      call append_text(lines, head//"bulk viscosity")
    if (model%bodies%blank%added_mass > 0.0_wp .and. .not. model%step%is_static) &
      call append_text(lines, head//"mass scaling, added mass "// &
                              rounded_text(model%bodies%blank%added_mass))
    do i = 1, size(model%forces)
      if (model%step%is_static .and. .not. is_from_outside(model%forces(i)%item)) cycle
      call append_text(lines, head//model%forces(i)%item%name)
    end do
    do i = 1, size(model%supports)
      line = head//model%supports(i)%item%name
      if (allocated(model%supports(i)%item%note)) line = line//", "//model%supports(i)%item%note
      if (any([(lines(k)%value == line, k=1, size(lines))])) cycle
      call append_text(lines, line)
    end do
  end function effect_lines

end module forming_run
