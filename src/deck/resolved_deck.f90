!> A deck as its readers see it: includes and parameters replaced, options and keywords by their
!! present names with defaults, one keyword or data line a line. For programs that read results.
module resolved_deck
  use text, only: to_text
  use deck_records, only: parsed_deck_t, record_t
  implicit none
  private

  public :: resolved_text

  integer, parameter :: most_lines = 500   !! of a keyword; longer lists are geometry, in /nurbs

  !> Lines with space for more.
  type :: buffer_t
    character(:), allocatable :: text
    integer :: n = 0
  end type buffer_t

contains

  !> Lines `*KEYWORD, OPTION=value, FLAG` and `field, field`, each with a line feed. Data of more
  !! than 500 lines are left out.
  pure function resolved_text(deck) result(text)
    type(parsed_deck_t), intent(in) :: deck
    character(:), allocatable :: text
    type(buffer_t) :: buffer
    integer :: i, line

    allocate (character(1000) :: buffer%text)
    do i = 1, size(deck%records)
      associate (record => deck%records(i))
        if (record%spec == 0 .or. .not. record%is_valid) cycle
        if (deck%keywords(record%spec)%name == "PARAMETER") cycle
        call add_line(buffer, head_of(record, deck%keywords(record%spec)%name))
        if (record%n_lines > most_lines) cycle
        do line = 1, record%n_lines
          call add_data(buffer, record, line)
        end do
      end associate
    end do
    text = buffer%text(:buffer%n)
  end function resolved_text

  pure function head_of(record, name) result(line)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name
    character(:), allocatable :: line
    integer :: i

    line = "*"//name
    do i = 1, size(record%options)
      associate (option => record%options(i))
        if (.not. option%is_given) cycle
        line = line//", "//option%name
        if (option%value /= "") line = line//"="//quoted(option%value)
      end associate
    end do
  end function head_of

  !> A data line, field by field, as there may be many.
  pure subroutine add_data(buffer, record, i)
    type(buffer_t), intent(inout) :: buffer
    type(record_t), intent(in) :: record
    integer, intent(in) :: i
    integer :: j

    do j = record%first(i), record%first(i + 1) - 1
      if (j > record%first(i)) call add(buffer, ", ")
      associate (field => record%fields(j))
        if (.not. field%is_filled) cycle
        if (allocated(field%word)) then
          call add(buffer, quoted(field%word))
        else
          call add(buffer, to_text(field%number))
        end if
      end associate
    end do
    call add_line(buffer, "")
  end subroutine add_data

  !> A value in quotes, those inside doubled, where it holds a comma, a quote or a star at its
  !! start.
  pure function quoted(value) result(text)
    character(*), intent(in) :: value
    character(:), allocatable :: text
    integer :: i

    if (scan(value, ',"') == 0 .and. index(value, "*") /= 1) then
      text = value
      return
    end if
    text = '"'
    do i = 1, len(value)
      text = text//value(i:i)
      if (value(i:i) == '"') text = text//'"'
    end do
    text = text//'"'
  end function quoted

  pure subroutine add_line(buffer, line)
    type(buffer_t), intent(inout) :: buffer
    character(*), intent(in) :: line

    call add(buffer, line//new_line("a"))
  end subroutine add_line

  pure subroutine add(buffer, words)
    type(buffer_t), intent(inout) :: buffer
    character(*), intent(in) :: words

    do while (buffer%n + len(words) > len(buffer%text))
      buffer%text = buffer%text//repeat(" ", len(buffer%text))
    end do
    buffer%text(buffer%n + 1:buffer%n + len(words)) = words
    buffer%n = buffer%n + len(words)
  end subroutine add

end module resolved_deck
