!> The dies of the seed's forming example: tables B1 to B3 of [CA], extruded over z = 0 ... 400.
module channel_dies
  use kinds, only: wp
  use failure, only: error_t
  use knot_vector, only: knot_vector_t, new_knot_vector
  use nurbs_surface, only: nurbs_surface_t
  use primitives, only: extruded_surface
  implicit none
  private

  public :: lower_die, upper_die

  integer, parameter :: n = 22
  real(wp), parameter :: knots(25) = [ &
    0.0_wp, 0.0_wp, 0.0_wp, 0.5_wp, 1.0_wp, 1.0_wp, 1.5_wp, 2.0_wp, 2.0_wp, 2.5_wp, 3.0_wp, &
    3.0_wp, 3.5_wp, 4.0_wp, 4.0_wp, 4.5_wp, 5.0_wp, 5.0_wp, 5.5_wp, 6.0_wp, 6.0_wp, 6.5_wp, &
    7.0_wp, 7.0_wp, 7.0_wp]
  real(wp), parameter :: a = 0.853553_wp
  real(wp), parameter :: weights(n) = [ &
    1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, a, a, 1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, a, &
    a, 1.0_wp, a, a, 1.0_wp, a, a, 1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp]
  real(wp), parameter :: lower_x(n) = [ &
    -100.0_wp, -25.0_wp, 125.0_wp, 200.0_wp, 220.710678_wp, 250.0_wp, 250.0_wp, 250.0_wp, &
    250.0_wp, 250.0_wp, 250.0_wp, 279.289322_wp, 300.0_wp, 320.710678_wp, 350.0_wp, 350.0_wp, &
    350.0_wp, 379.289322_wp, 400.0_wp, 475.0_wp, 625.0_wp, 700.0_wp]
  real(wp), parameter :: lower_y(n) = [ &
    -0.5_wp, -0.5_wp, -0.5_wp, -0.5_wp, -0.5_wp, -29.789322_wp, -50.5_wp, -63.0_wp, -88.0_wp, &
    -100.5_wp, -121.210678_wp, -150.5_wp, -150.5_wp, -150.5_wp, -121.210678_wp, -100.5_wp, &
    -79.789322_wp, -50.5_wp, -50.5_wp, -50.5_wp, -50.5_wp, -50.5_wp]
  real(wp), parameter :: upper_x(n) = [ &
    -100.0_wp, -25.0_wp, 125.0_wp, 200.0_wp, 222.624103_wp, 254.614735_wp, 255.0_wp, 255.0_wp, &
    255.0_wp, 255.0_wp, 254.614735_wp, 281.213958_wp, 300.0_wp, 318.786042_wp, 345.385265_wp, &
    345.0_wp, 345.385265_wp, 377.364686_wp, 400.0_wp, 475.0_wp, 625.0_wp, 700.0_wp]
  real(wp), parameter :: upper_y(n) = [ &
    154.5_wp, 154.5_wp, 154.5_wp, 154.5_wp, 154.119394_wp, 122.135314_wp, 99.5_wp, 87.0_wp, &
    62.0_wp, 49.5_wp, 30.713958_wp, 4.114735_wp, 4.5_wp, 4.114735_wp, 30.713958_wp, 49.5_wp, &
    72.135314_wp, 104.114735_wp, 104.5_wp, 104.5_wp, 104.5_wp, 104.5_wp]

contains

  !> Table B1. The normal xi x eta points down: the sheet is on side -1.
  function lower_die() result(die)
    type(nurbs_surface_t) :: die

    die = extruded(lower_x, lower_y)
  end function lower_die

  !> Table B2, with breaks of the tangent at xi = 1 ... 6. The sheet is on side +1.
  function upper_die() result(die)
    type(nurbs_surface_t) :: die

    die = extruded(upper_x, upper_y)
  end function upper_die

  !> A profile of table B1 or B2 over the knots of table B3, in 12 rows along z.
  function extruded(x, y) result(die)
    real(wp), intent(in) :: x(n), y(n)
    type(nurbs_surface_t) :: die
    type(knot_vector_t) :: curve
    type(error_t), allocatable :: error
    real(wp) :: points(n, 3)

    points(:, 1) = x
    points(:, 2) = y
    points(:, 3) = 0.0_wp
    call new_knot_vector(curve, 2, knots, error)
    call extruded_surface(die, curve, points, weights, [0.0_wp, 0.0_wp, 400.0_wp], 12, 2, error)
  end function extruded

end module channel_dies
