!> The parts of a region in the cells of a grid, and which of them hang together across the lines of
!! the grid.
!!
!! The borders are cut at the lines. In a cell each piece enters and leaves; from where it leaves,
!! counter-clockwise along the border of the cell, what counts goes on to the next piece that enters
!! (K. Weiler and P. Atherton, Hidden surface removal using polygon area sorting, Comput. Graph. 11
!! (1977) 214-222). Each closed walk is one part, so slits of any width are seen.
module region_parts
  use kinds, only: wp
  use bucket_lists, only: sort_into_buckets
  use outline, only: polygon_t, region_t, signed_area
  implicit none
  private

  public :: find_parts, find_groups

  !> Parts, and the segments of the borders in the cells.
  type, public :: region_parts_t
    integer :: n = 0
    integer, allocatable :: cell(:, :)       !! of each part, shape (2, n)
    integer, allocatable :: begin(:)         !! of its neighbours in `links`, shape (n + 1)
    integer, allocatable :: links(:)         !! parts that it hangs together with
    integer, allocatable :: first(:, :)      !! part of each cell from which on its parts are listed
    integer, allocatable :: last(:, :)       !! and up to which
    real(wp), allocatable :: segments(:, :)  !! both ends, shape (4, n_segments)
    integer, allocatable :: owner(:)         !! part that each of them bounds; 0: none
  end type region_parts_t

  !> Borders cut at the lines, what counts on their left.
  type :: pieces_t
    integer :: n = 0                         !! segments
    real(wp), allocatable :: ends(:, :)      !! shape (4, n)
    integer, allocatable :: cell(:, :)       !! shape (2, n); 0 or too large: beyond the grid
    integer :: n_chains = 0                  !! segments that follow each other in a cell
    integer, allocatable :: chain(:)         !! of each segment
    integer, allocatable :: at(:, :)         !! cell of each chain, shape (2, n_chains)
    !> Places on the border of the cell, 0 to 4 counter-clockwise from its lower left corner; of a
    !! closed one -1.
    real(wp), allocatable :: enter(:), leave(:)
    logical, allocatable :: is_hole(:)       !! of a closed one
  end type pieces_t

  !> Where a part lies on the border of its cell.
  type :: interval_t
    integer :: part = 0
    real(wp) :: from = 0.0_wp, to = 0.0_wp   !! from < to <= from + 4
  end type interval_t

  real(wp), parameter :: aside = 1.23456789e-7_wp   !! of a cell: the lines are moved off borders

