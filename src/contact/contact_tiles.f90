!> Rectangles of secondary points, the units of work of a contact, the same for any number of
!! threads; and the control points of a face, now and at the call before: their motion against the
!! tool.
module contact_tiles
  use kinds, only: wp
  use omp_lib, only: omp_get_max_threads
  use secondary_surface, only: secondary_surface_t
  implicit none
  private

  public :: face_motion_t, new_face_motion, advance_motion, carry_rows, tile_t, cut_tiles, &
            carry_tiles, tile_positions, list_due, earliest_test, is_worth_threads

  !> Two states of a face, one after the other; arrays by control point.
  type :: face_motion_t
    logical :: is_started = .false.            !! whether `now` holds a state
    real(wp) :: displacement(3) = 0.0_wp       !! of the tool now [length]
    real(wp) :: moved(3) = 0.0_wp              !! its motion since the state before [length]
    real(wp), allocatable :: now(:, :, :)      !! control points, shape (n1, n2, 3) [length]
    real(wp), allocatable :: before(:, :, :)   !! [length]
    real(wp), allocatable :: squares(:, :)     !! of their motions against the tool [length^2]
  end type face_motion_t

  !> Most points of a tile along each direction: few, so that idle ones are skipped, and as many
  !! across as along, so that a line of contact fills the lanes in whichever direction it runs.
  integer, parameter, public :: tile_size = 8

  !> What is worth a parallel region: more tiles to check, or more points to test.
  integer, parameter :: parallel_tiles = 60, parallel_points = 500

  !> Points first ... last along each direction of the grid of secondary points.
  type :: tile_t
    integer :: first(2) = 0, last(2) = 0
    integer :: net_first(2) = 0, net_last(2) = 0   !! control points that move them
    integer :: diagonal = 0            !! sum of its places along both directions
    real(wp) :: step = 0.0_wp          !! bound of their motion against the tool in the last step
    real(wp) :: travel = 0.0_wp        !! the same so far [length]
    real(wp) :: test_at = 0.0_wp       !! travel at which one of them must be tested again [length]
  end type tile_t

