C     Von Mises plasticity with Voce hardening, an example of a user
C     material as a VUMAT, with the arguments of older releases. The
C     constants are those of umat_voce.f; STATEV 1 is the equivalent
C     plastic strain.
      subroutine vumat(
C Read only -
     1  nblock, ndir, nshr, nstatev, nfieldv, nprops, lanneal,
     2  stepTime, totalTime, dt, cmname, coordMp, charLength,
     3  props, density, strainInc, relSpinInc,
     4  tempOld, stretchOld, defgradOld, fieldOld,
     5  stressOld, stateOld, enerInternOld, enerInelasOld,
     6  tempNew, stretchNew, defgradNew, fieldNew,
C Write only -
     7  stressNew, stateNew, enerInternNew, enerInelasNew )
C
      include 'vaba_param.inc'
C
      dimension props(nprops), density(nblock), coordMp(nblock,*),
     1  charLength(nblock), strainInc(nblock,ndir+nshr),
     2  relSpinInc(nblock,nshr), tempOld(nblock),
     3  stretchOld(nblock,ndir+nshr),
     4  defgradOld(nblock,ndir+nshr+nshr),
     5  fieldOld(nblock,nfieldv), stressOld(nblock,ndir+nshr),
     6  stateOld(nblock,nstatev), enerInternOld(nblock),
     7  enerInelasOld(nblock), tempNew(nblock),
     8  stretchNew(nblock,ndir+nshr),
     8  defgradNew(nblock,ndir+nshr+nshr),
     9  fieldNew(nblock,nfieldv),
     1  stressNew(nblock,ndir+nshr), stateNew(nblock,nstatev),
     2  enerInternNew(nblock), enerInelasNew(nblock)
      character*80 cmname
      dimension s(6)
C
      if (lanneal .ne. 0 .or. nblock .gt. maxblk) call xplb_exit
      g = props(1)/(2.d0*(1.d0+props(2)))
      bulk = props(1)/(3.d0*(1.d0-2.d0*props(2)))
      al = bulk-2.d0*g/3.d0
      do 100 k = 1, nblock
        tr = strainInc(k,1)+strainInc(k,2)+strainInc(k,3)
        do i = 1, 6
          s(i) = stressOld(k,i)+2.d0*g*strainInc(k,i)
          if (i.le.3) s(i) = s(i)+al*tr
        end do
        if (totalTime .eq. 0.d0) then
C         first call: elastic
          do i = 1, 6
            stressNew(k,i) = s(i)
          end do
          goto 100
        end if
        p = (s(1)+s(2)+s(3))/3.d0
        do i = 1, 3
          s(i) = s(i)-p
        end do
        q = sqrt(1.5d0*(s(1)**2+s(2)**2+s(3)**2
     1      +2.d0*(s(4)**2+s(5)**2+s(6)**2)))
        eps = stateOld(k,1)
        de = 0.d0
        flow = props(3)+props(4)*(1.d0-exp(-props(5)*eps))
        if (q .gt. flow) then
          do it = 1, 50
            flow = props(3)+props(4)*(1.d0-exp(-props(5)*(eps+de)))
            h = props(4)*props(5)*exp(-props(5)*(eps+de))
            c = (q-3.d0*g*de-flow)/(3.d0*g+h)
            de = de+c
            if (abs(c) .lt. 1.d-16) exit
          end do
        end if
        r = 1.d0
        if (de .gt. 0.d0) r = 1.d0-3.d0*g*de/q
        do i = 1, 3
          stressNew(k,i) = r*s(i)+p
          stressNew(k,i+3) = r*s(i+3)
        end do
        stateNew(k,1) = eps+de
        enerInelasNew(k) = enerInelasOld(k)+flow*de/density(k)
  100 continue
      return
      end
