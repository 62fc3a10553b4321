!> Balance of energy and of linear momentum over a run.
!!
!! The internal energy is summed from the stress power at the points, not from control-point
!! forces: those would balance by construction and hide an instability. Kinetic energy at a time
!! step uses the velocities half a step before and after it, which matches the trapezoidal work of
!! the forces exactly (T. Belytschko et al., Nonlinear Finite Elements, 2nd ed., sec. 6.2.3).
module energy_balance
  use kinds, only: wp
  use element, only: element_t, force_report_t
  use row_shares, only: row_shares_t, gather_row_values
  use thickness_masses, only: column_directions, column_differences
  use effect, only: effect_slot_t, tally_t
  use body_parts, only: field_t
  use blank, only: blank_t, assembly_t
  use tool, only: largest_speed
  implicit none
  private

  public :: energy_balance_t, start_balance, add_step, add_impulse, take_balance
  public :: motion_sums_t, sums_of_motion

  integer, parameter :: parallel_size = 1500   !! fewer control points are not worth waking threads

  !> Of the lumped masses, at a time step between two velocities half a step to either side.
  type :: motion_sums_t
    real(wp) :: mass = 0.0_wp
    real(wp) :: kinetic = 0.0_wp            !! from the products of both velocities
    real(wp) :: momentum(3) = 0.0_wp        !! with the later one
    real(wp) :: magnitude = 0.0_wp          !! the same of all amounts |v1| + |v2| + |v3|
    real(wp) :: angular_momentum(3) = 0.0_wp   !! about the origin, with the mean of both
  end type motion_sums_t

  !> Running sums and the last balance.
  type :: energy_balance_t
    real(wp) :: internal = 0.0_wp, viscous = 0.0_wp      !! since the start
    real(wp) :: impulse(3) = 0.0_wp                      !! of all forces from outside
    real(wp) :: released = 0.0_wp       !! work of the forces that static steps ramp down
    real(wp) :: stopped = 0.0_wp        !! kinetic energy that static steps began without
    real(wp) :: kinetic_at_start = 0.0_wp, momentum_at_start(3) = 0.0_wp
    real(wp) :: kinetic = 0.0_wp, momentum(3) = 0.0_wp   !! at the last balance
    real(wp) :: angular_momentum(3) = 0.0_wp             !! about the origin, likewise
    real(wp) :: scale = 0.0_wp          !! largest of the energies now, see `take_balance`
    real(wp) :: error = 0.0_wp          !! of the energy, relative to it
    real(wp) :: alarm = 0.0_wp          !! the same, relative to `reference`
    real(wp) :: reference = 0.0_wp      !! largest energy so far, see `take_balance`
    real(wp) :: momentum_error = 0.0_wp !! momentum gained but not given, relative
    real(wp) :: momentum_reference = 0.0_wp   !! largest momentum or impulse so far
    type(tally_t) :: tally
  end type energy_balance_t

