!> Simple shapes as exact NURBS: planes, cylinders, spheres, extrusions, boxes.
!!
!! All parametric coordinates run over [0, 1]. Circles are rational quadratics, one piece for each
!! started quarter turn (L. Piegl and W. Tiller, The NURBS Book, 2nd ed., section 7.3).
module primitives
  use kinds, only: wp
  use linear_algebra, only: cross
  use failure, only: error_t, fail
  use knot_vector, only: knot_vector_t, new_knot_vector, greville, linear_axis
  use nurbs_surface, only: nurbs_surface_t, new_nurbs_surface
  use nurbs_solid, only: nurbs_solid_t, new_nurbs_solid
  use refinement, only: reverse_axis
  implicit none
  private

  public :: plane_surface, cylinder_surface, sphere_surface, extruded_surface, box_solid, &
            arc_t, unit_arc

  !> Rational quadratic on the unit circle.
  type :: arc_t
    type(knot_vector_t) :: axis
    real(wp), allocatable :: points(:, :)   !! shape (n, 2)
    real(wp), allocatable :: weights(:)     !! shape (n)
  end type arc_t

contains

  !> Parallelogram of degree 1: origin + xi*edge1 + eta*edge2, normal edge1 x edge2.
  !!
  !! Rejected: edges without length or along the same line.
  pure subroutine plane_surface(surface, origin, edge1, edge2, error)
    type(nurbs_surface_t), intent(out) :: surface
    real(wp), intent(in) :: origin(3), edge1(3), edge2(3)   !! [length]
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: thinnest = 1.0e-10_wp   ! sine of the angle between the edges
    real(wp) :: points(2, 2, 3), weights(2, 2)

    if (.not. norm2(cross(edge1, edge2)) > thinnest*norm2(edge1)*norm2(edge2)) then
      call fail(error, "plane: the two edges must have length and different directions")
      return
    end if
    points(1, 1, :) = origin
    points(2, 1, :) = origin + edge1
    points(1, 2, :) = origin + edge2
    points(2, 2, :) = origin + edge1 + edge2
    weights = 1.0_wp
    call new_nurbs_surface(surface, linear_axis(), linear_axis(), points, weights, error)
  end subroutine plane_surface

  !> Part of a circular cylinder; xi runs with the angle, eta along the axis, normal outward.
  !!
  !! Angle zero is the direction of x made perpendicular to the axis (of y if the axis is along
  !! x); angles turn right-handed about the axis. Rejected: radius, length or angle not positive,
  !! more than a full turn, axis without direction.
  pure subroutine cylinder_surface(surface, origin, axis, radius, length, start_angle, angle, &
                                   error)
    type(nurbs_surface_t), intent(out) :: surface
    real(wp), intent(in) :: origin(3)     !! point on the axis where the cylinder begins [length]
    real(wp), intent(in) :: axis(3)       !! direction of the axis, of any length
    real(wp), intent(in) :: radius, length                !! [length]
    real(wp), intent(in) :: start_angle, angle            !! [degrees]
    type(error_t), allocatable, intent(out) :: error
    type(arc_t) :: arc
    real(wp) :: frame(3, 3)
    real(wp), allocatable :: points(:, :, :)
    integer :: i

    if (.not. norm2(axis) > 0.0_wp) then
      call fail(error, "cylinder: the axis has no direction")
    else if (.not. (radius > 0.0_wp .and. length > 0.0_wp)) then
      call fail(error, "cylinder: radius and length must be positive")
    else if (.not. (angle > 0.0_wp .and. angle <= 360.0_wp)) then
      call fail(error, "cylinder: the angle must be above 0 and at most 360 degrees")
    else
      arc = unit_arc(start_angle, angle)
      frame = frame_about(axis)
      allocate (points(arc%axis%n_basis, 2, 3))
      do i = 1, arc%axis%n_basis
        points(i, 1, :) = origin + radius*matmul(frame(:, :2), arc%points(i, :))
        points(i, 2, :) = points(i, 1, :) + length*frame(:, 3)
      end do
      call new_nurbs_surface(surface, arc%axis, linear_axis(), points, &
                             spread(arc%weights, 2, 2), error)
    end if
  end subroutine cylinder_surface

  !> Whole sphere; xi is the longitude from x towards y, eta the latitude from -z to z, normal
  !! outward. The poles are single points, where the normal is not defined.
  !!
  !! Rejected: radius not positive.
  pure subroutine sphere_surface(surface, centre, radius, error)
    type(nurbs_surface_t), intent(out) :: surface
    real(wp), intent(in) :: centre(3), radius   !! [length]
    type(error_t), allocatable, intent(out) :: error
    type(arc_t) :: longitude, latitude
    real(wp), allocatable :: points(:, :, :), weights(:, :)
    integer :: j

    if (.not. radius > 0.0_wp) then
      call fail(error, "sphere: the radius must be positive")
      return
    end if
    longitude = unit_arc(0.0_wp, 360.0_wp)
    latitude = unit_arc(-90.0_wp, 180.0_wp)
    allocate (points(longitude%axis%n_basis, latitude%axis%n_basis, 3))
    allocate (weights(longitude%axis%n_basis, latitude%axis%n_basis))
    do j = 1, latitude%axis%n_basis
      points(:, j, 1) = centre(1) + radius*latitude%points(j, 1)*longitude%points(:, 1)
      points(:, j, 2) = centre(2) + radius*latitude%points(j, 1)*longitude%points(:, 2)
      points(:, j, 3) = centre(3) + radius*latitude%points(j, 2)
      weights(:, j) = longitude%weights*latitude%weights(j)
    end do
    call new_nurbs_surface(surface, longitude%axis, latitude%axis, points, weights, error)
  end subroutine sphere_surface

  !> A curve swept along a straight line: axis 1 follows the curve, axis 2 the line, linearly.
  !!
  !! Rejected: fewer rows than degree + 1, a direction without length, and what
  !! `new_knot_vector` and `new_nurbs_surface` reject.
  pure subroutine extruded_surface(surface, curve, points, weights, direction, n_rows, degree, &
                                   error)
    type(nurbs_surface_t), intent(out) :: surface
    type(knot_vector_t), intent(in) :: curve    !! knots of the curve, kept as they are
    real(wp), intent(in) :: points(:, :)        !! control points of the curve [length], (n, 3)
    real(wp), intent(in) :: weights(:)          !! their weights, shape (n)
    real(wp), intent(in) :: direction(3)        !! from the first to the last row [length]
    integer, intent(in) :: n_rows               !! rows of control points along the line
    integer, intent(in) :: degree               !! along the line
    type(error_t), allocatable, intent(out) :: error
    type(knot_vector_t) :: line
    real(wp) :: grid(size(points, 1), n_rows, size(points, 2)), position(n_rows)
    integer :: i, j

    if (.not. norm2(direction) > 0.0_wp) then
      call fail(error, "extrusion: the direction has no length")
      return
    else if (n_rows <= degree) then
      call fail(error, "extrusion: needs at least degree + 1 rows of control points")
      return
    else if (size(points, 2) /= 3) then
      call fail(error, "extrusion: control points need three coordinates")
      return
    end if
    call new_graded_axis(line, degree, n_rows - degree, 1.0_wp, error)
    if (allocated(error)) return
    position = greville(line)
    do j = 1, n_rows
      do i = 1, size(points, 1)
        grid(i, j, :) = points(i, :) + position(j)*direction
      end do
    end do
    call new_nurbs_surface(surface, curve, line, grid, spread(weights, 2, n_rows), error)
  end subroutine extruded_surface

  !> Box patch with an affine map along each axis: control points at the Greville abscissae. With
  !! `has_even_points` they are equally spaced instead; the box stays the same, but the elements at
  !! its ends become longer than the others, and the stable step along the axis larger.
  !!
  !! `axis_of(a)` is the direction (1 x, 2 y, 3 z) along which parametric axis a runs. The patch
  !! is right-handed: if `axis_of` is an odd permutation, axis 2 runs from upper to lower.
  !! Element sizes along an axis (or distances of control points, if these are spaced) form a
  !! geometric series, and `ratios` counts from lower to upper.
  !! Rejected: upper not above lower, degrees outside 1 to 5, counts below 1, ratios not positive,
  !! `axis_of` no permutation.
  pure subroutine box_solid(solid, lower, upper, degrees, n_elements, ratios, axis_of, error, &
                            has_even_points)
    type(nurbs_solid_t), intent(out) :: solid
    real(wp), intent(in) :: lower(3), upper(3)   !! corners along x, y, z [length]
    integer, intent(in) :: degrees(3)            !! along xi, eta, zeta
    integer, intent(in) :: n_elements(3)         !! along xi, eta, zeta
    real(wp), intent(in) :: ratios(3)            !! last to first element along xi, eta, zeta
    integer, intent(in) :: axis_of(3)            !! permutation of 1, 2, 3
    type(error_t), allocatable, intent(out) :: error
    logical, intent(in), optional :: has_even_points   !! equal distances of control points
    type(knot_vector_t) :: axes(3)
    real(wp), allocatable :: points(:, :, :, :), weights(:, :, :)
    integer :: a
    logical :: is_even

    is_even = .false.
    if (present(has_even_points)) is_even = has_even_points
    if (.not. all(upper > lower)) then
      call fail(error, "box: each upper bound must be above the lower bound")
      return
    else if (.not. all([(any(axis_of == a), a=1, 3)])) then
      call fail(error, "box: the axes must be x, y and z in some order")
      return
    end if
    do a = 1, 3
      call new_graded_axis(axes(a), degrees(a), n_elements(a), &
                           merge(1.0_wp, ratios(a), is_even .and. ratios(a) > 0.0_wp), error)
      if (allocated(error)) return
    end do
    allocate (points(axes(1)%n_basis, axes(2)%n_basis, axes(3)%n_basis, 3))
    allocate (weights(axes(1)%n_basis, axes(2)%n_basis, axes(3)%n_basis), source=1.0_wp)
    do a = 1, 3
      associate (c => axis_of(a))
        if (is_even) then
          call lay_along(greville(graded_axis(1, axes(a)%n_basis - 1, ratios(a))), a, lower(c), &
                           upper(c), points(:, :, :, c))
        else
          call lay_along(greville(axes(a)), a, lower(c), upper(c), points(:, :, :, c))
        end if
      end associate
    end do
    call new_nurbs_solid(solid, axes, points, weights, error)
    if (allocated(error)) return
    if (axis_of(2) /= modulo(axis_of(1), 3) + 1) call reverse_axis(solid, 2)
  end subroutine box_solid

  !> Coordinates from `low` to `high` along one axis of a grid, constant along the others.
  pure subroutine lay_along(fractions, axis, low, high, coordinate)
    real(wp), intent(in) :: fractions(:)      !! fractions of the range from `low` to `high`
    integer, intent(in) :: axis
    real(wp), intent(in) :: low, high
    real(wp), intent(out) :: coordinate(:, :, :)
    real(wp) :: position(size(fractions))
    integer :: i

    position = (1.0_wp - fractions)*low + fractions*high
    do i = 1, size(fractions)
      select case (axis)
      case (1)
        coordinate(i, :, :) = position(i)
      case (2)
        coordinate(:, i, :) = position(i)
      case default
        coordinate(:, :, i) = position(i)
      end select
    end do
  end subroutine lay_along

  !> `graded_axis` after checking what is asked for.
  pure subroutine new_graded_axis(axis, degree, n_elements, ratio, error)
    type(knot_vector_t), intent(out) :: axis
    integer, intent(in) :: degree, n_elements
    real(wp), intent(in) :: ratio
    type(error_t), allocatable, intent(out) :: error
    type(knot_vector_t) :: graded

    if (n_elements < 1) then
      call fail(error, "the number of elements must be at least 1")
    else if (.not. (ratio > 0.0_wp .and. ratio <= huge(ratio))) then
      call fail(error, "the ratio of element sizes must be positive")
    else
      ! A degree below 1 has no knots; new_knot_vector checks the degree first and rejects it.
      graded = graded_axis(max(1, degree), n_elements, ratio)
      call new_knot_vector(axis, degree, graded%knots, error)
    end if
  end subroutine new_graded_axis

  !> Open knots over [0, 1] with simple inner knots and spans that form a geometric series.
  pure function graded_axis(degree, n_elements, ratio) result(axis)
    integer, intent(in) :: degree, n_elements
    real(wp), intent(in) :: ratio   !! last span to first span
    type(knot_vector_t) :: axis
    real(wp) :: breaks(0:n_elements)
    integer :: i

    breaks(0) = 0.0_wp
    do i = 1, n_elements
      breaks(i) = breaks(i - 1) + ratio**(real(i - 1, wp)/max(1, n_elements - 1))
    end do
    axis%degree = degree
    axis%n_basis = n_elements + degree
    allocate (axis%knots(n_elements + 2*degree + 1), source=0.0_wp)
    axis%knots(degree + 1:degree + n_elements) = breaks(:n_elements - 1)/breaks(n_elements)
    axis%knots(degree + n_elements + 1:) = 1.0_wp
  end function graded_axis

  !> Unit circle from `start` on, over `angle` degrees, in equal pieces of at most a quarter turn.
  pure function unit_arc(start, angle) result(arc)
    real(wp), intent(in) :: start, angle   !! [degrees], 0 < angle <= 360
    type(arc_t) :: arc
    real(wp), parameter :: degree = acos(-1.0_wp)/180, tiny_angle = 1.0e-9_wp
    real(wp) :: half, at
    integer :: i, n_pieces

    n_pieces = max(1, ceiling(angle/90 - tiny_angle))
    half = angle*degree/(2*n_pieces)
    arc%axis%degree = 2
    arc%axis%n_basis = 2*n_pieces + 1
    allocate (arc%axis%knots(2*n_pieces + 4), source=0.0_wp)
    allocate (arc%points(2*n_pieces + 1, 2), arc%weights(2*n_pieces + 1))
    do i = 1, 2*n_pieces + 1
      at = start*degree + (i - 1)*half
      arc%weights(i) = merge(1.0_wp, cos(half), mod(i, 2) == 1)
      arc%points(i, :) = [cos(at), sin(at)]/arc%weights(i)
      arc%axis%knots(i + 2) = real(i/2, wp)/n_pieces
    end do
    arc%axis%knots(2*n_pieces + 3:) = 1.0_wp
  end function unit_arc

  !> Right-handed unit vectors in columns, the third along `axis`, the first near x.
  pure function frame_about(axis) result(frame)
    real(wp), intent(in) :: axis(3)
    real(wp) :: frame(3, 3)
    real(wp), parameter :: x(3) = [1.0_wp, 0.0_wp, 0.0_wp], y(3) = [0.0_wp, 1.0_wp, 0.0_wp]
    real(wp), parameter :: nearly_parallel = 1.0e-6_wp

    frame(:, 3) = axis/norm2(axis)
    frame(:, 1) = x - frame(1, 3)*frame(:, 3)
    if (norm2(frame(:, 1)) < nearly_parallel) frame(:, 1) = y - frame(2, 3)*frame(:, 3)
    frame(:, 1) = frame(:, 1)/norm2(frame(:, 1))
    frame(:, 2) = cross(frame(:, 3), frame(:, 1))
  end function frame_about

end module primitives
