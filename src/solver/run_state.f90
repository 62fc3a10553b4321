!> What changes during a run apart from the model; and the state of model and run between two
!! increments as named numbers, for checkpoints.
module run_state
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use text, only: to_text
  use state_store, only: state_store_t, enter_folder, carry, carry_array
  use effect, only: carry_effects, instant_t
  use model, only: model_t, begin_next_step
  use step_control, only: step_control_t, schedule_t, new_step_control
  use energy_balance, only: energy_balance_t
  use timer, only: clock_ticks, ticks_to_seconds
  use body_parts, only: field_t, carry_fields, set_inertia
  use failure, only: error_t
  use outline, only: region_t
  use blank_trim, only: trim_pairs
  use loads, only: trim_loads
  use boundary, only: leave_cut_points
  use shell_joints, only: carry_joints
  use frames, only: frame_t
  use history, only: history_sample_t
  implicit none
  private

  public :: carry_run, carry_outlines, unpack_run, wall_seconds

  !> Everything that changes during a run apart from the bodies.
  type, public :: run_t
    type(step_control_t) :: control
    type(energy_balance_t) :: balance
    type(instant_t) :: instant
    integer(int64) :: n_steps = 0
    integer(int64) :: started = 0            !! clock at the start, or when it was taken up again
    real(wp) :: seconds_before = 0.0_wp      !! from the start up to what it was taken up from
    real(wp) :: pace_seconds = 0.0_wp        !! `wall_seconds` from which the log measures the pace
    integer(int64) :: pace_steps = 0         !! `n_steps` then
    logical :: is_resumed = .false.          !! it continues from a checkpoint
    logical :: is_file_lost = .false.        !! the results could not be written
    integer :: n_waiting = 0                 !! frames that are filled and not written yet
    logical :: has_penetration = .false.          !! the last sample has measured them
    logical :: has_warned_of_mass = .false.  !! that scaled masses matter
    logical :: has_warned_of_shear = .false. !! too large for the law
    logical :: has_warned_of_damage = .false.     !! that fracture is expected
    logical :: has_warned_of_buckling = .false.   !! in static steps
    real(wp) :: largest_error = 0.0_wp       !! of the energy balance, by the largest energy so far
    real(wp) :: largest_lack = 0.0_wp        !! of the energy balance, in the history [energy]
    real(wp) :: lack_time = 0.0_wp           !! of it
    integer(int64) :: lack_step = 0
    real(wp) :: peak_energy = 0.0_wp         !! largest in the history, see `take_balance`
    real(wp) :: largest_penetration = 0.0_wp
    real(wp) :: step_factor = 1.0_wp         !! on the time step; below 1 after a retry
    integer :: watch_motion = 0, watch_blank = 0, watch_output = 0, watch_state = 0
    integer :: watch_static = 0
    real(wp) :: static_dt = 0.0_wp           !! next increment of a static step
    real(wp) :: spring_scale = 1.0_wp        !! on the springs that hold a part in its springback,
                                             !! 0: none do
    logical :: has_buffer = .false.          !! of BLAS, see `sparse_factor_t`
    type(field_t), allocatable :: released(:)  !! forces that a static step ramps down, by patch
    type(field_t), allocatable :: pace(:)      !! velocities of its last increment, by patch
    type(field_t), allocatable :: origin(:)    !! control points when it began, by patch
    integer(int64) :: shared_at = 0            !! step at which processes shared the work last
    integer(int64) :: look_at_shares = 0       !! step at which they look whether it is even
    integer :: share_every = 0                 !! increments between these, on request; 0: ever more
    type(field_t), allocatable :: v_before(:)  !! by patch; kept for steps that take a balance
    type(frame_t), allocatable :: frames(:)    !! first those that wait, then room for more
    type(history_sample_t) :: sample
  end type run_t

