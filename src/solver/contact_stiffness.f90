!> Stiffness of the contact springs of static increments: of each point that touches, along the
!! normal, and along the tool where friction holds it.
module contact_stiffness
  use kinds, only: wp
  use contact, only: contact_t
  use contact_effect, only: contact_effect_t, contact_view_t, contact_pairs
  use effect, only: effect_slot_t
  use tool, only: tool_t
  use tool_face, only: face_derivatives
  use linear_algebra, only: cross
  use element, only: part_t
  use knot_vector, only: basis_derivatives, find_span
  use body_stiffness, only: body_stiffness_t
  use driven_tools, only: driven_tools_t, begin_coupling, add_rest, add_spring
  use sparse_matrix, only: add_block
  implicit none
  private

  public :: add_contact_stiffness, n_touching, shortest_reach

contains

  !> Add the springs as the effects left them. What makes the tangent of slip unsymmetrical is left
  !! out: along its slip a point has no stiffness.
  subroutine add_contact_stiffness(stiffness, parts, effects, tools, driven)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(part_t), intent(in) :: parts(:)
    type(effect_slot_t), intent(in), target :: effects(:)
    type(tool_t), intent(in) :: tools(:)
    type(driven_tools_t), intent(inout) :: driven
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i, p

    call begin_coupling(driven, stiffness%map%n_free)
    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        if (any(driven%tool == pair%tool)) &
          call add_rest(driven, pair%tool, sum(pair%pair%stiffness))
        do p = 1, pair%pair%secondary%n_points
          if (pair%pair%start(p) < 0.0_wp) cycle
          call add_point(stiffness, parts(pair%part), pair, tools(pair%tool), p, driven)
        end do
      end associate
    end do
  end subroutine add_contact_stiffness

  !> Points that touch now.
  integer function n_touching(effects) result(n)
    type(effect_slot_t), intent(in), target :: effects(:)
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    n = 0
    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      n = n + count(pairs(i)%pair%pair%start >= 0.0_wp)
    end do
  end function n_touching

  !> Smallest depth at which a point counts as behind a tool; huge where there is no contact pair.
  real(wp) function shortest_reach(effects) result(reach)
    type(effect_slot_t), intent(in), target :: effects(:)
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    reach = huge(reach)
    pairs = contact_pairs(effects)
    do i = 1, size(pairs)
      reach = min(reach, pairs(i)%pair%pair%options%max_depth)
    end do
  end function shortest_reach

  !> The spring of one point between the control points that move it.
  subroutine add_point(stiffness, part, pair, tool, point, driven)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(part_t), intent(in) :: part
    type(contact_effect_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: point
    type(driven_tools_t), intent(inout) :: driven
    real(wp) :: spring(3, 3)
    real(wp), allocatable :: way(:, :)
    integer, allocatable :: components(:)

    spring = point_stiffness(pair%pair, tool, point)
    if (all(abs(spring) <= 0.0_wp)) return
    if (tool%is_turning) spring = matmul(tool%rotation, matmul(spring, transpose(tool%rotation)))
    call find_way(stiffness, part, pair, point, way, components)
    call add_block(stiffness%matrix, stiffness%map, components, &
                   matmul(transpose(way), matmul(spring, way)))
    if (any(driven%tool == pair%tool)) &
      call add_spring(driven, pair%tool, stiffness%map, spring, way, components)
  end subroutine add_point

  !> How the force of a point changes as it moves, in the frame of the tool: that of its spring
  !! along the normal, that of friction along the tool, and the push as the normal turns.
  pure function point_stiffness(contact, tool, point) result(spring)
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: point
    real(wp) :: spring(3, 3)                       !! [force/length]
    real(wp) :: push(3), normal(3), held
    integer :: c

    held = 0.0_wp
    push = contact%force(point, :)
    if (allocated(contact%friction)) then
      held = contact%friction%held(point)
      push = push + contact%stiffness(point)*contact%friction%stretch(:, point)
    end if
    spring = 0.0_wp
    if (.not. norm2(push) > 0.0_wp) return
    normal = push/norm2(push)
    do c = 1, 3
      spring(:, c) = contact%stiffness(point)*(normal*normal(c) &
                                               + held*(unit(c) - normal*normal(c)))
    end do
    spring = spring + norm2(push)*curvature(tool, contact%face(point), contact%at(:, point), normal)
  end function point_stiffness

  !> Normal curvatures of a tool at a place, negative where it bulges towards the normal: the normal
  !! of a point close to it changes by the negative of this tensor times its motion.
  pure function curvature(tool, face, at, normal) result(tensor)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2), normal(3)
    real(wp) :: tensor(3, 3)                       !! [1/length]
    real(wp) :: point(3), d1(3, 2), d2(3, 3), dual(3, 2), area(3), second(3)
    integer :: c

    tensor = 0.0_wp
    if (face == 0) return
    call face_derivatives(tool%coefficients, face, at, point, d1, d2)
    area = cross(d1(:, 1), d1(:, 2))
    if (.not. norm2(area) > 0.0_wp) return         ! a pole
    dual(:, 1) = cross(d1(:, 2), area)/dot_product(area, area)
    dual(:, 2) = cross(area, d1(:, 1))/dot_product(area, area)
    second = matmul(normal, d2)                    ! by s s, t t, s t
    do c = 1, 3
      tensor(:, c) = second(1)*dual(:, 1)*dual(c, 1) + second(2)*dual(:, 2)*dual(c, 2) &
                     + second(3)*(dual(:, 1)*dual(c, 2) + dual(:, 2)*dual(c, 1))
    end do
  end function curvature

  pure function unit(c) result(vector)
    integer, intent(in) :: c
    real(wp) :: vector(3)

    vector = 0.0_wp
    vector(c) = 1.0_wp
  end function unit

  !> How a point moves with the components of its control points. A point on a face of a shell turns
  !! with the normal a3 of the mid-surface under it: by -(a3 . change of a_alpha) a^alpha times its
  !! distance from there.
  subroutine find_way(stiffness, part, pair, point, way, components)
    type(body_stiffness_t), intent(in) :: stiffness
    type(part_t), intent(in) :: part
    type(contact_effect_t), intent(in) :: pair
    integer, intent(in) :: point
    real(wp), allocatable, intent(out) :: way(:, :)          !! (3, components)
    integer, allocatable, intent(out) :: components(:)
    real(wp), allocatable :: values(:, :), x(:, :)
    real(wp) :: a(3, 2), area(3), a3(3), dual(3, 2), arm, turn(3)
    integer, allocatable :: places(:, :)
    integer :: k, c

    call find_functions(pair, part, point, places, values)
    associate (grid => stiffness%grids(pair%part), n => size(places, 2))
      allocate (way(3, 3*n), components(3*n), x(3, n))
      way = 0.0_wp
      do k = 1, n
        components(3*k - 2:3*k) = [(c, c=1, 3)] + 3*(grid%n_before + places(1, k) - 1 &
          + grid%n(1)*(places(2, k) - 1 + grid%n(2)*(places(3, k) - 1)))
        do c = 1, 3
          way(c, 3*k - 3 + c) = values(k, 1)
        end do
        x(:, k) = part%element%motion%x(places(1, k), places(2, k), places(3, k), :)
      end do
    end associate
    if (.not. allocated(pair%net)) return
    a = matmul(x, values(:, 2:))
    area = cross(a(:, 1), a(:, 2))
    a3 = area/norm2(area)
    dual(:, 1) = cross(a(:, 2), area)/dot_product(area, area)
    dual(:, 2) = cross(area, a(:, 1))/dot_product(area, area)
    arm = 0.0_wp
    do k = 1, size(places, 2)
      arm = arm + values(k, 1)*dot_product(pair%net(places(1, k), places(2, k), :) - x(:, k), a3)
    end do
    do k = 1, size(places, 2)
      turn = -arm*matmul(dual, values(k, 2:))
      do c = 1, 3
        way(:, 3*k - 3 + c) = way(:, 3*k - 3 + c) + turn*a3(c)
      end do
    end do
  end subroutine find_way

  !> Control points that move a point, and their functions there: values and derivatives along the
  !! two directions of the face.
  subroutine find_functions(pair, part, point, places, values)
    type(contact_effect_t), intent(in) :: pair
    type(part_t), intent(in) :: part
    integer, intent(in) :: point
    integer, allocatable, intent(out) :: places(:, :)        !! (3, n)
    real(wp), allocatable, intent(out) :: values(:, :)       !! (n, 3)
    real(wp), allocatable :: line_1(:, :), line_2(:, :)
    integer :: at(2), axes(2), i, j, k

    associate (secondary => pair%pair%secondary, lines => pair%pair%secondary%lines, &
               knots => part%element%grid%axes)
      at = [mod(point - 1, secondary%n_along(1)) + 1, (point - 1)/secondary%n_along(1) + 1]
      axes = pack([1, 2, 3], [1, 2, 3] /= (pair%face + 1)/2)
      allocate (line_1(lines(1)%degree + 1, 0:1), line_2(lines(2)%degree + 1, 0:1))
      call basis_derivatives(knots(axes(1)), find_span(knots(axes(1)), lines(1)%xi(at(1))), &
                             lines(1)%xi(at(1)), 1, line_1)
      call basis_derivatives(knots(axes(2)), find_span(knots(axes(2)), lines(2)%xi(at(2))), &
                             lines(2)%xi(at(2)), 1, line_2)
      allocate (places(3, size(line_1, 1)*size(line_2, 1)))
      allocate (values(size(places, 2), 3))
      k = 0
      do j = 1, size(line_2, 1)
        do i = 1, size(line_1, 1)
          k = k + 1
          places(:, k) = pair%lower
          places(axes, k) = [lines(1)%first(at(1)) + i, lines(2)%first(at(2)) + j] - 1
          values(k, :) = [line_1(i, 0)*line_2(j, 0), line_1(i, 1)*line_2(j, 0), &
                          line_1(i, 0)*line_2(j, 1)]
          if (secondary%is_rational) values(k, :) = values(k, :) &
            *secondary%weights(places(axes(1), k), places(axes(2), k))
        end do
      end do
      if (.not. secondary%is_rational) return
      values = values/sum(values(:, 1))
      do k = 2, 3
        values(:, k) = values(:, k) - values(:, 1)*sum(values(:, k))
      end do
    end associate
  end subroutine find_functions

end module contact_stiffness
