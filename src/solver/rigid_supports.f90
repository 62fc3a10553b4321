!> Rigid motions of a body that its supports leave, and the fewest components of control points that
!! hold them. A trim may leave several pieces, each with rigid motions of its own.
module rigid_supports
  use kinds, only: wp
  use knot_vector, only: span_table
  use element, only: part_t, element_t
  use vibration, only: fixed_t
  implicit none
  private

  public :: hold_rigid_motions

  !> What constraints have taken from the six rigid motions: an orthonormal basis.
  type :: taken_t
    integer :: n = 0
    real(wp) :: basis(6, 6) = 0.0_wp
  end type taken_t

  real(wp), parameter :: least = 1.0e-6_wp         !! of a motion that counts as held

contains

  !> Hold what is free, each time the component that the rigid motions left move most: points well
  !! apart.
  subroutine hold_rigid_motions(parts, fixed, n_added)
    type(part_t), intent(in) :: parts(:)
    type(fixed_t), intent(inout) :: fixed(:)
    integer, intent(out), optional :: n_added
    integer, allocatable :: piece(:, :)
    real(wp) :: centre(3), length
    integer :: k, n

    call find_extent(parts, centre, length)
    call find_pieces(parts(1)%element, piece)
    n = 0
    do k = 1, max(1, maxval(piece))
      call hold_piece(parts, piece, k, centre, length, fixed, n)
    end do
    if (present(n_added)) n_added = n
  end subroutine hold_rigid_motions

  !> The same of one piece.
  subroutine hold_piece(parts, piece, k, centre, length, fixed, n_added)
    type(part_t), intent(in) :: parts(:)
    integer, intent(in) :: piece(:, :), k            !! of the control points; the one to hold
    real(wp), intent(in) :: centre(3), length        !! of the body
    type(fixed_t), intent(inout) :: fixed(:)
    integer, intent(inout) :: n_added
    type(taken_t) :: taken
    real(wp) :: rest(6), largest
    integer :: p, i, best(2)

    call take_supports()
    do while (taken%n < 6)
      largest = 0.0_wp
      best = 0
      do p = 1, size(parts)
        do i = 1, size(fixed(p)%is_fixed)
          if (.not. (is_leader(fixed(p), i) .and. is_in_piece(parts(p), i, piece, k))) cycle
          rest = remainder(taken, rigid_row(parts(p), i, centre, length))
          if (norm2(rest) <= largest*(1.0_wp + 1.0e-9_wp)) cycle
          largest = norm2(rest)
          best = [p, i]
        end do
      end do
      if (largest <= least) exit   ! all on one line
      call hold(best(2), shape(fixed(best(1))%is_fixed), fixed(best(1))%is_fixed)
      call take(taken, rigid_row(parts(best(1)), best(2), centre, length))
      n_added = n_added + 1
    end do

  contains

    subroutine take_supports()
      logical, allocatable :: held(:)

      do p = 1, size(parts)
        held = reshape(fixed(p)%is_fixed, [size(fixed(p)%is_fixed)])
        do i = 1, size(held)
          if (taken%n == 6) return
          if (.not. is_in_piece(parts(p), i, piece, k)) cycle
          if (held(i)) call take(taken, rigid_row(parts(p), i, centre, length))
          if (is_leader(fixed(p), i)) cycle
          call take(taken, rigid_row(parts(p), i, centre, length) &
                           - rigid_row(parts(p), fixed(p)%leader(i), centre, length))
        end do
      end do
    end subroutine take_supports
  end subroutine hold_piece

  !> Number of the piece of a trimmed sheet that each control point moves with, 0 for those without
  !! motion of their own. Elements belong together that share a control point.
  pure subroutine find_pieces(element, piece)
    class(element_t), intent(in) :: element
    integer, allocatable, intent(out) :: piece(:, :)     !! without an outline of shape (0, 0)
    integer, allocatable :: of(:, :)                     ! elements
    integer, allocatable :: spans1(:), spans2(:)
    integer :: queue(2, product(element%n_elements(:2))), i, j, n, done, last, low(2), high(2)

    if (.not. allocated(element%ties%is_free)) then
      allocate (piece(0, 0))
      return
    end if
    associate (share => element%ties%share, axes => element%grid%axes)
      spans1 = span_table(axes(1))
      spans2 = span_table(axes(2))
      allocate (of(size(share, 1), size(share, 2)), source=0)
      n = 0
      do j = 1, size(share, 2)
        do i = 1, size(share, 1)
          if (share(i, j) <= 0.0_wp .or. of(i, j) > 0) cycle
          n = n + 1
          of(i, j) = n
          queue(:, 1) = [i, j]
          done = 0
          last = 1
          do while (done < last)
            done = done + 1
            call add_neighbours(share, axes%degree, queue(:, done), n, of, queue, last)
          end do
        end do
      end do
      allocate (piece(size(element%ties%is_free, 1), size(element%ties%is_free, 2)), source=0)
      do j = 1, size(share, 2)
        do i = 1, size(share, 1)
          low = [spans1(i), spans2(j)] - axes(:2)%degree
          high = low + axes(:2)%degree
          if (of(i, j) > 0) piece(low(1):high(1), low(2):high(2)) = of(i, j)
        end do
      end do
      where (.not. element%ties%is_free) piece = 0
    end associate
  end subroutine find_pieces

  pure logical function is_leader(fixed, i)
    type(fixed_t), intent(in) :: fixed
    integer, intent(in) :: i

    is_leader = .true.
    if (allocated(fixed%leader)) is_leader = fixed%leader(i) == i
  end function is_leader

  !> Elements not met yet that share a control point with one.
  pure subroutine add_neighbours(share, degrees, at, number, of, queue, last)
    real(wp), intent(in) :: share(:, :)
    integer, intent(in) :: degrees(3), at(2), number
    integer, intent(inout) :: of(:, :), queue(:, :), last
    integer :: i, j

    do j = max(1, at(2) - degrees(2)), min(size(share, 2), at(2) + degrees(2))
      do i = max(1, at(1) - degrees(1)), min(size(share, 1), at(1) + degrees(1))
        if (share(i, j) <= 0.0_wp .or. of(i, j) > 0) cycle
        of(i, j) = number
        last = last + 1
        queue(:, last) = [i, j]
      end do
    end do
  end subroutine add_neighbours

  !> Does a control point move with a piece? At the edge of an outline some follow others.
  pure logical function is_in_piece(part, place, piece, k)
    type(part_t), intent(in) :: part
    integer, intent(in) :: place                   !! of a component in the field as one list
    integer, intent(in) :: piece(:, :), k
    integer :: n(3), layer

    is_in_piece = size(piece) == 0
    if (is_in_piece) return
    n = shape(part%element%mass)
    layer = mod(place - 1, n(1)*n(2))
    is_in_piece = piece(mod(layer, n(1)) + 1, layer/n(1) + 1) == k
  end function is_in_piece

  pure subroutine hold(place, n, is_fixed)
    integer, intent(in) :: place, n(4)
    logical, intent(inout) :: is_fixed(product(n))

    is_fixed(place) = .true.
  end subroutine hold

  pure subroutine find_extent(parts, centre, length)
    type(part_t), intent(in) :: parts(:)
    real(wp), intent(out) :: centre(3), length
    real(wp) :: low(3), high(3)
    integer :: p, c

    low = huge(low)
    high = -huge(high)
    do p = 1, size(parts)
      do c = 1, 3
        low(c) = min(low(c), minval(parts(p)%element%motion%x(:, :, :, c)))
        high(c) = max(high(c), maxval(parts(p)%element%motion%x(:, :, :, c)))
      end do
    end do
    centre = 0.5_wp*(low + high)
    length = max(norm2(high - low), tiny(length))
  end subroutine find_extent

  !> What the rigid motions move a component by: three translations, three rotations about the
  !! centre with their arms over the length.
  pure function rigid_row(part, place, centre, length) result(row)
    type(part_t), intent(in) :: part
    integer, intent(in) :: place                   !! in the field as one list
    real(wp), intent(in) :: centre(3), length
    real(wp) :: row(6), x(3)
    integer :: n(4), i, c, at(3)

    n = shape(part%element%motion%x)
    i = mod(place - 1, product(n(:3)))
    c = (place - 1)/product(n(:3)) + 1
    at = [mod(i, n(1)) + 1, mod(i/n(1), n(2)) + 1, i/(n(1)*n(2)) + 1]
    x = (part%element%motion%x(at(1), at(2), at(3), :) - centre)/length
    row = 0.0_wp
    row(c) = 1.0_wp
    row(4 + mod(c, 3)) = x(mod(c + 1, 3) + 1)      ! about the next axis
    row(4 + mod(c + 1, 3)) = -x(mod(c, 3) + 1)     ! about the one after it
  end function rigid_row

  pure function remainder(taken, row) result(rest)
    type(taken_t), intent(in) :: taken
    real(wp), intent(in) :: row(6)
    real(wp) :: rest(6)
    integer :: k, pass

    rest = row
    do pass = 1, 2
      do k = 1, taken%n
        rest = rest - dot_product(taken%basis(:, k), rest)*taken%basis(:, k)
      end do
    end do
  end function remainder

  pure subroutine take(taken, row)
    type(taken_t), intent(inout) :: taken
    real(wp), intent(in) :: row(6)
    real(wp) :: rest(6)

    if (taken%n == 6) return
    rest = remainder(taken, row)
    if (norm2(rest) <= least) return
    taken%n = taken%n + 1
    taken%basis(:, taken%n) = rest/norm2(rest)
  end subroutine take

end module rigid_supports
