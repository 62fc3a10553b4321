!> Penetration of a face of the blank into a tool, between its contact points too.
!!
!! The face is sampled on a grid that is finer than its contact points and at least as fine as the
!! tool's smallest radius. Cells of the grid across which the tool bends towards the sheet are
!! sampled four times finer, and from the deepest samples a search climbs to the deepest point. The
!! tool is its exact surface.
!!
!! As in `contact`, distances to a tool change by no more than the points move. So a tile of samples
!! that are all clear of the tool is skipped until its travel has grown by that distance, less what
!! may lie between two samples.
module face_penetration
  use kinds, only: wp
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use knot_vector, only: n_spans, find_span
  use surface_grid, only: lines, parts_along
  use secondary_surface, only: secondary_surface_t, new_sample_surface, secondary_positions, &
                               row_positions, point_position, secondary_line_t
  use contact, only: contact_t
  use outline, only: region_t, is_inside, places_inside
  use tool, only: tool_t
  use tool_bends, only: bend_t, tool_bends_below, sharpest_radius
  use closest_point, only: hit_t, follow, lanes_t, n_lanes, is_beside, follow_lanes
  use tool_search, only: search_tool, search_all_faces
  use cell_hierarchy, only: distance_to_leaves
  implicit none
  private

  public :: deep_point_t, depth_samples_t, new_depth_samples, trim_samples, find_deepest, &
            element_sizes, &
            points_of_element

  real(wp), parameter :: bent = 0.9_wp           !! cosine between normals at the ends of a cell

  !> Depth of a point far from the tool or beyond its edge [length].
  real(wp), parameter :: no_depth = -huge(1.0_wp)

  !> The deepest point of a face.
  type :: deep_point_t
    real(wp) :: depth = 0.0_wp         !! 0: no position of the face is in the tool [length]
    real(wp) :: at(2) = 0.0_wp         !! parametric coordinates of the face
    real(wp) :: x(3) = 0.0_wp          !! where it is [length]
    real(wp) :: step(2) = 0.0_wp       !! parametric distance to the next samples
    real(wp) :: width = 0.0_wp         !! the same, amply [length]
    integer :: face = 0                !! of the tool where it is nearest
    real(wp) :: on(2) = 0.0_wp         !! local coordinates there
    logical :: is_sure = .false.       !! of all points of the tool none is nearer
    logical :: is_smooth = .false.     !! the tool around it
  end type deep_point_t

  !> What a sample has found.
  type :: sample_t
    real(wp) :: x(3) = 0.0_wp          !! in the tool's frame [length]
    real(wp) :: depth = no_depth        !! below 0: so far outside [length]
    real(wp) :: clear = 0.0_wp         !! how far it may move before it can be in the tool
    real(wp) :: normal(3) = 0.0_wp, foot(3) = 0.0_wp   !! of the tool where it is nearest
    integer :: face = 0                !! there, and local coordinates
    real(wp) :: on(2) = 0.0_wp
    logical :: is_seen = .false., is_beside = .false.
    logical :: is_sure = .false.       !! of all points of the tool none is nearer
  end type sample_t

  integer, parameter :: least_parts = 3          !! of an element, in each direction
  real(wp), parameter :: uneven = 1.2_wp         !! Gauss points apart, over their mean distance
  integer, parameter :: most_samples = 20000     !! that a small radius may ask for
  integer, parameter :: n_parts = 4              !! of a cell across which the tool bends
  real(wp), parameter :: reach = 0.2_wp          !! part of that distance from which a climb starts
  real(wp), parameter :: flat = 0.02_wp          !! part by which a sheet on a flat tool may wave
  integer, parameter :: n_halvings = 4           !! of the step of a climb
  real(wp), parameter :: shallow = 1.0e-4_wp     !! part of the search distance, not worth a climb

  !> Samples of a face, in tiles that are those of its contact points.
  type :: depth_samples_t
    type(nurbs_surface_t) :: surface   !! the face now
    type(secondary_surface_t) :: grid
    integer, allocatable :: first(:, :), last(:, :)   !! samples of each tile, shape (2, n_tiles)
    real(wp) :: radius = 0.0_wp        !! smallest with which the tool bends to the sheet [length]
    integer, allocatable :: near_1(:), near_2(:)      !! contact points near the lines of samples
    type(bend_t), allocatable :: bends(:)  !! of the tool, sharper than contact points are apart
    real(wp) :: apart = 0.0_wp             !! how far around these samples are searched [length]
    real(wp), allocatable :: wake_at(:)   !! travel of the tile at which it is checked again
                                          !! [length], shape (n_tiles)
    real(wp), allocatable :: wake(:)      !! the same of each sample, tile by tile
    integer, allocatable :: before(:)     !! samples before those of a tile, shape (n_tiles)
    type(region_t), allocatable :: regions(:)   !! that an outline leaves; absent: all counts
    integer :: n_checked = 0                !! samples that the last search has checked
    real(wp) :: shift(3) = 0.0_wp           !! displacement of the tool at the last search [length]
    real(wp) :: overhang = 0.0_wp           !! how far beyond its edge a point touches [length]
  end type depth_samples_t

