!> Seams: control points that are one point in space, of several patches or of one patch that
!! closes upon itself.
!!
!! Fields stay with their patches. Three calls bring the members of a seam together: `collect` from
!! each patch, `sum_groups` (or `largest_of_groups`) in the order of the members, `distribute` to
!! each patch. All members are then bitwise identical, whatever the number of threads.
!!
!! Where a seam runs through the thickness, a column of control points along axis 3 of one patch is
!! a column of each other patch there. A seam may also join a column to something else: to the layer
!! below it, to a column along another axis, to a part of a longer one. Such columns are not whole.
module patch_seams
  use kinds, only: wp
  use linear_algebra, only: sorted_order
  use nurbs_solid, only: nurbs_solid_t
  implicit none
  private

  public :: seams_t, no_seams, find_seams, collect, sum_groups, largest_of_groups, distribute, &
            group_table, is_counted, whole_columns, top_of

  integer, parameter :: most_components = 3

  !> Groups of control points in a compressed list. Members are sorted by patch, then by point.
  type :: seams_t
    integer :: n_groups = 0
    integer, allocatable :: first(:)        !! members of group g: first(g) to first(g + 1) - 1
    integer, allocatable :: patch(:)        !! of each member
    integer, allocatable :: point(:)        !! its position in the grid of its patch, axis 1 fastest
    integer, allocatable :: patch_first(:)  !! of patch p: patch_first(p) to patch_first(p + 1) - 1
    integer, allocatable :: of_patch(:)     !! ... in this list of members
    real(wp), allocatable :: values(:, :)   !! of each member, in between; shape (n_members, 3)
  end type seams_t

  !> A yes or no for every column of a patch.
  type, public :: column_mask_t
    logical, allocatable :: values(:, :)   !! shape (n1, n2)
  end type column_mask_t

  !> The column that each group was first met on.
  type :: owners_t
    integer, allocatable :: column(:), level(:), depth(:)
  end type owners_t

