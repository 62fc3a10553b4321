!> Balance of energy and of linear momentum over a run.
!!
!! The internal energy is summed from the stress power at the points, not from control-point
!! forces: those would balance by construction and hide an instability. Kinetic energy at a time
!! step uses the velocities half a step before and after it, which matches the trapezoidal work of
!! the forces exactly (T. Belytschko et al., Nonlinear Finite Elements, 2nd ed., sec. 6.2.3).
module energy_balance
  use kinds, only: wp
  use block_law, only: block_law_t
  use ig_patch, only: force_report_t
  use column_scaling, only: column_directions, column_differences
  use effect, only: effect_slot_t, tally_t
  use patch_body, only: patch_body_t, field_t
  use blank, only: blank_t, mass_of
  use tool_turn, only: pace_of
  use assembly, only: assembly_t
  implicit none
  private

  public :: energy_balance_t, start_balance, add_step, add_impulse, take_balance, elastic_energy

  !> Running sums and the last balance.
  type :: energy_balance_t
    real(wp) :: internal = 0.0_wp, viscous = 0.0_wp      !! since the start
    real(wp) :: impulse(3) = 0.0_wp                      !! of all forces from outside
    real(wp) :: kinetic_at_start = 0.0_wp, momentum_at_start(3) = 0.0_wp
    real(wp) :: kinetic = 0.0_wp, momentum(3) = 0.0_wp   !! at the last balance
    real(wp) :: angular_momentum(3) = 0.0_wp             !! about the origin, likewise
    real(wp) :: error = 0.0_wp          !! of the energy, relative to the energies now
    real(wp) :: alarm = 0.0_wp          !! the same, relative to `reference`
    real(wp) :: reference = 0.0_wp      !! largest energy so far, see `take_balance`
    real(wp) :: momentum_error = 0.0_wp !! momentum gained but not given, relative
    real(wp) :: momentum_reference = 0.0_wp   !! largest momentum or impulse so far
    type(tally_t) :: tally
  end type energy_balance_t

