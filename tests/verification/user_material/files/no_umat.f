      SUBROUTINE UMATT(A)
      A = 1.
      END
