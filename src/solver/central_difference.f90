!> Central differences with half-step velocities on a lumped mass.
!!
!! Threads share the rows along axis 2, as they do the tiles of elements: what one has in its cache
!! it needs again.
module central_difference
  use kinds, only: wp
  implicit none
  private

  public :: advance_velocities, advance_positions

  integer, parameter :: parallel_size = 1500   !! fewer control points are not worth waking threads

contains

  !> Velocities to the next half step: v + dt_mean (f_ext - f_int)/m.
  subroutine advance_velocities(n, dt_mean, mass, external_force, internal_force, v)
    integer, intent(in) :: n(3)                           !! control points along each axis
    real(wp), intent(in) :: dt_mean                       !! mean of the steps before and after
    real(wp), intent(in) :: mass(n(1), n(2), n(3))
    real(wp), intent(in) :: external_force(n(1), n(2), n(3), 3)
    real(wp), intent(in) :: internal_force(n(1), n(2), n(3), 3)
    real(wp), intent(inout) :: v(n(1), n(2), n(3), 3)
    real(wp) :: factor
    integer :: i, j, k

    !$omp parallel do schedule(static) private(i, k, factor) if (product(n) > parallel_size)
    do j = 1, n(2)
      do k = 1, n(3)
        ! Components written out: a loop over them around this one would keep it from vectorising.
        !$omp simd private(factor)
        do i = 1, n(1)
          factor = dt_mean/mass(i, j, k)
          v(i, j, k, 1) = v(i, j, k, 1) &
                          + factor*(external_force(i, j, k, 1) - internal_force(i, j, k, 1))
          v(i, j, k, 2) = v(i, j, k, 2) &
                          + factor*(external_force(i, j, k, 2) - internal_force(i, j, k, 2))
          v(i, j, k, 3) = v(i, j, k, 3) &
                          + factor*(external_force(i, j, k, 3) - internal_force(i, j, k, 3))
        end do
      end do
    end do
    !$omp end parallel do
  end subroutine advance_velocities

  !> Positions to the end of the step. Forces that have acted can be set to zero on the way: those
  !! of the next step are added to these.
  subroutine advance_positions(n, dt, v, x, spent)
    integer, intent(in) :: n(3)     !! control points along each axis
    real(wp), intent(in) :: dt, v(n(1), n(2), n(3), 3)
    real(wp), intent(inout) :: x(n(1), n(2), n(3), 3)
    real(wp), intent(inout), optional :: spent(n(1), n(2), n(3), 3)   !! set to zero
    integer :: i, j, k, c

    !$omp parallel do schedule(static) private(i, k, c) if (product(n) > parallel_size)
    do j = 1, n(2)
      do c = 1, 3
        do k = 1, n(3)
          !$omp simd
          do i = 1, n(1)
            x(i, j, k, c) = x(i, j, k, c) + dt*v(i, j, k, c)
          end do
        end do
      end do
      if (present(spent)) spent(:, j, :, :) = 0.0_wp
    end do
    !$omp end parallel do
  end subroutine advance_positions

end module central_difference
