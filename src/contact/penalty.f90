!> Penalty springs and viscous dampers of secondary points along the normal of a tool.
!!
!! The stiffness is small enough to keep the explicit step stable. The damping force -c v_n acts
!! together with the spring and never pulls: c = 2 zeta sqrt(k m) with the mass m that the penalty
!! sees. The velocity is that of the last increment, half an increment late, so damping reduces the
!! stable time increment.
module penalty
  use kinds, only: wp
  use secondary_surface, only: secondary_surface_t, scatter_forces
  implicit none
  private

  public :: stiffness_from_mass, contact_fraction, find_pressed_depth, contact_damping_t, &
            new_contact_damping, damp_points

  real(wp), parameter, public :: no_contact = -1.0_wp   !! start of a spring that does not touch

  !> Damping of one contact; arrays by secondary point.
  type :: contact_damping_t
    real(wp) :: energy = 0.0_wp              !! taken away since the start [energy]
    real(wp), allocatable :: constant(:)     !! c [force time/length], shape (n_points)
    logical, allocatable :: is_touching(:)   !! at the last call
    real(wp), allocatable :: position(:, :)     !! then, in the tool's frame, (n_points, 3) [length]
    real(wp), allocatable :: force(:, :)     !! then, (n_points, 3) [force]
  end type contact_damping_t

contains

  !> Stiffness k_p = (s/dt^2) a_p min_I(m_I/A_I) over the control points I that support point p,
  !! with A_I = sum_p a_p R_I(p). Then sum_p k_p R_I(p) <= s m_I/dt^2 on every control point.
  subroutine stiffness_from_mass(secondary, mass, scale, dt, stiffness)
    type(secondary_surface_t), intent(in) :: secondary
    real(wp), intent(in) :: mass(secondary%n_net(1), secondary%n_net(2))   !! of control points
    real(wp), intent(in) :: scale   !! s
    real(wp), intent(in) :: dt      !! largest time step expected [time]
    real(wp), intent(out) :: stiffness(secondary%n_along(1), secondary%n_along(2)) !! [force/length]
    real(wp), allocatable :: areas(:, :, :), net_areas(:, :, :)
    real(wp) :: per_area(secondary%n_net(1), secondary%n_net(2))
    integer :: i, j, low(2), high(2)

    allocate (areas(secondary%n_along(1), secondary%n_along(2), 3), source=0.0_wp)
    allocate (net_areas(secondary%n_net(1), secondary%n_net(2), 3), source=0.0_wp)
    areas(:, :, 1) = reshape(secondary%area, secondary%n_along)
    call scatter_forces(secondary, areas, net_areas)
    per_area = huge(1.0_wp)
    where (net_areas(:, :, 1) > 0.0_wp) per_area = mass/net_areas(:, :, 1)
    do j = 1, secondary%n_along(2)
      do i = 1, secondary%n_along(1)
        low = [secondary%lines(1)%first(i), secondary%lines(2)%first(j)]
        high = low + secondary%lines%degree
        stiffness(i, j) = scale/dt**2*areas(i, j, 1) &
                          *minval(per_area(low(1):high(1), low(2):high(2)))
      end do
    end do
  end subroutine stiffness_from_mass

  !> Factor (1 + phi)/2 on the force where a point touches first, or last, phi being the part of
  !! the step in which it touches. The force acts for half a step to either side, and so its work
  !! is, but for terms of higher order, that of the spring.
  pure real(wp) function contact_fraction(depth, travel) result(fraction)
    real(wp), intent(in) :: depth   !! in the tool, positive [length]
    real(wp), intent(in) :: travel     !! along the normal in the last step [length]

    fraction = 1.0_wp
    if (depth < abs(travel)) fraction = 0.5_wp*(1.0_wp + depth/abs(travel))
  end function contact_fraction

  !> Depth that loads the spring of a point. A point whose first depth is more than it can have come
  !! along the normal has entered across the tool's edge or from behind; its spring starts from
  !! there without load, since otherwise it would push with an energy that nobody has spent. As the
  !! point comes up its start goes with it.
  pure subroutine find_pressed_depth(depth, longest, start, pressed)
    real(wp), intent(in) :: depth        !! in the tool if positive [length]
    real(wp), intent(in) :: longest      !! distance a point may have come along the normal [length]
    real(wp), intent(inout) :: start     !! of the spring, `no_contact` while it does not touch
    real(wp), intent(out) :: pressed     !! [length]

    pressed = 0.0_wp
    if (depth > 0.0_wp) then
      if (start < 0.0_wp) start = merge(depth, 0.0_wp, depth > longest)
      start = min(start, depth)
      pressed = depth - start
    else
      start = no_contact
    end if
  end subroutine find_pressed_depth

  !> No point touches yet.
  pure subroutine new_contact_damping(damping, ratio, stiffness, mass)
    type(contact_damping_t), intent(out) :: damping
    real(wp), intent(in) :: ratio                      !! zeta, 1 being critical
    real(wp), intent(in) :: stiffness(:), mass(:)      !! of the points [force/length, mass]

    damping%constant = 2*ratio*sqrt(stiffness*mass)
    allocate (damping%is_touching(size(mass)), source=.false.)
    allocate (damping%position(size(mass), 3), damping%force(size(mass), 3), source=0.0_wp)
  end subroutine new_contact_damping

  !> Add the damping of the points `first` to `last` to the spring forces of this call. A point that
  !! has just come has no velocity yet and carries the spring force alone.
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
      moved = x(p, :) - damping%position(p, :)
      if (pushed > 0.0_wp .and. damping%is_touching(p)) then
        normal = force(p, :)/pushed
        push = normal*max(-damping%constant(p)*dot_product(moved, normal)/dt, -pushed)
      end if
      if (damping%is_touching(p)) then
        lost = lost - 0.5_wp*dot_product(damping%force(p, :) + push, moved)
      end if
      damping%is_touching(p) = pushed > 0.0_wp
      damping%position(p, :) = x(p, :)
      damping%force(p, :) = push
      force(p, :) = force(p, :) + push
      reaction = reaction - push
    end do
  end subroutine damp_points

end module penalty
