!> Boundary conditions of the scene as supports of the model; the control points of a named set, and
!! curves of the scene.
module boundary_setup
  use kinds, only: wp
  use text, only: string_t
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t, set_spec_t, boundary_spec_t, is_held
  use motion_curve, only: curve_t, constant_curve, curve_value
  use blank, only: blank_t
  use boundary, only: boundary_t, is_there
  use model, only: model_t, add_support
  use patch_joints, only: face_names
  use patch_seams, only: seams_t, collect, largest_of_groups, distribute
  use row_tie, only: row_tie_t, even_out
  implicit none
  private

  public :: add_supports, last_alike, curve_of, owner_t, new_owners, list_points
  public :: members_t, find_members

  !> Number of the entry of the scene that has the last word on each component of the control points
  !! of a patch, 0: none.
  type :: owner_t
    integer, allocatable :: entry(:, :, :, :)   !! shape (n1, n2, n3, components)
    integer, allocatable :: edges(:, :, :, :)   !! see `members_t`, likewise
  end type owner_t

  !> Which control points of a patch belong to a set.
  type :: members_t
    logical, allocatable :: is_in(:, :, :)   !! shape (n1, n2, n3)
    !> Edges of a shell next to which a point is clamped with them, as in `boundary_t`, likewise.
    integer, allocatable :: edges(:, :, :)
  end type members_t

  !> Components of control points that move alike, as a forest: all of one tree do.
  type :: ties_t
    integer, allocatable :: parent(:)        !! place above, itself at the root
    integer, allocatable :: n_before(:)      !! places of the patches before, shape (n_patches)
  end type ties_t

  real(wp), parameter :: straight = 1.0e-6_wp   !! relative, what counts as round-off

