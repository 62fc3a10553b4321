C     Von Mises plasticity with Voce hardening, an example of a user
C     material. Copy this file and change it; it needs nothing else, and
C     runs in Abaqus/Standard too (three direct stresses: solids, plane
C     strain, axial symmetry).
C
C     PROPS   1 Young's modulus, 2 Poisson's ratio, 3 sigma_0, 4 Q, 5 b:
C             flow stress = sigma_0 + Q (1 - exp(-b eqps))
C     STATEV  1 equivalent plastic strain eqps
C
C     Radial return and tangent: J. C. Simo and T. J. R. Hughes,
C     Computational Inelasticity, Springer 1998, box 3.2.
      SUBROUTINE UMAT(STRESS,STATEV,DDSDDE,SSE,SPD,SCD,RPL,DDSDDT,
     1 DRPLDE,DRPLDT,STRAN,DSTRAN,TIME,DTIME,TEMP,DTEMP,PREDEF,DPRED,
     2 CMNAME,NDI,NSHR,NTENS,NSTATV,PROPS,NPROPS,COORDS,DROT,PNEWDT,
     3 CELENT,DFGRD0,DFGRD1,NOEL,NPT,LAYER,KSPT,KSTEP,KINC)
      IMPLICIT NONE
      CHARACTER(LEN=80) CMNAME
      INTEGER NDI,NSHR,NTENS,NSTATV,NPROPS
      INTEGER NOEL,NPT,LAYER,KSPT,KSTEP,KINC
      DOUBLE PRECISION STRESS(NTENS),STATEV(NSTATV),DDSDDE(NTENS,NTENS)
      DOUBLE PRECISION SSE,SPD,SCD,RPL,DDSDDT(NTENS),DRPLDE(NTENS)
      DOUBLE PRECISION DRPLDT,STRAN(NTENS),DSTRAN(NTENS),TIME(2),DTIME
      DOUBLE PRECISION TEMP,DTEMP,PREDEF(1),DPRED(1),PROPS(NPROPS)
      DOUBLE PRECISION COORDS(3),DROT(3,3),PNEWDT,CELENT
      DOUBLE PRECISION DFGRD0(3,3),DFGRD1(3,3)

      DOUBLE PRECISION G,BULK,ALAME,VOLUME,PRESS,Q,FLOW,SLOPE
      DOUBLE PRECISION DEQPS,RESID,SCALING,HARD,THETA,S(6),FACTOR
      INTEGER I,J,ITER,MAXIT
      LOGICAL DONE
      PARAMETER (MAXIT = 50)

      G = PROPS(1)/(2.0D0*(1.0D0 + PROPS(2)))
      BULK = PROPS(1)/(3.0D0*(1.0D0 - 2.0D0*PROPS(2)))
      ALAME = BULK - 2.0D0*G/3.0D0

C     Elastic trial stress, its pressure and its deviator S
      VOLUME = DSTRAN(1) + DSTRAN(2) + DSTRAN(3)
      DO I = 1, NDI
        STRESS(I) = STRESS(I) + ALAME*VOLUME + 2.0D0*G*DSTRAN(I)
      END DO
      DO I = NDI + 1, NTENS
        STRESS(I) = STRESS(I) + G*DSTRAN(I)
      END DO
      PRESS = (STRESS(1) + STRESS(2) + STRESS(3))/3.0D0
      Q = 0.0D0
      DO I = 1, NDI
        S(I) = STRESS(I) - PRESS
        Q = Q + S(I)**2
      END DO
      DO I = NDI + 1, NTENS
        S(I) = STRESS(I)
        Q = Q + 2.0D0*S(I)**2
      END DO
      Q = SQRT(1.5D0*Q)

C     Newton for the plastic strain increment, from zero
      DEQPS = 0.0D0
      FLOW = PROPS(3) + PROPS(4)*(1.0D0 - EXP(-PROPS(5)*STATEV(1)))
      HARD = PROPS(5)*(PROPS(3) + PROPS(4) - FLOW)
      DONE = Q .LE. FLOW
      ITER = 0
      DO WHILE (.NOT. DONE .AND. ITER .LT. MAXIT)
        ITER = ITER + 1
        RESID = Q - 3.0D0*G*DEQPS - FLOW
        SLOPE = 3.0D0*G + HARD
        DEQPS = DEQPS + RESID/SLOPE
        FLOW = PROPS(3)
     1   + PROPS(4)*(1.0D0 - EXP(-PROPS(5)*(STATEV(1) + DEQPS)))
        HARD = PROPS(5)*(PROPS(3) + PROPS(4) - FLOW)
        DONE = ABS(Q - 3.0D0*G*DEQPS - FLOW) .LE. 1.0D-13*Q
      END DO
      IF (.NOT. DONE) THEN
        PNEWDT = 0.5D0
        RETURN
      END IF

C     Radial return: the deviator shrinks, the pressure stays
      SCALING = 1.0D0
      IF (DEQPS .GT. 0.0D0) SCALING = 1.0D0 - 3.0D0*G*DEQPS/Q
      STATEV(1) = STATEV(1) + DEQPS
      DO I = 1, NDI
        STRESS(I) = SCALING*S(I) + PRESS
      END DO
      DO I = NDI + 1, NTENS
        STRESS(I) = SCALING*S(I)
      END DO

C     Consistent tangent; explicit steps do not use it
      DO J = 1, NTENS
        DO I = 1, NTENS
          DDSDDE(I,J) = 0.0D0
        END DO
      END DO
      DO J = 1, NDI
        DO I = 1, NDI
          DDSDDE(I,J) = BULK - 2.0D0*G*SCALING/3.0D0
        END DO
        DDSDDE(J,J) = DDSDDE(J,J) + 2.0D0*G*SCALING
      END DO
      DO I = NDI + 1, NTENS
        DDSDDE(I,I) = G*SCALING
      END DO
      IF (DEQPS .GT. 0.0D0) THEN
        THETA = 3.0D0*G/(3.0D0*G + HARD) - (1.0D0 - SCALING)
        FACTOR = 3.0D0*G*THETA/Q**2
        DO J = 1, NTENS
          DO I = 1, NTENS
            DDSDDE(I,J) = DDSDDE(I,J) - FACTOR*S(I)*S(J)
          END DO
        END DO
      END IF
      RETURN
      END
