!> *BLANK OUTLINE and *TRIM: closed curves of lines, arcs and circles as polygons.
module outline_keywords
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: to_text, place_text
  use outline, only: add_polygon, signed_area, find_crossing
  use scene, only: scene_t, outline_spec_t
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, field_real, &
                          field_word, is_filled, deck_context_t, step_of, line_origin
  implicit none
  private

  public :: read_outlines

  !> Angle between the corners of an arc: they lie off it by less than 1e-8 of its radius.
  real(wp), parameter :: smallest_turn = 2.5e-4_wp
  real(wp), parameter :: pi = acos(-1.0_wp)

  !> Corners of a curve under way.
  type :: corners_t
    integer :: n = 0
    real(wp), allocatable :: at(:, :)         ! with room for more
  end type corners_t

contains

  !> Fill the list of outlines: those of the blank first, then those of steps in the order of the
  !! deck.
  subroutine read_outlines(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, n

    n = size(find_records(deck, "BLANK OUTLINE"))
    found = [find_records(deck, "BLANK OUTLINE"), find_records(deck, "TRIM")]
    allocate (scene%outlines(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), outline => scene%outlines(i))
        outline%origin = record%origin
        outline%step = 0
        if (i > n) outline%step = step_of(record%step)
        outline%name = option_text(record, "NAME")
        outline%is_outside = option_text(record, "KEEP") == "OUTSIDE"
        outline%axis = index("XYZ", option_text(record, "DIRECTION"))
        if (record%is_valid) call read_curves(deck, record, outline, errors)
      end associate
    end do
    if (size(found) == 0) return
    if (.not. scene%blank%is_shell) call add_error(errors, scene%outlines(1)%origin, &
      "an outline of a blank of solids", "ELEMENT=SHELL of *BLANK")
    if (allocated(scene%blank%patches)) then
      if (size(scene%blank%patches) > 1) call add_error(errors, scene%outlines(1)%origin, &
        "an outline of a blank of several patches", "a blank of one patch")
    end if
    if (scene%reduction%component >= 0) call add_error(errors, scene%outlines(1)%origin, &
      "an outline in a deck with *REDUCE", "no *REDUCE: a sheet with an outline is not uniform")
  end subroutine read_outlines

  !> The curves of one keyword.
  subroutine read_curves(deck, record, outline, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(outline_spec_t), intent(inout) :: outline
    type(error_list_t), intent(inout) :: errors
    type(corners_t) :: curve
    character(:), allocatable :: shape
    logical :: is_crossing
    real(wp) :: place(2), x(2)
    integer :: line

    allocate (outline%polygons(0))
    do line = 1, record%n_lines
      shape = field_word(record, line, 1)
      x = [field_real(record, line, 2), field_real(record, line, 3)]
      if (shape == "CIRCLE" .or. shape == "START") &
        call end_curve(deck, record, line, curve, outline, errors)
      if (shape == "CIRCLE") then
        if (number_of(record, line, 4) > 0.0_wp) then
          call add_arc(x, number_of(record, line, 4), 0.0_wp, 2.0_wp*pi, curve)
          call end_curve(deck, record, line, curve, outline, errors)
        else
          call add_error(errors, line_origin(deck, record, line), "a circle without a radius", &
                         "CIRCLE, x, y of the centre, radius > 0")
        end if
      else if (shape == "START") then
        call add_corner(x, curve)
      else if (curve%n == 0) then
        call add_error(errors, line_origin(deck, record, line), shape//" without a START", &
                       "START, x, y before it")
        return
      else if (shape == "LINE") then
        call add_corner(x, curve)
      else if (is_filled(record, line, 4) .and. is_filled(record, line, 5)) then
        call arc_through(x, [number_of(record, line, 4), number_of(record, line, 5)], curve)
      else
        call add_error(errors, line_origin(deck, record, line), "an arc without its end", &
                       "ARC, x, y of a point on it, x, y of its end")
        return
      end if
    end do
    call end_curve(deck, record, record%n_lines, curve, outline, errors)
    if (size(outline%polygons) == 0) return
    call refuse_twins(record, outline, errors)
    call find_crossing(outline%polygons, is_crossing, place)
    if (is_crossing) call add_error(errors, record%origin, "curves that cross at "// &
                                    place_text([place, 0.0_wp]), "curves that do not cross")
  end subroutine read_curves

  !> The same curve twice is one within the other nowhere.
  subroutine refuse_twins(record, outline, errors)
    type(record_t), intent(in) :: record
    type(outline_spec_t), intent(in) :: outline
    type(error_list_t), intent(inout) :: errors
    integer :: p, q

    do p = 2, size(outline%polygons)
      do q = 1, p - 1
        associate (a => outline%polygons(p)%corners, b => outline%polygons(q)%corners)
          if (size(a) /= size(b)) cycle
          if (any(abs(a - b) > 0.0_wp)) cycle
          call add_error(errors, record%origin, "the same curve twice, at "// &
                         place_text([a(:, 1), 0.0_wp]), "it once")
        end associate
      end do
    end do
  end subroutine refuse_twins

  !> A number that may be left out: then 0.
  pure real(wp) function number_of(record, line, field) result(number)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field

    number = 0.0_wp
    if (is_filled(record, line, field)) number = field_real(record, line, field)
  end function number_of

  !> Close a curve, which may end where it began.
  subroutine end_curve(deck, record, line, curve, outline, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    type(corners_t), intent(inout) :: curve
    type(outline_spec_t), intent(inout) :: outline
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: one = 1.0e-9_wp        ! of the extent, a distance that is none
    real(wp), allocatable :: corners(:, :)
    real(wp) :: extent

    if (curve%n == 0) return
    associate (at => curve%at(:, :curve%n))
      extent = maxval(maxval(at, 2) - minval(at, 2))
      if (norm2(at(:, curve%n) - at(:, 1)) <= one*extent) curve%n = curve%n - 1
    end associate
    corners = curve%at(:, :curve%n)
    curve%n = 0
    if (.not. abs(signed_area(corners)) > one*extent**2) then
      call add_error(errors, line_origin(deck, record, line), "a curve without area, which "// &
                     "ends on this line", "at least three corners that enclose an area")
      return
    end if
    call add_polygon(outline%polygons, corners)
  end subroutine end_curve

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
    curve%n = curve%n + 1
    curve%at(:, curve%n) = x
  end subroutine add_corner

  !> An arc from the last corner through a point to its end; a straight line if they are in one.
  subroutine arc_through(middle, last, curve)
    real(wp), intent(in) :: middle(2), last(2)
    type(corners_t), intent(inout) :: curve
    real(wp) :: a(2), b(2), first(2), centre(2), cross, angles(3), turn

    first = curve%at(:, curve%n)
    a = middle - first
    b = last - first
    cross = a(1)*b(2) - a(2)*b(1)
    if (abs(cross) <= 1.0e-12_wp*sum(b**2)) then
      call add_corner(last, curve)
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

  !> Corners of an arc; the first one only where the curve has none yet.
  subroutine add_arc(centre, radius, start, turn, curve)
    real(wp), intent(in) :: centre(2), radius, start, turn      !! angles [rad]
    type(corners_t), intent(inout) :: curve
    integer :: n, i, first

    n = max(2, ceiling(abs(turn)/smallest_turn))
    first = merge(0, 1, curve%n == 0)
    do i = first, n
      associate (angle => start + turn*i/n)
        call add_corner(centre + radius*[cos(angle), sin(angle)], curve)
      end associate
    end do
  end subroutine add_arc

end module outline_keywords
