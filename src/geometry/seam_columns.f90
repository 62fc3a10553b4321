!> Columns of control points along axis 3, and which of them seams leave whole.
!!
!! Where a seam runs through the thickness, a column of one patch is a column of each other patch
!! there. A seam may also join a column to something else: to the layer below it, to a column along
!! another axis, to a part of a longer one. Such columns are not whole.
module seam_columns
  use seams, only: seams_t, group_table
  implicit none
  private

  public :: whole_columns

  !> A yes or no for every column of a patch.
  type, public :: column_mask_t
    logical, allocatable :: values(:, :)   !! shape (n1, n2)
  end type column_mask_t

  !> Groups of control points on the columns of a patch.
  type :: table_t
    integer, allocatable :: group(:, :, :)   !! 0 where there is none
  end type table_t

  !> The column that each group was first met on.
  type :: owners_t
    integer, allocatable :: column(:), level(:), depth(:)
  end type owners_t

contains

  !> Columns on no seam, and those whose control points are exactly the same in all their patches,
  !! in the same or the opposite order.
  pure function whole_columns(seams, extents) result(is_whole)
    type(seams_t), intent(in) :: seams
    integer, intent(in) :: extents(:, :)             !! control points by axis and patch, (3, n)
    type(column_mask_t) :: is_whole(size(extents, 2))
    type(table_t) :: tables(size(extents, 2))
    type(owners_t) :: owners
    logical :: is_mixed(seams%n_groups)
    integer :: p, i, j

    allocate (owners%column(seams%n_groups), owners%level(seams%n_groups), &
              owners%depth(seams%n_groups), source=0)
    is_mixed = .false.
    do p = 1, size(tables)
      allocate (tables(p)%group(extents(1, p), extents(2, p), extents(3, p)))
      tables(p)%group = reshape(group_table(seams, p, product(extents(:, p))), &
                                shape(tables(p)%group))
      do j = 1, extents(2, p)
        do i = 1, extents(1, p)
          call compare(tables(p)%group(i, j, :), owners, is_mixed)
        end do
      end do
    end do
    do p = 1, size(tables)
      allocate (is_whole(p)%values(extents(1, p), extents(2, p)))
      do j = 1, extents(2, p)
        do i = 1, extents(1, p)
          is_whole(p)%values(i, j) = .not. is_any(tables(p)%group(i, j, :), is_mixed)
        end do
      end do
    end do
  end function whole_columns

  !> Mark the groups of a column if they are not met as they were before. A column is known by the
  !! lesser group of its ends.
  pure subroutine compare(groups, owners, is_mixed)
    integer, intent(in) :: groups(:)
    type(owners_t), intent(inout) :: owners
    logical, intent(inout) :: is_mixed(:)
    integer :: k, n, level, column

    if (all(groups == 0)) return
    n = size(groups)
    column = min(groups(1), groups(n))
    if (any(groups == 0)) column = 0
    do k = 1, n
      if (groups(k) == 0) cycle
      level = merge(k, n + 1 - k, groups(1) == column)
      associate (g => groups(k))
        if (owners%depth(g) == 0) then
          owners%column(g) = column
          owners%level(g) = level
          owners%depth(g) = n
        end if
        if (column == 0 .or. owners%column(g) /= column .or. owners%level(g) /= level &
            .or. owners%depth(g) /= n) is_mixed(g) = .true.
      end associate
    end do
  end subroutine compare

  pure logical function is_any(groups, is_mixed)
    integer, intent(in) :: groups(:)
    logical, intent(in) :: is_mixed(:)
    integer :: k

    is_any = .false.
    do k = 1, size(groups)
      if (groups(k) > 0) is_any = is_any .or. is_mixed(groups(k))
    end do
  end function is_any

end module seam_columns
