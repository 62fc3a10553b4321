!> The few routines of the HDF5 C library (1.10) that the results layer needs, bound as they are,
!! and what concerns the library as a whole: to make it ready, why a call of it failed, and
!! property lists and types (who gets one closes it), texts and extents as C wants them.
!!
!! The Fortran modules that HDF5 ships serve only the compiler they were built with; these bindings
!! serve any. The variables are constants of the C library, set by `h5open`; nobody writes them.
module hdf5_library
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_funloc, c_funptr, c_int, &
                                         c_int32_t, c_int64_t, c_loc, c_null_char, c_null_funptr, &
                                         c_null_ptr, c_ptr, c_size_t
  implicit none
  private

  public :: parent_maker, chunked, checked_format, text_type, loose_text_type, c_extents, c_text
  public :: failure_reason, is_library_ready

  integer, parameter, public :: hid_t = c_int64_t     !! handles of the library
  integer, parameter, public :: hsize_t = c_int64_t   !! extents
  integer(hid_t), parameter, public :: h5_default = 0_hid_t
  integer(hsize_t), parameter, public :: h5_unlimited = -1_hsize_t
  integer(c_int), parameter, public :: h5_read_only = 0, h5_read_write = 1
  integer(c_int), parameter, public :: h5_truncate = 2, h5_scope_global = 1, h5_select_set = 0
  integer(c_int), parameter, public :: h5_integer = 0, h5_float = 1, h5_string = 3   !! classes
  integer(c_int), parameter, public :: h5_format_110 = 2     !! of the files of HDF5 1.10
  integer(c_int), parameter, public :: h5_walk_upward = 0, h5_null_padded = 1, h5_utf8 = 1

  integer(hid_t), bind(C, name="H5T_NATIVE_DOUBLE_g"), protected, public :: h5_double
  integer(hid_t), bind(C, name="H5T_NATIVE_INT64_g"), protected, public :: h5_int64
  integer(hid_t), bind(C, name="H5T_NATIVE_UINT8_g"), protected, public :: h5_uint8
  integer(hid_t), bind(C, name="H5T_C_S1_g"), protected, public :: h5_character
  integer(hid_t), bind(C, name="H5P_CLS_FILE_ACCESS_ID_g"), protected, public :: h5_class_access
  integer(hid_t), bind(C, name="H5P_CLS_DATASET_CREATE_ID_g"), protected, public :: h5_class_dataset
  integer(hid_t), bind(C, name="H5P_CLS_LINK_CREATE_ID_g"), protected, public :: h5_class_link

  !> Level 4 saves 2 % of the size for half as much time again.
  integer, parameter, public :: deflate_level = 1

  public :: h5fcreate, h5fclose, h5fflush, h5fis_hdf5, h5fget_vfd_handle, h5fget_size, h5gcreate
  public :: h5oopen, h5close, h5lexists, h5lcreate_hard, h5ldelete, h5lget_name, h5fopen, h5dread
  public :: h5dget_storage, h5dget_type, h5aread, h5aget_type, h5aget_space, h5tget_size
  public :: h5tget_class, h5tis_variable, h5sget_npoints, h5acreate, h5aopen, h5aexists, h5awrite
  public :: h5adelete, h5dcreate, h5dwrite, h5dwrite_chunk, h5dset_extent, h5dget_space
  public :: h5screate_simple, h5sselect_hyperslab, h5pcreate

  ! One body each: with `procedure(interface), bind(C)` gfortran 12 may pass by reference what is
  ! passed by value.
  interface
    integer(c_int) function h5dont_atexit() bind(C, name="H5dont_atexit")
      import
    end function h5dont_atexit
    integer(c_int) function h5open() bind(C, name="H5open")
      import
    end function h5open
    integer(hid_t) function h5fcreate(path, flags, creation, access) bind(C, name="H5Fcreate")
      import
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: flags
      integer(hid_t), value :: creation, access
    end function h5fcreate
    integer(hid_t) function h5fopen(path, flags, access) bind(C, name="H5Fopen")
      import
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: flags
      integer(hid_t), value :: access
    end function h5fopen
    integer(c_int) function h5fclose(file) bind(C, name="H5Fclose")
      import
      integer(hid_t), value :: file
    end function h5fclose
    integer(c_int) function h5fflush(file, scope) bind(C, name="H5Fflush")
      import
      integer(hid_t), value :: file
      integer(c_int), value :: scope
    end function h5fflush
    integer(c_int) function h5fis_hdf5(path) bind(C, name="H5Fis_hdf5")
      import
      character(kind=c_char), intent(in) :: path(*)
    end function h5fis_hdf5
    integer(c_int) function h5fget_vfd_handle(file, access, handle) &
      bind(C, name="H5Fget_vfd_handle")
      import
      integer(hid_t), value :: file, access
      type(c_ptr), intent(out) :: handle
    end function h5fget_vfd_handle
    integer(c_int) function h5fget_size(file, n_bytes) bind(C, name="H5Fget_filesize")
      import
      integer(hid_t), value :: file
      integer(hsize_t), intent(out) :: n_bytes
    end function h5fget_size
    integer(hid_t) function h5gcreate(parent, name, links, creation, access) &
      bind(C, name="H5Gcreate2")
      import
      integer(hid_t), value :: parent, links, creation, access
      character(kind=c_char), intent(in) :: name(*)
    end function h5gcreate
    integer(hid_t) function h5oopen(parent, name, access) bind(C, name="H5Oopen")
      import
      integer(hid_t), value :: parent, access
      character(kind=c_char), intent(in) :: name(*)
    end function h5oopen
    integer(c_int) function h5lexists(parent, name, access) bind(C, name="H5Lexists")
      import
      integer(hid_t), value :: parent, access
      character(kind=c_char), intent(in) :: name(*)
    end function h5lexists
    integer(c_size_t) function h5lget_name(parent, group, index, order, n, name, size, access) &
      bind(C, name="H5Lget_name_by_idx")
      import
      integer(hid_t), value :: parent, access
      character(kind=c_char), intent(in) :: group(*)
      integer(c_int), value :: index, order
      integer(hsize_t), value :: n
      character(kind=c_char), intent(out) :: name(*)
      integer(c_size_t), value :: size
    end function h5lget_name
    integer(c_int) function h5lcreate_hard(parent, name, new_parent, new_name, links, access) &
      bind(C, name="H5Lcreate_hard")
      import
      integer(hid_t), value :: parent, new_parent, links, access
      character(kind=c_char), intent(in) :: name(*), new_name(*)
    end function h5lcreate_hard
    integer(c_int) function h5ldelete(parent, name, access) bind(C, name="H5Ldelete")
      import
      integer(hid_t), value :: parent, access
      character(kind=c_char), intent(in) :: name(*)
    end function h5ldelete
    integer(hid_t) function h5acreate(object, name, type, space, creation, access) &
      bind(C, name="H5Acreate2")
      import
      integer(hid_t), value :: object, type, space, creation, access
      character(kind=c_char), intent(in) :: name(*)
    end function h5acreate
    integer(hid_t) function h5aopen(object, name, access) bind(C, name="H5Aopen")
      import
      integer(hid_t), value :: object, access
      character(kind=c_char), intent(in) :: name(*)
    end function h5aopen
    integer(c_int) function h5aexists(object, name) bind(C, name="H5Aexists")
      import
      integer(hid_t), value :: object
      character(kind=c_char), intent(in) :: name(*)
    end function h5aexists
    integer(c_int) function h5awrite(attribute, type, values) bind(C, name="H5Awrite")
      import
      integer(hid_t), value :: attribute, type
      type(c_ptr), value :: values
    end function h5awrite
    integer(c_int) function h5adelete(object, name) bind(C, name="H5Adelete")
      import
      integer(hid_t), value :: object
      character(kind=c_char), intent(in) :: name(*)
    end function h5adelete
    integer(hid_t) function h5dcreate(parent, name, type, space, links, creation, access) &
      bind(C, name="H5Dcreate2")
      import
      integer(hid_t), value :: parent, type, space, links, creation, access
      character(kind=c_char), intent(in) :: name(*)
    end function h5dcreate
    integer(c_int) function h5dwrite(dataset, type, memory, space, transfer, values) &
      bind(C, name="H5Dwrite")
      import
      integer(hid_t), value :: dataset, type, memory, space, transfer
      type(c_ptr), value :: values
    end function h5dwrite
    integer(c_int) function h5dwrite_chunk(dataset, transfer, left_out, first, n_bytes, bytes) &
      bind(C, name="H5Dwrite_chunk")
      import
      integer(hid_t), value :: dataset, transfer
      integer(c_int32_t), value :: left_out   ! filters that were not applied, as bits
      integer(hsize_t), intent(in) :: first(*)
      integer(c_size_t), value :: n_bytes
      type(c_ptr), value :: bytes
    end function h5dwrite_chunk
    integer(c_int) function h5dread(dataset, type, memory, space, transfer, values) &
      bind(C, name="H5Dread")
      import
      integer(hid_t), value :: dataset, type, memory, space, transfer
      type(c_ptr), value :: values
    end function h5dread
    integer(hid_t) function h5dget_type(dataset) bind(C, name="H5Dget_type")
      import
      integer(hid_t), value :: dataset
    end function h5dget_type
    integer(c_int) function h5aread(attribute, type, values) bind(C, name="H5Aread")
      import
      integer(hid_t), value :: attribute, type
      type(c_ptr), value :: values
    end function h5aread
    integer(hid_t) function h5aget_type(attribute) bind(C, name="H5Aget_type")
      import
      integer(hid_t), value :: attribute
    end function h5aget_type
    integer(c_size_t) function h5tget_size(type) bind(C, name="H5Tget_size")
      import
      integer(hid_t), value :: type
    end function h5tget_size
    integer(c_int) function h5tget_class(type) bind(C, name="H5Tget_class")
      import
      integer(hid_t), value :: type
    end function h5tget_class
    integer(c_int) function h5tis_variable(type) bind(C, name="H5Tis_variable_str")
      import
      integer(hid_t), value :: type
    end function h5tis_variable
    integer(hid_t) function h5aget_space(attribute) bind(C, name="H5Aget_space")
      import
      integer(hid_t), value :: attribute
    end function h5aget_space
    integer(hsize_t) function h5dget_storage(dataset) bind(C, name="H5Dget_storage_size")
      import
      integer(hid_t), value :: dataset
    end function h5dget_storage
    integer(hsize_t) function h5sget_npoints(space) bind(C, name="H5Sget_simple_extent_npoints")
      import
      integer(hid_t), value :: space
    end function h5sget_npoints
    integer(c_int) function h5dset_extent(dataset, extents) bind(C, name="H5Dset_extent")
      import
      integer(hid_t), value :: dataset
      integer(hsize_t), intent(in) :: extents(*)
    end function h5dset_extent
    integer(hid_t) function h5dget_space(dataset) bind(C, name="H5Dget_space")
      import
      integer(hid_t), value :: dataset
    end function h5dget_space
    integer(hid_t) function h5screate_simple(rank, extents, limits) bind(C, name="H5Screate_simple")
      import
      integer(c_int), value :: rank
      integer(hsize_t), intent(in) :: extents(*), limits(*)
    end function h5screate_simple
    integer(c_int) function h5sselect_hyperslab(space, operation, first, stride, counts, block) &
      bind(C, name="H5Sselect_hyperslab")
      import
      integer(hid_t), value :: space
      integer(c_int), value :: operation
      integer(hsize_t), intent(in) :: first(*), counts(*)
      type(c_ptr), value :: stride, block
    end function h5sselect_hyperslab
    integer(hid_t) function h5pcreate(class) bind(C, name="H5Pcreate")
      import
      integer(hid_t), value :: class
    end function h5pcreate
    integer(c_int) function h5pset_chunk(list, rank, extents) bind(C, name="H5Pset_chunk")
      import
      integer(hid_t), value :: list
      integer(c_int), value :: rank
      integer(hsize_t), intent(in) :: extents(*)
    end function h5pset_chunk
    integer(c_int) function h5pset_deflate(list, level) bind(C, name="H5Pset_deflate")
      import
      integer(hid_t), value :: list
      integer(c_int), value :: level
    end function h5pset_deflate
    integer(c_int) function h5pset_shuffle(list) bind(C, name="H5Pset_shuffle")
      import
      integer(hid_t), value :: list
    end function h5pset_shuffle
    integer(c_int) function h5pset_parents(list, is_wanted) &
      bind(C, name="H5Pset_create_intermediate_group")
      import
      integer(hid_t), value :: list
      integer(c_int), value :: is_wanted
    end function h5pset_parents
    integer(c_int) function h5pset_formats(list, oldest, newest) &
      bind(C, name="H5Pset_libver_bounds")
      import
      integer(hid_t), value :: list
      integer(c_int), value :: oldest, newest
    end function h5pset_formats
    !> Closes whatever the handle is of, but a file.
    integer(c_int) function h5close(handle) bind(C, name="H5Idec_ref")
      import
      integer(hid_t), value :: handle
    end function h5close
    integer(hid_t) function h5tcopy(type) bind(C, name="H5Tcopy")
      import
      integer(hid_t), value :: type
    end function h5tcopy
    integer(c_int) function h5tset_size(type, n_bytes) bind(C, name="H5Tset_size")
      import
      integer(hid_t), value :: type
      integer(c_size_t), value :: n_bytes
    end function h5tset_size
    integer(c_int) function h5tset_strpad(type, padding) bind(C, name="H5Tset_strpad")
      import
      integer(hid_t), value :: type
      integer(c_int), value :: padding
    end function h5tset_strpad
    integer(c_int) function h5tset_cset(type, encoding) bind(C, name="H5Tset_cset")
      import
      integer(hid_t), value :: type
      integer(c_int), value :: encoding
    end function h5tset_cset
    integer(c_int) function h5eset_auto(stack, reporter, data) bind(C, name="H5Eset_auto2")
      import
      integer(hid_t), value :: stack
      type(c_funptr), value :: reporter
      type(c_ptr), value :: data
    end function h5eset_auto
    integer(c_int) function h5ewalk(stack, direction, visitor, data) bind(C, name="H5Ewalk2")
      import
      integer(hid_t), value :: stack
      integer(c_int), value :: direction
      type(c_funptr), value :: visitor
      type(c_ptr), value :: data
    end function h5ewalk
  end interface

  integer, parameter :: max_length = 512

  ! One entry of the library's error stack (H5E_error2_t).
  type, bind(C) :: entry_t
    integer(hid_t) :: class, major, minor
    integer(c_int) :: line
    type(c_ptr) :: procedure_name, file_name, description
  end type entry_t

  type :: reason_t
    character(max_length) :: text = ""
  end type reason_t

