!> Largest stable time step of a patch, from the assembled operator.
!!
!! Lanczos on M^-1/2 K M^-1/2, where K acts through the force routine itself, so that degree,
!! rule, weights and scaled masses all count as they are. The Ritz value alone lies below the
!! true eigenvalue; its residual norm is added (B. N. Parlett, The Symmetric Eigenvalue Problem,
!! SIAM 1998, sec. 13.2).
module stable_step
  use kinds, only: wp
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use ig_patch, only: ig_patch_t, tile_buffer_t, force_report_t
  use internal_force, only: internal_forces
  use patch_setup, only: new_tile_buffers
  use column_scaling, only: column_directions, shrink_differences
  use lapack, only: tridiagonal_eigensystem
  implicit none
  private

  public :: largest_frequency, viscous_step, damping_ratio, damped_step

contains

  !> Bound of the largest angular frequency [1/time] and the geometric rate |J^-1|^2 that belongs
  !! to the shape it was found for. Stress and state of the patch are left alone.
  subroutine largest_frequency(patch, law, x, mass, omega, rate, factor)
    type(ig_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: x(:, :, :, :)     !! control points
    real(wp), intent(in) :: mass(:, :, :)     !! lumped mass of the control points
    real(wp), intent(out) :: omega, rate
    real(wp), intent(in), optional :: factor(:, :)   !! on the differences of each column
    integer, parameter :: max_vectors = 150
    real(wp), parameter :: tolerance = 1.0e-3_wp
    type(ig_patch_t) :: trial
    type(tile_buffer_t), allocatable :: buffers(:)
    type(elastic_t) :: rigidity
    real(wp), allocatable :: now(:, :, :, :), before(:, :, :, :), next(:, :, :, :)
    real(wp) :: alpha(max_vectors), beta(0:max_vectors), ritz, residual
    integer :: k

    trial = patch
    trial%viscosity%is_active = .false.
    buffers = new_tile_buffers(patch)
    rigidity%density = law%density
    rigidity%bulk = law%bulk
    rigidity%shear = law%shear
    deallocate (trial%state)
    allocate (trial%state(8, patch%axes(3)%n_points, 1, &
                          patch%axes(1)%n_points*patch%axes(2)%n_points, patch%n_blocks), &
              source=0.0_wp)
    now = scattered_start(shape(x))
    now = now/sqrt(sum(now**2))
    allocate (before, next, mold=x)
    before = 0.0_wp
    ritz = 0.0_wp
    residual = 0.0_wp
    beta(0) = 0.0_wp
    do k = 1, min(max_vectors, size(x))
      call apply_operator(trial, buffers, rigidity, x, mass, now, next, rate, factor)
      alpha(k) = sum(next*now)
      next = next - alpha(k)*now - beta(k - 1)*before
      beta(k) = sqrt(sum(next**2))
      call top_ritz_value(alpha(:k), beta(1:k), ritz, residual)
      if (residual <= tolerance*ritz .or. beta(k) <= 1.0e-12_wp*ritz) exit
      before = now
      now = next/beta(k)
    end do
    omega = sqrt(ritz + residual)
  end subroutine largest_frequency

  !> Stable step of the central difference with bulk viscosity. The velocity being half a step
  !! late, damping with the ratio `damping` shortens the step (T. Belytschko et al., Nonlinear
  !! Finite Elements, 2nd ed., Wiley 2014, eq. (6.2.17)). The linear factor damps like the bulk part
  !! of the stiffness times a time, so the largest ratio follows from the frequency of that part.
  real(wp) function viscous_step(patch, law, x, mass, omega, factor) result(dt)
    type(ig_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: x(:, :, :, :)     !! control points
    real(wp), intent(in) :: mass(:, :, :)     !! lumped mass of the control points
    real(wp), intent(in) :: omega             !! from `largest_frequency`
    real(wp), intent(in), optional :: factor(:, :)   !! on the differences of each column
    type(elastic_t) :: dilatation
    real(wp) :: damping, omega_bulk, rate

    damping = 0.0_wp
    if (patch%viscosity%is_active .and. patch%viscosity%linear > 0.0_wp) then
      dilatation%density = law%density
      dilatation%bulk = law%bulk
      dilatation%shear = 0.0_wp
      call largest_frequency(patch, dilatation, x, mass, omega_bulk, rate, factor)
      damping = damping_ratio(patch, law, omega, omega_bulk)
    end if
    dt = damped_step(omega, damping)
  end function viscous_step

  !> Largest damping ratio of the linear viscosity, from the largest frequency and that of the bulk
  !! part of the stiffness alone.
  pure real(wp) function damping_ratio(patch, law, omega, omega_bulk) result(damping)
    type(ig_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: omega, omega_bulk
    real(wp) :: lag

    associate (viscosity => patch%viscosity)
      lag = viscosity%linear*viscosity%density*viscosity%wave_speed*maxval(viscosity%length) &
            /law%bulk
    end associate
    damping = 0.5_wp*lag*omega_bulk**2/omega
  end function damping_ratio

  !> Stable step of a frequency with a damping ratio whose force comes half a step late.
  pure real(wp) function damped_step(omega, damping) result(dt)
    real(wp), intent(in) :: omega, damping

    dt = 2.0_wp/omega*(sqrt(1.0_wp + damping**2) - damping)
  end function damped_step

  !> next = M^-1/2 K M^-1/2 now: the force that a tiny displacement raises in a stress-free patch.
  !! Scaled columns have the inverse root D^-1/2 (1 - (1 - 1/sqrt(factor)) P), P being the
  !! projection on the differences and D the lumped mass.
  subroutine apply_operator(patch, buffers, law, x, mass, now, next, rate, factor)
    type(ig_patch_t), intent(inout) :: patch
    type(tile_buffer_t), intent(inout) :: buffers(:)
    type(elastic_t), intent(in) :: law
    real(wp), intent(in) :: x(:, :, :, :), mass(:, :, :), now(:, :, :, :)
    real(wp), intent(out) :: next(:, :, :, :), rate
    real(wp), intent(in), optional :: factor(:, :)
    real(wp), allocatable :: v(:, :, :, :)
    real(wp) :: scaling
    type(force_report_t) :: report
    integer :: c

    allocate (v, mold=x)
    do c = 1, 3
      v(:, :, :, c) = now(:, :, :, c)/sqrt(mass)
    end do
    if (present(factor)) call shrink_differences(mass, column_directions(x), sqrt(factor), v)
    ! Small beside the thinnest element, so that the force is linear in it to six digits.
    scaling = 1.0e-7_wp*minval(patch%viscosity%length)/maxval(abs(v))
    patch%stress = 0.0_wp
    call internal_forces(patch, buffers, law, scaling, x, v, next, report)
    rate = report%largest_rate
    do c = 1, 3
      next(:, :, :, c) = next(:, :, :, c)/(scaling*mass)
    end do
    if (present(factor)) call shrink_differences(mass, column_directions(x), sqrt(factor), next)
    do c = 1, 3
      next(:, :, :, c) = next(:, :, :, c)*sqrt(mass)
    end do
  end subroutine apply_operator

  !> Largest eigenvalue of the tridiagonal matrix and the norm of its residual.
  subroutine top_ritz_value(alpha, beta, ritz, residual)
    real(wp), intent(in) :: alpha(:), beta(:)
    real(wp), intent(out) :: ritz, residual
    real(wp) :: values(size(alpha)), vectors(size(alpha), size(alpha))
    logical :: is_solved
    integer :: n

    n = size(alpha)
    call tridiagonal_eigensystem(alpha, beta, values, vectors, is_solved)
    ritz = values(n)
    residual = merge(beta(n)*abs(vectors(n, n)), huge(1.0_wp), is_solved)
  end subroutine top_ritz_value

  !> A start vector that no symmetry of the patch can hide from, the same in every run.
  pure function scattered_start(n) result(start)
    integer, intent(in) :: n(4)
    real(wp) :: start(n(1), n(2), n(3), n(4))
    integer :: i, j, k, c
    real(wp) :: phase

    do c = 1, n(4)
      do k = 1, n(3)
        do j = 1, n(2)
          do i = 1, n(1)
            phase = 12.9898_wp*i + 78.233_wp*j + 37.719_wp*k + 4.581_wp*c
            start(i, j, k, c) = 2.0_wp*modulo(sin(phase)*43758.5453_wp, 1.0_wp) - 1.0_wp
          end do
        end do
      end do
    end do
  end function scattered_start

end module stable_step
