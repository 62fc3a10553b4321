!> One-dimensional basis tables of a patch: everything the element kernels know of the splines.
!!
!! Derivatives refer to the element-local coordinate in [-1, 1], so jacobians measure elements
!! and quadrature weights are the plain Gauss weights.
module basis_tables
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, n_spans, span_table, basis_derivatives
  implicit none
  private

  public :: axis_table_t, lane_table_t, new_axis_table, new_lane_table

  integer, parameter, public :: n_lanes = 8   !! elements of a block: one 512-bit register of reals

  !> Basis at the quadrature points of every element of one direction.
  type :: axis_table_t
    integer :: degree = 0, n_basis = 0, n_elements = 0, n_points = 0
    integer, allocatable :: first(:)          !! first control point of an element
    real(wp), allocatable :: abscissae(:)     !! of the rule in [-1, 1], shape (n_points)
    real(wp), allocatable :: weights(:)       !! of the rule, sum 2
    real(wp), allocatable :: values(:, :, :)  !! shape (degree + 1, n_points, n_elements)
    real(wp), allocatable :: slopes(:, :, :)  !! d/d(local coordinate), same shape
    real(wp), allocatable :: bends(:, :, :)   !! second derivatives, same shape
  end type axis_table_t

  !> The table of axis 1 with eight elements side by side. The last block is shifted back so that
  !! it ends with the last element; lanes that repeat an element (or pad) have weight zero.
  type :: lane_table_t
    integer :: n_blocks = 0
    integer, allocatable :: element(:, :)        !! element of a lane, shape (8, n_blocks)
    integer, allocatable :: first(:, :)          !! its first control point
    logical, allocatable :: is_owner(:, :)       !! this lane is the one that counts
    logical, allocatable :: is_contiguous(:)     !! control points of the lanes follow each other
    real(wp), allocatable :: values(:, :, :, :)  !! shape (8, degree + 1, n_points, n_blocks)
    real(wp), allocatable :: slopes(:, :, :, :)
    real(wp), allocatable :: bends(:, :, :, :)
    real(wp), allocatable :: weights(:, :, :)    !! shape (8, n_points, n_blocks)
  end type lane_table_t

contains

  !> Tables of one direction for a rule on [-1, 1].
  pure function new_axis_table(kv, abscissae, weights) result(table)
    type(knot_vector_t), intent(in) :: kv
    real(wp), intent(in) :: abscissae(:), weights(:)
    type(axis_table_t) :: table
    real(wp) :: orders(kv%degree + 1, 0:2), middle, half
    integer :: spans(n_spans(kv)), e, q

    spans = span_table(kv)
    table%degree = kv%degree
    table%n_basis = kv%n_basis
    table%n_elements = size(spans)
    table%n_points = size(abscissae)
    allocate (table%abscissae, source=abscissae)
    allocate (table%weights, source=weights)
    allocate (table%first, source=spans - kv%degree)
    allocate (table%values(kv%degree + 1, size(abscissae), size(spans)))
    allocate (table%slopes, table%bends, mold=table%values)
    do e = 1, size(spans)
      middle = 0.5_wp*(kv%knots(spans(e) + 1) + kv%knots(spans(e)))
      half = 0.5_wp*(kv%knots(spans(e) + 1) - kv%knots(spans(e)))
      do q = 1, size(abscissae)
        call basis_derivatives(kv, spans(e), middle + half*abscissae(q), 2, orders)
        table%values(:, q, e) = orders(:, 0)
        table%slopes(:, q, e) = half*orders(:, 1)
        table%bends(:, q, e) = half**2*orders(:, 2)
      end do
    end do
  end function new_axis_table

  !> Eight elements side by side.
  pure function new_lane_table(axis) result(lanes)
    type(axis_table_t), intent(in) :: axis
    type(lane_table_t) :: lanes
    integer :: n, b, l, e, start

    n = axis%n_elements
    lanes%n_blocks = (n + n_lanes - 1)/n_lanes
    allocate (lanes%element(n_lanes, lanes%n_blocks), lanes%is_owner(n_lanes, lanes%n_blocks))
    allocate (lanes%first(n_lanes, lanes%n_blocks), lanes%is_contiguous(lanes%n_blocks))
    allocate (lanes%values(n_lanes, axis%degree + 1, axis%n_points, lanes%n_blocks))
    allocate (lanes%slopes, lanes%bends, mold=lanes%values)
    allocate (lanes%weights(n_lanes, axis%n_points, lanes%n_blocks))
    do b = 1, lanes%n_blocks
      start = max(1, min((b - 1)*n_lanes + 1, n - n_lanes + 1))
      do l = 1, n_lanes
        e = min(start + l - 1, n)
        lanes%element(l, b) = e
        lanes%first(l, b) = axis%first(e)
        lanes%is_owner(l, b) = e > (b - 1)*n_lanes .and. start + l - 1 <= n
        lanes%values(l, :, :, b) = axis%values(:, :, e)
        lanes%slopes(l, :, :, b) = axis%slopes(:, :, e)
        lanes%bends(l, :, :, b) = axis%bends(:, :, e)
        lanes%weights(l, :, b) = merge(1.0_wp, 0.0_wp, lanes%is_owner(l, b))*axis%weights
      end do
      lanes%is_contiguous(b) = all(lanes%first(2:, b) == lanes%first(:n_lanes - 1, b) + 1)
    end do
  end function new_lane_table

end module basis_tables
