!> The benchmark's table of records for people.
module bench_report
  use kinds, only: wp
  use bench_record, only: record_t
  implicit none
  private

  public :: heading, record_line

contains

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

end module bench_report
