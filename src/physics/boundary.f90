!> Prescribed velocity components of control points; zero is a fixed support.
module boundary
  use kinds, only: wp
  use state_store, only: state_store_t, carry
  use blank, only: assembly_t
  use motion_curve, only: curve_value, curve_integral, start_curve
  use knot_vector, only: span_table
  use element, only: element_t, part_t
  use row_shares, only: gather_row_values
  use vibration, only: fixed_t
  use effect, only: effect_t, effect_slot_t, instant_t, previous_increment
  use row_tie, only: row_tie_t, leave_cut_groups
  implicit none
  private

  public :: any_moving, way_of_supports, prescribed_components, move_supports, take_reactions, &
            leave_cut_points, is_there

  !> One component of a list of control points with a common velocity. Applied to the velocities
  !! of the half step, so the control points follow the curve exactly; the reaction is what the
  !! free velocity lacks.
  type, extends(effect_t), public :: boundary_t
    integer :: component = 1
    integer, allocatable :: part(:)             !! patch of each control point, shape (n)
    integer, allocatable :: points(:, :)        !! control indices, shape (3, n), as arrays run
    !> Edges of a shell (bit 0 xi_min, 1 xi_max, 2 eta_min, 3 eta_max) whose clamping holds a point
    !! next to them, 0 where it is held for itself, shape (n).
    integer, allocatable :: edges(:)
    real(wp) :: velocity = 0.0_wp               !! times the curve
    real(wp) :: moved = 0.0_wp                  !! displacement of the last step
    logical :: is_catching = .false.            !! it takes hold of points that move
  contains
    procedure :: apply
    procedure :: carry => carry_boundary
    procedure :: start
    procedure :: stop
    procedure :: sum_rows
    procedure :: is_by_rows
  end type boundary_t

