!> Closed curves of *BLANK OUTLINE and *TRIM as polygons: corners of lines, arcs and splines.
module outline_curves
  use kinds, only: wp
  use failure, only: error_t, fail
  use input_errors, only: origin_t, error_list_t, add_error
  use text, only: to_text, rounded_text, place_text
  use outline, only: polygon_t, region_t, add_polygon, new_region, signed_area, plane_of, in_space
  use polygon_crossings, only: crossing_t, find_crossing
  use point_spline, only: spline_corners
  use scene, only: outline_spec_t
  implicit none
  private

  public :: end_curve, add_corner, add_arc, arc_through, add_spline, check_curves, &
            check_pieces

  !> Angle between the corners of an arc: they lie off it by less than 1e-8 of its radius.
  real(wp), parameter :: smallest_turn = 2.5e-4_wp
  !> How far corners may lie off a spline, of its extent.
  real(wp), parameter :: off_spline = 1.0e-8_wp
  real(wp), parameter :: one = 1.0e-9_wp      ! of the extent, a distance that is none
  !> Of the extent of all curves: those with a smaller gap touch. Arcs of their size lie off their
  !> corners by less.
  real(wp), parameter :: touch = 1.0e-7_wp
  real(wp), parameter :: pi = acos(-1.0_wp)

  !> Corners of a curve under way.
  type, public :: corners_t
    integer :: n = 0
    real(wp), allocatable :: at(:, :)         !! with room for more, shape (2, any)
  end type corners_t

