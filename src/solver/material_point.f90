!> One material point under prescribed increments of strain and stress.
!!
!! Six conditions control an increment, each on a combination of strain increments or of stresses.
!! Newton's method finds the strain increment that meets them all; the tangent comes from calls of
!! the law with slightly changed increments, so any law will do. Stress rotates with the spin as in
!! a forming run: T. J. R. Hughes and J. Winget, IJNME 15 (1980).
module material_point
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use block_law, only: block_law_t
  use plane_stress, only: in_sheet
  use point_context, only: point_context_t, new_point_context
  use tensor_rotation, only: rotate_by_spin
  use linear_algebra, only: solve
  use user_law, only: set_initial_state
  use user_call, only: user_law_t, refusal_words
  implicit none
  private

  public :: new_point, new_control, strain_to_frame, stress_to_frame, advance, plastic_strain

  !> How the failure of a test begins that a signal has stopped.
  character(*), parameter, public :: stop_words = "stopped by a signal"

  !> How it begins that no strain increment was found, though the law answers.
  character(*), parameter, public :: unmet_words = "no strain increment meets the conditions"

  character(2), parameter :: components(6) = ["11", "22", "33", "12", "13", "23"]

  !> Where the point has come to. Components 11, 22, 33, 12, 13, 23, engineering shear strains.
  type, public :: material_point_t
    real(wp) :: time = 0.0_wp
    integer :: increment = 0                        !! increments done
    real(wp) :: strain(6) = 0.0_wp                  !! sum of all strain increments
    real(wp) :: stress(6) = 0.0_wp                  !! Cauchy
    real(wp) :: gradient(3, 3) = 0.0_wp             !! deformation gradient
    real(wp), allocatable :: state(:)
    real(wp), allocatable :: fields(:)              !! temperature, field variables; may be none
    logical :: is_plane = .false.                   !! in plane stress, as in a shell
    real(wp) :: through = 0.0_wp                    !! its strain increment 33 before
  end type material_point_t

  !> Six conditions, a row each: on_strain . strain + on_stress . stress = what is asked for.
  !! One of the two parts of a row must be zero.
  type, public :: control_t
    real(wp) :: on_strain(6, 6) = 0.0_wp, on_stress(6, 6) = 0.0_wp
  end type control_t

  !> What a trial increment gives.
  type :: trial_t
    real(wp) :: dstrain(6) = 0.0_wp, stress(6) = 0.0_wp
    real(wp) :: residual(6) = 0.0_wp                !! of the conditions [stress]
    real(wp), allocatable :: state(:)
    logical :: is_good = .false.                    !! the law found an answer
  end type trial_t

  !> What all trials of an increment have in common.
  type :: increment_t
    real(wp) :: aim(6), spin(3), dt
    real(wp) :: rotated(6)                          !! stress at the start, rotated by the spin
  end type increment_t

