!> Free-form lists of values: delimited numbers and Hollerith texts such as 3HABC (IGES 5.3,
!! section 2.2.3).
module iges_tokens
  use text, only: to_text, read_integer
  implicit none
  private

  public :: token_list_t, split_tokens, token_text

  !> Values by their place in a text; a value that is left to its default has no characters.
  type :: token_list_t
    character(:), allocatable :: text
    integer :: n = 0
    integer, allocatable :: first(:), last(:)    !! shape (n)
    logical, allocatable :: is_text(:)           !! Hollerith, first and last without its count
  end type token_list_t

  character(*), parameter :: digits = "0123456789"

contains

  !> Split a text up to its record delimiter. `problem` is empty, or says what is wrong at `place`.
  pure subroutine split_tokens(text, delimiters, tokens, problem, expected, place)
    character(*), intent(in) :: text
    character(2), intent(in) :: delimiters   !! between values, behind the last
    type(token_list_t), intent(out) :: tokens
    character(:), allocatable, intent(out) :: problem, expected
    integer, intent(out) :: place            !! in the text
    integer :: most

    most = 1 + count_of(text, delimiters(1:1))
    tokens%text = text
    allocate (tokens%first(most), tokens%last(most), tokens%is_text(most))
    problem = ""
    expected = ""
    place = 1
    do
      place = next_filled(text, place)
      if (place > len(text)) then
        problem = "the end of the record without its delimiter"
        expected = "`"//delimiters(2:2)//"` behind the last value"
        return
      end if
      tokens%n = tokens%n + 1
      call take_value(text, delimiters, place, tokens, problem, expected)
      if (problem /= "") return
      place = place + 1
      if (text(place - 1:place - 1) == delimiters(2:2)) exit
    end do
  end subroutine split_tokens

  !> A value as it stands in the file; empty if it is left to its default.
  pure function token_text(tokens, i) result(value)
    type(token_list_t), intent(in) :: tokens
    integer, intent(in) :: i
    character(:), allocatable :: value

    value = ""
    if (i >= 1 .and. i <= tokens%n) value = tokens%text(tokens%first(i):tokens%last(i))
  end function token_text

  !> Take the value at `place` and go to the delimiter behind it.
  pure subroutine take_value(text, delimiters, place, tokens, problem, expected)
    character(*), intent(in) :: text
    character(2), intent(in) :: delimiters
    integer, intent(inout) :: place
    type(token_list_t), intent(inout) :: tokens
    character(:), allocatable, intent(inout) :: problem, expected
    integer :: length, n_digits
    logical :: is_number

    n_digits = verify(text(place:), digits) - 1
    if (n_digits < 0) n_digits = 0
    associate (first => tokens%first(tokens%n), last => tokens%last(tokens%n))
      first = place
      tokens%is_text(tokens%n) = .false.
      if (n_digits > 0) tokens%is_text(tokens%n) = index(text(place + n_digits:), "H") == 1
      if (.not. tokens%is_text(tokens%n)) then
        length = scan(text(place:), delimiters) - 1
        if (length < 0) length = len(text) - place + 1
        last = place + len_trim(text(place:place + length - 1)) - 1
        place = place + length
      else
        call read_integer(text(place:place + n_digits - 1), length, is_number)
        first = place + n_digits + 1
        if (.not. is_number .or. length > len(text) - first + 1) then
          problem = "a text of "//text(place:place + min(n_digits, 12) - 1)//" characters"
          expected = "at most the "//to_text(len(text) - first + 1)//" that the record still has"
          return
        end if
        last = first + length - 1
        place = next_filled(text, last + 1)
      end if
    end associate
    if (place > len(text)) then
      problem = "the end of the record without its delimiter"
      expected = "`"//delimiters(2:2)//"` behind the last value"
    else if (scan(text(place:place), delimiters) == 0) then
      problem = "`"//text(place:place)//"` behind a text"
      expected = "`"//delimiters(1:1)//"` or `"//delimiters(2:2)//"`"
    end if
  end subroutine take_value

  !> The first place from `place` on that is not blank; beyond the end if there is none.
  pure integer function next_filled(text, place)
    character(*), intent(in) :: text
    integer, intent(in) :: place
    integer :: offset

    next_filled = len(text) + 1
    if (place > len(text)) return
    offset = verify(text(place:), " ")
    if (offset > 0) next_filled = place + offset - 1
  end function next_filled

  pure integer function count_of(text, character)
    character(*), intent(in) :: text
    character(1), intent(in) :: character
    integer :: i

    count_of = 0
    do i = 1, len(text)
      if (text(i:i) == character) count_of = count_of + 1
    end do
  end function count_of

end module iges_tokens
