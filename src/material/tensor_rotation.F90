!> Rotation of the tensors of a row of points: by the spin, or into the axes of the material that
!! travel with each point.
!!
!! For its axes a point keeps the quaternion of its rotation since the start less that of no
!! rotation, so that a state of zeros means axes as the deck gives them.
module tensor_rotation
  use kinds, only: wp
  use failure, only: error_t, fail
  use linear_algebra, only: cross
  implicit none
  private

  public :: rotate_by_spin, rotate_all_by_spin, turn_to_end, rotate_tensors, transposed
  public :: axes_from_points, rotate_axes, axes_rotation, axes_in_sheet, turn_in_plane

  !> Spin increment beyond which strain increments are turned exactly: 1/1000 of a radian, where
  !! the linear form leaves out 2.5e-7 of them.
  real(wp), parameter, public :: far_turn = 1.0e-3_wp

contains

  !> Rotate the tensors of a row by their spin increments (T. J. R. Hughes and J. Winget, IJNME 15
  !! (1980), eq. (13)).
  pure subroutine rotate_by_spin(n, spin, tensor)
    integer, parameter :: n_tensors = 1
#include "spin_rotation.inc"
  end subroutine rotate_by_spin

  !> Rotate several tensors a point, which share its rotation.
  pure subroutine rotate_all_by_spin(n, n_tensors, spin, tensor)
    integer, intent(in) :: n, n_tensors
    real(wp), intent(in) :: spin(n, 3)
    real(wp), intent(inout) :: tensor(n, 6, n_tensors)
    integer :: k

    select case (n_tensors)
    case (2)
      call rotate_two(n, spin, tensor)
    case (3)
      call rotate_three(n, spin, tensor)
    case default
      do k = 1, n_tensors
        call rotate_by_spin(n, spin, tensor(:, :, k))
      end do
    end select
  end subroutine rotate_all_by_spin

  pure subroutine rotate_two(n, spin, tensor)
    integer, parameter :: n_tensors = 2
#include "spin_rotation.inc"
  end subroutine rotate_two

  pure subroutine rotate_three(n, spin, tensor)
    integer, parameter :: n_tensors = 3
