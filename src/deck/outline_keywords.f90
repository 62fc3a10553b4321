!> *BLANK OUTLINE and *TRIM: closed curves of lines, arcs, splines and circles, and those of files.
module outline_keywords
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, n_errors
  use text, only: counted, to_text
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

  !> The curves of the data lines of one keyword. A faulty piece takes its curve alone with it.
  subroutine read_curves(deck, record, outline, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(outline_spec_t), intent(inout) :: outline
    type(error_list_t), intent(inout) :: errors
    type(corners_t) :: curve
    character(:), allocatable :: piece, found
    integer :: line
    logical :: is_faulty

    is_faulty = .false.
    do line = 1, record%n_lines
      piece = field_word(record, line, 1)
      if (piece == "START" .or. piece == "CIRCLE") is_faulty = .false.
      if (curve%n == 0 .and. .not. is_faulty .and. piece /= "START" .and. piece /= "CIRCLE") then
        call add_error(errors, line_origin(deck, record, line), piece//" without a START", &
                       "START, x, y before it")
        is_faulty = .true.
      end if
      found = misfit_of(record, line)
      if (found == "" .and. .not. is_faulty) call read_piece(record, line, curve, found)
      if (found /= "") then
        call add_error(errors, line_origin(deck, record, line), found, form_of(piece))
        is_faulty = .true.
      end if
      if (is_faulty) curve%n = 0
      if (is_last(record, line)) &
        call end_curve(line_origin(deck, record, line), curve, outline, errors)
    end do
  end subroutine read_curves

  !> What is wrong with the numbers of a piece, empty if nothing is.
  function misfit_of(record, line) result(found)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    character(:), allocatable :: found
    character(:), allocatable :: piece
    integer :: n, expected

    piece = field_word(record, line, 1)
    expected = 2
    if (piece == "CIRCLE") expected = 3
    if (piece == "ARC") expected = 4
    n = 2 + count([is_filled(record, line, 4), is_filled(record, line, 5)])
    found = ""
    if (n /= expected) then
      found = piece//" with "//counted(n, "number")
    else if (n == 3 .and. .not. is_filled(record, line, 4)) then
      found = piece//" with an empty field before its last number"
    end if
  end function misfit_of

  !> How a piece is written.
  pure function form_of(piece) result(form)
    character(*), intent(in) :: piece
    character(:), allocatable :: form

    select case (piece)
    case ("START")
      form = "START, x, y"
    case ("LINE")
      form = "LINE, x, y of its end; ARC takes four numbers"
    case ("ARC")
      form = "ARC, x, y of a point on it between its ends, x, y of its end; a full circle is CIRCLE"
    case ("SPLINE")
      form = "SPLINE, x, y of one point a line, each different from the one before; a closed "// &
             "spline has at least three"
    case default
      form = "CIRCLE, x, y of the centre, radius > 0"
    end select
  end function form_of

  !> Read a piece, which goes on from the last corner. Lines of a spline are read with the last of
  !! them.
  subroutine read_piece(record, line, curve, found)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    type(corners_t), intent(inout) :: curve
    character(:), allocatable, intent(out) :: found     !! what is wrong with it, empty if nothing
    type(error_t), allocatable :: error
    integer :: first, i

    found = ""
    select case (field_word(record, line, 1))
    case ("START", "LINE")
      call add_corner(place_of(record, line, 2), curve)
    case ("ARC")
      call arc_through(place_of(record, line, 2), place_of(record, line, 4), curve, error)
    case ("SPLINE")
      if (word_of(record, line + 1) == "SPLINE") return
      first = line
      do while (word_of(record, first - 1) == "SPLINE")
        first = first - 1
      end do
      call add_spline(reshape([(place_of(record, i, 2), i=first, line)], [2, line - first + 1]), &
                      curve%n == 1 .and. is_last(record, line), curve, error)
    case default
      associate (radius => field_real(record, line, 4))
        if (radius > 0.0_wp) then
          call add_arc(place_of(record, line, 2), radius, 0.0_wp, 2.0_wp*pi, curve)
        else
          found = "the radius "//to_text(radius)
        end if
      end associate
    end select
    if (allocated(error)) found = error%message
  end subroutine read_piece

  !> Does a line end its curve?
  pure logical function is_last(record, line)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line

    is_last = word_of(record, line) == "CIRCLE" &
              .or. any(word_of(record, line + 1) == [character(6) :: "", "START", "CIRCLE"])
  end function is_last

  !> The first field of a data line, empty beyond the first and the last.
  pure function word_of(record, line) result(word)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    character(:), allocatable :: word

    word = ""
    if (line >= 1 .and. line <= record%n_lines) word = field_word(record, line, 1)
  end function word_of

  !> Two coordinates, from a field on.
  pure function place_of(record, line, field) result(x)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field
    real(wp) :: x(2)

    x = [field_real(record, line, field), field_real(record, line, field + 1)]
  end function place_of

end module outline_keywords
