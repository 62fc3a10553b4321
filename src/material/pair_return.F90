!> Return mapping in plane stress to yield functions of two squares of stresses, Q1 = x^2 and
!! Q2 = y^2 + z^2 in stresses of their own (see `plane_yield`), such as that of Barlat and Lian.
!!
!! Plastic strain along the gradient is diag(f, g, g) times the stress, with factors f and g in the
!! ratio of the derivatives F1 and F2 of F, the power m = 2k of the equivalent stress. So stresses
!! follow from the trial stress t by a matrix with two unknowns, (1 + M diag(f, g, g)) s = t. Three
!! equations remain:
!!
!!   F = flow^m,   f F2 = g F1,   f Q1 + g Q2 = flow dgamma,
!!
!! the last of which is the plastic work. Newton's method solves them for f, g and dgamma, with
!! stresses over the flow stress of no plastic strain and factors times a stiffness.
module pair_return
  use kinds, only: wp
  use flow_curve, only: flow_curve_t, flow_after
  use plane_steps, only: just_above
  use plane_yield, only: plane_yield_t
  implicit none
  private

  public :: new_pair_return, return_by_pair

  type, public :: pair_return_t
    integer :: half = 0                 !! k, 3 or 4; 0: the yield function has another form
    real(wp) :: bent(3, 3) = 0.0_wp     !! second derivatives of F by Q1, by both and by Q2:
                                        !! coefficients of falling powers of Q1
    real(wp) :: forms(2, 2) = 0.0_wp, form = 0.0_wp   !! own stresses from modes of `plane_stress`
    real(wp) :: stiffness = 0.0_wp      !! M33 [stress]
    real(wp) :: ratios(3) = 0.0_wp      !! M11, M12 and M22 over that
  end type pair_return_t

  real(wp), parameter :: least = 1.0e-100_wp   ! power, for points without stress: of a square that
                                               ! does not vanish

