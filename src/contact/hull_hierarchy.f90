!> Bounding-volume hierarchy of surfaces: ever smaller parts, each with points whose convex hull
!! encloses it, and lower bounds of the distance between two parts.
!!
!! A node is a range of faces, a face, or a part of one. Nodes are halved on demand, across the
!! requested direction.
module hull_hierarchy
  use kinds, only: wp
  use knot_vector, only: n_spans
  use nurbs_surface, only: nurbs_surface_t
  use bezier, only: bezier_face_t, bezier_faces, bezier_points
  use contact_territory, only: contact_territory_t, new_territory
  use surface_trim, only: trim_t, new_trim, is_inside, is_outside
  use tool_cells, only: halve
  implicit none
  private

  public :: hull_hierarchy_t, new_hull_hierarchy, clear, halve_node, rises_of, bound_gap, box_gap

  integer, parameter :: max_steps = 30       !! of the iteration for a direction
  real(wp), parameter :: same = 0.01_wp      !! of the distance: accuracy at which it stops

  !> Part of a surface. It lies in the convex hull of `points`.
  type :: hull_node_t
    integer :: surface = 0
    integer :: low(2) = 1, high(2) = 1        !! first and last face along xi and eta
    real(wp) :: from(2) = 0.0_wp, to(2) = 1.0_wp   !! range of xi and eta
    real(wp), allocatable :: hull(:, :, :)    !! Bezier points of a face or of a part of one,
                                              !! homogeneous, (4, p + 1, q + 1); else not allocated
    real(wp), allocatable :: points(:, :)     !! these points, or the corners of a box (3, n)
    real(wp) :: corners(3, 4) = 0.0_wp        !! of the part itself: xi runs first
    real(wp) :: normal(3) = 0.0_wp            !! mean one
    real(wp) :: box(3, 2) = 0.0_wp            !! corners of the box around `points` along x, y, z
    real(wp) :: size(2) = 0.0_wp              !! longest lines of points along xi and eta
    real(wp) :: bend(2) = 0.0_wp              !! largest sagitta of these lines, or twist
    integer :: halves(2, 2) = 0               !! nodes of both halves, divided across xi and eta
    logical :: is_outside = .false.           !! nothing of it is within the trim of its surface
    logical :: has_corner(4) = .true.         !! corners that are
  end type hull_node_t

  !> Surfaces with their nodes, the first of which are the surfaces as a whole.
  type :: hull_hierarchy_t
    type(nurbs_surface_t), allocatable :: surfaces(:)
    type(bezier_face_t), allocatable :: faces(:)   !! of all surfaces, xi first
    integer, allocatable :: first(:)          !! faces before those of a surface
    type(trim_t), allocatable :: trims(:)     !! of the surfaces; empty for those without
    integer :: n = 0
    type(hull_node_t), allocatable :: nodes(:)
  end type hull_hierarchy_t

