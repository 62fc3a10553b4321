!> Contact territory: the space around a face from which a point can touch it.
!!
!! The second filter of the global search, [CA] R. P. R. Cardoso and O. B. Adetoro (2017),
!! eqs. (46)-(47): a hexahedron whose six faces a point must lie inside of. Here it encloses the
!! Bezier control points of the face, and with them the whole face (convex hull), whereas the four
!! corner points of a curved face would not.
module contact_territory
  use kinds, only: wp
  implicit none
  private

  public :: contact_territory_t, new_territory, is_in_territory, distance_bound, relative_position

  !> Box along the directions of a face, enclosing the face; its reach is given at each test.
  type :: contact_territory_t
    real(wp) :: centre(3) = 0.0_wp    !! a point of the face's hull [length]
    real(wp) :: axes(3, 3) = 0.0_wp   !! unit directions, one a column; the third is the normal
    real(wp) :: low(3) = 0.0_wp       !! extent of the hull along each axis from the centre [length]
    real(wp) :: high(3) = 0.0_wp
  end type contact_territory_t

contains

  !> Territory around the Bezier control points of a face.
  pure subroutine new_territory(territory, hull)
    type(contact_territory_t), intent(out) :: territory
    real(wp), intent(in) :: hull(:, :, :)   !! control points [length], shape (n1, n2, 3)
    real(wp) :: along_1(3), along_2(3)
    real(wp) :: offset(size(hull, 1), size(hull, 2), 3), reach(size(hull, 1), size(hull, 2))
    integer :: n1, n2, i

    n1 = size(hull, 1)
    n2 = size(hull, 2)
    along_1 = hull(n1, 1, :) - hull(1, 1, :) + hull(n1, n2, :) - hull(1, n2, :)
    along_2 = hull(1, n2, :) - hull(1, 1, :) + hull(n1, n2, :) - hull(n1, 1, :)
    territory%axes = frame(along_1, along_2)
    territory%centre = 0.25_wp*(hull(1, 1, :) + hull(n1, 1, :) + hull(1, n2, :) + hull(n1, n2, :))
    do i = 1, 3
      offset(:, :, i) = hull(:, :, i) - territory%centre(i)
    end do
    do i = 1, 3
      reach = offset(:, :, 1)*territory%axes(1, i) + offset(:, :, 2)*territory%axes(2, i) &
              + offset(:, :, 3)*territory%axes(3, i)
      territory%low(i) = minval(reach)
      territory%high(i) = maxval(reach)
    end do
  end subroutine new_territory

  !> Whether `x` lies inside all six faces of the territory moved outward by `distance`. True for
  !! every point whose closest point on the face is within `distance`.
  pure logical function is_in_territory(territory, x, distance)
    type(contact_territory_t), intent(in) :: territory
    real(wp), intent(in) :: x(3)       !! [length]
    real(wp), intent(in) :: distance   !! [length]
    real(wp) :: along(3)

    along = matmul(x - territory%centre, territory%axes)
    is_in_territory = all(along >= territory%low - distance) &
                      .and. all(along <= territory%high + distance)
  end function is_in_territory

  !> Distance from `x` to the box around the face: never more than the distance to the face.
  pure real(wp) function distance_bound(territory, x)
    type(contact_territory_t), intent(in) :: territory
    real(wp), intent(in) :: x(3)   !! [length]
    real(wp) :: along(3)

    along = matmul(x - territory%centre, territory%axes)
    distance_bound = norm2(max(territory%low - along, along - territory%high, 0.0_wp))
  end function distance_bound

  !> Where `x` lies between low and high along the first two axes, 0 to 1 inside the box.
  pure function relative_position(territory, x) result(position)
    type(contact_territory_t), intent(in) :: territory
    real(wp), intent(in) :: x(3)   !! [length]
    real(wp) :: position(2), along(3)

    along = matmul(x - territory%centre, territory%axes)
    position = (along(:2) - territory%low(:2)) &
            /max(territory%high(:2) - territory%low(:2), tiny(1.0_wp))
  end function relative_position

  !> Orthonormal directions from two that span the face; any that fit where these degenerate.
  pure function frame(along_1, along_2) result(axes)
    real(wp), intent(in) :: along_1(3), along_2(3)
    real(wp) :: axes(3, 3)
    real(wp), parameter :: small = 1.0e-10_wp
    real(wp) :: largest, second(3), unit(3)

    largest = max(norm2(along_1), norm2(along_2))
    axes(:, 1) = [1.0_wp, 0.0_wp, 0.0_wp]
    if (norm2(along_1) > small*largest) axes(:, 1) = along_1/norm2(along_1)
    second = along_2 - dot_product(along_2, axes(:, 1))*axes(:, 1)
    if (norm2(second) <= small*largest) then
      unit = 0.0_wp
      unit(minloc(abs(axes(:, 1)))) = 1.0_wp
      second = unit - dot_product(unit, axes(:, 1))*axes(:, 1)
    end if
    axes(:, 2) = second/norm2(second)
    axes(1, 3) = axes(2, 1)*axes(3, 2) - axes(3, 1)*axes(2, 2)
    axes(2, 3) = axes(3, 1)*axes(1, 2) - axes(1, 1)*axes(3, 2)
    axes(3, 3) = axes(1, 1)*axes(2, 2) - axes(2, 1)*axes(1, 2)
  end function frame

end module contact_territory
