!> Named numbers: what a run must know to go on. Whoever holds state puts it here under a name and
!! takes it back; what becomes of the numbers in between is not his concern. A store with a visitor
!! shows him tables where they are, see `visitor_t`.
module state_store
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use text, only: to_text, counted
  implicit none
  private

  public :: state_store_t, enter_folder, carry, carry_array, carry_field, carry_flags
  public :: carry_indices, carry_columns, has_state
  public :: add_entry
  public :: empty_store

  !> Numbers under one name.
  type, public :: state_entry_t
    character(:), allocatable :: name
    real(wp), allocatable :: values(:)
    !> Of a table of which only some columns are there: which, and how many it has.
    integer, allocatable :: columns(:)
    integer :: n_columns = 0
  end type state_entry_t

  !> Who looks at tables of which only some columns are held here, in their place. Nothing else is
  !! put then, and nothing taken.
  type, abstract, public :: visitor_t
  contains
    procedure(visit_interface), deferred :: visit
  end type visitor_t

  abstract interface
    subroutine visit_interface(self, n, n_columns, columns, values)
      import :: visitor_t, wp
      class(visitor_t), intent(inout) :: self
      integer, intent(in) :: n, n_columns             !! numbers of a column, columns
      integer, intent(in) :: columns(:)               !! those held here, in rising order
      real(wp), intent(inout) :: values(n, n_columns)
    end subroutine visit_interface
  end interface

  !> All of them; `entries` is longer than `n_entries` says.
  type :: state_store_t
    integer :: n_entries = 0
    type(state_entry_t), allocatable :: entries(:)
    logical :: is_taking = .false.        !! what is carried is taken back, else put
    character(:), allocatable :: folder   !! put before every name, see `enter_folder`
    character(:), allocatable :: reason    !! first name put twice or missed; empty: none
    class(visitor_t), allocatable :: visitor   !! of tables; mostly none
    !> Only tables are put of which others hold columns: the rest is put elsewhere.
    logical :: has_parts_alone = .false.
  end type state_store_t

  !> Put a single value, or take it back, as the store stands, so that it is named but once. Whole
  !! numbers up to 2^53. A name counts once; a value that is not there to be taken stays as it is,
  !! and `reason` says why.
  interface carry
    module procedure carry_real, carry_integer, carry_long, carry_flag
  end interface carry