contains

  !> Curve by its index; 0 is the constant one.
  pure function curve_of(scene, index) result(curve)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: index
    type(curve_t) :: curve

    curve = constant_curve(1.0_wp)
    if (index == 0) return
    curve%times = scene%curves(index)%times
    curve%values = scene%curves(index)%values
    curve%is_total = scene%curves(index)%is_total
    curve%is_smooth = scene%curves(index)%is_smooth
  end function curve_of

  !> One support per prescribed component. Where supports meet, the last one alone holds the point:
  !! two that pull at it would each count work on a path that is the other's. Steps that change
  !! nothing keep the supports that they find.
  subroutine add_supports(scene, model, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    integer :: first, last, n_steps

    allocate (model%supports(0), model%later_supports(0))
    n_steps = 1 + size(model%later_steps)
    last = 0
    do while (last < n_steps)
      first = last + 1
      last = last_alike(first, n_steps, scene%boundaries%first_step, scene%boundaries%last_step)
      call add_supports_of(scene, first, last, model, errors)
    end do
  end subroutine add_supports

  !> Up to which step the same entries hold as in step `first`.
  pure integer function last_alike(first, n_steps, first_steps, last_steps) result(last)
    integer, intent(in) :: first, n_steps
    integer, intent(in) :: first_steps(:), last_steps(:)   !! of the entries

    last = minval([n_steps, pack(first_steps - 1, first_steps > first), &
                   pack(last_steps, last_steps >= first)])
  end function last_alike

  !> The supports of all steps from `first` to `last`.
  subroutine add_supports_of(scene, first, last, model, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: first, last
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    type(owner_t), allocatable :: owners(:)
    type(members_t), allocatable :: members(:)
    logical :: is_held(3, size(scene%boundaries))
    type(boundary_t) :: support
    type(ties_t) :: ties
    type(string_t) :: notes(size(scene%boundaries))
    integer :: i, c, p

    associate (boundaries => scene%boundaries, blank => model%bodies%blank)
      do i = 1, size(boundaries)
        is_held(:, i) = boundaries(i)%is_prescribed .and. boundaries(i)%first_step <= first &
                        .and. boundaries(i)%last_step >= first
      end do
      owners = new_owners(blank, 3)
      ties = new_ties(blank)
      do i = 1, size(boundaries)
        if (.not. any(is_held(:, i))) cycle
        call find_members(blank, scene%sets(boundaries(i)%set), members)
        call hold_slopes(blank, boundaries(i), boundaries(i)%first_step == first, members, ties, &
                         notes(i)%value, errors)
        do c = 1, 3
          do p = 1, size(owners)
            where (members(p)%is_in .and. is_held(c, i))
              owners(p)%entry(:, :, :, c) = i
              owners(p)%edges(:, :, :, c) = members(p)%edges
            end where
          end do
        end do
      end do
      call join_owners(blank, ties, owners)
      call add_ties(first, last, ties, owners, model)
      do i = 1, size(boundaries)
        do c = 1, 3
          if (.not. is_held(c, i)) cycle
          support%name = "boundary "//scene%sets(boundaries(i)%set)%name
          if (allocated(support%note)) deallocate (support%note)
          if (allocated(notes(i)%value)) support%note = notes(i)%value
          support%curve = curve_of(scene, boundaries(i)%curve)
          support%component = c
          support%velocity = boundaries(i)%velocity(c)
          call list_points(owners, c, i, support%part, support%points, support%edges)
          support%first_step = first
          support%last_step = last
          support%given_step = boundaries(i)%first_step
          if (first == 1) call start_held(support, blank)
          call add_support(model, support)
        end do
      end do
    end associate
  end subroutine add_supports_of

  !> What names of boundary conditions hold of the row next to an edge of a shell: all of a clamped
  !! one, and along a plane of symmetry what moves it against the edge.
  subroutine hold_slopes(blank, boundary, is_new, members, ties, note, errors)
    type(blank_t), intent(in) :: blank
    type(boundary_spec_t), intent(in) :: boundary
    logical, intent(in) :: is_new                         !! it begins with the steps in hand
    type(members_t), intent(inout) :: members(:)          !! of its set, by patch
    type(ties_t), intent(inout) :: ties
    character(:), allocatable, intent(out) :: note        !! for the list of supports
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: before(:)
    integer :: p, c

    if (boundary%word == "ENCASTRE") then
      before = [(count(members(p)%is_in), p=1, size(members))]
      call add_clamped_rows(blank, members)
      if (any([(count(members(p)%is_in), p=1, size(members))] > before)) &
        note = "clamped: holds the next row of control points, too"
    end if
    c = findloc(["XSYMM", "YSYMM", "ZSYMM"] == boundary%word, .true., 1)
    if (c == 0) return
    before = ties%parent
    call tie_rows(blank, members, c, ties)
    if (any(ties%parent /= before)) note = "keeps its slope: the next row of control points follows"
    if (is_new) call warn_of_hinge(blank, members, c, boundary, errors)
  end subroutine hold_slopes

  !> What moves alike in the steps from `first` to `last` because of planes of symmetry.
  subroutine add_ties(first, last, ties, owners, model)
    integer, intent(in) :: first, last
    type(ties_t), intent(in) :: ties
    type(owner_t), intent(in) :: owners(:)
    type(model_t), intent(inout) :: model
    type(row_tie_t), allocatable :: tie
    integer :: c

    do c = 1, 3
      allocate (tie)
      call list_ties(model%bodies%blank, ties, owners, c, tie)
      if (size(tie%last) > 0) then
        tie%name = "symmetry"
        tie%first_step = first
        tie%last_step = last
        tie%given_step = first
        if (first == 1) call even_out(tie, model%bodies%blank)
        call add_support(model, tie)
      end if
      deallocate (tie)
    end do
  end subroutine add_ties

  !> What a support of the first step holds starts with its velocity: the impulse of a sudden start
  !! would do work that no balance of finite forces can follow.
  subroutine start_held(support, blank)
    type(boundary_t), intent(in) :: support
    type(blank_t), intent(inout) :: blank
    integer :: p

    do p = 1, size(support%part)
      associate (at => support%points(:, p), v => blank%parts(support%part(p))%element%motion%v)
        if (.not. is_there(blank%parts(support%part(p))%element, at, support%edges(p))) cycle
        v(at(1), at(2), at(3), support%component) = support%velocity &
                                                    *curve_value(support%curve, 0.0_wp)
      end associate
    end do
  end subroutine start_held

  !> Nothing owned yet.
  function new_owners(blank, n_components) result(owners)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: n_components
    type(owner_t), allocatable :: owners(:)
    integer :: p

    allocate (owners(size(blank%parts)))
    do p = 1, size(owners)
      associate (n => blank%parts(p)%element%grid%axes%n_basis)
        allocate (owners(p)%entry(n(1), n(2), n(3), n_components), source=0)
        owners(p)%edges = owners(p)%entry
      end associate
    end do
  end function new_owners

  !> The control points that an entry owns in one component.
  pure subroutine list_points(owners, component, entry, part, points, edges)
    type(owner_t), intent(in) :: owners(:)
    integer, intent(in) :: component, entry
    integer, allocatable, intent(out) :: part(:)        !! patch of each, shape (n)
    integer, allocatable, intent(out) :: points(:, :)   !! control indices, shape (3, n)
    integer, allocatable, intent(out), optional :: edges(:)   !! see `members_t`, shape (n)
    integer :: p, i, j, k, n

    n = sum([(count(owners(p)%entry(:, :, :, component) == entry), p=1, size(owners))])
    allocate (part(n), points(3, n))
    if (present(edges)) allocate (edges(n))
    n = 0
    do p = 1, size(owners)
      associate (owner => owners(p)%entry)
        do k = 1, size(owner, 3)
          do j = 1, size(owner, 2)
            do i = 1, size(owner, 1)
              if (owner(i, j, k, component) /= entry) cycle
              n = n + 1
              part(n) = p
              points(:, n) = [i, j, k]
              if (present(edges)) edges(n) = owners(p)%edges(i, j, k, component)
            end do
          end do
        end do
      end associate
    end do
  end subroutine list_points

  !> Control points of all patches that belong to a set; with one all that it is joined to.
  subroutine find_members(blank, set, members)
    type(blank_t), intent(in) :: blank
    type(set_spec_t), intent(in) :: set
    type(members_t), allocatable, intent(out) :: members(:)   !! by patch
    type(seams_t) :: seams
    real(wp), allocatable :: mark(:, :, :)
    integer :: p

    allocate (members(size(blank%parts)))
    seams = blank%seams
    do p = 1, size(members)
      members(p)%is_in = is_held(blank%parts(p)%element%grid, set, p)
      members(p)%edges = merge(0, 0, members(p)%is_in)
      mark = merge(1.0_wp, 0.0_wp, members(p)%is_in)
      call collect(seams, p, size(mark), 1, mark)
    end do
    if (seams%n_groups == 0) return
    call largest_of_groups(seams, 1)
    do p = 1, size(members)
      mark = merge(1.0_wp, 0.0_wp, members(p)%is_in)
      call distribute(seams, p, size(mark), 1, mark)
      members(p)%is_in = mark > 0.0_wp
    end do
  end subroutine find_members

  !> Of the members of a clamped set, those on an edge of a shell clamp the row next to it.
  pure subroutine add_clamped_rows(blank, members)
    type(blank_t), intent(in) :: blank
    type(members_t), intent(inout) :: members(:)   !! by patch
    logical, allocatable :: is_in(:, :, :)
    integer :: p, edge, i, at(3), next(3)

    do p = 1, size(members)
      if (.not. blank%parts(p)%element%is_surface) cycle
      is_in = members(p)%is_in
      do edge = 1, 4
        do i = 1, size(is_in, merge(2, 1, edge <= 2))
          call row_pair(shape(is_in), edge, i, at, next)
          if (.not. is_in(at(1), at(2), at(3)) .or. is_in(next(1), next(2), next(3))) cycle
          members(p)%is_in(next(1), next(2), next(3)) = .true.
          associate (edges => members(p)%edges(next(1), next(2), next(3)))
            edges = ibset(edges, edge - 1)
          end associate
        end do
      end do
    end do
  end subroutine add_clamped_rows

  !> The i-th control point of an edge (1 xi_min, 2 xi_max, 3 eta_min, 4 eta_max) and its neighbour
  !! inside.
  pure subroutine row_pair(n, edge, i, at, next)
    integer, intent(in) :: n(3), edge, i
    integer, intent(out) :: at(3), next(3)
    integer :: axis

    axis = merge(1, 2, edge <= 2)
    at = 1
    at(3 - axis) = i
    if (mod(edge, 2) == 0) at(axis) = n(axis)
    next = at
    next(axis) = at(axis) + merge(1, -1, mod(edge, 2) == 1)
  end subroutine row_pair

  !> Each component for itself.
  pure function new_ties(blank) result(ties)
    type(blank_t), intent(in) :: blank
    type(ties_t) :: ties
    integer :: p, i, n

    allocate (ties%n_before(size(blank%parts)))
    n = 0
    do p = 1, size(blank%parts)
      ties%n_before(p) = n
      n = n + 3*size(blank%parts(p)%element%grid%weights)
    end do
    ties%parent = [(i, i=1, n)]
  end function new_ties

  !> Place of a component of a control point.
  pure integer function place_of_tie(blank, ties, part, at, component) result(place)
    type(blank_t), intent(in) :: blank
    type(ties_t), intent(in) :: ties
    integer, intent(in) :: part, at(3), component

    associate (n => blank%parts(part)%element%grid%axes%n_basis)
      place = ties%n_before(part) + at(1) + n(1)*(at(2) - 1 + n(2)*(at(3) - 1 + n(3) &
                                                                    *(component - 1)))
    end associate
  end function place_of_tie

  pure integer function root_of(ties, place) result(root)
    type(ties_t), intent(in) :: ties
    integer, intent(in) :: place

    root = place
    do while (ties%parent(root) /= root)
      root = ties%parent(root)
    end do
  end function root_of

  !> The members of a set in a plane of symmetry tie the row next to their edge to them, along the
  !! plane, where that row lies straight across it.
  pure subroutine tie_rows(blank, members, across, ties)
    type(blank_t), intent(in) :: blank
    type(members_t), intent(in) :: members(:)
    integer, intent(in) :: across              !! the component across the plane
    type(ties_t), intent(inout) :: ties
    integer :: p, edge, i, c, at(3), next(3), roots(2)

    do p = 1, size(members)
      if (.not. blank%parts(p)%element%is_surface) cycle
      associate (is_in => members(p)%is_in, x => blank%parts(p)%element%grid%points)
        do edge = 1, 4
          do i = 1, size(is_in, merge(2, 1, edge <= 2))
            call row_pair(shape(is_in), edge, i, at, next)
            if (.not. is_in(at(1), at(2), at(3))) cycle
            if (.not. is_straight(x(next(1), next(2), next(3), :) &
                                  - x(at(1), at(2), at(3), :), across)) cycle
            do c = 1, 3
              if (c == across) cycle
              roots = [root_of(ties, place_of_tie(blank, ties, p, at, c)), &
                       root_of(ties, place_of_tie(blank, ties, p, next, c))]
              ties%parent(maxval(roots)) = minval(roots)
            end do
          end do
        end do
      end associate
    end do
  end subroutine tie_rows

  !> Does a way run straight across a plane?
  pure logical function is_straight(way, across)
    real(wp), intent(in) :: way(3)
    integer, intent(in) :: across              !! the component across the plane

    is_straight = norm2(way) - abs(way(across)) <= straight*norm2(way)
  end function is_straight

  !> Warn of an edge in a plane of symmetry from which the sheet does not run straight across it:
  !! its slope there is free.
  subroutine warn_of_hinge(blank, members, across, boundary, errors)
    type(blank_t), intent(in) :: blank
    type(members_t), intent(in) :: members(:)
    integer, intent(in) :: across              !! the component across the plane
    type(boundary_spec_t), intent(in) :: boundary
    type(error_list_t), intent(inout) :: errors
    integer :: p, edge

    do p = 1, size(members)
      if (.not. blank%parts(p)%element%is_surface) cycle
      do edge = 1, 4
        if (.not. is_hinge(blank%parts(p)%element%grid%points, members(p)%is_in, edge, across)) &
          cycle
        call add_warning(errors, boundary%origin, trim(boundary%word)//" on the edge "// &
                         trim(face_names(edge))//" of '"//blank%parts(p)%element%name// &
                         "' with ELEMENT=SHELL, whose next row of control points does not lie "// &
                         "straight across the plane: a hinge", "a sheet that meets the plane "// &
                         "at a right angle, or ENCASTRE")
      end do
    end do
  end subroutine warn_of_hinge

  !> Does an edge lie in the plane as a whole, and the row next to it neither there nor straight
  !! across?
  pure logical function is_hinge(x, is_in, edge, across)
    real(wp), intent(in) :: x(:, :, :, :)      !! control points [length]
    logical, intent(in) :: is_in(:, :, :)      !! in the set
    integer, intent(in) :: edge, across
    real(wp) :: from(3), way(3), size_of
    integer :: i, at(3), next(3)

    is_hinge = .false.
    call row_pair(shape(is_in), edge, 1, at, next)
    from = x(at(1), at(2), at(3), :)
    size_of = 0.0_wp
    do i = 1, size(is_in, merge(2, 1, edge <= 2))
      call row_pair(shape(is_in), edge, i, at, next)
      way = x(at(1), at(2), at(3), :) - from
      size_of = max(size_of, norm2(way))
      is_hinge = .false.
      if (.not. is_in(at(1), at(2), at(3)) .or. is_in(next(1), next(2), next(3))) return
      if (abs(way(across)) > straight*size_of) return
    end do
    if (.not. size_of > 0.0_wp) return         ! a pole
    do i = 1, size(is_in, merge(2, 1, edge <= 2))
      call row_pair(shape(is_in), edge, i, at, next)
      way = x(next(1), next(2), next(3), :) - x(at(1), at(2), at(3), :)
      is_hinge = is_hinge .or. (.not. is_straight(way, across) .and. &
                                abs(way(across)) > straight*norm2(way))
    end do
  end function is_hinge

  !> What an entry of the deck holds it holds of all that is tied to it.
  pure subroutine join_owners(blank, ties, owners)
    type(blank_t), intent(in) :: blank
    type(ties_t), intent(in) :: ties
    type(owner_t), intent(inout) :: owners(:)
    integer :: entries(size(ties%parent)), pass, p, i, j, k, c, root

    entries = 0
    do pass = 1, 2
      do p = 1, size(owners)
        if (.not. blank%parts(p)%element%is_surface) cycle
        associate (entry => owners(p)%entry)
          do c = 1, 3
            do k = 1, size(entry, 3)
              do j = 1, size(entry, 2)
                do i = 1, size(entry, 1)
                  root = root_of(ties, place_of_tie(blank, ties, p, [i, j, k], c))
                  if (pass == 1) entries(root) = max(entries(root), entry(i, j, k, c))
                  if (pass == 2) entry(i, j, k, c) = entries(root)
                end do
              end do
            end do
          end do
        end associate
      end do
    end do
  end subroutine join_owners

  !> Ties of a component between points that nothing else holds, tree by tree.
  pure subroutine list_ties(blank, ties, owners, component, tie)
    type(blank_t), intent(in) :: blank
    type(ties_t), intent(in) :: ties
    type(owner_t), intent(in) :: owners(:)
    integer, intent(in) :: component
    type(row_tie_t), intent(inout) :: tie
    integer, allocatable :: roots(:), part(:), points(:, :), order(:)
    logical :: has_children(size(ties%parent))
    integer :: p, i, j, k, n, at

    has_children = .false.
    do i = 1, size(ties%parent)
      if (ties%parent(i) /= i) has_children(ties%parent(i)) = .true.
    end do
    allocate (roots(0), part(0), points(3, 0), tie%last(0))
    do p = 1, size(owners)
      associate (entry => owners(p)%entry(:, :, :, component))
        do k = 1, size(entry, 3)
          do j = 1, size(entry, 2)
            do i = 1, size(entry, 1)
              at = place_of_tie(blank, ties, p, [i, j, k], component)
              if (entry(i, j, k) > 0) cycle
              if (ties%parent(at) == at .and. .not. has_children(at)) cycle
              roots = [roots, root_of(ties, at)]
              part = [part, p]
              points = reshape([points, i, j, k], [3, size(part)])
            end do
          end do
        end do
      end associate
    end do
    tie%component = component
    order = [integer ::]
    do n = 1, size(roots)
      if (any(roots(:n - 1) == roots(n))) cycle
      order = [order, pack([(i, i=1, size(roots))], roots == roots(n))]
      tie%last = [tie%last, size(order)]
    end do
    tie%part = part(order)
    tie%points = points(:, order)
  end subroutine list_ties

end module boundary_setup
