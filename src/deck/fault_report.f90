!> The faults of a deck as lines of text.
module fault_report
  use faults, only: fault_t, fault_list_t, n_errors
  use text, only: string_t, to_text
  use system_files, only: true_path
  implicit none
  private

  public :: fault_line, report_faults, sort_faults

  integer, parameter :: most_told = 1000      !! errors, and as many warnings

contains

  !> One fault as `file:line: error: *KEYWORD: found ...; expected ...`.
  pure function fault_line(fault) result(line)
    type(fault_t), intent(in) :: fault
    character(:), allocatable :: line

    line = fault%origin%file
    if (fault%origin%line > 0) line = line//":"//to_text(fault%origin%line)
    if (fault%is_warning) then
      line = line//": warning: "
    else
      line = line//": error: "
    end if
    if (allocated(fault%origin%keyword)) then
      if (fault%origin%keyword /= "") line = line//fault%origin%keyword//": "
    end if
    line = line//"found "//fault%found//"; expected "//fault%expected
  end function fault_line

  !> Write all faults, where their files truly are if the paths do not tell, and the number of
  !! faults; nothing if there are none. Of more than a thousand errors, or warnings, the first.
  subroutine report_faults(faults, unit)
    type(fault_list_t), intent(in) :: faults
    integer, intent(in) :: unit   !! such as error_unit
    integer :: i, kind, n_told(2), n_warnings

    n_told = 0
    do i = 1, faults%n_items
      kind = merge(2, 1, faults%items(i)%is_warning)
      if (n_told(kind) == most_told) cycle
      n_told(kind) = n_told(kind) + 1
      write (unit, "(a)") fault_line(faults%items(i))
    end do
    if (faults%n_items == 0) return
    if (sum(n_told) < faults%n_items) write (unit, "(a)") &
      "... and "//to_text(faults%n_items - sum(n_told))//" more that are left out here"
    call tell_true_paths(faults, unit)
    n_warnings = faults%n_items - n_errors(faults)
    write (unit, "(a)") number_of(n_errors(faults), "error")//", "//number_of(n_warnings, "warning")
  end subroutine report_faults

  !> The true path of each file that is reached by `..` or by a link, once.
  subroutine tell_true_paths(faults, unit)
    type(fault_list_t), intent(in) :: faults
    integer, intent(in) :: unit
    character(:), allocatable :: path, found, told
    integer :: i

    told = new_line("a")
    do i = 1, min(faults%n_items, most_told)
      path = faults%items(i)%origin%file
      if (path == "" .or. index(told, new_line("a")//path//new_line("a")) > 0) cycle
      told = told//path//new_line("a")
      found = true_path(path)
      if (found == path .or. is_tail(found, "/"//path)) cycle
      write (unit, "(a)") path//" is "//found
    end do
  end subroutine tell_true_paths

  pure logical function is_tail(text, tail)
    character(*), intent(in) :: text, tail

    is_tail = len(text) >= len(tail)
    if (is_tail) is_tail = text(len(text) - len(tail) + 1:) == tail
  end function is_tail

  pure function number_of(n, what) result(words)
    integer, intent(in) :: n
    character(*), intent(in) :: what
    character(:), allocatable :: words

    words = to_text(n)//" "//what
    if (n /= 1) words = words//"s"
  end function number_of

  !> Put the faults in the order of `files` and within a file in that of the lines; faults of one
  !! line stay in the order of discovery, faults of no listed file come first.
  pure subroutine sort_faults(faults, files)
    type(fault_list_t), intent(inout) :: faults
    type(string_t), intent(in) :: files(:)
    type(fault_list_t) :: sorted
    integer :: key(2, faults%n_items), order(faults%n_items), i, j

    if (faults%n_items == 0) return
    do i = 1, faults%n_items
      key(:, i) = [0, faults%items(i)%origin%line]
      do j = 1, size(files)
        if (files(j)%value == faults%items(i)%origin%file) key(1, i) = j
        if (key(1, i) > 0) exit
      end do
    end do
    call merge_sort(key, order)
    sorted%n_items = faults%n_items
    allocate (sorted%items(faults%n_items))
    do i = 1, faults%n_items
      sorted%items(i) = faults%items(order(i))
    end do
    call move_alloc(sorted%items, faults%items)
  end subroutine sort_faults

  !> Stable order of keys that compare by their first and then their second entry.
  pure subroutine merge_sort(key, order)
    integer, intent(in) :: key(:, :)     !! shape (2, n)
    integer, intent(out) :: order(:)     !! shape (n)
    integer :: merged(size(order)), width, first, middle, last, i, j, k, n

    n = size(order)
    order = [(i, i=1, n)]
    width = 1
    do while (width < n)
      do first = 1, n, 2*width
        middle = min(first + width, n + 1)
        last = min(first + 2*width, n + 1)
        i = first
        j = middle
        do k = first, last - 1
          if (takes_left(i, middle, j, last)) then
            merged(k) = order(i)
            i = i + 1
          else
            merged(k) = order(j)
            j = j + 1
          end if
        end do
      end do
      order = merged
      width = 2*width
    end do

  contains

    pure logical function takes_left(i, middle, j, last)
      integer, intent(in) :: i, middle, j, last

      takes_left = i < middle
      if (.not. takes_left .or. j >= last) return
      associate (a => key(:, order(i)), b => key(:, order(j)))
        takes_left = a(1) < b(1) .or. (a(1) == b(1) .and. a(2) <= b(2))
      end associate
    end function takes_left

  end subroutine merge_sort

end module fault_report
