!> Surfaces cut into pieces along wavy lines of their parameter plane, for measurements and tests of
!! trimmed tools.
module cut_dies
  use kinds, only: wp
  use failure, only: error_t
  use nurbs_surface, only: nurbs_surface_t
  use refinement, only: reverse_axis
  use trim_curve, only: trim_curve_t, trim_loop_t, reversed_curve
  use trim_loops, only: trim_surface
  implicit none
  private

  public :: cut_pieces, circle

contains

  !> Pieces n(1) x n(2) of a surface, each the surface with a loop of four cubics that leave the
  !! lines of a regular grid by `wave` of its meshes; every third piece runs the other way round.
  subroutine cut_pieces(surface, n, wave, pieces, error)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: n(2)
    real(wp), intent(in) :: wave
    type(nurbs_surface_t), allocatable, intent(out) :: pieces(:)
    type(error_t), allocatable, intent(out) :: error
    type(trim_loop_t) :: loop
    integer :: i, j, k

    allocate (pieces(product(n)), loop%curves(4))
    do j = 1, n(2)
      do i = 1, n(1)
        k = i + (j - 1)*n(1)
        loop%curves(1) = side([i - 1, j - 1], [1, 0])
        loop%curves(2) = side([i, j - 1], [0, 1])
        loop%curves(3) = reversed_curve(side([i - 1, j], [1, 0]))
        loop%curves(4) = reversed_curve(side([i - 1, j - 1], [0, 1]))
        pieces(k) = surface
        call trim_surface(pieces(k), [loop], .true., 1.0e-6_wp, error)
        if (allocated(error)) return
        if (mod(k, 3) == 2) call reverse_axis(pieces(k), 1 + mod(k, 2))
      end do
    end do

  contains

    !> Side of a mesh from a corner of the grid on; those on the border are straight.
    function side(from, step) result(curve)
      integer, intent(in) :: from(2), step(2)
      type(trim_curve_t) :: curve
      real(wp) :: at(2), low(2), length(2), off
      integer :: m, d

      curve%degree = 3
      do d = 1, 2
        low(d) = surface%axes(d)%knots(1)
        length(d) = surface%axes(d)%knots(size(surface%axes(d)%knots)) - low(d)
      end do
      d = merge(2, 1, step(1) == 1)     ! across
      do m = 0, 3
        off = 0.0_wp
        if ((m == 1 .or. m == 2) .and. from(d) > 0 .and. from(d) < n(d)) &
          off = wave*merge(1, -1, m == 1)*(1 + 0.3_wp*mod(from(1) + 2*from(2), 3))
        at = from + step*m/3.0_wp
        at(d) = at(d) + off
        curve%c(:, m) = [low + length*at/n, 1.0_wp]
      end do
    end function side

  end subroutine cut_pieces

  !> Circle of four rational arcs.
  function circle(centre, radius) result(loop)
    real(wp), intent(in) :: centre(2), radius
    type(trim_loop_t) :: loop
    real(wp), parameter :: corners(2, 5) = reshape([1, 0, 0, 1, -1, 0, 0, -1, 1, 0], [2, 5])
    integer :: i

    allocate (loop%curves(4))
    do i = 1, 4
      loop%curves(i)%degree = 2
      loop%curves(i)%c(:, 0) = [centre + radius*corners(:, i), 1.0_wp]
      loop%curves(i)%c(:, 1) = [centre + radius*(corners(:, i) + corners(:, i + 1)), 1.0_wp] &
                               *sqrt(0.5_wp)
      loop%curves(i)%c(:, 2) = [centre + radius*corners(:, i + 1), 1.0_wp]
    end do
  end function circle

end module cut_dies
