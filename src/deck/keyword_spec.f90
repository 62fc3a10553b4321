!> How keywords are described: the types of the keyword table and the calls that fill it.
module keyword_spec
  use text, only: string_t
  implicit none
  private

  public :: field_spec_t, line_spec_t, keyword_spec_t, keyword_table_t
  public :: add_keyword, add_option, add_alias, add_line, add_field, add_example, selects_lines
  public :: may_be_left_out

  integer, parameter, public :: kind_real = 1      !! a number
  integer, parameter, public :: kind_integer = 2   !! a whole number
  integer, parameter, public :: kind_name = 3      !! a name, or a short text in quotes
  integer, parameter, public :: kind_choice = 4    !! one of the words in `choices`
  integer, parameter, public :: kind_flag = 5      !! an option that stands alone
  integer, parameter, public :: kind_words = 6     !! a whole line of free text

  integer, parameter, public :: any_number = huge(1)   !! no limit to the number of data lines

  !> An option of a keyword line or a field of a data line.
  type :: field_spec_t
    character(20) :: name = ""
    character(20) :: alias = ""      !! another name of an option, "": none
    integer :: kind = kind_real
    logical :: is_required = .true.
    character(16) :: default = ""    !! value where the deck gives none, as it would write it
    character(24) :: unit = ""
    character(24) :: range = ""      !! such as `> 0` or `>= 1 and <= 5`
    character(120) :: choices = ""    !! words separated by |
    character(300) :: text = ""      !! meaning
  end type field_spec_t

  !> Data lines of one form; the lines of a keyword follow each other in the order of the table.
  type :: line_spec_t
    character(80) :: when = ""       !! values of TYPE or HARDENING, by |; "": always
    integer :: n_min = 1, n_max = 1  !! how many lines of this form
    logical :: is_repeated = .false. !! the last field may come any number of times
    logical :: is_joinable = .false. !! may stand at the end of the line before, which is one line
    character(300) :: text = ""      !! meaning
    integer :: n_fields = 0
    type(field_spec_t), allocatable :: fields(:)
  end type line_spec_t

  !> One keyword.
  type :: keyword_spec_t
    character(20) :: name = ""
    character(20) :: parent = ""     !! keyword that it must follow, "": none
    logical :: is_unique = .false.   !! may stand only once in a deck
    character(800) :: text = ""      !! meaning
    integer :: n_options = 0, n_lines = 0
    type(field_spec_t), allocatable :: options(:)
    type(line_spec_t), allocatable :: lines(:)
    type(string_t), allocatable :: example(:)
  end type keyword_spec_t

  !> All keywords: the first `n_keywords` of `items`, which grow by doubling.
  type :: keyword_table_t
    integer :: n_keywords = 0
    type(keyword_spec_t), allocatable :: items(:)
  end type keyword_table_t

