!> How a keyword is described, and the check of one value against its description.
module keyword_spec
  use kinds, only: wp
  use text, only: string_t, read_real, read_integer, upper_case, squeezed, nearest_name, &
                  append_text, counted
  implicit none
  private

  public :: value_spec_t, line_spec_t, keyword_spec_t, selects_lines, may_be_left_out
  public :: check_field, choice_list, list_entries, is_among, did_you_mean, wanted
  public :: field_names, may_be_in_step

  integer, parameter, public :: kind_real = 1      !! a number
  integer, parameter, public :: kind_integer = 2   !! a whole number
  integer, parameter, public :: kind_name = 3      !! a name, or a short text in quotes
  integer, parameter, public :: kind_choice = 4    !! one of the words that are `allowed`
  integer, parameter, public :: kind_flag = 5      !! an option without a value
  integer, parameter, public :: kind_words = 6     !! a whole line of free text
  integer, parameter, public :: kind_list = 7      !! some of the words that are `allowed`

  integer, parameter, public :: any_number = huge(1)   !! no limit to the number of data lines

  !> Where a keyword may appear in a deck with steps; a deck without *STEP has no such rule.
  integer, parameter, public :: before_steps = 1    !! before the first *STEP
  integer, parameter, public :: in_first_step = 2   !! there or in the first step; applies in all
  integer, parameter, public :: in_any_step = 3     !! before the first *STEP or in any step
  integer, parameter, public :: inside_step = 4     !! in a step, if the deck has any
  integer, parameter, public :: needs_step = 5      !! in a step, which the deck must have
  integer, parameter, public :: bounds_step = 6     !! *STEP and *END STEP
  integer, parameter, public :: anywhere = 7        !! also between keyword and data lines

  !> What the NAME option of a keyword names: the table of names that it is entered into.
  integer, parameter, public :: names_nothing = 0, names_material = 1, names_curve = 2
  integer, parameter, public :: names_patch = 3, names_tool = 4, names_set = 5, names_point = 6

  !> An option of a keyword line or a field of a data line.
  type :: value_spec_t
    character(:), allocatable :: name
    character(:), allocatable :: alias     !! another name of an option, "": none
    integer :: kind = kind_real
    logical :: is_required = .true.
    character(:), allocatable :: default   !! value if the deck gives none, as a deck writes it
    character(:), allocatable :: unit
    character(:), allocatable :: allowed   !! such as `a number > 0` or `BOX, NURBS or DISK`
    character(:), allocatable :: range     !! of a number, such as `> 0` or `>= 1 and <= 5`
  end type value_spec_t

  !> Data lines of one form; the lines of a keyword follow each other in the order of the table.
  type :: line_spec_t
    character(:), allocatable :: when    !! values of TYPE or HARDENING, as `A or B`; "": always
    integer :: n_min = 1, n_max = 1      !! how many lines of this form
    logical :: is_repeated = .false.     !! the last field may be repeated any number of times
    logical :: is_joinable = .false.     !! may follow at the end of the line before
    type(value_spec_t), allocatable :: fields(:)
  end type line_spec_t

  !> One keyword, as the checks need it.
  type :: keyword_spec_t
    character(:), allocatable :: name    !! upper case, without the star
    character(:), allocatable :: alias   !! another name of the keyword, "": none
    character(:), allocatable :: parent  !! keyword that it must follow, "": none
    character(:), allocatable :: text    !! meaning
    character(:), allocatable :: page    !! all that `input/KEYWORDS.md` says of it
    logical :: is_unique = .false.       !! once in a deck, or in a step
    logical :: is_required = .false.     !! every deck must have it
    logical :: is_in_digest = .true.     !! a restart needs it unchanged
    integer :: place = before_steps      !! where it may appear, such as `in_any_step`
    integer :: names = names_nothing     !! what its NAME names, such as `names_tool`
    type(value_spec_t), allocatable :: options(:)
    type(line_spec_t), allocatable :: lines(:)
  end type keyword_spec_t

