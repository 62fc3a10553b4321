!> Linear maps along one parametric direction, applied to tensor grids direction by direction.
!!
!! Each output is a combination of `width` consecutive inputs, so a map costs `width` operations a
!! value whatever the size of the grid. B-spline bases at sample points are such maps, and so are
!! the maps from integration points to display points and from B-spline to Bezier control values.
module line_operator
  use kinds, only: wp
  use knot_vector, only: basis_derivatives, knot_vector_t, n_spans, span_table
  implicit none
  private

  public :: line_operator_t, basis_operator, spread_operator, apply_tensor
  public :: joined_positions, joined_bezier_operator, equal_positions

  !> output(s) = sum over i of values(i, s)*input(first(s) + i - 1).
  type :: line_operator_t
    integer :: n_in = 0                      !! length of the input line
    integer :: n_out = 0                     !! length of the output line
    integer :: width = 0                     !! inputs per output
    integer, allocatable :: first(:)         !! first input of each output, shape (n_out)
    real(wp), allocatable :: values(:, :)    !! coefficients, shape (width, n_out)
  end type line_operator_t

contains

  !> Basis functions (or their derivatives with respect to xi) at the same positions of every
  !! element. Element by element; with `is_joined` the last position of an element and the first of
  !! the next are one (the positions must then include both ends).
  pure function basis_operator(kv, positions, derivative, is_joined) result(op)
    type(knot_vector_t), intent(in) :: kv
    real(wp), intent(in) :: positions(:)     !! in each element, in [-1, 1]
    integer, intent(in) :: derivative     !! 0 for values, 1 for first derivatives
    logical, intent(in) :: is_joined
    type(line_operator_t) :: op
    real(wp) :: table(kv%degree + 1, 0:derivative), bounds(2), xi
    integer :: spans(n_spans(kv)), e, i, s, n_own

    spans = span_table(kv)
    n_own = size(positions)
    if (is_joined) n_own = n_own - 1
    op%n_in = kv%n_basis
    op%n_out = n_own*size(spans)
    if (is_joined) op%n_out = op%n_out + 1
    op%width = kv%degree + 1
    allocate (op%first(op%n_out), op%values(op%width, op%n_out))
    do e = 1, size(spans)
      bounds = kv%knots(spans(e):spans(e) + 1)
      do i = 1, size(positions)
        s = (e - 1)*n_own + i
        xi = 0.5_wp*(bounds(1)*(1 - positions(i)) + bounds(2)*(1 + positions(i)))
        call basis_derivatives(kv, spans(e), xi, derivative, table)
        op%first(s) = spans(e) - kv%degree
        op%values(:, s) = table(:, derivative)
      end do
    end do
  end function basis_operator

  !> Parametric coordinates of the same positions of every element, where elements meet but once.
  pure function joined_positions(kv, positions) result(xi)
    type(knot_vector_t), intent(in) :: kv
    real(wp), intent(in) :: positions(:)     !! in each element, from -1 to 1
    real(wp), allocatable :: xi(:)
    integer, allocatable :: spans(:)
    real(wp) :: bounds(2)
    integer :: e, n

    allocate (spans, source=span_table(kv))
    n = size(positions) - 1
    allocate (xi(n*size(spans) + 1))
    do e = 1, size(spans)
      bounds = kv%knots(spans(e):spans(e) + 1)
      xi((e - 1)*n + 1:e*n + 1) = 0.5_wp*(bounds(1)*(1 - positions) + bounds(2)*(1 + positions))
    end do
  end function joined_positions

  !> From values at points of each element to values at joined positions of each element: linear
  !! between the points, constant outside the outermost ones, and the mean of both elements where
  !! they meet. All coefficients are non-negative with sum one, so nothing overshoots.
  pure function spread_operator(points, positions, n_elements) result(op)
    real(wp), intent(in) :: points(:)   !! of the given values in each element, in [-1, 1], rising
    real(wp), intent(in) :: positions(:)   !! where values are wanted, from -1 to 1
    integer, intent(in) :: n_elements
    type(line_operator_t) :: op
    real(wp) :: own(size(points), size(positions))
    integer :: e, i, s, n_points, n_own, offset

    n_points = size(points)
    n_own = size(positions) - 1
    do i = 1, size(positions)
      own(:, i) = linear_weights(points, positions(i))
    end do
    op%n_in = n_points*n_elements
    op%n_out = n_own*n_elements + 1
    op%width = min(2*n_points, op%n_in)
    allocate (op%first(op%n_out), op%values(op%width, op%n_out))
    op%values = 0.0_wp
    do s = 1, op%n_out
      e = max((s + n_own - 2)/n_own, 1)     ! element that ends at or contains the position
      i = s - (e - 1)*n_own
      op%first(s) = min((e - 1)*n_points + 1, op%n_in - op%width + 1)
      offset = (e - 1)*n_points + 1 - op%first(s)
      op%values(offset + 1:offset + n_points, s) = own(:, i)
      if (i == size(positions) .and. e < n_elements) then
        op%values(:, s) = 0.5_wp*op%values(:, s)
        op%values(n_points + 1:, s) = 0.5_wp*own(:, 1)
      end if
    end do
  end function spread_operator

  ! Hat functions on the points, constant outside them.
  pure function linear_weights(points, position) result(weights)
    real(wp), intent(in) :: points(:), position
    real(wp) :: weights(size(points)), fraction
    integer :: i

    weights = 0.0_wp
    if (position <= points(1)) then
      weights(1) = 1.0_wp
    else if (position >= points(size(points))) then
      weights(size(points)) = 1.0_wp
    else
      i = count(points <= position)
      fraction = (position - points(i))/(points(i + 1) - points(i))
      weights(i:i + 1) = [1 - fraction, fraction]
    end if
  end function linear_weights

  !> Apply one map per axis to a field on a tensor grid (axis 1 fastest).
  pure function apply_tensor(operators, field) result(values)
    type(line_operator_t), intent(in) :: operators(:)          !! one for each axis
    real(wp), intent(in) :: field(product(operators%n_in))     !! the grid as one line
    real(wp), allocatable :: values(:)                         !! shape (product of n_out)
    real(wp), allocatable :: swept(:)
    integer :: d, n_before, n_after

    values = field
    do d = 1, size(operators)
      n_before = product(operators(:d - 1)%n_out)
      n_after = product(operators(d + 1:)%n_in)
      allocate (swept(n_before*operators(d)%n_out*n_after))
      call sweep(operators(d), n_before, n_after, values, swept)
      call move_alloc(swept, values)
    end do
  end function apply_tensor

  pure subroutine sweep(op, n_before, n_after, field, values)
    type(line_operator_t), intent(in) :: op
    integer, intent(in) :: n_before, n_after
    real(wp), intent(in) :: field(n_before, op%n_in, n_after)
    real(wp), intent(out) :: values(n_before, op%n_out, n_after)
    integer :: i, s, k

    if (n_before == 1) then
      do k = 1, n_after
        do s = 1, op%n_out
          values(1, s, k) = dot_product(op%values(:, s), &
                                        field(1, op%first(s):op%first(s) + op%width - 1, k))
        end do
      end do
      return
    end if
    do k = 1, n_after
      do s = 1, op%n_out
        values(:, s, k) = op%values(1, s)*field(:, op%first(s), k)
        do i = 2, op%width
          values(:, s, k) = values(:, s, k) + op%values(i, s)*field(:, op%first(s) + i - 1, k)
        end do
      end do
    end do
  end subroutine sweep

  !> Bezier control values of degree `degree` (at least that of the knot vector) for all elements,
  !! those at common ends stored once: degree*n_elements + 1 outputs.
  pure function joined_bezier_operator(kv, degree) result(op)
    type(knot_vector_t), intent(in) :: kv
    integer, intent(in) :: degree
    type(line_operator_t) :: op
    type(line_operator_t) :: samples
    real(wp) :: to_bezier(degree + 1, degree + 1)
    integer :: e

    samples = basis_operator(kv, equal_positions(degree), 0, is_joined=.false.)
    op = basis_operator(kv, equal_positions(degree), 0, is_joined=.true.)
    to_bezier = inverse(bernstein_table(degree))
    do e = 1, samples%n_out/(degree + 1)
      associate (first => (e - 1)*(degree + 1) + 1, last => e*(degree + 1))
        op%first((e - 1)*degree + 1:e*degree + 1) = samples%first(first:last)
        op%values(:, (e - 1)*degree + 1:e*degree + 1) &
          = matmul(samples%values(:, first:last), transpose(to_bezier))
      end associate
    end do
  end function joined_bezier_operator

  !> degree + 1 equally spaced positions from -1 to 1.
  pure function equal_positions(degree) result(positions)
    integer, intent(in) :: degree
    real(wp) :: positions(degree + 1)
    integer :: i

    positions = [(real(2*i - degree, wp)/degree, i=0, degree)]
  end function equal_positions

  ! Bernstein polynomials (columns) at equally spaced positions (rows).
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

end module line_operator
