!> Von Mises plasticity with Voce isotropic hardening, a row of points at a time.
!!
!! Flow stress: E. Voce, J. Inst. Metals 74 (1948).  Return: J. C. Simo and T. J. R. Hughes,
!! Computational Inelasticity, Springer 1998, box 3.2, with the scalar equation solved by Newton.
module voce
  use kinds, only: wp
  use block_law, only: block_law_t, set_elastic
  use row_functions, only: exp_row, exp_small, small_exponent
  implicit none
  private

  public :: new_voce, elastic_trial

  !> Hardening sigma_0 + Q (1 - exp(-b eqps)); the only state is the equivalent plastic strain.
  type, extends(block_law_t), public :: voce_t
    real(wp) :: yield = 0.0_wp        !! initial yield stress sigma_0 [stress]
    real(wp) :: saturation = 0.0_wp   !! hardening left to give Q >= 0 [stress]
    real(wp) :: rate = 0.0_wp         !! saturation rate b >= 0
  contains
    procedure :: update
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
    real(wp), parameter :: tolerance = 1.0e-16_wp, tiny_stress = 1.0e-30_wp
    real(wp) :: dgamma(n), left(n), faded(n), now, step, worst, most, curvature
    real(wp) :: scaling, mean
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
      faded = -rate*dgamma
      if (rate*most <= small_exponent) then
        call exp_small(n, faded)
      else
        call exp_row(n, faded)
      end if
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
    !$omp simd private(scaling, mean)
    do l = 1, n
      scaling = 1.0_wp - shear3*dgamma(l)/max(mises(l), tiny_stress)
      eqps(l) = eqps(l) + dgamma(l)
      mean = (1.0_wp - scaling)*(stress(l, 1) + stress(l, 2) + stress(l, 3))/3.0_wp
      stress(l, 1) = scaling*stress(l, 1) + mean
      stress(l, 2) = scaling*stress(l, 2) + mean
      stress(l, 3) = scaling*stress(l, 3) + mean
      stress(l, 4) = scaling*stress(l, 4)
      stress(l, 5) = scaling*stress(l, 5)
      stress(l, 6) = scaling*stress(l, 6)
    end do
  end subroutine radial_return

end module voce
