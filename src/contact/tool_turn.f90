!> Tools that turn: from space into the frame of a tool and back. A place X of the tool lies at
!! rotation*X + displacement in space.
module tool_turn
  use kinds, only: wp
  use tool, only: tool_t
  implicit none
  private

  public :: rotation_about, into_frame, pace_of, way_of, torque_of

contains

  !> Matrix of the rotation about an axis by an angle, right-handed (O. Rodrigues, 1840).
  pure function rotation_about(axis, angle) result(matrix)
    real(wp), intent(in) :: axis(3)   !! unit vector
    real(wp), intent(in) :: angle     !! [radians]
    real(wp) :: matrix(3, 3)
    integer :: i, j

    do j = 1, 3
      do i = 1, 3
        matrix(i, j) = (1.0_wp - cos(angle))*axis(i)*axis(j)
      end do
      matrix(j, j) = matrix(j, j) + cos(angle)
    end do
    matrix(:, 1) = matrix(:, 1) + sin(angle)*[0.0_wp, axis(3), -axis(2)]
    matrix(:, 2) = matrix(:, 2) + sin(angle)*[-axis(3), 0.0_wp, axis(1)]
    matrix(:, 3) = matrix(:, 3) + sin(angle)*[axis(2), -axis(1), 0.0_wp]
  end function rotation_about

  !> Turn points with the tool back to where it began, but leave them as far as it has moved: where
  !! they would be seen beside a tool that had only moved.
  pure subroutine into_frame(tool, n, x)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n, 3)   !! [length]

    x = matmul(x - spread(tool%displacement, 1, n), tool%rotation) + spread(tool%displacement, 1, n)
  end subroutine into_frame

  !> How far a tool has come: its place on the axis about which it turns.
  pure function way_of(tool) result(way)
    type(tool_t), intent(in) :: tool
    real(wp) :: way(3)

    way = tool%displacement
    if (tool%is_turning) way = way + matmul(tool%rotation, tool%reference) - tool%reference
  end function way_of

  !> Moment about the tool's reference of forces whose couple, forces times places in the tool's
  !! frame, is known.
  pure function torque_of(tool, force, couple) result(torque)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: force(3)       !! their sum in space [force]
    real(wp), intent(in) :: couple(3, 3)   !! sum of f_i X_j [force length]
    real(wp) :: torque(3)                  !! in space [force length]
    real(wp) :: about(3, 3)
    integer :: j

    do j = 1, 3
      about(:, j) = couple(:, j) - force*tool%reference(j)
    end do
    about = matmul(about, transpose(tool%rotation))
    torque = [about(3, 2) - about(2, 3), about(1, 3) - about(3, 1), about(2, 1) - about(1, 2)]
  end function torque_of

  !> Largest speed of a corner of the box around the tool [length/time].
  pure real(wp) function pace_of(tool) result(pace)
    type(tool_t), intent(in) :: tool
    real(wp) :: corner(3)
    integer :: i

    pace = norm2(tool%velocity)
    if (.not. tool%is_turning) return
    pace = 0.0_wp
    do i = 0, 7
      corner = merge(tool%box(:, 1), tool%box(:, 2), [btest(i, 0), btest(i, 1), btest(i, 2)])
      pace = max(pace, norm2(tool%velocity + matmul(tool%rotation_rate, corner)))
    end do
  end function pace_of

end module tool_turn
