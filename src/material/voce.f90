!> Von Mises plasticity with Voce isotropic hardening, a row of points at a time.
!!
!! Flow stress: E. Voce, J. Inst. Metals 74 (1948).  Return: J. C. Simo and T. J. R. Hughes,
!! Computational Inelasticity, Springer 1998, box 3.2, with the scalar equation solved by Newton.
!! In plane stress: J. C. Simo and R. L. Taylor, IJNME 22 (1986), see `plane_stress`.
module voce
  use kinds, only: wp
  use block_law, only: block_law_t, set_elastic
  use plane_stress, only: areal_modulus, mode_moduli
  use plane_steps, only: just_above, small_step
  use row_functions, only: exp_row, exp_multiple, short_exponent
  implicit none
  private

  public :: new_voce, elastic_trial, flow_radially

  !> Hardening sigma_0 + Q (1 - exp(-b eqps)); the only state is the equivalent plastic strain.
  type, extends(block_law_t), public :: voce_t
    real(wp) :: yield = 0.0_wp        !! initial yield stress sigma_0 [stress]
    real(wp) :: saturation = 0.0_wp   !! hardening left to give Q >= 0 [stress]
    real(wp) :: rate = 0.0_wp         !! saturation rate b >= 0
    real(wp) :: last_step = 0.0_wp    !! see `last_step_of`
  contains
    procedure :: update
    procedure :: return_plane
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
    law%takes_trial = .true.
    law%last_step = last_step_of(law)
  end function new_voce

  !> Step of the return in plane stress, as 3G times it over the flow stress, that leaves no more
  !! than 1e-12 of the stress: of its cube as in `plane_steps`, and of its square half the curvature
  !! of the hardening.
  pure real(wp) function last_step_of(law) result(step)
    type(voce_t), intent(in) :: law
    real(wp), parameter :: error = 1.0e-12_wp
    real(wp) :: square, curvature

    square = error*(3.0_wp*law%shear)**2
    curvature = 0.5_wp*law%rate**2*law%saturation*(law%yield + law%saturation)
    step = small_step
    if (square < curvature*step**2) step = sqrt(square/curvature)
  end function last_step_of

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

    call exp_row(n, -rate, eqps, left)
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

  !> Return in plane stress.
  subroutine return_plane(self, n, dt, stress, state, through, worst, ok)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, worst
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp) :: flow(n), dgamma(n), most

    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok .or. .not. (worst > self%yield**2 .or. self%is_awake)) return
    call find_plane_flow(self, n, state, stress, flow, dgamma, most, ok)
    if (most > 0.0_wp) call finish_plane_flow(self, n, flow, dgamma, stress, state, through, ok)
  end subroutine return_plane

  !> Let a row flow. What does not keeps its bits.
  pure subroutine finish_plane_flow(self, n, flow, dgamma, stress, eqps, through, ok)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: flow(n), dgamma(n)
    real(wp), intent(inout) :: stress(n, 3), eqps(n), through(n)
    logical, intent(inout) :: ok               !! and all plastic strains are numbers
    real(wp) :: areal, shear3, thinning, x1, x2, per, mean, half, total
    integer :: l

    areal = areal_modulus(self%bulk, self%shear)
    shear3 = 3.0_wp*self%shear
    thinning = 1.0_wp/(1.5_wp*self%bulk)
    total = 0.0_wp
    !$omp simd private(x1, x2, per, mean, half) reduction(+:total)
    do l = 1, n
      x1 = flow(l) + areal*dgamma(l)
      x2 = flow(l) + shear3*dgamma(l)
      per = dgamma(l)/(x1*x2)
      mean = (0.5_wp*areal)*x2*per*(stress(l, 1) + stress(l, 2))
      per = shear3*x1*per
      half = 0.5_wp*per*(stress(l, 1) - stress(l, 2))
      stress(l, 1) = stress(l, 1) - (mean + half)
      stress(l, 2) = stress(l, 2) - (mean - half)
      stress(l, 3) = stress(l, 3) - per*stress(l, 3)
      through(l) = through(l) - thinning*mean
      eqps(l) = eqps(l) + dgamma(l)
      total = total + dgamma(l)
    end do
    ok = ok .and. total <= huge(total)
  end subroutine finish_plane_flow

  !> Plastic strain of a row in plane stress, by the steps of `plane_steps` with hardening and the
  !! two moduli of von Mises in the same loops.
  pure subroutine find_plane_flow(self, n, eqps, stress, flow, dgamma, most, ok)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n)
    real(wp), intent(in) :: stress(n, 3)       !! of the trial
    real(wp), intent(out) :: flow(n)           !! stress after it, where there is any
    real(wp), intent(out) :: dgamma(n)
    real(wp), intent(out) :: most              !! largest of them
    logical, intent(out) :: ok
    integer, parameter :: max_iterations = 60
    real(wp), dimension(n) :: left
    real(wp) :: moduli(3), open
    integer :: iteration

    moduli = mode_moduli(self%bulk, self%shear)
    call exp_row(n, -self%rate, eqps, left)
    call first_plane_step(self, n, moduli(:2), stress, left, dgamma, most)
    ok = .not. most > 0.0_wp
    do iteration = 2, max_iterations
      if (ok) exit
      if (iteration > 2 .or. self%rate*most > short_exponent) &
        call exp_row(n, -self%rate, eqps + dgamma, left)
      call next_plane_step(self, n, moduli(:2), stress, left, flow, dgamma, open)
      ok = open <= 0.0_wp
    end do
  end subroutine find_plane_flow

  !> `first_step` with the flow stress, but for the curvature of the hardening, and the fraction of
  !! the hardening that it leaves, if it is short. All stresses and moduli are doubled.
  pure subroutine first_plane_step(self, n, moduli, stress, left, dgamma, most)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(2), stress(n, 3)
    real(wp), intent(inout) :: left(n)         !! fraction of the hardening, out after it
    real(wp), intent(out) :: dgamma(n), most
    real(wp) :: limit, rate, saturation, gap, u, w, y, slope, t, q, v, p, over
    integer :: l

    limit = 2.0_wp*(self%yield + self%saturation)
    rate = self%rate
    saturation = 2.0_wp*self%saturation
    gap = 6.0_wp*(moduli(2) - moduli(1))**2
    most = 0.0_wp
    !$omp simd private(u, w, y, slope, t, q, v, p, over) reduction(max:most)
    do l = 1, n
      u = (stress(l, 1) + stress(l, 2))**2
      w = 3.0_wp*((stress(l, 1) - stress(l, 2))**2 + 4.0_wp*stress(l, 3)**2)
      y = limit - saturation*left(l)
      slope = rate*saturation*left(l)
      t = u + w
      q = y*y
      over = t - q
      v = t*slope + (2.0_wp*moduli(1))*u + (2.0_wp*moduli(2))*w
      p = (1.5_wp*q + 0.5_wp*t)*v*v
      dgamma(l) = 0.0_wp
      if (over > 2.0_wp*just_above*q) &
        dgamma(l) = over*t*y*v/max(p - over*(gap*u*w), 0.5_wp*p)
      most = max(most, dgamma(l))
      y = -rate*dgamma(l)
      left(l) = left(l)*(1.0_wp + y*(1.0_wp + y*(0.5_wp + y*(1.0_wp/6 + y*(1.0_wp/24)))))
    end do
  end subroutine first_plane_step

  !> `next_step` with the flow stress, alike. It leaves the square of the step of the curvature of
  !! the hardening, see `last_step_of`.
  pure subroutine next_plane_step(self, n, moduli, stress, left, flow, dgamma, open)
    class(voce_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(2), stress(n, 3)
    real(wp), intent(in) :: left(n)            !! fraction of the hardening after `dgamma`
    real(wp), intent(out) :: flow(n)           !! after the step
    real(wp), intent(inout) :: dgamma(n)
    real(wp), intent(out) :: open              !! not above zero: this is the last step
    real(wp) :: limit, rate, saturation, last_step, u, w, y, slope, x1, x2, x, p1, p2, t, over, &
                g1, g2, v, p, step
    integer :: l

    ! Left in the law the loop would load them point by point.
    limit = 2.0_wp*(self%yield + self%saturation)
    rate = self%rate
    saturation = 2.0_wp*self%saturation
    last_step = self%last_step
    open = 0.0_wp
    !$omp simd private(u, w, y, slope, x1, x2, x, p1, p2, t, over, g1, g2, v, p, step) &
    !$omp reduction(max:open)
    do l = 1, n
      u = (stress(l, 1) + stress(l, 2))**2
      w = 3.0_wp*((stress(l, 1) - stress(l, 2))**2 + 4.0_wp*stress(l, 3)**2)
      y = limit - saturation*left(l)
      slope = rate*saturation*left(l)
      x1 = y + (2.0_wp*moduli(1))*dgamma(l)
      x2 = y + (2.0_wp*moduli(2))*dgamma(l)
      x = x1*x2
      p1 = u*x2*x2
      p2 = w*x1*x1
      t = p1 + p2
      over = t - x*x
      g1 = x2*(slope + 2.0_wp*moduli(1))
      g2 = x1*(slope + 2.0_wp*moduli(2))
      v = p1*g1 + p2*g2
      p = (1.5_wp*x*x + 0.5_wp*t)*v*v
      step = over*t*x*v/max(p - over*(1.5_wp*p1*p2*(g1 - g2)**2), 0.5_wp*p)
      step = max(step, -0.5_wp*dgamma(l))
      if (.not. dgamma(l) > 0.0_wp) step = 0.0_wp
      dgamma(l) = dgamma(l) + step
      flow(l) = 0.5_wp*(y + step*slope)
      open = max(open, (2.0_wp*moduli(2))*abs(step) - last_step*y)
    end do
  end subroutine next_plane_step

end module voce
