!> Rigid tools: NURBS surfaces in a frame of their own, prepared once for the contact search.
!!
!! Tools are rigid, so faces, territories and position codes are built in the tool's frame and stay;
!! points are moved into that frame. [CA] R. P. R. Cardoso and O. B. Adetoro (2017), sec. 5.
!! A point X of the tool is at rotation*X + displacement in space.
module tool
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: place_text
  use nurbs_surface, only: nurbs_surface_t, has_area
  use surface_seams, only: surface_seams_t, find_surface_seams, orient_surfaces
  use knot_vector, only: n_spans, span_table
  use bezier, only: bezier_hulls, to_power_form
  use position_code, only: position_code_t, new_position_code
  use tool_cells, only: cell_t, cell_list_t, cut_surface, append_edge
  use trim_curve, only: curve_point, trim_loop_t
  use trim_loops, only: rectangle_loop
  use surface_trim, only: trim_t, new_trim, is_inside
  use tool_edges, only: tool_edge_t, edge_link_t, cut_edges, link_edges
  use cell_hierarchy, only: cell_hierarchy_t, new_cell_hierarchy
  use tool_seams, only: seam_t, find_tool_seams
  use tool_face, only: face_position
  implicit none
  private

  public :: tool_t, new_tool, seam_tolerance, rotation_about, to_tool_frame
  public :: largest_speed, travel_of, torque_of

  integer, parameter :: least_order = 3   !! lower degrees are padded to 2, which the lanes are for
  real(wp), parameter :: seam_width = 1.0_wp/300   !! widest seam, of the search distance

  !> A tool: its surfaces, its motion, and its faces (parts between consecutive distinct knots).
  type :: tool_t
    character(:), allocatable :: name
    type(nurbs_surface_t), allocatable :: surfaces(:)   !! in the tool's frame: as given
    integer :: side = 1                     !! +1: the sheet lies on the side of xi x eta, else -1
    real(wp) :: search_distance = 0.0_wp    !! how far from a face the search reaches [length]
    real(wp) :: displacement(3) = 0.0_wp    !! of the frame, set by whoever moves the tool [length]
    real(wp) :: velocity(3) = 0.0_wp        !! of the frame [length/time]
    logical :: is_turning = .false.         !! the three that follow are in use
    real(wp) :: rotation(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])   !! of the frame
    real(wp) :: rotation_rate(3, 3) = 0.0_wp   !! mean over the step that led there [1/time]
    real(wp) :: reference(3) = 0.0_wp       !! position of its axis in the frame [length]
    real(wp) :: force(3) = 0.0_wp           !! reaction of the sheet, zeroed each step [force]
    real(wp) :: torque(3) = 0.0_wp          !! its moment about `reference`, if the tool turns
                                            !! [force length]
    real(wp) :: scale = 1.0_wp              !! size the tolerances are measured by [length]
    integer :: n_faces = 0
    integer :: orders(2) = least_order      !! highest degrees of the surfaces + 1
    real(wp), allocatable :: coefficients(:, :, :, :)   !! power form, (4, orders(1:2), n_faces)
    integer, allocatable :: neighbours(:, :)   !! face across s = 0, s = 1, t = 0, t = 1; 0: none;
                                               !! -k: other surfaces, from `links(k)` on
    type(seam_t), allocatable :: links(:)      !! parts of edges that lie on other surfaces
    integer :: n_reversed = 0                    !! surfaces reversed so that normals agree
    integer, allocatable :: surface_of(:)      !! surface of each face, shape (n_faces)
    real(wp), allocatable :: low(:, :)         !! xi and eta where a face begins, (2, n_faces)
    real(wp), allocatable :: high(:, :)        !! xi and eta where a face ends, (2, n_faces)
    real(wp) :: box(3, 2) = 0.0_wp             !! corners of the box around all faces [length]
    type(cell_t), allocatable :: cells(:)      !! faces, cut where they bend or joined to blocks
    type(position_code_t) :: codes             !! cells within the search distance of a position
    type(cell_hierarchy_t) :: tree                  !! cells by their positions, for any distance
    logical :: is_trimmed = .false.            !! those that follow are in use
    type(trim_t), allocatable :: trims(:)      !! of the surfaces
    integer, allocatable :: faces_before(:)    !! of the surfaces before each
    logical, allocatable :: is_cut(:)          !! a part of the face, or all, does not count
    type(tool_edge_t), allocatable :: edges(:)        !! pieces of the edges of all surfaces
    type(edge_link_t), allocatable :: edge_links(:)   !! parts of them that lie on others
    real(wp), allocatable :: anchors(:, :)     !! a position of the tool in or near each cell
  end type tool_t

