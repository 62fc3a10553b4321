!> Rotation of the tensors of a row of points, for laws with directions of their own.
module tensor_rotation
  use kinds, only: wp
  implicit none
  private

  public :: spin_rotation, rotate_tensors, transposed

contains

  !> Rotation of each point from its spin increment, that by which the stress came rotated: entry
  !! (i, j) at 3 (i - 1) + j (T. J. R. Hughes and J. Winget, IJNME 15 (1980), eq. (13)).
  pure subroutine spin_rotation(n, spin, rotation)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n, 3)          !! increment 12 13 23
    real(wp), intent(out) :: rotation(n, 9)
    real(wp) :: h1, h2, h3, w
    integer :: l

    !$omp simd private(h1, h2, h3, w)
    do l = 1, n
      h1 = 0.5_wp*spin(l, 1)
      h2 = 0.5_wp*spin(l, 2)
      h3 = 0.5_wp*spin(l, 3)
      w = 2.0_wp/(1.0_wp + h1*h1 + h2*h2 + h3*h3)
      rotation(l, 1) = 1.0_wp - w*(h1*h1 + h2*h2)
      rotation(l, 2) = w*(h1 - h2*h3)
      rotation(l, 3) = w*(h2 + h1*h3)
      rotation(l, 4) = -w*(h1 + h2*h3)
      rotation(l, 5) = 1.0_wp - w*(h1*h1 + h3*h3)
      rotation(l, 6) = w*(h3 - h1*h2)
      rotation(l, 7) = w*(h1*h3 - h2)
      rotation(l, 8) = -w*(h3 + h1*h2)
      rotation(l, 9) = 1.0_wp - w*(h2*h2 + h3*h3)
    end do
  end subroutine spin_rotation

  !> Q T Q^T of symmetric tensors with their shear as it is, not doubled.
  pure subroutine rotate_tensors(n, rotation, tensor)
    integer, intent(in) :: n
    real(wp), intent(in) :: rotation(n, 9)
    real(wp), intent(inout) :: tensor(n, 6)     !! 11 22 33 12 13 23
    real(wp) :: a(3), b(3), c(3)
    integer :: l

    do l = 1, n
      associate (t => tensor(l, :), q => rotation(l, :))
        a = q(1)*[t(1), t(4), t(5)] + q(2)*[t(4), t(2), t(6)] + q(3)*[t(5), t(6), t(3)]
        b = q(4)*[t(1), t(4), t(5)] + q(5)*[t(4), t(2), t(6)] + q(6)*[t(5), t(6), t(3)]
        c = q(7)*[t(1), t(4), t(5)] + q(8)*[t(4), t(2), t(6)] + q(9)*[t(5), t(6), t(3)]
        tensor(l, :) = [sum(a*q(1:3)), sum(b*q(4:6)), sum(c*q(7:9)), &
                        sum(a*q(4:6)), sum(a*q(7:9)), sum(b*q(7:9))]
      end associate
    end do
  end subroutine rotate_tensors

  !> The inverse rotations.
  pure function transposed(n, rotation) result(inverse)
    integer, intent(in) :: n
    real(wp), intent(in) :: rotation(n, 9)
    real(wp) :: inverse(n, 9)

    inverse = rotation(:, [1, 4, 7, 2, 5, 8, 3, 6, 9])
  end function transposed

end module tensor_rotation
