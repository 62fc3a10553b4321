!> From a deck file to a scene: lexer, check of the records, and the readers of the keywords.
module deck_reader
  use input_errors, only: error_list_t, new_origin, add_error, n_errors
  use text, only: string_t
  use scene, only: scene_t
  use scene_reduction, only: reduce_scene
  use lexer, only: lexed_deck_t, lex_deck
  use deck_records, only: parsed_deck_t, find_records, deck_end, deck_context_t, enter_names, &
                          check_uses
  use keyword_table, only: keyword_table_t
  use all_keywords, only: list_keywords
  use record_check, only: check_records
  use resolved_deck, only: resolved_text
  use deck_check, only: check_steps, check_presence, check_scene
  use shell_check, only: check_shell, check_shell_masses, check_shell_output, check_shell_viscosity
  use error_report, only: sort_errors
  use deck_digest, only: digest_of_deck
  implicit none
  private

  public :: read_deck, read_material_deck

contains

  !> Read a deck with all it includes. All errors and warnings come back in one list, in the order
  !! of files and lines; the scene is of use only if `n_errors(errors)` is 0.
  subroutine read_deck(path, overrides, scene, errors, keywords, is_check)
    character(*), intent(in) :: path              !! of the deck
    type(string_t), intent(in) :: overrides(:)    !! `name=value` for parameters of the deck
    type(scene_t), intent(out) :: scene
    type(error_list_t), intent(out) :: errors
    type(keyword_table_t), intent(in), optional :: keywords   !! instead of those of the program
    logical, intent(in), optional :: is_check     !! for a report without a run, which tells more
    type(keyword_table_t) :: table
    type(parsed_deck_t) :: deck
    type(deck_context_t) :: context
    logical :: is_deck

    call list_keywords(table, keywords)
    call read_records(path, overrides, table, deck, scene, errors, is_deck)
    if (.not. is_deck) return
    call check_presence(deck, errors)
    call check_steps(deck, errors)
    if (present(is_check)) context%is_check = is_check
    call read_scene(deck, table, context, scene, errors)
    if (n_errors(errors) == 0) then
      call check_scene(scene, errors)
      call check_shell(scene, errors)
      call check_shell_masses(deck, scene, errors)
      call check_shell_output(deck, scene, errors)
      call check_shell_viscosity(deck, scene, errors)
    end if
    if (n_errors(errors) == 0) call reduce_scene(scene, errors)
    call sort_errors(errors, deck%lexed%files)
  end subroutine read_deck

  !> Read what tests of materials need from a deck, as `read_deck` does; everything else in it is
  !! skipped, so a forming deck may contain tests of its materials.
  subroutine read_material_deck(path, overrides, needs_tests, scene, errors)
    character(*), intent(in) :: path              !! of the deck
    type(string_t), intent(in) :: overrides(:)    !! `name=value` for parameters of the deck
    logical, intent(in) :: needs_tests            !! a deck without tests is invalid
    type(scene_t), intent(out) :: scene
    type(error_list_t), intent(out) :: errors
    type(keyword_table_t) :: table
    type(parsed_deck_t) :: deck
    type(deck_context_t) :: context
    logical :: is_deck
    integer :: i

    call list_keywords(table)
    call read_records(path, overrides, table, deck, scene, errors, is_deck)
    if (.not. is_deck) return
    if (needs_tests .and. size(find_records(deck, "MATERIAL TEST")) == 0) then
      call add_error(errors, deck_end(deck%lexed), &
                     "no *MATERIAL TEST in the deck, which ends here", &
                     "at least one *MATERIAL TEST")
    end if
    do i = 1, size(table%items)
      if (.not. associated(table%items(i)%read_test)) cycle
      call enter_names(deck, i, context%names, errors)
    end do
    do i = 1, size(table%items)
      if (associated(table%items(i)%read_test)) &
        call table%items(i)%read_test(deck, context, scene, errors)
    end do
    call sort_errors(errors, deck%lexed%files)
  end subroutine read_material_deck

  !> The records of a deck, checked one by one against the table of keywords.
  subroutine read_records(path, overrides, table, deck, scene, errors, is_deck)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: overrides(:)
    type(keyword_table_t), intent(in) :: table
    type(parsed_deck_t), intent(out) :: deck
    type(scene_t), intent(inout) :: scene         !! its files and text
    type(error_list_t), intent(inout) :: errors
    logical, intent(out) :: is_deck               !! there are keywords to read
    type(lexed_deck_t) :: lexed
    integer :: i

    call lex_deck(path, overrides, lexed, errors)
    scene%file = path
    scene%files = lexed%files
    scene%sums = lexed%sums
    is_deck = lexed%n_blocks > 0 .and. .not. lexed%is_cut
    if (size(lexed%files) > 0) then
      scene%text = lexed%characters(:lexed%n_characters)
      if (.not. is_deck .and. errors%n_items == 0) then
        call add_error(errors, deck_end(lexed), "no keyword in the deck, which ends here", &
                       "a deck of keywords")
      end if
    end if
    if (allocated(table%error)) then
      is_deck = .false.
      call add_error(errors, new_origin(path, 0, ""), "a program whose keywords have a fault ("// &
                     table%error%message//")", "sections of the form in docs/adding.md")
    end if
    if (.not. is_deck) return
    allocate (deck%keywords(size(table%items)))
    do i = 1, size(table%items)
      deck%keywords(i) = table%items(i)%keyword_spec_t
    end do
    call check_records(lexed, deck, errors)
    scene%digest = digest_of_deck(deck)
    scene%resolved = resolved_text(deck)
  end subroutine read_records

  !> All names first, then the keywords in the order of the table: each reader finds in the scene
  !! what the entries before it describe.
  subroutine read_scene(deck, table, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(keyword_table_t), intent(in) :: table
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(table%items)
      call enter_names(deck, i, context%names, errors)
    end do
    do i = 1, size(table%items)
      if (associated(table%items(i)%read)) call table%items(i)%read(deck, context, scene, errors)
    end do
    if (n_errors(errors) == 0) call check_uses(deck, context%names, errors)
  end subroutine read_scene

end module deck_reader
