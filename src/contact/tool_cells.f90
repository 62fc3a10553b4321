!> Cells of a tool: its faces, divided where they bend, so that one local search from each cell that
!! may hold the closest point is enough; or blocks of faces, where small ones join smoothly, so that
!! the cost of a search depends on the shape of a tool and not on its number of knots.
!!
!! A face that bends so little that no point within the search distance is beyond its centre of
!! curvature has one closest point: it is gentle and stays whole. Others are halved across the
!! direction that turns most, by de Casteljau's rule, until their control polygons are nearly
!! straight, opposite edges nearly parallel, and their weights alike.
!!
!! A block is at most twice the search distance long. All its faces are gentle, no knot line in it
!! breaks the tangent plane, and the tangents along xi and along eta each stay within a narrow cone,
!! so that a point has one closest point in the block and a search limited to it finds it.
module tool_cells
  use kinds, only: wp
  use bezier, only: bezier_points
  use contact_territory, only: contact_territory_t, new_territory
  implicit none
  private

  public :: cell_t, cell_list_t, halve, cut_surface, append_edge

  integer, parameter :: max_depth = 28             !! halvings of a face, both directions together
  integer, parameter :: max_cells = 4096           !! of one face
  real(wp), parameter :: most_bend = 0.05_wp       !! sagitta over chord of a polygon of degree 2
  real(wp), parameter :: most_turn = 0.2_wp        !! of edges across the direction [rad]
  real(wp), parameter :: most_ratio = 2.0_wp       !! of the weights
  real(wp), parameter :: same_weights = 1.5_wp     !! ratio that leaves sagittas their meaning
  real(wp), parameter :: most_weights = 10.0_wp    !! ratio in a face that makes it wild

  !> Part of a face, a face, or a block of faces that join smoothly.
  type :: cell_t
    integer :: face = 0                            !! face it is a part of, or first of the block
    integer :: n(2) = 1                            !! faces of the block along xi and eta
    integer :: edge = 0                            !! piece of an edge instead of a part of a face
    integer :: stride = 0                          !! from a face of the block to the next along eta
    real(wp) :: low(2) = 0.0_wp, high(2) = 1.0_wp  !! local coordinates s and t of a part
    logical :: is_gentle = .false.                 !! too flat to have two points closest to a point
    logical :: is_wild = .false.                   !! of a face with very different weights or with
                                                   !! an edge shrunk to a point
    type(contact_territory_t) :: territory
    real(wp) :: box(3, 2) = 0.0_wp                 !! corners of the box around it [length]
  end type cell_t

  !> Cells of a tool: the first `n` of `items`.
  type :: cell_list_t
    integer :: n = 0
    type(cell_t), allocatable :: items(:)
  end type cell_list_t

  real(wp), parameter :: longest = 2.0_wp          !! block, part of the search distance
  real(wp), parameter :: cone = 0.9_wp             !! cosine of the widest angle of tangents
  real(wp), parameter :: same_direction = 1.0e-6_wp   !! sine of an angle taken for zero
  real(wp), parameter :: same_ratio = 1.0e-3_wp

  !> Faces of a surface, while it is cut.
  type :: sheet_t
    integer :: before = 0                          !! faces of the surfaces before this one
    integer :: n(2) = 0                            !! faces along xi and eta
    real(wp) :: distance = 0.0_wp                  !! of the search [length]
    logical, allocatable :: is_gentle(:, :)        !! faces, shape (n)
    logical, allocatable :: is_outside(:)          !! faces beyond a trim; absent: none
    integer, allocatable :: n_breaks(:, :)         !! breaks before each face, along both axes
  end type sheet_t

