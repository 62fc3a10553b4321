!> From keyword blocks to records: every block is checked against its entry in the keyword table.
!! Keywords of Abaqus decks that mean nothing here are skipped with a note, so that the material of
!! a subroutine's own deck can be used as it is; of others the counterpart is named.
module record_check
  use kinds, only: wp
  use input_errors, only: origin_t, new_origin, error_list_t, add_error, add_warning
  use text, only: string_t, squeezed, joined, counted
  use keyword_spec, only: keyword_spec_t, line_spec_t, value_spec_t, kind_real, kind_flag, &
                          kind_list, kind_words, anywhere, selects_lines, may_be_left_out, &
                          check_field, choice_list, is_among, did_you_mean, wanted, &
                          field_names
  use lexer, only: lexed_deck_t, block_t, option_place, line_text, split_fields, field_text
  use deck_records, only: record_t, option_t, field_t, parsed_deck_t, find_records, n_deck_steps, &
                          line_origin, line_place
  implicit none
  private

  public :: check_records

  integer, parameter :: most_errors = 20   ! of the data lines of one block; the rest is the same

  character(*), parameter :: of_mesh(8) = [character(13) :: "NODE", "ELEMENT", "NGEN", "NFILL", &
    "NCOPY", "ELGEN", "ELCOPY", "SHELL SECTION"]
  character(*), parameter :: of_model(9) = [character(14) :: "NSET", "ELSET", "PART", "END PART", &
    "ASSEMBLY", "END ASSEMBLY", "INSTANCE", "END INSTANCE", "SYSTEM"]
  character(*), parameter :: of_section(5) = [character(26) :: "SOLID SECTION", &
    "SECTION CONTROLS", "HOURGLASS", "HOURGLASS STIFFNESS", "TRANSVERSE SHEAR STIFFNESS"]
  character(*), parameter :: of_step(5) = [character(18) :: "CONTROLS", &
    "SOLUTION TECHNIQUE", "PREPRINT", "RESTART", "MONITOR"]
  character(*), parameter :: of_output(15) = [character(21) :: "FILE OUTPUT", &
    "FIELD OUTPUT", "HISTORY OUTPUT", "ELEMENT OUTPUT", "NODE OUTPUT", &
    "CONTACT OUTPUT", "ENERGY OUTPUT", "INCREMENTATION OUTPUT", "NODE PRINT", "EL PRINT", &
    "ENERGY PRINT", "NODE FILE", "EL FILE", "ENERGY FILE", "DIAGNOSTICS"]
  character(*), parameter :: of_heat(3) = [character(13) :: "EXPANSION", "CONDUCTIVITY", &
    "SPECIFIC HEAT"]
  character(*), parameter :: of_contact(9) = [character(19) :: "SURFACE INTERACTION", &
    "FRICTION", "SURFACE BEHAVIOR", "CONTACT", "CONTACT INCLUSIONS", "CONTACT CONTROLS", &
    "CONTACT DAMPING", "CONTACT PROPERTY", "SURFACE"]
  character(*), parameter :: of_tools(3) = [character(13) :: "RIGID BODY", "RIGID SURFACE", "MASS"]
  character(*), parameter :: of_loads(4) = [character(8) :: "CLOAD", "DLOAD", "DSLOAD", "VELOCITY"]
  ! How keywords of LS-DYNA begin; not of a keyword of this program with an error.
  character(*), parameter :: of_dyna(10) = [character(20) :: "MAT", "DATABASE", "DEFINE", "LOAD", &
    "SECTION", "CONTROL TIMESTEP", "CONTROL BULK", "CONTROL DYNAMIC", "CONTACT FORMING", &
    "BOUNDARY PRESCRIBED"]

