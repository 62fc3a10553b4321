!> Free vibration of a patch about its stress-free shape.
module vibration
  use kinds, only: wp
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use ig_patch, only: ig_patch_t
  use spurious_modes, only: stiffness_among
  use lapack, only: eigenvalues
  implicit none
  private

  public :: free_frequencies

contains

  !> Angular frequencies [1/time] in rising order, one for each component of a control point that
  !! is not fixed: roots of the eigenvalues of M^-1/2 K M^-1/2, made dense by one force evaluation
  !! with each sign for every column. Rigid motions give zero up to round-off.
  function free_frequencies(patch, law, x, mass, is_fixed) result(omega)
    type(ig_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: x(:, :, :, :)           !! control points
    real(wp), intent(in) :: mass(:, :, :)           !! lumped mass of the control points
    logical, intent(in) :: is_fixed(:, :, :, :)     !! components that stay, shape of `x`
    real(wp), allocatable :: omega(:)
    type(ig_patch_t) :: trial
    type(elastic_t) :: rigidity
    real(wp), allocatable :: matrix(:, :), root(:)
    integer, allocatable :: free(:)
    integer :: i

    free = pack([(i, i=1, size(x))], .not. reshape(is_fixed, [size(x)]))
    root = sqrt([mass, mass, mass])
    root = root(free)
    trial = patch
    trial%viscosity%is_active = .false.
    deallocate (trial%state)
    allocate (trial%state(8, patch%axes(3)%n_points, 1, &
                          patch%axes(1)%n_points*patch%axes(2)%n_points, patch%n_blocks), &
              source=0.0_wp)
    rigidity%density = law%density
    rigidity%bulk = law%bulk
    rigidity%shear = law%shear
    matrix = stiffness_among(trial, rigidity, x, free)
    do i = 1, size(free)
      matrix(:, i) = matrix(:, i)/(root*root(i))
    end do
    omega = sqrt(max(0.0_wp, eigenvalues(0.5_wp*(matrix + transpose(matrix)))))
  end function free_frequencies

end module vibration
