!> One patch of the blank as the kernels see it: tables, tiles, weights and point state.
module solid_patch
  use kinds, only: wp
  use basis_tables, only: axis_table_t, lane_table_t
  use bulk_viscosity, only: viscosity_t
  use tile_shares, only: tile_shares_t
  implicit none
  private

  public :: element_of_lane, lane_of_element, block_at, block_number, n_blocks_of, next_block
  public :: find_blocks_here, find_blocks_of, is_element_here, is_block_here
  public :: n_elements_of, next_group
  public :: cut_number, local_place, weights_of_row, basis_at, basis_of_row
  public :: is_counted_lane, row_of_point, place_of_point, point_of_row, point_number

  integer, parameter, public :: most_in_group = 16   !! blocks

  !> A block: eight elements side by side along axis 1.
  type, public :: block_t
    integer :: number = 0           !! in the patch: last index of the state at the points
    integer :: b = 0                !! along axis 1: last index of the lane table
    integer :: e2 = 0, e3 = 0       !! its elements along axes 2 and 3
  end type block_t

  !> A fixed share of the blocks: ranges of blocks along axis 1 and of elements along axis 2,
  !! all of axis 3; and the control points they touch. The same whatever the thread count.
  type, public :: tile_t
    integer :: block_first = 1, block_last = 0
    integer :: row_first = 1, row_last = 0
    integer :: control_first(2) = 1, control_last(2) = 0
    !> Rows of control points from the first to this one take the forces of the tile at once.
    integer :: own_last = 0
  end type tile_t

  !> Internal forces of one tile on the other control points it touches, before tiles are added up.
  type, public :: tile_buffer_t
    real(wp), allocatable :: force(:, :, :, :)
  end type tile_buffer_t

  !> Tables and state of a patch. Blocks are numbered along axis 1 first, then axis 2, axis 3; with
  !! an outline those of the lane table, layer after layer.
  type, public :: solid_patch_t
    integer :: n_control(3) = 0
    integer :: n_blocks = 0
    integer :: kernel = 0                          !! instance, see kernel_dispatch
    type(axis_table_t) :: axes(3)
    type(lane_table_t) :: lanes
    logical :: is_rational = .false.
    real(wp), allocatable :: weights(:, :, :)      !! of the control points; rational only
    !> 1/W^3, dW/W (3) and W^2 at the points, (8, q3, 5, q1*q2, n_blocks); rational only.
    real(wp), allocatable :: rational(:, :, :, :, :)
    !> Rows of points (those along axis 3) whose stress is updated in one call: a law needs less
    !! time for each of many points, as long as all stays in the first cache. They are one long row
    !! in the two fields below.
    integer :: together = 1
    real(wp), allocatable :: stress(:, :, :, :, :) !! (8, q3*together, 6, q1*q2/together, n_blocks)
    real(wp), allocatable :: state(:, :, :, :, :)  !! the same with n_state
    !> Viscous stress of the last step, (8, q3, q1*q2, n_blocks); of shells (8, 1, ...), or with
    !! the moment per thickness (8, 2, ...); without viscosity one idle block.
    real(wp), allocatable :: push(:, :, :, :)
    logical :: has_context = .false.               !! its law needs the context of its points
    logical :: has_gradients = .false.             !! and deformation gradients in it
    !> Inverse of the jacobian at the start, row by row, (8, 9, q3, q1*q2, n_blocks), for the
    !! gradients; without them one idle value.
    real(wp), allocatable :: reference(:, :, :, :, :)
    !> Cube roots of the volumes of the elements at the start, (8, n_blocks); with context only.
    real(wp), allocatable :: element_size(:, :)
    real(wp) :: time = 0.0_wp                      !! of the last force evaluation
    integer :: increment = 0                       !! force evaluations so far
    integer :: step = 1                            !! of the deck, under way
    real(wp) :: step_start = 0.0_wp                !! time at which it began
    integer :: before_step = 0                     !! force evaluations before it
    integer :: n_fields = 0                        !! temperature and field variables of the deck
    !> The values at the control points that the points have at the end of the step, where that is
    !! known, and whether they had them at its start as well.
    real(wp), allocatable :: spread_values(:, :, :, :)
    logical :: is_spread = .false., is_settled = .false.
    !> At the points, at the start and then at the end of the step, (8, q3, 2*n_fields, q1*q2,
    !! n_blocks); only for laws that need the context of their points.
    real(wp), allocatable :: given(:, :, :, :, :)
    integer :: n_before = 0                        !! elements of the patches before, in numbers
    type(viscosity_t) :: viscosity
    real(wp) :: shortest = 0.0_wp                  !! axis of all elements at the start [length]
    type(tile_t), allocatable :: tiles(:)
    type(tile_shares_t) :: shares                  !! tiles that are worked here
  end type solid_patch_t

  !> What a patch in plane strain has besides its tables. It is one element wide along axis 2,
  !! linear across with one integration point there, and held so that its two sides move alike.
  type, public :: plane_strain_t
    integer :: kernel = 0           !! instance, see plane_strain_forces
    !> Components of the plane, that across, and the place of the plane's shear in a tensor.
    integer :: places(4) = 0
    real(wp) :: across = 0.0_wp     !! d/dxi_2 of the coordinate across [length]
    real(wp) :: half = 0.0_wp       !! the same with the sign that makes determinants positive
    !> Forces of each tile on the upper side, all components, rows along axis 2 being that one.
    type(tile_buffer_t), allocatable :: sides(:)
  end type plane_strain_t

  !> What the points of a shell have besides stress and state.
  type, public :: shell_points_t
    integer :: kernel = 0                             !! instance, see shell_forces
    !> Fundamental forms a11 a22 a12 b11 b22 b12 now, by element-local coordinates, (8, 6, q1*q2,
    !! n_blocks).
    real(wp), allocatable :: metric(:, :, :, :)
    real(wp), allocatable :: thickness(:, :, :)       !! now, (8, q1*q2, n_blocks) [length]
    real(wp), allocatable :: volume(:, :, :)          !! of the points at the start, likewise
    !> Strain increments through the thickness of the last step, (8, q3, q1*q2, n_blocks).
    real(wp), allocatable :: through(:, :, :, :)
    !> Logarithms of the stretches through the thickness, likewise, and the inverse tangents of the
    !! layers at the start, in the frame and row by row, (8, 4, q3, q1*q2, n_blocks): both for laws
    !! with context alone.
    real(wp), allocatable :: stretch(:, :, :, :), reference(:, :, :, :, :)
    !> Forces and moments per length over the thickness, in the frame of the points as mean, half
    !! difference and shear, without the normal stress below, (8, 6, q1*q2, n_blocks).
    real(wp), allocatable :: resultant(:, :, :, :)
    !> Normal stress through the thickness: mean of both faces and half of face 6 less face 5, (8,
    !! 2, q1*q2, n_blocks) [stress].
    real(wp), allocatable :: normal(:, :, :, :)
    logical, allocatable :: is_pressed(:)             !! blocks with such a stress
    !> 1/W and W,1 W,2 W,11 W,22 W,12 over W, (8, 6, q1*q2, n_blocks); rational only.
    real(wp), allocatable :: rational(:, :, :, :)
  end type shell_points_t

