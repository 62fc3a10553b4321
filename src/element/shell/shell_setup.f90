!> From a sheet given as a solid to the patch of its mid-surface.
module shell_setup
  use kinds, only: wp
  use failure, only: error_t, fail
  use spared_memory, only: clear
  use text, only: place_text
  use linear_algebra, only: cross
  use knot_vector, only: find_span, basis_derivatives, constant_axis
  use gauss_rule, only: gauss_rule_t
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes, lane_table_t, new_axis_table, new_trimmed_lanes
  use bulk_viscosity, only: new_viscosity
  use solid_patch, only: solid_patch_t, shell_points_t, block_t, block_at, element_of_lane, &
                         local_place, weights_of_row, basis_at
  use patch_setup, only: cut_patch, most_tiles
  use shell_forces, only: set_metric, shell_kernel_of
  use shell_context, only: set_layers
  implicit none
  private

  public :: mid_surface, new_shell_patch, damp_bending_of, shortest_length

contains

  !> The surface half-way through a solid along axis 3, as a grid with one control point across.
  pure function mid_surface(solid) result(middle)
    type(nurbs_solid_t), intent(in) :: solid
    type(nurbs_solid_t) :: middle
    real(wp) :: value(solid%axes(3)%degree + 1, 0:0), w, half
    integer :: n(3), span, i, k, c

    n = solid%axes%n_basis
    middle%axes(:2) = solid%axes(:2)
    middle%axes(3) = constant_axis()
    allocate (middle%points(n(1), n(2), 1, 3), middle%weights(n(1), n(2), 1), source=0.0_wp)
    associate (axis => solid%axes(3))
      half = 0.5_wp*(axis%knots(1) + axis%knots(size(axis%knots)))
      span = find_span(axis, half)
      call basis_derivatives(axis, span, half, 0, value)
      do i = 1, axis%degree + 1
        k = span - axis%degree - 1 + i
        w = value(i, 0)
        middle%weights(:, :, 1) = middle%weights(:, :, 1) + w*solid%weights(:, :, k)
        do c = 1, 3
          middle%points(:, :, 1, c) = middle%points(:, :, 1, c) &
                                      + w*solid%weights(:, :, k)*solid%points(:, :, k, c)
        end do
      end do
    end associate
    do c = 1, 3
      middle%points(:, :, 1, c) = middle%points(:, :, 1, c)/middle%weights(:, :, 1)
    end do
  end function mid_surface

  !> Tables, tiles and a stress-free state of a mid-surface with the thickness of its solid.
  subroutine new_shell_patch(patch, points, solid, middle, rule, law, viscosity, error, moments)
    type(solid_patch_t), intent(out) :: patch
    type(shell_points_t), intent(out) :: points
    type(nurbs_solid_t), intent(in) :: solid, middle
    type(gauss_rule_t), intent(in) :: rule(3)        !! of an element by axis
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)             !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(in), optional :: moments(:, :, :)   !! of what an outline keeps, `cut_cells`
    type(lane_table_t) :: lanes
    real(wp), allocatable :: lengths(:, :)
    integer :: axis, n, n_tiles

    do axis = 1, 3
      patch%axes(axis) = new_axis_table(middle%axes(axis), rule(axis)%points, rule(axis)%weights)
    end do
    patch%is_rational = any(abs(middle%weights/middle%weights(1, 1, 1) - 1.0_wp) > 1.0e-14_wp)
    if (patch%is_rational) patch%weights = middle%weights
    n_tiles = most_tiles(patch, law)
    if (present(moments)) then
      call new_trimmed_lanes(middle%axes(:2), patch%axes(:2), moments, lanes)
      call cut_patch(patch, n_tiles, 1, lanes)
    else
      call cut_patch(patch, n_tiles, 1)   ! a law gets each block by itself
    end if
    points%kernel = shell_kernel_of(patch%axes%degree, patch%axes%n_points, patch%is_rational)
    associate (q => patch%axes%n_points)
      n = q(1)*q(2)
      patch%together = n
      allocate (patch%stress(n_lanes, q(3)*n, 3, 1, patch%n_blocks))
      allocate (patch%state(n_lanes, q(3)*n, max(1, law%n_state), 1, patch%n_blocks))
      allocate (points%through(n_lanes, q(3), n, patch%n_blocks))
    end associate
    call clear(size(patch%stress), patch%stress)
    call clear(size(patch%state), patch%state)
    call clear(size(points%through), points%through)
    allocate (points%metric(n_lanes, 6, n, patch%n_blocks))
    allocate (points%resultant(n_lanes, 6, n, patch%n_blocks), source=0.0_wp)
    allocate (points%thickness(n_lanes, n, patch%n_blocks))
    allocate (points%normal(n_lanes, 2, n, patch%n_blocks), source=0.0_wp)
    allocate (points%is_pressed(patch%n_blocks), source=.false.)
    if (patch%is_rational) call set_rational(patch, points)
    call set_metric(patch, points, middle%points)
    call look_at_sheet(patch, solid, middle, law, points, error)
    if (allocated(error)) return
    call set_volumes(patch, points)
    patch%has_context = law%needs_context
    if (patch%has_context) call set_layers(patch, points)
    call find_lengths(points, lengths)
    patch%shortest = min(minval(lengths), minval(points%thickness))
    patch%viscosity = new_viscosity(viscosity, law, lengths)
    allocate (patch%push(n_lanes, 1, n, merge(patch%n_blocks, 1, patch%viscosity%is_active)), &
              source=0.0_wp)
  end subroutine new_shell_patch

  !> Give a patch at rest a viscosity of bending.
  pure subroutine damp_bending_of(patch, points, factor)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(in) :: points
    real(wp), intent(in) :: factor                   !! see `bending_factors`, > 0

    if (.not. patch%viscosity%is_active) call find_lengths(points, patch%viscosity%length)
    patch%viscosity%is_active = .true.
    patch%viscosity%bending = factor
    deallocate (patch%push)
    allocate (patch%push(n_lanes, 2, patch%together, patch%n_blocks), source=0.0_wp)
  end subroutine damp_bending_of

  !> Weight function and its derivatives at the points; the weights never change.
  pure subroutine set_rational(patch, points)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(inout) :: points
    integer :: block, lane, row

    allocate (points%rational(n_lanes, 6, patch%together, patch%n_blocks))
    do block = 1, patch%n_blocks
      do lane = 1, n_lanes
        do row = 1, patch%together
          points%rational(lane, :, row, block) = weight_at(patch, block_at(patch, block), lane, row)
        end do
      end do
    end do
  end subroutine set_rational

  !> 1/W and W,1 W,2 W,11 W,22 W,12 over W of a point.
  pure function weight_at(patch, block, lane, row) result(ratios)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: lane, row
    real(wp) :: ratios(6), w
    real(wp) :: one(patch%axes(1)%degree + 1, 0:2), two(patch%axes(2)%degree + 1, 0:2)
    real(wp) :: part(patch%axes(1)%degree + 1, patch%axes(2)%degree + 1)

    associate (i => patch%lanes%first(lane, block%b), j => patch%axes(2)%first(block%e2))
      part = patch%weights(i:i + patch%axes(1)%degree, j:j + patch%axes(2)%degree, 1)
    end associate
    call basis_at(patch, block, lane, row, one, two)
    w = dot_product(one(:, 0), matmul(part, two(:, 0)))
    ratios = [1.0_wp, dot_product(one(:, 1), matmul(part, two(:, 0))), &
              dot_product(one(:, 0), matmul(part, two(:, 1))), &
              dot_product(one(:, 2), matmul(part, two(:, 0))), &
              dot_product(one(:, 0), matmul(part, two(:, 2))), &
              dot_product(one(:, 1), matmul(part, two(:, 1)))]/w
  end function weight_at

  !> Distance of the faces of the solid along the normal of the mid-surface, and directions of the
  !! material in the frames of the points. Axes 1, 2 and 3 must form a right-handed patch.
  subroutine look_at_sheet(patch, solid, middle, law, points, error)
    type(solid_patch_t), intent(inout) :: patch
    type(nurbs_solid_t), intent(in) :: solid, middle
    class(block_law_t), intent(in) :: law
    type(shell_points_t), intent(inout) :: points
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: xi(3), low(3), high(3), x(3), j(3, 3), frame(3, 3), local(2)
    integer :: block, lane, row, e(3), axis, s, n

    n = patch%axes(3)%n_points
    associate (knots => solid%axes(3)%knots)
      do block = 1, patch%n_blocks
        do lane = 1, n_lanes
          e = element_of_lane(patch, block, lane)
          do row = 1, patch%together
            local = local_place(patch, block_at(patch, block), lane, row)
            do axis = 1, 2
              s = patch%axes(axis)%first(e(axis)) + patch%axes(axis)%degree
              associate (u => solid%axes(axis)%knots(s), v => solid%axes(axis)%knots(s + 1))
                xi(axis) = u + 0.5_wp*(v - u)*(1.0_wp + local(axis))
              end associate
            end do
            call evaluate_solid(middle, [xi(:2), 0.5_wp], x, j)
            frame(:, 1) = j(:, 1)/norm2(j(:, 1))
            frame(:, 3) = cross(j(:, 1), j(:, 2))
            frame(:, 3) = frame(:, 3)/norm2(frame(:, 3))
            frame(:, 2) = cross(frame(:, 3), frame(:, 1))
            call law%lay_in_sheet(n, spread(reshape(frame, [9]), 1, n), &
                                  patch%state(lane, n*(row - 1) + 1:n*row, :law%n_state, 1, block))
            call evaluate_solid(solid, [xi(:2), knots(1)], low)
            call evaluate_solid(solid, [xi(:2), knots(size(knots))], high)
            points%thickness(lane, row, block) = dot_product(high - low, frame(:, 3))
            if (points%thickness(lane, row, block) > 0.0_wp) cycle
            call fail(error, "the sheet is inverted or without thickness at "//place_text(x)// &
                      "; axes 1, 2, 3 must form a right-handed patch")
            return
          end do
        end do
      end do
    end associate
  end subroutine look_at_sheet

  !> Volumes across the sheet at the start, zero for lanes that repeat an element.
  pure subroutine set_volumes(patch, points)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(inout) :: points
    integer :: block, row

    allocate (points%volume, mold=points%thickness)
    do block = 1, patch%n_blocks
      do row = 1, patch%together
        associate (a => points%metric(:, :, row, block))
          points%volume(:, row, block) = weights_of_row(patch, block_at(patch, block), row) &
            *sqrt(a(:, 1)*a(:, 2) - a(:, 3)**2)*points%thickness(:, row, block)
        end associate
      end do
    end do
  end subroutine set_volumes

  !> Shortest axis of all elements in the surface.
  pure real(wp) function shortest_length(points) result(length)
    type(shell_points_t), intent(in) :: points
    real(wp), allocatable :: lengths(:, :)

    call find_lengths(points, lengths)
    length = minval(lengths)
  end function shortest_length

  !> Shortest axis of each element in the surface: 2 over the root of the largest eigenvalue of the
  !! inverse metric at its points.
  pure subroutine find_lengths(points, lengths)
    type(shell_points_t), intent(in) :: points
    real(wp), allocatable, intent(out) :: lengths(:, :)   !! shape (8, n_blocks)
    real(wp) :: mean, root
    integer :: block, lane, row

    allocate (lengths(n_lanes, size(points%metric, 4)), source=huge(1.0_wp))
    do block = 1, size(points%metric, 4)
      do row = 1, size(points%metric, 3)
        do lane = 1, n_lanes
          associate (a => points%metric(lane, :3, row, block))
            mean = 0.5_wp*(a(1) + a(2))
            root = sqrt(0.25_wp*(a(1) - a(2))**2 + a(3)**2)
            lengths(lane, block) = min(lengths(lane, block), &
                                       2.0_wp*sqrt((a(1)*a(2) - a(3)**2)/(mean + root)))
          end associate
        end do
      end do
    end do
  end subroutine find_lengths

end module shell_setup
