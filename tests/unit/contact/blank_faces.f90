!> Faces of a blank for the tests of contact: flat or wavy, plain or rational.
module blank_faces
  use kinds, only: wp
  use errors, only: error_t
  use knot_vector, only: knot_vector_t, new_knot_vector, greville
  use nurbs_surface, only: nurbs_surface_t
  implicit none
  private

  public :: flat_face

contains

  !> Face over 0 <= x <= length, 0 <= z <= width at height y, whose normal xi x eta points down,
  !! with equal elements. `wave` is the height of a ripple, `spread` the variation of the weights.
  function flat_face(degree, n_elements, length, width, y, wave, spread) result(face)
    integer, intent(in) :: degree, n_elements(2)
    real(wp), intent(in) :: length, width, y
    real(wp), intent(in), optional :: wave, spread
    type(nurbs_surface_t) :: face
    type(error_t), allocatable :: error
    integer :: i, j, d
    real(wp) :: u(2)

    do d = 1, 2
      call new_knot_vector(face%axes(d), degree, [(0.0_wp, i=1, degree), &
        (real(i, wp)/n_elements(d), i=0, n_elements(d)), (1.0_wp, i=1, degree)], error)
    end do
    allocate (face%points(face%axes(1)%n_basis, face%axes(2)%n_basis, 3))
    allocate (face%weights(face%axes(1)%n_basis, face%axes(2)%n_basis), source=1.0_wp)
    associate (xi => greville(face%axes(1)), eta => greville(face%axes(2)))
      do j = 1, size(eta)
        do i = 1, size(xi)
          u = [xi(i), eta(j)]
          face%points(i, j, :) = [length*u(1), y, width*u(2)]
          if (present(wave)) face%points(i, j, 2) = y + wave*sin(7*u(1) + 5*u(2))
          if (present(spread)) face%weights(i, j) = 1 + spread*sin(3.0_wp*i + 2.0_wp*j)
        end do
      end do
    end associate
  end function flat_face

end module blank_faces
