!> The lines of an IGES file in their sections: 80 columns, the section's code in column 73, the
!! number within the section after it (IGES 5.3, section 2.2.4).
!!
!! The directory: two lines of ten fields for each entity (IGES 5.3, section
!! 2.2.4.4). An entity goes by the number of its first line, D1, D3 and so on.
module iges_directory
  use input_errors, only: error_list_t, new_origin, add_error
  use text, only: read_integer, to_text, counted
  use failure, only: error_t
  use text_file, only: read_plain_source, read_whole_file, next_line
  implicit none
  private

  public :: entry_t, read_directory, entry_name, entry_title, type_name, iges_lines_t, &
            read_iges_lines, line_number, reject_line

  integer, parameter, public :: section_global = 2, section_directory = 3, section_parameters = 4
  integer, parameter :: section_start = 1, section_end = 5
  integer, parameter :: n_columns = 80, code_column = 73
  integer, parameter :: most_errors = 10   ! of one file's lines: the rest is most likely the same
  character(*), parameter :: section_codes = "SGDPT"
  character(9), parameter :: names(5) = [character(9) :: "start", "global", "directory", &
                                         "parameter", "terminate"]

  !> Types of entities that a tool may have something to do with.
  integer, parameter :: types(33) = [100, 102, 104, 106, 108, 110, 112, 114, 116, 118, 120, &
                                     122, 124, 126, 128, 130, 140, 141, 142, 143, 144, 186, &
                                     190, 192, 194, 196, 198, 308, 314, 402, 406, 408, 510]
  character(25), parameter :: type_names(33) = [character(25) :: "circular arc", &
    "composite curve", "conic arc", "copious data", "plane", "line", "parametric spline curve", &
    "parametric spline surface", "point", "ruled surface", "surface of revolution", &
    "tabulated cylinder", "transformation matrix", "rational B-spline curve", &
    "rational B-spline surface", "offset curve", "offset surface", "boundary", &
    "curve on a surface", "bounded surface", "trimmed surface", "solid of faces", &
    "plane surface", "circular cylinder", "cone", "sphere", "torus", "subfigure definition", &
    "colour", "group", "property", "subfigure", "face of a solid"]

  !> Sections one after the other without anything between them, and the errors found so far.
  type :: iges_lines_t
    type(error_list_t) :: errors
    character(:), allocatable :: path
    character(n_columns), allocatable :: lines(:)
    integer :: n(5) = 0          !! lines of each section
    integer :: before(5) = 0     !! lines before each section
  end type iges_lines_t

  !> What the reader needs of an entry.
  type :: entry_t
    integer :: type = 0
    integer :: form = 0
    integer :: first = 1, n_lines = 0      !! of its parameters, in the parameter section
    integer :: matrix = 0                  !! directory number of a transformation; 0: none
    logical :: is_blanked = .false.        !! not to be seen
    logical :: is_part = .false.           !! physically dependent: part of another entity
    integer :: purpose = 0                 !! 0 geometry, else annotation, definition, ...
    character(:), allocatable :: label     !! may be empty
  end type entry_t

