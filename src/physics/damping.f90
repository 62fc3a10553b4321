!> Damping in proportion to the mass, as an effect on the velocities; dynamic relaxation, which
!! chooses it in every step.
module damping
  use kinds, only: wp
  use state_store, only: state_store_t, carry, has_state
  use blank, only: assembly_t, blank_t
  use thickness_masses, only: column_directions, shrink_differences, column_differences
  use element, only: element_t
  use body_parts, only: field_t, carry_fields
  use row_shares, only: gather_rows
  use effect, only: effect_t, instant_t, previous_increment, effect_slot_t
  use vibration, only: fixed_t
  use residual_decay, only: decay_t, note_residuals
  use text, only: rounded_text
  implicit none
  private

  public :: free_forces
  public :: start_damping, relaxation_outcome, find_decay

  !> Forces -alpha m v at all control points. v is the mean of the velocities half a step before
  !! and after, so any alpha keeps the stable step.
  type, extends(effect_t), public :: damping_t
    real(wp) :: alpha = 0.0_wp                     !! [1/time]
    type(field_t), allocatable :: before(:)        !! forces of the last step, by patch
  contains
    procedure :: apply
    procedure :: carry => carry_damping
    procedure :: sum_rows
    procedure :: is_by_rows => takes_some_rows
    procedure :: join_rows
    procedure, nopass :: rank => rank_of_damping
  end type damping_t

  !> Damping chosen anew in every step. `is_kinetic`: none, but all motion stops where the kinetic
  !! energy has passed a maximum (P. A. Cundall, Explicit finite-difference methods in
  !! geomechanics, 1976). Otherwise critical for the frequency that the motion has now, the Rayleigh
  !! quotient of the last step (P. Underwood, Dynamic relaxation, in: Computational methods for
  !! transient analysis, 1983). At rest is where the kinetic energy is small beside the largest
  !! change of the internal energy since the step of the deck began, and the unbalanced force beside
  !! the largest force since then: what the sheet took up before says nothing about this motion.
  !! Stops are of the fastest modes first and come while slow ones have hardly begun to move, so the
  !! kinetic energy is then the largest of all maxima in a good part of the relaxation.
  type, extends(damping_t), public :: relaxation_t
    logical :: is_kinetic = .false.
    real(wp) :: energy_limit = 0.0_wp, force_limit = 0.0_wp   !! relative
    real(wp) :: settled_from = 0.0_wp              !! time from which loads are constant
    real(wp) :: settled_total = 0.0_wp             !! of these the loads against the time of the run
    type(fixed_t), allocatable :: fixed(:)         !! components that supports hold or tie
    type(field_t), allocatable :: internal_force(:)   !! of the last step, by patch
    real(wp) :: internal_energy = 0.0_wp, kinetic_energy = 0.0_wp
    real(wp) :: last_peak = 0.0_wp, peak = 0.0_wp  !! kinetic, largest of last and this window
    real(wp) :: window_start = 0.0_wp              !! time since the relaxation began
    integer :: n_stops = 0                         !! in this window
    real(wp) :: elapsed = 0.0_wp                   !! time since the relaxation began
    real(wp) :: largest_energy = 0.0_wp, largest_force = 0.0_wp   !! since the step began
    real(wp) :: energy_residual = huge(1.0_wp), force_residual = huge(1.0_wp)   !! relative, now
    real(wp) :: settled_at = 0.0_wp                !! time of rest, where `is_done`
    type(decay_t) :: decay                         !! for the log; begins again at a restart
  contains
    procedure :: apply => relax
    procedure :: carry => carry_relaxation
    procedure :: is_by_rows => needs_all_rows
    procedure :: start
  end type relaxation_t

