!> What a deck says, as plain data: the reader fills it, `model` is built from it.
!! Indices point into the lists of this module, 0 meaning none. Names keep the deck's spelling.
!! And what a named set means on one patch: control points, or a face.
module scene
  use kinds, only: wp
  use input_errors, only: origin_t
  use text, only: string_t
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: nurbs_solid_t
  use outline, only: polygon_t
  use law_spec, only: law_spec_t
  use knot_vector, only: knot_vector_t, greville
  implicit none
  private

  public :: is_user_material, explicit_time
  public :: origin_of_part
  public :: boxes_of, is_held, face_of_set

  !> A material: its law by a name.
  type, extends(law_spec_t), public :: material_spec_t
    type(origin_t) :: origin
    type(origin_t), allocatable :: parts(:)         !! of the keywords after *MATERIAL
    type(string_t), allocatable :: state_names(:)   !! of the first state variables; may be none
  end type material_spec_t

  !> State variables at the start of the elements whose centre lies in a set.
  type, public :: initial_state_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name       !! of the set
    integer :: set = 0
    real(wp), allocatable :: values(:)
  end type initial_state_spec_t

  !> A temperature or field variable of the control points of a set: value + gradient . x, x being
  !! their places at the start, times the curve.
  type, public :: field_spec_t
    type(origin_t) :: origin
    integer :: set = 0
    integer :: variable = 1                 !! 1: temperature, n + 1: field variable n
    real(wp) :: value = 0.0_wp, gradient(3) = 0.0_wp
    integer :: curve = 0                    !! index into `curves`, 0: constant
    integer :: first_step = 0               !! of the deck; 0: it is that at the start of the run
    integer :: last_step = huge(1)
  end type field_spec_t

  !> A patch of the blank.
  type, public :: patch_spec_t
    character(:), allocatable :: name
    type(nurbs_solid_t) :: solid            !! already refined
    integer :: n_points(3) = 0              !! Gauss points per part of an element and direction
    integer :: n_parts(3) = 1               !! equal parts of an element per direction: 2x3 has 2
    logical :: is_joined(6) = .false.       !! faces that lie on another face of the blank
  end type patch_spec_t

  !> The blank: its patches, what joins them, and its material.
  type, public :: blank_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name
    type(patch_spec_t), allocatable :: patches(:)
    real(wp) :: merge_distance = -1.0_wp    !! at which control points are one [length]; < 0: never
    integer :: material = 0                 !! index into `materials`
    logical :: is_shell = .false.           !! its elements are mid-surfaces, not solids
    logical :: has_hinges = .false.         !! where these meet they turn freely
    character(4) :: projection = "NONE"     !! against locking: NONE, BBAR or ANS
    logical :: is_smooth = .false.          !! it projects onto the splines of the patch
    integer :: n_samples(3) = 0             !! of the projection, per direction; 0: default
  end type blank_spec_t

  !> Closed curves, projected along an axis of space onto the sheet, and which side of them stays.
  type, public :: outline_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name
    integer :: step = 0                     !! at whose start it is cut, 0: before the run
    integer :: axis = 3                     !! of the projection: 1 x, 2 y, 3 z
    logical :: is_outside = .false.         !! what lies outside of them stays
    integer :: n_pieces = 1                 !! of the sheet after the cut
    logical :: is_flat = .false.            !! they lie on the sheet as it was before the run
    !> Corners by the two other coordinates: y z, z x or x y [length].
    type(polygon_t), allocatable :: polygons(:)
    type(origin_t), allocatable :: origins(:) !! of each polygon
    type(string_t), allocatable :: notes(:)   !! lines for the log
  end type outline_spec_t

  !> A value against time, linear between the rows and constant outside.
  type, public :: curve_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name
    real(wp), allocatable :: times(:), values(:)
    logical :: is_total = .false.           !! times since the start of the run, not of the step
    logical :: is_smooth = .false.          !! a quintic between the rows that is level at them
  end type curve_spec_t

  !> A rigid tool: surfaces in their place at the start, and the side of the sheet.
  type, public :: tool_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name
    type(nurbs_surface_t), allocatable :: surfaces(:)
    type(string_t), allocatable :: notes(:) !! lines for the log: what came from which file
    integer :: side = 0                     !! +1: the sheet lies on the side of xi x eta, -1: on
                                            !! the other; 0: where the blank is
    integer :: offset_of = 0                !! tool whose offset it is, index into `tools`; 0: none
    real(wp) :: placing(3) = 0.0_wp         !! direction to put it against the sheet; 0: not
    real(wp) :: clearance = 0.0_wp          !! smallest distance to the sheet then [length]
  end type tool_spec_t

  !> How a tool moves from the start of a step on, until motions of a later step for this tool.
  !! Motions of one step add up.
  type, public :: motion_spec_t
    type(origin_t) :: origin
    integer :: tool = 0                     !! index into `tools`
    integer :: step = 1
    logical :: is_displacement = .false.    !! the vector is a displacement, not a velocity
    logical :: is_rotation = .false.        !! it turns the tool: axis times angle [radians]
    real(wp) :: point(3) = 0.0_wp           !! of the axis [length]
    logical :: is_force = .false.           !! it is a force, along which the tool is free
    real(wp) :: vector(3) = 0.0_wp          !! velocity, displacement, force; scaled by the curve
    integer :: curve = 0                    !! index into `curves`, 0: constant
    real(wp) :: mass = 0.0_wp               !! of the tool that the force moves; 0: chosen
    real(wp) :: damping = 0.0_wp            !! of it, part of the critical on all contact springs
  end type motion_spec_t

  !> One tool against faces of the blank.
  type, public :: contact_spec_t
    type(origin_t) :: origin
    integer :: tool = 0                     !! index into `tools`
    integer :: face = 0                     !! 1 xi_min, 2 xi_max, ... 6 zeta_max; 0 automatic
    character(:), allocatable :: points     !! GAUSS, KNOT or GREVILLE
    integer :: n_points(2) = 0              !! Gauss points along an element, 0: p, at least 2
    real(wp) :: penalty_scale = 0.5_wp      !! s of k = s m/dt^2
    real(wp) :: stiffness = 0.0_wp          !! given instead, per area [stress/length]; 0: none
    real(wp) :: friction = 0.0_wp           !! coefficient of Coulomb friction; 0: none
    real(wp) :: damping = 0.0_wp            !! normal, part of the critical; 0: none
    real(wp) :: overhang = 0.0_wp           !! reach beyond the tool's border [length]
    logical :: is_corner_start = .false.    !! local search from the face corner, as the seed
    integer :: first_step = 1, last_step = huge(1)   !! while the tool is there
  end type contact_spec_t

  !> A box in the parameter space of each patch, cut with a box in space; a face is a box without
  !! height, and a patch outside of it has `lower` above `upper`.
  type, public :: box_spec_t
    real(wp), allocatable :: lower(:, :), upper(:, :)   !! of xi, eta, zeta, shape (3, n_patches)
    real(wp) :: from(3) = -huge(1.0_wp), to(3) = huge(1.0_wp)   !! bounds of x, y, z [length]
  end type box_spec_t

  !> A box with a name; or, with others, their union.
  type, extends(box_spec_t), public :: set_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name
    type(box_spec_t), allocatable :: others(:)
  end type set_spec_t

  !> Prescribed components of the control points of a set.
  type, public :: boundary_spec_t
    type(origin_t) :: origin
    integer :: set = 0
    character(8) :: word = ""               !! that the deck names them by, such as XSYMM
    logical :: is_prescribed(3) = .false.   !! which components
    real(wp) :: velocity(3) = 0.0_wp        !! of the prescribed components, scaled by the curve
    integer :: curve = 0
    integer :: first_step = 1, last_step = huge(1)   !! in force
  end type boundary_spec_t

  !> Velocity at the start: v + omega x (X - centre), for the control points of a set (0: all).
  type, public :: initial_velocity_spec_t
    type(origin_t) :: origin
    integer :: set = 0
    real(wp) :: velocity(3) = 0.0_wp, omega(3) = 0.0_wp, centre(3) = 0.0_wp
  end type initial_velocity_spec_t

  !> Pressure (on the current normal) or traction (fixed direction) on a face set, or gravity.
  type, public :: load_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: kind       !! PRESSURE, TRACTION or GRAVITY
    integer :: set = 0
    real(wp) :: value(3) = 0.0_wp           !! pressure in value(1), else a vector
    integer :: curve = 0
    integer :: first_step = 1, last_step = huge(1)   !! in force
  end type load_spec_t

  !> A draw bead on one of the large faces: forces per length of a polyline.
  type, public :: bead_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name
    integer :: face = 6
    real(wp) :: width = 0.0_wp              !! of the band along the line [length]
    real(wp) :: slip = 0.0_wp               !! way at which it gives in, 0: default [length]
    real(wp) :: restraint = 0.0_wp, hold_down = 0.0_wp   !! [force/length]
    integer :: curve = 0                    !! factor on the forces
    integer :: closing = 0                  !! tool whose way the curve runs over, 0: the time
    real(wp), allocatable :: line(:, :)     !! corners, (3, n) [length]
    integer :: given_step = 1               !! that names it: its curve begins there
    integer :: first_step = 1, last_step = huge(1)   !! while it acts
  end type bead_spec_t

  !> A point of the blank whose motion goes into the history.
  type, public :: probe_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name
    integer :: patch = 1                    !! index into the patches of the blank
    real(wp) :: xi(3) = 0.0_wp
  end type probe_spec_t

  !> A step, explicit or static.
  type, public :: step_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name       !! as *STEP has it; a deck without *STEP has none
    real(wp) :: duration = 0.0_wp
    logical :: is_static = .false.
    integer :: n_modes = 0                  !! frequencies, of a step that takes no time; 0: none
    real(wp) :: static_increment = 0.0_wp   !! the first of a static step [time]
    real(wp) :: least_increment = 0.0_wp, most_increment = 0.0_wp    !! its bounds
    real(wp) :: safety = 0.8_wp             !! fraction of the stable step
    real(wp) :: energy_limit = 0.2_wp       !! balance error that ends the run; 0: never
    real(wp) :: depth_warning = 0.1_wp      !! penetration, part of the thickness; 0: never
    real(wp) :: depth_limit = 0.5_wp        !! the same, that ends the run
    real(wp) :: viscosity_linear = 0.06_wp, viscosity_quadratic = 1.2_wp   !! 0, 0: none
    real(wp) :: viscosity_bending = 0.0_wp  !! of shells
    logical :: is_element_step = .false.    !! stable step from single elements
    real(wp) :: alpha = 0.0_wp              !! damping in proportion to the mass [1/time]; 0: none
    logical :: has_relaxation = .false.
    logical :: is_kinetic = .false.         !! relaxation by stops instead of critical damping
    real(wp) :: energy_residual = 1.0e-8_wp, force_residual = 1.0e-3_wp    !! that end relaxation
    real(wp) :: target_step = 0.0_wp        !! that uniform mass scaling gives [time]; 0: none
    real(wp) :: thickness_factor = 1.0_wp   !! on mass through the thickness; 1: none
  end type step_spec_t

  !> A uniform scene that is to run as a strip.
  type, public :: reduction_spec_t
    type(origin_t) :: origin
    integer :: component = -1               !! across the width, 1 x, 2 y, 3 z; 0: that which it is
                                            !! uniform along; negative: no reduction
    real(wp) :: width = 0.0_wp              !! of the strip, 0: that of an element [length]
    integer :: axis = 0                     !! of the blank across the strip, once it is cut
  end type reduction_spec_t

  !> What is written and how often.
  type, public :: output_spec_t
    type(origin_t) :: origin
    integer :: n_frames = 20                !! equal intervals of the end time
    integer :: n_history = 200
    logical :: is_bezier = .false.          !! Bezier cells instead of Lagrange cells
    logical :: has_pressure = .false.       !! contact pressure as a field
    logical :: has_wear = .false.           !! wear of the tools as well
    logical :: has_stress = .false.         !! stress tensor as a field
    logical :: is_surface = .false.         !! shells as their mid-surface
    logical :: has_resultants = .false.     !! forces and moments of shells as fields
  end type output_spec_t

  !> A step that follows others.
  type, public :: later_step_t
    type(step_spec_t) :: step
    type(output_spec_t) :: output
  end type later_step_t

  !> When the state of the run is saved.
  type, public :: checkpoint_spec_t
    integer :: n_steps = 0                  !! steps between two; 0: none
    real(wp) :: minutes = 15.0_wp           !! of the clock between two; 0: none
    integer :: number = 0                   !! over the run; 0: none
    real(wp) :: wall_minutes = 0.0_wp       !! after which the run stops; 0: never
    real(wp) :: retry = 0.0_wp              !! factor on the step for one more try; 0: none
    logical :: is_lasting = .false.         !! the end is saved too, and the file stays
  end type checkpoint_spec_t

  !> A test of one material point.
  type, public :: material_test_spec_t
    type(origin_t) :: origin
    character(:), allocatable :: name
    character(:), allocatable :: kind       !! UNIAXIAL, COMPRESSION, ... as *MATERIAL TEST has it
    integer :: material = 0                 !! index into `materials`
    real(wp) :: angle = 0.0_wp              !! axis 1 of the material to that of the test [degrees]
    logical :: is_plane = .false.           !! plane stress, as in shells
    integer :: n_increments = 100           !! of each leg
    real(wp) :: rate = 1.0_wp               !! of the leading strain [1/time]
    real(wp) :: strain = 0.0_wp             !! logarithmic; simple shear: gamma
    integer :: n_repeats = 1                !! cycles, angles or directions
    real(wp) :: threshold = 0.0_wp          !! plastic strain that counts as yielding
    real(wp) :: groove = 1.0_wp             !! FORMING LIMIT: its thickness over that of the sheet
    real(wp) :: step = 0.0_wp               !! and the increment of the major strain
    real(wp), allocatable :: limits(:, :)   !! LIMIT STRESS: minor and major strains, shape (2, n)
    logical :: is_stress(6) = .false.       !! PATH: components that are stresses
    real(wp), allocatable :: path(:, :)     !! PATH: time and six components, shape (7, corners)
    real(wp), allocatable :: state(:)       !! state variables at the start, the others being zero
    type(origin_t) :: state_origin          !! of the line that gives them
    type(string_t), allocatable :: state_names(:)   !! of the first of them; may be none
    real(wp), allocatable :: fields(:)      !! temperature, field variables; may be none
  end type material_test_spec_t

  !> All of a deck.
  type, public :: scene_t
    character(:), allocatable :: file       !! path of the deck
    type(string_t), allocatable :: files(:) !! paths of the deck and of all that it includes
    type(string_t), allocatable :: sums(:)  !! checksums of what was read from them
    character(:), allocatable :: text       !! the deck as read, for the provenance
    character(:), allocatable :: resolved   !! the deck as its readers see it, see `resolved_deck`
    character(:), allocatable :: digest     !! of what a run taken up again may not change
    character(:), allocatable :: heading, units
    type(material_spec_t), allocatable :: materials(:)
    type(blank_spec_t) :: blank
    type(outline_spec_t), allocatable :: outlines(:)   !! those of the blank first
    type(curve_spec_t), allocatable :: curves(:)
    type(tool_spec_t), allocatable :: tools(:)
    type(motion_spec_t), allocatable :: motions(:)
    type(contact_spec_t), allocatable :: contacts(:)
    type(set_spec_t), allocatable :: sets(:)
    type(boundary_spec_t), allocatable :: boundaries(:)
    type(initial_velocity_spec_t), allocatable :: initial_velocities(:)
    type(initial_state_spec_t), allocatable :: initial_states(:)
    type(field_spec_t), allocatable :: fields(:)   !! in the order of the deck
    type(load_spec_t), allocatable :: loads(:)
    type(bead_spec_t), allocatable :: beads(:)
    type(probe_spec_t), allocatable :: probes(:)
    type(material_test_spec_t), allocatable :: tests(:)
    type(step_spec_t) :: step               !! the first, or the only one
    type(output_spec_t) :: output           !! of it
    type(later_step_t), allocatable :: later_steps(:)
    type(reduction_spec_t) :: reduction
    real(wp) :: width_ratio = 1.0_wp        !! full width over that of the strip that runs for it
    type(checkpoint_spec_t) :: checkpoints
  end type scene_t

  real(wp), parameter :: tolerance = 1.0e-9_wp   ! of the length of an axis, of the size of a blank