contains

  !> Number of block `b` of the row of elements (e2, e3).
  pure integer function block_number(patch, b, e2, e3) result(number)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: b, e2, e3

    if (patch%lanes%is_trimmed) then
      number = b + patch%lanes%n_blocks*(e3 - 1)
    else
      number = b + patch%lanes%n_blocks*((e2 - 1) + patch%axes(2)%n_elements*(e3 - 1))
    end if
  end function block_number

  !> The block of a number.
  pure function block_at(patch, number) result(block)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: number
    type(block_t) :: block
    integer :: row

    row = (number - 1)/patch%lanes%n_blocks
    block%number = number
    block%b = number - patch%lanes%n_blocks*row
    if (patch%lanes%is_trimmed) then
      block%e3 = row + 1
      block%e2 = patch%lanes%row(block%b)
    else
      block%e3 = row/patch%axes(2)%n_elements + 1
      block%e2 = row - patch%axes(2)%n_elements*(block%e3 - 1) + 1
    end if
  end function block_at

  !> Number of blocks of a tile.
  pure integer function n_blocks_of(patch, tile) result(n)
    type(solid_patch_t), intent(in) :: patch
    type(tile_t), intent(in) :: tile

    n = (tile%block_last - tile%block_first + 1)*patch%axes(3)%n_elements
    if (.not. patch%lanes%is_trimmed) n = n*(tile%row_last - tile%row_first + 1)
  end function n_blocks_of

  !> Step through the blocks of a tile, axis 1 first; the first one follows a block that is not set.
  pure subroutine next_block(patch, tile, block)
    type(solid_patch_t), intent(in) :: patch
    type(tile_t), intent(in) :: tile
    type(block_t), intent(inout) :: block

    if (block%number == 0) then
      block%b = tile%block_first
      block%e2 = tile%row_first
      block%e3 = 1
    else if (block%b < tile%block_last) then
      block%b = block%b + 1
    else if (patch%lanes%is_trimmed) then
      block%b = tile%block_first
      block%e3 = block%e3 + 1
    else
      block%b = tile%block_first
      block%e2 = block%e2 + 1
      if (block%e2 > tile%row_last) then
        block%e2 = tile%row_first
        block%e3 = block%e3 + 1
      end if
    end if
    if (patch%lanes%is_trimmed) block%e2 = patch%lanes%row(block%b)
    block%number = block_number(patch, block%b, block%e2, block%e3)
  end subroutine next_block

  !> Blocks whose stress and state are held here, in rising order; not allocated: all of them.
  pure subroutine find_blocks_here(patch, blocks)
    type(solid_patch_t), intent(in) :: patch
    integer, allocatable, intent(out) :: blocks(:)

    if (patch%shares%is_shared) call find_blocks_of(patch, patch%shares%first, patch%shares%last, &
                                                    blocks)
  end subroutine find_blocks_here

  !> Blocks of a range of tiles, in rising order.
  pure subroutine find_blocks_of(patch, first, last, blocks)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: first, last
    integer, allocatable, intent(out) :: blocks(:)
    logical :: is_here(patch%n_blocks)
    type(block_t) :: block
    integer :: t, i

    is_here = .false.
    do t = first, last
      block = block_t()
      do i = 1, n_blocks_of(patch, patch%tiles(t))
        call next_block(patch, patch%tiles(t), block)
        is_here(block%number) = .true.
      end do
    end do
    blocks = pack([(i, i=1, patch%n_blocks)], is_here)
  end subroutine find_blocks_of

  !> Is the state of an element held here?
  pure logical function is_element_here(patch, element) result(is_here)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: element(3)
    integer :: at(2)

    is_here = .not. patch%shares%is_shared
    if (is_here) return
    at = lane_of_element(patch, element)
    is_here = is_block_here(patch, at(1))
  end function is_element_here

  !> The same of a block.
  pure logical function is_block_here(patch, number) result(is_here)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: number
    type(block_t) :: block
    integer :: t

    is_here = .not. patch%shares%is_shared
    if (is_here) return
    block = block_at(patch, number)
    do t = patch%shares%first, patch%shares%last
      associate (tile => patch%tiles(t))
        if (block%b < tile%block_first .or. block%b > tile%block_last) cycle
        is_here = patch%lanes%is_trimmed .or. (block%e2 >= tile%row_first .and. &
                                               block%e2 <= tile%row_last)
      end associate
      if (is_here) return
    end do
  end function is_block_here

  !> Number of elements of a tile.
  pure integer function n_elements_of(patch, tile) result(n)
    type(solid_patch_t), intent(in) :: patch
    type(tile_t), intent(in) :: tile

    n = count(patch%lanes%is_owner(:, tile%block_first:tile%block_last))*patch%axes(3)%n_elements
    if (.not. patch%lanes%is_trimmed) n = n*(tile%row_last - tile%row_first + 1)
  end function n_elements_of

  !> The next blocks of a tile whose points a law takes together: as few as hold `n_least` elements,
  !! and the rest of the tile where that holds fewer. The number of threads does not change them.
  pure subroutine next_group(patch, tile, n_least, n_left, blocks, n)
    type(solid_patch_t), intent(in) :: patch
    type(tile_t), intent(in) :: tile
    integer, intent(in) :: n_least
    integer, intent(inout) :: n_left          !! elements of the tile, less those of all groups
    type(block_t), intent(inout) :: blocks(most_in_group)   !! as they were left
    integer, intent(inout) :: n               !! blocks of this group; of that before, first 0
    type(block_t) :: block
    integer :: n_here

    block = block_t()
    if (n > 0) block = blocks(n)
    n_here = 0
    n = 0
    do while (n < most_in_group .and. n_left > 0)
      if (n_here >= n_least .and. n_left >= n_least) exit
      call next_block(patch, tile, block)
      n = n + 1
      blocks(n) = block
      n_here = n_here + count(patch%lanes%is_owner(:, block%b))
      n_left = n_left - count(patch%lanes%is_owner(:, block%b))
    end do
  end subroutine next_group

  !> Element (e1, e2, e3) of a lane of a block.
  pure function element_of_lane(patch, number, lane) result(element)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: number, lane
    integer :: element(3)
    type(block_t) :: block

    block = block_at(patch, number)
    element = [patch%lanes%element(lane, block%b), block%e2, block%e3]
  end function element_of_lane

  !> Is this the lane that counts for its element? Others repeat an element.
  pure logical function is_counted_lane(patch, number, lane) result(is_counted)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: number, lane
    type(block_t) :: block

    block = block_at(patch, number)
    is_counted = patch%lanes%is_owner(lane, block%b)
  end function is_counted_lane

  !> Block and lane that count for an element; for one outside an outline those of its nearest
  !! neighbour inside.
  pure function lane_of_element(patch, element) result(at)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: element(3)
    integer :: at(2), b

    if (patch%lanes%is_trimmed) then
      at = patch%lanes%at(:, element(1), element(2))
      at(1) = at(1) + patch%lanes%n_blocks*(element(3) - 1)
      return
    end if
    b = (element(1) - 1)/size(patch%lanes%element, 1) + 1
    at(1) = block_number(patch, b, element(2), element(3))
    at(2) = findloc(patch%lanes%element(:, b) == element(1) .and. patch%lanes%is_owner(:, b), &
                    .true., dim=1)
  end function lane_of_element

  !> Number of a block in the table of cut elements, 0: its elements are whole.
  pure integer function cut_number(patch, block) result(number)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block

    number = 0
    if (patch%lanes%is_trimmed) number = patch%lanes%cut_number(block%b)
  end function cut_number

  !> Local coordinates along the sheet of a point of a lane.
  pure function local_place(patch, block, lane, row) result(place)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: lane, row
    real(wp) :: place(2)
    integer :: at(3), c

    c = cut_number(patch, block)
    if (c > 0) then
      place = patch%lanes%cut%places(lane, :, row, c)
    else
      at = point_of_row(patch%axes%n_points, row, 1)
      place = [patch%axes(1)%abscissae(at(1)), patch%axes(2)%abscissae(at(2))]
    end if
  end function local_place

  !> Weights along the sheet of the points of a row, 0 in lanes that do not count.
  pure function weights_of_row(patch, block, row) result(weights)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: row
    real(wp) :: weights(size(patch%lanes%element, 1))
    integer :: at(3), c

    c = cut_number(patch, block)
    if (c > 0) then
      weights = patch%lanes%cut%weights(:, row, c)
    else
      at = point_of_row(patch%axes%n_points, row, 1)
      weights = patch%lanes%weights(:, at(1), block%b)*patch%axes(2)%weights(at(2))
    end if
  end function weights_of_row

  !> Basis along both axes of the sheet at a point of a lane: values, slopes, second derivatives.
  pure subroutine basis_at(patch, block, lane, row, one, two)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: lane, row
    real(wp), intent(out) :: one(patch%axes(1)%degree + 1, 0:2), two(patch%axes(2)%degree + 1, 0:2)
    integer :: at(3), c

    c = cut_number(patch, block)
    if (c > 0) then
      associate (cut => patch%lanes%cut)
        one(:, 0) = cut%values1(lane, :, row, c)
        one(:, 1) = cut%slopes1(lane, :, row, c)
        one(:, 2) = cut%bends1(lane, :, row, c)
        two(:, 0) = cut%values2(lane, :, row, c)
        two(:, 1) = cut%slopes2(lane, :, row, c)
        two(:, 2) = cut%bends2(lane, :, row, c)
      end associate
    else
      at = point_of_row(patch%axes%n_points, row, 1)
      associate (e => patch%lanes%element(lane, block%b), a => patch%axes(1), b => patch%axes(2))
        one(:, 0) = a%values(:, at(1), e)
        one(:, 1) = a%slopes(:, at(1), e)
        one(:, 2) = a%bends(:, at(1), e)
        two(:, 0) = b%values(:, at(2), block%e2)
        two(:, 1) = b%slopes(:, at(2), block%e2)
        two(:, 2) = b%bends(:, at(2), block%e2)
      end associate
    end if
  end subroutine basis_at

  !> The same, values and slopes, of all lanes.
  pure subroutine basis_of_row(patch, block, row, n1, d1, n2, d2)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: row
    real(wp), intent(out), dimension(:, :) :: n1, d1, n2, d2     !! shape (8, degree + 1)
    integer :: at(3), c

    c = cut_number(patch, block)
    if (c > 0) then
      n1 = patch%lanes%cut%values1(:, :, row, c)
      d1 = patch%lanes%cut%slopes1(:, :, row, c)
      n2 = patch%lanes%cut%values2(:, :, row, c)
      d2 = patch%lanes%cut%slopes2(:, :, row, c)
    else
      at = point_of_row(patch%axes%n_points, row, 1)
      n1 = patch%lanes%values(:, :, at(1), block%b)
      d1 = patch%lanes%slopes(:, :, at(1), block%b)
      n2 = spread(patch%axes(2)%values(:, at(2), block%e2), 1, size(n2, 1))
      d2 = spread(patch%axes(2)%slopes(:, at(2), block%e2), 1, size(d2, 1))
    end if
  end subroutine basis_of_row

  !> Row of a point: the place along axis 3 and the row are the indices of its state.
  pure integer function row_of_point(n_points, point) result(row)
    integer, intent(in) :: n_points(3)      !! of an element along each axis
    integer, intent(in) :: point(3)         !! along each axis

    row = point(2) + n_points(2)*(point(1) - 1)
  end function row_of_point

  !> Place in a long row, and number of that, of a point: indices of its stress and state.
  pure function place_of_point(patch, point) result(place)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: point(3)         !! along each axis
    integer :: place(2), row

    row = row_of_point(patch%axes%n_points, point) - 1
    place = [point(3) + patch%axes(3)%n_points*mod(row, patch%together), row/patch%together + 1]
  end function place_of_point

  !> The point, along each axis, of a row and a place along axis 3.
  pure function point_of_row(n_points, row, layer) result(point)
    integer, intent(in) :: n_points(3), row, layer
    integer :: point(3)

    point = [(row - 1)/n_points(2) + 1, mod(row - 1, n_points(2)) + 1, layer]
  end function point_of_row

  !> Number of a point in its element, axis 1 first, from its place in the state.
  elemental integer function point_number(n1, n2, row, layer) result(number)
    integer, intent(in) :: n1, n2           !! points of an element along axes 1 and 2
    integer, intent(in) :: row, layer       !! `row_of_point` and place along axis 3

    number = (row - 1)/n2 + 1 + n1*(mod(row - 1, n2) + n2*(layer - 1))
  end function point_number

end module solid_patch