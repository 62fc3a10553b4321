!> Which rows of control points of a patch a process moves, along axis 2: all where it is alone, or
!! where something needs them all; else its own ones, and those of others that its elements and its
!! contact points touch. All that move a row move it alike. Where forces on a row need places beyond
!! those, the places of some rows around are brought in each increment.
module row_shares
  use kinds, only: wp
  use ranks, only: ranks_t, traffic_t, gather_counted
  use parcel, only: parcel_t, pass_values
  implicit none
  private

  public :: share_rows, move_own_rows, know_all_rows, pass_known_rows, gather_rows, &
            gather_row_values

  !> The rows of this process. Rows beyond those it knows keep old values here, until somebody must
  !! look at all of them.
  type, public :: row_shares_t
    logical :: is_shared = .false.
    integer :: first = 1, last = huge(1)            !! rows that are moved here
    integer :: known(2) = [1, huge(1)]              !! first and last whose places are known here
    integer :: own_first = 1, own_last = huge(1)    !! that count here, in sums of all processes
    class(ranks_t), allocatable :: ranks            !! the processes; absent: one for all
    integer, allocatable :: last_of(:)              !! last own row of each of them
    integer, allocatable :: moved_by(:, :)          !! first and last row that each moves, (2, n)
    integer, allocatable :: known_by(:, :)          !! first and last that each knows, (2, n)
    integer, allocatable :: partners(:)             !! numbers of those that know some of its rows
    integer, allocatable :: n_reported(:)           !! numbers of elements that each has for all
  end type row_shares_t

contains

  !> The own rows of all processes follow each other.
  subroutine share_rows(rows, ranks, last_of, moved_by, reach)
    type(row_shares_t), intent(inout) :: rows
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: last_of(:)              !! last own row of each process
    integer, intent(in) :: moved_by(:, :)          !! its first and last row, (2, n)
    integer, intent(in), optional :: reach         !! rows around these that it knows; absent: none

    if (.not. allocated(rows%ranks)) allocate (rows%ranks, source=ranks)
    rows%last_of = last_of
    rows%moved_by = moved_by
    rows%known_by = moved_by
    if (present(reach)) then
      where (moved_by(1, :) <= moved_by(2, :))
        rows%known_by(1, :) = max(1, moved_by(1, :) - reach)
        rows%known_by(2, :) = min(last_of(size(last_of)), moved_by(2, :) + reach)
      end where
    end if
    call move_own_rows(rows)
  end subroutine share_rows

  !> Each process moves its share again.
  pure subroutine move_own_rows(rows)
    type(row_shares_t), intent(inout) :: rows      !! that were shared before
    integer :: r

    associate (here => rows%ranks%number + 1, n => rows%ranks%n, moved_by => rows%moved_by, &
               known_by => rows%known_by)
      rows%own_first = 1
      if (here > 1) rows%own_first = rows%last_of(here - 1) + 1
      rows%own_last = rows%last_of(here)
      rows%first = moved_by(1, here)
      rows%last = moved_by(2, here)
      rows%known = known_by(:, here)
      rows%partners = pack([(r - 1, r=1, n)], max(known_by(1, :), rows%first) &
                           <= min(known_by(2, :), rows%last) .and. [(r /= here, r=1, n)])
      rows%is_shared = n > 1
    end associate
  end subroutine move_own_rows

  !> Each process moves all rows, whose values it must know.
  pure subroutine know_all_rows(rows)
    type(row_shares_t), intent(inout) :: rows

    rows%is_shared = .false.
    rows%first = 1
    rows%last = huge(1)
    rows%known = [1, huge(1)]
    rows%own_first = 1
    rows%own_last = huge(1)
  end subroutine know_all_rows

  !> The rows of a field that a partner knows and does not move, and that are own ones here, into
  !! the parcel for it; or those that come from it, out of its own.
  subroutine pass_known_rows(rows, partner, is_sent, n, field, parcel)
    type(row_shares_t), intent(in) :: rows          !! shared
    integer, intent(in) :: partner                  !! number of the process
    logical, intent(in) :: is_sent                  !! to it; else received
    integer, intent(in) :: n(3)                     !! along axes 1 and 2, and of each column
    real(wp), intent(inout) :: field(n(1), n(2), n(3))
    type(parcel_t), intent(inout) :: parcel
    integer :: sender, taker, first, i, j

    sender = merge(rows%ranks%number, partner, is_sent) + 1
    taker = merge(partner, rows%ranks%number, is_sent) + 1
    first = 1
    if (sender > 1) first = rows%last_of(sender - 1) + 1
    associate (known => rows%known_by(:, taker), moved => rows%moved_by(:, taker))
      do j = max(first, known(1)), min(rows%last_of(sender), known(2))
        if (j >= moved(1) .and. j <= moved(2)) cycle
        do i = 1, n(3)
          call pass_values(parcel, is_sent, n(1), field(:, j, i))
        end do
      end do
    end associate
  end subroutine pass_known_rows

  !> A field on the control points, of which each process knows its own rows, at all processes.
  subroutine gather_rows(rows, n, field)
    type(row_shares_t), intent(in) :: rows          !! shared
    integer, intent(in) :: n(3)                     !! along axes 1 and 2, and of each column
    real(wp), intent(inout) :: field(n(1), n(2), n(3))
    real(wp), allocatable :: own(:), joined(:)
    integer :: counts(rows%ranks%n), i, j, at

    counts = n(1)*n(3)*(rows%last_of - [0, rows%last_of(:rows%ranks%n - 1)])
    allocate (own(counts(rows%ranks%number + 1)), joined(size(field)))
    at = 0
    do j = rows%own_first, rows%own_last
      do i = 1, n(3)
        own(at + 1:at + n(1)) = field(:, j, i)
        at = at + n(1)
      end do
    end do
    call rows%ranks%gather(counts, own, joined, .true.)
    at = 0
    do j = 1, n(2)
      do i = 1, n(3)
        field(:, j, i) = joined(at + 1:at + n(1))
        at = at + n(1)
      end do
    end do
  end subroutine gather_rows

  !> Numbers of each row, of which each process has those of its own ones, at all processes.
  subroutine gather_row_values(rows, values, traffic)
    type(row_shares_t), intent(in) :: rows          !! shared
    real(wp), intent(inout), contiguous :: values(:, :)   !! (numbers of a row, rows)
    type(traffic_t), intent(inout), optional :: traffic   !! where it is counted
    type(traffic_t) :: uncounted
    real(wp) :: joined(size(values)), own(size(values))
    integer :: counts(rows%ranks%n)

    counts = size(values, 1)*(rows%last_of - [0, rows%last_of(:rows%ranks%n - 1)])
    own(:counts(rows%ranks%number + 1)) = reshape(values(:, rows%own_first:rows%own_last), &
                                                  [counts(rows%ranks%number + 1)])
    if (present(traffic)) then
      call gather_counted(rows%ranks, counts, own, joined, traffic)
    else
      call gather_counted(rows%ranks, counts, own, joined, uncounted)
    end if
    values = reshape(joined, shape(values))
  end subroutine gather_row_values

end module row_shares
