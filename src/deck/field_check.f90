!> Check of one option value or data field against its entry in the keyword table.
module field_check
  use kinds, only: wp
  use text, only: string_t, read_real, read_integer, upper_case, squeezed, nearest_name
  use keyword_spec, only: field_spec_t, kind_real, kind_integer, kind_choice
  implicit none
  private

  public :: check_field, expectation, choice_list, did_you_mean

contains

  !> Take the value of a field; what is wrong with it comes back in `found` and `expected`.
  pure subroutine check_field(spec, given, number, word, found, expected)
    type(field_spec_t), intent(in) :: spec
    character(*), intent(in) :: given
    real(wp), intent(out) :: number                          !! of a number field, else 0
    character(:), allocatable, intent(inout) :: word         !! set for all other fields
    character(:), allocatable, intent(inout) :: found, expected   !! set if there is an error
    real(wp), parameter :: longest = 1.0e50_wp   ! its sixth power, a squared volume, is a number
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
    case (kind_choice)
      word = squeezed(upper_case(given))
      is_good = is_among(word, choice_list(spec))
    case default
      word = given
    end select
    if (is_good .and. (spec%kind == kind_real .or. spec%kind == kind_integer)) then
      is_good = is_within(number, trim(spec%range))
    end if
    if (is_good .and. .not. (spec%unit == "length" .and. abs(number) > longest)) return
    found = "`"//given//"` for "//trim(spec%name)
    expected = expectation(spec)
    if (is_good) expected = "a length below 1e50"
    if (spec%kind == kind_choice) expected = expected//did_you_mean(given, choice_list(spec))
  end subroutine check_field

  !> What a field may hold, such as `a number > 0`.
  pure function expectation(spec) result(expected)
    type(field_spec_t), intent(in) :: spec
    character(:), allocatable :: expected
    type(string_t), allocatable :: words(:)
    integer :: i

    select case (spec%kind)
    case (kind_real)
      expected = trim("a number "//spec%range)
    case (kind_integer)
      expected = trim("a whole number "//spec%range)
    case (kind_choice)
      words = choice_list(spec)
      expected = words(1)%value
      do i = 2, size(words) - 1
        expected = expected//", "//words(i)%value
      end do
      if (size(words) > 1) expected = expected//" or "//words(size(words))%value
    case default
      expected = "a name"
    end select
  end function expectation

  !> The words that a choice allows.
  pure function choice_list(spec) result(words)
    type(field_spec_t), intent(in) :: spec
    type(string_t), allocatable :: words(:)
    character(:), allocatable :: rest
    integer :: i, bar

    rest = trim(spec%choices)//"|"
    allocate (words(count([(rest(i:i) == "|", i=1, len(rest))])))
    do i = 1, size(words)
      bar = index(rest, "|")
      words(i)%value = rest(:bar - 1)
      rest = rest(bar + 1:)
    end do
  end function choice_list

  !> `, did you mean NAME?` for the nearest of the names, empty where none is near.
  pure function did_you_mean(given, names) result(hint)
    character(*), intent(in) :: given
    type(string_t), intent(in) :: names(:)
    character(:), allocatable :: hint

    hint = nearest_name(given, names)
    if (hint /= "") hint = ", did you mean "//hint//"?"
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

end module field_check
