!> Control nets of the two faces of a shell, which follow its mid-surface.
!!
!! A face is the mid-surface moved by half the thickness h along the unit normal a3:
!! c_A = x_A + s h_A/2 d_A, with s = 1 for face 6 and -1 for face 5. The vectors d_A are the
!! coefficients of a quasi-interpolant of a3 (T. Lyche and L. L. Schumaker, Local spline
!! approximation methods, J. Approx. Theory 15 (1975) 294-325): normals at the Greville points, then
!! three neighbours along each axis, exact for quadratic polynomials. So the error of a face is of
!! third order in the size of the elements. A rational mid-surface has W a3 approximated instead,
!! with W = sum N w, over the same of W alone: planes are exact, and so are arcs.
!!
!! Forces on a net go to the mid-surface by the transpose of the derivative of c by x, in which h is
!! held. Rigid motions of the mid-surface move the faces rigidly, so that forces and moments of both
!! are equal to round-off.
!!
!! At a knot as often repeated as the degree the normal is that of the higher side.
module shell_faces
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, find_span, basis_derivatives, greville
  implicit none
  private

  public :: new_shell_faces, find_normals, face_net, face_velocities, add_face_forces, rows_around

  integer, parameter :: parallel_size = 2000   !! fewer points are not worth waking threads for

  !> A square matrix with few diagonals: (B u)_i = sum over d of values(i, d) u_(i + d).
  type :: band_t
    integer :: n = 0, low = 0, high = 0       !! rows, diagonals
    real(wp), allocatable :: values(:, :)     !! shape (n, low:high), zero beyond the matrix
  end type band_t

  !> Matrices of one axis, from control points to Greville points (the filter: back to
  !! coefficients), and their transposes.
  type :: axis_bands_t
    type(band_t) :: value, slope, filter
    type(band_t) :: value_back, slope_back, filter_back
  end type axis_bands_t

  !> Both faces of one patch; fields by control point or by Greville point, shape (n1, n2).
  type, public :: shell_faces_t
    integer :: n(2) = 0                            !! control points
    type(axis_bands_t) :: axes(2)
    logical :: is_rational = .false.               !! weights differ from one
    real(wp), allocatable :: weights(:, :)         !! w of the control points
    real(wp), allocatable :: weight_at(:, :)       !! W at the Greville points
    real(wp), allocatable :: weight_slope(:, :, :) !! its derivatives by xi and eta, over W
    real(wp), allocatable :: scale(:, :)           !! 1/(filter of W)
    real(wp), allocatable :: normal(:, :, :)       !! a3 at the Greville points, (n1, n2, 3)
    real(wp), allocatable :: dual(:, :, :, :)      !! a^1 and a^2 there, (n1, n2, 3, 2) [1/length]
    real(wp), allocatable :: director(:, :, :)     !! d of the control points, (n1, n2, 3)
    real(wp), allocatable :: push(:, :, :, :)      !! on W x and its derivatives, (n1, n2, 3, 0:2)
  end type shell_faces_t

