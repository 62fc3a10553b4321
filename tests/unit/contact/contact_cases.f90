!> What the tests of contact share: faces of a blank, a plate as tool, a sheet drawn over a die.
module contact_cases
  use kinds, only: wp
  use failure, only: error_t
  use knot_vector, only: knot_vector_t, new_knot_vector, greville
  use nurbs_surface, only: nurbs_surface_t
  use primitives, only: plane_surface
  use tool, only: tool_t, new_tool
  use secondary_surface, only: secondary_surface_t, new_secondary_surface, points_gauss
  use contact, only: contact_t, contact_options_t, new_contact
  implicit none
  private

  public :: flat_face, plate, contact_of, drawn_net

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

  !> A plate 100 x 50 in the plane y = 0, its sheet above.
  function plate() result(tool)
    type(tool_t) :: tool
    type(nurbs_surface_t) :: surface
    type(error_t), allocatable :: error

    call plane_surface(surface, [0.0_wp, 0.0_wp, 0.0_wp], [100.0_wp, 0.0_wp, 0.0_wp], &
                       [0.0_wp, 0.0_wp, 50.0_wp], error)
    call new_tool(tool, "plate", [surface], -1, 9.0_wp, error)
  end function plate

  !> Contact of a face with a tool, all control points of unit mass, dt = 1.
  function contact_of(face, tool, options) result(pair)
    type(nurbs_surface_t), intent(in) :: face
    type(tool_t), intent(in) :: tool
    type(contact_options_t), intent(in) :: options
    type(contact_t) :: pair
    type(secondary_surface_t) :: secondary
    type(error_t), allocatable :: error

    call new_secondary_surface(secondary, face, points_gauss, face%axes%degree + 1, error)
    call new_contact(pair, secondary, tool, spread(spread(1.0_wp, 1, secondary%n_net(1)), 2, &
                     secondary%n_net(2)), 1.0_wp, options, error)
  end function contact_of

  !> Control points of a sheet that is drawn over a die while it waves and slides.
  function drawn_net(face, step) result(net)
    type(nurbs_surface_t), intent(in) :: face
    integer, intent(in) :: step
    real(wp) :: net(size(face%points, 1), size(face%points, 2), 3), x, time
    integer :: i, j

    time = 0.02_wp*step
    do j = 1, size(net, 2)
      do i = 1, size(net, 1)
        x = face%points(i, j, 1)
        net(i, j, 1) = x + 3*sin(time)
        net(i, j, 2) = face%points(i, j, 2) - 60*time/(1 + ((x - 300)/70)**4) &
                       + 2*sin(0.05_wp*x + 0.03_wp*face%points(i, j, 3) + 5*time)
        net(i, j, 3) = face%points(i, j, 3) + time
      end do
    end do
  end function drawn_net

end module contact_cases