contains

  !> For a yield function in own stresses, whose Q3 must be a multiple of Q2.
  pure function new_pair_return(yield, forms, form, moduli) result(new)
    type(plane_yield_t), intent(in) :: yield
    real(wp), intent(in) :: forms(2, 2), form   !! see `pair_return_t`
    real(wp), intent(in) :: moduli(3)           !! of the modes [stress]
    type(pair_return_t) :: new
    real(wp), parameter :: rounding = 1.0e-14_wp
    real(wp) :: m(2, 2), part

    part = yield%shear(3)
    if (.not. yield%is_quick .or. abs(yield%normal(1, 3)) > rounding*sqrt(part) .or. &
        abs(yield%normal(2, 3)**2 - part) > rounding*part) return
    new%half = yield%half
    if (new%half == 3) then
      new%bent(:2, :) = yield%quick(4:, :)
      new%bent(2, 3) = new%bent(2, 3) + yield%quick_single(2)*part**3
    else
      new%bent = yield%quick(:3, :)
      new%bent(3, 3) = new%bent(3, 3) + yield%quick_single(1)*part**4
    end if
    new%forms = forms
    new%form = form
    new%stiffness = moduli(3)*form**2
    m = matmul(forms*spread(moduli(:2), 1, 2), transpose(forms))/new%stiffness
    new%ratios = [m(1, 1), m(1, 2), m(2, 2)]
  end function new_pair_return

  !> Plastic flow of a row. Without success strain and eqps are as before.
  pure subroutine return_by_pair(self, curve, n, dt, factor, first, trial, outset, strain, eqps, ok)
    type(pair_return_t), intent(in) :: self
    type(flow_curve_t), intent(in) :: curve    !! smooth
    integer, intent(in) :: n
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: factor(n)          !! see `flow_at`
    real(wp), intent(in) :: first(n, 3)        !! flow stress, slope and bend of no plastic strain,
                                               !! numbers, as the trial stress
    real(wp), intent(in) :: trial(n, 3)        !! own stresses
    real(wp), intent(inout) :: outset(n, 3)    !! those before the increment, out of no use
    real(wp), intent(inout) :: strain(n, 3)    !! out: plastic, as modes in the axes of the material
    real(wp), intent(inout) :: eqps(n)
    logical, intent(out) :: ok
    integer, parameter :: most_steps = 8
    real(wp), parameter :: error = 1.0e-12_wp  ! of stresses, over the flow stress
    real(wp) :: scaled(n, 5), now(n, 5), bend(n), reach(n), n_flowing, n_poor, n_open, limit
    integer :: i

    do i = 1, 2
      if (self%half == 3) then
        call start_3(self, n, trial, first, outset, scaled, now, n_flowing, n_poor)
      else
        call start_4(self, n, trial, first, outset, scaled, now, n_flowing, n_poor)
      end if
      if (.not. n_poor > 0.0_wp) exit
    end do
    ok = .not. n_flowing > 0.0_wp
    limit = error/(1.0_wp + 0.5_wp*self%half)
    do i = 1, most_steps
      if (ok) exit
      if (i > 1) then
        if (.not. are_numbers(n, now(:, 3))) return
        call flow_after(curve, n, dt, eqps, factor, first(:, 1), now(:, 3), now(:, 4), now(:, 5), &
                        bend, reach)
      end if
      if (self%half == 3) then
        call step_3(self, n, first, limit, scaled, now, n_open)
      else
        call step_4(self, n, first, limit, scaled, now, n_open)
      end if
      ! The first step takes the flow stress from its slope and bend.
      ok = i > 1 .and. .not. n_open > 0.0_wp
    end do
    if (ok) call strain_of_pair(self, n, first, scaled, now, strain, eqps)
  end subroutine return_by_pair

  !> Did no step leave the range of numbers? Others are nothing for the functions of a flow curve.
  pure logical function are_numbers(n, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: values(n)
    real(wp) :: n_others
    integer :: l

    n_others = 0.0_wp
    !$omp simd reduction(+:n_others)
    do l = 1, n
      n_others = n_others + merge(0.0_wp, 1.0_wp, abs(values(l)) <= huge(1.0_wp))
    end do
    are_numbers = .not. n_others > 0.0_wp
  end function are_numbers

  !> Plastic strain; zero, to the bit, without flow.
  pure subroutine strain_of_pair(self, n, first, scaled, now, strain, eqps)
    type(pair_return_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: first(n, 3), scaled(n, 5), now(n, 5)
    real(wp), intent(out) :: strain(n, 3)
    real(wp), intent(inout) :: eqps(n)
    real(wp) :: t(2, 2), m1, m2, m3, form, hard, f, g, a, b, e, per, x, y
    integer :: l

    t = self%forms
    m1 = self%ratios(1); m2 = self%ratios(2); m3 = self%ratios(3)
    form = self%form
    hard = 1.0_wp/self%stiffness
    !$omp simd private(f, g, a, b, e, per, x, y)
    do l = 1, n
      f = now(l, 1); g = now(l, 2)
      a = 1.0_wp + m1*f; b = 1.0_wp + m3*g
      e = a*b - m2*m2*f*g
      per = hard*first(l, 1)/(e*(1.0_wp + g))
      strain(l, 3) = form*(e*per*g*scaled(l, 3))
      per = (1.0_wp + g)*per
      x = (b*scaled(l, 1) - m2*g*scaled(l, 2))*per*f
      y = (a*scaled(l, 2) - m2*f*scaled(l, 1))*per*g
      strain(l, 1) = t(1, 1)*x + t(2, 1)*y
      strain(l, 2) = t(1, 2)*x + t(2, 2)*y
      eqps(l) = eqps(l) + now(l, 3)
    end do
  end subroutine strain_of_pair

#define HALF 3
#define START start_3
#define STEP step_3
#include "pair_return.inc"
#undef HALF
#undef START
#undef STEP
#undef BENT
#undef POWER
#define HALF 4
#define START start_4
#define STEP step_4
#include "pair_return.inc"

end module pair_return
