!> Loads on the blank: gravity and traction, whose direction is fixed, and pressure, which acts
!! against the current outward normal of a face.
module loads
  use kinds, only: wp
  use state_store, only: state_store_t, carry, carry_array
  use nurbs_surface, only: nurbs_surface_t
  use blank, only: blank_t, assembly_t
  use motion_curve, only: curve_t, curve_value
  use effect, only: effect_t, instant_t
  use face_quadrature, only: face_rule_t, add_face_forces
  implicit none
  private

  public :: gravity_load, traction_load, new_pressure

  !> Forces on the control points of a range of a patch's grid, times a curve.
  type, extends(effect_t), abstract :: load_t
    integer :: part = 1                            !! patch of the blank
    integer :: lower(3) = 1, upper(3) = 0
  end type load_t

  !> A constant pattern of forces.
  type, extends(load_t), public :: dead_load_t
    real(wp), allocatable :: pattern(:, :, :, :)   !! shape of the range, and 3
    real(wp) :: scaling = 0.0_wp                   !! curve value of the last step
  contains
    procedure :: apply => apply_dead_load
    procedure :: carry => carry_dead_load
    procedure :: stop => stop_dead_load
  end type dead_load_t

  !> A pressure on the elements of `rule`.
  type, extends(load_t), public :: pressure_t
    type(face_rule_t) :: rule
    real(wp) :: value = 0.0_wp                     !! [stress]
    real(wp), allocatable :: before(:, :, :, :)    !! forces of the last step
  contains
    procedure :: apply => apply_pressure
    procedure :: carry => carry_pressure
    procedure :: stop => stop_pressure
  end type pressure_t

contains

  !> Gravity on all control points of a patch; mass that scaling has added has no weight.
  pure function gravity_load(blank, part, acceleration, curve) result(load)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: part                   !! the patch
    real(wp), intent(in) :: acceleration(3)
    type(curve_t), intent(in) :: curve
    type(dead_load_t) :: load
    integer :: c

    load%name = "gravity"
    load%part = part
    load%upper = shape(blank%parts(part)%element%mass)
    load%curve = curve
    allocate (load%pattern(load%upper(1), load%upper(2), load%upper(3), 3))
    do c = 1, 3
      load%pattern(:, :, :, c) = blank%parts(part)%element%mass*(acceleration(c)/blank%mass_factor)
    end do
  end function gravity_load

  !> Traction on the part of a face that `rule` covers.
  function traction_load(part, face, rule, lower, upper, traction, curve) result(load)
    integer, intent(in) :: part                   !! patch of the blank
    type(nurbs_surface_t), intent(in) :: face     !! of it, at the start
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: lower(3), upper(3)     !! control points of the face
    real(wp), intent(in) :: traction(3)           !! [stress]
    type(curve_t), intent(in) :: curve
    type(dead_load_t) :: load
    real(wp) :: forces(size(face%points, 1), size(face%points, 2), 3)

    forces = 0.0_wp
    call add_face_forces(rule, shape(face%weights), face%points, traction, 0.0_wp, forces)
    load%name = "traction"
    load%part = part
    load%lower = lower
    load%upper = upper
    load%curve = curve
    load%pattern = reshape(forces, [upper - lower + 1, 3])
  end function traction_load

  !> Pressure on the part of a face that `rule` covers.
  pure function new_pressure(part, rule, bounds, value, curve) result(load)
    integer, intent(in) :: part                   !! patch of the blank
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: bounds(3, 2)           !! control points of the face
    real(wp), intent(in) :: value                 !! [stress]
    type(curve_t), intent(in) :: curve
    type(pressure_t) :: load

    load%name = "pressure"
    load%part = part
    load%rule = rule
    load%lower = bounds(:, 1)
    load%upper = bounds(:, 2)
    load%value = value
    load%curve = curve
    associate (n => bounds(:, 2) - bounds(:, 1) + 1)
      allocate (load%before(n(1), n(2), n(3), 3), source=0.0_wp)
    end associate
  end function new_pressure

  subroutine apply_dead_load(self, bodies, instant)
    class(dead_load_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp) :: now
    integer :: c

    now = curve_value(self%curve, instant%time)
    associate (low => self%lower, high => self%upper, &
               motion => bodies%blank%parts(self%part)%element%motion)
      self%external_work = self%external_work + 0.5_wp*(self%scaling + now)*instant%dt &
                           *sum(self%pattern*motion%v(low(1):high(1), low(2):high(2), &
                                                      low(3):high(3), :))
      motion%external_force(low(1):high(1), low(2):high(2), low(3):high(3), :) = &
        motion%external_force(low(1):high(1), low(2):high(2), low(3):high(3), :) &
        + now*self%pattern
    end associate
    do c = 1, 3
      self%force(c) = now*sum(self%pattern(:, :, :, c))
    end do
    self%scaling = now
  end subroutine apply_dead_load

  subroutine carry_dead_load(self, store)
    class(dead_load_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    call carry(store, "scaling", self%scaling)
  end subroutine carry_dead_load

  !> The last forces work over half a step more.
  subroutine stop_dead_load(self, bodies, dt)
    class(dead_load_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: dt

    associate (low => self%lower, high => self%upper, &
               v => bodies%blank%parts(self%part)%element%motion%v)
      self%external_work = self%external_work + 0.5_wp*dt*self%scaling*sum(self%pattern &
                           *v(low(1):high(1), low(2):high(2), low(3):high(3), :))
    end associate
    self%force = 0.0_wp
  end subroutine stop_dead_load

  subroutine apply_pressure(self, bodies, instant)
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
  end subroutine apply_pressure

  subroutine carry_pressure(self, store)
    class(pressure_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    call carry_array(store, "before", size(self%before), self%before)
  end subroutine carry_pressure

  !> The last forces work over half a step more.
  subroutine stop_pressure(self, bodies, dt)
    class(pressure_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: dt

    associate (low => self%lower, high => self%upper, &
               v => bodies%blank%parts(self%part)%element%motion%v)
      self%external_work = self%external_work + 0.5_wp*dt*sum(self%before &
                           *v(low(1):high(1), low(2):high(2), low(3):high(3), :))
    end associate
    self%force = 0.0_wp
  end subroutine stop_pressure

end module loads
