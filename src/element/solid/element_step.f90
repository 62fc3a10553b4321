!> Largest frequency of single elements, which bounds that of the patch from above (B. M. Irons and
!! G. Treharne, A bound theorem in eigenvalues and its practical applications, 1971): no Lanczos
!! iteration that could stop too early, at the cost of a shorter step.
module element_step
  use kinds, only: wp
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use nurbs_solid, only: nurbs_solid_t
  use basis_tables, only: axis_table_t
  use element, only: force_report_t
  use ig_patch, only: ig_patch_t, tile_buffer_t
  use patch_setup, only: element_patch, new_tile_buffers
  use internal_force, only: internal_forces
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
  subroutine stable_element_step(patch, law, solid, dt, rate)
    type(ig_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), intent(out) :: dt, rate
    type(elastic_t) :: rigidity
    type(ig_patch_t) :: trial
    type(tile_buffer_t), allocatable :: buffers(:)
    type(force_report_t) :: report
    real(wp), allocatable :: force(:, :, :, :)
    real(wp) :: omega, damping

    rigidity%density = law%density
    rigidity%bulk = law%bulk
    rigidity%shear = law%shear
    omega = largest_element_frequency(patch, rigidity, solid)
    damping = 0.0_wp
    if (patch%viscosity%is_active .and. patch%viscosity%linear > 0.0_wp) then
      rigidity%shear = 0.0_wp
      damping = patch%viscosity%damping_ratio(law%bulk, omega, &
                                              largest_element_frequency(patch, rigidity, solid))
    end if
    dt = damped_step(omega, damping)
    trial = patch
    buffers = new_tile_buffers(patch)
    allocate (force, mold=solid%points)
    call internal_forces(trial, buffers, rigidity, 1.0_wp, solid%points, 0.0_wp*solid%points, &
                         force, report)
    rate = report%largest_rate
  end subroutine stable_element_step

  !> Largest angular frequency of an element with its share of the lumped mass [1/time]. Of
  !! elements that are alike only one is looked at.
  real(wp) function largest_element_frequency(patch, law, solid) result(omega)
    type(ig_patch_t), intent(in) :: patch
    type(elastic_t), intent(in) :: law
    type(nurbs_solid_t), intent(in) :: solid
    type(axis_table_t) :: axes(3)
    type(kind_t) :: kinds_seen(n_kept)
    type(kind_t) :: new
    integer :: e1, e2, e3, i, n_seen
    logical :: is_known

    axes = mass_tables(solid)
    omega = 0.0_wp
    n_seen = 0
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = 1, patch%axes(2)%n_elements
        do e1 = 1, patch%axes(1)%n_elements
          new%key = element_key(patch, solid, [e1, e2, e3])
          is_known = .false.
          do i = 1, min(n_seen, n_kept)
            is_known = is_known .or. all(abs(kinds_seen(i)%key - new%key) <= 1.0e-10_wp)
          end do
          if (is_known) cycle
          new%omega = element_frequency(patch, law, solid, axes, [e1, e2, e3])
          omega = max(omega, new%omega)
          n_seen = n_seen + 1
          kinds_seen(mod(n_seen - 1, n_kept) + 1) = new
        end do
      end do
    end do
  end function largest_element_frequency

  !> Numbers that elements of equal frequency share: basis, weights and shape, the last relative to
  !! the largest extent.
  pure function element_key(patch, solid, element) result(key)
    type(ig_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: element(3)
    real(wp), allocatable :: key(:)
    real(wp) :: extent
    integer :: low(3), high(3), axis, c

    allocate (key(0))
    do axis = 1, 3
      low(axis) = patch%axes(axis)%first(element(axis))
      key = [key, patch%axes(axis)%values(:, :, element(axis))]
    end do
    high = low + patch%axes%degree
    key = [key, solid%weights(low(1):high(1), low(2):high(2), low(3):high(3)) &
           /solid%weights(low(1), low(2), low(3))]
    extent = maxval(abs(solid%points))
    do c = 1, 3
      key = [key, (solid%points(low(1):high(1), low(2):high(2), low(3):high(3), c) &
                   - solid%points(low(1), low(2), low(3), c))/extent]
    end do
  end function element_key

  !> Root of the largest eigenvalue of M^-1/2 K M^-1/2 of one element.
  real(wp) function element_frequency(patch, law, solid, axes, element) result(omega)
    type(ig_patch_t), intent(in) :: patch
    type(elastic_t), intent(in) :: law
    type(nurbs_solid_t), intent(in) :: solid
    type(axis_table_t), intent(in) :: axes(3)      !! tables of the mass
    integer, intent(in) :: element(3)
    real(wp), allocatable :: stiffness(:, :), root(:), mass(:, :, :), values(:)
    integer :: low(3), high(3), axis, column

    low = [(patch%axes(axis)%first(element(axis)), axis=1, 3)]
    high = low + patch%axes%degree
    allocate (mass, mold=solid%weights)
    mass = 0.0_wp
    call add_masses(solid, axes, element, element, law%density, mass)
    root = sqrt([mass(low(1):high(1), low(2):high(2), low(3):high(3))])
    root = [root, root, root]
    stiffness = dense_stiffness(element_patch(patch, solid, element), law, &
                                solid%points(low(1):high(1), low(2):high(2), low(3):high(3), :))
    do column = 1, size(root)
      stiffness(:, column) = stiffness(:, column)/(root*root(column))
    end do
    values = eigenvalues(0.5_wp*(stiffness + transpose(stiffness)))
    omega = sqrt(values(size(values)))
  end function element_frequency

end module element_step
