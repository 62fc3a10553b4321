!> The vector product.
module vector_product
  use kinds, only: wp
  implicit none
  private

  public :: cross

contains

  !> Vector at right angles to both, as long as the area between them, on the side from which the
  !! turn from the first to the second goes to the left.
  pure function cross(a, b) result(c)
    real(wp), intent(in) :: a(3), b(3)
    real(wp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

end module vector_product
