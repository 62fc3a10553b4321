!> Rectangles of slave points: the units of work of a contact, the same for any number of threads.
module contact_tiles
  use kinds, only: wp
  implicit none
  private

  public :: tile_t, cut_tiles, points_before, earliest_test

  !> Most points of a tile along each direction: few, so that idle ones sleep, and as many across as
  !! along, so that a line of contact fills the lanes whichever way it runs.
  integer, parameter, public :: tile_size = 8

  !> Points first ... last along each direction of the grid of slave points.
  type :: tile_t
    integer :: first(2) = 0, last(2) = 0
    real(wp) :: test_at = 0.0_wp       !! travel at which one of them must be tested again [length]
  end type tile_t

contains

  !> Cut a grid of points into tiles of nearly equal size.
  pure function cut_tiles(n_along) result(tiles)
    integer, intent(in) :: n_along(2)
    type(tile_t), allocatable :: tiles(:)
    integer :: i, j, n_parts(2)

    n_parts = (n_along + tile_size - 1)/tile_size
    allocate (tiles(product(n_parts)))
    do j = 1, n_parts(2)
      do i = 1, n_parts(1)
        associate (tile => tiles(i + n_parts(1)*(j - 1)))
          tile%first = ([i, j] - 1)*n_along/n_parts + 1
          tile%last = [i, j]*n_along/n_parts
        end associate
      end do
    end do
  end function cut_tiles

  !> Points of the grid before the first one in a row of a tile.
  pure integer function points_before(tile, n_along, row) result(before)
    type(tile_t), intent(in) :: tile
    integer, intent(in) :: n_along(2)
    integer, intent(in) :: row   !! of the tile, from 1

    before = (tile%first(2) + row - 2)*n_along(1) + tile%first(1) - 1
  end function points_before

  !> Least travel at which a point of the tile must be tested.
  pure real(wp) function earliest_test(tile, n_along, test_at) result(earliest)
    type(tile_t), intent(in) :: tile
    integer, intent(in) :: n_along(2)
    real(wp), intent(in) :: test_at(:)   !! of all points [length]
    integer :: row, i, before

    earliest = huge(1.0_wp)
    do row = 1, tile%last(2) - tile%first(2) + 1
      before = points_before(tile, n_along, row)
      do i = before + 1, before + tile%last(1) - tile%first(1) + 1
        earliest = min(earliest, test_at(i))
      end do
    end do
  end function earliest_test

end module contact_tiles
