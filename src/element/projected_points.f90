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
  public :: correct_sheet, split_sheet

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

  !> Volume strain along the normal, transverse shear along its own axis.
  pure subroutine correct_sheet(q, n, tangents, theta, along1, along2, dstrain)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: tangents(8*q, 12, n)    !! those of the middle of the step are used
    real(wp), intent(in) :: theta(8*q, n), along1(8*q, 6, n), along2(8*q, 6, n)
    real(wp), intent(inout) :: dstrain(8*q, 6, n)
    real(wp) :: t(3, 2), dual(3, 2), normal(3), d(6), gap(6, 2), growth, shear(2)
    integer :: l, row

    do row = 1, n
      !$omp simd private(t, dual, normal, d, gap, growth, shear)
      do l = 1, 8*q
        t(1, 1) = tangents(l, 1, row); t(2, 1) = tangents(l, 2, row); t(3, 1) = tangents(l, 3, row)
        t(1, 2) = tangents(l, 4, row); t(2, 2) = tangents(l, 5, row); t(3, 2) = tangents(l, 6, row)
        call sheet_frame(t, normal, dual)
        d = dstrain(l, :, row)
        gap(:, 1) = along1(l, :, row) - d
        gap(:, 2) = along2(l, :, row) - d
        growth = theta(l, row) - d(1) - d(2) - d(3)
        shear(1) = sum(gap(:, 1)*shear_form(t(:, 1), normal))
        shear(2) = sum(gap(:, 2)*shear_form(t(:, 2), normal))
        d = d + growth*normal_strain(normal) + shear(1)*shear_strain(dual(:, 1), normal) &
            + shear(2)*shear_strain(dual(:, 2), normal)
        dstrain(l, :, row) = d
      end do
    end do
  end subroutine correct_sheet

  !> Split stresses into what works on the projected strains of `correct_sheet` and the rest.
  pure subroutine split_sheet(q, n, tangents, weighted, mean, along1, along2)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: tangents(8*q, 12, n)    !! those of the end of the step are used
    real(wp), intent(inout) :: weighted(8*q, 6, n)
    real(wp), intent(out) :: mean(8*q, n), along1(8*q, 6, n), along2(8*q, 6, n)
    real(wp) :: t(3, 2), dual(3, 2), normal(3), s(6), y(6, 2)
    integer :: l, row

    do row = 1, n
      !$omp simd private(t, dual, normal, s, y)
      do l = 1, 8*q
        t(1, 1) = tangents(l, 7, row); t(2, 1) = tangents(l, 8, row); t(3, 1) = tangents(l, 9, row)
        t(1, 2) = tangents(l, 10, row); t(2, 2) = tangents(l, 11, row)
        t(3, 2) = tangents(l, 12, row)
        call sheet_frame(t, normal, dual)
        s = weighted(l, :, row)
        mean(l, row) = sum(s*normal_strain(normal))
        y(:, 1) = sum(s*shear_strain(dual(:, 1), normal))*shear_form(t(:, 1), normal)
        y(:, 2) = sum(s*shear_strain(dual(:, 2), normal))*shear_form(t(:, 2), normal)
        along1(l, :, row) = y(:, 1)
        along2(l, :, row) = y(:, 2)
        s = s - y(:, 1) - y(:, 2)
        s(:3) = s(:3) - mean(l, row)
        weighted(l, :, row) = s
      end do
    end do
  end subroutine split_sheet

  !> Unit normal of two tangents and their dual pair in their plane.
  pure subroutine sheet_frame(t, normal, dual)
    real(wp), intent(in) :: t(3, 2)
    real(wp), intent(out) :: normal(3), dual(3, 2)
    real(wp) :: area

    normal = cross(t(:, 1), t(:, 2))
    area = sqrt(normal(1)**2 + normal(2)**2 + normal(3)**2)
    normal = normal/area
    dual(:, 1) = cross(t(:, 2), normal)/area
    dual(:, 2) = cross(normal, t(:, 1))/area
  end subroutine sheet_frame

  pure function cross(a, b) result(c)
    real(wp), intent(in) :: a(3), b(3)
    real(wp) :: c(3)

    c(1) = a(2)*b(3) - a(3)*b(2)
    c(2) = a(3)*b(1) - a(1)*b(3)
    c(3) = a(1)*b(2) - a(2)*b(1)
  end function cross

  !> Factors of the engineering strains in t.D.n.
  pure function shear_form(t, n) result(form)
    real(wp), intent(in) :: t(3), n(3)
    real(wp) :: form(6)

    form(1) = t(1)*n(1)
    form(2) = t(2)*n(2)
    form(3) = t(3)*n(3)
    form(4) = 0.5_wp*(t(1)*n(2) + t(2)*n(1))
    form(5) = 0.5_wp*(t(1)*n(3) + t(3)*n(1))
    form(6) = 0.5_wp*(t(2)*n(3) + t(3)*n(2))
  end function shear_form

  !> The tensor g n + n g as engineering strains.
  pure function shear_strain(g, n) result(strain)
    real(wp), intent(in) :: g(3), n(3)
    real(wp) :: strain(6)

    strain(1) = 2.0_wp*g(1)*n(1)
    strain(2) = 2.0_wp*g(2)*n(2)
    strain(3) = 2.0_wp*g(3)*n(3)
    strain(4) = 2.0_wp*(g(1)*n(2) + g(2)*n(1))
    strain(5) = 2.0_wp*(g(1)*n(3) + g(3)*n(1))
    strain(6) = 2.0_wp*(g(2)*n(3) + g(3)*n(2))
  end function shear_strain

  !> The tensor n n as engineering strains.
  pure function normal_strain(n) result(strain)
    real(wp), intent(in) :: n(3)
    real(wp) :: strain(6)

    strain(1) = n(1)*n(1)
    strain(2) = n(2)*n(2)
    strain(3) = n(3)*n(3)
    strain(4) = 2.0_wp*n(1)*n(2)
    strain(5) = 2.0_wp*n(1)*n(3)
    strain(6) = 2.0_wp*n(2)*n(3)
  end function normal_strain

end module projected_points
