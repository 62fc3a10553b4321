!> From the lines of a blank of shells to the springs that keep their angles.
module joint_setup
  use kinds, only: wp
  use bucket_lists, only: sort_into_buckets
  use knot_vector, only: span_table, n_spans, basis_derivatives
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use gauss_rule, only: gauss_rule_t
  use patch_seams, only: seams_t
  use basis_tables, only: n_lanes
  use element, only: part_t
  use joint_lines, only: side_t, joint_line_t, find_joint_lines
  use shell_joints, only: shell_joints_t, set_rest, firmness
  implicit none
  private

  public :: new_shell_joints

  !> The sheet beside one element along a line: of the line's control points and those next to them,
  !! and of its points of integration. All run as the first side of the line does.
  type :: strip_t
    integer, allocatable :: places(:, :)         !! axis 1 fastest, shape (nodes, 2 rows)
    real(wp), allocatable, dimension(:, :) :: along, near, far   !! as in `shell_joints_t`
    real(wp), allocatable :: measure(:)          !! of the line, by point [length]
    real(wp), allocatable :: size_of(:)          !! of the elements, across it [length]
    real(wp), allocatable :: thickness(:)        !! [length]
  end type strip_t

  !> Control points of the elements of all lines, as of one grid each.
  type :: cells_t
    integer, allocatable :: part(:, :)           !! of the rows, shape (3, n)
    integer, allocatable :: place(:, :, :)       !! axis 1 fastest, shape (nodes, 3, n)
  end type cells_t

