!> Keyword blocks after their check against the keyword table: options and fields by name and place.
module deck_records
  use kinds, only: wp
  use input_errors, only: origin_t, new_origin
  use text, only: string_t, read_real
  use keyword_spec, only: keyword_spec_t, option_index
  use lexer, only: lexed_deck_t
  implicit none
  private

  public :: record_t, parsed_deck_t, find_records, is_option_given, option_text, option_real
  public :: option_integer, line_origin, line_place, deck_end, n_fields, field_real, field_integer
  public :: field_word, is_filled, all_numbers

  !> One keyword block. Field `j` of line `i` is entry `first(i) + j - 1` of the last three lists.
  type :: record_t
    type(origin_t) :: origin
    integer :: spec = 0                        !! index of the keyword, 0: unknown keyword
    integer :: parent = 0                      !! record of the keyword that this one follows
    integer :: step = 0                        !! place of the *STEP that it stands in, 0: none
    logical :: is_valid = .true.               !! no error in it so far
    type(string_t), allocatable :: options(:)  !! in the order of the table, defaults filled in
    logical, allocatable :: is_given(:)        !! which options the deck gives or have a default
    integer :: n_lines = 0
    integer :: first_line = 1                  !! of the data lines in the deck's list
    integer :: joined = 0                      !! line that has the next one at its end, 0: none
    integer, allocatable :: first(:)           !! shape (n_lines + 1)
    real(wp), allocatable :: numbers(:)        !! of number fields
    type(string_t), allocatable :: words(:)    !! of other fields
    logical, allocatable :: is_filled(:)       !! given or by default
  end type record_t

  !> A whole deck; `records(i)` comes from block `i` of the lexer.
  type :: parsed_deck_t
    type(lexed_deck_t) :: lexed
    type(keyword_spec_t), allocatable :: keywords(:)   !! all that a deck may have
    type(record_t), allocatable :: records(:)
  end type parsed_deck_t

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
  pure logical function is_option_given(deck, record, name)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name   !! an option of the record's keyword

    is_option_given = record%is_given(option_index(deck%keywords(record%spec), name))
  end function is_option_given

  !> Value of an option, its default, or nothing.
  pure function option_text(deck, record, name) result(value)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name   !! an option of the record's keyword
    character(:), allocatable :: value
    integer :: place

    place = option_index(deck%keywords(record%spec), name)
    value = ""
    if (record%is_given(place)) value = record%options(place)%value
  end function option_text

  !> Value of a number option; 0 where there is none.
  pure real(wp) function option_real(deck, record, name)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name   !! an option of the record's keyword
    logical :: is_number

    call read_real(option_text(deck, record, name), option_real, is_number)
  end function option_real

  !> Value of a whole-number option; 0 where there is none.
  pure integer function option_integer(deck, record, name)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name   !! an option of the record's keyword

    option_integer = nint(option_real(deck, record, name))
  end function option_integer

  !> Where a data line stands.
  pure function line_origin(deck, record, line) result(origin)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line   !! from 1 to `record%n_lines`
    type(origin_t) :: origin
    integer :: place

    place = line_place(record, line)
    origin = new_origin(deck%lexed%files(deck%lexed%lines%file(place))%value, &
                      deck%lexed%lines%number(place), record%origin%keyword)
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

    field_real = record%numbers(record%first(line) + field - 1)
  end function field_real

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

    word = record%words(record%first(line) + field - 1)%value
  end function field_word

  !> Does a field hold anything, if only its default?
  pure logical function is_filled(record, line, field)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, field

    is_filled = record%is_filled(record%first(line) + field - 1)
  end function is_filled

  !> The numbers of all lines one after the other.
  pure function all_numbers(record) result(numbers)
    type(record_t), intent(in) :: record
    real(wp), allocatable :: numbers(:)

    numbers = record%numbers(:record%first(record%n_lines + 1) - 1)
  end function all_numbers

end module deck_records
