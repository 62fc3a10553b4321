!> A part of a body as the rest of the program sees it: a grid of control points with mass and
!! motion, integration points with stress and state, and the forces that deformation raises.
!!
!! Each kind of element extends `element_t` in a folder of its own and is listed in
!! `element_kinds`. Nobody else asks which kind an element is.
module element
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: string_t, to_text, append_text, counted
  use state_store, only: state_store_t, carry_field
  use ranks, only: ranks_t, traffic_t
  use parcel, only: parcel_t
  use row_shares, only: row_shares_t
  use gauss_rule, only: gauss_rule_t
  use nurbs_solid, only: nurbs_solid_t, solid_face, evaluate_solid
  use nurbs_surface, only: nurbs_surface_t
  use force_report, only: force_report_t, merge_reports
  use block_law, only: block_law_t
  use outline, only: region_t
  use outline_ties, only: outline_ties_t
  implicit none
  private

  public :: point_coordinates, next_element, grid_number
  public :: force_report_t, merge_reports
  public :: jacobian_in_span
  public :: carry_motion, stored_motion, new_nodal_fields, describe_grid, describe_outline
  public :: read_layer, add_to_layer

  !> Fields on the control points, shape (n1, n2, n3, 3).
  type, public :: motion_t
    real(wp), allocatable :: x(:, :, :, :)               !! position at the end of the step
    real(wp), allocatable :: v(:, :, :, :)               !! velocity at its middle
    real(wp), allocatable :: internal_force(:, :, :, :)
    real(wp), allocatable :: external_force(:, :, :, :)  !! contact and loads
    type(row_shares_t) :: rows                           !! that are moved here
  end type motion_t

  !> An element: base of all kinds. At a seam `mass` is what the part itself brings, so that sums
  !! over all parts count everything once; `inertia` is what a force there has to move.
  type, abstract, public :: element_t
    character(:), allocatable :: name
    type(nurbs_solid_t) :: grid                !! control grid and shape at the start
    type(gauss_rule_t) :: rule(3)              !! integration points of one element by axis
    integer :: n_elements(3) = 0               !! along each axis
    integer :: n_before = 0                    !! elements of the parts before, in numbers
    integer :: n_evaluated = 0                 !! points worked in a force evaluation
    real(wp) :: shortest = 0.0_wp              !! edge of all elements at the start [length]
    logical :: has_viscosity = .false.         !! bulk viscosity
    !> It is a surface without rotations of its own: faces 5 and 6 are nets that follow the
    !! control points; the other four sides are edges, and to fix a rotation there takes
    !! the next row of control points as well.
    logical :: is_surface = .false.
    !> Forces depend on control points beyond the elements of their own one.
    logical :: is_coupled = .false.
    integer :: reach = 0                       !! rows on which forces on a face depend, around one
    real(wp), allocatable :: mass(:, :, :)     !! lumped, of the control points
    real(wp), allocatable :: inertia(:, :, :)  !! the same, of all that is joined in a point
    !> Factors on the mass of differences through the thickness, (n1, n2); see `thickness_masses`.
    real(wp), allocatable :: column_factor(:, :)
    type(motion_t) :: motion
    logical :: can_be_cut = .false.            !! by outlines, see `trim`
    !> Of a sheet with an outline: what of it is there, in the parameters of axes 1 and 2, and the
    !! control points that follow others at its edge.
    type(region_t), allocatable :: regions(:)
    type(outline_ties_t) :: ties
    !> How far inside the outline the places are that divide each element equally by the highest
    !! degree of the grid: exact where it is cut, NaN where no element is left, (n, m) [length].
    real(wp), allocatable :: edge_distance(:, :)
    integer :: n_fields = 0                    !! temperature and field variables of the deck
    !> These at the control points, now and at the start of the run, (n1, n2, n3, n_fields).
    real(wp), allocatable, dimension(:, :, :, :) :: nodal, nodal_start
  contains
    procedure(forces_interface), deferred :: forces
    procedure(copy_interface), deferred :: elastic_copy
    procedure(single_interface), deferred :: single
    procedure(energy_interface), deferred :: elastic_energy
    procedure(element_interface), deferred :: read_element
    procedure(kernel_interface), deferred :: kernel_name
    ! These serve a kind that has no more to say on the matter.
    procedure :: trim => no_trim
    procedure :: trial_forces => forces_of_a_copy
    procedure :: end_forces => forces_ahead
    procedure :: n_stiffness_blocks => no_stiffness_blocks
    procedure :: block_stiffness => no_block_stiffness
    procedure :: read_points => read_elements
    procedure :: read_resultants => no_resultants
    procedure :: jacobian => jacobian_of_grid
    procedure :: place_along_sheet => place_of_rule
    procedure :: surface => surface_of_grid
    procedure :: body => grid_of_body
    procedure :: body_motion => motion_of_grid
    procedure :: look_at_faces => keep_faces
    procedure :: face_net => positions_of_side
    procedure :: face_velocities => velocities_of_side
    procedure :: add_face_forces => add_forces_to_side
    procedure :: carry => carry_motion
    procedure :: describe => describe_grid
    procedure :: n_stored => stored_motion
    procedure :: elements_of_block => element_of_number
    procedure :: scale_mass => scale_mass_alone
    procedure :: damping_ratio => no_damping
    procedure :: damp_bending => keep_bending
    procedure :: bending_lag => no_lag
    procedure :: bending_copy => copy_of_element
    procedure :: take_moduli => keep_moduli
    procedure :: tile_loads => no_tiles
    procedure :: tile_costs => no_costs
    procedure :: share_tiles => keep_tiles
    procedure :: work_all => keep_all
    procedure :: work_own => keep_all
    procedure :: rows_of_processes => all_rows
    procedure :: pass_shape => nothing_to_pass
    procedure :: join_rows => keep_all
    procedure :: pass_forces => nothing_to_pass
    procedure :: pass_report => nothing_to_report
    procedure :: finish_forces => forces_are_there
    procedure :: is_here => is_known
    procedure :: add_traffic => no_traffic
    procedure :: begin_step => keep_time
    procedure :: allow_viscosity => keep_viscosity
    procedure :: forget_faces => keep_no_faces
    procedure :: take_shape => keep_no_shape
    procedure :: set_state => no_state
    procedure :: size_of => no_size
    procedure :: new_fields => new_nodal_fields
    procedure :: spread_fields => keep_fields
    procedure :: fields_at => no_fields
    procedure, non_overridable :: is_own_face, can_touch, is_outside, places_of_cut
  end type element_t

  !> A part of a body, of any kind.
  type, public :: part_t
    class(element_t), allocatable :: element
  end type part_t

  abstract interface
    !> Stress update and internal forces of a step, from the motion. The result does not depend on
    !! the number of threads. A block that fails is reported, see `elements_of_block`.
    subroutine forces_interface(self, law, dt, report)
      import :: element_t, block_law_t, force_report_t, wp
      class(element_t), intent(inout) :: self
      class(block_law_t), intent(in) :: law
      real(wp), intent(in) :: dt                  !! [time]
      type(force_report_t), intent(out) :: report
    end subroutine forces_interface

    !> A copy without stress, state and viscosity, for small trial motions of an elastic law in any
    !! direction.
    subroutine copy_interface(self, copy)
      import :: element_t
      class(element_t), intent(in) :: self
      class(element_t), allocatable, intent(out) :: copy
    end subroutine copy_interface

    !> One element as a part of its own with its share of the mass, without stress and viscosity. A
    !! kind whose elements are coupled gives what comes nearest.
    subroutine single_interface(self, element, copy)
      import :: element_t
      class(element_t), intent(in) :: self
      integer, intent(in) :: element(3)
      class(element_t), allocatable, intent(out) :: copy
    end subroutine single_interface

    !> Elastic energy stored at the integration points: sum of s:C^-1:s/2 times their volume at the
    !! start.
    subroutine energy_interface(self, law, energy)
      import :: element_t, block_law_t, wp
      class(element_t), intent(inout) :: self
      class(block_law_t), intent(in) :: law
      real(wp), intent(out) :: energy
    end subroutine energy_interface

    !> Stress and state of the points of one element.
    pure subroutine element_interface(self, element, stress, state)
      import :: element_t, wp
      class(element_t), intent(in) :: self
      integer, intent(in) :: element(3)
      real(wp), intent(out) :: stress(:, :, :, :)      !! (6, q1, q2, q3)
      real(wp), intent(out) :: state(:, :, :, :)       !! (n, q1, q2, q3)
    end subroutine element_interface

    !> Name of the kernel that works the element.
    pure function kernel_interface(self) result(name)
      import :: element_t
      class(element_t), intent(in) :: self
      character(:), allocatable :: name
    end function kernel_interface
  end interface

