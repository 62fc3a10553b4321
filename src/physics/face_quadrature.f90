!> Integration of loads over a face of the blank, or over the part of it that a set names.
module face_quadrature
  use kinds, only: wp
  use knot_vector, only: knot_vector_t, span_table
  use nurbs_surface, only: nurbs_surface_t
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use basis_tables, only: axis_table_t, lane_table_t, new_axis_table, new_lane_table, n_lanes
  use block_gather, only: gather_block, weigh_block, add_block
  implicit none
  private

  public :: middle_in, face_rule_t, new_face_rule, add_face_forces

  integer, parameter :: parallel_size = 200    !! fewer elements are not worth waking threads for

  !> Basis tables of a face and the elements that count.
  type :: face_rule_t
    type(axis_table_t) :: axes(2)
    type(lane_table_t) :: lanes                   !! of direction 1, eight elements side by side
    real(wp), allocatable :: weights(:, :)        !! NURBS weights
    !> 1/W and dW/W (2) at the points, (8, 3, n_points1, n_points2, n_blocks, n_elements2); only
    !! where the weights differ.
    real(wp), allocatable :: rational(:, :, :, :, :, :)
    logical, allocatable :: is_loaded(:, :)       !! elements, shape (n_elements1, n_elements2)
    !> The part of each that lies inside an outline, over which it takes its load as a whole;
    !! absent: all of it.
    real(wp), allocatable :: share(:, :)
    real(wp) :: outward = 1.0_wp                  !! sign that turns xi x eta outward
  end type face_rule_t

