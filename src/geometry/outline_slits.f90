!> Gaps of an outline across which basis functions join what the outline parts: a control point that
!! both sides have moves them together.
module outline_slits
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, breaks, span_table
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use bucket_lists, only: sort_into_buckets
  use outline, only: region_t, share_along
  use region_parts, only: region_parts_t, find_parts
  implicit none
  private

  public :: find_slit

  integer, parameter :: most_segments = 200    !! of a side that are compared

  !> The narrowest gap.
  type, public :: slit_t
    logical :: is_there = .false.
    real(wp) :: width = 0.0_wp                 !! [length]
    real(wp) :: elements = 0.0_wp              !! width, in elements
    real(wp) :: longest = 0.0_wp               !! elements across it that would tell its sides apart
    real(wp) :: place(3) = 0.0_wp              !! its middle [length]
  end type slit_t

  !> Elements that a function reaches, by axis.
  type :: reach_t
    integer, allocatable :: first(:), last(:)
  end type reach_t

contains

  !> The narrowest gap whose sides a function of the sheet has in common, though they do not come
  !! together within as many elements around its own as its degree is. Gaps as wide as these do not
  !! count, and those between one region and another are not seen.
  subroutine find_slit(surface, region, share, slit)
    type(nurbs_surface_t), intent(in) :: surface      !! of the sheet as it lies
    type(region_t), intent(in) :: region
    real(wp), intent(in) :: share(:, :)               !! of each element that is there
    type(slit_t), intent(out) :: slit
    type(region_parts_t) :: parts
    type(reach_t) :: reach(2)
    integer, allocatable :: stamp(:), queue(:), begin(:), list(:)
    real(wp) :: least, gap, ends(2, 2), x(3, 2), lengths(2)
    integer :: a, b, d, p, low(2), high(2), number

    call find_parts(region, breaks(surface%axes(1)), breaks(surface%axes(2)), share, parts)
    ! Segments of each part; an owner 0 is none.
    call sort_into_buckets(parts%n, max(1, parts%owner), parts%owner, begin, list)
    do d = 1, 2
      call find_reach(surface%axes(d), reach(d))
    end do
    p = maxval(surface%axes%degree)
    allocate (stamp(parts%n), queue(parts%n), source=0)
    least = real(p, wp)
    number = 0
    do b = 1, surface%axes(2)%n_basis
      do a = 1, surface%axes(1)%n_basis
        low = [reach(1)%first(a), reach(2)%first(b)]
        high = [reach(1)%last(a), reach(2)%last(b)]
        if (all(share(low(1):high(1), low(2):high(2)) >= 1.0_wp)) cycle
        number = number + 1
        call spread_out(parts, low, high, p, number, stamp, queue)
        if (.not. is_parted(parts, low, high, number, stamp)) cycle
        lengths = [length_of(surface%axes(1), low(1), high(1)), &
                   length_of(surface%axes(2), low(2), high(2))]
        call find_gap(parts, low, high, number, stamp, begin, list, lengths, gap, x(:2, :))
        if (gap >= least) cycle
        least = gap
        ends = x(:2, :)
      end do
    end do
    slit%is_there = least < p
    if (.not. slit%is_there) return
    call evaluate_surface(surface, ends(:, 1), x(:, 1))
    call evaluate_surface(surface, ends(:, 2), x(:, 2))
    slit%elements = least
    slit%width = norm2(x(:, 2) - x(:, 1))
    slit%longest = slit%width/p
    slit%place = 0.5_wp*(x(:, 1) + x(:, 2))
  end subroutine find_slit

  !> Elements of each function of an axis.
  pure subroutine find_reach(axis, reach)
    type(knot_vector_t), intent(in) :: axis
    type(reach_t), intent(out) :: reach
    integer, allocatable :: spans(:)
    integer :: e

    spans = span_table(axis)
    allocate (reach%first(axis%n_basis), reach%last(axis%n_basis))
    do e = size(spans), 1, -1
      reach%first(spans(e) - axis%degree:spans(e)) = e
    end do
    do e = 1, size(spans)
      reach%last(spans(e) - axis%degree:spans(e)) = e
    end do
  end subroutine find_reach

  !> Mean length of some elements, in the parameter.
  pure real(wp) function length_of(axis, first, last) result(length)
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: first, last
    real(wp), allocatable :: lines(:)

    lines = breaks(axis)
    length = (lines(last + 1) - lines(first))/(last - first + 1)
  end function length_of

  !> Stamp what hangs together with the first part of some elements, within `around` more elements
  !! on each side.
  pure subroutine spread_out(parts, low, high, around, number, stamp, queue)
    type(region_parts_t), intent(in) :: parts
    integer, intent(in) :: low(2), high(2), around, number
    integer, intent(inout) :: stamp(:)
    integer, intent(inout) :: queue(:)                !! room for all parts
    integer :: i, j, n, at, k

    n = 0
    search: do j = low(2), high(2)
      do i = low(1), high(1)
        if (parts%last(i, j) < parts%first(i, j)) cycle
        n = 1
        queue(1) = parts%first(i, j)
        stamp(queue(1)) = number
        exit search
      end do
    end do search
    at = 0
    do while (at < n)
      at = at + 1
      do k = parts%begin(queue(at)), parts%begin(queue(at) + 1) - 1
        associate (next => parts%links(k))
          if (stamp(next) == number) cycle
          if (any(parts%cell(:, next) < low - around .or. &
                  parts%cell(:, next) > high + around)) cycle
          n = n + 1
          queue(n) = next
          stamp(next) = number
        end associate
      end do
    end do
  end subroutine spread_out

  !> Have some elements a part that is not stamped?
  pure logical function is_parted(parts, low, high, number, stamp)
    type(region_parts_t), intent(in) :: parts
    integer, intent(in) :: low(2), high(2), number, stamp(:)
    integer :: i, j

    is_parted = .false.
    do j = low(2), high(2)
      do i = low(1), high(1)
        is_parted = is_parted .or. any(stamp(parts%first(i, j):parts%last(i, j)) /= number)
      end do
    end do
  end function is_parted

  !> The gap between the stamped parts of some elements and the others.
  pure subroutine find_gap(parts, low, high, number, stamp, begin, list, lengths, gap, ends)
    type(region_parts_t), intent(in) :: parts
    integer, intent(in) :: low(2), high(2), number, stamp(:), begin(:), list(:)
    real(wp), intent(in) :: lengths(2)                !! of an element
    real(wp), intent(out) :: gap                      !! in elements
    real(wp), intent(out) :: ends(2, 2)               !! places on both sides
    real(wp), allocatable :: one(:, :), other(:, :)
    real(wp) :: now, nearest(2)
    integer :: i, k, side

    call take_sides(parts, low, high, number, stamp, begin, list, one, other)
    gap = huge(gap)
    ends = 0.0_wp
    do side = 1, 2
      do i = 1, size(one, 2)
        do k = 1, size(other, 2)
          call drop(one(:2, i), other(:, k), lengths, now, nearest)
          if (now >= gap) cycle
          gap = now
          ends(:, 1) = one(:2, i)
          ends(:, 2) = nearest
        end do
      end do
      if (side == 1) call swap(one, other)
    end do
  end subroutine find_gap

  pure subroutine swap(one, other)
    real(wp), allocatable, intent(inout) :: one(:, :), other(:, :)
    real(wp), allocatable :: kept(:, :)

    call move_alloc(one, kept)
    call move_alloc(other, one)
    call move_alloc(kept, other)
  end subroutine swap

  !> Segments of both sides, of very many some.
  pure subroutine take_sides(parts, low, high, number, stamp, begin, list, one, other)
    type(region_parts_t), intent(in) :: parts
    integer, intent(in) :: low(2), high(2), number, stamp(:), begin(:), list(:)
    real(wp), allocatable, intent(out) :: one(:, :), other(:, :)
    integer :: i, j, k, s, n(2), every(2), side, pass

    every = 1
    do pass = 1, 2
      n = 0
      do j = low(2), high(2)
        do i = low(1), high(1)
          do k = parts%first(i, j), parts%last(i, j)
            side = merge(1, 2, stamp(k) == number)
            do s = begin(k), begin(k + 1) - 1, every(side)
              n(side) = n(side) + 1
              if (pass == 1) cycle
              if (side == 1) one(:, n(1)) = parts%segments(:, list(s))
              if (side == 2) other(:, n(2)) = parts%segments(:, list(s))
            end do
          end do
        end do
      end do
      if (pass == 2) exit
      allocate (one(4, n(1)), other(4, n(2)))
      every = 1 + n/most_segments
    end do
    one = one(:, :n(1))
    other = other(:, :n(2))
  end subroutine take_sides

  !> Distance of a place from a segment, in lengths along both axes.
  pure subroutine drop(place, segment, lengths, distance, nearest)
    real(wp), intent(in) :: place(2), segment(4), lengths(2)
    real(wp), intent(out) :: distance, nearest(2)
    real(wp) :: along(2), way(2), t

    along = (segment(3:) - segment(:2))/lengths
    way = (place - segment(:2))/lengths
    t = share_along(way, along)
    distance = norm2(way - t*along)
    nearest = segment(:2) + t*(segment(3:) - segment(:2))
  end subroutine drop

end module outline_slits
