!> Solid elements: a patch worked by the block kernels.
module solid_element
  use kinds, only: wp
  use failure, only: error_t, fail
  use state_store, only: state_store_t, carry, carry_columns, carry_field
  use gauss_rule, only: gauss_rule_t
  use knot_vector, only: breaks
  use outline, only: region_t, join_regions, cut_cells, n_moments
  use outline_ties, only: new_outline_ties, give_mass, lead_points
  use nurbs_solid, only: nurbs_solid_t
  use text, only: string_t, to_text, rounded_text, place_text
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use element, only: element_t, force_report_t, carry_motion, stored_motion, new_nodal_fields, &
                     describe_grid, describe_outline
  use solid_patch, only: solid_patch_t, tile_buffer_t, block_t, element_of_lane, lane_of_element, &
                      is_counted_lane, block_at, block_number, row_of_point, place_of_point, &
                      local_place, find_blocks_here, n_elements_of, is_element_here, &
                      is_block_here
  use tile_shares, only: share_out, work_own_tiles, work_all_tiles
  use ranks, only: ranks_t, traffic_t, sum_traffic
  use parcel, only: parcel_t
  use bulk_viscosity, only: set_wave_speed, scale_viscosity, damping_ratio_of
  use patch_setup, only: new_patch, new_cut_patch, new_tile_buffers, element_patch, check_shape
  use patch_outline, only: add_whole_masses, add_cut_masses, carry_points, distances_inside, &
                           centre_of
  use tile_exchange, only: sum_of_blocks, pass_tiles, pass_reports, find_rows, costs_of_tiles
  use patch_points, only: new_point_volumes, read_points_of, copy_points, find_row_energies, &
                          new_given_fields, &
                          spread_to_points, carry_given
  use solid_forces, only: internal_forces, begin_forces, end_forces
  use solid_stiffness, only: block_trial_t, begin_trial, end_trial, owned_elements, move_column, &
                             add_column
  use lumped_mass, only: new_lumped_mass, mass_tables, add_masses
  use kernel_dispatch, only: run_kernel, solid_kernel_name => kernel_name
  implicit none
  private

  public :: new_solid_element, cut_out, stiffness_of_blocks

  integer, parameter :: parallel_size = 24000   !! fewer stresses are not worth waking threads for
  integer, parameter :: most_away = 3   !! elements from a follower inside an outline to its leader

  !> A solid patch.
  type, extends(element_t), public :: solid_element_t
    type(solid_patch_t) :: patch
    type(tile_buffer_t), allocatable :: buffers(:)
    !> An evaluation that `finish_forces` ends, and reports of its tiles.
    logical :: is_open = .false.
    type(force_report_t), allocatable :: reports(:)
    logical :: has_own_points = .true.           !! a block needs nothing but its own points
    logical :: is_divisible = .true.             !! nor does a tile, and forces add up
    logical :: is_by_rows = .true.               !! nor do forces need all rows of control points
    real(wp), allocatable :: volumes(:, :, :, :)   !! of the points at the start, when asked for
    real(wp) :: density = 0.0_wp                   !! of the law, without what scaling has added
    !> Share of an element's area inside an outline from which on its control points move for
    !! themselves. Slivers do not shorten the time increment of solids, but static steps take more
    !! iterations the smaller the ones are whose points are free.
    real(wp) :: least_share = 0.3_wp
  contains
    procedure :: trim
    procedure :: cut_at_rest
    procedure :: take_cut
    procedure :: mass_now
    procedure :: sheet_at_start
    procedure :: place_along_sheet
    procedure :: describe
    procedure :: forces
    procedure :: trial_forces
    procedure :: n_stiffness_blocks
    procedure :: block_stiffness => stiffness_of_blocks
    procedure :: new_trial
    procedure :: try_block
    procedure :: leave_trial
    procedure :: elastic_copy
    procedure :: take_moduli
    procedure :: tile_loads
    procedure :: tile_costs
    procedure :: share_tiles
    procedure :: work_all
    procedure :: work_own
    procedure :: rows_of_processes
    procedure :: pass_forces
    procedure :: pass_report
    procedure :: finish_forces
    procedure :: is_here
    procedure :: add_traffic
    procedure :: scale_mass
    procedure :: damping_ratio
    procedure :: single
    procedure :: drop_state
    procedure :: elastic_energy
    procedure :: read_points
    procedure :: read_element
    procedure :: set_state
    procedure :: size_of
    procedure :: fields_at
    procedure :: new_fields
    procedure :: spread_fields
    procedure :: begin_step
    procedure :: allow_viscosity
    procedure :: elements_of_block
    procedure :: carry => carry_solid
    procedure :: kernel_name
    procedure :: n_stored
  end type solid_element_t

