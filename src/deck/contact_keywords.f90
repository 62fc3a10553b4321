!> *CONTACT PAIR and *DRAW BEAD.
module contact_keywords
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: upper_case, squeezed, strings, string_t
  use name_table, only: place_of
  use scene, only: scene_t, contact_spec_t
  use keyword_spec, only: did_you_mean
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_real, &
                          is_option_given, field_real, deck_context_t, box_frame_t, &
                          resolve_option, step_of, field_vector
  use blank_keywords, only: read_count
  use motion_keywords, only: find_amplitude
  use set_keywords, only: face_of, face_names
  implicit none
  private

  public :: read_contacts, read_beads

  integer, parameter :: first_large = 5   !! faces from here on are the large ones

contains

  !> Fill the list of contact pairs in the order of the deck.
  subroutine read_contacts(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, "CONTACT PAIR")
    allocate (scene%contacts(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), contact => scene%contacts(i))
        contact%origin = record%origin
        contact%first_step = step_of(record%step)
        call resolve_option(record, "TOOL", context%names%tools, "*TOOL", contact%tool, errors)
        contact%points = option_text(record, "POINTS")
        contact%is_corner_start = option_text(record, "START") == "CORNER"
        contact%penalty_scale = option_real(record, "PENALTY SCALE")
        contact%stiffness = option_real(record, "STIFFNESS")
        contact%friction = option_real(record, "FRICTION")
        contact%damping = option_real(record, "DAMPING")
        contact%overhang = option_real(record, "EXTENSION ZONE")
        call read_face(record, context%frame, contact, errors)
      end associate
    end do
  end subroutine read_contacts

  !> Face and the number of Gauss points on it.
  subroutine read_face(record, frame, contact, errors)
    type(record_t), intent(in) :: record
    type(box_frame_t), intent(in) :: frame
    type(contact_spec_t), intent(inout) :: contact
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: face
    integer :: n_parts(2)
    logical :: is_good

    face = squeezed(upper_case(option_text(record, "FACE")))
    contact%face = face_of(face, frame)
    if (contact%face == 0 .and. face /= "AUTO") then
      call add_error(errors, record%origin, "FACE="//face, "the name of a face, or AUTO"// &
                     did_you_mean(face, [face_names(), strings(["AUTO"])]))
    end if
    if (.not. is_option_given(record, "COUNT")) return
    call read_count(option_text(record, "COUNT"), contact%n_points, n_parts, is_good)
    if (.not. is_good .or. any(n_parts > 1)) then
      call add_error(errors, record%origin, "COUNT="//option_text(record, "COUNT"), &
                     "two whole numbers in quotes such as ""3,3""")
    else if (contact%points /= "GAUSS") then
      call add_error(errors, record%origin, "COUNT with POINTS="//contact%points, &
                     "COUNT only with POINTS=GAUSS")
    end if
  end subroutine read_face

  !> Fill the list of draw beads in the order of the deck.
  subroutine read_beads(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: face
    type(string_t), allocatable :: faces(:)
    integer, allocatable :: found(:)
    integer :: i

    faces = face_names()
    faces = pack(faces, [(face_of(faces(i)%value, context%frame) >= first_large, i=1, size(faces))])
    found = find_records(deck, "DRAW BEAD")
    allocate (scene%beads(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), bead => scene%beads(i))
        bead%origin = record%origin
        bead%name = option_text(record, "NAME")
        if (place_of(context%names%tools, squeezed(upper_case(bead%name))) > 0) then
          call add_error(errors, record%origin, "the name "//bead%name//", which is that of a "// &
                         "tool", "a name of its own")
        end if
        bead%given_step = step_of(record%step)
        bead%first_step = bead%given_step
        bead%width = option_real(record, "WIDTH")
        bead%slip = option_real(record, "ELASTIC SLIP")
        call find_amplitude(record, context, bead%curve, errors)
        if (bead%curve > 0) then
          if (any(scene%curves(bead%curve)%values < 0.0_wp)) call add_error(errors, &
            record%origin, "an amplitude with values below 0", "one that holds the sheet back")
        end if
        call resolve_option(record, "CLOSING TOOL", context%names%tools, "*TOOL", &
                            bead%closing, errors)
        if (is_option_given(record, "CLOSING TOOL") .and. bead%curve == 0) &
          call add_error(errors, record%origin, "CLOSING TOOL without AMPLITUDE", &
                         "an amplitude of the forces over the stroke of the tool")
        face = squeezed(upper_case(option_text(record, "FACE")))
        bead%face = face_of(face, context%frame)
        if (bead%face < first_large) then
          call add_error(errors, record%origin, "FACE="//face, "the top or the bottom "// &
                         "surface of the sheet"// &
                         did_you_mean(face, faces))
        end if
        if (record%is_valid) call read_line(record, i, scene, errors)
      end associate
    end do
  end subroutine read_beads

  !> Forces and corners of bead `i`.
  subroutine read_line(record, i, scene, errors)
    type(record_t), intent(in) :: record
    integer, intent(in) :: i
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: line

    associate (bead => scene%beads(i))
      bead%restraint = field_real(record, 1, 1)
      bead%hold_down = field_real(record, 1, 2)
      allocate (bead%line(3, record%n_lines - 1))
      do line = 2, record%n_lines
        bead%line(:, line - 1) = field_vector(record, line, 1)
        if (line < 3) cycle
        if (norm2(bead%line(:, line - 1) - bead%line(:, line - 2)) > 0.0_wp) cycle
        call add_error(errors, record%origin, "a corner of the line twice in a row", &
                       "corners that differ")
      end do
    end associate
  end subroutine read_line

end module contact_keywords
