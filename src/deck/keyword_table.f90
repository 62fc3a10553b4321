!> The registry of keywords: one entry for each, which describes the keyword and names its reader.
!!
!! A family of keywords adds its entries with the calls of this module. Checks, reading, digest,
!! step rules and the manual of keywords all follow from the entries.
module keyword_table
  use input_errors, only: error_list_t
  use text, only: string_t
  use scene, only: scene_t
  use keyword_spec, only: keyword_spec_t, value_spec_t, line_spec_t, kind_real, kind_integer, &
                          kind_name, kind_choice, kind_flag, kind_words, any_number, &
                          before_steps, in_first_step, in_any_step, inside_step, needs_step, &
                          bounds_step, anywhere, names_nothing, names_material, names_curve, &
                          names_patch, names_tool, names_set, names_point
  use deck_records, only: parsed_deck_t, deck_context_t
  implicit none
  private

  public :: keyword_table_t, keyword_t, read_keyword, add_keyword, add_option, add_line, add_field
  public :: add_vector, add_example
  public :: kind_real, kind_integer, kind_name, kind_choice, kind_flag, kind_words, any_number
  public :: before_steps, in_first_step, in_any_step, inside_step, needs_step, bounds_step, anywhere
  public :: names_nothing, names_material, names_curve, names_patch, names_tool, names_set
  public :: names_point

  abstract interface
    !> Read all records of a keyword into the scene. It is called once, also for a deck without
    !! the keyword, after the readers of the entries before it.
    subroutine read_keyword(deck, context, scene, errors)
      import :: parsed_deck_t, deck_context_t, scene_t, error_list_t
      type(parsed_deck_t), intent(in) :: deck
      type(deck_context_t), intent(inout) :: context
      type(scene_t), intent(inout) :: scene
      type(error_list_t), intent(inout) :: errors
    end subroutine read_keyword
  end interface

  !> One entry: the description of a keyword and its readers. A keyword without a reader is read
  !! together with another one.
  type, extends(keyword_spec_t) :: keyword_t
    procedure(read_keyword), pointer, nopass :: read => null()        !! for a forming run
    procedure(read_keyword), pointer, nopass :: read_test => null()   !! for tests of materials
  end type keyword_t

  !> All keywords in the order of the manual, in which they are also read: the first `n_keywords`
  !! of `items`.
  type :: keyword_table_t
    integer :: n_keywords = 0
    type(keyword_t), allocatable :: items(:)
  end type keyword_table_t

