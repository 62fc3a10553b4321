!> Row-sum lumped mass of a solid patch, by full quadrature on its shape at the start.
module lumped_mass
  use kinds, only: wp
  use nurbs_solid, only: nurbs_solid_t
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use basis_tables, only: axis_table_t, new_axis_table
  use patch_points, only: determinant
  implicit none
  private

  public :: new_lumped_mass, mass_tables, add_masses

contains

  !> Mass of every control point: integral of density times its rational basis function.
  !! All are positive. The rule is exact without weights, and within round-off of it with the
  !! weights of an arc of up to 90 degrees an element.
  pure function new_lumped_mass(solid, density) result(mass)
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), intent(in) :: density
    real(wp), allocatable :: mass(:, :, :)
    type(axis_table_t) :: axes(3)

    axes = mass_tables(solid)
    allocate (mass(axes(1)%n_basis, axes(2)%n_basis, axes(3)%n_basis), source=0.0_wp)
    call add_masses(solid, axes, [1, 1, 1], axes%n_elements, density, mass)
  end function new_lumped_mass

  !> Basis tables of the rule that the mass is integrated with.
  pure function mass_tables(solid) result(axes)
    type(nurbs_solid_t), intent(in) :: solid
    type(axis_table_t) :: axes(3)
    type(gauss_rule_t) :: rule
    integer :: axis, n_points
    logical :: is_rational

    is_rational = maxval(solid%weights) > minval(solid%weights)
    do axis = 1, 3
      ! Basis and jacobian together have degree 4p - 1; a quotient needs some points more.
      n_points = 2*solid%axes(axis)%degree
      if (is_rational) n_points = n_points + 8
      rule = new_gauss_rule(n_points, 1)
      axes(axis) = new_axis_table(solid%axes(axis), rule%points, rule%weights)
    end do
  end function mass_tables

  !> Add the mass of a box of elements to its control points. Shape and masses are summed along one
  !! axis after the other, from the last to the first and back: for all points of a plane the sums
  !! along axis 3 are those of a single one.
  pure subroutine add_masses(solid, axes, first, last, density, mass)
    type(nurbs_solid_t), intent(in) :: solid
    type(axis_table_t), intent(in) :: axes(3)        !! see `mass_tables`
    integer, intent(in) :: first(3), last(3)         !! elements
    real(wp), intent(in) :: density
    real(wp), intent(inout) :: mass(:, :, :)
    real(wp), allocatable :: planes(:, :, :, :), shares(:, :)
    integer :: low(3), high(3), a, e, q, i, k

    low = [(axes(a)%first(first(a)), a=1, 3)]
    high = [(axes(a)%first(last(a)) + axes(a)%degree, a=1, 3)]
    allocate (planes(4, low(1):high(1), low(2):high(2), 0:1))
    allocate (shares(low(1):high(1), low(2):high(2)))
    do e = first(3), last(3)
      do q = 1, axes(3)%n_points
        planes = 0.0_wp
        do i = 1, axes(3)%degree + 1
          k = axes(3)%first(e) + i - 1
          call add_layer(axes(3)%values(i, q, e), axes(3)%slopes(i, q, e), &
                         high(:2) - low(:2) + 1, solid%weights(low(1):high(1), low(2):high(2), k), &
                         solid%points(low(1):high(1), low(2):high(2), k, :), planes)
        end do
        shares = 0.0_wp
        call add_plane(axes, low, high, first, last, planes, shares)
        do i = 1, axes(3)%degree + 1
          k = axes(3)%first(e) + i - 1
          mass(low(1):high(1), low(2):high(2), k) = mass(low(1):high(1), low(2):high(2), k) &
            + density*axes(3)%weights(q)*axes(3)%values(i, q, e) &
            *solid%weights(low(1):high(1), low(2):high(2), k)*shares
        end do
      end do
    end do
  end subroutine add_masses

  !> Add a layer of control points to the sums along axis 3.
  pure subroutine add_layer(value, slope, n, w, x, planes)
    real(wp), intent(in) :: value, slope                   !! basis of the layer
    integer, intent(in) :: n(2)
    real(wp), intent(in) :: w(n(1), n(2)), x(n(1), n(2), 3)
    real(wp), intent(inout) :: planes(4, n(1), n(2), 0:1)  !! weighted places, weight; slopes
    real(wp) :: h(4)
    integer :: i1, i2

    do i2 = 1, n(2)
      do i1 = 1, n(1)
        h = w(i1, i2)*[x(i1, i2, :), 1.0_wp]
        planes(:, i1, i2, 0) = planes(:, i1, i2, 0) + value*h
        planes(:, i1, i2, 1) = planes(:, i1, i2, 1) + slope*h
      end do
    end do
  end subroutine add_layer

  !> Add what the points of a plane bring, of unit weight and density, to the columns of control
  !! points.
  pure subroutine add_plane(axes, low, high, first, last, planes, shares)
    type(axis_table_t), intent(in) :: axes(3)
    integer, intent(in) :: low(3), high(3), first(3), last(3)
    real(wp), intent(in) :: planes(4, low(1):high(1), low(2):high(2), 0:1)
    real(wp), intent(inout) :: shares(low(1):high(1), low(2):high(2))
    real(wp) :: lines(4, low(1):high(1), 3), share(low(1):high(1))
    integer :: e, q, i, k

    do e = first(2), last(2)
      do q = 1, axes(2)%n_points
        lines = 0.0_wp
        do i = 1, axes(2)%degree + 1
          k = axes(2)%first(e) + i - 1
          lines(:, :, 1) = lines(:, :, 1) + axes(2)%values(i, q, e)*planes(:, :, k, 0)
          lines(:, :, 2) = lines(:, :, 2) + axes(2)%slopes(i, q, e)*planes(:, :, k, 0)
          lines(:, :, 3) = lines(:, :, 3) + axes(2)%values(i, q, e)*planes(:, :, k, 1)
        end do
        share = 0.0_wp
        call add_line(axes(1), low(1), high(1), first(1), last(1), lines, share)
        do i = 1, axes(2)%degree + 1
          k = axes(2)%first(e) + i - 1
          shares(:, k) = shares(:, k) + axes(2)%weights(q)*axes(2)%values(i, q, e)*share
        end do
      end do
    end do
  end subroutine add_plane

  !> Add what the points of a line bring to its control points.
  pure subroutine add_line(axis, low, high, first, last, lines, share)
    type(axis_table_t), intent(in) :: axis
    integer, intent(in) :: low, high, first, last
    real(wp), intent(in) :: lines(4, low:high, 3)   !! sums, their slopes along axes 2 and 3
    real(wp), intent(inout) :: share(low:high)
    real(wp) :: h(4, 0:3), ratio
    integer :: e, q, i, k

    do e = first, last
      do q = 1, axis%n_points
        h = 0.0_wp
        do i = 1, axis%degree + 1
          k = axis%first(e) + i - 1
          h(:, 0) = h(:, 0) + axis%values(i, q, e)*lines(:, k, 1)
          h(:, 1) = h(:, 1) + axis%slopes(i, q, e)*lines(:, k, 1)
          h(:, 2) = h(:, 2) + axis%values(i, q, e)*lines(:, k, 2)
          h(:, 3) = h(:, 3) + axis%values(i, q, e)*lines(:, k, 3)
        end do
        ratio = axis%weights(q)*stretch(h)/h(4, 0)
        do i = 1, axis%degree + 1
          k = axis%first(e) + i - 1
          share(k) = share(k) + ratio*axis%values(i, q, e)
        end do
      end do
    end do
  end subroutine add_line

  !> Volume in place of a unit of parameters, from places times weights, weights, and their slopes.
  pure real(wp) function stretch(h)
    real(wp), intent(in) :: h(4, 0:3)
    real(wp) :: j(3, 3)
    integer :: axis

    do axis = 1, 3
      j(:, axis) = (h(:3, axis) - h(:3, 0)*(h(4, axis)/h(4, 0)))/h(4, 0)
    end do
    stretch = determinant(j)
  end function stretch

end module lumped_mass
