!> Von Mises plasticity with Voce isotropic hardening, a row of points at a time.
!!
!! Flow stress: E. Voce, J. Inst. Metals 74 (1948).  Return: J. C. Simo and T. J. R. Hughes,
!! Computational Inelasticity, Springer 1998, box 3.2, with the scalar equation solved by Newton.
!! In plane stress: J. C. Simo and R. L. Taylor, IJNME 22 (1986), see `plane_stress`.
module voce
  use kinds, only: wp
  use block_law, only: block_law_t, set_elastic
  use plane_stress, only: plane_trial, areal_modulus, mode_moduli
  use plane_steps, only: just_above, small_step
  use row_functions, only: exp_row, exp_multiple, are_numbers
  implicit none
  private

  public :: new_voce, elastic_trial, flow_radially

  !> Hardening sigma_0 + Q (1 - exp(-b eqps)); the only state is the equivalent plastic strain.
  type, extends(block_law_t), public :: voce_t
    real(wp) :: yield = 0.0_wp        !! initial yield stress sigma_0 [stress]
    real(wp) :: saturation = 0.0_wp   !! hardening left to give Q >= 0 [stress]
    real(wp) :: rate = 0.0_wp         !! saturation rate b >= 0
  contains
    procedure :: update
    procedure :: update_plane
  end type voce_t

