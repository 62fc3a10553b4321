!> Penalty contact of one face of the blank with one tool.
!!
!! Every secondary point is moved into the tool's frame, the closest point of the tool is found
!! ([CA] R. P. R. Cardoso and O. B. Adetoro (2017), sec. 5), and where the gap (54) is negative the
!! point is pushed out along the normal (55) by stiffness times depth.
!!
!! Points that cannot reach the tool are left alone. The distance to a tool changes by no more than
!! the point moves, and no point of the sheet moves more than the control points around it (convex
!! hull).
!! So each tile of points carries its `travel`: the largest displacement of its control points
!! against the tool, summed over the calls. A point at distance g is skipped until the travel has
!! grown by g.
module contact
  use kinds, only: wp
  use failure, only: error_t, fail
  use tool, only: tool_t
  use secondary_surface, only: secondary_surface_t, gather_forces, add_gathered
  use contact_tiles, only: tile_t, tile_size, cut_tiles, carry_tiles, tile_positions, list_due, &
                           earliest_test, is_worth_threads, face_motion_t, new_face_motion, &
                           advance_motion
  use, intrinsic :: iso_fortran_env, only: int64
  use ranks, only: ranks_t, traffic_t
  use timer, only: clock_ticks
  use row_shares, only: row_shares_t
  use tile_results, only: contact_statistics_t, tile_result_t, count_iterations, add_result, &
                          add_counts, exchange_results, exchange_forces
  use pressed_points, only: pressed_points_t, most_points
  use penalty, only: stiffness_from_mass, no_contact, find_pressed_depths, push_points, &
                     contact_damping_t, new_contact_damping, damp_points
  use friction, only: friction_t, new_friction, apply_friction, apply_static_friction
  use closest_point, only: hit_t, follow, is_beside, lanes_t, follow_lanes, n_lanes
  use tool_search, only: search_tool
  use cell_hierarchy, only: distance_to_leaves
  implicit none
  private

  public :: contact_t, contact_options_t, new_contact, apply_contact, scale_stiffness, &
            schedule_tests, press_contact, add_touching, find_bands, sum_contact, is_worked_here

  real(wp), parameter :: refresh = 0.5_wp       !! travel between searches, of the search distance
  real(wp), parameter :: shallow = 0.02_wp      !! depth of any first touch, of the largest depth

  !> What the deck says about a contact.
  type :: contact_options_t
    real(wp) :: scale = 0.5_wp        !! s of the stiffness s m/dt^2
    real(wp) :: stiffness = 0.0_wp    !! given per area instead, if positive [stress/length]
    real(wp) :: max_depth = 0.0_wp    !! deeper is behind; 0: half of its search distance [length]
    real(wp) :: overhang = 0.0_wp     !! how far beyond the edge a point still touches [length]
    real(wp) :: friction = 0.0_wp     !! coefficient mu of Coulomb friction, 0: none
    real(wp) :: damping = 0.0_wp      !! normal damping, part of the critical, 0: none
    logical :: is_late = .false.      !! it begins when the blank may be in the tool already
    logical :: is_corner_start = .false.   !! search again each time from face corners, as [CA]
  end type contact_options_t

  !> Points of a tile that must be tested; the first `n` of each array are set.
  type :: due_points_t
    integer :: n
    integer :: point(most_points)             !! number on the face
    integer :: place(most_points)             !! of its x among those of the tile
    real(wp) :: x(most_points, 3)             !! positions in the tool's frame [length]
    real(wp) :: depth(most_points)            !! in the tool if positive [length]
    real(wp) :: normal(most_points, 3)        !! of the tool there, unit
  end type due_points_t

  !> One face of the blank against one tool; arrays by secondary point, shape (n_points).
  type :: contact_t
    type(secondary_surface_t) :: secondary
    type(contact_options_t) :: options
    real(wp) :: scale = 0.0_wp               !! s of the stiffness s m/dt^2, also of a given one
    real(wp), allocatable :: stiffness(:)    !! frozen at the start [force/length]
    integer :: n_faces = 0                   !! of the tool
    integer, allocatable :: face(:)          !! face of the tool last touched or seen, 0: none
    real(wp), allocatable :: at(:, :)        !! local coordinates s, t there, shape (2, n_points)
    real(wp), allocatable :: room(:)         !! see `lanes_t`; trimmed tools alone, else not there
    real(wp), allocatable :: test_at(:)      !! travel of the tile at which it is tested [length]
    real(wp), allocatable :: search_at(:)    !! travel at which it is searched again [length]
    real(wp), allocatable :: start(:)        !! depth from which its spring is loaded, `no_contact`
                                             !! where it does not touch [length]
    real(wp), allocatable :: force(:, :)     !! on the point now, shape (n_points, 3) [force]
    type(tile_t), allocatable :: tiles(:)
    real(wp), allocatable :: tile_force(:, :, :, :)
      !! of each tile on its control points when it last touched, shape (most, 3, most, n_tiles)
    type(tile_result_t), allocatable :: results(:)   !! of each tile when it was last due
    type(face_motion_t) :: motion
    logical, allocatable :: is_due(:)        !! tiles that were tested at the last call
    logical, allocatable :: is_touching(:)   !! those with forces, here or from other processes
    integer :: n_across = 1                  !! tiles side by side in a band along the rows
    type(contact_statistics_t) :: statistics
    type(friction_t), allocatable :: friction            !! only where there is some
    type(contact_damping_t), allocatable :: damping      !! likewise
    logical :: is_static = .false.           !! forces balance: springs alone, at their whole load
    class(ranks_t), allocatable :: ranks     !! processes that share the tiles; absent: one
    logical :: is_shared = .false.           !! they do: of its own tiles a process knows the points
    integer, allocatable :: owners(:)        !! numbers of the processes that work the tiles
    type(row_shares_t) :: rows               !! of control points that are known here
    type(traffic_t) :: traffic               !! between them
    integer(int64), allocatable :: ticks(:)  !! work on the tiles since they were shared
    real(wp) :: passed = 0.0_wp              !! energy of loads that moved points on to the tool or
                                             !! off it within static increments [energy]
  end type contact_t