contains

  !> Begin a keyword; the calls that follow add to it.
  pure subroutine add_keyword(table, name, text, parent, is_unique)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: name, text
    character(*), intent(in), optional :: parent
    logical, intent(in), optional :: is_unique
    type(keyword_spec_t), allocatable :: longer(:)

    if (.not. allocated(table%items)) allocate (table%items(64))
    if (table%n_keywords == size(table%items)) then
      allocate (longer(2*table%n_keywords))
      longer(:table%n_keywords) = table%items
      call move_alloc(longer, table%items)
    end if
    table%n_keywords = table%n_keywords + 1
    associate (keyword => table%items(table%n_keywords))
      keyword%name = name
      keyword%text = text
      if (present(parent)) keyword%parent = parent
      if (present(is_unique)) keyword%is_unique = is_unique
      allocate (keyword%example(0), keyword%options(0), keyword%lines(0))
    end associate
  end subroutine add_keyword

  !> Add an option; without a default it must be given unless `is_required` is false.
  pure subroutine add_option(table, name, kind, text, default, unit, range, choices, is_required)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: name, text
    integer, intent(in) :: kind
    character(*), intent(in), optional :: default, unit, range, choices
    logical, intent(in), optional :: is_required

    associate (keyword => table%items(table%n_keywords))
      call append_field(keyword%options, new_field(name, kind, text, default, unit, range, &
                                                   choices, is_required))
      keyword%n_options = size(keyword%options)
    end associate
  end subroutine add_option

  !> Another name for the option added last.
  pure subroutine add_alias(table, alias)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: alias

    associate (keyword => table%items(table%n_keywords))
      keyword%options(keyword%n_options)%alias = alias
    end associate
  end subroutine add_alias

  !> Begin data lines of one form; one line unless said otherwise.
  pure subroutine add_line(table, text, when, n_min, n_max, is_repeated, is_joinable)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: text
    character(*), intent(in), optional :: when
    integer, intent(in), optional :: n_min, n_max
    logical, intent(in), optional :: is_repeated, is_joinable
    type(line_spec_t) :: line
    type(line_spec_t), allocatable :: longer(:)

    allocate (line%fields(0))
    line%text = text
    if (present(when)) line%when = when
    if (present(n_min)) line%n_min = n_min
    if (present(n_max)) line%n_max = n_max
    if (present(is_repeated)) line%is_repeated = is_repeated
    if (present(is_joinable)) line%is_joinable = is_joinable
    associate (keyword => table%items(table%n_keywords))
      keyword%n_lines = keyword%n_lines + 1
      allocate (longer(keyword%n_lines))
      longer(:keyword%n_lines - 1) = keyword%lines
      longer(keyword%n_lines) = line
      call move_alloc(longer, keyword%lines)
    end associate
  end subroutine add_line

  !> Add a field to the data line begun last.
  pure subroutine add_field(table, name, kind, text, default, unit, range, choices, is_required)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: name, text
    integer, intent(in) :: kind
    character(*), intent(in), optional :: default, unit, range, choices
    logical, intent(in), optional :: is_required

    associate (keyword => table%items(table%n_keywords))
      associate (line => keyword%lines(keyword%n_lines))
        call append_field(line%fields, new_field(name, kind, text, default, unit, range, &
                                                 choices, is_required))
        line%n_fields = size(line%fields)
      end associate
    end associate
  end subroutine add_field

  pure subroutine append_field(fields, field)
    type(field_spec_t), allocatable, intent(inout) :: fields(:)
    type(field_spec_t), intent(in) :: field
    type(field_spec_t), allocatable :: longer(:)

    allocate (longer(size(fields) + 1))
    longer(:size(fields)) = fields
    longer(size(longer)) = field
    call move_alloc(longer, fields)
  end subroutine append_field

  !> Add a line to the example of the keyword.
  pure subroutine add_example(table, line)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: line
    type(string_t) :: added   ! gfortran 12 leaks a structure constructor in an array constructor

    added%value = line
    associate (keyword => table%items(table%n_keywords))
      keyword%example = [keyword%example, added]
    end associate
  end subroutine add_example

  !> Does the value of this option decide which data lines there are?
  pure logical function selects_lines(option)
    type(field_spec_t), intent(in) :: option

    selects_lines = option%name == "TYPE" .or. option%name == "HARDENING"
  end function selects_lines

  !> May the line be missing, because all that it would say has a default?
  pure logical function may_be_left_out(line)
    type(line_spec_t), intent(in) :: line

    may_be_left_out = line%n_max == 1 .and. line%n_fields > 0
    if (may_be_left_out) may_be_left_out = all(line%fields(:line%n_fields)%default /= "")
  end function may_be_left_out

  pure function new_field(name, kind, text, default, unit, range, choices, is_required) &
      result(field)
    character(*), intent(in) :: name, text
    integer, intent(in) :: kind
    character(*), intent(in), optional :: default, unit, range, choices
    logical, intent(in), optional :: is_required
    type(field_spec_t) :: field

    field%name = name
    field%kind = kind
    field%text = text
    field%is_required = kind /= kind_flag .and. .not. present(default)
    if (present(default)) field%default = default
    if (present(unit)) field%unit = unit
    if (present(range)) field%range = range
    if (present(choices)) field%choices = choices
    if (present(is_required)) field%is_required = is_required
  end function new_field

end module keyword_spec
