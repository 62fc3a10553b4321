!> From a patch in plane strain to the instance of its block kernel.
module plane_dispatch
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t
  use plane_strain_data, only: plane_strain_t
  use kernel_dispatch, only: viscous_factors
#include "plane_strain_uses.inc"
  implicit none
  private

  public :: plane_kernel_of, plane_kernel_name, run_plane

  !> Degrees and points along axes 1 and 3 of the tuned instances; the general one is behind them.
#include "plane_strain_rules.inc"

contains

  !> Number of the kernel instance that serves these degrees and points.
  pure integer function plane_kernel_of(degrees, n_points) result(kernel)
    integer, intent(in) :: degrees(3), n_points(3)

    do kernel = 1, size(tuned_rules, 2)
      if (all(tuned_rules(:, kernel) == [degrees([1, 3]), n_points([1, 3])])) exit
    end do
  end function plane_kernel_of

  !> Name of a kernel instance for the log, such as `p212_q214_plane_strain`.
  pure function plane_kernel_name(kernel) result(name)
    integer, intent(in) :: kernel   !! from `plane_kernel_of`
    character(:), allocatable :: name
    character(9) :: code

    name = "general_plane_strain"
    if (kernel > size(tuned_rules, 2)) return
    write (code, "('p', i1, '1', i1, '_q', i1, '1', i1)") tuned_rules(:, kernel)
    name = code//"_plane_strain"
  end function plane_kernel_name

  !> Stress update and forces of block `b` of the row e3: number `block` of the patch.
  subroutine run_plane(patch, plane, law, b, e3, block, dt, x, v, motion, lower, upper, side, &
                       sums, ok)
    type(ig_patch_t), intent(inout) :: patch
    type(plane_strain_t), intent(in) :: plane
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: b, e3, block
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: x(*), v(*)                  !! of the patch
    real(wp), intent(inout) :: motion(*)                !! zero at the start, see block_forces
    integer, intent(in) :: lower, upper                 !! control points along axis 1 of `side`
    real(wp), intent(inout) :: side(*)                  !! forces on it
    real(wp), intent(out) :: sums(n_lanes, 4)           !! see block_forces
    logical, intent(out) :: ok
    real(wp) :: viscous(n_lanes, 2)

    viscous = viscous_factors(patch%viscosity, block, dt)
    associate (p => patch%axes%degree, q => patch%axes%n_points)
      select case (plane%kernel)
#include "plane_strain_cases.inc"
      end select
    end associate
  end subroutine run_plane

end module plane_dispatch
