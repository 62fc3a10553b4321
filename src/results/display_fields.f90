!> The scalar fields at the display points of a frame: one line in `display_fields` and one in
!! `patch_scalars` each.
module display_fields
  use kinds, only: wp
  use nurbs_solid, only: nurbs_solid_t
  use display_grid, only: display_grid_t, display_scalars, display_thickness, display_vectors, &
                          mises_stress, point_grid
  use point_geometry, only: plane_strains, point_geometry_t
  implicit none
  private

  public :: display_field_t, patch_view_t, patch_frame_t, display_fields_of, patch_vectors
  public :: patch_scalars

  !> Name, quantity (as `unit_of` takes it) and meaning of a scalar field.
  type :: display_field_t
    character(16) :: name
    character(8) :: quantity
    character(80) :: description
  end type display_field_t

  !> A patch of the blank in the file.
  type :: patch_view_t
    character(:), allocatable :: name
    type(nurbs_solid_t) :: solid                        !! at the start
    type(display_grid_t) :: grid
    type(point_geometry_t) :: geometry
    integer :: rule_size(3) = 0
    real(wp), allocatable :: thickness(:)               !! at the display points at the start
  end type patch_view_t

  !> A patch in one frame. Fields at integration points in element order; elements counted along
  !! each axis.
  type :: patch_frame_t
    real(wp), allocatable :: points(:, :, :, :)         !! control points, (n1, n2, n3, 3)
    real(wp), allocatable :: velocity(:, :, :, :)       !! of control points, (n1, n2, n3, 3)
    real(wp), allocatable :: eqps(:, :, :, :, :, :)     !! (q1, q2, q3, e1, e2, e3)
    real(wp), allocatable :: stress(:, :, :, :, :, :, :)   !! (6, q1, q2, q3, e1, e2, e3)
    real(wp), allocatable :: state(:, :, :, :, :, :, :)    !! (n_state, q1, ..., e3) if n_state > 0
  end type patch_frame_t

contains

  !> The fields in the order of `patch_scalars`.
  pure function display_fields_of() result(fields)
    type(display_field_t) :: fields(6)

    fields = [ &
      display_field_t("eqps", "1", "equivalent plastic strain (NaN on tools)"), &
      display_field_t("mises", "stress", "von Mises stress (NaN on tools)"), &
      display_field_t("thickness", "length", "distance between both faces (NaN on tools)"), &
      display_field_t("thinning", "1", "loss of thickness over that at the start (NaN on tools)"), &
      display_field_t("major_strain", "1", &
                      "major logarithmic strain in the sheet's plane (NaN on tools)"), &
      display_field_t("minor_strain", "1", &
                      "minor logarithmic strain in the sheet's plane (NaN on tools)")]
  end function display_fields_of

  !> Places, displacements and velocities at the display points of a patch.
  pure subroutine patch_vectors(view, fields, points, displacement, velocity)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: fields
    real(wp), intent(out) :: points(:, :), displacement(:, :), velocity(:, :)   !! (n, 3)
    integer :: n_controls

    n_controls = size(view%solid%weights)
    points = display_vectors(view%grid, reshape(fields%points, [n_controls, 3]))
    displacement = display_vectors(view%grid, reshape(fields%points - view%solid%points, &
                                                      [n_controls, 3]))
    velocity = display_vectors(view%grid, reshape(fields%velocity, [n_controls, 3]))
  end subroutine patch_vectors

  !> The scalar fields at the display points of a patch, one a column.
  pure subroutine patch_scalars(view, fields, points, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: fields
    real(wp), intent(in) :: points(:, :)      !! display points now, (n, 3)
    real(wp), intent(out) :: values(:, :)     !! (n, number of fields)
    real(wp), allocatable :: state(:), strains(:, :)

    state = [point_grid(1, view%rule_size, view%grid%n_elements, fields%eqps)]
    values(:, 1) = display_scalars(view%grid, state)
    state = [point_grid(6, view%rule_size, view%grid%n_elements, fields%stress)]
    state = mises_stress(reshape(state, [6, size(state)/6]))
    values(:, 2) = display_scalars(view%grid, state)
    values(:, 3) = [display_thickness(view%grid, points)]
    values(:, 4) = 1.0_wp - values(:, 3)/view%thickness
    strains = plane_strains(view%geometry, reshape(fields%points, [size(view%solid%weights), 3]))
    values(:, 5) = display_scalars(view%grid, strains(1, :))
    values(:, 6) = display_scalars(view%grid, strains(2, :))
  end subroutine patch_scalars

end module display_fields