contains

  !> Time of the explicit ones of some steps, the first and those after it.
  pure real(wp) function explicit_time(first, later) result(time)
    type(step_spec_t), intent(in) :: first
    type(later_step_t), intent(in) :: later(:)

    time = merge(0.0_wp, first%duration, first%is_static) &
           + sum(later%step%duration, mask=.not. later%step%is_static)
  end function explicit_time

  !> Is the law of this material a user's subroutine?
  elemental logical function is_user_material(material)
    type(material_spec_t), intent(in) :: material

    is_user_material = any(material%law == ["UMAT ", "VUMAT", "USER "])
  end function is_user_material

  !> Where a keyword of a material stands, such as *PLASTIC; *MATERIAL itself where there is none.
  pure function origin_of_part(material, keyword, number) result(origin)
    type(material_spec_t), intent(in) :: material
    character(*), intent(in) :: keyword
    integer, intent(in), optional :: number      !! which of several, the first if absent
    type(origin_t) :: origin
    integer :: i, n_before

    origin = material%origin
    if (.not. allocated(material%parts)) return
    n_before = 0
    if (present(number)) n_before = number - 1
    do i = 1, size(material%parts)
      if (material%parts(i)%keyword /= keyword) cycle
      origin = material%parts(i)
      if (n_before == 0) return
      n_before = n_before - 1
    end do
  end function origin_of_part

  !> All boxes of a set.
  pure function boxes_of(set) result(boxes)
    type(set_spec_t), intent(in) :: set
    type(box_spec_t), allocatable :: boxes(:)
    integer :: n

    n = 0
    if (allocated(set%others)) n = size(set%others)
    allocate (boxes(n + 1))
    boxes(1) = set%box_spec_t
    if (n > 0) boxes(2:) = set%others
  end function boxes_of

  !> Control points that a set holds.
  pure function is_held(solid, set, part) result(is_in)
    type(nurbs_solid_t), intent(in) :: solid
    type(set_spec_t), intent(in) :: set
    integer, intent(in) :: part              !! number of the patch
    logical, allocatable :: is_in(:, :, :)   !! shape (n1, n2, n3)
    integer :: i

    is_in = is_in_box(solid, set%box_spec_t, part)
    if (.not. allocated(set%others)) return
    do i = 1, size(set%others)
      is_in = is_in .or. is_in_box(solid, set%others(i), part)
    end do
  end function is_held

  !> Control points whose Greville abscissae and, where the box is bounded in space, whose positions
  !! at the start lie in the box. A mid-surface stands for all that lies across it.
  pure function is_in_box(solid, set, part) result(is_in)
    type(nurbs_solid_t), intent(in) :: solid
    type(box_spec_t), intent(in) :: set
    integer, intent(in) :: part              !! number of the patch
    logical, allocatable :: is_in(:, :, :)   !! shape (n1, n2, n3)
    logical, allocatable :: along(:)
    real(wp) :: slack
    integer :: axis, i

    associate (n => solid%axes%n_basis)
      allocate (is_in(n(1), n(2), n(3)), source=.true.)
    end associate
    do axis = 1, 3
      slack = tolerance*axis_length(solid%axes(axis))
      associate (xi => greville(solid%axes(axis)))
        along = xi >= set%lower(axis, part) - slack .and. xi <= set%upper(axis, part) + slack
        if (solid%axes(axis)%degree == 0) along = .true.
      end associate
      do i = 1, size(along)
        if (along(i)) cycle
        if (axis == 1) is_in(i, :, :) = .false.
        if (axis == 2) is_in(:, i, :) = .false.
        if (axis == 3) is_in(:, :, i) = .false.
      end do
    end do
    slack = tolerance*maxval(abs(solid%points))
    do axis = 1, 3
      is_in = is_in .and. solid%points(:, :, :, axis) >= set%from(axis) - slack &
              .and. solid%points(:, :, :, axis) <= set%to(axis) + slack
    end do
  end function is_in_box

  !> Face (1 xi_min to 6 zeta_max) of a patch that a set without height lies on; 0 where it is
  !! none or a union, or the patch has no part in the set.
  pure integer function face_of_set(solid, set, part) result(face)
    type(nurbs_solid_t), intent(in) :: solid
    type(set_spec_t), intent(in) :: set
    integer, intent(in) :: part   !! number of the patch
    integer :: axis
    real(wp) :: slack, low, high

    face = 0
    if (allocated(set%others)) return
    do axis = 1, 3
      associate (kv => solid%axes(axis))
        slack = tolerance*axis_length(kv)
        low = kv%knots(1)
        high = kv%knots(size(kv%knots))
      end associate
      if (set%upper(axis, part) <= low + slack) face = 2*axis - 1
      if (set%lower(axis, part) >= high - slack) face = 2*axis
    end do
    if (any(set%lower(:, part) > set%upper(:, part))) face = 0
  end function face_of_set

  pure real(wp) function axis_length(kv)
    type(knot_vector_t), intent(in) :: kv

    axis_length = kv%knots(size(kv%knots)) - kv%knots(1)
  end function axis_length

end module scene
