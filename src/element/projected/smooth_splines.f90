!> Projection onto the splines of a patch of one degree less, with the same knots (T. Elguedj et
!! al., CMAME 197 (2008)): best in the squares weighted by quadrature weights and element lengths.
!! It couples the elements of a row. Loads of the splines of each element are added in fixed order,
!! then lines of splines are solved for, one axis after the other.
module smooth_splines
  use kinds, only: wp
  use failure, only: error_t, fail
  use knot_vector, only: knot_vector_t, basis_derivatives
  use basis_tables, only: n_lanes, axis_table_t, lane_table_t
  use solid_patch, only: solid_patch_t, block_t, block_at
  use linear_algebra, only: band_cholesky
  implicit none
  private

  public :: new_smooth_axis, point_factors, solve_columns, solve_rows
  public :: new_smooth_fields, solve_for_splines

  !> Splines at the quadrature points and the factor of their mass matrix.
  type, public :: smooth_axis_t
    integer :: n_functions = 0
    integer, allocatable :: first(:)          !! first function of an element
    real(wp), allocatable :: values(:, :, :)  !! shape (degree, n_points, n_elements)
    real(wp), allocatable :: measure(:, :)    !! weight times length, (n_points, n_elements)
    real(wp), allocatable :: factor(:, :)     !! of the mass L D L^T: 1/D, then the lower band of L
  end type smooth_axis_t

  !> Factors between the points and the splines of an element along one axis, lane by lane, for
  !! strains (1) and stresses (2).
  type, public :: smooth_table_t
    real(wp), allocatable :: to_loads(:, :, :, :, :)    !! (8, q, p, n, 2)
    real(wp), allocatable :: to_points(:, :, :, :, :)   !! (8, p, q, n, 2)
  end type smooth_table_t

  !> Loads of the splines of one degree less, block by block, and the coefficients they lead to: of
  !! the volume strain (its stress on the way back), with laws that need deformation gradients of
  !! two volumes more. p counts the splines of an element along an axis, its degree.
  type, public :: smooth_fields_t
    type(smooth_table_t) :: tables(3)                 !! by lane block for axis 1, by element else
    real(wp), allocatable :: loads(:, :, :, :, :, :)  !! (8, p3, p2, p1, n, n_blocks)
    real(wp), allocatable :: all(:, :, :, :)          !! n_functions of the axes 1, 2, 3, n
    real(wp), allocatable :: rest(:, :, :, :)         !! of stress times volume, (8*q3, 6, q1*q2,
                                                      !! n_blocks)
  end type smooth_fields_t

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

  !> Tables and room for a patch.
  pure function new_smooth_fields(smooth, axes, lanes, has_gradients) result(fields)
    type(smooth_axis_t), intent(in) :: smooth(3)
    type(axis_table_t), intent(in) :: axes(3)
    type(lane_table_t), intent(in) :: lanes
    logical, intent(in) :: has_gradients
    type(smooth_fields_t) :: fields
    integer, allocatable :: elements(:, :)
    logical, allocatable :: is_owner(:, :)
    integer :: p(3), q(3), n_blocks, n_rows, n_means, axis, e

    p = axes%degree
    q = axes%n_points
    n_rows = axes(2)%n_elements*axes(3)%n_elements
    n_blocks = lanes%n_blocks*n_rows
    n_means = merge(3, 1, has_gradients)
    allocate (fields%loads(n_lanes, p(3), p(2), p(1), n_means, n_blocks))
    allocate (fields%all(smooth(1)%n_functions, smooth(2)%n_functions, smooth(3)%n_functions, &
                         n_means))
    allocate (fields%rest(n_lanes*q(3), 6, q(1)*q(2), n_blocks))
    fields%tables(1) = new_smooth_table(smooth(1), lanes%element, lanes%is_owner)
    do axis = 2, 3
      elements = spread([(e, e=1, axes(axis)%n_elements)], 1, n_lanes)
      is_owner = elements > 0
      fields%tables(axis) = new_smooth_table(smooth(axis), elements, is_owner)
    end do
  end function new_smooth_fields

  !> Factors for elements side by side. Lanes that repeat an element load nothing; they get its
  !! strains too, but no stress.
  pure function new_smooth_table(smooth, element, is_owner) result(table)
    type(smooth_axis_t), intent(in) :: smooth
    integer, intent(in) :: element(:, :)           !! shape (8, n)
    logical, intent(in) :: is_owner(:, :)
    type(smooth_table_t) :: table
    integer :: i, l, p, q, n

    p = size(smooth%values, 1)
    q = size(smooth%values, 2)
    n = size(element, 2)
    allocate (table%to_loads(n_lanes, q, p, n, 2), source=0.0_wp)
    allocate (table%to_points(n_lanes, p, q, n, 2), source=0.0_wp)
    do i = 1, n
      do l = 1, n_lanes
        associate (e => element(l, i))
          table%to_points(l, :, :, i, 1) = point_factors(smooth, e, .false.)
          if (.not. is_owner(l, i)) cycle
          table%to_points(l, :, :, i, 2) = point_factors(smooth, e, .true.)
          table%to_loads(l, :, :, i, 1) = transpose(point_factors(smooth, e, .true.))
          table%to_loads(l, :, :, i, 2) = transpose(point_factors(smooth, e, .false.))
        end associate
      end do
    end do
  end function new_smooth_table

  !> Coefficients of the first `n_means` fields that are projected.
  subroutine solve_for_splines(patch, smooth, n_means, fields)
    type(solid_patch_t), intent(in) :: patch
    type(smooth_axis_t), intent(in) :: smooth(3)
    integer, intent(in) :: n_means
    type(smooth_fields_t), intent(inout) :: fields
    integer :: k

    do k = 1, n_means
      call solve_all(patch, smooth, fields%loads(:, :, :, :, k, :), fields%all(:, :, :, k))
    end do
  end subroutine solve_for_splines

  !> Along all axes.
  pure subroutine solve_all(patch, smooth, loads, coefficients)
    type(solid_patch_t), intent(in) :: patch
    type(smooth_axis_t), intent(in) :: smooth(3)
    real(wp), intent(in) :: loads(:, :, :, :, :)        !! (8, p3, p2, p1, n_blocks)
    real(wp), intent(inout) :: coefficients(:, :, :)
    type(block_t) :: block
    integer :: i, j, k, a

    coefficients = 0.0_wp
    do i = 1, patch%n_blocks
      block = block_at(patch, i)
      do a = 1, size(loads, 4)
        do j = 1, size(loads, 3)
          do k = 1, size(loads, 2)
            call add_lanes(patch, block%b, a, loads(:, k, j, a, i), &
                           coefficients(:, patch%axes(2)%first(block%e2) + j - 1, &
                                        patch%axes(3)%first(block%e3) + k - 1))
          end do
        end do
      end do
    end do
    associate (n => shape(coefficients))
      call solve_rows(smooth(1), n(2)*n(3), coefficients)
      do k = 1, n(3)
        call solve_columns(smooth(2), n(1), coefficients(:, :, k))
      end do
      call solve_columns(smooth(3), n(1)*n(2), coefficients)
    end associate
  end subroutine solve_all

  !> Add the loads of spline `a` of each lane.
  pure subroutine add_lanes(patch, b, a, loads, coefficients)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: b, a
    real(wp), intent(in) :: loads(n_lanes)
    real(wp), intent(inout) :: coefficients(*)
    integer :: first(n_lanes), l

    first = patch%lanes%first(:, b) + a - 1
    if (patch%lanes%is_contiguous(b)) then
      associate (line => coefficients(first(1):first(1) + n_lanes - 1))
        line = line + loads
      end associate
    else
      do l = 1, n_lanes
        coefficients(first(l)) = coefficients(first(l)) + loads(l)
      end do
    end if
  end subroutine add_lanes

end module smooth_splines