contains

  !> Energy and momentum of the initial velocities.
  subroutine start_balance(balance, blank)
    type(energy_balance_t), intent(out) :: balance
    type(blank_t), intent(in) :: blank
    type(motion_sums_t) :: sums
    integer :: p

    do p = 1, size(blank%parts)
      sums = sums_of(blank%parts(p)%element, blank%parts(p)%element%motion%v)
      balance%kinetic_at_start = balance%kinetic_at_start + sums%kinetic
      balance%momentum_at_start = balance%momentum_at_start + sums%momentum
    end do
    balance%kinetic = balance%kinetic_at_start
  end subroutine start_balance

  !> Add what the force evaluation of a step reported.
  pure subroutine add_step(balance, report)
    type(energy_balance_t), intent(inout) :: balance
    type(force_report_t), intent(in) :: report

    balance%internal = balance%internal + report%internal_work
    balance%viscous = balance%viscous + report%viscous_work
  end subroutine add_step

  !> Add the impulse that effects give over one velocity update.
  subroutine add_impulse(balance, effects, dt_mean)
    type(energy_balance_t), intent(inout) :: balance
    type(effect_slot_t), intent(in) :: effects(:)
    real(wp), intent(in) :: dt_mean
    integer :: i

    do i = 1, size(effects)
      balance%impulse = balance%impulse + dt_mean*effects(i)%item%force
    end do
  end subroutine add_impulse

  !> Balance now. `v_before` and the blank's velocities lie half a step to either side. The energy
  !! error is kinetic + internal + viscous + contact + friction + damping less external work and
  !! initial energy, over the largest of initial energy, |external work| and kinetic + internal
  !! energy. The alarm is the same over the largest of these at any balance so far and of what the
  !! blank would have at the speed of a tool: the step in which a tool first touches a blank without
  !! motion is no alarm.
  subroutine take_balance(balance, bodies, v_before, forces, supports, retired)
    type(energy_balance_t), intent(inout) :: balance
    type(assembly_t), intent(in) :: bodies
    type(field_t), intent(in) :: v_before(:)   !! by patch
    type(effect_slot_t), intent(in) :: forces(:), supports(:)
    type(effect_slot_t), intent(in), optional :: retired(:)     !! effects of earlier steps
    type(motion_sums_t) :: sums
    real(wp) :: scaling, lack, momentum_scale, lost(3), mass
    integer :: i, p

    balance%tally = tally_t()
    do i = 1, size(forces)
      call forces(i)%item%tally(balance%tally)
    end do
    do i = 1, size(supports)
      call supports(i)%item%tally(balance%tally)
    end do
    if (present(retired)) then
      do i = 1, size(retired)
        call retired(i)%item%tally(balance%tally)
      end do
    end if
    balance%tally%external_work = balance%tally%external_work + balance%released
    balance%tally%damping_energy = balance%tally%damping_energy + balance%stopped
    balance%kinetic = 0.0_wp
    balance%momentum = 0.0_wp
    balance%angular_momentum = 0.0_wp
    momentum_scale = tiny(1.0_wp)
    mass = 0.0_wp
    do p = 1, size(bodies%blank%parts)
      sums = sums_of(bodies%blank%parts(p)%element, v_before(p)%values)
      balance%kinetic = balance%kinetic + sums%kinetic
      balance%momentum = balance%momentum + sums%momentum
      balance%angular_momentum = balance%angular_momentum + sums%angular_momentum
      momentum_scale = momentum_scale + sums%magnitude
      mass = mass + sums%mass
    end do
    associate (work => balance%tally%external_work)
      scaling = max(balance%kinetic_at_start, abs(work), balance%kinetic + balance%internal, &
                    least_energy(bodies, mass))
      balance%reference = max(balance%reference, scaling, energy_of_pace(bodies, mass))
      lack = balance%kinetic + balance%tally%tool_energy + balance%internal + balance%viscous &
             + balance%tally%contact_energy + balance%tally%friction_energy &
             + balance%tally%damping_energy - work - balance%kinetic_at_start
      balance%scale = scaling
      balance%error = lack/scaling
      balance%alarm = lack/balance%reference
      lost = balance%momentum - balance%momentum_at_start - balance%impulse
      balance%momentum_reference = max(balance%momentum_reference, momentum_scale, &
                                       norm2(balance%impulse))
      balance%momentum_error = norm2(lost)/balance%momentum_reference
    end associate
  end subroutine take_balance

  !> Energy below which there is nothing to balance: that of strains of 1e-10 in all of the blank,
  !! at which coordinates are rounded.
  pure real(wp) function least_energy(bodies, mass) result(energy)
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: mass              !! of the blank
    real(wp), parameter :: least_strain = 1.0e-10_wp

    associate (law => bodies%blank%law)
      energy = max(law%bulk*least_strain**2*mass/max(law%density, tiny(1.0_wp)), tiny(1.0_wp))
    end associate
  end function least_energy

  !> Kinetic energy of the blank at the speed of the fastest tool.
  pure real(wp) function energy_of_pace(bodies, mass) result(energy)
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: mass              !! of the blank
    integer :: t

    energy = 0.0_wp
    do t = 1, size(bodies%tools)
      energy = max(energy, 0.5_wp*mass*largest_speed(bodies%tools(t))**2)
    end do
  end function energy_of_pace

  !> Sums over the control points of a patch, with the kinetic energy of all mass that moves: the
  !! lumped one, and what scaling adds to columns. The angular momentum is that of the lumped masses
  !! with the mean of both velocities: inner forces change it with neither. Where processes move but
  !! some of the rows, each has those of its own.
  function sums_of(body, v_before) result(sums)
    class(element_t), intent(in) :: body
    real(wp), intent(in) :: v_before(:, :, :, :)
    type(motion_sums_t) :: sums
    type(motion_sums_t) :: rows(size(body%mass, 2))
    integer :: own(2)

    associate (shares => body%motion%rows)
      own = [max(1, shares%own_first), min(size(rows), shares%own_last)]
      call find_row_sums(shape(body%mass), own, body%mass, body%motion%x, v_before, body%motion%v, &
                         rows)
      if (allocated(body%column_factor)) call add_column_energies(body, own, v_before, rows)
      if (shares%is_shared) call gather_sums(shares, rows)
    end associate
    sums = total_of(rows)
  end function sums_of

  !> Sums of all rows at all processes.
  subroutine gather_sums(shares, rows)
    type(row_shares_t), intent(in) :: shares
    type(motion_sums_t), intent(inout) :: rows(:)
    real(wp) :: values(9, size(rows))
    integer :: j

    do j = 1, size(rows)
      values(:, j) = [rows(j)%mass, rows(j)%kinetic, rows(j)%momentum, rows(j)%magnitude, &
                      rows(j)%angular_momentum]
    end do
    call gather_row_values(shares, values)
    do j = 1, size(rows)
      rows(j) = motion_sums_t(values(1, j), values(2, j), values(3:5, j), values(6, j), &
                              values(7:9, j))
    end do
  end subroutine gather_sums

  !> Kinetic energy of the mass that scaling adds to columns, of some rows of them.
  pure subroutine add_column_energies(body, own, v1, rows)
    class(element_t), intent(in) :: body
    integer, intent(in) :: own(2)                       !! first and last row
    real(wp), intent(in) :: v1(:, :, :, :)              !! velocities half a step before
    type(motion_sums_t), intent(inout) :: rows(:)
    real(wp), allocatable :: directions(:, :, :), before(:, :, :), after(:, :, :)
    integer :: j, k

    associate (first => own(1), last => own(2))
      directions = column_directions(body%motion%x(:, first:last, :, :))
      before = column_differences(body%inertia(:, first:last, :), directions, &
                                  v1(:, first:last, :, :))
      after = column_differences(body%inertia(:, first:last, :), directions, &
                                 body%motion%v(:, first:last, :, :))
      do k = 1, size(body%mass, 3)
        do j = first, last
          associate (energy => rows(j)%kinetic, row => j - first + 1)
            energy = energy + 0.5_wp*sum((body%column_factor(:, j) - 1.0_wp)*body%mass(:, j, k) &
                                         *before(:, row, k)*after(:, row, k))
          end associate
        end do
      end do
    end associate
  end subroutine add_column_energies

  !> The sums of one patch.
  function sums_of_motion(n, mass, x, v_before, v) result(sums)
    integer, intent(in) :: n(3)              !! control points along each axis
    real(wp), intent(in) :: mass(n(1), n(2), n(3))
    real(wp), intent(in) :: x(n(1), n(2), n(3), 3)      !! positions now
    real(wp), intent(in) :: v_before(n(1), n(2), n(3), 3), v(n(1), n(2), n(3), 3)
    type(motion_sums_t) :: sums
    type(motion_sums_t) :: rows(n(2))

    call find_row_sums(n, [1, n(2)], mass, x, v_before, v, rows)
    sums = total_of(rows)
  end function sums_of_motion

  !> The sums of some of its rows.
  subroutine find_row_sums(n, own, mass, x, v_before, v, rows)
    integer, intent(in) :: n(3)              !! control points along each axis
    integer, intent(in) :: own(2)            !! first and last row
    real(wp), intent(in) :: mass(n(1), n(2), n(3))
    real(wp), intent(in) :: x(n(1), n(2), n(3), 3)      !! positions now
    real(wp), intent(in) :: v_before(n(1), n(2), n(3), 3), v(n(1), n(2), n(3), 3)
    type(motion_sums_t), intent(out) :: rows(n(2))
    integer :: j, k

    !$omp parallel do schedule(static) private(k) if (product(n) > parallel_size)
    do j = own(1), own(2)
      do k = 1, n(3)
        call add_line(n, j, k, mass, x, v_before, v, rows(j))
      end do
    end do
    !$omp end parallel do
  end subroutine find_row_sums

  !> Sum of those of the rows.
  pure function total_of(rows) result(sums)
    type(motion_sums_t), intent(in) :: rows(:)
    type(motion_sums_t) :: sums
    integer :: j

    do j = 1, size(rows)
      sums%mass = sums%mass + rows(j)%mass
      sums%kinetic = sums%kinetic + rows(j)%kinetic
      sums%momentum = sums%momentum + rows(j)%momentum
      sums%magnitude = sums%magnitude + rows(j)%magnitude
      sums%angular_momentum = sums%angular_momentum + rows(j)%angular_momentum
    end do
  end function total_of

  !> Add the points of a line along axis 1. Components are written out, as a loop over them would
  !! keep that over the points from vectorising.
  pure subroutine add_line(n, j, k, mass, x, v_before, v, sums)
    integer, intent(in) :: n(3), j, k
    real(wp), intent(in) :: mass(n(1), n(2), n(3)), x(n(1), n(2), n(3), 3)
    real(wp), intent(in) :: v_before(n(1), n(2), n(3), 3), v(n(1), n(2), n(3), 3)
    type(motion_sums_t), intent(inout) :: sums
    real(wp) :: m, w1, w2, w3, all, energy, p1, p2, p3, l1, l2, l3, amount
    integer :: i

    all = 0.0_wp
    energy = 0.0_wp
    p1 = 0.0_wp
    p2 = 0.0_wp
    p3 = 0.0_wp
    l1 = 0.0_wp
    l2 = 0.0_wp
    l3 = 0.0_wp
    amount = 0.0_wp
    !$omp simd private(m, w1, w2, w3) reduction(+: all, energy, p1, p2, p3, l1, l2, l3, amount)
    do i = 1, n(1)
      m = mass(i, j, k)
      all = all + m
      energy = energy + m*(v_before(i, j, k, 1)*v(i, j, k, 1) + v_before(i, j, k, 2)*v(i, j, k, 2) &
                           + v_before(i, j, k, 3)*v(i, j, k, 3))
      p1 = p1 + m*v(i, j, k, 1)
      p2 = p2 + m*v(i, j, k, 2)
      p3 = p3 + m*v(i, j, k, 3)
      amount = amount + m*(abs(v(i, j, k, 1)) + abs(v(i, j, k, 2)) + abs(v(i, j, k, 3)))
      w1 = v_before(i, j, k, 1) + v(i, j, k, 1)
      w2 = v_before(i, j, k, 2) + v(i, j, k, 2)
      w3 = v_before(i, j, k, 3) + v(i, j, k, 3)
      l1 = l1 + m*(x(i, j, k, 2)*w3 - x(i, j, k, 3)*w2)
      l2 = l2 + m*(x(i, j, k, 3)*w1 - x(i, j, k, 1)*w3)
      l3 = l3 + m*(x(i, j, k, 1)*w2 - x(i, j, k, 2)*w1)
    end do
    sums%mass = sums%mass + all
    sums%kinetic = sums%kinetic + 0.5_wp*energy
    sums%momentum = sums%momentum + [p1, p2, p3]
    sums%magnitude = sums%magnitude + amount
    sums%angular_momentum = sums%angular_momentum + 0.5_wp*[l1, l2, l3]
  end subroutine add_line

end module energy_balance
