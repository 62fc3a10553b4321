!> Solid elements: a patch worked by the block kernels, with or without a projection against locking
!! and in plane strain.
module solid_element
  use kinds, only: wp
  use errors, only: error_t
  use text, only: string_t, to_text, append_text
  use state_store, only: state_store_t, carry, carry_field
  use gauss_rule, only: gauss_rule_t
  use nurbs_solid, only: nurbs_solid_t
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use element, only: element_t, force_report_t, carry_motion, describe_grid
  use ig_patch, only: ig_patch_t, tile_buffer_t, plane_strain_t, element_of_lane, lane_of_element
  use strain_projection, only: projection_spec_t, project_nothing, projection_name
  use patch_setup, only: new_patch, new_tile_buffers, set_wave_speed
  use point_volumes, only: new_point_volumes, jacobian_at
  use internal_force, only: internal_forces
  use element_step, only: stable_element_step
  use stored_energy, only: energy_of_points
  use given_fields, only: new_given_fields, spread_to_points
  use shape_check, only: check_shape
  use lumped_mass, only: new_lumped_mass
  use kernel_dispatch, only: solid_kernel_name => kernel_name
  use plane_dispatch, only: plane_kernel_name
  use plane_setup, only: set_plane_strain
  implicit none
  private

  public :: new_solid_element

  !> A solid patch.
  type, extends(element_t), public :: solid_element_t
    type(ig_patch_t) :: patch
    type(tile_buffer_t), allocatable :: buffers(:)
    real(wp), allocatable :: volumes(:, :, :, :)   !! of the points at the start, when asked for
  contains
    procedure :: forces
    procedure :: trial_forces
    procedure :: elastic_copy
    procedure :: take_moduli
    procedure :: scale_mass
    procedure :: damping_ratio
    procedure :: stable_step_of_elements
    procedure :: elastic_energy
    procedure :: jacobian
    procedure :: read_points
    procedure :: read_element
    procedure :: set_state
    procedure :: size_of
    procedure :: fields_at
    procedure :: new_fields
    procedure :: spread_fields
    procedure :: begin_step
    procedure :: elements_of_block
    procedure :: carry => carry_solid
    procedure :: describe
    procedure :: kernel_name
    procedure :: reduce_to_plane
  end type solid_element_t

