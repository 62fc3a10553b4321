!> Loops in the parameter plane, and a count of turns around a position, for tests of trims.
module trim_shapes
  use kinds, only: wp
  use trim_curve, only: trim_curve_t, trim_loop_t, straight_curve, spline_curves, curve_point
  implicit none
  private

  public :: circle_loop, polygon_loop, spline_loop, turns_around

contains

  !> Circle of four rational arcs, counter-clockwise.
  function circle_loop(centre, radius) result(loop)
    real(wp), intent(in) :: centre(2), radius
    type(trim_loop_t) :: loop
    real(wp) :: from(2), middle(2), to(2)
    integer :: i

    allocate (loop%curves(4))
    do i = 1, 4
      from = direction(i)
      to = direction(i + 1)
      middle = from + to
      loop%curves(i)%degree = 2
      loop%curves(i)%c(:, 0) = [centre + radius*from, 1.0_wp]
      loop%curves(i)%c(:, 1) = [centre + radius*middle, 1.0_wp]*sqrt(0.5_wp)
      loop%curves(i)%c(:, 2) = [centre + radius*to, 1.0_wp]
    end do

  contains

    pure function direction(k)
      integer, intent(in) :: k
      real(wp) :: direction(2)

      select case (modulo(k - 1, 4))
      case (0); direction = [1.0_wp, 0.0_wp]
      case (1); direction = [0.0_wp, 1.0_wp]
      case (2); direction = [-1.0_wp, 0.0_wp]
      case default; direction = [0.0_wp, -1.0_wp]
      end select
    end function direction

  end function circle_loop

  !> Straight pieces between corners, shape (2, n).
  function polygon_loop(corners) result(loop)
    real(wp), intent(in) :: corners(:, :)
    type(trim_loop_t) :: loop
    integer :: i

    allocate (loop%curves(size(corners, 2)))
    do i = 1, size(corners, 2)
      loop%curves(i) = straight_curve(corners(:, i), corners(:, modulo(i, size(corners, 2)) + 1))
    end do
  end function polygon_loop

  !> A closed B-spline curve with simple knots that winds around `centre` with `n` waves.
  function spline_loop(degree, n_points, centre, radius, wave, n_waves, unevenness) result(loop)
    integer, intent(in) :: degree, n_points, n_waves
    real(wp), intent(in) :: centre(2), radius, wave
    real(wp), intent(in) :: unevenness   !! of the weights, below 1
    type(trim_loop_t) :: loop
    real(wp), parameter :: turn = 2*acos(-1.0_wp)
    real(wp) :: c(3, n_points + degree), angle
    integer :: i

    do i = 1, n_points + degree
      angle = turn*(i - 1)/n_points
      c(3, i) = 1.0_wp + unevenness*cos(3*angle)
      c(:2, i) = c(3, i)*(centre + (radius + wave*cos(n_waves*angle))*[cos(angle), sin(angle)])
    end do
    call spline_curves(degree, [(real(i, wp), i=0, n_points + 2*degree)], c, real(degree, wp), &
                       real(n_points + degree, wp), loop%curves)
  end function spline_loop

  !> How often loops run around a position, by the angle of fine chords; `nearest` is the distance
  !! to the nearest of their ends.
  subroutine turns_around(loops, x, turns, nearest)
    type(trim_loop_t), intent(in) :: loops(:)
    real(wp), intent(in) :: x(2)
    integer, intent(out) :: turns
    real(wp), intent(out) :: nearest
    real(wp), parameter :: turn = 2*acos(-1.0_wp)
    integer, parameter :: n_chords = 100
    real(wp) :: angle, a(2), b(2)
    integer :: i, j, k

    angle = 0.0_wp
    nearest = huge(nearest)
    do i = 1, size(loops)
      do j = 1, size(loops(i)%curves)
        a = curve_point(loops(i)%curves(j), 0.0_wp) - x
        do k = 1, n_chords
          b = curve_point(loops(i)%curves(j), real(k, wp)/n_chords) - x
          angle = angle + atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
          nearest = min(nearest, norm2(b))
          a = b
        end do
      end do
    end do
    turns = nint(angle/turn)
  end subroutine turns_around

end module trim_shapes
