!> Tangent stiffness of a body as a sparse matrix: central differences of the body's own force
!! routines, so that it fits every kind of element, rule and law. Bits do not depend on the number
!! of threads.
!!
!! Most kinds of elements give the stiffness of each element by displacements of its own control
!! points, some 3 (p + 1)^2 n3 evaluations with each sign, for eight elements side by side. Of
!! strips and of coupled projections all forces of a part are found at once: a force depends on
!! control points that share an element with its own, control points further apart along some axis
!! move in one evaluation, and each force belongs to one of them. So a matrix takes some 3 (2p +
!! 1)^2 n3 evaluations with each sign, however many elements there are.
module body_stiffness
  use kinds, only: wp
  use failure, only: error_t
  use knot_vector, only: knot_vector_t, span_table
  use patch_seams, only: seams_t, top_of
  use block_law, only: block_law_t
  use element, only: element_t, part_t, force_report_t, next_element
  use linear_algebra, only: cross
  use patch_points, only: determinant
  use vibration, only: fixed_t
  use basis_tables, only: n_lanes
  use shell_joints, only: shell_joints_t, add_joint_forces
  use body_parts, only: field_t
  use unknowns, only: new_unknowns, tie_t, unknowns_t
  use sparse_matrix, only: add_block, add_entry, couplings_t, element_components, new_patch_grid, &
                           new_symmetric_matrix, patch_grid_t, symmetric_matrix_t
  implicit none
  private

  public :: find_unknowns, new_body_stiffness, add_stiffness, n_evaluations, masses_of
  public :: bending_guess, field_of

  !> The matrix over the unknowns of a body, and where its entries come from.
  type, public :: body_stiffness_t
    type(unknowns_t) :: map
    type(patch_grid_t), allocatable :: grids(:)    !! of the parts
    type(couplings_t) :: cells                     !! components of each cell of the joints
    type(symmetric_matrix_t) :: matrix
  end type body_stiffness_t

  !> Control points along an axis that may move at once have one colour.
  type :: colours_t
    integer :: n = 0
    integer, allocatable :: of(:)                  !! of each control point
    integer, allocatable :: moved(:, :)            !! the one of colour c that i shares elements
                                                   !! with, 0: there is none; (i, c)
  end type colours_t

  !> Control points of a cell of the joints, each once.
  type :: cell_t
    integer :: lane = 0, block = 0
    integer, allocatable :: points(:)              !! of those that springs move
    integer, allocatable :: place(:, :)            !! there, of each node; (nodes, 3 rows)
  end type cell_t

