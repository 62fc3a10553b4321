C     The law of voce_sheet.f as a VUMAT in its form for shells. STATEV: 1
C     eqps, 2 to 5 NDIR, NSHR, integration point and section point, 6 the
C     sum of relSpinInc, 7 stretchNew 11, 8 defgradNew 21.
      subroutine vumat(nblock, ndir, nshr, nstatev, nfieldv, nprops,
     1  jInfoArray, stepTime, totalTime, dtArray, cmname, coordMp,
     2  charLength, props, density, strainInc, relSpinInc, tempOld,
     3  stretchOld, defgradOld, fieldOld, stressOld, stateOld,
     4  enerInternOld, enerInelasOld, tempNew, stretchNew, defgradNew,
     5  fieldNew, stressNew, stateNew, enerInternNew, enerInelasNew)
      include 'vaba_param.inc'
      dimension jInfoArray(*), dtArray(*), props(nprops),
     1  strainInc(nblock,ndir+nshr), relSpinInc(nblock,nshr),
     2  stretchNew(nblock,ndir+nshr), defgradNew(nblock,ndir+2*nshr),
     3  stressOld(nblock,ndir+nshr), stateOld(nblock,nstatev),
     4  stressNew(nblock,ndir+nshr), stateNew(nblock,nstatev)
      character*80 cmname
      e = props(1)/(1.d0 - props(2)**2)
      g = 0.5d0*props(1)/(1.d0 + props(2))
      do k = 1, nblock
        s11 = stressOld(k,1) + e*(strainInc(k,1)
     1      + props(2)*strainInc(k,2))
        s22 = stressOld(k,2) + e*(strainInc(k,2)
     1      + props(2)*strainInc(k,1))
        s12 = stressOld(k,4) + 2.d0*g*strainInc(k,4)
        eqps = stateOld(k,1)
        call kflow(s11, s22, s12, eqps, props)
        stressNew(k,1) = s11
        stressNew(k,2) = s22
        stressNew(k,3) = 0.d0
        stressNew(k,4) = s12
        stateNew(k,1) = eqps
C       Elastic change of volume alone
        strainInc(k,3) = (1.d0 - 2.d0*props(2))/props(1)
     1    *(s11 + s22 - stressOld(k,1) - stressOld(k,2))
     2    - strainInc(k,1) - strainInc(k,2)
        if (nstatev .ge. 8) then
          stateNew(k,2) = ndir
          stateNew(k,3) = nshr
          stateNew(k,4) = jInfoArray(2)
          stateNew(k,5) = jInfoArray(4)
          stateNew(k,6) = stateOld(k,6) + relSpinInc(k,1)
          stateNew(k,7) = stretchNew(k,1)
          stateNew(k,8) = defgradNew(k,5)
        end if
      end do
      end

      include 'parts/sheet_flow.inc'
