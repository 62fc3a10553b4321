!> Position codes: which faces may be near a point, by one binary search.
!!
!! Space is cut into equal cubes, each with an integer code; the codes of the cubes that faces reach
!! into are kept in rising order. M. Oldenburg and L. Nilsson (1994), Int. J. Numer. Meth. Engng 37;
!! [CA] R. P. R. Cardoso and O. B. Adetoro (2017), sec. 5.1.
module position_code
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use linear_algebra, only: sorted_order
  implicit none
  private

  public :: position_code_t, new_position_code, find_candidates

  integer, parameter :: max_per_direction = 1000   !! keeps every code below 2**31
  integer, parameter :: spare_entries = 65536      !! table entries granted whatever the face count
  integer, parameter :: entries_per_face = 64      !! table entries granted for each face

  !> Occupied cubes of a grid and the faces that reach into each.
  type :: position_code_t
    real(wp) :: corner(3) = 0.0_wp        !! lower corner of the grid [length]
    real(wp) :: size = 1.0_wp             !! edge of a cube [length]
    integer :: n_cubes(3) = 0             !! cubes per direction
    integer, allocatable :: codes(:)      !! codes of the occupied cubes, rising
    integer, allocatable :: first(:)      !! cube i owns faces(first(i):first(i + 1) - 1)
    integer, allocatable :: faces(:)      !! face numbers, rising within a cube
  end type position_code_t

contains

  !> Enter faces by their bounding boxes, each widened by `distance` on all sides.
  !! Cubes are as small as `distance` unless that would make the table too long.
  pure subroutine new_position_code(table, boxes, distance)
    type(position_code_t), intent(out) :: table
    real(wp), intent(in) :: boxes(:, :, :)   !! corners [length], shape (3, 2, n_faces)
    real(wp), intent(in) :: distance         !! reach around each face [length], positive
    integer(int64), allocatable :: keys(:)
    real(wp) :: extent(3)
    integer, allocatable :: ranges(:, :, :)
    integer :: n_faces
    integer(int64) :: n_entries

    n_faces = size(boxes, 3)
    allocate (ranges(3, 2, n_faces))
    table%corner = minval(boxes(:, 1, :), 2) - distance
    extent = maxval(boxes(:, 2, :), 2) + distance - table%corner
    table%size = max(distance, 1.01_wp*maxval(extent)/max_per_direction)
    do
      table%n_cubes = floor(extent/table%size) + 1
      ! Once for both uses: rounded otherwise, a range might come out longer than it was counted.
      call find_ranges(table, boxes, distance, ranges)
      n_entries = count_entries(ranges)
      if (n_entries <= spare_entries + int(entries_per_face, int64)*n_faces) exit
      table%size = 1.5_wp*table%size
    end do
    allocate (keys(n_entries))
    call fill_keys(table, ranges, keys)
    keys = keys(sorted_order(real(keys, wp)))   ! below 2**53, so exact
    call fill_table(table, keys, n_faces)
  end subroutine new_position_code

  !> Faces that may lie within the table's distance of `x`: `table%faces(first:last)`, none where
  !! `last < first`.
  pure subroutine find_candidates(table, x, first, last)
    type(position_code_t), intent(in) :: table
    real(wp), intent(in) :: x(3)          !! point in the frame of the faces [length]
    integer, intent(out) :: first, last
    integer :: cube(3), code, lower, upper, middle

    first = 1
    last = 0
    if (any(x < table%corner) .or. any(x > table%corner + table%size*table%n_cubes)) return
    cube = cube_of(table, x)
    if (any(cube >= table%n_cubes)) return
    code = code_of(table, cube)
    lower = 1
    upper = size(table%codes)
    do while (lower < upper)
      middle = (lower + upper)/2
      if (table%codes(middle) < code) then
        lower = middle + 1
      else
        upper = middle
      end if
    end do
    if (table%codes(lower) /= code) return
    first = table%first(lower)
    last = table%first(lower + 1) - 1
  end subroutine find_candidates

  !> Cube of a point, from 0 in each direction.
  pure function cube_of(table, x) result(cube)
    type(position_code_t), intent(in) :: table
    real(wp), intent(in) :: x(3)
    integer :: cube(3)

    cube = floor((x - table%corner)/table%size)
  end function cube_of

  pure integer function code_of(table, cube) result(code)
    type(position_code_t), intent(in) :: table
    integer, intent(in) :: cube(3)

    code = cube(1) + table%n_cubes(1)*(cube(2) + table%n_cubes(2)*cube(3))
  end function code_of

  !> First and last cubes that widened boxes reach into.
  pure subroutine find_ranges(table, boxes, distance, ranges)
    type(position_code_t), intent(in) :: table
    real(wp), intent(in) :: boxes(:, :, :), distance
    integer, intent(out) :: ranges(:, :, :)   !! shape (3, 2, n_faces)
    integer :: face

    do face = 1, size(boxes, 3)
      ranges(:, 1, face) = max(cube_of(table, boxes(:, 1, face) - distance), 0)
      ranges(:, 2, face) = min(cube_of(table, boxes(:, 2, face) + distance), table%n_cubes - 1)
    end do
  end subroutine find_ranges

  pure integer(int64) function count_entries(ranges) result(n)
    integer, intent(in) :: ranges(:, :, :)
    integer :: face

    n = 0
    do face = 1, size(ranges, 3)
      n = n + product(int(max(ranges(:, 2, face) - ranges(:, 1, face) + 1, 0), int64))
    end do
  end function count_entries

  !> One key per pair of cube and face, ordered like the pair.
  pure subroutine fill_keys(table, ranges, keys)
    type(position_code_t), intent(in) :: table
    integer, intent(in) :: ranges(:, :, :)
    integer(int64), intent(out) :: keys(:)
    integer :: face, i, j, k, n, n_faces

    n = 0
    n_faces = size(ranges, 3)
    do face = 1, n_faces
      associate (low => ranges(:, 1, face), high => ranges(:, 2, face))
        do k = low(3), high(3)
          do j = low(2), high(2)
            do i = low(1), high(1)
              n = n + 1
              keys(n) = int(code_of(table, [i, j, k]), int64)*n_faces + face - 1
            end do
          end do
        end do
      end associate
    end do
  end subroutine fill_keys

  !> Split sorted keys into codes and the ranges of their faces.
  pure subroutine fill_table(table, keys, n_faces)
    type(position_code_t), intent(inout) :: table
    integer(int64), intent(in) :: keys(:)
    integer, intent(in) :: n_faces
    integer, allocatable :: codes(:)
    integer :: i, n_codes

    allocate (codes, source=int(keys/n_faces))
    table%faces = int(mod(keys, int(n_faces, int64))) + 1
    n_codes = 1 + count(codes(2:) /= codes(:size(codes) - 1))
    allocate (table%codes(n_codes), table%first(n_codes + 1))
    n_codes = 0
    do i = 1, size(codes)
      if (n_codes > 0) then
        if (codes(i) == table%codes(n_codes)) cycle
      end if
      n_codes = n_codes + 1
      table%codes(n_codes) = codes(i)
      table%first(n_codes) = i
    end do
    table%first(n_codes + 1) = size(codes) + 1
  end subroutine fill_table

end module position_code
