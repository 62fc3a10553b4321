!> Datasets of an HDF5 file that grow by rows.
module hdf5_series
  use, intrinsic :: iso_fortran_env, only: int64
  use, intrinsic :: iso_c_binding, only: c_int, c_int32_t, c_loc, c_null_ptr, c_ptr, c_size_t
  use kinds, only: wp
  use hdf5_library
  use hdf5_lists, only: c_extents, c_text, chunked
  use hdf5_file, only: create_dataset, file_type, has_object, hdf5_file_t, note_failure
  use deflated_chunk, only: deflated_chunk_t
  implicit none
  private

  public :: create_series, append_reals, append_integers, append_chunk

contains

  !> Create a dataset that grows by rows, unless it is there. Compress only what grows by whole
  !! chunks: a compressed chunk that is extended moves to another place, and a writer killed then
  !! leaves it broken.
  subroutine create_series(file, name, kind_of_values, row_shape, n_chunk_rows, is_compressed, &
                           unit, description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: kind_of_values   !! `real_values`, `integer_values` or `byte_values`
    integer, intent(in) :: row_shape(:)     !! of one row (Fortran order), empty for one number
    integer, intent(in) :: n_chunk_rows     !! rows stored together
    logical, intent(in) :: is_compressed
    character(*), intent(in) :: unit, description
    integer(hsize_t) :: extents(size(row_shape) + 1), limits(size(row_shape) + 1)
    integer(hid_t) :: space, list

    if (allocated(file%error)) return
    if (has_object(file, name)) return
    extents = [0_hsize_t, c_extents(row_shape)]
    limits = [h5_unlimited, c_extents(row_shape)]
    space = h5screate_simple(int(size(extents), c_int), extents, limits)
    list = chunked([int(n_chunk_rows, hsize_t), c_extents(row_shape)], is_compressed)
    call create_dataset(file, name, file_type(kind_of_values), space, list, unit, description)
    if (any([h5sclose(space), h5pclose(list)] < 0)) call note_failure(file, "write", name)
  end subroutine create_series

  !> Append rows of reals to a dataset made by `create_series`.
  subroutine append_reals(file, name, values, row_shape, n_rows)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    real(wp), target, intent(in) :: values(*)   !! row after row
    integer, intent(in) :: row_shape(:)         !! as given to `create_series`
    integer, intent(in) :: n_rows

    call append(file, name, h5_double, c_loc(values), row_shape, n_rows)
  end subroutine append_reals

  !> Append rows of integers to a dataset made by `create_series`.
  subroutine append_integers(file, name, values, row_shape, n_rows)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(int64), target, intent(in) :: values(*)   !! row after row
    integer, intent(in) :: row_shape(:)               !! as given to `create_series`
    integer, intent(in) :: n_rows

    call append(file, name, h5_int64, c_loc(values), row_shape, n_rows)
  end subroutine append_integers

  !> Append rows of reals that are packed as one chunk, to a dataset made by `create_series` with
  !! chunks of as many rows, compressed.
  subroutine append_chunk(file, name, chunk, row_shape, n_rows)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    type(deflated_chunk_t), target, intent(in) :: chunk
    integer, intent(in) :: row_shape(:)         !! as given to `create_series`
    integer, intent(in) :: n_rows
    integer(c_int32_t), parameter :: all_filters = 0
    integer(hsize_t) :: first(size(row_shape) + 1)
    integer(hid_t) :: dataset
    integer(c_int) :: status

    if (allocated(file%error) .or. n_rows == 0) return
    call extend(file, name, n_rows, dataset, first)
    if (allocated(file%error)) return
    status = h5dwrite_chunk(dataset, h5_default, all_filters, first, &
                            int(chunk%n, c_size_t), c_loc(chunk%bytes))
    if (status < 0) call note_failure(file, "write", name)
    if (h5dclose(dataset) < 0) call note_failure(file, "write", name)
  end subroutine append_chunk

  subroutine append(file, name, memory_type, values, row_shape, n_rows)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: memory_type
    type(c_ptr), intent(in) :: values
    integer, intent(in) :: row_shape(:), n_rows
    integer(hsize_t), dimension(size(row_shape) + 1) :: first, counts
    integer(hid_t) :: dataset, space, memory
    integer(c_int) :: status(2)

    if (allocated(file%error) .or. n_rows == 0) return
    call extend(file, name, n_rows, dataset, first)
    if (allocated(file%error)) return
    counts = [int(n_rows, hsize_t), c_extents(row_shape)]
    space = h5dget_space(dataset)
    memory = h5screate_simple(int(size(counts), c_int), counts, counts)
    status(1) = h5sselect_hyperslab(space, h5_select_set, first, c_null_ptr, counts, c_null_ptr)
    status(2) = h5dwrite(dataset, memory_type, memory, space, h5_default, values)
    if (any(status < 0)) call note_failure(file, "write", name)
    if (any([h5sclose(space), h5sclose(memory), h5dclose(dataset)] < 0)) &
      call note_failure(file, "write", name)
  end subroutine append

  !> Open a dataset and make it longer.
  subroutine extend(file, name, n_rows, dataset, first)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: n_rows
    integer(hid_t), intent(out) :: dataset
    integer(hsize_t), intent(out) :: first(:)   !! of the new values
    integer(hsize_t), dimension(size(first)) :: extents, limits
    integer(hid_t) :: space

    dataset = h5dopen(file%id, c_text(name), h5_default)
    if (dataset < 0) then
      call note_failure(file, "write", name)
      return
    end if
    space = h5dget_space(dataset)
    if (h5sget_extent(space, extents, limits) < 0) then
      call note_failure(file, "write", name)
      return
    end if
    first = 0
    first(1) = extents(1)
    extents(1) = extents(1) + n_rows
    if (any([h5sclose(space), h5dset_extent(dataset, extents)] < 0)) &
      call note_failure(file, "write", name)
  end subroutine extend

end module hdf5_series
