!> Names of units for the datasets, from the label that a deck gives to its units.
!!
!! A deck is consistent in any units and only names them, such as `mm, t, s, N, MPa, mJ`. What the
!! label does not name is composed of length, mass and time; without a label the quantities
!! themselves stand for their units.
module unit_system
  use kinds, only: wp
  implicit none
  private

  public :: unit_system_t, new_unit_system, unit_of, size_in_si

  !> Symbols of a deck's units.
  type :: unit_system_t
    character(:), allocatable :: length, mass, time, force, stress, energy
  end type unit_system_t

contains

  !> Read a label: symbols in any order, separated by blanks, commas or semicolons.
  pure function new_unit_system(label) result(units)
    character(*), intent(in) :: label
    type(unit_system_t) :: units
    integer :: first, last

    units%length = "length"
    units%mass = "mass"
    units%time = "time"
    first = 1
    do while (first <= len(label))
      last = scan(label(first:), " ,;-") + first - 2
      if (last < first - 1) last = len(label)
      if (last >= first) call place_symbol(units, label(first:last))
      first = last + 2
    end do
    if (label == "") then
      units%force = "force"
      units%stress = "stress"
      units%energy = "energy"
    end if
    if (.not. allocated(units%force)) then
      units%force = units%mass//"*"//units%length//"/"//units%time//"^2"
    end if
    if (.not. allocated(units%stress)) units%stress = units%force//"/"//units%length//"^2"
    if (.not. allocated(units%energy)) units%energy = units%force//"*"//units%length
  end function new_unit_system

  !> Unit of a quantity: length, time, velocity, mass, force, stress, energy, momentum,
  !! angular momentum, moment of a force, force/length, volume, wear (stress times length) or 1.
  pure function unit_of(units, quantity) result(unit)
    type(unit_system_t), intent(in) :: units
    character(*), intent(in) :: quantity
    character(:), allocatable :: unit

    select case (quantity)
    case ("length")
      unit = units%length
    case ("time")
      unit = units%time
    case ("mass")
      unit = units%mass
    case ("velocity")
      unit = units%length//"/"//units%time
    case ("volume")
      unit = units%length//"^3"
    case ("momentum")
      unit = units%mass//"*"//units%length//"/"//units%time
    case ("angular momentum")
      unit = units%mass//"*"//units%length//"^2/"//units%time
    case ("force")
      unit = units%force
    case ("force/length")
      unit = units%force//"/"//units%length
    case ("moment")
      unit = units%force//"*"//units%length
    case ("stress")
      unit = units%stress
    case ("energy")
      unit = units%energy
    case ("wear")
      unit = units%stress//"*"//units%length
    case default
      unit = "1"
    end select
  end function unit_of

  !> Size of a unit of length, mass, time or stress in SI units; 0 for any other text.
  pure real(wp) function size_in_si(symbol) result(size)
    character(*), intent(in) :: symbol

    select case (symbol)
    case ("m", "kg", "s", "Pa"); size = 1.0_wp
    case ("cm"); size = 1.0e-2_wp
    case ("mm", "g", "ms"); size = 1.0e-3_wp
    case ("um", "us", "mg"); size = 1.0e-6_wp
    case ("in"); size = 0.0254_wp
    case ("ft"); size = 0.3048_wp
    case ("t", "Mg", "tonne", "kPa"); size = 1.0e3_wp
    case ("lb"); size = 0.45359237_wp
    case ("slug"); size = 14.5939029_wp
    case ("MPa"); size = 1.0e6_wp
    case ("GPa"); size = 1.0e9_wp
    case ("psi"); size = 6894.757293_wp
    case ("ksi"); size = 6894757.293_wp
    case default; size = 0.0_wp
    end select
  end function size_in_si

  pure subroutine place_symbol(units, symbol)
    type(unit_system_t), intent(inout) :: units
    character(*), intent(in) :: symbol

    select case (symbol)
    case ("m", "cm", "mm", "um", "in", "ft")
      units%length = symbol
    case ("t", "kg", "g", "mg", "Mg", "tonne", "lb", "slug")
      units%mass = symbol
    case ("s", "ms", "us")
      units%time = symbol
    case ("N", "kN", "MN", "mN", "lbf")
      units%force = symbol
    case ("Pa", "kPa", "MPa", "GPa", "psi", "ksi")
      units%stress = symbol
    case ("J", "mJ", "kJ", "MJ", "uJ")
      units%energy = symbol
    end select
  end subroutine place_symbol

end module unit_system
