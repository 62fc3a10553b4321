!> Text files. Written ones exist as a whole or not at all, and an existing file is replaced only if
!! this program has written it, which its first line says. Read ones: the bytes of a deck or include
!! file, and its lines whatever ends them.
module text_file
  use, intrinsic :: iso_fortran_env, only: int64
  use text, only: string_t, to_text
  use failure, only: error_t, fail
  use system_files, only: true_path, remove_file, bytes_on_disk, why_protected, is_no_file, &
                          draft_ending, kind_of_file, install_file
  implicit none
  private

  public :: write_lines, read_whole_file, take_line, is_of_size, why_left_alone
  public :: read_source, read_plain_source, next_line, path_beside

  integer, parameter :: longest = 2**29          !! bytes of a file

  character(1), parameter :: tab = achar(9), line_feed = achar(10), carriage_return = achar(13)

contains

  !> Write lines to a file of their own, bring it to the disk, and put it in the place of an older
  !! one, where the name leads to. On failure that stays.
  subroutine write_lines(path, lines, why)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: lines(:)
    character(:), allocatable, intent(out) :: why   !! what failed; empty if nothing did
    character(:), allocatable :: new
    character(256) :: message
    integer(int64) :: n_bytes
    integer :: unit, status, i

    why = why_protected(path)
    if (why /= "") then
      why = "cannot write it: "//why
      return
    end if
    new = true_path(path)//draft_ending
    call remove_file(new)
    open (newunit=unit, file=new, action="write", status="replace", iostat=status, iomsg=message)
    if (status == 0) then
      n_bytes = 0
      do i = 1, size(lines)
        if (status == 0) write (unit, "(a)", iostat=status, iomsg=message) lines(i)%value
        n_bytes = n_bytes + len(lines(i)%value) + 1
      end do
      if (status == 0) close (unit, iostat=status, iomsg=message)
      if (status /= 0) close (unit, iostat=i)
    end if
    if (status /= 0) then
      why = "cannot write it: "//trim(message)
    else if (.not. is_of_size(new, n_bytes)) then
      why = "cannot write all of it; is the disk full?"
    else
      call install_file(new, true_path(path), why)
    end if
    if (why /= "") call remove_file(new)
  end subroutine write_lines

  !> Has the file all bytes that were written to it? WRITE and CLOSE of gfortran do not report
  !! those that a full disk did not take.
  logical function is_of_size(path, n_bytes)
    character(*), intent(in) :: path
    integer(int64), intent(in) :: n_bytes

    is_of_size = bytes_on_disk(path) == n_bytes
  end function is_of_size

  !> A file, or its first part, as one text; empty if it cannot be read or is no plain file.
  subroutine read_whole_file(path, content, is_there, n_most)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: content
    logical, intent(out) :: is_there
    integer, intent(in), optional :: n_most    !! bytes; absent: all
    integer(int64) :: length
    integer :: unit, status

    content = ""
    is_there = .false.
    if (is_no_file(path)) return
    open (newunit=unit, file=path, access="stream", form="unformatted", action="read", &
          status="old", iostat=status)
    if (status /= 0) return
    inquire (unit=unit, size=length)
    if (present(n_most)) length = min(length, int(n_most, int64))
    deallocate (content)
    allocate (character(max(0_int64, length)) :: content)
    if (length > 0) read (unit, iostat=status) content
    is_there = status == 0
    if (.not. is_there) content = ""
    close (unit)
  end subroutine read_whole_file

  !> The line of a text from `place` on, without its line feed; `place` moves to the start of the
  !! next, after the last one beyond the end.
  pure subroutine take_line(content, place, line)
    character(*), intent(in) :: content
    integer, intent(inout) :: place
    character(:), allocatable, intent(out) :: line
    integer :: length

    length = index(content(place:), new_line("a")) - 1
    if (length < 0) length = len(content) - place + 1
    line = content(place:place + length - 1)
    place = place + length + 1
  end subroutine take_line

  !> Why a file may not be written under this name; empty if it may. It may where there is none,
  !! an empty one, or one whose first line begins as `mark` does; what stands in brackets, such as
  !! the units of a table, does not count. A link counts as what it leads to. Nothing but a plain
  !! file is opened, for a pipe keeps who opens it waiting.
  function why_left_alone(path, mark, what) result(why)
    character(*), intent(in) :: path
    character(*), intent(in) :: mark     !! how the first line begins
    character(*), intent(in) :: what     !! the kind of file, for the words
    character(:), allocatable :: why
    character(:), allocatable :: start
    logical :: is_read
    integer :: n

    why = ""
    if (is_no_file(path)) then
      why = "there is a "//kind_of_file(path)//" of this name; it is left alone"
      return
    else if (kind_of_file(path) == "") then
      return
    end if
    call read_whole_file(path, start, is_read, 4*len(mark) + 100)
    n = index(start, new_line("a"))
    if (n > 1) start = start(:n - 1)
    if (.not. is_read) then
      why = "there is a file of this name that cannot be read; it is left alone"
    else if (start /= "" .and. index(without_brackets(start), without_brackets(mark)) /= 1) then
      why = "there is a file of this name that is no "//what//" of igaform; it is left alone"
    end if
  end function why_left_alone

  pure function without_brackets(text) result(rest)
    character(*), intent(in) :: text
    character(:), allocatable :: rest
    logical :: is_inside
    integer :: i

    rest = ""
    is_inside = .false.
    do i = 1, len(text)
      is_inside = is_inside .or. text(i:i) == "["
      if (.not. is_inside) rest = rest//text(i:i)
      is_inside = is_inside .and. text(i:i) /= "]"
    end do
  end function without_brackets

  !> Read a whole file of text. Tabs become blanks; a byte order mark is left out.
  !! Fails if the file is missing, cannot be read, is empty, is longer than 2**29 bytes or holds
  !! bytes that no text has.
  subroutine read_source(path, contents, error)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: contents
    type(error_t), allocatable, intent(out) :: error
    integer(int64) :: n_bytes
    integer :: unit, status
    logical :: is_there

    contents = ""
    inquire (file=path, exist=is_there)
    if (.not. is_there) then
      call fail(error, "no file `"//path//"`")
      return
    end if
    open (newunit=unit, file=path, access="stream", form="unformatted", status="old", &
          action="read", iostat=status)
    if (status == 0) then
      inquire (unit=unit, size=n_bytes)
      if (n_bytes > longest) then
        close (unit)
        call fail(error, "`"//path//"`, which is longer than "//to_text(longest)//" bytes")
        return
      else if (n_bytes > 0) then
        deallocate (contents)
        allocate (character(n_bytes) :: contents)
        read (unit, iostat=status) contents
      else
        call read_to_end(unit, contents, status)
      end if
      close (unit)
    end if
    if (status /= 0) then
      call fail(error, "`"//path//"`, which cannot be read")
    else if (verify(contents, " "//tab//line_feed//carriage_return) == 0) then
      call fail(error, "the empty file `"//path//"`")
    else
      call make_plain(contents, path, error)
    end if
    if (allocated(error)) contents = ""
  end subroutine read_source

  !> The same of a file that another one names, which may keep nobody waiting: a plain file.
  subroutine read_plain_source(path, contents, error)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: contents
    type(error_t), allocatable, intent(out) :: error

    contents = ""
    if (is_no_file(path)) then
      call fail(error, "the "//kind_of_file(path)//" `"//path//"`, which is no plain file")
    else
      call read_source(path, contents, error)
    end if
  end subroutine read_plain_source

  !> All that comes, for a pipe has no size; up to the first byte that no text has, for some
  !! have no end.
  subroutine read_to_end(unit, contents, status)
    integer, intent(in) :: unit
    character(:), allocatable, intent(inout) :: contents
    integer, intent(out) :: status
    character(:), allocatable :: more
    character(1) :: byte
    integer :: n_bytes

    n_bytes = 0
    do
      read (unit, iostat=status) byte
      if (status /= 0) exit
      if (n_bytes == longest) then
        status = 1
        exit
      end if
      if (n_bytes == len(contents)) then
        allocate (character(2*n_bytes + 4096) :: more)
        more(:n_bytes) = contents
        call move_alloc(more, contents)
      end if
      n_bytes = n_bytes + 1
      contents(n_bytes:n_bytes) = byte
      if (byte == achar(0)) exit
    end do
    contents = contents(:n_bytes)
    if (is_iostat_end(status)) status = 0
  end subroutine read_to_end

  pure subroutine make_plain(contents, path, error)
    character(:), allocatable, intent(inout) :: contents
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error
    character(3), parameter :: byte_order_mark = char(239)//char(187)//char(191)
    integer :: i

    if (index(contents, byte_order_mark) == 1) contents = contents(4:)
    do i = 1, len(contents)
      select case (contents(i:i))
      case (tab)
        contents(i:i) = " "
      case (line_feed, carriage_return)
        cycle
      case (achar(0):achar(8), achar(11):achar(12), achar(14):achar(31), achar(127))
        call fail(error, "the binary file `"//path//"`")
        return
      end select
    end do
  end subroutine make_plain

  !> The line from `place` on; `place` moves to the start of the next, after the last one beyond
  !! the end. LF, CR LF and CR end a line.
  pure subroutine next_line(contents, place, line)
    character(*), intent(in) :: contents
    integer, intent(inout) :: place
    character(:), allocatable, intent(out) :: line
    integer :: length

    length = scan(contents(place:), line_feed//carriage_return) - 1
    if (length < 0) length = len(contents) - place + 1
    line = trim(contents(place:place + length - 1))
    place = place + length + 1
    if (place > len(contents)) return
    if (contents(place - 1:place) == carriage_return//line_feed) place = place + 1
  end subroutine next_line

  !> Path that `name` has when it is meant relative to the file `base`, without `.` and `x/..`.
  pure function path_beside(base, name) result(path)
    character(*), intent(in) :: base, name
    character(:), allocatable :: path
    character(:), allocatable :: rest, part
    integer :: slash, before

    rest = name
    if (index(name, "/") /= 1) rest = base(:index(base, "/", back=.true.))//name
    path = ""
    if (index(rest, "/") == 1) path = "/"
    do while (len(rest) > 0)
      slash = index(rest//"/", "/")
      part = rest(:slash - 1)
      rest = rest(min(slash + 1, len(rest) + 1):)
      before = index(path(:max(0, len(path) - 1)), "/", back=.true.)
      if (part == "" .or. part == ".") then
        cycle
      else if (part == ".." .and. len(path) > before .and. path(before + 1:) /= "../" &
               .and. path /= "/") then
        path = path(:before)
      else
        path = path//part
        if (len(rest) > 0) path = path//"/"
      end if
    end do
  end function path_beside

end module text_file