!> The output fields of a frame. Each is an entry of `output_fields`: name, quantity, description,
!! components, and procedures that compute its values at the display points of the blank and of the
!! tools. Columns follow from the list.
module display_fields
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use kinds, only: wp
  use outline, only: region_t
  use nurbs_solid, only: nurbs_solid_t, face_axes
  use surface_grid, only: surface_grid_t, grid_values
  use line_operator, only: equal_positions, joined_positions
  use display_grid, only: display_grid_t, display_directors, display_scalars, &
                          display_surface_scalars, display_thickness, display_vectors, &
                          mises_stress, point_grid
  use point_geometry, only: cut_points, has_other_cut, plane_strains, point_geometry_t
  use tool_mesh, only: carried
  implicit none
  private

  public :: display_field_t, field_entry_t, patch_view_t, patch_frame_t, face_field_t, tool_frame_t
  public :: frame_t, tools_view_t
  public :: output_fields, add_entry, fields_of, first_columns, derive_part
  public :: add_edge_distance, distance_in_whole

  character(*), parameter, public :: edge_distance_name = "edge_distance"

  !> Parts of what `derive_part` derives of a frame, for threads; the longest comes first.
  integer, parameter, public :: n_derived_parts = 4

  !> A field in the file.
  type :: display_field_t
    character(24) :: name
    character(12) :: quantity                 !! as `unit_of` takes it
    character(112) :: description
    integer :: n_components = 1
    character(24) :: components = ""         !! their names, if they need any
  end type display_field_t

  !> A patch of the blank in the file.
  type :: patch_view_t
    character(:), allocatable :: name
    type(nurbs_solid_t) :: solid                        !! at the start
    type(display_grid_t) :: grid
    type(point_geometry_t) :: geometry                  !! of the cut in the frame at hand
    logical :: has_points = .false.                     !! this geometry is in the file
    integer :: rule_size(3) = 0
    real(wp), allocatable :: thickness(:)               !! at the display points at the start
    !> Derived from the frame at hand: coordinates of the display points, (n, 3), and fields at the
    !! integration points as `point_grid` orders them. Strains are those at the points of whole
    !! elements, which are exact at the display points; those at the points of cut elements follow.
    real(wp), allocatable :: positions(:, :), eqps(:), stress(:, :), strains(:, :), &
                             cut_strains(:, :)
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
    !> Of shells: N11 N22 N12 M11 M22 M12, (6, q1, q2, e1, e2); missing unless asked for.
    real(wp), allocatable :: resultants(:, :, :, :, :)
    type(face_field_t), allocatable :: contacts(:)         !! may be missing
    !> Of a sheet with an outline: how far inside the display points of a layer are, NaN where
    !! nothing is left of it [length]; may be missing.
    real(wp), allocatable :: edge_distance(:, :)
    type(region_t), allocatable :: regions(:)           !! that it leaves, in parameters; likewise
    real(wp), allocatable :: share(:, :)                !! of each element that it leaves; likewise
    !> Own coordinates of the points of elements that it cuts, as of `cut_points`; likewise.
    real(wp), allocatable :: places(:, :, :, :)
  end type patch_frame_t

  !> Where the display points of a surface of a tool are.
  type :: mesh_place_t
    integer :: tool = 0, surface = 0
    integer :: first = 0                     !! of its display points, among those of all tools
    real(wp), allocatable :: xi(:), eta(:)
  end type mesh_place_t

  !> Display points of the tools.
  type :: tools_view_t
    real(wp), allocatable :: points(:, :)    !! at the start, (n, 3)
    integer, allocatable :: tool_of_point(:)
    real(wp), allocatable :: edge_distance(:)      !! how far inside of trims, see `tool_mesh`
    type(mesh_place_t), allocatable :: meshes(:)   !! of the tools' surfaces
  end type tools_view_t

  !> One frame.
  type :: frame_t
    real(wp) :: time = 0.0_wp
    integer :: process_step = 1                         !! step of the deck
    type(patch_frame_t), allocatable :: patches(:)
    real(wp), allocatable :: tool_displacement(:, :)    !! (3, tools)
    real(wp), allocatable :: tool_velocity(:, :)        !! (3, tools)
    real(wp), allocatable :: tool_turn(:, :, :)         !! rotation less one, (3, 3, tools); may be
    real(wp), allocatable :: tool_turn_rate(:, :, :)    !! missing, as this: [1/time]
    type(tool_frame_t), allocatable :: tool_fields(:)   !! may be missing
    logical :: is_failed = .false.                      !! the state at which a run failed
  end type frame_t

  !> One or more fields that are computed together.
  type :: field_entry_t
    type(display_field_t), allocatable :: fields(:)
    procedure(patch_values), pointer, nopass :: on_patch => null()   !! none: NaN on the blank
    procedure(tool_values), pointer, nopass :: on_tools => null()    !! none: NaN on tools
  end type field_entry_t

  abstract interface
    !> Values at the display points of a patch, from the frame and what is derived from it.
    subroutine patch_values(view, frame, values)
      import :: patch_view_t, patch_frame_t, wp
      type(patch_view_t), intent(in) :: view
      type(patch_frame_t), intent(in) :: frame
      real(wp), intent(inout) :: values(:, :)   !! (n, components of all fields of the entry)
    end subroutine patch_values

    !> Values at the display points of all tools.
    subroutine tool_values(view, frame, values)
      import :: tools_view_t, frame_t, wp
      type(tools_view_t), intent(in) :: view
      type(frame_t), intent(in) :: frame
      real(wp), intent(inout) :: values(:, :)   !! (n, components of all fields of the entry)
    end subroutine tool_values
  end interface

