!> A user material behind the block law: calls a UMAT point by point.
!!
!! What the block law is told reaches the UMAT as it should be: stress (already rotated), strain
!! increment, state, constants and time increment. What it is not told (total strain, times,
!! rotation and deformation gradients, place and size of the element) is passed as not a number,
!! so that a law that needs it fails at once instead of working with made-up values.
module umat_adapter
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_is_finite
  use kinds, only: wp
  use block_law, only: block_law_t
  implicit none
  private

  public :: umat_procedure, new_umat_adapter

  abstract interface
    !> Arguments of a UMAT in the order of Abaqus/Standard.
    subroutine umat_procedure(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, &
                              drpldt, stran, dstran, time, dtime, temp, dtemp, predef, dpred, &
                              cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, &
                              pnewdt, celent, dfgrd0, dfgrd1, noel, npt, layer, kspt, kstep, &
                              kinc)
      import :: wp
      integer, intent(in) :: ndi, nshr, ntens, nstatv, nprops
      integer, intent(in) :: noel, npt, layer, kspt, kstep, kinc
      character(80), intent(in) :: cmname
      real(wp), intent(inout) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens)
      real(wp), intent(inout) :: sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
      real(wp), intent(inout) :: pnewdt
      real(wp), intent(in) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp
      real(wp), intent(in) :: predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
      real(wp), intent(in) :: celent, dfgrd0(3, 3), dfgrd1(3, 3)
    end subroutine umat_procedure
  end interface

  !> A UMAT with its name and constants; the moduli of the base type serve the stable step.
  type, extends(block_law_t), public :: umat_adapter_t
    character(80) :: name = ""
    real(wp), allocatable :: props(:)
    procedure(umat_procedure), pointer, nopass :: umat => null()
  contains
    procedure :: update
  end type umat_adapter_t

contains

  !> Law from a UMAT, its name, its constants and the number of its state variables.
  function new_umat_adapter(umat, name, density, young, poisson, props, n_state) result(law)
    procedure(umat_procedure) :: umat
    character(*), intent(in) :: name                 !! CMNAME, blank padded
    real(wp), intent(in) :: density, young, poisson  !! for the stable step
    real(wp), intent(in) :: props(:)
    integer, intent(in) :: n_state                   !! NSTATV
    type(umat_adapter_t) :: law

    law%n_state = n_state
    law%density = density
    law%bulk = young/(3.0_wp*(1.0_wp - 2.0_wp*poisson))
    law%shear = young/(2.0_wp*(1.0_wp + poisson))
    law%name = name
    law%props = props
    law%umat => umat
  end function new_umat_adapter

  !> One call of the UMAT for each point. Fails where PNEWDT comes back below one, or stress or
  !! state not finite; points behind the one that failed are left as they were.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(umat_adapter_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    integer :: l

    ok = .true.
    do l = 1, n
      call update_point(self, dt, dstrain(l, :), stress(l, :), state(l, :), ok)
      if (.not. ok) exit
    end do
  end subroutine update

  !> The UMAT at one point.
  subroutine update_point(self, dt, dstrain, stress, state, ok)
    class(umat_adapter_t), intent(in) :: self
    real(wp), intent(in) :: dt, dstrain(6)
    real(wp), intent(inout) :: stress(6), state(self%n_state)
    logical, intent(out) :: ok
    integer, parameter :: none = 0
    real(wp) :: tangent(6, 6), energies(3), heat, heat_by_strain(6), heat_by_temperature
    real(wp) :: stress_by_temperature(6), pnewdt, unknown, zero(1)

    unknown = ieee_value(unknown, ieee_quiet_nan)
    tangent = 0.0_wp
    energies = 0.0_wp
    heat = 0.0_wp
    heat_by_strain = 0.0_wp
    heat_by_temperature = 0.0_wp
    stress_by_temperature = 0.0_wp
    zero = 0.0_wp
    pnewdt = 1.0_wp
    call self%umat(stress, state, tangent, energies(1), energies(2), energies(3), heat, &
                   stress_by_temperature, heat_by_strain, heat_by_temperature, &
                   spread(unknown, 1, 6), dstrain, spread(unknown, 1, 2), dt, 0.0_wp, 0.0_wp, &
                   zero, zero, self%name, 3, 3, 6, self%n_state, self%props, size(self%props), &
                   spread(unknown, 1, 3), reshape([unknown], [3, 3], pad=[unknown]), pnewdt, &
                   unknown, reshape([unknown], [3, 3], pad=[unknown]), &
                   reshape([unknown], [3, 3], pad=[unknown]), none, none, none, none, 1, none)
    ok = pnewdt >= 1.0_wp .and. all(ieee_is_finite(stress)) .and. all(ieee_is_finite(state))
  end subroutine update_point

end module umat_adapter
