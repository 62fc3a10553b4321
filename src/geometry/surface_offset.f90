!> A surface at a constant distance from another one, and where it has none: where the surface bends
!! more sharply than the distance, or has an edge.
!!
!! The offset of a NURBS surface is none in general, so it is interpolated at the Greville points of
!! the given surface's own knots and weights, and these are refined until it is within a tolerance
!! (W. Tiller and E. G. Hanson, IEEE Comput. Graph. Appl. 4(9), 1984; R. T. Farouki, Comput. Aided
!! Geom. Des. 3 (1986) describes what it loses: one order of smoothness at every knot). Keeping the
!! weights makes it exact, on the given knots, wherever the offset is in their space: planes,
!! cylinders, cones, spheres and tori of rational arcs.
module surface_offset
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text, rounded_text, place_text
  use linear_algebra, only: solve_band, cross
  use knot_vector, only: knot_vector_t, greville, find_span, basis_derivatives, n_spans, &
                         span_table
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use refinement, only: insert_knots, elevate_degree
  implicit none
  private

  public :: samples_along, offset_surface, offset_report_t

  real(wp), parameter :: collapsed = 1.0e-9_wp   !! tangent, part of the mean one of its direction
  real(wp), parameter :: thinnest = 1.0e-10_wp   !! sine of the angle between the tangents
  real(wp), parameter :: knot_inset = 1.0e-9_wp      !! part of a span that a knot is avoided by
  real(wp), parameter :: no_turn = 1.0e-6_wp     !! angle that the two sides of a knot may differ by
  real(wp), parameter :: inside = 1.0e-4_wp      !! the same, where curvature is measured
  real(wp), parameter :: flattest = 1.0e-3_wp    !! least stretch of the surface by the offset

  integer, parameter :: n_inner = 6              !! positions in a span where the offset is checked
  real(wp), parameter :: end_inset = 1.0e-4_wp   !! fraction of a span left out at its ends
  real(wp), parameter :: fraction = 0.4_wp          !! of the tolerance that a direction may use up
  real(wp), parameter :: sure = 0.9_wp           !! part of it kept to: positions miss peaks
  integer, parameter :: most_parts = 8           !! that a span is cut into at a time
  integer, parameter :: most_rounds = 20, most_faces = 100000

  !> What came out.
  type :: offset_report_t
    integer :: n_faces = 0
    integer :: n_places = 0             !! that the error was measured at
    real(wp) :: error = 0.0_wp          !! largest distance from the exact offset there [length]
    real(wp) :: angle = 0.0_wp          !! largest angle of normals there [degrees]
  end type offset_report_t

  !> The surface to be offset.
  type :: source_t
    type(nurbs_surface_t) :: surface
    real(wp) :: distance = 0.0_wp       !! along xi x eta [length]
    real(wp) :: shortest(2) = 0.0_wp    !! tangents that are none
  end type source_t

