!> A store whose tables are held in parts by several processes becomes a whole one.
module store_gather
  use kinds, only: wp
  use state_store, only: state_store_t, state_entry_t
  use ranks, only: ranks_t
  implicit none
  private

  public :: gather_entry, gather_tables

contains

  !> Make all tables whole, at the first process alone or at all. Elsewhere they stay as they are.
  subroutine gather_tables(ranks, store, is_everywhere)
    class(ranks_t), intent(in) :: ranks
    type(state_store_t), intent(inout) :: store
    logical, intent(in) :: is_everywhere
    real(wp), allocatable :: whole(:)
    integer :: i

    do i = 1, store%n_entries
      if (.not. allocated(store%entries(i)%columns)) cycle
      call gather_entry(ranks, store%entries(i), is_everywhere, whole)
      if (.not. allocated(whole)) cycle
      call move_alloc(whole, store%entries(i)%values)
      deallocate (store%entries(i)%columns)
    end do
  end subroutine gather_tables

  !> All columns of a table, at the first process alone or at all; elsewhere not allocated.
  subroutine gather_entry(ranks, entry, is_everywhere, whole)
    class(ranks_t), intent(in) :: ranks
    type(state_entry_t), intent(in) :: entry       !! with columns
    logical, intent(in) :: is_everywhere
    real(wp), allocatable, intent(out) :: whole(:)
    real(wp), allocatable :: joined(:), columns(:)
    real(wp) :: counts(ranks%n)
    integer :: n, i, place
    logical :: is_here

    is_here = is_everywhere .or. ranks%number == 0
    call ranks%gather(spread(1, 1, ranks%n), [real(size(entry%columns), wp)], counts, .true.)
    n = numbers_of_column(ranks, entry)
    allocate (columns(merge(entry%n_columns, 0, is_here)), &
              joined(merge(n*entry%n_columns, 0, is_here)))
    call ranks%gather(nint(counts), real(entry%columns, wp), columns, is_everywhere)
    call ranks%gather(n*nint(counts), entry%values, joined, is_everywhere)
    if (.not. is_here) return
    allocate (whole(n*entry%n_columns))
    do i = 1, entry%n_columns
      place = n*(nint(columns(i)) - 1)
      whole(place + 1:place + n) = joined(n*(i - 1) + 1:n*i)
    end do
  end subroutine gather_entry

  !> How many numbers a column has; a process without columns does not know it.
  integer function numbers_of_column(ranks, entry) result(n)
    class(ranks_t), intent(in) :: ranks
    type(state_entry_t), intent(in) :: entry

    n = ranks%largest(size(entry%values)/max(1, size(entry%columns)))
  end function numbers_of_column

end module store_gather
