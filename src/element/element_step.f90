!> Largest frequency of single elements, which bounds that of the patch from above (B. M. Irons and
!! G. Treharne, A bound theorem in eigenvalues and its practical applications, 1971): no Lanczos
!! iteration that could stop too early, at the cost of a shorter step.
module element_step
  use kinds, only: wp
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use basis_tables, only: axis_table_t
  use element, only: element_t, force_report_t, next_element
  use lumped_mass, only: mass_tables, add_masses
  use spurious_modes, only: dense_stiffness
  use stable_step, only: damped_step
  use lapack, only: eigenvalues
  implicit none
  private

  public :: largest_element_frequency, stable_element_step

  integer, parameter :: n_kept = 64     ! kinds of elements that are told apart

  !> What an element's frequency depends on, and the frequency.
  type :: kind_t
    real(wp), allocatable :: key(:)
    real(wp) :: omega = 0.0_wp
  end type kind_t

contains

  !> Stable step of the central difference from single elements, bulk viscosity included, and the
  !! geometric rate |J^-1|^2 of the shape at the start.
  subroutine stable_element_step(element, law, dt, rate)
    class(element_t), intent(in) :: element
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: dt, rate        !! [time], [1/length^2]
    type(elastic_t) :: rigidity
    class(element_t), allocatable :: trial
    type(force_report_t) :: report
    real(wp) :: omega, damping

    rigidity%density = law%density
    rigidity%bulk = law%bulk
    rigidity%shear = law%shear
    omega = largest_element_frequency(element, rigidity)
    damping = 0.0_wp
    if (element%has_viscosity) then
      rigidity%shear = 0.0_wp
      damping = element%damping_ratio(law, omega, largest_element_frequency(element, rigidity))
      rigidity%shear = law%shear
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
      new%omega = element_frequency(element, law, axes, e)
      omega = max(omega, new%omega)
      n_seen = n_seen + 1
      kinds_seen(mod(n_seen - 1, n_kept) + 1) = new
    end do
  end function largest_element_frequency

  !> Numbers that elements of equal frequency share: basis, weights and shape, the last relative to
  !! the largest extent.
  pure function element_key(element, axes, e) result(key)
    class(element_t), intent(in) :: element
    type(axis_table_t), intent(in) :: axes(3)      !! tables of the mass
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
  real(wp) function element_frequency(element, law, axes, e) result(omega)
    class(element_t), intent(in) :: element
    type(elastic_t), intent(in) :: law
    type(axis_table_t), intent(in) :: axes(3)      !! tables of the mass
    integer, intent(in) :: e(3)
    class(element_t), allocatable :: one
    real(wp), allocatable :: stiffness(:, :), root(:), mass(:, :, :), values(:)
    integer :: low(3), high(3), axis, column

    low = [(axes(axis)%first(e(axis)), axis=1, 3)]
    high = low + axes%degree
    allocate (mass, mold=element%grid%weights)
    mass = 0.0_wp
    call add_masses(element%grid, axes, e, e, law%density, mass)
    root = sqrt([mass(low(1):high(1), low(2):high(2), low(3):high(3))])
    root = [root, root, root]
    call element%single(e, one)
    stiffness = dense_stiffness(one, law)
    do column = 1, size(root)
      stiffness(:, column) = stiffness(:, column)/(root*root(column))
    end do
    values = eigenvalues(0.5_wp*(stiffness + transpose(stiffness)))
    omega = sqrt(values(size(values)))
  end function element_frequency

end module element_step
