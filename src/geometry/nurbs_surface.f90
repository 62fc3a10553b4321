!> Rational B-spline surfaces: tools, faces of the blank.
!!
!! [CA] R. P. R. Cardoso and O. B. Adetoro (2017), eq. (7) and appendix 1.
module nurbs_surface
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use failure, only: error_t, fail
  use knot_vector, only: knot_vector_t, find_span, basis_derivatives
  use trim_curve, only: trim_loop_t
  implicit none
  private

  public :: nurbs_surface_t, new_nurbs_surface, evaluate_surface, has_area

  !> Surface on a tensor grid of control points; points are not pre-multiplied by weights.
  type :: nurbs_surface_t
    type(knot_vector_t) :: axes(2)               !! knot vectors of xi and eta
    real(wp), allocatable :: points(:, :, :)     !! control points [length], shape (n1, n2, 3)
    real(wp), allocatable :: weights(:, :)       !! positive, shape (n1, n2)
    type(trim_loop_t), allocatable :: loops(:)   !! around the part that counts; absent: all of it
  end type nurbs_surface_t

contains

  !> Put a surface together after checking that its parts fit.
  !!
  !! Rejected: grids of the wrong shape, coordinates that are not finite, weights that are not
  !! finite and positive.
  pure subroutine new_nurbs_surface(surface, axis1, axis2, points, weights, error)
    type(nurbs_surface_t), intent(out) :: surface
    type(knot_vector_t), intent(in) :: axis1, axis2   !! knot vectors of xi and eta
    real(wp), intent(in) :: points(:, :, :)           !! control points [length], (n1, n2, 3)
    real(wp), intent(in) :: weights(:, :)             !! shape (n1, n2)
    type(error_t), allocatable, intent(out) :: error

    if (any(shape(points) /= [axis1%n_basis, axis2%n_basis, 3])) then
      call fail(error, "surface: the knot vectors do not fit the grid of control points")
    else if (any(shape(weights) /= [axis1%n_basis, axis2%n_basis])) then
      call fail(error, "surface: there must be one weight for each control point")
    else if (.not. all(ieee_is_finite(points))) then
      call fail(error, "surface: control points must be finite numbers")
    else if (.not. all(ieee_is_finite(weights))) then
      call fail(error, "surface: weights must be finite numbers")
    else if (any(weights <= 0.0_wp)) then
      call fail(error, "surface: weights must be positive")
    else
      surface%axes = [axis1, axis2]
      surface%points = points
      surface%weights = weights
    end if
  end subroutine new_nurbs_surface

  !> Point of the surface and its derivatives by the parametric coordinates, [CA] eq. (7), (A1);
  !! second derivatives by repeated use of the quotient rule (The NURBS Book, A4.4).
  !!
  !! Outside the range of the knots the polynomials of the nearest span continue.
  pure subroutine evaluate_surface(surface, xi, point, d1, d2)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: xi(2)                !! parametric coordinates
    real(wp), intent(out) :: point(3)            !! [length]
    real(wp), intent(out), optional :: d1(3, 2)  !! first derivatives by xi and eta
    real(wp), intent(out), optional :: d2(3, 3)  !! second derivatives: xi xi, eta eta, xi eta
    real(wp) :: h(4, 0:2, 0:2), w(0:2, 0:2), s1(3, 2)
    integer :: order

    order = 0
    if (present(d1)) order = 1
    if (present(d2)) order = 2
    call homogeneous_derivatives(surface, xi, order, h)
    w = h(4, :, :)
    point = h(:3, 0, 0)/w(0, 0)
    if (order == 0) return
    s1(:, 1) = (h(:3, 1, 0) - w(1, 0)*point)/w(0, 0)
    s1(:, 2) = (h(:3, 0, 1) - w(0, 1)*point)/w(0, 0)
    if (present(d1)) d1 = s1
    if (order == 1) return
    d2(:, 1) = (h(:3, 2, 0) - 2*w(1, 0)*s1(:, 1) - w(2, 0)*point)/w(0, 0)
    d2(:, 2) = (h(:3, 0, 2) - 2*w(0, 1)*s1(:, 2) - w(0, 2)*point)/w(0, 0)
    d2(:, 3) = (h(:3, 1, 1) - w(1, 0)*s1(:, 2) - w(0, 1)*s1(:, 1) - w(1, 1)*point)/w(0, 0)
  end subroutine evaluate_surface

  !> Do the control points span more than a point or a line, beyond round-off? A surface whose
  !! points do not has no area.
  pure logical function has_area(surface)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), parameter :: round_off = 1.0e-12_wp    ! of the coordinates, of the length of a line
    real(wp) :: from(3), along(3), nothing
    integer :: far(2), i, j

    associate (x => surface%points)
      from = x(1, 1, :)
      far = maxloc(sum((x - spread(spread(from, 1, size(x, 2)), 1, size(x, 1)))**2, 3))
      along = x(far(1), far(2), :) - from
      nothing = round_off*max(maxval(abs(x)), norm2(along))
      has_area = .false.
      if (.not. norm2(along) > nothing) return
      along = along/norm2(along)
      do j = 1, size(x, 2)
        do i = 1, size(x, 1)
          associate (d => x(i, j, :) - from)
            has_area = has_area .or. norm2(d - dot_product(d, along)*along) > nothing
          end associate
        end do
      end do
    end associate
  end function has_area

  !> Derivatives of (w x, w y, w z, w): `h(:, a, b)` is the a-th by xi and b-th by eta,
  !! a + b <= order.
  pure subroutine homogeneous_derivatives(surface, xi, order, h)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: xi(2)
    integer, intent(in) :: order
    real(wp), intent(out) :: h(4, 0:2, 0:2)
    real(wp) :: basis1(surface%axes(1)%degree + 1, 0:order)
    real(wp) :: basis2(surface%axes(2)%degree + 1, 0:order), row(4, 0:2), weighted
    integer :: i, j, a, b, first(2), span

    span = find_span(surface%axes(1), xi(1))
    first(1) = span - surface%axes(1)%degree - 1
    call basis_derivatives(surface%axes(1), span, xi(1), order, basis1)
    span = find_span(surface%axes(2), xi(2))
    first(2) = span - surface%axes(2)%degree - 1
    call basis_derivatives(surface%axes(2), span, xi(2), order, basis2)
    h = 0.0_wp
    do j = 1, size(basis2, 1)
      row = 0.0_wp
      do i = 1, size(basis1, 1)
        do a = 0, order
          weighted = basis1(i, a)*surface%weights(first(1) + i, first(2) + j)
          row(:3, a) = row(:3, a) + weighted*surface%points(first(1) + i, first(2) + j, :)
          row(4, a) = row(4, a) + weighted
        end do
      end do
      do b = 0, order
        h(:, :order - b, b) = h(:, :order - b, b) + basis2(j, b)*row(:, :order - b)
      end do
    end do
  end subroutine homogeneous_derivatives

end module nurbs_surface
