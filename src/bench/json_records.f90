!> Records as JSON: a list of flat objects, one a line, which `python -m post bench` reads.
module json_records
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use bench_record, only: record_t, record_list_t
  implicit none
  private

  public :: json_text, check_writable, write_records

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

end module json_records
