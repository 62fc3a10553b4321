!> A contact among processes: each knows the points of the tiles that it works, until somebody must
!! look at all of them.
module contact_sharing
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use ranks, only: ranks_t
  use parcel, only: parcel_t, pass_values
  use row_shares, only: row_shares_t, know_all_rows
  use state_store, only: state_store_t
  use store_gather, only: join_tables
  use contact_tiles, only: tile_t
  use contact, only: contact_t
  use contact_state, only: carry_contact, carry_places, spare_points
  use tile_results, only: tile_result_t, n_result_numbers, numbers_of, result_of
  implicit none
  private

  public :: share_contact, join_contact, last_rows, add_row_costs, pass_touching, pass_bands, &
            n_band_numbers

contains

  !> Several processes work the tiles from here on. Where each moves but some of the rows of control
  !! points, it works the bands of tiles whose first row is one of its own. Else tiles are dealt out
  !! by their diagonals, for those that touch lie side by side along or across a face. What is known
  !! of the points of others is given up.
  subroutine share_contact(contact, ranks, rows, is_anew)
    type(contact_t), intent(inout) :: contact
    class(ranks_t), intent(in) :: ranks
    type(row_shares_t), intent(in), optional :: rows   !! absent: each knows all
    logical, intent(in), optional :: is_anew           !! work is counted anew; absent: yes
    logical :: is_counted
    integer :: t

    if (.not. allocated(contact%ranks)) allocate (contact%ranks, source=ranks)
    contact%is_shared = ranks%n > 1
    call know_all_rows(contact%rows)
    if (present(rows)) contact%rows = rows
    if (contact%rows%is_shared) then
      contact%owners = [(owner_of_row(rows%last_of, contact%tiles(t)%net_first(2)), &
                         t=1, size(contact%tiles))]
    else
      contact%owners = mod(contact%tiles%diagonal, ranks%n)
    end if
    is_counted = .false.
    if (present(is_anew)) is_counted = allocated(contact%ticks) .and. .not. is_anew
    if (.not. is_counted) contact%ticks = spread(0_int64, 1, size(contact%tiles))
    call spare_points(contact)
  end subroutine share_contact

  !> Number of the process that a row belongs to.
  pure integer function owner_of_row(last_of, row) result(owner)
    integer, intent(in) :: last_of(:)            !! last own row of each process
    integer, intent(in) :: row

    owner = count(last_of < row)
  end function owner_of_row

  !> Last row of control points that the contact points of each process reach to, given its last
  !! own row; 0 where it works none.
  pure function last_rows(contact, last_of) result(last)
    type(contact_t), intent(in) :: contact
    integer, intent(in) :: last_of(:)
    integer :: last(size(last_of)), t

    last = 0
    do t = 1, size(contact%tiles)
      associate (here => last(owner_of_row(last_of, contact%tiles(t)%net_first(2)) + 1))
        here = max(here, contact%tiles(t)%net_last(2))
      end associate
    end do
  end function last_rows

  !> Add the time that tiles took here to the rows of control points with which they begin.
  pure subroutine add_row_costs(contact, costs)
    type(contact_t), intent(in) :: contact
    real(wp), intent(inout) :: costs(:)          !! of the rows [clock ticks]
    integer :: t

    if (.not. allocated(contact%ticks)) return
    do t = 1, size(contact%tiles)
      associate (cost => costs(contact%tiles(t)%net_first(2)))
        cost = cost + real(contact%ticks(t), wp)
      end associate
    end do
  end subroutine add_row_costs

  !> Where processes move but some of the rows: what a partner has to know of the tiles here, into
  !! the parcel for it, or what it has found, out of its own.
  subroutine pass_touching(contact, partner, is_sent, parcel)
    type(contact_t), intent(inout) :: contact
    integer, intent(in) :: partner               !! number of the process
    logical, intent(in) :: is_sent               !! to it; else received
    type(parcel_t), intent(inout) :: parcel
    real(wp) :: is_touching(1)
    integer :: rows(2), sender, t, j

    rows = merge(contact%rows%known_by(:, partner + 1), contact%rows%known, is_sent)
    sender = merge(contact%ranks%number, partner, is_sent)
    do t = 1, size(contact%tiles)
      associate (tile => contact%tiles(t), n => size(contact%tile_force, 1)*3)
        if (.not. (contact%owners(t) == sender .and. reaches(tile, rows))) cycle
        is_touching = merge(1.0_wp, 0.0_wp, contact%is_touching(t))
        call pass_values(parcel, is_sent, 1, is_touching)
        contact%is_touching(t) = is_touching(1) > 0.5_wp
        if (.not. contact%is_touching(t)) cycle
        do j = max(tile%net_first(2), rows(1)), min(tile%net_last(2), rows(2))
          call pass_values(parcel, is_sent, n, &
                           contact%tile_force(:, :, j - tile%net_first(2) + 1, t))
        end do
      end associate
    end do
  end subroutine pass_touching

  !> What the bands of a process have found, which all have to know, into a parcel or out of it.
  pure subroutine pass_bands(contact, process, is_sent, parcel, bands)
    type(contact_t), intent(in) :: contact
    integer, intent(in) :: process                      !! its number
    logical, intent(in) :: is_sent                      !! else received
    type(parcel_t), intent(inout) :: parcel
    type(tile_result_t), intent(inout) :: bands(:)      !! of all processes
    real(wp) :: numbers(n_result_numbers)
    integer :: b

    do b = 1, size(bands)
      if (owner_of_band(contact, b) /= process) cycle
      numbers = numbers_of(bands(b))
      call pass_values(parcel, is_sent, n_result_numbers, numbers)
      if (.not. is_sent) bands(b) = result_of(numbers)
    end do
  end subroutine pass_bands

  !> How many numbers that makes.
  pure integer function n_band_numbers(contact, process) result(n)
    type(contact_t), intent(in) :: contact
    integer, intent(in) :: process

    n = n_result_numbers*count(contact%owners(::contact%n_across) == process)
  end function n_band_numbers

  !> Process that works a band of tiles, where each moves but some of the rows.
  pure integer function owner_of_band(contact, band) result(owner)
    type(contact_t), intent(in) :: contact
    integer, intent(in) :: band

    owner = contact%owners((band - 1)*contact%n_across + 1)
  end function owner_of_band

  !> Does a tile touch some of the rows?
  pure logical function reaches(tile, rows)
    type(tile_t), intent(in) :: tile
    integer, intent(in) :: rows(2)               !! first and last

    reaches = tile%net_first(2) <= rows(2) .and. tile%net_last(2) >= rows(1)
  end function reaches

  !> What is known of all points, at the first process alone or at all; or only where the face is
  !! and where its points are on the tool. The tiles stay shared.
  subroutine join_contact(contact, is_everywhere, are_places)
    type(contact_t), intent(inout) :: contact
    logical, intent(in) :: is_everywhere, are_places
    type(state_store_t) :: store

    if (.not. contact%is_shared) return
    call join_tables(store, contact%ranks, is_everywhere)
    if (are_places) then
      call carry_places(contact, store)
    else
      call carry_contact(contact, store)
    end if
  end subroutine join_contact

end module contact_sharing
