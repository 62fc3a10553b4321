!> Edges of trimmed tools: the curves of the loops on their surfaces, in pieces that lie in one face
!! each and bend little, and where the edge of one surface lies on that of another.
!!
!! What counts is on the left of an edge, seen against the normal xi x eta.
module tool_edges
  use kinds, only: wp
  use linear_algebra, only: sorted_order
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use trim_curve, only: trim_curve_t, evaluate_curve, curve_point, part_of_curve
  use surface_trim, only: trim_t
  use tool_face, only: face_position, face_derivatives, safe_normal
  implicit none
  private

  public :: tool_edge_t, edge_link_t, cut_edges, link_edges, evaluate_edge, nearest_on_edge, &
            place_across

  integer, parameter :: n_samples = 4             !! parts of a piece, for first guesses
  integer, parameter :: most_halvings = 8         !! of a piece that bends
  real(wp), parameter :: most_bend = 0.05_wp      !! sagitta over chord of a piece
  real(wp), parameter :: shortest = 3.0_wp        !! common part of edges, of the tolerance

  !> A piece of an edge.
  type :: tool_edge_t
    integer :: face = 0                           !! in whose local coordinates the curve is
    integer :: before = 0, next = 0               !! pieces of the loop
    integer :: first_link = 0                     !! to other edges, 0: none
    logical :: is_short = .false.                 !! too short to tell what lies beyond
    logical :: is_smooth = .false.                !! a tool goes on beyond it without a break
    type(trim_curve_t) :: curve
    real(wp) :: box(3, 2) = 0.0_wp                !! around its samples, amply [length]
  end type tool_edge_t

  !> Part of a piece that lies on another one.
  type :: edge_link_t
    integer :: edge = 0                           !! the other one
    real(wp) :: here(2) = 0.0_wp                  !! where the part begins and ends
    real(wp) :: there(2) = 0.0_wp                 !! the same positions on the other one
    logical :: is_last = .false.                  !! of this piece
  end type edge_link_t

