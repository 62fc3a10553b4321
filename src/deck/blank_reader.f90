!> *BLANK: the solid, its material and its quadrature.
module blank_reader
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error
  use text, only: upper_case, squeezed, to_text, read_integer, strings
  use nurbs_solid, only: nurbs_solid_t, new_nurbs_solid
  use knot_vector, only: knot_vector_t, find_span, basis_derivatives, n_spans
  use primitives, only: box_solid
  use scene, only: scene_t, blank_spec_t, patch_spec_t
  use shape_reader, only: read_round, join_patches
  use name_table, only: place_of
  use field_split, only: split_fields
  use field_check, only: did_you_mean
  use deck_names, only: deck_names_t, resolve
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, is_option_given, &
                          field_real, field_integer, field_word
  use patch_reader, only: patch_parts_t, check_parts, read_axes, read_points, refine
  implicit none
  private

  public :: box_frame_t, read_blank, read_count, parametric_of

  real(wp), parameter :: most_elements = 1.0e7_wp   ! beyond the memory of one machine
  integer, parameter :: most_points = 10   ! Gauss points or parts in one direction of an element

  !> Share of the way along one axis as a spline of its parametric coordinate.
  type :: box_line_t
    type(knot_vector_t) :: knots
    real(wp), allocatable :: shares(:)    !! at the control points, 0 to 1
  end type box_line_t

  !> How a box blank lies in space: what turns coordinates into parametric coordinates. A blank
  !! that is missing or faulty counts as a box, so that it makes no further errors.
  type :: box_frame_t
    logical :: is_box = .true.
    integer :: axis_of(3) = [1, 2, 3]     !! coordinate along which each parametric axis runs
    real(wp) :: from(3) = 0.0_wp          !! that coordinate where the parametric one is 0
    real(wp) :: to(3) = 1.0_wp            !! and where it is 1
    type(box_line_t) :: lines(3)          !! of a box with evenly spaced control points
  end type box_frame_t