contains

  !> All output fields in the order of the file. Threads start with the last entries: long ones come
  !! late.
  function output_fields(n_contact, has_stress, has_resultants, is_surface, has_outline, &
                         has_damage) result(entries)
    integer, intent(in) :: n_contact    !! contact fields: 0 none, 1 pressure, 2 and wear
    logical, intent(in) :: has_stress   !! stress tensor
    logical, intent(in), optional :: has_resultants   !! of shells
    logical, intent(in), optional :: is_surface       !! the mid-surface of shells is shown
    logical, intent(in), optional :: has_outline      !! of a sheet, or a tool is trimmed
    logical, intent(in), optional :: has_damage       !! the law has an indicator
    type(field_entry_t), allocatable :: entries(:)
    integer :: n_layers

    n_layers = 1
    if (present(is_surface)) n_layers = merge(3, 1, is_surface)
    call add_entry(entries, [display_field_t("displacement", "length", &
      "displacement since the start", n_components=3)], displacement_on_patch, &
      displacement_on_tools)
    call add_entry(entries, [display_field_t("velocity", "velocity", "velocity", &
      n_components=3)], velocity_on_patch, velocity_on_tools)
    call add_entry(entries, in_layers(n_layers, display_field_t("eqps", "1", &
      "equivalent plastic strain (NaN on tools)")), plastic_strain)
    call add_entry(entries, in_layers(n_layers, display_field_t("mises", "stress", &
      "von Mises stress (NaN on tools)")), von_mises_stress)
    call add_thickness(n_layers > 1, entries)
    call add_entry(entries, [in_layers(n_layers, display_field_t("major_strain", "1", &
      "major logarithmic strain in the sheet's plane (NaN on tools)")), &
      in_layers(n_layers, display_field_t("minor_strain", "1", &
      "minor logarithmic strain in the sheet's plane (NaN on tools)"))], sheet_strains)
    call add_contact(n_contact, n_layers > 1, entries)
    if (has_stress) call add_entry(entries, in_layers(n_layers, display_field_t("stress", &
      "stress", "Cauchy stress (NaN on tools)", n_components=6, &
      components="xx, yy, zz, xy, yz, xz")), stress_tensor)
    if (present(has_resultants)) then
      if (has_resultants) call add_entry(entries, resultant_fields(), resultants_on_patch)
    end if
    if (present(has_damage)) then
      if (has_damage) call add_entry(entries, in_layers(n_layers, display_field_t("damage", "1", &
        "damage indicator, fracture is expected at 1 (NaN on tools)")), damage_indicator)
    end if
    if (.not. present(has_outline)) return
    if (has_outline) call add_edge_distance(entries)
  end function output_fields

  !> How far inside of outlines and trims, the last field.
  subroutine add_edge_distance(entries)
    type(field_entry_t), allocatable, intent(inout) :: entries(:)

    call add_entry(entries, [display_field_t(edge_distance_name, "length", &
      "distance inside the outline of the sheet, or the trim of a tool, negative outside")], &
      edge_on_patch, edge_on_tools)
  end subroutine add_edge_distance

  !> It before a trim of the sheet, at the display points of a patch.
  pure real(wp) function distance_in_whole(view) result(distance)
    type(patch_view_t), intent(in) :: view
    integer :: c

    distance = norm2([(maxval(view%solid%points(:, :, :, c)) &
                       - minval(view%solid%points(:, :, :, c)), c=1, 3)])
  end function distance_in_whole

  !> Thickness and what follows from both faces.
  subroutine add_thickness(is_surface, entries)
    logical, intent(in) :: is_surface
    type(field_entry_t), allocatable, intent(inout) :: entries(:)
    type(display_field_t) :: fields(3)

    fields = [display_field_t("thickness", "length", &
      "distance between both faces (NaN on tools)"), display_field_t("thinning", "1", &
      "loss of thickness over that at the start (NaN on tools)"), display_field_t("normal", "1", &
      "unit vector from the bottom to the top face (NaN on tools)", n_components=3)]
    if (is_surface) then
      call add_entry(entries, fields, thickness_and_normal)
    else
      call add_entry(entries, fields(:2), thickness_and_thinning)
    end if
  end subroutine add_thickness

  !> Contact pressure and wear; on a surface, of both faces of the sheet apart from tools.
  subroutine add_contact(n, is_surface, entries)
    integer, intent(in) :: n            !! of the fields, as of `output_fields`
    logical, intent(in) :: is_surface
    type(field_entry_t), allocatable, intent(inout) :: entries(:)
    type(display_field_t) :: fields(2)

    if (n == 0) return
    fields = [display_field_t("contact_pressure", "stress", "pressure of contact"), &
      display_field_t("wear", "wear", "contact pressure times slip since the start (NaN on blank)")]
    if (is_surface) then
      call add_entry(entries, [display_field_t("contact_pressure_bottom", "stress", &
        "pressure of contact on the bottom face (NaN on tools)"), &
        display_field_t("contact_pressure_top", "stress", &
        "pressure of contact on the top face (NaN on tools)")], contact_on_faces)
      call add_entry(entries, fields(:n), on_tools=contact_on_tools)
    else
      call add_entry(entries, fields(:n), contact_on_patch, contact_on_tools)
    end if
  end subroutine add_contact

  !> A field, or one for each layer that a surface shows.
  pure function in_layers(n_layers, field) result(fields)
    integer, intent(in) :: n_layers           !! 1 or 3
    type(display_field_t), intent(in) :: field
    type(display_field_t) :: fields(n_layers)
    character(6), parameter :: layers(3) = [character(6) :: "bottom", "middle", "top"]
    integer :: i

    fields = field
    if (n_layers == 1) return
    do i = 1, n_layers
      fields(i)%name = trim(field%name)//"_"//layers(i)
      fields(i)%description = trim(layers(i))//": "//field%description
    end do
  end function in_layers

  !> Forces and moments per length in the mid-surface of shells.
  pure function resultant_fields() result(fields)
    type(display_field_t) :: fields(6)
    character(*), parameter :: ends(3) = [" along axis 1           ", " across axis 1          ", &
                                          " of shear and of torsion"]
    character(2), parameter :: places(3) = ["11", "22", "12"]
    integer :: i

    do i = 1, 3
      fields(i) = display_field_t("N"//places(i), "force/length", &
        "membrane force per length"//trim(ends(i))//" (NaN on tools)")
      fields(i + 3) = display_field_t("M"//places(i), "force", &
        "bending moment per length"//trim(ends(i))//", positive: tension on top (NaN on tools)")
    end do
  end function resultant_fields

  !> Append an entry to a list.
  subroutine add_entry(entries, fields, on_patch, on_tools)
    type(field_entry_t), allocatable, intent(inout) :: entries(:)
    type(display_field_t), intent(in) :: fields(:)       !! computed together
    procedure(patch_values), optional :: on_patch        !! absent: NaN on the blank
    procedure(tool_values), optional :: on_tools         !! absent: NaN on tools
    type(field_entry_t), allocatable :: longer(:)
    integer :: n

    n = 0
    if (allocated(entries)) n = size(entries)
    allocate (longer(n + 1))
    if (n > 0) longer(:n) = entries
    longer(n + 1)%fields = fields
    if (present(on_patch)) longer(n + 1)%on_patch => on_patch
    if (present(on_tools)) longer(n + 1)%on_tools => on_tools
    call move_alloc(longer, entries)
  end subroutine add_entry

  !> The fields of all entries.
  pure function fields_of(entries) result(fields)
    type(field_entry_t), intent(in) :: entries(:)
    type(display_field_t), allocatable :: fields(:)
    integer :: i

    allocate (fields(0))
    do i = 1, size(entries)
      fields = [fields, entries(i)%fields]
    end do
  end function fields_of

  !> First column of each entry, and after them the number of all columns plus one.
  pure function first_columns(entries) result(first)
    type(field_entry_t), intent(in) :: entries(:)
    integer :: first(size(entries) + 1)
    integer :: i

    first(1) = 1
    do i = 1, size(entries)
      first(i + 1) = first(i) + sum(entries(i)%fields%n_components)
    end do
  end function first_columns

  !> Derive one part of what entries and other datasets need of a frame.
  subroutine derive_part(part, view, frame)
    integer, intent(in) :: part                       !! 1 ... `n_derived_parts`
    type(patch_view_t), intent(inout) :: view
    type(patch_frame_t), intent(in) :: frame
    integer :: n_controls

    n_controls = size(view%solid%weights)
    select case (part)
    case (1)
      view%strains = plane_strains(view%geometry, .false., reshape(frame%points, &
                                                                   [n_controls, 3]))
      if (.not. allocated(frame%share)) return
      call follow_cut(view, frame)
      view%cut_strains = plane_strains(view%geometry, .true., reshape(frame%points, &
                                                                      [n_controls, 3]))
    case (2)
      view%stress = reshape(point_grid(6, view%rule_size, view%grid%n_elements, frame%stress), &
                            [6, size(frame%eqps)])
    case (3)
      view%positions = display_vectors(view%grid, reshape(frame%points, [n_controls, 3]))
    case (4)
      view%eqps = [point_grid(1, view%rule_size, view%grid%n_elements, frame%eqps)]
    end select
  end subroutine derive_part

  !> Take the points of a frame in which the sheet is cut otherwise than in that before.
  pure subroutine follow_cut(view, frame)
    type(patch_view_t), intent(inout) :: view
    type(patch_frame_t), intent(in) :: frame

    if (.not. has_other_cut(view%geometry, frame%share)) return
    call cut_points(view%solid, frame%share, frame%places, view%geometry)
    view%has_points = .false.
  end subroutine follow_cut

  subroutine displacement_on_patch(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values = display_vectors(view%grid, reshape(frame%points - view%solid%points, &
                                                [size(view%solid%weights), 3]))
  end subroutine displacement_on_patch

  subroutine displacement_on_tools(view, frame, values)
    type(tools_view_t), intent(in) :: view
    type(frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values = carried(view%points, view%tool_of_point, frame%tool_displacement, frame%tool_turn)
  end subroutine displacement_on_tools

  !> How far inside an outline, the same for all points of a column.
  subroutine edge_on_patch(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    if (.not. allocated(frame%edge_distance)) then
      values = distance_in_whole(view)
      return
    end if
    values(:, 1) = [spread(frame%edge_distance, 3, view%grid%n(3))]
  end subroutine edge_on_patch

  subroutine edge_on_tools(view, frame, values)
    type(tools_view_t), intent(in) :: view
    type(frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values(:, 1) = view%edge_distance
  end subroutine edge_on_tools

  subroutine velocity_on_patch(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values = display_vectors(view%grid, reshape(frame%velocity, [size(view%solid%weights), 3]))
  end subroutine velocity_on_patch

  subroutine velocity_on_tools(view, frame, values)
    type(tools_view_t), intent(in) :: view
    type(frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values = carried(view%points, view%tool_of_point, frame%tool_velocity, frame%tool_turn_rate)
  end subroutine velocity_on_tools

  subroutine plastic_strain(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values = reshape(display_scalars(view%grid, view%eqps), shape(values))
  end subroutine plastic_strain

  !> The last state variable of the law.
  subroutine damage_indicator(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)
    real(wp), allocatable :: at_points(:)

    at_points = [point_grid(1, view%rule_size, view%grid%n_elements, &
                            frame%state(size(frame%state, 1), :, :, :, :, :, :))]
    values = reshape(display_scalars(view%grid, at_points), shape(values))
  end subroutine damage_indicator

  subroutine von_mises_stress(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values = reshape(display_scalars(view%grid, mises_stress(view%stress)), shape(values))
  end subroutine von_mises_stress

  !> Components in VTK's order, which has yz before xz.
  subroutine stress_tensor(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)
    integer, parameter :: order(6) = [1, 2, 3, 4, 6, 5]   ! in 11, 22, 33, 12, 13, 23
    integer :: i

    do i = 1, 6
      values(:, i::6) = reshape(display_scalars(view%grid, view%stress(order(i), :)), &
                                [size(values, 1), size(values, 2)/6])
    end do
  end subroutine stress_tensor

  subroutine thickness_and_thinning(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values(:, 1) = [display_thickness(view%grid, view%positions)]
    values(:, 2) = 1.0_wp - values(:, 1)/view%thickness
  end subroutine thickness_and_thinning

  subroutine thickness_and_normal(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values(:, 3:) = display_directors(view%grid, frame%points)
    values(:, 1) = norm2(values(:, 3:), 2)
    values(:, 2) = 1.0_wp - values(:, 1)/view%thickness
    values(:, 3:) = values(:, 3:)/spread(values(:, 1), 2, 3)
  end subroutine thickness_and_normal

  subroutine sheet_strains(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)
    integer :: i, n

    n = size(values, 2)/2
    do i = 1, 2
      values(:, n*(i - 1) + 1:n*i) = reshape(display_scalars(view%grid, view%strains(i, :)), &
                                             [size(values, 1), n])
    end do
  end subroutine sheet_strains

  subroutine resultants_on_patch(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)
    real(wp), allocatable :: at_points(:, :)
    integer :: i, n(3)

    if (.not. allocated(frame%resultants)) return
    n = [view%rule_size(:2), 1]
    at_points = reshape(point_grid(6, n, [view%grid%n_elements(:2), 1], frame%resultants), &
                        [6, size(frame%resultants)/6])
    do i = 1, 6
      values(:, i) = [display_surface_scalars(view%grid, at_points(i, :))]
    end do
  end subroutine resultants_on_patch

  subroutine contact_on_patch(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values(:, 1) = 0.0_wp
    values(:, 2:) = ieee_value(1.0_wp, ieee_quiet_nan)
    call add_face_fields(view, frame, view%grid%n, values(:, 1))
  end subroutine contact_on_patch

  !> On both faces of a surface.
  subroutine contact_on_faces(view, frame, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)

    values = 0.0_wp
    call add_face_fields(view, frame, [view%grid%n(:2), 2], values)
  end subroutine contact_on_faces

  subroutine contact_on_tools(view, frame, values)
    type(tools_view_t), intent(in) :: view
    type(frame_t), intent(in) :: frame
    real(wp), intent(inout) :: values(:, :)
    integer :: f, m, last

    values = 0.0_wp
    if (.not. allocated(frame%tool_fields)) return
    do f = 1, size(frame%tool_fields)
      do m = 1, size(view%meshes)
        associate (mesh => view%meshes(m), field => frame%tool_fields(f))
          if (mesh%tool /= field%tool .or. mesh%surface /= field%surface) cycle
          last = mesh%first + size(mesh%xi)*size(mesh%eta) - 1
          associate (own => values(mesh%first:last, :))
            own(:, 1) = own(:, 1) + [grid_values(field%grid, field%pressure, mesh%xi, mesh%eta)]
            if (size(own, 2) > 1) &
              own(:, 2) = own(:, 2) + [grid_values(field%grid, field%wear, mesh%xi, mesh%eta)]
          end associate
        end associate
      end do
    end do
  end subroutine contact_on_tools

  !> Add the pressures on the faces of a patch to a field that is zero elsewhere.
  pure subroutine add_face_fields(view, fields, n, values)
    type(patch_view_t), intent(in) :: view
    type(patch_frame_t), intent(in) :: fields
    integer, intent(in) :: n(3)
    real(wp), intent(inout) :: values(n(1), n(2), n(3))
    real(wp), allocatable :: xi(:), eta(:), own(:, :)
    integer :: i, axes(2), layer

    if (.not. allocated(fields%contacts)) return
    do i = 1, size(fields%contacts)
      associate (contact => fields%contacts(i), solid => view%solid, &
                 positions => equal_positions(view%grid%degree))
        axes = face_axes(contact%face)
        xi = joined_positions(solid%axes(axes(1)), positions)
        eta = joined_positions(solid%axes(axes(2)), positions)
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

end module display_fields
