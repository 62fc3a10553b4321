!> Curves in the parameter plane of a surface, as rational Bezier pieces, and loops of them.
!!
!! Algorithms: L. Piegl and W. Tiller, The NURBS Book, 2nd ed., Springer 1997, sections 1.4 and 5.3.
module trim_curve
  use kinds, only: wp
  implicit none
  private

  public :: trim_curve_t, trim_loop_t, straight_curve, spline_curves, evaluate_curve, curve_point, &
            part_of_curve, reversed_curve, monotone_ends, reverse_loop

  integer, parameter, public :: max_trim_degree = 9   !! highest degree of these curves
  integer, parameter :: most_parts = 64               !! monotone parts of one piece

  !> A piece from parameter 0 to 1.
  type :: trim_curve_t
    integer :: degree = 1
    real(wp) :: c(3, 0:max_trim_degree) = 0.0_wp   !! Bezier points (w u, w v, w)
  end type trim_curve_t

  !> Pieces that follow each other. Of a trim: closed, with what counts on the left.
  type :: trim_loop_t
    type(trim_curve_t), allocatable :: curves(:)
  end type trim_loop_t

contains

  !> Straight piece between two positions.
  pure function straight_curve(from, to) result(curve)
    real(wp), intent(in) :: from(2), to(2)
    type(trim_curve_t) :: curve

    curve%c(:, 0) = [from, 1.0_wp]
    curve%c(:, 1) = [to, 1.0_wp]
  end function straight_curve

  !> Bezier pieces of a B-spline curve from `low` to `high`. Knots need not be repeated at the ends.
  pure subroutine spline_curves(degree, knots, c, low, high, curves)
    integer, intent(in) :: degree          !! 1 to `max_trim_degree`
    real(wp), intent(in) :: knots(:)       !! non-decreasing, shape (n + degree + 1)
    real(wp), intent(in) :: c(:, :)        !! control points (w u, w v, w), shape (3, n)
    real(wp), intent(in) :: low, high      !! within the range of the curve
    type(trim_curve_t), allocatable, intent(out) :: curves(:)
    real(wp), parameter :: same = 1.0e-12_wp
    real(wp) :: from, to
    integer :: span, a, n

    allocate (curves(size(c, 2)))
    n = 0
    do span = degree + 1, size(c, 2)
      from = max(knots(span), low)
      to = min(knots(span + 1), high)
      if (to - from <= same*(high - low)) cycle
      n = n + 1
      curves(n)%degree = degree
      do a = 0, degree
        curves(n)%c(:, a) = blossom(degree, knots, c, span, from, to, a)
      end do
    end do
    curves = curves(:n)
  end subroutine spline_curves

  !> Blossom of a span at `degree - n_to` times `from` and `n_to` times `to`, by C. de Boor's rule.
  pure function blossom(degree, knots, c, span, from, to, n_to) result(point)
    integer, intent(in) :: degree, span, n_to
    real(wp), intent(in) :: knots(:), c(:, :), from, to
    real(wp) :: point(3), rows(3, 0:degree), factor, at
    integer :: r, i

    rows = c(:, span - degree:span)
    do r = 1, degree
      at = merge(to, from, r <= n_to)
      do i = degree, r, -1
        associate (low => knots(span - degree + i), high => knots(span + i - r + 1))
          factor = (at - low)/(high - low)
        end associate
        rows(:, i) = (1.0_wp - factor)*rows(:, i - 1) + factor*rows(:, i)
      end do
    end do
    point = rows(:, degree)
  end function blossom

  !> Position and derivatives.
  pure subroutine evaluate_curve(curve, at, point, d1, d2)
    type(trim_curve_t), intent(in) :: curve
    real(wp), intent(in) :: at
    real(wp), intent(out) :: point(2), d1(2), d2(2)
    real(wp) :: rows(3, 0:max_trim_degree), h1(3), h2(3)
    integer :: r, i

    h2 = 0.0_wp
    associate (p => curve%degree)
      rows(:, :p) = curve%c(:, :p)
      do r = 1, p
        if (r == p - 1) h2 = p*(p - 1)*(rows(:, 2) - 2*rows(:, 1) + rows(:, 0))
        if (r == p) h1 = p*(rows(:, 1) - rows(:, 0))
        do i = 0, p - r
          rows(:, i) = (1.0_wp - at)*rows(:, i) + at*rows(:, i + 1)
        end do
      end do
    end associate
    point = rows(:2, 0)/rows(3, 0)
    d1 = (h1(:2) - h1(3)*point)/rows(3, 0)
    d2 = (h2(:2) - 2*h1(3)*d1 - h2(3)*point)/rows(3, 0)
  end subroutine evaluate_curve

  !> Position alone.
  pure function curve_point(curve, at) result(point)
    type(trim_curve_t), intent(in) :: curve
    real(wp), intent(in) :: at
    real(wp) :: point(2), rows(3, 0:max_trim_degree)
    integer :: r

    associate (p => curve%degree)
      rows(:, :p) = curve%c(:, :p)
      do r = 1, p
        rows(:, :p - r) = (1.0_wp - at)*rows(:, :p - r) + at*rows(:, 1:p - r + 1)
      end do
    end associate
    point = rows(:2, 0)/rows(3, 0)
  end function curve_point

  !> The part of a piece between two of its parameters, by the rule of P. de Casteljau.
  pure function part_of_curve(curve, from, to) result(part)
    type(trim_curve_t), intent(in) :: curve
    real(wp), intent(in) :: from, to      !! 0 <= from < to <= 1
    type(trim_curve_t) :: part
    real(wp) :: at
    integer :: r

    part = curve
    associate (p => curve%degree)
      if (to < 1.0_wp) then
        do r = 1, p
          part%c(:, r:p) = (1.0_wp - to)*part%c(:, r - 1:p - 1) + to*part%c(:, r:p)
        end do
      end if
      if (from > 0.0_wp) then
        at = from/to
        do r = 1, p
          part%c(:, :p - r) = (1.0_wp - at)*part%c(:, :p - r) + at*part%c(:, 1:p - r + 1)
        end do
      end if
    end associate
  end function part_of_curve

  !> The piece run from its end to its begin.
  pure function reversed_curve(curve) result(reversed)
    type(trim_curve_t), intent(in) :: curve
    type(trim_curve_t) :: reversed

    reversed = curve
    reversed%c(:, :curve%degree) = curve%c(:, curve%degree:0:-1)
  end function reversed_curve

  !> Run a loop the other way round.
  pure subroutine reverse_loop(loop)
    type(trim_loop_t), intent(inout) :: loop
    integer :: i

    loop%curves = loop%curves(size(loop%curves):1:-1)
    do i = 1, size(loop%curves)
      loop%curves(i) = reversed_curve(loop%curves(i))
    end do
  end subroutine reverse_loop

  !> Parameters between which u and v each do not turn, 0 and 1 included.
  pure subroutine monotone_ends(curve, n, ends)
    type(trim_curve_t), intent(in) :: curve
    integer, intent(out) :: n                        !! parts
    real(wp), intent(out) :: ends(0:most_parts)
    type(trim_curve_t) :: part
    real(wp) :: slopes(2, 0:2*max_trim_degree - 1), at, turn
    real(wp), parameter :: shortest = 1.0e-9_wp, shortest_turn = 1.0e-7_wp
    integer :: d

    n = 0
    ends = 1.0_wp
    ends(0) = 0.0_wp
    do while (ends(n) < 1.0_wp)
      n = n + 1
      if (n == most_parts) return
      do while (ends(n) - ends(n - 1) > shortest)
        part = part_of_curve(curve, ends(n - 1), ends(n))
        call slope_points(part, slopes)
        at = 1.0_wp
        do d = 1, 2
          select case (n_turns(slopes(d, :2*curve%degree - 1)))
          case (0)
            turn = 1.0_wp
          case (1)
            turn = turning_point(slopes(d, :2*curve%degree - 1))
          case default
            turn = 0.5_wp
          end select
          ! A turn found again at the end where the piece was cut is no turn.
          if (turn > shortest_turn .and. turn < 1.0_wp - shortest_turn) at = min(at, turn)
        end do
        if (at >= 1.0_wp) exit
        ends(n) = ends(n - 1) + at*(ends(n) - ends(n - 1))
      end do
    end do
  end subroutine monotone_ends

  !> Bernstein coefficients of U' W - U W' and V' W - V W', which have the signs of u' and v'.
  pure subroutine slope_points(curve, slopes)
    type(trim_curve_t), intent(in) :: curve
    real(wp), intent(out) :: slopes(2, 0:2*max_trim_degree - 1)
    real(wp) :: difference(3)
    integer :: i, j

    slopes = 0.0_wp
    associate (p => curve%degree, c => curve%c)
      do i = 0, p - 1
        difference = c(:, i + 1) - c(:, i)
        do j = 0, p
          slopes(:, i + j) = slopes(:, i + j) + choose(p - 1, i)*choose(p, j) &
            /choose(2*p - 1, i + j)*(difference(:2)*c(3, j) - c(:2, j)*difference(3))
        end do
      end do
    end associate
  end subroutine slope_points

  !> Changes of sign, small values counting as none.
  pure integer function n_turns(values) result(n)
    real(wp), intent(in) :: values(0:)
    real(wp), parameter :: nothing = 1.0e-11_wp
    real(wp) :: last
    integer :: i

    n = 0
    last = 0.0_wp
    do i = 0, ubound(values, 1)
      if (abs(values(i)) <= nothing*maxval(abs(values))) cycle
      if (values(i)*last < 0.0_wp) n = n + 1
      last = sign(1.0_wp, values(i))
    end do
  end function n_turns

  !> The root of a Bernstein polynomial that changes its sign once, by halving.
  pure real(wp) function turning_point(values) result(root)
    real(wp), intent(in) :: values(0:)
    real(wp) :: rows(0:ubound(values, 1)), low, high, first
    integer :: i, r, n

    n = ubound(values, 1)
    first = sign(1.0_wp, values(findloc(abs(values) > 1.0e-11_wp*maxval(abs(values)), .true., 1) &
                                - 1))
    low = 0.0_wp
    high = 1.0_wp
    do i = 1, 60
      root = 0.5_wp*(low + high)
      rows = values
      do r = 1, n
        rows(:n - r) = (1.0_wp - root)*rows(:n - r) + root*rows(1:n - r + 1)
      end do
      if (rows(0)*first > 0.0_wp) then
        low = root
      else
        high = root
      end if
    end do
  end function turning_point

  pure real(wp) function choose(n, k)
    integer, intent(in) :: n, k
    integer :: i

    choose = 1.0_wp
    do i = 1, k
      choose = choose*(n - i + 1)/i
    end do
  end function choose

end module trim_curve
