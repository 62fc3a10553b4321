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
!! In static increments the springs are softer, so that a point slips after a part of the size of
!! its area, however small the push: else the direction of friction changes from iteration to
!! iteration.
!!
!! The work of slip is taken with the mean of the forces before and after, as the balance of energy
!! counts the work of all forces.
module friction
  use kinds, only: wp
  use pressed_points, only: pressed_points_t, most_points
  implicit none
  private

  public :: friction_t, new_friction, apply_friction, apply_static_friction

  !> Friction of one contact.
  type :: friction_t
    real(wp) :: coefficient = 0.0_wp         !! mu
    real(wp) :: energy = 0.0_wp              !! work of slip since the start [energy]
    real(wp), allocatable :: stretch(:, :)   !! of the springs, tangential; zero where a point does
                                             !! not touch, shape (3, n_points) [length]
    real(wp), allocatable :: held(:)         !! part of the motion in the last static increment that
                                             !! stretched the spring, shape (n_points)
  end type friction_t

  real(wp), parameter :: static_slip = 0.01_wp   !! largest stretch in static increments, over the
                                                 !! root of the area of a point

contains

  !> No point touches yet.
  pure subroutine new_friction(friction, n_points, coefficient)
    type(friction_t), intent(out) :: friction
    integer, intent(in) :: n_points
    real(wp), intent(in) :: coefficient

    friction%coefficient = coefficient
    allocate (friction%stretch(3, n_points), friction%held(n_points), source=0.0_wp)
  end subroutine new_friction

  !> Friction of the points of a tile: `drag`, and the stretch of their springs.
  pure subroutine apply_friction(friction, pressed, stored, lost)
    type(friction_t), intent(inout) :: friction
    type(pressed_points_t), intent(inout) :: pressed
    real(wp), intent(inout) :: stored        !! energy of the springs, added to [energy]
    real(wp), intent(inout) :: lost          !! work of slip of this call, added to [energy]
    real(wp) :: stretch(most_points, 3)
    integer :: i, c

    do i = 1, pressed%n
      do c = 1, 3
        stretch(i, c) = friction%stretch(c, pressed%point(i))
      end do
    end do
    call return_stretches(friction%coefficient, pressed, stretch, stored, lost)
    do i = 1, pressed%n
      do c = 1, 3
        friction%stretch(c, pressed%point(i)) = stretch(i, c)
      end do
    end do
  end subroutine apply_friction

  !> The same in a static increment: the motion along the tool counts in part. What it leaves out
  !! is slip for the balance of energy.
  pure subroutine apply_static_friction(friction, area, pressed, stored, lost)
    type(friction_t), intent(inout) :: friction
    real(wp), intent(in) :: area(:)          !! of all points of the contact [area]
    type(pressed_points_t), intent(inout) :: pressed
    real(wp), intent(inout) :: stored, lost
    real(wp) :: before(3, most_points), rest(3, most_points), part, limit
    integer :: i

    do i = 1, pressed%n
      associate (p => pressed%point(i), n => pressed%normal(i, :))
        before(:, i) = friction%stretch(:, p)
        limit = friction%coefficient*pressed%push(i)
        part = min(1.0_wp, limit/(pressed%stiffness(i)*static_slip*sqrt(area(p)) + tiny(limit)))
        rest(:, i) = (1.0_wp - part)*(pressed%moved(i, :) - dot_product(pressed%moved(i, :), n)*n)
        pressed%moved(i, :) = pressed%moved(i, :) - rest(:, i)
      end associate
    end do
    call apply_friction(friction, pressed, stored, lost)
    do i = 1, pressed%n
      pressed%moved(i, :) = pressed%moved(i, :) + rest(:, i)
      lost = lost + 0.5_wp*pressed%stiffness(i)*dot_product(before(:, i) &
             + friction%stretch(:, pressed%point(i)), rest(:, i))
    end do
    call note_held(friction, pressed, before)
  end subroutine apply_static_friction

  !> Note how much of their motion along the tool has stretched the springs, which had `before`: as
  !! it counts where a point sticks, less where it slips or has come to the tool on the way.
  pure subroutine note_held(friction, pressed, before)
    type(friction_t), intent(inout) :: friction
    type(pressed_points_t), intent(in) :: pressed
    real(wp), intent(in) :: before(3, most_points)   !! [length]
    real(wp) :: along(3), square
    integer :: i

    do i = 1, pressed%n
      associate (p => pressed%point(i), n => pressed%normal(i, :), moved => pressed%moved(i, :))
        along = moved - dot_product(moved, n)*n
        square = dot_product(along, along)
        friction%held(p) = merge(1.0_wp, 0.0_wp, pressed%was_touching(i))
        if (square > tiny(square)) friction%held(p) = &
          min(max(dot_product(friction%stretch(:, p) - before(:, i), along)/square, 0.0_wp), 1.0_wp)
      end associate
    end do
  end subroutine note_held

  !> Stretch springs by the motion along the tangent plane, and let them slip. A point without push
  !! has no limit, one that leaves no normal either: its spring loses all. Written out by components
  !! for the vector registers.
  pure subroutine return_stretches(coefficient, pressed, stretch, stored, lost)
    real(wp), intent(in) :: coefficient
    type(pressed_points_t), intent(inout) :: pressed
    real(wp), intent(inout) :: stretch(most_points, 3)   !! [length]
    real(wp), intent(inout) :: stored, lost
    real(wp) :: n1, n2, n3, m1, m2, m3, s1, s2, s3, t1, t2, t3, along, square, k, limit, part
    real(wp) :: factor
    integer :: i

    !$omp simd private(n1, n2, n3, m1, m2, m3, s1, s2, s3, t1, t2, t3, along, square, k, limit, &
    !$omp& part, factor) reduction(+: stored, lost)
    do i = 1, pressed%n
      n1 = pressed%normal(i, 1)
      n2 = pressed%normal(i, 2)
      n3 = pressed%normal(i, 3)
      m1 = pressed%moved(i, 1)
      m2 = pressed%moved(i, 2)
      m3 = pressed%moved(i, 3)
      s1 = stretch(i, 1)
      s2 = stretch(i, 2)
      s3 = stretch(i, 3)
      k = pressed%stiffness(i)
      limit = min(coefficient*pressed%push(i), huge(limit))
      ! The stretch turned into the tangent plane. On a break of the tangent the old direction may
      ! have no image there.
      along = s1*n1 + s2*n2 + s3*n3
      t1 = s1 - along*n1
      t2 = s2 - along*n2
      t3 = s3 - along*n3
      along = s1*s1 + s2*s2 + s3*s3
      square = t1*t1 + t2*t2 + t3*t3
      factor = merge(sqrt(along/max(square, tiny(1.0_wp))), 1.0_wp, square > 0.25_wp*along)
      t1 = t1*factor
      t2 = t2*factor
      t3 = t3*factor
      along = m1*n1 + m2*n2 + m3*n3
      part = merge(1.0_wp, touching_part(pressed%push(i), -k*along), pressed%was_touching(i))
      s1 = t1 + part*(m1 - along*n1)
      s2 = t2 + part*(m2 - along*n2)
      s3 = t3 + part*(m3 - along*n3)
      factor = limit/max(k*sqrt(s1*s1 + s2*s2 + s3*s3), limit, tiny(1.0_wp))
      ! What slips, s - s factor, along the mean of the forces before and after.
      lost = lost + 0.5_wp*k*(1.0_wp - factor)*((t1 + factor*s1)*s1 + (t2 + factor*s2)*s2 &
                                                + (t3 + factor*s3)*s3)
      s1 = s1*factor
      s2 = s2*factor
      s3 = s3*factor
      ! The balance of energy counts the work of a force over the whole step.
      lost = lost + 0.5_wp*k*(1.0_wp - part)*(s1*m1 + s2*m2 + s3*m3)
      stored = stored + 0.5_wp*k*(s1*s1 + s2*s2 + s3*s3)
      stretch(i, 1) = s1
      stretch(i, 2) = s2
      stretch(i, 3) = s3
      pressed%drag(i, 1) = -k*s1
      pressed%drag(i, 2) = -k*s2
      pressed%drag(i, 3) = -k*s3
    end do
  end subroutine return_stretches

  !> Part of the step in which a point touches for the first time, from its force, which is that of
  !! the spring k d times (1 + part)/2, with d = part*travel.
  pure real(wp) function touching_part(push, whole) result(part)
    real(wp), intent(in) :: push     !! [force]
    real(wp), intent(in) :: whole    !! k times the travel against the normal in the step [force]

    part = 0.5_wp*(sqrt(1.0_wp + 8*push/max(whole, push, tiny(1.0_wp))) - 1.0_wp)
  end function touching_part

end module friction
