!> The forms of data lines in words, for messages.
module form_words
  use text, only: to_text
  use keyword_spec, only: line_spec_t, any_number
  implicit none
  private

  public :: wanted, lines_in_words, field_names

contains

  !> Such as `3 data lines of axis, from, to`.
  pure function wanted(line) result(expected)
    type(line_spec_t), intent(in) :: line
    character(:), allocatable :: expected

    expected = lines_in_words(line%n_min)//" of "//field_names(line)
    if (line%n_max == any_number) expected = "at least "//expected
    if (line%is_joinable) expected = expected//", or these at the end of the line before"
  end function wanted

  !> Such as `1 data line`.
  pure function lines_in_words(n) result(words)
    integer, intent(in) :: n
    character(:), allocatable :: words

    words = to_text(n)//" data line"
    if (n /= 1) words = words//"s"
  end function lines_in_words

  !> Names of the fields of a form, separated by commas.
  pure function field_names(line) result(names)
    type(line_spec_t), intent(in) :: line
    character(:), allocatable :: names
    integer :: i

    names = trim(line%fields(1)%name)
    do i = 2, line%n_fields
      names = names//", "//trim(line%fields(i)%name)
    end do
  end function field_names

end module form_words