contains

  !> Set up a contact. Rejected: negative options, a depth limit not below the tool's search
  !! distance, a time step or masses that are not positive.
  subroutine new_contact(contact, secondary, tool, mass, dt, options, error)
    type(contact_t), intent(out) :: contact
    type(secondary_surface_t), intent(in) :: secondary
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: mass(secondary%n_net(1), secondary%n_net(2))   !! of control points
    real(wp), intent(in) :: dt      !! largest step expected; the stiffness is frozen for it [time]
    type(contact_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    integer :: room(2), i

    contact%options = options
    if (options%max_depth <= 0.0_wp) contact%options%max_depth = 0.5_wp*tool%search_distance
    if (min(options%scale, options%stiffness, options%max_depth, options%overhang, &
            options%friction, options%damping) < 0.0_wp) then
      call fail(error, "contact with "//tool%name//": options must not be negative")
    else if (contact%options%max_depth >= tool%search_distance) then
      call fail(error, "contact with "//tool%name//": the depth limit must be below the tool's " &
                //"search distance")
    else if (.not. (dt > 0.0_wp .and. all(mass > 0.0_wp))) then
      call fail(error, "contact with "//tool%name//": time step and masses must be positive")
    end if
    if (allocated(error)) return
    contact%secondary = secondary
    contact%n_faces = tool%n_faces
    associate (n => secondary%n_points)
      allocate (contact%stiffness(n), contact%face(n), contact%at(2, n))
      allocate (contact%test_at(n), contact%search_at(n), contact%force(n, 3), source=0.0_wp)
      allocate (contact%start(n), source=no_contact)
      if (tool%is_trimmed) allocate (contact%room(n), source=0.0_wp)
    end associate
    call new_face_motion(contact%motion, secondary%n_net)
    call set_stiffness(contact, mass, dt)
    contact%face = 0
    contact%at = 0.5_wp
    contact%tiles = cut_tiles(secondary)
    do i = 1, 2
      room(i) = maxval(contact%tiles%net_last(i) - contact%tiles%net_first(i)) + 1
    end do
    allocate (contact%tile_force(room(1), 3, room(2), size(contact%tiles)), source=0.0_wp)
    allocate (contact%results(size(contact%tiles)))
    allocate (contact%is_due(size(contact%tiles)), source=.true.)
    allocate (contact%is_touching(size(contact%tiles)), source=.false.)
    contact%n_across = count(contact%tiles%first(2) == contact%tiles(1)%first(2))
    if (options%friction > 0.0_wp) then
      allocate (contact%friction)
      call new_friction(contact%friction, secondary%n_points, options%friction)
    end if
  end subroutine new_contact

  !> Penalty stiffness, and the damping that goes with it where there is some.
  subroutine set_stiffness(contact, mass, dt)
    type(contact_t), intent(inout) :: contact
    real(wp), intent(in) :: mass(contact%secondary%n_net(1), contact%secondary%n_net(2))
    real(wp), intent(in) :: dt
    real(wp), allocatable :: seen(:)   ! m/dt^2 of the mass that each point sees

    allocate (seen(contact%secondary%n_points))
    call stiffness_from_mass(contact%secondary, mass, 1.0_wp, dt, seen)
    if (contact%options%stiffness > 0.0_wp) then
      contact%stiffness = contact%options%stiffness*contact%secondary%area
      contact%scale = maxval(contact%stiffness/seen)
    else
      contact%scale = contact%options%scale
      contact%stiffness = contact%scale*seen
    end if
    if (contact%options%damping > 0.0_wp) then
      allocate (contact%damping)
      call new_contact_damping(contact%damping, contact%options%damping, contact%stiffness, &
                               seen*dt**2)
    end if
  end subroutine set_stiffness

  !> Change the penalty of a new contact by a factor; the damping stays the same part of the
  !! critical one.
  pure subroutine scale_stiffness(contact, factor)
    type(contact_t), intent(inout) :: contact
    real(wp), intent(in) :: factor   !! positive

    contact%scale = factor*contact%scale
    contact%stiffness = factor*contact%stiffness
    if (allocated(contact%damping)) then
      contact%damping%constant = sqrt(factor)*contact%damping%constant
    end if
  end subroutine scale_stiffness

  !> Contact forces of the present positions: `force` and `tool%force` are added to, energy and
  !! deepest penetration are set. Bitwise the same for any number of threads; these share the rows
  !! of control points as they do when they move them.
  !!
  !! Every call is one state after the other: a state left out costs no accuracy, the motion since
  !! the last call is what counts.
  subroutine apply_contact(contact, tool, x, force, energy, max_penetration, dt)
    type(contact_t), intent(inout) :: contact
    type(tool_t), intent(inout) :: tool
    real(wp), intent(in) :: x(:, :, :)          !! control points of the face now, (n_net, 3)
    real(wp), intent(inout) :: force(:, :, :)   !! on them, shape (n_net, 3) [force]
    real(wp), intent(out) :: energy             !! of the springs of touching points [energy]
    real(wp), intent(out) :: max_penetration    !! deepest -g of touching points, 0: none [length]
    real(wp), intent(in) :: dt                  !! since the last call, for damping alone [time]

    type(tile_result_t) :: bands(size(contact%tiles)/contact%n_across)

    call press_contact(contact, tool, x, force, dt)
    call find_bands(contact, bands)
    call sum_contact(contact, tool, energy, max_penetration, bands)
  end subroutine apply_contact

  !> The first half of the same: test the points. Where processes move but some of the rows, those
  !! of the tiles here alone, whose forces `add_touching` adds when those of others are there.
  subroutine press_contact(contact, tool, x, force, dt)
    type(contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(:, :, :)          !! as of `apply_contact`, like the rest
    real(wp), intent(inout) :: force(:, :, :)
    real(wp), intent(in) :: dt
    logical :: are_threads

    are_threads = is_worth_threads(contact%secondary%n_points, contact%is_due)
    call advance_motion(contact%motion, tool%displacement, x)
    contact%is_touching = .false.
    if (are_threads) then
      !$omp parallel
      call work_tiles(contact, tool, x, force, dt)
      !$omp end parallel
    else
      call work_tiles(contact, tool, x, force, dt)   ! a region of one thread costs time, too
    end if
    if (contact%is_shared .and. .not. contact%rows%is_shared) call exchange_tiles(contact, force)
    contact%motion%is_started = .true.
  end subroutine press_contact

  !> Test the tiles that are due and add their forces to the control points; the threads of a region
  !! divide the work.
  subroutine work_tiles(contact, tool, x, force, dt)
    type(contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(:, :, :)
    real(wp), intent(inout) :: force(:, :, :)
    real(wp), intent(in) :: dt
    integer :: due(size(contact%tiles)), n_due, i
    integer(int64) :: start

    call carry_tiles(contact%tiles, contact%motion, [contact%rows%first, contact%rows%last], x, &
                     contact%is_due)
    n_due = 0
    do i = 1, size(contact%tiles)
      if (.not. contact%is_due(i)) cycle
      n_due = n_due + 1
      due(n_due) = i
    end do
    if (n_due == 0) return
    !$omp do schedule(static) private(start)
    do i = 1, n_due
      if (contact%is_shared) then
        if (.not. is_worked_here(contact, due(i))) cycle
        start = clock_ticks()
      end if
      call work_tile(contact, tool, dt, due(i))
      if (contact%is_shared) contact%ticks(due(i)) = contact%ticks(due(i)) + clock_ticks() - start
    end do
    !$omp end do
    if (.not. contact%is_shared) call add_tile_forces(contact, n_due, due, force)
  end subroutine work_tiles

  !> Does this process work a tile?
  pure logical function is_worked_here(contact, tile)
    type(contact_t), intent(in) :: contact
    integer, intent(in) :: tile

    is_worked_here = .not. contact%is_shared
    if (contact%is_shared) is_worked_here = contact%owners(tile) == contact%ranks%number
  end function is_worked_here

  !> The results of all tiles that were due, here and elsewhere, and their forces.
  subroutine exchange_tiles(contact, force)
    type(contact_t), intent(inout) :: contact
    real(wp), intent(inout) :: force(:, :, :)
    integer, allocatable :: due(:), touching(:)
    real(wp), allocatable :: test_at(:)
    type(tile_result_t), allocatable :: results(:)
    integer :: t

    due = pack([(t, t=1, size(contact%tiles))], contact%is_due)
    if (size(due) == 0) return
    test_at = contact%tiles(due)%test_at
    results = contact%results(due)
    call exchange_results(contact%ranks, contact%owners(due), test_at, results, contact%traffic)
    contact%tiles(due)%test_at = test_at
    contact%results(due) = results
    contact%is_touching(due) = results%counts%n_touching > 0
    touching = pack(due, contact%is_touching(due))
    if (size(touching) == 0) return
    call exchange_forces(contact%ranks, touching, contact%owners, contact%tile_force, &
                         contact%traffic)
    call add_tile_forces(contact, size(touching), touching, force)
  end subroutine exchange_tiles

  !> Where processes move but some of the rows: add the forces of all tiles that touch those known
  !! here.
  subroutine add_touching(contact, force)
    type(contact_t), intent(in) :: contact
    real(wp), intent(inout) :: force(:, :, :)   !! shape (n_net, 3) [force]
    integer :: touching(size(contact%tiles)), n, t

    n = 0
    do t = 1, size(contact%tiles)
      if (.not. contact%is_touching(t)) cycle
      n = n + 1
      touching(n) = t
    end do
    if (n == 0) return
    !$omp parallel
    call add_tile_forces(contact, n, touching, force)
    !$omp end parallel
  end subroutine add_touching

  !> Add the forces of tiles that touch to the control points; the threads of a region divide their
  !! rows.
  subroutine add_tile_forces(contact, n_due, due, force)
    type(contact_t), intent(in) :: contact
    integer, intent(in) :: n_due, due(n_due)    !! tiles that were tested
    real(wp), intent(inout) :: force(:, :, :)   !! shape (n_net, 3) [force]
    integer :: i, j

    !$omp do schedule(static)
    do j = max(1, contact%rows%known(1)), min(contact%secondary%n_net(2), contact%rows%known(2))
      do i = 1, n_due
        if (.not. contact%is_touching(due(i))) cycle
        associate (tile => contact%tiles(due(i)))
          if (j < tile%net_first(2) .or. j > tile%net_last(2)) cycle
          call add_gathered(contact%secondary, [tile%net_first(1), j], [tile%net_last(1), j], &
                            size(contact%tile_force, 1), 1, &
                            contact%tile_force(:, :, j - tile%net_first(2) + 1, due(i)), force)
        end associate
      end do
    end do
    !$omp end do nowait
  end subroutine add_tile_forces

  !> What the tiles that are worked here found, band by band of tiles along the rows of the face.
  pure subroutine find_bands(contact, bands)
    type(contact_t), intent(in) :: contact
    type(tile_result_t), intent(out) :: bands(size(contact%tiles)/contact%n_across)
    integer :: t

    do t = 1, size(contact%tiles)
      if (.not. contact%is_due(t)) cycle
      if (contact%rows%is_shared .and. .not. is_worked_here(contact, t)) cycle
      call add_result(contact%results(t), bands((t - 1)/contact%n_across + 1))
    end do
  end subroutine find_bands

  !> The second half: what the tiles that were due found, in the order of their bands.
  subroutine sum_contact(contact, tool, energy, max_penetration, bands)
    type(contact_t), intent(inout) :: contact
    type(tool_t), intent(inout) :: tool
    real(wp), intent(out) :: energy, max_penetration
    type(tile_result_t), intent(in) :: bands(:)   !! all of them
    type(tile_result_t) :: total
    integer :: b

    do b = 1, size(bands)
      call add_result(bands(b), total)
    end do
    energy = total%energy
    max_penetration = total%depth
    tool%force = tool%force + total%reaction
    contact%passed = contact%passed + total%passed
    call add_counts(total%counts, contact%statistics)
    contact%statistics%n_touching = total%counts%n_touching
    contact%statistics%n_calls = contact%statistics%n_calls + 1
    contact%statistics%n_points = contact%statistics%n_points + contact%secondary%n_points
    if (allocated(contact%friction)) &
      contact%friction%energy = contact%friction%energy + total%slip_work
    if (allocated(contact%damping)) contact%damping%energy = contact%damping%energy + total%damped
  end subroutine sum_contact

  !> Test the points of a tile that may have come within reach; their forces on control points.
  subroutine work_tile(contact, tool, dt, index)
    type(contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: dt
    integer, intent(in) :: index   !! number of the tile
    type(tile_result_t) :: result
    type(due_points_t) :: due

    result%longest = max(2*contact%tiles(index)%step, shallow*contact%options%max_depth)
    if (.not. contact%motion%is_started) then
      result%longest = merge(0.0_wp, huge(1.0_wp), contact%options%is_late)
    end if
    associate (tile => contact%tiles(index))
      call place_due(contact, tile, tool%displacement, due)
      call find_depths(contact, tile, tool, due, result)
      call press_due(contact, tile, dt, due, result)
      result%counts%n_tested = due%n
      contact%is_touching(index) = result%counts%n_touching > 0
      if (contact%is_touching(index)) then
        associate (forces => contact%tile_force(:, :, :, index))
          call gather_forces(contact%secondary, contact%force, tile%first, tile%last, &
                             size(forces, 1), size(forces, 3), forces)
        end associate
      end if
      tile%test_at = earliest_test(tile, contact%secondary%n_along, contact%test_at)
    end associate
    contact%results(index) = result
  end subroutine work_tile

  !> Where the points that must be tested are.
  pure subroutine place_due(contact, tile, displacement, due)
    type(contact_t), intent(in) :: contact
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: displacement(3)   !! of the tool [length]
    type(due_points_t), intent(out) :: due
    integer :: i, c
    real(wp) :: x(3*most_points)

    call list_due(tile, contact%secondary%n_along, contact%test_at, due%n, due%point, due%place)
    if (due%n == 0) return
    call tile_positions(tile, contact%secondary, rows_of(due%place(1), due%place(due%n)), &
                        contact%motion%now, x)
    do c = 1, 3
      !$omp simd
      do i = 1, due%n
        due%x(i, c) = x(due%place(i) + (c - 1)*tile_size) - displacement(c)
      end do
    end do
  end subroutine place_due

  !> Rows of a tile from one place to another.
  pure function rows_of(first, last) result(rows)
    integer, intent(in) :: first, last   !! as `list_due` gives them
    integer :: rows(2)

    rows = ([first, last] - 1)/(3*tile_size) + 1
  end function rows_of

  !> Depth and normal of the points that must be tested.
  subroutine find_depths(contact, tile, tool, due, result)
    type(contact_t), intent(inout) :: contact
    type(tile_t), intent(in) :: tile
    type(tool_t), intent(in) :: tool
    type(due_points_t), intent(inout) :: due
    type(tile_result_t), intent(inout) :: result
    integer :: queue(most_points), n_queued, i

    n_queued = 0
    do i = 1, due%n
      if (contact%face(due%point(i)) == 0 .or. tile%travel >= contact%search_at(due%point(i)) &
          .or. contact%options%is_corner_start) then
        call search_point(contact, tile, tool, i, due, result)
      else
        n_queued = n_queued + 1
        queue(n_queued) = i
      end if
    end do
    do i = 1, n_queued, n_lanes
      call follow_points(contact, tile, tool, min(n_lanes, n_queued - i + 1), queue(i:), due, &
                         result)
    end do
  end subroutine find_depths

  !> Forces of the points that were tested; one that was not carries none and did not bear any.
  pure subroutine press_due(contact, tile, dt, due, result)
    type(contact_t), intent(inout) :: contact
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt
    type(due_points_t), intent(in) :: due
    type(tile_result_t), intent(inout) :: result
    type(pressed_points_t) :: pressed
    real(wp), dimension(most_points) :: start, depth
    integer :: list(most_points), i

    pressed%n = 0
    do i = 1, due%n
      list(pressed%n + 1) = i
      start(pressed%n + 1) = contact%start(due%point(i))
      depth(pressed%n + 1) = due%depth(i)
      if (due%depth(i) > 0.0_wp .or. start(pressed%n + 1) >= 0.0_wp) pressed%n = pressed%n + 1
    end do
    if (pressed%n == 0) return
    call take_pressed(contact, tile, due, list, start, depth, pressed)
    do i = 1, pressed%n
      result%depth = max(result%depth, depth(i))
      result%counts%n_touching = result%counts%n_touching + merge(1, 0, depth(i) > 0.0_wp)
    end do
    call find_pressed_depths(pressed%n, result%longest, depth, start)
    if (contact%is_static) then
      call load_points(contact, pressed, depth, result%energy, result%passed)
    else
      call push_points(pressed, depth, result%energy)
      if (allocated(contact%damping)) call damp_points(contact%damping, dt, pressed, result%damped)
    end if
    if (allocated(contact%friction)) then
      if (contact%is_static) then
        call apply_static_friction(contact%friction, contact%secondary%area, pressed, &
                                   result%energy, result%slip_work)
      else
        call apply_friction(contact%friction, pressed, result%energy, result%slip_work)
      end if
    end if
    call keep_pressed(contact, start, pressed, result%reaction)
  end subroutine press_due

  !> Springs along the normal at their whole load, as a static increment balances them. Work is that
  !! of the mean of the forces before and after over the whole increment, as all work is counted; of
  !! a point that came to the tool on the way it is more than its spring stores.
  pure subroutine load_points(contact, pressed, depth, stored, passed)
    type(contact_t), intent(in) :: contact
    type(pressed_points_t), intent(inout) :: pressed
    real(wp), intent(in) :: depth(most_points)   !! that loads the springs [length]
    real(wp), intent(inout) :: stored            !! added to [energy]
    real(wp), intent(inout) :: passed            !! what the springs do not store, added to [energy]
    real(wp) :: before(3)
    integer :: i

    do i = 1, pressed%n
      associate (p => pressed%point(i), k => pressed%stiffness(i))
        pressed%push(i) = k*depth(i)
        before = contact%force(p, :)
        if (allocated(contact%friction)) before = before + k*contact%friction%stretch(:, p)
        stored = stored + 0.5_wp*k*depth(i)**2
        passed = passed - 0.5_wp*dot_product(before + pressed%push(i)*pressed%normal(i, :), &
                                             pressed%moved(i, :)) &
                 - 0.5_wp*(k*depth(i)**2 - dot_product(before, before)/k)
      end associate
    end do
  end subroutine load_points

  !> Points that touch or touched, and how they moved.
  pure subroutine take_pressed(contact, tile, due, list, start, depth, pressed)
    type(contact_t), intent(in) :: contact
    type(tile_t), intent(in) :: tile
    type(due_points_t), intent(in) :: due
    integer, intent(in) :: list(most_points)      !! which of those that are due
    real(wp), intent(in) :: start(most_points), depth(most_points)   !! [length]
    type(pressed_points_t), intent(inout) :: pressed
    real(wp) :: x(3*most_points)                  ! of the state before
    integer :: i, c

    call tile_positions(tile, contact%secondary, &
                        rows_of(due%place(list(1)), due%place(list(pressed%n))), &
                        contact%motion%before, x)
    !$omp simd
    do i = 1, pressed%n
      pressed%point(i) = due%point(list(i))
      pressed%was_touching(i) = start(i) >= 0.0_wp
      pressed%stiffness(i) = contact%stiffness(due%point(list(i)))
    end do
    do c = 1, 3
      associate (displacement => contact%motion%displacement(c) - contact%motion%moved(c))
        !$omp simd
        do i = 1, pressed%n
          pressed%normal(i, c) = merge(due%normal(list(i), c), 0.0_wp, depth(i) > 0.0_wp)
          pressed%moved(i, c) = due%x(list(i), c) &
                                - (x(due%place(list(i)) + (c - 1)*tile_size) - displacement)
          pressed%drag(i, c) = 0.0_wp
        end do
      end associate
    end do
  end subroutine take_pressed

  !> Forces of the points, and what the next call must know of them.
  pure subroutine keep_pressed(contact, start, pressed, reaction)
    type(contact_t), intent(inout) :: contact
    real(wp), intent(in) :: start(most_points)
    type(pressed_points_t), intent(in) :: pressed
    real(wp), intent(inout) :: reaction(3)        !! on the tool, added to [force]
    real(wp) :: force, total
    integer :: i, c

    !$omp simd
    do i = 1, pressed%n
      contact%start(pressed%point(i)) = start(i)
    end do
    do c = 1, 3
      total = 0.0_wp
      !$omp simd private(force) reduction(+: total)
      do i = 1, pressed%n
        force = pressed%push(i)*pressed%normal(i, c) + pressed%drag(i, c)
        total = total + force
        contact%force(pressed%point(i), c) = force
      end do
      reaction(c) = reaction(c) - total
    end do
  end subroutine keep_pressed

  !> Follow up to eight points of a tile from where they were.
  subroutine follow_points(contact, tile, tool, n, queue, due, result)
    type(contact_t), intent(inout) :: contact
    type(tile_t), intent(in) :: tile
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: n, queue(n)     !! which of the points that are due
    type(due_points_t), intent(inout) :: due
    type(tile_result_t), intent(inout) :: result
    type(lanes_t) :: lanes
    real(wp) :: safe
    integer :: lane, i, p, at(n_lanes)

    do lane = 1, n_lanes
      at(lane) = queue(min(lane, n))
    end do
    do lane = 1, n_lanes
      p = due%point(at(lane))
      lanes%face(lane) = contact%face(p)
      lanes%s(lane) = contact%at(1, p)
      lanes%t(lane) = contact%at(2, p)
      lanes%x(lane, 1) = due%x(at(lane), 1)
      lanes%x(lane, 2) = due%x(at(lane), 2)
      lanes%x(lane, 3) = due%x(at(lane), 3)
    end do
    if (tool%is_trimmed) lanes%room = contact%room(due%point(at))
    call follow_lanes(tool, lanes)
    call count_iterations(result%counts, lanes%n_iterations, n)
    do lane = 1, n
      i = at(lane)
      p = due%point(i)
      if (.not. lanes%is_good(lane)) then
        call follow_point(contact, tile, tool, i, due, result)
        cycle
      end if
      safe = max(lanes%gap(lane), -lanes%gap(lane) - contact%options%max_depth, 0.0_wp)
      contact%at(1, p) = lanes%s(lane)
      contact%at(2, p) = lanes%t(lane)
      if (tool%is_trimmed) contact%room(p) = lanes%room(lane)
      contact%test_at(p) = min(tile%travel + safe, contact%search_at(p))
      due%depth(i) = merge(0.0_wp, -lanes%gap(lane), safe > 0.0_wp)
      due%normal(i, 1) = lanes%normal(lane, 1)
      due%normal(i, 2) = lanes%normal(lane, 2)
      due%normal(i, 3) = lanes%normal(lane, 3)
    end do
  end subroutine follow_points

  !> Follow one point that did not settle among the eight.
  subroutine follow_point(contact, tile, tool, i, due, result)
    type(contact_t), intent(inout) :: contact
    type(tile_t), intent(in) :: tile
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: i                     !! which of the points that are due
    type(due_points_t), intent(inout) :: due
    type(tile_result_t), intent(inout) :: result
    type(hit_t) :: hit
    real(wp) :: x(3)

    result%counts%n_fallbacks = result%counts%n_fallbacks + 1
    x = due%x(i, :)
    associate (point => due%point(i))
      call follow(tool, x, contact%face(point), contact%at(:, point), hit)
      call count_iterations(result%counts, hit%n_iterations, 1)
      if (hit%is_converged) then
        contact%test_at(point) = min(contact%search_at(point), &
                                     tile%travel + safe_distance(contact, tool, x, hit))
        call keep_hit(contact, tool, hit, i, due)
      else
        call search_point(contact, tile, tool, i, due, result)
      end if
    end associate
  end subroutine follow_point

  !> Search one point again, and how far it may travel before another point can be the nearest.
  subroutine search_point(contact, tile, tool, i, due, result)
    type(contact_t), intent(inout) :: contact
    type(tile_t), intent(in) :: tile
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: i                     !! which of the points that are due
    type(due_points_t), intent(inout) :: due
    type(tile_result_t), intent(inout) :: result
    type(hit_t) :: hit
    real(wp) :: x(3), safe, rival, step

    x = due%x(i, :)
    step = refresh*tool%search_distance
    call search_tool(tool, x, 2*step, contact%options%is_corner_start, hit)
    result%counts%n_searches = result%counts%n_searches + 1
    call count_iterations(result%counts, hit%n_iterations, 1)
    if (.not. hit%is_converged) then
      result%counts%n_failures = result%counts%n_failures + 1
      if (result%counts%first_failed == 0) result%counts%first_failed = due%point(i)
    end if
    safe = safe_distance(contact, tool, x, hit)
    rival = min(hit%rival, hit%distance + 2*step, tool%search_distance)
    contact%search_at(due%point(i)) = tile%travel &
                                      + max(safe, min(step, 0.5_wp*(rival - hit%distance)))
    contact%test_at(due%point(i)) = tile%travel + safe
    call keep_hit(contact, tool, hit, i, due)
  end subroutine search_point

  !> How far a point may move, at least, before it can touch the tool.
  pure real(wp) function safe_distance(contact, tool, x, hit) result(safe)
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t), intent(in) :: hit

    if (.not. hit%is_converged .and. hit%face == 0) then
      safe = 0.0_wp
    else if (hit%face == 0) then
      safe = max(distance_to_leaves(tool%tree, x), tool%search_distance) &
             - contact%options%max_depth
    else if (hit%gap >= 0.0_wp) then
      safe = hit%distance
    else
      safe = max(hit%overhang - contact%options%overhang, -hit%gap - contact%options%max_depth, &
                 0.0_wp)
    end if
  end function safe_distance

  !> Keep where a point was found, and how deep it is.
  pure subroutine keep_hit(contact, tool, hit, i, due)
    type(contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    type(hit_t), intent(in) :: hit
    integer, intent(in) :: i                     !! which of the points that are due
    type(due_points_t), intent(inout) :: due

    contact%face(due%point(i)) = hit%face
    contact%at(:, due%point(i)) = hit%at
    if (tool%is_trimmed) contact%room(due%point(i)) = 0.0_wp
    due%normal(i, :) = hit%normal
    due%depth(i) = -hit%gap
    if (hit%face == 0 .or. due%depth(i) >= contact%options%max_depth &
        .or. is_beside(tool, hit, contact%options%overhang)) due%depth(i) = 0.0_wp
  end subroutine keep_hit

  !> Let the next call test all points, or every `stride`-th one that has a face near it and no
  !! other, as many as while a tool forms the sheet: for measuring that cost before it happens.
  pure subroutine schedule_tests(contact, stride)
    type(contact_t), intent(inout) :: contact
    integer, intent(in), optional :: stride    !! absent: test all points

    contact%tiles%test_at = 0.0_wp
    contact%test_at = 0.0_wp
    if (present(stride)) then
      contact%test_at = huge(1.0_wp)
      where (contact%face(::stride) > 0) contact%test_at(::stride) = 0.0_wp
    end if
    if (allocated(contact%secondary%whole_area)) then
      where (contact%secondary%area <= 0.0_wp) contact%test_at = huge(1.0_wp)
    end if
  end subroutine schedule_tests

end module contact
