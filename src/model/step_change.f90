!> From one step of the deck to the next: which effects end, which begin, how tools move from now
!! on. A model of one step never comes here.
module step_change
  use kinds, only: wp
  use timer, only: add_watch
  use rigid_motion, only: start_motion
  use damping, only: damping_t
  use thickness_scaling, only: thickness_scaling_t
  use effect, only: effect_slot_t
  use model, only: model_t
  implicit none
  private

  public :: hold_back_forces, begin_next_step

contains

  !> Take the effects of later steps out of the force stage.
  subroutine hold_back_forces(model)
    type(model_t), intent(inout) :: model
    logical :: is_later(size(model%forces))
    integer :: i

    if (size(model%later_steps) == 0) return
    is_later = [(model%forces(i)%item%first_step > 1, i=1, size(model%forces))]
    model%later_forces = pack_slots(model%forces, is_later)
    model%forces = pack_slots(model%forces, .not. is_later)
  end subroutine hold_back_forces

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
    call change_effects(model, dt, model%forces, model%later_forces)
    call put_scaling_last(model%forces)
    if (size(model%forces) == 0) call clear_forces(model)
    call change_effects(model, dt, model%supports, model%later_supports)
    call put_damping_first(model%supports)
    do i = 1, size(model%later_motions)
      associate (motion => model%later_motions(i))
        if (motion%step /= model%i_step) cycle
        model%motions(motion%tool) = motion
        call start_motion(model%motions(motion%tool), time, model%bodies%tools(motion%tool))
      end associate
    end do
  end subroutine begin_next_step

  !> Forces of the last effects that ended: none that come will replace them.
  subroutine clear_forces(model)
    type(model_t), intent(inout) :: model
    integer :: i

    do i = 1, size(model%bodies%blank%parts)
      model%bodies%blank%parts(i)%motion%external_force = 0.0_wp
    end do
    do i = 1, size(model%bodies%tools)
      model%bodies%tools(i)%force = 0.0_wp
    end do
  end subroutine clear_forces

  !> End effects of a stage and begin others.
  subroutine change_effects(model, dt, active, later)
    type(model_t), intent(inout) :: model
    real(wp), intent(in) :: dt
    type(effect_slot_t), allocatable, intent(inout) :: active(:), later(:)
    logical :: is_over(size(active)), is_new(size(later))
    integer :: i

    is_over = [(active(i)%item%last_step < model%i_step, i=1, size(active))]
    is_new = [(later(i)%item%first_step == model%i_step, i=1, size(later))]
    do i = 1, size(active)
      if (is_over(i)) call active(i)%item%stop(model%bodies, dt)
    end do
    do i = 1, size(later)
      if (.not. is_new(i)) cycle
      call later(i)%item%start(model%step_starts(later(i)%item%given_step))
      call add_watch(model%timer, later(i)%item%name, later(i)%item%watch)
    end do
    model%retired = [model%retired, pack_slots(active, is_over)]
    active = [pack_slots(active, .not. is_over), pack_slots(later, is_new)]
    later = pack_slots(later, .not. is_new)
  end subroutine change_effects

  !> The scaling through the thickness weighs the sum of all other forces.
  subroutine put_scaling_last(forces)
    type(effect_slot_t), allocatable, intent(inout) :: forces(:)
    logical :: is_scaling(size(forces))
    integer :: i

    is_scaling = .false.
    do i = 1, size(forces)
      select type (item => forces(i)%item)
      class is (thickness_scaling_t)
        is_scaling(i) = .true.
      end select
    end do
    forces = [pack_slots(forces, .not. is_scaling), pack_slots(forces, is_scaling)]
  end subroutine put_scaling_last

  !> Supports have the last word on the velocities.
  subroutine put_damping_first(supports)
    type(effect_slot_t), allocatable, intent(inout) :: supports(:)
    logical :: is_damping(size(supports))
    integer :: i

    is_damping = .false.
    do i = 1, size(supports)
      select type (item => supports(i)%item)
      class is (damping_t)
        is_damping(i) = .true.
      end select
    end do
    supports = [pack_slots(supports, is_damping), pack_slots(supports, .not. is_damping)]
  end subroutine put_damping_first

  !> The slots that are chosen, in their order.
  function pack_slots(slots, is_chosen) result(chosen)
    type(effect_slot_t), intent(in) :: slots(:)
    logical, intent(in) :: is_chosen(:)
    type(effect_slot_t), allocatable :: chosen(:)
    integer :: i, n

    allocate (chosen(count(is_chosen)))
    n = 0
    do i = 1, size(slots)
      if (.not. is_chosen(i)) cycle
      n = n + 1
      allocate (chosen(n)%item, source=slots(i)%item)
    end do
  end function pack_slots

end module step_change