contains

  !> Append the pieces of the edges of a surface.
  pure subroutine cut_edges(surface, trim, low, high, before, tolerance, edges, n)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_t), intent(in) :: trim
    real(wp), intent(in) :: low(:, :), high(:, :)   !! xi and eta of the faces, shape (2, n faces)
    integer, intent(in) :: before                   !! faces of the surfaces before
    real(wp), intent(in) :: tolerance               !! bend that does not matter [length]
    type(tool_edge_t), allocatable, intent(inout) :: edges(:)   !! the first `n` are in use
    integer, intent(inout) :: n
    type(tool_edge_t), allocatable :: longer(:)
    integer :: i, k, first, n_parts, loop

    first = n + 1
    loop = 0
    do i = 1, size(trim%pieces)
      associate (piece => trim%pieces(i))
        if (piece%loop /= loop) first = n + 1
        loop = piece%loop
        n_parts = parts_of(surface, piece%curve, low(:, piece%span), high(:, piece%span), &
                           tolerance)
        if (n + n_parts > size(edges)) then
          allocate (longer(2*(n + n_parts)))
          longer(:n) = edges(:n)
          call move_alloc(longer, edges)
        end if
        do k = 1, n_parts
          n = n + 1
          edges(n)%face = before + piece%span
          edges(n)%curve = part_of_curve(piece%curve, real(k - 1, wp)/n_parts, &
                                         real(k, wp)/n_parts)
          if (n == first) cycle
          edges(n)%before = n - 1
          edges(n - 1)%next = n
        end do
      end associate
      edges(n)%next = first
      edges(first)%before = n
    end do
  end subroutine cut_edges

  !> Parts of equal parameter length of which each bends little.
  pure integer function parts_of(surface, curve, low, high, tolerance) result(n)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_curve_t), intent(in) :: curve
    real(wp), intent(in) :: low(2), high(2), tolerance
    real(wp) :: x(3, 0:n_samples), chord(3), off(3), bend
    integer :: i, k, m

    n = 1
    do i = 1, most_halvings
      bend = 0.0_wp
      do k = 0, n - 1
        do m = 0, n_samples
          call evaluate_surface(surface, low + (high - low)*curve_point(curve, &
                                (k + real(m, wp)/n_samples)/n), x(:, m))
        end do
        chord = x(:, n_samples) - x(:, 0)
        do m = 1, n_samples - 1
          off = x(:, m) - x(:, 0)
          off = off - dot_product(off, chord)/max(dot_product(chord, chord), tiny(1.0_wp))*chord
          if (norm2(off) > tolerance) bend = max(bend, norm2(off)/max(norm2(chord), tiny(1.0_wp)))
        end do
      end do
      if (bend <= most_bend) return
      n = 2*n
    end do
  end function parts_of

  !> Position on a piece, its first and second derivatives, and where that is on the face.
  pure subroutine evaluate_edge(faces, edge, along, point, tangent, second, at)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)   !! power form of the faces
    type(tool_edge_t), intent(in) :: edge
    real(wp), intent(in) :: along
    real(wp), intent(out) :: point(3), tangent(3), second(3), at(2)
    real(wp) :: slope(2), bend(2), d1(3, 2), d2(3, 3)

    call evaluate_curve(edge%curve, along, at, slope, bend)
    at = min(max(at, 0.0_wp), 1.0_wp)
    call face_derivatives(faces, edge%face, at, point, d1, d2)
    tangent = matmul(d1, slope)
    second = matmul(d1, bend) + d2(:, 1)*slope(1)**2 + d2(:, 2)*slope(2)**2 &
             + 2*d2(:, 3)*slope(1)*slope(2)
  end subroutine evaluate_edge

  !> The position on a piece that is nearest to a point: Newton from the nearest of some samples,
  !! kept between its neighbours by halving.
  pure subroutine nearest_on_edge(faces, edge, x, along, n_iterations)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    type(tool_edge_t), intent(in) :: edge
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: along
    integer, intent(inout) :: n_iterations    !! evaluations, added to
    real(wp) :: point(3), tangent(3), second(3), at(2), squares(0:n_samples), low, high
    integer :: i

    do i = 0, n_samples
      squares(i) = sum((x - face_position(faces, edge%face, min(max(curve_point(edge%curve, &
                   real(i, wp)/n_samples), 0.0_wp), 1.0_wp)))**2)
    end do
    i = minloc(squares, 1) - 1
    along = real(i, wp)/n_samples
    low = max(0.0_wp, along - 1.0_wp/n_samples)
    high = min(1.0_wp, along + 1.0_wp/n_samples)
    call descend_between(faces, edge, x, low, high, along, n_iterations)
    call evaluate_edge(faces, edge, along, point, tangent, second, at)
    if (sum((x - point)**2) > squares(i)) along = real(i, wp)/n_samples
  end subroutine nearest_on_edge

  !> Newton for a root of the slope of the distance between two positions.
  pure subroutine descend_between(faces, edge, x, begin, end, along, n_iterations)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    type(tool_edge_t), intent(in) :: edge
    real(wp), intent(in) :: x(3), begin, end
    real(wp), intent(inout) :: along
    integer, intent(inout) :: n_iterations
    integer, parameter :: most = 60
    real(wp) :: point(3), tangent(3), second(3), at(2), slope, bend, low, high, last
    integer :: i

    low = begin
    high = end
    do i = 1, most
      call evaluate_edge(faces, edge, along, point, tangent, second, at)
      n_iterations = n_iterations + 1
      slope = dot_product(x - point, tangent)      ! positive: nearer ahead
      bend = dot_product(tangent, tangent) - dot_product(x - point, second)
      if (slope > 0.0_wp) low = along
      if (slope < 0.0_wp) high = along
      last = along
      if (bend > 0.0_wp) then
        along = along + slope/bend
        if (along <= low .and. low > begin .or. along >= high .and. high < end) &
          along = 0.5_wp*(low + high)
      else
        along = 0.5_wp*(low + high)
      end if
      along = min(max(along, low), high)
      if (abs(along - last) <= 2*epsilon(along) .or. high - low <= 2*epsilon(along)) exit
    end do
  end subroutine descend_between

  !> Where pieces lie on others. Pieces that follow each other in a loop do not.
  pure subroutine link_edges(faces, tolerance, edges, links)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)   !! power form of the faces
    real(wp), intent(in) :: tolerance               !! distance of points that are one [length]
    type(tool_edge_t), intent(inout) :: edges(:)
    type(edge_link_t), allocatable, intent(out) :: links(:)
    type(edge_link_t), allocatable :: found(:), longer(:)
    integer, allocatable :: owner(:), order(:), owners(:)
    integer :: i, j, k, m, n

    call enclose_edges(faces, tolerance, edges)
    order = sorted_order(edges%box(1, 1))
    allocate (found(64), owner(64))
    n = 0
    do k = 1, size(edges)
      i = order(k)
      if (edges(i)%is_short) cycle
      do m = k + 1, size(edges)
        j = order(m)
        if (edges(j)%box(1, 1) > edges(i)%box(1, 2)) exit
        if (any(edges(i)%box(:, 1) > edges(j)%box(:, 2) .or. &
                edges(j)%box(:, 1) > edges(i)%box(:, 2))) cycle
        if (edges(j)%is_short .or. edges(i)%next == j .or. edges(j)%next == i) cycle
        if (n + 2 > size(found)) then
          allocate (longer(2*size(found)), owners(2*size(found)))
          longer(:n) = found(:n)
          owners(:n) = owner(:n)
          call move_alloc(longer, found)
          call move_alloc(owners, owner)
        end if
        call join(faces, tolerance, edges, i, j, found, owner, n)
      end do
    end do
    allocate (links(n))
    order = sorted_order(real(owner(:n), wp))
    do k = 1, n
      links(k) = found(order(k))
      i = owner(order(k))
      links(k)%is_last = k == n
      if (k < n) links(k)%is_last = owner(order(k + 1)) /= i
      if (edges(i)%first_link == 0) edges(i)%first_link = k
    end do
    do i = 1, size(edges)
      edges(i)%is_smooth = is_smooth(faces, edges, links, i)
    end do
  end subroutine link_edges

  !> Whether normals agree across a piece: at its ends and between.
  pure logical function is_smooth(faces, edges, links, edge)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    type(tool_edge_t), intent(in) :: edges(:)
    type(edge_link_t), intent(in) :: links(:)
    integer, intent(in) :: edge
    real(wp), parameter :: break = 2.0e-3_wp      ! angle that is none [rad]
    real(wp) :: along, there, normals(3, 2)
    integer :: k, other

    is_smooth = .false.
    do k = 0, n_samples
      along = real(k, wp)/n_samples
      call place_across(faces, edges, links, edge, along, other, there)
      if (other == 0) return
      normals(:, 1) = normal_at(edges(edge), along)
      normals(:, 2) = normal_at(edges(other), there)
      if (norm2(normals(:, 1) - normals(:, 2)) > break) return
    end do
    is_smooth = .true.

  contains

    pure function normal_at(piece, at) result(normal)
      type(tool_edge_t), intent(in) :: piece
      real(wp), intent(in) :: at
      real(wp) :: normal(3)

      normal = safe_normal(faces, piece%face, min(max(curve_point(piece%curve, at), 0.0_wp), &
                                                  1.0_wp))
    end function normal_at

  end function is_smooth

  !> Boxes around pieces, and which are too short.
  pure subroutine enclose_edges(faces, tolerance, edges)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    real(wp), intent(in) :: tolerance
    type(tool_edge_t), intent(inout) :: edges(:)
    real(wp) :: x(3, 0:n_samples), reach
    integer :: i, k

    do i = 1, size(edges)
      do k = 0, n_samples
        x(:, k) = face_position(faces, edges(i)%face, &
                                min(max(curve_point(edges(i)%curve, real(k, wp)/n_samples), &
                                        0.0_wp), 1.0_wp))
      end do
      ! Pieces bend little, so that between samples they leave their box by less than this.
      reach = tolerance + most_bend*norm2(maxval(x, 2) - minval(x, 2))
      edges(i)%is_short = norm2(maxval(x, 2) - minval(x, 2)) <= shortest*tolerance
      edges(i)%box(:, 1) = minval(x, 2) - reach
      edges(i)%box(:, 2) = maxval(x, 2) + reach
    end do
  end subroutine enclose_edges

  !> Enter the common part of two pieces, in both directions, if there is one.
  pure subroutine join(faces, tolerance, edges, i, j, found, owner, n)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    real(wp), intent(in) :: tolerance
    type(tool_edge_t), intent(in) :: edges(:)
    integer, intent(in) :: i, j
    type(edge_link_t), intent(inout) :: found(:)
    integer, intent(inout) :: owner(:), n
    real(wp) :: ends(2, 4), c, x(3), y(3)
    integer :: k, n_ends, low, high
    logical :: is_on

    n_ends = 0
    do k = 0, 1
      call project(faces, edges(i), real(k, wp), edges(j), tolerance, c, is_on)
      if (is_on) n_ends = n_ends + 1
      if (is_on) ends(:, n_ends) = [real(k, wp), c]
      call project(faces, edges(j), real(k, wp), edges(i), tolerance, c, is_on)
      if (is_on) n_ends = n_ends + 1
      if (is_on) ends(:, n_ends) = [c, real(k, wp)]
    end do
    if (n_ends < 2) return
    low = minloc(ends(1, :n_ends), 1)
    high = maxloc(ends(1, :n_ends), 1)
    x = position(faces, edges(i), ends(1, low))
    y = position(faces, edges(i), ends(1, high))
    if (norm2(x - y) <= shortest*tolerance) return
    call project(faces, edges(i), 0.5_wp*(ends(1, low) + ends(1, high)), edges(j), &
                 tolerance, c, is_on)
    if (.not. is_on) return
    found(n + 1) = edge_link_t(j, ends(1, [low, high]), ends(2, [low, high]))
    owner(n + 1) = i
    if (ends(2, low) > ends(2, high)) then
      k = low
      low = high
      high = k
    end if
    found(n + 2) = edge_link_t(i, ends(2, [low, high]), ends(1, [low, high]))
    owner(n + 2) = j
    n = n + 2
  end subroutine join

  pure function position(faces, edge, along) result(x)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    type(tool_edge_t), intent(in) :: edge
    real(wp), intent(in) :: along
    real(wp) :: x(3)

    x = face_position(faces, edge%face, min(max(curve_point(edge%curve, along), 0.0_wp), 1.0_wp))
  end function position

  !> Coordinate on a piece next to a position of another, and whether both are one.
  pure subroutine project(faces, from, at, onto, tolerance, c, is_on)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    type(tool_edge_t), intent(in) :: from, onto
    real(wp), intent(in) :: at, tolerance
    real(wp), intent(out) :: c
    logical, intent(out) :: is_on
    real(wp) :: x(3)
    integer :: n

    c = 0.0_wp
    x = position(faces, from, at)
    is_on = all(x >= onto%box(:, 1)) .and. all(x <= onto%box(:, 2))
    if (.not. is_on) return
    n = 0
    call nearest_on_edge(faces, onto, x, c, n)
    is_on = norm2(x - position(faces, onto, c)) <= tolerance
  end subroutine project

  !> The piece that lies on another one at a position, and where on it; 0 if there is none.
  pure subroutine place_across(faces, edges, links, edge, along, other, there)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    type(tool_edge_t), intent(in) :: edges(:)
    type(edge_link_t), intent(in) :: links(:)
    integer, intent(in) :: edge
    real(wp), intent(in) :: along
    integer, intent(out) :: other
    real(wp), intent(out) :: there
    real(wp), parameter :: slack = 1.0e-6_wp
    real(wp) :: fraction, x(3), point(3), tangent(3), second(3), at(2)
    integer :: i, k

    other = 0
    there = 0.0_wp
    if (edges(edge)%first_link == 0) return
    do i = edges(edge)%first_link, size(links)
      associate (link => links(i))
        fraction = (along - link%here(1))/(link%here(2) - link%here(1))
        if (abs(fraction - 0.5_wp) <= 0.5_wp + slack) then
          other = link%edge
          there = link%there(1) + fraction*(link%there(2) - link%there(1))
          there = min(max(there, 0.0_wp), 1.0_wp)
          x = position(faces, edges(edge), along)
          do k = 1, 2
            call evaluate_edge(faces, edges(other), there, point, tangent, second, at)
            there = there + dot_product(x - point, tangent)/max(sum(tangent**2), tiny(1.0_wp))
            there = min(max(there, 0.0_wp), 1.0_wp)
          end do
          return
        end if
        if (link%is_last) return
      end associate
    end do
  end subroutine place_across

end module tool_edges
