!> Two-surface plasticity of F. Yoshida and T. Uemori, Int. J. Plasticity 18 (2002) 661-686, with
!! the yield function of von Mises, a row of points at a time.
!!
!! |a| = sqrt(3/2 a:a) is the von Mises norm of a deviator, a.b = 3/2 a:b the product that belongs
!! to it. The plastic strain grows by 3/2 n dp with n = (s - alpha)/|s - alpha| and the equivalent
!! plastic strain p, so that all constants are those of a tension curve. Numbers of the paper:
!!
!!     yield surface     |s - alpha| = Y                                               (4)
!!     back stress       alpha = theta + beta                                          (6)
!!                       dtheta = C (a n - sqrt(a/|theta|) theta) dp, a = B + R - Y    (14)
!!     bounding surface  of size B + R about beta, dbeta = m (b n - beta) dp           (5), (20)
!!                       dR = m (R_sat - R) dp while beta moves out of g               (19), (23)
!!     g                 |beta - q| <= r, and while beta moves out, with               (22)
!!                       dg = (beta - q).dbeta/r, dr = h dg, dq = (1 - h) dg (beta - q)/r  (24)-(27)
!!
!! Young's modulus falls from E to E_a by E - (E - E_a)(1 - exp(-xi p)), at a fixed Poisson's ratio:
!! F. Yoshida, T. Uemori and K. Fujiwara, Int. J. Plasticity 18 (2002) 633-659. An increment takes
!! the modulus of its start.
!!
!! Backward Euler with R of the start of the increment leaves one equation for dp: n has the
!! direction of the trial stress less u' theta + v' beta, where u' and v' are what the increment
!! leaves of both. v' = 1/(1 + m dp), and u' = s/(s + k) with k = C sqrt(a) dp, s = sqrt(|theta|) at
!! the end: s^2 + k s = |theta + C a dp n| of theta at the start, a quadratic equation. It keeps
!! |theta| <= a whatever the increment. n.theta in it is that of the iterate before.
!! While dp goes on, beta moves along a straight line, and R grows by the part of it outside of g,
!! so that the stress is continuous in the strain. All this is first order in the increment.
module yoshida_uemori
  use kinds, only: wp
  use failure, only: error_t, fail
  use law_spec, only: law_spec_t
  use constant_check, only: check_count, check_finite, require
  use block_law, only: block_law_t, set_elastic
  use plane_return, only: plane_back_stresses, add_plane_back_stresses
  use plane_stress, only: plane_trial, flow_in_plane, mode_moduli
  use row_functions, only: exp_row
  use tensor_rotation, only: rotate_all_by_spin
  use text, only: to_text, rounded_text
  use voce, only: elastic_trial
  implicit none
  private

  public :: new_yoshida_uemori

  ! Columns of the state: eqps, R, r and the six components each of theta, beta and q, which are
  ! deviators with tensor shear.
  integer, parameter :: at_eqps = 1, at_size = 2, at_radius = 3, at_theta = 4, at_beta = 10, &
                        at_q = 16, n_columns = 21

  real(wp), parameter :: just_above = 1.0e-13_wp   ! over the yield stress, so left alone
  real(wp), parameter :: near = 1.0e-7_wp          ! residual whose square is lost in the digits
  real(wp), parameter :: least = 1.0e-60_wp        ! square of a stress that counts as none
  integer, parameter :: n_free = 4                 ! steps that renew n.theta
  integer, parameter :: n_newton = 30, max_iterations = 200

  type, extends(block_law_t), public :: yoshida_uemori_t
    real(wp) :: yield = 0.0_wp          !! Y [stress]
    real(wp) :: bound = 0.0_wp          !! B, first size of the bounding surface [stress]
    real(wp) :: approach = 0.0_wp       !! C, rate at which the yield surface comes near to it
    real(wp) :: rate = 0.0_wp           !! m, of its hardening
    real(wp) :: shift = 0.0_wp          !! b, where beta ends [stress]
    real(wp) :: growth = 0.0_wp         !! h, of the region without isotropic hardening
    real(wp) :: saturation = 0.0_wp     !! R_sat [stress]
    real(wp) :: modulus_loss = 0.0_wp   !! (E - E_a)/E
    real(wp) :: loss_rate = 0.0_wp      !! xi
  contains
    procedure :: update
    procedure :: update_plane
    procedure :: shear_warning
  end type yoshida_uemori_t

