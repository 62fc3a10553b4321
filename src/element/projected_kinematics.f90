!> What a projected element asks of a point beside `point_kinematics`: eight elements side by side.
!!
!! A gradient holds d/dxi_j of x_i at (j + 3 (i - 1)) and of half of the motion of
!! the step nine places further.
module projected_kinematics
  use kinds, only: wp
  implicit none
  private

  public :: end_inverse, point_tangents, pull_back

contains

  !> Inverse jacobian and volume of a point at the end of the step, and the smallest determinant.
  pure subroutine end_inverse(n, q, g, weight, inverse, volume, smallest_det)
    integer, intent(in) :: n, q                      !! points of the row, this one
    real(wp), intent(in) :: g(8, 18), weight(8)
    real(wp), intent(inout) :: inverse(8, n, 9)      !! d xi_j / d x_k at j + 3 (k - 1)
    real(wp), intent(inout) :: volume(8, n), smallest_det(8)
    real(wp) :: c1, c2, c3, det, scaling
    integer :: l

    !$omp simd private(c1, c2, c3, det, scaling)
    do l = 1, 8
      c1 = g(l, 5)*g(l, 9) - g(l, 6)*g(l, 8)
      c2 = g(l, 6)*g(l, 7) - g(l, 4)*g(l, 9)
      c3 = g(l, 4)*g(l, 8) - g(l, 5)*g(l, 7)
      det = g(l, 1)*c1 + g(l, 2)*c2 + g(l, 3)*c3
      smallest_det(l) = min(smallest_det(l), det)
      volume(l, q) = weight(l)*det
      scaling = 1.0_wp/det
      inverse(l, q, 1) = scaling*c1
      inverse(l, q, 2) = scaling*c2
      inverse(l, q, 3) = scaling*c3
      inverse(l, q, 4) = scaling*(g(l, 3)*g(l, 8) - g(l, 2)*g(l, 9))
      inverse(l, q, 5) = scaling*(g(l, 1)*g(l, 9) - g(l, 3)*g(l, 7))
      inverse(l, q, 6) = scaling*(g(l, 2)*g(l, 7) - g(l, 1)*g(l, 8))
      inverse(l, q, 7) = scaling*(g(l, 2)*g(l, 6) - g(l, 3)*g(l, 5))
      inverse(l, q, 8) = scaling*(g(l, 3)*g(l, 4) - g(l, 1)*g(l, 6))
      inverse(l, q, 9) = scaling*(g(l, 1)*g(l, 5) - g(l, 2)*g(l, 4))
    end do
  end subroutine end_inverse

  !> Tangents along axes 1 and 2 at the middle (1 to 6) and at the end of the step (7 to 12).
  pure subroutine point_tangents(n, q, g, tangents)
    integer, intent(in) :: n, q
    real(wp), intent(in) :: g(8, 18)
    real(wp), intent(inout) :: tangents(8, n, 12)
    integer :: l, i, j

    do j = 1, 2
      do i = 1, 3
        !$omp simd
        do l = 1, 8
          tangents(l, q, i + 3*(j - 1)) = g(l, j + 3*(i - 1)) - g(l, 9 + j + 3*(i - 1))
          tangents(l, q, 6 + i + 3*(j - 1)) = g(l, j + 3*(i - 1))
        end do
      end do
    end do
  end subroutine point_tangents

  !> Stress times volume by element coordinates: P_ij = sum_k S_ik d xi_j / d x_k at j + 3 (i - 1).
  pure subroutine pull_back(n, s, inverse, flux)
    integer, intent(in) :: n
    real(wp), intent(in) :: s(8, n, 6), inverse(8, n, 9)
    real(wp), intent(out) :: flux(8, n, 9)
    integer :: l, q, j

    do j = 1, 3
      do q = 1, n
        !$omp simd
        do l = 1, 8
          flux(l, q, j) = s(l, q, 1)*inverse(l, q, j) + s(l, q, 4)*inverse(l, q, j + 3) &
                          + s(l, q, 5)*inverse(l, q, j + 6)
          flux(l, q, j + 3) = s(l, q, 4)*inverse(l, q, j) + s(l, q, 2)*inverse(l, q, j + 3) &
                              + s(l, q, 6)*inverse(l, q, j + 6)
          flux(l, q, j + 6) = s(l, q, 5)*inverse(l, q, j) + s(l, q, 6)*inverse(l, q, j + 3) &
                              + s(l, q, 3)*inverse(l, q, j + 6)
        end do
      end do
    end do
  end subroutine pull_back

end module projected_kinematics
