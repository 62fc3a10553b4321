!> Motion of a rigid tool: translations and a rotation along curves, or what a force makes of it.
module rigid_motion
  use kinds, only: wp
  use tool, only: tool_t, rotation_about
  use motion_curve, only: curve_t, curve_value, curve_integral, start_curve
  implicit none
  private

  public :: rigid_motion_t, motion_term_t, move_tool, start_motion, factor_of, longest_way

  !> A vector times a curve, which gives velocities or displacements, or a turn about the vector.
  type :: motion_term_t
    logical :: is_displacement = .false.
    logical :: is_rotation = .false.          !! the length of the vector is an angle [radians]
    real(wp) :: vector(3) = 0.0_wp
    real(wp) :: point(3) = 0.0_wp             !! of the axis, which the translations move [length]
    type(curve_t) :: curve
    real(wp) :: done = 0.0_wp                 !! integral of the curve before the motion
  end type motion_term_t

  !> The terms add up. A tool without any stands still.
  type :: rigid_motion_t
    type(motion_term_t), allocatable :: terms(:)
    logical :: is_driven = .false.            !! a force moves the tool and sets its velocity
    integer :: tool = 0                       !! whose motion it is
    integer :: step = 1                       !! of the deck, with which it begins
    real(wp) :: displacement(3) = 0.0_wp      !! of the tool before it
    real(wp) :: rotation(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])   !! likewise
  end type rigid_motion_t

contains

  !> Begin a motion at the start of a later step, from where the tool is then.
  pure subroutine start_motion(motion, time, tool)
    type(rigid_motion_t), intent(inout) :: motion
    real(wp), intent(in) :: time
    type(tool_t), intent(in) :: tool
    integer :: i

    motion%displacement = tool%displacement
    motion%rotation = tool%rotation
    do i = 1, size(motion%terms)
      associate (term => motion%terms(i))
        call start_curve(term%curve, time)
        if (.not. term%is_displacement) term%done = curve_integral(term%curve, time)
      end associate
    end do
  end subroutine start_motion

  !> What the vector of a term is multiplied by at `time` of the run.
  pure real(wp) function factor_of(term, time) result(factor)
    type(motion_term_t), intent(in) :: term
    real(wp), intent(in) :: time

    if (term%is_displacement) then
      factor = curve_value(term%curve, time)
    else
      factor = curve_integral(term%curve, time) - term%done
    end if
  end function factor_of

  !> Bound of the way of any point of a tool, which no force moves, from one time to another.
  pure real(wp) function longest_way(motion, tool, from, to) result(way)
    type(rigid_motion_t), intent(in) :: motion
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: from, to
    real(wp) :: part
    integer :: i

    way = 0.0_wp
    do i = 1, size(motion%terms)
      associate (term => motion%terms(i))
        part = abs(factor_of(term, to) - factor_of(term, from))*norm2(term%vector)
        if (term%is_rotation) part = part*norm2(max(abs(tool%box(:, 1) - term%point), &
                                                    abs(tool%box(:, 2) - term%point)))
        way = way + part
      end associate
    end do
  end function longest_way

  !> Put the tool where it is at `time`; its velocity is the mean over the step that led there.
  pure subroutine move_tool(motion, time, dt, tool)
    type(rigid_motion_t), intent(in) :: motion
    real(wp), intent(in) :: time, dt
    type(tool_t), intent(inout) :: tool
    real(wp) :: displacement(3), rotation(3, 3), way(3), factor
    integer :: i

    tool%rotation_rate = 0.0_wp
    if (motion%is_driven) then
      tool%displacement = tool%displacement + dt*tool%velocity
      return
    end if
    displacement = motion%displacement
    rotation = motion%rotation
    way = 0.0_wp
    do i = 1, size(motion%terms)
      associate (term => motion%terms(i))
        factor = factor_of(term, time)
        if (term%is_rotation) then
          tool%is_turning = .true.
          tool%reference = matmul(term%point - motion%displacement, motion%rotation)
          rotation = rotation_about(term%vector/max(norm2(term%vector), tiny(1.0_wp)), &
                                    factor*norm2(term%vector))
          displacement = term%point + matmul(rotation, motion%displacement - term%point)
          rotation = matmul(rotation, motion%rotation)
        else
          way = way + factor*term%vector
        end if
      end associate
    end do
    displacement = displacement + way
    if (tool%is_turning) then
      if (dt > 0.0_wp) tool%rotation_rate = (rotation - tool%rotation)/dt
      tool%rotation = rotation
    end if
    tool%velocity = 0.0_wp
    if (dt > 0.0_wp) tool%velocity = (displacement - tool%displacement)/dt
    tool%displacement = displacement
  end subroutine move_tool

end module rigid_motion
