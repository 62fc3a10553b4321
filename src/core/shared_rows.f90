!> Rows of numbers in memory that a process shares with those that it forks: what one of them has
!! put there stays when it ends, however that may be.
module shared_rows
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int, c_intptr_t, c_long, &
                                         c_null_ptr, c_ptr, c_size_t, c_sizeof
  use kinds, only: wp
  implicit none
  private

  public :: shared_rows_t, new_rows, free_rows, begin_rows, add_row, end_rows
  public :: is_begun, is_ended, failure_of, warning_of, values_of

  integer, parameter :: longest = 1000
  integer(c_int), parameter :: begun = 1, ended = 2

  !> What stands in front of the rows.
  type, bind(C) :: head_t
    integer(c_int) :: n = 0, stage = 0
    character(kind=c_char) :: failure(longest) = " ", warning(longest) = " "
  end type head_t

  !> Rows and what is reported of them.
  type :: shared_rows_t
    private
    type(c_ptr) :: start = c_null_ptr
    integer(c_size_t) :: n_bytes = 0
    type(head_t), pointer :: head => null()
    real(wp), pointer, contiguous :: values(:, :) => null()   ! shape (columns, rows)
  end type shared_rows_t

  interface
    type(c_ptr) function c_mmap(place, n_bytes, access, flags, descriptor, offset) &
        bind(C, name="mmap")
      import :: c_int, c_long, c_ptr, c_size_t
      type(c_ptr), value :: place
      integer(c_size_t), value :: n_bytes
      integer(c_int), value :: access, flags, descriptor
      integer(c_long), value :: offset
    end function c_mmap

    integer(c_int) function c_munmap(place, n_bytes) bind(C, name="munmap")
      import :: c_int, c_ptr, c_size_t
      type(c_ptr), value :: place
      integer(c_size_t), value :: n_bytes
    end function c_munmap
  end interface

contains

  !> Room for rows; false if there is no memory.
  logical function new_rows(rows, n_columns, n_most) result(is_done)
    type(shared_rows_t), intent(out) :: rows
    integer, intent(in) :: n_columns, n_most   !! numbers in a row; rows
    integer(c_int), parameter :: to_read_and_write = 3
    integer(c_int), parameter :: shared_without_file = 33   ! MAP_SHARED + MAP_ANONYMOUS of Linux
    integer(c_int), parameter :: no_file = -1
    integer(c_size_t), parameter :: line = 64
    integer(c_size_t) :: n_head
    integer(c_intptr_t) :: address
    type(c_ptr) :: place
    type(head_t) :: empty

    n_head = iand(c_sizeof(empty) + line - 1, not(line - 1))   ! up to the next whole line
    rows%n_bytes = n_head + 8_c_size_t*n_columns*n_most
    place = c_mmap(c_null_ptr, rows%n_bytes, to_read_and_write, shared_without_file, no_file, &
                   0_c_long)
    address = transfer(place, address)
    is_done = address /= -1_c_intptr_t         ! MAP_FAILED
    if (.not. is_done) return
    rows%start = place
    call c_f_pointer(place, rows%head)
    rows%head = empty
    call c_f_pointer(transfer(address + n_head, place), rows%values, [n_columns, n_most])
  end function new_rows

  !> Give the room back.
  subroutine free_rows(rows)
    type(shared_rows_t), intent(inout) :: rows
    integer(c_int) :: ignored

    if (associated(rows%head)) ignored = c_munmap(rows%start, rows%n_bytes)
    rows = shared_rows_t()
  end subroutine free_rows

  !> Whoever adds the rows begins.
  subroutine begin_rows(rows)
    type(shared_rows_t), intent(inout) :: rows

    rows%head%stage = begun
  end subroutine begin_rows

  !> Add a row; it counts only when all of it is there.
  subroutine add_row(rows, values)
    type(shared_rows_t), intent(inout) :: rows
    real(wp), intent(in) :: values(:)

    rows%values(:, rows%head%n + 1) = values
    rows%head%n = rows%head%n + 1
  end subroutine add_row

  !> All is done; the texts are empty where there is nothing to report.
  subroutine end_rows(rows, failure, warning)
    type(shared_rows_t), intent(inout) :: rows
    character(*), intent(in) :: failure, warning
    integer :: i

    do i = 1, min(longest, len(failure))
      rows%head%failure(i) = failure(i:i)
    end do
    do i = 1, min(longest, len(warning))
      rows%head%warning(i) = warning(i:i)
    end do
    rows%head%stage = ended
  end subroutine end_rows

  !> Has somebody begun to add rows?
  logical function is_begun(rows)
    type(shared_rows_t), intent(in) :: rows

    is_begun = rows%head%stage >= begun
  end function is_begun

  !> Was the end reported?
  logical function is_ended(rows)
    type(shared_rows_t), intent(in) :: rows

    is_ended = rows%head%stage == ended
  end function is_ended

  !> Why it failed, empty if it did not.
  function failure_of(rows) result(text)
    type(shared_rows_t), intent(in) :: rows
    character(:), allocatable :: text

    text = text_of(rows%head%failure)
  end function failure_of

  !> What it warned of, empty for nothing.
  function warning_of(rows) result(text)
    type(shared_rows_t), intent(in) :: rows
    character(:), allocatable :: text

    text = text_of(rows%head%warning)
  end function warning_of

  pure function text_of(characters) result(text)
    character(kind=c_char), intent(in) :: characters(longest)
    character(:), allocatable :: text
    character(longest) :: all
    integer :: i

    do i = 1, longest
      all(i:i) = characters(i)
    end do
    text = trim(all)
  end function text_of

  !> The rows that are there, shape (columns, rows).
  function values_of(rows) result(values)
    type(shared_rows_t), intent(in) :: rows
    real(wp), allocatable :: values(:, :)

    values = rows%values(:, :rows%head%n)
  end function values_of

end module shared_rows