contains

  !> Tables of a mid-surface with these axes and weights; there are no normals yet.
  pure subroutine new_shell_faces(faces, axes, weights)
    type(shell_faces_t), intent(out) :: faces
    type(knot_vector_t), intent(in) :: axes(2)
    real(wp), intent(in) :: weights(:, :)     !! of the control points
    integer :: n(2), d

    n = axes%n_basis
    faces%n = n
    faces%weights = weights
    faces%is_rational = any(abs(weights - 1.0_wp) > 0.0_wp)
    do d = 1, 2
      call set_basis(faces%axes(d), axes(d))
      call set_filter(faces%axes(d), axes(d))
    end do
    allocate (faces%normal(n(1), n(2), 3), faces%director(n(1), n(2), 3), source=0.0_wp)
    allocate (faces%dual(n(1), n(2), 3, 2), faces%push(n(1), n(2), 3, 0:2), source=0.0_wp)
    associate (one => faces%axes(1), two => faces%axes(2))
      faces%weight_at = blend(one%value, two%value, weights)
      allocate (faces%weight_slope(n(1), n(2), 2))
      faces%weight_slope(:, :, 1) = blend(one%slope, two%value, weights)/faces%weight_at
      faces%weight_slope(:, :, 2) = blend(one%value, two%slope, weights)/faces%weight_at
      faces%scale = blend(one%filter, two%filter, faces%weight_at)
    end associate
    ! Weights that change too much from point to point for a filter: it would be divided by nothing.
    if (any(faces%scale < 0.5_wp*weights)) then
      do d = 1, 2
        call unit_filter(faces%axes(d))
      end do
      faces%scale = faces%weight_at
    end if
    faces%scale = 1.0_wp/faces%scale
  end subroutine new_shell_faces

  !> Values and slopes of the basis functions at the Greville points.
  pure subroutine set_basis(bands, axis)
    type(axis_bands_t), intent(inout) :: bands
    type(knot_vector_t), intent(in) :: axis
    real(wp), allocatable :: xi(:)
    real(wp) :: values(axis%degree + 1, 0:1), table(axis%n_basis, -axis%degree:axis%degree, 0:1)
    integer :: i, k, span

    allocate (xi, source=greville(axis))
    table = 0.0_wp
    do i = 1, axis%n_basis
      span = find_span(axis, xi(i))
      call basis_derivatives(axis, span, xi(i), 1, values)
      do k = 1, axis%degree + 1
        associate (d => span - axis%degree + k - 1 - i)
          if (abs(d) <= axis%degree) table(i, d, :) = values(k, :)
        end associate
      end do
    end do
    call new_band(bands%value, axis%degree, table(:, :, 0))
    call new_band(bands%slope, axis%degree, table(:, :, 1))
    call transpose_band(bands%value, bands%value_back)
    call transpose_band(bands%slope, bands%slope_back)
  end subroutine set_basis

  !> The filter from values f at the Greville points g to coefficients. A quadratic has the
  !! coefficient f(g_A) + m_A f''/2, m_A being the mean of the products of two knots of A less
  !! g_A^2; f''/2 comes from three neighbours. At ends, and of degree 1, m is zero: f itself. The
  !! weights stay below 1 + p^2/(4 (p - 1)), whatever the knots.
  pure subroutine set_filter(bands, axis)
    type(axis_bands_t), intent(inout) :: bands
    type(knot_vector_t), intent(in) :: axis
    real(wp) :: table(axis%n_basis, -1:1), g(axis%n_basis), m, before, after
    integer :: a

    g = greville(axis)
    table = 0.0_wp
    table(:, 0) = 1.0_wp
    if (axis%degree > 1) then
      do a = 2, axis%n_basis - 1
        associate (knots => axis%knots(a + 1:a + axis%degree))
          m = -sum((knots - g(a))**2)/(axis%degree*(axis%degree - 1))
        end associate
        before = g(a) - g(a - 1)
        after = g(a + 1) - g(a)
        table(a, -1) = m/(before*(before + after))
        table(a, 1) = m/(after*(before + after))
        table(a, 0) = 1.0_wp - table(a, -1) - table(a, 1)
      end do
    end if
    call new_band(bands%filter, 1, table)
    call transpose_band(bands%filter, bands%filter_back)
  end subroutine set_filter

  !> No filter.
  pure subroutine unit_filter(bands)
    type(axis_bands_t), intent(inout) :: bands
    real(wp) :: ones(bands%value%n, -1:1)

    ones = 0.0_wp
    ones(:, 0) = 1.0_wp
    call new_band(bands%filter, 1, ones)
    call transpose_band(bands%filter, bands%filter_back)
  end subroutine unit_filter

  !> A band of the diagonals that hold more than round-off.
  pure subroutine new_band(band, reach, table)
    type(band_t), intent(inout) :: band
    integer, intent(in) :: reach                      !! diagonals to either side
    real(wp), intent(in) :: table(:, -reach:)
    real(wp), parameter :: nothing = 1.0e-14_wp       ! of the largest value
    logical :: is_used(-reach:reach)
    integer :: d

    is_used = maxval(abs(table), 1) > nothing*maxval(abs(table))
    band%n = size(table, 1)
    band%low = minval(pack([(d, d=-reach, reach)], is_used))
    band%high = maxval(pack([(d, d=-reach, reach)], is_used))
    if (allocated(band%values)) deallocate (band%values)
    allocate (band%values(band%n, band%low:band%high), source=table(:, band%low:band%high))
  end subroutine new_band

  pure subroutine transpose_band(band, back)
    type(band_t), intent(in) :: band
    type(band_t), intent(inout) :: back
    real(wp) :: table(band%n, -max(-band%low, band%high, 0):max(-band%low, band%high, 0))
    integer :: i, d

    table = 0.0_wp
    do d = band%low, band%high
      do i = max(1, 1 - d), min(band%n, band%n - d)
        table(i + d, -d) = band%values(i, d)
      end do
    end do
    call new_band(back, ubound(table, 2), table)
  end subroutine transpose_band

  !> A scalar field through the matrices of both axes.
  pure function blend(one, two, field) result(values)
    type(band_t), intent(in) :: one, two
    real(wp), intent(in) :: field(one%n, two%n)
    real(wp) :: values(one%n, two%n), half(one%n, two%n)
    integer :: i, j, d

    half = 0.0_wp
    do d = one%low, one%high
      do i = max(1, 1 - d), min(one%n, one%n - d)
        half(i, :) = half(i, :) + one%values(i, d)*field(i + d, :)
      end do
    end do
    values = 0.0_wp
    do d = two%low, two%high
      do j = max(1, 1 - d), min(two%n, two%n - d)
        values(:, j) = values(:, j) + two%values(j, d)*half(:, j + d)
      end do
    end do
  end function blend

  !> How many rows of control points beyond a row, along axis 2, its faces and the forces that go
  !! from them to the mid-surface depend on.
  pure integer function rows_around(faces) result(n)
    type(shell_faces_t), intent(in) :: faces

    n = 2*rows_of_bands(faces)
  end function rows_around

  !> Rows of Greville points about a row of control points, and the other way round.
  pure integer function rows_of_bands(faces) result(n)
    type(shell_faces_t), intent(in) :: faces

    associate (bands => faces%axes(2))
      n = max(-bands%value%low, bands%value%high, -bands%slope%low, bands%slope%high, &
              -bands%filter%low, bands%filter%high)
    end associate
  end function rows_of_bands

  !> Some rows, and those of Greville points on which they depend.
  pure function with_neighbours(faces, rows) result(wide)
    type(shell_faces_t), intent(in) :: faces
    integer, intent(in) :: rows(2)                          !! first and last
    integer :: wide(2)

    wide(1) = max(1, rows(1) - rows_of_bands(faces))
    wide(2) = min(faces%n(2), rows(2) + rows_of_bands(faces))
  end function with_neighbours

  !> The rows that are given, else all.
  pure function rows_or_all(faces, rows) result(chosen)
    type(shell_faces_t), intent(in) :: faces
    integer, intent(in), optional :: rows(2)
    integer :: chosen(2)

    chosen = [1, faces%n(2)]
    if (present(rows)) chosen = rows
  end function rows_or_all

  !> Normals of the mid-surface, from which the procedures below take the place of the faces. Once a
  !! step; the same bits for any number of threads. Of some rows of the faces, `rows_around` more
  !! of control points must be known to either side.
  subroutine find_normals(faces, x, rows)
    type(shell_faces_t), intent(inout) :: faces
    real(wp), intent(in) :: x(faces%n(1), faces%n(2), 3)    !! control points [length]
    integer, intent(in), optional :: rows(2)                !! first and last; absent: all
    integer :: chosen(2)

    chosen = rows_or_all(faces, rows)
    !$omp parallel if (product(faces%n) > parallel_size)
    call set_normals(faces, faces%n(1), faces%n(2), with_neighbours(faces, chosen), x)
    call set_directors(faces, faces%n(1), chosen)
    !$omp end parallel
  end subroutine find_normals

  !> The threads of a region divide the rows.
  subroutine set_normals(faces, n1, n2, rows, x)
    type(shell_faces_t), intent(inout) :: faces
    integer, intent(in) :: n1, n2, rows(2)
    real(wp), intent(in) :: x(n1, n2, 3)
    real(wp) :: a(n1, 3, 2)
    integer :: j

    !$omp do schedule(static)
    do j = rows(1), rows(2)
      call tangents(faces, n1, n2, x, j, a)
      call normals_of(n1, n2, j, a, faces%normal, faces%dual)
    end do
    !$omp end do
  end subroutine set_normals

  !> Coefficients of the normal; the threads of a region divide the rows.
  subroutine set_directors(faces, n1, rows)
    type(shell_faces_t), intent(inout) :: faces
    integer, intent(in) :: n1, rows(2)
    real(wp) :: line(n1, 3), row(n1, 3)
    integer :: j, c

    !$omp do schedule(static)
    do j = rows(1), rows(2)
      call blend_across(faces%axes(2)%filter, j, n1, faces%normal, line, faces%weight_at)
      row = 0.0_wp
      call add_along(faces%axes(1)%filter, n1, line, row)
      do c = 1, 3
        faces%director(:, j, c) = faces%scale(:, j)*row(:, c)
      end do
    end do
    !$omp end do
  end subroutine set_directors

  !> Derivatives by xi and eta of a field on the control points, at a row of Greville points.
  pure subroutine tangents(faces, n1, n2, field, j, a)
    type(shell_faces_t), intent(in) :: faces
    integer, intent(in) :: n1, n2, j
    real(wp), intent(in) :: field(n1, n2, 3)
    real(wp), intent(out) :: a(n1, 3, 2)
    real(wp) :: line(n1, 3), steep(n1, 3), at(n1, 3)
    integer :: c, d

    call blend_across(faces%axes(2)%value, j, n1, field, line, faces%weights)
    call blend_across(faces%axes(2)%slope, j, n1, field, steep, faces%weights)
    a = 0.0_wp
    call add_along(faces%axes(1)%slope, n1, line, a(:, :, 1))
    call add_along(faces%axes(1)%value, n1, steep, a(:, :, 2))
    if (.not. faces%is_rational) return
    at = 0.0_wp
    call add_along(faces%axes(1)%value, n1, line, at)
    do d = 1, 2
      do c = 1, 3
        a(:, c, d) = (a(:, c, d) - faces%weight_slope(:, j, d)*at(:, c))/faces%weight_at(:, j)
      end do
    end do
  end subroutine tangents

  !> Unit normals and dual tangents of a row; zero where the tangents span no area.
  pure subroutine normals_of(n1, n2, j, a, normal, dual)
    integer, intent(in) :: n1, n2, j
    real(wp), intent(in) :: a(n1, 3, 2)
    real(wp), intent(inout) :: normal(n1, n2, 3), dual(n1, n2, 3, 2)
    real(wp) :: n(3), inverse
    integer :: i

    !$omp simd private(n)
    do i = 1, n1
      n(1) = a(i, 2, 1)*a(i, 3, 2) - a(i, 3, 1)*a(i, 2, 2)
      n(2) = a(i, 3, 1)*a(i, 1, 2) - a(i, 1, 1)*a(i, 3, 2)
      n(3) = a(i, 1, 1)*a(i, 2, 2) - a(i, 2, 1)*a(i, 1, 2)
      inverse = 1.0_wp/max(sqrt(n(1)**2 + n(2)**2 + n(3)**2), tiny(1.0_wp))
      n(1) = n(1)*inverse
      n(2) = n(2)*inverse
      n(3) = n(3)*inverse
      normal(i, j, 1) = n(1)
      normal(i, j, 2) = n(2)
      normal(i, j, 3) = n(3)
      dual(i, j, 1, 1) = (a(i, 2, 2)*n(3) - a(i, 3, 2)*n(2))*inverse
      dual(i, j, 2, 1) = (a(i, 3, 2)*n(1) - a(i, 1, 2)*n(3))*inverse
      dual(i, j, 3, 1) = (a(i, 1, 2)*n(2) - a(i, 2, 2)*n(1))*inverse
      dual(i, j, 1, 2) = (n(2)*a(i, 3, 1) - n(3)*a(i, 2, 1))*inverse
      dual(i, j, 2, 2) = (n(3)*a(i, 1, 1) - n(1)*a(i, 3, 1))*inverse
      dual(i, j, 3, 2) = (n(1)*a(i, 2, 1) - n(2)*a(i, 1, 1))*inverse
    end do
  end subroutine normals_of

  !> A row of a field through a matrix of axis 2, with factors on the field where they are given.
  pure subroutine blend_across(band, j, n1, field, line, weights)
    type(band_t), intent(in) :: band
    integer, intent(in) :: j, n1
    real(wp), intent(in) :: field(n1, band%n, 3)
    real(wp), intent(out) :: line(n1, 3)
    real(wp), intent(in), optional :: weights(n1, band%n)
    integer :: c, k, first, last

    first = max(1, j + band%low)
    last = min(band%n, j + band%high)
    if (last - first == 2) then
      call blend_three(band%values(j, first - j:last - j), first, n1, band%n, field, line, weights)
      return
    end if
    line = 0.0_wp
    do k = first, last
      do c = 1, 3
        if (present(weights)) then
          line(:, c) = line(:, c) + band%values(j, k - j)*weights(:, k)*field(:, k, c)
        else
          line(:, c) = line(:, c) + band%values(j, k - j)*field(:, k, c)
        end if
      end do
    end do
  end subroutine blend_across

  !> Three rows, in one go: what most matrices of degree 2 ask for, and all filters.
  pure subroutine blend_three(b, k, n1, n2, field, line, weights)
    integer, intent(in) :: k, n1, n2          !! first row, size of the field
    real(wp), intent(in) :: b(3), field(n1, n2, 3)
    real(wp), intent(out) :: line(n1, 3)
    real(wp), intent(in), optional :: weights(n1, n2)
    real(wp) :: u, v, w
    integer :: i

    if (present(weights)) then
      !$omp simd private(u, v, w)
      do i = 1, n1
        u = b(1)*weights(i, k)
        v = b(2)*weights(i, k + 1)
        w = b(3)*weights(i, k + 2)
        line(i, 1) = u*field(i, k, 1) + v*field(i, k + 1, 1) + w*field(i, k + 2, 1)
        line(i, 2) = u*field(i, k, 2) + v*field(i, k + 1, 2) + w*field(i, k + 2, 2)
        line(i, 3) = u*field(i, k, 3) + v*field(i, k + 1, 3) + w*field(i, k + 2, 3)
      end do
    else
      !$omp simd
      do i = 1, n1
        line(i, 1) = b(1)*field(i, k, 1) + b(2)*field(i, k + 1, 1) + b(3)*field(i, k + 2, 1)
        line(i, 2) = b(1)*field(i, k, 2) + b(2)*field(i, k + 1, 2) + b(3)*field(i, k + 2, 2)
        line(i, 3) = b(1)*field(i, k, 3) + b(2)*field(i, k + 1, 3) + b(3)*field(i, k + 2, 3)
      end do
    end if
  end subroutine blend_three

  !> Add a line of control or Greville points, taken through a matrix of axis 1.
  pure subroutine add_along(band, n1, line, row)
    type(band_t), intent(in) :: band
    integer, intent(in) :: n1
    real(wp), intent(in) :: line(n1, 3)
    real(wp), intent(inout) :: row(n1, 3)
    integer :: c, d, first, last

    if (band%low == -1 .and. band%high == 1) then
      call add_three(n1, band%values, line, row)
      return
    end if
    do c = 1, 3
      do d = band%low, band%high
        first = max(1, 1 - d)
        last = min(n1, n1 - d)
        row(first:last, c) = row(first:last, c) &
                             + band%values(first:last, d)*line(first + d:last + d, c)
      end do
    end do
  end subroutine add_along

  !> Three diagonals, in one go.
  pure subroutine add_three(n1, values, line, row)
    integer, intent(in) :: n1
    real(wp), intent(in) :: values(n1, -1:1), line(n1, 3)
    real(wp), intent(inout) :: row(n1, 3)
    integer :: i

    row(1, :) = row(1, :) + values(1, 0)*line(1, :) + values(1, 1)*line(2, :)
    !$omp simd
    do i = 2, n1 - 1
      row(i, 1) = row(i, 1) + values(i, -1)*line(i - 1, 1) + values(i, 0)*line(i, 1) &
                  + values(i, 1)*line(i + 1, 1)
      row(i, 2) = row(i, 2) + values(i, -1)*line(i - 1, 2) + values(i, 0)*line(i, 2) &
                  + values(i, 1)*line(i + 1, 2)
      row(i, 3) = row(i, 3) + values(i, -1)*line(i - 1, 3) + values(i, 0)*line(i, 3) &
                  + values(i, 1)*line(i + 1, 3)
    end do
    row(n1, :) = row(n1, :) + values(n1, -1)*line(n1 - 1, :) + values(n1, 0)*line(n1, :)
  end subroutine add_three

  !> Control points of a face, of the mid-surface that `find_normals` was given. Rows that are not
  !! asked for stay as they are.
  subroutine face_net(faces, side, x, thickness, net, rows)
    type(shell_faces_t), intent(in) :: faces
    integer, intent(in) :: side                                 !! 5 or 6
    real(wp), intent(in) :: x(faces%n(1), faces%n(2), 3)        !! [length]
    real(wp), intent(in) :: thickness(faces%n(1), faces%n(2))   !! at the control points [length]
    real(wp), intent(inout) :: net(faces%n(1), faces%n(2), 3)   !! [length]
    integer, intent(in), optional :: rows(2)                    !! first and last; absent: all
    integer :: chosen(2), j, c

    chosen = rows_or_all(faces, rows)
    !$omp parallel do schedule(static) private(c) if (product(faces%n) > parallel_size)
    do j = chosen(1), chosen(2)
      do c = 1, 3
        net(:, j, c) = x(:, j, c) + arm_of(side)*thickness(:, j)*faces%director(:, j, c)
      end do
    end do
    !$omp end parallel do
  end subroutine face_net

  !> Distance of a face from the mid-surface along the normal, over the thickness.
  pure real(wp) function arm_of(side)
    integer, intent(in) :: side        !! 5 or 6

    arm_of = merge(0.5_wp, -0.5_wp, side == 6)
  end function arm_of

  !> Velocities of the control points of a face, from those of the mid-surface.
  subroutine face_velocities(faces, side, v, thickness, net, thickening)
    type(shell_faces_t), intent(in) :: faces
    integer, intent(in) :: side                                 !! 5 or 6
    real(wp), intent(in) :: v(faces%n(1), faces%n(2), 3)        !! [length/time]
    real(wp), intent(in) :: thickness(faces%n(1), faces%n(2))   !! at the control points [length]
    real(wp), intent(out) :: net(faces%n(1), faces%n(2), 3)     !! [length/time]
    !> Rate of the thickness [length/time]; without it, it is held.
    real(wp), intent(in), optional :: thickening(faces%n(1), faces%n(2))
    integer :: j, c

    !$omp parallel do schedule(static) private(c) if (product(faces%n) > parallel_size)
    do j = 1, faces%n(2)
      call velocity_row(faces, faces%n(1), faces%n(2), side, v, thickness, j, net)
      if (.not. present(thickening)) cycle
      do c = 1, 3
        net(:, j, c) = net(:, j, c) + arm_of(side)*thickening(:, j)*faces%director(:, j, c)
      end do
    end do
    !$omp end parallel do
  end subroutine face_velocities

  !> One row: the rates of the normals of its neighbours through the filter.
  pure subroutine velocity_row(faces, n1, n2, side, v, thickness, j, net)
    type(shell_faces_t), intent(in) :: faces
    integer, intent(in) :: n1, n2, side, j
    real(wp), intent(in) :: v(n1, n2, 3), thickness(n1, n2)
    real(wp), intent(inout) :: net(n1, n2, 3)
    real(wp) :: rate(n1, 3, 2), line(n1, 3), row(n1, 3)
    integer :: c, k

    line = 0.0_wp
    associate (filter => faces%axes(2)%filter)
      do k = max(1, j + filter%low), min(n2, j + filter%high)
        call tangents(faces, n1, n2, v, k, rate)
        call add_turns(n1, n2, k, filter%values(j, k - j), faces%weight_at, rate, faces%normal, &
                       faces%dual, line)
      end do
    end associate
    row = 0.0_wp
    call add_along(faces%axes(1)%filter, n1, line, row)
    do c = 1, 3
      net(:, j, c) = v(:, j, c) + arm_of(side)*thickness(:, j)*faces%scale(:, j)*row(:, c)
    end do
  end subroutine velocity_row

  !> Add a factor times W times the rates of the normals of a row: -(a3 . rate of a_alpha) a^alpha.
  pure subroutine add_turns(n1, n2, k, factor, weight, rate, normal, dual, line)
    integer, intent(in) :: n1, n2, k
    real(wp), intent(in) :: factor, weight(n1, n2), rate(n1, 3, 2)
    real(wp), intent(in) :: normal(n1, n2, 3), dual(n1, n2, 3, 2)
    real(wp), intent(inout) :: line(n1, 3)
    real(wp) :: u, v
    integer :: i

    !$omp simd private(u, v)
    do i = 1, n1
      u = -factor*weight(i, k)*(normal(i, k, 1)*rate(i, 1, 1) + normal(i, k, 2)*rate(i, 2, 1) &
                                + normal(i, k, 3)*rate(i, 3, 1))
      v = -factor*weight(i, k)*(normal(i, k, 1)*rate(i, 1, 2) + normal(i, k, 2)*rate(i, 2, 2) &
                                + normal(i, k, 3)*rate(i, 3, 2))
      line(i, 1) = line(i, 1) + u*dual(i, k, 1, 1) + v*dual(i, k, 1, 2)
      line(i, 2) = line(i, 2) + u*dual(i, k, 2, 1) + v*dual(i, k, 2, 2)
      line(i, 3) = line(i, 3) + u*dual(i, k, 3, 1) + v*dual(i, k, 3, 2)
    end do
  end subroutine add_turns

  !> Add forces on the control points of a face to those of the mid-surface, so that their power is
  !! the same. The same bits for any number of threads. Of some rows of the mid-surface, the forces
  !! on `rows_around` more of the face must be known to either side.
  subroutine add_face_forces(faces, side, thickness, f, force, rows)
    type(shell_faces_t), intent(inout) :: faces
    integer, intent(in) :: side                                 !! 5 or 6
    real(wp), intent(in) :: thickness(faces%n(1), faces%n(2))   !! at the control points [length]
    real(wp), intent(in) :: f(faces%n(1), faces%n(2), 3)        !! on the face [force]
    real(wp), intent(inout) :: force(faces%n(1), faces%n(2), 3) !! on the mid-surface [force]
    integer, intent(in), optional :: rows(2)                    !! first and last; absent: all
    integer :: chosen(2)

    chosen = rows_or_all(faces, rows)
    !$omp parallel if (product(faces%n) > parallel_size)
    call push_normals(faces, faces%n(1), faces%n(2), with_neighbours(faces, chosen), &
                      arm_of(side), thickness, f)
    call spread_pushes(faces, faces%n(1), faces%n(2), chosen, f, force)
    !$omp end parallel
  end subroutine add_face_forces

  !> What forces on a face do to the tangents at the Greville points: to the normal through the
  !! filter, and from it -(g . a^alpha) a3. The threads of a region divide the rows.
  subroutine push_normals(faces, n1, n2, rows, arm, thickness, f)
    type(shell_faces_t), intent(inout) :: faces
    integer, intent(in) :: n1, n2, rows(2)
    real(wp), intent(in) :: arm, thickness(n1, n2), f(n1, n2, 3)
    real(wp) :: line(n1, 3), g(n1, 3)
    integer :: i, j, k, c
    real(wp) :: b

    !$omp do schedule(static)
    do j = rows(1), rows(2)
      line = 0.0_wp
      associate (filter => faces%axes(2)%filter_back)
        do k = max(1, j + filter%low), min(n2, j + filter%high)
          b = arm*filter%values(j, k - j)
          do c = 1, 3
            !$omp simd
            do i = 1, n1
              line(i, c) = line(i, c) + b*thickness(i, k)*faces%scale(i, k)*f(i, k, c)
            end do
          end do
        end do
      end associate
      g = 0.0_wp
      call add_along(faces%axes(1)%filter_back, n1, line, g)
      call push_row(n1, n2, j, g, faces%normal, faces%dual, faces%push)
      if (.not. faces%is_rational) cycle
      do c = 1, 3
        faces%push(:, j, c, 0) = -faces%weight_slope(:, j, 1)*faces%push(:, j, c, 1) &
                                 - faces%weight_slope(:, j, 2)*faces%push(:, j, c, 2)
      end do
    end do
    !$omp end do
  end subroutine push_normals

  !> A row of pushes on the derivatives of W x by xi and eta. W a3 is what is filtered, and tangents
  !! have W in their denominator, so that none remains.
  pure subroutine push_row(n1, n2, j, g, normal, dual, push)
    integer, intent(in) :: n1, n2, j
    real(wp), intent(in) :: g(n1, 3), normal(n1, n2, 3), dual(n1, n2, 3, 2)
    real(wp), intent(inout) :: push(n1, n2, 3, 0:2)
    real(wp) :: p
    integer :: i, d

    do d = 1, 2
      !$omp simd private(p)
      do i = 1, n1
        p = -(g(i, 1)*dual(i, j, 1, d) + g(i, 2)*dual(i, j, 2, d) + g(i, 3)*dual(i, j, 3, d))
        push(i, j, 1, d) = p*normal(i, j, 1)
        push(i, j, 2, d) = p*normal(i, j, 2)
        push(i, j, 3, d) = p*normal(i, j, 3)
      end do
    end do
  end subroutine push_row

  !> Forces on the control points from the forces on the face and the pushes on the tangents. The
  !! threads of a region divide the rows.
  subroutine spread_pushes(faces, n1, n2, rows, f, force)
    type(shell_faces_t), intent(in) :: faces
    integer, intent(in) :: n1, n2, rows(2)
    real(wp), intent(in) :: f(n1, n2, 3)
    real(wp), intent(inout) :: force(n1, n2, 3)
    real(wp) :: line(n1, 3), more(n1, 3), row(n1, 3)
    integer :: j, c

    !$omp do schedule(static)
    do j = rows(1), rows(2)
      associate (one => faces%axes(1), two => faces%axes(2))
        row = 0.0_wp
        call blend_across(two%value_back, j, n1, faces%push(:, :, :, 1), line)
        call add_along(one%slope_back, n1, line, row)
        call blend_across(two%slope_back, j, n1, faces%push(:, :, :, 2), line)
        if (faces%is_rational) then
          call blend_across(two%value_back, j, n1, faces%push(:, :, :, 0), more)
          line = line + more
        end if
        call add_along(one%value_back, n1, line, row)
      end associate
      do c = 1, 3
        force(:, j, c) = force(:, j, c) + f(:, j, c) + faces%weights(:, j)*row(:, c)
      end do
    end do
    !$omp end do
  end subroutine spread_pushes

end module shell_faces
