!> Rational B-spline curves in space, and chains of them as one curve.
module nurbs_curve
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text, rounded_text
  use knot_vector, only: knot_vector_t, new_knot_vector, linear_axis
  use nurbs_surface, only: nurbs_surface_t
  use refinement, only: elevate_degree
  implicit none
  private

  public :: nurbs_curve_t, join_curves

  !> A curve; points are not pre-multiplied by weights.
  type :: nurbs_curve_t
    type(knot_vector_t) :: axis
    real(wp), allocatable :: points(:, :)   !! control points [length], shape (n, 3)
    real(wp), allocatable :: weights(:)     !! positive, shape (n)
  end type nurbs_curve_t

  real(wp), parameter :: widest_gap = 1.0e-4_wp   ! between two curves, part of the chain's size

contains

  !> Curves that follow each other as one curve of their highest degree, continuous where they
  !! meet; each takes a range of knots as long as its control polygon.
  !!
  !! Rejected: a curve that begins elsewhere than the one before it ends, one without length.
  subroutine join_curves(curves, chain, error)
    type(nurbs_curve_t), intent(in) :: curves(:)
    type(nurbs_curve_t), intent(out) :: chain
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_curve_t) :: next
    real(wp), allocatable :: knots(:)
    real(wp) :: size_of_all, length
    integer :: i, k, degree

    degree = maxval([(curves(i)%axis%degree, i=1, size(curves))])
    size_of_all = norm2([(extent(curves, i), i=1, 3)])
    do i = 1, size(curves)
      next = curves(i)
      call raise_degree(next, degree - next%axis%degree, error)
      if (allocated(error)) return
      length = sum([(norm2(next%points(k, :) - next%points(k - 1, :)), k=2, size(next%weights))])
      if (.not. length > 0.0_wp) then
        call fail(error, "curve "//to_text(i)//" of the chain has no length")
        return
      end if
      associate (u => next%axis%knots, m => size(next%axis%knots))
        if (i == 1) then
          chain = next
          knots = length*(u(:m - 1) - u(1))/(u(m) - u(1))
        else
          call append(chain, next, widest_gap*size_of_all, i, error)
          if (allocated(error)) return
          ! The end of the chain so far is there degree times, as inner knots are.
          knots = [knots, knots(size(knots)) + length*(u(degree + 2:m - 1) - u(1))/(u(m) - u(1))]
        end if
      end associate
    end do
    call new_knot_vector(chain%axis, degree, [knots, knots(size(knots))], error)
  end subroutine join_curves

  subroutine append(chain, next, gap, i, error)
    type(nurbs_curve_t), intent(inout) :: chain
    type(nurbs_curve_t), intent(in) :: next
    real(wp), intent(in) :: gap
    integer, intent(in) :: i       !! number of the curve
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: points(:, :)
    real(wp) :: apart
    integer :: n, m

    n = size(chain%weights)
    m = size(next%weights)
    apart = norm2(next%points(1, :) - chain%points(n, :))
    if (.not. apart <= gap) then
      call fail(error, "curve "//to_text(i)//" of the chain begins "//rounded_text(apart)// &
                " away from the end of the one before it")
      return
    end if
    allocate (points(n + m - 1, 3))
    points(:n, :) = chain%points
    points(n + 1:, :) = next%points(2:, :)
    call move_alloc(points, chain%points)
    chain%weights = [chain%weights, next%weights(2:)*(chain%weights(n)/next%weights(1))]
  end subroutine append

  !> Raise the degree, by means of a surface whose rows are all the curve.
  subroutine raise_degree(curve, times, error)
    type(nurbs_curve_t), intent(inout) :: curve
    integer, intent(in) :: times
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_surface_t) :: surface

    if (times == 0) return
    surface%axes(1) = curve%axis
    surface%axes(2) = linear_axis()
    surface%points = spread(curve%points, 2, 2)
    surface%weights = spread(curve%weights, 2, 2)
    call elevate_degree(surface, 1, times, error)
    curve%axis = surface%axes(1)
    curve%points = surface%points(:, 1, :)
    curve%weights = surface%weights(:, 1)
  end subroutine raise_degree

  pure real(wp) function extent(curves, component)
    type(nurbs_curve_t), intent(in) :: curves(:)
    integer, intent(in) :: component
    integer :: i

    extent = maxval([(maxval(curves(i)%points(:, component)), i=1, size(curves))]) &
             - minval([(minval(curves(i)%points(:, component)), i=1, size(curves))])
  end function extent

end module nurbs_curve
