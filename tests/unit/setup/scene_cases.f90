!> Small scenes that the tests of the model and of the solver share, and short ways to add to them.
module scene_cases
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, new_origin, n_errors
  use text, only: to_text
  use knot_vector, only: knot_vector_t, linear_axis
  use nurbs_solid, only: nurbs_solid_t, new_nurbs_solid
  use primitives, only: arc_t, box_solid, plane_surface, unit_arc
  use scene, only: scene_t, material_spec_t, curve_spec_t, tool_spec_t, motion_spec_t, &
                   contact_spec_t, set_spec_t, boundary_spec_t, initial_velocity_spec_t, &
                   load_spec_t, probe_spec_t
  use model, only: model_t
  use model_setup, only: build_model
  implicit none
  private

  public :: box_blank, box_scene, scene_of, model_of, messages
  public :: set_law, add_curve, add_set, add_face, add_boundary, add_load, add_initial_velocity
  public :: add_plate, add_probe, ring_solid

  real(wp), parameter, public :: density = 7.85e-9_wp, young = 2.1e5_wp   !! steel in mm, t, s

contains

  !> Box from the origin to `edges`, axes along x, y, z, equal elements.
  function box_blank(edges, degrees, n_elements) result(solid)
    real(wp), intent(in) :: edges(3)
    integer, intent(in) :: degrees(3), n_elements(3)
    type(nurbs_solid_t) :: solid
    type(error_t), allocatable :: error

    call box_solid(solid, [0.0_wp, 0.0_wp, 0.0_wp], edges, degrees, n_elements, &
                   [1.0_wp, 1.0_wp, 1.0_wp], [1, 2, 3], error)
    if (allocated(error)) error stop "the box of the test is wrong"
  end function box_blank

  !> Thick cylinder about z from the angle zero (x): xi runs with the angle, eta along z, zeta along
  !! the radius.
  function ring_solid(inner_radius, outer_radius, length, angle) result(solid)
    real(wp), intent(in) :: inner_radius, outer_radius, length, angle
    type(nurbs_solid_t) :: solid
    type(arc_t) :: arc
    type(knot_vector_t) :: straight
    type(error_t), allocatable :: error
    real(wp), allocatable :: points(:, :, :, :)

    arc = unit_arc(0.0_wp, angle)
    allocate (points(arc%axis%n_basis, 2, 2, 3))
    points(:, :, 1, :2) = inner_radius*spread(arc%points, 2, 2)
    points(:, :, 2, :2) = outer_radius*spread(arc%points, 2, 2)
    points(:, 1, :, 3) = 0.0_wp
    points(:, 2, :, 3) = length
    straight = linear_axis()
    call new_nurbs_solid(solid, [arc%axis, straight, straight], points, &
                         spread(spread(arc%weights, 2, 2), 3, 2), error)
    if (allocated(error)) error stop "the ring of the test is wrong"
  end function ring_solid

  !> A quadratic box of elastic steel (nu 0.3), with nothing else and without viscosity.
  function box_scene(edges, n_elements) result(scene)
    real(wp), intent(in) :: edges(3)
    integer, intent(in) :: n_elements(3)
    type(scene_t) :: scene

    scene = scene_of(box_blank(edges, [2, 2, 2], n_elements))
  end function box_scene

  !> A blank of elastic steel at rest with a full rule, for 1 us, with one row of history.
  function scene_of(solid) result(scene)
    type(nurbs_solid_t), intent(in) :: solid
    type(scene_t) :: scene

    scene%file = "test.key"
    scene%text = ""
    scene%heading = ""
    scene%units = ""
    allocate (scene%materials(1), scene%curves(0), scene%tools(0), scene%contacts(0))
    allocate (scene%sets(0), scene%boundaries(0), scene%initial_velocities(0), scene%loads(0))
    allocate (scene%beads(0), scene%initial_states(0), scene%fields(0))
    allocate (scene%probes(0), scene%motions(0))
    scene%materials(1) = material_spec_t("ELASTIC", density, young, 0.3_wp, [real(wp) ::], &
                                         name="steel", &
                                         origin=new_origin("test.key", 2, "*MATERIAL"))
    scene%blank%origin = new_origin("test.key", 1, "*BLANK")
    scene%blank%name = "sheet"
    allocate (scene%blank%patches(1))
    scene%blank%patches(1)%name = "sheet"
    scene%blank%patches(1)%solid = solid
    scene%blank%material = 1
    scene%blank%patches(1)%n_points = solid%axes%degree + 1
    scene%step%duration = 1.0e-6_wp
    scene%step%viscosity_linear = 0.0_wp
    scene%step%viscosity_quadratic = 0.0_wp
    scene%output%n_frames = 1
    scene%output%n_history = 1
  end function scene_of

  !> The model of a scene that must be without errors.
  function model_of(scene) result(model)
    type(scene_t), intent(in) :: scene
    type(model_t) :: model
    type(error_list_t) :: errors

    call build_model(scene, model, errors)
    if (n_errors(errors) == 0) return
    print "(a)", messages(errors)
    error stop "the scene of the test has errors"
  end function model_of

  !> All errors, one a line: keyword, line number, what was found, what was expected.
  function messages(errors) result(lines)
    type(error_list_t), intent(in) :: errors
    character(:), allocatable :: lines
    integer :: i

    lines = ""
    do i = 1, errors%n_items
      associate (reason => errors%items(i))
        if (i > 1) lines = lines//new_line("a")
        lines = lines//reason%origin%keyword//" "//to_text(reason%origin%line)//": "// &
                reason%found//"; "//reason%expected
      end associate
    end do
  end function messages

  !> Another law for the blank; a plastic one is named by its hardening.
  subroutine set_law(scene, law, poisson, constants)
    type(scene_t), intent(inout) :: scene
    character(*), intent(in) :: law
    real(wp), intent(in) :: poisson, constants(:)

    scene%materials(1)%law = law
    scene%materials(1)%poisson = poisson
    scene%materials(1)%constants = constants
    if (law == "VOCE") then
      scene%materials(1)%law = "PLASTIC"
      scene%materials(1)%plasticity%hardening = law
    end if
  end subroutine set_law

  !> Append a curve.
  subroutine add_curve(scene, times, values)
    type(scene_t), intent(inout) :: scene
    real(wp), intent(in) :: times(:), values(:)
    type(curve_spec_t) :: curve

    curve%times = times
    curve%values = values
    scene%curves = [scene%curves, curve]
  end subroutine add_curve

  !> Append a set with these bounds; its number.
  subroutine add_set(scene, lower, upper, set)
    type(scene_t), intent(inout) :: scene
    real(wp), intent(in) :: lower(3), upper(3)
    integer, intent(out) :: set
    type(set_spec_t) :: new

    set = size(scene%sets) + 1
    new%origin = new_origin("test.key", 20 + set, "*SET")
    new%name = "set "//to_text(set)
    new%lower = spread(lower, 2, size(scene%blank%patches))
    new%upper = spread(upper, 2, size(scene%blank%patches))
    scene%sets = [scene%sets, new]
  end subroutine add_set

  !> Append a set that is a face of a blank over [0, 1]; its number.
  subroutine add_face(scene, face, set)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: face   !! 1 xi_min, 2 xi_max, ... 6 zeta_max
    integer, intent(out) :: set
    real(wp) :: lower(3), upper(3)
    integer :: axis

    axis = (face + 1)/2
    lower = 0.0_wp
    upper = 1.0_wp
    if (mod(face, 2) == 1) upper(axis) = 0.0_wp
    if (mod(face, 2) == 0) lower(axis) = 1.0_wp
    call add_set(scene, lower, upper, set)
  end subroutine add_face

  !> Prescribe one velocity component on a set.
  subroutine add_boundary(scene, set, component, velocity, curve)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: set, component, curve
    real(wp), intent(in) :: velocity
    type(boundary_spec_t) :: new

    new%origin = new_origin("test.key", 40, "*BOUNDARY")
    new%set = set
    new%is_prescribed(component) = .true.
    new%velocity(component) = velocity
    new%curve = curve
    scene%boundaries = [scene%boundaries, new]
  end subroutine add_boundary

  !> Append a load.
  subroutine add_load(scene, kind, set, value, curve)
    type(scene_t), intent(inout) :: scene
    character(*), intent(in) :: kind
    integer, intent(in) :: set, curve
    real(wp), intent(in) :: value(3)
    type(load_spec_t) :: new

    new%origin = new_origin("test.key", 50, "*LOAD")
    new%kind = kind
    new%set = set
    new%value = value
    new%curve = curve
    scene%loads = [scene%loads, new]
  end subroutine add_load

  !> Append an initial velocity v + omega x (X - centre).
  subroutine add_initial_velocity(scene, set, velocity, omega, centre)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: set   !! 0: all
    real(wp), intent(in) :: velocity(3), omega(3), centre(3)
    type(initial_velocity_spec_t) :: new

    new%origin = new_origin("test.key", 60, "*INITIAL")
    new%set = set
    new%velocity = velocity
    new%omega = omega
    new%centre = centre
    scene%initial_velocities = [scene%initial_velocities, new]
  end subroutine add_initial_velocity

  !> Append a plane z = height that reaches far beyond the blank, in contact with its nearer face.
  subroutine add_plate(scene, name, height, side, velocity)
    type(scene_t), intent(inout) :: scene
    character(*), intent(in) :: name
    real(wp), intent(in) :: height, velocity(3)
    integer, intent(in) :: side   !! +1: the blank is above, -1: below
    type(tool_spec_t) :: tool
    type(motion_spec_t) :: motion
    type(contact_spec_t) :: pair
    type(error_t), allocatable :: error

    allocate (tool%surfaces(1))
    call plane_surface(tool%surfaces(1), [-100.0_wp, -100.0_wp, height], &
                       [300.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 300.0_wp, 0.0_wp], error)
    tool%origin = new_origin("test.key", 70, "*TOOL")
    tool%name = name
    tool%side = side
    scene%tools = [scene%tools, tool]
    motion%tool = size(scene%tools)
    motion%vector = velocity
    scene%motions = [scene%motions, motion]
    pair%origin = new_origin("test.key", 80, "*CONTACT PAIR")
    pair%tool = size(scene%tools)
    pair%points = "GAUSS"
    scene%contacts = [scene%contacts, pair]
  end subroutine add_plate

  !> Append a probe.
  subroutine add_probe(scene, xi)
    type(scene_t), intent(inout) :: scene
    real(wp), intent(in) :: xi(3)
    type(probe_spec_t) :: probe

    probe%name = "probe"
    probe%xi = xi
    scene%probes = [scene%probes, probe]
  end subroutine add_probe

end module scene_cases