contains

  !> Gauss rule on the elements whose middle lies in the parametric range of a set. Pressure is
  !! integrated exactly, with weights to 1e-8 on arcs of up to 90 degrees an element. One point does
  !! across a strip: with more, each side would be pushed by where it is itself, and lose the other.
  pure function new_face_rule(face, lower, upper, side, across) result(rule)
    type(nurbs_surface_t), intent(in) :: face
    real(wp), intent(in) :: lower(2), upper(2)
    integer, intent(in) :: side                   !! +1 where xi x eta points outward, else -1
    integer, intent(in), optional :: across       !! direction across a strip, 0: the face has none
    type(face_rule_t) :: rule
    type(gauss_rule_t) :: gauss
    integer :: axis, n_more, n_points(2)

    n_more = merge(4, 0, maxval(face%weights) > minval(face%weights))
    ! A basis function times two tangents has degree 3p - 1.
    n_points = (3*face%axes%degree + 1)/2 + n_more
    if (present(across)) n_points = merge(1, n_points, [1, 2] == across)
    do axis = 1, 2
      gauss = new_gauss_rule(n_points(axis), 1)
      rule%axes(axis) = new_axis_table(face%axes(axis), gauss%points, gauss%weights)
    end do
    rule%lanes = new_lane_table(rule%axes(1))
    rule%weights = face%weights
    if (n_more > 0) call set_rational(rule)
    rule%outward = real(side, wp)
    rule%is_loaded = spread(middle_in(face%axes(1), lower(1), upper(1)), 2, &
                            rule%axes(2)%n_elements) &
                     .and. spread(middle_in(face%axes(2), lower(2), upper(2)), 1, &
                                  rule%axes(1)%n_elements)
  end function new_face_rule

  !> Elements whose middle is in a range.
  pure function middle_in(axis, lower, upper) result(is_in)
    type(knot_vector_t), intent(in) :: axis
    real(wp), intent(in) :: lower, upper
    logical, allocatable :: is_in(:)

    associate (spans => span_table(axis))
      associate (twice => axis%knots(spans) + axis%knots(spans + 1))
        is_in = twice >= 2.0_wp*lower .and. twice <= 2.0_wp*upper
      end associate
    end associate
  end function middle_in

  !> Tables of the weight function at the points of a rational face.
  pure subroutine set_rational(rule)
    type(face_rule_t), intent(inout) :: rule
    integer :: e1, e2, q1, q2, lane, b, low(2), high(2)
    real(wp) :: total

    associate (one => rule%axes(1), two => rule%axes(2), lanes => rule%lanes)
      allocate (rule%rational(n_lanes, 3, one%n_points, two%n_points, lanes%n_blocks, &
                              two%n_elements))
      do e2 = 1, two%n_elements
        do b = 1, lanes%n_blocks
          do lane = 1, n_lanes
            e1 = lanes%element(lane, b)
            low = [one%first(e1), two%first(e2)]
            high = low + rule%axes%degree
            associate (w => rule%weights(low(1):high(1), low(2):high(2)))
              do q2 = 1, two%n_points
                do q1 = 1, one%n_points
                  total = dot_product(one%values(:, q1, e1), matmul(w, two%values(:, q2, e2)))
                  rule%rational(lane, :, q1, q2, b, e2) = [1.0_wp, &
                    dot_product(one%slopes(:, q1, e1), matmul(w, two%values(:, q2, e2))), &
                    dot_product(one%values(:, q1, e1), matmul(w, two%slopes(:, q2, e2)))]/total
                end do
              end do
            end associate
          end do
        end do
      end do
    end associate
  end subroutine set_rational

  !> Add the control-point forces of a traction per area and of a pressure against the outward
  !! normal, both on the shape that `net` gives. Rows of elements are worked in parallel and added
  !! in their order, so that the sums do not depend on the number of threads.
  subroutine add_face_forces(rule, n, net, traction, pressure, forces)
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: n(2)                   !! control points of the face
    real(wp), intent(in) :: net(n(1), n(2), 3)    !! their places
    real(wp), intent(in) :: traction(3), pressure
    real(wp), intent(inout) :: forces(n(1), n(2), 3)
    real(wp), allocatable :: rows(:, :, :, :)     ! forces of each row on its control points
    integer :: e, j

    allocate (rows(n(1), rule%axes(2)%degree + 1, 3, rule%axes(2)%n_elements))
    !$omp parallel do schedule(static) default(shared) private(e) &
    !$omp if (size(rule%is_loaded) > parallel_size)
    do e = 1, size(rows, 4)
      rows(:, :, :, e) = 0.0_wp
      call add_row(rule, e, n, net, traction, -rule%outward*pressure, rows(:, :, :, e))
    end do
    !$omp end parallel do
    do e = 1, size(rows, 4)
      do j = 1, size(rows, 2)
        associate (column => rule%axes(2)%first(e) + j - 1)
          forces(:, column, :) = forces(:, column, :) + rows(:, j, :, e)
        end associate
      end do
    end do
  end subroutine add_face_forces

  !> Forces of a row of elements along direction 1, eight at a time.
  pure subroutine add_row(rule, e, n, net, traction, push, row)
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: e, n(2)
    real(wp), intent(in) :: net(n(1), n(2), 3), traction(3), push
    real(wp), intent(inout) :: row(n(1), rule%axes(2)%degree + 1, 3)
    real(wp), dimension(n_lanes*product(rule%axes%degree + 1), 3) :: u, f
    real(wp) :: w(size(u, 1)), is_on(n_lanes)
    integer :: b, p(3)

    p = [rule%axes%degree, 0]
    associate (lanes => rule%lanes, two => rule%axes(2))
      do b = 1, lanes%n_blocks
        is_on = merge(1.0_wp, 0.0_wp, rule%is_loaded(lanes%element(:, b), e))
        if (allocated(rule%share)) is_on = is_on*rule%share(lanes%element(:, b), e)
        if (.not. any(is_on > 0.0_wp)) cycle
        call gather_block(p, [n, 1], 3, lanes%is_contiguous(b), lanes%first(:, b), &
                          two%first(e), 1, 1.0_wp, net, u)
        if (allocated(rule%rational)) then
          call gather_block(p, [n, 1], 1, lanes%is_contiguous(b), lanes%first(:, b), &
                            two%first(e), 1, 1.0_wp, rule%weights, w)
          call weigh_block(size(u, 1), 3, w, u)
        end if
        f = 0.0_wp
        call block_face_forces(rule, b, e, p(1), p(2), is_on, u, traction, push, f)
        if (allocated(rule%rational)) call weigh_block(size(f, 1), 3, w, f)
        call add_block(p, 3, [1, 1], [n(1), p(2) + 1], 1, [1, p(2) + 1], lanes%is_contiguous(b), &
                       lanes%first(:, b), 1, 1, f, row)
      end do
    end associate
  end subroutine add_row

  pure subroutine block_face_forces(rule, b, e, p1, p2, is_on, u, traction, push, f)
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: b, e, p1, p2
    real(wp), intent(in) :: is_on(n_lanes), u(n_lanes, p1 + 1, p2 + 1, 3), traction(3), push
    real(wp), intent(inout) :: f(n_lanes, p1 + 1, p2 + 1, 3)
    real(wp) :: a(n_lanes, 2, p2 + 1, 3), fa(n_lanes, p2 + 1, 3), point(n_lanes, 3), w(n_lanes)
    integer :: q1, q2, i, j, c, l

    associate (n1 => rule%lanes%values(:, :, :, b), d1 => rule%lanes%slopes(:, :, :, b), &
               n2 => rule%axes(2)%values(:, :, e))
      do q1 = 1, rule%axes(1)%n_points
        a = 0.0_wp
        do c = 1, 3
          do j = 1, p2 + 1
            do i = 1, p1 + 1
              !$omp simd
              do l = 1, n_lanes
                a(l, 1, j, c) = a(l, 1, j, c) + n1(l, i, q1)*u(l, i, j, c)
                a(l, 2, j, c) = a(l, 2, j, c) + d1(l, i, q1)*u(l, i, j, c)
              end do
            end do
          end do
        end do
        fa = 0.0_wp
        do q2 = 1, rule%axes(2)%n_points
          w = is_on*rule%lanes%weights(:, q1, b)*rule%axes(2)%weights(q2)
          call point_forces(rule, b, e, q1, q2, p2, a, w, traction, push, point)
          do c = 1, 3
            do j = 1, p2 + 1
              fa(:, j, c) = fa(:, j, c) + n2(j, q2)*point(:, c)
            end do
          end do
        end do
        do c = 1, 3
          do j = 1, p2 + 1
            do i = 1, p1 + 1
              f(:, i, j, c) = f(:, i, j, c) + n1(:, i, q1)*fa(:, j, c)
            end do
          end do
        end do
      end do
    end associate
  end subroutine block_face_forces

  !> Force at one point of eight elements, from tangents and area.
  pure subroutine point_forces(rule, b, e, q1, q2, p2, a, w, traction, push, point)
    type(face_rule_t), intent(in) :: rule
    integer, intent(in) :: b, e, q1, q2, p2
    real(wp), intent(in) :: a(n_lanes, 2, p2 + 1, 3)   !! values and slopes along direction 1
    real(wp), intent(in) :: w(n_lanes), traction(3), push
    real(wp), intent(out) :: point(n_lanes, 3)
    real(wp), dimension(n_lanes, 3) :: place, t1, t2, normal
    real(wp) :: area(n_lanes)
    integer :: j, c

    place = 0.0_wp
    t1 = 0.0_wp
    t2 = 0.0_wp
    associate (n2 => rule%axes(2)%values(:, q2, e), d2 => rule%axes(2)%slopes(:, q2, e))
      do c = 1, 3
        do j = 1, p2 + 1
          place(:, c) = place(:, c) + n2(j)*a(:, 1, j, c)
          t1(:, c) = t1(:, c) + n2(j)*a(:, 2, j, c)
          t2(:, c) = t2(:, c) + d2(j)*a(:, 1, j, c)
        end do
      end do
    end associate
    if (allocated(rule%rational)) then
      associate (r => rule%rational(:, :, q1, q2, b, e))
        do c = 1, 3
          t1(:, c) = (t1(:, c) - place(:, c)*r(:, 2))*r(:, 1)
          t2(:, c) = (t2(:, c) - place(:, c)*r(:, 3))*r(:, 1)
        end do
      end associate
    end if
    normal(:, 1) = t1(:, 2)*t2(:, 3) - t1(:, 3)*t2(:, 2)
    normal(:, 2) = t1(:, 3)*t2(:, 1) - t1(:, 1)*t2(:, 3)
    normal(:, 3) = t1(:, 1)*t2(:, 2) - t1(:, 2)*t2(:, 1)
    area = sqrt(normal(:, 1)**2 + normal(:, 2)**2 + normal(:, 3)**2)
    do c = 1, 3
      point(:, c) = w*(area*traction(c) + push*normal(:, c))
    end do
    if (allocated(rule%rational)) then
      do c = 1, 3
        point(:, c) = point(:, c)*rule%rational(:, 1, q1, q2, b, e)
      end do
    end if
  end subroutine point_forces

end module face_quadrature