contains

  !> Before the supports, which have the last word on the velocities.
  pure integer function rank_of_damping() result(rank)
    rank = -1
  end function rank_of_damping

  subroutine apply(self, bodies, instant)
    class(damping_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant

    call damp(self, bodies, instant, self%alpha)
  end subroutine apply

  !> Damp the velocities that the forces alone have led to: v becomes
  !! (v - c v_before)/(1 + c) with c = alpha dt_mean/2, T. Belytschko et al., Nonlinear Finite
  !! Elements, 2nd ed., Wiley 2014, sec. 6.2.1. With c = 1 the motion starts anew from rest here.
  !! The work is that of the forces now and a step before on the way in between. By row the forces
  !! and their work.
  subroutine damp(self, bodies, instant, alpha)
    class(damping_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), intent(in) :: alpha        !! [1/time]
    real(wp), allocatable :: v_before(:, :, :, :), change(:, :, :, :)
    real(wp) :: dt_before, share
    integer :: c, p, j

    dt_before = previous_increment(instant)
    share = 0.5_wp*alpha*instant%dt_mean
    if (.not. allocated(self%by_row)) allocate (self%by_row(4, maxval( &
      [(size(bodies%blank%parts(p)%element%mass, 2), p=1, size(bodies%blank%parts))])))
    self%by_row = 0.0_wp
    do p = 1, size(bodies%blank%parts)
      associate (body => bodies%blank%parts(p)%element, before => self%before(p)%values, &
                 motion => bodies%blank%parts(p)%element%motion)
        associate (first => max(1, motion%rows%first), &
                   last => min(size(body%mass, 2), motion%rows%last))
          v_before = velocities_before(body, instant, first, last)
          change = -(motion%v(:, first:last, :, :) + v_before)*(share/(1.0_wp + share))
          motion%v(:, first:last, :, :) = motion%v(:, first:last, :, :) + change
          if (allocated(body%column_factor)) then
            ! The scaled mass takes up the change.
            call shrink_differences(body%inertia(:, first:last, :), &
                                    column_directions(motion%x(:, first:last, :, :)), &
                                    1.0_wp/body%column_factor(:, first:last), change)
          end if
          do c = 1, 3
            change(:, :, :, c) = change(:, :, :, c)*body%mass(:, first:last, :)/instant%dt_mean
          end do
          do j = first, last
            associate (now => change(:, j - first + 1, :, :), v => v_before(:, j - first + 1, :, :))
              self%by_row(:, j) = self%by_row(:, j) + [(sum(now(:, :, c)), c=1, 3), &
                                    -0.5_wp*dt_before*sum((before(:, j, :, :) + now)*v)]
              before(:, j, :, :) = now
            end associate
          end do
        end associate
      end associate
    end do
    if (.not. bodies%blank%parts(1)%element%motion%rows%is_shared) call self%sum_rows(instant)
  end subroutine damp

  !> Forces and work of all control points.
  pure subroutine sum_rows(self, instant)
    class(damping_t), intent(inout) :: self
    type(instant_t), intent(in) :: instant

    self%force = sum(self%by_row(:3, :), 2)
    self%damping_energy = self%damping_energy + sum(self%by_row(4, :))
  end subroutine sum_rows

  !> A control point needs no other.
  pure logical function takes_some_rows(self) result(is_by_rows)
    class(damping_t), intent(in) :: self

    is_by_rows = .true.
  end function takes_some_rows

  !> The damping of all control points follows from sums over all.
  pure logical function needs_all_rows(self) result(is_by_rows)
    class(relaxation_t), intent(in) :: self

    is_by_rows = .false.
  end function needs_all_rows

  !> The forces of the last step on all control points.
  subroutine join_rows(self, bodies)
    class(damping_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    integer :: n(4)

    n = shape(self%before(1)%values)
    call gather_rows(bodies%blank%parts(1)%element%motion%rows, [n(1), n(2), 3*n(3)], &
                     self%before(1)%values)
  end subroutine join_rows

  !> No force before the first step.
  subroutine start_damping(self, blank)
    class(damping_t), intent(inout) :: self
    type(blank_t), intent(in) :: blank
    integer :: p

    allocate (self%before(size(blank%parts)))
    do p = 1, size(self%before)
      allocate (self%before(p)%values, mold=blank%parts(p)%element%motion%v)
      self%before(p)%values = 0.0_wp
    end do
  end subroutine start_damping

  !> Velocities half a step back, from those that the forces of this instant have led to, of some
  !! rows of control points.
  pure function velocities_before(body, instant, first, last) result(v)
    class(element_t), intent(in) :: body
    type(instant_t), intent(in) :: instant
    integer, intent(in) :: first, last
    real(wp), allocatable :: v(:, :, :, :)
    integer :: c

    associate (motion => body%motion)
      v = motion%v(:, first:last, :, :)
      do c = 1, 3
        v(:, :, :, c) = v(:, :, :, c) - (instant%dt_mean/body%inertia(:, first:last, :)) &
                        *(motion%external_force(:, first:last, :, c) &
                          - motion%internal_force(:, first:last, :, c))
      end do
    end associate
  end function velocities_before

  subroutine carry_damping(self, store)
    class(damping_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    call carry(store, "energy", self%damping_energy)
    call carry_fields(store, "before", self%before)
  end subroutine carry_damping

  !> How the dynamic relaxation among effects went; empty where there is none.
  function relaxation_outcome(supports) result(words)
    type(effect_slot_t), intent(in) :: supports(:)
    character(:), allocatable :: words
    integer :: i

    words = ""
    do i = 1, size(supports)
      select type (item => supports(i)%item)
      type is (relaxation_t)
        words = "not at rest"
        if (item%is_done) words = "at rest from time "//rounded_text(item%settled_at)//" on"
        words = words//": kinetic energy "//rounded_text(item%energy_residual)// &
                " of the internal energy (limit "//rounded_text(item%energy_limit)// &
                "), unbalanced force "//rounded_text(item%force_residual)//" (limit "// &
                rounded_text(item%force_limit)//")"
        if (.not. item%is_done .and. item%energy_residual <= item%energy_limit .and. &
            item%force_residual <= item%force_limit) words = words//"; amplitudes of this step "// &
          "last until "//rounded_text(max(item%settled_from, item%settled_total))// &
          ", before which it does not end"
      end select
    end do
  end function relaxation_outcome

  !> Decay of the residuals of the dynamic relaxation among effects, complete where it is at rest;
  !! not allocated where there is none.
  pure subroutine find_decay(supports, decay)
    type(effect_slot_t), intent(in) :: supports(:)
    type(decay_t), allocatable, intent(out) :: decay
    integer :: i

    do i = 1, size(supports)
      select type (item => supports(i)%item)
      type is (relaxation_t)
        decay = item%decay
        if (item%is_done) decay%fraction = 1.0_wp
      end select
    end do
  end subroutine find_decay

  !> Look at the motion, damp it, and tell whether it has come to rest.
  subroutine relax(self, bodies, instant)
    class(relaxation_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp) :: alpha, kinetic, stiffness, inertia

    if (self%is_done) then
      call damp(self, bodies, instant, 0.0_wp)
      return
    end if
    call look(self, bodies, instant, stiffness, inertia)
    kinetic = 0.5_wp*inertia
    self%elapsed = self%elapsed + instant%dt_mean
    if (self%is_kinetic) then
      alpha = 0.0_wp
      if (kinetic < self%kinetic_energy) then
        alpha = 2.0_wp/instant%dt_mean
        call stop_at_peak(self)
        kinetic = 0.0_wp
      end if
      self%kinetic_energy = kinetic
      kinetic = max(kinetic, self%peak, self%last_peak)
    else
      alpha = 2.0_wp*sqrt(max(stiffness, 0.0_wp)/max(inertia, tiny(1.0_wp)))
    end if
    self%energy_residual = kinetic/max(self%largest_energy, tiny(1.0_wp))
    call damp(self, bodies, instant, alpha)
    if (instant%time < max(self%settled_from, self%settled_total)) return
    self%is_done = self%energy_residual <= self%energy_limit .and. &
                   self%force_residual <= self%force_limit
    if (self%is_done) self%settled_at = instant%time
    call note_residuals(self%decay, [self%energy_residual, self%force_residual], &
                        [self%energy_limit, self%force_limit])
  end subroutine relax

  !> Note the maximum that the kinetic energy has passed. A window ends after three of them and as
  !! much time as went before it.
  pure subroutine stop_at_peak(self)
    class(relaxation_t), intent(inout) :: self
    integer, parameter :: least_stops = 3
    real(wp), parameter :: growth = 2.0_wp

    self%n_stops = self%n_stops + 1
    self%peak = max(self%peak, self%kinetic_energy)
    if (self%n_stops < least_stops .or. self%elapsed < growth*self%window_start) return
    self%last_peak = self%peak
    self%peak = 0.0_wp
    self%window_start = self%elapsed
    self%n_stops = 0
  end subroutine stop_at_peak

  !> Residual of the forces; numerator and denominator of the Rayleigh quotient of the last step.
  subroutine look(self, bodies, instant, stiffness, inertia)
    class(relaxation_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), intent(out) :: stiffness, inertia
    real(wp), dimension(size(bodies%blank%parts)) :: unbalanced, internal, external
    real(wp), allocatable :: v_before(:, :, :, :), change(:, :, :, :)
    integer :: p, c

    if (.not. allocated(self%internal_force)) then
      allocate (self%internal_force(size(bodies%blank%parts)))
      do p = 1, size(self%internal_force)
        self%internal_force(p)%values = bodies%blank%parts(p)%element%motion%internal_force
      end do
    end if
    stiffness = 0.0_wp
    inertia = 0.0_wp
    do p = 1, size(bodies%blank%parts)
      associate (body => bodies%blank%parts(p)%element, &
                 motion => bodies%blank%parts(p)%element%motion)
        v_before = velocities_before(body, instant, 1, size(body%mass, 2))
        change = motion%internal_force - self%internal_force(p)%values
        ! Of a force at a seam a patch takes the share that it has of the mass there, so that every
        ! force counts once.
        do c = 1, 3
          change(:, :, :, c) = change(:, :, :, c)*(body%mass/body%inertia)
        end do
        stiffness = stiffness + sum(v_before*change)/max(previous_increment(instant), tiny(1.0_wp))
        do c = 1, 3
          inertia = inertia + sum(body%mass*v_before(:, :, :, c)**2)
        end do
        if (allocated(body%column_factor)) inertia = inertia + column_inertia(body, v_before)
        self%internal_force(p)%values = motion%internal_force
        unbalanced(p) = norm_of_forces(body, free_forces(self%fixed(p), motion%external_force &
                                                         - motion%internal_force))
        internal(p) = norm_of_forces(body, motion%internal_force)
        external(p) = norm_of_forces(body, motion%external_force)
      end associate
    end do
    self%internal_energy = self%internal_energy + bodies%blank%report%internal_work
    self%largest_energy = max(self%largest_energy, abs(self%internal_energy))
    self%largest_force = max(self%largest_force, norm2(internal), norm2(external))
    self%force_residual = norm2(unbalanced)/max(self%largest_force, tiny(1.0_wp))
  end subroutine look

  !> Forces that move something: none where a support holds; of components that move alike the sum,
  !! at the first of them.
  pure function free_forces(fixed, forces) result(free)
    type(fixed_t), intent(in) :: fixed
    real(wp), intent(in) :: forces(:, :, :, :)
    real(wp), allocatable :: free(:, :, :, :), list(:)
    integer :: i

    free = merge(0.0_wp, forces, fixed%is_fixed)
    if (.not. allocated(fixed%leader)) return
    list = [free]
    do i = 1, size(list)
      if (fixed%leader(i) == i) cycle
      list(fixed%leader(i)) = list(fixed%leader(i)) + list(i)
      list(i) = 0.0_wp
    end do
    free = reshape(list, shape(free))
  end function free_forces

  !> Euclidean norm of forces, those at seams by the patch's share of the mass there.
  pure real(wp) function norm_of_forces(body, forces) result(norm)
    class(element_t), intent(in) :: body
    real(wp), intent(in) :: forces(:, :, :, :)
    real(wp) :: of_component(3)
    integer :: c

    do c = 1, 3
      of_component(c) = norm2(sqrt(body%mass/body%inertia)*forces(:, :, :, c))
    end do
    norm = norm2(of_component)
  end function norm_of_forces

  !> What scaled columns add to the sum of mass times squared velocity.
  pure real(wp) function column_inertia(body, v) result(inertia)
    class(element_t), intent(in) :: body
    real(wp), intent(in) :: v(:, :, :, :)
    real(wp), allocatable :: differences(:, :, :)
    integer :: k

    inertia = 0.0_wp
    differences = column_differences(body%inertia, column_directions(body%motion%x), v)
    do k = 1, size(differences, 3)
      inertia = inertia + sum((body%column_factor - 1.0_wp)*body%mass(:, :, k) &
                              *differences(:, :, k)**2)
    end do
  end function column_inertia

  !> Loads that begin with the step of the relaxation settle so much later.
  subroutine start(self, time)
    class(relaxation_t), intent(inout) :: self
    real(wp), intent(in) :: time

    self%settled_from = self%settled_from + time
  end subroutine start

  !> How it went, in words.
  subroutine carry_relaxation(self, store)
    class(relaxation_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    call self%damping_t%carry(store)
    call carry(store, "internal_energy", self%internal_energy)
    call carry(store, "kinetic_energy", self%kinetic_energy)
    call carry(store, "last_peak", self%last_peak)
    call carry(store, "peak", self%peak)
    call carry(store, "window_start", self%window_start)
    call carry(store, "n_stops", self%n_stops)
    call carry(store, "elapsed", self%elapsed)
    call carry(store, "largest_energy", self%largest_energy)
    call carry(store, "largest_force", self%largest_force)
    call carry(store, "energy_residual", self%energy_residual)
    call carry(store, "force_residual", self%force_residual)
    call carry(store, "settled_at", self%settled_at)
    if (store%is_taking) then
      self%decay = decay_t()
      if (allocated(self%internal_force)) deallocate (self%internal_force)
      if (has_state(store, "internal_force_1")) allocate (self%internal_force, source=self%before)
    end if
    call carry_fields(store, "internal_force", self%internal_force)
  end subroutine carry_relaxation

end module damping
