!> Whether curves have been drawn in another unit of length than that of the deck.
module outline_units
  use kinds, only: wp
  use text, only: rounded_text
  use unit_system, only: unit_system_t, new_unit_system, size_in_si
  use element, only: element_t
  use blank_trim, only: trim_t
  implicit none
  private

  public :: unit_hint

  character(2), parameter :: names(6) = ["um", "mm", "cm", "in", "ft", "m "]
  real(wp), parameter :: usual = 0.125_wp     !! of the sheet: curves are at least as long
  real(wp), parameter :: rounding = 0.01_wp   !! of the sheet: numbers of tables are rounded

contains

  !> Words on the unit in which curves would lie on the sheet. They are empty for curves that lie on
  !! it as they are and have the usual size, and where no unit makes it so.
  pure function unit_hint(cut, element, label) result(hint)
    type(trim_t), intent(in) :: cut
    class(element_t), intent(in) :: element
    character(*), intent(in) :: label               !! what *UNITS says, empty: nothing
    character(:), allocatable :: hint
    type(unit_system_t) :: units
    real(wp) :: sheet(2, 2), curves(2, 2), of_deck, factor, best
    integer :: a, i, p, axis

    hint = ""
    if (size(cut%polygons) == 0) return
    do a = 1, 2
      axis = mod(cut%axis + a - 1, 3) + 1
      associate (x => element%motion%x(:, :, :, axis))
        sheet(a, :) = [minval(x), maxval(x)]
      end associate
      curves(a, :) = [minval([(minval(cut%polygons(p)%corners(a, :)), p=1, size(cut%polygons))]), &
                      maxval([(maxval(cut%polygons(p)%corners(a, :)), p=1, size(cut%polygons))])]
    end do
    best = max(usual, share_of(curves, sheet))
    if (best > usual) return
    units = new_unit_system(label)
    of_deck = size_in_si(units%length)
    if (.not. of_deck > 0.0_wp) of_deck = size_in_si("mm")
    do i = 1, size(names)
      factor = size_in_si(trim(names(i)))/of_deck
      if (share_of(factor*curves, sheet) <= best) cycle
      best = share_of(factor*curves, sheet)
      hint = "with lengths in "//trim(names(i))//", "//rounded_text(factor)// &
             " times those of the deck, the curves would lie on the sheet"
    end do
  end function unit_hint

  !> Length of what lies in a box over that of the sheet; 0 where the box is not all on the sheet.
  pure real(wp) function share_of(box, sheet) result(share)
    real(wp), intent(in) :: box(2, 2), sheet(2, 2)     !! low, high
    real(wp) :: extent

    share = 0.0_wp
    extent = maxval(sheet(:, 2) - sheet(:, 1))
    if (any(box(:, 1) < sheet(:, 1) - rounding*extent)) return
    if (any(box(:, 2) > sheet(:, 2) + rounding*extent)) return
    share = maxval(box(:, 2) - box(:, 1))/extent
  end function share_of

end module outline_units
