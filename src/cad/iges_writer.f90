!> Surfaces as an IGES file: one rational B-spline surface (entity 128) each, every number with as
!! many digits as it takes to read it back bit for bit.
module iges_writer
  use kinds, only: wp
  use errors, only: error_t, fail
  use text, only: string_t, to_text
  use output_guard, only: why_left_alone
  use whole_file, only: write_lines
  use nurbs_surface, only: nurbs_surface_t
  use length_units, only: unit_flag
  implicit none
  private

  public :: write_iges

  character(*), parameter :: mark = "NURBS surfaces as rational B-spline surfaces (entity 128)."
  integer, parameter :: n_columns = 72, n_value_columns = 64

  !> Lines of a section.
  type :: section_t
    character(n_columns), allocatable :: lines(:)
    integer :: n = 0
  end type section_t

contains

  !> Write a file. Fails if it cannot be written; then nothing is left behind.
  subroutine write_iges(path, surfaces, labels, unit, author, error)
    character(*), intent(in) :: path
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    type(string_t), intent(in) :: labels(:)    !! of the surfaces; eight characters count
    character(*), intent(in) :: unit           !! of their lengths, one of `unit_names`
    character(*), intent(in) :: author         !! program and version
    type(error_t), allocatable, intent(out) :: error
    type(section_t) :: sections(4)
    character(:), allocatable :: values, why
    integer :: i, n_before

    why = why_left_alone(path, mark, "IGES file")
    if (why /= "") then
      call fail(error, "cannot write '"//path//"': "//why//"; name another with --out")
      return
    end if
    call add_line(sections(1), mark)
    call add_text(sections(2), global_text(path, surfaces, unit, author), n_columns)
    do i = 1, size(surfaces)
      values = surface_text(surfaces(i))
      n_before = sections(4)%n
      call add_text(sections(4), values, n_value_columns, owner=2*i - 1)
      call add_entry(sections(3), n_before + 1, sections(4)%n - n_before, labels(i)%value)
    end do
    call write_lines(path, all_lines(sections), why)
    if (why /= "") call fail(error, "cannot write '"//path//"': "//why)
  end subroutine write_iges

  !> The lines of the file: those of the sections with their letters and numbers, and the last one.
  function all_lines(sections) result(lines)
    type(section_t), intent(in) :: sections(4)
    type(string_t) :: lines(sum(sections%n) + 1)
    character(4), parameter :: letters = "SGDP"
    character(n_columns + 8) :: line
    character(n_columns) :: last
    integer :: s, i, n

    n = 0
    do s = 1, 4
      do i = 1, sections(s)%n
        write (line, "(a72, a1, i7)") sections(s)%lines(i), letters(s:s), i
        n = n + 1
        lines(n)%value = line
      end do
    end do
    write (last, "(4(a1, i7.7))") (letters(s:s), sections(s)%n, s=1, 4)
    write (line, "(a72, a1, i7)") last, "T", 1
    lines(n + 1)%value = line
  end function all_lines

  !> Values of the global section (IGES 5.3, section 2.2.4.3).
  function global_text(path, surfaces, unit, author) result(text)
    character(*), intent(in) :: path, unit, author
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    character(:), allocatable :: text, name, date
    integer :: moment(8), i
    character(15) :: buffer
    real(wp) :: farthest

    call date_and_time(values=moment)
    write (buffer, "(i4.4, 2i2.2, '.', 3i2.2)") moment(1:3), moment(5:7)
    date = hollerith(buffer)
    name = path(index(path, "/", back=.true.) + 1:)
    farthest = 0.0_wp
    do i = 1, size(surfaces)
      farthest = max(farthest, maxval(abs(surfaces(i)%points)))
    end do
    text = "1H,,1H;,"//hollerith(name)//","//hollerith(name)//","//hollerith(author)//","// &
           hollerith(author)//",32,38,6,308,15,"//hollerith(name)//",1.,"// &
           to_text(unit_flag(unit))//","//hollerith(unit_name(unit))//",1,0.,"//date//","// &
           iges_real(1.0e-12_wp*farthest)//","//iges_real(farthest)//",,,11,0,"//date//";"
  end function global_text

  !> Names of units as the global section has them.
  pure function unit_name(unit) result(name)
    character(*), intent(in) :: unit
    character(:), allocatable :: name

    name = unit
    if (unit == "IN") name = "INCH"
  end function unit_name

  !> Values of an entity 128.
  function surface_text(surface) result(text)
    type(nurbs_surface_t), intent(in) :: surface
    character(:), allocatable :: text, part
    integer :: n, i, j, c

    text = ""
    n = 0
    associate (axes => surface%axes)
      part = "128,"//to_text(axes(1)%n_basis - 1)//","//to_text(axes(2)%n_basis - 1)//","// &
             to_text(axes(1)%degree)//","//to_text(axes(2)%degree)//",0,0,"// &
             merge("0", "1", has_uneven_weights(surface))//",0,0,"
      call append(text, n, part)
      do j = 1, 2
        do i = 1, size(axes(j)%knots)
          call append(text, n, iges_real(axes(j)%knots(i))//",")
        end do
      end do
      do j = 1, axes(2)%n_basis
        do i = 1, axes(1)%n_basis
          call append(text, n, iges_real(surface%weights(i, j))//",")
        end do
      end do
      do j = 1, axes(2)%n_basis
        do i = 1, axes(1)%n_basis
          do c = 1, 3
            call append(text, n, iges_real(surface%points(i, j, c))//",")
          end do
        end do
      end do
      do j = 1, 2
        associate (u => axes(j)%knots)
          call append(text, n, iges_real(u(1))//","//iges_real(u(size(u)))// &
                      merge(",", ";", j == 1))
        end associate
      end do
    end associate
    text = text(:n)
  end function surface_text

  pure logical function has_uneven_weights(surface)
    type(nurbs_surface_t), intent(in) :: surface

    has_uneven_weights = maxval(surface%weights) > minval(surface%weights)
  end function has_uneven_weights

  !> A number as the shortest text that reads back as the same number, always with a point.
  function iges_real(number) result(text)
    real(wp), intent(in) :: number
    character(:), allocatable :: text
    integer :: e

    text = to_text(number)
    if (index(text, ".") > 0) then
      e = index(text, "e")
      if (e > 0) text(e:e) = "D"
    else
      e = index(text//"e", "e")
      if (e <= len(text)) then
        text = text(:e - 1)//".D"//text(e + 1:)
      else
        text = text//"."
      end if
    end if
  end function iges_real

  pure function hollerith(text) result(counted)
    character(*), intent(in) :: text
    character(:), allocatable :: counted

    counted = to_text(len(text))//"H"//text
  end function hollerith

  !> Grow a text by doubling.
  pure subroutine append(text, n, more)
    character(:), allocatable, intent(inout) :: text
    integer, intent(inout) :: n
    character(*), intent(in) :: more
    character(:), allocatable :: longer

    if (n + len(more) > len(text)) then
      allocate (character(2*(n + len(more))) :: longer)
      longer(:n) = text(:n)
      call move_alloc(longer, text)
    end if
    text(n + 1:n + len(more)) = more
    n = n + len(more)
  end subroutine append

  !> Break values into lines: numbers stay whole, texts may go on in the next line.
  subroutine add_text(section, text, width, owner)
    type(section_t), intent(inout) :: section
    character(*), intent(in) :: text
    integer, intent(in) :: width
    integer, intent(in), optional :: owner   !! directory number, in columns 65 to 72
    character(n_columns) :: line
    integer :: first, last

    first = 1
    do while (first <= len(text))
      last = min(first + width - 1, len(text))
      if (last < len(text) .and. present(owner)) last = first - 1 + &
        index(text(first:last), ",", back=.true.)
      line = text(first:last)
      if (present(owner)) write (line(n_value_columns + 1:), "(i8)") owner
      call add_line(section, line)
      first = last + 1
    end do
  end subroutine add_text

  !> The two lines of an entity in the directory.
  subroutine add_entry(section, first, n_lines, label)
    type(section_t), intent(inout) :: section
    integer, intent(in) :: first, n_lines
    character(*), intent(in) :: label
    character(n_columns) :: line

    write (line, "(8i8, a8)") 128, first, 0, 0, 0, 0, 0, 0, "00000000"
    call add_line(section, line)
    write (line, "(5i8, 16x, a8, i8)") 128, 0, 0, n_lines, 0, adjustr(short(label)), 0
    call add_line(section, line)
  end subroutine add_entry

  pure function short(label)
    character(*), intent(in) :: label
    character(8) :: short

    short = label
  end function short

  pure subroutine add_line(section, line)
    type(section_t), intent(inout) :: section
    character(*), intent(in) :: line
    character(n_columns), allocatable :: longer(:)

    if (.not. allocated(section%lines)) allocate (section%lines(64))
    if (section%n == size(section%lines)) then
      allocate (longer(2*section%n))
      longer(:section%n) = section%lines
      call move_alloc(longer, section%lines)
    end if
    section%n = section%n + 1
    section%lines(section%n) = line
  end subroutine add_line

end module iges_writer
