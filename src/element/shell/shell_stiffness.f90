!> Stiffness of the elements of blocks of a shell, as `solid_stiffness` has it of solids.
module shell_stiffness
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use solid_patch, only: solid_patch_t, shell_points_t, block_t, block_at
  use solid_forces, only: gather_motion
  use solid_stiffness, only: kept_block_t, keep_block, put_back_block, owned_elements, &
                             move_column, add_column
  use shell_context, only: placed_law_t, new_placed_law
  use shell_forces, only: run_placed, run_shell
  use through_thickness, only: through_fields_t, normal_at_points
  implicit none
  private

  public :: stiffness_of_shells

  !> What an evaluation changes at the points of a block.
  type, extends(kept_block_t) :: kept_t
    real(wp), allocatable, dimension(:, :, :) :: metric, through, resultant, normal, stretch
    real(wp), allocatable :: thickness(:, :)
    logical :: is_pressed = .false.
  end type kept_t

contains

  !> Arguments as of `stiffness_of_solids`.
  subroutine stiffness_of_shells(patch, points, fields, law, dt, amount, x, first, elements, &
                                 matrices)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    type(through_fields_t), intent(in) :: fields        !! normal stress of the end
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, amount
    real(wp), intent(in), contiguous :: x(:, :, :, :)   !! control points at the end
    integer, intent(in) :: first
    integer, intent(out) :: elements(:, :, :)           !! (3, 8, blocks), 0: repeats another
    real(wp), intent(out) :: matrices(:, :, :, :)       !! (8, m, m, blocks) [force/length]
    integer :: b

    !$omp parallel do schedule(static) if (.not. law%is_serial)
    do b = 1, size(matrices, 4)
      elements(:, :, b) = owned_elements(patch, first + b - 1)
      call difference_block(patch, points, fields, law, block_at(patch, first + b - 1), dt, &
                            amount, x, matrices(:, :, :, b))
    end do
    !$omp end parallel do
  end subroutine stiffness_of_shells

  subroutine difference_block(patch, points, fields, law, block, dt, amount, x, matrix)
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    type(through_fields_t), intent(in) :: fields
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt, amount
    real(wp), intent(in), contiguous :: x(:, :, :, :)
    real(wp), intent(out) :: matrix(:, :, :)
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 3), start(size(u, 1), 3), f(size(u, 1), 3)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), sums(n_lanes, 4), sense
    real(wp) :: normal_end(n_lanes, 2, size(points%normal, 3))
    type(placed_law_t) :: placed
    type(kept_t) :: kept
    integer :: column, side
    logical :: ok

    call keep(patch, points, block%number, kept)
    call gather_motion(patch, block, dt, x, x, start, w)
    normal_end = 0.0_wp
    if (fields%is_pressed) call normal_at_points(patch, points, block, w, fields%normal, normal_end)
    if (law%needs_context) call new_placed_law(placed, patch, law)
    matrix = 0.0_wp
    do column = 1, size(matrix, 3)
      do side = 1, 2
        sense = 3.0_wp - 2.0_wp*side
        u = start
        call move_column(column, sense*amount, w, u)
        if (law%needs_context) then
          call run_placed(patch, points, placed, block, dt, normal_end, u, f, sums, ok)
        else
          call run_shell(patch, points, law, block, dt, normal_end, u, f, sums, ok)
        end if
        call put_back(kept, patch, points, block%number)
        call add_column(column, 0.5_wp*sense/amount, w, f, matrix)
      end do
    end do
  end subroutine difference_block

  pure subroutine keep(patch, points, k, kept)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    integer, intent(in) :: k                       !! number of the block
    type(kept_t), intent(out) :: kept

    call keep_block(patch, k, kept%kept_block_t)
    kept%metric = points%metric(:, :, :, k)
    kept%through = points%through(:, :, :, k)
    kept%resultant = points%resultant(:, :, :, k)
    kept%normal = points%normal(:, :, :, k)
    kept%thickness = points%thickness(:, :, k)
    kept%is_pressed = points%is_pressed(k)
    if (allocated(points%stretch)) kept%stretch = points%stretch(:, :, :, k)
  end subroutine keep

  pure subroutine put_back(kept, patch, points, k)
    type(kept_t), intent(in) :: kept
    type(solid_patch_t), intent(inout) :: patch
    type(shell_points_t), intent(inout) :: points
    integer, intent(in) :: k

    call put_back_block(kept%kept_block_t, patch, k)
    points%metric(:, :, :, k) = kept%metric
    points%through(:, :, :, k) = kept%through
    points%resultant(:, :, :, k) = kept%resultant
    points%normal(:, :, :, k) = kept%normal
    points%thickness(:, :, k) = kept%thickness
    points%is_pressed(k) = kept%is_pressed
    if (allocated(points%stretch)) points%stretch(:, :, :, k) = kept%stretch
  end subroutine put_back

end module shell_stiffness
