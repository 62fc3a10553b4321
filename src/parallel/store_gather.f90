!> A table whose columns are held by several processes becomes a whole one.
module store_gather
  use kinds, only: wp
  use state_store, only: state_store_t, state_entry_t, visitor_t
  use ranks, only: ranks_t
  implicit none
  private

  public :: join_tables, gather_entry, complete_store

  integer, parameter :: part_size = 131072     !! numbers that pass at once: 1 MB

  !> Makes all tables that it visits whole, in their place.
  type, extends(visitor_t) :: joining_t
    class(ranks_t), allocatable :: ranks
    logical :: is_everywhere = .false.    ! see `join_tables`
  contains
    procedure :: visit => join_table
  end type joining_t

contains

  !> Tables carried by this store become whole in their place, at the first process or at all;
  !! elsewhere they stay as they are. All processes carry the same ones in the same order.
  subroutine join_tables(store, ranks, is_everywhere)
    type(state_store_t), intent(inout) :: store    !! a new one
    class(ranks_t), intent(in) :: ranks
    logical, intent(in) :: is_everywhere
    type(joining_t), allocatable :: joining

    allocate (joining)
    allocate (joining%ranks, source=ranks)
    joining%is_everywhere = is_everywhere
    store%is_taking = is_everywhere .or. ranks%number == 0
    call move_alloc(joining, store%visitor)
  end subroutine join_tables

  subroutine join_table(self, n, n_columns, columns, values)
    class(joining_t), intent(inout) :: self
    integer, intent(in) :: n, n_columns, columns(:)
    real(wp), intent(inout) :: values(n, n_columns)

    call join_columns(self%ranks, self%is_everywhere, n, n_columns, columns, values)
  end subroutine join_table

  !> All columns of a table at the first process; elsewhere not allocated.
  subroutine gather_entry(ranks, entry, whole)
    class(ranks_t), intent(in) :: ranks
    type(state_entry_t), intent(in) :: entry       !! with columns
    real(wp), allocatable, intent(out) :: whole(:)
    real(wp) :: nothing(0)
    integer :: n

    ! A process without columns does not know how many numbers one has.
    n = ranks%largest(size(entry%values)/max(1, size(entry%columns)))
    if (ranks%number == 0) then
      allocate (whole(n*entry%n_columns))
      call join_columns(ranks, .false., n, entry%n_columns, entry%columns, whole, entry%values)
    else
      call join_columns(ranks, .false., n, entry%n_columns, entry%columns, nothing, entry%values)
    end if
  end subroutine gather_entry

  !> All columns of all tables of a store, at all processes.
  subroutine complete_store(ranks, store)
    class(ranks_t), intent(in) :: ranks
    type(state_store_t), intent(inout) :: store
    real(wp), allocatable :: whole(:)
    integer :: n, i

    do i = 1, store%n_entries
      if (.not. allocated(store%entries(i)%columns)) cycle
      associate (entry => store%entries(i))
        n = ranks%largest(size(entry%values)/max(1, size(entry%columns)))
        allocate (whole(n*entry%n_columns))
        call join_columns(ranks, .true., n, entry%n_columns, entry%columns, whole, entry%values)
        call move_alloc(whole, entry%values)
        deallocate (entry%columns)
      end associate
    end do
  end subroutine complete_store

  !> The columns pass part by part, so that little room is needed beside the table.
  subroutine join_columns(ranks, is_everywhere, n, n_columns, columns, whole, packed)
    class(ranks_t), intent(in) :: ranks
    logical, intent(in) :: is_everywhere           !! else at the first process alone
    integer, intent(in) :: n, n_columns, columns(:)
    real(wp), intent(inout) :: whole(n, *)         !! with the own columns, unless they are packed
    real(wp), intent(in), optional :: packed(n, *) !! the own columns
    real(wp), allocatable :: own(:, :), joined(:, :)
    integer, allocatable :: lists(:)
    integer, dimension(ranks%n) :: n_of, before, counts
    integer :: width, low, at, i, r, first

    call share_lists(ranks, columns, n_of, lists)
    width = max(1, min(n_columns, part_size/max(1, n)))
    allocate (own(n, width), joined(n, width))
    before = 0
    do low = 1, n_columns, width
      do r = 1, ranks%n
        first = sum(n_of(:r - 1)) + before(r)
        counts(r) = count(lists(first + 1:min(first + width, sum(n_of(:r)))) < low + width)
      end do
      associate (done => before(ranks%number + 1))
        do i = 1, counts(ranks%number + 1)
          if (present(packed)) then
            own(:, i) = packed(:, done + i)
          else
            own(:, i) = whole(:, columns(done + i))
          end if
        end do
      end associate
      call gather_part(own, joined)
      at = 0
      do r = 1, ranks%n
        first = sum(n_of(:r - 1)) + before(r)
        if (is_everywhere .or. ranks%number == 0) then
          do i = 1, counts(r)
            whole(:, lists(first + i)) = joined(:, at + i)
          end do
        end if
        at = at + counts(r)
        before(r) = before(r) + counts(r)
      end do
    end do

  contains

    subroutine gather_part(sent, received)
      real(wp), intent(in) :: sent(n*width)
      real(wp), intent(inout) :: received(n*width)

      call ranks%gather(n*counts, sent, received, is_everywhere)
    end subroutine gather_part
  end subroutine join_columns

  !> Which columns each process holds, one list after the other.
  subroutine share_lists(ranks, columns, n_of, lists)
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: columns(:)
    integer, intent(out) :: n_of(:)                !! columns of each process
    integer, allocatable, intent(out) :: lists(:)
    real(wp), allocatable :: joined(:)

    allocate (joined(ranks%n))
    call ranks%gather(spread(1, 1, ranks%n), [real(size(columns), wp)], joined, .true.)
    n_of = nint(joined)
    deallocate (joined)
    allocate (joined(sum(n_of)))
    call ranks%gather(n_of, real(columns, wp), joined, .true.)
    lists = nint(joined)
  end subroutine share_lists

end module store_gather
