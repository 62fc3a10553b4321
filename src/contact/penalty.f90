!> Penalty springs and viscous dampers of secondary points along the normal of a tool.
!!
!! The stiffness is small enough to keep the explicit step stable. The damping force -c v_n acts
!! together with the spring and never pulls: c = 2 zeta sqrt(k m) with the mass m that the penalty
!! sees. The velocity is that of the last increment, half an increment late, so damping reduces the
!! stable time increment.
module penalty
  use kinds, only: wp
  use secondary_surface, only: secondary_surface_t, scatter_forces
  use pressed_points, only: pressed_points_t
  implicit none
  private

  public :: stiffness_from_mass, contact_fraction, find_pressed_depths, push_points, &
            contact_damping_t, new_contact_damping, damp_points

  real(wp), parameter, public :: no_contact = -1.0_wp   !! start of a spring that does not touch

  !> Damping of one contact; arrays by secondary point.
  type :: contact_damping_t
    real(wp) :: energy = 0.0_wp              !! taken away since the start [energy]
    real(wp), allocatable :: constant(:)     !! c [force time/length], shape (n_points)
    real(wp), allocatable :: force(:, :)     !! at the last call, shape (3, n_points) [force]
  end type contact_damping_t

contains

  !> Stiffness k_p = (s/dt^2) a_p min_I(m_I/A_I) over the control points I that support point p,
  !! with A_I = sum_p a_p R_I(p). Then sum_p k_p R_I(p) <= s m_I/dt^2 on every control point. Where
  !! R_I vanishes but for round-off, at a line between elements, I does not support p.
  subroutine stiffness_from_mass(secondary, mass, scale, dt, stiffness)
    type(secondary_surface_t), intent(in) :: secondary
    real(wp), intent(in) :: mass(secondary%n_net(1), secondary%n_net(2))   !! of control points
    real(wp), intent(in) :: scale   !! s
    real(wp), intent(in) :: dt      !! largest time step expected [time]
    real(wp), intent(out) :: stiffness(secondary%n_along(1), secondary%n_along(2)) !! [force/length]
    real(wp), parameter :: round_off = 1.0e-9_wp
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
        associate (supports => secondary%lines(1)%values(i, :) > round_off, &
                   across => secondary%lines(2)%values(j, :) > round_off)
          stiffness(i, j) = scale/dt**2*areas(i, j, 1) &
                            *minval(per_area(low(1):high(1), low(2):high(2)), &
                                    spread(supports, 2, size(across)) &
                                    .and. spread(across, 1, size(supports)))
        end associate
      end do
    end do
  end subroutine stiffness_from_mass

  !> Factor (1 + phi)/2 on the force where a point touches first, or last, phi being the part of
  !! the step in which it touches. The force acts for half a step to either side, and so its work
  !! is, but for terms of higher order, that of the spring.
  pure real(wp) function contact_fraction(depth, travel) result(fraction)
    real(wp), intent(in) :: depth      !! in the tool, not negative [length]
    real(wp), intent(in) :: travel     !! along the normal in the last step [length]

    fraction = 0.5_wp + 0.5_wp*(depth/max(abs(travel), depth, tiny(1.0_wp)))
  end function contact_fraction

  !> Depth that loads the springs of some points. A point whose first depth is more than it can have
  !! come along the normal has entered across the tool's edge or from behind; its spring starts from
  !! there without load, since otherwise it would push with an energy that nobody has spent. As the
  !! point comes up its start goes with it.
  pure subroutine find_pressed_depths(n, longest, depth, start)
    integer, intent(in) :: n
    real(wp), intent(in) :: longest         !! way that a point may have come at most [length]
    real(wp), intent(inout) :: depth(n)     !! in the tool if positive; of the spring, not negative,
                                            !! at the end [length]
    real(wp), intent(inout) :: start(n)     !! of the spring, `no_contact` while it does not touch
    real(wp) :: from
    integer :: i

    !$omp simd private(from)
    do i = 1, n
      from = merge(merge(depth(i), 0.0_wp, depth(i) > longest), start(i), start(i) < 0.0_wp)
      from = min(from, depth(i))
      start(i) = merge(from, no_contact, depth(i) > 0.0_wp)
      depth(i) = merge(depth(i) - from, 0.0_wp, depth(i) > 0.0_wp)
    end do
  end subroutine find_pressed_depths

  !> Forces of springs along the normal, and their energy.
  pure subroutine push_points(pressed, depth, stored)
    type(pressed_points_t), intent(inout) :: pressed
    real(wp), intent(in) :: depth(pressed%n)     !! that loads the springs, not negative [length]
    real(wp), intent(inout) :: stored            !! added to [energy]
    real(wp) :: travel
    integer :: i

    !$omp simd private(travel) reduction(+: stored)
    do i = 1, pressed%n
      travel = pressed%normal(i, 1)*pressed%moved(i, 1) + pressed%normal(i, 2)*pressed%moved(i, 2) &
               + pressed%normal(i, 3)*pressed%moved(i, 3)
      pressed%push(i) = pressed%stiffness(i)*depth(i)*contact_fraction(depth(i), travel)
      stored = stored + 0.5_wp*pressed%stiffness(i)*depth(i)**2
    end do
  end subroutine push_points

  !> No point touches yet.
  pure subroutine new_contact_damping(damping, ratio, stiffness, mass)
    type(contact_damping_t), intent(out) :: damping
    real(wp), intent(in) :: ratio                      !! zeta, 1 being critical
    real(wp), intent(in) :: stiffness(:), mass(:)      !! of the points [force/length, mass]

    damping%constant = 2*ratio*sqrt(stiffness*mass)
    allocate (damping%force(3, size(mass)), source=0.0_wp)
  end subroutine new_contact_damping

  !> Add the damping of the points of a tile to their push, where there is some. A point that has
  !! just come has no velocity yet.
  pure subroutine damp_points(damping, dt, pressed, lost)
    type(contact_damping_t), intent(inout) :: damping
    real(wp), intent(in) :: dt                         !! since the last call, 0: no call yet [time]
    type(pressed_points_t), intent(inout) :: pressed
    real(wp), intent(inout) :: lost                    !! energy taken in this call, added to
    real(wp) :: per_dt, push, n1, n2, n3, m1, m2, m3
    integer :: i, p

    per_dt = 0.0_wp
    if (dt > 0.0_wp) per_dt = 1.0_wp/dt
    !$omp simd private(push, n1, n2, n3, m1, m2, m3, p) reduction(+: lost)
    do i = 1, pressed%n
      p = pressed%point(i)
      n1 = pressed%normal(i, 1)
      n2 = pressed%normal(i, 2)
      n3 = pressed%normal(i, 3)
      m1 = merge(pressed%moved(i, 1), 0.0_wp, pressed%was_touching(i))
      m2 = merge(pressed%moved(i, 2), 0.0_wp, pressed%was_touching(i))
      m3 = merge(pressed%moved(i, 3), 0.0_wp, pressed%was_touching(i))
      push = max(-damping%constant(p)*(m1*n1 + m2*n2 + m3*n3)*per_dt, -pressed%push(i))
      push = merge(push, 0.0_wp, pressed%push(i) > 0.0_wp)
      lost = lost - 0.5_wp*((damping%force(1, p) + push*n1)*m1 &
                            + (damping%force(2, p) + push*n2)*m2 &
                            + (damping%force(3, p) + push*n3)*m3)
      pressed%push(i) = pressed%push(i) + push
      damping%force(1, p) = push*n1
      damping%force(2, p) = push*n2
      damping%force(3, p) = push*n3
    end do
  end subroutine damp_points

end module penalty
