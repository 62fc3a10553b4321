!> Projection of point fields along the lines of a patch: the blocks of a line are copied side by
!! side, projected and copied back. Lines are worked in parallel; none knows of another.
module smooth_lines
  use kinds, only: wp
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t
  use smooth_axis, only: project_lines
  implicit none
  private

  public :: project_field

contains

  !> Project a field of the points of all blocks along the axes given, in place.
  subroutine project_field(patch, along, is_transposed, n_fields, field)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: along(:), n_fields
    logical, intent(in) :: is_transposed              !! for forces
    real(wp), intent(inout) :: field(n_lanes*product(patch%axes%n_points)*n_fields, &
                                     patch%lanes%n_blocks, patch%axes(2)%n_elements, &
                                     patch%axes(3)%n_elements)
    integer :: i, b, e2, e3

    do i = 1, size(along)
      select case (along(i))
      case (1)
        !$omp parallel do collapse(2) schedule(static) default(shared) private(e2, e3)
        do e3 = 1, size(field, 4)
          do e2 = 1, size(field, 3)
            call project_row(patch, is_transposed, patch%axes%n_points, n_fields, &
                             size(field, 2), field(:, :, e2, e3))
          end do
        end do
        !$omp end parallel do
      case (2)
        !$omp parallel do collapse(2) schedule(static) default(shared) private(b, e3)
        do e3 = 1, size(field, 4)
          do b = 1, size(field, 2)
            call project_across(patch, is_transposed, patch%axes%n_points, n_fields, &
                                size(field, 3), field(:, b, :, e3))
          end do
        end do
        !$omp end parallel do
      case default
        !$omp parallel do collapse(2) schedule(static) default(shared) private(b, e2)
        do e2 = 1, size(field, 3)
          do b = 1, size(field, 2)
            call project_through(patch, is_transposed, patch%axes%n_points, n_fields, &
                                 size(field, 4), field(:, b, e2, :))
          end do
        end do
        !$omp end parallel do
      end select
    end do
  end subroutine project_field

  !> Along axis 1. Lanes that repeat an element get its strains too, but no stress.
  pure subroutine project_row(patch, is_transposed, q, n_fields, n_blocks, field)
    type(ig_patch_t), intent(in) :: patch
    logical, intent(in) :: is_transposed
    integer, intent(in) :: q(3), n_fields, n_blocks
    real(wp), intent(inout) :: field(n_lanes, q(3)*n_fields*q(2), q(1), n_blocks)
    real(wp), allocatable :: lines(:, :, :)    ! on the heap: thread stacks are small
    integer :: b, i, lane

    allocate (lines(size(field, 2), q(1), patch%axes(1)%n_elements))
    associate (element => patch%lanes%element, is_owner => patch%lanes%is_owner)
      do b = 1, n_blocks
        do i = 1, q(1)
          do lane = 1, n_lanes
            if (is_owner(lane, b)) lines(:, i, element(lane, b)) = field(lane, :, i, b)
          end do
        end do
      end do
      call project_lines(patch%projection%smooth(1), is_transposed, size(lines, 1), &
                         size(lines)/size(lines, 1), 1, lines)
      do b = 1, n_blocks
        do i = 1, q(1)
          do lane = 1, n_lanes
            if (is_transposed .and. .not. is_owner(lane, b)) then
              field(lane, :, i, b) = 0.0_wp
            else
              field(lane, :, i, b) = lines(:, i, element(lane, b))
            end if
          end do
        end do
      end do
    end associate
  end subroutine project_row

  !> Along axis 2.
  pure subroutine project_across(patch, is_transposed, q, n_fields, n_elements, field)
    type(ig_patch_t), intent(in) :: patch
    logical, intent(in) :: is_transposed
    integer, intent(in) :: q(3), n_fields, n_elements
    real(wp), intent(inout) :: field(n_lanes*q(3)*n_fields, q(2), q(1), n_elements)
    real(wp), allocatable :: lines(:, :, :, :)
    integer :: e, i

    allocate (lines(size(field, 1), q(1), q(2), n_elements))
    do e = 1, n_elements
      do i = 1, q(1)
        lines(:, i, :, e) = field(:, :, i, e)
      end do
    end do
    call project_lines(patch%projection%smooth(2), is_transposed, size(lines, 1)*q(1), &
                       q(2)*n_elements, 1, lines)
    do e = 1, n_elements
      do i = 1, q(1)
        field(:, :, i, e) = lines(:, i, :, e)
      end do
    end do
  end subroutine project_across

  !> Along axis 3.
  pure subroutine project_through(patch, is_transposed, q, n_fields, n_elements, field)
    type(ig_patch_t), intent(in) :: patch
    logical, intent(in) :: is_transposed
    integer, intent(in) :: q(3), n_fields, n_elements
    real(wp), intent(inout) :: field(n_lanes, q(3), n_fields*q(2)*q(1), n_elements)
    real(wp), allocatable :: lines(:, :, :, :)
    integer :: e, i

    allocate (lines(n_lanes, size(field, 3), q(3), n_elements))
    do e = 1, n_elements
      do i = 1, q(3)
        lines(:, :, i, e) = field(:, i, :, e)
      end do
    end do
    call project_lines(patch%projection%smooth(3), is_transposed, n_lanes*size(field, 3), &
                       q(3)*n_elements, 1, lines)
    do e = 1, n_elements
      do i = 1, q(3)
        field(:, i, :, e) = lines(:, :, i, e)
      end do
    end do
  end subroutine project_through

end module smooth_lines