contains

  !> Law from density, elastic constants and the three hardening constants.
  pure function new_voce(density, young, poisson, yield, saturation, rate) result(law)
    real(wp), intent(in) :: density, young, poisson, yield, saturation, rate
    type(voce_t) :: law

    law%n_state = 1
    law%eqps_state = 1
    call set_elastic(law, density, young, poisson)
    law%yield = yield
    law%saturation = saturation
    law%rate = rate
  end function new_voce

  !> Elastic trial and radial return. Rows that stay below the initial yield stress end there.
  pure subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp) :: mises(n), worst

    call elastic_trial(n, self%bulk, self%shear, dstrain, stress, mises, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (ok .and. (worst > self%yield .or. self%is_awake)) then
      call radial_return(n, 3.0_wp*self%shear, self%yield + self%saturation, self%saturation, &
                         self%rate, mises, stress, state, ok)
    end if
  end subroutine update

  !> Trial stress, its von Mises stress and the largest of the row (huge where not a number).
  pure subroutine elastic_trial(n, bulk, shear, dstrain, stress, mises, worst)
    integer, intent(in) :: n
    real(wp), intent(in) :: bulk, shear, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6)
    real(wp), intent(out) :: mises(n), worst
    real(wp) :: lame, volume, s1, s2, s3, s4, s5, s6, largest, total
    integer :: l

    lame = bulk - 2.0_wp/3.0_wp*shear
    largest = 0.0_wp
    total = 0.0_wp
    !$omp simd private(volume, s1, s2, s3, s4, s5, s6) reduction(max:largest) reduction(+:total)
    do l = 1, n
      volume = lame*(dstrain(l, 1) + dstrain(l, 2) + dstrain(l, 3))
      s1 = stress(l, 1) + volume + 2.0_wp*shear*dstrain(l, 1)
      s2 = stress(l, 2) + volume + 2.0_wp*shear*dstrain(l, 2)
      s3 = stress(l, 3) + volume + 2.0_wp*shear*dstrain(l, 3)
      s4 = stress(l, 4) + shear*dstrain(l, 4)
      s5 = stress(l, 5) + shear*dstrain(l, 5)
      s6 = stress(l, 6) + shear*dstrain(l, 6)
      stress(l, 1) = s1
      stress(l, 2) = s2
      stress(l, 3) = s3
      stress(l, 4) = s4
      stress(l, 5) = s5
      stress(l, 6) = s6
      mises(l) = sqrt(0.5_wp*((s1 - s2)**2 + (s2 - s3)**2 + (s3 - s1)**2) &
                      + 3.0_wp*(s4*s4 + s5*s5 + s6*s6))
      largest = max(largest, mises(l))
      total = total + mises(l)
    end do
    ! max() may drop a NaN, a sum cannot.
    worst = largest
    if (.not. total <= huge(total)) worst = huge(worst)
  end subroutine elastic_trial

  !> Newton on mises - 3G dgamma = flow(eqps + dgamma), all points of the row together.
  !! Hardening is concave, so the iterates climb from zero to the root without overshoot, and
  !! the square of a step bounds what is left: half the curvature over the slope times it.
  pure subroutine radial_return(n, shear3, limit, saturation, rate, mises, stress, eqps, ok)
    integer, intent(in) :: n
    real(wp), intent(in) :: shear3, limit, saturation, rate, mises(n)
    real(wp), intent(inout) :: stress(n, 6), eqps(n)
    logical, intent(out) :: ok
    integer, parameter :: max_iterations = 50
    real(wp), parameter :: tolerance = 1.0e-16_wp
    real(wp) :: dgamma(n), left(n), faded(n), now, step, worst, most, curvature
    integer :: l, iteration

    left = -rate*eqps
    call exp_row(n, left)
    !$omp simd
    do l = 1, n
      left(l) = saturation*left(l)
      dgamma(l) = max(mises(l) - (limit - left(l)), 0.0_wp)/(shear3 + rate*left(l))
    end do
    curvature = 0.5_wp*rate*rate*saturation/shear3
    worst = 0.0_wp
    !$omp simd reduction(max:worst)
    do l = 1, n
      worst = max(worst, dgamma(l))
    end do
    if (worst <= 0.0_wp) then
      ok = .true.
      return
    end if
    ok = curvature*worst*worst <= tolerance
    most = worst
    do iteration = 2, max_iterations
      if (ok) exit
      call exp_multiple(n, -rate, most, dgamma, faded)
      worst = 0.0_wp
      !$omp simd private(now, step) reduction(max:worst)
      do l = 1, n
        now = left(l)*faded(l)
        step = (mises(l) - shear3*dgamma(l) - (limit - now))/(shear3 + rate*now)
        ! A point inside the yield surface has dgamma = 0 and must stay there.
        step = max(step, 0.0_wp)
        dgamma(l) = dgamma(l) + step
        worst = max(worst, step)
      end do
      most = most + worst
      ok = curvature*worst*worst <= tolerance
    end do
    call flow_radially(n, shear3, mises, dgamma, stress, eqps)
  end subroutine radial_return

  !> Plastic strains `dgamma` along the deviators of the trial stress.
  pure subroutine flow_radially(n, shear3, mises, dgamma, stress, eqps)
    integer, intent(in) :: n
    real(wp), intent(in) :: shear3, mises(n), dgamma(n)   !! 3G; of the trial stress
    real(wp), intent(inout) :: stress(n, 6), eqps(n)
    real(wp) :: scaling, mean
    integer :: l

    !$omp simd private(scaling, mean)
    do l = 1, n
      scaling = 1.0_wp - shear3*dgamma(l)/max(mises(l), tiny(mises))
      mean = (1.0_wp - scaling)*(stress(l, 1) + stress(l, 2) + stress(l, 3))/3.0_wp
      stress(l, 1) = scaling*stress(l, 1) + mean
      stress(l, 2) = scaling*stress(l, 2) + mean
      stress(l, 3) = scaling*stress(l, 3) + mean
      stress(l, 4) = scaling*stress(l, 4)
      stress(l, 5) = scaling*stress(l, 5)
      stress(l, 6) = scaling*stress(l, 6)
      eqps(l) = eqps(l) + dgamma(l)
    end do
  end subroutine flow_radially

  !> Elastic trial and return in plane stress.
  subroutine update_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    real(wp) :: modes(n, 3), flow(n), dgamma(n), worst

    call plane_trial(n, self%bulk, self%shear, dstrain, stress, through, modes, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok .or. .not. (worst > self%yield**2 .or. self%is_awake)) return
    call find_plane_flow(self, n, state, modes, flow, dgamma, worst, ok)
    if (worst > 0.0_wp) call finish_plane_flow(self, n, modes, flow, dgamma, stress, state, through)
  end subroutine update_plane

  !> `strain_of_modes` and `flow_in_plane` in one loop. What does not flow keeps its bits.
  pure subroutine finish_plane_flow(self, n, modes, flow, dgamma, stress, eqps, through)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: modes(n, 3), flow(n), dgamma(n)
    real(wp), intent(inout) :: stress(n, 3), eqps(n), through(n)
    real(wp), parameter :: root3 = sqrt(3.0_wp)
    real(wp) :: areal, shear3, thinning, twist, x1, x2, per, mean, half
    integer :: l

    areal = areal_modulus(self%bulk, self%shear)
    shear3 = 3.0_wp*self%shear
    twist = root3*self%shear
    thinning = 1.0_wp/(1.5_wp*self%bulk)
    !$omp simd private(x1, x2, per, mean, half)
    do l = 1, n
      x1 = flow(l) + areal*dgamma(l)
      x2 = flow(l) + shear3*dgamma(l)
      per = dgamma(l)/(x1*x2)
      mean = areal*x2*per*modes(l, 1)
      per = twist*x1*per
      half = per*modes(l, 2)
      stress(l, 1) = stress(l, 1) - (mean + half)
      stress(l, 2) = stress(l, 2) - (mean - half)
      stress(l, 3) = stress(l, 3) - per*modes(l, 3)
      through(l) = through(l) - thinning*mean
      eqps(l) = eqps(l) + dgamma(l)
    end do
  end subroutine finish_plane_flow

  !> Plastic strain of a row in plane stress, by the steps of `plane_steps` with hardening and the
  !! two moduli of von Mises in the same loops.
  pure subroutine find_plane_flow(self, n, eqps, modes, flow, dgamma, most, ok)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n)
    real(wp), intent(in) :: modes(n, 3)        !! of the trial
    real(wp), intent(out) :: flow(n)           !! stress after it, where there is any
    real(wp), intent(out) :: dgamma(n)
    real(wp), intent(out) :: most              !! largest of them
    logical, intent(out) :: ok
    integer, parameter :: max_iterations = 60
    real(wp), dimension(n) :: left, faded
    real(wp) :: moduli(3), open
    integer :: iteration

    moduli = mode_moduli(self%bulk, self%shear)
    left = -self%rate*eqps
    call exp_row(n, left)
    call first_plane_step(self, n, moduli(:2), modes, left, dgamma, most)
    ok = .not. most > 0.0_wp
    do iteration = 2, max_iterations
      if (ok) exit
      call exp_multiple(n, -self%rate, most, dgamma, faded)
      call next_plane_step(self, n, moduli(:2), modes, left, faded, flow, dgamma, most, open)
      ok = open <= 0.0_wp
    end do
    ok = ok .and. are_numbers(n, dgamma)
  end subroutine find_plane_flow

  !> `first_step` with the flow stress.
  pure subroutine first_plane_step(self, n, moduli, modes, left, dgamma, most)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(2), modes(n, 3)
    real(wp), intent(inout) :: left(n)         !! of the hardening, as a fraction; out as stress
    real(wp), intent(out) :: dgamma(n), most
    real(wp) :: limit, rate, saturation, u, w, y, slope, t, q, v, p, bend, over
    integer :: l

    limit = self%yield + self%saturation
    rate = self%rate
    saturation = self%saturation
    most = 0.0_wp
    !$omp simd private(u, w, y, slope, t, q, v, p, bend, over) reduction(max:most)
    do l = 1, n
      u = modes(l, 1)**2
      w = modes(l, 2)**2 + modes(l, 3)**2
      left(l) = saturation*left(l)
      y = limit - left(l)
      slope = rate*left(l)
      t = u + w
      q = y*y
      over = t - q
      v = u*(slope + moduli(1)) + w*(slope + moduli(2))
      p = (1.5_wp*q + 0.5_wp*t)*v*v
      bend = 1.5_wp*(moduli(2) - moduli(1))**2*u*w + 0.5_wp*rate*slope*t*t*y
      dgamma(l) = 0.0_wp
      if (over > 2.0_wp*just_above*q) dgamma(l) = over*t*y*v/max(p - over*bend, 0.5_wp*p)
      most = max(most, dgamma(l))
    end do
  end subroutine first_plane_step

  !> `next_step` with the flow stress.
  pure subroutine next_plane_step(self, n, moduli, modes, left, faded, flow, dgamma, most, open)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(2), modes(n, 3)
    real(wp), intent(in) :: left(n), faded(n)  !! of the hardening before, fraction left after
    real(wp), intent(out) :: flow(n)           !! after the step
    real(wp), intent(inout) :: dgamma(n)
    real(wp), intent(out) :: most              !! largest plastic strain
    real(wp), intent(out) :: open              !! not above zero: this is the last step
    real(wp) :: limit, rate, y, slope, bend, x1, x2, x, p1, p2, t, over, g1, g2, v, p, step
    integer :: l

    ! Left in the law the loop would load them point by point.
    limit = self%yield + self%saturation
    rate = self%rate
    most = 0.0_wp
    open = 0.0_wp
    !$omp simd private(y, slope, bend, x1, x2, x, p1, p2, t, over, g1, g2, v, p, step) &
    !$omp reduction(max:most, open)
    do l = 1, n
      slope = left(l)*faded(l)
      y = limit - slope
      slope = rate*slope
      bend = rate*slope
      x1 = y + moduli(1)*dgamma(l)
      x2 = y + moduli(2)*dgamma(l)
      x = x1*x2
      p1 = (modes(l, 1)*x2)**2
      p2 = (modes(l, 2)**2 + modes(l, 3)**2)*(x1*x1)
      t = p1 + p2
      over = t - x*x
      g1 = x2*(slope + moduli(1))
      g2 = x1*(slope + moduli(2))
      v = p1*g1 + p2*g2
      p = (1.5_wp*x*x + 0.5_wp*t)*v*v
      step = p - over*(1.5_wp*p1*p2*(g1 - g2)**2 + 0.5_wp*bend*t*x*(p1*x2 + p2*x1))
      step = over*t*x*v/max(step, 0.5_wp*p)
      step = max(step, -0.5_wp*dgamma(l))
      if (.not. dgamma(l) > 0.0_wp) step = 0.0_wp
      dgamma(l) = dgamma(l) + step
      flow(l) = y + step*(slope - 0.5_wp*bend*step)
      most = max(most, dgamma(l))
      open = max(open, moduli(2)*abs(step) - small_step*y)
    end do
  end subroutine next_plane_step

end module voce
