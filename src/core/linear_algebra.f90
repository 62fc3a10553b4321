!> Linear algebra: LAPACK's solvers for dense symmetric and general systems; the vector product; the
!! order of numbers.
module linear_algebra
  use kinds, only: wp
  implicit none
  private

  public :: eigenvalues, symmetric_eigensystem, tridiagonal_eigensystem
  public :: solve, solve_band, band_cholesky
  public :: cross, rigid_row, sorted_order

  interface
    subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
      import :: wp
      character, intent(in) :: jobz, uplo
      integer, intent(in) :: n, lda, lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(out) :: w(*), work(*)
      integer, intent(out) :: info
    end subroutine dsyev

    subroutine dstev(jobz, n, d, e, z, ldz, work, info)
      import :: wp
      character, intent(in) :: jobz
      integer, intent(in) :: n, ldz
      real(wp), intent(inout) :: d(*), e(*)
      real(wp), intent(out) :: z(ldz, *), work(*)
      integer, intent(out) :: info
    end subroutine dstev

    subroutine dgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: wp
      integer, intent(in) :: n, nrhs, lda, ldb
      real(wp), intent(inout) :: a(lda, *), b(ldb, *)
      integer, intent(out) :: ipiv(*), info
    end subroutine dgesv

    subroutine dgbsv(n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
      import :: wp
      integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb
      real(wp), intent(inout) :: ab(ldab, *), b(ldb, *)
      integer, intent(out) :: ipiv(*), info
    end subroutine dgbsv

    subroutine dpbtrf(uplo, n, kd, ab, ldab, info)
      import :: wp
      character, intent(in) :: uplo
      integer, intent(in) :: n, kd, ldab
      real(wp), intent(inout) :: ab(ldab, *)
      integer, intent(out) :: info
    end subroutine dpbtrf
  end interface

contains

  !> Eigenvalues of a symmetric matrix in rising order; huge where LAPACK found none.
  function eigenvalues(matrix) result(values)
    real(wp), intent(in) :: matrix(:, :)
    real(wp) :: values(size(matrix, 1))
    real(wp), allocatable :: copy(:, :), work(:)
    integer :: n, info

    n = size(matrix, 1)
    allocate (copy(n, n), source=matrix)
    allocate (work(34*n))
    call dsyev("N", "U", n, copy, n, values, work, size(work), info)
    if (info /= 0) values = huge(1.0_wp)
  end function eigenvalues

  !> Eigenvalues (rising) and unit eigenvectors of a symmetric matrix.
  subroutine symmetric_eigensystem(matrix, values, vectors, is_solved)
    real(wp), intent(in) :: matrix(:, :)
    real(wp), intent(out) :: values(:), vectors(:, :)
    logical, intent(out) :: is_solved
    real(wp) :: work(34*size(matrix, 1))
    integer :: info

    vectors = matrix
    call dsyev("V", "U", size(values), vectors, size(values), values, work, size(work), info)
    is_solved = info == 0
  end subroutine symmetric_eigensystem

  !> Eigenvalues (rising) and unit eigenvectors of a symmetric tridiagonal matrix.
  subroutine tridiagonal_eigensystem(diagonal, beside, values, vectors, is_solved)
    real(wp), intent(in) :: diagonal(:)
    real(wp), intent(in) :: beside(:)          !! at least size(diagonal) - 1 entries
    real(wp), intent(out) :: values(:), vectors(:, :)
    logical, intent(out) :: is_solved
    real(wp) :: e(size(beside)), work(max(1, 2*size(diagonal) - 2))
    integer :: info

    values = diagonal
    e = beside
    call dstev("V", size(diagonal), values, e, vectors, size(diagonal), work, info)
    is_solved = info == 0
  end subroutine tridiagonal_eigensystem

  !> Solve a system of linear equations; false where the matrix is singular or not finite.
  subroutine solve(matrix, x, is_solved)
    real(wp), intent(in) :: matrix(:, :)
    real(wp), intent(inout) :: x(:)   !! the right side, then the solution
    logical, intent(out) :: is_solved
    real(wp) :: copy(size(x), size(x)), column(size(x), 1)
    integer :: pivots(size(x)), info

    copy = matrix
    column(:, 1) = x
    call dgesv(size(x), 1, copy, size(x), pivots, column, size(x), info)
    x = column(:, 1)
    is_solved = info == 0 .and. all(abs(x) <= huge(1.0_wp))
  end subroutine solve

  !> Solve equations whose matrix has `width` diagonals on either side of the main one, for several
  !! right sides; false where the matrix is singular or not finite.
  subroutine solve_band(band, width, x, is_solved)
    real(wp), intent(in) :: band(:, :)     !! entry (i, j) at (width + 1 + i - j, j)
    integer, intent(in) :: width
    real(wp), intent(inout) :: x(:, :)     !! the right sides in columns, then the solutions
    logical, intent(out) :: is_solved
    real(wp) :: room(3*width + 1, size(band, 2))   ! the first rows are for what pivots fill in
    integer :: pivots(size(band, 2)), info

    room(:width, :) = 0.0_wp
    room(width + 1:, :) = band
    call dgbsv(size(band, 2), width, width, size(x, 2), room, size(room, 1), pivots, &
               x, size(x, 1), info)
    is_solved = info == 0 .and. all(abs(x) <= huge(1.0_wp))
  end subroutine solve_band

  !> Cholesky factor of a positive matrix with a band, in place: `band` holds the diagonals from the
  !! main one downwards, entry (i, j) at (i - j + 1, j). False where the matrix is not positive.
  subroutine band_cholesky(band, is_solved)
    real(wp), intent(inout) :: band(:, :)
    logical, intent(out) :: is_solved
    integer :: info

    call dpbtrf("L", size(band, 2), size(band, 1) - 1, band, size(band, 1), info)
    is_solved = info == 0
  end subroutine band_cholesky

  !> Vector at right angles to both, as long as the area between them, on the side from which the
  !! turn from the first to the second goes to the left.
  pure function cross(a, b) result(c)
    real(wp), intent(in) :: a(3), b(3)
    real(wp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> What the six rigid motions, a translation a and a rotation w, move a component of a point by:
  !! the row r with r . (a, w) = component c of a + w x arm.
  pure function rigid_row(arm, c) result(row)
    real(wp), intent(in) :: arm(3)         !! from the centre of the rotation to the point
    integer, intent(in) :: c               !! 1 to 3
    real(wp) :: row(6)

    row = 0.0_wp
    row(c) = 1.0_wp
    row(4 + mod(c, 3)) = arm(mod(c + 1, 3) + 1)    ! about the next axis
    row(4 + mod(c + 1, 3)) = -arm(mod(c, 3) + 1)   ! about the one after it
  end function rigid_row

  !> Order in which values rise, by merging ever longer runs; equal values keep their order.
  pure function sorted_order(values) result(order)
    real(wp), intent(in) :: values(:)
    integer, allocatable :: order(:)
    integer, allocatable :: merged(:)      ! of any size, so not on the stack
    integer :: width, low, middle, high, i, a, b
    logical :: takes_first

    order = [(i, i=1, size(values))]
    allocate (merged(size(values)))
    width = 1
    do while (width < size(values))
      do low = 1, size(values), 2*width
        middle = min(low + width, size(values) + 1)
        high = min(low + 2*width, size(values) + 1)
        a = low
        b = middle
        do i = low, high - 1
          takes_first = b >= high
          if (a < middle .and. b < high) takes_first = values(order(a)) <= values(order(b))
          if (takes_first) then
            merged(i) = order(a)
            a = a + 1
          else
            merged(i) = order(b)
            b = b + 1
          end if
        end do
      end do
      order = merged
      width = 2*width
    end do
  end function sorted_order

end module linear_algebra
