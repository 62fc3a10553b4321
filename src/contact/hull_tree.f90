!> Surfaces cut into ever smaller parts, each with points around it: what bounds of distances need.
!!
!! A node is a range of faces, a face, or a part of one. Nodes are cut when somebody asks for their
!! halves, across the direction that is wanted.
module hull_tree
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, n_spans, span_table
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use bezier, only: bezier_hulls
  use contact_territory, only: contact_territory_t, new_territory
  use tool_cells, only: halve
  implicit none
  private

  public :: hull_node_t, hull_tree_t, new_hull_tree, clear, cut_node, rises_of

  !> Part of a surface. It lies in the convex hull of `points`.
  type :: hull_node_t
    integer :: surface = 0
    integer :: low(2) = 1, high(2) = 1        !! first and last face along xi and eta
    real(wp) :: from(2) = 0.0_wp, to(2) = 1.0_wp   !! where it begins and ends along xi and eta
    real(wp), allocatable :: hull(:, :, :)    !! Bezier points of a face or of a part of one,
                                              !! homogeneous, (4, p + 1, q + 1); else not there
    real(wp), allocatable :: points(:, :)     !! these points, or the corners of a box (3, n)
    real(wp) :: corners(3, 4) = 0.0_wp        !! of the part itself: xi runs first
    real(wp) :: middle(3) = 0.0_wp            !! mean of `points`
    real(wp) :: normal(3) = 0.0_wp            !! mean one
    real(wp) :: box(3, 2) = 0.0_wp            !! corners of the box around `points` along x, y, z
    real(wp) :: size(2) = 0.0_wp              !! longest lines of points along xi and eta
    real(wp) :: bend(2) = 0.0_wp              !! largest sagitta of these lines, or twist
    integer :: halves(2, 2) = 0               !! nodes of both halves, of a cut across xi and eta
  end type hull_node_t

  !> Surfaces with their nodes, the first of which are the surfaces as a whole.
  type :: hull_tree_t
    type(nurbs_surface_t), allocatable :: surfaces(:)
    integer :: n = 0
    type(hull_node_t), allocatable :: nodes(:)
  end type hull_tree_t

