!> Largest stable time step.
!!
!! Of a body, from the assembled operator: Lanczos on M^-1/2 K M^-1/2, where K acts through the
!! force routine itself, so that degree, rule, weights, seams and scaled masses all count as they
!! are. The Ritz value alone lies below the true eigenvalue; its residual norm is added (B. N.
!! Parlett, The Symmetric Eigenvalue Problem, SIAM 1998, sec. 13.2).
!!
!! Of single elements, whose largest frequency bounds that of the body from above (B. M. Irons and
!! G. Treharne, A bound theorem in eigenvalues and its practical applications, 1971): no iteration
!! that could stop too early, at the cost of a shorter step.
module stable_step
  use kinds, only: wp
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use patch_seams, only: seams_t, is_counted, no_seams
  use basis_tables, only: axis_table_t
  use element, only: element_t, part_t, force_report_t, next_element
  use lumped_mass, only: mass_tables
  use spurious_modes, only: dense_stiffness
  use thickness_masses, only: column_directions, shrink_differences
  use shell_joints, only: shell_joints_t
  use body_parts, only: forces_of_parts, elastic_copies, share_internal_forces, lead_edges
  use linear_algebra, only: eigenvalues, tridiagonal_eigensystem
  implicit none
  private

  public :: largest_frequency, viscous_step, largest_element_frequency, stable_element_step, &
            bending_rate

  integer, parameter :: n_kept = 64     ! kinds of elements that are told apart

  !> A vector on the control points of one patch.
  type :: field_t
    real(wp), allocatable :: at(:, :, :, :)
    logical, allocatable :: counts(:, :, :, :)   ! once for each place; only where there are seams
  end type field_t

  !> What an element's frequency depends on, and the frequency.
  type :: kind_t
    real(wp), allocatable :: key(:)
    real(wp) :: omega = 0.0_wp
  end type kind_t

