!> Smallest distance between the surfaces of a sheet and a tool, by branch and bound.
!!
!! Pairs of parts, one of the sheet and one of the tool, are halved, the pair with the lowest bound
!! first: the convex hulls of their control points bound their distance from below. Pairs that
!! cannot be nearer than a known distance are dropped, until the rest can be nearer by no more than
!! a tolerance. So no feature of either side is missed, however small. Local minima are made exact
!! by descents over the sheet.
module tool_clearance_search
  use kinds, only: wp
  use knot_vector, only: n_spans
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use tool, only: tool_t
  use tool_face, only: face_derivatives
  use closest_point, only: hit_t, follow
  use tool_search, only: search_all_faces
  use hull_hierarchy, only: hull_hierarchy_t, new_hull_hierarchy, clear, halve_node, rises_of, &
                            bound_gap, box_gap
  implicit none
  private

  public :: clearance_search_t, new_clearance_search, find_clearance, follow_clearance
  public :: pair_t, lowest_bound, add_pair, take_first

  real(wp), parameter :: first_step = 0.125_wp    !! of an element, after a first descent
  integer, parameter :: max_halvings = 50000      !! of pairs; the rest goes into `doubt`
  integer, parameter :: max_nodes = 100000        !! kept for the next search
  integer, parameter :: first_descent = 256       !! pairs halved before the first descent
  real(wp), parameter :: bent = 0.2_wp            !! sagitta over the tolerated error
  real(wp), parameter :: flat = 0.01_wp           !! rise over the tolerated error
  real(wp), parameter :: exact = 1.0e-9_wp        !! tolerance over the size of the scene

  !> Two nodes and a lower bound of their distance.
  type :: pair_t
    real(wp) :: bound = 0.0_wp                    !! [length]
    real(wp) :: across(3) = 0.0_wp                !! unit vector along which it holds
    integer :: nodes(2) = 0                       !! of the sheet and of the tool
  end type pair_t

  !> Sheet and tool, and what is known of their distance.
  type :: clearance_search_t
    type(hull_hierarchy_t) :: sheet, tool
    real(wp) :: scale = 0.0_wp                    !! size of the scene [length]
    real(wp) :: tolerance = 0.0_wp                !! within which a distance is known [length]
    real(wp) :: shift(3) = 0.0_wp                 !! of the tool [length]
    real(wp) :: target = 0.0_wp, fraction = 0.0_wp   !! from `find_clearance`
    real(wp) :: nearest = huge(1.0_wp)            !! so far [length]
    logical :: is_exact = .true.                  !! no corner has come nearer since a descent
    integer :: surface = 0                        !! of the sheet where it is, 0: none yet
    real(wp) :: at(2) = 0.0_wp                    !! xi and eta there
    real(wp) :: step(2) = 0.0_wp                  !! of xi and eta, first one of a descent there
    real(wp) :: across(3) = 0.0_wp                !! unit vector from the tool to the sheet there
    integer :: n_pairs = 0
    type(pair_t), allocatable :: pairs(:)         !! the first `n_pairs`: what may be nearer, a
                                                  !! binary heap with the lowest bound at its root
  end type clearance_search_t

