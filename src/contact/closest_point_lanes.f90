!> Closest points of eight slave points at a time, warm-started, each on the face it was on before.
!!
!! The same Newton as in `closest_point`, [CA] eqs. (48)-(55), without its guards: lanes that leave
!! their face or do not settle are reported, and the caller searches them one by one.
module closest_point_lanes
  use kinds, only: wp
  use tool, only: tool_t
  implicit none
  private

  public :: lanes_t, follow_lanes

  integer, parameter, public :: n_lanes = 8        !! points worked on together
  integer, parameter :: max_evaluations = 4        !! of the faces before the rest is given up
  real(wp), parameter :: tangent_tolerance = 1.0e-9_wp   !! of the tool's scale, along the face
  real(wp), parameter :: edge_tolerance = 1.0e-12_wp     !! local coordinates taken for the edge

  !> Eight points, where they were on the tool and where they are now.
  type :: lanes_t
    integer :: face(n_lanes)                 !! face of each point, all positive
    real(wp) :: x(n_lanes, 3)                !! points in the tool's frame [length]
    real(wp) :: s(n_lanes), t(n_lanes)       !! local coordinates: before, then now
    real(wp) :: gap(n_lanes)                 !! signed, on the sheet's side positive [length]
    real(wp) :: normal(n_lanes, 3)           !! unit, towards the sheet's side
    logical :: is_good(n_lanes)              !! settled inside the face
    integer :: n_iterations                  !! evaluations of the faces
  end type lanes_t

  !> Homogeneous point and derivatives (w x, w y, w z, w) of eight faces.
  type :: jet_t
    real(wp), dimension(n_lanes, 4) :: h, h_s, h_t, h_ss, h_tt, h_st
  end type jet_t

  !> State of the iteration, one value a lane.
  type :: newton_t
    real(wp), dimension(n_lanes) :: step_s, step_t   !! of the local coordinates
    real(wp), dimension(n_lanes) :: tangent          !! square of the residual along the face
    real(wp), dimension(n_lanes) :: k_ss, determinant   !! of the Hessian: positive at a minimum
  end type newton_t

