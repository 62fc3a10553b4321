!> Viscous damping of the motion of slave points along the normal of a tool.
!!
!! The force -c v_n acts together with the penalty spring and never pulls. c = 2 zeta sqrt(k m) with
!! the mass m that the penalty sees. The velocity is that of the step before, half a step late, so
!! damping takes its share of the stable step.
module contact_damping
  use kinds, only: wp
  implicit none
  private

  public :: contact_damping_t, new_contact_damping, damp_points

  !> Damping of one contact; arrays by slave point.
  type :: contact_damping_t
    real(wp) :: energy = 0.0_wp              !! taken away since the start [energy]
    real(wp), allocatable :: constant(:)     !! c [force time/length], shape (n_points)
    logical, allocatable :: is_touching(:)   !! at the last call
    real(wp), allocatable :: place(:, :)     !! then, in the tool's frame, (n_points, 3) [length]
    real(wp), allocatable :: force(:, :)     !! then, (n_points, 3) [force]
  end type contact_damping_t

contains

  !> No point touches yet.
  pure subroutine new_contact_damping(damping, ratio, stiffness, mass)
    type(contact_damping_t), intent(out) :: damping
    real(wp), intent(in) :: ratio                      !! zeta, 1 being critical
    real(wp), intent(in) :: stiffness(:), mass(:)      !! of the points [force/length, mass]

    damping%constant = 2*ratio*sqrt(stiffness*mass)
    allocate (damping%is_touching(size(mass)), source=.false.)
    allocate (damping%place(size(mass), 3), damping%force(size(mass), 3), source=0.0_wp)
  end subroutine new_contact_damping

  !> Add the damping of the points `first` to `last` to the spring forces of this call. A point that
  !! has just come has no velocity yet and bears the spring alone.
  pure subroutine damp_points(damping, n_points, first, last, dt, x, force, reaction, lost)
    type(contact_damping_t), intent(inout) :: damping
    integer, intent(in) :: n_points, first, last
    real(wp), intent(in) :: dt                       !! since the last call [time]
    real(wp), intent(in) :: x(first:last, 3)         !! points in the tool's frame now [length]
    real(wp), intent(inout) :: force(n_points, 3)    !! on the points [force]
    real(wp), intent(inout) :: reaction(3)           !! on the tool, added to [force]
    real(wp), intent(inout) :: lost                  !! energy taken in this call, added to
    real(wp) :: pushed, moved(3), normal(3), push(3)
    integer :: p

    do p = first, last
      pushed = norm2(force(p, :))
      push = 0.0_wp
      moved = x(p, :) - damping%place(p, :)
      if (pushed > 0.0_wp .and. damping%is_touching(p)) then
        normal = force(p, :)/pushed
        push = normal*max(-damping%constant(p)*dot_product(moved, normal)/dt, -pushed)
      end if
      if (damping%is_touching(p)) then
        lost = lost - 0.5_wp*dot_product(damping%force(p, :) + push, moved)
      end if
      damping%is_touching(p) = pushed > 0.0_wp
      damping%place(p, :) = x(p, :)
      damping%force(p, :) = push
      force(p, :) = force(p, :) + push
      reaction = reaction - push
    end do
  end subroutine damp_points

end module contact_damping