contains

  !> A side of the element as contact and loads see it: 1 xi_min, 2 xi_max, ... 6 zeta_max.
  function surface_of_grid(self, side) result(surface)
    class(element_t), intent(in) :: self
    integer, intent(in) :: side
    type(nurbs_surface_t) :: surface

    surface = solid_face(self%grid, side)
  end function surface_of_grid

  !> The element as a solid at the start, as results show it.
  pure function grid_of_body(self) result(solid)
    class(element_t), intent(in) :: self
    type(nurbs_solid_t) :: solid

    solid = self%grid
  end function grid_of_body

  !> Positions and velocities of the control points of that solid now.
  subroutine motion_of_grid(self, x, v)
    class(element_t), intent(in) :: self
    real(wp), allocatable, intent(inout) :: x(:, :, :, :), v(:, :, :, :)   !! (n1, n2, n3, 3)

    x = self%motion%x
    v = self%motion%v
  end subroutine motion_of_grid

  !> Is a side a net of its own, and no layer of the control points?
  pure logical function is_own_face(self, side)
    class(element_t), intent(in) :: self
    integer, intent(in) :: side

    is_own_face = self%is_surface .and. side >= 1 .and. side <= 6
  end function is_own_face

  !> Is a side a surface that tools can touch, and no edge?
  pure logical function can_touch(self, side)
    class(element_t), intent(in) :: self
    integer, intent(in) :: side

    can_touch = side > 4 .or. .not. self%is_surface
  end function can_touch

  !> Take the shape of the faces now, if that has not been done: what follows is quicker for it, and
  !! forces on faces of their own need it.
  subroutine keep_faces(self)
    class(element_t), intent(inout) :: self
  end subroutine keep_faces

  !> Control points of a side now.
  subroutine positions_of_side(self, side, net)
    class(element_t), intent(in) :: self
    integer, intent(in) :: side
    real(wp), intent(out) :: net(:, :, :)       !! shape (n, m, 3) of `surface` [length]

    call read_layer(self%motion%x, side, net)
  end subroutine positions_of_side

  !> Velocities of the control points of a side.
  subroutine velocities_of_side(self, side, net)
    class(element_t), intent(in) :: self
    integer, intent(in) :: side
    real(wp), intent(out) :: net(:, :, :)       !! [length/time]

    call read_layer(self%motion%v, side, net)
  end subroutine velocities_of_side

  !> Add forces on the control points of a side to the external forces.
  subroutine add_forces_to_side(self, side, forces)
    class(element_t), intent(inout) :: self
    integer, intent(in) :: side
    real(wp), intent(in) :: forces(:, :, :)     !! [force]

    call add_to_layer(self%motion%external_force, side, forces)
  end subroutine add_forces_to_side

  !> No bulk viscosity, or that of the element again.
  pure subroutine keep_viscosity(self, is_allowed)
    class(element_t), intent(inout) :: self
    logical, intent(in) :: is_allowed
  end subroutine keep_viscosity

  !> Forces on the faces come anew; where nothing presses any more, the normal stress is gone too.
  subroutine keep_no_faces(self, is_pressed)
    class(element_t), intent(inout) :: self
    logical, intent(in) :: is_pressed
  end subroutine keep_no_faces

  !> Strains of the next evaluation count from the present positions. Elements that find them from
  !! positions and velocities keep no shape.
  subroutine keep_no_shape(self)
    class(element_t), intent(inout) :: self
  end subroutine keep_no_shape

  !> Add to the outermost layer of a field at a side.
  pure subroutine add_to_layer(field, side, net)
    real(wp), intent(inout) :: field(:, :, :, :)
    integer, intent(in) :: side
    real(wp), intent(in) :: net(:, :, :)

    associate (layer => merge(1, size(field, (side + 1)/2), mod(side, 2) == 1))
      select case ((side + 1)/2)
      case (1)
        field(layer, :, :, :) = field(layer, :, :, :) + net
      case (2)
        field(:, layer, :, :) = field(:, layer, :, :) + net
      case (3)
        field(:, :, layer, :) = field(:, :, layer, :) + net
      end select
    end associate
  end subroutine add_to_layer

  !> The outermost layer of a field at a side.
  pure subroutine read_layer(field, side, net)
    real(wp), intent(in) :: field(:, :, :, :)
    integer, intent(in) :: side
    real(wp), intent(out) :: net(:, :, :)

    associate (layer => merge(1, size(field, (side + 1)/2), mod(side, 2) == 1))
      select case ((side + 1)/2)
      case (1)
        net = field(layer, :, :, :)
      case (2)
        net = field(:, layer, :, :)
      case (3)
        net = field(:, :, layer, :)
      end select
    end associate
  end subroutine read_layer

  !> Internal forces of a trial motion: those of `forces`, but stress, state and time stay as they
  !! are.
  subroutine forces_of_a_copy(self, law, dt, report)
    class(element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                  !! [time]
    type(force_report_t), intent(out) :: report
    class(element_t), allocatable :: trial

    allocate (trial, source=self)
    call trial%forces(law, dt, report)
    call move_alloc(trial%motion%internal_force, self%motion%internal_force)
  end subroutine forces_of_a_copy

  !> Internal forces of a trial motion at its end, to which the velocities lead from here.
  subroutine forces_ahead(self, law, dt, report)
    class(element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                  !! [time]
    type(force_report_t), intent(out) :: report
    real(wp), allocatable :: x(:, :, :, :)

    x = self%motion%x
    self%motion%x = x + dt*self%motion%v
    call self%trial_forces(law, dt, report)
    call move_alloc(x, self%motion%x)
  end subroutine forces_ahead

  !> Blocks of elements whose stiffness `block_stiffness` finds; 0: differences of all forces of the
  !! part do it.
  pure integer function no_stiffness_blocks(self) result(n)
    class(element_t), intent(in) :: self

    n = 0
  end function no_stiffness_blocks

  !> Stiffness of the elements of blocks, eight each: how the internal forces at the end of a trial
  !! motion change with displacements. Rows and columns are components of the control points of an
  !! element, axis 1 of the grid first and the component last.
  subroutine no_block_stiffness(self, law, dt, amount, first, elements, matrices)
    class(element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                     !! of the motion [time]
    real(wp), intent(in) :: amount                 !! displacement of the differences [length]
    integer, intent(in) :: first                   !! block; as many follow as there is room
    integer, intent(out) :: elements(:, :, :)      !! (3, 8, blocks), 0: not to be counted
    real(wp), intent(out) :: matrices(:, :, :, :)  !! (8, m, m, blocks) [force/length]

    elements = 0
    matrices = 0.0_wp
  end subroutine no_block_stiffness

  !> Equivalent plastic strain, stress and state of all points, along axes 1, 2, 3 within an element
  !! and then over the elements.
  subroutine read_elements(self, eqps_state, eqps, stress, state)
    class(element_t), intent(in) :: self
    integer, intent(in) :: eqps_state           !! state variable, 0: there is none
    real(wp), intent(inout) :: eqps(:, :, :, :, :, :)
    real(wp), intent(inout) :: stress(:, :, :, :, :, :, :)   !! 6 components first
    real(wp), intent(inout) :: state(:, :, :, :, :, :, :)    !! the first variables first
    real(wp), allocatable :: own_stress(:, :, :, :), own_state(:, :, :, :)
    integer :: i, e(3)

    associate (q => self%rule%n)
      allocate (own_stress(6, q(1), q(2), q(3)))
      allocate (own_state(max(size(state, 1), eqps_state), q(1), q(2), q(3)))
    end associate
    e = [0, 1, 1]
    do i = 1, product(self%n_elements)
      call next_element(self%n_elements, e)
      call self%read_element(e, own_stress, own_state)
      stress(:, :, :, :, e(1), e(2), e(3)) = own_stress(:size(stress, 1), :, :, :)
      state(:, :, :, :, e(1), e(2), e(3)) = own_state(:size(state, 1), :, :, :)
      if (eqps_state > 0) eqps(:, :, :, e(1), e(2), e(3)) = own_state(eqps_state, :, :, :)
    end do
  end subroutine read_elements

  !> Forces and moments per length of the points along a shell, N11 N22 N12 M11 M22 M12: axis 1 of
  !! the point lies along that of the grid, axis 2 across it in the surface.
  subroutine no_resultants(self, resultants)
    class(element_t), intent(in) :: self
    real(wp), intent(out) :: resultants(:, :, :, :, :)   !! (6, q1, q2, e1, e2)

    resultants = 0.0_wp
  end subroutine no_resultants

  !> Jacobian by element-local coordinates, and position, of an integration point.
  pure subroutine jacobian_of_grid(self, grid, element, point, j, x)
    class(element_t), intent(in) :: self
    type(nurbs_solid_t), intent(in) :: grid     !! that of the element, in any shape
    integer, intent(in) :: element(3), point(3)
    real(wp), intent(out) :: j(3, 3), x(3)      !! [length]
    integer :: axis, span(3)

    span = [(span_of(grid%axes(axis)%knots, grid%axes(axis)%degree, element(axis)), axis=1, 3)]
    call jacobian_in_span(grid, span, [self%place_along_sheet(element, point), &
                                       self%rule(3)%points(point(3))], j, x)
  end subroutine jacobian_of_grid

  !> Coordinates along axes 1 and 2 of an integration point in its element, from -1 to 1.
  pure function place_of_rule(self, element, point) result(place)
    class(element_t), intent(in) :: self
    integer, intent(in) :: element(3), point(3)
    real(wp) :: place(2)

    place = [self%rule(1)%points(point(1)), self%rule(2)%points(point(2))]
  end function place_of_rule

  !> The same of all points of the elements that an outline cuts: (2, q1, q2, elements), elements
  !! along axis 1 first.
  pure function places_of_cut(self) result(places)
    class(element_t), intent(in) :: self       !! with an outline
    real(wp), allocatable :: places(:, :, :, :)
    integer :: c, i, j, e(3)

    associate (share => self%ties%share, q => self%rule%n)
      allocate (places(2, q(1), q(2), count(share > 0.0_wp .and. share < 1.0_wp)))
      c = 0
      e = [0, 1, 1]
      do while (c < size(places, 4))
        call next_element(self%n_elements, e)
        if (share(e(1), e(2)) <= 0.0_wp .or. share(e(1), e(2)) >= 1.0_wp) cycle
        c = c + 1
        do j = 1, q(2)
          do i = 1, q(1)
            places(:, i, j, c) = self%place_along_sheet(e, [i, j, 1])
          end do
        end do
      end do
    end associate
  end function places_of_cut

  !> Jacobian by element-local coordinates, and place, in the element between the knots `span` and
  !! `span + 1`.
  pure subroutine jacobian_in_span(grid, span, local, j, x)
    type(nurbs_solid_t), intent(in) :: grid
    integer, intent(in) :: span(3)
    real(wp), intent(in) :: local(3)            !! from -1 to 1
    real(wp), intent(out) :: j(3, 3), x(3)      !! [length]
    real(wp) :: xi(3), half(3)
    integer :: axis

    do axis = 1, 3
      associate (knots => grid%axes(axis)%knots, s => span(axis))
        half(axis) = 0.5_wp*(knots(s + 1) - knots(s))
        xi(axis) = knots(s) + half(axis)*(1.0_wp + local(axis))
      end associate
    end do
    call evaluate_solid(grid, xi, x, j)
    do axis = 1, 3
      j(:, axis) = half(axis)*j(:, axis)
    end do
  end subroutine jacobian_in_span

  !> Motion into a store, or back. A kind with stress or state carries these too.
  subroutine carry_motion(self, store)
    class(element_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    associate (motion => self%motion)
      call carry_field(store, "x", size(motion%x), motion%x)
      call carry_field(store, "v", size(motion%v), motion%v)
      call carry_field(store, "internal_force", size(motion%x), motion%internal_force)
      call carry_field(store, "external_force", size(motion%x), motion%external_force)
    end associate
  end subroutine carry_motion

  !> Append lines `heading value` that describe the element for `--check`: elements, degrees,
  !! control points and integration points, with the kernel.
  subroutine describe_grid(self, lines)
    class(element_t), intent(in) :: self
    type(string_t), allocatable, intent(inout) :: lines(:)
    integer :: q(3)

    q = self%rule%n
    associate (n => self%n_elements)
      call append_text(lines, "elements         "//to_text(product(n))//" ("//triple(n)//")")
    end associate
    call append_text(lines, "degrees          "//triple(self%grid%axes%degree))
    call append_text(lines, "control points   "//to_text(size(self%grid%weights)))
    call append_text(lines, "points           "//to_text(product(q))//" an element ("// &
                            triple(q)//"), kernel "//self%kernel_name())
  end subroutine describe_grid

  !> One more line for a sheet with an outline.
  subroutine describe_outline(self, lines)
    class(element_t), intent(in) :: self
    type(string_t), allocatable, intent(inout) :: lines(:)

    if (.not. allocated(self%ties%share)) return
    associate (share => self%ties%share)
      call append_text(lines, "outline          "//counted(count(share > 0.0_wp), "element")// &
        " inside, "//to_text(count(share > 0.0_wp .and. share < 1.0_wp))//" of them cut; "// &
        counted(self%ties%n, "control point")//" at the edge without motion of their own")
    end associate
  end subroutine describe_outline

  pure function triple(n) result(text)
    integer, intent(in) :: n(3)
    character(:), allocatable :: text

    text = to_text(n(1))//" x "//to_text(n(2))
    if (n(3) > 0) text = text//" x "//to_text(n(3))
  end function triple

  !> Numbers that the element keeps in memory for good: here those of the motion, the mass and the
  !! inertia.
  pure real(wp) function stored_motion(self) result(n)
    class(element_t), intent(in) :: self

    n = 4.0_wp*size(self%motion%x) + 2.0_wp*size(self%mass)
  end function stored_motion

  !> Elements that a block of a force report holds, shape (3, n): here a block is an element.
  pure function element_of_number(self, block) result(elements)
    class(element_t), intent(in) :: self
    integer, intent(in) :: block
    integer, allocatable :: elements(:, :)

    associate (n => self%n_elements)
      elements = reshape([mod(block - 1, n(1)) + 1, mod((block - 1)/n(1), n(2)) + 1, &
                          (block - 1)/(n(1)*n(2)) + 1], [3, 1])
    end associate
  end function element_of_number

  !> Keep what lies in these regions as well as in those before, where `can_be_cut` says so. Mass,
  !! stress and state of what stays are kept; the inertia of all parts is to be set anew.
  subroutine no_trim(self, regions, law, error)
    class(element_t), intent(inout) :: self
    type(region_t), intent(in) :: regions(:)       !! in the parameters of axes 1 and 2
    class(block_law_t), intent(in) :: law
    type(error_t), allocatable, intent(out) :: error

    call fail(error, "an outline of elements that cannot be cut")
  end subroutine no_trim

  !> Does an element lie outside of the outline?
  pure logical function is_outside(self, element)
    class(element_t), intent(in) :: self
    integer, intent(in) :: element(3)

    is_outside = .false.
    if (allocated(self%ties%share)) is_outside = self%ties%share(element(1), element(2)) <= 0.0_wp
  end function is_outside

  !> Raise all masses by a factor. A kind with viscosity takes that of the heavier material, so that
  !! the damping ratios stay and the stable step grows with the root of the factor.
  subroutine scale_mass_alone(self, factor)
    class(element_t), intent(inout) :: self
    real(wp), intent(in) :: factor

    self%mass = self%mass*factor
  end subroutine scale_mass_alone

  !> Largest damping ratio of the linear bulk viscosity, from the largest angular frequency and that
  !! of the bulk part of the stiffness alone.
  pure real(wp) function no_damping(self, law, omega, omega_bulk) result(ratio)
    class(element_t), intent(in) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: omega, omega_bulk   !! [1/time]

    ratio = 0.0_wp
  end function no_damping

  !> Take a viscosity of bending, as a damping ratio of about the shortest bending wave; before any
  !! motion. A kind that does not bend by itself has none.
  subroutine keep_bending(self, factor)
    class(element_t), intent(inout) :: self
    real(wp), intent(in) :: factor
  end subroutine keep_bending

  !> A time [time]: the viscosity of bending over it is the stiffness of the copy below; 0 where
  !! there is none. Of several parts the shortest serves all.
  pure real(wp) function no_lag(self, law) result(lag)
    class(element_t), intent(in) :: self
    class(block_law_t), intent(in) :: law

    lag = 0.0_wp
  end function no_lag

  !> A copy whose stiffness for changes of curvature, with the bulk part of the law alone, is the
  !! viscosity of bending over a time; it has hardly any other.
  subroutine copy_of_element(self, law, lag, copy)
    class(element_t), intent(in) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: lag
    class(element_t), allocatable, intent(out) :: copy

    allocate (copy, source=self)
  end subroutine copy_of_element

  !> Take the elastic moduli of a law that has found them late.
  subroutine keep_moduli(self, law)
    class(element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
  end subroutine keep_moduli

  !> Elements of each tile, which processes can share; none: each of them works all.
  pure function no_tiles(self) result(loads)
    class(element_t), intent(in) :: self
    real(wp), allocatable :: loads(:)

    allocate (loads(0))
  end function no_tiles

  !> Time that each tile has taken here since it was shared, with that of other work that goes with
  !! the rows of control points that it is the first to touch; none: it is not known.
  pure function no_costs(self, row_costs) result(costs)
    class(element_t), intent(in) :: self
    real(wp), intent(in) :: row_costs(:)           !! of the first rows; of the rest none
    real(wp), allocatable :: costs(:)

    allocate (costs(0))
  end function no_costs

  !> Does this process hold the state of an element?
  pure logical function is_known(self, element)
    class(element_t), intent(in) :: self
    integer, intent(in) :: element(3)

    is_known = .true.
  end function is_known

  !> Add what passed between processes for the forces of the element.
  pure subroutine no_traffic(self, traffic)
    class(element_t), intent(in) :: self
    type(traffic_t), intent(inout) :: traffic
  end subroutine no_traffic

  !> Work but the own share of the tiles from now on, given the last tile of each process.
  subroutine keep_tiles(self, ranks, last)
    class(element_t), intent(inout) :: self
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: last(:)
  end subroutine keep_tiles

  !> Work all tiles again, as the other processes do: the state of all points must be there. Or go
  !! on with the own share of them. Or know what a kind keeps of control points, of all rows, where
  !! each process has that of its own ones and the motion of all.
  subroutine keep_all(self)
    class(element_t), intent(inout) :: self
  end subroutine keep_all

  !> Rows of control points, along axis 2, where processes may move but some of them: the last own
  !! one of each process, first and last row that its tiles touch, (2, processes), and how many
  !! numbers they report. Not allocated: each moves all.
  subroutine all_rows(self, last_of, moved_by, n_reported)
    class(element_t), intent(inout) :: self
    integer, allocatable, intent(out) :: last_of(:), moved_by(:, :), n_reported(:)
  end subroutine all_rows

  !> Where processes move but some of the rows, `forces` leaves those of the tiles as they are until
  !! `finish_forces`. In between, what a partner has to know of the own tiles goes into a parcel for
  !! it, and comes out of its own: `pass_shape` what the faces need, `pass_forces` the rest.
  subroutine nothing_to_pass(self, partner, is_sent, parcel)
    class(element_t), intent(inout) :: self
    integer, intent(in) :: partner              !! number of the process
    logical, intent(in) :: is_sent              !! to it; or received
    type(parcel_t), intent(inout) :: parcel     !! the next values in it
  end subroutine nothing_to_pass

  !> The same of what all have to know: the reports of the tiles of a process, which only itself
  !! sends.
  subroutine nothing_to_report(self, process, is_sent, parcel)
    class(element_t), intent(inout) :: self
    integer, intent(in) :: process              !! its number
    logical, intent(in) :: is_sent
    type(parcel_t), intent(inout) :: parcel
  end subroutine nothing_to_report

  !> Forces and reports of all tiles are there: add them up. Elsewhere that has been done.
  subroutine forces_are_there(self, report)
    class(element_t), intent(inout) :: self
    type(force_report_t), intent(inout) :: report
  end subroutine forces_are_there

  !> A step of the deck begins.
  pure subroutine keep_time(self, step, time)
    class(element_t), intent(inout) :: self
    integer, intent(in) :: step
    real(wp), intent(in) :: time
  end subroutine keep_time

  !> Set the first state variables of a point.
  pure subroutine no_state(self, element, point, values)
    class(element_t), intent(inout) :: self
    integer, intent(in) :: element(3), point(3)
    real(wp), intent(in) :: values(:)
  end subroutine no_state

  !> Cube root of the volume of an element at the start; only for laws that need the context of
  !! their points, as are the fields below.
  pure real(wp) function no_size(self, element) result(size_of)
    class(element_t), intent(in) :: self
    integer, intent(in) :: element(3)

    size_of = 0.0_wp
  end function no_size

  !> Room for temperature and field variables, all zero.
  subroutine new_nodal_fields(self, n)
    class(element_t), intent(inout) :: self
    integer, intent(in) :: n

    self%n_fields = n
    associate (points => shape(self%mass))
      allocate (self%nodal(points(1), points(2), points(3), n), source=0.0_wp)
      allocate (self%nodal_start, source=self%nodal)
    end associate
  end subroutine new_nodal_fields

  !> Carry the fields from the control points, whose values are those of the end of the step to
  !! come, to the integration points.
  subroutine keep_fields(self)
    class(element_t), intent(inout) :: self
  end subroutine keep_fields

  !> Temperature and field variables of a point at the start of the step.
  pure function no_fields(self, element, point) result(values)
    class(element_t), intent(in) :: self
    integer, intent(in) :: element(3), point(3)
    real(wp) :: values(self%n_fields)

    values = 0.0_wp
  end function no_fields

  !> Parametric coordinates of a place in an element whose own coordinates run from -1 to 1.
  pure function point_coordinates(element, e, local) result(xi)
    class(element_t), intent(in) :: element
    integer, intent(in) :: e(3)
    real(wp), intent(in) :: local(3)
    real(wp) :: xi(3)
    integer :: axis, span

    do axis = 1, 3
      associate (kv => element%grid%axes(axis))
        span = span_of(kv%knots, kv%degree, e(axis))
        xi(axis) = 0.5_wp*((1.0_wp - local(axis))*kv%knots(span) &
                           + (1.0_wp + local(axis))*kv%knots(span + 1))
      end associate
    end do
  end function point_coordinates

  !> Index of the knot at which the n-th element along an axis begins.
  pure integer function span_of(knots, degree, n) result(span)
    real(wp), intent(in) :: knots(:)
    integer, intent(in) :: degree, n
    integer :: found

    found = 0
    do span = degree + 1, size(knots) - degree - 1
      if (knots(span + 1) > knots(span)) found = found + 1
      if (found == n) return
    end do
  end function span_of

  !> Number of a place in a grid of elements or points, axis 1 first.
  pure integer function grid_number(n, at) result(number)
    integer, intent(in) :: n(3), at(3)       !! size of the grid, place along each axis

    number = at(1) + n(1)*((at(2) - 1) + n(2)*(at(3) - 1))
  end function grid_number

  !> Step through the elements, axis 1 first: from (0, 1, 1) on to the first and after the last one
  !! to one beyond along axis 3.
  pure subroutine next_element(n, e)
    integer, intent(in) :: n(3)              !! elements along each axis
    integer, intent(inout) :: e(3)

    e(1) = e(1) + 1
    if (e(1) <= n(1)) return
    e(1) = 1
    e(2) = e(2) + 1
    if (e(2) <= n(2)) return
    e(2) = 1
    e(3) = e(3) + 1
  end subroutine next_element

end module element
