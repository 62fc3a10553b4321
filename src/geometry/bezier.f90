!> Polynomial pieces of a surface: Bezier hulls for bounds, power form for fast evaluation.
!!
!! L. Piegl and W. Tiller, The NURBS Book, 2nd ed., Springer 1997, sections 5.3 and 6.
module bezier
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, n_spans, span_table
  use nurbs_surface, only: nurbs_surface_t
  implicit none
  private

  public :: bezier_face_t, bezier_faces, bezier_hulls, bezier_points, to_power_form

  !> One face of a surface, between neighbouring knots, in homogeneous form (w x, w y, w z, w).
  !!
  !! Its local coordinates run over [0, 1] while xi and eta run from low to high.
  !! The face lies in the convex hull of hull(1:3, ...)/hull(4, ...).
  type :: bezier_face_t
    integer :: degree(2) = 0                 !! degrees p and q
    real(wp) :: low(2) = 0.0_wp, high(2) = 0.0_wp     !! ranges of xi and eta
    real(wp), allocatable :: hull(:, :, :)   !! Bezier control points, shape (4, p + 1, q + 1)
  end type bezier_face_t

contains

  !> All faces of a surface, axis 1 fastest, `n_spans(axis 1)*n_spans(axis 2)` of them.
  pure function bezier_faces(surface) result(faces)
    type(nurbs_surface_t), intent(in) :: surface
    type(bezier_face_t), allocatable :: faces(:)
    real(wp), allocatable :: hulls(:, :, :, :)
    integer :: i, j, n, spans1(n_spans(surface%axes(1))), spans2(n_spans(surface%axes(2)))

    associate (axes => surface%axes)
      spans1 = span_table(axes(1))
      spans2 = span_table(axes(2))
      n = size(spans1)*size(spans2)
      allocate (faces(n), hulls(4, axes(1)%degree + 1, axes(2)%degree + 1, n))
      call bezier_hulls(surface, hulls)
      do j = 1, size(spans2)
        do i = 1, size(spans1)
          n = i + (j - 1)*size(spans1)
          faces(n)%degree = axes%degree
          faces(n)%low = [axes(1)%knots(spans1(i)), axes(2)%knots(spans2(j))]
          faces(n)%high = [axes(1)%knots(spans1(i) + 1), axes(2)%knots(spans2(j) + 1)]
          faces(n)%hull = hulls(:, :, :, n)
        end do
      end do
    end associate
  end function bezier_faces

  !> Bezier control points of all faces of a surface, in homogeneous form, axis 1 fastest. Room
  !! beyond the orders p + 1 and q + 1 of the surface is left alone.
  pure subroutine bezier_hulls(surface, hulls)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(inout) :: hulls(:, :, :, :)   !! shape (4, >= p + 1, >= q + 1, n_faces)
    real(wp), allocatable :: to_1(:, :, :), to_2(:, :, :)
    real(wp) :: rows(4, surface%axes(1)%degree + 1, surface%axes(2)%degree + 1), w
    integer :: spans1(n_spans(surface%axes(1))), spans2(n_spans(surface%axes(2)))
    integer :: i, j, a, b, k, l, n, p, q

    allocate (to_1, source=extraction(surface%axes(1)))
    allocate (to_2, source=extraction(surface%axes(2)))
    spans1 = span_table(surface%axes(1))
    spans2 = span_table(surface%axes(2))
    p = surface%axes(1)%degree
    q = surface%axes(2)%degree
    n = 0
    do j = 1, size(spans2)
      do i = 1, size(spans1)
        n = n + 1
        rows = 0.0_wp
        do l = 1, q + 1
          do k = 1, p + 1
            w = surface%weights(spans1(i) - p + k - 1, spans2(j) - q + l - 1)
            do a = 1, p + 1
              rows(:3, a, l) = rows(:3, a, l) + to_1(k, a, i)*w &
                *surface%points(spans1(i) - p + k - 1, spans2(j) - q + l - 1, :)
              rows(4, a, l) = rows(4, a, l) + to_1(k, a, i)*w
            end do
          end do
        end do
        hulls(:, :p + 1, :q + 1, n) = 0.0_wp
        do b = 1, q + 1
          do l = 1, q + 1
            hulls(:, :p + 1, b, n) = hulls(:, :p + 1, b, n) + to_2(l, b, j)*rows(:, :, l)
          end do
        end do
      end do
    end do
  end subroutine bezier_hulls

  !> Points of a homogeneous hull.
  pure function bezier_points(hull) result(points)
    real(wp), intent(in) :: hull(:, :, :)      !! shape (4, n, m)
    real(wp) :: points(size(hull, 2), size(hull, 3), 3)
    integer :: c

    do c = 1, 3
      points(:, :, c) = hull(c, :, :)/hull(4, :, :)
    end do
  end function bezier_points

  !> Bezier points of each span of an axis as sums over its p + 1 control points: point a is the
  !! blossom at p + 1 - a times the span's begin and a - 1 times its end, by the rule of C. de Boor,
  !! all of whose factors lie between 0 and 1.
  pure function extraction(kv) result(coefficients)
    type(knot_vector_t), intent(in) :: kv
    real(wp) :: coefficients(kv%degree + 1, kv%degree + 1, n_spans(kv))   ! control, Bezier point
    real(wp) :: table(kv%degree + 1, kv%degree + 1), at, factor
    integer :: spans(n_spans(kv)), span, a, r, i, p

    p = kv%degree
    spans = span_table(kv)
    do span = 1, size(spans)
      do a = 1, p + 1
        table = 0.0_wp
        do i = 1, p + 1
          table(i, i) = 1.0_wp
        end do
        do r = 1, p
          at = kv%knots(merge(spans(span), spans(span) + 1, r <= p + 1 - a))
          do i = p + 1, r + 1, -1
            associate (low => kv%knots(spans(span) - p + i - 1), &
                       high => kv%knots(spans(span) + i - r))
              factor = (at - low)/(high - low)
              table(:, i) = (1.0_wp - factor)*table(:, i - 1) + factor*table(:, i)
            end associate
          end do
        end do
        coefficients(:, a, span) = table(:, p + 1)
      end do
    end do
  end function extraction

  !> Bezier points to coefficients of the power form, h(s, t) = sum over a, b of c(:, a, b) s^a t^b
  !! on [0, 1]^2: binomial times forward difference, along both directions.
  pure subroutine to_power_form(p, q, c)
    integer, intent(in) :: p, q   !! degrees
    real(wp), intent(inout) :: c(4, 0:p, 0:q)
    integer :: i, k

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
  end subroutine to_power_form

  pure integer function binomial(n, k)
    integer, intent(in) :: n, k
    integer :: i

    binomial = 1
    do i = 1, k
      binomial = binomial*(n - i + 1)/i
    end do
  end function binomial

end module bezier
