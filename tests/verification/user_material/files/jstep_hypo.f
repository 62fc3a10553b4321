c     Linear elasticity in rate form that declares the step as JSTEP(4),
c     checks its increments and writes to units 6 and 7.
      subroutine umat(stress,statev,ddsdde,sse,spd,scd,rpl,ddsddt,
     & drplde,drpldt,stran,dstran,time,dtime,temp,dtemp,predef,dpred,
     & cmname,ndi,nshr,ntens,nstatv,props,nprops,coords,drot,pnewdt,
     & celent,dfgrd0,dfgrd1,noel,npt,layer,kspt,jstep,kinc)
      include 'aba_param.inc'
      character*8 cmname
      dimension stress(ntens),statev(nstatv),ddsdde(ntens,ntens),
     & ddsddt(ntens),drplde(ntens),stran(ntens),dstran(ntens),
     & time(2),predef(1),dpred(1),props(nprops),coords(3),drot(3,3),
     & dfgrd0(3,3),dfgrd1(3,3),jstep(4)
      if (jstep(1).ne.1 .or. jstep(2).ne.0 .or. jstep(4).ne.0) then
        write(6,*) 'unexpected step', jstep
        call xit
      endif
      g = props(1)/(2.d0*(1.d0+props(2)))
      alam = 2.d0*g*props(2)/(1.d0-2.d0*props(2))
      do i=1,3
        do j=1,3
          ddsdde(i,j) = alam
        enddo
        ddsdde(i,i) = alam+2.d0*g
        ddsdde(i+3,i+3) = g
      enddo
      do i=1,6
        do j=1,6
          stress(i) = stress(i)+ddsdde(i,j)*dstran(j)
        enddo
      enddo
c     the increments as they come: all of them, one after the other
      if (kinc.gt.1 .or. time(2).gt.0.d0) then
        if (nint(statev(1)).ne.kinc-1) call xit
      endif
      statev(1) = kinc
      statev(2) = time(2)+dtime
      if (kinc.eq.3 .and. npt.eq.1) then
        write(7,'(a,i5)') ' increment 3 of element', noel
        write(6,'(a,i5)') ' unit 6: element', noel
      endif
      return
      end
