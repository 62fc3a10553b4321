!> Which positions of a surface lie inside the loops of its trim.
!!
!! The loops are cut where u or v turns and at the knot lines. A span of the knots that no piece
!! enters is inside or outside as a whole. The others are quartered until few pieces are left in a
!! leaf. There a ray towards higher u is followed to the edge of the leaf and along that edge to its
!! begin, where the state is known: every piece passed on the way changes it. Pieces are split so
!! that neighbours share their ends bit for bit and the count of passes is never ambiguous; only
!! where the box of a piece encloses the position is its curve looked at.
module surface_trim
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, n_spans, span_table
  use trim_curve, only: trim_curve_t, trim_loop_t, curve_point, part_of_curve, monotone_ends, &
                        max_trim_degree
  implicit none
  private

  public :: trim_t, trim_piece_t, new_trim, is_inside, is_outside, clearance, place_in_spans

  integer, parameter :: most_pieces = 3       !! of a leaf that is not quartered
  integer, parameter :: deepest = 14          !! quarterings of a span
  integer, parameter :: most_parts = 64       !! monotone parts of a curve
  integer, parameter :: most_halvings = 60    !! until a position on a piece is settled
  real(wp), parameter :: same_line = 1.0e-12_wp   !! of the range, a position on a knot line

  !> Part of a loop along which u and v do not turn, in one span of the knots.
  type :: trim_piece_t
    real(wp) :: low(2) = 0.0_wp, high(2) = 0.0_wp   !! box around it
    real(wp) :: from(2) = 0.0_wp, to(2) = 0.0_wp    !! its ends
    real(wp) :: least = 0.0_wp, most = 0.0_wp       !! of triangles with its chord
    integer :: span = 0                             !! axis 1 fastest
    integer :: loop = 0
    type(trim_curve_t) :: curve                     !! in the span's coordinates from 0 to 1
  end type trim_piece_t

  !> A span, or a quarter of one.
  type :: node_t
    real(wp) :: low(2) = 0.0_wp, high(2) = 1.0_wp   !! local coordinates
    integer :: child = 0                            !! before the first of four, 0: none
    integer :: first = 1, n = 0                     !! pieces in it
    logical :: is_inside = .false.                  !! of the corner at high(1), low(2)
  end type node_t

  !> A trim that is prepared for questions.
  type :: trim_t
    integer :: n(2) = 0                             !! spans along both axes
    integer, allocatable :: root(:)                 !! node of each span; 0: all inside; -1: outside
    type(node_t), allocatable :: nodes(:)
    type(trim_piece_t), allocatable :: parts(:)     !! of the leaves
    type(trim_piece_t), allocatable :: pieces(:)    !! of the spans, loop after loop
    integer :: n_nodes = 0, n_parts = 0             !! in use
  end type trim_t

