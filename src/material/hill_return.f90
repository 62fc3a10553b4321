!> Return of a row of points to Hill's quadratic yield surface, in the axes of the material.
!!
!! In the two modes of the normal stresses and the three shears the backward Euler equations part
!! (J. C. Simo and R. L. Taylor, IJNME 22 (1986), for plane stress): each mode of the trial stress
!! is divided by 1 + mu dgamma/flow, and one scalar equation for dgamma is left.
module hill_return
  use kinds, only: wp
  use flow_curve, only: flow_curve_t, flow_after
  use yield_function, only: yield_function_t
  implicit none
  private

  public :: return_to_hill

contains

  !> New stresses of the points that yield. Points that do not converge in a few steps are left as
  !! they were, for another method.
  pure subroutine return_to_hill(curve, yield, shear, dt, n, eqps, factor, stress, dgamma, is_done)
    type(flow_curve_t), intent(in) :: curve         !! of finite slope
    type(yield_function_t), intent(in) :: yield     !! quadratic
    real(wp), intent(in) :: shear, dt
    integer, intent(in) :: n
    real(wp), intent(in) :: eqps(n), factor(n)      !! before the increment
    real(wp), intent(inout) :: stress(n, 6)         !! trial in, new out; deviators
    real(wp), intent(out) :: dgamma(n)
    logical, intent(out) :: is_done(n)
    integer, parameter :: max_iterations = 15
    real(wp), parameter :: tolerance = 1.0e-13_wp
    real(wp), dimension(n) :: flow, slope, q, shrink_slope
    real(wp) :: mode(n, 5), stiffness(5), x, step
    integer :: l, iteration

    call split(yield, shear, n, stress, mode, stiffness)
    dgamma = 0.0_wp
    do iteration = 1, max_iterations
      call flow_after(curve, n, dt, eqps, factor, dgamma, flow, slope)
      call equivalent(yield, n, mode, stiffness, dgamma/flow, q, shrink_slope)
      if (iteration == 1) is_done = q <= flow
      is_done = is_done .or. abs(q - flow) <= tolerance*flow
      if (all(is_done)) exit
      do l = 1, n
        if (is_done(l)) cycle
        ! Newton on 1/q - 1/flow, which is nearly straight.
        x = dgamma(l)/flow(l)
        step = (q(l) - flow(l))/(q(l)*flow(l)) &
               /(shrink_slope(l)/q(l)**2*(1.0_wp - x*slope(l))/flow(l) + slope(l)/flow(l)**2)
        dgamma(l) = max(dgamma(l) + step, 0.0_wp)
      end do
    end do
    do l = 1, n
      if (is_done(l) .and. dgamma(l) > 0.0_wp) then
        mode(l, :) = mode(l, :)/(1.0_wp + stiffness*dgamma(l)/flow(l))
        stress(l, :3) = yield%modes(:, 1)*mode(l, 1) + yield%modes(:, 2)*mode(l, 2)
        stress(l, 4:) = mode(l, 3:)
      end if
    end do
  end subroutine return_to_hill

  !> Modes of the stresses, and the stiffness against the flow of each.
  pure subroutine split(yield, shear, n, stress, mode, stiffness)
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: shear
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(n, 6)
    real(wp), intent(out) :: mode(n, 5), stiffness(5)
    integer :: i

    do i = 1, 2
      mode(:, i) = yield%modes(1, i)*stress(:, 1) + yield%modes(2, i)*stress(:, 2) &
                   + yield%modes(3, i)*stress(:, 3)
    end do
    mode(:, 3:) = stress(:, 4:)
    ! A shear strain is an engineering one.
    stiffness(:2) = 2.0_wp*shear*yield%weights(:2)
    stiffness(3:) = shear*yield%weights(3:)
  end subroutine split

  !> Equivalent stress of the modes after their division by 1 + stiffness x, and by how much it
  !! falls with x.
  pure subroutine equivalent(yield, n, mode, stiffness, x, q, fall)
    type(yield_function_t), intent(in) :: yield
    integer, intent(in) :: n
    real(wp), intent(in) :: mode(n, 5), stiffness(5), x(n)
    real(wp), intent(out) :: q(n), fall(n)
    real(wp) :: divisor, part
    integer :: i, l

    q = tiny(q)
    fall = 0.0_wp
    do i = 1, 5
      !$omp simd private(divisor, part)
      do l = 1, n
        divisor = 1.0_wp/(1.0_wp + stiffness(i)*x(l))
        part = yield%weights(i)*(mode(l, i)*divisor)**2
        q(l) = q(l) + part
        fall(l) = fall(l) + part*stiffness(i)*divisor
      end do
    end do
    !$omp simd
    do l = 1, n
      q(l) = sqrt(q(l))
      fall(l) = fall(l)/q(l)
    end do
  end subroutine equivalent

end module hill_return
