subroutine myhelper(a)
  real(kind(1d0)) :: a
  a = 0
end subroutine myhelper
