!> Rotations and frames that subroutines of users are given.
module user_kinematics
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use kinds, only: wp
  implicit none
  private

  public :: rotation_of_spin, rotated_stress, rotated_strain, identity, determinants, of_row
  public :: turn_strains, polar_rotations, rotations_of_quaternions, spins_between

  real(wp), parameter :: identity(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                                   0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

  !> The places of the entries 11, 12, 13, 21, ... in the gradients that a VUMAT gets: 11, 22, 33,
  !! 12, 23, 31, 21, 32, 13.
  integer, parameter :: of_row(9) = [1, 4, 9, 7, 2, 5, 6, 8, 3]

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

  !> The same rotations for many spins, column by column as a UMAT is given its DROT, and strains
  !! with engineering shear rotated by them.
  pure subroutine turn_strains(n, spin, strain, rotation, turned)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n, 3)                     !! 12, 13, 23
    real(wp), intent(in) :: strain(n, 6)                   !! 11, 22, 33, 12, 13, 23
    real(wp), intent(out) :: rotation(n, 9), turned(n, 6)  !! 11, 21, 31, 12 ...
    real(wp) :: a, b, c, w, r11, r12, r13, r21, r22, r23, r31, r32, r33
    real(wp) :: s1, s2, s3, s4, s5, s6, t1, t2, t3, t4, t5, t6
    integer :: l

    !$omp simd private(a, b, c, w, r11, r12, r13, r21, r22, r23, r31, r32, r33, s1, s2, s3, s4, &
    !$omp s5, s6, t1, t2, t3, t4, t5, t6)
    do l = 1, n
      a = 0.5_wp*spin(l, 1); b = 0.5_wp*spin(l, 2); c = 0.5_wp*spin(l, 3)
      w = 2.0_wp/(1.0_wp + (a*a + b*b + c*c))
      r11 = 1.0_wp - w*(a*a + b*b); r12 = w*(a - b*c); r13 = w*(b + a*c)
      r21 = -w*(a + b*c); r22 = 1.0_wp - w*(a*a + c*c); r23 = w*(c - a*b)
      r31 = -w*(b - a*c); r32 = -w*(c + a*b); r33 = 1.0_wp - w*(b*b + c*c)
      rotation(l, 1) = r11; rotation(l, 2) = r21; rotation(l, 3) = r31
      rotation(l, 4) = r12; rotation(l, 5) = r22; rotation(l, 6) = r32
      rotation(l, 7) = r13; rotation(l, 8) = r23; rotation(l, 9) = r33
      s1 = strain(l, 1); s2 = strain(l, 2); s3 = strain(l, 3)
      s4 = 0.5_wp*strain(l, 4); s5 = 0.5_wp*strain(l, 5); s6 = 0.5_wp*strain(l, 6)
      t1 = r11*s1 + r12*s4 + r13*s5; t2 = r11*s4 + r12*s2 + r13*s6; t3 = r11*s5 + r12*s6 + r13*s3
      t4 = r21*s1 + r22*s4 + r23*s5; t5 = r21*s4 + r22*s2 + r23*s6; t6 = r21*s5 + r22*s6 + r23*s3
      turned(l, 1) = t1*r11 + t2*r12 + t3*r13
      turned(l, 2) = t4*r21 + t5*r22 + t6*r23
      ! A rotation keeps the trace.
      turned(l, 3) = (s1 - turned(l, 1)) + (s2 - turned(l, 2)) + s3
      turned(l, 4) = 2.0_wp*(t1*r21 + t2*r22 + t3*r23)
      turned(l, 5) = 2.0_wp*(t1*r31 + t2*r32 + t3*r33)
      turned(l, 6) = 2.0_wp*(t4*r31 + t5*r32 + t6*r33)
    end do
  end subroutine turn_strains

  !> Rotations R of F = R U, row by row, by Newton's iteration (N. J. Higham, SIAM J. Sci. Stat.
  !! Comput. 7 (1986), 1160), which squares the error. F must have a positive determinant; else
  !! the result is not a number.
  pure subroutine polar_rotations(n, f, r)
    integer, intent(in) :: n
    real(wp), intent(in) :: f(n, 9)         !! in the order of a VUMAT
    real(wp), intent(out) :: r(n, 9)
    real(wp), parameter :: enough = 1.0e-8_wp   ! a change whose square is below rounding
    integer, parameter :: most = 50
    real(wp) :: c1, c2, c3, c4, c5, c6, c7, c8, c9, worst, scaling
    real(wp) :: r1, r2, r3, r4, r5, r6, r7, r8, r9, det(n)
    integer :: i, l

    do i = 1, 9
      r(:, i) = f(:, of_row(i))
    end do
    do i = 1, most
      worst = 0.0_wp
      !$omp simd reduction(max: worst) private(c1, c2, c3, c4, c5, c6, c7, c8, c9, scaling, &
      !$omp r1, r2, r3, r4, r5, r6, r7, r8, r9)
      do l = 1, n
        r1 = r(l, 1); r2 = r(l, 2); r3 = r(l, 3)
        r4 = r(l, 4); r5 = r(l, 5); r6 = r(l, 6)
        r7 = r(l, 7); r8 = r(l, 8); r9 = r(l, 9)
        c1 = r5*r9 - r6*r8; c2 = r6*r7 - r4*r9; c3 = r4*r8 - r5*r7
        c4 = r3*r8 - r2*r9; c5 = r1*r9 - r3*r7; c6 = r2*r7 - r1*r8
        c7 = r2*r6 - r3*r5; c8 = r3*r4 - r1*r6; c9 = r1*r5 - r2*r4
        scaling = 0.5_wp/(r1*c1 + r2*c2 + r3*c3)
        r(l, 1) = 0.5_wp*r1 + scaling*c1
        r(l, 2) = 0.5_wp*r2 + scaling*c2
        r(l, 3) = 0.5_wp*r3 + scaling*c3
        r(l, 4) = 0.5_wp*r4 + scaling*c4
        r(l, 5) = 0.5_wp*r5 + scaling*c5
        r(l, 6) = 0.5_wp*r6 + scaling*c6
        r(l, 7) = 0.5_wp*r7 + scaling*c7
        r(l, 8) = 0.5_wp*r8 + scaling*c8
        r(l, 9) = 0.5_wp*r9 + scaling*c9
        worst = max(worst, abs(r(l, 1) - r1), abs(r(l, 2) - r2), abs(r(l, 3) - r3), &
                    abs(r(l, 4) - r4), abs(r(l, 5) - r5), abs(r(l, 6) - r6), &
                    abs(r(l, 7) - r7), abs(r(l, 8) - r8), abs(r(l, 9) - r9))
      end do
      if (worst < enough) exit
    end do
    call determinants(n, f, det)
    do l = 1, n
      if (.not. det(l) > 0.0_wp) r(l, :) = ieee_value(worst, ieee_quiet_nan)
    end do
  end subroutine polar_rotations

  !> Rotations, row by row, of quaternions less that of no rotation (see `tensor_rotation`).
  pure subroutine rotations_of_quaternions(n, quaternion, r)
    integer, intent(in) :: n
    real(wp), intent(in) :: quaternion(n, 4)
    real(wp), intent(out) :: r(n, 9)
    real(wp) :: w, x, y, z
    integer :: l

    !$omp simd private(w, x, y, z)
    do l = 1, n
      w = 2.0_wp*(1.0_wp + quaternion(l, 1))
      x = quaternion(l, 2); y = quaternion(l, 3); z = quaternion(l, 4)
      r(l, 1) = 1.0_wp - 2.0_wp*(y*y + z*z)
      r(l, 2) = 2.0_wp*x*y - w*z
      r(l, 3) = 2.0_wp*x*z + w*y
      r(l, 4) = 2.0_wp*x*y + w*z
      r(l, 5) = 1.0_wp - 2.0_wp*(x*x + z*z)
      r(l, 6) = 2.0_wp*y*z - w*x
      r(l, 7) = 2.0_wp*x*z - w*y
      r(l, 8) = 2.0_wp*y*z + w*x
      r(l, 9) = 1.0_wp - 2.0_wp*(x*x + y*y)
    end do
  end subroutine rotations_of_quaternions

  !> Spin increments (12, 13, 23) that turn one rotation into another, and that turn it half as far.
  !! That of a rotation by the angle a is 2 tan(a/2), see `rotation_of_spin`; the antisymmetric part
  !! of the rotation is sin(a), and 1 + its trace is 4 cos(a/2)^2.
  pure subroutine spins_between(n, from, to, whole, half)
    integer, intent(in) :: n
    real(wp), intent(in) :: from(n, 9), to(n, 9)      !! row by row
    real(wp), intent(out) :: whole(n, 3), half(n, 3)
    real(wp) :: d12, d13, d23, trace, scaling
    integer :: l

    !$omp simd private(d12, d13, d23, trace, scaling)
    do l = 1, n
      trace = to(l, 1)*from(l, 1) + to(l, 2)*from(l, 2) + to(l, 3)*from(l, 3) &
              + to(l, 4)*from(l, 4) + to(l, 5)*from(l, 5) + to(l, 6)*from(l, 6) &
              + to(l, 7)*from(l, 7) + to(l, 8)*from(l, 8) + to(l, 9)*from(l, 9)
      d12 = to(l, 1)*from(l, 4) + to(l, 2)*from(l, 5) + to(l, 3)*from(l, 6) &
            - (to(l, 4)*from(l, 1) + to(l, 5)*from(l, 2) + to(l, 6)*from(l, 3))
      d13 = to(l, 1)*from(l, 7) + to(l, 2)*from(l, 8) + to(l, 3)*from(l, 9) &
            - (to(l, 7)*from(l, 1) + to(l, 8)*from(l, 2) + to(l, 9)*from(l, 3))
      d23 = to(l, 4)*from(l, 7) + to(l, 5)*from(l, 8) + to(l, 6)*from(l, 9) &
            - (to(l, 7)*from(l, 4) + to(l, 8)*from(l, 5) + to(l, 9)*from(l, 6))
      scaling = 2.0_wp/(1.0_wp + trace)
      whole(l, 1) = scaling*d12
      whole(l, 2) = scaling*d13
      whole(l, 3) = scaling*d23
      scaling = scaling/(1.0_wp + sqrt(1.0_wp + 0.25_wp*scaling**2*(d12**2 + d13**2 + d23**2)))
      half(l, 1) = scaling*d12
      half(l, 2) = scaling*d13
      half(l, 3) = scaling*d23
    end do
  end subroutine spins_between

  !> Determinants of gradients.
  pure subroutine determinants(n, f, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: f(n, 9)         !! in the order of a VUMAT
    real(wp), intent(out) :: values(n)

    values = f(:, 1)*(f(:, 2)*f(:, 3) - f(:, 5)*f(:, 8)) &
             + f(:, 4)*(f(:, 5)*f(:, 6) - f(:, 7)*f(:, 3)) &
             + f(:, 9)*(f(:, 7)*f(:, 8) - f(:, 2)*f(:, 6))
  end subroutine determinants

end module user_kinematics
