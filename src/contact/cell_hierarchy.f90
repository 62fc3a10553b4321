!> Bounding-volume hierarchy of cells: boxes around groups of them, around groups of these, and so
!! on. It tells which cells may be nearest to a point at any distance.
!!
!! Cells that follow each other are next to each other, so groups of eight in their order are small.
module cell_hierarchy
  use kinds, only: wp
  implicit none
  private

  public :: cell_hierarchy_t, new_cell_hierarchy, nearest_leaf, distance_to_leaves, collect_leaves

  integer, parameter :: n_children = 8
  integer, parameter :: max_levels = 12

  !> Level 0 are the cells themselves.
  type :: cell_hierarchy_t
    integer :: n_levels = 0                    !! above the cells
    integer :: first(0:max_levels) = 0         !! boxes before those of a level
    integer :: n(0:max_levels) = 0             !! boxes of a level
    real(wp), allocatable :: boxes(:, :, :)    !! corners [length], shape (3, 2, all boxes)
  end type cell_hierarchy_t

contains

  pure subroutine new_cell_hierarchy(tree, boxes)
    type(cell_hierarchy_t), intent(out) :: tree
    real(wp), intent(in) :: boxes(:, :, :)     !! of the cells [length], shape (3, 2, n)
    integer :: level, i, from, to

    tree%n(0) = size(boxes, 3)
    do while (tree%n(tree%n_levels) > 1)
      tree%n_levels = tree%n_levels + 1
      tree%n(tree%n_levels) = (tree%n(tree%n_levels - 1) + n_children - 1)/n_children
      tree%first(tree%n_levels) = tree%first(tree%n_levels - 1) + tree%n(tree%n_levels - 1)
    end do
    allocate (tree%boxes(3, 2, sum(tree%n)))
    tree%boxes(:, :, :tree%n(0)) = boxes
    do level = 1, tree%n_levels
      do i = 1, tree%n(level)
        from = tree%first(level - 1) + n_children*(i - 1) + 1
        to = tree%first(level - 1) + min(n_children*i, tree%n(level - 1))
        tree%boxes(:, 1, tree%first(level) + i) = minval(tree%boxes(:, 1, from:to), 2)
        tree%boxes(:, 2, tree%first(level) + i) = maxval(tree%boxes(:, 2, from:to), 2)
      end do
    end do
  end subroutine new_cell_hierarchy

  !> A cell near a point: at each level the child whose box is nearest.
  pure integer function nearest_leaf(tree, x) result(leaf)
    type(cell_hierarchy_t), intent(in) :: tree
    real(wp), intent(in) :: x(3)
    integer :: level, i, before
    real(wp) :: squares(n_children)

    leaf = 1
    do level = tree%n_levels, 1, -1
      before = n_children*(leaf - 1)
      squares = huge(1.0_wp)
      do i = 1, min(n_children, tree%n(level - 1) - before)
        squares(i) = square_to(tree%boxes(:, :, tree%first(level - 1) + before + i), x)
      end do
      leaf = before + minloc(squares, 1)
    end do
  end function nearest_leaf

  !> Distance from a point to the nearest box of a cell.
  pure real(wp) function distance_to_leaves(tree, x) result(distance)
    type(cell_hierarchy_t), intent(in) :: tree
    real(wp), intent(in) :: x(3)
    real(wp) :: least   ! square of it so far

    least = square_to(tree%boxes(:, :, nearest_leaf(tree, x)), x)
    call search_below(tree, x, tree%n_levels, 1, least)
    distance = sqrt(least)
  end function distance_to_leaves

  !> Take the nearest cell of a box, if it is nearer.
  pure recursive subroutine search_below(tree, x, level, box, least)
    type(cell_hierarchy_t), intent(in) :: tree
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: level, box
    real(wp), intent(inout) :: least   !! squared distance [length^2]
    real(wp) :: square
    integer :: i

    square = square_to(tree%boxes(:, :, tree%first(level) + box), x)
    if (square >= least) return
    if (level == 0) then
      least = square
      return
    end if
    do i = n_children*(box - 1) + 1, min(n_children*box, tree%n(level - 1))
      call search_below(tree, x, level - 1, i, least)
    end do
  end subroutine search_below

  !> Cells whose boxes are within a distance of a point.
  pure subroutine collect_leaves(tree, x, distance, leaves)
    type(cell_hierarchy_t), intent(in) :: tree
    real(wp), intent(in) :: x(3), distance             !! [length]
    integer, allocatable, intent(out) :: leaves(:)
    integer, allocatable :: parents(:)
    integer :: level, i, k, n

    allocate (leaves(1), source=1)
    do level = tree%n_levels, 1, -1
      call move_alloc(leaves, parents)
      allocate (leaves(n_children*size(parents)))
      n = 0
      do k = 1, size(parents)
        do i = n_children*(parents(k) - 1) + 1, min(n_children*parents(k), tree%n(level - 1))
          if (square_to(tree%boxes(:, :, tree%first(level - 1) + i), x) > distance**2) cycle
          n = n + 1
          leaves(n) = i
        end do
      end do
      leaves = leaves(:n)
    end do
  end subroutine collect_leaves

  !> Squared distance from a point to a box.
  pure real(wp) function square_to(box, x)
    real(wp), intent(in) :: box(3, 2), x(3)

    square_to = sum(max(box(:, 1) - x, x - box(:, 2), 0.0_wp)**2)
  end function square_to

end module cell_hierarchy
