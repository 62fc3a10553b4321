!> The benchmark's tables for people.
module bench_report
  use kinds, only: wp
  use text, only: to_text
  use bench_record, only: record_t, record_list_t, find_record
  implicit none
  private

  public :: heading, record_line, comparison_lines

  character(1), parameter :: feed = new_line("a")

contains

  !> Names of the columns of `record_line`.
  pure function heading() result(line)
    character(:), allocatable :: line

    line = "record                                      threads          ns"// &
           "  +median %   ns/point  of bound %  per"
  end function heading

  !> One record: least time, how far the median lies above it, time a point, share of the bound.
  pure function record_line(record) result(line)
    type(record_t), intent(in) :: record
    character(:), allocatable :: line
    character(140) :: buffer

    write (buffer, "(a44, i7, a12, f11.1, a11, a12, 2x, a)") record%name//repeat(" ", 44), &
      record%threads, short(record%ns), 100.0_wp*record%spread, short(record%ns_per_point), &
      short(100.0_wp*record%share_of_bound), record%per
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

  !> Ratios new over old with their spread, record by record.
  function comparison_lines(new, old) result(lines)
    type(record_list_t), intent(in) :: new, old
    character(:), allocatable :: lines
    character(120) :: buffer
    integer :: i, before, n_alone
    real(wp) :: ratio, spread

    n_alone = 0
    lines = "record                                      threads  new/old   spread"//feed
    do i = 1, new%n
      associate (record => new%items(i))
        before = find_record(old, record%name, record%threads)
        if (before == 0) then
          n_alone = n_alone + 1
          cycle
        end if
        ratio = record%ns/max(old%items(before)%ns, tiny(1.0_wp))
        spread = ratio*norm2([record%spread, old%items(before)%spread])
        write (buffer, "(a44, i7, f9.3, a, f6.3, 2x, a)") record%name//repeat(" ", 44), &
          record%threads, ratio, " +-", spread, trim(judgement(ratio, spread))
        lines = lines//trim(buffer)//feed
      end associate
    end do
    if (n_alone > 0) lines = lines//to_text(n_alone)//" records are new"//feed
  end function comparison_lines

  !> Slower or faster only beyond the spread of both runs.
  pure function judgement(ratio, spread) result(word)
    real(wp), intent(in) :: ratio, spread
    character(6) :: word

    word = ""
    if (ratio > 1.0_wp + spread) word = "slower"
    if (ratio < 1.0_wp - spread) word = "faster"
  end function judgement

end module bench_report
