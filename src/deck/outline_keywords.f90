!> *BLANK OUTLINE and *TRIM: closed curves of lines, arcs, splines and circles, and those of files.
module outline_keywords
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, n_errors
  use scene, only: scene_t, outline_spec_t
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_integer, &
                          field_real, field_word, is_filled, is_option_given, deck_context_t, &
                          step_of, line_origin
  use outline_curves, only: corners_t, end_curve, add_corner, add_arc, arc_through, add_spline, &
                            check_curves, check_pieces
  use outline_files, only: read_outline_file
  implicit none
  private

  public :: read_outlines

  real(wp), parameter :: pi = acos(-1.0_wp)

contains

  !> Fill the list of outlines: those of the blank first, then those of steps in the order of the
  !! deck.
  subroutine read_outlines(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(outline_spec_t), allocatable :: outlines(:)
    integer, allocatable :: found(:)
    integer :: i, n, n_before

    n = size(find_records(deck, "BLANK OUTLINE"))
    found = [find_records(deck, "BLANK OUTLINE"), find_records(deck, "TRIM")]
    allocate (outlines(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), outline => outlines(i))
        outline%origin = record%origin
        outline%step = 0
        if (i > n) then
          outline%step = step_of(record%step)
          outline%is_flat = option_text(record, "SHEET") == "FLAT"
        end if
        outline%name = option_text(record, "NAME")
        outline%is_outside = option_text(record, "KEEP") == "OUTSIDE"
        outline%axis = index("XYZ", option_text(record, "DIRECTION"))
        allocate (outline%polygons(0), outline%origins(0), outline%notes(0))
        if (.not. record%is_valid) cycle
        outline%n_pieces = option_integer(record, "PIECES")
        n_before = n_errors(errors)
        if (record%n_lines == 0 .and. .not. is_option_given(record, "INPUT")) &
          call add_error(errors, record%origin, "0 data lines and no option INPUT", &
                         "curves on data lines, or INPUT=file.csv or file.igs")
        call read_outline_file(record, scene, outline, errors)
        call read_curves(deck, record, outline, errors)
        call check_curves(outline, errors)
        if (n_errors(errors) == n_before) call check_pieces(outline, errors)
      end associate
    end do
    call move_alloc(outlines, scene%outlines)
    if (size(found) == 0) return
    if (allocated(scene%blank%patches)) then
      if (size(scene%blank%patches) > 1) call add_error(errors, scene%outlines(1)%origin, &
        "an outline of a blank of several patches", "a blank of one patch")
    end if
    if (scene%reduction%component >= 0) call add_error(errors, scene%outlines(1)%origin, &
      "an outline in a deck with *REDUCE", "no *REDUCE: a sheet with an outline is not uniform")
  end subroutine read_outlines

  !> The curves of the data lines of one keyword.
  subroutine read_curves(deck, record, outline, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(outline_spec_t), intent(inout) :: outline
    type(error_list_t), intent(inout) :: errors
    type(corners_t) :: curve
    character(:), allocatable :: shape
    integer :: line
    logical :: is_read

    do line = 1, record%n_lines
      shape = field_word(record, line, 1)
      if (shape == "CIRCLE" .or. shape == "START") &
        call end_curve(line_origin(deck, record, line), curve, outline, errors)
      if (shape == "CIRCLE") then
        call read_circle(deck, record, line, outline, errors)
      else if (shape == "START") then
        call add_corner(place_of(record, line), curve)
      else if (curve%n == 0) then
        call add_error(errors, line_origin(deck, record, line), shape//" without a START", &
                       "START, x, y before it")
        return
      else
        call read_piece(deck, record, line, curve, is_read, errors)
        if (.not. is_read) return
      end if
    end do
    if (record%n_lines > 0) call end_curve(line_origin(deck, record, record%n_lines), curve, &
                                           outline, errors)
  end subroutine read_curves

  subroutine read_circle(deck, record, line, outline, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    type(outline_spec_t), intent(inout) :: outline
    type(error_list_t), intent(inout) :: errors
    type(corners_t) :: curve

    if (number_of(record, line, 4) > 0.0_wp) then
      call add_arc(place_of(record, line), number_of(record, line, 4), 0.0_wp, 2.0_wp*pi, curve)
      call end_curve(line_origin(deck, record, line), curve, outline, errors)
    else
      call add_error(errors, line_origin(deck, record, line), "a circle without a radius", &
                     "CIRCLE, x, y of the centre, radius > 0")
    end if
  end subroutine read_circle

  !> A piece that goes on from the last corner. Lines of a spline are read with the last of them.
  subroutine read_piece(deck, record, line, curve, is_read, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    type(corners_t), intent(inout) :: curve
    logical, intent(out) :: is_read
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    integer :: first, i

    is_read = .true.
    select case (field_word(record, line, 1))
    case ("LINE")
      call add_corner(place_of(record, line), curve)
    case ("SPLINE")
      if (word_of(record, line + 1) == "SPLINE") return
      first = line
      do while (word_of(record, first - 1) == "SPLINE")
        first = first - 1
      end do
      call add_spline(reshape([(place_of(record, i), i=first, line)], [2, line - first + 1]), &
                      curve%n == 1 .and. any(word_of(record, line + 1) == &
                                             [character(6) :: "", "START", "CIRCLE"]), &
                      curve, error)
      if (.not. allocated(error)) return
      is_read = .false.
      call add_error(errors, line_origin(deck, record, line), error%message, "SPLINE, x, y of "// &
                     "one point a line, each different from the one before; a closed spline "// &
                     "has at least three")
    case default
      is_read = is_filled(record, line, 4) .and. is_filled(record, line, 5)
      if (is_read) then
        call arc_through(place_of(record, line), [number_of(record, line, 4), &
                                                  number_of(record, line, 5)], curve)
      else
        call add_error(errors, line_origin(deck, record, line), "an arc without its end", &
                       "ARC, x, y of a point on it, x, y of its end")
      end if
    end select
  end subroutine read_piece

  !> The first field of a data line, empty beyond the first and the last.
  pure function word_of(record, line) result(word)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    character(:), allocatable :: word

    word = ""
    if (line >= 1 .and. line <= record%n_lines) word = field_word(record, line, 1)
  end function word_of

  pure function place_of(record, line) result(x)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    real(wp) :: x(2)

    x = [field_real(record, line, 2), field_real(record, line, 3)]
  end function place_of

  !> A number that may be left out: then 0.
  pure real(wp) function number_of(record, line, field) result(number)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field

    number = 0.0_wp
    if (is_filled(record, line, field)) number = field_real(record, line, field)
  end function number_of

end module outline_keywords