contains

  !> Begin a keyword; the calls that follow add to it. By default a keyword belongs before the first
  !! *STEP, any number of times.
  subroutine add_keyword(table, name, text, parent, alias, place, names, is_unique, is_required, &
                         is_in_digest, read, read_test)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: name, text
    character(*), intent(in), optional :: parent, alias
    integer, intent(in), optional :: place, names
    logical, intent(in), optional :: is_unique, is_required, is_in_digest
    procedure(read_keyword), optional :: read, read_test
    type(keyword_t), allocatable :: longer(:)

    if (.not. allocated(table%items)) allocate (table%items(16))
    if (table%n_keywords == size(table%items)) then
      allocate (longer(2*table%n_keywords))
      longer(:table%n_keywords) = table%items
      call move_alloc(longer, table%items)
    end if
    table%n_keywords = table%n_keywords + 1
    associate (keyword => table%items(table%n_keywords))
      keyword%name = name
      keyword%text = text
      keyword%parent = given(parent)
      keyword%alias = given(alias)
      if (present(place)) keyword%place = place
      if (present(names)) keyword%names = names
      if (present(is_unique)) keyword%is_unique = is_unique
      if (present(is_required)) keyword%is_required = is_required
      if (present(is_in_digest)) keyword%is_in_digest = is_in_digest
      if (present(read)) keyword%read => read
      if (present(read_test)) keyword%read_test => read_test
      allocate (keyword%example(0), keyword%options(0), keyword%lines(0))
    end associate
  end subroutine add_keyword

  !> Add an option to the last keyword; without a default it must be given unless `is_required` is
  !! false.
  pure subroutine add_option(table, name, kind, text, default, unit, range, choices, is_required, &
                             alias)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: name, text
    integer, intent(in) :: kind
    character(*), intent(in), optional :: default, unit, range, choices, alias
    logical, intent(in), optional :: is_required

    call append_field(table%items(table%n_keywords)%options, name, kind, text, default, unit, &
                      range, choices, is_required, alias)
  end subroutine add_option

  !> Begin data lines of one form; one line unless said otherwise.
  pure subroutine add_line(table, text, when, n_min, n_max, is_repeated, is_joinable)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: text
    character(*), intent(in), optional :: when
    integer, intent(in), optional :: n_min, n_max
    logical, intent(in), optional :: is_repeated, is_joinable
    type(line_spec_t), allocatable :: longer(:)
    integer :: n

    associate (keyword => table%items(table%n_keywords))
      n = size(keyword%lines) + 1
      allocate (longer(n))
      longer(:n - 1) = keyword%lines
      longer(n)%text = text
      longer(n)%when = given(when)
      allocate (longer(n)%fields(0))
      if (present(n_min)) longer(n)%n_min = n_min
      if (present(n_max)) longer(n)%n_max = n_max
      if (present(is_repeated)) longer(n)%is_repeated = is_repeated
      if (present(is_joinable)) longer(n)%is_joinable = is_joinable
      call move_alloc(longer, keyword%lines)
    end associate
  end subroutine add_line

  !> Add a field to the last data line.
  pure subroutine add_field(table, name, kind, text, default, unit, range, choices, is_required)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: name, text
    integer, intent(in) :: kind
    character(*), intent(in), optional :: default, unit, range, choices
    logical, intent(in), optional :: is_required

    associate (lines => table%items(table%n_keywords)%lines)
      call append_field(lines(size(lines))%fields, name, kind, text, default, unit, range, &
                        choices, is_required)
    end associate
  end subroutine add_field

  !> Add three number fields for a vector, named `prefix` with x, y and z; lengths by default.
  pure subroutine add_vector(table, prefix, text, unit, default)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: prefix, text
    character(*), intent(in), optional :: unit, default
    character(*), parameter :: axes = "xyz"
    character(:), allocatable :: own_unit
    integer :: i

    own_unit = "length"
    if (present(unit)) own_unit = unit
    do i = 1, 3
      call add_field(table, prefix//axes(i:i), kind_real, text, unit=own_unit, default=default)
    end do
  end subroutine add_vector

  pure subroutine append_field(fields, name, kind, text, default, unit, range, choices, &
                               is_required, alias)
    type(value_spec_t), allocatable, intent(inout) :: fields(:)
    character(*), intent(in) :: name, text
    integer, intent(in) :: kind
    character(*), intent(in), optional :: default, unit, range, choices, alias
    logical, intent(in), optional :: is_required
    type(value_spec_t), allocatable :: longer(:)
    integer :: n

    n = size(fields) + 1
    allocate (longer(n))
    longer(:n - 1) = fields
    longer(n)%name = name
    longer(n)%kind = kind
    longer(n)%text = text
    longer(n)%is_required = kind /= kind_flag .and. .not. present(default)
    longer(n)%default = given(default)
    longer(n)%unit = given(unit)
    longer(n)%range = given(range)
    longer(n)%choices = given(choices)
    longer(n)%alias = given(alias)
    if (present(is_required)) longer(n)%is_required = is_required
    call move_alloc(longer, fields)
  end subroutine append_field

  !> A text that is optional, empty where it is not given.
  pure function given(words) result(own)
    character(*), intent(in), optional :: words
    character(:), allocatable :: own

    own = ""
    if (present(words)) own = words
  end function given

  !> Add lines to the example of the last keyword.
  pure subroutine add_example(table, first, second, third, fourth, fifth, sixth)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: first
    character(*), intent(in), optional :: second, third, fourth, fifth, sixth

    associate (keyword => table%items(table%n_keywords))
      call append(keyword%example, first)
      call append(keyword%example, second)
      call append(keyword%example, third)
      call append(keyword%example, fourth)
      call append(keyword%example, fifth)
      call append(keyword%example, sixth)
    end associate
  end subroutine add_example

  pure subroutine append(example, line)
    type(string_t), allocatable, intent(inout) :: example(:)
    character(*), intent(in), optional :: line
    type(string_t) :: added   ! gfortran 12 leaks a structure constructor in an array constructor

    if (.not. present(line)) return
    added%value = line
    example = [example, added]
  end subroutine append

end module keyword_table
