!> Polynomial pieces of a surface: Bezier hulls for bounds, power form for fast evaluation.
!!
!! L. Piegl and W. Tiller, The NURBS Book, 2nd ed., Springer 1997, sections 5.3 and 6.
module bezier
  use kinds, only: wp
  use errors, only: error_t
  use knot_vector, only: knot_vector_t, n_spans, span_table
  use nurbs_surface, only: nurbs_surface_t
  use refinement, only: insert_knots
  implicit none
  private

  public :: bezier_face_t, bezier_faces, power_form

  !> One face of a surface, between neighbouring knots, in homogeneous form (w x, w y, w z, w).
  !!
  !! Its local coordinates run over [0, 1]: s = (xi - xi_low)/(xi_high - xi_low), t the same of eta.
  !! The face lies in the convex hull of hull(1:3, ...)/hull(4, ...).
  type :: bezier_face_t
    integer :: degree(2) = 0                 !! degrees p and q
    real(wp) :: xi_low = 0.0_wp, xi_high = 0.0_wp     !! range of xi
    real(wp) :: eta_low = 0.0_wp, eta_high = 0.0_wp   !! range of eta
    real(wp), allocatable :: hull(:, :, :)   !! Bezier control points, shape (4, p + 1, q + 1)
  end type bezier_face_t

contains

  !> All faces of a surface, axis 1 fastest, `n_spans(axis 1)*n_spans(axis 2)` of them.
  function bezier_faces(surface) result(faces)
    type(nurbs_surface_t), intent(in) :: surface
    type(bezier_face_t), allocatable :: faces(:)
    type(nurbs_surface_t) :: pieces
    integer :: i, j, p, q, spans1(n_spans(surface%axes(1))), spans2(n_spans(surface%axes(2)))

    pieces = surface
    call separate_spans(pieces, 1)
    call separate_spans(pieces, 2)
    p = surface%axes(1)%degree
    q = surface%axes(2)%degree
    spans1 = span_table(pieces%axes(1))
    spans2 = span_table(pieces%axes(2))
    allocate (faces(size(spans1)*size(spans2)))
    do j = 1, size(spans2)
      do i = 1, size(spans1)
        associate (face => faces(i + (j - 1)*size(spans1)))
          face%degree = [p, q]
          face%xi_low = pieces%axes(1)%knots(spans1(i))
          face%xi_high = pieces%axes(1)%knots(spans1(i) + 1)
          face%eta_low = pieces%axes(2)%knots(spans2(j))
          face%eta_high = pieces%axes(2)%knots(spans2(j) + 1)
          allocate (face%hull(4, p + 1, q + 1))
          call copy_hull(pieces, spans1(i) - p, spans2(j) - q, face%hull)
        end associate
      end do
    end do
  end function bezier_faces

  !> Coefficients of the power form, h(s, t) = sum over a, b of c(:, a, b) s^a t^b on [0, 1]^2, with
  !! h = (w x, w y, w z, w): binomial times forward difference of the Bezier points, both ways.
  pure function power_form(face) result(c)
    type(bezier_face_t), intent(in) :: face
    real(wp) :: c(4, 0:face%degree(1), 0:face%degree(2))
    integer :: i, k, p, q

    p = face%degree(1)
    q = face%degree(2)
    c = face%hull
    do k = 1, p
      do i = p, k, -1
        c(:, i, :) = c(:, i, :) - c(:, i - 1, :)
      end do
    end do
    do k = 1, q
      do i = q, k, -1
        c(:, :, i) = c(:, :, i) - c(:, :, i - 1)
      end do
    end do
    do k = 1, p
      c(:, k, :) = binomial(p, k)*c(:, k, :)
    end do
    do k = 1, q
      c(:, :, k) = binomial(q, k)*c(:, :, k)
    end do
  end function power_form

  !> Raise every inner knot of one axis to the multiplicity of the degree.
  subroutine separate_spans(surface, axis)
    type(nurbs_surface_t), intent(inout) :: surface
    integer, intent(in) :: axis
    type(error_t), allocatable :: error
    real(wp), allocatable :: new_knots(:)
    integer :: i, k, repeats

    allocate (new_knots(0))
    associate (kv => surface%axes(axis))
      do i = kv%degree + 2, kv%n_basis
        if (kv%knots(i) > kv%knots(i - 1)) then
          repeats = count(kv%knots(i:) <= kv%knots(i))
          new_knots = [new_knots, [(kv%knots(i), k=repeats + 1, kv%degree)]]
        end if
      end do
    end associate
    ! Cannot be refused: the knots are inner ones and are filled up to the degree only.
    call insert_knots(surface, axis, new_knots, error)
  end subroutine separate_spans

  !> Homogeneous control points of the piece whose first control point is (i, j).
  pure subroutine copy_hull(surface, i, j, hull)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: i, j
    real(wp), intent(out) :: hull(:, :, :)
    integer :: a, b

    do b = 1, size(hull, 3)
      do a = 1, size(hull, 2)
        hull(4, a, b) = surface%weights(i + a - 1, j + b - 1)
        hull(:3, a, b) = hull(4, a, b)*surface%points(i + a - 1, j + b - 1, :)
      end do
    end do
  end subroutine copy_hull

  pure integer function binomial(n, k)
    integer, intent(in) :: n, k
    integer :: i

    binomial = 1
    do i = 1, k
      binomial = binomial*(n - i + 1)/i
    end do
  end function binomial

end module bezier
