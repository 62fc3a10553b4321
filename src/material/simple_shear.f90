!> Amount of simple shear of a point, and from which amount on a warning is due. Each law reports
!! itself why its stress is wrong there, see `shear_warning`.
!!
!! Tensors that a law keeps rotate with the spin (Jaumann rate). In simple shear the spin never ends
!! while the material's own axes stop rotating, so the shear stress oscillates: that of a linear
!! back stress is C/3 sin(gamma), that of Hooke's law in rates G sin(gamma) (J. K. Dienes, Acta
!! Mechanica 32 (1979); J. C. Nagtegaal and J. E. de Jong, in Plasticity of metals at finite strain,
!! Stanford 1982).
module simple_shear
  use kinds, only: wp
  use block_law, only: block_law_t
  use symmetric_eigen, only: principal_values
  use linear_algebra, only: cross
  implicit none
  private

  public :: simple_shear_of, sheet_shear, equivalent_strain

  real(wp), parameter, public :: shear_limit = 1.0_wp   !! beyond it a warning is due
  real(wp), parameter :: opposite = -0.9999_wp          !! cosine; the rotation has no unique axis

contains

  !> The simple shear that a deformation gradient amounts to: that of its stretches,
  !! sqrt(a/c) - sqrt(c/a) with the largest a and the smallest c, or that of its rotation, two
  !! tangents of the angle, whichever is less. So neither a pure stretch nor a rotation of the whole
  !! counts as shear. Endless where the gradient is none.
  pure real(wp) function simple_shear_of(gradient) result(shear)
    real(wp), intent(in) :: gradient(3, 3)
    real(wp) :: c(3, 3), squares(3), directions(3, 3), inverse(3, 3), ratio, cosine
    integer :: i

    c = matmul(transpose(gradient), gradient)
    call principal_values([c(1, 1), c(2, 2), c(3, 3), c(1, 2), c(1, 3), c(2, 3)], squares, &
                          directions)
    shear = huge(shear)
    if (.not. minval(squares) > 0.0_wp) return
    ratio = sqrt(sqrt(maxval(squares)/minval(squares)))
    inverse = 0.0_wp
    do i = 1, 3
      inverse = inverse + spread(directions(:, i), 2, 3)*spread(directions(:, i), 1, 3) &
                /sqrt(squares(i))
    end do
    cosine = 0.5_wp*(sum(gradient*inverse) - 1.0_wp)   ! the inverse stretch is symmetric
    shear = ratio - 1.0_wp/ratio
    if (cosine > 0.0_wp) shear = min(shear, 2.0_wp*sqrt(max(1.0_wp - cosine**2, 0.0_wp))/cosine)
  end function simple_shear_of

  !> The simple shear of a point of a sheet, see `simple_shear_of`, in a frame that rotates with
  !! the sheet: one that is stretched and then bent has not sheared. The sheet rotates as its normal
  !! does, or as the fibres that were normal to it; a shear through the thickness keeps one of them,
  !! and whichever shows more counts. Material axes 1 and 2 lie in the sheet.
  pure real(wp) function sheet_shear(start, now) result(shear)
    real(wp), intent(in) :: start(3, 3), now(3, 3)   !! tangents of the material axes, the columns
    real(wp) :: gradient(3, 3), reciprocal(3, 3)

    reciprocal(:, 1) = cross(start(:, 2), start(:, 3))
    reciprocal(:, 2) = cross(start(:, 3), start(:, 1))
    reciprocal(:, 3) = cross(start(:, 1), start(:, 2))
    gradient = matmul(now, transpose(reciprocal))/sum(start(:, 1)*reciprocal(:, 1))
    shear = max(simple_shear_of(rotated_back(gradient, reciprocal(:, 3), &
                                            cross(now(:, 1), now(:, 2)))), &
                simple_shear_of(rotated_back(gradient, reciprocal(:, 3), &
                                            matmul(gradient, reciprocal(:, 3)))))
  end function sheet_shear

  !> A deformation gradient without the smallest rotation from one direction to another; as it is if
  !! these are opposite.
  pure function rotated_back(gradient, was, is) result(rest)
    real(wp), intent(in) :: gradient(3, 3), was(3), is(3)
    real(wp) :: rest(3, 3)
    real(wp) :: lengths, cosine, axis(3)
    integer :: i

    rest = gradient
    lengths = norm2(was)*norm2(is)
    if (.not. lengths > 0.0_wp) return
    cosine = sum(was*is)/lengths
    if (cosine < opposite) return
    axis = cross(is, was)/lengths
    do i = 1, 3
      rest(:, i) = rest(:, i) + cross(axis, rest(:, i)) &
                   + cross(axis, cross(axis, rest(:, i)))/(1.0_wp + cosine)
    end do
  end function rotated_back

  !> Plastic strain and elastic equivalent strain of a point: at least 0.55 after a simple shear of
  !! one, so a look at it spares most points the gradient.
  pure real(wp) function equivalent_strain(law, stress, state) result(strain)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: stress(6)                   !! 11 22 33 12 13 23
    real(wp), intent(in) :: state(:)
    real(wp) :: mises

    mises = sqrt(0.5_wp*((stress(1) - stress(2))**2 + (stress(2) - stress(3))**2 &
                         + (stress(3) - stress(1))**2) + 3.0_wp*sum(stress(4:)**2))
    strain = mises/(3.0_wp*law%shear)
    if (law%eqps_state > 0) strain = strain + state(law%eqps_state)
  end function equivalent_strain

end module simple_shear