contains

  !> An access list for files in the format of HDF5 1.10, whose headers have checksums.
  integer(hid_t) function checked_format() result(access)
    access = h5pcreate(h5_class_access)
    if (h5pset_formats(access, h5_format_110, h5_format_110) < 0) access = h5_default
  end function checked_format

  !> A link list that makes the groups above a new object.
  integer(hid_t) function parent_maker() result(links)
    links = h5pcreate(h5_class_link)
    if (h5pset_parents(links, 1_c_int) < 0) links = h5_default
  end function parent_maker

  !> A creation list for chunks of these extents, shuffled and deflated if wanted.
  integer(hid_t) function chunked(extents, is_compressed) result(list)
    integer(hsize_t), intent(in) :: extents(:)
    logical, intent(in) :: is_compressed
    integer(c_int) :: status(3)

    list = h5pcreate(h5_class_dataset)
    status = 0
    status(1) = h5pset_chunk(list, int(size(extents), c_int), extents)
    if (is_compressed) then
      status(2) = h5pset_shuffle(list)
      status(3) = h5pset_deflate(list, int(deflate_level, c_int))
    end if
    if (any(status < 0)) list = h5_default
  end function chunked

  !> Fixed-length text, marked as UTF-8 only if it needs to be: VTK 9.3 reads ASCII alone.
  integer(hid_t) function text_type(value) result(type)
    character(*), intent(in) :: value
    integer(c_int) :: status(3)
    integer :: i

    type = h5tcopy(h5_character)
    status(1) = h5tset_size(type, int(max(len(value), 1), c_size_t))
    status(2) = h5tset_strpad(type, h5_null_padded)
    status(3) = 0
    if (any([(iachar(value(i:i)) > 127, i=1, len(value))])) status(3) = h5tset_cset(type, h5_utf8)
    if (any(status < 0)) type = -1
  end function text_type

  !> Text of any length, which VTK wants in its data, and never marked as UTF-8: in either it reads
  !! nothing else.
  integer(hid_t) function loose_text_type() result(type)
    integer(c_size_t), parameter :: any_length = -1

    type = h5tcopy(h5_character)
    if (h5tset_size(type, any_length) < 0) type = -1
  end function loose_text_type

  !> Extents in C order.
  pure function c_extents(shape) result(extents)
    integer, intent(in) :: shape(:)
    integer(hsize_t) :: extents(size(shape))

    extents = shape(size(shape):1:-1)
  end function c_extents

  !> A text without the blanks at its end, and with the zero that ends it in C.
  pure function c_text(text)
    character(*), intent(in) :: text
    character(len_trim(text) + 1) :: c_text

    c_text = trim(text)//c_null_char
  end function c_text

  !> The innermost entry of the library's error stack; of system errors the system's message.
  function failure_reason() result(reason)
    character(:), allocatable :: reason
    type(reason_t), target :: found
    character(*), parameter :: mark = "error message = '"
    integer :: first, length

    reason = "unknown reason"
    if (h5ewalk(h5_default, h5_walk_upward, c_funloc(take_description), c_loc(found)) < 0) return
    if (len_trim(found%text) > 0) reason = trim(found%text)
    first = index(reason, mark)
    if (first == 0) return
    reason = reason(first + len(mark):)
    length = index(reason, "'") - 1
    if (length > 0) reason = reason(:length)
  end function failure_reason

  !> Open the library and keep it from printing its error stack; false if it fails. To be called
  !! before any other call of it: left to itself it closes its files at exit, touches those again
  !! that it could not write, and crashes.
  logical function is_library_ready() result(is_ready)
    if (h5dont_atexit() < 0) continue   ! said from the second call on, and then it is known
    is_ready = h5open() >= 0
    if (is_ready) is_ready = h5eset_auto(h5_default, c_null_funptr, c_null_ptr) >= 0
  end function is_library_ready

  ! Called by the library for each entry, innermost first; ends the walk at the first.
  integer(c_int) function take_description(n, entry, data) bind(C)
    integer(c_int), value :: n
    type(entry_t), intent(in) :: entry
    type(c_ptr), value :: data
    type(reason_t), pointer :: found
    character(kind=c_char), pointer :: letters(:)
    integer :: i

    take_description = 1
    call c_f_pointer(data, found)
    call c_f_pointer(entry%description, letters, [max_length])
    do i = 1, max_length
      if (letters(i) == c_null_char .or. n > 0) exit
      found%text(i:i) = letters(i)
    end do
  end function take_description

end module hdf5_library