contains

  !> Springs along all lines of the parts, whose motion is that of the start; as hinges lines
  !! have none.
  subroutine new_shell_joints(parts, sheets, seams, are_hinges, joints)
    type(part_t), intent(in) :: parts(:)
    type(nurbs_solid_t), intent(in) :: sheets(:)       !! solids that the parts are mid-surfaces of
    type(seams_t), intent(in) :: seams
    logical, intent(in) :: are_hinges
    type(shell_joints_t), intent(out) :: joints
    type(joint_line_t), allocatable :: lines(:)
    type(nurbs_solid_t) :: middles(size(parts))
    type(cells_t) :: cells
    integer :: p, i, e, cell

    do p = 1, size(parts)
      middles(p) = parts(p)%element%grid
    end do
    lines = find_joint_lines(middles, seams)
    joints%n_lines = size(lines)
    if (are_hinges) return
    call make_room(parts, lines, joints, cells)
    cell = 0
    do i = 1, size(lines)
      associate (side => lines(i)%sides(1))
        do e = 1, n_spans(middles(side%part)%axes(3 - side%across))
          cell = cell + 1
          call add_cell(parts, sheets, lines(i), e, cell, joints, cells)
        end do
      end associate
    end do
    call fill_block(joints, cells)
    call number_nodes(parts, joints, cells)
    call set_rest(joints, parts)
  end subroutine new_shell_joints

  subroutine make_room(parts, lines, joints, cells)
    type(part_t), intent(in) :: parts(:)
    type(joint_line_t), intent(in) :: lines(:)
    type(shell_joints_t), intent(inout) :: joints
    type(cells_t), intent(out) :: cells
    integer :: i, along

    do i = 1, size(lines)
      along = 3 - lines(i)%sides(1)%across
      associate (one => parts(lines(i)%sides(1)%part)%element)
        joints%n_cells = joints%n_cells + n_spans(one%grid%axes(along))
        joints%n_nodes = max(joints%n_nodes, one%grid%axes(along)%degree + 1)
        joints%n_points = max(joints%n_points, one%rule(along)%n)
      end associate
    end do
    associate (n => joints%n_nodes, q => joints%n_points, &
               b => (joints%n_cells + n_lanes - 1)/n_lanes)
      allocate (cells%part(3, n_lanes*b), cells%place(n, 3, n_lanes*b))
      allocate (joints%along(n_lanes, n, q, b), joints%near(n_lanes, n, 2, q, b), &
                joints%far(n_lanes, n, 2, q, b), joints%nominal(n_lanes, q, b), source=0.0_wp)
      allocate (joints%rest(n_lanes, 2, q, b), joints%forces(n_lanes, n, 3, 3, b), &
                joints%energies(b), joints%stiffness(n_lanes, q, b), source=0.0_wp)
    end associate
  end subroutine make_room

  !> The last block's lanes beyond the last cell are copies of that without stiffness.
  pure subroutine fill_block(joints, cells)
    type(shell_joints_t), intent(inout) :: joints
    type(cells_t), intent(inout) :: cells
    integer :: l, last, b

    b = size(joints%energies)
    if (b == 0) return
    last = joints%n_cells - n_lanes*(b - 1)
    do l = last + 1, n_lanes
      joints%along(l, :, :, b) = joints%along(last, :, :, b)
      joints%near(l, :, :, :, b) = joints%near(last, :, :, :, b)
      joints%far(l, :, :, :, b) = joints%far(last, :, :, :, b)
      cells%part(:, n_lanes*(b - 1) + l) = cells%part(:, joints%n_cells)
      cells%place(:, :, n_lanes*(b - 1) + l) = cells%place(:, :, joints%n_cells)
    end do
  end subroutine fill_block

  !> Number the control points of all cells by part, and list where forces on each come from.
  pure subroutine number_nodes(parts, joints, cells)
    type(part_t), intent(in) :: parts(:)
    type(shell_joints_t), intent(inout) :: joints
    type(cells_t), intent(in) :: cells
    integer, allocatable :: number(:)
    integer :: p, n, i, row, cell, l, b

    allocate (joints%start(size(parts) + 1), joints%place(0))
    allocate (joints%node(n_lanes, joints%n_nodes, 3, size(joints%energies)))
    n = 0
    do p = 1, size(parts)
      joints%start(p) = n + 1
      number = [(0, i=1, size(parts(p)%element%mass))]
      do cell = 1, size(cells%part, 2)
        b = (cell - 1)/n_lanes + 1
        l = cell - n_lanes*(b - 1)
        do row = 1, 3
          if (cells%part(row, cell) /= p) cycle
          do i = 1, joints%n_nodes
            associate (at => cells%place(i, row, cell))
              if (number(at) == 0) then
                n = n + 1
                number(at) = n
                joints%place = [joints%place, at]
              end if
              joints%node(l, i, row, b) = number(at)
            end associate
          end do
        end do
      end do
    end do
    joints%start(size(parts) + 1) = n + 1
    allocate (joints%x(n, 3), source=0.0_wp)
    call list_shares(joints)
  end subroutine number_nodes

  !> Where forces on each control point come from, lanes that fill the last block up left out.
  pure subroutine list_shares(joints)
    type(shell_joints_t), intent(inout) :: joints
    integer, dimension(3*joints%n_nodes*joints%n_cells) :: node, share
    integer :: i, row, cell, l, b, n

    n = 0
    do cell = 1, joints%n_cells
      b = (cell - 1)/n_lanes + 1
      l = cell - n_lanes*(b - 1)
      do row = 1, 3
        do i = 1, joints%n_nodes
          n = n + 1
          node(n) = joints%node(l, i, row, b)
          share(n) = l + n_lanes*(i - 1 + joints%n_nodes*(3*(row - 1 + 3*(b - 1))))
        end do
      end do
    end do
    call sort_into_buckets(size(joints%place), node, node, joints%first, joints%share)
    joints%share = share(joints%share)
  end subroutine list_shares

  !> One element along a line. Where other lines have more control points or points of integration
  !! in one, the last ones are repeated without weight.
  subroutine add_cell(parts, sheets, line, e, cell, joints, cells)
    type(part_t), intent(in) :: parts(:)
    type(nurbs_solid_t), intent(in) :: sheets(:)
    type(joint_line_t), intent(in) :: line
    integer, intent(in) :: e, cell         !! element along the first side, number of the cell
    type(shell_joints_t), intent(inout) :: joints
    type(cells_t), intent(inout) :: cells
    type(strip_t) :: strips(2)
    real(wp) :: length, h
    integer :: b, l, q, m, s, from

    b = (cell - 1)/n_lanes + 1
    l = cell - n_lanes*(b - 1)
    associate (one => line%sides(1), rule => parts(line%sides(1)%part)%element &
               %rule(3 - line%sides(1)%across))
      do s = 1, 2
        associate (p => line%sides(s)%part)
          call new_strip(parts(p)%element%grid, sheets(p), line%sides(s), e, rule, strips(s))
        end associate
      end do
      m = size(strips(1)%places, 1)
      cells%part(:, cell) = [one%part, one%part, line%sides(2)%part]
      cells%place(:, 1, cell) = strips(1)%places([(min(q, m), q=1, joints%n_nodes)], 1)
      do s = 1, 2
        cells%place(:, 1 + s, cell) = strips(s)%places([(min(q, m), q=1, joints%n_nodes)], 2)
      end do
      do q = 1, joints%n_points
        from = min(q, rule%n)
        joints%along(l, :m, q, b) = strips(1)%along(:, from)
        do s = 1, 2
          joints%near(l, :m, s, q, b) = strips(s)%near(:, from)
          joints%far(l, :m, s, q, b) = strips(s)%far(:, from)
        end do
        if (q > rule%n) cycle
        length = 0.5_wp*(strips(1)%size_of(q) + strips(2)%size_of(q))
        if (.not. length > 0.0_wp) cycle   ! a pole
        h = min(strips(1)%thickness(q), strips(2)%thickness(q))
        joints%nominal(l, q, b) = firmness*h**3/(12.0_wp*length)*2.0_wp/line%n_sheets &
                                  *rule%weights(q)*strips(1)%measure(q)
      end do
    end associate
  end subroutine add_cell

  !> One side of an element along a line.
  subroutine new_strip(middle, sheet, side, e, rule, strip)
    type(nurbs_solid_t), intent(in) :: middle, sheet
    type(side_t), intent(in) :: side
    integer, intent(in) :: e                     !! element along the first side of the line
    type(gauss_rule_t), intent(in) :: rule       !! along the line
    type(strip_t), intent(out) :: strip
    integer :: spans(n_spans(middle%axes(3 - side%across)))
    integer :: span, order, i, j, q
    real(wp) :: xi, low, high

    associate (axis => middle%axes(3 - side%across), n => rule%n)
      associate (m => axis%degree + 1)
        allocate (strip%places(m, 2), strip%along(m, n), strip%near(m, n), strip%far(m, n), &
                  strip%measure(n), strip%size_of(n), strip%thickness(n))
        spans = span_table(axis)
        order = merge(-1, 1, side%is_reversed)
        span = spans(merge(size(spans) + 1 - e, e, side%is_reversed))
        do i = 1, m
          j = merge(span + 1 - i, span - m + i, side%is_reversed)
          if (side%across == 1) strip%places(i, :) = [side%row, side%next] &
                                                     + middle%axes(1)%n_basis*(j - 1)
          if (side%across == 2) strip%places(i, :) = j + middle%axes(1)%n_basis &
                                                     *([side%row, side%next] - 1)
        end do
      end associate
      low = axis%knots(span)
      high = axis%knots(span + 1)
      do q = 1, n
        xi = 0.5_wp*(low + high + order*(high - low)*rule%points(q))
        call set_point(middle, side, span, xi, q, strip)
        strip%measure(q) = 0.5_wp*(high - low)*strip%measure(q)
        strip%thickness(q) = thickness_at(sheet, side, xi)
      end do
    end associate
  end subroutine new_strip

  !> A point of integration: the basis functions there and what follows from the shape.
  subroutine set_point(middle, side, span, xi, q, strip)
    type(nurbs_solid_t), intent(in) :: middle
    type(side_t), intent(in) :: side
    integer, intent(in) :: span, q
    real(wp), intent(in) :: xi                   !! along the line, own coordinate of the side
    type(strip_t), intent(inout) :: strip
    real(wp) :: basis(size(strip%places, 1), 0:1), x(size(strip%places, 1), 3, 2)
    real(wp) :: w(size(strip%places, 1), 2), slope, t(3), g(3)

    call basis_derivatives(middle%axes(3 - side%across), span, xi, 1, basis)
    if (side%is_reversed) basis = basis(size(basis, 1):1:-1, :)
    call read_rows(size(middle%weights), strip%places, middle%points, middle%weights, x, w)
    associate (axis => middle%axes(side%across), i => max(side%row, side%next))
      slope = axis%degree/(axis%knots(i + axis%degree) - axis%knots(i))
      associate (total => sum(basis(:, 0)*w(:, 1)))
        strip%along(:, q) = (basis(:, 1) - basis(:, 0)*sum(basis(:, 1)*w(:, 1))/total)*w(:, 1)/total
        strip%far(:, q) = slope*basis(:, 0)*w(:, 2)/total
        strip%near(:, q) = -sum(strip%far(:, q))*basis(:, 0)*w(:, 1)/total
      end associate
      t = matmul(strip%along(:, q), x(:, :, 1))
      g = matmul(strip%near(:, q), x(:, :, 1)) + matmul(strip%far(:, q), x(:, :, 2))
      strip%measure(q) = norm2(t)
      strip%size_of(q) = axis%degree/slope*norm2(g - dot_product(g, t)/dot_product(t, t)*t)
    end associate
  end subroutine set_point

  !> Control points and weights of the line and of the row next to it.
  pure subroutine read_rows(n, places, points, weights, x, w)
    integer, intent(in) :: n, places(:, :)
    real(wp), intent(in) :: points(n, 3), weights(n)
    real(wp), intent(out) :: x(:, :, :), w(:, :)
    integer :: row

    do row = 1, 2
      x(:, :, row) = points(places(:, row), :)
      w(:, row) = weights(places(:, row))
    end do
  end subroutine read_rows

  !> Distance of the faces of the sheet at a point of a line.
  pure real(wp) function thickness_at(sheet, side, along) result(thickness)
    type(nurbs_solid_t), intent(in) :: sheet
    type(side_t), intent(in) :: side
    real(wp), intent(in) :: along                !! coordinate along the line
    real(wp) :: xi(3), low(3), high(3)

    xi(3 - side%across) = along
    associate (axis => sheet%axes(side%across))
      ! The knot at which a control point lies that the surface goes through.
      xi(side%across) = axis%knots(side%row + 1)
    end associate
    associate (knots => sheet%axes(3)%knots)
      xi(3) = knots(1)
      call evaluate_solid(sheet, xi, low)
      xi(3) = knots(size(knots))
      call evaluate_solid(sheet, xi, high)
    end associate
    thickness = norm2(high - low)
  end function thickness_at

end module joint_setup
