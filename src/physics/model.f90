!> The model that the solver runs: bodies, motions and the effects that the scene names; and its
!! change from one step of the deck to the next.
module model
  use kinds, only: wp
  use timer, only: timer_t, add_watch, start_watch, stop_watch
  use ranks, only: ranks_t
  use scene, only: step_spec_t, output_spec_t, later_step_t, probe_spec_t
  use blank, only: assembly_t
  use blank_trim, only: trim_t
  use outline_watch, only: watched_t
  use rigid_motion, only: rigid_motion_t, start_motion
  use body_parts, only: share_external_forces
  use effect, only: effect_t, effect_slot_t, instant_t, add_effect, apply_effects, sort_effects, &
                    is_from_outside
  use row_exchange, only: needs_shape, exchange_shape, exchange_rows
  implicit none
  private

  public :: increment_limit, add_support, hold_back_forces, begin_next_step, apply_forces

  !> All that a run needs; built by `model_setup`.
  type, public :: model_t
    type(assembly_t) :: bodies
    type(rigid_motion_t), allocatable :: motions(:)     !! one per tool
    type(rigid_motion_t), allocatable :: later_motions(:)   !! that take their place
    type(effect_slot_t), allocatable :: forces(:)       !! act before the accelerations
    type(effect_slot_t), allocatable :: supports(:)     !! act on the velocities
    type(effect_slot_t), allocatable :: later_forces(:), later_supports(:)   !! not begun
    type(effect_slot_t), allocatable :: retired(:)      !! of earlier steps, for the balances
    type(trim_t), allocatable :: trims(:)               !! cuts of the blank, by step
    type(watched_t), allocatable :: watched(:)          !! what these may cut away
    type(probe_spec_t), allocatable :: probes(:)
    integer :: i_step = 1                               !! step of the deck under way
    real(wp), allocatable :: step_starts(:)             !! times at which steps began, up to it
    type(step_spec_t) :: step                           !! it
    type(output_spec_t) :: output
    type(later_step_t), allocatable :: later_steps(:)   !! that have not begun
    real(wp) :: stable_step = 0.0_wp    !! limit at the start, viscosity included [time]
    real(wp) :: rate = 0.0_wp           !! geometric rate |J^-1|^2 that belongs to it
    real(wp) :: penalty = 0.0_wp        !! greatest sum of s of stiffnesses s m/dt^2 on a face
    real(wp) :: width_ratio = 1.0_wp    !! of what the results tell to what is computed
    type(timer_t) :: timer
    class(ranks_t), allocatable :: ranks !! processes that share the run; absent: one works all
    integer :: watch_exchange = 0        !! of what passes between those of rows
  end type model_t

