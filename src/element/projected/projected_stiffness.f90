!> Stiffness of the elements of blocks with a projection, or with a law that asks for the context of
!! its points, as `solid_stiffness` has it of plain solids.
module projected_stiffness
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use solid_patch, only: solid_patch_t, block_t, block_at
  use strain_projection, only: projection_t
  use point_stress, only: point_fields_t, point_group_t, update_stress
  use projected_forces, only: set_point_fields, find_strain, find_forces
  use solid_forces, only: gather_motion
  use solid_stiffness, only: kept_block_t, keep_block, put_back_block, owned_elements, &
                             move_motion, add_column
  implicit none
  private

  public :: stiffness_of_projection

contains

  !> Arguments as of `stiffness_of_solids`.
  subroutine stiffness_of_projection(patch, projection, law, dt, amount, x, v, first, elements, &
                                     matrices)
    type(solid_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, amount
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    integer, intent(in) :: first
    integer, intent(out) :: elements(:, :, :)           !! (3, 8, blocks), 0: repeats another
    real(wp), intent(out) :: matrices(:, :, :, :)       !! (8, m, m, blocks) [force/length]
    integer :: b

    !$omp parallel do schedule(static) if (.not. law%is_serial)
    do b = 1, size(matrices, 4)
      elements(:, :, b) = owned_elements(patch, first + b - 1)
      call difference_block(patch, projection, law, block_at(patch, first + b - 1), dt, amount, &
                            x, v, matrices(:, :, :, b))
    end do
    !$omp end parallel do
  end subroutine stiffness_of_projection

  subroutine difference_block(patch, projection, law, block, dt, amount, x, v, matrix)
    type(solid_patch_t), intent(inout) :: patch
    type(projection_t), intent(in) :: projection
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt, amount
    real(wp), intent(in), contiguous :: x(:, :, :, :), v(:, :, :, :)
    real(wp), intent(out) :: matrix(:, :, :)
    type(kept_block_t) :: kept
    type(point_group_t) :: group
    type(point_fields_t) :: fields(1)
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 6), start(size(u, 1), 6), f(size(u, 1), 3)
    real(wp) :: w(merge(size(u, 1), 0, patch%is_rational)), sense
    integer :: column, side
    logical :: ok(1)

    call keep_block(patch, block%number, kept)
    call set_point_fields(patch, projection, fields(1))
    call gather_motion(patch, block, dt, x, v, start, w)
    matrix = 0.0_wp
    do column = 1, size(matrix, 3)
      do side = 1, 2
        sense = 3.0_wp - 2.0_wp*side
        u = start
        call move_motion(column, sense*amount, w, u)
        call find_strain(patch, projection, block, u, fields(1))
        call update_stress(patch, law, [block], dt, group, fields, ok)
        call find_forces(patch, projection, block, u, fields(1), f)
        call put_back_block(kept, patch, block%number)
        call add_column(column, 0.5_wp*sense/amount, w, f, matrix)
      end do
    end do
  end subroutine difference_block

end module projected_stiffness
