!> Records as JSON and back: a list of objects, one a line. The reader takes what the writer writes
!! and nothing else than lists of flat objects.
module json_records
  use kinds, only: wp
  use errors, only: error_t, fail
  use text, only: to_text, read_real
  use whole_file, only: read_whole_file
  use bench_record, only: record_t, record_list_t, add_record
  implicit none
  private

  public :: json_text, check_writable, write_records, read_records, records_of

  character(*), parameter :: blanks = " "//achar(9)//achar(10)//achar(13)

  !> A text and how far it has been read. The first fault stays.
  type :: reader_t
    character(:), allocatable :: text
    integer :: at = 1
    type(error_t), allocatable :: error
  end type reader_t

contains

  !> The list as JSON; numbers that are not known are null.
  pure function json_text(records) result(text)
    type(record_list_t), intent(in) :: records
    character(:), allocatable :: text
    integer :: i

    text = "["
    do i = 1, records%n
      if (i > 1) text = text//","
      text = text//new_line("a")//object(records%items(i))
    end do
    text = text//new_line("a")//"]"//new_line("a")
  end function json_text

  pure function object(record) result(text)
    type(record_t), intent(in) :: record
    character(:), allocatable :: text

    text = '{"name": "'//record%name//'", "threads": '//to_text(record%threads) &
           //', "ns": '//number(record%ns)//', "median": '//number(record%median) &
           //', "spread": '//number(record%spread)//', "repetitions": ' &
           //to_text(record%repetitions)//', "per": "'//record%per//'", "ns_per_point": ' &
           //number(record%ns_per_point)//', "flops": '//number(record%flops)//', "bytes": ' &
           //number(record%bytes)//', "working_set": '//number(record%working_set) &
           //', "memory_ratio": '//number(record%memory_ratio) &
           //', "share_of_bound": '//number(record%share_of_bound)//', "target": ' &
           //number(record%target)//', "is_met": '//met(record)//"}"
  end function object

  pure function met(record) result(word)
    type(record_t), intent(in) :: record
    character(:), allocatable :: word

    word = "null"
    if (record%target < 0.0_wp) return
    word = "false"
    if (record%ns <= record%target) word = "true"
  end function met

  !> Six digits, as JSON wants them: no blank, a digit on either side of the point.
  pure function number(value) result(text)
    real(wp), intent(in) :: value
    character(:), allocatable :: text
    character(16) :: buffer

    text = "null"
    if (.not. (value >= 0.0_wp .and. value <= huge(value))) return
    write (buffer, "(es14.6e3)") value
    text = trim(adjustl(buffer))
  end function number

  !> Write the list to a file.
  subroutine write_records(path, records, error)
    character(*), intent(in) :: path
    type(record_list_t), intent(in) :: records
    type(error_t), allocatable, intent(out) :: error
    integer :: unit, status
    character(256) :: message

    open (newunit=unit, file=path, action="write", status="replace", access="stream", &
          form="unformatted", iostat=status, iomsg=message)
    if (status == 0) then
      write (unit, iostat=status, iomsg=message) json_text(records)
      close (unit)
    end if
    if (status /= 0) call fail(error, "cannot write '"//path//"': "//trim(message))
  end subroutine write_records

  !> Try whether a file can be written, before it takes minutes to find out. Leaves it as it is.
  subroutine check_writable(path, error)
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error
    integer :: unit, status
    logical :: was_there
    character(256) :: message

    inquire (file=path, exist=was_there)
    open (newunit=unit, file=path, action="write", position="append", access="stream", &
          form="unformatted", iostat=status, iomsg=message)
    if (status /= 0) then
      call fail(error, "cannot write '"//path//"': "//trim(message))
    else if (was_there) then
      close (unit)
    else
      close (unit, status="delete")
    end if
  end subroutine check_writable

  !> Read a list from a file; an error names the file and the line.
  subroutine read_records(path, records, error)
    character(*), intent(in) :: path
    type(record_list_t), intent(out) :: records
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: text
    logical :: is_there

    call read_whole_file(path, text, is_there)
    if (.not. is_there) then
      call fail(error, "cannot read '"//path//"'")
      return
    end if
    call records_of(text, records, error)
    if (allocated(error)) error%message = path//", "//error%message
  end subroutine read_records

  !> The records of a JSON text. Name, threads, ns and spread must be there; a key that is not known
  !! is passed over.
  subroutine records_of(text, records, error)
    character(*), intent(in) :: text
    type(record_list_t), intent(out) :: records
    type(error_t), allocatable, intent(out) :: error
    type(reader_t) :: reader

    reader%text = text
    call expect(reader, "[")
    if (next(reader) == "]") then
      call expect(reader, "]")
    else
      do
        call take_object(reader, records)
        if (allocated(reader%error)) exit
        if (next(reader) /= ",") then
          call expect(reader, "]")
          exit
        end if
        call expect(reader, ",")
      end do
    end if
    if (next(reader) /= "") call complain(reader, "nothing behind the list")
    if (allocated(reader%error)) call move_alloc(reader%error, error)
  end subroutine records_of

  subroutine take_object(reader, records)
    type(reader_t), intent(inout) :: reader
    type(record_list_t), intent(inout) :: records
    type(record_t) :: record
    character(:), allocatable :: key

    record%name = ""
    record%per = ""
    record%threads = 0
    record%ns = -1.0_wp
    record%spread = -1.0_wp
    call expect(reader, "{")
    do
      key = text_value(reader)
      call expect(reader, ":")
      call take_value(reader, key, record)
      if (next(reader) /= "," .or. allocated(reader%error)) exit
      call expect(reader, ",")
    end do
    call expect(reader, "}")
    if (record%name == "" .or. record%threads < 1 .or. .not. record%ns >= 0.0_wp .or. &
        .not. record%spread >= 0.0_wp) then
      call complain(reader, "a record with name, threads, ns and spread before this")
    end if
    if (.not. allocated(reader%error)) call add_record(records, record)
  end subroutine take_object

  subroutine take_value(reader, key, record)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: key
    type(record_t), intent(inout) :: record
    real(wp) :: value

    if (next(reader) == '"') then
      if (key == "name") then
        record%name = text_value(reader)
      else if (key == "per") then
        record%per = text_value(reader)
      else if (text_value(reader) == "") then
        return
      end if
      return
    end if
    value = number_value(reader)
    select case (key)
    case ("threads")
      record%threads = nint(value)
    case ("ns")
      record%ns = value
    case ("median")
      record%median = value
    case ("spread")
      record%spread = value
    case ("memory_ratio")
      record%memory_ratio = value
    case ("share_of_bound")
      record%share_of_bound = value
    end select
  end subroutine take_value

  !> A number, or -1 for null, true and false.
  function number_value(reader) result(value)
    type(reader_t), intent(inout) :: reader
    real(wp) :: value
    character(:), allocatable :: word
    integer :: length
    logical :: is_number

    value = -1.0_wp
    if (next(reader) == "") then
      call complain(reader, "a value")
      return
    end if
    length = scan(reader%text(reader%at:), ",}]:"//blanks) - 1
    if (length < 0) length = len(reader%text) - reader%at + 1
    word = reader%text(reader%at:reader%at + length - 1)
    if (any(word == [character(5) :: "null", "true", "false"])) then
      reader%at = reader%at + length
      return
    end if
    call read_real(word, value, is_number)
    if (is_number) then
      reader%at = reader%at + length
    else
      call complain(reader, "a number, a text, true, false or null")
    end if
  end function number_value

  function text_value(reader) result(value)
    type(reader_t), intent(inout) :: reader
    character(:), allocatable :: value
    integer :: length

    value = ""
    call expect(reader, '"')
    if (allocated(reader%error)) return
    length = index(reader%text(reader%at:), '"') - 1
    if (length < 0 .or. scan(reader%text(reader%at:reader%at + max(length, 0) - 1), "\") > 0) then
      call complain(reader, "a text that ends with a quote and holds no backslash")
      return
    end if
    value = reader%text(reader%at:reader%at + length - 1)
    reader%at = reader%at + length + 1
  end function text_value

  !> The next character that is no blank, which is not passed; empty at the end.
  character(1) function next(reader)
    type(reader_t), intent(inout) :: reader
    integer :: skip

    next = ""
    if (reader%at > len(reader%text)) return
    skip = verify(reader%text(reader%at:), blanks)
    if (skip == 0) then
      reader%at = len(reader%text) + 1
      return
    end if
    reader%at = reader%at + skip - 1
    next = reader%text(reader%at:reader%at)
  end function next

  !> Pass one character that must be there.
  subroutine expect(reader, character)
    type(reader_t), intent(inout) :: reader
    character(1), intent(in) :: character

    if (next(reader) == character) then
      reader%at = reader%at + 1
    else
      call complain(reader, "'"//character//"'")
    end if
  end subroutine expect

  subroutine complain(reader, expected)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: expected
    integer :: i, line

    if (allocated(reader%error)) return
    line = 1
    do i = 1, min(reader%at, len(reader%text)) - 1
      if (reader%text(i:i) == new_line("a")) line = line + 1
    end do
    call fail(reader%error, "line "//to_text(line)//": expected "//expected)
    reader%at = len(reader%text) + 1
  end subroutine complain

end module json_records
