!> From a deck file to a scene: the road from lexer over records to the readers of the keywords.
module deck_reader
  use input_errors, only: error_list_t, add_error, n_errors
  use text, only: string_t
  use scene, only: scene_t
  use lexer, only: lexed_deck_t, lex_deck
  use deck_records, only: parsed_deck_t, find_records, deck_end
  use record_check, only: check_records
  use deck_names, only: deck_names_t, enter_names
  use patch_reader, only: patch_parts_t, collect_parts
  use material_reader, only: read_materials
  use blank_reader, only: box_frame_t, read_blank
  use tool_reader, only: read_tools, enter_tools
  use placement_keywords, only: read_placements
  use motion_reader, only: read_amplitudes, read_tool_motions
  use set_reader, only: read_sets
  use boundary_reader, only: read_boundaries, read_initial_velocities, read_initial_states, &
                             read_test_states
  use field_reader, only: read_fields, read_test_fields
  use load_reader, only: read_loads
  use bead_reader, only: read_beads
  use contact_reader, only: read_contacts
  use change_reader, only: read_changes
  use deck_steps, only: check_steps
  use test_reader, only: read_tests
  use step_reader, only: read_labels, read_steps, read_probes
  use reduction_keywords, only: read_reduction
  use plane_strain, only: reduce_scene
  use run_keywords, only: read_checkpoints
  use deck_digest, only: digest_of_deck, digest_line
  use deck_check, only: check_presence, check_scene
  use error_report, only: sort_errors
  implicit none
  private

  public :: read_deck, read_material_deck

contains

  !> Read a deck with all it includes. All errors and warnings come back in one list, in the order
  !! of files and lines; the scene is of use only if `n_errors(errors)` is 0.
  subroutine read_deck(path, overrides, scene, errors)
    character(*), intent(in) :: path              !! of the deck
    type(string_t), intent(in) :: overrides(:)    !! `name=value` for parameters of the deck
    type(scene_t), intent(out) :: scene
    type(error_list_t), intent(out) :: errors
    type(parsed_deck_t) :: deck
    logical :: is_deck

    call read_records(path, overrides, deck, scene, errors, is_deck)
    if (.not. is_deck) return
    call check_presence(deck, errors)
    call check_steps(deck, errors)
    call read_scene(deck, scene, errors)
    if (n_errors(errors) == 0) call check_scene(scene, errors)
    if (n_errors(errors) == 0) call reduce_scene(scene, errors)
    call sort_errors(errors, deck%lexed%files(:deck%lexed%n_files))
  end subroutine read_deck

  !> Read labels, materials, material tests and initial states of a deck, as `read_deck` does; what
  !! else it says is left out, so a forming deck may hold tests of its materials.
  subroutine read_material_deck(path, overrides, needs_tests, scene, errors)
    character(*), intent(in) :: path              !! of the deck
    type(string_t), intent(in) :: overrides(:)    !! `name=value` for parameters of the deck
    logical, intent(in) :: needs_tests            !! a deck without tests is invalid
    type(scene_t), intent(out) :: scene
    type(error_list_t), intent(out) :: errors
    type(parsed_deck_t) :: deck
    type(deck_names_t) :: names
    logical :: is_deck

    call read_records(path, overrides, deck, scene, errors, is_deck)
    if (.not. is_deck) return
    if (needs_tests .and. size(find_records(deck, "MATERIAL TEST")) == 0) then
      call add_error(errors, deck_end(deck%lexed), &
                     "no *MATERIAL TEST in the deck, which ends here", &
                     "at least one *MATERIAL TEST")
    end if
    call enter_names(deck, "MATERIAL", names%materials, errors)
    call read_labels(deck, scene)
    call read_materials(deck, scene, errors)
    call read_tests(deck, names, scene, errors)
    call read_test_states(deck, scene, errors)
    call read_test_fields(deck, scene, errors)
    call sort_errors(errors, deck%lexed%files(:deck%lexed%n_files))
  end subroutine read_material_deck

  !> The records of a deck, checked one by one against the table of keywords.
  subroutine read_records(path, overrides, deck, scene, errors, is_deck)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: overrides(:)
    type(parsed_deck_t), intent(out) :: deck
    type(scene_t), intent(inout) :: scene         !! its files and text
    type(error_list_t), intent(inout) :: errors
    logical, intent(out) :: is_deck               !! there are keywords to read
    type(lexed_deck_t) :: lexed
    integer :: i

    call lex_deck(path, overrides, lexed, errors)
    scene%file = path
    allocate (scene%files(lexed%n_files), scene%sums(lexed%n_files))
    do i = 1, lexed%n_files
      scene%files(i)%value = lexed%files(i)%value
      scene%sums(i)%value = lexed%sums(i)%value
    end do
    is_deck = lexed%n_blocks > 0 .and. .not. lexed%is_cut
    if (lexed%n_files > 0) then
      scene%text = lexed%characters(:lexed%n_characters)
      if (.not. is_deck .and. errors%n_items == 0) then
        call add_error(errors, deck_end(lexed), "no keyword in the deck, which ends here", &
                       "a deck of keywords")
      end if
    end if
    if (is_deck) scene%digest = digest_of_deck(lexed)
    if (is_deck) call check_records(lexed, deck, errors)
  end subroutine read_records

  !> Names first, then what they stand for, then what uses them.
  subroutine read_scene(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(deck_names_t) :: names
    type(patch_parts_t), allocatable :: parts(:)
    type(box_frame_t) :: frame
    integer :: i
    type(error_list_t) :: known   ! what the names of patches have shown already

    call enter_names(deck, "MATERIAL", names%materials, errors)
    call enter_names(deck, "AMPLITUDE", names%curves, errors)
    call enter_names(deck, "BLANK", names%patches, errors)
    call enter_names(deck, "TOOL", names%patches, errors)
    call enter_tools(deck, names%tools, known)
    call enter_names(deck, "PATCH", names%patches, errors)
    call enter_names(deck, "SET", names%sets, errors)
    call enter_names(deck, "PROBE", names%probes, errors)
    call collect_parts(deck, names, parts, errors)
    call read_labels(deck, scene)
    call read_materials(deck, scene, errors)
    call read_amplitudes(deck, scene, errors)
    call read_blank(deck, names, parts, scene, frame, errors)
    call read_tools(deck, names, parts, scene, errors)
    call read_placements(deck, names, scene, errors)
    call read_tool_motions(deck, names, scene, errors)
    call read_sets(deck, frame, scene, errors)
    call read_boundaries(deck, frame, names, scene, errors)
    call read_initial_velocities(deck, frame, names, scene, errors)
    call read_initial_states(deck, frame, names, scene, errors)
    call read_fields(deck, frame, names, scene, errors)
    call read_loads(deck, frame, names, scene, errors)
    call read_beads(deck, frame, names, scene, errors)
    call read_contacts(deck, frame, names, scene, errors)
    call read_changes(deck, names, scene, errors)
    call read_probes(deck, scene, errors)
    call read_tests(deck, names, scene, errors)
    call read_steps(deck, scene, errors)
    call read_reduction(deck, scene)
    call read_checkpoints(deck, scene, errors)
    do i = deck%lexed%n_files + 1, size(scene%files)   ! geometry from other programs
      scene%digest = scene%digest//digest_line(scene%sums(i)%value, "the file '" &
                                               //scene%files(i)%value//"'")
    end do
  end subroutine read_scene

end module deck_reader
