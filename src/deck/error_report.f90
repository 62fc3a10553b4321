!> The errors of a deck as lines of text.
module error_report
  use kinds, only: wp
  use linear_algebra, only: sorted_order
  use input_errors, only: input_error_t, error_list_t, n_errors
  use text, only: string_t, to_text, counted
  use system_files, only: true_path
  implicit none
  private

  public :: error_line, report_errors, sort_errors

  integer, parameter :: most_listed = 1000      !! errors, and as many warnings

contains

  !> One error as `file:line: error: *KEYWORD: found ...; expected ...`.
  pure function error_line(reason) result(line)
    type(input_error_t), intent(in) :: reason
    character(:), allocatable :: line

    line = reason%origin%file
    if (reason%origin%line > 0) line = line//":"//to_text(reason%origin%line)
    if (reason%is_warning) then
      line = line//": warning: "
    else
      line = line//": error: "
    end if
    if (allocated(reason%origin%keyword)) then
      if (reason%origin%keyword /= "") line = line//reason%origin%keyword//": "
    end if
    line = line//"found "//reason%found//"; expected "//reason%expected
  end function error_line

  !> Write all errors, where their files truly are if the paths do not tell, and the number of
  !! errors; nothing if there are none. Of more than a thousand errors, or warnings, the first.
  subroutine report_errors(errors, unit)
    type(error_list_t), intent(in) :: errors
    integer, intent(in) :: unit   !! such as error_unit
    integer :: i, kind, n_listed(2), n_warnings

    n_listed = 0
    do i = 1, errors%n_items
      kind = merge(2, 1, errors%items(i)%is_warning)
      if (n_listed(kind) == most_listed) cycle
      n_listed(kind) = n_listed(kind) + 1
      write (unit, "(a)") error_line(errors%items(i))
    end do
    if (errors%n_items == 0) return
    if (sum(n_listed) < errors%n_items) write (unit, "(a)") &
      "... and "//to_text(errors%n_items - sum(n_listed))//" more that are not listed"
    call list_true_paths(errors, unit)
    n_warnings = errors%n_items - n_errors(errors)
    write (unit, "(a)") counted(n_errors(errors), "error")//", "//counted(n_warnings, "warning")
  end subroutine report_errors

  !> The true path of each file that is reached by `..` or by a link, once.
  subroutine list_true_paths(errors, unit)
    type(error_list_t), intent(in) :: errors
    integer, intent(in) :: unit
    character(:), allocatable :: path, found, listed
    integer :: i

    listed = new_line("a")
    do i = 1, min(errors%n_items, most_listed)
      path = errors%items(i)%origin%file
      if (path == "" .or. index(listed, new_line("a")//path//new_line("a")) > 0) cycle
      listed = listed//path//new_line("a")
      found = true_path(path)
      if (found == path .or. is_tail(found, "/"//path)) cycle
      write (unit, "(a)") path//" is "//found
    end do
  end subroutine list_true_paths

  pure logical function is_tail(text, tail)
    character(*), intent(in) :: text, tail

    is_tail = len(text) >= len(tail)
    if (is_tail) is_tail = text(len(text) - len(tail) + 1:) == tail
  end function is_tail

  !> Put the errors in the order of `files` and within a file in that of the lines; errors of one
  !! line stay in the order of discovery, errors of no listed file come first.
  pure subroutine sort_errors(errors, files)
    type(error_list_t), intent(inout) :: errors
    type(string_t), intent(in) :: files(:)
    type(error_list_t) :: sorted
    real(wp), parameter :: most_lines = 1.0e10_wp   ! of a file
    real(wp) :: place(errors%n_items)
    integer :: order(errors%n_items), i, j

    if (errors%n_items == 0) return
    do i = 1, errors%n_items
      place(i) = errors%items(i)%origin%line
      do j = 1, size(files)
        if (files(j)%value /= errors%items(i)%origin%file) cycle
        place(i) = place(i) + most_lines*j
        exit
      end do
    end do
    order = sorted_order(place)
    sorted%n_items = errors%n_items
    allocate (sorted%items(errors%n_items))
    do i = 1, errors%n_items
      sorted%items(i) = errors%items(order(i))
    end do
    call move_alloc(sorted%items, errors%items)
  end subroutine sort_errors

end module error_report