#include "spin_rotation.inc"
  end subroutine rotate_three

  !> Rotate strain increments from the middle of their step to its end, by half of its spin W:
  !! D + (W D - D W)/2, which is exact to second order in the step. Without it the stress misses a
  !! part of first order wherever rotation and strain go together. Rows in which a point turns far,
  !! as in static steps, are turned by `turn_far`, all of their points alike.
  pure subroutine turn_to_end(n, spin, strain, volume)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n, 3)          !! increment 12 13 23
    real(wp), intent(inout) :: strain(n, 6)     !! 11 22 33 12 13 23, shear doubled
    real(wp), intent(inout) :: volume(n)        !! of the points, at the middle
    real(wp) :: w1, w2, w3, t1, t2, t3, t4, t5, t6, p1, p2, p3, p4, p5, p6, largest
    integer :: l

    largest = 0.0_wp
    !$omp simd reduction(max: largest)
    do l = 1, n
      largest = max(largest, spin(l, 1)**2 + spin(l, 2)**2 + spin(l, 3)**2)
    end do
    if (largest > far_turn**2) then
      call turn_far(n, spin, strain, volume)
      return
    end if
    !$omp simd private(w1, w2, w3, t1, t2, t3, t4, t5, t6, p1, p2, p3, p4, p5, p6)
    do l = 1, n
      t1 = strain(l, 1); t2 = strain(l, 2); t3 = strain(l, 3)
      t4 = 0.5_wp*strain(l, 4); t5 = 0.5_wp*strain(l, 5); t6 = 0.5_wp*strain(l, 6)
      ! W D - D W: p1, -p2 and -p3 are half of its diagonal, p4 to p6 its shear.
      w1 = spin(l, 1); w2 = spin(l, 2); w3 = spin(l, 3)
      p1 = w1*t4 + w2*t5
      p2 = w1*t4 - w3*t6
      p3 = w2*t5 + w3*t6
      p4 = w1*(t2 - t1) + w2*t6 + w3*t5
      p5 = w2*(t3 - t1) + w1*t6 - w3*t4
      p6 = w3*(t3 - t2) - w1*t5 - w2*t4
      strain(l, 1) = t1 + p1
      strain(l, 2) = t2 - p2
      strain(l, 3) = t3 - p3
      strain(l, 4) = strain(l, 4) + p4
      strain(l, 5) = strain(l, 5) + p5
      strain(l, 6) = strain(l, 6) + p6
    end do
  end subroutine turn_to_end

  !> The same for rotations of any size. The middle between a shape and the shape turned by an angle
  !! a is smaller, by cos(a/2) across the axis; so strains found there are too large, and volumes
  !! too small. For F = R (I + e) the gradient 2 (F - I)(F + I)^-1 is W + (I + W/2) e (I + W/2)^T
  !! up to the square of e, and R e R^T is wanted: Q D Q^T with Q = (I - W/2)^-1.
  pure subroutine turn_far(n, spin, strain, volume)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n, 3)
    real(wp), intent(inout) :: strain(n, 6), volume(n)
    real(wp) :: a1, a2, a3, s, q11, q12, q13, q21, q22, q23, q31, q32, q33
    real(wp) :: d1, d2, d3, d4, d5, d6, r11, r12, r13, r21, r22, r23, r31, r32, r33
    integer :: l

    !$omp simd private(a1, a2, a3, s, q11, q12, q13, q21, q22, q23, q31, q32, q33, d1, d2, d3, d4, &
    !$omp d5, d6, r11, r12, r13, r21, r22, r23, r31, r32, r33)
    do l = 1, n
      ! W/2 x = a x x, and Q = (I + W/2 + a a^T)/(1 + a.a).
      a1 = -0.5_wp*spin(l, 3); a2 = 0.5_wp*spin(l, 2); a3 = -0.5_wp*spin(l, 1)
      s = 1.0_wp/(1.0_wp + (a1*a1 + a2*a2 + a3*a3))
      volume(l) = volume(l)/s
      q11 = s*(1.0_wp + a1*a1); q12 = s*(a1*a2 - a3); q13 = s*(a1*a3 + a2)
      q21 = s*(a1*a2 + a3); q22 = s*(1.0_wp + a2*a2); q23 = s*(a2*a3 - a1)
      q31 = s*(a1*a3 - a2); q32 = s*(a2*a3 + a1); q33 = s*(1.0_wp + a3*a3)
      d1 = strain(l, 1); d2 = strain(l, 2); d3 = strain(l, 3)
      d4 = 0.5_wp*strain(l, 4); d5 = 0.5_wp*strain(l, 5); d6 = 0.5_wp*strain(l, 6)
      r11 = q11*d1 + q12*d4 + q13*d5; r12 = q11*d4 + q12*d2 + q13*d6; r13 = q11*d5 + q12*d6 + q13*d3
      r21 = q21*d1 + q22*d4 + q23*d5; r22 = q21*d4 + q22*d2 + q23*d6; r23 = q21*d5 + q22*d6 + q23*d3
      r31 = q31*d1 + q32*d4 + q33*d5; r32 = q31*d4 + q32*d2 + q33*d6; r33 = q31*d5 + q32*d6 + q33*d3
      strain(l, 1) = r11*q11 + r12*q12 + r13*q13
      strain(l, 2) = r21*q21 + r22*q22 + r23*q23
      strain(l, 3) = r31*q31 + r32*q32 + r33*q33
      strain(l, 4) = 2.0_wp*(r11*q21 + r12*q22 + r13*q23)
      strain(l, 5) = 2.0_wp*(r11*q31 + r12*q32 + r13*q33)
      strain(l, 6) = 2.0_wp*(r21*q31 + r22*q32 + r23*q33)
    end do
  end subroutine turn_far

  !> Q T Q^T of symmetric tensors with their shear as it is, not doubled.
  pure subroutine rotate_tensors(n, rotation, tensor)
    integer, intent(in) :: n
    real(wp), intent(in) :: rotation(n, 9)
    real(wp), intent(inout) :: tensor(n, 6)     !! 11 22 33 12 13 23
    real(wp) :: r11, r12, r13, r21, r22, r23, r31, r32, r33, s1, s2, s3, s4, s5, s6
    real(wp) :: t1, t2, t3, t4, t5, t6, t7, t8, t9
    integer :: l

    !$omp simd private(r11, r12, r13, r21, r22, r23, r31, r32, r33, s1, s2, s3, s4, s5, s6, &
    !$omp t1, t2, t3, t4, t5, t6, t7, t8, t9)
    do l = 1, n
      r11 = rotation(l, 1); r12 = rotation(l, 2); r13 = rotation(l, 3)
      r21 = rotation(l, 4); r22 = rotation(l, 5); r23 = rotation(l, 6)
      r31 = rotation(l, 7); r32 = rotation(l, 8); r33 = rotation(l, 9)
      s1 = tensor(l, 1); s2 = tensor(l, 2); s3 = tensor(l, 3)
      s4 = tensor(l, 4); s5 = tensor(l, 5); s6 = tensor(l, 6)
      t1 = r11*s1 + r12*s4 + r13*s5; t2 = r11*s4 + r12*s2 + r13*s6; t3 = r11*s5 + r12*s6 + r13*s3
      t4 = r21*s1 + r22*s4 + r23*s5; t5 = r21*s4 + r22*s2 + r23*s6; t6 = r21*s5 + r22*s6 + r23*s3
      t7 = r31*s1 + r32*s4 + r33*s5; t8 = r31*s4 + r32*s2 + r33*s6; t9 = r31*s5 + r32*s6 + r33*s3
      tensor(l, 1) = t1*r11 + t2*r12 + t3*r13
      tensor(l, 2) = t4*r21 + t5*r22 + t6*r23
      tensor(l, 3) = t7*r31 + t8*r32 + t9*r33
      tensor(l, 4) = t1*r21 + t2*r22 + t3*r23
      tensor(l, 5) = t1*r31 + t2*r32 + t3*r33
      tensor(l, 6) = t4*r31 + t5*r32 + t6*r33
    end do
  end subroutine rotate_tensors

  !> The inverse rotations.
  pure function transposed(n, rotation) result(inverse)
    integer, intent(in) :: n
    real(wp), intent(in) :: rotation(n, 9)
    real(wp) :: inverse(n, 9)

    inverse = rotation(:, [1, 4, 7, 2, 5, 8, 3, 6, 9])
  end function transposed

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
    normal = cross(a, b)
    if (.not. norm2(normal) > least*norm2(a)*norm2(b)) then
      call fail(error, "material: the vectors a and b of the orientation must not be zero or "// &
                "parallel")
      return
    end if
    axes(:, 1) = a/norm2(a)
    axes(:, 3) = normal/norm2(normal)
    axes(:, 2) = cross(axes(:, 3), axes(:, 1))
  end subroutine axes_from_points

  !> Axes of points of a sheet as a law keeps them, with all that comes later in the frames of the
  !! sheet: axis 1 without its part along the normal, axis 3 along the normal, also where it was
  !! against it, which orthotropy does not see. Where axis 1 is the normal all stay as they are.
  pure subroutine axes_in_sheet(n, axes, frame, quaternion)
    integer, intent(in) :: n
    real(wp), intent(in) :: axes(3, 3)             !! at the start in space, as columns
    real(wp), intent(in) :: frame(n, 9)            !! component j of frame axis i at 3 (i - 1) + j
    real(wp), intent(out) :: quaternion(n, 4)      !! less (1, 0, 0, 0)
    real(wp), parameter :: least = 1.0e-6_wp       ! sine of the angle of axis 1 to the normal
    real(wp) :: own(3, 3)
    integer :: l

    do l = 1, n
      own = matmul(transpose(reshape(frame(l, :), [3, 3])), axes)
      if (norm2(own(:2, 1)) > least) then
        own(:, 1) = [own(:2, 1), 0.0_wp]/norm2(own(:2, 1))
        own(:, 3) = [0.0_wp, 0.0_wp, 1.0_wp]
        own(:, 2) = cross(own(:, 3), own(:, 1))
      end if
      quaternion(l, :) = quaternion_of(matmul(own, transpose(axes)))
    end do
  end subroutine axes_in_sheet

  !> Quaternion of a rotation less (1, 0, 0, 0), by its largest entry (S. W. Shepperd, J. Guidance
  !! and Control 1 (1978)).
  pure function quaternion_of(r) result(quaternion)
    real(wp), intent(in) :: r(3, 3)
    real(wp) :: quaternion(4), products(4, 4)
    integer :: largest

    ! Four times the products of the entries of the quaternion.
    products = reshape([1.0_wp + r(1, 1) + r(2, 2) + r(3, 3), r(3, 2) - r(2, 3), &
                        r(1, 3) - r(3, 1), r(2, 1) - r(1, 2), &
                        r(3, 2) - r(2, 3), 1.0_wp + r(1, 1) - r(2, 2) - r(3, 3), &
                        r(1, 2) + r(2, 1), r(1, 3) + r(3, 1), &
                        r(1, 3) - r(3, 1), r(1, 2) + r(2, 1), &
                        1.0_wp - r(1, 1) + r(2, 2) - r(3, 3), r(2, 3) + r(3, 2), &
                        r(2, 1) - r(1, 2), r(1, 3) + r(3, 1), r(2, 3) + r(3, 2), &
                        1.0_wp - r(1, 1) - r(2, 2) + r(3, 3)], [4, 4])
    largest = maxloc([products(1, 1), products(2, 2), products(3, 3), products(4, 4)], 1)
    quaternion = products(:, largest)/norm2(products(:, largest))
    quaternion(1) = quaternion(1) - 1.0_wp
  end function quaternion_of

  !> Rotate the axes of a row by the spin increment, exactly as the stress was rotated
  !! (T. J. R. Hughes and J. Winget, IJNME 15 (1980)): its quaternion is (1, w/2) over its length.
  pure subroutine rotate_axes(n, spin, quaternion)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n, 3)         !! increment 12 13 23
    real(wp), intent(inout) :: quaternion(n, 4)    !! quaternion less (1, 0, 0, 0)
    real(wp), parameter :: short = 5.0e-3_wp   ! up to which the series is exact to 1e-14
    real(wp) :: a, b1, b2, b3, h1, h2, h3, q0, q1, q2, q3, r, scaling, most
    integer :: l

    most = 0.0_wp
    !$omp simd private(a, b1, b2, b3, h1, h2, h3, q0, q1, q2, q3, r, scaling) reduction(max:most)
    do l = 1, n
      h1 = -0.5_wp*spin(l, 3)
      h2 = 0.5_wp*spin(l, 2)
      h3 = -0.5_wp*spin(l, 1)
      a = 1.0_wp + quaternion(l, 1)
      b1 = quaternion(l, 2)
      b2 = quaternion(l, 3)
      b3 = quaternion(l, 4)
      q0 = a - h1*b1 - h2*b2 - h3*b3
      q1 = b1 + a*h1 + h2*b3 - h3*b2
      q2 = b2 + a*h2 + h3*b1 - h1*b3
      q3 = b3 + a*h3 + h1*b2 - h2*b1
      ! Over the length, one but for h^2/2, by a series; what is left goes in the next turns.
      r = q0*q0 + q1*q1 + q2*q2 + q3*q3 - 1.0_wp
      scaling = 1.0_wp - r*(0.5_wp - r*(0.375_wp - r*(0.3125_wp - r*(0.2734375_wp &
                                                                    - 0.24609375_wp*r))))
      most = max(most, r)
      quaternion(l, 1) = scaling*q0 - 1.0_wp
      quaternion(l, 2) = scaling*q1
      quaternion(l, 3) = scaling*q2
      quaternion(l, 4) = scaling*q3
    end do
    if (most <= short) return
    do l = 1, n
      scaling = 1.0_wp/norm2([1.0_wp + quaternion(l, 1), quaternion(l, 2:)])
      quaternion(l, 1) = scaling*(1.0_wp + quaternion(l, 1)) - 1.0_wp
      quaternion(l, 2:) = scaling*quaternion(l, 2:)
    end do
  end subroutine rotate_axes

  !> `rotate_axes` about axis 3 of the frame alone, with axis 1 of the material in the plane across
  !! it and the largest square of what axis 3 of the material has in that plane.
  pure subroutine turn_in_plane(n, axes, spin, quaternion, axis, tilt)
    integer, intent(in) :: n
    real(wp), intent(in) :: axes(3, 3)             !! at the start, as columns
    real(wp), intent(in) :: spin(n)                !! increment 12
    real(wp), intent(inout) :: quaternion(n, 4)    !! quaternion less (1, 0, 0, 0)
    real(wp), intent(out) :: axis(n, 2), tilt
    real(wp) :: a, b1, b2, b3, h, w, v1, v2, v3, scaling, r, r11, r12, r21, r22, r31, r32
    integer :: l

    tilt = 0.0_wp
    if (abs(axes(3, 3)) >= 1.0_wp) then
      !$omp simd reduction(max:tilt)
      do l = 1, n
        tilt = max(tilt, abs(quaternion(l, 2)), abs(quaternion(l, 3)))
      end do
      if (.not. tilt > 0.0_wp) then
        call turn_about_normal(n, axes(:2, 1), spin, quaternion, axis)
        return
      end if
      tilt = 0.0_wp
    end if
    !$omp simd private(a, b1, b2, b3, h, w, v1, v2, v3, scaling, r, r11, r12, r21, r22, r31, &
    !$omp r32) reduction(max:tilt)
    do l = 1, n
      h = -0.5_wp*spin(l)
      a = 1.0_wp + quaternion(l, 1)
      b1 = quaternion(l, 2); b2 = quaternion(l, 3); b3 = quaternion(l, 4)
      w = a - h*b3
      v1 = b1 - h*b2
      v2 = b2 + h*b1
      v3 = b3 + a*h
      ! Over the length, one but for h^2/2, by a series; what is left goes in the next turns.
      r = w*w + v1*v1 + v2*v2 + v3*v3 - 1.0_wp
      scaling = 1.0_wp - r*(0.5_wp - r*(0.375_wp - 0.3125_wp*r))
      ! No spin changes no bit.
      if (.not. abs(h) > 0.0_wp) scaling = 1.0_wp
      w = scaling*w; v1 = scaling*v1; v2 = scaling*v2; v3 = scaling*v3
      if (abs(h) > 0.0_wp) quaternion(l, 1) = w - 1.0_wp
      quaternion(l, 2) = v1
      quaternion(l, 3) = v2
      quaternion(l, 4) = v3
      r11 = 1.0_wp - 2.0_wp*(v2*v2 + v3*v3)
      r12 = 2.0_wp*(v1*v2 + w*v3)
      r21 = 2.0_wp*(v1*v2 - w*v3)
      r22 = 1.0_wp - 2.0_wp*(v3*v3 + v1*v1)
      r31 = 2.0_wp*(v1*v3 + w*v2)
      r32 = 2.0_wp*(v2*v3 - w*v1)
      axis(l, 1) = r11*axes(1, 1) + r21*axes(2, 1) + r31*axes(3, 1)
      axis(l, 2) = r12*axes(1, 1) + r22*axes(2, 1) + r32*axes(3, 1)
      a = r11*axes(1, 3) + r21*axes(2, 3) + r31*axes(3, 3)
      b1 = r12*axes(1, 3) + r22*axes(2, 3) + r32*axes(3, 3)
      tilt = max(tilt, a*a + b1*b1)
    end do
  end subroutine turn_in_plane

  !> `turn_in_plane` where axis 3 of the material is, and was at the start, the normal.
  pure subroutine turn_about_normal(n, start, spin, quaternion, axis)
    integer, intent(in) :: n
    real(wp), intent(in) :: start(2)               !! axis 1 of the material at the start
    real(wp), intent(in) :: spin(n)
    real(wp), intent(inout) :: quaternion(n, 4)
    real(wp), intent(out) :: axis(n, 2)
    real(wp) :: a, b, h, w, v, r, scaling
    integer :: l

    !$omp simd private(a, b, h, w, v, r, scaling)
    do l = 1, n
      h = -0.5_wp*spin(l)
      a = 1.0_wp + quaternion(l, 1)
      b = quaternion(l, 4)
      w = a - h*b
      v = b + a*h
      r = w*w + v*v - 1.0_wp
      scaling = 1.0_wp - r*(0.5_wp - r*(0.375_wp - 0.3125_wp*r))
      if (.not. abs(h) > 0.0_wp) scaling = 1.0_wp
      w = scaling*w; v = scaling*v
      if (abs(h) > 0.0_wp) quaternion(l, 1) = w - 1.0_wp
      quaternion(l, 4) = v
      a = 1.0_wp - 2.0_wp*v*v
      b = 2.0_wp*w*v
      axis(l, 1) = a*start(1) - b*start(2)
      axis(l, 2) = b*start(1) + a*start(2)
    end do
  end subroutine turn_about_normal

  !> Rotation of a row from space into the axes of the material: entry (i, j), the component j of
  !! axis i, at 3 (i - 1) + j.
  pure subroutine axes_rotation(n, n_row, axes, is_turned, quaternion, rotation)
    integer, intent(in) :: n                   !! points
    integer, intent(in) :: n_row               !! of the row that they are part of
    real(wp), intent(in) :: axes(3, 3)         !! at the start, as columns
    logical, intent(in) :: is_turned           !! those are not the axes of space
    real(wp), intent(in) :: quaternion(n_row, *)
    real(wp), intent(out) :: rotation(n, 9)
    real(wp) :: w, v1, v2, v3
    integer :: l

    !$omp simd private(w, v1, v2, v3)
    do l = 1, n
      w = 1.0_wp + quaternion(l, 1)
      v1 = quaternion(l, 2); v2 = quaternion(l, 3); v3 = quaternion(l, 4)
      rotation(l, 1) = 1.0_wp - 2.0_wp*(v2*v2 + v3*v3)
      rotation(l, 2) = 2.0_wp*(v1*v2 + w*v3)
      rotation(l, 3) = 2.0_wp*(v1*v3 - w*v2)
      rotation(l, 4) = 2.0_wp*(v1*v2 - w*v3)
      rotation(l, 5) = 1.0_wp - 2.0_wp*(v3*v3 + v1*v1)
      rotation(l, 6) = 2.0_wp*(v2*v3 + w*v1)
      rotation(l, 7) = 2.0_wp*(v1*v3 + w*v2)
      rotation(l, 8) = 2.0_wp*(v2*v3 - w*v1)
      rotation(l, 9) = 1.0_wp - 2.0_wp*(v1*v1 + v2*v2)
    end do
    if (is_turned) call begin_from_axes(n, axes, rotation)
  end subroutine axes_rotation

  !> Rotations as those of axes that were not those of space at the start.
  pure subroutine begin_from_axes(n, axes, rotation)
    integer, intent(in) :: n
    real(wp), intent(in) :: axes(3, 3)           !! at the start, as columns
    real(wp), intent(inout) :: rotation(n, 9)    !! as in `axes_rotation`
    real(wp) :: q1, q2, q3
    integer :: j, l

    do j = 1, 3
      !$omp simd private(q1, q2, q3)
      do l = 1, n
        q1 = rotation(l, j); q2 = rotation(l, j + 3); q3 = rotation(l, j + 6)
        rotation(l, j) = q1*axes(1, 1) + q2*axes(2, 1) + q3*axes(3, 1)
        rotation(l, j + 3) = q1*axes(1, 2) + q2*axes(2, 2) + q3*axes(3, 2)
        rotation(l, j + 6) = q1*axes(1, 3) + q2*axes(2, 3) + q3*axes(3, 3)
      end do
    end do
  end subroutine begin_from_axes

end module tensor_rotation
