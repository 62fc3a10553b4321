!> *KNOTS, *CONTROL POINTS and *REFINE: the parts of patches that are listed in the deck.
module patch_keywords
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error
  use text, only: to_text
  use knot_vector, only: knot_vector_t, new_knot_vector
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: nurbs_solid_t
  use refinement, only: insert_knots, elevate_degree, dividing_knots
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_integer, &
                          field_real, all_numbers, deck_names_t, deck_context_t, patch_parts_t, &
                          resolve_option
  implicit none
  private

  public :: collect_parts, check_parts, read_axes, read_points, refine

  !> Refine a surface or a solid by all its *REFINE, in the order of the deck.
  interface refine
    module procedure refine_surface, refine_solid
  end interface refine

contains

  !> Records that name each patch; a name that is no patch is an error.
  subroutine collect_parts(deck, context, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context   !! gets `parts`
    type(error_list_t), intent(inout) :: errors
    integer :: owner(size(deck%records)), i, r

    allocate (context%parts(context%names%patches%n_names))
    call find_owners(deck, "KNOTS", context%names, owner, errors)
    do i = 1, size(context%parts)
      context%parts(i)%knots = pack([(r, r=1, size(owner))], owner == i)
    end do
    call find_owners(deck, "CONTROL POINTS", context%names, owner, errors)
    do i = 1, size(context%parts)
      context%parts(i)%points = pack([(r, r=1, size(owner))], owner == i)
    end do
    call find_owners(deck, "REFINE", context%names, owner, errors)
    do i = 1, size(context%parts)
      context%parts(i)%refinements = pack([(r, r=1, size(owner))], owner == i)
    end do
  end subroutine collect_parts

  subroutine find_owners(deck, keyword, names, owner, errors)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    type(deck_names_t), intent(in) :: names
    integer, intent(out) :: owner(:)   !! place of the patch, by record
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i

    owner = 0
    found = find_records(deck, keyword)
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        call resolve_option(record, "PATCH", names%patches, "*BLANK, *PATCH or *TOOL", &
                            owner(found(i)), errors)
      end associate
    end do
  end subroutine find_owners

  !> Refuse what a patch must not have: knots of an axis above `n_axes`, points of a generated one.
  subroutine check_parts(deck, parts, n_axes, what, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(patch_parts_t), intent(in) :: parts
    integer, intent(in) :: n_axes          !! axes listed in the deck, 0: all is generated
    character(*), intent(in) :: what       !! such as `a blank of TYPE=BOX`
    type(error_list_t), intent(inout) :: errors
    integer :: i, j, axis

    do i = 1, size(parts%knots)
      associate (record => deck%records(parts%knots(i)))
        axis = option_integer(record, "AXIS")
        if (axis > n_axes) then
          call add_error(errors, record%origin, "knots of axis "//to_text(axis)//" for "//what, &
                         "only axes up to "//to_text(n_axes))
        end if
        do j = 1, i - 1
          if (option_integer(deck%records(parts%knots(j)), "AXIS") /= axis) cycle
          call add_error(errors, record%origin, "a second *KNOTS for axis "//to_text(axis)// &
                         " of this patch", "one for each axis")
        end do
      end associate
    end do
    do i = 1, size(parts%points)
      associate (record => deck%records(parts%points(i)))
        if (n_axes == 0) then
          call add_error(errors, record%origin, "control points for "//what, "none")
        else if (i > 1) then
          call add_error(errors, record%origin, "a second *CONTROL POINTS for this patch", "one")
        end if
      end associate
    end do
  end subroutine check_parts

  !> Knot vectors of the first axes of a patch.
  subroutine read_axes(deck, parts, owner, axes, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(patch_parts_t), intent(in) :: parts
    type(record_t), intent(in) :: owner           !! *BLANK or *TOOL
    type(knot_vector_t), intent(out) :: axes(:)
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors
    logical :: has_axis(size(axes))
    integer :: i, axis

    has_axis = .false.
    is_complete = .true.
    do i = 1, size(parts%knots)
      associate (record => deck%records(parts%knots(i)))
        axis = option_integer(record, "AXIS")
        if (axis < 1 .or. axis > size(axes)) cycle
        has_axis(axis) = .true.
        if (record%is_valid) call read_knots(record, axes(axis), errors)
        is_complete = is_complete .and. axes(axis)%n_basis > 0
      end associate
    end do
    do axis = 1, size(axes)
      if (has_axis(axis)) cycle
      is_complete = .false.
      call add_error(errors, owner%origin, "no *KNOTS for axis "//to_text(axis), &
                     "*KNOTS with PATCH="//option_text(owner, "NAME")//", AXIS="//to_text(axis))
    end do
  end subroutine read_axes

  subroutine read_knots(record, axis, errors)
    type(record_t), intent(in) :: record
    type(knot_vector_t), intent(inout) :: axis   !! without basis functions if the knots are wrong
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: most_shown = 12
    type(error_t), allocatable :: error
    character(:), allocatable :: shown
    real(wp), allocatable :: knots(:)
    integer :: i, degree

    knots = all_numbers(record)
    degree = option_integer(record, "DEGREE")
    call new_knot_vector(axis, degree, knots, error)
    if (.not. allocated(error)) return
    shown = to_text(knots(1))
    do i = 2, min(size(knots), most_shown)
      shown = shown//" "//to_text(knots(i))
    end do
    if (size(knots) > most_shown) shown = shown//" ..."
    call add_error(errors, record%origin, to_text(size(knots))//" knots of degree "// &
                   to_text(degree)//": "//shown, "an open "//error%message)
  end subroutine read_knots

  !> Control points of a patch with these axes, in the order of the deck.
  subroutine read_points(deck, parts, owner, axes, points, weights, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(patch_parts_t), intent(in) :: parts
    type(record_t), intent(in) :: owner               !! *BLANK or *TOOL
    type(knot_vector_t), intent(in) :: axes(:)
    real(wp), allocatable, intent(out) :: points(:, :)   !! [length], shape (n, 3)
    real(wp), allocatable, intent(out) :: weights(:)     !! shape (n)
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: expected
    integer :: i, n

    is_complete = .false.
    if (size(parts%points) == 0) then
      call add_error(errors, owner%origin, "no control points", "*CONTROL POINTS with PATCH="// &
                     option_text(owner, "NAME"))
      return
    end if
    associate (record => deck%records(parts%points(1)))
      n = product(axes%n_basis)
      if (record%n_lines /= n) then
        expected = to_text(axes(1)%n_basis)
        do i = 2, size(axes)
          expected = expected//" x "//to_text(axes(i)%n_basis)
        end do
        if (size(axes) > 1) expected = to_text(n)//": "//expected
        call add_error(errors, record%origin, to_text(record%n_lines)//" control points", &
                       expected//" from *KNOTS")
      else if (record%is_valid) then
        points = reshape([(field_real(record, i, 1), i=1, n), (field_real(record, i, 2), i=1, n), &
                          (field_real(record, i, 3), i=1, n)], [n, 3])
        weights = [(field_real(record, i, 4), i=1, n)]
        is_complete = .true.
      end if
    end associate
  end subroutine read_points

  subroutine refine_surface(deck, parts, surface, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(patch_parts_t), intent(in) :: parts
    type(nurbs_surface_t), intent(inout) :: surface
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    real(wp), allocatable :: knots(:)
    integer :: i, axis

    do i = 1, size(parts%refinements)
      associate (record => deck%records(parts%refinements(i)))
        if (.not. record%is_valid) cycle
        axis = option_integer(record, "AXIS")
        if (axis > 2) then
          call add_error(errors, record%origin, "AXIS=3 for a surface", "AXIS=1 or 2")
          cycle
        end if
        call elevate_degree(surface, axis, option_integer(record, "ELEVATE"), error)
        if (.not. allocated(error)) then
          knots = new_knots(record, surface%axes(axis))
          if (is_too_fine(surface%axes, axis, size(knots), record, errors)) return
          call insert_knots(surface, axis, knots, error)
        end if
        if (allocated(error)) call refuse(record, error, errors)
      end associate
    end do
  end subroutine refine_surface

  subroutine refine_solid(deck, parts, solid, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(patch_parts_t), intent(in) :: parts
    type(nurbs_solid_t), intent(inout) :: solid
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    real(wp), allocatable :: knots(:)
    integer :: i, axis

    do i = 1, size(parts%refinements)
      associate (record => deck%records(parts%refinements(i)))
        if (.not. record%is_valid) cycle
        axis = option_integer(record, "AXIS")
        call elevate_degree(solid, axis, option_integer(record, "ELEVATE"), error)
        if (.not. allocated(error)) then
          knots = new_knots(record, solid%axes(axis))
          if (is_too_fine(solid%axes, axis, size(knots), record, errors)) return
          call insert_knots(solid, axis, knots, error)
        end if
        if (allocated(error)) call refuse(record, error, errors)
      end associate
    end do
  end subroutine refine_solid

  !> Refuse knots that would make more control points than anybody wants: every knot that comes in
  !! moves all of them, so that the time grows with both.
  logical function is_too_fine(axes, axis, n_new, record, errors)
    type(knot_vector_t), intent(in) :: axes(:)
    integer, intent(in) :: axis, n_new
    type(record_t), intent(in) :: record
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: most_points = 1.0e6_wp, most_moves = 2.0e9_wp   ! some seconds
    real(wp) :: n_points

    n_points = product(real(axes%n_basis, wp))*(1 + real(n_new, wp)/axes(axis)%n_basis)
    is_too_fine = n_points > most_points .or. n_points*n_new > most_moves
    if (is_too_fine) call add_error(errors, record%origin, "refined by "//to_text(n_new)// &
                                    " knots to "//to_text(n_points)//" control points", &
                                    "at most "//to_text(min(most_points, most_moves/max(n_new, 1))))
  end function is_too_fine

  !> Knots that a *REFINE inserts: those that divide the spans, then those it lists.
  function new_knots(record, axis) result(knots)
    type(record_t), intent(in) :: record
    type(knot_vector_t), intent(in) :: axis
    real(wp), allocatable :: knots(:)

    knots = [dividing_knots(axis, option_integer(record, "SUBDIVIDE")), all_numbers(record)]
  end function new_knots

  pure subroutine refuse(record, error, errors)
    type(record_t), intent(in) :: record
    type(error_t), intent(in) :: error
    type(error_list_t), intent(inout) :: errors

    call add_error(errors, record%origin, "what cannot be done ("//error%message//")", &
                   "degrees up to 5, knots inside the patch, each at most degree times")
  end subroutine refuse

end module patch_keywords
