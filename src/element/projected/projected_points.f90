!> Points of eight elements between the projections: strain increments, and stress times volume for
!! the forces. Laws that look at the deformation gradient get one with the projected volume.
!!
!! With theta the volume strain, P its projection, n the normal of the tangents along axes 1 and 2,
!! and P_a the projection along axis a alone:
!!   volume  D + (P theta - theta) I/3
!!   sheet   D + (P theta - theta) n n + sum over a = 1, 2 of g_a.(P_a D - D).n (g^a n + n g^a),
!! so that in-plane strains stay, transverse shear is projected along its own axis, and the
!! thickness follows from the projected volume strain. Stresses take the transposed way.
module projected_points
  use kinds, only: wp
  implicit none
  private

  public :: correct_volume, split_volume, join_volume
  public :: correct_sheet, split_sheet, join_sheet
  public :: logarithmic_volumes, set_volumes

contains

  !> Put the projected volume strain in the place of the own one.
  pure subroutine correct_volume(q, n, theta, dstrain)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: theta(8*q, n)
    real(wp), intent(inout) :: dstrain(8*q, 6, n)
    real(wp) :: growth
    integer :: l, row

    do row = 1, n
      !$omp simd private(growth)
      do l = 1, 8*q
        growth = (theta(l, row) - dstrain(l, 1, row) - dstrain(l, 2, row) - dstrain(l, 3, row)) &
                 /3.0_wp
        dstrain(l, 1, row) = dstrain(l, 1, row) + growth
        dstrain(l, 2, row) = dstrain(l, 2, row) + growth
        dstrain(l, 3, row) = dstrain(l, 3, row) + growth
      end do
    end do
  end subroutine correct_volume

  !> Split stresses into what works on the projected volume strain and the rest.
  pure subroutine split_volume(q, n, weighted, mean)
    integer, intent(in) :: q, n
    real(wp), intent(inout) :: weighted(8*q, 6, n)
    real(wp), intent(out) :: mean(8*q, n)
    integer :: l, row

    do row = 1, n
      !$omp simd
      do l = 1, 8*q
        mean(l, row) = (weighted(l, 1, row) + weighted(l, 2, row) + weighted(l, 3, row))/3.0_wp
        weighted(l, 1, row) = weighted(l, 1, row) - mean(l, row)
        weighted(l, 2, row) = weighted(l, 2, row) - mean(l, row)
        weighted(l, 3, row) = weighted(l, 3, row) - mean(l, row)
      end do
    end do
  end subroutine split_volume

  !> Put the part that worked on the volume strain back, now projected.
  pure subroutine join_volume(q, n, mean, weighted)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: mean(8*q, n)
    real(wp), intent(inout) :: weighted(8*q, 6, n)
    integer :: c

    do c = 1, 3
      weighted(:, c, :) = weighted(:, c, :) + mean
    end do
  end subroutine join_volume

  !> Volume strain along the normal, transverse shear along its own axis: all that is added has
  !! the form r n + n r.
  pure subroutine correct_sheet(q, n, tangents, theta, along1, along2, dstrain)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: tangents(8*q, 12, n)    !! those of the middle of the step are used
    real(wp), intent(in) :: theta(8*q, n), along1(8*q, 6, n), along2(8*q, 6, n)
    real(wp), intent(inout) :: dstrain(8*q, 6, n)
    real(wp) :: t1, t2, t3, u1, u2, u3, n1, n2, n3, m1, m2, m3, g1, g2, g3, h1, h2, h3, scaling
    real(wp) :: growth, shear1, shear2, r1, r2, r3
    integer :: l, row

    do row = 1, n
      !$omp simd private(t1, t2, t3, u1, u2, u3, n1, n2, n3, m1, m2, m3, g1, g2, g3, h1, h2, h3, &
      !$omp scaling, growth, shear1, shear2, r1, r2, r3)
      do l = 1, 8*q
        t1 = tangents(l, 1, row); t2 = tangents(l, 2, row); t3 = tangents(l, 3, row)
        u1 = tangents(l, 4, row); u2 = tangents(l, 5, row); u3 = tangents(l, 6, row)
        include 'sheet_frame.inc'
        associate (d => dstrain(:, :, row), a => along1(:, :, row), b => along2(:, :, row))
          ! t.(A - D).m and u.(B - D).m of engineering strains
          shear1 = (a(l, 1) - d(l, 1))*t1*m1 + (a(l, 2) - d(l, 2))*t2*m2 &
                   + (a(l, 3) - d(l, 3))*t3*m3 &
                   + 0.5_wp*((a(l, 4) - d(l, 4))*(t1*m2 + t2*m1) &
                             + (a(l, 5) - d(l, 5))*(t1*m3 + t3*m1) &
                             + (a(l, 6) - d(l, 6))*(t2*m3 + t3*m2))
          shear2 = (b(l, 1) - d(l, 1))*u1*m1 + (b(l, 2) - d(l, 2))*u2*m2 &
                   + (b(l, 3) - d(l, 3))*u3*m3 &
                   + 0.5_wp*((b(l, 4) - d(l, 4))*(u1*m2 + u2*m1) &
                             + (b(l, 5) - d(l, 5))*(u1*m3 + u3*m1) &
                             + (b(l, 6) - d(l, 6))*(u2*m3 + u3*m2))
          growth = 0.5_wp*(theta(l, row) - d(l, 1) - d(l, 2) - d(l, 3))
          r1 = 2.0_wp*(growth*m1 + shear1*g1 + shear2*h1)
          r2 = 2.0_wp*(growth*m2 + shear1*g2 + shear2*h2)
          r3 = 2.0_wp*(growth*m3 + shear1*g3 + shear2*h3)
          d(l, 1) = d(l, 1) + r1*n1
          d(l, 2) = d(l, 2) + r2*n2
          d(l, 3) = d(l, 3) + r3*n3
          d(l, 4) = d(l, 4) + (r1*n2 + r2*n1)
          d(l, 5) = d(l, 5) + (r1*n3 + r3*n1)
          d(l, 6) = d(l, 6) + (r2*n3 + r3*n2)
        end associate
      end do
    end do
  end subroutine correct_sheet

  !> Split stresses into what works on the projected strains of `correct_sheet` and the rest, which
  !! lies within the sheet: R_ab = g^a.S.g^b - mean g^a.g^b by the dual tangents g^1, g^2. What is
  !! projected along an axis works on t.D.n alone: the symmetric part of t n, times a shear.
  pure subroutine split_sheet(q, n, tangents, weighted, mean, along1, along2, plane)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: tangents(8*q, 12, n)    !! those of the end of the step are used
    real(wp), intent(in) :: weighted(8*q, 6, n)
    real(wp), intent(out) :: mean(8*q, n), along1(8*q, 6, n), along2(8*q, 6, n)
    real(wp), intent(out) :: plane(8*q, 3, n)       !! R_11, R_12, R_22
    real(wp) :: t1, t2, t3, u1, u2, u3, n1, n2, n3, m1, m2, m3, g1, g2, g3, h1, h2, h3, scaling
    real(wp) :: s11, s22, s33, s12, s13, s23, r1, r2, r3, shear1, shear2
    integer :: l, row

    do row = 1, n
      !$omp simd private(t1, t2, t3, u1, u2, u3, n1, n2, n3, m1, m2, m3, g1, g2, g3, h1, h2, h3, &
      !$omp scaling, s11, s22, s33, s12, s13, s23, r1, r2, r3, shear1, shear2)
      do l = 1, 8*q
        t1 = tangents(l, 7, row); t2 = tangents(l, 8, row); t3 = tangents(l, 9, row)
        u1 = tangents(l, 10, row); u2 = tangents(l, 11, row); u3 = tangents(l, 12, row)
        include 'sheet_frame.inc'
        s11 = weighted(l, 1, row); s22 = weighted(l, 2, row); s33 = weighted(l, 3, row)
        s12 = weighted(l, 4, row); s13 = weighted(l, 5, row); s23 = weighted(l, 6, row)
        r1 = s11*m1 + s12*m2 + s13*m3
        r2 = s12*m1 + s22*m2 + s23*m3
        r3 = s13*m1 + s23*m2 + s33*m3
        mean(l, row) = r1*n1 + r2*n2 + r3*n3
        shear1 = r1*g1 + r2*g2 + r3*g3
        shear2 = r1*h1 + r2*h2 + r3*h3
        along1(l, 1, row) = 2.0_wp*shear1*t1*n1
        along1(l, 2, row) = 2.0_wp*shear1*t2*n2
        along1(l, 3, row) = 2.0_wp*shear1*t3*n3
        along1(l, 4, row) = shear1*(t1*n2 + t2*n1)
        along1(l, 5, row) = shear1*(t1*n3 + t3*n1)
        along1(l, 6, row) = shear1*(t2*n3 + t3*n2)
        along2(l, 1, row) = 2.0_wp*shear2*u1*n1
        along2(l, 2, row) = 2.0_wp*shear2*u2*n2
        along2(l, 3, row) = 2.0_wp*shear2*u3*n3
        along2(l, 4, row) = shear2*(u1*n2 + u2*n1)
        along2(l, 5, row) = shear2*(u1*n3 + u3*n1)
        along2(l, 6, row) = shear2*(u2*n3 + u3*n2)
        s11 = s11 - mean(l, row)
        s22 = s22 - mean(l, row)
        s33 = s33 - mean(l, row)
        r1 = s11*g1 + s12*g2 + s13*g3
        r2 = s12*g1 + s22*g2 + s23*g3
        r3 = s13*g1 + s23*g2 + s33*g3
        plane(l, 1, row) = r1*g1 + r2*g2 + r3*g3
        plane(l, 2, row) = r1*h1 + r2*h2 + r3*h3
        r1 = s11*h1 + s12*h2 + s13*h3
        r2 = s12*h1 + s22*h2 + s23*h3
        r3 = s13*h1 + s23*h2 + s33*h3
        plane(l, 3, row) = r1*h1 + r2*h2 + r3*h3
      end do
    end do
  end subroutine split_sheet

  !> Join what `split_sheet` has split and has been projected since, without the rest.
  pure subroutine join_sheet(q, n, mean, along1, along2, weighted)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: mean(8*q, n), along1(8*q, 6, n), along2(8*q, 6, n)
    real(wp), intent(out) :: weighted(8*q, 6, n)

    weighted = along1 + along2
    call join_volume(q, n, mean, weighted)
  end subroutine join_sheet

  !> Logarithms of the determinants of F at the start (1) and the end (2) of the step.
  pure subroutine logarithmic_volumes(n, gradients, growth)
    integer, intent(in) :: n(2)                               !! points of a row, rows
    real(wp), intent(in) :: gradients(n(1), 9, 2, n(2))
    real(wp), intent(out) :: growth(n(1), 2, n(2))
    integer :: row, k

    do row = 1, n(2)
      do k = 1, 2
        growth(:, k, row) = log(determinants(n(1), gradients(:, :, k, row)))
      end do
    end do
  end subroutine logarithmic_volumes

  !> Scale F, so that its determinant is the projected one.
  pure subroutine set_volumes(n, growth, gradients)
    integer, intent(in) :: n(2)
    real(wp), intent(inout) :: growth(n(1), 2, n(2))          !! projected logarithms, then
                                                              !! what they exceed the own ones by
    real(wp), intent(inout) :: gradients(n(1), 9, 2, n(2))
    integer :: row, k, c

    do row = 1, n(2)
      do k = 1, 2
        growth(:, k, row) = growth(:, k, row) &
                            - log(determinants(n(1), gradients(:, :, k, row)))
        do c = 1, 9
          gradients(:, c, k, row) = gradients(:, c, k, row)*exp(growth(:, k, row)/3.0_wp)
        end do
      end do
    end do
  end subroutine set_volumes

  pure function determinants(n, f) result(values)
    integer, intent(in) :: n
    real(wp), intent(in) :: f(n, 9)
    real(wp) :: values(n)

    values = f(:, 1)*(f(:, 5)*f(:, 9) - f(:, 6)*f(:, 8)) &
             + f(:, 2)*(f(:, 6)*f(:, 7) - f(:, 4)*f(:, 9)) &
             + f(:, 3)*(f(:, 4)*f(:, 8) - f(:, 5)*f(:, 7))
  end function determinants

end module projected_points
