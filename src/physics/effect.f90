!> An effect that a scene names: contact, a load, a boundary condition. What a deck does not name
!! has no effect in the lists of the model and so costs nothing.
module effect
  use kinds, only: wp
  use state_store, only: state_store_t, enter_folder, carry, carry_array
  use text, only: to_text
  use timer, only: timer_t, start_watch, stop_watch
  use blank, only: assembly_t
  use ranks, only: traffic_t
  use row_shares, only: row_shares_t, gather_row_values
  use motion_curve, only: curve_t, start_curve
  implicit none
  private

  public :: add_effect, apply_effects, carry_effects, sort_effects, previous_increment
  public :: is_from_outside, any_from_outside, any_by_row, sum_effects

  !> Where the step stands.
  type, public :: instant_t
    real(wp) :: time = 0.0_wp       !! of the positions
    real(wp) :: dt = 0.0_wp         !! increment that led to them (forces) or leads on (velocities)
    real(wp) :: dt_mean = 0.0_wp    !! mean of `dt` and the increment before it (velocities)
    logical :: is_static = .false.  !! forces balance: nothing depends on how fast points move
  end type instant_t

  !> What the effects add to the balances: work since the start, the rest as it is now but for
  !! the penetration.
  type, public :: tally_t
    real(wp) :: external_work = 0.0_wp
    real(wp) :: contact_energy = 0.0_wp    !! stored in the penalty springs now
    real(wp) :: friction_energy = 0.0_wp   !! work done against friction
    real(wp) :: damping_energy = 0.0_wp    !! work done against damping
    real(wp) :: tool_energy = 0.0_wp       !! kinetic, of tools that forces move
    real(wp) :: max_penetration = 0.0_wp   !! deepest since the last row
  end type tally_t

  !> Base of all effects. `apply` is called once a step, at the stage whose list it is in.
  type, abstract, public :: effect_t
    character(:), allocatable :: name
    character(:), allocatable :: note      !! what lists add to the name; not allocated: nothing
    integer :: watch = 0                   !! stopwatch of this effect
    real(wp) :: external_work = 0.0_wp     !! done by this effect on the blank since the start
    real(wp) :: friction_energy = 0.0_wp, damping_energy = 0.0_wp   !! that it took since then
    real(wp) :: tool_energy = 0.0_wp       !! kinetic, of a tool that it moves
    real(wp) :: force(3) = 0.0_wp          !! total force on the blank now
    logical :: is_done = .false.           !! what the step was to reach is reached: it may end
    integer :: first_step = 1, last_step = huge(1)   !! of the deck, in which the effect acts
    integer :: given_step = 1              !! of the deck, that names it: its curve begins there
    type(curve_t) :: curve                 !! factor against time, of an effect that has one
    !> Of an effect on velocities that has sums over control points: those of the rows along axis 2,
    !! of all patches together, at the last call; (numbers, rows).
    real(wp), allocatable :: by_row(:, :)
  contains
    procedure(apply_effect), deferred :: apply
    procedure(carry_effect), deferred :: carry     !! own state into a store, and back
    procedure :: start => start_effect
    procedure :: stop => stop_effect
    procedure :: tally => tally_effect
    procedure :: sum_rows => has_no_sums
    procedure :: is_by_rows => needs_all_rows
    procedure :: widen_shares => needs_no_more
    procedure :: join_rows => has_no_rows
    procedure, nopass :: rank => rank_of_effect    !! effects of a stage act in rising order
  end type effect_t

  !> An effect in a list of mixed kinds.
  type, public :: effect_slot_t
    class(effect_t), allocatable :: item
  end type effect_slot_t

  abstract interface
    !> Act on the bodies at this instant.
    subroutine apply_effect(self, bodies, instant)
      import :: effect_t, assembly_t, instant_t
      class(effect_t), intent(inout) :: self
      type(assembly_t), intent(inout) :: bodies
      type(instant_t), intent(in) :: instant
    end subroutine apply_effect

    !> Put what the effect carries from step to step, beside what the base holds, or take it back
    !! into an effect that was set up in the same way, as the store stands. None: nothing to do.
    subroutine carry_effect(self, store)
      import :: effect_t, state_store_t
      class(effect_t), intent(inout) :: self
      type(state_store_t), intent(inout) :: store
    end subroutine carry_effect
  end interface

