!> Return to a quadratic yield surface in plane stress, with any flow curve and with back stresses,
!! a row of points at a time.
!!
!! In the modes of the yield function backward Euler leaves one equation (J. C. Simo and R. L.
!! Taylor, IJNME 22 (1986)): the equivalent stress is the root of the sum of the squares of the
!! modes, and the return multiplies each mode by flow/X with X = flow + modulus dgamma. For von
!! Mises the modes are those of `plane_trial`, their moduli E/(2 (1 - nu)), 3G, 3G.
!!
!! A back stress, of von Mises only, counts in the sheet as the plane stress of which it is the
!! deviator. The modes are then those of the relative stress, and each modulus grows by
!! sum theta C, where theta = 1/(1 + gamma dgamma) is what is left of a back stress.
module plane_return
  use kinds, only: wp
  use flow_curve, only: flow_curve_t, flow_at, flow_after, is_rough
  use hardening, only: back_stresses_t
  use consistency, only: begin_at, advance, max_iterations
  use row_functions, only: are_numbers
  use plane_steps, only: first_step, next_step, strain_of_modes, just_above
  implicit none
  private

  public :: find_plane_flow, plane_back_stresses, add_plane_back_stresses

  real(wp), parameter :: root3 = sqrt(3.0_wp)

contains

  !> Plastic flow of a row.
  pure subroutine find_plane_flow(curve, kinematic, moduli, n, dt, eqps, factor, guess, modes, &
                                  back, dgamma, ok)
    type(flow_curve_t), intent(in) :: curve
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: moduli(3)       !! of the modes, the first is the smallest [stress]
    integer, intent(in) :: n
    real(wp), intent(in) :: dt
    real(wp), intent(in), dimension(n) :: eqps, factor, guess   !! see `solve_consistency`
    real(wp), intent(inout) :: modes(n, 3)  !! of the trial stress, out of the plastic strain
    real(wp), intent(inout) :: back(n, 3, kinematic%n)   !! modes, out their change
    real(wp), intent(out) :: dgamma(n)
    logical, intent(out) :: ok
    real(wp), dimension(n) :: start, slope, bend, reach

    call flow_at(curve, n, eqps, factor, start, slope, bend, reach)
    ok = kinematic%n == 0 .and. .not. is_rough(curve)
    if (ok) call climb(curve, moduli, n, dt, eqps, factor, start, slope, bend, modes, dgamma, ok)
    if (.not. ok) call enclose(curve, kinematic, moduli, n, dt, eqps, factor, guess, modes, back, &
                               dgamma, ok)
  end subroutine find_plane_flow

  !> By the steps of `plane_steps`, for smooth flow curves without back stresses.
  pure subroutine climb(curve, moduli, n, dt, eqps, factor, start, slope, bend, modes, dgamma, ok)
    type(flow_curve_t), intent(in) :: curve
    real(wp), intent(in) :: moduli(3)
    integer, intent(in) :: n
    real(wp), intent(in) :: dt
    real(wp), intent(in), dimension(n) :: eqps, factor, start
    real(wp), intent(inout), dimension(n) :: slope, bend
    real(wp), intent(inout) :: modes(n, 3)
    real(wp), intent(out) :: dgamma(n)
    logical, intent(out) :: ok
    integer, parameter :: most_steps = 15
    real(wp), dimension(n) :: flow, reach
    real(wp) :: most, left
    integer :: iteration

    call first_step(n, moduli, modes, start, slope, bend, dgamma, most)
    flow = start
    ok = .not. most > 0.0_wp
    do iteration = 1, most_steps
      if (ok) exit
      call flow_after(curve, n, dt, eqps, factor, start, dgamma, flow, slope, bend, reach)
      call next_step(n, moduli, modes, slope, bend, flow, dgamma, most, left)
      ok = left <= 0.0_wp
    end do
    ok = ok .and. are_numbers(n, dgamma)
    if (ok) call strain_of_modes(n, moduli, flow, dgamma, modes)
  end subroutine climb

  !> In a bracket: the root of 1 - 1/sqrt(P), where sqrt(P) is the new equivalent stress over the
  !! flow stress. That falls all the way where back stresses stay below C/gamma.
  pure subroutine enclose(curve, kinematic, moduli, n, dt, eqps, factor, guess, modes, back, &
                          dgamma, ok)
    type(flow_curve_t), intent(in) :: curve
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: moduli(3)
    integer, intent(in) :: n
    real(wp), intent(in) :: dt
    real(wp), intent(in), dimension(n) :: eqps, factor, guess
    real(wp), intent(inout) :: modes(n, 3), back(n, 3, kinematic%n)
    real(wp), intent(out) :: dgamma(n)
    logical, intent(out) :: ok
    real(wp), dimension(n) :: low, high, last, start, flow, slope, bend, reach, residual, fall, &
                              curvature, before, whole
    integer :: k, iteration

    call flow_at(curve, n, eqps, factor, start, slope, bend, reach)
    high = norm_of(n, modes - sum(back, 3)) - (1.0_wp + just_above)*start
    fall = norm_of(n, modes) - start
    do k = 1, kinematic%n
      fall = fall + norm_of(n, back(:, :, k))
    end do
    high = merge(fall/moduli(1), 0.0_wp, high > 0.0_wp)
    low = 0.0_wp
    last = 0.0_wp
    whole = 1.0_wp
    fall = moduli(1)
    flow = start
    call begin_at(curve, n, slope, fall, high, guess, dgamma)
    do iteration = 1, max_iterations
      if (iteration > 1 .or. any(dgamma > 0.0_wp)) &
        call flow_after(curve, n, dt, eqps, factor, start, dgamma, flow, slope, bend, reach)
      call evaluate(kinematic, moduli, n, modes, back, dgamma, flow, slope, bend, residual, fall, &
                    curvature)
      before = dgamma
      call advance(curve, n, iteration, whole, residual, fall, curvature, reach, low, high, last, &
                   dgamma, ok)
      if (ok) exit
    end do
    before = dgamma - before
    flow = flow + before*(slope - 0.5_wp*bend*before)
    call find_strain(kinematic, moduli, n, dgamma, flow, modes, back)
  end subroutine enclose

  !> Equivalent stresses.
  pure function norm_of(n, modes) result(norm)
    integer, intent(in) :: n
    real(wp), intent(in) :: modes(n, 3)
    real(wp) :: norm(n)
    integer :: l

    !$omp simd
    do l = 1, n
      norm(l) = sqrt(modes(l, 1)**2 + modes(l, 2)**2 + modes(l, 3)**2)
    end do
  end function norm_of

  !> Residual of the equation, by how much it falls with `dgamma` and how this fall fades.
  pure subroutine evaluate(kinematic, moduli, n, modes, back, dgamma, flow, slope, bend, residual, &
                           fall, curvature)
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: moduli(3)
    integer, intent(in) :: n
    real(wp), intent(in) :: modes(n, 3), back(n, 3, kinematic%n)
    real(wp), intent(in), dimension(n) :: dgamma, flow, slope, bend
    real(wp), intent(out), dimension(n) :: residual, fall, curvature
    real(wp), parameter :: least = 1.0e-30_wp      ! of P, so that points without stress have a root
    real(wp) :: relative(n, 3, 0:2), resistance(n, 0:2)
    real(wp) :: x, x1, x2, g, g1, g2, per, p, p1, p2, root, least_fall, largest
    integer :: i, l

    call relative_modes(kinematic, n, modes, back, dgamma, relative, resistance)
    residual = 0.0_wp
    fall = 0.0_wp
    curvature = 0.0_wp
    do i = 1, 3
      !$omp simd private(x, x1, x2, g, g1, g2, per)
      do l = 1, n
        x = flow(l) + resistance(l, 0) + moduli(i)*dgamma(l)
        x1 = slope(l) + resistance(l, 1) + moduli(i)
        x2 = resistance(l, 2) - bend(l)
        ! Relative stress over X and its derivatives, their products and halves of those of P.
        per = 1.0_wp/x
        g = per*relative(l, i, 0)
        g1 = per*(relative(l, i, 1) - g*x1)
        g2 = per*(relative(l, i, 2) - 2.0_wp*g1*x1 - g*x2)
        residual(l) = residual(l) + g*g
        fall(l) = fall(l) + g*g1
        curvature(l) = curvature(l) + (g1*g1 + g*g2)
      end do
    end do
    largest = maxval(moduli)
    !$omp simd private(p, p1, p2, root, least_fall)
    do l = 1, n
      p = residual(l)
      p1 = fall(l)
      p2 = curvature(l)
      root = 1.0_wp/sqrt(max(p, least))
      least_fall = 0.01_wp*moduli(1)*root/(flow(l) + resistance(l, 0) + largest*dgamma(l))
      residual(l) = 1.0_wp - root
      fall(l) = max(-p1*root**3, least_fall)
      curvature(l) = root**3*(p2 - 3.0_wp*(p1*root)**2)
    end do
  end subroutine evaluate

  !> Relative stress after `dgamma` that has faded the back stresses, what they add to X, and the
  !! first two derivatives of both.
  pure subroutine relative_modes(kinematic, n, modes, back, dgamma, relative, resistance)
    type(back_stresses_t), intent(in) :: kinematic
    integer, intent(in) :: n
    real(wp), intent(in) :: modes(n, 3), back(n, 3, kinematic%n), dgamma(n)
    real(wp), intent(out) :: relative(n, 3, 0:2), resistance(n, 0:2)
    real(wp) :: left
    integer :: i, k, l

    relative(:, :, 0) = modes
    relative(:, :, 1:) = 0.0_wp
    resistance = 0.0_wp
    do k = 1, kinematic%n
      associate (c => kinematic%modulus(k), gamma => kinematic%recall(k))
        do i = 1, 3
          !$omp simd private(left)
          do l = 1, n
            left = 1.0_wp/(1.0_wp + gamma*dgamma(l))
            relative(l, i, 0) = relative(l, i, 0) - left*back(l, i, k)
            relative(l, i, 1) = relative(l, i, 1) + gamma*left**2*back(l, i, k)
            relative(l, i, 2) = relative(l, i, 2) - 2.0_wp*gamma**2*left**3*back(l, i, k)
          end do
        end do
        !$omp simd private(left)
        do l = 1, n
          left = 1.0_wp/(1.0_wp + gamma*dgamma(l))
          resistance(l, 0) = resistance(l, 0) + left*c*dgamma(l)
          resistance(l, 1) = resistance(l, 1) + left**2*c
          resistance(l, 2) = resistance(l, 2) - 2.0_wp*gamma*left**3*c
        end do
      end associate
    end do
  end subroutine relative_modes

  !> Plastic strain along the new relative stress, and the change of the back stresses. Both are
  !! zero, to the bit, without `dgamma`.
  pure subroutine find_strain(kinematic, moduli, n, dgamma, flow, modes, back)
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: moduli(3)
    integer, intent(in) :: n
    real(wp), intent(in) :: dgamma(n), flow(n)
    real(wp), intent(inout) :: modes(n, 3), back(n, 3, kinematic%n)
    real(wp) :: relative(n, 3, 0:2), resistance(n, 0:2), left
    integer :: i, k, l

    call relative_modes(kinematic, n, modes, back, dgamma, relative, resistance)
    do i = 1, 3
      !$omp simd
      do l = 1, n
        modes(l, i) = dgamma(l)*relative(l, i, 0) &
                      /(flow(l) + resistance(l, 0) + moduli(i)*dgamma(l))
      end do
      do k = 1, kinematic%n
        !$omp simd private(left)
        do l = 1, n
          left = kinematic%recall(k)*dgamma(l)
          back(l, i, k) = (kinematic%modulus(k)*modes(l, i) - left*back(l, i, k))/(1.0_wp + left)
        end do
      end do
    end do
  end subroutine find_strain

  !> Back stresses, of six components each, as modes of the plane stresses whose deviators they are.
  pure subroutine plane_back_stresses(n, n_back, tensors, modes)
    integer, intent(in) :: n, n_back
    real(wp), intent(in) :: tensors(n, 6, n_back)     !! 11 22 33 12 13 23, shear as it is
    real(wp), intent(out) :: modes(n, 3, n_back)

    modes(:, 1, :) = 0.5_wp*(tensors(:, 1, :) + tensors(:, 2, :)) - tensors(:, 3, :)
    modes(:, 2, :) = root3*(0.5_wp*(tensors(:, 1, :) - tensors(:, 2, :)))
    modes(:, 3, :) = root3*tensors(:, 4, :)
  end subroutine plane_back_stresses

  !> Add changes of such plane stresses.
  pure subroutine add_plane_back_stresses(n, n_back, modes, tensors)
    integer, intent(in) :: n, n_back
    real(wp), intent(in) :: modes(n, 3, n_back)
    real(wp), intent(inout) :: tensors(n, 6, n_back)

    tensors(:, 1, :) = tensors(:, 1, :) + (modes(:, 1, :)/3.0_wp + modes(:, 2, :)/root3)
    tensors(:, 2, :) = tensors(:, 2, :) + (modes(:, 1, :)/3.0_wp - modes(:, 2, :)/root3)
    tensors(:, 3, :) = tensors(:, 3, :) - 2.0_wp/3.0_wp*modes(:, 1, :)
    tensors(:, 4, :) = tensors(:, 4, :) + modes(:, 3, :)/root3
  end subroutine add_plane_back_stresses

end module plane_return
