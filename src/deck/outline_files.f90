!> Curves of *BLANK OUTLINE and *TRIM from files: closed polygons of a table (CSV), and curves of an
!! IGES file.
module outline_files
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: origin_t, error_list_t, new_origin, add_error
  use text, only: string_t, read_real, to_text, counted
  use text_file, only: path_beside, read_plain_source, next_line
  use outline, only: polygon_t, add_polygon
  use iges_curves, only: read_iges_loops
  use iges_global, only: unit_in_mm, unit_names
  use iges_selection, only: iges_request_t
  use scene, only: scene_t, outline_spec_t
  use deck_records, only: record_t, option_text, is_option_given
  use cad_source, only: add_source, ending_of, is_for_converter, find_unit
  use outline, only: plane_of
  use outline_curves, only: corners_t, end_curve, add_corner
  implicit none
  private

  public :: read_outline_file

  !> How a table begins that names its unit of length.
  character(*), parameter :: table_mark = "# Outline of igaform, lengths in "

contains

  !> Add the curves of the file that INPUT names, if any.
  subroutine read_outline_file(record, scene, outline, errors)
    type(record_t), intent(in) :: record
    type(scene_t), intent(inout) :: scene
    type(outline_spec_t), intent(inout) :: outline
    type(error_list_t), intent(inout) :: errors
    type(string_t) :: file
    logical :: is_there

    if (.not. is_option_given(record, "INPUT")) then
      if (is_option_given(record, "LENGTH")) call add_error(errors, record%origin, &
        "the option LENGTH without an IGES file", "this option with INPUT=file.igs only")
      return
    end if
    file%value = path_beside(record%origin%file, option_text(record, "INPUT"))
    inquire (file=file%value, exist=is_there)
    if (.not. is_there) then
      call add_error(errors, record%origin, "no file `"//file%value//"`", &
                     "the path of a CSV or IGES file, as the deck's folder sees it")
      return
    end if
    if (is_for_converter(file%value)) then
      call refuse_kind(file%value, record, errors)
      return
    end if
    select case (ending_of(file%value))
    case ("csv", "txt")
      call read_table(file%value, record, scene%units, outline, errors)
    case ("igs", "iges")
      call read_curves(file%value, record, scene%units, outline, errors)
    case default
      call refuse_kind(file%value, record, errors)
      return
    end select
    call add_source(record, scene, file)
  end subroutine read_outline_file

  subroutine refuse_kind(path, record, errors)
    character(*), intent(in) :: path
    type(record_t), intent(in) :: record
    type(error_list_t), intent(inout) :: errors

    if (ending_of(path) == "dxf") then
      call add_error(errors, record%origin, "`"//path//"`, a DXF drawing", "the file that "// &
                     "`python -m post cad "//path//" --out NAME.igs` makes of it")
    else if (is_for_converter(path)) then
      call add_error(errors, record%origin, "`"//path//"`, a STEP or BREP file", &
                     "an IGES file of its curves: save it from the CAD system")
    else
      call add_error(errors, record%origin, "`"//path//"`, a file of an unknown kind", &
                     "a file whose name ends with .csv or .igs")
    end if
  end subroutine refuse_kind

  !> The curves of an IGES file.
  subroutine read_curves(path, record, units, outline, errors)
    character(*), intent(in) :: path
    type(record_t), intent(in) :: record
    character(*), intent(in) :: units                     !! what *UNITS says
    type(outline_spec_t), intent(inout) :: outline
    type(error_list_t), intent(inout) :: errors
    type(iges_request_t) :: request
    type(polygon_t), allocatable :: loops(:)
    type(origin_t), allocatable :: origins(:)
    type(corners_t) :: curve
    integer :: p

    request%path = path
    request%origin = record%origin
    call find_unit(record, units, request%unit, errors)
    call read_iges_loops(request, plane_of(outline%axis), loops, origins, outline%notes, errors)
    do p = 1, size(loops)
      curve%at = loops(p)%corners
      curve%n = size(curve%at, 2)
      call end_curve(origins(p), curve, outline, errors)
    end do
  end subroutine read_curves

  !> A table of corners, one a line; empty lines separate the curves. Two columns are the
  !! coordinates as data lines have them, three are x, y and z. A first line of column names and
  !! comments, which begin with #, $ or **, do not count, but for one that names the unit; without
  !! it lengths are those of the deck.
  subroutine read_table(path, record, units, outline, errors)
    character(*), intent(in) :: path
    type(record_t), intent(in) :: record
    character(*), intent(in) :: units                     !! what *UNITS says
    type(outline_spec_t), intent(inout) :: outline
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: most_errors = 10
    type(error_t), allocatable :: error
    type(corners_t) :: curve
    type(string_t) :: note
    character(:), allocatable :: contents, line, keyword, unit
    real(wp) :: x(3), factor
    integer :: place, number, n_columns, n_before, n_corners, n_bad
    logical :: has_header

    keyword = record%origin%keyword
    call read_plain_source(path, contents, error)
    if (allocated(error)) then
      call add_error(errors, record%origin, error%message, "a table of corners")
      return
    end if
    n_before = size(outline%polygons)
    call take_unit(path, contents, record, units, unit, factor, errors)
    if (.not. factor > 0.0_wp) return
    place = 1
    number = 0
    n_corners = 0
    n_bad = 0
    has_header = .false.
    do while (place <= len(contents) .and. n_bad < most_errors)
      call next_line(contents, place, line)
      number = number + 1
      line = trim(adjustl(line))
      if (line == "") call end_curve(new_origin(path, number - 1, keyword), curve, outline, errors)
      if (line == "" .or. scan(line, "#$") == 1 .or. index(line, "**") == 1) cycle
      call read_numbers(line, x, n_columns)
      if (n_columns == 2 .or. n_columns == 3) then
        if (n_columns == 3) x(:2) = x(plane_of(outline%axis))
        call add_corner(factor*x(:2), curve)
        n_corners = n_corners + 1
      else if (has_header .or. n_corners > 0 .or. n_bad > 0 .or. &
               scan(line, "0123456789+-.") == 1) then
        n_bad = n_bad + 1
        call add_error(errors, new_origin(path, number, keyword), "`"//line//"`", "two "// &
                       "coordinates as on data lines, or x, y and z, with commas between them")
      else
        has_header = .true.
      end if
    end do
    call end_curve(new_origin(path, number, keyword), curve, outline, errors)
    if (n_corners == 0 .and. n_bad == 0) call add_error(errors, record%origin, &
      "the table `"//path//"` without a corner", "two coordinates a line, or x, y and z")
    note%value = path
    if (unit /= "") note%value = path//", lengths in "//unit//" times "//to_text(factor)
    note%value = note%value//": "//counted(size(outline%polygons) - n_before, "closed curve")// &
                 " of "//counted(n_corners, "corner")
    outline%notes = [outline%notes, note]
  end subroutine read_table

  !> The unit that the first line of a table names, and the factor that makes its lengths those of
  !! the deck.
  subroutine take_unit(path, contents, record, units, unit, factor, errors)
    character(*), intent(in) :: path, contents, units
    type(record_t), intent(in) :: record
    character(:), allocatable, intent(out) :: unit        !! empty: none
    real(wp), intent(out) :: factor                       !! 0: no such unit, which is an error
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: of_deck
    integer :: place

    unit = ""
    factor = 1.0_wp
    if (index(contents, table_mark) == 1) then
      place = 1
      call next_line(contents, place, unit)
      unit = unit(len(table_mark) + 1:)
      call find_unit(record, units, of_deck, errors)
      factor = unit_in_mm(unit)/unit_in_mm(of_deck)
      if (.not. factor > 0.0_wp) call add_error(errors, new_origin(path, 1, &
        record%origin%keyword), "`"//unit//"` as the unit of lengths", unit_names)
    else if (is_option_given(record, "LENGTH")) then
      call add_error(errors, record%origin, "the option LENGTH for a table that names no unit, "// &
                     "whose lengths are those of the deck", "`"//table_mark//"MM` as its first "// &
                     "line, or no LENGTH")
    end if
  end subroutine take_unit

  !> Up to three numbers of a line, which commas or blanks separate.
  subroutine read_numbers(line, x, n)
    character(*), intent(in) :: line
    real(wp), intent(out) :: x(3)
    integer, intent(out) :: n                             !! of columns; 0: no such numbers
    integer :: first, length
    logical :: is_number

    x = 0.0_wp
    n = 0
    first = 1
    do while (first <= len(line))
      if (index(line, ",") > 0) then
        length = index(line(first:)//",", ",") - 1
      else
        first = first + verify(line(first:), " ") - 1
        length = index(line(first:)//" ", " ") - 1
      end if
      n = n + 1
      if (n > 3) exit
      call read_real(trim(adjustl(line(first:first + length - 1))), x(n), is_number)
      if (.not. is_number .or. .not. abs(x(n)) < 1.0e50_wp) exit
      first = first + length + 1
    end do
    if (n > 3 .or. first <= len(line)) n = 0
  end subroutine read_numbers

end module outline_files
