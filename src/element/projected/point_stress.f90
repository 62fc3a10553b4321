!> Stress update of blocks between their kinematics and their forces. A law that asks for the
!! context of its points gets those of several blocks together, as many as it asks for.
module point_stress
  use kinds, only: wp
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use point_context, only: point_context_t, new_point_context
  use tensor_rotation, only: rotate_by_spin, turn_to_end
  use bulk_viscosity, only: viscous_factors
  use solid_patch, only: solid_patch_t, block_t, point_number
  use patch_points, only: set_clock, set_lanes
  implicit none
  private

  public :: update_stress

  !> Fields of the points of a block between kinematics and forces. The last dimension counts rows.
  type, public :: point_fields_t
    integer :: n_layers = 0, n_rows = 0           !! q3, q1*q2
    real(wp), allocatable :: dstrain(:, :, :)     !! (8*q3, 6, q1*q2)
    real(wp), allocatable :: spin(:, :, :)        !! (8*q3, 3, q1*q2)
    real(wp), allocatable :: volume(:, :)         !! middle of the step, (8*q3, q1*q2)
    real(wp), allocatable :: end_volume(:, :)     !! end of the step
    real(wp), allocatable :: jacobian(:, :, :)    !! end, (8*q3, 9, q1*q2); not smooth
    real(wp), allocatable :: weighted(:, :, :)    !! stress times volume, (8*q3, 6, q1*q2)
    real(wp), allocatable :: plane(:, :, :)       !! its share within a sheet, see split_sheet
    real(wp), allocatable :: mean(:, :)           !! volume strain or its stress
    real(wp), allocatable :: along1(:, :, :)      !! what axis 1 alone projects; sheet only
    real(wp), allocatable :: along2(:, :, :)      !! what axis 2 alone projects; sheet only
    real(wp), allocatable :: tangents(:, :, :)    !! (8*q3, 12, q1*q2); sheet only
    real(wp), allocatable :: gradients(:, :, :)   !! F at start and end, row by row; context
    real(wp), allocatable :: place(:, :, :)       !! (8*q3, 3, q1*q2); context only
    real(wp), allocatable :: growth(:, :, :)      !! log det F, (8*q3, 2, q1*q2); projected context
    real(wp) :: sums(n_lanes, 4) = 0.0_wp         !! see block_strain
  end type point_fields_t

  !> What a law with context gets in a call: a row of several blocks. Stress and state are those of
  !! all rows, for memory is read more quickly block after block.
  type, public :: point_group_t
    type(point_context_t) :: context
    real(wp), allocatable :: dstrain(:, :), spin(:, :), stress(:, :, :), state(:, :, :)
  end type point_group_t

