!> The return to the yield surface of the model of Yoshida and Uemori, see `yoshida_uemori`: the
!! equations for dp and u, a row of points at a time, and the growth of the bounding surface.
module two_surface
  use kinds, only: wp
  implicit none
  private

  public :: begin_return, step_in_space, step_in_sheet, find_root, grow_bound

  integer, parameter, public :: max_iterations = 30   !! of Newton's method

  real(wp), parameter, public :: least = 1.0e-60_wp   !! square of a stress that counts as none
  real(wp), parameter :: just_above = 1.0e-13_wp      ! over the yield stress, so left alone
  integer, parameter :: n_halvings = 1100             ! down to zero
  real(wp), parameter :: near = 1.0e-7_wp             ! residual over Y whose square is lost in
                                                      ! the digits

  type, public :: two_surface_t
    real(wp) :: yield = 0.0_wp          !! Y [stress]
    real(wp) :: bound = 0.0_wp          !! B, first size of the bounding surface [stress]
    real(wp) :: approach = 0.0_wp       !! C, rate at which the yield surface comes near to it
    real(wp) :: rate = 0.0_wp           !! m, of its hardening
    real(wp) :: shift = 0.0_wp          !! b, where beta ends [stress]
    real(wp) :: growth = 0.0_wp         !! h, of the region without isotropic hardening
    real(wp) :: saturation = 0.0_wp     !! R_sat [stress]
  end type two_surface_t