contains

  !> The time increment before `dt`, at the stage of velocities [time].
  pure real(wp) function previous_increment(instant)
    type(instant_t), intent(in) :: instant

    previous_increment = 2.0_wp*instant%dt_mean - instant%dt
  end function previous_increment

  !> Append a copy of an effect to a list, whose others are moved: they may hold much, and
  !! gfortran 12 does not free what array constructors copy of them.
  subroutine add_effect(effects, item)
    type(effect_slot_t), allocatable, intent(inout) :: effects(:)
    class(effect_t), intent(in) :: item
    type(effect_slot_t), allocatable :: grown(:)
    integer :: i

    allocate (grown(size(effects) + 1))
    do i = 1, size(effects)
      call move_alloc(effects(i)%item, grown(i)%item)
    end do
    allocate (grown(size(grown))%item, source=item)
    call move_alloc(grown, effects)
  end subroutine add_effect

  !> Let the effects of a list act in their order, each timed by its own watch.
  subroutine apply_effects(effects, timer, bodies, instant)
    type(effect_slot_t), intent(inout) :: effects(:)
    type(timer_t), intent(inout) :: timer
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    integer :: i

    do i = 1, size(effects)
      associate (item => effects(i)%item)
        call start_watch(timer, item%watch)
        call item%apply(bodies, instant)
        call stop_watch(timer, item%watch)
      end associate
    end do
  end subroutine apply_effects

  !> Is the effect of a force stage a force from outside, and does not weigh the sum of these?
  pure logical function is_from_outside(item)
    class(effect_t), intent(in) :: item

    is_from_outside = item%rank() <= 0
  end function is_from_outside

  !> Is one of them?
  pure logical function any_from_outside(effects)
    type(effect_slot_t), intent(in) :: effects(:)
    integer :: i

    any_from_outside = .false.
    do i = 1, size(effects)
      any_from_outside = any_from_outside .or. is_from_outside(effects(i)%item)
    end do
  end function any_from_outside

  !> Bring the effects of a stage into the order in which they act; of equal rank they keep theirs.
  !! They are moved, not copied: effects may hold much.
  subroutine sort_effects(effects)
    type(effect_slot_t), intent(inout) :: effects(:)
    type(effect_slot_t) :: slot
    integer :: i, k

    do i = 2, size(effects)
      call move_alloc(effects(i)%item, slot%item)
      do k = i, 2, -1
        if (effects(k - 1)%item%rank() <= slot%item%rank()) exit
        call move_alloc(effects(k - 1)%item, effects(k)%item)
      end do
      call move_alloc(slot%item, effects(k)%item)
    end do
  end subroutine sort_effects

  !> State of a list of effects, each in a folder of its own.
  subroutine carry_effects(effects, folder, store)
    type(effect_slot_t), intent(inout) :: effects(:)
    character(*), intent(in) :: folder
    type(state_store_t), intent(inout) :: store
    integer :: i

    do i = 1, size(effects)
      associate (item => effects(i)%item)
        call enter_folder(store, folder//"/"//to_text(i))
        call carry(store, "external_work", item%external_work)
        call carry_array(store, "total_force", 3, item%force)
        call carry(store, "is_done", item%is_done)
        call item%carry(store)
      end associate
    end do
    call enter_folder(store, "")
  end subroutine carry_effects

  !> The effect begins with a later step of the deck, and its curve with it. Not called in the first
  !! step.
  subroutine start_effect(self, time)
    class(effect_t), intent(inout) :: self
    real(wp), intent(in) :: time           !! at which the step began that names it

    call start_curve(self%curve, time)
  end subroutine start_effect

  !> The last step of the effect is over: its force acts over half of the time step to come, whose
  !! velocities are known, as it did over the half behind. What it has done stays in the balances.
  subroutine stop_effect(self, bodies, dt)
    class(effect_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: dt             !! the time step to come
  end subroutine stop_effect

  !> The sums of all rows are there.
  pure subroutine has_no_sums(self, instant)
    class(effect_t), intent(inout) :: self
    type(instant_t), intent(in) :: instant
  end subroutine has_no_sums

  !> Has an effect that has acted sums over rows?
  pure logical function any_by_row(effects)
    type(effect_slot_t), intent(in) :: effects(:)
    integer :: i

    any_by_row = any([(allocated(effects(i)%item%by_row), i=1, size(effects))])
  end function any_by_row

  !> Where processes move but some of the rows: the sums of all effects on velocities, which have
  !! acted on the rows here.
  subroutine sum_effects(effects, rows, instant, traffic)
    type(effect_slot_t), intent(inout) :: effects(:)
    type(row_shares_t), intent(in) :: rows
    type(instant_t), intent(in) :: instant
    type(traffic_t), intent(inout) :: traffic
    real(wp), allocatable :: values(:, :)
    integer :: first(size(effects)), n, i

    n = 0
    do i = 1, size(effects)
      first(i) = n + 1
      if (allocated(effects(i)%item%by_row)) n = n + size(effects(i)%item%by_row, 1)
    end do
    allocate (values(n, rows%last_of(size(rows%last_of))))
    do i = 1, size(effects)
      associate (item => effects(i)%item)
        if (allocated(item%by_row)) &
          values(first(i):first(i) + size(item%by_row, 1) - 1, :) = item%by_row
      end associate
    end do
    call gather_row_values(rows, values, traffic)
    do i = 1, size(effects)
      associate (item => effects(i)%item)
        if (.not. allocated(item%by_row)) cycle
        item%by_row = values(first(i):first(i) + size(item%by_row, 1) - 1, :)
        call item%sum_rows(instant)
      end associate
    end do
  end subroutine sum_effects

  !> Does the effect act where processes move but some of the rows of control points?
  pure logical function needs_all_rows(self) result(is_by_rows)
    class(effect_t), intent(in) :: self

    is_by_rows = .false.
  end function needs_all_rows

  !> Where they do: first and last row that each process moves, (2, processes), and what the effect
  !! needs in addition.
  pure subroutine needs_no_more(self, moved_by)
    class(effect_t), intent(in) :: self
    integer, intent(inout) :: moved_by(:, :)
  end subroutine needs_no_more

  !> Where they do: what the effect keeps of control points, of all rows at all processes.
  subroutine has_no_rows(self, bodies)
    class(effect_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
  end subroutine has_no_rows

  !> Between those that come first and those that come last.
  pure integer function rank_of_effect() result(rank)
    rank = 0
  end function rank_of_effect

  !> Add what this effect holds to the balances of the run.
  subroutine tally_effect(self, tally)
    class(effect_t), intent(in) :: self
    type(tally_t), intent(inout) :: tally

    tally%external_work = tally%external_work + self%external_work
    tally%friction_energy = tally%friction_energy + self%friction_energy
    tally%damping_energy = tally%damping_energy + self%damping_energy
    tally%tool_energy = tally%tool_energy + self%tool_energy
  end subroutine tally_effect

end module effect
