!> Elastic energy stored at integration points.
module stored_energy
  use kinds, only: wp
  use block_law, only: block_law_t
  implicit none
  private

  public :: energy_of_points

  integer, parameter :: parallel_size = 4000   !! fewer points are not worth waking threads

contains

  !> Elastic energy stored at the points, sum of s:C^-1:s/2 times their volume; what internal
  !! energy exceeds it by is plastic work. `volumes` has the layout of the stress. Threads share
  !! the rows as they do the elements; the sum goes row by row.
  real(wp) function energy_of_points(law, n, m, stress, volumes) result(energy)
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: n, m                      !! points of a row, rows
    real(wp), intent(in) :: stress(n, 6, m), volumes(n, m)
    real(wp), allocatable :: energies(:)
    real(wp) :: by_bulk, by_shear
    integer :: row

    allocate (energies(m))
    by_bulk = 0.5_wp/law%bulk
    by_shear = 0.5_wp/law%shear
    !$omp parallel do schedule(static) if (n*m > parallel_size)
    do row = 1, m
      energies(row) = energy_of_row(n, by_bulk, by_shear, stress(:, :, row), volumes(:, row))
    end do
    !$omp end parallel do
    energy = sum(energies)
  end function energy_of_points

  pure real(wp) function energy_of_row(n, by_bulk, by_shear, s, volumes) result(energy)
    integer, intent(in) :: n
    real(wp), intent(in) :: by_bulk, by_shear        !! halves of their inverses
    real(wp), intent(in) :: s(n, 6), volumes(n)
    real(wp) :: mean, shear_part
    integer :: l

    energy = 0.0_wp
    !$omp simd private(mean, shear_part) reduction(+: energy)
    do l = 1, n
      mean = (s(l, 1) + s(l, 2) + s(l, 3))*(1.0_wp/3)
      shear_part = 0.5_wp*((s(l, 1) - mean)**2 + (s(l, 2) - mean)**2 + (s(l, 3) - mean)**2) &
                   + s(l, 4)**2 + s(l, 5)**2 + s(l, 6)**2
      energy = energy + volumes(l)*(mean**2*by_bulk + shear_part*by_shear)
    end do
  end function energy_of_row

end module stored_energy
