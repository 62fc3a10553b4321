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
!! Backward Euler, with R of the start of the increment. n has the direction of xi, the trial stress
!! less (1 - u) theta and (1 - v) beta, where u and v are the parts that fade of both:
!!
!!     |xi| = Y + 3G dp + (1 - u) C a dp + b v,   v = m dp/(1 + m dp),   u = k/(s + k)
!!     s^2 + k s = |theta + C a dp n|,            k = C sqrt(a) dp
!!
!! with theta and beta of the start, and s = sqrt(|theta|) at the end. The quadratic equation keeps
!! |theta| <= a whatever the increment. Newton's method finds dp and s, for n depends on both. In an
!! increment beta moves along a straight line, and R grows by the part of it outside of g, so that
!! the stress is continuous in the strain. All this is first order in the increment.
module yoshida_uemori
  use kinds, only: wp
  use failure, only: error_t
  use law_spec, only: law_spec_t
  use constant_check, only: check_count, check_finite, require
  use block_law, only: block_law_t, set_elastic
  use plane_stress, only: plane_trial, flow_in_plane, mode_moduli
  use row_functions, only: exp_row
  use tensor_rotation, only: rotate_all_by_spin
  use text, only: to_text, rounded_text
  use two_surface, only: two_surface_t, begin_return, step_in_space, step_in_sheet, flow_in_sheet, &
                         find_root, grow_bound, max_iterations, least
  use voce, only: elastic_trial
  implicit none
  private

  public :: new_yoshida_uemori

  ! Columns of the state: eqps, R, r and the six components each of theta, beta and q, which are
  ! deviators with tensor shear. In sheets it is three modes each, see `plane_stress`, of the plane
  ! stresses whose deviators they are.
  integer, parameter :: at_eqps = 1, at_size = 2, at_radius = 3, at_theta = 4, at_beta = 10, &
                        at_q = 16, n_columns = 21, n_of_sheets = 12

  type, extends(block_law_t), public :: yoshida_uemori_t
    type(two_surface_t) :: surfaces
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
    new%n_state = merge(n_of_sheets, n_columns, spec%is_sheet)
    new%eqps_state = at_eqps
    call set_constants(spec%constants, new%surfaces, error)
    if (allocated(error)) then
      error%keyword = "*PLASTIC"
      return
    end if
    if (allocated(spec%plasticity%unloading)) then
      call set_unloading(spec%young, spec%plasticity%unloading, new, error)
      if (allocated(error)) then
        error%keyword = "*UNLOADING MODULUS"
        return
      end if
    end if
    allocate (law, source=new)
  end subroutine new_yoshida_uemori

  pure subroutine set_constants(constants, surfaces, error)
    real(wp), intent(in) :: constants(:)
    type(two_surface_t), intent(out) :: surfaces
    type(error_t), allocatable, intent(inout) :: error

    call check_count("the hardening YOSHIDA UEMORI", constants, 7, &
                     "seven constants: Y, B, C, m, b, h, R_sat", error)
    if (allocated(error)) return
    call check_finite("constants", constants, error)
    surfaces = two_surface_t(constants(1), constants(2), constants(3), constants(4), constants(5), &
                             constants(6), constants(7))
    call require(surfaces%yield > 0.0_wp, "material: the yield stress Y must be positive", error)
    call require(surfaces%bound >= surfaces%yield, "material: the size B of the bounding "// &
                 "surface must not be below the yield stress Y, for the yield surface lies "// &
                 "inside", error)
    call require(surfaces%approach >= 0.0_wp, "material: the rate C must not be negative", error)
    call require(surfaces%rate >= 0.0_wp, "material: the rate m must not be negative", error)
    call require(surfaces%shift >= 0.0_wp, &
                 "material: the back stress b must not be negative", error)
    call require(surfaces%growth >= 0.0_wp .and. surfaces%growth <= 1.0_wp, &
                 "material: h must lie between 0 and 1", error)
    call require(surfaces%saturation >= 0.0_wp, "material: the hardening R_sat must not be "// &
                 "negative, softening localizes in one element, whatever its size", error)
  end subroutine set_constants

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

  !> Elastic trial, then the return of the points that yield, of laws for solids.
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
    ok = worst < huge(worst) .and. dt >= 0.0_wp .and. self%n_state == n_columns
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
      call exp_row(n, -self%loss_rate, eqps, fraction)
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
    if (worst <= self%surfaces%yield .and. .not. self%is_awake) &
      stays_virgin = maxval(eqps) <= 0.0_wp
  end function stays_virgin

  !> Return of a row in space.
  pure subroutine return_in_space(self, n, shear3, stress, state, ok)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: shear3(n)          !! 3G
    real(wp), intent(inout) :: stress(n, 6)    !! trial, out the new one
    real(wp), intent(inout) :: state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp) :: relative(n, 6), products(n, 6), speeds(n, 2), dgamma(n), root(n), open(n), &
                share(n), groups(6, 2), n_open
    integer :: iteration, l

    call relative_products(n, stress, state(:, at_theta:), relative, products)
    call begin_return(self%surfaces, n, shear3, products, state(:, at_size), speeds, dgamma, &
                      root, open)
    n_open = sum(open)
    ok = n_open <= 0.0_wp
    if (ok) return
    do iteration = 1, max_iterations
      call step_in_space(self%surfaces, n, shear3, products, speeds, dgamma, root, open, n_open)
      if (n_open <= 0.0_wp) exit
    end do
    ok = .true.
    if (n_open > 0.0_wp) then
      groups = 0.0_wp
      do l = 1, n
        if (.not. open(l) > 0.0_wp .or. .not. ok) cycle
        groups(:, 1) = products(l, :)
        call find_root(self%surfaces, [shear3(l), shear3(l)], groups, speeds(l, :), dgamma(l), &
                       root(l), ok)
      end do
    end if
    call flow_in_space(self%surfaces, n, shear3, speeds, dgamma, root, relative, stress, &
                       state(:, at_theta:), products)
    call grow_bound(self%surfaces, n, dgamma, products, state(:, at_size), state(:, at_radius), &
                    share)
    call follow_beta(n, share, state(:, at_beta:))
    state(:, at_eqps) = state(:, at_eqps) + dgamma
  end subroutine return_in_space

  !> Trial stress less theta and beta, and the products of it (0), theta (1) and beta (2): 00, 01,
  !! 02, 11, 12, 22.
  pure subroutine relative_products(n, stress, back, relative, products)
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(n, 6), back(n, 6, 3)
    real(wp), intent(out) :: relative(n, 6), products(n, 6)
    real(wp) :: mean, x1, x2, x3, x4, x5, x6, t1, t2, t3, t4, t5, t6, b1, b2, b3, b4, b5, b6
    integer :: l

    !$omp simd private(mean, x1, x2, x3, x4, x5, x6, t1, t2, t3, t4, t5, t6, b1, b2, b3, b4, b5, b6)
    do l = 1, n
      t1 = back(l, 1, 1); t2 = back(l, 2, 1); t3 = back(l, 3, 1)
      t4 = back(l, 4, 1); t5 = back(l, 5, 1); t6 = back(l, 6, 1)
      b1 = back(l, 1, 2); b2 = back(l, 2, 2); b3 = back(l, 3, 2)
      b4 = back(l, 4, 2); b5 = back(l, 5, 2); b6 = back(l, 6, 2)
      mean = (stress(l, 1) + stress(l, 2) + stress(l, 3))*(1.0_wp/3.0_wp)
      x1 = stress(l, 1) - mean - t1 - b1
      x2 = stress(l, 2) - mean - t2 - b2
      x3 = stress(l, 3) - mean - t3 - b3
      x4 = stress(l, 4) - t4 - b4
      x5 = stress(l, 5) - t5 - b5
      x6 = stress(l, 6) - t6 - b6
      relative(l, 1) = x1; relative(l, 2) = x2; relative(l, 3) = x3
      relative(l, 4) = x4; relative(l, 5) = x5; relative(l, 6) = x6
      products(l, 1) = 1.5_wp*(x1*x1 + x2*x2 + x3*x3) + 3.0_wp*(x4*x4 + x5*x5 + x6*x6)
      products(l, 2) = 1.5_wp*(x1*t1 + x2*t2 + x3*t3) + 3.0_wp*(x4*t4 + x5*t5 + x6*t6)
      products(l, 3) = 1.5_wp*(x1*b1 + x2*b2 + x3*b3) + 3.0_wp*(x4*b4 + x5*b5 + x6*b6)
      products(l, 4) = 1.5_wp*(t1*t1 + t2*t2 + t3*t3) + 3.0_wp*(t4*t4 + t5*t5 + t6*t6)
      products(l, 5) = 1.5_wp*(t1*b1 + t2*b2 + t3*b3) + 3.0_wp*(t4*b4 + t5*b5 + t6*b6)
      products(l, 6) = 1.5_wp*(b1*b1 + b2*b2 + b3*b3) + 3.0_wp*(b4*b4 + b5*b5 + b6*b6)
    end do
  end subroutine relative_products

  !> Flow of a row by dp along xi, and the products that `grow_bound` needs. What does not flow
  !! keeps its bits.
  pure subroutine flow_in_space(surfaces, n, shear3, speeds, dgamma, root, relative, stress, back, &
                                products)
    type(two_surface_t), intent(in) :: surfaces
    integer, intent(in) :: n
    real(wp), intent(in) :: shear3(n), speeds(n, 2)   !! 3G; C a and C sqrt(a)
    real(wp), intent(in) :: dgamma(n), root(n)        !! dp, s
    real(wp), intent(in) :: relative(n, 6)     !! of `relative_products`
    real(wp), intent(inout) :: stress(n, 6), back(n, 6, 3)
    real(wp), intent(out) :: products(n, 3)
    real(wp), dimension(n) :: per, fade, second
    real(wp) :: yield, rate, shift, weight, u, v, along, change, distance
    integer :: c, l

    yield = surfaces%yield
    rate = surfaces%rate
    shift = surfaces%shift
    !$omp simd private(u)
    do l = 1, n
      u = speeds(l, 2)*dgamma(l)
      u = u/(root(l) + u)
      fade(l) = u
      second(l) = rate*dgamma(l)/(1.0_wp + rate*dgamma(l))
      per(l) = 1.0_wp/(yield + (shear3(l) + (1.0_wp - u)*speeds(l, 1))*dgamma(l) + shift*second(l))
      products(l, :) = 0.0_wp
    end do
    do c = 1, 6
      weight = merge(1.5_wp, 3.0_wp, c <= 3)
      !$omp simd private(u, v, along, change, distance)
      do l = 1, n
        u = fade(l)
        v = second(l)
        along = (relative(l, c) + u*back(l, c, 1) + v*back(l, c, 2))*per(l)
        stress(l, c) = stress(l, c) - shear3(l)*dgamma(l)*along
        back(l, c, 1) = (1.0_wp - u)*(back(l, c, 1) + speeds(l, 1)*dgamma(l)*along)
        distance = back(l, c, 2) - back(l, c, 3)
        change = v*(shift*along - back(l, c, 2))
        back(l, c, 2) = back(l, c, 2) + change
        products(l, 1) = products(l, 1) + weight*distance**2
        products(l, 2) = products(l, 2) + weight*distance*change
        products(l, 3) = products(l, 3) + weight*change**2
      end do
    end do
  end subroutine flow_in_space

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

  !> Elastic trial and return in plane stress, of laws for sheets.
  subroutine update_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    integer, parameter :: together = 64        ! points whose numbers stay in the first cache
    real(wp) :: fraction(n), scaled(n, 3), modes(n, 3), worst
    logical :: is_good
    integer :: c, first

    call find_fraction(self, n, state(:, at_eqps), fraction)
    do c = 1, 3
      scaled(:, c) = fraction*dstrain(:, c)
    end do
    call plane_trial(n, self%bulk, self%shear, scaled, stress, through, modes, worst)
    ok = worst < huge(worst) .and. dt >= 0.0_wp .and. self%n_state == n_of_sheets
    if (ok .and. .not. stays_virgin(self, n, state(:, at_eqps), sqrt(worst))) then
      do first = 1, n, together
        call return_in_sheet(self, n, min(together, n - first + 1), fraction(first), spin(first), &
                             modes(first, 1), state(first, 1), is_good)
        ok = ok .and. is_good
      end do
      call flow_in_plane(n, self%bulk, self%shear, modes, stress, through)
    end if
    if (self%modulus_loss > 0.0_wp) through = through/fraction
  end subroutine update_plane

  !> Return of some points of a row in plane stress.
  pure subroutine return_in_sheet(self, n_row, n, fraction, spin, modes, state, ok)
    class(yoshida_uemori_t), intent(in) :: self
    integer, intent(in) :: n_row, n
    real(wp), intent(in) :: fraction(n), spin(n)   !! of the moduli that is left; increment 12
    real(wp), intent(inout) :: modes(n_row, *)     !! of the trial stress, out of the plastic strain
                                                   !! times the fraction
    real(wp), intent(inout) :: state(n_row, *)
    logical, intent(out) :: ok
    real(wp) :: relative(n, 3), back(n, 3, 3), products(n, 4), speeds(n, 2), moduli(3), n_open
    real(wp), dimension(n) :: stiffness, dgamma, root, open, share
    integer :: iteration, l

    moduli = mode_moduli(self%bulk, self%shear)
    call load_points(n_row, n, moduli(:2), fraction, spin, modes, state(1, at_theta), relative, &
                     back, products, stiffness)
    ok = all_inside(n, self%surfaces%yield, products)
    if (ok) then
      dgamma = 0.0_wp
      share = 0.0_wp
      relative = 0.0_wp
    else
      call begin_return(self%surfaces, n, stiffness, products, state(1, at_size), speeds, dgamma, &
                        root, open)
      do iteration = 1, max_iterations
        call step_in_sheet(self%surfaces, n, moduli(:2), fraction, relative, back, speeds, dgamma, &
                           root, open, n_open)
        if (n_open <= 0.0_wp) exit
      end do
      ok = .true.
      if (n_open > 0.0_wp) then
        do l = 1, n
          if (open(l) > 0.0_wp .and. ok) &
            call find_root(self%surfaces, fraction(l)*moduli(:2), &
                           grouped(relative(l, :), back(l, :, :)), speeds(l, :), dgamma(l), &
                           root(l), ok)
        end do
      end if
      call flow_in_sheet(self%surfaces, n, moduli(:2), fraction, speeds, dgamma, root, relative, &
                         back, products)
      call grow_bound(self%surfaces, n, dgamma, products, state(1, at_size), state(1, at_radius), &
                      share)
    end if
    call store_points(n_row, n, fraction, dgamma, share, relative, back, modes, state(1, at_eqps), &
                      state(1, at_theta))
  end subroutine return_in_sheet

  !> Back stresses, rotated by the angle of the spin increment about the normal (T. J. R. Hughes and
  !! J. Winget, IJNME 15 (1980), eq. (13)), trial stress less theta and beta, the products of
  !! `relative_products` that `begin_return` takes, and the modulus along the trial stress.
  pure subroutine load_points(n_row, n, moduli, fraction, spin, modes, kept, relative, back, &
                              products, stiffness)
    integer, intent(in) :: n_row, n
    real(wp), intent(in) :: moduli(2), fraction(n), spin(n), modes(n_row, *)
    real(wp), intent(in) :: kept(n_row, 3, *)  !! modes of theta, beta and q
    real(wp), intent(out) :: relative(n, 3), back(n, 3, 3), products(n, 4), stiffness(n)
    real(wp) :: half, sine, versine, t1, t2, t3, b1, b2, b3, x1, x2, x3
    integer :: l

    !$omp simd private(half, sine, versine, t1, t2, t3, b1, b2, b3, x1, x2, x3)
    do l = 1, n
      half = 1.0_wp/(1.0_wp + 0.25_wp*spin(l)**2)
      sine = spin(l)*half
      versine = 2.0_wp*sine**2
      sine = 2.0_wp*sine*(1.0_wp - 0.25_wp*spin(l)**2)*half
      t1 = kept(l, 1, 1)
      t2 = kept(l, 2, 1) + (sine*kept(l, 3, 1) - versine*kept(l, 2, 1))
      t3 = kept(l, 3, 1) - (sine*kept(l, 2, 1) + versine*kept(l, 3, 1))
      b1 = kept(l, 1, 2)
      b2 = kept(l, 2, 2) + (sine*kept(l, 3, 2) - versine*kept(l, 2, 2))
      b3 = kept(l, 3, 2) - (sine*kept(l, 2, 2) + versine*kept(l, 3, 2))
      back(l, 1, 1) = t1; back(l, 2, 1) = t2; back(l, 3, 1) = t3
      back(l, 1, 2) = b1; back(l, 2, 2) = b2; back(l, 3, 2) = b3
      back(l, 1, 3) = kept(l, 1, 3)
      back(l, 2, 3) = kept(l, 2, 3) + (sine*kept(l, 3, 3) - versine*kept(l, 2, 3))
      back(l, 3, 3) = kept(l, 3, 3) - (sine*kept(l, 2, 3) + versine*kept(l, 3, 3))
      x1 = modes(l, 1) - t1 - b1
      x2 = modes(l, 2) - t2 - b2
      x3 = modes(l, 3) - t3 - b3
      relative(l, 1) = x1; relative(l, 2) = x2; relative(l, 3) = x3
      products(l, 1) = x1*x1 + x2*x2 + x3*x3
      products(l, 2) = x1*t1 + x2*t2 + x3*t3
      products(l, 3) = x1*b1 + x2*b2 + x3*b3
      products(l, 4) = t1*t1 + t2*t2 + t3*t3
      stiffness(l) = fraction(l)*(moduli(2) + (moduli(1) - moduli(2))*x1*x1 &
                                              /max(products(l, 1), least))
    end do
  end subroutine load_points

  !> Does no point lie outside of the yield surface? One that is not a number does.
  pure logical function all_inside(n, yield, squares)
    integer, intent(in) :: n
    real(wp), intent(in) :: yield, squares(n)      !! of the relative stresses
    real(wp) :: n_outside
    integer :: l

    n_outside = 0.0_wp
    !$omp simd reduction(+:n_outside)
    do l = 1, n
      n_outside = n_outside + merge(0.0_wp, 1.0_wp, squares(l) <= yield*yield)
    end do
    all_inside = n_outside <= 0.0_wp
  end function all_inside

  !> Put the points back into their row, and let q follow beta.
  pure subroutine store_points(n_row, n, fraction, dgamma, share, strain, back, modes, eqps, kept)
    integer, intent(in) :: n_row, n
    real(wp), intent(in), dimension(n) :: fraction, dgamma, share
    real(wp), intent(in) :: strain(n, 3), back(n, 3, 3)
    real(wp), intent(inout) :: modes(n_row, *), eqps(n), kept(n_row, 3, *)
    integer :: l

    !$omp simd
    do l = 1, n
      eqps(l) = eqps(l) + dgamma(l)
      modes(l, 1) = fraction(l)*strain(l, 1)
      modes(l, 2) = fraction(l)*strain(l, 2)
      modes(l, 3) = fraction(l)*strain(l, 3)
      kept(l, 1, 1) = back(l, 1, 1); kept(l, 2, 1) = back(l, 2, 1); kept(l, 3, 1) = back(l, 3, 1)
      kept(l, 1, 2) = back(l, 1, 2); kept(l, 2, 2) = back(l, 2, 2); kept(l, 3, 2) = back(l, 3, 2)
      kept(l, 1, 3) = back(l, 1, 3) + share(l)*(back(l, 1, 2) - back(l, 1, 3))
      kept(l, 2, 3) = back(l, 2, 3) + share(l)*(back(l, 2, 2) - back(l, 2, 3))
      kept(l, 3, 3) = back(l, 3, 3) + share(l)*(back(l, 3, 2) - back(l, 3, 3))
    end do
  end subroutine store_points

  !> Products of `find_root`: the first mode and the others.
  pure function grouped(relative, back) result(groups)
    real(wp), intent(in) :: relative(3), back(3, 3)
    real(wp) :: groups(6, 2), products(3, 6)

    products(:, 1) = relative**2
    products(:, 2) = relative*back(:, 1)
    products(:, 3) = relative*back(:, 2)
    products(:, 4) = back(:, 1)**2
    products(:, 5) = back(:, 1)*back(:, 2)
    products(:, 6) = back(:, 2)**2
    groups(:, 1) = products(1, :)
    groups(:, 2) = products(2, :) + products(3, :)
  end function grouped

  !> beta fades least, and so keeps least of its shear.
  pure function shear_warning(self) result(warning)
    class(yoshida_uemori_t), intent(in) :: self
    character(:), allocatable :: warning

    associate (m => self%surfaces%rate)
      warning = "back stresses rotate with the spin (Jaumann rate), so the shear stress is too "// &
                "low: of beta, with m "//rounded_text(m)//", continued simple shear leaves "// &
                to_text(nint(100*m**2/(m**2 + 3.0_wp)))//" %"
    end associate
  end function shear_warning

end module yoshida_uemori
