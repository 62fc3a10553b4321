!> Kinematics of one point of eight elements side by side: what does not depend on degree or rule.
!!
!! A gradient holds d/dxi_j of x_i at (j + 3 (i - 1)), the positions at the end of the step, and of
!! half of the motion of the step nine places further.
module point_kinematics
  use kinds, only: wp
  implicit none
  private

  public :: end_cofactors, strain_increment, end_volume_of, point_tangents

contains

#include "point_kinematics.inc"
  !> Volume of a point at the end of the step, and the smallest determinant.
  pure subroutine end_volume_of(g, weight, volume, smallest_det)
    real(wp), intent(in) :: g(8, 18), weight(8)
    real(wp), intent(out) :: volume(8)
    real(wp), intent(inout) :: smallest_det(8)
    real(wp) :: det
    integer :: l

    !$omp simd private(det)
    do l = 1, 8
      det = g(l, 1)*(g(l, 5)*g(l, 9) - g(l, 6)*g(l, 8)) &
            + g(l, 2)*(g(l, 6)*g(l, 7) - g(l, 4)*g(l, 9)) &
            + g(l, 3)*(g(l, 4)*g(l, 8) - g(l, 5)*g(l, 7))
      smallest_det(l) = min(smallest_det(l), det)
      volume(l) = weight(l)*det
    end do
  end subroutine end_volume_of

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

end module point_kinematics
