!> Strain increments and stresses of eight elements between their projections.
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

  public :: volume_strain, correct_volume, split_volume, join_volume
  public :: correct_sheet, split_sheet, join_sheet

contains

  !> Volume strain of n rows of points.
  pure subroutine volume_strain(q, n, dstrain, theta)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: dstrain(8*q, 6, n)
    real(wp), intent(out) :: theta(8*q, n)

    theta = dstrain(:, 1, :) + dstrain(:, 2, :) + dstrain(:, 3, :)
  end subroutine volume_strain

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
  !! the form h n + n h.
  pure subroutine correct_sheet(q, n, tangents, theta, along1, along2, dstrain)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: tangents(8*q, 12, n)    !! those of the middle of the step are used
    real(wp), intent(in) :: theta(8*q, n), along1(8*q, 6, n), along2(8*q, 6, n)
    real(wp), intent(inout) :: dstrain(8*q, 6, n)
    real(wp) :: normal(8*q, 3), dual(8*q, 3, 2), shear(8*q, 2), growth, h1, h2, h3
    integer :: l, row

    do row = 1, n
      associate (d => dstrain(:, :, row))
        call sheet_frames(8*q, tangents(:, 1:6, row), normal, dual)
        call added_shear(8*q, tangents(:, 1:3, row), normal, along1(:, :, row), d, shear(:, 1))
        call added_shear(8*q, tangents(:, 4:6, row), normal, along2(:, :, row), d, shear(:, 2))
        !$omp simd private(growth, h1, h2, h3)
        do l = 1, 8*q
          growth = 0.5_wp*(theta(l, row) - d(l, 1) - d(l, 2) - d(l, 3))
          h1 = growth*normal(l, 1) + shear(l, 1)*dual(l, 1, 1) + shear(l, 2)*dual(l, 1, 2)
          h2 = growth*normal(l, 2) + shear(l, 1)*dual(l, 2, 1) + shear(l, 2)*dual(l, 2, 2)
          h3 = growth*normal(l, 3) + shear(l, 1)*dual(l, 3, 1) + shear(l, 2)*dual(l, 3, 2)
          d(l, 1) = d(l, 1) + 2.0_wp*h1*normal(l, 1)
          d(l, 2) = d(l, 2) + 2.0_wp*h2*normal(l, 2)
          d(l, 3) = d(l, 3) + 2.0_wp*h3*normal(l, 3)
          d(l, 4) = d(l, 4) + 2.0_wp*(h1*normal(l, 2) + h2*normal(l, 1))
          d(l, 5) = d(l, 5) + 2.0_wp*(h1*normal(l, 3) + h3*normal(l, 1))
          d(l, 6) = d(l, 6) + 2.0_wp*(h2*normal(l, 3) + h3*normal(l, 2))
        end do
      end associate
    end do
  end subroutine correct_sheet

  !> t.(A - D).n of engineering strains A and D.
  pure subroutine added_shear(m, t, n, a, d, shear)
    integer, intent(in) :: m
    real(wp), intent(in) :: t(m, 3), n(m, 3), a(m, 6), d(m, 6)
    real(wp), intent(out) :: shear(m)
    integer :: l

    !$omp simd
    do l = 1, m
      shear(l) = (a(l, 1) - d(l, 1))*t(l, 1)*n(l, 1) + (a(l, 2) - d(l, 2))*t(l, 2)*n(l, 2) &
                 + (a(l, 3) - d(l, 3))*t(l, 3)*n(l, 3) &
                 + 0.5_wp*((a(l, 4) - d(l, 4))*(t(l, 1)*n(l, 2) + t(l, 2)*n(l, 1)) &
                           + (a(l, 5) - d(l, 5))*(t(l, 1)*n(l, 3) + t(l, 3)*n(l, 1)) &
                           + (a(l, 6) - d(l, 6))*(t(l, 2)*n(l, 3) + t(l, 3)*n(l, 2)))
    end do
  end subroutine added_shear

  !> Split stresses into what works on the projected strains of `correct_sheet` and the rest, which
  !! lies within the sheet: R_ab = g^a.S.g^b - mean g^a.g^b by the dual tangents g^1, g^2.
  pure subroutine split_sheet(q, n, tangents, weighted, mean, along1, along2, plane)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: tangents(8*q, 12, n)    !! those of the end of the step are used
    real(wp), intent(in) :: weighted(8*q, 6, n)
    real(wp), intent(out) :: mean(8*q, n), along1(8*q, 6, n), along2(8*q, 6, n)
    real(wp), intent(out) :: plane(8*q, 3, n)       !! R_11, R_12, R_22
    real(wp) :: normal(8*q, 3), dual(8*q, 3, 2), shear(8*q, 2)
    real(wp) :: n1, n2, n3, a1, a2, a3, b1, b2, b3, f1, f2, f3
    integer :: l, row

    do row = 1, n
      associate (s => weighted(:, :, row))
        call sheet_frames(8*q, tangents(:, 7:12, row), normal, dual)
        !$omp simd private(n1, n2, n3, a1, a2, a3, b1, b2, b3, f1, f2, f3)
        do l = 1, 8*q
          n1 = normal(l, 1); n2 = normal(l, 2); n3 = normal(l, 3)
          a1 = dual(l, 1, 1); a2 = dual(l, 2, 1); a3 = dual(l, 3, 1)
          b1 = dual(l, 1, 2); b2 = dual(l, 2, 2); b3 = dual(l, 3, 2)
          f1 = s(l, 1)*n1 + s(l, 4)*n2 + s(l, 5)*n3
          f2 = s(l, 4)*n1 + s(l, 2)*n2 + s(l, 6)*n3
          f3 = s(l, 5)*n1 + s(l, 6)*n2 + s(l, 3)*n3
          mean(l, row) = f1*n1 + f2*n2 + f3*n3
          shear(l, 1) = 2.0_wp*(f1*a1 + f2*a2 + f3*a3)
          shear(l, 2) = 2.0_wp*(f1*b1 + f2*b2 + f3*b3)
          f1 = (s(l, 1) - mean(l, row))*a1 + s(l, 4)*a2 + s(l, 5)*a3
          f2 = s(l, 4)*a1 + (s(l, 2) - mean(l, row))*a2 + s(l, 6)*a3
          f3 = s(l, 5)*a1 + s(l, 6)*a2 + (s(l, 3) - mean(l, row))*a3
          plane(l, 1, row) = f1*a1 + f2*a2 + f3*a3
          plane(l, 2, row) = f1*b1 + f2*b2 + f3*b3
          f1 = (s(l, 1) - mean(l, row))*b1 + s(l, 4)*b2 + s(l, 5)*b3
          f2 = s(l, 4)*b1 + (s(l, 2) - mean(l, row))*b2 + s(l, 6)*b3
          f3 = s(l, 5)*b1 + s(l, 6)*b2 + (s(l, 3) - mean(l, row))*b3
          plane(l, 3, row) = f1*b1 + f2*b2 + f3*b3
        end do
        call shear_stress(8*q, tangents(:, 7:9, row), normal, shear(:, 1), along1(:, :, row))
        call shear_stress(8*q, tangents(:, 10:12, row), normal, shear(:, 2), along2(:, :, row))
      end associate
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

  !> Stress that works on t.D.n alone: the symmetric part of t n, times a shear.
  pure subroutine shear_stress(m, t, n, shear, stress)
    integer, intent(in) :: m
    real(wp), intent(in) :: t(m, 3), n(m, 3), shear(m)
    real(wp), intent(out) :: stress(m, 6)
    integer :: l

    !$omp simd
    do l = 1, m
      stress(l, 1) = shear(l)*t(l, 1)*n(l, 1)
      stress(l, 2) = shear(l)*t(l, 2)*n(l, 2)
      stress(l, 3) = shear(l)*t(l, 3)*n(l, 3)
      stress(l, 4) = 0.5_wp*shear(l)*(t(l, 1)*n(l, 2) + t(l, 2)*n(l, 1))
      stress(l, 5) = 0.5_wp*shear(l)*(t(l, 1)*n(l, 3) + t(l, 3)*n(l, 1))
      stress(l, 6) = 0.5_wp*shear(l)*(t(l, 2)*n(l, 3) + t(l, 3)*n(l, 2))
    end do
  end subroutine shear_stress

  !> Unit normals of two tangents and their dual pairs in their plane.
  pure subroutine sheet_frames(m, t, normal, dual)
    integer, intent(in) :: m
    real(wp), intent(in) :: t(m, 3, 2)
    real(wp), intent(out) :: normal(m, 3), dual(m, 3, 2)
    real(wp) :: n1, n2, n3, scaling
    integer :: l

    !$omp simd private(n1, n2, n3, scaling)
    do l = 1, m
      n1 = t(l, 2, 1)*t(l, 3, 2) - t(l, 3, 1)*t(l, 2, 2)
      n2 = t(l, 3, 1)*t(l, 1, 2) - t(l, 1, 1)*t(l, 3, 2)
      n3 = t(l, 1, 1)*t(l, 2, 2) - t(l, 2, 1)*t(l, 1, 2)
      scaling = 1.0_wp/(n1*n1 + n2*n2 + n3*n3)
      dual(l, 1, 1) = scaling*(t(l, 2, 2)*n3 - t(l, 3, 2)*n2)
      dual(l, 2, 1) = scaling*(t(l, 3, 2)*n1 - t(l, 1, 2)*n3)
      dual(l, 3, 1) = scaling*(t(l, 1, 2)*n2 - t(l, 2, 2)*n1)
      dual(l, 1, 2) = scaling*(n2*t(l, 3, 1) - n3*t(l, 2, 1))
      dual(l, 2, 2) = scaling*(n3*t(l, 1, 1) - n1*t(l, 3, 1))
      dual(l, 3, 2) = scaling*(n1*t(l, 2, 1) - n2*t(l, 1, 1))
      scaling = sqrt(scaling)
      normal(l, 1) = scaling*n1
      normal(l, 2) = scaling*n2
      normal(l, 3) = scaling*n3
    end do
  end subroutine sheet_frames

end module projected_points
