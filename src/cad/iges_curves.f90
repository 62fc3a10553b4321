!> Curves of an IGES file as rational B-splines: line (110), circular arc (100), rational B-spline
!! curve (126) and composite curve (102) of these.
module iges_curves
  use kinds, only: wp
  use failure, only: error_t, fail
  use input_errors, only: error_list_t, add_error
  use text, only: to_text
  use knot_vector, only: knot_vector_t, new_knot_vector, max_degree
  use knot_range, only: cut_to_range
  use primitives, only: arc_t, unit_arc
  use nurbs_curve, only: nurbs_curve_t, join_curves
  use iges_directory, only: entry_name
  use iges_matrix, only: get_matrix, moved
  use iges_model, only: iges_model_t, values_t, open_values, get_integer, get_real, get_reals, &
                        get_entry, entry_origin, refuse
  implicit none
  private

  public :: read_curve

  real(wp), parameter, public :: turn = 2*acos(-1.0_wp)   !! a full turn [radians]

contains

  !> Read a curve that another entity names, in the unit of the file.
  subroutine read_curve(model, entry, curve, is_valid, errors)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    type(nurbs_curve_t), intent(out) :: curve
    logical, intent(out) :: is_valid
    type(error_list_t), intent(inout) :: errors
    type(nurbs_curve_t), allocatable :: parts(:)
    type(values_t) :: values
    type(error_t), allocatable :: error
    real(wp) :: matrix(3, 4)
    integer :: i, n, part

    if (model%entries(entry)%type /= 102) then
      call read_plain_curve(model, entry, curve, is_valid, errors)
      return
    end if
    call open_values(model, entry, values, errors)
    n = get_integer(model, values, 1, "the number of curves", 1, max(1, values%n - 1), errors)
    is_valid = values%is_valid
    if (.not. is_valid) return
    allocate (parts(n))
    do i = 1, n
      part = get_entry(model, values, 1 + i, "a curve", errors)
      is_valid = values%is_valid
      if (is_valid) call read_plain_curve(model, part, parts(i), is_valid, errors)
      if (.not. is_valid) return
    end do
    call join_curves(parts, curve, error)
    call note(model, entry, error, is_valid, errors)
    if (is_valid) call get_matrix(model, entry, matrix, is_valid, errors)
    if (is_valid .and. model%entries(entry)%matrix /= 0) curve%points = moved(matrix, curve%points)
  end subroutine read_curve

  !> A curve that is not made of others.
  subroutine read_plain_curve(model, entry, curve, is_valid, errors)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    type(nurbs_curve_t), intent(out) :: curve
    logical, intent(out) :: is_valid
    type(error_list_t), intent(inout) :: errors
    type(values_t) :: values
    real(wp) :: matrix(3, 4)

    is_valid = any(model%entries(entry)%type == [100, 110, 126])
    if (.not. is_valid) then
      call add_error(errors, entry_origin(model, entry), "an entity that is no curve this "// &
                     "program reads, where one is named", "a line (110), circular arc (100), "// &
                     "rational B-spline curve (126) or composite curve (102) of these")
      return
    end if
    call open_values(model, entry, values, errors)
    is_valid = values%is_valid
    if (.not. is_valid) return
    select case (model%entries(entry)%type)
    case (100); call read_arc(model, values, curve, errors)
    case (110); call read_line(model, values, curve, errors)
    case default; call read_spline(model, values, curve, errors)
    end select
    is_valid = values%is_valid
    if (is_valid) call get_matrix(model, entry, matrix, is_valid, errors)
    if (is_valid .and. model%entries(entry)%matrix /= 0) curve%points = moved(matrix, curve%points)
  end subroutine read_plain_curve

  subroutine read_line(model, values, curve, errors)
    type(iges_model_t), intent(in) :: model
    type(values_t), intent(inout) :: values
    type(nurbs_curve_t), intent(out) :: curve
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    real(wp) :: ends(6)

    ends = get_reals(model, values, 1, 6, "a coordinate", errors)
    if (.not. values%is_valid) return
    if (.not. norm2(ends(4:) - ends(:3)) > 0.0_wp) then
      call refuse(model, values, 1, "a line without length", "two different ends", errors)
      return
    end if
    call new_knot_vector(curve%axis, 1, [0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp], error)
    curve%points = transpose(reshape(ends, [3, 2]))
    curve%weights = [1.0_wp, 1.0_wp]
  end subroutine read_line

  !> An arc in a plane of constant z, from its start counterclockwise to its end; all of the circle
  !! if both are one.
  subroutine read_arc(model, values, curve, errors)
    type(iges_model_t), intent(in) :: model
    type(values_t), intent(inout) :: values
    type(nurbs_curve_t), intent(out) :: curve
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: degrees = 360/turn, loosest = 1.0e-3_wp
    type(arc_t) :: arc
    real(wp) :: given(7), start(2), end(2), angles(2), radius
    integer :: n

    given = get_reals(model, values, 1, 7, "a coordinate", errors)
    if (.not. values%is_valid) return
    start = given(4:5) - given(2:3)
    end = given(6:7) - given(2:3)
    radius = norm2(start)
    if (.not. (radius > 0.0_wp .and. radius <= huge(radius) &
               .and. abs(norm2(end) - radius) <= loosest*radius)) then
      call refuse(model, values, 1, "an arc whose ends are "//to_text(radius)//" and "// &
                  to_text(norm2(end))//" from its centre", "two equal distances above 0", errors)
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

  subroutine read_spline(model, values, curve, errors)
    type(iges_model_t), intent(in) :: model
    type(values_t), intent(inout) :: values
    type(nurbs_curve_t), intent(out) :: curve
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    real(wp), allocatable :: knots(:), weights(:), points(:, :)
    real(wp) :: range(2)
    integer :: k, m, at

    k = get_integer(model, values, 1, "K, the upper index", 1, max(1, values%n), errors)
    m = get_integer(model, values, 2, "M, the degree", 1, max_degree, errors)
    if (.not. values%is_valid) return
    if (6 + (k + m + 2) + 4*(k + 1) > values%n) then
      call refuse(model, values, 1, to_text(values%n)//" parameters", "at least "// &
                  to_text(6 + (k + m + 2) + 4*(k + 1))//" for K = "//to_text(k)//" and M = "// &
                  to_text(m), errors)
      return
    end if
    knots = get_reals(model, values, 7, k + m + 2, "a knot", errors)
    at = 7 + k + m + 2
    weights = get_reals(model, values, at, k + 1, "a weight", errors)
    at = at + k + 1
    points = transpose(reshape(get_reals(model, values, at, 3*(k + 1), "a coordinate", errors), &
                               [3, k + 1]))
    at = at + 3*(k + 1)
    range = get_reals(model, values, at, 2, "the range", errors)
    if (.not. values%is_valid) return
    if (.not. all(weights > 0.0_wp)) then
      call refuse(model, values, 1, "a weight that is not positive", "weights above 0", errors)
      return
    end if
    call make_spline(m, knots, range, points, weights, curve, error)
    if (allocated(error)) call refuse(model, values, 1, "a curve that cannot be made ("// &
                                      error%message//")", "a proper curve", errors)
  end subroutine read_spline

  subroutine make_spline(degree, knots, range, points, weights, curve, error)
    integer, intent(in) :: degree
    real(wp), intent(in) :: knots(:), range(2), points(:, :), weights(:)
    type(nurbs_curve_t), intent(out) :: curve
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: rows(:, :)
    real(wp) :: ends(2)
    integer :: n, c
    logical :: is_same

    n = size(weights)
    ends = range
    if (.not. ends(1) < ends(2)) ends = [knots(degree + 1), knots(n + 1)]
    allocate (rows(n, 4))
    do c = 1, 3
      rows(:, c) = weights*points(:, c)
    end do
    rows(:, 4) = weights
    call cut_to_range(curve%axis, degree, knots, ends(1), ends(2), rows, is_same, error)
    if (allocated(error)) return
    if (is_same) then
      curve%points = points      ! as given, bit for bit
      curve%weights = weights
    else
      curve%weights = rows(:, 4)
      curve%points = rows(:, :3)/spread(rows(:, 4), 2, 3)
    end if
  end subroutine make_spline

  subroutine note(model, entry, error, is_valid, errors)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    type(error_t), allocatable, intent(in) :: error
    logical, intent(inout) :: is_valid
    type(error_list_t), intent(inout) :: errors

    if (.not. allocated(error)) return
    is_valid = .false.
    call add_error(errors, entry_origin(model, entry), error%message, "a proper curve")
  end subroutine note

end module iges_curves