contains

  !> Follow up to eight samples; those that do not settle are searched.
  pure subroutine follow_samples(tool, overhang, low, high, at, n, lanes, found)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: overhang         !! how far beyond the tool's edge a point touches
    integer, intent(in) :: low(2), high(2), at(2, n_lanes)
    integer, intent(inout) :: n                  !! how many; then 0
    type(lanes_t), intent(inout) :: lanes
    type(sample_t), intent(inout) :: found(low(1):high(1), low(2):high(2))
    type(hit_t) :: hit
    real(wp) :: start(2, n_lanes)
    integer :: k, face(n_lanes)

    face = lanes%face
    start(1, :) = lanes%s
    start(2, :) = lanes%t
    do k = n + 1, n_lanes
      lanes%face(k) = lanes%face(n)
      lanes%x(k, :) = lanes%x(n, :)
      lanes%s(k) = lanes%s(n)
      lanes%t(k) = lanes%t(n)
    end do
    lanes%room = 0.0_wp
    call follow_lanes(tool, lanes)
    do k = 1, n
      associate (sample => found(at(1, k), at(2, k)))
        if (.not. lanes%is_good(k)) then
          call follow(tool, sample%x, face(k), start(:, k), hit)
          if (hit%is_converged) then
            call record_hit(tool, overhang, hit, sample)
          else
            call locate(tool, overhang, sample)
          end if
          cycle
        end if
        sample%is_seen = .true.
        sample%normal = lanes%normal(k, :)
        sample%foot = sample%x - lanes%gap(k)*sample%normal
        sample%depth = -lanes%gap(k)
        sample%face = face(k)
        sample%on = [lanes%s(k), lanes%t(k)]
        sample%clear = max(lanes%gap(k), 0.0_wp)
      end associate
    end do
    n = 0
  end subroutine follow_samples

  !> Search the whole tool for what is nearest to a position.
  pure subroutine verify(samples, tool, candidate)
    type(depth_samples_t), intent(in) :: samples
    type(tool_t), intent(in) :: tool
    type(deep_point_t), intent(inout) :: candidate
    type(sample_t) :: sample

    sample%x = candidate%x - samples%shift
    call locate(tool, samples%overhang, sample)
    candidate%depth = sample%depth
    candidate%face = sample%face
    candidate%on = sample%on
    candidate%is_sure = .true.
  end subroutine verify

  !> How a point lies to the tool.
  pure subroutine locate(tool, overhang, sample)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: overhang
    type(sample_t), intent(inout) :: sample
    type(hit_t) :: hit

    sample%depth = no_depth
    sample%clear = 0.0_wp
    sample%is_seen = .false.
    sample%is_sure = .true.
    associate (x => sample%x)
      call search_tool(tool, x, 0.0_wp, .false., hit)
      if (hit%face == 0) then
        if (.not. all(x >= tool%box(:, 1) .and. x <= tool%box(:, 2))) then
          if (hit%is_converged) sample%clear = max(distance_to_leaves(tool%tree, x), &
                                                   tool%search_distance)
          return
        end if
        call search_all_faces(tool, x, hit)
        if (hit%face == 0) return
      end if
    end associate
    call record_hit(tool, overhang, hit, sample)
  end subroutine locate

  !> Keep what a search has found.
  pure subroutine record_hit(tool, overhang, hit, sample)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: overhang
    type(hit_t), intent(in) :: hit
    type(sample_t), intent(inout) :: sample

    sample%is_seen = .true.
    sample%is_beside = is_beside(tool, hit, overhang)
    sample%face = hit%face
    sample%on = hit%at
    sample%normal = hit%normal
    sample%foot = sample%x - hit%gap*hit%normal
    if (hit%gap >= 0.0_wp) then
      sample%clear = hit%distance
    else if (sample%is_beside) then
      sample%clear = hit%overhang - overhang
    end if
    sample%depth = merge(no_depth, -hit%gap, sample%is_beside)
  end subroutine record_hit

  !> Keep the deeper of two points.
  pure subroutine keep_deeper(sample, at, shift, step, best)
    type(sample_t), intent(in) :: sample
    real(wp), intent(in) :: at(2), shift(3), step(2)
    type(deep_point_t), intent(inout) :: best

    if (.not. sample%depth > best%depth) return
    best%depth = sample%depth
    best%at = at
    best%x = sample%x + shift
    best%step = step
    best%face = sample%face
    best%on = sample%on
    best%is_sure = sample%is_sure
  end subroutine keep_deeper

  !> The same between samples, where an outline may cut the place away.
  pure subroutine keep_deeper_inside(samples, sample, at, step, best)
    type(depth_samples_t), intent(in) :: samples
    type(sample_t), intent(in) :: sample
    real(wp), intent(in) :: at(2), step(2)
    type(deep_point_t), intent(inout) :: best

    if (.not. sample%depth > best%depth) return
    if (allocated(samples%regions)) then
      if (.not. is_inside(samples%regions, at)) return
    end if
    call keep_deeper(sample, at, samples%shift, step, best)
  end subroutine keep_deeper_inside

  !> Length of the diagonals of a cell.
  pure real(wp) function width_of(corners) result(width)
    type(sample_t), intent(in) :: corners(2, 2)

    width = max(norm2(corners(1, 1)%x - corners(2, 2)%x), norm2(corners(1, 2)%x - corners(2, 1)%x))
  end function width_of

  !> May a cell hold a position deeper than `known`, which no climb from its corners finds? Where
  !! the tool ends in it, and where between two corners it turns by an angle a towards the sheet at
  !! once: then it rises by less than a/2 of their distance.
  pure logical function hides_depth(corners, is_smooth, known) result(is_hidden)
    type(sample_t), intent(in) :: corners(2, 2)
    logical, intent(in) :: is_smooth        !! the tool around it
    real(wp), intent(in) :: known           !! [length]
    integer, parameter :: ends(4, 6) = reshape([1, 1, 2, 1, 1, 2, 2, 2, 1, 1, 1, 2, &
                                                2, 1, 2, 2, 1, 1, 2, 2, 2, 1, 1, 2], [4, 6])
    real(wp) :: deepest, cosine
    integer :: k

    is_hidden = any(corners%is_beside) .and. minval(corners%clear) < 0.5_wp*width_of(corners)
    deepest = maxval(corners%depth)
    if (is_smooth .or. .not. deepest > no_depth) return
    do k = 1, 6
      if (is_hidden) return
      associate (a => corners(ends(1, k), ends(2, k)), b => corners(ends(3, k), ends(4, k)))
        if (.not. (a%is_seen .and. b%is_seen)) cycle
        cosine = sum(a%normal*b%normal)
        if (cosine > bent .or. sum((a%normal - b%normal)*(a%foot - b%foot)) <= 0.0_wp) cycle
        is_hidden = deepest + 0.5_wp*acos(max(cosine, -1.0_wp))*norm2(a%x - b%x) > known
      end associate
    end do
  end function hides_depth

  !> Choose the samples of the face of a contact.
  subroutine new_depth_samples(samples, contact, tool, surface, thickness, across)
    type(depth_samples_t), intent(out) :: samples
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: surface      !! the face at the start
    real(wp), intent(in) :: thickness                 !! of the sheet [length]
    integer, intent(in) :: across                     !! direction along which a strip does not
                                                      !! change, 0: none
    real(wp), allocatable :: x(:, :, :)
    real(wp) :: apart(2)
    integer :: parts(2), most, d, n(2)

    n = [(n_spans(surface%axes(d)), d=1, 2)]
    samples%radius = sharpest_radius(tool)
    parts = max(contact%secondary%n_along/n + 1, least_parts)
    most = int(sqrt(real(most_samples, wp)/product(n)))
    parts = max(parts, min(parts_along(surface, max(samples%radius, thickness)), most))
    if (across > 0) parts(across) = 1
    samples%surface = surface
    call new_sample_surface(samples%grid, surface, lines(surface%axes(1), parts(1)), &
                            lines(surface%axes(2), parts(2)))
    allocate (x(samples%grid%n_along(1), samples%grid%n_along(2), 3))
    call secondary_positions(samples%grid, surface%points, x)
    apart = [maxval(norm2(x(2:, :, :) - x(:size(x, 1) - 1, :, :), 3)), &
             maxval(norm2(x(:, 2:, :) - x(:, :size(x, 2) - 1, :), 3))]
    apart = uneven*apart*parts*n/contact%secondary%n_along
    if (across > 0) apart(across) = 0.0_wp
    call tool_bends_below(tool, maxval(apart), samples%bends)
    samples%apart = maxval(apart) + tool%search_distance
    samples%overhang = contact%options%overhang
    associate (tiles => contact%tiles)
      allocate (samples%first(2, size(tiles)), samples%last(2, size(tiles)))
      allocate (samples%wake_at(size(tiles)), source=0.0_wp)
      call assign_samples(contact%secondary%lines(1), samples%grid%lines(1), tiles%first(1), &
                     tiles%last(1), samples%near_1, samples%first(1, :), samples%last(1, :))
      call assign_samples(contact%secondary%lines(2), samples%grid%lines(2), tiles%first(2), &
                     tiles%last(2), samples%near_2, samples%first(2, :), samples%last(2, :))
      samples%before = [(sum(product(samples%last(:, :d - 1) - samples%first(:, :d - 1) + 1, 1)), &
                         d=1, size(tiles))]
      allocate (samples%wake(sum(product(samples%last - samples%first + 1, 1))), source=0.0_wp)
    end associate
  end subroutine new_depth_samples

  !> Leave out the places that an outline leaves outside, and samples of contact points without
  !! area.
  pure subroutine trim_samples(samples, contact, lines1, lines2, share, regions)
    type(depth_samples_t), intent(inout) :: samples
    type(contact_t), intent(in) :: contact
    real(wp), intent(in) :: lines1(:), lines2(:)      !! ends of the elements
    real(wp), intent(in) :: share(:, :)               !! of the elements that is inside
    type(region_t), intent(in) :: regions(:)          !! in the parameters of the face
    logical :: is_in(samples%grid%n_along(1), samples%grid%n_along(2))
    integer :: t, i, j, k, point

    samples%regions = regions
    is_in = places_inside(regions, lines1, lines2, share, samples%grid%lines(1)%xi, &
                          samples%grid%lines(2)%xi, 0.0_wp)
    k = 0
    do t = 1, size(contact%tiles)
      do j = samples%first(2, t), samples%last(2, t)
        do i = samples%first(1, t), samples%last(1, t)
          k = index_of(samples, t, i, j)
          point = samples%near_1(i) + contact%secondary%n_along(1)*(samples%near_2(j) - 1)
          if (.not. (is_in(i, j) .and. contact%secondary%area(point) > 0.0_wp)) &
            samples%wake(k) = huge(1.0_wp)
        end do
      end do
      samples%wake_at(t) = minval(samples%wake(samples%before(t) + 1:k))
    end do
  end subroutine trim_samples

  !> Give each sample to the contact point that is nearest to it in its element, and to the tile of
  !! this, whose travel so bounds its motion. A tile ends with the first sample of the next one.
  pure subroutine assign_samples(points, line, first_point, last_point, near, first, last)
    type(secondary_line_t), intent(in) :: points, line
    integer, intent(in) :: first_point(:), last_point(:)   !! contact points of the tiles
    integer, allocatable, intent(out) :: near(:)           !! contact points of the samples
    integer, intent(out) :: first(:), last(:)              !! samples of the tiles
    integer :: i

    allocate (near(line%n_points))
    first = line%n_points + 1
    last = 0
    do i = 1, line%n_points
      if (any(points%first == line%first(i))) then
        near(i) = minloc(abs(points%xi - line%xi(i)), 1, points%first == line%first(i))
      else
        near(i) = minloc(abs(points%xi - line%xi(i)), 1)
      end if
      where (first_point <= near(i) .and. near(i) <= last_point)
        first = min(first, i)
        last = min(i + 1, line%n_points)
      end where
    end do
  end subroutine assign_samples

  !> Find the deepest point of the face of a contact in its tool. Bitwise identical for any number
  !! of threads.
  subroutine find_deepest(samples, contact, tool, net, shift, deepest)
    type(depth_samples_t), intent(inout) :: samples
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: net(:, :, :)         !! control points of the face now, (n1, n2, 3)
    real(wp), intent(in) :: shift(3)             !! displacement of the tool [length]
    type(deep_point_t), intent(out) :: deepest
    type(deep_point_t) :: best(size(contact%tiles)), candidate
    logical :: is_awake(size(contact%tiles))
    integer :: t, n_checked

    samples%n_checked = 0
    is_awake = contact%tiles%travel >= samples%wake_at
    if (.not. any(is_awake)) return
    samples%surface%points = net
    samples%shift = shift
    best%depth = no_depth
    n_checked = 0
    !$omp parallel do schedule(dynamic) reduction(+: n_checked)
    do t = 1, size(best)
      if (is_awake(t)) call sample_tile(samples, contact, tool, t, .false., best(t), n_checked)
    end do
    !$omp end parallel do
    samples%n_checked = n_checked
    do
      t = maxloc(best%depth, 1)
      if (.not. best(t)%depth > -reach*best(t)%width) return
      if (best(t)%is_sure) exit
      candidate = best(t)
      call verify(samples, tool, best(t))
      if (.not. best(t)%depth < candidate%depth) cycle
      ! Another point of the tool is nearer: the tile may hold a sample that is deeper than this.
      best(t)%depth = no_depth
      call sample_tile(samples, contact, tool, t, .true., best(t), n_checked)
    end do
    samples%n_checked = n_checked
    candidate = best(t)
    call climb(samples, tool, candidate)
    call verify(samples, tool, candidate)
    if (best(t)%depth > candidate%depth) candidate = best(t)
    if (candidate%depth > 0.0_wp) deepest = candidate
  end subroutine find_deepest

  !> Lengths of the element at a position of the face along its two directions, as measured last.
  pure function element_sizes(samples, at) result(sizes)
    type(depth_samples_t), intent(in) :: samples
    real(wp), intent(in) :: at(2)          !! parametric coordinates
    real(wp) :: sizes(2)                   !! [length]
    real(wp) :: point(3), d1(3, 2)
    integer :: d, span

    call evaluate_surface(samples%surface, at, point, d1)
    do d = 1, 2
      associate (axis => samples%surface%axes(d))
        span = find_span(axis, at(d))
        sizes(d) = norm2(d1(:, d))*(axis%knots(span + 1) - axis%knots(span))
      end associate
    end do
  end function element_sizes

  !> Contact points of an element along both directions, on average.
  pure function points_of_element(samples, points) result(n)
    type(depth_samples_t), intent(in) :: samples
    type(secondary_surface_t), intent(in) :: points
    integer :: n(2)
    integer :: d

    n = max(1, nint([(real(points%n_along(d), wp)/n_spans(samples%surface%axes(d)), d=1, 2)]))
  end function points_of_element

  !> Deepest sample of a tile, and when it must be checked again.
  subroutine sample_tile(samples, contact, tool, tile, is_exact, best, n_checked)
    type(depth_samples_t), intent(inout) :: samples
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: tile
    logical, intent(in) :: is_exact              !! search the whole tool for each sample
    type(deep_point_t), intent(inout) :: best    !! of no depth yet
    integer, intent(inout) :: n_checked            !! grows by the samples that are not skipped
    type(sample_t), allocatable :: found(:, :)
    real(wp) :: width, now
    logical :: is_smooth
    integer :: i, j, k, low(2), high(2), at(2)

    low = samples%first(:, tile)
    high = samples%last(:, tile)
    now = contact%tiles(tile)%travel
    allocate (found(low(1):high(1), low(2):high(2)))
    call locate_samples(samples, low, high, found, width)
    is_smooth = .not. has_bend(samples, found)
    call sample_grid(samples, contact, tool, tile, is_smooth .and. .not. is_exact, low, high, found)
    associate (xi => samples%grid%lines(1)%xi, eta => samples%grid%lines(2)%xi)
      at = maxloc(found%depth) + low - 1
      call keep_deeper(found(at(1), at(2)), [xi(at(1)), eta(at(2))], samples%shift, &
                       [step_at(xi, at(1)), step_at(eta, at(2))], best)
      best%width = width
      best%is_smooth = is_smooth
      do j = low(2), high(2) - 1
        do i = low(1), high(1) - 1
          associate (known => max(best%depth, shallow*tool%search_distance))
            if (.not. hides_depth(found(i:i + 1, j:j + 1), is_smooth, known)) cycle
          end associate
          call sample_cell(samples, tool, [xi(i), eta(j)], [xi(i + 1), eta(j + 1)], best)
        end do
      end do
    end associate
    ! Between samples that are clear lie positions that are less so.
    if (size(samples%bends) == 0) then
      ! By the sagitta of the tool, and of a sheet that lies on it, between two samples.
      width = min(reach, max(flat, 0.25_wp*width/samples%radius))*width
    else if (is_smooth) then
      width = 0.5_wp*width
    end if
    do j = low(2), high(2)
      do i = low(1), high(1)
        k = index_of(samples, tile, i, j)
        if (samples%wake(k) > now) cycle
        n_checked = n_checked + 1
        samples%wake(k) = now + max(found(i, j)%clear - width, 0.0_wp)
      end do
    end do
    samples%wake_at(tile) = minval(samples%wake(samples%before(tile) + 1:k))
  end subroutine sample_tile

  !> Where a sample of a tile is in the list of all of them.
  pure integer function index_of(samples, tile, i, j)
    type(depth_samples_t), intent(in) :: samples
    integer, intent(in) :: tile, i, j

    associate (low => samples%first(:, tile), high => samples%last(:, tile))
      index_of = samples%before(tile) + i - low(1) + 1 + (high(1) - low(1) + 1)*(j - low(2))
    end associate
  end function index_of

  !> Distance to the next sample.
  pure real(wp) function step_at(xi, i)
    real(wp), intent(in) :: xi(:)
    integer, intent(in) :: i

    step_at = xi(min(i + 1, size(xi))) - xi(min(i, size(xi) - 1))
  end function step_at

  !> Where the samples of a tile are in the tool's frame, and the longest diagonal between them.
  pure subroutine locate_samples(samples, low, high, found, width)
    type(depth_samples_t), intent(in) :: samples
    integer, intent(in) :: low(2), high(2)
    type(sample_t), intent(inout) :: found(low(1):high(1), low(2):high(2))
    real(wp), intent(out) :: width               !! [length]
    real(wp) :: positions(low(1):high(1), 3)
    integer :: i, j

    do j = low(2), high(2)
      call row_positions(samples%grid, samples%surface%points, j, low(1), high(1), positions)
      do i = low(1), high(1)
        found(i, j)%x = positions(i, :) - samples%shift
      end do
    end do
    width = 0.0_wp
    do j = low(2), high(2) - 1
      do i = low(1), high(1) - 1
        width = max(width, width_of(found(i:i + 1, j:j + 1)))
      end do
    end do
  end subroutine locate_samples

  !> How the samples of a tile lie to the tool. Eight at a time are followed from where the contact
  !! points near them are, which is quick but may miss what no contact point has seen. A contact
  !! point that is far from the tool keeps the samples near it clear.
  subroutine sample_grid(samples, contact, tool, tile, may_follow, low, high, found)
    type(depth_samples_t), intent(in) :: samples
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: tile
    logical, intent(in) :: may_follow            !! else the whole tool is searched for each
    integer, intent(in) :: low(2), high(2)
    type(sample_t), intent(inout) :: found(low(1):high(1), low(2):high(2))
    type(lanes_t) :: lanes
    integer :: i, j, n, point, at(2, n_lanes)
    real(wp) :: now

    now = contact%tiles(tile)%travel
    n = 0
    do j = low(2), high(2)
      do i = low(1), high(1)
        if (samples%wake(index_of(samples, tile, i, j)) > now) cycle
        point = samples%near_1(i) + contact%secondary%n_along(1)*(samples%near_2(j) - 1)
        if (.not. may_follow .or. contact%face(point) == 0) then
          if (contact%face(point) == 0) found(i, j)%clear = &
            contact%test_at(point) - now &
            - norm2(found(i, j)%x + samples%shift &
                    - point_position(contact%secondary, samples%surface%points, samples%near_1(i), &
                                     samples%near_2(j)))
          if (found(i, j)%clear <= 0.0_wp) call locate(tool, samples%overhang, found(i, j))
          cycle
        end if
        n = n + 1
        at(:, n) = [i, j]
        lanes%face(n) = contact%face(point)
        lanes%s(n) = contact%at(1, point)
        lanes%t(n) = contact%at(2, point)
        lanes%x(n, :) = found(i, j)%x
        if (n == n_lanes) call follow_samples(tool, samples%overhang, low, high, at, n, lanes, &
                                              found)
      end do
    end do
    if (n > 0) call follow_samples(tool, samples%overhang, low, high, at, n, lanes, found)
  end subroutine sample_grid

  !> Does the tool bend more sharply than contact points are apart around some samples?
  pure logical function has_bend(samples, found)
    type(depth_samples_t), intent(in) :: samples
    type(sample_t), intent(in) :: found(:, :)
    real(wp) :: low(3), high(3)
    integer :: c, k

    has_bend = .false.
    if (size(samples%bends) == 0) return
    do c = 1, 3
      low(c) = minval(found%x(c)) - samples%apart
      high(c) = maxval(found%x(c)) + samples%apart
    end do
    do k = 1, size(samples%bends)
      has_bend = all(samples%bends(k)%x >= low .and. samples%bends(k)%x <= high)
      if (has_bend) return
    end do
  end function has_bend

  !> Sample a cell of the grid more finely.
  pure subroutine sample_cell(samples, tool, low, high, best)
    type(depth_samples_t), intent(in) :: samples
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: low(2), high(2)      !! parametric coordinates of its corners
    type(deep_point_t), intent(inout) :: best
    type(sample_t) :: sample
    real(wp) :: at(2)
    integer :: i, j

    do j = 0, n_parts
      do i = 0, n_parts
        if (mod(i, n_parts) == 0 .and. mod(j, n_parts) == 0) cycle
        at = low + (high - low)*[i, j]/n_parts
        call evaluate_surface(samples%surface, at, sample%x)
        sample%x = sample%x - samples%shift
        call locate(tool, samples%overhang, sample)
        call keep_deeper_inside(samples, sample, at, (high - low)/n_parts, best)
      end do
    end do
  end subroutine sample_cell

  !> From a sample to the deepest point around it, by trial steps that are halved where none leads
  !! deeper.
  pure subroutine climb(samples, tool, candidate)
    type(depth_samples_t), intent(in) :: samples
    type(tool_t), intent(in) :: tool
    type(deep_point_t), intent(inout) :: candidate
    integer, parameter :: directions(2, 8) = reshape([1, 0, -1, 0, 0, 1, 0, -1, &
                                                1, 1, -1, -1, 1, -1, -1, 1], [2, 8])
    integer, parameter :: most_steps = 16
    type(deep_point_t) :: start
    type(sample_t) :: sample
    type(hit_t) :: hit
    real(wp) :: at(2), low(2), high(2), step(2)
    integer :: d, k, halving, n

    do d = 1, 2
      associate (axis => samples%surface%axes(d))
        low(d) = axis%knots(1)
        high(d) = axis%knots(axis%n_basis + 1)
      end associate
    end do
    step = candidate%step
    n = 0
    do halving = 1, n_halvings
      step = 0.5_wp*step
      do while (n < most_steps)
        start = candidate
        do k = 1, 8
          at = min(max(start%at + directions(:, k)*step, low), high)
          call evaluate_surface(samples%surface, at, sample%x)
          sample%x = sample%x - samples%shift
          if (start%is_smooth) then
            call follow(tool, sample%x, start%face, start%on, hit)
            if (.not. hit%is_converged) cycle
            call record_hit(tool, samples%overhang, hit, sample)
          else
            call locate(tool, samples%overhang, sample)
          end if
          call keep_deeper_inside(samples, sample, at, start%step, candidate)
        end do
        if (.not. candidate%depth > start%depth) exit
        n = n + 1
      end do
    end do
  end subroutine climb

end module face_penetration
