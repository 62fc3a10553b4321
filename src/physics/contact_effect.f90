!> Contact of one face of the blank with one tool, as an effect of the force stage.
module contact_effect
  use kinds, only: wp
  use text, only: rounded_text
  use state_store, only: state_store_t, carry, carry_array
  use element, only: element_t, part_t, motion_t
  use blank, only: assembly_t
  use effect, only: effect_t, effect_slot_t, instant_t, tally_t, is_from_outside
  use knot_vector, only: breaks
  use nurbs_solid, only: face_axes
  use secondary_surface, only: secondary_surface_t, scatter_forces, areas_inside
  use tool, only: tool_t, to_tool_frame, torque_of
  use contact, only: contact_t, press_contact, add_touching, find_bands, sum_contact, &
                     schedule_tests
  use contact_state, only: carry_contact
  use tile_results, only: tile_result_t
  use contact_trim, only: trim_contact
  use contact_sharing, only: share_contact, join_contact
  use ranks, only: ranks_t
  use row_shares, only: row_shares_t, know_all_rows
  use contact_fields, only: contact_fields_t, add_wear, carry_wear
  use face_penetration, only: depth_samples_t, deep_point_t, find_deepest, trim_samples
  implicit none
  private

  public :: contact_pairs, has_pair, any_load, net_of_pair, trim_pair, trim_surface, face_mass
  public :: forget_depths, measure_depths, depth_of, share_pairs, join_pairs, finish_pair

  !> A contact pair.
  type, extends(effect_t), public :: contact_effect_t
    integer :: tool = 0                    !! index into the tools of the model
    integer :: part = 1                    !! patch of the blank
    integer :: face = 0                    !! of the patch, as the deck numbers them
    integer :: lower(3) = 1, upper(3) = 0  !! control points that bear its forces
    type(contact_t) :: pair
    !> Control points of a face that is not a layer of the grid, and forces on them; allocated only
    !! for such.
    real(wp), allocatable, dimension(:, :, :) :: net, net_force
    real(wp) :: energy = 0.0_wp            !! stored in the penalty springs
    real(wp) :: max_penetration = 0.0_wp   !! deepest since `forget_depths`
    real(wp) :: depth = 0.0_wp             !! deepest now [length]
    real(wp) :: couple(3, 3) = 0.0_wp      !! of a tool that turns: forces on the blank times places
                                           !! in its frame, whose product with a turn is the work
    real(wp) :: thickness = 0.0_wp         !! of the sheet, the measure of depths [length]
    logical :: has_touched = .false.       !! a contact point, at any time so far
    type(depth_samples_t) :: samples       !! for depths between the contact points
    type(deep_point_t) :: deepest          !! of the face, between the contact points too, at the
                                           !! last call of `measure_depths`
    type(deep_point_t) :: greatest         !! of all these
    real(wp) :: greatest_time = 0.0_wp     !! when that was [time]
    logical :: has_warned = .false.        !! of a depth beyond the first limit
    logical :: has_warned_between = .false.   !! of a depth that contact points do not see
    logical :: has_told_failure = .false.  !! that a search failed
    logical :: is_awake = .false.          !! all points are tested in each step
    type(contact_fields_t), allocatable :: fields   !! only where the deck asks for them
  contains
    procedure :: apply
    procedure :: carry => carry_contact_effect
    procedure :: stop
    procedure :: tally => tally_contact
    procedure :: is_by_rows
  end type contact_effect_t

  !> A contact pair where it lies in a list of effects.
  type, public :: contact_view_t
    type(contact_effect_t), pointer :: pair => null()
  end type contact_view_t

