!> Whether curves have been drawn in another unit of length than that of the deck.
module outline_units
  use kinds, only: wp
  use text, only: rounded_text
  use unit_system, only: unit_system_t, new_unit_system, size_in_si
  use outline, only: plane_of
  use element, only: element_t
  use blank_trim, only: trim_t
  implicit none
  private

  public :: unit_hint

  character(2), parameter :: names(6) = ["um", "mm", "cm", "in", "ft", "m "]
  character(2), parameter :: usual_units(2) = ["mm", "m "]   !! of decks that name none
  real(wp), parameter :: usual = 0.125_wp     !! of the sheet: curves are at least as long
  real(wp), parameter :: rounding = 0.01_wp   !! of the sheet: numbers of tables are rounded

contains

  !> Words on the unit in which curves would lie on the sheet; the factor alone where the deck names
  !! no unit of length. They are empty for curves that lie on it as they are and have the usual
  !! size, and where no unit makes it so.
  pure function unit_hint(cut, element, label) result(hint)
    type(trim_t), intent(in) :: cut
    class(element_t), intent(in) :: element
    character(*), intent(in) :: label               !! what *UNITS says, empty: nothing
    character(:), allocatable :: hint
    type(unit_system_t) :: units
    real(wp) :: sheet(2, 2), curves(2, 2), of_deck
    integer :: a, p, d, plane(2)

    hint = ""
    if (size(cut%polygons) == 0) return
    plane = plane_of(cut%axis)
    do a = 1, 2
      associate (x => element%motion%x(:, :, :, plane(a)))
        sheet(a, :) = [minval(x), maxval(x)]
      end associate
      curves(a, :) = [minval([(minval(cut%polygons(p)%corners(a, :)), p=1, size(cut%polygons))]), &
                      maxval([(maxval(cut%polygons(p)%corners(a, :)), p=1, size(cut%polygons))])]
    end do
    if (share_of(curves, sheet) > usual) return
    units = new_unit_system(label)
    of_deck = size_in_si(units%length)
    if (of_deck > 0.0_wp) then
      call try_units(curves, sheet, of_deck, .true., hint)
      return
    end if
    do d = 1, size(usual_units)
      if (hint == "") call try_units(curves, sheet, size_in_si(trim(usual_units(d))), .false., hint)
    end do
  end function unit_hint

  !> The hint for a deck whose unit of length has a size; empty where no unit fits.
  pure subroutine try_units(curves, sheet, of_deck, is_named, hint)
    real(wp), intent(in) :: curves(2, 2), sheet(2, 2)  !! low, high
    real(wp), intent(in) :: of_deck                    !! [m]
    logical, intent(in) :: is_named                    !! by the deck
    character(:), allocatable, intent(out) :: hint
    real(wp) :: factor, best
    integer :: i

    hint = ""
    best = max(usual, share_of(curves, sheet))
    do i = 1, size(names)
      factor = size_in_si(trim(names(i)))/of_deck
      if (share_of(factor*curves, sheet) <= best) cycle
      best = share_of(factor*curves, sheet)
      hint = "multiplied by "//rounded_text(factor)
      if (is_named) hint = "read as "//trim(names(i))//" ("//hint//")"
      hint = hint//" the curves would lie on the sheet"
    end do
  end subroutine try_units

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