contains

  !> Prepare the search.
  subroutine new_clearance_search(search, surfaces, tool, reach)
    type(clearance_search_t), intent(out) :: search
    type(nurbs_surface_t), intent(in) :: surfaces(:)   !! of the sheet
    type(tool_t), intent(in) :: tool
    real(wp), intent(in), optional :: reach            !! how far apart both will be [length]
    integer :: s

    call new_hull_hierarchy(search%sheet, surfaces)
    call new_hull_hierarchy(search%tool, tool%surfaces)
    associate (nodes => search%sheet%nodes(:search%sheet%n))
      search%scale = tool%scale + maxval([(maxval(abs(nodes(s)%box)), s=1, size(nodes))])
    end associate
    if (present(reach)) search%scale = search%scale + reach
    search%tolerance = exact*search%scale
  end subroutine new_clearance_search

  !> Smallest distance between the sheet and the tool moved by `shift`: it is at most `nearest`, and
  !! less than that by no more than `doubt`. This is the tolerance, or `fraction` of how far the
  !! distance is from `target`; it is more only where surfaces are parallel over so wide an area
  !! that the search would take too long.
  subroutine find_clearance(search, tool, shift, target, fraction, nearest, doubt)
    type(clearance_search_t), intent(inout) :: search
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: shift(3), target      !! [length]
    real(wp), intent(in) :: fraction              !! from 0 to 1
    real(wp), intent(out) :: nearest, doubt       !! [length]
    type(pair_t) :: pair
    integer :: n_halvings, next_descent, s, t
    logical :: is_done

    call begin_search(search, tool, shift)
    search%target = target
    search%fraction = fraction
    if (.not. allocated(search%pairs)) allocate (search%pairs(64))
    search%n_pairs = 0
    do s = 1, size(search%sheet%surfaces)
      do t = 1, size(search%tool%surfaces)
        call add_if_near(search, pair_t(nodes=[s, t]))
      end do
    end do
    n_halvings = 0
    next_descent = first_descent
    do
      is_done = lowest_bound(search) >= enough_of(search) .or. n_halvings == max_halvings
      if (.not. search%is_exact .and. (is_done .or. n_halvings >= next_descent)) then
        call descend(search, tool)
        next_descent = 2*n_halvings
        cycle
      end if
      if (is_done) exit
      call take_first(search, pair)
      call halve_pair(search, tool, pair)
      n_halvings = n_halvings + 1
    end do
    nearest = search%nearest
    doubt = nearest - min(enough_of(search), lowest_bound(search))
  end subroutine find_clearance

  !> Distance of the tool moved by `shift` around the position of the sheet where it was least
  !! before.
  subroutine follow_clearance(search, tool, shift, nearest)
    type(clearance_search_t), intent(inout) :: search
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: shift(3)
    real(wp), intent(out) :: nearest              !! [length]

    call begin_search(search, tool, shift)
    call descend(search, tool)
    nearest = search%nearest
  end subroutine follow_clearance

  !> Nothing is known but how near the last position still is.
  subroutine begin_search(search, tool, shift)
    type(clearance_search_t), intent(inout) :: search
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: shift(3)
    type(hit_t) :: hit
    real(wp) :: x(3)

    search%shift = shift
    if (search%sheet%n + search%tool%n > max_nodes) then
      call clear(search%sheet)
      call clear(search%tool)
    end if
    search%nearest = huge(1.0_wp)
    search%is_exact = .false.
    if (search%surface == 0) then
      ! The corners of a trimmed tool may all lie beyond its trims.
      if (tool%is_trimmed) call try_middle(search, tool, 1)
      return
    end if
    call evaluate_surface(search%sheet%surfaces(search%surface), search%at, x)
    call search_all_faces(tool, x - shift, hit)
    search%nearest = hit%distance
  end subroutine begin_search

  !> Take the middle of a node of the sheet if the tool is nearer to it than what is known.
  subroutine try_middle(search, tool, node)
    type(clearance_search_t), intent(inout) :: search
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: node
    type(hit_t) :: hit
    real(wp) :: x(3), at(2)

    associate (a => search%sheet%nodes(node))
      at = 0.5_wp*(a%from + a%to)
      call evaluate_surface(search%sheet%surfaces(a%surface), at, x)
      call search_all_faces(tool, x - search%shift, hit)
      if (hit%distance >= search%nearest) return
      search%nearest = hit%distance
      search%is_exact = .false.
      search%surface = a%surface
      search%at = at
      search%step = 0.5_wp*(a%to - a%from)
      if (hit%distance > search%tolerance) search%across = sign(1.0_wp, hit%gap)*hit%normal
    end associate
  end subroutine try_middle

  !> Pairs no nearer than this do not matter.
  pure real(wp) function enough_of(search) result(enough)
    type(clearance_search_t), intent(in) :: search

    enough = search%nearest - max(search%tolerance, &
                                  search%fraction*(search%nearest - search%target))
  end function enough_of

  !> Both halves of a pair: of the side and the direction that bends most, else that rises most
  !! along the vector of the bound.
  subroutine halve_pair(search, tool, pair)
    type(clearance_search_t), intent(inout) :: search
    type(tool_t), intent(in) :: tool
    type(pair_t), intent(in) :: pair
    type(pair_t) :: half
    real(wp) :: gains(2, 2), slack     ! gains by direction, of the sheet and of the tool
    integer :: side, halves(2), best(2)

    slack = search%nearest - enough_of(search)
    associate (a => search%sheet%nodes(pair%nodes(1)), b => search%tool%nodes(pair%nodes(2)))
      ! So small that its corners, which are no nearer than what is known, are enough.
      if (2*(sum(a%size) + sum(b%size)) <= slack) then
        if (.not. all(b%has_corner)) call try_middle(search, tool, pair%nodes(1))
        return
      end if
      ! Hulls of bent parts overlap, which hides where the parts are apart.
      gains = reshape([a%bend, b%bend], [2, 2])
      if (maxval(gains) <= bent*slack) &
        gains = reshape([rises_of(a, pair%across), rises_of(b, pair%across)], [2, 2])
      if (maxval(gains) <= flat*slack) gains = reshape([a%size, b%size], [2, 2])
    end associate
    best = maxloc(gains)
    if (best(2) == 1) call halve_node(search%sheet, pair%nodes(1), best(1), halves)
    if (best(2) == 2) call halve_node(search%tool, pair%nodes(2), best(1), halves)
    do side = 1, 2
      half = pair
      half%nodes(best(2)) = halves(side)
      call add_if_near(search, half)
    end do
  end subroutine halve_pair

  !> Check the corners of a pair, and keep it unless it is too far.
  subroutine add_if_near(search, pair)
    type(clearance_search_t), intent(inout) :: search
    type(pair_t), intent(in) :: pair
    real(wp) :: bound, across(3), enough

    if (search%tool%nodes(pair%nodes(2))%is_outside) return
    call check_corners(search, pair)
    enough = enough_of(search)
    associate (a => search%sheet%nodes(pair%nodes(1)), b => search%tool%nodes(pair%nodes(2)))
      bound = max(pair%bound, box_gap(a%box, b%box, search%shift))
      if (bound >= enough) return
      call bound_gap(a%points, b%points, search%shift, &
                     reshape([search%across, a%normal, b%normal], [3, 3]), enough, bound, across)
      bound = max(bound, pair%bound, box_gap(a%box, b%box, search%shift))
    end associate
    if (bound >= enough) return
    call add_pair(search, pair_t(bound, across, pair%nodes))
  end subroutine add_if_near

  !> Lowest bound of all pairs; huge if there is none.
  pure real(wp) function lowest_bound(search)
    type(clearance_search_t), intent(in) :: search

    lowest_bound = minval(search%pairs(:min(search%n_pairs, 1))%bound)
  end function lowest_bound

  !> Add a pair to the heap.
  pure subroutine add_pair(search, pair)
    type(clearance_search_t), intent(inout) :: search
    type(pair_t), intent(in) :: pair
    integer :: i

    associate (n => search%n_pairs)
      if (n == size(search%pairs)) search%pairs = [search%pairs, search%pairs]
      n = n + 1
      i = n
    end associate
    do while (i > 1)
      if (search%pairs(i/2)%bound <= pair%bound) exit
      search%pairs(i) = search%pairs(i/2)
      i = i/2
    end do
    search%pairs(i) = pair
  end subroutine add_pair

  !> Take the pair with the lowest bound out of the heap.
  pure subroutine take_first(search, pair)
    type(clearance_search_t), intent(inout) :: search
    type(pair_t), intent(out) :: pair
    integer :: i, child, n

    n = search%n_pairs
    search%n_pairs = n - 1
    i = 1
    associate (pairs => search%pairs)
      pair = pairs(1)
      do while (2*i < n)
        child = 2*i
        if (pairs(child + 1)%bound < pairs(child)%bound) child = child + 1
        if (pairs(n)%bound <= pairs(child)%bound) exit
        pairs(i) = pairs(child)
        i = child
      end do
      pairs(i) = pairs(n)
    end associate
  end subroutine take_first

  !> Keep the nearest corners of a pair if they are nearer than what is known.
  subroutine check_corners(search, pair)
    type(clearance_search_t), intent(inout) :: search
    type(pair_t), intent(in) :: pair
    real(wp) :: apart(3)
    integer :: i, j

    associate (a => search%sheet%nodes(pair%nodes(1)), b => search%tool%nodes(pair%nodes(2)))
      do j = 1, 4
        if (.not. b%has_corner(j)) cycle
        do i = 1, 4
          apart = a%corners(:, i) - b%corners(:, j) - search%shift
          if (norm2(apart) >= search%nearest) cycle
          search%nearest = norm2(apart)
          search%is_exact = .false.
          search%surface = a%surface
          search%at = merge(a%to, a%from, [btest(i - 1, 0), btest(i - 1, 1)])
          search%step = 0.5_wp*(a%to - a%from)
          if (search%nearest > search%tolerance) search%across = apart/search%nearest
        end do
      end do
    end associate
  end subroutine check_corners

  !> Descend to the position that is nearest around the one known. The nearest point of the tool is
  !! followed; should there be a nearer one in the end, the descent continues with that.
  subroutine descend(search, tool)
    type(clearance_search_t), intent(inout) :: search
    type(tool_t), intent(in) :: tool
    integer, parameter :: most = 5
    real(wp) :: found, x(3)
    type(hit_t) :: hit, nearest
    integer :: d, i

    search%is_exact = .true.
    associate (surface => search%sheet%surfaces(search%surface), &
               whole => search%sheet%nodes(search%surface))
      call evaluate_surface(surface, search%at, x)
      call search_all_faces(tool, x - search%shift, nearest)
      do i = 1, most
        hit = nearest
        call go_down(tool, surface, whole%from, whole%to, search%shift, search%step, hit, &
                     search%at, found)
        call evaluate_surface(surface, search%at, x)
        search%step = first_step*(whole%to - whole%from)/[(n_spans(surface%axes(d)), d=1, 2)]
        call search_all_faces(tool, x - search%shift, nearest)
        if (nearest%distance >= found - exact*search%tolerance) exit
      end do
    end associate
    search%nearest = min(search%nearest, found, nearest%distance)
    if (nearest%distance > search%tolerance) call set_across(search, tool, nearest)
  end subroutine descend

  !> Vector from the tool to the sheet at the nearest position. The difference of its ends loses
  !! digits as it gets short, so it is made normal to the tangents along which a side continues.
  subroutine set_across(search, tool, hit)
    type(clearance_search_t), intent(inout) :: search
    type(tool_t), intent(in) :: tool
    type(hit_t), intent(in) :: hit
    real(wp), parameter :: border = 1.0e-6_wp, independent = 0.1_wp
    real(wp) :: x(3), y(3), across(3), tangents(3, 2, 2), second(3, 3), unit(3, 2)
    logical :: is_free(2, 2)
    integer :: d, side, n

    call evaluate_surface(search%sheet%surfaces(search%surface), search%at, x, tangents(:, :, 1))
    associate (low => search%sheet%nodes(search%surface)%from, &
               high => search%sheet%nodes(search%surface)%to)
      is_free(:, 1) = abs(2*search%at - low - high) < (1.0_wp - border)*(high - low)
    end associate
    call face_derivatives(tool%coefficients, hit%face, hit%at, y, tangents(:, :, 2), second)
    is_free(:, 2) = abs(2*hit%at - 1.0_wp) < 1.0_wp - border
    x = x - search%shift - y
    across = x/norm2(x)
    n = 0
    do side = 1, 2
      do d = 1, 2
        if (.not. is_free(d, side) .or. n == 2) cycle
        y = tangents(:, d, side) - matmul(unit(:, :n), matmul(tangents(:, d, side), unit(:, :n)))
        if (norm2(y) <= independent*norm2(tangents(:, d, side))) cycle
        n = n + 1
        unit(:, n) = y/norm2(y)
        across = across - dot_product(across, unit(:, n))*unit(:, n)
      end do
    end do
    if (norm2(across) > 0.5_wp) search%across = across/norm2(across)
  end subroutine set_across

  !> Steps over a face to the least distance to the tool that they come to: eight directions, then
  !! the bottom of the paraboloid through these points, then shorter steps.
  subroutine go_down(tool, face, low, high, shift, first, hit, at, least)
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: face
    real(wp), intent(in) :: low(2), high(2)  !! ranges of xi and eta
    real(wp), intent(in) :: shift(3)
    real(wp), intent(in) :: first(2)         !! steps of xi and eta to begin with
    type(hit_t), intent(inout) :: hit        !! point of the tool that is followed
    real(wp), intent(inout) :: at(2)         !! where to start, then where it ended
    real(wp), intent(out) :: least           !! [length]
    real(wp), parameter :: shorter = 0.2_wp, longer = 2.0_wp
    real(wp), parameter :: part = 1.0e-9_wp  ! of an element, the last step
    real(wp) :: last(2), step(2), around(-1:1, -1:1), slope(2), bend(2), twist
    real(wp) :: trial(2), found
    integer :: i, j, d, best(2)

    last = part*(high - low)/[(n_spans(face%axes(d)), d=1, 2)]
    step = first
    around(0, 0) = distance_from(at)
    do while (any(step > last))
      do j = -1, 1
        do i = -1, 1
          if (i /= 0 .or. j /= 0) around(i, j) = distance_from(at + step*[i, j])
        end do
      end do
      best = minloc(around) - 2
      if (around(best(1), best(2)) < around(0, 0)) then
        at = min(max(at + step*best, low), high)
        around(0, 0) = around(best(1), best(2))
        step = longer*step
        cycle
      end if
      slope = 0.5_wp*[around(1, 0) - around(-1, 0), around(0, 1) - around(0, -1)]
      bend = [around(1, 0) + around(-1, 0), around(0, 1) + around(0, -1)] - 2*around(0, 0)
      twist = 0.25_wp*(around(1, 1) + around(-1, -1) - around(1, -1) - around(-1, 1))
      trial = [twist*slope(2) - bend(2)*slope(1), twist*slope(1) - bend(1)*slope(2)] &
              /max(product(bend) - twist**2, tiny(1.0_wp))
      trial = min(max(at + step*min(max(trial, -1.0_wp), 1.0_wp), low), high)
      found = distance_from(trial)
      if (found < around(0, 0)) then
        at = trial
        around(0, 0) = found
      end if
      step = shorter*step
    end do
    least = around(0, 0)

  contains

    real(wp) function distance_from(xi)
      real(wp), intent(in) :: xi(2)
      type(hit_t) :: next
      real(wp) :: x(3)

      call evaluate_surface(face, min(max(xi, low), high), x)
      call follow(tool, x - shift, hit%face, hit%at, next)
      if (.not. next%is_converged) call search_all_faces(tool, x - shift, next)
      hit = next
      distance_from = next%distance
    end function distance_from

  end subroutine go_down

end module tool_clearance_search
