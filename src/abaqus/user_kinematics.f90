!> Rotations and frames that subroutines of users are given.
module user_kinematics
  use kinds, only: wp
  implicit none
  private

  public :: rotation_of_spin, rotated_stress, rotated_strain, polar_rotation, full_stress, &
            packed_stress, identity, determinant

  real(wp), parameter :: identity(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                                   0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

contains

  !> Rotation of a spin increment (12, 13, 23): (I - W/2)^-1 (I + W/2), the same as the elements
  !! rotate their stress by (T. J. R. Hughes and J. Winget, IJNME 15 (1980), eq. (13)).
  pure function rotation_of_spin(spin) result(r)
    real(wp), intent(in) :: spin(3)
    real(wp) :: r(3, 3), h(3, 3)

    h = 0.0_wp
    h(1, 2) = 0.5_wp*spin(1)
    h(1, 3) = 0.5_wp*spin(2)
    h(2, 3) = 0.5_wp*spin(3)
    h = h - transpose(h)
    r = identity + 2.0_wp/(1.0_wp + 0.25_wp*sum(spin**2))*(h + matmul(h, h))
  end function rotation_of_spin

  !> The matrix of a stress 11, 22, 33, 12, 13, 23.
  pure function full_stress(s) result(full)
    real(wp), intent(in) :: s(6)
    real(wp) :: full(3, 3)

    full = reshape([s(1), s(4), s(5), s(4), s(2), s(6), s(5), s(6), s(3)], [3, 3])
  end function full_stress

  !> The reverse of `full_stress`.
  pure function packed_stress(full) result(s)
    real(wp), intent(in) :: full(3, 3)
    real(wp) :: s(6)

    s = [full(1, 1), full(2, 2), full(3, 3), full(1, 2), full(1, 3), full(2, 3)]
  end function packed_stress

  !> R S R^T of a stress.
  pure function rotated_stress(r, s) result(rotated)
    real(wp), intent(in) :: r(3, 3), s(6)
    real(wp) :: rotated(6)

    rotated = packed_stress(matmul(r, matmul(full_stress(s), transpose(r))))
  end function rotated_stress

  !> The same of a strain with engineering shear.
  pure function rotated_strain(r, e) result(rotated)
    real(wp), intent(in) :: r(3, 3), e(6)
    real(wp) :: rotated(6)

    rotated = rotated_stress(r, [e(:3), 0.5_wp*e(4:)])
    rotated(4:) = 2.0_wp*rotated(4:)
  end function rotated_strain

  !> Rotation R of F = R U by Newton's iteration (N. J. Higham, SIAM J. Sci. Stat. Comput. 7
  !! (1986), 1160). F must have a positive determinant; else the result is not a number.
  pure function polar_rotation(f) result(r)
    real(wp), intent(in) :: f(3, 3)
    real(wp) :: r(3, 3), next(3, 3), cofactor(3, 3), det
    integer, parameter :: most = 50
    integer :: i

    r = f
    do i = 1, most
      cofactor = cofactors(r)
      det = determinant(r)
      next = 0.5_wp*(r + cofactor/sqrt(det)**2)
      if (maxval(abs(next - r)) < 4.0_wp*epsilon(1.0_wp)) exit
      r = next
    end do
    r = next
  end function polar_rotation

  !> Determinant of a matrix.
  pure real(wp) function determinant(a)
    real(wp), intent(in) :: a(3, 3)
    real(wp) :: c(3, 3)

    c = cofactors(a)
    determinant = sum(a(1, :)*c(1, :))
  end function determinant

  !> Cofactors: the transpose of the inverse, times the determinant.
  pure function cofactors(a) result(c)
    real(wp), intent(in) :: a(3, 3)
    real(wp) :: c(3, 3)
    integer :: i, j, i1, i2, j1, j2

    do j = 1, 3
      j1 = mod(j, 3) + 1
      j2 = mod(j + 1, 3) + 1
      do i = 1, 3
        i1 = mod(i, 3) + 1
        i2 = mod(i + 1, 3) + 1
        c(i, j) = a(i1, j1)*a(i2, j2) - a(i1, j2)*a(i2, j1)
      end do
    end do
  end function cofactors

end module user_kinematics
