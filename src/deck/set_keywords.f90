!> *SET: parts of the blank in parameter space, and the names of its faces.
module set_keywords
  use kinds, only: wp
  use input_errors, only: origin_t, error_list_t, add_error
  use text, only: string_t, upper_case, squeezed, to_text, read_real, strings, counted
  use name_table, only: insert, place_of, note_use
  use knot_vector, only: basis_derivatives, find_span
  use scene, only: scene_t, box_spec_t, set_spec_t
  use keyword_spec, only: did_you_mean
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, is_option_given, &
                          line_origin, n_fields, field_word, deck_names_t, deck_context_t, &
                          box_frame_t
  implicit none
  private

  public :: read_sets, find_set, face_of, face_names

  character(8), parameter :: faces(6) = [character(8) :: "XI_MIN", "XI_MAX", "ETA_MIN", &
                                         "ETA_MAX", "ZETA_MIN", "ZETA_MAX"]
  character(8), parameter :: sides(6) = [character(8) :: "X_MIN", "X_MAX", "Y_MIN", "Y_MAX", &
                                         "Z_MIN", "Z_MAX"]

contains

  !> Fill the list of sets, one for each *SET in the order of the deck.
  subroutine read_sets(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(set_spec_t) :: set
    type(box_spec_t), allocatable :: boxes(:)
    integer, allocatable :: found(:)
    integer :: i, line

    found = find_records(deck, "SET")
    allocate (scene%sets(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        set%origin = record%origin
        set%name = option_text(record, "NAME")
        call take_whole(scene, set)
        if (is_option_given(record, "PATCH")) then
          call keep_patch(scene, option_text(record, "PATCH"), set, errors)
        end if
        if (face_of(set%name, context%frame) > 0 .or. side_of(set%name) > 0 .or. &
            upper_case(set%name) == "ALL") then
          call add_error(errors, record%origin, "the name "//set%name, &
                         "a name that is not ALL or that of a face")
        end if
        if (record%n_lines > 1 .and. .not. is_option_given(record, "OPERATION")) &
          call add_error(errors, record%origin, counted(record%n_lines, "data line")// &
                         " without the option OPERATION", "OPERATION=UNION, for the parts "// &
                         "of all lines, or INTERSECTION, for what they have in common")
        if (record%is_valid) then
          if (allocated(boxes)) deallocate (boxes)
          allocate (boxes(record%n_lines))
          do line = 1, record%n_lines
            boxes(line) = set%box_spec_t
            call read_line(deck, record, line, context%frame, scene, boxes(line), errors)
          end do
          call combine(boxes, option_text(record, "OPERATION") == "UNION", set)
        end if
        scene%sets(i) = set
      end associate
    end do
  end subroutine read_sets

  !> Make a set of the boxes of its lines: their union or what they have in common.
  pure subroutine combine(boxes, is_union, set)
    type(box_spec_t), intent(in) :: boxes(:)
    logical, intent(in) :: is_union
    type(set_spec_t), intent(inout) :: set
    integer :: i

    if (allocated(set%others)) deallocate (set%others)
    set%box_spec_t = boxes(1)
    if (is_union .and. size(boxes) > 1) set%others = boxes(2:)
    if (is_union) return
    do i = 2, size(boxes)
      set%lower = max(set%lower, boxes(i)%lower)
      set%upper = min(set%upper, boxes(i)%upper)
      set%from = max(set%from, boxes(i)%from)
      set%to = min(set%to, boxes(i)%to)
    end do
  end subroutine combine

  !> Number of the face that goes by this name (1 xi_min to 6 zeta_max), 0 if none does.
  pure integer function face_of(name, frame)
    character(*), intent(in) :: name
    type(box_frame_t), intent(in) :: frame
    integer :: i, axis
    logical :: is_lower

    face_of = 0
    do i = 1, 6
      if (upper_case(name) == faces(i)) face_of = i
      if (upper_case(name) /= sides(i) .or. .not. frame%is_box) cycle
      axis = findloc(frame%axis_of, (i + 1)/2, 1)
      is_lower = mod(i, 2) == 1 .eqv. frame%from(axis) < frame%to(axis)
      face_of = 2*axis - merge(1, 0, is_lower)
    end do
  end function face_of

  !> Side of a blank that is no box by this name: the control points that lie farthest that way.
  pure integer function side_of(name)
    character(*), intent(in) :: name

    side_of = findloc(sides, upper_case(name), 1)
  end function side_of

  !> Place of a set; names of faces and ALL become sets when first asked for.
  subroutine find_set(context, name, origin, scene, place, errors)
    type(deck_context_t), intent(inout) :: context
    character(*), intent(in) :: name
    type(origin_t), intent(in) :: origin
    type(scene_t), intent(inout) :: scene
    integer, intent(out) :: place
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: key
    type(set_spec_t) :: set
    logical :: is_new

    key = squeezed(upper_case(name))
    place = place_of(context%names%sets, key)
    call note_use(context%names%sets, place)
    if (place > 0) return
    if (key /= "ALL" .and. face_of(key, context%frame) == 0 .and. side_of(key) == 0) then
      call add_error(errors, origin, "the unknown set "//name, "the name of a *SET or of a "// &
                     "face, or ALL"//did_you_mean(key, known_sets(context%names)))
      return
    end if
    set%origin = origin
    set%name = key
    call take_whole(scene, set)
    call narrow(scene, key, context%frame, set)
    scene%sets = [scene%sets, set]
    call insert(context%names%sets, key, is_new)
    place = context%names%sets%n_names
  end subroutine find_set

  pure function known_sets(names) result(known)
    type(deck_names_t), intent(in) :: names
    type(string_t), allocatable :: known(:)

    known = [face_names(), strings(["ALL"])]
    if (names%sets%n_names > 0) known = [known, names%sets%names(:names%sets%n_names)]
  end function known_sets

  !> Names that the faces of the blank go by.
  pure function face_names() result(known)
    type(string_t), allocatable :: known(:)

    known = [strings(faces), strings(sides)]
  end function face_names

  !> Bounds of the whole blank; 0 and 1 where its solid could not be made.
  pure subroutine take_whole(scene, set)
    type(scene_t), intent(in) :: scene
    class(box_spec_t), intent(inout) :: set
    integer :: a, p

    associate (n => size(scene%blank%patches))
      if (allocated(set%lower)) deallocate (set%lower, set%upper)
      allocate (set%lower(3, n), set%upper(3, n))
    end associate
    set%lower = 0.0_wp
    set%upper = 1.0_wp
    set%from = -huge(1.0_wp)
    set%to = huge(1.0_wp)
    do p = 1, size(scene%blank%patches)
      do a = 1, 3
        if (.not. allocated(scene%blank%patches(p)%solid%axes(a)%knots)) cycle
        associate (knots => scene%blank%patches(p)%solid%axes(a)%knots)
          set%lower(a, p) = knots(1)
          set%upper(a, p) = knots(size(knots))
        end associate
      end do
    end do
  end subroutine take_whole

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

  !> Narrow a set by a line of face names or by an axis with its bounds.
  subroutine read_line(deck, record, line, frame, scene, set, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    type(box_frame_t), intent(in) :: frame
    type(scene_t), intent(in) :: scene
    class(box_spec_t), intent(inout) :: set
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: word
    integer :: i, axis

    word = upper_case(field_word(record, line, 1))
    axis = axis_of(word, frame)
    if (axis > 0) then
      call read_range(deck, record, line, axis, word, frame, set, errors)
      return
    end if
    do i = 1, n_fields(record, line)
      word = field_word(record, line, i)
      if (face_of(word, frame) > 0 .or. side_of(word) > 0) then
        call narrow(scene, word, frame, set)
      else if (upper_case(word) /= "ALL") then
        call add_error(errors, line_origin(deck, record, line), "`"//word//"`", "a face such "// &
                       "as XI_MIN, or an axis such as xi and two bounds"// &
                       did_you_mean(word, face_names()))
      end if
    end do
  end subroutine read_line

  !> Keep the patches of this name in a set, with or without a number behind it.
  subroutine keep_patch(scene, name, set, errors)
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: name
    type(set_spec_t), intent(inout) :: set
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: digits = "0123456789"
    character(:), allocatable :: given, own
    type(string_t) :: known(size(scene%blank%patches))
    logical :: is_known
    integer :: p

    given = squeezed(upper_case(name))
    is_known = .false.
    do p = 1, size(scene%blank%patches)
      if (.not. allocated(scene%blank%patches(p)%name)) return
      known(p)%value = scene%blank%patches(p)%name
      own = squeezed(upper_case(known(p)%value))
      if (own == given .or. own(:verify(own, digits, back=.true.)) == given) then
        is_known = .true.
      else
        set%lower(:, p) = huge(1.0_wp)
        set%upper(:, p) = -huge(1.0_wp)
      end if
    end do
    if (.not. is_known) call add_error(errors, set%origin, "PATCH="//name, &
                                       "a patch of the blank"//did_you_mean(name, known))
  end subroutine keep_patch

  !> Keep what a set has in common with a face or side by its name; any other name is the whole.
  subroutine narrow(scene, name, frame, set)
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: name
    type(box_frame_t), intent(in) :: frame
    class(box_spec_t), intent(inout) :: set
    integer :: p, axis
    real(wp) :: place

    if (face_of(name, frame) > 0) then
      call narrow_to_face(scene, face_of(name, frame), set)
    else if (side_of(name) > 0) then
      axis = (side_of(name) + 1)/2
      place = merge(huge(1.0_wp), -huge(1.0_wp), mod(side_of(name), 2) == 1)
      do p = 1, size(scene%blank%patches)
        if (.not. allocated(scene%blank%patches(p)%solid%points)) cycle
        associate (x => scene%blank%patches(p)%solid%points(:, :, :, axis))
          if (mod(side_of(name), 2) == 1) place = min(place, minval(x))
          if (mod(side_of(name), 2) == 0) place = max(place, maxval(x))
        end associate
      end do
      if (mod(side_of(name), 2) == 1) set%to(axis) = min(set%to(axis), place)
      if (mod(side_of(name), 2) == 0) set%from(axis) = max(set%from(axis), place)
    end if
  end subroutine narrow

  !> Keep what a set has in common with a face; that may be nothing, `lower` above `upper`.
  pure subroutine narrow_to_face(scene, face, set)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: face
    class(box_spec_t), intent(inout) :: set
    type(box_spec_t) :: whole

    call take_whole(scene, whole)
    associate (axis => (face + 1)/2)
      if (mod(face, 2) == 1) set%upper(axis, :) = min(set%upper(axis, :), whole%lower(axis, :))
      if (mod(face, 2) == 0) set%lower(axis, :) = max(set%lower(axis, :), whole%upper(axis, :))
    end associate
  end subroutine narrow_to_face

  !> Axis of this name, parametric or, where the blank is no box, in space; 0 if none has it.
  pure integer function axis_of(name, frame)
    character(*), intent(in) :: name   !! upper case
    type(box_frame_t), intent(in) :: frame

    select case (name)
    case ("XI"); axis_of = 1
    case ("ETA"); axis_of = 2
    case ("ZETA"); axis_of = 3
    case ("X", "Y", "Z")
      axis_of = index("XYZ", name)
      if (frame%is_box) axis_of = findloc(frame%axis_of, axis_of, 1)
    case default
      axis_of = 0
    end select
  end function axis_of

  subroutine read_range(deck, record, line, axis, word, frame, set, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, axis
    character(*), intent(in) :: word   !! name of the axis
    type(box_frame_t), intent(in) :: frame
    class(box_spec_t), intent(inout) :: set
    type(error_list_t), intent(inout) :: errors
    real(wp) :: bounds(2)
    logical :: is_number(2)
    integer :: i

    is_number = .false.
    if (n_fields(record, line) == 3) then
      do i = 1, 2
        call read_real(field_word(record, line, i + 1), bounds(i), is_number(i))
      end do
    end if
    if (.not. all(is_number)) then
      call add_error(errors, line_origin(deck, record, line), "no two numbers after "//word, &
                     "the lower and the upper bound")
    else if (bounds(1) > bounds(2)) then
      call add_error(errors, line_origin(deck, record, line), "the bounds "// &
                     to_text(bounds(1))//", "//to_text(bounds(2)), "the lower bound first")
    else
      if (verify(word, "XYZ") == 0 .and. .not. frame%is_box) then
        set%from(axis) = max(set%from(axis), bounds(1))
        set%to(axis) = min(set%to(axis), bounds(2))
        return
      end if
      if (verify(word, "XYZ") == 0) then
        bounds = [(parametric_of(frame, axis, bounds(i)), i=1, 2)]
      end if
      set%lower(axis, :) = max(set%lower(axis, :), minval(bounds))
      set%upper(axis, :) = min(set%upper(axis, :), maxval(bounds))
    end if
  end subroutine read_range

end module set_keywords
