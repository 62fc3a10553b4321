!> Pressure on a face of the blank, always against its current outward normal.
module pressure
  use kinds, only: wp
  use state_store, only: state_store_t, carry_array, has_state
  use assembly, only: assembly_t
  use motion_curve, only: curve_t, curve_value, start_curve
  use effect, only: effect_t, instant_t
  use face_quadrature, only: face_rule_t, add_face_forces
  implicit none
  private

  !> A pressure on the elements of `rule`, times a curve.
  type, extends(effect_t), public :: pressure_t
    integer :: part = 1                            !! patch of the blank
    integer :: lower(3) = 1, upper(3) = 0          !! control points of the face
    type(face_rule_t) :: rule
    real(wp) :: value = 0.0_wp                     !! [stress]
    type(curve_t) :: curve
    real(wp), allocatable :: before(:, :, :, :)    !! forces of the last step
  contains
    procedure :: apply
    procedure :: carry => carry_pressure
    procedure :: start
    procedure :: stop
  end type pressure_t

contains

  !> Add the forces of this instant, and the work of the step that led here.
  subroutine apply(self, bodies, instant)
    class(pressure_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), allocatable :: net(:, :, :, :), now(:, :, :, :)
    real(wp) :: pressure_now
    integer :: c

    pressure_now = self%value*curve_value(self%curve, instant%time)
    associate (low => self%lower, high => self%upper, &
               motion => bodies%blank%parts(self%part)%element%motion)
      net = motion%x(low(1):high(1), low(2):high(2), low(3):high(3), :)
      allocate (now, mold=net)
      now = 0.0_wp
      if (abs(pressure_now) > 0.0_wp) &
        call add_face_forces(self%rule, shape(self%rule%weights), net, &
                             [0.0_wp, 0.0_wp, 0.0_wp], pressure_now, now)
      if (.not. allocated(self%before)) then
        allocate (self%before, mold=now)
        self%before = 0.0_wp
      end if
      self%external_work = self%external_work + 0.5_wp*instant%dt &
                           *sum((self%before + now)*motion%v(low(1):high(1), low(2):high(2), &
                                                             low(3):high(3), :))
      motion%external_force(low(1):high(1), low(2):high(2), low(3):high(3), :) = &
        motion%external_force(low(1):high(1), low(2):high(2), low(3):high(3), :) + now
    end associate
    do c = 1, 3
      self%force(c) = sum(now(:, :, :, c))
    end do
    call move_alloc(now, self%before)
  end subroutine apply

  !> What the effect carries from step to step.
  subroutine carry_pressure(self, store)
    class(pressure_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    if (store%is_taking .and. .not. has_state(store, "before")) return
    if (store%is_taking .and. .not. allocated(self%before)) then
      allocate (self%before(self%upper(1) - self%lower(1) + 1, self%upper(2) - self%lower(2) + 1, &
                            self%upper(3) - self%lower(3) + 1, 3))
    end if
    if (allocated(self%before)) call carry_array(store, "before", size(self%before), self%before)
  end subroutine carry_pressure

  !> The curve begins with its step.
  subroutine start(self, time)
    class(pressure_t), intent(inout) :: self
    real(wp), intent(in) :: time

    call start_curve(self%curve, time)
  end subroutine start

  !> The last forces work over half a step more.
  subroutine stop(self, bodies, dt)
    class(pressure_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: dt

    associate (low => self%lower, high => self%upper, &
               v => bodies%blank%parts(self%part)%element%motion%v)
      self%external_work = self%external_work + 0.5_wp*dt*sum(self%before &
                           *v(low(1):high(1), low(2):high(2), low(3):high(3), :))
    end associate
    self%force = 0.0_wp
  end subroutine stop

end module pressure
