!> What laws of users ask for at the points of a shell: places, deformation gradients of the layers
!! in the frames of the points, numbers. The kernel calls such a law through one that brings them.
module shell_context
  use kinds, only: wp
  use block_law, only: block_law_t
  use point_context, only: point_context_t, new_point_context
  use basis_tables, only: n_lanes
  use element, only: grid_number
  use solid_patch, only: solid_patch_t, shell_points_t, block_t, point_number, basis_of_row
  use patch_points, only: set_clock
  implicit none
  private

  public :: new_placed_law, place_block, set_layers

  !> A law with the context of the points of a block.
  type, extends(block_law_t), public :: placed_law_t
    class(block_law_t), allocatable :: law
    type(point_context_t) :: context
  contains
    procedure :: update
    procedure :: update_plane
  end type placed_law_t

contains

  !> A law for the points of the blocks of a patch.
  subroutine new_placed_law(placed, patch, law)
    type(placed_law_t), intent(out) :: placed
    type(solid_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law

    allocate (placed%law, source=law)
    placed%n_state = law%n_state
    placed%density = law%density
    placed%bulk = law%bulk
    placed%shear = law%shear
    associate (q => patch%axes%n_points)
      placed%context = new_point_context(n_lanes*product(q), patch%n_fields)
      placed%context%in_plane = q(1)*q(2)
    end associate
    call set_clock(patch, placed%context)
  end subroutine new_placed_law

  !> That of solids, which a shell does not call.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(placed_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)

    call self%law%update(n, dt, dstrain, stress, state, ok, spin)
  end subroutine update

  !> Plane stress with the context.
  subroutine update_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(placed_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    type(point_context_t) :: context

    context = self%context   ! which the law changes
    call self%law%update_plane_in_context(context, dt, dstrain, stress, state, through, ok, spin)
  end subroutine update_plane

  !> Context of the points of a block at the positions `u` of the end of the increment.
  subroutine place_block(patch, points, block, u, metric, placed)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: u(n_lanes, *)      !! weighted control points, see `gather_motion`
    real(wp), intent(in) :: metric(:, :, :)    !! at these, see `shell_points_t`
    type(placed_law_t), intent(inout) :: placed
    real(wp) :: x(n_lanes, 3), normal(n_lanes, 3), now(n_lanes, 4), before(n_lanes, 4)
    real(wp), dimension(n_lanes) :: depth, stretch
    integer :: q(3), row, layer, first, c

    q = patch%axes%n_points
    associate (context => placed%context, k => block%number)
      do row = 1, q(1)*q(2)
        call place_row(patch, points, block, row, u, x, normal)
        do layer = 1, q(3)
          first = n_lanes*(layer - 1 + q(3)*(row - 1))
          associate (e => context%element(first + 1:first + n_lanes), h => points%thickness, &
                     zeta => patch%axes(3)%abscissae(layer))
            depth = 0.5_wp*zeta*h(:, row, k)
            e = patch%n_before + grid_number(patch%axes%n_elements, [0, block%e2, block%e3]) &
                + patch%lanes%element(:, block%b)
            do c = 1, 3
              context%place(first + 1:first + n_lanes, c) = x(:, c) + depth*normal(:, c)
            end do
            stretch = exp(points%stretch(:, layer, row, k))
            call layer_tangents(points%metric(:, :, row, k), depth, before)
            call layer_tangents(metric(:, :, row), depth, now)
            associate (r => points%reference(:, :, layer, row, k))
              call set_gradient(before, r, stretch, context%f0(first + 1:first + n_lanes, :))
              call set_gradient(now, r, stretch, context%f1(first + 1:first + n_lanes, :))
            end associate
          end associate
          context%point(first + 1:first + n_lanes) = point_number(q(1), q(2), row, layer)
          context%is_owner(first + 1:first + n_lanes) = patch%lanes%is_owner(:, block%b)
          context%length(first + 1:first + n_lanes) = patch%element_size(:, k)
          if (patch%n_fields > 0) &
            context%fields(first + 1:first + n_lanes, :) = patch%given(:, layer, :, row, k)
        end do
      end do
    end associate
  end subroutine place_block

  !> Places on the mid-surface and normals of a row of points.
  pure subroutine place_row(patch, points, block, row, u, x, normal)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(block_t), intent(in) :: block
    integer, intent(in) :: row
    real(wp), intent(in) :: u(n_lanes, patch%axes(1)%degree + 1, patch%axes(2)%degree + 1, 3)
    real(wp), intent(out) :: x(n_lanes, 3), normal(n_lanes, 3)
    real(wp), dimension(n_lanes, 3) :: a1, a2
    real(wp), dimension(n_lanes, patch%axes(1)%degree + 1) :: n1, d1
    real(wp), dimension(n_lanes, patch%axes(2)%degree + 1) :: n2, d2
    integer :: i, j, c

    x = 0.0_wp
    a1 = 0.0_wp
    a2 = 0.0_wp
    call basis_of_row(patch, block, row, n1, d1, n2, d2)
    do c = 1, 3
      do j = 1, patch%axes(2)%degree + 1
        do i = 1, patch%axes(1)%degree + 1
          x(:, c) = x(:, c) + n1(:, i)*n2(:, j)*u(:, i, j, c)
          a1(:, c) = a1(:, c) + d1(:, i)*n2(:, j)*u(:, i, j, c)
          a2(:, c) = a2(:, c) + n1(:, i)*d2(:, j)*u(:, i, j, c)
        end do
      end do
    end do
    if (patch%is_rational) then
      associate (ratios => points%rational(:, :, row, block%number))
        do c = 1, 3
          x(:, c) = x(:, c)*ratios(:, 1)
          a1(:, c) = a1(:, c)*ratios(:, 1) - x(:, c)*ratios(:, 2)
          a2(:, c) = a2(:, c)*ratios(:, 1) - x(:, c)*ratios(:, 3)
        end do
      end associate
    end if
    normal(:, 1) = a1(:, 2)*a2(:, 3) - a1(:, 3)*a2(:, 2)
    normal(:, 2) = a1(:, 3)*a2(:, 1) - a1(:, 1)*a2(:, 3)
    normal(:, 3) = a1(:, 1)*a2(:, 2) - a1(:, 2)*a2(:, 1)
    normal = normal/spread(sqrt(sum(normal**2, 2)), 2, 3)
  end subroutine place_row

  !> What refers to the shape at the start: inverse tangents of the layers, no stretch, and sizes of
  !! the elements, roots of their areas.
  subroutine set_layers(patch, points)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    real(wp) :: tangents(n_lanes, 4), area(n_lanes)
    integer :: block, row, layer, q(3)

    q = patch%axes%n_points
    allocate (points%stretch, source=0.0_wp*points%through)
    allocate (points%reference(n_lanes, 4, q(3), q(1)*q(2), patch%n_blocks))
    allocate (patch%element_size(n_lanes, patch%n_blocks))
    do block = 1, patch%n_blocks
      area = 0.0_wp
      do row = 1, q(1)*q(2)
        associate (a => points%metric(:, :, row, block))
          ! Of a whole element, also where an outline cuts it: what a law scales with size stays.
          area = area + patch%axes(1)%weights((row - 1)/q(2) + 1) &
                 *patch%axes(2)%weights(mod(row - 1, q(2)) + 1) &
                 *sqrt(a(:, 1)*a(:, 2) - a(:, 3)**2)
          do layer = 1, q(3)
            call layer_tangents(a, 0.5_wp*patch%axes(3)%abscissae(layer) &
                                *points%thickness(:, row, block), tangents)
            associate (r => points%reference(:, :, layer, row, block))
              r(:, 1) = tangents(:, 4)
              r(:, 2) = -tangents(:, 2)
              r(:, 3) = -tangents(:, 3)
              r(:, 4) = tangents(:, 1)
              r = r/spread(tangents(:, 1)*tangents(:, 4) - tangents(:, 2)*tangents(:, 3), 2, 4)
            end associate
          end do
        end associate
      end do
      patch%element_size(:, block) = sqrt(area)
    end do
  end subroutine set_layers

  !> Tangents of a layer in the frame of a point, row by row: (I - z B) A, with those of the
  !! mid-surface as the columns of A and its curvature B.
  pure subroutine layer_tangents(metric, z, tangents)
    real(wp), intent(in) :: metric(n_lanes, 6), z(n_lanes)
    real(wp), intent(out) :: tangents(n_lanes, 4)
    real(wp) :: a11, a12, a22, b11, b12, b22
    integer :: l

    !$omp simd private(a11, a12, a22, b11, b12, b22)
    do l = 1, n_lanes
      a11 = sqrt(metric(l, 1))
      a12 = metric(l, 3)/a11
      a22 = sqrt(metric(l, 2) - a12*a12)
      ! B = A^-T b A^-1
      b11 = metric(l, 4)/(a11*a11)
      b12 = (metric(l, 6)/a11 - a12*b11)/a22
      b22 = (metric(l, 5) - 2.0_wp*a12*a22*b12 - a12*a12*b11)/(a22*a22)
      tangents(l, 1) = a11*(1.0_wp - z(l)*b11)
      tangents(l, 2) = a12*(1.0_wp - z(l)*b11) - a22*z(l)*b12
      tangents(l, 3) = -a11*z(l)*b12
      tangents(l, 4) = a22*(1.0_wp - z(l)*b22) - a12*z(l)*b12
    end do
  end subroutine layer_tangents

  !> Deformation gradient from tangents now, the inverse ones at the start, and the stretch through
  !! the thickness.
  pure subroutine set_gradient(now, reference, stretch, f)
    real(wp), intent(in) :: now(n_lanes, 4), reference(n_lanes, 4), stretch(n_lanes)
    real(wp), intent(inout) :: f(n_lanes, 9)

    f(:, 1) = now(:, 1)*reference(:, 1) + now(:, 2)*reference(:, 3)
    f(:, 2) = now(:, 1)*reference(:, 2) + now(:, 2)*reference(:, 4)
    f(:, 4) = now(:, 3)*reference(:, 1) + now(:, 4)*reference(:, 3)
    f(:, 5) = now(:, 3)*reference(:, 2) + now(:, 4)*reference(:, 4)
    f(:, 9) = stretch
  end subroutine set_gradient

end module shell_context
