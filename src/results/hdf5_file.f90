!> An HDF5 file being written: groups, attributes, datasets of one size.
!!
!! The first failure is kept in the file and every later call does nothing, so a caller writes a
!! sequence and asks once, with `take_error`.
!!
!! A reader may look at the file while it is being written: the library's exclusive lock is turned
!! into a shared one, which lets readers in and still keeps a second writer out.
module hdf5_file
  use, intrinsic :: iso_fortran_env, only: int64
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int, c_int64_t, c_loc, &
                                         c_null_char, c_ptr, c_int32_t, c_null_ptr, c_size_t
  use kinds, only: wp
  use failure, only: error_t, fail
  use hdf5_library
  use existing_result, only: check_replaceable
  use system_files, only: is_same_file, kind_of_file, remove_file, true_path, why_protected, &
                          draft_ending, install_file
  use text, only: to_text
  use file_lock, only: is_lock_shared, is_locked_by_others, lock_t, hold_folder, release_lock
  use deflated_chunk, only: deflated_chunk_t
  implicit none
  private

  public :: hdf5_file_t, create_file, open_file, close_file, give_up_file, flush_file, take_error
  public :: has_object, create_group, link_object, write_text_attribute, write_integer_attribute
  public :: write_text, write_loose_text, write_reals, write_integers
  public :: path_of_open, check_length, place_file
  public :: create_series, row_shape, append_reals, append_chunk
  public :: h5_double, h5_int64, h5_uint8   ! kinds of values in a file

  !> An open file, or a closed one (id negative).
  type :: hdf5_file_t
    character(:), allocatable :: path
    character(:), allocatable :: content          !! kind of result, see `check_replaceable`
    character(:), allocatable :: draft            !! where it lies until `place_file`, if anywhere
    integer(hid_t) :: id = -1                     !! handle of the library
    character(:), allocatable :: link             !! of the system to the open file itself
    logical :: is_shared = .false.                !! readers may open it too
    logical :: is_checked = .false.               !! its headers have checksums
    integer(int64) :: n_bytes = -1                !! after the last flush; negative: not known
    type(error_t), allocatable :: error           !! first failure, see `take_error`
  end type hdf5_file_t

