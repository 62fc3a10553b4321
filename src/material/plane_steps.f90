!> Steps towards the plastic strain of a row of points in plane stress, see `plane_return`.
!!
!! The equation is 1/sqrt(P) = 1, P = sum (mode/X)^2, X = flow + modulus dgamma. Its left side rises
!! and is concave. Halley's method, with sqrt(P) as (1 + 3P)/(3 + P), whose error is a cube as well:
!! one division a step and no root. The cube of a step bounds what it leaves.
module plane_steps
  use kinds, only: wp
  implicit none
  private

  public :: first_step, next_step, strain_of_modes

  real(wp), parameter, public :: just_above = 5.0e-12_wp   !! over flow stress, so left alone
  !> The cube of a last step is a part of the stress, or of a change of the slope.
  real(wp), parameter, public :: small_step = 1.6e-4_wp
  real(wp), parameter :: small_bend = 1.0e-4_wp

contains

  !> Step from no plastic strain, where all X are the flow stress.
  pure subroutine first_step(n, moduli, modes, flow, slope, bend, dgamma, most)
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(3)       !! [stress]
    real(wp), intent(in) :: modes(n, 3)     !! of the trial stress
    real(wp), intent(in), dimension(n) :: flow, slope, bend   !! see `harden`
    real(wp), intent(out) :: dgamma(n)      !! zero where the trial is the solution
    real(wp), intent(out) :: most           !! largest of them
    real(wp) :: u1, u2, u3, a1, a2, a3, t, q, v, w, p, over
    integer :: l

    most = 0.0_wp
    !$omp simd private(u1, u2, u3, a1, a2, a3, t, q, v, w, p, over) reduction(max:most)
    do l = 1, n
      u1 = modes(l, 1)**2
      u2 = modes(l, 2)**2
      u3 = modes(l, 3)**2
      a1 = slope(l) + moduli(1)
      a2 = slope(l) + moduli(2)
      a3 = slope(l) + moduli(3)
      t = u1 + u2 + u3
      q = flow(l)**2
      over = t - q
      u1 = u1*a1
      u2 = u2*a2
      u3 = u3*a3
      v = u1 + u2 + u3
      w = u1*a1 + u2*a2 + u3*a3
      p = (1.5_wp*q + 0.5_wp*t)*v*v
      w = p - over*(1.5_wp*(w*t - v*v) + 0.5_wp*bend(l)*flow(l)*t*t)
      dgamma(l) = 0.0_wp
      if (over > 2.0_wp*just_above*q) dgamma(l) = over*flow(l)*t*v/max(w, 0.5_wp*p)
      most = max(most, dgamma(l))
    end do
  end subroutine first_step

  !> Step from a plastic strain, of the points that have one. The last one leaves no more than 1e-12
  !! of the stress.
  pure subroutine next_step(n, moduli, modes, slope, bend, flow, dgamma, most, left)
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(3), modes(n, 3)
    real(wp), intent(in), dimension(n) :: slope, bend
    real(wp), intent(inout) :: flow(n)      !! at the plastic strain, out after the step
    real(wp), intent(inout) :: dgamma(n)
    real(wp), intent(out) :: most           !! largest plastic strain
    real(wp), intent(out) :: left           !! not above zero: this is the last step
    real(wp) :: x1, x2, x3, per, p1, p2, p3, p, q, r, back, v, w, over, step, largest
    integer :: l

    largest = maxval(moduli)
    most = 0.0_wp
    left = 0.0_wp
    !$omp simd private(x1, x2, x3, per, p1, p2, p3, p, q, r, back, v, w, over, step) &
    !$omp reduction(max:most, left)
    do l = 1, n
      x1 = flow(l) + moduli(1)*dgamma(l)
      x2 = flow(l) + moduli(2)*dgamma(l)
      x3 = flow(l) + moduli(3)*dgamma(l)
      ! One over each by one division.
      p3 = x1*x2
      per = 1.0_wp/(p3*x3)
      p1 = x2*x3*per
      p2 = x1*x3*per
      p3 = p3*per
      x1 = (modes(l, 1)*p1)**2
      x2 = (modes(l, 2)*p2)**2
      x3 = (modes(l, 3)*p3)**2
      p = x1 + x2 + x3
      x1 = x1*p1
      x2 = x2*p2
      x3 = x3*p3
      r = x1 + x2 + x3
      q = x1*p1 + x2*p2 + x3*p3
      ! X' is (X - back)/dgamma with the flow stress that the slope leads back to at no strain.
      back = flow(l) - slope(l)*dgamma(l)
      over = p - 1.0_wp
      v = p - back*r
      w = 1.5_wp*back*back*(q*p - r*r) + 0.5_wp*bend(l)*dgamma(l)*dgamma(l)*r*p
      q = (1.5_wp + 0.5_wp*p)*v*v
      step = dgamma(l)*(over*p*v)/max(q - over*w, 0.5_wp*q, tiny(q))
      step = max(step, -0.5_wp*dgamma(l))
      dgamma(l) = dgamma(l) + step
      most = max(most, dgamma(l))
      flow(l) = flow(l) + step*(slope(l) - 0.5_wp*bend(l)*step)
      step = abs(step)
      left = max(left, largest*step - small_step*flow(l), &
                 bend(l)*step - small_bend*slope(l))
    end do
  end subroutine next_step

  !> Plastic strain, of the trial stress. It is zero, to the bit, without `dgamma`.
  pure subroutine strain_of_modes(n, moduli, flow, dgamma, modes)
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(3), flow(n), dgamma(n)
    real(wp), intent(inout) :: modes(n, 3)
    real(wp) :: x1, x2, x3, per
    integer :: l

    !$omp simd private(x1, x2, x3, per)
    do l = 1, n
      x1 = flow(l) + moduli(1)*dgamma(l)
      x2 = flow(l) + moduli(2)*dgamma(l)
      x3 = flow(l) + moduli(3)*dgamma(l)
      per = dgamma(l)/(x1*x2*x3)
      modes(l, 1) = x2*x3*per*modes(l, 1)
      modes(l, 2) = x1*x3*per*modes(l, 2)
      modes(l, 3) = x1*x2*per*modes(l, 3)
    end do
  end subroutine strain_of_modes

end module plane_steps