contains

  !> Fill the blank of the scene; its solids stay empty if they cannot be made.
  subroutine read_blank(deck, names, parts, scene, frame, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_names_t), intent(in) :: names
    type(patch_parts_t), intent(in) :: parts(:)   !! by place in `names%patches`, blank first
    type(scene_t), intent(inout) :: scene
    type(box_frame_t), intent(out) :: frame
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    logical :: is_complete
    integer :: p

    found = find_records(deck, "BLANK")
    allocate (scene%blank%patches(1))
    if (size(found) == 0) return
    associate (record => deck%records(found(1)), blank => scene%blank)
      blank%origin = record%origin
      blank%name = option_text(deck, record, "NAME")
      blank%patches(1)%name = blank%name
      if (is_option_given(deck, record, "MATERIAL")) then
        call resolve(names%materials, option_text(deck, record, "MATERIAL"), "*MATERIAL", &
                     record%origin, blank%material, errors)
      end if
      frame%is_box = option_text(deck, record, "TYPE") == "BOX"
      call read_shape(deck, names, parts, record, blank, frame, is_complete, errors)
      call refuse_stray_patches(deck, record, errors)
      if (.not. is_complete) return
      do p = 1, size(blank%patches)
        call refine(deck, parts(1), blank%patches(p)%solid, errors)
        call read_rule(option_text(deck, record, "RULE"), record, blank%patches(p), errors)
      end do
      call read_projection(deck, record, blank, errors)
      if (.not. frame%is_box) call join_patches(deck, record, blank, errors)
    end associate
  end subroutine read_blank

  !> The solids of the blank, before any refinement that names the blank.
  subroutine read_shape(deck, names, parts, record, blank, frame, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_names_t), intent(in) :: names
    type(patch_parts_t), intent(in) :: parts(:)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(inout) :: blank
    type(box_frame_t), intent(inout) :: frame
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors

    is_complete = .false.
    select case (option_text(deck, record, "TYPE"))
    case ("NURBS")
      call check_parts(deck, parts(1), 3, "the blank", errors)
      call read_nurbs(deck, parts(1), record, blank%patches(1)%solid, is_complete, errors)
    case ("BOX")
      call check_parts(deck, parts(1), 0, "a blank of TYPE=BOX", errors)
      if (record%is_valid) then
        call read_box(record, option_text(deck, record, "SPACING") == "CONTROL POINTS", &
                      blank%patches(1)%solid, frame, is_complete, errors)
      end if
    case ("PATCHES")
      call check_parts(deck, parts(1), 0, "a blank of TYPE=PATCHES", errors)
      call read_patches(deck, names, parts, blank, is_complete, errors)
    case ("DISK", "BAR", "RING", "TUBE", "CUP")
      call check_parts(deck, parts(1), 0, "a round blank", errors)
      call read_round(deck, record, blank, is_complete, errors)
    end select
  end subroutine read_shape

  !> The patches that *PATCH lists.
  subroutine read_patches(deck, names, parts, blank, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_names_t), intent(in) :: names
    type(patch_parts_t), intent(in) :: parts(:)   !! by place in `names%patches`
    type(blank_spec_t), intent(inout) :: blank
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors
    type(box_frame_t) :: ignored
    integer, allocatable :: found(:)
    logical :: is_made
    integer :: i, place

    found = find_records(deck, "PATCH")
    is_complete = size(found) > 0
    if (.not. is_complete) then
      call add_error(errors, blank%origin, "TYPE=PATCHES without a *PATCH", "at least one *PATCH")
      return
    end if
    deallocate (blank%patches)
    allocate (blank%patches(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), patch => blank%patches(i))
        patch%name = option_text(deck, record, "NAME")
        place = place_of(names%patches, squeezed(upper_case(patch%name)))
        is_made = .false.
        if (place > 0 .and. option_text(deck, record, "TYPE") == "NURBS") then
          call check_parts(deck, parts(place), 3, "a patch", errors)
          call read_nurbs(deck, parts(place), record, patch%solid, is_made, errors)
        else if (place > 0 .and. record%is_valid) then
          call check_parts(deck, parts(place), 0, "a patch of TYPE=BOX", errors)
          call read_box(record, .false., patch%solid, ignored, is_made, errors)
        end if
        if (is_made) call refine(deck, parts(place), patch%solid, errors)
        is_complete = is_complete .and. is_made
      end associate
    end do
  end subroutine read_patches

  !> *PATCH is for blanks of TYPE=PATCHES alone.
  subroutine refuse_stray_patches(deck, blank_record, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: blank_record
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)

    if (option_text(deck, blank_record, "TYPE") == "PATCHES") return
    found = find_records(deck, "PATCH")
    if (size(found) == 0) return
    call add_error(errors, deck%records(found(1))%origin, "a *PATCH beside a blank of TYPE="// &
                   option_text(deck, blank_record, "TYPE"), "*BLANK with TYPE=PATCHES")
  end subroutine refuse_stray_patches

  subroutine read_nurbs(deck, parts, record, solid, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(patch_parts_t), intent(in) :: parts
    type(record_t), intent(in) :: record
    type(nurbs_solid_t), intent(out) :: solid
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    type(knot_vector_t) :: axes(3)
    real(wp), allocatable :: points(:, :), weights(:)
    integer :: n(3)

    call read_axes(deck, parts, record, axes, is_complete, errors)
    if (.not. is_complete) return
    call read_points(deck, parts, record, axes, points, weights, is_complete, errors)
    if (.not. is_complete) return
    n = axes%n_basis
    call new_nurbs_solid(solid, axes, reshape(points, [n(1), n(2), n(3), 3]), &
                         reshape(weights, n), error)
    is_complete = .not. allocated(error)
    if (allocated(error)) call add_error(errors, record%origin, error%message, "a proper solid")
  end subroutine read_nurbs

  subroutine read_box(record, is_even, solid, frame, is_complete, errors)
    type(record_t), intent(in) :: record
    logical, intent(in) :: is_even         !! equal distances of control points
    type(nurbs_solid_t), intent(out) :: solid
    type(box_frame_t), intent(inout) :: frame
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    real(wp) :: lower(3), upper(3), n_elements
    integer :: a, axis_of(3), far_end(3)

    n_elements = product([(field_real(record, a, 5), a=1, 3)])
    is_complete = n_elements <= most_elements
    if (.not. is_complete) then
      call add_error(errors, record%origin, to_text(n_elements)//" elements", "at most "// &
                     to_text(most_elements))
      return
    end if
    lower = 0.0_wp
    upper = 1.0_wp
    do a = 1, 3
      axis_of(a) = index("XYZ", field_word(record, a, 1))
      lower(axis_of(a)) = field_real(record, a, 2)
      upper(axis_of(a)) = field_real(record, a, 3)
    end do
    call box_solid(solid, lower, upper, [(field_integer(record, a, 4), a=1, 3)], &
                   [(field_integer(record, a, 5), a=1, 3)], &
                   [(field_real(record, a, 6), a=1, 3)], axis_of, error, is_even)
    is_complete = .not. allocated(error)
    if (allocated(error)) then
      call add_error(errors, record%origin, "a box that cannot be made ("//error%message//")", &
                     "x, y and z in any order, each with `to` above `from`")
      return
    end if
    frame%axis_of = axis_of
    do a = 1, 3
      far_end = 1
      frame%from(a) = solid%points(1, 1, 1, frame%axis_of(a))
      far_end(a) = solid%axes(a)%n_basis
      frame%to(a) = solid%points(far_end(1), far_end(2), far_end(3), frame%axis_of(a))
      if (.not. is_even) cycle
      frame%lines(a)%knots = solid%axes(a)
      associate (along => solid%points(:far_end(1), :far_end(2), :far_end(3), frame%axis_of(a)))
        frame%lines(a)%shares = (reshape(along, [size(along)]) - frame%from(a)) &
                                /(frame%to(a) - frame%from(a))
      end associate
    end do
  end subroutine read_box

  !> Parametric coordinate of a coordinate of the box; beyond its ends as if they went on straight.
  pure real(wp) function parametric_of(frame, axis, coordinate) result(xi)
    type(box_frame_t), intent(in) :: frame
    integer, intent(in) :: axis            !! parametric
    real(wp), intent(in) :: coordinate
    integer, parameter :: n_halvings = 52
    real(wp) :: share, low, high, basis(6)
    integer :: i, span

    share = (coordinate - frame%from(axis))/(frame%to(axis) - frame%from(axis))
    xi = share
    if (.not. allocated(frame%lines(axis)%shares)) return
    if (share <= 0.0_wp .or. share >= 1.0_wp) return
    low = 0.0_wp
    high = 1.0_wp
    associate (kv => frame%lines(axis)%knots)
      do i = 1, n_halvings
        xi = 0.5_wp*(low + high)
        span = find_span(kv, xi)
        call basis_derivatives(kv, span, xi, 0, basis(:kv%degree + 1))
        if (sum(basis(:kv%degree + 1)*frame%lines(axis)%shares(span - kv%degree:span)) < share) then
          low = xi
        else
          high = xi
        end if
      end do
    end associate
  end function parametric_of

  !> Integration points of an element after all refinement.
  subroutine read_rule(rule, record, patch, errors)
    character(*), intent(in) :: rule
    type(record_t), intent(in) :: record
    type(patch_spec_t), intent(inout) :: patch
    type(error_list_t), intent(inout) :: errors
    logical :: is_good

    is_good = .true.
    select case (squeezed(upper_case(rule)))
    case ("SHEET")
      call choose_sheet_rule(patch)
    case ("FULL")
      patch%n_points = patch%solid%axes%degree + 1
    case ("REDUCED")
      patch%n_points = patch%solid%axes%degree
    case default
      call read_count(rule, patch%n_points, patch%n_parts, is_good)
    end select
    if (.not. is_good) call add_error(errors, record%origin, "RULE="//rule, &
                                      "SHEET, FULL, REDUCED or three counts from 1 to "// &
                                      to_text(most_points)//" such as ""2,2,2x3"""// &
                                      did_you_mean(upper_case(rule), &
                                                   strings(["SHEET  ", "FULL   ", "REDUCED"])))
  end subroutine read_rule

  !> The rule that the crossed study of the forming strip recommends: as many points as the degree
  !! along the sheet, one more than the degree in each half of the thickness, which is axis 3. Where
  !! that would leave modes without energy, in elements of degree 1 or in a patch of one element,
  !! one more along the sheet; elements that lie on each other are not split.
  pure subroutine choose_sheet_rule(patch)
    type(patch_spec_t), intent(inout) :: patch
    integer :: a, n_elements(3)

    associate (axes => patch%solid%axes)
      n_elements = [(n_spans(axes(a)), a=1, 3)]
      patch%n_points = max(axes%degree, 2)
      if (all(n_elements(:2) == 1)) patch%n_points = axes%degree + 1
      patch%n_points(3) = axes(3)%degree + 1
      if (n_elements(3) == 1) patch%n_parts(3) = 2
    end associate
  end subroutine choose_sheet_rule

  !> Projection of strains and its samples.
  subroutine read_projection(deck, record, blank, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(inout) :: blank
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: samples
    integer :: n_parts(3), p
    logical :: is_good

    blank%projection = option_text(deck, record, "PROJECTION")
    blank%is_smooth = option_text(deck, record, "SPACE") == "SMOOTH"
    if (blank%is_smooth .and. blank%projection /= "BBAR") &
      call add_error(errors, record%origin, "SPACE=SMOOTH with PROJECTION="//blank%projection, &
                     "PROJECTION=BBAR, or no SPACE=SMOOTH")
    if (blank%is_smooth) then
      do p = 1, size(blank%patches)
        associate (patch => blank%patches(p))
          if (all(patch%n_points*patch%n_parts >= patch%solid%axes%degree)) cycle
        end associate
        call add_error(errors, record%origin, "SPACE=SMOOTH with fewer integration points than "// &
                       "the degree in a direction", "at least as many, such as RULE=REDUCED")
        exit
      end do
    end if
    if (.not. is_option_given(deck, record, "SAMPLES")) return
    samples = option_text(deck, record, "SAMPLES")
    if (blank%projection == "NONE") call add_error(errors, record%origin, "SAMPLES="//samples// &
                                                   " without a projection", &
                                                   "PROJECTION=BBAR or ANS beside it")
    if (blank%is_smooth) call add_error(errors, record%origin, "SAMPLES="//samples// &
                                        " beside SPACE=SMOOTH", "SPACE=ELEMENT or no SAMPLES")
    call read_count(samples, blank%n_samples, n_parts, is_good)
    if (is_good) is_good = all(n_parts == 1)
    do p = 1, size(blank%patches)
      if (is_good) is_good = all(blank%n_samples <= blank%patches(p)%n_points &
                                 *blank%patches(p)%n_parts)
    end do
    if (.not. is_good) call add_error(errors, record%origin, "SAMPLES="//samples, &
                                      "three counts from 1 to the integration points of the "// &
                                      'direction, such as "2,2,1"')
  end subroutine read_projection

  !> Read counts such as `2,2,2x3`: one for each direction, perhaps with a number of equal parts.
  pure subroutine read_count(given, n_points, n_parts, is_good)
    character(*), intent(in) :: given
    integer, intent(out) :: n_points(:), n_parts(:)
    logical, intent(out) :: is_good
    integer, allocatable :: first(:), last(:)
    integer :: i, cross
    logical :: has_parts, has_points

    n_points = 1
    n_parts = 1
    call split_fields(given, first, last)
    is_good = size(first) == size(n_points)
    if (.not. is_good) return
    do i = 1, size(first)
      associate (field => given(first(i):last(i)))
        cross = scan(field, "xX")
        has_parts = .true.
        if (cross > 0) call read_integer(field(:cross - 1), n_parts(i), has_parts)
        call read_integer(field(cross + 1:), n_points(i), has_points)
      end associate
      is_good = is_good .and. has_parts .and. has_points
    end do
    is_good = is_good .and. all(n_points >= 1 .and. n_points <= most_points) &
              .and. all(n_parts >= 1 .and. n_parts <= most_points)
  end subroutine read_count

end module blank_reader
