!> *BLANK and *PATCH: the solids, the material and the quadrature of the sheet, and the seams
!! between its patches.
module blank_keywords
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, add_warning
  use text, only: upper_case, squeezed, to_text, read_integer, strings, rounded_text
  use name_table, only: place_of
  use knot_vector, only: knot_vector_t, n_spans
  use nurbs_solid, only: nurbs_solid_t, new_nurbs_solid
  use primitives, only: box_solid
  use scene, only: scene_t, blank_spec_t, patch_spec_t
  use keyword_spec, only: did_you_mean
  use lexer, only: split_fields
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, is_option_given, &
                          field_real, field_integer, field_word, deck_context_t, patch_parts_t, &
                          box_frame_t, resolve_option, option_real, field_vector
  use patch_keywords, only: check_parts, read_axes, read_points, refine, collect_parts
  use round_solids, only: round_shape_t, cylinder_solids, ring_solids, tube_solids, &
                          cup_solids
  use patch_seams, only: seams_t, find_seams, group_table
  use patch_joints, only: joints_t, find_joints, face_names, find_tee_joints
  implicit none
  private

  public :: read_blank, read_count, read_round, join_patches, set_layers

  real(wp), parameter :: most_elements = 1.0e7_wp   ! beyond the memory of one machine
  integer, parameter :: most_points = 10   ! Gauss points or parts in one direction of an element