contains

  !> Create the file, replacing an older one.
  !! Fails if the folder cannot be written, if another program is writing the file, or if there is
  !! a file of this name that igaform has not made (most likely a slip of the user).
  subroutine create_file(file, path, is_checked, is_draft, content)
    type(hdf5_file_t), intent(out) :: file
    character(*), intent(in) :: path
    logical, intent(in), optional :: is_checked   !! in the format of 1.10, whose headers have
                                                  !! checksums; older readers do not know it
    logical, intent(in), optional :: is_draft     !! an older file stays until `place_file`
    character(*), intent(in), optional :: content !! of a result that is none of a forming run

    file%path = path
    file%content = ""
    if (present(content)) file%content = content
    if (present(is_checked)) file%is_checked = is_checked
    if (present(is_draft)) then
      if (is_draft) file%draft = true_path(path)//draft_ending
    end if
    call open_held(file, is_new=.true.)
    call write_text_attribute(file, "/", "generator", "igaform")   ! see `is_of_others`
    if (file%content /= "") call write_text_attribute(file, "/", "content", file%content)
  end subroutine create_file

  !> Open a file that this program has written, to add to it.
  subroutine open_file(file, path)
    type(hdf5_file_t), intent(out) :: file
    character(*), intent(in) :: path

    file%path = path
    file%content = ""
    call open_held(file, is_new=.false.)
  end subroutine open_file

  subroutine open_held(file, is_new)
    type(hdf5_file_t), intent(inout) :: file
    logical, intent(in) :: is_new
    type(lock_t) :: lock

    if (.not. is_library_ready()) call note_failure(file, "open HDF5 for", "")
    call hold_folder(file%path, lock)
    call open_locked(file, is_new)
    call release_lock(lock)
  end subroutine open_held

  !> Open or create it if that may be, and let readers open it too.
  subroutine open_locked(file, is_new)
    type(hdf5_file_t), intent(inout) :: file
    logical, intent(in) :: is_new
    type(c_ptr) :: descriptor
    integer(c_int), pointer :: unit
    integer(hid_t) :: access
    integer(c_int) :: status
    logical :: is_there

    inquire (file=file%path, exist=is_there)
    if (is_there) call check_replaceable(file%path, file%content, file%error)
    if (allocated(file%draft) .and. .not. allocated(file%error)) call make_room(file)
    if (allocated(file%error)) return
    if (is_new) then
      access = h5_default
      if (file%is_checked) access = checked_format()
      file%id = h5fcreate(c_text(name_now(file)), h5_truncate, h5_default, access)
      if (file%id < 0) call note_failure(file, "create", "")   ! before the next call clears why
      if (file%is_checked) status = h5close(access)
    else
      file%id = h5fopen(c_text(file%path), h5_read_write, h5_default)
      if (file%id < 0) call note_failure(file, "open", "")
    end if
    if (file%id < 0) then
      if (is_new .and. .not. is_there) call remove_file(file%path)
      if (allocated(file%draft)) call remove_file(file%draft)
    else if (h5fget_vfd_handle(file%id, h5_default, descriptor) >= 0) then
      call c_f_pointer(descriptor, unit)
      file%is_shared = is_lock_shared(unit)
      file%link = "/proc/self/fd/"//to_text(int(unit))
    end if
  end subroutine open_locked

  !> Remove the draft of a killed run; reject that of one that is running.
  !! An older file that may not be written stays, though its folder may be written.
  subroutine make_room(file)
    type(hdf5_file_t), intent(inout) :: file
    character(:), allocatable :: why

    why = why_protected(file%path)
    if (why /= "") then
      call fail(file%error, "result file '"//file%path//"': cannot write it: "//why)
    else if (is_locked_by_others(file%draft)) then
      call fail(file%error, "result file '"//file%path//"': another program is about to write "// &
                "it; choose another name")
    else
      call remove_file(file%draft)
    end if
  end subroutine make_room

  !> Let a file that was created as a draft replace an older one. On failure that stays.
  subroutine place_file(file)
    type(hdf5_file_t), intent(inout) :: file
    type(lock_t) :: lock
    character(:), allocatable :: why

    if (allocated(file%error)) return
    call hold_folder(file%path, lock)
    if (kind_of_file(file%path) /= "") &
      call check_replaceable(file%path, file%content, file%error)
    if (.not. allocated(file%error)) then
      call install_file(file%draft, true_path(file%path), why)
      if (why == "") then
        deallocate (file%draft)
      else
        call fail(file%error, "result file '"//file%path//"': "//why)
      end if
    end if
    call release_lock(lock)
  end subroutine place_file

  pure function name_now(file) result(path)
    type(hdf5_file_t), intent(in) :: file
    character(:), allocatable :: path

    path = file%path
    if (allocated(file%draft)) path = file%draft
  end function name_now

  !> Close the file; what was written is complete.
  subroutine close_file(file)
    type(hdf5_file_t), intent(inout) :: file
    integer(c_int) :: status

    if (file%id < 0) return
    status = h5fclose(file%id)
    file%id = -1
    if (status < 0) call note_failure(file, "close", "")
  end subroutine close_file

  !> Close a file that could not be created as a whole, and remove what there is of it.
  subroutine give_up_file(file)
    type(hdf5_file_t), intent(inout) :: file

    if (file%id < 0) return
    call close_file(file)
    call remove_file(name_now(file))
  end subroutine give_up_file

  !> Hand everything written so far to the operating system, so that it survives the program. Fails
  !! too if the file is no longer there under its name, or not as long as it must be.
  subroutine flush_file(file)
    type(hdf5_file_t), intent(inout) :: file
    integer(hsize_t) :: n_bytes

    if (allocated(file%error)) return
    if (h5fflush(file%id, h5_scope_global) < 0) call note_failure(file, "write", "")
    if (.not. is_in_place(file) .and. .not. allocated(file%error)) call fail(file%error, &
      "result file '"//file%path//"': somebody has deleted, moved or replaced it while the run "// &
      "was writing it")
    file%n_bytes = -1
    if (allocated(file%error)) return
    if (h5fget_size(file%id, n_bytes) >= 0) file%n_bytes = n_bytes
    call check_length(file)
  end subroutine flush_file

  !> Fails if the file is not as long as it was after the last flush: somebody else has written to
  !! it or cut it short. To be called before something is added, which would make up the length.
  subroutine check_length(file)
    type(hdf5_file_t), intent(inout) :: file
    integer(int64) :: n_bytes

    if (allocated(file%error) .or. file%n_bytes < 0) return
    inquire (file=path_of_open(file), size=n_bytes)
    if (n_bytes /= file%n_bytes) call fail(file%error, "result file '"//file%path// &
      "': somebody has changed it while the run was writing it: it has "//to_text(n_bytes)// &
      " bytes instead of "//to_text(file%n_bytes))
  end subroutine check_length

  !> Does the name still lead to the open file? Where the system has no link to open files, to any.
  logical function is_in_place(file)
    type(hdf5_file_t), intent(in) :: file

    inquire (file=name_now(file), exist=is_in_place)
    if (is_in_place) is_in_place = is_same_file(name_now(file), path_of_open(file))
  end function is_in_place

  !> A path to the open file itself, whatever its name may lead to meanwhile; where the system has
  !! no link to open files, its name.
  function path_of_open(file) result(path)
    type(hdf5_file_t), intent(in) :: file
    character(:), allocatable :: path
    logical :: has_link

    path = file%path
    if (.not. allocated(file%link)) return
    inquire (file=file%link, exist=has_link)
    if (has_link) path = file%link
  end function path_of_open

  !> The first failure since the last call, not allocated if there was none.
  subroutine take_error(file, error)
    type(hdf5_file_t), intent(inout) :: file
    type(error_t), allocatable, intent(out) :: error

    call move_alloc(file%error, error)
  end subroutine take_error

  !> Whether the object is there; all groups above it must be.
  logical function has_object(file, name)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: name

    has_object = h5lexists(file%id, c_text(name), h5_default) > 0
  end function has_object

  !> Create a group, with the groups above it, unless it is there.
  subroutine create_group(file, name)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(hid_t) :: group, links

    if (allocated(file%error)) return
    if (has_object(file, name)) return
    links = parent_maker()
    group = h5gcreate(file%id, c_text(name), links, h5_default, h5_default)
    call expect(file, name, group >= 0)
    call expect(file, name, all([h5close(links), h5close(group)] >= 0))
  end subroutine create_group

  !> A second name for an object, unless it is there.
  subroutine link_object(file, name, second_name)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name, second_name
    integer(hid_t) :: links

    if (allocated(file%error)) return
    if (has_object(file, second_name)) return
    links = parent_maker()
    call expect(file, second_name, h5lcreate_hard(file%id, c_text(name), file%id, &
                                                  c_text(second_name), links, h5_default) >= 0)
    call expect(file, second_name, h5close(links) >= 0)
  end subroutine link_object

  !> Write a text attribute of an object, replacing an older one.
  subroutine write_text_attribute(file, object, name, value)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: object   !! path of the group or dataset
    character(*), intent(in) :: name, value
    integer(hid_t) :: owner

    if (allocated(file%error)) return
    owner = h5oopen(file%id, c_text(object), h5_default)
    call put_text_attribute(file, owner, object, name, value)
    call expect(file, object, h5close(owner) >= 0)
  end subroutine write_text_attribute

  subroutine put_text_attribute(file, owner, object, name, value)
    type(hdf5_file_t), intent(inout) :: file
    integer(hid_t), intent(in) :: owner
    character(*), intent(in) :: object, name, value
    character(kind=c_char), target :: buffer(max(len(value), 1))
    type(c_ptr) :: address
    integer(hid_t) :: type

    buffer = letters_of(value)
    type = text_type(value)
    address = c_loc(buffer)
    call put_attribute(file, owner, object, name, type, [integer(hsize_t) ::], address)
    call expect(file, object, h5close(type) >= 0)
  end subroutine put_text_attribute

  !> The letters of a text, a zero for an empty one.
  pure function letters_of(value) result(letters)
    character(*), intent(in) :: value
    character(kind=c_char) :: letters(max(len(value), 1))
    integer :: i

    letters = c_null_char
    do i = 1, len(value)
      letters(i) = value(i:i)
    end do
  end function letters_of

  !> Write integers as an attribute of an object, replacing an older one; one value as a scalar.
  subroutine write_integer_attribute(file, object, name, values)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: object   !! path of the group or dataset
    character(*), intent(in) :: name
    integer, intent(in) :: values(:)
    integer(c_int64_t), target :: buffer(size(values))
    integer(hid_t) :: owner

    if (allocated(file%error)) return
    buffer = values
    owner = h5oopen(file%id, c_text(object), h5_default)
    call put_attribute(file, owner, object, name, h5_int64, &
                       int(row_shape(size(values)), hsize_t), c_loc(buffer))
    call expect(file, object, h5close(owner) >= 0)
  end subroutine write_integer_attribute

  !> Write a text as a scalar dataset, replacing an older one.
  subroutine write_text(file, name, value, description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name, value, description
    character(kind=c_char), target :: buffer(max(len(value), 1))
    type(c_ptr) :: address
    integer(hid_t) :: type

    if (allocated(file%error)) return
    if (has_object(file, name)) &   ! which may have another length
      call expect(file, name, h5ldelete(file%id, c_text(name), h5_default) >= 0)
    buffer = letters_of(value)
    type = text_type(value)
    address = c_loc(buffer)   ! instead of the argument: gfortran 12 mixes up the lengths of texts
    call write_fixed(file, name, type, type, [integer ::], address, "", description)
    call expect(file, name, h5close(type) >= 0)
  end subroutine write_text

  !> Write a text as a list of one, the only form in which VTK's readers take texts as data.
  subroutine write_loose_text(file, name, value, description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name, value, description
    character(kind=c_char), target :: buffer(len(value) + 1)
    type(c_ptr), target :: list(1)
    integer(hid_t) :: type
    integer :: i

    if (allocated(file%error)) return
    buffer = [(value(i:i), i=1, len(value)), c_null_char]
    list(1) = c_loc(buffer)
    type = loose_text_type()
    call write_fixed(file, name, type, type, [1], c_loc(list), "", description)
    call expect(file, name, h5close(type) >= 0)
  end subroutine write_loose_text

  !> Write reals as a dataset of this shape (Fortran order), or overwrite one that is there.
  subroutine write_reals(file, name, values, shape, unit, description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    real(wp), target, intent(in) :: values(*)
    integer, intent(in) :: shape(:)      !! empty for a scalar
    character(*), intent(in) :: unit, description

    call write_fixed(file, name, h5_double, h5_double, shape, c_loc(values), unit, description)
  end subroutine write_reals

  !> Write integers as a dataset of this shape (Fortran order), or overwrite one that is there.
  subroutine write_integers(file, name, values, shape, description, type)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(int64), target, intent(in) :: values(*)
    integer, intent(in) :: shape(:)      !! empty for a scalar
    character(*), intent(in) :: description
    integer(hid_t), intent(in) :: type   !! in the file, `h5_int64` or `h5_uint8`

    call write_fixed(file, name, type, h5_int64, shape, c_loc(values), "1", description)
  end subroutine write_integers

  subroutine write_fixed(file, name, type, memory_type, shape, values, unit, description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: type, memory_type
    integer, intent(in) :: shape(:)
    type(c_ptr), intent(in) :: values
    character(*), intent(in) :: unit, description
    integer(hsize_t) :: extents(size(shape))
    integer(hid_t) :: space, list, dataset

    if (allocated(file%error)) return
    if (.not. has_object(file, name)) then
      extents = c_extents(shape)
      space = h5screate_simple(int(size(shape), c_int), extents, extents)
      list = h5pcreate(h5_class_dataset)
      call create_dataset(file, name, type, space, list, unit, description)
      call expect(file, name, all([h5close(space), h5close(list)] >= 0))
    end if
    if (allocated(file%error) .or. any(shape == 0)) return
    dataset = h5oopen(file%id, c_text(name), h5_default)
    call expect(file, name, h5dwrite(dataset, memory_type, h5_default, h5_default, h5_default, &
                                     values) >= 0)
    call expect(file, name, h5close(dataset) >= 0)
  end subroutine write_fixed

  subroutine create_dataset(file, name, type, space, list, unit, description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name, unit, description
    integer(hid_t), intent(in) :: type, space, list
    integer(hid_t) :: dataset, links

    links = parent_maker()
    dataset = h5dcreate(file%id, c_text(name), type, space, links, list, h5_default)
    call expect(file, name, dataset >= 0)
    if (len(unit) > 0) call put_text_attribute(file, dataset, name, "unit", unit)
    call put_text_attribute(file, dataset, name, "description", description)
    call expect(file, name, all([h5close(links), h5close(dataset)] >= 0))
  end subroutine create_dataset

  subroutine put_attribute(file, owner, object, name, type, extents, values)
    type(hdf5_file_t), intent(inout) :: file
    integer(hid_t), intent(in) :: owner
    character(*), intent(in) :: object, name    !! path of the owner, for messages
    integer(hid_t), intent(in) :: type
    integer(hsize_t), intent(in) :: extents(:)
    type(c_ptr), intent(in) :: values
    integer(hid_t) :: attribute, space
    logical :: is_known

    if (allocated(file%error)) return
    is_known = h5aexists(owner, c_text(name)) > 0
    if (is_known .and. type /= h5_int64) then   ! a text may have another length than before
      if (h5adelete(owner, c_text(name)) < 0) call note_failure(file, "write", object)
      is_known = .false.
    end if
    if (is_known) then
      attribute = h5aopen(owner, c_text(name), h5_default)
    else
      space = h5screate_simple(int(size(extents), c_int), extents, extents)
      attribute = h5acreate(owner, c_text(name), type, space, h5_default, h5_default)
      call expect(file, object, attribute >= 0)
      call expect(file, object, h5close(space) >= 0)
    end if
    call expect(file, object, h5awrite(attribute, type, values) >= 0)
    call expect(file, object, h5close(attribute) >= 0)
  end subroutine put_attribute

  !> Note the failure to write an object, unless it is written. To be called before the next call of
  !! the library, which forgets why.
  subroutine expect(file, object, is_written)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: object
    logical, intent(in) :: is_written

    if (.not. is_written) call note_failure(file, "write", object)
  end subroutine expect

  !> Keep the first failure, with the library's reason.
  subroutine note_failure(file, action, object)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: action, object
    character(:), allocatable :: message

    if (allocated(file%error)) return
    message = "result file '"//file%path//"': cannot "//action//" it"
    if (len(object) > 0) message = message//" (at "//object//")"
    call fail(file%error, message//": "//failure_reason())
  end subroutine note_failure

  !> Create a dataset that grows by rows, unless it is there. Compress only what grows by whole
  !! chunks: a compressed chunk that is extended moves within the file, and a writer killed then
  !! leaves it broken.
  subroutine create_series(file, name, type, row_shape, n_chunk_rows, is_compressed, unit, &
                           description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: type      !! `h5_double`, `h5_int64` or `h5_uint8`
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
    call create_dataset(file, name, type, space, list, unit, description)
    call expect(file, name, all([h5close(space), h5close(list)] >= 0))
  end subroutine create_series

  !> Shape of a row of so many components: none for one number.
  pure function row_shape(n_components) result(shape)
    integer, intent(in) :: n_components
    integer, allocatable :: shape(:)

    allocate (shape(0))
    if (n_components > 1) shape = [n_components]
  end function row_shape

  !> Append rows of numbers to a dataset made by `create_series`, whatever its type.
  subroutine append_reals(file, name, values, row_shape, n_rows)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    real(wp), target, intent(in) :: values(*)   !! row after row
    integer, intent(in) :: row_shape(:)         !! as given to `create_series`
    integer, intent(in) :: n_rows
    integer(hsize_t), dimension(size(row_shape) + 1) :: first, counts
    integer(hid_t) :: dataset, space, memory
    integer(c_int) :: status(2)

    call extend(file, name, row_shape, n_rows, dataset, first)
    if (allocated(file%error) .or. n_rows == 0) return
    counts = [int(n_rows, hsize_t), c_extents(row_shape)]
    space = h5dget_space(dataset)
    memory = h5screate_simple(int(size(counts), c_int), counts, counts)
    status(1) = h5sselect_hyperslab(space, h5_select_set, first, c_null_ptr, counts, c_null_ptr)
    status(2) = h5dwrite(dataset, h5_double, memory, space, h5_default, c_loc(values))
    call expect(file, name, all(status >= 0))
    call expect(file, name, all([h5close(space), h5close(memory), h5close(dataset)] >= 0))
  end subroutine append_reals

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

    call extend(file, name, row_shape, n_rows, dataset, first)
    if (allocated(file%error) .or. n_rows == 0) return
    call expect(file, name, h5dwrite_chunk(dataset, h5_default, all_filters, first, &
                                           int(chunk%n, c_size_t), c_loc(chunk%bytes)) >= 0)
    call expect(file, name, h5close(dataset) >= 0)
  end subroutine append_chunk

  !> Open a dataset and make it longer; nothing happens where there are no rows to append.
  subroutine extend(file, name, row_shape, n_rows, dataset, first)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: row_shape(:), n_rows
    integer(hid_t), intent(out) :: dataset
    integer(hsize_t), intent(out) :: first(:)   !! of the new values
    integer(hid_t) :: space

    if (allocated(file%error) .or. n_rows == 0) return
    dataset = h5oopen(file%id, c_text(name), h5_default)
    call expect(file, name, dataset >= 0)
    if (allocated(file%error)) return
    space = h5dget_space(dataset)
    first = 0
    first(1) = h5sget_npoints(space)/product(row_shape)
    call expect(file, name, all([h5close(space), h5dset_extent(dataset, [first(1) + n_rows, &
                                                                c_extents(row_shape)])] >= 0))
  end subroutine extend

end module hdf5_file