contains

  !> No state yet.
  pure subroutine new_face_motion(motion, n)
    type(face_motion_t), intent(out) :: motion
    integer, intent(in) :: n(2)    !! control points

    allocate (motion%now(n(1), n(2), 3), motion%before(n(1), n(2), 3), source=0.0_wp)
    allocate (motion%squares(n(1), n(2)), source=0.0_wp)
  end subroutine new_face_motion

  !> What was now is before; the first state knows no motion. `carry_rows` brings the new one.
  pure subroutine advance_motion(motion, displacement, x)
    type(face_motion_t), intent(inout) :: motion
    real(wp), intent(in) :: displacement(3)   !! of the tool [length]
    real(wp), intent(in) :: x(:, :, :)        !! control points now [length]
    real(wp), allocatable :: room(:, :, :)

    if (motion%is_started) then
      motion%moved = displacement - motion%displacement
      call move_alloc(motion%before, room)
      call move_alloc(motion%now, motion%before)
      call move_alloc(room, motion%now)
    else
      motion%before = x
    end if
    motion%displacement = displacement
  end subroutine advance_motion

  !> Take the control points; the threads of a region divide their rows. Little is stored, as each
  !! store waits for memory that the elements have pushed out of the nearest cache.
  subroutine carry_rows(motion, rows, x)
    type(face_motion_t), intent(inout) :: motion
    integer, intent(in) :: rows(2)            !! first and last that are known
    real(wp), intent(in) :: x(:, :, :)        !! control points now [length]
    integer :: j

    !$omp do schedule(static)
    do j = max(1, rows(1)), min(size(x, 2), rows(2))
      call carry_row(size(motion%squares, 1), motion%moved, x(:, j, :), motion%before(:, j, :), &
                     motion%now(:, j, :), motion%squares(:, j))
    end do
    !$omp end do
  end subroutine carry_rows

  !> One row.
  pure subroutine carry_row(n, moved, x, before, now, squares)
    integer, intent(in) :: n
    real(wp), intent(in) :: moved(3), x(:, :), before(:, :)
    real(wp), intent(inout) :: now(:, :)
    real(wp), intent(out) :: squares(n)
    integer :: i

    !$omp simd
    do i = 1, n
      now(i, 1) = x(i, 1)
      now(i, 2) = x(i, 2)
      now(i, 3) = x(i, 3)
      squares(i) = (x(i, 1) - before(i, 1) - moved(1))**2 + (x(i, 2) - before(i, 2) - moved(2))**2 &
                   + (x(i, 3) - before(i, 3) - moved(3))**2
    end do
  end subroutine carry_row

  !> Cut the points of a face into tiles of nearly equal size.
  pure function cut_tiles(secondary) result(tiles)
    type(secondary_surface_t), intent(in) :: secondary
    type(tile_t), allocatable :: tiles(:)
    integer :: i, j, n_along(2), n_parts(2)

    n_along = secondary%n_along
    n_parts = (n_along + tile_size - 1)/tile_size
    allocate (tiles(product(n_parts)))
    do j = 1, n_parts(2)
      do i = 1, n_parts(1)
        associate (tile => tiles(i + n_parts(1)*(j - 1)))
          tile%diagonal = i + j
          tile%first = ([i, j] - 1)*n_along/n_parts + 1
          tile%last = [i, j]*n_along/n_parts
          tile%net_first = [secondary%lines(1)%first(tile%first(1)), &
                            secondary%lines(2)%first(tile%first(2))]
          tile%net_last = [secondary%lines(1)%first(tile%last(1)), &
                           secondary%lines(2)%first(tile%last(2))] + secondary%lines%degree
        end associate
      end do
    end do
  end function cut_tiles

  !> Is there more than one thread, and enough for it to do if about as many points are due as last
  !! time?
  logical function is_worth_threads(n_points, is_due)
    integer, intent(in) :: n_points
    logical, intent(in) :: is_due(:)    !! tiles that were due at the last call

    is_worth_threads = omp_get_max_threads() > 1
    if (is_worth_threads .and. size(is_due) <= parallel_tiles) &
      is_worth_threads = count(is_due)*n_points > parallel_points*size(is_due)
  end function is_worth_threads

  !> Take the control points of the present, and let the travel of each tile grow by their largest
  !! motion. The threads of a region divide the rows of control points, then the tiles; each reads
  !! little of what another has written.
  subroutine carry_tiles(tiles, motion, rows, x, is_due)
    type(tile_t), intent(inout) :: tiles(:)
    type(face_motion_t), intent(inout) :: motion   !! that has taken its turn
    integer, intent(in) :: rows(2)                 !! first and last that are known, and no tile
                                                   !! with others is due
    real(wp), intent(in) :: x(:, :, :)             !! control points now [length]
    logical, intent(inout) :: is_due(size(tiles))  !! set: must a point be tested now?
    real(wp) :: most(size(motion%squares, 1)), square
    integer :: i, j, t, band

    call carry_rows(motion, rows, x)
    band = 0
    !$omp do schedule(static)
    do t = 1, size(tiles)
      associate (tile => tiles(t), low => tiles(t)%net_first, high => tiles(t)%net_last)
        is_due(t) = low(2) >= rows(1) .and. high(2) <= rows(2)
        if (.not. is_due(t)) cycle
        ! Tiles of a band across have one maximum along it.
        if (tile%first(2) /= band) then
          most = motion%squares(:, low(2))
          do j = low(2) + 1, high(2)
            most = max(most, motion%squares(:, j))
          end do
          band = tile%first(2)
        end if
        square = 0.0_wp
        do i = low(1), high(1)
          square = max(square, most(i))
        end do
        tile%step = sqrt(square)
        tile%travel = tile%travel + tile%step
        is_due(t) = tile%travel >= tile%test_at
      end associate
    end do
    !$omp end do
  end subroutine carry_tiles

  !> Positions of rows of points of a tile.
  pure subroutine tile_positions(tile, secondary, rows, net, positions)
    type(tile_t), intent(in) :: tile
    type(secondary_surface_t), intent(in) :: secondary
    integer, intent(in) :: rows(2)   !! first and last, counted from that of the tile
    real(wp), intent(in) :: net(secondary%n_net(1), secondary%n_net(2), 3)   !! control points
    !> Only `rows` are set; what lies beyond the points of the tile is zero there [length].
    real(wp), intent(inout) :: positions(tile_size, 3, tile_size)
    real(wp) :: along(tile_size, tile%net_last(1) - tile%net_first(1) + 1)
    real(wp) :: part(size(along, 2), 3, tile%net_last(2) - tile%net_first(2) + 1)
    integer :: first(rows(1):rows(2)), low, i, j, c

    call spread_basis(tile, secondary, along)
    associate (across => secondary%lines(2))
      low = across%first(tile%first(2) + rows(1) - 1) - 1
      first = across%first(tile%first(2) + rows(1) - 1:tile%first(2) + rows(2) - 1) - low
      do j = 1, first(rows(2)) + across%degree
        do c = 1, 3
          do i = 1, size(part, 1)
            part(i, c, j) = net(tile%net_first(1) + i - 1, low + j, c)
          end do
          if (secondary%is_rational) part(:, c, j) = &
            part(:, c, j)*secondary%weights(tile%net_first(1):tile%net_last(1), low + j)
        end do
      end do
      call blend_rows(size(along, 2), size(part, 3), rows, first, across%degree + 1, &
                      across%n_points, across%values, tile%first(2) - 1, along, part, positions)
    end associate
    if (.not. secondary%is_rational) return
    do j = rows(1), rows(2)
      do i = 1, tile%last(1) - tile%first(1) + 1
        positions(i, :, j) = positions(i, :, j) &
                             *secondary%inverse_w(tile%first(1) + i - 1, tile%first(2) + j - 1)
      end do
    end do
  end subroutine tile_positions

  !> Basis of the points of a tile along its rows, with the zeros beside its band.
  pure subroutine spread_basis(tile, secondary, along)
    type(tile_t), intent(in) :: tile
    type(secondary_surface_t), intent(in) :: secondary
    real(wp), intent(out) :: along(tile_size, tile%net_last(1) - tile%net_first(1) + 1)
    integer :: i, j, k, before

    along = 0.0_wp
    do i = 1, tile%last(1) - tile%first(1) + 1
      j = tile%first(1) + i - 1
      before = secondary%lines(1)%first(j) - tile%net_first(1)
      do k = 1, secondary%lines(1)%degree + 1
        along(i, before + k) = secondary%lines(1)%values(j, k)
      end do
    end do
  end subroutine spread_basis

  !> Rows of points from the rows of control points about them.
  pure subroutine blend_rows(n1, n2, rows, first, n, n_values, across, before, along, part, &
                             positions)
    integer, intent(in) :: n1, n2                     !! control points
    integer, intent(in) :: rows(2)                    !! first and last
    integer, intent(in) :: first(rows(1):rows(2))     !! control points of each row
    integer, intent(in) :: n, n_values                !! functions of a point, points of the face
    real(wp), intent(in) :: across(n_values, n)       !! basis across the rows
    integer, intent(in) :: before                     !! rows of the face before these
    real(wp), intent(in) :: along(tile_size, n1), part(n1, 3, n2)
    real(wp), intent(inout) :: positions(tile_size, 3, tile_size)
    real(wp) :: line(n1, 3), row(tile_size, 3)
    integer :: i, j, k

    do j = rows(1), rows(2)
      line = across(before + j, 1)*part(:, :, first(j))
      do k = 2, n
        line = line + across(before + j, k)*part(:, :, first(j) + k - 1)
      end do
      row = 0.0_wp
      do k = 1, n1
        !$omp simd
        do i = 1, tile_size
          row(i, 1) = row(i, 1) + line(k, 1)*along(i, k)
          row(i, 2) = row(i, 2) + line(k, 2)*along(i, k)
          row(i, 3) = row(i, 3) + line(k, 3)*along(i, k)
        end do
      end do
      positions(:, :, j) = row
    end do
  end subroutine blend_rows

  !> Points of a tile that must be tested now.
  pure subroutine list_due(tile, n_along, test_at, n, points, places)
    type(tile_t), intent(in) :: tile
    integer, intent(in) :: n_along(2)
    real(wp), intent(in) :: test_at(:)   !! travel, of all points [length]
    integer, intent(out) :: n
    integer, intent(out) :: points(tile_size**2)   !! numbers on the face, in the first n
    integer, intent(out) :: places(tile_size**2)   !! of their x in `tile_positions`
    integer :: row, i, before

    n = 0
    do row = tile%first(2), tile%last(2)
      before = (row - 1)*n_along(1) + tile%first(1) - 1
      do i = 1, tile%last(1) - tile%first(1) + 1
        points(n + 1) = before + i   ! no branch, which would be guessed wrong at each point found
        places(n + 1) = (row - tile%first(2))*3*tile_size + i
        n = n + merge(1, 0, tile%travel >= test_at(before + i))
      end do
    end do
  end subroutine list_due

  !> Least travel at which a point of the tile must be tested.
  pure real(wp) function earliest_test(tile, n_along, test_at) result(earliest)
    type(tile_t), intent(in) :: tile
    integer, intent(in) :: n_along(2)
    real(wp), intent(in) :: test_at(:)   !! of all points [length]
    integer :: row, point

    earliest = huge(1.0_wp)
    do row = tile%first(2), tile%last(2)
      !$omp simd reduction(min: earliest)
      do point = (row - 1)*n_along(1) + tile%first(1), (row - 1)*n_along(1) + tile%last(1)
        earliest = min(earliest, test_at(point))
      end do
    end do
  end function earliest_test

end module contact_tiles
