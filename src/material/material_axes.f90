!> Axes of the material that travel with each point.
!!
!! A point keeps the quaternion of its rotation since the start less that of no rotation, so that a
!! state of zeros means axes as the deck gives them.
module material_axes
  use kinds, only: wp
  use failure, only: error_t, fail
  implicit none
  private

  public :: axes_from_points, turn_axes, axes_rotation

contains

  !> Axes at the start: 1 along a, 3 along a x b, as columns.
  pure subroutine axes_from_points(points, axes, error)
    real(wp), intent(in) :: points(:)       !! a and b, six numbers
    real(wp), intent(out) :: axes(3, 3)
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: least = 1.0e-6_wp   ! sine of the angle between a and b
    real(wp) :: a(3), b(3), normal(3)

    axes = 0.0_wp
    if (size(points) /= 6) then
      call fail(error, "material: an orientation takes two vectors, a and b")
      return
    end if
    a = points(:3)
    b = points(4:)
    normal = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
    if (.not. norm2(normal) > least*norm2(a)*norm2(b)) then
      call fail(error, "material: the vectors a and b of the orientation must not be zero or "// &
                "parallel")
      return
    end if
    axes(:, 1) = a/norm2(a)
    axes(:, 3) = normal/norm2(normal)
    axes(:, 2) = [axes(2, 3)*axes(3, 1) - axes(3, 3)*axes(2, 1), &
                  axes(3, 3)*axes(1, 1) - axes(1, 3)*axes(3, 1), &
                  axes(1, 3)*axes(2, 1) - axes(2, 3)*axes(1, 1)]
  end subroutine axes_from_points

  !> Turn the axes of a row by the spin increment, exactly as the stress was turned
  !! (T. J. R. Hughes and J. Winget, IJNME 15 (1980)): its quaternion is (1, w/2) over its length.
  pure subroutine turn_axes(n, spin, turned)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n, 3)         !! increment 12 13 23
    real(wp), intent(inout) :: turned(n, 4)    !! quaternion less (1, 0, 0, 0)
    real(wp) :: a, b1, b2, b3, h1, h2, h3, q0, q1, q2, q3, scaling
    integer :: l

    !$omp simd private(a, b1, b2, b3, h1, h2, h3, q0, q1, q2, q3, scaling)
    do l = 1, n
      h1 = -0.5_wp*spin(l, 3)
      h2 = 0.5_wp*spin(l, 2)
      h3 = -0.5_wp*spin(l, 1)
      a = 1.0_wp + turned(l, 1)
      b1 = turned(l, 2)
      b2 = turned(l, 3)
      b3 = turned(l, 4)
      q0 = a - h1*b1 - h2*b2 - h3*b3
      q1 = b1 + a*h1 + h2*b3 - h3*b2
      q2 = b2 + a*h2 + h3*b1 - h1*b3
      q3 = b3 + a*h3 + h1*b2 - h2*b1
      scaling = 1.0_wp/sqrt(q0*q0 + q1*q1 + q2*q2 + q3*q3)
      turned(l, 1) = scaling*q0 - 1.0_wp
      turned(l, 2) = scaling*q1
      turned(l, 3) = scaling*q2
      turned(l, 4) = scaling*q3
    end do
  end subroutine turn_axes

  !> Rotation of a row from space into the axes of the material: entry (i, j), the component j of
  !! axis i, at 3 (i - 1) + j.
  pure subroutine axes_rotation(n, axes, turned, rotation)
    integer, intent(in) :: n
    real(wp), intent(in) :: axes(3, 3)         !! at the start, as columns
    real(wp), intent(in) :: turned(n, 4)
    real(wp), intent(out) :: rotation(n, 9)
    real(wp) :: w, v(3), axis(3), across(3)
    integer :: l, i

    do l = 1, n
      w = 1.0_wp + turned(l, 1)
      v = turned(l, 2:)
      do i = 1, 3
        axis = axes(:, i)
        across = 2.0_wp*[v(2)*axis(3) - v(3)*axis(2), v(3)*axis(1) - v(1)*axis(3), &
                         v(1)*axis(2) - v(2)*axis(1)]
        rotation(l, 3*i - 2:3*i) = axis + w*across &
                                   + [v(2)*across(3) - v(3)*across(2), &
                                      v(3)*across(1) - v(1)*across(3), &
                                      v(1)*across(2) - v(2)*across(1)]
      end do
    end do
  end subroutine axes_rotation

end module material_axes
