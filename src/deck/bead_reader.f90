!> *DRAW BEAD: its entry in the keyword table and its reader.
module bead_reader
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: string_t, upper_case, squeezed
  use keyword_spec, only: keyword_table_t, add_keyword, add_option, add_line, add_field, &
                          add_example, kind_real, kind_name, any_number
  use scene, only: scene_t
  use field_check, only: did_you_mean
  use name_table, only: place_of
  use deck_names, only: deck_names_t, resolve
  use deck_steps, only: step_of
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_real, &
                          is_option_given, field_real
  use blank_reader, only: box_frame_t
  use motion_reader, only: find_amplitude
  use set_reader, only: face_of, face_names
  implicit none
  private

  public :: add_bead_keywords, read_beads

  integer, parameter :: first_large = 5   !! faces from here on are the large ones

contains

  !> Add *DRAW BEAD.
  pure subroutine add_bead_keywords(table)
    type(keyword_table_t), intent(inout) :: table

    call add_keyword(table, "DRAW BEAD", "A draw bead as a line of force: it holds back sheet "// &
                     "that is drawn across a polyline, in a band along it, up to a force per "// &
                     "length. Sheet at rest is held by springs, motion along the line is free, "// &
                     "and beyond the ends of the line nothing acts. Nothing bends the sheet "// &
                     "there. A bead in a step begins with it; *MODEL CHANGE, REMOVE opens it.")
    call add_option(table, "NAME", kind_name, "name", default="bead")
    call add_option(table, "WIDTH", kind_real, "width of the band; at least three elements "// &
                    "across make the force exact within a per cent", unit="length", range="> 0")
    call add_option(table, "FACE", kind_name, "large face of the blank that the bead is on", &
                    default="ZETA_MAX")
    call add_option(table, "SLIP", kind_real, "way at which the springs give in; 0: a "// &
                    "hundredth of the width. It is raised where the time step needs it", &
                    default="0", unit="length", range=">= 0")
    call add_option(table, "AMPLITUDE", kind_name, "amplitude that scales the forces", &
                    is_required=.false.)
    call add_option(table, "CLOSING", kind_name, "tool whose way from its start the amplitude "// &
                    "runs over, instead of the time", is_required=.false.)
    call add_line(table, "Forces per length of the line.")
    call add_field(table, "restraint", kind_real, "greatest force across the line", &
                   unit="force/length", range=">= 0")
    call add_field(table, "hold-down", kind_real, "force against the outward normal of the face", &
                   default="0", unit="force/length")
    call add_line(table, "Corners of the line.", n_min=2, n_max=any_number)
    call add_field(table, "x", kind_real, "coordinate", unit="length")
    call add_field(table, "y", kind_real, "coordinate", unit="length")
    call add_field(table, "z", kind_real, "coordinate", unit="length")
    call add_example(table, "*DRAW BEAD, NAME=front, WIDTH=10")
    call add_example(table, "120, 15")
    call add_example(table, "60, -40, 0.8")
    call add_example(table, "60, 40, 0.8")
  end subroutine add_bead_keywords

  !> Fill the list of draw beads in the order of the deck.
  subroutine read_beads(deck, frame, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(in) :: names
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: face
    type(string_t), allocatable :: faces(:)
    integer, allocatable :: found(:)
    integer :: i

    faces = face_names()
    faces = pack(faces, [(face_of(faces(i)%value, frame) >= first_large, i=1, size(faces))])
    found = find_records(deck, "DRAW BEAD")
    allocate (scene%beads(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), bead => scene%beads(i))
        bead%origin = record%origin
        bead%name = option_text(deck, record, "NAME")
        if (place_of(names%tools, squeezed(upper_case(bead%name))) > 0) then
          call add_error(errors, record%origin, "the name "//bead%name//", which is that of a "// &
                         "tool", "a name of its own")
        end if
        bead%given_step = step_of(record%step)
        bead%first_step = bead%given_step
        bead%width = option_real(deck, record, "WIDTH")
        bead%slip = option_real(deck, record, "SLIP")
        call find_amplitude(deck, record, names, bead%curve, errors)
        if (bead%curve > 0) then
          if (any(scene%curves(bead%curve)%values < 0.0_wp)) call add_error(errors, &
            record%origin, "an amplitude with values below 0", "one that holds the sheet back")
        end if
        if (is_option_given(deck, record, "CLOSING")) then
          call resolve(names%tools, option_text(deck, record, "CLOSING"), "*TOOL", record%origin, &
                       bead%closing, errors)
          if (bead%curve == 0) call add_error(errors, record%origin, "CLOSING without AMPLITUDE", &
                                              "an amplitude of the forces over the way of the tool")
        end if
        face = squeezed(upper_case(option_text(deck, record, "FACE")))
        bead%face = face_of(face, frame)
        if (bead%face < first_large) then
          call add_error(errors, record%origin, "FACE="//face, "one of the two large faces"// &
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
    integer :: line, c

    associate (bead => scene%beads(i))
      bead%restraint = field_real(record, 1, 1)
      bead%hold_down = field_real(record, 1, 2)
      allocate (bead%line(3, record%n_lines - 1))
      do line = 2, record%n_lines
        bead%line(:, line - 1) = [(field_real(record, line, c), c=1, 3)]
        if (line < 3) cycle
        if (norm2(bead%line(:, line - 1) - bead%line(:, line - 2)) > 0.0_wp) cycle
        call add_error(errors, record%origin, "a corner of the line twice in a row", &
                       "corners that differ")
      end do
    end associate
  end subroutine read_line

end module bead_reader
