!> Boundary conditions of the scene as supports of the model; the control points of a named set, and
!! curves of the scene.
module boundary_setup
  use kinds, only: wp
  use scene, only: scene_t, set_spec_t, is_held
  use motion_curve, only: curve_t, constant_curve, curve_value
  use blank, only: blank_t
  use boundary, only: boundary_t
  use model, only: model_t, add_support
  use patch_seams, only: seams_t, collect, largest_of_groups, distribute
  implicit none
  private

  public :: add_supports, last_alike, curve_of, owner_t, new_owners, list_points
  public :: members_t, find_members

  !> Number of the entry of the scene that has the last word on each component of the control points
  !! of a patch, 0: none.
  type :: owner_t
    integer, allocatable :: entry(:, :, :, :)   !! shape (n1, n2, n3, components)
  end type owner_t

  !> Which control points of a patch belong to a set.
  type :: members_t
    logical, allocatable :: is_in(:, :, :)   !! shape (n1, n2, n3)
  end type members_t

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
  subroutine add_supports(scene, model)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    integer :: first, last, n_steps

    allocate (model%supports(0), model%later_supports(0))
    n_steps = 1 + size(model%later_steps)
    last = 0
    do while (last < n_steps)
      first = last + 1
      last = last_alike(first, n_steps, scene%boundaries%first_step, scene%boundaries%last_step)
      call add_supports_of(scene, first, last, model)
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
  subroutine add_supports_of(scene, first, last, model)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: first, last
    type(model_t), intent(inout) :: model
    type(owner_t), allocatable :: owners(:)
    type(members_t), allocatable :: members(:)
    logical :: is_held(3, size(scene%boundaries))
    type(boundary_t) :: support
    integer :: i, c, p

    associate (boundaries => scene%boundaries, blank => model%bodies%blank)
      do i = 1, size(boundaries)
        is_held(:, i) = boundaries(i)%is_prescribed .and. boundaries(i)%first_step <= first &
                        .and. boundaries(i)%last_step >= first
      end do
      owners = new_owners(blank, 3)
      do i = 1, size(boundaries)
        if (.not. any(is_held(:, i))) cycle
        call find_members(blank, scene%sets(boundaries(i)%set), members)
        do c = 1, 3
          do p = 1, size(owners)
            where (members(p)%is_in .and. is_held(c, i)) owners(p)%entry(:, :, :, c) = i
          end do
        end do
      end do
      do i = 1, size(boundaries)
        do c = 1, 3
          if (.not. is_held(c, i)) cycle
          support%name = "boundary "//scene%sets(boundaries(i)%set)%name
          support%curve = curve_of(scene, boundaries(i)%curve)
          support%component = c
          support%velocity = boundaries(i)%velocity(c)
          call list_points(owners, c, i, support%part, support%points)
          support%first_step = first
          support%last_step = last
          support%given_step = boundaries(i)%first_step
          if (first == 1) call start_held(support, blank)
          call add_support(model, support)
        end do
      end do
    end associate
  end subroutine add_supports_of

  !> What a support of the first step holds starts with its velocity: the impulse of a sudden start
  !! would do work that no balance of finite forces can follow.
  subroutine start_held(support, blank)
    type(boundary_t), intent(in) :: support
    type(blank_t), intent(inout) :: blank
    integer :: p

    do p = 1, size(support%part)
      associate (at => support%points(:, p), v => blank%parts(support%part(p))%element%motion%v)
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
      end associate
    end do
  end function new_owners

  !> The control points that an entry owns in one component.
  pure subroutine list_points(owners, component, entry, part, points)
    type(owner_t), intent(in) :: owners(:)
    integer, intent(in) :: component, entry
    integer, allocatable, intent(out) :: part(:)        !! patch of each, shape (n)
    integer, allocatable, intent(out) :: points(:, :)   !! control indices, shape (3, n)
    integer :: p, i, j, k, n

    n = sum([(count(owners(p)%entry(:, :, :, component) == entry), p=1, size(owners))])
    allocate (part(n), points(3, n))
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

end module boundary_setup