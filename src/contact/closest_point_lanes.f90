!> Closest points of eight slave points at a time, warm-started, each on the face it was on before.
!!
!! The same Newton as in `closest_point`, [CA] eqs. (48)-(55), without its guards: lanes that leave
!! their face or do not settle are reported, and the caller searches them one by one. Point and
!! normal after the last Newton step come from the second derivatives at hand instead of one more
!! evaluation: over a step that turns the normal by the angle a the gap is off by about a^2/6 of
!! the step.
module closest_point_lanes
  use kinds, only: wp
  use tool, only: tool_t
  implicit none
  private

  public :: lanes_t, follow_lanes

  integer, parameter, public :: n_lanes = 8        !! points worked on together
  integer, parameter :: max_evaluations = 4        !! of the faces before the rest is given up
  real(wp), parameter :: last_step = 1.0e-4_wp     !! longest last step, of the tool's scale
  real(wp), parameter :: last_turn = 3.0e-4_wp     !! most that the last step turns the normal [rad]
  real(wp), parameter :: edge_tolerance = 1.0e-12_wp   !! local coordinates taken for the edge

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
    real(wp), dimension(n_lanes) :: square           !! of the step [length^2]
    real(wp), dimension(n_lanes) :: turn             !! square of the sine of the normal's turn
    real(wp), dimension(n_lanes) :: k_ss, determinant   !! of the Hessian: positive at a minimum
    real(wp), dimension(n_lanes, 3) :: normal        !! S,s x S,t after the step
    real(wp), dimension(n_lanes) :: along            !! r . normal after the step
  end type newton_t

