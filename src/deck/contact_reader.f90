!> *CONTACT PAIR.
module contact_reader
  use input_errors, only: error_list_t, add_error
  use text, only: upper_case, squeezed, strings
  use scene, only: scene_t, contact_spec_t
  use field_check, only: did_you_mean
  use deck_names, only: deck_names_t, resolve
  use deck_steps, only: step_of
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_real, &
                          is_option_given
  use blank_reader, only: box_frame_t, read_count
  use set_reader, only: face_of, face_names
  implicit none
  private

  public :: read_contacts

contains

  !> Fill the list of contact pairs in the order of the deck.
  subroutine read_contacts(deck, frame, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(in) :: names
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
        if (is_option_given(deck, record, "TOOL")) then
          call resolve(names%tools, option_text(deck, record, "TOOL"), "*TOOL", record%origin, &
                       contact%tool, errors)
        end if
        contact%points = option_text(deck, record, "POINTS")
        contact%is_corner_start = option_text(deck, record, "START") == "CORNER"
        contact%penalty_scale = option_real(deck, record, "PENALTY")
        contact%stiffness = option_real(deck, record, "STIFFNESS")
        contact%friction = option_real(deck, record, "FRICTION")
        contact%damping = option_real(deck, record, "DAMPING")
        contact%overhang = option_real(deck, record, "OVERHANG")
        call read_face(deck, record, frame, contact, errors)
      end associate
    end do
  end subroutine read_contacts

  !> Face and the number of Gauss points on it.
  subroutine read_face(deck, record, frame, contact, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(box_frame_t), intent(in) :: frame
    type(contact_spec_t), intent(inout) :: contact
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: face
    integer :: n_parts(2)
    logical :: is_good

    face = squeezed(upper_case(option_text(deck, record, "FACE")))
    contact%face = face_of(face, frame)
    if (contact%face == 0 .and. face /= "AUTO") then
      call add_error(errors, record%origin, "FACE="//face, "the name of a face, or AUTO"// &
                     did_you_mean(face, [face_names(), strings(["AUTO"])]))
    end if
    if (.not. is_option_given(deck, record, "COUNT")) return
    call read_count(option_text(deck, record, "COUNT"), contact%n_points, n_parts, is_good)
    if (.not. is_good .or. any(n_parts > 1)) then
      call add_error(errors, record%origin, "COUNT="//option_text(deck, record, "COUNT"), &
                     "two whole numbers in quotes such as ""3,3""")
    else if (contact%points /= "GAUSS") then
      call add_error(errors, record%origin, "COUNT with POINTS="//contact%points, &
                     "COUNT only with POINTS=GAUSS")
    end if
  end subroutine read_face

end module contact_reader
