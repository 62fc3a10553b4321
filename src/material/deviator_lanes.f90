!> Deviators of `lanes` points at a time in the axes of the material, in an orthonormal basis: with
!! the five components (s11 - s22)/sqrt 2, (s11 + s22 - 2 s33)/sqrt 6 and sqrt 2 times the shears
!! 12, 13 and 23 the product of two tensors is that of two vectors, and plastic strain and stress
!! need no factors on their shear.
!!
!! A number of points that the compiler knows fills the vector registers without a scalar end.
module deviator_lanes
  use kinds, only: wp
  implicit none
  private

  public :: load_lanes, store_lanes, into_axes, add_from_axes, deviator_of, add_deviator

  integer, parameter, public :: width = 8, lanes = 3*width   !! of a vector register; of a call
  real(wp), parameter :: root2 = sqrt(2.0_wp), root6 = sqrt(6.0_wp)

contains

  !> The points of a row from `first` on. Behind its end its last point is repeated.
  pure subroutine load_lanes(n, first, n_columns, row, block)
    integer, intent(in) :: n, first, n_columns
    real(wp), intent(in) :: row(n, n_columns)
    real(wp), intent(out) :: block(lanes, n_columns)
    integer :: l, c

    do c = 1, n_columns
      if (first + lanes - 1 <= n) then
        !$omp simd
        do l = 1, lanes
          block(l, c) = row(first + l - 1, c)
        end do
      else
        do l = 1, lanes
          block(l, c) = row(min(first + l - 1, n), c)
        end do
      end if
    end do
  end subroutine load_lanes

  !> Put points back into their row.
  pure subroutine store_lanes(n, first, n_columns, block, row)
    integer, intent(in) :: n, first, n_columns
    real(wp), intent(in) :: block(lanes, n_columns)
    real(wp), intent(inout) :: row(n, n_columns)
    integer :: l, c

    do c = 1, n_columns
      if (first + lanes - 1 <= n) then
        !$omp simd
        do l = 1, lanes
          row(first + l - 1, c) = block(l, c)
        end do
      else
        row(first:n, c) = block(:n - first + 1, c)
      end if
    end do
  end subroutine store_lanes

  !> Deviators of tensors in space, in the axes of the material. The mean goes first: next to a high
  !! pressure the digits of the deviator would be lost.
  pure subroutine into_axes(n, rotation, tensor, deviator)
    integer, intent(in) :: n                     !! points of the row that the tensors are part of
    real(wp), intent(in) :: rotation(lanes, 9)   !! of `axes_rotation`
    real(wp), intent(in) :: tensor(n, *)         !! 11 22 33 12 13 23, shear as it is
    real(wp), intent(out) :: deviator(lanes, 5)
    real(wp) :: s1, s2, s3, s4, s5, s6, t1, t2, t3, t4, t5, t6, mean, first, second
    integer :: l

    !$omp simd private(s1, s2, s3, s4, s5, s6, t1, t2, t3, t4, t5, t6, mean, first, second)
    do l = 1, lanes
      associate (r11 => rotation(l, 1), r12 => rotation(l, 2), r13 => rotation(l, 3), &
                 r21 => rotation(l, 4), r22 => rotation(l, 5), r23 => rotation(l, 6), &
                 r31 => rotation(l, 7), r32 => rotation(l, 8), r33 => rotation(l, 9))
        mean = (tensor(l, 1) + tensor(l, 2) + tensor(l, 3))*(1.0_wp/3.0_wp)
        s1 = tensor(l, 1) - mean; s2 = tensor(l, 2) - mean; s3 = tensor(l, 3) - mean
        s4 = tensor(l, 4); s5 = tensor(l, 5); s6 = tensor(l, 6)
        t1 = r11*s1 + r12*s4 + r13*s5; t2 = r11*s4 + r12*s2 + r13*s6; t3 = r11*s5 + r12*s6 + r13*s3
        t4 = r21*s1 + r22*s4 + r23*s5; t5 = r21*s4 + r22*s2 + r23*s6; t6 = r21*s5 + r22*s6 + r23*s3
        first = t1*r11 + t2*r12 + t3*r13
        second = t4*r21 + t5*r22 + t6*r23
        deviator(l, 1) = (first - second)*(1.0_wp/root2)
        ! Without a trace, 33 is -(11 + 22).
        deviator(l, 2) = (first + second)*(3.0_wp/root6)
        deviator(l, 3) = root2*(t1*r21 + t2*r22 + t3*r23)
        deviator(l, 4) = root2*(t1*r31 + t2*r32 + t3*r33)
        deviator(l, 5) = root2*(t4*r31 + t5*r32 + t6*r33)
      end associate
    end do
  end subroutine into_axes

  !> Add a multiple of deviators in the axes of the material to tensors in space. What is zero
  !! changes nothing.
  pure subroutine add_from_axes(n, rotation, scaling, deviator, tensor)
    integer, intent(in) :: n                     !! as above
    real(wp), intent(in) :: rotation(lanes, 9), scaling, deviator(lanes, 5)
    real(wp), intent(inout) :: tensor(n, *)
    real(wp) :: s1, s2, s3, s4, s5, s6, t1, t2, t3, t4, t5, t6, first, second
    integer :: l

    !$omp simd private(s1, s2, s3, s4, s5, s6, t1, t2, t3, t4, t5, t6, first, second)
    do l = 1, lanes
      associate (r11 => rotation(l, 1), r12 => rotation(l, 2), r13 => rotation(l, 3), &
                 r21 => rotation(l, 4), r22 => rotation(l, 5), r23 => rotation(l, 6), &
                 r31 => rotation(l, 7), r32 => rotation(l, 8), r33 => rotation(l, 9))
        s3 = deviator(l, 2)*(scaling/root6)
        s1 = deviator(l, 1)*(scaling/root2) + s3
        s2 = s3 - deviator(l, 1)*(scaling/root2)
        s3 = -2.0_wp*s3
        s4 = deviator(l, 3)*(scaling/root2)
        s5 = deviator(l, 4)*(scaling/root2)
        s6 = deviator(l, 5)*(scaling/root2)
        t1 = r11*s1 + r21*s4 + r31*s5; t2 = r11*s4 + r21*s2 + r31*s6; t3 = r11*s5 + r21*s6 + r31*s3
        t4 = r12*s1 + r22*s4 + r32*s5; t5 = r12*s4 + r22*s2 + r32*s6; t6 = r12*s5 + r22*s6 + r32*s3
        first = t1*r11 + t2*r21 + t3*r31
        second = t4*r12 + t5*r22 + t6*r32
        tensor(l, 1) = tensor(l, 1) + first
        tensor(l, 2) = tensor(l, 2) + second
        tensor(l, 3) = tensor(l, 3) - (first + second)
        tensor(l, 4) = tensor(l, 4) + (t1*r12 + t2*r22 + t3*r32)
        tensor(l, 5) = tensor(l, 5) + (t1*r13 + t2*r23 + t3*r33)
        tensor(l, 6) = tensor(l, 6) + (t4*r13 + t5*r23 + t6*r33)
      end associate
    end do
  end subroutine add_from_axes

  !> Deviators of tensors that are in the axes of the material already.
  pure subroutine deviator_of(tensor, deviator)
    real(wp), intent(in) :: tensor(lanes, 6)
    real(wp), intent(out) :: deviator(lanes, 5)
    integer :: l

    !$omp simd
    do l = 1, lanes
      deviator(l, 1) = (tensor(l, 1) - tensor(l, 2))*(1.0_wp/root2)
      deviator(l, 2) = (tensor(l, 1) + tensor(l, 2) - 2.0_wp*tensor(l, 3))*(1.0_wp/root6)
      deviator(l, 3) = root2*tensor(l, 4)
      deviator(l, 4) = root2*tensor(l, 5)
      deviator(l, 5) = root2*tensor(l, 6)
    end do
  end subroutine deviator_of

  !> Add deviators to tensors, both in the axes of the material.
  pure subroutine add_deviator(deviator, tensor)
    real(wp), intent(in) :: deviator(lanes, 5)
    real(wp), intent(inout) :: tensor(lanes, 6)
    real(wp) :: part
    integer :: l

    !$omp simd private(part)
    do l = 1, lanes
      part = deviator(l, 2)*(1.0_wp/root6)
      tensor(l, 1) = tensor(l, 1) + (part + deviator(l, 1)*(1.0_wp/root2))
      tensor(l, 2) = tensor(l, 2) + (part - deviator(l, 1)*(1.0_wp/root2))
      tensor(l, 3) = tensor(l, 3) - 2.0_wp*part
      tensor(l, 4) = tensor(l, 4) + deviator(l, 3)*(1.0_wp/root2)
      tensor(l, 5) = tensor(l, 5) + deviator(l, 4)*(1.0_wp/root2)
      tensor(l, 6) = tensor(l, 6) + deviator(l, 5)*(1.0_wp/root2)
    end do
  end subroutine add_deviator

end module deviator_lanes
