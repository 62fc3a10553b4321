!> Forces on the control points where processes move but some of their rows: each has worked its own
!! elements and contact points, and the others need what these do to rows that they move as well.
!! Everybody gets it as it is, and adds it in the same order as one process does. Faces that follow
!! a mid-surface take a shape first, of what their elements have found.
module row_exchange
  use parcel, only: parcel_t, empty_parcel
  use ranks, only: pass_counted, gather_counted
  use blank, only: blank_t, assembly_t
  use effect, only: effect_slot_t, instant_t
  use contact, only: find_bands
  use contact_effect, only: contact_view_t, contact_pairs, finish_pair
  use contact_sharing, only: pass_touching, pass_bands, n_band_numbers
  use tile_results, only: tile_result_t
  implicit none
  private

  public :: needs_shape, exchange_shape, exchange_rows

  !> What the bands of tiles of a contact pair found.
  type :: bands_t
    type(tile_result_t), allocatable :: bands(:)
  end type bands_t

contains

  !> Does contact press faces that are not layers of control points?
  logical function needs_shape(forces)
    type(effect_slot_t), intent(in), target :: forces(:)
    type(contact_view_t), allocatable :: pairs(:)
    integer :: k

    pairs = contact_pairs(forces)
    needs_shape = any([(allocated(pairs(k)%pair%net), k=1, size(pairs))])
  end function needs_shape

  !> The shape of such faces, before contact presses them. All processes call it.
  subroutine exchange_shape(bodies)
    type(assembly_t), intent(inout) :: bodies
    type(contact_view_t) :: no_pairs(0)

    call pass_parcels(bodies%blank, no_pairs, is_shape=.true.)
  end subroutine exchange_shape

  !> Complete the forces of elements and contact pairs, and what they report. All processes call it.
  subroutine exchange_rows(bodies, forces, instant)
    type(assembly_t), intent(inout) :: bodies
    type(effect_slot_t), intent(inout), target :: forces(:)
    type(instant_t), intent(in) :: instant
    type(contact_view_t), allocatable :: pairs(:)
    type(bands_t), allocatable :: found(:)
    integer :: k

    pairs = contact_pairs(forces)
    allocate (found(size(pairs)))
    do k = 1, size(pairs)
      associate (contact => pairs(k)%pair%pair)
        allocate (found(k)%bands(size(contact%tiles)/contact%n_across))
      end associate
    end do
    bodies%blank%n_exchanges = bodies%blank%n_exchanges + 1
    call pass_parcels(bodies%blank, pairs, is_shape=.false.)
    call gather_findings(bodies%blank, pairs, found)
    call bodies%blank%parts(1)%element%finish_forces(bodies%blank%report)
    do k = 1, size(pairs)
      call finish_pair(pairs(k)%pair, bodies, instant%dt, found(k)%bands)
    end do
  end subroutine exchange_rows

  !> What partners have to know, to them and from them: the shape, or the forces.
  subroutine pass_parcels(blank, pairs, is_shape)
    type(blank_t), intent(inout) :: blank
    type(contact_view_t), intent(in) :: pairs(:)
    logical, intent(in) :: is_shape
    integer, allocatable :: partners(:)
    integer :: i

    associate (rows => blank%parts(1)%element%motion%rows)
      partners = rows%partners
      if (.not. allocated(blank%sent)) allocate (blank%sent(rows%ranks%n), &
                                                 blank%received(rows%ranks%n))
      do i = 1, size(partners)
        call empty_parcel(blank%sent(i), 0)
        call pass_one(partners(i), .true., blank%sent(i))
      end do
      call pass_counted(rows%ranks, partners, blank%sent, blank%received, blank%traffic)
      do i = 1, size(partners)
        call pass_one(partners(i), .false., blank%received(i))
      end do
    end associate

  contains

    !> All that goes to a partner, or comes from it.
    subroutine pass_one(partner, is_sent, parcel)
      integer, intent(in) :: partner
      logical, intent(in) :: is_sent
      type(parcel_t), intent(inout) :: parcel
      integer :: k

      associate (element => blank%parts(1)%element)
        if (is_shape) then
          call element%pass_shape(partner, is_sent, parcel)
          return
        end if
        call element%pass_forces(partner, is_sent, parcel)
      end associate
      do k = 1, size(pairs)
        call pass_touching(pairs(k)%pair%pair, partner, is_sent, parcel)
      end do
    end subroutine pass_one
  end subroutine pass_parcels

  !> What the tiles of elements and the bands of contact points found, to all processes.
  subroutine gather_findings(blank, pairs, found)
    type(blank_t), intent(inout) :: blank
    type(contact_view_t), intent(in) :: pairs(:)
    type(bands_t), intent(inout) :: found(:)      !! of each pair
    type(parcel_t) :: own, joined
    integer, allocatable :: counts(:)
    integer :: k, r

    associate (element => blank%parts(1)%element, rows => blank%parts(1)%element%motion%rows)
      counts = rows%n_reported
      do k = 1, size(pairs)
        counts = counts + [(n_band_numbers(pairs(k)%pair%pair, r), r=0, size(counts) - 1)]
      end do
      call empty_parcel(own, counts(rows%ranks%number + 1))
      call element%pass_report(rows%ranks%number, .true., own)
      do k = 1, size(pairs)
        call find_bands(pairs(k)%pair%pair, found(k)%bands)
        call pass_bands(pairs(k)%pair%pair, rows%ranks%number, .true., own, found(k)%bands)
      end do
      call empty_parcel(joined, sum(counts))
      call gather_counted(rows%ranks, counts, own%values, joined%values, blank%traffic)
      do r = 0, size(counts) - 1
        call element%pass_report(r, .false., joined)
        do k = 1, size(pairs)
          call pass_bands(pairs(k)%pair%pair, r, .false., joined, found(k)%bands)
        end do
      end do
    end associate
  end subroutine gather_findings

end module row_exchange
