!> Kinematics of one point of eight elements side by side: what does not depend on degree or rule.
!!
!! A gradient holds d/dxi_j of x_i at (j + 3 (i - 1)) and of v_i nine places further. Positions
!! are those of the end of the step, velocities those of its middle.
module point_kinematics
  use kinds, only: wp
  implicit none
  private

  public :: end_cofactors, strain_increment, deformation_gradients

contains

  !> Weighted cofactors of the jacobian at the end of the step, and the smallest determinant.
  pure subroutine end_cofactors(n, q, g, weight, cofactor, smallest_det)
    integer, intent(in) :: n, q                         !! points of the row, this one
    real(wp), intent(in) :: g(8, 18), weight(8)
    real(wp), intent(inout) :: cofactor(8, n, 9)        !! entry (k, j) at j + 3 (k - 1)
    real(wp), intent(inout) :: smallest_det(8)
    real(wp) :: c1, c2, c3
    integer :: l

    !$omp simd private(c1, c2, c3)
    do l = 1, 8
      c1 = g(l, 5)*g(l, 9) - g(l, 6)*g(l, 8)
      c2 = g(l, 6)*g(l, 7) - g(l, 4)*g(l, 9)
      c3 = g(l, 4)*g(l, 8) - g(l, 5)*g(l, 7)
      smallest_det(l) = min(smallest_det(l), g(l, 1)*c1 + g(l, 2)*c2 + g(l, 3)*c3)
      cofactor(l, q, 1) = weight(l)*c1
      cofactor(l, q, 2) = weight(l)*c2
      cofactor(l, q, 3) = weight(l)*c3
      cofactor(l, q, 4) = weight(l)*(g(l, 3)*g(l, 8) - g(l, 2)*g(l, 9))
      cofactor(l, q, 5) = weight(l)*(g(l, 1)*g(l, 9) - g(l, 3)*g(l, 7))
      cofactor(l, q, 6) = weight(l)*(g(l, 2)*g(l, 7) - g(l, 1)*g(l, 8))
      cofactor(l, q, 7) = weight(l)*(g(l, 2)*g(l, 6) - g(l, 3)*g(l, 5))
      cofactor(l, q, 8) = weight(l)*(g(l, 3)*g(l, 4) - g(l, 1)*g(l, 6))
      cofactor(l, q, 9) = weight(l)*(g(l, 1)*g(l, 5) - g(l, 2)*g(l, 4))
    end do
  end subroutine end_cofactors

  !> Strain increment (engineering shear) and spin increment (12, 13, 23) from the velocity
  !! gradient at the middle of the step, with the jacobian there: J - dt/2 dv/dxi.
  pure subroutine strain_increment(n, q, dt, g, weight, dstrain, spin, volume, rate)
    integer, intent(in) :: n, q
    real(wp), intent(in) :: dt, g(8, 18), weight(8)
    real(wp), intent(inout) :: dstrain(8, n, 6), spin(8, n, 3)
    real(wp), intent(out) :: volume(8)    !! of the point, at the middle of the step
    real(wp), intent(out) :: rate(8)      !! squared Frobenius norm of the inverse jacobian
    real(wp) :: j11, j12, j13, j21, j22, j23, j31, j32, j33, det, scaling
    real(wp) :: c11, c12, c13, c21, c22, c23, c31, c32, c33, e12, e21, e13, e31, e23, e32
    integer :: l

    !$omp simd private(j11, j12, j13, j21, j22, j23, j31, j32, j33, det, scaling, c11, c12, &
    !$omp c13, c21, c22, c23, c31, c32, c33, e12, e21, e13, e31, e23, e32)
    do l = 1, 8
      j11 = g(l, 1) - 0.5_wp*dt*g(l, 10)
      j12 = g(l, 2) - 0.5_wp*dt*g(l, 11)
      j13 = g(l, 3) - 0.5_wp*dt*g(l, 12)
      j21 = g(l, 4) - 0.5_wp*dt*g(l, 13)
      j22 = g(l, 5) - 0.5_wp*dt*g(l, 14)
      j23 = g(l, 6) - 0.5_wp*dt*g(l, 15)
      j31 = g(l, 7) - 0.5_wp*dt*g(l, 16)
      j32 = g(l, 8) - 0.5_wp*dt*g(l, 17)
      j33 = g(l, 9) - 0.5_wp*dt*g(l, 18)
      include 'strain_point.inc'
    end do
  end subroutine strain_increment

  !> Deformation gradients at the start and the end of the step: the jacobians there times the
  !! inverse jacobian of the shape at the start of all, row by row.
  pure subroutine deformation_gradients(dt, g, scaling, reference, f0, f1)
    real(wp), intent(in) :: dt, g(8, 18)
    real(wp), intent(in) :: scaling(8)           !! that turns g into gradients of x and v
    real(wp), intent(in) :: reference(8, 9)      !! inverse jacobian, row by row
    real(wp), intent(out) :: f0(8, 9), f1(8, 9)
    integer :: i, j, k

    f0 = 0.0_wp
    f1 = 0.0_wp
    do i = 1, 3
      do k = 1, 3
        do j = 1, 3
          associate (x => g(:, j + 3*(i - 1)), v => g(:, 9 + j + 3*(i - 1)), &
                     inverse => scaling*reference(:, k + 3*(j - 1)))
            f1(:, k + 3*(i - 1)) = f1(:, k + 3*(i - 1)) + x*inverse
            f0(:, k + 3*(i - 1)) = f0(:, k + 3*(i - 1)) + (x - dt*v)*inverse
          end associate
        end do
      end do
    end do
  end subroutine deformation_gradients

end module point_kinematics
