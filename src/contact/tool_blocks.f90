!> Blocks of faces: where small gentle faces join smoothly, many of them make one cell, so that the
!! cost of a search depends on the shape of a tool and not on how finely it is knotted.
!!
!! A block is at most twice the search distance long. All its faces are gentle, no knot line in it
!! breaks the tangent plane, and the tangents along xi and along eta each stay within a narrow cone,
!! so that a point has one closest place in the block and a search that holds at its border finds
!! it.
module tool_blocks
  use kinds, only: wp
  use contact_territory, only: contact_territory_t
  use tool_cells, only: cell_t, cell_list_t, cut_face, append, enclose, is_gentle_face
  implicit none
  private

  public :: cut_surface

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
    integer, allocatable :: n_breaks_1(:), n_breaks_2(:)   !! breaks before each face, along an axis
  end type sheet_t

contains

  !> Append the cells of a surface.
  pure subroutine cut_surface(cells, before, n, hulls, distance)
    type(cell_list_t), intent(inout) :: cells
    integer, intent(in) :: before           !! faces of the surfaces before this one
    integer, intent(in) :: n(2)             !! faces along xi and eta
    real(wp), intent(in) :: hulls(:, :, :, :)   !! Bezier points, homogeneous, (4, p1, p2, n faces)
    real(wp), intent(in) :: distance        !! of the search [length]
    type(sheet_t) :: sheet
    type(contact_territory_t) :: territory
    real(wp) :: box(3, 2)
    integer :: i, j, face

    sheet%before = before
    sheet%n = n
    sheet%distance = distance
    allocate (sheet%is_gentle(n(1), n(2)), sheet%n_breaks_1(n(1)), sheet%n_breaks_2(n(2)))
    do j = 1, n(2)
      do i = 1, n(1)
        face = i + (j - 1)*n(1)
        call enclose(hulls(:, :, :, face), territory, box)
        sheet%is_gentle(i, j) = is_gentle_face(hulls(:, :, :, face), territory, distance)
      end do
    end do
    sheet%n_breaks_1(1) = 0
    do i = 2, n(1)
      sheet%n_breaks_1(i) = sheet%n_breaks_1(i - 1) + merge(0, 1, &
        all([(is_smooth(hulls(:, :, :, i - 1 + j*n(1)), hulls(:, :, :, i + j*n(1)), 1), &
              j=0, n(2) - 1)]))
    end do
    sheet%n_breaks_2(1) = 0
    do j = 2, n(2)
      sheet%n_breaks_2(j) = sheet%n_breaks_2(j - 1) + merge(0, 1, &
        all([(is_smooth(hulls(:, :, :, i + (j - 2)*n(1)), hulls(:, :, :, i + (j - 1)*n(1)), 2), &
              i=1, n(1))]))
    end do
    call divide(cells, sheet, hulls, [1, 1], n)
  end subroutine cut_surface

  !> Append a range of faces as one block, or its halves. Breaks of the tangent plane come first.
  pure recursive subroutine divide(cells, sheet, hulls, low, high)
    type(cell_list_t), intent(inout) :: cells
    type(sheet_t), intent(in) :: sheet
    real(wp), intent(in) :: hulls(:, :, :, :)
    integer, intent(in) :: low(2), high(2)  !! first and last face along xi and eta
    integer :: middle(2), d
    real(wp) :: along(3, 2)

    if (all(low == high)) then
      call cut_face(cells, sheet%before + low(1) + (low(2) - 1)*sheet%n(1), &
                    hulls(:, :, :, low(1) + (low(2) - 1)*sheet%n(1)), sheet%distance)
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
      corners(:, 1, 1) = place_of(hulls(:, 1, 1, low(1) + (low(2) - 1)*n))
      corners(:, 2, 1) = place_of(hulls(:, p, 1, high(1) + (low(2) - 1)*n))
      corners(:, 1, 2) = place_of(hulls(:, 1, q, low(1) + (high(2) - 1)*n))
      corners(:, 2, 2) = place_of(hulls(:, p, q, high(1) + (high(2) - 1)*n))
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
    is_block = sheet%n_breaks_1(high(1)) == sheet%n_breaks_1(low(1)) &
               .and. sheet%n_breaks_2(high(2)) == sheet%n_breaks_2(low(2)) &
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
    real(wp) :: points(3, size(hull, 2), size(hull, 3)), leg(3)
    integer :: i, j

    is_within = .true.
    do j = 1, size(hull, 3)
      do i = 1, size(hull, 2)
        points(:, i, j) = place_of(hull(:, i, j))
        if (i > 1) then
          leg = points(:, i, j) - points(:, i - 1, j)
          is_within = is_within .and. dot_product(leg, unit(:, 1)) >= cone*norm2(leg)
        end if
        if (j > 1) then
          leg = points(:, i, j) - points(:, i, j - 1)
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

  !> Whether two faces share their tangent planes along the edge where the first ends along axis
  !! `d` and the second begins: legs across it point the same way and are in one ratio.
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
      into = (place_of(rows(:, 2)) - place_of(rows(:, 1)))*rows(4, 1)
      out = (place_of(rows(:, 3)) - place_of(rows(:, 2)))*rows(4, 3)
      ratio = norm2(out)/max(norm2(into), tiny(1.0_wp))
      if (k == 1) first = ratio
      is_smooth = is_smooth .and. norm2(out - ratio*into) <= same_direction*norm2(out) &
                  .and. abs(ratio - first) <= same_ratio*first
    end do
  end function is_smooth

  !> Place of a homogeneous point.
  pure function place_of(h) result(x)
    real(wp), intent(in) :: h(4)
    real(wp) :: x(3)

    x = h(:3)/h(4)
  end function place_of

end module tool_blocks
