!> Forces of a patch whose volume strain is projected onto its smooth splines. Three passes over all
!! blocks: strains to loads of the splines; strains of the splines to stresses and on to their
!! loads; stresses of the splines to forces. In between the splines' coefficients are solved for.
!! Tiles and lines are worked in parallel and added up in fixed order.
module smooth_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use element, only: force_report_t
  use solid_patch, only: solid_patch_t, tile_t, tile_buffer_t, block_t, n_blocks_of, next_block, &
                         n_elements_of, next_group, most_in_group
  use solid_forces, only: gather_motion, add_forces, clear_rows, add_report, add_tiles, &
                          finish_evaluation
  use strain_projection, only: projection_t
  use smooth_splines, only: smooth_fields_t, smooth_table_t, solve_for_splines
  use point_stress, only: point_fields_t, point_group_t, update_stress
  use projected_forces, only: set_point_fields, run_strain, run_nodal, start_strain, &
                              finish_strain, start_stress, finish_stress
  implicit none
  private

  public :: forces_of_smooth_projection

contains

  !> Stress update and internal forces; arguments as of `internal_forces`.
  subroutine forces_of_smooth_projection(patch, projection, fields, buffers, law, dt, x, v, force, &
                                         report)
    type(solid_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    type(smooth_fields_t), intent(inout) :: fields
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                             !! [time]
    real(wp), intent(in) :: x(:, :, :, :), v(:, :, :, :)   !! end of step, middle of step
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(out) :: report
    type(force_report_t) :: reports(size(buffers))
    integer :: t

    !$omp parallel do schedule(static) default(shared) private(t) if (.not. law%is_serial)
    do t = 1, size(buffers)
      call strain_of_tile(patch, projection, patch%tiles(t), dt, x, v, fields)
    end do
    !$omp end parallel do
    call solve_for_splines(patch, projection%smooth, size(fields%all, 4), fields)
    !$omp parallel do schedule(static) default(shared) private(t) if (.not. law%is_serial)
    do t = 1, size(buffers)
      call stress_of_tile(patch, projection, law, patch%tiles(t), dt, x, v, fields, reports(t))
    end do
    !$omp end parallel do
    call solve_for_splines(patch, projection%smooth, 1, fields)
    !$omp parallel default(shared) private(t) if (.not. law%is_serial)
    !$omp do schedule(static)
    do t = 1, size(buffers)
      call nodal_of_tile(patch, projection, patch%tiles(t), x, fields, force, buffers(t)%force)
    end do
    !$omp end do
    call add_tiles(patch, buffers, force)
    !$omp end parallel
    call finish_evaluation(patch, dt, reports, report)
  end subroutine forces_of_smooth_projection

  !> Loads of the strains of a tile.
  subroutine strain_of_tile(patch, projection, tile, dt, x, v, fields)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    type(smooth_fields_t), intent(inout) :: fields
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational))
    type(point_fields_t) :: points
    type(block_t) :: block
    integer :: i

    call set_point_fields(patch, projection, points)
    do i = 1, n_blocks_of(patch, tile)
      call next_block(patch, tile, block)
      call gather_motion(patch, block, dt, x, v, u, w)
      call run_strain(patch, projection, block, .false., u, points)
      call start_strain(projection, points)
      call collect(patch, 1, size(fields%all, 4), block, points, fields)
    end do
  end subroutine strain_of_tile

  !> Stresses of a tile and their loads. Kinematics are worked out once more instead of being kept.
  subroutine stress_of_tile(patch, projection, law, tile, dt, x, v, fields, report)
    type(solid_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    type(smooth_fields_t), intent(inout) :: fields
    type(force_report_t), intent(out) :: report
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational))
    type(point_group_t) :: group
    type(point_fields_t), allocatable :: points(:)
    type(block_t) :: blocks(most_in_group)
    integer :: i, n, n_left
    logical :: ok(most_in_group)

    n = 0
    n_left = n_elements_of(patch, tile)
    allocate (points(merge(1, most_in_group, law%n_together == 1)))
    do while (n_left > 0)
      call next_group(patch, tile, law%n_together, n_left, blocks, n)
      do i = 1, n
        if (.not. allocated(points(i)%dstrain)) call set_point_fields(patch, projection, points(i))
        call gather_motion(patch, blocks(i), dt, x, v, u, w)
        call run_strain(patch, projection, blocks(i), .true., u, points(i))
        call spread_to_block(patch, 1, size(fields%all, 4), blocks(i), fields, points(i))
        call finish_strain(projection, points(i))
      end do
      call update_stress(patch, law, blocks(:n), dt, group, points(:n), ok(:n))
      do i = 1, n
        call start_stress(projection, points(i))
        call collect(patch, 2, 1, blocks(i), points(i), fields)
        fields%rest(:, :, :, blocks(i)%number) = points(i)%weighted
        call add_report(report, points(i)%sums, ok(i), blocks(i))
      end do
    end do
  end subroutine stress_of_tile

  !> Forces of the blocks of a tile.
  subroutine nodal_of_tile(patch, projection, tile, x, fields, force, border)
    type(solid_patch_t), intent(in) :: patch
    type(projection_t), intent(in) :: projection
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: x(:, :, :, :)
    type(smooth_fields_t), intent(in) :: fields
    real(wp), intent(inout), contiguous :: force(:, :, :, :), border(:, :, :, :)
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 3), f(size(u, 1), 3)
    real(wp) :: w(merge(size(f, 1), 0, patch%is_rational))
    type(point_fields_t) :: points
    type(block_t) :: block
    integer :: i

    call set_point_fields(patch, projection, points)
    call clear_rows(tile, force, border)
    do i = 1, n_blocks_of(patch, tile)
      call next_block(patch, tile, block)
      points%weighted(:, :, :) = fields%rest(:, :, :, block%number)
      call spread_to_block(patch, 2, 1, block, fields, points)
      call finish_stress(projection, points)
      call gather_motion(patch, block, 0.0_wp, x, x, u, w)   ! positions alone
      call run_nodal(patch, projection, block, u, points, f)
      call add_forces(patch, tile, block, w, f, force, border)
    end do
  end subroutine nodal_of_tile

  !> Loads of the strains of a block (way 1), or of its stresses with the transposed operators (2).
  pure subroutine collect(patch, way, n_fields, block, points, fields)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: way, n_fields             !! volume strain, then growths
    type(block_t), intent(in) :: block
    type(point_fields_t), intent(in) :: points
    type(smooth_fields_t), intent(inout) :: fields
    integer :: k

    call collect_all(patch, way, block, fields%tables, points%mean, &
                     fields%loads(:, :, :, :, 1, block%number))
    do k = 2, n_fields
      call collect_all(patch, way, block, fields%tables, points%growth(:, k - 1, :), &
                       fields%loads(:, :, :, :, k, block%number))
    end do
  end subroutine collect

  !> Put the projected strains or stresses into the points of a block.
  pure subroutine spread_to_block(patch, way, n_fields, block, fields, points)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: way, n_fields
    type(block_t), intent(in) :: block
    type(smooth_fields_t), intent(in) :: fields
    type(point_fields_t), intent(inout) :: points
    integer :: k

    call spread_all(patch, way, block, fields%tables, shape(fields%all(:, :, :, 1)), &
                    fields%all(:, :, :, 1), points%mean)
    do k = 2, n_fields
      call spread_all(patch, way, block, fields%tables, shape(fields%all(:, :, :, 1)), &
                      fields%all(:, :, :, k), points%growth(:, k - 1, :))
    end do
  end subroutine spread_to_block

  pure subroutine collect_all(patch, way, block, tables, field, loads)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: way
    type(block_t), intent(in) :: block
    type(smooth_table_t), intent(in) :: tables(3)
    real(wp), intent(in) :: field(*)                 !! (8, q3, q2, q1)
    real(wp), intent(inout) :: loads(*)              !! (8, p3, p2, p1)
    real(wp) :: half(n_lanes*product(patch%axes%n_points)), whole(size(half))

    associate (q => patch%axes%n_points, p => patch%axes%degree)
      call combine(1, q(3), p(3), q(2)*q(1), tables(3)%to_loads(:, :, :, block%e3, way), field, &
                   half)
      call combine(p(3), q(2), p(2), q(1), tables(2)%to_loads(:, :, :, block%e2, way), half, whole)
      call combine(p(3)*p(2), q(1), p(1), 1, tables(1)%to_loads(:, :, :, block%b, way), whole, &
                   loads)
    end associate
  end subroutine collect_all

  pure subroutine spread_all(patch, way, block, tables, n, coefficients, field)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: way
    type(block_t), intent(in) :: block
    type(smooth_table_t), intent(in) :: tables(3)
    integer, intent(in) :: n(3)                      !! splines along the axes
    real(wp), intent(in) :: coefficients(n(1), n(2), n(3))
    real(wp), intent(inout) :: field(*)              !! (8, q3, q2, q1)
    real(wp) :: half(n_lanes*product(patch%axes%n_points)), whole(size(half))
    real(wp) :: lanes(n_lanes, patch%axes(3)%degree, patch%axes(2)%degree, patch%axes(1)%degree)
    integer :: i, j, k

    associate (q => patch%axes%n_points, p => patch%axes%degree, &
               first2 => patch%axes(2)%first(block%e2), first3 => patch%axes(3)%first(block%e3))
      do i = 1, p(1)
        do j = 1, p(2)
          do k = 1, p(3)
            call gather_lanes(patch, block%b, i, coefficients(:, first2 + j - 1, first3 + k - 1), &
                              lanes(:, k, j, i))
          end do
        end do
      end do
      call combine(p(3)*p(2), p(1), q(1), 1, tables(1)%to_points(:, :, :, block%b, way), lanes, &
                   half)
      call combine(p(3), p(2), q(2), q(1), tables(2)%to_points(:, :, :, block%e2, way), half, whole)
      call combine(1, p(3), q(3), q(2)*q(1), tables(3)%to_points(:, :, :, block%e3, way), whole, &
                   field)
    end associate
  end subroutine spread_all

  !> Coefficients of spline `a` of the eight elements.
  pure subroutine gather_lanes(patch, b, a, coefficients, lanes)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: b, a
    real(wp), intent(in) :: coefficients(*)
    real(wp), intent(out) :: lanes(n_lanes)
    integer :: first(n_lanes), l

    first = patch%lanes%first(:, b) + a - 1
    if (patch%lanes%is_contiguous(b)) then
      lanes = coefficients(first(1):first(1) + n_lanes - 1)
    else
      do l = 1, n_lanes
        lanes(l) = coefficients(first(l))
      end do
    end if
  end subroutine gather_lanes

  !> Sums along the middle index, lane by lane. Those of quadratic splines with three points are
  !! written out: each term is read once, no sum goes to memory and back.
  pure subroutine combine(m, n_in, n_out, n, factors, from, to)
    integer, intent(in) :: m, n_in, n_out, n
    real(wp), intent(in) :: factors(8, n_in, n_out), from(8, m, n_in, n)
    real(wp), intent(inout) :: to(8, m, n_out, n)      !! set
    integer :: l, i, j, k, a

    do k = 1, n
      if (n_in == 2 .and. n_out == 3) then
        do i = 1, m
          !$omp simd
          do l = 1, 8
            to(l, i, 1, k) = factors(l, 1, 1)*from(l, i, 1, k) + factors(l, 2, 1)*from(l, i, 2, k)
            to(l, i, 2, k) = factors(l, 1, 2)*from(l, i, 1, k) + factors(l, 2, 2)*from(l, i, 2, k)
            to(l, i, 3, k) = factors(l, 1, 3)*from(l, i, 1, k) + factors(l, 2, 3)*from(l, i, 2, k)
          end do
        end do
      else if (n_in == 3 .and. n_out == 2) then
        do i = 1, m
          !$omp simd
          do l = 1, 8
            to(l, i, 1, k) = factors(l, 1, 1)*from(l, i, 1, k) &
                             + factors(l, 2, 1)*from(l, i, 2, k) &
                             + factors(l, 3, 1)*from(l, i, 3, k)
            to(l, i, 2, k) = factors(l, 1, 2)*from(l, i, 1, k) &
                             + factors(l, 2, 2)*from(l, i, 2, k) &
                             + factors(l, 3, 2)*from(l, i, 3, k)
          end do
        end do
      else
        do j = 1, n_out
          to(:, :, j, k) = 0.0_wp
          do a = 1, n_in
            do i = 1, m
              !$omp simd
              do l = 1, 8
                to(l, i, j, k) = to(l, i, j, k) + factors(l, a, j)*from(l, i, a, k)
              end do
            end do
          end do
        end do
      end if
    end do
  end subroutine combine

end module smooth_forces