contains

  !> Energy and momentum of the initial velocities.
  pure subroutine start_balance(balance, blank)
    type(energy_balance_t), intent(out) :: balance
    type(blank_t), intent(in) :: blank
    integer :: p

    do p = 1, size(blank%parts)
      associate (body => blank%parts(p), v => blank%parts(p)%motion%v)
        balance%kinetic_at_start = balance%kinetic_at_start + kinetic_energy(body, v, v)
        balance%momentum_at_start = balance%momentum_at_start + momentum_of(body%mass, v)
      end associate
    end do
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
  !! energy.
  !! The alarm is the same over the largest of these at any balance so far and of what the blank
  !! would have at the speed of a tool: the step in which a tool first touches a blank at rest is
  !! no alarm.
  subroutine take_balance(balance, bodies, v_before, forces, supports, retired)
    type(energy_balance_t), intent(inout) :: balance
    type(assembly_t), intent(in) :: bodies
    type(field_t), intent(in) :: v_before(:)   !! by patch
    type(effect_slot_t), intent(in) :: forces(:), supports(:)
    type(effect_slot_t), intent(in), optional :: retired(:)     !! effects of earlier steps
    real(wp) :: scaling, lack, momentum_scale, lost(3)
    integer :: i, c, p

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
    balance%kinetic = 0.0_wp
    balance%momentum = 0.0_wp
    balance%angular_momentum = 0.0_wp
    momentum_scale = tiny(1.0_wp)
    do p = 1, size(bodies%blank%parts)
      associate (body => bodies%blank%parts(p), v => bodies%blank%parts(p)%motion%v)
        balance%kinetic = balance%kinetic + kinetic_energy(body, v_before(p)%values, v)
        balance%momentum = balance%momentum + momentum_of(body%mass, v)
        balance%angular_momentum = balance%angular_momentum &
          + 0.5_wp*(moment_of(body, v_before(p)%values) + moment_of(body, v))
        do c = 1, 3
          momentum_scale = momentum_scale + sum(body%mass*abs(v(:, :, :, c)))
        end do
      end associate
    end do
    associate (work => balance%tally%external_work)
      scaling = max(balance%kinetic_at_start, abs(work), balance%kinetic + balance%internal, &
                    tiny(1.0_wp))
      balance%reference = max(balance%reference, scaling, energy_of_pace(bodies))
      lack = balance%kinetic + balance%tally%tool_energy + balance%internal + balance%viscous &
             + balance%tally%contact_energy + balance%tally%friction_energy &
             + balance%tally%damping_energy - work - balance%kinetic_at_start
      balance%error = lack/scaling
      balance%alarm = lack/balance%reference
      lost = balance%momentum - balance%momentum_at_start - balance%impulse
      balance%momentum_reference = max(balance%momentum_reference, momentum_scale, &
                                       norm2(balance%impulse))
      balance%momentum_error = norm2(lost)/balance%momentum_reference
    end associate
  end subroutine take_balance

  !> Kinetic energy of the blank at the speed of the fastest tool.
  pure real(wp) function energy_of_pace(bodies) result(energy)
    type(assembly_t), intent(in) :: bodies
    integer :: t

    energy = 0.0_wp
    do t = 1, size(bodies%tools)
      energy = max(energy, 0.5_wp*mass_of(bodies%blank%parts)*pace_of(bodies%tools(t))**2)
    end do
  end function energy_of_pace

  !> Kinetic energy of the mass that moves: lumped, and what scaling adds to columns.
  pure real(wp) function kinetic_energy(body, v1, v2) result(energy)
    type(patch_body_t), intent(in) :: body
    real(wp), intent(in) :: v1(:, :, :, :), v2(:, :, :, :)
    real(wp), allocatable :: directions(:, :, :), difference1(:, :, :), difference2(:, :, :)
    integer :: c, k

    energy = 0.0_wp
    do c = 1, 3
      energy = energy + 0.5_wp*sum(body%mass*v1(:, :, :, c)*v2(:, :, :, c))
    end do
    if (.not. allocated(body%column_factor)) return
    directions = column_directions(body%motion%x)
    difference1 = column_differences(body%inertia, directions, v1)
    difference2 = column_differences(body%inertia, directions, v2)
    do k = 1, size(body%mass, 3)
      energy = energy + 0.5_wp*sum((body%column_factor - 1.0_wp)*body%mass(:, :, k) &
                                   *difference1(:, :, k)*difference2(:, :, k))
    end do
  end function kinetic_energy

  pure function momentum_of(mass, v) result(momentum)
    real(wp), intent(in) :: mass(:, :, :), v(:, :, :, :)
    real(wp) :: momentum(3)
    integer :: c

    do c = 1, 3
      momentum(c) = sum(mass*v(:, :, :, c))
    end do
  end function momentum_of

  !> Angular momentum about the origin of the lumped masses with velocities v. Inner forces change
  !! it neither with the velocities before nor with those behind the present positions.
  pure function moment_of(body, v) result(moment)
    type(patch_body_t), intent(in) :: body
    real(wp), intent(in) :: v(:, :, :, :)
    real(wp) :: moment(3)
    integer :: c, a, b

    do c = 1, 3
      a = mod(c, 3) + 1
      b = mod(c + 1, 3) + 1
      moment(c) = sum(body%mass*(body%motion%x(:, :, :, a)*v(:, :, :, b) &
                                 - body%motion%x(:, :, :, b)*v(:, :, :, a)))
    end do
  end function moment_of

  !> Elastic energy stored at the points, sum of s:C^-1:s/2 times their volume; what internal
  !! energy exceeds it by is plastic work. `volumes` has the layout of the stress.
  pure real(wp) function elastic_energy(law, n, m, stress, volumes) result(energy)
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: n, m                      !! points of a row, rows
    real(wp), intent(in) :: stress(n, 6, m), volumes(n, m)
    real(wp) :: mean, shear_part
    integer :: l, row

    energy = 0.0_wp
    do row = 1, m
      do l = 1, n
        associate (s => stress(l, :, row))
          mean = (s(1) + s(2) + s(3))/3.0_wp
          shear_part = 0.5_wp*sum((s(1:3) - mean)**2) + sum(s(4:6)**2)
          energy = energy + volumes(l, row)*0.5_wp*(mean**2/law%bulk + shear_part/law%shear)
        end associate
      end do
    end do
  end function elastic_energy

end module energy_balance
