!> What the log tells of a step of the deck.
module step_report
  use kinds, only: wp
  use text, only: string_t, to_text, rounded_text, append_text
  use run_log, only: run_log_t, log_line
  use rigid_motion, only: rigid_motion_t
  use model, only: model_t
  implicit none
  private

  public :: log_step, effect_names

contains

  !> Name and time of the step that begins, and what acts in it. Of a deck without *STEP the effects
  !! alone.
  subroutine log_step(log, model, time)
    type(run_log_t), intent(inout) :: log
    type(model_t), intent(in) :: model
    real(wp), intent(in) :: time
    type(string_t), allocatable :: names(:)
    integer :: i

    if (allocated(model%step%name)) &
      call log_line(log, "step       "//to_text(model%i_step)//" "//model%step%name// &
                    ", from time "//rounded_text(time)//" for "//rounded_text(model%step%duration))
    names = effect_names(model)
    do i = 1, size(names)
      call log_line(log, "effect     "//names(i)%value)
    end do
    do i = 1, size(model%motions)
      if (.not. is_moving(model%motions(i))) cycle
      call log_line(log, "motion     "//model%bodies%tools(i)%name)
    end do
  end subroutine log_step

  !> What acts in the step of the deck under way.
  function effect_names(model) result(names)
    type(model_t), intent(in) :: model
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(0))
    if (model%bodies%blank%parts(1)%element%has_viscosity) &
      call append_text(names, "bulk viscosity")
    if (model%bodies%blank%added_mass > 0.0_wp) &
      call append_text(names, "mass scaling, added mass "// &
                              rounded_text(model%bodies%blank%added_mass))
    do i = 1, size(model%forces)
      call append_text(names, model%forces(i)%item%name)
    end do
    do i = 1, size(model%supports)
      call append_text(names, model%supports(i)%item%name)
    end do
  end function effect_names

  pure logical function is_moving(motion)
    type(rigid_motion_t), intent(in) :: motion
    integer :: i

    is_moving = any([(any(abs(motion%terms(i)%vector) > 0.0_wp), i=1, size(motion%terms))])
  end function is_moving

end module step_report
