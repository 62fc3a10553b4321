!> Refinement that leaves the shape as it is: knot insertion and degree elevation along one axis.
!!
!! Both work on the grid of control points as a stack of curves in homogeneous coordinates
!! (w x, w y, w z, w). A surface is refined as a solid of one layer.
!! L. Piegl and W. Tiller, The NURBS Book, 2nd ed., Springer 1997, chapter 5; blossoms after
!! L. Ramshaw, Blossoms are polar forms, Computer Aided Geometric Design 6 (1989) 323-358.
module refinement
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use knot_vector, only: knot_vector_t, find_span, n_spans, span_table, max_degree, insert_knot
  use nurbs_surface, only: nurbs_surface_t
  use trim_curve, only: reverse_loop
  use nurbs_solid, only: nurbs_solid_t, solid_face
  implicit none
  private

  public :: insert_knots, elevate_degree, reverse_axis, dividing_knots

  !> Insert knots along one axis of a surface or a solid; the shape stays the same.
  !!
  !! `call insert_knots(patch, axis, new_knots, error)`: `new_knots(:)` in any order, a value as
  !! often as it is to be inserted. A value within 1e-12 of the range from an old knot is taken
  !! for that knot. Rejected, with the patch left as it was: knots outside the open range of the
  !! axis, knots that would be repeated more often than the degree.
  interface insert_knots
    module procedure :: insert_into_surface, insert_into_solid
  end interface insert_knots

  !> Raise the degree along one axis of a surface or a solid; the shape stays the same.
  !!
  !! `call elevate_degree(patch, axis, times, error)`: the degree and the multiplicity of every
  !! knot rise by `times`, so that the continuity stays too. Rejected, with the patch left as it
  !! was: degrees above 5, negative `times`.
  interface elevate_degree
    module procedure :: elevate_surface, elevate_solid
  end interface elevate_degree

  !> Let one axis of a surface or a solid run in the opposite direction, over the same range of
  !! knots.
  !!
  !! `call reverse_axis(patch, axis)`; the normal of a surface and the sign of the jacobian change.
  interface reverse_axis
    module procedure :: reverse_surface, reverse_solid
  end interface reverse_axis

  !> Curves side by side that share one knot vector.
  type :: curves_t
    type(knot_vector_t) :: axis
    real(wp), allocatable :: points(:, :)   !! control point of a curve, coordinate of a curve
  end type curves_t

  real(wp), parameter :: same_knot = 1.0e-12_wp   !! part of the range below which knots are one

