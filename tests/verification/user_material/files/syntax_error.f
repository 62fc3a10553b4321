      SUBROUTINE UMAT(A)
      X = = 1
      END
