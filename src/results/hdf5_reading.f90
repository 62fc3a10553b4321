!> An HDF5 file being read: texts and numbers by name. What is not there comes back empty.
module hdf5_reading
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_loc, c_null_char, c_size_t
  use kinds, only: wp
  use text, only: string_t
  use system_files, only: is_no_file
  use hdf5_library
  implicit none
  private

  public :: open_for_reading, close_reading, read_text_attribute, read_text, read_numbers
  public :: names_in, has_name, is_of_others

contains

  !> Handle of a file opened for reading; negative if it cannot be opened or is no plain file.
  integer(hid_t) function open_for_reading(path) result(file)
    character(*), intent(in) :: path

    file = -1
    if (is_no_file(path)) return
    if (.not. is_library_ready()) return
    file = h5fopen(path//c_null_char, h5_read_only, h5_default)
  end function open_for_reading

  !> Close it.
  subroutine close_reading(file)
    integer(hid_t), intent(inout) :: file
    integer(c_int) :: ignored

    if (file >= 0) ignored = h5fclose(file)
    file = -1
  end subroutine close_reading

  !> A text attribute of an object; empty if there is none.
  function read_text_attribute(file, object, name) result(text)
    integer(hid_t), intent(in) :: file
    character(*), intent(in) :: object, name
    character(:), allocatable :: text
    character(kind=c_char), allocatable, target :: letters(:)
    integer(hid_t) :: owner, attribute, type
    integer(c_int) :: ignored

    text = ""
    owner = h5oopen(file, object//c_null_char, h5_default)
    if (owner < 0) return
    attribute = h5aopen(owner, name//c_null_char, h5_default)
    ignored = h5close(owner)
    if (attribute < 0) return
    type = h5aget_type(attribute)
    if (is_one_text(type, h5aget_space(attribute))) then
      allocate (letters(h5tget_size(type)))
      if (h5aread(attribute, type, c_loc(letters)) >= 0) text = plain_text(letters)
    end if
    ignored = h5close(type)
    ignored = h5close(attribute)
  end function read_text_attribute

  !> A text written as a scalar dataset; empty if there is none.
  function read_text(file, name) result(text)
    integer(hid_t), intent(in) :: file
    character(*), intent(in) :: name
    character(:), allocatable :: text
    character(kind=c_char), allocatable, target :: letters(:)
    integer(hid_t) :: dataset, type
    integer(c_int) :: ignored

    text = ""
    dataset = h5oopen(file, name//c_null_char, h5_default)
    if (dataset < 0) return
    type = h5dget_type(dataset)
    if (is_one_text(type, h5dget_space(dataset))) then
      allocate (letters(h5tget_size(type)))
      if (h5dread(dataset, type, h5_default, h5_default, h5_default, c_loc(letters)) >= 0) &
        text = plain_text(letters)
    end if
    ignored = h5close(type)
    ignored = h5close(dataset)
  end function read_text

  !> Is it a single text of a fixed length? Of any other the buffer would be too small. Closes the
  !! space.
  logical function is_one_text(type, space)
    integer(hid_t), intent(in) :: type, space
    integer(hsize_t) :: n
    integer(c_int) :: ignored

    n = h5sget_npoints(space)
    ignored = h5close(space)
    is_one_text = h5tget_class(type) == h5_string
    if (is_one_text) is_one_text = h5tis_variable(type) == 0
    is_one_text = is_one_text .and. n == 1
  end function is_one_text

  !> All numbers of a dataset one after the other; not allocated if they cannot be read.
  subroutine read_numbers(file, name, values)
    integer(hid_t), intent(in) :: file
    character(*), intent(in) :: name
    real(wp), allocatable, target, intent(out) :: values(:)
    integer(hsize_t), parameter :: most_a_byte = 1032   ! that deflate packs into one byte
    integer(hsize_t) :: n, n_bytes, n_all
    integer(hid_t) :: dataset, space, type
    integer(c_int) :: ignored, class
    integer :: status

    dataset = h5oopen(file, name//c_null_char, h5_default)
    if (dataset < 0) return
    space = h5dget_space(dataset)
    n = h5sget_npoints(space)
    ignored = h5close(space)
    type = h5dget_type(dataset)
    class = h5tget_class(type)
    ignored = h5close(type)
    ! A damaged extent must not ask for more memory than the file has numbers, and a damaged length
    ! is none of the file's.
    if (h5fget_size(file, n_all) < 0) n_all = 0
    n_bytes = min(max(h5dget_storage(dataset), 0_hsize_t), n_all)
    if (any(class == [h5_integer, h5_float]) .and. n >= 0 .and. n <= most_a_byte*n_bytes) then
      allocate (values(n), stat=status)
      if (status == 0 .and. n > 0) then
        if (h5dread(dataset, h5_double, h5_default, h5_default, h5_default, c_loc(values)) < 0) &
          deallocate (values)
      end if
    end if
    ignored = h5close(dataset)
  end subroutine read_numbers

  !> Names of what a group holds, in alphabetical order; none if there is no such group.
  function names_in(file, group) result(names)
    integer(hid_t), intent(in) :: file
    character(*), intent(in) :: group
    type(string_t), allocatable :: names(:)
    integer(c_int), parameter :: by_name = 0, rising = 0
    integer, parameter :: longest = 1000
    character(kind=c_char) :: letters(longest)
    type(string_t) :: name
    integer(hsize_t) :: i

    allocate (names(0))
    i = 0
    do
      letters = c_null_char
      if (h5lget_name(file, group//c_null_char, by_name, rising, i, letters, &
                      int(longest, c_size_t), h5_default) < 0) exit
      name%value = plain_text(letters)
      names = [names, name]
      i = i + 1
    end do
  end function names_in

  !> Is this one of the names?
  pure logical function has_name(names, name)
    type(string_t), intent(in) :: names(:)
    character(*), intent(in) :: name
    integer :: i

    has_name = any([(names(i)%value == name, i=1, size(names))])
  end function has_name

  !> Has some other program filled this HDF5 file? Not told of one that does not open, or that is
  !! empty: killed runs leave such files.
  logical function is_of_others(path)
    character(*), intent(in) :: path
    type(string_t), allocatable :: names(:)
    integer(hid_t) :: reading

    is_of_others = .false.
    reading = open_for_reading(path)
    if (reading < 0) return
    names = names_in(reading, "/")
    is_of_others = read_text_attribute(reading, "/", "generator") /= "igaform"
    if (size(names) == 0 .or. has_name(names, "provenance")) is_of_others = .false.
    call close_reading(reading)
  end function is_of_others

  !> Letters up to the first zero.
  pure function plain_text(letters) result(text)
    character(kind=c_char), intent(in) :: letters(:)
    character(:), allocatable :: text
    integer :: i, n

    n = size(letters)
    do i = size(letters), 1, -1
      if (letters(i) == c_null_char) n = i - 1
    end do
    allocate (character(n) :: text)
    text = transfer(letters(:n), text)
  end function plain_text

end module hdf5_reading
