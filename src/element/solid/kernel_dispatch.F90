!> From a patch to the instance of the block kernel that serves it. The tuned instances are
!! those of the list in `generate_kernels.py`, which writes the included statements.
module kernel_dispatch
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use bulk_viscosity, only: viscous_factors
  use point_context, only: point_context_t
  use solid_patch, only: solid_patch_t, block_t, cut_number
#include "ig_solid_uses.inc"
#include "ig_cut_uses.inc"
#include "ig_contextforce_uses.inc"
  implicit none
  private

  public :: instance_of, kernel_of, rows_of, kernel_name, run_kernel, run_context_kernel
  public :: takes_fields, tuned_rules

  !> Degrees and points of the tuned instances: kernel 2k - 1 serves column k, kernel 2k the same
  !! with weights. Behind the table: general, general with weights.
#include "ig_solid_rules.inc"

contains

  !> Number of the kernel instance that serves these degrees and points.
  pure integer function kernel_of(degrees, n_points, is_rational) result(kernel)
    integer, intent(in) :: degrees(3), n_points(3)
    logical, intent(in) :: is_rational

    kernel = instance_of(tuned_rules, degrees, n_points, is_rational)
  end function kernel_of

  !> Number of the instance among those of a table, in the order of `tuned_rules`.
  pure integer function instance_of(rules, degrees, n_points, is_rational) result(instance)
    integer, intent(in) :: rules(:, :), degrees(3), n_points(3)
    logical, intent(in) :: is_rational
    integer :: column

    do column = 1, size(rules, 2)
      if (all(rules(:, column) == [degrees, n_points])) exit
    end do
    instance = 2*column - merge(0, 1, is_rational)
  end function instance_of

  !> Rows of points that a kernel instance works together, see `solid_patch_t`.
  pure integer function rows_of(kernel) result(rows)
    integer, intent(in) :: kernel          !! from `kernel_of`

    rows = 1
    if (kernel <= 2*size(tuned_rows)) rows = tuned_rows((kernel + 1)/2)
  end function rows_of

  !> Name of a kernel instance for the log, such as `p222_q226_rational`.
  pure function kernel_name(kernel, has_context) result(name)
    integer, intent(in) :: kernel          !! from `kernel_of`
    logical, intent(in) :: has_context     !! see `solid_patch_t`
    character(:), allocatable :: name
    character(9) :: code

    name = "general"
    if (kernel <= 2*size(tuned_rules, 2)) then
      write (code, "('p', 3i1, '_q', 3i1)") tuned_rules(:, (kernel + 1)/2)
      name = code
    end if
    if (mod(kernel, 2) == 0) name = name//"_rational"
    if (has_context) name = name//"_context"
  end function kernel_name

  !> Stress update and forces of a block.
  subroutine run_kernel(patch, law, block, dt, is_direct, x, v, w, u, f, sums, ok)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    logical, intent(in) :: is_direct                    !! only where `takes_fields`
    real(wp), intent(in) :: x(*), v(*)                  !! fields of the patch
    real(wp), intent(in) :: w(*)                        !! weights of the block, if rational
    real(wp), intent(in) :: u(*)                        !! from gather_motion, unless direct
    real(wp), intent(inout) :: f(*)                     !! internal forces of the block
    real(wp), intent(out) :: sums(n_lanes, 4)           !! see block_forces
    logical, intent(out) :: ok
    real(wp) :: viscous(n_lanes, 2)
    logical :: on
    integer :: p(3), q(3), first(3), cut

    first = [patch%lanes%first(1, block%b), patch%axes(2)%first(block%e2), &
             patch%axes(3)%first(block%e3)]
    on = patch%viscosity%is_active
    viscous = viscous_factors(patch%viscosity, block%number, dt)
    p = patch%axes%degree
    q = patch%axes%n_points
    cut = cut_number(patch, block)
    if (cut > 0) then
      select case (patch%kernel)
#include "ig_cut_cases.inc"
      end select
      return
    end if
    select case (patch%kernel)
#include "ig_solid_cases.inc"
    end select
  end subroutine run_kernel

  !> The same with the context of the points for the law, which rotates no stress itself; of a block
  !! that no outline cuts.
  subroutine run_context_kernel(patch, law, block, dt, is_direct, x, v, w, u, context, f, sums, ok)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    logical, intent(in) :: is_direct
    real(wp), intent(in) :: x(*), v(*), w(*), u(*)
    type(point_context_t), intent(inout) :: context     !! of a row, from `set_lanes`
    real(wp), intent(inout) :: f(*)
    real(wp), intent(out) :: sums(n_lanes, 4)
    logical, intent(out) :: ok
    real(wp) :: viscous(n_lanes, 2)
    real(wp) :: given(size(patch%stress, 2)*size(patch%stress, 4)*n_lanes*2*patch%n_fields)
    logical :: on
    integer :: p(3), q(3), first(3)

    first = [patch%lanes%first(1, block%b), patch%axes(2)%first(block%e2), &
             patch%axes(3)%first(block%e3)]
    on = patch%viscosity%is_active
    viscous = viscous_factors(patch%viscosity, block%number, dt)
    p = patch%axes%degree
    q = patch%axes%n_points
    if (patch%n_fields > 0) given = reshape(patch%given(:, :, :, :, block%number), [size(given)])
    select case (patch%kernel)
#include "ig_contextforce_cases.inc"
    end select
  end subroutine run_context_kernel

  !> Does the kernel take positions and velocities of a block straight from the fields of the patch,
  !! not gathered? The tuned ones do, where the control points of lanes follow each other, but not
  !! those of elements that an outline cuts.
  pure logical function takes_fields(patch, block)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block

    takes_fields = patch%kernel <= 2*size(tuned_rules, 2) &
                   .and. patch%lanes%is_contiguous(block%b) .and. cut_number(patch, block) == 0
  end function takes_fields

end module kernel_dispatch
