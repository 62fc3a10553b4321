!> Symmetric sparse matrices over the control points of patches.
!!
!! Which entries there are follows from the tensor structure: the control points that share an
!! element with a given one are a box of its patch. Elements, and whatever else couples components,
!! are added as dense blocks over a list of components, one after the other in the order of the
!! calls, so that the result has the same bits always. Blocks may be computed by many threads; to
!! add them costs little compared with the factors.
module sparse_matrix
  use kinds, only: wp
  use bucket_lists, only: sort_into_buckets
  use unknowns, only: unknowns_t
  implicit none
  private

  public :: new_patch_grid, new_symmetric_matrix, set_zero, add_block, add_entry
  public :: element_components

  !> The control points of each element along an axis are `order`, from `first(element)` on.
  type :: spans_t
    integer, allocatable :: first(:), last(:)      !! of each element
    integer, allocatable :: low(:), high(:)        !! of each point: those it shares elements with
  end type spans_t

  !> Control points and elements of a patch.
  type, public :: patch_grid_t
    integer :: n(3) = 0                            !! control points along each axis
    integer :: n_before = 0                        !! points of the patches before
    type(spans_t) :: axis(3)
  end type patch_grid_t

  !> Components that something other than elements couples, such as joints of shells: each with
  !! each of its list, list l being first(l) to first(l + 1) - 1.
  type, public :: couplings_t
    integer, allocatable :: first(:), component(:)
  end type couplings_t

  !> The lower triangle with the diagonal, row by row, columns rising.
  type, public :: symmetric_matrix_t
    integer :: n = 0
    integer, allocatable :: first(:)               !! row i: first(i) to first(i + 1) - 1
    integer, allocatable :: rows(:), columns(:)    !! of each entry
    real(wp), allocatable :: values(:)
  end type symmetric_matrix_t

