!> Area and box of a surface, of a trimmed one those of what its loops leave.
!!
!! The area is an integral along the loops (Green's theorem): with F(u, v) that of the element of
!! area along u from the begin of the knots, it is the integral of F dv.
module face_extent
  use kinds, only: wp
  use linear_algebra, only: cross
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use surface_grid, only: lines
  use surface_trim, only: trim_t, new_trim, is_inside
  use trim_curve, only: trim_loop_t, evaluate_curve, curve_point
  use trim_loops, only: rectangle_loop
  implicit none
  private

  public :: face_area, face_box

  integer, parameter :: n_along = 6      !! points of a piece of a loop and of a knot span
  integer, parameter :: n_places = 8     !! of a piece of a loop, for the box
  integer, parameter :: n_grid = 48      !! along a surface, for the box, but
  integer, parameter :: most_parts = 16  !! at most so many of a knot span

  !> The knot lines of a surface.
  type :: knot_lines_t
    real(wp), allocatable :: u(:), v(:)
  end type knot_lines_t

contains

  !> Area. Loops have what counts on their left, as `trim_surface` makes them.
  pure real(wp) function face_area(surface) result(area)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_t) :: trim
    type(knot_lines_t) :: knot_lines
    type(gauss_rule_t) :: rule
    real(wp) :: at(2), d1(2), d2(2)
    integer :: i, g

    trim = trim_of(surface)
    knot_lines = knot_lines_t(lines(surface%axes(1), 1), lines(surface%axes(2), 1))
    rule = new_gauss_rule(n_along, 1)
    area = 0.0_wp
    do i = 1, size(trim%pieces)
      associate (piece => trim%pieces(i))
        do g = 1, rule%n
          call evaluate_curve(piece%curve, 0.5_wp*(1.0_wp + rule%points(g)), at, d1, d2)
          if (.not. abs(d1(2)) > 0.0_wp) cycle   ! along u
          area = area + 0.5_wp*rule%weights(g)*d1(2) &
                 *strip_to(surface, knot_lines, rule, piece%span, at)
        end do
      end associate
    end do
  end function face_area

  !> Corners of a box around a surface: of points of its loops and of a grid, so that it may be too
  !! small by what the surface rises between them.
  pure function face_box(surface) result(box)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp) :: box(3, 2)                !! least and largest coordinates
    type(trim_t) :: trim
    type(knot_lines_t) :: knot_lines
    real(wp) :: local(2)
    integer :: parts(2), i, j, k, span

    trim = trim_of(surface)
    knot_lines = knot_lines_t(lines(surface%axes(1), 1), lines(surface%axes(2), 1))
    box(:, 1) = huge(1.0_wp)
    box(:, 2) = -huge(1.0_wp)
    do i = 1, size(trim%pieces)
      do k = 0, n_places
        local = curve_point(trim%pieces(i)%curve, real(k, wp)/n_places)
        call include_place(surface, knot_lines, trim%pieces(i)%span, local, box)
      end do
    end do
    parts = min(max(n_grid/trim%n, 1), most_parts)
    do span = 1, size(trim%root)
      if (trim%root(span) < 0) cycle
      do j = 0, parts(2)
        do i = 0, parts(1)
          local = [real(i, wp), real(j, wp)]/parts
          if (is_inside(trim, span, local)) &
            call include_place(surface, knot_lines, span, local, box)
        end do
      end do
    end do
  end function face_box

  !> The trim of a surface; without loops its border.
  pure function trim_of(surface) result(trim)
    type(nurbs_surface_t), intent(in) :: surface
    type(trim_t) :: trim
    type(trim_loop_t) :: border(1)

    if (allocated(surface%loops)) then
      call new_trim(trim, surface%axes, surface%loops)
    else
      border(1) = rectangle_loop(surface)
      call new_trim(trim, surface%axes, border)
    end if
  end function trim_of

  !> Integral of the element of area along u up to a place, per local v of the span.
  pure real(wp) function strip_to(surface, knot_lines, rule, span, local) result(strip)
    type(nurbs_surface_t), intent(in) :: surface
    type(knot_lines_t), intent(in) :: knot_lines
    type(gauss_rule_t), intent(in) :: rule
    integer, intent(in) :: span            !! axis 1 fastest
    real(wp), intent(in) :: local(2)
    real(wp) :: end, at(2), x(3), d1(3, 2), side(2)
    integer :: last, i, g

    strip = 0.0_wp
    last = mod(span - 1, size(knot_lines%u) - 1) + 1
    do i = 1, last
      end = merge(local(1), 1.0_wp, i == last)
      do g = 1, rule%n
        call place_of(knot_lines, span - last + i, &
                      [0.5_wp*(1.0_wp + rule%points(g))*end, local(2)], at, side)
        call evaluate_surface(surface, at, x, d1)
        strip = strip + 0.5_wp*rule%weights(g)*end*product(side)*norm2(cross(d1(:, 1), d1(:, 2)))
      end do
    end do
  end function strip_to

  !> Enlarge a box by a place of a span.
  pure subroutine include_place(surface, knot_lines, span, local, box)
    type(nurbs_surface_t), intent(in) :: surface
    type(knot_lines_t), intent(in) :: knot_lines
    integer, intent(in) :: span            !! axis 1 fastest
    real(wp), intent(in) :: local(2)
    real(wp), intent(inout) :: box(3, 2)
    real(wp) :: at(2), x(3), side(2)

    call place_of(knot_lines, span, local, at, side)
    call evaluate_surface(surface, at, x)
    box(:, 1) = min(box(:, 1), x)
    box(:, 2) = max(box(:, 2), x)
  end subroutine include_place

  !> Parameters of a place in a span, and the sides of the span.
  pure subroutine place_of(knot_lines, span, local, at, side)
    type(knot_lines_t), intent(in) :: knot_lines
    integer, intent(in) :: span            !! axis 1 fastest
    real(wp), intent(in) :: local(2)
    real(wp), intent(out) :: at(2), side(2)
    integer :: i, j

    i = mod(span - 1, size(knot_lines%u) - 1) + 1
    j = (span - 1)/(size(knot_lines%u) - 1) + 1
    side = [knot_lines%u(i + 1) - knot_lines%u(i), knot_lines%v(j + 1) - knot_lines%v(j)]
    at = [knot_lines%u(i), knot_lines%v(j)] + min(max(local, 0.0_wp), 1.0_wp)*side
  end subroutine place_of

end module face_extent