contains

  !> Bound of the largest angular frequency [1/time] and the geometric rate |J^-1|^2 that belongs
  !! to the shape it was found for: that of the control points now.
  subroutine largest_frequency(bodies, seams, law, omega, rate, joints)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: omega, rate
    type(shell_joints_t), intent(in), optional :: joints   !! of shells that pass moments
    integer, parameter :: max_vectors = 150
    real(wp), parameter :: tolerance = 1.0e-3_wp
    type(part_t), allocatable :: trial(:)
    type(seams_t) :: shared
    type(shell_joints_t) :: springs
    type(elastic_t) :: rigidity
    type(field_t), allocatable :: now(:), before(:), next(:)
    real(wp) :: alpha(max_vectors), beta(0:max_vectors), ritz, residual
    integer :: k, n, p

    rigidity = elastic_t(density=law%density, bulk=law%bulk, shear=law%shear)
    shared = seams
    if (present(joints)) springs = joints
    trial = elastic_copies(bodies)
    call set_start(shared, trial, now)
    call divide_vector(now, norm_of(now))
    before = now
    next = now
    ritz = 0.0_wp
    residual = 0.0_wp
    beta(0) = 0.0_wp
    n = 0
    do p = 1, size(now)
      n = n + size(now(p)%at)
      if (allocated(now(p)%counts)) n = n - count(.not. now(p)%counts)
    end do
    do k = 1, min(max_vectors, n)
      call apply_operator(trial, shared, springs, rigidity, now, next, rate)
      alpha(k) = product_of(next, now)
      do p = 1, size(next)
        next(p)%at = next(p)%at - alpha(k)*now(p)%at - beta(k - 1)*before(p)%at   ! beta(0) is zero
      end do
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
      dilatation = dilatation_of(bodies(1)%element, law)
      call largest_frequency(bodies, seams, dilatation, omega_bulk, rate)
      damping = maxval([(bodies(p)%element%damping_ratio(law, omega, omega_bulk), &
                         p=1, size(bodies))])
      damping = damping + 0.5_wp*bending_rate(bodies, seams, law, dilatation)/omega
    end if
    dt = damped_step(omega, damping)
  end function viscous_step

  !> Bound of twice the damping ratio times the frequency that the viscosity of bending gives a
  !! motion [1/time]: the largest eigenvalue of M^-1 C. Shares of the membrane and of bending add up
  !! to a bound of both.
  real(wp) function bending_rate(bodies, seams, law, dilatation) result(largest)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    type(elastic_t), intent(in) :: dilatation    !! of the law, see `dilatation_of`
    type(part_t), allocatable :: copies(:)
    real(wp) :: lag, omega, rate
    integer :: p

    largest = 0.0_wp
    lag = minval([(bodies(p)%element%bending_lag(law), p=1, size(bodies))])
    if (.not. lag > 0.0_wp) return
    allocate (copies(size(bodies)))
    do p = 1, size(bodies)
      call bodies(p)%element%bending_copy(law, lag, copies(p)%element)
    end do
    call largest_frequency(copies, seams, dilatation, omega, rate)
    largest = lag*omega**2
  end function bending_rate

  !> A material with the bulk part of the stiffness alone. In plane stress the same stress,
  !! K (d11 + d22) along both axes, is that of a Poisson's ratio close to one.
  pure function dilatation_of(element, law) result(dilatation)
    class(element_t), intent(in) :: element
    class(block_law_t), intent(in) :: law
    type(elastic_t) :: dilatation
    real(wp), parameter :: poisson = 0.98_wp
    real(wp) :: young

    dilatation = elastic_t(density=law%density, bulk=law%bulk)
    if (.not. element%is_surface) return
    young = law%bulk*(1.0_wp - poisson**2)
    dilatation%bulk = young/(3.0_wp*(1.0_wp - 2.0_wp*poisson))
    dilatation%shear = young/(2.0_wp*(1.0_wp + poisson))
  end function dilatation_of

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
  subroutine apply_operator(bodies, seams, springs, law, now, next, rate)
    type(part_t), intent(inout) :: bodies(:)
    type(seams_t), intent(inout) :: seams
    type(shell_joints_t), intent(inout) :: springs
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
    call lead_edges(bodies)
    ! Small beside the thinnest element, so that the force is linear in it to six digits.
    scaling = 1.0e-7_wp*smallest/largest
    call forces_of_parts(bodies, seams, law, scaling, report, .true., springs)
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

  !> Stable step of the central difference from single elements, bulk viscosity included, and the
  !! geometric rate |J^-1|^2 of the shape at the start.
  subroutine stable_element_step(element, law, dt, rate)
    class(element_t), intent(in) :: element
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: dt, rate        !! [time], [1/length^2]
    type(elastic_t) :: rigidity, dilatation
    class(element_t), allocatable :: trial
    type(part_t), allocatable :: alone(:)
    type(force_report_t) :: report
    real(wp) :: omega, damping

    rigidity = elastic_t(density=law%density, bulk=law%bulk, shear=law%shear)
    omega = largest_element_frequency(element, rigidity)
    damping = 0.0_wp
    if (element%has_viscosity) then
      dilatation = dilatation_of(element, law)
      damping = element%damping_ratio(law, omega, largest_element_frequency(element, dilatation))
      allocate (alone(1))
      allocate (alone(1)%element, source=element)
      damping = damping + 0.5_wp*bending_rate(alone, no_seams(1), law, dilatation)/omega
    end if
    dt = damped_step(omega, damping)
    call element%elastic_copy(trial)
    trial%motion%x = element%grid%points
    trial%motion%v = 0.0_wp
    call trial%trial_forces(rigidity, 1.0_wp, report)
    rate = report%largest_rate
  end subroutine stable_element_step

  !> Largest angular frequency of an element with its share of the lumped mass [1/time]. Of
  !! elements that are alike only one is looked at.
  real(wp) function largest_element_frequency(element, law) result(omega)
    class(element_t), intent(in) :: element
    type(elastic_t), intent(in) :: law
    type(axis_table_t) :: axes(3)
    type(kind_t) :: kinds_seen(n_kept)
    type(kind_t) :: new
    integer :: e(3), n, i, n_seen
    logical :: is_known

    axes = mass_tables(element%grid)
    omega = 0.0_wp
    n_seen = 0
    e = [0, 1, 1]
    do n = 1, product(element%n_elements)
      call next_element(element%n_elements, e)
      new%key = element_key(element, axes, e)
      is_known = .false.
      do i = 1, min(n_seen, n_kept)
        is_known = is_known .or. all(abs(kinds_seen(i)%key - new%key) <= 1.0e-10_wp)
      end do
      if (is_known) cycle
      new%omega = element_frequency(element, law, e)
      omega = max(omega, new%omega)
      n_seen = n_seen + 1
      kinds_seen(mod(n_seen - 1, n_kept) + 1) = new
    end do
  end function largest_element_frequency

  !> Numbers that elements of equal frequency share: basis, weights and shape, the last relative to
  !! the largest extent.
  pure function element_key(element, axes, e) result(key)
    class(element_t), intent(in) :: element
    type(axis_table_t), intent(in) :: axes(3)      !! basis at some points
    integer, intent(in) :: e(3)
    real(wp), allocatable :: key(:)
    real(wp) :: extent
    integer :: low(3), high(3), axis, c

    allocate (key(0))
    do axis = 1, 3
      low(axis) = axes(axis)%first(e(axis))
      key = [key, axes(axis)%values(:, :, e(axis))]
    end do
    high = low + axes%degree
    associate (grid => element%grid)
      key = [key, grid%weights(low(1):high(1), low(2):high(2), low(3):high(3)) &
             /grid%weights(low(1), low(2), low(3))]
      extent = maxval(abs(grid%points))
      do c = 1, 3
        key = [key, (grid%points(low(1):high(1), low(2):high(2), low(3):high(3), c) &
                     - grid%points(low(1), low(2), low(3), c))/extent]
      end do
    end associate
  end function element_key

  !> Root of the largest eigenvalue of M^-1/2 K M^-1/2 of one element.
  real(wp) function element_frequency(element, law, e) result(omega)
    class(element_t), intent(in) :: element
    type(elastic_t), intent(in) :: law
    integer, intent(in) :: e(3)
    class(element_t), allocatable :: one
    real(wp), allocatable :: stiffness(:, :), root(:), values(:)
    integer :: column

    call element%single(e, one)
    root = sqrt([one%mass, one%mass, one%mass])
    stiffness = dense_stiffness(one, law)
    do column = 1, size(root)
      stiffness(:, column) = stiffness(:, column)/(root*root(column))
    end do
    values = eigenvalues(0.5_wp*(stiffness + transpose(stiffness)))
    omega = sqrt(values(size(values)))
  end function element_frequency

end module stable_step
