!> Keyword blocks after their check against the keyword table: options and fields by name and place;
!! in which step they are; and what the readers of keywords share: the names that a deck defines,
!! how the blank lies in space, and which records describe which patch. Case does not matter in
!! names.
module deck_records
  use kinds, only: wp
  use input_errors, only: origin_t, new_origin, error_list_t, add_error, add_warning
  use text, only: read_real, upper_case, to_text, squeezed
  use keyword_spec, only: keyword_spec_t, did_you_mean, names_material, names_curve, &
                          names_patch, names_tool, names_set, names_point
  use lexer, only: lexed_deck_t
  use knot_vector, only: knot_vector_t
  use name_table, only: name_table_t, insert, place_of, note_use
  implicit none
  private

  public :: record_t, option_t, field_t, parsed_deck_t, find_records
  public :: option_text, option_real, option_integer, is_option_given
  public :: n_fields, field_real, field_vector, field_integer, field_word, is_filled, all_numbers
  public :: line_origin, line_place, deck_end, n_data_lines, check_lines
  public :: n_deck_steps, step_of, first_record, end_before
  public :: deck_context_t, deck_names_t, box_frame_t, patch_parts_t
  public :: enter_names, enter_name, resolve, resolve_option, check_uses

  !> An option of a keyword, by its present name.
  type :: option_t
    character(:), allocatable :: name, value   !! or the default
    logical :: is_given = .false.              !! by the deck or by default
  end type option_t

  !> A field of a data line.
  type :: field_t
    real(wp) :: number = 0.0_wp              !! of a number field
    character(:), allocatable :: word        !! of another field
    logical :: is_filled = .false.           !! given or by default
  end type field_t

  !> One keyword block. Field `j` of line `i` is entry `first(i) + j - 1` of its fields.
  type :: record_t
    type(origin_t) :: origin
    integer :: spec = 0                        !! index of the keyword, 0: unknown keyword
    integer :: parent = 0                      !! record of the keyword that this one follows
    integer :: step = 0                        !! place of the *STEP that it stands in, 0: none
    logical :: is_valid = .true.               !! no error in it so far
    type(option_t), allocatable :: options(:)  !! in the order of the table
    integer :: n_lines = 0
    integer :: first_line = 1                  !! of the data lines in the deck's list
    integer :: joined = 0                      !! line that has the next one at its end, 0: none
    integer, allocatable :: first(:)           !! shape (n_lines + 1)
    type(field_t), allocatable :: fields(:)    !! longer than what the record holds
  end type record_t

  !> A whole deck; `records(i)` comes from block `i` of the lexer.
  type :: parsed_deck_t
    type(lexed_deck_t) :: lexed
    type(keyword_spec_t), allocatable :: keywords(:)   !! all that a deck may have
    type(record_t), allocatable :: records(:)
  end type parsed_deck_t

  !> Upper-case names; the place of a name is the place of the thing in its list of the scene.
  type :: deck_names_t
    type(name_table_t) :: materials, curves, tools, sets, points
    type(name_table_t) :: patches   !! the blank, its patches and all tools
  end type deck_names_t

  !> Fraction of the length along one axis as a spline of its parametric coordinate.
  type :: box_line_t
    type(knot_vector_t) :: knots
    real(wp), allocatable :: shares(:)    !! at the control points, 0 to 1
  end type box_line_t

  !> How a box blank lies in space: what maps coordinates to parametric coordinates. A blank that
  !! is missing or has errors counts as a box, so that it causes no further errors.
  type :: box_frame_t
    logical :: is_box = .true.
    integer :: axis_of(3) = [1, 2, 3]     !! coordinate along which each parametric axis runs
    real(wp) :: from(3) = 0.0_wp          !! that coordinate where the parametric one is 0
    real(wp) :: to(3) = 1.0_wp            !! and where it is 1
    type(box_line_t) :: lines(3)          !! of a box with evenly spaced control points
  end type box_frame_t

  !> Records that list parts of a patch, in the order of the deck.
  type :: patch_parts_t
    integer, allocatable :: knots(:), points(:), refinements(:)
  end type patch_parts_t

  !> What readers know from the keywords before theirs.
  type :: deck_context_t
    type(deck_names_t) :: names
    type(box_frame_t) :: frame                      !! from *BLANK on
    type(patch_parts_t), allocatable :: parts(:)    !! by place in `names%patches`, from *BLANK on
    logical :: is_check = .false.                   !! the scene is for a report without a run
  end type deck_context_t

