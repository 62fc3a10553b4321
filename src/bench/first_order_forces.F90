!> The force routine with kinematics of first order: tiles, gathering, law and adding up are the
!! solver's own, the kernel is the solver's source compiled with FIRST_ORDER. This file is compiled
!! without a limit of line length.
module first_order_forces
  use kinds, only: wp
  use errors, only: error_t, fail
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t, tile_t, tile_buffer_t, force_report_t
  use kernel_dispatch, only: kernel_name
  use internal_force, only: add_tiles
  use tile_forces, only: gather_motion, add_forces, add_report
  use first_order_p222_q222, only: p222_q222 => block_forces
  use first_order_p222_q223, only: p222_q223 => block_forces
  use first_order_p222_q333, only: p222_q333 => block_forces
  use first_order_p222_q222_rational, only: p222_q222_rational => block_forces
  use first_order_p222_q223_rational, only: p222_q223_rational => block_forces
  use first_order_p222_q333_rational, only: p222_q333_rational => block_forces
  implicit none
  private

  public :: forces_of_first_order, check_instance

  !> What this module has an instance for, by the names of the solver's.
  character(18), parameter :: instances(6) = [character(18) :: "p222_q222", "p222_q223", &
    "p222_q333", "p222_q222_rational", "p222_q223_rational", "p222_q333_rational"]

contains

  !> Is there an instance for the degrees and points of a patch?
  subroutine check_instance(patch, error)
    type(ig_patch_t), intent(in) :: patch
    type(error_t), allocatable, intent(out) :: error

    if (.not. any(instances == kernel_name(patch%kernel))) &
      call fail(error, "no instance of first order for "//kernel_name(patch%kernel))
  end subroutine check_instance

  !> Stress update and internal forces, without viscosity; arguments as of `internal_forces`.
  subroutine forces_of_first_order(patch, buffers, law, dt, x, v, force, report)
    type(ig_patch_t), intent(inout) :: patch            !! one that `check_instance` let pass
    type(tile_buffer_t), intent(inout) :: buffers(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(out) :: force(:, :, :, :)
    type(force_report_t), intent(out) :: report
    type(force_report_t) :: reports(size(buffers))
    integer :: t

    !$omp parallel do schedule(static) default(shared) private(t)
    do t = 1, size(buffers)
      call forces_of_tile(patch, law, patch%tiles(t), dt, x, v, buffers(t)%force, reports(t))
    end do
    !$omp end parallel do
    call add_tiles(patch, buffers, force)
    do t = 1, size(buffers)
      report%internal_work = report%internal_work + reports(t)%internal_work
      report%failed_block = min(report%failed_block, reports(t)%failed_block)
    end do
  end subroutine forces_of_first_order

  subroutine forces_of_tile(patch, law, tile, dt, x, v, force, report)
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(tile_t), intent(in) :: tile
    real(wp), intent(in) :: dt, x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(out) :: force(tile%control_first(1):tile%control_last(1), &
                                   tile%control_first(2):tile%control_last(2), &
                                   patch%n_control(3), 3)
    type(force_report_t), intent(out) :: report
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6), f(size(u, 1), 3)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), sums(n_lanes, 4)
    integer :: e2, e3, b, block, instance
    logical :: ok

    instance = findloc(instances == kernel_name(patch%kernel), .true., dim=1)
    force = 0.0_wp
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = tile%row_first, tile%row_last
        do b = tile%block_first, tile%block_last
          block = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
          call gather_motion(patch, b, e2, e3, x, v, u, w)
          call run_instance(instance, patch, law, b, e2, e3, block, dt, u, f, sums, ok)
          call add_forces(patch, tile, b, e2, e3, w, f, force)
          call add_report(report, sums, ok, block)
        end do
      end do
    end do
  end subroutine forces_of_tile

! Arrays go by their first elements, as in kernel_dispatch.
#define HEAD law, dt, .false., viscous, u, patch%lanes%values(1, 1, 1, b), \
  patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), \
  patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, \
  patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights
#define TAIL patch%stress(1, 1, 1, 1, block), patch%state(1, 1, 1, 1, block), patch%push, \
  f, sums, ok
#define WEIGHTS patch%rational(1, 1, 1, 1, block)

  subroutine run_instance(instance, patch, law, b, e2, e3, block, dt, u, f, sums, ok)
    integer, intent(in) :: instance
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: b, e2, e3, block
    real(wp), intent(in) :: dt, u(*)
    real(wp), intent(inout) :: f(*)
    real(wp), intent(out) :: sums(n_lanes, 4)
    logical, intent(out) :: ok
    real(wp), parameter :: viscous(n_lanes, 2) = 0.0_wp

    select case (instance)
    case (1)
      call p222_q222(HEAD, TAIL)
    case (2)
      call p222_q223(HEAD, TAIL)
    case (3)
      call p222_q333(HEAD, TAIL)
    case (4)
      call p222_q222_rational(HEAD, WEIGHTS, TAIL)
    case (5)
      call p222_q223_rational(HEAD, WEIGHTS, TAIL)
    case default
      call p222_q333_rational(HEAD, WEIGHTS, TAIL)
    end select
  end subroutine run_instance

end module first_order_forces
