!> Points of a tool that are compared with the blank or with other surfaces.
module tool_points
  use kinds, only: wp
  use tool, only: tool_t
  use tool_face, only: face_derivatives, face_position, unit_normal
  use closest_point, only: hit_t, is_beside
  use tool_edges, only: evaluate_edge
  use edge_contact, only: is_on_tool
  use linear_algebra, only: cross
  use tool_search, only: search_all_faces
  implicit none
  private

  public :: tool_point_t, inner_points, border_points, length_along, foot

  !> A point of a tool in the tool's own frame.
  type :: tool_point_t
    real(wp) :: x(3) = 0.0_wp
    real(wp) :: normal(3) = 0.0_wp            !! unit, towards the sheet
    real(wp) :: outward(3) = 0.0_wp           !! unit, along the tool and out of it, at an edge
    integer :: surface = 0                    !! of the tool
  end type tool_point_t

  integer, parameter :: most_points = 400     !! inside, and as many at edges
  integer, parameter :: per_edge = 3          !! along an edge of a face

contains

  !> Points spread over the faces of a tool, or over the parts of them in a box.
  pure function inner_points(tool, box) result(points)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in), optional :: box(3, 2)   !! bounds in the tool's frame [length]
    type(tool_point_t), allocatable :: points(:)
    integer, allocatable :: faces(:)
    real(wp) :: bounds(2, 2, tool%n_faces)
    logical :: is_in(tool%n_faces)
    real(wp) :: at(2)
    integer :: every, per_side, n, f, i, j

    bounds(:, 1, :) = 0.0_wp
    bounds(:, 2, :) = 1.0_wp
    is_in = .true.
    if (present(box)) then
      do f = 1, tool%n_faces
        call find_part(tool, f, box, bounds(:, :, f), is_in(f))
      end do
    end if
    faces = pack([(f, f=1, tool%n_faces)], is_in)
    if (tool%is_trimmed) faces = pack(faces, [(any_inside(tool, faces(f)), f=1, size(faces))])
    every = max(1, (size(faces) + most_points - 1)/most_points)
    faces = faces(::every)
    per_side = max(1, int(sqrt(real(most_points, wp)/max(1, size(faces)))))
    allocate (points(size(faces)*per_side**2))
    n = 0
    do f = 1, size(faces)
      associate (low => bounds(:, 1, faces(f)), high => bounds(:, 2, faces(f)))
        do j = 1, per_side
          do i = 1, per_side
            n = n + 1
            at = low + (high - low)*[i - 0.5_wp, j - 0.5_wp]/per_side
            points(n) = point_of(tool, faces(f), at)
            if (.not. is_on_tool(tool, faces(f), at)) n = n - 1
          end do
        end do
      end associate
    end do
    points = points(:n)
  end function inner_points

  !> Part of a face, in local coordinates, outside of which no point lies in the box; it may be
  !! wider than need be.
  pure subroutine find_part(tool, face, box, bounds, is_in)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face
    real(wp), intent(in) :: box(3, 2)         !! [length]
    real(wp), intent(inout) :: bounds(2, 2)   !! low and high
    logical, intent(out) :: is_in             !! there may be one
    integer, parameter :: n = 5, n_turns = 6
    real(wp) :: x(3, n, n), width(3), old(2, 2)
    logical :: is_near(n, n)
    integer :: i, j, d, turn

    do turn = 1, n_turns
      old = bounds
      do j = 1, n
        do i = 1, n
          x(:, i, j) = face_position(tool%coefficients, face, &
                                     old(:, 1) + (old(:, 2) - old(:, 1))*[i - 1, j - 1]/(n - 1))
        end do
      end do
      do d = 1, 3
        width(d) = max(maxval(abs(x(d, 2:, :) - x(d, :n - 1, :))), &
                       maxval(abs(x(d, :, 2:) - x(d, :, :n - 1))))
      end do
      is_near = reshape([((all(x(:, i, j) >= box(:, 1) - width .and. &
                               x(:, i, j) <= box(:, 2) + width), i=1, n), j=1, n)], [n, n])
      is_in = any(is_near)
      if (.not. is_in) return
      do d = 1, 2
        associate (step => (old(d, 2) - old(d, 1))/(n - 1))
          bounds(d, 1) = old(d, 1) + step*(findloc(any(is_near, 3 - d), .true., 1) - 1)
          bounds(d, 2) = old(d, 1) + step*(findloc(any(is_near, 3 - d), .true., 1, back=.true.) - 1)
        end associate
      end do
      bounds(:, 2) = max(bounds(:, 2), bounds(:, 1) + epsilon(1.0_wp))
      if (all(abs(bounds - old) <= 0.0_wp)) return
    end do
  end subroutine find_part

  !> Whether something of a face of a trimmed tool counts.
  pure logical function any_inside(tool, face)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face

    associate (s => tool%surface_of(face))
      any_inside = tool%trims(s)%root(face - tool%faces_before(s)) >= 0
    end associate
  end function any_inside

  !> Points of the edges beyond which the tool has no face, of every n-th edge if these are many.
  pure function border_points(tool) result(points)
    type(tool_t), intent(in) :: tool
    type(tool_point_t), allocatable :: points(:)
    real(wp) :: at(2)
    integer :: n, every, f, e, i, d

    if (tool%is_trimmed) then
      points = free_edge_points(tool)
      return
    end if
    n = count(tool%neighbours == 0)
    every = (per_edge*n + most_points - 1)/most_points
    if (n == 0) every = 1
    allocate (points(0))
    n = 0
    do f = 1, tool%n_faces
      do e = 1, 4
        if (tool%neighbours(e, f) /= 0) cycle
        n = n + 1
        if (mod(n, every) /= 0) cycle
        d = (e + 1)/2
        do i = 1, per_edge
          at(d) = merge(0.0_wp, 1.0_wp, mod(e, 2) == 1)
          at(3 - d) = (i - 0.5_wp)/per_edge
          points = [points, edge_point(tool, f, at, d)]
        end do
      end do
    end do
    points = pack(points, lengths_of(points) > 0.0_wp)
  end function border_points

  !> Points of the edges of a trimmed tool that lie on no other one.
  pure function free_edge_points(tool) result(points)
    type(tool_t), intent(in) :: tool
    type(tool_point_t), allocatable :: points(:)
    real(wp) :: x(3), tangent(3), second(3), at(2)
    integer :: every, e, n, i

    n = count(tool%edges%first_link == 0 .and. .not. tool%edges%is_short)
    every = max(1, (per_edge*n + most_points - 1)/most_points)
    allocate (points(0))
    n = 0
    do e = 1, size(tool%edges)
      if (tool%edges(e)%first_link /= 0 .or. tool%edges(e)%is_short) cycle
      n = n + 1
      if (mod(n, every) /= 0) cycle
      do i = 1, per_edge
        call evaluate_edge(tool%coefficients, tool%edges(e), (i - 0.5_wp)/per_edge, x, tangent, &
                           second, at)
        points = [points, point_of(tool, tool%edges(e)%face, at)]
        associate (point => points(size(points)))
          if (norm2(tangent) > 0.0_wp) &
            point%outward = cross(tangent/norm2(tangent), tool%side*point%normal)
        end associate
      end do
    end do
    points = pack(points, lengths_of(points) > 0.0_wp)
  end function free_edge_points

  pure function lengths_of(points) result(length)
    type(tool_point_t), intent(in) :: points(:)
    real(wp) :: length(size(points))
    integer :: i

    length = [(norm2(points(i)%outward)*norm2(points(i)%normal), i=1, size(points))]
  end function lengths_of

  pure function point_of(tool, face, at) result(point)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)             !! local coordinates
    type(tool_point_t) :: point
    real(wp) :: d1(3, 2), d2(3, 3)

    call face_derivatives(tool%coefficients, face, at, point%x, d1, d2)
    point%normal = tool%side*unit_normal(d1)
    point%surface = tool%surface_of(face)
  end function point_of

  !> A point of an edge across which coordinate `d` ends; no direction where the edge has shrunk.
  pure function edge_point(tool, face, at, d) result(point)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face, d
    real(wp), intent(in) :: at(2)
    type(tool_point_t) :: point
    real(wp) :: d1(3, 2), d2(3, 3), along(3), out(3)

    call face_derivatives(tool%coefficients, face, at, point%x, d1, d2)
    point%normal = tool%side*unit_normal(d1)
    point%surface = tool%surface_of(face)
    along = d1(:, 3 - d)
    if (.not. norm2(along) > 0.0_wp) return
    along = along/norm2(along)
    out = merge(1.0_wp, -1.0_wp, at(d) > 0.5_wp)*d1(:, d)
    out = out - dot_product(out, along)*along
    if (norm2(out) > 0.0_wp) point%outward = out/norm2(out)
  end function edge_point

  !> How far a surface goes on from a point near it in a direction, along the surface, to within
  !! `step`; 0 if less. A closed surface has an end where it has gone around.
  real(wp) function length_along(surface, x, direction, step) result(length)
    type(tool_t), intent(in) :: surface
    real(wp), intent(in) :: x(3)
    real(wp), intent(in) :: direction(3)      !! unit vector
    real(wp), intent(in) :: step              !! [length]
    integer, parameter :: most_steps = 200
    real(wp), parameter :: bent = 0.2_wp      !! distance from the surface, of a step
    type(hit_t) :: hit
    real(wp) :: here(3), way(3), trial
    integer :: i

    length = 0.0_wp
    here = x
    way = direction
    trial = step
    do i = 1, most_steps
      call search_all_faces(surface, here + trial*way, hit)
      if (is_beside(surface, hit, 0.0_wp) .or. hit%distance > bent*trial + step) then
        if (.not. trial > step) exit
        trial = max(step, 0.5_wp*trial)
        cycle
      end if
      length = length + trial
      here = foot(surface, hit)
      way = way - dot_product(way, hit%normal)*hit%normal
      if (.not. norm2(way) > 0.0_wp .or. length > 4*surface%scale) exit
      if (length > 4*trial .and. norm2(here - x) <= trial) exit   ! once around
      way = way/norm2(way)
      trial = 2*trial
    end do
  end function length_along

  !> The point that a search has found.
  pure function foot(tool, hit) result(x)
    type(tool_t), intent(in) :: tool
    type(hit_t), intent(in) :: hit
    real(wp) :: x(3)

    x = face_position(tool%coefficients, hit%face, hit%at)
  end function foot

end module tool_points
