!> Axes of the material in a sheet, as subroutines of users know them: axis 1 begins as the
!! projection of x, axis 3 is the normal, and the axes rotate with the rotation of F = R U in the
!! plane (Green and Naghdi). So has Abaqus the axes of all shells.
module user_sheet
  use kinds, only: wp
  use plane_stress, only: in_sheet
  implicit none
  private

  public :: angle_in_sheet, find_axes, turn_into_axes, turn_out_of_axes, with_zeros, about_normal

contains

  !> Angle from axis 1 of a frame to the projection of x, or of z where x is normal to the sheet.
  pure real(wp) function angle_in_sheet(frame) result(angle)
    real(wp), intent(in) :: frame(9)     !! component j of axis i at 3 (i - 1) + j
    real(wp), parameter :: least = sin(0.1_wp*acos(-1.0_wp)/180.0_wp)

    angle = atan2(frame(4), frame(1))
    if (norm2(frame([1, 4])) < least) angle = atan2(frame(6), frame(3))
  end function angle_in_sheet

  !> Axes of points in the frame of the end of an increment: those of its start, carried by the
  !! spin, of its middle, and of its end. The deformation gradients become the stretches U.
  pure subroutine find_axes(n, angle, spin, f0, f1, start, middle, finish, turn)
    integer, intent(in) :: n
    real(wp), intent(in) :: angle(n)           !! of axis 1 in the frame of the start of all
    real(wp), intent(in) :: spin(n)            !! of the material against the frame, 12
    real(wp), intent(inout) :: f0(n, 9), f1(n, 9)      !! row by row, in the frames
    real(wp), intent(out), dimension(n, 2) :: start, middle, finish   !! cosine and sine
    real(wp), intent(out) :: turn(n)           !! spin of the material against its axes, 12
    real(wp) :: first(2), c, s, half, scaling
    integer :: l

    do l = 1, n
      first = [cos(angle(l)), sin(angle(l))]
      call to_stretch(first, f0(l, :), start(l, :))
      call to_stretch(first, f1(l, :), finish(l, :))
      half = 0.5_wp*spin(l)
      scaling = 1.0_wp/(1.0_wp + half*half)
      c = (1.0_wp - half*half)*scaling
      s = 2.0_wp*half*scaling
      start(l, :) = [start(l, 1)*c + start(l, 2)*s, start(l, 2)*c - start(l, 1)*s]
      c = start(l, 1)*finish(l, 1) + start(l, 2)*finish(l, 2)
      s = start(l, 1)*finish(l, 2) - start(l, 2)*finish(l, 1)
      turn(l) = 2.0_wp*s/(1.0_wp + c)
      middle(l, :) = start(l, :) + finish(l, :)
      middle(l, :) = middle(l, :)/norm2(middle(l, :))
    end do
  end subroutine find_axes

  !> From F in the frames of start and end, given axis 1 in that of the start, to U in the axes of
  !! the material, and axis 1 in the frame of the end.
  pure subroutine to_stretch(first, f, axis)
    real(wp), intent(in) :: first(2)
    real(wp), intent(inout) :: f(9)
    real(wp), intent(out) :: axis(2)
    real(wp) :: r(2), v11, v12, v21, v22

    r = [f(1) + f(5), f(4) - f(2)]
    r = r/norm2(r)
    axis = [r(1)*first(1) - r(2)*first(2), r(1)*first(2) + r(2)*first(1)]
    v11 = f(1)*first(1) + f(2)*first(2)
    v12 = f(2)*first(1) - f(1)*first(2)
    v21 = f(4)*first(1) + f(5)*first(2)
    v22 = f(5)*first(1) - f(4)*first(2)
    f([1, 2]) = [axis(1)*v11 + axis(2)*v21, axis(1)*v12 + axis(2)*v22]
    f([4, 5]) = [axis(1)*v21 - axis(2)*v11, axis(1)*v22 - axis(2)*v12]
  end subroutine to_stretch

  !> Components 11, 22, 12 of tensors, shear not doubled, from the frame to axes in it.
  pure subroutine turn_into_axes(n, axes, tensor)
    integer, intent(in) :: n
    real(wp), intent(in) :: axes(n, 2)         !! cosine and sine
    real(wp), intent(inout) :: tensor(n, 3)
    real(wp) :: mean, half, c, s
    integer :: l

    !$omp simd private(mean, half, c, s)
    do l = 1, n
      c = axes(l, 1)*axes(l, 1) - axes(l, 2)*axes(l, 2)
      s = 2.0_wp*axes(l, 1)*axes(l, 2)
      mean = 0.5_wp*(tensor(l, 1) + tensor(l, 2))
      half = 0.5_wp*(tensor(l, 1) - tensor(l, 2))
      tensor(l, 1) = c*half + s*tensor(l, 3)
      tensor(l, 3) = c*tensor(l, 3) - s*half
      tensor(l, 2) = mean - tensor(l, 1)
      tensor(l, 1) = mean + tensor(l, 1)
    end do
  end subroutine turn_into_axes

  !> The reverse.
  pure subroutine turn_out_of_axes(n, axes, tensor)
    integer, intent(in) :: n
    real(wp), intent(in) :: axes(n, 2)
    real(wp), intent(inout) :: tensor(n, 3)
    real(wp) :: back(n, 2)

    back(:, 1) = axes(:, 1)
    back(:, 2) = -axes(:, 2)
    call turn_into_axes(n, back, tensor)
  end subroutine turn_out_of_axes

  !> Components 11 22 12 as six, of which the others are zero.
  pure function with_zeros(n, values) result(tensors)
    integer, intent(in) :: n
    real(wp), intent(in) :: values(n, 3)
    real(wp) :: tensors(n, 6)

    tensors = 0.0_wp
    tensors(:, in_sheet) = values
  end function with_zeros

  !> Spin increments 12 13 23 of one in the sheet.
  pure function about_normal(n, spin) result(spins)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n)
    real(wp) :: spins(n, 3)

    spins = 0.0_wp
    spins(:, 1) = spin
  end function about_normal

end module user_sheet