contains

  !> How long the run has taken up to now, in all parts that led here [s].
  real(wp) function wall_seconds(run)
    type(run_t), intent(in) :: run

    wall_seconds = run%seconds_before + ticks_to_seconds(clock_ticks() - run%started)
  end function wall_seconds

  !> Take the state into a model that was built from the same deck. `store%reason` states what
  !! does not fit; where that is the step of the deck, the model stays as it is.
  subroutine unpack_run(model, run, store)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(state_store_t), intent(inout) :: store   !! its position moves on

    store%is_taking = .true.
    call enter_folder(store, "run")
    call go_to_deck_step(model, run, store)
    if (store%reason /= "") return
    call carry_outlines(model, store)
    if (store%reason /= "") return
    run%control = new_step_control(model, model%step_starts(model%i_step))
    call carry_run(model, run, store)
    run%is_resumed = .true.
  end subroutine unpack_run

  !> Put the outlines of the blank, or cut it again as it was cut: the state of its points has
  !! another shape then.
  subroutine carry_outlines(model, store)
    type(model_t), intent(inout) :: model
    type(state_store_t), intent(inout) :: store
    type(region_t), allocatable :: regions(:)
    type(error_t), allocatable :: error
    integer :: p, n, n_before, r

    call enter_folder(store, "outline")
    call carry(store, "stable_step", model%stable_step)
    do p = 1, size(model%bodies%blank%parts)
      associate (element => model%bodies%blank%parts(p)%element)
        call enter_folder(store, "outline/"//to_text(p))
        n_before = 0
        if (allocated(element%regions)) n_before = size(element%regions)
        n = n_before
        call carry(store, "n", n)
        if (n < n_before) store%reason = "the sheet was not cut yet"
        if (store%reason /= "") return
        allocate (regions(n))
        if (n_before > 0) regions(:n_before) = element%regions
        call carry_regions(store, regions)
        do r = n_before + 1, n   ! one after the other, as they were cut
          call element%trim(regions(r:r), model%bodies%blank%law, error)
          if (allocated(error)) store%reason = error%message
          if (store%reason /= "") return
        end do
        if (n > n_before) then
          call set_inertia(model%bodies%blank%parts, model%bodies%blank%seams)
          call trim_pairs(model%bodies%blank, model%forces)
          call trim_loads(model%bodies%blank, model%forces)
          call trim_loads(model%bodies%blank, model%later_forces)
          call leave_cut_points(model%supports, model%bodies%blank%parts)
          call leave_cut_points(model%later_supports, model%bodies%blank%parts)
        end if
        deallocate (regions)
      end associate
    end do
  end subroutine carry_outlines

  !> Corners of all polygons.
  subroutine carry_regions(store, regions)
    type(state_store_t), intent(inout) :: store
    type(region_t), intent(inout) :: regions(:)
    integer :: r, i, n, n_corners

    do r = 1, size(regions)
      n = 0
      if (allocated(regions(r)%polygons)) n = size(regions(r)%polygons)
      call carry(store, "n_"//to_text(r), n)
      if (.not. allocated(regions(r)%polygons)) allocate (regions(r)%polygons(n))
      call carry(store, "is_outside_"//to_text(r), regions(r)%is_outside)
      do i = 1, n
        associate (polygon => regions(r)%polygons(i), name => to_text(r)//"_"//to_text(i))
          n_corners = 0
          if (allocated(polygon%corners)) n_corners = size(polygon%corners, 2)
          call carry(store, "n_corners_"//name, n_corners)
          if (.not. allocated(polygon%corners)) allocate (polygon%corners(2, n_corners), &
                                                          source=0.0_wp)
          call carry_array(store, "corners_"//name, 2*n_corners, polygon%corners)
        end associate
      end do
    end do
  end subroutine carry_regions

  !> Put or take all but the step of the deck.
  subroutine carry_run(model, run, store)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(state_store_t), intent(inout) :: store
    integer :: p, t

    call enter_folder(store, "run")
    call carry(store, "time", run%instant%time)
    call carry(store, "dt", run%instant%dt)
    call carry(store, "dt_mean", run%instant%dt_mean)
    call carry(store, "n_steps", run%n_steps)
    call carry(store, "step_factor", run%step_factor)
    call carry(store, "largest_error", run%largest_error)
    call carry(store, "largest_lack", run%largest_lack)
    call carry(store, "lack_time", run%lack_time)
    call carry(store, "lack_step", run%lack_step)
    call carry(store, "peak_energy", run%peak_energy)
    call carry(store, "largest_penetration", run%largest_penetration)
    call carry(store, "largest_rate", model%bodies%blank%report%largest_rate)
    call carry(store, "internal_work", model%bodies%blank%report%internal_work)
    run%instant%is_static = model%step%is_static
    call carry_control(run%control, run%instant%time, store)
    call carry_balance(run%balance, store)
    if (model%step%is_static) call carry_static(model, run, store)
    do p = 1, size(model%bodies%blank%parts)
      call enter_folder(store, "blank/"//to_text(p))
      call model%bodies%blank%parts(p)%element%carry(store)
    end do
    call enter_folder(store, "blank/joints")
    call carry_joints(model%bodies%blank%joints, store)
    do t = 1, size(model%bodies%tools)
      call enter_folder(store, "tools/"//to_text(t))
      associate (tool => model%bodies%tools(t), motion => model%motions(t))
        call carry_array(store, "displacement", 3, tool%displacement)
        call carry_array(store, "velocity", 3, tool%velocity)
        call carry_array(store, "force", 3, tool%force)
        call carry_array(store, "torque", 3, tool%torque)
        call carry_array(store, "before", 3, motion%displacement)
        call carry(store, "is_turning", tool%is_turning)
        call carry_array(store, "reference", 3, tool%reference)
        call carry_array(store, "rotation", 9, tool%rotation)
        call carry_array(store, "rotation_rate", 9, tool%rotation_rate)
        call carry_array(store, "rotation_before", 9, motion%rotation)
      end associate
    end do
    call carry_effects(model%forces, "forces", store)
    call carry_effects(model%supports, "supports", store)
    call carry_effects(model%retired, "retired", store)
  end subroutine carry_run

  !> Begin the steps of the deck that had begun; what they find is replaced afterwards.
  subroutine go_to_deck_step(model, run, store)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(state_store_t), intent(inout) :: store
    real(wp), allocatable :: starts(:)
    integer :: i_step

    i_step = 0
    call carry(store, "deck_step", i_step)
    if (i_step < model%i_step .or. i_step > model%i_step + size(model%later_steps)) then
      if (store%reason == "") store%reason = "it is of step "//to_text(i_step)//" of the deck"
      return
    end if
    allocate (starts(i_step), source=0.0_wp)
    call carry_array(store, "deck_step_starts", i_step, starts)
    do while (model%i_step < i_step)
      call begin_next_step(model, starts(model%i_step + 1), 0.0_wp)
      run%control = new_step_control(model, starts(model%i_step))
    end do
  end subroutine go_to_deck_step

  !> Where the end time or the number of outputs is another than it was, outputs whose time is past
  !! count as done.
  subroutine carry_control(control, time, store)
    type(step_control_t), intent(inout) :: control
    real(wp), intent(in) :: time
    type(state_store_t), intent(inout) :: store
    real(wp) :: counts(4), end_time
    logical :: is_same_end

    call carry(store, "largest_step", control%largest)
    call carry(store, "penetration_due", control%penetration_due)
    end_time = control%end_time
    call carry(store, "end_time", end_time)
    is_same_end = abs(end_time - control%end_time) <= 0.0_wp
    counts = real([control%frames%n, control%frames%done, control%history%n, &
                   control%history%done], wp)
    call carry_array(store, "schedules", 4, counts)
    call set_done(control%frames, nint(counts(1:2)))
    call set_done(control%history, nint(counts(3:4)))

  contains

    subroutine set_done(schedule, before)
      type(schedule_t), intent(inout) :: schedule
      integer, intent(in) :: before(2)   ! number and those done

      if (is_same_end .and. schedule%n == before(1)) then
        schedule%done = before(2)
      else
        schedule%done = max(0, ceiling((time - control%start_time) &
                                       /max(control%duration, tiny(1.0_wp))*schedule%n &
                                       - 1.0e-9_wp) - 1)
      end if
    end subroutine set_done
  end subroutine carry_control

  !> What a static step knows of its start.
  subroutine carry_static(model, run, store)
    type(model_t), intent(in) :: model
    type(run_t), intent(inout) :: run
    type(state_store_t), intent(inout) :: store
    integer :: p

    call carry(store, "static_dt", run%static_dt)
    call carry(store, "spring_scale", run%spring_scale)
    if (.not. allocated(run%released)) then
      allocate (run%released(size(model%bodies%blank%parts)))
      do p = 1, size(run%released)
        run%released(p)%values = 0.0_wp*model%bodies%blank%parts(p)%element%motion%x
        run%v_before(p)%values = run%released(p)%values
      end do
      run%pace = run%v_before
      run%origin = run%v_before
    end if
    call carry_fields(store, "released", run%released)
    call carry_fields(store, "pace", run%pace)
    call carry_fields(store, "origin", run%origin)
  end subroutine carry_static

  subroutine carry_balance(balance, store)
    type(energy_balance_t), intent(inout) :: balance
    type(state_store_t), intent(inout) :: store

    call carry(store, "internal", balance%internal)
    call carry(store, "viscous", balance%viscous)
    call carry(store, "released", balance%released)
    call carry(store, "stopped", balance%stopped)
    call carry_array(store, "impulse", 3, balance%impulse)
    call carry(store, "kinetic_at_start", balance%kinetic_at_start)
    call carry_array(store, "momentum_at_start", 3, balance%momentum_at_start)
    call carry(store, "kinetic", balance%kinetic)
    call carry_array(store, "momentum", 3, balance%momentum)
    call carry(store, "error", balance%error)
    call carry(store, "alarm", balance%alarm)
    call carry(store, "reference", balance%reference)
    call carry(store, "momentum_reference", balance%momentum_reference)
    call carry(store, "momentum_error", balance%momentum_error)
  end subroutine carry_balance

end module run_state