contains

  !> Close a curve, which may end where it began, and add it to the outline.
  subroutine end_curve(origin, curve, outline, errors)
    type(origin_t), intent(in) :: origin                !! of its last line
    type(corners_t), intent(inout) :: curve             !! empty afterwards
    type(outline_spec_t), intent(inout) :: outline
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: corners(:, :)
    real(wp) :: extent

    if (curve%n == 0) return
    associate (at => curve%at(:, :curve%n))
      extent = maxval(maxval(at, 2) - minval(at, 2))
      if (curve%n > 1 .and. norm2(at(:, curve%n) - at(:, 1)) <= one*extent) curve%n = curve%n - 1
    end associate
    corners = curve%at(:, :curve%n)
    curve%n = 0
    if (.not. abs(signed_area(corners)) > one*extent**2) then
      call refuse_flat(origin, corners, outline%axis, errors)
      return
    end if
    call add_polygon(outline%polygons, corners)
    outline%origins = [outline%origins, origin]
  end subroutine end_curve

  !> A curve whose area is nothing: a line, or loops whose areas cancel each other.
  subroutine refuse_flat(origin, corners, axis, errors)
    type(origin_t), intent(in) :: origin
    real(wp), intent(in) :: corners(:, :)
    integer, intent(in) :: axis
    type(error_list_t), intent(inout) :: errors
    type(polygon_t) :: one_curve(1)
    type(crossing_t) :: found

    one_curve(1)%corners = corners
    call find_crossing(one_curve, 0.0_wp, found)
    if (found%polygons(1) > 0 .and. .not. found%is_touch) then
      call add_error(errors, origin, "a curve that crosses itself at "// &
                     place_text(in_space(found%place, plane_of(axis))), "curves that do not cross")
    else
      call add_error(errors, origin, "a curve without area, which ends on this line: "// &
                     rounded_text(norm2(maxval(corners, 2) - minval(corners, 2)))// &
                     " long, from "//place_text(in_space(corners(:, 1), plane_of(axis))), &
                     "at least three corners that enclose an area")
    end if
  end subroutine refuse_flat

  !> Refuse curves of a keyword that are there twice, that cross, or that touch: what lies inside
  !! would hang together in a point.
  subroutine check_curves(outline, errors)
    type(outline_spec_t), intent(in) :: outline
    type(error_list_t), intent(inout) :: errors
    type(crossing_t) :: found
    character(:), allocatable :: words
    real(wp) :: extent
    integer :: p, a
    logical :: has_twins

    associate (polygons => outline%polygons)
      if (size(polygons) == 0) return
      call refuse_twins(outline, has_twins, errors)
      if (has_twins) return
      extent = maxval([(maxval([(maxval(polygons(p)%corners(a, :)), p=1, size(polygons))]) &
                        - minval([(minval(polygons(p)%corners(a, :)), p=1, size(polygons))]), &
                        a=1, 2)])
      call find_crossing(polygons, touch*extent, found)
    end associate
    if (found%polygons(1) == 0) return
    where (abs(found%place) < touch*extent) found%place = 0.0_wp
    words = trim(merge("touch", "cross", found%is_touch))
    if (found%polygons(1) == found%polygons(2)) then
      words = "a curve that "//words//"es itself"
    else
      words = "curves that "//words
    end if
    words = words//" at "//place_text(in_space(found%place, plane_of(outline%axis)))
    if (found%is_touch) words = words//" (a gap of "//rounded_text(found%gap)//")"
    associate (other => outline%origins(found%polygons(1)), own => outline%origins( &
               found%polygons(2)))
      if (found%polygons(1) /= found%polygons(2)) words = words//", this one and that of "// &
        other%file//":"//to_text(other%line)
      if (found%is_touch) then
        call add_error(errors, own, words, "a gap of more than "//rounded_text(touch*extent)// &
                       ", or one curve around both")
      else
        call add_error(errors, own, words, "curves that do not cross")
      end if
    end associate
  end subroutine check_curves

  !> Refuse curves that leave more pieces than the deck names, whatever the sheet is like: a hole in
  !! a wrong place would be one without a word. The largest are those that are meant. The cut counts
  !! what is left of the sheet; this is known before, also of sheets that are formed first.
  subroutine check_pieces(outline, errors)
    type(outline_spec_t), intent(in) :: outline
    type(error_list_t), intent(inout) :: errors
    type(region_t) :: region
    real(wp) :: areas(size(outline%polygons)), middle(2)
    integer :: p, n, n_more

    call new_region(region, outline%polygons, outline%is_outside)
    areas = [(signed_area(region%polygons(p)%corners), p=1, size(areas))]
    if (outline%is_outside) areas = -areas             ! around all of them there may be no sheet
    n = count(areas > 0.0_wp)
    do n_more = 1, n - outline%n_pieces
      p = minloc(areas, 1, areas > 0.0_wp)
      areas(p) = 0.0_wp
      middle = 0.5_wp*(region%boxes(:, 1, p) + region%boxes(:, 2, p))
      call add_error(errors, outline%origins(p), "a curve that leaves a piece apart from the "// &
                     "others, around "//place_text(in_space(middle, plane_of(outline%axis))), &
                     "a curve within another one, for a hole; or PIECES="//to_text(n)// &
                     ", if the pieces are meant")
    end do
  end subroutine check_pieces

  !> The same curve twice is one within the other nowhere.
  subroutine refuse_twins(outline, has_twins, errors)
    type(outline_spec_t), intent(in) :: outline
    logical, intent(out) :: has_twins
    type(error_list_t), intent(inout) :: errors
    integer :: p, q

    has_twins = .false.
    do p = 2, size(outline%polygons)
      do q = 1, p - 1
        associate (a => outline%polygons(p)%corners, b => outline%polygons(q)%corners)
          if (size(a) /= size(b)) cycle
          if (any(abs(a - b) > 0.0_wp)) cycle
          has_twins = .true.
          call add_error(errors, outline%origins(p), "the same curve twice, at "// &
                         place_text(in_space(a(:, 1), plane_of(outline%axis)))//", here and at "// &
                         outline%origins(q)%file//":"//to_text(outline%origins(q)%line), "it once")
        end associate
      end do
    end do
  end subroutine refuse_twins

  !> Add a corner that is not the last one again.
  subroutine add_corner(x, curve)
    real(wp), intent(in) :: x(2)
    type(corners_t), intent(inout) :: curve
    real(wp), allocatable :: grown(:, :)

    if (.not. allocated(curve%at)) allocate (curve%at(2, 64))
    if (curve%n == size(curve%at, 2)) then
      allocate (grown(2, 2*curve%n))
      grown(:, :curve%n) = curve%at
      call move_alloc(grown, curve%at)
    end if
    if (curve%n > 0) then
      if (all(abs(x - curve%at(:, curve%n)) <= 0.0_wp)) return
    end if
    curve%n = curve%n + 1
    curve%at(:, curve%n) = x
  end subroutine add_corner

  !> An arc from the last corner through a point to its end; a straight line if they are in one.
  subroutine arc_through(middle, last, curve, error)
    real(wp), intent(in) :: middle(2), last(2)
    type(corners_t), intent(inout) :: curve
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: a(2), b(2), first(2), centre(2), cross, angles(3), turn

    first = curve%at(:, curve%n)
    a = middle - first
    b = last - first
    if (norm2(b) <= one*norm2(a)) then
      call fail(error, "an arc that ends where it starts")
    else if (min(norm2(a), norm2(b - a)) <= one*norm2(b)) then
      call fail(error, "an arc whose point on it is one of its ends")
    end if
    if (allocated(error)) return
    cross = a(1)*b(2) - a(2)*b(1)
    if (abs(cross) <= 1.0e-12_wp*norm2(a)*norm2(b)) then
      call add_corner(last, curve)
      if (dot_product(a, b - a) < 0.0_wp) call fail(error, "an arc whose point on it lies on "// &
        "the line through its ends, but not between them")
      return
    end if
    centre = first + [b(2)*sum(a**2) - a(2)*sum(b**2), a(1)*sum(b**2) - b(1)*sum(a**2)] &
                     /(2.0_wp*cross)
    angles = [atan2(first(2) - centre(2), first(1) - centre(1)), &
              atan2(middle(2) - centre(2), middle(1) - centre(1)), &
              atan2(last(2) - centre(2), last(1) - centre(1))]
    ! Counter-clockwise where the three points turn so.
    turn = modulo(angles(3) - angles(1), 2.0_wp*pi)
    if (modulo(angles(2) - angles(1), 2.0_wp*pi) > turn) turn = turn - 2.0_wp*pi
    call add_arc(centre, norm2(first - centre), angles(1), turn, curve)
    curve%at(:, curve%n) = last
  end subroutine arc_through

  !> A spline from the last corner through points. One that is a whole curve is closed and smooth
  !! all around; it may end where it began.
  subroutine add_spline(points, is_whole, curve, error)
    real(wp), intent(in) :: points(:, :)                !! after the last corner, shape (2, n)
    logical, intent(in) :: is_whole                     !! the last corner is its begin
    type(corners_t), intent(inout) :: curve
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: knots(:, :), corners(:, :)
    real(wp) :: extent
    integer :: n, i

    knots = reshape([curve%at(:, curve%n), points], [2, size(points, 2) + 1])
    n = size(knots, 2)
    extent = maxval(maxval(knots, 2) - minval(knots, 2))
    if (is_whole .and. norm2(knots(:, n) - knots(:, 1)) <= one*extent) n = n - 1
    call spline_corners(knots(:, :n), is_whole, off_spline*extent, corners, error)
    if (allocated(error)) return
    do i = 2, size(corners, 2)
      call add_corner(corners(:, i), curve)
    end do
  end subroutine add_spline

  !> Corners of an arc; the first one only where the curve has none yet.
  subroutine add_arc(centre, radius, start, turn, curve)
    real(wp), intent(in) :: centre(2), radius, start, turn      !! angles [rad]
    type(corners_t), intent(inout) :: curve
    integer :: n, i, first

    ! A circle then is its own mirror image, by the axes and by the lines half-way between them.
    n = 4*ceiling(abs(turn)/(4*smallest_turn))
    first = merge(0, 1, curve%n == 0)
    do i = first, n
      associate (angle => start + turn*i/n)
        call add_corner(centre + radius*[cos(angle), sin(angle)], curve)
      end associate
    end do
  end subroutine add_arc

end module outline_curves
