!> The reference of all keywords as Markdown, made from the keyword table.
module keyword_manual
  use text, only: to_text, lower_case
  use keyword_spec, only: keyword_spec_t, line_spec_t, value_spec_t, kind_flag, kind_name, &
                          kind_words, any_number, selects_lines, may_be_left_out, expectation, &
                          choices_in_words, &
                          may_be_in_step
  use keyword_table, only: keyword_table_t
  use all_keywords, only: list_keywords
  use lexer, only: append_text
  implicit none
  private

  public :: keyword_manual_text

  !> Text that grows at its end.
  type :: page_t
    integer :: n_used = 0
    character(:), allocatable :: characters
  end type page_t

  character(*), parameter :: preface(*) = [character(100) :: &
    "# Keywords of the deck", &
    "", &
    "This page is generated: `igaform --keywords` prints it from the table that the reader uses.", &
    "", &
    "- A line that starts with `*` begins a keyword: `*KEYWORD, OPTION=value, FLAG`. Case does", &
    "  not matter, `_` counts as a space in keywords. A keyword line that ends with a comma", &
    "  continues in the next line.", &
    "- The lines after it are its data. Commas separate the fields; in a line without commas", &
    "  spaces do. An empty field takes its default.", &
    "- Names may contain spaces; a value that contains a comma needs double quotes.", &
    "- Lines that start with `**` or `$` are comments. Empty lines are ignored.", &
    "- The order of keywords is free, but parameters must be defined before they are used, and", &
    "  keywords that belong to another (*DENSITY to *MATERIAL) follow it.", &
    "- Units are up to you but must be consistent, such as mm, t, s, N, MPa, mJ.", &
    "", &
    "All errors of a deck are reported in one go, with file, line, keyword, what was found and", &
    "what was expected. `igaform --check DECK` reads a deck without running it.", &
    "", &
    ""]

contains

  !> The whole page, lines ended by line feeds, of the keywords of the program or of others.
  function keyword_manual_text(keywords) result(manual)
    type(keyword_table_t), intent(in), optional :: keywords
    character(:), allocatable :: manual
    type(keyword_table_t) :: table
    type(page_t) :: page
    integer :: i

    call list_keywords(table, keywords)
    do i = 1, size(preface)
      call put(page, trim(preface(i)))
    end do
    call put(page, "| Keyword | |")
    call put(page, "|---|---|")
    do i = 1, table%n_keywords
      associate (text => table%items(i)%text)
        call put(page, "| [*"//table%items(i)%name//"](#"//anchor(table%items(i)%name)// &
                 ") | "//escaped(text(:first_sentence(text)))//" |")
      end associate
    end do
    do i = 1, table%n_keywords
      call put_keyword(page, table%items(i)%keyword_spec_t)
    end do
    manual = page%characters(:page%n_used)
  end function keyword_manual_text

  pure subroutine put(page, line)
    type(page_t), intent(inout) :: page
    character(*), intent(in) :: line

    call append_text(page%characters, page%n_used, line//new_line("a"))
  end subroutine put

  pure subroutine put_keyword(page, keyword)
    type(page_t), intent(inout) :: page
    type(keyword_spec_t), intent(in) :: keyword
    integer :: i

    call put(page, "")
    call put(page, "## *"//keyword%name)
    call put(page, "")
    call put(page, keyword%text)
    if (keyword%alias /= "") call put(page, "Also: *"//keyword%alias//".")
    if (keyword%parent /= "") call put(page, "Belongs to *"//keyword%parent//".")
    if (keyword%is_unique .and. may_be_in_step(keyword)) then
      call put(page, "Once in a deck, or in a step of it.")
    else if (keyword%is_unique) then
      call put(page, "Once in a deck.")
    end if
    if (size(keyword%options) > 0) then
      call put(page, "")
      call put(page, "| Option | Value | Default | Unit | Meaning |")
      call put(page, "|---|---|---|---|---|")
    end if
    do i = 1, size(keyword%options)
      call put_field(page, keyword%options(i), option_names(keyword%options(i)))
    end do
    do i = 1, size(keyword%lines)
      call put_line(page, keyword, keyword%lines(i))
    end do
    call put(page, "")
    call put(page, "```")
    do i = 1, size(keyword%example)
      call put(page, keyword%example(i)%value)
    end do
    call put(page, "```")
  end subroutine put_keyword

  !> The names of an option.
  pure function option_names(option) result(names)
    type(value_spec_t), intent(in) :: option
    character(:), allocatable :: names

    names = option%name
    if (option%alias /= "") names = names//" (also: "//option%alias//")"
  end function option_names

  pure subroutine put_line(page, keyword, line)
    type(page_t), intent(inout) :: page
    type(keyword_spec_t), intent(in) :: keyword
    type(line_spec_t), intent(in) :: line
    character(:), allocatable :: title, name
    integer :: i

    title = "One data line"
    if (line%n_min == 0 .or. may_be_left_out(line)) title = "Optional data line"
    if (line%is_joinable) title = "One data line, or the end of the line before"
    if (line%n_min > 1) title = to_text(line%n_min)//" data lines"
    if (line%n_max == any_number) then
      title = "Data lines"
      if (line%n_min == 0) title = "Optional data lines"
    end if
    if (line%when /= "") then
      do i = 1, size(keyword%options)
        if (selects_lines(keyword%options(i))) then
          title = title//" ("//keyword%options(i)%name//"="// &
                  choices_in_words(line%when)//")"
        end if
      end do
    end if
    call put(page, "")
    call put(page, trim(title//". "//line%text))
    if (line%fields(1)%kind == kind_words) return
    call put(page, "")
    call put(page, "| Field | Value | Default | Unit | Meaning |")
    call put(page, "|---|---|---|---|---|")
    do i = 1, size(line%fields)
      name = line%fields(i)%name
      if (line%is_repeated .and. i == size(line%fields)) name = name//", ..."
      call put_field(page, line%fields(i), name)
    end do
  end subroutine put_line

  pure subroutine put_field(page, field, name)
    type(page_t), intent(inout) :: page
    type(value_spec_t), intent(in) :: field
    character(*), intent(in) :: name
    character(:), allocatable :: value, default

    value = expectation(field)
    if (field%kind == kind_name) value = "text"
    if (field%kind == kind_flag) value = "none"
    default = field%default
    if (default == "" .and. .not. field%is_required) default = "none"
    if (field%is_required) default = "required"
    call put(page, "| "//name//" | "//value//" | "//default//" | "//field%unit//" | "// &
             escaped(field%text)//" |")
  end subroutine put_field

  !> Length of the first sentence of a text.
  pure integer function first_sentence(text)
    character(*), intent(in) :: text

    first_sentence = index(text, ". ")
    if (first_sentence == 0) first_sentence = len_trim(text)
  end function first_sentence

  !> Bars would end a cell of a table.
  pure function escaped(text) result(safe)
    character(*), intent(in) :: text
    character(:), allocatable :: safe
    character(*), parameter :: escape = achar(92)   ! a backslash: flang's preprocessor doubles it
    integer :: i

    safe = ""
    do i = 1, len_trim(text)
      if (text(i:i) == "|") safe = safe//escape
      safe = safe//text(i:i)
    end do
  end function escaped

  !> What a heading of this name is linked by.
  pure function anchor(name) result(link)
    character(*), intent(in) :: name
    character(:), allocatable :: link
    integer :: i

    link = lower_case(name)
    do i = 1, len(link)
      if (link(i:i) == " ") link(i:i) = "-"
    end do
  end function anchor

end module keyword_manual