contains

  !> Law from the constants Y, B, C, m, b, h, R_sat of *PLASTIC, HARDENING=YOSHIDA UEMORI, and E_a,
  !! xi of *UNLOADING MODULUS if the deck gives them. `error` names the keyword that it is about.
  subroutine new_yoshida_uemori(spec, law, error)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(yoshida_uemori_t) :: new

    call set_elastic(new, spec%density, spec%young, spec%poisson)
    new%n_state = n_columns
    new%eqps_state = at_eqps
    call set_constants(spec%constants, new, error)
    call require(spec%plasticity%n_stages == 0, "material: the hardening YOSHIDA UEMORI has "// &
                 "backward Euler alone, no MULTISTAGE", error)
    if (allocated(error)) then
      error%keyword = "*PLASTIC"
      return
    end if
    call refuse_others(spec, error)
    if (allocated(error)) return
    if (allocated(spec%plasticity%unloading)) then
      call set_unloading(spec%young, spec%plasticity%unloading, new, error)
      if (allocated(error)) then
        error%keyword = "*UNLOADING MODULUS"
        return
      end if
    end if
    allocate (law, source=new)
  end subroutine new_yoshida_uemori

  pure subroutine set_constants(constants, law, error)
    real(wp), intent(in) :: constants(:)
    type(yoshida_uemori_t), intent(inout) :: law
    type(error_t), allocatable, intent(inout) :: error

    call check_count("the hardening YOSHIDA UEMORI", constants, 7, &
                     "seven constants: Y, B, C, m, b, h, R_sat", error)
    if (allocated(error)) return
    call check_finite("constants", constants, error)
    law%yield = constants(1)
    law%bound = constants(2)
    law%approach = constants(3)
    law%rate = constants(4)
    law%shift = constants(5)
    law%growth = constants(6)
    law%saturation = constants(7)
    call require(law%yield > 0.0_wp, "material: the yield stress Y must be positive", error)
    call require(law%bound >= law%yield, "material: the size B of the bounding surface must "// &
                 "not be below the yield stress Y, for the yield surface lies inside", error)
    call require(law%approach >= 0.0_wp, "material: the rate C must not be negative", error)
    call require(law%rate >= 0.0_wp, "material: the rate m must not be negative", error)
    call require(law%shift >= 0.0_wp, "material: the back stress b must not be negative", error)
    call require(law%growth >= 0.0_wp .and. law%growth <= 1.0_wp, &
                 "material: h must lie between 0 and 1", error)
    call require(law%saturation >= 0.0_wp, "material: the hardening R_sat must not be "// &
                 "negative, softening localizes in one element, whatever its size", error)
  end subroutine set_constants

  !> Keywords that other hardening laws have and this one has not.
  pure subroutine refuse_others(spec, error)
    type(law_spec_t), intent(in) :: spec
    type(error_t), allocatable, intent(inout) :: error
    character(*), parameter :: behind = " with the hardening YOSHIDA UEMORI"

    associate (plasticity => spec%plasticity)
      if (plasticity%rate /= "") then
        call fail(error, "material: no rate factor"//behind)
        error%keyword = "*RATE DEPENDENT"
      else if (allocated(plasticity%heating)) then
        call fail(error, "material: no heating"//behind)
        error%keyword = "*ADIABATIC HEATING"
      else if (allocated(plasticity%back_stresses)) then
        call fail(error, "material: no further back stresses"//behind)
        error%keyword = "*BACK STRESS"
      else if (plasticity%potential /= "") then
        call fail(error, "material: no yield function but von Mises"//behind)
        error%keyword = "*POTENTIAL"
      end if
    end associate
  end subroutine refuse_others

  pure subroutine set_unloading(young, constants, law, error)
    real(wp), intent(in) :: young, constants(:)
    type(yoshida_uemori_t), intent(inout) :: law
    type(error_t), allocatable, intent(inout) :: error

    call check_count("the unloading modulus", constants, 2, "two constants: E_a, xi", error)
    if (allocated(error)) return
    call check_finite("constants of the unloading modulus", constants, error)
    call require(constants(1) > 0.0_wp .and. constants(1) <= young, &
                 "material: E_a must be above zero and not above Young's modulus, which "// &
                 "the time increment is taken from", error)
    call require(constants(2) >= 0.0_wp, "material: the rate xi must not be negative", error)
    law%modulus_loss = 1.0_wp - constants(1)/young
    law%loss_rate = constants(2)
  end subroutine set_unloading

  !> Elastic trial, then the return of the points that yield.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp) :: fraction(n), scaled(n, 6), mises(n), worst
    integer :: c

    call find_fraction(self, n, state(:, at_eqps), fraction)
    if (self%modulus_loss > 0.0_wp) then
      do c = 1, 6
        scaled(:, c) = fraction*dstrain(:, c)
      end do
      call elastic_trial(n, self%bulk, self%shear, scaled, stress, mises, worst)
    else
      call elastic_trial(n, self%bulk, self%shear, dstrain, stress, mises, worst)
    end if
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (.not. ok .or. stays_virgin(self, n, state(:, at_eqps), worst)) return
    if (present(spin)) call rotate_all_by_spin(n, 3, spin, state(:, at_theta:))
    call return_in_space(self, n, 3.0_wp*self%shear*fraction, stress, state, ok)
  end subroutine update

  !> Fraction of Young's modulus that is left.
  pure subroutine find_fraction(self, n, eqps, fraction)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n)
    real(wp), intent(out) :: fraction(n)

    if (self%modulus_loss > 0.0_wp) then
      fraction = -self%loss_rate*eqps
      call exp_row(n, fraction)
      fraction = 1.0_wp - self%modulus_loss*(1.0_wp - fraction)
    else
      fraction = 1.0_wp
    end if
  end subroutine find_fraction

  !> Has no point of the row flowed before, and does none now? Then no back stress rotates.
  pure logical function stays_virgin(self, n, eqps, worst)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n), worst   !! worst: largest von Mises stress of the trial

    stays_virgin = .false.
    if (worst <= self%yield .and. .not. self%is_awake) stays_virgin = maxval(eqps) <= 0.0_wp
  end function stays_virgin

  !> Return of a row in space.
  pure subroutine return_in_space(self, n, shear3, stress, state, ok)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: shear3(n)          !! 3G
    real(wp), intent(inout) :: stress(n, 6)    !! trial, out the new one
    real(wp), intent(inout) :: state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp) :: relative(n, 6), products(n, 6), speeds(n, 2), along(n), bracket(n, 2), dgamma(n), &
                fade(n, 2), open(n), share(n), n_open
    integer :: iteration

    call relative_products(n, stress, state(:, at_theta:), relative, products)
    call begin_return(self, n, shear3, products, state(:, at_size), speeds, along, bracket, open)
    n_open = sum(open)
    ok = n_open <= 0.0_wp
    if (ok) return
    dgamma = 0.0_wp
    fade = 0.0_wp
    do iteration = 1, max_iterations
      call step_in_space(self, n, iteration, shear3, products, speeds, along, bracket, dgamma, &
                         fade, open, n_open)
      ok = n_open <= 0.0_wp
      if (ok) exit
    end do
    call flow_in_space(self, n, shear3, speeds(:, 1), dgamma, fade, relative, stress, &
                       state(:, at_theta:))
    call products_in_space(n, state(:, at_beta:), relative, products)
    call grow_bound(self, n, dgamma, products, state(:, at_size), state(:, at_radius), share)
    call follow_beta(n, share, state(:, at_beta:))
    state(:, at_eqps) = state(:, at_eqps) + dgamma
  end subroutine return_in_space

  !> Trial stress less theta and beta, and the products of it (0), theta (1) and beta (2): 00, 01,
  !! 02, 11, 12, 22.
  pure subroutine relative_products(n, stress, back, relative, products)
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(n, 6), back(n, 6, 3)
    real(wp), intent(out) :: relative(n, 6), products(n, 6)
    real(wp) :: mean
    integer :: l

    !$omp simd private(mean)
    do l = 1, n
      mean = (stress(l, 1) + stress(l, 2) + stress(l, 3))*(1.0_wp/3.0_wp)
      relative(l, 1) = stress(l, 1) - mean - back(l, 1, 1) - back(l, 1, 2)
      relative(l, 2) = stress(l, 2) - mean - back(l, 2, 1) - back(l, 2, 2)
      relative(l, 3) = stress(l, 3) - mean - back(l, 3, 1) - back(l, 3, 2)
      relative(l, 4) = stress(l, 4) - back(l, 4, 1) - back(l, 4, 2)
      relative(l, 5) = stress(l, 5) - back(l, 5, 1) - back(l, 5, 2)
      relative(l, 6) = stress(l, 6) - back(l, 6, 1) - back(l, 6, 2)
    end do
    call multiply(n, relative, relative, products(:, 1))
    call multiply(n, relative, back(:, :, 1), products(:, 2))
    call multiply(n, relative, back(:, :, 2), products(:, 3))
    call multiply(n, back(:, :, 1), back(:, :, 1), products(:, 4))
    call multiply(n, back(:, :, 1), back(:, :, 2), products(:, 5))
    call multiply(n, back(:, :, 2), back(:, :, 2), products(:, 6))
  end subroutine relative_products

  !> 3/2 a:b of deviators.
  pure subroutine multiply(n, a, b, product)
    integer, intent(in) :: n
    real(wp), intent(in) :: a(n, 6), b(n, 6)
    real(wp), intent(out) :: product(n)
    integer :: l

    !$omp simd
    do l = 1, n
      product(l) = 1.5_wp*(a(l, 1)*b(l, 1) + a(l, 2)*b(l, 2) + a(l, 3)*b(l, 3)) &
                   + 3.0_wp*(a(l, 4)*b(l, 4) + a(l, 5)*b(l, 5) + a(l, 6)*b(l, 6))
    end do
  end subroutine multiply

  !> What the steps of a row start from. Points that do not yield are closed.
  pure subroutine begin_return(self, n, stiffness, products, size, speeds, along, bracket, open)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: stiffness(n)       !! smallest elastic modulus of the return
    real(wp), intent(in) :: products(n, 6)     !! of `relative_products`
    real(wp), intent(in) :: size(n)            !! R
    real(wp), intent(out) :: speeds(n, 2)      !! C a and C sqrt(a)
    real(wp), intent(out) :: along(n)          !! n.theta
    real(wp), intent(out) :: bracket(n, 2)     !! of dp
    real(wp), intent(out) :: open(n)           !! 1: yields, 0: does not
    real(wp) :: a, norm, over
    integer :: l

    !$omp simd private(a, norm, over)
    do l = 1, n
      a = max(self%bound - self%yield + size(l), 0.0_wp)
      speeds(l, 1) = self%approach*a
      speeds(l, 2) = self%approach*sqrt(a)
      norm = sqrt(max(products(l, 1), least))
      along(l) = products(l, 2)/norm
      over = norm - self%yield
      open(l) = merge(1.0_wp, 0.0_wp, over > just_above*self%yield)
      bracket(l, 1) = 0.0_wp
      ! Back stresses that fade add at most the sum of their norms.
      bracket(l, 2) = (over + sqrt(2.0_wp*(products(l, 4) + products(l, 6))))/stiffness(l)
    end do
  end subroutine begin_return

  !> One step of Newton's method towards |xi| = Y + 3G dp + u' C a dp + v' m b dp, where xi is the
  !! trial stress less u' theta + v' beta. The first steps renew n.theta; then the bracket closes.
  !! A step from a residual whose square is lost in the digits is the last of its point.
  pure subroutine step_in_space(self, n, iteration, shear3, products, speeds, along, bracket, &
                                dgamma, fade, open, n_open)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n, iteration
    real(wp), intent(in) :: shear3(n), products(n, 6), speeds(n, 2)
    real(wp), intent(inout) :: along(n), bracket(n, 2), dgamma(n), open(n)
    real(wp), intent(inout) :: fade(n, 2)      !! 1 - u', 1 - v'
    real(wp), intent(out) :: n_open            !! points left
    real(wp) :: yield, rate, shift, d, u, u1, v, v1, left, x1, x2, norm, grown, residual, fall, step
    logical :: is_last
    integer :: l

    yield = self%yield
    rate = self%rate
    shift = self%shift
    n_open = 0.0_wp
    !$omp simd private(d, u, u1, v, v1, left, x1, x2, norm, grown, residual, fall, step, is_last) &
    !$omp reduction(+:n_open)
    do l = 1, n
      d = dgamma(l)
      call fade_theta(speeds(l, 1), speeds(l, 2), products(l, 4), along(l), d, u, u1)
      left = 1.0_wp/(1.0_wp + rate*d)
      v = rate*d*left
      v1 = rate*left*left
      ! Products of xi with theta and beta.
      x1 = products(l, 2) + u*products(l, 4) + v*products(l, 5)
      x2 = products(l, 3) + u*products(l, 5) + v*products(l, 6)
      norm = sqrt(max(products(l, 1) + u*(products(l, 2) + x1) + v*(products(l, 3) + x2), least))
      grown = speeds(l, 1)*d
      residual = norm - yield - shear3(l)*d - (1.0_wp - u)*grown - shift*v
      fall = shear3(l) + (1.0_wp - u)*speeds(l, 1) - u1*grown + shift*v1 - (u1*x1 + v1*x2)/norm
      step = residual/max(fall, 0.1_wp*shear3(l))
      is_last = iteration > 1 .and. abs(residual) <= near*yield
      call bound_step(iteration, residual, is_last, d, bracket(l, 1), bracket(l, 2), step)
      if (open(l) > 0.0_wp) then
        dgamma(l) = d + step
        fade(l, 1) = u + u1*step
        fade(l, 2) = v + v1*step
        if (iteration <= n_free .and. .not. is_last) along(l) = x1/norm
        if (is_last) open(l) = 0.0_wp
      end if
      n_open = n_open + open(l)
    end do
  end subroutine step_in_space

  !> 1 - u' of theta after dp, and its derivative.
  pure subroutine fade_theta(ca, ck, square, along, d, u, u1)
    real(wp), intent(in) :: ca, ck             !! C a and C sqrt(a)
    real(wp), intent(in) :: square, along      !! |theta|^2, n.theta
    real(wp), intent(in) :: d                  !! dp
    real(wp), intent(out) :: u, u1
    real(wp) :: k, t, root, s, s1, per

    k = ck*d
    t = sqrt(max(square + ca*d*(2.0_wp*along + ca*d), least))
    root = sqrt(k*k + 4.0_wp*t)
    s = 2.0_wp*t/(k + root)
    s1 = (ca*(along + ca*d)/t - ck*s)/root
    per = 1.0_wp/(s + k)
    u = k*per
    u1 = (ck*s - k*s1)*per*per
  end subroutine fade_theta

  !> Keep a step in the bracket of its root, which the residual narrows.
  pure subroutine bound_step(iteration, residual, is_last, d, low, high, step)
    integer, intent(in) :: iteration
    real(wp), intent(in) :: residual           !! falls with dp
    logical, intent(in) :: is_last
    real(wp), intent(in) :: d
    real(wp), intent(inout) :: low, high, step
    real(wp) :: next

    if (iteration > n_free) then
      if (residual > 0.0_wp) then
        low = d
      else
        high = d
      end if
    end if
    next = d + step
    if (.not. is_last .and. (next <= low .or. next >= high .or. iteration > n_newton)) &
      next = 0.5_wp*(low + high)
    step = min(max(next, low), high) - d
  end subroutine bound_step

  !> Flow of a row by dp along xi. What does not flow keeps its bits.
  pure subroutine flow_in_space(self, n, shear3, ca, dgamma, fade, relative, stress, back)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in), dimension(n) :: shear3, ca, dgamma   !! ca: C a
    real(wp), intent(in) :: fade(n, 2)
    real(wp), intent(inout) :: relative(n, 6)  !! of `relative_products`, out the change of beta
    real(wp), intent(inout) :: stress(n, 6), back(n, 6, 3)
    real(wp) :: per(n), u, v, along, shift
    integer :: c, l

    shift = self%shift
    !$omp simd
    do l = 1, n
      per(l) = 1.0_wp/(self%yield + (shear3(l) + (1.0_wp - fade(l, 1))*ca(l))*dgamma(l) &
                       + shift*fade(l, 2))
    end do
    do c = 1, 6
      !$omp simd private(u, v, along)
      do l = 1, n
        u = fade(l, 1)
        v = fade(l, 2)
        along = (relative(l, c) + u*back(l, c, 1) + v*back(l, c, 2))*per(l)
        stress(l, c) = stress(l, c) - shear3(l)*dgamma(l)*along
        back(l, c, 1) = (1.0_wp - u)*(back(l, c, 1) + ca(l)*dgamma(l)*along)
        relative(l, c) = v*(shift*along - back(l, c, 2))
        back(l, c, 2) = back(l, c, 2) + relative(l, c)
      end do
    end do
  end subroutine flow_in_space

  !> Products that `grow_bound` needs.
  pure subroutine products_in_space(n, back, change, products)
    integer, intent(in) :: n
    real(wp), intent(in) :: back(n, 6, 2)      !! beta at the end, q
    real(wp), intent(in) :: change(n, 6)       !! of beta
    real(wp), intent(inout) :: products(n, 6)
    real(wp) :: distance(n, 6)

    distance = back(:, :, 1) - back(:, :, 2)
    call multiply(n, distance, distance, products(:, 1))
    call multiply(n, distance, change, products(:, 2))
    call multiply(n, change, change, products(:, 3))
  end subroutine products_in_space

  !> R and r after an increment. What beta moves after it has reached g counts as a part f of dp.
  !! Where b = 0 there is no beta, and R always grows.
  pure subroutine grow_bound(self, n, dgamma, products, size, radius, share)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dgamma(n)
    real(wp), intent(in) :: products(n, 3)     !! of beta - q at the end and the change of beta
    real(wp), intent(inout) :: size(n), radius(n)    !! R, r
    real(wp), intent(out) :: share(n)          !! of beta - q by which q moves
    real(wp) :: rate, growth, saturation, always, distance, over, moved, before, root, part, grown
    integer :: l

    rate = self%rate
    growth = self%growth
    saturation = self%saturation
    always = merge(1.0_wp, 0.0_wp, self%shift <= 0.0_wp)
    !$omp simd private(distance, over, moved, before, root, part, grown)
    do l = 1, n
      distance = sqrt(max(products(l, 1), least))
      over = merge(max(distance - radius(l), 0.0_wp), 0.0_wp, dgamma(l) > 0.0_wp)
      ! Part of the move inside g: |beta - q + part (change)| = r from beta at the start.
      moved = max(products(l, 3), least)
      before = products(l, 2) - products(l, 3)
      part = min(products(l, 1) - 2.0_wp*products(l, 2) + products(l, 3) - radius(l)**2, 0.0_wp)
      root = sqrt(before**2 - moved*part)
      if (before > 0.0_wp) then
        part = -part/(root + before)
      else
        part = (root - before)/moved
      end if
      part = min(max(1.0_wp - part, 0.0_wp), 1.0_wp)
      grown = rate*dgamma(l)*max(merge(part, 0.0_wp, over > 0.0_wp), always)
      size(l) = size(l) + grown*(saturation - size(l))/(1.0_wp + grown)
      radius(l) = radius(l) + growth*over
      share(l) = (1.0_wp - growth)*over/distance
    end do
  end subroutine grow_bound

  !> Let q follow beta.
  pure subroutine follow_beta(n, share, back)
    integer, intent(in) :: n
    real(wp), intent(in) :: share(n)
    real(wp), intent(inout) :: back(n, 6, 2)   !! beta, q
    integer :: c, l

    do c = 1, 6
      !$omp simd
      do l = 1, n
        back(l, c, 2) = back(l, c, 2) + share(l)*(back(l, c, 1) - back(l, c, 2))
      end do
    end do
  end subroutine follow_beta

  !> Elastic trial and return in plane stress. Back stresses count as the modes of the plane
  !! stresses whose deviators they are, see `plane_return`.
  subroutine update_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    real(wp) :: fraction(n), scaled(n, 3), modes(n, 3), back(n, 3, 3), old(n, 3, 3), worst
    integer :: c

    call find_fraction(self, n, state(:, at_eqps), fraction)
    do c = 1, 3
      scaled(:, c) = fraction*dstrain(:, c)
    end do
    call plane_trial(n, self%bulk, self%shear, scaled, stress, through, modes, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp
    if (ok .and. .not. stays_virgin(self, n, state(:, at_eqps), sqrt(worst))) then
      call plane_back_stresses(n, 3, state(:, at_theta:), old)
      call rotate_modes(n, spin, old, back)
      call return_in_sheet(self, n, fraction, modes, back, state(:, :at_radius), ok)
      do c = 1, 3
        modes(:, c) = fraction*modes(:, c)
      end do
      call flow_in_plane(n, self%bulk, self%shear, modes, stress, through)
      call add_plane_back_stresses(n, 3, back - old, state(:, at_theta:))
    end if
    through = through/fraction
  end subroutine update_plane

  !> Rotate modes by the angle of the spin increment about the normal (T. J. R. Hughes and
  !! J. Winget, IJNME 15 (1980), eq. (13)).
  pure subroutine rotate_modes(n, spin, old, modes)
    integer, intent(in) :: n
    real(wp), intent(in) :: spin(n)            !! increment 12
    real(wp), intent(in) :: old(n, 3, 3)
    real(wp), intent(out) :: modes(n, 3, 3)
    real(wp) :: half, sine, versine
    integer :: k, l

    do k = 1, 3
      !$omp simd private(half, sine, versine)
      do l = 1, n
        half = 1.0_wp/(1.0_wp + 0.25_wp*spin(l)**2)
        sine = spin(l)*half
        versine = 2.0_wp*sine**2
        sine = 2.0_wp*sine*(1.0_wp - 0.25_wp*spin(l)**2)*half
        modes(l, 1, k) = old(l, 1, k)
        modes(l, 2, k) = old(l, 2, k) + (sine*old(l, 3, k) - versine*old(l, 2, k))
        modes(l, 3, k) = old(l, 3, k) - (sine*old(l, 2, k) + versine*old(l, 3, k))
      end do
    end do
  end subroutine rotate_modes

  !> Return of a row in plane stress.
  pure subroutine return_in_sheet(self, n, fraction, modes, back, scalars, ok)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: fraction(n)
    real(wp), intent(inout) :: modes(n, 3)     !! of the trial stress, out of the plastic strain
    real(wp), intent(inout) :: back(n, 3, 3)   !! modes of theta, beta, q
    real(wp), intent(inout) :: scalars(n, 3)   !! eqps, R, r
    logical, intent(out) :: ok
    real(wp) :: moduli(n, 3), products(n, 6), speeds(n, 2), along(n), bracket(n, 2), dgamma(n), &
                fade(n, 2), open(n), share(n), one(3), n_open
    integer :: i, iteration

    one = mode_moduli(self%bulk, self%shear)
    do i = 1, 3
      moduli(:, i) = one(i)*fraction
      modes(:, i) = modes(:, i) - back(:, i, 1) - back(:, i, 2)
    end do
    call products_of_modes(n, modes, back, products)
    call begin_return(self, n, moduli(:, 1), products, scalars(:, at_size), speeds, along, &
                      bracket, open)
    dgamma = 0.0_wp
    fade = 0.0_wp
    n_open = sum(open)
    ok = n_open <= 0.0_wp
    do iteration = 1, max_iterations
      if (ok) exit
      call step_in_sheet(self, n, iteration, moduli, modes, back, speeds, along, bracket, dgamma, &
                         fade, open, n_open)
      ok = n_open <= 0.0_wp
    end do
    call flow_modes(self, n, moduli, speeds(:, 1), dgamma, fade, modes, back, products)
    call grow_bound(self, n, dgamma, products, scalars(:, at_size), scalars(:, at_radius), share)
    do i = 1, 3
      back(:, i, 3) = back(:, i, 3) + share*(back(:, i, 2) - back(:, i, 3))
    end do
    scalars(:, at_eqps) = scalars(:, at_eqps) + dgamma
  end subroutine return_in_sheet

  !> Those of `relative_products` that `begin_return` takes.
  pure subroutine products_of_modes(n, relative, back, products)
    integer, intent(in) :: n
    real(wp), intent(in) :: relative(n, 3), back(n, 3, 3)
    real(wp), intent(out) :: products(n, 6)
    integer :: l

    !$omp simd
    do l = 1, n
      products(l, 1) = relative(l, 1)**2 + relative(l, 2)**2 + relative(l, 3)**2
      products(l, 2) = relative(l, 1)*back(l, 1, 1) + relative(l, 2)*back(l, 2, 1) &
                       + relative(l, 3)*back(l, 3, 1)
      products(l, 3) = 0.0_wp
      products(l, 4) = back(l, 1, 1)**2 + back(l, 2, 1)**2 + back(l, 3, 1)**2
      products(l, 5) = 0.0_wp
      products(l, 6) = back(l, 1, 2)**2 + back(l, 2, 2)**2 + back(l, 3, 2)**2
    end do
  end subroutine products_of_modes

  !> `step_in_space` towards 1 - 1/sqrt(P) = 0, P = sum (xi/X)^2 over the modes, X = Y + (u' C a +
  !! modulus) dp + v' m b dp. It is nearly linear in dp.
  pure subroutine step_in_sheet(self, n, iteration, moduli, relative, back, speeds, along, &
                                bracket, dgamma, fade, open, n_open)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n, iteration
    real(wp), intent(in) :: moduli(n, 3), relative(n, 3), back(n, 3, 3), speeds(n, 2)
    real(wp), intent(inout) :: along(n), bracket(n, 2), dgamma(n), fade(n, 2), open(n)
    real(wp), intent(out) :: n_open
    real(wp) :: yield, rate, shift, d, u, u1, v, v1, left, x, x1, g1, g2, g3, per1, per2, p, p1, &
                residual, fall, step, square
    logical :: is_last
    integer :: l

    yield = self%yield
    rate = self%rate
    shift = self%shift
    n_open = 0.0_wp
    !$omp simd private(d, u, u1, v, v1, left, x, x1, g1, g2, g3, per1, per2, p, p1, residual, &
    !$omp fall, step, square, is_last) reduction(+:n_open)
    do l = 1, n
      d = dgamma(l)
      square = back(l, 1, 1)**2 + back(l, 2, 1)**2 + back(l, 3, 1)**2
      call fade_theta(speeds(l, 1), speeds(l, 2), square, along(l), d, u, u1)
      left = 1.0_wp/(1.0_wp + rate*d)
      v = rate*d*left
      v1 = rate*left*left
      x = yield + (1.0_wp - u)*speeds(l, 1)*d + shift*v
      x1 = (1.0_wp - u)*speeds(l, 1) - u1*speeds(l, 1)*d + shift*v1
      per1 = 1.0_wp/(x + moduli(l, 1)*d)
      per2 = 1.0_wp/(x + moduli(l, 2)*d)
      g1 = (relative(l, 1) + u*back(l, 1, 1) + v*back(l, 1, 2))*per1
      g2 = (relative(l, 2) + u*back(l, 2, 1) + v*back(l, 2, 2))*per2
      g3 = (relative(l, 3) + u*back(l, 3, 1) + v*back(l, 3, 2))*per2
      p = max(g1*g1 + g2*g2 + g3*g3, least)
      p1 = g1*per1*(u1*back(l, 1, 1) + v1*back(l, 1, 2) - g1*(x1 + moduli(l, 1))) &
           + per2*(g2*(u1*back(l, 2, 1) + v1*back(l, 2, 2) - g2*(x1 + moduli(l, 2))) &
                   + g3*(u1*back(l, 3, 1) + v1*back(l, 3, 2) - g3*(x1 + moduli(l, 2))))
      left = 1.0_wp/sqrt(p)
      residual = 1.0_wp - left
      fall = max(-p1*left**3, 0.01_wp*moduli(l, 1)*left*per2)
      step = residual/fall
      is_last = iteration > 1 .and. abs(residual) <= near
      call bound_step(iteration, residual, is_last, d, bracket(l, 1), bracket(l, 2), step)
      if (open(l) > 0.0_wp) then
        dgamma(l) = d + step
        fade(l, 1) = u + u1*step
        fade(l, 2) = v + v1*step
        if (iteration <= n_free .and. .not. is_last) &
          along(l) = left*(g1*back(l, 1, 1) + g2*back(l, 2, 1) + g3*back(l, 3, 1))
        if (is_last) open(l) = 0.0_wp
      end if
      n_open = n_open + open(l)
    end do
  end subroutine step_in_sheet

  !> Plastic strain of a row, theta and beta after it, and the products that `grow_bound` needs.
  pure subroutine flow_modes(self, n, moduli, ca, dgamma, fade, modes, back, products)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(n, 3), ca(n), dgamma(n), fade(n, 2)
    real(wp), intent(inout) :: modes(n, 3)     !! relative, out of the plastic strain
    real(wp), intent(inout) :: back(n, 3, 3)
    real(wp), intent(out) :: products(n, 6)
    real(wp) :: u, v, g, change, distance, yield, shift
    integer :: i, l

    yield = self%yield
    shift = self%shift
    products = 0.0_wp
    do i = 1, 3
      !$omp simd private(u, v, g, change, distance)
      do l = 1, n
        u = fade(l, 1)
        v = fade(l, 2)
        g = (modes(l, i) + u*back(l, i, 1) + v*back(l, i, 2)) &
            /(yield + ((1.0_wp - u)*ca(l) + moduli(l, i))*dgamma(l) + shift*v)
        modes(l, i) = dgamma(l)*g
        back(l, i, 1) = (1.0_wp - u)*(back(l, i, 1) + ca(l)*dgamma(l)*g)
        change = v*(shift*g - back(l, i, 2))
        back(l, i, 2) = back(l, i, 2) + change
        distance = back(l, i, 2) - back(l, i, 3)
        products(l, 1) = products(l, 1) + distance**2
        products(l, 2) = products(l, 2) + distance*change
        products(l, 3) = products(l, 3) + change**2
      end do
    end do
  end subroutine flow_modes

  !> beta fades least, and so keeps least of its shear.
  pure function shear_warning(self) result(warning)
    class(yoshida_uemori_t), intent(in) :: self
    character(:), allocatable :: warning

    warning = "back stresses rotate with the spin (Jaumann rate), so the shear stress is too "// &
              "low: of beta, with m "//rounded_text(self%rate)//", continued simple shear "// &
              "leaves "//to_text(nint(100*self%rate**2/(self%rate**2 + 3.0_wp)))//" %"
  end function shear_warning

end module yoshida_uemori
