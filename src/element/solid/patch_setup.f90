!> Build a patch from a NURBS solid, a quadrature rule and a law, and check its shape.
module patch_setup
  use kinds, only: wp
  use failure, only: error_t, fail
  use spared_memory, only: clear
  use text, only: place_text
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use knot_vector, only: knot_vector_t, span_table
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes, new_axis_table, new_lane_table, lane_table_t, new_trimmed_lanes
  use tile_shares, only: work_all_tiles
  use solid_patch, only: solid_patch_t, tile_t, tile_buffer_t, block_t, block_at, element_of_lane, &
                         basis_at, n_elements_of
  use bulk_viscosity, only: new_viscosity
  use patch_points, only: set_reference, determinant
  use kernel_dispatch, only: kernel_of, rows_of
  use linear_algebra, only: eigenvalues
  implicit none
  private

  public :: new_patch, new_cut_patch, new_tile_buffers, element_patch, separate_rows, check_shape
  public :: cut_patch, most_tiles

  !> So far towards the centre of an element its ends are tested, as a share of the way: at degree 1
  !! the jacobian has a step between elements.
  real(wp), parameter :: inset = 1.0e-9_wp

contains

  !> Tables, tiles and a stress-free state. Viscosity is set when either factor is positive.
  subroutine new_patch(patch, solid, n_points, n_parts, law, viscosity, error)
    type(solid_patch_t), intent(out) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: n_points(3), n_parts(3)   !! Gauss points a part, parts an element
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)             !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    type(gauss_rule_t) :: rule
    integer :: axis

    do axis = 1, 3
      rule = new_gauss_rule(n_points(axis), n_parts(axis))
      patch%axes(axis) = new_axis_table(solid%axes(axis), rule%points, rule%weights)
    end do
    patch%is_rational = any(abs(solid%weights/solid%weights(1, 1, 1) - 1.0_wp) > 1.0e-14_wp)
    patch%has_context = law%needs_context
    patch%has_gradients = law%needs_context .and. law%needs_gradients
    if (patch%is_rational) patch%weights = solid%weights
    call fill_patch(patch, solid, law, viscosity, error)
  end subroutine new_patch

  !> The same of what an outline keeps of a patch.
  subroutine new_cut_patch(patch, whole, solid, moments, law, error)
    type(solid_patch_t), intent(out) :: patch
    type(solid_patch_t), intent(in) :: whole         !! or cut before
    type(nurbs_solid_t), intent(in) :: solid         !! that it was made of
    real(wp), intent(in) :: moments(:, :, :)         !! of the elements, see `cut_cells`
    class(block_law_t), intent(in) :: law
    type(error_t), allocatable, intent(out) :: error
    type(lane_table_t) :: lanes

    patch%axes = whole%axes
    patch%is_rational = whole%is_rational
    patch%has_context = whole%has_context
    patch%has_gradients = whole%has_gradients
    if (patch%is_rational) patch%weights = whole%weights
    call new_trimmed_lanes(solid%axes(:2), patch%axes(:2), moments, lanes)
    call fill_patch(patch, solid, law, [whole%viscosity%linear, whole%viscosity%quadratic], error, &
                    lanes)
    if (whole%together == 1) call separate_rows(patch)
  end subroutine new_cut_patch

  !> What follows of the tables of the axes, the weights and, with an outline, the lanes.
  subroutine fill_patch(patch, solid, law, viscosity, error, lanes)
    type(solid_patch_t), intent(inout) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)             !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    type(lane_table_t), intent(in), optional :: lanes
    real(wp), allocatable :: lengths(:, :)
    integer :: q(3)

    call complete_patch(patch, max(1, law%n_state), most_tiles(patch, law), law%n_together, lanes)
    if (patch%has_context) call set_reference(patch, solid)
    call find_lengths(patch, solid, lengths, error)
    patch%shortest = minval(lengths)
    patch%viscosity = new_viscosity(viscosity, law, lengths)
    q = patch%axes%n_points
    allocate (patch%push(n_lanes, q(3), q(1)*q(2), &
                         merge(patch%n_blocks, 1, patch%viscosity%is_active)))
    call clear(size(patch%push), patch%push)
  end subroutine fill_patch

  !> From the tables of the axes, and the weights, to what follows of them.
  subroutine complete_patch(patch, n_state, n_tiles, n_together, lanes)
    type(solid_patch_t), intent(inout) :: patch
    integer, intent(in) :: n_state, n_tiles, n_together   !! see `cut_patch`
    type(lane_table_t), intent(in), optional :: lanes

    call cut_patch(patch, n_tiles, n_together, lanes)
    patch%kernel = kernel_of(patch%axes%degree, patch%axes%n_points, patch%is_rational)
    call set_rows(patch, rows_of(patch%kernel), n_state)
    if (patch%is_rational) call set_rational(patch)
  end subroutine complete_patch

  !> How many tiles are worth their borders: enough for the threads of a machine, and of a large
  !! patch for those of several. A law that must run on one thread gets the elements in their order:
  !! one tile for all.
  pure integer function most_tiles(patch, law) result(n)
    type(solid_patch_t), intent(in) :: patch
    class(block_law_t), intent(in) :: law
    integer, parameter :: least = 16, most = 128, rows = 12   ! tiles; elements across a tile

    n = 1
    if (.not. law%is_serial) n = min(most, max(least, patch%axes(2)%n_elements/rows))
  end function most_tiles

  !> Cut a patch into blocks and tiles.
  subroutine cut_patch(patch, n_tiles, n_together, lanes)
    type(solid_patch_t), intent(inout) :: patch
    integer, intent(in) :: n_tiles                   !! at most so many tiles
    integer, intent(in) :: n_together                !! so many elements a tile, if there are
    type(lane_table_t), intent(in), optional :: lanes   !! with an outline; absent: all elements
    integer :: n, t

    patch%n_control = patch%axes%n_basis
    if (present(lanes)) then
      patch%lanes = lanes
      patch%n_blocks = lanes%n_blocks*patch%axes(3)%n_elements
    else
      patch%lanes = new_lane_table(patch%axes(1))
      patch%n_blocks = patch%lanes%n_blocks*patch%axes(2)%n_elements*patch%axes(3)%n_elements
    end if
    do n = n_tiles, 1, -1
      patch%tiles = new_tiles(patch, n)
      if (all([(n_elements_of(patch, patch%tiles(t)), t=1, size(patch%tiles))] >= n_together)) exit
    end do
    call work_all_tiles(patch%shares, size(patch%tiles))
  end subroutine cut_patch

  !> Room for stress and state, zero, with so many rows together.
  pure subroutine set_rows(patch, together, n_state)
    type(solid_patch_t), intent(inout) :: patch
    integer, intent(in) :: together, n_state
    integer :: q(3)

    q = patch%axes%n_points
    patch%together = together
    q(3) = q(3)*together
    q(2) = q(1)*q(2)/together
    if (allocated(patch%stress)) deallocate (patch%stress, patch%state)
    allocate (patch%stress(n_lanes, q(3), 6, q(2), patch%n_blocks))
    allocate (patch%state(n_lanes, q(3), n_state, q(2), patch%n_blocks))
    call clear(size(patch%stress), patch%stress)
    call clear(size(patch%state), patch%state)
  end subroutine set_rows

  !> Each row by itself, for those who work them so. Stress and state are zero.
  pure subroutine separate_rows(patch)
    type(solid_patch_t), intent(inout) :: patch

    if (patch%together > 1) call set_rows(patch, 1, size(patch%state, 3))
  end subroutine separate_rows

  !> One element of a patch as a patch of its own, without stress and viscosity.
  function element_patch(patch, solid, element) result(single)
    type(solid_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid     !! that the patch was made of
    integer, intent(in) :: element(3)
    type(solid_patch_t) :: single
    integer :: axis, low(3), high(3), q(3)

    single%is_rational = patch%is_rational
    single%axes = patch%axes
    do axis = 1, 3
      low(axis) = patch%axes(axis)%first(element(axis))
      associate (table => single%axes(axis), e => element(axis))
        table%n_basis = table%degree + 1
        table%n_elements = 1
        table%first = [1]
        table%values = patch%axes(axis)%values(:, :, e:e)
        table%slopes = patch%axes(axis)%slopes(:, :, e:e)
        table%bends = patch%axes(axis)%bends(:, :, e:e)
      end associate
    end do
    high = low + patch%axes%degree
    if (single%is_rational) &
      single%weights = solid%weights(low(1):high(1), low(2):high(2), low(3):high(3))
    call complete_patch(single, size(patch%state, 3), 1, 1)
    q = patch%axes%n_points
    allocate (single%push(n_lanes, q(3), q(1)*q(2), 1), source=0.0_wp)
    single%shortest = patch%shortest
  end function element_patch

  !> At most `target_count` tiles: rows of axis 2 first, then shares of axis 1. A row of control
  !! points belongs to the last tile that touches it, if no other tile shares its elements.
  pure function new_tiles(patch, target_count) result(tiles)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: target_count
    type(tile_t), allocatable :: tiles(:)
    integer :: n_rows, n_shares, row, share, t

    n_rows = min(patch%axes(2)%n_elements, target_count)
    if (patch%lanes%is_trimmed) then
      tiles = trimmed_tiles(patch, n_rows)
      return
    end if
    n_shares = 1
    ! Eight tiles of whole rows, which own control points, need less time than sixteen of half rows.
    if (n_rows < 8) n_shares = max(1, min(patch%lanes%n_blocks, target_count/n_rows))
    allocate (tiles(n_rows*n_shares))
    t = 0
    do row = 1, n_rows
      do share = 1, n_shares
        t = t + 1
        associate (tile => tiles(t), rows => patch%axes(2)%n_elements, &
                   blocks => patch%lanes%n_blocks, first => patch%lanes%first)
          tile%row_first = (row - 1)*rows/n_rows + 1
          tile%row_last = row*rows/n_rows
          tile%block_first = (share - 1)*blocks/n_shares + 1
          tile%block_last = share*blocks/n_shares
          tile%control_first(1) = first(1, tile%block_first)
          tile%control_last(1) = first(n_lanes, tile%block_last) + patch%axes(1)%degree
          tile%control_first(2) = patch%axes(2)%first(tile%row_first)
          tile%control_last(2) = patch%axes(2)%first(tile%row_last) + patch%axes(2)%degree
          tile%own_last = tile%control_last(2)
          if (row < n_rows) tile%own_last = patch%axes(2)%first(tile%row_last + 1) - 1
          if (n_shares > 1) tile%own_last = tile%control_first(2) - 1
        end associate
      end do
    end do
  end function new_tiles

  !> Tiles of whole rows with about the same number of blocks.
  pure function trimmed_tiles(patch, n_rows) result(tiles)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in) :: n_rows
    type(tile_t) :: tiles(n_rows)
    integer :: t, last, n

    n = patch%axes(2)%n_elements
    last = 0
    do t = 1, n_rows
      associate (tile => tiles(t), rows => patch%lanes%row_first, two => patch%axes(2))
        tile%row_first = last + 1
        last = last + 1
        do while (last < n - (n_rows - t))
          if (t < n_rows .and. (rows(last + 1) - 1)*n_rows >= t*patch%lanes%n_blocks) exit
          last = last + 1
        end do
        tile%row_last = last
        tile%block_first = rows(tile%row_first)
        tile%block_last = rows(last + 1) - 1
        tile%control_last(1) = patch%n_control(1)
        tile%control_first(2) = two%first(tile%row_first)
        tile%control_last(2) = two%first(last) + two%degree
        tile%own_last = tile%control_last(2)
        if (t < n_rows) tile%own_last = two%first(last + 1) - 1
      end associate
    end do
  end function trimmed_tiles

  !> Force buffers of all tiles, for the rows that they do not own.
  pure function new_tile_buffers(patch, n_fields) result(buffers)
    type(solid_patch_t), intent(in) :: patch
    integer, intent(in), optional :: n_fields     !! without it 3, those of forces
    type(tile_buffer_t), allocatable :: buffers(:)
    integer :: t, n

    n = 3
    if (present(n_fields)) n = n_fields
    allocate (buffers(size(patch%tiles)))
    do t = 1, size(buffers)
      associate (tile => patch%tiles(t))
        allocate (buffers(t)%force(tile%control_first(1):tile%control_last(1), &
                                   tile%own_last + 1:tile%control_last(2), &
                                   patch%n_control(3), n), source=0.0_wp)
      end associate
    end do
  end function new_tile_buffers

  !> Factors of the rational basis at every point; the weights never change.
  pure subroutine set_rational(patch)
    type(solid_patch_t), intent(inout) :: patch
    integer :: q(3), block, lane, row, layer
    real(wp) :: w, slope(3)

    q = patch%axes%n_points
    allocate (patch%rational(n_lanes, q(3), 5, q(1)*q(2), patch%n_blocks))
    do block = 1, patch%n_blocks
      do lane = 1, n_lanes
        do row = 1, q(1)*q(2)
          do layer = 1, q(3)
            call weight_at(patch, block_at(patch, block), lane, row, layer, w, slope)
            associate (r => patch%rational(lane, layer, :, row, block))
              r(1) = 1.0_wp/w**3
              r(2:4) = slope/w
              r(5) = w*w
            end associate
          end do
        end do
      end do
    end do
  end subroutine set_rational

  !> Weight function W of the patch at one quadrature point and its element-local slopes.
  pure subroutine weight_at(patch, block, lane, row, layer, w, slope)
    type(solid_patch_t), intent(in) :: patch
    type(block_t), intent(in) :: block
    integer, intent(in) :: lane, row, layer
    real(wp), intent(out) :: w, slope(3)
    real(wp) :: one(patch%axes(1)%degree + 1, 0:2), two(patch%axes(2)%degree + 1, 0:2)
    real(wp) :: value3, slope3, control
    integer :: i, j, k, first(3)

    call basis_at(patch, block, lane, row, one, two)
    first = [patch%lanes%first(lane, block%b), patch%axes(2)%first(block%e2), &
             patch%axes(3)%first(block%e3)] - 1
    w = 0.0_wp
    slope = 0.0_wp
    do k = 1, patch%axes(3)%degree + 1
      value3 = patch%axes(3)%values(k, layer, block%e3)
      slope3 = patch%axes(3)%slopes(k, layer, block%e3)
      do j = 1, patch%axes(2)%degree + 1
        do i = 1, patch%axes(1)%degree + 1
          control = patch%weights(first(1) + i, first(2) + j, first(3) + k)
          w = w + one(i, 0)*two(j, 0)*value3*control
          slope = slope + control*[one(i, 1)*two(j, 0)*value3, one(i, 0)*two(j, 1)*value3, &
                                   one(i, 0)*two(j, 0)*slope3]
        end do
      end do
    end do
  end subroutine weight_at

  !> Shortest axis of each element at its centre: 2 over the spectral norm of the inverse
  !! jacobian, which is the edge of a cube and the thickness of a sheet.
  subroutine find_lengths(patch, solid, lengths, error)
    type(solid_patch_t), intent(in) :: patch
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), allocatable, intent(out) :: lengths(:, :)   !! shape (8, n_blocks)
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: xi(3), point(3), jacobian(3, 3), metric(3, 3), smallest, det
    integer :: block, lane, axis, element(3), span(3)

    allocate (lengths(n_lanes, patch%n_blocks), source=huge(1.0_wp))
    do block = 1, patch%n_blocks
      do lane = 1, n_lanes
        element = element_of_lane(patch, block, lane)
        do axis = 1, 3
          span(axis) = patch%axes(axis)%first(element(axis)) + patch%axes(axis)%degree
          xi(axis) = 0.5_wp*(solid%axes(axis)%knots(span(axis)) &
                             + solid%axes(axis)%knots(span(axis) + 1))
        end do
        call evaluate_solid(solid, xi, point, jacobian)
        do axis = 1, 3
          jacobian(:, axis) = 0.5_wp*jacobian(:, axis) &
                              *(solid%axes(axis)%knots(span(axis) + 1) &
                                - solid%axes(axis)%knots(span(axis)))
        end do
        det = determinant(jacobian)
        metric = matmul(transpose(jacobian), jacobian)
        smallest = minval(eigenvalues(metric))
        if (.not. (det > 0.0_wp .and. smallest > 0.0_wp)) then
          call fail(error, "blank: an element is inverted or flat (its Jacobian is "// &
                    "not positive); axes 1, 2, 3 must form a right-handed patch")
          return
        end if
        lengths(lane, block) = 2.0_wp*sqrt(smallest)
      end do
    end do
  end subroutine find_lengths

  !> Refuse a patch with an element whose jacobian is not positive at its centre, or is negative
  !! at a corner, in the middle of an edge or of a face. Zero is allowed there: an edge may have
  !! collapsed, and two edges may meet at a straight angle, as in a round bar.
  subroutine check_shape(solid, name, error)
    type(nurbs_solid_t), intent(in) :: solid
    character(*), intent(in) :: name                      !! of the patch, for the message
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: spans1(:), spans2(:), spans3(:)
    real(wp) :: places(3, 3)
    integer :: i, j, k

    spans1 = span_table(solid%axes(1))
    spans2 = span_table(solid%axes(2))
    spans3 = span_table(solid%axes(3))
    do k = 1, size(spans3)
      places(:, 3) = places_in(solid%axes(3), spans3(k))
      do j = 1, size(spans2)
        places(:, 2) = places_in(solid%axes(2), spans2(j))
        do i = 1, size(spans1)
          places(:, 1) = places_in(solid%axes(1), spans1(i))
          call check_element(solid, name, places, error)
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine check_shape

  !> Start, middle and end of a span.
  pure function places_in(axis, span) result(places)
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: span
    real(wp) :: places(3)

    associate (first => axis%knots(span), last => axis%knots(span + 1))
      places = [first, 0.5_wp*(first + last), last]
    end associate
  end function places_in

  !> One element, whose places along each axis are the columns of `places`. Middles are left out
  !! along axes of degree 1, where the ends say more.
  subroutine check_element(solid, name, places, error)
    type(nurbs_solid_t), intent(in) :: solid
    character(*), intent(in) :: name
    real(wp), intent(in) :: places(3, 3)
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: round_off = 1.0e-6_wp   ! of the volume at the centre
    real(wp) :: centre, volume, xi(3), x(3)
    integer :: a, b, c, stride(3)

    xi = places(2, :)
    centre = volume_at(solid, xi)
    volume = centre
    if (centre > 0.0_wp) then
      stride = merge(2, 1, solid%axes%degree == 1)
      search: do c = 1, 3, stride(3)
        do b = 1, 3, stride(2)
          do a = 1, 3, stride(1)
            xi = [places(a, 1), places(b, 2), places(c, 3)]
            volume = volume_at(solid, xi + inset*(places(2, :) - xi))
            if (.not. volume >= -round_off*centre) exit search
          end do
        end do
      end do search
    end if
    if (centre > 0.0_wp .and. volume >= -round_off*centre) return
    call evaluate_solid(solid, xi, x)
    call fail(error, "the patch "//name//", folded, inverted or flat at "// &
              place_text(x)//": its jacobian there is not positive")
  end subroutine check_element

  !> Determinant of the jacobian.
  pure real(wp) function volume_at(solid, xi) result(volume)
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), intent(in) :: xi(3)
    real(wp) :: x(3), a(3, 3)

    call evaluate_solid(solid, xi, x, a)
    volume = determinant(a)
  end function volume_at

end module patch_setup
