!> The lowest eigenpairs of K x = w M x, K sparse and symmetric and M diagonal: iteration of a
!! subspace with the factors of K + s M. The shift s keeps these regular where K is singular, and is
!! raised where K has eigenvalues below -s: all of K + s M are positive then.
!!
!! MUMPS solves for a block of vectors five times as fast as for one after the other. So for up to
!! some 20 pairs this is as fast as Lanczos' method with single vectors (ARPACK), and it finds equal
!! eigenvalues for certain.
module eigenpairs
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use linear_algebra, only: sorted_order, symmetric_eigensystem
  use sparse_matrix, only: symmetric_matrix_t
  use ranks, only: ranks_t
  use sparse_factor, only: sparse_factor_t
  implicit none
  private

  public :: find_eigenpairs, block_size

  integer, parameter :: most_iterations = 300
  real(wp), parameter :: precise = 1.0e-10_wp    !! change of an eigenvalue, of itself
  real(wp), parameter :: regular = 1.0e-10_wp    !! of the stiffness, what keeps factors from zeros
  real(wp), parameter :: round_off = 1.0e-7_wp   !! such a change that no longer falls

contains

  !> Vectors of the subspace for `n` eigenpairs, where there are as many unknowns.
  pure integer function block_size(n)
    integer, intent(in) :: n

    block_size = 2*min(n, 1000000) + 8
  end function block_size

  !> The lowest eigenvalues in rising order and their vectors, X' M X = 1. Fails where there is no
  !! MUMPS.
  subroutine find_eigenpairs(matrix, mass, guess, n, values, vectors, error, has_buffer, ranks)
    type(symmetric_matrix_t), intent(inout) :: matrix      !! K, then K + s M
    real(wp), intent(in) :: mass(:)                        !! the diagonal of M
    real(wp), intent(in) :: guess                          !! of an eigenvalue, for s
    integer, intent(in) :: n                               !! wanted, unknowns at most
    real(wp), allocatable, intent(out) :: values(:), vectors(:, :)
    type(error_t), allocatable, intent(out) :: error
    logical, intent(inout), optional :: has_buffer         !! of BLAS, see `sparse_factor_t`
    class(ranks_t), intent(in), optional :: ranks          !! likewise
    real(wp), parameter :: growth = 30.0_wp
    integer, parameter :: most_trials = 20
    type(sparse_factor_t) :: factor
    real(wp) :: shift, added
    integer :: i

    if (present(has_buffer)) factor%has_buffer = has_buffer
    call factor%take_ranks(ranks)
    call factor%analyse(matrix, error)
    if (allocated(error)) return
    associate (diagonal => matrix%first(2:) - 1)
      shift = max(guess, regular*maxval(matrix%values(diagonal)/mass)/matrix%n)
      added = 0.0_wp
      do i = 1, most_trials
        matrix%values(diagonal) = matrix%values(diagonal) + (shift - added)*mass
        added = shift
        call factor%factorise(matrix, error)
        if (allocated(error)) return
        if (factor%n_negative == 0) exit
        shift = growth*shift
      end do
    end associate
    if (present(has_buffer)) has_buffer = factor%has_buffer
    call iterate(factor, mass, added, n, values, vectors, error)
  end subroutine find_eigenpairs

  !> With X' M X = 1, the eigenvalues of X' M (K + s M)^-1 M X come close to 1/(w + s).
  subroutine iterate(factor, mass, shift, n, values, vectors, error)
    type(sparse_factor_t), intent(inout) :: factor
    real(wp), intent(in) :: mass(:), shift
    integer, intent(in) :: n
    real(wp), allocatable, intent(out) :: values(:), vectors(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: x(:, :), mx(:, :), reduced(:, :), turn(:, :), theta(:), before(:)
    real(wp) :: change, last_change
    logical :: is_solved
    integer :: i

    x = start_vectors(size(mass), min(block_size(n), size(mass)))
    allocate (theta(size(x, 2)), turn(size(x, 2), size(x, 2)))
    allocate (before(n), source=huge(1.0_wp))
    last_change = huge(1.0_wp)
    do i = 1, most_iterations
      call orthonormalise(mass, x)
      mx = spread(mass, 2, size(x, 2))*x
      x = mx
      call factor%solve(x, error)
      if (allocated(error)) return
      reduced = matmul(transpose(mx), x)
      call symmetric_eigensystem(0.5_wp*(reduced + transpose(reduced)), theta, turn, is_solved)
      if (.not. is_solved) exit
      associate (order => sorted_order(1.0_wp/theta))
        theta = theta(order)
        x = matmul(x, turn(:, order))
      end associate
      values = 1.0_wp/theta(:n) - shift
      change = maxval(abs(values - before)/max(abs(values), shift))
      if (change <= precise .or. (change <= round_off .and. change >= last_change)) then
        call orthonormalise(mass, x)
        vectors = x(:, :n)
        return
      end if
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

end module eigenpairs
