!> What passes between the faces of a shell and its integration points: normal stress from the
!! forces that press on the faces, thickness back to them.
!!
!! Plane stress leaves out what a tool does to a sheet that it bends: stress across the thickness,
!! which lets the sheet yield at less tension. It is linear between the faces, minus the pressure on
!! each, of the forces of the increment before: at a control point the force over its area. The
!! thickness of a control point is the mean of that of the integration points around. Both go with
!! the basis functions, one by the transposed of the other, and in every increment: a sheet that is
!! squeezed between tools would swing with any more delay. Only yielding feels it: one increment
!! late, what is elastic under it (strains of 1e-4) would give energy to every vibration on a tool.
module through_thickness
  use kinds, only: wp
  use basis_tables, only: n_lanes
  use solid_patch, only: solid_patch_t, shell_points_t, tile_buffer_t, block_t, block_at, tile_t, &
                         cut_number
  use tile_exchange, only: gather_blocks
  use patch_setup, only: new_tile_buffers
  use block_gather, only: weigh_block
  use solid_forces, only: gather_field, gather_weights, add_forces
  implicit none
  private

  public :: new_through_fields, add_push, take_pushes, normal_at_points, add_values, &
            thickness_now, volumes_of_cut

  !> Fields on the control points, as those of a patch with one control point across.
  type, public :: through_fields_t
    logical :: is_watched = .false.             !! somebody asks for the thickness
    logical :: is_pressed = .false.             !! the normal stress is not zero
    real(wp), allocatable :: volume(:, :)       !! of the control points at the start
    real(wp), allocatable :: push(:, :, :)      !! forces that press on faces 5, 6, (n1, n2, 5:6)
    !> Normal stress, mean of both faces and half of face 6 less face 5, (n1, n2, 1, 2).
    real(wp), allocatable :: normal(:, :, :, :)
    real(wp), allocatable :: sums(:, :, :, :)   !! of volume times thickness, (n1, n2, 1, 1)
    type(tile_buffer_t), allocatable :: buffers(:)     !! of these sums
  end type through_fields_t

