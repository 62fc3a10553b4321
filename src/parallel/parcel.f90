!> Values that one process sends to another, packed one after the other and unpacked in the same
!! order.
module parcel
  use kinds, only: wp
  implicit none
  private

  public :: empty_parcel, pass_values

  !> The first `n` of the values are there; of these the first `n_taken` are unpacked.
  type, public :: parcel_t
    integer :: n = 0, n_taken = 0
    real(wp), allocatable :: values(:)
  end type parcel_t

contains

  !> Nothing in it, and room for so many values at least.
  pure subroutine empty_parcel(parcel, room)
    type(parcel_t), intent(inout) :: parcel
    integer, intent(in) :: room

    parcel%n = 0
    parcel%n_taken = 0
    call make_room(parcel, room)
  end subroutine empty_parcel

  !> Put values behind those that are there, or take the next ones: who sends and who receives names
  !! them but once.
  pure subroutine pass_values(parcel, is_sent, n, values)
    type(parcel_t), intent(inout) :: parcel
    logical, intent(in) :: is_sent                 !! they go into the parcel
    integer, intent(in) :: n
    real(wp), intent(inout) :: values(n)

    if (is_sent) then
      call make_room(parcel, parcel%n + n)
      parcel%values(parcel%n + 1:parcel%n + n) = values
      parcel%n = parcel%n + n
    else
      values = parcel%values(parcel%n_taken + 1:parcel%n_taken + n)
      parcel%n_taken = parcel%n_taken + n
    end if
  end subroutine pass_values

  !> What is there stays; room grows by half at least, so that it grows seldom.
  pure subroutine make_room(parcel, n)
    type(parcel_t), intent(inout) :: parcel
    integer, intent(in) :: n
    real(wp), allocatable :: grown(:)

    if (.not. allocated(parcel%values)) allocate (parcel%values(max(n, 1)))
    if (size(parcel%values) >= n) return
    allocate (grown(max(n, size(parcel%values) + size(parcel%values)/2)))
    grown(:parcel%n) = parcel%values(:parcel%n)
    call move_alloc(grown, parcel%values)
  end subroutine make_room

end module parcel
