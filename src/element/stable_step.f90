!> Largest stable time step of a body, from the assembled operator.
!!
!! Lanczos on M^-1/2 K M^-1/2, where K acts through the force routine itself, so that degree,
!! rule, weights, seams and scaled masses all count as they are. The Ritz value alone lies below
!! the true eigenvalue; its residual norm is added (B. N. Parlett, The Symmetric Eigenvalue
!! Problem, SIAM 1998, sec. 13.2).
module stable_step
  use kinds, only: wp
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use seams, only: seams_t, is_counted
  use element, only: element_t, part_t, force_report_t
  use column_scaling, only: column_directions, shrink_differences
  use body_parts, only: forces_of_parts, elastic_copies, share_internal_forces
  use lapack, only: tridiagonal_eigensystem
  implicit none
  private

  public :: largest_frequency, viscous_step, damped_step

  !> A vector on the control points of one patch.
  type :: field_t
    real(wp), allocatable :: at(:, :, :, :)
    logical, allocatable :: counts(:, :, :, :)   ! once for each place; only where there are seams
  end type field_t

contains

  !> Bound of the largest angular frequency [1/time] and the geometric rate |J^-1|^2 that belongs
  !! to the shape it was found for: that of the control points now.
  subroutine largest_frequency(bodies, seams, law, omega, rate)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: omega, rate
    integer, parameter :: max_vectors = 150
    real(wp), parameter :: tolerance = 1.0e-3_wp
    type(part_t), allocatable :: trial(:)
    type(seams_t) :: joints
    type(elastic_t) :: rigidity
    type(field_t), allocatable :: now(:), before(:), next(:)
    real(wp) :: alpha(max_vectors), beta(0:max_vectors), ritz, residual
    integer :: k, n

    rigidity%density = law%density
    rigidity%bulk = law%bulk
    rigidity%shear = law%shear
    joints = seams
    trial = elastic_copies(bodies)
    call set_start(joints, trial, now)
    call divide_vector(now, norm_of(now))
    before = now
    next = now
    ritz = 0.0_wp
    residual = 0.0_wp
    beta(0) = 0.0_wp
    n = dimension_of(now)
    do k = 1, min(max_vectors, n)
      call apply_operator(trial, joints, rigidity, now, next, rate)
      alpha(k) = product_of(next, now)
      call orthogonalise(next, alpha(k), now, beta(k - 1), before)   ! beta(0) is zero
      beta(k) = norm_of(next)
      if (.not. beta(k) <= huge(1.0_wp)) then   ! no numbers: nor is the frequency
        ritz = beta(k)
        exit
      end if
      call top_ritz_value(alpha(:k), beta(1:k), ritz, residual)
      if (residual <= tolerance*ritz .or. beta(k) <= 1.0e-12_wp*ritz) exit
      before = now
      now = next
      call divide_vector(now, beta(k))
    end do
    omega = sqrt(ritz + residual)
  end subroutine largest_frequency

  !> Stable step of the central difference with bulk viscosity. The velocity being half a step
  !! late, damping with the ratio `damping` shortens the step (T. Belytschko et al., Nonlinear
  !! Finite Elements, 2nd ed., Wiley 2014, eq. (6.2.17)). The linear factor damps like the bulk part
  !! of the stiffness times a time, so the largest ratio follows from the frequency of that part.
  real(wp) function viscous_step(bodies, seams, law, omega) result(dt)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: omega             !! from `largest_frequency`
    type(elastic_t) :: dilatation
    real(wp) :: damping, omega_bulk, rate
    integer :: p

    damping = 0.0_wp
    if (bodies(1)%element%has_viscosity) then
      dilatation%density = law%density
      dilatation%bulk = law%bulk
      dilatation%shear = 0.0_wp
      call largest_frequency(bodies, seams, dilatation, omega_bulk, rate)
      damping = maxval([(bodies(p)%element%damping_ratio(law, omega, omega_bulk), &
                         p=1, size(bodies))])
    end if
    dt = damped_step(omega, damping)
  end function viscous_step

  !> Stable step of a frequency with a damping ratio whose force comes half a step late.
  pure real(wp) function damped_step(omega, damping) result(dt)
    real(wp), intent(in) :: omega, damping

    dt = 2.0_wp/omega*(sqrt(1.0_wp + damping**2) - damping)
  end function damped_step

  !> The start vector, alike in all members of a seam.
  subroutine set_start(seams, trial, start)
    type(seams_t), intent(inout) :: seams
    type(part_t), intent(inout) :: trial(:)
    type(field_t), allocatable, intent(out) :: start(:)
    integer :: p, n(4)

    allocate (start(size(trial)))
    do p = 1, size(trial)
      associate (motion => trial(p)%element%motion)
        n = shape(motion%x)
        motion%internal_force = scattered_start(n, p)
        if (seams%n_groups > 0) start(p)%counts = reshape( &
          spread(is_counted(seams, p, product(n(:3))), 2, 3), n)
      end associate
    end do
    call share_internal_forces(trial, seams)
    do p = 1, size(trial)
      start(p)%at = trial(p)%element%motion%internal_force
    end do
  end subroutine set_start

  !> next = M^-1/2 K M^-1/2 now: the force that a tiny displacement raises in a stress-free body.
  !! Scaled columns have the inverse root D^-1/2 (1 - (1 - 1/sqrt(factor)) P), P being the
  !! projection on the differences and D the lumped mass.
  subroutine apply_operator(bodies, seams, law, now, next, rate)
    type(part_t), intent(inout) :: bodies(:)
    type(seams_t), intent(inout) :: seams
    type(elastic_t), intent(in) :: law
    type(field_t), intent(in) :: now(:)
    type(field_t), intent(inout) :: next(:)
    real(wp), intent(out) :: rate
    real(wp) :: scaling, smallest, largest
    type(force_report_t) :: report
    integer :: p, c

    smallest = huge(1.0_wp)
    largest = 0.0_wp
    do p = 1, size(bodies)
      associate (body => bodies(p)%element, v => bodies(p)%element%motion%v)
        do c = 1, 3
          v(:, :, :, c) = now(p)%at(:, :, :, c)/sqrt(body%inertia)
        end do
        if (allocated(body%column_factor)) call shrink_columns(body, v)
        smallest = min(smallest, body%shortest)
        largest = max(largest, maxval(abs(v)))
      end associate
    end do
    ! Small beside the thinnest element, so that the force is linear in it to six digits.
    scaling = 1.0e-7_wp*smallest/largest
    call forces_of_parts(bodies, seams, law, scaling, report, is_trial=.true.)
    rate = report%largest_rate
    do p = 1, size(bodies)
      associate (body => bodies(p)%element)
        do c = 1, 3
          next(p)%at(:, :, :, c) = body%motion%internal_force(:, :, :, c)/(scaling*body%inertia)
        end do
        if (allocated(body%column_factor)) call shrink_columns(body, next(p)%at)
        do c = 1, 3
          next(p)%at(:, :, :, c) = next(p)%at(:, :, :, c)*sqrt(body%inertia)
        end do
      end associate
    end do
  end subroutine apply_operator

  pure subroutine shrink_columns(body, field)
    class(element_t), intent(in) :: body
    real(wp), intent(inout) :: field(:, :, :, :)

    call shrink_differences(body%inertia, column_directions(body%motion%x), &
                            sqrt(body%column_factor), field)
  end subroutine shrink_columns

  !> next - a now - b before.
  pure subroutine orthogonalise(next, a, now, b, before)
    type(field_t), intent(inout) :: next(:)
    type(field_t), intent(in) :: now(:), before(:)
    real(wp), intent(in) :: a, b
    integer :: p

    do p = 1, size(next)
      next(p)%at = next(p)%at - a*now(p)%at - b*before(p)%at
    end do
  end subroutine orthogonalise

  !> Scalar product; places at seams count once.
  pure real(wp) function product_of(a, b) result(total)
    type(field_t), intent(in) :: a(:), b(:)
    integer :: p

    total = 0.0_wp
    do p = 1, size(a)
      if (allocated(a(p)%counts)) then
        total = total + sum(a(p)%at*b(p)%at, mask=a(p)%counts)
      else
        total = total + sum(a(p)%at*b(p)%at)
      end if
    end do
  end function product_of

  pure real(wp) function norm_of(a) result(norm)
    type(field_t), intent(in) :: a(:)

    norm = sqrt(product_of(a, a))
  end function norm_of

  pure integer function dimension_of(a) result(n)
    type(field_t), intent(in) :: a(:)
    integer :: p

    n = 0
    do p = 1, size(a)
      n = n + size(a(p)%at)
      if (allocated(a(p)%counts)) n = n - count(.not. a(p)%counts)
    end do
  end function dimension_of

  pure subroutine divide_vector(a, divisor)
    type(field_t), intent(inout) :: a(:)
    real(wp), intent(in) :: divisor
    integer :: p

    do p = 1, size(a)
      a(p)%at = a(p)%at/divisor
    end do
  end subroutine divide_vector

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

  !> A start vector that no symmetry of the body can hide from, the same in every run.
  pure function scattered_start(n, patch) result(start)
    integer, intent(in) :: n(4), patch
    real(wp) :: start(n(1), n(2), n(3), n(4))
    integer :: i, j, k, c
    real(wp) :: phase

    do c = 1, n(4)
      do k = 1, n(3)
        do j = 1, n(2)
          do i = 1, n(1)
            phase = 12.9898_wp*i + 78.233_wp*j + 37.719_wp*k + 4.581_wp*c + 9.151_wp*(patch - 1)
            start(i, j, k, c) = 2.0_wp*modulo(sin(phase)*43758.5453_wp, 1.0_wp) - 1.0_wp
          end do
        end do
      end do
    end do
  end function scattered_start

end module stable_step
