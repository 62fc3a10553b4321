!> Shells: the mid-surface of a thin sheet without rotations (Kirchhoff and Love), with layers of
!! integration points in plane stress. docs/shells.md has the formulas and their sources.
module shell_element
  use kinds, only: wp
  use failure, only: error_t
  use linear_algebra, only: cross
  use state_store, only: state_store_t, carry, carry_field, carry_columns
  use text, only: string_t, append_text, rounded_text, counted
  use gauss_rule, only: gauss_rule_t
  use knot_vector, only: knot_vector_t, linear_axis
  use outline_ties, only: lead_points
  use nurbs_solid, only: nurbs_solid_t, solid_face
  use nurbs_surface, only: nurbs_surface_t
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use elastic, only: elastic_t
  use element, only: force_report_t, element_t, jacobian_in_span, describe_grid, describe_outline, &
                     read_layer, add_to_layer
  use lumped_mass, only: new_lumped_mass
  use solid_patch, only: block_t, shell_points_t, row_of_point, lane_of_element, find_blocks_here
  use patch_setup, only: new_tile_buffers
  use solid_element, only: solid_element_t, stiffness_of_blocks
  use solid_forces, only: add_tiles
  use tile_exchange, only: pass_tiles
  use row_shares, only: pass_known_rows, gather_rows
  use parcel, only: parcel_t
  use shell_outline, only: mass_inside, carry_over, share_of_leaders
  use shell_setup, only: shortest_length, mid_surface, new_shell_patch, damp_bending_of
  use shell_faces, only: shell_faces_t, new_shell_faces, find_normals, face_net, face_velocities, &
                         add_face_forces, rows_around
  use shell_forces, only: forces_of_shell, begin_shell_forces, set_metric, shell_kernel_name
  use shell_readings, only: find_energy, read_shell, find_resultants
  use shell_stiffness, only: shell_trial_t, begin_shell_trial, run_trial, end_shell_trial
  use solid_stiffness, only: block_trial_t
  use through_thickness, only: through_fields_t, new_through_fields, add_push, take_pushes, &
                               thickness_now
  implicit none
  private

  public :: new_shell_element

  !> A mid-surface; its grid has one control point across.
  type, extends(solid_element_t), public :: shell_element_t
    type(shell_points_t) :: points
    type(nurbs_solid_t) :: sheet            !! the sheet as a solid at the start
    type(shell_faces_t) :: faces            !! what belongs to the shape of the last look at them
    integer :: seen = -2                    !! force evaluations before that look, -2: none yet
    !> At the control points when it was last looked at, see `look_at_faces`, (n1, n2) [length].
    real(wp), allocatable :: thickness(:, :)
    real(wp), allocatable :: thickening(:, :)          !! its rate in that increment
    real(wp) :: dt = 0.0_wp                            !! of that increment
    real(wp), allocatable :: start_faces(:, :, :, :)   !! control points of both at the start
    type(through_fields_t) :: through
  contains
    procedure :: cut_at_rest
    procedure :: take_cut
    procedure :: mass_now
    procedure :: sheet_at_start
    procedure :: forces
    procedure :: trial_forces
    procedure :: end_forces => trial_forces
    procedure :: block_stiffness
    procedure :: new_trial
    procedure :: try_block
    procedure :: leave_trial
    procedure :: drop_state
    procedure :: pass_shape
    procedure :: join_rows
    procedure :: forget_faces
    procedure :: take_shape
    procedure :: single
    procedure :: elastic_energy
    procedure :: read_points
    procedure :: read_element
    procedure :: read_resultants
    procedure :: jacobian
    procedure :: surface
    procedure :: look_at_faces
    procedure :: face_net => net_of_side
    procedure :: face_velocities => velocities_of_side
    procedure :: add_face_forces => add_forces_to_side
    procedure :: body
    procedure :: body_motion
    procedure :: damp_bending
    procedure :: bending_lag
    procedure :: bending_copy
    procedure :: describe
    procedure :: carry => carry_shell
    procedure :: kernel_name
    procedure :: n_stored
  end type shell_element_t