contains

  !> What the steps of a row start from: dp and u by slopes at the start of the increment. Points
  !! that do not yield are closed.
  pure subroutine begin_return(self, n, stiffness, products, size, speeds, dgamma, fade, open)
    type(two_surface_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: stiffness(n)       !! what |xi| loses with dp by elasticity
    real(wp), intent(in) :: products(n, 6)     !! of `relative_products`
    real(wp), intent(in) :: size(n)            !! R
    real(wp), intent(out) :: speeds(n, 2)      !! C a and C sqrt(a)
    real(wp), intent(out) :: dgamma(n), fade(n), open(n)   !! fade: u; open: 1 yields, 0 does not
    real(wp) :: yield, room, approach, rate, shift, a, norm, over, along, s, per, slope, d
    integer :: l

    yield = self%yield
    room = self%bound - self%yield
    approach = self%approach
    rate = self%rate
    shift = self%shift
    !$omp simd private(a, norm, over, along, s, per, slope, d)
    do l = 1, n
      a = max(room + size(l), 0.0_wp)
      speeds(l, 1) = approach*a
      speeds(l, 2) = approach*sqrt(a)
      ! What is not a number stays open: max() would drop it.
      norm = sqrt(products(l, 1) + least)
      s = sqrt(sqrt(products(l, 4) + least))
      per = 1.0_wp/(norm*s)
      over = norm - yield
      open(l) = merge(0.0_wp, 1.0_wp, over <= just_above*yield)
      along = products(l, 2)*(per*s)
      slope = stiffness(l) + speeds(l, 1) + rate*shift - rate*products(l, 3)*(per*s) &
              - speeds(l, 2)*along*(per*norm)
      d = open(l)*over/max(slope, 0.5_wp*stiffness(l))
      dgamma(l) = d
      ! s after dp, by its slope at the start: 2 s ds = (C a n.theta/|theta| - C sqrt(a) s) dp.
      s = max(0.5_wp*s, s + 0.5_wp*d*(speeds(l, 1)*along*(per*norm)**3 - speeds(l, 2)))
      fade(l) = speeds(l, 2)*d/(speeds(l, 2)*d + s)
    end do
  end subroutine begin_return

  !> u after dp, and its derivatives with respect to dp and n.theta.
  pure subroutine fade_theta(ca, ck, square, along, d, u, by_d, by_along)
    real(wp), intent(in) :: ca, ck             !! C a and C sqrt(a)
    real(wp), intent(in) :: square, along      !! |theta|^2, n.theta
    real(wp), intent(in) :: d                  !! dp
    real(wp), intent(out) :: u, by_d, by_along
    real(wp) :: k, grown, t, root, s, per, per_t

    k = ck*d
    grown = ca*d
    t = sqrt(max(square + grown*(2.0_wp*along + grown), least))
    root = sqrt(k*k + 4.0_wp*t)
    ! 1/(t root) and 1/(s + k) by one division, for 2 (s + k) = k + root.
    per = 1.0_wp/((k + root)*(t*root))
    per_t = (k + root)*per
    per = 2.0_wp*(t*root)*per
    s = t*per
    u = k*per
    by_d = (ck*s - k*per_t*(ca*(along + grown) - ck*s*t))*per*per
    by_along = -k*grown*per_t*per*per
  end subroutine fade_theta

  !> One step of Newton's method for the points of a row that are open. A step from residuals whose
  !! squares are lost in the digits is the last of its point.
  pure subroutine step_in_space(self, n, shear3, products, speeds, dgamma, fade, open, n_open)
    type(two_surface_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: shear3(n), products(n, 6), speeds(n, 2)
    real(wp), intent(inout) :: dgamma(n), fade(n), open(n)   !! fade: u
    real(wp), intent(out) :: n_open            !! points left
    real(wp) :: yield, rate, shift, d, u, v, v1, x1, x2, per, norm, grown, along, target, by_d, &
                by_along, part, lag, residual, fall, step
    integer :: l

    yield = self%yield
    rate = self%rate
    shift = self%shift
    n_open = 0.0_wp
    !$omp simd private(d, u, v, v1, x1, x2, per, norm, grown, along, target, by_d, by_along, &
    !$omp part, lag, residual, fall, step) reduction(+:n_open)
    do l = 1, n
      d = dgamma(l)
      u = fade(l)
      per = 1.0_wp/(1.0_wp + rate*d)
      v = rate*d*per
      v1 = rate*per*per
      ! Products of xi with theta and beta.
      x1 = products(l, 2) + u*products(l, 4) + v*products(l, 5)
      x2 = products(l, 3) + u*products(l, 5) + v*products(l, 6)
      norm = sqrt(max(products(l, 1) + u*(products(l, 2) + x1) + v*(products(l, 3) + x2), least))
      per = 1.0_wp/norm
      along = x1*per
      x2 = x2*per
      call fade_theta(speeds(l, 1), speeds(l, 2), products(l, 4), along, d, target, by_d, by_along)
      part = 1.0_wp - min(by_along*(products(l, 4) - along*along)*per, 0.0_wp)
      by_d = by_d + by_along*v1*(products(l, 5) - along*x2)*per
      grown = speeds(l, 1)*d
      residual = norm - yield - shear3(l)*d - (1.0_wp - u)*grown - shift*v
      lag = target - u
      ! Both unknowns by one division: 1/fall and 1/part.
      fall = part*(shear3(l) + (1.0_wp - u)*speeds(l, 1) + v1*(shift - x2)) - (along + grown)*by_d
      fall = max(fall, 0.1_wp*part*shear3(l))
      per = 1.0_wp/(part*fall)
      step = open(l)*max((part*residual + (along + grown)*lag)*(part*per), -0.9_wp*d)
      dgamma(l) = d + step
      fade(l) = min(max(u + (open(l)*lag + by_d*step)*(fall*per), 0.0_wp), 1.0_wp)
      open(l) = merge(0.0_wp, open(l), abs(residual) <= near*yield .and. abs(lag) <= near)
      n_open = n_open + open(l)
    end do
  end subroutine step_in_space

  !> `step_in_space` towards 1 - 1/sqrt(P) = 0, P = sum (xi/X)^2 over the modes, X = Y + (modulus +
  !! (1 - u) C a) dp + b v. It is nearly linear in dp.
  pure subroutine step_in_sheet(self, n, moduli, relative, back, speeds, dgamma, fade, open, n_open)
    type(two_surface_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(n, 2), relative(n, 3), back(n, 3, 3), speeds(n, 2)
    real(wp), intent(inout) :: dgamma(n), fade(n), open(n)
    real(wp), intent(out) :: n_open
    real(wp) :: yield, rate, shift, d, u, v, v1, per, per1, per2, x, x1, g1, g2, g3, u1, u2, u3, &
                d1, d2, d3, left, residual, pu, pd, along, target, by_d, by_along, part, lag, &
                fall, step, square
    integer :: l

    yield = self%yield
    rate = self%rate
    shift = self%shift
    n_open = 0.0_wp
    !$omp simd private(d, u, v, v1, per, per1, per2, x, x1, g1, g2, g3, u1, u2, u3, d1, d2, d3, &
    !$omp left, residual, pu, pd, along, target, by_d, by_along, part, lag, fall, step, square) &
    !$omp reduction(+:n_open)
    do l = 1, n
      d = dgamma(l)
      u = fade(l)
      per = 1.0_wp/(1.0_wp + rate*d)
      v = rate*d*per
      v1 = rate*per*per
      x = yield + (1.0_wp - u)*speeds(l, 1)*d + shift*v
      x1 = (1.0_wp - u)*speeds(l, 1) + shift*v1
      per = 1.0_wp/((x + moduli(l, 1)*d)*(x + moduli(l, 2)*d))
      per1 = (x + moduli(l, 2)*d)*per
      per2 = (x + moduli(l, 1)*d)*per
      ! xi/X, and its derivatives with respect to u and dp.
      g1 = (relative(l, 1) + u*back(l, 1, 1) + v*back(l, 1, 2))*per1
      g2 = (relative(l, 2) + u*back(l, 2, 1) + v*back(l, 2, 2))*per2
      g3 = (relative(l, 3) + u*back(l, 3, 1) + v*back(l, 3, 2))*per2
      u1 = (back(l, 1, 1) + speeds(l, 1)*d*g1)*per1
      u2 = (back(l, 2, 1) + speeds(l, 1)*d*g2)*per2
      u3 = (back(l, 3, 1) + speeds(l, 1)*d*g3)*per2
      d1 = (v1*back(l, 1, 2) - (x1 + moduli(l, 1))*g1)*per1
      d2 = (v1*back(l, 2, 2) - (x1 + moduli(l, 2))*g2)*per2
      d3 = (v1*back(l, 3, 2) - (x1 + moduli(l, 2))*g3)*per2
      residual = sqrt(max(g1*g1 + g2*g2 + g3*g3, least))
      left = 1.0_wp/residual
      residual = residual - 1.0_wp
      pu = left*left*(g1*u1 + g2*u2 + g3*u3)
      pd = left*left*(g1*d1 + g2*d2 + g3*d3)
      along = left*(g1*back(l, 1, 1) + g2*back(l, 2, 1) + g3*back(l, 3, 1))
      square = back(l, 1, 1)**2 + back(l, 2, 1)**2 + back(l, 3, 1)**2
      call fade_theta(speeds(l, 1), speeds(l, 2), square, along, d, target, by_d, by_along)
      part = by_along*(left*(u1*back(l, 1, 1) + u2*back(l, 2, 1) + u3*back(l, 3, 1)) - along*pu)
      part = 1.0_wp - min(part, 0.0_wp)
      by_d = by_d + by_along*(left*(d1*back(l, 1, 1) + d2*back(l, 2, 1) + d3*back(l, 3, 1)) &
                              - along*pd)
      lag = target - u
      fall = max(-(part*pd + pu*by_d), 0.1_wp*part*moduli(l, 1)*per2)
      per = 1.0_wp/(part*fall)
      step = open(l)*max((part*residual + pu*lag)*(part*per), -0.9_wp*d)
      dgamma(l) = d + step
      fade(l) = min(max(u + (open(l)*lag + by_d*step)*(fall*per), 0.0_wp), 1.0_wp)
      open(l) = merge(0.0_wp, open(l), abs(residual) <= near .and. abs(lag) <= near)
      n_open = n_open + open(l)
    end do
  end subroutine step_in_sheet

  !> The root by halving, for a point where Newton's method does not end: of 1 - 1/sqrt(P), which
  !! falls with dp, and for each dp of u after dp less u, which falls with u.
  pure subroutine find_root(self, moduli, groups, speeds, dgamma, fade, ok)
    type(two_surface_t), intent(in) :: self
    real(wp), intent(in) :: moduli(2)          !! of two groups of modes
    real(wp), intent(in) :: groups(6, 2)       !! their parts of the products of `relative_products`
    real(wp), intent(in) :: speeds(2)          !! C a and C sqrt(a)
    real(wp), intent(out) :: dgamma, fade      !! dp, u
    logical, intent(out) :: ok
    real(wp) :: low, high, total(6), norm
    integer :: i

    total = sum(groups, 2)
    low = 0.0_wp
    high = (sqrt(max(total(1), 0.0_wp)) + sqrt(2.0_wp*(total(4) + total(6))) - self%yield) &
           /minval(moduli)
    ok = high <= huge(high)
    dgamma = high
    fade = 0.0_wp
    do i = 1, n_halvings
      dgamma = 0.5_wp*(low + high)
      if (.not. ok .or. dgamma <= low .or. dgamma >= high) exit
      call fade_alone(self, moduli, groups, speeds, dgamma, fade, norm)
      if (norm > 1.0_wp) then
        low = dgamma
      else
        high = dgamma
      end if
    end do
  end subroutine find_root

  !> u of this dp, and the root of P there.
  pure subroutine fade_alone(self, moduli, groups, speeds, d, fade, norm)
    type(two_surface_t), intent(in) :: self
    real(wp), intent(in) :: moduli(2), groups(6, 2), speeds(2), d   !! as in `find_root`
    real(wp), intent(out) :: fade, norm
    real(wp) :: low, high, v, x(2), product(2), square(2), target, by_d, by_along
    integer :: i

    low = 0.0_wp
    high = 1.0_wp
    v = self%rate*d/(1.0_wp + self%rate*d)
    do i = 1, n_halvings
      fade = 0.5_wp*(low + high)
      x = self%yield + ((1.0_wp - fade)*speeds(1) + moduli)*d + self%shift*v
      ! xi.theta and |xi|^2.
      product = groups(2, :) + fade*groups(4, :) + v*groups(5, :)
      square = groups(1, :) + fade*(groups(2, :) + product) &
               + v*(2.0_wp*groups(3, :) + fade*groups(5, :) + v*groups(6, :))
      norm = sqrt(max(sum(square/x**2), least))
      if (fade <= low .or. fade >= high) exit
      call fade_theta(speeds(1), speeds(2), sum(groups(4, :)), sum(product/x)/norm, d, target, &
                      by_d, by_along)
      if (target > fade) then
        low = fade
      else
        high = fade
      end if
    end do
  end subroutine fade_alone

  !> R and r after an increment. What beta moves after it has reached g counts as a part f of dp.
  !! Where b = 0 there is no beta, and R always grows.
  pure subroutine grow_bound(self, n, dgamma, products, size, radius, share)
    type(two_surface_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dgamma(n)
    real(wp), intent(in) :: products(n, 3)     !! of beta - q at the start and the change of beta
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
      distance = sqrt(max(products(l, 1) + 2.0_wp*products(l, 2) + products(l, 3), least))
      over = merge(max(distance - radius(l), 0.0_wp), 0.0_wp, dgamma(l) > 0.0_wp)
      ! Part of the move inside g: |beta - q + part (change)| = r from beta at the start.
      moved = max(products(l, 3), least)
      before = products(l, 2)
      part = min(products(l, 1) - radius(l)**2, 0.0_wp)
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

end module two_surface