contains

  !> No stress.
  subroutine new_through_fields(patch, points, fields)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(through_fields_t), intent(out) :: fields
    real(wp), allocatable :: one(:, :, :)
    integer :: n(3)

    n = patch%n_control
    allocate (fields%push(n(1), n(2), 5:6), fields%normal(n(1), n(2), 1, 2), &
              fields%sums(n(1), n(2), 1, 1), source=0.0_wp)
    fields%buffers = new_tile_buffers(patch, 1)
    allocate (one, mold=points%thickness)
    one = 1.0_wp
    fields%volume = sums_of(patch, points, one)
    ! Control points that nothing inside an outline reaches have no thickness.
    where (fields%volume <= 0.0_wp) fields%volume = 1.0_wp
  end subroutine new_through_fields

  !> Thickness at the control points now, from the integration points.
  function thickness_now(patch, points, fields) result(thickness)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(through_fields_t), intent(in) :: fields
    real(wp) :: thickness(size(fields%volume, 1), size(fields%volume, 2))
    real(wp), allocatable :: joined(:, :, :)

    if (patch%shares%is_shared) then   ! other processes have changed that of their points
      joined = points%thickness
      call gather_blocks(patch, size(joined)/patch%n_blocks, joined)
      thickness = sums_of(patch, points, joined)/fields%volume
    else
      thickness = sums_of(patch, points, points%thickness)/fields%volume
    end if
  end function thickness_now

  !> Volumes at the start that the control points have of elements that an outline cuts.
  function volumes_of_cut(patch, points) result(volumes)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    real(wp) :: volumes(patch%n_control(1), patch%n_control(2))
    real(wp) :: is_cut(size(points%thickness, 1), size(points%thickness, 2), patch%n_blocks)
    integer :: b

    do b = 1, patch%n_blocks
      is_cut(:, :, b) = merge(1.0_wp, 0.0_wp, cut_number(patch, block_at(patch, b)) > 0)
    end do
    volumes = sums_of(patch, points, is_cut)
  end function volumes_of_cut

  !> Values of the integration points, summed with their volumes by the basis functions.
  function sums_of(patch, points, values) result(total)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    real(wp), intent(in) :: values(:, :, :)           !! (8, q1*q2, n_blocks)
    real(wp) :: total(patch%n_control(1), patch%n_control(2))
    real(wp), allocatable :: sums(:, :, :, :), nothing(:, :, :, :)
    real(wp) :: w(merge(n_lanes*product(patch%axes%degree + 1), 0, patch%is_rational))
    type(tile_t) :: whole
    integer :: b

    allocate (sums(size(total, 1), size(total, 2), 1, 1), source=0.0_wp)
    allocate (nothing(0, 0, 0, 1))
    whole%control_last = patch%n_control(:2)
    whole%own_last = patch%n_control(2)
    do b = 1, patch%n_blocks
      if (patch%is_rational) call gather_weights(patch, block_at(patch, b), w)
      call add_values(patch, points, whole, block_at(patch, b), w, values(:, :, b), sums, nothing)
    end do
    total = sums(:, :, 1, 1)
  end function sums_of

  !> Add what forces on a face press towards the mid-surface, by control point. Row by row: a sum of
  !! products rounds in vectors as it does not in what is left of a loop, so that one loop over some
  !! rows would have other bits than one over all of them.
  pure subroutine add_push(n, rows, side, director, forces, push)
    integer, intent(in) :: n(2)                                !! control points by axis
    integer, intent(in) :: rows(2)                             !! first and last that are wanted
    integer, intent(in) :: side                                !! 5 or 6
    real(wp), intent(in), dimension(n(1), n(2), 3) :: director, forces    !! [-], [force]
    real(wp), intent(inout) :: push(n(1), n(2), 5:6)           !! sums by side [force]
    integer :: j

    do j = rows(1), rows(2)
      push(:, j, side) = push(:, j, side) + merge(-1.0_wp, 1.0_wp, side == 6) &
        *(forces(:, j, 1)*director(:, j, 1) + forces(:, j, 2)*director(:, j, 2) &
          + forces(:, j, 3)*director(:, j, 3))
    end do
  end subroutine add_push

  !> The normal stress of the pushes so far, of some rows; the next ones begin from none.
  pure subroutine take_pushes(fields, rows, thickness)
    type(through_fields_t), intent(inout) :: fields
    integer, intent(in) :: rows(2)                !! first and last
    real(wp), intent(in) :: thickness(:, :)       !! of the control points [length]
    integer :: j

    fields%is_pressed = any(abs(fields%push(:, rows(1):rows(2), :)) > 0.0_wp)
    if (.not. fields%is_pressed) return
    associate (push => fields%push, volume => fields%volume, normal => fields%normal)
      do j = rows(1), rows(2)
        normal(:, j, 1, 1) = -0.5_wp*(push(:, j, 6) + push(:, j, 5))*thickness(:, j)/volume(:, j)
        normal(:, j, 1, 2) = -0.5_wp*(push(:, j, 6) - push(:, j, 5))*thickness(:, j)/volume(:, j)
        push(:, j, :) = 0.0_wp
      end do
    end associate
  end subroutine take_pushes

  !> Normal stress at the integration points of a block.
  subroutine normal_at_points(patch, points, block, w, normal, values)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: w(:)                   !! weights of the block, where there are any
    real(wp), intent(in) :: normal(:, :, :, :)     !! of the control points
    real(wp), intent(out) :: values(:, :, :)       !! shape (8, 2, q1*q2)
    real(wp) :: u(n_lanes*product(patch%axes%degree + 1), 2)
    integer :: c

    call gather_field(patch, block, 2, 1.0_wp, normal, u)
    if (patch%is_rational) call weigh_block(size(u, 1), 2, w, u)
    associate (p => patch%axes%degree, q => patch%axes%n_points, cut => patch%lanes%cut, &
               k => cut_number(patch, block))
      if (k > 0) then
        call to_scattered(p(1), p(2), q(1)*q(2), cut%values1(:, :, :, k), cut%values2(:, :, :, k), &
                          u, values)
      else
        call to_points(p(1), p(2), q(1), q(2), patch%lanes%values(:, :, :, block%b), &
                       patch%axes(2)%values(:, :, block%e2), u, values)
      end if
    end associate
    if (.not. patch%is_rational) return
    do c = 1, 2
      values(:, c, :) = values(:, c, :)*points%rational(:, 1, :, block%number)
    end do
  end subroutine normal_at_points

  !> Fields of the control points of a block at its points.
  pure subroutine to_points(p1, p2, q1, q2, n1, n2, u, values)
    integer, intent(in) :: p1, p2, q1, q2
    real(wp), intent(in) :: n1(8, p1 + 1, q1), n2(p2 + 1, q2), u(8, p1 + 1, p2 + 1, 2)
    real(wp), intent(out) :: values(8, 2, q2*q1)
    real(wp) :: line(8, p2 + 1)
    integer :: c, qa, qb, i, j

    do c = 1, 2
      do qa = 1, q1
        line = 0.0_wp
        do j = 1, p2 + 1
          do i = 1, p1 + 1
            line(:, j) = line(:, j) + n1(:, i, qa)*u(:, i, j, c)
          end do
        end do
        do qb = 1, q2
          values(:, c, qb + q2*(qa - 1)) = 0.0_wp
          do j = 1, p2 + 1
            values(:, c, qb + q2*(qa - 1)) = values(:, c, qb + q2*(qa - 1)) + n2(j, qb)*line(:, j)
          end do
        end do
      end do
    end do
  end subroutine to_points

  !> The same for points that lie anywhere in their elements.
  pure subroutine to_scattered(p1, p2, n, n1, n2, u, values)
    integer, intent(in) :: p1, p2, n
    real(wp), intent(in) :: n1(8, p1 + 1, n), n2(8, p2 + 1, n), u(8, p1 + 1, p2 + 1, 2)
    real(wp), intent(out) :: values(8, 2, n)
    integer :: c, k, i, j

    values = 0.0_wp
    do k = 1, n
      do c = 1, 2
        do j = 1, p2 + 1
          do i = 1, p1 + 1
            values(:, c, k) = values(:, c, k) + n1(:, i, k)*n2(:, j, k)*u(:, i, j, c)
          end do
        end do
      end do
    end do
  end subroutine to_scattered

  !> The transposed of `to_scattered`, of one field.
  pure subroutine from_scattered(p1, p2, n, n1, n2, h, f)
    integer, intent(in) :: p1, p2, n
    real(wp), intent(in) :: n1(8, p1 + 1, n), n2(8, p2 + 1, n), h(8, n)
    real(wp), intent(out) :: f(8, p1 + 1, p2 + 1)
    integer :: k, i, j

    f = 0.0_wp
    do k = 1, n
      do j = 1, p2 + 1
        do i = 1, p1 + 1
          f(:, i, j) = f(:, i, j) + n1(:, i, k)*n2(:, j, k)*h(:, k)
        end do
      end do
    end do
  end subroutine from_scattered

  !> Add values at the points of a block, times their volumes, to the sums of its control points:
  !! the transposed of `normal_at_points`.
  subroutine add_values(patch, points, tile, block, w, values, sums, border)
    type(solid_patch_t), intent(in) :: patch
    type(shell_points_t), intent(in) :: points
    type(tile_t), intent(in) :: tile
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: w(:)                   !! as above
    real(wp), intent(in) :: values(:, :)           !! shape (8, q1*q2)
    real(wp), intent(inout), contiguous :: sums(:, :, :, :), border(:, :, :, :)
    real(wp) :: f(n_lanes*product(patch%axes%degree + 1), 1)
    real(wp) :: h(size(values, 1), size(values, 2))

    h = points%volume(:, :, block%number)*values
    if (patch%is_rational) h = h*points%rational(:, 1, :, block%number)
    associate (p => patch%axes%degree, q => patch%axes%n_points, cut => patch%lanes%cut, &
               k => cut_number(patch, block))
      if (k > 0) then
        call from_scattered(p(1), p(2), q(1)*q(2), cut%values1(:, :, :, k), &
                            cut%values2(:, :, :, k), h, f)
      else
        call from_points(p(1), p(2), q(1), q(2), patch%lanes%values(:, :, :, block%b), &
                         patch%axes(2)%values(:, :, block%e2), h, f)
      end if
    end associate
    call add_forces(patch, tile, block, w, f, sums, border)
  end subroutine add_values

  !> The transposed of `to_points`, of one field.
  pure subroutine from_points(p1, p2, q1, q2, n1, n2, h, f)
    integer, intent(in) :: p1, p2, q1, q2
    real(wp), intent(in) :: n1(8, p1 + 1, q1), n2(p2 + 1, q2), h(8, q2*q1)
    real(wp), intent(out) :: f(8, p1 + 1, p2 + 1)
    real(wp) :: line(8)
    integer :: qa, qb, i, j

    f = 0.0_wp
    do qa = 1, q1
      do j = 1, p2 + 1
        line = 0.0_wp
        do qb = 1, q2
          line = line + n2(j, qb)*h(:, qb + q2*(qa - 1))
        end do
        do i = 1, p1 + 1
          f(:, i, j) = f(:, i, j) + n1(:, i, qa)*line
        end do
      end do
    end do
  end subroutine from_points

end module through_thickness
