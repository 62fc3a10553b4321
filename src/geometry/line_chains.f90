!> Curves of a plane as lines of straight pieces, and closed loops of lines whose ends meet.
module line_chains
  use kinds, only: wp
  use outline, only: polygon_t, add_polygon
  use trim_curve, only: trim_curve_t, curve_point
  implicit none
  private

  public :: curve_corners, chain_lines

  integer, parameter :: most_halvings = 20        !! of a piece of a curve
  integer, parameter :: least_parts = 4           !! of a piece that is not straight

  !> Why lines make no closed loops.
  type, public :: chain_fault_t
    integer :: line = 0                  !! whose end meets no other, or too many; 0: no fault
    integer :: other = 0                 !! line whose end is nearest, 0: no other is left
    logical :: is_branch = .false.       !! three ends meet
    real(wp) :: place(2) = 0.0_wp        !! of the end
    real(wp) :: gap = 0.0_wp             !! to the nearest end
  end type chain_fault_t

contains

  !> Corners of a line along Bezier pieces that follow each other, from begin to end. It lies off
  !! them by less than a tolerance, as three points of each part show.
  pure subroutine curve_corners(curves, tolerance, corners)
    type(trim_curve_t), intent(in) :: curves(:)
    real(wp), intent(in) :: tolerance                     !! [length]
    real(wp), allocatable, intent(out) :: corners(:, :)   !! shape (2, n)
    real(wp), allocatable :: room(:, :)
    integer :: n, i, k, n_parts

    allocate (room(2, 256))
    n = 1
    room(:, 1) = curve_point(curves(1), 0.0_wp)
    do i = 1, size(curves)
      n_parts = merge(1, least_parts, is_straight(curves(i)))
      do k = 1, n_parts
        call add_part(curves(i), real(k - 1, wp)/n_parts, real(k, wp)/n_parts, &
                      merge(0, most_halvings, n_parts == 1), tolerance, n, room)
      end do
    end do
    corners = room(:, :n)
  end subroutine curve_corners

  pure logical function is_straight(curve)
    type(trim_curve_t), intent(in) :: curve

    is_straight = curve%degree == 1
  end function is_straight

  !> The corners after the begin of a part.
  pure recursive subroutine add_part(curve, from, to, n_halvings, tolerance, n, room)
    type(trim_curve_t), intent(in) :: curve
    real(wp), intent(in) :: from, to, tolerance
    integer, intent(in) :: n_halvings                     !! that are left
    integer, intent(inout) :: n
    real(wp), allocatable, intent(inout) :: room(:, :)
    real(wp), allocatable :: grown(:, :)
    real(wp) :: a(2), b(2), x(2), off, along
    integer :: i

    a = curve_point(curve, from)
    b = curve_point(curve, to)
    off = 0.0_wp
    do i = 1, merge(3, 0, n_halvings > 0)
      x = curve_point(curve, from + 0.25_wp*i*(to - from)) - a
      along = dot_product(x, b - a)/max(sum((b - a)**2), tiny(along))
      off = max(off, norm2(x - min(max(along, 0.0_wp), 1.0_wp)*(b - a)))
    end do
    if (off > tolerance) then
      call add_part(curve, from, 0.5_wp*(from + to), n_halvings - 1, tolerance, n, room)
      call add_part(curve, 0.5_wp*(from + to), to, n_halvings - 1, tolerance, n, room)
      return
    end if
    if (n == size(room, 2)) then
      allocate (grown(2, 2*n))
      grown(:, :n) = room
      call move_alloc(grown, room)
    end if
    n = n + 1
    room(:, n) = b
  end subroutine add_part

  !> Closed loops of lines that may run either way and be in any order. Ends that are no farther
  !! apart than the tolerance meet, and become the end of the line that comes first.
  pure subroutine chain_lines(lines, tolerance, loops, fault, first)
    type(polygon_t), intent(in) :: lines(:)          !! from their first corner to their last
    real(wp), intent(in) :: tolerance                !! [length]
    type(polygon_t), allocatable, intent(out) :: loops(:)
    type(chain_fault_t), intent(out) :: fault
    integer, allocatable, intent(out) :: first(:)    !! line with which each loop begins
    logical :: is_used(size(lines)), is_turned
    real(wp), allocatable :: corners(:, :)
    real(wp) :: gap
    integer :: i, next, last

    allocate (loops(0), first(0))
    is_used = .false.
    do i = 1, size(lines)
      if (is_used(i) .or. is_short(lines(i)%corners, tolerance)) cycle
      is_used(i) = .true.
      corners = lines(i)%corners
      last = i
      do
        gap = norm2(corners(:, size(corners, 2)) - corners(:, 1))
        if (gap <= tolerance) exit
        call find_next(lines, is_used, corners(:, size(corners, 2)), tolerance, next, is_turned, &
                       fault)
        if (fault%is_branch .or. next == 0 .or. fault%gap > tolerance) then
          fault%line = last
          fault%place = corners(:, size(corners, 2))
          if (next == 0 .or. gap < fault%gap) then
            fault%other = i
            fault%gap = gap
          end if
          return
        end if
        is_used(next) = .true.
        last = next
        call append(lines(next)%corners, is_turned, corners)
      end do
      call add_polygon(loops, corners(:, :size(corners, 2) - 1))
      first = [first, i]
    end do
  end subroutine chain_lines

  !> Is a line too short to be a curve of its own? It may be a part of one, or lie in its gap.
  pure logical function is_short(corners, tolerance)
    real(wp), intent(in) :: corners(:, :), tolerance

    is_short = all(maxval(corners, 2) - minval(corners, 2) <= tolerance)
  end function is_short

  !> The nearest end of the lines that are left; a branch where two lines begin or end there. Short
  !! lines are no branches, as both of their ends are near.
  pure subroutine find_next(lines, is_used, place, tolerance, next, is_turned, fault)
    type(polygon_t), intent(in) :: lines(:)
    logical, intent(in) :: is_used(:)
    real(wp), intent(in) :: place(2), tolerance
    integer, intent(out) :: next                     !! 0: none is left
    logical, intent(out) :: is_turned                !! its end is nearer than its begin
    type(chain_fault_t), intent(inout) :: fault
    real(wp) :: gaps(2)
    integer :: i, n_near

    next = 0
    n_near = 0
    is_turned = .false.
    fault%gap = huge(fault%gap)
    do i = 1, size(lines)
      if (is_used(i)) cycle
      associate (corners => lines(i)%corners)
        gaps = [norm2(corners(:, 1) - place), norm2(corners(:, size(corners, 2)) - place)]
      end associate
      if (minval(gaps) <= tolerance .and. .not. is_short(lines(i)%corners, tolerance)) &
        n_near = n_near + 1
      if (minval(gaps) >= fault%gap) cycle
      next = i
      is_turned = gaps(2) < gaps(1)
      fault%gap = minval(gaps)
      fault%other = i
    end do
    fault%is_branch = n_near > 1
  end subroutine find_next

  pure subroutine append(more, is_turned, corners)
    real(wp), intent(in) :: more(:, :)
    logical, intent(in) :: is_turned
    real(wp), allocatable, intent(inout) :: corners(:, :)
    real(wp), allocatable :: longer(:, :)
    integer :: n, m

    n = size(corners, 2)
    m = size(more, 2)
    allocate (longer(2, n + m - 1))
    longer(:, :n) = corners
    if (is_turned) longer(:, n + 1:) = more(:, m - 1:1:-1)
    if (.not. is_turned) longer(:, n + 1:) = more(:, 2:)
    call move_alloc(longer, corners)
  end subroutine append

end module line_chains
