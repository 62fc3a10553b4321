!> Stiffness of draw beads in static increments: springs across the line of points that the bead
!! holds. Points that slide have none.
module bead_stiffness
  use kinds, only: wp
  use draw_bead, only: draw_bead_t, find_spring
  use effect, only: effect_slot_t
  use element, only: part_t
  use body_stiffness, only: body_stiffness_t
  use sparse_matrix, only: add_block
  implicit none
  private

  public :: add_bead_stiffness, any_bead

contains

  !> Add the springs as the effects left them.
  subroutine add_bead_stiffness(stiffness, parts, effects)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(part_t), intent(in) :: parts(:)
    type(effect_slot_t), intent(in) :: effects(:)
    integer :: i

    do i = 1, size(effects)
      select type (bead => effects(i)%item)
      type is (draw_bead_t)
        call add_bead(stiffness, parts(bead%part), bead)
      end select
    end do
  end subroutine add_bead_stiffness

  !> Does a bead act?
  pure logical function any_bead(effects)
    type(effect_slot_t), intent(in) :: effects(:)
    integer :: i

    any_bead = .false.
    do i = 1, size(effects)
      select type (bead => effects(i)%item)
      type is (draw_bead_t)
        any_bead = .true.
      end select
    end do
  end function any_bead

  !> Points move with the control points of their face; on a shell the arm to its mid-surface is
  !! left out.
  subroutine add_bead(stiffness, part, bead)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(part_t), intent(in) :: part
    type(draw_bead_t), intent(in) :: bead
    real(wp), allocatable :: x(:, :, :)
    real(wp) :: across(3), spring
    integer :: p

    allocate (x, mold=bead%held)
    call part%element%face_net(bead%face, x)
    do p = 1, size(bead%points)
      call find_spring(bead, p, x, across, spring)
      if (spring > 0.0_wp) call add_point(stiffness, bead, p, across, spring)
    end do
  end subroutine add_bead

  subroutine add_point(stiffness, bead, p, across, spring)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(draw_bead_t), intent(in) :: bead
    integer, intent(in) :: p
    real(wp), intent(in) :: across(3), spring
    integer, allocatable :: components(:)
    real(wp), allocatable :: way(:, :)
    integer :: place(3), axes(2), axis, i, j, c, k

    associate (point => bead%points(p), grid => stiffness%grids(bead%part))
      axis = (bead%face + 1)/2
      axes = pack([1, 2, 3], [1, 2, 3] /= axis)
      place(axis) = merge(1, grid%n(axis), mod(bead%face, 2) == 1)
      allocate (components(3*size(point%basis)), way(1, 3*size(point%basis)))
      k = 0
      do j = 1, size(point%basis, 2)
        do i = 1, size(point%basis, 1)
          place(axes) = point%first + [i, j] - 1
          do c = 1, 3
            k = k + 1
            components(k) = c + 3*(grid%n_before + place(1) - 1 &
                                   + grid%n(1)*(place(2) - 1 + grid%n(2)*(place(3) - 1)))
            way(1, k) = point%basis(i, j)*across(c)
          end do
        end do
      end do
    end associate
    call add_block(stiffness%matrix, stiffness%map, components, &
                   spring*matmul(transpose(way), way))
  end subroutine add_point

end module bead_stiffness
