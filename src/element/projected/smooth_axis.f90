!> Projection along one direction onto the splines of a patch of one degree less, with the same
!! knots (T. Elguedj et al., CMAME 197 (2008)): best in the squares weighted by quadrature weights
!! and element lengths. It couples the elements of a row.
module smooth_axis
  use kinds, only: wp
  use failure, only: error_t, fail
  use knot_vector, only: knot_vector_t, basis_derivatives
  use basis_tables, only: axis_table_t
  use lapack, only: band_cholesky
  implicit none
  private

  public :: new_smooth_axis, point_factors, solve_columns, solve_rows

  !> Splines at the quadrature points and the factor of their mass matrix.
  type, public :: smooth_axis_t
    integer :: n_functions = 0
    integer, allocatable :: first(:)          !! first function of an element
    real(wp), allocatable :: values(:, :, :)  !! shape (degree, n_points, n_elements)
    real(wp), allocatable :: measure(:, :)    !! weight times length, (n_points, n_elements)
    real(wp), allocatable :: factor(:, :)     !! of the mass L D L^T: 1/D, then the lower band of L
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
    do a = 1, merge(smooth%n_functions, 0, is_solved)
      smooth%factor(2:, a) = smooth%factor(2:, a)/smooth%factor(1, a)
      smooth%factor(1, a) = 1.0_wp/smooth%factor(1, a)**2
    end do
    if (.not. is_solved) call fail(error, "projection: too few quadrature points in a "// &
                                   "direction for splines of one degree less")
  end subroutine new_smooth_axis

  !> Values of the splines of an element at its points, times weight and length where `is_measured`:
  !! what takes points to loads of splines, and the other way round the splines to points.
  pure function point_factors(smooth, element, is_measured) result(factors)
    type(smooth_axis_t), intent(in) :: smooth
    integer, intent(in) :: element
    logical, intent(in) :: is_measured
    real(wp) :: factors(size(smooth%values, 1), size(smooth%values, 2))   !! (degree, n_points)
    integer :: q

    factors = smooth%values(:, :, element)
    if (.not. is_measured) return
    do q = 1, size(factors, 2)
      factors(:, q) = factors(:, q)*smooth%measure(q, element)
    end do
  end function point_factors

  !> From loads of the splines to their coefficients, m directions side by side.
  pure subroutine solve_columns(smooth, m, c)
    type(smooth_axis_t), intent(in) :: smooth
    integer, intent(in) :: m
    real(wp), intent(inout) :: c(m, smooth%n_functions)
    integer :: i, j

    do j = 2, smooth%n_functions
      do i = max(1, j - size(smooth%factor, 1) + 1), j - 1
        call add_line(m, 1.0_wp, -smooth%factor(j - i + 1, i), c(:, i), c(:, j))
      end do
    end do
    do j = smooth%n_functions, 1, -1
      associate (next => min(j + 1, smooth%n_functions), factor => smooth%factor(:, j))
        if (size(factor) == 1 .or. next == j) then
          c(:, j) = factor(1)*c(:, j)
        else
          call add_line(m, factor(1), -factor(2), c(:, next), c(:, j))
        end if
        do i = j + 2, min(j + size(factor) - 1, smooth%n_functions)
          call add_line(m, 1.0_wp, -factor(i - j + 1), c(:, i), c(:, j))
        end do
      end associate
    end do
  end subroutine solve_columns

  !> The same with the splines along the first index: some lines at a time are turned for it.
  pure subroutine solve_rows(smooth, m, c)
    type(smooth_axis_t), intent(in) :: smooth
    integer, intent(in) :: m
    real(wp), intent(inout) :: c(smooth%n_functions, m)
    integer, parameter :: n_side_by_side = 32
    real(wp), allocatable :: lines(:, :)       ! on the heap: thread stacks are small
    integer :: first, n, i, j

    allocate (lines(n_side_by_side, smooth%n_functions), source=0.0_wp)
    do first = 0, m - 1, n_side_by_side
      n = min(n_side_by_side, m - first)
      do i = 1, n
        do j = 1, smooth%n_functions
          lines(i, j) = c(j, first + i)
        end do
      end do
      call solve_columns(smooth, n_side_by_side, lines)
      do i = 1, n
        do j = 1, smooth%n_functions
          c(j, first + i) = lines(i, j)
        end do
      end do
    end do
  end subroutine solve_rows

  !> Add a multiple of a line to a multiple of another.
  pure subroutine add_line(m, own, factor, x, y)
    integer, intent(in) :: m
    real(wp), intent(in) :: own, factor, x(m)
    real(wp), intent(inout) :: y(m)
    integer :: l

    !$omp simd
    do l = 1, m
      y(l) = own*y(l) + factor*x(l)
    end do
  end subroutine add_line

end module smooth_axis
