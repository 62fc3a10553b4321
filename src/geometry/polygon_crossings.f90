!> Where closed polygons cross or touch, themselves or each other.
!!
!! Segments are compared that share a strip across the first axis and a range of the second. Places
!! of one polygon that are near along it do not touch: there it only turns.
module polygon_crossings
  use kinds, only: wp
  use linear_algebra, only: sorted_order
  use bucket_lists, only: sort_into_buckets
  use outline, only: polygon_t, share_along
  implicit none
  private

  public :: find_crossing

  integer, parameter :: most_strips = 4096
  real(wp), parameter :: apart = 1.0e3_wp   !! tolerances along a polygon between places that touch

  !> A place where polygons meet.
  type, public :: crossing_t
    integer :: polygons(2) = 0              !! their numbers, the lower one first; 0: none meet
    logical :: is_touch = .false.           !! they come close without crossing
    real(wp) :: place(2) = 0.0_wp
    real(wp) :: gap = 0.0_wp                !! of a touch [length]
  end type crossing_t

  !> Segments of all polygons, by their lower second coordinate.
  type :: segments_t
    real(wp), allocatable :: ends(:, :)     !! shape (4, n)
    integer, allocatable :: owner(:)        !! number of the polygon, shape (n)
    real(wp), allocatable :: begin(:)       !! way along it to the first end, shape (n)
    real(wp), allocatable :: length(:)      !! of each polygon
  end type segments_t

