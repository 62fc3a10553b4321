!> The force routine with kinematics of first order: loop over the blocks, law and adding up are the
!! solver's own, the kernel is the solver's source compiled with FIRST_ORDER. This file is compiled
!! without a limit of line length.
module first_order_forces
  use kinds, only: wp
  use errors, only: error_t, fail
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use element, only: force_report_t
  use ig_patch, only: ig_patch_t, tile_buffer_t
  use kernel_dispatch, only: kernel_name, takes_fields
  use internal_force, only: add_tiles
  use tile_forces, only: work_tile
  use point_context, only: point_context_t
  use point_fields, only: point_fields_t
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
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(inout), contiguous :: force(:, :, :, :)
    type(force_report_t), intent(out) :: report
    type(force_report_t) :: reports(size(buffers))
    integer :: t

    !$omp parallel do schedule(static) default(shared) private(t)
    do t = 1, size(buffers)
      call work_tile(patch, law, patch%tiles(t), dt, x, v, run_instance, force, &
                     buffers(t)%force, reports(t))
    end do
    !$omp end parallel do
    call add_tiles(patch, buffers, force)
    do t = 1, size(buffers)
      report%internal_work = report%internal_work + reports(t)%internal_work
      report%failed_block = min(report%failed_block, reports(t)%failed_block)
    end do
  end subroutine forces_of_first_order

! Arrays go by their first elements, as in kernel_dispatch.
#define HEAD law, dt, .false., viscous, u, AXES
#define DIRECT_HEAD law, dt, .false., viscous, takes_fields(patch, b), patch%n_control, first, \
  x, v, u, AXES
#define AXES patch%lanes%values(1, 1, 1, b), \
  patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), \
  patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, \
  patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights
#define TAIL patch%stress(1, 1, 1, 1, block), patch%state(1, 1, 1, 1, block), patch%push, \
  f, sums, ok
#define WEIGHTS patch%rational(1, 1, 1, 1, block)

  subroutine run_instance(patch, law, b, e2, e3, block, dt, x, v, u, context, fields, f, sums, ok)
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: b, e2, e3, block
    real(wp), intent(in) :: dt, x(*), v(*), u(*)
    type(point_context_t), intent(inout) :: context
    type(point_fields_t), intent(inout) :: fields
    real(wp), intent(inout) :: f(*)
    real(wp), intent(out) :: sums(n_lanes, 4)
    logical, intent(out) :: ok
    real(wp), parameter :: viscous(n_lanes, 2) = 0.0_wp
    integer :: first(3)

    first = [patch%lanes%first(1, b), patch%axes(2)%first(e2), patch%axes(3)%first(e3)]
    associate (points => dot_product(patch%axes%n_points, [100, 10, 1]))
      select case (merge(-points, points, patch%is_rational))
      case (222)
        call p222_q222(DIRECT_HEAD, TAIL)
      case (223)
        call p222_q223(DIRECT_HEAD, TAIL)
      case (333)
        call p222_q333(DIRECT_HEAD, TAIL)
      case (-222)
        call p222_q222_rational(HEAD, WEIGHTS, TAIL)
      case (-223)
        call p222_q223_rational(HEAD, WEIGHTS, TAIL)
      case default
        call p222_q333_rational(HEAD, WEIGHTS, TAIL)
      end select
    end associate
  end subroutine run_instance

end module first_order_forces