contains

  !> The contact pairs among effects, in their order. They are views: what holds the list must be
  !! a target, and a change of the list makes them invalid.
  function contact_pairs(effects) result(pairs)
    type(effect_slot_t), intent(in), target :: effects(:)
    type(contact_view_t), allocatable :: pairs(:)
    type(contact_view_t) :: found(size(effects))
    integer :: i, n

    n = 0
    do i = 1, size(effects)
      select type (item => effects(i)%item)
      type is (contact_effect_t)
        n = n + 1
        found(n)%pair => item
      end select
    end do
    pairs = found(:n)
  end function contact_pairs

  !> Is a tool in a contact pair? Others go where they like.
  logical function has_pair(effects, tool)
    type(effect_slot_t), intent(in) :: effects(:)
    integer, intent(in) :: tool                    !! of the model
    integer :: i

    has_pair = .false.
    do i = 1, size(effects)
      select type (item => effects(i)%item)
      type is (contact_effect_t)
        has_pair = has_pair .or. item%tool == tool
      end select
    end do
  end function has_pair

  !> Is there a force from outside that is not contact?
  logical function any_load(effects)
    type(effect_slot_t), intent(in) :: effects(:)
    integer :: i

    any_load = .false.
    do i = 1, size(effects)
      select type (item => effects(i)%item)
      type is (contact_effect_t)
        cycle
      class default
        any_load = any_load .or. is_from_outside(item)
      end select
    end do
  end function any_load

  !> Control points of the face of a pair now.
  subroutine net_of_pair(pair, parts, net)
    type(contact_effect_t), intent(in) :: pair
    type(part_t), intent(in) :: parts(:)                     !! of the blank
    real(wp), allocatable, intent(out) :: net(:, :, :)       !! [length]

    associate (n => pair%pair%secondary%n_net)
      allocate (net(n(1), n(2), 3))
    end associate
    call parts(pair%part)%element%face_net(pair%face, net)
  end subroutine net_of_pair

  !> Leave out what lies outside of the blank's outline. What the springs of those points hold is
  !! gone with them. Springs too stiff for the masses and the step afterwards become softer.
  subroutine trim_pair(pair, body, dt)
    type(contact_effect_t), intent(inout) :: pair
    class(element_t), intent(in) :: body
    real(wp), intent(in), optional :: dt      !! largest step to come; absent: as before [time]
    type(secondary_surface_t) :: trimmed
    real(wp) :: lost

    if (.not. allocated(body%regions)) return
    trimmed = pair%pair%secondary
    call trim_surface(trimmed, body)
    if (present(dt)) then
      call trim_contact(pair%pair, trimmed%area, lost, &
                        face_mass(body, reshape([pair%lower, pair%upper], [3, 2]), pair%face), dt)
    else
      call trim_contact(pair%pair, trimmed%area, lost)
    end if
    associate (axes => body%grid%axes)
      call trim_samples(pair%samples, pair%pair, breaks(axes(1)), breaks(axes(2)), &
                        body%ties%share, body%regions)
    end associate
    pair%energy = pair%energy - lost
    pair%external_work = pair%external_work - lost
  end subroutine trim_pair

  !> Lumped mass of the control points that bear the forces of a face.
  pure function face_mass(body, bounds, face) result(mass)
    class(element_t), intent(in) :: body
    integer, intent(in) :: bounds(3, 2), face         !! first and last of them; of the patch
    real(wp), allocatable :: mass(:, :)
    integer :: n(2)

    n = body%grid%axes(face_axes(face))%n_basis
    mass = reshape(body%mass(bounds(1, 1):bounds(1, 2), bounds(2, 1):bounds(2, 2), &
                             bounds(3, 1):bounds(3, 2)), n)
    ! Those outside an outline, or that follow others at its edge, limit no spring.
    where (mass <= 0.0_wp) mass = maxval(mass)
  end function face_mass

  !> Areas of the points of a face that the outline of the blank leaves.
  subroutine trim_surface(secondary, body)
    type(secondary_surface_t), intent(inout) :: secondary
    class(element_t), intent(in) :: body

    if (.not. allocated(body%regions)) return
    if (.not. allocated(secondary%whole_area)) secondary%whole_area = secondary%area
    associate (axes => body%grid%axes)
      secondary%area = reshape(areas_inside(secondary, breaks(axes(1)), breaks(axes(2)), &
                                            body%ties%share, body%regions), [secondary%n_points])
    end associate
  end subroutine trim_surface

  !> Several processes work the points of all pairs among effects from here on; without them each
  !! works all. Wear needs the points in each increment.
  subroutine share_pairs(effects, ranks, rows, may_move)
    type(effect_slot_t), intent(inout), target :: effects(:)
    class(ranks_t), intent(in), optional :: ranks
    type(row_shares_t), intent(in), optional :: rows   !! of control points
    logical, intent(in), optional :: may_move          !! they are dealt out anew
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      pairs(i)%pair%pair%is_shared = .false.
      call know_all_rows(pairs(i)%pair%pair%rows)
      if (.not. present(ranks)) cycle
      if (allocated(pairs(i)%pair%fields)) then
        if (pairs(i)%pair%fields%has_wear) cycle
      end if
      call share_contact(pairs(i)%pair%pair, ranks, rows, may_move)
    end do
  end subroutine share_pairs

  !> What is known of the points of all pairs, see `join_contact`.
  subroutine join_pairs(effects, is_everywhere, are_places)
    type(effect_slot_t), intent(inout), target :: effects(:)
    logical, intent(in) :: is_everywhere, are_places
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      call join_contact(pairs(i)%pair%pair, is_everywhere, are_places)
    end do
  end subroutine join_pairs

  !> For all pairs among effects a new greatest depth begins.
  subroutine forget_depths(effects)
    type(effect_slot_t), intent(inout), target :: effects(:)
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      pairs(i)%pair%max_penetration = 0.0_wp
    end do
  end subroutine forget_depths

  !> Find the deepest places of all faces in their tools, as they were when the effects acted last.
  subroutine measure_depths(effects, tools, time, n_looks)
    type(effect_slot_t), intent(inout), target :: effects(:)
    type(tool_t), intent(in) :: tools(:)
    real(wp), intent(in) :: time
    integer, intent(out) :: n_looks        !! samples looked at
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    n_looks = 0
    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        associate (tool => tools(pair%tool), motion => pair%pair%motion, deepest => pair%deepest)
          if (.not. motion%is_started) cycle
          call find_deepest(pair%samples, pair%pair, tool, motion%now, motion%displacement, deepest)
          n_looks = n_looks + pair%samples%n_checked
          if (tool%is_turning) deepest%x = motion%displacement &
                                   + matmul(tool%rotation, deepest%x - motion%displacement)
          if (.not. deepest%depth > pair%greatest%depth) cycle
          pair%greatest = deepest
          pair%greatest_time = time
        end associate
      end associate
    end do
  end subroutine measure_depths

  !> Greatest depth of all pairs: as measured last, or of a contact point that is deeper now.
  real(wp) function depth_of(effects) result(depth)
    type(effect_slot_t), intent(in), target :: effects(:)
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    depth = 0.0_wp
    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      depth = max(depth, pairs(i)%pair%deepest%depth, pairs(i)%pair%depth)
    end do
  end function depth_of

  subroutine apply(self, bodies, instant)
    class(contact_effect_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    type(tile_result_t) :: bands(size(self%pair%tiles)/self%pair%n_across)
    real(wp) :: couple(3, 3)

    self%pair%is_static = instant%is_static
    if (self%is_awake) call schedule_tests(self%pair)
    associate (tool => bodies%tools(self%tool))
      if (allocated(self%net)) then
        call press_own_face(self, tool, instant%dt, bodies%blank%parts(self%part)%element, couple)
      else
        call press_layer(self, tool, instant%dt, bodies%blank%parts(self%part)%element%motion, &
                         couple)
      end if
      if (self%pair%rows%is_shared) return
      call find_bands(self%pair, bands)
      call sum_pair(self, tool, instant%dt, couple, bands)
    end associate
  end subroutine apply

  !> What the pair does to the tool, and its work.
  subroutine sum_pair(self, tool, dt, couple, bands)
    type(contact_effect_t), intent(inout) :: self
    type(tool_t), intent(inout) :: tool
    real(wp), intent(in) :: dt                  !! since the last call [time]
    real(wp), intent(in) :: couple(3, 3)        !! of a tool that turns, else 0
    type(tile_result_t), intent(in) :: bands(:) !! of its contact points
    real(wp) :: before(3), on_blank(3)

    before = tool%force
    call sum_contact(self%pair, tool, self%energy, self%depth, bands)
    self%max_penetration = max(self%max_penetration, self%depth)
    self%has_touched = self%has_touched .or. self%depth > 0.0_wp
    if (allocated(self%fields)) then
      if (self%fields%has_wear) call add_wear(self%fields, self%pair, tool)
    end if
    on_blank = before - tool%force
    if (tool%is_turning) then
      on_blank = matmul(tool%rotation, on_blank)
      tool%force = before - on_blank
      tool%torque = tool%torque - torque_of(tool, on_blank, couple)
    end if
    ! The tool's own motion does the external work of this pair.
    self%external_work = self%external_work + 0.5_wp*dt &
                         *(sum((self%force + on_blank)*tool%velocity) &
                           + sum((self%couple + couple)*tool%rotation_rate))
    self%force = on_blank
    self%couple = couple
  end subroutine sum_pair

  !> Where processes move but some of the rows: the forces of all tiles are there, and what their
  !! bands found.
  subroutine finish_pair(pair, bodies, dt, bands)
    type(contact_effect_t), intent(inout) :: pair
    type(assembly_t), intent(inout) :: bodies
    real(wp), intent(in) :: dt                  !! since the last call [time]
    type(tile_result_t), intent(in) :: bands(:)
    real(wp), parameter :: no_couple(3, 3) = 0.0_wp

    associate (body => bodies%blank%parts(pair%part)%element)
      if (allocated(pair%net)) then
        call add_touching(pair%pair, pair%net_force)
        if (any(pair%pair%is_touching)) call body%add_face_forces(pair%face, pair%net_force)
      else
        call add_touching(pair%pair, body%motion%external_force(:, :, pair%lower(3), :))
      end if
    end associate
    call sum_pair(pair, bodies%tools(pair%tool), dt, no_couple, bands)
  end subroutine finish_pair

  !> Press a layer of control points, where it is.
  subroutine press_layer(self, tool, dt, motion, couple)
    class(contact_effect_t), intent(inout) :: self
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: dt
    type(motion_t), intent(inout) :: motion
    real(wp), intent(out) :: couple(3, 3)

    associate (low => self%lower, high => self%upper)
      select case ((self%face + 1)/2)
      case (1)
        call press(self, tool, dt, motion%x(low(1), low(2):high(2), low(3):high(3), :), &
                   motion%external_force(low(1), low(2):high(2), low(3):high(3), :), couple)
      case (2)
        call press(self, tool, dt, motion%x(low(1):high(1), low(2), low(3):high(3), :), &
                   motion%external_force(low(1):high(1), low(2), low(3):high(3), :), couple)
      case (3)
        call press(self, tool, dt, motion%x(low(1):high(1), low(2):high(2), low(3), :), &
                   motion%external_force(low(1):high(1), low(2):high(2), low(3), :), couple)
      end select
    end associate
  end subroutine press_layer

  !> Press a face with a net of its own; the control points get its forces only where it touches.
  subroutine press_own_face(self, tool, dt, body, couple)
    class(contact_effect_t), intent(inout) :: self
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: dt
    class(element_t), intent(inout) :: body
    real(wp), intent(out) :: couple(3, 3)

    call body%look_at_faces()
    call body%face_net(self%face, self%net)
    associate (known => self%pair%rows%known, n => size(self%net, 2))
      self%net_force(:, max(1, known(1)):min(n, known(2)), :) = 0.0_wp
    end associate
    call press(self, tool, dt, self%net, self%net_force, couple)
    if (self%pair%rows%is_shared) return   ! `finish_pair` knows what touches
    if (any(self%pair%is_touching)) call body%add_face_forces(self%face, self%net_force)
  end subroutine press_own_face

  !> Contact forces of a face, seen from its tool where that turns, and their couple.
  subroutine press(self, tool, dt, x, force, couple)
    class(contact_effect_t), intent(inout) :: self
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: dt, x(:, :, :)      !! control points of the face, shape (n, m, 3)
    real(wp), intent(inout) :: force(:, :, :)   !! on them [force]
    real(wp), intent(out) :: couple(3, 3)       !! of a tool that turns
    real(wp), allocatable :: seen(:, :, :), push(:, :, :)

    couple = 0.0_wp
    if (.not. tool%is_turning) then
      call press_contact(self%pair, tool, x, force, dt)
      return
    end if
    seen = x
    allocate (push, mold=seen)
    push = 0.0_wp
    call to_tool_frame(tool, size(seen)/3, seen)
    call press_contact(self%pair, tool, seen, push, dt)
    call turn_forces(tool, size(seen)/3, push)
    couple = couple_of(tool, size(seen)/3, seen, push)
    force = force + push
  end subroutine press

  pure subroutine turn_forces(tool, n, force)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: n
    real(wp), intent(inout) :: force(n, 3)     !! on the blank [force]

    force = matmul(force, transpose(tool%rotation))
  end subroutine turn_forces

  pure function couple_of(tool, n, x, force) result(couple)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n, 3)            !! from `to_tool_frame` [length]
    real(wp), intent(in) :: force(n, 3)        !! on the blank [force]
    real(wp) :: couple(3, 3)                   !! [force length]

    couple = matmul(transpose(force), x - spread(tool%displacement, 1, n))
  end function couple_of

  !> The tool goes away, and with it what its springs hold but for their last push.
  subroutine stop(self, bodies, dt)
    class(contact_effect_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: dt
    real(wp), allocatable, dimension(:, :, :) :: net_v, net_force

    associate (n => self%pair%secondary%n_net)
      allocate (net_v(n(1), n(2), 3), net_force(n(1), n(2), 3), source=0.0_wp)
    end associate
    call bodies%blank%parts(self%part)%element%face_velocities(self%face, net_v)
    call scatter_forces(self%pair%secondary, self%pair%force, net_force)
    associate (tool => bodies%tools(self%tool))
      if (tool%is_turning) call turn_forces(tool, size(net_v)/3, net_force)
    end associate
    self%couple = 0.0_wp
    self%external_work = self%external_work - self%energy + 0.5_wp*dt*sum(net_force*net_v)
    self%pair%force = 0.0_wp
    self%pair%scale = 0.0_wp
    self%energy = 0.0_wp
    self%force = 0.0_wp
  end subroutine stop

  !> Of a face along the rows; wear needs the points of all.
  pure logical function is_by_rows(self)
    class(contact_effect_t), intent(in) :: self

    is_by_rows = self%face > 4
    if (allocated(self%fields)) is_by_rows = is_by_rows .and. .not. self%fields%has_wear
  end function is_by_rows

  subroutine tally_contact(self, tally)
    class(contact_effect_t), intent(in) :: self
    type(tally_t), intent(inout) :: tally

    tally%external_work = tally%external_work + self%external_work
    tally%damping_energy = tally%damping_energy + self%pair%passed
    tally%contact_energy = tally%contact_energy + self%energy
    if (allocated(self%pair%friction)) then
      tally%friction_energy = tally%friction_energy + self%pair%friction%energy
    end if
    if (allocated(self%pair%damping)) then
      tally%damping_energy = tally%damping_energy + self%pair%damping%energy
    end if
    tally%max_penetration = max(tally%max_penetration, self%max_penetration)
  end subroutine tally_contact

  !> The state of a pair. Its penalty is shared with the pairs on its face, also those of steps of
  !! the deck that may be new now, and must be what it was; that of a pair that has ended is zero.
  subroutine carry_contact_effect(self, store)
    class(contact_effect_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store
    real(wp), parameter :: round_off = 1.0e-9_wp
    real(wp) :: share

    share = self%pair%scale
    call carry(store, "energy", self%energy)
    call carry(store, "max_penetration", self%max_penetration)
    call carry(store, "depth", self%depth)
    call carry_array(store, "couple", 9, self%couple)
    call carry(store, "has_warned", self%has_warned)
    call carry(store, "has_warned_between", self%has_warned_between)
    call carry(store, "has_touched", self%has_touched)
    call carry(store, "true_depth", self%deepest%depth)
    call carry(store, "greatest_depth", self%greatest%depth)
    call carry_array(store, "greatest_place", 3, self%greatest%x)
    call carry(store, "greatest_time", self%greatest_time)
    call carry_array(store, "wake_at", size(self%samples%wake_at), self%samples%wake_at)
    call carry_array(store, "wake", size(self%samples%wake), self%samples%wake)
    call carry(store, "has_told_failure", self%has_told_failure)
    call carry_contact(self%pair, store)
    if (abs(self%pair%scale - share) > round_off*share .and. store%reason == "") store%reason = &
      self%name//": its penalty is "//rounded_text(share)//" now and was "// &
      rounded_text(self%pair%scale)//", since other tools share it in some step"
    if (self%pair%is_static .and. allocated(self%net)) &
      call carry_array(store, "own_net", size(self%net), self%net)
    if (allocated(self%fields)) call carry_wear(self%fields, store)
  end subroutine carry_contact_effect

end module contact_effect
