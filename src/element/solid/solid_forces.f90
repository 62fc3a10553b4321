!> Internal forces of a patch of plain solids: tiles in parallel, each block by block (gather, block
!! kernel of the right instance, add back), then added up in fixed order.
module solid_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use element, only: force_report_t, merge_reports
  use solid_patch, only: solid_patch_t, tile_t, tile_buffer_t, block_t, n_blocks_of, next_block
  use tile_exchange, only: complete_tiles
  use tile_shares, only: begin_tile, end_tile
  use block_gather, only: gather_block, weigh_block, add_block
  use point_context, only: point_context_t, new_point_context
  use patch_points, only: set_clock, set_lanes
  use kernel_dispatch, only: run_kernel, run_context_kernel, takes_fields
  implicit none
  private

  public :: internal_forces, begin_forces, end_forces, add_tiles, finish_evaluation, add_increment
  public :: gather_motion, gather_weights, gather_field, add_forces, clear_rows, add_report

contains

  !> Stress update and internal forces. The result does not depend on the number of threads:
  !! every tile has its own rows of control points and a buffer for the others that it touches,
  !! and the buffers are added in the order of the tiles.
  subroutine internal_forces(patch, buffers, law, dt, x, v, force, report)
    type(solid_patch_t), intent(inout) :: patch            !! state is carried forward
    type(tile_buffer_t), intent(inout) :: buffers(:)    !! from `new_tile_buffers`
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                          !! [time]
    real(wp), intent(in), contiguous :: x(:, :, :, :)   !! control points at the end of the step
    real(wp), intent(in), contiguous :: v(:, :, :, :)   !! velocities at its middle
    real(wp), intent(inout), contiguous :: force(:, :, :, :)   !! set to it, (n1, n2, n3, 3)
    type(force_report_t), intent(out) :: report
    type(force_report_t) :: reports(size(buffers))

    !$omp parallel default(shared) if (.not. law%is_serial)
    call work_tiles(patch, buffers, law, dt, x, v, force, reports)
    call complete_tiles(patch, reports, buffers, force)
    call add_tiles(patch, buffers, force)
    !$omp end parallel
    call finish_evaluation(patch, dt, reports, report)
  end subroutine internal_forces

  !> The first half of the same: the own tiles alone, whose forces `end_forces` adds up when those
  !! of other processes are there.
  subroutine begin_forces(patch, buffers, law, dt, x, v, force, reports)
    type(solid_patch_t), intent(inout) :: patch
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                          !! [time]
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)   !! end, middle of the step
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(inout) :: reports(:)   !! of the tiles

    !$omp parallel default(shared) if (.not. law%is_serial)
    call work_tiles(patch, buffers, law, dt, x, v, force, reports)
    !$omp end parallel
    call add_increment(patch, dt)
  end subroutine begin_forces

  !> The second half, of some rows.
  subroutine end_forces(patch, buffers, rows, force, reports, report)
    type(solid_patch_t), intent(in) :: patch
    type(tile_buffer_t), intent(in) :: buffers(:)
    integer, intent(in) :: rows(2)                      !! first and last
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(in) :: reports(:)      !! of all tiles
    type(force_report_t), intent(out) :: report

    !$omp parallel default(shared)
    call add_tiles(patch, buffers, force, rows)
    !$omp end parallel
    call sum_reports(reports, report)
  end subroutine end_forces

  !> The tiles that are worked here, shared by the threads of a region.
  subroutine work_tiles(patch, buffers, law, dt, x, v, force, reports)
    type(solid_patch_t), intent(inout) :: patch
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                          !! [time]
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)   !! end, middle of the step
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(inout) :: reports(:)   !! of the tiles
    integer :: t

    !$omp do schedule(static)
    do t = patch%shares%first, patch%shares%last
      call begin_tile(patch%shares, t)
      call forces_of_tile(patch, law, patch%tiles(t), dt, x, v, force, buffers(t)%force, reports(t))
      call end_tile(patch%shares, t)
    end do
    !$omp end do
  end subroutine work_tiles

  !> Add the tile buffers to what the tiles have put on their own rows, in the order of the tiles:
  !! the threads of a region share the rows of control points along axis 2, each near the tiles
  !! that it has worked.
  subroutine add_tiles(patch, buffers, force, rows)
    type(solid_patch_t), intent(in) :: patch
    type(tile_buffer_t), intent(in) :: buffers(:)
    real(wp), intent(inout) :: force(:, :, :, :)
    integer, intent(in), optional :: rows(2)            !! first and last; absent: all
    integer :: first, last, t, j, k, c

    first = 1
    last = patch%n_control(2)
    if (present(rows)) then
      first = max(first, rows(1))
      last = min(last, rows(2))
    end if
    !$omp do schedule(static)
    do j = first, last
      if (.not. any(patch%tiles%own_last >= j .and. patch%tiles%control_first(2) <= j)) &
        force(:, j, :, :) = 0.0_wp
      do t = 1, size(buffers)
        associate (low => patch%tiles(t)%control_first, high => patch%tiles(t)%control_last)
          if (j <= patch%tiles(t)%own_last .or. j < low(2) .or. j > high(2)) cycle
          do c = 1, size(force, 4)
            do k = 1, patch%n_control(3)
              force(low(1):high(1), j, k, c) = force(low(1):high(1), j, k, c) &
                                               + buffers(t)%force(:, j, k, c)
            end do
          end do
        end associate
      end do
    end do
    !$omp end do nowait
  end subroutine add_tiles

  !> The evaluation is one increment more; its report is that of all tiles, in their order.
  pure subroutine finish_evaluation(patch, dt, reports, report)
    type(solid_patch_t), intent(inout) :: patch
    real(wp), intent(in) :: dt
    type(force_report_t), intent(in) :: reports(:)     !! of the tiles
    type(force_report_t), intent(out) :: report

    call add_increment(patch, dt)
    call sum_reports(reports, report)
  end subroutine finish_evaluation

  pure subroutine add_increment(patch, dt)
    type(solid_patch_t), intent(inout) :: patch
    real(wp), intent(in) :: dt

    patch%time = patch%time + dt
    patch%increment = patch%increment + 1
  end subroutine add_increment

  pure subroutine sum_reports(reports, report)
    type(force_report_t), intent(in) :: reports(:)     !! of the tiles
    type(force_report_t), intent(out) :: report
    integer :: t

    do t = 1, size(reports)
      call merge_reports(report, reports(t))
      report%failed_block = min(report%failed_block, reports(t)%failed_block)
    end do
  end subroutine sum_reports

  !> Internal forces of the blocks of one tile.
  subroutine forces_of_tile(patch, law, tile, dt, x, v, force, border, report)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt           !! [time]
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)   !! end, middle of the step
    real(wp), intent(inout), contiguous :: force(:, :, :, :)   !! of the patch: rows of the tile
    real(wp), intent(inout), contiguous :: border(:, :, :, :)  !! its other rows, see tile_buffer_t
    type(force_report_t), intent(out) :: report
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6), f(size(u, 1), 3)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), sums(n_lanes, 4)
    type(block_t) :: block
    type(point_context_t) :: context
    integer :: i
    logical :: is_direct, ok

    call clear_rows(tile, force, border)
    if (patch%has_context) then
      context = new_point_context(n_lanes*patch%axes(3)%n_points, patch%n_fields)
      call set_clock(patch, context)
    end if
    do i = 1, n_blocks_of(patch, tile)
      call next_block(patch, tile, block)
      is_direct = takes_fields(patch, block)
      if (.not. is_direct) then
        call gather_motion(patch, block, dt, x, v, u, w)
      else if (patch%is_rational) then
        call gather_weights(patch, block, w)
      end if
      if (patch%has_context) then
        call set_lanes(patch, [block], context)
        call run_context_kernel(patch, law, block, dt, is_direct, x, v, w, u, context, f, sums, &
                                ok)
      else
        call run_kernel(patch, law, block, dt, is_direct, x, v, w, u, f, sums, ok)
      end if
      call add_forces(patch, tile, block, w, f, force, border)
      call add_report(report, sums, ok, block)
    end do
  end subroutine forces_of_tile

  !> No forces yet on the rows of a tile and in its buffer.
  pure subroutine clear_rows(tile, force, border)
    type(tile_t), intent(in) :: tile
    real(wp), intent(inout), contiguous :: force(:, :, :, :), border(:, :, :, :)

    force(:, tile%control_first(2):tile%own_last, :, :) = 0.0_wp
    border = 0.0_wp
  end subroutine clear_rows

  !> Positions of a block and, where there is room for it, half of its motion in the step,
  !! multiplied by the weights of a rational patch.
  subroutine gather_motion(patch, block, dt, x, v, u, w)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(inout) :: u(:, :)
    real(wp), intent(inout) :: w(:)        !! the weights, where there are any

    call gather_field(patch, block, 3, 1.0_wp, x, u)
    if (size(u, 2) == 6) call gather_field(patch, block, 3, 0.5_wp*dt, v, u(:, 4:))
    if (patch%is_rational) then
      call gather_weights(patch, block, w)
      call weigh_block(size(u, 1), size(u, 2), w, u)
    end if
  end subroutine gather_motion

  !> Weights of the control points of a block of a rational patch.
  subroutine gather_weights(patch, block, w)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    real(wp), intent(inout) :: w(:)

    call gather_field(patch, block, 1, 1.0_wp, patch%weights, w)
  end subroutine gather_weights

  !> Fields at the control points of a block, times a factor.
  subroutine gather_field(patch, block, n_fields, factor, field, u)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: n_fields
    real(wp), intent(in) :: factor, field(*)
    real(wp), intent(inout) :: u(*)

    call gather_block(patch%axes%degree, patch%n_control, n_fields, patch%lanes%is_contiguous( &
                      block%b), patch%lanes%first(:, block%b), patch%axes(2)%first(block%e2), &
                      patch%axes(3)%first(block%e3), factor, field, u)
  end subroutine gather_field

  !> Add the forces of a block, or other fields, to those of its tile.
  subroutine add_forces(patch, tile, block, w, f, force, border)
    type(solid_patch_t), intent(in) :: patch
    type(tile_t), intent(in) :: tile
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: w(:)           !! weights to multiply by, where there are any
    real(wp), intent(inout) :: f(:, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :), border(:, :, :, :)
    integer :: p(3), first(n_lanes), i2, i3, n_rows, n_own

    if (size(w) > 0) call weigh_block(size(f, 1), size(f, 2), w, f)
    p = patch%axes%degree
    first = patch%lanes%first(:, block%b)
    i2 = patch%axes(2)%first(block%e2)
    i3 = patch%axes(3)%first(block%e3)
    n_rows = p(2) + 1
    n_own = min(n_rows, tile%own_last - i2 + 1)
    associate (is_contiguous => patch%lanes%is_contiguous(block%b), n => patch%n_control)
      if (n_own > 0) call add_block(p, size(f, 2), [1, 1], n(:2), n(3), [1, n_own], &
                                    is_contiguous, first, i2, i3, f, force)
      if (n_own < n_rows) &
        call add_block(p, size(f, 2), [tile%control_first(1), tile%own_last + 1], &
                       tile%control_last, n(3), [max(1, n_own + 1), n_rows], is_contiguous, &
                       first, i2, i3, f, border)
    end associate
  end subroutine add_forces

  !> Sums of a block into the report of its tile.
  pure subroutine add_report(report, sums, ok, block)
    type(force_report_t), intent(inout) :: report
    real(wp), intent(in) :: sums(n_lanes, 4)
    logical, intent(in) :: ok
    type(block_t), intent(in) :: block
    logical :: is_sound

    report%internal_work = report%internal_work + sum(sums(:, 1))
    report%viscous_work = report%viscous_work + sum(sums(:, 2))
    report%largest_rate = max(report%largest_rate, maxval(sums(:, 3)))
    report%smallest_det = min(report%smallest_det, minval(sums(:, 4)))
    ! Written so that a NaN counts as unsound.
    is_sound = ok .and. minval(sums(:, 4)) > 0.0_wp .and. all(abs(sums(:, 1)) < huge(1.0_wp))
    if (.not. is_sound) report%failed_block = min(report%failed_block, block%number)
  end subroutine add_report

end module solid_forces