contains

  !> Find the parts. Cells of which nothing counts for other reasons have none.
  subroutine find_parts(region, lines1, lines2, share, parts)
    type(region_t), intent(in) :: region
    real(wp), intent(in) :: lines1(:), lines2(:)       !! of the grid, rising
    real(wp), intent(in) :: share(:, :)                !! of each cell that counts
    type(region_parts_t), intent(out) :: parts
    type(pieces_t) :: pieces
    type(interval_t), allocatable :: intervals(:)
    integer, allocatable :: begin(:), list(:)          ! chains of each cell
    real(wp), allocatable :: x(:), y(:)
    integer :: n(2), n_most

    n = shape(share)
    x = moved_lines(lines1)
    y = moved_lines(lines2)
    call cut_borders(region, x, y, pieces)
    call sort_chains(pieces, n, begin, list)
    n_most = product(n) + pieces%n_chains
    allocate (parts%cell(2, n_most), intervals(n_most))
    allocate (parts%first(n(1), n(2)), parts%last(n(1), n(2)))
    allocate (parts%owner(pieces%n), source=0)
    call walk_cells(pieces, begin, list, share, parts, intervals)
    parts%segments = pieces%ends(:, :pieces%n)
    call link_parts(intervals, parts)
  end subroutine find_parts

  !> Number what hangs together.
  pure subroutine find_groups(parts, group, n)
    type(region_parts_t), intent(in) :: parts
    integer, allocatable, intent(out) :: group(:)      !! of each part
    integer, intent(out) :: n
    integer :: queue(parts%n), first, at, last, k

    allocate (group(parts%n), source=0)
    n = 0
    do first = 1, parts%n
      if (group(first) > 0) cycle
      n = n + 1
      group(first) = n
      queue(1) = first
      last = 1
      at = 0
      do while (at < last)
        at = at + 1
        do k = parts%begin(queue(at)), parts%begin(queue(at) + 1) - 1
          if (group(parts%links(k)) > 0) cycle
          last = last + 1
          queue(last) = parts%links(k)
          group(queue(last)) = n
        end do
      end do
    end do
  end subroutine find_groups

  !> Lines that no border runs along. What runs along the edges of the grid lies beyond these.
  pure function moved_lines(lines) result(moved)
    real(wp), intent(in) :: lines(:)
    real(wp) :: moved(size(lines))

    real(wp) :: little

    little = aside*(lines(size(lines)) - lines(1))/(size(lines) - 1)
    moved = lines + little
    moved(size(lines)) = lines(size(lines)) - little
  end function moved_lines

  !> The cell between lines that has a coordinate; 0 below, their number above all.
  pure integer function cell_of(lines, x) result(cell)
    real(wp), intent(in) :: lines(:), x
    integer :: high, middle

    cell = 0
    high = size(lines) + 1
    do while (high - cell > 1)
      middle = (cell + high)/2
      if (lines(middle) <= x) then
        cell = middle
      else
        high = middle
      end if
    end do
  end function cell_of

  !> Cut all polygons at the lines, and list the chains.
  subroutine cut_borders(region, x, y, pieces)
    type(region_t), intent(in) :: region
    real(wp), intent(in) :: x(:), y(:)
    type(pieces_t), intent(out) :: pieces
    real(wp), allocatable :: corners(:, :)
    integer :: p, i, m, most

    most = 0
    do p = 1, size(region%polygons)
      associate (c => region%polygons(p)%corners)
        m = size(c, 2)
        do i = 1, m
          most = most + 1 + abs(cell_of(x, c(1, i)) - cell_of(x, c(1, mod(i, m) + 1))) &
                 + abs(cell_of(y, c(2, i)) - cell_of(y, c(2, mod(i, m) + 1)))
        end do
      end associate
    end do
    allocate (pieces%ends(4, most), pieces%cell(2, most), pieces%chain(most))
    allocate (pieces%at(2, most), pieces%enter(most), pieces%leave(most), pieces%is_hole(most))
    do p = 1, size(region%polygons)
      corners = region%polygons(p)%corners
      if (region%is_outside) corners = corners(:, size(corners, 2):1:-1)
      call cut_polygon(corners, x, y, pieces)
    end do
  end subroutine cut_borders

  !> Segments of one polygon. They begin where it comes to another cell, if it does.
  subroutine cut_polygon(corners, x, y, pieces)
    real(wp), intent(in) :: corners(:, :), x(:), y(:)
    type(pieces_t), intent(inout) :: pieces
    integer :: i, m, before, turn

    before = pieces%n
    m = size(corners, 2)
    do i = 1, m
      call cut_segment(corners(:, i), corners(:, mod(i, m) + 1), x, y, pieces)
    end do
    associate (n => pieces%n, cell => pieces%cell)
      do turn = before + 1, n
        i = merge(n, turn - 1, turn == before + 1)
        if (any(cell(:, turn) /= cell(:, i))) exit
      end do
      if (turn > n) then
        call add_loop(corners, before, pieces)
        return
      end if
      turn = turn - before - 1
      pieces%ends(:, before + 1:n) = cshift(pieces%ends(:, before + 1:n), turn, 2)
      cell(:, before + 1:n) = cshift(cell(:, before + 1:n), turn, 2)
      do i = before + 1, n
        if (i > before + 1) then
          if (all(cell(:, i) == cell(:, i - 1))) then
            pieces%chain(i) = pieces%n_chains
            cycle
          end if
          call end_chain(i - 1, x, y, pieces)
        end if
        pieces%n_chains = pieces%n_chains + 1
        pieces%chain(i) = pieces%n_chains
        pieces%at(:, pieces%n_chains) = cell(:, i)
        pieces%enter(pieces%n_chains) = place_on_border(pieces%ends(:2, i), cell(:, i), x, y)
      end do
      call end_chain(n, x, y, pieces)
    end associate
  end subroutine cut_polygon

  pure subroutine end_chain(segment, x, y, pieces)
    integer, intent(in) :: segment
    real(wp), intent(in) :: x(:), y(:)
    type(pieces_t), intent(inout) :: pieces

    pieces%leave(pieces%n_chains) = place_on_border(pieces%ends(3:, segment), &
                                                    pieces%cell(:, segment), x, y)
  end subroutine end_chain

  !> A polygon all of which lies in one cell.
  subroutine add_loop(corners, before, pieces)
    real(wp), intent(in) :: corners(:, :)
    integer, intent(in) :: before                      !! segments of those before
    type(pieces_t), intent(inout) :: pieces

    pieces%n_chains = pieces%n_chains + 1
    associate (c => pieces%n_chains)
      pieces%chain(before + 1:pieces%n) = c
      pieces%at(:, c) = pieces%cell(:, before + 1)
      pieces%enter(c) = -1.0_wp
      pieces%leave(c) = -1.0_wp
      pieces%is_hole(c) = signed_area(corners) < 0.0_wp
    end associate
  end subroutine add_loop

  !> The pieces of a segment between the lines that it crosses, in their order.
  subroutine cut_segment(a, b, x, y, pieces)
    real(wp), intent(in) :: a(2), b(2), x(:), y(:)
    type(pieces_t), intent(inout) :: pieces
    real(wp) :: from(2), to(2), t, next
    integer :: at(2), goal(2), axis, d

    at = [cell_of(x, a(1)), cell_of(y, a(2))]
    goal = [cell_of(x, b(1)), cell_of(y, b(2))]
    from = a
    do
      axis = 0
      t = huge(t)
      do d = 1, 2
        if (at(d) == goal(d)) cycle
        next = (line_ahead(d) - a(d))/(b(d) - a(d))
        if (next >= t) cycle
        t = next
        axis = d
      end do
      to = b
      if (axis > 0) then
        to = a + t*(b - a)
        to(axis) = line_ahead(axis)
      end if
      pieces%n = pieces%n + 1
      pieces%ends(:, pieces%n) = [from, to]
      pieces%cell(:, pieces%n) = at
      if (axis == 0) exit
      at(axis) = at(axis) + merge(1, -1, goal(axis) > at(axis))
      from = to
    end do

  contains

    !> The line that the segment crosses next along an axis.
    pure real(wp) function line_ahead(d)
      integer, intent(in) :: d
      integer :: i

      i = at(d) + merge(1, 0, goal(d) > at(d))
      if (d == 1) line_ahead = x(i)
      if (d == 2) line_ahead = y(i)
    end function line_ahead

  end subroutine cut_segment

  !> Where on the border of a cell a place on one of its lines lies, see `pieces_t`.
  pure real(wp) function place_on_border(place, cell, x, y) result(s)
    real(wp), intent(in) :: place(2), x(:), y(:)
    integer, intent(in) :: cell(2)
    real(wp) :: u, v

    s = 0.0_wp
    if (any(cell < 1) .or. cell(1) >= size(x) .or. cell(2) >= size(y)) return
    u = (place(1) - x(cell(1)))/(x(cell(1) + 1) - x(cell(1)))
    v = (place(2) - y(cell(2)))/(y(cell(2) + 1) - y(cell(2)))
    select case (minloc(abs([v, u - 1.0_wp, v - 1.0_wp, u]), 1))
    case (1)
      s = u
    case (2)
      s = 1.0_wp + v
    case (3)
      s = 3.0_wp - u
    case default
      s = 4.0_wp - v
    end select
  end function place_on_border

  !> Chains of each cell of the grid, one cell after the other along the first axis.
  pure subroutine sort_chains(pieces, n, begin, list)
    type(pieces_t), intent(in) :: pieces
    integer, intent(in) :: n(2)                        !! cells
    integer, allocatable, intent(out) :: begin(:)      !! of each cell in the list, and its end
    integer, allocatable, intent(out) :: list(:)
    integer :: first(pieces%n_chains), last(pieces%n_chains), c

    do c = 1, pieces%n_chains
      associate (at => pieces%at(:, c))
        first(c) = at(1) + n(1)*(at(2) - 1)
        last(c) = first(c)
        if (all(at >= 1 .and. at <= n)) cycle
        first(c) = 1                                   ! beyond the grid: in none
        last(c) = 0
      end associate
    end do
    call sort_into_buckets(product(n), first, last, begin, list)
  end subroutine sort_chains

  !> List the parts of all cells, with their places on the borders of these.
  subroutine walk_cells(pieces, begin, list, share, parts, intervals)
    type(pieces_t), intent(in) :: pieces
    integer, intent(in) :: begin(:), list(:)
    real(wp), intent(in) :: share(:, :)
    type(region_parts_t), intent(inout) :: parts
    type(interval_t), allocatable, intent(inout) :: intervals(:)
    integer, allocatable :: part_of(:)                 ! of each chain
    integer :: i, j, number, n_intervals, k

    allocate (part_of(pieces%n_chains), source=0)
    n_intervals = 0
    do j = 1, size(share, 2)
      do i = 1, size(share, 1)
        number = i + size(share, 1)*(j - 1)
        parts%first(i, j) = parts%n + 1
        if (share(i, j) > 0.0_wp) call walk_cell(list(begin(number):begin(number + 1) - 1))
        parts%last(i, j) = parts%n
      end do
    end do
    do k = 1, pieces%n
      parts%owner(k) = part_of(pieces%chain(k))
    end do
    intervals = intervals(:n_intervals)
    parts%cell = parts%cell(:, :parts%n)

  contains

    subroutine walk_cell(chains)
      integer, intent(in) :: chains(:)                 ! of the cell
      logical :: has_hole, has_border
      integer :: c, now, next

      has_border = .false.
      has_hole = size(chains) == 0
      do c = 1, size(chains)
        if (pieces%enter(chains(c)) < 0.0_wp) then
          has_hole = has_hole .or. pieces%is_hole(chains(c))
          if (.not. pieces%is_hole(chains(c))) call begin_part(chains(c))
          cycle
        end if
        has_border = .true.
        if (part_of(chains(c)) > 0) cycle
        now = chains(c)
        do
          if (now == chains(c)) call begin_part(now)
          part_of(now) = parts%n
          next = next_chain(pieces, chains, now)
          call add_interval(pieces%leave(now), pieces%leave(now) + modulo(pieces%enter(next) &
                            - pieces%leave(now), 4.0_wp))
          now = next
          if (part_of(now) > 0) exit
        end do
      end do
      if (has_border .or. .not. has_hole) return
      call begin_part(0)
      call add_interval(0.0_wp, 4.0_wp)
    end subroutine walk_cell

    subroutine begin_part(chain)
      integer, intent(in) :: chain                     ! 0: none

      parts%n = parts%n + 1
      parts%cell(:, parts%n) = [i, j]
      if (chain > 0) part_of(chain) = parts%n
    end subroutine begin_part

    subroutine add_interval(from, to)
      real(wp), intent(in) :: from, to

      n_intervals = n_intervals + 1
      intervals(n_intervals) = interval_t(parts%n, from, to)
    end subroutine add_interval

  end subroutine walk_cells

  !> The chain of a cell that enters first after where one leaves.
  pure integer function next_chain(pieces, chains, now) result(next)
    type(pieces_t), intent(in) :: pieces
    integer, intent(in) :: chains(:), now
    real(wp) :: way, best
    integer :: c

    next = now
    best = huge(best)
    do c = 1, size(chains)
      if (pieces%enter(chains(c)) < 0.0_wp) cycle
      way = modulo(pieces%enter(chains(c)) - pieces%leave(now), 4.0_wp)
      if (way >= best) cycle
      best = way
      next = chains(c)
    end do
  end function next_chain

  !> Parts of neighbouring cells hang together where their intervals on the common line overlap.
  subroutine link_parts(intervals, parts)
    type(interval_t), intent(in) :: intervals(:)       !! in the order of the parts
    type(region_parts_t), intent(inout) :: parts
    integer, allocatable :: first(:), last(:), pairs(:, :), owners(:), others(:), order(:)
    integer :: k, i, j, m, pass

    allocate (first(parts%n + 1), last(parts%n + 1))
    first = 1
    last = 0
    do k = size(intervals), 1, -1
      first(intervals(k)%part) = k
    end do
    do k = 1, size(intervals)
      last(intervals(k)%part) = k
    end do
    do pass = 1, 2
      m = 0
      do j = 1, size(parts%first, 2)
        do i = 1, size(parts%first, 1)
          if (i < size(parts%first, 1)) call link_cells([i, j], [i + 1, j], 1)
          if (j < size(parts%first, 2)) call link_cells([i, j], [i, j + 1], 2)
        end do
      end do
      if (pass == 1) allocate (pairs(2, m))
    end do
    owners = reshape(pairs, [2*m])
    call sort_into_buckets(parts%n, owners, owners, parts%begin, order)
    others = reshape(pairs([2, 1], :), [2*m])
    parts%links = others(order)

  contains

    subroutine link_cells(one, other, axis)
      integer, intent(in) :: one(2), other(2), axis    ! other: the next one along the axis
      integer :: a, b, u, v

      do a = parts%first(one(1), one(2)), parts%last(one(1), one(2))
        search: do b = parts%first(other(1), other(2)), parts%last(other(1), other(2))
          do u = first(a), last(a)
            do v = first(b), last(b)
              if (.not. do_overlap(intervals(u), intervals(v), axis)) cycle
              m = m + 1
              if (pass == 2) pairs(:, m) = [a, b]
              cycle search
            end do
          end do
        end do search
      end do
    end subroutine link_cells

  end subroutine link_parts

  !> Do an interval of a cell and one of the next cell along an axis have more than a point of their
  !! common line in common?
  pure logical function do_overlap(one, other, axis)
    type(interval_t), intent(in) :: one, other
    integer, intent(in) :: axis
    real(wp), parameter :: nothing = 1.0e-9_wp         ! of a cell
    real(wp) :: a(2), b(2)
    integer :: k, l

    do_overlap = .false.
    do k = 0, 1
      ! Along the line in the sense of its axis; the other cell has it the other way round.
      a = [max(one%from, axis + 4.0_wp*k), min(one%to, axis + 1.0_wp + 4.0_wp*k)] - axis - 4.0_wp*k
      if (axis == 2) a = 1.0_wp - a([2, 1])
      do l = 0, 1
        associate (side => merge(3.0_wp, 0.0_wp, axis == 1) + 4.0_wp*l)
          b = [max(other%from, side), min(other%to, side + 1.0_wp)] - side
        end associate
        if (axis == 1) b = 1.0_wp - b([2, 1])
        do_overlap = do_overlap .or. min(a(2), b(2)) - max(a(1), b(1)) > nothing
      end do
    end do
  end function do_overlap

end module region_parts