contains

  !> A tree of nothing but whole surfaces. Their weights must be positive.
  pure subroutine new_hull_tree(tree, surfaces)
    type(hull_tree_t), intent(out) :: tree
    type(nurbs_surface_t), intent(in) :: surfaces(:)

    tree%surfaces = surfaces
    call clear(tree)
  end subroutine new_hull_tree

  !> Forget all nodes but the whole surfaces.
  pure subroutine clear(tree)
    type(hull_tree_t), intent(inout) :: tree
    integer :: s

    if (allocated(tree%nodes)) deallocate (tree%nodes)
    allocate (tree%nodes(64 + size(tree%surfaces)))
    tree%n = 0
    do s = 1, size(tree%surfaces)
      call add_range(tree, s, [1, 1], [n_spans(tree%surfaces(s)%axes(1)), &
                                       n_spans(tree%surfaces(s)%axes(2))])
    end do
  end subroutine clear

  !> Halves of a node across a direction, 1 for xi and 2 for eta. A range that is one face wide
  !! there is cut the other way.
  pure subroutine cut_node(tree, index, direction, halves)
    type(hull_tree_t), intent(inout) :: tree
    integer, intent(in) :: index, direction
    integer, intent(out) :: halves(2)          !! nodes
    type(hull_node_t) :: node
    real(wp), allocatable :: parts(:, :, :, :)
    integer :: side, middle, low(2), high(2), d

    d = direction
    associate (whole => tree%nodes(index))
      if (.not. allocated(whole%hull) .and. whole%low(d) == whole%high(d)) d = 3 - d
      halves = whole%halves(:, d)
      if (halves(1) > 0) return
      halves = tree%n + [1, 2]
      whole%halves(:, d) = halves
      node = whole
    end associate
    if (allocated(node%hull)) then
      allocate (parts(4, size(node%hull, 2), size(node%hull, 3), 2))
      call halve(node%hull, d, parts)
      middle = 0
    else
      middle = (node%low(d) + node%high(d))/2
    end if
    do side = 1, 2
      if (middle > 0) then
        low = node%low
        high = node%high
        if (side == 1) high(d) = middle
        if (side == 2) low(d) = middle + 1
        call add_range(tree, node%surface, low, high)
      else
        call add_part(tree, node, d, side, parts(:, :, :, side))
      end if
    end do
  end subroutine cut_node

  !> How far lines of points along xi and along eta rise and fall along a vector.
  pure function rises_of(node, across) result(rises)
    type(hull_node_t), intent(in) :: node
    real(wp), intent(in) :: across(3)          !! unit vector
    real(wp) :: rises(2)                       !! [length]
    real(wp), allocatable :: heights(:, :)

    if (allocated(node%hull)) then
      heights = reshape(matmul(across, node%points), [size(node%hull, 2), size(node%hull, 3)])
      rises = [maxval(maxval(heights, 1) - minval(heights, 1)), &
               maxval(maxval(heights, 2) - minval(heights, 2))]
    else
      rises = [rise_of(node%corners(:, [2, 4]) - node%corners(:, [1, 3])), &
               rise_of(node%corners(:, [3, 4]) - node%corners(:, [1, 2]))]
    end if

  contains

    pure real(wp) function rise_of(sides)
      real(wp), intent(in) :: sides(3, 2)

      rise_of = maxval(abs(matmul(across, sides)))
    end function rise_of

  end function rises_of

  !> Append a range of faces of a surface, which may be one face.
  pure subroutine add_range(tree, surface, low, high)
    type(hull_tree_t), intent(inout) :: tree
    integer, intent(in) :: surface, low(2), high(2)
    type(hull_node_t) :: node
    real(wp), allocatable :: net(:, :, :)
    integer :: spans(2, 2), d, i, j

    node%surface = surface
    node%low = low
    node%high = high
    associate (from => tree%surfaces(surface))
      do d = 1, 2
        spans(:, d) = ends_of(from%axes(d), low(d), high(d))
        node%from(d) = from%axes(d)%knots(spans(1, d))
        node%to(d) = from%axes(d)%knots(spans(2, d) + 1)
      end do
      if (all(low == high)) then
        node%hull = face_hull(from, spans(1, :))
        call add_node(tree, node)
        return
      end if
      net = from%points(spans(1, 1) - from%axes(1)%degree:spans(2, 1), &
                        spans(1, 2) - from%axes(2)%degree:spans(2, 2), :)
      do j = 0, 1
        do i = 0, 1
          call evaluate_surface(from, merge(node%to, node%from, [i, j] == 1), &
                                node%corners(:, 1 + i + 2*j))
        end do
      end do
    end associate
    call enclose_net(node, net)
    call add_node(tree, node)
  end subroutine add_range

  !> Knot spans of the first and the last face of a range.
  pure function ends_of(axis, low, high) result(ends)
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: low, high
    integer :: ends(2)
    integer :: spans(n_spans(axis))

    spans = span_table(axis)
    ends = spans([low, high])
  end function ends_of

  !> Bezier points of the face in these knot spans, homogeneous.
  pure function face_hull(surface, spans) result(hull)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: spans(2)
    real(wp), allocatable :: hull(:, :, :)
    type(nurbs_surface_t) :: face
    real(wp), allocatable :: hulls(:, :, :, :)
    integer :: d

    do d = 1, 2
      associate (axis => surface%axes(d))
        face%axes(d)%degree = axis%degree
        face%axes(d)%n_basis = axis%degree + 1
        face%axes(d)%knots = axis%knots(spans(d) - axis%degree:spans(d) + axis%degree + 1)
      end associate
    end do
    associate (p => surface%axes(1)%degree, q => surface%axes(2)%degree)
      face%points = surface%points(spans(1) - p:spans(1), spans(2) - q:spans(2), :)
      face%weights = surface%weights(spans(1) - p:spans(1), spans(2) - q:spans(2))
      allocate (hulls(4, p + 1, q + 1, 1))
    end associate
    call bezier_hulls(face, hulls)
    hull = hulls(:, :, :, 1)
  end function face_hull

  !> Append one half of a face or of a part of one.
  pure subroutine add_part(tree, whole, d, side, hull)
    type(hull_tree_t), intent(inout) :: tree
    type(hull_node_t), intent(in) :: whole
    integer, intent(in) :: d, side
    real(wp), intent(in) :: hull(:, :, :)      !! Bezier points of the half, homogeneous
    type(hull_node_t) :: node

    node%surface = whole%surface
    node%low = whole%low
    node%high = whole%high
    node%from = whole%from
    node%to = whole%to
    if (side == 1) node%to(d) = 0.5_wp*(whole%from(d) + whole%to(d))
    if (side == 2) node%from(d) = 0.5_wp*(whole%from(d) + whole%to(d))
    node%hull = hull
    call add_node(tree, node)
  end subroutine add_part

  !> Corners of a box along the directions of a net of control points, which encloses it.
  pure subroutine enclose_net(node, net)
    type(hull_node_t), intent(inout) :: node
    real(wp), intent(in) :: net(:, :, :)       !! shape (n1, n2, 3)
    type(contact_territory_t) :: territory
    real(wp) :: corner(3)
    integer :: i

    call new_territory(territory, net)
    allocate (node%points(3, 8))
    do i = 0, 7
      corner = merge(territory%high, territory%low, [btest(i, 0), btest(i, 1), btest(i, 2)])
      node%points(:, i + 1) = territory%centre + matmul(territory%axes, corner)
    end do
    node%normal = territory%axes(:, 3)
    call measure(node, net)
  end subroutine enclose_net

  !> Length and sagitta of the lines of a net, whose normal must be known. A twist out of the plane
  !! is a bend both ways.
  pure subroutine measure(node, net)
    type(hull_node_t), intent(inout) :: node
    real(wp), intent(in) :: net(:, :, :)       !! shape (n1, n2, 3)
    real(wp) :: twist

    associate (n => size(net, 1), m => size(net, 2))
      node%size = [maxval(sum(norm2(net(2:, :, :) - net(:n - 1, :, :), 3), 1)), &
                   maxval(sum(norm2(net(:, 2:, :) - net(:, :m - 1, :), 3), 2))]
      twist = 0.25_wp*abs(dot_product(net(1, 1, :) - net(n, 1, :) - net(1, m, :) + net(n, m, :), &
                                      node%normal))
      node%bend = max(twist, [sagitta_of(net), &
                              sagitta_of(reshape(net, [m, n, 3], order=[2, 1, 3]))])
    end associate
  end subroutine measure

  !> Largest sagitta of the lines of a net along its first direction.
  pure real(wp) function sagitta_of(net) result(sagitta)
    real(wp), intent(in) :: net(:, :, :)       !! shape (n1, n2, 3)
    real(wp) :: chord(3), along(3)
    integer :: i, j

    sagitta = 0.0_wp
    do j = 1, size(net, 2)
      chord = net(size(net, 1), j, :) - net(1, j, :)
      do i = 2, size(net, 1) - 1
        along = net(i, j, :) - net(1, j, :)
        along = along - min(max(dot_product(along, chord)/max(sum(chord**2), tiny(1.0_wp)), &
                                0.0_wp), 1.0_wp)*chord
        sagitta = max(sagitta, norm2(along))
      end do
    end do
  end function sagitta_of

  !> Append a node, of a face with the points of its hull.
  pure subroutine add_node(tree, node)
    type(hull_tree_t), intent(inout) :: tree
    type(hull_node_t), intent(inout) :: node
    type(hull_node_t), allocatable :: longer(:)
    type(contact_territory_t) :: territory
    real(wp), allocatable :: net(:, :, :)
    integer :: c, n, m

    if (allocated(node%hull)) then
      n = size(node%hull, 2)
      m = size(node%hull, 3)
      allocate (net(n, m, 3))
      do c = 1, 3
        net(:, :, c) = node%hull(c, :, :)/node%hull(4, :, :)
      end do
      node%corners = reshape([net(1, 1, :), net(n, 1, :), net(1, m, :), net(n, m, :)], [3, 4])
      node%points = transpose(reshape(net, [n*m, 3]))
      call new_territory(territory, net)
      node%normal = territory%axes(:, 3)
      call measure(node, net)
    end if
    node%box(:, 1) = minval(node%points, 2)
    node%box(:, 2) = maxval(node%points, 2)
    node%middle = sum(node%points, 2)/size(node%points, 2)
    if (tree%n == size(tree%nodes)) then
      allocate (longer(2*tree%n))
      longer(:tree%n) = tree%nodes
      call move_alloc(longer, tree%nodes)
    end if
    tree%n = tree%n + 1
    tree%nodes(tree%n) = node
  end subroutine add_node

end module hull_tree
