!> Results of the benchmark as a list of records: printed as a table, and stored as JSON, a list of
!! flat objects, one a line, which `python -m post bench` reads.
module bench_record
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  implicit none
  private

  public :: keep_least, heading, record_line, json_text, check_writable, write_records
  public :: is_quiet, unquiet_line

  !> One measurement. Negative numbers stand for what is not known.
  type, public :: record_t
    character(:), allocatable :: name
    integer :: threads = 1
    real(wp) :: ns = 0.0_wp                   !! least of all repetitions, per unit [ns]
    real(wp) :: median = 0.0_wp               !! of all repetitions [ns]
    real(wp) :: spread = 0.0_wp               !! (median - least)/least
    integer :: repetitions = 0
    character(:), allocatable :: per          !! the unit: element-step, point, byte ...
    real(wp) :: ns_per_point = -1.0_wp        !! per integration point
    real(wp) :: flops = -1.0_wp               !! operations a unit, by formula
    real(wp) :: bytes = -1.0_wp               !! moved a unit, by formula
    real(wp) :: working_set = -1.0_wp         !! touched over and over [byte]
    real(wp) :: memory_ratio = -1.0_wp        !! memory held over that of the state alone
  end type record_t

contains

  !> Append a record, or merge it with the one of its name and threads: the least of both times, the
  !! mean of both medians, weighted by the repetitions.
  subroutine keep_least(records, record)
    type(record_t), allocatable, intent(inout) :: records(:)
    type(record_t), intent(in) :: record
    type(record_t) :: merged
    integer :: i, n

    do i = 1, size(records)
      if (records(i)%name == record%name .and. records(i)%threads == record%threads) exit
    end do
    if (i > size(records)) then
      records = [records, record]
      return
    end if
    merged = record
    associate (before => records(i))
      n = before%repetitions + record%repetitions
      if (before%ns < record%ns) merged = before
      merged%median = (before%median*before%repetitions + record%median*record%repetitions)/n
      merged%repetitions = n
      merged%spread = max(0.0_wp, merged%median/merged%ns - 1.0_wp)
    end associate
    records(i) = merged
  end subroutine keep_least

  !> Does the spread of a record with several threads allow to compare it? With one thread processor
  !! time counts, which other programs do not lengthen; of the machine only the least time is used.
  elemental logical function is_quiet(record)
    type(record_t), intent(in) :: record
    real(wp), parameter :: largest = 0.05_wp

    is_quiet = record%threads == 1 .or. record%spread < largest .or. is_of_machine(record)
  end function is_quiet

  elemental logical function is_of_machine(record)
    type(record_t), intent(in) :: record

    is_of_machine = index(record%name, "machine/") == 1
  end function is_of_machine

  !> How many records are not to be relied on; empty if none.
  pure function unquiet_line(records) result(line)
    type(record_t), intent(in) :: records(:)
    character(:), allocatable :: line
    integer :: n

    n = count(.not. is_quiet(records))
    line = ""
    if (n > 0) line = "the machine is not quiet: "//to_text(n)//" of "// &
                      to_text(count(records%threads > 1 .and. .not. is_of_machine(records)))// &
                      " records with several threads spread by 5 % or more"
  end function unquiet_line

  !> Names of the columns of `record_line`.
  pure function heading() result(line)
    character(:), allocatable :: line

    line = "record                                      threads          ns"// &
           "  +median %   ns/point  per"
  end function heading

  !> One record: least time, how far the median lies above it, time a point.
  pure function record_line(record) result(line)
    type(record_t), intent(in) :: record
    character(:), allocatable :: line
    character(140) :: buffer

    write (buffer, "(a44, i7, a12, f11.1, a11, 2x, a)") record%name//repeat(" ", 44), &
      record%threads, short(record%ns), 100.0_wp*record%spread, short(record%ns_per_point), &
      record%per
    line = trim(buffer)
    if (.not. is_quiet(record)) line = line//"  (not quiet)"
  end function record_line

  !> A number of about four digits; a dash if it is not known.
  pure function short(value) result(word)
    real(wp), intent(in) :: value
    character(10) :: word

    if (value < 0.0_wp) then
      word = "-"
    else if (value < 1.0_wp) then
      write (word, "(f10.4)") value
    else if (value < 1.0e4_wp) then
      write (word, "(f10.1)") value
    else
      write (word, "(es10.2e2)") value
    end if
    word = adjustr(word)
  end function short

  !> The list as JSON; numbers that are not known are null.
  pure function json_text(records) result(text)
    type(record_t), intent(in) :: records(:)
    character(:), allocatable :: text
    integer :: i

    text = "["
    do i = 1, size(records)
      if (i > 1) text = text//","
      text = text//new_line("a")//object(records(i))
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
           //', "memory_ratio": '//number(record%memory_ratio)//"}"
  end function object

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
    type(record_t), intent(in) :: records(:)
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

end module bench_record
