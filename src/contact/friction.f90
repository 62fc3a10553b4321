!> Coulomb friction of secondary points on a tool: a tangential spring that slips.
!!
!! All in the tool's frame, so that motion along with the tool is no sliding. While a point touches,
!! a spring of the point's penalty stiffness k is stretched by its tangential motion. Beyond the
!! limit mu times the normal force N the stretch returns to mu N/k, and what it gives up is the slip
!! (P. Wriggers, Computational Contact Mechanics, 2nd ed., Springer 2006, sec. 5.2 and 9.3). The
!! stretch is turned with the tangent plane, which keeps its energy.
!!
!! The first step of a touch counts in part: its spring is stretched by the motion from where the
!! point met the tool, so that a point that slides fast is held back by mu N from the start.
!!
!! The work of slip is taken with the mean of the forces before and after, as the balance of energy
!! counts the work of all forces.
module friction
  use kinds, only: wp
  implicit none
  private

  public :: friction_t, new_friction, apply_friction

  !> Friction of one contact; arrays by secondary point, shape (n_points).
  type :: friction_t
    real(wp) :: coefficient = 0.0_wp         !! mu
    real(wp) :: energy = 0.0_wp              !! work of slip since the start [energy]
    logical, allocatable :: is_touching(:)   !! at the last call
    real(wp), allocatable :: position(:, :)     !! then, in the tool's frame, (n_points, 3) [length]
    real(wp), allocatable :: stretch(:, :)   !! of the spring, tangential, (n_points, 3) [length]
  end type friction_t

contains

  !> No point touches yet.
  pure subroutine new_friction(friction, n_points, coefficient)
    type(friction_t), intent(out) :: friction
    integer, intent(in) :: n_points
    real(wp), intent(in) :: coefficient

    friction%coefficient = coefficient
    allocate (friction%is_touching(n_points), source=.false.)
    allocate (friction%position(n_points, 3), friction%stretch(n_points, 3), source=0.0_wp)
  end subroutine new_friction

  !> Add the friction of the points `first` to `last` to the normal forces of this call.
  pure subroutine apply_friction(friction, n_points, first, last, stiffness, x, motions, force, &
                                 reaction, stored, lost)
    type(friction_t), intent(inout) :: friction
    integer, intent(in) :: n_points, first, last
    real(wp), intent(in) :: stiffness(n_points)        !! of the penalty [force/length]
    real(wp), intent(in) :: x(first:last, 3)           !! points in the tool's frame now [length]
    real(wp), intent(in) :: motions(first:last, 3)     !! against the tool in the last step [length]
    real(wp), intent(inout) :: force(n_points, 3)      !! on the points: normal in, all out [force]
    real(wp), intent(inout) :: reaction(3)             !! on the tool, added to [force]
    real(wp), intent(inout) :: stored                  !! energy of the springs, added to [energy]
    real(wp), intent(inout) :: lost                    !! work of slip of this call, added to
    real(wp) :: pushed, part, moved(3), drag(3)
    integer :: p

    do p = first, last
      pushed = norm2(force(p, :))
      if (pushed > 0.0_wp) then
        if (friction%is_touching(p)) then
          moved = x(p, :) - friction%position(p, :)
          part = 1.0_wp
        else
          part = touching_part(pushed, stiffness(p), &
                               -dot_product(motions(p, :), force(p, :))/pushed)
          moved = part*motions(p, :)
        end if
        call return_stretch(friction%stretch(p, :), moved, force(p, :)/pushed, stiffness(p), &
                            friction%coefficient*pushed, drag, lost)
        ! The balance of energy counts the work of a force over the whole step.
        if (part < 1.0_wp) lost = lost - 0.5_wp*(1.0_wp - part)*dot_product(drag, motions(p, :))
        force(p, :) = force(p, :) + drag
        reaction = reaction - drag
        stored = stored + 0.5_wp*stiffness(p)*sum(friction%stretch(p, :)**2)
        friction%position(p, :) = x(p, :)
        friction%is_touching(p) = .true.
      else if (friction%is_touching(p)) then
        ! A point that leaves lets its spring go.
        moved = x(p, :) - friction%position(p, :)
        lost = lost + 0.5_wp*stiffness(p) &
               *dot_product(friction%stretch(p, :), friction%stretch(p, :) + moved)
        friction%stretch(p, :) = 0.0_wp
        friction%is_touching(p) = .false.
      end if
    end do
  end subroutine apply_friction

  !> Part of the step in which a point touches for the first time, from its force, which is that of
  !! the spring k d times (1 + part)/2, with d = part*travel.
  pure real(wp) function touching_part(pushed, stiffness, travel) result(part)
    real(wp), intent(in) :: pushed      !! [force]
    real(wp), intent(in) :: stiffness   !! [force/length]
    real(wp), intent(in) :: travel         !! against the normal in the step [length]

    part = 1.0_wp
    if (pushed < stiffness*travel) &
      part = 0.5_wp*(sqrt(1.0_wp + 8*pushed/(stiffness*travel)) - 1.0_wp)
  end function touching_part

  !> Stretch the spring of one point by its motion along the tangent plane, and let it slip.
  pure subroutine return_stretch(stretch, moved, normal, stiffness, limit, drag, lost)
    real(wp), intent(inout) :: stretch(3)    !! [length]
    real(wp), intent(in) :: moved(3)         !! since the last call, against the tool [length]
    real(wp), intent(in) :: normal(3)        !! unit
    real(wp), intent(in) :: stiffness        !! [force/length]
    real(wp), intent(in) :: limit            !! mu N [force]
    real(wp), intent(out) :: drag(3)         !! on the point [force]
    real(wp), intent(inout) :: lost
    real(wp) :: turned(3), trial(3), length

    turned = stretch - dot_product(stretch, normal)*normal
    length = norm2(turned)
    ! On a break of the tangent the old direction may have no image in the new plane.
    if (length > 0.5_wp*norm2(stretch)) turned = turned*(norm2(stretch)/length)
    trial = turned + moved - dot_product(moved, normal)*normal
    length = norm2(trial)
    stretch = trial
    if (stiffness*length > limit) then
      stretch = trial*(limit/(stiffness*length))
      lost = lost + 0.5_wp*stiffness*dot_product(turned + stretch, trial - stretch)
    end if
    drag = -stiffness*stretch
  end subroutine return_stretch

end module friction
