!> How many increments the static steps of a deck take, if these grow as they may and none is cut.
module static_increments
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use boundary, only: boundary_t
  use contact_effect, only: contact_effect_t
  use effect, only: add_effect, effect_slot_t
  use model, only: model_t
  use motion_curve, only: start_curve
  use rigid_motion, only: start_motion
  use scene, only: step_spec_t
  use static_step, only: increment_growth, shorten_way
  implicit none
  private

  public :: count_increments

contains

  !> Static steps and their increments; one of frequencies counts as an increment.
  subroutine count_increments(model, n_steps, n_increments)
    type(model_t), intent(in) :: model             !! at its start
    integer, intent(out) :: n_steps
    integer(int64), intent(out) :: n_increments
    real(wp) :: starts(0:size(model%later_steps))
    integer :: i

    n_steps = 0
    n_increments = 0
    starts(0) = 0.0_wp
    call add(model%step, 0)
    do i = 1, size(model%later_steps)
      call add(model%later_steps(i)%step, i)
    end do

  contains

    subroutine add(step, i)
      type(step_spec_t), intent(in) :: step
      integer, intent(in) :: i                     !! steps before it
      type(model_t) :: stage

      if (i < size(model%later_steps)) starts(i + 1) = starts(i) + step%duration
      if (.not. step%is_static) return
      n_steps = n_steps + 1
      if (step%n_modes > 0) then
        n_increments = n_increments + 1
      else
        call set_stage(model, model%i_step + i, starts, stage)
        stage%step = step
        n_increments = n_increments + increments_of(stage, starts(i))
      end if
    end subroutine add
  end subroutine count_increments

  !> Increments of the step of a stage: one after the other as long as they grow, or as ways of
  !! tools and supports shorten them, and the rest in one go.
  integer(int64) function increments_of(stage, start) result(n)
    type(model_t), intent(in) :: stage
    real(wp), intent(in) :: start                  !! of the step [time]
    integer, parameter :: most_followed = 10000
    real(wp), parameter :: round_off = 1.0e-9_wp
    real(wp) :: done, dt, left
    logical :: is_even

    associate (step => stage%step)
      n = 0
      done = 0.0_wp
      dt = min(step%static_increment, step%most_increment)
      do while (done < (1.0_wp - round_off)*step%duration)
        left = step%duration - done
        is_even = size(stage%motions) + size(stage%supports) == 0 .and. dt >= step%most_increment
        dt = min(dt, left)
        if (left - dt < round_off*step%duration) dt = left
        call shorten_way(stage, start + done, dt)
        if (is_even .or. n >= most_followed) then
          n = n + int(min(ceiling_of(left/dt - round_off), 1.0e18_wp), int64)
          return
        end if
        n = n + 1
        done = done + dt
        dt = min(increment_growth*dt, step%most_increment)
      end do
    end associate
  end function increments_of

  !> As `ceiling`, also beyond the largest integer.
  pure real(wp) function ceiling_of(x)
    real(wp), intent(in) :: x

    ceiling_of = aint(x)
    if (ceiling_of < x) ceiling_of = ceiling_of + 1.0_wp
  end function ceiling_of

  !> What `shorten_way` looks at in a step of the deck: ways of tools and supports, and the depth at
  !! which points count as behind a tool. Without contact there is nothing.
  subroutine set_stage(model, i_step, starts, stage)
    type(model_t), intent(in) :: model
    integer, intent(in) :: i_step
    real(wp), intent(in) :: starts(0:)             !! of the steps from that of the model on
    type(model_t), intent(out) :: stage

    allocate (stage%motions(0), stage%supports(0), stage%forces(0))
    call add_pairs(model%forces, i_step, stage)
    call add_pairs(model%later_forces, i_step, stage)
    if (size(stage%forces) == 0) return
    call set_motions(model, i_step, starts, stage)
    call add_supports(model, model%supports, i_step, starts, stage)
    call add_supports(model, model%later_supports, i_step, starts, stage)
  end subroutine set_stage

  !> Of the contact pairs that act in a step their tools and depths.
  subroutine add_pairs(effects, i_step, stage)
    type(effect_slot_t), intent(in) :: effects(:)
    integer, intent(in) :: i_step
    type(model_t), intent(inout) :: stage
    type(contact_effect_t) :: pair
    integer :: i

    do i = 1, size(effects)
      select type (item => effects(i)%item)
      type is (contact_effect_t)
        if (item%first_step > i_step .or. item%last_step < i_step) cycle
        pair%tool = item%tool
        pair%pair%options%max_depth = item%pair%options%max_depth
        call add_effect(stage%forces, pair)
      end select
    end do
  end subroutine add_pairs

  !> Motions of the tools in a step, and the boxes of these.
  subroutine set_motions(model, i_step, starts, stage)
    type(model_t), intent(in) :: model
    integer, intent(in) :: i_step
    real(wp), intent(in) :: starts(0:)
    type(model_t), intent(inout) :: stage
    integer :: i, t

    stage%motions = model%motions
    allocate (stage%bodies%tools(size(stage%motions)))
    do t = 1, size(stage%motions)
      stage%bodies%tools(t)%box = model%bodies%tools(t)%box
    end do
    do i = 1, size(model%later_motions)
      associate (motion => model%later_motions(i))
        if (motion%step > i_step .or. motion%step < stage%motions(motion%tool)%step) cycle
        stage%motions(motion%tool) = motion
        call start_motion(stage%motions(motion%tool), starts(motion%step - model%i_step), &
                          stage%bodies%tools(motion%tool))
      end associate
    end do
  end subroutine set_motions

  !> Supports that move in a step.
  subroutine add_supports(model, effects, i_step, starts, stage)
    type(model_t), intent(in) :: model
    type(effect_slot_t), intent(in) :: effects(:)
    integer, intent(in) :: i_step
    real(wp), intent(in) :: starts(0:)
    type(model_t), intent(inout) :: stage
    type(boundary_t) :: support
    integer :: i

    do i = 1, size(effects)
      select type (item => effects(i)%item)
      type is (boundary_t)
        if (item%first_step > i_step .or. item%last_step < i_step) cycle
        if (.not. abs(item%velocity) > 0.0_wp) cycle
        support%velocity = item%velocity
        support%curve = item%curve
        if (item%given_step > model%i_step) &
          call start_curve(support%curve, starts(item%given_step - model%i_step))
        call add_effect(stage%supports, support)
      end select
    end do
  end subroutine add_supports

end module static_increments
