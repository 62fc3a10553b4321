!> Stiffness of the contact springs of static increments: of each point that touches, along the
!! normal, and along the tool where friction holds it.
module contact_stiffness
  use kinds, only: wp
  use contact, only: contact_t
  use contact_effect, only: contact_effect_t, contact_view_t, contact_pairs
  use effect, only: effect_slot_t
  use tool, only: tool_t
  use body_stiffness, only: body_stiffness_t
  use driven_tools, only: driven_tools_t, begin_coupling, add_rest, add_spring
  use sparse_matrix, only: add_block
  implicit none
  private

  public :: add_contact_stiffness, n_touching, shortest_reach

contains

  !> Add the springs as the effects left them. The curvature of tools is left out, and so is what
  !! makes the tangent of slip unsymmetrical: along its slip a point has no stiffness.
  subroutine add_contact_stiffness(stiffness, effects, tools, driven)
    type(body_stiffness_t), intent(inout) :: stiffness
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
          call add_point(stiffness, pair, tools(pair%tool), p, driven)
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

  !> The spring of one point between the control points that move it. Those of a shell move with the
  !! mid-surface: the arm to the face is left out.
  subroutine add_point(stiffness, pair, tool, point, driven)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(contact_effect_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: point
    type(driven_tools_t), intent(inout) :: driven
    real(wp) :: spring(3, 3)
    real(wp), allocatable :: values(:), block(:, :)
    integer, allocatable :: components(:)
    integer :: i, k, c

    spring = point_stiffness(pair%pair, point)
    if (all(abs(spring) <= 0.0_wp)) return
    if (tool%is_turning) spring = matmul(tool%rotation, matmul(spring, transpose(tool%rotation)))
    call list_components(stiffness, pair, point, values, components)
    allocate (block(size(components), size(components)))
    do k = 1, size(components)
      c = mod(k - 1, 3) + 1
      do i = 1, size(components), 3
        block(i:i + 2, k) = values((i + 2)/3)*values((k + 2)/3)*spring(:, c)
      end do
    end do
    call add_block(stiffness%matrix, stiffness%map, components, block)
    if (any(driven%tool == pair%tool)) &
      call add_spring(driven, pair%tool, stiffness%map, spring, values, components)
  end subroutine add_point

  !> In the frame of the tool.
  pure function point_stiffness(contact, point) result(spring)
    type(contact_t), intent(in) :: contact
    integer, intent(in) :: point
    real(wp) :: spring(3, 3)                       !! [force/length]
    real(wp) :: push(3), drag(3), normal(3), held
    integer :: c

    drag = 0.0_wp
    if (allocated(contact%friction)) &
      drag = -contact%stiffness(point)*contact%friction%stretch(:, point)
    push = contact%force(point, :) - drag
    spring = 0.0_wp
    if (.not. norm2(push) > 0.0_wp) return
    normal = push/norm2(push)
    do c = 1, 3
      spring(:, c) = normal*normal(c)
    end do
    if (allocated(contact%friction)) then
      held = contact%friction%held(point)
      do c = 1, 3
        spring(:, c) = spring(:, c) + held*(unit(c) - normal*normal(c))
      end do
    end if
    spring = contact%stiffness(point)*spring
  end function point_stiffness

  pure function unit(c) result(vector)
    integer, intent(in) :: c
    real(wp) :: vector(3)

    vector = 0.0_wp
    vector(c) = 1.0_wp
  end function unit

  !> Components of the control points that move a point, and how much each of these does.
  subroutine list_components(stiffness, pair, point, values, components)
    type(body_stiffness_t), intent(in) :: stiffness
    type(contact_effect_t), intent(in) :: pair
    integer, intent(in) :: point
    real(wp), allocatable, intent(out) :: values(:)
    integer, allocatable, intent(out) :: components(:)
    integer :: at(2), axes(2), place(3), i, j, k, c, n, first

    associate (secondary => pair%pair%secondary, grid => stiffness%grids(pair%part))
      at = [mod(point - 1, secondary%n_along(1)) + 1, (point - 1)/secondary%n_along(1) + 1]
      axes = pack([1, 2, 3], [1, 2, 3] /= (pair%face + 1)/2)
      n = product(secondary%lines%degree + 1)
      allocate (values(n), components(3*n))
      k = 0
      do j = 1, secondary%lines(2)%degree + 1
        do i = 1, secondary%lines(1)%degree + 1
          k = k + 1
          place = pair%lower
          place(axes) = [secondary%lines(1)%first(at(1)) + i, &
                         secondary%lines(2)%first(at(2)) + j] - 1
          values(k) = secondary%lines(1)%values(at(1), i)*secondary%lines(2)%values(at(2), j) &
                      *secondary%inverse_w(at(1), at(2))
          if (secondary%is_rational) &
            values(k) = values(k)*secondary%weights(place(axes(1)), place(axes(2)))
          first = 3*(grid%n_before + place(1) - 1 + grid%n(1)*(place(2) - 1 &
                                                    + grid%n(2)*(place(3) - 1)))
          components(3*k - 2:3*k) = first + [(c, c=1, 3)]
        end do
      end do
    end associate
  end subroutine list_components

end module contact_stiffness