contains

  !> Position at `distance` along the normal xi x eta. At an edge that is one point, such as the
  !! pole of a sphere, the normal is the one that its neighbourhood tends to.
  pure subroutine find_offset_point(surface, xi, distance, shortest, position, normal, is_regular)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: xi(2)
    real(wp), intent(in) :: distance              !! either sign [length]
    real(wp), intent(in) :: shortest(2)           !! from `shortest_tangents`
    real(wp), intent(out) :: position(3), normal(3)
    logical, intent(out) :: is_regular            !! it has a normal
    real(wp) :: point(3), d1(3, 2), d2(3, 3)
    integer :: d

    call evaluate_surface(surface, xi, point, d1)
    if (any(norm2(d1, 1) < shortest)) then
      d = merge(1, 2, norm2(d1(:, 1)) < shortest(1))
      call evaluate_surface(surface, xi, point, d1, d2)
      associate (knots => surface%axes(3 - d)%knots)
        d1(:, d) = sign(1.0_wp, knots(1) + knots(size(knots)) - 2*xi(3 - d))*d2(:, 3)
      end associate
    end if
    normal = cross(d1(:, 1), d1(:, 2))
    is_regular = norm2(normal) > thinnest*norm2(d1(:, 1))*norm2(d1(:, 2))
    if (is_regular) normal = normal/norm2(normal)
    position = point + distance*normal
  end subroutine find_offset_point

  !> Tangents along xi and eta that are shorter belong to an edge that is one point.
  pure function shortest_tangents(surface) result(shortest)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp) :: shortest(2)
    real(wp) :: extent
    integer :: c

    extent = maxval([(maxval(surface%points(:, :, c)) - minval(surface%points(:, :, c)), c=1, 3)])
    do c = 1, 2
      associate (knots => surface%axes(c)%knots)
        shortest(c) = collapsed*extent/(knots(size(knots)) - knots(1))
      end associate
    end do
  end function shortest_tangents

  !> Compare the normals on both sides of every knot line.
  subroutine check_edges(source, tolerance, error)
    type(source_t), intent(in) :: source
    real(wp), intent(in) :: tolerance   !! by which an edge may tear its offset [length]
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: degree = acos(-1.0_wp)/180
    real(wp), allocatable :: across(:), along(:)
    real(wp) :: xi(2), position(3, 2), normal(3, 2), turn
    integer :: d, i, j, k
    logical :: is_regular

    do d = 1, 2
      across = samples_along(source%surface, d, 0, knot_inset)
      along = samples_along(source%surface, 3 - d, 2, knot_inset)
      do j = 1, size(along)
        do i = 2, size(across) - 2, 2
          do k = 1, 2
            xi(d) = across(i + k - 1)
            xi(3 - d) = along(j)
            call find_offset_point(source%surface, xi, source%distance, source%shortest, &
                                   position(:, k), normal(:, k), is_regular)
            if (.not. is_regular) then
              call fail(error, "no normal at "//place_text(position(:, k)))
              return
            end if
          end do
          turn = norm2(normal(:, 2) - normal(:, 1))
          if (abs(source%distance)*(turn - no_turn) <= tolerance) cycle
          call fail(error, "an edge of "//rounded_text(2*asin(min(0.5_wp*turn, 1.0_wp))/degree)// &
                    " degrees at "//place_text(position(:, 1) - source%distance*normal(:, 1)))
          return
        end do
      end do
    end do
  end subroutine check_edges

  !> Compare the normals along every edge that is one point.
  subroutine check_tips(source, tolerance, error)
    type(source_t), intent(in) :: source
    real(wp), intent(in) :: tolerance   !! by which a tip may tear its offset [length]
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: along(:)
    real(wp) :: xi(2), position(3), normal(3), first(3), point(3), d1(3, 2)
    integer :: d, i, j
    logical :: is_regular

    do d = 1, 2
      along = samples_along(source%surface, 3 - d, 2, knot_inset)
      do i = 1, 2
        associate (knots => source%surface%axes(d)%knots)
          xi(d) = merge(knots(1), knots(size(knots)), i == 1)
        end associate
        do j = 1, size(along)
          xi(3 - d) = along(j)
          call evaluate_surface(source%surface, xi, point, d1)
          if (norm2(d1(:, 3 - d)) >= source%shortest(3 - d)) exit
          call find_offset_point(source%surface, xi, source%distance, source%shortest, position, &
                                 normal, is_regular)
          if (j == 1) first = normal
          if (is_regular .and. abs(source%distance)*(norm2(normal - first) - no_turn) &
              <= tolerance) cycle
          call fail(error, "a sharp tip at "//place_text(point))
          return
        end do
      end do
    end do
  end subroutine check_tips

  !> Compare the distance with the concave radii, sampled on every face.
  subroutine check_radii(surface, distance, error)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: distance
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: n_inner = 4
    real(wp), allocatable :: xi(:), eta(:)
    real(wp) :: bend, most, point(3), worst_at(3)
    integer :: i, j

    xi = samples_along(surface, 1, n_inner, inside)
    eta = samples_along(surface, 2, n_inner, inside)
    most = -huge(1.0_wp)
    worst_at = 0.0_wp
    do j = 1, size(eta)
      do i = 1, size(xi)
        call find_bend(surface, [xi(i), eta(j)], sign(1.0_wp, distance), point, bend)
        if (bend <= most) cycle
        most = bend
        worst_at = point
      end do
    end do
    if (most*abs(distance) < 1.0_wp - flattest) return
    call fail(error, "at "//place_text(worst_at)//" a radius of "//rounded_text(1.0_wp/most)// &
              " on the side of the offset")
  end subroutine check_radii

  !> Largest curvature towards one side, from the first and second fundamental forms.
  pure subroutine find_bend(surface, xi, side, point, bend)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: xi(2), side          !! +1: towards xi x eta, -1: away from it
    real(wp), intent(out) :: point(3), bend      !! [length], [1/length]
    real(wp) :: d1(3, 2), d2(3, 3), normal(3), first(3), second(3), area, mean, gauss

    call evaluate_surface(surface, xi, point, d1, d2)
    normal = cross(d1(:, 1), d1(:, 2))
    normal = side*normal/max(norm2(normal), tiny(1.0_wp))
    first = [sum(d1(:, 1)**2), sum(d1(:, 2)**2), dot_product(d1(:, 1), d1(:, 2))]
    second = matmul(normal, d2)
    area = max(first(1)*first(2) - first(3)**2, tiny(1.0_wp))
    gauss = (second(1)*second(2) - second(3)**2)/area
    mean = (first(1)*second(2) + first(2)*second(1) - 2*first(3)*second(3))/(2*area)
    bend = mean + sqrt(max(mean**2 - gauss, 0.0_wp))
  end subroutine find_bend

  !> Positions along an axis: `n_inner` in each span, and its ends moved inwards by a part of it.
  pure function samples_along(surface, d, n_inner, inwards) result(positions)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: d, n_inner
    real(wp), intent(in) :: inwards
    real(wp), allocatable :: positions(:)
    real(wp) :: fractions(n_inner + 2)
    integer, allocatable :: spans(:)
    integer :: i, k

    fractions = [inwards, ((k - 0.5_wp)/n_inner, k=1, n_inner), 1.0_wp - inwards]
    allocate (spans, source=span_table(surface%axes(d)))
    allocate (positions(0))
    associate (knots => surface%axes(d)%knots)
      positions = [((knots(spans(i)) + fractions(k)*(knots(spans(i) + 1) - knots(spans(i))), &
                  k=1, n_inner + 2), i=1, size(spans))]
    end associate
  end function samples_along

  !> The surface at `distance` along the normal xi x eta of another, to within a tolerance.
  !! Rejected: sharp edges and tips, concave radii that are not above the distance, and a tolerance
  !! that takes more than 100000 faces.
  subroutine offset_surface(surface, distance, tolerance, offset, report, error)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: distance            !! either sign, not zero [length]
    real(wp), intent(in) :: tolerance           !! [length]
    type(nurbs_surface_t), intent(out) :: offset
    type(offset_report_t), intent(out) :: report
    type(error_t), allocatable, intent(out) :: error
    type(source_t) :: source
    type(nurbs_surface_t) :: space              ! the given surface on the knots of the offset
    real(wp), allocatable :: errors1(:), errors2(:)   ! of each span along xi and eta
    real(wp) :: aim
    integer :: round
    logical :: is_solved

    source = source_t(surface, distance, shortest_tangents(surface))
    call check_edges(source, fraction*tolerance, error)
    if (.not. allocated(error)) call check_tips(source, fraction*tolerance, error)
    if (.not. allocated(error)) call check_radii(surface, distance, error)
    if (allocated(error)) return
    space = surface
    do round = 1, most_rounds
      call interpolate(source, space, offset, is_solved)
      if (.not. is_solved) exit
      call measure(source, offset, report)
      if (report%error <= sure*tolerance) return
      errors1 = errors_along(source, offset, 1)
      errors2 = errors_along(source, offset, 2)
      aim = min(fraction*tolerance, 0.5_wp*max(maxval(errors1), maxval(errors2)))
      if (round == 1) then
        if (any(errors1 > aim)) call loosen(space, 1)
        if (any(errors2 > aim)) call loosen(space, 2)
      else
        call refine(space, 1, errors1, aim)
        call refine(space, 2, errors2, aim)
      end if
      if (n_spans(space%axes(1))*n_spans(space%axes(2)) > most_faces) exit
    end do
    call fail(error, "no offset within "//rounded_text(tolerance)//" of at most "// &
              to_text(most_faces)//" faces: with "//to_text(report%n_faces)//" it is off by "// &
              rounded_text(report%error))
  end subroutine offset_surface

  !> Control points that make the spline of a space the exact offset at all Greville points.
  subroutine interpolate(source, space, offset, is_solved)
    type(source_t), intent(in) :: source
    type(nurbs_surface_t), intent(in) :: space
    type(nurbs_surface_t), intent(out) :: offset
    logical, intent(out) :: is_solved
    real(wp) :: rows(size(space%weights, 1), size(space%weights, 2), 3)
    real(wp) :: columns(size(space%weights, 2), size(space%weights, 1), 3), normal(3)
    real(wp), allocatable :: xi(:), eta(:), weights(:, :)
    integer :: i, j, c, n(2)
    logical :: is_regular

    xi = greville(space%axes(1))
    eta = greville(space%axes(2))
    n = shape(space%weights)
    weights = values_at(space%axes(2), eta, &
                        transpose(values_at(space%axes(1), xi, space%weights)))
    do j = 1, n(2)
      do i = 1, n(1)
        call find_offset_point(source%surface, [xi(i), eta(j)], source%distance, source%shortest, &
                               rows(i, j, :), normal, is_regular)
        rows(i, j, :) = weights(j, i)*rows(i, j, :)
      end do
    end do
    call solve_along(space%axes(1), xi, n(2), rows, is_solved)
    if (.not. is_solved) return
    do c = 1, 3
      columns(:, :, c) = transpose(rows(:, :, c))
    end do
    call solve_along(space%axes(2), eta, n(1), columns, is_solved)
    offset = space
    do c = 1, 3
      offset%points(:, :, c) = transpose(columns(:, :, c))/space%weights
    end do
  end subroutine interpolate

  !> Values of splines at some points, from their coefficients in columns.
  pure function values_at(axis, positions, coefficients) result(values)
    type(knot_vector_t), intent(in) :: axis
    real(wp), intent(in) :: positions(:), coefficients(:, :)
    real(wp) :: values(size(positions), size(coefficients, 2)), basis(axis%degree + 1, 0:0)
    integer :: i, span

    do i = 1, size(positions)
      span = find_span(axis, positions(i))
      call basis_derivatives(axis, span, positions(i), 0, basis)
      values(i, :) = matmul(basis(:, 0), coefficients(span - axis%degree:span, :))
    end do
  end function values_at

  !> Coefficients of splines that take given values at the Greville points.
  subroutine solve_along(axis, positions, n, values, is_solved)
    type(knot_vector_t), intent(in) :: axis
    real(wp), intent(in) :: positions(:)
    integer, intent(in) :: n                            !! splines of each coordinate
    real(wp), intent(inout) :: values(axis%n_basis, 3*n)   !! values, then coefficients
    logical, intent(out) :: is_solved
    real(wp) :: band(2*axis%degree + 1, axis%n_basis), basis(axis%degree + 1, 0:0)
    integer :: i, j, span

    band = 0.0_wp
    do i = 1, size(positions)
      span = find_span(axis, positions(i))
      call basis_derivatives(axis, span, positions(i), 0, basis)
      do j = span - axis%degree, span
        band(axis%degree + 1 + i - j, j) = basis(j - span + axis%degree + 1, 0)
      end do
    end do
    call solve_band(band, axis%degree, values, is_solved)
  end subroutine solve_along

  !> Errors of position and normal on a net over every face.
  subroutine measure(source, offset, report)
    type(source_t), intent(in) :: source
    type(nurbs_surface_t), intent(in) :: offset
    type(offset_report_t), intent(out) :: report
    real(wp), parameter :: degree = acos(-1.0_wp)/180
    real(wp), allocatable :: xi(:), eta(:)
    real(wp) :: off, turn
    integer :: i, j

    xi = samples_along(offset, 1, n_inner, end_inset)
    eta = samples_along(offset, 2, n_inner, end_inset)
    do j = 1, size(eta)
      do i = 1, size(xi)
        call compare(source, offset, [xi(i), eta(j)], off, turn)
        report%error = max(report%error, off)
        report%angle = max(report%angle, turn/degree)
      end do
    end do
    report%n_places = size(xi)*size(eta)
    report%n_faces = n_spans(offset%axes(1))*n_spans(offset%axes(2))
  end subroutine measure

  !> Largest error in each span along an axis, on the lines where the offset is exact across it.
  function errors_along(source, offset, d) result(errors)
    type(source_t), intent(in) :: source
    type(nurbs_surface_t), intent(in) :: offset
    integer, intent(in) :: d
    real(wp), allocatable :: errors(:)
    real(wp), allocatable :: along(:), lines(:)
    real(wp) :: xi(2), off, turn
    integer :: i, j, span

    along = samples_along(offset, d, n_inner, end_inset)
    lines = greville(offset%axes(3 - d))
    allocate (errors(n_spans(offset%axes(d))), source=0.0_wp)
    do j = 1, size(lines)
      do i = 1, size(along)
        span = (i - 1)/(n_inner + 2) + 1
        xi(d) = along(i)
        xi(3 - d) = lines(j)
        call compare(source, offset, xi, off, turn)
        errors(span) = max(errors(span), off)
      end do
    end do
  end function errors_along

  !> Distance from the exact offset at one point, and angle between the two normals.
  pure subroutine compare(source, offset, xi, off, turn)
    type(source_t), intent(in) :: source
    type(nurbs_surface_t), intent(in) :: offset
    real(wp), intent(in) :: xi(2)
    real(wp), intent(out) :: off, turn          !! [length], [radians]
    real(wp) :: exact(3), normal(3), position(3), other(3)
    logical :: is_regular

    call find_offset_point(source%surface, xi, source%distance, source%shortest, exact, normal, &
                           is_regular)
    call find_offset_point(offset, xi, 0.0_wp, source%shortest, position, other, is_regular)
    off = norm2(position - exact)
    turn = 2*asin(min(0.5_wp*norm2(other - normal), 1.0_wp))
  end subroutine compare

  !> Take away one order of smoothness at every knot, as an offset does. Lines become parabolas.
  subroutine loosen(space, d)
    type(nurbs_surface_t), intent(inout) :: space
    integer, intent(in) :: d
    type(error_t), allocatable :: error    ! stays empty: no knot comes to be repeated too often
    integer :: i, n

    if (space%axes(d)%degree == 1) then
      call elevate_degree(space, d, 1, error)
      return
    end if
    associate (knots => space%axes(d)%knots)
      n = size(knots)
      call insert_knots(space, d, pack(knots(2:n - 1), [(is_to_be_doubled(i), i=2, n - 1)]), error)
    end associate

  contains

    !> The first of equal inner knots, if there are fewer than the degree of them.
    pure logical function is_to_be_doubled(i)
      integer, intent(in) :: i

      associate (knots => space%axes(d)%knots)
        is_to_be_doubled = knots(i) > knots(i - 1) .and. knots(i) < knots(n) .and. &
                           count(abs(knots - knots(i)) <= 0.0_wp) < space%axes(d)%degree
      end associate
    end function is_to_be_doubled

  end subroutine loosen

  !> Cut the spans whose error is above `aim` into as many parts as should bring it down to that.
  subroutine refine(space, d, errors, aim)
    type(nurbs_surface_t), intent(inout) :: space
    integer, intent(in) :: d
    real(wp), intent(in) :: errors(:)      !! of each span
    real(wp), intent(in) :: aim
    type(error_t), allocatable :: error    ! stays empty: the knots are new and inside
    real(wp), allocatable :: cuts(:)
    integer, allocatable :: spans(:)
    integer :: i, k, n

    spans = span_table(space%axes(d))
    allocate (cuts(0))
    do i = 1, size(spans)
      if (errors(i) <= aim) cycle
      n = min(ceiling((errors(i)/aim)**(1.0_wp/(space%axes(d)%degree + 1))), most_parts)
      associate (low => space%axes(d)%knots(spans(i)), high => space%axes(d)%knots(spans(i) + 1))
        cuts = [cuts, (low + (high - low)*k/n, k=1, n - 1)]
      end associate
    end do
    call insert_knots(space, d, cuts, error)
  end subroutine refine

end module surface_offset
