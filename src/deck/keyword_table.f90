!> The registry of keywords: what a page such as `input/KEYWORDS.md` says of each, and how it is
!! read. Checks, reading, digest and step rules all follow from it.
module keyword_table
  use failure, only: error_t, fail
  use input_errors, only: error_list_t
  use scene, only: scene_t
  use keyword_spec, only: keyword_spec_t
  use keyword_page, only: read_page
  use deck_records, only: parsed_deck_t, deck_context_t
  implicit none
  private

  public :: keyword_table_t, keyword_t, read_keyword, add_keywords, set_keyword

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

  !> All keywords in the order of the page, in which they are also read.
  type :: keyword_table_t
    type(keyword_t), allocatable :: items(:)
    type(error_t), allocatable :: error   !! of a page that has not its form: nothing can be read
  end type keyword_table_t

contains

  !> Add the keywords of a page. Each belongs before the first *STEP and has no reader, unless
  !! `set_keyword` says otherwise.
  subroutine add_keywords(table, page)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: page   !! in the form of `input/KEYWORDS.md`
    type(keyword_spec_t), allocatable :: added(:)
    type(keyword_t), allocatable :: longer(:)
    integer :: i, n

    call read_page(page, added, table%error)
    n = 0
    if (allocated(table%items)) n = size(table%items)
    allocate (longer(n + size(added)))
    if (n > 0) longer(:n) = table%items
    do i = 1, size(added)
      longer(n + i)%keyword_spec_t = added(i)
    end do
    call move_alloc(longer, table%items)
  end subroutine add_keywords

  !> Say of a keyword what its page does not.
  subroutine set_keyword(table, name, place, names, is_required, is_in_digest, n_min, words, read, &
                         read_test)
    type(keyword_table_t), intent(inout) :: table
    character(*), intent(in) :: name
    integer, intent(in), optional :: place           !! where it may appear, such as `in_any_step`
    integer, intent(in), optional :: names           !! what its NAME names, such as `names_tool`
    logical, intent(in), optional :: is_required     !! every deck must have it
    logical, intent(in), optional :: is_in_digest    !! a restart needs it unchanged
    integer, intent(in), optional :: n_min           !! least number of its last data lines
    character(*), intent(in), optional :: words      !! what its free text is, for messages
    procedure(read_keyword), optional :: read, read_test
    integer :: i

    do i = size(table%items), 1, -1
      if (table%items(i)%name == name) exit
    end do
    if (i == 0) then
      if (.not. allocated(table%error)) call fail(table%error, "no section of *"//name)
      return
    end if
    associate (keyword => table%items(i))
      if (present(place)) keyword%place = place
      if (present(names)) keyword%names = names
      if (present(is_required)) keyword%is_required = is_required
      if (present(is_in_digest)) keyword%is_in_digest = is_in_digest
      if (present(n_min)) keyword%lines(size(keyword%lines))%n_min = n_min
      if (present(words)) keyword%lines(1)%fields(1)%name = words
      if (present(read)) keyword%read => read
      if (present(read_test)) keyword%read_test => read_test
    end associate
  end subroutine set_keyword

end module keyword_table
