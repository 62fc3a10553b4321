c     Elastic law that takes its stress apart into principal values and puts it together again. It
c     writes one energy in front of the array, as files do that forget to set an index.
      subroutine vumat(nblock, ndir, nshr, nstatev, nfieldv, nprops,
     1 lanneal, steptime, totaltime, dt, cmname, coordmp, charlength,
     2 props, density, straininc, relspininc, tempold, stretchold,
     3 defgradold, fieldold, stressold, stateold, enerinternold,
     4 enerinelasold, tempnew, stretchnew, defgradnew, fieldnew,
     5 stressnew, statenew, enerinternnew, enerinelasnew)
      include 'vaba_param.inc'
      dimension props(nprops), straininc(nblock,ndir+nshr),
     1 stressold(nblock,ndir+nshr), stressnew(nblock,ndir+nshr),
     2 statenew(nblock,nstatev), charlength(nblock),
     3 enerinternnew(nblock), enerinelasnew(nblock)
      character*80 cmname, job
      dimension values(nblock,3), only(nblock,3), way(nblock,3,3)
      dimension mi(6), mj(6), direct(nblock,6)
      data mi /1, 2, 3, 1, 2, 3/, mj /1, 2, 3, 2, 3, 1/
      call vgetjobname(job, ljob)
      if (ljob .lt. 1) call xplb_exit
      noindex = ljob - ljob
      enerinternnew(noindex) = 1.d300
      enerinelasnew(noindex) = 1.d300
      twog = props(1)/(1.d0 + props(2))
      alam = twog*props(2)/(1.d0 - 2.d0*props(2))
      do k = 1, nblock
        trace = sum(straininc(k,1:3))
        stressnew(k,:) = stressold(k,:) + twog*straininc(k,:)
        stressnew(k,1:3) = stressnew(k,1:3) + alam*trace
      end do
      direct = stressnew
      call vsprinc(nblock, stressnew, only, ndir, nshr)
      call vsprind(nblock, stressnew, values, way, ndir, nshr)
      do k = 1, nblock
        do m = 1, 6
          stressnew(k,m) = 0.d0
          do i = 1, 3
            stressnew(k,m) = stressnew(k,m)
     1        + values(k,i)*way(k,mi(m),i)*way(k,mj(m),i)
          end do
        end do
        statenew(k,1) = maxval(only(k,:)) - maxval(values(k,:))
        statenew(k,2) = maxval(abs(stressnew(k,:) - direct(k,:)))
        statenew(k,3) = charlength(k)
      end do
      end
