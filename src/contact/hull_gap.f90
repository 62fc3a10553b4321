!> Bounds of the distance of two convex hulls.
!!
!! For any unit vector d the hulls are at least min p.d - max q.d apart. Good vectors are known
!! beforehand or come nearer and nearer to the best one: that from the nearest point of all
!! differences p - q to the origin (E. G. Gilbert, SIAM J. Control 4, 1966).
module hull_gap
  use kinds, only: wp
  implicit none
  private

  public :: bound_gap, box_gap

  integer, parameter :: max_steps = 30
  real(wp), parameter :: same = 0.01_wp      !! of the distance, too little to go on for

contains

  !> A lower bound of the distance between the hull of points p and that of points q + shift.
  pure subroutine bound_gap(p, q, shift, seeds, enough, bound, across)
    real(wp), intent(in) :: p(:, :), q(:, :)     !! [length], shape (3, n)
    real(wp), intent(in) :: shift(3)             !! [length]
    real(wp), intent(in) :: seeds(:, :)          !! unit vectors of either sign to try first, (3, n)
    real(wp), intent(in) :: enough               !! no more is asked of the bound [length]
    real(wp), intent(out) :: bound               !! not negative [length]
    real(wp), intent(out) :: across(3)           !! unit vector that it holds along, from q to p
    real(wp) :: v(3), w(3), d(3), length, along
    integer :: i

    v = sum(p, 2)/size(p, 2) - sum(q, 2)/size(q, 2) - shift
    bound = 0.0_wp
    across = v/max(norm2(v), tiny(1.0_wp))
    do i = 1, size(seeds, 2) + max_steps
      if (i <= size(seeds, 2)) then
        d = sign(1.0_wp, dot_product(v, seeds(:, i)))*seeds(:, i)
      else
        length = norm2(v)
        ! The hulls are no farther apart than `length`.
        if (length - bound <= same*length) return
        d = v/length
      end if
      w = lowest_along(p, q, d) - shift
      along = dot_product(w, d)
      if (along > bound) then
        bound = along
        across = d
      end if
      if (bound >= enough) return
      if (i <= size(seeds, 2)) cycle
      w = v - w
      v = v - min(max(dot_product(v, w)/max(sum(w**2), tiny(1.0_wp)), 0.0_wp), 1.0_wp)*w
    end do
  end subroutine bound_gap

  !> The difference p - q that is lowest along a vector.
  pure function lowest_along(p, q, d) result(lowest)
    real(wp), intent(in) :: p(:, :), q(:, :), d(3)
    real(wp) :: lowest(3)
    real(wp) :: along, least, most
    integer :: j, lower, upper

    lower = 1
    least = huge(1.0_wp)
    do j = 1, size(p, 2)
      along = p(1, j)*d(1) + p(2, j)*d(2) + p(3, j)*d(3)
      if (along >= least) cycle
      least = along
      lower = j
    end do
    upper = 1
    most = -huge(1.0_wp)
    do j = 1, size(q, 2)
      along = q(1, j)*d(1) + q(2, j)*d(2) + q(3, j)*d(3)
      if (along <= most) cycle
      most = along
      upper = j
    end do
    lowest = p(:, lower) - q(:, upper)
  end function lowest_along

  !> Distance of two boxes along x, y and z, the second of which is moved.
  pure real(wp) function box_gap(a, b, shift)
    real(wp), intent(in) :: a(3, 2), b(3, 2)     !! lower and upper corner [length]
    real(wp), intent(in) :: shift(3)             !! [length]

    box_gap = norm2(max(a(:, 1) - b(:, 2) - shift, b(:, 1) + shift - a(:, 2), 0.0_wp))
  end function box_gap

end module hull_gap