contains

  !> Prepare the trim of a surface. The loops must be closed, simple and within the knots.
  pure subroutine new_trim(trim, axes, loops)
    type(trim_t), intent(out) :: trim
    type(knot_vector_t), intent(in) :: axes(2)
    type(trim_loop_t), intent(in) :: loops(:)
    integer, allocatable :: first_part(:)
    integer :: i, span
    real(wp), allocatable :: lines1(:), lines2(:)

    trim%n = [n_spans(axes(1)), n_spans(axes(2))]
    lines1 = span_lines(axes(1))
    lines2 = span_lines(axes(2))
    call cut_loops(loops, lines1, lines2, trim%pieces)
    allocate (trim%root(product(trim%n)), first_part(product(trim%n) + 1))
    allocate (trim%nodes(64), trim%parts(64))
    do span = 1, size(trim%root)
      first_part(span) = trim%n_parts + 1
      trim%root(span) = 0
      associate (own => pack([(i, i=1, size(trim%pieces))], trim%pieces%span == span))
        if (size(own) == 0) cycle
        call add_nodes(trim, 1)
        trim%root(span) = trim%n_nodes
        call divide(trim, trim%n_nodes, trim%pieces(own), 0)
      end associate
    end do
    first_part(size(first_part)) = trim%n_parts + 1
    trim%nodes = trim%nodes(:trim%n_nodes)
    trim%parts = trim%parts(:trim%n_parts)
    call set_states(trim, first_part)
  end subroutine new_trim

  !> Whether a position of a span lies inside.
  pure logical function is_inside(trim, span, at)
    type(trim_t), intent(in) :: trim
    integer, intent(in) :: span       !! axis 1 fastest
    real(wp), intent(in) :: at(2)     !! local coordinates from 0 to 1
    real(wp) :: x(2)
    integer :: k

    is_inside = trim%root(span) == 0
    if (trim%root(span) <= 0) return
    x = min(max(at, 0.0_wp), [1.0_wp, nearest(1.0_wp, -1.0_wp)])
    associate (node => trim%nodes(leaf_at(trim, span, x)))
      is_inside = node%is_inside
      do k = node%first, node%first + node%n - 1
        if (passes(trim%parts(k), x)) is_inside = .not. is_inside
        if (flips_edge(trim%parts(k), node%high(1), x(2))) is_inside = .not. is_inside
      end do
    end associate
  end function is_inside

  !> How far both coordinates may change before a position can come to lie on the other side of a
  !! loop, or beyond its leaf: at least this far.
  pure real(wp) function clearance(trim, span, at) result(free)
    type(trim_t), intent(in) :: trim
    integer, intent(in) :: span       !! axis 1 fastest; one with a leaf
    real(wp), intent(in) :: at(2)     !! local coordinates from 0 to 1
    integer :: k

    associate (node => trim%nodes(leaf_at(trim, span, at)))
      free = min(minval(at - node%low), minval(node%high - at))
      do k = node%first, node%first + node%n - 1
        associate (piece => trim%parts(k))
          free = min(free, max(maxval(piece%low - at), maxval(at - piece%high)))
        end associate
      end do
    end associate
    free = max(free, 0.0_wp)
  end function clearance

  !> The leaf of a cut span that holds a position.
  pure integer function leaf_at(trim, span, x) result(i)
    type(trim_t), intent(in) :: trim
    integer, intent(in) :: span
    real(wp), intent(in) :: x(2)      !! local coordinates from 0 to 1

    i = trim%root(span)
    do while (trim%nodes(i)%child > 0)
      associate (node => trim%nodes(i))
        i = node%child + 1
        if (x(1) >= 0.5_wp*(node%low(1) + node%high(1))) i = i + 1
        if (x(2) >= 0.5_wp*(node%low(2) + node%high(2))) i = i + 2
      end associate
    end do
  end function leaf_at

  !> Whether nothing of a rectangle in a span counts.
  pure logical function is_outside(trim, span, low, high)
    type(trim_t), intent(in) :: trim
    integer, intent(in) :: span                 !! axis 1 fastest
    real(wp), intent(in) :: low(2), high(2)     !! local coordinates from 0 to 1
    integer :: i

    is_outside = trim%root(span) < 0
    if (trim%root(span) <= 0) return
    do i = 1, size(trim%pieces)
      if (trim%pieces(i)%span /= span) cycle
      if (all(trim%pieces(i)%low <= high .and. trim%pieces(i)%high >= low)) return
    end do
    is_outside = .not. is_inside(trim, span, 0.5_wp*(low + high))
  end function is_outside

  !> Span and local coordinates of a position.
  pure subroutine place_in_spans(axes, xi, span, at)
    type(knot_vector_t), intent(in) :: axes(2)
    real(wp), intent(in) :: xi(2)
    integer, intent(out) :: span       !! axis 1 fastest
    real(wp), intent(out) :: at(2)
    integer :: d, i
    real(wp), allocatable :: lines(:)

    span = 1
    do d = 1, 2
      lines = span_lines(axes(d))
      i = max(1, min(count(lines <= xi(d)), size(lines) - 1))
      at(d) = (xi(d) - lines(i))/(lines(i + 1) - lines(i))
      span = span + (i - 1)*merge(1, n_spans(axes(1)), d == 1)
    end do
  end subroutine place_in_spans

  !> Whether a ray from a position towards higher u passes a piece.
  pure logical function passes(piece, x)
    type(trim_piece_t), intent(in) :: piece
    real(wp), intent(in) :: x(2)
    real(wp) :: begin(2), end(2), point(2), low, high, middle, left
    logical :: is_rising
    integer :: i

    passes = .false.
    if (x(2) < piece%low(2) .or. x(2) >= piece%high(2)) return
    passes = x(1) < piece%low(1)
    if (passes .or. x(1) >= piece%high(1)) return
    begin = piece%from
    end = piece%to
    is_rising = end(2) > begin(2)
    left = left_of(begin, end, x)
    if (left > piece%most .or. left < piece%least .or. piece%curve%degree == 1) then
      passes = left > 0.0_wp .eqv. is_rising
      return
    end if
    low = 0.0_wp
    high = 1.0_wp
    do i = 1, most_halvings
      middle = 0.5_wp*(low + high)
      point = curve_point(piece%curve, middle)
      if ((point(2) <= x(2)) .eqv. is_rising) then
        low = middle
        begin = point
      else
        high = middle
        end = point
      end if
      passes = x(1) < min(begin(1), end(1))
      if (passes .or. x(1) >= max(begin(1), end(1))) return
    end do
  end function passes

  !> Twice the area of a triangle, positive where the last corner is left of the way between the
  !! others.
  pure real(wp) function left_of(begin, end, x)
    real(wp), intent(in) :: begin(2), end(2), x(2)

    left_of = (end(1) - begin(1))*(x(2) - begin(2)) - (x(1) - begin(1))*(end(2) - begin(2))
  end function left_of

  !> Whether the state along the edge at high u of a leaf is another one at `t` than at the begin of
  !! the edge because of this piece: one of its ends lies between.
  pure logical function flips_edge(piece, edge, t)
    type(trim_piece_t), intent(in) :: piece
    real(wp), intent(in) :: edge, t

    flips_edge = (piece%from(1) >= edge .and. piece%from(2) <= t) &
                 .neqv. (piece%to(1) >= edge .and. piece%to(2) <= t)
  end function flips_edge

  !> The knot lines: begins of the spans, and the end of the last.
  pure function span_lines(axis) result(lines)
    type(knot_vector_t), intent(in) :: axis
    real(wp), allocatable :: lines(:)

    lines = [axis%knots(span_table(axis)), axis%knots(axis%n_basis + 1)]
  end function span_lines

  !> Pieces of all loops in the local coordinates of their spans.
  pure subroutine cut_loops(loops, lines1, lines2, pieces)
    type(trim_loop_t), intent(in) :: loops(:)
    real(wp), intent(in) :: lines1(:), lines2(:)    !! knot lines of the axes
    type(trim_piece_t), allocatable, intent(out) :: pieces(:)
    type(trim_piece_t), allocatable :: list(:), more(:)
    integer :: i, k, n

    allocate (list(64))
    n = 0
    do i = 1, size(loops)
      call cut_at_turns(loops(i), i, lines1, lines2, more)
      call cut_at_lines(more, lines1, 1)
      call cut_at_lines(more, lines2, 2)
      do while (n + size(more) > size(list))
        list = [list, list]
      end do
      list(n + 1:n + size(more)) = more
      n = n + size(more)
    end do
    pieces = list(:n)
    do k = 1, n
      call make_local(pieces(k), lines1, lines2)
    end do
  end subroutine cut_loops

  !> Parts of a loop along which u and v do not turn. Neighbours share their ends, and ends on a
  !! knot line but for round-off are put on it.
  pure subroutine cut_at_turns(loop, number, lines1, lines2, pieces)
    type(trim_loop_t), intent(in) :: loop
    integer, intent(in) :: number
    real(wp), intent(in) :: lines1(:), lines2(:)
    type(trim_piece_t), allocatable, intent(out) :: pieces(:)
    type(trim_piece_t), allocatable :: list(:)
    real(wp) :: ends(0:most_parts), first(2)
    integer :: i, k, n, n_here

    allocate (list(8*size(loop%curves)))
    n = 0
    do i = 1, size(loop%curves)
      call monotone_ends(loop%curves(i), n_here, ends)
      do while (n + n_here > size(list))
        list = [list, list]
      end do
      do k = 1, n_here
        n = n + 1
        list(n)%loop = number
        list(n)%curve = part_of_curve(loop%curves(i), ends(k - 1), ends(k))
        list(n)%from = on_lines(curve_point(list(n)%curve, 0.0_wp), lines1, lines2)
      end do
    end do
    first = list(1)%from
    do i = 1, n
      list(i)%to = list(merge(1, i + 1, i == n))%from
    end do
    pieces = pack(list(:n), [(any(abs(list(i)%to - list(i)%from) > 0.0_wp), i=1, n)])
    do i = 1, size(pieces)
      call enclose(pieces(i))
    end do
  end subroutine cut_at_turns

  !> A position, put on the nearest knot lines where it is there but for round-off, and within all.
  pure function on_lines(point, lines1, lines2) result(moved)
    real(wp), intent(in) :: point(2), lines1(:), lines2(:)
    real(wp) :: moved(2)

    moved = [on_line(point(1), lines1), on_line(point(2), lines2)]
  end function on_lines

  pure real(wp) function on_line(value, lines)
    real(wp), intent(in) :: value, lines(:)
    integer :: i

    on_line = min(max(value, lines(1)), lines(size(lines)))
    i = minloc(abs(lines - on_line), 1)
    if (abs(lines(i) - on_line) <= same_line*(lines(size(lines)) - lines(1))) on_line = lines(i)
  end function on_line

  !> Cut pieces where they cross lines of constant u or v.
  pure subroutine cut_at_lines(pieces, lines, d)
    type(trim_piece_t), allocatable, intent(inout) :: pieces(:)
    real(wp), intent(in) :: lines(:)
    integer, intent(in) :: d          !! coordinate of the lines
    type(trim_piece_t), allocatable :: list(:)
    type(trim_piece_t) :: rest, part
    integer :: i, k, n, first, last

    n = size(pieces)
    do i = 1, size(pieces)
      n = n + max(0, count(lines > pieces(i)%low(d) .and. lines < pieces(i)%high(d)))
    end do
    allocate (list(n))
    n = 0
    do i = 1, size(pieces)
      rest = pieces(i)
      first = count(lines <= rest%low(d)) + 1
      last = count(lines < rest%high(d))
      if (rest%to(d) > rest%from(d)) then
        do k = first, last
          call split(rest, d, lines(k), part)
          n = n + 1
          list(n) = part
        end do
      else
        do k = last, first, -1
          call split(rest, d, lines(k), part)
          n = n + 1
          list(n) = part
        end do
      end if
      n = n + 1
      list(n) = rest
    end do
    call move_alloc(list, pieces)
  end subroutine cut_at_lines

  !> Take the part of a piece before a line of constant u or v away from it.
  pure subroutine split(rest, d, line, part)
    type(trim_piece_t), intent(inout) :: rest
    integer, intent(in) :: d
    real(wp), intent(in) :: line          !! between the ends of the piece
    type(trim_piece_t), intent(out) :: part
    real(wp) :: low, high, at, point(2)
    integer :: i

    part = rest
    low = 0.0_wp
    high = 1.0_wp
    at = 0.5_wp
    do i = 1, most_halvings
      at = 0.5_wp*(low + high)
      point = curve_point(rest%curve, at)
      if ((point(d) < line) .eqv. (rest%to(d) > rest%from(d))) then
        low = at
      else
        high = at
      end if
    end do
    point(d) = line
    point(3 - d) = min(max(point(3 - d), rest%low(3 - d)), rest%high(3 - d))
    part%to = point
    part%curve = part_of_curve(rest%curve, 0.0_wp, at)
    rest%from = point
    rest%curve = part_of_curve(rest%curve, at, 1.0_wp)
    call enclose(part)
    call enclose(rest)
  end subroutine split

  !> Boxes of a piece along and across the way between its ends.
  pure subroutine enclose(piece)
    type(trim_piece_t), intent(inout) :: piece
    real(wp), parameter :: slack = 1.0e-12_wp
    real(wp) :: left
    integer :: i

    piece%low = min(piece%from, piece%to)
    piece%high = max(piece%from, piece%to)
    piece%least = 0.0_wp
    piece%most = 0.0_wp
    associate (c => piece%curve%c)
      do i = 0, piece%curve%degree
        left = left_of(piece%from, piece%to, c(:2, i)/c(3, i))
        piece%least = min(piece%least, (1.0_wp + slack)*left)
        piece%most = max(piece%most, (1.0_wp + slack)*left)
      end do
    end associate
  end subroutine enclose

  !> Find the span of a piece and bring it to the local coordinates there.
  pure subroutine make_local(piece, lines1, lines2)
    type(trim_piece_t), intent(inout) :: piece
    real(wp), intent(in) :: lines1(:), lines2(:)
    real(wp) :: middle(2), low(2), size_of(2)
    integer :: i, j, d

    middle = 0.5_wp*(piece%low + piece%high)
    i = max(1, min(count(lines1 <= middle(1)), size(lines1) - 1))
    j = max(1, min(count(lines2 <= middle(2)), size(lines2) - 1))
    piece%span = i + (j - 1)*(size(lines1) - 1)
    low = [lines1(i), lines2(j)]
    size_of = [lines1(i + 1), lines2(j + 1)] - low
    piece%from = (piece%from - low)/size_of
    piece%to = (piece%to - low)/size_of
    do d = 1, 2
      piece%curve%c(d, :) = (piece%curve%c(d, :) - low(d)*piece%curve%c(3, :))/size_of(d)
    end do
    call enclose(piece)
  end subroutine make_local

  !> Append empty nodes.
  pure subroutine add_nodes(trim, n)
    type(trim_t), intent(inout) :: trim
    integer, intent(in) :: n
    type(node_t), allocatable :: longer(:)

    if (trim%n_nodes + n > size(trim%nodes)) then
      allocate (longer(2*size(trim%nodes) + n))
      longer(:trim%n_nodes) = trim%nodes(:trim%n_nodes)
      call move_alloc(longer, trim%nodes)
    end if
    trim%nodes(trim%n_nodes + 1:trim%n_nodes + n) = node_t()
    trim%n_nodes = trim%n_nodes + n
  end subroutine add_nodes

  !> Quarter a node until few pieces are left in each part.
  pure recursive subroutine divide(trim, node, pieces, depth)
    type(trim_t), intent(inout) :: trim
    integer, intent(in) :: node, depth
    type(trim_piece_t), intent(in) :: pieces(:)     !! in this node
    type(trim_piece_t), allocatable :: list(:), longer(:)
    real(wp) :: middle(2)
    integer :: i, child, first
    logical :: is_right(2)

    if (size(pieces) <= most_pieces .or. depth == deepest) then
      trim%nodes(node)%first = trim%n_parts + 1
      trim%nodes(node)%n = size(pieces)
      if (trim%n_parts + size(pieces) > size(trim%parts)) then
        allocate (longer(2*size(trim%parts) + size(pieces)))
        longer(:trim%n_parts) = trim%parts(:trim%n_parts)
        call move_alloc(longer, trim%parts)
      end if
      trim%parts(trim%n_parts + 1:trim%n_parts + size(pieces)) = pieces
      trim%n_parts = trim%n_parts + size(pieces)
      return
    end if
    middle = 0.5_wp*(trim%nodes(node)%low + trim%nodes(node)%high)
    list = pieces
    call cut_at_lines(list, middle(1:1), 1)
    call cut_at_lines(list, middle(2:2), 2)
    first = trim%n_nodes
    call add_nodes(trim, 4)
    trim%nodes(node)%child = first
    do child = 1, 4
      is_right = [mod(child, 2) == 0, child > 2]
      trim%nodes(first + child)%low = merge(middle, trim%nodes(node)%low, is_right)
      trim%nodes(first + child)%high = merge(trim%nodes(node)%high, middle, is_right)
      call divide(trim, first + child, pack(list, [(all((0.5_wp*(list(i)%low + list(i)%high) &
                  >= middle) .eqv. is_right), i=1, size(list))]), depth + 1)
    end do
  end subroutine divide

  !> States of whole spans and of the leaves: rays towards higher u at heights where no piece ends
  !! on the edge. Which pieces they pass follows from the leaves alone.
  pure subroutine set_states(trim, first_part)
    type(trim_t), intent(inout) :: trim
    integer, intent(in) :: first_part(:)      !! of each span, and one beyond the last
    integer :: span, row_end
    real(wp), parameter :: half = 0.5_wp
    real(wp), allocatable :: edges(:)         ! where the leaf of a part begins

    allocate (edges(trim%n_parts))
    call leaf_edges(trim, edges)
    do span = 1, size(trim%root)
      row_end = first_part(trim%n(1)*((span - 1)/trim%n(1) + 1) + 1) - 1
      if (trim%root(span) > 0) then
        call set_leaves(trim, trim%root(span), first_part(span), first_part(span + 1) - 1, &
                        row_end, edges)
      else if (mod(n_passed(trim%parts(first_part(span + 1):row_end), half), 2) == 0) then
        trim%root(span) = -1
      end if
    end do
  end subroutine set_states

  !> Where the leaf of each part begins along u.
  pure subroutine leaf_edges(trim, edges)
    type(trim_t), intent(in) :: trim
    real(wp), intent(out) :: edges(:)
    integer :: i

    do i = 1, trim%n_nodes
      associate (node => trim%nodes(i))
        if (node%child == 0) edges(node%first:node%first + node%n - 1) = node%low(1)
      end associate
    end do
  end subroutine leaf_edges

  !> States of the leaves below a node.
  pure recursive subroutine set_leaves(trim, i, first, last, row_end, edges)
    type(trim_t), intent(inout) :: trim
    integer, intent(in) :: i                  !! the node
    integer, intent(in) :: first, last        !! parts of its span
    integer, intent(in) :: row_end            !! last part of the row of spans
    real(wp), intent(in) :: edges(:)
    real(wp) :: height
    integer :: child, k, n

    if (trim%nodes(i)%child > 0) then
      do child = 1, 4
        call set_leaves(trim, trim%nodes(i)%child + child, first, last, row_end, edges)
      end do
      return
    end if
    associate (node => trim%nodes(i))
      associate (parts => trim%parts(node%first:node%first + node%n - 1))
        height = free_height(parts, node%low(2), node%high(1), node%high(2))
        n = n_passed(trim%parts(last + 1:row_end), height) &
            + n_passed(pack(trim%parts(first:last), edges(first:last) >= node%high(1)), height)
        n = n + count([(flips_edge(parts(k), node%high(1), height), k=1, size(parts))])
      end associate
      trim%nodes(i)%is_inside = mod(n, 2) == 1
    end associate
  end subroutine set_leaves

  !> Pieces between whose ends a height is.
  pure integer function n_passed(parts, height)
    type(trim_piece_t), intent(in) :: parts(:)
    real(wp), intent(in) :: height
    integer :: k

    n_passed = count([(height >= parts(k)%low(2) .and. height < parts(k)%high(2), &
                       k=1, size(parts))])
  end function n_passed

  !> The middle of the longest part of the edge at high u of a leaf on which no piece ends.
  pure real(wp) function free_height(parts, low, edge, high) result(height)
    type(trim_piece_t), intent(in) :: parts(:)
    real(wp), intent(in) :: low, edge, high
    real(wp) :: begin, next, longest
    integer :: i

    begin = low
    longest = 0.0_wp
    height = 0.5_wp*(low + high)
    do while (begin < high)
      next = high
      do i = 1, size(parts)
        associate (from => parts(i)%from, to => parts(i)%to)
          if (from(1) >= edge .and. from(2) > begin) next = min(next, from(2))
          if (to(1) >= edge .and. to(2) > begin) next = min(next, to(2))
        end associate
      end do
      if (next - begin > longest) then
        longest = next - begin
        height = 0.5_wp*(begin + next)
      end if
      begin = next
    end do
  end function free_height

end module surface_trim
