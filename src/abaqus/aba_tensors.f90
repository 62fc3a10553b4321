!> Utility routines on tensors that subroutines of users call, by the names and arguments that
!! Abaqus gives them. Tensors are stored as 11, 22, 33, 12, 13, 23 (LSTR = 1: stress, 2: strain with
!! engineering shear), in the routines for blocks as 11, 22, 33, 12, 23, 31 with tensor shear.
module aba_tensors
  use, intrinsic :: iso_c_binding, only: c_double, c_int
  use symmetric_eigen, only: principal_values
  implicit none
  private

  integer, parameter :: row(3) = [1, 1, 2], column(3) = [2, 3, 3]   ! of shear 12, 13, 23

contains

  !> Rotate a tensor: R S R^T.
  subroutine rotsig(s, r, sprime, lstr, ndi, nshr) bind(C, name="rotsig_")
    integer(c_int), intent(in) :: lstr, ndi, nshr
    real(c_double), intent(in) :: s(ndi + nshr), r(3, 3)
    real(c_double), intent(out) :: sprime(ndi + nshr)

    sprime = packed_tensor(matmul(r, matmul(full_tensor(s, lstr, ndi, nshr), transpose(r))), &
                           lstr, ndi, nshr)
  end subroutine rotsig

  !> Invariants of a stress: a third of the trace, and the von Mises stress.
  subroutine sinv(stress, sinv1, sinv2, ndi, nshr) bind(C, name="sinv_")
    integer(c_int), intent(in) :: ndi, nshr
    real(c_double), intent(in) :: stress(ndi + nshr)
    real(c_double), intent(out) :: sinv1, sinv2
    real(c_double) :: deviator(3, 3)
    integer :: i

    deviator = full_tensor(stress, 1_c_int, ndi, nshr)
    sinv1 = (deviator(1, 1) + deviator(2, 2) + deviator(3, 3))/3.0_c_double
    do i = 1, 3
      deviator(i, i) = deviator(i, i) - sinv1
    end do
    sinv2 = sqrt(1.5_c_double*sum(deviator**2))
  end subroutine sinv

  !> Principal values, in no order.
  subroutine sprinc(s, ps, lstr, ndi, nshr) bind(C, name="sprinc_")
    integer(c_int), intent(in) :: lstr, ndi, nshr
    real(c_double), intent(in) :: s(ndi + nshr)
    real(c_double), intent(out) :: ps(3)
    real(c_double) :: directions(3, 3)

    call decompose(full_tensor(s, lstr, ndi, nshr), ps, directions)
  end subroutine sprinc

  !> Principal values with their directions: AN(k, :) belongs to PS(k).
  subroutine sprind(s, ps, an, lstr, ndi, nshr) bind(C, name="sprind_")
    integer(c_int), intent(in) :: lstr, ndi, nshr
    real(c_double), intent(in) :: s(ndi + nshr)
    real(c_double), intent(out) :: ps(3), an(3, 3)
    real(c_double) :: directions(3, 3)

    call decompose(full_tensor(s, lstr, ndi, nshr), ps, directions)
    an = transpose(directions)
  end subroutine sprind

  !> Principal values of a block of tensors, in no order.
  subroutine vsprinc(nblock, tensor, eigval, ndir, nshr) bind(C, name="vsprinc_")
    integer(c_int), intent(in) :: nblock, ndir, nshr
    real(c_double), intent(in) :: tensor(nblock, ndir + nshr)
    real(c_double), intent(out) :: eigval(nblock, 3)
    real(c_double) :: directions(3, 3)
    integer :: i

    do i = 1, nblock
      call decompose(full_of_block(tensor(i, :), ndir, nshr), eigval(i, :), directions)
    end do
  end subroutine vsprinc

  !> Principal values of a block of tensors with their directions: EIGVEC(i, :, k) belongs to
  !! EIGVAL(i, k).
  subroutine vsprind(nblock, tensor, eigval, eigvec, ndir, nshr) bind(C, name="vsprind_")
    integer(c_int), intent(in) :: nblock, ndir, nshr
    real(c_double), intent(in) :: tensor(nblock, ndir + nshr)
    real(c_double), intent(out) :: eigval(nblock, 3), eigvec(nblock, 3, 3)
    integer :: i

    do i = 1, nblock
      call decompose(full_of_block(tensor(i, :), ndir, nshr), eigval(i, :), eigvec(i, :, :))
    end do
  end subroutine vsprind

  !> The matrix of a tensor with the order of blocks.
  pure function full_of_block(s, ndir, nshr) result(full)
    integer(c_int), intent(in) :: ndir, nshr
    real(c_double), intent(in) :: s(ndir + nshr)
    real(c_double) :: full(3, 3)

    if (nshr == 3) then
      full = full_tensor([s(:ndir + 1), s(ndir + 3), s(ndir + 2)], 1_c_int, ndir, nshr)
    else
      full = full_tensor(s, 1_c_int, ndir, nshr)
    end if
  end function full_of_block

  !> The matrix of a tensor that is stored as direct values, then shear values.
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

  !> Principal values and directions (columns) of a symmetric matrix.
  pure subroutine decompose(full, values, directions)
    real(c_double), intent(in) :: full(3, 3)
    real(c_double), intent(out) :: values(3), directions(3, 3)

    call principal_values(packed_tensor(full, 1_c_int, 3_c_int, 3_c_int), values, directions)
  end subroutine decompose

end module aba_tensors
