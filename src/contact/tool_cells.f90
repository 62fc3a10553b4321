!> Cells of a tool: its faces, cut where they bend, so that one local search from each cell that may
!! hold the closest point is enough.
!!
!! A face that bends so little that no point within the search distance is beyond its centre of
!! curvature has one closest place and stays whole. Others are halved across the direction that
!! turns most, by de Casteljau's rule, until their control polygons are nearly straight, opposite
!! edges nearly parallel, and their weights alike.
module tool_cells
  use kinds, only: wp
  use contact_territory, only: contact_territory_t, new_territory
  implicit none
  private

  public :: cell_t, cell_list_t, cut_face

  integer, parameter :: max_depth = 28             !! halvings of a face, both directions together
  integer, parameter :: max_cells = 4096           !! of one face
  real(wp), parameter :: most_bend = 0.05_wp       !! sagitta over chord of a polygon of degree 2
  real(wp), parameter :: most_turn = 0.2_wp        !! of edges across the direction [rad]
  real(wp), parameter :: most_ratio = 2.0_wp       !! of the weights
  real(wp), parameter :: same_weights = 1.5_wp     !! ratio that leaves sagittas their meaning

  !> Part of a face.
  type :: cell_t
    integer :: face = 0                            !! face it is a part of
    real(wp) :: low(2) = 0.0_wp, high(2) = 1.0_wp  !! local coordinates s and t on that face
    logical :: is_gentle = .false.                 !! too flat to have two places closest to a point
    type(contact_territory_t) :: territory
    real(wp) :: box(3, 2) = 0.0_wp                 !! corners of the box around it [length]
  end type cell_t

  !> Cells of a tool: the first `n` of `items`.
  type :: cell_list_t
    integer :: n = 0
    type(cell_t), allocatable :: items(:)
  end type cell_list_t

contains

  !> Append the cells of a face.
  pure subroutine cut_face(cells, face, hull, distance)
    type(cell_list_t), intent(inout) :: cells
    integer, intent(in) :: face
    real(wp), intent(in) :: hull(:, :, :)   !! Bezier points, homogeneous, shape (4, n1, n2)
    real(wp), intent(in) :: distance        !! of the search [length]
    type(cell_t) :: whole
    integer :: n_left

    whole%face = face
    n_left = max_cells
    call cut(cells, whole, hull, distance, 0, n_left)
  end subroutine cut_face

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
    half%is_gentle = is_flat_enough(half%territory, maxval(shape(hull(1, :, :))) - 1, distance) &
                     .and. maxval(hull(4, :, :)) <= same_weights*minval(hull(4, :, :)) &
                     .and. max(turn_of(hull), turn_of(turned)) <= 1.0_wp
    if (half%is_gentle .or. bend(d) <= 1.0_wp .or. depth == max_depth .or. n_left <= 1) then
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
    whole = 0.0_wp
    do j = 1, size(hull, 3)
      whole = max(whole, extent_of(hull(:, :, j)))
    end do
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

    do i = 1, 3
      points(:, :, i) = hull(i, :, :)/hull(4, :, :)
      box(i, :) = [minval(points(:, :, i)), maxval(points(:, :, i))]
    end do
    call new_territory(territory, points)
  end subroutine enclose

  !> Whether a face bends so little that a point within the search distance cannot be beyond its
  !! centre of curvature. A curve of degree p and sagitta h is taken to bend no tighter than one of
  !! degree 2 over 1/(p - 1) of its length l, whose radius is l^2/(8 h (p - 1)^2).
  pure logical function is_flat_enough(territory, degree, distance)
    type(contact_territory_t), intent(in) :: territory
    integer, intent(in) :: degree
    real(wp), intent(in) :: distance
    real(wp), parameter :: safety = 2.0_wp
    real(wp) :: extent(3)

    extent = territory%high - territory%low
    is_flat_enough = 8*safety*distance*extent(3)*max(degree - 1, 1)**2 < minval(extent(:2))**2
  end function is_flat_enough

end module tool_cells
