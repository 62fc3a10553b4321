!> Places at a distance from a surface along its normal, and where a surface has none: where it
!! turns more sharply than the distance, or has an edge.
module offset_place
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: rounded_text, place_text
  use vector_product, only: cross
  use knot_vector, only: span_table
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  implicit none
  private

  public :: find_offset_place, check_offset, places_along, shortest_tangents

  real(wp), parameter :: collapsed = 1.0e-9_wp   !! tangent, part of the mean one of its direction
  real(wp), parameter :: thinnest = 1.0e-10_wp   !! sine of the angle between the tangents
  real(wp), parameter :: beside = 1.0e-9_wp      !! part of a span that a knot is avoided by
  real(wp), parameter :: no_turn = 1.0e-6_wp     !! angle that the two sides of a knot may differ by
  real(wp), parameter :: inside = 1.0e-4_wp      !! the same, where curvature is measured
  real(wp), parameter :: flattest = 1.0e-3_wp    !! least stretch of the surface by the offset

contains

  !> Place at `distance` along the normal xi x eta. At an edge that is one point, such as the pole
  !! of a sphere, the normal is the one that its neighbourhood tends to.
  pure subroutine find_offset_place(surface, xi, distance, shortest, place, normal, is_regular)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: xi(2)
    real(wp), intent(in) :: distance              !! either sign [length]
    real(wp), intent(in) :: shortest(2)           !! from `shortest_tangents`
    real(wp), intent(out) :: place(3), normal(3)
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
    place = point + distance*normal
  end subroutine find_offset_place

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

  !> Refuse a surface that has no offset: with a concave radius that is not above the distance, an
  !! edge or a tip sharp enough to tear its offset by more than the tolerance, or no normal.
  subroutine check_offset(surface, distance, tolerance, error)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: distance, tolerance   !! [length]
    type(error_t), allocatable, intent(out) :: error

    call check_edges(surface, distance, tolerance, error)
    if (.not. allocated(error)) call check_tips(surface, distance, tolerance, error)
    if (.not. allocated(error)) call check_radii(surface, distance, error)
  end subroutine check_offset

  !> Compare the normals on both sides of every knot line.
  subroutine check_edges(surface, distance, tolerance, error)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: distance, tolerance
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: degree = acos(-1.0_wp)/180
    real(wp), allocatable :: across(:), along(:)
    real(wp) :: xi(2), place(3, 2), normal(3, 2), shortest(2), turn
    integer :: d, i, j, k
    logical :: is_regular

    shortest = shortest_tangents(surface)
    do d = 1, 2
      across = places_along(surface, d, 0, beside)
      along = places_along(surface, 3 - d, 2, beside)
      do j = 1, size(along)
        do i = 2, size(across) - 2, 2
          do k = 1, 2
            xi(d) = across(i + k - 1)
            xi(3 - d) = along(j)
            call find_offset_place(surface, xi, distance, shortest, place(:, k), normal(:, k), &
                                   is_regular)
            if (.not. is_regular) then
              call fail(error, "no normal at "//place_text(place(:, k)))
              return
            end if
          end do
          turn = norm2(normal(:, 2) - normal(:, 1))
          if (abs(distance)*(turn - no_turn) <= tolerance) cycle
          call fail(error, "an edge of "//rounded_text(2*asin(min(0.5_wp*turn, 1.0_wp))/degree)// &
                    " degrees at "//place_text(place(:, 1) - distance*normal(:, 1)))
          return
        end do
      end do
    end do
  end subroutine check_edges

  !> Compare the normals along every border that is one point.
  subroutine check_tips(surface, distance, tolerance, error)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: distance, tolerance
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: along(:)
    real(wp) :: xi(2), place(3), normal(3), first(3), point(3), d1(3, 2), shortest(2)
    integer :: d, i, j
    logical :: is_regular

    shortest = shortest_tangents(surface)
    do d = 1, 2
      along = places_along(surface, 3 - d, 2, beside)
      do i = 1, 2
        associate (knots => surface%axes(d)%knots)
          xi(d) = merge(knots(1), knots(size(knots)), i == 1)
        end associate
        do j = 1, size(along)
          xi(3 - d) = along(j)
          call evaluate_surface(surface, xi, point, d1)
          if (norm2(d1(:, 3 - d)) >= shortest(3 - d)) exit
          call find_offset_place(surface, xi, distance, shortest, place, normal, is_regular)
          if (j == 1) first = normal
          if (is_regular .and. abs(distance)*(norm2(normal - first) - no_turn) <= tolerance) cycle
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

    xi = places_along(surface, 1, n_inner, inside)
    eta = places_along(surface, 2, n_inner, inside)
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

  !> Places along an axis: `n_inner` in each span, and its ends moved inwards by a part of it.
  pure function places_along(surface, d, n_inner, inwards) result(places)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: d, n_inner
    real(wp), intent(in) :: inwards
    real(wp), allocatable :: places(:)
    real(wp) :: shares(n_inner + 2)
    integer, allocatable :: spans(:)
    integer :: i, k

    shares = [inwards, ((k - 0.5_wp)/n_inner, k=1, n_inner), 1.0_wp - inwards]
    allocate (spans, source=span_table(surface%axes(d)))
    allocate (places(0))
    associate (knots => surface%axes(d)%knots)
      places = [((knots(spans(i)) + shares(k)*(knots(spans(i) + 1) - knots(spans(i))), &
                  k=1, n_inner + 2), i=1, size(spans))]
    end associate
  end function places_along

end module offset_place
