! Von Mises plasticity with Voce hardening in free form, as one would write it with the utility
! routines: the elastic strain is kept in STATEV(2:7) and turned by ROTSIG, the stress follows
! from it; SINV gives the trial stress, SPRINC checks the trace.
subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, &
                stran, dstran, time, dtime, temp, dtemp, predef, dpred, cmname, &
                ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, &
                celent, dfgrd0, dfgrd1, noel, npt, layer, kspt, kstep, kinc)
  include 'aba_param.inc'
  character*80 cmname
  dimension stress(ntens), statev(nstatv), ddsdde(ntens, ntens), ddsddt(ntens), drplde(ntens)
  dimension stran(ntens), dstran(ntens), time(2), predef(1), dpred(1), props(nprops), coords(3)
  dimension drot(3, 3), dfgrd0(3, 3), dfgrd1(3, 3), elastic(6), trial(6), ps(3)

  shear = props(1)/(2*(1 + props(2)))
  bulk = props(1)/(3*(1 - 2*props(2)))
  call rotsig(statev(2), drot, elastic, 2, ndi, nshr)
  elastic = elastic + dstran
  volume = elastic(1) + elastic(2) + elastic(3)
  trial(1:3) = 2*shear*(elastic(1:3) - volume/3) + bulk*volume
  trial(4:6) = shear*elastic(4:6)
  call sinv(trial, pressure, q, ndi, nshr)
  call sprinc(trial, ps, 1, ndi, nshr)
  if (abs(sum(ps)/3 - pressure) > 1d-9*(abs(pressure) + q + 1)) call xit
  dgamma = 0
  if (q > flow(0d0)) then
    do iteration = 1, 50
      slope = 3*shear + props(4)*props(5)*exp(-props(5)*(statev(1) + dgamma))
      change = (q - 3*shear*dgamma - flow(dgamma))/slope
      dgamma = dgamma + change
      if (abs(change) < 1d-16) exit
    end do
  end if
  share = 1
  if (q > 0) share = 1 - 3*shear*dgamma/q
  stress(1:3) = share*(trial(1:3) - pressure) + pressure
  stress(4:6) = share*trial(4:6)
  statev(1) = statev(1) + dgamma
  statev(2:4) = share*(elastic(1:3) - volume/3) + volume/3
  statev(5:7) = share*elastic(4:6)
  ddsdde(1:3, 1:3) = bulk - 2*shear/3
  do i = 1, 3
    ddsdde(i, i) = ddsdde(i, i) + 2*shear
    ddsdde(i + 3, i + 3) = shear
  end do
contains
  function flow(more)
    real(kind(1d0)) :: flow, more
    flow = props(3) + props(4)*(1 - exp(-props(5)*(statev(1) + more)))
  end function flow
end subroutine umat
