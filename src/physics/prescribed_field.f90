!> A temperature or field variable that the deck gives during the run.
module prescribed_field
  use kinds, only: wp
  use state_store, only: state_store_t
  use blank, only: assembly_t
  use motion_curve, only: curve_value
  use effect, only: effect_slot_t, effect_t, instant_t
  implicit none
  private

  public :: change_fields, settle_fields

  !> Values of some control points, times a curve. Nothing follows from them but what the law makes
  !! of its fields: no heat is conducted and no strain of expansion arises.
  type, extends(effect_t), public :: field_change_t
    integer :: variable = 1                   !! as in `field_spec_t`
    integer, allocatable :: part(:)           !! patch of each control point, shape (n)
    integer, allocatable :: points(:, :)      !! control indices, shape (3, n)
    real(wp), allocatable :: values(:)        !! times the curve, shape (n)
    logical :: is_first = .false., is_last = .false.   !! of those that act in a time step
  contains
    procedure :: apply
    procedure :: carry
  end type field_change_t

contains

  !> Set the control points to the end of the time step to come. The first effect gives those that
  !! no effect holds what they had at the start, the last one sets the integration points.
  subroutine apply(self, bodies, instant)
    class(field_change_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp) :: factor
    integer :: p, i

    do p = 1, size(bodies%blank%parts)
      if (.not. self%is_first) exit
      associate (element => bodies%blank%parts(p)%element)
        element%nodal = element%nodal_start
      end associate
    end do
    factor = curve_value(self%curve, instant%time + instant%dt)
    do i = 1, size(self%values)
      associate (at => self%points(:, i), element => bodies%blank%parts(self%part(i))%element)
        element%nodal(at(1), at(2), at(3), self%variable) = self%values(i)*factor
      end associate
    end do
    do p = 1, size(bodies%blank%parts)
      if (.not. self%is_last) exit
      call bodies%blank%parts(p)%element%spread_fields()
    end do
  end subroutine apply

  !> Set the fields of a static increment: the points go from what they have to its end.
  subroutine change_fields(supports, bodies, instant)
    type(effect_slot_t), intent(inout) :: supports(:)
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant         !! its start, and how long it is
    integer :: i

    do i = 1, size(supports)
      select type (item => supports(i)%item)
      type is (field_change_t)
        call item%apply(bodies, instant)
      end select
    end do
  end subroutine change_fields

  !> Give the points what they have at this time, without a change from the increment before.
  subroutine settle_fields(supports, bodies, time)
    type(effect_slot_t), intent(inout) :: supports(:)
    type(assembly_t), intent(inout) :: bodies
    real(wp), intent(in) :: time
    integer :: i

    do i = 1, 2
      call change_fields(supports, bodies, instant_t(time=time))
    end do
  end subroutine settle_fields

  !> Nothing: the points carry what they have, and the control points are set before they are used.
  subroutine carry(self, store)
    class(field_change_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store
  end subroutine carry

end module prescribed_field