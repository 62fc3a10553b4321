!> Closest point of a tool from nothing: which cells may hold it, and a local search from each.
!!
!! [CA] R. P. R. Cardoso and O. B. Adetoro (2017), sec. 5: position codes name the cells, contact
!! territories (46), (47) leave the few that matter, and Newton (48) to (53) starts from these.
module tool_search
  use kinds, only: wp
  use tool, only: tool_t, seam_tolerance
  use tool_edges, only: nearest_on_edge, evaluate_edge
  use edge_contact, only: is_on_tool, is_lowest
  use tool_face, only: face_position
  use tool_cells, only: cell_t
  use contact_territory, only: is_in_territory, distance_bound, relative_position
  use position_code, only: find_candidates
  use cell_hierarchy, only: nearest_leaf, collect_leaves
  use closest_point, only: hit_t, descend, finish
  implicit none
  private

  public :: search_tool, search_all_faces

  real(wp), parameter :: same_point = 1.0e-8_wp    !! part of the tool's scale
  real(wp), parameter :: round_off = 1.0e-14_wp    !! of a position, likewise
  integer, parameter :: n_net = 5                  !! points of a net over a cell, per direction

contains

  !> Closest point among the cells that the position code of `x` names and whose territory holds it.
  !! Nothing found means that `x` is farther than the search distance from every face, unless
  !! `is_converged` is false: then every start failed. The rival is exact if nearer than
  !! `distance + margin`.
  pure subroutine search_tool(tool, x, margin, is_corner_start, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)                !! point in the tool's frame [length]
    real(wp), intent(in) :: margin              !! how much farther rivals matter [length]
    logical, intent(in) :: is_corner_start      !! start at each face's first corner, as [CA] does
    type(hit_t), intent(out) :: hit
    integer :: first, last, i, n

    call find_candidates(tool%codes, x, first, last)
    block
      integer :: near(last - first + 1)   ! not on the heap: searches are many
      real(wp) :: bounds(last - first + 1), lost

      n = 0
      do i = first, last
        associate (cell => tool%codes%faces(i))
          if (tool%is_trimmed) then
            if (is_smooth_edge(tool, cell)) cycle
          end if
          if (.not. is_in_territory(tool%cells(cell)%territory, x, tool%search_distance)) cycle
          if (distance_bound(tool%cells(cell)%territory, x) > tool%search_distance) cycle
          n = n + 1
          near(n) = cell
        end associate
      end do
      call search_cells(tool, x, margin, is_corner_start, near(:n), bounds(:n), hit, lost)
      if (lost < hit%distance - same_point*tool%scale) &
        call try_smooth_edges(tool, x, tool%codes%faces(first:last), hit)
    end block
    if (hit%face /= 0) call finish(tool, x, hit)
    if (n == 0) hit%is_converged = .true.
    if (hit%face == 0 .or. hit%distance <= tool%search_distance) return
    hit = hit_t(n_iterations=hit%n_iterations, is_converged=.true.)
  end subroutine search_tool

  !> Closest point among all faces, however far: for setting up and for checks, not for each step.
  pure subroutine search_all_faces(tool, x, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)   !! point in the tool's frame [length]
    type(hit_t), intent(out) :: hit
    real(wp), parameter :: slack = 1.0_wp + 1.0e-12_wp   ! for round-off of bounds
    integer, allocatable :: near(:)
    real(wp), allocatable :: bounds(:)   ! cells may be too many for a stack
    real(wp) :: enough, lost
    integer :: leaf

    leaf = nearest_leaf(tool%tree, x)
    associate (cell => tool%cells(leaf))
      if (tool%is_trimmed) then
        enough = norm2(x - tool%anchors(:, leaf))
      else
        enough = norm2(x - face_position(tool%coefficients, cell%face, &
                                         0.5_wp*(cell%low + cell%high)))
      end if
    end associate
    call collect_leaves(tool%tree, x, slack*enough + round_off*tool%scale, near)
    allocate (bounds(size(near)))
    call search_cells(tool, x, 0.0_wp, .false., near, bounds, hit, lost)
    if (lost < hit%distance - same_point*tool%scale) call try_smooth_edges(tool, x, near, hit)
    if (hit%face /= 0) call finish(tool, x, hit)
  end subroutine search_all_faces

  !> Nearest of the local searches from some cells, in rising order of their bounds, until no other
  !! cell can matter.
  pure subroutine search_cells(tool, x, margin, is_corner_start, order, bounds, hit, lost)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    real(wp), intent(in) :: margin
    logical, intent(in) :: is_corner_start
    integer, intent(inout), contiguous :: order(:)     !! the cells; disordered at the end
    real(wp), intent(inout), contiguous :: bounds(:)   !! room for as many
    type(hit_t), intent(out) :: hit              !! not finished
    real(wp), intent(out) :: lost               !! least distance to where no hit came of a search,
                                                !! huge without a trim
    type(hit_t) :: leaving
    real(wp) :: at(2)
    integer :: i, n, n_left, n_iterations, face

    n_left = size(order)
    lost = huge(1.0_wp)
    do i = 1, n_left
      bounds(i) = distance_bound(tool%cells(order(i))%territory, x)
    end do
    n_iterations = 0
    do while (n_left > 0)
      i = minloc(bounds(:n_left), 1)
      if (bounds(i) > hit%distance + margin) exit
      associate (cell => tool%cells(order(i)))
        if (is_smooth_edge(tool, order(i))) then
          continue      ! not unless surfaces leave a gap
        else if (cell%edge > 0) then
          call try_edge(tool, x, cell%edge, margin, n_iterations, hit)
        else if (is_corner_start) then
          call try(tool, x, cell%face, cell%low, n_iterations, hit, leaving, lost)
        else if (cell%is_gentle) then
          call start_in(tool, cell, x, face, at)
          call try(tool, x, face, at, n_iterations, hit, leaving, lost, cell)
        else
          call try_net(tool, x, cell, n_iterations, hit, leaving, lost)
        end if
      end associate
      bounds(i) = bounds(n_left)
      order(i) = order(n_left)
      n = 0
      do i = 1, n_left - 1
        if (bounds(i) > hit%distance + margin) cycle
        n = n + 1
        bounds(n) = bounds(i)
        order(n) = order(i)
      end do
      n_left = n
    end do
    ! A search that was stopped at the edge of its cell came lower than all others: continue from
    ! there.
    lost = min(lost, leaving%distance)
    if (leaving%distance < hit%distance) &
      call try(tool, x, leaving%face, leaving%at, n_iterations, hit, leaving, lost)
    if (.not. tool%is_trimmed) lost = huge(1.0_wp)
    hit%n_iterations = n_iterations
  end subroutine search_cells

  !> Local search from a position, within a cell if one is given. Where it stops at the edge of the
  !! cell's faces with lower ground beyond there is no closest point on them, and the neighbour will
  !! be searched; the lowest such position is kept.
  pure subroutine try(tool, x, face, at, n_iterations, hit, leaving, lost, cell)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3), at(2)
    integer, intent(in) :: face
    integer, intent(inout) :: n_iterations
    type(hit_t), intent(inout) :: hit, leaving
    real(wp), intent(inout) :: lost             !! least distance to where no hit came of a search
    type(cell_t), intent(in), optional :: cell
    type(hit_t) :: trial

    trial%face = face
    trial%at = at
    call descend(tool, x, trial, cell)
    n_iterations = n_iterations + trial%n_iterations
    if (trial%is_leaving) then
      if (trial%distance < leaving%distance) leaving = trial
    else if (trial%is_converged) then
      if (is_on_tool(tool, trial%face, trial%at)) then
        call take_nearer(tool, trial, hit)
      else
        hit%is_converged = .true.    ! it has not failed: its surface ends before
        lost = min(lost, trial%distance)
      end if
    else
      lost = min(lost, trial%distance)
    end if
  end subroutine try

  !> Whether a cell is a piece of an edge across which the tool goes on smoothly. It is nearest only
  !! where the search of the surfaces on both sides ends beyond their trims.
  pure logical function is_smooth_edge(tool, cell)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: cell

    is_smooth_edge = tool%cells(cell)%edge > 0
    if (is_smooth_edge) is_smooth_edge = tool%edges(tool%cells(cell)%edge)%is_smooth
  end function is_smooth_edge

  !> Try the pieces of smooth edges among some cells that may be nearer than the hit.
  pure subroutine try_smooth_edges(tool, x, cells, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: cells(:)
    type(hit_t), intent(inout) :: hit
    integer :: i, n_iterations

    n_iterations = hit%n_iterations
    do i = 1, size(cells)
      if (.not. is_smooth_edge(tool, cells(i))) cycle
      if (distance_bound(tool%cells(cells(i))%territory, x) > hit%distance) cycle
      call try_edge(tool, x, tool%cells(cells(i))%edge, 0.0_wp, n_iterations, hit)
    end do
    hit%n_iterations = n_iterations
  end subroutine try_smooth_edges

  !> The nearest position on a piece of an edge, unless there are nearer ones around it.
  pure subroutine try_edge(tool, x, edge, margin, n_iterations, hit)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: edge
    real(wp), intent(in) :: margin              !! how much farther rivals matter [length]
    integer, intent(inout) :: n_iterations
    type(hit_t), intent(inout) :: hit
    type(hit_t) :: trial
    real(wp) :: along, point(3), tangent(3), second(3)

    call nearest_on_edge(tool%coefficients, tool%edges(edge), x, along, n_iterations)
    call evaluate_edge(tool%coefficients, tool%edges(edge), along, point, tangent, second, trial%at)
    trial%distance = norm2(x - point)
    if (trial%distance > hit%distance + margin) return
    if (is_lowest(tool, edge, along, x)) then
      trial%face = tool%edges(edge)%face
      trial%edge = edge
      trial%along = along
      trial%is_converged = .true.
      call take_nearer(tool, trial, hit)
    else if (hit%face == 0) then
      hit%is_converged = .true.
    end if
  end subroutine try_edge

  !> Local searches from all points of a net over a cell that are nearer than their neighbours; in a
  !! wild cell from all whose mesh may hold a nearer point than found so far.
  pure subroutine try_net(tool, x, cell, n_iterations, hit, leaving, lost)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(cell_t), intent(in) :: cell
    integer, intent(inout) :: n_iterations
    type(hit_t), intent(inout) :: hit, leaving
    real(wp), intent(inout) :: lost             !! least distance to where no hit came of a search
    real(wp) :: positions(3, n_net, n_net), squares(0:n_net + 1, 0:n_net + 1), reach
    logical :: is_tried(n_net, n_net)
    integer :: i, j

    squares = huge(1.0_wp)
    do j = 1, n_net
      do i = 1, n_net
        positions(:, i, j) = face_position(tool%coefficients, cell%face, net_position(cell, i, j))
        squares(i, j) = sum((x - positions(:, i, j))**2)
      end do
    end do
    do j = 1, n_net
      do i = 1, n_net
        ! Not against diagonal neighbours: these hide minima at the edge of a cell.
        is_tried(i, j) = squares(i, j) <= min(minval(squares(i - 1:i + 1, j)), &
                                              minval(squares(i, j - 1:j + 1)))
        if (is_tried(i, j)) call try(tool, x, cell%face, net_position(cell, i, j), n_iterations, &
                                     hit, leaving, lost, cell)
      end do
    end do
    if (.not. cell%is_wild) return
    reach = sqrt(maxval(sum((positions(:, 2:, :) - positions(:, :n_net - 1, :))**2, 1))) &
            + sqrt(maxval(sum((positions(:, :, 2:) - positions(:, :, :n_net - 1))**2, 1)))
    do j = 1, n_net
      do i = 1, n_net
        if (is_tried(i, j) .or. sqrt(squares(i, j)) > hit%distance + reach) cycle
        call try(tool, x, cell%face, net_position(cell, i, j), n_iterations, hit, leaving, lost, &
                 cell)
      end do
    end do
  end subroutine try_net

  !> Local coordinates of a point of the net, edges included.
  pure function net_position(cell, i, j) result(at)
    type(cell_t), intent(in) :: cell
    integer, intent(in) :: i, j
    real(wp) :: at(2)

    at = cell%low + real([i - 1, j - 1], wp)/(n_net - 1)*(cell%high - cell%low)
  end function net_position

  !> Keep the nearer of two, and the farther as its rival unless both are one point.
  pure subroutine take_nearer(tool, trial, hit)
    type(tool_t), intent(in) :: tool
    type(hit_t), intent(in) :: trial
    type(hit_t), intent(inout) :: hit
    real(wp) :: rival, between
    type(hit_t) :: other

    if (hit%face == 0) then
      hit = trial
      return
    end if
    rival = hit%rival
    other = trial
    if (trial%distance < hit%distance) then
      other = hit
      hit = trial
    end if
    between = norm2(face_position(tool%coefficients, other%face, other%at) &
                    - face_position(tool%coefficients, hit%face, hit%at))
    hit%rival = rival
    ! Both edges of a gap are one place.
    if (hit%edge > 0 .and. other%edge > 0) &
      between = between - seam_tolerance(tool%search_distance)
    if (between > same_point*tool%scale) hit%rival = min(rival, other%distance)
  end subroutine take_nearer

  !> Start below the point in a gentle cell; in a block on the face whose corners enclose that
  !! position along the axes of the cell.
  pure subroutine start_in(tool, cell, x, face, at)
    type(tool_t), intent(in) :: tool
    type(cell_t), intent(in) :: cell
    real(wp), intent(in) :: x(3)
    integer, intent(out) :: face
    real(wp), intent(out) :: at(2)
    integer :: step(2), d, first, last, middle
    real(wp) :: position, low, high, far(2), local(2)

    face = cell%face
    at = min(max(relative_position(cell%territory, x), 0.0_wp), 1.0_wp)
    at = cell%low + at*(cell%high - cell%low)
    if (cell%stride == 0) return
    step = [1, cell%stride]
    face = face + cell%n(2)/2*step(2)
    do d = 1, 2
      position = dot_product(x, cell%territory%axes(:, d))
      if (d == 2) face = face - cell%n(2)/2*step(2)
      first = 0
      last = cell%n(d) - 1
      do while (first < last)
        middle = (first + last + 1)/2
        if (corner(face + middle*step(d)) <= position) then
          first = middle
        else
          last = middle - 1
        end if
      end do
      face = face + first*step(d)
      low = corner(face)
      far = 0.0_wp
      far(d) = 1.0_wp
      high = dot_product(face_position(tool%coefficients, face, far), cell%territory%axes(:, d))
      local(d) = (position - low)/max(high - low, tiny(1.0_wp))
    end do
    at = min(max(local, 0.0_wp), 1.0_wp)

  contains

    !> First corner of a face along the axis.
    pure real(wp) function corner(of)
      integer, intent(in) :: of

      associate (c => tool%coefficients(:, 1, 1, of))
        corner = dot_product(c(:3), cell%territory%axes(:, d))/c(4)
      end associate
    end function corner

  end subroutine start_in

end module tool_search
