!> Moving-least-squares fits between sets of points of an element (P. Lancaster and K. Salkauskas,
!! Math. Comp. 37 (1981); for strains R. P. R. Cardoso and J. M. A. Cesar de Sa, IJNME 97 (2014)).
module mls_fit
  use kinds, only: wp
  use failure, only: error_t, fail
  use lapack, only: solve
  implicit none
  private

  public :: new_mls_matrix, tensor_exponents

contains

  !> Matrix that turns values at the points `from` into those of their fit at the points `to`. The
  !! fit is a sum of the monomials given, best in the squares of the residuals times `window`,
  !! a column for each point of `to`. With as many monomials as points it interpolates.
  subroutine new_mls_matrix(from, window, to, exponents, matrix, error)
    real(wp), intent(in) :: from(:, :)        !! coordinates in [-1, 1], shape (d, n)
    real(wp), intent(in) :: window(:, :)      !! positive, shape (n, m)
    real(wp), intent(in) :: to(:, :)          !! shape (d, m)
    integer, intent(in) :: exponents(:, :)    !! of the monomials, shape (d, k), k <= n
    real(wp), allocatable, intent(out) :: matrix(:, :)     !! shape (m, n)
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: basis(size(exponents, 2), size(from, 2)), factors(size(exponents, 2))
    real(wp) :: weighted(size(exponents, 2), size(from, 2))
    integer :: i, k
    logical :: is_solved

    do i = 1, size(from, 2)
      basis(:, i) = monomials(from(:, i), exponents)
    end do
    allocate (matrix(size(to, 2), size(from, 2)))
    do i = 1, size(to, 2)
      do k = 1, size(exponents, 2)
        weighted(k, :) = window(:, i)*basis(k, :)
      end do
      factors = monomials(to(:, i), exponents)
      call solve(matmul(weighted, transpose(basis)), factors, is_solved)
      if (.not. is_solved) then
        call fail(error, "projection: these points do not carry a fit of this degree")
        return
      end if
      matrix(i, :) = matmul(factors, weighted)
    end do
  end subroutine new_mls_matrix

  !> Exponents of the full tensor basis with `counts` terms along each coordinate.
  pure function tensor_exponents(counts) result(exponents)
    integer, intent(in) :: counts(:)
    integer, allocatable :: exponents(:, :)    !! shape (d, product(counts)), first fastest
    integer :: k, d, rest

    allocate (exponents(size(counts), product(counts)))
    do k = 1, product(counts)
      rest = k - 1
      do d = 1, size(counts)
        exponents(d, k) = mod(rest, counts(d))
        rest = rest/counts(d)
      end do
    end do
  end function tensor_exponents

  pure function monomials(x, exponents) result(values)
    real(wp), intent(in) :: x(:)
    integer, intent(in) :: exponents(:, :)
    real(wp) :: values(size(exponents, 2))
    integer :: k

    do k = 1, size(values)
      values(k) = product(x**exponents(:, k))
    end do
  end function monomials

end module mls_fit
