!> Surfaces of an IGES file: rational B-spline surface (128), surface of revolution (120) and
!! tabulated cylinder (122). And their curves as rational B-splines: line (110), circular arc (100),
!! rational B-spline curve (126) and composite curve (102) of these.
module iges_surfaces
  use kinds, only: wp
  use failure, only: error_t, fail
  use linear_algebra, only: cross
  use text, only: to_text, rounded_text, place_text, counted
  use knot_vector, only: max_degree, linear_axis, cut_to_range
  use nurbs_curve, only: nurbs_curve_t, join_curves
  use nurbs_surface, only: nurbs_surface_t, new_nurbs_surface, has_area
  use primitives, only: arc_t, unit_arc, extruded_surface
  use iges_model, only: iges_model_t, values_t, open_values, get_integer, get_reals, get_entry, &
                        reject, reject_entity, transform
  implicit none
  private

  public :: read_surface, read_curve

  real(wp), parameter :: turn = 2*acos(-1.0_wp)   !! a full turn [radians]

  real(wp), parameter :: farthest = 1.0e15_wp       ! coordinate that can be reckoned with
  real(wp), parameter :: most_uneven = 1.0e12_wp    ! ratio of weights, likewise

contains

  !> Read a surface of type 120, 122 or 128 in the unit of the file, transformed as it asks. It is
  !! of use only if the model is valid afterwards.
  subroutine read_surface(model, entry, surface)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry
    type(nurbs_surface_t), intent(out) :: surface
    type(values_t) :: values
    type(error_t), allocatable :: error
    real(wp), allocatable :: points(:, :)

    model%is_valid = .true.
    call open_values(model, entry, values)
    if (.not. model%is_valid) return
    select case (model%entries(entry)%type)
    case (120); call read_revolution(model, values, surface, error)
    case (122); call read_cylinder(model, values, surface, error)
    case default; call read_spline(model, values, surface, error)
    end select
    if (model%is_valid .and. .not. allocated(error)) then
      points = reshape(surface%points, [size(surface%weights), 3])
      call transform(model, entry, points)
      surface%points = reshape(points, shape(surface%points))
      if (.not. model%is_valid) return
      if (.not. all(abs(surface%points) <= farthest)) then
        call fail(error, "surface: a coordinate beyond "//to_text(farthest))
      else if (.not. maxval(surface%weights) <= most_uneven*minval(surface%weights)) then
        call fail(error, "surface: weights of which one is "//to_text(most_uneven)// &
                  " times another")
      else if (.not. has_area(surface)) then
        call fail(error, "surface: without area, "//rounded_text(length_of(surface))// &
                  " long, at "//place_text(surface%points(1, 1, :)))
      end if
    end if
    if (allocated(error)) call reject_entity(model, entry, "an invalid surface ("// &
                                             error%message//")", "a proper surface")
  end subroutine read_surface

  !> Of the box around the control points, across.
  pure real(wp) function length_of(surface) result(length)
    type(nurbs_surface_t), intent(in) :: surface
    integer :: c

    length = norm2([(maxval(surface%points(:, :, c)) - minval(surface%points(:, :, c)), c=1, 3)])
  end function length_of

  subroutine read_spline(model, values, surface, error)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    type(nurbs_surface_t), intent(out) :: surface
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: rows(:, :, :), knots1(:), knots2(:)
    real(wp) :: range(4)
    integer :: degree(2), n(2), at

    call read_sizes(model, values, n, degree)
    if (.not. model%is_valid) return
    knots1 = get_reals(model, values, 10, n(1) + degree(1) + 1, "a knot of the first axis")
    at = 10 + n(1) + degree(1) + 1
    knots2 = get_reals(model, values, at, n(2) + degree(2) + 1, "a knot of the second axis")
    at = at + n(2) + degree(2) + 1
    allocate (rows(n(1), n(2), 4))
    rows(:, :, 4) = reshape(get_reals(model, values, at, n(1)*n(2), "a weight"), n)
    at = at + n(1)*n(2)
    rows(:, :, :3) = reshape(get_reals(model, values, at, 3*n(1)*n(2), "a coordinate"), &
                             [n(1), n(2), 3], order=[3, 1, 2])
    at = at + 3*n(1)*n(2)
    range = get_reals(model, values, at, 4, "the range")
    if (.not. model%is_valid) return
    if (.not. all(rows(:, :, 4) > 0.0_wp)) then
      call fail(error, "surface: weights must be positive")
      return
    end if
    if (.not. range(1) < range(2)) range(:2) = [knots1(degree(1) + 1), knots1(n(1) + 1)]
    if (.not. range(3) < range(4)) range(3:) = [knots2(degree(2) + 1), knots2(n(2) + 1)]
    surface%points = rows(:, :, :3)
    surface%weights = rows(:, :, 4)
    rows(:, :, :3) = rows(:, :, :3)*spread(rows(:, :, 4), 3, 3)
    call cut_axes(surface, degree, knots1, knots2, range, rows, error)
  end subroutine read_spline

  !> Counts and degrees; the values that they ask for must be there.
  subroutine read_sizes(model, values, n, degree)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    integer, intent(out) :: n(2), degree(2)
    integer :: i
    real(wp) :: n_needed

    do i = 1, 2
      n(i) = 1 + get_integer(model, values, i, "K"//to_text(i)//", an upper index", 1, &
                             max(1, values%n))
      degree(i) = get_integer(model, values, 2 + i, "M"//to_text(i)//", a degree", 1, &
                              max_degree)
    end do
    if (.not. model%is_valid) return
    ! As a real number, for what a damaged file asks for may be more than an integer holds.
    n_needed = 9 + sum(real(n + degree + 1, wp)) + 4*product(real(n, wp))
    if (n_needed <= values%n) return
    call reject(model, values, 1, counted(values%n, "parameter"), "at least "// &
                to_text(n_needed)//" for "//to_text(n(1))//" x "//to_text(n(2))// &
                " control points")
  end subroutine read_sizes

  !> Bring both axes to open knots over the range; what is there already stays bit for bit.
  subroutine cut_axes(surface, degree, knots1, knots2, range, rows, error)
    type(nurbs_surface_t), intent(inout) :: surface
    integer, intent(in) :: degree(2)
    real(wp), intent(in) :: knots1(:), knots2(:), range(4)
    real(wp), intent(in) :: rows(:, :, :)    !! control points times weights, and weights
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: columns(:, :), grid(:, :, :)
    logical :: is_same(2)
    integer :: n(2)

    n = [size(rows, 1), size(rows, 2)]
    columns = reshape(rows, [n(1), 4*n(2)])
    call cut_to_range(surface%axes(1), degree(1), knots1, range(1), range(2), columns, &
                      is_same(1), error)
    if (allocated(error)) return
    n(1) = size(columns, 1)
    grid = reshape(columns, [n(2), n(1), 4], order=[2, 1, 3])
    columns = reshape(grid, [n(2), 4*n(1)])
    call cut_to_range(surface%axes(2), degree(2), knots2, range(3), range(4), columns, &
                      is_same(2), error)
    if (allocated(error) .or. all(is_same)) return
    n(2) = size(columns, 1)
    grid = reshape(columns, [n(1), n(2), 4], order=[2, 1, 3])
    surface%weights = grid(:, :, 4)
    surface%points = grid(:, :, :3)/spread(grid(:, :, 4), 3, 3)
  end subroutine cut_axes

  !> A curve turned about a line, from the start angle to the end angle, right-handed about the
  !! line: axis 1 follows the curve, axis 2 the angle.
  subroutine read_revolution(model, values, surface, error)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    type(nurbs_surface_t), intent(out) :: surface
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: degrees = 360/turn
    type(nurbs_curve_t) :: line, curve
    real(wp) :: angles(2), angle
    integer :: axis, generatrix

    axis = get_entry(model, values, 1, "the axis")
    generatrix = get_entry(model, values, 2, "the generatrix")
    angles = get_reals(model, values, 3, 2, "an angle")
    if (.not. model%is_valid) return
    if (model%entries(axis)%type /= 110) then
      call reject(model, values, 1, "entity "//to_text(model%entries(axis)%type)// &
                  " as the axis", "a line (110)")
      return
    end if
    angle = angles(2) - angles(1)
    if (.not. (angle > 0.0_wp .and. angle <= turn*(1.0_wp + 1.0e-9_wp))) then
      call reject(model, values, 3, "angles from "//to_text(angles(1))//" to "// &
                  to_text(angles(2)), "a rising pair, at most a full turn apart")
      return
    end if
    call read_curve(model, axis, line)
    if (model%is_valid) call read_curve(model, generatrix, curve)
    if (.not. model%is_valid) return
    ! Full turns written with few digits are full turns.
    if (angle > turn*(1.0_wp - 1.0e-9_wp)) angle = turn
    call revolve(line, curve, unit_arc(angles(1)*degrees, angle*degrees), surface, error)
  end subroutine read_revolution

  subroutine revolve(line, curve, arc, surface, error)
    type(nurbs_curve_t), intent(in) :: line, curve
    type(arc_t), intent(in) :: arc
    type(nurbs_surface_t), intent(out) :: surface
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: points(:, :, :), weights(:, :)
    real(wp) :: axis(3), foot(3), radius(3), across(3)
    integer :: i, j, n(2)

    n = [size(curve%weights), size(arc%weights)]
    allocate (points(n(1), n(2), 3), weights(n(1), n(2)))
    axis = line%points(2, :) - line%points(1, :)
    axis = axis/norm2(axis)
    do i = 1, n(1)
      radius = curve%points(i, :) - line%points(1, :)
      foot = line%points(1, :) + dot_product(radius, axis)*axis
      radius = radius - dot_product(radius, axis)*axis
      across = cross(axis, radius)
      do j = 1, n(2)
        points(i, j, :) = foot + arc%points(j, 1)*radius + arc%points(j, 2)*across
        weights(i, j) = curve%weights(i)*arc%weights(j)
      end do
    end do
    call new_nurbs_surface(surface, curve%axis, arc%axis, points, weights, error)
  end subroutine revolve

  !> A curve drawn along a line from its first point to the point given.
  subroutine read_cylinder(model, values, surface, error)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    type(nurbs_surface_t), intent(out) :: surface
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_curve_t) :: curve
    real(wp) :: end(3)
    integer :: directrix

    directrix = get_entry(model, values, 1, "the directrix")
    end = get_reals(model, values, 2, 3, "a coordinate")
    if (model%is_valid) call read_curve(model, directrix, curve)
    if (.not. model%is_valid) return
    call extruded_surface(surface, curve%axis, curve%points, curve%weights, &
                          end - curve%points(1, :), 2, 1, error)
  end subroutine read_cylinder

  !> Read a curve that another entity names, in the unit of the file.
  subroutine read_curve(model, entry, curve)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry
    type(nurbs_curve_t), intent(out) :: curve
    type(nurbs_curve_t), allocatable :: parts(:)
    type(values_t) :: values
    type(error_t), allocatable :: error
    integer :: i, n, part

    if (model%entries(entry)%type /= 102) then
      call read_plain_curve(model, entry, curve)
      return
    end if
    call open_values(model, entry, values)
    n = get_integer(model, values, 1, "the number of curves", 1, max(1, values%n - 1))
    if (.not. model%is_valid) return
    allocate (parts(n))
    do i = 1, n
      part = get_entry(model, values, 1 + i, "a curve")
      if (model%is_valid) call read_plain_curve(model, part, parts(i))
      if (.not. model%is_valid) return
    end do
    call join_curves(parts, curve, error)
    if (allocated(error)) then
      call reject_entity(model, entry, error%message, "a proper curve")
    else
      call transform(model, entry, curve%points)
    end if
  end subroutine read_curve

  !> A curve that is not made of others.
  subroutine read_plain_curve(model, entry, curve)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry
    type(nurbs_curve_t), intent(out) :: curve
    type(values_t) :: values

    if (all(model%entries(entry)%type /= [100, 110, 126])) then
      call reject_entity(model, entry, "an entity that is no curve this program reads, where "// &
                         "one is named", "a line (110), circular arc (100), rational B-spline "// &
                         "curve (126) or composite curve (102) of these")
      return
    end if
    call open_values(model, entry, values)
    if (.not. model%is_valid) return
    select case (model%entries(entry)%type)
    case (100); call read_arc(model, values, curve)
    case (110); call read_line(model, values, curve)
    case default; call read_curve_spline(model, values, curve)
    end select
    if (model%is_valid) call transform(model, entry, curve%points)
  end subroutine read_plain_curve

  subroutine read_line(model, values, curve)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    type(nurbs_curve_t), intent(out) :: curve
    real(wp) :: ends(6)

    ends = get_reals(model, values, 1, 6, "a coordinate")
    if (.not. model%is_valid) return
    if (.not. norm2(ends(4:) - ends(:3)) > 0.0_wp) then
      call reject(model, values, 1, "a line without length", "two different ends")
      return
    end if
    curve%axis = linear_axis()
    curve%points = transpose(reshape(ends, [3, 2]))
    curve%weights = [1.0_wp, 1.0_wp]
  end subroutine read_line

  !> An arc in a plane of constant z, from its start counterclockwise to its end; all of the circle
  !! if both are one.
  subroutine read_arc(model, values, curve)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    type(nurbs_curve_t), intent(out) :: curve
    real(wp), parameter :: degrees = 360/turn, loosest = 1.0e-3_wp
    type(arc_t) :: arc
    real(wp) :: given(7), start(2), end(2), angles(2), radius
    integer :: n

    given = get_reals(model, values, 1, 7, "a coordinate")
    if (.not. model%is_valid) return
    start = given(4:5) - given(2:3)
    end = given(6:7) - given(2:3)
    radius = norm2(start)
    if (.not. (radius > 0.0_wp .and. radius <= huge(radius) &
               .and. abs(norm2(end) - radius) <= loosest*radius)) then
      call reject(model, values, 1, "an arc whose ends are "//to_text(radius)//" and "// &
                  to_text(norm2(end))//" from its centre", "two equal distances above 0")
      return
    end if
    angles = [atan2(start(2), start(1)), atan2(end(2), end(1))]
    angles(2) = angles(2) - angles(1)
    if (norm2(start - end) <= 1.0e-12_wp*radius) then
      angles(2) = turn
    else if (angles(2) <= 0.0_wp) then
      angles(2) = angles(2) + turn
    end if
    arc = unit_arc(angles(1)*degrees, min(angles(2)*degrees, 360.0_wp))
    n = size(arc%weights)
    curve%axis = arc%axis
    curve%weights = arc%weights
    allocate (curve%points(n, 3))
    curve%points(:, 1) = given(2) + radius*arc%points(:, 1)
    curve%points(:, 2) = given(3) + radius*arc%points(:, 2)
    curve%points(:, 3) = given(1)
    curve%points(1, :2) = given(4:5)
    if (angles(2) < turn) curve%points(n, :2) = given(6:7)
    if (angles(2) >= turn) curve%points(n, :2) = given(4:5)
  end subroutine read_arc

  subroutine read_curve_spline(model, values, curve)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    type(nurbs_curve_t), intent(out) :: curve
    type(error_t), allocatable :: error
    real(wp), allocatable :: knots(:), rows(:, :)
    real(wp) :: range(2)
    integer :: k, m, at, c
    logical :: is_same

    k = get_integer(model, values, 1, "K, the upper index", 1, max(1, values%n))
    m = get_integer(model, values, 2, "M, the degree", 1, max_degree)
    if (.not. model%is_valid) return
    if (6 + (k + m + 2) + 4*(k + 1) > values%n) then
      call reject(model, values, 1, counted(values%n, "parameter"), "at least "// &
                  to_text(6 + (k + m + 2) + 4*(k + 1))//" for K = "//to_text(k)//" and M = "// &
                  to_text(m))
      return
    end if
    knots = get_reals(model, values, 7, k + m + 2, "a knot")
    at = 7 + k + m + 2
    curve%weights = get_reals(model, values, at, k + 1, "a weight")
    at = at + k + 1
    curve%points = transpose(reshape(get_reals(model, values, at, 3*(k + 1), "a coordinate"), &
                                     [3, k + 1]))
    range = get_reals(model, values, at + 3*(k + 1), 2, "the range")
    if (.not. model%is_valid) return
    if (.not. all(curve%weights > 0.0_wp)) then
      call reject(model, values, 1, "a weight that is not positive", "weights above 0")
      return
    end if
    if (.not. range(1) < range(2)) range = [knots(m + 1), knots(k + 2)]
    rows = reshape([(curve%weights*curve%points(:, c), c=1, 3), curve%weights], [k + 1, 4])
    call cut_to_range(curve%axis, m, knots, range(1), range(2), rows, is_same, error)
    if (allocated(error)) then
      call reject(model, values, 1, "an invalid curve ("//error%message//")", "a proper curve")
    else if (.not. is_same) then   ! else they stay as given, bit for bit
      curve%weights = rows(:, 4)
      curve%points = rows(:, :3)/spread(rows(:, 4), 2, 3)
    end if
  end subroutine read_curve_spline

end module iges_surfaces