contains

  !> Number the components that are free. What follows a leader or meets at a seam is one unknown,
  !! which is held where one of its components is.
  subroutine find_unknowns(parts, seams, fixed, map, error)
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams
    type(fixed_t), intent(in) :: fixed(:)          !! by part
    type(unknowns_t), intent(out) :: map
    type(error_t), allocatable, intent(out) :: error
    integer :: before(size(parts) + 1), p, c, t
    integer, allocatable :: root(:)
    logical, allocatable :: held(:)
    type(tie_t), allocatable :: ties(:)

    before(1) = 0
    do p = 1, size(parts)
      before(p + 1) = before(p) + size(parts(p)%element%mass)
    end do
    call find_roots(before, seams, fixed, root, held)
    call hold_idle(before, parts, root, held)
    allocate (ties(count(root /= [(c, c=1, size(root))] .and. .not. held) + n_followers(parts)))
    t = 0
    do p = 1, size(parts)
      call add_followers(before(p), parts(p)%element, t, ties)
    end do
    do c = 1, size(root)
      if (root(c) == c .or. held(c)) cycle
      t = t + 1
      ties(t)%component = c
      ties(t)%leaders = [root(c)]
      ties(t)%coefficients = [1.0_wp]
    end do
    call new_unknowns(held, ties, map, error)
  end subroutine find_unknowns

  !> Control points outside of outlines are held; those that follow others at their edges leave the
  !! groups that they are in, of which another member becomes the root.
  pure subroutine hold_idle(before, parts, root, held)
    integer, intent(in) :: before(:)
    type(part_t), intent(in) :: parts(:)
    integer, intent(inout) :: root(:)
    logical, intent(inout) :: held(:)
    logical :: is_free(size(root))
    integer :: heir(size(root)), p, i, c, n(3), layer

    if (.not. any([(allocated(parts(p)%element%ties%is_idle), p=1, size(parts))])) return
    is_free = .true.
    do p = 1, size(parts)
      associate (ties => parts(p)%element%ties)
        if (.not. allocated(ties%is_idle)) cycle
        n = shape(parts(p)%element%mass)
        do i = 1, product(n)
          layer = mod(i - 1, n(1)*n(2))
          associate (at => [mod(layer, n(1)) + 1, layer/n(1) + 1], c => 3*(before(p) + i - 1))
            if (ties%is_free(at(1), at(2))) cycle
            is_free(c + 1:c + 3) = .false.
            held(c + 1:c + 3) = ties%is_idle(at(1), at(2))
          end associate
        end do
      end associate
    end do
    heir = 0
    do c = 1, size(root)
      if (.not. is_free(c)) then
        root(c) = c
      else if (.not. is_free(root(c))) then
        if (heir(root(c)) == 0) heir(root(c)) = c
        root(c) = heir(root(c))
      end if
    end do
  end subroutine hold_idle

  pure integer function n_followers(parts) result(n)
    type(part_t), intent(in) :: parts(:)
    integer :: p

    n = sum([(3*parts(p)%element%ties%n*size(parts(p)%element%mass, 3), p=1, size(parts))])
  end function n_followers

  !> Ties of the control points that follow others at the edges of outlines.
  pure subroutine add_followers(n_before, element, n, ties)
    integer, intent(in) :: n_before               !! control points of the parts before
    class(element_t), intent(in) :: element
    integer, intent(inout) :: n                   !! ties so far
    type(tie_t), intent(inout) :: ties(:)
    integer :: t, c, k, l, size_of(3)

    size_of = shape(element%mass)
    associate (edge => element%ties)
      do t = 1, edge%n
        do k = 1, size_of(3)
          do c = 1, 3
            n = n + 1
            ties(n)%component = component_at(edge%followers(t)%at)
            ties(n)%coefficients = edge%followers(t)%coefficient
            ties(n)%leaders = [(component_at(edge%followers(t)%leader(:, l)), &
                                l=1, size(ties(n)%coefficients))]
          end do
        end do
      end do
    end associate

  contains

    pure integer function component_at(at)
      integer, intent(in) :: at(2)

      component_at = 3*(n_before + at(1) - 1 + size_of(1)*(at(2) - 1 + size_of(2)*(k - 1))) + c
    end function component_at
  end subroutine add_followers

  !> The first of the components that each moves with, and whether one of them is held.
  pure subroutine find_roots(before, seams, fixed, root, held)
    integer, intent(in) :: before(:)               !! control points of the parts before
    type(seams_t), intent(in) :: seams
    type(fixed_t), intent(in) :: fixed(:)
    integer, allocatable, intent(out) :: root(:)
    logical, allocatable, intent(out) :: held(:)
    integer :: p, i, n, c, g, first
    logical, allocatable :: is_fixed(:)

    root = [(c, c=1, 3*before(size(before)))]
    allocate (held(size(root)), source=.false.)
    do p = 1, size(fixed)
      n = before(p + 1) - before(p)
      is_fixed = [fixed(p)%is_fixed]
      do i = 1, 3*n
        held(component_of(before(p), n, i)) = is_fixed(i)
        if (allocated(fixed(p)%leader)) &
          call join(component_of(before(p), n, i), &
                    component_of(before(p), n, fixed(p)%leader(i)), root)
      end do
    end do
    do g = 1, seams%n_groups
      first = before(seams%patch(seams%first(g))) + seams%point(seams%first(g))
      do i = seams%first(g) + 1, seams%first(g + 1) - 1
        do c = 1, 3
          call join(3*(first - 1) + c, 3*(before(seams%patch(i)) + seams%point(i) - 1) + c, root)
        end do
      end do
    end do
    do c = 1, size(root)
      root(c) = top_of(root, c)
      held(root(c)) = held(root(c)) .or. held(c)
    end do
    held = held(root)
  end subroutine find_roots

  !> Number of a component from its place in the field of a part as one list.
  pure integer function component_of(n_before, n, place) result(component)
    integer, intent(in) :: n_before, n, place      !! n: control points of the part

    component = 3*(n_before + mod(place - 1, n)) + (place - 1)/n + 1
  end function component_of

  pure subroutine join(a, b, root)
    integer, intent(in) :: a, b
    integer, intent(inout) :: root(:)
    integer :: top(2)

    top = [top_of(root, a), top_of(root, b)]
    root(top) = minval(top)
  end subroutine join

  !> Lumped masses of all components.
  pure function masses_of(parts) result(masses)
    type(part_t), intent(in) :: parts(:)
    real(wp), allocatable :: masses(:)
    integer :: p, i

    allocate (masses(0))
    do p = 1, size(parts)
      associate (mass => [parts(p)%element%mass])
        masses = [masses, [(mass((i + 2)/3), i=1, 3*size(mass))]]
      end associate
    end do
  end function masses_of

  !> Components of a patch as a field.
  pure function field_of(stiffness, p, n, components) result(field)
    type(body_stiffness_t), intent(in) :: stiffness
    integer, intent(in) :: p, n(4)
    real(wp), intent(in) :: components(:)
    real(wp) :: field(n(1), n(2), n(3), n(4))
    integer :: c, first

    do c = 1, 3
      first = 3*stiffness%grids(p)%n_before + c
      field(:, :, :, c) = reshape(components(first:first + 3*(product(n(:3)) - 1):3), n(:3))
    end do
  end function field_of

  !> About the square of the angular frequency that a cantilever would have that is as thick as the
  !! body and as long as its diameter: below the lowest of most bodies.
  real(wp) function bending_guess(bodies, law) result(square)
    type(part_t), intent(in) :: bodies(:)
    class(block_law_t), intent(in) :: law
    real(wp) :: low(3), high(3), length, volume, areas(3), mass
    integer :: p, c

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    volume = 0.0_wp
    areas = 0.0_wp
    mass = 0.0_wp
    do p = 1, size(bodies)
      associate (element => bodies(p)%element)
        do c = 1, 3
          low(c) = min(low(c), minval(element%motion%x(:, :, :, c)))
          high(c) = max(high(c), maxval(element%motion%x(:, :, :, c)))
        end do
        mass = mass + sum(element%mass)
      end associate
      call add_sizes(bodies(p), volume, areas)
    end do
    length = norm2(high - low)
    square = law%shear*(volume/maxval(areas))**2*volume/(mass*length**4)
  end function bending_guess

  !> Volume at the start, and areas across the three axes, each the mean over its elements: volume
  !! over the largest is the thickness of a sheet. By one point of each element.
  subroutine add_sizes(part, volume, areas)
    type(part_t), intent(in) :: part
    real(wp), intent(inout) :: volume, areas(3)
    real(wp) :: j(3, 3), x(3)
    integer :: e(3), i, axis

    e = [0, 1, 1]
    associate (element => part%element)
      do i = 1, product(element%n_elements)
        call next_element(element%n_elements, e)
        call element%jacobian(element%grid, e, [1, 1, 1], j, x)
        volume = volume + 8.0_wp*abs(determinant(j))
        do axis = 1, 3
          areas(axis) = areas(axis) + 4.0_wp*norm2(cross(j(:, modulo(axis, 3) + 1), &
                                                         j(:, modulo(axis + 1, 3) + 1))) &
                                      /element%n_elements(axis)
        end do
      end do
    end associate
  end subroutine add_sizes

  !> The unknowns of a body and the entries of its matrix, which are zero yet.
  subroutine new_body_stiffness(stiffness, parts, seams, fixed, error, joints)
    type(body_stiffness_t), intent(out) :: stiffness
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams
    type(fixed_t), intent(in) :: fixed(:)          !! by part
    type(error_t), allocatable, intent(out) :: error
    type(shell_joints_t), intent(in), optional :: joints   !! of shells that pass moments
    integer :: p, n_before

    call find_unknowns(parts, seams, fixed, stiffness%map, error)
    if (allocated(error)) return
    allocate (stiffness%grids(size(parts)))
    n_before = 0
    do p = 1, size(parts)
      call set_grid(parts(p)%element, n_before, stiffness%grids(p))
      n_before = n_before + size(parts(p)%element%mass)
    end do
    stiffness%cells%first = [1]
    allocate (stiffness%cells%component(0))
    if (present(joints)) call list_cells(joints, stiffness%grids, stiffness%cells)
    call new_symmetric_matrix(stiffness%matrix, stiffness%grids, stiffness%map, stiffness%cells)
  end subroutine new_body_stiffness

  pure subroutine set_grid(element, n_before, grid)
    class(element_t), intent(in) :: element
    integer, intent(in) :: n_before
    type(patch_grid_t), intent(out) :: grid

    associate (axes => element%grid%axes, n => shape(element%mass))
      if (element%is_coupled) then
        call new_patch_grid(grid, n, n, [1], [1], [1], n_before)
      else
        call new_patch_grid(grid, n, axes%degree + 1, first_points(axes(1)), &
                            first_points(axes(2)), first_points(axes(3)), n_before)
      end if
    end associate
  end subroutine set_grid

  !> The first control point of each element along an axis.
  pure function first_points(axis) result(first)
    type(knot_vector_t), intent(in) :: axis
    integer, allocatable :: first(:)

    first = span_table(axis) - axis%degree
  end function first_points

  !> Components that each cell of the joints couples.
  pure subroutine list_cells(joints, grids, cells)
    type(shell_joints_t), intent(in) :: joints
    type(patch_grid_t), intent(in) :: grids(:)
    type(couplings_t), intent(inout) :: cells
    type(cell_t) :: cell
    integer :: i, k, c, p

    do i = 1, joints%n_cells
      call set_cell(joints, i, cell)
      do k = 1, size(cell%points)
        p = count(joints%start <= cell%points(k))
        associate (point => grids(p)%n_before + joints%place(cell%points(k)))
          cells%component = [cells%component, [(3*(point - 1) + c, c=1, 3)]]
        end associate
      end do
      cells%first = [cells%first, size(cells%component) + 1]
    end do
  end subroutine list_cells

  pure subroutine set_cell(joints, number, cell)
    type(shell_joints_t), intent(in) :: joints
    integer, intent(in) :: number
    type(cell_t), intent(out) :: cell
    integer :: i, row, k, n

    cell%block = (number - 1)/n_lanes + 1
    cell%lane = number - n_lanes*(cell%block - 1)
    allocate (cell%points(3*joints%n_nodes), cell%place(joints%n_nodes, 3))
    n = 0
    do row = 1, 3
      do i = 1, joints%n_nodes
        associate (node => joints%node(cell%lane, i, row, cell%block))
          do k = 1, n
            if (cell%points(k) == node) exit
          end do
          cell%points(k) = node
          cell%place(i, row) = k
          n = max(n, k)
        end associate
      end do
    end do
    cell%points = cell%points(:n)
  end subroutine set_cell

  !> Add to the matrix how forces at the end of the motion that the parts make in `dt` from here
  !! change with displacements. Stress, state and motion stay, but for the internal forces, which
  !! are used up.
  subroutine add_stiffness(stiffness, parts, law, dt, amount, joints)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(part_t), intent(inout) :: parts(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                     !! [time]
    real(wp), intent(in) :: amount                 !! displacement of the differences [length]
    type(shell_joints_t), intent(inout), optional :: joints
    integer :: p

    do p = 1, size(parts)
      if (parts(p)%element%n_stiffness_blocks() > 0) then
        call add_elements(stiffness, stiffness%grids(p), parts(p)%element, law, dt, amount)
      else
        call add_part(stiffness, stiffness%grids(p), parts(p)%element, law, dt, amount)
      end if
    end do
    if (.not. present(joints)) return
    if (joints%n_cells > 0) call add_joints(stiffness, parts, joints, dt, amount)
  end subroutine add_stiffness

  !> Force evaluations of all elements that a matrix takes, those of a part by its share.
  pure real(wp) function n_evaluations(stiffness, parts) result(n)
    type(body_stiffness_t), intent(in) :: stiffness
    type(part_t), intent(in) :: parts(:)
    integer :: p, n_points
    real(wp) :: of_part

    n = 0.0_wp
    n_points = 0
    do p = 1, size(parts)
      associate (element => parts(p)%element)
        if (element%n_stiffness_blocks() > 0) then
          of_part = 6.0_wp*product(element%grid%axes%degree + 1)
        else
          of_part = 2.0_wp*n_moves(stiffness, stiffness%grids(p))
        end if
        n = n + of_part*size(element%mass)
        n_points = n_points + size(element%mass)
      end associate
    end do
    n = n/n_points
  end function n_evaluations

  !> Displacements of control points of one colour in one component, where one of them is free.
  pure integer function n_moves(stiffness, grid) result(n)
    type(body_stiffness_t), intent(in) :: stiffness
    type(patch_grid_t), intent(in) :: grid
    type(colours_t) :: colours(3)
    integer :: axis, c, c1, c2, c3

    do axis = 1, 3
      call set_colours(grid%axis(axis)%low, grid%axis(axis)%high, colours(axis))
    end do
    n = 0
    do c3 = 1, colours(3)%n
      do c2 = 1, colours(2)%n
        do c1 = 1, colours(1)%n
          n = n + count([(any_free(stiffness%map, grid, colours, [c1, c2, c3], c), c=1, 3)])
        end do
      end do
    end do
  end function n_moves

  !> Add the stiffness of a part element by element, some blocks at a time.
  subroutine add_elements(stiffness, grid, element, law, dt, amount)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(patch_grid_t), intent(in) :: grid
    class(element_t), intent(inout) :: element
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, amount
    integer, parameter :: most_values = 2**22      ! of the matrices that wait
    real(wp), allocatable :: matrices(:, :, :, :)
    integer, allocatable :: elements(:, :, :)
    integer :: first, n, m, b, l

    m = 3*product(element%grid%axes%degree + 1)
    n = max(1, min(element%n_stiffness_blocks(), most_values/(n_lanes*m*m)))
    allocate (matrices(n_lanes, m, m, n), elements(3, n_lanes, n))
    do first = 1, element%n_stiffness_blocks(), n
      n = min(n, element%n_stiffness_blocks() - first + 1)
      call element%block_stiffness(law, dt, amount, first, elements(:, :, :n), &
                                   matrices(:, :, :, :n))
      do b = 1, n
        do l = 1, n_lanes
          if (elements(1, l, b) == 0) cycle
          associate (k => matrices(l, :, :, b))
            call add_block(stiffness%matrix, stiffness%map, &
                           components_by_axis(grid, elements(:, l, b)), 0.5_wp*(k + transpose(k)))
          end associate
        end do
      end do
    end do
  end subroutine add_elements

  !> Components of an element in the order of its stiffness.
  pure function components_by_axis(grid, element) result(components)
    type(patch_grid_t), intent(in) :: grid
    integer, intent(in) :: element(3)
    integer, allocatable :: components(:)
    integer :: c

    associate (by_point => element_components(grid, element))
      components = [(by_point(c::3), c=1, 3)]
    end associate
  end function components_by_axis

  !> Add the stiffness of a part by differences of all its forces.
  subroutine add_part(stiffness, grid, element, law, dt, amount)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(patch_grid_t), intent(in) :: grid
    class(element_t), intent(inout) :: element
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt, amount
    real(wp), allocatable, dimension(:, :, :, :) :: v, plus
    type(colours_t) :: colours(3)
    type(force_report_t) :: report
    integer :: axis, c, c1, c2, c3

    do axis = 1, 3
      call set_colours(grid%axis(axis)%low, grid%axis(axis)%high, colours(axis))
    end do
    v = element%motion%v
    do c3 = 1, colours(3)%n
      do c2 = 1, colours(2)%n
        do c1 = 1, colours(1)%n
          do c = 1, 3
            if (.not. any_free(stiffness%map, grid, colours, [c1, c2, c3], c)) cycle
            call move_points(colours, [c1, c2, c3], amount/dt, element%motion%v(:, :, :, c))
            call element%end_forces(law, dt, report)
            plus = element%motion%internal_force
            element%motion%v = v
            call move_points(colours, [c1, c2, c3], -amount/dt, element%motion%v(:, :, :, c))
            call element%end_forces(law, dt, report)
            element%motion%v = v
            plus = (plus - element%motion%internal_force)/(2.0_wp*amount)
            call add_columns(stiffness, grid, colours, [c1, c2, c3], c, plus)
          end do
        end do
      end do
    end do
  end subroutine add_part

  !> Is a component free at one of the control points of a colour?
  pure logical function any_free(map, grid, colours, at, component)
    type(unknowns_t), intent(in) :: map
    type(patch_grid_t), intent(in) :: grid
    type(colours_t), intent(in) :: colours(3)
    integer, intent(in) :: at(3), component
    integer :: i, j, k, place

    any_free = .true.
    do k = 1, grid%n(3)
      if (colours(3)%of(k) /= at(3)) cycle
      do j = 1, grid%n(2)
        if (colours(2)%of(j) /= at(2)) cycle
        do i = 1, grid%n(1)
          if (colours(1)%of(i) /= at(1)) cycle
          place = 3*(grid%n_before + i - 1 + grid%n(1)*(j - 1 + grid%n(2)*(k - 1))) + component
          if (map%first(place + 1) > map%first(place)) return
        end do
      end do
    end do
    any_free = .false.
  end function any_free

  !> Give the first colour whose last control point shares no neighbour with the next one.
  pure subroutine set_colours(low, high, colours)
    integer, intent(in) :: low(:), high(:)         !! each shares elements with these
    type(colours_t), intent(out) :: colours
    integer :: last_of(size(low)), i, c

    allocate (colours%of(size(low)), colours%moved(size(low), size(low)), source=0)
    last_of = 0
    do i = 1, size(low)
      c = 1
      do while (last_of(c) >= low(i))
        c = c + 1
      end do
      last_of(c) = high(i)
      colours%of(i) = c
      colours%moved(low(i):high(i), c) = i
    end do
    colours%n = maxval(colours%of)
    colours%moved = colours%moved(:, :colours%n)
  end subroutine set_colours

  pure subroutine move_points(colours, at, speed, v)
    type(colours_t), intent(in) :: colours(3)
    integer, intent(in) :: at(3)                   !! the colour along each axis
    real(wp), intent(in) :: speed
    real(wp), intent(inout) :: v(:, :, :)
    integer :: i, j, k

    do k = 1, size(v, 3)
      if (colours(3)%of(k) /= at(3)) cycle
      do j = 1, size(v, 2)
        if (colours(2)%of(j) /= at(2)) cycle
        do i = 1, size(v, 1)
          if (colours(1)%of(i) == at(1)) v(i, j, k) = v(i, j, k) + speed
        end do
      end do
    end do
  end subroutine move_points

  !> Add the columns of the control points that have moved. Where no components follow others, each
  !! force has places in the matrix of its own, and threads may share them.
  subroutine add_columns(stiffness, grid, colours, at, component, forces)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(patch_grid_t), intent(in) :: grid
    type(colours_t), intent(in) :: colours(3)
    integer, intent(in) :: at(3), component
    real(wp), intent(in) :: forces(:, :, :, :)     !! by displacement
    integer :: i, j, k, c, moved(3), row, column, hint

    !$omp parallel do collapse(2) schedule(static) private(i, c, moved, row, column, hint) &
    !$omp& if (size(stiffness%map%unknown) == stiffness%map%n_free)
    do k = 1, grid%n(3)
      do j = 1, grid%n(2)
        hint = 0
        do i = 1, grid%n(1)
          moved = [colours(1)%moved(i, at(1)), colours(2)%moved(j, at(2)), &
                   colours(3)%moved(k, at(3))]
          if (any(moved == 0)) cycle
          row = 3*(grid%n_before + i - 1 + grid%n(1)*(j - 1 + grid%n(2)*(k - 1)))
          column = 3*(grid%n_before + moved(1) - 1 &
                      + grid%n(1)*(moved(2) - 1 + grid%n(2)*(moved(3) - 1))) + component
          do c = 1, 3
            call add_entry(stiffness%matrix, stiffness%map, row + c, column, forces(i, j, k, c), &
                           hint)
          end do
        end do
      end do
    end do
    !$omp end parallel do
  end subroutine add_columns

  !> Add the stiffness of joints, a block for each cell.
  subroutine add_joints(stiffness, parts, joints, dt, amount)
    type(body_stiffness_t), intent(inout) :: stiffness
    type(part_t), intent(inout) :: parts(:)
    type(shell_joints_t), intent(inout) :: joints
    real(wp), intent(in) :: dt, amount
    type(cell_t) :: cells(joints%n_cells)
    real(wp), allocatable :: blocks(:, :, :)
    integer :: colour(size(joints%place)), i, n, c, k

    do i = 1, size(cells)
      call set_cell(joints, i, cells(i))
    end do
    colour = colours_of_cells(joints, cells)
    allocate (blocks(9*joints%n_nodes, 9*joints%n_nodes, size(cells)), source=0.0_wp)
    do k = 1, maxval(colour)
      do c = 1, 3
        call add_moved(parts, joints, cells, colour == k, c, dt, amount, blocks)
      end do
    end do
    do i = 1, size(cells)
      n = 3*size(cells(i)%points)
      associate (block => blocks(:n, :n, i), &
                 list => stiffness%cells%component(stiffness%cells%first(i): &
                                                   stiffness%cells%first(i + 1) - 1))
        call add_block(stiffness%matrix, stiffness%map, list, 0.5_wp*(block + transpose(block)))
      end associate
    end do
  end subroutine add_joints

  !> Colours of the control points of joints, different within each cell.
  pure function colours_of_cells(joints, cells) result(colour)
    type(shell_joints_t), intent(in) :: joints
    type(cell_t), intent(in) :: cells(:)
    integer :: colour(size(joints%place))
    integer :: k, i, c, step

    step = size(joints%forces)/size(joints%energies)
    colour = 0
    do k = 1, size(colour)
      associate (shares => joints%share(joints%first(k):joints%first(k + 1) - 1))
        c = 1
        i = 1
        do while (i <= size(shares))
          associate (cell => n_lanes*((shares(i) - 1)/step) + mod(shares(i) - 1, n_lanes) + 1)
            i = i + 1
            if (all(colour(cells(cell)%points) /= c)) cycle
          end associate
          c = c + 1
          i = 1
        end do
      end associate
      colour(k) = c
    end do
  end function colours_of_cells

  !> Move some control points of the joints in a component, and add what changes in each cell to the
  !! column of its own one in the block of the cell.
  subroutine add_moved(parts, joints, cells, is_moved, component, dt, amount, blocks)
    type(part_t), intent(inout) :: parts(:)
    type(shell_joints_t), intent(inout) :: joints
    type(cell_t), intent(in) :: cells(:)
    logical, intent(in) :: is_moved(:)
    integer, intent(in) :: component
    real(wp), intent(in) :: dt, amount
    real(wp), intent(inout) :: blocks(:, :, :)     !! one for each cell
    type(force_report_t) :: report
    real(wp), allocatable :: forces(:, :, :, :, :)
    integer :: i, n, row, k, column

    call shift_points(parts, joints, is_moved, component, amount/dt)
    call add_joint_forces(joints, parts, dt, .true., report)
    forces = joints%forces
    call shift_points(parts, joints, is_moved, component, -2.0_wp*amount/dt)
    call add_joint_forces(joints, parts, dt, .true., report)
    call shift_points(parts, joints, is_moved, component, amount/dt)
    forces = (forces - joints%forces)/(2.0_wp*amount)
    do i = 1, size(cells)
      associate (cell => cells(i))
        column = 3*(findloc(is_moved(cell%points), .true., 1) - 1) + component
        if (column < 1) cycle
        do row = 1, 3
          do n = 1, joints%n_nodes
            k = 3*(cell%place(n, row) - 1)
            blocks(k + 1:k + 3, column, i) = blocks(k + 1:k + 3, column, i) &
                                             + forces(cell%lane, n, :, row, cell%block)
          end do
        end do
      end associate
    end do
  end subroutine add_moved

  subroutine shift_points(parts, joints, is_moved, component, speed)
    type(part_t), intent(inout) :: parts(:)
    type(shell_joints_t), intent(in) :: joints
    logical, intent(in) :: is_moved(:)
    integer, intent(in) :: component
    real(wp), intent(in) :: speed
    integer :: p, k, i, j

    do p = 1, size(parts)
      associate (v => parts(p)%element%motion%v)
        do k = joints%start(p), joints%start(p + 1) - 1
          if (.not. is_moved(k)) cycle
          j = (joints%place(k) - 1)/size(v, 1) + 1
          i = joints%place(k) - size(v, 1)*(j - 1)
          v(i, j, 1, component) = v(i, j, 1, component) + speed
        end do
      end associate
    end do
  end subroutine shift_points

end module body_stiffness
