!> Motion of a rigid tool: a translation along its curve.
module rigid_motion
  use kinds, only: wp
  use tool, only: tool_t
  use motion_curve, only: curve_t, curve_value, curve_integral, start_curve
  implicit none
  private

  public :: rigid_motion_t, move_tool, start_motion

  !> A vector times a curve, which gives velocities or displacements.
  type :: rigid_motion_t
    logical :: is_displacement = .false.
    real(wp) :: vector(3) = 0.0_wp
    type(curve_t) :: curve
    integer :: tool = 0                       !! whose motion it is
    integer :: step = 1                       !! of the deck, with which it begins
    real(wp) :: displacement(3) = 0.0_wp      !! of the tool before it
    real(wp) :: done = 0.0_wp                 !! integral of the curve before it
  end type rigid_motion_t

contains

  !> Begin a motion at the start of a later step, from where the tool is then.
  pure subroutine start_motion(motion, time, tool)
    type(rigid_motion_t), intent(inout) :: motion
    real(wp), intent(in) :: time
    type(tool_t), intent(in) :: tool

    call start_curve(motion%curve, time)
    motion%displacement = tool%displacement
    if (.not. motion%is_displacement) motion%done = curve_integral(motion%curve, time)
  end subroutine start_motion

  !> Put the tool where it is at `time`; its velocity is the mean over the step that led there.
  pure subroutine move_tool(motion, time, dt, tool)
    type(rigid_motion_t), intent(in) :: motion
    real(wp), intent(in) :: time, dt
    type(tool_t), intent(inout) :: tool
    real(wp) :: displacement(3)

    if (motion%is_displacement) then
      displacement = motion%displacement + motion%vector*curve_value(motion%curve, time)
    else
      displacement = motion%displacement &
                     + motion%vector*(curve_integral(motion%curve, time) - motion%done)
    end if
    tool%velocity = 0.0_wp
    if (dt > 0.0_wp) tool%velocity = (displacement - tool%displacement)/dt
    tool%displacement = displacement
  end subroutine move_tool

end module rigid_motion