contains

  !> Follow eight points from where they were. `face`, `x`, `s` and `t` in, the rest out.
  pure subroutine follow_lanes(tool, lanes)
    type(tool_t), intent(in) :: tool
    type(lanes_t), intent(inout) :: lanes
    real(wp) :: c(n_lanes, 4, size(tool%coefficients, 2), size(tool%coefficients, 3))
    type(jet_t) :: jet
    type(newton_t) :: newton
    integer :: iteration, lane, n1, n2
    real(wp) :: limit

    n1 = size(tool%coefficients, 2)
    n2 = size(tool%coefficients, 3)
    do lane = 1, n_lanes
      c(lane, :, :, :) = tool%coefficients(:, :, :, lanes%face(lane))
    end do
    limit = (tangent_tolerance*tool%scale)**2
    do iteration = 1, max_evaluations
      if (n1 == 3 .and. n2 == 3) then
        call evaluate_quadratic(c, lanes%s, lanes%t, jet)
      else
        call evaluate_general(n1, n2, c, lanes%s, lanes%t, jet)
      end if
      call newton_steps(jet, real(tool%side, wp), lanes, newton)
      if (all(newton%tangent <= limit)) exit
      if (iteration == max_evaluations) exit
      lanes%s = lanes%s + newton%step_s
      lanes%t = lanes%t + newton%step_t
    end do
    lanes%n_iterations = min(iteration, max_evaluations)
    lanes%is_good = newton%tangent <= limit .and. newton%k_ss > 0.0_wp &
      .and. newton%determinant > 0.0_wp .and. abs(lanes%s - 0.5_wp) <= 0.5_wp + edge_tolerance &
      .and. abs(lanes%t - 0.5_wp) <= 0.5_wp + edge_tolerance
  end subroutine follow_lanes

  !> Faces of degree 2 x 2 in power form, with all derivatives up to the second.
  pure subroutine evaluate_quadratic(c, s, t, jet)
    real(wp), intent(in) :: c(n_lanes, 4, 3, 3)
    real(wp), intent(in) :: s(n_lanes), t(n_lanes)
    type(jet_t), intent(out) :: jet
    real(wp) :: a1, a2, a3, b1, b2, b3
    integer :: i, l

    do i = 1, 4
      !$omp simd private(a1, a2, a3, b1, b2, b3)
      do l = 1, n_lanes
        a1 = c(l, i, 1, 1) + s(l)*(c(l, i, 2, 1) + s(l)*c(l, i, 3, 1))
        a2 = c(l, i, 1, 2) + s(l)*(c(l, i, 2, 2) + s(l)*c(l, i, 3, 2))
        a3 = c(l, i, 1, 3) + s(l)*(c(l, i, 2, 3) + s(l)*c(l, i, 3, 3))
        b1 = c(l, i, 2, 1) + 2*s(l)*c(l, i, 3, 1)
        b2 = c(l, i, 2, 2) + 2*s(l)*c(l, i, 3, 2)
        b3 = c(l, i, 2, 3) + 2*s(l)*c(l, i, 3, 3)
        jet%h(l, i) = a1 + t(l)*(a2 + t(l)*a3)
        jet%h_t(l, i) = a2 + 2*t(l)*a3
        jet%h_tt(l, i) = 2*a3
        jet%h_s(l, i) = b1 + t(l)*(b2 + t(l)*b3)
        jet%h_st(l, i) = b2 + 2*t(l)*b3
        jet%h_ss(l, i) = 2*(c(l, i, 3, 1) + t(l)*(c(l, i, 3, 2) + t(l)*c(l, i, 3, 3)))
      end do
    end do
  end subroutine evaluate_quadratic

  !> Faces of any degree in power form, with all derivatives up to the second.
  pure subroutine evaluate_general(n1, n2, c, s, t, jet)
    integer, intent(in) :: n1, n2
    real(wp), intent(in) :: c(n_lanes, 4, n1, n2)
    real(wp), intent(in) :: s(n_lanes), t(n_lanes)
    type(jet_t), intent(out) :: jet
    real(wp), dimension(n_lanes) :: line, line_s, half_ss, h, h_s, h_t, h_st, half_hss, half_htt
    integer :: i, a, b

    do i = 1, 4
      h = 0.0_wp
      h_s = 0.0_wp
      h_t = 0.0_wp
      h_st = 0.0_wp
      half_hss = 0.0_wp
      half_htt = 0.0_wp
      do b = n2, 1, -1
        line = 0.0_wp
        line_s = 0.0_wp
        half_ss = 0.0_wp
        do a = n1, 1, -1
          half_ss = half_ss*s + line_s
          line_s = line_s*s + line
          line = line*s + c(:, i, a, b)
        end do
        half_htt = half_htt*t + h_t
        h_t = h_t*t + h
        h = h*t + line
        h_st = h_st*t + h_s
        h_s = h_s*t + line_s
        half_hss = half_hss*t + half_ss
      end do
      jet%h(:, i) = h
      jet%h_s(:, i) = h_s
      jet%h_t(:, i) = h_t
      jet%h_ss(:, i) = 2*half_hss
      jet%h_tt(:, i) = 2*half_htt
      jet%h_st(:, i) = h_st
    end do
  end subroutine evaluate_general

  !> Newton step of every lane, with gap and normal at the place before the step. Written out by
  !! components: the compiler keeps all of it in vector registers only so.
  pure subroutine newton_steps(jet, side, lanes, newton)
    type(jet_t), intent(in) :: jet
    real(wp), intent(in) :: side
    type(lanes_t), intent(inout) :: lanes
    type(newton_t), intent(out) :: newton
    real(wp) :: v, x1, x2, x3, s1, s2, s3, t1, t2, t3, r1, r2, r3, q1, q2, q3, f, g
    real(wp) :: a_ss, a_tt, k_ss, k_tt, k_st, determinant
    integer :: l

    !$omp simd private(v, x1, x2, x3, s1, s2, s3, t1, t2, t3, r1, r2, r3, q1, q2, q3, f, g, &
    !$omp& a_ss, a_tt, k_ss, k_tt, k_st, determinant)
    do l = 1, n_lanes
      v = 1.0_wp/jet%h(l, 4)
      x1 = jet%h(l, 1)*v
      x2 = jet%h(l, 2)*v
      x3 = jet%h(l, 3)*v
      s1 = (jet%h_s(l, 1) - x1*jet%h_s(l, 4))*v
      s2 = (jet%h_s(l, 2) - x2*jet%h_s(l, 4))*v
      s3 = (jet%h_s(l, 3) - x3*jet%h_s(l, 4))*v
      t1 = (jet%h_t(l, 1) - x1*jet%h_t(l, 4))*v
      t2 = (jet%h_t(l, 2) - x2*jet%h_t(l, 4))*v
      t3 = (jet%h_t(l, 3) - x3*jet%h_t(l, 4))*v
      r1 = lanes%x(l, 1) - x1
      r2 = lanes%x(l, 2) - x2
      r3 = lanes%x(l, 3) - x3
      f = s1*r1 + s2*r2 + s3*r3
      g = t1*r1 + t2*r2 + t3*r3
      a_ss = s1*s1 + s2*s2 + s3*s3
      a_tt = t1*t1 + t2*t2 + t3*t3
      q1 = jet%h_ss(l, 1) - 2*s1*jet%h_s(l, 4) - x1*jet%h_ss(l, 4)
      q2 = jet%h_ss(l, 2) - 2*s2*jet%h_s(l, 4) - x2*jet%h_ss(l, 4)
      q3 = jet%h_ss(l, 3) - 2*s3*jet%h_s(l, 4) - x3*jet%h_ss(l, 4)
      k_ss = a_ss - (r1*q1 + r2*q2 + r3*q3)*v
      q1 = jet%h_tt(l, 1) - 2*t1*jet%h_t(l, 4) - x1*jet%h_tt(l, 4)
      q2 = jet%h_tt(l, 2) - 2*t2*jet%h_t(l, 4) - x2*jet%h_tt(l, 4)
      q3 = jet%h_tt(l, 3) - 2*t3*jet%h_t(l, 4) - x3*jet%h_tt(l, 4)
      k_tt = a_tt - (r1*q1 + r2*q2 + r3*q3)*v
      q1 = jet%h_st(l, 1) - s1*jet%h_t(l, 4) - t1*jet%h_s(l, 4) - x1*jet%h_st(l, 4)
      q2 = jet%h_st(l, 2) - s2*jet%h_t(l, 4) - t2*jet%h_s(l, 4) - x2*jet%h_st(l, 4)
      q3 = jet%h_st(l, 3) - s3*jet%h_t(l, 4) - t3*jet%h_s(l, 4) - x3*jet%h_st(l, 4)
      k_st = s1*t1 + s2*t2 + s3*t3 - (r1*q1 + r2*q2 + r3*q3)*v
      determinant = k_ss*k_tt - k_st*k_st
      newton%step_s(l) = (k_tt*f - k_st*g)/determinant
      newton%step_t(l) = (k_ss*g - k_st*f)/determinant
      newton%tangent(l) = f*f/a_ss + g*g/a_tt
      newton%k_ss(l) = k_ss
      newton%determinant(l) = determinant
      q1 = s2*t3 - s3*t2
      q2 = s3*t1 - s1*t3
      q3 = s1*t2 - s2*t1
      v = side/sqrt(q1*q1 + q2*q2 + q3*q3)
      lanes%normal(l, 1) = q1*v
      lanes%normal(l, 2) = q2*v
      lanes%normal(l, 3) = q3*v
      lanes%gap(l) = (q1*r1 + q2*r2 + q3*r3)*v
    end do
  end subroutine newton_steps

end module closest_point_lanes
