!> Quantities against time: balances, tool forces, history points. A sample has its own columns:
!! each quantity is entered in one call with path, unit and meaning, and the datasets follow from
!! that. Samples are collected in memory between frames.
module history
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use hdf5_file, only: hdf5_file_t, h5_int64, h5_double, append_reals, create_series, row_shape
  use unit_system, only: unit_of, unit_system_t
  implicit none
  private

  public :: history_t, history_sample_t, begin_sample, enter
  public :: open_history, record_sample, write_history

  integer, parameter :: n_chunk_samples = 256

  !> A quantity of the history: one dataset with a sample for each time.
  type :: column_t
    character(:), allocatable :: path          ! of the dataset
    character(:), allocatable :: quantity      ! as `unit_of` takes it
    character(:), allocatable :: description
    integer :: n = 1                           ! components
    integer :: first = 0                       ! number of the first one in the sample
    logical :: is_integer = .false.
  end type column_t

  !> All quantities at one time, in the order in which they are entered.
  type :: history_sample_t
    type(column_t), allocatable :: columns(:)
    real(wp), allocatable :: values(:)
    integer, private :: at = 0                 ! column entered last
  end type history_sample_t

  !> Columns and the samples not written yet.
  type :: history_t
    integer :: n_samples = 0                           !! that wait
    type(column_t), allocatable, private :: columns(:)
    real(wp), allocatable, private :: samples(:, :)    ! (values of a sample, room)
  end type history_t

  !> Enter a quantity into a sample: a whole number, a number or a vector.
  interface enter
    module procedure :: enter_integer, enter_number, enter_vector
  end interface enter

contains

  !> All quantities of the sample are entered again.
  pure subroutine begin_sample(sample)
    type(history_sample_t), intent(inout) :: sample

    if (.not. allocated(sample%columns)) allocate (sample%columns(0), sample%values(0))
    sample%at = 0
  end subroutine begin_sample

  subroutine enter_number(sample, path, value, quantity, description)
    type(history_sample_t), intent(inout) :: sample
    character(*), intent(in) :: path, quantity, description
    real(wp), intent(in) :: value

    call enter_vector(sample, path, [value], quantity, description)
  end subroutine enter_number

  subroutine enter_integer(sample, path, value, description)
    type(history_sample_t), intent(inout) :: sample
    character(*), intent(in) :: path, description
    integer(int64), intent(in) :: value

    call enter_vector(sample, path, [real(value, wp)], "1", description, is_integer=.true.)
  end subroutine enter_integer

  !> Fill the column of a path, which the first filling of the sample creates.
  subroutine enter_vector(sample, path, values, quantity, description, is_integer)
    type(history_sample_t), intent(inout) :: sample
    character(*), intent(in) :: path, quantity, description
    real(wp), intent(in) :: values(:)
    logical, intent(in), optional :: is_integer
    type(column_t) :: new
    integer :: i, n

    do i = 1, size(sample%columns)
      sample%at = mod(sample%at, size(sample%columns)) + 1   ! most likely the one after the last
      associate (column => sample%columns(sample%at))
        if (column%path /= path) cycle
        n = min(column%n, size(values))
        sample%values(column%first:column%first + n - 1) = values(:n)
        return
      end associate
    end do
    new%path = path
    new%quantity = quantity
    new%description = description
    new%n = size(values)
    new%first = size(sample%values) + 1
    new%is_integer = present(is_integer)
    sample%columns = [sample%columns, new]
    sample%at = size(sample%columns)
    sample%values = [sample%values, values]
  end subroutine enter_vector

  !> Create a dataset for each column of a sample that was filled once; those of a file that is
  !! continued stay.
  subroutine open_history(history, file, units, sample)
    type(history_t), intent(out) :: history
    type(hdf5_file_t), intent(inout) :: file
    type(unit_system_t), intent(in) :: units
    type(history_sample_t), intent(in) :: sample   !! none of it filled: no history
    integer :: i, n

    n = 0
    allocate (history%columns(0))
    if (allocated(sample%columns)) then
      history%columns = sample%columns
      n = size(sample%values)
    end if
    do i = 1, size(history%columns)
      associate (column => history%columns(i))
        call create_series(file, column%path, merge(h5_int64, h5_double, &
                                                    column%is_integer), row_shape(column%n), &
                           n_chunk_samples, .false., unit_of(units, column%quantity), &
                           column%description)
      end associate
    end do
    allocate (history%samples(n, n_chunk_samples))
  end subroutine open_history

  !> Keep a sample until the next `write_history`; nothing is written here.
  subroutine record_sample(history, sample)
    type(history_t), intent(inout) :: history
    type(history_sample_t), intent(in) :: sample
    integer :: n
    real(wp), allocatable :: wider(:, :)

    if (history%n_samples == size(history%samples, 2)) then
      allocate (wider(size(history%samples, 1), 2*history%n_samples))
      wider(:, :history%n_samples) = history%samples
      call move_alloc(wider, history%samples)
    end if
    history%n_samples = history%n_samples + 1
    n = min(size(sample%values), size(history%samples, 1))   ! later columns have no dataset
    history%samples(:n, history%n_samples) = sample%values(:n)
  end subroutine record_sample

  !> Append the waiting samples, or the first of them, to the datasets; the others remain.
  subroutine write_history(history, file, n_samples)
    type(history_t), intent(inout) :: history
    type(hdf5_file_t), intent(inout) :: file
    integer, intent(in), optional :: n_samples    !! absent: all
    integer :: i, n

    n = history%n_samples
    if (present(n_samples)) n = min(n, n_samples)
    do i = 1, size(history%columns)
      associate (c => history%columns(i))
        call append_reals(file, c%path, [history%samples(c%first:c%first + c%n - 1, :n)], &
                          row_shape(c%n), n)
      end associate
    end do
    history%samples(:, :history%n_samples - n) = history%samples(:, n + 1:history%n_samples)
    history%n_samples = history%n_samples - n
  end subroutine write_history

end module history
