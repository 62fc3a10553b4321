!> Paths on which the tests of the laws drive one point.
module law_paths
  use kinds, only: wp
  use block_law, only: block_law_t
  use deviator_lanes, only: lanes, deviator_of
  use yield_function, only: yield_function_t, evaluate_lanes => evaluate_yield
  implicit none
  private

  public :: pull, step_point, mises_of, random_increment, rotation_of, turned
  public :: objectivity_error, evaluate_yield

  !> State of one point.
  type, public :: point_t
    real(wp) :: stress(6) = 0.0_wp
    real(wp), allocatable :: state(:)
    logical :: ok = .true.
  end type point_t

contains

  !> One increment, the stress rotated by the spin before it as the element does.
  subroutine step_point(law, dt, dstrain, point, spin)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, dstrain(6)
    type(point_t), intent(inout) :: point
    real(wp), intent(in), optional :: spin(3)
    real(wp) :: row(1, 6), state(1, law%n_state), turn(3)
    logical :: ok

    if (.not. allocated(point%state)) allocate (point%state(law%n_state), source=0.0_wp)
    turn = 0.0_wp
    if (present(spin)) turn = spin
    row(1, :) = turned(rotation_of(turn), point%stress)
    state(1, :) = point%state
    call law%update(1, dt, reshape(dstrain, [1, 6]), row, state, ok, reshape(turn, [1, 3]))
    point%stress = row(1, :)
    point%state = state(1, :)
    point%ok = point%ok .and. ok
  end subroutine step_point

  !> Strain increments along axis 1 in equal steps, all other stresses kept at zero by Newton's
  !! method with the elastic matrix as its first slope and Broyden's update behind.
  subroutine pull(law, dt, n_steps, strain, point)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt          !! of all steps together
    integer, intent(in) :: n_steps
    real(wp), intent(in) :: strain
    type(point_t), intent(inout) :: point
    type(point_t) :: trial
    real(wp) :: dstrain(6), left(5), new_left(5), flexibility(5, 5), step(5), change(5)
    real(wp) :: poisson_free
    integer :: i, iteration

    poisson_free = 0.5_wp*(3.0_wp*law%bulk - 2.0_wp*law%shear)/(3.0_wp*law%bulk + law%shear)
    do i = 1, n_steps
      dstrain = 0.0_wp
      dstrain(1) = strain/n_steps
      dstrain(2:3) = -poisson_free*dstrain(1)
      call first_flexibility(law, flexibility)
      trial = point
      call step_point(law, dt/n_steps, dstrain, trial)
      left = trial%stress(2:)
      do iteration = 1, 200
        if (maxval(abs(left)) < 1.0e-11_wp*abs(trial%stress(1))) exit
        step = -matmul(flexibility, left)
        dstrain(2:) = dstrain(2:) + step
        trial = point
        call step_point(law, dt/n_steps, dstrain, trial)
        new_left = trial%stress(2:)
        change = matmul(flexibility, new_left - left)
        if (abs(dot_product(step, change)) > 0.0_wp) then
          flexibility = flexibility + spread(step - change, 2, 5) &
                        *spread(matmul(step, flexibility), 1, 5)/dot_product(step, change)
        end if
        left = new_left
      end do
      point = trial
    end do
  end subroutine pull

  !> Strains 2 to 6 against stresses 2 to 6 of the elastic law under fixed strain 1.
  pure subroutine first_flexibility(law, flexibility)
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: flexibility(5, 5)
    real(wp) :: a, b

    a = law%bulk + 4.0_wp/3.0_wp*law%shear
    b = law%bulk - 2.0_wp/3.0_wp*law%shear
    flexibility = 0.0_wp
    flexibility(1, 1) = a/(a*a - b*b)
    flexibility(2, 2) = a/(a*a - b*b)
    flexibility(1, 2) = -b/(a*a - b*b)
    flexibility(2, 1) = -b/(a*a - b*b)
    flexibility(3, 3) = 1.0_wp/law%shear
    flexibility(4, 4) = 1.0_wp/law%shear
    flexibility(5, 5) = 1.0_wp/law%shear
  end subroutine first_flexibility

  !> Von Mises stress, worked out through the deviator.
  pure real(wp) function mises_of(stress)
    real(wp), intent(in) :: stress(6)
    real(wp) :: s(6)

    s = stress
    s(:3) = s(:3) - sum(stress(:3))/3.0_wp
    mises_of = sqrt(1.5_wp*(sum(s(:3)**2) + 2.0_wp*sum(s(4:)**2)))
  end function mises_of

  !> The next of a sequence of numbers in (-1, 1), the same on each machine.
  real(wp) function random(seed)
    integer, intent(inout) :: seed   !! above 0
    integer, parameter :: factor = 16807, quotient = 127773, rest = 2836, period = huge(1)

    seed = factor*mod(seed, quotient) - rest*(seed/quotient)
    if (seed <= 0) seed = seed + period
    random = 2.0_wp*real(seed, wp)/period - 1.0_wp
  end function random

  !> Six random numbers up to `scaling`.
  function random_increment(seed, scaling) result(dstrain)
    integer, intent(inout) :: seed
    real(wp), intent(in) :: scaling
    real(wp) :: dstrain(6)
    integer :: i

    do i = 1, 6
      dstrain(i) = scaling*random(seed)
    end do
  end function random_increment

  !> Rotation by a spin increment (12, 13, 23): (I - W/2)^-1 (I + W/2), by its closed form.
  pure function rotation_of(spin) result(q)
    real(wp), intent(in) :: spin(3)
    real(wp) :: q(3, 3), h(3, 3)
    integer :: i

    h = 0.0_wp
    h(1, 2) = 0.5_wp*spin(1)
    h(1, 3) = 0.5_wp*spin(2)
    h(2, 3) = 0.5_wp*spin(3)
    h = h - transpose(h)
    q = 2.0_wp/(1.0_wp + 0.25_wp*sum(spin**2))*(h + matmul(h, h))
    do i = 1, 3
      q(i, i) = q(i, i) + 1.0_wp
    end do
  end function rotation_of

  !> A tensor (11, 22, 33, 12, 13, 23, shear as it is) turned by a rotation.
  pure function turned(q, tensor) result(new)
    real(wp), intent(in) :: q(3, 3), tensor(6)
    real(wp) :: new(6), full(3, 3)

    full = reshape([tensor(1), tensor(4), tensor(5), tensor(4), tensor(2), tensor(6), &
                    tensor(5), tensor(6), tensor(3)], [3, 3])
    full = matmul(matmul(q, full), transpose(q))
    new = [full(1, 1), full(2, 2), full(3, 3), full(1, 2), full(1, 3), full(2, 3)]
  end function turned

  !> Largest difference, over the stress, between a path in a fixed frame and the same path in a
  !! frame that turns by a random spin in each increment.
  real(wp) function objectivity_error(law, n_steps, scaling)
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: n_steps
    real(wp), intent(in) :: scaling     !! of the strain increments
    type(point_t) :: fixed, turning
    real(wp) :: frame(3, 3), dstrain(6), spin(6), e(6)
    integer :: i, seed

    seed = 5
    frame = rotation_of([0.0_wp, 0.0_wp, 0.0_wp])
    objectivity_error = 0.0_wp
    do i = 1, n_steps
      e = random_increment(seed, scaling)
      spin = random_increment(seed, 0.3_wp)
      call step_point(law, 1.0_wp, e, fixed)
      frame = matmul(rotation_of(spin(:3)), frame)
      e(4:) = 0.5_wp*e(4:)
      dstrain = turned(frame, e)
      dstrain(4:) = 2.0_wp*dstrain(4:)
      call step_point(law, 1.0_wp, dstrain, turning, spin(:3))
      objectivity_error = max(objectivity_error, &
                              maxval(abs(turning%stress - turned(frame, fixed%stress))) &
                              /maxval(abs(fixed%stress)))
    end do
    if (.not. (fixed%ok .and. turning%ok)) objectivity_error = huge(1.0_wp)
  end function objectivity_error

  !> Equivalent stress of one stress, its gradient (with respect to a shear stress that stands for
  !! both of its entries, so that the flow is engineering strain) and its second derivatives.
  subroutine evaluate_yield(yield, stress, q, gradient, hessian)
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: stress(6)
    real(wp), intent(out) :: q
    real(wp), intent(out), optional :: gradient(6), hessian(6, 6)
    real(wp) :: s(lanes, 5), all_q(lanes), slope(lanes, 5), packed(lanes, 15), full(5, 5)
    real(wp) :: basis(lanes, 5), to_deviator(5, 6), unit(lanes, 6)
    integer :: i, j

    call deviator_of(spread(stress, 1, lanes), s)
    call evaluate_lanes(yield, s, all_q, slope, packed)
    q = all_q(lanes)
    do i = 1, 6
      unit = 0.0_wp
      unit(:, i) = 1.0_wp
      call deviator_of(unit, basis)
      to_deviator(:, i) = basis(1, :)
    end do
    do i = 1, 5
      do j = 1, i
        full(i, j) = packed(lanes, i*(i - 1)/2 + j)
        full(j, i) = full(i, j)
      end do
    end do
    if (present(gradient)) gradient = matmul(slope(lanes, :), to_deviator)
    if (present(hessian)) hessian = matmul(transpose(to_deviator), matmul(full, to_deviator))
  end subroutine evaluate_yield

end module law_paths
