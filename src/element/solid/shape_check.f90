!> Is a patch folded? The jacobian at the centre and at the outermost places of all elements tells.
module shape_check
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: place_text
  use knot_vector, only: knot_vector_t, span_table
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  implicit none
  private

  public :: check_shape

  !> So far towards the centre of an element its ends are tested, as a share of the way: at degree 1
  !! the jacobian has a step between elements.
  real(wp), parameter :: inset = 1.0e-9_wp

contains

  !> Refuse a patch with an element whose jacobian is not positive at its centre, or is negative
  !! at a corner, in the middle of an edge or of a face. Zero is allowed there: an edge may have
  !! collapsed, and two edges may meet at a straight angle, as in a round bar.
  subroutine check_shape(solid, name, error)
    type(nurbs_solid_t), intent(in) :: solid
    character(*), intent(in) :: name                      !! of the patch, for the message
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: spans1(:), spans2(:), spans3(:)
    real(wp) :: places(3, 3)
    integer :: i, j, k

    spans1 = span_table(solid%axes(1))
    spans2 = span_table(solid%axes(2))
    spans3 = span_table(solid%axes(3))
    do k = 1, size(spans3)
      places(:, 3) = places_in(solid%axes(3), spans3(k))
      do j = 1, size(spans2)
        places(:, 2) = places_in(solid%axes(2), spans2(j))
        do i = 1, size(spans1)
          places(:, 1) = places_in(solid%axes(1), spans1(i))
          call check_element(solid, name, places, error)
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine check_shape

  !> Start, middle and end of a span.
  pure function places_in(axis, span) result(places)
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: span
    real(wp) :: places(3)

    associate (first => axis%knots(span), last => axis%knots(span + 1))
      places = [first, 0.5_wp*(first + last), last]
    end associate
  end function places_in

  !> One element, whose places along each axis are the columns of `places`. Middles are left out
  !! along axes of degree 1, where the ends say more.
  subroutine check_element(solid, name, places, error)
    type(nurbs_solid_t), intent(in) :: solid
    character(*), intent(in) :: name
    real(wp), intent(in) :: places(3, 3)
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: round_off = 1.0e-6_wp   ! of the volume at the centre
    real(wp) :: centre, volume, xi(3), x(3)
    integer :: a, b, c, stride(3)

    xi = places(2, :)
    centre = volume_at(solid, xi)
    volume = centre
    if (centre > 0.0_wp) then
      stride = merge(2, 1, solid%axes%degree == 1)
      search: do c = 1, 3, stride(3)
        do b = 1, 3, stride(2)
          do a = 1, 3, stride(1)
            xi = [places(a, 1), places(b, 2), places(c, 3)]
            volume = volume_at(solid, xi + inset*(places(2, :) - xi))
            if (.not. volume >= -round_off*centre) exit search
          end do
        end do
      end do search
    end if
    if (centre > 0.0_wp .and. volume >= -round_off*centre) return
    call evaluate_solid(solid, xi, x)
    call fail(error, "the patch "//name//", folded, inverted or flat at "// &
              place_text(x)//": its jacobian there is not positive")
  end subroutine check_element

  !> Determinant of the jacobian.
  pure real(wp) function volume_at(solid, xi) result(volume)
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), intent(in) :: xi(3)
    real(wp) :: x(3), a(3, 3)

    call evaluate_solid(solid, xi, x, a)
    volume = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) &
             + a(1, 2)*(a(2, 3)*a(3, 1) - a(2, 1)*a(3, 3)) &
             + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
  end function volume_at

end module shape_check