contains

  !> The grid of a patch from the first control point of each element along its axes.
  pure subroutine new_patch_grid(grid, n, order, first_1, first_2, first_3, n_before)
    type(patch_grid_t), intent(out) :: grid
    integer, intent(in) :: n(3)                    !! control points along each axis
    integer, intent(in) :: order(3)                !! of an element along each axis
    integer, intent(in) :: first_1(:), first_2(:), first_3(:)
    integer, intent(in) :: n_before                !! control points of the patches before

    grid%n = n
    grid%n_before = n_before
    call set_spans(first_1, order(1), n(1), grid%axis(1))
    call set_spans(first_2, order(2), n(2), grid%axis(2))
    call set_spans(first_3, order(3), n(3), grid%axis(3))
  end subroutine new_patch_grid

  pure subroutine set_spans(first, order, n, spans)
    integer, intent(in) :: first(:), order, n
    type(spans_t), intent(inout) :: spans
    integer :: e

    spans%first = first
    spans%last = first + order - 1
    allocate (spans%low(n), source=n)
    allocate (spans%high(n), source=1)
    do e = 1, size(first)
      associate (a => spans%first(e), b => spans%last(e))
        spans%low(a:b) = min(spans%low(a:b), a)
        spans%high(a:b) = max(spans%high(a:b), b)
      end associate
    end do
  end subroutine set_spans

  !> Components of an element: those of a control point together, axis 1 first.
  pure function element_components(grid, element) result(components)
    type(patch_grid_t), intent(in) :: grid
    integer, intent(in) :: element(3)
    integer, allocatable :: components(:)
    integer :: low(3), high(3), axis

    do axis = 1, 3
      low(axis) = grid%axis(axis)%first(element(axis))
      high(axis) = grid%axis(axis)%last(element(axis))
    end do
    components = components_of_box(grid, low, high)
  end function element_components

  pure function components_of_box(grid, low, high) result(components)
    type(patch_grid_t), intent(in) :: grid
    integer, intent(in) :: low(3), high(3)         !! control points along each axis
    integer, allocatable :: components(:)
    integer :: i, j, k, m, point

    allocate (components(3*product(high - low + 1)))
    m = 0
    do k = low(3), high(3)
      do j = low(2), high(2)
        do i = low(1), high(1)
          point = grid%n_before + i + grid%n(1)*((j - 1) + grid%n(2)*(k - 1))
          components(m + 1:m + 3) = [3*point - 2, 3*point - 1, 3*point]
          m = m + 3
        end do
      end do
    end do
  end function components_of_box

  !> The entries of the matrix of all elements of patches and of the couplings; values are zero.
  pure subroutine new_symmetric_matrix(matrix, grids, map, couplings)
    type(symmetric_matrix_t), intent(out) :: matrix
    type(patch_grid_t), intent(in) :: grids(:)
    type(unknowns_t), intent(in) :: map
    type(couplings_t), intent(in) :: couplings
    type(couplings_t) :: users, lists
    integer :: seen(map%n_free), row(map%n_free), i, n, n_entries
    integer, allocatable :: longer(:)

    call transpose_lists(map%first, map%unknown, map%n_free, users)
    call transpose_lists(couplings%first, couplings%component, map%n_components, lists)
    matrix%n = map%n_free
    allocate (matrix%first(map%n_free + 1), source=1)
    allocate (matrix%columns(64*map%n_free))
    seen = 0
    n_entries = 0
    do i = 1, map%n_free
      call collect_row(i, grids, map, couplings, users, lists, seen, row, n)
      if (n_entries + n > size(matrix%columns)) then
        allocate (longer(2*n_entries + n))
        longer(:n_entries) = matrix%columns(:n_entries)
        call move_alloc(longer, matrix%columns)
      end if
      matrix%columns(n_entries + 1:n_entries + n) = row(:n)
      n_entries = n_entries + n
      matrix%first(i + 1) = n_entries + 1
    end do
    matrix%columns = matrix%columns(:n_entries)
    allocate (matrix%rows(n_entries))
    do i = 1, matrix%n
      matrix%rows(matrix%first(i):matrix%first(i + 1) - 1) = i
    end do
    allocate (matrix%values(n_entries), source=0.0_wp)
  end subroutine new_symmetric_matrix

  !> For each value the numbers of the lists that it is in.
  pure subroutine transpose_lists(first, values, n, lists)
    integer, intent(in) :: first(:), values(:), n
    type(couplings_t), intent(out) :: lists        !! `component` holds numbers of lists here
    integer :: list_of(size(values)), l

    do l = 1, size(first) - 1
      list_of(first(l):first(l + 1) - 1) = l
    end do
    call sort_into_buckets(n, values, values, lists%first, lists%component)
    lists%component = list_of(lists%component)
  end subroutine transpose_lists

  !> Columns of a row up to the diagonal, in rising order.
  pure subroutine collect_row(i, grids, map, couplings, users, lists, seen, row, n)
    integer, intent(in) :: i
    type(patch_grid_t), intent(in) :: grids(:)
    type(unknowns_t), intent(in) :: map
    type(couplings_t), intent(in) :: couplings
    type(couplings_t), intent(in) :: users         !! components that each unknown moves
    type(couplings_t), intent(in) :: lists         !! of couplings that each component is in
    integer, intent(inout) :: seen(:)              !! last row that each column was met in
    integer, intent(inout) :: row(:)
    integer, intent(out) :: n
    integer :: k, l

    n = 0
    do k = users%first(i), users%first(i + 1) - 1
      associate (component => users%component(k))
        call add_columns(map, neighbours(grids, component), i, seen, row, n)
        do l = lists%first(component), lists%first(component + 1) - 1
          associate (list => lists%component(l))
            call add_columns(map, couplings%component(couplings%first(list): &
                                                      couplings%first(list + 1) - 1), &
                             i, seen, row, n)
          end associate
        end do
      end associate
    end do
  end subroutine collect_row

  !> Insert the unknowns of components up to number `i`, each once; they mostly come in order.
  pure subroutine add_columns(map, components, i, seen, row, n)
    type(unknowns_t), intent(in) :: map
    integer, intent(in) :: components(:), i
    integer, intent(inout) :: seen(:), row(:), n
    integer :: c, m, at

    do c = 1, size(components)
      do m = map%first(components(c)), map%first(components(c) + 1) - 1
        associate (column => map%unknown(m))
          if (column > i) cycle
          if (seen(column) == i) cycle
          seen(column) = i
          at = n
          do while (at > 0)
            if (row(at) < column) exit
            row(at + 1) = row(at)
            at = at - 1
          end do
          row(at + 1) = column
          n = n + 1
        end associate
      end do
    end do
  end subroutine add_columns

  !> All components of the control points that share an element with that of a component.
  pure function neighbours(grids, component) result(components)
    type(patch_grid_t), intent(in) :: grids(:)
    integer, intent(in) :: component
    integer, allocatable :: components(:)
    integer :: g, point, at(3), axis, low(3), high(3)

    point = (component - 1)/3 + 1
    g = count(grids%n_before < point)
    associate (n => grids(g)%n)
      point = point - grids(g)%n_before - 1
      at = [mod(point, n(1)), mod(point/n(1), n(2)), point/(n(1)*n(2))] + 1
    end associate
    do axis = 1, 3
      low(axis) = grids(g)%axis(axis)%low(at(axis))
      high(axis) = grids(g)%axis(axis)%high(at(axis))
    end do
    components = components_of_box(grids(g), low, high)
  end function neighbours

  !> Make all values zero, before new blocks are added.
  pure subroutine set_zero(matrix)
    type(symmetric_matrix_t), intent(inout) :: matrix

    matrix%values = 0.0_wp
  end subroutine set_zero

  !> Add the block K over some components, of an element or of a coupling: T' K T, row by row: in
  !! both, columns rise.
  pure subroutine add_block(matrix, map, components, block)
    type(symmetric_matrix_t), intent(inout) :: matrix
    type(unknowns_t), intent(in) :: map
    integer, intent(in) :: components(:)           !! each once
    real(wp), intent(in) :: block(:, :)            !! symmetric; the lower triangle is read
    integer, allocatable :: list(:), place(:)
    real(wp), allocatable :: reduced(:, :)
    integer :: i, j, k

    call unknowns_of(map, components, list, place)
    call reduce_block(map, components, place, block, size(list), reduced)
    do i = 1, size(list)
      k = matrix%first(list(i))
      do j = 1, i
        do while (matrix%columns(k) < list(j))
          k = k + 1
        end do
        matrix%values(k) = matrix%values(k) + reduced(j, i)
      end do
    end do
  end subroutine add_block

  !> Add a single K(i, j), half of it for K(j, i): both come, and their mean counts.
  pure subroutine add_entry(matrix, map, i, j, value, hint)
    type(symmetric_matrix_t), intent(inout) :: matrix
    type(unknowns_t), intent(in) :: map
    integer, intent(in) :: i, j                    !! components that share an element or a coupling
    real(wp), intent(in) :: value
    integer, intent(inout) :: hint                 !! for `place_of`, 0 at first
    real(wp) :: term
    integer :: a, b, row, column, place

    do b = map%first(j), map%first(j + 1) - 1
      do a = map%first(i), map%first(i + 1) - 1
        row = max(map%unknown(a), map%unknown(b))
        column = min(map%unknown(a), map%unknown(b))
        place = place_of(matrix, row, column, hint)
        hint = place - matrix%first(row)
        term = map%coefficient(a)*map%coefficient(b)*value
        if (row /= column) term = 0.5_wp*term
        matrix%values(place) = matrix%values(place) + term
      end do
    end do
  end subroutine add_entry

  !> Where an entry is, tried first as far in its row as the last one was, and next to that: the
  !! components of a control point have their entries there.
  pure integer function place_of(matrix, row, column, hint) result(low)
    type(symmetric_matrix_t), intent(in) :: matrix
    integer, intent(in) :: row, column, hint       !! hint: entries of the row before the place
    integer :: high, middle, i

    high = matrix%first(row + 1) - 1
    do i = 0, 1
      low = matrix%first(row) + hint + i
      if (low > high) exit
      if (matrix%columns(low) == column) return
    end do
    low = matrix%first(row)
    do while (low < high)
      middle = (low + high)/2
      if (matrix%columns(middle) < column) then
        low = middle + 1
      else
        high = middle
      end if
    end do
  end function place_of

  !> The unknowns of some components in rising order, and where those of each component are there.
  pure subroutine unknowns_of(map, components, list, place)
    type(unknowns_t), intent(in) :: map
    integer, intent(in) :: components(:)
    integer, allocatable, intent(out) :: list(:)
    integer, allocatable, intent(out) :: place(:)  !! component after component
    integer, allocatable :: all_of(:)
    integer :: n, m, at, i, low, high

    m = sum(map%first(components + 1) - map%first(components))
    allocate (all_of(m), list(m), place(m))
    n = 0
    do i = 1, size(components)
      low = map%first(components(i))
      high = map%first(components(i) + 1) - 1
      all_of(n + 1:n + 1 + high - low) = map%unknown(low:high)
      n = n + 1 + high - low
    end do
    n = 0
    do i = 1, m
      at = n
      do while (at > 0)
        if (list(at) <= all_of(i)) exit
        at = at - 1
      end do
      if (at > 0) then
        if (list(at) == all_of(i)) cycle
      end if
      list(at + 2:n + 1) = list(at + 1:n)
      list(at + 1) = all_of(i)
      n = n + 1
    end do
    list = list(:n)
    do i = 1, m
      low = 1
      high = n
      do while (low < high)
        at = (low + high)/2
        if (list(at) < all_of(i)) then
          low = at + 1
        else
          high = at
        end if
      end do
      place(i) = low
    end do
  end subroutine unknowns_of

  !> T' K T over the unknowns of a block; the upper triangle is filled.
  pure subroutine reduce_block(map, components, place, block, n, reduced)
    type(unknowns_t), intent(in) :: map
    integer, intent(in) :: components(:), place(:), n
    real(wp), intent(in) :: block(:, :)
    real(wp), allocatable, intent(out) :: reduced(:, :)
    integer :: i, j, a, b, from(size(components) + 1)
    real(wp) :: value

    allocate (reduced(n, n), source=0.0_wp)
    from(1) = 1
    do i = 1, size(components)
      from(i + 1) = from(i) + map%first(components(i) + 1) - map%first(components(i))
    end do
    do j = 1, size(components)
      do i = j, size(components)
        do b = from(j), from(j + 1) - 1
          do a = merge(b, from(i), i == j), from(i + 1) - 1
            value = map%coefficient(map%first(components(i)) + a - from(i)) &
                    *map%coefficient(map%first(components(j)) + b - from(j))*block(i, j)
            associate (entry => reduced(min(place(a), place(b)), max(place(a), place(b))))
              entry = entry + value
              ! K(i, j) stands for K(j, i) as well, which brings the same to the diagonal.
              if (i /= j .and. place(a) == place(b)) entry = entry + value
            end associate
          end do
        end do
      end do
    end do
  end subroutine reduce_block

end module sparse_matrix
