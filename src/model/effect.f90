!> An effect that a scene names: contact, a load, a boundary condition. What a deck does not name
!! has no effect in the lists of the model and so costs nothing.
module effect
  use kinds, only: wp
  use assembly, only: assembly_t
  implicit none
  private

  !> Where the step stands.
  type, public :: instant_t
    real(wp) :: time = 0.0_wp       !! of the positions
    real(wp) :: dt = 0.0_wp         !! step that led to them (forces) or leads on (velocities)
    real(wp) :: dt_mean = 0.0_wp    !! between the last two half steps (velocities)
  end type instant_t

  !> What the effects add to the balances: work since the start, the rest as it is now but for
  !! the penetration.
  type, public :: tally_t
    real(wp) :: external_work = 0.0_wp
    real(wp) :: contact_energy = 0.0_wp    !! stored in the penalty springs now
    real(wp) :: friction_energy = 0.0_wp   !! work done against friction
    real(wp) :: damping_energy = 0.0_wp    !! work done against damping
    real(wp) :: max_penetration = 0.0_wp   !! deepest since the last tally
  end type tally_t

  !> Base of all effects. `apply` is called once a step, at the stage whose list it is in.
  type, abstract, public :: effect_t
    character(:), allocatable :: name
    integer :: watch = 0                   !! stopwatch of this effect
    real(wp) :: external_work = 0.0_wp     !! done by this effect on the blank since the start
    real(wp) :: force(3) = 0.0_wp          !! total force on the blank now
    logical :: is_done = .false.           !! what the run was to reach is reached: it may end
  contains
    procedure(apply_effect), deferred :: apply
    procedure :: tally => tally_effect
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
  end interface

contains

  !> Add what this effect holds to the balances of the run.
  subroutine tally_effect(self, tally)
    class(effect_t), intent(inout) :: self
    type(tally_t), intent(inout) :: tally

    tally%external_work = tally%external_work + self%external_work
  end subroutine tally_effect

end module effect
