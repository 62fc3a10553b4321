!> Symmetric tensors of users' subroutines: as matrices, and their principal values.
module tensor_utilities
  use, intrinsic :: iso_c_binding, only: c_double, c_int
  implicit none
  private

  public :: full_tensor, packed_tensor, eigen_decomposition

  integer, parameter :: row(3) = [1, 1, 2], column(3) = [2, 3, 3]   ! of shear 12, 13, 23

contains

  !> The matrix of a tensor that stands as direct values, then shear values.
  pure function full_tensor(s, lstr, ndi, nshr) result(full)
    integer(c_int), intent(in) :: lstr         !! 1: stress, 2: strain with engineering shear
    integer(c_int), intent(in) :: ndi, nshr    !! numbers of direct and shear values
    real(c_double), intent(in) :: s(ndi + nshr)
    real(c_double) :: full(3, 3)
    integer :: i

    full = 0.0_c_double
    do i = 1, ndi
      full(i, i) = s(i)
    end do
    do i = 1, nshr
      full(row(i), column(i)) = s(ndi + i)/lstr
      full(column(i), row(i)) = s(ndi + i)/lstr
    end do
  end function full_tensor

  !> The reverse of `full_tensor`.
  pure function packed_tensor(full, lstr, ndi, nshr) result(s)
    real(c_double), intent(in) :: full(3, 3)
    integer(c_int), intent(in) :: lstr, ndi, nshr
    real(c_double) :: s(ndi + nshr)
    integer :: i

    do i = 1, ndi
      s(i) = full(i, i)
    end do
    do i = 1, nshr
      s(ndi + i) = lstr*full(row(i), column(i))
    end do
  end function packed_tensor

  !> Principal values and directions (columns) of a symmetric matrix, by Jacobi's rotations
  !! (G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed., section 8.5).
  pure subroutine eigen_decomposition(given, values, directions)
    real(c_double), intent(in) :: given(3, 3)
    real(c_double), intent(out) :: values(3), directions(3, 3)
    integer, parameter :: most_sweeps = 30
    real(c_double) :: a(3, 3), q(3, 3), small, theta, t, c, s
    integer :: sweep, k, i, j

    a = given
    directions = reshape([1.0_c_double, 0.0_c_double, 0.0_c_double, 0.0_c_double, 1.0_c_double, &
                          0.0_c_double, 0.0_c_double, 0.0_c_double, 1.0_c_double], [3, 3])
    small = 1.0e-34_c_double*sum(a**2)
    do sweep = 1, most_sweeps
      if (.not. a(1, 2)**2 + a(1, 3)**2 + a(2, 3)**2 > small) exit
      do k = 1, 3
        i = row(k)
        j = column(k)
        if (a(i, j)**2 <= 0.0_c_double) cycle
        theta = (a(j, j) - a(i, i))/(2.0_c_double*a(i, j))
        t = sign(1.0_c_double, theta)/(abs(theta) + sqrt(theta**2 + 1.0_c_double))
        c = 1.0_c_double/sqrt(t**2 + 1.0_c_double)
        s = t*c
        q = 0.0_c_double
        q(6 - i - j, 6 - i - j) = 1.0_c_double
        q(i, i) = c
        q(j, j) = c
        q(i, j) = s
        q(j, i) = -s
        a = matmul(transpose(q), matmul(a, q))
        directions = matmul(directions, q)
      end do
    end do
    do i = 1, 3
      values(i) = a(i, i)
    end do
  end subroutine eigen_decomposition

end module tensor_utilities
