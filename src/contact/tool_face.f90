!> One face of a tool in power form: point, derivatives, and how far a given point is from there.
!!
!! A face is the part of a surface between consecutive distinct knots; its homogeneous coordinates
!! (w x, w y, w z, w) are polynomials of the local coordinates s (along xi) and t (along eta), both
!! from 0 to 1.
module tool_face
  use kinds, only: wp
  implicit none
  private

  public :: separation_t, face_position, face_derivatives, separation, unit_normal, safe_normal

  !> What the local search needs to know about a point x and a position on a face, r = x - S.
  type :: separation_t
    real(wp) :: r(3)         !! from the face to the point, [CA] eq. (48) [length]
    real(wp) :: d1(3, 2)     !! derivatives of S by s and t [length]
    real(wp) :: square       !! r . r
    real(wp) :: slope(2)     !! S,s . r and S,t . r, [CA] eq. (49): where r . r falls
    real(wp) :: metric(3)    !! S,s . S,s, S,t . S,t, S,s . S,t
    real(wp) :: hessian(3)   !! metric - r . second derivatives, [CA] eq. (52), in the same order
  end type separation_t

contains

  !> Point of a face.
  pure function face_position(faces, face, at) result(point)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)   !! power form, (4, n1, n2, n faces)
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)      !! local coordinates s and t
    real(wp) :: point(3)
    real(wp) :: line(4), sum(4)
    integer :: a, b

    sum = 0.0_wp
    do b = size(faces, 3), 1, -1
      line = 0.0_wp
      do a = size(faces, 2), 1, -1
        line = line*at(1) + faces(:, a, b, face)
      end do
      sum = sum*at(2) + line
    end do
    point = sum(:3)/sum(4)
  end function face_position

  !> Point of a face with first and second derivatives, by Horner's scheme carried along for the
  !! derivatives and the quotient rule.
  pure subroutine face_derivatives(faces, face, at, point, d1, d2)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)   !! power form, (4, n1, n2, n faces)
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)      !! local coordinates s and t
    real(wp), intent(out) :: point(3)  !! [length]
    real(wp), intent(out) :: d1(3, 2)  !! by s and t
    real(wp), intent(out) :: d2(3, 3)  !! by s s, t t, s t
    real(wp), dimension(4) :: line, line_s, half_ss, h, h_s, h_t, h_st, half_hss, half_htt
    real(wp) :: inverse
    integer :: a, b

    h = 0.0_wp
    h_s = 0.0_wp
    h_t = 0.0_wp
    h_st = 0.0_wp
    half_hss = 0.0_wp
    half_htt = 0.0_wp
    do b = size(faces, 3), 1, -1
      line = 0.0_wp
      line_s = 0.0_wp
      half_ss = 0.0_wp
      do a = size(faces, 2), 1, -1
        half_ss = half_ss*at(1) + line_s
        line_s = line_s*at(1) + line
        line = line*at(1) + faces(:, a, b, face)
      end do
      half_htt = half_htt*at(2) + h_t
      h_t = h_t*at(2) + h
      h = h*at(2) + line
      h_st = h_st*at(2) + h_s
      h_s = h_s*at(2) + line_s
      half_hss = half_hss*at(2) + half_ss
    end do
    inverse = 1.0_wp/h(4)
    point = h(:3)*inverse
    d1(:, 1) = (h_s(:3) - h_s(4)*point)*inverse
    d1(:, 2) = (h_t(:3) - h_t(4)*point)*inverse
    d2(:, 1) = 2*(half_hss(:3) - h_s(4)*d1(:, 1) - half_hss(4)*point)*inverse
    d2(:, 2) = 2*(half_htt(:3) - h_t(4)*d1(:, 2) - half_htt(4)*point)*inverse
    d2(:, 3) = (h_st(:3) - h_s(4)*d1(:, 2) - h_t(4)*d1(:, 1) - h_st(4)*point)*inverse
  end subroutine face_derivatives

  !> How the point `x` lies to a position on a face.
  pure function separation(faces, face, at, x) result(state)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)   !! power form, (4, n1, n2, n faces)
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)      !! local coordinates s and t
    real(wp), intent(in) :: x(3)       !! [length]
    type(separation_t) :: state
    real(wp) :: point(3), d2(3, 3)

    call face_derivatives(faces, face, at, point, state%d1, d2)
    state%r = x - point
    state%square = dot_product(state%r, state%r)
    state%slope = matmul(state%r, state%d1)
    state%metric(1) = dot_product(state%d1(:, 1), state%d1(:, 1))
    state%metric(2) = dot_product(state%d1(:, 2), state%d1(:, 2))
    state%metric(3) = dot_product(state%d1(:, 1), state%d1(:, 2))
    state%hessian = state%metric - matmul(state%r, d2)
  end function separation

  !> Unit normal S,s x S,t, [CA] eq. (55); zero where the face has no tangent plane.
  pure function unit_normal(d1) result(normal)
    real(wp), intent(in) :: d1(3, 2)   !! derivatives by s and t
    real(wp) :: normal(3)
    real(wp), parameter :: small = 1.0e-12_wp
    real(wp) :: length

    normal = [d1(2, 1)*d1(3, 2) - d1(3, 1)*d1(2, 2), d1(3, 1)*d1(1, 2) - d1(1, 1)*d1(3, 2), &
              d1(1, 1)*d1(2, 2) - d1(2, 1)*d1(1, 2)]
    length = norm2(normal)
    if (length > small*maxval(sum(d1**2, 1))) then
      normal = normal/length
    else
      normal = 0.0_wp
    end if
  end function unit_normal

  !> Unit normal, taken a little inside the face where an edge has shrunk to a point.
  pure function safe_normal(faces, face, at) result(normal)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)   !! power form, (4, n1, n2, n faces)
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)
    real(wp), parameter :: inside = 1.0e-5_wp, origin(3) = 0.0_wp
    real(wp) :: normal(3)
    type(separation_t) :: here

    here = separation(faces, face, at, origin)
    normal = unit_normal(here%d1)
    if (norm2(normal) > 0.5_wp) return
    here = separation(faces, face, at + inside*(0.5_wp - at), origin)
    normal = unit_normal(here%d1)
  end function safe_normal

end module tool_face
