!> What a projected element keeps of its points between kinematics and forces.
module point_fields
  use kinds, only: wp
  use strain_projection, only: projection_t, project_sheet
  use basis_tables, only: n_lanes
  implicit none
  private

  public :: new_point_fields

  !> Fields of the points of some blocks. The last dimension counts blocks, the one before rows.
  type, public :: point_fields_t
    real(wp), allocatable :: dstrain(:, :, :, :)     !! (8*q3, 6, q1*q2, n)
    real(wp), allocatable :: spin(:, :, :, :)        !! (8*q3, 3, q1*q2, n)
    real(wp), allocatable :: volume(:, :, :)         !! middle of the step, (8*q3, q1*q2, n)
    real(wp), allocatable :: end_volume(:, :, :)     !! end of the step
    real(wp), allocatable :: jacobian(:, :, :, :)    !! end, (8*q3, 9, q1*q2, n); not smooth
    real(wp), allocatable :: weighted(:, :, :, :)    !! stress times volume, (8*q3, 6, q1*q2, n)
    real(wp), allocatable :: plane(:, :, :, :)       !! its share within a sheet, see split_sheet
    real(wp), allocatable :: mean(:, :, :)           !! volume strain or its stress
    real(wp), allocatable :: along1(:, :, :, :)      !! what axis 1 alone projects; sheet only
    real(wp), allocatable :: along2(:, :, :, :)      !! what axis 2 alone projects; sheet only
    real(wp), allocatable :: tangents(:, :, :, :)    !! (8*q3, 12, q1*q2, n); idle without a sheet
    real(wp), allocatable :: gradients(:, :, :, :)   !! F at start and end, row by row; context
    real(wp), allocatable :: place(:, :, :, :)       !! (8*q3, 3, q1*q2, n); context only
    real(wp), allocatable :: growth(:, :, :, :)      !! log det F, (8*q3, 2, q1*q2, n); context
  end type point_fields_t

contains

  !> Room for the points of n blocks.
  pure function new_point_fields(q, n, projection, has_context) result(fields)
    integer, intent(in) :: q(3), n
    type(projection_t), intent(in) :: projection
    logical, intent(in) :: has_context
    type(point_fields_t) :: fields
    integer :: points, rows, n_sheet, n_whole, n_context

    points = n_lanes*q(3)
    rows = q(1)*q(2)
    n_sheet = merge(n, 0, projection%kind == project_sheet)
    n_whole = merge(0, n, projection%is_smooth)
    n_context = merge(n, 0, has_context)
    allocate (fields%dstrain(points, 6, rows, n), fields%spin(points, 3, rows, n))
    allocate (fields%volume(points, rows, n), fields%end_volume(points, rows, n))
    allocate (fields%mean(points, rows, n))
    allocate (fields%jacobian(points, 9, rows, n_whole))
    allocate (fields%weighted(points, 6, rows, n), fields%plane(points, 3, rows, n_sheet))
    allocate (fields%along1(points, 6, rows, n_sheet), fields%along2(points, 6, rows, n_sheet))
    allocate (fields%tangents(points, 12, rows, max(n_sheet, 1)))
    allocate (fields%gradients(points, 18, rows, n_context))
    allocate (fields%place(points, 3, rows, n_context), fields%growth(points, 2, rows, n_context))
  end function new_point_fields

end module point_fields