contains

  !> Seams of a blank that has none.
  pure function no_seams(n_patches) result(seams)
    integer, intent(in) :: n_patches
    type(seams_t) :: seams
    integer :: i

    allocate (seams%first, source=[1])
    allocate (seams%patch(0), seams%point(0), seams%of_patch(0), seams%values(0, most_components))
    allocate (seams%patch_first, source=[(1, i=1, n_patches + 1)])
  end function no_seams

  !> Find the control points on the outsides of the solids that coincide, and put all members of a
  !! group exactly where its first member is.
  pure subroutine find_seams(solids, tolerance, seams)
    type(nurbs_solid_t), intent(inout) :: solids(:)
    real(wp), intent(in) :: tolerance             !! largest distance within a group [length]
    type(seams_t), intent(out) :: seams
    integer, allocatable :: patch(:), point(:), root(:)
    real(wp), allocatable :: x(:, :)
    integer :: p, i, g, to(3), from(3)

    call list_outsides(solids, patch, point, x)
    call join_close_points(x, tolerance, root)
    seams = groups_of(size(solids), patch, point, root)
    do g = 1, seams%n_groups
      associate (first => seams%first(g))
        p = seams%patch(first)
        from = indices_of(solids(p), seams%point(first))
        do i = first + 1, seams%first(g + 1) - 1
          to = indices_of(solids(seams%patch(i)), seams%point(i))
          solids(seams%patch(i))%points(to(1), to(2), to(3), :) = &
            solids(p)%points(from(1), from(2), from(3), :)
        end do
      end associate
    end do
  end subroutine find_seams

  !> Control points on the six faces of every solid, each once, sorted by patch and position.
  pure subroutine list_outsides(solids, patch, point, x)
    type(nurbs_solid_t), intent(in) :: solids(:)
    integer, allocatable, intent(out) :: patch(:), point(:)
    real(wp), allocatable, intent(out) :: x(:, :)   !! shape (3, n)
    integer :: p, i, j, k, n(3), m

    m = 0
    do p = 1, size(solids)
      n = solids(p)%axes%n_basis
      m = m + product(n) - product(max(n - 2, 0))
    end do
    allocate (patch(m), point(m), x(3, m))
    m = 0
    do p = 1, size(solids)
      n = solids(p)%axes%n_basis
      do k = 1, n(3)
        do j = 1, n(2)
          do i = 1, n(1)
            if (all([i, j, k] > 1 .and. [i, j, k] < n)) cycle
            m = m + 1
            patch(m) = p
            point(m) = i + n(1)*((j - 1) + n(2)*(k - 1))
            x(:, m) = solids(p)%points(i, j, k, :)
          end do
        end do
      end do
    end do
  end subroutine list_outsides

  !> For each point the first of those that coincide with it. The points are swept along a direction
  !! in which no two of a regular grid are alike.
  pure subroutine join_close_points(x, tolerance, root)
    real(wp), intent(in) :: x(:, :), tolerance
    integer, allocatable, intent(out) :: root(:)
    real(wp), parameter :: direction(3) = [0.538516_wp, 0.671717_wp, 0.508639_wp]
    integer, allocatable :: order(:)
    real(wp) :: along(size(x, 2))
    integer :: a, b, i, j, low

    root = [(i, i=1, size(x, 2))]
    along = matmul(direction, x)
    order = sorted_order(along)
    do i = 1, size(order)
      a = order(i)
      do j = i + 1, size(order)
        b = order(j)
        if (along(b) - along(a) > 2.0_wp*tolerance) exit
        if (sum((x(:, a) - x(:, b))**2) > tolerance**2) cycle
        low = min(top_of(root, a), top_of(root, b))
        root(top_of(root, a)) = low
        root(top_of(root, b)) = low
      end do
    end do
    do i = 1, size(root)
      root(i) = top_of(root, i)
    end do
  end subroutine join_close_points

  !> Where the chain of roots from a place ends.
  pure integer function top_of(root, i) result(top)
    integer, intent(in) :: root(:), i

    top = i
    do while (root(top) /= top)
      top = root(top)
    end do
  end function top_of

  !> Lists of the groups that have more than one member.
  pure function groups_of(n_patches, patch, point, root) result(seams)
    integer, intent(in) :: n_patches, patch(:), point(:), root(:)
    type(seams_t) :: seams
    integer :: n_of(size(root)), group(size(root)), next(size(root) + 1), i, n, p

    n_of = 0
    do i = 1, size(root)
      n_of(root(i)) = n_of(root(i)) + 1
    end do
    seams = no_seams(n_patches)
    n = sum(n_of, mask=n_of > 1)
    group = 0
    next(1) = 1
    do i = 1, size(root)
      if (n_of(i) < 2) cycle
      seams%n_groups = seams%n_groups + 1
      group(i) = seams%n_groups
      next(group(i) + 1) = next(group(i)) + n_of(i)
    end do
    seams%first = next(:seams%n_groups + 1)
    deallocate (seams%patch, seams%point, seams%values)
    allocate (seams%patch(n), seams%point(n), seams%values(n, most_components))
    do i = 1, size(root)
      if (group(root(i)) == 0) cycle
      associate (at => next(group(root(i))))
        seams%patch(at) = patch(i)
        seams%point(at) = point(i)
        at = at + 1
      end associate
    end do
    seams%of_patch = [integer ::]
    do p = 1, n_patches
      seams%of_patch = [seams%of_patch, pack([(i, i=1, n)], seams%patch == p)]
      seams%patch_first(p + 1) = size(seams%of_patch) + 1
    end do
  end function groups_of

  pure function indices_of(solid, point) result(at)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: point
    integer :: at(3)

    associate (n => solid%axes%n_basis)
      at(1) = mod(point - 1, n(1)) + 1
      at(2) = mod((point - 1)/n(1), n(2)) + 1
      at(3) = (point - 1)/(n(1)*n(2)) + 1
    end associate
  end function indices_of

  !> Take the values of the members in one patch from a field on its control points.
  pure subroutine collect(seams, patch, n, m, field)
    type(seams_t), intent(inout) :: seams
    integer, intent(in) :: patch, n, m       !! patch, control points, components (at most 3)
    real(wp), intent(in) :: field(n, m)
    integer :: i, c

    do c = 1, m
      do i = seams%patch_first(patch), seams%patch_first(patch + 1) - 1
        associate (member => seams%of_patch(i))
          seams%values(member, c) = field(seams%point(member), c)
        end associate
      end do
    end do
  end subroutine collect

  !> Give every member the sum over its group, added in the order of the members.
  pure subroutine sum_groups(seams, m)
    type(seams_t), intent(inout) :: seams
    integer, intent(in) :: m   !! components
    integer :: g, c

    do c = 1, m
      do g = 1, seams%n_groups
        associate (values => seams%values(seams%first(g):seams%first(g + 1) - 1, c))
          values = sum(values)
        end associate
      end do
    end do
  end subroutine sum_groups

  !> Give every member the largest value of its group.
  pure subroutine largest_of_groups(seams, m)
    type(seams_t), intent(inout) :: seams
    integer, intent(in) :: m   !! components
    integer :: g, c

    do c = 1, m
      do g = 1, seams%n_groups
        associate (values => seams%values(seams%first(g):seams%first(g + 1) - 1, c))
          values = maxval(values)
        end associate
      end do
    end do
  end subroutine largest_of_groups

  !> Put the values of the members into a field of their patch.
  pure subroutine distribute(seams, patch, n, m, field)
    type(seams_t), intent(in) :: seams
    integer, intent(in) :: patch, n, m       !! patch, control points, components (at most 3)
    real(wp), intent(inout) :: field(n, m)
    integer :: i, c

    do c = 1, m
      do i = seams%patch_first(patch), seams%patch_first(patch + 1) - 1
        associate (member => seams%of_patch(i))
          field(seams%point(member), c) = seams%values(member, c)
        end associate
      end do
    end do
  end subroutine distribute

  !> Group of every control point of a patch, 0 where it belongs to none.
  pure function group_table(seams, patch, n) result(group)
    type(seams_t), intent(in) :: seams
    integer, intent(in) :: patch, n   !! patch and its number of control points
    integer :: group(n), g, i

    group = 0
    do g = 1, seams%n_groups
      do i = seams%first(g), seams%first(g + 1) - 1
        if (seams%patch(i) == patch) group(seams%point(i)) = g
      end do
    end do
  end function group_table

  !> Is a control point the one of its group that counts where each point counts once?
  pure function is_counted(seams, patch, n) result(counts)
    type(seams_t), intent(in) :: seams
    integer, intent(in) :: patch, n   !! patch and its number of control points
    logical :: counts(n)
    integer :: g, i

    counts = .true.
    do g = 1, seams%n_groups
      do i = seams%first(g) + 1, seams%first(g + 1) - 1
        if (seams%patch(i) == patch) counts(seams%point(i)) = .false.
      end do
    end do
  end function is_counted

  !> Columns on no seam, and those whose control points are exactly the same in all their patches,
  !! in the same or the opposite order.
  pure function whole_columns(seams, extents) result(is_whole)
    type(seams_t), intent(in) :: seams
    integer, intent(in) :: extents(:, :)             !! control points by axis and patch, (3, n)
    type(column_mask_t) :: is_whole(size(extents, 2))
    integer, allocatable :: groups(:, :, :)     ! of a patch; 0 where there is none
    type(owners_t) :: owners
    logical :: is_mixed(seams%n_groups)
    integer :: p, i, j

    allocate (owners%column(seams%n_groups), owners%level(seams%n_groups), &
              owners%depth(seams%n_groups), source=0)
    is_mixed = .false.
    do p = 1, size(is_whole)
      groups = reshape(group_table(seams, p, product(extents(:, p))), &
                       [extents(1, p), extents(2, p), extents(3, p)])
      do j = 1, extents(2, p)
        do i = 1, extents(1, p)
          call compare(groups(i, j, :), owners, is_mixed)
        end do
      end do
    end do
    do p = 1, size(is_whole)
      groups = reshape(group_table(seams, p, product(extents(:, p))), &
                       [extents(1, p), extents(2, p), extents(3, p)])
      allocate (is_whole(p)%values(extents(1, p), extents(2, p)))
      do j = 1, extents(2, p)
        do i = 1, extents(1, p)
          is_whole(p)%values(i, j) = .not. any(is_mixed(pack(groups(i, j, :), &
                                                             groups(i, j, :) > 0)))
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

end module patch_seams