!> The lowest frequencies of a body of any size: iteration of a subspace with the factors of its
!! stiffness, which a small part of the masses keeps regular where the body is free.
module body_modes
  use, intrinsic :: iso_c_binding, only: c_funptr
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use linear_algebra, only: sorted_order, symmetric_eigensystem
  use patch_seams, only: seams_t
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use element, only: part_t
  use vibration, only: fixed_t, free_frequencies, trial_amount
  use shell_joints, only: shell_joints_t
  use body_parts, only: elastic_copies
  use unknowns, only: to_unknowns, unknowns_t
  use mumps_library, only: find_mumps
  use sparse_factor, only: sparse_factor_t
  use body_stiffness, only: bending_guess, body_stiffness_t, add_stiffness, find_unknowns, &
                            masses_of, new_body_stiffness
  implicit none
  private

  public :: find_frequencies, lowest_frequencies

  integer, parameter :: max_dense = 5000         !! unknowns; the matrix takes 0.2 GB, its
                                                 !! eigenvalues minutes
  integer, parameter :: least_sparse = 300       !! unknowns from which factors are quicker
  integer, parameter :: most_iterations = 300
  real(wp), parameter :: precise = 1.0e-10_wp    !! change of an eigenvalue, of itself
  real(wp), parameter :: regular = 1.0e-10_wp    !! of the stiffness, what keeps factors from zeros
  real(wp), parameter :: round_off = 1.0e-7_wp   !! such a change that no longer falls

