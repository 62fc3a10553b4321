!> Kinematics of first order in the step: all from the jacobian at its end. The solver has them of
!! second order; these stand in the benchmark for what the same kernel costs with the least of
!! physics that makes a Jaumann rate.
module first_order
  use kinds, only: wp
  implicit none
  private

  public :: first_increment, jaumann_turn

contains

  !> Strain increment (engineering shear), spin increment (12, 13, 23), weighted cofactors and
  !! volume of one point of eight elements; arrays as in `point_kinematics`.
  pure subroutine first_increment(n, q, dt, g, weight, dstrain, spin, cofactor, volume, rate, &
                                  smallest_det)
    integer, intent(in) :: n, q                         !! points of the row, this one
    real(wp), intent(in) :: dt, g(8, 18), weight(8)     !! g: d/dxi of x, then of v
    real(wp), intent(inout) :: dstrain(8, n, 6), spin(8, n, 3), cofactor(8, n, 9)
    real(wp), intent(out) :: volume(8), rate(8)         !! rate: squared norm of inverse jacobian
    real(wp), intent(inout) :: smallest_det(8)
    real(wp) :: c11, c12, c13, c21, c22, c23, c31, c32, c33, e12, e21, e13, e31, e23, e32
    real(wp) :: det, scaling
    integer :: l

    !$omp simd private(c11, c12, c13, c21, c22, c23, c31, c32, c33, e12, e21, e13, e31, e23, e32, &
    !$omp det, scaling)
    do l = 1, 8
      c11 = g(l, 5)*g(l, 9) - g(l, 6)*g(l, 8)
      c12 = g(l, 6)*g(l, 7) - g(l, 4)*g(l, 9)
      c13 = g(l, 4)*g(l, 8) - g(l, 5)*g(l, 7)
      c21 = g(l, 3)*g(l, 8) - g(l, 2)*g(l, 9)
      c22 = g(l, 1)*g(l, 9) - g(l, 3)*g(l, 7)
      c23 = g(l, 2)*g(l, 7) - g(l, 1)*g(l, 8)
      c31 = g(l, 2)*g(l, 6) - g(l, 3)*g(l, 5)
      c32 = g(l, 3)*g(l, 4) - g(l, 1)*g(l, 6)
      c33 = g(l, 1)*g(l, 5) - g(l, 2)*g(l, 4)
      det = g(l, 1)*c11 + g(l, 2)*c12 + g(l, 3)*c13
      smallest_det(l) = min(smallest_det(l), det)
      volume(l) = weight(l)*det
      scaling = 1.0_wp/det
      rate(l) = ((c11*c11 + c12*c12 + c13*c13) + (c21*c21 + c22*c22 + c23*c23) &
                 + (c31*c31 + c32*c32 + c33*c33))*(scaling*scaling)
      scaling = dt*scaling
      dstrain(l, q, 1) = (g(l, 10)*c11 + g(l, 11)*c12 + g(l, 12)*c13)*scaling
      dstrain(l, q, 2) = (g(l, 13)*c21 + g(l, 14)*c22 + g(l, 15)*c23)*scaling
      dstrain(l, q, 3) = (g(l, 16)*c31 + g(l, 17)*c32 + g(l, 18)*c33)*scaling
      e12 = (g(l, 10)*c21 + g(l, 11)*c22 + g(l, 12)*c23)*scaling
      e21 = (g(l, 13)*c11 + g(l, 14)*c12 + g(l, 15)*c13)*scaling
      e13 = (g(l, 10)*c31 + g(l, 11)*c32 + g(l, 12)*c33)*scaling
      e31 = (g(l, 16)*c11 + g(l, 17)*c12 + g(l, 18)*c13)*scaling
      e23 = (g(l, 13)*c31 + g(l, 14)*c32 + g(l, 15)*c33)*scaling
      e32 = (g(l, 16)*c21 + g(l, 17)*c22 + g(l, 18)*c23)*scaling
      dstrain(l, q, 4) = e12 + e21
      dstrain(l, q, 5) = e13 + e31
      dstrain(l, q, 6) = e23 + e32
      spin(l, q, 1) = 0.5_wp*(e12 - e21)
      spin(l, q, 2) = 0.5_wp*(e13 - e31)
      spin(l, q, 3) = 0.5_wp*(e23 - e32)
      cofactor(l, q, 1) = weight(l)*c11
      cofactor(l, q, 2) = weight(l)*c12
      cofactor(l, q, 3) = weight(l)*c13
      cofactor(l, q, 4) = weight(l)*c21
      cofactor(l, q, 5) = weight(l)*c22
      cofactor(l, q, 6) = weight(l)*c23
      cofactor(l, q, 7) = weight(l)*c31
      cofactor(l, q, 8) = weight(l)*c32
      cofactor(l, q, 9) = weight(l)*c33
    end do
  end subroutine first_increment

  !> Stress of a row turned by the Jaumann rate over one step: s + W s - s W.
  pure subroutine jaumann_turn(n, spin, stress)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n, 3)          !! increment 12 13 23
    real(wp), intent(inout) :: stress(n, 6)     !! 11 22 33 12 13 23
    real(wp) :: w1, w2, w3, s1, s2, s3, s4, s5, s6
    integer :: l

    !$omp simd private(w1, w2, w3, s1, s2, s3, s4, s5, s6)
    do l = 1, n
      w1 = spin(l, 1); w2 = spin(l, 2); w3 = spin(l, 3)
      s1 = stress(l, 1); s2 = stress(l, 2); s3 = stress(l, 3)
      s4 = stress(l, 4); s5 = stress(l, 5); s6 = stress(l, 6)
      stress(l, 1) = s1 + 2.0_wp*(w1*s4 + w2*s5)
      stress(l, 2) = s2 - 2.0_wp*(w1*s4 - w3*s6)
      stress(l, 3) = s3 - 2.0_wp*(w2*s5 + w3*s6)
      stress(l, 4) = s4 + w1*(s2 - s1) + w2*s6 + w3*s5
      stress(l, 5) = s5 + w2*(s3 - s1) + w1*s6 - w3*s4
      stress(l, 6) = s6 + w3*(s3 - s2) - w1*s5 - w2*s4
    end do
  end subroutine jaumann_turn

end module first_order
