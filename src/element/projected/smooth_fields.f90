!> What a patch with smooth projections keeps between the passes over its blocks.
module smooth_fields
  use kinds, only: wp
  use strain_projection, only: projection_t
  use smooth_axis, only: smooth_axis_t, point_factors
  use basis_tables, only: n_lanes, axis_table_t, lane_table_t
  implicit none
  private

  public :: new_smooth_fields

  !> Factors between the points and the splines of an element along one axis, lane by lane, for
  !! strains (1) and stresses (2).
  type, public :: smooth_table_t
    real(wp), allocatable :: to_loads(:, :, :, :, :)    !! (8, q, p, n, 2)
    real(wp), allocatable :: to_points(:, :, :, :, :)   !! (8, p, q, n, 2)
  end type smooth_table_t

  !> Loads of the splines of one degree less, block by block, and the coefficients they lead to: of
  !! the volume strain (its stress on the way back), with laws that need the context of their points
  !! of two volumes more. p counts the splines of an element along an axis, its degree.
  type, public :: smooth_fields_t
    type(smooth_table_t) :: tables(3)                 !! by lane block for axis 1, by element else
    real(wp), allocatable :: loads(:, :, :, :, :, :)  !! (8, p3, p2, p1, n, n_blocks)
    real(wp), allocatable :: all(:, :, :, :)          !! n_functions of the axes 1, 2, 3, n
    real(wp), allocatable :: rest(:, :, :, :)         !! of stress times volume, (8*q3, 6, q1*q2,
                                                      !! n_blocks)
  end type smooth_fields_t

contains

  !> Tables and room for a patch.
  pure function new_smooth_fields(projection, axes, lanes, has_context) result(fields)
    type(projection_t), intent(in) :: projection
    type(axis_table_t), intent(in) :: axes(3)
    type(lane_table_t), intent(in) :: lanes
    logical, intent(in) :: has_context
    type(smooth_fields_t) :: fields
    integer, allocatable :: elements(:, :)
    logical, allocatable :: is_owner(:, :)
    integer :: p(3), q(3), n_blocks, n_rows, n_means, axis, e

    p = axes%degree
    q = axes%n_points
    n_rows = axes(2)%n_elements*axes(3)%n_elements
    n_blocks = lanes%n_blocks*n_rows
    n_means = merge(3, 1, has_context)
    allocate (fields%loads(n_lanes, p(3), p(2), p(1), n_means, n_blocks))
    associate (n_functions => projection%smooth%n_functions)
      allocate (fields%all(n_functions(1), n_functions(2), n_functions(3), n_means))
    end associate
    allocate (fields%rest(n_lanes*q(3), 6, q(1)*q(2), n_blocks))
    fields%tables(1) = new_smooth_table(projection%smooth(1), lanes%element, lanes%is_owner)
    do axis = 2, 3
      elements = spread([(e, e=1, axes(axis)%n_elements)], 1, n_lanes)
      is_owner = elements > 0
      fields%tables(axis) = new_smooth_table(projection%smooth(axis), elements, is_owner)
    end do
  end function new_smooth_fields

  !> Factors for elements side by side. Lanes that repeat an element load nothing; they get its
  !! strains too, but no stress.
  pure function new_smooth_table(smooth, element, is_owner) result(table)
    type(smooth_axis_t), intent(in) :: smooth
    integer, intent(in) :: element(:, :)           !! shape (8, n)
    logical, intent(in) :: is_owner(:, :)
    type(smooth_table_t) :: table
    integer :: i, l, p, q, n

    p = size(smooth%values, 1)
    q = size(smooth%values, 2)
    n = size(element, 2)
    allocate (table%to_loads(n_lanes, q, p, n, 2), source=0.0_wp)
    allocate (table%to_points(n_lanes, p, q, n, 2), source=0.0_wp)
    do i = 1, n
      do l = 1, n_lanes
        associate (e => element(l, i))
          table%to_points(l, :, :, i, 1) = point_factors(smooth, e, .false.)
          if (.not. is_owner(l, i)) cycle
          table%to_points(l, :, :, i, 2) = point_factors(smooth, e, .true.)
          table%to_loads(l, :, :, i, 1) = transpose(point_factors(smooth, e, .true.))
          table%to_loads(l, :, :, i, 2) = transpose(point_factors(smooth, e, .false.))
        end associate
      end do
    end do
  end function new_smooth_table

end module smooth_fields