contains

  !> A patch at rest and without stress; its inertia follows when all parts are there.
  subroutine new_solid_element(element, name, grid, n_points, n_parts, law, viscosity, error, &
                               projection)
    type(solid_element_t), intent(out) :: element
    character(*), intent(in) :: name
    type(nurbs_solid_t), intent(in) :: grid
    integer, intent(in) :: n_points(3), n_parts(3)      !! quadrature, see `new_patch`
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)                !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    type(projection_spec_t), intent(in), optional :: projection   !! absent: none
    integer :: axis

    call check_shape(grid, name, error)
    if (allocated(error)) return
    call new_patch(element%patch, grid, n_points, n_parts, law, viscosity, error, projection)
    if (allocated(error)) return
    element%name = name
    element%grid = grid
    do axis = 1, 3
      associate (table => element%patch%axes(axis))
        element%rule(axis) = gauss_rule_t(table%n_points, table%abscissae, table%weights)
        element%n_elements(axis) = table%n_elements
      end associate
    end do
    element%n_evaluated = n_lanes*product(element%rule%n)*element%patch%n_blocks
    element%shortest = element%patch%viscosity%shortest
    element%has_viscosity = element%patch%viscosity%is_active
    element%buffers = new_tile_buffers(element%patch)
    element%mass = new_lumped_mass(grid, law%density)
    associate (motion => element%motion)
      allocate (motion%x, source=grid%points)
      allocate (motion%v, motion%internal_force, motion%external_force, mold=motion%x)
      motion%v = 0.0_wp
      motion%internal_force = 0.0_wp
      motion%external_force = 0.0_wp
    end associate
  end subroutine new_solid_element

  subroutine forces(self, law, dt, report)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    type(force_report_t), intent(out) :: report

    self%patch%n_before = self%n_before
    call internal_forces(self%patch, self%buffers, law, dt, self%motion%x, self%motion%v, &
                         self%motion%internal_force, report)
  end subroutine forces

  subroutine trial_forces(self, law, dt, report)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    type(force_report_t), intent(out) :: report
    real(wp), allocatable, dimension(:, :, :, :, :) :: stress, state
    real(wp), allocatable :: push(:, :, :, :)
    real(wp) :: time
    integer :: increment

    stress = self%patch%stress
    state = self%patch%state
    push = self%patch%push
    time = self%patch%time
    increment = self%patch%increment
    call self%forces(law, dt, report)
    call move_alloc(stress, self%patch%stress)
    call move_alloc(state, self%patch%state)
    call move_alloc(push, self%patch%push)
    self%patch%time = time
    self%patch%increment = increment
  end subroutine trial_forces

  subroutine elastic_copy(self, copy)
    class(solid_element_t), intent(in) :: self
    class(element_t), allocatable, intent(out) :: copy
    type(solid_element_t), allocatable :: trial

    allocate (trial, source=self)
    trial%has_viscosity = .false.
    associate (patch => trial%patch)
      patch%viscosity%is_active = .false.
      patch%plane = plane_strain_t()
      deallocate (patch%state)
      allocate (patch%state(n_lanes, patch%axes(3)%n_points, 1, &
                            patch%axes(1)%n_points*patch%axes(2)%n_points, patch%n_blocks), &
                source=0.0_wp)
      patch%stress = 0.0_wp
    end associate
    call move_alloc(trial, copy)
  end subroutine elastic_copy

  subroutine take_moduli(self, law)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law

    call set_wave_speed(self%patch, law)
  end subroutine take_moduli

  subroutine scale_mass(self, factor)
    class(solid_element_t), intent(inout) :: self
    real(wp), intent(in) :: factor

    self%mass = self%mass*factor
    associate (viscosity => self%patch%viscosity)
      viscosity%density = viscosity%density*factor
      viscosity%wave_speed = viscosity%wave_speed/sqrt(factor)
    end associate
  end subroutine scale_mass

  pure real(wp) function damping_ratio(self, law, omega, omega_bulk)
    class(solid_element_t), intent(in) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: omega, omega_bulk

    damping_ratio = self%patch%viscosity%damping_ratio(law%bulk, omega, omega_bulk)
  end function damping_ratio

  subroutine stable_step_of_elements(self, law, dt, rate)
    class(solid_element_t), intent(in) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: dt, rate

    call stable_element_step(self%patch, law, self%grid, dt, rate)
  end subroutine stable_step_of_elements

  subroutine elastic_energy(self, law, energy)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: energy
    integer :: q(3)

    if (.not. allocated(self%volumes)) self%volumes = new_point_volumes(self%patch, self%grid)
    q = self%rule%n
    energy = energy_of_points(law, n_lanes*q(3), q(1)*q(2)*self%patch%n_blocks, &
                              self%patch%stress, self%volumes)
  end subroutine elastic_energy

  pure subroutine jacobian(self, grid, element, point, j, x)
    class(solid_element_t), intent(in) :: self
    type(nurbs_solid_t), intent(in) :: grid
    integer, intent(in) :: element(3), point(3)
    real(wp), intent(out) :: j(3, 3), x(3)

    call jacobian_at(self%patch, grid, element, point, j, x)
  end subroutine jacobian

  !> By the threads that work the elements.
  subroutine read_points(self, eqps_state, eqps, stress, state)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: eqps_state
    real(wp), intent(inout) :: eqps(:, :, :, :, :, :)
    real(wp), intent(inout) :: stress(:, :, :, :, :, :, :), state(:, :, :, :, :, :, :)
    integer :: block, lane, e(3), k

    !$omp parallel do schedule(static) private(lane, e, k)
    do block = 1, self%patch%n_blocks
      do lane = 1, n_lanes
        if (.not. self%patch%lanes%is_owner(lane, mod(block - 1, self%patch%lanes%n_blocks) + 1)) &
          cycle
        e = element_of_lane(self%patch, block, lane)
        call copy_points(self%patch%stress(lane, :, :, :, block), &
                         stress(:, :, :, :, e(1), e(2), e(3)))
        call copy_points(self%patch%state(lane, :, :, :, block), &
                         state(:, :, :, :, e(1), e(2), e(3)))
        if (eqps_state == 0) cycle
        do k = 1, size(eqps, 3)
          eqps(:, :, k, e(1), e(2), e(3)) = transpose(reshape( &
            self%patch%state(lane, k, eqps_state, :, block), [size(eqps, 2), size(eqps, 1)]))
        end do
      end do
    end do
    !$omp end parallel do
  end subroutine read_points

  pure subroutine read_element(self, element, stress, state)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: element(3)
    real(wp), intent(out) :: stress(:, :, :, :), state(:, :, :, :)
    integer :: at(2)

    at = lane_of_element(self%patch, element)
    call copy_points(self%patch%stress(at(2), :, :, :, at(1)), stress)
    call copy_points(self%patch%state(at(2), :, :, :, at(1)), state)
  end subroutine read_element

  !> From the order of the kernels, points along axis 3 and then rows, to that of the axes; of more
  !! components than there is room for the first.
  pure subroutine copy_points(kept, values)
    real(wp), intent(in) :: kept(:, :, :)             !! (q3, n, q1*q2)
    real(wp), intent(inout) :: values(:, :, :, :)     !! (n, q1, q2, q3)
    integer :: qa, qb, qc, i

    do qc = 1, size(values, 4)
      do qb = 1, size(values, 3)
        do qa = 1, size(values, 2)
          do i = 1, size(values, 1)
            values(i, qa, qb, qc) = kept(qc, i, qb + size(values, 3)*(qa - 1))
          end do
        end do
      end do
    end do
  end subroutine copy_points

  !> In all lanes that work the element.
  pure subroutine set_state(self, element, point, values)
    class(solid_element_t), intent(inout) :: self
    integer, intent(in) :: element(3), point(3)
    real(wp), intent(in) :: values(:)
    integer :: b, block, lane, row

    row = point(2) + self%rule(2)%n*(point(1) - 1)
    do b = 1, self%patch%lanes%n_blocks
      block = b + self%patch%lanes%n_blocks*((element(2) - 1) &
                                             + self%n_elements(2)*(element(3) - 1))
      do lane = 1, n_lanes
        if (self%patch%lanes%element(lane, b) == element(1)) &
          self%patch%state(lane, point(3), :size(values), row, block) = values
      end do
    end do
  end subroutine set_state

  pure real(wp) function size_of(self, element)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: element(3)
    integer :: at(2)

    at = lane_of_element(self%patch, element)
    size_of = self%patch%element_size(at(2), at(1))
  end function size_of

  pure function fields_at(self, element, point) result(values)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: element(3), point(3)
    real(wp) :: values(self%n_fields)
    integer :: at(2)

    at = lane_of_element(self%patch, element)
    values = self%patch%given(at(2), point(3), :self%n_fields, &
                              point(2) + self%rule(2)%n*(point(1) - 1), at(1))
  end function fields_at

  subroutine new_fields(self, n)
    class(solid_element_t), intent(inout) :: self
    integer, intent(in) :: n

    self%n_fields = n
    associate (points => self%patch%n_control)
      allocate (self%nodal(points(1), points(2), points(3), n), source=0.0_wp)
      allocate (self%nodal_start, source=self%nodal)
    end associate
    call new_given_fields(self%patch, n)
  end subroutine new_fields

  subroutine spread_fields(self)
    class(solid_element_t), intent(inout) :: self

    call spread_to_points(self%patch, self%nodal)
  end subroutine spread_fields

  pure subroutine begin_step(self, step, time)
    class(solid_element_t), intent(inout) :: self
    integer, intent(in) :: step
    real(wp), intent(in) :: time

    self%patch%step = step
    self%patch%step_start = time
    self%patch%before_step = self%patch%increment
  end subroutine begin_step

  pure function elements_of_block(self, block) result(elements)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: block
    integer, allocatable :: elements(:, :)
    integer :: lane

    allocate (elements(3, n_lanes))
    do lane = 1, n_lanes
      elements(:, lane) = element_of_lane(self%patch, block, lane)
    end do
  end function elements_of_block

  subroutine carry_solid(self, store)
    class(solid_element_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    call carry_motion(self%motion, store)
    associate (patch => self%patch)
      call carry_field(store, "stress", size(patch%stress), patch%stress)
      call carry_field(store, "state", size(patch%state), patch%state)
      call carry_field(store, "push", size(patch%push), patch%push)
      call carry(store, "patch_time", patch%time)
      call carry(store, "increment", patch%increment)
      call carry(store, "before_step", patch%before_step)
      if (self%n_fields > 0) then
        call carry_field(store, "given", size(patch%given), patch%given)
        if (store%is_taking) patch%is_spread = .false.
      end if
    end associate
  end subroutine carry_solid

  subroutine describe(self, lines)
    class(solid_element_t), intent(in) :: self
    type(string_t), allocatable, intent(inout) :: lines(:)

    call describe_grid(self, lines)
    associate (projection => self%patch%projection)
      if (projection%is_smooth) then
        call append_text(lines, "projection       "//projection_name(projection%kind)//", smooth")
      else if (projection%kind /= project_nothing) then
        call append_text(lines, "projection       "//projection_name(projection%kind)//" with "// &
                                to_text(projection%n_samples(1))//" x "// &
                                to_text(projection%n_samples(2))//" x "// &
                                to_text(projection%n_samples(3))//" samples")
      end if
    end associate
  end subroutine describe

  pure function kernel_name(self) result(name)
    class(solid_element_t), intent(in) :: self
    character(:), allocatable :: name

    if (self%patch%plane%kernel > 0) then
      name = plane_kernel_name(self%patch%plane%kernel)
    else
      name = solid_kernel_name(self%patch%kernel)
    end if
  end function kernel_name

  !> Let the patch, whose motion along a coordinate is held everywhere, work in the plane where that
  !! is possible.
  subroutine reduce_to_plane(self, law, component)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: component         !! that is held: 1 x, 2 y, 3 z

    call set_plane_strain(self%patch, law, component, self%motion%x)
  end subroutine reduce_to_plane

end module solid_element
