!> Named numbers: what a run must know to go on. Whoever holds state puts it here under a name and
!! takes it back; what becomes of the numbers in between is not his concern.
module state_store
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use text, only: to_text
  implicit none
  private

  public :: state_store_t, enter_folder, put, take, put_array, take_array, has_state, add_entry
  public :: empty_store

  !> Numbers under one name.
  type, public :: state_entry_t
    character(:), allocatable :: name
    real(wp), allocatable :: values(:)
  end type state_entry_t

  !> All of them; `entries` is longer than `n_entries` says.
  type :: state_store_t
    integer :: n_entries = 0
    type(state_entry_t), allocatable :: entries(:)
    character(:), allocatable :: folder   !! put before every name, see `enter_folder`
    character(:), allocatable :: fault    !! first name put twice or missed; empty: none
  end type state_store_t

  !> Put a single value; a name counts once. Whole numbers up to 2^53.
  interface put
    module procedure put_real, put_integer, put_long, put_flag
  end interface put

  !> Take a single value; it stays as it is, and `fault` tells, where there is none.
  interface take
    module procedure take_real, take_integer, take_long, take_flag
  end interface take

contains

  !> Forget all numbers, but keep the room that they had: the same ones, put again, need no new one.
  pure subroutine empty_store(store)
    type(state_store_t), intent(inout) :: store

    store%n_entries = 0
    store%fault = ""
  end subroutine empty_store

  !> From now on names mean those of this folder, such as `forces/3`.
  pure subroutine enter_folder(store, folder)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: folder      !! empty: none

    store%folder = folder
    if (folder /= "") store%folder = folder//"/"
    if (.not. allocated(store%fault)) store%fault = ""
  end subroutine enter_folder

  !> Put an array of any shape.
  pure subroutine put_array(store, name, n, values)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n
    real(wp), intent(in) :: values(n)

    call add_entry(store, full_name(store, name), n, values)
  end subroutine put_array

  !> Add numbers under a name with its folder.
  pure subroutine add_entry(store, name, n, values)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n
    real(wp), intent(in) :: values(n)
    type(state_entry_t), allocatable :: wider(:)
    integer :: i

    if (.not. allocated(store%entries)) allocate (store%entries(64))
    if (find(store, name) > 0) then
      call note(store, name//" is put twice")
      return
    end if
    if (store%n_entries == size(store%entries)) then
      allocate (wider(2*store%n_entries))
      do i = 1, store%n_entries
        call move_alloc(store%entries(i)%name, wider(i)%name)
        call move_alloc(store%entries(i)%values, wider(i)%values)
      end do
      call move_alloc(wider, store%entries)
    end if
    store%n_entries = store%n_entries + 1
    store%entries(store%n_entries)%name = name
    store%entries(store%n_entries)%values = values
  end subroutine add_entry

  !> Take an array of the shape that was put.
  pure subroutine take_array(store, name, n, values)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n
    real(wp), intent(inout) :: values(n)
    integer :: place

    place = find(store, full_name(store, name))
    if (place == 0) then
      call note(store, full_name(store, name)//" is missing")
    else if (size(store%entries(place)%values) /= n) then
      call note(store, full_name(store, name)//" has "// &
                to_text(size(store%entries(place)%values))//" numbers instead of "//to_text(n))
    else
      values = store%entries(place)%values
    end if
  end subroutine take_array

  !> Is there something under this name?
  pure logical function has_state(store, name)
    type(state_store_t), intent(in) :: store
    character(*), intent(in) :: name

    has_state = find(store, full_name(store, name)) > 0
  end function has_state

  pure subroutine put_real(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    real(wp), intent(in) :: value

    call put_array(store, name, 1, [value])
  end subroutine put_real

  pure subroutine put_integer(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: value

    call put_array(store, name, 1, [real(value, wp)])
  end subroutine put_integer

  pure subroutine put_long(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer(int64), intent(in) :: value

    call put_array(store, name, 1, [real(value, wp)])
  end subroutine put_long

  pure subroutine put_flag(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    logical, intent(in) :: value

    call put_array(store, name, 1, [merge(1.0_wp, 0.0_wp, value)])
  end subroutine put_flag

  pure subroutine take_real(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    real(wp), intent(inout) :: value
    real(wp) :: values(1)

    values = value
    call take_array(store, name, 1, values)
    value = values(1)
  end subroutine take_real

  pure subroutine take_integer(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(inout) :: value
    real(wp) :: number

    number = real(value, wp)
    call take_real(store, name, number)
    value = nint(number)
  end subroutine take_integer

  pure subroutine take_long(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer(int64), intent(inout) :: value
    real(wp) :: number

    number = real(value, wp)
    call take_real(store, name, number)
    value = nint(number, int64)
  end subroutine take_long

  pure subroutine take_flag(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    logical, intent(inout) :: value
    real(wp) :: number

    number = merge(1.0_wp, 0.0_wp, value)
    call take_real(store, name, number)
    value = number > 0.5_wp
  end subroutine take_flag

  pure function full_name(store, name) result(full)
    type(state_store_t), intent(in) :: store
    character(*), intent(in) :: name
    character(:), allocatable :: full

    full = name
    if (allocated(store%folder)) full = store%folder//name
  end function full_name

  pure integer function find(store, name) result(place)
    type(state_store_t), intent(in) :: store
    character(*), intent(in) :: name
    integer :: i

    place = 0
    do i = store%n_entries, 1, -1
      if (store%entries(i)%name /= name) cycle
      place = i
      return
    end do
  end function find

  !> Keep the first fault.
  pure subroutine note(store, fault)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: fault

    if (.not. allocated(store%fault)) store%fault = ""
    if (store%fault == "") store%fault = fault
  end subroutine note

end module state_store
