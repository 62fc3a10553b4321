!> What central differences of the forces of blocks take: eight elements side by side, whose control
!! points are moved one component after the other. Stress and state are left as they were.
module solid_stiffness
  use kinds, only: wp
  use basis_tables, only: n_lanes
  use solid_patch, only: solid_patch_t, block_t, block_at, element_of_lane
  use block_gather, only: weigh_block
  use solid_forces, only: gather_motion
  implicit none
  private

  public :: begin_trial, end_trial, owned_elements, move_column, add_column

  !> Where the trials of a block begin, and what an evaluation changes at its points.
  type, public :: block_trial_t
    real(wp), allocatable :: start(:, :)           !! (8*nodes, 3 or 6), see `gather_motion`
    real(wp), allocatable :: w(:)                  !! weights of the block, where there are any
    real(wp), allocatable, dimension(:, :, :, :) :: stress, state
    real(wp), allocatable :: push(:, :, :)
  end type block_trial_t

contains

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

  !> Positions, half of the motion of an increment where it counts, and state of a block.
  subroutine begin_trial(patch, block, dt, x, v, n_columns, trial)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: x(:, :, :, :)          !! control points at the end of the motion
    real(wp), intent(in) :: v(:, :, :, :)          !! their velocities in it
    integer, intent(in) :: n_columns               !! 3: positions alone, 6
    class(block_trial_t), intent(inout) :: trial
    integer :: n

    n = n_lanes*product(patch%axes%degree + 1)
    allocate (trial%start(n, n_columns), trial%w(merge(n, 0, patch%is_rational)))
    call gather_motion(patch, block, dt, x, v, trial%start, trial%w)
    associate (k => block%number)
      trial%stress = patch%stress(:, :, :, :, k)
      trial%state = patch%state(:, :, :, :, k)
      trial%push = patch%push(:, :, :, min(k, size(patch%push, 4)))
    end associate
  end subroutine begin_trial

  !> The state as it was.
  pure subroutine end_trial(trial, patch, k)
    class(block_trial_t), intent(in) :: trial
    type(solid_patch_t), intent(inout) :: patch
    integer, intent(in) :: k                       !! number of the block

    patch%stress(:, :, :, :, k) = trial%stress
    patch%state(:, :, :, :, k) = trial%state
    if (patch%viscosity%is_active) patch%push(:, :, :, min(k, size(patch%push, 4))) = trial%push
  end subroutine end_trial

  !> Move a component of the control points of eight elements at the end of a motion, and half of
  !! the motion with it where there is one.
  pure subroutine move_column(column, amount, w, u)
    integer, intent(in) :: column                  !! node + nodes*(component - 1)
    real(wp), intent(in) :: amount
    real(wp), intent(in) :: w(:)                   !! weights of the block, where there are any
    real(wp), intent(inout) :: u(:, :)             !! (8*nodes, 3 or 6), weighted
    real(wp) :: way(n_lanes)
    integer :: first, c

    c = (n_lanes*(column - 1))/size(u, 1) + 1
    first = n_lanes*(column - 1) - size(u, 1)*(c - 1) + 1
    way = amount
    if (size(w) > 0) way = amount*w(first:first + n_lanes - 1)
    u(first:first + n_lanes - 1, c) = u(first:first + n_lanes - 1, c) + way
    if (size(u, 2) == 6) u(first:first + n_lanes - 1, c + 3) = &
      u(first:first + n_lanes - 1, c + 3) + 0.5_wp*way
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
