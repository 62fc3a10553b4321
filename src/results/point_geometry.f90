!> Geometry of the blank at its integration points: positions, volumes, strains in the sheet's
!! plane. Points form one tensor grid, (q1*e1, q2*e2, q3*e3) with axis 1 fastest, in rising order.
!! Elements that an outline cuts have points of their own, which take their places in the grid.
module point_geometry
  use kinds, only: wp
  use gauss_rule, only: gauss_rule_t
  use knot_vector, only: basis_derivatives, knot_vector_t, span_table
  use nurbs_solid, only: nurbs_solid_t
  use line_operator, only: apply_tensor, basis_operator, line_operator_t
  implicit none
  private

  public :: point_geometry_t, new_point_geometry, cut_points, has_other_cut, plane_strains, &
            parts_of

  !> Points of cut elements, m in each layer: first control points along axes 1 and 2, (2, m), and
  !! the basis there, values and slopes, (p + 1, 2, m); of all layers their numbers in the grid and
  !! their metric, layer by layer.
  type :: cut_table_t
    integer, allocatable :: first(:, :), at(:)
    real(wp), allocatable :: one(:, :, :), two(:, :, :), metric(:, :)
  end type cut_table_t

  !> Integration points of a solid in its reference configuration.
  type :: point_geometry_t
    integer :: n(3) = 0                                    !! points per direction
    type(gauss_rule_t) :: rule(3)                          !! of an element
    type(line_operator_t) :: basis(3), slopes(3)           !! from control points
    real(wp), allocatable :: control_weights(:)            !! of the solid
    logical :: is_rational = .false.                       !! these differ
    real(wp), allocatable :: share(:, :)                   !! see `cut_points`; whole: missing
    type(cut_table_t) :: cut
    real(wp), allocatable :: positions(:, :)               !! reference positions, (3, n)
    real(wp), allocatable :: volumes(:)                    !! reference volume of each point, (n)
    !> G11, G12, G22 of the reference at the points of whole elements, (3, n).
    real(wp), allocatable :: metric(:, :)
  end type point_geometry_t

