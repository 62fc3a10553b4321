!> Sums over the control points of a patch that tell how it moves: energy, momentum, moment.
!!
!! Threads share the rows along axis 2, as they do where the points move. Each row has sums of its
!! own, which are added in the order of the rows: the same bits with any number of threads.
module motion_sums
  use kinds, only: wp
  implicit none
  private

  public :: motion_sums_t, sums_of_motion

  integer, parameter :: parallel_size = 1500   !! fewer control points are not worth waking threads

  !> Of the lumped masses, at a time step between two velocities half a step to either side.
  type :: motion_sums_t
    real(wp) :: mass = 0.0_wp
    real(wp) :: kinetic = 0.0_wp            !! from the products of both velocities
    real(wp) :: momentum(3) = 0.0_wp        !! with the later one
    real(wp) :: magnitude = 0.0_wp          !! the same of all amounts |v1| + |v2| + |v3|
    real(wp) :: angular_momentum(3) = 0.0_wp   !! about the origin, with the mean of both
  end type motion_sums_t

contains

  !> The sums of one patch.
  function sums_of_motion(n, mass, x, v_before, v) result(sums)
    integer, intent(in) :: n(3)              !! control points along each axis
    real(wp), intent(in) :: mass(n(1), n(2), n(3))
    real(wp), intent(in) :: x(n(1), n(2), n(3), 3)      !! places now
    real(wp), intent(in) :: v_before(n(1), n(2), n(3), 3), v(n(1), n(2), n(3), 3)
    type(motion_sums_t) :: sums
    type(motion_sums_t) :: rows(n(2))
    integer :: j, k

    !$omp parallel do schedule(static) private(k) if (product(n) > parallel_size)
    do j = 1, n(2)
      do k = 1, n(3)
        call add_line(n, j, k, mass, x, v_before, v, rows(j))
      end do
    end do
    !$omp end parallel do
    do j = 1, n(2)
      sums%mass = sums%mass + rows(j)%mass
      sums%kinetic = sums%kinetic + rows(j)%kinetic
      sums%momentum = sums%momentum + rows(j)%momentum
      sums%magnitude = sums%magnitude + rows(j)%magnitude
      sums%angular_momentum = sums%angular_momentum + rows(j)%angular_momentum
    end do
  end function sums_of_motion

  !> Add the points of a line along axis 1. Components are written out, as a loop over them would
  !! keep that over the points from vectorising.
  pure subroutine add_line(n, j, k, mass, x, v_before, v, sums)
    integer, intent(in) :: n(3), j, k
    real(wp), intent(in) :: mass(n(1), n(2), n(3)), x(n(1), n(2), n(3), 3)
    real(wp), intent(in) :: v_before(n(1), n(2), n(3), 3), v(n(1), n(2), n(3), 3)
    type(motion_sums_t), intent(inout) :: sums
    real(wp) :: m, w1, w2, w3, all, energy, p1, p2, p3, l1, l2, l3, amount
    integer :: i

    all = 0.0_wp
    energy = 0.0_wp
    p1 = 0.0_wp
    p2 = 0.0_wp
    p3 = 0.0_wp
    l1 = 0.0_wp
    l2 = 0.0_wp
    l3 = 0.0_wp
    amount = 0.0_wp
    !$omp simd private(m, w1, w2, w3) reduction(+: all, energy, p1, p2, p3, l1, l2, l3, amount)
    do i = 1, n(1)
      m = mass(i, j, k)
      all = all + m
      energy = energy + m*(v_before(i, j, k, 1)*v(i, j, k, 1) + v_before(i, j, k, 2)*v(i, j, k, 2) &
                           + v_before(i, j, k, 3)*v(i, j, k, 3))
      p1 = p1 + m*v(i, j, k, 1)
      p2 = p2 + m*v(i, j, k, 2)
      p3 = p3 + m*v(i, j, k, 3)
      amount = amount + m*(abs(v(i, j, k, 1)) + abs(v(i, j, k, 2)) + abs(v(i, j, k, 3)))
      w1 = v_before(i, j, k, 1) + v(i, j, k, 1)
      w2 = v_before(i, j, k, 2) + v(i, j, k, 2)
      w3 = v_before(i, j, k, 3) + v(i, j, k, 3)
      l1 = l1 + m*(x(i, j, k, 2)*w3 - x(i, j, k, 3)*w2)
      l2 = l2 + m*(x(i, j, k, 3)*w1 - x(i, j, k, 1)*w3)
      l3 = l3 + m*(x(i, j, k, 1)*w2 - x(i, j, k, 2)*w1)
    end do
    sums%mass = sums%mass + all
    sums%kinetic = sums%kinetic + 0.5_wp*energy
    sums%momentum = sums%momentum + [p1, p2, p3]
    sums%magnitude = sums%magnitude + amount
    sums%angular_momentum = sums%angular_momentum + 0.5_wp*[l1, l2, l3]
  end subroutine add_line

end module motion_sums