contains

  !> Largest time increment of the run at its start: safety factor times stable increment [time].
  pure real(wp) function increment_limit(model)
    type(model_t), intent(in) :: model

    increment_limit = model%step%safety*model%stable_step
  end function increment_limit

  !> Append a copy of an effect on the velocities, to those at work or to those of later steps.
  subroutine add_support(model, item)
    type(model_t), intent(inout) :: model
    class(effect_t), intent(in) :: item

    if (item%first_step == 1) call add_effect(model%supports, item)
    if (item%first_step > 1) call add_effect(model%later_supports, item)
  end subroutine add_support

  !> Take the effects of later steps out of the force stage.
  subroutine hold_back_forces(model)
    type(model_t), intent(inout) :: model
    logical :: is_later(size(model%forces))
    integer :: i

    if (size(model%later_steps) == 0) return
    is_later = [(model%forces(i)%item%first_step > 1, i=1, size(model%forces))]
    call move_slots(model%forces, is_later, model%later_forces)
  end subroutine hold_back_forces

  !> Contact and loads, onto external forces of zero. Where processes move but some of the rows of
  !! control points, the internal forces and their report are complete only afterwards.
  subroutine apply_forces(model, instant)
    type(model_t), intent(inout) :: model
    type(instant_t), intent(in) :: instant
    integer :: t, n
    logical :: is_by_rows, is_shaped

    is_by_rows = model%bodies%blank%parts(1)%element%motion%rows%is_shared
    if (size(model%forces) == 0 .and. .not. is_by_rows) return
    do t = 1, size(model%bodies%tools)
      model%bodies%tools(t)%force = 0.0_wp
      model%bodies%tools(t)%torque = 0.0_wp
    end do
    is_shaped = is_by_rows
    if (is_shaped) is_shaped = needs_shape(model%forces)
    if (is_shaped) then
      call start_watch(model%timer, model%watch_exchange)
      call exchange_shape(model%bodies)
      call stop_watch(model%timer, model%watch_exchange)
    end if
    n = count([(is_from_outside(model%forces(t)%item), t=1, size(model%forces))])
    call apply_effects(model%forces(:n), model%timer, model%bodies, instant)
    if (is_by_rows) then
      call start_watch(model%timer, model%watch_exchange)
      call exchange_rows(model%bodies, model%forces, instant)
      call stop_watch(model%timer, model%watch_exchange)
    end if
    call apply_effects(model%forces(n + 1:), model%timer, model%bodies, instant)
    call share_external_forces(model%bodies%blank%parts, model%bodies%blank%seams)
  end subroutine apply_forces

  !> Go on to the next step at this time. Effects that stay keep all that they know; what the others
  !! have done stays in the balances. Forces of effects that end act once more, those of effects
  !! that begin act from the end of the coming time step on.
  subroutine begin_next_step(model, time, dt)
    type(model_t), intent(inout) :: model
    real(wp), intent(in) :: time
    real(wp), intent(in) :: dt           !! the time step to come
    integer :: i

    model%i_step = model%i_step + 1
    model%step_starts = [model%step_starts, time]
    model%step = model%later_steps(1)%step
    model%output = model%later_steps(1)%output
    model%later_steps = model%later_steps(2:)
    do i = 1, size(model%bodies%blank%parts)
      call model%bodies%blank%parts(i)%element%begin_step(model%i_step, time)
      call model%bodies%blank%parts(i)%element%allow_viscosity(.not. model%step%is_static)
    end do
    call change_effects(model%i_step, model%step_starts, dt, model%bodies, model%timer, &
                        model%forces, model%later_forces, model%retired)
    call sort_effects(model%forces)
    if (size(model%forces) == 0) then   ! none that come will replace those of the last ones
      do i = 1, size(model%bodies%blank%parts)
        model%bodies%blank%parts(i)%element%motion%external_force = 0.0_wp
      end do
      do i = 1, size(model%bodies%tools)
        model%bodies%tools(i)%force = 0.0_wp
        model%bodies%tools(i)%torque = 0.0_wp
      end do
    end if
    call change_effects(model%i_step, model%step_starts, dt, model%bodies, model%timer, &
                        model%supports, model%later_supports, model%retired)
    call sort_effects(model%supports)
    do i = 1, size(model%later_motions)
      associate (motion => model%later_motions(i))
        if (motion%step /= model%i_step) cycle
        model%motions(motion%tool) = motion
        call start_motion(model%motions(motion%tool), time, model%bodies%tools(motion%tool))
      end associate
    end do
  end subroutine begin_next_step

  subroutine change_effects(i_step, step_starts, dt, bodies, timer, active, later, retired)
    integer, intent(in) :: i_step
    real(wp), intent(in) :: step_starts(:), dt
    type(assembly_t), intent(inout) :: bodies
    type(timer_t), intent(inout) :: timer
    type(effect_slot_t), allocatable, intent(inout) :: active(:), later(:), retired(:)
    logical :: is_over(size(active)), is_new(size(later))
    integer :: i

    is_over = [(active(i)%item%last_step < i_step, i=1, size(active))]
    is_new = [(later(i)%item%first_step == i_step, i=1, size(later))]
    do i = 1, size(active)
      if (is_over(i)) call active(i)%item%stop(bodies, dt)
    end do
    do i = 1, size(later)
      if (.not. is_new(i)) cycle
      call later(i)%item%start(step_starts(later(i)%item%given_step))
      call add_watch(timer, later(i)%item%name, later(i)%item%watch)
    end do
    call move_slots(active, is_over, retired)
    call move_slots(later, is_new, active)
  end subroutine change_effects

  !> Move the chosen slots, in their order, to the end of another list. Moved, not copied: effects
  !! may hold much, and gfortran 12 does not free what array constructors copy of them.
  subroutine move_slots(from, is_chosen, to)
    type(effect_slot_t), allocatable, intent(inout) :: from(:), to(:)
    logical, intent(in) :: is_chosen(:)
    type(effect_slot_t), allocatable :: kept(:), grown(:)
    integer :: i, n_kept, n_grown

    allocate (kept(count(.not. is_chosen)), grown(size(to) + count(is_chosen)))
    do i = 1, size(to)
      call move_alloc(to(i)%item, grown(i)%item)
    end do
    n_kept = 0
    n_grown = size(to)
    do i = 1, size(from)
      if (is_chosen(i)) then
        n_grown = n_grown + 1
        call move_alloc(from(i)%item, grown(n_grown)%item)
      else
        n_kept = n_kept + 1
        call move_alloc(from(i)%item, kept(n_kept)%item)
      end if
    end do
    call move_alloc(grown, to)
    call move_alloc(kept, from)
  end subroutine move_slots

end module model