contains

  !> Does the value of this option decide which data lines follow?
  pure logical function selects_lines(option)
    type(value_spec_t), intent(in) :: option

    selects_lines = option%name == "TYPE" .or. option%name == "HARDENING"
  end function selects_lines

  !> Is the line optional, because every field of it has a default?
  pure logical function may_be_left_out(line)
    type(line_spec_t), intent(in) :: line
    integer :: i

    may_be_left_out = line%n_max == 1 .and. size(line%fields) > 0
    do i = 1, size(line%fields)
      may_be_left_out = may_be_left_out .and. line%fields(i)%default /= ""
    end do
  end function may_be_left_out

  !> Take the value of a field; what is wrong with it comes back in `found` and `expected`.
  pure subroutine check_field(spec, given, number, word, found, expected)
    type(value_spec_t), intent(in) :: spec
    character(*), intent(in) :: given
    real(wp), intent(out) :: number                          !! of a number field, else 0
    character(:), allocatable, intent(inout) :: word         !! set for all other fields
    character(:), allocatable, intent(inout) :: found, expected   !! set if there is an error
    real(wp), parameter :: longest = 1.0e50_wp   ! its sixth power, a squared volume, is a number
    type(string_t), allocatable :: wrong(:)      ! words
    integer :: whole
    logical :: is_good

    number = 0.0_wp
    is_good = .true.
    select case (spec%kind)
    case (kind_real)
      call read_real(given, number, is_good)
    case (kind_integer)
      call read_integer(given, whole, is_good)
      number = whole
    case (kind_choice, kind_list)
      word = squeezed(upper_case(given))
      wrong = strangers(word, spec)
      is_good = size(wrong) == 0
    case default
      word = given
    end select
    if (is_good .and. (spec%kind == kind_real .or. spec%kind == kind_integer)) then
      is_good = is_within(number, spec%range)
    end if
    if (is_good .and. .not. (spec%unit == "length" .and. abs(number) > longest)) return
    found = "`"//given//"` for "//spec%name
    expected = spec%allowed
    if (is_good) expected = "a length below 1e50"
    if (spec%kind == kind_list) expected = expected//", or several in quotes"
    if (allocated(wrong)) &
      expected = expected//did_you_mean(wrong(1)%value, choice_list(spec%allowed))
  end subroutine check_field

  !> The words of a choice or a list that are not allowed.
  pure function strangers(given, spec) result(words)
    character(*), intent(in) :: given
    type(value_spec_t), intent(in) :: spec
    type(string_t), allocatable :: words(:)
    type(string_t), allocatable :: entries(:)
    integer :: i

    if (spec%kind == kind_list) then
      entries = list_entries(given)
    else
      allocate (entries(1))
      entries(1)%value = given
    end if
    allocate (words(0))
    do i = 1, size(entries)
      if (.not. is_among(entries(i)%value, choice_list(spec%allowed))) &
        call append_text(words, entries(i)%value)
    end do
  end function strangers

  !> The words of a list such as `A, B, C`.
  pure function list_entries(list) result(words)
    character(*), intent(in) :: list
    type(string_t), allocatable :: words(:)
    integer :: first, length

    allocate (words(0))
    first = 1
    do while (first <= len(list) + 1)
      length = index(list(first:)//",", ",") - 1
      call append_text(words, squeezed(list(first:first + length - 1)))
      first = first + length + 1
    end do
  end function list_entries

  !> The words of a list such as `A, B or C`.
  pure function choice_list(choices) result(words)
    character(*), intent(in) :: choices
    type(string_t), allocatable :: words(:)
    integer :: first, last

    allocate (words(0))
    first = 1
    do while (first <= len(choices))
      last = index(choices(first:)//", ", ", ") + first - 2
      if (last == len(choices)) last = index(choices(first:)//" or ", " or ") + first - 2
      call append_text(words, choices(first:last))
      first = last + merge(3, 5, choices(last + 1:min(last + 1, len(choices))) == ",")
    end do
  end function choice_list

  !> `, did you mean NAME?` for the nearest of the names, empty where none is near.
  pure function did_you_mean(given, names, present_names) result(hint)
    character(*), intent(in) :: given
    type(string_t), intent(in) :: names(:)
    type(string_t), intent(in), optional :: present_names(:)   !! to be suggested instead of these
    character(:), allocatable :: hint
    integer :: i

    hint = nearest_name(given, names)
    if (hint == "") return
    if (present(present_names)) then
      do i = 1, size(names)
        if (names(i)%value == hint) exit
      end do
      hint = present_names(i)%value
    end if
    hint = ", did you mean "//hint//"?"
  end function did_you_mean

  pure logical function is_among(word, words)
    character(*), intent(in) :: word
    type(string_t), intent(in) :: words(:)
    integer :: i

    is_among = .false.
    do i = 1, size(words)
      is_among = is_among .or. words(i)%value == word
    end do
  end function is_among

  !> Is the number in a range such as `> 0`, or `> -1 and < 0.5`? An empty range holds all numbers.
  pure recursive function is_within(number, range) result(is_inside)
    real(wp), intent(in) :: number
    character(*), intent(in) :: range
    logical :: is_inside
    real(wp) :: bound
    integer :: both, blank

    is_inside = range == ""
    if (is_inside) return
    both = index(range, " and ")
    if (both > 0) then
      is_inside = is_within(number, range(:both - 1))
      if (is_inside) is_inside = is_within(number, range(both + 5:))
      return
    end if
    blank = index(range, " ")
    call read_real(range(blank + 1:), bound, is_inside)
    select case (range(:blank - 1))
    case (">"); is_inside = number > bound
    case (">="); is_inside = number >= bound
    case ("<"); is_inside = number < bound
    case ("<="); is_inside = number <= bound
    end select
  end function is_within

  !> Such as `3 data lines of axis, from, to`.
  pure function wanted(line) result(expected)
    type(line_spec_t), intent(in) :: line
    character(:), allocatable :: expected

    expected = counted(line%n_min, "data line")//" of "//field_names(line)
    if (line%n_max == any_number) expected = "at least "//expected
    if (line%is_joinable) expected = expected//", or these at the end of the line before"
  end function wanted

  !> Names of the fields of a form, separated by commas.
  pure function field_names(line) result(names)
    type(line_spec_t), intent(in) :: line
    character(:), allocatable :: names
    integer :: i

    names = line%fields(1)%name
    do i = 2, size(line%fields)
      names = names//", "//line%fields(i)%name
    end do
  end function field_names

  !> May a keyword appear in a step, in the first one at least?
  pure logical function may_be_in_step(keyword)
    type(keyword_spec_t), intent(in) :: keyword

    may_be_in_step = any(keyword%place == [in_first_step, in_any_step, inside_step, needs_step, &
                                           bounds_step])
  end function may_be_in_step

end module keyword_spec
