!> Damping in proportion to the mass, as an effect on the velocities.
module damping
  use kinds, only: wp
  use state_store, only: state_store_t, carry
  use assembly, only: assembly_t
  use blank, only: blank_t
  use column_scaling, only: column_directions, shrink_differences
  use element, only: element_t
  use body_parts, only: field_t, carry_fields
  use effect, only: effect_t, instant_t, tally_t, previous_increment
  implicit none
  private

  public :: start_damping, damp, velocities_before

  !> Forces -alpha m v at all control points. v is the mean of the velocities half a step before
  !! and after, so any alpha keeps the stable step.
  type, extends(effect_t), public :: damping_t
    real(wp) :: alpha = 0.0_wp                     !! [1/time]
    real(wp) :: energy = 0.0_wp                    !! taken away since the start
    type(field_t), allocatable :: before(:)        !! forces of the last step, by patch
  contains
    procedure :: apply
    procedure :: carry => carry_damping
    procedure :: tally => tally_damping
    procedure, nopass :: rank => rank_of_damping
  end type damping_t

contains

  !> Before the supports, which have the last word on the velocities.
  pure integer function rank_of_damping() result(rank)
    rank = -1
  end function rank_of_damping

  !> Damp with the constant alpha.
  subroutine apply(self, bodies, instant)
    class(damping_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant

    call damp(self, bodies, instant, self%alpha)
  end subroutine apply

  !> Damp the velocities that the forces alone have led to: v becomes
  !! (v - c v_before)/(1 + c) with c = alpha dt_mean/2, T. Belytschko et al., Nonlinear Finite
  !! Elements, 2nd ed., Wiley 2014, sec. 6.2.1. With c = 1 the motion starts anew from rest here.
  !! The work is that of the forces now and a step before on the way in between.
  subroutine damp(self, bodies, instant, alpha)
    class(damping_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), intent(in) :: alpha        !! [1/time]
    real(wp), allocatable :: v_before(:, :, :, :), change(:, :, :, :)
    real(wp) :: dt_before, share
    integer :: c, p

    dt_before = previous_increment(instant)
    share = 0.5_wp*alpha*instant%dt_mean
    self%force = 0.0_wp
    do p = 1, size(bodies%blank%parts)
      associate (body => bodies%blank%parts(p)%element, &
                 motion => bodies%blank%parts(p)%element%motion)
        v_before = velocities_before(body, instant)
        change = -(motion%v + v_before)*(share/(1.0_wp + share))
        motion%v = motion%v + change
        if (allocated(body%column_factor)) then
          ! The scaled mass takes up the change.
          call shrink_differences(body%inertia, column_directions(motion%x), &
                                  1.0_wp/body%column_factor, change)
        end if
        do c = 1, 3
          change(:, :, :, c) = change(:, :, :, c)*body%mass/instant%dt_mean
          self%force(c) = self%force(c) + sum(change(:, :, :, c))
        end do
      end associate
      self%energy = self%energy &
                    - 0.5_wp*dt_before*sum((self%before(p)%values + change)*v_before)
      call move_alloc(change, self%before(p)%values)
    end do
  end subroutine damp

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

  !> Velocities half a step back, from those that the forces of this instant have led to.
  pure function velocities_before(body, instant) result(v)
    class(element_t), intent(in) :: body
    type(instant_t), intent(in) :: instant
    real(wp), allocatable :: v(:, :, :, :)
    integer :: c

    associate (motion => body%motion)
      allocate (v, mold=motion%v)
      do c = 1, 3
        v(:, :, :, c) = motion%v(:, :, :, c) - (instant%dt_mean/body%inertia) &
                        *(motion%external_force(:, :, :, c) - motion%internal_force(:, :, :, c))
      end do
    end associate
  end function velocities_before

  !> Add the energy taken away.
  subroutine tally_damping(self, tally)
    class(damping_t), intent(in) :: self
    type(tally_t), intent(inout) :: tally

    tally%damping_energy = tally%damping_energy + self%energy
  end subroutine tally_damping

  !> What the effect carries from step to step.
  subroutine carry_damping(self, store)
    class(damping_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    call carry(store, "energy", self%energy)
    call carry_fields(store, "before", self%before)
  end subroutine carry_damping

end module damping
