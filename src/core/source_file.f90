!> The bytes of a deck or include file, and its lines whatever ends them.
module source_file
  use, intrinsic :: iso_fortran_env, only: int64
  use failure, only: error_t, fail
  use text, only: to_text
  use system_files, only: is_no_file, kind_of_file
  implicit none
  private

  public :: read_source, read_plain_source, next_line, folder_part, path_beside

  integer, parameter :: longest = 2**29          !! bytes of a file

  character(1), parameter :: tab = achar(9), line_feed = achar(10), carriage_return = achar(13)

contains

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

  !> The folder part of a path with its last slash; empty for a mere file name.
  pure function folder_part(path) result(folder)
    character(*), intent(in) :: path
    character(:), allocatable :: folder

    folder = path(:index(path, "/", back=.true.))
  end function folder_part

  !> Path that `name` has when it is meant relative to the file `base`, without `.` and `x/..`.
  pure function path_beside(base, name) result(path)
    character(*), intent(in) :: base, name
    character(:), allocatable :: path
    character(:), allocatable :: rest, part
    integer :: slash, before

    rest = name
    if (index(name, "/") /= 1) rest = folder_part(base)//name
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

end module source_file
