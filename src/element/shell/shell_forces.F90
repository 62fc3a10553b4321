!> Internal forces of a patch of shells: tiles in parallel, each block by its kernel instance.
module shell_forces
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use bulk_viscosity, only: viscous_factors, bending_factors
  use element, only: force_report_t
  use solid_patch, only: solid_patch_t, shell_points_t, tile_t, tile_buffer_t, block_t, block_at, &
                         n_blocks_of, next_block, cut_number
  use kernel_dispatch, only: instance_of
  use tile_exchange, only: complete_tiles
  use tile_shares, only: begin_tile, end_tile
  use shell_context, only: placed_law_t, new_placed_law, place_block
  use solid_forces, only: gather_motion, add_forces, clear_rows, add_report, add_tiles, &
                          finish_evaluation, add_increment
  use through_thickness, only: through_fields_t, normal_at_points, add_values
#include "kl_shell_uses.inc"
#include "kl_metric_uses.inc"
#include "kl_cut_uses.inc"
#include "kl_cutmetric_uses.inc"
  implicit none
  private

  public :: forces_of_shell, begin_shell_forces, run_shell, run_placed, set_metric, &
            set_metric_of_block
  public :: shell_kernel_of, shell_kernel_name

  !> Degrees and points of the tuned instances, as in `kernel_dispatch`.
#include "shell_rules.inc"

contains

  !> Number of the kernel instance that serves these degrees and points.
  pure integer function shell_kernel_of(degrees, n_points, is_rational) result(kernel)
    integer, intent(in) :: degrees(3), n_points(3)
    logical, intent(in) :: is_rational

    kernel = instance_of(tuned_rules, degrees, n_points, is_rational)
  end function shell_kernel_of

  !> Name of a kernel instance for the log, such as `p22_q226_shell`.
  pure function shell_kernel_name(kernel) result(name)
    integer, intent(in) :: kernel
    character(:), allocatable :: name
    character(8) :: code

    name = "general"
    if (kernel <= 2*size(tuned_rules, 2)) then
      write (code, "('p', 2i1, '_q', 3i1)") tuned_rules([1, 2, 4, 5, 6], (kernel + 1)/2)
      name = code
    end if
    if (mod(kernel, 2) == 0) name = name//"_rational"
    name = name//"_shell"
  end function shell_kernel_name

  !> Stress update and internal forces at positions x; arguments as of `internal_forces`.
  subroutine forces_of_shell(patch, points, buffers, fields, law, dt, x, force, report)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    type(tile_buffer_t), intent(inout) :: buffers(:)
    type(through_fields_t), intent(inout) :: fields
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(out) :: report
    type(force_report_t) :: reports(size(buffers))

    !$omp parallel default(shared) if (.not. law%is_serial)
    call work_tiles(patch, points, buffers, fields, law, dt, x, force, reports)
    if (fields%is_watched) then
      call complete_tiles(patch, reports, buffers, force, fields%buffers, fields%sums)
      call add_tiles(patch, fields%buffers, fields%sums)
    else
      call complete_tiles(patch, reports, buffers, force)
    end if
    call add_tiles(patch, buffers, force)
    !$omp end parallel
    call finish_evaluation(patch, dt, reports, report)
  end subroutine forces_of_shell

  !> The first half of the same: the own tiles alone, whose forces `end_forces` adds up when those
  !! of other processes are there.
  subroutine begin_shell_forces(patch, points, buffers, fields, law, dt, x, force, reports)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    type(tile_buffer_t), intent(inout) :: buffers(:)
    type(through_fields_t), intent(inout) :: fields
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(inout) :: reports(:)   !! of the tiles

    !$omp parallel default(shared) if (.not. law%is_serial)
    call work_tiles(patch, points, buffers, fields, law, dt, x, force, reports)
    !$omp end parallel
    call add_increment(patch, dt)
  end subroutine begin_shell_forces

  !> The tiles that are worked here, shared by the threads of a region.
  subroutine work_tiles(patch, points, buffers, fields, law, dt, x, force, reports)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    type(tile_buffer_t), intent(inout) :: buffers(:)
    type(through_fields_t), intent(inout) :: fields
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(inout) :: reports(:)
    integer :: t

    !$omp do schedule(static)
    do t = patch%shares%first, patch%shares%last
      call begin_tile(patch%shares, t)
      call forces_of_tile(patch, points, fields, law, t, dt, x, force, buffers(t)%force, &
                          reports(t))
      call end_tile(patch%shares, t)
    end do
    !$omp end do
  end subroutine work_tiles

  !> The blocks of one tile.
  subroutine forces_of_tile(patch, points, fields, law, number, dt, x, force, border, report)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    type(through_fields_t), intent(inout) :: fields
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: number             !! of the tile
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :), border(:, :, :, :)
    type(force_report_t), intent(out) :: report
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 3), f(size(u, 1), 3)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), sums(n_lanes, 4)
    real(wp) :: normal_end(n_lanes, 2, size(points%normal, 3))
    type(placed_law_t) :: placed
    type(block_t) :: block
    type(tile_t) :: tile
    integer :: i
    logical :: ok

    tile = patch%tiles(number)
    call clear_rows(tile, force, border)
    if (fields%is_watched) call clear_rows(tile, fields%sums, fields%buffers(number)%force)
    normal_end = 0.0_wp
    if (law%needs_context) call new_placed_law(placed, patch, law)
    do i = 1, n_blocks_of(patch, tile)
      call next_block(patch, tile, block)
      call gather_motion(patch, block, dt, x, x, u, w)
      if (fields%is_pressed) call normal_at_points(patch, points, block, w, fields%normal, &
                                                   normal_end)
      if (law%needs_context) then
        call run_placed(patch, points, placed, block, dt, normal_end, u, f, sums, ok)
      else
        call run_shell(patch, points, law, block, dt, normal_end, u, f, sums, ok)
      end if
      call add_forces(patch, tile, block, w, f, force, border)
      if (fields%is_watched) call add_values(patch, points, tile, block, w, &
                                             points%thickness(:, :, block%number), fields%sums, &
                                             fields%buffers(number)%force)
      call add_report(report, sums, ok, block)
    end do
  end subroutine forces_of_tile

  !> The same as `run_shell` of a law with the context of its points.
  subroutine run_placed(patch, points, placed, block, dt, normal_end, u, f, sums, ok)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    type(placed_law_t), intent(inout) :: placed
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: normal_end(:, :, :)
    real(wp), intent(in) :: u(*)
    real(wp), intent(inout) :: f(*)
    real(wp), intent(out) :: sums(n_lanes, 4)
    logical, intent(out) :: ok
    real(wp) :: metric(n_lanes, 6, patch%together)

    call find_metric(patch, points, block, u, metric)
    call place_block(patch, points, block, u, metric, placed)
    call run_shell(patch, points, placed, block, dt, normal_end, u, f, sums, ok)
    associate (stretch => points%stretch(:, :, :, block%number))
      stretch = stretch + points%through(:, :, :, block%number)
    end associate
  end subroutine run_placed

  !> Stress update and forces of a block.
  subroutine run_shell(patch, points, law, block, dt, normal_end, u, f, sums, ok)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: normal_end(:, :, :)   !! normal stress of the end,
                                                               !! shape (8, 2, q1*q2)
    real(wp), intent(in) :: u(*)
    real(wp), intent(inout) :: f(*)
    real(wp), intent(out) :: sums(n_lanes, 4)
    logical, intent(out) :: ok
    real(wp) :: viscous(n_lanes, 3)
    integer :: p(3), q(3), n_viscous, cut
    logical :: is_pressed, stays

    viscous(:, :2) = viscous_factors(patch%viscosity, block%number, dt)
    n_viscous = merge(size(patch%push, 2), 0, patch%viscosity%is_active)
    if (n_viscous > 1) viscous(:, 3) = bending_factors(patch%viscosity, block%number, dt)
    stays = largest_size(size(normal_end), normal_end) > 0.0_wp
    is_pressed = stays .or. points%is_pressed(block%number)
    points%is_pressed(block%number) = stays
    p = patch%axes%degree
    q = patch%axes%n_points
    cut = cut_number(patch, block)
    if (cut > 0) then
      select case (instance_of(cut_rules, [p(:2), 0], [q(1)*q(2), 1, q(3)], patch%is_rational))
