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
    real(wp) :: normal(8*q, 3), dual(8*q, 3, 2), form(8*q, 6), strain(8*q, 6)
    real(wp) :: growth(8*q), shear(8*q, 2)
    integer :: row, c

    do row = 1, n
      associate (t => tangents(:, 1:6, row), d => dstrain(:, :, row))
        call sheet_frames(8*q, t, normal, dual)
        growth = theta(:, row) - d(:, 1) - d(:, 2) - d(:, 3)
        call shear_form(8*q, t(:, 1:3), normal, form)
        call contract(8*q, form, along1(:, :, row) - d, shear(:, 1))
        call shear_form(8*q, t(:, 4:6), normal, form)
        call contract(8*q, form, along2(:, :, row) - d, shear(:, 2))
        call normal_strain(8*q, normal, strain)
        do c = 1, 6
          d(:, c) = d(:, c) + growth*strain(:, c)
        end do
        call shear_strain(8*q, dual(:, :, 1), normal, strain)
        do c = 1, 6
          d(:, c) = d(:, c) + shear(:, 1)*strain(:, c)
        end do
        call shear_strain(8*q, dual(:, :, 2), normal, strain)
        do c = 1, 6
          d(:, c) = d(:, c) + shear(:, 2)*strain(:, c)
        end do
      end associate
    end do
  end subroutine correct_sheet

  !> Split stresses into what works on the projected strains of `correct_sheet` and the rest.
  pure subroutine split_sheet(q, n, tangents, weighted, mean, along1, along2)
    integer, intent(in) :: q, n
    real(wp), intent(in) :: tangents(8*q, 12, n)    !! those of the end of the step are used
    real(wp), intent(inout) :: weighted(8*q, 6, n)
    real(wp), intent(out) :: mean(8*q, n), along1(8*q, 6, n), along2(8*q, 6, n)
    real(wp) :: normal(8*q, 3), dual(8*q, 3, 2), form(8*q, 6), strain(8*q, 6), shear(8*q)
    integer :: row, c

    do row = 1, n
      associate (t => tangents(:, 7:12, row), s => weighted(:, :, row))
        call sheet_frames(8*q, t, normal, dual)
        call normal_strain(8*q, normal, strain)
        call contract(8*q, s, strain, mean(:, row))
        call shear_strain(8*q, dual(:, :, 1), normal, strain)
        call contract(8*q, s, strain, shear)
        call shear_form(8*q, t(:, 1:3), normal, form)
        do c = 1, 6
          along1(:, c, row) = shear*form(:, c)
        end do
        call shear_strain(8*q, dual(:, :, 2), normal, strain)
        call contract(8*q, s, strain, shear)
        call shear_form(8*q, t(:, 4:6), normal, form)
        do c = 1, 6
          along2(:, c, row) = shear*form(:, c)
          s(:, c) = s(:, c) - along1(:, c, row) - along2(:, c, row)
        end do
        do c = 1, 3
          s(:, c) = s(:, c) - mean(:, row)
        end do
      end associate
    end do
  end subroutine split_sheet

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

  !> Sum over the components of two lists.
  pure subroutine contract(m, a, b, total)
    integer, intent(in) :: m
    real(wp), intent(in) :: a(m, 6), b(m, 6)
    real(wp), intent(out) :: total(m)

    total = a(:, 1)*b(:, 1) + a(:, 2)*b(:, 2) + a(:, 3)*b(:, 3) + a(:, 4)*b(:, 4) &
            + a(:, 5)*b(:, 5) + a(:, 6)*b(:, 6)
  end subroutine contract

  !> Factors of the engineering strains in t.D.n.
  pure subroutine shear_form(m, t, n, form)
    integer, intent(in) :: m
    real(wp), intent(in) :: t(m, 3), n(m, 3)
    real(wp), intent(out) :: form(m, 6)

    form(:, 1) = t(:, 1)*n(:, 1)
    form(:, 2) = t(:, 2)*n(:, 2)
    form(:, 3) = t(:, 3)*n(:, 3)
    form(:, 4) = 0.5_wp*(t(:, 1)*n(:, 2) + t(:, 2)*n(:, 1))
    form(:, 5) = 0.5_wp*(t(:, 1)*n(:, 3) + t(:, 3)*n(:, 1))
    form(:, 6) = 0.5_wp*(t(:, 2)*n(:, 3) + t(:, 3)*n(:, 2))
  end subroutine shear_form

  !> The tensor g n + n g as engineering strains.
  pure subroutine shear_strain(m, g, n, strain)
    integer, intent(in) :: m
    real(wp), intent(in) :: g(m, 3), n(m, 3)
    real(wp), intent(out) :: strain(m, 6)

    strain(:, 1) = 2.0_wp*g(:, 1)*n(:, 1)
    strain(:, 2) = 2.0_wp*g(:, 2)*n(:, 2)
    strain(:, 3) = 2.0_wp*g(:, 3)*n(:, 3)
    strain(:, 4) = 2.0_wp*(g(:, 1)*n(:, 2) + g(:, 2)*n(:, 1))
    strain(:, 5) = 2.0_wp*(g(:, 1)*n(:, 3) + g(:, 3)*n(:, 1))
    strain(:, 6) = 2.0_wp*(g(:, 2)*n(:, 3) + g(:, 3)*n(:, 2))
  end subroutine shear_strain

  !> The tensor n n as engineering strains.
  pure subroutine normal_strain(m, n, strain)
    integer, intent(in) :: m
    real(wp), intent(in) :: n(m, 3)
    real(wp), intent(out) :: strain(m, 6)

    strain(:, 1) = n(:, 1)*n(:, 1)
    strain(:, 2) = n(:, 2)*n(:, 2)
    strain(:, 3) = n(:, 3)*n(:, 3)
    strain(:, 4) = 2.0_wp*n(:, 1)*n(:, 2)
    strain(:, 5) = 2.0_wp*n(:, 1)*n(:, 3)
    strain(:, 6) = 2.0_wp*n(:, 2)*n(:, 3)
  end subroutine normal_strain

end module projected_points
