!> Names and their places in a list: finding one takes the same time however many there are.
!!
!! Open addressing with linear probing; hash of G. Fowler, L. C. Noll and P. Vo (FNV-1a).
module name_table
  use, intrinsic :: iso_fortran_env, only: int64
  use text, only: string_t
  implicit none
  private

  public :: name_table_t, insert, place_of, note_use

  !> Names in order of entry: the first `n_names` of `names`. Case matters.
  type :: name_table_t
    integer :: n_names = 0
    type(string_t), allocatable :: names(:)   !! longer than `n_names`, grown by doubling
    logical, allocatable :: is_used(:)        !! something refers to them
    integer, allocatable :: slots(:)          !! place in `names`, 0: free; at most half in use
  end type name_table_t

contains

  !> Enter a name; a name that is there already keeps its place and `is_new` is false.
  pure subroutine insert(table, name, is_new)
    type(name_table_t), intent(inout) :: table
    character(*), intent(in) :: name
    logical, intent(out) :: is_new
    integer :: slot

    if (.not. allocated(table%slots)) then
      allocate (table%names(16), table%slots(0:31), table%is_used(16))
      table%is_used = .false.
      table%slots = 0
    end if
    if (table%n_names == size(table%names)) call double(table)
    slot = slot_of(table, name)
    is_new = table%slots(slot) == 0
    if (.not. is_new) return
    table%n_names = table%n_names + 1
    table%names(table%n_names)%value = name
    table%slots(slot) = table%n_names
  end subroutine insert

  !> Place of a name in order of entry, 0 if it was never entered.
  pure integer function place_of(table, name)
    type(name_table_t), intent(in) :: table
    character(*), intent(in) :: name

    place_of = 0
    if (allocated(table%slots)) place_of = table%slots(slot_of(table, name))
  end function place_of

  !> Note that something refers to the name at a place; 0 is none.
  pure subroutine note_use(table, place)
    type(name_table_t), intent(inout) :: table
    integer, intent(in) :: place

    if (place > 0) table%is_used(place) = .true.
  end subroutine note_use

  !> Slot that holds the name, or the free slot where it belongs.
  pure integer function slot_of(table, name) result(slot)
    type(name_table_t), intent(in) :: table
    character(*), intent(in) :: name
    integer(int64) :: hash
    integer :: i

    hash = 2166136261_int64
    do i = 1, len(name)
      hash = iand(ieor(hash, int(iachar(name(i:i)), int64))*16777619_int64, 4294967295_int64)
    end do
    slot = int(modulo(hash, int(size(table%slots), int64)))
    do while (table%slots(slot) /= 0)
      if (table%names(table%slots(slot))%value == name) exit
      slot = modulo(slot + 1, size(table%slots))
    end do
  end function slot_of

  pure subroutine double(table)
    type(name_table_t), intent(inout) :: table
    type(string_t), allocatable :: longer(:)
    integer :: i, slot

    allocate (longer(2*table%n_names))
    do i = 1, table%n_names
      call move_alloc(table%names(i)%value, longer(i)%value)
    end do
    call move_alloc(longer, table%names)
    table%is_used = [table%is_used, spread(.false., 1, table%n_names)]
    deallocate (table%slots)
    allocate (table%slots(0:2*size(table%names) - 1))
    table%slots = 0
    do i = 1, table%n_names
      slot = slot_of(table, table%names(i)%value)
      table%slots(slot) = i
    end do
  end subroutine double

end module name_table
