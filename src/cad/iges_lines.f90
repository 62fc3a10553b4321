!> The lines of an IGES file in their sections: 80 columns, the section's letter in column 73, the
!! number within the section behind it (IGES 5.3, section 2.2.4).
module iges_lines
  use failure, only: error_t
  use input_errors, only: error_list_t, new_origin, add_error
  use text, only: read_integer, to_text
  use source_file, only: read_plain_source, next_line
  implicit none
  private

  public :: iges_lines_t, read_iges_lines, line_number

  integer, parameter, public :: section_start = 1, section_global = 2, section_directory = 3, &
                                section_parameters = 4, section_end = 5
  integer, parameter :: n_columns = 80, letter_column = 73
  integer, parameter :: most_errors = 10   ! of one file's lines: the rest is most likely the same
  character(*), parameter :: letters = "SGDPT"
  character(9), parameter :: names(5) = [character(9) :: "start", "global", "directory", &
                                         "parameter", "terminate"]

  !> Sections one after the other without anything between them.
  type :: iges_lines_t
    character(:), allocatable :: path
    character(n_columns), allocatable :: lines(:)
    integer :: n(5) = 0          !! lines of each section
    integer :: before(5) = 0     !! lines before each section
  end type iges_lines_t

contains

  !> Read a file. Each error of its lines is noted; the lines are of use only if there is none.
  subroutine read_iges_lines(path, file, errors)
    character(*), intent(in) :: path
    type(iges_lines_t), intent(out) :: file
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: contents, line
    type(error_t), allocatable :: error
    integer :: place, i, n_lines, n_before

    file%path = path
    call read_plain_source(path, contents, error)
    if (allocated(error)) then
      call add_error(errors, new_origin(path, 0, "IGES"), error%message, "an IGES file of text")
      return
    end if
    n_lines = 0
    place = 1
    do while (place <= len(contents))
      call next_line(contents, place, line)
      n_lines = n_lines + 1
    end do
    allocate (file%lines(n_lines))
    n_before = errors%n_items
    place = 1
    do i = 1, n_lines
      call next_line(contents, place, line)
      file%lines(i) = line
      if (verify(contents(min(place, len(contents) + 1):), " "//achar(10)//achar(13)) == 0 &
          .and. line == "") exit
      call take_line(file, i, line, errors)
      if (errors%n_items - n_before >= most_errors) return
      if (is_other_format(file, i)) return
    end do
    if (errors%n_items == n_before) call check_sections(file, errors)
  end subroutine read_iges_lines

  !> Line of the file on which line `i` of a section stands.
  pure integer function line_number(file, section, i)
    type(iges_lines_t), intent(in) :: file
    integer, intent(in) :: section, i

    line_number = file%before(section) + i
  end function line_number

  !> Are these the compressed or the binary form, of which no further line is of use?
  pure logical function is_other_format(file, i)
    type(iges_lines_t), intent(in) :: file
    integer, intent(in) :: i

    is_other_format = i == 1 .and. scan(file%lines(1)(letter_column:letter_column), "BC") > 0
  end function is_other_format

  !> Check a line and count it to its section.
  subroutine take_line(file, i, line, errors)
    type(iges_lines_t), intent(inout) :: file
    integer, intent(in) :: i
    character(*), intent(in) :: line
    type(error_list_t), intent(inout) :: errors
    integer :: section, number
    logical :: is_number

    if (is_other_format(file, i)) then
      call add_error(errors, new_origin(file%path, i, "IGES"), "the compressed or binary form", &
                     "the form of fixed columns; export the file as plain (ASCII) IGES")
      return
    else if (len(line) <= letter_column .or. len(line) > n_columns) then
      call add_error(errors, new_origin(file%path, i, "IGES"), "a line of "// &
                     to_text(len(line))//" columns", to_text(n_columns)//" columns")
      return
    end if
    section = index(letters, line(letter_column:letter_column))
    call read_integer(trim(adjustl(line(letter_column + 1:))), number, is_number)
    if (section == 0) then
      call add_error(errors, new_origin(file%path, i, "IGES"), "`"// &
                     line(letter_column:letter_column)//"` in column "//to_text(letter_column), &
                     "the letter of a section: S, G, D, P or T")
    else if (any(file%n(section + 1:) > 0)) then
      call add_error(errors, new_origin(file%path, i, "IGES"), "a line of section "// &
                     letters(section:section)//" behind those of a later one", &
                     "the sections in the order S, G, D, P, T")
    else
      file%n(section) = file%n(section) + 1
      if (is_number .and. number == file%n(section)) return
      call add_error(errors, new_origin(file%path, i, "IGES section "// &
                                        letters(section:section)), &
                     "`"//trim(adjustl(line(letter_column + 1:)))//"` in columns 74 to 80", &
                     "the sequence number "//to_text(file%n(section)))
      if (is_number .and. number > 0) file%n(section) = number
    end if
  end subroutine take_line

  !> All sections must be there, as long as the last line tells.
  subroutine check_sections(file, errors)
    type(iges_lines_t), intent(inout) :: file
    type(error_list_t), intent(inout) :: errors
    integer :: section

    do section = 1, size(names)
      file%before(section) = sum(file%n(:section - 1))
      if (file%n(section) > 0 .or. section == section_start) cycle
      call add_error(errors, new_origin(file%path, sum(file%n), "IGES"), "no "// &
                     trim(names(section))//" section", "lines with "//letters(section:section)// &
                     " in column "//to_text(letter_column)//"; the file may be cut short")
    end do
    if (mod(file%n(section_directory), 2) /= 0) then
      call add_error(errors, new_origin(file%path, file%before(section_parameters), &
                                        "IGES section D"), &
                     to_text(file%n(section_directory))//" lines", "two lines for each entity")
    end if
    if (all(file%n(section_global:) > 0)) call check_counts(file, errors)
  end subroutine check_sections

  !> The last line repeats the length of the other sections, eight columns each.
  subroutine check_counts(file, errors)
    type(iges_lines_t), intent(in) :: file
    type(error_list_t), intent(inout) :: errors
    integer :: section, counted, first
    logical :: is_number

    associate (line => file%lines(file%before(section_end) + 1))
      do section = section_start, section_parameters
        first = 8*(section - 1) + 1
        if (line(first:first + 7) == "") cycle
        call read_integer(trim(adjustl(line(first + 1:first + 7))), counted, is_number)
        if (is_number .and. line(first:first) == letters(section:section) &
            .and. counted == file%n(section)) cycle
        call add_error(errors, new_origin(file%path, file%before(section_end) + 1, &
                                          "IGES section T"), &
                       "`"//line(first:first + 7)//"` in columns "//to_text(first)//" to "// &
                       to_text(first + 7), letters(section:section)//" and the "// &
                       to_text(file%n(section))//" lines that the section has")
      end do
    end associate
  end subroutine check_counts

end module iges_lines
