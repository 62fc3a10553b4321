!> Principal values and directions of a symmetric tensor.
module symmetric_eigen
  use kinds, only: wp
  implicit none
  private

  public :: principal_values

contains

  !> Jacobi's rotations (C. G. J. Jacobi, Crelle 30 (1846)), which keep the directions
  !! perpendicular to the last bit, equal values or not.
  pure subroutine principal_values(tensor, values, directions)
    real(wp), intent(in) :: tensor(6)             !! 11 22 33 12 13 23
    real(wp), intent(out) :: values(3)            !! in no order
    real(wp), intent(out) :: directions(3, 3)     !! column i belongs to value i
    integer, parameter :: max_sweeps = 20
    real(wp) :: a(3, 3), small
    integer :: sweep

    a(:, 1) = [tensor(1), tensor(4), tensor(5)]
    a(:, 2) = [tensor(4), tensor(2), tensor(6)]
    a(:, 3) = [tensor(5), tensor(6), tensor(3)]
    directions = 0.0_wp
    do sweep = 1, 3
      directions(sweep, sweep) = 1.0_wp
    end do
    small = 1.0e-17_wp*maxval(abs(tensor))
    do sweep = 1, max_sweeps
      if (max(abs(a(1, 2)), abs(a(1, 3)), abs(a(2, 3))) <= small) exit
      call rotate(a, directions, 1, 2, 3)
      call rotate(a, directions, 1, 3, 2)
      call rotate(a, directions, 2, 3, 1)
    end do
    values = [a(1, 1), a(2, 2), a(3, 3)]
  end subroutine principal_values

  !> Make entry (p, q) zero; r is the third index.
  pure subroutine rotate(a, directions, p, q, r)
    real(wp), intent(inout) :: a(3, 3), directions(3, 3)
    integer, intent(in) :: p, q, r
    real(wp) :: half_cotangent, t, c, s, old, column(3)

    if (.not. abs(a(p, q)) > 0.0_wp) return
    half_cotangent = 0.5_wp*(a(q, q) - a(p, p))/a(p, q)
    t = sign(1.0_wp, half_cotangent)/(abs(half_cotangent) + sqrt(1.0_wp + half_cotangent**2))
    c = 1.0_wp/sqrt(1.0_wp + t*t)
    s = t*c
    a(p, p) = a(p, p) - t*a(p, q)
    a(q, q) = a(q, q) + t*a(p, q)
    a(p, q) = 0.0_wp
    a(q, p) = 0.0_wp
    old = a(p, r)
    a(p, r) = c*old - s*a(q, r)
    a(q, r) = s*old + c*a(q, r)
    a(r, p) = a(p, r)
    a(r, q) = a(q, r)
    column = directions(:, p)
    directions(:, p) = c*column - s*directions(:, q)
    directions(:, q) = s*column + c*directions(:, q)
  end subroutine rotate

end module symmetric_eigen
