!> The blank as curved VTK cells: where its display points are and what the fields are there.
!!
!! One cell per element, of one degree d in all directions (the highest of the patch). Lagrange
!! cells have their points on the solid; Bezier cells have the solid's own Bezier points and
!! weights. Fields on control points are evaluated exactly. Fields at integration points are carried
!! over direction by direction: linear between the points of an element, constant outside the
!! outermost ones, then the mean over the elements that share the display point; a value at a
!! display point is therefore never outside the range of the values around it.
!!
!! A sheet may be shown as its mid-surface: cells that are surfaces, with a value of each such field
!! at the lowest layer of integration points, at the middle and at the highest layer.
module display_grid
  use kinds, only: wp
  use gauss_rule, only: gauss_rule_t
  use knot_vector, only: n_spans
  use nurbs_solid, only: nurbs_solid_t
  use line_operator, only: apply_tensor, basis_operator, equal_positions, joined_bezier_operator, &
                           line_operator_t, spread_operator
  implicit none
  private

  public :: display_grid_t, new_display_grid, display_vectors, display_scalars, display_thickness
  public :: display_directors, display_surface_scalars
  public :: point_grid, mises_stress

  !> Display points of a blank and the ways to them. All grids have axis 1 fastest.
  type :: display_grid_t
    integer :: degree = 0                            !! of the cells
    integer :: n_elements(3) = 0
    integer :: n(3) = 0                              !! display points per direction
    logical :: is_rational = .false.
    logical :: is_surface = .false.                  !! the mid-surface alone, n(3) = 1
    type(line_operator_t) :: basis(3)                !! from control points
    type(line_operator_t) :: spread(3)               !! from integration points
    real(wp), allocatable :: control_weights(:)      !! of the solid, (n1*n2*n3)
    real(wp), allocatable :: weights(:)              !! at display points, (product(n))
  end type display_grid_t

contains

  !> Display points for a solid whose elements carry these integration points. As a surface it is
  !! one linear element through the thickness.
  pure function new_display_grid(solid, rule, is_bezier, is_surface) result(grid)
    type(nurbs_solid_t), intent(in) :: solid
    type(gauss_rule_t), intent(in) :: rule(3)
    logical, intent(in) :: is_bezier
    logical, intent(in), optional :: is_surface
    type(display_grid_t) :: grid
    real(wp), parameter :: faces_and_middle(3) = [-1.0_wp, 0.0_wp, 1.0_wp]
    integer :: d

    grid%degree = maxval(solid%axes%degree)
    do d = 1, 3
      grid%n_elements(d) = n_spans(solid%axes(d))
      associate (positions => equal_positions(grid%degree))
        if (is_bezier) then
          grid%basis(d) = joined_bezier_operator(solid%axes(d), grid%degree)
        else
          grid%basis(d) = basis_operator(solid%axes(d), positions, 0, is_joined=.true.)
        end if
        grid%spread(d) = spread_operator(rule(d)%points, positions, grid%n_elements(d))
      end associate
    end do
    if (present(is_surface)) grid%is_surface = is_surface
    if (grid%is_surface) then
      grid%basis(3) = basis_operator(solid%axes(3), faces_and_middle(2:2), 0, is_joined=.false.)
      grid%spread(3) = spread_operator(rule(3)%points, faces_and_middle, 1)
    end if
    grid%n = grid%basis%n_out
    grid%control_weights = [solid%weights]
    grid%is_rational = maxval(solid%weights) > minval(solid%weights)
    grid%weights = apply_tensor(grid%basis, grid%control_weights)
  end function new_display_grid

  !> A vector field given by control values, at the display points.
  pure function display_vectors(grid, field) result(values)
    type(display_grid_t), intent(in) :: grid
    real(wp), intent(in) :: field(size(grid%control_weights), 3)
    real(wp) :: values(product(grid%n), 3)
    integer :: i

    do i = 1, 3
      if (grid%is_rational) then
        values(:, i) = apply_tensor(grid%basis, grid%control_weights*field(:, i))/grid%weights
      else
        values(:, i) = apply_tensor(grid%basis, field(:, i))
      end if
    end do
  end function display_vectors

  !> A scalar field given at the integration points (as `point_grid` orders them), at the display
  !! points; of a surface all values at the bottom, then those at the middle and at the top.
  pure function display_scalars(grid, field) result(values)
    type(display_grid_t), intent(in) :: grid
    real(wp), intent(in) :: field(product(grid%spread%n_in))
    real(wp) :: values(product(grid%spread%n_out))

    values = apply_tensor(grid%spread, field)
  end function display_scalars

  !> A scalar field given at the integration points along the sheet, at the display points: the same
  !! for all points of a column.
  pure function display_surface_scalars(grid, field) result(values)
    type(display_grid_t), intent(in) :: grid
    real(wp), intent(in) :: field(product(grid%spread(:2)%n_in))
    real(wp) :: values(grid%n(1)*grid%n(2), grid%n(3))

    values = spread(apply_tensor(grid%spread(:2), field), 2, grid%n(3))
  end function display_surface_scalars

  !> From the lower to the upper face of a sheet, at the display points of a surface.
  pure function display_directors(grid, points) result(directors)
    type(display_grid_t), intent(in) :: grid
    !> Control points of both faces.
    real(wp), intent(in) :: points(product(grid%basis(:2)%n_in), 2, 3)
    real(wp) :: directors(product(grid%n), 3)
    integer :: i

    associate (weights => grid%control_weights(:size(points, 1)))
      do i = 1, 3
        directors(:, i) = apply_tensor(grid%basis(:2), weights*(points(:, 2, i) &
                                                                - points(:, 1, i)))/grid%weights
      end do
    end associate
  end function display_directors

  !> Thickness [length]: the distance between the display points of both faces, the same for all
  !! points of a column.
  pure function display_thickness(grid, points) result(thickness)
    type(display_grid_t), intent(in) :: grid
    real(wp), intent(in) :: points(grid%n(1)*grid%n(2), grid%n(3), 3)   !! display points
    real(wp) :: thickness(grid%n(1)*grid%n(2), grid%n(3))

    thickness = spread(norm2(points(:, grid%n(3), :) - points(:, 1, :), dim=2), 2, grid%n(3))
  end function display_thickness

  !> A field at integration points from element order (m, q1, q2, q3, e1, e2, e3) to the tensor grid
  !! of all points, (m, q1*e1, q2*e2, q3*e3) with points in rising order along each direction.
  pure function point_grid(m, n_points, n_elements, field) result(values)
    integer, intent(in) :: m                !! components
    integer, intent(in) :: n_points(3)      !! per element and direction
    integer, intent(in) :: n_elements(3)
    real(wp), intent(in) :: field(m, n_points(1), n_points(2), n_points(3), &
                                  n_elements(1), n_elements(2), n_elements(3))
    real(wp) :: values(m, n_points(1), n_elements(1), n_points(2), n_elements(2), n_points(3), &
                       n_elements(3))

    values = reshape(field, shape(values), order=[1, 2, 4, 6, 3, 5, 7])
  end function point_grid

  !> Von Mises stress of stresses in the order 11, 22, 33, 12, 13, 23.
  pure function mises_stress(stress) result(mises)
    real(wp), intent(in) :: stress(:, :)      !! shape (6, n)
    real(wp) :: mises(size(stress, 2))

    mises = sqrt(0.5_wp*((stress(1, :) - stress(2, :))**2 + (stress(2, :) - stress(3, :))**2 &
                         + (stress(3, :) - stress(1, :))**2) + 3*sum(stress(4:6, :)**2, dim=1))
  end function mises_stress

end module display_grid