contains

  !> Components of control points whose velocity boundary conditions prescribe in a step of the
  !! deck, by patch.
  function prescribed_components(parts, supports, step) result(fixed)
    type(part_t), intent(in) :: parts(:)               !! the patches
    type(effect_slot_t), intent(in) :: supports(:)
    integer, intent(in) :: step
    type(fixed_t), allocatable :: fixed(:)
    integer :: i, p

    allocate (fixed(size(parts)))
    do p = 1, size(fixed)
      associate (n => parts(p)%element%grid%axes%n_basis)
        allocate (fixed(p)%is_fixed(n(1), n(2), n(3), 3), source=.false.)
      end associate
    end do
    do i = 1, size(supports)
      select type (item => supports(i)%item)
      type is (boundary_t)
        if (item%first_step > step .or. item%last_step < step) cycle
        do p = 1, size(item%points, 2)
          associate (at => item%points(:, p))
            fixed(item%part(p))%is_fixed(at(1), at(2), at(3), item%component) = .true.
          end associate
        end do
      type is (row_tie_t)
        if (item%first_step <= step .and. item%last_step >= step) call add_leaders(item, fixed)
      end select
    end do
  end function prescribed_components

  !> Name the first of each group of components that move alike.
  pure subroutine add_leaders(tie, fixed)
    type(row_tie_t), intent(in) :: tie
    type(fixed_t), intent(inout) :: fixed(:)
    integer :: g, i, p, n(3), at(3), first, k

    first = 1
    do g = 1, size(tie%last)
      do k = first, tie%last(g)
        p = tie%part(k)
        n = shape(fixed(p)%is_fixed(:, :, :, 1))
        if (.not. allocated(fixed(p)%leader)) &
          fixed(p)%leader = [(i, i=1, size(fixed(p)%is_fixed))]
        at = tie%points(:, k)
        i = at(1) + n(1)*(at(2) - 1 + n(2)*(at(3) - 1 + n(3)*(tie%component - 1)))
        at = tie%points(:, first)
        fixed(p)%leader(i) = at(1) + n(1)*(at(2) - 1 + n(2)*(at(3) - 1 + n(3)*(tie%component - 1)))
      end do
      first = tie%last(g) + 1
    end do
  end subroutine add_leaders

  !> Let go the rows of control points that are held next to an edge of a shell where an outline has
  !! cut that edge away, and take what follows others at the outline out of what moves alike.
  subroutine leave_cut_points(supports, parts)
    type(effect_slot_t), intent(inout) :: supports(:)
    type(part_t), intent(in) :: parts(:)
    logical, allocatable :: stays(:)
    integer :: i, p

    if (.not. any([(allocated(parts(p)%element%ties%share), p=1, size(parts))])) return
    do i = 1, size(supports)
      select type (item => supports(i)%item)
      type is (boundary_t)
        stays = [(is_there(parts(item%part(p))%element, item%points(:, p), item%edges(p)), &
                  p=1, size(item%part))]
        item%part = pack(item%part, stays)
        item%edges = pack(item%edges, stays)
        item%points = reshape(pack(item%points, spread(stays, 1, 3)), [3, count(stays)])
      type is (row_tie_t)
        call leave_cut_groups(item, parts)
      end select
    end do
  end subroutine leave_cut_points

  !> Is one of the edges still there that hold a control point, if it is not held for itself?
  pure logical function is_there(element, at, edges)
    class(element_t), intent(in) :: element
    integer, intent(in) :: at(3), edges
    integer :: edge, axis, along, last, e
    integer, allocatable :: spans(:)              ! control points from span - degree to span

    is_there = .true.
    if (edges == 0 .or. .not. allocated(element%ties%share)) return
    is_there = .false.
    do edge = 0, 3
      if (.not. btest(edges, edge)) cycle
      axis = merge(1, 2, edge < 2)
      along = 3 - axis
      last = merge(element%n_elements(axis), 1, mod(edge, 2) == 1)
      spans = span_table(element%grid%axes(along))
      do e = 1, size(spans)
        if (at(along) < spans(e) - element%grid%axes(along)%degree .or. at(along) > spans(e)) cycle
        if (axis == 1) is_there = .not. element%is_outside([last, e, 1])
        if (axis == 2) is_there = .not. element%is_outside([e, last, 1])
        if (is_there) return
      end do
    end do
  end function is_there

  !> Does a support move its points?
  pure logical function any_moving(supports)
    type(effect_slot_t), intent(in) :: supports(:)
    integer :: i

    any_moving = .false.
    do i = 1, size(supports)
      select type (item => supports(i)%item)
      type is (boundary_t)
        any_moving = any_moving .or. abs(item%velocity) > 0.0_wp
      end select
    end do
  end function any_moving

  !> Longest way of a support from one time to another.
  pure real(wp) function way_of_supports(supports, from, to) result(way)
    type(effect_slot_t), intent(in) :: supports(:)
    real(wp), intent(in) :: from, to
    integer :: i

    way = 0.0_wp
    do i = 1, size(supports)
      select type (item => supports(i)%item)
      type is (boundary_t)
        way = max(way, abs(item%velocity*(curve_integral(item%curve, to) &
                                          - curve_integral(item%curve, from))))
      end select
    end do
  end function way_of_supports

  !> Give the points that supports move in a static increment their mean velocities.
  subroutine move_supports(supports, parts, time, dt)
    type(effect_slot_t), intent(inout) :: supports(:)
    type(part_t), intent(inout) :: parts(:)
    real(wp), intent(in) :: time, dt                   !! its end, and how long it is [time]
    real(wp) :: velocity
    integer :: i, p

    do i = 1, size(supports)
      select type (item => supports(i)%item)
      type is (boundary_t)
        velocity = item%velocity/dt*(curve_integral(item%curve, time) &
                                     - curve_integral(item%curve, time - dt))
        item%moved = velocity*dt
        do p = 1, size(item%points, 2)
          associate (at => item%points(:, p))
            parts(item%part(p))%element%motion%v(at(1), at(2), at(3), item%component) = velocity
          end associate
        end do
      end select
    end do
  end subroutine move_supports

  !> Reactions of supports where forces balance, and their work on the way that they have moved
  !! last. A force at a seam counts by the share that a patch has of the mass there.
  subroutine take_reactions(supports, parts)
    type(effect_slot_t), intent(inout) :: supports(:)
    type(part_t), intent(in) :: parts(:)
    real(wp) :: total
    integer :: i, p

    do i = 1, size(supports)
      select type (item => supports(i)%item)
      type is (boundary_t)
        total = 0.0_wp
        do p = 1, size(item%points, 2)
          associate (at => item%points(:, p), c => item%component, &
                     body => parts(item%part(p))%element)
            total = total + body%mass(at(1), at(2), at(3))/body%inertia(at(1), at(2), at(3)) &
                    *(body%motion%internal_force(at(1), at(2), at(3), c) &
                      - body%motion%external_force(at(1), at(2), at(3), c))
          end associate
        end do
        item%external_work = item%external_work + 0.5_wp*(item%force(item%component) + total) &
                             *item%moved
        item%force(item%component) = total
        item%moved = 0.0_wp
        item%is_catching = .false.
      end select
    end do
  end subroutine take_reactions

  pure logical function is_by_rows(self)
    class(boundary_t), intent(in) :: self

    is_by_rows = .true.
  end function is_by_rows

  !> Replace the velocities and record the total reaction and its work: by row the momentum that the
  !! points lacked.
  subroutine apply(self, bodies, instant)
    class(boundary_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp) :: velocity
    integer :: p, n

    if (self%is_catching) call count_catch(self, bodies, instant)
    velocity = self%velocity*curve_value(self%curve, instant%time + 0.5_wp*instant%dt)
    if (.not. allocated(self%by_row)) self%by_row = no_values(self, bodies%blank%parts)
    self%by_row = 0.0_wp
    p = 1
    do while (p <= size(self%points, 2))
      associate (i => self%points(1, p), j => self%points(2, p), k => self%points(3, p), &
                 c => self%component, body => bodies%blank%parts(self%part(p))%element)
        n = row_length(self, p, size(body%mass, 1))
        if (j >= body%motion%rows%first .and. j <= body%motion%rows%last) &
          call hold_row(n, velocity, body%mass(i, j, k), body%motion%v(i, j, k, c), &
                        self%by_row(1, j))
      end associate
      p = p + n
    end do
    if (.not. bodies%blank%parts(1)%element%motion%rows%is_shared) call self%sum_rows(instant)
  end subroutine apply

  !> The reaction and its work, when the momentum of all rows is there.
  pure subroutine sum_rows(self, instant)
    class(boundary_t), intent(inout) :: self
    type(instant_t), intent(in) :: instant
    real(wp) :: total

    total = sum(self%by_row(1, :))/instant%dt_mean
    self%external_work = self%external_work &
                         + 0.5_wp*(self%force(self%component) + total)*self%moved
    self%force(self%component) = total
    self%moved = self%velocity*curve_value(self%curve, instant%time + 0.5_wp*instant%dt)*instant%dt
  end subroutine sum_rows

  !> A zero for each row of control points along axis 2 that points lie in, of all patches together.
  pure function no_values(self, parts) result(values)
    class(boundary_t), intent(in) :: self
    type(part_t), intent(in) :: parts(:)
    real(wp), allocatable :: values(:, :)
    integer :: n

    n = size(parts(1)%element%mass, 2)
    if (size(self%points, 2) > 0) n = max(n, maxval(self%points(2, :)))
    allocate (values(1, n), source=0.0_wp)
  end function no_values

  !> How many points from point `p` of the list on follow each other in the arrays: all to the end
  !! of the row along axis 1, or else this one alone.
  pure integer function row_length(self, p, n) result(length)
    class(boundary_t), intent(in) :: self
    integer, intent(in) :: p
    integer, intent(in) :: n       !! control points of its patch along axis 1

    length = n - self%points(1, p) + 1
    if (p + length - 1 > size(self%part)) then
      length = 1
    else if (self%part(p + length - 1) /= self%part(p) .or. &
             any(self%points(:, p + length - 1) /= [n, self%points(2, p), self%points(3, p)])) then
      length = 1
    end if
  end function row_length

  !> Points that follow each other take the velocity; add the momentum that they lack.
  pure subroutine hold_row(n, velocity, mass, v, lack)
    integer, intent(in) :: n
    real(wp), intent(in) :: velocity, mass(n)
    real(wp), intent(inout) :: v(n), lack
    integer :: i

    !$omp simd reduction(+:lack)
    do i = 1, n
      lack = lack + mass(i)*(velocity - v(i))
      v(i) = velocity
    end do
  end subroutine hold_row

  subroutine carry_boundary(self, store)
    class(boundary_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    call carry(store, "moved", self%moved)
    call carry(store, "is_catching", self%is_catching)
  end subroutine carry_boundary

  !> Points that moved freely are held from now on: the work of the first reaction over the way
  !! that each of them has made in the step before.
  subroutine count_catch(self, bodies, instant)
    class(boundary_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp) :: velocity, before, dt_before
    real(wp), allocatable :: works(:, :)
    integer :: p

    velocity = self%velocity*curve_value(self%curve, instant%time + 0.5_wp*instant%dt)
    dt_before = previous_increment(instant)
    works = no_values(self, bodies%blank%parts)
    do p = 1, size(self%points, 2)
      associate (i => self%points(1, p), j => self%points(2, p), k => self%points(3, p), &
                 c => self%component, body => bodies%blank%parts(self%part(p))%element)
        associate (motion => body%motion)
          before = motion%v(i, j, k, c) - instant%dt_mean/body%inertia(i, j, k) &
                   *(motion%external_force(i, j, k, c) - motion%internal_force(i, j, k, c))
          works(1, j) = works(1, j) + 0.5_wp*before*dt_before/instant%dt_mean &
                                      *body%mass(i, j, k)*(velocity - motion%v(i, j, k, c))
        end associate
      end associate
    end do
    associate (rows => bodies%blank%parts(1)%element%motion%rows)
      if (rows%is_shared) call gather_row_values(rows, works)
    end associate
    self%external_work = self%external_work + sum(works(1, :))
    self%is_catching = .false.
  end subroutine count_catch

  !> The curve begins with its step; the points may move when they are caught.
  subroutine start(self, time)
    class(boundary_t), intent(inout) :: self
    real(wp), intent(in) :: time

    self%is_catching = .true.
    call start_curve(self%curve, time)
  end subroutine start

  !> The last reaction works over the way to come as it did over the way behind.
  subroutine stop(self, bodies, dt)
    class(boundary_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: dt

    self%external_work = self%external_work + 0.5_wp*self%force(self%component)*self%moved
    self%force = 0.0_wp
    self%moved = 0.0_wp
  end subroutine stop

end module boundary