contains

  !> Check all blocks of a deck against `deck%keywords`; the deck moves from `lexed` into `deck`.
  subroutine check_records(lexed, deck, errors)
    type(lexed_deck_t), intent(inout) :: lexed   !! empty afterwards
    type(parsed_deck_t), intent(inout) :: deck   !! on entry its keywords
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: starts(:)
    integer :: i, owner, n_before

    call move_alloc(lexed%files, deck%lexed%files)
    call move_alloc(lexed%blocks, deck%lexed%blocks)
    call move_alloc(lexed%characters, deck%lexed%characters)
    deck%lexed%n_blocks = lexed%n_blocks
    deck%lexed%n_characters = lexed%n_characters
    deck%lexed%end_line = lexed%end_line
    deck%lexed%lines = lexed%lines
    allocate (deck%records(deck%lexed%n_blocks))
    owner = 0
    do i = 1, size(deck%records)
      associate (block => deck%lexed%blocks(i), record => deck%records(i))
        record%origin = new_origin(deck%lexed%files(block%file)%value, block%line, &
                                 "*"//block%keyword)
        n_before = errors%n_items
        call find_keyword(block, deck%keywords, record, errors)
        if (record%spec > 0) then
          call rename_options(deck%keywords(record%spec), record%origin, block, errors)
          call find_owner(deck, i, owner, errors)
          call check_options(block, deck%keywords(record%spec), record, errors)
        end if
      end associate
      if (is_unnamed_table(deck, i)) then
        call add_error(errors, deck%records(i)%origin, "points of a curve without HARDENING", &
                       "*PLASTIC, HARDENING=TABLE for lines of stress and plastic strain; "// &
                       "without it, one line of sigma_0, Q, b (VOCE)")
      else if (has_known_type(deck, i)) then
        call check_lines(deck, i, errors)
      end if
      deck%records(i)%is_valid = errors%n_items == n_before
    end do
    starts = find_records(deck, "STEP")
    deck%records%step = [(count(starts <= i), i=1, size(deck%records))]
    call check_uniqueness(deck, errors)
  end subroutine check_records

  !> The entry of a keyword. One that goes by its alias gets its name; messages keep what the deck
  !! says.
  pure subroutine find_keyword(block, keywords, record, errors)
    type(block_t), intent(inout) :: block
    type(keyword_spec_t), intent(in) :: keywords(:)
    type(record_t), intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    type(string_t), allocatable :: names(:), present_names(:)
    integer :: i

    do i = 1, size(keywords)
      if (keywords(i)%name == block%keyword) record%spec = i
    end do
    do i = 1, size(keywords)
      if (record%spec > 0 .or. keywords(i)%alias == "") cycle
      if (keywords(i)%alias /= block%keyword) cycle
      record%spec = i
      block%keyword = keywords(i)%name
    end do
    if (foreign_note(block) /= "") then
      record%spec = 0
      if (any(block%keyword == of_section) .and. option_place(block, "ORIENTATION") > 0) then
        call add_error(errors, record%origin, "the option ORIENTATION, which is not honoured "// &
                       "here", "none, and axes of the material by *ORIENTATION in *MATERIAL "// &
                       "with *PLASTIC; a user's law works in x, y, z (see "// &
                       "docs/user-materials.md)")
      else
        call add_warning(errors, record%origin, "a keyword that is ignored here", &
                         foreign_note(block))
      end if
    end if
    if (record%spec > 0 .or. foreign_note(block) /= "") return
    if (counterpart(block%keyword) /= "") then
      call add_error(errors, record%origin, "an unknown keyword", counterpart(block%keyword))
      return
    end if
    allocate (names(2*size(keywords)), present_names(2*size(keywords)))
    do i = 1, size(keywords)
      present_names(2*i - 1)%value = "*"//keywords(i)%name
      present_names(2*i) = present_names(2*i - 1)
      names(2*i - 1:2*i) = present_names(2*i - 1:2*i)
      if (keywords(i)%alias /= "") names(2*i)%value = "*"//keywords(i)%alias
    end do
    call add_error(errors, record%origin, "an unknown keyword", "a keyword of "// &
                   "input/KEYWORDS.md"//did_you_mean("*"//block%keyword, names, present_names))
  end subroutine find_keyword

  !> Give options that go by another name the one of the table.
  pure subroutine rename_options(spec, origin, block, errors)
    type(keyword_spec_t), intent(in) :: spec
    type(origin_t), intent(in) :: origin
    type(block_t), intent(inout) :: block
    type(error_list_t), intent(inout) :: errors
    integer :: i, place

    do i = 1, size(spec%options)
      if (spec%options(i)%alias == "") cycle
      place = option_place(block, spec%options(i)%alias)
      if (place == 0) cycle
      if (option_place(block, spec%options(i)%name) > 0) then
        call add_error(errors, origin, "both "//spec%options(i)%name//" and "// &
                       spec%options(i)%alias, "the option once")
      end if
      block%options(place)%name = spec%options(i)%name
    end do
  end subroutine rename_options

  !> Keep track of the keyword that others such as *DENSITY belong to.
  pure subroutine find_owner(deck, i, owner, errors)
    type(parsed_deck_t), intent(inout) :: deck
    integer, intent(in) :: i         !! record in hand
    integer, intent(inout) :: owner  !! last record that may have others behind it, 0: none
    type(error_list_t), intent(inout) :: errors
    logical :: is_there

    associate (record => deck%records(i))
      associate (spec => deck%keywords(record%spec))
        if (spec%parent == "") then
          if (spec%place /= anywhere) owner = i
          return
        end if
        is_there = owner > 0
        if (is_there) is_there = deck%records(owner)%origin%keyword == "*"//spec%parent
        if (is_there) then
          record%parent = owner
        else
          call add_error(errors, record%origin, "no *"//spec%parent//" that it belongs to", &
                         "it directly after *"//spec%parent)
        end if
      end associate
    end associate
  end subroutine find_owner

  subroutine check_options(block, spec, record, errors)
    type(block_t), intent(in) :: block
    type(keyword_spec_t), intent(in) :: spec
    type(record_t), intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    type(string_t) :: names(size(spec%options)), aliases(size(spec%options))
    character(:), allocatable :: known
    integer :: i

    allocate (record%options(size(spec%options)))
    do i = 1, size(spec%options)
      names(i)%value = spec%options(i)%name
      aliases(i)%value = spec%options(i)%alias
      call check_option(block, spec%options(i), record%origin, record%options(i), errors)
    end do
    known = joined(names, ", ")
    if (known == "") known = "no option"
    do i = 1, size(block%options)
      associate (name => block%options(i)%name)
        if (is_among(name, names)) then
          cycle
        else if (is_list_entry(block, spec, i)) then
          if (is_list_entry(block, spec, i - 1)) cycle
          call add_error(errors, record%origin, "the option "//name, &
                         "a list in quotes: "//quoted_list(block, spec, i - 1))
        else
          call add_error(errors, record%origin, "the unknown option "//name, &
                         known//did_you_mean(name, [names, aliases], [names, names]))
        end if
      end associate
    end do
  end subroutine check_options

  !> Is option `i` an entry of a list that should stand in quotes?
  pure logical function is_list_entry(block, spec, i)
    type(block_t), intent(in) :: block
    type(keyword_spec_t), intent(in) :: spec
    integer, intent(in) :: i
    integer :: o

    is_list_entry = .false.
    if (i < 2) return
    associate (name => block%options(i)%name)
      if (len(name) > 0) is_list_entry = verify(name(1:1), "0123456789") == 0
      do o = 1, size(spec%options)
        if (spec%options(o)%kind == kind_list) is_list_entry = is_list_entry .or. &
          is_among(name, choice_list(spec%options(o)%allowed))
      end do
    end associate
  end function is_list_entry

  !> Option `i` with the entries behind it as one list.
  pure function quoted_list(block, spec, i) result(option)
    type(block_t), intent(in) :: block
    type(keyword_spec_t), intent(in) :: spec
    integer, intent(in) :: i
    character(:), allocatable :: option
    integer :: j

    option = block%options(i)%name//"="""//block%options(i)%value
    do j = i + 1, size(block%options)
      if (.not. is_list_entry(block, spec, j)) exit
      option = option//","//block%options(j)%name
    end do
    option = option//""""
  end function quoted_list

  subroutine check_option(block, spec, origin, option, errors)
    type(block_t), intent(in) :: block
    type(value_spec_t), intent(in) :: spec
    type(origin_t), intent(in) :: origin
    type(option_t), intent(out) :: option
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: found, expected
    real(wp) :: number
    integer :: place

    place = option_place(block, spec%name)
    option%name = spec%name
    option%value = spec%default
    option%is_given = place > 0 .or. option%value /= ""
    expected = spec%name//"="//spec%allowed
    if (place == 0) then
      if (spec%is_required) call add_error(errors, origin, "no option "//spec%name, expected)
    else if (spec%kind == kind_flag) then
      if (block%options(place)%has_value) &
        call add_error(errors, origin, spec%name//" with a value", spec%name//" alone")
      option%value = block%options(place)%value
    else
      option%value = block%options(place)%value
      if (option%value /= "") &
        call check_field(spec, squeezed(option%value), number, option%value, found, expected)
      if (option%value == "") then
        ! Where one value alone is allowed and it is the default, it goes without saying.
        if (spec%default == "" .or. spec%default /= spec%allowed) &
          found = spec%name//" without a value"
        option%value = spec%default
      end if
      if (allocated(found)) call add_error(errors, origin, found, expected)
    end if
  end subroutine check_option

  !> Is it clear what data lines the record should have?
  pure logical function has_known_type(deck, i)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: i   !! record in hand
    integer :: place

    has_known_type = deck%records(i)%spec > 0
    if (.not. has_known_type) return
    associate (spec => deck%keywords(deck%records(i)%spec), record => deck%records(i))
      do place = 1, size(spec%options)
        if (.not. selects_lines(spec%options(place))) cycle
        if (.not. (record%options(place)%is_given .or. spec%options(place)%is_required)) cycle
        has_known_type = is_among(record%options(place)%value, &
                                  choice_list(spec%options(place)%allowed))
      end do
    end associate
  end function has_known_type

  !> Are these the points of *PLASTIC as Abaqus has them, whose curve is a table unless it says
  !! otherwise?
  pure logical function is_unnamed_table(deck, i)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: i   !! record in hand
    integer, allocatable :: first(:), last(:)

    is_unnamed_table = .false.
    associate (block => deck%lexed%blocks(i))
      if (block%keyword /= "PLASTIC" .or. block%last < block%first) return
      if (option_place(block, "HARDENING") > 0) return
      call split_fields(line_text(deck%lexed%lines, block%first), first, last)
      is_unnamed_table = size(first) == 2
    end associate
  end function is_unnamed_table

  !> Give each data line its form and check its fields.
  subroutine check_lines(deck, i, errors)
    type(parsed_deck_t), intent(inout) :: deck
    integer, intent(in) :: i   !! record in hand
    type(error_list_t), intent(inout) :: errors
    integer :: form, done, n_taken, n_of_form, line, n_before

    associate (spec => deck%keywords(deck%records(i)%spec), record => deck%records(i))
      record%first_line = deck%lexed%blocks(i)%first
      record%n_lines = deck%lexed%blocks(i)%last - record%first_line + 1
      do form = 1, size(spec%lines)
        if (record%n_lines > 0 .or. .not. is_asked_for(record, spec, spec%lines(form))) cycle
        if (may_be_left_out(spec%lines(form))) record%n_lines = 1   ! an empty one in its place
      end do
      call find_joined(deck, record, spec)
      allocate (record%first(record%n_lines + 1), record%fields(4*record%n_lines))
      record%first(1) = 1
      n_before = errors%n_items
      done = 0
      do form = 1, size(spec%lines)
        if (.not. is_asked_for(record, spec, spec%lines(form))) cycle
        n_taken = min(record%n_lines - done, spec%lines(form)%n_max)
        n_of_form = done + n_taken
        do line = done + 1, n_of_form
          if (errors%n_items - n_before >= most_errors) then
            record%first(line + 1:) = record%first(line)
            return
          end if
          call check_line(deck, i, line, spec%lines(form), errors)
        end do
        done = n_of_form
        if (n_taken < spec%lines(form)%n_min .and. spec%place /= anywhere) then
          call add_error(errors, record%origin, counted(n_taken, "data line"), &
                         wanted(spec%lines(form)))
          return
        end if
      end do
      if (done < record%n_lines) then
        call add_error(errors, line_origin(deck, record, done + 1), "a data line too many", &
                       counted(done, "data line"))
        record%first(done + 2:) = record%first(done + 1)
      end if
    end associate
  end subroutine check_lines

  !> Does the end of a data line stand for the line behind it? Both forms are one line each, and so
  !! are those before.
  subroutine find_joined(deck, record, spec)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(inout) :: record
    type(keyword_spec_t), intent(in) :: spec
    integer, allocatable :: first(:), last(:)
    integer :: form, line, n_before

    line = 0
    n_before = huge(n_before)   ! no line before the first whose end could stand for it
    do form = 1, size(spec%lines)
      if (.not. is_asked_for(record, spec, spec%lines(form))) cycle
      if (spec%lines(form)%is_joinable) then
        call split_fields(line_text(deck%lexed%lines, line_place(record, line)), first, last)
        if (size(first) > n_before) then
          record%joined = line
          record%n_lines = record%n_lines + 1
          exit
        end if
      end if
      line = line + 1
      if (line > record%n_lines) exit
      n_before = size(spec%lines(form)%fields)
    end do
  end subroutine find_joined

  !> Is this form of data lines there for the TYPE (or HARDENING) of the record?
  pure logical function is_asked_for(record, spec, line)
    type(record_t), intent(in) :: record
    type(keyword_spec_t), intent(in) :: spec
    type(line_spec_t), intent(in) :: line
    integer :: place

    is_asked_for = line%when == ""
    do place = 1, size(spec%options)
      if (.not. selects_lines(spec%options(place))) cycle
      if (record%options(place)%is_given .and. .not. is_asked_for) &
        is_asked_for = is_among(record%options(place)%value, choice_list(line%when))
    end do
  end function is_asked_for

  subroutine check_line(deck, i, line, form, errors)
    type(parsed_deck_t), intent(inout) :: deck
    integer, intent(in) :: i, line
    type(line_spec_t), intent(in) :: form
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: first(:), last(:)
    character(:), allocatable :: given, field
    integer :: j, n, place

    given = ""
    place = line_place(deck%records(i), line)
    if (place <= deck%lexed%blocks(i)%last) given = line_text(deck%lexed%lines, place)
    if (form%fields(1)%kind == kind_words) then
      first = [1]
      last = [len(given)]
    else
      call split_fields(given, first, last)
      call take_part(deck%records(i), line, size(form%fields), first, last)
    end if
    n = size(first)
    if (n > size(form%fields) .and. .not. form%is_repeated) then
      call add_error(errors, line_origin(deck, deck%records(i), line), counted(n, "field"), &
                     counted(size(form%fields), "field")//": "//field_names(form)// &
                     decimal_note(form, given))
      n = size(form%fields)
    end if
    place = deck%records(i)%first(line)
    deck%records(i)%first(line + 1) = place + max(n, size(form%fields))
    call make_room(deck%records(i), deck%records(i)%first(line + 1) - 1)
    do j = 1, max(n, size(form%fields))
      field = ""
      if (j <= n) field = field_text(given, first(j), last(j))
      call take_field(deck, i, line, form%fields(min(j, size(form%fields))), place + j - 1, field, &
                      errors)
    end do
  end subroutine check_line

  !> A hint at a comma between digits, which may be meant as a decimal point where a line has
  !! fields that take decimals.
  pure function decimal_note(form, line) result(note)
    type(line_spec_t), intent(in) :: form
    character(*), intent(in) :: line
    character(:), allocatable :: note
    character(*), parameter :: digits = "0123456789"
    integer :: i

    note = ""
    if (.not. any(form%fields%kind == kind_real)) return
    do i = 2, len(line) - 1
      if (line(i:i) == "," .and. scan(line(i - 1:i - 1), digits) == 1 .and. &
          scan(line(i + 1:i + 1), digits) == 1) note = "; a comma separates fields, and "// &
                                                       "decimals follow a point, as in 0.3"
    end do
  end function decimal_note

  !> Of the fields of a line that has the next one at its end, those of the line in hand.
  pure subroutine take_part(record, line, n_fields, first, last)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, n_fields
    integer, allocatable, intent(inout) :: first(:), last(:)
    integer :: n_before

    if (record%joined == 0) return
    if (line == record%joined) then
      first = first(:n_fields)
      last = last(:n_fields)
    else if (line == record%joined + 1) then
      n_before = record%first(line) - record%first(line - 1)
      first = first(n_before + 1:)
      last = last(n_before + 1:)
    end if
  end subroutine take_part

  subroutine take_field(deck, i, line, spec, place, given, errors)
    type(parsed_deck_t), intent(inout) :: deck
    integer, intent(in) :: i, line, place
    type(value_spec_t), intent(in) :: spec
    character(*), intent(in) :: given
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: found, expected

    associate (record => deck%records(i), field => deck%records(i)%fields(place))
      field%is_filled = given /= "" .or. spec%default /= ""
      if (given /= "") then
        call check_field(spec, given, field%number, field%word, found, expected)
      else if (spec%default /= "") then
        call check_field(spec, spec%default, field%number, field%word, found, expected)
      else if (spec%is_required) then
        found = "no "//spec%name
        expected = spec%allowed
      end if
      if (allocated(found)) then
        call add_error(errors, line_origin(deck, record, line), found, expected)
      end if
    end associate
  end subroutine take_field

  !> Let a record hold `n` fields, growing by doubling.
  pure subroutine make_room(record, n)
    type(record_t), intent(inout) :: record
    integer, intent(in) :: n
    type(field_t), allocatable :: longer(:)

    if (n <= size(record%fields)) return
    allocate (longer(2*n))
    longer(:size(record%fields)) = record%fields
    call move_alloc(longer, record%fields)
  end subroutine make_room

  pure subroutine check_uniqueness(deck, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, j

    do i = 1, size(deck%keywords)
      if (.not. deck%keywords(i)%is_unique) cycle
      found = find_records(deck, deck%keywords(i)%name)
      do j = 2, size(found)
        if (all(deck%records(found(:j - 1))%step /= deck%records(found(j))%step)) cycle
        call add_error(errors, deck%records(found(j))%origin, "the keyword a second time", &
                       "one *"//deck%keywords(i)%name//" in the deck"// &
                       trim(merge(", or in a step", "              ", n_deck_steps(deck) > 0)))
      end do
    end do
  end subroutine check_uniqueness

  !> Why the keyword is not needed here; empty if it is no such keyword.
  pure function foreign_note(block) result(note)
    type(block_t), intent(in) :: block
    character(:), allocatable :: note

    note = ""
    if (any(block%keyword == of_model)) then
      note = "the mesh is that of *BLANK"
    else if (any(block%keyword == of_section)) then
      note = "*BLANK names its material and consists of solid elements"
    else if (any(block%keyword == of_step)) then
      note = "*DYNAMIC, EXPLICIT and *STATIC say how a step is solved"
    else if (any(block%keyword == of_output) .or. is_other_output(block)) then
      note = "*OUTPUT, FRAMES=n, HISTORY=n says what is written"
    else if (block%keyword == "PHYSICAL CONSTANTS") then
      note = "nothing here needs absolute zero, radiation or the gas constant"
    else if (any(block%keyword == of_heat)) then
      note = "heat is not conducted and no strain of expansion arises; *ADIABATIC HEATING "// &
             "heats by plastic work"
    end if
    if (note /= "") note = "none, for "//note//": it and its lines are ignored"
  end function foreign_note

  !> What does here what a keyword of Abaqus or LS-DYNA does there; empty where nothing is known.
  pure function counterpart(keyword) result(hint)
    character(*), intent(in) :: keyword
    character(:), allocatable :: hint
    integer :: i

    hint = ""
    if (any(keyword == of_mesh)) then
      hint = "*BLANK, which makes its own elements; the mesh of another program is not read"
    else if (any(keyword == of_contact)) then
      hint = "*CONTACT PAIR, TOOL=name, with options such as FACE, FRICTION and DAMPING"
    else if (any(keyword == of_tools)) then
      hint = "*TOOL, which is rigid; MASS of *TOOL FORCE where a force moves it"
    else if (any(keyword == of_loads)) then
      hint = "*TOOL MOTION or *TOOL FORCE for tools, *PRESSURE, *TRACTION, *GRAVITY or "// &
             "*BOUNDARY for the blank"
    else if (keyword == "CONTROL TERMINATION") then
      hint = "*DYNAMIC, EXPLICIT in each *STEP, with its duration on the data line"
    else if (any([(index(keyword, trim(of_dyna(i))//" ") == 1, i=1, size(of_dyna))])) then
      hint = "a keyword of input/KEYWORDS.md; docs/keyword-map.md has those that replace "// &
             "keywords of LS-DYNA"
    end if
  end function counterpart

  !> *OUTPUT as Abaqus has it: with FIELD or a lone HISTORY.
  pure logical function is_other_output(block) result(is_other)
    type(block_t), intent(in) :: block
    integer :: place

    is_other = .false.
    if (block%keyword /= "OUTPUT") return
    is_other = option_place(block, "FIELD") > 0 .or. option_place(block, "DIAGNOSTICS") > 0
    place = option_place(block, "HISTORY")
    if (place > 0) is_other = is_other .or. .not. block%options(place)%has_value
  end function is_other_output

end module record_check
