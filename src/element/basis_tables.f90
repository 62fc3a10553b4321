!> One-dimensional basis tables of a patch: everything the element kernels know of the splines.
!!
!! Derivatives refer to the element-local coordinate in [-1, 1], so jacobians measure elements
!! and quadrature weights are the plain Gauss weights.
module basis_tables
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, n_spans, span_table, basis_derivatives
  implicit none
  private

  public :: axis_table_t, lane_table_t, cut_table_t, new_axis_table, new_lane_table, &
            new_trimmed_lanes

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

  !> Basis at points that lie anywhere in their elements, which an outline cuts: for each lane its
  !! own along both axes of the sheet, by row of points (`row_of_point`).
  type :: cut_table_t
    real(wp), allocatable, dimension(:, :, :, :) :: values1, slopes1, bends1  !! (8, p1 + 1, q, n)
    real(wp), allocatable, dimension(:, :, :, :) :: values2, slopes2, bends2  !! (8, p2 + 1, q, n)
    real(wp), allocatable :: places(:, :, :, :)  !! in the element, from -1 to 1, (8, 2, q, n)
    real(wp), allocatable :: weights(:, :, :)    !! (8, q, n), zero where a lane does not count
  end type cut_table_t

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
    ! Of a sheet with an outline alone, whose blocks hold what lies inside, row by row along axis 2:
    logical :: is_trimmed = .false.
    integer, allocatable :: row(:)               !! place of a block along axis 2
    integer, allocatable :: row_first(:)         !! first block of each row, (n2 + 1)
    integer, allocatable :: cut_number(:)        !! of a block of cut elements in `cut`, 0: another
    integer, allocatable :: at(:, :, :)          !! block and lane of each element, (2, n1, n2); of
                                                 !! one outside those of the nearest inside
    logical, allocatable :: is_kept(:, :)        !! elements that are inside or cut, (n1, n2)
    type(cut_table_t) :: cut
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
        lanes%is_owner(l, b) = e > (b - 1)*n_lanes .and. start + l - 1 <= n
      end do
      call fill_lanes(axis, b, lanes)
    end do
  end function new_lane_table

  !> Basis of the elements of a block.
  pure subroutine fill_lanes(axis, b, lanes)
    type(axis_table_t), intent(in) :: axis
    integer, intent(in) :: b
    type(lane_table_t), intent(inout) :: lanes
    integer :: l, e

    do l = 1, n_lanes
      e = lanes%element(l, b)
      lanes%first(l, b) = axis%first(e)
      lanes%values(l, :, :, b) = axis%values(:, :, e)
      lanes%slopes(l, :, :, b) = axis%slopes(:, :, e)
      lanes%bends(l, :, :, b) = axis%bends(:, :, e)
      lanes%weights(l, :, b) = merge(1.0_wp, 0.0_wp, lanes%is_owner(l, b))*axis%weights
    end do
    lanes%is_contiguous(b) = all(lanes%first(2:, b) == lanes%first(:n_lanes - 1, b) + 1)
  end subroutine fill_lanes

  !> Lanes of a sheet of which an outline keeps a part: whole elements in blocks of their own, then
  !! the cut ones of the row. The points of a cut element are those of a whole one, moved by the
  !! affine map that gives them its area, its centre and its second moments: positive weights, as
  !! many points, and nothing changes where the cut follows the grid.
  pure subroutine new_trimmed_lanes(kv, axes, moments, lanes)
    type(knot_vector_t), intent(in) :: kv(2)
    type(axis_table_t), intent(in) :: axes(2)
    real(wp), intent(in) :: moments(:, :, :)      !! of `cut_cells`, (6, n1, n2)
    type(lane_table_t), intent(out) :: lanes
    logical :: is_whole(size(moments, 2), size(moments, 3))
    integer :: n(2), n_blocks, n_cut, j, i

    n = axes%n_elements
    lanes%is_trimmed = .true.
    lanes%is_kept = moments(1, :, :) > 0.0_wp
    is_whole = moments(1, :, :) >= 4.0_wp
    n_cut = sum([(blocks_for(count(lanes%is_kept(:, j) .and. .not. is_whole(:, j))), j=1, n(2))])
    n_blocks = n_cut + sum([(blocks_for(count(is_whole(:, j))), j=1, n(2))])
    lanes%n_blocks = 0
    allocate (lanes%element(n_lanes, n_blocks), lanes%is_owner(n_lanes, n_blocks))
    allocate (lanes%first(n_lanes, n_blocks), lanes%is_contiguous(n_blocks))
    allocate (lanes%values(n_lanes, axes(1)%degree + 1, axes(1)%n_points, n_blocks))
    allocate (lanes%slopes, lanes%bends, mold=lanes%values)
    allocate (lanes%weights(n_lanes, axes(1)%n_points, n_blocks))
    allocate (lanes%row(n_blocks), lanes%row_first(n(2) + 1), lanes%cut_number(n_blocks))
    allocate (lanes%at(2, n(1), n(2)), source=0)
    call new_cut_table(axes, n_cut, lanes%cut)
    n_cut = 0
    do j = 1, n(2)
      lanes%row_first(j) = lanes%n_blocks + 1
      call add_blocks(axes(1), pack([(i, i=1, n(1))], is_whole(:, j)), j, lanes)
      lanes%cut_number(lanes%row_first(j):lanes%n_blocks) = 0
      i = lanes%n_blocks
      call add_blocks(axes(1), pack([(i, i=1, n(1))], lanes%is_kept(:, j) .and. &
                                    .not. is_whole(:, j)), j, lanes)
      do i = i + 1, lanes%n_blocks
        n_cut = n_cut + 1
        lanes%cut_number(i) = n_cut
        call fill_cut_block(kv, axes, moments(:, :, j), i, lanes)
      end do
    end do
    lanes%row_first(n(2) + 1) = lanes%n_blocks + 1
    call send_outside(lanes%at)
  end subroutine new_trimmed_lanes

  pure integer function blocks_for(n_elements)
    integer, intent(in) :: n_elements

    blocks_for = (n_elements + n_lanes - 1)/n_lanes
  end function blocks_for

  !> Blocks of some elements of a row; the last one is shifted back, or filled up with its last
  !! element.
  pure subroutine add_blocks(axis, elements, row, lanes)
    type(axis_table_t), intent(in) :: axis
    integer, intent(in) :: elements(:), row
    type(lane_table_t), intent(inout) :: lanes
    integer :: n, k, l, place, start

    n = size(elements)
    do k = 1, blocks_for(n)
      lanes%n_blocks = lanes%n_blocks + 1
      associate (b => lanes%n_blocks)
        start = max(1, min((k - 1)*n_lanes + 1, n - n_lanes + 1))
        lanes%row(b) = row
        do l = 1, n_lanes
          place = min(start + l - 1, n)
          lanes%element(l, b) = elements(place)
          lanes%is_owner(l, b) = place > (k - 1)*n_lanes .and. start + l - 1 <= n
          if (lanes%is_owner(l, b)) lanes%at(:, elements(place), row) = [b, l]
        end do
        call fill_lanes(axis, b, lanes)
      end associate
    end do
  end subroutine add_blocks

  pure subroutine new_cut_table(axes, n_cut, cut)
    type(axis_table_t), intent(in) :: axes(2)
    integer, intent(in) :: n_cut
    type(cut_table_t), intent(out) :: cut
    integer :: q

    q = product(axes%n_points)
    allocate (cut%values1(n_lanes, axes(1)%degree + 1, q, n_cut))
    allocate (cut%slopes1, cut%bends1, mold=cut%values1)
    allocate (cut%values2(n_lanes, axes(2)%degree + 1, q, n_cut))
    allocate (cut%slopes2, cut%bends2, mold=cut%values2)
    allocate (cut%places(n_lanes, 2, q, n_cut), cut%weights(n_lanes, q, n_cut))
  end subroutine new_cut_table

  !> Points and basis of a block of cut elements.
  pure subroutine fill_cut_block(kv, axes, moments, b, lanes)
    type(knot_vector_t), intent(in) :: kv(2)
    type(axis_table_t), intent(in) :: axes(2)
    real(wp), intent(in) :: moments(:, :)         !! of the row
    integer, intent(in) :: b
    type(lane_table_t), intent(inout) :: lanes
    real(wp) :: places(2, product(axes%n_points)), weights(product(axes%n_points))
    real(wp) :: one(axes(1)%degree + 1, 0:2), two(axes(2)%degree + 1, 0:2)
    integer :: l, k

    associate (c => lanes%cut_number(b), cut => lanes%cut)
      do l = 1, n_lanes
        call cut_rule(axes, moments(:, lanes%element(l, b)), places, weights)
        cut%weights(l, :, c) = merge(1.0_wp, 0.0_wp, lanes%is_owner(l, b))*weights
        do k = 1, size(weights)
          call local_basis(kv(1), lanes%first(l, b), places(1, k), one)
          call local_basis(kv(2), axes(2)%first(lanes%row(b)), places(2, k), two)
          cut%places(l, :, k, c) = places(:, k)
          cut%values1(l, :, k, c) = one(:, 0)
          cut%slopes1(l, :, k, c) = one(:, 1)
          cut%bends1(l, :, k, c) = one(:, 2)
          cut%values2(l, :, k, c) = two(:, 0)
          cut%slopes2(l, :, k, c) = two(:, 1)
          cut%bends2(l, :, k, c) = two(:, 2)
        end do
      end do
    end associate
  end subroutine fill_cut_block

  !> Basis and its derivatives by the local coordinate.
  pure subroutine local_basis(kv, first, at, orders)
    type(knot_vector_t), intent(in) :: kv
    integer, intent(in) :: first                  !! control point of the element
    real(wp), intent(in) :: at                    !! from -1 to 1
    real(wp), intent(out) :: orders(kv%degree + 1, 0:2)
    real(wp) :: half

    associate (low => kv%knots(first + kv%degree), high => kv%knots(first + kv%degree + 1))
      half = 0.5_wp*(high - low)
      call basis_derivatives(kv, first + kv%degree, 0.5_wp*(low + high) + half*at, 2, orders)
    end associate
    orders(:, 1) = half*orders(:, 1)
    orders(:, 2) = half**2*orders(:, 2)
  end subroutine local_basis

  !> The rule of a cut element. With its mean m and the second moments S about it, per area, the
  !! points are m + 3^(1/2) S^(1/2) x of those of the rule on the square, for which S is 1/3.
  pure subroutine cut_rule(axes, moments, places, weights)
    type(axis_table_t), intent(in) :: axes(2)
    real(wp), intent(in) :: moments(6)
    real(wp), intent(out) :: places(2, product(axes%n_points)), weights(product(axes%n_points))
    real(wp), parameter :: least = 1.0e-12_wp       ! of a moment, that round-off may make negative
    real(wp) :: mean(2), s(3), root, trace
    integer :: qa, qb, k

    mean = moments(2:3)/moments(1)
    s = 3.0_wp*(moments(4:6)/moments(1) - [mean(1)**2, mean(1)*mean(2), mean(2)**2])
    s([1, 3]) = max(s([1, 3]), least)
    s(2) = sign(min(abs(s(2)), sqrt(s(1)*s(3))), s(2))
    ! The square root of a symmetric matrix of two rows, (S + r I)/t.
    root = sqrt(max(s(1)*s(3) - s(2)**2, 0.0_wp))
    trace = sqrt(s(1) + s(3) + 2.0_wp*root)
    s = (s + [root, 0.0_wp, root])/trace
    do qa = 1, axes(1)%n_points
      do qb = 1, axes(2)%n_points
        k = qb + axes(2)%n_points*(qa - 1)
        associate (x => axes(1)%abscissae(qa), y => axes(2)%abscissae(qb))
          places(:, k) = mean + [s(1)*x + s(2)*y, s(2)*x + s(3)*y]
        end associate
        weights(k) = 0.25_wp*moments(1)*axes(1)%weights(qa)*axes(2)%weights(qb)
      end do
    end do
  end subroutine cut_rule

  !> Elements outside go where their nearest neighbours are, row by row from those that are known.
  pure subroutine send_outside(at)
    integer, intent(inout) :: at(:, :, :)
    integer :: before(2, size(at, 2), size(at, 3)), i, j

    if (maxval(at) == 0) return
    do while (any(at(1, :, :) == 0))
      before = at
      do j = 1, size(at, 3)
        do i = 1, size(at, 2)
          if (at(1, i, j) > 0) cycle
          if (i > 1) at(:, i, j) = before(:, i - 1, j)
          if (at(1, i, j) == 0 .and. i < size(at, 2)) at(:, i, j) = before(:, i + 1, j)
          if (at(1, i, j) == 0 .and. j > 1) at(:, i, j) = before(:, i, j - 1)
          if (at(1, i, j) == 0 .and. j < size(at, 3)) at(:, i, j) = before(:, i, j + 1)
        end do
      end do
    end do
  end subroutine send_outside

end module basis_tables
