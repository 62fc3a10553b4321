!> A contact whose sheet is cut by an outline.
module contact_trim
  use kinds, only: wp
  use contact, only: contact_t
  use contact_tiles, only: earliest_test
  use penalty, only: stiffness_from_mass, no_contact
  implicit none
  private

  public :: trim_contact

contains

  !> Give the points the areas that an outline leaves them, and springs in proportion. A point
  !! without area touches nothing any more.
  subroutine trim_contact(contact, area, lost, mass, dt)
    type(contact_t), intent(inout) :: contact
    real(wp), intent(in) :: area(contact%secondary%n_points)      !! see `areas_inside`
    real(wp), intent(out) :: lost                 !! energy of springs that are gone [energy]
    !> Of the control points afterwards and the largest step to come: no spring is stiffer than one
    !! made for them.
    real(wp), intent(in), optional :: mass(contact%secondary%n_net(1), contact%secondary%n_net(2))
    real(wp), intent(in), optional :: dt          !! [time]
    real(wp) :: ratio(size(area)), most(size(area))
    integer :: i

    associate (before => contact%secondary%area)
      if (.not. allocated(contact%secondary%whole_area)) contact%secondary%whole_area = before
      ratio = area/max(before, tiny(1.0_wp))
      before = area
    end associate
    if (present(mass) .and. present(dt)) then
      call stiffness_from_mass(contact%secondary, mass, contact%scale, dt, most)
      where (contact%stiffness > 0.0_wp) ratio = min(ratio, most/contact%stiffness)
    end if
    lost = 0.0_wp
    do i = 1, size(area)
      if (contact%stiffness(i) > 0.0_wp) &
        lost = lost + 0.5_wp*(1.0_wp - min(ratio(i), 1.0_wp))*sum(contact%force(i, :)**2) &
                      /contact%stiffness(i)
    end do
    contact%stiffness = contact%stiffness*min(ratio, 1.0_wp)
    do i = 1, 3
      contact%force(:, i) = contact%force(:, i)*min(ratio, 1.0_wp)
    end do
    if (allocated(contact%damping)) then
      contact%damping%constant = contact%damping%constant*min(ratio, 1.0_wp)
    end if
    where (area <= 0.0_wp)
      contact%test_at = huge(1.0_wp)
      contact%face = 0
      contact%start = no_contact
    end where
    if (allocated(contact%friction)) then
      do i = 1, 3
        where (area <= 0.0_wp) contact%friction%stretch(i, :) = 0.0_wp
      end do
    end if
    do i = 1, size(contact%tiles)
      contact%tiles(i)%test_at = earliest_test(contact%tiles(i), contact%secondary%n_along, &
                                               contact%test_at)
    end do
  end subroutine trim_contact

end module contact_trim
