!> From a patch to the instance of the block kernel that serves it. This file is compiled without
!! a limit of line length: every instance takes the same arrays, which one macro lists.
module kernel_dispatch
  use kinds, only: wp
  use block_law, only: block_law_t
  use point_context, only: point_context_t
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t, viscosity_t
  use ig_solid_p222_q222, only: p222_q222 => block_forces
  use ig_solid_p222_q223, only: p222_q223 => block_forces
  use ig_solid_p222_q226, only: p222_q226 => block_forces
  use ig_solid_p222_q333, only: p222_q333 => block_forces
  use ig_solid_p222_q222_rational, only: p222_q222_rational => block_forces
  use ig_solid_p222_q223_rational, only: p222_q223_rational => block_forces
  use ig_solid_p222_q226_rational, only: p222_q226_rational => block_forces
  use ig_solid_p222_q333_rational, only: p222_q333_rational => block_forces
  use ig_solid_general, only: general => block_forces
  use ig_solid_general_rational, only: general_rational => block_forces
  use ig_solid_general_context, only: general_context => block_forces
  implicit none
  private

  public :: kernel_of, kernel_name, run_kernel, viscous_factors

  !> Degrees and points of the tuned instances: kernel 2k - 1 serves column k, kernel 2k the same
  !! with weights. Behind the table: general, general with weights, general with context.
  integer, parameter :: tuned(6, 4) = reshape([2, 2, 2, 2, 2, 2, &
                                               2, 2, 2, 2, 2, 3, &
                                               2, 2, 2, 2, 2, 6, &
                                               2, 2, 2, 3, 3, 3], [6, 4])
  integer, parameter :: context_kernel = 2*size(tuned, 2) + 3

contains

  !> Number of the kernel instance that serves these degrees and points.
  pure integer function kernel_of(degrees, n_points, is_rational, needs_context) result(kernel)
    integer, intent(in) :: degrees(3), n_points(3)
    logical, intent(in) :: is_rational
    logical, intent(in) :: needs_context   !! of the law: kinematics for each point
    integer :: column

    do column = 1, size(tuned, 2)
      if (all(tuned(:, column) == [degrees, n_points])) exit
    end do
    kernel = 2*column - merge(0, 1, is_rational)
    if (needs_context) kernel = context_kernel
  end function kernel_of

  !> Name of a kernel instance for the log, such as `p222_q226_rational`.
  pure function kernel_name(kernel) result(name)
    integer, intent(in) :: kernel   !! from `kernel_of`
    character(:), allocatable :: name
    character(9) :: code

    name = "general"
    if (kernel == context_kernel) then
      name = "general_context"
      return
    end if
    if (kernel <= 2*size(tuned, 2)) then
      write (code, "('p', 3i1, '_q', 3i1)") tuned(:, (kernel + 1)/2)
      name = code
    end if
    if (mod(kernel, 2) == 0) name = name//"_rational"
  end function kernel_name

! Arrays go by their first elements, so that no descriptor is looked at twice.
#define HEAD law, dt, on, viscous, u, patch%lanes%values(1, 1, 1, b), \
  patch%lanes%slopes(1, 1, 1, b), patch%lanes%weights(1, 1, b), \
  patch%axes(2)%values(1, 1, e2), patch%axes(2)%slopes(1, 1, e2), patch%axes(2)%weights, \
  patch%axes(3)%values(1, 1, e3), patch%axes(3)%slopes(1, 1, e3), patch%axes(3)%weights
#define TAIL patch%stress(1, 1, 1, 1, block), patch%state(1, 1, 1, 1, block), \
  patch%push(1, 1, 1, min(block, size(patch%push, 4))), f, sums, ok
#define WEIGHTS patch%rational(1, 1, 1, 1, block)
#define COUNTS p(1), p(2), p(3), q(1), q(2), q(3)

  !> Stress update and forces of block `b` of the row (e2, e3): number `block` of the patch.
  subroutine run_kernel(patch, law, b, e2, e3, block, dt, u, context, f, sums, ok)
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: b, e2, e3, block
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: u(*)                        !! gathered positions and velocities
    type(point_context_t), intent(inout) :: context     !! used by the context kernel alone
    real(wp), intent(inout) :: f(*)                     !! internal forces of the block
    real(wp), intent(out) :: sums(n_lanes, 4)           !! see block_forces
    logical, intent(out) :: ok
    real(wp) :: viscous(n_lanes, 2)
    logical :: on
    integer :: p(3), q(3)

    on = patch%viscosity%is_active
    viscous = viscous_factors(patch%viscosity, block, dt)
    p = patch%axes%degree
    q = patch%axes%n_points
    select case (patch%kernel)
    case (1)
      call p222_q222(HEAD, TAIL)
    case (2)
      call p222_q222_rational(HEAD, WEIGHTS, TAIL)
    case (3)
      call p222_q223(HEAD, TAIL)
    case (4)
      call p222_q223_rational(HEAD, WEIGHTS, TAIL)
    case (5)
      call p222_q226(HEAD, TAIL)
    case (6)
      call p222_q226_rational(HEAD, WEIGHTS, TAIL)
    case (7)
      call p222_q333(HEAD, TAIL)
    case (8)
      call p222_q333_rational(HEAD, WEIGHTS, TAIL)
    case (9)
      call general(COUNTS, HEAD, TAIL)
    case (10)
      call general_rational(COUNTS, HEAD, WEIGHTS, TAIL)
    case default
      call general_context(COUNTS, HEAD, WEIGHTS, context, patch%reference(1, 1, 1, 1, block), TAIL)
    end select
  end subroutine run_kernel

  !> Viscous stress per volume strain of a step (linear, quadratic) for the lanes of a block.
  pure function viscous_factors(viscosity, block, dt) result(factors)
    type(viscosity_t), intent(in) :: viscosity
    integer, intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp) :: factors(n_lanes, 2)

    factors = 0.0_wp
    if (.not. viscosity%is_active) return
    associate (length => viscosity%length(:, block))
      factors(:, 1) = viscosity%linear*viscosity%density*viscosity%wave_speed*length/dt
      factors(:, 2) = viscosity%density*(viscosity%quadratic*length/dt)**2
    end associate
  end function viscous_factors

end module kernel_dispatch