contains

  !> Follow eight points from where they were. `face`, `x`, `s` and `t` in, the rest out.
  pure subroutine follow_lanes(tool, lanes)
    type(tool_t), intent(in) :: tool
    type(lanes_t), intent(inout) :: lanes
    real(wp) :: c(n_lanes, 4, tool%orders(1), tool%orders(2))
    type(jet_t) :: jet
    type(newton_t) :: newton
    integer :: iteration, lane, n1, n2
    real(wp) :: limit, length

    n1 = tool%orders(1)
    n2 = tool%orders(2)
    call gather_faces(n1, n2, tool%n_faces, tool%coefficients, lanes%face, c)
    limit = (last_step*tool%scale)**2
    do iteration = 1, max_evaluations
      if (n1 == 3 .and. n2 == 3) then
        call evaluate_quadratic(c, lanes%s, lanes%t, jet)
      else
        call evaluate_general(n1, n2, c, lanes%s, lanes%t, jet)
      end if
      call newton_steps(jet, lanes%x, newton)
      lanes%s = lanes%s + newton%step_s
      lanes%t = lanes%t + newton%step_t
      lanes%is_good = newton%square <= limit .and. newton%turn <= last_turn**2
      if (all(lanes%is_good)) exit
    end do
    lanes%n_iterations = min(iteration, max_evaluations)
    lanes%is_good = lanes%is_good .and. newton%k_ss > 0.0_wp .and. newton%determinant > 0.0_wp &
      .and. abs(lanes%s - 0.5_wp) <= 0.5_wp + edge_tolerance &
      .and. abs(lanes%t - 0.5_wp) <= 0.5_wp + edge_tolerance
    !$omp simd private(length)
    do lane = 1, n_lanes
      length = tool%side*sqrt(newton%normal(lane, 1)**2 + newton%normal(lane, 2)**2 &
                              + newton%normal(lane, 3)**2)
      lanes%normal(lane, 1) = newton%normal(lane, 1)/length
      lanes%normal(lane, 2) = newton%normal(lane, 2)/length
      lanes%normal(lane, 3) = newton%normal(lane, 3)/length
      lanes%gap(lane) = newton%along(lane)/length
    end do
  end subroutine follow_lanes

  !> Coefficients of the faces, lanes first. Neighbouring points are mostly on one face.
  pure subroutine gather_faces(n1, n2, n_faces, coefficients, faces, c)
    integer, intent(in) :: n1, n2, n_faces
    real(wp), intent(in) :: coefficients(4*n1*n2, n_faces)
    integer, intent(in) :: faces(n_lanes)
    real(wp), intent(out) :: c(n_lanes, 4*n1*n2)
    integer :: i, lane

    if (all(faces == faces(1))) then
      do i = 1, 4*n1*n2
        c(:, i) = coefficients(i, faces(1))
      end do
    else
      do lane = 1, n_lanes
        c(lane, :) = coefficients(:, faces(lane))
      end do
    end if
  end subroutine gather_faces

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

  !> Newton step of every lane, and the normal where it leads. Written out by components: only so
  !! does the compiler keep all of it in vector registers.
  pure subroutine newton_steps(jet, x, newton)
    type(jet_t), intent(in) :: jet
    real(wp), intent(in) :: x(n_lanes, 3)   !! points [length]
    type(newton_t), intent(out) :: newton
    real(wp) :: v, x1, x2, x3, s1, s2, s3, t1, t2, t3, r1, r2, r3, f, g, ds, dt
    real(wp) :: ss1, ss2, ss3, tt1, tt2, tt3, st1, st2, st3, p1, p2, p3, q1, q2, q3
    real(wp) :: n1, n2, n3, m1, m2, m3, k_ss, k_tt, k_st, determinant
    integer :: l

    !$omp simd private(v, x1, x2, x3, s1, s2, s3, t1, t2, t3, r1, r2, r3, f, g, ds, dt, ss1, ss2, &
    !$omp& ss3, tt1, tt2, tt3, st1, st2, st3, p1, p2, p3, q1, q2, q3, n1, n2, n3, m1, m2, m3, &
    !$omp& k_ss, k_tt, k_st, determinant)
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
      ss1 = (jet%h_ss(l, 1) - 2*s1*jet%h_s(l, 4) - x1*jet%h_ss(l, 4))*v
      ss2 = (jet%h_ss(l, 2) - 2*s2*jet%h_s(l, 4) - x2*jet%h_ss(l, 4))*v
      ss3 = (jet%h_ss(l, 3) - 2*s3*jet%h_s(l, 4) - x3*jet%h_ss(l, 4))*v
      tt1 = (jet%h_tt(l, 1) - 2*t1*jet%h_t(l, 4) - x1*jet%h_tt(l, 4))*v
      tt2 = (jet%h_tt(l, 2) - 2*t2*jet%h_t(l, 4) - x2*jet%h_tt(l, 4))*v
      tt3 = (jet%h_tt(l, 3) - 2*t3*jet%h_t(l, 4) - x3*jet%h_tt(l, 4))*v
      st1 = (jet%h_st(l, 1) - s1*jet%h_t(l, 4) - t1*jet%h_s(l, 4) - x1*jet%h_st(l, 4))*v
      st2 = (jet%h_st(l, 2) - s2*jet%h_t(l, 4) - t2*jet%h_s(l, 4) - x2*jet%h_st(l, 4))*v
      st3 = (jet%h_st(l, 3) - s3*jet%h_t(l, 4) - t3*jet%h_s(l, 4) - x3*jet%h_st(l, 4))*v
      r1 = x(l, 1) - x1
      r2 = x(l, 2) - x2
      r3 = x(l, 3) - x3
      f = s1*r1 + s2*r2 + s3*r3
      g = t1*r1 + t2*r2 + t3*r3
      k_ss = s1*s1 + s2*s2 + s3*s3 - (r1*ss1 + r2*ss2 + r3*ss3)
      k_tt = t1*t1 + t2*t2 + t3*t3 - (r1*tt1 + r2*tt2 + r3*tt3)
      k_st = s1*t1 + s2*t2 + s3*t3 - (r1*st1 + r2*st2 + r3*st3)
      determinant = k_ss*k_tt - k_st*k_st
      v = 1.0_wp/determinant
      ds = (k_tt*f - k_st*g)*v
      dt = (k_ss*g - k_st*f)*v
      p1 = s1 + ss1*ds + st1*dt
      p2 = s2 + ss2*ds + st2*dt
      p3 = s3 + ss3*ds + st3*dt
      q1 = t1 + st1*ds + tt1*dt
      q2 = t2 + st2*ds + tt2*dt
      q3 = t3 + st3*ds + tt3*dt
      x1 = 0.5_wp*((s1 + p1)*ds + (t1 + q1)*dt)
      x2 = 0.5_wp*((s2 + p2)*ds + (t2 + q2)*dt)
      x3 = 0.5_wp*((s3 + p3)*ds + (t3 + q3)*dt)
      n1 = s2*t3 - s3*t2
      n2 = s3*t1 - s1*t3
      n3 = s1*t2 - s2*t1
      m1 = p2*q3 - p3*q2
      m2 = p3*q1 - p1*q3
      m3 = p1*q2 - p2*q1
      newton%step_s(l) = ds
      newton%step_t(l) = dt
      newton%square(l) = x1*x1 + x2*x2 + x3*x3
      newton%k_ss(l) = k_ss
      newton%determinant(l) = determinant
      newton%normal(l, 1) = m1
      newton%normal(l, 2) = m2
      newton%normal(l, 3) = m3
      newton%along(l) = m1*(r1 - x1) + m2*(r2 - x2) + m3*(r3 - x3)
      newton%turn(l) = ((n2*m3 - n3*m2)**2 + (n3*m1 - n1*m3)**2 + (n1*m2 - n2*m1)**2) &
                       /((n1*n1 + n2*n2 + n3*n3)*(m1*m1 + m2*m2 + m3*m3))
    end do
  end subroutine newton_steps

end module closest_point_lanes