contains

  !> A patch at rest and without stress; its inertia follows when all parts are there.
  subroutine new_solid_element(element, name, grid, n_points, n_parts, law, viscosity, error)
    class(solid_element_t), intent(inout) :: element
    character(*), intent(in) :: name
    type(nurbs_solid_t), intent(in) :: grid
    integer, intent(in) :: n_points(3), n_parts(3)      !! quadrature, see `new_patch`
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)                !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    integer :: axis

    call check_shape(grid, name, error)
    if (allocated(error)) return
    call new_patch(element%patch, grid, n_points, n_parts, law, viscosity, error)
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
    element%shortest = element%patch%shortest
    element%has_viscosity = element%patch%viscosity%is_active
    element%can_be_cut = .true.
    element%density = law%density
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

  !> The same for all kinds that can be cut. What they do in their own way follows.
  subroutine trim(self, regions, law, error)
    class(solid_element_t), intent(inout) :: self
    type(region_t), intent(in) :: regions(:)
    class(block_law_t), intent(in) :: law
    type(error_t), allocatable, intent(out) :: error
    type(region_t), allocatable :: all_regions(:)
    class(solid_element_t), allocatable :: cut
    type(nurbs_solid_t) :: sheet
    real(wp) :: moments(n_moments, self%n_elements(1), self%n_elements(2)), before, least
    integer :: c, k

    call join_regions(self%regions, regions, all_regions)
    associate (axes => self%grid%axes)
      call cut_cells(all_regions, breaks(axes(1)), breaks(axes(2)), moments)
      if (.not. any(moments(1, :, :) > 0.0_wp)) then
        call fail(error, "curves that leave nothing of the sheet")
        return
      end if
      call self%cut_at_rest(moments, law, cut, error)
      if (allocated(error)) return
      if (self%n_fields > 0) call new_given_fields(cut%patch, self%n_fields)
      before = sum(self%mass)/sum(self%mass_now())
      ! Of the sheet at the start, so that a restart comes to the same.
      least = cut%least_share
      call new_outline_ties(axes(:2), cut%patch%axes(1)%first, cut%patch%axes(2)%first, &
                            0.25_wp*moments(1, :, :), least, self%ties)
    end associate
    if (.not. any(self%ties%is_free)) then
      call fail(error, "curves that leave nothing but slivers of the sheet")
      return
    end if
    ! A rigid motion of the leaders must be one of all: slivers are laid as they continue these.
    call lead_points(self%ties, self%motion%x)
    call self%take_cut(cut)
    call move_alloc(all_regions, self%regions)
    self%n_evaluated = n_lanes*product(self%rule%n)*self%patch%n_blocks
    self%buffers = new_tile_buffers(self%patch)
    self%mass = before*self%mass_now()
    call give_mass(self%ties, self%mass)
    sheet = self%sheet_at_start()
    self%edge_distance = distances_inside(sheet, self%regions, self%ties%share)
    do c = 1, 3
      do k = 1, size(self%mass, 3)
        where (self%ties%is_idle) self%motion%v(:, :, k, c) = 0.0_wp
      end do
    end do
    if (self%ties%farthest > most_away) call fail(error, "curves that leave a part of the "// &
      "sheet narrower than an element at "//place_text(centre_of(self%patch, &
      self%motion%x, self%ties%lonely))// &
      ": nothing within "//to_text(most_away)//" elements has more than "// &
      rounded_text(100.0_wp*least)//" % of its area inside")
  end subroutine trim

  !> What an outline keeps, without stress: the patch and `least_share` alone are set.
  subroutine cut_at_rest(self, moments, law, cut, error)
    class(solid_element_t), intent(in) :: self
    real(wp), intent(in) :: moments(:, :, :)             !! of the elements, see `cut_cells`
    class(block_law_t), intent(in) :: law
    class(solid_element_t), allocatable, intent(out) :: cut
    type(error_t), allocatable, intent(out) :: error

    allocate (solid_element_t :: cut)
    call new_cut_patch(cut%patch, self%patch, self%grid, moments, law, error)
  end subroutine cut_at_rest

  !> Go on with the patch of `cut_at_rest`: stress and state of whole elements are those before to
  !! the last bit, a point of a cut one takes those of the nearest point of the element.
  subroutine take_cut(self, cut)
    class(solid_element_t), intent(inout) :: self
    class(solid_element_t), intent(inout) :: cut

    call carry_points(self%patch, product(self%rule(:2)%n), cut%patch)
    self%patch = cut%patch
    if (allocated(self%volumes)) deallocate (self%volumes)
  end subroutine take_cut

  !> Lumped mass of the control points, without what scaling has added.
  function mass_now(self) result(mass)
    class(solid_element_t), intent(in) :: self
    real(wp) :: mass(size(self%mass, 1), size(self%mass, 2), size(self%mass, 3))

    if (self%patch%lanes%is_trimmed) then
      mass = 0.0_wp
      call add_whole_masses(self%patch, self%grid, self%density, mass)
      call add_cut_masses(self%patch, self%grid, self%density, mass)
    else
      mass = new_lumped_mass(self%grid, self%density)
    end if
  end function mass_now

  !> The sheet as a solid at the start.
  pure function sheet_at_start(self) result(sheet)
    class(solid_element_t), intent(in) :: self
    type(nurbs_solid_t) :: sheet

    sheet = self%grid
  end function sheet_at_start

  !> Where an outline cuts, points lie elsewhere.
  pure function place_along_sheet(self, element, point) result(place)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: element(3), point(3)
    real(wp) :: place(2)
    integer :: at(2)

    place = [self%rule(1)%points(point(1)), self%rule(2)%points(point(2))]
    if (.not. self%patch%lanes%is_trimmed .or. self%is_outside(element)) return
    at = lane_of_element(self%patch, element)
    place = local_place(self%patch, block_at(self%patch, at(1)), at(2), &
                        row_of_point(self%rule%n, point))
  end function place_along_sheet

  subroutine describe(self, lines)
    class(solid_element_t), intent(in) :: self
    type(string_t), allocatable, intent(inout) :: lines(:)

    call describe_grid(self, lines)
    call describe_outline(self, lines)
  end subroutine describe

  subroutine forces(self, law, dt, report)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    type(force_report_t), intent(out) :: report

    self%patch%n_before = self%n_before
    if (.not. self%motion%rows%is_shared) then
      call internal_forces(self%patch, self%buffers, law, dt, self%motion%x, self%motion%v, &
                           self%motion%internal_force, report)
      return
    end if
    self%is_open = .true.
    call begin_forces(self%patch, self%buffers, law, dt, self%motion%x, self%motion%v, &
                      self%motion%internal_force, self%reports)
  end subroutine forces

  subroutine rows_of_processes(self, last_of, moved_by, n_reported)
    class(solid_element_t), intent(inout) :: self
    integer, allocatable, intent(out) :: last_of(:), moved_by(:, :), n_reported(:)

    if (.not. self%is_by_rows) return
    call find_rows(self%patch, last_of, moved_by, n_reported)
    if (.not. allocated(self%reports)) allocate (self%reports(size(self%buffers)))
  end subroutine rows_of_processes

  subroutine pass_forces(self, partner, is_sent, parcel)
    class(solid_element_t), intent(inout) :: self
    integer, intent(in) :: partner
    logical, intent(in) :: is_sent
    type(parcel_t), intent(inout) :: parcel
    integer :: rows(2), sender

    if (.not. self%is_open) return
    associate (shares => self%motion%rows)
      rows = merge(shares%moved_by(:, partner + 1), [shares%first, shares%last], is_sent)
      sender = merge(shares%ranks%number, partner, is_sent)
    end associate
    call pass_tiles(self%patch, sender, rows, is_sent, self%buffers, parcel, &
                    self%motion%internal_force)
  end subroutine pass_forces

  subroutine pass_report(self, process, is_sent, parcel)
    class(solid_element_t), intent(inout) :: self
    integer, intent(in) :: process
    logical, intent(in) :: is_sent
    type(parcel_t), intent(inout) :: parcel

    call pass_reports(self%patch, process, is_sent, self%reports, parcel)
  end subroutine pass_report

  subroutine finish_forces(self, report)
    class(solid_element_t), intent(inout) :: self
    type(force_report_t), intent(inout) :: report

    if (.not. self%is_open) return
    associate (rows => self%motion%rows)
      call end_forces(self%patch, self%buffers, [rows%first, rows%last], &
                      self%motion%internal_force, self%reports, report)
    end associate
    self%is_open = .false.
  end subroutine finish_forces

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
    if (law%n_state > 0) state = self%patch%state
    if (self%patch%viscosity%is_active) push = self%patch%push
    time = self%patch%time
    increment = self%patch%increment
    call self%forces(law, dt, report)
    call move_alloc(stress, self%patch%stress)
    if (allocated(state)) call move_alloc(state, self%patch%state)
    if (allocated(push)) call move_alloc(push, self%patch%push)
    self%patch%time = time
    self%patch%increment = increment
  end subroutine trial_forces

  pure integer function n_stiffness_blocks(self) result(n)
    class(solid_element_t), intent(in) :: self

    n = merge(self%patch%n_blocks, 0, self%has_own_points)
  end function n_stiffness_blocks

  !> Central differences of the forces by displacements of the control points of an element, eight
  !! elements side by side.
  subroutine stiffness_of_blocks(self, law, dt, amount, first, elements, matrices)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, amount
    integer, intent(in) :: first
    integer, intent(out) :: elements(:, :, :)
    real(wp), intent(out) :: matrices(:, :, :, :)
    real(wp), allocatable :: x(:, :, :, :)
    integer :: b

    self%patch%n_before = self%n_before
    x = self%motion%x + dt*self%motion%v
    !$omp parallel do schedule(static) if (.not. law%is_serial)
    do b = 1, size(matrices, 4)
      elements(:, :, b) = owned_elements(self%patch, first + b - 1)
      call difference_block(self, law, block_at(self%patch, first + b - 1), dt, amount, x, &
                            matrices(:, :, :, b))
    end do
    !$omp end parallel do
  end subroutine stiffness_of_blocks

  subroutine difference_block(self, law, block, dt, amount, x, matrix)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt, amount
    real(wp), intent(in), contiguous :: x(:, :, :, :)
    real(wp), intent(out) :: matrix(:, :, :)
    class(block_trial_t), allocatable :: trial
    real(wp), allocatable :: u(:, :), f(:, :)
    real(wp) :: sense
    integer :: column, side

    call self%new_trial(block, dt, x, trial)
    allocate (f(size(trial%start, 1), 3))
    matrix = 0.0_wp
    do column = 1, size(matrix, 3)
      do side = 1, 2
        sense = 3.0_wp - 2.0_wp*side
        u = trial%start
        call move_column(column, sense*amount, trial%w, u)
        call self%try_block(law, block, dt, u, trial, f)
        call self%leave_trial(trial, block%number)
        call add_column(column, 0.5_wp*sense/amount, trial%w, f, matrix)
      end do
    end do
  end subroutine difference_block

  !> What trials of a block begin with.
  subroutine new_trial(self, block, dt, x, trial)
    class(solid_element_t), intent(in) :: self
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt                     !! of the motion [time]
    real(wp), intent(in), contiguous :: x(:, :, :, :)   !! control points at its end
    class(block_trial_t), allocatable, intent(out) :: trial

    allocate (block_trial_t :: trial)
    call begin_trial(self%patch, block, dt, x, self%motion%v, 6, trial)
  end subroutine new_trial

  !> Forces of a block with its control points at `u`.
  subroutine try_block(self, law, block, dt, u, trial, f)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(inout) :: u(:, :)             !! see `block_trial_t`
    class(block_trial_t), intent(inout) :: trial
    real(wp), intent(out) :: f(:, :)               !! (8*nodes, 3) [force]
    real(wp) :: sums(n_lanes, 4)
    logical :: ok

    call run_kernel(self%patch, law, block, dt, .false., u, u, u, u, f, sums, ok)
  end subroutine try_block

  !> The state of the points as it was before.
  subroutine leave_trial(self, trial, number)
    class(solid_element_t), intent(inout) :: self
    class(block_trial_t), intent(in) :: trial
    integer, intent(in) :: number                  !! of the block

    call end_trial(trial, self%patch, number)
  end subroutine leave_trial

  subroutine elastic_copy(self, copy)
    class(solid_element_t), intent(in) :: self
    class(element_t), allocatable, intent(out) :: copy
    class(solid_element_t), allocatable :: trial

    allocate (trial, source=self)
    call trial%drop_state()
    call move_alloc(trial, copy)
  end subroutine elastic_copy

  !> No stress and no viscosity, and one empty state variable.
  subroutine drop_state(self)
    class(solid_element_t), intent(inout) :: self

    self%has_viscosity = .false.
    associate (patch => self%patch)
      patch%viscosity%is_active = .false.
      deallocate (patch%state)
      allocate (patch%state(n_lanes, size(patch%stress, 2), 1, size(patch%stress, 4), &
                            patch%n_blocks), source=0.0_wp)
      patch%stress = 0.0_wp
    end associate
  end subroutine drop_state

  pure function tile_loads(self) result(loads)
    class(solid_element_t), intent(in) :: self
    real(wp), allocatable :: loads(:)
    integer :: t

    allocate (loads(merge(size(self%patch%tiles), 0, self%is_divisible)))
    do t = 1, size(loads)
      loads(t) = n_elements_of(self%patch, self%patch%tiles(t))
    end do
  end function tile_loads

  subroutine share_tiles(self, ranks, last)
    class(solid_element_t), intent(inout) :: self
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: last(:)

    call share_out(self%patch%shares, ranks, last)
  end subroutine share_tiles

  pure function tile_costs(self, row_costs) result(costs)
    class(solid_element_t), intent(in) :: self
    real(wp), intent(in) :: row_costs(:)
    real(wp), allocatable :: costs(:)

    allocate (costs(0))
    if (allocated(self%patch%shares%ticks)) costs = costs_of_tiles(self%patch, row_costs)
  end function tile_costs

  pure logical function is_here(self, element)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: element(3)

    is_here = is_element_here(self%patch, element)
  end function is_here

  pure subroutine add_traffic(self, traffic)
    class(solid_element_t), intent(in) :: self
    type(traffic_t), intent(inout) :: traffic

    call sum_traffic(self%patch%shares%traffic, traffic)
  end subroutine add_traffic

  subroutine work_own(self)
    class(solid_element_t), intent(inout) :: self

    if (allocated(self%patch%shares%last_of)) call work_own_tiles(self%patch%shares)
  end subroutine work_own

  subroutine work_all(self)
    class(solid_element_t), intent(inout) :: self

    call work_all_tiles(self%patch%shares, size(self%patch%tiles))
  end subroutine work_all

  subroutine take_moduli(self, law)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law

    call set_wave_speed(self%patch%viscosity, law)
  end subroutine take_moduli

  subroutine scale_mass(self, factor)
    class(solid_element_t), intent(inout) :: self
    real(wp), intent(in) :: factor

    self%mass = self%mass*factor
    call scale_viscosity(self%patch%viscosity, factor)
  end subroutine scale_mass

  pure real(wp) function damping_ratio(self, law, omega, omega_bulk)
    class(solid_element_t), intent(in) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: omega, omega_bulk

    damping_ratio = damping_ratio_of(self%patch%viscosity, law%bulk, omega, omega_bulk)
  end function damping_ratio

  subroutine single(self, element, copy)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: element(3)
    class(element_t), allocatable, intent(out) :: copy
    type(solid_element_t), allocatable :: one

    allocate (one)
    call cut_out(self, element, one)
    call move_alloc(one, copy)
  end subroutine single

  !> Make `one` of an element of a solid: its patch, shape, rule and share of the mass, without
  !! stress and viscosity.
  subroutine cut_out(solid, element, one)
    class(solid_element_t), intent(in) :: solid
    integer, intent(in) :: element(3)
    class(solid_element_t), intent(inout) :: one
    real(wp), allocatable :: mass(:, :, :)
    integer :: low(3), high(3), axis

    one%patch = element_patch(solid%patch, solid%grid, element)
    one%buffers = new_tile_buffers(one%patch)
    one%rule = solid%rule
    one%n_elements = 1
    one%shortest = solid%shortest
    low = [(solid%patch%axes(axis)%first(element(axis)), axis=1, 3)]
    high = low + solid%patch%axes%degree
    one%motion%x = solid%grid%points(low(1):high(1), low(2):high(2), low(3):high(3), :)
    one%motion%v = 0.0_wp*one%motion%x
    one%motion%internal_force = one%motion%v
    allocate (mass, mold=solid%grid%weights)
    mass = 0.0_wp
    call add_masses(solid%grid, mass_tables(solid%grid), element, element, &
                    solid%patch%viscosity%density, mass)
    one%mass = mass(low(1):high(1), low(2):high(2), low(3):high(3))
  end subroutine cut_out

  subroutine elastic_energy(self, law, energy)
    class(solid_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(out) :: energy

    real(wp) :: energies(size(self%patch%stress, 4), self%patch%n_blocks)
    integer :: i, n(2)

    if (.not. allocated(self%volumes)) self%volumes = new_point_volumes(self%patch, self%grid)
    associate (stress => self%patch%stress)
      n = [n_lanes*size(stress, 2), size(stress, 4)]
      !$omp parallel do schedule(static) if (size(stress) > parallel_size)
      do i = 1, self%patch%n_blocks
        if (is_block_here(self%patch, i)) &
          call find_row_energies(law, n(1), n(2), stress(:, :, :, :, i), &
                                 self%volumes(:, :, :, i), energies(:, i))
      end do
      !$omp end parallel do
    end associate
    energy = sum_of_blocks(self%patch, n(2), energies)
  end subroutine elastic_energy

  !> By the threads that work the elements.
  subroutine read_points(self, eqps_state, eqps, stress, state)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: eqps_state
    real(wp), intent(inout) :: eqps(:, :, :, :, :, :)
    real(wp), intent(inout) :: stress(:, :, :, :, :, :, :), state(:, :, :, :, :, :, :)

    call read_points_of(self%patch, eqps_state, eqps, stress, state)
    if (self%patch%lanes%is_trimmed) call read_outside(self, eqps_state, eqps, stress, state)
  end subroutine read_points

  !> Outside of an outline the values of the nearest elements inside, with which means over elements
  !! agree.
  pure subroutine read_outside(self, eqps_state, eqps, stress, state)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: eqps_state
    real(wp), intent(inout) :: eqps(:, :, :, :, :, :)
    real(wp), intent(inout) :: stress(:, :, :, :, :, :, :), state(:, :, :, :, :, :, :)
    integer :: e1, e2, e3, from(3)

    do e3 = 1, self%n_elements(3)
      do e2 = 1, self%n_elements(2)
        do e1 = 1, self%n_elements(1)
          if (.not. self%is_outside([e1, e2, e3])) cycle
          associate (at => lane_of_element(self%patch, [e1, e2, e3]))
            from = element_of_lane(self%patch, at(1), at(2))
          end associate
          stress(:, :, :, :, e1, e2, e3) = stress(:, :, :, :, from(1), from(2), from(3))
          state(:, :, :, :, e1, e2, e3) = state(:, :, :, :, from(1), from(2), from(3))
          if (eqps_state > 0) eqps(:, :, :, e1, e2, e3) = eqps(:, :, :, from(1), from(2), from(3))
        end do
      end do
    end do
  end subroutine read_outside

  pure subroutine read_element(self, element, stress, state)
    class(solid_element_t), intent(in) :: self
    integer, intent(in) :: element(3)
    real(wp), intent(out) :: stress(:, :, :, :), state(:, :, :, :)
    integer :: at(2)

    at = lane_of_element(self%patch, element)
    call copy_points(self%patch, self%patch%stress(at(2), :, :, :, at(1)), stress)
    call copy_points(self%patch, self%patch%state(at(2), :, :, :, at(1)), state)
  end subroutine read_element

  !> In all lanes that work the element.
  pure subroutine set_state(self, element, point, values)
    class(solid_element_t), intent(inout) :: self
    integer, intent(in) :: element(3), point(3)
    real(wp), intent(in) :: values(:)
    integer :: b, block, lane, at(2)

    at = place_of_point(self%patch, point)
    do b = 1, self%patch%lanes%n_blocks
      if (self%patch%lanes%is_trimmed) then
        if (self%patch%lanes%row(b) /= element(2)) cycle
      end if
      block = block_number(self%patch, b, element(2), element(3))
      do lane = 1, n_lanes
        if (self%patch%lanes%element(lane, b) == element(1)) &
          self%patch%state(lane, at(1), :size(values), at(2), block) = values
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
                              row_of_point(self%rule%n, point), at(1))
  end function fields_at

  subroutine new_fields(self, n)
    class(solid_element_t), intent(inout) :: self
    integer, intent(in) :: n

    call new_nodal_fields(self, n)
    call new_given_fields(self%patch, n)
  end subroutine new_fields

  subroutine spread_fields(self)
    class(solid_element_t), intent(inout) :: self

    call spread_to_points(self%patch, self%nodal)
  end subroutine spread_fields

  pure subroutine allow_viscosity(self, is_allowed)
    class(solid_element_t), intent(inout) :: self
    logical, intent(in) :: is_allowed

    if (self%patch%viscosity%is_active .eqv. (self%has_viscosity .and. is_allowed)) return
    self%patch%viscosity%is_active = self%has_viscosity .and. is_allowed
    self%patch%push = 0.0_wp
  end subroutine allow_viscosity

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
    character(:), allocatable :: order
    integer, allocatable :: blocks(:)
    integer :: n

    call carry_motion(self, store)
    associate (patch => self%patch)
      ! The names hold the order of the points, without which the values mean nothing.
      order = "_"//to_text(patch%together)
      call find_blocks_here(patch, blocks)
      n = patch%n_blocks
      call carry_columns(store, "stress"//order, size(patch%stress)/n, n, patch%stress, blocks)
      call carry_columns(store, "state"//order, size(patch%state)/n, n, patch%state, blocks)
      if (size(patch%push, 4) == n) then
        call carry_columns(store, "push", size(patch%push)/n, n, patch%push, blocks)
      else
        call carry_field(store, "push", size(patch%push), patch%push)
      end if
      call carry(store, "patch_time", patch%time)
      call carry(store, "increment", patch%increment)
      call carry(store, "before_step", patch%before_step)
      if (self%n_fields > 0) call carry_given(patch, store)
    end associate
  end subroutine carry_solid

  pure function kernel_name(self) result(name)
    class(solid_element_t), intent(in) :: self
    character(:), allocatable :: name

    name = solid_kernel_name(self%patch%kernel, self%patch%has_context)
  end function kernel_name

  !> Lanes that fill the last block up count.
  pure real(wp) function n_stored(self) result(n)
    class(solid_element_t), intent(in) :: self
    integer :: i

    n = stored_motion(self)
    associate (patch => self%patch)
      n = n + size(patch%stress) + size(patch%state) + size(patch%push)
      if (allocated(patch%weights)) n = n + size(patch%weights)
      if (allocated(patch%rational)) n = n + size(patch%rational)
      if (allocated(patch%reference)) n = n + size(patch%reference)
      if (allocated(patch%element_size)) n = n + size(patch%element_size)
      if (allocated(patch%viscosity%length)) n = n + size(patch%viscosity%length)
      n = n + size(patch%lanes%values) + size(patch%lanes%slopes) + size(patch%lanes%weights)
      do i = 1, 3
        n = n + size(patch%axes(i)%values) + size(patch%axes(i)%slopes)
      end do
    end associate
    do i = 1, size(self%buffers)
      n = n + size(self%buffers(i)%force)
    end do
  end function n_stored

end module solid_element