contains

  !> A tree of nothing but whole surfaces. Their weights must be positive.
  pure subroutine new_hull_hierarchy(tree, surfaces)
    type(hull_hierarchy_t), intent(out) :: tree
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    integer :: s, n(size(surfaces))

    tree%surfaces = surfaces
    n = [(n_spans(surfaces(s)%axes(1))*n_spans(surfaces(s)%axes(2)), s=1, size(surfaces))]
    tree%first = [(sum(n(:s - 1)), s=1, size(surfaces))]
    allocate (tree%faces(sum(n)), tree%trims(size(surfaces)))
    do s = 1, size(surfaces)
      tree%faces(tree%first(s) + 1:tree%first(s) + n(s)) = bezier_faces(surfaces(s))
      if (allocated(surfaces(s)%loops)) &
        call new_trim(tree%trims(s), surfaces(s)%axes, surfaces(s)%loops)
    end do
    call clear(tree)
  end subroutine new_hull_hierarchy

  !> Forget all nodes but the whole surfaces.
  pure subroutine clear(tree)
    type(hull_hierarchy_t), intent(inout) :: tree
    type(hull_node_t) :: node
    integer :: d

    if (allocated(tree%nodes)) deallocate (tree%nodes)
    allocate (tree%nodes(64 + size(tree%surfaces)))
    tree%n = 0
    do while (tree%n < size(tree%surfaces))
      node = hull_node_t(surface=tree%n + 1)
      node%high = [(n_spans(tree%surfaces(node%surface)%axes(d)), d=1, 2)]
      call add_node(tree, node)
    end do
  end subroutine clear

  !> Halves of a node across a direction, 1 for xi and 2 for eta. A range that is one face wide
  !! there is divided across the other one.
  pure subroutine halve_node(tree, index, direction, halves)
    type(hull_hierarchy_t), intent(inout) :: tree
    integer, intent(in) :: index, direction
    integer, intent(out) :: halves(2)          !! nodes
    type(hull_node_t) :: half, whole
    real(wp), allocatable :: parts(:, :, :, :)
    integer :: side, d

    d = direction
    associate (node => tree%nodes(index))
      if (.not. allocated(node%hull) .and. node%low(d) == node%high(d)) d = 3 - d
      halves = node%halves(:, d)
      if (halves(1) > 0) return
      halves = tree%n + [1, 2]
      node%halves(:, d) = halves
      whole = node
    end associate
    if (allocated(whole%hull)) then
      allocate (parts(4, size(whole%hull, 2), size(whole%hull, 3), 2))
      call halve(whole%hull, d, parts)
    end if
    do side = 1, 2
      half = hull_node_t(surface=whole%surface, low=whole%low, high=whole%high, from=whole%from, &
                         to=whole%to)
      if (allocated(whole%hull)) then
        half%hull = parts(:, :, :, side)
        if (side == 1) half%to(d) = 0.5_wp*(whole%from(d) + whole%to(d))
        if (side == 2) half%from(d) = 0.5_wp*(whole%from(d) + whole%to(d))
      else
        if (side == 1) half%high(d) = (whole%low(d) + whole%high(d))/2
        if (side == 2) half%low(d) = (whole%low(d) + whole%high(d))/2 + 1
      end if
      call add_node(tree, half)
    end do
  end subroutine halve_node

  !> Append a node of which the range is known, or the part of a face and its hull.
  pure subroutine add_node(tree, node)
    type(hull_hierarchy_t), intent(inout) :: tree
    type(hull_node_t), intent(inout) :: node
    type(hull_node_t), allocatable :: longer(:)
    real(wp), allocatable :: net(:, :, :)
    integer :: n(2), n_row, first, i, j, c

    if (.not. allocated(node%hull)) then
      n_row = n_spans(tree%surfaces(node%surface)%axes(1))
      first = tree%first(node%surface)
      associate (begin => tree%faces(first + node%low(1) + n_row*(node%low(2) - 1)), &
                 end => tree%faces(first + node%high(1) + n_row*(node%high(2) - 1)))
        node%from = begin%low
        node%to = end%high
        n = begin%degree + 1
        if (all(node%low == node%high)) node%hull = begin%hull
      end associate
    end if
    if (allocated(node%hull)) then
      net = bezier_points(node%hull)
    else
      allocate (net(n(1)*(node%high(1) - node%low(1) + 1), &
                    n(2)*(node%high(2) - node%low(2) + 1), 3))
      do j = 0, node%high(2) - node%low(2)
        do i = 0, node%high(1) - node%low(1)
          net(n(1)*i + 1:n(1)*(i + 1), n(2)*j + 1:n(2)*(j + 1), :) = &
            bezier_points(tree%faces(first + node%low(1) + i + n_row*(node%low(2) + j - 1))%hull)
        end do
      end do
    end if
    call enclose(node, net)
    if (allocated(tree%surfaces(node%surface)%loops)) call note_trim(tree, node)
    if (tree%n == size(tree%nodes)) then
      allocate (longer(2*tree%n))
      do c = 1, tree%n
        longer(c) = tree%nodes(c)
      end do
      call move_alloc(longer, tree%nodes)
    end if
    tree%n = tree%n + 1
    tree%nodes(tree%n) = node
  end subroutine add_node

  !> What of a node is within the trim of its surface.
  pure subroutine note_trim(tree, node)
    type(hull_hierarchy_t), intent(in) :: tree
    type(hull_node_t), intent(inout) :: node
    real(wp) :: part(2, 2), at(2)
    integer :: face(2), i, j, k

    associate (trim => tree%trims(node%surface))
      node%is_outside = .true.
      do j = node%low(2), node%high(2)
        do i = node%low(1), node%high(1)
          if (.not. node%is_outside) exit
          part = local_part(tree, node, [i, j])
          node%is_outside = is_outside(trim, i + (j - 1)*trim%n(1), part(:, 1), part(:, 2))
        end do
      end do
      do k = 1, 4
        face = merge(node%high, node%low, [mod(k, 2) == 0, k > 2])
        part = local_part(tree, node, face)
        at = merge(part(:, 2), part(:, 1), [mod(k, 2) == 0, k > 2])
        node%has_corner(k) = is_inside(trim, face(1) + (face(2) - 1)*trim%n(1), at)
      end do
    end associate
  end subroutine note_trim

  !> Range of a face that belongs to a node, in local coordinates.
  pure function local_part(tree, node, face) result(part)
    type(hull_hierarchy_t), intent(in) :: tree
    type(hull_node_t), intent(in) :: node
    integer, intent(in) :: face(2)             !! along xi and eta
    real(wp) :: part(2, 2)                     !! begin and end

    associate (own => tree%faces(tree%first(node%surface) + face(1) + (face(2) - 1) &
                                 *tree%trims(node%surface)%n(1)))
      part(:, 1) = max(0.0_wp, (node%from - own%low)/(own%high - own%low))
      part(:, 2) = min(1.0_wp, (node%to - own%low)/(own%high - own%low))
    end associate
  end function local_part

  !> Points, boxes and lengths of a node from the net of its control points. Of a range, the points
  !! are the corners of a box along the directions of the net. A twist out of the plane is a bend
  !! along both directions.
  pure subroutine enclose(node, net)
    type(hull_node_t), intent(inout) :: node
    real(wp), intent(in) :: net(:, :, :)       !! shape (n, m, 3)
    type(contact_territory_t) :: territory
    real(wp) :: corner(3), twist
    integer :: i

    call new_territory(territory, net)
    node%normal = territory%axes(:, 3)
    associate (n => size(net, 1), m => size(net, 2))
      node%corners = reshape([net(1, 1, :), net(n, 1, :), net(1, m, :), net(n, m, :)], [3, 4])
      node%size = [maxval(sum(norm2(net(2:, :, :) - net(:n - 1, :, :), 3), 1)), &
                   maxval(sum(norm2(net(:, 2:, :) - net(:, :m - 1, :), 3), 2))]
      twist = 0.25_wp*abs(dot_product(net(1, 1, :) - net(n, 1, :) - net(1, m, :) + net(n, m, :), &
                                      node%normal))
      node%bend = max(twist, [sagitta_of(net), &
                              sagitta_of(reshape(net, [m, n, 3], order=[2, 1, 3]))])
      if (allocated(node%hull)) then
        node%points = transpose(reshape(net, [n*m, 3]))
      else
        allocate (node%points(3, 8))
        do i = 0, 7
          corner = merge(territory%high, territory%low, [btest(i, 0), btest(i, 1), btest(i, 2)])
          node%points(:, i + 1) = territory%centre + matmul(territory%axes, corner)
        end do
      end if
    end associate
    node%box(:, 1) = minval(node%points, 2)
    node%box(:, 2) = maxval(node%points, 2)
  end subroutine enclose

  !> Largest sagitta of the lines of a net along its first direction.
  pure real(wp) function sagitta_of(net) result(sagitta)
    real(wp), intent(in) :: net(:, :, :)       !! shape (n, m, 3)
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

  !> How far the sides of a node along xi and along eta rise or fall along a vector.
  pure function rises_of(node, across) result(rises)
    type(hull_node_t), intent(in) :: node
    real(wp), intent(in) :: across(3)          !! unit vector
    real(wp) :: rises(2)                       !! [length]

    rises = [maxval(abs(matmul(across, node%corners(:, [2, 4]) - node%corners(:, [1, 3])))), &
             maxval(abs(matmul(across, node%corners(:, [3, 4]) - node%corners(:, [1, 2]))))]
  end function rises_of

  !> A lower bound of the distance between the hull of points p and that of points q + shift.
  !!
  !! For any unit vector d the hulls are at least min p.d - max q.d apart. Good vectors are given or
  !! come ever nearer to the best one: that from the nearest point of all differences p - q to the
  !! origin (E. G. Gilbert, SIAM J. Control 4, 1966).
  pure subroutine bound_gap(p, q, shift, seeds, enough, bound, across)
    real(wp), intent(in) :: p(:, :), q(:, :)     !! [length], shape (3, n)
    real(wp), intent(in) :: shift(3)             !! [length]
    real(wp), intent(in) :: seeds(:, :)          !! unit vectors of either sign to try first, (3, n)
    real(wp), intent(in) :: enough               !! the bound need not be larger [length]
    real(wp), intent(out) :: bound               !! not negative [length]
    real(wp), intent(out) :: across(3)           !! unit vector that it holds along, from q to p
    real(wp) :: v(3), w(3), d(3), length, along
    integer :: i

    v = sum(p, 2)/size(p, 2) - sum(q, 2)/size(q, 2) - shift
    bound = 0.0_wp
    across = v/max(norm2(v), tiny(1.0_wp))
    do i = 1, size(seeds, 2) + max_steps
      if (i <= size(seeds, 2)) then
        d = sign(1.0_wp, dot_product(v, seeds(:, i)))*seeds(:, i)
      else
        length = norm2(v)
        ! The hulls are no farther apart than `length`.
        if (length - bound <= same*length) return
        d = v/length
      end if
      w = p(:, minloc(matmul(d, p), 1)) - q(:, maxloc(matmul(d, q), 1)) - shift
      along = dot_product(w, d)
      if (along > bound) then
        bound = along
        across = d
      end if
      if (bound >= enough) return
      if (i <= size(seeds, 2)) cycle
      w = v - w
      v = v - min(max(dot_product(v, w)/max(sum(w**2), tiny(1.0_wp)), 0.0_wp), 1.0_wp)*w
    end do
  end subroutine bound_gap

  !> Distance of two boxes along x, y and z, the second of which is moved.
  pure real(wp) function box_gap(a, b, shift)
    real(wp), intent(in) :: a(3, 2), b(3, 2)     !! lower and upper corner [length]
    real(wp), intent(in) :: shift(3)             !! [length]

    box_gap = norm2(max(a(:, 1) - b(:, 2) - shift, b(:, 1) + shift - a(:, 2), 0.0_wp))
  end function box_gap

end module hull_hierarchy
