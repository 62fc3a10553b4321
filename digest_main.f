C     INCLUDE 'digest_part.inc'
