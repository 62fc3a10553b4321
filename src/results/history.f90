!> Quantities against time: balances, tool forces, history points. A row holds its own columns: each
!! quantity is entered in one call with path, unit and meaning, and the datasets follow from that.
!! Rows are collected in memory between frames.
module history
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use hdf5_file, only: hdf5_file_t, integer_values, real_values, append_reals, create_series, &
                       row_shape
  use unit_system, only: unit_of, unit_system_t
  implicit none
  private

  public :: history_t, history_row_t, begin_row, enter, row_value, row_vector
  public :: open_history, record_row, write_history, forget_rows, n_waiting_rows

  integer, parameter :: n_chunk_rows = 256

  !> A quantity of the history: one dataset with a row for each time.
  type :: column_t
    character(:), allocatable :: path          ! of the dataset
    character(:), allocatable :: quantity      ! as `unit_of` takes it
    character(:), allocatable :: description
    integer :: n = 1                           ! components
    integer :: first = 0                       ! place of the first one in the row
    logical :: is_integer = .false.
  end type column_t

  !> All quantities at one time, in the order in which they are entered.
  type :: history_row_t
    private
    type(column_t), allocatable :: columns(:)
    real(wp), allocatable :: values(:)
    integer :: at = 0                          ! column entered last
  end type history_row_t

  !> Columns and the rows not written yet.
  type :: history_t
    private
    type(column_t), allocatable :: columns(:)
    integer :: n_rows = 0                      ! rows waiting
    real(wp), allocatable :: rows(:, :)        ! (values of a row, room)
  end type history_t

  !> Enter a quantity into a row: a whole number, a number or a vector.
  interface enter
    module procedure :: enter_integer, enter_number, enter_vector
  end interface enter

