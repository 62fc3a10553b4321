!> How far tools and the blank may go in a run, as the deck says.
module travel
  use kinds, only: wp
  use scene, only: scene_t
  implicit none
  private

  public :: stroke_bounds, blank_reach, force_motion, is_formed_by_strokes, time_from

  real(wp), parameter :: unlimited = 1.0e30_wp   !! [length]
  real(wp), parameter :: lever = 2.0_wp          !! motion of a blank over that of a tool

contains

  !> How far all but one tool may carry the blank along a direction: a guess, twice their strokes,
  !! for a flange that is bent up moves farther than what bends it. Loads count as without limit.
  pure real(wp) function blank_reach(scene, except, direction) result(reach)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: except
    real(wp), intent(in) :: direction(3)      !! unit vector
    real(wp) :: speed
    integer :: i

    reach = 0.0_wp
    if (size(scene%loads) > 0) reach = unlimited
    speed = 0.0_wp
    do i = 1, size(scene%initial_velocities)
      if (any(abs(scene%initial_velocities(i)%omega) > 0.0_wp)) reach = unlimited
      speed = speed + norm2(scene%initial_velocities(i)%velocity)
    end do
    do i = 1, size(scene%boundaries)
      speed = max(speed, norm2(scene%boundaries(i)%velocity) &
                  *maxval(abs(curve_values(scene, scene%boundaries(i)%curve))))
    end do
    reach = reach + speed*time_from(scene, 1)
    do i = 1, size(scene%tools)
      if (i /= except) reach = reach + lever*farthest(stroke_bounds(scene, i), direction)
    end do
  end function blank_reach

  !> Largest displacement along a direction within bounds.
  pure real(wp) function farthest(way, direction)
    real(wp), intent(in) :: way(3, 2), direction(3)

    farthest = sum(max(way(:, 1)*direction, way(:, 2)*direction))
  end function farthest

  !> Bounds of the displacement of a tool, shape (3, 2): the ways of all its motions add up. A
  !! force may move it any way along its direction.
  pure function stroke_bounds(scene, tool) result(way)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: tool
    real(wp) :: way(3, 2), factor(2)
    integer :: i

    way = 0.0_wp
    do i = 1, size(scene%motions)
      associate (motion => scene%motions(i))
        if (motion%tool /= tool) cycle
        if (motion%is_rotation) then
          way = reshape([-1, -1, -1, 1, 1, 1], [3, 2])*unlimited
          return
        end if
        associate (values => curve_values(scene, motion%curve))
          factor = [min(0.0_wp, minval(values)), max(0.0_wp, maxval(values))]
        end associate
        if (motion%is_force) then
          factor = factor*unlimited/norm2(motion%vector)
        else if (.not. motion%is_displacement) then
          factor = factor*time_from(scene, motion%step)
        end if
        way(:, 1) = way(:, 1) + min(motion%vector*factor(1), motion%vector*factor(2))
        way(:, 2) = way(:, 2) + max(motion%vector*factor(1), motion%vector*factor(2))
      end associate
    end do
  end function stroke_bounds

  !> Time from the start of a step to the end of the run.
  pure real(wp) function time_from(scene, step) result(time)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step

    time = sum(scene%later_steps(max(1, step - 1):)%step%duration)
    if (step == 1) time = time + scene%step%duration
  end function time_from

  !> Values of a curve, 1 where there is none.
  pure function curve_values(scene, curve) result(values)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: curve
    real(wp), allocatable :: values(:)

    values = [1.0_wp]
    if (curve > 0) values = scene%curves(curve)%values
  end function curve_values

  !> Number of the first motion by which a force moves a tool; 0: none does.
  pure integer function force_motion(scene, tool) result(i)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: tool

    i = findloc(scene%motions%tool == tool .and. scene%motions%is_force, .true., dim=1)
  end function force_motion

  !> Does nothing but the motion of tools form the blank? Of two tools the one that a force moves
  !! may form it; of more it is a holder, if it is the only one.
  pure logical function is_formed_by_strokes(scene)
    type(scene_t), intent(in) :: scene
    integer :: i

    i = findloc(scene%motions%is_force, .true., dim=1)
    is_formed_by_strokes = size(scene%loads) + size(scene%initial_velocities) == 0
    if (i > 0) is_formed_by_strokes = is_formed_by_strokes .and. size(scene%tools) > 2 .and. &
      .not. any(scene%motions%is_force .and. scene%motions%tool /= scene%motions(i)%tool)
    do i = 1, size(scene%boundaries)
      is_formed_by_strokes = is_formed_by_strokes .and. &
                             .not. any(abs(scene%boundaries(i)%velocity) > 0.0_wp)
    end do
  end function is_formed_by_strokes

end module travel
