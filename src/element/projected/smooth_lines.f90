!> From the loads of the splines of each element to the coefficients of those of the patch: elements
!! that share a spline are added in fixed order, lines of splines solved for. Lines are worked in
!! parallel; none knows of another. Those along axis 1 are solved for by the tiles, if each has
!! whole rows of elements: their loads need not be kept.
module smooth_lines
  use kinds, only: wp
  use basis_tables, only: n_lanes
  use ig_patch, only: ig_patch_t
  use smooth_fields, only: smooth_fields_t
  use smooth_axis, only: solve_columns, solve_rows
  use strain_projection, only: project_sheet
  implicit none
  private

  public :: solve_for_splines, solve_row

contains

  !> Coefficients of all that is projected, the first `n_means` of what all axes project.
  subroutine solve_for_splines(patch, n_means, fields)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: n_means
    type(smooth_fields_t), intent(inout) :: fields
    integer :: row, i, k, b, n_rows, first

    do k = 1, n_means
      call solve_all(patch, fields%loads(:, :, :, :, k, :), fields%all(:, :, :, k))
    end do
    if (patch%projection%kind /= project_sheet) return
    n_rows = patch%axes(2)%n_elements
    associate (n_blocks => patch%lanes%n_blocks, n3 => patch%axes(3)%n_elements)
      !$omp parallel default(shared) private(row, first, i, b, k)
      !$omp do schedule(static)
      do row = 1, merge(n_rows*n3, 0, allocated(fields%loads1))
        first = n_blocks*(row - 1) + 1
        call solve_row(patch, size(fields%along1, 1), &
                       fields%loads1(:, :, first:first + n_blocks - 1), fields%along1(:, :, row))
      end do
      !$omp end do nowait
      !$omp do collapse(2) schedule(static)
      do k = 1, n_blocks*n3
        do i = 1, patch%axes(1)%n_points
          first = mod(k - 1, n_blocks) + 1 + n_blocks*n_rows*((k - 1)/n_blocks)
          call solve_across(patch, first, i, size(fields%along2, 1), fields%loads2, &
                            fields%along2(:, :, i, k))
        end do
      end do
      !$omp end do
      !$omp end parallel
    end associate
  end subroutine solve_for_splines

  !> Along axis 1, from all blocks of a row of elements.
  pure subroutine solve_row(patch, m, loads, coefficients)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: m
    real(wp), intent(in) :: loads(n_lanes, m, patch%axes(1)%degree, patch%lanes%n_blocks)
    real(wp), intent(inout) :: coefficients(m, patch%projection%smooth(1)%n_functions)
    integer :: first(n_lanes), b, a, l

    coefficients = 0.0_wp
    do b = 1, patch%lanes%n_blocks
      first = patch%lanes%first(:, b)
      do a = 1, size(loads, 3)
        if (patch%lanes%is_contiguous(b)) then
          call add_turned(m, loads(:, :, a, b), coefficients(:, first(1) + a - 1:))
        else
          do l = 1, n_lanes
            coefficients(:, first(l) + a - 1) = coefficients(:, first(l) + a - 1) &
                                                + loads(l, :, a, b)
          end do
        end if
      end do
    end do
    call solve_columns(patch%projection%smooth(1), m, coefficients)
  end subroutine solve_row

  !> Add the lanes of a spline to columns: rows and columns change places eight by eight, in
  !! registers.
  pure subroutine add_turned(m, lanes, columns)
    integer, intent(in) :: m
    real(wp), intent(in) :: lanes(n_lanes, m)
    real(wp), intent(inout) :: columns(m, n_lanes)
    integer :: i, l

    !$omp simd private(l)
    do i = 1, m
      !GCC$ unroll 8
      do l = 1, n_lanes
        columns(i, l) = columns(i, l) + lanes(l, i)
      end do
    end do
  end subroutine add_turned

  !> Along axis 2, from all blocks of which `first` is the first.
  pure subroutine solve_across(patch, first, point, m, loads, coefficients)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: first, point, m       !! point along axis 1
    real(wp), intent(in) :: loads(:, :, :, :)
    real(wp), intent(inout) :: coefficients(m, patch%projection%smooth(2)%n_functions)
    integer :: e, a, j, block, l

    coefficients = 0.0_wp
    do e = 1, patch%axes(2)%n_elements
      block = first + patch%lanes%n_blocks*(e - 1)
      do a = 1, size(loads, 2)
        j = patch%axes(2)%first(e) + a - 1
        !$omp simd
        do l = 1, m
          coefficients(l, j) = coefficients(l, j) + loads(l, a, point, block)
        end do
      end do
    end do
    call solve_columns(patch%projection%smooth(2), m, coefficients)
  end subroutine solve_across

  !> Along all axes.
  pure subroutine solve_all(patch, loads, coefficients)
    type(ig_patch_t), intent(in) :: patch
    real(wp), intent(in) :: loads(:, :, :, :, :)        !! (8, p3, p2, p1, n_blocks)
    real(wp), intent(inout) :: coefficients(:, :, :)
    integer :: b, e2, e3, j, k, a, block

    coefficients = 0.0_wp
    block = 0
    do e3 = 1, patch%axes(3)%n_elements
      do e2 = 1, patch%axes(2)%n_elements
        do b = 1, patch%lanes%n_blocks
          block = block + 1
          do a = 1, size(loads, 4)
            do j = 1, size(loads, 3)
              do k = 1, size(loads, 2)
                call add_lanes(patch, b, a, loads(:, k, j, a, block), &
                               coefficients(:, patch%axes(2)%first(e2) + j - 1, &
                                            patch%axes(3)%first(e3) + k - 1))
              end do
            end do
          end do
        end do
      end do
    end do
    associate (n => shape(coefficients), smooth => patch%projection%smooth)
      call solve_rows(smooth(1), n(2)*n(3), coefficients)
      do k = 1, n(3)
        call solve_columns(smooth(2), n(1), coefficients(:, :, k))
      end do
      call solve_columns(smooth(3), n(1)*n(2), coefficients)
    end associate
  end subroutine solve_all

  !> Add the loads of spline `a` of each lane.
  pure subroutine add_lanes(patch, b, a, loads, coefficients)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: b, a
    real(wp), intent(in) :: loads(n_lanes)
    real(wp), intent(inout) :: coefficients(*)
    integer :: first(n_lanes), l

    first = patch%lanes%first(:, b) + a - 1
    if (patch%lanes%is_contiguous(b)) then
      associate (line => coefficients(first(1):first(1) + n_lanes - 1))
        line = line + loads
      end associate
    else
      do l = 1, n_lanes
        coefficients(first(l)) = coefficients(first(l)) + loads(l)
      end do
    end if
  end subroutine add_lanes

end module smooth_lines
