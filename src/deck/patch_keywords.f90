!> *KNOTS, *CONTROL POINTS and *REFINE: the parts of patches that are listed in the deck.
module patch_keywords
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error
  use text, only: to_text, counted
  use knot_vector, only: knot_vector_t, new_knot_vector
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: nurbs_solid_t
  use refinement, only: insert_knots, elevate_degree, dividing_knots
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_integer, &
                          is_option_given, &
                          field_real, all_numbers, deck_context_t, patch_parts_t, resolve_option
  implicit none
  private

  public :: collect_parts, check_parts, read_axes, read_points, refine, is_too_fine

contains

  !> Records that name each patch; a name that is no patch is an error.
  subroutine collect_parts(deck, context, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context   !! gets `parts`
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: keywords(3) = [character(14) :: "KNOTS", "CONTROL POINTS", "REFINE"]
    integer, allocatable :: found(:)
    integer :: owner(size(deck%records), size(keywords))   ! place of the patch, by record
    integer :: records(size(deck%records)), i, k

    owner = 0
    do k = 1, size(keywords)
      found = find_records(deck, trim(keywords(k)))
      do i = 1, size(found)
        call resolve_option(deck%records(found(i)), "PATCH", context%names%patches, &
                            "*BLANK, *PATCH or *TOOL", owner(found(i), k), errors)
      end do
    end do
    allocate (context%parts(context%names%patches%n_names))
    records = [(i, i=1, size(records))]
    do i = 1, size(context%parts)
      context%parts(i)%knots = pack(records, owner(:, 1) == i)
      context%parts(i)%points = pack(records, owner(:, 2) == i)
      context%parts(i)%refinements = pack(records, owner(:, 3) == i)
    end do
  end subroutine collect_parts

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
    call add_error(errors, record%origin, counted(size(knots), "knot")//" of degree "// &
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
        call add_error(errors, record%origin, counted(record%n_lines, "control point"), &
                       expected//" from *KNOTS")
      else if (record%is_valid) then
        points = reshape([(field_real(record, i, 1), i=1, n), (field_real(record, i, 2), i=1, n), &
                          (field_real(record, i, 3), i=1, n)], [n, 3])
        weights = [(field_real(record, i, 4), i=1, n)]
        is_complete = .true.
      end if
    end associate
  end subroutine read_points

  !> Refine a surface or a solid by all its *REFINE, in the order of the deck.
  subroutine refine(deck, parts, errors, surface, solid)
    type(parsed_deck_t), intent(in) :: deck
    type(patch_parts_t), intent(in) :: parts
    type(error_list_t), intent(inout) :: errors
    type(nurbs_surface_t), intent(inout), optional :: surface
    type(nurbs_solid_t), intent(inout), optional :: solid      !! one of both
    type(error_t), allocatable :: error
    type(knot_vector_t), allocatable :: axes(:)
    real(wp), allocatable :: knots(:)
    integer :: i, axis, rise

    do i = 1, size(parts%refinements)
      associate (record => deck%records(parts%refinements(i)))
        if (.not. record%is_valid .or. .not. is_option_given(record, "AXIS")) cycle
        axis = option_integer(record, "AXIS")
        rise = option_integer(record, "ELEVATE")
        if (present(solid)) then
          call elevate_degree(solid, axis, rise, error)
          axes = solid%axes
        else if (axis > 2) then
          call add_error(errors, record%origin, "AXIS=3 for a surface", "AXIS=1 or 2")
          cycle
        else
          call elevate_degree(surface, axis, rise, error)
          axes = surface%axes
        end if
        if (.not. allocated(error)) then
          knots = [dividing_knots(axes(axis), option_integer(record, "SUBDIVIDE")), &
                   all_numbers(record)]
          if (is_too_fine(axes, axis, size(knots), record, errors)) return
          if (present(solid)) call insert_knots(solid, axis, knots, error)
          if (present(surface)) call insert_knots(surface, axis, knots, error)
        end if
        if (allocated(error)) call add_error(errors, record%origin, "what cannot be done ("// &
          error%message//")", "degrees up to 5, knots inside the patch, each at most degree times")
      end associate
    end do
  end subroutine refine

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
    if (is_too_fine) call add_error(errors, record%origin, "refined by "//counted(n_new, &
                                    "knot")//" to "//to_text(n_points)//" control points", &
                                    "at most "//to_text(min(most_points, most_moves/max(n_new, 1))))
  end function is_too_fine

end module patch_keywords
