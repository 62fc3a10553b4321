!> Values packed as the filters of HDF5 pack a chunk: bytes of equal place next to each other
!! (shuffle), then deflated by zlib. Done here and not by HDF5, several chunks can be packed at
!! once, and what packing makes little shorter, such as the last digits of a field, is only copied.
module deflated_chunk
  use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_int8_t, c_loc, c_long, c_null_ptr, &
                                         c_ptr, c_sizeof
  use kinds, only: wp
  use hdf5_library, only: deflate_level
  implicit none
  private

  public :: deflated_chunk_t, new_deflated_chunk

  integer, parameter :: n_bytes_of_real = storage_size(1.0_wp)/8
  !> Bytes that are packed or copied together.
  integer, parameter :: n_stretch = 4096
  !> Room for what zlib adds to a stretch, and at the ends.
  integer, parameter :: n_extra = 64
  integer(c_int), parameter :: copy_level = 0, default_strategy = 0
  integer(c_int), parameter :: go_on = 0, finish = 4, is_ok = 0, is_end = 1   !! of `deflate`

  !> A packed chunk: bytes(:n), none if zlib has failed.
  type :: deflated_chunk_t
    integer(c_int8_t), allocatable :: bytes(:)
    integer(c_long) :: n = 0
  end type deflated_chunk_t

  !> `z_stream` of zlib.
  type, bind(C) :: stream_t
    type(c_ptr) :: next_in = c_null_ptr
    integer(c_int) :: n_in = 0
    integer(c_long) :: total_in = 0
    type(c_ptr) :: next_out = c_null_ptr
    integer(c_int) :: n_out = 0
    integer(c_long) :: total_out = 0
    type(c_ptr) :: message = c_null_ptr, state = c_null_ptr
    type(c_ptr) :: allocator = c_null_ptr, releaser = c_null_ptr, opaque = c_null_ptr
    integer(c_int) :: kind_of_data = 0
    integer(c_long) :: checksum = 0, reserved = 0
  end type stream_t

  interface
    type(c_ptr) function zlib_version() bind(C, name="zlibVersion")
      import :: c_ptr
    end function zlib_version

    integer(c_int) function deflate_init(stream, level, version, n_bytes) &
      bind(C, name="deflateInit_")
      import :: c_int, c_ptr, stream_t
      type(stream_t), intent(inout) :: stream
      integer(c_int), value :: level, n_bytes
      type(c_ptr), value :: version
    end function deflate_init

    integer(c_int) function deflate_params(stream, level, strategy) bind(C, name="deflateParams")
      import :: c_int, stream_t
      type(stream_t), intent(inout) :: stream
      integer(c_int), value :: level, strategy
    end function deflate_params

    integer(c_int) function deflate(stream, flush) bind(C)
      import :: c_int, stream_t
      type(stream_t), intent(inout) :: stream
      integer(c_int), value :: flush
    end function deflate

    integer(c_int) function deflate_end(stream) bind(C, name="deflateEnd")
      import :: c_int, stream_t
      type(stream_t), intent(inout) :: stream
    end function deflate_end
  end interface

contains

  !> Pack rows of values, the components of a row next to each other. May be called by several
  !! threads at once.
  function new_deflated_chunk(values) result(chunk)
    real(wp), intent(in) :: values(:, :)   !! shape (rows, components)
    type(deflated_chunk_t) :: chunk
    integer(c_int8_t), allocatable :: planes(:, :)

    allocate (planes(size(values), n_bytes_of_real))
    call shuffle(values, planes)
    call pack_bytes(size(planes, kind=c_long), planes, chunk)
  end function new_deflated_chunk

  !> First bytes of all values, second bytes of all, ...
  pure subroutine shuffle(values, planes)
    real(wp), intent(in) :: values(:, :)
    integer(c_int8_t), intent(out) :: planes(:, :)     !! (values, bytes of one)
    integer(c_int64_t), allocatable :: bits(:)
    integer :: i, k, b

    allocate (bits(size(values)))
    do k = 1, size(values, 2)
      do i = 1, size(values, 1)
        bits(k + size(values, 2)*(i - 1)) = transfer(values(i, k), bits(1))
      end do
    end do
    do b = 1, n_bytes_of_real
      ! To the top and down again with the sign: a number that a byte holds.
      planes(:, b) = int(shifta(shiftl(bits, 8*(n_bytes_of_real - b)), 8*(n_bytes_of_real - 1)), &
                         c_int8_t)
    end do
  end subroutine shuffle

  !> One stretch after the other, to one zlib stream.
  subroutine pack_bytes(n, bytes, chunk)
    integer(c_long), intent(in) :: n
    integer(c_int8_t), target, intent(in) :: bytes(n)
    type(deflated_chunk_t), target, intent(out) :: chunk
    type(stream_t) :: stream
    integer(c_int) :: level, wanted_level, status
    integer(c_long) :: first, last, room

    room = n + n_extra*(n/n_stretch + 2)
    allocate (chunk%bytes(room))
    level = deflate_level
    status = deflate_init(stream, level, zlib_version(), int(c_sizeof(stream), c_int))
    if (status /= is_ok) return
    stream%next_out = c_loc(chunk%bytes)
    do first = 1, n, n_stretch
      last = min(first + n_stretch - 1, n)
      stream%n_out = int(min(room - stream%total_out, int(huge(level), c_long)), c_int)
      wanted_level = merge(copy_level, int(deflate_level, c_int), is_noise(bytes(first:last)))
      if (wanted_level /= level) status = deflate_params(stream, wanted_level, default_strategy)
      level = wanted_level
      stream%next_in = c_loc(bytes(first))
      stream%n_in = int(last - first + 1, c_int)
      if (status == is_ok) status = deflate(stream, go_on)
    end do
    if (status == is_ok) status = deflate(stream, finish)
    if (status == is_end) chunk%n = stream%total_out
    status = deflate_end(stream)
  end subroutine pack_bytes

  !> Are the values that a byte can have so evenly frequent that packing takes long and saves less
  !! than about a third? A sample decides: with a step that has no factor in common with those of
  !! vectors and of places in elements.
  pure logical function is_noise(bytes)
    integer(c_int8_t), intent(in) :: bytes(:)
    integer, parameter :: n_values = 256, step = 5
    real(wp), parameter :: largest = 20.0_wp   !! found on frames of the channel
    integer :: counts(-n_values/2:n_values/2 - 1), i, n

    counts = 0
    do i = 1, size(bytes), step
      counts(bytes(i)) = counts(bytes(i)) + 1
    end do
    n = sum(counts)
    ! The sum of squares over that which chance makes.
    is_noise = sum(counts**2) < largest*(n + real(n, wp)**2/n_values)
  end function is_noise

end module deflated_chunk
