!> The Voce law behind the UMAT interface. Only translation happens here; the law is in `voce`.
!! Built with -Wno-unused-dummy-argument: the interface is fixed, and most of it goes unused.
module umat_voce
  use kinds, only: wp
  use voce, only: voce_t, new_voce
  implicit none
  private

  public :: umat

contains

  !> `props` = E, nu, sigma_0, Q, b; `statev(1)` = equivalent plastic strain. `ddsdde` is left
  !! alone, explicit steps need no tangent. A stress that does not converge is reported by
  !! `pnewdt < 1`, so that no thread ever stops the program.
  pure subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, &
                       stran, dstran, time, dtime, temp, dtemp, predef, dpred, cmname, &
                       ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, &
                       celent, dfgrd0, dfgrd1, noel, npt, layer, kspt, kstep, kinc)
    integer, intent(in) :: ndi, nshr, ntens, nstatv, nprops
    integer, intent(in) :: noel, npt, layer, kspt, kstep, kinc
    character(80), intent(in) :: cmname
    real(wp), intent(inout) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens)
    real(wp), intent(inout) :: sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
    real(wp), intent(inout) :: pnewdt
    real(wp), intent(in) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp
    real(wp), intent(in) :: predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
    real(wp), intent(in) :: celent, dfgrd0(3, 3), dfgrd1(3, 3)
    real(wp), parameter :: any_density = 1.0_wp   ! the stress update does not use it
    type(voce_t) :: law
    logical :: ok

    law = new_voce(any_density, props(1), props(2), props(3), props(4), props(5))
    call law%update(1, dtime, dstran, stress, statev(1), ok)
    if (.not. ok) pnewdt = 0.5_wp
  end subroutine umat

end module umat_voce
