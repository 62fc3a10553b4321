!> What a file is written with: lists of properties and types of HDF5 (who gets one closes it),
!! extents and texts as C wants them.
module hdf5_lists
  use, intrinsic :: iso_c_binding, only: c_int, c_null_char, c_size_t
  use hdf5_library
  implicit none
  private

  public :: parent_maker, chunked, checked_format, text_type, c_extents, c_text

  !> Level 4 saves 2 % of the size for half as much time again.
  integer, parameter, public :: deflate_level = 1

contains

  !> An access list for files in the format of HDF5 1.10, whose headers have checksums.
  integer(hid_t) function checked_format() result(access)
    access = h5pcreate(h5_class_access)
    if (h5pset_formats(access, h5_format_110, h5_format_110) < 0) access = h5_default
  end function checked_format

  !> A link list that makes the groups above a new object.
  integer(hid_t) function parent_maker() result(links)
    links = h5pcreate(h5_class_link)
    if (h5pset_intermediate(links, 1_c_int) < 0) links = h5_default
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

end module hdf5_lists
