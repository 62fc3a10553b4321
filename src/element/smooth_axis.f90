!> Projection along one direction onto the splines of a patch of one degree less, with the same
!! knots (T. Elguedj et al., CMAME 197 (2008)): best in the squares weighted by quadrature weights
!! and element lengths. It couples the elements of a row.
module smooth_axis
  use kinds, only: wp
  use errors, only: error_t, fail
  use knot_vector, only: knot_vector_t, basis_derivatives
  use basis_tables, only: axis_table_t
  use lapack, only: band_cholesky
  implicit none
  private

  public :: new_smooth_axis, project_lines

  !> Splines at the quadrature points and the factor of their mass matrix.
  type, public :: smooth_axis_t
    integer :: n_functions = 0
    integer, allocatable :: first(:)          !! first function of an element
    real(wp), allocatable :: values(:, :, :)  !! shape (degree, n_points, n_elements)
    real(wp), allocatable :: measure(:, :)    !! weight times length, (n_points, n_elements)
    real(wp), allocatable :: factor(:, :)     !! lower band of the Cholesky factor
  end type smooth_axis_t

contains

  !> Operator for the knots of a direction and its quadrature.
  subroutine new_smooth_axis(smooth, kv, axis, error)
    type(smooth_axis_t), intent(out) :: smooth
    type(knot_vector_t), intent(in) :: kv
    type(axis_table_t), intent(in) :: axis
    type(error_t), allocatable, intent(out) :: error
    type(knot_vector_t) :: lower
    real(wp) :: middle, half
    integer :: e, q, a, b, span, p
    logical :: is_solved

    p = kv%degree
    lower = knot_vector_t(p - 1, kv%n_basis - 1, kv%knots(2:size(kv%knots) - 1))
    smooth%n_functions = lower%n_basis
    smooth%first = axis%first
    allocate (smooth%values(p, axis%n_points, axis%n_elements))
    allocate (smooth%measure(axis%n_points, axis%n_elements))
    allocate (smooth%factor(p, smooth%n_functions), source=0.0_wp)
    do e = 1, axis%n_elements
      span = axis%first(e) + p
      middle = 0.5_wp*(kv%knots(span + 1) + kv%knots(span))
      half = 0.5_wp*(kv%knots(span + 1) - kv%knots(span))
      smooth%measure(:, e) = half*axis%weights
      do q = 1, axis%n_points
        call basis_derivatives(lower, span - 1, middle + half*axis%abscissae(q), 0, &
                               smooth%values(:, q:q, e))
        do a = 1, p
          do b = a, p
            smooth%factor(b - a + 1, axis%first(e) + a - 1) = &
              smooth%factor(b - a + 1, axis%first(e) + a - 1) &
              + smooth%measure(q, e)*smooth%values(a, q, e)*smooth%values(b, q, e)
          end do
        end do
      end do
    end do
    is_solved = axis%n_points >= p
    if (is_solved) call band_cholesky(smooth%factor, is_solved)
    if (.not. is_solved) call fail(error, "projection: too few quadrature points in a "// &
                                   "direction for splines of one degree less")
  end subroutine new_smooth_axis

  !> Project along the middle index, in place; `is_transposed` for forces.
  pure subroutine project_lines(smooth, is_transposed, before, n, after, field)
    type(smooth_axis_t), intent(in) :: smooth
    logical, intent(in) :: is_transposed
    integer, intent(in) :: before, n, after
    real(wp), intent(inout) :: field(before, n, after)   !! n: points of all elements of a line
    integer :: k

    do k = 1, after
      call project_side_by_side(smooth, is_transposed, before, n, field(:, :, k))
    end do
  end subroutine project_lines

  !> Sum up the loads of the splines, solve for them, and take them at the points.
  pure subroutine project_side_by_side(smooth, is_transposed, m, n, field)
    type(smooth_axis_t), intent(in) :: smooth
    logical, intent(in) :: is_transposed
    integer, intent(in) :: m, n
    real(wp), intent(inout) :: field(m, n)
    real(wp), allocatable :: c(:, :)       ! on the heap: thread stacks are small
    real(wp) :: factors(size(smooth%values, 1))
    integer :: e, q, a, i, j, n_points

    n_points = size(smooth%measure, 1)
    allocate (c(m, smooth%n_functions), source=0.0_wp)
    do e = 1, size(smooth%first)
      do q = 1, n_points
        factors = merge(1.0_wp, smooth%measure(q, e), is_transposed)*smooth%values(:, q, e)
        do a = 1, size(factors)
          i = smooth%first(e) + a - 1
          call add_line(m, factors(a), field(:, q + n_points*(e - 1)), c(:, i))
        end do
      end do
    end do
    do j = 1, smooth%n_functions
      c(:, j) = c(:, j)*(1.0_wp/smooth%factor(1, j))
      do i = j + 1, min(j + size(smooth%factor, 1) - 1, smooth%n_functions)
        call add_line(m, -smooth%factor(i - j + 1, j), c(:, j), c(:, i))
      end do
    end do
    do j = smooth%n_functions, 1, -1
      do i = j + 1, min(j + size(smooth%factor, 1) - 1, smooth%n_functions)
        call add_line(m, -smooth%factor(i - j + 1, j), c(:, i), c(:, j))
      end do
      c(:, j) = c(:, j)*(1.0_wp/smooth%factor(1, j))
    end do
    field = 0.0_wp
    do e = 1, size(smooth%first)
      do q = 1, n_points
        factors = merge(smooth%measure(q, e), 1.0_wp, is_transposed)*smooth%values(:, q, e)
        do a = 1, size(factors)
          i = smooth%first(e) + a - 1
          call add_line(m, factors(a), c(:, i), field(:, q + n_points*(e - 1)))
        end do
      end do
    end do
  end subroutine project_side_by_side

  !> Add a multiple of a line.
  pure subroutine add_line(m, factor, x, y)
    integer, intent(in) :: m
    real(wp), intent(in) :: factor, x(m)
    real(wp), intent(inout) :: y(m)
    integer :: l

    !$omp simd
    do l = 1, m
      y(l) = y(l) + factor*x(l)
    end do
  end subroutine add_line

end module smooth_axis
