!> What a patch has at its integration points, in the layout of their state: volumes and inverse
!! jacobians in the shape of a solid, elastic energy, and the temperature and field variables of the
!! deck.
module patch_points
  use kinds, only: wp
  use text, only: to_text
  use state_store, only: state_store_t, carry_columns, has_state
  use nurbs_solid, only: nurbs_solid_t
  use block_law, only: block_law_t
  use point_context, only: point_context_t
  use basis_tables, only: n_lanes
  use element, only: jacobian_in_span, grid_number
  use solid_patch, only: solid_patch_t, block_t, block_at, cut_number, local_place, basis_at, &
                         is_counted_lane, point_of_row, find_blocks_here, element_of_lane, &
                         place_of_point, is_block_here
  implicit none
  private

  public :: new_point_volumes, set_reference, determinant, inverse_rows
  public :: find_row_energies, set_clock, set_lanes
  public :: new_given_fields, spread_to_points, carry_given, read_points_of, copy_points

contains

  !> Volumes in the layout of the point state, zero for lanes that repeat an element.
  function new_point_volumes(patch, solid) result(volumes)
    type(solid_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), allocatable :: volumes(:, :, :, :)   !! shape (8, q3, q1*q2, n_blocks)
    real(wp) :: j(3, 3)
    integer :: q(3), block, lane, row, layer

    q = patch%axes%n_points
    allocate (volumes(n_lanes, q(3), q(1)*q(2), patch%n_blocks), source=0.0_wp)
    !$omp parallel do schedule(static) private(lane, row, layer, j)
    do block = 1, patch%n_blocks
      do lane = 1, n_lanes
        if (.not. is_counted_lane(patch, block, lane)) cycle
        do row = 1, q(1)*q(2)
          do layer = 1, q(3)
            call jacobian_at(patch, solid, block, lane, row, layer, j)
            volumes(lane, layer, row, block) = point_volume(patch, j, point_of_row(q, row, layer))
          end do
        end do
        volumes(lane, :, :, block) = volumes(lane, :, :, block)*share_of_lane(patch, block, lane)
      end do
    end do
    !$omp end parallel do
  end function new_point_volumes

  !> What laws that need the context of their points refer to: inverse jacobians by element-local
  !! coordinates, row by row, and cube roots of the volumes of the elements.
  subroutine set_reference(patch, solid)
    type(solid_patch_t), intent(inout) :: patch
    type(nurbs_solid_t), intent(in) :: solid       !! that the patch is made of
    real(wp) :: j(3, 3)
    integer :: q(3), block, lane, row, layer

    q = patch%axes%n_points
    if (patch%has_gradients) then
      allocate (patch%reference(n_lanes, 9, q(3), q(1)*q(2), patch%n_blocks))
    else
      allocate (patch%reference(1, 1, 1, 1, 1), source=0.0_wp)
    end if
    allocate (patch%element_size(n_lanes, patch%n_blocks), source=0.0_wp)
    do block = 1, patch%n_blocks
      do lane = 1, n_lanes
        do row = 1, q(1)*q(2)
          do layer = 1, q(3)
            call jacobian_at(patch, solid, block, lane, row, layer, j)
            if (patch%has_gradients) patch%reference(lane, :, layer, row, block) = inverse_rows(j)
            patch%element_size(lane, block) = patch%element_size(lane, block) &
                                              + point_volume(patch, j, point_of_row(q, row, layer))
          end do
        end do
      end do
    end do
    patch%element_size = max(patch%element_size, 0.0_wp)**(1.0_wp/3.0_wp)
  end subroutine set_reference

  !> Part of the area along the sheet that an outline leaves of the element of a lane.
  pure real(wp) function share_of_lane(patch, number, lane) result(share)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: number, lane            !! number of its block
    integer :: c

    share = 1.0_wp
    c = cut_number(patch, block_at(patch, number))
    if (c > 0) share = 0.25_wp*sum(patch%lanes%cut%weights(lane, :, c))
  end function share_of_lane

  !> Volume of a point of a whole element from its jacobian.
  pure real(wp) function point_volume(patch, j, point) result(volume)
    type(solid_patch_t), intent(in) :: patch
    real(wp), intent(in) :: j(3, 3)
    integer, intent(in) :: point(3)

    volume = determinant(j)*patch%axes(1)%weights(point(1))*patch%axes(2)%weights(point(2)) &
             *patch%axes(3)%weights(point(3))
  end function point_volume

  !> Jacobian by element-local coordinates of an integration point.
  pure subroutine jacobian_at(patch, solid, number, lane, row, layer, j)
    type(solid_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid               !! in any shape
    integer, intent(in) :: number, lane, row, layer        !! number of its block
    real(wp), intent(out) :: j(3, 3)                       !! [length]
    real(wp) :: x(3)
    type(block_t) :: block
    integer :: span(3)

    block = block_at(patch, number)
    span = [patch%lanes%first(lane, block%b), patch%axes(2)%first(block%e2), &
            patch%axes(3)%first(block%e3)] + patch%axes%degree
    call jacobian_in_span(solid, span, [local_place(patch, block, lane, row), &
                                        patch%axes(3)%abscissae(layer)], j, x)
  end subroutine jacobian_at

  !> Determinant of a 3 x 3 matrix.
  pure real(wp) function determinant(j)
    real(wp), intent(in) :: j(3, 3)

    determinant = j(1, 1)*(j(2, 2)*j(3, 3) - j(2, 3)*j(3, 2)) &
                  + j(1, 2)*(j(2, 3)*j(3, 1) - j(2, 1)*j(3, 3)) &
                  + j(1, 3)*(j(2, 1)*j(3, 2) - j(2, 2)*j(3, 1))
  end function determinant

  !> Inverse of a 3 x 3 matrix by its cofactors, listed row by row.
  pure function inverse_rows(j) result(rows)
    real(wp), intent(in) :: j(3, 3)   !! not singular
    real(wp) :: rows(9)

    rows = [j(2, 2)*j(3, 3) - j(2, 3)*j(3, 2), j(1, 3)*j(3, 2) - j(1, 2)*j(3, 3), &
            j(1, 2)*j(2, 3) - j(1, 3)*j(2, 2), j(2, 3)*j(3, 1) - j(2, 1)*j(3, 3), &
            j(1, 1)*j(3, 3) - j(1, 3)*j(3, 1), j(1, 3)*j(2, 1) - j(1, 1)*j(2, 3), &
            j(2, 1)*j(3, 2) - j(2, 2)*j(3, 1), j(1, 2)*j(3, 1) - j(1, 1)*j(3, 2), &
            j(1, 1)*j(2, 2) - j(1, 2)*j(2, 1)]/determinant(j)
  end function inverse_rows

  !> Elastic energy stored at the points of each row, sum of s:C^-1:s/2 times their volume; what
  !! internal energy exceeds all of it by is plastic work. `volumes` has the layout of the stress.
  pure subroutine find_row_energies(law, n, m, stress, volumes, energies)
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: n, m                      !! points of a row, rows
    real(wp), intent(in) :: stress(n, 6, m), volumes(n, m)
    real(wp), intent(out) :: energies(m)
    real(wp) :: by_bulk, by_shear
    integer :: row

    by_bulk = 0.5_wp/law%bulk
    by_shear = 0.5_wp/law%shear
    do row = 1, m
      energies(row) = energy_of_row(n, by_bulk, by_shear, stress(:, :, row), volumes(:, row))
    end do
  end subroutine find_row_energies

  pure real(wp) function energy_of_row(n, by_bulk, by_shear, s, volumes) result(energy)
    integer, intent(in) :: n
    real(wp), intent(in) :: by_bulk, by_shear        !! halves of their inverses
    real(wp), intent(in) :: s(n, 6), volumes(n)
    real(wp) :: mean, shear_part
    integer :: l

    energy = 0.0_wp
    !$omp simd private(mean, shear_part) reduction(+: energy)
    do l = 1, n
      mean = (s(l, 1) + s(l, 2) + s(l, 3))*(1.0_wp/3)
      shear_part = 0.5_wp*((s(l, 1) - mean)**2 + (s(l, 2) - mean)**2 + (s(l, 3) - mean)**2) &
                   + s(l, 4)**2 + s(l, 5)**2 + s(l, 6)**2
      energy = energy + volumes(l)*(mean**2*by_bulk + shear_part*by_shear)
    end do
  end function energy_of_row

  !> Times and numbers of the increment that a patch is about to make.
  pure subroutine set_clock(patch, context)
    type(solid_patch_t), intent(in) :: patch
    type(point_context_t), intent(inout) :: context

    context%time = patch%time
    context%step_time = patch%time - patch%step_start
    context%step = patch%step
    context%increment = patch%increment - patch%before_step + 1
  end subroutine set_clock

  !> Elements and their sizes for the points of a row of some blocks.
  pure subroutine set_lanes(patch, blocks, context)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: blocks(:)
    type(point_context_t), intent(inout) :: context   !! with room for them
    integer :: i, q, first, before

    do q = 1, patch%axes(3)%n_points
      do i = 1, size(blocks)
        first = first_lane(size(blocks), q, i)
        before = patch%n_before &
                 + grid_number(patch%axes%n_elements, [0, blocks(i)%e2, blocks(i)%e3])
        context%element(first:first + 7) = before + patch%lanes%element(:, blocks(i)%b)
        context%is_owner(first:first + 7) = patch%lanes%is_owner(:, blocks(i)%b)
        context%length(first:first + 7) = patch%element_size(:, blocks(i)%number)
      end do
    end do
  end subroutine set_lanes

  !> Where the eight lanes of block i at point q of a row begin: each point has all blocks together.
  pure integer function first_lane(n_blocks, q, i) result(first)
    integer, intent(in) :: n_blocks, q, i

    first = n_lanes*(n_blocks*(q - 1) + i - 1) + 1
  end function first_lane

  !> Room for fields that are zero everywhere.
  subroutine new_given_fields(patch, n_fields)
    type(solid_patch_t), intent(inout) :: patch
    integer, intent(in) :: n_fields

    patch%n_fields = n_fields
    associate (n => patch%n_control, q => patch%axes%n_points)
      allocate (patch%spread_values(n(1), n(2), n(3), n_fields), source=0.0_wp)
      allocate (patch%given(n_lanes, q(3), 2*n_fields, q(1)*q(2), patch%n_blocks), source=0.0_wp)
    end associate
  end subroutine new_given_fields

  !> A step begins: what the points had at the end of the last one they have at its start; at its
  !! end they have what the control points have now, by the basis of the patch. Where neither
  !! changes there is nothing to do.
  subroutine spread_to_points(patch, nodal)
    type(solid_patch_t), intent(inout) :: patch
    real(wp), intent(in) :: nodal(:, :, :, :)     !! at the control points, (n1, n2, n3, n_fields)
    logical :: is_same
    integer :: block, k

    is_same = patch%is_spread
    if (is_same) is_same = all(.not. abs(nodal - patch%spread_values) > 0.0_wp)
    if (is_same .and. patch%is_settled) return
    patch%is_settled = is_same
    patch%is_spread = .true.
    patch%spread_values = nodal
    !$omp parallel do schedule(static) private(k)
    do block = 1, patch%n_blocks
      if (.not. is_block_here(patch, block)) cycle
      do k = 1, patch%n_fields
        patch%given(:, :, k, :, block) = patch%given(:, :, patch%n_fields + k, :, block)
      end do
      if (.not. is_same) call spread_in_block(patch, block)
    end do
    !$omp end parallel do
  end subroutine spread_to_points

  !> The fields of the points at both ends of a step, each for itself: of one that only later steps
  !! of the deck name a checkpoint may have nothing, and the points keep what they have.
  subroutine carry_given(patch, store)
    type(solid_patch_t), intent(inout) :: patch
    type(state_store_t), intent(inout) :: store
    real(wp), allocatable :: values(:, :, :, :, :)
    integer, allocatable :: blocks(:)
    integer :: k

    call find_blocks_here(patch, blocks)
    associate (n => patch%n_blocks)
      if (allocated(store%visitor)) then
        call carry_columns(store, "given", size(patch%given)/n, n, patch%given, blocks)
      else
        do k = 1, patch%n_fields
          associate (name => "given_"//to_text(k))
            if (store%is_taking .and. .not. has_state(store, name)) cycle
            values = patch%given(:, :, k::patch%n_fields, :, :)
            call carry_columns(store, name, size(values)/n, n, values, blocks)
            if (store%is_taking) patch%given(:, :, k::patch%n_fields, :, :) = values
          end associate
        end do
      end if
    end associate
    if (store%is_taking) patch%is_spread = .false.
  end subroutine carry_given

  !> The points of one block.
  pure subroutine spread_in_block(patch, block)
    type(solid_patch_t), intent(inout) :: patch
    integer, intent(in) :: block
    real(wp) :: values(patch%n_fields)
    integer :: lane, q(3), row, layer

    q = patch%axes%n_points
    do lane = 1, n_lanes
      do row = 1, q(1)*q(2)
        do layer = 1, q(3)
          call interpolate(patch, block_at(patch, block), lane, row, layer, values)
          patch%given(lane, layer, patch%n_fields + 1:, row, block) = values
        end do
      end do
    end do
  end subroutine spread_in_block

  !> The fields at one point of an element.
  pure subroutine interpolate(patch, block, lane, row, layer, values)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: lane, row, layer
    real(wp), intent(out) :: values(patch%n_fields)
    real(wp) :: one(patch%axes(1)%degree + 1, 0:2), two(patch%axes(2)%degree + 1, 0:2), share, total
    integer :: low(3), i, j, k

    call basis_at(patch, block, lane, row, one, two)
    low = [patch%lanes%first(lane, block%b), patch%axes(2)%first(block%e2), &
           patch%axes(3)%first(block%e3)] - 1
    values = 0.0_wp
    total = 0.0_wp
    do k = 1, patch%axes(3)%degree + 1
      do j = 1, patch%axes(2)%degree + 1
        do i = 1, patch%axes(1)%degree + 1
          share = one(i, 0)*two(j, 0)*patch%axes(3)%values(k, layer, block%e3)
          if (patch%is_rational) share = share*patch%weights(low(1) + i, low(2) + j, low(3) + k)
          total = total + share
          values = values + share*patch%spread_values(low(1) + i, low(2) + j, low(3) + k, :)
        end do
      end do
    end do
    values = values/total
  end subroutine interpolate

  !> Equivalent plastic strain, stress and state of the points of the elements that are there.
  subroutine read_points_of(patch, eqps_state, eqps, stress, state)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: eqps_state
    real(wp), intent(inout) :: eqps(:, :, :, :, :, :)
    real(wp), intent(inout) :: stress(:, :, :, :, :, :, :), state(:, :, :, :, :, :, :)
    real(wp) :: one(1, size(eqps, 1), size(eqps, 2), size(eqps, 3))
    integer :: block, lane, e(3)

    !$omp parallel do schedule(static) private(lane, e, one)
    do block = 1, patch%n_blocks
      do lane = 1, n_lanes
        if (.not. is_counted_lane(patch, block, lane)) cycle
        e = element_of_lane(patch, block, lane)
        call copy_points(patch, patch%stress(lane, :, :, :, block), &
                         stress(:, :, :, :, e(1), e(2), e(3)))
        call copy_points(patch, patch%state(lane, :, :, :, block), &
                         state(:, :, :, :, e(1), e(2), e(3)))
        if (eqps_state == 0) cycle
        call copy_points(patch, &
                         patch%state(lane, :, eqps_state:eqps_state, :, block), one)
        eqps(:, :, :, e(1), e(2), e(3)) = one(1, :, :, :)
      end do
    end do
    !$omp end parallel do
  end subroutine read_points_of

  !> From the order of the kernels, see `solid_patch_t`, to that of the axes; of more components
  !! than there is room for the first.
  pure subroutine copy_points(patch, kept, values)
    type(solid_patch_t), intent(in) :: patch
    real(wp), intent(in) :: kept(:, :, :)             !! of an element
    real(wp), intent(inout) :: values(:, :, :, :)     !! (n, q1, q2, q3)
    integer :: qa, qb, qc, at(2)

    do qc = 1, size(values, 4)
      do qb = 1, size(values, 3)
        do qa = 1, size(values, 2)
          at = place_of_point(patch, [qa, qb, qc])
          values(:, qa, qb, qc) = kept(at(1), :size(values, 1), at(2))
        end do
      end do
    end do
  end subroutine copy_points

end module patch_points
