!> Row-sum lumped mass of a solid patch, by full quadrature on its shape at the start.
module lumped_mass
  use kinds, only: wp
  use nurbs_solid, only: nurbs_solid_t
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use basis_tables, only: axis_table_t, new_axis_table
  implicit none
  private

  public :: new_lumped_mass, mass_tables, add_element

contains

  !> Mass of every control point: integral of density times its rational basis function.
  !! All are positive. The rule is exact without weights, and within round-off of it with the
  !! weights of an arc of up to 90 degrees an element.
  pure function new_lumped_mass(solid, density) result(mass)
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), intent(in) :: density
    real(wp), allocatable :: mass(:, :, :)
    type(axis_table_t) :: axes(3)
    integer :: e1, e2, e3

    axes = mass_tables(solid)
    allocate (mass(axes(1)%n_basis, axes(2)%n_basis, axes(3)%n_basis), source=0.0_wp)
    do e3 = 1, axes(3)%n_elements
      do e2 = 1, axes(2)%n_elements
        do e1 = 1, axes(1)%n_elements
          call add_element(solid, axes, [e1, e2, e3], density, mass)
        end do
      end do
    end do
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

  !> Add the mass of one element to its control points.
  pure subroutine add_element(solid, axes, e, density, mass)
    type(nurbs_solid_t), intent(in) :: solid
    type(axis_table_t), intent(in) :: axes(3)
    integer, intent(in) :: e(3)
    real(wp), intent(in) :: density
    real(wp), intent(inout) :: mass(:, :, :)
    real(wp) :: basis(axes(1)%degree + 1, axes(2)%degree + 1, axes(3)%degree + 1), volume
    integer :: q1, q2, q3, low(3), high(3)

    low = [axes(1)%first(e(1)), axes(2)%first(e(2)), axes(3)%first(e(3))]
    high = low + axes%degree
    associate (w => solid%weights(low(1):high(1), low(2):high(2), low(3):high(3)), &
               x => solid%points(low(1):high(1), low(2):high(2), low(3):high(3), :))
      do q3 = 1, axes(3)%n_points
        do q2 = 1, axes(2)%n_points
          do q1 = 1, axes(1)%n_points
            call point_volume(axes, e, [q1, q2, q3], w, x, basis, volume)
            mass(low(1):high(1), low(2):high(2), low(3):high(3)) = &
              mass(low(1):high(1), low(2):high(2), low(3):high(3)) + density*volume*basis
          end do
        end do
      end do
    end associate
  end subroutine add_element

  !> Rational basis at one quadrature point, and its share of the volume.
  pure subroutine point_volume(axes, e, q, w, x, basis, volume)
    type(axis_table_t), intent(in) :: axes(3)
    integer, intent(in) :: e(3), q(3)
    real(wp), intent(in) :: w(:, :, :), x(:, :, :, :)
    real(wp), intent(out) :: basis(:, :, :), volume
    real(wp), dimension(size(w, 1), size(w, 2), size(w, 3)) :: slope
    real(wp) :: total, j(3, 3), slope_sum
    integer :: axis, c

    basis = w*tensor(axes, e, q, 0)
    total = sum(basis)
    basis = basis/total
    do axis = 1, 3
      slope = w*tensor(axes, e, q, axis)
      slope_sum = sum(slope)
      slope = (slope - basis*slope_sum)/total
      do c = 1, 3
        j(c, axis) = sum(slope*x(:, :, :, c))
      end do
    end do
    volume = j(1, 1)*(j(2, 2)*j(3, 3) - j(2, 3)*j(3, 2)) &
             + j(1, 2)*(j(2, 3)*j(3, 1) - j(2, 1)*j(3, 3)) &
             + j(1, 3)*(j(2, 1)*j(3, 2) - j(2, 2)*j(3, 1))
    volume = volume*axes(1)%weights(q(1))*axes(2)%weights(q(2))*axes(3)%weights(q(3))
  end subroutine point_volume

  !> Product of the one-dimensional bases, with the slope along `axis` (0: values alone).
  pure function tensor(axes, e, q, axis) result(product3)
    type(axis_table_t), intent(in) :: axes(3)
    integer, intent(in) :: e(3), q(3), axis
    real(wp) :: product3(axes(1)%degree + 1, axes(2)%degree + 1, axes(3)%degree + 1)
    real(wp) :: line1(axes(1)%degree + 1), line2(axes(2)%degree + 1), line3(axes(3)%degree + 1)
    integer :: j, k

    line1 = axes(1)%values(:, q(1), e(1))
    line2 = axes(2)%values(:, q(2), e(2))
    line3 = axes(3)%values(:, q(3), e(3))
    if (axis == 1) line1 = axes(1)%slopes(:, q(1), e(1))
    if (axis == 2) line2 = axes(2)%slopes(:, q(2), e(2))
    if (axis == 3) line3 = axes(3)%slopes(:, q(3), e(3))
    do k = 1, size(line3)
      do j = 1, size(line2)
        product3(:, j, k) = line1*(line2(j)*line3(k))
      end do
    end do
  end function tensor

end module lumped_mass
