!> Integration of loads over a face of the blank, or over the part of it that a set names.
module face_quadrature
  use kinds, only: wp
  use knot_vector, only: span_table
  use nurbs_surface, only: nurbs_surface_t
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use basis_tables, only: axis_table_t, new_axis_table
  implicit none
  private

  public :: face_rule_t, new_face_rule, add_face_forces

  !> Basis tables of a face and the elements that count.
  type :: face_rule_t
    type(axis_table_t) :: axes(2)
    real(wp), allocatable :: weights(:, :)        !! NURBS weights
    logical, allocatable :: is_loaded(:, :)       !! elements, shape (n_elements1, n_elements2)
    real(wp) :: outward = 1.0_wp                  !! sign that turns xi x eta outward
  end type face_rule_t

contains

  !> Gauss rule on the elements whose middle lies in the parametric range of a set. Pressure is
  !! integrated exactly, with weights to 1e-8 on arcs of up to 90 degrees an element.
  pure function new_face_rule(face, lower, upper, side) result(rule)
    type(nurbs_surface_t), intent(in) :: face
    real(wp), intent(in) :: lower(2), upper(2)
    integer, intent(in) :: side                   !! +1 where xi x eta points outward, else -1
    type(face_rule_t) :: rule
    type(gauss_rule_t) :: gauss
    integer :: axis, e1, e2, n_more
    logical, allocatable :: is_in(:)

    n_more = merge(4, 0, maxval(face%weights) > minval(face%weights))
    do axis = 1, 2
      ! A basis function times two tangents has degree 3p - 1.
      gauss = new_gauss_rule((3*face%axes(axis)%degree + 1)/2 + n_more, 1)
      rule%axes(axis) = new_axis_table(face%axes(axis), gauss%points, gauss%weights)
    end do
    rule%weights = face%weights
    rule%outward = real(side, wp)
    allocate (rule%is_loaded(rule%axes(1)%n_elements, rule%axes(2)%n_elements))
    is_in = middle_in(face, 1, lower(1), upper(1))
    do e2 = 1, rule%axes(2)%n_elements
      rule%is_loaded(:, e2) = is_in
    end do
    is_in = middle_in(face, 2, lower(2), upper(2))
    do e1 = 1, rule%axes(1)%n_elements
      rule%is_loaded(e1, :) = rule%is_loaded(e1, :) .and. is_in
    end do
  end function new_face_rule

  pure function middle_in(face, axis, lower, upper) result(is_in)
    type(nurbs_surface_t), intent(in) :: face
    integer, intent(in) :: axis
    real(wp), intent(in) :: lower, upper
    logical, allocatable :: is_in(:)

    associate (spans => span_table(face%axes(axis)), knots => face%axes(axis)%knots)
      allocate (is_in(size(spans)))
      is_in = knots(spans) + knots(spans + 1) >= 2.0_wp*lower &
              .and. knots(spans) + knots(spans + 1) <= 2.0_wp*upper
    end associate
  end function middle_in

  !> Add the control-point forces of a traction per area and of a pressure against the outward
  !! normal, both on the shape that `net` gives.
  pure subroutine add_face_forces(rule, n, net, traction, pressure, forces)
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: n(2)                   !! control points of the face
    real(wp), intent(in) :: net(n(1), n(2), 3)    !! their places
    real(wp), intent(in) :: traction(3), pressure
    real(wp), intent(inout) :: forces(n(1), n(2), 3)
    real(wp) :: basis(rule%axes(1)%degree + 1, rule%axes(2)%degree + 1), normal(3), point_force(3)
    integer :: e1, e2, q1, q2, low(2), high(2), c

    do e2 = 1, rule%axes(2)%n_elements
      do e1 = 1, rule%axes(1)%n_elements
        if (.not. rule%is_loaded(e1, e2)) cycle
        low = [rule%axes(1)%first(e1), rule%axes(2)%first(e2)]
        high = low + rule%axes%degree
        do q2 = 1, rule%axes(2)%n_points
          do q1 = 1, rule%axes(1)%n_points
            call face_point(rule, [e1, e2], [q1, q2], &
                            rule%weights(low(1):high(1), low(2):high(2)), &
                            net(low(1):high(1), low(2):high(2), :), basis, normal)
            point_force = (norm2(normal)*traction - rule%outward*pressure*normal) &
                          *rule%axes(1)%weights(q1)*rule%axes(2)%weights(q2)
            do c = 1, 3
              forces(low(1):high(1), low(2):high(2), c) = &
                forces(low(1):high(1), low(2):high(2), c) + basis*point_force(c)
            end do
          end do
        end do
      end do
    end do
  end subroutine add_face_forces

  !> Rational basis at one point of a face and its area vector xi x eta.
  pure subroutine face_point(rule, e, q, w, net, basis, normal)
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: e(2), q(2)
    real(wp), intent(in) :: w(:, :), net(:, :, :)
    real(wp), intent(out) :: basis(:, :), normal(3)
    real(wp) :: slope1(size(w, 1), size(w, 2)), slope2(size(w, 1), size(w, 2)), total
    real(wp) :: t1(3), t2(3)
    integer :: j, c

    associate (n1 => rule%axes(1)%values(:, q(1), e(1)), d1 => rule%axes(1)%slopes(:, q(1), e(1)), &
               n2 => rule%axes(2)%values(:, q(2), e(2)), d2 => rule%axes(2)%slopes(:, q(2), e(2)))
      do j = 1, size(w, 2)
        basis(:, j) = w(:, j)*n1*n2(j)
        slope1(:, j) = w(:, j)*d1*n2(j)
        slope2(:, j) = w(:, j)*n1*d2(j)
      end do
    end associate
    total = sum(basis)
    basis = basis/total
    slope1 = (slope1 - basis*sum(slope1))/total
    slope2 = (slope2 - basis*sum(slope2))/total
    do c = 1, 3
      t1(c) = sum(slope1*net(:, :, c))
      t2(c) = sum(slope2*net(:, :, c))
    end do
    normal = [t1(2)*t2(3) - t1(3)*t2(2), t1(3)*t2(1) - t1(1)*t2(3), t1(1)*t2(2) - t1(2)*t2(1)]
  end subroutine face_point

end module face_quadrature
