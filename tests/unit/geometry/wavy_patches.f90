!> Surfaces and solids for tests: rational, distorted, with simple and repeated knots.
module wavy_patches
  use kinds, only: wp
  use failure, only: error_t
  use knot_vector, only: knot_vector_t, new_knot_vector
  use nurbs_surface, only: nurbs_surface_t, new_nurbs_surface
  use nurbs_solid, only: nurbs_solid_t, new_nurbs_solid
  implicit none
  private

  public :: uneven_axis, wavy_surface, wavy_solid

contains

  !> Knots over [0, 2] with a simple knot at 0.5 and one of multiplicity `degree` at 1.1.
  function uneven_axis(degree) result(kv)
    integer, intent(in) :: degree
    type(knot_vector_t) :: kv
    type(error_t), allocatable :: error
    integer :: i

    call new_knot_vector(kv, degree, [(0.0_wp, i=0, degree), 0.5_wp, (1.1_wp, i=1, degree), &
                                      (2.0_wp, i=0, degree)], error)
    if (allocated(error)) error stop "the knot vector of the test is wrong"
  end function uneven_axis

  !> A wavy surface with weights between 0.6 and 1.4.
  function wavy_surface(p, q) result(surface)
    integer, intent(in) :: p, q   !! degrees
    type(nurbs_surface_t) :: surface
    type(error_t), allocatable :: error
    type(knot_vector_t) :: axis1, axis2
    real(wp), allocatable :: points(:, :, :), weights(:, :)
    integer :: i, j

    axis1 = uneven_axis(p)
    axis2 = uneven_axis(q)
    allocate (points(axis1%n_basis, axis2%n_basis, 3), weights(axis1%n_basis, axis2%n_basis))
    do j = 1, axis2%n_basis
      do i = 1, axis1%n_basis
        points(i, j, :) = [i + 0.3_wp*sin(2.0_wp*j), j + 0.2_wp*cos(3.0_wp*i), sin(1.0_wp*i*j)]
        weights(i, j) = 1.0_wp + 0.4_wp*sin(1.0_wp*i + 2*j)
      end do
    end do
    call new_nurbs_surface(surface, axis1, axis2, points, weights, error)
    if (allocated(error)) error stop "the surface of the test is wrong"
  end function wavy_surface

  !> A slightly distorted right-handed block with weights between 0.8 and 1.2.
  function wavy_solid(degrees) result(solid)
    integer, intent(in) :: degrees(3)
    type(nurbs_solid_t) :: solid
    type(error_t), allocatable :: error
    type(knot_vector_t) :: axes(3)
    real(wp), allocatable :: points(:, :, :, :), weights(:, :, :)
    integer :: i, j, k

    do i = 1, 3
      axes(i) = uneven_axis(degrees(i))
    end do
    allocate (points(axes(1)%n_basis, axes(2)%n_basis, axes(3)%n_basis, 3))
    allocate (weights(axes(1)%n_basis, axes(2)%n_basis, axes(3)%n_basis))
    do k = 1, axes(3)%n_basis
      do j = 1, axes(2)%n_basis
        do i = 1, axes(1)%n_basis
          points(i, j, k, 1) = i + 0.1_wp*sin(2.0_wp*j + k)
          points(i, j, k, 2) = j + 0.1_wp*cos(3.0_wp*i - k)
          points(i, j, k, 3) = k + 0.1_wp*sin(1.0_wp*i*j)
          weights(i, j, k) = 1.0_wp + 0.2_wp*sin(1.0_wp*i + 2*j + 3*k)
        end do
      end do
    end do
    call new_nurbs_solid(solid, axes, points, weights, error)
    if (allocated(error)) error stop "the solid of the test is wrong"
  end function wavy_solid

end module wavy_patches