contains

  !> Fill the blank of the scene; its solids stay empty if they cannot be made.
  subroutine read_blank(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    logical :: is_complete
    integer :: p

    call collect_parts(deck, context, errors)
    found = find_records(deck, "BLANK")
    allocate (scene%blank%patches(1))
    if (size(found) == 0) return
    associate (record => deck%records(found(1)), blank => scene%blank)
      blank%origin = record%origin
      blank%name = option_text(record, "NAME")
      blank%patches(1)%name = blank%name
      call resolve_option(record, "MATERIAL", context%names%materials, "*MATERIAL", &
                          blank%material, errors)
      blank%is_shell = option_text(record, "ELEMENT") == "SHELL"
      blank%has_hinges = option_text(record, "JOINTS") == "HINGED"
      if (blank%has_hinges .and. .not. blank%is_shell) call add_error(errors, record%origin, &
        "JOINTS=HINGED with ELEMENT=SOLID, whose faces pass moments wherever patches meet", &
        "ELEMENT=SHELL, or no JOINTS")
      context%frame%is_box = option_text(record, "TYPE") == "BOX"
      call read_shape(deck, context, record, blank, is_complete, errors)
      call refuse_stray_patches(deck, record, errors)
      if (.not. is_complete) return
      do p = 1, size(blank%patches)
        call refine(deck, context%parts(1), errors, solid=blank%patches(p)%solid)
        call read_rule(option_text(record, "QUADRATURE"), record, blank%is_shell, &
                       blank%patches(p), errors)
      end do
      if (blank%is_shell) call refuse_solid_options(record, errors)
      call read_projection(record, blank, errors)
      if (.not. context%frame%is_box) call join_patches(record, blank, errors)
    end associate
  end subroutine read_blank

  !> The solids of the blank, before any refinement that names the blank.
  subroutine read_shape(deck, context, record, blank, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(inout) :: blank
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors

    is_complete = .false.
    select case (option_text(record, "TYPE"))
    case ("NURBS")
      call check_parts(deck, context%parts(1), 3, "the blank", errors)
      call read_nurbs(deck, context%parts(1), record, blank%patches(1)%solid, is_complete, errors)
    case ("BOX")
      call check_parts(deck, context%parts(1), 0, "a blank of TYPE=BOX", errors)
      if (record%is_valid) then
        call read_box(record, option_text(record, "MESH SPACING") == "CONTROL POINTS", &
                      blank%patches(1)%solid, context%frame, is_complete, errors)
      end if
    case ("PATCHES")
      call check_parts(deck, context%parts(1), 0, "a blank of TYPE=PATCHES", errors)
      call read_patches(deck, context, blank, is_complete, errors)
    case ("DISK", "BAR", "RING", "TUBE", "CUP")
      call check_parts(deck, context%parts(1), 0, "a round blank", errors)
      call read_round(record, blank, is_complete, errors)
    end select
  end subroutine read_shape

  !> The patches that *PATCH lists.
  subroutine read_patches(deck, context, blank, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
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
        patch%name = option_text(record, "NAME")
        place = place_of(context%names%patches, squeezed(upper_case(patch%name)))
        is_made = .false.
        if (place > 0 .and. option_text(record, "TYPE") == "NURBS") then
          call check_parts(deck, context%parts(place), 3, "a patch", errors)
          call read_nurbs(deck, context%parts(place), record, patch%solid, is_made, errors)
        else if (place > 0 .and. record%is_valid) then
          call check_parts(deck, context%parts(place), 0, "a patch of TYPE=BOX", errors)
          call read_box(record, .false., patch%solid, ignored, is_made, errors)
        end if
        if (is_made) call refine(deck, context%parts(place), errors, solid=patch%solid)
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

    if (option_text(blank_record, "TYPE") == "PATCHES") return
    found = find_records(deck, "PATCH")
    if (size(found) == 0) return
    call add_error(errors, deck%records(found(1))%origin, "a *PATCH with a blank of TYPE="// &
                   option_text(blank_record, "TYPE"), "*BLANK with TYPE=PATCHES")
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

  !> Integration points of an element after all refinement.
  subroutine read_rule(rule, record, is_shell, patch, errors)
    character(*), intent(in) :: rule
    type(record_t), intent(in) :: record
    logical, intent(in) :: is_shell
    type(patch_spec_t), intent(inout) :: patch
    type(error_list_t), intent(inout) :: errors
    logical :: is_good

    is_good = .true.
    select case (squeezed(upper_case(rule)))
    case ("SHEET")
      call choose_sheet_rule(is_shell, patch)
    case ("FULL")
      patch%n_points = patch%solid%axes%degree + 1
      if (is_shell) call set_layers(patch)
    case ("REDUCED")
      patch%n_points = patch%solid%axes%degree
      if (is_shell) call set_layers(patch)
    case default
      call read_count(rule, patch%n_points, patch%n_parts, is_good)
    end select
    if (.not. is_good) call add_error(errors, record%origin, "QUADRATURE="//rule, &
                                      "SHEET, FULL, REDUCED or three counts from 1 to "// &
                                      to_text(most_points)//" such as ""2,2,2x3"""// &
                                      did_you_mean(upper_case(rule), &
                                                   strings(["SHEET  ", "FULL   ", "REDUCED"])))
  end subroutine read_rule

  !> The rule that the crossed study of the forming strip recommends: as many points as the degree
  !! along the sheet, one more than the degree in each half of the thickness, which is axis 3. Where
  !! that would leave modes without energy, in elements of degree 1 or in a patch of one element,
  !! one more along the sheet; elements that lie on each other are not split.
  pure subroutine choose_sheet_rule(is_shell, patch)
    logical, intent(in) :: is_shell
    type(patch_spec_t), intent(inout) :: patch
    integer :: a, n_elements(3)

    associate (axes => patch%solid%axes)
      n_elements = [(n_spans(axes(a)), a=1, 3)]
      patch%n_points = max(axes%degree, 2)
      if (all(n_elements(:2) == 1)) patch%n_points = axes%degree + 1
      patch%n_points(3) = axes(3)%degree + 1
      if (n_elements(3) == 1) patch%n_parts(3) = 2
      if (is_shell) call set_layers(patch)
    end associate
  end subroutine choose_sheet_rule

  !> Layers of a shell: three Gauss points in each half of the thickness, where bending stress has
  !! its kink.
  pure subroutine set_layers(patch)
    type(patch_spec_t), intent(inout) :: patch

    patch%n_points(3) = 3
    patch%n_parts(3) = 2
  end subroutine set_layers

  !> Shells have no volume strain to project.
  subroutine refuse_solid_options(record, errors)
    type(record_t), intent(in) :: record
    type(error_list_t), intent(inout) :: errors

    if (option_text(record, "PROJECTION") /= "NONE") &
      call add_error(errors, record%origin, "PROJECTION="//option_text(record, "PROJECTION")// &
                     " with ELEMENT=SHELL", "no PROJECTION, or ELEMENT=SOLID")
  end subroutine refuse_solid_options

  !> Projection of strains and its samples.
  subroutine read_projection(record, blank, errors)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(inout) :: blank
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: samples
    integer :: n_parts(3), p
    logical :: is_good

    blank%projection = option_text(record, "PROJECTION")
    blank%is_smooth = option_text(record, "PROJECTION SPACE") == "SMOOTH"
    if (blank%is_smooth .and. blank%projection /= "BBAR") &
      call add_error(errors, record%origin, "PROJECTION SPACE=SMOOTH with PROJECTION="// &
                     blank%projection, "PROJECTION=BBAR, or no PROJECTION SPACE=SMOOTH")
    if (blank%is_smooth) then
      do p = 1, size(blank%patches)
        associate (patch => blank%patches(p))
          if (all(patch%n_points*patch%n_parts >= patch%solid%axes%degree)) cycle
        end associate
        call add_error(errors, record%origin, "PROJECTION SPACE=SMOOTH with fewer "// &
                       "integration points than the degree in a direction", "at least as "// &
                       "many, such as QUADRATURE=REDUCED")
        exit
      end do
    end if
    if (.not. is_option_given(record, "PROJECTION TERMS")) return
    samples = option_text(record, "PROJECTION TERMS")
    if (blank%projection == "NONE") call add_error(errors, record%origin, &
      "PROJECTION TERMS="//samples//" without a projection", "also PROJECTION=BBAR or ANS")
    if (blank%is_smooth) call add_error(errors, record%origin, "PROJECTION TERMS="//samples// &
      " with PROJECTION SPACE=SMOOTH", "PROJECTION SPACE=ELEMENT or no PROJECTION TERMS")
    call read_count(samples, blank%n_samples, n_parts, is_good)
    if (is_good) is_good = all(n_parts == 1)
    do p = 1, size(blank%patches)
      if (is_good) is_good = all(blank%n_samples <= blank%patches(p)%n_points &
                                 *blank%patches(p)%n_parts)
    end do
    if (.not. is_good) call add_error(errors, record%origin, "PROJECTION TERMS="//samples, &
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

  !> Patches of a blank of TYPE=DISK, BAR, RING, TUBE or CUP.
  subroutine read_round(record, blank, is_complete, errors)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(inout) :: blank
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors
    type(nurbs_solid_t), allocatable :: solids(:)
    type(error_t), allocatable :: error
    integer :: p

    is_complete = .false.
    if (.not. record%is_valid) return
    select case (option_text(record, "TYPE"))
    case ("DISK"); call cylinder_solids(round_shape(record, .false.), 3, solids, error)
    case ("BAR"); call cylinder_solids(round_shape(record, .false.), 1, solids, error)
    case ("CUP"); call cup_solids(round_shape(record, .true.), solids, error)
    case ("RING"); call ring_solids(ring_shape(record), solids, error)
    case default; call tube_solids(ring_shape(record), solids, error)
    end select
    if (allocated(error)) then
      call add_error(errors, record%origin, "a round blank that cannot be made ("// &
                     error%message//")", "radii, angle and degrees that fit together")
      return
    end if
    is_complete = .true.
    deallocate (blank%patches)
    allocate (blank%patches(size(solids)))
    do p = 1, size(solids)
      blank%patches(p)%solid = solids(p)
      blank%patches(p)%name = blank%name
      if (size(solids) == 1) cycle
      blank%patches(p)%name = part_name(p, size(solids), option_text(record, "TYPE") == "CUP")
    end do
  end subroutine read_round

  !> Names of the patches of a round section, and of the rest of a cup.
  function part_name(p, n, is_cup) result(name)
    integer, intent(in) :: p, n        !! patch, and how many there are
    logical, intent(in) :: is_cup
    character(:), allocatable :: name
    character(6), parameter :: rings(3) = [character(6) :: "RIM", "CORNER", "WALL"]
    integer :: n_around

    n_around = n - 1
    if (is_cup) n_around = (n - 1)/3
    name = "CORE"
    if (p > 1) name = trim(rings((p - 2)/n_around + 1))//to_text(mod(p - 2, n_around) + 1)
  end function part_name

  !> Data lines of disks and bars, or of cups, which have two numbers more on either line.
  function round_shape(record, is_cup) result(shape)
    type(record_t), intent(in) :: record
    logical, intent(in) :: is_cup
    type(round_shape_t) :: shape
    integer :: more

    more = merge(2, 0, is_cup)
    shape%axis = index("XYZ", option_text(record, "AXIS"))
    shape%origin = field_vector(record, 1, 1)
    shape%radius = field_real(record, 1, 4)
    shape%height = field_real(record, 1, 5)
    shape%angle = field_real(record, 2, 1)
    shape%degrees = [field_integer(record, 2, 2), field_integer(record, 2, 5 + more)]
    shape%n_elements = [field_integer(record, 2, 3), field_integer(record, 2, 4), &
                        field_integer(record, 2, 6 + more)]
    shape%core = field_real(record, 2, 7 + more)
    if (.not. is_cup) return
    shape%thickness = field_real(record, 1, 6)
    shape%corner = field_real(record, 1, 7)
    shape%n_along = [field_integer(record, 2, 5), field_integer(record, 2, 6)]
  end function round_shape

  !> Data lines of rings and tubes.
  function ring_shape(record) result(shape)
    type(record_t), intent(in) :: record
    type(round_shape_t) :: shape

    shape%axis = index("XYZ", option_text(record, "AXIS"))
    shape%origin = field_vector(record, 1, 1)
    shape%inner_radius = field_real(record, 1, 4)
    shape%radius = field_real(record, 1, 5)
    shape%height = field_real(record, 1, 6)
    shape%start = field_real(record, 2, 1)
    shape%angle = field_real(record, 2, 2)
    shape%degrees = [field_integer(record, 2, 3), field_integer(record, 2, 6)]
    shape%n_elements = [field_integer(record, 2, 4), field_integer(record, 2, 5), &
                        field_integer(record, 2, 7)]
  end function ring_shape

  !> Find the seams of a blank as its MERGE option asks. Faces that meet but do not fit are errors;
  !! a blank that falls apart is one that the user should know of.
  subroutine join_patches(record, blank, errors)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(inout) :: blank
    type(error_list_t), intent(inout) :: errors
    type(nurbs_solid_t) :: solids(size(blank%patches))
    type(seams_t) :: seams
    type(joints_t) :: joints
    real(wp) :: tolerance
    logical :: is_whole
    integer :: p, i

    if (option_text(record, "MERGE") == "NO") return
    do p = 1, size(solids)
      solids(p) = blank%patches(p)%solid
    end do
    tolerance = option_real(record, "TOLERANCE")
    if (tolerance <= 0.0_wp) tolerance = default_tolerance(solids)
    blank%merge_distance = tolerance
    call find_seams(solids, tolerance, seams)
    call check_neighbours(record, blank, seams, tolerance, is_whole, errors)
    if (.not. is_whole) return
    joints = find_joints(solids, seams)
    do p = 1, size(solids)
      blank%patches(p)%solid = solids(p)
      blank%patches(p)%is_joined = joints%is_joined(:, p)
    end do
    do i = 1, size(joints%reasons)
      call add_error(errors, record%origin, "patches '"// &
                     blank%patches(joints%misfit(1, i))%name//"' and '"// &
                     blank%patches(joints%misfit(3, i))%name//"' that do not fit, "// &
                     joints%reasons(i)%value, "the same degrees, knots, weights and control "// &
                     "points on both faces, or MERGE=NO")
    end do
    if (size(joints%reasons) > 0) return
    call warn_of_tee_joints(record, blank, find_tee_joints(solids, joints%is_joined, tolerance), &
                            errors)
    call check_whole(record, blank, joints, errors)
  end subroutine join_patches

  !> Refuse a tolerance that makes neighbours in the grid of a patch one point, unless they were one
  !! before but for round-off: the blank would lose volume.
  subroutine check_neighbours(record, blank, seams, tolerance, is_whole, errors)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(in) :: blank     !! as it was before the seams were found
    type(seams_t), intent(in) :: seams
    real(wp), intent(in) :: tolerance
    logical, intent(out) :: is_whole            !! no neighbours were lost
    type(error_list_t), intent(inout) :: errors
    real(wp) :: apart
    integer :: p

    is_whole = .true.
    do p = 1, size(blank%patches)
      associate (solid => blank%patches(p)%solid)
        apart = widest_loss(solid, reshape(group_table(seams, p, size(solid%weights)), &
                                           shape(solid%weights)))
        if (apart <= default_tolerance([solid])) cycle
        is_whole = .false.
        call add_error(errors, record%origin, "TOLERANCE="//to_text(tolerance)//", which makes "// &
                       "neighbouring control points of the patch '"//blank%patches(p)%name// &
                       "' one that are "//rounded_text(apart)//" apart", "less than that")
      end associate
    end do
  end subroutine check_neighbours

  !> Largest distance of neighbours in a grid that are of one group.
  pure real(wp) function widest_loss(solid, group) result(distance)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: group(:, :, :)       !! 0: none
    integer :: i, j, k, axis, at(3)

    distance = 0.0_wp
    do axis = 1, 3
      do k = 1, size(group, 3)
        do j = 1, size(group, 2)
          do i = 1, size(group, 1)
            at = [i, j, k]
            at(axis) = at(axis) + 1
            if (at(axis) > size(group, axis) .or. group(i, j, k) == 0) cycle
            if (group(at(1), at(2), at(3)) /= group(i, j, k)) cycle
            distance = max(distance, norm2(solid%points(at(1), at(2), at(3), :) &
                                           - solid%points(i, j, k, :)))
          end do
        end do
      end do
    end do
  end function widest_loss

  !> Warn of faces that lie on each other without being joined.
  subroutine warn_of_tee_joints(record, blank, pairs, errors)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(in) :: blank
    integer, intent(in) :: pairs(:, :)        !! see `find_tee_joints`
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(pairs, 2)
      call add_warning(errors, record%origin, "the faces "//trim(face_names(pairs(2, i)))// &
                       " of '"//blank%patches(pairs(1, i))%name//"' and "// &
                       trim(face_names(pairs(4, i)))//" of '"//blank%patches(pairs(3, i))%name// &
                       "', which lie on each other in part, so that nothing joins them there", &
                       "patches cut so that whole faces meet")
    end do
  end subroutine warn_of_tee_joints

  !> Warn of patches that no common faces lead to.
  subroutine check_whole(record, blank, joints, errors)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(in) :: blank
    type(joints_t), intent(in) :: joints
    type(error_list_t), intent(inout) :: errors
    logical :: is_reached(size(blank%patches))
    integer :: i, p

    is_reached = .false.
    is_reached(1) = .true.
    do i = 1, size(is_reached)
      do p = 1, size(is_reached)
        is_reached(p) = is_reached(p) .or. any(is_reached .and. joints%is_tied(:, p))
      end do
    end do
    do p = 1, size(is_reached)
      if (is_reached(p)) cycle
      call add_warning(errors, record%origin, "the patch '"//blank%patches(p)%name// &
                       "', which has no face in common with the others", &
                       "control points of its face on those of another patch")
    end do
  end subroutine check_whole

  !> A millionth of the blank's size: below any element, above the round-off of listed points.
  pure real(wp) function default_tolerance(solids) result(tolerance)
    type(nurbs_solid_t), intent(in) :: solids(:)
    real(wp), parameter :: share = 1.0e-6_wp
    real(wp) :: low(3), high(3)
    integer :: p, c

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do p = 1, size(solids)
      do c = 1, 3
        low(c) = min(low(c), minval(solids(p)%points(:, :, :, c)))
        high(c) = max(high(c), maxval(solids(p)%points(:, :, :, c)))
      end do
    end do
    tolerance = share*norm2(high - low)
  end function default_tolerance

end module blank_keywords