#include "kl_cut_cases.inc"
      end select
      return
    end if
    select case (points%kernel)
#include "kl_shell_cases.inc"
    end select
  end subroutine run_shell

  !> Largest of some numbers without their signs.
  pure real(wp) function largest_size(n, values) result(largest)
    integer, intent(in) :: n
    real(wp), intent(in) :: values(n)
    integer :: i

    largest = 0.0_wp
    !$omp simd reduction(max: largest)
    do i = 1, n
      largest = max(largest, abs(values(i)))
    end do
  end function largest_size

  !> Take the fundamental forms of a shape.
  subroutine set_metric(patch, points, x)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(inout) :: points
    real(wp), intent(in), contiguous :: x(:, :, :, :)   !! control points (n1, n2, 1, 3) [length]
    integer :: i

    do i = 1, patch%n_blocks
      call set_metric_of_block(patch, points, block_at(patch, i), x)
    end do
  end subroutine set_metric

  !> Of the elements of a block.
  subroutine set_metric_of_block(patch, points, block, x)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(inout) :: points
    type(block_t), intent(in) :: block
    real(wp), intent(in), contiguous :: x(:, :, :, :)
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 3)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), metric(n_lanes, 6, patch%together)

    call gather_motion(patch, block, 0.0_wp, x, x, u, w)
    call find_metric(patch, points, block, u, metric)
    points%metric(:, :, :, block%number) = metric
  end subroutine set_metric_of_block

  !> Fundamental forms of a block at the positions u.
  subroutine find_metric(patch, points, block, u, metric)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: u(*)
    real(wp), intent(out) :: metric(n_lanes, 6, *)
    integer :: p(3), q(3), cut

    p = patch%axes%degree
    q = patch%axes%n_points
    cut = cut_number(patch, block)
    if (cut > 0) then
      select case (instance_of(cut_rules, [p(:2), 0], [q(1)*q(2), 1, q(3)], patch%is_rational))
#include "kl_cutmetric_cases.inc"
      end select
      return
    end if
    select case (points%kernel)
#include "kl_metric_cases.inc"
    end select
  end subroutine find_metric

end module shell_forces
