!> From B-spline control values to Bezier control values of every element, in one direction.
module bezier_operator
  use kinds, only: wp
  use knot_vector, only: knot_vector_t
  use line_operator, only: basis_operator, line_operator_t
  implicit none
  private

  public :: joined_bezier_operator, equal_places

contains

  !> Bezier control values of degree `degree` (at least that of the knot vector) for all elements,
  !! those at common ends stored once: degree*n_elements + 1 outputs.
  pure function joined_bezier_operator(kv, degree) result(op)
    type(knot_vector_t), intent(in) :: kv
    integer, intent(in) :: degree
    type(line_operator_t) :: op
    type(line_operator_t) :: samples
    real(wp) :: to_bezier(degree + 1, degree + 1)
    integer :: e, i, own(degree + 1)

    samples = basis_operator(kv, equal_places(degree), 0, is_joined=.false.)
    op = basis_operator(kv, equal_places(degree), 0, is_joined=.true.)
    to_bezier = inverse(bernstein_table(degree))
    do e = 1, samples%n_out/(degree + 1)
      own = [((e - 1)*(degree + 1) + i, i=1, degree + 1)]
      op%first((e - 1)*degree + 1:e*degree + 1) = samples%first(own)
      op%values(:, (e - 1)*degree + 1:e*degree + 1) &
        = matmul(samples%values(:, own), transpose(to_bezier))
    end do
  end function joined_bezier_operator

  !> degree + 1 equally spaced places from -1 to 1.
  pure function equal_places(degree) result(places)
    integer, intent(in) :: degree
    real(wp) :: places(degree + 1)
    integer :: i

    places = [(real(2*i - degree, wp)/degree, i=0, degree)]
  end function equal_places

  ! Bernstein polynomials (columns) at equally spaced places (rows).
  pure function bernstein_table(degree) result(table)
    integer, intent(in) :: degree
    real(wp) :: table(degree + 1, degree + 1), t
    integer :: i, j, order

    table = 0.0_wp
    do i = 1, degree + 1
      t = real(i - 1, wp)/degree
      table(i, 1) = 1.0_wp
      do order = 1, degree
        do j = order + 1, 2, -1
          table(i, j) = t*table(i, j - 1) + (1 - t)*table(i, j)
        end do
        table(i, 1) = (1 - t)*table(i, 1)
      end do
    end do
  end function bernstein_table

  ! Inverse by Gauss-Jordan elimination. The matrix is totally positive, so pivots are positive
  ! and need no search (C. de Boor and A. Pinkus, 1977).
  pure function inverse(matrix) result(inverted)
    real(wp), intent(in) :: matrix(:, :)
    real(wp) :: inverted(size(matrix, 1), size(matrix, 1))
    real(wp) :: work(size(matrix, 1), 2*size(matrix, 1))
    integer :: i, k, n

    n = size(matrix, 1)
    work = 0.0_wp
    work(:, :n) = matrix
    do i = 1, n
      work(i, n + i) = 1.0_wp
    end do
    do k = 1, n
      work(k, :) = work(k, :)/work(k, k)
      do i = 1, n
        if (i /= k) work(i, :) = work(i, :) - work(i, k)*work(k, :)
      end do
    end do
    inverted = work(:, n + 1:)
  end function inverse

end module bezier_operator
