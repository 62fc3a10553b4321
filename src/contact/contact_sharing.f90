!> A contact among processes: each knows the points of the tiles that it works, until somebody must
!! look at all of them.
module contact_sharing
  use kinds, only: wp
  use ranks, only: ranks_t
  use contact, only: contact_t
  use tile_results, only: gather_points
  implicit none
  private

  public :: share_contact, join_contact

  integer, parameter :: n_values = 16    ! of a point that pass

contains

  !> Several processes work the tiles from here on.
  subroutine share_contact(contact, ranks)
    type(contact_t), intent(inout) :: contact
    class(ranks_t), intent(in) :: ranks

    if (.not. allocated(contact%ranks)) allocate (contact%ranks, source=ranks)
    contact%is_shared = ranks%n > 1
  end subroutine share_contact

  !> What the next call must know of all points, at all processes. The tiles stay shared.
  subroutine join_contact(contact)
    type(contact_t), intent(inout) :: contact
    real(wp), allocatable :: values(:, :)

    if (.not. contact%is_shared) return
    allocate (values(n_values, contact%secondary%n_points), source=0.0_wp)
    values(1, :) = real(contact%face, wp)
    values(2:3, :) = contact%at
    values(4, :) = contact%test_at
    values(5, :) = contact%search_at
    values(6, :) = contact%start
    values(7:9, :) = transpose(contact%force)
    if (allocated(contact%friction)) values(10:12, :) = contact%friction%stretch
    if (allocated(contact%damping)) values(13:15, :) = contact%damping%force
    if (allocated(contact%room)) values(16, :) = contact%room
    call gather_points(contact%ranks, contact%tiles, contact%secondary%n_along(1), values)
    contact%face = nint(values(1, :))
    contact%at = values(2:3, :)
    contact%test_at = values(4, :)
    contact%search_at = values(5, :)
    contact%start = values(6, :)
    contact%force = transpose(values(7:9, :))
    if (allocated(contact%friction)) contact%friction%stretch = values(10:12, :)
    if (allocated(contact%damping)) contact%damping%force = values(13:15, :)
    if (allocated(contact%room)) contact%room = values(16, :)
  end subroutine join_contact

end module contact_sharing