contains

  !> Records of one keyword in the order of the deck.
  pure function find_records(deck, keyword) result(found)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword   !! upper case, without the star
    integer, allocatable :: found(:)
    integer :: i, spec

    spec = 0
    do i = 1, size(deck%keywords)
      if (deck%keywords(i)%name == keyword) spec = i
    end do
    found = pack([(i, i=1, size(deck%records))], deck%records%spec == spec)
  end function find_records

  !> Does the record have a value for the option, or the flag?
  pure logical function is_option_given(record, name)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name   !! an option of the record's keyword

    is_option_given = record%options(place_in(record, name))%is_given
  end function is_option_given

  !> Value of an option, its default, or nothing.
  pure function option_text(record, name) result(value)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name   !! an option of the record's keyword
    character(:), allocatable :: value

    value = ""
    associate (option => record%options(place_in(record, name)))
      if (option%is_given) value = option%value
    end associate
  end function option_text

  pure integer function place_in(record, name) result(place)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name

    do place = size(record%options), 1, -1
      if (record%options(place)%name == name) exit
    end do
  end function place_in

  !> Value of a number option; 0 where there is none.
  pure real(wp) function option_real(record, name)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name   !! an option of the record's keyword
    logical :: is_number

    call read_real(option_text(record, name), option_real, is_number)
  end function option_real

  !> Value of a whole-number option; 0 where there is none.
  pure integer function option_integer(record, name)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name   !! an option of the record's keyword

    option_integer = nint(option_real(record, name))
  end function option_integer

  !> Where a data line stands.
  pure function line_origin(deck, record, line) result(origin)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line   !! from 1 to `record%n_lines`
    type(origin_t) :: origin

    associate (place => deck%lexed%lines%items(line_place(record, line)))
      origin = new_origin(deck%lexed%files(place%file)%value, place%number, record%origin%keyword)
    end associate
  end function line_origin

  !> Place of a data line in the deck's list.
  pure integer function line_place(record, line) result(place)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line   !! from 1 to `record%n_lines`

    place = record%first_line + line - 1
    if (record%joined > 0 .and. line > record%joined) place = place - 1
  end function line_place

  !> The last line of the deck, for what it does not have.
  pure function deck_end(deck) result(origin)
    type(lexed_deck_t), intent(in) :: deck
    type(origin_t) :: origin

    origin = new_origin(deck%files(1)%value, deck%end_line, "")
  end function deck_end

  !> Number of fields of a data line.
  pure integer function n_fields(record, line)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line

    n_fields = record%first(line + 1) - record%first(line)
  end function n_fields

  !> A number field.
  pure real(wp) function field_real(record, line, field)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field

    field_real = record%fields(record%first(line) + field - 1)%number
  end function field_real

  !> Three number fields from `field` on.
  pure function field_vector(record, line, field) result(vector)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field
    real(wp) :: vector(3)

    associate (place => record%first(line) + field - 1)
      vector = record%fields(place:place + 2)%number
    end associate
  end function field_vector

  !> A whole-number field.
  pure integer function field_integer(record, line, field)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field

    field_integer = nint(field_real(record, line, field))
  end function field_integer

  !> A field that is a name, a choice or a line of words.
  pure function field_word(record, line, field) result(word)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field
    character(:), allocatable :: word

    word = record%fields(record%first(line) + field - 1)%word
  end function field_word

  !> Does a field hold anything, if only its default?
  pure logical function is_filled(record, line, field)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field

    is_filled = record%fields(record%first(line) + field - 1)%is_filled
  end function is_filled

  !> The numbers of all lines one after the other.
  pure function all_numbers(record) result(numbers)
    type(record_t), intent(in) :: record
    real(wp), allocatable :: numbers(:)

    numbers = record%fields(:record%first(record%n_lines + 1) - 1)%number
  end function all_numbers

  !> Enter the NAME options of all records of a keyword into the table that its entry asks for. A
  !! *TOOL is a patch too; one that is a component of another tool is no tool of its own.
  subroutine enter_names(deck, spec, names, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: spec                   !! index of the keyword
    type(deck_names_t), intent(inout) :: names
    type(error_list_t), intent(inout) :: errors
    type(error_list_t) :: known   ! what the names of patches have shown already
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, deck%keywords(spec)%name)
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        select case (deck%keywords(spec)%names)
        case (names_material); call enter_name(record, names%materials, errors)
        case (names_curve); call enter_name(record, names%curves, errors)
        case (names_patch); call enter_name(record, names%patches, errors)
        case (names_set); call enter_name(record, names%sets, errors)
        case (names_point); call enter_name(record, names%points, errors)
        case (names_tool)
          call enter_name(record, names%patches, errors)
          if (.not. is_option_given(record, "COMPONENT OF")) &
            call enter_name(record, names%tools, known)
        end select
      end associate
    end do
  end subroutine enter_names

  !> Enter one name. A record without a new name takes a place too, under a name none can write.
  !! Names become those of groups in the result file, where slashes and lone points have a meaning.
  subroutine enter_name(record, names, errors)
    type(record_t), intent(in) :: record
    type(name_table_t), intent(inout) :: names
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: name, given
    logical :: is_new

    given = squeezed(option_text(record, "NAME"))
    name = upper_case(given)
    is_new = .false.
    if (name /= "") call insert(names, name, is_new)
    if (name /= "" .and. (scan(name, "/") > 0 .or. verify(name, ".") == 0)) then
      call add_error(errors, record%origin, "the name "//given, "a name without slashes that "// &
                     "is not made of points alone")
    end if
    if (is_new) return
    if (name /= "") call add_error(errors, record%origin, "the name "//given// &
                                   " a second time", "a name of its own")
    call insert(names, "="//to_text(names%n_names), is_new)
  end subroutine enter_name

  !> Warn of materials, amplitudes and sets that nothing in the deck refers to: a name is misspelt
  !! or an option forgotten. Files that it includes may hold more than is needed. Names must have
  !! been resolved.
  subroutine check_uses(deck, names, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_names_t), intent(in) :: names
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(deck%records)
      if (deck%records(i)%spec == 0 .or. deck%lexed%blocks(i)%file > 1) cycle
      select case (deck%keywords(deck%records(i)%spec)%names)
      case (names_material); call warn_if_unused(deck%records(i), names%materials, errors)
      case (names_curve); call warn_if_unused(deck%records(i), names%curves, errors)
      case (names_set); call warn_if_unused(deck%records(i), names%sets, errors)
      end select
    end do
  end subroutine check_uses

  !> Warn of a record whose name is in the table, and which nothing has asked for.
  subroutine warn_if_unused(record, names, errors)
    type(record_t), intent(in) :: record
    type(name_table_t), intent(in) :: names
    type(error_list_t), intent(inout) :: errors
    integer :: place

    place = place_of(names, squeezed(upper_case(option_text(record, "NAME"))))
    if (place == 0) return
    if (.not. names%is_used(place)) call add_warning(errors, record%origin, "the name "// &
      option_text(record, "NAME")//", which nothing in the deck refers to", "a keyword that "// &
      "names it, or no "//record%origin%keyword)
  end subroutine warn_if_unused

  !> Place of the thing that goes by a name; 0 and an error if there is none.
  pure subroutine resolve(names, name, what, origin, place, errors)
    type(name_table_t), intent(inout) :: names
    character(*), intent(in) :: name
    character(*), intent(in) :: what   !! such as *MATERIAL
    type(origin_t), intent(in) :: origin
    integer, intent(out) :: place
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: hint

    place = place_of(names, squeezed(upper_case(name)))
    call note_use(names, place)
    if (place > 0) return
    hint = ""
    if (names%n_names > 0) hint = did_you_mean(name, names%names(:names%n_names))
    call add_error(errors, origin, "the unknown name "//name, "the name of a "//what//hint)
  end subroutine resolve

  !> Place of the thing that an option names; 0 if the option is not given or its name is unknown.
  pure subroutine resolve_option(record, option, names, what, place, errors)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: option
    type(name_table_t), intent(inout) :: names
    character(*), intent(in) :: what   !! such as *MATERIAL
    integer, intent(out) :: place
    type(error_list_t), intent(inout) :: errors

    place = 0
    if (.not. is_option_given(record, option)) return
    call resolve(names, option_text(record, option), what, record%origin, place, errors)
  end subroutine resolve_option

  !> Number of *STEP in the deck; a deck without has one step.
  pure integer function n_deck_steps(deck)
    type(parsed_deck_t), intent(in) :: deck

    n_deck_steps = size(find_records(deck, "STEP"))
  end function n_deck_steps

  !> Step with which begins what a record says.
  elemental integer function step_of(record_step) result(step)
    integer, intent(in) :: record_step   !! of the record, 0: before the first

    step = max(1, record_step)
  end function step_of

  !> The first record of a keyword, perhaps of those that begin with a step; 0 if there is none or
  !! it has errors.
  pure integer function first_record(deck, keyword, step) result(first)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    integer, intent(in), optional :: step
    integer, allocatable :: found(:)

    found = find_records(deck, keyword)
    if (present(step)) found = pack(found, step_of(deck%records(found)%step) == step)
    first = 0
    if (size(found) == 0) return
    if (deck%records(found(1))%is_valid) first = found(1)
  end function first_record

  !> Number of data lines of all records of a keyword.
  pure integer function n_data_lines(deck, keyword)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword

    n_data_lines = sum(deck%records(find_records(deck, keyword))%n_lines)
  end function n_data_lines

  !> Only a record with OP=NEW may have no data lines.
  subroutine check_lines(record, errors)
    type(record_t), intent(in) :: record
    type(error_list_t), intent(inout) :: errors

    if (record%n_lines > 0 .or. option_text(record, "OP") == "NEW") return
    call add_error(errors, record%origin, "0 data lines", "1 data line or more, or OP=NEW")
  end subroutine check_lines

  !> Last step of what earlier steps gave and this one removes; what the step itself gives stays.
  elemental integer function end_before(step, first_step, last_step) result(last)
    integer, intent(in) :: step, first_step, last_step

    last = last_step
    if (first_step < step) last = min(last, step - 1)
  end function end_before

end module deck_records