contains

  !> Forget all numbers, but keep the room that they had: the same ones, put again, need no new one.
  pure subroutine empty_store(store)
    type(state_store_t), intent(inout) :: store

    store%n_entries = 0
    store%is_taking = .false.
    store%reason = ""
  end subroutine empty_store

  !> From now on names mean those of this folder, such as `forces/3`.
  pure subroutine enter_folder(store, folder)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: folder      !! empty: none

    store%folder = folder
    if (folder /= "") store%folder = folder//"/"
    if (.not. allocated(store%reason)) store%reason = ""
  end subroutine enter_folder

  !> Add numbers under a name with its folder.
  pure subroutine add_entry(store, name, n, values)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n
    real(wp), intent(in) :: values(n)
    integer :: place

    if (store%has_parts_alone) return
    call add_room(store, name, n, place)
    if (place > 0) store%entries(place)%values = values
  end subroutine add_entry

  !> Room for numbers under a name with its folder; no place if the name is there already.
  pure subroutine add_room(store, name, n, place)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n
    integer, intent(out) :: place
    type(state_entry_t), allocatable :: wider(:)
    integer :: i

    place = 0
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
        call move_alloc(store%entries(i)%columns, wider(i)%columns)
        wider(i)%n_columns = store%entries(i)%n_columns
      end do
      call move_alloc(wider, store%entries)
    end if
    store%n_entries = store%n_entries + 1
    place = store%n_entries
    associate (entry => store%entries(place))
      entry%name = name
      if (allocated(entry%columns)) deallocate (entry%columns)
      if (allocated(entry%values)) then
        if (size(entry%values) /= n) deallocate (entry%values)
      end if
      if (.not. allocated(entry%values)) allocate (entry%values(n))
    end associate
  end subroutine add_room

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
                counted(size(store%entries(place)%values), "number")//" instead of "//to_text(n))
    else
      values = store%entries(place)%values
    end if
  end subroutine take_array

  !> Put an array of any shape, or take it back.
  pure subroutine carry_array(store, name, n, values)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n
    real(wp), intent(inout) :: values(n)

    if (allocated(store%visitor)) return
    if (store%is_taking) then
      call take_array(store, name, n, values)
    else
      call add_entry(store, full_name(store, name), n, values)
    end if
  end subroutine carry_array

  !> The same for a field of many points. All threads share the copy: each has most of its part in
  !! its cache.
  subroutine carry_field(store, name, n, values)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n
    real(wp), intent(inout) :: values(n)
    integer :: place, i

    if (allocated(store%visitor)) return
    if (store%is_taking) then
      call take_array(store, name, n, values)
      return
    end if
    if (store%has_parts_alone) return
    call add_room(store, full_name(store, name), n, place)
    if (place == 0) return
    associate (copy => store%entries(place)%values)
      !$omp parallel do simd schedule(static) if (n > 8192)
      do i = 1, n
        copy(i) = values(i)
      end do
      !$omp end parallel do simd
    end associate
  end subroutine carry_field

  !> The same for a table of which some columns are held here and others elsewhere. These alone are
  !! put; a store that has all columns, or the same ones, gives them back.
  subroutine carry_columns(store, name, n, n_columns, values, columns)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n                        !! numbers of a column
    integer, intent(in) :: n_columns
    real(wp), intent(inout) :: values(n, n_columns)
    integer, intent(in), optional :: columns(:)     !! those held here, in rising order; absent: all
    integer :: place

    if (.not. present(columns)) then
      call carry_field(store, name, n*n_columns, values)
    else if (allocated(store%visitor)) then
      call store%visitor%visit(n, n_columns, columns, values)
    else if (store%is_taking) then
      call take_columns(store, name, n, n_columns, columns, values)
    else
      call add_room(store, full_name(store, name), n*size(columns), place)
      if (place == 0) return
      associate (entry => store%entries(place))
        entry%columns = columns
        entry%n_columns = n_columns
        call pack_columns(n, n_columns, columns, values, entry%values)
      end associate
    end if
  end subroutine carry_columns

  subroutine pack_columns(n, n_columns, columns, values, packed)
    integer, intent(in) :: n, n_columns, columns(:)
    real(wp), intent(in) :: values(n, n_columns)
    real(wp), intent(out) :: packed(n, size(columns))
    integer :: i

    !$omp parallel do schedule(static)
    do i = 1, size(columns)
      packed(:, i) = values(:, columns(i))
    end do
    !$omp end parallel do
  end subroutine pack_columns

  !> Does an entry hold these columns and no others?
  pure logical function has_columns(entry, columns)
    type(state_entry_t), intent(in) :: entry
    integer, intent(in) :: columns(:)

    has_columns = allocated(entry%columns)
    if (has_columns) has_columns = size(entry%columns) == size(columns)
    if (has_columns) has_columns = all(entry%columns == columns)
  end function has_columns

  pure subroutine take_columns(store, name, n, n_columns, columns, values)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n, n_columns, columns(:)
    real(wp), intent(inout) :: values(n, n_columns)
    integer :: place, i, from

    place = find(store, full_name(store, name))
    if (place == 0) then
      call note(store, full_name(store, name)//" is missing")
      return
    end if
    associate (entry => store%entries(place))
      if (size(entry%values) == n*n_columns) then
        do i = 1, size(columns)
          from = n*(columns(i) - 1)
          values(:, columns(i)) = entry%values(from + 1:from + n)
        end do
      else if (has_columns(entry, columns)) then
        do i = 1, size(columns)
          values(:, columns(i)) = entry%values(n*(i - 1) + 1:n*i)
        end do
      else
        call note(store, full_name(store, name)//" has "//counted(size(entry%values), "number")// &
                  " instead of "//to_text(n*n_columns))
      end if
    end associate
  end subroutine take_columns

  !> The same for answers of yes and no.
  pure subroutine carry_flags(store, name, n, flags)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n
    logical, intent(inout) :: flags(n)
    real(wp) :: values(n)

    values = merge(1.0_wp, 0.0_wp, flags)
    call carry_array(store, name, n, values)
    flags = values > 0.5_wp
  end subroutine carry_flags

  !> The same for places in a list, 0 for none: others are an error. With `columns` some of them are
  !! held elsewhere, see `carry_columns`.
  subroutine carry_indices(store, name, n, largest, indices, columns)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(in) :: n
    integer, intent(in) :: largest           !! length of the list
    integer, intent(inout) :: indices(n)
    integer, intent(in), optional :: columns(:)
    real(wp) :: values(n)

    values = real(indices, wp)
    call carry_columns(store, name, 1, n, values, columns)
    ! Written so that a NaN counts as outside.
    if (all(values >= 0.0_wp .and. values <= largest)) then
      indices = nint(values)
    else
      call note(store, full_name(store, name)//" has numbers outside of 0 to "//to_text(largest))
    end if
  end subroutine carry_indices

  pure subroutine carry_real(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    real(wp), intent(inout) :: value
    real(wp) :: values(1)

    values = value
    call carry_array(store, name, 1, values)
    value = values(1)
  end subroutine carry_real

  pure subroutine carry_integer(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer, intent(inout) :: value
    real(wp) :: number

    number = real(value, wp)
    call carry_real(store, name, number)
    value = nint(number)
  end subroutine carry_integer

  pure subroutine carry_long(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    integer(int64), intent(inout) :: value
    real(wp) :: number

    number = real(value, wp)
    call carry_real(store, name, number)
    value = nint(number, int64)
  end subroutine carry_long

  pure subroutine carry_flag(store, name, value)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    logical, intent(inout) :: value
    logical :: flags(1)

    flags = value
    call carry_flags(store, name, 1, flags)
    value = flags(1)
  end subroutine carry_flag

  !> Is there something under this name? A visitor finds everything.
  pure logical function has_state(store, name)
    type(state_store_t), intent(in) :: store
    character(*), intent(in) :: name

    has_state = allocated(store%visitor)
    if (.not. has_state) has_state = find(store, full_name(store, name)) > 0
  end function has_state

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

  pure subroutine note(store, reason)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: reason

    if (.not. allocated(store%reason)) store%reason = ""
    if (store%reason == "") store%reason = reason
  end subroutine note

end module state_store
