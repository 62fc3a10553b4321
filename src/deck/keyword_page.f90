!> From `input/KEYWORDS.md` to the descriptions that decks are checked against: the page that a user
!! reads is the table that the program uses. What does not have the form of the page is an error.
module keyword_page
  use failure, only: error_t, fail
  use text, only: read_integer
  use text_file, only: next_line
  use keyword_spec, only: keyword_spec_t, line_spec_t, value_spec_t, kind_real, kind_integer, &
                          kind_name, kind_choice, kind_flag, kind_list, kind_words, any_number
  implicit none
  private

  public :: read_page

  character(*), parameter :: heading = new_line("a")//"## *"

contains

  !> The keywords of a page, each from its heading `## *NAME` to the next; none if one of them is
  !! wrong.
  subroutine read_page(page, keywords, error)
    character(*), intent(in) :: page
    type(keyword_spec_t), allocatable, intent(out) :: keywords(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: i, first, length

    allocate (keywords(n_headings(page)))
    first = index(page, heading) + 1
    do i = 1, size(keywords)
      length = index(page(first:), heading) - 1
      if (length < 0) length = len(page) - first + 1
      keywords(i)%page = page(first:first + length - 1)
      call read_keyword(keywords(i), error)
      if (allocated(error)) then
        keywords = keywords(:0)
        return
      end if
      first = first + length + 1
    end do
  end subroutine read_page

  pure integer function n_headings(page)
    character(*), intent(in) :: page
    integer :: place, step

    n_headings = -1
    place = 1
    step = 1
    do while (step > 0)
      n_headings = n_headings + 1
      step = index(page(place:), heading)
      place = place + step
    end do
  end function n_headings

  !> One keyword: its meaning in one line, what else is said of it, its options, its forms of data
  !! lines with their fields, and an example.
  subroutine read_keyword(keyword, error)
    type(keyword_spec_t), intent(inout) :: keyword   !! its page on entry
    type(error_t), allocatable, intent(out) :: error
    type(line_spec_t) :: form
    character(:), allocatable :: line
    integer :: place, n

    allocate (keyword%options(0), keyword%lines(0))
    keyword%alias = ""
    keyword%parent = ""
    place = 1
    call next_line(keyword%page, place, line)
    keyword%name = line(len(heading):)
    call next_line(keyword%page, place, line)
    call next_line(keyword%page, place, keyword%text)
    do while (place <= len(keyword%page) .and. .not. allocated(error))
      call next_line(keyword%page, place, line)
      n = size(keyword%lines)
      if (begins(line, "```")) then
        return
      else if (begins(line, "Also: *")) then
        keyword%alias = line(8:len(line) - 1)
      else if (begins(line, "Belongs to *")) then
        keyword%parent = line(13:len(line) - 1)
      else if (begins(line, "Once in a deck")) then
        keyword%is_unique = .true.
      else if (begins(line, "| Option |")) then
        call read_rows(keyword%page, place, keyword%options, error)
      else if (begins(line, "| Field |") .and. n > 0) then
        call read_rows(keyword%page, place, keyword%lines(n)%fields, error)
        if (.not. allocated(error)) call end_repeated(keyword%lines(n))
      else if (line /= "") then
        call read_form(line, form, error)
        keyword%lines = [keyword%lines, form]
      end if
    end do
    if (.not. allocated(error)) call fail(error, "no example of *"//keyword%name)
  end subroutine read_keyword

  pure logical function begins(line, words)
    character(*), intent(in) :: line, words

    begins = .false.
    if (len(line) >= len(words)) begins = line(:len(words)) == words
  end function begins

  !> How many data lines a form has, and with which values of TYPE or HARDENING: such as
  !! `One data line (TYPE=DISK or BAR). Meaning`. Without a table of fields they are free text.
  subroutine read_form(line, form, error)
    character(*), intent(in) :: line
    type(line_spec_t), intent(out) :: form
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: title
    integer :: bracket
    logical :: is_number

    title = line(:index(line//".", ".") - 1)
    bracket = index(title//" (", " (")
    form%when = ""
    if (bracket < len(title)) form%when = title(index(title, "=") + 1:len(title) - 1)
    select case (title(:bracket - 1))
    case ("One data line")
    case ("One data line, or the end of the line before"); form%is_joinable = .true.
    case ("Optional data line"); form%n_min = 0
    case ("Data lines"); form%n_max = any_number
    case ("Optional data lines")
      form%n_min = 0
      form%n_max = any_number
    case default
      call read_integer(title(:index(title, " data lines") - 1), form%n_min, is_number)
      form%n_max = form%n_min
      if (.not. is_number) call fail(error, "no number of data lines in `"//line//"`")
    end select
    allocate (form%fields(1))
    associate (field => form%fields(1))
      field%name = "text"
      field%kind = kind_words
      field%is_required = form%n_min > 0
      field%alias = ""
      field%default = ""
      field%unit = ""
      field%allowed = "a name"
      field%range = ""
    end associate
  end subroutine read_form

  !> The name `value, ...` of the last field says that it may be repeated.
  subroutine end_repeated(form)
    type(line_spec_t), intent(inout) :: form
    character(*), parameter :: mark = ", ..."

    associate (last => form%fields(size(form%fields)))
      form%is_repeated = index(last%name, mark) > 0
      if (form%is_repeated) last%name = last%name(:index(last%name, mark) - 1)
    end associate
  end subroutine end_repeated

  !> The rows of a table below its head.
  subroutine read_rows(page, place, values, error)
    character(*), intent(in) :: page
    integer, intent(inout) :: place
    type(value_spec_t), allocatable, intent(out) :: values(:)
    type(error_t), allocatable, intent(out) :: error
    type(value_spec_t) :: value
    character(:), allocatable :: line

    allocate (values(0))
    call next_line(page, place, line)   ! |---|
    do while (begins(page(place:), "| "))
      call next_line(page, place, line)
      call read_row(line, value, error)
      if (allocated(error)) return
      values = [values, value]
    end do
    if (size(values) == 0) call fail(error, "no row in a table of `"//page//"`")
  end subroutine read_rows

  !> Such as `| width (also: W) | a number > 0 | required | length | meaning |`.
  subroutine read_row(line, value, error)
    character(*), intent(in) :: line
    type(value_spec_t), intent(out) :: value
    type(error_t), allocatable, intent(out) :: error
    character(*), parameter :: also = " (also: ", letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
    character(*), parameter :: list = "a list of "
    integer :: first, bracket
    logical :: is_complete

    first = 3
    is_complete = .true.
    call read_cell(value%name)
    call read_cell(value%allowed)
    call read_cell(value%default)
    call read_cell(value%unit)
    value%alias = ""
    bracket = index(value%name, also)
    if (bracket > 0) then
      value%alias = value%name(bracket + len(also):len(value%name) - 1)
      value%name = value%name(:bracket - 1)
    end if
    value%is_required = value%default == "required"
    if (value%is_required .or. value%default == "none") value%default = ""
    value%range = ""
    if (value%allowed == "text") then
      value%kind = kind_name
      value%allowed = "a name"
    else if (value%allowed == "none") then
      value%kind = kind_flag
    else if (begins(value%allowed, "a number")) then
      value%kind = kind_real
      value%range = trim(adjustl(value%allowed(9:)))
    else if (begins(value%allowed, "a whole number")) then
      value%kind = kind_integer
      value%range = trim(adjustl(value%allowed(15:)))
    else
      value%kind = kind_choice
      if (begins(value%allowed, list)) then
        value%kind = kind_list
        value%allowed = value%allowed(len(list) + 1:)
      end if
      is_complete = is_complete .and. scan(value%allowed, letters) == 1
    end if
    if (.not. is_complete) &
      call fail(error, "not a name, a value, a default, a unit and a meaning in `"//line//"`")

  contains

    !> The text up to the next bar.
    subroutine read_cell(cell)
      character(:), allocatable, intent(out) :: cell
      integer :: length

      length = index(line(first:), " | ") - 1
      is_complete = is_complete .and. length >= 0
      cell = line(first:first + length - 1)
      first = min(first + max(length, 0) + 3, len(line) + 1)
    end subroutine read_cell

  end subroutine read_row

end module keyword_page