contains

  !> Read all entries; their errors are noted.
  subroutine read_directory(file, entries)
    type(iges_lines_t), intent(inout) :: file
    type(entry_t), allocatable, intent(out) :: entries(:)
    integer :: i, n_before

    allocate (entries(file%n(section_directory)/2))
    n_before = file%errors%n_items
    do i = 1, size(entries)
      call read_entry(file, 2*i - 1, entries(i))
      if (file%errors%n_items - n_before >= most_errors) return
    end do
  end subroutine read_directory

  !> Such as `entity 128 (rational B-spline surface) at D7`.
  pure function entry_name(entries, i) result(name)
    type(entry_t), intent(in) :: entries(:)
    integer, intent(in) :: i   !! position in the list
    character(:), allocatable :: name

    name = "entity "//to_text(entries(i)%type)
    if (type_name(entries(i)%type) /= "") name = name//" ("//type_name(entries(i)%type)//")"
    name = name//" at D"//to_text(2*i - 1)
  end function entry_name

  !> How a list begins that has one line for each entity, such as `D7 trimmed surface F3`.
  pure function entry_title(entries, i) result(title)
    type(entry_t), intent(in) :: entries(:)
    integer, intent(in) :: i   !! position in the list
    character(:), allocatable :: title

    title = "D"//to_text(2*i - 1)//" "//type_name(entries(i)%type)
    if (entries(i)%label /= "") title = title//" "//entries(i)%label
  end function entry_title

  !> What a type is called; empty for those that a tool has nothing to do with.
  pure function type_name(type) result(name)
    integer, intent(in) :: type
    character(:), allocatable :: name
    integer :: i

    name = ""
    i = findloc(types, type, 1)
    if (i > 0) name = trim(type_names(i))
  end function type_name

  subroutine read_entry(file, number, entry)
    type(iges_lines_t), intent(inout) :: file
    integer, intent(in) :: number   !! of its first line in the section
    type(entry_t), intent(out) :: entry
    character(8) :: code
    integer :: again, i, n

    call take_field(file, number, 1, "entity type", entry%type)
    call take_field(file, number, 2, "start of the parameters", entry%first)
    call take_field(file, number, 7, "transformation matrix", entry%matrix)
    call take_field(file, number + 1, 1, "entity type", again)
    call take_field(file, number + 1, 4, "number of parameter lines", entry%n_lines)
    call take_field(file, number + 1, 5, "form", entry%form)
    code = field(file, number, 9)
    do i = 1, 8
      if (code(i:i) == " ") code(i:i) = "0"
    end do
    if (verify(code, "0123456789") > 0) then
      call reject_line(file, section_directory, number, "`"//code//"` in field 9, the status", &
                       "eight digits")
      code = "00000000"
    end if
    entry%is_blanked = code(1:2) == "01"
    entry%is_part = code(3:4) == "01" .or. code(3:4) == "03"
    read (code(5:6), "(i2)") entry%purpose
    entry%label = trim(adjustl(field(file, number + 1, 8)))
    if (again /= entry%type) then
      call reject_line(file, section_directory, number + 1, "entity type "//to_text(again)// &
                       " in the second line of D"//to_text(number), "the "// &
                       to_text(entry%type)//" of its first line")
    end if
    n = file%n(section_parameters)
    if (entry%type == 0) return   ! a null entity has no parameters
    if (entry%first >= 1 .and. entry%first <= n .and. entry%n_lines >= 1 &
        .and. entry%n_lines <= n - entry%first + 1) return
    call reject_line(file, section_directory, number, counted(entry%n_lines, &
                     "parameter line")//" from P"//to_text(entry%first)//" on for D"// &
                     to_text(number), "lines between P1 and P"//to_text(n))
  end subroutine read_entry

  !> A whole number in a field; 0 where the field is blank.
  subroutine take_field(file, line, number, name, value)
    type(iges_lines_t), intent(inout) :: file
    integer, intent(in) :: line, number
    character(*), intent(in) :: name
    integer, intent(out) :: value
    character(:), allocatable :: given
    logical :: is_number

    value = 0
    given = trim(adjustl(field(file, line, number)))
    if (given == "") return
    call read_integer(given, value, is_number)
    if (.not. is_number) call reject_line(file, section_directory, line, "`"//given// &
      "` in field "//to_text(number)//", the "//name, "a whole number")
  end subroutine take_field

  !> One of the nine fields of eight columns.
  pure function field(file, line, number)
    type(iges_lines_t), intent(in) :: file
    integer, intent(in) :: line, number
    character(8) :: field
    integer :: i

    i = line_number(file, section_directory, line)
    associate (text => file%lines(i))
      field = text(8*number - 7:8*number)
    end associate
  end function field

  !> Read a file. Each error of its lines is noted; the lines are of use only if there is none.
  subroutine read_iges_lines(path, file)
    character(*), intent(in) :: path
    type(iges_lines_t), intent(inout) :: file
    character(:), allocatable :: contents, line
    type(error_t), allocatable :: error
    integer :: at, i, n_lines, n_before
    logical :: is_iges

    file%path = path
    call read_plain_source(path, contents, error)
    if (allocated(error)) then
      call reject_file(file, error%message)
      return
    end if
    n_lines = 0
    at = 1
    is_iges = .false.
    do while (at <= len(contents))
      call next_line(contents, at, line)
      n_lines = n_lines + 1
      is_iges = is_iges .or. has_section(line)
    end do
    if (.not. is_iges) then
      call reject_file(file, "a text")
      return
    end if
    allocate (file%lines(n_lines))
    n_before = file%errors%n_items
    at = 1
    do i = 1, n_lines
      call next_line(contents, at, line)
      file%lines(i) = line
      if (verify(contents(min(at, len(contents) + 1):), " "//achar(10)//achar(13)) == 0 &
          .and. line == "") exit
      if (i == 1 .and. scan(file%lines(1)(code_column:code_column), "BC") > 0) then
        call add_error(file%errors, new_origin(path, i, "IGES"), "the compressed or binary form", &
                       "the form of fixed columns; export the file as plain (ASCII) IGES")
        return
      end if
      call take_line(file, i, line)
      if (file%errors%n_items - n_before >= most_errors) return
    end do
    if (file%errors%n_items == n_before) call check_sections(file)
  end subroutine read_iges_lines

  !> Does a line have the letter of a section, or of another form of IGES, and a number after it?
  logical function has_section(line)
    character(*), intent(in) :: line
    integer :: number

    has_section = .false.
    if (len(line) <= code_column) return
    if (scan(line(code_column:code_column), section_codes//"BC") == 0) return
    call read_integer(trim(adjustl(line(code_column + 1:))), number, has_section)
  end function has_section

  !> Refuse a file that is no IGES file at all, with how it begins.
  subroutine reject_file(file, found)
    type(iges_lines_t), intent(inout) :: file
    character(*), intent(in) :: found                 !! what it is instead
    integer, parameter :: n_bytes = 400, n_shown = 40
    character(*), parameter :: blank = " "//achar(9)//achar(10)//achar(13)
    character(:), allocatable :: head
    logical :: is_there
    integer :: i

    call read_whole_file(file%path, head, is_there, n_bytes)
    head = head(max(1, verify(head, blank)):)
    i = scan(head//achar(10), achar(10)//achar(13))
    head = head(:min(i - 1, n_shown))
    do i = 1, len(head)
      if (head(i:i) < " " .or. head(i:i) > "~") head(i:i) = "."
    end do
    if (head /= "") head = ", which begins with `"//trim(head)//"`"
    call add_error(file%errors, new_origin(file%path, 1, "IGES"), "no IGES file but "//found// &
                   head, "lines of 80 columns with S, G, D, P or T in column 73; STEP and BREP "// &
                   "files are converted by `python -m post cad`")
  end subroutine reject_file

  !> Line of the file on which line `i` of a section is.
  pure integer function line_number(file, section, i)
    type(iges_lines_t), intent(in) :: file
    integer, intent(in) :: section, i

    line_number = file%before(section) + i
  end function line_number

  !> Note an error in line `i` of a section.
  subroutine reject_line(file, section, i, found, expected)
    type(iges_lines_t), intent(inout) :: file
    integer, intent(in) :: section, i
    character(*), intent(in) :: found, expected

    call add_error(file%errors, new_origin(file%path, line_number(file, section, i), &
                                           "IGES section "//section_codes(section:section)), &
                   found, expected)
  end subroutine reject_line

  !> Check a line and count it to its section.
  subroutine take_line(file, i, line)
    type(iges_lines_t), intent(inout) :: file
    integer, intent(in) :: i
    character(*), intent(in) :: line
    integer :: section, number
    logical :: is_number

    if (len(line) <= code_column .or. len(line) > n_columns) then
      call reject("a line of "//counted(len(line), "column"), to_text(n_columns)//" columns")
      return
    end if
    section = index(section_codes, line(code_column:code_column))
    call read_integer(trim(adjustl(line(code_column + 1:))), number, is_number)
    if (section == 0) then
      call reject("`"//line(code_column:code_column)//"` in column "//to_text(code_column), &
                  "the letter of a section: S, G, D, P or T")
    else if (any(file%n(section + 1:) > 0)) then
      call reject("a line of section "//section_codes(section:section)// &
                  " after those of a later one", "the sections in the order S, G, D, P, T")
    else
      file%n(section) = file%n(section) + 1
      if (is_number .and. number == file%n(section)) return
      ! `before` is not known yet, so the line is counted from the begin of the file.
      call reject_line(file, section, i, "`"//trim(adjustl(line(code_column + 1:)))// &
                       "` in columns 74 to 80", "the sequence number "//to_text(file%n(section)))
      if (is_number .and. number > 0) file%n(section) = number
    end if

  contains

    subroutine reject(found, expected)
      character(*), intent(in) :: found, expected

      call add_error(file%errors, new_origin(file%path, i, "IGES"), found, expected)
    end subroutine reject

  end subroutine take_line

  !> All sections must be there, as long as the last line says: it repeats the length of the other
  !! sections, eight columns each.
  subroutine check_sections(file)
    type(iges_lines_t), intent(inout) :: file
    integer :: section, n_written, first
    logical :: is_number
    character(n_columns) :: line

    do section = 1, size(names)
      file%before(section) = sum(file%n(:section - 1))
      if (file%n(section) > 0 .or. section == section_start) cycle
      call add_error(file%errors, new_origin(file%path, sum(file%n), "IGES"), "no "// &
                     trim(names(section))//" section", "lines with "// &
                     section_codes(section:section)//" in column "//to_text(code_column)// &
                     "; the file may be cut short")
    end do
    if (mod(file%n(section_directory), 2) /= 0) then
      call reject_line(file, section_directory, file%n(section_directory), &
                       counted(file%n(section_directory), "line"), "two lines for each entity")
    end if
    if (any(file%n(section_global:) == 0)) return
    line = file%lines(line_number(file, section_end, 1))
    do section = section_start, section_parameters
      first = 8*(section - 1) + 1
      if (line(first:first + 7) == "") cycle
      call read_integer(trim(adjustl(line(first + 1:first + 7))), n_written, is_number)
      if (is_number .and. line(first:first) == section_codes(section:section) &
          .and. n_written == file%n(section)) cycle
      call reject_line(file, section_end, 1, "`"//line(first:first + 7)//"` in columns "// &
                       to_text(first)//" to "//to_text(first + 7), &
                       section_codes(section:section)//" and "//counted(file%n(section), "line")// &
                       ", as the section has")
    end do
  end subroutine check_sections

end module iges_directory
