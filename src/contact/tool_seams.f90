!> Seams of a tool: where the edge of one surface lies on that of another, so that the search of
!! closest points walks on there. The knots of the two need not match.
module tool_seams
  use kinds, only: wp
  use linear_algebra, only: sorted_order
  use tool_face, only: face_position, face_derivatives
  implicit none
  private

  public :: seam_t, find_tool_seams, move_across, edge_position

  integer, parameter :: n_samples = 8             !! parts of an edge, for first guesses
  real(wp), parameter :: shortest = 1.0e-6_wp     !! common part, of an edge

  !> Part of an edge of a face, and what lies beyond it.
  type :: seam_t
    integer :: face = 0, edge = 0      !! face and edge beyond: s = 0, s = 1, t = 0, t = 1
    real(wp) :: here(2) = 0.0_wp       !! coordinate along the edge where the part begins and ends
    real(wp) :: there(2) = 0.0_wp      !! the same positions on the edge beyond
    logical :: is_last = .false.       !! of this edge
  end type seam_t

  !> An edge of a surface.
  type :: edge_t
    integer :: face = 0, edge = 0, surface = 0
    real(wp) :: box(3, 2) = 0.0_wp     !! corners of the box around it [length]
  end type edge_t

contains

  !> Seams of all edges of surfaces: those of edge (face, e) begin at `-neighbours(e, face)` in the
  !! list.
  pure subroutine find_tool_seams(faces, surface_of, tolerance, neighbours, links)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)   !! power form of the faces
    integer, intent(in) :: surface_of(:)               !! surface of each face
    real(wp), intent(in) :: tolerance                  !! distance of points that are one [length]
    integer, intent(inout) :: neighbours(:, :)         !! 0: none so far
    type(seam_t), allocatable, intent(out) :: links(:)
    type(edge_t), allocatable :: edges(:)
    type(seam_t), allocatable :: found(:), ordered(:)
    integer, allocatable :: owner(:), order(:)
    integer :: i, j, k, n

    edges = border_edges(faces, surface_of, tolerance, neighbours)
    order = sorted_order(edges%box(1, 1))
    allocate (found(64), owner(64))
    n = 0
    do k = 1, size(edges)
      i = order(k)
      do j = k + 1, size(edges)
        if (edges(order(j))%box(1, 1) > edges(i)%box(1, 2)) exit
        call join(faces, tolerance, edges, i, order(j), found, owner, n)
      end do
    end do
    allocate (ordered(n))
    order = sorted_order(real(owner(:n), wp))
    do k = 1, n
      ordered(k) = found(order(k))
      i = owner(order(k))
      ordered(k)%is_last = k == n
      if (k < n) ordered(k)%is_last = owner(order(k + 1)) /= i
      if (neighbours(edges(i)%edge, edges(i)%face) == 0) &
        neighbours(edges(i)%edge, edges(i)%face) = -k
    end do
    call move_alloc(ordered, links)
  end subroutine find_tool_seams

  !> Border edges that have a length.
  pure function border_edges(faces, surface_of, tolerance, neighbours) result(edges)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    integer, intent(in) :: surface_of(:), neighbours(:, :)
    real(wp), intent(in) :: tolerance
    type(edge_t), allocatable :: edges(:)
    real(wp) :: positions(3, 0:n_samples)
    integer :: face, e, i, n

    allocate (edges(count(neighbours == 0)))
    n = 0
    do face = 1, size(neighbours, 2)
      do e = 1, 4
        if (neighbours(e, face) /= 0) cycle
        do i = 0, n_samples
          positions(:, i) = face_position(faces, face, edge_position(e, real(i, wp)/n_samples))
        end do
        if (all(maxval(positions, 2) - minval(positions, 2) <= tolerance)) cycle
        n = n + 1
        edges(n)%face = face
        edges(n)%edge = e
        edges(n)%surface = surface_of(face)
        ! Between samples the edge leaves their box by less than their largest distance.
        edges(n)%box(:, 1) = minval(positions, 2) - tolerance &
          - maxval(abs(positions(:, 1:) - positions(:, :n_samples - 1)))
        edges(n)%box(:, 2) = maxval(positions, 2) + tolerance &
          + maxval(abs(positions(:, 1:) - positions(:, :n_samples - 1)))
      end do
    end do
    edges = edges(:n)
  end function border_edges

  !> Enter the common part of two edges of different surfaces, in both directions, if there is one.
  pure subroutine join(faces, tolerance, edges, i, j, found, owner, n)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    integer, intent(in) :: i, j
    real(wp), intent(in) :: tolerance
    type(edge_t), intent(in) :: edges(:)
    type(seam_t), allocatable, intent(inout) :: found(:)
    integer, allocatable, intent(inout) :: owner(:)
    integer, intent(inout) :: n
    type(seam_t), allocatable :: longer(:)
    real(wp) :: ends(2, 4), c
    integer :: k, n_ends, low, high
    logical :: is_on

    if (edges(i)%surface == edges(j)%surface) return
    if (any(edges(i)%box(:, 1) > edges(j)%box(:, 2) .or. &
            edges(j)%box(:, 1) > edges(i)%box(:, 2))) return
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
    if (ends(1, high) - ends(1, low) < shortest) return
    call project(faces, edges(i), 0.5_wp*(ends(1, low) + ends(1, high)), edges(j), &
                 tolerance, c, is_on)
    if (.not. is_on) return
    if (n + 2 > size(found)) then
      allocate (longer(2*size(found)))
      longer(:n) = found(:n)
      call move_alloc(longer, found)
      owner = [owner(:n), spread(0, 1, size(found) - n)]
    end if
    found(n + 1) = seam_t(edges(j)%face, edges(j)%edge, ends(1, [low, high]), ends(2, [low, high]))
    owner(n + 1) = i
    if (ends(2, low) > ends(2, high)) then
      k = low
      low = high
      high = k
    end if
    found(n + 2) = seam_t(edges(i)%face, edges(i)%edge, ends(2, [low, high]), ends(1, [low, high]))
    owner(n + 2) = j
    n = n + 2
  end subroutine join

  !> Coordinate along an edge next to a position of another, and whether the two are within
  !! tolerance.
  pure subroutine project(faces, from, at, onto, tolerance, c, is_on)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    real(wp), intent(in) :: at, tolerance
    type(edge_t), intent(in) :: from, onto
    real(wp), intent(out) :: c
    logical, intent(out) :: is_on
    integer, parameter :: n_steps = 12
    real(wp) :: x(3), squares(0:n_samples)
    integer :: i

    c = 0.0_wp
    x = face_position(faces, from%face, edge_position(from%edge, at))
    is_on = all(x >= onto%box(:, 1)) .and. all(x <= onto%box(:, 2))
    if (.not. is_on) return
    do i = 0, n_samples
      squares(i) = sum((x - face_position(faces, onto%face, &
                                          edge_position(onto%edge, real(i, wp)/n_samples)))**2)
    end do
    c = real(minloc(squares, 1) - 1, wp)/n_samples
    call slide(faces, onto%face, onto%edge, x, n_steps, c)
    is_on = norm2(x - face_position(faces, onto%face, edge_position(onto%edge, c))) <= tolerance
  end subroutine project

  !> Gauss-Newton steps along an edge towards the position next to `x`.
  pure subroutine slide(faces, face, edge, x, n_steps, c)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)
    integer, intent(in) :: face, edge, n_steps
    real(wp), intent(in) :: x(3)
    real(wp), intent(inout) :: c
    real(wp) :: point(3), d1(3, 2), d2(3, 3)
    integer :: i, d

    d = merge(2, 1, edge <= 2)
    do i = 1, n_steps
      call face_derivatives(faces, face, edge_position(edge, c), point, d1, d2)
      c = c + dot_product(x - point, d1(:, d))/max(sum(d1(:, d)**2), tiny(1.0_wp))
      c = min(max(c, 0.0_wp), 1.0_wp)
    end do
  end subroutine slide

  !> Face and position beyond the seams of an edge; face 0 where none of them holds the position.
  pure subroutine move_across(faces, links, first, along, x, other, there, d_there)
    real(wp), intent(in), contiguous :: faces(:, :, :, :)   !! power form of the faces
    type(seam_t), intent(in) :: links(:)
    integer, intent(in) :: first        !! of the edge's seams
    real(wp), intent(in) :: along       !! coordinate of the position along the edge
    real(wp), intent(in) :: x(3)        !! the position [length]
    integer, intent(out) :: other       !! face beyond
    real(wp), intent(out) :: there(2)   !! local coordinates on it
    integer, intent(out) :: d_there     !! coordinate that is at its end there
    integer, parameter :: n_steps = 2
    real(wp) :: fraction
    integer :: i

    other = 0
    there = 0.0_wp
    d_there = 1
    do i = first, size(links)
      associate (seam => links(i))
        fraction = (along - seam%here(1))/(seam%here(2) - seam%here(1))
        if (abs(fraction - 0.5_wp) <= 0.5_wp + shortest) then
          fraction = seam%there(1) + fraction*(seam%there(2) - seam%there(1))
          fraction = min(max(fraction, 0.0_wp), 1.0_wp)
          call slide(faces, seam%face, seam%edge, x, n_steps, fraction)
          other = seam%face
          there = edge_position(seam%edge, fraction)
          d_there = (seam%edge + 1)/2
          return
        end if
        if (seam%is_last) return
      end associate
    end do
  end subroutine move_across

  !> Local coordinates of a position on an edge, `c` running along s or t from 0 to 1.
  pure function edge_position(edge, c) result(at)
    integer, intent(in) :: edge         !! 1: s = 0, 2: s = 1, 3: t = 0, 4: t = 1
    real(wp), intent(in) :: c
    real(wp) :: at(2)

    at = c
    at((edge + 1)/2) = real(modulo(edge + 1, 2), wp)
  end function edge_position

end module tool_seams