contains

  !> Whether one of the edges of a hull is much shorter than the longest.
  pure logical function has_shrunk_edge(hull)
    real(wp), intent(in) :: hull(:, :, :)
    real(wp), parameter :: shrunk = 1.0e-3_wp
    real(wp) :: extents(4)

    associate (n => size(hull, 2), m => size(hull, 3))
      extents = [extent_of(hull(:, :, 1)), extent_of(hull(:, :, m)), extent_of(hull(:, 1, :)), &
                 extent_of(hull(:, n, :))]
    end associate
    has_shrunk_edge = minval(extents) <= shrunk*maxval(extents)
  end function has_shrunk_edge

  !> Append a part of a face, or its halves.
  pure recursive subroutine cut(cells, part, hull, distance, depth, n_left)
    type(cell_list_t), intent(inout) :: cells
    type(cell_t), intent(in) :: part
    real(wp), intent(in) :: hull(:, :, :), distance
    integer, intent(in) :: depth
    integer, intent(inout) :: n_left        !! cells that the face may still have
    type(cell_t) :: half
    real(wp) :: halves(4, size(hull, 2), size(hull, 3), 2), bend(2)
    real(wp) :: turned(4, size(hull, 3), size(hull, 2))
    integer :: d, side

    half = part
    call enclose(hull, half%territory, half%box)
    turned = reshape(hull, shape(turned), order=[1, 3, 2])
    bend = [max(bend_of(hull), turn_of(turned)), max(bend_of(turned), turn_of(hull))]
    d = maxloc(bend, 1)
    half%is_gentle = is_gentle_face(hull, half%territory, distance)
    if (half%is_gentle .or. bend(d) <= 1.0_wp .or. depth == max_depth .or. n_left <= 1) then
      half%is_wild = half%is_wild .or. has_shrunk_edge(hull)
      call append(cells, half)
      return
    end if
    n_left = n_left - 1
    call halve(hull, d, halves)
    do side = 1, 2
      half = part
      if (side == 1) half%high(d) = 0.5_wp*(part%low(d) + part%high(d))
      if (side == 2) half%low(d) = 0.5_wp*(part%low(d) + part%high(d))
      call cut(cells, half, halves(:, :, :, side), distance, depth + 1, n_left)
    end do
  end subroutine cut

  !> How far the first direction of a hull is from what a cell may be, 1 being the limit: the
  !! largest sagitta of its polygons, or the largest ratio of the weights along one.
  pure real(wp) function bend_of(hull) result(bend)
    real(wp), intent(in) :: hull(:, :, :)
    real(wp) :: points(3, size(hull, 2)), chord(3), length, along, whole
    integer :: i, j, n

    n = size(hull, 2)
    bend = 0.0_wp
    whole = maxval([(extent_of(hull(:, :, j)), j=1, size(hull, 3))])
    do j = 1, size(hull, 3)
      bend = max(bend, log(maxval(hull(4, :, j))/minval(hull(4, :, j)))/log(most_ratio))
      if (extent_of(hull(:, :, j)) <= 1.0e-6_wp*whole) cycle
      points = hull(:3, :, j)/spread(hull(4, :, j), 1, 3)
      chord = points(:, n) - points(:, 1)
      length = max(norm2(chord), tiny(1.0_wp))
      do i = 2, n - 1
        along = dot_product(points(:, i) - points(:, 1), chord)/length**2
        along = norm2(points(:, i) - points(:, 1) - min(max(along, 0.0_wp), 1.0_wp)*chord)
        bend = max(bend, along*(n - 2)/(most_bend*length))
      end do
    end do
  end function bend_of

  !> How much the chords of the rows along the first direction of a hull turn from row to row, 1
  !! being the limit. Rows that have shrunk to a point have no direction.
  pure real(wp) function turn_of(hull) result(turn)
    real(wp), intent(in) :: hull(:, :, :)
    real(wp) :: chords(3, size(hull, 3)), lengths(size(hull, 3)), mean(3)
    integer :: j, n

    n = size(hull, 2)
    do j = 1, size(hull, 3)
      chords(:, j) = hull(:3, n, j)/hull(4, n, j) - hull(:3, 1, j)/hull(4, 1, j)
      lengths(j) = norm2(chords(:, j))
      if (lengths(j) > 0.0_wp) chords(:, j) = chords(:, j)/lengths(j)
    end do
    turn = 0.0_wp
    mean = chords(:, maxloc(lengths, 1))
    do j = 1, size(hull, 3)
      if (lengths(j) <= 1.0e-6_wp*maxval(lengths)) cycle
      turn = max(turn, norm2(chords(:, j) - mean)/most_turn)
    end do
  end function turn_of

  !> Largest extent of a row of homogeneous points along an axis.
  pure real(wp) function extent_of(row) result(extent)
    real(wp), intent(in) :: row(:, :)
    integer :: c

    extent = 0.0_wp
    do c = 1, 3
      extent = max(extent, maxval(row(c, :)/row(4, :)) - minval(row(c, :)/row(4, :)))
    end do
  end function extent_of

  !> Both halves of a hull across direction `d`, by the rule of P. de Casteljau.
  pure subroutine halve(hull, d, halves)
    real(wp), intent(in) :: hull(:, :, :)
    integer, intent(in) :: d
    real(wp), intent(out) :: halves(4, size(hull, 2), size(hull, 3), 2)
    integer :: k, n

    n = size(hull, d + 1)
    halves(:, :, :, 2) = hull
    if (d == 1) then
      do k = 1, n
        halves(:, k, :, 1) = halves(:, 1, :, 2)
        halves(:, :n - k, :, 2) = 0.5_wp*(halves(:, :n - k, :, 2) + halves(:, 2:n - k + 1, :, 2))
      end do
    else
      do k = 1, n
        halves(:, :, k, 1) = halves(:, :, 1, 2)
        halves(:, :, :n - k, 2) = 0.5_wp*(halves(:, :, :n - k, 2) + halves(:, :, 2:n - k + 1, 2))
      end do
    end if
  end subroutine halve

  pure subroutine append(cells, cell)
    type(cell_list_t), intent(inout) :: cells
    type(cell_t), intent(in) :: cell
    type(cell_t), allocatable :: longer(:)

    if (.not. allocated(cells%items)) allocate (cells%items(64))
    if (cells%n == size(cells%items)) then
      allocate (longer(2*cells%n))
      longer(:cells%n) = cells%items
      call move_alloc(longer, cells%items)
    end if
    cells%n = cells%n + 1
    cells%items(cells%n) = cell
  end subroutine append

  !> Territory and bounding box of homogeneous control points.
  pure subroutine enclose(hull, territory, box)
    real(wp), intent(in) :: hull(:, :, :)   !! shape (4, n1, n2)
    type(contact_territory_t), intent(out) :: territory
    real(wp), intent(out) :: box(3, 2)
    real(wp) :: points(size(hull, 2), size(hull, 3), 3)
    integer :: i

    points = bezier_points(hull)
    box = reshape([(minval(points(:, :, i)), i=1, 3), (maxval(points(:, :, i)), i=1, 3)], [3, 2])
    call new_territory(territory, points)
  end subroutine enclose

  !> Whether a face, or a part of one, has one closest point for every point within a distance: its
  !! curvature is below that of a sphere of this radius, its edges turn little, its weights are
  !! alike, and no edge has shrunk to a point.
  pure logical function is_gentle_face(hull, territory, distance) result(is_gentle)
    real(wp), intent(in) :: hull(:, :, :)   !! Bezier points, homogeneous, shape (4, n1, n2)
    type(contact_territory_t), intent(in) :: territory   !! around them
    real(wp), intent(in) :: distance        !! of the search [length]
    real(wp), parameter :: safety = 1.5_wp
    real(wp) :: turned(4, size(hull, 3), size(hull, 2)), curvature(2), twist(2)
    logical :: is_proper(2)

    is_gentle = maxval(hull(4, :, :)) <= same_weights*minval(hull(4, :, :))
    if (.not. is_gentle) return
    turned = reshape(hull, shape(turned), order=[1, 3, 2])
    call bound_curvature(hull, territory%axes(:, 3), curvature(1), twist(1), is_proper(1))
    call bound_curvature(turned, territory%axes(:, 3), curvature(2), twist(2), is_proper(2))
    is_gentle = all(is_proper) .and. max(turn_of(hull), turn_of(turned)) <= 1.0_wp &
                .and. safety*distance*(maxval(curvature) + maxval(twist)) < 1.0_wp
  end function is_gentle_face

  !> Curvature along the first direction of a hull, and twist across it. A row of degree p whose
  !! polygon leaves its chord by h along the normal is taken to bend no tighter than one of degree 2
  !! over 1/(p - 1) of its length l: by 8 h (p - 1)^2/l^2, twice the curvature of a parabola.
  pure subroutine bound_curvature(hull, normal, curvature, twist, is_proper)
    real(wp), intent(in) :: hull(:, :, :), normal(3)
    real(wp), intent(out) :: curvature, twist    !! [1/length]
    logical, intent(out) :: is_proper            !! no leg of the polygons has shrunk to a point
    real(wp), parameter :: shrunk = 1.0e-3_wp
    real(wp) :: points(3, size(hull, 2)), legs(size(hull, 2) - 1), chord(3), first(3), begin(3)
    real(wp) :: length, along, least, longest, across
    integer :: i, j, n

    n = size(hull, 2)
    curvature = 0.0_wp
    twist = 0.0_wp
    least = huge(1.0_wp)
    longest = 0.0_wp
    do j = 1, size(hull, 3)
      do i = 1, n
        points(:, i) = hull(:3, i, j)/hull(4, i, j)
      end do
      legs = sqrt(sum((points(:, 2:) - points(:, :n - 1))**2, 1))
      least = min(least, minval(legs))
      longest = max(longest, maxval(legs))
      chord = points(:, n) - points(:, 1)
      length = max(norm2(chord), tiny(1.0_wp))
      do i = 2, n - 1
        along = dot_product(points(:, i) - points(:, 1), chord)/length**2
        along = abs(dot_product(points(:, i) - points(:, 1) - along*chord, normal))
        curvature = max(curvature, 8*along*(n - 2)**2/length**2)
      end do
      if (j == 1) begin = points(:, 1)
      if (j == 1) first = chord/length
      across = norm2(points(:, 1) - begin)
      if (j > 1) twist = max(twist, abs(dot_product(chord/length - first, normal)) &
                             *(size(hull, 3) - 1)/max(across*(j - 1), tiny(1.0_wp)))
    end do
    is_proper = least > shrunk*longest
  end subroutine bound_curvature

  !> Append the cells of a surface.
  pure subroutine cut_surface(cells, before, n, hulls, distance, is_outside)
    type(cell_list_t), intent(inout) :: cells
    integer, intent(in) :: before           !! faces of the surfaces before this one
    integer, intent(in) :: n(2)             !! faces along xi and eta
    real(wp), intent(in) :: hulls(:, :, :, :)   !! Bezier points, homogeneous, (4, p1, p2, n faces)
    real(wp), intent(in) :: distance        !! of the search [length]
    logical, intent(in), optional :: is_outside(:)   !! faces that get no cell, shape (n faces)
    type(sheet_t) :: sheet
    type(contact_territory_t) :: territory
    integer :: i, j, d, face, step(2)

    sheet%before = before
    sheet%n = n
    sheet%distance = distance
    if (present(is_outside)) sheet%is_outside = is_outside
    allocate (sheet%is_gentle(n(1), n(2)), sheet%n_breaks(maxval(n), 2))
    do j = 1, n(2)
      do i = 1, n(1)
        face = i + (j - 1)*n(1)
        call new_territory(territory, bezier_points(hulls(:, :, :, face)))
        sheet%is_gentle(i, j) = is_gentle_face(hulls(:, :, :, face), territory, distance)
      end do
    end do
    sheet%n_breaks = 0
    step = [1, n(1)]
    do d = 1, 2
      do i = 2, n(d)
        face = 1 + (i - 1)*step(d)
        sheet%n_breaks(i, d) = sheet%n_breaks(i - 1, d) + merge(0, 1, &
          all([(is_smooth(hulls(:, :, :, face + j*step(3 - d) - step(d)), &
                          hulls(:, :, :, face + j*step(3 - d)), d), j=0, n(3 - d) - 1)]))
      end do
    end do
    call divide(cells, sheet, hulls, [1, 1], n)
  end subroutine cut_surface

  !> Append a range of faces as one block, or its halves. Breaks of the tangent plane come first.
  pure recursive subroutine divide(cells, sheet, hulls, low, high)
    type(cell_list_t), intent(inout) :: cells
    type(sheet_t), intent(in) :: sheet
    real(wp), intent(in) :: hulls(:, :, :, :)
    integer, intent(in) :: low(2), high(2)  !! first and last face along xi and eta
    type(cell_t) :: whole
    integer :: middle(2), d, n_left
    real(wp) :: along(3, 2)
    integer :: i, j

    if (allocated(sheet%is_outside)) then
      if (all([((sheet%is_outside(i + (j - 1)*sheet%n(1)), i=low(1), high(1)), &
                j=low(2), high(2))])) return
    end if
    if (all(low == high)) then
      associate (hull => hulls(:, :, :, low(1) + (low(2) - 1)*sheet%n(1)))
        whole%face = sheet%before + low(1) + (low(2) - 1)*sheet%n(1)
        whole%is_wild = maxval(hull(4, :, :)) > most_weights*minval(hull(4, :, :))
        n_left = max_cells
        call cut(cells, whole, hull, sheet%distance, 0, n_left)
      end associate
      return
    end if
    call chords(sheet, hulls, low, high, along)
    if (is_block(sheet, hulls, low, high, along)) then
      call append_block(cells, sheet, hulls, low, high)
      return
    end if
    d = merge(1, 2, norm2(along(:, 1)) >= norm2(along(:, 2)))
    if (low(d) == high(d)) d = 3 - d
    middle = high
    middle(d) = (low(d) + high(d))/2
    call divide(cells, sheet, hulls, low, middle)
    middle = low
    middle(d) = (low(d) + high(d))/2 + 1
    call divide(cells, sheet, hulls, middle, high)
  end subroutine divide

  !> Mean directions of a range of faces along xi and eta, in full length.
  pure subroutine chords(sheet, hulls, low, high, along)
    type(sheet_t), intent(in) :: sheet
    real(wp), intent(in) :: hulls(:, :, :, :)
    integer, intent(in) :: low(2), high(2)
    real(wp), intent(out) :: along(3, 2)
    real(wp) :: corners(3, 2, 2)

    associate (p => size(hulls, 2), q => size(hulls, 3), n => sheet%n(1))
      corners(:, 1, 1) = position_of(hulls(:, 1, 1, low(1) + (low(2) - 1)*n))
      corners(:, 2, 1) = position_of(hulls(:, p, 1, high(1) + (low(2) - 1)*n))
      corners(:, 1, 2) = position_of(hulls(:, 1, q, low(1) + (high(2) - 1)*n))
      corners(:, 2, 2) = position_of(hulls(:, p, q, high(1) + (high(2) - 1)*n))
    end associate
    along(:, 1) = 0.5_wp*sum(corners(:, 2, :) - corners(:, 1, :), 2)
    along(:, 2) = 0.5_wp*sum(corners(:, :, 2) - corners(:, :, 1), 2)
  end subroutine chords

  !> Whether a range of faces may be one block.
  pure logical function is_block(sheet, hulls, low, high, along)
    type(sheet_t), intent(in) :: sheet
    real(wp), intent(in) :: hulls(:, :, :, :)
    integer, intent(in) :: low(2), high(2)
    real(wp), intent(in) :: along(3, 2)     !! from `chords`
    real(wp) :: unit(3, 2)
    integer :: i, j

    is_block = maxval(sum(along**2, 1)) <= (longest*sheet%distance)**2 &
               .and. minval(sum(along**2, 1)) > 0.0_wp
    if (.not. is_block) return
    is_block = sheet%n_breaks(high(1), 1) == sheet%n_breaks(low(1), 1) &
               .and. sheet%n_breaks(high(2), 2) == sheet%n_breaks(low(2), 2) &
               .and. all(sheet%is_gentle(low(1):high(1), low(2):high(2)))
    if (.not. is_block) return
    unit(:, 1) = along(:, 1)/norm2(along(:, 1))
    unit(:, 2) = along(:, 2)/norm2(along(:, 2))
    is_block = abs(dot_product(unit(:, 1), unit(:, 2))) < cone
    do j = low(2), high(2)
      do i = low(1), high(1)
        if (.not. is_block) return
        is_block = is_within_cones(hulls(:, :, :, i + (j - 1)*sheet%n(1)), unit)
      end do
    end do
  end function is_block

  !> Whether the legs of all control polygons of a face point nearly along two directions.
  pure logical function is_within_cones(hull, unit) result(is_within)
    real(wp), intent(in) :: hull(:, :, :), unit(3, 2)
    real(wp) :: points(size(hull, 2), size(hull, 3), 3), leg(3)
    integer :: i, j

    points = bezier_points(hull)
    is_within = .true.
    do j = 1, size(hull, 3)
      do i = 1, size(hull, 2)
        if (i > 1) then
          leg = points(i, j, :) - points(i - 1, j, :)
          is_within = is_within .and. dot_product(leg, unit(:, 1)) >= cone*norm2(leg)
        end if
        if (j > 1) then
          leg = points(i, j, :) - points(i, j - 1, :)
          is_within = is_within .and. dot_product(leg, unit(:, 2)) >= cone*norm2(leg)
        end if
      end do
    end do
  end function is_within_cones

  pure subroutine append_block(cells, sheet, hulls, low, high)
    type(cell_list_t), intent(inout) :: cells
    type(sheet_t), intent(in) :: sheet
    real(wp), intent(in) :: hulls(:, :, :, :)
    integer, intent(in) :: low(2), high(2)
    real(wp), allocatable :: joined(:, :, :)
    type(cell_t) :: block
    integer :: i, j

    associate (p => size(hulls, 2), q => size(hulls, 3))
      block%face = sheet%before + low(1) + (low(2) - 1)*sheet%n(1)
      block%n = high - low + 1
      block%stride = sheet%n(1)
      block%is_gentle = .true.
      allocate (joined(4, p*block%n(1), q*block%n(2)))
      do j = 1, block%n(2)
        do i = 1, block%n(1)
          joined(:, (i - 1)*p + 1:i*p, (j - 1)*q + 1:j*q) = &
            hulls(:, :, :, low(1) + i - 1 + (low(2) + j - 2)*sheet%n(1))
        end do
      end do
      call enclose(joined, block%territory, block%box)
    end associate
    call append(cells, block)
  end subroutine append_block

  !> Append a cell around a piece of an edge that stays in a rectangle of a face.
  pure subroutine append_edge(cells, edge, face, hull, low, high)
    type(cell_list_t), intent(inout) :: cells
    integer, intent(in) :: edge, face
    real(wp), intent(in) :: hull(:, :, :)          !! Bezier points of the face, homogeneous
    real(wp), intent(in) :: low(2), high(2)        !! corners of the rectangle
    type(cell_t) :: cell
    real(wp) :: part(size(hull, 1), size(hull, 2), size(hull, 3)), at
    integer :: k

    cell%edge = edge
    cell%face = face
    part = hull
    associate (n => size(hull, 2), m => size(hull, 3))
      do k = 1, n - 1
        part(:, k + 1:, :) = (1.0_wp - high(1))*part(:, k:n - 1, :) + high(1)*part(:, k + 1:, :)
      end do
      do k = 1, m - 1
        part(:, :, k + 1:) = (1.0_wp - high(2))*part(:, :, k:m - 1) + high(2)*part(:, :, k + 1:)
      end do
      at = low(1)/max(high(1), tiny(at))
      do k = 1, n - 1
        part(:, :n - k, :) = (1.0_wp - at)*part(:, :n - k, :) + at*part(:, 2:n - k + 1, :)
      end do
      at = low(2)/max(high(2), tiny(at))
      do k = 1, m - 1
        part(:, :, :m - k) = (1.0_wp - at)*part(:, :, :m - k) + at*part(:, :, 2:m - k + 1)
      end do
    end associate
    call enclose(part, cell%territory, cell%box)
    call append(cells, cell)
  end subroutine append_edge

  !> Whether two faces share their tangent planes along the edge where the first ends along axis `d`
  !! and the second begins: legs across it have one direction and are in one ratio.
  pure logical function is_smooth(before, behind, d)
    real(wp), intent(in) :: before(:, :, :), behind(:, :, :)   !! Bezier points, homogeneous
    integer, intent(in) :: d
    real(wp) :: rows(4, 3), into(3), out(3), ratio, first
    integer :: k, n

    is_smooth = .true.
    n = size(before, d + 1)
    do k = 1, size(before, 4 - d)
      if (d == 1) then
        rows = reshape([before(:, n - 1, k), before(:, n, k), behind(:, 2, k)], [4, 3])
      else
        rows = reshape([before(:, k, n - 1), before(:, k, n), behind(:, k, 2)], [4, 3])
      end if
      into = (position_of(rows(:, 2)) - position_of(rows(:, 1)))*rows(4, 1)
      out = (position_of(rows(:, 3)) - position_of(rows(:, 2)))*rows(4, 3)
      ratio = norm2(out)/max(norm2(into), tiny(1.0_wp))
      if (k == 1) first = ratio
      is_smooth = is_smooth .and. norm2(out - ratio*into) <= same_direction*norm2(out) &
                  .and. abs(ratio - first) <= same_ratio*first
    end do
  end function is_smooth

  !> Position of a homogeneous point.
  pure function position_of(h) result(x)
    real(wp), intent(in) :: h(4)
    real(wp) :: x(3)

    x = h(:3)/h(4)
  end function position_of

end module tool_cells