contains

  !> Stress, state, work and stress times volume of all points of some blocks.
  subroutine update_stress(patch, law, blocks, dt, group, fields, ok)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: blocks(:)
    real(wp), intent(in) :: dt
    type(point_group_t), intent(inout) :: group           !! room, for laws with context
    type(point_fields_t), intent(inout) :: fields(:)      !! of the blocks
    logical, intent(out) :: ok(:)                         !! of each block
    integer :: i, row, q(2)
    logical :: row_ok

    q = [patch%axes(3)%n_points, fields(1)%n_rows]
    do i = 1, size(blocks)
      associate (own => fields(i), k => blocks(i)%number)
        if (law%uses_gradient .and. size(own%growth) > 0) call scale_volumes(own)
        call start_rows(q, law%is_rotating, own%spin, own%volume, own%dstrain, &
                        patch%stress(:, :, :, :, k), own%sums)
      end associate
    end do
    if (patch%has_context) call place_group(patch, law, blocks, group)
    if (size(blocks) > 1) call take_state(patch, law, blocks, group)
    ok = .true.
    do row = 1, q(2)
      if (patch%has_context) then
        call update_group(patch, law, blocks, row, dt, group, fields, row_ok)
      else
        associate (k => blocks(1)%number)
          call law%update(n_lanes*q(1), dt, fields(1)%dstrain(:, :, row), &
                          patch%stress(:, :, :, row, k), patch%state(:, :, :, row, k), row_ok, &
                          fields(1)%spin(:, :, row))
        end associate
      end if
      ok = ok .and. row_ok
    end do
    if (size(blocks) > 1) call put_state_back(patch, law, blocks, group, ok)
    do i = 1, size(blocks)
      associate (own => fields(i), k => blocks(i)%number)
        call finish_rows(q, patch%viscosity%is_active, viscous_factors(patch%viscosity, k, dt), &
                         own%dstrain, own%volume, own%end_volume, patch%stress(:, :, :, :, k), &
                         patch%push(:, :, :, min(k, size(patch%push, 4))), own%weighted, own%sums)
      end associate
    end do
  end subroutine update_stress

  !> The volumes of the scaled gradients: a law with an energy per volume at the start needs them,
  !! for its forces to be the slopes of that energy.
  pure subroutine scale_volumes(fields)
    type(point_fields_t), intent(inout) :: fields

    fields%volume = fields%volume*exp(0.5_wp*(fields%growth(:, 1, :) + fields%growth(:, 2, :)))
    fields%end_volume = fields%end_volume*exp(fields%growth(:, 2, :))
  end subroutine scale_volumes

  !> Turn stresses and strain increments to the end of the step, and add half of the stress power.
  !! A law that rotates the stress itself gets all as it is, and the errors of first order by the
  !! rotations to the middle cancel in the mean with the power of the stress of the end.
  pure subroutine start_rows(q, is_rotating, spin, volume, dstrain, stress, sums)
    integer, intent(in) :: q(2)                      !! points of a row, rows
    logical, intent(in) :: is_rotating               !! of the law
    real(wp), intent(in) :: spin(8*q(1), 3, q(2))
    real(wp), intent(inout) :: volume(8*q(1), q(2)), dstrain(8*q(1), 6, q(2))
    real(wp), intent(inout) :: stress(8*q(1), 6, q(2)), sums(8, 4)
    integer :: row

    do row = 1, q(2)
      if (.not. is_rotating) then
        call turn_to_end(8*q(1), spin(:, :, row), dstrain(:, :, row), volume(:, row))
        call rotate_by_spin(8*q(1), spin(:, :, row), stress(:, :, row))
      end if
      call add_work(q(1), stress(:, :, row), dstrain(:, :, row), volume(:, row), sums)
    end do
  end subroutine start_rows

  !> The other half of the stress power, and stress times volume with the viscous stress.
  pure subroutine finish_rows(q, is_viscous, viscous, dstrain, volume, end_volume, stress, push, &
                              weighted, sums)
    integer, intent(in) :: q(2)
    logical, intent(in) :: is_viscous
    real(wp), intent(in) :: viscous(8, 2)            !! see `viscous_factors`
    real(wp), intent(in) :: dstrain(8*q(1), 6, q(2)), stress(8*q(1), 6, q(2))
    real(wp), intent(in), dimension(8*q(1), q(2)) :: volume, end_volume
    real(wp), intent(inout) :: push(8*q(1), q(2)), sums(8, 4)   !! viscous stress
    real(wp), intent(out) :: weighted(8*q(1), 6, q(2))
    integer :: c, row

    do row = 1, q(2)
      call add_work(q(1), stress(:, :, row), dstrain(:, :, row), volume(:, row), sums)
      do c = 1, 6
        weighted(:, c, row) = stress(:, c, row)*end_volume(:, row)
      end do
      if (is_viscous) call add_viscous(q(1), dstrain(:, :, row), viscous, volume(:, row), &
                                       end_volume(:, row), push(:, row), weighted(:, :, row), sums)
    end do
  end subroutine finish_rows

  !> Half of the stress power of a row, see `flux_row` of the kernel.
  pure subroutine add_work(n, stress, dstrain, volume, sums)
    integer, intent(in) :: n
    real(wp), intent(in) :: stress(8, n, 6), dstrain(8, n, 6), volume(8, n)
    real(wp), intent(inout) :: sums(8, 4)
    integer :: l, q

    do q = 1, n
      !$omp simd
      do l = 1, 8
        sums(l, 1) = sums(l, 1) + 0.5_wp*volume(l, q) &
                     *(stress(l, q, 1)*dstrain(l, q, 1) + stress(l, q, 2)*dstrain(l, q, 2) &
                       + stress(l, q, 3)*dstrain(l, q, 3) + stress(l, q, 4)*dstrain(l, q, 4) &
                       + stress(l, q, 5)*dstrain(l, q, 5) + stress(l, q, 6)*dstrain(l, q, 6))
      end do
    end do
  end subroutine add_work

  !> Viscous stress, see `add_viscous` of the kernel.
  pure subroutine add_viscous(n, dstrain, viscous, volume, end_volume, push, weighted, sums)
    integer, intent(in) :: n
    real(wp), intent(in) :: dstrain(8, n, 6), viscous(8, 2), volume(8, n), end_volume(8, n)
    real(wp), intent(inout) :: push(8, n), weighted(8, n, 6), sums(8, 4)
    real(wp) :: growth, now
    integer :: l, q

    do q = 1, n
      !$omp simd private(growth, now)
      do l = 1, 8
        growth = dstrain(l, q, 1) + dstrain(l, q, 2) + dstrain(l, q, 3)
        now = growth*(viscous(l, 1) + viscous(l, 2)*max(0.0_wp, -growth))
        sums(l, 2) = sums(l, 2) + 0.5_wp*volume(l, q)*growth*(push(l, q) + now)
        push(l, q) = now
        weighted(l, q, 1) = weighted(l, q, 1) + now*end_volume(l, q)
        weighted(l, q, 2) = weighted(l, q, 2) + now*end_volume(l, q)
        weighted(l, q, 3) = weighted(l, q, 3) + now*end_volume(l, q)
      end do
    end do
  end subroutine add_viscous

  !> Room for a group, and what is the same at all its points: time, elements and their sizes.
  subroutine place_group(patch, law, blocks, group)
    type(solid_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: blocks(:)
    type(point_group_t), intent(inout) :: group
    integer :: n

    n = n_lanes*size(blocks)*patch%axes(3)%n_points
    if (group%context%n /= n) then
      group%context = new_point_context(n, patch%n_fields)
      if (allocated(group%dstrain)) deallocate (group%dstrain, group%spin, group%stress, &
                                                group%state)
      associate (rows => patch%axes(1)%n_points*patch%axes(2)%n_points)
        allocate (group%dstrain(n, 6), group%spin(n, 3), group%stress(n, 6, rows), &
                  group%state(n, law%n_state, rows))
      end associate
    end if
    call set_clock(patch, group%context)
    call set_lanes(patch, blocks, group%context)
  end subroutine place_group

  !> One call of a law with context, for a row of the blocks.
  subroutine update_group(patch, law, blocks, row, dt, group, fields, ok)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: blocks(:)
    integer, intent(in) :: row
    real(wp), intent(in) :: dt
    type(point_group_t), intent(inout) :: group
    type(point_fields_t), intent(in) :: fields(:)
    logical, intent(out) :: ok
    integer :: i, m, n

    m = size(blocks)
    n = patch%axes(3)%n_points
    call fill_context(patch, blocks, row, fields, group%context)
    if (m == 1) then
      associate (k => blocks(1)%number)
        call law%update_in_context(group%context, dt, fields(1)%dstrain(:, :, row), &
                                   patch%stress(:, :, :, row, k), &
                                   patch%state(:, :, :, row, k), ok, &
                                   fields(1)%spin(:, :, row))
      end associate
      return
    end if
    do i = 1, m
      call take(n, m, i, 6, fields(i)%dstrain(:, :, row), group%dstrain)
      call take(n, m, i, 3, fields(i)%spin(:, :, row), group%spin)
    end do
    call law%update_in_context(group%context, dt, group%dstrain, group%stress(:, :, row), &
                               group%state(:, :, row), ok, group%spin)
  end subroutine update_group

  !> Stress and state of several blocks.
  subroutine take_state(patch, law, blocks, group)
    type(solid_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: blocks(:)
    type(point_group_t), intent(inout) :: group
    integer :: i, row

    associate (m => size(blocks), n => patch%axes(3)%n_points)
      do i = 1, m
        do row = 1, size(group%stress, 3)
          associate (k => blocks(i)%number)
            call take(n, m, i, 6, patch%stress(:, :, :, row, k), group%stress(:, :, row))
            call take(n, m, i, law%n_state, patch%state(:, :, :, row, k), group%state(:, :, row))
          end associate
        end do
      end do
    end associate
  end subroutine take_state

  !> The reverse. Where the law failed, the blocks to blame are those with values that are not
  !! finite, if there are any.
  subroutine put_state_back(patch, law, blocks, group, ok)
    type(solid_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: blocks(:)
    type(point_group_t), intent(in) :: group
    logical, intent(inout) :: ok(:)                    !! all the same before
    integer :: i, row
    logical :: all_ok

    all_ok = all(ok)
    associate (m => size(blocks), n => patch%axes(3)%n_points)
      do i = 1, m
        associate (k => blocks(i)%number)
          do row = 1, size(group%stress, 3)
            call put_back(n, m, i, 6, group%stress(:, :, row), patch%stress(:, :, :, row, k))
            call put_back(n, m, i, law%n_state, group%state(:, :, row), &
                          patch%state(:, :, :, row, k))
          end do
          if (.not. all_ok) ok(i) = sum(abs(patch%stress(:, :, :, :, k))) &
                                    + sum(abs(patch%state(:, :, :, :, k))) <= huge(1.0_wp)
        end associate
      end do
    end associate
    if (.not. all_ok .and. all(ok)) ok = .false.
  end subroutine put_state_back

  !> Kinematics and fields of a row of the blocks.
  subroutine fill_context(patch, blocks, row, fields, context)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: blocks(:)
    integer, intent(in) :: row
    type(point_fields_t), intent(in) :: fields(:)
    type(point_context_t), intent(inout) :: context
    integer :: i, q, m, n

    m = size(blocks)
    n = patch%axes(3)%n_points
    associate (q1 => patch%axes(1)%n_points, q2 => patch%axes(2)%n_points)
      do q = 1, n
        context%point(n_lanes*m*(q - 1) + 1:n_lanes*m*q) = point_number(q1, q2, row, q)
      end do
    end associate
    do i = 1, m
      associate (k => blocks(i)%number, own => fields(i))
        call take(n, m, i, 3, own%place(:, :, row), context%place)
        if (patch%has_gradients) then
          call take(n, m, i, 9, own%gradients(:, 1:9, row), context%f0)
          call take(n, m, i, 9, own%gradients(:, 10:18, row), context%f1)
        end if
        if (patch%n_fields > 0) call take(n, m, i, 2*patch%n_fields, patch%given(:, :, :, row, k), &
                                          context%fields)
      end associate
    end do
  end subroutine fill_context

  !> Values of a row of block i into those of m blocks, where each point has all blocks together.
  pure subroutine take(n, m, i, n_values, row, group)
    integer, intent(in) :: n, m, i, n_values         !! points of the row, blocks, this one
    real(wp), intent(in) :: row(8, n, n_values)
    real(wp), intent(inout) :: group(8, m, n, n_values)
    integer :: c, q

    do c = 1, n_values
      do q = 1, n
        group(:, i, q, c) = row(:, q, c)
      end do
    end do
  end subroutine take

  !> The reverse of `take`.
  pure subroutine put_back(n, m, i, n_values, group, row)
    integer, intent(in) :: n, m, i, n_values
    real(wp), intent(in) :: group(8, m, n, n_values)
    real(wp), intent(inout) :: row(8, n, n_values)
    integer :: c, q

    do c = 1, n_values
      do q = 1, n
        row(:, q, c) = group(:, i, q, c)
      end do
    end do
  end subroutine put_back

end module point_stress
