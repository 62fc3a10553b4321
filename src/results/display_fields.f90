!> The fields at the display points of a frame: one line in `display_fields_of` and one in
!! `fill_share` each.
module display_fields
  use kinds, only: wp
  use nurbs_solid, only: nurbs_solid_t, face_axes
  use surface_grid, only: surface_grid_t, grid_values
  use line_operator, only: joined_places
  use bezier_operator, only: equal_places
  use display_grid, only: display_grid_t, display_scalars, display_thickness, display_vectors, &
                          mises_stress, point_grid
  use point_geometry, only: plane_strains, point_geometry_t
  implicit none
  private

  public :: display_field_t, patch_view_t, patch_frame_t, face_field_t, tool_frame_t
  public :: display_fields_of, fill_share, add_face_fields, add_tool_fields

  !> Parts of the fields of a patch that do not need each other.
  integer, parameter, public :: n_shares = 6

  !> Name, quantity (as `unit_of` takes it) and meaning of a field.
  type :: display_field_t
    character(16) :: name
    character(8) :: quantity
    character(80) :: description
    integer :: n_components = 1
  end type display_field_t

  !> A patch of the blank in the file.
  type :: patch_view_t
    character(:), allocatable :: name
    type(nurbs_solid_t) :: solid                        !! at the start
    type(display_grid_t) :: grid
    type(point_geometry_t) :: geometry
    integer :: rule_size(3) = 0
    real(wp), allocatable :: thickness(:)               !! at the display points at the start
    !> Fields of the frame at hand at the integration points as `point_grid` orders them.
    real(wp), allocatable :: eqps(:), stress(:, :), strains(:, :)
  end type patch_view_t

  !> Contact pressure on a face of a patch, on the grid of its contact points.
  type :: face_field_t
    integer :: face = 0                      !! 1 xi_min, 2 xi_max, ... 6 zeta_max
    type(surface_grid_t) :: grid
    real(wp), allocatable :: pressure(:, :)  !! [stress]
  end type face_field_t

  !> Contact pressure and wear on a surface of a tool.
  type :: tool_frame_t
    integer :: tool = 0, surface = 0
    type(surface_grid_t) :: grid
    real(wp), allocatable :: pressure(:, :)  !! [stress]
    real(wp), allocatable :: wear(:, :)      !! [stress*length]; may be missing
  end type tool_frame_t

  !> A patch in one frame. Fields at integration points in element order; elements counted along
  !! each axis.
  type :: patch_frame_t
    real(wp), allocatable :: points(:, :, :, :)         !! control points, (n1, n2, n3, 3)
    real(wp), allocatable :: velocity(:, :, :, :)       !! of control points, (n1, n2, n3, 3)
    real(wp), allocatable :: eqps(:, :, :, :, :, :)     !! (q1, q2, q3, e1, e2, e3)
    real(wp), allocatable :: stress(:, :, :, :, :, :, :)   !! (6, q1, q2, q3, e1, e2, e3)
    real(wp), allocatable :: state(:, :, :, :, :, :, :)    !! (n_state, q1, ..., e3) if n_state > 0
    type(face_field_t), allocatable :: contacts(:)         !! may be missing
  end type patch_frame_t