contains

  !> One place where polygons cross; if none do, the one where they come closest, within a
  !! tolerance.
  pure subroutine find_crossing(polygons, tolerance, found)
    type(polygon_t), intent(in) :: polygons(:)
    real(wp), intent(in) :: tolerance              !! of a touch [length]
    type(crossing_t), intent(out) :: found
    type(segments_t) :: segments
    integer, allocatable :: first(:), last(:)
    integer, allocatable :: list(:), begin(:)      ! segments of each strip, and where it begins
    real(wp) :: low, width, top
    integer :: s, i, k, n_strips

    call list_segments(polygons, segments)
    if (size(segments%owner) == 0) return
    n_strips = min(size(segments%owner), most_strips)
    associate (ends => segments%ends)
      low = minval(ends(1, :)) - tolerance
      width = max((maxval(ends(1, :)) + tolerance - low)/n_strips, tiny(1.0_wp))
      first = min(n_strips, 1 + int((min(ends(1, :), ends(3, :)) - tolerance - low)/width))
      last = min(n_strips, 1 + int((max(ends(1, :), ends(3, :)) + tolerance - low)/width))
    end associate
    call sort_into_buckets(n_strips, first, last, begin, list)
    do s = 1, n_strips
      do i = begin(s), begin(s + 1) - 1
        top = maxval(segments%ends([2, 4], list(i))) + tolerance
        do k = i + 1, begin(s + 1) - 1
          if (minval(segments%ends([2, 4], list(k))) > top) exit
          call compare(segments, list(i), list(k), tolerance, found)
          if (found%polygons(1) > 0 .and. .not. found%is_touch) return
        end do
      end do
    end do
  end subroutine find_crossing

  pure subroutine list_segments(polygons, segments)
    type(polygon_t), intent(in) :: polygons(:)
    type(segments_t), intent(out) :: segments
    integer, allocatable :: order(:)
    integer :: p, i, n, m

    n = sum([(size(polygons(p)%corners, 2), p=1, size(polygons))])
    allocate (segments%ends(4, n), segments%owner(n), segments%begin(n))
    allocate (segments%length(size(polygons)))
    n = 0
    do p = 1, size(polygons)
      segments%length(p) = 0.0_wp
      m = size(polygons(p)%corners, 2)
      do i = 1, m
        n = n + 1
        segments%ends(:2, n) = polygons(p)%corners(:, i)
        segments%ends(3:, n) = polygons(p)%corners(:, mod(i, m) + 1)
        segments%owner(n) = p
        segments%begin(n) = segments%length(p)
        segments%length(p) = segments%length(p) &
                             + norm2(segments%ends(3:, n) - segments%ends(:2, n))
      end do
    end do
    order = sorted_order(min(segments%ends(2, :), segments%ends(4, :)))
    segments%ends = segments%ends(:, order)
    segments%owner = segments%owner(order)
    segments%begin = segments%begin(order)
  end subroutine list_segments

  !> Keep where two segments cross, or where they touch closer than what was found before.
  pure subroutine compare(segments, i, k, tolerance, found)
    type(segments_t), intent(in) :: segments
    integer, intent(in) :: i, k
    real(wp), intent(in) :: tolerance
    type(crossing_t), intent(inout) :: found
    real(wp) :: gap, place(2), t(2), way

    associate (a => segments%ends(:, i), b => segments%ends(:, k), owner => segments%owner)
      if (any(min(a(:2), a(3:)) > max(b(:2), b(3:)) + tolerance) .or. &
          any(min(b(:2), b(3:)) > max(a(:2), a(3:)) + tolerance)) return
      if (do_cross(a, b)) then
        t(1) = turn(b(:2), b(3:), a(:2))
        t(1) = t(1)/(t(1) - turn(b(:2), b(3:), a(3:)))
        found = crossing_t([min(owner(i), owner(k)), max(owner(i), owner(k))], .false., &
                           a(:2) + t(1)*(a(3:) - a(:2)), 0.0_wp)
        return
      end if
      call find_gap(a, b, gap, place, t)
      if (gap > tolerance) return
      if (found%polygons(1) > 0 .and. gap >= found%gap) return
      if (owner(i) == owner(k)) then
        way = abs(segments%begin(i) + t(1) - segments%begin(k) - t(2))
        way = min(way, segments%length(owner(i)) - way)
        if (way <= apart*tolerance) return
      end if
      found = crossing_t([min(owner(i), owner(k)), max(owner(i), owner(k))], .true., place, gap)
    end associate
  end subroutine compare

  !> Distance of two segments that do not cross: that of an end of one from the other.
  pure subroutine find_gap(a, b, gap, place, t)
    real(wp), intent(in) :: a(4), b(4)             !! both ends
    real(wp), intent(out) :: gap, place(2)         !! place: in the middle of the gap
    real(wp), intent(out) :: t(2)                  !! ways along both to their nearest places
    real(wp) :: now, x(2), other(2), way
    integer :: e

    gap = huge(gap)
    do e = 0, 3
      if (e < 2) then
        x = a(1 + 2*e:2 + 2*e)
        call drop(x, b, other, way)
      else
        x = b(2*e - 3:2*e - 2)
        call drop(x, a, other, way)
      end if
      now = norm2(x - other)
      if (now >= gap) cycle
      gap = now
      place = 0.5_wp*(x + other)
      if (e < 2) t = [e*norm2(a(3:) - a(:2)), way]
      if (e >= 2) t = [way, (e - 2)*norm2(b(3:) - b(:2))]
    end do
  end subroutine find_gap

  !> The place of a segment that is nearest to another place.
  pure subroutine drop(x, segment, nearest, way)
    real(wp), intent(in) :: x(2), segment(4)
    real(wp), intent(out) :: nearest(2), way       !! way: along the segment
    real(wp) :: d(2), t

    d = segment(3:) - segment(:2)
    t = share_along(x - segment(:2), d)
    nearest = segment(:2) + t*d
    way = t*norm2(d)
  end subroutine drop

  !> Do two segments cross, each with its ends on either side of the other?
  pure logical function do_cross(a, b)
    real(wp), intent(in) :: a(4), b(4)             !! both ends

    do_cross = turn(a(:2), a(3:), b(:2))*turn(a(:2), a(3:), b(3:)) < 0.0_wp &
               .and. turn(b(:2), b(3:), a(:2))*turn(b(:2), b(3:), a(3:)) < 0.0_wp
  end function do_cross

  pure real(wp) function turn(a, b, c)
    real(wp), intent(in) :: a(2), b(2), c(2)

    turn = (b(1) - a(1))*(c(2) - a(2)) - (b(2) - a(2))*(c(1) - a(1))
  end function turn

end module polygon_crossings
