!> The return to the yield surface of the model of Yoshida and Uemori, see `yoshida_uemori`: the
!! equations for dp and s, a row of points at a time, and the growth of the bounding surface.
module two_surface
  use kinds, only: wp
  implicit none
  private

  public :: begin_return, step_in_space, step_in_sheet, flow_in_sheet, find_root, grow_bound

  integer, parameter, public :: max_iterations = 30   !! of Newton's method

  real(wp), parameter, public :: least = 1.0e-60_wp   !! square of a stress that counts as none
  real(wp), parameter :: just_above = 1.0e-13_wp      ! over the yield stress, so left alone
  integer, parameter :: n_halvings = 1100             ! down to zero
  real(wp), parameter :: least_root = 1.0e-15_wp      ! of that stress
  real(wp), parameter :: near = 1.0e-6_wp             ! residual over Y whose square is lost in
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

  !> What the steps of a row start from: dp by slopes at the start of the increment, and s after it.
  !! Points that do not yield are closed.
  pure subroutine begin_return(self, n, stiffness, products, size, speeds, dgamma, root, open)
    type(two_surface_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: stiffness(n)       !! what |xi| loses with dp by elasticity
    real(wp), intent(in) :: products(n, 4)     !! of `relative_products`, the first ones
    real(wp), intent(in) :: size(n)            !! R
    real(wp), intent(out) :: speeds(n, 2)      !! C a and C sqrt(a)
    real(wp), intent(out) :: dgamma(n), root(n), open(n)   !! root: s; open: 1 yields, 0 does not
    real(wp) :: yield, room, approach, rate, shift, lowest, a, norm, over, along, s, per, slope, &
                d, grown
    integer :: l

    yield = self%yield
    room = self%bound - self%yield
    approach = self%approach
    rate = self%rate
    shift = self%shift
    lowest = merge(0.2_wp, 0.0_wp, approach > 0.0_wp)
    !$omp simd private(a, norm, over, along, s, per, slope, d, grown)
    do l = 1, n
      a = max(room + size(l), 0.0_wp)
      speeds(l, 1) = approach*a
      a = sqrt(a)
      speeds(l, 2) = approach*a
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
      ! A step of Newton's method with n of the start, from where it does not go far.
      grown = speeds(l, 1)*d
      d = speeds(l, 2)*d
      s = max(s, lowest*a)
      slope = s*(s + d)
      root(l) = s + 0.5_wp*(products(l, 4) + grown*(2.0_wp*along + grown) + least - slope*slope) &
                    /(slope*(s + (s + d)))
    end do
  end subroutine begin_return

  !> One step of Newton's method for the points of a row that are open, towards |xi| and s. A step
  !! from residuals whose squares are lost in the digits is the last of its point.
  pure subroutine step_in_space(self, n, shear3, products, speeds, dgamma, root, open, n_open)
    type(two_surface_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: shear3(n), products(n, 6), speeds(n, 2)
    real(wp), intent(inout) :: dgamma(n), root(n), open(n)   !! root: s
    real(wp), intent(out) :: n_open            !! points left
    real(wp) :: yield, rate, shift, d, s, k, u, v, v1, u_s, u_d, x1, x2, per, norm, grown, along, &
                w, a, a_d, a_s, h, h_u, h_d, h_s, fall
    integer :: l

    yield = self%yield
    rate = self%rate
    shift = self%shift
    n_open = 0.0_wp
    !$omp simd private(d, s, k, u, v, v1, u_s, u_d, x1, x2, per, norm, grown, along, w, a, a_d, &
    !$omp a_s, h, h_u, h_d, h_s, fall) reduction(+:n_open)
    do l = 1, n
      d = dgamma(l)
      s = root(l)
      k = speeds(l, 2)*d
      ! u, v and their slopes.
      w = 1.0_wp + rate*d
      per = 1.0_wp/(w*(s + k))
      v1 = (s + k)*per
      v = rate*d*v1
      v1 = rate*v1*v1
      per = w*per
      u = k*per
      u_s = -u*per
      u_d = speeds(l, 2)*s*per*per
      ! Products of xi with theta and beta.
      x1 = products(l, 2) + u*products(l, 4) + v*products(l, 5)
      x2 = products(l, 3) + u*products(l, 5) + v*products(l, 6)
      norm = sqrt(max(products(l, 1) + u*(products(l, 2) + x1) + v*(products(l, 3) + x2), least))
      per = 1.0_wp/norm
      along = x1*per
      x2 = x2*per
      grown = speeds(l, 1)*d
      a = norm - yield - shear3(l)*d - (1.0_wp - u)*grown - shift*v
      a_s = along + grown
      a_d = x2*v1 - shear3(l) - (1.0_wp - u)*speeds(l, 1) - shift*v1 + a_s*u_d
      w = s*(s + k)
      h = w*w - (products(l, 4) + grown*(along + a_s) + least)
      h_u = -2.0_wp*grown*max(products(l, 4) - along*along, 0.0_wp)*per
      h_d = 2.0_wp*(w*s*speeds(l, 2) - speeds(l, 1)*a_s &
                    - grown*(products(l, 5) - along*x2)*per*v1) + h_u*u_d
      h_s = 2.0_wp*w*(s + (s + k)) + h_u*u_s
      a_s = a_s*u_s
      fall = max(a_s*h_d - a_d*h_s, 0.1_wp*shear3(l)*h_s)
      per = open(l)/fall
      dgamma(l) = d + max((a*h_s - a_s*h)*per, -0.9_wp*d)
      root(l) = s + max((a_d*h - a*h_d)*per, -0.9_wp*open(l)*s)
      open(l) = merge(0.0_wp, open(l), abs(a) <= near*yield .and. abs(h) <= near*w*w)
      n_open = n_open + open(l)
    end do
  end subroutine step_in_space

  !> u, v and one over both X of `step_in_sheet`, by one division: times (1 + m dp)(s + k) the X are
  !! polynomials.
  pure subroutine find_fading(self, d, s, k, grown, e1, e2, u, v, per_s, per_d, per1, per2)
    type(two_surface_t), intent(in) :: self
    real(wp), intent(in) :: d, s, k, grown     !! dp, s, C sqrt(a) dp, C a dp
    real(wp), intent(in) :: e1, e2             !! moduli of the modes
    real(wp), intent(out) :: u, v, per_s, per_d, per1, per2   !! per_s: 1/(s + k), per_d:
                                                              !! 1/(1 + m dp), 1/X
    real(wp) :: w, y, x, z1, z2, per

    w = 1.0_wp + self%rate*d
    y = s + k
    x = w*(y*self%yield + s*grown) + self%shift*self%rate*d*y
    z1 = x + w*y*(e1*d)
    z2 = x + w*y*(e2*d)
    per = 1.0_wp/(w*y*(z1*z2))
    x = w*y*(w*y)*per
    per1 = z2*x
    per2 = z1*x
    per = per*(z1*z2)
    per_d = y*per
    per_s = w*per
    u = k*per_s
    v = self%rate*d*per_d
  end subroutine find_fading

  !> `step_in_space` towards P = 1, P = sum (xi/X)^2 over the modes, X = Y + (modulus + (1 - u) C a)
  !! dp + b v. The step is that of 1 - 1/sqrt(P), which is nearly linear in dp, with the root as in
  !! `plane_steps`; n is xi/X.
  pure subroutine step_in_sheet(self, n, moduli, fraction, relative, back, speeds, dgamma, root, &
                                open, n_open)
    type(two_surface_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(2)          !! of the first mode, of the others
    real(wp), intent(in) :: fraction(n)        !! of the moduli
    real(wp), intent(in) :: relative(n, 3), back(n, 3, 3), speeds(n, 2)
    real(wp), intent(inout) :: dgamma(n), root(n), open(n)
    real(wp), intent(out) :: n_open
    real(wp) :: rate, shift, e1, e2, d, s, k, w, u, v, v1, u_s, u_d, x, y, per, per1, per2, grown, &
                g1, g2, g3, u1, u2, u3, d1, d2, d3, p, p_u, p_d, along, h, h_u, h_d, &
                h_s, fall
    integer :: l

    rate = self%rate
    shift = self%shift
    n_open = 0.0_wp
    !$omp simd private(e1, e2, d, s, k, w, u, v, v1, u_s, u_d, x, y, per, per1, per2, grown, &
    !$omp g1, g2, g3, u1, u2, u3, d1, d2, d3, p, p_u, p_d, along, h, h_u, h_d, h_s, fall) &
    !$omp reduction(+:n_open)
    do l = 1, n
      d = dgamma(l)
      s = root(l)
      k = speeds(l, 2)*d
      grown = speeds(l, 1)*d
      e1 = fraction(l)*moduli(1)
      e2 = fraction(l)*moduli(2)
      call find_fading(self, d, s, k, grown, e1, e2, u, v, per, v1, per1, per2)
      v1 = rate*v1*v1
      u_s = -u*per
      u_d = speeds(l, 2)*s*per*per
      ! n, and its derivatives with respect to u and dp.
      x = (1.0_wp - u)*speeds(l, 1) + shift*v1
      g1 = (relative(l, 1) + u*back(l, 1, 1) + v*back(l, 1, 2))*per1
      g2 = (relative(l, 2) + u*back(l, 2, 1) + v*back(l, 2, 2))*per2
      g3 = (relative(l, 3) + u*back(l, 3, 1) + v*back(l, 3, 2))*per2
      u1 = (back(l, 1, 1) + grown*g1)*per1
      u2 = (back(l, 2, 1) + grown*g2)*per2
      u3 = (back(l, 3, 1) + grown*g3)*per2
      d1 = (v1*back(l, 1, 2) - (x + e1)*g1)*per1
      d2 = (v1*back(l, 2, 2) - (x + e2)*g2)*per2
      d3 = (v1*back(l, 3, 2) - (x + e2)*g3)*per2
      p = g1*g1 + g2*g2 + g3*g3
      p_u = 2.0_wp*(g1*u1 + g2*u2 + g3*u3)
      p_d = 2.0_wp*(g1*d1 + g2*d2 + g3*d3)
      ! Of unit length, next to P = 1.
      along = max(1.5_wp - 0.5_wp*p, 0.25_wp) &
              *(g1*back(l, 1, 1) + g2*back(l, 2, 1) + g3*back(l, 3, 1))
      w = s*(s + k)
      x = along + grown
      h = w*w - (back(l, 1, 1)**2 + back(l, 2, 1)**2 + back(l, 3, 1)**2 + grown*(along + x) + least)
      h_u = u1*back(l, 1, 1) + u2*back(l, 2, 1) + u3*back(l, 3, 1) - 0.5_wp*along*p_u
      h_u = -2.0_wp*grown*h_u
      h_d = d1*back(l, 1, 1) + d2*back(l, 2, 1) + d3*back(l, 3, 1) - 0.5_wp*along*p_d
      h_d = 2.0_wp*(w*s*speeds(l, 2) - speeds(l, 1)*x - grown*h_d) + h_u*u_d
      h_s = w*(s + (s + k))
      h_s = max(2.0_wp*h_s + h_u*u_s, h_s)
      p_d = p_d + p_u*u_d
      p_u = p_u*u_s
      fall = max(p_u*h_d - p_d*h_s, 0.2_wp*p*e1*per2*h_s)
      x = p - 1.0_wp
      y = 4.0_wp*p*x
      w = near*w*w
      per = open(l)/((3.0_wp + p)*fall + (1.0_wp - open(l)))
      dgamma(l) = d + max((y*h_s - (3.0_wp + p)*p_u*h)*per, -0.9_wp*d)
      root(l) = s + max(((3.0_wp + p)*p_d*h - y*h_d)*per, -0.9_wp*open(l)*s)
      open(l) = merge(0.0_wp, open(l), abs(x) <= 2.0_wp*near .and. abs(h) <= w)
      n_open = n_open + open(l)
    end do
  end subroutine step_in_sheet

  !> Plastic strain of a row, theta and beta after it, and the products that `grow_bound` needs.
  pure subroutine flow_in_sheet(self, n, moduli, fraction, speeds, dgamma, root, modes, back, &
                                products)
    type(two_surface_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: moduli(2), fraction(n), speeds(n, 2), dgamma(n), root(n)
    real(wp), intent(inout) :: modes(n, 3)     !! relative, out of the plastic strain
    real(wp), intent(inout) :: back(n, 3, 3)
    real(wp), intent(out) :: products(n, 3)
    real(wp) :: shift, d, grown, u, v, per_s, per_d, per1, per2, g1, g2, g3, c1, c2, c3, x1, x2, x3
    integer :: l

    shift = self%shift
    !$omp simd private(d, grown, u, v, per_s, per_d, per1, per2, g1, g2, g3, c1, c2, c3, x1, x2, x3)
    do l = 1, n
      d = dgamma(l)
      grown = speeds(l, 1)*d
      call find_fading(self, d, root(l), speeds(l, 2)*d, grown, fraction(l)*moduli(1), &
                       fraction(l)*moduli(2), u, v, per_s, per_d, per1, per2)
      g1 = (modes(l, 1) + u*back(l, 1, 1) + v*back(l, 1, 2))*per1
      g2 = (modes(l, 2) + u*back(l, 2, 1) + v*back(l, 2, 2))*per2
      g3 = (modes(l, 3) + u*back(l, 3, 1) + v*back(l, 3, 2))*per2
      modes(l, 1) = d*g1; modes(l, 2) = d*g2; modes(l, 3) = d*g3
      back(l, 1, 1) = (1.0_wp - u)*(back(l, 1, 1) + grown*g1)
      back(l, 2, 1) = (1.0_wp - u)*(back(l, 2, 1) + grown*g2)
      back(l, 3, 1) = (1.0_wp - u)*(back(l, 3, 1) + grown*g3)
      c1 = v*(shift*g1 - back(l, 1, 2))
      c2 = v*(shift*g2 - back(l, 2, 2))
      c3 = v*(shift*g3 - back(l, 3, 2))
      x1 = back(l, 1, 2) - back(l, 1, 3)
      x2 = back(l, 2, 2) - back(l, 2, 3)
      x3 = back(l, 3, 2) - back(l, 3, 3)
      back(l, 1, 2) = back(l, 1, 2) + c1
      back(l, 2, 2) = back(l, 2, 2) + c2
      back(l, 3, 2) = back(l, 3, 2) + c3
      products(l, 1) = x1*x1 + x2*x2 + x3*x3
      products(l, 2) = x1*c1 + x2*c2 + x3*c3
      products(l, 3) = c1*c1 + c2*c2 + c3*c3
    end do
  end subroutine flow_in_sheet

  !> The root by halving, for a point where Newton's method does not end: of 1 - 1/sqrt(P), which
  !! falls with dp, and for each dp of u after dp less u, which falls with u.
  pure subroutine find_root(self, moduli, groups, speeds, dgamma, root, ok)
    type(two_surface_t), intent(in) :: self
    real(wp), intent(in) :: moduli(2)          !! of two groups of modes
    real(wp), intent(in) :: groups(6, 2)       !! their parts of the products of `relative_products`
    real(wp), intent(in) :: speeds(2)          !! C a and C sqrt(a)
    real(wp), intent(out) :: dgamma, root      !! dp, s
    logical, intent(out) :: ok
    real(wp) :: low, high, total(6), norm, fade
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
    root = max(speeds(2)*dgamma*(1.0_wp - fade)/max(fade, tiny(fade)), least_root)
  end subroutine find_root

  !> u of this dp, and the root of P there.
  pure subroutine fade_alone(self, moduli, groups, speeds, d, fade, norm)
    type(two_surface_t), intent(in) :: self
    real(wp), intent(in) :: moduli(2), groups(6, 2), speeds(2), d   !! as in `find_root`
    real(wp), intent(out) :: fade, norm
    real(wp) :: low, high, grown, k, v, x(2), product(2), square(2), target
    integer :: i

    grown = speeds(1)*d
    k = speeds(2)*d
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
      target = sum(groups(4, :)) + grown*(2.0_wp*sum(product/x)/norm + grown)
      target = 2.0_wp*k/(k + sqrt(k*k + 4.0_wp*sqrt(max(target, least))))
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
    real(wp) :: rate, growth, saturation, always, distance, per, over, moved, before, root, &
                inside, part, grown
    integer :: l

    rate = self%rate
    growth = self%growth
    saturation = self%saturation
    always = merge(1.0_wp, 0.0_wp, self%shift <= 0.0_wp)
    !$omp simd private(distance, per, over, moved, before, root, inside, part, grown)
    do l = 1, n
      distance = sqrt(max(products(l, 1) + 2.0_wp*products(l, 2) + products(l, 3), least))
      over = merge(max(distance - radius(l), 0.0_wp), 0.0_wp, dgamma(l) > 0.0_wp)
      ! Part of the move inside g: |beta - q + part (change)| = r from beta at the start.
      moved = max(products(l, 3), least)
      before = products(l, 2)
      inside = max(radius(l)**2 - products(l, 1), 0.0_wp)
      root = sqrt(before**2 + moved*inside)
      inside = merge(inside, root - before, before > 0.0_wp)
      moved = merge(root + before, moved, before > 0.0_wp)
      per = 1.0_wp/(moved*distance)
      part = min(max(1.0_wp - inside*(distance*per), 0.0_wp), 1.0_wp)
      grown = rate*dgamma(l)*max(merge(part, 0.0_wp, over > 0.0_wp), always)
      size(l) = size(l) + grown*(saturation - size(l))/(1.0_wp + grown)
      radius(l) = radius(l) + growth*over
      share(l) = (1.0_wp - growth)*over*(moved*per)
    end do
  end subroutine grow_bound

end module two_surface
