!> Kinematics of first order in the step: all from the jacobian at its end. The solver has them of
!! second order; these stand in the benchmark for what the same kernel costs with the least of
!! physics that makes a Jaumann rate.
module first_order
  use kinds, only: wp
  implicit none
  private

  public :: first_increment, jaumann_turn

contains

  !> Strain increment (engineering shear), spin increment (12, 13, 23), cofactors and
  !! volume of one point of eight elements; arrays as in `point_kinematics`.
  pure subroutine first_increment(n, q, g, weight, dstrain, spin, cofactor, volume, rate, &
                                  smallest_det)
    integer, intent(in) :: n, q                         !! points of the row, this one
    real(wp), intent(in) :: g(8, 18), weight(8)
    real(wp), intent(inout) :: dstrain(8, n, 6), spin(8, n, 3), cofactor(8, n, 9)
    real(wp), intent(out) :: volume(8), rate(8)         !! rate: squared norm of inverse jacobian
    real(wp), intent(inout) :: smallest_det(8)
    real(wp) :: j11, j12, j13, j21, j22, j23, j31, j32, j33, det, scaling
    real(wp) :: c11, c12, c13, c21, c22, c23, c31, c32, c33, e12, e21, e13, e31, e23, e32
    integer :: l

    !$omp simd private(j11, j12, j13, j21, j22, j23, j31, j32, j33, det, scaling, c11, c12, &
    !$omp c13, c21, c22, c23, c31, c32, c33, e12, e21, e13, e31, e23, e32)
    do l = 1, 8
      j11 = g(l, 1); j12 = g(l, 2); j13 = g(l, 3)
      j21 = g(l, 4); j22 = g(l, 5); j23 = g(l, 6)
      j31 = g(l, 7); j32 = g(l, 8); j33 = g(l, 9)
      include 'strain_point.inc'
      smallest_det(l) = min(smallest_det(l), det)
      cofactor(l, q, 1) = c11
      cofactor(l, q, 2) = c12
      cofactor(l, q, 3) = c13
      cofactor(l, q, 4) = c21
      cofactor(l, q, 5) = c22
      cofactor(l, q, 6) = c23
      cofactor(l, q, 7) = c31
      cofactor(l, q, 8) = c32
      cofactor(l, q, 9) = c33
    end do
  end subroutine first_increment

  !> Stress of a row turned by the Jaumann rate over one step: s + W s - s W.
  pure subroutine jaumann_turn(n, spin, stress)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n, 3)          !! increment 12 13 23
    real(wp), intent(inout) :: stress(n, 6)     !! 11 22 33 12 13 23
    real(wp) :: w1, w2, w3, t1, t2, t3, t4, t5, t6, p1, p2, p3, p4, p5, p6
    integer :: l

    !$omp simd private(w1, w2, w3, t1, t2, t3, t4, t5, t6, p1, p2, p3, p4, p5, p6)
    do l = 1, n
      t1 = stress(l, 1); t2 = stress(l, 2); t3 = stress(l, 3)
      t4 = stress(l, 4); t5 = stress(l, 5); t6 = stress(l, 6)
      include 'spin_product.inc'
      stress(l, 1) = t1 + 2.0_wp*p1
      stress(l, 2) = t2 - 2.0_wp*p2
      stress(l, 3) = t3 - 2.0_wp*p3
      stress(l, 4) = t4 + p4
      stress(l, 5) = t5 + p5
      stress(l, 6) = t6 + p6
    end do
  end subroutine jaumann_turn

end module first_order
