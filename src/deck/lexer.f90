!> From the files of a deck to its keyword blocks: comments, continued lines, includes, parameters.
module lexer
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: origin_t, new_origin, error_list_t, add_error, add_warning, n_errors
  use text, only: string_t, upper_case, to_text, squeezed, counted
  use checksum, only: contents_checksum
  use text_file, only: read_source, read_plain_source, next_line, path_beside
  use expression, only: parameter_table_t, parameter_t, find_parameter, define_parameter, &
                        nearest_parameter, evaluate, substitute
  implicit none
  private

  public :: lexed_deck_t, block_t, option_t, lex_deck, option_place
  public :: line_list_t, append_line, append_text, line_text, split_fields, field_text

  !> Where a line stands.
  type :: line_t
    integer :: first = 1, last = 0   !! in the characters of its list
    integer :: file = 0              !! number of the file
    integer :: number = 0            !! of the line in that file
  end type line_t

  !> Lines 1 to `n_lines`; what holds them is grown by doubling, so longer.
  type :: line_list_t
    integer :: n_lines = 0, n_characters = 0
    type(line_t), allocatable :: items(:)
    character(:), allocatable :: characters
  end type line_list_t

  ! How much a deck may hold. Beyond it reading stops with an error.
  integer, parameter :: most_levels = 20            !! files within each other
  integer, parameter :: most_files = 1000           !! opened in all, each time counting
  integer, parameter :: most_lines = 10000000       !! of all files
  !> Characters of all files, and of all data lines with their parameters replaced.
  integer, parameter :: most_characters = 2**27
  !> Of a line with those that continue it and its parameters replaced.
  integer, parameter :: longest_line = 500000
  integer, parameter :: most_options = 1000         !! of a keyword
  integer, parameter :: longest_name = 255          !! of what a deck gives a name to

  !> Keywords whose INPUT is geometry, not lines of a deck.
  character(*), parameter :: of_geometry(3) = [character(13) :: "TOOL", "BLANK OUTLINE", "TRIM"]
  character(*), parameter :: letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"

  !> One `NAME=value` of a keyword line, or a lone `NAME`.
  type :: option_t
    character(:), allocatable :: name    !! upper case, single blanks
    character(:), allocatable :: value   !! as written, without quotes
    logical :: has_value = .false.
  end type option_t

  !> A keyword line and the data lines `first` to `last` that belong to it.
  type :: block_t
    character(:), allocatable :: keyword       !! upper case, single blanks, without the star
    type(option_t), allocatable :: options(:)
    integer :: file = 0, line = 0              !! place of the keyword line
    integer :: first = 1, last = 0
  end type block_t

  !> A deck with all its includes; lists are longer than their `n_` says.
  type :: lexed_deck_t
    integer :: n_blocks = 0, n_characters = 0
    integer :: end_line = 1                     !! where the deck itself ends
    logical :: is_cut = .false.                 !! a limit was passed; the rest was not read
    type(string_t), allocatable :: files(:)     !! paths in the order of opening
    type(string_t), allocatable :: sums(:)      !! checksums of what was read from them
    type(block_t), allocatable :: blocks(:)
    type(line_list_t) :: lines                  !! data lines, parameters already replaced
    character(:), allocatable :: characters     !! the files as they are, for the provenance
  end type lexed_deck_t

  !> What the lexer knows between two lines.
  type :: state_t
    type(parameter_table_t) :: parameters
    type(parameter_table_t) :: overrides        !! as texts: the command line's word
    logical, allocatable :: is_used(:)          !! which overrides have met their parameter
    integer :: block = 0                        !! block that data lines belong to, 0: none yet
    logical :: is_in_parameters = .false.       !! data lines define parameters
    integer :: n_parameter_blocks = 0           !! keywords *PARAMETER so far
    logical :: is_default = .false.             !! only parameters that have no value yet
    integer :: n_open = 0                       !! files that are being read
    integer :: first(most_levels) = 1           !! where their contents stand in `characters`
    integer :: last(most_levels) = 0
    integer :: n_lines = 0                      !! read from all files
  end type state_t

  !> The file being read and how far.
  type :: cursor_t
    integer :: file = 0
    integer :: number = 0                       !! of the line read last
    integer :: place = 1
    character(:), allocatable :: contents
  end type cursor_t

