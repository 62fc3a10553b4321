!> Principal stresses of a row of points in falling order, without their directions.
module principal_stresses
  use kinds, only: wp
  implicit none
  private

  public :: find_principal, find_principal_of_sheet

contains

  !> From the invariants of the deviator: the one that is far from the two others is 2/3 q c with
  !! 4 c^3 - 3 c = |27 J3/(2 q^3)| and c from cos 30 degrees to 1, where Newton's method doubles the
  !! digits. Of two that are nearly equal the difference is exact to 1e-7 of the largest alone.
  pure subroutine find_principal(n, stress, high, middle, low)
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(n, 6)          !! 11 22 33 12 13 23
    real(wp), intent(out), dimension(n) :: high, middle, low
    real(wp), parameter :: third = 1.0_wp/3, root3 = sqrt(3.0_wp), least = 1.0e-90_wp
    real(wp) :: mean, a, b, d, q, j3, level, c, far, apart
    integer :: l, step

    !$omp simd private(mean, a, b, d, q, j3, level, c, far, apart, step)
    do l = 1, n
      mean = third*(stress(l, 1) + stress(l, 2) + stress(l, 3))
      a = stress(l, 1) - mean
      b = stress(l, 2) - mean
      d = stress(l, 3) - mean
      q = sqrt(1.5_wp*(a*a + b*b + d*d) &
               + 3.0_wp*(stress(l, 4)**2 + stress(l, 5)**2 + stress(l, 6)**2)) + least
      j3 = a*(b*d - stress(l, 6)**2) - stress(l, 4)*(stress(l, 4)*d - stress(l, 5)*stress(l, 6)) &
           + stress(l, 5)*(stress(l, 4)*stress(l, 6) - stress(l, 5)*b)
      level = min(abs(13.5_wp*j3/(q*q*q)), 1.0_wp)
      c = 0.5_wp*root3 + (1.0_wp - 0.5_wp*root3)*level
      do step = 1, 3
        c = c - (c*(4.0_wp*c*c - 3.0_wp) - level)/(12.0_wp*c*c - 3.0_wp)
      end do
      far = third*q*c
      apart = q/root3*sqrt(max(1.0_wp - c*c, 0.0_wp))
      if (j3 >= 0.0_wp) then
        high(l) = mean + 2.0_wp*far
        middle(l) = mean - far + apart
        low(l) = mean - far - apart
      else
        high(l) = mean + far + apart
        middle(l) = mean + far - apart
        low(l) = mean - 2.0_wp*far
      end if
    end do
  end subroutine find_principal

  !> The same in plane stress.
  pure subroutine find_principal_of_sheet(n, stress, high, middle, low)
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(n, 3)          !! 11 22 12
    real(wp), intent(out), dimension(n) :: high, middle, low
    real(wp) :: mean, radius
    integer :: l

    !$omp simd private(mean, radius)
    do l = 1, n
      mean = 0.5_wp*(stress(l, 1) + stress(l, 2))
      radius = sqrt(0.25_wp*(stress(l, 1) - stress(l, 2))**2 + stress(l, 3)**2)
      high(l) = max(mean + radius, 0.0_wp)
      middle(l) = max(mean - radius, min(mean + radius, 0.0_wp))
      low(l) = min(mean - radius, 0.0_wp)
    end do
  end subroutine find_principal_of_sheet

end module principal_stresses
