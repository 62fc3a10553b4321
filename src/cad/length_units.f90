!> Units of length by name and by their flag in IGES files (IGES 5.3, section 2.2.4.3.14).
module length_units
  use kinds, only: wp
  use text, only: upper_case
  implicit none
  private

  public :: unit_in_mm, unit_flag, flag_name

  !> Names that a deck may give, separated by |.
  character(*), parameter, public :: unit_names = "MM|CM|M|KM|UM|IN|FT|MI|MIL|UIN"

  integer, parameter, public :: flag_by_name = 3   !! the flag that leaves the unit to its name

  character(3), parameter :: names(11) = [character(3) :: "IN", "MM", "", "FT", "MI", "M", "KM", &
                                          "MIL", "UM", "CM", "UIN"]
  real(wp), parameter :: millimetres(11) = [25.4_wp, 1.0_wp, 0.0_wp, 304.8_wp, 1609344.0_wp, &
                                            1.0e3_wp, 1.0e6_wp, 0.0254_wp, 1.0e-3_wp, 10.0_wp, &
                                            2.54e-5_wp]

contains

  !> Flag of a unit; 0 for a name that is none. Case does not matter.
  pure integer function unit_flag(name) result(flag)
    character(*), intent(in) :: name

    do flag = size(names), 1, -1
      if (flag /= flag_by_name .and. names(flag) == upper_case(name)) return
    end do
    if (upper_case(name) == "INCH") flag = 1
  end function unit_flag

  !> Millimetres in a unit; 0 for a name that is none.
  pure real(wp) function unit_in_mm(name)
    character(*), intent(in) :: name
    integer :: flag

    unit_in_mm = 0.0_wp
    flag = unit_flag(name)
    if (flag > 0) unit_in_mm = millimetres(flag)
  end function unit_in_mm

  !> Name of a flag; empty for one that names no unit.
  pure function flag_name(flag) result(name)
    integer, intent(in) :: flag
    character(:), allocatable :: name

    name = ""
    if (flag >= 1 .and. flag <= size(names)) name = trim(names(flag))
  end function flag_name

end module length_units
