!> What `igaform --check` prints of a model without running it.
module check_report
  use kinds, only: wp
  use text, only: string_t, to_text, rounded_text
  use element, only: element_t
  use blank, only: n_elements_of, mass_of
  use model, only: model_t
  use step_control, only: step_control_t, new_step_control, next_step
  use step_report, only: effect_names
  use run_forecast, only: new_forecast, forecast_lines, outlook_t
  implicit none
  private

  public :: print_check, print_forecast

contains

  !> Counts, mass, stable step and number of steps, to standard output.
  subroutine print_check(model)
    type(model_t), intent(in) :: model
    type(string_t), allocatable :: effects(:)
    integer :: i

    associate (blank => model%bodies%blank)
      print "(a)", "blank            "//blank%name
      do i = 1, size(blank%parts)
        if (size(blank%parts) > 1) print "(a)", "patch            "//blank%parts(i)%element%name
        call print_lines(blank%parts(i)%element)
      end do
      if (size(blank%parts) > 1) print "(a)", "all patches      "// &
        to_text(n_elements_of(blank%parts))//" elements"
      if (blank%seams%n_groups > 0) print "(a)", "seams            "// &
        to_text(size(blank%seams%point))//" control points at "// &
        to_text(blank%seams%n_groups)//" places"
      print "(a)", "mass             "//rounded_text(model%width_ratio*mass_of(blank%parts))
    end associate
    print "(a)", "tools            "//to_text(size(model%bodies%tools))
    if (allocated(model%step%name)) print "(a)", "steps of deck    "// &
      to_text(1 + size(model%later_steps))//", of the first these effects"
    effects = effect_names(model)
    do i = 1, size(effects)
      print "(a)", "effect           "//effects(i)%value
    end do
    print "(a)", "stable step      "//rounded_text(model%stable_step)
    print "(a)", "steps            about "//rounded_text(n_steps_of(model))
  end subroutine print_check

  !> The time that the run should take, to standard output.
  subroutine print_forecast(model, outlook, may_step)
    type(model_t), intent(inout) :: model   !! some steps of it are taken
    type(outlook_t), intent(in) :: outlook
    logical, intent(in) :: may_step         !! unless the law must not be called
    type(string_t), allocatable :: lines(:)
    integer :: i

    if (.not. may_step) then
      print "(a)", "run time         not foretold, for that would call the user's subroutine "// &
        "(--check --probe does)"
      return
    end if
    if (outlook%step >= 0.0_wp) print "(a)", "steps            about "// &
      rounded_text(outlook%growth*n_steps_of(model))//", as the run with fewer elements shows"
    ! Not in a PRINT: a user's law may write as well.
    lines = forecast_lines(new_forecast(model, n_steps_of(model), outlook))
    do i = 1, size(lines)
      print "(a)", lines(i)%value
    end do
    if (outlook%step < 0.0_wp .and. any([model%step%has_relaxation, &
                                         model%later_steps%step%has_relaxation])) &
      print "(a)", "                 less where a relaxation ends before its time limit "// &
        "(--check --probe estimates when)"
  end subroutine print_forecast

  !> Steps of a run if all are as long as the first.
  real(wp) function n_steps_of(model)
    type(model_t), intent(in) :: model
    type(step_control_t) :: control

    control = new_step_control(model)
    n_steps_of = (model%step%end_time + sum(model%later_steps%step%end_time)) &
                 /next_step(control, 0.0_wp, model%rate)
  end function n_steps_of

  subroutine print_lines(element)
    class(element_t), intent(in) :: element
    type(string_t), allocatable :: lines(:)
    integer :: i

    allocate (lines(0))
    call element%describe(lines)
    do i = 1, size(lines)
      print "(a)", lines(i)%value
    end do
  end subroutine print_lines

end module check_report