contains

  !> Geometry at the points of `rule` in every element.
  pure function new_point_geometry(solid, rule) result(geometry)
    type(nurbs_solid_t), intent(in) :: solid
    type(gauss_rule_t), intent(in) :: rule(3)
    type(point_geometry_t) :: geometry
    integer :: d

    geometry%rule = rule
    do d = 1, 3
      geometry%basis(d) = basis_operator(solid%axes(d), rule(d)%points, 0, is_joined=.false.)
      geometry%slopes(d) = basis_operator(solid%axes(d), rule(d)%points, 1, is_joined=.false.)
    end do
    geometry%n = geometry%basis%n_out
    geometry%control_weights = [solid%weights]
    geometry%is_rational = any(abs(solid%weights - 1.0_wp) > 0.0_wp)
    call measure_points(solid, geometry)
  end function new_point_geometry

  !> Is this another cut of the sheet than that of the geometry?
  pure logical function has_other_cut(geometry, share)
    type(point_geometry_t), intent(in) :: geometry
    real(wp), intent(in) :: share(:, :)            !! as of `cut_points`

    has_other_cut = .not. allocated(geometry%share)
    if (allocated(geometry%share)) has_other_cut = any(abs(geometry%share - share) > 0.0_wp)
  end function has_other_cut

  !> Geometry of a sheet of which an outline keeps a part: elements that it cuts have points of
  !! their own, which share what is left of the volume.
  pure subroutine cut_points(solid, share, places, geometry)
    type(nurbs_solid_t), intent(in) :: solid       !! that of the geometry
    real(wp), intent(in) :: share(:, :)            !! part of each element that is left
    !> Own coordinates of the points of cut elements along the sheet, from -1 to 1, (2, q1, q2,
    !! elements), elements in the order of the array `share`.
    real(wp), intent(in) :: places(:, :, :, :)
    type(point_geometry_t), intent(inout) :: geometry
    integer :: spans_1(size(share, 1)), spans_2(size(share, 2)), n(2), e1, e2, i, j, c, k, m

    spans_1 = span_table(solid%axes(1))
    spans_2 = span_table(solid%axes(2))
    n = [size(places, 2), size(places, 3)]
    geometry%share = share
    geometry%cut = new_cut_table(solid%axes%degree, size(places)/2, geometry%n(3))
    c = 0
    m = 0
    do e2 = 1, size(share, 2)
      do e1 = 1, size(share, 1)
        if (share(e1, e2) <= 0.0_wp .or. share(e1, e2) >= 1.0_wp) cycle
        c = c + 1
        do j = 1, n(2)
          do i = 1, n(1)
            m = m + 1
            associate (cut => geometry%cut)
              cut%at(m) = n(1)*(e1 - 1) + i + geometry%n(1)*(n(2)*(e2 - 1) + j - 1)
              cut%first(:, m) = [spans_1(e1), spans_2(e2)] - solid%axes(:2)%degree
              call basis_in_span(solid%axes(1), spans_1(e1), places(1, i, j, c), cut%one(:, :, m))
              call basis_in_span(solid%axes(2), spans_2(e2), places(2, i, j, c), cut%two(:, :, m))
            end associate
          end do
        end do
      end do
    end do
    associate (at => geometry%cut%at, n_layer => product(geometry%n(:2)))
      do k = 2, geometry%n(3)
        at(m*(k - 1) + 1:m*k) = at(:m) + n_layer*(k - 1)
      end do
    end associate
    call measure_points(solid, geometry)
  end subroutine cut_points

  !> Room for `m` points in each layer.
  pure function new_cut_table(degrees, m, n_layers) result(cut)
    integer, intent(in) :: degrees(3), m, n_layers
    type(cut_table_t) :: cut

    allocate (cut%at(m*n_layers), cut%first(2, m))
    allocate (cut%one(degrees(1) + 1, 2, m), cut%two(degrees(2) + 1, 2, m))
  end function new_cut_table

  !> Basis functions and their slopes at a place between the knots `span` and `span + 1`.
  pure subroutine basis_in_span(kv, span, place, orders)
    type(knot_vector_t), intent(in) :: kv
    integer, intent(in) :: span
    real(wp), intent(in) :: place               !! from -1 to 1
    real(wp), intent(out) :: orders(kv%degree + 1, 2)

    associate (low => kv%knots(span), high => kv%knots(span + 1))
      call basis_derivatives(kv, span, 0.5_wp*(low*(1 - place) + high*(1 + place)), 1, orders)
    end associate
  end subroutine basis_in_span

  !> Positions, metric and volumes at the points.
  pure subroutine measure_points(solid, geometry)
    type(nurbs_solid_t), intent(in) :: solid
    type(point_geometry_t), intent(inout) :: geometry
    real(wp), allocatable :: positions(:, :), tangents(:, :, :), measure(:), line(:)
    real(wp) :: points(size(solid%weights), 3)
    integer :: d, i

    points = reshape(solid%points, shape(points))
    positions = positions_of(geometry, .false., points)
    tangents = tangents_of(geometry, .false., points, 3)
    geometry%metric = plane_metric(tangents)
    if (allocated(geometry%cut%at)) then
      associate (at => geometry%cut%at)
        positions(at, :) = positions_of(geometry, .true., points)
        tangents(at, :, :) = tangents_of(geometry, .true., points, 3)
        geometry%cut%metric = plane_metric(tangents(at, :, :))
      end associate
    end if
    geometry%positions = transpose(positions)
    measure = [1.0_wp]
    do d = 1, 3
      ! Quadrature weights with respect to the parametric coordinate, along the whole direction.
      associate (kv => solid%axes(d), spans => span_table(solid%axes(d)))
        line = [(0.5_wp*geometry%rule(d)%weights*(kv%knots(spans(i) + 1) - kv%knots(spans(i))), &
                 i=1, size(spans))]
      end associate
      measure = [(measure*line(i), i=1, size(line))]
    end do
    geometry%volumes = measure*determinants(tangents)
    if (allocated(geometry%share)) geometry%volumes = geometry%volumes &
      *parts_of(geometry%n, geometry%rule%n, geometry%share)
  end subroutine measure_points

  !> The part of its element for each point of the grid.
  pure function parts_of(n, rule_size, share) result(parts)
    integer, intent(in) :: n(3), rule_size(3)
    real(wp), intent(in) :: share(:, :)
    real(wp) :: parts(product(n))
    integer :: i, at(2)

    do i = 1, size(parts)
      at = [mod(i - 1, n(1)), mod((i - 1)/n(1), n(2))]/rule_size(:2) + 1
      parts(i) = share(at(1), at(2))
    end do
  end function parts_of

  !> Major and minor principal logarithmic strain in the sheet's plane, that is between the
  !! tangents of xi and eta: half the logarithm of the eigenvalues of the current metric with
  !! respect to the reference metric. At the points that all elements have while they are whole, or
  !! at those of cut elements alone, as `cut%at` lists them.
  pure function plane_strains(geometry, of_cut, control_points) result(strains)
    type(point_geometry_t), intent(in) :: geometry
    logical, intent(in) :: of_cut
    real(wp), intent(in) :: control_points(size(geometry%control_weights), 3)   !! current
    real(wp) :: strains(2, n_points(geometry, of_cut))
    real(wp) :: g(3, n_points(geometry, of_cut))

    g = plane_metric(tangents_of(geometry, of_cut, control_points, 2))
    if (of_cut) then
      strains = strains_of(geometry%cut%metric, g)
    else
      strains = strains_of(geometry%metric, g)
    end if
  end function plane_strains

  ! These strains from both metrics.
  pure function strains_of(reference, current) result(strains)
    real(wp), intent(in) :: reference(:, :), current(:, :)   ! shape (3, n)
    real(wp) :: strains(2, size(current, 2))
    real(wp) :: mean, product_of_both, root
    integer :: i

    do i = 1, size(current, 2)
      associate (r => reference(:, i), c => current(:, i))
        mean = 0.5_wp*(c(1)*r(3) + c(3)*r(1) - 2*c(2)*r(2))/(r(1)*r(3) - r(2)**2)
        product_of_both = (c(1)*c(3) - c(2)**2)/(r(1)*r(3) - r(2)**2)
        root = sqrt(max(mean**2 - product_of_both, 0.0_wp))
        strains(:, i) = 0.5_wp*log(max([mean + root, product_of_both/(mean + root)], &
                                       tiny(1.0_wp)))
      end associate
    end do
  end function strains_of

  pure function positions_of(geometry, of_cut, control_points) result(positions)
    type(point_geometry_t), intent(in) :: geometry
    logical, intent(in) :: of_cut
    real(wp), intent(in) :: control_points(size(geometry%control_weights), 3)
    real(wp), allocatable :: positions(:, :)
    real(wp), allocatable :: weight(:)
    integer :: i

    allocate (positions(n_points(geometry, of_cut), 3))
    if (geometry%is_rational) weight = at_points(geometry, of_cut, 0, geometry%control_weights)
    do i = 1, 3
      if (geometry%is_rational) then
        positions(:, i) = at_points(geometry, of_cut, 0, &
                                    geometry%control_weights*control_points(:, i))/weight
      else
        positions(:, i) = at_points(geometry, of_cut, 0, control_points(:, i))
      end if
    end do
  end function positions_of

  ! Tangents of a configuration along the first directions, shape (n, component, direction): of
  ! rational ones by the quotient rule from homogeneous coordinates.
  pure function tangents_of(geometry, of_cut, control_points, n_directions) result(tangents)
    type(point_geometry_t), intent(in) :: geometry
    logical, intent(in) :: of_cut
    real(wp), intent(in) :: control_points(size(geometry%control_weights), 3)
    integer, intent(in) :: n_directions
    real(wp), allocatable :: tangents(:, :, :)
    real(wp), allocatable :: positions(:, :), weight(:), weight_slope(:)
    integer :: i, d

    allocate (tangents(n_points(geometry, of_cut), 3, n_directions))
    if (geometry%is_rational) then
      positions = positions_of(geometry, of_cut, control_points)
      weight = at_points(geometry, of_cut, 0, geometry%control_weights)
    end if
    do d = 1, n_directions
      if (geometry%is_rational) &
        weight_slope = at_points(geometry, of_cut, d, geometry%control_weights)
      do i = 1, 3
        if (geometry%is_rational) then
          tangents(:, i, d) = (at_points(geometry, of_cut, d, &
                                         geometry%control_weights*control_points(:, i)) &
                               - weight_slope*positions(:, i))/weight
        else
          tangents(:, i, d) = at_points(geometry, of_cut, d, control_points(:, i))
        end if
      end do
    end do
  end function tangents_of

  pure integer function n_points(geometry, of_cut)
    type(point_geometry_t), intent(in) :: geometry
    logical, intent(in) :: of_cut

    n_points = product(geometry%n)
    if (of_cut) n_points = size(geometry%cut%at)
  end function n_points

  ! A spline field at the points, or its slope along a direction.
  pure function at_points(geometry, of_cut, direction, field) result(values)
    type(point_geometry_t), intent(in) :: geometry
    logical, intent(in) :: of_cut
    integer, intent(in) :: direction                       ! 0: the field itself
    real(wp), intent(in) :: field(size(geometry%control_weights))
    real(wp), allocatable :: values(:)
    type(line_operator_t) :: ops(3)

    ops = geometry%basis
    if (direction > 0) ops(direction) = geometry%slopes(direction)
    if (of_cut) then
      values = at_cut(geometry%cut, ops, direction, field)
    else
      values = apply_tensor(ops, field)
    end if
  end function at_points

  ! The same at the points of cut elements, of which the operators of axis 3 know the layers.
  pure function at_cut(cut, ops, direction, field) result(values)
    type(cut_table_t), intent(in) :: cut
    type(line_operator_t), intent(in) :: ops(3)
    integer, intent(in) :: direction
    real(wp), intent(in) :: field(ops(1)%n_in, ops(2)%n_in, ops(3)%n_in)
    real(wp) :: values(size(cut%at))
    real(wp) :: column(ops(3)%n_in)
    integer :: m, k, s, n, one, two, first(2), last(2)

    one = merge(2, 1, direction == 1)
    two = merge(2, 1, direction == 2)
    n = size(cut%first, 2)
    do m = 1, n
      first = cut%first(:, m)
      last = first + [size(cut%one, 1), size(cut%two, 1)] - 1
      do k = 1, size(column)
        column(k) = dot_product(cut%two(:, two, m), matmul( &
          cut%one(:, one, m), field(first(1):last(1), first(2):last(2), k)))
      end do
      do s = 1, ops(3)%n_out
        associate (low => ops(3)%first(s))
          values(m + n*(s - 1)) = dot_product(ops(3)%values(:, s), &
                                              column(low:low + ops(3)%width - 1))
        end associate
      end do
    end do
  end function at_cut

  pure function plane_metric(tangents) result(metric)
    real(wp), intent(in) :: tangents(:, :, :)
    real(wp) :: metric(3, size(tangents, 1))

    metric(1, :) = sum(tangents(:, :, 1)**2, dim=2)
    metric(2, :) = sum(tangents(:, :, 1)*tangents(:, :, 2), dim=2)
    metric(3, :) = sum(tangents(:, :, 2)**2, dim=2)
  end function plane_metric

  pure function determinants(t) result(values)
    real(wp), intent(in) :: t(:, :, :)
    real(wp) :: values(size(t, 1))

    values = t(:, 1, 1)*(t(:, 2, 2)*t(:, 3, 3) - t(:, 3, 2)*t(:, 2, 3)) &
             - t(:, 2, 1)*(t(:, 1, 2)*t(:, 3, 3) - t(:, 3, 2)*t(:, 1, 3)) &
             + t(:, 3, 1)*(t(:, 1, 2)*t(:, 2, 3) - t(:, 2, 2)*t(:, 1, 3))
  end function determinants

end module point_geometry