contains

  !> Prepare a tool for contact; surfaces are reversed where their normals do not agree. Rejected:
  !! no surface, weights that are not positive, points that are not finite, a side other than +1 or
  !! -1, a search distance that is not positive, untrimmed surfaces whose normals cannot agree
  !! across seams.
  subroutine new_tool(tool, name, surfaces, side, search_distance, error)
    type(tool_t), intent(out) :: tool
    character(*), intent(in) :: name
    type(nurbs_surface_t), intent(in) :: surfaces(:)   !! where they are at the start
    integer, intent(in) :: side                        !! +1: the sheet lies on the side of xi x eta
    real(wp), intent(in) :: search_distance            !! about three sheet thicknesses [length]
    type(error_t), allocatable, intent(out) :: error
    type(surface_seams_t) :: seams
    integer :: i

    call check(name, surfaces, side, search_distance, error)
    if (allocated(error)) return
    tool%name = name
    tool%surfaces = surfaces
    tool%side = side
    tool%search_distance = search_distance
    if (size(surfaces) > 1) then
      call find_surface_seams(tool%surfaces, seam_tolerance(search_distance), seams)
      if (seams%is_one_sided .and. any([(allocated(surfaces(i)%loops), i=1, size(surfaces))])) then
        seams%is_reversed = .false.   ! as whoever read them has left them
      else if (seams%is_one_sided) then
        call fail(error, "tool "//name//": the normals of its surfaces cannot agree across "// &
                  "their seams")
        return
      end if
      call orient_surfaces(seams, tool%surfaces)
      tool%n_reversed = count(seams%is_reversed)
    end if
    call set_faces(tool)
    if (tool%is_trimmed) then
      call link_edges(tool%coefficients, seam_tolerance(search_distance), tool%edges, &
                      tool%edge_links)
      return
    end if
    if (size(surfaces) > 1) call find_tool_seams(tool%coefficients, tool%surface_of, &
      seam_tolerance(search_distance), tool%neighbours, tool%links)
  end subroutine new_tool

  !> Widest gap between edges of a tool that counts as none [length].
  pure real(wp) function seam_tolerance(search_distance)
    real(wp), intent(in) :: search_distance   !! [length]

    seam_tolerance = seam_width*search_distance
  end function seam_tolerance

  subroutine check(name, surfaces, side, search_distance, error)
    character(*), intent(in) :: name
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    integer, intent(in) :: side
    real(wp), intent(in) :: search_distance
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: farthest = 1.0e50_wp     ! areas and volumes squared stay numbers
    real(wp), parameter :: most_uneven = 1.0e9_wp   ! beyond it searches find no end of minima
    integer :: i

    if (size(surfaces) == 0) then
      call fail(error, "tool "//name//": has no surface")
    else if (abs(side) /= 1) then
      call fail(error, "tool "//name//": the side must be +1 or -1")
    else if (.not. (search_distance > 0.0_wp .and. ieee_is_finite(search_distance))) then
      call fail(error, "tool "//name//": the search distance must be positive")
    end if
    do i = 1, size(surfaces)
      if (allocated(error)) return
      if (.not. all(abs(surfaces(i)%points) < farthest)) then
        call fail(error, "tool "//name//": control points must be finite and below 1e50")
      else if (.not. all(surfaces(i)%weights > 0.0_wp)) then
        call fail(error, "tool "//name//": weights must be positive")
      else if (maxval(surfaces(i)%weights)/minval(surfaces(i)%weights) > most_uneven) then
        call fail(error, "tool "//name//": weights must lie within a factor of 1e9")
      else if (.not. has_area(surfaces(i))) then
        call fail(error, "tool "//name//": a surface without area at "// &
                  place_text(surfaces(i)%points(1, 1, :)))
      end if
    end do
  end subroutine check

  !> Faces of all surfaces with their power form, neighbours, cells and position codes.
  subroutine set_faces(tool)
    type(tool_t), intent(inout) :: tool
    type(cell_list_t) :: cells
    real(wp), allocatable :: boxes(:, :, :)
    integer :: surface, i, n

    tool%n_faces = 0
    do surface = 1, size(tool%surfaces)
      associate (axes => tool%surfaces(surface)%axes)
        tool%n_faces = tool%n_faces + n_spans(axes(1))*n_spans(axes(2))
        tool%orders = max(tool%orders, axes%degree + 1)
      end associate
    end do
    n = tool%n_faces
    allocate (tool%coefficients(4, tool%orders(1), tool%orders(2), n), source=0.0_wp)
    allocate (tool%neighbours(4, n), tool%surface_of(n), tool%low(2, n), tool%high(2, n))
    call set_trims(tool)
    n = 0
    do surface = 1, size(tool%surfaces)
      call set_surface(tool, surface, n, cells)
    end do
    tool%cells = cells%items(:cells%n)
    if (tool%is_trimmed) call set_anchors(tool)
    allocate (boxes(3, 2, cells%n))
    do i = 1, cells%n
      boxes(:, :, i) = tool%cells(i)%box
    end do
    tool%box(:, 1) = minval(boxes(:, 1, :), 2)
    tool%box(:, 2) = maxval(boxes(:, 2, :), 2)
    tool%scale = maxval(abs(tool%box))
    call new_position_code(tool%codes, boxes, tool%search_distance)
    call new_cell_hierarchy(tool%tree, boxes)
  end subroutine set_faces

  !> Faces and cells of one surface.
  subroutine set_surface(tool, surface, n, cells)
    type(tool_t), intent(inout) :: tool
    integer, intent(in) :: surface
    integer, intent(inout) :: n          !! faces so far
    type(cell_list_t), intent(inout) :: cells
    integer :: spans1(n_spans(tool%surfaces(surface)%axes(1)))
    integer :: spans2(n_spans(tool%surfaces(surface)%axes(2)))
    integer :: i, j, first

    first = n + 1
    associate (axes => tool%surfaces(surface)%axes)
      spans1 = span_table(axes(1))
      spans2 = span_table(axes(2))
      do j = 1, size(spans2)
        do i = 1, size(spans1)
          n = n + 1
          tool%surface_of(n) = surface
          tool%low(:, n) = [axes(1)%knots(spans1(i)), axes(2)%knots(spans2(j))]
          tool%high(:, n) = [axes(1)%knots(spans1(i) + 1), axes(2)%knots(spans2(j) + 1)]
        end do
      end do
      call link_faces(tool%surfaces(surface), first - 1, tool%neighbours(:, first:n))
      associate (p => axes(1)%degree, q => axes(2)%degree)
        associate (hulls => tool%coefficients(:, :p + 1, :q + 1, first:n))
          call bezier_hulls(tool%surfaces(surface), hulls)
          if (tool%is_trimmed) then
            call cut_surface(cells, first - 1, [size(spans1), size(spans2)], hulls, &
                             tool%search_distance, tool%trims(surface)%root < 0)
          else
            call cut_surface(cells, first - 1, [size(spans1), size(spans2)], hulls, &
                             tool%search_distance)
          end if
        end associate
        if (tool%is_trimmed) call set_edges(tool, surface, first, n, cells)
        do i = first, n
          call to_power_form(p, q, tool%coefficients(:, :p + 1, :q + 1, i))
        end do
      end associate
    end associate
  end subroutine set_surface

  !> Prepare the trims, if a surface has one. Then those without have their border as their edge.
  subroutine set_trims(tool)
    type(tool_t), intent(inout) :: tool
    type(trim_loop_t) :: border(1)
    integer :: s

    tool%is_trimmed = any([(allocated(tool%surfaces(s)%loops), s=1, size(tool%surfaces))])
    if (.not. tool%is_trimmed) return
    allocate (tool%trims(size(tool%surfaces)), tool%faces_before(size(tool%surfaces)))
    allocate (tool%is_cut(tool%n_faces), tool%edges(64), tool%links(0))
    do s = 1, size(tool%surfaces)
      associate (surface => tool%surfaces(s))
        if (allocated(surface%loops)) then
          call new_trim(tool%trims(s), surface%axes, surface%loops)
        else
          border(1) = rectangle_loop(surface)
          call new_trim(tool%trims(s), surface%axes, border)
        end if
      end associate
    end do
  end subroutine set_trims

  !> Edges of a surface and their cells, while the coefficients of its faces are Bezier points.
  subroutine set_edges(tool, surface, first, last, cells)
    type(tool_t), intent(inout) :: tool
    integer, intent(in) :: surface
    integer, intent(in) :: first, last   !! its faces
    type(cell_list_t), intent(inout) :: cells
    real(wp) :: ends(2, 2)
    integer :: i, n, n_before

    tool%faces_before(surface) = first - 1
    tool%is_cut(first:last) = tool%trims(surface)%root /= 0
    n_before = 0
    if (surface > 1) n_before = findloc(tool%edges%face > 0, .true., 1, back=.true.)
    n = n_before
    call cut_edges(tool%surfaces(surface), tool%trims(surface), tool%low(:, first:last), &
                   tool%high(:, first:last), first - 1, &
                   0.1_wp*seam_tolerance(tool%search_distance), tool%edges, n)
    associate (axes => tool%surfaces(surface)%axes)
      do i = n_before + 1, n
        associate (edge => tool%edges(i))
          ends(:, 1) = min(max(curve_point(edge%curve, 0.0_wp), 0.0_wp), 1.0_wp)
          ends(:, 2) = min(max(curve_point(edge%curve, 1.0_wp), 0.0_wp), 1.0_wp)
          call append_edge(cells, i, edge%face, &
                           tool%coefficients(:, :axes(1)%degree + 1, :axes(2)%degree + 1, &
                                             edge%face), minval(ends, 2), maxval(ends, 2))
        end associate
      end do
    end associate
    if (surface == size(tool%surfaces)) tool%edges = tool%edges(:n)
  end subroutine set_edges

  !> A position of the tool near each cell: its middle, or where an edge of its face begins.
  subroutine set_anchors(tool)
    type(tool_t), intent(inout) :: tool
    integer :: edge_of(tool%n_faces), i, face
    real(wp) :: at(2)

    edge_of = 0
    do i = 1, size(tool%edges)
      edge_of(tool%edges(i)%face) = i
    end do
    do i = 2, tool%n_faces    ! others of the surface where the face has none
      if (edge_of(i) == 0 .and. tool%surface_of(i) == tool%surface_of(i - 1)) &
        edge_of(i) = edge_of(i - 1)
    end do
    do i = tool%n_faces - 1, 1, -1
      if (edge_of(i) == 0 .and. tool%surface_of(i) == tool%surface_of(i + 1)) &
        edge_of(i) = edge_of(i + 1)
    end do
    allocate (tool%anchors(3, size(tool%cells)))
    do i = 1, size(tool%cells)
      face = tool%cells(i)%face
      at = 0.5_wp*(tool%cells(i)%low + tool%cells(i)%high)
      if (tool%cells(i)%edge > 0 .or. .not. is_inside(tool%trims(tool%surface_of(face)), &
          face - tool%faces_before(tool%surface_of(face)), at)) then
        associate (edge => merge(tool%cells(i)%edge, edge_of(face), tool%cells(i)%edge > 0))
          face = tool%edges(edge)%face
          at = min(max(curve_point(tool%edges(edge)%curve, 0.0_wp), 0.0_wp), 1.0_wp)
        end associate
      end if
      tool%anchors(:, i) = face_position(tool%coefficients, face, at)
    end do
  end subroutine set_anchors

  !> Faces across the four edges of each face of a surface, `before` being the number of faces of
  !! the surfaces before it. A surface closed on itself has no edge there.
  pure subroutine link_faces(surface, before, neighbours)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: before
    integer, intent(out) :: neighbours(:, :)
    integer :: i, j, n1, n2
    logical :: is_round(2)

    n1 = n_spans(surface%axes(1))
    n2 = n_spans(surface%axes(2))
    associate (points => surface%points, w => surface%weights, n => surface%axes%n_basis, &
               largest => maxval(abs(surface%points)))
      is_round = [are_one(points(1, :, :), points(n(1), :, :), w(1, :), w(n(1), :), largest), &
                  are_one(points(:, 1, :), points(:, n(2), :), w(:, 1), w(:, n(2)), largest)]
    end associate
    do j = 1, n2
      do i = 1, n1
        associate (across => neighbours(:, i + n1*(j - 1)))
          across = before + n1*(j - 1) + i + [-1, 1, -n1, n1]
          if (i == 1) across(1) = merge(across(1) + n1, 0, is_round(1))
          if (i == n1) across(2) = merge(across(2) - n1, 0, is_round(1))
          if (j == 1) across(3) = merge(across(3) + n1*n2, 0, is_round(2))
          if (j == n2) across(4) = merge(across(4) - n1*n2, 0, is_round(2))
        end associate
      end do
    end do
  end subroutine link_faces

  !> Whether two opposite edges of a surface are one, up to a factor of the weights.
  pure logical function are_one(a, b, v, w, largest)
    real(wp), intent(in) :: a(:, :), b(:, :)   !! control points, shape (n, 3)
    real(wp), intent(in) :: v(:), w(:)         !! weights
    real(wp), intent(in) :: largest            !! coordinate of the surface
    real(wp), parameter :: same = 1.0e-10_wp

    are_one = all(abs(v*w(1) - w*v(1)) <= same*v*w(1)) .and. maxval(abs(a - b)) <= same*largest
  end function are_one

  !> Matrix of the rotation about an axis by an angle, right-handed (O. Rodrigues, 1840).
  pure function rotation_about(axis, angle) result(matrix)
    real(wp), intent(in) :: axis(3)   !! unit vector
    real(wp), intent(in) :: angle     !! [radians]
    real(wp) :: matrix(3, 3)
    integer :: i, j

    do j = 1, 3
      do i = 1, 3
        matrix(i, j) = (1.0_wp - cos(angle))*axis(i)*axis(j)
      end do
      matrix(j, j) = matrix(j, j) + cos(angle)
    end do
    matrix(:, 1) = matrix(:, 1) + sin(angle)*[0.0_wp, axis(3), -axis(2)]
    matrix(:, 2) = matrix(:, 2) + sin(angle)*[-axis(3), 0.0_wp, axis(1)]
    matrix(:, 3) = matrix(:, 3) + sin(angle)*[axis(2), -axis(1), 0.0_wp]
  end function rotation_about

  !> Turn points with the tool back to where it began, but leave them as far as it has moved: where
  !! they would be relative to a tool that had only moved.
  pure subroutine to_tool_frame(tool, n, x)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n, 3)   !! [length]

    x = matmul(x - spread(tool%displacement, 1, n), tool%rotation) + spread(tool%displacement, 1, n)
  end subroutine to_tool_frame

  !> Displacement of a tool: of its point on the axis about which it turns.
  pure function travel_of(tool) result(travel)
    type(tool_t), intent(in) :: tool
    real(wp) :: travel(3)

    travel = tool%displacement
    if (tool%is_turning) travel = travel + matmul(tool%rotation, tool%reference) - tool%reference
  end function travel_of

  !> Moment about the tool's reference of forces whose couple, forces times positions in the tool's
  !! frame, is known.
  pure function torque_of(tool, force, couple) result(torque)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: force(3)       !! their sum in space [force]
    real(wp), intent(in) :: couple(3, 3)   !! sum of f_i X_j [force length]
    real(wp) :: torque(3)                  !! in space [force length]
    real(wp) :: about(3, 3)
    integer :: j

    do j = 1, 3
      about(:, j) = couple(:, j) - force*tool%reference(j)
    end do
    about = matmul(about, transpose(tool%rotation))
    torque = [about(3, 2) - about(2, 3), about(1, 3) - about(3, 1), about(2, 1) - about(1, 2)]
  end function torque_of

  !> Largest speed of a corner of the box around the tool [length/time].
  pure real(wp) function largest_speed(tool) result(speed)
    type(tool_t), intent(in) :: tool
    real(wp) :: corner(3)
    integer :: i

    speed = norm2(tool%velocity)
    if (.not. tool%is_turning) return
    speed = 0.0_wp
    do i = 0, 7
      corner = merge(tool%box(:, 1), tool%box(:, 2), [btest(i, 0), btest(i, 1), btest(i, 2)])
      speed = max(speed, norm2(tool%velocity + matmul(tool%rotation_rate, corner)))
    end do
  end function largest_speed

end module tool
