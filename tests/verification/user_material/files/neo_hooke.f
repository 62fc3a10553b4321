c     Compressible neo-Hooke from DFGRD1 alone:
c     sigma = mu/J (B - 1) + lambda ln(J)/J 1; STATEV(1) is the energy
      subroutine umat(stress,statev,ddsdde,sse,spd,scd,rpl,ddsddt,
     1 drplde,drpldt,stran,dstran,time,dtime,temp,dtemp,predef,dpred,
     2 cmname,ndi,nshr,ntens,nstatv,props,nprops,coords,drot,pnewdt,
     3 celent,f0,f,noel,npt,layer,kspt,kstep,kinc)
      implicit real*8 (a-h,o-z)
      character*80 cmname
      dimension stress(ntens),statev(*),ddsdde(ntens,ntens),
     1 ddsddt(ntens),drplde(ntens),stran(ntens),dstran(ntens),
     2 time(2),predef(1),dpred(1),props(nprops),coords(3),drot(3,3),
     3 f0(3,3),f(3,3),b(3,3)
      amu = props(1)/(2.d0*(1.d0+props(2)))
      alam = 2.d0*amu*props(2)/(1.d0-2.d0*props(2))
      det = f(1,1)*(f(2,2)*f(3,3)-f(2,3)*f(3,2))
     1    - f(1,2)*(f(2,1)*f(3,3)-f(2,3)*f(3,1))
     2    + f(1,3)*(f(2,1)*f(3,2)-f(2,2)*f(3,1))
      b = matmul(f,transpose(f))
      do i=1,3
        stress(i) = (amu*(b(i,i)-1.d0)+alam*log(det))/det
      end do
      if (nstatv .ge. 1) statev(1) = 0.5d0*(amu*(b(1,1)+b(2,2)+b(3,3)
     1  -3.d0-2.d0*log(det)) + alam*log(det)**2)
      stress(4) = amu*b(1,2)/det
      stress(5) = amu*b(1,3)/det
      stress(6) = amu*b(2,3)/det
      do i=1,3
        do j=1,3
          ddsdde(i,j) = alam
        end do
        ddsdde(i,i) = alam+2.d0*amu
        ddsdde(i+3,i+3) = amu
      end do
      return
      end