contains

  !> Add a line to the end of the list.
  pure subroutine append_line(list, line, file, number)
    type(line_list_t), intent(inout) :: list
    character(*), intent(in) :: line
    integer, intent(in) :: file, number
    integer :: n

    if (.not. allocated(list%items)) allocate (list%items(64))
    n = list%n_lines + 1
    if (n > size(list%items)) list%items = [list%items, list%items]
    list%items(n) = line_t(list%n_characters + 1, list%n_characters + len(line), file, number)
    list%n_lines = n
    call append_text(list%characters, list%n_characters, line)
  end subroutine append_line

  !> Line `i` of the list.
  pure function line_text(list, i) result(line)
    type(line_list_t), intent(in) :: list
    integer, intent(in) :: i
    character(:), allocatable :: line

    line = list%characters(list%items(i)%first:list%items(i)%last)
  end function line_text

  !> Add to a text of which the first `n_used` characters are in use, in time linear in all.
  pure subroutine append_text(characters, n_used, addition)
    character(:), allocatable, intent(inout) :: characters
    integer, intent(inout) :: n_used
    character(*), intent(in) :: addition
    character(:), allocatable :: longer

    if (.not. allocated(characters)) allocate (character(256) :: characters)
    if (n_used + len(addition) > len(characters)) then
      allocate (character(2*(n_used + len(addition))) :: longer)
      longer(:n_used) = characters(:n_used)
      call move_alloc(longer, characters)
    end if
    characters(n_used + 1:n_used + len(addition)) = addition
    n_used = n_used + len(addition)
  end subroutine append_text

  !> Bounds of the fields of a line, without the blanks around them.
  !! Commas separate; in a line without commas blanks do. Empty fields count, except one after the
  !! last comma. A comma in quotes separates nothing.
  pure subroutine split_fields(line, first, last)
    character(*), intent(in) :: line
    integer, allocatable, intent(out) :: first(:), last(:)   !! shape (number of fields)
    logical :: is_in_quotes, is_comma_separated
    integer :: i, n, start

    allocate (first(len(line) + 1), last(len(line) + 1))
    is_comma_separated = has_bare_comma(line)
    is_in_quotes = .false.
    n = 0
    start = 1
    do i = 1, len(line) + 1
      if (i <= len(line)) then
        if (line(i:i) == '"') is_in_quotes = .not. is_in_quotes
        if (is_in_quotes) cycle
        if (is_comma_separated .and. line(i:i) /= ",") cycle
        if (.not. is_comma_separated .and. line(i:i) /= " ") cycle
      end if
      if (is_comma_separated .or. start < i) then
        n = n + 1
        last(n) = start - 1 + len_trim(line(start:i - 1))
        first(n) = start - 1 + max(1, verify(line(start:last(n)), " "))
      end if
      start = i + 1
    end do
    if (n > 1) then
      if (last(n) < first(n)) n = n - 1
    end if
    first = first(:n)
    last = last(:n)
  end subroutine split_fields

  !> A field without the quotes around it.
  pure function field_text(line, first, last) result(field)
    character(*), intent(in) :: line
    integer, intent(in) :: first, last   !! from `split_fields`
    character(:), allocatable :: field

    field = line(first:last)
    if (len(field) < 2) return
    if (field(1:1) == '"' .and. field(len(field):) == '"') field = field(2:len(field) - 1)
  end function field_text

  pure logical function has_bare_comma(line)
    character(*), intent(in) :: line
    logical :: is_in_quotes
    integer :: i

    is_in_quotes = .false.
    has_bare_comma = .false.
    do i = 1, len(line)
      if (line(i:i) == '"') is_in_quotes = .not. is_in_quotes
      has_bare_comma = line(i:i) == "," .and. .not. is_in_quotes
      if (has_bare_comma) exit
    end do
  end function has_bare_comma

  !> Read a deck and everything it includes. Errors are collected, reading goes on.
  !! `overrides` are texts `name=value` which win over the *PARAMETER of that name.
  subroutine lex_deck(path, overrides, deck, errors)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: overrides(:)
    type(lexed_deck_t), intent(out) :: deck
    type(error_list_t), intent(inout) :: errors
    type(state_t) :: state
    type(origin_t) :: nowhere
    integer :: i
    character(:), allocatable :: name, nearest

    nowhere = new_origin(path, 0, "")
    allocate (deck%files(0), deck%sums(0), deck%blocks(64))
    call take_overrides(overrides, state, nowhere, errors)
    call read_file(path, nowhere, .false., deck, state, errors)
    do i = 1, state%overrides%names%n_names
      name = state%overrides%names%names(i)%value
      if (state%is_used(i) .and. .not. is_mentioned(deck%characters(:deck%n_characters), name)) &
        call add_warning(errors, nowhere, "--set "//name//", a parameter that nothing in the "// &
                         "deck refers to", "a parameter that is used in <...> or by another one")
      if (state%is_used(i) .or. deck%is_cut) cycle
      nearest = nearest_parameter(state%parameters, name)
      if (nearest /= "") nearest = ", did you mean "//nearest//"?"
      call add_error(errors, nowhere, "--set "//name//", which no *PARAMETER of the deck defines", &
                     "the name of a parameter of the deck"//nearest)
    end do
    if (n_errors(errors) == 0) call check_parameters(path, deck, state, errors)
  end subroutine lex_deck

  !> Warn of parameters of the deck itself, not given on the command line, that nothing refers to.
  subroutine check_parameters(path, deck, state, errors)
    character(*), intent(in) :: path
    type(lexed_deck_t), intent(in) :: deck
    type(state_t), intent(in) :: state
    type(error_list_t), intent(inout) :: errors
    integer :: i

    if (deck%is_cut) return
    do i = 1, state%parameters%names%n_names
      associate (item => state%parameters%items(i), &
                 name => state%parameters%names%names(i)%value)
        if (item%line == 0 .or. find_parameter(state%overrides, name) > 0) cycle
        if (is_mentioned(deck%characters(:deck%n_characters), name)) cycle
        call add_warning(errors, new_origin(path, item%line, "*PARAMETER"), "the parameter "// &
                         item%name//", which nothing in the deck refers to", &
                         "a parameter that is used in <...> or by another one")
      end associate
    end do
  end subroutine check_parameters

  !> Does a parameter stand in any line of a deck within <...>, or behind the = of another one?
  pure logical function is_mentioned(contents, name)
    character(*), intent(in) :: contents      !! of all files
    character(*), intent(in) :: name          !! upper case
    character(*), parameter :: of_names = letters//"abcdefghijklmnopqrstuvwxyz_0123456789"
    character(:), allocatable :: line
    integer :: next, at, before

    next = 1
    is_mentioned = .false.
    do while (next <= len(contents) .and. .not. is_mentioned)
      call next_line(contents, next, line)
      if (is_comment(line)) cycle
      line = " "//upper_case(line)//" "
      at = merge(index(line, "<"), scan(line, "<="), scan(adjustl(line), "*") == 1)
      do while (at > 0 .and. .not. is_mentioned)
        before = at
        at = index(line(before + 1:), name)
        if (at == 0) exit
        at = before + at
        is_mentioned = scan(line(at - 1:at - 1), of_names) == 0 .and. &
                       scan(line(at + len(name):at + len(name)), of_names) == 0
      end do
    end do
  end function is_mentioned

  pure subroutine take_overrides(overrides, state, nowhere, errors)
    type(string_t), intent(in) :: overrides(:)
    type(state_t), intent(inout) :: state
    type(origin_t), intent(in) :: nowhere
    type(error_list_t), intent(inout) :: errors
    type(parameter_t) :: given
    integer :: i, equals
    logical :: is_new

    allocate (state%is_used(size(overrides)))
    state%is_used = .false.
    do i = 1, size(overrides)
      equals = index(overrides(i)%value, "=")
      if (equals < 2) then
        call add_error(errors, nowhere, "--set "//overrides(i)%value, "--set NAME=VALUE")
        cycle
      end if
      given%is_text = .true.
      given%words = overrides(i)%value(equals + 1:)
      call define_parameter(state%overrides, trim(adjustl(overrides(i)%value(:equals - 1))), &
                            given, is_new)
      if (.not. is_new) call add_error(errors, nowhere, "--set "//overrides(i)%value// &
                                       " after another --set of that name", "one --set a name")
    end do
  end subroutine take_overrides

  !> Read a file of keywords, or one of data lines alone, of which a first line of column names and
  !! lines that begin with `#` are left out.
  recursive subroutine read_file(path, origin, is_data, deck, state, errors)
    character(*), intent(in) :: path
    type(origin_t), intent(in) :: origin   !! of the keyword that names it
    logical, intent(in) :: is_data
    type(lexed_deck_t), intent(inout) :: deck
    type(state_t), intent(inout) :: state
    type(error_list_t), intent(inout) :: errors
    type(cursor_t) :: cursor
    character(:), allocatable :: line
    integer :: first
    logical :: is_end

    call open_source(path, origin, deck, state, cursor, errors)
    if (cursor%file == 0) return
    is_end = .false.
    do while (cursor%place <= len(cursor%contents) .and. .not. is_end)
      call read_line(cursor, line)
      call check_line(line, cursor, deck, state, errors)
      if (deck%is_cut) return
      if (is_comment(line)) cycle
      first = verify(line, " ")
      if (is_data) then
        if (line(first:first) == "#") cycle
        first = max(1, verify(line, ' "'))
        if (cursor%number == 1 .and. scan(upper_case(line(first:first)), letters) == 1) cycle
        call take_data_line(line, cursor, deck, state, errors)
      else if (line(first:first) == "*") then
        call read_keyword_line(line, cursor, deck, state, is_end, errors)
      else
        call take_data_line(line, cursor, deck, state, errors)
      end if
      if (deck%is_cut) return
    end do
    state%n_open = state%n_open - 1
    if (state%n_open == 0) deck%end_line = max(1, cursor%number)
  end subroutine read_file

  !> Read the bytes of a file that is not open already, whatever path leads to it; `cursor%file`
  !! stays 0 on an error. The deck itself may come from a pipe, so nothing reads it once more.
  subroutine open_source(path, origin, deck, state, cursor, errors)
    character(*), intent(in) :: path
    type(origin_t), intent(in) :: origin
    type(lexed_deck_t), intent(inout) :: deck
    type(state_t), intent(inout) :: state
    type(cursor_t), intent(out) :: cursor
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    integer :: i

    if (state%n_open == most_levels) then
      call add_error(errors, origin, "more than "//to_text(most_levels)// &
                     " files within each other", "fewer levels of *INCLUDE")
      return
    else if (size(deck%files) == most_files) then
      call cut(deck, origin, "more than "//to_text(most_files)//" files in all", &
               "fewer *INCLUDE", errors)
      return
    end if
    if (size(deck%files) == 0) then
      call read_source(path, cursor%contents, error)
    else
      call read_plain_source(path, cursor%contents, error)
    end if
    if (allocated(error)) then
      call add_error(errors, origin, error%message, "a readable text file of keywords or data")
      return
    end if
    if (len(cursor%contents) > most_characters - deck%n_characters) then
      call cut(deck, origin, "`"//path//"`, with which the files are longer than "// &
               to_text(most_characters)//" characters in all", "shorter files", errors)
      return
    end if
    do i = 1, state%n_open
      if (deck%characters(state%first(i):state%last(i)) /= cursor%contents) cycle
      call add_error(errors, origin, "`"//path//"`, which is being read already: "// &
                     "a file that includes itself", "another file")
      return
    end do
    call add_file(path, deck, cursor)
    state%n_open = state%n_open + 1
    state%last(state%n_open) = deck%n_characters - 1
    state%first(state%n_open) = deck%n_characters - len(cursor%contents)
  end subroutine open_source

  !> A limit is passed: say so, and read no more.
  pure subroutine cut(deck, origin, found, expected, errors)
    type(lexed_deck_t), intent(inout) :: deck
    type(origin_t), intent(in) :: origin
    character(*), intent(in) :: found, expected
    type(error_list_t), intent(inout) :: errors

    deck%is_cut = .true.
    call add_error(errors, origin, found//" (the rest is not read)", expected)
  end subroutine cut

  !> Count a line, and look whether it is one that can be read. Of a line whose parameters have been
  !! replaced the same is asked once more, by `cut_if_long`.
  pure subroutine check_line(line, cursor, deck, state, errors)
    character(*), intent(in) :: line
    type(cursor_t), intent(in) :: cursor
    type(lexed_deck_t), intent(inout) :: deck
    type(state_t), intent(inout) :: state
    type(error_list_t), intent(inout) :: errors

    state%n_lines = state%n_lines + 1
    if (state%n_lines > most_lines) then
      call cut(deck, new_origin(deck%files(cursor%file)%value, cursor%number, ""), &
               "more than "//to_text(most_lines)//" lines in all files", "a shorter deck", errors)
    else
      call cut_if_long(line, cursor, deck, errors)
    end if
  end subroutine check_line

  pure subroutine cut_if_long(line, cursor, deck, errors)
    character(*), intent(in) :: line
    type(cursor_t), intent(in) :: cursor
    type(lexed_deck_t), intent(inout) :: deck
    type(error_list_t), intent(inout) :: errors

    if (len(line) <= longest_line) return
    call cut(deck, new_origin(deck%files(cursor%file)%value, cursor%number, ""), &
             "a line of more than "//to_text(longest_line)//" characters, with what continues "// &
             "it and its parameters replaced", "several lines, or shorter text parameters", errors)
  end subroutine cut_if_long

  subroutine add_file(path, deck, cursor)
    character(*), intent(in) :: path
    type(lexed_deck_t), intent(inout) :: deck
    type(cursor_t), intent(inout) :: cursor
    type(string_t) :: file, sum

    file%value = path
    sum%value = contents_checksum(cursor%contents)
    deck%files = [deck%files, file]
    deck%sums = [deck%sums, sum]
    cursor%file = size(deck%files)
    call append_text(deck%characters, deck%n_characters, "** file "//path//new_line("a"))
    call append_text(deck%characters, deck%n_characters, cursor%contents//new_line("a"))
  end subroutine add_file

  pure subroutine read_line(cursor, line)
    type(cursor_t), intent(inout) :: cursor
    character(:), allocatable, intent(out) :: line

    call next_line(cursor%contents, cursor%place, line)
    cursor%number = cursor%number + 1
  end subroutine read_line

  pure logical function is_comment(line)
    character(*), intent(in) :: line
    integer :: first

    first = verify(line, " ")
    is_comment = first == 0
    if (is_comment) return
    is_comment = line(first:first) == "$" .or. index(line(first:), "**") == 1
  end function is_comment

  !> A keyword line with the lines that continue it, and what it asks of the lexer itself.
  recursive subroutine read_keyword_line(given, cursor, deck, state, is_end, errors)
    character(*), intent(in) :: given
    type(cursor_t), intent(inout) :: cursor
    type(lexed_deck_t), intent(inout) :: deck
    type(state_t), intent(inout) :: state
    logical, intent(inout) :: is_end   !! set by *END
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: line, more
    type(origin_t) :: origin
    type(error_t), allocatable :: error
    type(block_t) :: block
    integer :: place

    line = trim(adjustl(given))
    block%line = cursor%number
    call read_continuation(cursor, line)
    call substitute(line, state%parameters, longest_line, error)
    block%file = cursor%file
    call cut_if_long(line, cursor, deck, errors)
    if (deck%is_cut) return
    call read_options(line, deck%files(cursor%file)%value, block, errors)
    origin = origin_of(deck, block)
    if (allocated(error)) call add_error(errors, origin, error%message, "a value for <...>")

    is_end = block%keyword == "END"
    state%is_in_parameters = block%keyword == "PARAMETER"
    state%is_default = option_place(block, "DEFAULT") > 0
    if (state%is_in_parameters) state%n_parameter_blocks = state%n_parameter_blocks + 1
    block%first = deck%lines%n_lines + 1
    block%last = deck%lines%n_lines
    call add_block(block, deck)
    if (.not. any(block%keyword == [character(9) :: "END", "INCLUDE", "PARAMETER"])) then
      state%block = deck%n_blocks
    end if
    place = option_place(block, "INPUT")
    if (place == 0) return
    more = path_beside(deck%files(cursor%file)%value, block%options(place)%value)
    if (block%keyword == "INCLUDE") then
      call read_file(more, origin, .false., deck, state, errors)
      state%is_in_parameters = .false.
    else if (.not. any(block%keyword == of_geometry)) then
      call read_file(more, origin, .true., deck, state, errors)
    end if
  end subroutine read_keyword_line

  !> Add the lines that go on with a keyword line which ends with a comma.
  pure subroutine read_continuation(cursor, line)
    type(cursor_t), intent(inout) :: cursor
    character(:), allocatable, intent(inout) :: line
    character(:), allocatable :: more
    integer :: place, n

    n = len(line)
    do while (line(n:n) == "," .and. cursor%place <= len(cursor%contents) &
              .and. n <= longest_line)
      place = cursor%place
      call read_line(cursor, more)
      if (is_comment(more)) cycle
      more = adjustl(more)
      if (more(1:1) == "*") then   ! a comma too many, not a keyword too few
        cursor%place = place
        cursor%number = cursor%number - 1
        exit
      end if
      call append_text(line, n, " "//trim(more))
    end do
    line = line(:n)
  end subroutine read_continuation

  pure function origin_of(deck, block) result(origin)
    type(lexed_deck_t), intent(in) :: deck
    type(block_t), intent(in) :: block
    type(origin_t) :: origin

    origin = new_origin(deck%files(block%file)%value, block%line, "*"//block%keyword)
  end function origin_of

  pure subroutine add_block(block, deck)
    type(block_t), intent(in) :: block
    type(lexed_deck_t), intent(inout) :: deck
    type(block_t), allocatable :: longer(:)

    if (deck%n_blocks == size(deck%blocks)) then
      allocate (longer(2*deck%n_blocks))
      longer(:deck%n_blocks) = deck%blocks
      call move_alloc(longer, deck%blocks)
    end if
    deck%n_blocks = deck%n_blocks + 1
    deck%blocks(deck%n_blocks) = block
  end subroutine add_block

  pure subroutine take_data_line(line, cursor, deck, state, errors)
    character(:), allocatable, intent(inout) :: line
    type(cursor_t), intent(inout) :: cursor
    type(lexed_deck_t), intent(inout) :: deck
    type(state_t), intent(inout) :: state
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    type(origin_t) :: origin

    if (state%block == 0 .and. .not. state%is_in_parameters) then
      origin = new_origin(deck%files(cursor%file)%value, cursor%number, "")
      call add_error(errors, origin, "data before the first keyword", "a line such as *HEADING")
      cursor%place = len(cursor%contents) + 1
      return
    end if
    call substitute(line, state%parameters, longest_line, error)
    call cut_if_long(line, cursor, deck, errors)
    if (deck%is_cut) return
    origin = new_origin(deck%files(cursor%file)%value, cursor%number, "*PARAMETER")
    if (.not. state%is_in_parameters) then
      origin%keyword = "*"//deck%blocks(state%block)%keyword
      call append_line(deck%lines, line, cursor%file, cursor%number)
      deck%blocks(state%block)%last = deck%lines%n_lines
      if (deck%lines%n_characters > most_characters) then
        call cut(deck, origin, "data lines of more than "//to_text(most_characters)// &
                 " characters in all, their parameters replaced", "a shorter deck", errors)
        return
      end if
    end if
    if (allocated(error)) then
      call add_error(errors, origin, error%message, "a value for <...>")
    else if (state%is_in_parameters) then
      call take_parameter(trim(adjustl(line)), origin, state, errors)
    end if
  end subroutine take_data_line

  !> A line `name = expression` or `name = "text"`.
  pure subroutine take_parameter(line, origin, state, errors)
    character(*), intent(in) :: line
    type(origin_t), intent(in) :: origin
    type(state_t), intent(inout) :: state
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: name, value
    type(parameter_t) :: parameter
    type(error_t), allocatable :: error
    logical :: is_new
    integer :: equals, override, known

    equals = index(line, "=")
    name = ""
    if (equals > 1) name = trim(line(:equals - 1))
    if (.not. is_name(name)) then
      call add_error(errors, origin, "`"//line//"`", "a line such as thickness = 2.5, with a "// &
                     "name of at most "//to_text(longest_name)//" letters, digits and "// &
                     "underscores other than pi")
      return
    end if
    known = find_parameter(state%parameters, name)
    if (known > 0) then
      associate (other => state%parameters%items(known))
        if (other%name /= name) then
          call add_error(errors, origin, "the parameter "//name//", of which there is "// &
                         other%name//" already", "another name; case does not matter")
          return
        else if (state%is_default .and. other%block /= state%n_parameter_blocks) then
          return
        end if
      end associate
      call add_error(errors, origin, "a second value for the parameter "//name, &
                     "one value a parameter (see *PARAMETER, DEFAULT)")
      return
    end if
    parameter%block = state%n_parameter_blocks
    parameter%line = merge(origin%line, 0, state%n_open == 1)
    value = trim(adjustl(line(equals + 1:)))
    parameter%is_text = len(value) > 1 .and. index(value, '"') == 1
    override = find_parameter(state%overrides, name)
    if (override > 0) then
      state%is_used(override) = .true.
      value = state%overrides%items(override)%words
    end if
    if (parameter%is_text) then
      parameter%words = field_text(value, 1, len(value))
    else
      call evaluate(value, state%parameters, parameter%number, error)
    end if
    if (allocated(error)) then
      call add_error(errors, origin, name//" = "//value//": "//error%message, &
                     "an expression of numbers and earlier parameters, or a text in quotes")
      parameter%number = 1.0_wp   ! what uses it is more likely to pass than with 0
    end if
    call define_parameter(state%parameters, name, parameter, is_new)
  end subroutine take_parameter

  pure logical function is_name(name)
    character(*), intent(in) :: name

    is_name = len(name) > 0 .and. len(name) <= longest_name
    if (.not. is_name) return
    is_name = upper_case(name) /= "PI" &
              .and. verify(upper_case(name), letters//"_0123456789") == 0
    if (is_name) is_name = scan(upper_case(name(1:1)), letters//"_") == 1
  end function is_name

  !> Keyword and options of a whole keyword line; underscores count as blanks in the keyword.
  subroutine read_options(line, file, block, errors)
    character(*), intent(in) :: line, file       !! and the file that it stands in
    type(block_t), intent(inout) :: block
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: first(:), last(:)
    character(:), allocatable :: closed, option, name
    type(origin_t) :: origin
    logical :: is_open
    integer :: i, equals, n

    is_open = mod(count([(line(i:i) == '"', i=1, len(line))]), 2) == 1
    closed = line(2:)//","
    if (is_open) closed = line(2:)//""","
    call split_fields(closed, first, last)
    block%keyword = closed(first(1):last(1))
    do i = 1, len(block%keyword)
      if (block%keyword(i:i) == "_") block%keyword(i:i) = " "
    end do
    block%keyword = squeezed(upper_case(block%keyword))
    origin = new_origin(file, block%line, "*"//block%keyword)
    n = min(size(first) - 1, most_options)
    if (n < size(first) - 1) call add_error(errors, origin, counted(size(first) - 1, &
                                            "option"), "at most "//to_text(most_options))
    allocate (block%options(n))
    do i = 1, n
      option = closed(first(i + 1):last(i + 1))
      equals = index(option//"=", "=")
      name = squeezed(upper_case(option(:equals - 1)))
      if (option_place(block, name, before=i) > 0) then
        call add_error(errors, origin, "the option "//name//" twice", "each option once")
      end if
      block%options(i)%name = name
      block%options(i)%has_value = equals <= len(option)
      option = adjustl(option(min(equals, len(option)) + 1:))
      block%options(i)%value = field_text(option, 1, len(option))
      if (name == "NAME" .and. len(block%options(i)%value) > longest_name) &
        call add_error(errors, origin, "a name of "// &
                       to_text(len(block%options(i)%value))//" characters: "// &
                       block%options(i)%value, "at most "//to_text(longest_name))
    end do
    if (is_open) call add_error(errors, origin, "a quote that is not closed", "quotes in pairs")
  end subroutine read_options

  !> Place of the last option of that name, 0 if the keyword line has none.
  pure integer function option_place(block, name, before)
    type(block_t), intent(in) :: block
    character(*), intent(in) :: name
    integer, intent(in), optional :: before   !! this option of the line
    integer :: i, n

    option_place = 0
    n = size(block%options)
    if (present(before)) n = before - 1
    do i = 1, n
      if (block%options(i)%name == name) option_place = i
    end do
  end function option_place

end module lexer
