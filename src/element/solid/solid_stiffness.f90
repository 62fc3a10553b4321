!> Stiffness of the elements of blocks: central differences of their forces by the displacements of
!! their own control points, eight elements side by side. Stress and state are left as they are.
module solid_stiffness
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use solid_patch, only: solid_patch_t, block_t, block_at, element_of_lane
  use block_gather, only: weigh_block
  use kernel_dispatch, only: run_kernel
  use solid_forces, only: gather_motion
  implicit none
  private

  public :: stiffness_of_solids, owned_elements, move_column, move_motion, add_column
  public :: keep_block, put_back_block

  !> What an evaluation changes at the points of a block.
  type, public :: kept_block_t
    real(wp), allocatable, dimension(:, :, :, :) :: stress, state
    real(wp), allocatable :: push(:, :, :)
  end type kept_block_t

contains

  !> Stiffness of the elements of several blocks: of the internal forces at the end of the motion of
  !! an increment by displacements there. Rows and columns are components of the control points of
  !! an element, axis 1 of the grid first and the component last.
  subroutine stiffness_of_solids(patch, law, dt, amount, x, v, first, elements, matrices)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                          !! of the increment [time]
    real(wp), intent(in) :: amount                      !! displacement of the differences [length]
    real(wp), intent(in), contiguous :: x(:, :, :, :)   !! control points at its end
    real(wp), intent(in), contiguous :: v(:, :, :, :)   !! velocities
    integer, intent(in) :: first                        !! block; as many follow as there is room
    integer, intent(out) :: elements(:, :, :)           !! (3, 8, blocks), 0: repeats another
    real(wp), intent(out) :: matrices(:, :, :, :)       !! (8, m, m, blocks) [force/length]
    integer :: b

    !$omp parallel do schedule(static) if (.not. law%is_serial)
    do b = 1, size(matrices, 4)
      elements(:, :, b) = owned_elements(patch, first + b - 1)
      call difference_block(patch, law, block_at(patch, first + b - 1), dt, amount, x, v, &
                            matrices(:, :, :, b))
    end do
    !$omp end parallel do
  end subroutine stiffness_of_solids

  !> The elements of the lanes of a block that count, 0 for others.
  pure function owned_elements(patch, number) result(elements)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: number
    integer :: elements(3, n_lanes), lane
    type(block_t) :: block

    block = block_at(patch, number)
    elements = 0
    do lane = 1, n_lanes
      if (patch%lanes%is_owner(lane, block%b)) elements(:, lane) = element_of_lane(patch, number, &
                                                                                   lane)
    end do
  end function owned_elements

  subroutine difference_block(patch, law, block, dt, amount, x, v, matrix)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt, amount
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(out) :: matrix(:, :, :)
    type(kept_block_t) :: kept
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6), start(size(u, 1), 6), f(size(u, 1), 3)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), sums(n_lanes, 4), sense
    integer :: column, side
    logical :: ok

    call keep_block(patch, block%number, kept)
    call gather_motion(patch, block, dt, x, v, start, w)
    matrix = 0.0_wp
    do column = 1, size(matrix, 3)
      do side = 1, 2
        sense = 3.0_wp - 2.0_wp*side
        u = start
        call move_motion(column, sense*amount, w, u)
        call run_kernel(patch, law, block, dt, .false., x, v, u, f, sums, ok)
        call put_back_block(kept, patch, block%number)
        call add_column(column, 0.5_wp*sense/amount, w, f, matrix)
      end do
    end do
  end subroutine difference_block

  pure subroutine keep_block(patch, k, kept)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: k                       !! number of the block
    type(kept_block_t), intent(out) :: kept

    kept%stress = patch%stress(:, :, :, :, k)
    kept%state = patch%state(:, :, :, :, k)
    kept%push = patch%push(:, :, :, min(k, size(patch%push, 4)))
  end subroutine keep_block

  pure subroutine put_back_block(kept, patch, k)
    type(kept_block_t), intent(in) :: kept
    type(solid_patch_t), intent(inout) :: patch
    integer, intent(in) :: k

    patch%stress(:, :, :, :, k) = kept%stress
    patch%state(:, :, :, :, k) = kept%state
    if (patch%viscosity%is_active) patch%push(:, :, :, min(k, size(patch%push, 4))) = kept%push
  end subroutine put_back_block

  !> Move a component of the control points of eight elements at the end of a motion, and half of
  !! the motion with it.
  pure subroutine move_motion(column, amount, w, u)
    integer, intent(in) :: column                  !! node + nodes*(component - 1)
    real(wp), intent(in) :: amount
    real(wp), intent(in) :: w(:)                   !! weights of the block, where there are any
    real(wp), intent(inout) :: u(:, :)             !! (8*nodes, 6), see `gather_motion`

    call move_column(column, amount, w, u(:, :3))
    call move_column(column, 0.5_wp*amount, w, u(:, 4:))
  end subroutine move_motion

  !> Move a component of the control points of eight elements.
  pure subroutine move_column(column, amount, w, u)
    integer, intent(in) :: column                  !! node + nodes*(component - 1)
    real(wp), intent(in) :: amount
    real(wp), intent(in) :: w(:)                   !! weights of the block, where there are any
    real(wp), intent(inout) :: u(:, :)             !! (8*nodes, 3), weighted
    integer :: first, c

    c = (n_lanes*(column - 1))/size(u, 1) + 1
    first = n_lanes*(column - 1) - size(u, 1)*(c - 1) + 1
    associate (moved => u(first:first + n_lanes - 1, c))
      if (size(w) > 0) then
        moved = moved + amount*w(first:first + n_lanes - 1)
      else
        moved = moved + amount
      end if
    end associate
  end subroutine move_column

  !> Add a multiple of the forces of eight elements to a column of their matrices.
  pure subroutine add_column(column, factor, w, f, matrix)
    integer, intent(in) :: column
    real(wp), intent(in) :: factor
    real(wp), intent(in) :: w(:)                   !! weights of the block, where there are any
    real(wp), intent(inout) :: f(:, :)             !! (8*nodes, 3)
    real(wp), intent(inout) :: matrix(:, :, :)     !! (8, m, m)

    if (size(w) > 0) call weigh_block(size(f, 1), size(f, 2), w, f)
    matrix(:, :, column) = matrix(:, :, column) &
                           + factor*reshape(f, [n_lanes, size(matrix, 2)])
  end subroutine add_column

end module solid_stiffness
