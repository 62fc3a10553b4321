!> Tools that are hard for a closest-point search, about 10 to 100 long.
module hard_surfaces
  use kinds, only: wp
  use failure, only: error_t
  use knot_vector, only: new_knot_vector, greville
  use nurbs_surface, only: nurbs_surface_t
  use primitives, only: cylinder_surface, sphere_surface, plane_surface
  use refinement, only: insert_knots, dividing_knots
  use brute_force, only: random_in
  use channel_dies, only: lower_die, upper_die
  implicit none
  private

  public :: hard_case_t, hard_case, n_cases

  integer, parameter :: n_cases = 23

  !> A tool and how far the search reaches.
  type :: hard_case_t
    character(:), allocatable :: name
    type(nurbs_surface_t), allocatable :: surfaces(:)
    real(wp) :: reach = 0.0_wp
    logical :: is_on_middle = .false.   !! points on x = 0 alone, between two equal places
  end type hard_case_t

contains

  !> Case by its number.
  function hard_case(number) result(hard)
    integer, intent(in) :: number
    type(hard_case_t) :: hard
    type(error_t), allocatable :: error

    allocate (hard%surfaces(1))
    hard%reach = 3.0_wp
    select case (number)
    case (1:5)
      hard%name = "wavy, degree "//achar(48 + number)
      hard%surfaces(1) = wavy([number, number], evenly(6), evenly(5), 1.0_wp)
    case (6)
      hard%name = "degrees 5 and 1"
      hard%surfaces(1) = wavy([5, 1], evenly(4), evenly(7), 1.0_wp)
    case (7)
      hard%name = "breaks of the tangent (C0 knot lines)"
      hard%surfaces(1) = wavy([2, 2], repeated(evenly(5), 2), repeated(evenly(4), 2), 2.0_wp)
    case (8)
      hard%name = "knots once, twice and three times"
      hard%surfaces(1) = wavy([3, 3], [0.2_wp, 0.4_wp, 0.4_wp, 0.7_wp, 0.7_wp, 0.7_wp], &
                              [0.5_wp, 0.5_wp, 0.5_wp, 0.8_wp], 2.0_wp)
    case (9)
      hard%name = "sharp edges and corners"
      hard%surfaces(1) = rough(wavy([1, 1], evenly(6), evenly(6), 0.0_wp), 4.0_wp)
    case (10)
      hard%name = "tip of a cone"
      call cylinder_surface(hard%surfaces(1), [0.0_wp, 0.0_wp, 0.0_wp], &
                            [0.0_wp, 0.0_wp, 1.0_wp], 5.0_wp, 8.0_wp, 0.0_wp, 360.0_wp, error)
      hard%surfaces(1)%points(:, 2, :2) = 0.0_wp
    case (11)
      hard%name = "poles of a sphere"
      call sphere_surface(hard%surfaces(1), [0.0_wp, 0.0_wp, 0.0_wp], 6.0_wp, error)
    case (12)
      hard%name = "edge shrunk to a point"
      hard%surfaces(1) = wavy([2, 3], evenly(3), evenly(3), 1.0_wp)
      hard%surfaces(1)%points(1, :, :) = spread(hard%surfaces(1)%points(1, 3, :), 1, &
                                                size(hard%surfaces(1)%points, 2))
    case (13)
      hard%name = "weights from 0.001 to 1000"
      hard%surfaces(1) = weighted(wavy([2, 2], evenly(5), evenly(5), 1.0_wp))
    case (14)
      hard%name = "weights from 0.001 to 1000, degree 3"
      hard%surfaces(1) = weighted(wavy([3, 3], evenly(3), evenly(3), 1.0_wp))
    case (15)
      hard%name = "inside of a cylinder, radius below the reach"
      call cylinder_surface(hard%surfaces(1), [0.0_wp, 0.0_wp, 0.0_wp], &
                            [0.0_wp, 0.0_wp, 1.0_wp], 2.0_wp, 10.0_wp, 0.0_wp, 360.0_wp, error)
      hard%reach = 6.0_wp
    case (16)
      hard%name = "waves tighter than the reach"
      hard%surfaces(1) = wavy([2, 2], evenly(24), evenly(24), 1.5_wp)
      hard%reach = 5.0_wp
    case (17)
      hard%name = "middle of a groove"
      hard%surfaces(1) = groove()
      hard%reach = 6.0_wp
      hard%is_on_middle = .true.
    case (18)
      hard%name = "six patches of a box"
      call box(hard%surfaces)
    case (19)
      hard%name = "faces from 0.0001 to 0.5"
      hard%surfaces(1) = wavy([2, 2], [1.0e-4_wp, 3.0e-4_wp, 1.0e-3_wp, 0.02_wp, 0.5_wp], &
                              [0.4_wp, 0.401_wp, 0.9_wp], 0.0_wp)
      associate (points => hard%surfaces(1)%points)
        points(:, :, 3) = 2*sin(0.9_wp*points(:, :, 1))*cos(0.7_wp*points(:, :, 2))
      end associate
    case default
      call hard_tool(number, hard)
    end select
  end function hard_case

  !> The cases that are tools: one of very many faces, and those of the seed.
  subroutine hard_tool(number, hard)
    integer, intent(in) :: number
    type(hard_case_t), intent(inout) :: hard

    select case (number)
    case (20)
      hard%name = "200 x 200 faces"
      hard%surfaces(1) = wavy([2, 2], evenly(200), evenly(200), 0.005_wp)
      hard%reach = 0.5_wp
    case (21)
      hard%name = "lower die of the channel (tables B1, B3)"
      hard%surfaces(1) = lower_die()
      hard%reach = 60.0_wp
    case (22)
      hard%name = "upper die of the channel (tables B2, B3)"
      hard%surfaces(1) = upper_die()
      hard%reach = 60.0_wp
    case (23)
      hard%name = "halves of a cylinder with other knots"
      call halves_of_cylinder(hard%surfaces)
      hard%reach = 6.0_wp
    end select
  end subroutine hard_tool

  !> Inner knots of `n` equal spans.
  pure function evenly(n) result(knots)
    integer, intent(in) :: n
    real(wp) :: knots(n - 1)
    integer :: i

    knots = [(real(i, wp)/n, i=1, n - 1)]
  end function evenly

  pure function repeated(knots, times) result(more)
    real(wp), intent(in) :: knots(:)
    integer, intent(in) :: times
    real(wp) :: more(size(knots)*times)

    more = reshape(spread(knots, 1, times), [size(more)])
  end function repeated

  !> Height field over [0, 10] x [0, 10] with waves of its control points.
  function wavy(degrees, knots1, knots2, height) result(surface)
    integer, intent(in) :: degrees(2)
    real(wp), intent(in) :: knots1(:), knots2(:), height
    type(nurbs_surface_t) :: surface
    type(error_t), allocatable :: error
    integer :: i, j

    call new_knot_vector(surface%axes(1), degrees(1), ends(degrees(1), knots1), error)
    call new_knot_vector(surface%axes(2), degrees(2), ends(degrees(2), knots2), error)
    allocate (surface%points(surface%axes(1)%n_basis, surface%axes(2)%n_basis, 3))
    allocate (surface%weights(surface%axes(1)%n_basis, surface%axes(2)%n_basis), source=1.0_wp)
    associate (xi => greville(surface%axes(1)), eta => greville(surface%axes(2)))
      do j = 1, size(eta)
        do i = 1, size(xi)
          surface%points(i, j, :) = [10*xi(i), 10*eta(j), &
                                     height*sin(2.3_wp*i + 0.4_wp*j)*cos(1.9_wp*j)]
        end do
      end do
    end associate
  end function wavy

  pure function ends(degree, inner) result(knots)
    integer, intent(in) :: degree
    real(wp), intent(in) :: inner(:)
    real(wp) :: knots(size(inner) + 2*degree + 2)

    knots = 0.0_wp
    knots(degree + 2:degree + 1 + size(inner)) = inner
    knots(degree + 2 + size(inner):) = 1.0_wp
  end function ends

  !> Control points moved at random along z.
  function rough(smooth, height) result(surface)
    type(nurbs_surface_t), intent(in) :: smooth
    real(wp), intent(in) :: height
    type(nurbs_surface_t) :: surface
    real(wp) :: draw(3)
    integer :: i, j, seed

    surface = smooth
    seed = 11
    do j = 1, size(surface%points, 2)
      do i = 1, size(surface%points, 1)
        call random_in(reshape([0, 0, 0, 1, 1, 1], [3, 2])*1.0_wp, seed, draw)
        surface%points(i, j, 3) = surface%points(i, j, 3) + height*draw(1)
      end do
    end do
  end function rough

  !> Weights over six orders of magnitude at random.
  function weighted(plain) result(surface)
    type(nurbs_surface_t), intent(in) :: plain
    type(nurbs_surface_t) :: surface
    real(wp) :: draw(3)
    integer :: i, j, seed

    surface = plain
    seed = 7
    do j = 1, size(surface%weights, 2)
      do i = 1, size(surface%weights, 1)
        call random_in(reshape([0, 0, 0, 1, 1, 1], [3, 2])*1.0_wp, seed, draw)
        surface%weights(i, j) = 10.0_wp**(6*draw(1) - 3)
      end do
    end do
  end function weighted

  !> A groove along y, the same on both sides of x = 0.
  function groove() result(surface)
    type(nurbs_surface_t) :: surface
    integer :: i

    surface = wavy([2, 1], evenly(6), evenly(2), 0.0_wp)
    surface%points(:, :, 1) = surface%points(:, :, 1) - 5
    do i = 1, size(surface%points, 1)
      surface%points(i, :, 3) = abs(surface%points(i, :, 1))**1.5_wp
    end do
  end function groove

  !> The sides of a box, each a surface of its own.
  subroutine box(surfaces)
    type(nurbs_surface_t), allocatable, intent(inout) :: surfaces(:)
    real(wp), parameter :: x(3) = [10.0_wp, 0.0_wp, 0.0_wp], y(3) = [0.0_wp, 7.0_wp, 0.0_wp], &
      z(3) = [0.0_wp, 0.0_wp, 4.0_wp], o(3) = 0.0_wp
    type(error_t), allocatable :: error

    deallocate (surfaces)
    allocate (surfaces(6))
    call plane_surface(surfaces(1), o, y, x, error)
    call plane_surface(surfaces(2), z, x, y, error)
    call plane_surface(surfaces(3), o, x, z, error)
    call plane_surface(surfaces(4), y, z, x, error)
    call plane_surface(surfaces(5), o, z, y, error)
    call plane_surface(surfaces(6), x, y, z, error)
  end subroutine box

  !> A cylinder in two surfaces whose knots do not match at the seams; one of them faces inwards.
  subroutine halves_of_cylinder(surfaces)
    type(nurbs_surface_t), allocatable, intent(inout) :: surfaces(:)
    real(wp), parameter :: origin(3) = 0.0_wp, axis(3) = [0.0_wp, 0.0_wp, 1.0_wp]
    type(error_t), allocatable :: error
    integer :: i

    deallocate (surfaces)
    allocate (surfaces(2))
    do i = 1, 2
      call cylinder_surface(surfaces(i), origin, axis, 10.0_wp, 30.0_wp, 180.0_wp*(i - 1), &
                            180.0_wp, error)
    end do
    surfaces(2)%points = surfaces(2)%points(:, 2:1:-1, :)
    surfaces(2)%weights = surfaces(2)%weights(:, 2:1:-1)
    call insert_knots(surfaces(1), 2, dividing_knots(surfaces(1)%axes(2), 2), error)
    call insert_knots(surfaces(2), 1, dividing_knots(surfaces(2)%axes(1), 3), error)
    call insert_knots(surfaces(2), 2, dividing_knots(surfaces(2)%axes(2), 5), error)
  end subroutine halves_of_cylinder

end module hard_surfaces