contains

  !> A point without strain and stress, its state variables as given or zero if no user's SDVINI
  !! says else.
  function new_point(law, state, fields, is_plane) result(point)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in), optional :: state(:)   !! the first state variables
    real(wp), intent(in), optional :: fields(:)  !! temperature and field variables, constant
    logical, intent(in), optional :: is_plane    !! in plane stress, in a sheet along 1 and 2
    type(material_point_t) :: point
    real(wp) :: row(1, law%n_state)
    integer :: i, n

    allocate (point%state(law%n_state), source=0.0_wp)
    allocate (point%fields(0))
    if (present(fields)) point%fields = fields
    if (present(state)) then
      n = min(size(state), law%n_state - law%n_hidden)
      point%state(:n) = state(:n)
    end if
    call set_initial_state(law, 1, [1, 1], [0.0_wp, 0.0_wp, 0.0_wp], point%state)
    do i = 1, 3
      point%gradient(i, i) = 1.0_wp
    end do
    if (present(is_plane)) point%is_plane = is_plane
    if (.not. point%is_plane) return
    row(1, :) = point%state
    call law%lay_in_sheet(1, reshape(point%gradient, [1, 9]), row)
    point%state = row(1, :)
  end function new_point

  !> Conditions on single components in a frame rotated by `angle` about axis 3.
  pure function new_control(is_stress, angle) result(control)
    logical, intent(in) :: is_stress(6)   !! the condition is on the stress, else on the strain
    real(wp), intent(in) :: angle         !! [radians]
    type(control_t) :: control
    real(wp) :: rows(6, 6)
    integer :: i

    rows = strain_to_frame(angle)
    do i = 1, 6
      if (.not. is_stress(i)) control%on_strain(i, :) = rows(i, :)
    end do
    rows = stress_to_frame(angle)
    do i = 1, 6
      if (is_stress(i)) control%on_stress(i, :) = rows(i, :)
    end do
  end function new_control

  !> Matrix that takes strain components (engineering shear) into a frame rotated about axis 3.
  pure function strain_to_frame(angle) result(rows)
    real(wp), intent(in) :: angle   !! [radians]
    real(wp) :: rows(6, 6)

    rows = stress_to_frame(angle)
    rows(:, 4) = 0.5_wp*rows(:, 4)
    rows(4, :) = 2.0_wp*rows(4, :)
  end function strain_to_frame

  !> Matrix that takes stress components into a frame rotated about axis 3.
  pure function stress_to_frame(angle) result(rows)
    real(wp), intent(in) :: angle   !! [radians]
    real(wp) :: rows(6, 6), c, s

    c = cos(angle)
    s = sin(angle)
    rows = 0.0_wp
    rows(1, in_sheet) = [c*c, s*s, 2.0_wp*c*s]
    rows(2, in_sheet) = [s*s, c*c, -2.0_wp*c*s]
    rows(3, 3) = 1.0_wp
    rows(4, in_sheet) = [-c*s, c*s, c*c - s*s]
    rows(5, [5, 6]) = [c, s]
    rows(6, [5, 6]) = [-s, c]
  end function stress_to_frame

  !> One increment. `aim` gives the change of each strain condition and the value of each stress
  !! condition at the end. Fails if the law does, or if no strain increment is found
  !! that meets the conditions to 1e-11 of the stress (to 1e-7 where the law itself is no better);
  !! the point is then as it was.
  subroutine advance(law, control, aim, spin, dt, point, error)
    class(block_law_t), intent(in) :: law
    type(control_t), intent(in) :: control
    real(wp), intent(in) :: aim(6), spin(3)   !! spin increment 12, 13, 23
    real(wp), intent(in) :: dt
    type(material_point_t), intent(inout) :: point
    type(error_t), allocatable, intent(out) :: error
    type(increment_t) :: increment
    type(trial_t) :: trial

    increment%aim = aim
    increment%spin = spin
    increment%dt = dt
    increment%rotated = point%stress
    if (point%is_plane .or. .not. law%is_rotating) call rotate(spin, increment%rotated)
    call predict(law, control, increment, point, trial, error)
    if (.not. allocated(error)) call iterate(law, control, increment, point, trial, error)
    if (allocated(error)) return
    point%gradient = end_gradient(point, trial%dstrain, spin)
    point%strain = point%strain + trial%dstrain
    point%stress = trial%stress
    point%state = trial%state
    point%through = trial%dstrain(3)
    point%time = point%time + dt
    point%increment = point%increment + 1
  end subroutine advance

  !> First trial: the increment of an elastic law, cut down until the law has an answer.
  subroutine predict(law, control, increment, point, trial, error)
    class(block_law_t), intent(in) :: law
    type(control_t), intent(in) :: control
    type(increment_t), intent(in) :: increment
    type(material_point_t), intent(in) :: point
    type(trial_t), intent(out) :: trial
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: max_cuts = 6
    real(wp) :: matrix(6, 6), full(6)
    logical :: is_solved
    integer :: cut

    matrix = 2.0_wp*law%shear*control%on_strain &
             + matmul(control%on_stress, elastic_stiffness(law, point%is_plane))
    full = 0.0_wp
    full = -conditions(law, control, increment, full, increment%rotated)
    call solve(matrix, full, is_solved)
    if (.not. is_solved) then
      call fail(error, "the conditions contradict each other or leave a strain open")
      return
    end if
    do cut = 0, max_cuts
      trial = try(law, control, increment, point, full/2**cut)
      if (trial%is_good) return
    end do
    call fail(error, why_refused(law, trial))
  end subroutine predict

  !> Why the law has no answer that can be used.
  function why_refused(law, trial) result(reason)
    class(block_law_t), intent(in) :: law
    type(trial_t), intent(in) :: trial    !! that is not good
    character(:), allocatable :: reason
    integer :: bad

    reason = "the law finds no stress"
    bad = findloc(ieee_is_finite(trial%stress), .false., 1)
    if (bad > 0) then
      reason = "the law returns no finite number (NaN or infinity) as stress "//components(bad)
      return
    end if
    bad = findloc(ieee_is_finite(trial%state), .false., 1)
    if (bad > law%n_state - law%n_hidden) then
      reason = "the law returns no finite number (NaN or infinity) as an energy"
    else if (bad > 0) then
      reason = "the law returns no finite number (NaN or infinity) as state variable "//to_text(bad)
    else
      select type (law)
      class is (user_law_t)
        reason = "the user's subroutine "//refusal_words//" so there is no stress"
      end select
    end if
  end function why_refused

  !> Newton's method with steps cut until they help.
  subroutine iterate(law, control, increment, point, trial, error)
    class(block_law_t), intent(in) :: law
    type(control_t), intent(in) :: control
    type(increment_t), intent(in) :: increment
    type(material_point_t), intent(in) :: point
    type(trial_t), intent(inout) :: trial
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: max_iterations = 100, max_cuts = 10
    real(wp), parameter :: tight = 1.0e-11_wp, loose = 1.0e-7_wp
    real(wp), parameter :: small = 1.0e-4_wp   ! a stress that counts where there is none
    real(wp) :: step(6), scale, before
    type(trial_t) :: next
    logical :: is_solved
    integer :: iteration, cut

    do iteration = 1, max_iterations
      before = norm2(trial%residual)
      scale = maxval(abs(trial%stress)) + small*law%bulk
      if (before <= tight*scale) return
      step = -trial%residual
      call solve(tangent(law, control, increment, point, trial), step, is_solved)
      if (.not. is_solved) exit
      do cut = 0, max_cuts
        next = try(law, control, increment, point, trial%dstrain + step/2**cut)
        if (next%is_good) then
          if (norm2(next%residual) < before) exit
        end if
      end do
      if (cut > max_cuts) exit
      trial = next
    end do
    if (before <= loose*scale) return
    call fail(error, unmet_words)
    if (.not. is_solved) return
    if (.not. next%is_good) error%message = error%message//": "//why_refused(law, next)
  end subroutine iterate

  !> Change of the conditions with the strain increment, by differences.
  function tangent(law, control, increment, point, trial) result(matrix)
    class(block_law_t), intent(in) :: law
    type(control_t), intent(in) :: control
    type(increment_t), intent(in) :: increment
    type(material_point_t), intent(in) :: point
    type(trial_t), intent(in) :: trial
    real(wp), parameter :: relative = 1.0e-4_wp, least = 1.0e-10_wp
    real(wp) :: matrix(6, 6), changed(6), h
    type(trial_t) :: neighbour
    integer :: k

    h = max(relative*maxval(abs(trial%dstrain)), least)
    matrix = 2.0_wp*law%shear*control%on_strain &
             + matmul(control%on_stress, elastic_stiffness(law, point%is_plane))
    do k = 1, 6
      if (point%is_plane .and. any(k == [3, 5, 6])) cycle   ! on which nothing depends
      changed = trial%dstrain
      changed(k) = changed(k) + h
      neighbour = try(law, control, increment, point, changed)
      if (neighbour%is_good) matrix(:, k) = (neighbour%residual - trial%residual)/h
    end do
  end function tangent

  !> The law's answer to one strain increment.
  function try(law, control, increment, point, dstrain) result(trial)
    class(block_law_t), intent(in) :: law
    type(control_t), intent(in) :: control
    type(increment_t), intent(in) :: increment
    type(material_point_t), intent(in) :: point
    real(wp), intent(in) :: dstrain(6)
    type(trial_t) :: trial
    type(point_context_t) :: context
    real(wp) :: stress(1, 6), state(1, law%n_state)

    trial%dstrain = dstrain
    if (point%is_plane) trial%dstrain([3, 5, 6]) = 0.0_wp
    stress(1, :) = increment%rotated
    state(1, :) = point%state
    if (law%needs_context) then
      context = new_point_context(1, size(point%fields))
      context%fields(1, :) = [point%fields, point%fields]
      context%element = 1
      context%point = 1
      context%in_plane = merge(1, context%in_plane, point%is_plane)
      context%time = point%time
      context%step_time = point%time
      context%increment = point%increment + 1
      context%f0(1, :) = pack(transpose(point%gradient), .true.)
      context%f1(1, :) = pack(transpose(end_gradient(point, trial%dstrain, increment%spin)), &
                              .true.)
      context%length = 1.0_wp
    end if
    if (point%is_plane) then
      call update_in_sheet(law, context, increment, point%through, trial, stress, state)
    else if (law%needs_context) then
      call law%update_in_context(context, increment%dt, spread(dstrain, 1, 1), stress, state, &
                                 trial%is_good, spread(increment%spin, 1, 1))
    else
      call law%update(1, increment%dt, spread(dstrain, 1, 1), stress, state, trial%is_good, &
                      spread(increment%spin, 1, 1))
    end if
    trial%stress = stress(1, :)
    trial%state = state(1, :)
    trial%residual = conditions(law, control, increment, trial%dstrain, trial%stress)
    trial%is_good = trial%is_good .and. all(abs(trial%stress) <= huge(1.0_wp)) &
                    .and. all(abs(trial%state) <= huge(1.0_wp))
  end function try

  !> The law's answer in plane stress, and the strain increment 33.
  subroutine update_in_sheet(law, context, increment, before, trial, stress, state)
    class(block_law_t), intent(in) :: law
    type(point_context_t), intent(inout) :: context
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: before                  ! strain increment 33 of the last increment
    type(trial_t), intent(inout) :: trial
    real(wp), intent(inout) :: stress(1, 6), state(1, law%n_state)
    real(wp) :: plane(1, 3), through(1)

    plane = stress(:, in_sheet)
    through = before
    associate (strain => reshape(trial%dstrain(in_sheet), [1, 3]), spin => increment%spin(:1))
      if (law%needs_context) then
        call law%update_plane_in_context(context, increment%dt, strain, plane, state, through, &
                                         trial%is_good, spin)
      else
        call law%update_plane(1, increment%dt, strain, plane, state, through, trial%is_good, spin)
      end if
    end associate
    stress = 0.0_wp
    stress(:, in_sheet) = plane
    trial%dstrain(3) = through(1)
  end subroutine update_in_sheet

  !> By how much the conditions are missed; those on strain count as stresses of twice the shear
  !! modulus times the strain.
  pure function conditions(law, control, increment, dstrain, stress) result(residual)
    class(block_law_t), intent(in) :: law
    type(control_t), intent(in) :: control
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: dstrain(6), stress(6)
    real(wp) :: residual(6)
    integer :: i

    residual = matmul(control%on_stress, stress) - increment%aim
    do i = 1, 6
      if (any(abs(control%on_strain(i, :)) > 0.0_wp)) then
        residual(i) = 2.0_wp*law%shear*(dot_product(control%on_strain(i, :), dstrain) &
                                        - increment%aim(i))
      end if
    end do
  end function conditions

  !> Plastic part of the strain, by the elastic moduli of the law.
  pure function plastic_strain(law, point) result(strain)
    class(block_law_t), intent(in) :: law
    type(material_point_t), intent(in) :: point
    real(wp) :: strain(6), mean

    mean = sum(point%stress(:3))/3.0_wp
    strain = point%strain
    strain(:3) = strain(:3) - (point%stress(:3) - mean)/(2.0_wp*law%shear) - mean/(3.0_wp*law%bulk)
    strain(4:) = strain(4:) - point%stress(4:)/law%shear
  end function plastic_strain

  !> Hooke's law; in plane stress with any stiffness for strains on which nothing depends.
  pure function elastic_stiffness(law, is_plane) result(matrix)
    class(block_law_t), intent(in) :: law
    logical, intent(in) :: is_plane
    real(wp) :: matrix(6, 6), lame
    integer :: k

    matrix = 0.0_wp
    lame = law%bulk - 2.0_wp/3.0_wp*law%shear
    matrix(:3, :3) = lame
    if (is_plane) then
      matrix(:3, :3) = 0.0_wp
      matrix(:2, :2) = 2.0_wp*law%shear*lame/(lame + 2.0_wp*law%shear)
    end if
    do k = 1, 3
      matrix(k, k) = matrix(k, k) + 2.0_wp*law%shear
      matrix(k + 3, k + 3) = law%shear
    end do
  end function elastic_stiffness

  !> Rotate a stress by a spin increment, as elements do.
  pure subroutine rotate(spin, stress)
    real(wp), intent(in) :: spin(3)
    real(wp), intent(inout) :: stress(6)
    real(wp) :: stresses(1, 6)

    stresses(1, :) = stress
    call rotate_by_spin(1, reshape(spin, [1, 3]), stresses)
    stress = stresses(1, :)
  end subroutine rotate

  !> Deformation gradient after a constant velocity gradient with this strain and spin increment.
  pure function end_gradient(point, dstrain, spin) result(gradient)
    type(material_point_t), intent(in) :: point
    real(wp), intent(in) :: dstrain(6), spin(3)
    real(wp) :: gradient(3, 3), rate(3, 3)
    integer, parameter :: row(3) = [1, 1, 2], column(3) = [2, 3, 3]
    integer :: i

    do i = 1, 3
      rate(i, i) = dstrain(i)
      rate(row(i), column(i)) = 0.5_wp*dstrain(3 + i) + spin(i)
      rate(column(i), row(i)) = 0.5_wp*dstrain(3 + i) - spin(i)
    end do
    gradient = matmul(exponential(rate), point%gradient)
  end function end_gradient

  !> Exponential of a matrix: Taylor's series of a fraction of it, squared as often as needed.
  pure function exponential(matrix) result(power)
    real(wp), intent(in) :: matrix(3, 3)
    real(wp) :: power(3, 3), term(3, 3), small(3, 3)
    integer, parameter :: n_terms = 12
    integer :: n_squarings, i

    n_squarings = max(0, exponent(norm2(matrix)) + 3)
    small = matrix/2.0_wp**n_squarings
    term = 0.0_wp
    do i = 1, 3
      term(i, i) = 1.0_wp
    end do
    power = term
    do i = 1, n_terms
      term = matmul(term, small)/i
      power = power + term
    end do
    do i = 1, n_squarings
      power = matmul(power, power)
    end do
  end function exponential

end module material_point
