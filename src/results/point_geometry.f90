!> Geometry of the blank at its integration points: positions, volumes, strains in the sheet's
!! plane. Points form one tensor grid, (q1*e1, q2*e2, q3*e3) with axis 1 fastest, in rising order.
module point_geometry
  use kinds, only: wp
  use gauss_rule, only: gauss_rule_t
  use knot_vector, only: span_table
  use nurbs_solid, only: nurbs_solid_t
  use line_operator, only: apply_tensor, basis_operator, line_operator_t
  implicit none
  private

  public :: point_geometry_t, new_point_geometry, plane_strains, parts_of

  !> Integration points of a solid in its reference configuration.
  type :: point_geometry_t
    integer :: n(3) = 0                                    !! points per direction
    type(line_operator_t) :: basis(3), slopes(3)           !! from control points
    real(wp), allocatable :: control_weights(:)            !! of the solid
    logical :: is_rational = .false.                       !! these differ
    real(wp), allocatable :: positions(:, :)               !! reference positions, (3, n)
    real(wp), allocatable :: volumes(:)                    !! reference volume of each point, (n)
    real(wp), allocatable :: metric(:, :)                  !! G11, G12, G22 of the reference, (3, n)
  end type point_geometry_t

contains

  !> Geometry at the points of `rule` in every element.
  pure function new_point_geometry(solid, rule, share) result(geometry)
    type(nurbs_solid_t), intent(in) :: solid
    type(gauss_rule_t), intent(in) :: rule(3)
    !> Part of each element along the sheet that counts, over which its points share the volume;
    !! absent or not allocated: all of it.
    real(wp), allocatable, intent(in), optional :: share(:, :)
    type(point_geometry_t) :: geometry
    real(wp), allocatable :: positions(:, :), tangents(:, :, :), measure(:), line(:)
    real(wp) :: points(size(solid%weights), 3)
    integer :: d, i

    points = reshape(solid%points, shape(points))
    do d = 1, 3
      geometry%basis(d) = basis_operator(solid%axes(d), rule(d)%points, 0, is_joined=.false.)
      geometry%slopes(d) = basis_operator(solid%axes(d), rule(d)%points, 1, is_joined=.false.)
    end do
    geometry%n = geometry%basis%n_out
    geometry%control_weights = [solid%weights]
    geometry%is_rational = any(abs(solid%weights - 1.0_wp) > 0.0_wp)
    positions = positions_of(geometry, points)
    tangents = tangents_of(geometry, points, 3)
    geometry%positions = transpose(positions)
    geometry%metric = plane_metric(tangents)
    measure = [1.0_wp]
    do d = 1, 3
      ! Quadrature weights with respect to the parametric coordinate, along the whole direction.
      associate (kv => solid%axes(d), spans => span_table(solid%axes(d)))
        line = [(0.5_wp*rule(d)%weights*(kv%knots(spans(i) + 1) - kv%knots(spans(i))), &
                 i=1, size(spans))]
      end associate
      measure = [(measure*line(i), i=1, size(line))]
    end do
    geometry%volumes = measure*determinants(tangents)
    if (.not. present(share)) return
    if (allocated(share)) geometry%volumes = geometry%volumes*parts_of(geometry%n, rule%n, share)
  end function new_point_geometry

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
  !! respect to the reference metric.
  pure function plane_strains(geometry, control_points) result(strains)
    type(point_geometry_t), intent(in) :: geometry
    real(wp), intent(in) :: control_points(size(geometry%control_weights), 3)   !! current
    real(wp), allocatable :: strains(:, :)   !! shape (2, n)
    real(wp), allocatable :: g(:, :)
    real(wp) :: mean, product_of_both, root
    integer :: i

    g = plane_metric(tangents_of(geometry, control_points, 2))
    allocate (strains(2, size(g, 2)))
    do i = 1, size(g, 2)
      associate (r => geometry%metric(:, i), c => g(:, i))
        mean = 0.5_wp*(c(1)*r(3) + c(3)*r(1) - 2*c(2)*r(2))/(r(1)*r(3) - r(2)**2)
        product_of_both = (c(1)*c(3) - c(2)**2)/(r(1)*r(3) - r(2)**2)
        root = sqrt(max(mean**2 - product_of_both, 0.0_wp))
        strains(:, i) = 0.5_wp*log(max([mean + root, product_of_both/(mean + root)], &
                                       tiny(1.0_wp)))
      end associate
    end do
  end function plane_strains

  pure function positions_of(geometry, control_points) result(positions)
    type(point_geometry_t), intent(in) :: geometry
    real(wp), intent(in) :: control_points(size(geometry%control_weights), 3)
    real(wp), allocatable :: positions(:, :)
    real(wp), allocatable :: weight(:)
    integer :: i

    allocate (positions(product(geometry%n), 3))
    if (geometry%is_rational) weight = apply_tensor(geometry%basis, geometry%control_weights)
    do i = 1, 3
      if (geometry%is_rational) then
        positions(:, i) = apply_tensor(geometry%basis, &
                                    geometry%control_weights*control_points(:, i))/weight
      else
        positions(:, i) = apply_tensor(geometry%basis, control_points(:, i))
      end if
    end do
  end function positions_of

  ! Tangents of a configuration along the first directions, shape (n, component, direction): of
  ! rational ones by the quotient rule from homogeneous coordinates.
  pure function tangents_of(geometry, control_points, n_directions) result(tangents)
    type(point_geometry_t), intent(in) :: geometry
    real(wp), intent(in) :: control_points(size(geometry%control_weights), 3)
    integer, intent(in) :: n_directions
    real(wp), allocatable :: tangents(:, :, :)
    type(line_operator_t) :: ops(3)
    real(wp), allocatable :: positions(:, :), weight(:), weight_slope(:)
    integer :: i, d

    allocate (tangents(product(geometry%n), 3, n_directions))
    if (geometry%is_rational) then
      positions = positions_of(geometry, control_points)
      weight = apply_tensor(geometry%basis, geometry%control_weights)
    end if
    do d = 1, n_directions
      ops = geometry%basis
      ops(d) = geometry%slopes(d)
      if (geometry%is_rational) weight_slope = apply_tensor(ops, geometry%control_weights)
      do i = 1, 3
        if (geometry%is_rational) then
          tangents(:, i, d) = (apply_tensor(ops, geometry%control_weights*control_points(:, i)) &
                               - weight_slope*positions(:, i))/weight
        else
          tangents(:, i, d) = apply_tensor(ops, control_points(:, i))
        end if
      end do
    end do
  end function tangents_of

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
