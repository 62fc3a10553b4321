!> Rigid motions of a body that its supports leave, and the fewest components of control points that
!! hold them.
module rigid_supports
  use kinds, only: wp
  use element, only: part_t
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
    type(taken_t) :: taken
    real(wp) :: centre(3), length, rest(6), largest
    integer :: p, i, best(2), n

    call find_extent(parts, centre, length)
    n = 0
    call take_supports()
    do while (taken%n < 6)
      largest = 0.0_wp
      best = 0
      do p = 1, size(parts)
        do i = 1, size(fixed(p)%is_fixed)
          if (.not. (is_leader(fixed(p), i) .and. is_free(parts(p), i))) cycle
          rest = remainder(taken, rigid_row(parts(p), i, centre, length))
          if (norm2(rest) <= largest*(1.0_wp + 1.0e-9_wp)) cycle
          largest = norm2(rest)
          best = [p, i]
        end do
      end do
      if (largest <= least) exit   ! all on one line
      call hold(best(2), shape(fixed(best(1))%is_fixed), fixed(best(1))%is_fixed)
      call take(taken, rigid_row(parts(best(1)), best(2), centre, length))
      n = n + 1
    end do
    if (present(n_added)) n_added = n

  contains

    subroutine take_supports()
      logical, allocatable :: held(:)

      do p = 1, size(parts)
        held = reshape(fixed(p)%is_fixed, [size(fixed(p)%is_fixed)])
        do i = 1, size(held)
          if (taken%n == 6) return
          if (.not. is_free(parts(p), i)) cycle
          if (held(i)) call take(taken, rigid_row(parts(p), i, centre, length))
          if (is_leader(fixed(p), i)) cycle
          call take(taken, rigid_row(parts(p), i, centre, length) &
                           - rigid_row(parts(p), fixed(p)%leader(i), centre, length))
        end do
      end do
    end subroutine take_supports
  end subroutine hold_rigid_motions

  pure logical function is_leader(fixed, i)
    type(fixed_t), intent(in) :: fixed
    integer, intent(in) :: i

    is_leader = .true.
    if (allocated(fixed%leader)) is_leader = fixed%leader(i) == i
  end function is_leader

  !> Does a control point move for itself? At the edge of an outline some follow others.
  pure logical function is_free(part, place)
    type(part_t), intent(in) :: part
    integer, intent(in) :: place                   !! of a component in the field as one list
    integer :: n(3), layer

    is_free = .true.
    associate (ties => part%element%ties)
      if (.not. allocated(ties%is_free)) return
      n = shape(part%element%mass)
      layer = mod(place - 1, n(1)*n(2))
      is_free = ties%is_free(mod(layer, n(1)) + 1, layer/n(1) + 1)
    end associate
  end function is_free

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
