!> Central differences with half-step velocities on a lumped mass.
module central_difference
  use kinds, only: wp
  implicit none
  private

  public :: advance_velocities, advance_positions

contains

  !> Velocities to the next half step: v + dt_mean (f_ext - f_int)/m.
  subroutine advance_velocities(n, dt_mean, mass, external_force, internal_force, v)
    integer, intent(in) :: n                              !! control points
    real(wp), intent(in) :: dt_mean                       !! mean of the steps before and after
    real(wp), intent(in) :: mass(n)
    real(wp), intent(in) :: external_force(n, 3), internal_force(n, 3)
    real(wp), intent(inout) :: v(n, 3)
    integer :: i

    ! Components written out: a loop over them around this one would keep it from vectorising.
    !$omp parallel do simd schedule(static) if (n > 4000)
    do i = 1, n
      v(i, 1) = v(i, 1) + dt_mean*(external_force(i, 1) - internal_force(i, 1))/mass(i)
      v(i, 2) = v(i, 2) + dt_mean*(external_force(i, 2) - internal_force(i, 2))/mass(i)
      v(i, 3) = v(i, 3) + dt_mean*(external_force(i, 3) - internal_force(i, 3))/mass(i)
    end do
    !$omp end parallel do simd
  end subroutine advance_velocities

  !> Positions to the end of the step.
  subroutine advance_positions(n, dt, v, x)
    integer, intent(in) :: n        !! components
    real(wp), intent(in) :: dt, v(n)
    real(wp), intent(inout) :: x(n)
    integer :: i

    !$omp parallel do simd schedule(static) if (n > 12000)
    do i = 1, n
      x(i) = x(i) + dt*v(i)
    end do
    !$omp end parallel do simd
  end subroutine advance_positions

end module central_difference