contains

  !> All quantities of the row are entered again.
  pure subroutine begin_row(row)
    type(history_row_t), intent(inout) :: row

    if (.not. allocated(row%columns)) allocate (row%columns(0), row%values(0))
    row%at = 0
  end subroutine begin_row

  subroutine enter_vector(row, path, values, quantity, description)
    type(history_row_t), intent(inout) :: row
    character(*), intent(in) :: path, quantity, description
    real(wp), intent(in) :: values(:)
    integer :: n

    call take_column(row, path, size(values), quantity, description, .false.)
    associate (column => row%columns(row%at))
      n = min(column%n, size(values))
      row%values(column%first:column%first + n - 1) = values(:n)
    end associate
  end subroutine enter_vector

  subroutine enter_number(row, path, value, quantity, description)
    type(history_row_t), intent(inout) :: row
    character(*), intent(in) :: path, quantity, description
    real(wp), intent(in) :: value

    call take_column(row, path, 1, quantity, description, .false.)
    row%values(row%columns(row%at)%first) = value
  end subroutine enter_number

  subroutine enter_integer(row, path, value, description)
    type(history_row_t), intent(inout) :: row
    character(*), intent(in) :: path, description
    integer(int64), intent(in) :: value

    call take_column(row, path, 1, "1", description, .true.)
    row%values(row%columns(row%at)%first) = real(value, wp)
  end subroutine enter_integer

  !> The column of a path, which the first filling of the row creates.
  subroutine take_column(row, path, n, quantity, description, is_integer)
    type(history_row_t), intent(inout) :: row
    character(*), intent(in) :: path, quantity, description
    integer, intent(in) :: n
    logical, intent(in) :: is_integer
    type(column_t) :: column
    integer :: i

    do i = 1, size(row%columns)
      row%at = mod(row%at, size(row%columns)) + 1   ! that after the last one is the likely one
      if (row%columns(row%at)%path == path) return
    end do
    row%at = size(row%columns) + 1
    column%path = path
    column%quantity = quantity
    column%description = description
    column%n = n
    column%first = size(row%values) + 1
    column%is_integer = is_integer
    row%columns = [row%columns, column]
    row%values = [row%values, (0.0_wp, i=1, n)]
  end subroutine take_column

  !> A number of a row, or a component of a vector; zero where nothing is entered under the path.
  pure real(wp) function row_value(row, path, component) result(value)
    type(history_row_t), intent(in) :: row
    character(*), intent(in) :: path
    integer, intent(in), optional :: component   !! 1 if absent
    integer :: c
    real(wp) :: values(3)

    c = 1
    if (present(component)) c = component
    values = row_vector(row, path, 3)
    value = values(c)
  end function row_value

  !> A vector of a row; zero where nothing is entered under the path.
  pure function row_vector(row, path, n) result(values)
    type(history_row_t), intent(in) :: row
    character(*), intent(in) :: path
    integer, intent(in) :: n
    real(wp) :: values(n)
    integer :: i, last

    values = 0.0_wp
    if (.not. allocated(row%columns)) return
    do i = 1, size(row%columns)
      associate (column => row%columns(i))
        last = min(n, column%n)
        if (column%path == path) values(:last) = row%values(column%first:column%first + last - 1)
      end associate
    end do
  end function row_vector

  !> Create a dataset for each column of a row that was filled once; those of a file that is
  !! continued stay.
  subroutine open_history(history, file, units, row)
    type(history_t), intent(out) :: history
    type(hdf5_file_t), intent(inout) :: file
    type(unit_system_t), intent(in) :: units
    type(history_row_t), intent(in) :: row   !! none of it filled: no history
    integer :: i, n

    n = 0
    allocate (history%columns(0))
    if (allocated(row%columns)) then
      history%columns = row%columns
      n = size(row%values)
    end if
    do i = 1, size(history%columns)
      associate (column => history%columns(i))
        call create_series(file, column%path, merge(integer_values, real_values, &
                                                    column%is_integer), row_shape(column%n), &
                           n_chunk_rows, .false., unit_of(units, column%quantity), &
                           column%description)
      end associate
    end do
    allocate (history%rows(n, n_chunk_rows))
  end subroutine open_history

  !> Keep a row until the next `write_history`; nothing is written here.
  subroutine record_row(history, row)
    type(history_t), intent(inout) :: history
    type(history_row_t), intent(in) :: row
    integer :: n
    real(wp), allocatable :: wider(:, :)

    if (history%n_rows == size(history%rows, 2)) then
      allocate (wider(size(history%rows, 1), 2*history%n_rows))
      wider(:, :history%n_rows) = history%rows
      call move_alloc(wider, history%rows)
    end if
    history%n_rows = history%n_rows + 1
    n = min(size(row%values), size(history%rows, 1))  ! columns after `open_history` have no dataset
    history%rows(:n, history%n_rows) = row%values(:n)
  end subroutine record_row

  !> Rows that wait.
  pure integer function n_waiting_rows(history)
    type(history_t), intent(in) :: history

    n_waiting_rows = history%n_rows
  end function n_waiting_rows

  !> Drop the rows that wait, but for the first.
  pure subroutine forget_rows(history, n_kept)
    type(history_t), intent(inout) :: history
    integer, intent(in) :: n_kept          !! first ones that go on waiting

    history%n_rows = min(history%n_rows, n_kept)
  end subroutine forget_rows

  !> Append the waiting rows, or the first of them, to the datasets; the others go on waiting.
  subroutine write_history(history, file, n_rows)
    type(history_t), intent(inout) :: history
    type(hdf5_file_t), intent(inout) :: file
    integer, intent(in), optional :: n_rows    !! absent: all
    integer :: i, n

    n = history%n_rows
    if (present(n_rows)) n = min(n, n_rows)
    do i = 1, size(history%columns)
      associate (c => history%columns(i))
        call append_reals(file, c%path, [history%rows(c%first:c%first + c%n - 1, :n)], &
                          row_shape(c%n), n)
      end associate
    end do
    history%rows(:, :history%n_rows - n) = history%rows(:, n + 1:history%n_rows)
    history%n_rows = history%n_rows - n
  end subroutine write_history

end module history