contains

  !> The vectors, the scalars, then those of contact, of which there are none, one or two.
  pure function display_fields_of(n_contact) result(fields)
    integer, intent(in) :: n_contact
    type(display_field_t), allocatable :: fields(:)
    type(display_field_t) :: contact(2)

    contact = [ &
      display_field_t("contact_pressure", "stress", "pressure of contact"), &
      display_field_t("wear", "wear", "contact pressure times slip since the start (NaN on blank)")]
    fields = [ &
      display_field_t("displacement", "length", "displacement since the start", n_components=3), &
      display_field_t("velocity", "velocity", "velocity", n_components=3), &
      display_field_t("eqps", "1", "equivalent plastic strain (NaN on tools)"), &
      display_field_t("mises", "stress", "von Mises stress (NaN on tools)"), &
      display_field_t("thickness", "length", "distance between both faces (NaN on tools)"), &
      display_field_t("thinning", "1", "loss of thickness over that at the start (NaN on tools)"), &
      display_field_t("major_strain", "1", &
                      "major logarithmic strain in the sheet's plane (NaN on tools)"), &
      display_field_t("minor_strain", "1", &
                      "minor logarithmic strain in the sheet's plane (NaN on tools)"), &
      contact(:n_contact)]
  end function display_fields_of

  !> One share of the fields at the display points of a patch, in the order of `display_fields_of`
  !! but for contact. Threads may work different shares at once; the longest come first.
  subroutine fill_share(share, view, fields, points, values)
    integer, intent(in) :: share              !! 1 ... `n_shares`
    type(patch_view_t), intent(inout) :: view
    type(patch_frame_t), intent(in) :: fields
    real(wp), intent(inout) :: points(:, :)   !! places of the display points, (n, 3)
    real(wp), intent(inout) :: values(:, :)   !! (n, components of all fields)
    integer :: n_controls

    n_controls = size(view%solid%weights)
    select case (share)
    case (1)
      view%strains = plane_strains(view%geometry, reshape(fields%points, [n_controls, 3]))
      values(:, 11) = display_scalars(view%grid, view%strains(1, :))
      values(:, 12) = display_scalars(view%grid, view%strains(2, :))
    case (2)
      view%stress = reshape(point_grid(6, view%rule_size, view%grid%n_elements, fields%stress), &
                            [6, size(fields%eqps)])
      values(:, 8) = display_scalars(view%grid, mises_stress(view%stress))
    case (3)
      points = display_vectors(view%grid, reshape(fields%points, [n_controls, 3]))
      values(:, 9) = [display_thickness(view%grid, points)]
      values(:, 10) = 1.0_wp - values(:, 9)/view%thickness
    case (4)
      values(:, 1:3) = display_vectors(view%grid, reshape(fields%points - view%solid%points, &
                                                          [n_controls, 3]))
    case (5)
      values(:, 4:6) = display_vectors(view%grid, reshape(fields%velocity, [n_controls, 3]))
    case (6)
      view%eqps = [point_grid(1, view%rule_size, view%grid%n_elements, fields%eqps)]
      values(:, 7) = display_scalars(view%grid, view%eqps)
    end select
  end subroutine fill_share

  !> Add the pressures on the faces of a patch to a field that is zero elsewhere.
  pure subroutine add_face_fields(view, fields, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: fields
    real(wp), intent(inout) :: values(view%grid%n(1), view%grid%n(2), view%grid%n(3))
    real(wp), allocatable :: xi(:), eta(:), own(:, :)
    integer :: i, axes(2), layer

    if (.not. allocated(fields%contacts)) return
    do i = 1, size(fields%contacts)
      associate (contact => fields%contacts(i), solid => view%solid, n => view%grid%n, &
                 places => equal_places(view%grid%degree))
        axes = face_axes(contact%face)
        xi = joined_places(solid%axes(axes(1)), places)
        eta = joined_places(solid%axes(axes(2)), places)
        own = grid_values(contact%grid, contact%pressure, xi, eta)
        layer = merge(1, n((contact%face + 1)/2), mod(contact%face, 2) == 1)
        select case ((contact%face + 1)/2)
        case (1)
          values(layer, :, :) = values(layer, :, :) + own
        case (2)
          values(:, layer, :) = values(:, layer, :) + own
        case default
          values(:, :, layer) = values(:, :, layer) + own
        end select
      end associate
    end do
  end subroutine add_face_fields

  !> Add pressure and wear of one surface of a tool at the places of its mesh.
  pure subroutine add_tool_fields(field, xi, eta, values)
    type(tool_frame_t), intent(in) :: field
    real(wp), intent(in) :: xi(:), eta(:)     !! parameters of the display points
    real(wp), intent(inout) :: values(:, :)   !! (points of the mesh, fields of contact)

    values(:, 1) = values(:, 1) + [grid_values(field%grid, field%pressure, xi, eta)]
    if (size(values, 2) > 1) &
      values(:, 2) = values(:, 2) + [grid_values(field%grid, field%wear, xi, eta)]
  end subroutine add_tool_fields

end module display_fields
