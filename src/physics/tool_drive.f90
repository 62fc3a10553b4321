!> A rigid tool that a force moves along one direction, such as a blank holder.
module tool_drive
  use kinds, only: wp
  use state_store, only: state_store_t, carry
  use blank, only: assembly_t
  use motion_curve, only: curve_value
  use effect, only: effect_t, effect_slot_t, instant_t, previous_increment
  use tool, only: tool_t
  implicit none
  private

  public :: drive_view_t, tool_drives, rest_drive

  !> m s'' = F + R - alpha m s', with the force F of the deck and the reaction R of the sheet along
  !! the direction. Central differences as for the blank, the damping with the mean of the
  !! velocities half a step before and after.
  type, extends(effect_t), public :: tool_drive_t
    integer :: tool = 0                    !! index into the tools of the model
    real(wp) :: direction(3) = 0.0_wp      !! of unit length
    real(wp) :: value = 0.0_wp             !! force along it, times the curve
    real(wp) :: mass = 0.0_wp, alpha = 0.0_wp   !! [mass], [1/time]
    real(wp) :: speed = 0.0_wp             !! along the direction, half a step back
    real(wp) :: net = 0.0_wp, drag = 0.0_wp     !! F + R and the damping force of the last step
    logical :: is_moving = .false.         !! the speed is known
    real(wp) :: released = 0.0_wp          !! what F + R lack when a static step begins, which it
                                           !! ramps down [force]
  contains
    procedure :: net_force
    procedure :: apply
    procedure :: stop
    procedure :: carry => carry_drive
    procedure :: is_by_rows => is_of_tool
  end type tool_drive_t

  !> A drive where it lies in a list of effects.
  type :: drive_view_t
    type(tool_drive_t), pointer :: drive => null()
  end type drive_view_t

contains

  !> The drives among effects, as views: what holds the list must be a target.
  function tool_drives(effects) result(drives)
    type(effect_slot_t), intent(in), target :: effects(:)
    type(drive_view_t), allocatable :: drives(:)
    type(drive_view_t) :: found(size(effects))
    integer :: i, n

    n = 0
    do i = 1, size(effects)
      select type (item => effects(i)%item)
      type is (tool_drive_t)
        n = n + 1
        found(n)%drive => item
      end select
    end do
    drives = found(:n)
  end function tool_drives

  !> F + R, along the direction [force].
  pure real(wp) function net_force(self, tool, time)
    class(tool_drive_t), intent(in) :: self
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: time

    net_force = self%value*curve_value(self%curve, time) + dot_product(tool%force, self%direction)
  end function net_force

  !> Bring the tool to rest; the energy of its motion is lost.
  pure subroutine rest_drive(drive, tool, time)
    class(tool_drive_t), intent(inout) :: drive
    type(tool_t), intent(inout) :: tool
    real(wp), intent(in) :: time

    drive%damping_energy = drive%damping_energy + drive%tool_energy
    drive%tool_energy = 0.0_wp
    drive%speed = 0.0_wp
    drive%drag = 0.0_wp
    drive%is_moving = .true.
    drive%net = drive%net_force(tool, time)
    tool%velocity = 0.0_wp
  end subroutine rest_drive

  !> Velocity of the tool half a step on. The contact counts the work of the tool on the sheet as
  !! done from outside; what the force does beyond it goes into the motion of the tool.
  subroutine apply(self, bodies, instant)
    class(tool_drive_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp) :: net, drag, before, share, moved

    associate (tool => bodies%tools(self%tool))
      if (.not. self%is_moving) then   ! the tool brings the energy of the motion it has had
        self%speed = dot_product(tool%velocity, self%direction)
        self%external_work = self%external_work + 0.5_wp*self%mass*self%speed**2
        self%is_moving = .true.
      end if
      net = self%net_force(tool, instant%time)
      before = self%speed
      share = 0.5_wp*self%alpha*instant%dt_mean
      self%speed = ((1.0_wp - share)*before + instant%dt_mean*net/self%mass)/(1.0_wp + share)
      drag = -0.5_wp*self%alpha*self%mass*(before + self%speed)
      moved = previous_increment(instant)*before
      self%external_work = self%external_work + 0.5_wp*(self%net + net)*moved
      self%damping_energy = self%damping_energy - 0.5_wp*(self%drag + drag)*moved
      self%tool_energy = 0.5_wp*self%mass*before*self%speed
      self%net = net
      self%drag = drag
      tool%velocity = self%speed*self%direction
    end associate
  end subroutine apply

  !> Another motion takes the tool over, and with it the energy of its motion.
  subroutine stop(self, bodies, dt)
    class(tool_drive_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: dt

    self%external_work = self%external_work - self%tool_energy
    self%tool_energy = 0.0_wp
  end subroutine stop

  pure logical function is_of_tool(self) result(is_by_rows)
    class(tool_drive_t), intent(in) :: self

    is_by_rows = .true.
  end function is_of_tool

  subroutine carry_drive(self, store)
    class(tool_drive_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    call carry(store, "speed", self%speed)
    call carry(store, "net", self%net)
    call carry(store, "released", self%released)
    call carry(store, "drag", self%drag)
    call carry(store, "kinetic", self%tool_energy)
    call carry(store, "lost", self%damping_energy)
    call carry(store, "is_moving", self%is_moving)
  end subroutine carry_drive

end module tool_drive