contains

  !> The mid-surface of a sheet, at rest and without stress; its inertia follows when all parts are
  !! there. A control point has the mass of those of the sheet across it.
  subroutine new_shell_element(element, name, sheet, rule, law, viscosity, error)
    type(shell_element_t), intent(inout) :: element
    character(*), intent(in) :: name
    type(nurbs_solid_t), intent(in) :: sheet
    type(gauss_rule_t), intent(in) :: rule(3)           !! of an element by axis
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)                !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error

    element%name = name
    element%rule = rule
    element%sheet = sheet
    element%grid = mid_surface(sheet)
    call new_shell_patch(element%patch, element%points, sheet, element%grid, rule, law, viscosity, &
                         error)
    if (allocated(error)) return
    element%is_surface = .true.
    element%n_elements = element%patch%axes%n_elements
    element%n_evaluated = n_lanes*product(element%rule%n)*element%patch%n_blocks
    element%shortest = element%patch%shortest
    element%has_viscosity = element%patch%viscosity%is_active
    element%buffers = new_tile_buffers(element%patch)
    call new_shell_faces(element%faces, element%grid%axes(:2), element%grid%weights(:, :, 1))
    element%reach = rows_around(element%faces)
    element%density = law%density
    allocate (element%mass, mold=element%grid%weights)
    element%mass = element%mass_now()
    element%can_be_cut = .true.
    call new_through_fields(element%patch, element%points, element%through)
    element%thickness = thickness_of(element)
    allocate (element%thickening, source=0.0_wp*element%thickness)
    associate (motion => element%motion)
      allocate (motion%x, source=element%grid%points)
      allocate (motion%v, motion%internal_force, motion%external_force, mold=motion%x)
      motion%v = 0.0_wp
      motion%internal_force = 0.0_wp
      motion%external_force = 0.0_wp
      allocate (element%start_faces(size(motion%x, 1), size(motion%x, 2), 2, 3))
      call find_normals(element%faces, motion%x)
      call face_net(element%faces, 5, motion%x, element%thickness, element%start_faces(:, :, 1, :))
      call face_net(element%faces, 6, motion%x, element%thickness, element%start_faces(:, :, 2, :))
    end associate
  end subroutine new_shell_element

  subroutine cut_at_rest(self, moments, law, cut, error)
    class(shell_element_t), intent(in) :: self
    real(wp), intent(in) :: moments(:, :, :)
    class(block_law_t), intent(in) :: law
    class(solid_element_t), allocatable, intent(out) :: cut
    type(error_t), allocatable, intent(out) :: error
    type(shell_element_t), allocatable :: shell

    allocate (shell)
    associate (viscosity => self%patch%viscosity)
      call new_shell_patch(shell%patch, shell%points, self%sheet, self%grid, self%rule, law, &
                           [viscosity%linear, viscosity%quadratic], error, moments)
      if (allocated(error)) return
      if (viscosity%bending > 0.0_wp) &
        call damp_bending_of(shell%patch, shell%points, viscosity%bending)
    end associate
    shell%least_share = share_of_leaders(maxval(shell%points%thickness), &
                                         shortest_length(shell%points))
    call move_alloc(shell, cut)
  end subroutine cut_at_rest

  !> The normal stress of contact begins anew with the next increment.
  subroutine take_cut(self, cut)
    class(shell_element_t), intent(inout) :: self
    class(solid_element_t), intent(inout) :: cut

    select type (cut)
    type is (shell_element_t)
      call carry_over(self%patch, self%points, self%motion%x, cut%patch, cut%points)
      self%patch = cut%patch
      self%points = cut%points
    end select
    call new_through_fields(self%patch, self%points, self%through)
    self%seen = min(self%seen, self%patch%increment - 2)   ! faces are looked at anew
    self%thickness = thickness_of(self)
  end subroutine take_cut

  function mass_now(self) result(mass)
    class(shell_element_t), intent(in) :: self
    real(wp) :: mass(size(self%mass, 1), size(self%mass, 2), size(self%mass, 3))

    if (self%patch%lanes%is_trimmed) then
      mass = mass_inside(self%patch, self%points, self%sheet, self%density)
    else
      mass = reshape(sum(new_lumped_mass(self%sheet, self%density), 3), shape(mass))
    end if
  end function mass_now

  pure function sheet_at_start(self) result(sheet)
    class(shell_element_t), intent(in) :: self
    type(nurbs_solid_t) :: sheet

    sheet = self%sheet
  end function sheet_at_start

  subroutine forces(self, law, dt, report)
    class(shell_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    type(force_report_t), intent(out) :: report

    self%patch%n_before = self%n_before
    self%dt = dt
    call look_through(self)
    if (.not. self%motion%rows%is_shared) then
      call forces_of_shell(self%patch, self%points, self%buffers, self%through, law, dt, &
                           self%motion%x, self%motion%internal_force, report)
      return
    end if
    self%is_open = .true.
    call begin_shell_forces(self%patch, self%points, self%buffers, self%through, law, dt, &
                            self%motion%x, self%motion%internal_force, self%reports)
  end subroutine forces

  !> Places of control points, and what the tiles have found of the thickness.
  subroutine pass_shape(self, partner, is_sent, parcel)
    class(shell_element_t), intent(inout) :: self
    integer, intent(in) :: partner
    logical, intent(in) :: is_sent
    type(parcel_t), intent(inout) :: parcel
    integer :: rows(2), sender

    associate (shares => self%motion%rows, n => shape(self%mass))
      call pass_known_rows(shares, partner, is_sent, [n(1), n(2), 3], self%motion%x, parcel)
      if (.not. (self%is_open .and. self%through%is_watched)) return
      rows = merge(shares%known_by(:, partner + 1), shares%known, is_sent)
      sender = merge(shares%ranks%number, partner, is_sent)
    end associate
    call pass_tiles(self%patch, sender, rows, is_sent, self%through%buffers, parcel, &
                    self%through%sums)
  end subroutine pass_shape

  !> Thickness of the control points and what presses on them; the normals that belong to it.
  subroutine join_rows(self)
    class(shell_element_t), intent(inout) :: self
    integer :: n(2)

    n = shape(self%thickness)
    associate (rows => self%motion%rows)
      call gather_rows(rows, [n, 1], self%thickness)
      call gather_rows(rows, [n, 1], self%thickening)
      call gather_rows(rows, [n, 2], self%through%push)
    end associate
    call find_normals(self%faces, self%motion%x)
  end subroutine join_rows

  !> Of these rows, those that there are.
  pure function rows_there(self, rows) result(there)
    class(shell_element_t), intent(in) :: self
    integer, intent(in) :: rows(2)             !! first and last
    integer :: there(2)

    there = [max(1, rows(1)), min(size(self%mass, 2), rows(2))]
  end function rows_there

  !> Rows of control points that move here.
  pure function rows_moved(self) result(moved)
    class(shell_element_t), intent(in) :: self
    integer :: moved(2)

    moved = rows_there(self, [self%motion%rows%first, self%motion%rows%last])
  end function rows_moved

  !> At the end of the motion that the velocities make from here, with the normal stress that
  !! `forces` would take there.
  subroutine trial_forces(self, law, dt, report)
    class(shell_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    type(force_report_t), intent(out) :: report
    type(shell_points_t) :: points
    real(wp), allocatable :: stress(:, :, :, :, :), state(:, :, :, :, :), push(:, :, :, :)
    type(through_fields_t) :: through
    real(wp) :: time
    integer :: increment

    points = self%points
    through = self%through
    call look_through(self)
    stress = self%patch%stress
    state = self%patch%state
    push = self%patch%push
    time = self%patch%time
    increment = self%patch%increment
    call forces_of_shell(self%patch, self%points, self%buffers, self%through, law, dt, &
                         self%motion%x + dt*self%motion%v, self%motion%internal_force, report)
    self%points = points
    self%through = through
    call move_alloc(stress, self%patch%stress)
    call move_alloc(state, self%patch%state)
    call move_alloc(push, self%patch%push)
    self%patch%time = time
    self%patch%increment = increment
  end subroutine trial_forces

  !> What presses on the faces at the end of a motion, if they have been looked at for it.
  subroutine look_through(self)
    class(shell_element_t), intent(inout) :: self

    self%through%is_watched = self%seen == self%patch%increment
    if (self%through%is_watched) call take_pushes(self%through, rows_moved(self), self%thickness)
    self%through%is_pressed = self%through%is_pressed .and. self%through%is_watched
  end subroutine look_through

  subroutine block_stiffness(self, law, dt, amount, first, elements, matrices)
    class(shell_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, amount
    integer, intent(in) :: first
    integer, intent(out) :: elements(:, :, :)
    real(wp), intent(out) :: matrices(:, :, :, :)
    type(through_fields_t) :: through

    through = self%through
    call look_through(self)
    call stiffness_of_blocks(self, law, dt, amount, first, elements, matrices)
    self%through = through
  end subroutine block_stiffness

  subroutine new_trial(self, block, dt, x, trial)
    class(shell_element_t), intent(in) :: self
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :)
    class(block_trial_t), allocatable, intent(out) :: trial

    allocate (shell_trial_t :: trial)
    select type (trial)
    type is (shell_trial_t)
      call begin_shell_trial(self%patch, self%points, self%through, block, dt, x, trial)
    end select
  end subroutine new_trial

  subroutine try_block(self, law, block, dt, u, trial, f)
    class(shell_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(inout) :: u(:, :)
    class(block_trial_t), intent(inout) :: trial
    real(wp), intent(out) :: f(:, :)

    select type (trial)
    type is (shell_trial_t)
      call run_trial(self%patch, self%points, law, block, dt, u, trial, f)
    end select
  end subroutine try_block

  subroutine leave_trial(self, trial, number)
    class(shell_element_t), intent(inout) :: self
    class(block_trial_t), intent(in) :: trial
    integer, intent(in) :: number

    select type (trial)
    type is (shell_trial_t)
      call end_shell_trial(trial, self%patch, self%points, number)
    end select
  end subroutine leave_trial

  subroutine drop_state(self)
    class(shell_element_t), intent(inout) :: self

    call self%solid_element_t%drop_state()
    self%points%resultant = 0.0_wp
    call self%forget_faces(.false.)
  end subroutine drop_state

  !> Forces on the faces that wait for the next evaluation are gone; where nothing presses any more,
  !! the normal stress too.
  subroutine forget_faces(self, is_pressed)
    class(shell_element_t), intent(inout) :: self
    logical, intent(in) :: is_pressed

    self%through%push = 0.0_wp
    if (is_pressed) return
    self%points%normal = 0.0_wp
    self%points%is_pressed = .false.
    self%through%is_pressed = .false.
    self%through%is_watched = .false.
    self%seen = -2
  end subroutine forget_faces

  !> Strains of the next evaluation count from the present positions.
  subroutine take_shape(self)
    class(shell_element_t), intent(inout) :: self

    call set_metric(self%patch, self%points, self%motion%x)
  end subroutine take_shape

  !> The element on its own span, with its share of the mass.
  subroutine single(self, element, copy)
    class(shell_element_t), intent(in) :: self
    integer, intent(in) :: element(3)
    class(element_t), allocatable, intent(out) :: copy
    type(shell_element_t), allocatable :: one
    type(nurbs_solid_t) :: piece
    type(error_t), allocatable :: error
    integer :: axis, low(3), high(3)

    low = 1
    high = self%sheet%axes%n_basis
    piece%axes = self%sheet%axes
    do axis = 1, 2
      associate (table => self%patch%axes(axis), knots => self%sheet%axes(axis)%knots)
        low(axis) = table%first(element(axis))
        high(axis) = low(axis) + table%degree
        piece%axes(axis) = knot_vector_t(table%degree, table%degree + 1, &
                                         knots(low(axis):high(axis) + table%degree + 1))
      end associate
    end do
    piece%points = self%sheet%points(low(1):high(1), low(2):high(2), :, :)
    piece%weights = self%sheet%weights(low(1):high(1), low(2):high(2), :)
    allocate (one)
    call new_shell_element(one, self%name, piece, self%rule, &
                           elastic_t(density=self%patch%viscosity%density), [0.0_wp, 0.0_wp], error)
    call move_alloc(one, copy)
  end subroutine single

  !> Of the stress in the sheet and the normal stress.
  subroutine elastic_energy(self, law, energy)
    class(shell_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: energy

    call find_energy(self%patch, self%points, self%rule(3), law, energy)
  end subroutine elastic_energy

  subroutine read_points(self, eqps_state, eqps, stress, state)
    class(shell_element_t), intent(in) :: self
    integer, intent(in) :: eqps_state
    real(wp), intent(inout) :: eqps(:, :, :, :, :, :)
    real(wp), intent(inout) :: stress(:, :, :, :, :, :, :), state(:, :, :, :, :, :, :)
    real(wp) :: own_stress(6, size(eqps, 1), size(eqps, 2), size(eqps, 3))
    real(wp) :: own(max(size(state, 1), eqps_state), size(eqps, 1), size(eqps, 2), size(eqps, 3))
    integer :: e1, e2

    !$omp parallel do schedule(static) private(e1, own_stress, own)
    do e2 = 1, self%n_elements(2)
      do e1 = 1, self%n_elements(1)
        call self%read_element([e1, e2, 1], own_stress, own)
        stress(:, :, :, :, e1, e2, 1) = own_stress(:size(stress, 1), :, :, :)
        state(:, :, :, :, e1, e2, 1) = own(:size(state, 1), :, :, :)
        if (eqps_state > 0) eqps(:, :, :, e1, e2, 1) = own(eqps_state, :, :, :)
      end do
    end do
    !$omp end parallel do
  end subroutine read_points

  !> Stress in the fixed frame, 11, 22, 33, 12, 13, 23.
  pure subroutine read_element(self, element, stress, state)
    class(shell_element_t), intent(in) :: self
    integer, intent(in) :: element(3)
    real(wp), intent(out) :: stress(:, :, :, :), state(:, :, :, :)

    call read_shell(self%patch, self%points, self%rule, self%grid%weights(:, :, 1), &
                    self%motion%x(:, :, 1, :), element, stress, state)
  end subroutine read_element

  subroutine read_resultants(self, resultants)
    class(shell_element_t), intent(in) :: self
    real(wp), intent(out) :: resultants(:, :, :, :, :)

    call find_resultants(self%patch, self%points, self%rule, resultants)
  end subroutine read_resultants

  !> Of the layer of an integration point, whose place is off the surface by its share of the
  !! thickness now.
  pure subroutine jacobian(self, grid, element, point, j, x)
    class(shell_element_t), intent(in) :: self
    type(nurbs_solid_t), intent(in) :: grid
    integer, intent(in) :: element(3), point(3)
    real(wp), intent(out) :: j(3, 3), x(3)
    integer :: at(2), axis, span(3)

    at = lane_of_element(self%patch, element)
    span(:2) = [(self%patch%axes(axis)%first(element(axis)) + self%patch%axes(axis)%degree, &
                 axis=1, 2)]
    span(3) = 1
    call jacobian_in_span(grid, span, [self%place_along_sheet(element, point), 0.0_wp], j, x)
    j(:, 3) = cross(j(:, 1), j(:, 2))
    j(:, 3) = 0.5_wp*self%points%thickness(at(2), row_of_point(self%rule%n, point), at(1)) &
              *j(:, 3)/norm2(j(:, 3))
    x = x + self%rule(3)%points(point(3))*j(:, 3)
  end subroutine jacobian

  !> The sheet between its faces as they are drawn and touched, which may be a little off those of
  !! the solid that the deck gives.
  pure function body(self) result(solid)
    class(shell_element_t), intent(in) :: self
    type(nurbs_solid_t) :: solid

    solid%axes(:2) = self%grid%axes(:2)
    solid%axes(3) = linear_axis()
    allocate (solid%weights, source=spread(self%grid%weights(:, :, 1), 3, 2))
    allocate (solid%points, source=self%start_faces)
  end function body

  !> Both faces, of the shape and the thickness now.
  subroutine body_motion(self, x, v)
    class(shell_element_t), intent(in) :: self
    real(wp), allocatable, intent(inout) :: x(:, :, :, :), v(:, :, :, :)
    type(shell_faces_t) :: faces
    real(wp), allocatable :: thickness(:, :)
    integer :: side

    if (.not. allocated(x)) allocate (x, mold=self%start_faces)
    if (.not. allocated(v)) allocate (v, mold=self%start_faces)
    call find_faces(self, faces, thickness)
    do side = 5, 6
      call face_net(faces, side, self%motion%x, thickness, x(:, :, side - 4, :))
      call face_velocities(faces, side, self%motion%v, thickness, v(:, :, side - 4, :))
    end do
  end subroutine body_motion

  !> Faces of the shape and the thickness now.
  subroutine find_faces(self, faces, thickness)
    class(shell_element_t), intent(in) :: self
    type(shell_faces_t), intent(out) :: faces
    real(wp), allocatable, intent(out) :: thickness(:, :)
    real(wp), allocatable :: field(:, :, :, :)

    faces = self%faces
    call find_normals(faces, self%motion%x)
    thickness = thickness_of(self)
    if (self%ties%n == 0) return
    field = reshape(thickness, [shape(thickness), 1, 1])
    call lead_points(self%ties, field)   ! for pictures of the edge
    thickness = field(:, :, 1, 1)
  end subroutine find_faces

  !> A face of the sheet, or an edge, at the start.
  function surface(self, side)
    class(shell_element_t), intent(in) :: self
    integer, intent(in) :: side
    type(nurbs_surface_t) :: surface

    surface = solid_face(self%body(), side)
  end function surface

  !> Normals and thickness of the shape that the last evaluation of the forces took. Where processes
  !! move but some of the rows, they have passed what they know of it.
  subroutine look_at_faces(self)
    class(shell_element_t), intent(inout) :: self
    integer :: known(2)

    if (self%seen == self%patch%increment) return
    call find_normals(self%faces, self%motion%x, rows_moved(self))
    if (self%seen < self%patch%increment - 1) then
      self%thickness = thickness_of(self)
      self%thickening = 0.0_wp
      self%through%push = 0.0_wp
    else
      known = rows_there(self, self%motion%rows%known)
      if (self%is_open) then
        !$omp parallel
        call add_tiles(self%patch, self%through%buffers, self%through%sums, known)
        !$omp end parallel
      end if
      associate (thickness => self%thickness(:, known(1):known(2)), &
                 thickening => self%thickening(:, known(1):known(2)), &
                 sums => self%through%sums(:, known(1):known(2), 1, 1))
        thickening = thickness
        thickness = sums/self%through%volume(:, known(1):known(2))
        thickening = (thickness - thickening)/max(self%dt, tiny(1.0_wp))
      end associate
    end if
    self%seen = self%patch%increment
  end subroutine look_at_faces

  !> Faces as they were looked at last, else those of the shape now. An edge is a strip between
  !! those of both faces.
  subroutine net_of_side(self, side, net)
    class(shell_element_t), intent(in) :: self
    integer, intent(in) :: side
    real(wp), intent(out) :: net(:, :, :)
    real(wp), allocatable :: both(:, :, :, :)

    if (side > 4) then
      call net_of_face(self, side, net)
    else
      allocate (both, mold=self%start_faces)
      call net_of_face(self, 5, both(:, :, 1, :))
      call net_of_face(self, 6, both(:, :, 2, :))
      call read_layer(both, side, net)
    end if
  end subroutine net_of_side

  subroutine net_of_face(self, side, net)
    type(shell_element_t), intent(in) :: self
    integer, intent(in) :: side
    real(wp), intent(out) :: net(:, :, :)
    type(shell_faces_t) :: faces
    real(wp), allocatable :: thickness(:, :)

    if (self%seen == self%patch%increment) then
      call face_net(self%faces, side, self%motion%x, self%thickness, net, rows_moved(self))
    else
      call find_faces(self, faces, thickness)
      call face_net(faces, side, self%motion%x, thickness, net)
    end if
  end subroutine net_of_face

  subroutine velocities_of_side(self, side, net)
    class(shell_element_t), intent(in) :: self
    integer, intent(in) :: side
    real(wp), intent(out) :: net(:, :, :)
    real(wp), allocatable :: both(:, :, :, :)

    if (side > 4) then
      call velocities_of_face(self, side, net)
    else
      allocate (both, mold=self%start_faces)
      call velocities_of_face(self, 5, both(:, :, 1, :))
      call velocities_of_face(self, 6, both(:, :, 2, :))
      call read_layer(both, side, net)
    end if
  end subroutine velocities_of_side

  subroutine velocities_of_face(self, side, net)
    type(shell_element_t), intent(in) :: self
    integer, intent(in) :: side
    real(wp), intent(out) :: net(:, :, :)
    type(shell_faces_t) :: faces
    real(wp), allocatable :: thickness(:, :)

    if (self%seen == self%patch%increment) then
      call face_velocities(self%faces, side, self%motion%v, self%thickness, net, self%thickening)
    else
      call find_faces(self, faces, thickness)
      call face_velocities(faces, side, self%motion%v, thickness, net)
    end if
  end subroutine velocities_of_face

  subroutine add_forces_to_side(self, side, forces)
    class(shell_element_t), intent(inout) :: self
    integer, intent(in) :: side
    real(wp), intent(in) :: forces(:, :, :)
    real(wp), allocatable :: both(:, :, :, :)
    integer :: face

    call self%look_at_faces()
    associate (force => self%motion%external_force)
      if (side > 4) then
        call add_face_forces(self%faces, side, self%thickness, forces, force, rows_moved(self))
        call add_push(shape(self%thickness), rows_moved(self), side, self%faces%director, forces, &
                      self%through%push)
      else
        allocate (both, mold=self%start_faces)
        both = 0.0_wp
        call add_to_layer(both, side, forces)
        do face = 5, 6
          call add_face_forces(self%faces, face, self%thickness, both(:, :, face - 4, :), force)
        end do
      end if
    end associate
  end subroutine add_forces_to_side

  !> Thickness at the control points now.
  function thickness_of(self) result(thickness)
    class(shell_element_t), intent(in) :: self
    real(wp) :: thickness(size(self%mass, 1), size(self%mass, 2))

    thickness = thickness_now(self%patch, self%points, self%through)
  end function thickness_of

  subroutine damp_bending(self, factor)
    class(shell_element_t), intent(inout) :: self
    real(wp), intent(in) :: factor

    call damp_bending_of(self%patch, self%points, factor)
    self%has_viscosity = .true.
  end subroutine damp_bending

  !> So short that the sheet of the copy is thick compared with its elements.
  pure real(wp) function bending_lag(self, law) result(lag)
    class(shell_element_t), intent(in) :: self
    class(block_law_t), intent(in) :: law
    real(wp), parameter :: slenderness = 1.0e-3_wp   ! elements of the copy over its thickness

    lag = 0.0_wp
    associate (viscosity => self%patch%viscosity)
      if (.not. (viscosity%is_active .and. viscosity%bending > 0.0_wp)) return
      lag = viscosity%bending*viscosity%density*viscosity%wave_speed/law%bulk &
            *slenderness**3*minval(self%points%thickness)**2/maxval(viscosity%length)
    end associate
  end function bending_lag

  !> Of the thickness H whose stiffness K H^3/12 for the trace of the curvature is the viscosity
  !! b rho c L^2 h^2/12 over the lag.
  subroutine bending_copy(self, law, lag, copy)
    class(shell_element_t), intent(in) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: lag
    class(element_t), allocatable, intent(out) :: copy
    type(shell_element_t), allocatable :: thick
    integer :: block, row

    allocate (thick, source=self)
    call thick%drop_state()
    associate (viscosity => self%patch%viscosity, h => thick%points%thickness)
      do block = 1, size(h, 3)
        do row = 1, size(h, 2)
          h(:, row, block) = (viscosity%bending*viscosity%density*viscosity%wave_speed &
                              /(law%bulk*lag)*(viscosity%length(:, block)*h(:, row, block))**2) &
                             **(1.0_wp/3)
        end do
      end do
    end associate
    call move_alloc(thick, copy)
  end subroutine bending_copy

  subroutine describe(self, lines)
    class(shell_element_t), intent(in) :: self
    type(string_t), allocatable, intent(inout) :: lines(:)
    character(:), allocatable :: words

    call describe_grid(self, lines)
    words = rounded_text(minval(self%points%thickness))
    if (maxval(self%points%thickness) > (1.0_wp + 1.0e-6_wp)*minval(self%points%thickness)) &
      words = words//" to "//rounded_text(maxval(self%points%thickness))
    call append_text(lines, "shell            thickness "//words//", "//counted(self%rule(3)%n, &
                            "layer"))
    call describe_outline(self, lines)
  end subroutine describe

  subroutine carry_shell(self, store)
    class(shell_element_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store
    integer, allocatable :: blocks(:)

    call self%solid_element_t%carry(store)
    call find_blocks_here(self%patch, blocks)
    associate (points => self%points, n => self%patch%n_blocks)
      call carry_columns(store, "resultant", size(points%resultant)/n, n, points%resultant, blocks)
      call carry_columns(store, "metric", size(points%metric)/n, n, points%metric, blocks)
      call carry_columns(store, "thickness", size(points%thickness)/n, n, points%thickness, blocks)
      call carry_columns(store, "through", size(points%through)/n, n, points%through, blocks)
      call carry_columns(store, "normal", size(points%normal)/n, n, points%normal, blocks)
      if (self%patch%has_context) &
        call carry_columns(store, "stretch", size(points%stretch)/n, n, points%stretch, blocks)
    end associate
    call carry_field(store, "push_on_faces", size(self%through%push), self%through%push)
    call carry_field(store, "face_thickness", size(self%thickness), self%thickness)
    call carry_field(store, "face_thickening", size(self%thickening), self%thickening)
    call carry(store, "faces_seen", self%seen)
    if (.not. store%is_taking) return
    call find_normals(self%faces, self%motion%x)
    self%points%is_pressed = maxval(maxval(maxval(abs(self%points%normal), 1), 1), 1) > 0.0_wp
  end subroutine carry_shell

  pure function kernel_name(self) result(name)
    class(shell_element_t), intent(in) :: self
    character(:), allocatable :: name

    name = shell_kernel_name(self%points%kernel)
  end function kernel_name

  pure real(wp) function n_stored(self) result(n)
    class(shell_element_t), intent(in) :: self

    n = self%solid_element_t%n_stored()
    associate (points => self%points)
      n = n + size(points%metric) + size(points%thickness) + size(points%through) &
          + size(points%volume) + size(points%resultant) + size(points%normal)
      if (allocated(points%rational)) n = n + size(points%rational)
      if (allocated(points%stretch)) n = n + size(points%stretch) + size(points%reference)
    end associate
  end function n_stored

end module shell_element
