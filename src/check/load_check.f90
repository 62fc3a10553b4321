!> Forces and loads whose amplitude comes to nothing: zero throughout, full only after the step, or
!! gone for most of it.
module load_check
  use kinds, only: wp
  use text, only: rounded_text, to_text
  use input_errors, only: origin_t, error_list_t, add_warning
  use scene, only: scene_t, curve_spec_t
  use motion_curve, only: curve_t, curve_value
  implicit none
  private

  public :: check_loads

  integer, parameter :: n_samples = 400          !! of the time in which a load acts
  real(wp), parameter :: enough = 0.5_wp         !! part of the greatest value, to be reached
  real(wp), parameter :: nothing = 1.0e-3_wp     !! part of the greatest value that counts as zero
  real(wp), parameter :: most_idle = 0.5_wp      !! part of a step in which a tool may go unpressed

contains

  !> Warn of each force on a tool and each pressure, traction or gravity of this kind.
  subroutine check_loads(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i, last

    do i = 1, size(scene%motions)
      associate (motion => scene%motions(i))
        if (motion%is_force .and. motion%curve > 0) &
          call check_amplitude(scene, motion%origin, "a force on the tool '"// &
                               scene%tools(motion%tool)%name//"'", scene%curves(motion%curve), &
                               [motion%step, motion%step], .true., errors)
      end associate
    end do
    do i = 1, size(scene%loads)
      associate (load => scene%loads(i))
        last = min(load%last_step, 1 + size(scene%later_steps))
        if (load%curve > 0 .and. last >= load%first_step) &
          call check_amplitude(scene, load%origin, "a load", scene%curves(load%curve), &
                               [load%first_step, last], .false., errors)
      end associate
    end do
  end subroutine check_loads

  !> Warn of what an amplitude makes of a load in the steps from the first to the last one.
  subroutine check_amplitude(scene, origin, what, given, steps, is_lasting, errors)
    type(scene_t), intent(in) :: scene
    type(origin_t), intent(in) :: origin
    character(*), intent(in) :: what
    type(curve_spec_t), intent(in) :: given
    integer, intent(in) :: steps(2)
    logical, intent(in) :: is_lasting         !! the load is to act most of the time
    type(error_list_t), intent(inout) :: errors
    type(curve_t) :: curve
    real(wp) :: values(0:n_samples), start, finish, highest, reached
    character(:), allocatable :: which
    integer :: i

    start = start_of(scene, steps(1))
    finish = start_of(scene, steps(2) + 1)
    curve%times = given%times
    curve%values = given%values
    curve%is_smooth = given%is_smooth
    if (.not. given%is_total) curve%start = start
    values = [(abs(curve_value(curve, start + i*(finish - start)/n_samples)), i=0, n_samples)]
    highest = maxval(abs(given%values))
    reached = maxval(values)
    which = what//" whose amplitude '"//given%name//"' "
    if (.not. highest > 0.0_wp) then
      call add_warning(errors, origin, which//"is zero at all times", "an amplitude with other "// &
                       "values, such as 1")
    else if (reached < enough*highest) then
      call add_warning(errors, origin, which//"reaches no more than "//rounded_text(reached)// &
                       " of "//rounded_text(highest)//" before the end of step "// &
                       to_text(steps(2))//" at "//rounded_text(finish), &
                       "times of the amplitude that lie in the step")
    else if (is_lasting .and. count(values <= nothing*highest) > most_idle*n_samples) then
      call add_warning(errors, origin, which//"is zero for "// &
                       to_text(nint(100.0_wp*count(values <= nothing*highest)/n_samples))// &
                       " % of step "//to_text(steps(1)), "a force that acts throughout the step")
    end if
  end subroutine check_amplitude

  !> When a step begins; of the step after the last one, when the run ends.
  pure real(wp) function start_of(scene, step) result(time)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    integer :: i

    time = 0.0_wp
    if (step > 1) time = scene%step%duration
    do i = 2, step - 1
      time = time + scene%later_steps(i - 1)%step%duration
    end do
  end function start_of

end module load_check
