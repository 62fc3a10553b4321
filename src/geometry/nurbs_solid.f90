!> Rational B-spline solids: the blank.
!!
!! [CA] R. P. R. Cardoso and O. B. Adetoro (2017), eq. (8) and appendix 1.
module nurbs_solid
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use failure, only: error_t, fail
  use knot_vector, only: knot_vector_t, find_span, basis_derivatives
  use nurbs_surface, only: nurbs_surface_t
  implicit none
  private

  public :: nurbs_solid_t, new_nurbs_solid, evaluate_solid, solid_face, face_axes, face_side

  !> Solid on a tensor grid of control points; points are not pre-multiplied by weights.
  type :: nurbs_solid_t
    type(knot_vector_t) :: axes(3)                  !! knot vectors of xi, eta and zeta
    real(wp), allocatable :: points(:, :, :, :)     !! control points [length], (n1, n2, n3, 3)
    real(wp), allocatable :: weights(:, :, :)       !! positive, shape (n1, n2, n3)
  end type nurbs_solid_t

contains

  !> Put a solid together after checking that its parts fit.
  !!
  !! Rejected: grids of the wrong shape, coordinates that are not finite, weights that are not
  !! finite and positive.
  pure subroutine new_nurbs_solid(solid, axes, points, weights, error)
    type(nurbs_solid_t), intent(out) :: solid
    type(knot_vector_t), intent(in) :: axes(3)    !! knot vectors of xi, eta and zeta
    real(wp), intent(in) :: points(:, :, :, :)    !! control points [length], (n1, n2, n3, 3)
    real(wp), intent(in) :: weights(:, :, :)      !! shape (n1, n2, n3)
    type(error_t), allocatable, intent(out) :: error

    if (any(shape(points) /= [axes%n_basis, 3])) then
      call fail(error, "solid: the knot vectors do not fit the grid of control points")
    else if (any(shape(weights) /= axes%n_basis)) then
      call fail(error, "solid: there must be one weight for each control point")
    else if (.not. all(ieee_is_finite(points))) then
      call fail(error, "solid: control points must be finite numbers")
    else if (.not. all(ieee_is_finite(weights))) then
      call fail(error, "solid: weights must be finite numbers")
    else if (any(weights <= 0.0_wp)) then
      call fail(error, "solid: weights must be positive")
    else
      solid%axes = axes
      solid%points = points
      solid%weights = weights
    end if
  end subroutine new_nurbs_solid

  !> Point of the solid and its derivatives by the parametric coordinates, [CA] eq. (8), (A1).
  !!
  !! Outside the range of the knots the polynomials of the nearest span continue.
  pure subroutine evaluate_solid(solid, xi, point, jacobian)
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), intent(in) :: xi(3)                      !! parametric coordinates
    real(wp), intent(out) :: point(3)                  !! [length]
    real(wp), intent(out), optional :: jacobian(3, 3)  !! dx_i/dxi_j
    real(wp) :: h(4, 0:3)
    integer :: axis, span(3)

    do axis = 1, 3
      span(axis) = find_span(solid%axes(axis), xi(axis))
    end do
    call homogeneous_gradient(solid, span, xi, h)
    point = h(:3, 0)/h(4, 0)
    if (present(jacobian)) then
      do axis = 1, 3
        jacobian(:, axis) = (h(:3, axis) - h(4, axis)*point)/h(4, 0)
      end do
    end if
  end subroutine evaluate_solid

  !> Values `h(:, 0)` and derivatives `h(:, axis)` of (w x, w y, w z, w), one direction at a time.
  pure subroutine homogeneous_gradient(solid, span, xi, h)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: span(3)
    real(wp), intent(in) :: xi(3)
    real(wp), intent(out) :: h(4, 0:3)
    real(wp) :: basis1(solid%axes(1)%degree + 1, 0:1), basis2(solid%axes(2)%degree + 1, 0:1)
    real(wp) :: basis3(solid%axes(3)%degree + 1, 0:1), line(4, 0:1), layer(4, 0:2), control(4)
    integer :: i, j, k, at(3), first(3)

    call basis_derivatives(solid%axes(1), span(1), xi(1), 1, basis1)
    call basis_derivatives(solid%axes(2), span(2), xi(2), 1, basis2)
    call basis_derivatives(solid%axes(3), span(3), xi(3), 1, basis3)
    first = span - solid%axes%degree - 1
    h = 0.0_wp
    do k = 1, size(basis3, 1)
      layer = 0.0_wp
      do j = 1, size(basis2, 1)
        line = 0.0_wp
        do i = 1, size(basis1, 1)
          at = first + [i, j, k]
          control(4) = solid%weights(at(1), at(2), at(3))
          control(:3) = control(4)*solid%points(at(1), at(2), at(3), :)
          line(:, 0) = line(:, 0) + basis1(i, 0)*control
          line(:, 1) = line(:, 1) + basis1(i, 1)*control
        end do
        layer(:, :1) = layer(:, :1) + basis2(j, 0)*line
        layer(:, 2) = layer(:, 2) + basis2(j, 1)*line(:, 0)
      end do
      h(:, :2) = h(:, :2) + basis3(k, 0)*layer
      h(:, 3) = h(:, 3) + basis3(k, 1)*layer(:, 0)
    end do
  end subroutine homogeneous_gradient

  !> One of the six faces as a surface: the outermost layer of control points.
  !!
  !! The axes of the surface are the two other axes of the solid in rising order, whatever the face
  !! (`face_axes`); `face_side` gives the direction of axis 1 x axis 2 of the surface.
  pure function solid_face(solid, face) result(surface)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: face   !! 1 xi_min, 2 xi_max, 3 eta_min, 4 eta_max, 5 and 6 zeta
    type(nurbs_surface_t) :: surface
    integer :: axis, layer

    axis = (face + 1)/2
    layer = merge(1, solid%axes(axis)%n_basis, mod(face, 2) == 1)
    surface%axes = solid%axes(face_axes(face))
    select case (axis)
    case (1)
      surface%points = solid%points(layer, :, :, :)
      surface%weights = solid%weights(layer, :, :)
    case (2)
      surface%points = solid%points(:, layer, :, :)
      surface%weights = solid%weights(:, layer, :)
    case default
      surface%points = solid%points(:, :, layer, :)
      surface%weights = solid%weights(:, :, layer)
    end select
  end function solid_face

  !> Axes of the solid that run along a face: (2, 3), (1, 3) or (1, 2).
  pure function face_axes(face) result(axes)
    integer, intent(in) :: face   !! 1 xi_min, 2 xi_max, 3 eta_min, 4 eta_max, 5 and 6 zeta
    integer :: axes(2)

    axes = pack([1, 2, 3], [1, 2, 3] /= (face + 1)/2)
  end function face_axes

  !> +1 where axis 1 x axis 2 of `solid_face` points out of a solid with positive jacobian, else -1.
  pure integer function face_side(face)
    integer, intent(in) :: face   !! 1 xi_min, 2 xi_max, 3 eta_min, 4 eta_max, 5 and 6 zeta

    face_side = merge(1, -1, any(face == [2, 3, 6]))
  end function face_side

end module nurbs_solid
