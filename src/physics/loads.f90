!> Loads on the blank: gravity and traction, whose direction is fixed, and pressure, which acts
!! against the current outward normal of a face.
module loads
  use kinds, only: wp
  use state_store, only: state_store_t, carry, carry_array
  use nurbs_surface, only: nurbs_surface_t
  use element, only: element_t
  use blank, only: blank_t, assembly_t
  use motion_curve, only: curve_t, curve_value
  use effect, only: effect_t, effect_slot_t, instant_t
  use face_quadrature, only: face_rule_t, add_face_forces
  implicit none
  private

  public :: gravity_load, traction_load, new_pressure, trim_loads

  !> A constant pattern of forces, times a curve: on the control points of a range of a patch's
  !! grid, or of a face with a net of its own.
  type, extends(effect_t), public :: dead_load_t
    integer :: part = 1                            !! patch of the blank
    integer :: face = 0                            !! of the patch; 0: none
    integer :: lower(3) = 1, upper(3) = 0
    real(wp), allocatable :: pattern(:, :, :, :)   !! shape of the range, and 3
    real(wp) :: acceleration(3) = 0.0_wp           !! of gravity
    real(wp) :: scaling = 0.0_wp                   !! curve value of the last step
  contains
    procedure :: apply => apply_dead_load
    procedure :: carry => carry_dead_load
    procedure :: stop => stop_dead_load
  end type dead_load_t

  !> A pressure on the elements of `rule`, times a curve.
  type, extends(effect_t), public :: pressure_t
    integer :: part = 1                            !! patch of the blank
    integer :: face = 0                            !! of the patch
    type(face_rule_t) :: rule
    real(wp) :: value = 0.0_wp                     !! [stress]
    real(wp), allocatable :: before(:, :, :)       !! forces on the face at the last step
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

    load%name = "gravity"
    load%part = part
    load%upper = shape(blank%parts(part)%element%mass)
    load%curve = curve
    load%acceleration = acceleration
    load%pattern = weight_of(blank, part, acceleration)
  end function gravity_load

  !> Traction on the part of a face that `rule` covers.
  function traction_load(part, face, surface, rule, bounds, traction, curve) result(load)
    integer, intent(in) :: part, face             !! patch of the blank, face of the patch
    type(nurbs_surface_t), intent(in) :: surface  !! the face at the start
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: bounds(3, 2)           !! control points, from `face_slice`
    real(wp), intent(in) :: traction(3)           !! [stress]
    type(curve_t), intent(in) :: curve
    type(dead_load_t) :: load
    real(wp) :: forces(size(surface%points, 1), size(surface%points, 2), 3)

    forces = 0.0_wp
    call add_face_forces(rule, shape(surface%weights), surface%points, traction, 0.0_wp, forces)
    load%name = "traction"
    load%part = part
    load%face = face
    load%lower = bounds(:, 1)
    load%upper = bounds(:, 2)
    load%curve = curve
    load%pattern = reshape(forces, [load%upper - load%lower + 1, 3])
  end function traction_load

  !> Pressure on the part of a face that `rule` covers.
  pure function new_pressure(part, face, rule, value, curve) result(load)
    integer, intent(in) :: part, face             !! patch of the blank, face of the patch
    type(face_rule_t), intent(in) :: rule
    real(wp), intent(in) :: value                 !! [stress]
    type(curve_t), intent(in) :: curve
    type(pressure_t) :: load

    load%name = "pressure"
    load%part = part
    load%face = face
    load%rule = rule
    load%value = value
    load%curve = curve
    allocate (load%before(size(rule%weights, 1), size(rule%weights, 2), 3), source=0.0_wp)
  end function new_pressure

  !> Loads follow a blank that was trimmed: weight its masses, pressure what is left of its faces.
  subroutine trim_loads(blank, effects)
    type(blank_t), intent(in) :: blank
    type(effect_slot_t), intent(inout) :: effects(:)
    integer :: i

    do i = 1, size(effects)
      select type (load => effects(i)%item)
      type is (dead_load_t)
        if (load%face == 0) load%pattern = weight_of(blank, load%part, load%acceleration)
      type is (pressure_t)
        load%rule%share = blank%parts(load%part)%element%ties%share
      end select
    end do
  end subroutine trim_loads

  !> Forces of an acceleration on the masses of a patch, without what scaling has added.
  pure function weight_of(blank, part, acceleration) result(forces)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: part
    real(wp), intent(in) :: acceleration(3)
    real(wp), allocatable :: forces(:, :, :, :)
    integer :: c

    associate (mass => blank%parts(part)%element%mass)
      allocate (forces(size(mass, 1), size(mass, 2), size(mass, 3), 3))
      do c = 1, 3
        forces(:, :, :, c) = mass*(acceleration(c)/blank%mass_factor)
      end do
    end associate
  end function weight_of

  subroutine apply_dead_load(self, bodies, instant)
    class(dead_load_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp) :: now
    integer :: c

    now = curve_value(self%curve, instant%time)
    associate (body => bodies%blank%parts(self%part)%element)
      if (body%is_own_face(self%face)) call body%look_at_faces()
      self%external_work = self%external_work + 0.5_wp*(self%scaling + now)*instant%dt &
                           *power_of(self, body)
      if (body%is_own_face(self%face)) then
        call body%add_face_forces(self%face, now*self%pattern(:, :, 1, :))
      else
        associate (low => self%lower, high => self%upper, force => body%motion%external_force)
          force(low(1):high(1), low(2):high(2), low(3):high(3), :) = &
            force(low(1):high(1), low(2):high(2), low(3):high(3), :) + now*self%pattern
        end associate
      end if
    end associate
    do c = 1, 3
      self%force(c) = now*sum(self%pattern(:, :, :, c))
    end do
    self%scaling = now
  end subroutine apply_dead_load

  !> Power of the pattern now.
  real(wp) function power_of(load, body) result(power)
    type(dead_load_t), intent(in) :: load
    class(element_t), intent(in) :: body
    real(wp), allocatable :: v(:, :, :)

    if (body%is_own_face(load%face)) then
      allocate (v, mold=load%pattern(:, :, 1, :))
      call body%face_velocities(load%face, v)
      power = sum(load%pattern(:, :, 1, :)*v)
    else
      associate (low => load%lower, high => load%upper)
        power = sum(load%pattern*body%motion%v(low(1):high(1), low(2):high(2), low(3):high(3), :))
      end associate
    end if
  end function power_of

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

    self%external_work = self%external_work + 0.5_wp*dt*self%scaling &
                         *power_of(self, bodies%blank%parts(self%part)%element)
    self%force = 0.0_wp
  end subroutine stop_dead_load

  subroutine apply_pressure(self, bodies, instant)
    class(pressure_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), allocatable, dimension(:, :, :) :: net, now
    real(wp) :: pressure_now
    integer :: c

    pressure_now = self%value*curve_value(self%curve, instant%time)
    allocate (net, now, mold=self%before)
    now = 0.0_wp
    associate (body => bodies%blank%parts(self%part)%element)
      call body%look_at_faces()
      if (abs(pressure_now) > 0.0_wp) then
        call body%face_net(self%face, net)
        call add_face_forces(self%rule, shape(self%rule%weights), net, &
                             [0.0_wp, 0.0_wp, 0.0_wp], pressure_now, now)
        call body%add_face_forces(self%face, now)
      end if
      call body%face_velocities(self%face, net)
    end associate
    self%external_work = self%external_work + 0.5_wp*instant%dt*sum((self%before + now)*net)
    do c = 1, 3
      self%force(c) = sum(now(:, :, c))
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

    real(wp), allocatable :: v(:, :, :)

    allocate (v, mold=self%before)
    call bodies%blank%parts(self%part)%element%face_velocities(self%face, v)
    self%external_work = self%external_work + 0.5_wp*dt*sum(self%before*v)
    self%force = 0.0_wp
  end subroutine stop_pressure

end module loads
