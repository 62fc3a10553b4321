C     Von Mises with Voce hardening in the form for shells, constants as
C     in umat_voce.f. STATEV: 1 eqps, 2 to 6 what the call was given:
C     NDI, NTENS, NPT, LAYER, KSPT; 7 to 9 the sum of DROT(1,2)**2, and
C     DFGRD1(1,1), DFGRD1(3,3); 10 CELENT, 11 to 13 COORDS. A sixth
C     constant is the factor of the stiffness along axis 1.
      SUBROUTINE UMAT(STRESS,STATEV,DDSDDE,SSE,SPD,SCD,RPL,DDSDDT,
     1 DRPLDE,DRPLDT,STRAN,DSTRAN,TIME,DTIME,TEMP,DTEMP,PREDEF,DPRED,
     2 CMNAME,NDI,NSHR,NTENS,NSTATV,PROPS,NPROPS,COORDS,DROT,PNEWDT,
     3 CELENT,DFGRD0,DFGRD1,NOEL,NPT,LAYER,KSPT,KSTEP,KINC)
      INCLUDE 'ABA_PARAM.INC'
      CHARACTER*80 CMNAME
      DIMENSION STRESS(NTENS),STATEV(NSTATV),DDSDDE(NTENS,NTENS),
     1 STRAN(NTENS),DSTRAN(NTENS),TIME(2),PROPS(NPROPS),COORDS(3),
     2 DROT(3,3),DFGRD0(3,3),DFGRD1(3,3)
      E = PROPS(1)/(1.D0 - PROPS(2)**2)
      G = 0.5D0*PROPS(1)/(1.D0 + PROPS(2))
      DDSDDE(1,1) = E
      DDSDDE(2,2) = E
      DDSDDE(1,2) = PROPS(2)*E
      DDSDDE(2,1) = PROPS(2)*E
      DDSDDE(3,3) = G
      IF (NPROPS .GE. 6) DDSDDE(1,1) = PROPS(6)*E
      DO I = 1, NTENS
        DO J = 1, NTENS
          STRESS(I) = STRESS(I) + DDSDDE(I,J)*DSTRAN(J)
        END DO
      END DO
      CALL KFLOW(STRESS(1),STRESS(2),STRESS(3),STATEV(1),PROPS)
      IF (NSTATV .LT. 13) RETURN
      STATEV(2) = NDI
      STATEV(3) = NTENS
      STATEV(4) = NPT
      STATEV(5) = LAYER
      STATEV(6) = KSPT
      STATEV(7) = STATEV(7) + DROT(1,2)**2
      STATEV(8) = DFGRD1(1,1)
      STATEV(9) = DFGRD1(3,3)
      STATEV(10) = CELENT
      DO I = 1, 3
        STATEV(10+I) = COORDS(I)
      END DO
      END

      INCLUDE 'parts/sheet_flow.inc'