contains

  !> Angular frequencies [1/time] in rising order: all of a small body, or the lowest `n`. Fails
  !! where the body is large and there is no MUMPS.
  subroutine find_frequencies(bodies, seams, law, fixed, joints, n, omega, error)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    type(fixed_t), intent(in) :: fixed(:)            !! by part
    type(shell_joints_t), intent(in) :: joints
    integer, intent(in) :: n
    real(wp), allocatable, intent(out) :: omega(:)
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: without
    type(unknowns_t) :: map
    type(c_funptr) :: entry
    logical :: is_coupled
    integer :: p

    call find_unknowns(bodies, seams, fixed, map, error)
    if (allocated(error)) return
    call find_mumps(entry, without)
    is_coupled = .false.
    do p = 1, size(bodies)
      is_coupled = is_coupled .or. bodies(p)%element%is_coupled
    end do
    if (.not. (allocated(without) .or. is_coupled) &
        .and. map%n_free > max(least_sparse, 4*block_size(n))) then
      call lowest_frequencies(bodies, seams, law, fixed, joints, n, omega, error)
    else if (map%n_free <= max_dense) then
      omega = free_frequencies(bodies, seams, law, fixed, joints)
    else if (is_coupled) then
      call refuse(map%n_free, "with a smooth projection", error)
    else if (allocated(without)) then
      call refuse(map%n_free, "in a program built without MUMPS", error)
    else
      call fail(error, "--modes finds at most "//to_text(((map%n_free - 1)/4 - 8)/2)// &
                " frequencies of a blank with "//to_text(map%n_free)//" free components, not "// &
                to_text(n))
    end if
  end subroutine find_frequencies

  subroutine refuse(n_free, why, error)
    integer, intent(in) :: n_free
    character(*), intent(in) :: why
    type(error_t), allocatable, intent(out) :: error

    call fail(error, "--modes works on at most "//to_text(max_dense)//" free components of "// &
              "control points "//why//"; this blank has "//to_text(n_free))
  end subroutine refuse

  pure integer function block_size(n)
    integer, intent(in) :: n                         !! frequencies

    block_size = 2*min(n, 1000000) + 8
  end function block_size

  !> The lowest angular frequencies [1/time] by MUMPS. Rigid motions give zero up to round-off.
  subroutine lowest_frequencies(bodies, seams, law, fixed, joints, n, omega, error)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    type(fixed_t), intent(in) :: fixed(:)            !! by part
    type(shell_joints_t), intent(in) :: joints
    integer, intent(in) :: n                         !! wanted
    real(wp), allocatable, intent(out) :: omega(:)
    type(error_t), allocatable, intent(out) :: error
    type(part_t), allocatable :: trial(:)
    type(shell_joints_t) :: springs
    type(body_stiffness_t) :: stiffness
    type(sparse_factor_t) :: factor
    real(wp), allocatable :: mass(:), values(:)
    real(wp) :: shift

    call new_body_stiffness(stiffness, bodies, seams, fixed, error, joints)
    if (allocated(error)) return
    trial = elastic_copies(bodies)
    springs = joints
    call add_stiffness(stiffness, trial, &
                        elastic_t(density=law%density, bulk=law%bulk, shear=law%shear), 1.0_wp, &
                        trial_amount(bodies), springs)
    mass = to_unknowns(stiffness%map, masses_of(bodies))
    associate (matrix => stiffness%matrix, diagonal => stiffness%matrix%first(2:) - 1)
      shift = max(bending_guess(bodies, law), &
                  regular*maxval(matrix%values(diagonal)/mass)/matrix%n)
      matrix%values(diagonal) = matrix%values(diagonal) + shift*mass
    end associate
    call factor%analyse(stiffness%matrix, .false., error)
    if (.not. allocated(error)) call factor%factorise(stiffness%matrix, error)
    if (.not. allocated(error)) call iterate(factor, mass, shift, n, values, error)
    if (.not. allocated(error)) omega = sqrt(max(0.0_wp, values))
  end subroutine lowest_frequencies

  !> The lowest eigenvalues of K x = w M x from the factors of K + s M: with X' M X = 1, those of
  !! X' M (K + s M)^-1 M X come close to 1/(w + s).
  subroutine iterate(factor, mass, shift, n, values, error)
    type(sparse_factor_t), intent(inout) :: factor
    real(wp), intent(in) :: mass(:), shift
    integer, intent(in) :: n
    real(wp), allocatable, intent(out) :: values(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: x(:, :), mx(:, :), reduced(:, :), vectors(:, :), theta(:), before(:)
    real(wp) :: change, last_change
    logical :: is_solved
    integer :: i

    x = start_vectors(size(mass), block_size(n))
    allocate (theta(size(x, 2)), vectors(size(x, 2), size(x, 2)))
    allocate (before(n), source=huge(1.0_wp))
    last_change = huge(1.0_wp)
    do i = 1, most_iterations
      call orthonormalise(mass, x)
      mx = spread(mass, 2, size(x, 2))*x
      x = mx
      call factor%solve(x, error)
      if (allocated(error)) return
      reduced = matmul(transpose(mx), x)
      call symmetric_eigensystem(0.5_wp*(reduced + transpose(reduced)), theta, vectors, is_solved)
      if (.not. is_solved) exit
      associate (order => sorted_order(1.0_wp/theta))
        theta = theta(order)
        x = matmul(x, vectors(:, order))
      end associate
      values = 1.0_wp/theta(:n) - shift
      change = maxval(abs(values - before)/max(abs(values), shift))
      if (change <= precise .or. (change <= round_off .and. change >= last_change)) return
      last_change = change
      before = values
    end do
    call fail(error, "the lowest "//to_text(n)//" frequencies were not found in "// &
              to_text(most_iterations)//" iterations")
  end subroutine iterate

  !> Numbers without any order, always the same.
  pure function start_vectors(n, m) result(x)
    integer, intent(in) :: n, m
    real(wp) :: x(n, m)
    integer :: i, j

    do j = 1, m
      do i = 1, n
        x(i, j) = 43758.5453_wp*sin(12.9898_wp*i + 78.233_wp*j)
        x(i, j) = x(i, j) - anint(x(i, j))
      end do
    end do
  end function start_vectors

  !> X' M X = 1, by each column in turn, twice.
  pure subroutine orthonormalise(mass, x)
    real(wp), intent(in) :: mass(:)
    real(wp), intent(inout) :: x(:, :)
    integer :: i, j, pass

    do j = 1, size(x, 2)
      do pass = 1, 2
        x(:, j) = x(:, j)/sqrt(sum(mass*x(:, j)**2))
        do i = 1, j - 1
          x(:, j) = x(:, j) - sum(mass*x(:, i)*x(:, j))*x(:, i)
        end do
      end do
      x(:, j) = x(:, j)/sqrt(sum(mass*x(:, j)**2))
    end do
  end subroutine orthonormalise

end module body_modes