contains

  pure subroutine insert_into_surface(surface, axis, new_knots, error)
    type(nurbs_surface_t), intent(inout) :: surface
    integer, intent(in) :: axis   !! 1 or 2
    real(wp), intent(in) :: new_knots(:)
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_solid_t) :: layer

    layer = layer_of(surface)
    call insert_into_solid(layer, axis, new_knots, error)
    if (.not. allocated(error)) call take_layer(layer, surface)
  end subroutine insert_into_surface

  pure subroutine insert_into_solid(solid, axis, new_knots, error)
    type(nurbs_solid_t), intent(inout) :: solid
    integer, intent(in) :: axis   !! 1, 2 or 3
    real(wp), intent(in) :: new_knots(:)
    type(error_t), allocatable, intent(out) :: error
    type(curves_t) :: curves
    integer :: i

    curves = solid_curves(solid, axis)
    do i = 1, size(new_knots)
      call insert_one_knot(curves, new_knots(i), error)
      if (allocated(error)) return
    end do
    call put_into_solid(curves, axis, solid)
  end subroutine insert_into_solid

  subroutine elevate_surface(surface, axis, times, error)
    type(nurbs_surface_t), intent(inout) :: surface
    integer, intent(in) :: axis   !! 1 or 2
    integer, intent(in) :: times
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_solid_t) :: layer

    layer = layer_of(surface)
    call elevate_solid(layer, axis, times, error)
    if (.not. allocated(error)) call take_layer(layer, surface)
  end subroutine elevate_surface

  subroutine elevate_solid(solid, axis, times, error)
    type(nurbs_solid_t), intent(inout) :: solid
    integer, intent(in) :: axis   !! 1, 2 or 3
    integer, intent(in) :: times
    type(error_t), allocatable, intent(out) :: error
    type(curves_t) :: curves
    integer :: i

    if (times < 0) then
      call fail(error, "degree elevation: the degree cannot be lowered")
    else if (solid%axes(axis)%degree + times > max_degree) then
      call fail(error, "degree elevation: the degree would be above 5")
    else
      curves = solid_curves(solid, axis)
      do i = 1, times
        call elevate_once(curves)
      end do
      call put_into_solid(curves, axis, solid)
    end if
  end subroutine elevate_solid

  pure subroutine reverse_surface(surface, axis)
    type(nurbs_surface_t), intent(inout) :: surface
    integer, intent(in) :: axis   !! 1 or 2
    type(nurbs_solid_t) :: layer

    layer = layer_of(surface)
    call reverse_solid(layer, axis)
    call take_layer(layer, surface)
    if (allocated(surface%loops)) call mirror_loops(surface, axis)
  end subroutine reverse_surface

  !> Let the curves of a trim follow an axis that was reversed.
  pure subroutine mirror_loops(surface, axis)
    type(nurbs_surface_t), intent(inout) :: surface
    integer, intent(in) :: axis
    real(wp) :: both
    integer :: i, k

    associate (knots => surface%axes(axis)%knots)
      both = knots(1) + knots(size(knots))
    end associate
    do i = 1, size(surface%loops)
      associate (curves => surface%loops(i)%curves)
        do k = 1, size(curves)
          curves(k)%c(axis, :) = both*curves(k)%c(3, :) - curves(k)%c(axis, :)
        end do
      end associate
      call reverse_loop(surface%loops(i))
    end do
  end subroutine mirror_loops

  !> The surface of a layer that was refined; its trim stays.
  pure subroutine take_layer(layer, surface)
    type(nurbs_solid_t), intent(in) :: layer
    type(nurbs_surface_t), intent(inout) :: surface
    type(nurbs_surface_t) :: refined

    refined = solid_face(layer, 5)
    surface%axes = refined%axes
    call move_alloc(refined%points, surface%points)
    call move_alloc(refined%weights, surface%weights)
  end subroutine take_layer

  pure subroutine reverse_solid(solid, axis)
    type(nurbs_solid_t), intent(inout) :: solid
    integer, intent(in) :: axis   !! 1, 2 or 3
    type(curves_t) :: curves

    curves = solid_curves(solid, axis)
    associate (u => curves%axis%knots)
      u = u(1) + u(size(u)) - u(size(u):1:-1)
    end associate
    curves%points = curves%points(size(curves%points, 1):1:-1, :)
    call put_into_solid(curves, axis, solid)
  end subroutine reverse_solid

  !> The knots that divide every span into `n_parts` equal parts.
  pure function dividing_knots(axis, n_parts) result(knots)
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: n_parts   !! at least 1
    real(wp) :: knots((n_parts - 1)*n_spans(axis))
    integer :: spans(n_spans(axis)), i, part

    spans = span_table(axis)
    do i = 1, size(spans)
      associate (low => axis%knots(spans(i)), high => axis%knots(spans(i) + 1))
        do part = 1, n_parts - 1
          knots((i - 1)*(n_parts - 1) + part) = low + (high - low)*part/n_parts
        end do
      end associate
    end do
  end function dividing_knots

  !> Insert a knot or the old one next to it, if that is possible.
  pure subroutine insert_one_knot(curves, new_knot, error)
    type(curves_t), intent(inout) :: curves
    real(wp), intent(in) :: new_knot
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: knot
    integer :: nearest

    associate (u => curves%axis%knots, n => curves%axis%n_basis)
      knot = new_knot
      nearest = minloc(abs(u - knot), 1)
      if (abs(u(nearest) - knot) <= same_knot*(u(n + 1) - u(1))) knot = u(nearest)
      if (.not. (knot > u(1) .and. knot < u(n + 1))) then
        call fail(error, "knot insertion: the knot "//to_text(new_knot)// &
                  " does not lie between "//to_text(u(1))//" and "//to_text(u(n + 1)))
        return
      else if (count(u >= knot .and. u <= knot) >= curves%axis%degree) then
        call fail(error, "knot insertion: the knot "//to_text(new_knot)// &
                  " would be repeated more than degree times")
        return
      end if
    end associate
    call insert_knot(curves%axis%degree, knot, curves%axis%knots, curves%points)
    curves%axis%n_basis = curves%axis%n_basis + 1
  end subroutine insert_one_knot

  !> Control points of degree q = p + 1 from the blossom of the curve: the mean of its values at
  !! the q inner knots of a function with one of them left out in turn.
  !!
  !! The polynomial of any span that the knots enclose would do. The widest keeps the blossom's
  !! extrapolation to neighbours, and with it the rounding, small.
  subroutine elevate_once(curves)
    type(curves_t), intent(inout) :: curves
    type(knot_vector_t) :: axis
    real(wp), allocatable :: points(:, :), inner(:)
    real(wp) :: first(size(curves%points, 2)), change(size(curves%points, 2))
    integer :: i, j, span

    axis = elevated_axis(curves%axis)
    allocate (points(axis%n_basis, size(curves%points, 2)))
    do j = 1, axis%n_basis
      inner = axis%knots(j + 1:j + axis%degree)
      span = widest_span(curves%axis, inner(1), inner(axis%degree))
      first = blossom(curves, span, inner(2:))
      change = 0.0_wp
      do i = 2, axis%degree
        change = change + (blossom(curves, span, [inner(:i - 1), inner(i + 1:)]) - first)
      end do
      points(j, :) = first + change/axis%degree
    end do
    curves = curves_t(axis, points)
  end subroutine elevate_once

  !> The knots of one degree more, each distinct knot once more.
  pure function elevated_axis(axis) result(elevated)
    type(knot_vector_t), intent(in) :: axis
    type(knot_vector_t) :: elevated
    logical :: is_doubled(size(axis%knots))
    integer :: i, last

    is_doubled = .true.
    is_doubled(2:) = axis%knots(2:) > axis%knots(:size(axis%knots) - 1)
    elevated%degree = axis%degree + 1
    elevated%n_basis = size(axis%knots) + count(is_doubled) - elevated%degree - 1
    allocate (elevated%knots(size(axis%knots) + count(is_doubled)))
    last = 0
    do i = 1, size(axis%knots)
      elevated%knots(last + 1:) = axis%knots(i)
      last = last + merge(2, 1, is_doubled(i))
    end do
  end function elevated_axis

  !> The widest span between two knots; if they are equal, the span that begins there.
  pure integer function widest_span(axis, low, high) result(span)
    type(knot_vector_t), intent(in) :: axis
    real(wp), intent(in) :: low, high
    integer :: i

    span = find_span(axis, low)
    do i = span, find_span(axis, high)
      if (axis%knots(i + 1) > high) exit
      if (axis%knots(i + 1) - axis%knots(i) > axis%knots(span + 1) - axis%knots(span)) span = i
    end do
  end function widest_span

  !> Blossom of the polynomials of one span: de Boor's triangle with an argument for each level.
  pure function blossom(curves, span, arguments) result(point)
    type(curves_t), intent(in) :: curves
    integer, intent(in) :: span
    real(wp), intent(in) :: arguments(:)   !! shape (degree)
    real(wp) :: point(size(curves%points, 2))
    real(wp) :: work(0:size(arguments), size(curves%points, 2)), fraction
    integer :: p, i, level, at

    p = size(arguments)
    work = curves%points(span - p:span, :)
    associate (u => curves%axis%knots)
      do level = 1, p
        do i = p, level, -1
          at = span - p + i
          fraction = (arguments(level) - u(at))/(u(at + p + 1 - level) - u(at))
          work(i, :) = work(i - 1, :) + fraction*(work(i, :) - work(i - 1, :))
        end do
      end do
    end associate
    point = work(p, :)
  end function blossom

  !> A surface as a solid of one layer, its face 5.
  pure function layer_of(surface) result(solid)
    type(nurbs_surface_t), intent(in) :: surface
    type(nurbs_solid_t) :: solid

    solid%axes(:2) = surface%axes
    solid%axes(3)%n_basis = 1
    solid%points = reshape(surface%points, [surface%axes%n_basis, 1, 3])
    solid%weights = reshape(surface%weights, [surface%axes%n_basis, 1])
  end function layer_of

  !> Control points along `axis` of a solid; the other axes and the coordinates side by side.
  pure function solid_curves(solid, axis) result(curves)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: axis
    type(curves_t) :: curves
    real(wp), allocatable :: grid(:, :, :, :)
    integer :: order(4), extents(4)

    extents = [solid%axes%n_basis, 4]
    allocate (grid(extents(1), extents(2), extents(3), 4))
    grid(:, :, :, :3) = solid%points*spread(solid%weights, 4, 3)
    grid(:, :, :, 4) = solid%weights
    order = exchanged(axis)
    curves%axis = solid%axes(axis)
    curves%points = reshape(reshape(grid, extents(order), order=order), &
                            [extents(axis), size(grid)/extents(axis)])
  end function solid_curves

  !> The inverse of `solid_curves`.
  pure subroutine put_into_solid(curves, axis, solid)
    type(curves_t), intent(in) :: curves
    integer, intent(in) :: axis
    type(nurbs_solid_t), intent(inout) :: solid
    real(wp), allocatable :: grid(:, :, :, :)
    integer :: order(4), extents(4)

    solid%axes(axis) = curves%axis
    extents = [solid%axes%n_basis, 4]
    order = exchanged(axis)
    grid = reshape(reshape(curves%points, extents(order)), extents, order=order)
    solid%weights = grid(:, :, :, 4)
    solid%points = grid(:, :, :, :3)/spread(grid(:, :, :, 4), 4, 3)
  end subroutine put_into_solid

  !> 1, 2, 3, 4 with the first and `axis` exchanged: its own inverse.
  pure function exchanged(axis) result(order)
    integer, intent(in) :: axis
    integer :: order(4)

    order = [1, 2, 3, 4]
    order(1) = axis
    order(axis) = 1
  end function exchanged

end module refinement
