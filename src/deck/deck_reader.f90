!> From a deck file to a scene: lexer, check of the records, and the readers of the keywords; and
!! the key of a deck for checkpoints, which changes with everything that may not change when a run
!! is taken up again.
module deck_reader
  use input_errors, only: error_list_t, new_origin, add_error, n_errors
  use text, only: string_t, to_text
  use scene, only: scene_t
  use scene_reduction, only: reduce_scene
  use lexer, only: lexed_deck_t, lex_deck, line_text, append_text
  use deck_records, only: parsed_deck_t, find_records, deck_end, deck_context_t, enter_names, &
                          check_uses
  use keyword_table, only: keyword_table_t
  use all_keywords, only: list_keywords
  use record_check, only: check_records
  use resolved_deck, only: resolved_text
  use deck_check, only: check_steps, check_presence, check_scene
  use shell_check, only: check_shell, check_shell_masses, check_shell_output, check_shell_viscosity
  use error_report, only: sort_errors
  use sha256, only: sha256_t, add_to_digest, sha256_text
  implicit none
  private

  public :: read_deck, read_material_deck
  public :: digest_of_deck, digest_line

  integer, parameter :: n_digits = 16      !! of a digest: they show changes, not intent

contains

  !> Read a deck with all it includes. All errors and warnings come back in one list, in the order
  !! of files and lines; the scene is of use only if `n_errors(errors)` is 0.
  subroutine read_deck(path, overrides, scene, errors, keywords)
    character(*), intent(in) :: path              !! of the deck
    type(string_t), intent(in) :: overrides(:)    !! `name=value` for parameters of the deck
    type(scene_t), intent(out) :: scene
    type(error_list_t), intent(out) :: errors
    type(keyword_table_t), intent(in), optional :: keywords   !! instead of those of the program
    type(keyword_table_t) :: table
    type(parsed_deck_t) :: deck
    logical :: is_deck

    call list_keywords(table, keywords)
    call read_records(path, overrides, table, deck, scene, errors, is_deck)
    if (.not. is_deck) return
    call check_presence(deck, errors)
    call check_steps(deck, errors)
    call read_scene(deck, table, scene, errors)
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
  subroutine read_scene(deck, table, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(keyword_table_t), intent(in) :: table
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(deck_context_t) :: context
    integer :: i

    do i = 1, size(table%items)
      call enter_names(deck, i, context%names, errors)
    end do
    do i = 1, size(table%items)
      if (associated(table%items(i)%read)) call table%items(i)%read(deck, context, scene, errors)
    end do
    if (n_errors(errors) == 0) call check_uses(deck, context%names, errors)
    do i = size(deck%lexed%files) + 1, size(scene%files)   ! geometry from other programs
      scene%digest = scene%digest//digest_line(scene%sums(i)%value, "the file '" &
                                               //scene%files(i)%value//"'")
    end do
  end subroutine read_scene

  !> Digests of all keywords with their options and data, parameters replaced, but for those that
  !! may change and the data of the last *DYNAMIC: a line for each, with its name and place.
  !! Comments, the files that the lines come from, and which of two names a keyword or an option
  !! goes by do not count.
  function digest_of_deck(deck) result(text)
    type(parsed_deck_t), intent(in) :: deck       !! checked, so that aliases have been replaced
    character(:), allocatable :: text
    character(:), allocatable :: line
    integer :: i, last_dynamic, used

    used = 0
    last_dynamic = 0
    do i = 1, deck%lexed%n_blocks
      if (deck%lexed%blocks(i)%keyword == "DYNAMIC") last_dynamic = i
    end do
    allocate (character(0) :: text)
    do i = 1, deck%lexed%n_blocks
      if (may_change(deck, deck%lexed%blocks(i)%keyword)) cycle
      line = digest_of_block(deck%lexed, i, i /= last_dynamic)
      call append_text(text, used, line)
    end do
    text = text(:used)
  end function digest_of_deck

  !> May a run be restarted with this keyword changed?
  pure logical function may_change(deck, keyword)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    integer :: i

    may_change = .false.
    do i = 1, size(deck%keywords)
      if (deck%keywords(i)%name == keyword) may_change = .not. deck%keywords(i)%is_in_digest
    end do
  end function may_change

  !> The line of one keyword.
  function digest_of_block(lexed, i, has_data) result(line)
    type(lexed_deck_t), intent(in) :: lexed
    integer, intent(in) :: i               !! the block
    logical, intent(in) :: has_data        !! its data lines count
    character(:), allocatable :: line
    type(sha256_t) :: digest
    character(64) :: digits
    integer :: j

    associate (block => lexed%blocks(i))
      call add_to_digest(digest, "*"//block%keyword)
      do j = 1, size(block%options)
        if (block%options(j)%name == "INPUT") cycle
        call add_to_digest(digest, ","//block%options(j)%name)
        if (block%options(j)%has_value) call add_to_digest(digest, "="//block%options(j)%value)
      end do
      do j = block%first, merge(block%last, 0, has_data)
        call add_to_digest(digest, new_line("a")//line_text(lexed%lines, j))
      end do
      digits = sha256_text(digest)
      line = digest_line(digits(:n_digits), "*"//block%keyword//" ("// &
                         lexed%files(block%file)%value//":"//to_text(block%line)//")")
    end associate
  end function digest_of_block

  !> A line of such a digest.
  pure function digest_line(digest, name) result(line)
    character(*), intent(in) :: digest     !! sixteen digits
    character(*), intent(in) :: name       !! what it is of, for messages
    character(:), allocatable :: line

    line = digest//" "//name//new_line("a")
  end function digest_line

end module deck_reader
