!> Forces on the control points where processes move but some of their rows: each has worked its own
!! elements and contact points, and the others need what these do to rows that they move as well.
!! Everybody gets it as it is, and adds it in the same order as one process does.
module row_exchange
  use parcel, only: empty_parcel
  use ranks, only: pass_counted
  use blank, only: assembly_t
  use effect, only: effect_slot_t, instant_t
  use contact_effect, only: contact_view_t, contact_pairs, finish_pair
  use contact_sharing, only: send_touching, receive_touching
  implicit none
  private

  public :: exchange_rows

contains

  !> Complete the forces of elements and contact pairs, and what they report. All processes call it.
  subroutine exchange_rows(bodies, forces, instant)
    type(assembly_t), intent(inout) :: bodies
    type(effect_slot_t), intent(inout), target :: forces(:)
    type(instant_t), intent(in) :: instant
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i, k

    pairs = contact_pairs(forces)
    associate (blank => bodies%blank, element => bodies%blank%parts(1)%element, &
               partners => bodies%blank%parts(1)%element%motion%rows%partners)
      if (.not. allocated(blank%sent)) then
        associate (n => element%motion%rows%ranks%n)
          allocate (blank%sent(n), blank%received(n))
        end associate
      end if
      do i = 1, size(partners)
        call empty_parcel(blank%sent(i), 0)
        call element%pass_tiles(partners(i), .true., blank%sent(i))
        do k = 1, size(pairs)
          call send_touching(pairs(k)%pair%pair, partners(i), blank%sent(i))
        end do
      end do
      call pass_counted(element%motion%rows%ranks, partners, blank%sent, blank%received, &
                        blank%traffic)
      blank%traffic%n_calls = blank%traffic%n_calls + 1
      do i = 1, size(partners)
        call element%pass_tiles(partners(i), .false., blank%received(i))
        do k = 1, size(pairs)
          call receive_touching(pairs(k)%pair%pair, partners(i), blank%received(i))
        end do
      end do
      call element%finish_forces(blank%report)
    end associate
    do k = 1, size(pairs)
      call finish_pair(pairs(k)%pair, bodies, instant%dt)
    end do
  end subroutine exchange_rows

end module row_exchange
